"""What follows from a case file: library values, defaults, loads of contacts, where beads start."""
