"""Sweeps: run many cases in shared decks, on this machine or a cluster; list, compare and draw their results.

Uses the packages for cases, decks, run directories and results.
"""
