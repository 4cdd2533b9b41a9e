"""Interactive 3-D player of the beads of a run: a K3D plot for reports and notebooks.

Lengths are in mm, in the frame of the boundary; the view follows a walker with a long path.
Two-coloured balls show how beads roll, unless the frames are too far apart
(`walkers.postprocess.show.scene.orientations_of`). The page around the plot, and the controls that
play it, are in ``page.py`` and ``player.js``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, radians, tan
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.extras import require
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.show.camera import (
    against_gravity,
    axes_toward,
    camera_axes,
    from_the_side,
)
from walkers.postprocess.show.meshes import (
    beach_ball,
    floor_lines,
    mesh_of,
    round_below,
    walls_of,
)
from walkers.postprocess.show.necks import (
    NECK_COLOUR,
    NECK_OPACITY,
    NeckGrid,
    at_front_walls,
    bridge_ends,
    bridges_at,
    bridges_text,
    drawn_share,
    neck_surfaces,
    neck_triangles,
)
from walkers.postprocess.show.scene import Scene, gathered

if TYPE_CHECKING:
    import k3d

MOST_PLACES = 8000
"""Largest number of beads times frames in a plot, which limits its file size."""
_FLOOR = 0xDFE5E8
"""Colour of the boundary: red, green, blue."""
_LINES = 0x9AA6AE
"""Colour of lines on a floor: red, green, blue."""
_WALL_OPACITY = 0.12
"""Opacity of side walls."""
_BELOW = 2e-3
"""Depth of the drawn floor below beads that touch it, mm."""
_EXTENT_FACTOR = 1.15
"""Extent of the view over that of the beads."""
_ANGLE_OF_VIEW = 30.0
"""Angle of view, degrees."""
_ASPECT = 1.5
"""Smallest ratio of width to height of the picture."""
_MOST_LINES = 200.0
"""Largest number of lines on a floor."""
_BALL_CELLS = 48
"""Cells around a ball, a multiple of six."""
_LANE = 1.25
"""Distance of the lanes of independent walkers, in lengths of a walker."""
_PLAYING_TIME = 12.0
"""Time in which K3D's own player plays the run, s."""
_GRID = 2.0**-13
"""Positions are rounded to this (mm, about 0.1 µm); multiples of a power of two can be packed."""
_COARSE_GRID = 8.0 * _GRID
"""Positions of the beads of piles, which are many, are rounded to this, mm."""


@dataclass(frozen=True)
class _NeckDetail:
    """How finely a number of necks is drawn, which limits the file size.

    Attributes
    ----------
    necks
        There are fewer contacts times frames than this.
    grid
        Rings and sides of a neck.
    """

    necks: float
    grid: NeckGrid


_NECK_DETAILS = (
    _NeckDetail(2000, NeckGrid(5, 32)),
    _NeckDetail(10_000, NeckGrid(3, 12)),
    _NeckDetail(np.inf, NeckGrid(2, 6)),
)
"""From few necks to many."""


def player_of(
    motion: Motion, *, places: int = MOST_PLACES, height: int = 480
) -> tuple[k3d.Plot, list[float], list[str]]:
    """Make the plot of a motion.

    Parameters
    ----------
    motion
        The motion. The plot shows its drive, not the settling before it.
    places
        Largest number of beads times frames; frames are left out evenly.
    height
        Height of the plot in pixels.

    Returns
    -------
    plot
        The plot, a widget in notebooks.
    ends
        Its first and last time, s.
    captions
        Sentences that say what the plot shows.
    """
    require("report")
    import k3d

    motion, captions = _first_of_each_kind(motion.driven)
    stride = _stride(motion, places)
    if stride > 1:
        captions.append(_stride_caption(stride, motion.case.run.samples_per_cycle))
    captions.append(f"{bridges_text(motion.case).capitalize()}.")
    motion = gathered(motion, lane=_LANE)
    scene = Scene.around(motion, camera_axes(motion), _EXTENT_FACTOR, shaken=False)
    scene = replace(scene, rolling=True).following(_ASPECT, _EXTENT_FACTOR)
    shown = motion.select(slice(None, None, stride))
    path = None
    if scene.camera_path is not None:
        path = scene.camera_path[::stride]
        shown = replace(shown, position=shown.position - 1e-3 * path[:, None])
        captions.append("The view follows the beads.")
    if scene.orientations is None:
        captions.append(
            "The rolling of the beads is not shown: the frames are too far apart in time."
        )
    boundary = motion.case.boundary
    if boundary.tilted and motion.case.environment.gravity:
        captions.append(f"{boundary.tilted.capitalize()}; gravity points down at first.")

    plot = k3d.plot(
        height=height,
        name=motion.case.name,
        fps=30.0,
        camera_fov=_ANGLE_OF_VIEW,
        camera_auto_fit=False,
        grid_visible=False,
        axes=["x", "y", "z"],
        background_color=0xFFFFFF,
    )
    walls = _walls(motion, round_below(scene.height(_ASPECT) / 5.0))
    if path is not None:
        _move_back(walls, shown, path)
    bridges = bridges_at(motion, np.arange(0, len(motion.time), stride))
    toward = _axes_of_camera(motion)[2]
    necks = _necks(shown, motion.position[::stride], bridges, path, toward)
    for part in [*walls, *_beads(scene, shown, stride), *necks]:
        plot += part
    plot.fps_meter = False
    plot.camera = camera_of(motion, scene.camera_path)
    start, end = shown.time[[0, -1]].tolist()
    plot.time = start
    plot.time_speed = (end - start) / _PLAYING_TIME or 1.0
    return plot, [start, end], captions


def camera_of(motion: Motion, path: FloatArray | None = None) -> list[float]:
    """A camera that sees everything, with gravity downward.

    Parameters
    ----------
    motion
        The motion, of F frames.
    path : ndarray, shape (F, 3), or None
        What is subtracted from the positions of the beads, mm
        (`walkers.postprocess.show.scene.Scene`).

    Returns
    -------
    list of float
        Position and target, mm, and upward direction: nine numbers.
    """
    scene = Scene.around(motion, _axes_of_camera(motion), _EXTENT_FACTOR, shaken=False)
    if path is not None:
        scene = scene.on_path(path, _EXTENT_FACTOR)
    distance = scene.height(_ASPECT) / 2.0 / tan(radians(_ANGLE_OF_VIEW / 2.0))
    half_depth = float(scene.high[2] - scene.low[2]) / 2.0
    position, target, up = scene.camera(distance + half_depth)
    return [*position.tolist(), *target.tolist(), *up.tolist()]


def _axes_of_camera(motion: Motion) -> FloatArray:
    """The axes of the picture that the camera sees at first (`axes_toward`)."""
    toward = camera_axes(motion)[2]
    # Containers are seen obliquely, so that their depth is visible.
    if from_the_side(motion.case):
        toward = np.array([-0.25, -1.0, 0.2])
    elif motion.case.boundary.closed:
        toward = np.array([-0.25, -1.0, 2.0])
    return axes_toward(toward, against_gravity(motion))


def _first_of_each_kind(motion: Motion) -> tuple[Motion, list[str]]:
    """The first of the independent walkers of each kind, with a caption if there are others.

    All other motions are returned unchanged.
    """
    if not motion.case.apart:
        return motion, []
    firsts = {walker.kind: walker for walker in reversed(motion.walkers)}
    shown = motion.of_walkers(sorted(firsts.values(), key=lambda walker: walker.walker))
    count = len(motion.walkers)
    if len(firsts) == count:
        return shown, []
    of_each_kind = "" if len(firsts) == 1 else " of each kind"
    caption = f"The view shows the first walker{of_each_kind}; the run has {count} walkers."
    return shown, [caption]


def _stride(motion: Motion, places: int) -> int:
    """Every how many frames one is shown, so that there are few enough beads times frames.

    A stride that divides a cycle, or is a multiple of one, gives the same phases in each cycle.
    """
    samples = motion.case.run.samples_per_cycle
    smallest = ceil(len(motion.time) * len(motion.radius) / places)
    for stride in range(smallest, samples + 1):
        if samples % stride == 0:
            return stride
    return ceil(smallest / samples) * samples


def _stride_caption(stride: int, samples: int) -> str:
    """Which of the frames of the cycles, with a number of samples each, are shown."""
    count = max(samples // stride, 1)
    cycles = "each cycle" if stride <= samples else f"{stride // samples} cycles"
    return f"Recorded frames shown: {count} in {cycles}, with interpolated frames between them."


def _beads(scene: Scene, shown: Motion, stride: int) -> list[Any]:
    """The beads: balls that roll, or points if their orientations are unknown.

    Parameters
    ----------
    scene
        The scene, with all frames.
    shown
        The motion as the plot shows it: every ``stride``-th frame, relative to the camera.
    stride
        Every how many frames one is shown.
    """
    highlighted = np.any(scene.highlighted[::stride], axis=0)
    colours = scene.colours(highlighted).round() @ [0x10000, 0x100, 1]
    if scene.orientations is None:
        return [_points(shown, colours[0])]
    return _balls(shown, scene.orientations[::stride], colours)


def _balls(motion: Motion, orientations: FloatArray, colours: FloatArray) -> list[Any]:
    """A ball per bead with a time series of matrices, which K3D interpolates.

    Parameters
    ----------
    motion
        The motion, of F frames of N beads.
    orientations : ndarray, shape (F, N, 4)
        Quaternions of the beads.
    colours : ndarray, shape (2, N)
        Colours of the dark and of the pale lunes, as packed red, green, blue.
    """
    import k3d
    from scipy.spatial.transform import Rotation

    points, triangles, shade = beach_ball(_BALL_CELLS, motion)
    unit = points.astype(np.float32)
    balls = []
    for bead, radius in enumerate(motion.radius * 1e3):
        rotations = Rotation.from_quat(orientations[:, bead]).as_matrix()
        matrices = np.tile(np.eye(4), (len(motion.time), 1, 1))
        matrices[:, :3, :3] = _rounded(rotations * radius)
        matrices[:, :3, 3] = _rounded(motion.position[:, bead] * 1e3)
        ball = k3d.mesh(
            unit,
            triangles.astype(np.uint32),
            normals=unit,
            name=f"bead {bead}",
            colors=colours[shade, bead].astype(np.uint32),
            flat_shading=False,
            roughness=0.6,
        )
        ball.model_matrix = _series(motion, matrices)
        balls.append(ball)
    return balls


def _points(motion: Motion, colours: FloatArray) -> Any:
    """All beads as one object of spheres of one colour each (packed red, green, blue)."""
    import k3d

    diameters = (2e3 * motion.radius).astype(np.float32)
    points = k3d.points(
        np.zeros((len(diameters), 3), dtype=np.float32),
        point_sizes=diameters,
        colors=colours.astype(np.uint32),
        shader="3d",
        roughness=0.5,
        name="beads",
    )
    points.positions = _series(motion, _rounded(motion.position * 1e3, _COARSE_GRID))
    return points


def _necks(
    motion: Motion,
    position: FloatArray,
    bridges: list[IntArray],
    path: FloatArray | None,
    toward: FloatArray,
) -> list[Any]:
    """The necks of all bridges as one mesh with a time series of its points.

    A bridge that is not there has no width; its neck grows and vanishes in place. Bridges to walls
    in front of the beads, as the camera first sees them, have no width either.

    Parameters
    ----------
    motion
        The motion as the plot shows it, of F frames of N beads.
    position : ndarray, shape (F, N, 3)
        Centres of the beads relative to the boundary, m.
    bridges : list of ndarray, each of shape (K, 3)
        Contacts of the bridges of each frame.
    path : ndarray, shape (F, 3), or None
        Displacement of the camera, mm.
    toward : ndarray, shape (3,)
        Unit vector toward the camera at first.

    Returns
    -------
    list
        The mesh; empty if there are no bridges.
    """
    import k3d

    contacts, is_bridged = _all_contacts(bridges)
    if not len(contacts):
        return []
    grid = next(detail.grid for detail in _NECK_DETAILS if is_bridged.size < detail.necks)
    points = np.zeros((len(bridges), len(contacts), grid.rings * grid.sides, 3))
    for frame in range(len(bridges)):
        # Of bridges that form or rupture, the necks without width, too.
        neighbours = is_bridged[max(frame - 1, 0) : frame + 2]
        drawn_contacts = np.flatnonzero(neighbours.any(axis=0))
        ends = bridge_ends(motion, position[frame], contacts[drawn_contacts])
        is_hidden = at_front_walls(motion, contacts[drawn_contacts], ends, toward)
        width = drawn_share(grid) * (is_bridged[frame, drawn_contacts] & ~is_hidden)
        necks, _ = neck_surfaces(motion, contacts[drawn_contacts], ends, grid, width)
        points[frame, drawn_contacts] = necks if path is None else necks - path[frame]
    course = _rounded(points.reshape(len(bridges), -1, 3))
    mesh = k3d.mesh(
        points[0].reshape(-1, 3).astype(np.float32),
        neck_triangles(len(contacts), grid).astype(np.uint32),
        color=NECK_COLOUR,
        opacity=NECK_OPACITY,
        flat_shading=False,
        name="bridges",
    )
    mesh.vertices = _series(motion, course)
    return [mesh]


def _all_contacts(bridges: list[IntArray]) -> tuple[IntArray, BoolArray]:
    """All contacts that have a bridge at some time, and when.

    Parameters
    ----------
    bridges : list of ndarray, each of shape (K, 3)
        Contacts of the bridges of F frames.

    Returns
    -------
    contacts : ndarray of int, shape (C, 3)
        Each contact once.
    is_bridged : ndarray of bool, shape (F, C)
        Whether the contact has a bridge in the frame.
    """
    contacts, number = np.unique(np.concatenate(bridges), axis=0, return_inverse=True)
    frame = np.repeat(np.arange(len(bridges)), [len(in_frame) for in_frame in bridges])
    is_bridged = np.zeros((len(bridges), len(contacts)), dtype=bool)
    is_bridged[frame, number.ravel()] = True
    return contacts, is_bridged


def _walls(motion: Motion, step: float) -> list[Any]:
    """The boundary, with transparent side walls, and lines on an open floor.

    Parameters
    ----------
    motion
        The motion.
    step
        Distance of the lines, mm, unless there are then too many.
    """
    level = []
    upright = []
    for corners in walls_of(motion):
        face = 1e3 * corners
        if np.ptp(face[:, 2]) < 1e-6:
            level.append(face)
        else:
            upright.append(face)
    parts = []
    if level:
        parts.append(_wall("floor", level, 1.0, _BELOW))
    if upright:
        parts.append(_wall("wall", upright, _WALL_OPACITY, 0.0))
    if motion.case.boundary.is_open_floor:
        parts.append(_floor_lines(level[0], step))
    return parts


def _wall(name: str, faces: list[FloatArray], opacity: float, below: float) -> Any:
    """Faces (corners in mm) as one mesh, drawn by a distance (mm) below their places."""
    import k3d

    mesh = mesh_of(faces).triangulate()
    points = np.asarray(mesh.points - [0.0, 0.0, below], dtype=np.float32)
    return k3d.mesh(
        points,
        mesh.regular_faces.astype(np.uint32),
        opacity=opacity,
        color=_FLOOR,
        side="double",
        roughness=1.0,
        name=name,
    )


def _floor_lines(floor: FloatArray, step: float) -> Any:
    """Lines on a floor (corners in mm) with a distance (mm), or a larger one if there are many."""
    import k3d

    low = floor.min(axis=0)
    high = floor.max(axis=0)
    step = max(step, round_below(float(np.ptp([low, high])) / _MOST_LINES))
    ends = floor_lines(low, high, step).astype(np.float32)
    pairs = np.arange(len(ends), dtype=np.uint32).reshape(-1, 2)
    return k3d.lines(
        ends,
        pairs,
        indices_type="segment",
        shader="simple",
        color=_LINES,
        name=f"every {step:g} mm",
    )


def _move_back(parts: list[Any], motion: Motion, path: FloatArray) -> None:
    """Move parts against the path (F, 3) of the camera, mm, which is at rest in the plot."""
    matrices = np.tile(np.eye(4), (len(path), 1, 1))
    matrices[:, :3, 3] = _rounded(-path)
    for part in parts:
        part.model_matrix = _series(motion, matrices)


def _rounded(values: FloatArray, grid: float = _GRID) -> FloatArray:
    """Values rounded to multiples of a grid."""
    rounded: FloatArray = np.round(values / grid) * grid
    return rounded


def _series(motion: Motion, values: FloatArray) -> dict[str, Any]:
    """Values of all frames as a time series of K3D: arrays by their times as text."""
    packed = values.astype(np.float32)
    return {f"{time:.6f}": value for time, value in zip(motion.time, packed, strict=True)}
