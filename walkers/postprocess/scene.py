"""The scene of a run: beads, walls, what moves and where one looks from; drawn off-screen into pictures and films.

Reports and notebooks (K3D) and scripts for ParaView draw the same beads, walls and cameras.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion
from walkers.postprocess.paraview import boundary_of, lines_between
from walkers.postprocess.piles import Pile, climbing_beads

if TYPE_CHECKING:
    import pyvista as pv

Picture = npt.NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
RUBY = ("#b0203c", "#e0566c")
GLASS = ("#8c9aa5", "#c9d2d8")
"""Large and small beads, of those that are pointed out and of the others."""
_GROUND, _LINES, _WALL, _EDGE = "#e3e8eb", "#bcc6cd", "#eef1f3", "#5a6670"
_PALE = 0.72
"""White in the paler lunes of a bead that is seen to roll."""
_BRIGHTEST = 150.0
"""Mean of red, green and blue in the darker ones."""
_LUNES = 6
"""Of two colours in turn, about an axis: a beach ball, whose turning shows from every side."""
_ELEVATION_OF_ONE, _ELEVATION = radians(35.0), radians(60.0)
"""From which a level floor is seen: with one walker on it, and with several."""
_ASIDE = radians(25.0)
"""From the normal of a steep wall, to which it is seen."""
_STEEP = pi / 4.0
_SINGLE, _FEW, _MANY = 10, 100, 500
"""Beads from which on spheres are drawn coarser."""
_SHADOW = 0.4
"""Of black in a shadow, where a bead stands."""
_BEYOND = 6.0
"""Extent of the floor over that of the picture: it has no end."""


def pointed_out(motion: Motion) -> Callable[[int], set[int]]:
    """What gives, for a frame, the beads to colour: those of walkers, and of the clusters that climb and are free."""
    walkers = set(np.flatnonzero(motion.walker_of >= 0).tolist())
    if not Pile().applies(motion.case):
        return lambda _: walkers
    climbing = climbing_beads(motion)
    return lambda frame: walkers | climbing(frame)


def against_gravity(motion: Motion) -> FloatArray:
    """A unit vector against gravity in the boundary's frame; without gravity its normal."""
    against = -np.array(motion.case.gravity_vector)
    return against / np.linalg.norm(against) if against.any() else np.array([0.0, 0.0, 1.0])


def axes_toward(toward: FloatArray, upward: FloatArray) -> FloatArray:
    """Unit vectors to the right and up in a picture and toward the camera, as rows; up is as near upward as it can."""
    toward = toward / np.linalg.norm(toward)
    up = upward - (upward @ toward) * toward
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, toward), up, toward])


def camera_axes(motion: Motion) -> FloatArray:
    """The `axes_toward` a camera in the boundary's frame.

    Containers are seen from the side, floors from above and from the right of the drive axis, steep walls from a little
    aside; up in the picture is up against gravity.
    """
    case = motion.case
    across = np.cross([0.0, 0.0, 1.0], case.drive_axis)
    uphill = np.array([cos(case.boundary.uphill), sin(case.boundary.uphill), 0.0])
    if case.boundary.closed:
        toward = np.array([0.0, -1.0, 0.0])
    elif case.boundary.tilt < _STEEP:
        elevation = _ELEVATION_OF_ONE if len(motion.walkers) == 1 else _ELEVATION
        toward = np.array([0.0, 0.0, sin(elevation)]) - cos(elevation) * across
    else:
        toward = np.array([0.0, 0.0, cos(_ASIDE)]) + sin(_ASIDE) * np.cross(uphill, [0.0, 0.0, 1.0])
    return axes_toward(toward, against_gravity(motion))


@dataclass(frozen=True)
class Camera:
    """A view without perspective.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Unit vectors to the right, up and toward the camera (`camera_axes`).
    low, high : ndarray, shape (3,)
        What it takes in, along these axes, mm.
    """

    axes: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def around(cls, motion: Motion, axes: FloatArray, *, share: float = 1.0, shaken: bool = True) -> Camera:
        """A camera that sees all that beads reach, and the width and the floor of a container.

        Parameters
        ----------
        motion
            Of the beads.
        axes
            From which it is seen.
        share
            Height and width of the picture over those of what is seen.
        shaken
            Whether it rests in the laboratory, else on the boundary.
        """
        seen = 1e3 * (motion.position + motion.substrate[:, None] if shaken else motion.position) @ axes.T
        radius = 1e3 * motion.radius[:, None]
        low, high = (seen - radius).min(axis=(0, 1)), (seen + radius).max(axis=(0, 1))
        if motion.case.boundary.closed:
            half = 1e3 * motion.case.boundary.inner_width / 2.0
            low[:2], high[0] = np.minimum(low[:2], [-half, 0.0]), max(high[0], half)
        wider = (share - 1.0) / 2.0 * (high - low)
        return cls(axes, low - wider, high + wider)

    @property
    def middle(self) -> FloatArray:
        """Of what is seen, mm."""
        middle: FloatArray = (self.low + self.high) / 2.0 @ self.axes
        return middle

    def height(self, aspect: float) -> float:
        """Of the picture, mm, whose width is so many times that."""
        right, up, _ = self.high - self.low
        return float(max(up, right / aspect))

    def place(self, distance: float) -> FloatArray:
        """A point so far before the middle, mm."""
        place: FloatArray = self.middle + distance * self.axes[2]
        return place


class Window:
    """A window off-screen onto a run, without perspective, so that a scale bar holds: walls, beads and their shadows.

    Parameters
    ----------
    motion
        Whose beads, floor or walls are seen.
    camera
        From where.
    size
        Pixels across and up.
    rolling
        Whether beads are two-coloured, to be seen to roll.

    Attributes
    ----------
    pixels_per_mm
        In the picture.
    """

    def __init__(self, motion: Motion, camera: Camera, size: Sequence[int], *, rolling: bool = False) -> None:
        # Without this VTK tries an X server first and says so.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import pyvista as pv

        bare, closed = motion.case.boundary.bare, motion.case.boundary.closed
        self._plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
        self._plotter.background_color = pv.Color(_GROUND if bare else "white")
        tall, wide = camera.height(size[0] / size[1]), camera.height(size[0] / size[1]) * size[0] / size[1]
        self.pixels_per_mm = size[1] / tall
        self._plotter.camera_position = [camera.place(10.0 * tall), camera.middle, camera.axes[1]]
        self._plotter.camera.parallel_projection, self._plotter.camera.parallel_scale = True, tall / 2.0
        around = self._add_floor if bare else self._add_walls
        self._around: list[pv.Actor] = around(motion, camera, max(wide, tall))
        self._plotter.camera.clipping_range = (0.1 * tall, 40.0 * max(tall, wide))
        level = np.array([0.0, 0.0, 1.0])
        axes = np.eye(3) if closed else axes_toward(level, np.cross(level, motion.case.drive_axis))
        self._shadows = _Shadows(self._plotter, 1e3 * motion.radius) if bare else None
        self._beads = _Beads(self._plotter, motion, axes if rolling else None)

    def picture(
        self,
        place: FloatArray,
        coloured: Collection[int],
        shift: FloatArray | None = None,
        turned: FloatArray | None = None,
    ) -> Picture:
        """Beads at places relative to the boundary (m), some coloured, all shifted with it, turned by matrices."""
        shift = np.zeros(3) if shift is None else 1e3 * shift
        self._beads.colour(coloured)
        self._beads.move(1e3 * place + shift, turned)
        if self._shadows is not None:
            self._shadows.move(1e3 * place + shift, float(shift[2]))
        for actor in self._around:
            actor.position = tuple(shift)
        self._plotter.render()  # a screenshot does so the first time only
        return np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)

    def close(self) -> None:
        """Give back the window."""
        self._plotter.close()

    def _add_floor(self, motion: Motion, camera: Camera, wide: float) -> list[pv.Actor]:
        """A floor with lines, by which it is seen to move."""
        import pyvista as pv

        del motion
        spacing, half = round_below(wide / 8.0), _BEYOND * wide / 2.0
        x, y = (np.round(place / spacing) * spacing for place in camera.middle[:2])
        marks = spacing * np.arange(-int(half / spacing), int(half / spacing) + 1)
        along = np.array([[[x - half, y + mark, 0.0], [x + half, y + mark, 0.0]] for mark in marks])
        across = np.array([[[x + mark, y - half, 0.0], [x + mark, y + half, 0.0]] for mark in marks])
        floor = pv.Plane(center=(x, y, -2e-3 * wide), i_size=2.0 * half, j_size=2.0 * half, direction=(0.0, 0.0, 1.0))
        lines = lines_between(np.concatenate([along, across]) - [0.0, 0.0, 1e-3 * wide])
        return [
            self._plotter.add_mesh(floor, color=_GROUND, lighting=False),
            self._plotter.add_mesh(lines, color=_LINES, line_width=2, lighting=False),
        ]

    def _add_walls(self, motion: Motion, camera: Camera, wide: float) -> list[pv.Actor]:
        """Walls, of which those that would hide the beads are left out; their edges nearer, lest walls hide them."""
        walls = boundary_of(motion).scale(1e3, inplace=False).clean(tolerance=1e-6, absolute=True)
        drawn = self._plotter.add_mesh(walls, color=_WALL, lighting=False)
        drawn.prop.culling = "back"
        edges = walls.extract_feature_edges(feature_angle=30.0, manifold_edges=False, non_manifold_edges=False)
        edges.translate(1e-2 * wide * camera.axes[2], inplace=True)
        return [drawn, self._plotter.add_mesh(edges, color=_EDGE, line_width=2, lighting=False)]


def round_below(value: float) -> float:
    """The largest of …, 1, 2, 5, 10, … that is no larger."""
    decade = 10.0 ** np.floor(np.log10(value) + 1e-9)
    return float(decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= value * (1.0 + 1e-9)))


def beach_ball(rounds: int) -> tuple[FloatArray, npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """A unit ball of so many cells around (a multiple of six) and half as many along its axis, which is y.

    Returns
    -------
    vertices : ndarray, shape (V, 3)
        Its normals too; lunes share none.
    triangles : ndarray, shape (T, 3)
    pale
        Whether a vertex is of one of the paler lunes, shape (V,).
    """
    around, down = rounds // _LUNES, rounds // 2
    angle = np.array([np.linspace(lune, lune + 1, around + 1) for lune in range(_LUNES)]) * 2.0 * np.pi / _LUNES
    lower, turn = np.meshgrid(np.linspace(0.0, np.pi, down + 1), angle)
    vertices = np.stack([np.sin(lower) * np.cos(turn), np.cos(lower), np.sin(lower) * np.sin(turn)], axis=-1)
    corner = np.arange(len(vertices) * (down + 1)).reshape(_LUNES, around + 1, down + 1)
    one, beside = corner[:, :-1, :-1].ravel(), corner[:, 1:, :-1].ravel()
    triangles = np.concatenate([np.stack([one, beside, beside + 1], 1), np.stack([one, beside + 1, one + 1], 1)])
    pale = np.repeat(np.arange(_LUNES) % 2 == 1, (around + 1) * (down + 1))
    return vertices.reshape(-1, 3).astype(np.float32), triangles, pale


def _copies(points: int, triangles: npt.NDArray[np.int64], count: int) -> pv.PolyData:
    """A mesh of so many copies of triangles, each with points of its own."""
    import pyvista as pv

    faces = np.full((count, len(triangles), 4), 3, dtype=np.int64)
    faces[:, :, 1:] = triangles + (np.arange(count) * points)[:, None, None]
    return pv.PolyData(np.zeros((count * points, 3), dtype=np.float32), faces.ravel())


class _Beads:
    """All beads as one mesh, in mm, which is moved, turned and coloured from frame to frame.

    Lunes, where beads are to be seen to roll, are about the second of some axes; None for beads of one colour.
    """

    def __init__(self, plotter: pv.Plotter, motion: Motion, axes: FloatArray | None) -> None:
        count = len(motion.radius)
        ball, triangles, pale = beach_ball(
            72 if count < _SINGLE else 30 if count < _FEW else 18 if count < _MANY else 12
        )
        self._pale = pale if axes is not None else np.zeros_like(pale)
        self._ball = ball if axes is None else (ball @ axes).astype(np.float32)
        self._radius, self._large = (1e3 * motion.radius).astype(np.float32), motion.large
        self._mesh = _copies(len(ball), triangles, count)
        self._mesh.point_data["Normals"] = np.zeros((self._mesh.n_points, 3), dtype=np.float32)
        self._mesh.point_data.active_normals_name = "Normals"
        self._mesh.point_data["colour"] = np.zeros((self._mesh.n_points, 3), dtype=np.uint8)
        self._coloured: frozenset[int] | None = None
        drawn = plotter.add_mesh(self._mesh, scalars="colour", rgb=True, specular=0.4, smooth_shading=False)
        drawn.prop.culling = "back"  # the far halves of spheres, half of the work, are never seen
        drawn.prop.interpolation = "Phong"  # by these normals, where pyvista would compute others

    def move(self, centres: FloatArray, turned: FloatArray | None) -> None:
        """Put them at centres (mm, shape (N, 3)), turned by rotation matrices (shape (N, 3, 3)) if that is known."""
        # A sphere's own points are its normals: smooth without computing any.
        if turned is None:
            normals = np.broadcast_to(self._ball, (len(centres), *self._ball.shape))
        else:
            normals = self._ball @ np.swapaxes(turned.astype(np.float32), 1, 2)
        points = self._radius[:, None, None] * np.asarray(normals, np.float32) + centres[:, None].astype(np.float32)
        self._mesh.points = points.reshape(-1, 3)
        self._mesh.point_data["Normals"] = np.ascontiguousarray(normals.reshape(-1, 3))

    def colour(self, coloured: Collection[int]) -> None:
        """Give some beads the colours of those that are pointed out, all others those of glass."""
        import pyvista as pv

        if self._coloured == frozenset(coloured):
            return
        self._coloured = frozenset(coloured)
        chosen = np.isin(np.arange(len(self._large)), list(coloured))
        rgb = np.array([[pv.Color(name).int_rgb for name in names] for names in (GLASS, RUBY)], dtype=np.float64)
        plain = rgb[chosen.astype(int), (~self._large).astype(int)]
        pale = plain + _PALE * (255.0 - plain)
        if self._pale.any():
            plain = plain * np.minimum(1.0, _BRIGHTEST / plain.mean(axis=1))[:, None]
        colours = np.where(self._pale[None, :, None], pale[:, None], plain[:, None])
        self._mesh.point_data["colour"] = colours.reshape(-1, 3).round().astype(np.uint8)


class _Shadows:
    """A soft dark disc below each bead, on the floor z = 0; radii in mm."""

    def __init__(self, plotter: pv.Plotter, radius: FloatArray) -> None:
        import pyvista as pv

        disc = pv.Disc(inner=0.0, outer=1.0, r_res=8, c_res=48).triangulate()
        points = np.asarray(disc.points)
        self._discs = radius[:, None, None] * points
        self._mesh = _copies(len(points), disc.faces.reshape(-1, 4)[:, 1:].astype(np.int64), len(radius))
        share = np.linalg.norm(points, axis=1)
        rgba = np.zeros((len(points), 4), dtype=np.uint8)
        rgba[:, 3] = (255.0 * _SHADOW * (1.0 - share**2) ** 2).round()
        self._mesh.point_data["shadow"] = np.tile(rgba, (len(radius), 1))
        plotter.add_mesh(self._mesh, scalars="shadow", rgb=True, lighting=False)

    def move(self, centres: FloatArray, level: float) -> None:
        """Put them below beads (mm, shape (N, 3)) on a floor at a level."""
        below = centres * [1.0, 1.0, 0.0] + [0.0, 0.0, level]
        self._mesh.points = (self._discs + below[:, None]).reshape(-1, 3).astype(np.float32)
