"""The film on a wall through which a bead ploughs: 6πηR v against its translation (Stokes), η that of the film."""

from __future__ import annotations

from math import pi


def film_drag(film_viscosity: float, radius: float) -> float:
    """Coefficient of the drag that a film on the substrate has on a bead's translation, 6πηR, N s/m.

    Parameters
    ----------
    film_viscosity, radius
        η in Pa s, R in m.
    """
    return 6.0 * pi * film_viscosity * radius
