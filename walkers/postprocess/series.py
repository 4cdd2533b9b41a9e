"""Views of a run, or of one walker, beside each other: containers from the side, planes from above (Khan, Fig. 1)."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.errors import refused
from walkers.physics.units import DURATION, parse_quantity
from walkers.postprocess.drawing import check_place, new_figure, save_figure, styled
from walkers.postprocess.motion import Group, Motion, gathered, read_motion
from walkers.postprocess.scene import Picture, Scene, Window, axes_toward
from walkers.runner.directory import case_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SERIES_NAME, PICTURE_NAME = "series.png", "walker.png"
SHOWN = 6
"""Pictures in a time series."""
_TOLERANCE = 0.1
"""Of a time between pictures: frames are where they are."""
_PIXELS = 40.0
"""To a millimetre of a picture, at least, where the screen has room for it."""
_TALL, _TALLEST, _WIDEST = 1000, 1600, 1900
"""Pixels of a view: so high, higher for boxes that are much higher than wide, lower for what is much wider."""
_PAGE = (20.0, 12.0)
"""Inches of a time series, across and up, at most."""
_PANEL = (1.4, 5.0)
"""Inches of a picture in it, across and up: as large as one of the two says, if the page has room."""
_BESIDE, _BENEATH, _EDGES = 0.3, 0.8, (0.9, 0.1)
"""Inches between pictures: for what sticks out of tick labels, for time, ticks and label; and about all of them."""


def render_run(directory: Path, destination: Path | None = None, *, images: int = SHOWN) -> list[Path]:
    """Render a run: of independent walkers the first at several times, of all else views of the whole.

    Parameters and errors are those of `render_series`.
    """
    return render_series(directory, destination, images=images, walker=0 if case_of(directory).apart else None)


@styled
def render_series(
    directory: Path,
    destination: Path | None = None,
    *,
    images: int = SHOWN,
    apart: float | None = None,
    walker: int | None = None,
) -> list[Path]:
    """Views of a run beside each other, in rows, walkers and climbers coloured, with times and scales.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``series.png``, of one walker ``walker.png``, in the run directory if None.
    images
        How many, evenly through the drive.
    apart
        Seconds between them: the last ones of the run then, as many as ``images``.
    walker
        Number of a walker to show by itself.

    Raises
    ------
    InputError
        If the destination is no PNG, frames were recorded less often, or the drive was shorter than that.
    """
    path = destination or directory / (SERIES_NAME if walker is None else PICTURE_NAME)
    check_place(path, ".png")
    whole = read_motion(directory)
    motion = gathered(whole if walker is None else whole.of_walkers(whole.walkers[walker : walker + 1]))
    frames = _frames_evenly(motion, images) if apart is None else _frames_apart(motion, images, apart, directory)
    sideways = motion.case.boundary.closed
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) if sideways else np.eye(3)
    driven = slice(motion.first_driven, None)
    scene = Scene.around(motion, axes, 1.0 if sideways else 1.1, driven, shaken=False)
    (left, low, _), (right, high, _) = scene.low, scene.high
    high += 0.05 * (high - low) if sideways else 0.0
    scene = replace(scene, high=np.array([right, high, scene.high[2]]))
    window = Window(scene, _pixels(right - left, high - low))
    decimals = 2 if apart is None or apart >= 0.1 else 4
    figure, panels = _panels(len(frames), right - left, high - low, rows=None if walker is None else len(frames))
    for panel, frame in zip(panels, frames, strict=True):
        panel.imshow(window.picture(frame), extent=(left, right, low, high), interpolation="antialiased")
        panel.set_title(f"{motion.time[frame]:.{decimals}f} s", fontsize=10)
        panel.set_xlabel("x (mm)" if walker is None or panel is panels[-1] else "")
        panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
        panel.spines["right"].set_visible(sideways)  # as the left one, a wall
        panel.grid(visible=False)
        foremost = panel.get_position().x0 == panels[0].get_position().x0
        panel.tick_params(labelleft=foremost)
        panel.set_ylabel(f"{'height' if sideways else 'y'} (mm)" if foremost else "")
    window.close()
    return save_figure(figure, path, [directory.name])


def _pixels(wide: float, tall: float) -> list[int]:
    """Of a view of so many mm, across and up."""
    pixels = min(max(_TALL / tall, min(_PIXELS, _TALLEST / tall)), _WIDEST / wide)
    return [max(1, round(extent * pixels)) for extent in (wide, tall)]


def top_view(group: Group, walker: int, frame: int, along: tuple[float, float], across: tuple[float, float]) -> Picture:
    """One walker seen from above, as a stroboscope shows it.

    Parameters
    ----------
    group
        Of the walkers.
    walker, frame
        Which of them, and when.
    along, across
        Bounds of the picture along and across the drive axis, m, relative to the substrate.

    Returns
    -------
    ndarray, shape (height, width, 3)
        Red, green, blue; the first row is the farthest to the left of the drive axis, 120 pixels to the smaller radius.
    """
    motion = group.motion.of_walkers(group.walkers[walker : walker + 1])
    bounds = 1e3 * np.array([along, across, (0.0, 2.0 * group.radii.max())])
    scene = Scene(motion, axes_toward(np.array([0.0, 0.0, 1.0]), group.across_axis), bounds[:, 0], bounds[:, 1], False)
    pixels = 120.0 / (1e3 * float(group.radii.min()))
    window = Window(scene, [round(float(high - low) * pixels) for low, high in bounds[:2]])
    picture = window.picture(frame)
    window.close()
    return picture


def _panels(count: int, wide: float, tall: float, *, rows: int | None = None) -> tuple[Figure, list[Axes]]:
    """A figure with so many axes of one shape, given in mm, in so many rows, or as many as make them largest.

    Their places are reckoned here: no layout of matplotlib's knows how large axes of a fixed aspect will be.
    """
    aspired = max(_PANEL[0] / wide, _PANEL[1] / tall)

    def inches(rows: int) -> float:
        """To a millimetre."""
        across, up = ((whole - edge) for whole, edge in zip(_PAGE, _EDGES, strict=True))
        return min(aspired, (across / ceil(count / rows) - _BESIDE) / wide, (up / rows - _BENEATH) / tall)

    rows = rows or max(range(1, count + 1), key=lambda rows: (inches(rows), -rows))
    columns = ceil(count / rows)
    across, up = inches(rows) * wide + _BESIDE, inches(rows) * tall + _BENEATH
    size = (_EDGES[0] + columns * across, _EDGES[1] + rows * up)
    figure, axes = new_figure(*size, nrows=rows, ncols=columns, squeeze=False)
    figure.set_layout_engine("none")
    for number, panel in enumerate(axes.flat):
        if number >= count:
            panel.remove()
            continue
        row, column = divmod(number, columns)
        left, bottom = _EDGES[0] + column * across, (rows - 1 - row) * up + 0.6 * _BENEATH
        corner = (left / size[0], bottom / size[1])
        panel.set_position((*corner, (across - _BESIDE) / size[0], (up - _BENEATH) / size[1]))
    return figure, list(axes.flat)[:count]


def _frames_evenly(motion: Motion, images: int) -> list[int]:
    """Through the drive; at the same phase of it, if there are as many cycles, or walkers would seem to go back."""
    start, cycle = motion.first_driven, motion.case.run.samples_per_cycle
    cycles = (len(motion.time) - 1 - start) // cycle
    every, steps = (cycle, cycles) if cycles >= images - 1 else (1, len(motion.time) - 1 - start)
    return [start + every * int(step) for step in np.unique(np.linspace(0, steps, images).round())]


def _frames_apart(motion: Motion, images: int, apart: float, directory: Path) -> list[int]:
    """The last frames of a run that are so many seconds apart, to a tenth of that."""
    last = len(motion.time) - 1
    between = motion.case.run.steps_per_sample * motion.case.run.time_step
    every, expected = round(apart / between), ""
    if not every or abs(every * between / apart - 1.0) > _TOLERANCE:
        expected = f"a multiple of the {between:.4g} s between frames"
    elif every > last - motion.first_driven:
        expected = f"less than the {max(motion.time[-1], 0.0):.3g} s of the drive"
    if expected:
        raise refused(directory, f"{apart:.4g} s between pictures: expected {expected}")
    return list(range(last, motion.first_driven - 1, -every))[:images][::-1]


def seconds_apart(text: str, directory: Path) -> float:
    """Read a time between pictures: a duration, or a part or multiple of the drive's cycle such as ``T/4`` or ``2 T``.

    An ``InputError`` says that the text is neither.
    """
    cycles = re.fullmatch(r"(?P<many>[\d.]*)\s*T\s*(/\s*(?P<parts>\d+))?", text.strip())
    seconds = 0.0
    with suppress(ValueError, ZeroDivisionError):
        if cycles:
            seconds = float(cycles["many"] or 1) / int(cycles["parts"] or 1) / case_of(directory).drive.frequency
        else:
            seconds = parse_quantity(text, DURATION)
    if seconds > 0.0:
        return seconds
    raise refused("--interval", f'{text!r}: expected a time such as "2 s", or "T/4" of a cycle')
