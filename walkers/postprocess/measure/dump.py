"""Read the engine's dumps: binary dumps of beads (``dump custom … .bin``) and text dumps of bridges.

A frame of beads is int64 step, int64 rows, int32 triclinic, 6 int32 boundary, 6 float64 box, int32 columns, int32
processes, then for each process int32 count and that many float64. The layout has the names of the columns.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import WalkersError
from walkers.files import open_regular

_HEADER = struct.Struct("=qqi6i6dii")
_COUNT = struct.Struct("=i")
_LINES = 9
"""Lines of the header of a frame of bridges."""


class DumpError(WalkersError):
    """A file that is not a binary dump, or has unexpected columns."""


class NoNumberError(DumpError):
    """A dump with NaN or infinity, from an unreported blow-up or a damaged disk."""


class _Frame(NamedTuple):
    """A frame: its bytes from ``start`` to ``end``, and offset (bytes) and number of values of each process."""

    start: int
    end: int
    step: int
    parts: list[tuple[int, int]]


class BinaryDump:
    """Complete frames of a binary dump with named columns, and the engine's step of each.

    It is ``truncated`` if it ends within a frame. `DumpError` if the file is not such a dump.
    """

    def __init__(self, path: Path, columns: tuple[str, ...]) -> None:
        self.path, self.columns, self.truncated = path, columns, False
        with open_regular(path) as file:
            is_empty = not os.fstat(file.fileno()).st_size
            self._bytes = memoryview(b"") if is_empty else np.memmap(file, np.uint8, "r").data
        self._frames: list[_Frame] = []
        try:
            while (end := self._frames[-1].end if self._frames else 0) < len(self._bytes):
                self._frames.append(self._frame_at(end))
        except struct.error:
            self.truncated = True
        self.steps = np.array([frame.step for frame in self._frames], dtype=np.int64)

    def __len__(self) -> int:
        return len(self._frames)

    def _frame_at(self, start: int) -> _Frame:
        """The frame that begins at an offset; `struct.error` if the file ends within it."""
        step, rows, *_, columns, processes = _HEADER.unpack_from(self._bytes, start)
        if columns != len(self.columns) or rows < 0 or not 1 <= processes < 1_000_000 or step < 0:
            raise DumpError(f"{self.path}: no dump of {len(self.columns)} columns (byte {start})")
        end, parts = start + _HEADER.size, []
        for _ in range(processes):
            (count,) = _COUNT.unpack_from(self._bytes, end)
            parts.append((end + _COUNT.size, count))
            end += _COUNT.size + 8 * count
        if end > len(self._bytes):
            raise struct.error
        if sum(count for _, count in parts) != rows * columns:
            raise DumpError(f"{self.path}: the parts of the frame of step {step} do not add up")
        return _Frame(start, end, step, parts)

    @property
    def rows(self) -> int:
        """Number of rows of each frame, 0 without frames; `DumpError` if it changes."""
        sizes = {sum(count for _, count in frame.parts) for frame in self._frames}
        if len(sizes) > 1:
            raise DumpError(f"{self.path}: the number of beads changes")
        return max(sizes, default=0) // len(self.columns)

    def frame(self, number: int) -> FloatArray:
        """Values of a frame, shape (rows, columns); `NoNumberError` if one of them is not a number."""
        parts = [
            np.frombuffer(self._bytes, float, count, start)
            for start, count in self._frames[number].parts
        ]
        values = (parts[0] if len(parts) == 1 else np.concatenate(parts)).reshape(
            -1, len(self.columns)
        )
        is_finite = np.isfinite(values)
        if not is_finite.all():
            _, columns = np.nonzero(~is_finite)
            name, step = self.columns[columns[0]], self.steps[number]
            raise NoNumberError(f"{self.path}: {name} is not a number at step {step}")
        return values

    def stack(self) -> FloatArray:
        """All frames, shape (frames, rows, columns); errors of `rows` and `frame`."""
        stacked = np.empty((len(self), self.rows, len(self.columns)))
        for number in range(len(self)):
            stacked[number] = self.frame(number)
        return stacked

    def write_like(self, stacked: FloatArray, path: Path) -> None:
        """Write a dump of one process: the headers of these frames with other data, shape (frames, rows, columns)."""
        with path.open("wb") as file:
            for frame, values in zip(self._frames, stacked, strict=True):
                step, _, *box, columns, _ = _HEADER.unpack_from(self._bytes, frame.start)
                head = _HEADER.pack(step, len(values), *box, columns, 1) + _COUNT.pack(values.size)
                file.write(head + values.tobytes())


def local_frames(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, FloatArray]]:
    """Step and rows, shape (rows, columns), of each frame of a text dump of bridges (``dump local``), one by one.

    `DumpError` if the file is not such a dump, ends within a frame, or holds a NaN or an infinity.
    """
    try:
        file = open_regular(path)
    except OSError as error:
        raise DumpError(f"{path}: cannot be read ({error.strerror})") from error
    with file:
        while line := file.readline():
            head = [line, *(file.readline() for _ in range(_LINES - 1))]
            if head[0] != b"ITEM: TIMESTEP\n":
                raise DumpError(f"{path}: not a local dump")
            try:
                step, count = int(head[1]), int(head[3])
            except ValueError as error:
                raise DumpError(f"{path}: no header of a frame, or a part of one") from error
            body = [file.readline() for _ in range(count)]
            if not head[-1].endswith(b"\n") or (body and not body[-1].endswith(b"\n")):
                raise DumpError(f"{path}: ends within the frame of step {step}")
            try:
                values = np.fromstring(b"".join(body), dtype=np.float64, sep=" ")
            except ValueError as error:
                raise DumpError(
                    f"{path}: not a number in the frame of step {step} ({error})"
                ) from error
            if len(values) != count * len(columns):
                raise DumpError(
                    f"{path}: expected {len(columns)} columns in the frame of step {step}"
                )
            if not np.isfinite(values).all():
                raise DumpError(f"{path}: a NaN or an infinity in the frame of step {step}")
            yield step, values.reshape(count, len(columns))


def write_local_dump(
    path: Path, columns: tuple[str, ...], frames: Iterable[tuple[int, FloatArray]]
) -> None:
    """Write a local dump as the engine does, with twelve digits; the bounds of the box are zero."""
    lines = []
    for step, rows in frames:
        lines += [
            "ITEM: TIMESTEP",
            str(step),
            "ITEM: NUMBER OF ENTRIES",
            str(len(rows)),
            "ITEM: BOX BOUNDS ff ff ff",
        ]
        lines += ["0 0"] * 3 + [f"ITEM: ENTRIES {' '.join(columns)}"]
        lines += [" ".join([f"{value:.12g}" for value in row]) + " " for row in rows.tolist()]
    path.write_text("\n".join(lines) + "\n", "ascii")
