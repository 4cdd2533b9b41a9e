"""Pictures one after the other into an MP4 (H.264, by ffmpeg) or an animated GIF (by Pillow)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.postprocess.scene import Picture
from walkers.runner.files import beside

if TYPE_CHECKING:
    from PIL import Image

SUFFIXES = (".mp4", ".gif")
_COLOURS = 40
"""In a GIF."""


class FilmFailed(WalkersError):
    """A film that could not be written as a whole."""


def check_film(path: Path, size: tuple[int, int], fps: int) -> None:
    """Refuse what a format cannot hold.

    Raises
    ------
    InputError
        If the name is none of an MP4 or GIF, an MP4's size is odd, or a GIF's pictures would not last whole hundredths
        of a second: its film would run at another speed than it says.
    """
    if path.suffix.lower() not in SUFFIXES or path.is_dir():
        raise InputError("--to", [Problem("", None, f"{path}: expected the name of a .mp4 or .gif file")])
    if path.suffix.lower() == ".mp4" and (size[0] % 2 or size[1] % 2):
        raise InputError("--size", [Problem("", None, f"{size[0]}x{size[1]}: expected even numbers for an MP4")])
    if path.suffix.lower() == ".gif" and (100 % fps or fps > 50):
        raise InputError("--fps", [Problem("", None, f"{fps}: expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF")])


def write_film(path: Path, pictures: Iterator[Picture], count: int, fps: int, samples: Sequence[Picture]) -> None:
    """Write a film beside its place and rename it.

    Parameters
    ----------
    path
        The file; its suffix says the format.
    pictures, count
        All of one size, and how many they are.
    fps
        Pictures a second.
    samples
        Some of the pictures, from which a GIF takes its colours.

    Raises
    ------
    FilmFailed
        If ffmpeg could not write all of it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with beside(path) as new:
        if path.suffix.lower() == ".gif":
            _write_gif(new, pictures, fps, samples)
        else:
            _write_mp4(new, pictures, count, fps)


def _write_mp4(path: Path, pictures: Iterator[Picture], count: int, fps: int) -> None:
    from imageio_ffmpeg import write_frames

    first = next(pictures)
    # With its index in front a browser plays it while it loads.
    options = ["-movflags", "+faststart"]
    writer = write_frames(
        path, first.shape[1::-1], fps=fps, codec="libx264", quality=7, macro_block_size=2, output_params=options
    )
    writer.send(None)
    try:
        writer.send(np.ascontiguousarray(first))
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture))
    finally:
        writer.close()
    _check_mp4(path, count)


def _check_mp4(path: Path, count: int) -> None:
    """Ffmpeg ends in silence when the disk is full."""
    from imageio_ffmpeg import count_frames_and_secs

    try:
        written, _ = count_frames_and_secs(str(path))
    except (RuntimeError, OSError):
        written = 0
    if written != count:
        raise FilmFailed(f"ffmpeg wrote {written} of the {count} pictures of {path.parent}: is the disk full?")


def _write_gif(path: Path, pictures: Iterator[Picture], fps: int, samples: Sequence[Picture]) -> None:
    """One palette for all pictures, no dithering: what does not move is the same in all of them and takes no room."""
    from PIL import Image

    palette = Image.fromarray(np.concatenate(samples)).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)

    def reduced(picture: Picture) -> Image.Image:
        return Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)

    first = reduced(next(pictures))
    following = (reduced(picture) for picture in pictures)
    first.save(path, save_all=True, append_images=following, duration=1000 // fps, loop=0, optimize=False)
