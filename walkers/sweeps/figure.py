"""The figure of a sweep: one column of its table against what was varied, in colours and panels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import ceil
from textwrap import wrap
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.errors import expected_of, refused
from walkers.inputs.resolving.library import unmeasured
from walkers.postprocess.measure.numbers import draws_text
from walkers.postprocess.measure.quantities import scatter_of
from walkers.postprocess.show.drawing import TWO_COLUMNS, errors_seen, letter_panels, new_figure, plain_text, styled
from walkers.runs.status import status_text
from walkers.sweeps.correlations import rank_correlations
from walkers.sweeps.factors import Factor, numbers_of
from walkers.sweeps.figure_options import FigureOptions, Log
from walkers.sweeps.layout import Layout, layout_of
from walkers.sweeps.left_out import tell
from walkers.sweeps.predictions import Predict, Theory
from walkers.sweeps.table import FACING_DOWN, SEEDS, SweepTable, default_column, find_name

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCATTER = "bars: standard deviation of the copies (uncertain parameters not varied)"
"""What the error bars of a sweep are."""
_BAND = "band: uncertain values only"
"""What the bands of a sweep are, in the legend."""
_NOT_IN_BAND = "the error of the model is not in it"
_UP: dict[str, Any] = {"marker": "o", "color": "0.3", "label": "started facing right (up)"}
_DOWN: dict[str, Any] = {"marker": "v", "color": "0.3", "label": "started facing left (down)"}
_MARKERS = "osD^vXP<>*"
_MODELS = (("--", "_"), (":", "+"))  # line of each model, and its symbol if points are not joined
_MOST_COLOURS = 10  # of the style
_ROUNDING = 1e-12  # relative to the largest number
_LEAST_RANGE = 1e-4  # smallest range of the y axis relative to the mean, so that rounding errors are not shown
_LETTERS = 26  # letters of a line of a y label
_FEW_TICKS = 6  # largest number of x values that all have ticks


def figure_of(table: SweepTable, options: FigureOptions = FigureOptions(), predict: Predict | None = None) -> Figure:
    """Figure of the table of a sweep, with the predictions of a theory if there is one.

    Bars are the scatter over copies where the table has it. Without y, on slopes where the walkers
    that face up and down differ, both are drawn. The axis of a key has the unit of the sweep file;
    other columns are in mm, mm/s, g (9.8 m/s²) and degrees. A `LeftOutWarning` reports what is left
    out.

    Parameters
    ----------
    table
        The table of the sweep.
    options
        What is drawn, and where (`walkers.sweeps.layout.layout_of`).
    predict
        The predictions of models; None: no theory is drawn.

    Raises
    ------
    InputError
        If no point is finished, there is no such column, or keys would be hidden.
    """
    if options.log and options.log not in get_args(Log):
        raise refused("log", f"{options.log!r}: {expected_of(options.log, get_args(Log))}")
    frame = table.frame
    column = column_of(frame, options.y)
    done = table.finished
    _tell_left_out(frame, done, column)
    layout = layout_of(frame, done, options)
    if layout.hidden:
        tell(f"not distinguished: {'; '.join(factor.name for factor in layout.hidden)}")
    log = options.log or ""
    theory = Theory.at_points(table, column, log, predict) if predict else None
    down = None if options.y else FACING_DOWN.get(column)
    return _draw(done, column, layout, theory, down=down, log=log)


def _tell_left_out(frame: pd.DataFrame, done: pd.DataFrame, column: str) -> None:
    """Warn about points that are not drawn; `InputError` if none is finished."""
    counts = Counter(frame["status"][frame["status"] != "finished"])
    unfinished = status_text(counts)
    if done.empty:
        raise refused(str(frame.attrs["sweep"]), f"no point is finished ({unfinished or 'there is none'})")
    if counts:
        tell(f"{counts.total()} of {len(frame)} points left out: {unfinished}")
    empty = int(done[column].isna().sum())
    if empty:
        tell(f"{empty} of {len(done)} finished points have no {column}")


def column_of(table: pd.DataFrame, name: str | None) -> str:
    """The column of a name, by default the main result; `InputError` if there is none."""
    return find_name("y", name, table.columns) if name else default_column(table)


def _points(done: pd.DataFrame, column: str, down: str | None) -> tuple[str, pd.DataFrame]:
    """Label and values of a column in its displayed unit, errors, and values of walkers that face down a slope."""
    import pandas as pd

    label, points = numbers_of(done, column, "y").label, pd.DataFrame({"error": np.full(len(done), np.nan)})
    sources = {"value": column, "error": scatter_of(column), "low": f"{column}_low", "high": f"{column}_high"}
    for name, source in {**sources, "down": down}.items():
        if source and source in done and done[source].notna().any():
            points[name] = numbers_of(done, source, "y").values
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
    layout: Layout,
    theory: Theory | None,
    *,
    down: str | None,
    log: str,
) -> Figure:
    """Draw a column with the factors of `layout_of`."""
    along, hue, panels = layout.along, layout.hue, layout.panels
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
    theory: Theory | None,
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
