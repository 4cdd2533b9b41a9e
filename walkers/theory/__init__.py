"""Theory of walkers: the model of the paper, sliding friction, weight, and alignment.

Uses cases (`inputs`), not the engine; other packages compare theory and engine.
"""
