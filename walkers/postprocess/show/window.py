"""Off-screen window that draws pictures of a scene (PyVista)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.postprocess.measure.motion import between, visible_displacement
from walkers.postprocess.show.meshes import beach_ball, floor_lines, mesh_of, round_below, walls_of
from walkers.postprocess.show.necks import (
    NECK_COLOUR,
    NECK_OPACITY,
    NO_BRIDGES,
    at_front_walls,
    bridge_ends,
    neck_surfaces,
    neck_triangles,
)
from walkers.postprocess.show.scene import Scene, rotations_at

if TYPE_CHECKING:
    import pyvista as pv


Picture = npt.NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
_GROUND, _LINES, _WALL, _EDGE = "#e3e8eb", "#bcc6cd", "#eef1f3", "#5a6670"
_SHADOW = 0.4  # opacity of a shadow below the centre of a bead
_FINE = ((10, 72, (9, 36)), (100, 30, (7, 24)), (500, 18, (5, 12)), (np.inf, 12, (3, 8)))
"""For fewer beads than the first number: cells around a ball; rings and sides of a neck."""
_FINER = 1.5  # pixels that are drawn over those of the picture, in each direction
_BEYOND = 6.0  # extent of the floor over that of the picture


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
        liquid = pv.Property(color=f"#{NECK_COLOUR:06x}", opacity=NECK_OPACITY, **look)
        self._necks = pv.Actor(mapper=pv.DataSetMapper(), prop=liquid)
        self._necks.mapper.scalar_visibility = False
        self._plotter.add_actor(self._necks, reset_camera=False, render=False)

    def picture(self, frame: float, bridges: IntArray = NO_BRIDGES) -> Picture:
        """Picture of a frame, or of a time between two frames (a fraction) by cubic interpolation.

        Bridges are contacts as in `walkers.postprocess.measure.motion.Bridges`.
        """
        from PIL import Image

        motion, shift, number = self._scene.motion, np.zeros(3), int(frame)
        place, share, turned = motion.position[number], frame - number, self._scene.orientations
        if share:
            place = between(motion.select(slice(number, number + 2)), share)[0]
        if self._scene.shaken:
            time = np.interp([frame], np.arange(len(motion.time)), motion.time)
            shift = 1e3 * visible_displacement(motion.case.excitation, time)[0]
        self._beads.colour(
            self._scene.colours(self._scene.highlighted[number])[self._pale].swapaxes(0, 1)
        )
        self._beads.move(
            1e3 * place + shift, None if turned is None else rotations_at(turned, frame)
        )
        if self._bare:
            self._shadows.move(1e3 * place * [1.0, 1.0, 0.0] + shift)
        self._wet(place, bridges, shift)
        for actor in self._around:
            actor.position = tuple(shift)
        moved = self._scene.camera_displacement(frame)
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
        begins, ends = bridge_ends(motion, place, bridges)
        before = at_front_walls(motion, bridges, (begins, ends), self._scene.axes[2])
        contacts, between = bridges[~before], (begins[~before], ends[~before])
        self._necks.visibility = bool(len(contacts))
        if not len(contacts):
            return
        points, normals = (
            array.reshape(-1, 3) for array in neck_surfaces(motion, contacts, between, *self._round)
        )
        necks = pv.PolyData.from_regular_faces(
            points + shift, neck_triangles(len(contacts), *self._round)
        )
        necks.point_data["Normals"] = normals
        necks.point_data.active_normals_name = "Normals"
        self._necks.mapper.SetInputData(necks)

    def _floor(self, wide: float) -> list[pv.Actor]:
        """Lines that make the motion of a floor visible, which is as bright as the background."""
        import pyvista as pv

        path = np.zeros((1, 3)) if self._scene.camera_path is None else self._scene.camera_path
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
        if self._scene.camera_path is not None:
            marks = self._marks(
                faces,
                int(np.argmax(np.ptp(self._scene.camera_path, axis=0))),
                round_below(wide / 8.0),
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
