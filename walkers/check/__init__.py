"""Checks: the engine against a second engine from published formulas, and the second engine against the literature.

`audit` compares forces on small decks, `crosscheck` whole runs; `benchmarks` and `bridges` have published numbers and
exact solutions. The second engine is `engine` and its formulas, `kernels`: of the bridges it takes the law
(`walkers.physics.laws`), which it interpolates in its own way, and nothing of the decks.
"""

from walkers.extras import require

require("check")
