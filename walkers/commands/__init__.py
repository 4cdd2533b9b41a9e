"""The commands, one a module: each a few lines around functions that can be called from Python."""
