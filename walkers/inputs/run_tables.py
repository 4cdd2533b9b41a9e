"""From the tables of drive and run to a drive, a time step and how the run is sampled."""

from __future__ import annotations

from math import ceil, inf

from walkers.inputs.boundary import Boundary
from walkers.inputs.case import CONSTANT, Case, Run, settling_of
from walkers.inputs.drive import AXES, Drive, Harmonic, common_frequency, unit_vector, waveform
from walkers.inputs.errors import unusable
from walkers.inputs.origins import Notes, Origin
from walkers.inputs.rounding import percent
from walkers.inputs.schema import DriveTable, HarmonicTable, RunTable
from walkers.physics.dimer import Dimer
from walkers.physics.time_step import TimeStepLimits, fit_into_cycle, time_step_limits

MOST_STEPS = 2**31 - 1
_SEGMENT_SECONDS = 0.5
_MOST_CYCLES = 60
_NEARLY_SYMMETRIC = 0.08
"""sin δ of dimers below which speeds of steady walkers still creep …"""
_ASLANT = 0.1
"""… and start angle (rad) from which walkers turn for longer than a few cycles: both run in full."""
_LONGEST_SETTLING = 0.5
_SETTLED_BELOW = 5e-3
_FRAMES_PER_SECOND = 60.0


def resolve_drive(table: DriveTable, boundary: Boundary, dimer: Dimer | None, notes: Notes) -> Drive:
    """A drive of one harmonic or of several; ``dimer`` is whose Γ0 it may be given by, None where there is none.

    Raises `InputError` if something is missing, said twice or contradictory.
    """
    besides = sorted(table.model_fields_set - {"harmonics", "frame"})
    if table.harmonics and besides:
        instead = f": write drive.harmonics[0].{besides[0]}" if besides[0] in HarmonicTable.model_fields else ""
        raise unusable(f"drive.{besides[0]}", f"expected none beside drive.harmonics{instead}")
    if table.harmonics:
        tables = {f"drive.harmonics[{number}]": one for number, one in enumerate(table.harmonics)}
        harmonics = tuple(_harmonic(one, key, boundary, dimer) for key, one in tables.items())
    else:
        first = _harmonic(table, "drive", boundary, dimer)
        harmonics = waveform(table.waveform, first)
        notes.default("drive.axis", boundary.drive_axis, f"of a {boundary.shape}")
        peak = first.peak_acceleration
        notes.derived("drive.peak_acceleration", peak, "from gamma0, the dimer and the liquid")
    try:
        common_frequency([one.frequency for one in harmonics])
    except ValueError as error:
        raise unusable("drive.harmonics", f"expected frequencies with a common period: {error}") from error
    drive = Drive(harmonics, table.frame or "container")
    notes.default("drive.frame", drive.frame)
    if table.frame == "lab" and not drive.is_plain:
        message = "several harmonics, or one with a phase, are driven in the container's frame"
        raise unusable("drive.frame", f'expected "container": {message}')
    return drive


def _harmonic(table: HarmonicTable, key: str, boundary: Boundary, dimer: Dimer | None) -> Harmonic:
    acceleration, gamma0 = table.peak_acceleration, table.gamma0
    if gamma0 is not None and dimer is None:
        raise unusable(f"{key}.gamma0", "expected peak_acceleration: only a dimer has a Γ0")
    if gamma0 is not None and acceleration is not None:
        raise unusable(f"{key}.gamma0", "expected either peak_acceleration or gamma0, not both")
    if gamma0 is not None and dimer is not None:
        acceleration = dimer.peak_acceleration(gamma0)
    assert table.frequency is not None
    assert acceleration is not None
    axis = boundary.drive_axis if table.axis is None else table.axis
    try:
        direction = AXES[axis] if isinstance(axis, str) else unit_vector(axis)
    except ValueError as error:
        raise unusable(f"{key}.axis", str(error)) from error
    return Harmonic(direction, table.frequency, acceleration, table.phase)


def limits_of(case: Case) -> TimeStepLimits:
    """Limits of the time step for the bodies of a case."""
    bridged = [(*entry, case.boundary.damping(entry[0])) for body in case.bodies for entry in body.bridged]
    return time_step_limits(bridged, case.density, case.contact, case.liquid, case.drive.peak_velocity)


def resolve_run(table: RunTable, case: Case, notes: Notes) -> Run:
    """The time step, the length and the sampling of a run, given the rest of the case.

    Raises `InputError` if they contradict each other, or the time step is beyond its limits.
    """
    frequency, loose = case.drive.frequency, case.loose
    samples, cycles_per_sample, samples_per_bridge_sample = _sampling(table, case)
    largest, reason = _largest_time_step(table, case)
    time_step, steps = fit_into_cycle(largest, frequency, samples)
    cycles, until_steady = _cycles(table, case, cycles_per_sample), _until_steady(table, case, cycles_per_sample)
    settling = table.settling_cycles
    if settling is None:
        settling = settling_of(cycles) if case.walkers else 0
    rest = table.longest_settling
    if rest is None:
        rest = _LONGEST_SETTLING if loose else 0.0
    _check_length(table, case, cycles, settling, cycles_per_sample)
    most = MOST_STEPS // steps - (ceil((rest + 1.0) * frequency) if rest else 0)
    if cycles > most:
        key, longest = ("cycles", f"{most}") if table.duration is None else ("duration", f"{most // frequency:g} s")
        raise unusable(f"run.{key}", f"expected at most {longest}: the engine counts steps up to 2^31")
    segment = table.segment if table.segment is not None else _SEGMENT_SECONDS if loose else inf
    # Segments end with a sample, so that each begins where the last one ended.
    samples_of_segment = max(1, round(min(segment * frequency, cycles) / cycles_per_sample))
    run = Run(
        time_step=time_step,
        steps_per_cycle=steps,
        cycles=cycles,
        settling_cycles=settling,
        until_steady=until_steady,
        samples_per_cycle=samples,
        cycles_per_sample=cycles_per_sample,
        samples_per_bridge_sample=samples_per_bridge_sample,
        cycles_per_segment=min(samples_of_segment * cycles_per_sample, cycles),
        settled_below=(table.settled_below or _SETTLED_BELOW) if rest else 0.0,
        longest_settling=rest,
        ranks=table.ranks,
    )
    _note_run(run, table, case, notes, reason)
    return run


def _note_run(run: Run, table: RunTable, case: Case, notes: Notes, reason: str) -> None:
    often = run.samples_per_cycle if run.cycles_per_sample == 1 else f"1 in {run.cycles_per_sample} cycles"
    cycles = f"until constant within {percent(CONSTANT)}, at most {run.cycles}" if run.until_steady else run.cycles
    checked = "checked after 12 and 24 cycles" if run.until_steady else "not checked earlier"
    whence = "from the duration" if table.duration else checked
    if run.cycles_per_sample > 1:
        whence += f", rounded up to a multiple of {run.cycles_per_sample} cycles (one sample)"
    settling = ", ".join(f"{settling_of(cycles)} of {cycles}" for cycles in run.attempts) if run.until_steady else ""
    notes.default("run.samples_per_cycle", often)
    if case.loose:
        notes.derived("run.samples_per_cycle", often, "from frames_per_second")
        notes.derived("run.segment", run.cycles_per_segment / case.drive.frequency, "about 0.5 s")
        notes.default("run.longest_settling", run.longest_settling, "of loose beads")
    if run.rests:
        notes.default("run.settled_below", run.settled_below)
    notes.derived("run.time_step", run.time_step, f"auto: {reason}, a whole number of steps per cycle")
    notes.derived("run.cycles", cycles, whence)
    notes.default("run.settling_cycles", run.settling_cycles, "of loose beads")
    if case.walkers:
        third = "a third of the cycles, at most 20"
        notes["run.settling_cycles"] = Origin("", settling, "derived", third, value=run.settling_cycles)


def _check_length(table: RunTable, case: Case, cycles: int, settling: int, cycles_per_sample: int) -> None:
    """At least two cycles are measured, and one frame of walkers."""
    if cycles < 2:
        key = "run.duration" if table.duration is not None else "run.cycles"
        raise unusable(key, f"expected at least two cycles of the drive, {2.0 / case.drive.frequency:.4g} s")
    if cycles - settling < 2:
        raise unusable("run.settling_cycles", f"expected at most cycles - 2 = {cycles - 2}")
    if case.walkers and cycles // cycles_per_sample <= -(-settling // cycles_per_sample):
        message = f"expected more: one frame in {cycles_per_sample} cycles leaves none after {settling} settling cycles"
        raise unusable("run.frames_per_second", message)


def _largest_time_step(table: RunTable, case: Case) -> tuple[float, str]:
    """The largest step, s, and its reason: given (within the limits unless the case insists), or ``"auto"``."""
    limits, given = limits_of(case), table.time_step
    if given is None:
        return limits.recommended(loose=case.loose)
    if (exceeded := limits.exceeded_by(given)) and not table.allow_unstable:
        allowed = f"{min(limits.as_dict().values()) * 1e6:.3g} us"
        message = f"beyond the {' and the '.join(exceeded)} limit; expected less than {allowed}, "
        raise unusable("run.time_step", f'{message}"auto", or allow_unstable = true')
    return given, "given"


def _sampling(table: RunTable, case: Case) -> tuple[int, int, int]:
    """Samples a cycle and cycles a sample, one of which is 1, and samples a sample of bridges."""
    if table.samples_per_cycle is not None and table.frames_per_second is not None:
        raise unusable("run.frames_per_second", "expected either samples_per_cycle or frames_per_second")
    samples, cycles_per_sample = table.samples_per_cycle or 20, 1
    if table.samples_per_cycle is None and (table.frames_per_second is not None or case.loose):
        wanted = case.drive.frequency / (table.frames_per_second or _FRAMES_PER_SECOND)
        samples, cycles_per_sample = (round(1.0 / wanted), 1) if wanted < 1.0 else (1, round(wanted))
    key, bridges = "run.bridge_samples_per_cycle", table.bridge_samples_per_cycle
    if bridges is None:
        return samples, cycles_per_sample, 1 if case.loose else samples
    if case.loose:
        raise unusable(key, "expected none: bridges of loose beads are in every frame")
    if samples % bridges:
        raise unusable(key, f"expected a divisor of samples_per_cycle = {samples}")
    return samples, cycles_per_sample, samples // bridges


def _cycles(table: RunTable, case: Case, cycles_per_sample: int) -> int:
    """Cycles of a run, whole samples of them."""
    if table.cycles is not None and table.duration is not None:
        raise unusable("run.duration", "expected either cycles or a duration")
    cycles: float = table.cycles or table.most_cycles or _MOST_CYCLES
    if table.duration is not None:
        cycles = table.duration * case.drive.frequency * (1.0 - 1e-12)
    return ceil(cycles / cycles_per_sample) * cycles_per_sample


def _until_steady(table: RunTable, case: Case, cycles_per_sample: int) -> bool:
    """Whether a run may end when its velocities are constant: not one that says how long it is, and in which parts.

    Raises `InputError` if a case asks for what cannot be, or for its contrary as well.
    """
    asked = ["cycles"] if "cycles" in table.model_fields_set and table.cycles is None else []
    asked += ["most_cycles"] if table.most_cycles is not None else []
    given = [key for key in ("cycles", "duration", "settling_cycles", "segment") if getattr(table, key) is not None]
    if given and asked:
        why = f"with run.{asked[0]}, walkers run until their velocity is constant"
        raise unusable(f"run.{given[0]}", f"expected none: {why}")
    if asked and not case.apart:
        raise unusable(f"run.{asked[0]}", "expected run.duration: a run until steady needs independent walkers")
    if not case.apart or given or table.ranks != 1 or cycles_per_sample != 1:
        return False
    # A few cycles may show how walkers walk that are asymmetric dimers which start near the axis.
    return all(
        len(walkers.radii) == 2
        and abs(walkers.radii[0] - walkers.radii[1]) / sum(walkers.radii) >= _NEARLY_SYMMETRIC
        and abs(walkers.angle) + walkers.angle_spread < _ASLANT
        for walkers in case.walkers
    )
