"""Vessels of the user's own: mesh files, the inner surface of a vessel, its faces and edges."""
