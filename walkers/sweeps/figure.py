"""The figure of a sweep: one column of its table against what was varied, in colours and panels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from textwrap import wrap
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.errors import expected_of, input_error
from walkers.inputs.resolving.library import unmeasured
from walkers.postprocess.measure.caption import common_conditions
from walkers.postprocess.measure.numbers import draws_text
from walkers.postprocess.show.drawing import (
    errors_seen,
    letter_panels,
    new_figure,
    plain_text,
    styled,
)
from walkers.runs.status import status_text
from walkers.sweeps.correlations import rank_correlations
from walkers.sweeps.factors import Factor, number_factor
from walkers.sweeps.figure_format import FigureFormat
from walkers.sweeps.figure_options import FigureOptions, Log
from walkers.sweeps.layout import FigureLayout, figure_layout
from walkers.sweeps.left_out import warn_left_out
from walkers.sweeps.own_points import OwnPoints, PointsFile, read_points
from walkers.sweeps.predictions import Predict, Theory
from walkers.sweeps.scales import scale_x, scale_y
from walkers.sweeps.series import (
    LEGEND_LETTERS_PER_INCH,
    Colours,
    Series,
    category_offset,
    draw_legend,
    draw_own_points,
    draw_series,
    draw_theory,
    own_styles,
    points_cover,
    points_of,
)
from walkers.sweeps.table import FACING_DOWN, SweepTable, default_column, find_name

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BARS = "bars: standard deviation of the copies"
"""What the error bars are if uncertain parameters are varied."""
SCATTER = f"{_BARS} (uncertain parameters not varied)"
"""What the error bars are if no uncertain parameter is varied."""
_BAND = "band: uncertain values only"
"""What the bands of a sweep are, in the legend."""
_NOT_IN_BAND = "the error of the model is not in it"
"""What the title says of the bands."""
_LETTERS_OF_LABEL = 26
"""Letters of a line of a y label."""
_LETTERS_PER_INCH = 14.0
"""Letters of a line of the title, per inch of the figure."""
_ONE_PANEL = 4.2
"""Height of a figure of one panel, inches."""
_MOST_COLUMNS = 3
"""Largest number of panels side by side."""


def figure_of(
    table: SweepTable, options: FigureOptions = FigureOptions(), predict: Predict | None = None
) -> Figure:
    """The figure of the table of a sweep, with the predictions of a theory if there is one.

    Bars are the scatter over replicates where the table has it. Without y, on slopes where the
    walkers that face up and down differ, both are drawn. The axis of a key has the unit of the
    sweep file; other columns are in mm, mm/s, g (9.8 m/s²) and degrees. A
    `walkers.sweeps.left_out.LeftOutWarning` says what is left out.

    Parameters
    ----------
    table
        The table of the sweep.
    options
        What is drawn, and where (`walkers.sweeps.layout.figure_layout`).
    predict
        The predictions of models; None: no theory is drawn.

    Raises
    ------
    InputError
        If no point is finished, there is no such column, keys would be hidden, or ``log`` is not
        possible.
    """
    if options.log and options.log not in get_args(Log):
        raise input_error("log", f"{options.log!r}: {expected_of(options.log, get_args(Log))}")
    figure_format = FigureFormat.of_options(options)
    point_files = [read_points(argument) for argument in options.data_files]
    frame = table.frame
    column = column_of(frame, options.y)
    finished = table.finished
    _tell_left_out(frame, finished, column)
    layout = figure_layout(frame, finished, options)
    if layout.hidden:
        warn_left_out(f"not distinguished: {'; '.join(factor.name for factor in layout.hidden)}")
    log = options.log or ""
    if "x" in log and not all(factor.is_number for factor in layout.x_factors):
        raise input_error("log", f"{layout.x_factors[0].label} has no numbers")
    theory = Theory.at_points(table, column, log, predict) if predict else None
    down = None if options.y else FACING_DOWN.get(column)
    content = _Content(
        finished=finished,
        column=column,
        down=down,
        layout=layout,
        theory=theory,
        point_files=point_files,
        format=figure_format,
        conditions=common_conditions(list(table.readable_cases.values())),
    )
    return _draw(content, log)


def _tell_left_out(frame: pd.DataFrame, finished: pd.DataFrame, column: str) -> None:
    """Warn about points that are not drawn; `InputError` if none is finished."""
    counts = Counter(frame["status"][frame["status"] != "finished"])
    unfinished = status_text(counts)
    if finished.empty:
        raise input_error(
            str(frame.attrs["sweep"]), f"no point is finished ({unfinished or 'there is none'})"
        )
    if counts:
        warn_left_out(f"{counts.total()} of {len(frame)} points left out: {unfinished}")
    empty = int(finished[column].isna().sum())
    if empty:
        warn_left_out(f"{empty} of {len(finished)} finished points have no {column}")


def column_of(table: pd.DataFrame, name: str | None) -> str:
    """The column of a name, by default the main result; `InputError` if there is none."""
    return find_name("y", name, table.columns) if name else default_column(table)


@dataclass(frozen=True)
class _Content:
    """What a figure shows.

    Attributes
    ----------
    finished
        Rows of the finished points.
    column
        The column on the y axis.
    down
        The column of walkers that face down, if they are drawn beside those that face up.
    layout
        Which factors are on the x axis, in colours and in panels.
    theory
        The predictions of models, if they are drawn.
    point_files
        The files of the user's own points.
    format
        Width, size of texts and title.
    conditions
        What all points have in common, in words.
    """

    finished: pd.DataFrame
    column: str
    down: str | None
    layout: FigureLayout
    theory: Theory | None
    point_files: Sequence[PointsFile]
    format: FigureFormat
    conditions: str = ""


@dataclass(frozen=True)
class _Panel:
    """A panel.

    Attributes
    ----------
    x
        The factor on its x axis.
    drawn
        Which of the finished points it shows, shape (N,).
    title
        Its title.
    own_points
        The user's own points of each file; None of a file without a column of the x axis.
    """

    x: Factor
    drawn: npt.NDArray[np.bool_]
    title: str = ""
    own_points: Sequence[OwnPoints | None] = ()

    @property
    def own_places(self) -> list[float]:
        """Places of the user's own points on the x axis."""
        places: list[float] = []
        for points in self.own_points:
            if points is not None:
                places += points.x.tolist()
        return places


@styled
def _draw(content: _Content, log: str) -> Figure:
    """Draw a figure, with logarithmic axes for the letters in ``log``."""
    with content.format.in_style():
        figure = _drawn(content, log)
        content.format.finish(figure)
        return figure


def _drawn(content: _Content, log: str) -> Figure:
    """Draw a figure whose texts have the sizes of the current style."""
    finished = content.finished
    column = content.column
    theory = content.theory
    label, points = points_of(finished, column, content.down)
    panels, remark = _panels_of(content)
    panels = _with_own_points(panels, content)
    colours = _colours_of(content, points["value"].to_numpy(dtype=float))
    styles = own_styles([file.label for file in content.point_files], colours)
    figure, grid = _empty_grid(
        len(panels), content.format, share_x=len(content.layout.x_factors) == 1
    )
    for axes, panel in zip(grid.flat, panels, strict=False):
        _draw_panel(axes, panel, colours, points, theory)
        for own_points, style in zip(panel.own_points, styles, strict=True):
            if own_points is not None:
                draw_own_points(axes, own_points, style)
        scale_x(axes, panel.x, log, panel.own_places)
    _label_panels(grid, panels, label)
    models = theory.values if theory else {}
    scale_y(grid[0, 0], points, list(models.values()), log, _own_ends(panels))
    band = ""
    if "low" in points:
        band = f"{_BAND}, 5 to 95 % of {_number_of_draws_text(finished, column)}"
    draw_legend(
        figure,
        colours,
        list(models),
        styles,
        down="down" in points,
        band=band,
        letters=content.format.letters(LEGEND_LETTERS_PER_INCH),
    )
    title = [
        finished.attrs["title"],
        content.conditions,
        remark,
        *_remarks(finished, points, band),
    ]
    if content.format.title is not None:
        title = [content.format.title]
    _draw_title(figure, title, content.format.letters(_LETTERS_PER_INCH))
    return figure


def _colours_of(content: _Content, values: FloatArray) -> Colours:
    """Colours and symbols of the points; filled symbols that cover each other have many sizes."""
    hue = content.layout.hue
    if content.theory is not None:
        return Colours.of_factor(hue, hollow=True)
    colours = Colours.of_factor(hue, hollow=False)
    for x in content.layout.x_factors:
        if x.is_number and points_cover(x, values, colours):
            return Colours.of_factor(hue, hollow=False, nested=True)
    return colours


def _with_own_points(panels: Sequence[_Panel], content: _Content) -> list[_Panel]:
    """The panels with the user's own points; `InputError` for a file that belongs to none."""
    if not content.point_files:
        return list(panels)
    y = number_factor(content.finished, content.column, "y")
    for file in content.point_files:
        file.check_columns(content.layout.x_factors, y)
    if content.layout.panels is not None:
        warn_left_out(f"the points of --data are drawn in each of the {len(panels)} panels")
    drawn = []
    for panel in panels:
        own_points = [file.points_of(panel.x, y) for file in content.point_files]
        drawn.append(replace(panel, own_points=own_points))
    return drawn


def _own_ends(panels: Sequence[_Panel]) -> FloatArray:
    """Both ends of the error bars of all of the user's own points, shape (N,)."""
    ends = [np.array([])]
    for panel in panels:
        for points in panel.own_points:
            if points is not None:
                error = np.zeros(len(points.y))
                if points.y_error is not None:
                    error = np.nan_to_num(points.y_error)
                ends += [points.y - error, points.y + error]
    return np.concatenate(ends)


def _panels_of(content: _Content) -> tuple[list[_Panel], str]:
    """The panels of a figure, and a remark for the title, which may be empty."""
    layout = content.layout
    if layout.panels is not None:
        panels = []
        for level in layout.panels.levels:
            title = layout.panels.text_with_name(level)
            panels.append(_Panel(layout.x_factors[0], layout.panels.has_level(level), title))
        return panels, ""
    panels = [_Panel(x, _with_usual_others(x, layout.x_factors)) for x in layout.x_factors]
    sampled = content.finished.attrs.get("sampled", {})
    if len(panels) > 1 and all(panel.x.keys[0] in sampled for panel in panels):
        return _ranked(panels, content.finished, content.column)
    return panels, ""


def _ranked(panels: list[_Panel], finished: pd.DataFrame, column: str) -> tuple[list[_Panel], str]:
    """Panels of the keys of a sample, the strongest dependence first, with rank correlations.

    If the draws are too few for these, the panels keep their order, and a remark says so.
    """
    ranks = rank_correlations(finished, column, list(finished.attrs["sampled"]))
    if ranks is None:
        return panels, f"{len(finished)} draws: too few for rank correlations"
    # Keys on which the column does not depend significantly have no rank correlation.
    titled = []
    for panel in panels:
        key = panel.x.keys[0]  # the only one: each sampled key has a panel
        title = f"rank correlation {ranks[key]:+.2f}" if key in ranks else "no clear dependence"
        titled.append(replace(panel, title=title))
    titled.sort(key=lambda panel: -abs(ranks.get(panel.x.keys[0], 0.0)))
    return titled, ""


def _with_usual_others(x: Factor, x_factors: Sequence[Factor]) -> npt.NDArray[np.bool_]:
    """Which points the panel of a factor shows, shape (N,).

    If factors vary one at a time, these are the points with the usual values of the other factors;
    otherwise all. The usual value of a factor is its most frequent one.

    Parameters
    ----------
    x
        The factor on the x axis of the panel.
    x_factors
        The factors on the x axes of all panels.
    """
    is_changed = {}
    for factor in x_factors:
        usual, _ = Counter(factor.values).most_common(1)[0]
        is_changed[factor.keys] = ~factor.has_level(usual)
    changes = np.sum(list(is_changed.values()), axis=0)
    if (changes > 1).any():
        return np.full(len(changes), fill_value=True)
    return np.array(is_changed[x.keys] | (changes == 0))


def _empty_grid(
    number: int, figure_format: FigureFormat, *, share_x: bool
) -> tuple[Figure, npt.NDArray[Any]]:
    """A figure with axes for a number of panels, which share the y axis; further axes are off."""
    columns = min(number, figure_format.most_columns(_MOST_COLUMNS))
    if number == 4 and columns > 2:  # two rows of two, rather than of three and one
        columns = 2
    rows = ceil(number / columns)
    height = _ONE_PANEL
    if number > 1:  # square panels, and room for title and legend
        height = 6.0 / columns * rows + 0.9
    figure = new_figure(figure_format.width, height)
    grid = figure.subplots(rows, columns, sharex=share_x, sharey=True, squeeze=False)
    for axes in grid.flat[number:]:
        axes.set_axis_off()
    return figure, grid


def _draw_panel(
    axes: Axes, panel: _Panel, colours: Colours, points: pd.DataFrame, theory: Theory | None
) -> None:
    """Draw the points of a panel, those of each colour with the predictions for them."""
    all_series = []
    for number, (level, style) in enumerate(colours.styles.items()):
        offset = 0.0
        if not panel.x.is_number:
            offset = category_offset(number, len(colours.styles))
        series = Series.of_points(panel.x, colours.points_of_level(level, panel.drawn), offset)
        draw_series(axes, series, points, style, joined=theory is None)
        all_series.append(series)
    if theory is not None:
        draw_theory(axes, all_series, theory, [style["color"] for style in colours.styles.values()])
    values = points.drop(columns="error")
    if np.nanmin(values) <= 0.0 <= np.nanmax(values):
        axes.axhline(0.0, color="0.4", lw=0.6, zorder=0)


def _label_panels(grid: npt.NDArray[Any], panels: Sequence[_Panel], label: str) -> None:
    """Write titles, letters and labels of panels.

    The leftmost panels have the label of y, the lowest ones that of x; if the panels have different
    factors on the x axis, as those of a sample, each has its own.
    """
    columns = grid.shape[1]
    drawn = list(grid.flat)[: len(panels)]
    have_own_x = len({panel.x.keys for panel in panels}) > 1
    for number, (axes, panel) in enumerate(zip(drawn, panels, strict=True)):
        axes.set_title(plain_text(panel.title))
        is_lowest = number + columns >= len(panels)
        if have_own_x or is_lowest:
            axes.set_xlabel(plain_text(panel.x.label))
            axes.tick_params(labelbottom=True)
        if number % columns == 0:
            axes.set_ylabel(plain_text("\n".join(wrap(label, _LETTERS_OF_LABEL))))
    if len(panels) > 1:
        letter_panels(drawn)


def _number_of_draws_text(finished: pd.DataFrame, column: str) -> str:
    """How many draws the bands of a column rest on, such as ``30 to 32 draws`` (`draws_text`).

    A draw is a run of a point with its uncertain values drawn from their ranges. The numbers differ
    between points if draws failed or walkers came apart. Bands of few draws are approximate. At
    least one point must have draws.
    """
    numbers = finished[f"{column}_draws"].dropna()
    draws = f"{numbers.min():.0f}"
    if numbers.max() > numbers.min():
        draws += f" to {numbers.max():.0f}"
    is_approximate = bool(finished[f"{column}_approximate"].eq(True).any())
    return draws_text(draws, approximate=is_approximate)


def _remarks(finished: pd.DataFrame, points: pd.DataFrame, band: str) -> list[str]:
    """What the bands and the error bars of a figure are, for its title."""
    remarks = []
    if band:
        remarks.append(f"{band}; {_NOT_IN_BAND}")
    if errors_seen(points["error"], points["value"]):
        are_varied = bool(band) or not set(unmeasured()).isdisjoint(finished.attrs["varied"])
        remarks.append(_BARS if are_varied else SCATTER)
    return remarks


def _draw_title(figure: Figure, texts: Sequence[str], letters: int) -> None:
    """Texts above all panels, each on lines of its own of so many letters."""
    lines = []
    for text in texts:
        lines += wrap(text, letters)
    if not lines:
        return
    figure.suptitle(plain_text("\n".join(lines)))
