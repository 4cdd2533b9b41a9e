"""Read and write the engine's text dumps of bridges (``dump local``)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from walkers.postprocess.dump import DumpError, FloatArray

_HEADER_LINES = 9


def local_frames(path: Path, columns: tuple[str, ...]) -> Iterator[tuple[int, FloatArray]]:
    """Step and rows of each frame of a local dump, one by one.

    Parameters
    ----------
    path
        The text file.
    columns
        Names of its columns.

    Yields
    ------
    step : int
    rows : ndarray, shape (rows, columns)

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
            head = [line, *(file.readline() for _ in range(_HEADER_LINES - 1))]
            if head[0] != b"ITEM: TIMESTEP\n":
                raise DumpError(f"{path}: not a local dump")
            try:
                step, count = int(head[1]), int(head[3])
            except ValueError as error:
                raise DumpError(f"{path}: no header of a frame, or a part of one") from error
            body = [file.readline() for _ in range(count)]
            if not head[-1].endswith(b"\n") or (body and not body[-1].endswith(b"\n")):
                raise DumpError(f"{path}: ends within the frame of step {step}")
            yield step, _rows(path, step, body, len(columns))


def write_local_dump(path: Path, columns: tuple[str, ...], frames: Iterable[tuple[int, FloatArray]]) -> None:
    """Write a local dump as the engine does, twelve digits, without the bounds of its box."""
    lines = []
    for step, rows in frames:
        lines += ["ITEM: TIMESTEP", str(step), "ITEM: NUMBER OF ENTRIES", str(len(rows)), "ITEM: BOX BOUNDS ff ff ff"]
        lines += ["0 0"] * 3 + [f"ITEM: ENTRIES {' '.join(columns)}"]
        lines += [" ".join([f"{value:.12g}" for value in row]) + " " for row in rows.tolist()]
    path.write_text("\n".join(lines) + "\n", "ascii")


def _rows(path: Path, step: int, body: list[bytes], columns: int) -> FloatArray:
    try:
        values = np.fromstring(b"".join(body), dtype=np.float64, sep=" ")
    except ValueError as error:
        raise DumpError(f"{path}: no number in the frame of step {step} ({error})") from error
    if len(values) != len(body) * columns:
        raise DumpError(f"{path}: expected {columns} columns in the frame of step {step}")
    if not np.isfinite(values).all():
        raise DumpError(f"{path}: a NaN or an infinity in the frame of step {step}")
    return values.reshape(len(body), columns)
