"""Off-screen window that draws pictures of a scene with VTK, through PyVista."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.postprocess.measure.motion import interpolated_positions, visible_displacement
from walkers.postprocess.show.meshes import beach_ball, floor_lines, mesh_of, round_below, walls_of
from walkers.postprocess.show.necks import (
    NECK_COLOUR,
    NECK_OPACITY,
    NO_BRIDGES,
    Ends,
    NeckGrid,
    at_front_walls,
    bridge_ends,
    drawn_share,
    neck_surfaces,
    neck_triangles,
)
from walkers.postprocess.show.offscreen import prepare_drawing
from walkers.postprocess.show.scene import FloorGrid, Scene, rotations_at

if TYPE_CHECKING:
    import pyvista as pv

Picture = npt.NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
_GROUND = "#e3e8eb"
"""Colour of an open floor."""
_LINES = "#bcc6cd"
"""Colour of lines on floors and walls."""
_WALL = "#eef1f3"
"""Colour of walls."""
_FLOOR = "#d3dade"
"""Colour of the floor of a container in perspective."""
_LEVEL = 1e-3
"""Largest height of the corners of a floor over the larger side of the view."""
_PANE = "#8fb3c9"
"""Colour of walls in front of the beads."""
_PANE_OPACITY = 0.07
"""Opacity of these walls, from 0 to 1."""
_EDGE = "#5a6670"
"""Colour of the edges of walls."""
_SHADOW = 0.4
"""Opacity of a shadow below the centre of a bead."""
_AMBIENT = 0.18
"""Share of light from everywhere on beads, without which their lower halves would be black."""
_OCCLUSION_REACH = 1.5
"""Distance within which other beads keep light away, over the mean radius."""
_OCCLUSION_BIAS = 0.03
"""Distance that a surface does not shade itself, over this distance."""
_SUPERSAMPLING = 1.5
"""Pixels that are drawn over those of the picture, in each direction."""
_FLOOR_EXTENT = 6.0
"""Extent of the floor over that of the picture."""
_NEAREST_SHOWN = 0.1
"""Smallest distance from the camera that is drawn, over the height of the view."""
_FARTHEST_SHOWN = 40.0
"""Largest distance from the camera that is drawn, over the larger side of the view."""
_LINES_PER_EXTENT = 8.0
"""About this many lines of a floor or a wall are across the larger side of the view."""


@dataclass(frozen=True)
class _Detail:
    """How finely a number of beads is drawn.

    Attributes
    ----------
    beads
        There are fewer beads than this.
    cells
        Cells around a ball, a multiple of six.
    necks
        Rings and sides of a neck.
    """

    beads: float
    cells: int
    necks: NeckGrid


_DETAILS = (
    _Detail(10, 96, NeckGrid(13, 72)),
    _Detail(100, 36, NeckGrid(7, 30)),
    _Detail(500, 18, NeckGrid(5, 12)),
    _Detail(np.inf, 12, NeckGrid(3, 8)),
)
"""From few beads to many."""


class Window:
    """An off-screen window that shows a scene; close it after use.

    Parameters
    ----------
    scene
        The scene.
    size
        Width and height of pictures in pixels.
    occlusion
        Whether places between beads that little light reaches are darker. A picture then takes some
        five times as long.

    Attributes
    ----------
    pixels_per_mm : float
        Resolution of the pictures.

    Raises
    ------
    InputError
        If this machine cannot draw without a screen.
    """

    def __init__(self, scene: Scene, size: Sequence[int], *, occlusion: bool = False) -> None:
        prepare_drawing()
        import pyvista as pv

        width, height = size
        is_open_floor = scene.motion.case.boundary.is_open_floor
        self._scene = scene
        self._size = (width, height)
        finer_size = [round(_SUPERSAMPLING * width), round(_SUPERSAMPLING * height)]
        # VTK mostly renders in software here. There, a finer picture that is reduced afterwards
        # smooths edges, and simple blending shows what is transparent, in half of the time of VTK's
        # own anti-aliasing and order-independent blending.
        self._plotter = pv.Plotter(off_screen=True, window_size=finer_size, lighting="light kit")
        self._plotter.disable_anti_aliasing()
        self._plotter.renderer.SetUseOIT(False)
        self._plotter.background_color = pv.Color(_GROUND if is_open_floor else "white")

        height_mm = scene.height(width / height)
        extent_mm = max(height_mm, height_mm * width / height)
        self.pixels_per_mm = height / height_mm
        distance_mm = scene.camera_distance(height_mm)
        self._camera_position, self._middle, up = scene.camera(distance_mm)
        self._plotter.camera_position = [self._camera_position, self._middle, up]
        self._plotter.camera.parallel_projection = not scene.angle_of_view
        self._plotter.camera.parallel_scale = height_mm / 2.0
        if scene.angle_of_view:
            self._plotter.camera.view_angle = scene.angle_of_view

        # Without a floor there is nothing on which shadows could lie.
        self._shadows: _Copies | None = None
        if is_open_floor:
            self._boundary = self._add_floor(extent_mm)
            self._shadows = self._add_shadows()
        else:
            self._boundary = self._add_walls(extent_mm)
        nearest_mm = _NEAREST_SHOWN * height_mm
        self._plotter.camera.clipping_range = (nearest_mm, _FARTHEST_SHOWN * extent_mm)
        count = len(scene.motion.radius)
        detail = next(detail for detail in _DETAILS if count < detail.beads)
        self._neck_grid = detail.necks
        points, triangles, self._shade_of_point = beach_ball(detail.cells, scene.motion)
        black = np.zeros((count, len(points), 3))  # until `picture` colours the beads
        self._beads = _Copies(self._plotter, points, triangles, 1e3 * scene.motion.radius, black)
        self._beads.reflection.specular = 0.4
        self._beads.reflection.ambient = _AMBIENT
        self._beads.reflection.diffuse = 1.0 - _AMBIENT / 2.0
        self._necks = self._add_necks()
        if occlusion:
            reach = _OCCLUSION_REACH * 1e3 * float(scene.motion.radius.mean())
            self._plotter.enable_ssao(  # type: ignore[call-arg]
                radius=reach, bias=_OCCLUSION_BIAS * reach, kernel_size=64, blur=True
            )

    def picture(self, frame: float, bridges: IntArray = NO_BRIDGES) -> Picture:
        """Draw the scene at a frame or between two frames.

        Parameters
        ----------
        frame
            Number of a frame, from 0. With a fraction, positions between two frames are
            interpolated by a cubic.
        bridges : ndarray of int, shape (K, 3)
            Contacts with a bridge: two beads and −1, or a bead, −1 and a wall, by their indices
            (`walkers.postprocess.measure.motion.Bridges`).

        Returns
        -------
        Picture
            Colours of the pixels, 0 to 255, shape (height, width, 3).
        """
        from PIL import Image

        position = self._position_at(frame)
        shift = self._shift_at(frame)
        self._move_beads(position, shift, frame)
        if self._shadows is not None:
            self._shadows.move(1e3 * position * [1.0, 1.0, 0.0] + shift)
        self._draw_necks(position, bridges, shift)
        for actor in self._boundary:
            actor.position = tuple(shift)
        displacement = self._scene.camera_displacement(frame)
        # PyVista's own setters also look for the limits of the scene.
        self._plotter.camera.SetPosition(self._camera_position + displacement)
        self._plotter.camera.SetFocalPoint(self._middle + displacement)
        self._plotter.render()  # a screenshot alone renders only the first time
        pixels = np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)
        return np.asarray(Image.fromarray(pixels).resize(self._size, Image.Resampling.BOX))

    def close(self) -> None:
        """Close the window."""
        self._plotter.close()

    def _position_at(self, frame: float) -> FloatArray:
        """Centres of the beads relative to the boundary, m, shape (N, 3).

        ``frame`` is the number of a frame, with a fraction between two frames.
        """
        motion = self._scene.motion
        number = int(frame)
        fraction = frame - number
        if not fraction:
            return np.asarray(motion.position[number])
        return np.asarray(
            interpolated_positions(motion.select(slice(number, number + 2)), fraction)[0]
        )

    def _shift_at(self, frame: float) -> FloatArray:
        """Displacement of the boundary in the view at a frame, mm, shape (3,)."""
        if not self._scene.shaken:
            return np.zeros(3)
        motion = self._scene.motion
        time = np.interp([frame], np.arange(len(motion.time)), motion.time)
        return np.asarray(1e3 * visible_displacement(motion.case.excitation, time)[0])

    def _move_beads(self, position: FloatArray, shift: FloatArray, frame: float) -> None:
        """Colour the beads, turn them, and move them to their positions (m) and a shift (mm)."""
        scene = self._scene
        colours = scene.colours(scene.highlighted[int(frame)])
        self._beads.colour(colours[self._shade_of_point].swapaxes(0, 1))
        rotations = None
        if scene.orientations is not None:
            rotations = rotations_at(scene.orientations, frame)
        self._beads.move(1e3 * position + shift, rotations)

    def _draw_necks(self, position: FloatArray, bridges: IntArray, shift: FloatArray) -> None:
        """Draw the liquid necks of bridges.

        Walls between the camera and the beads are not drawn, nor are the necks to them.

        Parameters
        ----------
        position : ndarray, shape (N, 3)
            Positions of the beads, m.
        bridges : ndarray, shape (K, 3)
            Contacts with bridges, as in `picture`.
        shift : ndarray, shape (3,)
            Displacement of the boundary in the view, mm (`_shift_at`).
        """
        import pyvista as pv

        motion = self._scene.motion
        ends = bridge_ends(motion, position, bridges)
        toward_camera = self._scene.axes[2]
        is_visible = ~at_front_walls(motion, bridges, ends, toward_camera)
        contacts = bridges[is_visible]
        self._necks.visibility = bool(len(contacts))
        if not len(contacts):
            return
        visible_ends = Ends(ends.first[is_visible], ends.second[is_visible])
        share = drawn_share(self._neck_grid)
        points, normals = neck_surfaces(motion, contacts, visible_ends, self._neck_grid, share)
        triangles = neck_triangles(len(contacts), self._neck_grid)
        # `neck_surfaces` gives mm, as the shift.
        necks = pv.PolyData.from_regular_faces(points.reshape(-1, 3) + shift, triangles)
        necks.point_data["Normals"] = normals.reshape(-1, 3)
        necks.point_data.active_normals_name = "Normals"
        self._necks.mapper.SetInputData(necks)

    def _add_necks(self) -> pv.Actor:
        """Add an actor for the necks, without a shape as yet."""
        import pyvista as pv

        liquid = pv.Property(
            color=f"#{NECK_COLOUR:06x}",
            opacity=NECK_OPACITY,
            ambient=0.45,
            diffuse=0.75,
            specular=0.4,
            culling="back",
            interpolation="Phong",
        )
        necks = pv.Actor(mapper=pv.DataSetMapper(), prop=liquid)
        necks.mapper.scalar_visibility = False
        self._plotter.add_actor(necks, reset_camera=False, render=False)
        return necks

    def _add_shadows(self) -> _Copies:
        """Add a shadow of each bead, which fades toward its edge."""
        import pyvista as pv

        radius = 1e3 * self._scene.motion.radius
        disc = pv.Disc(inner=0.0, outer=1.0, r_res=8, c_res=48).triangulate()
        distance = np.linalg.norm(disc.points, axis=1)
        black = np.zeros((disc.n_points, 4))
        black[:, 3] = 255.0 * _SHADOW * (1.0 - distance**2) ** 2
        colours = np.tile(black, (len(radius), 1, 1))
        shadows = _Copies(self._plotter, disc.points, disc.regular_faces, radius, colours)
        shadows.reflection.lighting = False
        return shadows

    def _add_floor(self, extent: float) -> list[pv.Actor]:
        """Add lines that make the motion of an open floor visible.

        The floor itself is as bright as the background. ``extent`` is the larger side of the view,
        mm.
        """
        import pyvista as pv

        camera_path = self._scene.camera_path
        if camera_path is None:
            camera_path = np.zeros((1, 3))
        half = _FLOOR_EXTENT * extent / 2.0
        grid = self._scene.grid or FloorGrid(round_below(extent / _LINES_PER_EXTENT))
        origin = np.array([*grid.origin, 0.0])
        middle = self._middle * [1.0, 1.0, 0.0] - origin
        low = middle + camera_path.min(axis=0) - half
        high = middle + camera_path.max(axis=0) + half
        lines = pv.line_segments_from_points(floor_lines(low, high, grid.step) + origin)
        # Slightly lower, so that lines do not cut through beads that overlap with the floor.
        lines.translate([0.0, 0.0, -1e-3 * extent], inplace=True)
        return [self._add_lines(lines, _LINES)]

    def _add_walls(self, extent: float) -> list[pv.Actor]:
        """Add walls behind the beads and, slightly nearer to the camera, the edges of all walls.

        If the camera moves, there are also marks on the walls. ``extent`` is the larger side of the
        view, mm.
        """
        faces = [1e3 * corners for corners in walls_of(self._scene.motion)]
        walls = mesh_of(faces).clean(tolerance=1e-6, absolute=True)
        level = [face for face in faces if np.ptp(face[:, 2]) < _LEVEL * extent]
        edges = walls.extract_feature_edges(
            feature_angle=30.0, manifold_edges=False, non_manifold_edges=False
        )
        edges.translate(1e-2 * extent * self._scene.axes[2], inplace=True)
        actors = [
            self._plotter.add_mesh(walls, color=_WALL, lighting=False, culling="back"),
            self._add_lines(edges, _EDGE),
        ]
        if self._scene.angle_of_view:
            # Of these panes, those in front of the beads are seen.
            panes = self._plotter.add_mesh(
                walls, color=_PANE, opacity=_PANE_OPACITY, lighting=False, culling="front"
            )
            actors.append(panes)
            if level:
                floor = mesh_of(level)
                floor.translate(_LEVEL * extent * self._scene.axes[2], inplace=True)
                actors.append(
                    self._plotter.add_mesh(floor, color=_FLOOR, lighting=False, culling="back")
                )
        if self._scene.camera_path is not None:
            path_axis = int(np.argmax(np.ptp(self._scene.camera_path, axis=0)))
            marks = self._marks(faces, path_axis, round_below(extent / _LINES_PER_EXTENT))
            actors.append(self._add_lines(marks, _LINES))
        return actors

    def _add_lines(self, lines: pv.PolyData, colour: str) -> pv.Actor:
        """Add lines, which no light changes."""
        return self._plotter.add_mesh(lines, color=colour, line_width=3, lighting=False)

    def _marks(self, faces: Sequence[FloatArray], path_axis: int, step: float) -> pv.PolyData:
        """Lines on the walls behind the beads, which make the motion of the camera visible.

        Parameters
        ----------
        faces
            Corners of each wall, mm, each of shape (K, 3).
        path_axis
            The axis along which the camera moves: 0, 1 or 2. The lines are across it.
        step
            Distance of the lines, mm.
        """
        import pyvista as pv

        toward = self._scene.axes[2]
        behind = []
        for face in faces:
            normal = np.cross(face[1] - face[0], face[2] - face[1])
            if normal @ toward > 0.0:
                behind.append(face)
        walls = mesh_of(behind)
        direction = np.eye(3)[path_axis]
        low, high = walls.bounds[2 * path_axis : 2 * path_axis + 2]
        places = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
        slices = [walls.slice(normal=direction, origin=place * direction) for place in places]
        lines: pv.PolyData = pv.merge(slices)
        lines.translate(1e-2 * step * toward, inplace=True)
        return lines


class _Copies:
    """Copies of a ball or disc of radius 1, one per bead, which move, turn and change colour.

    Until the first `move` they lie at the origin with radius 1.

    Parameters
    ----------
    plotter
        The plotter to which they are added.
    points : ndarray, shape (V, 3)
        Points of the ball or disc.
    triangles : ndarray of int, shape (T, 3)
        Corners of its triangles.
    radius : ndarray, shape (N,)
        Radii of the beads, mm, to which `move` scales the copies.
    colours : ndarray, shape (N, V, 3 or 4)
        Colours of the points as for `colour`.

    Attributes
    ----------
    reflection : pyvista.Property
        How they reflect light.
    """

    def __init__(
        self,
        plotter: pv.Plotter,
        points: npt.NDArray[np.floating],
        triangles: npt.NDArray[np.integer],
        radius: FloatArray,
        colours: FloatArray,
    ) -> None:
        import pyvista as pv

        count = len(radius)
        first_points = len(points) * np.arange(count)
        faces = (triangles + first_points[:, None, None]).reshape(-1, 3)
        cells = np.insert(faces, 0, 3, axis=1)  # the number of corners before them
        self._points = np.asarray(points, np.float32)
        self._radius = radius[:, None, None].astype(np.float32)
        self._mesh = pv.PolyData(np.tile(self._points, (count, 1)), cells.ravel())
        self.colour(colours)
        self._mesh.point_data["Normals"] = np.asarray(self._mesh.points).copy()
        self._mesh.point_data.active_normals_name = "Normals"
        # Culling skips the triangles that face away from the camera: half of a ball, never seen.
        actor = plotter.add_mesh(
            self._mesh, scalars="colour", rgb=True, smooth_shading=False, culling="back"
        )
        self.reflection = actor.prop
        # Set here: the option `smooth_shading` would replace these normals by computed ones.
        self.reflection.interpolation = "Phong"

    def move(self, centres: FloatArray, rotations: FloatArray | None = None) -> None:
        """Move and turn the copies.

        Parameters
        ----------
        centres : ndarray, shape (N, 3)
            Centres, mm.
        rotations : ndarray, shape (N, 3, 3)
            Rotation matrices; without them the copies do not turn.
        """
        if rotations is None:
            rotations = np.tile(np.eye(3), (len(centres), 1, 1))
        # The points of a unit sphere are its normals. Shadows are not lit: theirs do not matter.
        normals = self._points @ np.swapaxes(rotations, 1, 2).astype(np.float32)
        points = self._radius * normals + centres[:, None].astype(np.float32)
        self._mesh.points = points.reshape(-1, 3)
        self._mesh.point_data["Normals"] = normals.reshape(-1, 3)

    def colour(self, colours: FloatArray) -> None:
        """Set the colours of the points.

        Parameters
        ----------
        colours : ndarray, shape (N, V, 3 or 4)
            Red, green, blue, and opacity if there are four, from 0 to 255.
        """
        colours = colours.reshape(-1, colours.shape[-1])
        self._mesh.point_data["colour"] = colours.round().astype(np.uint8)
