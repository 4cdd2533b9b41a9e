"""Options of films, for Python and for the program; nothing that takes long is imported."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from cyclopts import Parameter

from walkers.errors import check_limits, input_error

_NUMBER = re.compile(r"[\d.]+(e[-+]?\d+)?", re.IGNORECASE)
"""A number without a unit."""
_PIXELS = re.compile(r"(\d{2,4})x(\d{2,4})")
"""Width and height in pixels."""
USUAL_SIZE = (1280, 720)
"""Width and height in pixels of a film that is not of a container from the side."""
_SIZES = {"360p": (640, 360), "480p": (854, 480), "720p": USUAL_SIZE, "1080p": (1920, 1080)}
"""Names of sizes: width and height in pixels."""
_LEAST_SIZE = 64
"""Smallest width and height, pixels."""


def _read_size(_type: Any, tokens: Any) -> tuple[int, int]:
    """Read a size such as ``720p`` or ``1280x720`` as width and height in pixels.

    Raises `InputError` for any other text.
    """
    text = tokens[0].value
    pixels = _PIXELS.fullmatch(text.strip().lower())
    if pixels:
        return int(pixels[1]), int(pixels[2])
    if text not in _SIZES:
        names = ", ".join(_SIZES)
        raise input_error(
            "size", f"{text!r}: expected {names}, or width and height such as 1280x720"
        )
    return _SIZES[text]


def _read_seconds(_type: Any, tokens: Any) -> float:
    """Read the physical time of an option, such as ``0.1 s`` or a number, in s.

    Raises `InputError` for any other text.
    """
    from walkers.inputs.units import DURATION, parse_quantity

    option = tokens[0].keyword
    text = tokens[0].value
    with_unit = f"{text} s" if _NUMBER.fullmatch(text) else text
    try:
        return parse_quantity(with_unit, DURATION)
    except ValueError as error:
        raise input_error(option, f'{text!r}: expected a time such as "0.1 s"') from error


def _check_size(size: object) -> None:
    """Raise `InputError` for a size that is not a width and a height in pixels."""
    if not isinstance(size, Sequence) or len(size) != 2:
        raise input_error("size", f"{size!r}: expected width and height, in pixels")
    for pixels in size:
        check_limits("size", pixels, _LEAST_SIZE, whole=True)


Seconds = Annotated[float, Parameter(converter=_read_seconds, metavar="TIME")]
"""A time, s; the program reads it with its unit."""


@Parameter(name="*")
@dataclass(frozen=True)
class FilmOptions:
    """Options of a film; numbers that cannot be used raise `InputError`.

    Parameters
    ----------
    size
        Film: width and height in pixels; as an option 360p, 480p, 720p, 1080p, or pixels such as
        1280x720; default: 720p, or as many pixels in the shape of the container.
    fps
        Film: frames per second.
    slowdown
        Film: slow motion factor; default: 1, 2, 5, 10, ..., chosen so that the film lasts 5 to
        10 s.
    walker
        Walker to show by itself, counted from 0; default: the first of independent walkers,
        otherwise all beads.
    begin
        Film: physical time of the first frame, s; as an option with its unit, such as '0.1 s'.
    end
        Film: physical time of the last frame; default: the end of the run.
    """

    size: Annotated[
        tuple[int, int] | None,
        Parameter(converter=_read_size, n_tokens=1, metavar="SIZE", show_default=False),
    ] = None
    fps: int = 25
    slowdown: float | None = None
    walker: int | None = None
    begin: Seconds = 0.0
    end: Seconds | None = None

    def __post_init__(self) -> None:
        """Check what does not depend on a run."""
        if self.size is not None:
            _check_size(self.size)
        check_limits("fps", self.fps, 1, 60)
        check_limits("slowdown", self.slowdown, 0.05, 1e4)
        check_limits("walker", self.walker, whole=True)
        check_limits("begin", self.begin)
        check_limits("end", self.end)
