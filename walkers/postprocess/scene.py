"""What pictures and films are made of: a window off-screen, the camera's place, beads as one mesh, their colours."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from math import cos, pi, radians, sin
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion
from walkers.postprocess.piles import Pile, analyse

if TYPE_CHECKING:
    import pyvista as pv

Picture = npt.NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
RUBY = ("#b0203c", "#e0566c")
GLASS = ("#8c9aa5", "#c9d2d8")
"""Large and small beads, of those that are pointed out and of the others."""
FLOOR = "#c9d2d8"
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
"""Beads from which on spheres are drawn coarser; a lune's edges are edges of their cells."""


def new_plotter(size: Sequence[int], background: str) -> pv.Plotter:
    """A window off-screen, of a size in pixels."""
    # Without this VTK tries an X server first and says so.
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
    plotter.background_color = pv.Color(background)
    return plotter


def pointed_out(motion: Motion) -> Callable[[int], set[int]]:
    """What gives, for a frame, the beads to colour: those of walkers, and of the clusters that climb and are free."""
    walkers = set(np.flatnonzero(motion.walker_of >= 0).tolist())
    if not Pile().applies(motion.case):
        return lambda _: walkers
    found = analyse(motion)
    climbing = [track for track, climb in zip(found.tracks, found.climbs, strict=True) if climb.climbed]
    return lambda frame: walkers | {bead for track in climbing for bead in track.members_at(frame)}


def against_gravity(motion: Motion) -> FloatArray:
    """A unit vector against gravity in the boundary's frame; without gravity its normal."""
    against = -np.array(motion.case.gravity_vector)
    return against / np.linalg.norm(against) if against.any() else np.array([0.0, 0.0, 1.0])


def camera_axes(motion: Motion) -> FloatArray:
    """Unit vectors to the right and up in the picture and toward the camera, in the boundary's frame, as rows.

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
    against = against_gravity(motion)
    up = against - (against @ toward) * toward
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, toward), up, toward])


class Beads:
    """All beads as one mesh, in mm, which is moved, turned and coloured from frame to frame.

    Parameters
    ----------
    plotter
        The window to add them to.
    radius
        m, shape (N,).
    large
        Whether each is of the large class, shape (N,).
    axis
        Of the lunes, a unit vector, where beads are to be seen to roll; None for beads of one colour.
    """

    def __init__(
        self,
        plotter: pv.Plotter,
        radius: FloatArray,
        large: npt.NDArray[np.bool_],
        axis: Sequence[float] | FloatArray | None = None,
    ) -> None:
        import pyvista as pv

        count = len(radius)
        rounds = 72 if count < _SINGLE else 30 if count < _FEW else 18 if count < _MANY else 12
        ball = pv.Sphere(radius=1.0, theta_resolution=rounds, phi_resolution=rounds)
        centres = ball.cell_centers().points
        angle = np.arctan2(centres[:, 1], centres[:, 0]) / (2.0 * np.pi) % 1.0
        self._pale = (_LUNES * angle).astype(int) % 2 == 1 if axis is not None else np.zeros(ball.n_cells, dtype=bool)
        self._sphere = np.asarray(ball.points, dtype=np.float32)
        if axis is not None:
            self._sphere = self._sphere @ _axes_with(np.asarray(axis, dtype=np.float64)).astype(np.float32)
        self._radius, self._large = (1e3 * radius).astype(np.float32), large
        first = np.arange(count, dtype=np.int64) * ball.n_points
        faces = np.tile(ball.faces.reshape(-1, 4).astype(np.int64), (count, 1, 1))
        faces[:, :, 1:] += first[:, None, None]
        self._mesh = pv.PolyData(np.zeros((count * ball.n_points, 3), dtype=np.float32), faces.ravel())
        self._mesh.point_data["Normals"] = np.zeros((self._mesh.n_points, 3), dtype=np.float32)
        self._mesh.point_data.active_normals_name = "Normals"
        self._mesh.cell_data["colour"] = np.zeros((self._mesh.n_cells, 3), dtype=np.uint8)
        self._coloured: frozenset[int] | None = None
        drawn = plotter.add_mesh(self._mesh, scalars="colour", rgb=True, specular=0.4, smooth_shading=False)
        drawn.prop.culling = "back"  # the far halves of spheres, half of the work, are never seen
        drawn.prop.interpolation = "Phong"  # by these normals, where pyvista would compute others

    def move(self, centres: FloatArray, turned: FloatArray | None = None) -> None:
        """Put them at centres (mm, shape (N, 3)), turned by rotation matrices (shape (N, 3, 3)) if that is known."""
        # A sphere's own points are its normals: smooth without computing any.
        if turned is None:
            normals = np.broadcast_to(self._sphere, (len(centres), *self._sphere.shape))
        else:
            normals = self._sphere @ np.swapaxes(turned.astype(np.float32), 1, 2)
        points = self._radius[:, None, None] * normals + centres[:, None].astype(np.float32)
        self._mesh.points = points.reshape(-1, 3)
        self._mesh.point_data["Normals"] = np.ascontiguousarray(normals.reshape(-1, 3))

    def colour(self, coloured: Collection[int]) -> None:
        """Give some beads the colours of those that are pointed out, all others those of glass."""
        import pyvista as pv

        if self._coloured == frozenset(coloured):
            return
        self._coloured = frozenset(coloured)
        chosen = np.zeros(len(self._large), dtype=bool)
        chosen[list(coloured)] = True
        rgb = np.array([[pv.Color(name).int_rgb for name in names] for names in (GLASS, RUBY)], dtype=np.float64)
        plain = rgb[chosen.astype(int), (~self._large).astype(int)]
        pale = plain + _PALE * (255.0 - plain)
        if self._pale.any():
            plain = plain * np.minimum(1.0, _BRIGHTEST / plain.mean(axis=1))[:, None]
        colours = np.where(self._pale[None, :, None], pale[:, None], plain[:, None])
        self._mesh.cell_data["colour"] = colours.reshape(-1, 3).round().astype(np.uint8)


def _axes_with(third: FloatArray) -> FloatArray:
    """Three orthonormal vectors, as rows, of which the third one is given."""
    first = np.cross(third, np.eye(3)[int(np.argmin(np.abs(third)))])
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(third, first), third])
