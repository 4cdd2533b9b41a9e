"""Theory of walkers: the model of the paper, extensions (Coulomb friction, weight, detachment), and alignment.

Knows cases (`inputs`) and nothing of the engine; what both say of a case is compared by others.
"""
