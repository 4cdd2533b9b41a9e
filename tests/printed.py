"""What would spoil a figure in print, found by drawing it: texts over each other, over ticks or data, small print."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import PathCollection
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
_UNIT = Path([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5)], closed=True)


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


class _Box(NamedTuple):
    """A rectangle on the page that may be oblique; pixels."""

    what: str
    path: Path

    def meets(self, other: _Box) -> bool:
        return self.path.intersects_path(other.path, filled=True)


def _upright(what: str, box: Bbox) -> _Box:
    return _Box(what, Path.unit_rectangle().transformed(BboxTransformTo(box)))


def _box_of(text: Text, renderer: RendererAgg, shrunk: float, space: float) -> _Box:
    """The text's own rectangle: its extent on the page is that of the oblique one, about the same centre."""
    extent, angle = text.get_window_extent(renderer), text.get_rotation()
    size = extent.size
    if angle % 180.0:
        text.set_rotation(0.0)
        size = text.get_window_extent(renderer).size
        text.set_rotation(angle)
    width, height = np.maximum(size + np.array([space, -2.0 * shrunk]), 1.0)
    centre = (extent.p0 + extent.p1) / 2.0
    turned = Affine2D().scale(width, height).rotate_deg(angle).translate(*centre)
    return _Box(text.get_text(), turned.transform_path(_UNIT))


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
        if not collection.get_visible():
            continue
        if isinstance(collection, PathCollection):
            places = np.ma.filled(np.ma.masked_invalid(collection.get_offsets()), np.nan)
            places = places[np.isfinite(places).all(axis=1)]
            yield Path(collection.get_offset_transform().transform(places)), False
        else:
            paths = (path for path in collection.get_paths() if len(path.vertices))
            yield from ((collection.get_transform().transform_path(path), True) for path in paths)


def _covers(box: _Box, axes: Axes) -> bool:
    """Whether a box lies over data of axes."""
    seen = Bbox.intersection(box.path.get_extents(), axes.bbox)
    if seen is None or min(seen.size) < 1.0:
        return False
    return any(
        path.intersects_bbox(seen, filled=False) if lines else path.vertices.size and seen.count_contains(path.vertices)
        for path, lines in _shapes(axes)
    )


def _tick_marks(axes: Axes) -> Iterator[_Box]:
    for axis in (axes.xaxis, axes.yaxis) if axes.axison else ():
        low, high = sorted(axis.get_view_interval())
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if low <= tick.get_loc() <= high:
                marks = (mark for mark in (tick.tick1line, tick.tick2line) if mark.get_visible())
                yield from (_upright("tick", mark.get_window_extent()) for mark in marks)


def spoilt(figure: Figure) -> list[str]:
    """Texts over texts, ticks, legends and data, legends over data, what is cut off, small print, odd widths."""
    recorder, texts = _drawn(figure)
    shrunk, space = _TOLERANCE * figure.dpi / 72.0, _SPACE * figure.dpi / 72.0
    boxes = [_box_of(text, recorder, shrunk, space) for text in texts]
    legends = [legend for legend in figure.findobj(Legend) if legend.get_visible()]
    written = {id(text) for legend in legends for text in legend.findobj(Text)}
    free = [box for text, box in zip(texts, boxes, strict=True) if id(text) not in written]
    frames = [
        _upright(
            "legend " + "; ".join(text.get_text() for text in legend.get_texts()),
            legend.get_window_extent(recorder).padded(-shrunk),
        )
        for legend in legends
    ]
    pairs = [*combinations(boxes, 2), *((one, frame) for one in free for frame in frames), *combinations(frames, 2)]
    found = [f"{one.what!r} over {other.what!r}" for one, other in pairs if one.meets(other)]
    within = [child for axes in figure.axes for child in axes.child_axes if isinstance(child, Axes)]
    for axes in (one for one in (*figure.axes, *within) if one.get_visible()):
        marks = list(_tick_marks(axes))
        for box in (*free, *frames):
            found += [f"{box.what!r} over data"] if _covers(box, axes) else []
            found += [f"{box.what!r} over a tick"] if any(box.meets(mark) for mark in marks) else []
    page = figure.bbox.padded(shrunk + space)
    for box in (*boxes, *frames):
        extents = box.path.get_extents()
        found += [f"{box.what!r} is cut off"] if (extents.p0 < page.p0).any() or (extents.p1 > page.p1).any() else []
    sizes = {text.get_text(): float(text.get_fontsize()) for text in texts}
    found += [f"{told!r} has {size:g} pt" for told, size in sizes.items() if size < LEAST_SIZE - 1e-9]
    width = float(figure.get_size_inches()[0])
    return found if any(abs(width - column) < 1e-9 for column in COLUMNS) else [*found, f"{width:g} inches wide"]


def letters(figure: Figure) -> list[str]:
    """The letters of a figure's panels, in the order in which they were made."""
    found = [re.match(r"\((\w+)\)", axes.get_title(loc="left")) for axes in figure.axes]
    return [match[1] for match in found if match]
