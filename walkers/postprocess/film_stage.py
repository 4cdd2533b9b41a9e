"""The stage of a film: camera, floor or walls, and beads that move, roll and cast shadows on the floor."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.film_times import round_below
from walkers.postprocess.motion import Motion
from walkers.postprocess.paraview import boundary_of, lines_between
from walkers.postprocess.scene import Beads, Picture, camera_axes, new_plotter

if TYPE_CHECKING:
    import pyvista as pv

_GROUND, _LINES, _WALL, _EDGE = "#e3e8eb", "#bcc6cd", "#eef1f3", "#5a6670"
_AROUND = 1.2
"""Height and width of the picture over those of what the beads reach."""
_SHADOW = 0.4
"""Of black in a shadow, where a bead stands."""
_BEYOND = 6.0
"""Extent of the floor over that of the picture: it has no end."""


class Stage:
    """A window onto a run, seen by a camera at rest in the laboratory, without perspective so that a scale bar holds.

    Parameters
    ----------
    motion
        All that is to be seen; the picture takes it in from its first frame to its last.
    size
        Pixels across and up.
    rolling
        Whether beads are two-coloured, to be seen to roll.

    Attributes
    ----------
    pixels_per_mm
        In the picture.
    """

    def __init__(self, motion: Motion, size: tuple[int, int], *, rolling: bool) -> None:
        self._bare = motion.case.boundary.bare
        self._plotter = new_plotter(size, _GROUND if self._bare else "white")
        right, up, toward = camera_axes(motion)
        seen = 1e3 * (motion.position + motion.substrate[:, None])
        radius = 1e3 * motion.radius[:, None]
        low, high = [], []
        for axis in (right, up):
            along = (seen @ axis)[..., None]
            low.append(float((along - radius).min()))
            high.append(float((along + radius).max()))
        if motion.case.boundary.closed:
            low[1] = min(low[1], 0.0)
            half = 1e3 * motion.case.boundary.inner_width / 2.0
            low[0], high[0] = min(low[0], -half), max(high[0], half)
        tall = _AROUND * max(high[1] - low[1], (high[0] - low[0]) * size[1] / size[0])
        self.pixels_per_mm = size[1] / tall
        middle = right * (low[0] + high[0]) / 2.0 + up * (low[1] + high[1]) / 2.0
        middle += toward * float((seen @ toward).mean())
        camera = self._plotter.camera
        self._plotter.camera_position = [middle + 10.0 * tall * toward, middle, up]
        camera.parallel_projection, camera.parallel_scale = True, tall / 2.0
        wide = tall * size[0] / size[1]
        self._around: list[pv.Actor] = (
            self._add_floor(seen.mean(axis=(0, 1)), wide)
            if self._bare
            else self._add_walls(motion, 1e-2 * tall * toward)
        )
        camera.clipping_range = (0.1 * tall, 40.0 * max(tall, wide))
        axis = (0.0, 1.0, 0.0) if motion.case.boundary.closed else np.cross([0.0, 0.0, 1.0], motion.case.drive_axis)
        self._shadows = _Shadows(self._plotter, 1e3 * motion.radius) if self._bare else None
        self._beads = Beads(self._plotter, motion.radius, motion.large, axis if rolling else None)

    def picture(
        self, place: FloatArray, shift: FloatArray, turned: FloatArray | None, coloured: Collection[int]
    ) -> Picture:
        """Beads at places relative to the boundary (m), all shifted with it, turned by matrices, some coloured."""
        self._beads.colour(coloured)
        self._beads.move(1e3 * (place + shift), turned)
        if self._shadows is not None:
            self._shadows.move(1e3 * (place + shift), 1e3 * float(shift[2]))
        for actor in self._around:
            actor.position = tuple(1e3 * shift)
        self._plotter.render()
        return np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)

    def close(self) -> None:
        """Give back the window."""
        self._plotter.close()

    def _add_floor(self, middle: FloatArray, wide: float) -> list[pv.Actor]:
        """A floor with lines, by which it is seen to move."""
        import pyvista as pv

        spacing, half = round_below(wide / 8.0), _BEYOND * wide / 2.0
        x, y = (np.round(place / spacing) * spacing for place in middle[:2])
        marks = spacing * np.arange(-int(half / spacing), int(half / spacing) + 1)
        along = np.array([[[x - half, y + mark, 0.0], [x + half, y + mark, 0.0]] for mark in marks])
        across = np.array([[[x + mark, y - half, 0.0], [x + mark, y + half, 0.0]] for mark in marks])
        floor = pv.Plane(center=(x, y, -2e-3 * wide), i_size=2.0 * half, j_size=2.0 * half, direction=(0.0, 0.0, 1.0))
        lines = lines_between(np.concatenate([along, across]) - [0.0, 0.0, 1e-3 * wide])
        return [
            self._plotter.add_mesh(floor, color=_GROUND, lighting=False),
            self._plotter.add_mesh(lines, color=_LINES, line_width=2, lighting=False),
        ]

    def _add_walls(self, motion: Motion, nearer: FloatArray) -> list[pv.Actor]:
        """Walls, of which those that would hide the beads are left out; their edges nearer, lest walls hide them."""
        walls = boundary_of(motion).scale(1e3, inplace=False).clean(tolerance=1e-6, absolute=True)
        drawn = self._plotter.add_mesh(walls, color=_WALL, lighting=False)
        drawn.prop.culling = "back"
        edges = walls.extract_feature_edges(feature_angle=30.0, manifold_edges=False, non_manifold_edges=False)
        edges.translate(nearer, inplace=True)
        return [drawn, self._plotter.add_mesh(edges, color=_EDGE, line_width=2, lighting=False)]


class _Shadows:
    """A soft dark disc below each bead, on the floor z = 0; radii in mm."""

    def __init__(self, plotter: pv.Plotter, radius: FloatArray) -> None:
        import pyvista as pv

        disc = pv.Disc(inner=0.0, outer=1.0, r_res=8, c_res=48).triangulate()
        count, points = len(radius), np.asarray(disc.points)
        faces = np.tile(disc.faces.reshape(-1, 4).astype(np.int64), (count, 1, 1))
        faces[:, :, 1:] += (np.arange(count) * len(points))[:, None, None]
        self._discs = radius[:, None, None] * points
        self._mesh = pv.PolyData(self._discs.reshape(-1, 3).astype(np.float32), faces.ravel())
        share = np.linalg.norm(points, axis=1)
        rgba = np.zeros((len(points), 4), dtype=np.uint8)
        rgba[:, 3] = (255.0 * _SHADOW * (1.0 - share**2) ** 2).round()
        self._mesh.point_data["shadow"] = np.tile(rgba, (count, 1))
        plotter.add_mesh(self._mesh, scalars="shadow", rgb=True, lighting=False)

    def move(self, centres: FloatArray, level: float) -> None:
        """Put them below beads (mm, shape (N, 3)) on a floor at a level."""
        below = centres * [1.0, 1.0, 0.0] + [0.0, 0.0, level]
        self._mesh.points = (self._discs + below[:, None]).reshape(-1, 3).astype(np.float32)
