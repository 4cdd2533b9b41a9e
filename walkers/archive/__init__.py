"""Archives: a run or a sweep with its inputs and outputs in one zip file, with checksums.

`writing` makes them and `verification` checks them.
"""
