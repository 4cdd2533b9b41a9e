"""Read the engine's text dumps of bridges (``dump local``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from postprocess.dump import DumpError, FloatArray


def read_local_dump(path: Path, columns: tuple[str, ...]) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Read all rows of a local dump.

    Parameters
    ----------
    path
        The text file.
    columns
        Names of its columns.

    Returns
    -------
    steps : ndarray of int64, shape (rows,)
        Step of each row's frame.
    rows : ndarray, shape (rows, columns)
        An incomplete last frame gives the rows that are complete.

    Raises
    ------
    DumpError
        If the file is not such a dump.
    """
    lines = path.read_text("ascii", errors="replace").split("\n")
    steps: list[int] = []
    rows: list[list[float]] = []
    position = 0
    while position + 9 <= len(lines) and lines[position].startswith("ITEM: TIMESTEP"):
        try:
            step, count = int(lines[position + 1]), int(lines[position + 3])
        except ValueError as error:
            raise DumpError(f"{path}: no header at line {position + 1}") from error
        body = lines[position + 9 : position + 9 + count]
        values = [[float(word) for word in line.split()] for line in body]
        complete = [row for row in values if len(row) == len(columns)]
        rows += complete
        steps += [step] * len(complete)
        position += 9 + count
    if position == 0 and any(line.strip() for line in lines):
        raise DumpError(f"{path}: not a local dump")
    return np.array(steps, dtype=np.int64), np.array(rows, dtype=np.float64).reshape(len(rows), len(columns))
