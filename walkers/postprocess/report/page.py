"""Self-contained HTML file with packed libraries, plots and players: no network, no other file.

A page is a list of sections, which JavaScript shows one at a time; without it all tables can be read.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.errors import refused
from walkers.postprocess.drawing import check_place
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.figures import Panel
from walkers.runner.files import write_text
from walkers.runner.provenance import PROJECT, software
from walkers.text import environment

if TYPE_CHECKING:
    from bokeh.models import Model
    from bokeh.plotting import figure as Figure  # noqa: N812

_PACKAGE = "walkers.postprocess.report"
NAME = "report.html"
LARGEST = 5_000_000
"""Largest size of a report in bytes, small enough for mail."""
COLOURS = ("#b0203c", "#1f3b73", "#3f7f93", "#c78a2c", "#5b6770", "#7a4a8c", "#4c8c4a", "#1d2429")
_MARKERS = {"o": "circle", "s": "square", "^": "triangle", "v": "inverted_triangle", "D": "diamond", "x": "x"}
"""Names of markers in Bokeh; others are diamonds."""
_TITLE, _LETTER = 52, 11
"""Letters of a line of a title on a narrow page; height of a plot in pixels per letter of its y label."""
_MOST_POINTS, _MOST_OF_ALL = 600, 20_000
"""Largest numbers of points of a line and of all lines of a plot; longer lines are thinned out."""


def check_report(path: Path) -> None:
    """Raise `InputError` unless a path is an .html file in an existing folder."""
    check_place(path, ".html", ".htm")
    if not path.absolute().parent.is_dir():
        raise refused(path.absolute().parent, "there is no such folder")


def write_page(path: Path, title: str, body: str, carried: Mapping[str, str]) -> Path:
    """Write a page from a plain title, a body of HTML, and packed data by id."""
    libraries = {f"library-{name}": _library(name) for name in ("bokeh", "k3d")} if carried else {}
    page = fill(
        "page.html.j2",
        title=title,
        body=body,
        style=_text(_PACKAGE, "report.css"),
        carried={**libraries, **carried},
        scripts=_scripts() if carried else [],
        written_by=f"{PROJECT} {software()['granular_walkers']}",
    )
    write_text(path, page)
    return path


def overhead() -> int:
    """Size of the libraries and scripts of a page, bytes."""
    texts = [_library("bokeh"), _library("k3d"), *_scripts(), _text(_PACKAGE, "report.css")]
    return sum(map(len, texts)) + 2000


def fill(template: str, package: str = _PACKAGE, **values: Any) -> str:
    """The HTML of a template; values are escaped."""
    return environment(package, _PACKAGE, html=True).get_template(template).render(**values)


def packed_plots(plots: Model) -> str:
    """Packed Bokeh plots for a page."""
    from bokeh.embed import json_item

    return _packed(json.dumps(json_item(plots)))


def drawn(panel: Panel) -> Figure:
    """A panel as an interactive plot (Bokeh)."""
    from bokeh.models.annotations import BoxAnnotation

    options: dict[str, Any] = {"y_range": panel.limits} if panel.limits else {}
    scale = "log" if panel.log else "linear"
    plot = new_plot(panel.title, panel.x, panel.y, height=round(300 * panel.height**0.5), y_axis_type=scale, **options)
    if panel.zero and (ends := [(line.x[0], line.x[-1]) for line in panel.lines if len(line.x)]):
        plot.line([min(ends)[0], max(end for _, end in ends)], [0.0, 0.0], color="#666666", line_width=0.6)
    if panel.settled:
        plot.add_layout(BoxAnnotation(left=0.0, right=panel.settled, fill_color="#888888", fill_alpha=0.12))
    if panel.band:
        low, high = panel.band
        plot.varea(low.x, low.y, high.y, color="#5b6770", alpha=0.2, legend_label=low.label.replace("\n", " "))
    for line in panel.lines:
        look: dict[str, Any] = {"legend_label": line.label.replace("\n", " ")} if line.label else {}
        look["color"] = line.colour if isinstance(line.colour, str) else COLOURS[line.colour % len(COLOURS)]
        if line.width:
            most = min(_MOST_POINTS, max(2, _MOST_OF_ALL // len(panel.lines)))
            thin = slice(None, None, -(-len(line.x) // most) or None)
            dash = "dashed" if line.dashed else "solid"
            plot.line(line.x[thin], line.y[thin], line_width=line.width, line_dash=dash, **look)
        else:
            plot.scatter(line.x, line.y, marker=_MARKERS.get(line.marker, "diamond"), size=8, **look)
    return with_legend(plot)


def new_plot(title: str, x: str, y: str, *, height: int = 300, **options: Any) -> Figure:
    """An empty plot as wide as the page."""
    from bokeh.models.annotations import Title
    from bokeh.plotting import figure

    plot = figure(
        title=Title(text=_in_lines(title, _TITLE), text_font_size="14px"),
        x_axis_label=_in_lines(x, _TITLE),
        y_axis_label=_in_lines(y, round(height / _LETTER)),
        height=height,
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save,hover",
        active_scroll=None,  # the wheel scrolls the page
        **options,
    )
    plot.toolbar.logo = None
    return plot


def _in_lines(text: str, letters: int) -> str:
    """A text with line breaks: Bokeh cuts what is too long."""
    return "\n".join(wrap(text, letters))


def with_legend(plot: Figure) -> Figure:
    """The plot with a legend on the right; a click hides a line."""
    if plot.legend:
        plot.add_layout(plot.legend[0], "right")
        plot.legend.click_policy = "hide"
        plot.legend.label_text_font_size = "11px"
        plot.legend.spacing = 0
    return plot


def error_bars(plot: Figure, x: Sequence[Any] | FloatArray, y: FloatArray, error: FloatArray) -> None:
    """Draw error bars."""
    from bokeh.models import ColumnDataSource
    from bokeh.models.annotations import Whisker

    known = np.isfinite(error)
    columns: dict[str, Any] = {"x": np.asarray(x)[known], "low": (y - error)[known], "high": (y + error)[known]}
    plot.add_layout(Whisker(source=ColumnDataSource(columns), base="x", lower="low", upper="high"))


def _packed(text: str) -> str:
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


@cache
def _library(name: str) -> str:
    if name == "k3d":
        # It contains its font as woff2; browsers would look for the other formats beside the page.
        source = _text("k3d", "static/standalone.js")
        return _packed(re.sub(r',url\(fonts/[^)]*\) format\("(?:woff|truetype)"\)', "", source))
    from bokeh.resources import Resources

    return _packed("\n".join(Resources(mode="inline", components=["bokeh"], log_level="error").js_raw))


def _scripts() -> list[str]:
    return [_text("k3d", "static/fflate.js"), _text(_PACKAGE, "player.js")]


@cache
def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text("utf-8")
