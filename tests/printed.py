"""What would spoil a figure in print, found by drawing it: texts over each other, over ticks or data, small print."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Bbox, BboxTransformTo

COLUMNS = (3.4, 7.0)
"""Widths of a figure in one and in two columns of a journal, inches."""
LEAST_SIZE = 7.0
"""Points."""
_TOLERANCE = 0.5
"""Points by which a box may reach over others: those of matplotlib hold ascenders and descenders that a text need not
have."""
_SPACE = 2.0
"""Points between texts side by side below which they are read as one."""


class _Recorder(RendererAgg):
    """Draws, and remembers which texts were drawn: tick labels that are out of view, say, are not."""

    def __init__(self, figure: Figure) -> None:
        super().__init__(*figure.bbox.size, figure.dpi)
        self.groups: set[str | None] = set()

    def open_group(self, s: str, gid: str | None = None) -> None:
        self.groups.add(gid)


def _drawn(figure: Figure) -> tuple[_Recorder, list[Text]]:
    """The texts that are seen, and what has drawn them."""
    figure.draw_without_rendering()
    texts = figure.findobj(Text)
    for number, text in enumerate(texts):
        text.set_gid(f"text {number}")
    recorder = _Recorder(figure)
    figure.draw(recorder)
    return recorder, [text for text in texts if text.get_gid() in recorder.groups and text.get_text().strip()]


@dataclass(frozen=True)
class _Box:
    """A rectangle on the page that may be oblique; pixels."""

    what: str
    path: Path

    def meets(self, other: _Box) -> bool:
        return self.path.intersects_path(other.path, filled=True)

    @property
    def extents(self) -> Bbox:
        return self.path.get_extents()


def _box_of(text: Text, renderer: RendererAgg, shrunk: float, space: float) -> _Box:
    """The text's own rectangle: its extent on the page is that of the oblique one, about the same centre."""
    extent, angle = text.get_window_extent(renderer), text.get_rotation()
    size = extent.size
    if angle % 180.0:
        text.set_rotation(0.0)
        size = text.get_window_extent(renderer).size
        text.set_rotation(angle)
    width, height = np.maximum(size + np.array([space, -2.0 * shrunk]), 1.0)
    x, y = (extent.p0 + extent.p1) / 2.0
    turned = Affine2D().scale(width, height).rotate_deg(angle).translate(x, y)
    return _Box(text.get_text(), turned.transform_path(_UNIT))


_UNIT = Path([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)], closed=True)


def _all_axes(figure: Figure) -> Iterator[Axes]:
    for axes in figure.axes:
        yield axes
        yield from (child for child in axes.child_axes if isinstance(child, Axes))


def _shapes(axes: Axes) -> Iterator[tuple[Path, bool]]:
    """What is drawn of data, in pixels, and whether as lines (else as points); lines across all axes are none."""
    data = axes.transData
    for line in axes.lines:
        if line.get_visible() and line.get_transform() == data and len(line.get_xydata()):
            path = data.transform_path(line.get_path()).cleaned(remove_nans=True)
            yield path, line.get_linestyle() not in ("None", "", " ")
    for patch in axes.patches:
        if patch.get_visible() and patch.get_data_transform() == data:
            yield patch.get_transform().transform_path(patch.get_path()), True
    for collection in axes.collections:
        yield from _shapes_of(collection) if collection.get_visible() else ()


def _shapes_of(collection: Collection) -> Iterator[tuple[Path, bool]]:
    if isinstance(collection, PathCollection):
        offsets = np.ma.filled(np.ma.masked_invalid(collection.get_offsets()), np.nan)
        yield Path(collection.get_offset_transform().transform(offsets[np.isfinite(offsets).all(axis=1)])), False
        return
    for path in collection.get_paths():
        if len(path.vertices):
            yield collection.get_transform().transform_path(path), True


def _covers(box: _Box, axes: Axes) -> bool:
    """Whether a box lies over data of axes."""
    seen = Bbox.intersection(box.extents, axes.bbox)
    if seen is None or min(seen.size) < 1.0:
        return False
    for path, lines in _shapes(axes):
        if lines and path.intersects_bbox(seen, filled=False):
            return True
        if not lines and len(path.vertices) and path.vertices.size and seen.count_contains(path.vertices):
            return True
    return False


def _tick_marks(axes: Axes) -> Iterator[_Box]:
    for axis in (axes.xaxis, axes.yaxis) if axes.axison else ():
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if low <= tick.get_loc() <= high:
                marks = (mark for mark in (tick.tick1line, tick.tick2line) if mark.get_visible())
                yield from (_rectangle("tick", mark.get_window_extent()) for mark in marks)


def _rectangle(what: str, box: Bbox) -> _Box:
    return _Box(what, Path.unit_rectangle().transformed(BboxTransformTo(box)))


def overlaps(figure: Figure) -> list[str]:
    """Texts over texts, ticks, legends and data, legends over data, and what is cut off at the figure's edge."""
    recorder, texts = _drawn(figure)
    shrunk, space = _TOLERANCE * figure.dpi / 72.0, _SPACE * figure.dpi / 72.0
    boxes = [_box_of(text, recorder, shrunk, space) for text in texts]
    legends = [legend for legend in figure.findobj(Legend) if legend.get_visible()]
    written = {id(text) for legend in legends for text in legend.findobj(Text)}
    free = [box for text, box in zip(texts, boxes, strict=True) if id(text) not in written]
    frames = [
        _rectangle(
            "legend " + "; ".join(text.get_text() for text in legend.get_texts()),
            legend.get_window_extent(recorder).padded(-shrunk),
        )
        for legend in legends
    ]
    found = [f"{one.what!r} over {other.what!r}" for one, other in combinations(boxes, 2) if one.meets(other)]
    found += [f"{one.what!r} over {frame.what!r}" for one in free for frame in frames if one.meets(frame)]
    found += [f"{one.what!r} over {other.what!r}" for one, other in combinations(frames, 2) if one.meets(other)]
    for axes in _all_axes(figure):
        if not axes.get_visible():
            continue
        marks = list(_tick_marks(axes))
        for box in (*free, *frames):
            if _covers(box, axes):
                found.append(f"{box.what!r} over data")
            if any(box.meets(mark) for mark in marks):
                found.append(f"{box.what!r} over a tick")
    page = figure.bbox.padded(shrunk + space)
    outside = [box for box in (*boxes, *frames) if (box.extents.p0 < page.p0).any() or (box.extents.p1 > page.p1).any()]
    return found + [f"{box.what!r} is cut off" for box in outside]


def small_print(figure: Figure) -> list[str]:
    """Texts below `LEAST_SIZE`."""
    sizes = {text.get_text(): float(text.get_fontsize()) for text in _drawn(figure)[1]}
    return [f"{told!r} has {size:g} pt" for told, size in sizes.items() if size < LEAST_SIZE - 1e-9]


def letters(figure: Figure) -> list[str]:
    """The letters of a figure's panels, in the order in which they were made."""
    found = [re.match(r"\((\w+)\)", axes.get_title(loc="left")) for axes in figure.axes]
    return [match[1] for match in found if match]


def spoilt(figure: Figure) -> list[str]:
    """All of these, and a width that is none of a column's."""
    width = float(figure.get_size_inches()[0])
    wide = [] if any(abs(width - column) < 1e-9 for column in COLUMNS) else [f"{width:g} inches wide"]
    return [*overlaps(figure), *small_print(figure), *wide]
