"""Interactive 3-D player of the beads of a run: a K3D plot for reports and notebooks.

Lengths are in mm, in the frame of the boundary; the view follows a walker with a long path. Two-coloured balls show how
beads roll, unless the frames are too far apart (`walkers.postprocess.show.scene.orientations_of`).
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil, radians, tan
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.extras import require
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.show.camera import against_gravity, axes_toward, camera_axes, from_the_side
from walkers.postprocess.show.meshes import beach_ball, floor_lines, mesh_of, round_below, walls_of
from walkers.postprocess.show.necks import (
    NECK_COLOUR,
    NECK_OPACITY,
    at_front_walls,
    bridge_ends,
    bridges_at,
    bridges_text,
    neck_surfaces,
    neck_triangles,
)
from walkers.postprocess.show.scene import Scene, gathered

if TYPE_CHECKING:
    import k3d

MOST_PLACES = 8000
"""Largest number of beads times frames in a plot, which limits its file size."""
_FLOOR, _LINES = 0xDFE5E8, 0x9AA6AE
_AROUND = 1.15  # extent of the view over that of the beads
_VIEW, _ASPECT = 30.0, 1.5  # angle of view, degrees; smallest ratio of width to height
_MOST_LINES = 200.0  # largest number of lines on a floor
_NECKS = ((2000, (5, 16)), (10_000, (2, 12)), (np.inf, (2, 6)))
"""Rings and sides of necks for fewer contacts times frames, which limits the file size."""
_LANE = 1.25  # distance of the lanes of independent walkers, in lengths of a walker
_GRID = 2.0**-13
"""Positions are rounded to this (mm, about 0.1 µm); multiples of a power of two can be packed."""


def player_of(
    motion: Motion, *, places: int = MOST_PLACES, height: int = 480
) -> tuple[k3d.Plot, list[float], list[str]]:
    """The plot of a motion (a widget in notebooks), its first and last time (s), and captions; ``height`` is in pixels.

    ``places`` is the largest number of beads times frames; frames are left out evenly.
    """
    require("report")
    import k3d

    motion, stride, captions = _thinned(motion.driven, places)
    motion = gathered(motion, lane=_LANE)
    scene = Scene.around(
        motion, camera_axes(motion), _AROUND, shaken=False, rolling=True
    ).following(_ASPECT, _AROUND)
    shown, path = motion.select(slice(None, None, stride)), scene.camera_path
    bridges = bridges_at(motion, np.arange(0, len(motion.time), stride))
    captions.append(f"{bridges_text(motion.case).capitalize()}.")
    if path is not None:
        path = path[::stride]
        shown = replace(shown, position=shown.position - 1e-3 * path[:, None])
        captions.append("The view follows the beads.")
    colours = scene.colours(np.any(scene.highlighted[::stride], axis=0)).round() @ [
        0x10000,
        0x100,
        1,
    ]
    look: dict[str, Any] = {
        "grid_visible": False,
        "axes": ["x", "y", "z"],
        "background_color": 0xFFFFFF,
    }
    plot = k3d.plot(
        height=height,
        name=motion.case.name,
        fps=30.0,
        camera_fov=_VIEW,
        camera_auto_fit=False,
        **look,
    )
    if scene.orientations is None:
        captions.append(
            "The rolling of the beads is not shown: the frames are too far apart in time."
        )
        beads = [_points(shown, colours[0])]
    else:
        beads = _balls(shown, scene.orientations[::stride], colours)
    boundary = _walls(motion, round_below(scene.height(_ASPECT) / 5.0))
    if path is not None:
        back = np.tile(np.eye(4), (len(path), 1, 1))
        back[:, :3, 3] = np.round(-path / _GRID) * _GRID
        for part in boundary:
            part.model_matrix = _series(shown, back)
    if motion.case.boundary.tilted and motion.case.environment.gravity:
        captions.append(
            f"{motion.case.boundary.tilted.capitalize()}; gravity points down at first."
        )
    toward = _axes_of_camera(motion)[2]
    for part in [
        *boundary,
        *beads,
        *_necks(shown, motion.position[::stride], bridges, path, toward),
    ]:
        plot += part
    plot.fps_meter, plot.camera = False, camera_of(motion, scene.camera_path)
    # K3D's own player plays the run in 12 s.
    plot.time, end = ends = shown.time[[0, -1]].tolist()
    plot.time_speed = (end - plot.time) / 12.0 or 1.0
    return plot, ends, captions


def camera_of(motion: Motion, path: FloatArray | None = None) -> list[float]:
    """Position, target (mm) and upward direction of a camera that sees everything, with gravity downward.

    ``path`` is subtracted from the positions of the beads (`walkers.postprocess.show.scene.Scene`).
    """
    axes = _axes_of_camera(motion)
    seen = Scene.around(motion, axes, _AROUND, shaken=False, camera_path=path)
    distance = (
        seen.height(_ASPECT) / 2.0 / tan(radians(_VIEW / 2.0))
        + float(seen.high[2] - seen.low[2]) / 2.0
    )
    place, middle, up = seen.camera(distance)
    return [*place.tolist(), *middle.tolist(), *up.tolist()]


def _axes_of_camera(motion: Motion) -> FloatArray:
    """The axes of the picture that the camera sees: to the right, up, and toward the camera, unit vectors."""
    toward = camera_axes(motion)[2]
    if motion.case.boundary.closed:
        toward = np.array([-0.25, -1.0, 0.2 if from_the_side(motion.case) else 2.0])
    return axes_toward(toward, against_gravity(motion))


def _thinned(motion: Motion, places: int) -> tuple[Motion, int, list[str]]:
    """The motion that is shown, the stride of the frames, and both as captions."""
    captions, count = [], len(motion.walkers)
    if motion.case.apart:
        firsts = {walker.kind: walker for walker in reversed(motion.walkers)}
        motion = motion.of_walkers(sorted(firsts.values(), key=lambda walker: walker.walker))
        if len(firsts) < count:
            of_kinds = "" if len(firsts) == 1 else " of each kind"
            captions.append(
                f"The view shows the first walker{of_kinds}; the run has {count} walkers."
            )
    stride, samples = (
        ceil(len(motion.time) * len(motion.radius) / places),
        motion.case.run.samples_per_cycle,
    )
    # A stride that divides a cycle, or is a multiple of one, gives the same phases in each cycle.
    divisors = (number for number in range(stride, samples + 1) if samples % number == 0)
    stride = next(divisors, ceil(stride / samples) * samples)
    if stride > 1:
        cycles = "each cycle" if stride <= samples else f"{stride // samples} cycles"
        captions.append(
            f"Recorded frames shown: {max(samples // stride, 1)} in {cycles}, with interpolated frames between them."
        )
    return motion, stride, captions


def _balls(motion: Motion, turned: FloatArray, colours: FloatArray) -> list[Any]:
    """A ball per bead with a time series of matrices, which K3D interpolates."""
    import k3d
    from scipy.spatial.transform import Rotation

    points, triangles, pale = beach_ball(24, motion)
    balls, unit = [], points.astype(np.float32)
    for bead, radius in enumerate(motion.radius * 1e3):
        matrices = np.tile(np.eye(4), (len(motion.time), 1, 1))
        matrices[:, :3, :3] = (
            np.round(Rotation.from_quat(turned[:, bead]).as_matrix() * radius / _GRID) * _GRID
        )
        matrices[:, :3, 3] = np.round(motion.position[:, bead] * 1e3 / _GRID) * _GRID
        look = {
            "colors": colours[pale, bead].astype(np.uint32),
            "flat_shading": False,
            "roughness": 0.6,
        }
        ball = k3d.mesh(
            unit, triangles.astype(np.uint32), normals=unit, name=f"bead {bead}", **look
        )
        ball.model_matrix = _series(motion, matrices)
        balls.append(ball)
    return balls


def _necks(
    motion: Motion,
    place: FloatArray,
    bridges: list[IntArray],
    path: FloatArray | None,
    toward: FloatArray,
) -> list[Any]:
    """The necks of all bridges as one mesh with a time series of its points.

    A bridge that is not there has no width; its neck grows and vanishes in place. Bridges to walls in front of the
    beads, as the camera first sees them, have no width either.
    """
    import k3d

    contacts, held = np.unique(np.concatenate(bridges), axis=0, return_inverse=True)
    if not len(contacts):
        return []
    bridged = np.zeros((len(bridges), len(contacts)), dtype=bool)
    bridged[
        np.repeat(np.arange(len(bridges)), [len(of_frame) for of_frame in bridges]), held.ravel()
    ] = True
    fine = next(cells for most, cells in _NECKS if bridged.size < most)
    points = np.zeros((len(bridges), len(contacts) * fine[0] * fine[1], 3))
    for frame, present in enumerate(bridged):
        near = np.flatnonzero(bridged[max(frame - 1, 0) : frame + 2].any(axis=0))
        ends = bridge_ends(motion, place[frame], contacts[near])
        hidden = at_front_walls(motion, contacts[near], ends, toward)
        width = (present[near] & ~hidden).astype(float)
        necks = neck_surfaces(motion, contacts[near], ends, *fine, width)[0]
        points[frame].reshape(len(contacts), -1, 3)[near] = necks - (
            0.0 if path is None else path[frame]
        )
    look = {"color": NECK_COLOUR, "opacity": NECK_OPACITY, "flat_shading": True, "name": "bridges"}
    mesh = k3d.mesh(
        points[0].astype(np.float32), neck_triangles(len(contacts), *fine).astype(np.uint32), **look
    )
    mesh.vertices = _series(motion, np.round(points / _GRID) * _GRID)
    return [mesh]


def _points(motion: Motion, colours: FloatArray) -> Any:
    import k3d

    sizes, look = (
        (2e3 * motion.radius).astype(np.float32),
        {"shader": "3d", "roughness": 0.5, "name": "beads"},
    )
    start = np.zeros((len(sizes), 3), dtype=np.float32)
    points = k3d.points(start, point_sizes=sizes, colors=colours.astype(np.uint32), **look)
    coarse = 8.0 * _GRID  # beads are many
    points.positions = _series(motion, np.round(motion.position * 1e3 / coarse) * coarse)
    return points


def _series(motion: Motion, values: FloatArray) -> dict[str, Any]:
    return {
        f"{time:.6f}": value
        for time, value in zip(motion.time, values.astype(np.float32), strict=True)
    }


def _walls(motion: Motion, step: float) -> list[Any]:
    """The boundary, with transparent side walls, and lines on a bare floor with a spacing (mm)."""
    import k3d

    faces, parts = [1e3 * corners for corners in walls_of(motion)], []
    for level in (True, False):
        some = [corners for corners in faces if (np.ptp(corners[:, 2]) < 1e-6) == level]
        if not some:
            continue
        mesh = mesh_of(some).triangulate()
        points = np.asarray(
            mesh.points - [0.0, 0.0, 2e-3 * level], dtype=np.float32
        )  # below beads that touch it
        look = {
            "color": _FLOOR,
            "side": "double",
            "roughness": 1.0,
            "name": "floor" if level else "wall",
        }
        parts.append(
            k3d.mesh(
                points, mesh.regular_faces.astype(np.uint32), opacity=1.0 if level else 0.12, **look
            )
        )
    if motion.case.boundary.bare:
        low, high = faces[0].min(axis=0), faces[0].max(axis=0)
        step = max(step, round_below(float(np.ptp([low, high])) / _MOST_LINES))
        ends = floor_lines(low, high, step).astype(np.float32)
        pairs = np.arange(len(ends), dtype=np.uint32).reshape(-1, 2)
        look = {
            "indices_type": "segment",
            "shader": "simple",
            "color": _LINES,
            "name": f"every {step:g} mm",
        }
        parts.append(k3d.lines(ends, pairs, **look))
    return parts
