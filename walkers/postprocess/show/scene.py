"""Scene of a run: beads, walls, colours, motion and camera; rendered off-screen (PyVista).

Reports and notebooks (`walkers.postprocess.show.report.player`) and ParaView
(`walkers.postprocess.show.paraview`) show the same.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import ceil, cos, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.errors import input_error
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure import piles
from walkers.postprocess.measure.motion import Motion, interpolated_positions, visible_displacement
from walkers.postprocess.show.necks import (
    BLUE,
    NO_BRIDGES,
    OPACITY,
    at_front_walls,
    ends_of,
    necks_of,
    triangles_of,
)

if TYPE_CHECKING:
    import pyvista as pv

Picture = npt.NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
RUBY = (0xB0203C, 0xE0566C)
GLASS = (0x8C9AA5, 0xC9D2D8)
"""Colours of large and small beads: highlighted beads and the others."""
_GROUND, _LINES, _WALL, _EDGE = "#e3e8eb", "#bcc6cd", "#eef1f3", "#5a6670"
_SHADOW = 0.4  # opacity of a shadow below the centre of a bead
_PALE, _BRIGHTEST = (
    0.72,
    150.0,
)  # share of white in the pale lunes; largest mean of red, green, blue in the dark ones
_LUNES = 6
_FINE = ((10, 72, (9, 36)), (100, 30, (7, 24)), (500, 18, (5, 12)), (np.inf, 12, (3, 8)))
"""For fewer beads than the first number: cells around a ball; rings and sides of a neck."""
_FINER = 1.5  # pixels that are drawn over those of the picture, in each direction
_BEYOND = 6.0  # extent of the floor over that of the picture
_ELEVATION_OF_ONE, _ELEVATION = radians(35.0), radians(60.0)
"""Elevation of the camera above a floor: for one walker seen from its side, and otherwise."""
_LONG, _ABOUT = 1.5, 1.4
"""The camera follows the beads if the view of their whole path is larger than the view that follows them by more than
the first factor. The second factor is the extent of the following view over the extent of the beads."""


def motion_in_view(motion: Motion, walker: int | None) -> tuple[Motion, bool]:
    """What pictures and films show: the walker with a number, the first of independent walkers, or all beads.

    The second value is whether it is a walker by itself; `InputError` if there is no walker with this number.
    """
    if walker is None and not motion.case.apart:
        return motion, False
    number, count = walker or 0, len(motion.walkers)
    if not 0 <= number < count:
        raise input_error(
            "walker",
            f"{number}: " + (f"expected 0 to {count - 1}" if count else "the run has no walkers"),
        )
    return motion.of_walkers(motion.walkers[number : number + 1]), True


def gathered(motion: Motion, lane: float = 2.0) -> Motion:
    """Independent walkers moved onto parallel lanes for pictures; between walls the first walker alone.

    All other motions are returned unchanged. ``lane`` is the distance of the lanes in lengths of the longest walker.
    """
    case = motion.case
    if not case.apart:
        return motion
    lane *= max(kind.length for kind in case.walkers)
    across = np.cross([0.0, 0.0, 1.0], case.drive_axis)
    shift = np.zeros((len(motion.radius), 3))
    for number, walker in enumerate(motion.walkers):
        shift[list(walker.beads)] = -number * lane * across - [*walker.origin, 0.0]
    moved = replace(motion, position=motion.position + shift)
    return moved if case.boundary.bare else moved.of_walkers(moved.walkers[:1])


def turned_in(motion: Motion) -> FloatArray | None:
    """Orientations of the beads: quaternions (x, y, z, w) of the rotation since the first frame, shape (F, N, 4).

    The engine has no orientations of spheres; here its spins are integrated, dR/dt = [ω]× R. A bead turns by ω Δt about
    ω between two frames. With walkers, ω is the average over all steps, and the result is exact if the axis is constant
    during the interval. Otherwise ω is the mean of both frames, which is sufficient if the frames resolve the cycle;
    None if they are too far apart.
    """
    from scipy.spatial.transform import Rotation

    if motion.mean_spin is None and not motion.follows_cycles:
        return None
    steps, now = (
        motion.averaged.spin * np.diff(motion.time)[:, None, None],
        Rotation.identity(len(motion.radius)),
    )
    turned = [now.as_quat()]
    for step in steps:
        now = Rotation.from_rotvec(step) * now
        turned.append(now.as_quat())
    return np.array(turned)


def rotations_at(turned: FloatArray, frame: float) -> FloatArray:
    """Rotation matrices of the beads in a frame, or between two (a fraction), shape (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    number, share = int(frame), frame % 1.0
    begin, end = (
        Rotation.from_quat(quaternions) for quaternions in turned[[number, number + ceil(share)]]
    )
    matrices: FloatArray = (
        Rotation.from_rotvec(share * (end * begin.inv()).as_rotvec()) * begin
    ).as_matrix()
    return matrices


@dataclass(frozen=True)
class Scene:
    """Beads, walls and an orthographic view of them.

    The rows of ``axes`` are unit vectors to the right in the picture, up, and toward the camera; ``low`` and ``high``
    are the limits of the view along them, mm. If ``shaken``, the view is in the laboratory, otherwise in the frame of
    the boundary. ``rolling`` beads have two colours if their orientation is known. ``path`` is the displacement of the
    camera in each frame, mm, shape (F, 3); None for a camera at rest.
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
        cls,
        motion: Motion,
        axes: FloatArray,
        share: float = 1.0,
        frames: slice = slice(None),
        **options: Any,
    ) -> Scene:
        """A view of the beads in some frames, and of the width and the floor of a container.

        ``share`` is the extent of the picture over that of the beads. Options are ``shaken``, ``rolling`` and ``path``,
        with which the view does not include the container.
        """
        seen = motion.position[frames]
        if options.get("shaken", True):
            seen = seen + motion.substrate[frames, None]
        if (path := options.get("path")) is not None:
            seen = seen - 1e-3 * path[frames, None]
        seen, radius = 1e3 * seen @ axes.T, 1e3 * motion.radius[:, None]
        low, high = (seen - radius).min(axis=(0, 1)), (seen + radius).max(axis=(0, 1))
        if motion.case.boundary.closed and path is None:
            half = (
                5e2 * motion.case.boundary.inner_width * np.array([1.0, axes[2, 2] > 0.5])
            )  # from above also across
            low[:2], high[:2] = np.minimum(low[:2], -half), np.maximum(high[:2], half)
        wider = (share - 1.0) / 2.0 * (high - low)
        return cls(motion, axes, low - wider, high + wider, **options)

    def following(self, aspect: float, share: float = 1.0, frames: slice = slice(None)) -> Scene:
        """The same view (`around`), or, if the path of the beads is long, a closer one that follows the beads."""
        options = {
            "shaken": self.shaken,
            "rolling": self.rolling,
            "path": path_of(self.motion, frames.start or 0),
        }
        near = Scene.around(self.motion, self.axes, _ABOUT * share, frames, **options)
        return near if self.height(aspect) > _LONG * near.height(aspect) else self

    def moved(self, frame: float) -> FloatArray:
        """Displacement of the camera in a frame, or between two (a fraction), mm."""
        number, share = int(frame), frame % 1.0
        if self.path is None:
            return np.zeros(3)
        return (1.0 - share) * self.path[number] + share * self.path[number + ceil(share)]  # type: ignore[no-any-return]

    def height(self, aspect: float) -> float:
        """Height of the picture, mm, for a ratio of width to height."""
        right, up, _ = self.high - self.low
        return float(max(up, right / aspect))

    def camera(self, distance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A camera at a distance (mm) from the middle of the view: its position, the middle (mm), upward direction."""
        middle = (self.low + self.high) / 2.0 @ self.axes
        return middle + distance * self.axes[2], middle, self.axes[1]

    @cached_property
    def turned(self) -> FloatArray | None:
        """Orientations of the beads (`turned_in`); None if not shown or unknown."""
        return turned_in(self.motion) if self.rolling else None

    @cached_property
    def pointed_out(self) -> npt.NDArray[np.bool_]:
        """Highlighted beads in each frame: walkers and climbing clusters; shape (F, N)."""
        motion = self.motion
        chosen = np.tile(motion.walker_of >= 0, (len(motion.time), 1))
        return chosen | piles.tracks_of(motion)[1] if piles.applies(motion.case) else chosen

    @property
    def explained(self) -> list[str]:
        """What colours of beads mean, if that is not plain."""
        return ["red: climbers"] if self.motion.case.loose and self.pointed_out.any() else []

    def colours(self, chosen: npt.NDArray[np.bool_]) -> FloatArray:
        """Red, green, blue (to 255) of the dark and the pale lunes of beads, shape (2, N, 3); chosen ones in ruby."""
        large = self.motion.large
        packed = np.where(chosen, np.where(large, *RUBY), np.where(large, *GLASS))
        plain = (packed[:, None] >> np.array([16, 8, 0]) & 255).astype(np.float64)
        if self.turned is None:
            return np.stack([plain, plain])
        darker = plain * np.minimum(1.0, _BRIGHTEST / plain.mean(axis=1, keepdims=True))
        return np.stack([darker, plain + _PALE * (255.0 - plain)])


def path_of(motion: Motion, begin: int = 0) -> FloatArray:
    """Displacement of the centre of the beads since a frame, smoothed over a cycle, mm, shape (F, 3)."""
    middle = 1e3 * motion.position.mean(axis=1)
    half = min(motion.case.run.samples_per_cycle, len(middle) - 1) // 2
    beyond = np.pad(
        middle, ((half, half), (0, 0)), "reflect", reflect_type="odd"
    )  # a straight path goes on
    smooth = np.lib.stride_tricks.sliding_window_view(beyond, 2 * half + 1, axis=0).mean(axis=-1)
    return np.asarray(smooth - smooth[begin])


def against_gravity(motion: Motion) -> FloatArray:
    """Unit vector against gravity in the frame of the boundary; without gravity the normal of the floor."""
    against = -np.array(motion.case.gravity_vector)
    return against / np.linalg.norm(against) if against.any() else np.array([0.0, 0.0, 1.0])


def axes_toward(toward: FloatArray, upward: FloatArray) -> FloatArray:
    """Unit vectors to the right, up, and toward the camera, as rows; up is the projection of ``upward``."""
    toward = toward / np.linalg.norm(toward)
    up = upward - (upward @ toward) * toward
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, toward), up, toward])


def from_the_side(case: Case) -> bool:
    """Whether a run is seen from the side: in a container, but on a tray, where walkers would hide one another."""
    return case.boundary.closed and (case.loose or not case.meets)


def from_above(case: Case) -> bool:
    """Whether a run in a container is seen along the normal of its floor."""
    return case.boundary.closed and not from_the_side(case)


def camera_axes(motion: Motion) -> FloatArray:
    """The axes (`axes_toward`) of films and players, in the frame of the boundary.

    Containers are seen from the side, closed trays along their normal (`from_the_side`). Open floors are seen obliquely
    from above, from the right of the drive axis or, if tilted, of the uphill direction. Up in the picture is against
    gravity, on closed trays y or uphill.
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
    """The axes (`axes_toward`) of a view along the normal of a floor; up is uphill, or to the left of ``along``."""
    boundary = motion.case.boundary
    upward = np.cross([0.0, 0.0, 1.0], along)
    if boundary.tilt:
        upward = np.array([cos(boundary.uphill), sin(boundary.uphill), 0.0])
    return axes_toward(np.array([0.0, 0.0, 1.0]), upward)


def named_direction(motion: Motion) -> tuple[FloatArray, str]:
    """Direction of the displacement that is written into pictures, and its name."""
    if from_the_side(motion.case):
        return against_gravity(motion), "up"
    right, up, _ = plan_axes(motion, np.array(motion.case.drive_axis))
    return (up, "uphill") if motion.case.boundary.tilt else (right, "along the drive axis")


def walls_of(motion: Motion) -> list[FloatArray]:
    """Corners of each wall, counterclockwise as seen from the beads, m, shape (K, 3).

    The walls of a container end at its rim, unbounded walls around the beads. A cylinder is a prism; a vessel of the
    user's own is its triangles.
    """
    margin = 4.0 * float(motion.radius.max())
    low, high = motion.position.min(axis=(0, 1)) - margin, motion.position.max(axis=(0, 1)) + margin
    return motion.case.boundary.geometry.outline(low, high, motion.position[0, 0])


def mesh_of(faces: Sequence[FloatArray]) -> pv.PolyData:
    """A mesh of polygons, given their corners."""
    import pyvista as pv

    points, sizes = np.concatenate(faces), np.array([len(corners) for corners in faces])
    cells = np.insert(np.arange(len(points)), np.cumsum(sizes) - sizes, sizes)
    return pv.PolyData(points, faces=cells)


def floor_lines(low: FloatArray, high: FloatArray, step: float) -> FloatArray:
    """Ends of K lines on the floor between two corners, along x and y at multiples of a step, shape (2 K, 3)."""
    lines = []
    for along, across in ((0, 1), (1, 0)):
        marks = step * np.arange(np.ceil(low[across] / step), np.floor(high[across] / step) + 1)
        ends = np.zeros((len(marks), 2, 3))
        ends[:, :, along], ends[:, :, across] = (low[along], high[along]), marks[:, None]
        lines.append(ends.reshape(-1, 3))
    return np.concatenate(lines)


def round_below(value: float) -> float:
    """Largest of the numbers …, 1, 2, 5, 10, … that does not exceed a value."""
    decade = 10.0 ** np.floor(np.log10(value) + 1e-9)
    return float(
        decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= value * (1.0 + 1e-9))
    )


def beach_ball(
    rounds: int, motion: Motion
) -> tuple[FloatArray, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Points (shape (V, 3), also the normals), triangles (shape (T, 3)) and colours of a unit ball of six lunes.

    ``rounds``, a multiple of six, is the number of cells around it. Colours are 1 in pale lunes and 0 in dark ones. The
    axis is the one about which walkers roll; in containers it is y, the direction of view.
    """
    import pyvista as pv

    axis = np.cross(
        [0.0, 0.0, 1.0], [1.0, 0.0, 0.0] if from_the_side(motion.case) else motion.case.drive_axis
    )
    look: dict[str, Any] = {"theta_resolution": rounds // _LUNES, "phi_resolution": rounds // 2 + 1}
    ends = pairwise(np.linspace(0.0, 360.0, _LUNES + 1))
    lunes = [
        pv.Sphere(radius=1.0, direction=axis, start_theta=begin, end_theta=end, **look)
        for begin, end in ends
    ]
    ball = pv.merge(lunes, merge_points=False)
    points = np.asarray(ball.points)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return points, ball.regular_faces, np.repeat(np.arange(_LUNES) % 2, len(points) // _LUNES)


class Window:
    """An off-screen window that shows a scene; ``size`` is its width and height in pixels."""

    def __init__(self, scene: Scene, size: Sequence[int]) -> None:
        # Otherwise VTK first tries an X server, and prints that.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import pyvista as pv

        self._scene, self._bare, radius = (
            scene,
            scene.motion.case.boundary.bare,
            1e3 * scene.motion.radius,
        )
        self._size, finer = (size[0], size[1]), [round(_FINER * length) for length in size]
        # In software, smooth edges by a finer picture and simple blending take half of the time of VTK's own ways.
        self._plotter = pv.Plotter(off_screen=True, window_size=finer, lighting="light kit")
        self._plotter.disable_anti_aliasing()
        self._plotter.renderer.SetUseOIT(False)
        self._plotter.background_color = pv.Color(_GROUND if self._bare else "white")
        tall = scene.height(size[0] / size[1])
        wide = max(tall, tall * size[0] / size[1])
        self.pixels_per_mm = size[1] / tall
        self._place, self._middle, up = scene.camera(10.0 * tall)
        self._plotter.camera_position = [self._place, self._middle, up]
        self._plotter.camera.parallel_projection, self._plotter.camera.parallel_scale = (
            True,
            tall / 2.0,
        )
        self._around = self._floor(wide) if self._bare else self._walls(wide)
        self._plotter.camera.clipping_range = (0.1 * tall, 40.0 * wide)
        if self._bare:
            disc = pv.Disc(inner=0.0, outer=1.0, r_res=8, c_res=48).triangulate()
            self._shadows = _Copies(
                self._plotter, disc.points, disc.regular_faces, radius, lighting=False
            )
            black = np.zeros((disc.n_points, 4))
            black[:, 3] = 255.0 * _SHADOW * (1.0 - np.linalg.norm(disc.points, axis=1) ** 2) ** 2
            self._shadows.colour(np.tile(black, (len(radius), 1, 1)))
        rounds, self._round = next(
            (cells, neck) for most, cells, neck in _FINE if len(radius) < most
        )
        points, triangles, self._pale = beach_ball(rounds, scene.motion)
        self._beads = _Copies(self._plotter, points, triangles, radius, specular=0.4)
        look = {
            "ambient": 0.45,
            "diffuse": 0.75,
            "specular": 0.4,
            "culling": "back",
            "interpolation": "Phong",
        }
        liquid = pv.Property(color=f"#{BLUE:06x}", opacity=OPACITY, **look)
        self._necks = pv.Actor(mapper=pv.DataSetMapper(), prop=liquid)
        self._necks.mapper.scalar_visibility = False
        self._plotter.add_actor(self._necks, reset_camera=False, render=False)

    def picture(self, frame: float, bridges: IntArray = NO_BRIDGES) -> Picture:
        """Picture of a frame, or of a time between two frames (a fraction) by cubic interpolation.

        Bridges are contacts as in `walkers.postprocess.measure.motion.Bridges`.
        """
        from PIL import Image

        motion, shift, number = self._scene.motion, np.zeros(3), int(frame)
        place, share, turned = motion.position[number], frame - number, self._scene.turned
        if share:
            place = interpolated_positions(motion.select(slice(number, number + 2)), share)[0]
        if self._scene.shaken:
            time = np.interp([frame], np.arange(len(motion.time)), motion.time)
            shift = 1e3 * visible_displacement(motion.case.excitation, time)[0]
        self._beads.colour(
            self._scene.colours(self._scene.pointed_out[number])[self._pale].swapaxes(0, 1)
        )
        self._beads.move(
            1e3 * place + shift, None if turned is None else rotations_at(turned, frame)
        )
        if self._bare:
            self._shadows.move(1e3 * place * [1.0, 1.0, 0.0] + shift)
        self._wet(place, bridges, shift)
        for actor in self._around:
            actor.position = tuple(shift)
        moved = self._scene.moved(frame)
        self._plotter.camera.SetPosition(
            self._place + moved
        )  # pyvista's own also looks for the limits of the scene
        self._plotter.camera.SetFocalPoint(self._middle + moved)
        self._plotter.render()  # a screenshot alone renders only the first time
        picture = Image.fromarray(
            np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)
        )
        return np.asarray(picture.resize(self._size, Image.Resampling.BOX))

    def close(self) -> None:
        """Close the window."""
        self._plotter.close()

    def _wet(self, place: FloatArray, bridges: IntArray, shift: FloatArray) -> None:
        """Draw the liquid necks; walls before the beads are not drawn, nor are the necks to them."""
        import pyvista as pv

        motion = self._scene.motion
        begins, ends = ends_of(motion, place, bridges)
        before = at_front_walls(motion, bridges, (begins, ends), self._scene.axes[2])
        contacts, between = bridges[~before], (begins[~before], ends[~before])
        self._necks.visibility = bool(len(contacts))
        if not len(contacts):
            return
        points, normals = (
            array.reshape(-1, 3) for array in necks_of(motion, contacts, between, *self._round)
        )
        necks = pv.PolyData.from_regular_faces(
            points + shift, triangles_of(len(contacts), *self._round)
        )
        necks.point_data["Normals"] = normals
        necks.point_data.active_normals_name = "Normals"
        self._necks.mapper.SetInputData(necks)

    def _floor(self, wide: float) -> list[pv.Actor]:
        """Lines that make the motion of a floor visible, which is as bright as the background."""
        import pyvista as pv

        path = np.zeros((1, 3)) if self._scene.path is None else self._scene.path
        half, middle = _BEYOND * wide / 2.0, self._middle * [1.0, 1.0, 0.0]
        low, high = middle + path.min(axis=0) - half, middle + path.max(axis=0) + half
        lines = pv.line_segments_from_points(floor_lines(low, high, round_below(wide / 8.0)))
        lines.translate([0.0, 0.0, -1e-3 * wide], inplace=True)
        return [self._plotter.add_mesh(lines, color=_LINES, line_width=3, lighting=False)]

    def _walls(self, wide: float) -> list[pv.Actor]:
        """Walls behind the beads and, slightly nearer to the camera, the edges of all walls."""
        faces = [1e3 * corners for corners in walls_of(self._scene.motion)]
        walls = mesh_of(faces).clean(tolerance=1e-6, absolute=True)
        edges = walls.extract_feature_edges(
            feature_angle=30.0, manifold_edges=False, non_manifold_edges=False
        )
        edges.translate(1e-2 * wide * self._scene.axes[2], inplace=True)
        parts = [
            self._plotter.add_mesh(walls, color=_WALL, lighting=False, culling="back"),
            self._plotter.add_mesh(edges, color=_EDGE, line_width=3, lighting=False),
        ]
        if self._scene.path is not None:
            marks = self._marks(
                faces, int(np.argmax(np.ptp(self._scene.path, axis=0))), round_below(wide / 8.0)
            )
            parts.append(self._plotter.add_mesh(marks, color=_LINES, line_width=3, lighting=False))
        return parts

    def _marks(self, faces: Sequence[FloatArray], axis: int, step: float) -> pv.PolyData:
        """Lines on the walls behind the beads, across the path of the camera, that make its motion visible."""
        import pyvista as pv

        toward = self._scene.axes[2]
        behind = [
            face for face in faces if np.cross(face[1] - face[0], face[2] - face[1]) @ toward > 0.0
        ]
        walls, along = mesh_of(behind), np.eye(3)[axis]
        low, high = walls.bounds[2 * axis : 2 * axis + 2]
        places = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
        lines: pv.PolyData = pv.merge(
            [walls.slice(normal=along, origin=place * along) for place in places]
        )
        lines.translate(1e-2 * step * toward, inplace=True)
        return lines


class _Copies:
    """Copies of a unit mesh, one per bead, with the positions, orientations and colours of a frame; mm."""

    def __init__(
        self, plotter: pv.Plotter, points: Any, triangles: Any, radius: FloatArray, **look: Any
    ) -> None:
        import pyvista as pv

        faces = (triangles + len(points) * np.arange(len(radius))[:, None, None]).reshape(-1, 3)
        self._points, self._radius = (
            np.asarray(points, np.float32),
            radius[:, None, None].astype(np.float32),
        )
        self._mesh = pv.PolyData(
            np.tile(self._points, (len(radius), 1)), np.insert(faces, 0, 3, axis=1).ravel()
        )
        self.colour(np.zeros((len(radius), len(points), 4 if "lighting" in look else 3)))
        self._mesh.point_data["Normals"] = np.asarray(self._mesh.points).copy()
        self._mesh.point_data.active_normals_name = "Normals"
        # The invisible halves of spheres are half of the work.
        drawn = plotter.add_mesh(
            self._mesh, scalars="colour", rgb=True, smooth_shading=False, culling="back", **look
        )
        drawn.prop.interpolation = "Phong"  # with these normals; pyvista would compute others

    def move(self, centres: FloatArray, turned: FloatArray | None = None) -> None:
        """Move them to centres, shape (N, 3), and turn them by rotation matrices, shape (N, 3, 3)."""
        turned = np.tile(np.eye(3), (len(centres), 1, 1)) if turned is None else turned
        # The points of a unit sphere are its normals.
        normals = self._points @ np.swapaxes(turned, 1, 2).astype(np.float32)
        self._mesh.points = (self._radius * normals + centres[:, None].astype(np.float32)).reshape(
            -1, 3
        )
        self._mesh.point_data["Normals"] = normals.reshape(-1, 3)

    def colour(self, colours: FloatArray) -> None:
        """Set the colours of the points: red, green, blue and perhaps opacity, up to 255, shape (N, V, 3 or 4)."""
        self._mesh.point_data["colour"] = (
            colours.reshape(-1, colours.shape[-1]).round().astype(np.uint8)
        )
