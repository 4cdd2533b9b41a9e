"""Checks from outside: published benchmarks, exact solutions and an engine of our own beside what the decks compute.

Nothing here runs a case or changes a number; each study gives a chapter of docs/validation.md.
"""
