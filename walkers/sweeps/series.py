"""The points of a sweep in one panel of its figure: symbols, error bars, bands, lines and predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.postprocess.measure.quantities import LABELS, scatter_of
from walkers.postprocess.show.drawing import errors_seen, plain_text
from walkers.sweeps.factors import Factor, number_factor
from walkers.sweeps.predictions import Theory
from walkers.sweeps.table import SEEDS

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_UP: dict[str, Any] = {"marker": "o", "color": "0.3", "label": "started facing right (up)"}
_DOWN: dict[str, Any] = {"marker": "v", "color": "0.3", "label": "started facing left (down)"}
_MARKERS = "osD^vXP<>*"
_MODEL_LINES = ("--", ":")
_MODEL_MARKERS = ("_", "+")
"""Symbols of the models where points are not joined by lines."""
_MOST_COLOURS = 10
"""Number of colours in the style of the project."""
_MOST_ASIDE = 0.12
"""Largest distance of the symbols of two colours in a category; categories have the distance 1."""
_BAND_OPACITY = 0.25


@dataclass(frozen=True)
class Series:
    """Points that are drawn alike.

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
    def of_points(cls, x: Factor, drawn: npt.NDArray[np.bool_], aside: float = 0.0) -> Series:
        """The series of the points that are ``drawn``, moved ``aside`` on the x axis."""
        values = x.values
        if not x.is_number:
            values = [x.levels.index(level) for level in x.values]
        places = np.array(values, dtype=float) + aside
        rows = np.flatnonzero(drawn)
        rows = rows[np.argsort(places[rows], kind="stable")]
        return cls(x, rows, places[rows])

    @property
    def is_line(self) -> bool:
        """Whether lines join the points: each has a place of its own along a number that was chosen."""
        x = self.x
        if not x.is_number or x.is_sample or x.keys[0] in SEEDS:
            return False
        return len(set(self.places)) == len(self.rows) > 1


def points_of(done: pd.DataFrame, column: str, down: str | None) -> tuple[str, pd.DataFrame]:
    """What is drawn of a column, in its displayed unit.

    Parameters
    ----------
    done
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

    points = pd.DataFrame({"error": np.full(len(done), np.nan)})
    sources = {
        "value": column,
        "error": scatter_of(column),
        "low": f"{column}_low",
        "high": f"{column}_high",
        "down": down,
    }
    for name, source in sources.items():
        if source and source in done and done[source].notna().any():
            points[name] = number_factor(done, source, "y").values
    factor = number_factor(done, column, "y")
    if "down" in points:  # the figure has walkers of both directions
        factor = replace(factor, name=LABELS[column]["both"])
    return factor.label, points


def level_styles(hue: Factor | None, *, hollow: bool) -> dict[Any, dict[str, Any]]:
    """Colour, symbol and its size for each level of a factor; for the level None without a factor."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    levels: list[Any] = hue.levels if hue else [None]
    # "C0" would be looked up when the figure is drawn, in the style of whoever draws it then.
    colours: list[Any] = [to_hex(f"C{number}") for number in range(len(levels))]
    if len(levels) > _MOST_COLOURS:
        colours = list(colormaps["turbo"](np.linspace(0.0, 0.92, len(levels))))
    looks = {}
    for number, level in enumerate(levels):
        # Symbols that are drawn later are smaller, so that those of coinciding points are seen.
        later = len(levels) - 1 - number
        looks[level] = {
            "marker": _MARKERS[number % len(_MARKERS)],
            "color": colours[number],
            "mfc": "none" if hollow else colours[number],
            "ms": 4.5 + min(1.0, 4.0 / len(levels)) * later,
        }
    return looks


def category_offset(number: int, count: int) -> float:
    """Where the symbols of one of several colours are beside their category."""
    distance = min(_MOST_ASIDE, 0.6 / count)
    return (number - (count - 1) / 2.0) * distance


def draw_series(
    axes: Axes, series: Series, points: pd.DataFrame, look: Mapping[str, Any], *, joined: bool
) -> None:
    """Draw points with error bars, bands, and the points of walkers that face down.

    Parameters
    ----------
    axes
        Where.
    series
        The points to draw.
    points
        All points, as from `points_of`.
    look
        Colour and symbol.
    joined
        Whether lines join the points if they are a line.
    """
    shown = points.iloc[series.rows]
    bars = shown["error"] if errors_seen(points["error"], points["value"]) else None
    line = "-" if series.is_line and joined else "none"
    axes.errorbar(
        series.places, shown["value"].to_numpy(), yerr=bars, capsize=2, lw=0.9, ls=line, **look
    )
    if "low" in shown:
        _draw_band(axes, series, shown, look["color"])
    if "down" in shown:
        line = "--" if series.is_line else "none"
        look_down = {**look, "marker": _DOWN["marker"], "mfc": "none"}
        axes.plot(series.places, shown["down"], lw=0.9, ls=line, **look_down)


def _draw_band(axes: Axes, series: Series, shown: pd.DataFrame, colour: Any) -> None:
    """The band of a line, or a thick bar at each point."""
    low = shown["low"].to_numpy()
    high = shown["high"].to_numpy()
    if series.is_line:
        axes.fill_between(
            series.places, low, high, color=colour, alpha=_BAND_OPACITY, zorder=0.5, lw=0.0
        )
    else:
        axes.vlines(series.places, low, high, color=colour, alpha=_BAND_OPACITY, zorder=0.5, lw=4.0)


def draw_theory(axes: Axes, series: Series, theory: Theory, colour: Any) -> None:
    """Draw the predictions of all models for a series."""
    x = series.x if series.is_line else None
    along, models = theory.curves(series.rows, series.places, x)
    for number, values in enumerate(models.values()):
        axes.plot(along, values, zorder=1, **_look_of_model(number, series.is_line, colour))


def _look_of_model(number: int, is_line: bool, colour: Any) -> dict[str, Any]:
    if is_line:
        return {"color": colour, "lw": 0.9, "ls": _MODEL_LINES[number]}
    return {"color": colour, "lw": 0.9, "ls": "none", "marker": _MODEL_MARKERS[number], "ms": 9}


def draw_legend(
    figure: Figure,
    hue: Factor | None,
    looks: Mapping[Any, Mapping[str, Any]],
    models: Sequence[str] = (),
    *,
    down: bool,
    band: str,
) -> None:
    """Draw a legend of colours, models and bands below all panels; none if there is nothing to explain.

    Parameters
    ----------
    figure
        The figure, whose panels are drawn.
    hue, looks
        The factor of the colours, and colours and symbols of its levels.
    models
        Names of the models.
    down
        Whether walkers that face down are a series beside those that face up.
    band
        What the bands are; empty: there are none.
    """
    from matplotlib.lines import Line2D

    handles: list[Line2D] = []
    if hue is not None:
        for level, look in looks.items():
            handles.append(Line2D([], [], ls="none", label=plain_text(hue.text(level)), **look))
    if down:
        handles.append(Line2D([], [], ls="none", **_UP))
        handles.append(Line2D([], [], ls="none", mfc="none", **_DOWN))
    drawn = {line.get_linestyle() for axes in figure.axes for line in axes.lines}
    for number, model in enumerate(models):
        look = _look_of_model(number, _MODEL_LINES[number] in drawn, "0.3")
        handles.append(Line2D([], [], label=model, **look))
    if band:
        handles.append(Line2D([], [], lw=5.0, alpha=_BAND_OPACITY, color="0.3", label=band))
    if not handles:
        return
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = int(13.0 * figure.get_figwidth() / (longest + 6))
    columns = max(1, min(len(handles), columns))
    title = plain_text(hue.name) if hue is not None else None
    figure.legend(handles=handles, loc="outside lower center", title=title, ncols=columns)
