"""What would spoil a figure in print, found by drawing it: texts over each other, over ticks or data, small print."""

from __future__ import annotations

import re
from itertools import combinations

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox

COLUMNS = (3.4, 7.0)
"""Widths of a figure in one and in two columns of a journal, inches."""
LEAST_SIZE = 7.0
"""Points."""
_TOLERANCE = 0.5
"""Points by which a box may reach over others: those of matplotlib hold ascenders and descenders that a text need not
have."""


class _Recorder(RendererAgg):
    """Draws, and remembers which texts were drawn: tick labels that are out of view, say, are not."""

    def __init__(self, figure: Figure) -> None:
        super().__init__(*figure.bbox.size, figure.dpi)
        self.groups: set[str | None] = set()

    def open_group(self, s: str, gid: str | None = None) -> None:
        self.groups.add(gid)


def _drawn(figure: Figure) -> list[Text]:
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # it is laid out once, as for a file
    texts = figure.findobj(Text)
    for number, text in enumerate(texts):
        text.set_gid(f"text {number}")
    figure.draw(recorder := _Recorder(figure))
    return [text for text in texts if text.get_gid() in recorder.groups and text.get_text().strip()]


def _marked(axes: Axes) -> list[Bbox]:
    found = []
    for axis in (axes.xaxis, axes.yaxis) if axes.axison else ():
        low, high = sorted(axis.get_view_interval())
        ticks = (tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high)
        found += [
            mark.get_window_extent() for tick in ticks for mark in (tick.tick1line, tick.tick2line)
        ]
    return found


def _over_data(box: Bbox, axes: Axes) -> bool:
    """Whether a box lies over lines or points of axes."""
    seen = Bbox.intersection(box, axes.bbox)
    if seen is None or min(seen.size) < 1.0:
        return False
    lines = [
        line
        for line in axes.lines
        if line.get_transform() == axes.transData and len(line.get_xydata())
    ]
    paths = [
        (axes.transData.transform_path(line.get_path()).cleaned(remove_nans=True), line)
        for line in lines
    ]
    return any(
        seen.count_contains(path.vertices)
        if line.get_linestyle() in ("None", "", " ")
        else path.intersects_bbox(seen, filled=False)
        for path, line in paths
    )


def spoilt(figure: Figure) -> list[str]:
    """Texts over texts, ticks, legends and data, legends over data, what is cut off, small print, odd widths.

    Oblique texts are only looked at for their size.
    """
    texts, shrunk = _drawn(figure), _TOLERANCE * figure.dpi / 72.0
    upright = [text for text in texts if not text.get_rotation() % 90.0]
    legends = [one for one in figure.findobj(Legend) if one.get_visible()]
    written = {id(text) for legend in legends for text in legend.findobj(Text)}
    boxes = [
        (text.get_text(), text.get_window_extent().padded(-shrunk), id(text) in written)
        for text in upright
    ]
    frames = [("legend", legend.get_window_extent().padded(-shrunk), False) for legend in legends]
    free = [*(one for one in boxes if not one[2]), *frames]
    pairs = [*combinations(boxes, 2), *combinations(free, 2)]
    found = [
        f"{one!r} over {other!r}"
        for (one, box, _), (other, place, _) in pairs
        if box.overlaps(place)
    ]
    for axes in (one for one in figure.axes if one.get_visible()):
        marks = _marked(axes)
        for name, box, _ in free:
            found += [f"{name!r} over data"] if _over_data(box, axes) else []
            found += [f"{name!r} over a tick"] if any(box.overlaps(mark) for mark in marks) else []
    for name, box, _ in (*boxes, *frames):
        found += (
            [f"{name!r} is cut off"]
            if (box.p0 < figure.bbox.p0).any() or (box.p1 > figure.bbox.p1).any()
            else []
        )
    sizes = {text.get_text(): float(text.get_fontsize()) for text in texts}
    found += [
        f"{told!r} has {size:g} pt" for told, size in sizes.items() if size < LEAST_SIZE - 1e-9
    ]
    width = float(figure.get_size_inches()[0])
    return (
        found
        if any(abs(width - column) < 1e-9 for column in COLUMNS)
        else [*found, f"{width:g} inches wide"]
    )


def letters(figure: Figure) -> list[str]:
    """The letters of a figure's panels, in the order in which they were made."""
    found = [re.match(r"\((\w+)\)", axes.get_title(loc="left")) for axes in figure.axes]
    return [match[1] for match in found if match]
