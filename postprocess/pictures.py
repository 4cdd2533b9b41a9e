"""Pictures rendered off-screen with pyvista, no X server needed: a walker at several times, a whole run, films.

Containers are seen from the side, as in Fig. 1a of Khan et al., planes from above.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import closing
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.inputs.units import DURATION, parse_quantity
from walkers.postprocess.drawing import check_picture, new_figure, save_figure, styled
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Group, Motion, gathered, read_motion
from walkers.postprocess.piles import Pile, analyse
from walkers.runner.directory import case_of
from walkers.runner.files import beside

if TYPE_CHECKING:
    import pyvista as pv
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURE_NAME = "walker.png"
SERIES_NAME = "series.png"
FILM_NAME = "film.mp4"
_RUBY = ("#b0203c", "#e0566c")
_GLASS = ("#8c9aa5", "#c9d2d8")
"""Large and small beads, of those that are pointed out and of the others."""
_FLOOR = "#c9d2d8"
_FEW, _MANY = 100, 500
"""Beads from which on spheres are drawn coarser."""
_SHOWN = 6
"""Pictures in a time series."""
_TOLERANCE = 0.1
"""Of a time between pictures: frames are where they are."""
_MOST_PICTURES = 60.0
"""A second, in a film."""
_PIXELS = 40.0
"""To a millimetre of a picture, at least, where the screen has room for it."""
_TALL, _TALLEST, _WIDEST = 1000, 1600, 1900
"""Pixels of a view: so high, higher for boxes that are much higher than wide, lower for what is much wider."""
_LETTERS = 28
"""Pixels, of the letters in a film."""
_ABOVE, _BELOW, _LEFT, _RIGHT = 52, 28, 136, 12
"""Pixels about the view in a film: for the time, for half of the lowest label, for the scale, for a wall."""
_LEAST_WIDTH = 320
"""Pixels; on less the time has no room."""
_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""Millimetres between marks of a scale."""
_PAGE = (20.0, 12.0)
"""Inches of a time series, across and up, at most."""
_PANEL = (1.4, 5.0)
"""Inches of a picture in it, across and up: as large as one of the two says, if the page has room."""
_BESIDE, _BENEATH, _EDGES = 0.3, 0.8, (0.9, 0.1)
"""Inches between pictures: for what sticks out of tick labels, for time, ticks and label; and about all of them."""


def render_run(directory: Path, destination: Path | None = None, *, images: int = _SHOWN) -> list[Path]:
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
    plotter = _plotter(size, "white")
    _add_floor(plotter, low, high)
    for frame, centres in zip(frames, position, strict=True):
        _add_walker(plotter, radii, centres)
        place = [high[0] - 2.2 * radii.max(), float(centres[:, 1].mean()), float(radii.mean())]
        _add_label(plotter, place, f"{group.time[frame]:.2f} s")
    _add_scale_bar(plotter, [low[0] + 0.6 * radii.max(), low[1] + 0.5 * radii.max(), 0.02])
    _aim(plotter, (low + high) / 2.0, high - low, size)
    return plotter


def top_view(
    group: Group, walker: int, frame: int, along: tuple[float, float], across: tuple[float, float]
) -> npt.NDArray[np.uint8]:
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
    plotter = _plotter(size, _FLOOR)
    _add_walker(plotter, group.radii * 1e3, centres)
    plotter.camera_position = [(0.0, 0.0, 10.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (across[1] - across[0]) / 2.0 * 1e3
    picture: npt.NDArray[np.uint8] = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return picture


class View:
    """A run seen from the side, along y, or from above, without perspective; one window for any number of frames.

    Parameters
    ----------
    motion
        Of the run.

    Attributes
    ----------
    low, high : ndarray, shape (2,)
        Corners of the picture, m: along x, and the height or along y.
    axes
        What they are called.
    """

    def __init__(self, motion: Motion) -> None:
        import pyvista as pv

        self._motion = motion
        sideways = motion.case.boundary.closed
        self.axes = ("x", "height" if sideways else "y")
        self.low, self.high = _corners(motion, sideways)
        extents = self.high - self.low
        wide, tall = 1e3 * extents
        pixels = min(max(_TALL / tall, min(_PIXELS, _TALLEST / tall)), _WIDEST / wide)
        # The codec of films takes even numbers only.
        size = [2 * max(1, round(extent * pixels / 2.0)) for extent in (wide, tall)]
        self._plotter = _plotter(size, "white")
        rounds = 28 if len(motion.radius) < _FEW else 18 if len(motion.radius) < _MANY else 10
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
        beads = self._plotter.add_mesh(self._mesh, scalars="colour", rgb=True, specular=0.4, smooth_shading=False)
        beads.prop.culling = "back"  # the far halves of spheres, half of the work, are never seen
        beads.prop.interpolation = "Phong"  # by these normals, where pyvista would compute others
        x, up = (self.low + self.high) / 2.0 * 1e3
        middle = (x, 0.0, up) if sideways else (x, up, 0.0)
        camera = (x, -1e2, up) if sideways else (x, up, 1e2)
        self._plotter.camera_position = [camera, middle, (0.0, 0.0, 1.0) if sideways else (0.0, 1.0, 0.0)]
        self._plotter.camera.parallel_projection = True
        self._plotter.camera.parallel_scale = extents[1] / 2.0 * 1e3

    def picture(self, frame: int, coloured: Collection[int]) -> npt.NDArray[np.uint8]:
        """The beads in a frame, with some beads in another colour: shape (height, width, 3), red, green, blue."""
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


def _corners(motion: Motion, sideways: bool) -> tuple[FloatArray, FloatArray]:
    """Of the picture: from the floor to a little above what any bead reaches; from above, all that they reach."""
    start, radius = motion.first_driven, motion.radius[:, None]
    reached = motion.position[start:]
    if sideways:
        half = motion.case.boundary.inner_width / 2.0
        return np.array([-half, 0.0]), np.array([half, 1.05 * float((reached[..., 2] + motion.radius).max())])
    margin = float(motion.radius.max())
    return (
        (reached[..., :2] - radius).min(axis=(0, 1)) - margin,
        (reached[..., :2] + radius).max(axis=(0, 1)) + margin,
    )


@styled
def render_series(
    directory: Path, destination: Path | None = None, *, images: int = _SHOWN, apart: float | None = None
) -> list[Path]:
    """Views of a run beside each other, in rows, walkers and climbers coloured, with times and scales.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``series.png`` in the run directory if None.
    images
        How many, evenly through the drive.
    apart
        Seconds between them: the last ones of the run then, as many as ``images``.

    Raises
    ------
    InputError
        If frames were recorded less often, or the drive was shorter than that.
    """
    path = destination or directory / SERIES_NAME
    check_picture(path, ".png")
    motion = gathered(read_motion(directory))
    frames = _frames_evenly(motion, images) if apart is None else _frames_apart(motion, images, apart, directory)
    pointed_out = _pointed_out(motion)
    view = View(motion)
    sides = (1e3 * view.low[0], 1e3 * view.high[0], 1e3 * view.low[1], 1e3 * view.high[1])
    decimals = 2 if apart is None or apart >= 0.1 else 4
    figure, panels = _panels(len(frames), sides[1] - sides[0], sides[3] - sides[2])
    for panel, frame in zip(panels, frames, strict=True):
        panel.imshow(view.picture(frame, pointed_out(frame)), extent=sides, interpolation="antialiased")
        panel.set_title(f"{motion.time[frame]:.{decimals}f} s", fontsize=10)
        panel.set_xlabel(f"{view.axes[0]} (mm)")
        panel.locator_params(axis="x", nbins=4, steps=[1, 2, 5, 10])
        panel.spines["right"].set_visible(motion.case.boundary.closed)  # as the left one, a wall
        panel.grid(visible=False)
        foremost = panel.get_position().x0 == panels[0].get_position().x0
        panel.tick_params(labelleft=foremost)
        panel.set_ylabel(f"{view.axes[1]} (mm)" if foremost else "")
    view.close()
    return save_figure(figure, path, [directory.name])


def _panels(count: int, wide: float, tall: float) -> tuple[Figure, list[Axes]]:
    """A figure with so many axes of one shape, given in mm, in as many rows as make them largest.

    Their places are reckoned here: no layout of matplotlib's knows how large axes of a fixed aspect will be.
    """
    aspired = max(_PANEL[0] / wide, _PANEL[1] / tall)

    def inches(rows: int) -> float:
        """To a millimetre."""
        across, up = ((whole - edge) for whole, edge in zip(_PAGE, _EDGES, strict=True))
        return min(aspired, (across / ceil(count / rows) - _BESIDE) / wide, (up / rows - _BENEATH) / tall)

    rows = max(range(1, count + 1), key=lambda rows: (inches(rows), -rows))
    columns = ceil(count / rows)
    across, up = inches(rows) * wide + _BESIDE, inches(rows) * tall + _BENEATH
    size = (_EDGES[0] + columns * across, _EDGES[1] + rows * up)
    figure, axes = new_figure(*size, nrows=rows, ncols=columns, squeeze=False)
    figure.set_layout_engine("none")
    for number, panel in enumerate(axes.flat):
        if number >= count:
            panel.remove()
            continue
        row, column = divmod(number, columns)
        left, bottom = _EDGES[0] + column * across, (rows - 1 - row) * up + 0.6 * _BENEATH
        corner = (left / size[0], bottom / size[1])
        panel.set_position((*corner, (across - _BESIDE) / size[0], (up - _BENEATH) / size[1]))
    return figure, list(axes.flat)[:count]


def render_film(directory: Path, destination: Path | None = None, *, slowdown: float = 1.0) -> Path:
    """Film a run, walkers and climbers coloured, with the time and a scale in the picture.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The MP4 to write (H.264); ``film.mp4`` in the run directory if None.
    slowdown
        How many times slower than in reality; of frames that follow each other faster than any screen some are shown.

    Raises
    ------
    InputError
        If the name is none of an MP4.
    FilmFailed
        If ffmpeg could not write all of it.
    """
    from imageio_ffmpeg import write_frames

    path = destination or directory / FILM_NAME
    check_picture(path, ".mp4")
    motion = gathered(read_motion(directory))
    time = motion.time
    between = float(np.median(np.diff(time[motion.first_driven :]))) if len(time) > motion.first_driven + 1 else 1.0
    # No screen shows more than so many pictures a second.
    stride = max(1, ceil(1.0 / (_MOST_PICTURES * slowdown * between) - 1e-9))
    shown = range(motion.first_driven, len(time), stride)
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures = _film(motion, shown)
    first = next(pictures)
    rate = 1.0 / (between * stride * slowdown) if len(shown) > 1 else 1.0
    size = (first.shape[1], first.shape[0])
    with closing(pictures), beside(path) as new:
        writer = write_frames(new, size, fps=rate, codec="libx264", quality=7, macro_block_size=2)
        writer.send(None)
        writer.send(np.ascontiguousarray(first))
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture))
        writer.close()
        _check_film(new, len(shown))
    return path


class FilmFailed(WalkersError):
    """A film that could not be written as a whole."""


def _check_film(path: Path, frames: int) -> None:
    """Ffmpeg ends in silence when the disk is full."""
    from imageio_ffmpeg import count_frames_and_secs

    try:
        written, _ = count_frames_and_secs(str(path))
    except (RuntimeError, OSError):
        written = 0
    if written != frames:
        raise FilmFailed(f"ffmpeg wrote {written} of the {frames} pictures of {path.parent}: is the disk full?")


def _film(motion: Motion, frames: Sequence[int]) -> Generator[npt.NDArray[np.uint8]]:
    """The pictures of a film, each with a scale on its left and the time above."""
    from PIL import Image, ImageDraw, ImageFont

    view = View(motion)
    pointed_out, font = _pointed_out(motion), ImageFont.load_default(_LETTERS)
    try:
        for frame in frames:
            box = Image.fromarray(view.picture(frame, pointed_out(frame)))
            page = Image.new(
                "RGB", (max(_LEFT + box.width + _RIGHT, _LEAST_WIDTH), _ABOVE + box.height + _BELOW), "white"
            )
            page.paste(box, (_LEFT, _ABOVE))
            draw = ImageDraw.Draw(page)
            floor, left, right = _ABOVE + box.height, _LEFT - 2, _LEFT + box.width + 1
            outline = [(left, _ABOVE), (left, floor), (right, floor), (right, _ABOVE)]
            draw.line(outline if motion.case.boundary.closed else outline[:2], "black", 2)
            draw.text((_LEFT, _ABOVE // 2), f"{motion.time[frame]:.3f} s", "black", font, anchor="lm")
            for told, share in _scale(1e3 * float(view.high[1] - view.low[1])):
                level = floor - share * box.height
                draw.line([(left - 10, level), (left, level)], "black", 2)
                draw.text((left - 14, level), told, "black", font, anchor="rm")
            yield np.asarray(page)
    finally:
        view.close()


def _scale(tall: float) -> list[tuple[str, float]]:
    """What a scale of so many mm says and at which shares of its length, at three places or more above its foot."""
    step = max((step for step in _TICKS if 3.0 * step <= tall), default=_TICKS[0])
    marks = [number * step for number in range(int(tall / step) + 1)]
    return [(f"{mark:g} mm" if mark else "0", mark / tall) for mark in marks]


def _frames_evenly(motion: Motion, images: int) -> list[int]:
    start = motion.first_driven
    return [int(frame) for frame in np.unique(np.linspace(start, len(motion.time) - 1, images).round().astype(int))]


def _frames_apart(motion: Motion, images: int, apart: float, directory: Path) -> list[int]:
    """The last frames of a run that are so many seconds apart, to a tenth of that."""
    last = len(motion.time) - 1
    between = motion.case.run.steps_per_sample * motion.case.run.time_step
    every = round(apart / between)
    if not every or abs(every * between / apart - 1.0) > _TOLERANCE:
        told = f"{apart:.4g} s between pictures: expected a multiple of the {between:.4g} s between frames"
        raise InputError(str(directory), [Problem("", None, told)])
    if every > last - motion.first_driven:
        told = f"{apart:.4g} s between pictures: expected less than the {max(motion.time[-1], 0.0):.3g} s of the drive"
        raise InputError(str(directory), [Problem("", None, told)])
    return list(range(last, motion.first_driven - 1, -every))[:images][::-1]


def seconds_apart(text: str, directory: Path) -> float:
    """Read a time between pictures: a duration, or a part or multiple of the drive's cycle such as ``T/4`` or ``2 T``.

    Raises
    ------
    InputError
        If the text is neither.
    """
    cycles = re.fullmatch(r"(?P<many>[\d.]*)\s*T\s*(/\s*(?P<parts>\d+))?", text.strip())
    try:
        if cycles:
            frequency = case_of(directory).drive.frequency
            seconds = float(cycles["many"] or 1) / int(cycles["parts"] or 1) / frequency
        else:
            seconds = parse_quantity(text, DURATION)
        if seconds > 0.0:
            return seconds
    except (ValueError, ZeroDivisionError):
        pass
    raise InputError("--interval", [Problem("", None, f'{text!r}: expected a time such as "2 s", or "T/4" of a cycle')])


def _pointed_out(motion: Motion) -> Callable[[int], set[int]]:
    """What gives, for a frame, the beads to colour: those of walkers, and of the clusters that climb and are free."""
    walkers = set(np.flatnonzero(motion.walker_of >= 0).tolist())
    if not Pile().applies(motion.case):
        return lambda _: walkers
    found = analyse(motion)
    climbing = [track for track, climb in zip(found.tracks, found.climbs, strict=True) if climb.climbed]
    return lambda frame: walkers | {bead for track in climbing for bead in track.members_at(frame)}


def _plotter(size: Sequence[int], background: str) -> pv.Plotter:
    """A window off-screen, of a size in pixels."""
    # Without this VTK tries an X server first and says so.
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import pyvista as pv

    plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
    plotter.background_color = pv.Color(background)
    return plotter


def _add_walker(plotter: pv.Plotter, radii: FloatArray, centres: FloatArray) -> None:
    """The beads of a walker, mm, the first one darker."""
    import pyvista as pv

    for bead, (radius, centre) in enumerate(zip(radii, centres, strict=True)):
        sphere = pv.Sphere(radius=radius, center=centre, theta_resolution=80, phi_resolution=80)
        plotter.add_mesh(sphere, color=_RUBY[int(bead > 0)], smooth_shading=True, specular=0.6, specular_power=40)


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
