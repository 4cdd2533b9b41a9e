"""Options of the figure of a sweep, for Python and for the program.

Nothing that takes long is imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from walkers.errors import check_text_or_path

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
    data_files
        Sweeps: also draw points of your own, from a text file with a header such as
        "peak_acceleration (g),velocity (mm/s),velocity error (mm/s)", or LABEL=FILE. Repeatable.
    width
        Sweeps: width of the figure, such as 85mm; default: 7in.
    font_size
        Sweeps: size of all texts, points; default: 7 and 8.
    title
        Sweeps: text above the figure, or none; default: the title of the sweep, and what bars and
        bands are.
    """

    x: str | None = None
    y: str | None = None
    hue: str | None = None
    panels: str | None = None
    log: Log | None = None
    theory: bool = False
    data_files: Annotated[
        Sequence[str | Path], Parameter("--data", metavar="FILE", show_default=False)
    ] = ()
    width: str | None = None
    font_size: float | None = None
    title: str | None = None

    def __post_init__(self) -> None:
        """Raise `InputError` for names that are not text."""
        names = {"x": self.x, "y": self.y, "hue": self.hue, "panels": self.panels}
        for argument, name in names.items():
            if name is not None:
                check_text_or_path(argument, name, "the name of a key or a column")
        files = self.data_files
        for file in files if isinstance(files, (list, tuple)) else [files]:
            check_text_or_path("data_files", file, "a file, or LABEL=FILE")
        if self.width is not None:
            check_text_or_path("width", self.width, "a width, such as 85mm")
