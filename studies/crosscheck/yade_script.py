"""What YADE runs: its own contact law and integration, and in each step the forces that it has not.

YADE reads this file as a script, from a folder with ``numbers.json`` (`walkers.studies.crosscheck.yade` has its keys)
and leaves ``frames.bin`` there. It runs in YADE's own Python, so that it needs nothing but that and YADE; `AddedTerms`
is tested without YADE.

YADE's own: spheres and walls, which of them touch, Hertz's and Mindlin's contact with damping and Coulomb's limit
(``Law2_ScGeom_MindlinPhys_Mindlin``), weight and the inertial force of the drive as a gravity that changes with time,
and the motion (``NewtonIntegrator``). Ours: capillary and viscous forces of the bridges, their begin and end, the film,
rolling friction; their formulas and sources are those of `walkers.studies.crosscheck.kernels`, written once more.
"""

from __future__ import annotations

import json
import sys
from array import array
from math import atan, exp, log, pi, sin, sqrt
from pathlib import Path
from typing import Any, NamedTuple

Vector = tuple[float, float, float]
STEEPER = 1.0 / (sqrt(2.0) - 1.0)
"""Modulus of a wall over the beads'. YADE takes a wall for a sphere of the bead's radius, R* = R/2, where a plane has
R* = R; a wall that is so much stiffer has √2 times the effective modulus, and with it the stiffnesses of a plane."""
_ZERO = (0.0, 0.0, 0.0)


class Bridge(NamedTuple):
    """A bridge: its pull is peak (exp(slope h + shift) + offset), N, at a gap h (m) up to rupture (m)."""

    peak: float
    slope: float
    shift: float
    offset: float
    rupture: float

    def pull(self, gap: float) -> float:
        """Capillary attraction at a gap (m), N (Soulié et al. 2006)."""
        return self.peak * (exp(self.slope * max(gap, 0.0) + self.shift) + self.offset)


def bridge_of(tension: float, angle: float, radii: tuple[float, float], volume: float) -> Bridge:
    """The bridge of a volume (m³) between two radii (m); surface tension in N/m, contact angle in rad."""
    larger = max(radii)
    scaled = volume / larger**3
    return Bridge(
        peak=pi * tension * sqrt(radii[0] * radii[1]),
        slope=-1.1 * scaled**-0.53 / larger,
        shift=(-0.148 * log(scaled) - 0.96) * angle**2 - 0.0082 * log(scaled) + 0.48,
        offset=0.0018 * log(scaled) + 0.078,
        rupture=(1.0 + 0.5 * angle) * volume ** (1.0 / 3.0),
    )


def cap(own: float, other: float, content: float) -> float:
    """Liquid that a bead gives to a bridge, m³: radii in m, liquid on it over its volume."""
    return 2.0 / 3.0 * pi * own**3 * content * (1.0 - sqrt(1.0 - (other / (own + other)) ** 2))


def dot(one: Vector, other: Vector) -> float:
    """Scalar product."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def cross(one: Vector, other: Vector) -> Vector:
    """Vector product."""
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )


def plus(one: Vector, other: Vector, times: float = 1.0) -> Vector:
    """A vector and a multiple of another."""
    return (one[0] + times * other[0], one[1] + times * other[1], one[2] + times * other[2])


def tangential(vector: Vector, normal: Vector) -> Vector:
    """A vector without its part along a unit normal."""
    return plus(vector, normal, -dot(vector, normal))


def sliding(normal: Vector, between: Vector, turning: Vector) -> tuple[float, Vector]:
    """Velocity of one surface relative to another, m/s: along the normal, and along the surfaces.

    ``between`` is that of the centres, ``turning`` the sum of the angular velocities, each times its arm, m/s.
    """
    return dot(between, normal), plus(tangential(between, normal), cross(turning, normal), -1.0)


def _wall_of(axis: int, place: float, side: int) -> tuple[Vector, float]:
    """A wall's normal, and its place along that, m."""
    normal = (float(side * (axis == 0)), float(side * (axis == 1)), float(side * (axis == 2)))
    return normal, side * place


class AddedTerms:
    """Forces and torques that YADE has not: bridges, film, rolling friction.

    Parameters
    ----------
    numbers
        As in ``numbers.json``.
    """

    def __init__(self, numbers: dict[str, Any]) -> None:
        self.of = numbers
        self.radius: list[float] = numbers["radius"]
        count = range(len(self.radius))
        self.walls = [_wall_of(wall["axis"], wall["place"], wall["side"]) for wall in numbers["walls"]]
        self.content = [float(numbers["volume_fraction"])] * len(self.radius)
        self.film = [6.0 * pi * numbers["film_viscosity"] * radius for radius in self.radius]
        self.modulus = numbers["youngs_modulus"] / (2.0 * (1.0 - numbers["poissons_ratio"] ** 2))
        self.at_wall = [[False] * len(self.walls) for _ in count]
        self.pairs = [(one, other) for one in count for other in range(one + 1, len(self.radius))]
        self.between = [False] * len(self.pairs)
        self._set_bridges()
        self.reach = [bridge.rupture for bridge in self.wall_bridge]
        """Gaps up to which the film acts, and what two spheres lack of a plane's lubrication, m."""
        self.force: list[Vector] = []
        self.torque: list[Vector] = []

    def _set_bridges(self) -> None:
        """Constants of the bridges with the liquid that beads have now."""
        tension, angle, r = self.of["surface_tension"], self.of["contact_angle"], self.radius
        self.wall_bridge = [
            bridge_of(tension, angle, (own, own), 2.0 / 3.0 * pi * own**3 * content)
            for own, content in zip(r, self.content, strict=True)
        ]
        self.pair_bridge = [
            bridge_of(tension, angle, (r[i], r[j]), cap(r[i], r[j], self.content[i]) + cap(r[j], r[i], self.content[j]))
            for i, j in self.pairs
        ]

    def evaluate(self, position: list[Vector], velocity: list[Vector], spin: list[Vector]) -> None:
        """Set ``force`` (N) and ``torque`` (N m) of all beads from m, m/s and rad/s."""
        self.force = [_ZERO] * len(self.radius)
        self.torque = [_ZERO] * len(self.radius)
        for bead in range(len(self.radius)):
            for wall, (normal, place) in enumerate(self.walls):
                gap = dot(position[bead], normal) - place - self.radius[bead]
                self._wall(bead, wall, (normal, gap), velocity[bead], spin[bead])
        broken = [at for at in range(len(self.pairs)) if self._pair(at, position, velocity, spin)]
        for at in broken:
            self._share_liquid(*self.pairs[at])
        if broken:
            self._set_bridges()

    def _wall(self, bead: int, wall: int, at: tuple[Vector, float], velocity: Vector, spin: Vector) -> None:
        """A bead at a wall, all copies of the wall: the normal and the gap (m)."""
        normal, gap = at
        radius, bridge, copies = self.radius[bead], self.wall_bridge[bead], self.of["wall_copies"]
        self.at_wall[bead][wall] = gap < 0.0 or (self.at_wall[bead][wall] and gap < bridge.rupture)
        if gap >= max(bridge.rupture, self.reach[bead]):
            return
        arm = radius + min(gap, 0.0) / 2.0
        speed, slide = sliding(normal, velocity, (arm * spin[0], arm * spin[1], arm * spin[2]))
        force, drag = 0.0, 0.0
        if self.at_wall[bead][wall]:
            viscous, drag = self._drags(radius / 2.0, gap)
            force, drag = -copies * (viscous * speed + bridge.pull(gap)), copies * drag
        if 0.0 < gap < self.reach[bead]:
            force -= self._missing_drag(radius, gap) * speed
        self._push(bead, 1.0, arm, normal, (force, drag, slide))
        if gap < self.reach[bead]:
            along, film = tangential(velocity, normal), -self.film[bead]
            self._add(bead, (film * along[0], film * along[1], film * along[2]), _ZERO)
        if gap < 0.0:
            self._add(bead, _ZERO, self._rolling(normal, spin, -gap, radius, copies))

    def _pair(self, at: int, position: list[Vector], velocity: list[Vector], spin: list[Vector]) -> bool:
        """Two beads; whether a bridge between them broke."""
        i, j = self.pairs[at]
        (x, y, z), (a, b, c) = position[i], position[j]
        distance = sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2)
        gap = distance - self.radius[i] - self.radius[j]
        bridge, held = self.pair_bridge[at], self.between[at]
        self.between[at] = gap < 0.0 or (held and gap < bridge.rupture)
        if not self.between[at]:
            return held
        normal = ((x - a) / distance, (y - b) / distance, (z - c) / distance)
        arm_i, arm_j = (self.radius[bead] + min(gap, 0.0) / 2.0 for bead in (i, j))
        v, u, w, o = velocity[i], velocity[j], spin[i], spin[j]
        turning = (arm_i * w[0] + arm_j * o[0], arm_i * w[1] + arm_j * o[1], arm_i * w[2] + arm_j * o[2])
        speed, slide = sliding(normal, (v[0] - u[0], v[1] - u[1], v[2] - u[2]), turning)
        reduced = self.radius[i] * self.radius[j] / (self.radius[i] + self.radius[j])
        viscous, drag = self._drags(reduced, gap)
        forces = (-viscous * speed - bridge.pull(gap), drag, slide)
        self._push(i, 1.0, arm_i, normal, forces)
        self._push(j, -1.0, arm_j, normal, forces)
        if gap < 0.0:
            torque = self._rolling(normal, (w[0] - o[0], w[1] - o[1], w[2] - o[2]), -gap, reduced, 1)
            self._add(i, _ZERO, torque)
            self._add(j, _ZERO, (-torque[0], -torque[1], -torque[2]))
        return False

    def _drags(self, reduced: float, gap: float) -> tuple[float, float]:
        """Normal and tangential viscous force over velocity, N s/m, of a reduced radius and a gap, m."""
        near = max(self.of["separation_ratio"], gap / reduced)
        stokes = 6.0 * pi * reduced * self.of["viscosity"]
        return stokes / near, stokes * (8.0 / 15.0 * log(1.0 / near) + 0.9588)

    def _missing_drag(self, radius: float, gap: float) -> float:
        """What two equal spheres, twice, lack of a plane's normal lubrication, N s/m."""
        least = self.of["separation_ratio"]
        halves = 1.0 / max(least, 2.0 * gap / radius)
        return 6.0 * pi * self.of["viscosity"] * radius * (1.0 / max(least, gap / radius) - halves)

    def _rolling(self, normal: Vector, turning: Vector, overlap: float, reduced: float, copies: int) -> Vector:
        """Torque of constant size against a relative rotation (rad/s), N m."""
        length = sqrt(dot(turning, turning))
        if length == 0.0:
            return _ZERO
        elastic = 4.0 / 3.0 * self.modulus * sqrt(reduced * overlap) * overlap
        size = -copies * self.of["rolling_friction"] * elastic * reduced / length
        rolls = tangential(turning, normal)
        return (size * rolls[0], size * rolls[1], size * rolls[2])

    def _push(self, bead: int, sign: float, arm: float, normal: Vector, forces: tuple[float, float, Vector]) -> None:
        """A force, or its reaction, at a surface: normal part (N), drag (N s/m) and sliding velocity (m/s)."""
        along, drag, slide = forces
        pushed = plus(plus(_ZERO, normal, sign * along), slide, -sign * drag)
        # The normal points to the first of two bodies: from each the surface is on its own side.
        self._add(bead, pushed, plus(_ZERO, cross(normal, pushed), -sign * arm))

    def _add(self, bead: int, force: Vector, torque: Vector) -> None:
        self.force[bead] = plus(self.force[bead], force)
        self.torque[bead] = plus(self.torque[bead], torque)

    def _share_liquid(self, i: int, j: int) -> None:
        """The liquid of a bridge that breaks goes to its beads in proportion to their volumes."""
        one, other = self.radius[i], self.radius[j]
        from_i, from_j = cap(one, other, self.content[i]), cap(other, one, self.content[j])
        moved = (from_i + from_j) / (1.0 + (other / one) ** 3) - from_i
        self.content[i] += moved / (4.0 / 3.0 * pi * one**3)
        self.content[j] -= moved / (4.0 / 3.0 * pi * other**3)


def acceleration(numbers: dict[str, Any], step: int) -> Vector:
    """Weight and inertial force over mass at a step of the drive, m/s²."""
    x, y, z = numbers["gravity"]
    if step >= 0:
        for along, across, up, frequency, peak, phase in numbers["harmonics"]:
            now = peak * sin(frequency * step * numbers["time_step"] + phase)
            x, y, z = x + now * along, y + now * across, z + now * up
    return (x, y, z)


def damping_ratio(restitution: float) -> float:
    """YADE's ``betan``, share of critical damping, for a restitution.

    Tsuji's damping force is 2 √(5/6) β √(S m*) v, β = −ln e/√(ln²e + π²), S = 2 E* √(R* δ) (Tsuji, Tanaka, Ishida 1992;
    Antypov, Elliott, EPL 94 (2011) 50004, doi 10.1209/0295-5075/94/50004), YADE's 2 βn √(kn m*) v with the same kn = S.
    YADE's own ``en`` is another model (Thornton et al. 2013): a contact ends where its force is nought.
    """
    return -sqrt(5.0 / 6.0) * log(restitution) / sqrt(log(restitution) ** 2 + pi**2)


def _vector(of: Any) -> Vector:
    """YADE's vector as numbers."""
    return (of[0], of[1], of[2])


class Run:
    """Beads in YADE, and what is done in each of its steps before it moves them.

    YADE's velocities are those half a step before (leap-frog), as LIGGGHTS's are when it evaluates forces: from the
    velocities at the first step half of its kick is taken back, and half a kick is added for each frame.
    """

    def __init__(self, numbers: dict[str, Any]) -> None:
        import yade  # type: ignore[import-not-found, unused-ignore]

        self.omega, self.numbers, self.added = yade.O, numbers, AddedTerms(numbers)
        beads, materials = self._materials(yade)
        for wall in numbers["walls"]:
            for _ in range(numbers["wall_copies"]):  # coincident ones: springs, dashpots and friction as many times
                self.omega.bodies.append(
                    yade.utils.wall(wall["place"], axis=wall["axis"], sense=wall["side"], material=materials[1])
                )
        self.ids = [
            self.omega.bodies.append(yade.utils.sphere(place, radius, material=beads))
            for place, radius in zip(numbers["position"], numbers["radius"], strict=True)
        ]
        self.states = [self.omega.bodies[bead].state for bead in self.ids]
        for state, velocity, spin in zip(self.states, numbers["velocity"], numbers["spin"], strict=True):
            state.vel, state.angVel = velocity, spin
        self.newton = yade.NewtonIntegrator(damping=0.0)
        self.omega.dt = numbers["time_step"]
        self.omega.engines = self._engines(yade)
        self.records = set(numbers["records"])
        self.frames, self.step, self.averaged = array("d"), 0, 0
        self.spins: list[Vector] = [_ZERO] * len(self.ids)

    def _materials(self, yade: Any) -> tuple[Any, tuple[Any, Any]]:
        """The beads' material, and both."""
        modulus, ratio = self.numbers["youngs_modulus"], self.numbers["poissons_ratio"]
        made = [
            yade.FrictMat(young=stiffness * modulus, poisson=ratio, density=self.numbers["density"])
            for stiffness in (1.0, STEEPER)
        ]
        for one in made:
            self.omega.materials.append(one)
        return made[0], (made[0], made[1])

    def _engines(self, yade: Any) -> list[Any]:
        """The steps of YADE's loop: its own but for one."""
        damping = damping_ratio(self.numbers["restitution"])
        friction = ((0, 0, atan(self.numbers["friction_beads"])), (0, 1, atan(self.numbers["friction_walls"])))
        contact = yade.Ip2_FrictMat_FrictMat_MindlinPhys(
            betan=damping, betas=damping, frictAngle=yade.MatchMaker(matches=friction)
        )
        # Sliding velocities are those at the contact point, where the forces act.
        geometry = [
            yade.Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=False),
            yade.Ig2_Wall_Sphere_ScGeom(noRatch=False),
        ]
        sys.modules["__main__"].each_step = self.each_step  # type: ignore[attr-defined]
        return [
            yade.ForceResetter(),
            yade.InsertionSortCollider([yade.Bo1_Sphere_Aabb(), yade.Bo1_Wall_Aabb()]),
            yade.InteractionLoop(geometry, [contact], [yade.Law2_ScGeom_MindlinPhys_Mindlin()]),
            yade.PyRunner(command="each_step()", iterPeriod=1, initRun=True),
            self.newton,
        ]

    def each_step(self) -> None:
        """Add the forces, and record."""
        gravity = acceleration(self.numbers, self.numbers["first_step"] + self.step)
        self.newton.gravity = gravity
        position, velocity, spin = (
            [_vector(getattr(state, name)) for state in self.states] for name in ("pos", "vel", "angVel")
        )
        self.added.evaluate(position, velocity, spin)
        for bead, force, torque in zip(self.ids, self.added.force, self.added.torque, strict=True):
            self.omega.forces.addF(bead, force)
            self.omega.forces.addT(bead, torque)
        kicks, twists = self._half_kicks(gravity)
        if not self.step:
            for at, state in enumerate(self.states):
                state.vel, state.angVel = plus(velocity[at], kicks[at], -1.0), plus(spin[at], twists[at], -1.0)
        else:
            velocity, spin = list(map(plus, velocity, kicks)), list(map(plus, spin, twists))
            self.spins, self.averaged = list(map(plus, self.spins, spin)), self.averaged + 1
        if self.step in self.records:
            self._record(position, velocity, spin)
        self.step += 1

    def _half_kicks(self, gravity: Vector) -> tuple[list[Vector], list[Vector]]:
        """What half a step adds to velocities (m/s) and spins (rad/s), by all forces, YADE's own and the added ones."""
        half, forces = self.numbers["time_step"] / 2.0, self.omega.forces
        kicks = [
            plus(plus(_ZERO, gravity, half), _vector(forces.f(bead)), half / state.mass)
            for bead, state in zip(self.ids, self.states, strict=True)
        ]
        twists = [
            plus(_ZERO, _vector(forces.t(bead)), half / state.inertia[0])
            for bead, state in zip(self.ids, self.states, strict=True)
        ]
        return kicks, twists

    def _record(self, position: list[Vector], velocity: list[Vector], spin: list[Vector]) -> None:
        """A frame, with the spins' means since the one before."""
        for at, spins in enumerate(self.spins):
            mean = plus(_ZERO, spins, 1.0 / self.averaged)
            self.frames.extend([*position[at], *velocity[at], *spin[at], *mean])
        self.spins, self.averaged = [_ZERO] * len(self.ids), 0

    def go(self) -> None:
        """Run up to the last record."""
        self.omega.run(max(self.records) + 1, True)


def main() -> None:
    """Run, from ``numbers.json`` to ``frames.bin``."""
    run = Run(json.loads(Path("numbers.json").read_text("utf-8")))
    run.go()
    with Path("frames.bin").open("wb") as file:
        run.frames.tofile(file)


if __name__ == "__main__":
    main()
