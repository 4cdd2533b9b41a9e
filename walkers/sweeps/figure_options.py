"""Options of the figure of a sweep, for Python and for the program.

Nothing that takes long is imported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from cyclopts import Parameter

Log = Literal["x", "y", "xy"]
"""Letters of logarithmic axes."""


@Parameter(name="*")
@dataclass(frozen=True)
class FigureOptions:
    """What the figure of a sweep shows.

    Parameters
    ----------
    x
        Sweeps: key or column on the x axis, such as drive.frequency, frequency or gamma0; default:
        the key with the most values.
    y
        Sweeps: column of the table; default: velocity, or climbs for piles.
    hue
        Sweeps: key or column that sets the colour, or none; default: the first key that is not x.
    panels
        Sweeps: key or column that sets the panel, or none to draw all values of further keys alike.
    log
        Sweeps: which axes are logarithmic.
    theory
        Sweeps: also draw the theory.
    """

    x: str | None = None
    y: str | None = None
    hue: str | None = None
    panels: str | None = None
    log: Log | None = None
    theory: bool = False
