"""Theory of walkers: the model of the paper, extensions (Coulomb friction, weight, detachment), and
alignment.

Uses cases (`inputs`), not the engine; other packages compare theory and engine.
"""
