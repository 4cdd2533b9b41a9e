"""How the MPI processes (ranks) of a run share the floor of a container."""

from __future__ import annotations

from walkers.errors import key_error
from walkers.inputs.tables.case import Case

SKIN = 2e-4
"""Distance beyond contact within which the neighbours of loose beads are searched, m.

From 0.1 to 0.3 mm, the time of a step changes by a few per cent.
"""


def processor_grid(ranks: int, width: float, depth: float) -> tuple[int, int]:
    """Numbers of parts along x and y that need the shortest cuts through the box.

    Each rank has a part. The box is not cut along z: beads lie at its bottom, and ranks above
    them would wait.

    Parameters
    ----------
    ranks
        Number of ranks.
    width, depth
        Size of the box along x and y, m.
    """

    def length_of_cuts(along_x: int) -> float:
        """Length of all cuts with so many parts along x, m."""
        return (along_x - 1) * depth + (ranks // along_x - 1) * width

    divisors = [divisor for divisor in range(ranks, 0, -1) if ranks % divisor == 0]
    along_x = min(divisors, key=length_of_cuts)
    return along_x, ranks // along_x


def check_ranks(case: Case) -> None:
    """Refuse ranks whose parts of the floor are too narrow, and several without a container.

    In a part that is narrower than the distance within which neighbours are searched, ranks would
    exchange most of their beads in each step, over several neighbours.

    Raises
    ------
    InputError
        For such ranks.
    """
    ranks = case.run.ranks
    if ranks == 1:
        return
    if not case.boundary.closed:
        raise key_error(
            "run.ranks", "expected 1: walkers on a plane run slower on several processes"
        )
    largest = max(case.radii)
    low, high = case.boundary.geometry.simulation_box(0.0, 0.0, 0.0, 0.0, largest)
    width = high[0] - low[0]
    depth = high[1] - low[1]
    along_x, along_y = processor_grid(ranks, width, depth)
    narrowest = min(width / along_x, depth / along_y)
    searched = 2.0 * largest + SKIN
    if narrowest < searched:
        raise key_error(
            "run.ranks",
            f"expected fewer: parts of the floor for each would be {1e3 * narrowest:.2g} mm wide, "
            f"but neighbours are searched within {1e3 * searched:.2g} mm",
        )
