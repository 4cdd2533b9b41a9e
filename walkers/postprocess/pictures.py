"""Pictures rendered off-screen with pyvista, no X server needed: a walker at several times, one from above."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.postprocess.drawing import check_picture
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Group, read_motion
from walkers.postprocess.scene import FLOOR, RUBY, Picture, new_plotter
from walkers.postprocess.series import SHOWN, render_series
from walkers.runner.directory import case_of
from walkers.runner.files import beside

if TYPE_CHECKING:
    import pyvista as pv

PICTURE_NAME = "walker.png"


def render_run(directory: Path, destination: Path | None = None, *, images: int = SHOWN) -> list[Path]:
    """Render a run: of independent walkers one at several times, of all else views beside each other.

    Parameters and errors are those of `render_walker` and `render_series`.
    """
    if case_of(directory).apart:
        return [render_walker(directory, destination, images=images)]
    return render_series(directory, destination, images=images)


def render_walker(
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
    StopIteration
        If there is no such walker.
    InputError
        If the destination is no PNG.
    """
    path = destination or directory / PICTURE_NAME
    check_picture(path, ".png")
    groups = read_motion(directory).groups
    group, place = next(
        (group, place) for group in groups for place, one in enumerate(group.walkers) if one.walker == walker
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    plotter = _scene(group, place, images, size)
    with beside(path) as new:
        plotter.screenshot(new)
    plotter.close()
    return path


def _scene(group: Group, walker: int, images: int, size: tuple[int, int]) -> pv.Plotter:
    strobe = group.case.run.samples_per_cycle
    frames = np.linspace(0, (len(group.time) - 1) // strobe, images).round().astype(int) * strobe
    radii = group.radii * 1e3
    turned = np.stack([group.drive_axis, group.across_axis, np.array([0.0, 0.0, 1.0])], axis=-1)
    position = group.position[frames, walker] @ turned * 1e3
    middle = position.mean(axis=1)
    position[:, :, 0] -= middle[0, 0]
    position[:, :, 1] -= middle[:, 1, None]  # rows are even: the drift across the axis is left out
    pitch = 2.4 * float(radii.max()) + float(np.ptp(position[..., 1], axis=1).max())
    position[:, :, 1] -= pitch * np.arange(images)[:, None]
    low = position.min(axis=(0, 1)) - 2.2 * radii.max()
    high = position.max(axis=(0, 1)) + np.array([4.5, 3.0, 0.0]) * radii.max()
    plotter = new_plotter(size, "white")
    _add_floor(plotter, low, high)
    for frame, centres in zip(frames, position, strict=True):
        _add_walker(plotter, radii, centres)
        place = [high[0] - 2.2 * radii.max(), float(centres[:, 1].mean()), float(radii.mean())]
        _add_label(plotter, place, f"{group.time[frame]:.2f} s")
    _add_scale_bar(plotter, [low[0] + 0.6 * radii.max(), low[1] + 0.5 * radii.max(), 0.02])
    _aim(plotter, (low + high) / 2.0, high - low, size)
    return plotter


def top_view(group: Group, walker: int, frame: int, along: tuple[float, float], across: tuple[float, float]) -> Picture:
    """One walker seen from above, as a stroboscope shows it.

    Parameters
    ----------
    group
        Of the walkers.
    walker, frame
        Which of them, and when.
    along, across
        Bounds of the picture along and across the drive axis, m, relative to the substrate.

    Returns
    -------
    ndarray, shape (height, width, 3)
        Red, green, blue; the first row is the farthest to the left of the drive axis, 120 pixels to the smaller radius.
    """
    pixels = 120.0 / float(group.radii.min())
    size = [round((bounds[1] - bounds[0]) * pixels) for bounds in (along, across)]
    turned = np.stack([group.drive_axis, group.across_axis, np.array([0.0, 0.0, 1.0])], axis=-1)
    middle = np.array([sum(along) / 2.0, sum(across) / 2.0, 0.0])
    centres = (group.position[frame, walker] @ turned - middle) * 1e3
    plotter = new_plotter(size, FLOOR)
    _add_walker(plotter, group.radii * 1e3, centres)
    plotter.camera_position = [(0.0, 0.0, 10.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (across[1] - across[0]) / 2.0 * 1e3
    picture: Picture = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return picture


def _add_walker(plotter: pv.Plotter, radii: FloatArray, centres: FloatArray) -> None:
    """The beads of a walker, mm, the first one darker."""
    import pyvista as pv

    for bead, (radius, centre) in enumerate(zip(radii, centres, strict=True)):
        sphere = pv.Sphere(radius=radius, center=centre, theta_resolution=80, phi_resolution=80)
        plotter.add_mesh(sphere, color=RUBY[int(bead > 0)], smooth_shading=True, specular=0.6, specular_power=40)


def _add_floor(plotter: pv.Plotter, low: FloatArray, high: FloatArray) -> None:
    import pyvista as pv

    middle, extent = (low + high) / 2.0, high - low
    floor = pv.Plane(center=(middle[0], middle[1], 0.0), i_size=extent[0], j_size=extent[1], direction=(0.0, 0.0, 1.0))
    plotter.add_mesh(floor, color=FLOOR, lighting=False)


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
