"""The shapes of boundaries, a module each, and the walls of which they are made."""
