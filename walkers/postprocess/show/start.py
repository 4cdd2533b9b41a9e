"""Picture of the start of a case, before any run: beads, walls, axes and direction of the drive.

The places of the beads are those of the deck (`walkers.templates.placement`). Runs are drawn in
`walkers.postprocess.show.series`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from math import cos, radians, sin
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import check_limits
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import AXES
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.show.camera import (
    against_gravity,
    axes_toward,
    camera_axes,
    from_above,
)
from walkers.postprocess.show.drawing import (
    check_place,
    new_figure,
    plain_text,
    save_figure,
    styled,
)
from walkers.postprocess.show.marks import (
    DRIVE_COLOUR,
    draw_drive,
    draw_scale_bar,
    drive_directions,
)
from walkers.postprocess.show.meshes import round_below, walls_of
from walkers.postprocess.show.scene import Scene, motion_in_view
from walkers.postprocess.show.window import Window
from walkers.templates.placement import place

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NOTHING_HAS_RUN = "nothing has run yet: this is the start"
"""What the heading of the picture says."""
_MOST_NAMED = 16
"""Largest number of walls that are named; the smaller ones have no names."""
_TOWARD_SIDE = (0.35, -1.0, 0.5)
"""Direction toward the camera in front of a container."""
_TOWARD_ABOVE = (0.35, -1.0, 2.0)
"""Direction toward the camera above a tray, on which walkers would hide one another."""
_TURN = radians(-20.0)
"""Angle about the normal of an open floor from the camera of films, so that no axes coincide."""
_LEAST_ASPECT = 0.6
"""Smallest width over height of the view, which has room for the arrows."""
_MARGIN = 0.12
"""Space around what is shown, over the larger side of the view."""
_ARROW = 0.09
"""Length of the arrows of the axes, over the larger side of the view."""
_PAGE = (7.0, 8.0)
"""Largest width and height of the view, inches."""
_PIXELS_PER_INCH = 200
"""Resolution of the view."""
_LETTERS_PER_INCH = 13.0
"""Letters of the heading per inch of the width of the figure."""
_LINE_HEIGHT = 0.2
"""Height of a line of the heading, inches."""
_LEAST_WIDTH = 4.0
"""Smallest width of the figure, inches, for the heading."""
_TEXT: Mapping[str, Any] = {"fontsize": 9, "ha": "center", "va": "center"}
"""The look of names in the picture."""
_FRONT_COLOUR = "#8c9aa5"
"""Colour of the names of walls in front, which are not drawn."""


@dataclass(frozen=True)
class NamedWall:
    """A wall of a picture with its name.

    Attributes
    ----------
    name
        Its name, as in tables and messages.
    middle : ndarray, shape (3,)
        A point in its middle, m.
    normal : ndarray, shape (3,)
        Unit normal there, toward the beads.
    area
        Its area in the picture, m².
    """

    name: str
    middle: FloatArray
    normal: FloatArray
    area: float


def motion_at_start(case: Case) -> Motion:
    """The beads of a case at the start, as a motion of one frame that no run has made."""
    bodies, placed_walkers = place((case,))
    walkers = []
    for walker in placed_walkers:
        beads_from_zero = tuple(bead - 1 for bead in walker.beads)
        walkers.append(replace(walker, beads=beads_from_zero))
    position = np.array([[bead.centre for bead in bodies.beads]])
    return Motion(
        case=case,
        time=np.zeros(1),
        position=position,
        velocity=np.zeros_like(position),
        spin=np.zeros_like(position),
        substrate=np.zeros((1, 3)),
        radius=np.array([bead.radius for bead in bodies.beads]),
        walkers=tuple(walkers),
        frames=[(Path(), 0)],
        truncated=False,
    )


@styled
def render_start(case: Case, destination: Path, *, walker: int | None = None) -> list[Path]:
    """Draw the start of a case: beads, walls with their names, axes, drive and scale.

    Parameters
    ----------
    case
        The case.
    destination
        The PNG.
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
        If the destination is no PNG, or the case has no walker with this number.
    """
    check_limits("walker", walker, whole=True)
    check_place(destination, ".png")
    motion, is_single = motion_in_view(motion_at_start(case), walker)
    heading = [case.title or case.name, NOTHING_HAS_RUN]
    count = len(motion.walkers)
    if is_single:
        heading.append(f"walker {motion.walkers[0].walker} by itself")
    elif count > 1:
        heading.append(f"{count} walkers")
    return save_figure(_figure(motion, heading), destination, [case.name])


def walls_by_size(motion: Motion) -> list[NamedWall]:
    """The walls that a picture shows, with their names, the largest first."""
    polygons_of_walls: dict[int, list[FloatArray]] = {}
    walls = motion.case.boundary.walls
    for corners in walls_of(motion):
        if _area_vector(corners).any():
            polygons_of_walls.setdefault(_wall_of(corners, motion), []).append(corners)
    named = []
    for number, polygons in polygons_of_walls.items():
        vectors = np.array([_area_vector(corners) for corners in polygons])
        areas = np.linalg.norm(vectors, axis=1)
        largest = int(areas.argmax())
        middles = np.array([corners.mean(axis=0) for corners in polygons])
        middle = areas @ middles / areas.sum()
        nearest = walls[number].nearest_points(middle[None])[0]
        if np.linalg.norm(nearest - middle) > 0.1 * np.sqrt(areas.sum()):
            middle = middles[largest]  # the wall is round, and its middle is not on it
        wall = NamedWall(
            name=walls[number].name,
            middle=middle,
            normal=vectors[largest] / areas[largest],
            area=float(areas.sum()),
        )
        named.append(wall)
    return sorted(named, key=lambda wall: wall.area, reverse=True)


def _area_vector(corners: FloatArray) -> FloatArray:
    """Area of a polygon times its unit normal toward the beads, m², shape (3,)."""
    from_first = corners[1:] - corners[0]
    area: FloatArray = np.cross(from_first[:-1], from_first[1:]).sum(axis=0) / 2.0
    return area


def _wall_of(corners: FloatArray, motion: Motion) -> int:
    """Index of the wall to which a polygon belongs: the one nearest to a place just before it."""
    vector = _area_vector(corners)
    before = 1e-3 * motion.radius.min() * vector / np.linalg.norm(vector)
    place_before = (corners.mean(axis=0) + before)[None]
    distances = [wall.distances(place_before)[0] for wall in motion.case.boundary.walls]
    return int(np.abs(distances).argmin())


def _scene(motion: Motion, named: Sequence[NamedWall]) -> Scene:
    """The view from a direction in which all axes and, of a container, all walls are seen."""
    if not motion.case.boundary.closed:
        turn = np.array([[cos(_TURN), -sin(_TURN), 0.0], [sin(_TURN), cos(_TURN), 0.0], [0, 0, 1]])
        axes = axes_toward(turn @ camera_axes(motion)[2], against_gravity(motion))
    elif from_above(motion.case):
        axes = axes_toward(np.array(_TOWARD_ABOVE), np.array([0.0, 0.0, 1.0]))
    else:
        axes = axes_toward(np.array(_TOWARD_SIDE), np.array([0.0, 0.0, 1.0]))
    scene = Scene.around(motion, axes, shaken=False)
    low, high = scene.low, scene.high
    if named:
        corners = 1e3 * np.concatenate(walls_of(motion)) @ axes.T
        low = np.minimum(low, corners.min(axis=0))
        high = np.maximum(high, corners.max(axis=0))
    margin = _MARGIN * (high - low)[:2].max()
    low = low - margin
    high = high + margin
    # Below what is shown, there is a strip for axes and scale.
    low[1] -= 2.0 * _ARROW * (high - low)[:2].max()
    missing_width = max(0.0, _LEAST_ASPECT * (high - low)[1] - (high - low)[0])
    low[0] -= missing_width / 2.0
    high[0] += missing_width / 2.0
    return replace(scene, low=low, high=high, has_tables=False)


def _figure(motion: Motion, heading: Sequence[str]) -> Figure:
    """The picture of a motion at its first frame, with names and arrows."""
    boundary = motion.case.boundary
    named = [] if boundary.is_open_floor else walls_by_size(motion)
    scene = _scene(motion, named)
    width, height = (scene.high - scene.low)[:2].tolist()  # mm
    scale = min(_PAGE[0] / width, _PAGE[1] / height)  # inches per mm
    toward = scene.axes[2]
    notes = []
    if boundary.tilted:
        notes.append(boundary.tilted)
    if len(named) > _MOST_NAMED:
        notes.append(f"names of the {_MOST_NAMED} largest of {len(named)} walls")
    if any(wall.normal @ toward < 0.0 for wall in named[:_MOST_NAMED]):
        notes.append("grey names: walls in front, which are not drawn")
    figure_width = max(_LEAST_WIDTH, scale * width)
    lines: list[str] = []
    for text in [*heading, *notes]:
        lines += wrap(plain_text(text), round(_LETTERS_PER_INCH * figure_width))
    figure = new_figure(figure_width, scale * height + _LINE_HEIGHT * (len(lines) + 1))
    figure.suptitle("\n".join(lines), fontsize=10)
    panel = figure.subplots()
    size = (round(_PIXELS_PER_INCH * scale * width), round(_PIXELS_PER_INCH * scale * height))
    with closing(Window(scene, size, occlusion=motion.case.loose)) as window:
        picture = window.picture(0)
    left, bottom, _ = scene.low.tolist()
    right, top, _ = scene.high.tolist()
    panel.imshow(picture, extent=(left, right, bottom, top), interpolation="antialiased")
    panel.set_axis_off()
    _draw_names(panel, scene, named[:_MOST_NAMED])
    _draw_axes(panel, scene)
    _draw_drive(panel, scene)
    _draw_scale(panel, scene)
    return figure


def _draw_names(panel: Axes, scene: Scene, named: Sequence[NamedWall]) -> None:
    """Write the name of each wall in its middle; grey for walls in front."""
    toward = scene.axes[2]
    paper = {"facecolor": "white", "alpha": 0.6, "linewidth": 0.0, "pad": 1.0}
    for wall in named:
        x, y, _ = 1e3 * wall.middle @ scene.axes.T
        colour = "black" if wall.normal @ toward >= 0.0 else _FRONT_COLOUR
        style: dict[str, Any] = {**_TEXT, "color": colour, "bbox": paper}
        panel.text(x, y, wall.name, **style)


def _draw_axes(panel: Axes, scene: Scene) -> None:
    """Draw the directions of the axes at the lower left, and gravity if the floor is tilted."""
    extent = (scene.high - scene.low)[:2].max()
    corner = scene.low[:2] + 1.3 * _ARROW * extent
    directions = {name: np.array(direction) for name, direction in AXES.items()}
    gravity = np.array(gravity_direction(scene.motion.case))
    if gravity[:2].any():
        directions["g"] = gravity
    for name, direction in directions.items():
        tip = corner + _ARROW * extent * (scene.axes @ direction)[:2]
        style = {"arrowstyle": "-|>", "color": "black", "shrinkA": 0.0, "shrinkB": 0.0}
        panel.annotate("", tip, corner, arrowprops=style)
        x, y = corner + 1.3 * (tip - corner)
        panel.text(x, y, name, **_TEXT)


def gravity_direction(case: Case) -> FloatArray:
    """Unit vector of gravity in the frame of the boundary; zero without gravity."""
    gravity = np.array(case.gravity_vector)
    strength = float(np.linalg.norm(gravity))
    return np.asarray(gravity / strength if strength else gravity)


def _draw_drive(panel: Axes, scene: Scene) -> None:
    """Draw an arrow with two heads for each direction of the drive, below the beads."""
    extent = (scene.high - scene.low)[:2].max()
    middle = np.array([(scene.low[0] + scene.high[0]) / 2.0, scene.low[1] + 1.3 * _ARROW * extent])
    directions = [(scene.axes @ axis)[:2] for axis in drive_directions(scene.motion.case)]
    draw_drive(panel, directions, middle, _ARROW * extent)
    lowest = 0.0
    for _, up in directions:
        lowest = max(lowest, abs(_ARROW * extent * up))
    text = "drive" if directions else "no drive"
    x, y = middle - [0.0, lowest + 0.25 * _ARROW * extent]
    panel.text(x, y, text, color=DRIVE_COLOUR, **_TEXT)


def _draw_scale(panel: Axes, scene: Scene) -> None:
    """Draw a scale of a round length at the lower right."""
    extent = (scene.high - scene.low)[:2].max()
    width = scene.high[0] - scene.low[0]
    right = scene.high[0] - 0.3 * _ARROW * extent
    level = scene.low[1] + 0.6 * _ARROW * extent
    length = round_below(0.25 * width)
    draw_scale_bar(panel, (right, level), length, f"{length:g} mm", _TEXT["fontsize"])
