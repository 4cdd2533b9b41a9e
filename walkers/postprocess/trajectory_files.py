"""Trajectories for other programs: extended XYZ (OVITO, ASE) and LAMMPS text dumps (OVITO, MDAnalysis, LAMMPS tools).

Lengths are in mm, velocities in mm/s, angular velocities in rad/s, times in s. The XYZ writer has eight decimals, so
lengths in m would be rounded to 10 nm. Positions and velocities are relative to the boundary.
"""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np

from walkers.extras import require
from walkers.postprocess.drawing import check_every, check_place
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion, read_motion
from walkers.runner.files import beside

_COLUMNS = ("id", "type", "mol", "radius", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz")
_FORMAT = "%d %d %d" + " %.10g" * 10
_MM = 1e3
SUFFIXES = {"xyz": (".xyz", ".extxyz"), "lammps": (".lammpstrj",)}
"""Suffixes of files by form."""


def write_trajectory(directory: Path, destination: Path, form: str, *, every: int = 1) -> Path:
    """Write the motion of the beads during the drive, every ``every``-th sample.

    Parameters
    ----------
    destination
        The file to write, with one of the `SUFFIXES`.
    form
        ``xyz`` for extended XYZ, ``lammps`` for a LAMMPS text dump.

    Raises
    ------
    InputError
        If the file has another suffix, or ``every`` is less than 1.
    """
    check_place(destination, *SUFFIXES[form])
    check_every(every)
    write = {"xyz": _write_xyz, "lammps": _write_lammps}[form]
    if form == "xyz":
        require("xyz")
    motion = read_motion(directory).driven.select(slice(None, None, every))
    destination.parent.mkdir(parents=True, exist_ok=True)
    box = box_of(motion)
    with beside(destination) as new, new.open("w", encoding="ascii") as file:
        for frame in range(len(motion.time)):
            write(file, motion, frame, box)
    return destination


def box_of(motion: Motion) -> FloatArray:
    """Corners of the box of all frames, mm, shape (2, 3): it contains all beads, and the inner width of a container."""
    radius = motion.radius[:, None]
    low, high = (motion.position - radius).min(axis=(0, 1)), (motion.position + radius).max(axis=(0, 1))
    if motion.case.boundary.closed:
        half = motion.case.boundary.width / 2.0
        low[:2], high[:2] = np.minimum(low[:2], -half), np.maximum(high[:2], half)
    low[2] = min(low[2], 0.0)
    return _MM * np.array([low, high])


def _write_xyz(file: TextIO, motion: Motion, frame: int, box: FloatArray) -> None:
    from ase import Atoms
    from ase.io.extxyz import write_extxyz

    beads = Atoms(["X"] * len(motion.radius), positions=_MM * motion.position[frame], cell=box[1] - box[0], pbc=False)
    beads.arrays |= {
        "id": np.arange(len(motion.radius)) + 1,
        "radius": _MM * motion.radius,
        "velo": _MM * motion.velocity[frame],
        "omega": motion.spin[frame],
        "walker": motion.walker_of,
        "large": motion.large.astype(np.int64),
    }
    beads.info = {"Origin": box[0], "Time": float(motion.time[frame]), "units": "mm, s, rad"}
    write_extxyz(file, [beads])


def _write_lammps(file: TextIO, motion: Motion, frame: int, box: FloatArray) -> None:
    count, step = len(motion.radius), round(float(motion.time[frame]) / motion.case.run.time_step)
    bounds = "".join(f"{low:.10g} {high:.10g}\n" for low, high in box.T)
    file.write(f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS ff ff ff\n{bounds}")
    file.write(f"ITEM: ATOMS {' '.join(_COLUMNS)}\n")
    kinds = 1 + (motion.large.any() & ~motion.large)
    lengths = _MM * np.column_stack([motion.radius, motion.position[frame], motion.velocity[frame]])
    rows = np.column_stack([np.arange(count) + 1, kinds, motion.walker_of + 1, lengths, motion.spin[frame]])
    np.savetxt(file, rows, fmt=_FORMAT)
