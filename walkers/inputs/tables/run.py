"""Length, time step and sampling of a run: the table ``[run]``, and the values that follow from the whole case."""

from __future__ import annotations

from math import ceil, floor, inf
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from walkers.errors import unusable
from walkers.inputs import units
from walkers.inputs.config_table import SAME_RUN, Choice, Derived, Filled, Indirect, Table, key
from walkers.inputs.origins import Source
from walkers.inputs.units import AUTO, Duration, Number, Whole
from walkers.physics.time_step import TimeStepLimits, fit_into_cycle, time_step_limits
from walkers.rounding import percent

if TYPE_CHECKING:
    from walkers.inputs.tables.case import Case

MOST_STEPS = 2**31 - 1
FIRST_ATTEMPTS = (12, 24)
"""Cycles after which velocities are checked. After 36 hardly any are constant that were not after 24."""
CONSTANT = 0.002
"""Share within which the velocities of the halves of a walker's cycles agree where a run ends early: they are constant.

`walkers.postprocess.measure.gait.walk` calls a walker steady by a looser criterion.
"""
_SEGMENT_SECONDS = 0.5
_MOST_CYCLES = 60
_SAMPLES = 20
_NEARLY_SYMMETRIC = 0.08  # sin δ of dimers below which speeds of steady walkers still creep …
_ASLANT = 0.1  # … and start angle (rad) from which walkers turn for longer than a few cycles: both run in full
_LONGEST_SETTLING = 0.5
_SETTLED_BELOW = 5e-3
_FRAMES_PER_SECOND = 60.0
_Cycles = Annotated[Whole, Field(ge=2, le=1_000_000)]
_Samples = Annotated[Whole, Field(ge=1, le=1000)]


def settling_of(cycles: int) -> int:
    """Default number of settling cycles of walkers: a third of the cycles, at most 20."""
    return min(20, cycles // 3)


class Run(Table):
    """``[run]``: the time step, the length and the samples of the run.

    Beads are recorded ``samples_per_cycle`` times a cycle, or once in ``cycles_per_sample`` (one of the two is 1),
    bridges with one of ``samples_per_bridge_sample`` samples. Several segments have a restart file at the end of each.
    """

    choices: ClassVar = (
        Choice("cycles or duration or most_cycles", required=False),
        Choice("samples_per_cycle or frames_per_second", required=False),
    )
    time_step: Annotated[Filled[units.Time], AUTO] = key(
        "Time step, or its upper limit: the program fits a whole number of samples into a cycle.", None
    )
    allow_unstable: Annotated[units.Flag, SAME_RUN] = key("Accept a time step beyond a stability limit.", False)
    cycles: Annotated[Filled[_Cycles], AUTO] = key(
        "Number of drive cycles. `auto`: until velocities are constant. See [](../cases.md#length-of-a-run).", None, 60
    )
    most_cycles: Indirect[_Cycles] = key('Upper limit for `cycles = "auto"`. Default: 60.', None, 60)
    duration: Indirect[Duration] = key("Duration of the drive, instead of `cycles`. Loose beads need it.", None)
    until: Annotated[Literal["climb"] | None, AUTO] = key(
        'Event that ends the run of a pile before its `duration`: `"climb"`, the first climb. '
        "The run ends with the segment in which the climb qualifies.",
        None,
        "climb",
    )
    settling_cycles: Filled[Whole] = key(
        "Cycles at the start, which are not measured. Default: a third, at most 20.", None, 20, ge=0, le=1_000_000
    )
    samples_per_cycle: Filled[_Samples] = key("Samples of the beads per cycle. Default: 20.", None, 20)
    bridge_samples_per_cycle: Indirect[_Samples] = key(
        "Samples of the bridges per cycle, a divisor of `samples_per_cycle`. Default: 1; loose beads: all.", None, 1
    )
    frames_per_second: Indirect[Number] = key(
        "Samples per second, instead of per cycle. Default for loose beads: 60.", None, 60, gt=0, le=1e6
    )
    segment: Indirect[Duration] = key(
        "Length of a segment; a run can continue after a complete segment. Default for loose beads: 0.5 s.", None
    )
    settled_below: Filled[units.Speed] = key(
        "Root mean square velocity of a settled pile. Default for loose beads: 5 mm/s.", None
    )
    longest_settling: Filled[units.NonNegativeDuration] = key(
        "Longest time for settling before the drive starts. Default for loose beads: 0.5 s.", None
    )
    ranks: Whole = key("Number of MPI processes. Only large piles are faster with several.", 1, ge=1, le=64)
    seed: Whole = key("Seed of the random perturbations and of poured beads.", 1, ge=0, le=2**63 - 1)
    steps_per_cycle: Derived[int] = 0
    until_steady: Derived[bool] = False
    cycles_per_sample: Derived[int] = 1
    samples_per_bridge_sample: Derived[int] = 1
    cycles_per_segment: Derived[int] = 1

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
        """Number of stroboscopic samples before velocities are measured."""
        return -(-self.settling_cycles // self.cycles_per_sample)

    @property
    def attempts(self) -> tuple[int, ...]:
        """Cycles for which the run is made, and made again from its begin if its walkers are not steady after them."""
        fewer = FIRST_ATTEMPTS if self.until_steady else ()
        return (*(cycles for cycles in fewer if cycles < self.cycles), self.cycles)

    @property
    def continuation(self) -> str:
        """How `walkers run` continues after the first attempt, as text; empty for a fixed number of cycles."""
        constant, most = f"the velocities are not constant within {percent(CONSTANT)}", self.cycles
        further = f"walkers run continues to {most} if {constant}: then set cycles to {most}"
        return further if len(self.attempts) > 1 else ""

    def steps_until(self, cycles: int) -> int:
        """Steps of the attempts up to the one for so many cycles."""
        return self.steps_per_cycle * sum(attempt for attempt in self.attempts if attempt <= cycles)

    @property
    def rests(self) -> bool:
        """Whether the beads rest before the drive."""
        return bool(self.longest_settling)

    @property
    def in_one(self) -> bool:
        """Whether the run has a single segment."""
        return not self.rests and self.cycles_per_segment >= self.cycles


def limits_of(case: Case) -> TimeStepLimits:
    """Limits of the time step for the bodies of a case."""
    contact, placed = case.contact, sorted(bead.radius for bead in case.placed)
    bridged = [entry for body in case.bodies for entry in body.bridged]
    bridged += [(placed[-1], placed[:1]), (placed[0], placed[-1:])] if placed else []
    return time_step_limits(
        [(*entry, case.boundary.damping(entry[0])) for entry in bridged],
        density=case.beads.density,
        youngs_modulus=contact.youngs_modulus,
        poissons_ratio=contact.poissons_ratio,
        liquid=case.liquid.of_bridges,
        roughness=contact.roughness,
        peak_velocity=case.excitation.peak_velocity,
    )


def with_run(case: Case) -> Case:
    """The case with the time step, the length and the sampling of its run."""
    table, frequency, loose, limits = case.run, case.excitation.frequency, case.loose, limits_of(case)
    samples, cycles_per_sample, samples_per_bridge_sample = _sampling(case)
    largest, reason = limits.recommended(loose=loose) if table.time_step is None else (table.time_step, "given")
    if (exceeded := limits.exceeded_by(largest)) and not table.allow_unstable:
        allowed = f"{min(vars(limits).values()) * 1e6:.3g} us"
        message = f"beyond the {' and the '.join(exceeded)} limit; expected less than {allowed}, "
        raise unusable("run.time_step", f'{message}"auto", or allow_unstable = true')
    time_step, steps = fit_into_cycle(largest, frequency, samples)
    cycles = _number_of_cycles(case, cycles_per_sample)
    until_steady = _until_steady(case, cycles_per_sample)
    settling = table.settling_cycles
    if settling is None:
        settling = settling_of(cycles) if case.walkers else 0
    rest = table.longest_settling if table.longest_settling is not None else _LONGEST_SETTLING * loose
    most = MOST_STEPS // steps - (ceil((rest + 1.0) * frequency) if rest else 0)
    segment = table.segment if table.segment is not None else _SEGMENT_SECONDS if loose else inf
    # Segments end with a sample, so that each begins where the last one ended.
    samples_of_segment = max(1, round(min(segment * frequency, cycles) / cycles_per_sample))
    run = table.but(
        time_step=time_step,
        steps_per_cycle=steps,
        cycles=cycles,
        settling_cycles=settling,
        until_steady=until_steady,
        samples_per_cycle=samples,
        cycles_per_sample=cycles_per_sample,
        samples_per_bridge_sample=samples_per_bridge_sample,
        cycles_per_segment=min(samples_of_segment * cycles_per_sample, cycles),
        settled_below=(table.settled_below or _SETTLED_BELOW) if rest else None,
        longest_settling=rest or None,
    )
    _check_length(case, run, most)
    return case.but(run=run, sources={**case.sources, **_sources(run, case, reason)})


def _number_of_cycles(case: Case, cycles_per_sample: int) -> int:
    """Number of cycles of a run, a multiple of the cycles between samples.

    It follows from ``cycles``, ``most_cycles`` or ``duration``. Without them, a run lasts to the
    end of its ramp, to the last whole cycle of a record that does not repeat, or for 60 cycles. A
    duration within a record ends with the last whole cycle of the record at the latest.
    """
    table, drive = case.run, case.excitation
    fewest, most = drive.cycles
    all_of_record = inf
    if drive.ends:
        all_of_record = floor((most + 1e-9) / cycles_per_sample) * cycles_per_sample
    if table.duration is not None:
        needed = ceil(table.duration * case.excitation.frequency * (1.0 - 1e-12) / cycles_per_sample)
        cycles = needed * cycles_per_sample
        within_record = table.duration <= drive.length * (1.0 + 1e-9)
        return int(min(cycles, all_of_record)) if within_record else cycles
    needed = table.cycles or table.most_cycles or ceil(fewest)
    if not needed and drive.ends:
        return int(all_of_record)
    return ceil((needed or _MOST_CYCLES) / cycles_per_sample) * cycles_per_sample


def _sources(run: Run, case: Case, reason: str) -> dict[str, Source]:
    """Sources of the values of a run that its table does not give."""
    cycles_from, cycles, settling = "from the duration" if run.duration else "not checked earlier", "", ""
    if case.excitation.ends and not run.duration:
        cycles_from = f"of the {case.excitation.length:.4g} s of the record"
    if run.until_steady:
        cycles_from = "checked after 12 and 24 cycles"
        cycles = f"until constant within {percent(CONSTANT)}, at most {run.cycles}"
        settling = ", ".join(f"{settling_of(number)} of {number}" for number in run.attempts)
    often = "" if run.cycles_per_sample == 1 else f"1 in {run.cycles_per_sample} cycles"
    if often:
        cycles_from += f", rounded up to a multiple of {run.cycles_per_sample} cycles (one sample)"
    by_time = case.loose or bool(run.frames_per_second)
    sources = {
        "run.samples_per_cycle": Source("derived" if by_time else "default", "from frames_per_second" * by_time, often),
        "run.time_step": Source("derived", f"auto: {reason}, a whole number of steps per cycle"),
        "run.cycles": Source("derived", cycles_from, cycles),
        "run.settling_cycles": Source("derived", "a third of the cycles, at most 20", settling),
        "run.longest_settling": Source("default", "of loose beads"),
        "run.settled_below": Source("default"),
    }
    if case.loose:
        length = units.quantity_text(run.cycles_per_segment / case.excitation.frequency, units.DURATION)
        sources["run.segment"] = Source("derived", "about 0.5 s", length)
    if not case.walkers:
        sources["run.settling_cycles"] = Source("default", "of loose beads")
    return sources


def _check_length(case: Case, run: Run, longest: float) -> None:
    """Refuse a run that is too short or too long for what is measured, for its drive, or for the engine (cycles)."""
    drive, cycles, settling, every = case.excitation, run.cycles, run.settling_cycles, run.cycles_per_sample
    (fewest, most), name = drive.cycles, "run.cycles" if run.duration is None else "run.duration"
    if run.until and case.mixture is None:
        raise unusable("run.until", "expected none: only clusters of a [mixture] climb out of a pile")
    if cycles < 2:
        raise unusable(name, f"expected at least two cycles of the drive, {2.0 / drive.frequency:.4g} s")
    if cycles - settling < 2:
        raise unusable("run.settling_cycles", f"expected at most cycles - 2 = {cycles - 2}")
    if case.walkers and cycles // every <= run.settled_strobes:
        message = f"expected more: one frame in {every} cycles leaves none after {settling} settling cycles"
        raise unusable("run.frames_per_second", message)
    if drive.record and (apart := drive.record.length / (len(drive.record.rows) - 1)) < run.time_step:
        rows = f"its rows, {1e6 * apart:.3g} us apart, are closer than the time step, {1e6 * run.time_step:.3g} us"
        raise unusable("drive.record", f"{rows}; expected fewer rows, or a shorter run.time_step", drive.record.file)
    if cycles < fewest:
        raise unusable(name, f"expected at least {ceil(fewest)} cycles, {drive.ramp[-1][0]:g} s, of drive.ramp")
    if cycles > most + 1e-9:
        message = "drive.record has no more; drive.repeats = true repeats one that ends as it begins"
        raise unusable(name, f"expected at most {int(most)} cycles: {message}")
    if cycles > longest:
        limit = f"{longest}" if run.duration is None else f"{longest // drive.frequency:g} s"
        raise unusable(name, f"expected at most {limit}: the engine counts steps up to 2^31")


def _sampling(case: Case) -> tuple[int, int, int]:
    """Samples a cycle and cycles a sample, one of which is 1, and samples a sample of bridges."""
    table = case.run
    samples, cycles_per_sample = table.samples_per_cycle or _SAMPLES, 1
    if table.samples_per_cycle is None and (table.frames_per_second is not None or case.loose):
        needed = case.excitation.frequency / (table.frames_per_second or _FRAMES_PER_SECOND)
        samples, cycles_per_sample = (round(1.0 / needed), 1) if needed < 1.0 else (1, round(needed))
    name, bridges = "run.bridge_samples_per_cycle", table.bridge_samples_per_cycle
    if bridges is None:
        return samples, cycles_per_sample, 1 if case.loose else samples
    if case.loose:
        raise unusable(name, "expected none: bridges of loose beads are in every frame")
    if samples % bridges:
        raise unusable(name, f"expected a divisor of samples_per_cycle = {samples}")
    return samples, cycles_per_sample, samples // bridges


def _until_steady(case: Case, cycles_per_sample: int) -> bool:
    """Whether a run may end when its velocities are constant; not if the case gives its length or segments."""
    table = case.run
    until = ["cycles"] if "cycles" in table.model_fields_set and table.cycles is None else []
    until += ["most_cycles"] if table.most_cycles is not None else []
    given = [name for name in ("cycles", "duration", "settling_cycles", "segment") if getattr(table, name) is not None]
    if given and until:
        message = f"expected none: with run.{until[0]}, walkers run until their velocity is constant"
        raise unusable(f"run.{given[0]}", message)
    if until and not case.apart:
        raise unusable(f"run.{until[0]}", "expected run.duration: a run until steady needs independent walkers")
    if until and case.excitation.changes:
        changing = "with drive.ramp" if case.drive.ramp else "with the changing amplitude of drive.record"
        raise unusable(f"run.{until[0]}", f"expected a number of cycles: {changing} no velocity is constant")
    if case.excitation.ends and not until:
        return False
    if case.drive.ramp or not case.apart or given or table.ranks != 1 or cycles_per_sample != 1:
        return False
    # A few cycles suffice for asymmetric dimers that start near the axis.
    return all(
        len(walkers.radii) == 2
        and abs(walkers.radii[0] - walkers.radii[1]) / sum(walkers.radii) >= _NEARLY_SYMMETRIC
        and abs(walkers.angle) + walkers.angle_spread < _ASLANT
        for walkers in case.walkers
    )
