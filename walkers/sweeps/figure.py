"""The figure of a sweep: one column of its table against what was varied, in colours and panels."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, prod, sqrt
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.errors import InputError, expected_of, refused
from walkers.inputs.case_building import changed_case
from walkers.inputs.resolving.library import unmeasured
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.numbers import draws_text
from walkers.postprocess.measure.quantities import declared, is_declared, scatter_of, unit_shown
from walkers.postprocess.measure.results import derived
from walkers.postprocess.measure.uncertainty import few_draws
from walkers.postprocess.show.drawing import TWO_COLUMNS, errors_seen, letter_panels, new_figure, plain_text, styled
from walkers.runner.directory import case_of
from walkers.runs.status import status_text
from walkers.sweeps.figure_options import FigureOptions, Log
from walkers.sweeps.table import FACING_DOWN, SEEDS, default_column, find_name, key_values, together, value_text
from walkers.text import with_unit

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Predict = Callable[[Sequence[Case], str], tuple[Mapping[str, FloatArray], Mapping[str, int]]]
"""Function of N cases and a column: predictions of models, SI units, shape (N,); remarks, with the number of cases."""
SCATTER = "bars: standard deviation of the copies (uncertain parameters not varied)"
"""What the error bars of a sweep are."""
_BAND = "band: uncertain values only"
"""What the bands of a sweep are, in the legend."""
_NOT_IN_BAND = "the error of the model is not in it"
_UP: dict[str, Any] = {"marker": "o", "color": "0.3", "label": "started facing right (up)"}
_DOWN: dict[str, Any] = {"marker": "v", "color": "0.3", "label": "started facing left (down)"}
_MOST_PANELS = 12
_MARKERS = "osD^vXP<>*"
_MODELS = (("--", "_"), (":", "+"))  # line of each model, and its symbol if points are not joined
_CURVE = 61  # points of a model's curve
_OF_SHAPE = ("radii", "volume_fraction", "meniscus_radius", "contact_angle")
"""Ends of the keys that change the shape of bridges, each of which takes a tenth of a second to solve."""
_MOST_COLOURS = 10  # of the style
_ROUNDING = 1e-12  # relative to the largest number
_LEAST_RANGE = 1e-4  # smallest range of the y axis relative to the mean, so that rounding errors are not shown
_LETTERS = 26  # letters of a line of a y label
_FEW_TICKS = 6  # largest number of x values that all have ticks


@dataclass(frozen=True)
class Factor:
    """A property in which points differ: its keys, its label, and a number (in its unit) or a text for each point.

    Each key of a sample is a factor. Points of a sample do not share values. Those of log-uniform ranges have an axis
    with a logarithmic scale (``is_log``).
    """

    keys: tuple[str, ...]
    label: str
    values: Sequence[Any]
    is_number: bool
    is_sample: bool = False
    is_log: bool = False
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

    def exact(self, level: float) -> float:
        """A number, or zero if it is a rounding error."""
        return 0.0 if abs(level) < _ROUNDING * max(map(abs, self.levels)) else level

    def text(self, level: Any, *, by_name: bool = False) -> str:
        """A level as text with its unit, for numbers optionally with the factor's name."""
        text = f"{self.exact(level):.6g} {self.unit}".strip() if self.is_number else str(level)
        return f"{self.name} = {text}" if by_name and self.is_number else text


class LeftOutWarning(UserWarning):
    """Something is not in a figure: points without a result, keys that are not distinguished, a theory's prediction."""


def figure_of(table: pd.DataFrame, options: FigureOptions = FigureOptions(), predict: Predict | None = None) -> Figure:
    """Figure of the table of a sweep (`walkers.sweeps.table.load`), with the predictions of a theory if there is one.

    Bars are the scatter over copies where the table has it. Without y, on slopes where the walkers that face up and
    down differ, both are drawn. The axis of a key has the unit of the sweep file; other columns are in mm, mm/s, g
    (9.8 m/s²) and degrees. A `LeftOutWarning` reports what is left out; `InputError` if no point is finished, or there
    is no such column.
    """
    if options.log and options.log not in get_args(Log):
        raise refused("log", f"{options.log!r}: {expected_of(options.log, get_args(Log))}")
    column = column_of(table, options.y)
    done = table[table["status"] == "finished"]
    counts = Counter(table["status"][table["status"] != "finished"])
    unfinished = status_text(counts)
    if done.empty:
        raise refused(str(table.attrs["sweep"]), f"no point is finished ({unfinished or 'there is none'})")
    if counts:
        _tell(f"{sum(counts.values())} of {len(table)} points left out: {unfinished}")
    if empty := int(done[column].isna().sum()):
        _tell(f"{empty} of {len(done)} finished points have no {column}")
    *layout, undistinguished = layout_of(table, done, options)
    if undistinguished:
        _tell(f"not distinguished: {'; '.join(undistinguished)}")
    log, down = options.log or "", None if options.y else FACING_DOWN.get(column)
    theory = _Theory.at_points(done, column, log, predict) if predict else None
    return _draw(done, column, layout, theory, down=down, log=log)


def column_of(table: pd.DataFrame, name: str | None) -> str:
    """The column of a name, by default the main result; `InputError` if there is none."""
    return find_name("y", name, table.columns) if name else default_column(table)


def _tell(message: str) -> None:
    warnings.warn(message, LeftOutWarning, stacklevel=3)


def factors_of(table: pd.DataFrame) -> list[Factor]:
    """The factors of a sweep in the order of its keys, without keys that have one value.

    Keys of one axis are one factor if their numbers rise or fall together, or if they have texts or lists. Otherwise,
    as in a sample, each key is a factor.
    """
    return [factor for keys in table.attrs["axes"] for factor in _of_axis(table, keys)]


def _of_axis(table: pd.DataFrame, keys: Sequence[str]) -> list[Factor]:
    factors = []
    for key in keys:
        values, unit = key_values(table, key)
        is_number, is_log = {*map(type, values)} <= {int, float}, table.attrs.get("sampled", {}).get(key, False)
        values = [float(value) if is_number else value_text(value, unit) for value in values]
        unit = (unit or "") if is_number else ""
        factor = Factor((key,), with_unit(readable_key(key), unit), values, is_number, is_log=is_log, unit=unit)
        if len(factor.levels) > 1:
            factors.append(factor)
    if len(factors) < 2:
        return factors
    if not all(factor.is_number for factor in factors):
        # The texts of one key that distinguishes all levels, or of all keys.
        texts = [Factor(factor.keys, factor.name, [*map(factor.text, factor.values)], False) for factor in factors]
        whole = joined(texts)
        first = next((factor for factor in texts if len(factor.levels) == len(whole.levels)), whole)
        return [_with(first, factors)]
    steps = np.diff(np.unique(np.array([factor.values for factor in factors]).T, axis=0), axis=0)
    together = (steps[:, 0] > 0.0).all() and ((steps > 0.0).all(axis=0) | (steps < 0.0).all(axis=0)).all()
    return [_with(factors[0], factors)] if together else [replace(factor, is_sample=True) for factor in factors]


def _with(first: Factor, factors: Sequence[Factor]) -> Factor:
    """A factor that stands for others too, which its label names."""
    rest = [key for factor in factors for key in factor.keys if key not in first.keys]
    words = f"{len(rest)} further keys" if len(rest) > 2 else ", ".join(map(readable_key, rest))
    label = f"{first.label}\n(and with it {words})" if rest else first.label
    return replace(first, keys=(*first.keys, *rest), label=label)


def readable_key(key: str) -> str:
    """A dotted key or a column as words: ``friction bead wall``, ``liquid``; numbers of results by their labels."""
    table, _, name = key.partition(".")
    if is_declared(name or table):
        return declared(name or table).label
    words = table.partition("[")[0] if name in ("name", "material") else (name or table)
    return words.replace(".", " ").replace("_", " ")


def joined(factors: Sequence[Factor]) -> Factor:
    """Several factors as one whose levels are texts; a single factor as it is."""
    if len(factors) == 1:
        return factors[0]
    columns = [[factor.text(level, by_name=not factor.unit) for level in factor.values] for factor in factors]
    keys = tuple(key for factor in factors for key in factor.keys)
    texts = [", ".join(row) for row in zip(*columns, strict=True)]
    return Factor(keys, ", ".join(factor.name for factor in factors), texts, False)


def _numbers(rows: pd.DataFrame, name: str, option: str) -> Factor:
    """A column of numbers in its displayed unit."""
    import pandas as pd

    unit, factor = unit_shown(rows.attrs["units"].get(name) or "")
    values = pd.to_numeric(rows[name], errors="coerce").to_numpy(dtype=float, na_value=np.nan)
    if len(rows) and np.isnan(values).all():
        raise refused(option, f'"{name}" has no number that could be drawn')
    return Factor((name,), with_unit(readable_key(name), unit), (values * factor).tolist(), True, unit=unit)


def layout_of(
    table: pd.DataFrame, rows: pd.DataFrame, options: FigureOptions = FigureOptions()
) -> tuple[list[Factor], Factor | None, Factor | None, list[str]]:
    """Choose the factors on the x axis (of samples one for each panel), in colours and in panels for some rows.

    By default the x axis has the numbers with the most values, colours have the other factor with the most values, and
    panels have all further factors. Samples have a panel for each key. `InputError` if there is no key or column of an
    option. The last value has the names of keys that the figure does not distinguish.
    """
    places = table.index.get_indexer(rows.index).tolist()
    left = factors = [
        replace(factor, values=[factor.values[place] for place in places]) for factor in factors_of(table)
    ]
    chosen = {}
    for option, name in (("x", options.x), ("hue", options.hue), ("panels", options.panels)):
        if name is not None and not (name == "none" and option != "x"):
            column = find_name(option, name, [*(key for factor in factors for key in factor.keys), *table.columns])
            given = next((factor for factor in factors if column in factor.keys), None)
            if given is None and rows[column].map(lambda value: isinstance(value, str)).all():
                given = Factor((column,), readable_key(column), rows[column].tolist(), False)
            chosen[option] = given or _numbers(rows, column, option)
            left = [factor for factor in left if not _same(factor, chosen[option])]
    samples = [factor for factor in left if factor.is_sample]
    left = [factor for factor in left if not factor.is_sample]
    undistinguished = [factor.name for factor in samples] if "x" in chosen else []
    along = [chosen["x"]] if "x" in chosen else samples
    if not along:
        ranked = [factor for factor in left if factor.is_number] or left or [_numbers(rows, "point", "x")]
        along = [max(ranked, key=lambda factor: (factor.keys[0] not in SEEDS, len(factor.levels)))]
    left = [factor for factor in left if factor not in along and factor.keys[0] not in SEEDS]
    left.sort(key=lambda factor: -len(factor.levels))
    colours = chosen.get("hue") or (left.pop(0) if left and options.hue is None else None)
    apart = chosen.get("panels")
    if len(along) > 1 and apart is not None:
        raise refused("panels", "expected x too: the samples have a panel for each key")
    if options.panels is None and left and len(along) == 1:
        while prod(len(factor.levels) for factor in left) > _MOST_PANELS:
            undistinguished.append(left.pop(0 if len(left[0].levels) > _MOST_PANELS else -1).name)
        apart, left = joined(left) if left else None, []
    return along, colours, apart, [*undistinguished, *(factor.name for factor in left)]


def _same(first: Factor, second: Factor) -> bool:
    """Whether two factors distinguish the same points, such as Γ0 and the acceleration."""
    pairs = len(set(zip(first.values, second.values, strict=True)))
    return first.keys == second.keys or pairs == len(first.levels) == len(second.levels)


def rank_correlations(done: pd.DataFrame, column: str, keys: Sequence[str]) -> dict[str, float] | None:
    """Rank correlations of a column with drawn keys, the strongest first, if larger than two standard errors.

    Points without a number and walkers that came apart do not count. None if the draws are too few (`few_draws`).
    """
    points = together(done).dropna(subset=column)
    if few_draws(len(points), len(keys)):
        return None
    ranks = {key: _rank_correlation(points[key], points[column]) for key in keys}
    certain = {key: rank for key, rank in ranks.items() if abs(rank) > 2.0 / sqrt(len(points) - 1)}
    return dict(sorted(certain.items(), key=lambda item: -abs(item[1])))


def _rank_correlation(first: Any, second: Any) -> float:
    """Spearman's correlation of two columns, the correlation of their ranks; 0 if one is constant."""
    import pandas as pd

    rank = pd.Series(first, dtype=float).rank().corr(pd.Series(second, dtype=float).rank())
    return 0.0 if np.isnan(rank) else float(rank)


@dataclass(frozen=True)
class _Theory:
    """Predictions of models for the cases of the points (``values``, in the displayed unit), and between them."""

    predict: Predict
    done: pd.DataFrame
    column: str
    log: str
    cases: Sequence[Case]
    values: Mapping[str, FloatArray]
    remarks: Collection[str]

    @classmethod
    def at_points(cls, done: pd.DataFrame, column: str, log: str, predict: Predict) -> _Theory | None:
        """The theory of the points; None if it has no such number, which a warning says."""
        cases, factor = [case_of(Path(run)) for run in done["run"]], _factor(done, column)
        predicted, remarks = predict(cases, column)
        for remark, number in remarks.items():
            _tell(f"{number} of {len(done)} points: {remark}")
        values = {model: factor * values for model, values in predicted.items()}
        return cls(predict, done, column, log, cases, values, remarks.keys()) if values else None

    def curves(
        self, rows: npt.NDArray[np.int64], at: FloatArray, x: Factor | None
    ) -> tuple[FloatArray, Mapping[str, FloatArray]]:
        """Places on the x axis and predictions there: those of the points, which are ``at`` these places.

        A fine curve instead for an axis ``x`` along which the points differ in one number. If x is no key, such as Γ0,
        the key that varies is changed.
        """
        points, case = self.done.iloc[rows], self.cases[rows[0]]
        of_points = at, {model: values[rows] for model, values in self.values.items()}
        moving = [key for key in self.done.attrs["varied"] if points[key].nunique() > 1]
        if x is None or len(moving) != 1 or not (x.keys[0] in moving or x.keys[0] in derived(case)):
            return of_points
        key, name = moving[0], x.keys[0]
        if key.endswith(_OF_SHAPE) or points[key].dtype.kind not in "if":
            return of_points
        low, high = float(points[key].min()), float(points[key].max())
        spacing = np.geomspace if "x" in self.log and low > 0.0 else np.linspace
        numbers = spacing(low, high, _CURVE).tolist()
        unit = self.done.attrs["units"][key] or ""
        cases = [(low, _with_number(case, key, low, unit))]
        for value in numbers[1:-1]:
            # Between two points there may be values that no case has, such as half an integer.
            with suppress(InputError):
                cases.append((value, _with_number(case, key, value, unit)))
        cases.append((high, _with_number(case, key, high, unit)))
        predicted, remarks = self.predict([moved for _, moved in cases], self.column)
        if predicted.keys() != self.values.keys():
            return of_points
        if not all(np.isfinite(values).all() for values in predicted.values()):
            for remark in remarks.keys() - self.remarks:
                _tell(f"the theory's curve has gaps: {remark}")
        along = [value if name == key else _factor(self.done, name) * derived(moved)[name] for value, moved in cases]
        factor = _factor(self.done, self.column)
        return np.array(along), {model: factor * values for model, values in predicted.items()}


def _with_number(case: Case, key: str, value: float, unit: str) -> Case:
    """The case with a number of a key in a unit; without a unit it is a plain number, in case files too."""
    if unit:
        return changed_case(case, {key: f"{value!r} {unit}"})
    return changed_case(case, {key: int(value) if value.is_integer() else value})


def _factor(done: pd.DataFrame, column: str) -> float:
    """How many displayed units an SI unit of a column is."""
    return unit_shown(done.attrs["units"].get(column) or "")[1]


def _points(done: pd.DataFrame, column: str, down: str | None) -> tuple[str, pd.DataFrame]:
    """Label and values of a column in its displayed unit, errors, and values of walkers that face down a slope."""
    import pandas as pd

    label, points = _numbers(done, column, "y").label, pd.DataFrame({"error": np.full(len(done), np.nan)})
    sources = {"value": column, "error": scatter_of(column), "low": f"{column}_low", "high": f"{column}_high"}
    for name, source in {**sources, "down": down}.items():
        if source and source in done and done[source].notna().any():
            points[name] = _numbers(done, source, "y").values
    return label.replace(", facing right (up)", "") if "down" in points else label, points


def _draws(done: pd.DataFrame, column: str) -> str:
    """Numbers of draws of the spreads at the points: ``32``, or ``30 to 32`` if some failed or came apart."""
    numbers = done[f"{column}_draws"].dropna()
    draws = " to ".join(f"{number:.0f}" for number in sorted({numbers.min(), numbers.max()}))
    return draws_text(draws, approximate=bool(done[f"{column}_approximate"].eq(True).any()))


@styled
def _draw(
    done: pd.DataFrame,
    column: str,
    layout: Sequence[Any],
    theory: _Theory | None,
    *,
    down: str | None,
    log: str,
) -> Figure:
    """Draw a column with the factors of `layout_of`."""
    along, hue, panels = layout
    if "x" in log and not all(factor.is_number for factor in along):
        raise refused("log", f"{along[0].label} has no numbers")
    label, points = _points(done, column, down)
    parts, texts = [(x, _with_usual_others(x, along), "") for x in along], [done.attrs["title"]]
    sampled = done.attrs.get("sampled", {})
    if len(along) > 1 and all(x.keys[0] in sampled for x in along):
        ranks = rank_correlations(done, column, [*sampled])
        if ranks is None:
            texts.append(f"{len(done)} draws: too few for rank correlations")
        else:
            titles = {key: f"rank correlation {rank:+.2f}" for key, rank in ranks.items()}
            parts = [(x, shown, titles.get(x.keys[0], "no clear dependence")) for x, shown, _ in parts]
            parts.sort(key=lambda part: -abs(ranks.get(part[0].keys[0], 0.0)))
    if panels is not None:
        parts = [(along[0], _where(panels, level), panels.text(level, by_name=True)) for level in panels.levels]
    looks = _looks(hue, hollow=bool(theory))
    columns = min(len(parts), 2 if len(parts) in (2, 4) else 3)
    rows = ceil(len(parts) / columns)
    width, height = TWO_COLUMNS, 4.2 if len(parts) == 1 else 6.0 / columns * rows + 0.9
    shared = {"sharey": True, "sharex": len(along) == 1}
    figure, grid = new_figure(width, height, nrows=rows, ncols=columns, squeeze=False, **shared)
    for axes, (number, (x, drawn, name)) in zip(grid.flat, enumerate(parts), strict=False):
        for place, (level, look) in enumerate(looks.items()):
            aside = 0.0 if x.is_number else (place - (len(looks) - 1) / 2.0) * min(0.12, 0.6 / len(looks))
            _series(axes, x, drawn & _where(hue, level), aside, points, theory, look)
        if np.nanmin(points.drop(columns="error")) <= 0.0 <= np.nanmax(points.drop(columns="error")):
            axes.axhline(0.0, color="0.4", lw=0.6, zorder=0)
        axes.set_title(plain_text(name))
        if len(along) > 1 or number + columns >= len(parts):  # no panel below
            axes.set_xlabel(plain_text(x.label))
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel(plain_text("\n".join(wrap(label, _LETTERS))))
        _scale_x(axes, x, log)
    letter_panels(grid.flat[: len(parts)] if len(parts) > 1 else ())
    _scale_y(grid[0, 0], points, list(theory.values.values()) if theory else [], log)
    for axes in grid.flat[len(parts) :]:
        axes.set_axis_off()
    band = f"{_BAND}, 5 to 95 % of {_draws(done, column)}" if "low" in points else ""
    _legend(figure, grid, hue, looks, list(theory.values) if theory else [], down="down" in points, band=band)
    texts += _remarks(done, points, band)
    figure.suptitle(plain_text("\n".join(line for text in texts for line in wrap(text, round(14.0 * width)))))
    return figure


def _remarks(done: pd.DataFrame, points: pd.DataFrame, band: str) -> list[str]:
    """What the bands and the error bars of a figure are, for its title."""
    remarks = []
    if band:
        remarks.append(f"{band}; {_NOT_IN_BAND}")
    if points["error"].notna().any():
        banded = band or {*unmeasured()} & {*done.attrs["varied"]}
        bars = SCATTER.partition(" (")[0] if banded else SCATTER
        if not errors_seen(points["error"], points["value"]):
            bars += ", smaller than the symbols"
        remarks.append(bars)
    return remarks


def _with_usual_others(x: Factor, along: Sequence[Factor]) -> npt.NDArray[np.bool_]:
    """Which points a panel shows: all, or of keys that vary one at a time those with the usual values of the others."""
    usual = {factor.keys: Counter(factor.values).most_common(1)[0][0] for factor in along}
    changed = {factor.keys: np.array([value != usual[factor.keys] for value in factor.values]) for factor in along}
    number = np.sum([*changed.values()], axis=0)
    return np.array((number > 1).any() | changed[x.keys] | (number == 0))


def _where(factor: Factor | None, level: Any) -> npt.NDArray[np.bool_]:
    return np.array([value == level for value in factor.values] if factor else True)


def _looks(factor: Factor | None, *, hollow: bool) -> dict[Any, dict[str, Any]]:
    """Colours and symbols of the levels of a factor."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    levels: list[Any] = factor.levels if factor else [None]
    many = colormaps["turbo"](np.linspace(0.0, 0.92, len(levels))) if len(levels) > _MOST_COLOURS else None
    looks = {}
    for place, level in enumerate(levels):
        # "C0" would be looked up when the figure is drawn, in the style of whoever draws it then.
        colour = to_hex(f"C{place}") if many is None else many[place]
        # Symbols that are drawn later are smaller, so that those of coinciding points are seen.
        size = 4.5 + min(1.0, 4.0 / len(levels)) * (len(levels) - 1 - place)
        marker = _MARKERS[place % len(_MARKERS)]
        looks[level] = {"marker": marker, "color": colour, "mfc": "none" if hollow else colour, "ms": size}
    return looks


def _series(
    axes: Axes,
    x: Factor,
    drawn: npt.NDArray[np.bool_],
    aside: float,
    points: pd.DataFrame,
    theory: _Theory | None,
    look: Mapping[str, Any],
) -> None:
    """Means with error bars, joined by lines unless there is a theory, and the predictions of the theory.

    Symbols of different colours are side by side in their category.
    """
    places = np.array(x.values if x.is_number else [x.levels.index(level) for level in x.values], float) + aside
    rows = np.flatnonzero(drawn)
    rows = rows[np.argsort(places[rows], kind="stable")]
    at, shown = places[rows], points.iloc[rows]
    is_course = x.is_number and not x.is_sample and x.keys[0] not in SEEDS
    is_line = is_course and len(set(at)) == len(rows) > 1
    line = "-" if is_line and not theory else "none"
    bars = shown["error"] if errors_seen(points["error"], points["value"]) else None
    axes.errorbar(at, shown["value"].to_numpy(), yerr=bars, capsize=2, lw=0.9, ls=line, **look)
    if "low" in shown:
        ends = at, shown["low"].to_numpy(), shown["high"].to_numpy()
        wide = axes.fill_between if is_line else axes.vlines
        wide(*ends, color=look["color"], alpha=0.25, zorder=0.5, lw=0.0 if is_line else 4.0)
    if "down" in shown:
        shape = {"marker": _DOWN["marker"], "mfc": "none", "ls": "--" if is_line else "none"}
        axes.plot(at, shown["down"], lw=0.9, **{**look, **shape})
    if theory is None:
        return
    along, models = theory.curves(rows, at, x if is_line else None)
    for number, values in enumerate(models.values()):
        axes.plot(along, values, zorder=1, **_model_look(number, is_line, look["color"]))


def _model_look(number: int, is_line: bool, colour: Any) -> dict[str, Any]:
    line, marker = _MODELS[number]
    return {"color": colour, "lw": 0.9, **({"ls": line} if is_line else {"ls": "none", "marker": marker, "ms": 9})}


def _scale_x(axes: Axes, x: Factor, log: str) -> None:
    """Scale of the x axis; names of categories (slanted if long); ticks at the values of x if there are few."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

    if not x.is_number:
        slanted: dict[str, Any] = (
            {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if sum(map(len, x.levels)) > 40 else {}
        )
        axes.set_xticks(range(len(x.levels)), [plain_text(level) for level in x.levels], **slanted)
        axes.set_xlim(-0.6, len(x.levels) - 0.4)
        return
    log = f"x{log}" if x.is_log else log
    if "x" in log:
        axes.set_xscale("log")
    apart = np.diff(x.levels) > 0.08 * (x.levels[-1] - x.levels[0])
    if len(x.levels) <= _FEW_TICKS and apart.all() and not x.is_sample:
        axes.set_xticks(x.levels, [f"{x.exact(level):.4g}" for level in x.levels])
        axes.set_xticks([], minor=True)
    elif x.is_log:
        ticks = (1.0, 2.0, 5.0) if x.levels[-1] < 40.0 * x.levels[0] else (1.0,)
        axes.xaxis.set_major_locator(LogLocator(subs=ticks))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    elif "x" not in log:  # long numbers would overlap in panels side by side
        whole = all(float(level).is_integer() for level in x.levels)
        axes.xaxis.set_major_locator(MaxNLocator(4 if x.is_sample else "auto", steps=[1, 2, 5, 10], integer=whole))


def _scale_y(axes: Axes, points: pd.DataFrame, theory: Sequence[FloatArray], log: str) -> None:
    """Scale and range of the y axis: runs and first model with margins; of other models a point at least is within."""
    from matplotlib.ticker import MaxNLocator

    if "y" in log:
        axes.set_yscale("log", nonpositive="mask")
        return
    values, errors = points["value"], points["error"].fillna(0.0)
    ends = points.filter(["down", "low", "high"]).to_numpy().ravel()
    shown = np.concatenate([values - errors, values + errors, *theory[:1], ends])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    for model in (model[np.isfinite(model)].tolist() for model in theory[1:]):
        low, high = min(low, max(model, default=low)), max(high, min(model, default=high))
    if (values.dropna() % 1.0 == 0.0).all():  # counts
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        low, high = low - 0.5, high + 0.5
    if high - low <= _LEAST_RANGE * abs(middle := (low + high) / 2.0) or high - low < _ROUNDING:
        half = 0.05 * abs(middle) if abs(middle) > _ROUNDING else 1.0
        low, high = middle - half, middle + half
    axes.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))


def _legend(
    figure: Figure,
    grid: npt.NDArray[Any],
    hue: Factor | None,
    looks: Mapping[Any, Mapping[str, Any]],
    models: Sequence[str],
    *,
    down: bool,
    band: str,
) -> None:
    """A legend of colours, lines and bands below all panels."""
    from matplotlib.lines import Line2D

    given: list[dict[str, Any]] = []
    if hue is not None:
        given = [{"ls": "none", "label": plain_text(hue.text(level)), **look} for level, look in looks.items()]
    if down:
        given += [{"ls": "none", **_UP}, {"ls": "none", "mfc": "none", **_DOWN}]
    lines = {line.get_linestyle() for axes in grid.flat for line in axes.lines}
    for number, model in enumerate(models):
        given.append({"label": model, **_model_look(number, _MODELS[number][0] in lines, "0.3")})
    if band:
        given.append({"lw": 5.0, "alpha": 0.25, "color": "0.3", "label": band})
    if given:
        longest = max(len(look["label"]) for look in given)
        columns = max(1, min(len(given), int(13.0 * figure.get_figwidth() / (longest + 6))))
        title = plain_text(hue.name) if hue is not None else None
        handles = [Line2D([], [], **look) for look in given]
        figure.legend(handles=handles, loc="outside lower center", title=title, ncols=columns)
