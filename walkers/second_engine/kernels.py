"""The formulas of the second engine and its integration, compiled by numba.

Normals point from the second body (a bead or a wall) to the first; h is the gap, δ = -h the
overlap. `pair_force` gives the forces of a pair: Hertz's repulsion with Tsuji's damping,
Mindlin's spring with damping, both together no larger than the friction coefficient at the sliding
velocity (`walkers.physics.friction`) times the elastic repulsion, rolling friction, and a bridge
between the surfaces, whose capillary force and resistances are splines (`BridgeSplines`).

The integration is velocity Verlet with the forces evaluated once a step, at the new positions and
with the velocities half a step before, as granular codes do.

The module knows no cases: `walkers.second_engine.engine` makes `Constants` and `State` of a case.

References
----------
H. Hertz, J. reine angew. Math. 92 (1881) 156.
R. D. Mindlin, J. Appl. Mech. 16 (1949) 259.
Y. Tsuji, T. Tanaka, T. Ishida, Powder Technology 71 (1992) 239, doi 10.1016/0032-5910(92)88030-L
(damping).
J. Ai, J.-F. Chen, J. M. Rotter, J. Y. Ooi, Powder Technology 206 (2011) 269, doi
10.1016/j.powtec.2010.09.030, model A (rolling friction).
L. Verlet, Phys. Rev. 159 (1967) 98; S. Plimpton, J. Comput. Phys. 117 (1995) 1, doi
10.1006/jcph.1995.1039 (integration).
"""

from __future__ import annotations

from math import log, log2, sin, sqrt
from typing import NamedTuple

import numba

from walkers.arrays import BoolArray, FloatArray, IntArray, Vector
from walkers.physics.edges import SLOWEST
from walkers.physics.friction import SlidingFriction

compiled = numba.njit(cache=True, error_model="numpy")
"""Decorator of kernels."""
inlined = numba.njit(cache=True, error_model="numpy", inline="always")
"""Decorator of kernels of the innermost loop, whose calls would be slow."""

CELLS = 512
"""Number of cells of each of the three pieces of a bridge's splines."""
FORMATION = 0
"""Column of `BridgeSplines.spans`: gap at which the bridge forms."""
SCALE = 1
"""Column of `BridgeSplines.spans`: gap at which the first piece ends."""
MIDDLE = 2
"""Column of `BridgeSplines.spans`: gap at which the second piece ends."""
RUPTURE = 3
"""Column of `BridgeSplines.spans`: gap at which the bridge breaks."""
ZERO: Vector = (0.0, 0.0, 0.0)
"""The vector of length zero."""


class BridgeSplines(NamedTuple):
    """Capillary force and resistances of T bridges between beads of K sizes and walls.

    Each bridge has three pieces: cubic splines in h up to the gap `SCALE`, in ln h up to
    `MIDDLE`, and in √(rupture - h) up to `RUPTURE`. Where liquid is conserved, two surfaces have
    one bridge for each of several volumes, in steps of √2; otherwise one.

    Attributes
    ----------
    spans : ndarray, shape (T, 4)
        Gaps at which a bridge forms, its pieces end, and it breaks, m.
    splines : ndarray, shape (T, 3, CELLS, 4, 5)
        Coefficients of each cell, highest power first, of the capillary force (N) and the normal
        (N s/m), sliding (N s/m), coupling (N s) and rolling (N m s) resistances.
    size : ndarray of int, shape (N,)
        Index of the size of each bead.
    first_bridge : ndarray of int, shape (K, K + 1)
        Index of the bridge of the smallest volume between beads of two sizes; in the last column,
        between a bead and a wall.
    edge : ndarray, shape (T,)
        Resistance of the edges of each bridge, N (s/m)^(2/3).
    volume : ndarray, shape (T,)
        Volume of each bridge, m³.
    full_step : int
        Number of steps from the smallest volume to that of a bridge of full films; 0 if liquid is
        not conserved.
    contribution : ndarray, shape (K, K + 1, 2)
        Volumes that full films of the first and the second body contribute to their bridge, m³.
    liquid : ndarray, shape (N,)
        Liquid of each bead, m³.
    """

    spans: FloatArray
    splines: FloatArray
    size: IntArray
    first_bridge: IntArray
    edge: FloatArray
    volume: FloatArray
    full_step: int
    contribution: FloatArray
    liquid: FloatArray


class Constants(NamedTuple):
    """What does not change: N beads, W walls and H harmonics of the drive, SI units.

    Attributes
    ----------
    step : float
        Time step, s.
    radius, mass : ndarray, shape (N,)
        Radius (m) and mass (kg) of each bead.
    wall_point : ndarray, shape (W, 3)
        A point of each plane, or of the axis of each cylinder, m.
    wall_normal : ndarray, shape (W, 3)
        Unit normal of each plane, toward the beads.
    cylinder_radius : ndarray, shape (W,)
        Inner radius of each upright cylinder, m; 0 for planes.
    gravity : ndarray, shape (3,)
        Gravity, m/s².
    harmonics : ndarray, shape (H, 6)
        Direction (3 columns), angular frequency (rad/s), peak acceleration (m/s²) and phase (rad).
    inertial_acceleration : ndarray, shape (steps + 1, 3)
        Inertial acceleration at each step, m/s², of a drive with a ramp or from a record, which
        then has no harmonics; otherwise no rows.
    modulus, shear_modulus : float
        Reduced moduli E* and G* of two equal materials, Pa.
    damping : float
        Coefficient β of Tsuji's damping.
    friction_beads, friction_walls : SlidingFriction
        Law of friction between two beads, and between a bead and a wall.
    rolling : float
        Coefficient of rolling friction, the same for beads and walls.
    search_radius : ndarray, shape (N,)
        Beads are neighbours if their distance is less than the sum of these radii, m. They include
        the skin.
    skin : float
        Distance that neighbours may have beyond the rupture of their bridge, m.
    bridges : BridgeSplines
        Bridges between all sizes of beads and between beads and walls.
    """

    step: float
    radius: FloatArray
    mass: FloatArray
    wall_point: FloatArray
    wall_normal: FloatArray
    cylinder_radius: FloatArray
    gravity: FloatArray
    harmonics: FloatArray
    inertial_acceleration: FloatArray
    modulus: float
    shear_modulus: float
    damping: float
    friction_beads: SlidingFriction
    friction_walls: SlidingFriction
    rolling: float
    search_radius: FloatArray
    skin: float
    bridges: BridgeSplines


class State(NamedTuple):
    """State of N beads and of their contacts with each other and with W walls, SI units.

    A contact has a bead and a bead with a higher number, or a bead and a wall; walls are numbered
    after the beads.

    Attributes
    ----------
    position, velocity, spin : ndarray, shape (N, 3)
        Position (m), velocity (m/s) and angular velocity (rad/s) of each bead.
    force, torque : ndarray, shape (N, 3)
        Force (N) and torque (N m) on each bead.
    film : ndarray, shape (N,)
        Liquid on each bead that is not in bridges, over all its liquid.
    previous_film : ndarray, shape (N,)
        The same at the end of the previous step, from which bridges between beads form.
    spring : ndarray, shape (N, N + W, 3)
        Tangential displacement of each contact, m.
    bridge : ndarray of int, shape (N, N + W)
        Index of the bridge of each contact, or -1.
    neighbours : ndarray of bool, shape (N, N)
        Whether two beads may meet before a bead has moved by nearly half the skin.
    listed_position : ndarray, shape (N, 3)
        Positions where the neighbours were listed, m.
    """

    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    force: FloatArray
    torque: FloatArray
    film: FloatArray
    previous_film: FloatArray
    spring: FloatArray
    bridge: IntArray
    neighbours: BoolArray
    listed_position: FloatArray


class Contact(NamedTuple):
    """A pair of surfaces that touch or have a bridge, SI units.

    Attributes
    ----------
    bridge : int
        Index of the bridge, or -1.
    coupling_sign : float
        -1 if the first bead is the larger one, which changes the sign of the coupling; otherwise 1.
    gap : float
        Gap, negative for an overlap, m.
    radius, mass : float
        Reduced radius (m) and mass (kg).
    friction : SlidingFriction
        Law of friction.
    normal : Vector
        Unit normal from the second body to the first.
    normal_velocity : float
        Velocity at which the centres move apart, m/s.
    sliding_velocity : Vector
        Tangential velocity of the first surface relative to the second, m/s.
    relative_spin : Vector
        Difference of the angular velocities, rad/s.
    first_arm : float
        Distance of the centre of the first bead from the middle of the contact, m.
    first_share : float
        Distance of the contact from the centre of the first bead, over that between the centres; 0
        at a wall.
    first_edge_velocity, second_edge_velocity : Vector
        Velocity at which the point of contact moves along each of the two surfaces, m/s.
    """

    bridge: int
    coupling_sign: float
    gap: float
    radius: float
    mass: float
    friction: SlidingFriction
    normal: Vector
    normal_velocity: float
    sliding_velocity: Vector
    relative_spin: Vector
    first_arm: float
    first_share: float
    first_edge_velocity: Vector
    second_edge_velocity: Vector


@compiled
def vector(values: FloatArray) -> Vector:
    """A row of an array as a tuple."""
    return (values[0], values[1], values[2])


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def add_scaled(a: Vector, scale: float, b: Vector) -> Vector:
    """The sum a + scale b."""
    return (a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2])


@compiled
def bridge_forces(
    bridges: BridgeSplines, bridge: int, gap: float
) -> tuple[float, float, float, float, float]:
    """Capillary force and resistances of a bridge at a gap (m).

    The gap must be below the rupture of the bridge. An overlap (a negative gap) counts as contact.

    Returns
    -------
    pull, normal, sliding, coupling, rolling : float
        Capillary force (N) and resistances (N s/m, N s/m, N s, N m s).
    """
    scale = bridges.spans[bridge, SCALE]
    middle = bridges.spans[bridge, MIDDLE]
    rupture = bridges.spans[bridge, RUPTURE]
    gap = max(gap, 0.0)
    if gap < scale:
        piece = 0
        place_in_piece = gap / scale
    elif gap < middle:
        piece = 1
        place_in_piece = log(gap / scale) / log(middle / scale)
    else:
        piece = 2
        place_in_piece = 1.0 - sqrt((rupture - gap) / (rupture - middle))
    cell = min(int(place_in_piece * CELLS), CELLS - 1)
    t = place_in_piece * CELLS - cell  # place in the cell, 0 to 1
    coefficients = bridges.splines[bridge, piece, cell]
    values = ((coefficients[0] * t + coefficients[1]) * t + coefficients[2]) * t + coefficients[3]
    return values[0], values[1], values[2], values[3], values[4]


@compiled
def contact_force(
    constants: Constants, contact: Contact, spring: FloatArray, advances: bool
) -> tuple[float, Vector, Vector]:
    """Forces between two surfaces that overlap, without their bridge.

    Parameters
    ----------
    constants, contact
        The constants and the pair.
    spring : ndarray, shape (3,)
        Tangential displacement, m. It is changed if time advances.
    advances
        Whether the displacement grows by that of a time step. Otherwise it keeps its length.

    Returns
    -------
    normal : float
        Repulsion, N.
    tangential, couple : Vector
        Tangential force (N) and couple (N m) on the first body.
    """
    root = sqrt(-contact.radius * contact.gap)
    elastic = -4.0 / 3.0 * constants.modulus * root * contact.gap
    damping = 2.0 * sqrt(5.0 / 6.0) * constants.damping * sqrt(contact.mass)
    displacement = vector(spring)
    if advances:
        displacement = add_scaled(displacement, constants.step, contact.sliding_velocity)
        normal_part = dot(displacement, contact.normal)
        displacement = add_scaled(displacement, -normal_part, contact.normal)
    stiffness = 8.0 * constants.shear_modulus * root
    speed = sqrt(dot(contact.sliding_velocity, contact.sliding_velocity))
    friction = contact.friction
    coefficient = friction.at_rest
    if friction.rise:
        coefficient += friction.rise * speed / (speed + friction.half_rise_velocity)
    limit = coefficient * elastic
    spring_force = stiffness * sqrt(dot(displacement, displacement))
    scale = 1.0
    tangential_damping = ZERO
    if spring_force > limit:
        scale = limit / spring_force
    else:
        tangential_damping = add_scaled(ZERO, -damping * sqrt(stiffness), contact.sliding_velocity)
    tangential = add_scaled(tangential_damping, -scale * stiffness, displacement)
    size = sqrt(dot(tangential, tangential))
    if size > limit:
        tangential = add_scaled(ZERO, limit / size, tangential)
    if advances:
        for axis in range(3):
            spring[axis] = scale * displacement[axis]
    couple = ZERO
    spin_rate = sqrt(dot(contact.relative_spin, contact.relative_spin))
    if spin_rate > 0.0:
        normal_part = dot(contact.relative_spin, contact.normal)
        rolling_spin = add_scaled(contact.relative_spin, -normal_part, contact.normal)
        torque = constants.rolling * elastic * contact.radius
        couple = add_scaled(ZERO, -torque / spin_rate, rolling_spin)
    normal_damping = damping * sqrt(2.0 * constants.modulus * root)
    return elastic - normal_damping * contact.normal_velocity, tangential, couple


@compiled
def pair_force(
    constants: Constants, contact: Contact, spring: FloatArray, advances: bool
) -> tuple[Vector, Vector]:
    """Forces between two surfaces that touch or have a bridge; parameters as for `contact_force`.

    The equations of the bridge are those of `walkers.physics.bridge`.

    Returns
    -------
    force, couple : Vector
        Force (N) and couple (N m) on the first body.
    """
    normal = 0.0
    tangential = ZERO
    couple = ZERO
    if contact.gap < 0.0:
        normal, tangential, couple = contact_force(constants, contact, spring, advances)
    if contact.bridge >= 0:
        pull, normal_resistance, sliding, coupling, rolling = bridge_forces(
            constants.bridges, contact.bridge, contact.gap
        )
        coupling = contact.coupling_sign * coupling
        q = cross(contact.normal, contact.relative_spin)
        normal -= pull + normal_resistance * contact.normal_velocity
        tangential = add_scaled(tangential, -sliding, contact.sliding_velocity)
        tangential = add_scaled(tangential, -coupling, q)
        turned_sliding = cross(contact.normal, contact.sliding_velocity)
        couple = add_scaled(couple, coupling, turned_sliding)
        couple = add_scaled(couple, rolling, cross(contact.normal, q))
        resistance = constants.bridges.edge[contact.bridge]
        if resistance > 0.0:
            first = edge_drag(resistance, contact.first_edge_velocity)
            second = edge_drag(resistance, contact.second_edge_velocity)
            tangential = add_scaled(tangential, contact.first_share, first)
            tangential = add_scaled(tangential, contact.first_share - 1.0, second)
            turned_sum = cross(contact.normal, add_scaled(first, 1.0, second))
            lever = contact.first_arm * (1.0 - contact.first_share)
            couple = add_scaled(couple, -lever, turned_sum)
    return add_scaled(tangential, normal, contact.normal), couple


@compiled
def edge_drag(resistance: float, velocity: Vector) -> Vector:
    """Force on a surface along which the edge of a bridge moves with a velocity (m/s), N.

    ``resistance`` is that of the edge, N (s/m)^(2/3) (`walkers.physics.edges`).
    """
    squared = dot(velocity, velocity) + SLOWEST**2
    return add_scaled(ZERO, resistance * squared ** (-1.0 / 6.0), velocity)


@compiled
def add_force(  # noqa: PLR0913, PLR0917 (a kernel, whose arguments are numbers and arrays)
    state: State,
    bead: int,
    sign: float,
    arm: float,
    normal: Vector,
    force_and_couple: tuple[Vector, Vector],
) -> None:
    """Add a force (N) and a couple (N m) to those on a bead.

    ``sign`` is -1 for the reaction on the second body, otherwise 1; ``arm`` is the distance of the
    centre from the middle of the contact, m.
    """
    force, couple = force_and_couple
    moment = cross(normal, force)
    for axis in range(3):
        state.force[bead, axis] += sign * force[axis]
        state.torque[bead, axis] += sign * couple[axis] - arm * moment[axis]


@inlined
def separation(constants: Constants, state: State, i: int, j: int) -> tuple[Vector, float]:
    """Normal and gap of a bead i and a body j, which is a wall if j is not a bead's number.

    Returns
    -------
    normal : Vector
        Unit vector from the second body to the first.
    gap : float
        Gap in m, negative for an overlap.
    """
    position = vector(state.position[i])
    radius = constants.radius[i]
    wall = j - constants.radius.shape[0]
    if wall < 0:
        arm = add_scaled(position, -1.0, vector(state.position[j]))
        distance = sqrt(dot(arm, arm))
        normal = (arm[0] / distance, arm[1] / distance, arm[2] / distance)
        return normal, distance - (radius + constants.radius[j])
    arm = add_scaled(position, -1.0, vector(constants.wall_point[wall]))
    if constants.cylinder_radius[wall] == 0.0:  # a plane
        normal = vector(constants.wall_normal[wall])
        return normal, dot(arm, normal) - radius
    axis_distance = sqrt(arm[0] ** 2 + arm[1] ** 2)
    normal = (-arm[0] / axis_distance, -arm[1] / axis_distance, 0.0)
    return normal, constants.cylinder_radius[wall] - axis_distance - radius


@inlined
def updated_bridge(bridges: BridgeSplines, state: State, i: int, j: int, gap: float) -> int:
    """Index of the bridge of a pair at a gap (m), or -1; bridges form and break here.

    Where liquid is conserved, the films change: a bridge that forms takes its volume from them,
    and a bridge that breaks returns it in proportion to the contributions of full films.
    """
    bridge = state.bridge[i, j]
    if bridge < 0:
        return new_bridge(bridges, state, i, j, gap)
    if gap < bridges.spans[bridge, RUPTURE]:
        return bridge
    if bridges.full_step:
        size_i = bridges.size[i]
        size_j = -1 if j >= bridges.size.shape[0] else bridges.size[j]
        contributions = bridges.contribution[size_i, size_j]
        add_to_films(
            bridges, state, i, j, bridges.volume[bridge], (contributions[0], contributions[1])
        )
    return -1


@inlined
def new_bridge(bridges: BridgeSplines, state: State, i: int, j: int, gap: float) -> int:
    """Index of the bridge that forms between two bodies at a gap (m), or -1.

    A bridge takes liquid in proportion to what the films offer. Bridges to walls form after bridges
    between beads, from the rest of the films.
    """
    size_i = bridges.size[i]
    if j >= bridges.size.shape[0]:
        size_j = -1
        first_full, second_full = bridges.contribution[size_i, size_j]
        first_offer = first_full * state.film[i]
        second_offer = 0.0
    else:
        size_j = bridges.size[j]
        first_full, second_full = bridges.contribution[size_i, size_j]
        first_offer = first_full * state.previous_film[i]
        second_offer = second_full * state.previous_film[j]
    bridge = bridges.first_bridge[size_i, size_j]
    if bridges.full_step:
        step = volume_step(bridges, (first_offer + second_offer) / (first_full + second_full))
        if step < 0:
            return -1
        bridge += step
    if gap > bridges.spans[bridge, FORMATION] or gap >= bridges.spans[bridge, RUPTURE]:
        return -1
    if bridges.full_step:
        offers = (first_offer, second_offer)
        add_to_films(bridges, state, i, j, -bridges.volume[bridge], offers)
    return bridge


@compiled
def volume_step(bridges: BridgeSplines, share: float) -> int:
    """Number of steps of √2 from the smallest volume to that of a bridge of films.

    Parameters
    ----------
    bridges
        The bridges, where liquid is conserved.
    share
        What the films offer, over what full films contribute.

    Returns
    -------
    int
        The step of the nearest volume, or -1 if the offer is too small for the smallest one.
    """
    least = -bridges.full_step
    level = least - 1
    if share > 0.0:
        level = round(2.0 * log2(share))
    # As in engine/law.h, the smallest volume may be at most 1.2 times what the films offer.
    if level < least and 1.2 * share < 2.0 ** (-0.5 * bridges.full_step):
        return -1
    return bridges.full_step + min(max(level, least), 1)


@compiled
def add_to_films(  # noqa: PLR0913, PLR0917 (a kernel, whose arguments are numbers and arrays)
    bridges: BridgeSplines,
    state: State,
    i: int,
    j: int,
    volume: float,
    weights: tuple[float, float],
) -> None:
    """Distribute a volume (m³), negative to take it away, over the films of a pair by weights."""
    part = volume / (weights[0] + weights[1])
    state.film[i] += part * weights[0] / bridges.liquid[i]
    if j < bridges.size.shape[0]:
        state.film[j] += part * weights[1] / bridges.liquid[j]


@compiled
def list_neighbours(constants: Constants, state: State) -> None:
    """List the pairs of beads that are closer than the sum of their search radii.

    Changes ``neighbours`` of the state above its diagonal (i < j), and remembers the present
    positions as ``listed_position``.
    """
    state.listed_position[:] = state.position
    beads = constants.radius.shape[0]
    for i in range(beads):
        for j in range(i + 1, beads):
            arm = add_scaled(vector(state.position[i]), -1.0, vector(state.position[j]))
            limit = constants.search_radius[i] + constants.search_radius[j]
            state.neighbours[i, j] = sqrt(dot(arm, arm)) < limit


@compiled
def body_acceleration(constants: Constants, clock: int) -> Vector:
    """Gravity and inertial acceleration of the frame of the walls at a step, m/s²."""
    acceleration = vector(constants.gravity)
    if clock < 0:
        return acceleration
    for number in range(constants.harmonics.shape[0]):
        harmonic = constants.harmonics[number]
        direction = (harmonic[0], harmonic[1], harmonic[2])
        phase = harmonic[3] * clock * constants.step + harmonic[5]
        acceleration = add_scaled(acceleration, harmonic[4] * sin(phase), direction)
    if constants.inertial_acceleration.shape[0]:
        recorded = vector(constants.inertial_acceleration[clock])
        acceleration = add_scaled(acceleration, 1.0, recorded)
    return acceleration


@inlined
def contact_of(  # noqa: PLR0913, PLR0917 (a kernel, whose arguments are numbers and arrays)
    constants: Constants, state: State, i: int, j: int, normal: Vector, gap: float
) -> Contact:
    """The contact of a bead i with a bead or wall j, from their normal, gap (m) and velocities."""
    bridge = state.bridge[i, j]
    arm = constants.radius[i] + 0.5 * gap
    spin = vector(state.spin[i])
    velocity = vector(state.velocity[i])
    turning = add_scaled(ZERO, arm, spin)
    relative_spin = spin
    radius = constants.radius[i]
    mass = constants.mass[i]
    friction = constants.friction_walls
    coupling_sign = 1.0
    first_share = 0.0
    second_turning = ZERO
    if j < constants.radius.shape[0]:
        other_radius = constants.radius[j]
        other_mass = constants.mass[j]
        other_spin = vector(state.spin[j])
        velocity = add_scaled(velocity, -1.0, vector(state.velocity[j]))
        turning = add_scaled(turning, other_radius + 0.5 * gap, other_spin)
        relative_spin = add_scaled(spin, -1.0, other_spin)
        if radius > other_radius:
            coupling_sign = -1.0
        second_turning = add_scaled(ZERO, other_radius + 0.5 * gap, other_spin)
        first_share = arm / (arm + other_radius + 0.5 * gap)
        radius = radius * other_radius / (radius + other_radius)
        mass = mass * other_mass / (mass + other_mass)
        friction = constants.friction_beads
    normal_velocity = dot(velocity, normal)
    tangential_velocity = add_scaled(velocity, -normal_velocity, normal)
    sliding_velocity = add_scaled(tangential_velocity, 1.0, cross(normal, turning))
    first_turning = add_scaled(ZERO, arm, spin)
    first_edge_velocity = add_scaled(
        cross(first_turning, normal), -first_share, tangential_velocity
    )
    second_edge_velocity = add_scaled(
        cross(normal, second_turning), 1.0 - first_share, tangential_velocity
    )
    return Contact(
        bridge,
        coupling_sign,
        gap,
        radius,
        mass,
        friction,
        normal,
        normal_velocity,
        sliding_velocity,
        relative_spin,
        arm,
        first_share,
        first_edge_velocity,
        second_edge_velocity,
    )


@compiled
def update_forces(constants: Constants, state: State, clock: int, advances: bool) -> None:
    """Compute all forces and torques at the positions and velocities of the state.

    They are those of weight, inertia, contacts and bridges. Bridges form and break; springs grow by
    the displacement of a time step if time ``advances``. ``clock`` is the number of the step.
    """
    beads = constants.radius.shape[0]
    acceleration = body_acceleration(constants, clock)
    for bead in range(beads):
        for axis in range(3):
            state.force[bead, axis] = constants.mass[bead] * acceleration[axis]
            state.torque[bead, axis] = 0.0
    for i in range(beads):
        for j in range(i + 1, beads + constants.wall_point.shape[0]):
            if j < beads and not state.neighbours[i, j]:
                continue
            normal, gap = separation(constants, state, i, j)
            bridge = updated_bridge(constants.bridges, state, i, j, gap)
            state.bridge[i, j] = bridge
            if gap >= 0.0:
                state.spring[i, j, :] = 0.0
                if bridge < 0:
                    continue
            contact = contact_of(constants, state, i, j, normal, gap)
            acting = pair_force(constants, contact, state.spring[i, j], advances)
            add_force(state, i, 1.0, constants.radius[i] + 0.5 * gap, normal, acting)
            if j < beads:
                add_force(state, j, -1.0, constants.radius[j] + 0.5 * gap, normal, acting)
    state.previous_film[:] = state.film


@compiled
def kick(constants: Constants, state: State) -> None:
    """Advance velocities and spins by half a step."""
    half_step = 0.5 * constants.step
    for bead in range(constants.radius.shape[0]):
        step_over_mass = half_step / constants.mass[bead]
        step_over_inertia = step_over_mass / (0.4 * constants.radius[bead] ** 2)
        for axis in range(3):
            state.velocity[bead, axis] += step_over_mass * state.force[bead, axis]
            state.spin[bead, axis] += step_over_inertia * state.torque[bead, axis]


@compiled
def drift(constants: Constants, state: State) -> float:
    """Advance positions by a step; return the largest squared move since the listing, m²."""
    largest = 0.0
    for bead in range(constants.radius.shape[0]):
        squared_distance = 0.0
        for axis in range(3):
            state.position[bead, axis] += constants.step * state.velocity[bead, axis]
            difference = state.position[bead, axis] - state.listed_position[bead, axis]
            squared_distance += difference**2
        largest = max(largest, squared_distance)
    return largest


@compiled
def advance(
    constants: Constants, state: State, clock: int, steps_per_frame: int, frames: FloatArray
) -> None:
    """Integrate, and write frames.

    Parameters
    ----------
    constants, state
        The constants, and the state, which changes.
    clock
        Number of the step of the state.
    steps_per_frame
        Number of steps between frames.
    frames : ndarray, shape (F, N, 9)
        Gets position (m), velocity (m/s) and spin (rad/s) of the beads.
    """
    relist_limit = (0.4 * constants.skin) ** 2
    list_neighbours(constants, state)
    for number in range(frames.shape[0] * steps_per_frame):
        kick(constants, state)
        largest_move = drift(constants, state)
        update_forces(constants, state, clock + number + 1, True)
        kick(constants, state)
        if (number + 1) % steps_per_frame == 0:
            frame = frames[(number + 1) // steps_per_frame - 1]
            frame[:, :3] = state.position
            frame[:, 3:6] = state.velocity
            frame[:, 6:] = state.spin
        if largest_move > relist_limit:
            list_neighbours(constants, state)
