"""One run: previewed, made, split, compared, taken in from a deck that was run by hand."""
