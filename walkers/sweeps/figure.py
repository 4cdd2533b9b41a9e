"""The figure of a sweep, drawn: symbols with their errors, colours, panels, and a theory's lines."""

from __future__ import annotations

from math import ceil
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import InputError, Problem
from walkers.postprocess.drawing import letter_panels, new_figure, plain_text, styled
from walkers.sweeps.factors import SEEDS, Factor
from walkers.sweeps.figure_layout import Drawn, Layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_MARKERS = "osD^vXP<>*"
_MODELS = (("--", "_"), (":", "+"))
"""Of each model the line, and the symbol where points are not joined."""
_FEW_COLOURS = 6
"""More come from a map of colours rather than from the style."""
_MOST_COLOURS = 12
"""Numbers with more values have a scale of colours rather than a legend."""
_ASIDE = 0.12
"""How far symbols of different colours stand aside of their category."""
_FEW_TICKS = 6
_LEAST_APART = 0.08
"""Ticks are at the values of x if these are few, and this share of the axis apart."""
_MARGIN = 0.06
"""Of the range along y, above and below."""
_LONG_NAMES = 40
"""Letters of all categories from which on they are written aslant."""


@styled
def draw(layout: Layout, drawn: Drawn, *, title: str = "", log: str = "") -> Figure:
    """Draw a column of a sweep's table.

    Parameters
    ----------
    layout, drawn
        From `walkers.sweeps.figure_layout.layout_of` and `drawn_column` there, of the same rows.
    title
        Of the figure.
    log
        Which axes are logarithmic: ``x``, ``y`` or ``xy``; what is not positive is left out there.

    Raises
    ------
    InputError
        If x is to be logarithmic and has categories.
    """
    if "x" in log and not all(one.is_number for one in layout.x):
        raise InputError("--logx", [Problem("", None, f"{layout.x[0].label} has no numbers")])
    parts, colours = _parts(layout), _Colours(layout.hue, hollow=bool(drawn.theory))
    columns = min(len(parts), 2 if len(parts) in (2, 4) else 3)
    rows = ceil(len(parts) / columns)
    width, height = (5.6, 3.8) if len(parts) == 1 else (7.0, 6.0 / columns * rows + 0.9)
    shared = {"sharey": True, "sharex": len(layout.x) == 1}
    figure, grid = new_figure(width, height, nrows=rows, ncols=columns, squeeze=False, **shared)
    for axes, (number, (x, here, name)) in zip(grid.flat, enumerate(parts), strict=False):
        _panel(axes, x, here, drawn, colours)
        axes.set_title(plain_text(name))
        if len(layout.x) > 1 or number + columns >= len(parts):  # nothing is below
            axes.set_xlabel(plain_text(x.label))
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel(plain_text(drawn.label))
        _scale(axes, x, log)
    if len(parts) > 1:
        letter_panels(grid.flat[: len(parts)])
    _limits(grid[0, 0], drawn, log)
    for axes in grid.flat[len(parts) :]:
        axes.set_axis_off()
    _legend(figure, grid, colours, drawn)
    if title:
        figure.suptitle(plain_text("\n".join(wrap(title, round(14.0 * width)))))
    return figure


def _parts(layout: Layout) -> list[tuple[Factor, npt.NDArray[np.bool_], str]]:
    """What each panel has along x, which rows it shows, and its name."""
    panels = layout.panels
    if panels is None:
        return [(x, np.ones(len(x.values), dtype=bool), "") for x in layout.x]
    names = [f"{panels.name} = {panels.told(one)}" if panels.is_number else panels.told(one) for one in panels.levels]
    return [(layout.x[0], panels.where(level), name) for level, name in zip(panels.levels, names, strict=True)]


class _Colours:
    """Colour and marker of each level of a factor; of many numbers one series with a scale of colours."""

    def __init__(self, factor: Factor | None, *, hollow: bool) -> None:
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        levels: list[Any] = factor.levels if factor else [None]
        is_number = factor is not None and factor.is_number
        self.factor, self.hollow, self.map = factor, hollow, colormaps["viridis"]
        self.norm = Normalize(min(levels), max(levels)) if is_number and len(levels) > _MOST_COLOURS else None
        self.levels = [None] if self.norm else levels
        shades = colormaps["viridis" if is_number else "turbo"](np.linspace(0.0, 0.92, len(levels)))
        self.colours = [f"C{place}" if len(levels) <= _FEW_COLOURS else shade for place, shade in enumerate(shades)]

    def look(self, place: int) -> dict[str, Any]:
        """Options of the symbols of a level."""
        colour = self.colours[place]
        face = "none" if self.hollow else colour
        return {"marker": _MARKERS[place % len(_MARKERS)], "color": colour, "mfc": face, "ms": 4.5}


def _panel(axes: Axes, x: Factor, here: npt.NDArray[np.bool_], drawn: Drawn, colours: _Colours) -> None:
    """Means with their errors, joined by lines unless a theory's are there, and the theory's values."""
    places = np.array(x.values if x.is_number else [x.levels.index(one) for one in x.values], float)
    count = len(colours.levels)
    for place, level in enumerate(colours.levels):
        rows = np.flatnonzero(here & (True if colours.factor is None or colours.norm else colours.factor.where(level)))
        rows = rows[np.argsort(places[rows], kind="stable")]
        along = places[rows] + (0.0 if x.is_number else (place - (count - 1) / 2.0) * min(_ASIDE, 0.6 / count))
        is_course = x.is_number and not x.is_sample and x.keys[0] not in SEEDS
        joined = is_course and len(set(places[rows])) == len(rows) > 1
        y, errors = drawn.values[rows], drawn.errors[rows]
        bars: Any = errors if np.isfinite(errors).any() else None
        if colours.norm is not None and colours.factor is not None:
            axes.errorbar(along, y, yerr=bars, fmt="none", ecolor="0.6", lw=0.8, zorder=1)
            tints = np.array(colours.factor.values, dtype=float)[rows]
            axes.scatter(along, y, c=tints, cmap=colours.map, norm=colours.norm, s=18, zorder=2)
        else:
            line = "-" if joined and not drawn.theory else "none"
            axes.errorbar(along, y, yerr=bars, capsize=2, lw=0.9, ls=line, **colours.look(place))
        for number, values in enumerate(drawn.theory.values()):
            tint = "0.3" if colours.norm else colours.colours[place]
            axes.plot(along, values[rows], zorder=1, **_model_look(number, joined, tint))
    if np.nanmin(drawn.values) <= 0.0 <= np.nanmax(drawn.values):
        axes.axhline(0.0, color="0.4", lw=0.6, zorder=0)
    if not x.is_number:
        _name_categories(axes, x)


def _model_look(number: int, joined: bool, colour: Any) -> dict[str, Any]:
    line, marker = _MODELS[number]
    return {"color": colour, "lw": 0.9, **({"ls": line} if joined else {"ls": "none", "marker": marker, "ms": 9})}


def _name_categories(axes: Axes, x: Factor) -> None:
    aslant = sum(map(len, x.levels)) > _LONG_NAMES
    look: dict[str, Any] = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if aslant else {}
    axes.set_xticks(range(len(x.levels)), [plain_text(level) for level in x.levels], **look)
    axes.set_xlim(-0.6, len(x.levels) - 0.4)


def _scale(axes: Axes, x: Factor, log: str) -> None:
    """Logarithms, and ticks at the values of x where they are few."""
    from matplotlib.ticker import MaxNLocator

    if "x" in log:
        axes.set_xscale("log")
    if not x.is_number:
        return
    apart = np.diff(x.levels) > _LEAST_APART * (x.levels[-1] - x.levels[0])
    if len(x.levels) <= _FEW_TICKS and apart.all():
        axes.set_xticks(x.levels, [f"{level:.4g}" for level in x.levels])
        axes.set_xticks([], minor=True)
    elif "x" not in log and all(float(level).is_integer() for level in x.levels):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _limits(axes: Axes, drawn: Drawn, log: str) -> None:
    """Along y what the runs and the first model gave: another model may leave the axes."""
    from matplotlib.ticker import MaxNLocator

    if "y" in log:
        axes.set_yscale("log", nonpositive="mask")
        return
    errors = np.nan_to_num(drawn.errors)
    shown = np.concatenate([drawn.values - errors, drawn.values + errors, *list(drawn.theory.values())[:1]])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    if np.all(np.mod(drawn.values[np.isfinite(drawn.values)], 1.0) == 0.0):  # numbers of something
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        low, high = low - 0.5, high + 0.5
    if high > low:
        axes.set_ylim(low - _MARGIN * (high - low), high + _MARGIN * (high - low))


def _legend(figure: Figure, grid: npt.NDArray[Any], colours: _Colours, drawn: Drawn) -> None:
    """Below all: what colours and lines are. Of many numbers a scale of colours beside all."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.lines import Line2D

    factor, title = colours.factor, None
    handles: list[Line2D] = []
    if colours.norm is not None and factor is not None:
        figure.colorbar(ScalarMappable(colours.norm, colours.map), ax=grid, label=plain_text(factor.label))
    elif factor is not None:
        title = plain_text(factor.name)
        names = [plain_text(factor.told(level)) for level in colours.levels]
        handles = [Line2D([], [], ls="none", label=name, **colours.look(at)) for at, name in enumerate(names)]
    lines = {line.get_linestyle() for axes in grid.flat for line in axes.lines}
    for number, model in enumerate(drawn.theory):
        look = _model_look(number, _MODELS[number][0] in lines, "0.3")
        handles.append(Line2D([], [], label=model, **look))
    if handles:
        longest = max(len(str(handle.get_label())) for handle in handles)
        columns = max(1, min(len(handles), int(13.0 * figure.get_figwidth() / (longest + 6))))
        figure.legend(handles=handles, loc="outside lower center", title=title, ncols=columns)
