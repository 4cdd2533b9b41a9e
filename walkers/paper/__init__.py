"""Comparison with the paper: its figures with engine, theory and published values, and the deviation of each number.

Uses finished sweeps (the numbers of the engine) and `walkers.theory`.
"""
