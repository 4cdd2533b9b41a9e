"""The figure of a sweep: one column of its table against what was varied, in colours and panels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, prod
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.readable import readable_unit
from walkers.postprocess.drawing import new_figure, plain_text, styled
from walkers.sweeps.factors import SEEDS, Factor, by_asymmetry, factors_of, find_name, readable_key, with_unit
from walkers.sweeps.record import SweepRecord

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = npt.NDArray[np.float64]
NONE = "none"
"""Instead of a column: do not tell points apart so."""
DEFAULTS = ("velocity", "climbs")
"""What is drawn if nothing else is asked for, the first that the table has."""
_ERRORS = {"velocity": "standard_error"}
_MARKERS = "osD^vXP<>*"
_MOST_PANELS = 12
_MOST_COLOURS = 12
"""Numbers with more values than this have a scale of colours rather than a legend."""
_FEW_TICKS = 6
_LEAST_APART = 0.08
_MARGIN = 0.06
_FEW = 6
"""Colours of the style."""
_ASIDE = 0.12
"""How far symbols of different colours stand aside of their category."""


@dataclass(frozen=True)
class Layout:
    """What is drawn where.

    Attributes
    ----------
    x
        One for each panel if points were sampled, else one.
    hue, panels
        What colours and panels tell apart, if anything.
    untold
        Labels of what varies and is not told apart.
    """

    x: Sequence[Factor]
    hue: Factor | None
    panels: Factor | None
    untold: Sequence[str] = ()


@dataclass(frozen=True)
class Drawn:
    """What of a table is drawn: a column in readable units, its errors, and the theory's values of it.

    Attributes
    ----------
    label
        Of the axis.
    values, errors : ndarray, shape (N,)
        Of each row.
    theory
        From what a model is called to its values.
    """

    label: str
    values: FloatArray
    errors: FloatArray
    theory: Mapping[str, FloatArray] = field(default_factory=dict)


def default_column(table: pd.DataFrame) -> str:
    """The column of a table that is drawn if nothing else is asked for."""
    return next((name for name in DEFAULTS if name in table), "frequency")


def drawn_column(table: pd.DataFrame, name: str, theory: Mapping[str, FloatArray] | None = None) -> Drawn:
    """A column of a sweep's table, in readable units.

    Raises
    ------
    InputError
        If it has no numbers.
    """
    unit, size = readable_unit(table.attrs["units"].get(name, ""))
    values = _numbers(table, name, "--y") / size
    errors = np.full(len(table), np.nan)
    if name in _ERRORS:
        errors = table[_ERRORS[name]].to_numpy(dtype=float, na_value=np.nan) / size
    predicted = {model: numbers / size for model, numbers in (theory or {}).items()}
    return Drawn(with_unit(readable_key(name), unit), values, errors, predicted)


def _numbers(table: pd.DataFrame, name: str, option: str) -> FloatArray:
    import pandas as pd

    values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(table) and np.isnan(values).all():
        raise InputError(option, [Problem("", None, f'"{name}" has no number that could be drawn')])
    return values


def layout_of(
    record: SweepRecord,
    table: pd.DataFrame,
    *,
    x: str | None = None,
    hue: str | None = None,
    panels: str | None = None,
) -> Layout:
    """What of a sweep goes where, as asked for or guessed.

    Guessed is: along x the numbers with the most values, in colours what has the most values of the rest, in panels
    all else. Samples have a panel for each key.

    Parameters
    ----------
    record
        The sweep.
    table
        Rows of its table (`walkers.sweeps.table.load`).
    x, hue, panels
        Keys that vary or columns of the table; ``none`` for neither colours nor panels.

    Raises
    ------
    InputError
        If there is no such key or column.
    """
    points = table["point"].to_numpy()
    factors = [_at(factor, points) for factor in factors_of(record)]

    def named(option: str, name: str) -> Factor:
        found = find_name(option, name, [*(key for factor in factors for key in factor.keys), *table.columns])
        return next((one for one in factors if found in one.keys), None) or _of_column(table, found, option)

    asked = {
        option: named(f"--{option}", name)
        for option, name in (("x", x), ("hue", hue), ("panels", panels))
        if name is not None and not (name == NONE and option != "x")
    }
    taken = {key for factor in asked.values() for key in factor.keys}
    left = [factor for factor in factors if not taken.intersection(factor.keys)]
    left = [factor for factor in left if not any(_same(factor, other) for other in asked.values())]
    samples = [factor for factor in left if factor.is_sample]
    left = [factor for factor in left if not factor.is_sample]
    if "x" in asked:
        along = [asked["x"]]
    elif samples:
        along = samples
    else:
        along = [_along(left, record, points) or _of_column(table, "point", "--x")]
        left = [factor for factor in left if factor.keys != along[0].keys]
    untold = [one.label for one in samples] if "x" in asked else []
    left = sorted((one for one in left if one.keys[0] not in SEEDS), key=lambda one: -len(one.levels))
    colours = asked.get("hue") or (left.pop(0) if left and hue is None else None)
    many = len(along) > 1
    apart = asked.get("panels")
    if apart is None and panels is None and left and not many:
        while prod(len(one.levels) for one in left) > _MOST_PANELS:
            untold.append(left.pop(0 if len(left[0].levels) > _MOST_PANELS else -1).label)
        apart, left = _joined(left) if left else None, []
    if many and apart is not None:
        raise InputError("--panels", [Problem("", None, "expected --x too: the samples have a panel for each key")])
    return Layout(along, colours, apart, [*untold, *(one.label for one in left)])


def _at(factor: Factor, points: npt.NDArray[Any]) -> Factor:
    """A factor of all points, of some of them."""
    return replace(factor, values=[factor.values[point] for point in points])


def _same(one: Factor, other: Factor) -> bool:
    """Whether two factors tell the same points apart, such as Γ0 and the acceleration that it follows from."""
    pairs = len(set(zip(one.values, other.values, strict=True)))
    return pairs == len(one.levels) == len(other.levels)


def _along(factors: Sequence[Factor], record: SweepRecord, points: npt.NDArray[Any]) -> Factor | None:
    """What is best along x: most values, of equally many the last; categories and seeds if there is nothing else."""
    order: list[tuple[bool, bool, int, int, Factor]] = []
    for number, factor in enumerate(factors):
        by_radii = next((one for one in factors_of(record) if one.keys == factor.keys), None)
        sines = by_asymmetry(by_radii, record) if by_radii else None
        shown = _at(sines, points) if sines else factor
        order.append((shown.keys[0] not in SEEDS, shown.is_number, len(shown.levels), number, shown))
    return max(order, key=lambda entry: entry[:4])[4] if order else None


def _of_column(table: pd.DataFrame, name: str, option: str) -> Factor:
    unit, size = readable_unit(table.attrs["units"].get(name, ""))
    label = with_unit(readable_key(name), unit)
    if table[name].map(lambda value: isinstance(value, str)).all() and len(table):
        return Factor((name,), label, list(table[name]), False)
    values = [float(value) for value in _numbers(table, name, option) / size]
    return Factor((name,), label, values, True, unit=unit)


def _joined(factors: Sequence[Factor]) -> Factor:
    """Several factors as one."""
    if len(factors) == 1:
        return factors[0]
    texts = [
        ", ".join(factor.told(level) for factor, level in zip(factors, row, strict=True))
        for row in zip(*(factor.values for factor in factors), strict=True)
    ]
    keys = tuple(key for factor in factors for key in factor.keys)
    return Factor(keys, ", ".join(factor.label.partition("\n")[0] for factor in factors), texts, False)


@styled
def draw(layout: Layout, drawn: Drawn, *, title: str = "", log: str = "") -> Figure:
    """Draw it.

    Parameters
    ----------
    layout
        From `layout_of`.
    drawn
        From `drawn_column`, of the same rows.
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
    parts, colours = _parts(layout), _Colours(layout.hue)
    columns = min(len(parts), 2 if len(parts) in (2, 4) else 3)
    rows = ceil(len(parts) / columns)
    width, height = (5.6, 3.8) if len(parts) == 1 else (7.0, 6.0 / columns * rows + 0.9)
    figure, grid = new_figure(
        width, height, nrows=rows, ncols=columns, squeeze=False, sharey=True, sharex=len(layout.x) == 1
    )
    for axes, (number, (x, here, name)) in zip(grid.flat, enumerate(parts), strict=False):
        _panel(axes, x, here, drawn, colours)
        axes.set_title(plain_text(name))
        if len(layout.x) > 1 or number + columns >= len(parts):  # nothing is below
            axes.set_xlabel(plain_text(x.label))
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel(plain_text(drawn.label))
        _scale(axes, x, log)
    _limits(grid[0, 0], drawn, log)
    for axes in grid.flat[len(parts) :]:
        axes.set_axis_off()
    _legend(figure, grid, colours, drawn)
    if title:
        figure.suptitle(plain_text("\n".join(wrap(title, round(14.0 * width)))))
    return figure


def _scale(axes: Axes, x: Factor, log: str) -> None:
    """Logarithms, and ticks at the values of x where they are few."""
    from matplotlib.ticker import MaxNLocator

    if "x" in log:
        axes.set_xscale("log")
    if x.is_number and len(x.levels) <= _FEW_TICKS and _stand_apart(x.levels):
        axes.set_xticks(x.levels, [f"{level:g}" for level in x.levels], minor=False)
        axes.set_xticks([], minor=True)
    elif x.is_number and all(float(level).is_integer() for level in x.levels) and "x" not in log:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))


def _stand_apart(ticks: Sequence[float]) -> bool:
    """Whether ticks at these places can be read."""
    if max(len(f"{tick:g}") for tick in ticks) > 5:
        return False
    return len(ticks) < 2 or min(np.diff(ticks)) > _LEAST_APART * (ticks[-1] - ticks[0])


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
    margin = _MARGIN * (high - low)
    if margin:
        axes.set_ylim(low - margin, high + margin)


def _parts(layout: Layout) -> list[tuple[Factor, npt.NDArray[np.bool_], str]]:
    """What each panel has along x, which rows it shows, and its name."""
    everywhere = np.ones(len(layout.x[0].values), dtype=bool)
    if layout.panels is None:
        return [(x, everywhere, "") for x in layout.x]
    told = layout.panels.told
    label = layout.panels.label.partition("\n")[0].rpartition(" (")[0] or layout.panels.label
    values = np.array(layout.panels.values, dtype=object)
    return [
        (layout.x[0], values == level, f"{label} = {told(level)}" if layout.panels.is_number else told(level))
        for level in layout.panels.levels
    ]


class _Colours:
    """Colour and marker of each level of a factor; of many numbers a scale of colours."""

    def __init__(self, factor: Factor | None) -> None:
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        self.factor = factor
        levels: list[Any] = factor.levels if factor else [None]
        self.is_scale = bool(factor and factor.is_number and len(levels) > _MOST_COLOURS)
        self.scale = colormaps["viridis"]
        self.norm = Normalize(min(levels), max(levels)) if self.is_scale else None
        self.levels = [None] if self.is_scale else levels
        shades = (
            np.linspace(0.0, 0.92, len(levels)) if factor and factor.is_number else np.linspace(0.0, 1.0, len(levels))
        )
        many = colormaps["viridis" if factor and factor.is_number else "turbo"]
        self.colours = [many(float(shade)) if len(levels) > _FEW else f"C{place}" for place, shade in enumerate(shades)]

    def rows(self, place: int) -> npt.NDArray[np.bool_] | None:
        """Which rows are of a level; None for all."""
        if self.factor is None or self.is_scale:
            return None
        return np.array([value == self.levels[place] for value in self.factor.values], dtype=bool)


def _panel(axes: Axes, x: Factor, here: npt.NDArray[np.bool_], drawn: Drawn, colours: _Colours) -> None:
    places = _places(x)
    for place in range(len(colours.levels)):
        of_level = colours.rows(place)
        rows = np.flatnonzero(here if of_level is None else here & of_level)
        if not x.is_number and len(colours.levels) > 1:
            shift = (place - (len(colours.levels) - 1) / 2.0) * min(_ASIDE, 0.6 / len(colours.levels))
        else:
            shift = 0.0
        rows = rows[np.argsort(places[rows], kind="stable")]
        joined = (
            x.is_number
            and not x.is_sample
            and x.keys[0] not in SEEDS
            and len(rows) > 1
            and len(set(places[rows])) == len(rows)
        )
        _series(axes, places[rows] + shift, drawn, rows, colours, (place, joined))
    if np.nanmin(drawn.values) <= 0.0 <= np.nanmax(drawn.values):
        axes.axhline(0.0, color="0.4", lw=0.6, zorder=0)
    if not x.is_number:
        axes.set_xticks(range(len(x.levels)), [plain_text(level) for level in x.levels])
        axes.set_xlim(-0.6, len(x.levels) - 0.4)
        if sum(len(str(level)) for level in x.levels) > 40:
            axes.tick_params(axis="x", labelrotation=35)
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")


def _places(x: Factor) -> FloatArray:
    if x.is_number:
        return np.array(x.values, dtype=np.float64)
    number = {level: place for place, level in enumerate(x.levels)}
    return np.array([number[value] for value in x.values], dtype=np.float64)


_STYLES = ("--", ":")
_SYMBOLS = ("_", "+")


def _series(
    axes: Axes, x: FloatArray, drawn: Drawn, rows: npt.NDArray[np.int64], colours: _Colours, how: tuple[int, bool]
) -> None:
    place, joined = how
    y, errors = drawn.values[rows], drawn.errors[rows]
    if colours.is_scale and colours.factor is not None:
        tint = np.array(colours.factor.values, dtype=float)[rows]
        if np.isfinite(errors).any():
            axes.errorbar(x, y, yerr=errors, fmt="none", ecolor="0.6", lw=0.8, zorder=1)
        axes.scatter(x, y, c=tint, cmap=colours.scale, norm=colours.norm, s=18, zorder=2)
        colour: Any = "0.3"
    else:
        colour, marker = colours.colours[place], _MARKERS[place % len(_MARKERS)]
        axes.errorbar(
            x, y, yerr=errors if np.isfinite(errors).any() else None, fmt=marker, color=colour, ms=4.5, capsize=2,
            lw=0.9, ls="-" if joined and not drawn.theory else "none", mfc="none" if drawn.theory else colour,
        )  # fmt: skip
    for number, values in enumerate(drawn.theory.values()):
        look = {"ls": _STYLES[number]} if joined else {"ls": "none", "marker": _SYMBOLS[number], "ms": 9}
        axes.plot(x, values[rows], color=colour, lw=0.9, zorder=1, **look)


def _legend(figure: Figure, grid: npt.NDArray[Any], colours: _Colours, drawn: Drawn) -> None:
    from matplotlib.lines import Line2D

    handles = []
    factor = colours.factor
    if colours.is_scale and factor is not None:
        from matplotlib.cm import ScalarMappable

        figure.colorbar(ScalarMappable(colours.norm, colours.scale), ax=grid, label=plain_text(factor.label))
    elif factor is not None:
        for place, level in enumerate(colours.levels):
            look = {"marker": _MARKERS[place % len(_MARKERS)], "color": colours.colours[place], "ls": "none", "ms": 4.5}
            look |= {"mfc": "none"} if drawn.theory else {}
            handles.append(Line2D([], [], label=plain_text(factor.told(level)), **look))
    joined = any(line.get_linestyle() in _STYLES for axes in grid.flat for line in axes.lines)
    for number, model in enumerate(drawn.theory):
        look = {"ls": _STYLES[number]} if joined else {"ls": "none", "marker": _SYMBOLS[number], "ms": 9}
        handles.append(Line2D([], [], label=model, color="0.3", lw=0.9, **look))
    if handles:
        told = factor.label.partition("\n")[0] if factor and not colours.is_scale else None
        title = plain_text(told.rpartition(" (")[0] or told) if told else None
        longest = max(len(str(handle.get_label())) for handle in handles)
        columns = max(1, min(len(handles), int(13.0 * figure.get_figwidth() / (longest + 6))))
        figure.legend(handles=handles, loc="outside lower center", title=title, ncols=columns)
