"""Pictures of a run at several times: containers from the side, planes and trays along their normal.

On a tilted plane up in the picture is uphill. The view follows a walker that walks far.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from math import ceil
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import check_limits
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.show.camera import from_the_side, named_direction, plan_axes
from walkers.postprocess.show.drawing import (
    check_place,
    new_figure,
    plain_text,
    save_figure,
    styled,
)
from walkers.postprocess.show.necks import NECK_LEGEND, bridges_at
from walkers.postprocess.show.scene import Scene, gathered, motion_in_view
from walkers.postprocess.show.window import Window

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SERIES_NAME, PICTURE_NAME = "series.png", "walker.png"
"""Pictures of all beads, and of one walker."""
MOST_PICTURES = 6
"""Pictures in a time series."""
_PIXELS = 40.0
"""Smallest resolution of a view in pixels per mm, unless it becomes too large."""
_TALL, _TALLEST, _WIDEST = 1000, 1600, 1900
"""Pixels of a view: usual height, largest height (views that are much higher than wide), largest width."""
_PAGE, _VIEW = (8.0, 10.0), (1.4, 5.0)
"""Largest width and height of all views; width or height of a view, which gives the larger one; inches."""
_BESIDE, _BENEATH, _LINE = 0.25, 0.75, 0.2
"""Space beside and beneath a view; height of a line of text; inches."""
_AROUND, _ASPECT = 1.1, 6.0
"""Extent of a view from above over that of the beads; largest width over height of a view that does not follow."""


@styled
def render_series(
    directory: Path,
    destination: Path | None = None,
    *,
    images: int = MOST_PICTURES,
    walker: int | None = None,
) -> list[Path]:
    """Render views of a run in rows, with times and scales; walkers, climbers and liquid bridges are coloured.

    `InputError` if the destination is no PNG, or the run has no walker with this number.

    Parameters
    ----------
    directory, destination
        A run directory; the PNG, if None ``series.png``, of one walker ``walker.png``, in it.
    images
        Largest number of pictures, evenly spaced through the drive; fewer if the last is then closer to its end.
    walker
        Number of a walker to show by itself; None: the first of independent walkers, otherwise all beads.
    """
    check_limits("images", images, 1, 20)
    if destination is not None:
        check_place(destination, ".png")
    motion, single = motion_in_view(read_motion(directory), walker)
    path = destination or directory / (PICTURE_NAME if single else SERIES_NAME)
    figure = _figure(
        gathered(motion) if single else motion, even_frames(motion, images), follow=single
    )
    return save_figure(figure, path, [directory.name])


def even_frames(motion: Motion, count: int) -> list[int]:
    """Evenly spaced frames from the first of the drive: ``count``, or fewer if the last is then closer to the end.

    If there are enough cycles, all have the same phase; otherwise walkers would appear to move backward.
    """
    start, cycle = motion.first_driven, motion.case.run.samples_per_cycle
    last = len(motion.time) - 1 - start
    every, steps = (cycle, last // cycle) if last // cycle >= count - 1 else (1, last)
    if not (most := min(count - 1, steps)):
        return [start]
    step = min(
        steps // most, -(-steps // most), key=lambda step: steps - step * min(most, steps // step)
    )
    return [start + every * step * number for number in range(min(most, steps // step) + 1)]


def even_labels(time: FloatArray) -> list[str]:
    """Evenly spaced times (s) as text with the required number of decimals."""
    between = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    decimals = next(
        (
            places
            for places in range(2, 6)
            if abs(round(between, places) - between) <= 0.01 * between
        ),
        6,
    )
    return [f"{moment:.{decimals}f} s" for moment in time]


def _figure(motion: Motion, frames: Sequence[int], *, follow: bool) -> Figure:
    """Pictures of frames with axes in mm; those of one walker in a column, or in a row if it goes up."""
    case, sideways, driven = (
        motion.case,
        from_the_side(motion.case),
        slice(motion.first_driven, None),
    )
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    axes = axes if sideways else plan_axes(motion, np.array([1.0, 0.0, 0.0]))
    around = 1.0 if sideways else _AROUND
    scene = Scene.around(motion, axes, around, driven, shaken=False)
    scene = scene.following(_ASPECT, around, driven) if follow else scene
    titles, tilted = even_labels(motion.time[frames]), case.boundary.tilted
    names = (
        ("x", "height") if sideways else ("across the slope", "uphill") if tilted else ("x", "y")
    )
    heading = [
        case.title or case.name,
        *([tilted] if tilted else []),
        ", ".join([*scene.colour_legend, NECK_LEGEND]),
    ]
    if scene.camera_path is not None:
        toward, direction = named_direction(motion)
        names = ("", "")
        titles = [
            f"{time}\n{scene.camera_displacement(frame) @ toward:z.1f} mm"
            for time, frame in zip(titles, frames, strict=True)
        ]
        heading.insert(-1, f"the view follows the beads: time and displacement {direction}")
    columns = (
        (1 if np.ptp([scene.low, scene.high], axis=0)[:2].argmax() == 0 else len(frames))
        if follow
        else 0
    )
    return _drawn(
        scene, frames, titles, [f"{name} (mm)".lstrip() for name in names], heading, columns
    )


def _drawn(
    scene: Scene,
    frames: Sequence[int],
    titles: Sequence[str],
    labels: Sequence[str],
    heading: Sequence[str],
    columns: int,
) -> Figure:
    """Pictures of frames in a number of columns; 0: that which makes them largest."""
    count, (wide, tall) = len(frames), (scene.high - scene.low)[:2].tolist()

    def scale(columns: int) -> float:
        """Inches per mm."""
        across, up = _PAGE[0] / columns - _BESIDE, _PAGE[1] / ceil(count / columns) - _BENEATH
        return float(min(max(_VIEW[0] / wide, _VIEW[1] / tall), across / wide, up / tall))

    columns = columns or max(range(1, count + 1), key=lambda number: (scale(number), number))
    rows, inches = ceil(count / columns), scale(columns)
    width = columns * (inches * wide + _BESIDE) + 0.8
    lines = [line for text in heading for line in wrap(plain_text(text), round(13.0 * width))]
    height = rows * (inches * tall + _BENEATH) + _LINE * len(lines)
    figure = new_figure(width, height)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    figure.set_layout_engine("compressed")
    figure.suptitle("\n".join(lines), fontsize=10)
    extent = np.stack([scene.low, scene.high], axis=1)[:2].ravel().tolist()
    pixels = min(max(_TALL / tall, min(_PIXELS, _TALLEST / tall)), _WIDEST / wide)
    size = [max(1, round(length * pixels)) for length in (wide, tall)]
    seen = zip(axes.flat, frames, bridges_at(scene.motion, frames), titles, strict=False)
    with closing(Window(scene, size)) as window:
        for number, (panel, frame, bridges, title) in enumerate(seen):
            panel.imshow(window.picture(frame, bridges), extent=extent, interpolation="antialiased")
            panel.set_title(title, fontsize=10)
            panel.grid(visible=False)
            panel.spines["right"].set_visible(
                from_the_side(scene.motion.case)
            )  # as the left one, a wall
            below, left = number + columns >= count, not number % columns
            panel.tick_params(
                left=left, labelleft=left, bottom=below, labelbottom=below, labelsize=9
            )
            panel.set_xlabel(labels[0] if below else "", fontsize=10)
            panel.set_ylabel(labels[1] if left else "", fontsize=10)
            panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
    for panel in axes.flat[count:]:
        panel.remove()
    figure.draw_without_rendering()
    box = figure.get_tightbbox()
    figure.set_size_inches(box.width + 0.15, box.height + 0.15)
    return figure
