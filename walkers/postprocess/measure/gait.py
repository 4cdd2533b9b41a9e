"""How walkers of one kind walk: velocities, rotation, sliding, contacts, work, posture, constancy.

Velocities are relative to the substrate and along the heading e, from the small bead to the large
one. With the normal z of the substrate and the angular velocity ω of a bead, the rotation velocity
is R ω·(z × e), the paper's −R dφ/dt (Fig. 4), and the sliding velocity at the substrate is
v·e − R ω·(z × e), its R dφ/dt + v_x. Between two beads, the sliding velocity is
R1 dφ1/dt + R2 dφ2/dt about the level line perpendicular to the line between their centres. A bead
slides on its nearest wall, whose normal replaces z.

In the frame of the walls, which have the acceleration a(t), an inertial force -M a(t) acts at the
mass centre of a walker. Its work per cycle is W = -M ∮ a · dx along the path x of the mass centre
relative to the walls. Friction, bridges and collisions of a steady walker dissipate this work; in
the laboratory it is the work of the walls' forces. If a walker turns or is not steady, the two
differ; the results are those of the inertial force. Compared with 200 samples per cycle, the work
with 20 samples is within 0.01 %, with 10 samples within 0.2 %.

`walkers.postprocess.measure.walking` makes tables and numbers of these quantities.
"""

from __future__ import annotations

from dataclasses import replace
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
"""Largest difference between the velocities of the two halves of the measured cycles of a steady
walker, over its velocity. Differences up to `STEADY_SPEED` count as none."""
UPRIGHT = np.radians(15.0)
"""Largest final angle of an upright walker, rad."""
_UPRIGHT_INCREASE = np.radians(0.5)
"""Largest increase of the angle of an upright walker in the second half of a run, rad."""
_NO_TURN = 0.005
"""Rotation per cycle below which a walker does not turn, rad. A velocity is constant only if its
walker does not turn, or turns less and less."""
_TURN_INCREASE = 1e-4
"""Largest increase, from the first half of a run to the second, of the largest rotation per cycle
of a walker that does not turn, rad."""
_TURN_DECREASE = 0.9
"""Largest rotation per cycle in the second half of a run over that in the first half, of a walker
that turns less and less."""
LEAST_GROWTH_RATE = 0.05
"""Rate above which small angles to the axis count as growing, 1/s: by half in ten seconds."""
_ANGLE_INCREASE = 1e-4
"""Increase of the mean angle between thirds of a run that counts as none, rad."""
_HELD_ANGLE = np.radians(0.8)
"""Mean angle on a level substrate above which an angle that grows goes on growing, rad.

Rolling friction may let smaller angles grow and larger ones decay: glass beads on PTFE stay at
0.76°."""
_PARTS = 10
"""Parts of an interval between samples at which gaps and the force of the drive are evaluated."""
_Z = np.array([0.0, 0.0, 1.0])
"""Unit normal of the substrate."""


class Gait(NamedTuple):
    """Velocities of W walkers of n beads in F frames, m/s.

    Attributes
    ----------
    velocity : ndarray, shape (F, W)
        Velocity of the mass centre along the heading.
    rotation : ndarray, shape (F, W, n)
        Rotation velocity of each bead.
    sliding : ndarray, shape (F, W, n + pairs)
        Sliding velocity at the contacts of beads with walls, then at those of pairs of beads.
    """

    velocity: FloatArray
    rotation: FloatArray
    sliding: FloatArray


def gait(group: Group) -> Gait:
    """Compute velocity, rotation and sliding in each frame.

    Parameters
    ----------
    group
        Walkers of one kind.

    Notes
    -----
    The equations stand at the top of this module.
    """
    radii = group.radii
    heading = group.heading
    bead_velocity = np.einsum("fwbx,fwx->fwb", group.velocity, heading)
    rotation = radii * np.einsum("fwbx,fwx->fwb", group.spin, np.cross(_Z, heading))
    if group.case.boundary.is_open_floor:
        rotation_at_wall = rotation
    else:
        axis = np.cross(_nearest_normals(group), heading[:, :, None])
        rotation_at_wall = radii * np.einsum("fwbx,fwbx->fwb", group.spin, axis)
    sliding = [bead_velocity - rotation_at_wall]
    for first, second in group.kind.pairs:
        sliding.append(_sliding_of_pair(group, first, second)[..., None])
    velocity = bead_velocity @ (radii**3 / np.sum(radii**3))
    return Gait(velocity, rotation, np.concatenate(sliding, axis=-1))


def _sliding_of_pair(group: Group, first: int, second: int) -> FloatArray:
    """Sliding velocity between two beads of each walker, m/s, shape (F, W).

    The line between their centres, seen from above, is taken in the direction of the heading; the
    axis is perpendicular to it. The velocity is 0 for beads one above the other.
    """
    radii = group.radii
    arm = group.position[:, :, first] - group.position[:, :, second]
    arm[..., 2] = 0.0
    points_back = np.einsum("fwx,fwx->fw", arm, group.heading) < 0.0
    arm *= np.where(points_back, -1.0, 1.0)[..., None]
    arm /= np.maximum(np.linalg.norm(arm, axis=-1, keepdims=True), 1e-300)
    spin = radii[first] * group.spin[:, :, first] + radii[second] * group.spin[:, :, second]
    sliding: FloatArray = -np.einsum("fwx,fwx->fw", spin, np.cross(_Z, arm))
    return sliding


def _nearest_normals(group: Group) -> FloatArray:
    """Normal of the wall that is nearest to each bead, shape (F, W, n, 3)."""
    walls = group.case.boundary.walls
    nearest = np.argmin([wall.distances(group.position) for wall in walls], axis=0)
    normals = np.stack([wall.normals(group.position) for wall in walls])
    normal: FloatArray = np.take_along_axis(normals, nearest[None, ..., None], axis=0)[0]
    return normal


class Averages(NamedTuple):
    """Means over the measured cycles of W walkers of n beads.

    Attributes
    ----------
    rotation : ndarray, shape (W, n)
        Mean rotation velocity of each bead, m/s.
    sliding : ndarray, shape (W, n + pairs)
        Mean sliding velocity at the contacts, in the order of `Gait`, m/s.
    open : ndarray, shape (W, n + pairs)
        Share of the time in which each contact is open.
    work : ndarray, shape (cycles, W)
        Work of the drive on each walker in each cycle, J; NaN if the frames do not resolve a cycle.
    """

    rotation: FloatArray
    sliding: FloatArray
    open: FloatArray
    work: FloatArray


def averages(group: Group) -> Averages:
    """Compute mean rotation and sliding, the share of open contacts, and the work of the drive.

    Parameters
    ----------
    group
        Walkers of one kind.

    Notes
    -----
    Means over 20 samples per cycle have errors up to 10 % if contacts open, because spins change
    within few steps when beads touch. Therefore spins are averages of the engine over all steps,
    velocities are displacements, and gaps and work are evaluated ten times per interval by cubic
    interpolation (gaps at the samples, if they are few).
    """
    run = group.case.run
    samples = settled_samples(run)
    interval = np.diff(group.time)
    # Work on a unit of mass in each interval between frames, J/kg, summed over the parts.
    if group.motion.follows_cycles:
        parts = _PARTS
        specific_work = np.zeros((len(interval), len(group.walkers)))
    else:
        parts = 1
        specific_work = np.full((len(interval), len(group.walkers)), np.nan)
    ends_of_parts = np.linspace(0.0, 1.0, parts + 1).tolist()[1:]
    open_shares = []
    before = group
    for part, end_of_part in enumerate(ends_of_parts):
        after = replace(group, position=interpolated_positions(group, end_of_part))
        open_shares.append((before.gap[samples] > 0.0).mean(axis=0))
        time = group.time[:-1] + (part + 0.5) / parts * interval
        displacement = after.mass_centre - before.mass_centre[: len(interval)]
        for direction, (_, _, acceleration) in group.case.excitation.motions(time):
            specific_work += -acceleration[:, None] * (displacement @ np.array(direction))
        before = after
    mean = gait(group.motion.averaged.group(group.walkers[0].kind))
    return Averages(
        rotation=mean.rotation[samples].mean(axis=0),
        sliding=mean.sliding[samples].mean(axis=0),
        open=np.mean(open_shares, axis=0),
        work=mass_of(group) * _sums_over_cycles(specific_work, run.samples_per_cycle),
    )


def _sums_over_cycles(values: FloatArray, samples_per_cycle: int) -> FloatArray:
    """Sums of values, shape (F - 1, W), over the intervals of each cycle, shape (cycles, W)."""
    cycles = len(values) // samples_per_cycle
    of_whole_cycles = values[: cycles * samples_per_cycle]
    sums: FloatArray = of_whole_cycles.reshape(cycles, samples_per_cycle, -1).sum(axis=1)
    return sums


def mass_of(group: Group) -> float:
    """Mass of a walker, kg."""
    return float(4.0 / 3.0 * pi * np.sum(group.radii**3) * group.case.beads.density)


def distance_walked(group: Group) -> tuple[FloatArray, FloatArray]:
    """Compute the distance that walkers have walked along their heading.

    The displacement of each cycle is projected on the mean heading, so that a turning walker is
    followed on its curve.

    Parameters
    ----------
    group
        Walkers of one kind.

    Returns
    -------
    time : ndarray, shape (cycles + 1,)
        The start of the drive and the end of each cycle, s.
    distance : ndarray, shape (cycles + 1, W)
        Distance at these times, m.
    """
    frames_per_cycle = group.case.run.samples_per_cycle
    centre = group.mass_centre[::frames_per_cycle]
    heading = group.heading[::frames_per_cycle]
    mean_heading = (heading[1:] + heading[:-1]) / 2.0
    steps = np.einsum("fwx,fwx->fw", np.diff(centre, axis=0), mean_heading)
    start = np.zeros((1, steps.shape[1]))
    distance = np.concatenate([start, np.cumsum(steps, axis=0)])
    return group.time[::frames_per_cycle], distance


def measure_walk(group: Group) -> Columns:
    """Measure the velocities after the settling cycles.

    They are slopes against time, one sample per cycle, by least squares (`fit_slopes`).

    Parameters
    ----------
    group
        Walkers of one kind.

    Returns
    -------
    dict of str to ndarray, shape (W,)
        Columns of the table ``walkers``: ``velocity``, ``first_half`` and ``second_half`` along the
        heading, ``axial_velocity`` and ``lateral_velocity`` of the mass centre along and across the
        drive axis, m/s; ``steady`` tells whether both halves agree.

    Raises
    ------
    DumpError
        If the dump was cut short within the settling cycles.
    """
    settled = group.case.run.settled_strobes
    time, distance = distance_walked(group)
    if len(time) < settled + 2:
        raise DumpError(
            f"the dump holds {len(time) - 1} cycles, no more than the {settled} settling ones"
        )
    time = time[settled:]
    distance = distance[settled:]
    velocity = fit_slopes(time, distance)
    first_half = velocity
    second_half = velocity
    middle = (len(time) + 1) // 2
    if middle >= 2:
        first_half = fit_slopes(time[:middle], distance[:middle])
        second_half = fit_slopes(time[middle - 1 :], distance[middle - 1 :])
    centre = group.mass_centre[:: group.case.run.samples_per_cycle][settled:]
    allowed = np.maximum(STEADY_DIFFERENCE * np.abs(velocity), STEADY_SPEED)
    return {
        "velocity": velocity,
        "first_half": first_half,
        "second_half": second_half,
        "axial_velocity": fit_slopes(time, centre @ group.drive_axis),
        "lateral_velocity": fit_slopes(time, centre @ group.across_axis),
        "steady": np.abs(first_half - second_half) <= allowed,
    }


def fit_slopes(time: FloatArray, values: FloatArray) -> FloatArray:
    """Fit straight lines to values against time by least squares.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Times, s.
    values : ndarray, shape (N, K)
        K columns of values.

    Returns
    -------
    ndarray, shape (K,)
        Slopes of the lines, the unit of the values per second.
    """
    # Differences from the mean avoid rounding errors: positions reach metres, steps micrometres.
    time = time - time.mean()
    return np.asarray(time @ (values - values.mean(axis=0)) / np.sum(time**2))


def settled_samples(run: RunSettings) -> slice:
    """The samples of whole cycles after the settling ones; each phase occurs equally often."""
    samples = run.samples_per_cycle
    cycles = run.cycles // run.cycles_per_sample
    return slice(run.settled_strobes * samples, cycles * samples)


def turns_away_after(group: Group) -> FloatArray:
    """Predict when walkers will have turned away from the drive axis, or turned over on a slope.

    Parameters
    ----------
    group
        Walkers of one kind.

    Returns
    -------
    ndarray, shape (W,)
        Time from the end of the run, s; NaN for walkers that do not turn away.

    Notes
    -----
    Small angles ψ grow exponentially. On a slope dψ/dt = rate · sin ψ, up to 90°, where the walker
    has turned over. On a level substrate, where both headings are the same,
    dψ/dt = rate · sin 2ψ / 2, up to 45°. There, angles smaller than `_HELD_ANGLE` do not count,
    because rolling friction may hold them.
    """
    growth = _growth_of_angles(group)
    with np.errstate(divide="ignore", invalid="ignore"):
        if group.case.boundary.tilt:
            tangent = np.tan(growth.end / 2.0)
            turns = growth.grows
        else:
            tangent = np.tan(growth.end)
            turns = growth.grows & (growth.mean > _HELD_ANGLE)
        seconds_left = -np.log(tangent) / growth.rate
    return np.where(turns & (seconds_left > 0.0), seconds_left, np.nan)


def small_angles_grow(group: Group) -> BoolArray:
    """Tell which walkers on a level substrate have an angle below `_HELD_ANGLE` that grows.

    Parameters
    ----------
    group
        Walkers of one kind.

    Returns
    -------
    ndarray of bool, shape (W,)
        All false on a slope.
    """
    if group.case.boundary.tilt:
        return np.zeros(len(group.walkers), dtype=bool)
    growth = _growth_of_angles(group)
    return np.asarray(growth.grows & (growth.mean <= _HELD_ANGLE))


class _Growth(NamedTuple):
    """How the angles of walkers to the axis grow, each of shape (W,).

    Attributes
    ----------
    rate
        Growth rate from the second to the last third of the measured cycles, 1/s.
    mean
        Mean angle in the last third, rad.
    end
        Angle at the end of the run, rad.
    grows
        Whether the angle grows at more than `LEAST_GROWTH_RATE`, and faster than before.
    """

    rate: FloatArray
    mean: FloatArray
    end: FloatArray
    grows: BoolArray


def _growth_of_angles(group: Group) -> _Growth:
    """The growth of the angles of walkers to the axis.

    The angles are those of one frame per cycle after settling, or of one in several cycles if
    frames are that rare. With fewer than three such frames the numbers are NaN, and no angle grows.
    """
    run = group.case.run
    angle = np.abs(group.orientation[:: run.samples_per_cycle][run.settled_strobes :])
    if len(angle) < 3:  # a short run, too few frames a second, or a dump that was cut short
        missing = np.full(len(group.walkers), np.nan)
        nothing_grows = np.zeros(len(group.walkers), dtype=bool)
        return _Growth(rate=missing, mean=missing, end=missing, grows=nothing_grows)
    first, second, last = [part.mean(axis=0) for part in np.array_split(angle, 3)]
    seconds_of_third = len(angle) / 3.0 * run.cycles_per_sample / group.case.excitation.frequency
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.log(last / second) / seconds_of_third
    grows_faster = last - second > np.maximum(second - first, _ANGLE_INCREASE)
    grows = (rate > LEAST_GROWTH_RATE) & grows_faster
    return _Growth(rate=rate, mean=last, end=angle[-1], grows=grows)


def postures(group: Group) -> list[str]:
    """Tell the posture of each walker on a slope or a wall.

    A walker with its large bead uphill can tip over like an inverted pendulum; then its velocity
    has no meaning. The angle is evaluated once per cycle, or once in several cycles if frames are
    that rare.

    Parameters
    ----------
    group
        Walkers of one kind.

    Returns
    -------
    list of str
        For each walker ``turned_over`` if it turned by more than 90° from its start, which may be
        at an angle; ``upright`` if it ends at most 15° from the direction that it faces and its
        angle increased by at most half a degree in the second half of the run; otherwise
        ``leaning``.
    """
    # Orientations are angles from the direction that walkers face, rad, shape (F, W). The times
    # `turned_at` are those of turning by 90° from the start, and NaN for walkers that never do.
    angle = np.abs(group.orientation[:: group.case.run.samples_per_cycle])
    end = angle[-1]
    middle = angle[len(angle) // 2]
    upright = (end <= UPRIGHT) & (end <= middle + _UPRIGHT_INCREASE)
    turned_over = np.isfinite(group.turned_at)
    labels = np.select([turned_over, upright], ["turned_over", "upright"], "leaning")
    return [str(label) for label in labels]


def are_constant(directory: Path) -> bool:
    """Tell whether the velocities of a run are constant, so that it needs no more cycles.

    The velocities of both halves of the cycles after settling must agree, and no walker may turn at
    an increasing rate.

    Parameters
    ----------
    directory
        The run directory; the run may be unfinished.

    Notes
    -----
    Of 362 dimers of the shipped sweeps that ran for 60 cycles, those that were constant after 12 or
    24 had speeds within 0.2 % of the final ones; without the criterion for turning some differed by
    4 %.
    """
    return all(_is_constant(group) for group in read_motion(directory).groups)


def _is_constant(group: Group) -> bool:
    """Tell whether the velocities of walkers of one kind are constant."""
    walk = measure_walk(group)
    allowed = max(CONSTANT * float(np.abs(walk["velocity"]).max()), REST)
    largest_difference = np.abs(walk["first_half"] - walk["second_half"]).max()

    run = group.case.run
    orientation = group.orientation[:: run.samples_per_cycle][run.settled_strobes :]
    turn_per_cycle = np.abs(np.diff(orientation, axis=0))
    middle = len(turn_per_cycle) // 2
    before = turn_per_cycle[:middle].max(axis=0)
    after = turn_per_cycle[middle:].max(axis=0)
    does_not_turn = (after < _NO_TURN) & (after < before + _TURN_INCREASE)
    turns_less = after < _TURN_DECREASE * before
    return bool(largest_difference <= allowed and np.all(does_not_turn | turns_less))
