"""Checks from outside: published benchmarks, exact solutions and an engine of our own beside what the decks compute.

Nothing leans on them; each gives a chapter of docs/explanation/validation.md.
"""
