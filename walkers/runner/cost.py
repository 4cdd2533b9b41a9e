"""Predicted cost of runs: CPU time of the engine, of solving bridges and of measuring.

It is predicted from measurements of CPU time on one core of a 2020s x86 server
(docs/explanation/performance.md).
"""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, inf

from walkers.inputs.tables.case import Case
from walkers.templates.deck import RESTING_SEGMENTS, settling_steps

START_UP_SECONDS = 0.04
_STEP_MICROSECONDS = 0.9
_WALKER_MICROSECONDS = 0.22
"""Measured: 1.0 µs per step for one walker, 2.2 for 6, 6.2 for 24, 22 for 96, 2.6 for 9 in a tray."""
_BEAD_STEPS_PER_SECOND, _PILE_MICROSECONDS = 10.7e6, 1.5
"""For loose beads, and per step in addition; measured from settled piles on, bead-steps per second: 11.0 million with
200 beads and 10.2 with 1,630 on a quiet core, 5.7 million with 60 on a busy one."""
_NEAR_FACET_MICROSECONDS = 0.1
"""For each bead and each facet of a vessel near it, per step: measured 0.08 to 0.14 with 4 to 60 facets near a bead."""
_FACET_MICROSECONDS = 4e-4
"""For each bead and each facet anywhere, per step, as the lists of those that are near are made anew now and then:
measured 0.3 to 0.6 ns with 2,700 and 10,000 facets."""
_FACET_START_UP_SECONDS = 4e-5  # for each facet in each segment: measured 0.4 s with 10,000 facets
_SOLVING_SECONDS = 0.25  # for each shape of bridge without a cached solution: measured 0.2 to 0.3
_MEASURING_SECONDS, _FRAME_MICROSECONDS = 0.037, 30.0
"""For the tables and the result of a run, and in addition for each bead of walkers in each frame."""
PROGRAM_SECONDS = 1.5
"""For the imports of a program that runs cases."""
_GAIN_PER_RANK = 0.9
_TRIED_AGAIN = (1.0, 0.1, 0.1)
"""Of the runs that may end when their velocities are constant: shares with a first, second and third attempt."""


def predicted_seconds(case: Case, walkers: int | None = None) -> float:
    """Time in s that the engine takes for a run, or a deck, on as many cores as it has MPI processes.

    Any ``case`` of a deck has its number of steps. ``walkers`` is the number of pairs of beads in the deck
    (`pairs_of_beads`), by default that of the case.
    """
    run = case.run
    cycles = sum(share * cycles for share, cycles in zip(_TRIED_AGAIN, run.attempts, strict=False))
    segments = ceil(run.cycles / run.cycles_per_segment) + (RESTING_SEGMENTS if run.rests else 0)
    steps = cycles * run.steps_per_cycle + (
        RESTING_SEGMENTS * settling_steps(case) if run.rests else 0
    )
    count = pairs_of_beads(case) if walkers is None else walkers
    if case.loose:
        seconds_a_step = _PILE_MICROSECONDS * 1e-6
        seconds_a_step += case.count / (
            _BEAD_STEPS_PER_SECOND * (1.0 + _GAIN_PER_RANK * (run.ranks - 1))
        )
    else:
        seconds_a_step = (_STEP_MICROSECONDS + _WALKER_MICROSECONDS * count) * 1e-6
    start_up = START_UP_SECONDS
    if case.boundary.triangles:
        beads = case.count if walkers is None else 2 * walkers
        seconds_a_step += (
            beads * _seconds_at_facets(case) / (1.0 + _GAIN_PER_RANK * (run.ranks - 1))
        )
        start_up += _FACET_START_UP_SECONDS * len(case.boundary.walls)
    return start_up * segments + steps * seconds_a_step


def _seconds_at_facets(case: Case) -> float:
    """Time in s that a bead takes in each step at the facets of a vessel, as if it touched the vessel."""
    near = case.boundary.vessel.facets_near_bead(min(case.radii))
    microseconds = _NEAR_FACET_MICROSECONDS * near + _FACET_MICROSECONDS * len(case.boundary.walls)
    return microseconds * 1e-6


def predicted_overhead(cases: Iterable[Case]) -> float:
    """CPU time in s in addition to the engine: solving bridges and measuring motions."""
    from walkers.physics.bridge import Surfaces
    from walkers.physics.laws.young_laplace import unsolved

    cases = list(cases)
    kinds = {
        (case.liquid.of_bridges, case.contact.roughness, tuple(sorted(set(case.radii))))
        for case in cases
    }
    bridges = [
        bridge
        for liquid, roughness, radii in kinds
        if liquid.law.startswith("young-laplace")
        for place, radius in enumerate(radii)
        for second in (inf, *radii[place:])
        for bridge in Surfaces.between(radius, second, liquid, roughness).volumes
    ]
    places = sum(
        case.count * case.run.attempts[0] / case.run.cycles_per_sample * case.run.samples_per_cycle
        for case in cases
        if case.walkers
    )
    measuring = _MEASURING_SECONDS * len(cases) + _FRAME_MICROSECONDS * 1e-6 * places
    return _SOLVING_SECONDS * unsolved(bridges) + measuring


def pairs_of_beads(case: Case) -> int:
    """Half of the number of beads of a case: the number of dimers with the same cost."""
    return -(-case.count // 2)
