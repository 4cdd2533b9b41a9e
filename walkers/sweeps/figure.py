"""The figure of a sweep: one column of its table against what was varied, in colours and panels."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, prod
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.errors import refused
from walkers.inputs.library import unmeasured
from walkers.postprocess.drawing import (
    errors_seen,
    letter_panels,
    new_figure,
    plain_text,
    styled,
)
from walkers.postprocess.numbers import declared, is_declared
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.readable import readable_unit
from walkers.sweeps.table import ERRORS, FACING_DOWN, default_column, find_name, value_text, varied_columns, with_unit

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = npt.NDArray[np.float64]
SCATTER = "bars: standard deviation of the copies (uncertain parameters not varied)"
"""What the error bars of a sweep are."""
_NONE = "none"
"""Instead of a column: no colours or no panels."""
_SEEDS = ("run.seed", "seed")
_UP: dict[str, Any] = {"marker": "o", "color": "0.3", "label": "started facing right (up)"}
_DOWN: dict[str, Any] = {"marker": "v", "color": "0.3", "label": "started facing left (down)"}
_LEAST_ASYMMETRIES = 3  # smallest number of pairs of radii that are shown by sin δ
_MOST_PANELS = 12
_MARKERS = "osD^vXP<>*"
_MODELS = (("--", "_"), (":", "+"))  # line of each model, and its symbol if points are not joined
_CURVE, _BEYOND = 61, 0.04  # points of a model's curve; its length beyond the points, divided by their range
_FEW_COLOURS = 6  # more colours are from a colour map, fewer from the style
_MOST_COLOURS = 12  # numbers with more values have a colour scale instead of a legend
_ROUNDING = 1e-12  # relative to the largest number
_LEAST_RANGE = 1e-4  # smallest range of the y axis relative to the mean, so that rounding errors are not shown
_LETTERS = 26  # letters of a line of a y label
_FEW_TICKS = 6  # largest number of x values that all have ticks


@dataclass(frozen=True)
class Factor:
    """A property in which points differ: its keys, its label, and a number (in its unit) or a text for each point.

    Each key of a sample is a factor. Points of a sample do not share values.
    """

    keys: tuple[str, ...]
    label: str
    values: Sequence[Any]
    is_number: bool
    is_sample: bool = False
    unit: str = ""

    @property
    def levels(self) -> list[Any]:
        """The different values: numbers in ascending order, texts in the order of the sweep."""
        different = dict.fromkeys(self.values)
        return sorted(different) if self.is_number else list(different)

    @property
    def name(self) -> str:
        """The label without the unit and without further keys."""
        first = self.label.partition("\n")[0]
        return first.removesuffix(f" ({self.unit})") if self.unit else first

    def where(self, level: Any) -> npt.NDArray[np.bool_]:
        """Which points have a level."""
        return np.array([value == level for value in self.values], dtype=bool)

    def exact(self, level: float) -> float:
        """A number, or zero if it is a rounding error."""
        return 0.0 if abs(level) < _ROUNDING * max(map(abs, self.levels)) else level

    def text(self, level: Any, *, by_name: bool = False) -> str:
        """A level as text with its unit, for numbers optionally with the factor's name."""
        text = f"{self.exact(level):.6g} {self.unit}".strip() if self.is_number else str(level)
        return f"{self.name} = {text}" if by_name and self.is_number else text


@dataclass(frozen=True)
class Layout:
    """Factors on the x axis (for samples one panel each), in colours and in panels; names of undistinguished keys."""

    x: Sequence[Factor]
    hue: Factor | None
    panels: Factor | None
    undistinguished: Sequence[str] = ()


Curves = Callable[[npt.NDArray[np.int64], Factor, FloatArray], tuple[FloatArray, Mapping[str, FloatArray]]]
"""Function of rows that differ only in x, of the factor x and of values of x: values of x, predictions of models there.
"""


@dataclass(frozen=True)
class Drawn:
    """A column of a table in readable units: label, values, errors, and predictions of models for each row."""

    label: str
    values: FloatArray
    errors: FloatArray
    theory: Mapping[str, FloatArray] = field(default_factory=dict)
    bars: str = SCATTER
    curves: Curves | None = None
    """Predictions of models between and beyond the points."""
    down: FloatArray | None = None
    """Values of walkers that started facing down a slope; the others are then of those facing up."""


Models = Callable[["pd.DataFrame", str], tuple[Mapping[str, FloatArray], Curves | None]]
"""Function of the rows of a table and a column: predictions of models for each row (SI units), and between them."""


class LeftOutWarning(UserWarning):
    """Something is not in a figure: points without a result, keys that are not distinguished, a theory's prediction."""


def figure_of(table: pd.DataFrame, options: FigureOptions = FigureOptions(), models: Models | None = None) -> Figure:
    """Figure of the table of a sweep (`walkers.plotting.sweep_figure`), with the predictions of models."""
    column = column_of(table, options.y)
    done = table[table["status"] == "finished"]
    counts = Counter(table["status"][table["status"] != "finished"])
    others = ", ".join(f"{number} {status}" for status, number in counts.items())
    if done.empty:
        raise refused(str(table.attrs["sweep"]), f"no point is finished ({others or 'there is none'})")
    if counts:
        tell(f"{sum(counts.values())} of {len(table)} points left out: {others}")
    if empty := int(done[column].isna().sum()):
        tell(f"{empty} of {len(done)} finished points have no {column}")
    layout = layout_of(table, done, x=options.x, hue=options.hue, panels=options.panels)
    if layout.undistinguished:
        tell(f"not distinguished: {'; '.join(layout.undistinguished)}")
    predicted, curves = models(done, column) if models else ({}, None)
    drawn = drawn_column(done, column, predicted, None if options.y else FACING_DOWN.get(column))
    return draw(layout, replace(drawn, curves=curves), title=table.attrs["title"], log=options.log or "")


def column_of(table: pd.DataFrame, wanted: str | None) -> str:
    """The column of a name, by default the main result; `InputError` if there is none."""
    return find_name("y", wanted, table.columns) if wanted else default_column(table)


def tell(message: str) -> None:
    """Warn that something is left out of a figure."""
    warnings.warn(message, LeftOutWarning, stacklevel=3)


def factors_of(table: pd.DataFrame) -> list[Factor]:
    """The factors of a sweep in the order of its keys, without keys that have one value.

    Keys of one axis are one factor if their numbers rise or fall together, or if they have texts or lists. Otherwise,
    as in a sample, each key is a factor.
    """
    factors = []
    for keys in table.attrs["axes"]:
        units, columns = {}, {}
        for key in keys:
            names = [name for name in varied_columns(table) if name == key or name.startswith(f"{key}[")]
            rows = table[names].astype(object)
            columns[key] = (
                rows[key].tolist() if names == [key] else [row.dropna().tolist() for _, row in rows.iterrows()]
            )
            units[key] = table.attrs["units"][names[0]]
        varied = {key: column for key, column in columns.items() if _count(column) > 1}
        if varied:
            factors += _of_axis(varied, units)
    return factors


def _of_axis(columns: Mapping[str, list[Any]], units: Mapping[str, str]) -> list[Factor]:
    if {type(one) for column in columns.values() for one in column} <= {int, float}:
        rows = np.unique(np.array(list(columns.values()), dtype=float).T, axis=0)
        steps = np.diff(rows, axis=0)
        together = (steps[:, 0] > 0.0).all() and ((steps > 0.0).all(axis=0) | (steps < 0.0).all(axis=0)).all()
        factors = []
        for key, *rest in [list(columns)] if together else [[key] for key in columns]:
            label = with_unit(readable_key(key), units[key]) + _with(rest)
            values = list(map(float, columns[key]))
            factors.append(Factor((key, *rest), label, values, True, not together, units[key]))
        return factors
    # Texts: those of one key that distinguishes all levels, or those of all keys.
    whole = _count(zip(*columns.values(), strict=True))
    shown = next(([key] for key, values in columns.items() if _count(values) == whole), list(columns))
    rest = [key for key in columns if key not in shown]
    texts = [[value_text(value, units[key]) for value in columns[key]] for key in shown]
    label = ", ".join(map(readable_key, shown)) + _with(rest)
    return [Factor((*shown, *rest), label, [", ".join(row) for row in zip(*texts, strict=True)], False)]


def _count(values: Iterable[Any]) -> int:
    return len(set(map(repr, values)))


def _with(keys: Sequence[str]) -> str:
    if len(keys) > 2:
        return f"\n(and {len(keys)} further keys with it)"
    return f"\n(and with it {', '.join(map(readable_key, keys))})" if keys else ""


def readable_key(key: str) -> str:
    """A dotted key or a column as words: ``friction bead wall``, ``liquid``; numbers of results by their labels."""
    table, _, name = key.partition(".")
    if is_declared(name or table):
        return declared(name or table).label
    words = table.partition("[")[0] if name in ("name", "material") else (name or table)
    return words.replace(".", " ").replace("_", " ")


def drawn_column(
    rows: pd.DataFrame, name: str, theory: Mapping[str, FloatArray] | None = None, down: str | None = None
) -> Drawn:
    """A column of numbers of a sweep's table, with the predictions of models (SI units), in readable units.

    ``down`` is the column of walkers that face down a slope, if the first is of those that face up.
    """
    column = _numbers(rows, name, "y")
    size = readable_unit(rows.attrs["units"].get(name, ""))[1]
    errors = np.full(len(rows), np.nan)
    if name in ERRORS:
        errors = rows[ERRORS[name]].to_numpy(dtype=float, na_value=np.nan) / size
    predicted = {model: numbers / size for model, numbers in (theory or {}).items()}
    bars = SCATTER.partition(" (")[0] if {*unmeasured()} & {*varied_columns(rows)} else SCATTER
    drawn = Drawn(column.label, np.array(column.values), errors, predicted, bars)
    if down is None or rows[down].isna().all():
        return drawn
    label = drawn.label.replace(", facing right (up)", "")
    return replace(drawn, label=label, down=np.array(_numbers(rows, down, "--y").values))


def _numbers(rows: pd.DataFrame, name: str, option: str) -> Factor:
    """A column of numbers in its readable unit."""
    import pandas as pd

    unit, size = readable_unit(rows.attrs["units"].get(name, ""))
    values = pd.to_numeric(rows[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(rows) and np.isnan(values).all():
        raise refused(option, f'"{name}" has no number that could be drawn')
    return Factor((name,), with_unit(readable_key(name), unit), (values / size).tolist(), True, unit=unit)


def layout_of(
    table: pd.DataFrame, rows: pd.DataFrame, *, x: str | None = None, hue: str | None = None, panels: str | None = None
) -> Layout:
    """Choose the factors on the x axis, in colours and in panels.

    By default the x axis has the numbers with the most values, colours have the other factor with the most values, and
    panels have all further factors. Samples have a panel for each key.

    Parameters
    ----------
    table, rows
        The sweep's table (`walkers.sweeps.table.load`), and the rows that are drawn.
    x, hue, panels
        Varied keys or columns; ``none``: no colours or panels. `InputError` if there is no such key or column.
    """
    places = table.index.get_indexer(rows.index).tolist()
    left = factors = [replace(one, values=[one.values[place] for place in places]) for one in factors_of(table)]
    asked = {}
    for option, name in (("x", x), ("hue", hue), ("panels", panels)):
        if name is not None and not (name == _NONE and option != "x"):
            keys = [key for factor in factors for key in factor.keys]
            found = find_name(option, name, [*keys, *table.columns])
            given = next((one for one in factors if found in one.keys), None)
            if given is None and rows[found].map(lambda value: isinstance(value, str)).all():
                given = Factor((found,), readable_key(found), rows[found].tolist(), False)
            asked[option] = given or _numbers(rows, found, option)
            left = [one for one in left if not _same(one, asked[option])]
    samples = [factor for factor in left if factor.is_sample]
    left = [factor for factor in left if not factor.is_sample]
    undistinguished = [one.name for one in samples] if "x" in asked else []
    along = [asked["x"]] if "x" in asked else samples
    if not along:
        along = [_along(left, rows) or _numbers(rows, "point", "x")]
        left = [factor for factor in left if factor.keys != along[0].keys]
    left = sorted((one for one in left if one.keys[0] not in _SEEDS), key=lambda one: -len(one.levels))
    colours = asked.get("hue") or (left.pop(0) if left and hue is None else None)
    apart = asked.get("panels")
    if len(along) > 1 and apart is not None:
        raise refused("panels", "expected x too: the samples have a panel for each key")
    if apart is None and panels is None and left and len(along) == 1:
        while prod(len(one.levels) for one in left) > _MOST_PANELS:
            undistinguished.append(left.pop(0 if len(left[0].levels) > _MOST_PANELS else -1).name)
        apart, left = joined(left), []
    return Layout(along, colours, apart, [*undistinguished, *(one.name for one in left)])


def _same(one: Factor, other: Factor) -> bool:
    """Whether two factors distinguish the same points, such as Γ0 and the acceleration."""
    pairs = len(set(zip(one.values, other.values, strict=True)))
    return one.keys == other.keys or pairs == len(one.levels) == len(other.levels)


def _along(factors: Sequence[Factor], rows: pd.DataFrame) -> Factor | None:
    """The factor for the x axis: numbers with the most values, else categories, else seeds; None without factors."""
    shown = list(factors)
    known = "sin_delta" in rows and rows["sin_delta"].notna().all()  # none of clusters
    sines = rows["sin_delta"].astype(float).round(12).tolist() if known else []
    for place, one in enumerate(factors):
        if not one.is_number and any(key.endswith("radii") for key in one.keys):  # by sin δ if no two are the same
            pairs = len(set(zip(one.values, sines, strict=bool(sines))))
            if pairs == len(set(sines)) == len(one.levels) >= _LEAST_ASYMMETRIES:
                shown[place] = Factor(one.keys, "asymmetry sin δ", rows["sin_delta"].tolist(), True)
    ranks = [(one.keys[0] not in _SEEDS, one.is_number, len(one.levels), place) for place, one in enumerate(shown)]
    return shown[max(ranks)[-1]] if ranks else None


def joined(factors: Sequence[Factor]) -> Factor | None:
    """Several factors as one whose levels are texts; None if there is none."""
    if len(factors) < 2:
        return next(iter(factors), None)
    columns = [[one.text(level, by_name=not one.unit) for level in one.values] for one in factors]
    keys = tuple(key for factor in factors for key in factor.keys)
    texts = [", ".join(row) for row in zip(*columns, strict=True)]
    return Factor(keys, ", ".join(factor.name for factor in factors), texts, False)


@styled
def draw(layout: Layout, drawn: Drawn, *, title: str = "", log: str = "") -> Figure:
    """Draw the results of `layout_of` and `drawn_column` for the same rows.

    ``log`` names logarithmic axes (``x``, ``y`` or ``xy``), which leave out zero and negative numbers.
    """
    if "x" in log and not all(one.is_number for one in layout.x):
        raise refused("log", f"{layout.x[0].label} has no numbers")
    parts = [(x, np.ones(len(drawn.values), dtype=bool), "") for x in layout.x]
    if (panels := layout.panels) is not None:
        parts = [(layout.x[0], panels.where(level), panels.text(level, by_name=True)) for level in panels.levels]
    colours = _Colours(layout.hue, hollow=bool(drawn.theory))
    columns = min(len(parts), 2 if len(parts) in (2, 4) else 3)
    rows = ceil(len(parts) / columns)
    width, height = (5.6, 3.8) if len(parts) == 1 else (7.0, 6.0 / columns * rows + 0.9)
    shared = {"sharey": True, "sharex": len(layout.x) == 1}
    figure, grid = new_figure(width, height, nrows=rows, ncols=columns, squeeze=False, **shared)
    for axes, (number, (x, here, name)) in zip(grid.flat, enumerate(parts), strict=False):
        _panel(axes, x, here, drawn, colours, log)
        axes.set_title(plain_text(name))
        if len(layout.x) > 1 or number + columns >= len(parts):  # no panel below
            axes.set_xlabel(plain_text(x.label))
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel(plain_text("\n".join(wrap(drawn.label, _LETTERS))))
        _scale_x(axes, x, log)
    if len(parts) > 1:
        letter_panels(grid.flat[: len(parts)])
    _scale_y(grid[0, 0], drawn, log)
    for axes in grid.flat[len(parts) :]:
        axes.set_axis_off()
    _legend(figure, grid, colours, drawn)
    said = [title]
    if np.isfinite(drawn.errors).any():
        said.append(drawn.bars + ("" if errors_seen(drawn.errors, drawn.values) else ", smaller than the symbols"))
    if lines := [line for one in said for line in wrap(one, round(14.0 * width))]:
        figure.suptitle(plain_text("\n".join(lines)))
    return figure


class _Colours:
    """Colours and symbols of the levels of a factor; many numbers have a colour scale."""

    def __init__(self, factor: Factor | None, *, hollow: bool) -> None:
        from matplotlib import colormaps
        from matplotlib.colors import Normalize

        self.factor = factor
        self.levels: list[Any] = factor.levels if factor else [None]
        count, is_number = len(self.levels), factor is not None and factor.is_number
        self.scale = Normalize(self.levels[0], self.levels[-1]) if is_number and count > _MOST_COLOURS else None
        shares = self.scale(self.levels) if self.scale else np.linspace(0.0, 0.92, count)
        shades = colormaps["viridis" if is_number else "turbo"](shares)
        self.looks: list[dict[str, Any]] = []
        for place in range(count):
            colour = f"C{place}" if count <= _FEW_COLOURS else shades[place]
            marker = _MARKERS[0 if self.scale else place % len(_MARKERS)]
            face = "none" if hollow else colour
            # Symbols that are drawn later are smaller, so that those of coinciding points are seen.
            size = 4.5 if self.scale else 4.5 + min(1.0, 4.0 / count) * (count - 1 - place)
            self.looks.append({"marker": marker, "color": colour, "mfc": face, "ms": size})


def _panel(axes: Axes, x: Factor, here: npt.NDArray[np.bool_], drawn: Drawn, colours: _Colours, log: str) -> None:
    """Means with error bars, joined by lines unless there is a theory, and the predictions of the theory."""
    places = np.array(x.values if x.is_number else [x.levels.index(one) for one in x.values], float)
    count = len(colours.levels)
    for number, (level, look) in enumerate(zip(colours.levels, colours.looks, strict=True)):
        rows = np.flatnonzero(here & (colours.factor.where(level) if colours.factor else True))
        rows = rows[np.argsort(places[rows], kind="stable")]
        # Symbols of different colours are side by side in their category.
        aside = 0.0 if x.is_number else (number - (count - 1) / 2.0) * min(0.12, 0.6 / count)
        is_course = x.is_number and not x.is_sample and x.keys[0] not in _SEEDS
        joined = is_course and len(set(places[rows])) == len(rows) > 1
        y, errors = drawn.values[rows], drawn.errors[rows]
        bars: Any = errors if np.isfinite(errors).any() and errors_seen(drawn.errors, drawn.values) else None
        line = "-" if joined and not drawn.theory else "none"
        axes.errorbar(places[rows] + aside, y, yerr=bars, capsize=2, lw=0.9, ls=line, **look)
        if drawn.down is not None:
            shape = {"marker": _DOWN["marker"], "mfc": "none"}
            axes.plot(places[rows] + aside, drawn.down[rows], lw=0.9, ls="--" if joined else "none", **look | shape)
        along = _along_axis(x, log) if joined and drawn.curves else places[rows] + aside
        along, curves = drawn.curves(rows, x, along) if joined and drawn.curves else (along, {})
        for model, (name, values) in enumerate(drawn.theory.items()):
            at, shown = (along, curves[name]) if name in curves else (places[rows] + aside, values[rows])
            axes.plot(at, shown, zorder=1, **_model_look(model, name in curves, look["color"]))
    values = drawn.values if drawn.down is None else np.concatenate([drawn.values, drawn.down])
    if np.nanmin(values) <= 0.0 <= np.nanmax(values):
        axes.axhline(0.0, color="0.4", lw=0.6, zorder=0)


def _along_axis(x: Factor, log: str) -> FloatArray:
    """Values of x for curves, to a little beyond the smallest and largest values."""
    low, high = x.levels[0], x.levels[-1]
    if "x" in log and low > 0.0:
        beyond = (high / low) ** _BEYOND
        return np.geomspace(low / beyond, high * beyond, _CURVE)
    beyond = _BEYOND * (high - low)
    return np.linspace(low - beyond if low <= 0.0 else max(low - beyond, 0.1 * low), high + beyond, _CURVE)


def _model_look(number: int, joined: bool, colour: Any) -> dict[str, Any]:
    line, marker = _MODELS[number]
    return {"color": colour, "lw": 0.9, **({"ls": line} if joined else {"ls": "none", "marker": marker, "ms": 9})}


def _scale_x(axes: Axes, x: Factor, log: str) -> None:
    """Scale of the x axis; names of categories (slanted if long); ticks at the values of x if there are few."""
    from matplotlib.ticker import MaxNLocator

    if not x.is_number:
        look: dict[str, Any] = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"}
        names = [plain_text(level) for level in x.levels]
        axes.set_xticks(range(len(names)), names, **(look if sum(map(len, x.levels)) > 40 else {}))
        axes.set_xlim(-0.6, len(names) - 0.4)
        return
    if "x" in log:
        axes.set_xscale("log")
    apart = np.diff(x.levels) > 0.08 * (x.levels[-1] - x.levels[0])
    if len(x.levels) <= _FEW_TICKS and apart.all() and not x.is_sample:
        axes.set_xticks(x.levels, [f"{x.exact(level):.4g}" for level in x.levels])
        axes.set_xticks([], minor=True)
    elif "x" not in log and all(float(level).is_integer() for level in x.levels):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    elif "x" not in log and x.is_sample:  # long numbers would overlap in panels side by side
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))


def _scale_y(axes: Axes, drawn: Drawn, log: str) -> None:
    """Scale and range of the y axis: runs and first model with margins; other models may leave the axes."""
    from matplotlib.ticker import MaxNLocator

    if "y" in log:
        axes.set_yscale("log", nonpositive="mask")
        return
    errors = np.nan_to_num(drawn.errors)
    others = [*list(drawn.theory.values())[:1], *([] if drawn.down is None else [drawn.down])]
    shown = np.concatenate([drawn.values - errors, drawn.values + errors, *others])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    if np.all(np.mod(drawn.values[np.isfinite(drawn.values)], 1.0) == 0.0):  # counts
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        low, high = low - 0.5, high + 0.5
    if high - low <= _LEAST_RANGE * abs(middle := (low + high) / 2.0) or high - low < _ROUNDING:
        half = 0.05 * abs(middle) if abs(middle) > _ROUNDING else 1.0
        low, high = middle - half, middle + half
    if high > low:
        axes.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))


def _legend(figure: Figure, grid: npt.NDArray[Any], colours: _Colours, drawn: Drawn) -> None:
    """A legend of colours and lines below all panels, or a colour scale beside them."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.lines import Line2D

    factor, title = colours.factor, None
    handles: list[Line2D] = []
    if factor is not None and colours.scale is not None:
        figure.colorbar(ScalarMappable(colours.scale, "viridis"), ax=grid, label=plain_text(factor.label))
    elif factor is not None:
        title = plain_text(factor.name)
        looks = zip(colours.levels, colours.looks, strict=True)
        handles = [Line2D([], [], ls="none", label=plain_text(factor.text(level)), **look) for level, look in looks]
    if drawn.down is not None:
        handles += [Line2D([], [], ls="none", **_UP), Line2D([], [], ls="none", mfc="none", **_DOWN)]
    lines = {line.get_linestyle() for axes in grid.flat for line in axes.lines}
    for number, model in enumerate(drawn.theory):
        handles.append(Line2D([], [], label=model, **_model_look(number, _MODELS[number][0] in lines, "0.3")))
    if handles:
        longest = max(len(str(handle.get_label())) for handle in handles)
        columns = max(1, min(len(handles), int(13.0 * figure.get_figwidth() / (longest + 6))))
        figure.legend(handles=handles, loc="outside lower center", title=title, ncols=columns)
