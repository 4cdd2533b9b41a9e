"""The time step, the length and the sampling of a run, which follow from the whole case."""

from __future__ import annotations

from math import ceil, floor, inf

from walkers.errors import key_error
from walkers.inputs import units
from walkers.inputs.origins import Source
from walkers.inputs.tables.case import Setup
from walkers.inputs.tables.drive import Excitation
from walkers.inputs.tables.run import CONSTANT, RunSettings, RunTable, settling_of
from walkers.physics.time_step import BridgedBead, TimeStepLimits, fit_into_cycle, time_step_limits
from walkers.rounding import percent

MOST_STEPS = 2**31 - 1
_SEGMENT_SECONDS = 0.5
_SETTLING_MARGIN = 1.0
"""Time, s, that settling may exceed its limit by: it ends with a segment."""
_MOST_CYCLES = 60
_SAMPLES = 20
_NEARLY_SYMMETRIC = 0.08  # sin δ of dimers below which speeds of steady walkers still creep …
_ASLANT = 0.1  # … and start angle (rad) from which walkers turn for longer than a few cycles: both run in full
_LONGEST_SETTLING = 0.5
_SETTLED_BELOW = 5e-3
_FRAMES_PER_SECOND = 60.0


def limits_of(case: Setup) -> TimeStepLimits:
    """Limits of the time step for the bodies of a case."""
    contact, placed = case.contact, sorted(bead.radius for bead in case.placed)
    bridged = [entry for body in case.bodies for entry in body.bridged]
    bridged += [(placed[-1], placed[:1]), (placed[0], placed[-1:])] if placed else []
    damping = case.boundary.geometry.damping
    return time_step_limits(
        [BridgedBead(radius, neighbours, damping(radius)) for radius, neighbours in bridged],
        density=case.beads.density,
        youngs_modulus=contact.youngs_modulus,
        poissons_ratio=contact.poissons_ratio,
        liquid=case.liquid.of_bridges,
        roughness=contact.roughness,
        peak_velocity=case.excitation.peak_velocity,
    )


def resolved_run(case: Setup) -> tuple[RunSettings, dict[str, Source]]:
    """The time step, the length and the sampling of the run of a case.

    Parameters
    ----------
    case
        A case whose run is as its file says it.

    Returns
    -------
    run : Run
        The run with all values.
    sources : dict of str to Source
        Where values are from that the file does not give, by their keys.

    Raises
    ------
    InputError
        If a key of ``[run]`` contradicts another one, or if the run is too short or too long.
    """
    table = case.run
    frequency = case.excitation.frequency
    samples, cycles_per_sample = samples_of(table, case.excitation, loose=case.loose)
    samples_per_bridge_sample = _samples_per_bridge_sample(case, samples)
    largest, reason = _largest_step(case)
    time_step, steps = fit_into_cycle(largest, frequency, samples)
    cycles = cycles_of(table, case.excitation, cycles_per_sample)
    until_steady = _until_steady(case, cycles_per_sample)
    settling = table.settling_cycles
    if settling is None:
        settling = settling_of(cycles) if case.walkers else 0
    rest = table.longest_settling
    if rest is None and case.loose:
        rest = _LONGEST_SETTLING
    run = table.completed(
        RunSettings,
        {
            "time_step": time_step,
            "steps_per_cycle": steps,
            "cycles": cycles,
            "settling_cycles": settling,
            "until_steady": until_steady,
            "samples_per_cycle": samples,
            "cycles_per_sample": cycles_per_sample,
            "samples_per_bridge_sample": samples_per_bridge_sample,
            "cycles_per_segment": _cycles_per_segment(case, cycles, cycles_per_sample),
            "settled_below": (table.settled_below or _SETTLED_BELOW) if rest else None,
            "longest_settling": rest or None,
        },
    )
    most = MOST_STEPS // steps
    if rest:
        most -= ceil((rest + _SETTLING_MARGIN) * frequency)
        if most < 1:
            longest = MOST_STEPS * time_step - _SETTLING_MARGIN
            message = f"expected less than {longest:.3g} s: the engine counts steps up to 2^31"
            raise key_error("run.longest_settling", message)
    _check_length(case, run, most)
    return run, _sources(run, case, reason)


def _largest_step(case: Setup) -> tuple[float, str]:
    """The largest time step of a case, s, and where it is from; one beyond a limit is refused."""
    table, limits = case.run, limits_of(case)
    if table.time_step is None:
        largest, reason = limits.recommended(loose=case.loose)
    else:
        largest, reason = table.time_step, "given"
    exceeded = limits.exceeded_by(largest)
    if exceeded and not table.allow_unstable:
        allowed = f"{min(vars(limits).values()) * 1e6:.3g} us"
        message = f"beyond the {' and the '.join(exceeded)} limit; expected less than {allowed}, "
        raise key_error("run.time_step", f'{message}"auto", or allow_unstable = true')
    return largest, reason


def _cycles_per_segment(case: Setup, cycles: int, cycles_per_sample: int) -> int:
    """Cycles of a segment, which ends with a sample, so that each begins where the last one ended."""
    segment = case.run.segment
    if segment is None:
        segment = _SEGMENT_SECONDS if case.loose else inf
    samples = max(1, round(min(segment * case.excitation.frequency, cycles) / cycles_per_sample))
    return min(samples * cycles_per_sample, cycles)


def cycles_of(table: RunTable, drive: Excitation, cycles_per_sample: int) -> int:
    """Number of cycles of a run, a multiple of the cycles between samples.

    It follows from ``cycles``, ``most_cycles`` or ``duration``. Without them, a run lasts to the
    end of its ramp, to the last whole cycle of a record that does not repeat, or for 60 cycles. A
    duration within a record ends with the last whole cycle of the record at the latest.
    """
    fewest, most = drive.cycle_limits
    all_of_record = inf
    if drive.ends:
        all_of_record = floor((most + 1e-9) / cycles_per_sample) * cycles_per_sample
    if table.duration is not None:
        needed = ceil(table.duration * drive.frequency * (1.0 - 1e-12) / cycles_per_sample)
        cycles = needed * cycles_per_sample
        within_record = table.duration <= drive.length * (1.0 + 1e-9)
        return int(min(cycles, all_of_record)) if within_record else cycles
    needed = table.cycles or table.most_cycles or ceil(fewest)
    if not needed and drive.ends:
        return int(all_of_record)
    return ceil((needed or _MOST_CYCLES) / cycles_per_sample) * cycles_per_sample


def _sources(run: RunSettings, case: Setup, reason: str) -> dict[str, Source]:
    """Sources of the values of a run that its table does not give."""
    cycles_from, cycles, settling = (
        "from the duration" if run.duration else "not checked earlier",
        "",
        "",
    )
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
        "run.samples_per_cycle": Source(
            "derived" if by_time else "default", "from frames_per_second" * by_time, often
        ),
        "run.time_step": Source("derived", f"auto: {reason}, a whole number of steps per cycle"),
        "run.cycles": Source("derived", cycles_from, cycles),
        "run.settling_cycles": Source("derived", "a third of the cycles, at most 20", settling),
        "run.longest_settling": Source("default", "of loose beads"),
        "run.settled_below": Source("default"),
    }
    if case.loose:
        length = units.quantity_text(
            run.cycles_per_segment / case.excitation.frequency, units.DURATION
        )
        sources["run.segment"] = Source("derived", "about 0.5 s", length)
    if not case.walkers:
        sources["run.settling_cycles"] = Source("default", "of loose beads")
    return sources


def _check_length(case: Setup, run: RunSettings, longest: float) -> None:
    """Refuse a run that is too short or too long for what is measured, for its drive, or for the engine (cycles)."""
    drive, cycles, settling, every = (
        case.excitation,
        run.cycles,
        run.settling_cycles,
        run.cycles_per_sample,
    )
    (fewest, most), name = (
        drive.cycle_limits,
        "run.cycles" if run.duration is None else "run.duration",
    )
    if run.until and case.mixture is None:
        raise key_error(
            "run.until", "expected none: only clusters of a [mixture] climb out of a pile"
        )
    if cycles < 2:
        raise key_error(
            name, f"expected at least two cycles of the drive, {2.0 / drive.frequency:.4g} s"
        )
    if cycles - settling < 2:
        raise key_error("run.settling_cycles", f"expected at most cycles - 2 = {cycles - 2}")
    if case.walkers and cycles // every <= run.settled_strobes:
        message = f"expected more: one frame in {every} cycles leaves none after {settling} settling cycles"
        raise key_error("run.frames_per_second", message)
    if (
        drive.record
        and (apart := drive.record.length / (len(drive.record.rows) - 1)) < run.time_step
    ):
        rows = f"its rows, {1e6 * apart:.3g} us apart, are closer than the time step, {1e6 * run.time_step:.3g} us"
        raise key_error(
            "drive.record",
            f"{rows}; expected fewer rows, or a shorter run.time_step",
            drive.record.file,
        )
    if cycles < fewest:
        raise key_error(
            name, f"expected at least {ceil(fewest)} cycles, {drive.ramp[-1][0]:g} s, of drive.ramp"
        )
    if cycles > most + 1e-9:
        message = (
            "drive.record has no more; drive.repeats = true repeats one that ends as it begins"
        )
        raise key_error(name, f"expected at most {int(most)} cycles: {message}")
    if cycles > longest:
        limit = f"{longest}" if run.duration is None else f"{longest // drive.frequency:g} s"
        raise key_error(name, f"expected at most {limit}: the engine counts steps up to 2^31")


def samples_of(table: RunTable, drive: Excitation, *, loose: bool) -> tuple[int, int]:
    """Samples a cycle and cycles a sample, one of which is 1."""
    if table.samples_per_cycle is not None:
        return table.samples_per_cycle, 1
    if table.frames_per_second is None and not loose:
        return _SAMPLES, 1
    needed = drive.frequency / (table.frames_per_second or _FRAMES_PER_SECOND)
    return (round(1.0 / needed), 1) if needed < 1.0 else (1, round(needed))


def _samples_per_bridge_sample(case: Setup, samples: int) -> int:
    """Samples of the beads for one of the bridges, given the samples of the beads a cycle."""
    name, bridges = "run.bridge_samples_per_cycle", case.run.bridge_samples_per_cycle
    if bridges is None:
        return 1 if case.loose else samples
    if case.loose:
        raise key_error(name, "expected none: bridges of loose beads are in every frame")
    if samples % bridges:
        raise key_error(name, f"expected a divisor of samples_per_cycle = {samples}")
    return samples // bridges


def _until_steady(case: Setup, cycles_per_sample: int) -> bool:
    """Whether a run may end when its velocities are constant; not if the case gives its length or segments."""
    table = case.run
    until = ["cycles"] if "cycles" in table.model_fields_set and table.cycles is None else []
    until += ["most_cycles"] if table.most_cycles is not None else []
    given = [
        name
        for name in ("cycles", "duration", "settling_cycles", "segment")
        if getattr(table, name) is not None
    ]
    if given and until:
        message = (
            f"expected none: with run.{until[0]}, walkers run until their velocity is constant"
        )
        raise key_error(f"run.{given[0]}", message)
    if until and not case.apart:
        raise key_error(
            f"run.{until[0]}", "expected run.duration: a run until steady needs independent walkers"
        )
    if until and case.excitation.changes:
        changing = (
            "with drive.ramp" if case.drive.ramp else "with the changing amplitude of drive.record"
        )
        raise key_error(
            f"run.{until[0]}", f"expected a number of cycles: {changing} no velocity is constant"
        )
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
