"""Predicted cost of runs: CPU time of the engine, of solving bridges and of measuring.

It is predicted from measurements of CPU time on one core of a 2020s x86 server
(docs/explanation/performance.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import ceil, inf
from typing import TYPE_CHECKING

from walkers.inputs.tables.case import Case
from walkers.templates.deck import RESTING_SEGMENTS, settling_steps

if TYPE_CHECKING:
    from walkers.physics.bridge import Surfaces

START_UP_SECONDS = 0.04
"""CPU time of each start of the engine, that is of each segment, s."""
PROGRAM_SECONDS = 1.5
"""CPU time of the imports of a program that runs cases, s."""
_STEP_MICROSECONDS = 0.9
"""CPU time of each step of a deck of walkers, µs."""
_WALKER_MICROSECONDS = 0.22
"""CPU time of each pair of beads of walkers in each step, in addition, µs.

Measured in total: 1.0 µs per step for one walker, 2.2 for 6, 6.2 for 24, 22 for 96, 2.6 for 9 in a
tray.
"""
_PILE_MICROSECONDS = 1.5
"""CPU time of each step of a deck of loose beads, µs."""
_BEAD_STEPS_PER_SECOND = 10.7e6
"""Loose beads times steps in each second of CPU time, in addition, 1/s.

Measured from settled piles on: 11.0 million with 200 beads and 10.2 with 1,630 on a quiet core, 5.7
million with 60 on a busy one.
"""
_GAIN_PER_RANK = 0.9
"""Speed that each MPI process adds to that of the first one."""
_NEAR_FACET_MICROSECONDS = 0.1
"""CPU time of each bead and each facet of a vessel near it in each step, µs.

Measured: 0.08 to 0.14 with 4 to 60 facets near a bead.
"""
_FACET_MICROSECONDS = 4e-4
"""CPU time of each bead and each facet anywhere in each step, µs.

Now and then, the engine lists the facets near each bead.

Measured: 0.3 to 0.6 ns with 2,700 and 10,000 facets.
"""
_FACET_START_UP_SECONDS = 4e-5
"""CPU time of each facet in each segment, s; measured: 0.4 s with 10,000 facets."""
_SOLVING_SECONDS = 0.25
"""CPU time of each shape of bridge without a cached solution, s; measured: 0.2 to 0.3 s."""
_MEASURING_SECONDS = 0.037
"""CPU time of the tables and the result of a run, s."""
_FRAME_MICROSECONDS = 30.0
"""CPU time of each bead of walkers in each frame, when a run is measured, µs."""
_SHARES_OF_ATTEMPTS = (1.0, 0.1, 0.1)
"""Shares of runs that need a first, second and third attempt, with more cycles each time.

Only runs that end when their velocities are constant have several attempts.
"""


def predicted_seconds(case: Case, walkers: int | None = None) -> float:
    """Time that the engine takes for a deck, on as many cores as it has MPI processes.

    Parameters
    ----------
    case
        The case, or any case of a shared deck: all have the same number of steps.
    walkers
        Number of pairs of beads in the deck (`pairs_of_beads`); None: that of the case.

    Returns
    -------
    float
        Wall time, s.
    """
    run = case.run
    segments = ceil(run.cycles / run.cycles_per_segment)
    steps = _expected_cycles(run.attempts) * run.steps_per_cycle
    if run.rests:
        segments += RESTING_SEGMENTS
        steps += RESTING_SEGMENTS * settling_steps(case)
    start_up = START_UP_SECONDS
    if case.boundary.triangles:
        start_up += _FACET_START_UP_SECONDS * len(case.boundary.walls)
    return start_up * segments + steps * predicted_seconds_of_step(case, walkers)


def predicted_seconds_of_step(case: Case, walkers: int | None = None) -> float:
    """Time that the engine takes for a step of a deck; see `predicted_seconds`.

    Returns
    -------
    float
        Wall time, s.
    """
    speed_up = 1.0 + _GAIN_PER_RANK * (case.run.ranks - 1)
    if case.loose:  # beads outside of walkers, such as a pile
        seconds = _PILE_MICROSECONDS * 1e-6
        seconds += case.count / (_BEAD_STEPS_PER_SECOND * speed_up)
    else:
        pairs = pairs_of_beads(case) if walkers is None else walkers
        seconds = (_STEP_MICROSECONDS + _WALKER_MICROSECONDS * pairs) * 1e-6
    if case.boundary.triangles:
        beads = case.count if walkers is None else 2 * walkers
        seconds += beads * _seconds_at_facets(case) / speed_up
    return seconds


def _expected_cycles(attempts: Sequence[int]) -> float:
    """The mean number of cycles of all attempts of a run."""
    cycles = 0.0
    for share, attempt in zip(_SHARES_OF_ATTEMPTS, attempts, strict=False):
        cycles += share * attempt
    return cycles


def _seconds_at_facets(case: Case) -> float:
    """Time that a bead takes in each step at the facets of a vessel, as if it touched it, s."""
    near = case.boundary.vessel.facets_near_bead(min(case.radii))
    microseconds = _NEAR_FACET_MICROSECONDS * near + _FACET_MICROSECONDS * len(case.boundary.walls)
    return microseconds * 1e-6


def predicted_overhead(cases: Iterable[Case]) -> float:
    """CPU time of cases in addition to the engine: solving bridges and measuring motions, s."""
    from walkers.physics.laws.young_laplace import unsolved

    cases = list(cases)
    frames_of_beads = 0.0
    for case in cases:
        if case.walkers:
            beads_in_cycles = case.count * case.run.attempts[0]
            samples_per_cycle = case.run.samples_per_cycle
            frames_of_beads += beads_in_cycles / case.run.cycles_per_sample * samples_per_cycle
    measuring = _MEASURING_SECONDS * len(cases) + _FRAME_MICROSECONDS * 1e-6 * frames_of_beads
    return _SOLVING_SECONDS * unsolved(_young_laplace_bridges(cases)) + measuring


def _young_laplace_bridges(cases: Iterable[Case]) -> list[Surfaces]:
    """The bridges of cases whose shape is solved numerically, each only once."""
    from walkers.physics.bridge import Surfaces

    kinds = set()
    for case in cases:
        liquid = case.liquid.of_bridges
        if liquid.law.startswith("young-laplace"):
            kinds.add((liquid, case.contact.roughness, tuple(sorted(set(case.radii)))))
    bridges = []
    for liquid, roughness, radii in kinds:
        for number, radius in enumerate(radii):
            for other_radius in (inf, *radii[number:]):
                bridges += Surfaces.between(radius, other_radius, liquid, roughness).volumes
    return bridges


def pairs_of_beads(case: Case) -> int:
    """Half the number of beads of a case, rounded up: the number of dimers with the same cost."""
    return ceil(case.count / 2)
