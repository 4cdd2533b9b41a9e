"""Sweeps: many cases at once, packed into decks, spread over the machine or a cluster, and found again.

Stands on all the packages before it: cases, decks, run directories and what they mean.
"""
