"""Archives: a run or a sweep with its inputs and outputs in one file, described as an RO-Crate."""
