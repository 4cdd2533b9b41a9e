"""Checks of the installed engine by a second engine from published formulas.

`audit` compares forces on small decks, `crosscheck` whole runs. The second engine is `engine`, with
its formulas in `kernels`. It shares the bridge laws (`walkers.physics.laws`) with the program, but
interpolates them on its own, and uses no part of the decks.
"""

from walkers.extras import require

require("check")
