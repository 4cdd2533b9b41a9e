"""Checks: the engine against a second engine from published formulas, and the second engine against the literature.

`audit` compares forces on small decks, `crosscheck` whole runs; `benchmarks` and `bridges` have published numbers and
exact solutions. The second engine is `engine` with its formulas in `kernels`. It uses the bridge laws
(`walkers.physics.laws`) with its own interpolation, and no part of the decks.
"""

from walkers.extras import require

require("check")
