"""Pictures of a run at several times, drawn side by side as one figure.

Containers are seen from the side in perspective, planes and trays along their normal; on a tilted
plane, up in the picture is uphill. The view follows a walker that walks far. An arrow with two
heads shows the direction of the drive. Films are made in
`walkers.postprocess.show.films`.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import check_limits
from walkers.postprocess.measure.caption import drive_description
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.show.camera import (
    ANGLE_OF_VIEW,
    from_the_side,
    named_direction,
    oblique_axes,
    plan_axes,
)
from walkers.postprocess.show.drawing import (
    check_place,
    new_figure,
    plain_text,
    save_figure,
    styled,
)
from walkers.postprocess.show.marks import draw_drive, draw_scale_bar, seen_directions
from walkers.postprocess.show.meshes import round_below
from walkers.postprocess.show.necks import NECK_LEGEND, bridges_at
from walkers.postprocess.show.scene import Scene, gathered, motion_in_view
from walkers.postprocess.show.window import Window

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SERIES_NAME = "series.png"
"""Name of the pictures of all beads."""
PICTURE_NAME = "walker.png"
"""Name of the pictures of one walker."""
MOST_PICTURES = 6
"""Largest number of pictures unless the user gives another."""

# --- resolution of a view, pixels ---
_LEAST_RESOLUTION = 40.0
"""Smallest resolution, pixels per mm, unless the view becomes too large."""
_USUAL_HEIGHT = 1000
"""Height of a view, pixels."""
_LARGEST_HEIGHT = 1600
"""Largest height of a view, pixels, which views of tall containers need."""
_LARGEST_WIDTH = 1900
"""Largest width of a view, pixels."""

# --- sizes on paper, inches ---
_PAGE_WIDTH = 8.0
"""Largest width of all views with the space beside them, inches."""
_PAGE_HEIGHT = 10.0
"""Largest height of all views with the space below them, inches."""
_VIEW_WIDTH = 1.4
"""Width of a view, inches, unless `_VIEW_HEIGHT` makes it larger or the page smaller."""
_VIEW_HEIGHT = 5.0
"""Height of a view, inches, unless `_VIEW_WIDTH` makes it larger or the page smaller."""
_SPACE_BESIDE = 0.25
"""Space beside a view, inches."""
_SPACE_BELOW = 0.75
"""Space below a view, inches: tick labels, and the title of the next view."""
_SPACE_OF_LABELS = 0.8
"""Space of the labels at the left of all views, inches."""
_LINE_HEIGHT = 0.2
"""Height of a line of the heading, inches."""
_LETTERS_PER_INCH = 13.0
"""Letters of the heading per inch of the width of the figure."""
_FIGURE_MARGIN = 0.15
"""Space around the finished figure, inches, both sides together."""

# --- marks ---
_MARK_MARGIN = 0.05
"""Distance of marks from the edges of a view, over its smaller side."""
_HALF_ARROW = 0.12
"""Half of the length of the arrow of the drive, over the smaller side of the view."""
_LABEL_SIZE = 9.0
"""Size of the text of a scale bar, points."""
_LARGEST_BAR = 0.4
"""Largest length of a scale bar over the width of the view."""

# --- the view ---
_EXTENT_FROM_ABOVE = 1.1
"""Extent of a view from above over the extent of the beads."""
_LARGEST_ASPECT = 6.0
"""Largest width over height of a view that does not follow the beads."""


@styled
def render_series(
    directory: Path,
    destination: Path | None = None,
    *,
    images: int = MOST_PICTURES,
    walker: int | None = None,
) -> list[Path]:
    """Render views of a run in rows, with times and scales.

    Walkers, climbers and liquid bridges are coloured.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG; None: ``series.png``, or ``walker.png`` of one walker, in the run directory.
    images
        Largest number of pictures, from 1 to 20, evenly spaced through the drive; fewer if the last
        picture is then closer to the end of the drive.
    walker
        Number of a walker to show by itself; None: the first of independent walkers, otherwise all
        beads.

    Returns
    -------
    list of Path
        The file.

    Raises
    ------
    InputError
        If the destination is no PNG, ``images`` is out of its range, or the run has no walker with
        this number.
    """
    check_limits("images", images, 1, 20, whole=True)
    check_limits("walker", walker, whole=True)
    if destination is not None:
        check_place(destination, ".png")
    motion, is_single = motion_in_view(read_motion(directory), walker)
    frames = even_frames(motion, images)
    if is_single:
        path = destination or directory / PICTURE_NAME
        motion = gathered(motion)
    else:
        path = destination or directory / SERIES_NAME
    figure = _series_figure(motion, frames, follow=is_single)
    return save_figure(figure, path, [directory.name])


def even_frames(motion: Motion, count: int) -> list[int]:
    """Evenly spaced frames from the first frame of the drive.

    If there are enough cycles, all frames have the same phase; otherwise walkers would appear to
    move backward.

    Parameters
    ----------
    motion
        The motion.
    count
        Number of frames; there are fewer if the last one is then closer to the end.
    """
    start = motion.first_driven
    last = len(motion.time) - 1 - start
    unit = 1
    if last // motion.case.run.samples_per_cycle >= count - 1:
        unit = motion.case.run.samples_per_cycle
    steps, step = _even_steps(last // unit, count - 1)
    return [start + unit * step * number for number in range(steps + 1)]


def _even_steps(length: int, most: int) -> tuple[int, int]:
    """Number and size of the equal steps, at most ``most``, that cover the most of a length."""
    most = min(most, length)
    if most == 0:
        return 0, 0
    shorter = length // most
    longer = ceil(length / most)
    steps_of_longer = min(most, length // longer)
    if longer * steps_of_longer > shorter * most:
        return steps_of_longer, longer
    return most, shorter


def even_labels(time: FloatArray) -> list[str]:
    """Evenly spaced times (s) as text with the required number of decimals."""
    interval = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    decimals = 2
    while decimals < 6 and abs(round(interval, decimals) - interval) > 0.01 * interval:
        decimals += 1
    return [f"{moment:.{decimals}f} s" for moment in time]


@dataclass(frozen=True)
class _Labels:
    """Texts of a series: lines above it, the title of each view, and labels of the axes."""

    heading: list[str]
    titles: list[str]
    x: str
    y: str


@dataclass(frozen=True)
class _Layout:
    """Views of one size (mm) in rows and columns.

    Attributes
    ----------
    count
        Number of views.
    columns
        Number of columns.
    width, height
        Extent of a view, mm.
    """

    count: int
    columns: int
    width: float
    height: float

    @property
    def rows(self) -> int:
        """Number of rows."""
        return ceil(self.count / self.columns)

    @property
    def scale(self) -> float:
        """Scale of the views, inches per mm."""
        usual = max(_VIEW_WIDTH / self.width, _VIEW_HEIGHT / self.height)
        free_width = _PAGE_WIDTH / self.columns - _SPACE_BESIDE
        free_height = _PAGE_HEIGHT / self.rows - _SPACE_BELOW
        return min(usual, free_width / self.width, free_height / self.height)

    @property
    def figure_width(self) -> float:
        """Width of the figure, inches."""
        return self.columns * (self.scale * self.width + _SPACE_BESIDE) + _SPACE_OF_LABELS

    @property
    def views_height(self) -> float:
        """Height of all views, inches."""
        return self.rows * (self.scale * self.height + _SPACE_BELOW)

    @property
    def view_pixels(self) -> tuple[int, int]:
        """Width and height of a view in pixels."""
        per_mm = min(_LEAST_RESOLUTION, _LARGEST_HEIGHT / self.height)
        per_mm = max(per_mm, _USUAL_HEIGHT / self.height)
        per_mm = min(per_mm, _LARGEST_WIDTH / self.width)
        return max(1, round(self.width * per_mm)), max(1, round(self.height * per_mm))

    def is_left(self, number: int) -> bool:
        """Whether a view is in the first column."""
        return number % self.columns == 0

    def is_lowest(self, number: int) -> bool:
        """Whether a view has no other view below it."""
        return number + self.columns >= self.count


def _series_figure(motion: Motion, frames: Sequence[int], *, follow: bool) -> Figure:
    """Pictures of frames with axes in mm; the view may ``follow`` the beads.

    Views that follow the beads have axes of their own: they stand below each other if they are
    wide, beside each other if they are high.
    """
    scene = _scene_of(motion, follow=follow)
    width, height = (scene.high - scene.low)[:2].tolist()  # mm
    if not follow:
        layout = _largest_layout(len(frames), width, height)
    elif width >= height:
        layout = _Layout(len(frames), 1, width, height)
    else:
        layout = _Layout(len(frames), len(frames), width, height)
    return _draw(scene, frames, _labels_of(scene, frames), layout)


def _scene_of(motion: Motion, *, follow: bool) -> Scene:
    """The view of a series: from the side with z up, or along the normal of the floor."""
    driven = slice(motion.first_driven, None)
    if from_the_side(motion.case):
        scene = Scene.around(motion, oblique_axes(motion), 1.0, driven, shaken=False)
        scene = replace(scene.with_walls(driven), angle_of_view=ANGLE_OF_VIEW)
        extent_factor = 1.0
    else:
        axes = plan_axes(motion, np.array([1.0, 0.0, 0.0]))
        extent_factor = _EXTENT_FROM_ABOVE
        scene = Scene.around(motion, axes, extent_factor, driven, shaken=False)
    if follow:
        scene = scene.following(_LARGEST_ASPECT, extent_factor, driven)
    return scene


def _largest_layout(count: int, width: float, height: float) -> _Layout:
    """The number of columns with which views (width and height in mm) are largest.

    A row that is not full counts as if the views were smaller.
    """
    layouts = [_Layout(count, columns, width, height) for columns in range(1, count + 1)]

    def priority(layout: _Layout) -> tuple[float, int]:
        places = layout.rows * layout.columns
        return layout.scale * count / places, layout.columns

    return max(layouts, key=priority)


def _labels_of(scene: Scene, frames: Sequence[int]) -> _Labels:
    """Texts of the views of frames; if the view follows the beads, with their displacement."""
    case = scene.motion.case
    titles = even_labels(scene.motion.time[frames])
    x, y = _axis_labels(scene)
    remarks = []
    if case.boundary.tilted:
        remarks.append(case.boundary.tilted)
    if scene.camera_path is not None:
        toward, direction = named_direction(scene.motion)
        remarks.append(f"the view follows the beads, displacement {direction} below the time")
        for number, frame in enumerate(frames):
            titles[number] += f"\n{scene.camera_displacement(frame) @ toward:z.1f} mm"
    remarks += [*scene.colour_legend, NECK_LEGEND]
    if seen_directions(case, scene.axes):
        remarks.append(f"arrow: {drive_description(case)}")
    return _Labels([case.title or case.name, ", ".join(remarks)], titles, x, y)


def _axis_labels(scene: Scene) -> tuple[str, str]:
    """Labels of the axes of a view that is at rest; empty for a view without axes.

    In perspective, and in a view that follows the beads, a scale bar tells lengths.
    """
    if scene.angle_of_view or scene.camera_path is not None:
        return "", ""
    if scene.motion.case.boundary.tilted:
        return "across the slope (mm)", "uphill (mm)"
    return "x (mm)", "y (mm)"


def _draw(scene: Scene, frames: Sequence[int], labels: _Labels, layout: _Layout) -> Figure:
    """Render the frames of a scene, and draw them into the panels of a figure."""
    heading: list[str] = []
    for text in labels.heading:
        heading += wrap(plain_text(text), round(_LETTERS_PER_INCH * layout.figure_width))
    height = layout.views_height + _LINE_HEIGHT * len(heading)
    figure = new_figure(layout.figure_width, height)
    panels = figure.subplots(layout.rows, layout.columns, sharex=True, sharey=True, squeeze=False)
    figure.set_layout_engine("compressed")
    figure.suptitle("\n".join(heading), fontsize=10)
    extent = np.stack([scene.low, scene.high], axis=1)[:2].ravel().tolist()
    bridges = bridges_at(scene.motion, frames)
    with closing(Window(scene, layout.view_pixels, occlusion=bool(scene.angle_of_view))) as window:
        for number, frame in enumerate(frames):
            panel = panels.flat[number]
            picture = window.picture(frame, bridges[number])
            panel.imshow(picture, extent=extent, interpolation="antialiased")
            panel.set_title(labels.titles[number], fontsize=10)
            if labels.x:
                left_label = labels.y if layout.is_left(number) else None
                lower_label = labels.x if layout.is_lowest(number) else None
                _draw_scales(panel, left_label, lower_label)
            else:
                panel.set_axis_off()
    _draw_marks(panels.flat[0], scene, has_bar=not labels.x)
    for panel in panels.flat[len(frames) :]:
        panel.remove()
    figure.draw_without_rendering()
    box = figure.get_tightbbox()
    figure.set_size_inches(box.width + _FIGURE_MARGIN, box.height + _FIGURE_MARGIN)
    return figure


def _draw_marks(panel: Axes, scene: Scene, *, has_bar: bool) -> None:
    """Draw the directions of the drive, and a scale bar, at the edges of the first view.

    In perspective, the bar has its length in the middle of the view.
    """
    low = scene.low[:2]
    high = scene.high[:2]
    extent = high - low
    margin = _MARK_MARGIN * float(extent.min())
    half_length = _HALF_ARROW * float(extent.min())
    directions = seen_directions(scene.motion.case, scene.axes)
    if directions:
        reach = half_length * np.abs(directions).max(axis=0)
        middle = np.array([low[0] + margin + reach[0], high[1] - margin - reach[1]])
        draw_drive(panel, directions, middle, half_length)
    if not has_bar:
        return
    length = round_below(_LARGEST_BAR * float(extent[0]))
    drawn = length * scene.shortening
    place = (float(high[0]) - margin, float(low[1]) + margin)
    draw_scale_bar(panel, place, drawn, f"{length:g} mm", _LABEL_SIZE)


def _draw_scales(panel: Axes, left_label: str | None, lower_label: str | None) -> None:
    """Draw the scales of a view at its left and below it; None: no scale on that side."""
    has_left = left_label is not None
    has_lower = lower_label is not None
    panel.grid(visible=False)
    panel.tick_params(
        left=has_left, labelleft=has_left, bottom=has_lower, labelbottom=has_lower, labelsize=9
    )
    panel.set_xlabel(lower_label or "", fontsize=10)
    panel.set_ylabel(left_label or "", fontsize=10)
    panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
