"""The part of a record that a run contains, and reasons to doubt what the record does.

It concerns records that do not repeat; they are run up to a whole number of cycles.
"""

from __future__ import annotations

from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.measure.numbers import Measurement

NAME = "record"
VERSION = 2


def applies(case: Case) -> bool:
    """Tell whether the drive of a case is a record that does not repeat."""
    return case.excitation.ends


def derived(case: Case) -> dict[str, float]:
    """The length of the record, s."""
    return {"record_length": case.excitation.length}


def measure(motion: Motion) -> Measurement:
    """Measure for how long the record was run.

    Parameters
    ----------
    motion
        Motion of a run whose drive is a record that does not repeat.

    Returns
    -------
    Measurement
        ``record_run`` (s), ``record_share``, and the reasons to doubt the record.
    """
    drive = motion.case.excitation
    seconds = max(float(motion.time[-1]), 0.0)
    numbers = {"record_run": seconds, "record_share": min(seconds / drive.length, 1.0)}
    warnings = tuple(drive.record.doubts) if drive.record else ()
    return Measurement(tables={}, numbers=numbers, warnings=warnings)
