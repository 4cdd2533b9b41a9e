"""How walkers walk: velocities, rotation and sliding, contacts, work of the drive, posture; steady, constant or not.

Velocities are relative to the substrate and along the heading e, from the small bead to the large one. With the normal
z of the substrate and the angular velocity ω of a bead, the rotation velocity is R ω·(z × e), the paper's −R dφ/dt
(Fig. 4), and the sliding velocity at the substrate is v·e − R ω·(z × e), its R dφ/dt + v_x. Between two beads the
sliding velocity is R1 dφ1/dt + R2 dφ2/dt about the level line perpendicular to the line between their centres. A bead
slides on its nearest wall, whose normal replaces z.

In the frame of the walls, which have the acceleration a(t), an inertial force -M a(t) acts at the mass centre of a
walker. Its work per cycle is W = -M ∮ a · dx along the path x of the mass centre relative to the walls. Friction,
bridges and collisions of a steady walker dissipate this work; in the laboratory it is the work of the walls' forces. If
a walker turns or is not steady, the two differ; the results are those of the inertial force. Compared with 200 samples
per cycle, the work with 20 samples is within 0.01 %, with 10 samples within 0.2 %.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, pairwise
from math import pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walkers.arrays import BoolArray, FloatArray
from walkers.inputs.tables.run import CONSTANT, RunSettings
from walkers.postprocess.measure.dump import DumpError
from walkers.postprocess.measure.motion import Group, interpolated_positions, read_motion
from walkers.postprocess.measure.sides import REST, STEADY_SPEED
from walkers.postprocess.measure.tables import Columns

STEADY_DIFFERENCE = 0.05
"""A walker is steady if the velocities of the two halves of the measured cycles differ by less than this share, or by
a hundredth of a millimetre per second."""
UPRIGHT = np.radians(15.0)
"""Largest final angle of an upright walker, rad."""
_NO_MORE = np.radians(0.5)
"""Largest increase of its angle in the second half of a run, rad."""
_LITTLE, _FADING, _NO_FASTER = 0.005, 0.9, 1e-4
"""A velocity is constant only if the walker stops turning. Its largest rotation per cycle in the second half of the run
must be below the first angle (rad) and exceed that in the first half by less than the third angle; or it must be at
most the second number times that in the first half."""
LEAST_GROWTH_RATE = 0.05
"""Rate above which small angles to the axis count as growing, 1/s: by half in ten seconds."""
_NOTHING, _LITTLE_ASIDE = 1e-4, np.radians(0.8)
"""Increase of the mean angle, rad, that counts as none; on a level floor, a mean angle, rad, from which it goes on:
rolling friction may let smaller angles grow and larger ones decay, so that glass beads on PTFE stay at 0.76°."""
_PARTS = 10
"""Parts of an interval between samples at which gaps and the force of the drive are evaluated."""


class Gait(NamedTuple):
    """Velocity along the heading, shape (F, W), and rotation velocities of the beads, shape (F, W, n), m/s.

    Sliding velocity, m/s, at the contacts of beads with walls, then of their pairs, shape (F, W, n + pairs).
    """

    velocity: FloatArray
    rotation: FloatArray
    sliding: FloatArray


def gait(group: Group) -> Gait:
    """Velocity, rotation and sliding through the run."""
    radii, heading, upward = group.radii, group.heading, np.array([0.0, 0.0, 1.0])
    along = np.einsum("fwbx,fwx->fwb", group.velocity, heading)
    rotation = radii * np.einsum("fwbx,fwx->fwb", group.spin, np.cross(upward, heading))
    turning = rotation if group.case.boundary.bare else radii * np.einsum(
        "fwbx,fwbx->fwb", group.spin, np.cross(_normals(group), heading[:, :, None])
    )  # fmt: skip
    sliding = [along - turning]
    for first, second in group.kind.pairs:
        arm = group.position[:, :, first] - group.position[:, :, second]
        arm[..., 2] = 0.0
        arm *= np.where(np.einsum("fwx,fwx->fw", arm, heading) < 0.0, -1.0, 1.0)[..., None]
        arm /= np.maximum(np.linalg.norm(arm, axis=-1, keepdims=True), 1e-300)
        spin = radii[first] * group.spin[:, :, first] + radii[second] * group.spin[:, :, second]
        sliding.append(-np.einsum("fwx,fwx->fw", spin, np.cross(upward, arm))[..., None])
    velocity = along @ (radii**3 / np.sum(radii**3))
    return Gait(velocity, rotation, np.concatenate(sliding, axis=-1))


def _normals(group: Group) -> FloatArray:
    """Normal of the wall that is nearest to each bead, shape (F, W, n, 3)."""
    walls, position = group.case.boundary.walls, group.position
    nearest = np.argmin([wall.distances(position) for wall in walls], axis=0)
    normals = np.stack([wall.normals(position) for wall in walls])
    normal: FloatArray = np.take_along_axis(normals, nearest[None, ..., None], axis=0)[0]
    return normal


class Averages(NamedTuple):
    """Means over the measured cycles: rotation, sliding (m/s), share of the time with open contacts, as in `Gait`.

    Work on each walker in each cycle, J, shape (cycles, W), NaN if the frames do not resolve a cycle.
    """

    rotation: FloatArray
    sliding: FloatArray
    open: FloatArray
    work: FloatArray


def averages(group: Group) -> Averages:
    """Mean rotation and sliding, share of open contacts, and work.

    Means over 20 samples per cycle have errors up to 10 % if contacts open, because spins change within few steps when
    beads touch. Therefore spins are averages of the engine over all steps, velocities are displacements, and gaps and
    work are evaluated ten times per interval by cubic interpolation (gaps at the samples, if they are few).
    """
    run, samples = group.case.run, settled_samples(group.case.run)
    parts = _PARTS if group.motion.follows_cycles else 1
    opened, begin, interval = [], group.time[:-1], np.diff(group.time)
    work = np.full((len(interval), len(group.walkers)), 0.0 if parts > 1 else np.nan)
    shares = np.linspace(0.0, 1.0, parts + 1).tolist()[1:]
    looks = chain(
        [group], (replace(group, position=interpolated_positions(group, share)) for share in shares)
    )
    for part, (before, after) in enumerate(pairwise(looks)):
        opened.append((before.gap[samples] > 0.0).mean(axis=0))
        for direction, course in group.case.excitation.motions(
            begin + (part + 0.5) / parts * interval
        ):
            pull, displacement = (
                -course[-1],
                after.mass_centre - before.mass_centre[: len(interval)],
            )
            work += pull[:, None] * (displacement @ np.array(direction))
    cycles = len(work) // run.samples_per_cycle
    of_cycles = (
        work[: cycles * run.samples_per_cycle]
        .reshape(cycles, run.samples_per_cycle, -1)
        .sum(axis=1)
    )
    mean = gait(group.motion.averaged.group(group.walkers[0].kind))
    return Averages(
        rotation=mean.rotation[samples].mean(axis=0),
        sliding=mean.sliding[samples].mean(axis=0),
        open=np.mean(opened, axis=0),
        work=mass_of(group) * of_cycles,
    )


def mass_of(group: Group) -> float:
    """Mass of a walker, kg."""
    return float(4.0 / 3.0 * pi * np.sum(group.radii**3) * group.case.beads.density)


def distance_walked(group: Group) -> tuple[FloatArray, FloatArray]:
    """Time (s, shape (cycles + 1,)) and distance along the heading (m, shape (cycles + 1, W)) at the end of each cycle.

    The displacement of each cycle is projected on the mean heading, so that a turning walker is followed on its curve.
    """
    strobe = group.case.run.samples_per_cycle
    centre, heading = group.mass_centre[::strobe], group.heading[::strobe]
    steps = np.einsum("fwx,fwx->fw", np.diff(centre, axis=0), (heading[1:] + heading[:-1]) / 2.0)
    return group.time[::strobe], np.concatenate(
        [np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)]
    )


def measure_walk(group: Group) -> Columns:
    """Velocities after the settling cycles as in the table ``walkers``, m/s, and whether both halves agree, shape (W,).

    They are slopes against time, one sample per cycle (`fit_slopes`): of the distance along the heading, and of the
    mass centre along and across the drive axis. `DumpError` if the dump was cut short within the settling cycles.
    """
    settled = group.case.run.settled_strobes
    time, distance = distance_walked(group)
    if len(time) < settled + 2:
        raise DumpError(
            f"the dump holds {len(time) - 1} cycles, no more than the {settled} settling ones"
        )
    time, distance = time[settled:], distance[settled:]
    velocity = first = second = fit_slopes(time, distance)
    middle = (len(time) + 1) // 2
    if middle >= 2:
        first = fit_slopes(time[:middle], distance[:middle])
        second = fit_slopes(time[middle - 1 :], distance[middle - 1 :])
    centre = group.mass_centre[:: group.case.run.samples_per_cycle][settled:]
    return {
        "velocity": velocity,
        "first_half": first,
        "second_half": second,
        "axial_velocity": fit_slopes(time, centre @ group.drive_axis),
        "lateral_velocity": fit_slopes(time, centre @ group.across_axis),
        "steady": np.abs(first - second)
        <= np.maximum(STEADY_DIFFERENCE * np.abs(velocity), STEADY_SPEED),
    }


def fit_slopes(time: FloatArray, values: FloatArray) -> FloatArray:
    """Slopes of the columns of ``values`` (shape (N, K)) against time (s, shape (N,)) by least squares, shape (K,)."""
    # Differences from the mean avoid rounding errors: positions reach metres, steps micrometres.
    time = time - time.mean()
    return np.asarray(time @ (values - values.mean(axis=0)) / np.sum(time**2))


def settled_samples(run: RunSettings) -> slice:
    """The samples of whole cycles after the settling ones; each phase occurs equally often."""
    samples = run.samples_per_cycle
    return slice(run.settled_strobes * samples, run.cycles // run.cycles_per_sample * samples)


def turns_away_after(group: Group) -> FloatArray:
    """Time after the end of the run, s, when walkers have turned away from the axis, shape (W,).

    NaN if they do not. Small angles grow exponentially: on a slope dψ/dt = rate · sin ψ, to 90°,
    where the walker has turned over; on a level floor, where both headings are alike,
    dψ/dt = rate · sin 2ψ / 2, to 45°. On a level floor, smaller angles than `_LITTLE_ASIDE` do not
    count, because rolling friction may hold them.
    """
    tilted = bool(group.case.boundary.tilt)
    growth = _growth_of_angles(group)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = -np.log(np.tan(growth.end / 2.0 if tilted else growth.end)) / growth.rate
    turns = growth.grows & (tilted | (growth.mean > _LITTLE_ASIDE))
    return np.where(turns & (left > 0.0), left, np.nan)


def small_angles_grow(group: Group) -> BoolArray:
    """Whether walkers on a level floor have an angle below `_LITTLE_ASIDE` that grows, shape (W,)."""
    if group.case.boundary.tilt:
        return np.zeros(len(group.walkers), dtype=bool)
    growth = _growth_of_angles(group)
    return np.asarray(growth.grows & (growth.mean <= _LITTLE_ASIDE))


class _Growth(NamedTuple):
    """How the angles of walkers to the axis grow, each of shape (W,)."""

    rate: FloatArray  # from the second to the last third of the measured cycles, 1/s
    mean: FloatArray  # of the last third, rad
    end: FloatArray  # at the end of the run, rad
    grows: BoolArray  # at more than `LEAST_GROWTH_RATE`, and faster than before


def _growth_of_angles(group: Group) -> _Growth:
    """The growth of the angles of walkers; none for runs with fewer than three measured cycles."""
    run = group.case.run
    angle = np.abs(group.orientation[:: run.samples_per_cycle][run.settled_strobes :])
    if len(angle) < 3:  # too few frames a second, or a dump that was cut short
        missing = np.full(len(group.walkers), np.nan)
        return _Growth(missing, missing, missing, np.zeros(len(group.walkers), dtype=bool))
    first, second, last = (part.mean(axis=0) for part in np.array_split(angle, 3))
    third = len(angle) / 3.0 * run.cycles_per_sample / group.case.excitation.frequency
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.log(last / second) / third
    grows = (rate > LEAST_GROWTH_RATE) & (last - second > np.maximum(second - first, _NOTHING))
    return _Growth(rate, last, angle[-1], grows)


def postures(group: Group) -> list[str]:
    """Posture of each walker on a slope or a wall: ``upright``, ``leaning`` or ``turned_over``.

    A walker with its large bead uphill can tip over like an inverted pendulum; then its velocity has no meaning. The
    angle is evaluated once per cycle. A walker has turned over if it turned by more than 90° from its start. It is
    upright if it ends less than 15° from the direction of facing and its angle increased by less than half a degree in
    the second half of the run. All others lean.
    """
    off = np.abs(group.orientation[:: group.case.run.samples_per_cycle])
    stands = (off[-1] <= UPRIGHT) & (off[-1] <= off[len(off) // 2] + _NO_MORE)
    turned = np.isfinite(group.turned_at)
    labels: list[str] = np.select([turned, stands], ["turned_over", "upright"], "leaning").tolist()
    return labels


def are_constant(directory: Path) -> bool:
    """Whether the velocities of a run, finished or not, are constant, so that it needs no more cycles.

    The velocities of both halves of the cycles after settling must agree, and no walker may turn at an increasing rate.
    Of 362 dimers of the shipped sweeps that ran for 60 cycles, those that were constant after 12 or 24 had speeds
    within 0.2 % of the final ones; without the criterion for turning some differed by 4 %.
    """
    return all(_is_constant(group) for group in read_motion(directory).groups)


def _is_constant(group: Group) -> bool:
    walked, run = measure_walk(group), group.case.run
    turned = np.abs(
        np.diff(group.orientation[:: run.samples_per_cycle][run.settled_strobes :], axis=0)
    )
    before, after = turned[: len(turned) // 2].max(axis=0), turned[len(turned) // 2 :].max(axis=0)
    little = (after < _LITTLE) & (after < before + _NO_FASTER)
    allowed = max(CONSTANT * float(np.abs(walked["velocity"]).max()), REST)
    agree = np.abs(walked["first_half"] - walked["second_half"]).max() <= allowed
    return bool(agree and np.all(little | (after < _FADING * before)))
