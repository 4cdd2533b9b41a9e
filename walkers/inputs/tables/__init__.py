"""What a case file says: its tables, their keys, and the case that they make together."""
