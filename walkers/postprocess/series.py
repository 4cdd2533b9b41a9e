"""Time series of views of a run or one walker: containers from the side, planes and trays along their normal.

One walker is shown as in Fig. 1 of Khan et al.: a strip of the floor for each time, below each other, or side by side
if it walks up a slope. On a tilted plane up in the picture is uphill.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, isclose
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.inputs.case import Case
from walkers.postprocess.drawing import check_place, new_figure, plain_text, save_figure, styled
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, even_frames, even_labels, gathered, read_motion
from walkers.postprocess.necks import EXPLAINED, bridges_at
from walkers.postprocess.scene import Picture, Scene, Window, from_the_side, one_walker, plan_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SERIES_NAME, PICTURE_NAME = "series.png", "walker.png"
SHOWN = 6
"""Pictures in a time series."""
_PIXELS = 40.0
"""Smallest resolution of a view in pixels per mm, unless it becomes too large."""
_TALL, _TALLEST, _WIDEST = 1000, 1600, 1900
"""Pixels of a view: usual height, largest height (views that are much higher than wide), largest width."""
_PAGE = (8.5, 9.0)
"""Largest width and height of a picture, inches."""
_PANEL = (1.4, 5.0)
"""Width or height of a view, inches: the one that gives the larger view, if the page has room."""
_BESIDE, _BENEATH, _EDGES = 0.3, 0.8, (0.9, 0.1)
"""Space between views side by side (tick labels) and below each other (time, ticks, label); outer edges; inches."""
_STRIP, _LENGTHS, _GAP = 0.8, (3.6, 5.4), 0.08
"""Width, smallest and largest length of a strip, and space between strips, inches."""
_MARGIN, _STILL, _LONG = 0.25, 0.1, 4.0
"""Edge of a strip over half the width of the walker; displacement of a walker at rest over half its length; number of
lengths of a path beyond which each strip is centred on the walker."""
_LETTERS: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.labelsize": 10,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
}


@styled
def render_series(
    directory: Path,
    destination: Path | None = None,
    *,
    images: int = SHOWN,
    walker: int | None = None,
) -> list[Path]:
    """Render views of a run in rows, with times and scales; walkers and climbers are coloured.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``series.png``, of one walker ``walker.png``, in the run directory if None.
    images
        Largest number of pictures, evenly spaced through the drive; fewer if the last is then nearer to its end.
    walker
        Number of a walker to show by itself.

    Raises
    ------
    InputError
        If the destination is no PNG, or the run has no walker with this number.
    """
    from matplotlib import rc_context

    path = destination or directory / (SERIES_NAME if walker is None else PICTURE_NAME)
    check_place(path, ".png")
    whole = read_motion(directory)
    motion = gathered(whole if walker is None else one_walker(whole, walker))
    frames = even_frames(motion, images)
    with rc_context(_LETTERS):
        figure = _views(motion, frames) if walker is None else _strips(motion, frames)
    return save_figure(figure, path, [directory.name])


def _views(motion: Motion, frames: Sequence[int]) -> Figure:
    """All beads at several times, with axes in mm."""
    boundary = motion.case.boundary
    sideways = from_the_side(motion.case)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    if not sideways:
        axes = plan_axes(motion, np.array([1.0, 0.0, 0.0]))
    driven = slice(motion.first_driven, None)
    scene = Scene.around(motion, axes, 1.0 if sideways else 1.1, driven, shaken=False)
    (left, low, _), (right, high, _) = scene.low, scene.high
    high += 0.05 * (high - low) if sideways else 0.0
    scene = replace(scene, high=np.array([right, high, scene.high[2]]))
    window = Window(scene, _pixels(right - left, high - low))
    said = [
        motion.case.title or motion.case.name,
        ", ".join([*(["red: climbers"] if motion.case.loose else []), EXPLAINED]),
    ]
    figure, panels = _panels(len(frames), right - left, high - low, said)
    names = ("x", "height") if sideways else ("across the slope", "uphill") if boundary.tilt else ("x", "y")
    seen = zip(panels, frames, bridges_at(motion, frames), even_labels(motion.time[frames]), strict=True)
    for panel, frame, bridges, time in seen:
        panel.imshow(window.picture(frame, bridges), extent=(left, right, low, high), interpolation="antialiased")
        panel.set_title(time)
        panel.set_xlabel(f"{names[0]} (mm)")
        panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
        panel.spines["right"].set_visible(sideways)  # as the left one, a wall
        panel.grid(visible=False)
        foremost = isclose(panel.get_position().x0, panels[0].get_position().x0)
        panel.tick_params(labelleft=foremost)
        panel.set_ylabel(f"{names[1]} (mm)" if foremost else "")
    window.close()
    if boundary.tilted:
        panels[0].annotate(boundary.tilted, (0.0, 1.0), (0.0, 20.0), "axes fraction", "offset points")
    return figure


def _strips(motion: Motion, frames: Sequence[int]) -> Figure:
    """One walker at several times on strips of the floor; a long path is given as distances beside the times."""
    axes, radius = plan_axes(motion, np.array(motion.case.drive_axis)), 1e3 * motion.radius[:, None]
    place = 1e3 * motion.position[frames] @ axes.T
    middle = place.mean(axis=1)
    half, extent = (np.abs(place - middle[:, None]) + radius).max(axis=(0, 1)), np.ptp(middle, axis=0)
    still = extent.max() < _STILL * half.max()
    along = int(motion.case.boundary.tilt > 0.0 if still else extent[1] > extent[0])  # strips are upright, or level
    path, times = middle - middle[0], even_labels(motion.time[frames])
    if long := bool(extent[along] > _LONG * 2.0 * half[along]):
        times = [f"{time}\n{way:z.1f} mm" for time, way in zip(times, path[:, along], strict=True)]
    else:
        path[:, along] = 0.0
    seen, margin = place - path[:, None], _MARGIN * half[1 - along]
    low, high = (seen - radius).min(axis=(0, 1)) - margin, (seen + radius).max(axis=(0, 1)) + margin
    inches = min(_STRIP / (high - low)[1 - along], _LENGTHS[1] / (high - low)[along])
    wider = max((0.0 if along else _LENGTHS[0]) / inches - (high - low)[along], 0.0) / 2.0
    low[along], high[along] = low[along] - wider, high[along] + wider
    camera = np.zeros((len(motion.time), 3))
    camera[frames] = path @ axes
    window = Window(Scene(motion, axes, low, high, shaken=False, path=camera), _pixels(*(high - low)[:2].tolist()))
    pictures = [
        window.picture(frame, bridges) for frame, bridges in zip(frames, bridges_at(motion, frames), strict=True)
    ]
    window.close()
    bounds = np.stack([low, high], axis=1)[:2] - middle[0, :2, None]
    tilted = motion.case.boundary.tilted
    said = [motion.case.title or motion.case.name]
    said += [f"{tilted}, seen along its normal"] if tilted else []
    direction = (("along the drive axis", "across the drive axis"), ("across the slope", "uphill"))[bool(tilted)][along]
    said += [EXPLAINED]
    said += [f"centred on the beads; time and displacement {direction}"] if long else []
    figure, panels = _strip_panels(pictures, bounds, inches, along, said)
    _describe_strips(figure, panels, motion.case, times, along, f"{direction} (mm)")
    return figure


def _strip_panels(
    pictures: Sequence[Picture], bounds: FloatArray, inches: float, along: int, said: Sequence[str]
) -> tuple[Figure, list[Axes]]:
    """Pictures with bounds (mm, shape (2, 2)) below each other, or upright ones (``along`` 1) side by side.

    The lines of ``said`` are above them.
    """
    (across, up), left, below = np.ptp(bounds, axis=1) * inches, 0.75 if along else 0.3, 0.2 if along else 0.6
    columns, rows = (len(pictures), 1) if along else (1, len(pictures))
    wide = left + columns * (across + _GAP) + (0.9 if along or len(said) == 1 else 1.6)
    lines = [line for one in said for line in wrap(plain_text(one), round(13.0 * wide))]
    tall = below + rows * (up + _GAP) + 0.15 + 0.18 * len(lines) + (0.25 if along else 0.0)
    figure, grid = new_figure(wide, tall, nrows=rows, ncols=columns, squeeze=False)
    figure.set_layout_engine("none")
    figure.suptitle("\n".join(lines), y=1.0 - 0.08 / tall, fontsize=10)
    for number, (panel, picture) in enumerate(zip(grid.flat, pictures, strict=True)):
        row, column = divmod(number, columns)
        corner = left + column * (across + _GAP), below + (rows - 1 - row) * (up + _GAP)
        panel.set_position((corner[0] / wide, corner[1] / tall, across / wide, up / tall))
        panel.imshow(picture, extent=bounds.ravel().tolist(), interpolation="antialiased", aspect="auto")
        panel.grid(visible=False)
        panel.spines[["left", "bottom"]].set_visible(False)
        upright, level = bool(along) and column == 0, not along and row == rows - 1
        panel.tick_params(left=upright, labelleft=upright, bottom=level, labelbottom=level)
    return figure, list(grid.flat)


def _describe_strips(
    figure: Figure, panels: Sequence[Axes], case: Case, times: Sequence[str], along: int, label: str
) -> None:
    """Add times, the label of the axis, and on a slope an arrow for the component of gravity."""
    wide = figure.get_figwidth()
    for panel, time in zip(panels, times, strict=True):
        if along:
            panel.set_title(time)
        else:
            panel.text(1.03, 0.5, time, transform=panel.transAxes, va="center")
    if along:
        panels[0].set_ylabel(label)
    else:
        panels[-1].set_xlabel(label)
    if case.boundary.tilted and case.environment.gravity:
        place = 1.0 - 0.45 / wide
        figure.text(place, 0.56, case.boundary.pull, ha="center")
        how: dict[str, Any] = {"xycoords": "figure fraction", "arrowprops": {"arrowstyle": "-|>", "lw": 1.5, "fc": "k"}}
        panels[0].annotate("", (place, 0.36), (place, 0.55), **how)


def _pixels(wide: float, tall: float) -> list[int]:
    """Width and height in pixels of a view whose width and height are in mm."""
    pixels = min(max(_TALL / tall, min(_PIXELS, _TALLEST / tall)), _WIDEST / wide)
    return [max(1, round(extent * pixels)) for extent in (wide, tall)]


def _panels(count: int, wide: float, tall: float, said: Sequence[str]) -> tuple[Figure, list[Axes]]:
    """A figure with lines above and equal axes (width and height in mm), in the number of rows that makes them largest.

    Their positions are calculated here because layouts of matplotlib do not know the size of axes of a fixed aspect.
    """
    aspired = max(_PANEL[0] / wide, _PANEL[1] / tall)

    def inches(rows: int) -> float:
        """Inches per mm."""
        across, up = ((whole - edge) for whole, edge in zip(_PAGE, _EDGES, strict=True))
        return min(aspired, (across / ceil(count / rows) - _BESIDE) / wide, (up / rows - _BENEATH) / tall)

    rows = max(range(1, count + 1), key=lambda rows: (inches(rows), -rows))
    columns = ceil(count / rows)
    across, up = inches(rows) * wide + _BESIDE, inches(rows) * tall + _BENEATH
    lines = [line for one in said for line in wrap(plain_text(one), round(13.0 * (_EDGES[0] + columns * across)))]
    size = (_EDGES[0] + columns * across, _EDGES[1] + 0.18 * len(lines) + rows * up)
    figure, axes = new_figure(*size, nrows=rows, ncols=columns, squeeze=False)
    figure.set_layout_engine("none")
    figure.suptitle("\n".join(lines), y=1.0 - 0.08 / size[1], fontsize=10)
    for number, panel in enumerate(axes.flat):
        if number >= count:
            panel.remove()
            continue
        row, column = divmod(number, columns)
        left, bottom = _EDGES[0] + column * across, (rows - 1 - row) * up + 0.6 * _BENEATH
        corner = (left / size[0], bottom / size[1])
        panel.set_position((*corner, (across - _BESIDE) / size[0], (up - _BENEATH) / size[1]))
    return figure, list(axes.flat)[:count]
