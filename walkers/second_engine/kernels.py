"""The second engine's formulas and its integration, compiled by numba.

Normals point from the second body (or the wall) to the first; h is the gap, δ = -h the overlap. Two surfaces meet by
`meet`, whose terms are Hertz's repulsion with Tsuji's damping, Mindlin's spring with damping, both together no larger
than μ times the elastic repulsion, rolling friction, and a bridge, whose pull and resistances are splines (`BridgeSplines`).
Forces are those at the new places, of the velocities half a step before (velocity Verlet with the forces evaluated once
a step: L. Verlet, Phys. Rev. 159 (1967) 98; in granular codes as in Plimpton, J. Comput. Phys. 117 (1995) 1, doi
10.1006/jcph.1995.1039).

References
----------
H. Hertz, J. reine angew. Math. 92 (1881) 156; R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; Y. Tsuji, T. Tanaka,
T. Ishida, Powder Technology 71 (1992) 239, doi 10.1016/0032-5910(92)88030-L (damping).
J. Ai, J.-F. Chen, J. M. Rotter, J. Y. Ooi, Powder Technology 206 (2011) 269, doi 10.1016/j.powtec.2010.09.030, model A
(rolling friction).
"""

from __future__ import annotations

from math import log, log2, sin, sqrt
from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray, Vector

compiled = numba.njit(cache=True, error_model="numpy")

CELLS = 512
"""Cells of each of the three pieces of a bridge's splines."""
FORMATION, SCALE, MIDDLE, RUPTURE = range(4)
NONE: Vector = (0.0, 0.0, 0.0)


class BridgeSplines(NamedTuple):
    """T bridges as splines in h up to the scale, in ln h up to the middle, and in √(rupture - h) up to the rupture.

    ``spans`` (T, 4): gaps at which a bridge forms, pieces end, and it breaks, m; ``splines`` (T, 3, CELLS, 4, 5):
    coefficients of each cell, highest power first, of pull (N) and resistances; ``kind`` (N,): index of each bead's
    radius; ``between`` (K, K + 1): index of the bridge between two kinds, and in the last column to walls.

    ``volume`` (T,), m³. Where liquid is conserved, two kinds have bridges of several volumes, in steps of √2 from the
    index on; full films give the volume after a number of ``steps``, else 0. ``full`` (K, K + 1, 2): contributions of
    full films of the first and second kind to their bridge, m³; ``liquid`` (N,): the liquid of each bead, m³.
    """

    spans: FloatArray
    splines: FloatArray
    kind: IntArray
    between: IntArray
    volume: FloatArray
    steps: int
    full: FloatArray
    liquid: FloatArray


class Constants(NamedTuple):
    """Constants: N beads, W walls (``hollow``: radii of cylinders, 0 for planes), H harmonics; SI units.

    Beads are near each other if they are closer than the sum of their ``reach`` (N,), which includes the ``skin``.

    ``harmonics`` (H, 6) are directions, ω, accelerations and phases; ``course`` has the inertial acceleration at each
    step of a drive with a ramp or from a record, else no rows; moduli are E* and G*, ``damping`` is β. Rolling
    friction is the same for beads and walls.
    """

    step: float
    radius: FloatArray
    mass: FloatArray
    point: FloatArray
    normal: FloatArray
    hollow: FloatArray
    gravity: FloatArray
    harmonics: FloatArray
    course: FloatArray
    modulus: float
    shear_modulus: float
    damping: float
    friction_beads: float
    friction_walls: float
    rolling: float
    reach: FloatArray
    skin: float
    bridges: BridgeSplines


class State(NamedTuple):
    """State of N beads, arrays of shape (N, 3), and of their contacts with each other and W walls.

    ``film`` (N,): liquid on a bead, not in bridges, over its whole liquid; ``offered`` (N,): the same at the end of the
    step before: bridges between beads form from it. A contact has a bead and a bead of a higher number, or a wall
    (numbered after the beads): ``spring`` (N, N + W, 3) has tangential displacements, m, ``bridge`` (N, N + W) the
    index of the bridge, or -1. ``near`` (N, N) are the beads that may meet before a bead has moved by nearly half the
    ``skin`` from its place ``listed`` (N, 3).
    """

    position: FloatArray
    velocity: FloatArray
    spin: FloatArray
    force: FloatArray
    torque: FloatArray
    film: FloatArray
    offered: FloatArray
    spring: FloatArray
    bridge: IntArray
    near: npt.NDArray[np.bool_]
    listed: FloatArray


class Meeting(NamedTuple):
    """State of a pair: index of the bridge or -1, gap, reduced radius and mass, friction, normal, and velocities.

    ``order`` is -1 if the first bead is the larger one, which changes the sign of the coupling; ``apart`` is the normal
    velocity of the centres, ``slide`` the sliding velocity of the surfaces (m/s), ``turn`` the difference of the spins
    (rad/s).
    """

    bridge: int
    order: float
    gap: float
    radius: float
    mass: float
    friction: float
    n: Vector
    apart: float
    slide: Vector
    turn: Vector


@compiled
def vector(values: FloatArray) -> Vector:
    """A row as a tuple."""
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
def plus(a: Vector, scale: float, b: Vector) -> Vector:
    """The first, and the second times a number."""
    return (a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2])


@compiled
def bridge_forces(
    b: BridgeSplines, bridge: int, gap: float
) -> tuple[float, float, float, float, float]:
    """Pull (N) and resistances: normal, sliding (N s/m), coupling (N s), rolling (N m s)."""
    scale, middle, rupture = (
        b.spans[bridge, SCALE],
        b.spans[bridge, MIDDLE],
        b.spans[bridge, RUPTURE],
    )
    gap = max(gap, 0.0)
    if gap < scale:
        piece, place = 0, gap / scale
    elif gap < middle:
        piece, place = 1, log(gap / scale) / log(middle / scale)
    else:
        piece, place = 2, 1.0 - sqrt((rupture - gap) / (rupture - middle))
    cell = min(int(place * CELLS), CELLS - 1)
    t = place * CELLS - cell
    f = b.splines[bridge, piece, cell]
    values = ((f[0] * t + f[1]) * t + f[2]) * t + f[3]
    return values[0], values[1], values[2], values[3], values[4]


@compiled
def touch(
    c: Constants, m: Meeting, spring: FloatArray, moves: bool
) -> tuple[float, Vector, Vector]:
    """Normal force (N), tangential force (N) and couple (N m) on the first of two surfaces that overlap.

    The ``spring`` (m) changes if time advances (``moves``); otherwise it keeps its length.
    """
    root = sqrt(-m.radius * m.gap)
    elastic = -4.0 / 3.0 * c.modulus * root * m.gap
    damping = 2.0 * sqrt(5.0 / 6.0) * c.damping * sqrt(m.mass)
    stretch = vector(spring)
    if moves:
        stretch = plus(stretch, c.step, m.slide)
        stretch = plus(stretch, -dot(stretch, m.n), m.n)
    stiffness, limit = 8.0 * c.shear_modulus * root, m.friction * elastic
    held = stiffness * sqrt(dot(stretch, stretch))
    scale, along = 1.0, NONE
    if held > limit:
        scale = limit / held
    else:
        along = plus(NONE, -damping * sqrt(stiffness), m.slide)
    tangential = plus(along, -scale * stiffness, stretch)
    size = sqrt(dot(tangential, tangential))
    if size > limit:
        tangential = plus(NONE, limit / size, tangential)
    if moves:
        for axis in range(3):
            spring[axis] = scale * stretch[axis]
    turning, couple = sqrt(dot(m.turn, m.turn)), NONE
    if turning > 0.0:
        rolls = plus(m.turn, -dot(m.turn, m.n), m.n)
        couple = plus(NONE, -c.rolling * elastic * m.radius / turning, rolls)
    return elastic - damping * sqrt(2.0 * c.modulus * root) * m.apart, tangential, couple


@compiled
def meet(c: Constants, m: Meeting, spring: FloatArray, moves: bool) -> tuple[Vector, Vector]:
    """Force (N) and couple (N m) on the first of two surfaces that touch or have a bridge."""
    normal, tangential, couple = touch(c, m, spring, moves) if m.gap < 0.0 else (0.0, NONE, NONE)
    if m.bridge >= 0:
        pull, resists, slides, couples, rolls = bridge_forces(c.bridges, m.bridge, m.gap)
        q, couples = cross(m.n, m.turn), m.order * couples
        normal -= pull + resists * m.apart
        tangential = plus(plus(tangential, -slides, m.slide), -couples, q)
        couple = plus(plus(couple, couples, cross(m.n, m.slide)), rolls, cross(m.n, q))
    return plus(tangential, normal, m.n), couple


@compiled
def push(
    state: State, bead: int, sign: float, arm: float, n: Vector, acting: tuple[Vector, Vector]
) -> None:
    """A force (N) and a couple (N m), or their reaction (``sign`` -1), on a bead, ``arm`` (m) from the contact."""
    force, couple = acting
    turn = cross(n, force)
    for axis in range(3):
        state.force[bead, axis] += sign * force[axis]
        state.torque[bead, axis] += sign * couple[axis] - arm * turn[axis]


@compiled
def separation(c: Constants, state: State, i: int, j: int) -> tuple[Vector, float]:
    """Normal from the second body, a bead or a wall, to the first, and the gap (m)."""
    place, wall = vector(state.position[i]), j - c.radius.shape[0]
    if wall < 0:
        away = plus(place, -1.0, vector(state.position[j]))
        distance = sqrt(dot(away, away))
        return (away[0] / distance, away[1] / distance, away[2] / distance), distance - (
            c.radius[i] + c.radius[j]
        )
    away, n = plus(place, -1.0, vector(c.point[wall])), vector(c.normal[wall])
    if c.hollow[wall] == 0.0:
        return n, dot(away, n) - c.radius[i]
    out = sqrt(away[0] ** 2 + away[1] ** 2)
    return (-away[0] / out, -away[1] / out, 0.0), c.hollow[wall] - out - c.radius[i]


@compiled
def bridge_of(b: BridgeSplines, state: State, i: int, j: int, held: int, gap: float) -> int:
    """Index of the bridge of a pair, or -1; a bridge that forms takes its volume from films, and later returns it.

    It takes liquid in proportion to the films' offers, and returns it in proportion to the contributions of full films.
    Bridges to walls form after bridges between beads, from the rest of the films.
    """
    beads = b.kind.shape[0]
    wall = j >= beads
    kinds = b.kind[i], -1 if wall else b.kind[j]
    if held < 0:
        held = b.between[kinds]
        first, second = b.full[kinds]
        offers = (
            (first * state.film[i], 0.0)
            if wall
            else (first * state.offered[i], second * state.offered[j])
        )
        if b.steps:
            part = (offers[0] + offers[1]) / (first + second)
            level = round(2.0 * log2(part)) if part > 0.0 else -b.steps - 1
            if level < -b.steps and 1.2 * part < 2.0 ** (-0.5 * b.steps):
                return -1
            held += b.steps + min(max(level, -b.steps), 1)
        if gap > b.spans[held, FORMATION] or gap >= b.spans[held, RUPTURE]:
            return -1
        sign = -1.0
    elif gap < b.spans[held, RUPTURE]:
        return held
    else:
        offers, sign = (b.full[kinds][0], b.full[kinds][1]), 1.0
    if b.steps:
        part = sign * b.volume[held] / (offers[0] + offers[1])
        state.film[i] += part * offers[0] / b.liquid[i]
        if not wall:
            state.film[j] += part * offers[1] / b.liquid[j]
    return held if sign < 0.0 else -1


@compiled
def look_around(c: Constants, state: State) -> None:
    """List the beads that are near each other."""
    state.listed[:] = state.position
    for i in range(c.radius.shape[0]):
        for j in range(i + 1, c.radius.shape[0]):
            away = plus(vector(state.position[i]), -1.0, vector(state.position[j]))
            state.near[i, j] = sqrt(dot(away, away)) < c.reach[i] + c.reach[j]


@compiled
def forces(c: Constants, state: State, clock: int, moves: bool) -> None:
    """All forces and torques at the places and velocities of the state: weight, inertia, contacts and bridges."""
    beads, total = c.radius.shape[0], vector(c.gravity)
    if clock >= 0:
        for number in range(c.harmonics.shape[0]):
            wave = c.harmonics[number]
            total = plus(
                total,
                wave[4] * sin(wave[3] * clock * c.step + wave[5]),
                (wave[0], wave[1], wave[2]),
            )
        if c.course.shape[0]:
            total = plus(total, 1.0, vector(c.course[clock]))
    for bead in range(beads):
        for axis in range(3):
            state.force[bead, axis] = c.mass[bead] * total[axis]
            state.torque[bead, axis] = 0.0
    for i in range(beads):
        for j in range(i + 1, beads + c.point.shape[0]):
            if j < beads and not state.near[i, j]:
                continue
            n, gap = separation(c, state, i, j)
            bridge = state.bridge[i, j] = bridge_of(c.bridges, state, i, j, state.bridge[i, j], gap)
            if gap >= 0.0:
                state.spring[i, j, :] = 0.0
                if bridge < 0:
                    continue
            arm, spin = c.radius[i] + 0.5 * gap, vector(state.spin[i])
            between, turn, turning = vector(state.velocity[i]), spin, plus(NONE, arm, spin)
            radius, mass, friction, order, other_arm = (
                c.radius[i],
                c.mass[i],
                c.friction_walls,
                1.0,
                0.0,
            )
            if j < beads:
                other_arm, other_spin = c.radius[j] + 0.5 * gap, vector(state.spin[j])
                between = plus(between, -1.0, vector(state.velocity[j]))
                turn, turning = plus(spin, -1.0, other_spin), plus(turning, other_arm, other_spin)
                radius = c.radius[i] * c.radius[j] / (c.radius[i] + c.radius[j])
                mass = c.mass[i] * c.mass[j] / (c.mass[i] + c.mass[j])
                friction, order = c.friction_beads, -1.0 if c.radius[i] > c.radius[j] else 1.0
            apart = dot(between, n)
            slide = plus(plus(between, -apart, n), 1.0, cross(n, turning))
            m = Meeting(bridge, order, gap, radius, mass, friction, n, apart, slide, turn)
            acting = meet(c, m, state.spring[i, j], moves)
            push(state, i, 1.0, arm, n, acting)
            if j < beads:
                push(state, j, -1.0, other_arm, n, acting)
    state.offered[:] = state.film


@compiled
def kick(c: Constants, state: State) -> None:
    """Advance the velocities by half a step."""
    half = 0.5 * c.step
    for bead in range(c.radius.shape[0]):
        speed = half / c.mass[bead]
        spin = speed / (0.4 * c.radius[bead] ** 2)
        for axis in range(3):
            state.velocity[bead, axis] += speed * state.force[bead, axis]
            state.spin[bead, axis] += spin * state.torque[bead, axis]


@compiled
def advance(c: Constants, state: State, clock: int, every: int, frames: FloatArray) -> None:
    """Integrate from a step on, ``every`` steps for each of the frames, of shape (F, N, 9)."""
    far = (0.4 * c.skin) ** 2
    look_around(c, state)
    for number in range(frames.shape[0] * every):
        kick(c, state)
        farthest = 0.0
        for bead in range(c.radius.shape[0]):
            moved = 0.0
            for axis in range(3):
                state.position[bead, axis] += c.step * state.velocity[bead, axis]
                moved += (state.position[bead, axis] - state.listed[bead, axis]) ** 2
            farthest = max(farthest, moved)
        forces(c, state, clock + number + 1, True)
        kick(c, state)
        if (number + 1) % every == 0:
            frame = frames[(number + 1) // every - 1]
            frame[:, :3] = state.position
            frame[:, 3:6] = state.velocity
            frame[:, 6:] = state.spin
        if farthest > far:
            look_around(c, state)
