"""The time step, the length and the sampling of a run, which follow from the whole case.

What the keys of ``[run]`` mean is in `walkers.inputs.tables.run`, the limits of the time step in
`walkers.physics.time_step`. *Loose beads* belong to no walker: they are poured as a mixture, or
placed one by one.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, inf

from walkers.errors import key_error
from walkers.inputs import units
from walkers.inputs.origins import Source
from walkers.inputs.resolving.loads import friction_rate
from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.case import Setup
from walkers.inputs.tables.drive import Excitation
from walkers.inputs.tables.run import CONSTANT, RunSettings, RunTable, settling_of
from walkers.physics.time_step import BridgedBead, TimeStepLimits, fit_into_cycle, time_step_limits
from walkers.rounding import percent

_ROUNDING = 1e-9
"""Rounding error of a number of cycles, and relative one of a duration."""
_ROUNDING_OF_DURATION = 1e-12
"""Relative rounding error of a duration times a frequency."""
MOST_STEPS = 2**31 - 1
"""Largest number of time steps of a run: the engine counts them with 32 bits."""
_SEGMENT_SECONDS = 0.5
"""Length of the segments of runs of loose beads, s."""
_SETTLING_MARGIN = 1.0
"""Time by which settling may exceed its limit, s: it ends with a segment."""
_MOST_CYCLES = 60
"""Cycles of a run whose length nothing else gives; fewer if velocities are constant earlier."""
_SAMPLES = 20
"""Samples a cycle of the motion of walkers."""
_NEARLY_SYMMETRIC = 0.08
"""Asymmetry sin δ of dimers below which the speeds of steady walkers still creep: they run in
full."""
_ASLANT = 0.1
"""Start angle from which walkers turn for longer than a few cycles, rad: they run in full."""
_LONGEST_SETTLING = 0.5
"""Longest settling of loose beads, s."""
_SETTLED_BELOW = 5e-3
"""Root mean square velocity of a settled pile of loose beads, m/s."""
_FRAMES_PER_SECOND = 60.0
"""Samples a second of the motion of loose beads."""


def limits_of(case: Setup) -> TimeStepLimits:
    """Limits of the time step for the bodies of a case."""
    bridged: list[tuple[float, Sequence[float]]] = []
    for body in case.bodies:
        bridged += body.bridged
    placed = sorted(bead.radius for bead in case.placed)
    if placed:
        smallest = placed[0]
        largest = placed[-1]
        bridged.append((largest, [smallest]))
        bridged.append((smallest, [largest]))
    damping = case.boundary.geometry.damping
    return time_step_limits(
        [BridgedBead(radius, neighbours, damping(radius)) for radius, neighbours in bridged],
        density=case.beads.density,
        youngs_modulus=case.contact.youngs_modulus,
        poissons_ratio=case.contact.poissons_ratio,
        liquid=case.liquid.of_bridges,
        roughness=case.contact.roughness,
        peak_velocity=case.excitation.peak_velocity,
        friction_rate=friction_rate(case, bridged),
    )


def resolved_run(case: Setup) -> tuple[RunSettings, dict[str, Source]]:
    """The time step, the length and the sampling of the run of a case.

    Parameters
    ----------
    case
        A case whose run is as its file says it.

    Returns
    -------
    run : RunSettings
        The run with all values.
    sources : dict of str to Source
        Sources of the values that the file does not give, by their keys.

    Raises
    ------
    InputError
        If a key of ``[run]`` contradicts another one, or if the run is too short or too long.
    """
    table = case.run
    drive = case.excitation
    samples, cycles_per_sample = samples_of(table, drive, loose=case.loose)
    samples_per_bridge_sample = _samples_per_bridge_sample(case, samples)
    largest_step, reason = _largest_step(case)
    time_step, steps_per_cycle = fit_into_cycle(largest_step, drive.frequency, samples)
    cycles = cycles_of(table, drive, cycles_per_sample)
    until_steady = _until_steady(case, cycles_per_sample)
    settling_cycles = table.settling_cycles
    if settling_cycles is None:
        settling_cycles = settling_of(cycles) if case.walkers else 0
    # Loose beads come to rest before the drive; 0 means that they do not. The settling cycles of
    # walkers are driven, but not measured.
    longest_settling = table.longest_settling
    if longest_settling is None and case.loose:
        longest_settling = _LONGEST_SETTLING
    settled_below = None
    if longest_settling:
        settled_below = table.settled_below or _SETTLED_BELOW
    run = table.completed(
        RunSettings,
        {
            "time_step": time_step,
            "steps_per_cycle": steps_per_cycle,
            "cycles": cycles,
            "settling_cycles": settling_cycles,
            "until_steady": until_steady,
            "samples_per_cycle": samples,
            "cycles_per_sample": cycles_per_sample,
            "samples_per_bridge_sample": samples_per_bridge_sample,
            "cycles_per_segment": _cycles_per_segment(case, cycles, cycles_per_sample),
            "settled_below": settled_below,
            "longest_settling": longest_settling or None,
        },
    )
    countable_cycles = MOST_STEPS // steps_per_cycle
    if longest_settling:
        countable_cycles -= ceil((longest_settling + _SETTLING_MARGIN) * drive.frequency)
        if countable_cycles < 1:
            limit = MOST_STEPS * time_step - _SETTLING_MARGIN
            message = f"expected less than {limit:.3g} s: the engine counts steps up to 2^31"
            raise key_error("run.longest_settling", message)
    _check_length(case, run, countable_cycles)
    return run, _sources(run, case, reason)


def _largest_step(case: Setup) -> tuple[float, str]:
    """The largest time step of a case, s, and where it is from; refuses one beyond a limit."""
    table = case.run
    limits = limits_of(case)
    if table.time_step is None:
        largest, reason = limits.recommended(loose=case.loose)
    else:
        largest = table.time_step
        reason = "given"
    exceeded = limits.exceeded_by(largest)
    if exceeded and not table.allow_unstable:
        allowed = f"{min(vars(limits).values()) * 1e6:.3g} us"
        message = f"beyond the {' and the '.join(exceeded)} limit; expected less than {allowed}, "
        raise key_error("run.time_step", f'{message}"auto", or allow_unstable = true')
    return largest, reason


def _cycles_per_segment(case: Setup, cycles: int, cycles_per_sample: int) -> int:
    """Cycles of a segment, which ends with a sample, so that the next one begins where it ends."""
    segment = case.run.segment
    if segment is None:
        segment = _SEGMENT_SECONDS if case.loose else inf
    samples = max(1, round(min(segment * case.excitation.frequency, cycles) / cycles_per_sample))
    return min(samples * cycles_per_sample, cycles)


def cycles_of(table: RunTable, drive: Excitation, cycles_per_sample: int) -> int:
    """Number of cycles of a run, a multiple of the cycles between samples.

    It follows from ``duration``, ``cycles`` or ``most_cycles``. Without them, a run lasts to the
    end of its ramp, to the last whole cycle of a record that does not repeat, or for 60 cycles. A
    duration within a record ends with the last whole cycle of the record at the latest.

    Parameters
    ----------
    table
        The table ``[run]`` of a case file.
    drive
        The oscillations of the drive.
    cycles_per_sample
        Cycles between samples, at least 1.
    """
    # 0 without a ramp, and infinite without a record that ends.
    cycles_of_ramp, cycles_in_record = drive.cycle_limits
    cycles_of_record = 0
    if drive.ends:
        samples_of_record = floor((cycles_in_record + _ROUNDING) / cycles_per_sample)
        cycles_of_record = samples_of_record * cycles_per_sample
    if table.duration is not None:
        # A duration of whole samples must not give one more because of a rounding error.
        cycles_of_duration = table.duration * drive.frequency * (1.0 - _ROUNDING_OF_DURATION)
        samples = ceil(cycles_of_duration / cycles_per_sample)
        cycles = samples * cycles_per_sample
        if drive.ends and table.duration <= drive.length * (1.0 + _ROUNDING):
            cycles = min(cycles, cycles_of_record)
        return cycles
    if table.cycles:
        needed = table.cycles
    elif table.most_cycles:
        needed = table.most_cycles
    elif cycles_of_ramp > 0.0:
        needed = ceil(cycles_of_ramp)
    elif drive.ends:
        return cycles_of_record
    else:
        needed = _MOST_CYCLES
    return ceil(needed / cycles_per_sample) * cycles_per_sample


def _sources(run: RunSettings, case: Setup, reason: str) -> dict[str, Source]:
    """Sources of the values of a run, by their keys.

    Those of values that the file gives are not used. ``reason`` says which limit the time step is
    from.
    """
    sources = {
        "run.samples_per_cycle": _source_of_samples(run, case),
        "run.time_step": Source("derived", f"auto: {reason}, a whole number of steps per cycle"),
        "run.cycles": _source_of_cycles(run, case),
        "run.settling_cycles": _source_of_settling_cycles(run, case),
        "run.longest_settling": Source("default", "of loose beads"),
        "run.settled_below": Source("default"),
    }
    if case.loose:
        seconds = run.cycles_per_segment / case.excitation.frequency
        length = units.quantity_text(seconds, units.DURATION)
        sources["run.segment"] = Source("derived", "about 0.5 s", length)
    return sources


def _source_of_samples(run: RunSettings, case: Setup) -> Source:
    """The source of the samples per cycle, in words if there are fewer than one."""
    text = ""
    if run.cycles_per_sample != 1:
        text = f"1 in {run.cycles_per_sample} cycles"
    if case.loose or run.frames_per_second:
        return Source("derived", "from frames_per_second", text)
    return Source("default", text=text)


def _source_of_cycles(run: RunSettings, case: Setup) -> Source:
    """The source of the number of cycles, in words if the run may end earlier."""
    text = ""
    if run.until_steady:
        why = "checked after 12 and 24 cycles"
        text = f"until constant within {percent(CONSTANT)}, at most {run.cycles}"
    elif run.duration:
        why = "from the duration"
    elif case.excitation.ends:
        why = f"of the {case.excitation.length:.4g} s of the record"
    else:
        why = "not checked earlier"
    if run.cycles_per_sample != 1:
        why += f", rounded up to a multiple of {run.cycles_per_sample} cycles (one sample)"
    return Source("derived", why, text)


def _source_of_settling_cycles(run: RunSettings, case: Setup) -> Source:
    """The source of the settling cycles, which depend on the cycles if the run may end earlier."""
    if not case.walkers:
        return Source("default", "of loose beads")
    text = ""
    if run.until_steady:
        text = ", ".join(f"{settling_of(cycles)} of {cycles}" for cycles in run.attempts)
    return Source("derived", "a third of the cycles, at most 20", text)


def _check_length(case: Setup, run: RunSettings, most_cycles: int) -> None:
    """Refuse a run that is too short or too long for what is measured, its drive, or the engine.

    ``most_cycles`` are those that the engine can count.
    """
    key = "run.cycles" if run.duration is None else "run.duration"
    if run.until and case.mixture is None:
        raise key_error(
            "run.until", "expected none: only clusters of a [mixture] climb out of a pile"
        )
    _check_measured_cycles(case, run, key)
    _check_cycles_of_drive(case.excitation, run, key)
    if run.cycles > most_cycles:
        limit = f"{most_cycles}"
        if run.duration is not None:
            limit = f"{most_cycles // case.excitation.frequency:g} s"
        raise key_error(key, f"expected at most {limit}: the engine counts steps up to 2^31")


def _check_measured_cycles(case: Setup, run: RunSettings, key: str) -> None:
    """Refuse a run with too few cycles or samples after settling; ``key`` gives its length."""
    if run.cycles < 2:
        seconds = 2.0 / case.excitation.frequency
        raise key_error(key, f"expected at least two cycles of the drive, {seconds:.4g} s")
    settling = run.settling_cycles
    if run.cycles - settling < 2:
        raise key_error("run.settling_cycles", f"expected at most cycles - 2 = {run.cycles - 2}")
    if case.walkers and run.cycles // run.cycles_per_sample <= run.settled_strobes:
        frames = f"one frame in {run.cycles_per_sample} cycles"
        message = f"expected more: {frames} leaves none after {settling} settling cycles"
        raise key_error("run.frames_per_second", message)


def _check_cycles_of_drive(drive: Excitation, run: RunSettings, key: str) -> None:
    """Refuse a run that is too coarse, too short or too long for its record or ramp."""
    record = drive.record
    if record:
        interval = record.length / (len(record.rows) - 1)
        if interval < run.time_step:
            rows = f"its rows, {1e6 * interval:.3g} us apart, are closer than the time step"
            message = f"{rows}, {1e6 * run.time_step:.3g} us; expected fewer rows"
            raise key_error("drive.record", f"{message}, or a shorter run.time_step", record.file)
    fewest, most = drive.cycle_limits
    if run.cycles < fewest:
        end_of_ramp = f"{drive.ramp[-1][0]:g} s"
        message = f"expected at least {ceil(fewest)} cycles, {end_of_ramp}, of drive.ramp"
        raise key_error(key, message)
    if run.cycles > most + _ROUNDING:
        message = "drive.repeats = true repeats one that ends as it begins"
        expected = f"expected at most {int(most)} cycles"
        raise key_error(key, f"{expected}: drive.record has no more; {message}")


def samples_of(table: RunTable, drive: Excitation, *, loose: bool) -> tuple[int, int]:
    """Samples a cycle and cycles a sample, one of which is 1.

    Parameters
    ----------
    table
        The table ``[run]`` of a case file.
    drive
        The oscillations of the drive.
    loose
        Whether the case has loose beads, which are sampled in real time.
    """
    if table.samples_per_cycle is not None:
        return table.samples_per_cycle, 1
    if table.frames_per_second is None and not loose:
        return _SAMPLES, 1
    cycles_per_sample = drive.frequency / (table.frames_per_second or _FRAMES_PER_SECOND)
    if cycles_per_sample < 1.0:
        return round(1.0 / cycles_per_sample), 1
    return 1, round(cycles_per_sample)


def _samples_per_bridge_sample(case: Setup, samples: int) -> int:
    """Samples of the beads for one of the bridges, given the samples of the beads a cycle."""
    key = "run.bridge_samples_per_cycle"
    bridges = case.run.bridge_samples_per_cycle
    if bridges is None:
        return 1 if case.loose else samples
    if case.loose:
        raise key_error(key, "expected none: bridges of loose beads are in every frame")
    if samples % bridges:
        raise key_error(key, f"expected a divisor of samples_per_cycle = {samples}")
    return samples // bridges


def _until_steady(case: Setup, cycles_per_sample: int) -> bool:
    """Whether a run may end when its velocities are constant.

    It may not if the case gives its length or segments.
    """
    table = case.run
    key = _key_until_steady(table)
    length_keys = ("cycles", "duration", "settling_cycles", "segment")
    given = [name for name in length_keys if getattr(table, name) is not None]
    if key is not None:
        if given:
            message = f"expected none: with {key}, walkers run until their velocity is constant"
            raise key_error(f"run.{given[0]}", message)
        _check_can_become_steady(case, key)
    elif case.excitation.ends:
        return False
    if case.drive.ramp or not case.apart or given or table.ranks != 1 or cycles_per_sample != 1:
        return False
    return all(_is_soon_steady(walkers) for walkers in case.walkers)


def _key_until_steady(table: RunTable) -> str | None:
    """The key by which a case asks for a run until velocities are constant, if it does."""
    if "cycles" in table.model_fields_set and table.cycles is None:
        return "run.cycles"
    if table.most_cycles is not None:
        return "run.most_cycles"
    return None


def _check_can_become_steady(case: Setup, key: str) -> None:
    """Refuse to run until velocities are constant if walkers may meet, or the drive changes."""
    if not case.apart:
        message = "a run until steady needs independent walkers"
        raise key_error(key, f"expected run.duration: {message}")
    if case.excitation.changes:
        changing = "with the changing amplitude of drive.record"
        if case.drive.ramp:
            changing = "with drive.ramp"
        raise key_error(key, f"expected a number of cycles: {changing} no velocity is constant")


def _is_soon_steady(walkers: Walkers) -> bool:
    """Whether a few cycles suffice: for asymmetric dimers that start near the drive axis."""
    if len(walkers.radii) != 2:
        return False
    first, second = walkers.radii
    asymmetry = abs(first - second) / sum(walkers.radii)
    largest_angle = abs(walkers.angle) + walkers.angle_spread
    return asymmetry >= _NEARLY_SYMMETRIC and largest_angle < _ASLANT
