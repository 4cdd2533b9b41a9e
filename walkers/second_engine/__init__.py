"""Checks of the installed engine by a second engine from published formulas.

`audit` compares forces on small decks, `crosscheck` whole runs. The second engine is `engine` with its formulas in
`kernels`. It uses the bridge laws (`walkers.physics.laws`) with its own interpolation, and no part of the decks.
"""

from walkers.extras import require

require("check")
