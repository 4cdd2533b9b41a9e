"""Films of runs: beads that are seen to roll, with the physical time, the slow motion and a scale in the picture.

The camera rests in the laboratory, so that the boundary is seen to shake; films whose pictures are half a cycle apart
or more show one phase of the drive, as a stroboscope does.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil, log10
from pathlib import Path

import numpy as np

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.units import DURATION, parse_quantity
from walkers.postprocess.film_files import check_film, write_film
from walkers.postprocess.film_times import FilmTimes, film_times, positions_at
from walkers.postprocess.motion import Motion, boundary_motion, read_motion
from walkers.postprocess.rolling import turns_of
from walkers.postprocess.scene import Camera, Picture, Window, camera_axes, pointed_out, round_below

FILM_NAME = "film.mp4"
FPS = 25
"""Pictures a second; a GIF can have as many."""
_SIZES = {"360p": (640, 360), "480p": (854, 480), "720p": (1280, 720), "1080p": (1920, 1080)}
_SAMPLES = 6
"""Pictures from which a GIF takes its colours."""
_LETTERS = 24
"""Of them, one below the other, would fill a picture."""
_LEAST_LETTERS = 15
"""Pixels."""
_AROUND = 1.2
"""Height and width of the picture over those of what the beads reach."""


@dataclass(frozen=True)
class FilmOptions:
    """How a film is made.

    Attributes
    ----------
    size
        Pixels across and up.
    fps
        Pictures a second.
    slowdown
        How many times slower than in reality; chosen if None (`walkers.postprocess.film_times.film_times`).
    walker
        Number of the walker to show, of walkers that are independent.
    begin, end
        Physical time from which and until which to show, s.
    """

    size: tuple[int, int] = _SIZES["720p"]
    fps: int = FPS
    slowdown: float | None = None
    walker: int | None = None
    begin: float = 0.0
    end: float | None = None


def render_film(
    directory: Path,
    destination: Path | None = None,
    options: FilmOptions | None = None,
    *,
    on_progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Film a run: one of its walkers if they are independent, else all beads, walkers and climbers coloured.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The MP4 or GIF to write; ``film.mp4`` in the run directory if None.
    options
        How; `FilmOptions` as they are if None.
    on_progress
        Called with the number of pictures made and of all.

    Returns
    -------
    Path
        The film.

    Raises
    ------
    InputError
        If the format cannot hold it, there is no such walker, or nothing is between begin and end.
    FilmFailed
        If ffmpeg could not write all of it.
    """
    path, options = destination or directory / FILM_NAME, options or FilmOptions()
    check_film(path, options.size, options.fps)
    motion = _shown(read_motion(directory).driven, options.walker)
    times = film_times(motion, options.fps, options.slowdown, options.begin, options.end)
    film = _Film(motion, times, options.size)
    count = len(times.time)

    def pictures() -> Iterator[Picture]:
        for number in range(count):
            yield film.picture(number)
            if on_progress is not None:
                on_progress(number + 1, count)

    try:
        is_gif = path.suffix.lower() == ".gif"
        samples = [film.picture(int(number)) for number in np.linspace(0, count - 1, _SAMPLES)] if is_gif else []
        write_film(path, pictures(), count, options.fps, samples)
    finally:
        film.close()
    return path


def parse_size(text: str) -> tuple[int, int]:
    """Read a size of pictures, such as ``720p`` or ``1280x720``, pixels across and up.

    Raises
    ------
    InputError
        If it is none.
    """
    numbers = re.fullmatch(r"(\d{2,4})x(\d{2,4})", text.strip().lower())
    if numbers and min(map(int, numbers.groups())) >= 64:
        return int(numbers[1]), int(numbers[2])
    if text in _SIZES:
        return _SIZES[text]
    expected = f"{text!r}: expected {', '.join(_SIZES)}, or pixels across and up such as 1280x720, 64 at least"
    raise InputError("--size", [Problem("", None, expected)])


def parse_time(option: str, text: str) -> float:
    """Read a physical time that an option gives, such as ``0.1 s``.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        return parse_quantity(text, DURATION)
    except ValueError as error:
        raise InputError(option, [Problem("", None, f'{text!r}: expected a time such as "0.1 s"')]) from error


def _shown(motion: Motion, walker: int | None) -> Motion:
    """The motion of one walker where they are independent, else all of it."""
    count = len(motion.walkers)
    if not motion.case.apart:
        if walker is not None:
            told = "the walkers of this run are shown together" if count else "the run has no walkers"
            raise InputError("--walker", [Problem("", None, told)])
        return motion
    if walker is not None and walker >= count:
        raise InputError("--walker", [Problem("", None, f"{walker}: expected less than {count}, the run's walkers")])
    return motion.of_walkers(motion.walkers[walker or 0 :][:1])


class _Film:
    """The pictures of a film, in any order."""

    def __init__(self, motion: Motion, times: FilmTimes, size: tuple[int, int]) -> None:
        self._motion, self._times = motion, times
        self._chosen, self._turns = pointed_out(motion), turns_of(motion)
        self._shift, _ = boundary_motion(motion.case.drive, times.time)
        seen = motion.select(slice(int(times.frame[0]), int(times.frame[-1]) + 2))
        camera = Camera.around(seen, camera_axes(motion), share=_AROUND)
        self._window = Window(seen, camera, size, rolling=self._turns is not None)
        self._caption = _Caption(motion, times, self._window.pixels_per_mm, size)

    def picture(self, number: int) -> Picture:
        """One of them."""
        frame, share = int(self._times.frame[number]), float(self._times.share[number])
        place = positions_at(self._motion, frame, share)
        turned = None if self._turns is None else self._turns.at(frame, share)
        scene = self._window.picture(place, self._chosen(frame), self._shift[number], turned)
        return self._caption.on(scene, float(self._times.time[number]))

    def close(self) -> None:
        """Give back the window."""
        self._window.close()


class _Caption:
    """What is written into each picture: time, slow motion, the drive, a scale bar."""

    def __init__(self, motion: Motion, times: FilmTimes, pixels_per_mm: float, size: tuple[int, int]) -> None:
        from matplotlib import get_data_path
        from PIL import ImageFont

        # Pillow's own letters have no × and no ².
        font = Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
        self._size, self._letters = size, max(_LEAST_LETTERS, size[1] // _LETTERS)
        self._large, self._small = (ImageFont.truetype(font, round(share * self._letters)) for share in (1.2, 0.85))
        # All pictures may be of one frame, where frames are rarer than pictures.
        between = float(np.diff(times.time).max(initial=0.0)) or 1.0
        self._decimals = max(0, ceil(-log10(between) - 1e-9))
        self._bar = round_below(size[0] / 5.0 / pixels_per_mm)
        self._bar_pixels = self._bar * pixels_per_mm
        self._speed = told_speed(times.slowdown) + (", stroboscopic" if times.stroboscopic else "")
        drive = motion.case.drive
        self._drive = f"{drive.frequency:g} Hz, {drive.peak_acceleration:.3g} m/s²"

    def on(self, picture: Picture, time: float) -> Picture:
        """A picture with all of it."""
        from PIL import Image, ImageDraw

        page = Image.fromarray(picture)
        draw, edge, (wide, tall) = ImageDraw.Draw(page), self._letters, self._size
        draw.text((edge, edge), f"{time:.{self._decimals}f} s", "black", self._large, anchor="lt")
        draw.text((edge, 2.8 * edge), self._speed, "#333333", self._small, anchor="lt")
        draw.text((edge, tall - edge), self._drive, "#333333", self._small, anchor="ls")
        right, level, thick = wide - edge, tall - edge, max(2, edge // 8)
        draw.rectangle([right - self._bar_pixels, level - thick, right, level], "black")
        middle = right - self._bar_pixels / 2.0
        draw.text((middle, level - 1.5 * thick), f"{self._bar:g} mm", "black", self._small, anchor="md")
        return np.asarray(page)


def told_speed(slowdown: float) -> str:
    """The slow motion in words: ``20 × slower``."""
    if slowdown == 1.0:
        return "real time"
    return f"{slowdown:.4g} × slower" if slowdown > 1.0 else f"{1.0 / slowdown:.4g} × faster"
