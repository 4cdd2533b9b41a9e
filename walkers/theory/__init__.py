"""Theory of walkers: the model of the paper, Coulomb friction, weight, and alignment.

Uses cases (`inputs`), not the engine; other packages compare theory and engine.
"""
