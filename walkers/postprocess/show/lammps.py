"""Trajectories as LAMMPS text dumps, which OVITO, ASE, MDAnalysis and LAMMPS tools read.

Lengths are in mm, velocities in mm/s, angular velocities in rad/s. Positions and velocities are
relative to the boundary.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import check_limits
from walkers.files import replacing
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.show.drawing import check_place

SUFFIX = ".lammpstrj"
"""Suffix of the files."""
_COLUMNS = "id type mol radius x y z vx vy vz omegax omegay omegaz"
"""Columns of a dump, as LAMMPS names them."""
_FORMAT = "%d %d %d" + " %.10g" * 10
"""Format of a row: three integers, and ten numbers."""
_MM = 1e3
"""Millimetres per metre."""


def write_trajectory(
    directory: Path, destination: Path | None = None, *, every: int | None = None
) -> Path:
    """Write the beads of a run as a LAMMPS text dump.

    The box of all frames contains the beads and the inner width of a container.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The file; None: ``trajectory.lammpstrj`` in the run directory.
    every
        Write every ``every``-th sample of the drive; None: all samples.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the file has another suffix, or ``every`` is less than 1.
    """
    path = destination or directory / f"trajectory{SUFFIX}"
    check_place(path, SUFFIX)
    check_limits("every", every, 1, whole=True)
    motion = read_motion(directory).driven.select(slice(None, None, every))
    count = len(motion.radius)
    low, high = _box(motion)
    bounds = ""
    for first, last in zip(low, high, strict=True):
        bounds += f"{_MM * first:.10g} {_MM * last:.10g}\n"
    # Type 1 is the large class; if all beads are of one class, they are of type 1.
    types = 1 + (motion.large.any() & ~motion.large)
    ids = np.arange(count) + 1
    labels = np.column_stack([ids, types, motion.walker_of + 1, _MM * motion.radius])
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as new, new.open("w", encoding="ascii") as file:
        for frame, time in enumerate(motion.time):
            step = round(float(time) / motion.case.run.time_step)
            file.write(f"ITEM: TIMESTEP\n{step}\n")
            file.write(f"ITEM: NUMBER OF ATOMS\n{count}\n")
            file.write(f"ITEM: BOX BOUNDS ff ff ff\n{bounds}")
            file.write(f"ITEM: ATOMS {_COLUMNS}\n")
            position = _MM * motion.position[frame]
            velocity = _MM * motion.velocity[frame]
            rows = np.column_stack([labels, position, velocity, motion.spin[frame]])
            np.savetxt(file, rows, fmt=_FORMAT)
    return path


def _box(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest corner of the box of all frames, m, shape (3,) each.

    It contains the beads, the height 0 of the floor, and the width of a container, which is centred
    at x = y = 0.
    """
    radius = motion.radius[:, None]
    low = (motion.position - radius).min(axis=(0, 1))
    high = (motion.position + radius).max(axis=(0, 1))
    if motion.case.boundary.closed:
        half = motion.case.boundary.inner_width / 2.0
        low[:2] = np.minimum(low[:2], -half)
        high[:2] = np.maximum(high[:2], half)
    low[2] = min(low[2], 0.0)
    return low, high
