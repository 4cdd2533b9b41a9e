"""The drive of a case with all values: axes, and peak accelerations from the Γ0 of a dimer.

What the keys of ``[drive]`` mean, and the oscillations themselves, are in
`walkers.inputs.tables.drive`.
"""

from __future__ import annotations

from math import dist
from typing import Any

from walkers.errors import key_error
from walkers.inputs.config_table import present
from walkers.inputs.resolving.notes import Notes
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.drive import (
    Drive,
    DriveTable,
    Harmonic,
    HarmonicTable,
    check_drive,
    common_frequency,
)
from walkers.inputs.units import ACCELERATION, quantity_text
from walkers.physics.dimer import Dimer

_LARGEST_MISMATCH = 0.01
"""Largest difference of the ends of a record that repeats, over its peak acceleration."""


def drive_of(table: DriveTable, boundary: Boundary, dimer: Dimer | None, notes: Notes) -> Drive:
    """Complete a drive by the axes and the peak accelerations of its harmonics.

    Parameters
    ----------
    table
        The drive as the file says it.
    boundary
        The boundary; by default, containers are shaken along z, substrates along x.
    dimer
        The first walkers, to which Γ0 refers (`walkers.physics.dimer`); None if they are no dimers.
    notes
        Get the sources of the axes and the peak accelerations.

    Returns
    -------
    Drive
        The drive with all values in SI units.

    Raises
    ------
    InputError
        If the keys contradict each other, or the drive is too strong, too fast, or too short.
    """
    if table.record:
        return _recorded_drive(table, notes)
    if table.repeats:
        raise key_error("drive.repeats", "expected none without drive.record")
    if table.harmonics:
        harmonics: list[Harmonic] = []
        for number, harmonic in enumerate(table.harmonics):
            values = _axis_and_peak(harmonic, f"drive.harmonics[{number}]", boundary, dimer, notes)
            harmonics.append(harmonic.completed(Harmonic, values))
        drive = table.completed(Drive, {"harmonics": tuple(harmonics)})
    else:
        drive = table.completed(Drive, _axis_and_peak(table, "drive", boundary, dimer, notes))
    _check_harmonics(drive)
    check_drive(drive.excitation)
    return drive


def _axis_and_peak(
    sine: DriveTable | HarmonicTable,
    key: str,
    boundary: Boundary,
    dimer: Dimer | None,
    notes: Notes,
) -> dict[str, Any]:
    """Values of ``axis`` and ``peak_acceleration`` (m/s²) of an oscillation.

    Parameters
    ----------
    sine
        Its table.
    key
        Dotted key of the table.
    boundary, dimer, notes
        As for `drive_of`.
    """
    axis = sine.axis
    if axis is None:
        axis = "z" if boundary.closed else "x"
        notes.add(f"{key}.axis", f"of a {boundary.shape}", "default")
    peak = sine.peak_acceleration
    if sine.gamma0 is not None:
        if dimer is None:
            raise key_error(f"{key}.gamma0", "expected peak_acceleration: only a dimer has a Γ0")
        peak = dimer.peak_acceleration(sine.gamma0)
        notes.add(f"{key}.peak_acceleration", "from gamma0, the dimer and the liquid")
    return {"axis": axis, "peak_acceleration": peak}


def _check_harmonics(drive: Drive) -> None:
    """Refuse harmonics without a common period, and those that walls cannot follow."""
    excitation = drive.excitation
    try:
        common_frequency([harmonic.frequency for harmonic in excitation.harmonics])
    except ValueError as error:
        message = f"expected frequencies with a common period: {error}"
        raise key_error("drive.harmonics", message) from error
    if drive.frame == "lab" and not excitation.is_plain:
        message = "several harmonics, or one with a phase, are driven in the container's frame"
        raise key_error("drive.frame", f'expected "container": {message}')


def _recorded_drive(table: DriveTable, notes: Notes) -> Drive:
    """The drive of a record, with notes of its frequency and peak acceleration."""
    drive = table.completed(Drive, {})
    excitation = drive.excitation
    record = present(excitation.record, "drive.record")
    mismatch = dist(record.rows[0][1:], record.rows[-1][1:])
    if record.repeats and mismatch > _LARGEST_MISMATCH * record.largest(2):
        message = "expected a record that ends with the first row of the next period"
        raise key_error("drive.repeats", message)
    check_drive(excitation)
    why = "all lines are multiples" if record.repeats else "the strongest line"
    frequency = f"{excitation.frequency:.6g} Hz"
    peak = quantity_text(excitation.peak_acceleration, ACCELERATION)
    notes.add("drive.frequency", f"of the spectrum of the record: {why}", text=frequency)
    notes.add("drive.peak_acceleration", "of the record, without its offset", text=peak)
    return drive
