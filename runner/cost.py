"""Predicted time of a run, from measurements on one core of a 2020s x86 server.

2.9 µs a step for one walker, 5.6 for 6, 15 for 24, 55 for 96, 134 for 240 in the lab frame; start-up 0.33 s. The
container frame evaluates a variable every step, which costs 1.5 µs.
"""

from __future__ import annotations

from inputs.case import WalkerCase

_START_UP_SECONDS = 0.33
_STEP_MICROSECONDS = 2.3
_WALKER_MICROSECONDS = 0.55
_VARIABLE_MICROSECONDS = 1.5


def predicted_seconds(case: WalkerCase) -> float:
    """Wall time in s of a case's run on one core."""
    microseconds = _STEP_MICROSECONDS + _WALKER_MICROSECONDS * case.start.replicates
    if case.drive.frame == "container":
        microseconds += _VARIABLE_MICROSECONDS
    return _START_UP_SECONDS + case.run.steps * microseconds * 1e-6
