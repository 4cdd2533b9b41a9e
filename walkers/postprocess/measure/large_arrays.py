"""Arrays that may be larger than the memory.

A pile of 100,000 beads has 4 GB of vectors in 600 frames. Such arrays are in a file without a name
on the disk of the run: the system keeps in memory what is in use and there is memory for, and the
file is gone with the process, however it ends.
"""

from __future__ import annotations

import os
import tempfile
from math import prod
from pathlib import Path

import numpy as np

from walkers.arrays import FloatArray
from walkers.postprocess.measure.dump import DumpError

LARGEST_IN_MEMORY = 1 << 28
"""Size, bytes, above which an array is in a file."""


def empty_array(shape: tuple[int, ...], directory: Path) -> FloatArray:
    """Make an array of floating-point numbers that is yet to be filled.

    Parameters
    ----------
    shape
        Its shape.
    directory
        A folder on the disk where a large array is; if it cannot be written, it is in the folder
        for temporary files.

    Returns
    -------
    ndarray
        The array, of any numbers. One above `LARGEST_IN_MEMORY` is in a file.

    Raises
    ------
    DumpError
        If the disk has no space for it.
    """
    size = np.dtype(np.float64).itemsize * prod(shape)
    if size <= LARGEST_IN_MEMORY:
        return np.empty(shape)
    if not os.access(directory, os.W_OK):  # of a read-only archive
        directory = Path(tempfile.gettempdir())
    with tempfile.TemporaryFile(dir=directory) as file:
        try:
            # Space is taken now: a full disk found later, while the array is filled, would end the
            # process by a signal.
            os.posix_fallocate(file.fileno(), 0, size)
        except OSError as error:
            raise DumpError(
                f"{directory}: the motion of all beads needs {size / 1e9:.3g} GB on its disk for "
                f"as long as it is measured or drawn ({error.strerror})"
            ) from error
        return np.memmap(file, np.float64, "r+", shape=shape).view(np.ndarray)
