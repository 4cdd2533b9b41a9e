"""Measure walkers: velocity, rotation, sliding, contacts, orientation, work of the drive.

The numbers follow the protocol of the paper: a velocity is the mean over the copies, and its error
bar is the largest velocity minus the smallest. The walkers that start facing left and those that
start facing right are also averaged separately. The copies differ only in how they start, so their
scatter is not an uncertainty of the velocity.

`walkers.postprocess.measure.gait` computes the quantities of one kind of walkers. This module makes
tables and numbers of them. Meetings of walkers and thresholds of motion have modules of their own.
In the names of columns and numbers, the kind of a walker is called its ``make``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import nan
from typing import Any

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.inputs.resolving.loads import contact_loads, dimer_of
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure import gait
from walkers.postprocess.measure.motion import NEAR, Group, Motion, came_near
from walkers.postprocess.measure.numbers import Measurement
from walkers.postprocess.measure.sides import (
    REST,
    SAME,
    SEPARATED,
    STEADY_SPEED,
    differ,
    same_heading,
    sides,
)
from walkers.postprocess.measure.tables import Columns, numbered_columns
from walkers.rounding import counted, percent

NAME = "walking"
VERSION = 2

_LONGER = 1.5
"""Recommended number of cycles over the number after which all turning walkers have turned."""
_PREFIXES_OF_BEAD_COLUMNS = ("rotation_", "sliding_", "open_")
"""Starts of the names of columns that belong to one bead or to one contact of a walker."""


def applies(case: Case) -> bool:
    """Tell whether a case has walkers."""
    return bool(case.walkers)


def derived(case: Case) -> dict[str, float]:
    """Compute the numbers of the first kind of walkers that follow from the case.

    Parameters
    ----------
    case
        A case with walkers.

    Returns
    -------
    dict of str to float
        ``radius_1`` and ``radius_2`` (m) of the first two beads; of dimers also ``gamma0``,
        ``sin_delta`` and ``mass_asymmetry``.
    """
    first_radius, second_radius = case.walkers[0].radii[:2]
    numbers = {}
    if len(case.walkers[0].radii) == 2:
        dimer = dimer_of(case)
        numbers["gamma0"] = dimer.gamma0(case.excitation.peak_acceleration)
        numbers["sin_delta"] = dimer.sin_delta
        numbers["mass_asymmetry"] = dimer.mass_asymmetry
    numbers["radius_1"] = first_radius
    numbers["radius_2"] = second_radius
    return numbers


def measure(motion: Motion) -> Measurement:
    """Measure all walkers of a run.

    Parameters
    ----------
    motion
        Motion of a run with walkers.

    Returns
    -------
    Measurement
        Tables ``trajectory``, ``walkers``, ``cycles`` and ``bridges``, and the numbers of the group
        ``walking``. Numbers of rotation, sliding and contacts belong to the first kind of walkers.
    """
    case = motion.case
    groups = motion.groups
    tables_of_kinds = [tables_of(group) for group in groups]
    tables: dict[str, Columns] = {}
    for name in tables_of_kinds[0]:
        tables[name] = _stacked([tables_of_kind[name] for tables_of_kind in tables_of_kinds])
    walkers = tables["walkers"]

    numbers = _velocities(walkers, case)
    numbers |= _means_of_beads(tables_of_kinds[0]["walkers"], case)
    numbers["walkers_met"] = walkers_met(groups)
    numbers["meets"] = case.meets
    numbers["cycles"] = case.run.cycles
    numbers["settling_cycles"] = case.run.settling_cycles
    numbers["ended_early"] = motion.ended_early
    if case.goes_uphill:
        numbers |= _posture(groups, walkers)
    if motion.follows_cycles:
        numbers |= _work(groups, tables["cycles"], walkers)
    if len(groups) > 1:
        for number, tables_of_kind in enumerate(tables_of_kinds, 1):
            numbers |= _numbers_of_kind(number, tables_of_kind["walkers"], case)

    warnings = list(_doubts(numbers, changes=case.excitation.changes))
    turning = _turning_warning(groups, walkers)
    if turning is not None:
        warnings.append(turning)
    return Measurement({**tables, "bridges": _bridges(motion)}, numbers, tuple(warnings))


def _means_of_beads(walkers: Columns, case: Case) -> dict[str, float]:
    """Mean rotation, sliding and open contacts of walkers of one kind, by names of columns."""
    averaged = same_heading(walkers, uphill=case.goes_uphill)
    numbers = {}
    for name, values in walkers.items():
        if name.startswith(_PREFIXES_OF_BEAD_COLUMNS):
            numbers[name] = _mean(values[averaged])
    return numbers


def _numbers_of_kind(number: int, walkers: Columns, case: Case) -> dict[str, float]:
    """Mean velocity (m/s) and counts of one kind of walkers, by names that end in its number.

    Kinds are numbered from 1. The mean is over the walkers that `same_heading` chooses; the counts
    are of all walkers.
    """
    velocity = walkers["velocity"][same_heading(walkers, uphill=case.goes_uphill)]
    return {
        f"velocity_make_{number}": float(velocity.mean()),
        f"walkers_make_{number}": len(walkers["velocity"]),
        f"steady_make_{number}": int(np.sum(walkers["steady"])),
    }


def _doubts(numbers: Mapping[str, Any], *, changes: bool) -> Iterator[str]:
    """Reasons to doubt the velocity.

    Walkers on trays are meant to meet, and stop when they do; a drive whose strength ``changes``
    changes their velocity. Neither is a reason to doubt. (On trays, ``came_apart`` and
    ``depends_on_start`` are always false.)
    """
    meant_to_meet = numbers["meets"]
    unsteady = numbers["walkers"] - numbers["steady"]
    # Walkers that came apart have a warning of their own.
    if unsteady and not (meant_to_meet or numbers["came_apart"] or changes):
        verb = "is" if unsteady == 1 else "are"
        yield (
            f"{unsteady} of {numbers['walkers']} walkers {verb} not steady: "
            "the velocity depends on the length of the run"
        )
    if numbers["came_apart"]:
        share = percent(round(numbers["separated_fraction"], 2))
        yield f"walkers came apart: beads are beyond the rupture distance for {share} of the time"
    if numbers["depends_on_start"] and not changes:
        difference = f"steady copies differ by more than {percent(SAME)}"
        yield f"{difference}: the velocity depends on the start"
    if numbers["walkers_met"] and not meant_to_meet:
        yield "walkers came close to each other and are not independent: increase the spacing"


def _turning_warning(groups: Sequence[Group], walkers: Columns) -> str | None:
    """A warning if walkers will turn away from the drive axis, or turn over, after the run."""
    case = groups[0].case
    if case.meets or case.excitation.changes:
        return None
    not_turned = np.isnan(walkers["turned_at"])
    seconds_left = np.concatenate([gait.turns_away_after(group) for group in groups])[not_turned]
    count = int(np.isfinite(seconds_left).sum())
    if count == 0:
        return None
    longest = float(np.nanmax(seconds_left))
    cycles_to_turn = case.run.cycles + case.excitation.frequency * longest
    recommended_cycles = float(f"{_LONGER * cycles_to_turn:.2g}")

    verb = "turns" if count == 1 else "turn"
    subject = f"{count} of {counted(len(walkers['walker']), 'walker')} {verb}"
    if case.boundary.tilt:
        event = f"{subject} faster and faster and will turn over after the end of the run"
    else:
        event = (
            f"{subject} away from the drive axis faster and faster, "
            f"by 45° after about {longest:.2g} s more"
        )
        grow = np.concatenate([gait.small_angles_grow(group) for group in groups])
        small = int(grow[not_turned].sum())
        if small == 1:
            event += "; the small angle of 1 other grows too"
        elif small:
            event += f"; the small angles of {small} others grow too"
    return f"{event}: set run.cycles = {recommended_cycles:.0f}"


def _stacked(parts: Sequence[Columns]) -> Columns:
    """Concatenate tables of several kinds of walkers; columns that a kind does not have are NaN."""
    names: dict[str, None] = {}  # in their order
    for part in parts:
        names |= dict.fromkeys(part)
    stacked = {}
    for name in names:
        columns = []
        for part in parts:
            missing = np.full(len(part["walker"]), nan)
            columns.append(part.get(name, missing))
        stacked[name] = np.concatenate(columns)
    return stacked


def tables_of(group: Group) -> dict[str, Columns]:
    """Make the tables of the walkers of one kind.

    Parameters
    ----------
    group
        Walkers of one kind.

    Returns
    -------
    dict of str to columns
        The tables ``trajectory`` (a row per walker and frame), ``walkers`` (a row per walker) and
        ``cycles`` (a row per walker and cycle), sorted by walker. Values are in SI units, angles in
        rad; the columns are described in ``quantities.toml``.
    """
    averages = gait.averages(group)
    return {
        "trajectory": _trajectory_table(group),
        "walkers": _walkers_table(group, averages),
        "cycles": _cycles_table(group, averages),
    }


def _trajectory_table(group: Group) -> Columns:
    """Table ``trajectory``: place, orientation and velocities of walkers in each frame."""
    beads = len(group.radii)
    course = gait.gait(group)
    x, y, z = np.moveaxis(group.mass_centre, -1, 0)
    columns = {
        "time": group.time,
        "cycle": group.time * group.case.excitation.frequency,
        "x": x,
        "y": y,
        "z": z,
        "orientation": group.orientation,
        "velocity": course.velocity,
    }
    columns |= numbered_columns("rotation", course.rotation)
    columns |= _columns_of_contacts("sliding", course.sliding, beads)
    columns |= _columns_of_contacts("gap", group.gap, beads)
    return _one_walker_after_another(group, columns)


def _walkers_table(group: Group, averages: gait.Averages) -> Columns:
    """Table ``walkers``: start and end of each walker, and means over the cycles after settling.

    Values are in SI units, angles in rad. ``separated_fraction`` is the share of the samples in
    which a gap between two beads of the walker is above their rupture distance.
    """
    beads = len(group.radii)
    pairs = slice(beads, None)  # of the contacts: those of beads with walls come first
    samples = gait.settled_samples(group.case.run)
    loads_of_pairs = contact_loads(group.case, group.kind)[pairs]
    rupture_distance = np.array([load.rupture for load in loads_of_pairs])
    separated = (group.gap[samples, :, pairs] > rupture_distance).any(axis=-1)
    columns = {
        "walker": group.walker_numbers,
        "make": np.array([walker.kind for walker in group.walkers]),
        "facing": group.facing,
        "start_angle": np.array([walker.start_angle for walker in group.walkers]),
    }
    columns |= gait.measure_walk(group)
    columns |= {
        "orientation_mean": group.orientation[samples].mean(axis=0),
        "orientation_end": group.orientation[-1],
        "turned_at": group.turned_at,
        "separated_fraction": separated.mean(axis=0),
    }
    columns |= numbered_columns("rotation", averages.rotation)
    columns |= _columns_of_contacts("sliding", averages.sliding, beads)
    columns |= _columns_of_contacts("open", averages.open, beads)
    return columns


def _cycles_table(group: Group, averages: gait.Averages) -> Columns:
    """Table ``cycles``: place and orientation at the start of each cycle, and the work in it."""
    run = group.case.run
    frames_per_cycle = run.samples_per_cycle
    time, distance = gait.distance_walked(group)
    displacement = group.mass_centre[::frames_per_cycle] - group.mass_centre[0]
    work = np.full(distance.shape, nan)
    work[: len(averages.work)] = averages.work
    columns = {
        "cycle": np.arange(len(time)) * run.cycles_per_sample,
        "time": time,
        "distance": distance,
        "along": displacement @ group.drive_axis,
        "across": displacement @ group.across_axis,
        "orientation": group.orientation[::frames_per_cycle],
        "work": work,
    }
    return _one_walker_after_another(group, columns)


def _one_walker_after_another(group: Group, columns: Columns) -> Columns:
    """Flatten columns of shape (F,) or (F, W) to F rows for each walker; add ``walker``."""
    frames = len(next(iter(columns.values())))
    shape = (frames, len(group.walkers))
    rows = {"walker": np.broadcast_to(group.walker_numbers, shape).T.reshape(-1)}
    for name, values in columns.items():
        wide = values if values.ndim > 1 else np.broadcast_to(values[:, None], shape)
        rows[name] = wide.T.reshape(-1)
    return rows


def _columns_of_contacts(name: str, values: FloatArray, beads: int) -> Columns:
    """Columns of values at contacts: the last axis has those of the beads, then of the pairs.

    Contacts of beads with walls have the columns ``name_1``, ``name_2``, …, contacts of pairs of
    beads ``name_pair_1``, ``name_pair_2``, ….
    """
    columns = numbered_columns(name, values[..., :beads])
    columns |= numbered_columns(f"{name}_pair", values[..., beads:])
    return columns


def _bridges(motion: Motion) -> Columns:
    """Table ``bridges``: its rows are sorted by time, walker, contact and second bead."""
    contact_numbers = _contact_numbers(motion)
    parts = []
    for bridges in motion.bridges:
        frames = np.full(len(bridges), bridges.frame)
        parts.append({"frame": frames, **bridges.rows()})
    rows = {}
    for name in parts[0]:
        rows[name] = np.concatenate([part[name] for part in parts])
    frame = rows.pop("frame")
    first = rows["bead_1"]
    second = rows["bead_2"]
    contacts = zip(first.tolist(), second.tolist(), strict=True)
    walker = motion.walker_of[first]
    second_walker = np.where(second >= 0, motion.walker_of[second], walker)
    columns = {
        "time": motion.time[frame],
        "walker": walker,
        "contact": np.array([contact_numbers.get(contact, 0) for contact in contacts]),
        "other_walker": np.where(second_walker == walker, -1, second_walker),
    }
    columns |= rows
    order = np.lexsort([columns[name] for name in ("bead_2", "contact", "walker", "time")])
    return {name: values[order] for name, values in columns.items()}


def _contact_numbers(motion: Motion) -> dict[tuple[int, int], int]:
    """Number of each contact within its walker, from 1, by its beads; a wall is the bead −1."""
    numbers: dict[tuple[int, int], int] = {}
    for walker in motion.walkers:
        contacts = [(bead, -1) for bead in walker.beads]
        pairs = motion.case.walkers[walker.kind].pairs
        contacts += [(walker.beads[lower], walker.beads[upper]) for lower, upper in pairs]
        numbers |= {contact: number for number, contact in enumerate(contacts, 1)}
    return numbers


def _mean(values: FloatArray) -> float:
    """Mean of the finite values; NaN if no value is finite."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return nan
    return float(finite.mean())


def _scatter(values: FloatArray) -> float:
    """Standard deviation over copies; NaN for a single one."""
    if len(values) <= 1:
        return nan
    return float(np.std(values, ddof=1))


def _velocities(walkers: Columns, case: Case) -> dict[str, Any]:
    """Velocities (m/s), orientations (rad) and counts of all walkers in a table ``walkers``."""
    velocity = walkers["velocity"]
    axial = walkers["axial_velocity"]
    end = walkers["orientation_end"]
    facing = sides(walkers["facing"], walkers["start_angle"])
    right = facing > 0
    left = facing < 0
    averaged = same_heading(walkers, uphill=case.goes_uphill)
    averaged_velocity = velocity[averaged]
    # In a mean over both headings, velocities along the drive axis cancel. On a tray they should.
    averaged_axial = axial[same_heading(walkers, uphill=case.goes_uphill or not case.meets)]
    right_facing = _mean(velocity[right])
    left_facing = _mean(velocity[left])
    separated = _mean(walkers["separated_fraction"])
    # On trays the means include walkers that stopped; by symmetry, both headings are one.
    one_heading = case.meets or _is_symmetric(case)
    return {
        "velocity": float(averaged_velocity.mean()),
        "scatter": _scatter(averaged_velocity),
        "smallest": float(averaged_velocity.min()),
        "largest": float(averaged_velocity.max()),
        "right_facing": right_facing,
        "left_facing": left_facing,
        "right_scatter": _scatter(velocity[right]),
        "left_scatter": _scatter(velocity[left]),
        "axial_velocity": _mean(averaged_axial),
        "axial_left_facing": _mean(axial[left]),
        "lateral_velocity": _mean(walkers["lateral_velocity"]),
        "separated_fraction": separated,
        "orientation_end": float(end.mean()),
        "orientation_smallest": float(end.min()),
        "orientation_largest": float(end.max()),
        "walkers": len(velocity),
        "facing_right": int(np.sum(right)),
        "facing_left": int(np.sum(left)),
        "steady": int(np.sum(walkers["steady"])),
        "turned_round": int(np.sum(np.isfinite(walkers["turned_at"]))),
        "depends_on_start": _depends_on_start(walkers, facing, case),
        "came_apart": separated > SEPARATED and not case.meets,
        "facings_differ": not one_heading and differ(right_facing, left_facing),
    }


def _work(groups: Sequence[Group], cycles: Columns, walkers: Columns) -> dict[str, float]:
    """Mean work of the drive per cycle, and the cost of transport.

    The cost is f W / (M g |v|), with the work W per cycle, the frequency f, the mass M and the
    velocity v along the heading. It is the power of the drive over the power of lifting the walker
    as fast as it walks. It is NaN for walkers slower than `STEADY_SPEED`.

    Parameters
    ----------
    groups
        The walkers of each kind.
    cycles, walkers
        The tables ``cycles`` and ``walkers`` of all kinds.

    Returns
    -------
    dict of str to float
        ``work`` (J) and ``cost_of_transport``, means over the walkers that `same_heading` chooses.
    """
    case = groups[0].case
    work_of_cycles = cycles["work"].reshape(len(walkers["walker"]), -1).T
    settled_work = np.ascontiguousarray(work_of_cycles)[case.run.settled_strobes : -1]
    work = settled_work.mean(axis=0)
    speed = np.abs(walkers["velocity"])
    speed = np.where(speed < STEADY_SPEED, nan, speed)
    mass_of_kinds = np.array([gait.mass_of(group) for group in groups])
    mass = mass_of_kinds[walkers["make"]]
    lifting_work = mass * ACCELERATION_OF_ONE_G * speed / case.excitation.frequency
    cost = work / lifting_work
    averaged = same_heading(walkers, uphill=case.goes_uphill)
    return {"work": _mean(work[averaged]), "cost_of_transport": _mean(cost[averaged])}


def _is_symmetric(case: Case) -> bool:
    """Tell whether both directions along the drive axis are the same for boundary and drive."""
    drive = case.excitation
    return (
        not case.boundary.tilt
        and len(drive.harmonics) == 1
        and abs(drive.direction[2]) in (0.0, 1.0)
    )


def _depends_on_start(walkers: Columns, facing: IntArray, case: Case) -> bool:
    """Tell whether steady walkers of one kind differ in their velocities.

    Only walkers of one heading are compared, unless boundary and drive are symmetric. Walkers that
    turned round or came apart do not count.
    """
    if case.meets:
        return False
    stayed_together = walkers["separated_fraction"] < SEPARATED
    compared = walkers["steady"] & np.isnan(walkers["turned_at"]) & stayed_together
    class_of_walker = 2 * walkers["make"]
    if not _is_symmetric(case):
        class_of_walker = class_of_walker + (facing > 0)
    for number in set(class_of_walker[compared].tolist()):
        velocity = walkers["velocity"][compared & (class_of_walker == number)]
        if differ(float(velocity.min()), float(velocity.max())):
            return True
    return False


def _posture(groups: Iterable[Group], walkers: Columns) -> dict[str, Any]:
    """Count the walkers on a slope by posture and by direction, and give the times of turning over.

    ``turned_first`` and ``turned_last`` are in s. ``ends_within`` (rad) is the largest final angle
    of the walkers that did not turn over.
    """
    counts: Counter[str] = Counter()
    for group in groups:
        counts.update(gait.postures(group))
    uphill = walkers["axial_velocity"]
    turned_at = walkers["turned_at"]
    turning_times = turned_at[np.isfinite(turned_at)]
    final_angles = np.abs(walkers["orientation_end"])[np.isnan(turned_at)]
    return {
        "upright": counts["upright"],
        "leaning": counts["leaning"],
        "turned_over": counts["turned_over"],
        "climbing": int(np.sum(uphill > REST)),
        "descending": int(np.sum(uphill < -REST)),
        "turned_first": float(min(turning_times, default=nan)),
        "turned_last": float(max(turning_times, default=nan)),
        "ends_within": float(max(final_angles, default=nan)),
    }


def walkers_met(groups: Sequence[Group]) -> bool:
    """Tell whether two walkers came so close to each other that they are not independent.

    Parameters
    ----------
    groups
        The walkers of each kind. Their centres of mass are compared once per cycle.
    """
    frames_per_cycle = groups[0].case.run.samples_per_cycle
    centres = []
    longest = 0.0
    for group in groups:
        centres.append(group.mass_centre[::frames_per_cycle, :, :2])
        longest = max(longest, group.kind.length)
    return came_near(np.concatenate(centres, axis=1), NEAR * longest)
