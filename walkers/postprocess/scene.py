"""Scene of a run: beads, walls, colours, motion and camera; rendered off-screen (PyVista).

Reports and notebooks (`walkers.postprocess.report.player`) and ParaView (`walkers.postprocess.paraview`) show the same.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.boundary import Flat
from walkers.inputs.case import Case
from walkers.postprocess.analyses.piles import Pile, tracks_of
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, boundary_motion

if TYPE_CHECKING:
    import pyvista as pv

Picture = npt.NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
RUBY = (0xB0203C, 0xE0566C)
GLASS = (0x8C9AA5, 0xC9D2D8)
"""Large and small beads, of those that are pointed out and of the others."""
_GROUND, _LINES, _WALL, _EDGE = "#e3e8eb", "#bcc6cd", "#eef1f3", "#5a6670"
_SHADOW = 0.4  # of black, where a bead stands
_PALE, _BRIGHTEST = 0.72, 150.0  # white in the paler lunes of a ball; mean of red, green and blue in the darker ones
_LUNES = 6
_ROUNDS = ((10, 72), (100, 30), (500, 18))  # cells around a ball where beads are fewer than that; else 12
_SIDES = 64  # of the prism that a round wall is drawn as
_BEYOND = 6.0  # extent of the floor over that of the picture: it has no end
_ELEVATION_OF_ONE, _ELEVATION = radians(35.0), radians(60.0)
"""Of the camera above a floor: with one walker that is seen from its side, and otherwise."""
_LONG, _ABOUT = 1.5, 1.4
"""The camera follows beads where a view of their whole path would be larger by the first factor than one of the beads;
the extent of the picture then, over what the path does not need."""


@dataclass(frozen=True)
class Turns:
    """Quaternions (x, y, z, w) from the axes at the first frame to those of each frame, shape (F, N, 4).

    And rotation vectors from each frame to the next one, rad, shape (F, N, 3); of the last frame nothing.
    """

    turned: FloatArray
    step: FloatArray

    def at(self, frame: int, share: float) -> FloatArray:
        """Rotation matrices of the beads, shape (N, 3, 3), at a share of the way from a frame to the next one."""
        from scipy.spatial.transform import Rotation

        further = Rotation.from_rotvec(share * self.step[frame])
        matrices: FloatArray = (further * Rotation.from_quat(self.turned[frame])).as_matrix()
        return matrices


def turns_of(motion: Motion) -> Turns | None:
    """Integrate the spins of a motion, dR/dt = [ω]× R; None where they are not known well enough.

    The engine keeps no orientation of a sphere: over each interval between frames it turns by ω Δt about ω. Where there
    are walkers the engine averaged spins over all steps between frames, and the sum is exact for axes that keep their
    direction between two frames. Elsewhere spins are known at the frames alone: their means do (trapezoids) if the
    frames follow the cycle, and nothing is known if they are whole cycles apart.
    """
    from scipy.spatial.transform import Rotation

    if motion.mean_spin is None and not motion.follows_cycles:
        return None
    step = np.zeros_like(motion.spin)
    step[:-1] = motion.averaged.spin * np.diff(motion.time)[:, None, None]
    turned = np.empty((*step.shape[:2], 4))
    now = Rotation.identity(step.shape[1])
    for frame, vectors in enumerate(step):
        turned[frame] = now.as_quat()
        now = Rotation.from_rotvec(vectors) * now
    return Turns(turned, step)


@dataclass(frozen=True)
class Scene:
    """Beads, walls and an orthographic view of them.

    ``axes`` are unit vectors to the right in the picture, up, and toward the camera, as rows; ``low`` and ``high`` what
    the camera takes in along them, mm. It rests in the laboratory if the boundary is seen ``shaken``, else on the
    boundary. ``rolling`` beads are two-coloured where it is known how they roll. ``path`` is how far the camera has
    moved along in each frame, mm, shape (F, 3); None if it rests.
    """

    motion: Motion
    axes: FloatArray
    low: FloatArray
    high: FloatArray
    shaken: bool = True
    rolling: bool = False
    path: FloatArray | None = None

    @classmethod
    def around(
        cls, motion: Motion, axes: FloatArray, share: float = 1.0, frames: slice = slice(None), **options: Any
    ) -> Scene:
        """A view of all that beads reach in some frames, and of the width and the floor of a container.

        ``share`` is the extent of the picture over that; options are ``shaken``, ``rolling`` and ``path``, with which
        the view is of the beads alone.
        """
        seen = motion.position[frames]
        if options.get("shaken", True):
            seen = seen + motion.substrate[frames, None]
        if (path := options.get("path")) is not None:
            seen = seen - 1e-3 * path[frames, None]
        seen, radius = 1e3 * seen @ axes.T, 1e3 * motion.radius[:, None]
        low, high = (seen - radius).min(axis=(0, 1)), (seen + radius).max(axis=(0, 1))
        if motion.case.boundary.closed and path is None:
            half = 5e2 * motion.case.boundary.width * np.array([1.0, axes[2, 2] > 0.5])  # from above also across
            low[:2], high[:2] = np.minimum(low[:2], -half), np.maximum(high[:2], half)
        wider = (share - 1.0) / 2.0 * (high - low)
        return cls(motion, axes, low - wider, high + wider, **options)

    def following(self, aspect: float, share: float = 1.0, frames: slice = slice(None)) -> Scene:
        """The same, or where the path of the beads is long a view of the beads with which the camera moves along.

        ``aspect`` is the width of the picture over its height; the others are those of `around`.
        """
        path = path_of(self.motion, frames.start or 0)
        options = {"shaken": self.shaken, "rolling": self.rolling, "path": path}
        near = Scene.around(self.motion, self.axes, _ABOUT * share, frames, **options)
        return near if self.height(aspect) > _LONG * near.height(aspect) else self

    def moved(self, frame: float) -> FloatArray:
        """How far the camera has moved along in a frame, or between two, mm."""
        if self.path is None:
            return np.zeros(3)
        number, last = int(frame), len(self.path) - 1
        begin, end = self.path[number], self.path[min(number + 1, last)]
        moved: FloatArray = begin + (frame - number) * (end - begin)
        return moved

    def height(self, aspect: float) -> float:
        """Of the picture, mm, whose width is so many times that."""
        right, up, _ = self.high - self.low
        return float(max(up, right / aspect))

    def camera(self, distance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A camera so far before the middle of what is seen: place and middle, mm, and upward direction."""
        middle = (self.low + self.high) / 2.0 @ self.axes
        return middle + distance * self.axes[2], middle, self.axes[1]

    @cached_property
    def turns(self) -> Turns | None:
        """Orientation of the beads; None if it is not shown or unknown."""
        return turns_of(self.motion) if self.rolling else None

    @cached_property
    def pointed_out(self) -> npt.NDArray[np.bool_]:
        """Highlighted beads in each frame: walkers and climbing clusters; shape (F, N)."""
        motion = self.motion
        chosen = np.tile(motion.walker_of >= 0, (len(motion.time), 1))
        return chosen | tracks_of(motion)[1] if Pile().applies(motion.case) else chosen

    def colours(self, chosen: npt.NDArray[np.bool_]) -> FloatArray:
        """Red, green, blue (to 255) of beads, some chosen ones in ruby, and of their paler lunes, shape (2, N, 3)."""
        large = self.motion.large
        packed = np.where(chosen, np.where(large, *RUBY), np.where(large, *GLASS))
        plain = (packed[:, None] >> np.array([16, 8, 0]) & 255).astype(np.float64)
        if self.turns is None:
            return np.stack([plain, plain])
        darker = plain * np.minimum(1.0, _BRIGHTEST / plain.mean(axis=1, keepdims=True))
        return np.stack([darker, plain + _PALE * (255.0 - plain)])


def path_of(motion: Motion, begin: int = 0) -> FloatArray:
    """The way of the middle of the beads since a frame, smoothed over a cycle of the drive, mm, shape (F, 3)."""
    from scipy.signal import savgol_filter

    middle = 1e3 * motion.position.mean(axis=1)
    frames = 2 * (min(motion.case.run.samples_per_cycle, len(middle) - 1) // 2) + 1
    smooth = savgol_filter(middle, frames, 1, axis=0) if frames > 1 else middle
    way: FloatArray = smooth - smooth[begin]
    return way


def against_gravity(motion: Motion) -> FloatArray:
    """Unit vector against gravity in the frame of the boundary; its normal without gravity."""
    against = -np.array(motion.case.gravity_vector)
    return against / np.linalg.norm(against) if against.any() else np.array([0.0, 0.0, 1.0])


def axes_toward(toward: FloatArray, upward: FloatArray) -> FloatArray:
    """Unit vectors to the right and up in a picture and toward the camera, as rows; up is as near upward as it can."""
    toward = toward / np.linalg.norm(toward)
    up = upward - (upward @ toward) * toward
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, toward), up, toward])


def from_the_side(case: Case) -> bool:
    """Whether a run is seen from the side: in a container, but on a tray, where walkers would hide one another."""
    return case.boundary.closed and (case.loose or not case.meets)


def camera_axes(motion: Motion) -> FloatArray:
    """The `axes_toward` the camera of films, in the boundary's frame.

    Containers are seen from the side, trays that are closed along their normal (`from_the_side`). Open floors are seen
    from above, from the right of the drive axis or, where they are tilted, of the way uphill. Up in the picture is up
    against gravity, on such trays y or uphill.
    """
    case = motion.case
    boundary, along = case.boundary, np.array(case.drive_axis)
    uphill = np.array([cos(boundary.uphill), sin(boundary.uphill), 0.0])
    if from_the_side(case):
        return axes_toward(np.array([0.0, -1.0, 0.0]), against_gravity(motion))
    if boundary.closed:
        return plan_axes(motion, np.array([1.0, 0.0, 0.0]))
    sideways = boundary.bare and (not boundary.tilt or abs(uphill @ along) > 0.5)
    elevation = _ELEVATION_OF_ONE if len(motion.walkers) == 1 and sideways else _ELEVATION
    across = np.cross([0.0, 0.0, 1.0], uphill if boundary.tilt else along)
    toward = np.array([0.0, 0.0, sin(elevation)]) - cos(elevation) * across
    return axes_toward(toward, against_gravity(motion))


def plan_axes(motion: Motion, along: FloatArray) -> FloatArray:
    """The `axes_toward` the normal of a floor; up in the picture is uphill, on a level floor to the left of a way."""
    boundary = motion.case.boundary
    upward = np.cross([0.0, 0.0, 1.0], along)
    if boundary.tilt:
        upward = np.array([cos(boundary.uphill), sin(boundary.uphill), 0.0])
    return axes_toward(np.array([0.0, 0.0, 1.0]), upward)


def walls_of(motion: Motion) -> list[FloatArray]:
    """Corners of each wall, counterclockwise as the beads see them, m, shape (K, 3).

    Those of a container end at its rim, those without an end where the beads do; a round one is a prism.
    """
    from scipy.spatial import HalfspaceIntersection

    boundary, margin, inside = motion.case.boundary, 4.0 * float(motion.radius.max()), motion.position[0, 0]
    low, high = motion.position.min(axis=(0, 1)) - margin, motion.position.max(axis=(0, 1)) + margin
    if boundary.closed:
        wide = 1.01 * boundary.width / 2.0  # edges of the prism lie beyond the round wall
        low, high = np.full(3, -wide), np.array([wide, wide, boundary.height])
        inside = np.array([0.0, 0.0, boundary.height / 2.0])
    planes: list[tuple[Any, Any]] = []
    for wall in boundary.walls:
        if isinstance(wall, Flat):
            planes.append((wall.point, wall.normal))
        else:
            turns = 2.0 * pi * (np.arange(_SIDES) + 0.5) / _SIDES
            planes += [(wall.radius * out, -out) for out in np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], 1)]
    ends = [(low, axis) for axis in np.eye(3)] + [(high, -axis) for axis in np.eye(3)]
    points, normals = (np.array(each) for each in zip(*planes, *ends, strict=True))
    spaces = np.column_stack([-normals, np.einsum("px,px->p", normals, points)])
    room = HalfspaceIntersection(spaces, inside)
    faces = []
    for number, normal in enumerate(normals[: len(planes)]):
        corners = room.intersections[[number in meeting for meeting in room.dual_facets]]
        if len(corners) > 2:
            spokes = corners - corners.mean(axis=0)
            around = np.arctan2(spokes @ np.cross(normal, spokes[0]), spokes @ spokes[0])
            faces.append(corners[np.argsort(around)])
    return faces


def mesh_of(faces: Sequence[FloatArray]) -> pv.PolyData:
    """Polygons with these corners."""
    import pyvista as pv

    points, sizes = np.concatenate(faces), np.array([len(corners) for corners in faces])
    cells = np.insert(np.arange(len(points)), np.cumsum(sizes) - sizes, sizes)
    return pv.PolyData(points, faces=cells)


def floor_lines(low: FloatArray, high: FloatArray, step: float) -> FloatArray:
    """Ends of lines on the floor between two corners, along x and y at multiples of a step, shape (2 K, 3)."""
    lines = []
    for along, across in ((0, 1), (1, 0)):
        marks = step * np.arange(np.ceil(low[across] / step), np.floor(high[across] / step) + 1)
        ends = np.zeros((len(marks), 2, 3))
        ends[:, :, along], ends[:, :, across] = (low[along], high[along]), marks[:, None]
        lines.append(ends.reshape(-1, 3))
    return np.concatenate(lines)


def round_below(value: float) -> float:
    """Largest number of …, 1, 2, 5, 10, … up to a value."""
    decade = 10.0 ** np.floor(np.log10(value) + 1e-9)
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= value * (1.0 + 1e-9)))


def beach_ball(rounds: int, motion: Motion) -> tuple[FloatArray, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Points of a unit ball of two-coloured lunes, of so many cells around (a multiple of six), triangles, and colours.

    The points, shape (V, 3), are its normals too; triangles have the shape (T, 3); colours are 1 for the points of the
    paler lunes, else 0. Its axis is that about which walkers roll, seen from the side y, toward which one looks.
    """
    import pyvista as pv

    axis = np.cross([0.0, 0.0, 1.0], [1.0, 0.0, 0.0] if from_the_side(motion.case) else motion.case.drive_axis)
    lunes = [
        pv.Sphere(
            radius=1.0,
            direction=axis,
            start_theta=begin,
            end_theta=end,
            theta_resolution=rounds // _LUNES,
            phi_resolution=rounds // 2 + 1,
        )
        for begin, end in pairwise(np.linspace(0.0, 360.0, _LUNES + 1))
    ]
    ball = pv.merge(lunes, merge_points=False)
    points = np.asarray(ball.points)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return points, ball.regular_faces, np.repeat(np.arange(_LUNES) % 2, len(points) // _LUNES)


class Window:
    """A window off-screen onto a scene, of so many pixels across and up, `pixels_per_mm` of them to a mm."""

    def __init__(self, scene: Scene, size: Sequence[int]) -> None:
        # Without this VTK tries an X server first and says so.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import pyvista as pv

        self._scene, self._bare, radius = scene, scene.motion.case.boundary.bare, 1e3 * scene.motion.radius
        self._plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
        self._plotter.background_color = pv.Color(_GROUND if self._bare else "white")
        tall = scene.height(size[0] / size[1])
        wide = max(tall, tall * size[0] / size[1])
        self.pixels_per_mm = size[1] / tall
        self._place, self._middle, up = scene.camera(10.0 * tall)
        self._plotter.camera_position = [self._place, self._middle, up]
        self._plotter.camera.parallel_projection, self._plotter.camera.parallel_scale = True, tall / 2.0
        self._around = self._floor(wide) if self._bare else self._walls(wide)
        self._plotter.camera.clipping_range = (0.1 * tall, 40.0 * wide)
        if self._bare:
            disc = pv.Disc(inner=0.0, outer=1.0, r_res=8, c_res=48).triangulate()
            self._shadows = _Copies(self._plotter, disc.points, disc.regular_faces, radius, lighting=False)
            black = np.zeros((disc.n_points, 4))
            black[:, 3] = 255.0 * _SHADOW * (1.0 - np.linalg.norm(disc.points, axis=1) ** 2) ** 2
            self._shadows.colour(np.tile(black, (len(radius), 1, 1)))
        rounds = next((cells for fewer, cells in _ROUNDS if len(radius) < fewer), 12)
        points, triangles, self._pale = beach_ball(rounds, scene.motion)
        self._beads = _Copies(self._plotter, points, triangles, radius, specular=0.4)

    def picture(self, frame: float) -> Picture:
        """The beads in a frame, or between two on the cubic through their places and velocities."""
        motion, shift, number = self._scene.motion, np.zeros(3), int(frame)
        place, time, share = motion.position[number], motion.time[number], frame - number
        if share:
            place = motion.select(slice(number, number + 2)).between(share).position[0]
            time += share * (motion.time[number + 1] - time)
        if self._scene.shaken:
            shift = 1e3 * boundary_motion(motion.case.drive, np.array([time]))[0][0]
        turns = self._scene.turns
        self._beads.colour(self._scene.colours(self._scene.pointed_out[number])[self._pale].swapaxes(0, 1))
        self._beads.move(1e3 * place + shift, None if turns is None else turns.at(number, share))
        if self._bare:
            self._shadows.move(1e3 * place * [1.0, 1.0, 0.0] + shift)
        for actor in self._around:
            actor.position = tuple(shift)
        moved = self._scene.moved(frame)
        self._plotter.camera.position, self._plotter.camera.focal_point = self._place + moved, self._middle + moved
        self._plotter.render()  # a screenshot does so the first time only
        return np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)

    def close(self) -> None:
        """Give back the window."""
        self._plotter.close()

    def _floor(self, wide: float) -> list[pv.Actor]:
        """A floor with lines, by which it is seen to move."""
        import pyvista as pv

        path = np.zeros((1, 3)) if self._scene.path is None else self._scene.path
        half, middle = _BEYOND * wide / 2.0, self._middle * [1.0, 1.0, 0.0]
        low, high = middle + path.min(axis=0) - half, middle + path.max(axis=0) + half
        size, centre = high - low, (low + high) / 2.0 * [1.0, 1.0, 0.0]
        floor = pv.Plane(center=centre - [0.0, 0.0, 2e-3 * wide], i_size=size[0], j_size=size[1])
        lines = pv.line_segments_from_points(floor_lines(low, high, round_below(wide / 8.0)))
        lines.translate([0.0, 0.0, -1e-3 * wide], inplace=True)
        return [
            self._plotter.add_mesh(floor, color=_GROUND, lighting=False),
            self._plotter.add_mesh(lines, color=_LINES, line_width=2, lighting=False),
        ]

    def _walls(self, wide: float) -> list[pv.Actor]:
        """Walls, of which those that would hide the beads are left out; their edges nearer, lest walls hide them."""
        faces = [1e3 * corners for corners in walls_of(self._scene.motion)]
        walls = mesh_of(faces).clean(tolerance=1e-6, absolute=True)
        drawn = self._plotter.add_mesh(walls, color=_WALL, lighting=False)
        drawn.prop.culling = "back"
        edges = walls.extract_feature_edges(feature_angle=30.0, manifold_edges=False, non_manifold_edges=False)
        edges.translate(1e-2 * wide * self._scene.axes[2], inplace=True)
        parts = [drawn, self._plotter.add_mesh(edges, color=_EDGE, line_width=2, lighting=False)]
        if self._scene.path is not None:
            marks = self._marks(faces, int(np.argmax(np.ptp(self._scene.path, axis=0))), round_below(wide / 8.0))
            parts.append(self._plotter.add_mesh(marks, color=_LINES, line_width=2, lighting=False))
        return parts

    def _marks(self, faces: Sequence[FloatArray], axis: int, step: float) -> pv.PolyData:
        """Lines on the walls behind the beads, across the axis of the camera's way, by which it is seen to move."""
        import pyvista as pv

        toward = self._scene.axes[2]
        behind = [one for one in faces if np.cross(one[1] - one[0], one[2] - one[1]) @ toward > 0.0]
        walls, along = mesh_of(behind), np.eye(3)[axis]
        low, high = walls.bounds[2 * axis : 2 * axis + 2]
        places = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
        lines: pv.PolyData = pv.merge([walls.slice(normal=along, origin=place * along) for place in places])
        lines.translate(1e-2 * step * toward, inplace=True)
        return lines


class _Copies:
    """Copies of a unit mesh, one a bead, which are moved, turned and coloured from frame to frame; in mm."""

    def __init__(self, plotter: pv.Plotter, points: Any, triangles: Any, radius: FloatArray, **look: Any) -> None:
        import pyvista as pv

        faces = (triangles + len(points) * np.arange(len(radius))[:, None, None]).reshape(-1, 3)
        self._points, self._radius = np.asarray(points, np.float32), radius[:, None, None].astype(np.float32)
        self._mesh = pv.PolyData(np.tile(self._points, (len(radius), 1)), np.insert(faces, 0, 3, axis=1).ravel())
        self.colour(np.zeros((len(radius), len(points), 4 if "lighting" in look else 3)))
        self._mesh.point_data["Normals"] = np.asarray(self._mesh.points).copy()
        self._mesh.point_data.active_normals_name = "Normals"
        drawn = plotter.add_mesh(self._mesh, scalars="colour", rgb=True, smooth_shading=False, **look)
        drawn.prop.culling = "back"  # the far halves of spheres, half of the work, are never seen
        drawn.prop.interpolation = "Phong"  # by these normals, where pyvista would compute others

    def move(self, centres: FloatArray, turned: FloatArray | None = None) -> None:
        """Put them at centres (shape (N, 3)), turned by rotation matrices (shape (N, 3, 3))."""
        turned = np.tile(np.eye(3), (len(centres), 1, 1)) if turned is None else turned
        # A sphere's own points are its normals: smooth without computing any.
        normals = self._points @ np.swapaxes(turned, 1, 2).astype(np.float32)
        self._mesh.points = (self._radius * normals + centres[:, None].astype(np.float32)).reshape(-1, 3)
        self._mesh.point_data["Normals"] = normals.reshape(-1, 3)

    def colour(self, colours: FloatArray) -> None:
        """Colour their points, red, green, blue and perhaps opacity to 255, shape (N, V, 3 or 4)."""
        self._mesh.point_data["colour"] = colours.reshape(-1, colours.shape[-1]).round().astype(np.uint8)
