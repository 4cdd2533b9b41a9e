"""Sweeps run many cases in shared decks, on this machine or on a cluster.

This package also lists, compares and draws their results. It uses the packages for cases, decks,
run directories and results.
"""
