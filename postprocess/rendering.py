"""Pictures of walkers rendered off-screen with pyvista; no X server is needed."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.postprocess.drawing import check_picture
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.pile import PileMotion
from walkers.postprocess.trajectory import Trajectory, read_trajectory
from walkers.runner.files import beside

if TYPE_CHECKING:
    import pyvista as pv

PICTURE_NAME = "walker.png"
_RUBY = ("#b0203c", "#e0566c")
_GLASS = ("#8c9aa5", "#c9d2d8")
"""Large and small beads of a pile."""
_FLOOR = "#c9d2d8"
_MOST_PIXELS = 4000
_MANY = 500
"""Beads from which on spheres are drawn coarser."""


def render_run(
    directory: Path,
    destination: Path | None = None,
    *,
    walker: int = 0,
    images: int = 4,
    size: tuple[int, int] = (1280, 800),
) -> Path:
    """Render one walker at several times of its way, one below the other as in Fig. 1b of Khan et al.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``walker.png`` in the run directory if None.
    walker
        Number of the walker.
    images
        How many times to show, evenly from the start to the end of the run.
    size
        Width and height in pixels.

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    IndexError
        If there is no such walker.
    InputError
        If the destination is no PNG.
    """
    path = destination or directory / PICTURE_NAME
    check_picture(path, ".png")
    trajectory = read_trajectory(directory)
    path.parent.mkdir(parents=True, exist_ok=True)
    plotter = _scene(trajectory, walker, images, size)
    with beside(path) as new:
        plotter.screenshot(new)
    plotter.close()
    return path


def _scene(trajectory: Trajectory, walker: int, images: int, size: tuple[int, int]) -> pv.Plotter:
    _prefer_egl()
    import pyvista as pv

    strobe = trajectory.case.run.samples_per_cycle
    frames = np.linspace(0, (len(trajectory.time) - 1) // strobe, images).round().astype(int) * strobe
    radii = trajectory.radii * 1e3
    pitch = 2.4 * float(radii.max())
    turned = np.stack([trajectory.drive_axis, trajectory.across_axis, np.array([0.0, 0.0, 1.0])], axis=-1)
    position = trajectory.position[frames, walker] @ turned * 1e3
    middle = position.mean(axis=1)
    position[:, :, 0] -= middle[0, 0]
    position[:, :, 1] -= middle[:, 1, None]  # rows are even: the drift across the axis is left out
    position[:, :, 1] -= pitch * np.arange(images)[:, None]
    low = position.min(axis=(0, 1)) - 2.2 * radii.max()
    high = position.max(axis=(0, 1)) + np.array([4.5, 3.0, 0.0]) * radii.max()
    plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
    plotter.background_color = pv.Color("white")
    _add_floor(plotter, low, high)
    for frame, centres in zip(frames, position, strict=True):
        for bead in range(2):
            sphere = pv.Sphere(radius=radii[bead], center=centres[bead], theta_resolution=80, phi_resolution=80)
            plotter.add_mesh(sphere, color=_RUBY[bead], smooth_shading=True, specular=0.6, specular_power=40)
        place = [high[0] - 2.2 * radii.max(), float(centres[:, 1].mean()), float(radii.mean())]
        _add_label(plotter, place, f"{trajectory.time[frame]:.2f} s")
    _add_scale_bar(plotter, [low[0] + 0.6 * radii.max(), low[1] + 0.5 * radii.max(), 0.02])
    _aim(plotter, (low + high) / 2.0, high - low, size)
    return plotter


def top_view(
    trajectory: Trajectory, walker: int, frame: int, along: tuple[float, float], across: tuple[float, float]
) -> npt.NDArray[np.uint8]:
    """One walker seen from above, as a stroboscope shows it.

    Parameters
    ----------
    trajectory
        Of the run.
    walker, frame
        Which, and when.
    along, across
        Bounds of the picture along and across the drive axis, m, relative to the substrate.

    Returns
    -------
    ndarray, shape (height, width, 3)
        Red, green, blue; the first row is the farthest to the left of the drive axis, 120 pixels to the smaller radius.
    """
    _prefer_egl()
    import pyvista as pv

    pixels = 120.0 / float(trajectory.radii.min())
    size = [round((bounds[1] - bounds[0]) * pixels) for bounds in (along, across)]
    turned = np.stack([trajectory.drive_axis, trajectory.across_axis, np.array([0.0, 0.0, 1.0])], axis=-1)
    middle = np.array([sum(along) / 2.0, sum(across) / 2.0, 0.0])
    centres = (trajectory.position[frame, walker] @ turned - middle) * 1e3
    plotter = pv.Plotter(off_screen=True, window_size=size, lighting="light kit")
    plotter.background_color = pv.Color(_FLOOR)
    for bead, radius in enumerate(trajectory.radii * 1e3):
        sphere = pv.Sphere(radius=radius, center=centres[bead], theta_resolution=80, phi_resolution=80)
        plotter.add_mesh(sphere, color=_RUBY[bead], smooth_shading=True, specular=0.6, specular_power=40)
    plotter.camera_position = [(0.0, 0.0, 10.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (across[1] - across[0]) / 2.0 * 1e3
    picture: npt.NDArray[np.uint8] = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return picture


class SideView:
    """A pile seen along y, without perspective; one window for any number of frames.

    Parameters
    ----------
    motion
        Of the pile.
    top
        Height up to which the box is shown, m.
    pixels
        To a millimetre.
    """

    def __init__(self, motion: PileMotion, top: float, pixels: float = 40.0) -> None:
        _prefer_egl()
        import pyvista as pv

        self._motion = motion
        extents = (motion.case.container.width, top)
        pixels = min(pixels, _MOST_PIXELS / (1e3 * max(extents)))
        size = [2 * max(1, round(extent * pixels * 1e3 / 2.0)) for extent in extents]
        self._plotter = pv.Plotter(off_screen=True, window_size=size, lighting="light kit")
        self._plotter.background_color = pv.Color("white")
        rounds = 18 if len(motion.radius) < _MANY else 10
        ball = pv.Sphere(radius=1.0, theta_resolution=rounds, phi_resolution=rounds)
        self._around = (motion.radius[:, None, None] * ball.points * 1e3).astype(np.float32)
        first = np.arange(len(motion.radius), dtype=np.int64) * ball.n_points
        faces = np.tile(ball.faces.reshape(-1, 4).astype(np.int64), (len(first), 1, 1))
        faces[:, :, 1:] += first[:, None, None]
        self._mesh = pv.PolyData(self._around.reshape(-1, 3), faces.ravel())
        # A sphere's own points are its normals: smooth without computing any.
        self._mesh.point_data["Normals"] = np.tile(ball.points, (len(motion.radius), 1)).astype(np.float32)
        self._mesh.point_data.active_normals_name = "Normals"
        self._mesh.point_data["colour"] = np.zeros((self._mesh.n_points, 3), dtype=np.uint8)
        self._plotter.add_mesh(self._mesh, scalars="colour", rgb=True, specular=0.4, smooth_shading=False)
        middle = (0.0, 0.0, top / 2.0 * 1e3)
        self._plotter.camera_position = [(0.0, -1e2, middle[2]), middle, (0.0, 0.0, 1.0)]
        self._plotter.camera.parallel_projection = True
        self._plotter.camera.parallel_scale = top / 2.0 * 1e3

    def picture(self, frame: int, coloured: Collection[int]) -> npt.NDArray[np.uint8]:
        """The pile in a frame, with some beads in another colour: shape (height, width, 3), red, green, blue."""
        import pyvista as pv

        motion = self._motion
        chosen = np.zeros(len(motion.radius), dtype=bool)
        chosen[list(coloured)] = True
        names = np.where(chosen, np.where(motion.large, *_RUBY), np.where(motion.large, *_GLASS))
        rgb = {str(name): pv.Color(str(name)).int_rgb for name in np.unique(names)}
        colours = np.array([rgb[str(name)] for name in names], dtype=np.uint8)
        self._mesh.points = (self._around + motion.position[frame][:, None] * 1e3).reshape(-1, 3).astype(np.float32)
        self._mesh.point_data["colour"] = np.repeat(colours, self._around.shape[1], axis=0)
        self._plotter.render()  # a screenshot does so the first time only
        return np.array(self._plotter.screenshot(return_img=True), dtype=np.uint8)

    def close(self) -> None:
        """Give back the window."""
        self._plotter.close()


def _prefer_egl() -> None:
    """Without this VTK tries an X server first and says so."""
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")


def _add_floor(plotter: pv.Plotter, low: FloatArray, high: FloatArray) -> None:
    import pyvista as pv

    middle, extent = (low + high) / 2.0, high - low
    floor = pv.Plane(center=(middle[0], middle[1], 0.0), i_size=extent[0], j_size=extent[1], direction=(0.0, 0.0, 1.0))
    plotter.add_mesh(floor, color=_FLOOR, lighting=False)


def _add_label(plotter: pv.Plotter, place: list[float], text: str) -> None:
    plotter.add_point_labels(
        [place],
        [text],
        font_size=20,
        text_color="black",
        shape=None,
        show_points=False,
        always_visible=True,
        justification_horizontal="center",
        justification_vertical="center",
    )


def _add_scale_bar(plotter: pv.Plotter, start: list[float], length: float = 0.5) -> None:
    import pyvista as pv

    plotter.add_mesh(pv.Line(start, [start[0] + length, *start[1:]]), color="black", line_width=5)
    _add_label(plotter, [start[0] + length / 2.0, start[1] + 0.5 * length, start[2]], f"{length:g} mm")


def _aim(plotter: pv.Plotter, middle: FloatArray, extent: FloatArray, size: tuple[int, int]) -> None:
    """Look down at 55° from the side of the walkers, without perspective so that the scale bar holds everywhere."""
    elevation = np.radians(55.0)
    away = 5.0 * float(extent.max())
    camera = (middle[0], middle[1] - away * np.cos(elevation), away * np.sin(elevation))
    plotter.camera_position = [camera, (middle[0], middle[1], 0.0), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_projection = True
    height = max(extent[1] * np.sin(elevation), extent[0] * size[1] / size[0])
    plotter.camera.parallel_scale = 0.52 * float(height)
