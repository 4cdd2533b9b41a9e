"""The part of a record that a run contains, and reasons to doubt what the record does.

A record that does not repeat is run up to a whole number of cycles.
"""

from __future__ import annotations

from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.measure.numbers import Measurement

NAME = "record"
VERSION = 2


def applies(case: Case) -> bool:
    """Whether the drive of a case is a record that does not repeat."""
    return case.excitation.ends


def derived(case: Case) -> dict[str, float]:
    """The length of the record, s."""
    return {"record_length": case.excitation.length}


def measure(motion: Motion) -> Measurement:
    """The time for which the record was run, its share, and the doubts of the record."""
    drive = motion.case.excitation
    run = max(float(motion.time[-1]), 0.0)
    doubts = tuple(drive.record.doubts) if drive.record else ()
    return Measurement(
        {}, {"record_run": run, "record_share": min(run / drive.length, 1.0)}, doubts
    )
