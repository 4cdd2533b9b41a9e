"""Films of runs with rolling beads, physical time, slow motion and a scale bar.

The view is in the laboratory, so that the boundary shakes; the camera follows the beads if their
path is long. If successive pictures are half a cycle apart or more, all show the same phase of
the drive (stroboscopic). On a tilted boundary an arrow shows the direction of gravity. Pictures at
a few times are made in `walkers.postprocess.show.series`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from math import ceil, log10, sqrt
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.errors import WalkersError, input_error
from walkers.extras import require
from walkers.files import replacing
from walkers.postprocess.measure.caption import drive_description
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.show.camera import (
    ANGLE_OF_VIEW,
    camera_axes,
    from_above,
    from_the_side,
    named_direction,
    oblique_axes,
)
from walkers.postprocess.show.drawing import check_place
from walkers.postprocess.show.film_options import USUAL_SIZE, FilmOptions
from walkers.postprocess.show.marks import DRIVE_COLOUR, seen_directions
from walkers.postprocess.show.meshes import round_below
from walkers.postprocess.show.necks import bridges_at, bridges_text
from walkers.postprocess.show.scene import Scene, motion_in_view
from walkers.postprocess.show.window import Picture, Window
from walkers.progress import Progress, Tell

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

_EXTENT_FACTOR = 1.2
"""Extent of the picture over that of the paths of the beads."""
_EXTENT_FACTOR_OF_CONTAINER = 1.04
"""Extent of the view of a container from the side over that of the container."""
_HEIGHT_OF_TEXTS = 0.14
"""Usual height of the texts above and below a container over its height."""
_SMALLEST_ASPECT = 0.4
"""Smallest usual width over height of a film."""
_TRAY_EXTENT_FACTOR = 1.3
"""Extent of the picture over that of a tray."""
_LONGEST_FILM = 10.0
"""Largest duration of a film without a given slowdown, s."""
_LEAST_FRAMES_PER_SECOND = 10.0
"""Smallest number of recorded frames per second of such a film, if frames do not resolve cycles."""

# --- captions ---
_LINES_PER_PICTURE = 24
"""Height of a picture over that of a line of text."""
_LINES_PER_WIDTH = 42
"""Width of a picture over the height of a line of text."""
_LEAST_LINE_HEIGHT = 15
"""Smallest height of a line of text, pixels."""
_BLACK = "black"
"""Colour of the time, the scale bar and gravity."""
_DARK_GREY = "#333333"
"""Colour of the other texts."""

# --- files ---
_MP4_QUALITY = 7
"""Quality of an MP4, from 0 to 10."""
_GIF_COLOURS = 40
"""Colours of a GIF."""
_GIF_SAMPLES = 6
"""Pictures from which the colours of a GIF are chosen."""


def render_film(
    directory: Path,
    destination: Path | None = None,
    options: FilmOptions = FilmOptions(),
    *,
    on_progress: Tell | None = None,
) -> Path:
    """Render a film of a run.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The file, an MP4 or a GIF; None: ``film.mp4`` in the run directory.
    options
        What the film shows, from when to when, and of which walker.
    on_progress
        Called after each picture.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the format cannot hold the film, if the walker of the options does not exist, if their
        times are outside of the drive, or if the package that writes an MP4 is not installed
        (`walkers.extras.ExtraMissing`).
    WalkersError
        If ffmpeg fails.
    """
    path = destination or directory / "film.mp4"
    check_place(path, ".mp4", ".gif")
    is_gif = path.suffix.lower() == ".gif"
    if is_gif:
        _check_gif(options)
    else:
        _check_mp4(options.size)
        require("film")  # ffmpeg; Pillow, which is always installed, writes a GIF
    # Whether a walker is alone in view matters only to series of pictures.
    motion, _ = motion_in_view(read_motion(directory).driven, options.walker)
    times = film_times(motion, options)
    size = options.size or _usual_size(motion, times)
    scene = _scene_of(motion, times, size)
    captions = _Captions(scene, times, size)
    if from_the_side(motion.case):
        scene = captions.scene_between_texts()
        captions = _Captions(scene, times, size)
    bridges = bridges_at(motion, times.frame)
    path.parent.mkdir(parents=True, exist_ok=True)
    with closing(Window(scene, size)) as window, replacing(path) as new:
        film = _Film(window, captions, times, bridges)
        if is_gif:
            _write_gif(new, film, options.fps, on_progress)
        else:
            _write_mp4(new, film, size, options.fps, on_progress)
    return path


def _check_gif(options: FilmOptions) -> None:
    """Raise `InputError` unless pictures last whole hundredths of a second, as those of GIFs do."""
    if 100 % options.fps or options.fps > 50:
        raise input_error("fps", f"{options.fps}: expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF")


def _check_mp4(size: tuple[int, int] | None) -> None:
    """Raise `InputError` for a chosen size that an MP4 cannot have."""
    if size is None:
        return
    width, height = size
    if width % 2 or height % 2:
        raise input_error("size", f"{width}x{height}: expected even numbers for an MP4")


@dataclass(frozen=True)
class FilmTimes:
    """Times of the K pictures of a film.

    Attributes
    ----------
    time : ndarray, shape (K,)
        Physical time, s.
    frame : ndarray, shape (K,)
        Frame of the motion, with a fraction between two frames.
    slowdown
        Time of the film over physical time.
    stroboscopic
        Whether all pictures are at one phase of the drive.
    """

    time: FloatArray
    frame: FloatArray
    slowdown: float
    stroboscopic: bool


def film_times(motion: Motion, options: FilmOptions) -> FilmTimes:
    """Distribute the pictures of a film over the drive.

    Pictures that are half a cycle apart or more are moved to whole cycles, otherwise they would
    show a beat. If the frames do not resolve the cycle, each picture is the nearest frame. Raises
    `InputError` for times outside of the drive.
    """
    last = float(motion.time[-1])
    begin = options.begin
    end = last
    if options.end is not None:
        end = min(options.end, last)
    if not 0.0 <= begin < end:
        raise input_error(
            "begin, end",
            f"nothing to show: expected times within the drive, 0 to {last:.4g} s, "
            "begin before end",
        )
    slowdown = options.slowdown
    if slowdown is None:
        slowdown = _default_slowdown(motion, end - begin)
    interval = 1.0 / (options.fps * slowdown)
    cycle = 1.0 / motion.case.excitation.frequency
    time = begin + interval * np.arange(int((end - begin) / interval + 1e-9) + 1)
    is_beat = interval >= cycle / 2.0
    if is_beat:
        time = np.round(time / cycle) * cycle
    numbers = np.arange(len(motion.time))
    frame = np.interp(time, motion.time, numbers)
    if not motion.follows_cycles:
        frame = frame.round()
    return FilmTimes(
        time=np.interp(frame, numbers, motion.time),
        frame=frame,
        slowdown=slowdown,
        stroboscopic=is_beat or motion.case.run.samples_per_cycle == 1,
    )


def _default_slowdown(motion: Motion, duration: float) -> float:
    """Slow motion, of 1, 2, 5, 10, …, of a film of a physical duration (s)."""
    largest = _LONGEST_FILM / duration
    if not motion.follows_cycles:
        frame_interval = float(np.median(np.diff(motion.time)))
        largest = min(largest, 1.0 / (_LEAST_FRAMES_PER_SECOND * frame_interval))
    return max(1.0, round_below(largest))


def _usual_size(motion: Motion, times: FilmTimes) -> tuple[int, int]:
    """Width and height of a film in pixels, even numbers, if the user has chosen none.

    A film of a container from the side has the shape of the container and of the texts above and
    below it, so that there is nothing empty beside it.
    """
    if not from_the_side(motion.case):
        return USUAL_SIZE
    view = _view_from_the_side(motion, _frames_of(times))
    width, height, _ = view.high - view.low
    aspect = float(width / height) / (1.0 + _HEIGHT_OF_TEXTS)
    aspect = min(max(aspect, _SMALLEST_ASPECT), USUAL_SIZE[0] / USUAL_SIZE[1])
    pixels = USUAL_SIZE[0] * USUAL_SIZE[1]
    width_in_pixels = 2 * round(sqrt(pixels * aspect) / 2.0)
    return width_in_pixels, 2 * round(pixels / width_in_pixels / 2.0)


def _frames_of(times: FilmTimes) -> slice:
    """The frames between the first and the last picture."""
    return slice(int(times.frame[0]), ceil(times.frame[-1]) + 1)


def _view_from_the_side(motion: Motion, frames: slice) -> Scene:
    """The view of a container in perspective, with its walls."""
    view = Scene.around(motion, oblique_axes(motion), 1.0, frames).with_walls(frames)
    margin = (_EXTENT_FACTOR_OF_CONTAINER - 1.0) / 2.0 * (view.high - view.low)
    return replace(
        view, low=view.low - margin, high=view.high + margin, angle_of_view=ANGLE_OF_VIEW
    )


def _scene_of(motion: Motion, times: FilmTimes, size: tuple[int, int]) -> Scene:
    """The view of a film, in which the beads stay from its first to its last picture."""
    width, height = size
    frames = _frames_of(times)
    if from_the_side(motion.case):
        view = _view_from_the_side(motion, frames)
    else:
        extent_factor = _TRAY_EXTENT_FACTOR if from_above(motion.case) else _EXTENT_FACTOR
        view = Scene.around(motion, camera_axes(motion), extent_factor, frames)
    return replace(view, rolling=True).following(width / height, _EXTENT_FACTOR, frames)


@dataclass(frozen=True)
class _Film:
    """The pictures of a film, which are drawn when they are asked for.

    Attributes
    ----------
    window
        Draws the scene.
    captions
        Draws texts into pictures.
    times
        Times of K pictures.
    bridges : list of ndarray, each of shape (B, 3)
        Contacts of the bridges of each picture.
    """

    window: Window
    captions: _Captions
    times: FilmTimes
    bridges: list[IntArray]

    @property
    def count(self) -> int:
        """Number of pictures."""
        return len(self.times.time)

    def pictures(
        self, numbers: Iterable[int], on_progress: Tell | None = None
    ) -> Iterator[Picture]:
        """Draw pictures by their numbers, from 0, in ascending order.

        ``on_progress`` is called after each of them.
        """
        for number in numbers:
            picture = self.window.picture(self.times.frame[number], self.bridges[number])
            yield self.captions.draw_into(picture, number)
            if on_progress is not None:
                done = number + 1
                on_progress(Progress(done / self.count, f"{done} of {self.count} frames"))


class _Captions:
    """Texts of a film: time, slow motion, drive, tilt, scale bar and gravity.

    Parameters
    ----------
    scene
        The scene that pictures show.
    times
        Times of the pictures.
    size
        Their width and height in pixels.
    """

    def __init__(self, scene: Scene, times: FilmTimes, size: tuple[int, int]) -> None:
        from matplotlib import get_data_path
        from PIL import ImageFont

        self._scene = scene
        self._case = scene.motion.case
        self._times = times
        self._width, self._height = size
        line_height = min(self._height // _LINES_PER_PICTURE, self._width // _LINES_PER_WIDTH)
        self._line = max(_LEAST_LINE_HEIGHT, line_height)
        # Pillow's own font has no × and no ².
        font = Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
        self._large = ImageFont.truetype(font, round(1.2 * self._line))
        self._small = ImageFont.truetype(font, round(0.85 * self._line))
        # All pictures may show the same frame; then the interval is zero.
        interval = float(np.diff(times.time).max(initial=0.0)) or 1.0
        self._decimals = max(0, ceil(-log10(interval) - 1e-9))
        mm_per_pixel = scene.height(self._width / self._height) / self._height
        self._bar = round_below(mm_per_pixel * self._width / 5.0)  # mm
        self._bar_pixels = self._bar * scene.shortening / mm_per_pixel
        self._stroke = max(2, self._line // 8)

    def draw_into(self, picture: Picture, number: int) -> Picture:
        """Draw the captions of the picture with a number into it."""
        from PIL import Image, ImageDraw

        image = Image.fromarray(picture)
        draw = ImageDraw.Draw(image)
        self._draw_texts(draw, number)
        if self._case.boundary.tilted and self._case.environment.gravity:
            self._draw_gravity(draw)
        self._draw_bar(draw)
        return np.asarray(image)

    def _texts(self, number: int) -> list[str]:
        """What is written below or beside the time of a picture."""
        speed = speed_text(self._times.slowdown)
        if self._times.stroboscopic:
            speed += ", stroboscopic"
        texts = [speed]
        if self._scene.camera_path is not None:
            toward, direction = named_direction(self._scene.motion)
            displacement = self._scene.camera_displacement(self._times.frame[number]) @ toward
            texts.append(f"{displacement:z.1f} mm {direction} from the start")
        if self._case.boundary.tilted:
            texts.append(self._case.boundary.tilted)
        texts += self._scene.colour_legend
        texts += bridges_text(self._case).split(", ")
        return texts

    def _rows(self, number: int) -> list[str]:
        """The texts below the time in rows: one each, or of a container as wide as the picture."""
        texts = self._texts(number)
        if not from_the_side(self._case):
            return texts
        rows: list[str] = []
        for text in texts:
            longer = f"{rows[-1]}, {text}" if rows else text
            if rows and self._small.getlength(longer) <= self._width - 2 * self._line:
                rows[-1] = longer
            else:
                rows.append(text)
        return rows

    @property
    def _height_above(self) -> float:
        """Height of the texts above a container, pixels."""
        rows = max(len(self._rows(0)), len(self._rows(len(self._times.time) - 1)))
        return (2.8 + 1.5 * rows) * self._line

    def scene_between_texts(self) -> Scene:
        """The scene with space above and below for the texts, which cover nothing of it."""
        line = self._line
        above = self._height_above
        below = 2.5 * line
        width, height, _ = self._scene.high - self._scene.low
        mm_per_pixel = max(height / (self._height - above - below), width / self._width)
        low = self._scene.low.copy()
        high = self._scene.high.copy()
        low[1] -= mm_per_pixel * below
        high[1] = low[1] + mm_per_pixel * self._height
        return replace(self._scene, low=low, high=high)

    def _draw_texts(self, draw: ImageDraw, number: int) -> None:
        """Write time, slow motion and legend at the top, and the drive at the bottom."""
        line = self._line
        clock = f"{self._times.time[number]:.{self._decimals}f} s"
        if from_the_side(self._case):
            # The walls of a container that is open at the top reach beyond the picture.
            draw.rectangle([0.0, 0.0, self._width, self._height_above], "white")
        draw.text((line, line), clock, _BLACK, self._large, anchor="lt")
        is_wide = self._width > 2 * self._height and not from_the_side(self._case)
        if from_above(self._case) or is_wide:
            # Below the time the texts would be over the beads.
            left = 2 * line + self._large.getlength(clock)
            texts = ", ".join(self._texts(number))
            draw.text((left, 1.2 * line), texts, _DARK_GREY, self._small, anchor="lt")
        else:
            for row, text in enumerate(self._rows(number)):
                place = (line, (2.8 + 1.5 * row) * line)
                draw.text(place, text, _DARK_GREY, self._small, anchor="lt")
        left = line + self._draw_drive(draw)
        bottom = self._height - line
        drive = drive_description(self._case)
        draw.text((left, bottom), drive, _DARK_GREY, self._small, anchor="ls")

    def _draw_drive(self, draw: ImageDraw) -> float:
        """Draw an arrow for each direction of the drive; return the width that they need."""
        line = self._line
        directions = seen_directions(self._case, self._scene.axes)
        if not directions:
            return 0.0
        middle = np.array([1.8 * line, self._height - 1.4 * line])
        for direction in directions:
            half = 0.9 * line * direction * [1.0, -1.0]  # pixels are counted downward
            self._draw_arrow(draw, middle, middle + half)
            self._draw_arrow(draw, middle, middle - half)
        return 2.4 * line

    def _draw_arrow(self, draw: ImageDraw, tail: FloatArray, tip: FloatArray) -> None:
        """Draw an arrow of the drive from its tail to its tip (pixels)."""
        along = (tip - tail) / np.linalg.norm(tip - tail)
        across = np.array([-along[1], along[0]])
        neck = tip - 0.5 * self._line * along
        side = 0.28 * self._line * across
        shaft = np.concatenate([tail, neck])
        head = np.concatenate([neck + side, neck - side, tip])
        draw.line(shaft.tolist(), DRIVE_COLOUR, self._stroke)
        draw.polygon(head.tolist(), DRIVE_COLOUR)

    def _draw_gravity(self, draw: ImageDraw) -> None:
        """Draw an arrow that points down, with its name."""
        line = self._line
        x = self._width - line
        tip = 5.5 * line
        head = tip - line
        half_width = 0.4 * line
        draw.line([x, line, x, head], _BLACK, self._stroke)
        draw.polygon([x - half_width, head, x + half_width, head, x, tip], _BLACK)
        draw.text((x - 0.8 * line, 3.0 * line), "g", _BLACK, self._large, anchor="rm")

    def _draw_bar(self, draw: ImageDraw) -> None:
        """Draw the scale bar with its length."""
        right = self._width - self._line
        left = right - self._bar_pixels
        bottom = self._height - self._line
        draw.rectangle([left, bottom - self._stroke, right, bottom], _BLACK)
        place = ((left + right) / 2.0, bottom - 1.5 * self._stroke)
        draw.text(place, f"{self._bar:g} mm", _BLACK, self._small, anchor="md")


def speed_text(slowdown: float) -> str:
    """The slow motion as text: ``20 × slower``."""
    if slowdown == 1.0:
        return "real time"
    if slowdown > 1.0:
        return f"{slowdown:.4g} × slower"
    return f"{1.0 / slowdown:.4g} × faster"


def _write_mp4(
    path: Path, film: _Film, size: tuple[int, int], fps: int, on_progress: Tell | None
) -> None:
    """Write H.264 with ffmpeg, and count the pictures: ffmpeg does not report a full disk."""
    from imageio_ffmpeg import count_frames_and_secs, write_frames

    # The index at the start of the file: browsers play it while it loads. The preset takes 0.6 of
    # the time of ffmpeg's own, for files that are larger by a tenth.
    writer = write_frames(
        path,
        size,
        fps=fps,
        codec="libx264",
        quality=_MP4_QUALITY,
        macro_block_size=2,
        output_params=["-movflags", "+faststart", "-preset", "veryfast"],
    )
    writer.send(None)
    try:
        for picture in film.pictures(range(film.count), on_progress):
            writer.send(np.ascontiguousarray(picture))
    finally:
        writer.close()
    try:
        written, _ = count_frames_and_secs(str(path))
    except (RuntimeError, OSError):
        written = 0
    if written != film.count:
        raise WalkersError(
            f"ffmpeg wrote {written} of the {film.count} pictures of {path.parent}: "
            "is the disk full?"
        )


def _write_gif(path: Path, film: _Film, fps: int, on_progress: Tell | None) -> None:
    """Write all pictures with one palette and no dithering, so that parts at rest need no space."""
    from PIL import Image

    samples = np.linspace(0, film.count - 1, _GIF_SAMPLES).astype(int).tolist()
    sample = Image.fromarray(np.concatenate(list(film.pictures(samples))))
    palette = sample.quantize(_GIF_COLOURS, method=Image.Quantize.MEDIANCUT)

    def reduced() -> Iterator[Image.Image]:
        for picture in film.pictures(range(film.count), on_progress):
            image = Image.fromarray(picture)
            yield image.quantize(palette=palette, dither=Image.Dither.NONE)

    images = reduced()
    next(images).save(
        path, save_all=True, append_images=images, duration=1000 // fps, loop=0, optimize=False
    )
