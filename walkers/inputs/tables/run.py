"""Length, time step and sampling of a run: the table ``[run]``.

Values that follow from the whole case are computed in `walkers.inputs.resolving.length`.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from walkers.inputs import units
from walkers.inputs.config_table import SAME_RUN, Choice, ConfigTable, Derived, Indirect, key
from walkers.inputs.units import AUTO, Duration, Number, Whole
from walkers.rounding import percent

FIRST_ATTEMPTS = (12, 24)
"""Numbers of cycles after which a run may end early, if its velocities are constant.

After 36 cycles, hardly any velocity is constant that was not after 24.
"""
CONSTANT = 0.002
"""Largest relative difference of the velocities in the two halves of the measured cycles if a
velocity is constant. If all are, a run ends early.

The criterion by which `walkers.postprocess.measure.gait.measure_walk` calls a walker steady is
looser.
"""
_Cycles = Annotated[Whole, Field(ge=2, le=1_000_000)]
_Samples = Annotated[Whole, Field(ge=1, le=1000)]


def settling_of(cycles: int) -> int:
    """Default number of settling cycles of walkers: a third of the cycles, at most 20."""
    return min(20, cycles // 3)


class RunTable(ConfigTable):
    """``[run]``: the time step, the length and the samples of the run.

    Beads are sampled ``samples_per_cycle`` times a cycle, or once in ``cycles_per_sample`` cycles
    (one of the two is 1). Bridges are sampled with one of ``samples_per_bridge_sample`` samples of
    the beads. If the run has several segments, each ends with a restart file.
    """

    choices: ClassVar = (
        Choice(("cycles",), ("duration",), ("most_cycles",), required=False),
        Choice(("samples_per_cycle",), ("frames_per_second",), required=False),
    )
    time_step: Annotated[units.Time | None, AUTO] = key(
        "Time step, or its upper limit: the program fits a whole number of samples into a cycle.",
        None,
    )
    allow_unstable: Annotated[units.Flag, SAME_RUN] = key(
        "Accept a time step beyond a stability limit.", False
    )
    cycles: Annotated[_Cycles | None, AUTO] = key(
        "Number of drive cycles. `auto`: until velocities are constant. "
        "See [](../cases.md#length-of-a-run).",
        None,
        60,
    )
    most_cycles: Indirect[_Cycles] = key(
        'Upper limit for `cycles = "auto"`. Default: 60.', None, 60
    )
    duration: Indirect[Duration] = key(
        "Duration of the drive, instead of `cycles`. Loose beads need it.", None
    )
    until: Annotated[Literal["climb"] | None, AUTO] = key(
        'Event that ends the run of a pile before its `duration`: `"climb"`, the first climb. '
        "The run ends with the segment in which the climb qualifies.",
        None,
        "climb",
    )
    settling_cycles: Whole | None = key(
        "Cycles at the start, which are not measured. Default: a third, at most 20.",
        None,
        20,
        ge=0,
        le=1_000_000,
    )
    samples_per_cycle: _Samples | None = key(
        "Samples of the beads per cycle. Default: 20.", None, 20
    )
    bridge_samples_per_cycle: Indirect[_Samples] = key(
        "Samples of the bridges per cycle, a divisor of `samples_per_cycle`. "
        "Default: 1; loose beads: all.",
        None,
        1,
    )
    frames_per_second: Indirect[Number] = key(
        "Samples per second, instead of per cycle. Default for loose beads: 60.",
        None,
        60,
        gt=0,
        le=1e6,
    )
    segment: Indirect[Duration] = key(
        "Length of a segment; a run can continue after a complete segment. "
        "Default for loose beads: 0.5 s.",
        None,
    )
    settled_below: units.Speed | None = key(
        "Root mean square velocity of a settled pile. Default for loose beads: 5 mm/s.", None
    )
    longest_settling: units.NonNegativeDuration | None = key(
        "Longest time for settling before the drive starts. Default for loose beads: 0.5 s.", None
    )
    ranks: Whole = key(
        "Number of MPI processes. Only large piles are faster with several.", 1, ge=1, le=64
    )
    seed: Whole = key(
        "Seed of the random perturbations and of poured beads.", 1, ge=0, le=2**63 - 1
    )


class RunSettings(RunTable):
    """The run of a resolved case.

    If its beads do not rest before the drive, ``settled_below`` and ``longest_settling`` are None.

    Attributes
    ----------
    steps_per_cycle : int
        Time steps in a cycle of the drive.
    until_steady : bool
        Whether the run ends early if velocities are constant; then ``cycles`` is an upper limit.
    cycles_per_sample : int
        Cycles between two samples of the beads; 1 if a cycle has several samples.
    samples_per_bridge_sample : int
        Samples of the beads for each sample of the bridges.
    cycles_per_segment : int
        Cycles in a segment of the run.

    Notes
    -----
    The other fields are keys of ``[run]``.
    """

    time_step: units.Time
    cycles: Whole
    settling_cycles: Whole
    samples_per_cycle: Whole
    steps_per_cycle: Derived[int]
    until_steady: Derived[bool]
    cycles_per_sample: Derived[int]
    samples_per_bridge_sample: Derived[int]
    cycles_per_segment: Derived[int]

    @property
    def period(self) -> float:
        """Period of a cycle, s."""
        return self.time_step * self.steps_per_cycle

    @property
    def steps(self) -> int:
        """Steps of the whole drive."""
        return self.steps_per_cycle * self.cycles

    @property
    def steps_per_sample(self) -> int:
        """Steps between samples."""
        return self.steps_per_cycle * self.cycles_per_sample // self.samples_per_cycle

    @property
    def settled_strobes(self) -> int:
        """Number of strobes before velocities are measured, rounded up.

        Strobes are samples at one phase of the drive: one per cycle, or one in
        ``cycles_per_sample`` cycles if samples are that rare.
        """
        return -(-self.settling_cycles // self.cycles_per_sample)

    @property
    def attempts(self) -> tuple[int, ...]:
        """Numbers of cycles of the attempts at the run, ascending.

        If velocities are not constant after one attempt, the next one starts again from the start.
        """
        if not self.until_steady:
            return (self.cycles,)
        shorter = [cycles for cycles in FIRST_ATTEMPTS if cycles < self.cycles]
        return (*shorter, self.cycles)

    @property
    def continuation(self) -> str:
        """How `walkers run` continues after the first attempt, as text; empty if it does not."""
        if len(self.attempts) == 1:
            return ""
        condition = f"the velocities are not constant within {percent(CONSTANT)}"
        most = self.cycles
        return f"walkers run continues to {most} if {condition}: then set cycles to {most}"

    def steps_of_attempts(self, cycles: int) -> int:
        """Number of steps of all attempts with at most a number of cycles."""
        return self.steps_per_cycle * sum(attempt for attempt in self.attempts if attempt <= cycles)

    @property
    def rests(self) -> bool:
        """Whether the beads rest before the drive."""
        return bool(self.longest_settling)

    @property
    def has_one_segment(self) -> bool:
        """Whether the run has a single segment."""
        return not self.rests and self.cycles_per_segment >= self.cycles
