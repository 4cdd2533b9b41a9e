"""Predicted time of a run, from measurements on one core of a 2020s x86 server (docs/explanation/performance.md)."""

from __future__ import annotations

from math import ceil

from walkers.inputs.case import Case
from walkers.templates.deck import settling_steps

START_UP_SECONDS = 0.1
_STEP_MICROSECONDS = 2.2
_WALKER_MICROSECONDS = 0.54
"""2.7 µs a step for one walker, 5.5 for 6, 15 for 24, 53 for 96, in either frame."""
_BEAD_STEPS_PER_SECOND = 2.6e6
"""Of loose beads: 13,100 steps a second with 200 of them."""
_GAIN_PER_RANK = 0.9
_RESTING_SEGMENTS = 3
_TRIED_AGAIN = (1.0, 0.17, 0.08)
"""Share of the runs that end when their walkers are steady that are made a first, a second and a third time."""


def predicted_seconds(case: Case, walkers: int | None = None) -> float:
    """Wall time in s of a run, or of a deck, on as many cores as it has MPI processes.

    Parameters
    ----------
    case
        A case of the deck, for the number of its steps.
    walkers
        Beads' pairs in the deck, those of clusters by their beads; the case's own if left out.
    """
    run = case.run
    cycles = sum(share * cycles for share, cycles in zip(_TRIED_AGAIN, run.attempts, strict=False))
    segments = ceil(run.cycles / run.cycles_per_segment) + (_RESTING_SEGMENTS if run.rests else 0)
    steps = cycles * run.steps_per_cycle + (_RESTING_SEGMENTS * settling_steps(case) if run.rests else 0)
    count = pairs_of_beads(case) if walkers is None else walkers
    if case.loose:
        seconds_a_step = case.count / (_BEAD_STEPS_PER_SECOND * (1.0 + _GAIN_PER_RANK * (run.ranks - 1)))
    else:
        seconds_a_step = (_STEP_MICROSECONDS + _WALKER_MICROSECONDS * count) * 1e-6
    return START_UP_SECONDS * segments + steps * seconds_a_step


def pairs_of_beads(case: Case) -> int:
    """Half of the number of a case's beads: what costs as much as so many dimers."""
    return -(-case.count // 2)
