"""Archives: a run or a sweep with all that it was made of, described as an RO-Crate, to be kept and used again."""
