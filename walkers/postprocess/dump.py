"""Read the engine's dumps: binary dumps of beads (``dump custom … .bin``) and text dumps of bridges.

A frame of beads is int64 step, int64 rows, int32 triclinic, 6 int32 boundary, 6 float64 box, int32 columns, int32
processes, then for each process int32 count and that many float64. The layout has the names of the columns.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.errors import WalkersError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

_HEADER = struct.Struct("=qqi6i6dii")
_COUNT = struct.Struct("=i")
_LINES = 9
"""Lines of the header of a frame of bridges."""


class DumpError(WalkersError):
    """A file that is not a binary dump, or has unexpected columns."""


class NoNumberError(DumpError):
    """A dump with NaN or infinity, from an unreported blow-up or a damaged disk."""


class _Frame(NamedTuple):
    """A frame: offset (bytes) and number of values of the part of each process, and the end of the frame."""

    step: int
    rows: int
    parts: list[tuple[int, int]]
    end: int


class BinaryDump:
    """Frames of a binary dump with named columns.

    Attributes
    ----------
    steps : ndarray of int64, shape (frames,)
        The engine's step of each complete frame.
    truncated : bool
        Whether the file ends within a frame; the incomplete frame is left out.

    Raises
    ------
    DumpError
        If the file is not such a dump.
    """

    def __init__(self, path: Path, columns: tuple[str, ...]) -> None:
        self.path = path
        self.columns = columns
        size = path.stat().st_size
        self._bytes: npt.NDArray[np.uint8] = np.memmap(path, np.uint8, "r") if size else np.empty(0, np.uint8)
        # Usually all frames are of one process and equally long, and one comparison finds them all.
        self._starts = self._starts_of_alike(size)
        self._alike = len(self._starts) > 0
        offset = int(self._starts[-1]) + self._stride if self._alike else 0
        starts = []
        while offset < size and (frame := self._read_header(offset, size)) is not None:
            starts.append(offset)
            offset = frame.end
            self._alike = False
        self._starts = np.concatenate([self._starts, np.array(starts, dtype=np.int64)])
        self.truncated = offset < size
        self.steps = self._bytes[self._starts[:, None] + np.arange(8)].view(np.int64)[:, 0]

    def __len__(self) -> int:
        return len(self._starts)

    def _starts_of_alike(self, size: int) -> npt.NDArray[np.int64]:
        """Offsets of the leading frames that are equal in form to the first; none if it has several parts."""
        first = self._read_header(0, size) if size else None
        if first is None or len(first.parts) > 1:
            return np.empty(0, dtype=np.int64)
        self._stride = first.end
        heads = self._bytes[: size // first.end * first.end].reshape(-1, first.end)[:, 8 : first.parts[0][0]]
        differs = np.flatnonzero((heads != heads[0]).any(axis=1))
        return np.arange(differs[0] if len(differs) else len(heads), dtype=np.int64) * first.end

    def _read_header(self, offset: int, size: int) -> _Frame | None:
        """The frame that begins at an offset; None if the file ends within it."""
        if offset + _HEADER.size > size:
            return None
        step, rows, *_, columns, processes = _HEADER.unpack(self._bytes[offset : offset + _HEADER.size].tobytes())
        if columns != len(self.columns) or rows < 0 or not 1 <= processes < 1_000_000 or step < 0:
            raise DumpError(f"{self.path}: no dump of {len(self.columns)} columns (byte {offset})")
        offset += _HEADER.size
        parts = []
        for _ in range(processes):
            if offset + _COUNT.size > size:
                return None
            (count,) = _COUNT.unpack(self._bytes[offset : offset + _COUNT.size].tobytes())
            offset += _COUNT.size
            if offset + 8 * count > size:
                return None
            parts.append((offset, count))
            offset += 8 * count
        if sum(count for _, count in parts) != rows * columns:
            raise DumpError(f"{self.path}: the parts of the frame of step {step} do not add up")
        return _Frame(step, rows, parts, offset)

    def frame(self, number: int) -> FloatArray:
        """One frame, shape (rows, columns).

        Raises
        ------
        NoNumberError
            If it holds a NaN or an infinity.
        """
        frame = self._read_header(int(self._starts[number]), len(self._bytes))
        assert frame is not None
        parts = [self._bytes[start : start + 8 * count].view(np.float64) for start, count in frame.parts]
        values = np.concatenate(parts).reshape(frame.rows, len(self.columns))
        if not np.isfinite(values).all():
            column = self.columns[int(np.flatnonzero(~np.isfinite(values).all(axis=0))[0])]
            raise NoNumberError(f"{self.path}: {column} is not a number at step {frame.step}")
        return values

    def stack(self) -> FloatArray:
        """All frames, shape (frames, rows, columns).

        Raises
        ------
        DumpError
            If the number of rows changes, or a number is none.
        """
        if not len(self):
            return np.empty((0, 0, len(self.columns)))
        if not self._alike:
            frames = [self.frame(number) for number in range(len(self))]
            if len({len(frame) for frame in frames}) > 1:
                raise DumpError(f"{self.path}: the number of beads changes")
            return np.stack(frames)
        whole = self._bytes[: len(self) * self._stride].reshape(len(self), self._stride)
        data = np.ascontiguousarray(whole[:, _HEADER.size + _COUNT.size :]).view(np.float64)
        if not np.isfinite(data).all():
            self.frame(int(np.flatnonzero(~np.isfinite(data).all(axis=1))[0]))  # raises the error
        return data.reshape(len(self), data.shape[1] // len(self.columns), len(self.columns))

    def write_like(self, data: FloatArray, path: Path) -> None:
        """Write a dump of one process: the headers of these frames with other data, shape (frames, rows, columns)."""
        count = data.shape[1] * data.shape[2]
        heads = []
        for start in self._starts:
            head = list(_HEADER.unpack(self._bytes[start : start + _HEADER.size].tobytes()))
            head[1], head[-1] = data.shape[1], 1
            heads.append(np.frombuffer(_HEADER.pack(*head) + _COUNT.pack(count), dtype=np.uint8))
        body = np.ascontiguousarray(data).reshape(len(data), -1).view(np.uint8)
        with path.open("wb") as file:  # errors of ndarray.tofile have no reason
            file.write(np.concatenate([np.stack(heads), body], axis=1).data)

    def column(self, name: str) -> int:
        """Index of a column."""
        return self.columns.index(name)


def local_frames(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, FloatArray]]:
    """Step and rows, shape (rows, columns), of each frame of a text dump of bridges (``dump local``), one by one.

    Raises
    ------
    DumpError
        If the file is not such a dump, ends within a frame, or holds a NaN or an infinity.
    """
    try:
        file = path.open("rb")
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
                raise DumpError(f"{path}: not a number in the frame of step {step} ({error})") from error
            if len(values) != count * len(columns):
                raise DumpError(f"{path}: expected {len(columns)} columns in the frame of step {step}")
            if not np.isfinite(values).all():
                raise DumpError(f"{path}: a NaN or an infinity in the frame of step {step}")
            yield step, values.reshape(count, len(columns))


def write_local_dump(path: Path, columns: tuple[str, ...], frames: Iterable[tuple[int, FloatArray]]) -> None:
    """Write a local dump as the engine does, with twelve digits; the bounds of the box are zero."""
    lines = []
    for step, rows in frames:
        lines += ["ITEM: TIMESTEP", str(step), "ITEM: NUMBER OF ENTRIES", str(len(rows)), "ITEM: BOX BOUNDS ff ff ff"]
        lines += ["0 0"] * 3 + [f"ITEM: ENTRIES {' '.join(columns)}"]
        lines += [" ".join([f"{value:.12g}" for value in row]) + " " for row in rows.tolist()]
    path.write_text("\n".join(lines) + "\n", "ascii")
