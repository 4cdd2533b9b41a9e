"""The paper beside this project: its figures with engine, theory and published values, and how far each number is.

Stands on `sweeps` (the engine's numbers) and `theory`; whatever it shows is made from finished sweeps.
"""
