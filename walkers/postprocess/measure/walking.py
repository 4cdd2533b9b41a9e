"""Analysis of walkers: velocity, rotation, sliding, orientation.

The result follows the protocol of the paper: a velocity is the mean over copies, its error bar the largest minus the
smallest; walkers that start facing left and right are also averaged separately. The copies differ only in how they
start: their scatter is not an uncertainty of the velocity.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
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
"""Cycles of a run in which walkers turn over, over those until they have turned by 90°."""
_OF_BEADS = ("rotation_", "sliding_", "open_")


def applies(case: Case) -> bool:
    """Whether a case has walkers."""
    return bool(case.walkers)


def derived(case: Case) -> dict[str, float]:
    """Numbers of dimers that follow from the case; of larger clusters the radii of two beads."""
    first, second = case.walkers[0].radii[:2]
    radii = {"radius_1": first, "radius_2": second}
    if len(case.walkers[0].radii) > 2:
        return radii
    dimer = dimer_of(case)
    gamma0 = dimer.gamma0(case.excitation.peak_acceleration)
    return {
        "gamma0": gamma0,
        "sin_delta": dimer.sin_delta,
        "mass_asymmetry": dimer.mass_asymmetry,
        **radii,
    }


def measure(motion: Motion) -> Measurement:
    """Tables and numbers of all walkers; rotation, sliding and contacts are those of the first kind."""
    case, groups = motion.case, motion.groups
    of_makes = [tables_of(group) for group in groups]
    tables = {name: _stacked([tables[name] for tables in of_makes]) for name in of_makes[0]}
    walkers, first = tables["walkers"], of_makes[0]["walkers"]
    first_up = same_heading(first, uphill=case.goes_uphill)
    numbers = {
        **_velocities(walkers, case),
        **{
            name: _mean(values[first_up])
            for name, values in first.items()
            if name.startswith(_OF_BEADS)
        },
        "walkers_met": walkers_met(groups),
        "meets": case.meets,
        "cycles": case.run.cycles,
        "settling_cycles": case.run.settling_cycles,
        "ended_early": motion.ended_early,
    }
    if case.goes_uphill:
        numbers |= _posture(groups, walkers)
    if motion.follows_cycles:
        numbers |= _work(groups, tables["cycles"], walkers)
    for number, of_make in (
        enumerate([tables["walkers"] for tables in of_makes], 1) if len(groups) > 1 else ()
    ):
        velocity = of_make["velocity"][same_heading(of_make, uphill=case.goes_uphill)]
        numbers[f"velocity_make_{number}"] = float(velocity.mean())
        numbers[f"walkers_make_{number}"] = len(of_make["velocity"])
        numbers[f"steady_make_{number}"] = int(np.sum(of_make["steady"]))
    doubts = (*_doubts(numbers, changes=case.excitation.changes), *_turning(groups, walkers))
    return Measurement({**tables, "bridges": _bridges(motion)}, numbers, doubts)


def _doubts(numbers: Mapping[str, Any], *, changes: bool) -> Iterable[str]:
    """Reasons to doubt the velocity; on trays walkers stop, and the drive may change."""
    lacking = numbers["walkers"] - numbers["steady"]
    if lacking and not (numbers["meets"] or numbers["came_apart"] or changes):
        unsteady = f"{lacking} of {numbers['walkers']} walkers {'is' if lacking == 1 else 'are'} not steady"
        yield f"{unsteady}: the velocity depends on the length of the run"
    if numbers["came_apart"]:
        share = percent(round(numbers["separated_fraction"], 2))
        yield f"walkers came apart: beads are beyond the rupture distance for {share} of the time"
    if numbers["depends_on_start"] and not changes:
        yield f"steady copies differ by more than {percent(SAME)}: the velocity depends on the start"
    if numbers["walkers_met"] and not numbers["meets"]:
        yield "walkers came close to each other and are not independent: increase the spacing"


def _turning(groups: Sequence[Group], walkers: Columns) -> Iterable[str]:
    """A warning if walkers turn away from the drive axis, or will turn over on a slope, but have not yet."""
    case = groups[0].case
    not_turned = np.isnan(walkers["turned_at"])
    left = np.concatenate([gait.turns_away_after(group) for group in groups])[not_turned]
    if (count := int(np.isfinite(left).sum())) and not (case.meets or case.excitation.changes):
        seconds = float(np.nanmax(left))
        cycles = float(f"{_LONGER * (case.run.cycles + case.excitation.frequency * seconds):.2g}")
        turn = f"{count} of {counted(len(walkers['walker']), 'walker')} {'turns' if count == 1 else 'turn'}"
        away = f"{turn} away from the drive axis faster and faster, by 45° after about {seconds:.2g} s more"
        small = int(
            np.concatenate([gait.small_angles_grow(group) for group in groups])[not_turned].sum()
        )
        if small == 1:
            away += "; the small angle of 1 other grows too"
        elif small:
            away += f"; the small angles of {small} others grow too"
        if case.boundary.tilt:
            away = f"{turn} faster and faster and will turn over after the end of the run"
        yield f"{away}: set run.cycles = {cycles:.0f}"


def _stacked(parts: Sequence[Columns]) -> Columns:
    """Concatenated tables; missing columns are NaN."""
    lengths = [len(part["walker"]) for part in parts]
    keys = dict.fromkeys(key for part in parts for key in part)
    return {
        key: np.concatenate(
            [part.get(key, np.full(rows, nan)) for part, rows in zip(parts, lengths, strict=True)]
        )
        for key in keys
    }


def tables_of(group: Group) -> dict[str, Columns]:
    """Tables ``trajectory``, ``walkers`` and ``cycles`` of the walkers of one kind, one walker after the other."""
    run, seen, mean = group.case.run, gait.gait(group), gait.averages(group)
    samples, beads = gait.settled_samples(run), len(group.radii)
    reach = np.array([load.rupture for load in contact_loads(group.case, group.kind)[beads:]])
    placed = group.walkers
    walkers = {
        "walker": np.array([walker.walker for walker in placed]),
        "make": np.array([walker.kind for walker in placed]),
        "facing": np.array([walker.facing for walker in placed]),
        "start_angle": np.array([walker.start_angle for walker in placed]),
        **gait.measure_walk(group),
        "orientation_mean": group.orientation[samples].mean(axis=0),
        "orientation_end": group.orientation[-1],
        "turned_at": group.turned_at,
        "separated_fraction": (group.gap[samples, :, beads:] > reach).any(axis=-1).mean(axis=0),
        **numbered_columns("rotation", mean.rotation),
        **_by_kind(beads, sliding=mean.sliding, open=mean.open),
    }
    along = {
        "time": group.time,
        "cycle": group.time * group.case.excitation.frequency,
        **dict(zip("xyz", np.moveaxis(group.mass_centre, -1, 0), strict=True)),
        "orientation": group.orientation,
        "velocity": seen.velocity,
        **numbered_columns("rotation", seen.rotation),
        **_by_kind(beads, sliding=seen.sliding, gap=group.gap),
    }
    strobe = run.samples_per_cycle
    time, distance = gait.distance_walked(group)
    displacement = group.mass_centre[::strobe] - group.mass_centre[0]
    work = np.full(distance.shape, nan)
    work[: len(mean.work)] = mean.work
    cycles = {
        "cycle": np.arange(len(time)) * run.cycles_per_sample,
        "time": time,
        "distance": distance,
        "along": displacement @ group.drive_axis,
        "across": displacement @ group.across_axis,
        "orientation": group.orientation[::strobe],
        "work": work,
    }
    return {
        "trajectory": _of_frames(group, along),
        "walkers": walkers,
        "cycles": _of_frames(group, cycles),
    }


def _of_frames(group: Group, columns: Columns) -> Columns:
    """Columns of values in F frames, shape (F,) or (F, W), one walker after the other."""
    number, shape = (
        [walker.walker for walker in group.walkers],
        (len(next(iter(columns.values()))), len(group.walkers)),
    )
    wide = {"walker": np.broadcast_to(number, shape)} | {
        name: values if values.ndim > 1 else np.broadcast_to(values[:, None], shape)
        for name, values in columns.items()
    }
    return {name: values.T.reshape(-1) for name, values in wide.items()}


def _by_kind(beads: int, **contacts: FloatArray) -> Columns:
    """Columns of values at contacts (as in `gait.Gait`): of beads with walls, and ``…_pair_…`` of pairs of beads."""
    columns: Columns = {}
    for name, values in contacts.items():
        columns |= numbered_columns(name, values[..., :beads]) | numbered_columns(
            f"{name}_pair", values[..., beads:]
        )
    return columns


def _bridges(motion: Motion) -> Columns:
    """Rows sorted by time, walker and contact; in a frame bridges between beads are before those to walls."""
    contact_of: dict[tuple[int, int], int] = {}  # by two beads, or by a bead and −1 for a wall
    for walker in motion.walkers:
        touching = [(bead, -1) for bead in walker.beads]
        pairs = motion.case.walkers[walker.kind].pairs
        touching += [(walker.beads[lower], walker.beads[upper]) for lower, upper in pairs]
        contact_of |= {ends: number for number, ends in enumerate(touching, 1)}
    parts = [
        {"frame": np.full(len(bridges), bridges.frame), **bridges.rows()}
        for bridges in motion.bridges
    ]
    rows = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    first, second = rows["bead_1"], rows["bead_2"]
    owner = motion.walker_of[first]
    joined = np.where(second >= 0, motion.walker_of[second], owner)
    columns = {
        "time": motion.time[rows.pop("frame")],
        "walker": owner,
        "contact": np.array(
            [contact_of.get(ends, 0) for ends in zip(first.tolist(), second.tolist(), strict=True)]
        ),
        "other_walker": np.where(joined == owner, -1, joined),
        **rows,
    }
    order = np.lexsort([columns[name] for name in ("bead_2", "contact", "walker", "time")])
    return {name: values[order] for name, values in columns.items()}


def _mean(values: FloatArray) -> float:
    """Mean of the finite values; NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else nan


def _scatter(values: FloatArray) -> float:
    """Standard deviation over copies; NaN for a single one."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else nan


def _velocities(walkers: Columns, case: Case) -> dict[str, Any]:
    velocity, axial, end = (
        walkers["velocity"],
        walkers["axial_velocity"],
        walkers["orientation_end"],
    )
    facing = sides(walkers["facing"], walkers["start_angle"])
    right, left = facing > 0, facing < 0
    meant = velocity[same_heading(walkers, uphill=case.goes_uphill)]
    separated = _mean(walkers["separated_fraction"])
    # On trays the means include walkers that stopped; by symmetry, both headings are one.
    one_heading = case.meets or _is_symmetric(case)
    facings = _mean(velocity[right]), _mean(velocity[left])
    return {
        "velocity": float(meant.mean()),
        "scatter": _scatter(meant),
        "smallest": float(meant.min()),
        "largest": float(meant.max()),
        "right_facing": facings[0],
        "left_facing": facings[1],
        "right_scatter": _scatter(velocity[right]),
        "left_scatter": _scatter(velocity[left]),
        "axial_velocity": _mean(
            axial[same_heading(walkers, uphill=case.goes_uphill or not case.meets)]
        ),
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
        "facings_differ": not one_heading and differ(*facings),
    }


def _work(groups: Sequence[Group], cycles: Columns, walkers: Columns) -> dict[str, float]:
    """Mean work of the drive per cycle, and cost of transport f W / (M g |v|) with the velocity v along the heading.

    The cost is the power of the drive over the power of lifting the walker as fast as it walks; walkers that hardly
    walk have none.
    """
    case = groups[0].case
    of_cycles = np.ascontiguousarray(cycles["work"].reshape(len(walkers["walker"]), -1).T)
    work, speed = of_cycles[case.run.settled_strobes : -1].mean(axis=0), np.abs(walkers["velocity"])
    speed = np.where(speed < STEADY_SPEED, nan, speed)
    mass = np.array([gait.mass_of(group) for group in groups])[walkers["make"]]
    lifted = mass * ACCELERATION_OF_ONE_G * speed / case.excitation.frequency
    meant = same_heading(walkers, uphill=case.goes_uphill)
    return {"work": _mean(work[meant]), "cost_of_transport": _mean((work / lifted)[meant])}


def _is_symmetric(case: Case) -> bool:
    drive = case.excitation
    return (
        not case.boundary.tilt
        and len(drive.harmonics) == 1
        and abs(drive.direction[2]) in (0.0, 1.0)
    )


def _depends_on_start(walkers: Columns, facing: IntArray, case: Case) -> bool:
    """Whether steady walkers of one kind differ; both directions are one if boundary and drive are symmetric."""
    kept = (
        walkers["steady"]
        & np.isnan(walkers["turned_at"])
        & (walkers["separated_fraction"] < SEPARATED)
    )
    kind = 2 * walkers["make"] + (0 if _is_symmetric(case) else facing > 0)
    velocities = (
        walkers["velocity"][kept & (kind == number)] for number in set(kind[kept].tolist())
    )
    return not case.meets and any(
        differ(float(same_heading.min()), float(same_heading.max())) for same_heading in velocities
    )


def _posture(groups: Iterable[Group], walkers: Columns) -> dict[str, Any]:
    """Numbers of walkers by posture and way, times of turning over (s), largest final angle of the others (rad)."""
    counts = Counter(posture for group in groups for posture in gait.postures(group))
    turned_at, end = walkers["turned_at"], np.abs(walkers["orientation_end"])
    uphill = walkers["axial_velocity"]
    over, kept = turned_at[np.isfinite(turned_at)], end[np.isnan(turned_at)]
    return {
        **{name: counts[name] for name in ("upright", "leaning", "turned_over")},
        "climbing": int(np.sum(uphill > REST)),
        "descending": int(np.sum(uphill < -REST)),
        "turned_first": float(min(over, default=nan)),
        "turned_last": float(max(over, default=nan)),
        "ends_within": float(max(kept, default=nan)),
    }


def walkers_met(groups: Sequence[Group]) -> bool:
    """Whether two walkers came so close that they are not independent."""
    centres = [group.mass_centre[:: group.case.run.samples_per_cycle, :, :2] for group in groups]
    return came_near(
        np.concatenate(centres, axis=1), NEAR * max(group.kind.length for group in groups)
    )
