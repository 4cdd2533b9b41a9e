"""The walker's theory: the paper's model, what it leaves out (Coulomb friction, weight, detachment), and its alignment.

Knows cases (`inputs`) and nothing of the engine; what both say of a case is compared by others.
"""
