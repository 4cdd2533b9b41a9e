"""The points of a sweep in one panel of its figure: symbols, error bars, bands, lines, theory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from operator import itemgetter
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.postprocess.measure.quantities import LABELS, scatter_of
from walkers.postprocess.show.drawing import errors_seen, ordered_colours, plain_text
from walkers.sweeps.factors import Factor, number_factor
from walkers.sweeps.own_points import OwnPoints
from walkers.sweeps.predictions import Theory
from walkers.sweeps.table import SEEDS

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Style: TypeAlias = dict[str, Any]
"""Keyword arguments of matplotlib: colour, symbol and its size."""
_UP: Style = {"marker": "o", "color": "0.3", "label": "started facing right (up)"}
"""Entry of the legend for walkers that face up a slope."""
_DOWN: Style = {"marker": "v", "color": "0.3", "label": "started facing left (down)"}
"""Entry of the legend for walkers that face down a slope."""
_MARKERS = "osD^vXP<>*"
"""Symbols of the colours."""
_MODEL_LINES = ("--", ":")
"""Lines of the models."""
_MODEL_MARKERS = ("_", "+")
"""Symbols of the models where points are not joined by lines."""
_MOST_COLOURS = 10
"""Number of colours in the style of the project."""
_COMMON_COLOUR = "0.3"
"""Colour of predictions that are the same for all series, and of models in the legend."""
_SYMBOL_SIZE = 4.5
"""Size of symbols, points."""
_LARGEST_STEP = 0.6
"""Largest difference of the sizes of symbols that cover each other, points."""
_SAME_SHARE = 1e-6
"""Difference of curves that are drawn once, relative to the largest value."""
_COVERED = 0.02
"""Distance of two symbols that cover each other, relative to the range of the points."""
_LARGEST_OFFSET = 0.12
"""Largest distance of the symbols of two colours in a category; categories have the distance 1."""
LEGEND_LETTERS_PER_INCH = 13.0
"""Letters of a line of the legend, per inch of the figure."""
_LETTERS_OF_SYMBOL = 6
"""Space of a symbol in the legend, in letters."""
_OWN_MARKERS = "Ds^vPX"
"""Symbols of the user's own points."""
_UNLIKE_ORDERED = 2
"""First of the style's colours that is unlike the colours of ordered levels: red."""
_ENGINE = "engine"
"""Entry of the legend for points of one colour beside a theory or the user's own points."""
_BAND_OPACITY = 0.25
"""Opacity of bands, from 0 to 1."""


@dataclass(frozen=True)
class Colours:
    """Colours and symbols that tell the levels of a factor apart.

    Attributes
    ----------
    factor
        The factor; None: all points have the same colour.
    styles
        Colour, symbol and its size by the level; for the level None without a factor.
    """

    factor: Factor | None
    styles: Mapping[Any, Style]

    @classmethod
    def of_factor(cls, factor: Factor | None, *, hollow: bool, nested: bool = False) -> Colours:
        """The colours of the levels of a factor.

        Numbers have an order, and their colours become lighter from the smallest to the largest;
        texts have the different colours of the project's style.

        Parameters
        ----------
        factor
            The factor; None: all points have the same colour.
        hollow
            Whether symbols are hollow; otherwise they are filled.
        nested
            Whether symbols that are drawn later are smaller, so that points that coincide are seen.
        """
        levels: list[Any] = factor.levels if factor else [None]
        colours = _colours(len(levels))
        if factor is not None and factor.is_number:
            colours = ordered_colours(len(levels))
        step = min(_LARGEST_STEP, 4.0 / len(levels)) if nested else 0.0
        styles = {}
        for number, (level, colour) in enumerate(zip(levels, colours, strict=True)):
            later = len(levels) - 1 - number
            styles[level] = {
                "marker": _MARKERS[number % len(_MARKERS)],
                "color": colour,
                "mfc": "none" if hollow else colour,
                "ms": _SYMBOL_SIZE + step * later,
            }
        return cls(factor, styles)

    @property
    def is_ordered(self) -> bool:
        """Whether the levels have an order, and colours that show it."""
        return self.factor is not None and self.factor.is_number

    def points_of_level(self, level: Any, drawn: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Which of the drawn points have the colour of a level, shape (N,)."""
        if self.factor is None:
            return drawn
        return drawn & self.factor.has_level(level)


def _colours(number: int) -> list[Any]:
    """Colours of the project's style, or of a colour map if these are not enough."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    if number > _MOST_COLOURS:
        return list(colormaps["turbo"](np.linspace(0.0, 0.92, number)))
    # "C0" would be looked up when the figure is drawn, in the style of whoever draws it then.
    return [to_hex(f"C{place}") for place in range(number)]


@dataclass(frozen=True)
class Series:
    """Points of one colour in a panel.

    Attributes
    ----------
    x
        The factor on the x axis.
    rows
        Numbers of the points in the table of finished points, in the order of their places.
    places
        Where they are on the x axis.
    """

    x: Factor
    rows: npt.NDArray[np.int64]
    places: npt.NDArray[np.float64]

    @classmethod
    def of_points(cls, x: Factor, drawn: npt.NDArray[np.bool_], offset: float = 0.0) -> Series:
        """The series of the points that are ``drawn``, moved by an offset on the x axis."""
        values = x.values
        if not x.is_number:
            values = [x.levels.index(level) for level in x.values]
        places = np.array(values, dtype=float) + offset
        rows = np.flatnonzero(drawn)
        rows = rows[np.argsort(places[rows], kind="stable")]
        return cls(x, rows, places[rows])

    @property
    def is_line(self) -> bool:
        """Whether lines may join the points.

        Each point must have a place of its own along a number that was chosen, not drawn.
        """
        x = self.x
        if not x.is_number or x.is_sample or x.keys[0] in SEEDS:
            return False
        return len(set(self.places)) == len(self.rows) > 1


def points_of(finished: pd.DataFrame, column: str, down: str | None) -> tuple[str, pd.DataFrame]:
    """The numbers of a column that are drawn, in its displayed unit.

    Parameters
    ----------
    finished
        The finished points of a sweep.
    column
        A column of their table.
    down
        The column of walkers that face down a slope, if they are drawn beside those that face up.

    Returns
    -------
    label : str
        Label of the y axis.
    points : pandas.DataFrame
        Columns ``value`` and ``error``; ``low`` and ``high`` if there are bands, and ``down``.
    """
    import pandas as pd

    points = pd.DataFrame({"error": np.full(len(finished), np.nan)})
    sources = {
        "value": column,
        "error": scatter_of(column),
        "low": f"{column}_low",
        "high": f"{column}_high",
        "down": down,
    }
    for name, source in sources.items():
        if source and source in finished and finished[source].notna().any():
            points[name] = number_factor(finished, source, "y").values
    factor = number_factor(finished, column, "y")
    if "down" in points:  # the figure has walkers of both directions
        factor = replace(factor, name=LABELS[column]["both"])
    return factor.label, points


def points_cover(x: Factor, values: FloatArray, colours: Colours) -> bool:
    """Whether points of different colours cover each other.

    Parameters
    ----------
    x
        The factor on the x axis.
    values : ndarray, shape (N,)
        The values of all points, as drawn.
    colours
        The colours of the points.
    """
    if colours.factor is None:
        return False
    near = _COVERED * float(np.nanmax(values) - np.nanmin(values))
    by_place: dict[Any, list[tuple[float, Any]]] = {}
    for place, value, level in zip(x.values, values, colours.factor.values, strict=True):
        by_place.setdefault(place, []).append((value, level))
    for points in by_place.values():
        points.sort(key=itemgetter(0))
        for (lower, lower_level), (higher, higher_level) in pairwise(points):
            if higher - lower <= near and lower_level != higher_level:
                return True
    return False


def category_offset(number: int, count: int) -> float:
    """Distance of the symbols of a colour from the middle of their category.

    Parameters
    ----------
    number
        Number of the colour, from 0.
    count
        Number of colours.
    """
    distance = min(_LARGEST_OFFSET, 0.6 / count)
    return (number - (count - 1) / 2.0) * distance


def draw_series(
    axes: Axes, series: Series, points: pd.DataFrame, style: Style, *, joined: bool
) -> None:
    """Draw points with error bars, bands, and the points of walkers that face down.

    Error bars are left out if all of them are smaller than the symbols (`errors_seen`).

    Parameters
    ----------
    axes
        The axes of the panel.
    series
        The points to draw.
    points
        All points, as from `points_of`.
    style
        Their colour and symbol.
    joined
        Whether lines join the points if they are a line.
    """
    shown = points.iloc[series.rows]
    bars = shown["error"] if errors_seen(points["error"], points["value"]) else None
    line = "-" if series.is_line and joined else "none"
    axes.errorbar(
        series.places, shown["value"].to_numpy(), yerr=bars, capsize=2, lw=0.9, ls=line, **style
    )
    if "low" in shown:
        _draw_band(axes, series, shown, style["color"])
    if "down" in shown:
        line = "--" if series.is_line else "none"
        style_down = {**style, "marker": _DOWN["marker"], "mfc": "none"}
        axes.plot(series.places, shown["down"], lw=0.9, ls=line, **style_down)


def _draw_band(axes: Axes, series: Series, shown: pd.DataFrame, colour: Any) -> None:
    """The band of a line, and a thick bar at each point that is not on it.

    Points on a line whose neighbours have no band are not on its band.
    """
    low = shown["low"].to_numpy(dtype=float)
    high = shown["high"].to_numpy(dtype=float)
    has_bar = np.isfinite(low)
    if series.is_line:
        axes.fill_between(
            series.places, low, high, color=colour, alpha=_BAND_OPACITY, zorder=0.5, lw=0.0
        )
        has_bar &= ~_has_finite_neighbour(low)
    if not has_bar.any():
        return
    axes.vlines(
        series.places[has_bar],
        low[has_bar],
        high[has_bar],
        color=colour,
        alpha=_BAND_OPACITY,
        zorder=0.5,
        lw=4.0,
    )


def _has_finite_neighbour(numbers: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether the number before or after each number is finite, shape (N,)."""
    is_finite = np.isfinite(numbers)
    has_neighbour = np.zeros_like(is_finite)
    has_neighbour[1:] |= is_finite[:-1]
    has_neighbour[:-1] |= is_finite[1:]
    return has_neighbour


def own_styles(labels: Sequence[str], colours: Colours) -> list[Style]:
    """Colours and symbols of the user's own points: white symbols, and colours that are left.

    Parameters
    ----------
    labels
        Their entries in the legend.
    colours
        The colours of the points of the sweep.
    """
    used = len(colours.styles)
    if colours.is_ordered:
        used = _UNLIKE_ORDERED
    palette = _colours(used + len(labels))
    styles = []
    for number, label in enumerate(labels):
        styles.append(
            {
                "marker": _OWN_MARKERS[number % len(_OWN_MARKERS)],
                "color": palette[used + number],
                "mfc": "white",
                "ms": 4.5,
                "label": plain_text(label),
            }
        )
    return styles


def draw_own_points(axes: Axes, points: OwnPoints, style: Style) -> None:
    """Draw the user's own points with their error bars, before those of the sweep."""
    axes.errorbar(
        points.x,
        points.y,
        xerr=points.x_error,
        yerr=points.y_error,
        ls="none",
        lw=0.9,
        capsize=2,
        zorder=3.0,
        **style,
    )


def draw_theory(
    axes: Axes, series: Sequence[Series], theory: Theory, colours: Sequence[Any]
) -> None:
    """Draw the predictions of all models for the series of a panel.

    A model that predicts the same for all series is drawn once, in grey.

    Parameters
    ----------
    axes
        The axes of the panel.
    series
        The series.
    theory
        The predictions.
    colours
        The colour of each series.
    """
    predictions = []
    for points in series:
        x = points.x if points.is_line else None
        predictions.append(theory.curves(points.rows, points.places, x))
    for number, model in enumerate(theory.values):
        curves = [(places, models[model]) for places, models in predictions]
        shown_colours = list(colours)
        if len(curves) > 1 and _are_equal(curves):
            curves = curves[:1]
            shown_colours = [_COMMON_COLOUR]
        for (places, values), points, colour in zip(curves, series, shown_colours, strict=False):
            axes.plot(places, values, zorder=1, **_model_style(number, points.is_line, colour))


def _are_equal(curves: Sequence[tuple[FloatArray, FloatArray]]) -> bool:
    """Whether all curves, given by places and values, are the first one but for rounding errors."""
    first_places, first_values = curves[0]
    largest = float(np.nanmax(np.abs(first_values), initial=0.0))
    for places, values in curves[1:]:
        if len(places) != len(first_places) or not np.allclose(places, first_places):
            return False
        if not np.allclose(
            values, first_values, rtol=0.0, atol=_SAME_SHARE * largest, equal_nan=True
        ):
            return False
    return True


def _model_style(number: int, is_line: bool, colour: Any) -> Style:
    """How the predictions of a model are drawn: as a line, or as symbols."""
    if is_line:
        return {"color": colour, "lw": 0.9, "ls": _MODEL_LINES[number]}
    return {"color": colour, "lw": 0.9, "ls": "none", "marker": _MODEL_MARKERS[number], "ms": 9}


def draw_legend(  # noqa: PLR0913
    figure: Figure,
    colours: Colours,
    models: Sequence[str] = (),
    point_styles: Sequence[Style] = (),
    *,
    down: bool,
    band: str,
    letters: int,
) -> None:
    """Draw a legend of colours, models and bands below all panels, if there is any to explain.

    Parameters
    ----------
    figure
        The figure, whose panels are drawn.
    colours
        The colours.
    models
        Names of the models.
    point_styles
        Styles of the user's own points, from `own_styles`.
    down
        Whether walkers that face down are a series beside those that face up.
    band
        What the bands are; empty: there are none.
    letters
        Letters of a line as wide as the figure.
    """
    from matplotlib.lines import Line2D

    handles = _colour_handles(colours)
    if (point_styles or models) and not handles:
        (style,) = colours.styles.values()
        handles.append(Line2D([], [], ls="none", label=_ENGINE, **style))
    if down:
        handles.append(Line2D([], [], ls="none", **_UP))
        handles.append(Line2D([], [], ls="none", mfc="none", **_DOWN))
    line_styles = _line_styles(figure)
    for number, model in enumerate(models):
        style = _model_style(number, _MODEL_LINES[number] in line_styles, _COMMON_COLOUR)
        handles.append(Line2D([], [], label=model, **style))
    if band:
        handles.append(Line2D([], [], lw=5.0, alpha=_BAND_OPACITY, color="0.3", label=band))
    for style in point_styles:
        handles.append(Line2D([], [], ls="none", **style))
    if not handles:
        return
    longest = 0
    for handle in handles:
        label = str(handle.get_label())
        lines = wrap(label, max(_LETTERS_OF_SYMBOL, letters - _LETTERS_OF_SYMBOL)) or [label]
        handle.set_label("\n".join(lines))
        longest = max(longest, *map(len, lines))
    columns = max(1, min(len(handles), int(letters / (longest + _LETTERS_OF_SYMBOL))))
    title = plain_text(colours.factor.name) if colours.factor is not None else None
    figure.legend(handles=handles, loc="outside lower center", title=title, ncols=columns)


def _colour_handles(colours: Colours) -> list[Line2D]:
    """The symbols of colours in the legend."""
    from matplotlib.lines import Line2D

    handles: list[Line2D] = []
    if colours.factor is None:
        return handles
    for level, style in colours.styles.items():
        label = plain_text(colours.factor.text(level))
        handles.append(Line2D([], [], ls="none", label=label, **style))
    return handles


def _line_styles(figure: Figure) -> set[Any]:
    """The styles of all lines in a figure."""
    styles: set[Any] = set()
    for axes in figure.axes:
        styles.update(line.get_linestyle() for line in axes.lines)
    return styles
