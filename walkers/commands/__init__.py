"""The commands: each a few lines around functions that can be called from Python."""
