"""What follows from a case file: values of the library, defaults, loads of contacts, and where
beads start.
"""
