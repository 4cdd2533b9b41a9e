"""Comparison with the paper: its figures with engine, theory and published values, and the deviation of each number.

Stands on `sweeps` (the engine's numbers) and `theory`; whatever it shows is made from finished sweeps.
"""
