"""Views of a whole run beside each other: containers from the side, as in Fig. 1a of Khan et al., planes from above."""

from __future__ import annotations

import re
from collections.abc import Collection
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.units import DURATION, parse_quantity
from walkers.postprocess.drawing import check_picture, new_figure, save_figure, styled
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, gathered, read_motion
from walkers.postprocess.scene import Beads, Picture, new_plotter, pointed_out
from walkers.runner.directory import case_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SERIES_NAME = "series.png"
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


class View:
    """A run seen from the side, along y, or from above, without perspective; one window for any number of frames.

    Parameters
    ----------
    motion
        Of the run.

    Attributes
    ----------
    low, high : ndarray, shape (2,)
        Corners of the picture, m: along x, and the height or along y.
    axes
        What they are called.
    """

    def __init__(self, motion: Motion) -> None:
        self._motion = motion
        sideways = motion.case.boundary.closed
        self.axes = ("x", "height" if sideways else "y")
        self.low, self.high = _corners(motion, sideways)
        extents = self.high - self.low
        wide, tall = 1e3 * extents
        pixels = min(max(_TALL / tall, min(_PIXELS, _TALLEST / tall)), _WIDEST / wide)
        size = [max(1, round(extent * pixels)) for extent in (wide, tall)]
        self._plotter = new_plotter(size, "white")
        self._beads = Beads(self._plotter, motion.radius, motion.large)
        x, up = (self.low + self.high) / 2.0 * 1e3
        middle = (x, 0.0, up) if sideways else (x, up, 0.0)
        camera = (x, -1e2, up) if sideways else (x, up, 1e2)
        self._plotter.camera_position = [camera, middle, (0.0, 0.0, 1.0) if sideways else (0.0, 1.0, 0.0)]
        self._plotter.camera.parallel_projection = True
        self._plotter.camera.parallel_scale = extents[1] / 2.0 * 1e3

    def picture(self, frame: int, coloured: Collection[int]) -> Picture:
        """The beads in a frame, with some beads in another colour."""
        self._beads.colour(coloured)
        self._beads.move(self._motion.position[frame] * 1e3)
        self._plotter.render()  # a screenshot does so the first time only
        return np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)

    def close(self) -> None:
        """Give back the window."""
        self._plotter.close()


def _corners(motion: Motion, sideways: bool) -> tuple[FloatArray, FloatArray]:
    """Of the picture: from the floor to a little above what any bead reaches; from above, all that they reach."""
    start, radius = motion.first_driven, motion.radius[:, None]
    reached = motion.position[start:]
    if sideways:
        half = motion.case.boundary.inner_width / 2.0
        return np.array([-half, 0.0]), np.array([half, 1.05 * float((reached[..., 2] + motion.radius).max())])
    margin = float(motion.radius.max())
    return (
        (reached[..., :2] - radius).min(axis=(0, 1)) - margin,
        (reached[..., :2] + radius).max(axis=(0, 1)) + margin,
    )


@styled
def render_series(
    directory: Path, destination: Path | None = None, *, images: int = SHOWN, apart: float | None = None
) -> list[Path]:
    """Views of a run beside each other, in rows, walkers and climbers coloured, with times and scales.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``series.png`` in the run directory if None.
    images
        How many, evenly through the drive.
    apart
        Seconds between them: the last ones of the run then, as many as ``images``.

    Raises
    ------
    InputError
        If frames were recorded less often, or the drive was shorter than that.
    """
    path = destination or directory / SERIES_NAME
    check_picture(path, ".png")
    motion = gathered(read_motion(directory))
    frames = _frames_evenly(motion, images) if apart is None else _frames_apart(motion, images, apart, directory)
    chosen = pointed_out(motion)
    view = View(motion)
    sides = (1e3 * view.low[0], 1e3 * view.high[0], 1e3 * view.low[1], 1e3 * view.high[1])
    decimals = 2 if apart is None or apart >= 0.1 else 4
    figure, panels = _panels(len(frames), sides[1] - sides[0], sides[3] - sides[2])
    for panel, frame in zip(panels, frames, strict=True):
        panel.imshow(view.picture(frame, chosen(frame)), extent=sides, interpolation="antialiased")
        panel.set_title(f"{motion.time[frame]:.{decimals}f} s", fontsize=10)
        panel.set_xlabel(f"{view.axes[0]} (mm)")
        panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
        panel.spines["right"].set_visible(motion.case.boundary.closed)  # as the left one, a wall
        panel.grid(visible=False)
        foremost = panel.get_position().x0 == panels[0].get_position().x0
        panel.tick_params(labelleft=foremost)
        panel.set_ylabel(f"{view.axes[1]} (mm)" if foremost else "")
    view.close()
    return save_figure(figure, path, [directory.name])


def _panels(count: int, wide: float, tall: float) -> tuple[Figure, list[Axes]]:
    """A figure with so many axes of one shape, given in mm, in as many rows as make them largest.

    Their places are reckoned here: no layout of matplotlib's knows how large axes of a fixed aspect will be.
    """
    aspired = max(_PANEL[0] / wide, _PANEL[1] / tall)

    def inches(rows: int) -> float:
        """To a millimetre."""
        across, up = ((whole - edge) for whole, edge in zip(_PAGE, _EDGES, strict=True))
        return min(aspired, (across / ceil(count / rows) - _BESIDE) / wide, (up / rows - _BENEATH) / tall)

    rows = max(range(1, count + 1), key=lambda rows: (inches(rows), -rows))
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
    start = motion.first_driven
    return [int(frame) for frame in np.unique(np.linspace(start, len(motion.time) - 1, images).round().astype(int))]


def _frames_apart(motion: Motion, images: int, apart: float, directory: Path) -> list[int]:
    """The last frames of a run that are so many seconds apart, to a tenth of that."""
    last = len(motion.time) - 1
    between = motion.case.run.steps_per_sample * motion.case.run.time_step
    every = round(apart / between)
    if not every or abs(every * between / apart - 1.0) > _TOLERANCE:
        told = f"{apart:.4g} s between pictures: expected a multiple of the {between:.4g} s between frames"
        raise InputError(str(directory), [Problem("", None, told)])
    if every > last - motion.first_driven:
        told = f"{apart:.4g} s between pictures: expected less than the {max(motion.time[-1], 0.0):.3g} s of the drive"
        raise InputError(str(directory), [Problem("", None, told)])
    return list(range(last, motion.first_driven - 1, -every))[:images][::-1]


def seconds_apart(text: str, directory: Path) -> float:
    """Read a time between pictures: a duration, or a part or multiple of the drive's cycle such as ``T/4`` or ``2 T``.

    Raises
    ------
    InputError
        If the text is neither.
    """
    cycles = re.fullmatch(r"(?P<many>[\d.]*)\s*T\s*(/\s*(?P<parts>\d+))?", text.strip())
    try:
        if cycles:
            frequency = case_of(directory).drive.frequency
            seconds = float(cycles["many"] or 1) / int(cycles["parts"] or 1) / frequency
        else:
            seconds = parse_quantity(text, DURATION)
        if seconds > 0.0:
            return seconds
    except (ValueError, ZeroDivisionError):
        pass
    raise InputError("--interval", [Problem("", None, f'{text!r}: expected a time such as "2 s", or "T/4" of a cycle')])
