"""Films of runs with rolling beads, physical time, slow motion and a scale bar.

The view is in the laboratory, so that the boundary shakes; the camera follows the beads if their path is long. If
successive pictures are half a cycle apart or more, all show the same phase of the drive (stroboscopic). On a tilted
boundary an arrow shows the direction of gravity.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import replace
from math import ceil, log10
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import WalkersError, input_error
from walkers.extras import require
from walkers.files import replacing
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.show.camera import camera_axes, from_above, named_direction
from walkers.postprocess.show.drawing import check_place
from walkers.postprocess.show.film_options import FilmOptions
from walkers.postprocess.show.meshes import round_below
from walkers.postprocess.show.necks import bridges_at, bridges_text
from walkers.postprocess.show.scene import Scene, motion_in_view
from walkers.postprocess.show.window import Picture, Window
from walkers.progress import Progress, Tell

_AROUND, _AROUND_TRAY = (
    1.2,
    1.3,
)  # extent of the picture over that of the paths of the beads, or of the tray
_LETTERS, _WIDE, _LEAST_LETTERS = (
    24,
    42,
    15,
)  # lines and heights of a line per picture; smallest height, pixels
_SECONDS = 10.0  # largest duration of a film without a given slowdown, s
_LEAST_SEEN = 10.0  # smallest number of recorded frames per second of such a film, if they do not resolve the cycle
_COLOURS, _SAMPLES = 40, 6  # colours of a GIF; pictures from which they are chosen


def render_film(
    directory: Path,
    to: Path | None = None,
    options: FilmOptions = FilmOptions(),
    *,
    on_progress: Tell | None = None,
) -> Path:
    """Render a film (MP4 or GIF, by default ``film.mp4`` in the run directory); see `FilmOptions` for what it shows.

    `InputError` if the format cannot hold the film, the walker does not exist, or no frame is between begin and end;
    `WalkersError` if ffmpeg fails. ``on_progress`` is called after each frame.
    """
    path, (wide, tall) = to or directory / "film.mp4", options.size
    check_place(path, ".mp4", ".gif")
    if is_gif := path.suffix.lower() == ".gif":
        if 100 % options.fps or options.fps > 50:  # pictures last whole hundredths of a second
            raise input_error(
                "fps", f"{options.fps}: expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF"
            )
    elif wide % 2 or tall % 2:
        raise input_error("size", f"{wide}x{tall}: expected even numbers for an MP4")
    else:
        require("film")
    motion, _ = motion_in_view(read_motion(directory).driven, options.walker)
    times = film_times(motion, options)
    count, frames = len(times.time), slice(int(times.frame[0]), ceil(times.frame[-1]) + 1)
    around = _AROUND_TRAY if from_above(motion.case) else _AROUND
    whole = replace(Scene.around(motion, camera_axes(motion), around, frames), rolling=True)
    scene = whole.following(wide / tall, _AROUND, frames)
    bridges = bridges_at(motion, times.frame)
    path.parent.mkdir(parents=True, exist_ok=True)
    with closing(Window(scene, options.size)) as window, beside(path) as new:
        write = _captions(scene, times, window.pixels_per_mm, options.size)

        def pictures(numbers: Iterable[int], tell: Tell | None = None) -> Iterator[Picture]:
            for number in numbers:
                yield write(window.picture(times.frame[number], bridges[number]), number)
                if tell is not None:
                    tell(Progress((number + 1) / count, f"{number + 1} of {count} frames"))

        every = pictures(range(count), on_progress)
        if is_gif:
            samples = np.linspace(0, count - 1, _SAMPLES).astype(int).tolist()
            _write_gif(new, every, options.fps, np.concatenate([*pictures(samples)]))
        else:
            _write_mp4(new, every, options, count)
    return path


class FilmTimes(NamedTuple):
    """Times of the K pictures of a film (s), and their frames of the motion, with fractions between two.

    In a ``stroboscopic`` film all pictures are at one phase of the drive.
    """

    time: FloatArray
    frame: FloatArray
    slowdown: float
    stroboscopic: bool


def film_times(motion: Motion, options: FilmOptions) -> FilmTimes:
    """Distribute the pictures of a film over the drive.

    Pictures that are half a cycle apart or more are moved to whole cycles, otherwise they would show a beat. If the
    frames do not resolve the cycle, each picture is the nearest frame. Times outside of the drive raise an InputError.
    """
    last, begin = float(motion.time[-1]), options.begin
    end = last if options.end is None else min(options.end, last)
    if not 0.0 <= begin < end:
        message = (
            f"nothing to show: expected times within the drive, 0 to {last:.4g} s, begin before end"
        )
        raise input_error("begin, end", message)
    follows, slowdown = motion.follows_cycles, options.slowdown
    if slowdown is None:
        largest = _SECONDS / (end - begin)
        if not follows:
            largest = min(largest, 1.0 / (_LEAST_SEEN * float(np.median(np.diff(motion.time)))))
        slowdown = max(1.0, round_below(largest))
    interval, cycle = 1.0 / (options.fps * slowdown), 1.0 / motion.case.excitation.frequency
    time = begin + interval * np.arange(int((end - begin) / interval + 1e-9) + 1)
    strobed = interval >= cycle / 2.0
    if strobed:
        time = np.round(time / cycle) * cycle
    numbers = np.arange(len(motion.time))
    frame = np.interp(time, motion.time, numbers)
    frame = frame if follows else frame.round()
    one_phase = strobed or motion.case.run.samples_per_cycle == 1
    return FilmTimes(np.interp(frame, numbers, motion.time), frame, slowdown, one_phase)


def _captions(
    scene: Scene, times: FilmTimes, pixels_per_mm: float, size: tuple[int, int]
) -> Callable[[Picture, int], Picture]:
    """A function that draws time, distance, slow motion, drive, tilt, scale bar and gravity into a picture."""
    from matplotlib import get_data_path
    from PIL import Image, ImageDraw, ImageFont

    (wide, tall), case = size, scene.motion.case
    above = from_above(case) or wide > 2 * tall  # of the beads, no room is left beside them
    edge = max(_LEAST_LETTERS, min(tall // _LETTERS, wide // _WIDE))
    # Pillow's own font has no × and no ².
    font = Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    large, small = (ImageFont.truetype(font, round(share * edge)) for share in (1.2, 0.85))
    # All pictures may show the same frame.
    decimals = max(0, ceil(-log10(float(np.diff(times.time).max(initial=0.0)) or 1.0) - 1e-9))
    speed = speed_text(times.slowdown) + (", stroboscopic" if times.stroboscopic else "")
    bar = round_below(wide / 5.0 / pixels_per_mm)
    toward, direction = named_direction(scene.motion)
    left, right, level, thick = (
        wide - edge - bar * pixels_per_mm,
        wide - edge,
        tall - edge,
        max(2, edge // 8),
    )

    def written(picture: Picture, number: int) -> Picture:
        page = Image.fromarray(picture)
        draw = ImageDraw.Draw(page)
        clock, lines = f"{times.time[number]:.{decimals}f} s", [speed]
        if scene.camera_path is not None:
            lines.append(
                f"{scene.camera_displacement(times.frame[number]) @ toward:z.1f} mm {direction} from the start"
            )
        lines += [case.boundary.tilted] if case.boundary.tilted else []
        lines += scene.colour_legend
        lines += bridges_text(case).split(", ")  # lines of their own beside the beads
        draw.text((edge, edge), clock, "black", large, anchor="lt")
        if above:
            draw.text(
                (2 * edge + large.getlength(clock), 1.2 * edge),
                ", ".join(lines),
                "#333333",
                small,
                anchor="lt",
            )
        else:
            for row, text in enumerate(lines):
                draw.text((edge, (2.8 + 1.5 * row) * edge), text, "#333333", small, anchor="lt")
        draw.text((edge, level), case.excitation.described(), "#333333", small, anchor="ls")
        if case.boundary.tilted and case.environment.gravity:
            tip = 5.5 * edge
            draw.line([right, edge, right, tip - edge], "black", thick)
            draw.polygon(
                [right - 0.4 * edge, tip - edge, right + 0.4 * edge, tip - edge, right, tip],
                "black",
            )
            draw.text((right - 0.8 * edge, 3.0 * edge), "g", "black", large, anchor="rm")
        draw.rectangle([left, level - thick, right, level], "black")
        draw.text(
            ((left + right) / 2.0, level - 1.5 * thick), f"{bar:g} mm", "black", small, anchor="md"
        )
        return np.asarray(page)

    return written


def speed_text(slowdown: float) -> str:
    """The slow motion as text: ``20 × slower``."""
    if slowdown == 1.0:
        return "real time"
    return f"{slowdown:.4g} × slower" if slowdown > 1.0 else f"{1.0 / slowdown:.4g} × faster"


def _write_mp4(path: Path, pictures: Iterator[Picture], options: FilmOptions, count: int) -> None:
    """Write H.264 with ffmpeg, which does not report a full disk."""
    from imageio_ffmpeg import count_frames_and_secs, write_frames

    # The index at the begin of the file: browsers play it while it loads. The preset takes 0.6 of the time of ffmpeg's
    # own, for files that are larger by a tenth.
    how = ["-movflags", "+faststart", "-preset", "veryfast"]
    writer = write_frames(
        path,
        options.size,
        fps=options.fps,
        codec="libx264",
        quality=7,
        macro_block_size=2,
        output_params=how,
    )
    writer.send(None)
    try:
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture))
    finally:
        writer.close()
    try:
        written, _ = count_frames_and_secs(str(path))
    except (RuntimeError, OSError):
        written = 0
    if written != count:
        raise WalkersError(
            f"ffmpeg wrote {written} of the {count} pictures of {path.parent}: is the disk full?"
        )


def _write_gif(path: Path, pictures: Iterator[Picture], fps: int, samples: Picture) -> None:
    """Write all pictures with one palette and no dithering, so that parts at rest need no space."""
    from PIL import Image

    palette = Image.fromarray(samples).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
    reduced = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in pictures
    )
    next(reduced).save(
        path, save_all=True, append_images=reduced, duration=1000 // fps, loop=0, optimize=False
    )
