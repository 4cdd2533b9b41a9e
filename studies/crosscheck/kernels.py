"""The second engine's formulas and its integration, compiled by numba.

Normals point from the second body (or the wall) to the first; h is the gap, δ = −h the overlap, η the viscosity, ε the
minimum separation ratio. Forces are those at the new places, of the velocities half a step before (velocity Verlet with
the forces evaluated once a step: L. Verlet, Phys. Rev. 159 (1967) 98; in granular codes as in Plimpton, J. Comput.
Phys. 117 (1995) 1, doi 10.1006/jcph.1995.1039).

References
----------
Contacts: H. Hertz, J. reine angew. Math. 92 (1881) 156; R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; Y. Tsuji,
T. Tanaka, T. Ishida, Powder Technology 71 (1992) 239, doi 10.1016/0032-5910(92)88030-L (damping).
Bridges: F. Soulié et al., Int. J. Numer. Anal. Meth. Geomech. 30 (2006) 213, Eqs. 13, 14, doi 10.1002/nag.476;
D. Shi, J. J. McCarthy, Powder Technology 184 (2008) 65, doi 10.1016/j.powtec.2007.08.011 (volumes, Eqs. 40, 41 for the
viscous forces); G. Lian, C. Thornton, M. J. Adams, J. Colloid Interface Sci. 161 (1993) 138, doi
10.1006/jcis.1993.1452 (rupture).
Rolling friction: J. Ai, J.-F. Chen, J. M. Rotter, J. Y. Ooi, Powder Technology 206 (2011) 269, doi
10.1016/j.powtec.2010.09.030, model A.
"""

from __future__ import annotations

from math import exp, log, pi, sin, sqrt
from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt

compiled = numba.njit(cache=True, error_model="numpy")
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
FlagArray = npt.NDArray[np.bool_]

NONE, BY_VELOCITY, STICK_SLIP = 0, 1, 2
HALVES, PLANE_NORMAL, PLANE = 0, 1, 2
PEAK, SLOPE, SHIFT, OFFSET, RUPTURE, TABLE = range(6)
"""Columns of a bridge's constants: πγ√(R1R2) (N), A/R2 (1/m), B, C, rupture distance (m), number of its table or −1."""
Vector = tuple[float, float, float]
TABLE_POINTS = 1024
"""Of a table of forces, evenly from a gap of 0 to rupture."""


class Constants(NamedTuple):
    """What does not change: N beads, W walls, H harmonics, T tables; SI units.

    Attributes
    ----------
    step : float
    radius, mass, film : ndarray, shape (N,)
        ``film`` is 6πη_f R, N s/m.
    reach : ndarray, shape (N,)
        Gap up to which the film acts, and what two spheres lack of a plane's lubrication, m: that at which a bridge of
        the liquid that a bead has at first would break.
    point, normal : ndarray, shape (W, 3)
    gravity : ndarray, shape (3,)
    harmonics : ndarray, shape (H, 6)
        Direction, ω, peak acceleration, phase.
    modulus, shear_modulus, damping : float
        E*, G*, β.
    friction, rolling : float
        The former between beads and at walls.
    tables : ndarray, shape (T, TABLE_POINTS)
        Pull, N.
    """

    step: float
    radius: FloatArray
    mass: FloatArray
    film: FloatArray
    reach: FloatArray
    point: FloatArray
    normal: FloatArray
    gravity: FloatArray
    harmonics: FloatArray
    modulus: float
    shear_modulus: float
    normal_damping: float
    tangential_damping: float
    friction_beads: float
    friction_walls: float
    rolling: float
    tension: float
    contact_angle: float
    capillary: bool
    normal_viscosity: float
    tangential_viscosity: float
    separation: float
    tables: FloatArray
    friction: bool
    spring: bool
    limit_with_damping: bool
    static: int
    static_ratio: float
    static_velocity: float
    wall_lubrication: int
    transfer: bool
    copies: float


class State(NamedTuple):
    """What changes with time: N beads, W walls."""

    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    force: FloatArray
    torque: FloatArray
    liquid: FloatArray
    """Liquid on a bead over its volume, shape (N,)."""
    wall_bridge: FloatArray
    """Constants of the bridges to the walls, shape (N, 6)."""
    wall_spring: FloatArray
    """Tangential displacements, m, shape (N, W, 3)."""
    wall_bridged: FlagArray
    wall_slips: FlagArray


class Pairs(NamedTuple):
    """P pairs of beads near each other, sorted by the numbers of their beads."""

    first: IntArray
    second: IntArray
    bridge: FloatArray
    """Shape (P, 6)."""
    spring: FloatArray
    """Shape (P, 3)."""
    bridged: FlagArray
    slips: FlagArray


@compiled
def caps(own: float, other: float, content: float) -> float:
    """Liquid that a bead gives to a bridge, m³: half of its film in the cap that the other covers."""
    film = 4.0 / 3.0 * pi * own**3 * content
    return 0.5 * film * (1.0 - sqrt(1.0 - (other / (own + other)) ** 2))


@compiled
def set_bridge(tension: float, angle: float, radii: tuple[float, float], volume: float, bridge: FloatArray) -> None:
    """Constants of a bridge of a volume (m³) after Soulié et al., and its rupture distance after Lian et al."""
    larger = max(radii[0], radii[1])
    scaled = volume / larger**3
    bridge[PEAK] = pi * tension * sqrt(radii[0] * radii[1])
    bridge[SLOPE] = -1.1 * scaled**-0.53 / larger
    bridge[SHIFT] = (-0.148 * log(scaled) - 0.96) * angle**2 - 0.0082 * log(scaled) + 0.48
    bridge[OFFSET] = 0.0018 * log(scaled) + 0.078
    bridge[RUPTURE] = (1.0 + 0.5 * angle) * volume ** (1.0 / 3.0)


@compiled
def set_pair_bridge(c: Constants, state: State, first: int, second: int, bridge: FloatArray) -> None:
    """Constants of the bridge between two beads with the liquid that they have now; those of a table stay."""
    if bridge[TABLE] >= 0.0:
        return
    one, other = c.radius[first], c.radius[second]
    volume = caps(one, other, state.liquid[first]) + caps(other, one, state.liquid[second])
    set_bridge(c.tension, c.contact_angle, (one, other), volume, bridge)


@compiled
def set_wall_bridge(c: Constants, state: State, bead: int) -> None:
    """Constants of a bead's bridges to the walls, half of its liquid; those of a table stay."""
    bridge = state.wall_bridge[bead]
    if bridge[TABLE] < 0.0:
        radius = c.radius[bead]
        volume = 0.5 * 4.0 / 3.0 * pi * radius**3 * state.liquid[bead]
        set_bridge(c.tension, c.contact_angle, (radius, radius), volume, bridge)


@compiled
def set_bridges(c: Constants, state: State, pairs: Pairs) -> None:
    """Constants of all bridges with the liquid that beads have now."""
    for at in range(pairs.first.shape[0]):
        set_pair_bridge(c, state, pairs.first[at], pairs.second[at], pairs.bridge[at])
    for bead in range(c.radius.shape[0]):
        set_wall_bridge(c, state, bead)


@compiled
def pull(c: Constants, bridge: FloatArray, gap: float) -> float:
    """Capillary attraction, N: πγ√(R1R2) (exp(A h/R2 + B) + C), or as the table has it."""
    if not c.capillary:
        return 0.0
    gap = max(gap, 0.0)
    if bridge[TABLE] < 0.0:
        return bridge[PEAK] * (exp(bridge[SLOPE] * gap + bridge[SHIFT]) + bridge[OFFSET])
    values = c.tables[int(bridge[TABLE])]
    place = gap / bridge[RUPTURE] * (TABLE_POINTS - 1)
    low = min(int(place), TABLE_POINTS - 2)
    return values[low] + (place - low) * (values[low + 1] - values[low])


@compiled
def drags(c: Constants, reduced_radius: float, gap: float) -> tuple[float, float]:
    """Normal and tangential viscous force over velocity, N s/m (Shi and McCarthy, Eqs. 40 and 41)."""
    near = max(c.separation, gap / reduced_radius)
    stokes = 6.0 * pi * reduced_radius
    tangential = 0.0
    if c.tangential_viscosity > 0.0:
        tangential = stokes * c.tangential_viscosity * (8.0 / 15.0 * log(1.0 / near) + 0.9588)
    return stokes * c.normal_viscosity / near, tangential


@compiled
def wall_drags(c: Constants, radius: float, gap: float) -> tuple[float, float]:
    """The same at a wall, all of its copies."""
    if c.wall_lubrication == PLANE:
        return drags(c, radius, gap)
    normal, tangential = drags(c, radius / 2.0, gap)
    return c.copies * normal, c.copies * tangential


@compiled
def missing_wall_drag(c: Constants, radius: float, gap: float) -> float:
    """What two equal spheres lack of a plane's normal lubrication, N s/m."""
    halves = 1.0 / max(c.separation, 2.0 * gap / radius)
    return 6.0 * pi * c.normal_viscosity * radius * (1.0 / max(c.separation, gap / radius) - halves)


@compiled
def limit_of_friction(c: Constants, friction: float, load: float, speed: float, slips: bool) -> float:
    """Largest tangential force, N."""
    if c.static == BY_VELOCITY:
        return friction * load * (1.0 + (c.static_ratio - 1.0) / (1.0 + speed / c.static_velocity))
    if c.static == STICK_SLIP and not slips:
        return friction * load * c.static_ratio
    return friction * load


@compiled
def touching(
    c: Constants,
    of: tuple[float, float, float, float],
    n: Vector,
    motion: tuple[float, Vector],
    spring: FloatArray,
    slips: bool,
    moves: bool,
) -> tuple[float, float, float, float, float, bool]:
    """A dry contact: elastic and whole normal force (N), tangential force (N), whether it slips.

    Parameters
    ----------
    c
        Constants.
    of
        Overlap δ and reduced radius (m), reduced mass (kg), coefficient of friction.
    n
        Normal.
    motion
        Velocity of the first surface relative to the second, along the normal and along the surfaces, m/s.
    spring
        Tangential displacement, m; changed.
    slips
        Whether the contact slipped the step before.
    moves
        Whether time goes on; else forces are those of the state as it is.
    """
    overlap, reduced_radius, reduced_mass, friction = of
    normal_speed, slide = motion
    root = sqrt(reduced_radius * overlap)
    elastic = 4.0 / 3.0 * c.modulus * root * overlap
    damping = 2.0 * sqrt(5.0 / 6.0)
    force = elastic - damping * c.normal_damping * sqrt(2.0 * c.modulus * root * reduced_mass) * normal_speed
    if not c.friction:
        return elastic, force, 0.0, 0.0, 0.0, slips
    stiffness = 8.0 * c.shear_modulus * root
    drag = damping * c.tangential_damping * sqrt(stiffness * reduced_mass)
    load = abs(force) if c.limit_with_damping else elastic
    speed = sqrt(slide[0] ** 2 + slide[1] ** 2 + slide[2] ** 2)
    limit = limit_of_friction(c, friction, load, speed, slips)
    if not c.spring:
        scale = -drag if drag * speed <= limit else -limit / speed
        return elastic, force, scale * slide[0], scale * slide[1], scale * slide[2], False
    if moves:
        for axis in range(3):
            spring[axis] += slide[axis] * c.step
        along = spring[0] * n[0] + spring[1] * n[1] + spring[2] * n[2]
        for axis in range(3):
            spring[axis] -= along * n[axis]
    stretch = stiffness * sqrt(spring[0] ** 2 + spring[1] ** 2 + spring[2] ** 2)
    if c.static == STICK_SLIP:
        if stretch > limit and not slips:
            slips = True
            limit = friction * load
        elif slips and stretch < limit:
            slips = spring[0] * slide[0] + spring[1] * slide[1] + spring[2] * slide[2] > 0.0
    if stretch > limit:
        if moves:
            for axis in range(3):
                spring[axis] *= limit / stretch
            return elastic, force, -stiffness * spring[0], -stiffness * spring[1], -stiffness * spring[2], slips
        scale = -stiffness * limit / stretch
        return elastic, force, scale * spring[0], scale * spring[1], scale * spring[2], slips
    return (
        elastic,
        force,
        -stiffness * spring[0] - drag * slide[0],
        -stiffness * spring[1] - drag * slide[1],
        -stiffness * spring[2] - drag * slide[2],
        slips,
    )


@compiled
def sliding(n: Vector, between: Vector, turning: Vector) -> tuple[float, Vector]:
    """Velocity of one surface relative to another, m/s: along the normal, and along the surfaces.

    Parameters
    ----------
    n
        Normal.
    between
        Velocity of the first centre relative to the second, m/s.
    turning
        Sum of the angular velocities, each times its arm from the centre to the contact, m/s.
    """
    along = between[0] * n[0] + between[1] * n[1] + between[2] * n[2]
    return along, (
        between[0] - along * n[0] + n[1] * turning[2] - n[2] * turning[1],
        between[1] - along * n[1] + n[2] * turning[0] - n[0] * turning[2],
        between[2] - along * n[2] + n[0] * turning[1] - n[1] * turning[0],
    )


@compiled
def push(state: State, bead: int, sign: float, arm: float, n: Vector, force: Vector) -> None:
    """A force (N), or its reaction (``sign`` −1), on a bead whose surface it meets at ``arm`` (m) from the centre."""
    for axis in range(3):
        state.force[bead, axis] += sign * force[axis]
    state.torque[bead, 0] -= arm * (n[1] * force[2] - n[2] * force[1])
    state.torque[bead, 1] -= arm * (n[2] * force[0] - n[0] * force[2])
    state.torque[bead, 2] -= arm * (n[0] * force[1] - n[1] * force[0])


@compiled
def rolling_torque(n: Vector, turning: Vector, size: float) -> Vector:
    """Torque of a size (N m) against a relative rotation, without its part about the normal."""
    length = sqrt(turning[0] ** 2 + turning[1] ** 2 + turning[2] ** 2)
    if length == 0.0:
        return (0.0, 0.0, 0.0)
    along = turning[0] * n[0] + turning[1] * n[1] + turning[2] * n[2]
    scale = -size / length
    return (
        scale * (turning[0] - along * n[0]),
        scale * (turning[1] - along * n[1]),
        scale * (turning[2] - along * n[2]),
    )


@compiled
def along_normal(n: Vector, normal: float, tangential: Vector) -> Vector:
    """A force from its normal part and its tangential one."""
    return (normal * n[0] + tangential[0], normal * n[1] + tangential[1], normal * n[2] + tangential[2])


@compiled
def body_forces(c: Constants, state: State, clock: int) -> None:
    """Weight and inertial force."""
    ax, ay, az = c.gravity[0], c.gravity[1], c.gravity[2]
    if clock >= 0:
        for one in range(c.harmonics.shape[0]):
            wave = c.harmonics[one]
            now = wave[4] * sin(wave[3] * clock * c.step + wave[5])
            ax, ay, az = ax + now * wave[0], ay + now * wave[1], az + now * wave[2]
    for bead in range(c.radius.shape[0]):
        state.force[bead, 0] = c.mass[bead] * ax
        state.force[bead, 1] = c.mass[bead] * ay
        state.force[bead, 2] = c.mass[bead] * az
        state.torque[bead, :] = 0.0


@compiled
def wall_forces(c: Constants, state: State, moves: bool) -> None:
    """Contacts, bridges and films of all beads at all walls."""
    x, v, w = state.position, state.velocity, state.spin
    for bead in range(c.radius.shape[0]):
        radius, bridge = c.radius[bead], state.wall_bridge[bead]
        for wall in range(c.point.shape[0]):
            n = (c.normal[wall, 0], c.normal[wall, 1], c.normal[wall, 2])
            p = c.point[wall]
            height = (x[bead, 0] - p[0]) * n[0] + (x[bead, 1] - p[1]) * n[1] + (x[bead, 2] - p[2]) * n[2]
            gap = height - radius
            if gap >= max(bridge[RUPTURE], c.reach[bead]):
                leave(state.wall_spring[bead, wall], state.wall_bridged[bead], state.wall_slips[bead], wall)
                continue
            arm = radius + min(gap, 0.0) / 2.0
            between = (v[bead, 0], v[bead, 1], v[bead, 2])
            turning = (arm * w[bead, 0], arm * w[bead, 1], arm * w[bead, 2])
            speed, slide = sliding(n, between, turning)
            normal, tangential = 0.0, 0.0
            if gap < 0.0:
                state.wall_bridged[bead, wall] = True
                of = (-gap, radius, c.mass[bead], c.friction_walls)
                spring, slips = state.wall_spring[bead, wall], state.wall_slips[bead, wall]
                elastic, force, tx, ty, tz, slips = touching(c, of, n, (speed, slide), spring, slips, moves)
                state.wall_slips[bead, wall] = slips
                push(
                    state,
                    bead,
                    1.0,
                    arm,
                    n,
                    along_normal(n, c.copies * force, (c.copies * tx, c.copies * ty, c.copies * tz)),
                )
                torque = rolling_torque(
                    n, (w[bead, 0], w[bead, 1], w[bead, 2]), c.copies * c.rolling * elastic * radius
                )
                for axis in range(3):
                    state.torque[bead, axis] += torque[axis]
            elif gap >= bridge[RUPTURE]:
                leave(state.wall_spring[bead, wall], state.wall_bridged[bead], state.wall_slips[bead], wall)
            else:
                state.wall_spring[bead, wall, :] = 0.0
                state.wall_slips[bead, wall] = False
            if state.wall_bridged[bead, wall]:
                normal, tangential = wall_drags(c, radius, gap)
                normal *= -speed
                normal -= pull(c, bridge, gap) * (c.copies if bridge[TABLE] < 0.0 else 1.0)
            if c.wall_lubrication == PLANE_NORMAL and 0.0 < gap < c.reach[bead]:
                normal -= missing_wall_drag(c, radius, gap) * speed
            viscous = (-tangential * slide[0], -tangential * slide[1], -tangential * slide[2])
            push(state, bead, 1.0, arm, n, along_normal(n, normal, viscous))
            if gap < c.reach[bead]:
                for axis in range(3):
                    state.force[bead, axis] -= c.film[bead] * (between[axis] - speed * n[axis])


@compiled
def leave(spring: FloatArray, bridged: FlagArray, slips: FlagArray, at: int) -> None:
    """Neither contact nor bridge any more."""
    spring[:] = 0.0
    bridged[at] = False
    slips[at] = False


@compiled
def pair_forces(c: Constants, state: State, pairs: Pairs, moves: bool) -> bool:
    """Contacts and bridges between beads; whether a bridge broke and its liquid was shared out."""
    x, v, w = state.position, state.velocity, state.spin
    shared = False
    for at in range(pairs.first.shape[0]):
        i, j = pairs.first[at], pairs.second[at]
        dx, dy, dz = x[i, 0] - x[j, 0], x[i, 1] - x[j, 1], x[i, 2] - x[j, 2]
        together = c.radius[i] + c.radius[j]
        square = dx * dx + dy * dy + dz * dz
        if square >= together**2 and not pairs.bridged[at]:
            pairs.spring[at, :] = 0.0
            pairs.slips[at] = False
            continue
        distance = sqrt(square)
        gap, n = distance - together, (dx / distance, dy / distance, dz / distance)
        if gap >= pairs.bridge[at, RUPTURE]:
            leave(pairs.spring[at], pairs.bridged, pairs.slips, at)
            shared = share_liquid(c, state, i, j) or shared
            continue
        arm_i, arm_j = c.radius[i] + min(gap, 0.0) / 2.0, c.radius[j] + min(gap, 0.0) / 2.0
        between = (v[i, 0] - v[j, 0], v[i, 1] - v[j, 1], v[i, 2] - v[j, 2])
        turning = (
            arm_i * w[i, 0] + arm_j * w[j, 0],
            arm_i * w[i, 1] + arm_j * w[j, 1],
            arm_i * w[i, 2] + arm_j * w[j, 2],
        )
        speed, slide = sliding(n, between, turning)
        reduced_radius = c.radius[i] * c.radius[j] / together
        normal, tangential = drags(c, reduced_radius, gap)
        normal = -normal * speed - pull(c, pairs.bridge[at], gap)
        viscous = (-tangential * slide[0], -tangential * slide[1], -tangential * slide[2])
        if gap < 0.0:
            pairs.bridged[at] = True
            of = (-gap, reduced_radius, c.mass[i] * c.mass[j] / (c.mass[i] + c.mass[j]), c.friction_beads)
            elastic, force, tx, ty, tz, slips = touching(
                c, of, n, (speed, slide), pairs.spring[at], pairs.slips[at], moves
            )
            pairs.slips[at] = slips
            normal += force
            viscous = (viscous[0] + tx, viscous[1] + ty, viscous[2] + tz)
            roll = (w[i, 0] - w[j, 0], w[i, 1] - w[j, 1], w[i, 2] - w[j, 2])
            torque = rolling_torque(n, roll, c.rolling * elastic * reduced_radius)
            for axis in range(3):
                state.torque[i, axis] += torque[axis]
                state.torque[j, axis] -= torque[axis]
        else:
            pairs.spring[at, :] = 0.0
            pairs.slips[at] = False
        both = along_normal(n, normal, viscous)
        push(state, i, 1.0, arm_i, n, both)
        push(state, j, -1.0, arm_j, n, both)
    return shared


@compiled
def share_liquid(c: Constants, state: State, i: int, j: int) -> bool:
    """The liquid of a bridge that breaks goes to its beads in proportion to their volumes."""
    if not c.transfer:
        return False
    one, other = c.radius[i], c.radius[j]
    from_i, from_j = caps(one, other, state.liquid[i]), caps(other, one, state.liquid[j])
    to_i = (from_i + from_j) / (1.0 + (other / one) ** 3)
    moved = to_i - from_i
    state.liquid[i] += moved / (4.0 / 3.0 * pi * one**3)
    state.liquid[j] -= moved / (4.0 / 3.0 * pi * other**3)
    return True


@compiled
def forces(c: Constants, state: State, pairs: Pairs, clock: int, moves: bool) -> None:
    """All forces and torques at the places and velocities of the state."""
    body_forces(c, state, clock)
    wall_forces(c, state, moves)
    if pair_forces(c, state, pairs, moves):
        set_bridges(c, state, pairs)


@compiled
def kick(c: Constants, state: State) -> None:
    """Half a step of velocities."""
    half = 0.5 * c.step
    for bead in range(c.radius.shape[0]):
        speed = half / c.mass[bead]
        spin = speed / (0.4 * c.radius[bead] ** 2)
        for axis in range(3):
            state.velocity[bead, axis] += speed * state.force[bead, axis]
            state.spin[bead, axis] += spin * state.torque[bead, axis]


@compiled
def drift(c: Constants, state: State, listed: FloatArray) -> float:
    """A step of places; the square of the farthest way of a bead since neighbours were listed, m²."""
    farthest = 0.0
    for bead in range(c.radius.shape[0]):
        way = 0.0
        for axis in range(3):
            state.position[bead, axis] += c.step * state.velocity[bead, axis]
            way += (state.position[bead, axis] - listed[bead, axis]) ** 2
        farthest = max(farthest, way)
    return farthest


@compiled
def record(state: State, frame: FloatArray) -> None:
    """Places, velocities and spins, into shape (N, 9)."""
    frame[:, :3] = state.position
    frame[:, 3:6] = state.velocity
    frame[:, 6:] = state.spin


@compiled
def advance(
    c: Constants,
    state: State,
    pairs: Pairs,
    listed: FloatArray,
    skin: float,
    clock: tuple[int, int, int, int],
    frames: FloatArray,
) -> int:
    """Move on, until the end or until neighbours are to be listed anew; at the end already, evaluate the forces.

    Parameters
    ----------
    c, state, pairs
        The system; the state changes.
    listed : ndarray, shape (N, 3)
        Places at which neighbours were listed, m.
    skin
        How far apart surfaces may have been then of beads that can meet or have a bridge now, m.
    clock
        Step that it is, at which the record begins, at which to end, and between records.
    frames : ndarray, shape (F, N, 9)
        Records of the steps after the one at which they begin.

    Returns
    -------
    step
        That it is now.
    """
    now, begin, end, every = clock
    if now == end:
        forces(c, state, pairs, now, False)
    far = (0.4 * skin) ** 2
    while now < end:
        kick(c, state)
        now += 1
        moved = drift(c, state, listed)
        forces(c, state, pairs, now, True)
        kick(c, state)
        if (now - begin) % every == 0:
            record(state, frames[(now - begin) // every - 1])
        if moved > far:
            break
    return now
