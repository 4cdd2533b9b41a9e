"""What stands on a wall and climbs it: maps of postures over friction, tilt and drag, and the clusters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.paper.sources import Sources
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Group

KINDS = ("climbs upright", "stays, upright", "slides down upright", "leans", "turns over")
_MARKERS = ("^", "o", "v", "D", "X")
_SHAPE = "clusters[0].arrangement"
_SHAPES = {"chain": "dimer", "fan": "fan: large, two small", "diamond": "diamond: large, two small, small"}
_FRICTION, _TILT, _DRAG = "contact.friction.bead_wall", "boundary.tilt", "liquid.viscosity_ratio"
STAYS = 5e-5
"""m/s; what is slower stays where it is: no more than a tenth of a radius in a second."""
_SPEEDS = (-10.0, -3.0, -1.0, 0.0, 1.0, 3.0, 10.0)
"""mm/s, on the scale of colours."""
_COLUMNS = 5
"""Clusters side by side."""


def kinds(table: pd.DataFrame) -> npt.NDArray[np.int64]:
    """What the walkers of each point of a sweep do, a place in `KINDS`.

    Turns over if any of them does; leans if any does not end upright; else it climbs, slides down or is slower than
    `STAYS`.
    """
    turned, leaning, speed = table["turned_round"] > 0, table["upright"] < table["walkers"], table["axial_velocity"]
    found: npt.NDArray[np.int64] = np.select([turned, leaning, speed < -STAYS, speed < STAYS], [4, 3, 2, 1], 0)
    return found


@styled
def fig_climbing(sources: Sources) -> Figure:
    """Dimer, fan and diamond: the bridges' viscosity against friction on a wall, and against tilt."""
    from matplotlib.lines import Line2D

    figure, rows = new_figure(TWO_COLUMNS, 4.8, nrows=2, ncols=3, sharey=True)
    maps = (("climb-friction", _FRICTION, "friction, on a wall"), ("climb-tilt", _TILT, "tilt (°), friction 0.5"))
    for axes, (sweep, key, label) in zip(rows, maps, strict=True):
        table = sources.finished(sweep)
        for one, (shape, name) in zip(axes, _SHAPES.items(), strict=True):
            drawn = _map(one, table[table[_SHAPE] == shape], key)
            one.set_xlabel(label)
            if sweep == "climb-friction":
                one.set_title(name)
        axes[0].set(ylabel="bridges' viscosity over the liquid's", yscale="log")
    letter_panels(rows.flat)
    figure.colorbar(drawn, ax=rows, label="up the slope (mm/s)", shrink=0.6, extend="both", ticks=_SPEEDS, format="%g")
    handles = [
        Line2D([], [], ls="", marker=marker, color="0.2", mfc="0.85", ms=5.5, mew=0.5, label=name)
        for name, marker in zip(KINDS, _MARKERS, strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _map(axes: Axes, table: pd.DataFrame, key: str) -> PathCollection:
    """The points of a sweep by kind; all have one scale of colours, which is given back."""
    from matplotlib.colors import SymLogNorm

    found, speed = kinds(table), table["axial_velocity"].to_numpy() * 1e3
    shades = SymLogNorm(1.0, vmin=_SPEEDS[0], vmax=_SPEEDS[-1])  # few are fast, and they are not to bleach the rest
    for kind, marker in enumerate(_MARKERS):
        here = found == kind
        drawn = axes.scatter(
            table[key].to_numpy()[here], table[_DRAG].to_numpy()[here], c=speed[here], marker=marker,
            s=26, cmap="RdBu", norm=shades, ec="0.2", lw=0.4,
        )  # fmt: skip
    return drawn


@styled
def fig_zoo(sources: Sources) -> Figure:
    """Each cluster as it is after a second, above its speed and what it does."""
    entries = [(*point, sweep == "zoo-corner") for sweep in ("zoo", "zoo-corner") for point in _points(sources, sweep)]
    rows = -(-len(entries) // _COLUMNS)
    figure, axes = new_figure(TWO_COLUMNS, 1.74 * rows, nrows=rows, ncols=_COLUMNS, squeeze=False)
    for one in axes.flat:
        one.set_axis_off()
    for one, (group, row, corner) in zip(axes.flat, entries, strict=False):
        _draw_cluster(one, group, corner=corner)
        speed = float(row["axial_velocity"].iloc[0])
        told = KINDS[int(kinds(row)[0])] + ("\nin a corner" if corner else "")
        one.set_title(f"{told}\n{_rounded(speed * 1e3)} mm/s", size=7)
    letter_panels(axes.flat[: len(entries)])
    _scale(axes.flat[0])
    return figure


def _rounded(speed: float) -> str:
    """To two digits, and no -0.00."""
    return f"{round(speed, 2) + 0.0:.2f}"


def _scale(axes: Axes) -> None:
    """A bar of a millimetre below the cluster."""
    axes.plot([-0.5, 0.5], [-1.75, -1.75], color="0.1", lw=1.5, solid_capstyle="butt")
    axes.annotate("1 mm", (0.0, -1.75), (0, -3), textcoords="offset points", ha="center", va="top", fontsize=7)


def _points(sources: Sources, sweep: str) -> list[tuple[Group, pd.DataFrame]]:
    table = sources.finished(sweep)
    return [(sources.trajectory(run), table.iloc[[number]]) for number, run in enumerate(table["run"])]


def _draw_cluster(axes: Axes, group: Group, *, corner: bool) -> None:
    """The first walker's beads seen against the wall, uphill is up; dotted where it began."""
    from matplotlib.patches import Circle

    for frame, style in ((0, {"ls": ":", "fc": "none", "ec": "0.6"}), (-1, {"fc": "#c9d2d8", "ec": "0.2"})):
        place = group.position[frame, 0] * 1e3
        place = place - place.mean(axis=0)
        for (x, y, _), radius in zip(place, group.radii * 1e3, strict=True):
            large = radius > group.case.border * 1e3
            look = {**style, "fc": "#e0566c"} if large and frame else style
            axes.add_patch(Circle((-y, x), radius, lw=0.8, **look))
    if corner:
        axes.axvline(0.0, color="0.8", lw=0.8, zorder=0)
    axes.set(xlim=(-1.5, 1.5), ylim=(-2.15, 2.15), aspect="equal")
