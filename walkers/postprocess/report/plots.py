"""Interactive plots of a run (Bokeh): where walkers went and how fast, their gait; what a pile did."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.postprocess.analysis import analyses_of, tables_of
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import read_motion
from walkers.postprocess.panels import Panel, gait_panels, pile_panels, velocity_panel, walk_panels
from walkers.runner.directory import case_of

if TYPE_CHECKING:
    from bokeh.models import Model
    from bokeh.plotting import figure as Figure  # noqa: N812


COLOURS = ("#b0203c", "#1f3b73", "#3f7f93", "#c78a2c", "#5b6770", "#7a4a8c", "#4c8c4a", "#1d2429")
_MARKERS = {"o": "circle", "s": "square", "^": "triangle", "v": "inverted_triangle", "D": "diamond", "x": "x"}
"""What Bokeh calls them; others are diamonds."""
_MOST_POINTS = 600
"""Of a line; what is longer is thinned out."""


def plots_of(directory: Path) -> Model | None:
    """The plots of a run, one below the other; None where there is nothing to plot."""
    from bokeh.layouts import column

    names = {one.name for one in analyses_of(case_of(directory))}
    panels: list[Panel] = []
    if "walking" in names:
        groups = read_motion(directory).groups
        panels += [*walk_panels(groups), velocity_panel(groups), *gait_panels(groups[0])]
    if "pile" in names:
        panels += pile_panels(tables_of(directory))
    return column(*map(_plot, panels), sizing_mode="stretch_width") if panels else None


def _plot(panel: Panel) -> Figure:
    from bokeh.models.annotations import BoxAnnotation

    y = panel.y.replace("\n", " ")
    plot = new_plot(panel.title, panel.x, y, y_axis_type="log" if panel.log else "linear")
    if panel.settled:
        plot.add_layout(BoxAnnotation(left=0.0, right=panel.settled, fill_color="#888888", fill_alpha=0.12))
    if panel.band:
        low, high = panel.band
        plot.varea(low.x, low.y, high.y, color="#5b6770", alpha=0.2, legend_label=low.label.replace("\n", " "))
    for line in panel.lines:
        thin = slice(None, None, -(-len(line.x) // _MOST_POINTS) or None)
        look: dict[str, Any] = {"legend_label": line.label.replace("\n", " ")} if line.label else {}
        look["color"] = line.colour if isinstance(line.colour, str) else COLOURS[line.colour % len(COLOURS)]
        if line.width:
            dash = "dashed" if line.dashed else "solid"
            plot.line(line.x[thin], line.y[thin], line_width=line.width, line_dash=dash, **look)
        else:
            plot.scatter(line.x, line.y, marker=_MARKERS.get(line.marker, "diamond"), size=8, **look)
        if line.error is not None:
            error_bars(plot, line.x, line.y, line.error)
    return with_legend(plot)


def new_plot(title: str, x: str, y: str, *, height: int = 300, **options: Any) -> Figure:
    """An empty plot as wide as the page."""
    from bokeh.models.annotations import Title
    from bokeh.plotting import figure

    plot = figure(
        title=Title(text=title, text_font_size="14px"),
        x_axis_label=x,
        y_axis_label=y,
        height=height,
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save,hover",
        toolbar_location="right",
        **options,
    )
    plot.toolbar.logo = None
    plot.toolbar.active_scroll = None  # the wheel scrolls the page
    return plot


def with_legend(plot: Figure) -> Figure:
    """The plot with its legend beside it, by which lines can be hidden."""
    if plot.legend:
        plot.add_layout(plot.legend[0], "right")
        plot.legend.click_policy = "hide"
        plot.legend.label_text_font_size = "11px"
        plot.legend.spacing = 0
    return plot


def error_bars(plot: Figure, x: Sequence[Any] | FloatArray, y: FloatArray, error: FloatArray) -> None:
    """Whiskers of one standard error."""
    from bokeh.models import ColumnDataSource
    from bokeh.models.annotations import Whisker

    known = np.isfinite(error)
    columns: dict[str, Any] = {"x": np.asarray(x)[known], "low": (y - error)[known], "high": (y + error)[known]}
    plot.add_layout(Whisker(source=ColumnDataSource(columns), base="x", lower="low", upper="high"))
