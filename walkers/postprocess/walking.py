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

from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads, dimer_of
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.cycles import cycles_of, mass_of
from walkers.postprocess.dump import FloatArray, IntArray
from walkers.postprocess.gait import (
    POSTURES,
    Averages,
    Gait,
    averages,
    gait,
    postures,
    settled_samples,
    turned_over_at,
    walk,
)
from walkers.postprocess.motion import LEAST_SAMPLES, NEAR, Bridges, Group, Motion, came_near
from walkers.postprocess.numbers import Measured
from walkers.postprocess.sides import REST, SAME, SEPARATED, STEADY_SPEED, alike, differ, sides
from walkers.postprocess.tables import Columns, numbered
from walkers.rounding import percent

NAME = "walking"
"""Group of its numbers, see `walkers.postprocess.quantities.GROUPS`."""


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
    return {"gamma0": gamma0, "sin_delta": dimer.sin_delta, "mass_asymmetry": dimer.mass_asymmetry, **radii}


def measure(motion: Motion) -> Measured:
    """Tables and numbers of all walkers; rotation, sliding and contacts are those of the first make."""
    case, groups = motion.case, motion.groups
    gaits, means = [gait(group) for group in groups], [averages(group) for group in groups]
    rows = [_rows(*parts) for parts in zip(groups, gaits, means, strict=True)]
    tables = {
        "trajectory": _stacked([_trajectory(*one) for one in zip(groups, gaits, strict=True)]),
        "walkers": _stacked(rows),
        "cycles": _stacked(cycles := [cycles_of(one, mean.centre) for one, mean in zip(groups, means, strict=True)]),
        "bridges": _bridges(motion),
    }
    numbers = {
        **_velocities(tables["walkers"], case),
        **_of_beads(rows[0], case),
        "walkers_met": walkers_met(groups),
        "meets": case.meets,
        "cycles": case.run.cycles,
        "settling_cycles": case.run.settling_cycles,
        "ended_early": motion.ended_early,
    }
    if case.goes_uphill:
        numbers |= _posture(groups, tables["walkers"])
    if case.run.samples_per_cycle >= LEAST_SAMPLES:
        numbers |= _work(groups, cycles, tables["walkers"])
    if len(groups) > 1:
        for number, one in enumerate(rows, 1):
            velocity = one["velocity"][alike(one, uphill=case.goes_uphill)]
            numbers[f"velocity_make_{number}"] = float(velocity.mean())
            numbers[f"walkers_make_{number}"] = len(one["velocity"])
            numbers[f"steady_make_{number}"] = int(np.sum(one["steady"]))
    return Measured(tables, numbers, tuple(_doubts(numbers)))


def _doubts(numbers: Mapping[str, Any]) -> Iterable[str]:
    """Reasons to doubt the velocity."""
    if (lacking := numbers["walkers"] - numbers["steady"]) and not numbers["meets"]:  # on trays walkers stop
        unsteady = f"{lacking} of {numbers['walkers']} walkers {'is' if lacking == 1 else 'are'} not steady"
        yield f"{unsteady}: the velocity depends on the length of the run"
    if numbers["depends_on_start"]:
        yield f"steady copies differ by more than {percent(SAME)}: the velocity depends on the start"
    if numbers["walkers_met"] and not numbers["meets"]:
        yield "walkers came close to each other and are not independent: increase the spacing"


def _stacked(parts: list[Columns]) -> Columns:
    """Concatenated tables; missing columns are NaN."""
    lengths = [len(part["walker"]) for part in parts]
    keys = dict.fromkeys(key for part in parts for key in part)
    return {
        key: np.concatenate([part.get(key, np.full(rows, nan)) for part, rows in zip(parts, lengths, strict=True)])
        for key in keys
    }


def _trajectory(group: Group, motion: Gait) -> Columns:
    """Rows of one walker after the other."""

    def along(values: FloatArray) -> FloatArray:
        return np.moveaxis(values, 0, 1).reshape(-1, *values.shape[2:])

    time = np.tile(group.time, len(group.walkers))
    return {
        "walker": np.repeat([walker.walker for walker in group.walkers], len(group.time)),
        "time": time,
        "cycle": time * group.case.excitation.frequency,
        **dict(zip("xyz", along(group.mass_centre).T, strict=True)),
        "orientation": along(group.orientation),
        "velocity": along(motion.velocity),
        **numbered("rotation", along(motion.rotation)),
        **_by_kind(group, sliding=along(motion.sliding), gap=along(motion.gap)),
    }


def _by_kind(group: Group, **contacts: FloatArray) -> Columns:
    """Columns of values at contacts (`Gait`): of beads with walls, and ``…_pair_…`` of pairs of beads."""
    beads = len(group.radii)
    columns: Columns = {}
    for name, values in contacts.items():
        columns |= numbered(name, values[..., :beads]) | numbered(f"{name}_pair", values[..., beads:])
    return columns


def _rows(group: Group, motion: Gait, mean: Averages) -> Columns:
    """Rows of the walkers of a group."""
    samples, beads = settled_samples(group), len(group.radii)
    reach = np.array([load.rupture for load in contact_loads(group.case, group.make)[beads:]])
    starts = ("walker", "make", "facing", "start_angle")
    return {
        **{name: np.array([getattr(walker, name) for walker in group.walkers]) for name in starts},
        **vars(walk(group)),
        "orientation_mean": group.orientation[samples].mean(axis=0),
        "orientation_end": group.orientation[-1],
        "turned_at": turned_over_at(group),
        "separated_fraction": (motion.gap[samples, :, beads:] > reach).any(axis=-1).mean(axis=0),
        **numbered("rotation", mean.rotation),
        **_by_kind(group, sliding=mean.sliding, open=mean.open),
    }


def _bridges(motion: Motion) -> Columns:
    """Rows sorted by time, walker and contact."""
    contact_of: dict[tuple[int, int], int] = {}  # by two beads, or by a bead and −1 for a wall
    for walker in motion.walkers:
        touching = [(bead, -1) for bead in walker.beads]
        touching += [(walker.beads[one], walker.beads[other]) for one, other in motion.case.walkers[walker.make].pairs]
        contact_of |= {ends: number for number, ends in enumerate(touching, 1)}
    parts = [_bridge_rows(motion, bridges, contact_of) for bridges in motion.bridges]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    order = np.lexsort([columns[name] for name in ("bead_2", "contact", "walker", "time")])
    return {name: values[order] for name, values in columns.items()}


def _bridge_rows(motion: Motion, bridges: Bridges, contact_of: Mapping[tuple[int, int], int]) -> Columns:
    """Rows of a frame: bridges between beads, then bridges to walls."""
    rows = bridges.rows()
    first, second = rows["bead_1"], rows["bead_2"]
    owner = motion.walker_of[first]
    joined = np.where(second >= 0, motion.walker_of[second], owner)
    ends = zip(first.tolist(), second.tolist(), strict=True)
    return {
        "time": np.full(len(first), motion.time[bridges.frame]),
        "walker": owner,
        "contact": np.array([contact_of.get(one, 0) for one in ends], dtype=np.int64),
        "other_walker": np.where(joined == owner, -1, joined),
        **rows,
    }


def _mean(values: FloatArray) -> float:
    """Mean of the finite values; NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else nan


def _scatter(values: FloatArray) -> float:
    """Standard deviation over copies; NaN for a single one."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else nan


def _velocities(walkers: Columns, case: Case) -> dict[str, Any]:
    """Numbers of all rows of the table of walkers."""
    velocity, axial, end = walkers["velocity"], walkers["axial_velocity"], walkers["orientation_end"]
    facing = sides(walkers["facing"], walkers["start_angle"])
    right, left = facing > 0, facing < 0
    meant = velocity[alike(walkers, uphill=case.goes_uphill)]
    separated = _mean(walkers["separated_fraction"])
    numbers = {
        "velocity": float(meant.mean()),
        "scatter": _scatter(meant),
        "smallest": float(meant.min()),
        "largest": float(meant.max()),
        "right_facing": _mean(velocity[right]),
        "left_facing": _mean(velocity[left]),
        "right_scatter": _scatter(velocity[right]),
        "left_scatter": _scatter(velocity[left]),
        "axial_velocity": _mean(axial[alike(walkers, uphill=case.goes_uphill or not case.meets)]),
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
    }
    # On trays the means include walkers that stopped; by symmetry, both headings are one.
    one_heading = case.meets or _is_symmetric(case)
    numbers["facings_differ"] = not one_heading and differ(numbers["right_facing"], numbers["left_facing"])
    return numbers


def _of_beads(walkers: Columns, case: Case) -> dict[str, float]:
    """Rotation, sliding and open contacts of the walkers of a make, on a slope of those that face up."""
    families, meant = ("rotation_", "sliding_", "open_"), alike(walkers, uphill=case.goes_uphill)
    return {name: _mean(one[meant]) for name, one in walkers.items() if name.startswith(families)}


def _work(groups: Sequence[Group], cycles: Sequence[Columns], walkers: Columns) -> dict[str, float]:
    """Mean work of the drive per cycle, and cost of transport f W / (M g |v|) with the velocity v along the heading.

    The cost is the power of the drive over the power of lifting the walker as fast as it walks; walkers that hardly
    walk have none.
    """
    case, each = groups[0].case, []
    for group, columns in zip(groups, cycles, strict=True):
        of_cycles = np.ascontiguousarray(columns["work"].reshape(len(group.walkers), -1).T)
        each.append(of_cycles[case.run.settled_strobes : -1].mean(axis=0))
    meant = alike(walkers, uphill=case.goes_uphill)
    work, speed = np.concatenate(each), np.abs(walkers["velocity"])
    speed = np.where(speed < STEADY_SPEED, nan, speed)
    mass = np.concatenate([np.full(len(group.walkers), mass_of(group)) for group in groups])
    lifted = mass * ACCELERATION_OF_ONE_G * speed / case.excitation.frequency
    return {"work": _mean(work[meant]), "cost_of_transport": _mean((work / lifted)[meant])}


def _is_symmetric(case: Case) -> bool:
    """Whether boundary and drive are the same for both headings."""
    drive = case.excitation.harmonics
    return not case.boundary.tilt and len(drive) == 1 and abs(drive[0].direction[2]) in (0.0, 1.0)


def _depends_on_start(walkers: Columns, facing: IntArray, case: Case) -> bool:
    """Whether steady walkers of one make differ; both directions are one if boundary and drive are symmetric."""
    kept = walkers["steady"] & np.isnan(walkers["turned_at"]) & (walkers["separated_fraction"] < SEPARATED)
    kind = 2 * walkers["make"] + (0 if _is_symmetric(case) else facing > 0)
    velocities = (walkers["velocity"][kept & (kind == one)] for one in set(kind[kept].tolist()))
    return not case.meets and any(differ(float(one.min()), float(one.max())) for one in velocities)


def _posture(groups: Iterable[Group], walkers: Columns) -> dict[str, Any]:
    """Numbers of walkers by posture and way, times of turning over (s), largest final angle of the others (rad)."""
    counts = Counter(posture for group in groups for posture in postures(group))
    turned_at, end = walkers["turned_at"], np.abs(walkers["orientation_end"])
    uphill = walkers["axial_velocity"]
    over, kept = turned_at[np.isfinite(turned_at)], end[np.isnan(turned_at)]
    return {
        **{name: counts[name] for name in POSTURES},
        "climbing": int(np.sum(uphill > REST)),
        "descending": int(np.sum(uphill < -REST)),
        "turned_first": float(over.min()) if len(over) else nan,
        "turned_last": float(over.max()) if len(over) else nan,
        "ends_within": float(kept.max()) if len(kept) else nan,
    }


def walkers_met(groups: Iterable[Group]) -> bool:
    """Whether two walkers came so close that they are not independent."""
    groups = list(groups)
    centre = np.concatenate([one.mass_centre[:: one.case.run.samples_per_cycle, :, :2] for one in groups], axis=1)
    return came_near(centre, NEAR * max(one.make.length for one in groups))
