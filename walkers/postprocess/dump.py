"""Read the engine's binary dumps (``dump custom … .bin``) as numpy arrays on a memory map.

A frame is int64 step, int64 rows, int32 triclinic, 6 int32 boundary, 6 float64 box, int32 columns, int32 processes,
then for each process int32 count and that many float64. Columns have no names: the layout beside the dump has them.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import WalkersError

FloatArray = npt.NDArray[np.float64]

_HEADER = struct.Struct("=qqi6i6dii")
_COUNT = struct.Struct("=i")


class DumpError(WalkersError):
    """A file that is no binary dump, or one of other columns than expected."""


class NoNumberError(DumpError):
    """A dump with a NaN or an infinity: the engine goes on with them and says nothing, and a disk can make them."""


@dataclass(frozen=True)
class _Frame:
    step: int
    rows: int
    columns: int
    blocks: tuple[tuple[int, int], ...]
    """Offset in bytes and number of values of each process's part."""
    end: int


class BinaryDump:
    """The frames of a binary dump.

    Parameters
    ----------
    path
        The ``.bin`` file.
    columns
        Names of its columns.

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
        self._bytes: npt.NDArray[np.uint8] = (
            np.memmap(path, dtype=np.uint8, mode="r") if size else np.empty(0, dtype=np.uint8)
        )
        self._starts = self._starts_of_alike(size)
        """Offsets of the complete frames, bytes."""
        self._alike = len(self._starts) > 0
        """Whether they are all of one process and as long as each other."""
        offset = int(self._starts[-1]) + self._stride if self._alike else 0
        starts = []
        while offset < size and (frame := self._read_header(offset, size)) is not None:
            starts.append(offset)
            offset = frame.end
            self._alike = False
        self._starts = np.concatenate([self._starts, np.array(starts, dtype=np.int64)])
        self.truncated = offset < size
        steps = self._bytes[self._starts[:, None] + np.arange(8)] if len(self._starts) else np.empty((0, 8), np.uint8)
        self.steps = np.ascontiguousarray(steps).view(np.int64)[:, 0]

    def __len__(self) -> int:
        return len(self._starts)

    def _starts_of_alike(self, size: int) -> npt.NDArray[np.int64]:
        """Offsets of the frames from the first one on that are as that; none if that has several parts."""
        first = self._read_header(0, size) if size else None
        if first is None or len(first.blocks) > 1:
            return np.empty(0, dtype=np.int64)
        self._stride = first.end
        heads = self._bytes[: size // first.end * first.end].reshape(-1, first.end)[:, 8 : first.blocks[0][0]]
        differs = np.flatnonzero((heads != heads[0]).any(axis=1))
        return np.arange(differs[0] if len(differs) else len(heads), dtype=np.int64) * first.end

    def _read_header(self, offset: int, size: int) -> _Frame | None:
        """The frame that begins at an offset; None if the file ends within it."""
        if offset + _HEADER.size > size:
            return None
        values = _HEADER.unpack(self._bytes[offset : offset + _HEADER.size].tobytes())
        step = values[0]
        rows, columns, processes = values[1], values[15], values[16]
        if columns != len(self.columns) or rows < 0 or not 1 <= processes < 1_000_000 or step < 0:
            raise DumpError(f"{self.path}: no dump of {len(self.columns)} columns (byte {offset})")
        offset += _HEADER.size
        blocks = []
        for _ in range(processes):
            if offset + _COUNT.size > size:
                return None
            (count,) = _COUNT.unpack(self._bytes[offset : offset + _COUNT.size].tobytes())
            offset += _COUNT.size
            if offset + 8 * count > size:
                return None
            blocks.append((offset, count))
            offset += 8 * count
        if sum(count for _, count in blocks) != rows * columns:
            raise DumpError(f"{self.path}: the parts of the frame of step {step} do not add up")
        return _Frame(step, rows, columns, tuple(blocks), offset)

    def _frame(self, number: int) -> _Frame:
        frame = self._read_header(int(self._starts[number]), len(self._bytes))
        assert frame is not None
        return frame

    def frame(self, number: int) -> FloatArray:
        """One frame, shape (rows, columns).

        Raises
        ------
        NoNumberError
            If it holds a NaN or an infinity.
        """
        frame = self._frame(number)
        parts = [self._bytes[start : start + 8 * count].view(np.float64) for start, count in frame.blocks]
        values = np.concatenate(parts).reshape(frame.rows, frame.columns)
        if not np.isfinite(values).all():
            column = self.columns[int(np.flatnonzero(~np.isfinite(values).all(axis=0))[0])]
            raise NoNumberError(f"{self.path}: {column} is no number at step {frame.step}")
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
        first = self._frame(0)
        whole = self._bytes[: len(self) * first.end].reshape(len(self), first.end)
        data = np.ascontiguousarray(whole[:, first.blocks[0][0] :]).view(np.float64)
        if not np.isfinite(data).all():
            self.frame(int(np.flatnonzero(~np.isfinite(data).all(axis=1))[0]))  # which says where
        return data.reshape(len(self), first.rows, first.columns)

    def write_like(self, data: FloatArray, path: Path) -> None:
        """Write a dump with the frames' heads of this one and other rows.

        Parameters
        ----------
        data : ndarray, shape (frames, rows, columns)
        path
            The file; the parts of several processes become one.
        """
        count = data.shape[1] * data.shape[2]
        heads = []
        for start in self._starts:
            head = list(_HEADER.unpack(self._bytes[start : start + _HEADER.size].tobytes()))
            head[1], head[-1] = data.shape[1], 1
            heads.append(np.frombuffer(_HEADER.pack(*head) + _COUNT.pack(count), dtype=np.uint8))
        body = np.ascontiguousarray(data).reshape(len(data), -1).view(np.uint8)
        with path.open("wb") as file:  # ndarray.tofile does not say why it could not write
            file.write(np.concatenate([np.stack(heads), body], axis=1).data)

    def column(self, name: str) -> int:
        """Number of a column."""
        return self.columns.index(name)
