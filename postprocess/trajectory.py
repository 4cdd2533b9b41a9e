"""The motion of a run's walkers relative to their substrate, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.case import WalkerCase
from walkers.inputs.dimer import dimer_of
from walkers.inputs.drive import Drive
from walkers.postprocess.dump import BinaryDump, DumpError, FloatArray
from walkers.runner.directory import CASE_NAME
from walkers.runner.files import read_json
from walkers.templates.deck import LAYOUT_NAME
from walkers.templates.layout import Layout


@dataclass(frozen=True)
class Trajectory:
    """Positions and velocities relative to the substrate; F frames, W walkers, 2 beads each.

    Attributes
    ----------
    case, layout
        Of the run.
    time : ndarray, shape (F,)
        s.
    position, velocity : ndarray, shape (F, W, 2, 3)
        Of the bead centres, m and m/s.
    spin : ndarray, shape (F, W, 2, 3)
        Angular velocity, rad/s.
    force : ndarray, shape (F, W, 2, 3)
        Total force as dumped by the engine, N.
    substrate, substrate_velocity : ndarray, shape (F, 3)
        Displacement and velocity of the substrate in the frame of the run, m and m/s.
    truncated : bool
        Whether the dump ends within a frame.
    """

    case: WalkerCase
    layout: Layout
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    force: FloatArray
    substrate: FloatArray
    substrate_velocity: FloatArray
    truncated: bool

    @property
    def radii(self) -> FloatArray:
        """Radii of the two beads, m, shape (2,)."""
        return np.array(self.case.beads.radii)

    @property
    def mass_centre(self) -> FloatArray:
        """Centres of mass, m, shape (F, W, 3)."""
        masses = np.array(dimer_of(self.case).masses)
        centre: FloatArray = np.einsum("fwbx,b->fwx", self.position, masses / masses.sum())
        return centre

    @property
    def drive_axis(self) -> FloatArray:
        """Direction from which orientations are measured, in the plane of the substrate: the drive's, or x."""
        return np.array(self.case.drive_axis)

    @property
    def across_axis(self) -> FloatArray:
        """Direction in the plane of the substrate, a quarter turn to the left of `drive_axis`."""
        across: FloatArray = np.cross([0.0, 0.0, 1.0], self.drive_axis)
        return across

    @property
    def heading(self) -> FloatArray:
        """Unit vectors in the plane of the substrate from the small bead to the large one, shape (F, W, 3).

        Of equal beads the first counts as the large one.
        """
        first, second = self.case.beads.radii
        arm = self.position[:, :, 0] - self.position[:, :, 1]
        arm = np.where(first >= second, arm, -arm)
        arm[..., 2] = 0.0
        heading: FloatArray = arm / np.linalg.norm(arm, axis=-1, keepdims=True)
        return heading

    @property
    def orientation(self) -> FloatArray:
        """ψ, rad, shape (F, W): angle of bead 2 → bead 1 from the direction that the walker was to face, unwrapped."""
        arm = self.position[:, :, 0] - self.position[:, :, 1]
        facing = np.array([walker.facing for walker in self.layout.walkers])
        angle = np.arctan2(facing * (arm @ self.across_axis), facing * (arm @ self.drive_axis))
        unwrapped: FloatArray = np.unwrap(angle, axis=0)
        return unwrapped


def read_trajectory(directory: str | Path) -> Trajectory:
    """Read the bead dump of a run directory.

    Parameters
    ----------
    directory
        A run directory (finished or not) with ``case.json``, ``layout.json`` and the dump.

    Raises
    ------
    postprocess.dump.DumpError
        If the dump cannot be read.
    FileNotFoundError
        If a file is not there.
    """
    directory = Path(directory)
    case = WalkerCase.from_dict(read_json(directory / CASE_NAME))
    layout = Layout.from_dict(read_json(directory / LAYOUT_NAME))
    dump = BinaryDump(directory / layout.bead_dump, layout.bead_columns)
    frames = dump.stack()
    if len(frames) < 2:
        raise DumpError(f"{dump.path}: {len(frames)} complete frames, too few for a motion")
    rows_of_beads = np.array([walker.beads for walker in layout.walkers]) - 1  # sorted by id, which begins at 1

    def vectors(prefix: str) -> FloatArray:
        start = dump.column(prefix + "x")
        return frames[:, :, start : start + 3]

    def of_beads(values: FloatArray) -> FloatArray:
        return values[:, rows_of_beads]

    position, velocity = vectors(""), vectors("v")
    time = dump.steps.astype(np.float64) * layout.time_step
    shift, speed = _substrate(case, layout, time, position, velocity)
    return Trajectory(
        case=case,
        layout=layout,
        time=time,
        position=of_beads(position) - shift[:, None, None],
        velocity=of_beads(velocity) - speed[:, None, None],
        spin=of_beads(vectors("omega")),
        force=of_beads(vectors("f")),
        substrate=shift,
        substrate_velocity=speed,
        truncated=dump.truncated,
    )


def _substrate(
    case: WalkerCase, layout: Layout, time: FloatArray, position: FloatArray, velocity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity of the substrate: those of its carrier, or the prescribed ones where it has none."""
    if layout.carrier:
        row = layout.carrier - 1
        return position[:, row] - position[:1, row], velocity[:, row]
    return prescribed_motion(case.drive, time)


def prescribed_motion(drive: Drive, time: npt.NDArray[np.floating[Any]]) -> tuple[FloatArray, FloatArray]:
    """Displacement and velocity of the walls in the frame of the run, m and m/s, each of shape (F, 3)."""
    displacement, velocity = np.zeros((len(time), 3)), np.zeros((len(time), 3))
    for one in drive.harmonics if drive.frame == "lab" else ():
        phase = one.angular_frequency * time + one.phase
        displacement += np.outer(one.amplitude * np.sin(phase), one.direction)
        velocity += np.outer(one.peak_velocity * np.cos(phase), one.direction)
    return displacement, velocity
