"""Read the engine's dumps: binary dumps of beads, and text dumps of bridges.

A binary dump (``dump custom … .bin``) has for each frame int64 step, int64 rows, int32 triclinic,
6 int32 boundary, 6 float64 box, int32 columns, int32 processes, then for each process int32 count
and that many float64. A text dump (``dump local``) has nine lines of header and a line for each
row. The names of the columns stand in the layout of the deck.

This module knows nothing of runs: `walkers.postprocess.measure.motion` reads those.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import WalkersError
from walkers.files import open_regular

_HEADER = struct.Struct("=qqi6i6dii")
"""Header of a frame of a binary dump."""
_COUNT = struct.Struct("=i")
"""Number of values of a process in a frame of a binary dump."""
_MOST_PROCESSES = 999_999
"""Largest number of processes of a header that is one."""
_LINES = 9
"""Lines of the header of a frame of a text dump."""


class DumpError(WalkersError):
    """A file that is not a binary dump, or has unexpected columns."""


class NoNumberError(DumpError):
    """A dump with NaN or infinity, from an unreported blow-up or a damaged disk."""


class _Part(NamedTuple):
    """The values of one process in a frame: offset in the file, bytes, and number of values."""

    offset: int
    size: int


class _Frame(NamedTuple):
    """A frame: offsets of its start and its end in the file, bytes; its step; its parts."""

    start: int
    end: int
    step: int
    parts: list[_Part]

    @property
    def size(self) -> int:
        """Number of its values."""
        return sum(part.size for part in self.parts)


class BinaryDump:
    """Complete frames of a binary dump.

    Parameters
    ----------
    path
        The file.
    columns
        Names of its columns.

    Attributes
    ----------
    path, columns
        As given.
    steps : ndarray of int, shape (frames,)
        Step of the engine of each frame.
    truncated
        Whether the file ends within a frame.

    Raises
    ------
    DumpError
        If the file is not a binary dump of so many columns.
    """

    def __init__(self, path: Path, columns: tuple[str, ...]) -> None:
        self.path = path
        self.columns = columns
        self.truncated = False
        self._bytes = memoryview(b"")
        with open_regular(path) as file:
            if os.fstat(file.fileno()).st_size > 0:  # an empty file cannot be mapped
                self._bytes = np.memmap(file, np.uint8, "r").data
        self._frames: list[_Frame] = []
        steps = []
        start = 0
        try:
            while start < len(self._bytes):
                frame = self._frame_at(start)
                self._frames.append(frame)
                steps.append(frame.step)
                start = frame.end
        except struct.error:
            self.truncated = True
        self.steps = np.array(steps, dtype=np.int64)

    def __len__(self) -> int:
        return len(self._frames)

    def _frame_at(self, start: int) -> _Frame:
        """The frame that begins at an offset; `struct.error` if the file ends within it."""
        step, rows, *_, columns, processes = _HEADER.unpack_from(self._bytes, start)
        is_header = step >= 0 and rows >= 0 and 1 <= processes <= _MOST_PROCESSES
        if columns != len(self.columns) or not is_header:
            raise DumpError(f"{self.path}: no dump of {len(self.columns)} columns (byte {start})")
        end = start + _HEADER.size
        parts = []
        for _ in range(processes):
            (count,) = _COUNT.unpack_from(self._bytes, end)
            parts.append(_Part(end + _COUNT.size, count))
            end += _COUNT.size + 8 * count  # bytes of a float64
        if end > len(self._bytes):
            raise struct.error
        frame = _Frame(start, end, step, parts)
        if frame.size != rows * columns:
            raise DumpError(f"{self.path}: the parts of the frame of step {step} do not add up")
        return frame

    @property
    def rows(self) -> int:
        """Number of rows of each frame, 0 without frames; `DumpError` if it changes."""
        sizes = {frame.size for frame in self._frames}
        if len(sizes) > 1:
            raise DumpError(f"{self.path}: the number of beads changes")
        return max(sizes, default=0) // len(self.columns)

    def frame(self, number: int) -> FloatArray:
        """Read the values of a frame.

        Parameters
        ----------
        number
            Number of the frame, from 0.

        Returns
        -------
        ndarray, shape (rows, columns)
            In the units of the engine; read only if the frame has one process.

        Raises
        ------
        NoNumberError
            If a value is NaN or infinite.
        """
        parts = [
            np.frombuffer(self._bytes, float, part.size, part.offset)
            for part in self._frames[number].parts
        ]
        flat = parts[0] if len(parts) == 1 else np.concatenate(parts)
        values = flat.reshape(-1, len(self.columns))
        is_finite = np.isfinite(values)
        if not is_finite.all():
            _, columns = np.nonzero(~is_finite)
            name = self.columns[columns[0]]
            step = self.steps[number]
            raise NoNumberError(f"{self.path}: {name} is not a number at step {step}")
        return values

    def stack(self) -> FloatArray:
        """All frames, shape (frames, rows, columns); errors are those of `rows` and `frame`."""
        stacked = np.empty((len(self), self.rows, len(self.columns)))
        for number in range(len(self)):
            stacked[number] = self.frame(number)
        return stacked

    def write_like(self, stacked: FloatArray, path: Path) -> None:
        """Write a dump of one process: the headers of these frames with other values.

        Parameters
        ----------
        stacked : ndarray, shape (frames, rows, columns)
            The values; the number of rows may be another one.
        path
            The new file.
        """
        with path.open("wb") as file:
            for frame, values in zip(self._frames, stacked, strict=True):
                step, _, *box, columns, _ = _HEADER.unpack_from(self._bytes, frame.start)
                file.write(_HEADER.pack(step, len(values), *box, columns, 1))
                file.write(_COUNT.pack(values.size))
                file.write(values.tobytes())


def local_frames(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, FloatArray]]:
    """Read a text dump of bridges (``dump local``), one frame after the other.

    Parameters
    ----------
    path
        The file.
    columns
        Names of its columns.

    Yields
    ------
    step : int
        Step of the engine.
    rows : ndarray, shape (rows, columns)
        The rows of the frame.

    Raises
    ------
    DumpError
        If the file is not such a dump, ends within a frame, or contains a NaN or an infinity.
    """
    try:
        file = open_regular(path)
    except OSError as error:
        raise DumpError(f"{path}: cannot be read ({error.strerror})") from error
    with file:
        while True:
            first_line = file.readline()
            if not first_line:
                return
            yield _local_frame(file, first_line, path, len(columns))


def _local_frame(
    file: IO[bytes], first_line: bytes, path: Path, columns: int
) -> tuple[int, FloatArray]:
    """Step and rows of the frame of a text dump whose first line has been read."""
    head = [first_line] + [file.readline() for _ in range(_LINES - 1)]
    if head[0] != b"ITEM: TIMESTEP\n":
        raise DumpError(f"{path}: not a local dump")
    try:
        step = int(head[1])
        count = int(head[3])
    except ValueError as error:
        raise DumpError(f"{path}: no header of a frame, or a part of one") from error
    body = [file.readline() for _ in range(count)]
    is_cut = not head[-1].endswith(b"\n")
    if body:
        is_cut = is_cut or not body[-1].endswith(b"\n")
    if is_cut:
        raise DumpError(f"{path}: ends within the frame of step {step}")
    try:
        values = np.fromstring(b"".join(body), dtype=np.float64, sep=" ")
    except ValueError as error:
        raise DumpError(f"{path}: not a number in the frame of step {step} ({error})") from error
    if len(values) != count * columns:
        raise DumpError(f"{path}: expected {columns} columns in the frame of step {step}")
    if not np.isfinite(values).all():
        raise DumpError(f"{path}: a NaN or an infinity in the frame of step {step}")
    return step, values.reshape(count, columns)


def write_local_dump(
    path: Path, columns: tuple[str, ...], frames: Iterable[tuple[int, FloatArray]]
) -> None:
    """Write a text dump as the engine does, with twelve digits; the bounds of the box are zero.

    Parameters
    ----------
    path
        The new file.
    columns
        Names of its columns.
    frames
        Step and rows, shape (rows, columns), of each frame.
    """
    lines = []
    for step, rows in frames:
        lines += [
            "ITEM: TIMESTEP",
            str(step),
            "ITEM: NUMBER OF ENTRIES",
            str(len(rows)),
            "ITEM: BOX BOUNDS ff ff ff",
            "0 0",
            "0 0",
            "0 0",
            f"ITEM: ENTRIES {' '.join(columns)}",
        ]
        for row in rows.tolist():
            cells = [f"{value:.12g}" for value in row]
            lines.append(" ".join(cells) + " ")
    path.write_text("\n".join(lines) + "\n", "ascii")
