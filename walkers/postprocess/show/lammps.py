"""Trajectories as LAMMPS text dumps, which OVITO, ASE, MDAnalysis and LAMMPS tools read.

Lengths are in mm, velocities in mm/s, angular velocities in rad/s. Positions and velocities are relative to the
boundary.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from walkers.errors import check_limits
from walkers.files import replacing
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.show.drawing import check_place

_COLUMNS = (
    "id",
    "type",
    "mol",
    "radius",
    "x",
    "y",
    "z",
    "vx",
    "vy",
    "vz",
    "omegax",
    "omegay",
    "omegaz",
)
_FORMAT = "%d %d %d" + " %.10g" * 10
_MM = 1e3
SUFFIX = ".lammpstrj"


def write_trajectory(
    directory: Path, destination: Path | None = None, *, every: int | None = None
) -> Path:
    """Write every ``every``-th sample of the drive to a file, if None ``trajectory.lammpstrj`` in the run directory.

    The box of all frames contains the beads and the inner width of a container. `InputError` for another suffix.
    """
    path = destination or directory / f"trajectory{SUFFIX}"
    check_place(path, SUFFIX)
    check_limits("every", every, 1)
    motion = read_motion(directory).driven.select(slice(None, None, every))
    radius, count = motion.radius[:, None], len(motion.radius)
    low, high = (
        (motion.position - radius).min(axis=(0, 1)),
        (motion.position + radius).max(axis=(0, 1)),
    )
    if motion.case.boundary.closed:
        half = motion.case.boundary.inner_width / 2.0
        low[:2], high[:2] = np.minimum(low[:2], -half), np.maximum(high[:2], half)
    low[2] = min(low[2], 0.0)
    bounds = "".join(
        f"{_MM * begin:.10g} {_MM * end:.10g}\n" for begin, end in zip(low, high, strict=True)
    )
    kinds = 1 + (motion.large.any() & ~motion.large)
    labels = np.column_stack(
        [np.arange(count) + 1, kinds, motion.walker_of + 1, _MM * motion.radius]
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as new, new.open("w", encoding="ascii") as file:
        for time, position, velocity, spin in zip(
            motion.time, motion.position, motion.velocity, motion.spin, strict=True
        ):
            step = round(float(time) / motion.case.run.time_step)
            file.write(
                f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS ff ff ff\n{bounds}"
            )
            file.write(f"ITEM: ATOMS {' '.join(_COLUMNS)}\n")
            np.savetxt(
                file, np.column_stack([labels, _MM * position, _MM * velocity, spin]), fmt=_FORMAT
            )
    return path
