"""What would spoil a figure in print, found by drawing it.

Texts over each other, over ticks or over data; what is cut off; small print; odd widths.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.transforms import Bbox

COLUMNS = (3.4, 7.0)
"""Widths of a figure in one and in two columns of a journal, inches."""
LEAST_SIZE = 7.0
"""Smallest size of a text, points."""
_TOLERANCE = 0.5
"""Length by which a box may extend over others, points.

Boxes of matplotlib have room for ascenders and descenders that a text need not have.
"""


class _Recorder(RendererAgg):
    """Draws, and remembers which texts were drawn: tick labels that are out of view are not."""

    def __init__(self, figure: Figure) -> None:
        super().__init__(*figure.bbox.size, figure.dpi)
        self.groups: set[str | None] = set()

    def open_group(self, s: str, gid: str | None = None) -> None:
        self.groups.add(gid)


@dataclass(frozen=True)
class _Box:
    """The place of a text or of a legend in a figure, pixels."""

    name: str
    place: Bbox


def _drawn_texts(figure: Figure) -> list[Text]:
    """Texts of a figure that are drawn and not blank."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # it is laid out once, as for a file
    texts = figure.findobj(Text)
    for number, text in enumerate(texts):
        text.set_gid(f"text {number}")
    recorder = _Recorder(figure)
    figure.draw(recorder)
    drawn = []
    for text in texts:
        if text.get_gid() in recorder.groups and text.get_text().strip():
            drawn.append(text)
    return drawn


def _ticks(axes: Axes) -> list[Bbox]:
    """Places of the major ticks of axes that are in view."""
    ticks = []
    if axes.axison:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                if low <= tick.get_loc() <= high:
                    ticks.append(tick.tick1line.get_window_extent())
                    ticks.append(tick.tick2line.get_window_extent())
    return ticks


def _covers(place: Bbox, line: Line2D, axes: Axes) -> bool:
    """Whether a place lies over a line, or over a point of a line that has markers alone."""
    path = axes.transData.transform_path(line.get_path()).cleaned(remove_nans=True)
    if line.get_linestyle() in ("None", "", " "):
        return bool(place.count_contains(path.vertices))
    return bool(path.intersects_bbox(place, filled=False))


def _over_data(place: Bbox, axes: Axes) -> bool:
    """Whether a place lies over lines or points of axes."""
    in_axes = Bbox.intersection(place, axes.bbox)
    if in_axes is None or min(in_axes.size) < 1.0:
        return False
    for line in axes.lines:
        is_data = line.get_transform() == axes.transData and len(line.get_xydata())
        if is_data and _covers(in_axes, line, axes):
            return True
    return False


def _overlaps(boxes: list[_Box]) -> Iterator[str]:
    """Pairs of boxes that lie over each other."""
    for first, second in combinations(boxes, 2):
        if first.place.overlaps(second.place):
            yield f"{first.name!r} over {second.name!r}"


def _over_contents(boxes: list[_Box], figure: Figure) -> Iterator[str]:
    """Boxes that lie over data or over ticks."""
    for axes in figure.axes:
        if not axes.get_visible():
            continue
        ticks = _ticks(axes)
        for box in boxes:
            if _over_data(box.place, axes):
                yield f"{box.name!r} over data"
            if any(map(box.place.overlaps, ticks)):
                yield f"{box.name!r} over a tick"


def _cut_off(boxes: list[_Box], figure: Figure) -> Iterator[str]:
    """Boxes that extend over the edge of the figure."""
    for box in boxes:
        below = (box.place.p0 < figure.bbox.p0).any()
        above = (box.place.p1 > figure.bbox.p1).any()
        if below or above:
            yield f"{box.name!r} is cut off"


def _odd_sizes(texts: list[Text], figure: Figure) -> Iterator[str]:
    """Texts that are too small, and a width of the figure that no journal has."""
    for text in texts:
        size = float(text.get_fontsize())
        if size < LEAST_SIZE - 1e-9:
            yield f"{text.get_text()!r} has {size:g} pt"
    width = float(figure.get_size_inches()[0])
    if not any(abs(width - column) < 1e-9 for column in COLUMNS):
        yield f"{width:g} inches wide"


def spoilt(figure: Figure) -> list[str]:
    """What would spoil a figure in print, a line for each fault.

    Only the size of oblique texts is checked. Legends may lie over their own texts.
    """
    texts = _drawn_texts(figure)
    shrinkage = _TOLERANCE * figure.dpi / 72.0
    legends = []
    texts_of_legends: set[int] = set()
    for legend in figure.findobj(Legend):
        if legend.get_visible():
            legends.append(_Box("legend", legend.get_window_extent().padded(-shrinkage)))
            texts_of_legends |= {id(text) for text in legend.findobj(Text)}
    in_legends = []
    free = []
    for text in texts:
        if text.get_rotation() % 90.0:
            continue
        box = _Box(text.get_text(), text.get_window_extent().padded(-shrinkage))
        if id(text) in texts_of_legends:
            in_legends.append(box)
        else:
            free.append(box)
    upright = free + in_legends
    faults = [*_overlaps(upright), *_overlaps(free + legends)]
    faults += _over_contents(free + legends, figure)
    faults += _cut_off(upright + legends, figure)
    faults += _odd_sizes(texts, figure)
    return faults


def letters(figure: Figure) -> list[str]:
    """The letters of a figure's panels, in the order in which they were made."""
    panels = []
    for axes in figure.axes:
        letter = re.match(r"\((\w+)\)", axes.get_title(loc="left"))
        if letter:
            panels.append(letter[1])
    return panels
