"""The box seen from the side, as in Fig. 1a of Khan et al.: pictures beside each other, and films."""

from __future__ import annotations

import re
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.inputs.pile import PileCase
from walkers.inputs.units import DURATION, parse_quantity
from walkers.postprocess.drawing import check_picture, new_figure, save_figure, styled
from walkers.postprocess.pile_result import PileAnalysis, analyse
from walkers.postprocess.rendering import SideView
from walkers.runner.directory import CASE_NAME
from walkers.runner.files import beside, read_json

SERIES_NAME = "series.png"
FILM_NAME = "pile.mp4"
_SHOWN = 6
"""Pictures in a time series."""
_TOLERANCE = 0.1
"""Of a time between pictures: frames are where they are."""
_MARGIN = 64
"""Pixels for the heights beside a film."""
_LEAST_WIDTH = 200
"""Pixels; on less the time has no room."""


@styled
def render_series(
    directory: Path, destination: Path | None = None, *, images: int = _SHOWN, apart: float | None = None
) -> list[Path]:
    """Side views of the box beside each other, climbers coloured, with times and a scale of heights.

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
    found = analyse(directory)
    motion = found.motion
    frames = _frames_evenly(found, images) if apart is None else _frames_apart(found, images, apart, directory)
    top = _top(found)
    width = motion.case.container.width
    across = max(0.8, 4.0 * width / top + 0.3)  # inches a picture, which is four inches high
    figure, axes = new_figure(1.0 + across * len(frames), 5.0, ncols=len(frames), sharey=True)
    view = SideView(motion, top)
    aside = max(1, int(width * 400.0))  # mm, whole ones within the picture
    decimals = 2 if apart is None or apart >= 0.1 else 4
    for panel, frame in zip(np.atleast_1d(axes), frames, strict=True):
        picture = view.picture(frame, _climbers(found, frame))
        panel.imshow(picture, extent=(-width * 500.0, width * 500.0, 0.0, top * 1e3), interpolation="bilinear")
        panel.set(title=f"{motion.time[frame]:.{decimals}f} s", xlabel="x (mm)")
        panel.title.set_fontsize(8)
        panel.set_xticks([-aside, 0, aside])
        panel.grid(visible=False)
    view.close()
    np.atleast_1d(axes)[0].set_ylabel("height (mm)")
    return save_figure(figure, path, [directory.name])


def render_film(directory: Path, destination: Path | None = None, *, slowdown: float = 1.0) -> Path:
    """Film the box from the side, climbers coloured, with the time and a scale of heights in the picture.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The MP4 to write (H.264); ``pile.mp4`` in the run directory if None.
    slowdown
        How many times slower than in reality: every frame of the drive is shown, one after the other.

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
    found = analyse(directory)
    time = found.motion.time
    shown = range(found.motion.first_driven, len(time))
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures = _film(found, shown)
    first = next(pictures)
    rate = 1.0 / (float(np.median(np.diff(time[shown.start :]))) * slowdown) if len(shown) > 1 else 1.0
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


def _film(found: PileAnalysis, frames: Sequence[int]) -> Generator[npt.NDArray[np.uint8]]:
    """The pictures of a film, each with heights on its left and the time above."""
    from PIL import Image, ImageDraw, ImageFont

    top = _top(found)
    pixels = min(40.0, 1.6 / top)  # as high as a screen at most
    view = SideView(found.motion, top, pixels)
    font = ImageFont.load_default(16)
    try:
        for frame in frames:
            box = Image.fromarray(view.picture(frame, _climbers(found, frame)))
            wide = 2 * (max(_MARGIN + box.width + 8, _LEAST_WIDTH) // 2)
            page = Image.new("RGB", (wide, box.height + 48), "white")
            page.paste(box, (_MARGIN, 32))
            draw = ImageDraw.Draw(page)
            floor, left = 32 + box.height, _MARGIN - 2
            draw.line(
                [(left, 32), (left, floor), (_MARGIN + box.width + 1, floor), (_MARGIN + box.width + 1, 32)], "black"
            )
            draw.text((_MARGIN, 6), f"{found.motion.time[frame]:.3f} s", "black", font)
            for height in range(0, int(top * 1e3) + 1, 5):
                level = floor - height * box.height / (top * 1e3)
                draw.line([(left - 6, level), (left, level)], "black")
                draw.text((left - 10, level), f"{height} mm" if height else "0", "black", font, anchor="rm")
            yield np.asarray(page)
    finally:
        view.close()


def _top(found: PileAnalysis) -> float:
    """Height up to which the box is shown, m: a little more than any bead reaches while it is shaken."""
    motion = found.motion
    start = motion.first_driven
    return 1.05 * float((motion.position[start:, :, 2] + motion.radius).max())


def _frames_evenly(found: PileAnalysis, images: int) -> list[int]:
    time = found.motion.time
    start = found.motion.first_driven
    return [int(frame) for frame in np.unique(np.linspace(start, len(time) - 1, images).round().astype(int))]


def _frames_apart(found: PileAnalysis, images: int, apart: float, directory: Path) -> list[int]:
    """The last frames of a run that are so many seconds apart, to a tenth of that."""
    motion = found.motion
    last = len(motion.time) - 1
    between = motion.case.run.steps_per_frame * motion.case.run.time_step
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
            frequency = PileCase.from_dict(read_json(directory / CASE_NAME)).drive.frequency
            seconds = float(cycles["many"] or 1) / int(cycles["parts"] or 1) / frequency
        else:
            seconds = parse_quantity(text, DURATION)
        if seconds > 0.0:
            return seconds
    except (ValueError, ZeroDivisionError):
        pass
    raise InputError("--interval", [Problem("", None, f'{text!r}: expected a time such as "2 s", or "T/4" of a cycle')])


def _climbers(found: PileAnalysis, frame: int) -> set[int]:
    """Beads of the clusters that climb and are free in a frame."""
    return {
        bead
        for track, climb in zip(found.tracks, found.climbs, strict=True)
        if climb.climbed
        for bead in track.members_at(frame)
    }
