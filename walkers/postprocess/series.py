"""Time series of views of a run or one walker: containers from the side, planes and trays along their normal.

One walker is shown as in Fig. 1 of Khan et al.: a strip of the floor for each time, below each other, or side by side
if it walks up a slope. On a tilted plane up in the picture is uphill.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from math import ceil
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from walkers.errors import check_limits
from walkers.postprocess.drawing import check_place, new_figure, plain_text, save_figure, styled
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, read_motion
from walkers.postprocess.necks import EXPLAINED, bridges_at
from walkers.postprocess.scene import Scene, Window, from_the_side, plan_axes, shown_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SERIES_NAME, PICTURE_NAME = "series.png", "walker.png"
SHOWN = 6
"""Pictures in a time series."""
_PIXELS = 40.0
"""Smallest resolution of a view in pixels per mm, unless it becomes too large."""
_TALL, _TALLEST, _WIDEST = 1000, 1600, 1900
"""Pixels of a view: usual height, largest height (views that are much higher than wide), largest width."""
_PAGE, _VIEW, _STRIP = (8.0, 9.0), (1.4, 5.0), 0.9
"""Largest width and height of all views, width or height of a view (which gives the larger one), and width of a strip
of the floor; inches."""
_BESIDE, _BENEATH, _LINE = 0.25, 0.75, 0.2
"""Space beside and beneath a view; height of a line of text; inches."""
_MARGIN, _STILL, _LONG, _ASPECT = 0.25, 0.1, 4.0, 4.5
"""Margin of a strip over half the width of the walker; largest displacement of a walker at rest over half its length;
largest length of a path, in lengths of the walker, that one strip shows; smallest length of a level strip over its
width."""
_LEFT_OUT = 0.02  # largest share of a run after the last of several evenly spaced times


class _Views(NamedTuple):
    """Views of frames with their titles: labels of the axes, lines above, scale (inches per mm), columns (0: any).

    Axes of the figure count from ``origin`` (mm, to the right and up in the view).
    """

    scene: Scene
    frames: Sequence[int]
    titles: list[str]
    labels: tuple[str, str]
    heading: list[str]
    scale: float
    columns: int = 0
    origin: tuple[float, float] = (0.0, 0.0)


@styled
def render_series(
    directory: Path, destination: Path | None = None, *, images: int = SHOWN, walker: int | None = None
) -> list[Path]:
    """Render views of a run in rows, with times and scales; walkers, climbers and liquid bridges are coloured.

    `InputError` if the destination is no PNG, or the run has no walker with this number.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``series.png``, of one walker ``walker.png``, in the run directory if None.
    images
        Largest number of pictures, evenly spaced through the drive; fewer if the last is then closer to its end.
    walker
        Number of a walker to show by itself; None: the first of independent walkers, otherwise all beads.
    """
    check_limits("images", images, 1, 20)
    if destination is not None:
        check_place(destination, ".png")
    motion, single = shown_of(read_motion(directory), walker)
    frames = even_frames(motion, images)
    figure = _figure(_strips(motion, frames) if single else _views(motion, frames))
    path = destination or directory / (PICTURE_NAME if single else SERIES_NAME)
    return save_figure(figure, path, [directory.name])


def even_frames(motion: Motion, count: int) -> list[int]:
    """Evenly spaced frames from the first of the drive: ``count``, or fewer if the last is then closer to the end.

    If there are enough cycles, all have the same phase; otherwise walkers would appear to move backward.
    """
    start, cycle = motion.first_driven, motion.case.run.samples_per_cycle
    last = len(motion.time) - 1 - start
    every, steps = (cycle, last // cycle) if last // cycle >= count - 1 else (1, last)
    most = min(count - 1, steps)
    parts = range(most, most // 2, -1)
    if not parts:
        return [start]
    exact = [number for number in parts[:2] if steps % number == 0]
    nearly = [number for number in parts if steps % number <= _LEFT_OUT * steps]
    number = [*exact, *nearly, min(parts, key=lambda number: steps % number)][0]
    return [start + every * (steps // number) * part for part in range(number + 1)]


def even_labels(time: FloatArray) -> list[str]:
    """Evenly spaced times (s) as text with the required number of decimals."""
    between = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    decimals = next((places for places in range(2, 6) if abs(round(between, places) - between) <= 0.01 * between), 6)
    return [f"{moment:.{decimals}f} s" for moment in time]


def _views(motion: Motion, frames: Sequence[int]) -> _Views:
    """All beads at several times, with axes in mm."""
    boundary, sideways = motion.case.boundary, from_the_side(motion.case)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    if not sideways:
        axes = plan_axes(motion, np.array([1.0, 0.0, 0.0]))
    driven = slice(motion.first_driven, None)
    scene = Scene.around(motion, axes, 1.0 if sideways else 1.1, driven, shaken=False)
    wide, tall = np.ptp([scene.low, scene.high], axis=0)[:2]
    names = ("x", "height") if sideways else ("across the slope", "uphill") if boundary.tilt else ("x", "y")
    heading = [motion.case.title or motion.case.name, *([boundary.tilted] if boundary.tilted else [])]
    heading += [", ".join([*scene.explained, EXPLAINED])]
    labels = (f"{names[0]} (mm)", f"{names[1]} (mm)")
    scale = max(_VIEW[0] / wide, _VIEW[1] / tall)
    return _Views(scene, frames, even_labels(motion.time[frames]), labels, heading, scale)


def _strips(motion: Motion, frames: Sequence[int]) -> _Views:
    """One walker at several times on strips of the floor; a long path is given as distances beside the times."""
    axes, radius = plan_axes(motion, np.array(motion.case.drive_axis)), 1e3 * motion.radius[:, None]
    place = 1e3 * motion.position[frames] @ axes.T
    middle = place.mean(axis=1)
    half, extent = (np.abs(place - middle[:, None]) + radius).max(axis=(0, 1)), np.ptp(middle, axis=0)
    still, tilted = extent.max() < _STILL * half.max(), motion.case.boundary.tilted
    along = int(motion.case.boundary.tilt > 0.0 if still else extent[1] > extent[0])  # strips are upright, or level
    path, times = middle - middle[0], even_labels(motion.time[frames])
    direction = (("along the drive axis", "across the drive axis"), ("across the slope", "uphill"))[bool(tilted)][along]
    heading = [motion.case.title or motion.case.name, *([f"{tilted}, seen along its normal"] if tilted else [])]
    if extent[along] > _LONG * 2.0 * half[along]:
        join = "\n" if along else ", "
        times = [f"{time}{join}{distance:z.1f} mm" for time, distance in zip(times, path[:, along], strict=True)]
        heading += [f"centred on the beads; time and displacement {direction}"]
    else:
        path[:, along] = 0.0
    seen, margin = place - path[:, None], _MARGIN * half[1 - along]
    low, high = (seen - radius).min(axis=(0, 1)) - margin, (seen + radius).max(axis=(0, 1)) + margin
    narrow = (high - low)[1 - along]
    wider = 0.0 if along else max(_ASPECT * narrow - (high - low)[along], 0.0) / 2.0
    low[along], high[along] = low[along] - wider, high[along] + wider
    camera = np.zeros((len(motion.time), 3))
    camera[frames] = path @ axes
    scene = Scene(motion, axes, low, high, shaken=False, path=camera)
    labels = ("", f"{direction} (mm)") if along else (f"{direction} (mm)", "")
    origin = (float(middle[0, 0]), float(middle[0, 1]))
    columns, heading = len(frames) if along else 1, [*heading, EXPLAINED]
    return _Views(scene, frames, times, labels, heading, _STRIP / narrow, columns, origin)


def _figure(views: _Views) -> Figure:
    """Pictures in the number of columns that makes them largest, on slopes with an arrow for the pull of gravity."""
    scene, case, count = views.scene, views.scene.motion.case, len(views.frames)
    strips = views.columns > 0
    bounds = np.stack([scene.low, scene.high], axis=1)[:2]
    wide, tall = np.ptp(bounds, axis=1).tolist()

    def scale(columns: int) -> float:
        """Inches per mm."""
        across, up = _PAGE[0] / columns - _BESIDE, _PAGE[1] / ceil(count / columns) - _BENEATH
        return float(min(views.scale, across / wide, up / tall))

    columns = views.columns or max(range(1, count + 1), key=lambda number: (scale(number), number))
    rows, inches = ceil(count / columns), scale(columns)
    width = columns * (inches * wide + _BESIDE) + 0.8
    lines = [line for text in views.heading for line in wrap(plain_text(text), round(13.0 * width))]
    height = rows * (inches * tall + _BENEATH) + _LINE * len(lines)
    figure, axes = new_figure(width, height, nrows=rows, ncols=columns, squeeze=False, sharex=True, sharey=True)
    figure.set_layout_engine("compressed")
    figure.suptitle("\n".join(lines), fontsize=10)
    extent = (bounds - np.array(views.origin)[:, None]).ravel().tolist()
    seen = zip(axes.flat, views.frames, bridges_at(scene.motion, views.frames), views.titles, strict=False)
    with closing(Window(scene, _pixels(wide, tall))) as window:
        for number, (panel, frame, bridges, title) in enumerate(seen):
            panel.imshow(window.picture(frame, bridges), extent=extent, interpolation="antialiased")
            panel.set_title(title, fontsize=10)
            panel.grid(visible=False)
            panel.spines[["left", "bottom"]].set_visible(not strips)
            panel.spines["right"].set_visible(not strips and from_the_side(case))  # as the left one, a wall
            edges = (number + columns >= count, not number % columns)
            below, left = (bool(label) and at_edge for label, at_edge in zip(views.labels, edges, strict=True))
            panel.tick_params(left=left, labelleft=left, bottom=below, labelbottom=below, labelsize=9)
            panel.set_xlabel(views.labels[0] if below else "", fontsize=10)
            panel.set_ylabel(views.labels[1] if left else "", fontsize=10)
            panel.locator_params(axis="x", nbins=4 if not strips else 9, steps=[1, 2, 5, 10])
    for panel in axes.flat[count:]:
        panel.remove()
    if strips and case.boundary.tilted and case.environment.gravity:
        how = {"arrowstyle": "-|>", "lw": 1.5, "fc": "k"}
        place = {"xycoords": "axes fraction", "ha": "center", "va": "bottom", "fontsize": 10}
        last = axes.flat[count - 1]
        last.annotate(case.boundary.pull, (1.3, 0.35), (1.3, 0.6), arrowprops=how, **place)
    figure.draw_without_rendering()
    box = figure.get_tightbbox()
    figure.set_size_inches(box.width + 0.15, box.height + 0.15)
    return figure


def _pixels(wide: float, tall: float) -> list[int]:
    """Width and height in pixels of a view whose width and height are in mm."""
    pixels = min(max(_TALL / tall, min(_PIXELS, _TALLEST / tall)), _WIDEST / wide)
    return [max(1, round(extent * pixels)) for extent in (wide, tall)]
