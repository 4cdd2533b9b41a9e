"""Runs: decks in run directories, launched, watched, and finished or failed.

Knows cases and decks (`inputs`, `templates`); knows nothing of what the dumps mean.
"""
