"""Predicted time of a run, from measurements on one core of a 2020s x86 server.

2.7 µs a step for one walker, 5.5 for 6, 15 for 24, 53 for 96, in either frame; start-up 0.33 s (docs/performance.md).
"""

from __future__ import annotations

from walkers.inputs.case import WalkerCase

START_UP_SECONDS = 0.33
_STEP_MICROSECONDS = 2.2
_WALKER_MICROSECONDS = 0.54


def predicted_seconds(case: WalkerCase, walkers: int | None = None) -> float:
    """Wall time in s of a deck on one core.

    Parameters
    ----------
    case
        A case of the deck, for the number of its steps.
    walkers
        In the deck; the case's own replicates if left out.
    """
    count = case.start.replicates if walkers is None else walkers
    return START_UP_SECONDS + case.run.steps * (_STEP_MICROSECONDS + _WALKER_MICROSECONDS * count) * 1e-6
