"""The second engine: beads between walls that move on from where they are put, or are put anew step by step."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import inf, log, pi, sqrt

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from walkers.check import kernels
from walkers.check.kernels import CELLS, Bridges, Constants, FloatArray, Pairs, State
from walkers.inputs.boundary import Flat, Wall
from walkers.inputs.case import Case
from walkers.inputs.drive import Vector
from walkers.physics.bridge import BridgeLaw, Surfaces
from walkers.physics.laws import law_of
from walkers.physics.matter import Contact, Liquid

TERMS = ("capillary", "lubrication", "damping", "friction", "rolling-friction", "gravity", "drive")
"""What may be left out: pull and resistances of the bridges, damping of Hertz's contact and of the spring along the
surfaces, all of the tangential contact force, the torque against rolling, weight, the inertial force of the frame."""
_SKIN = 0.4
"""Of the smallest radius: neighbours are listed anew when a bead has gone nearly half as far."""


@dataclass(frozen=True)
class Matter:
    """Density of the beads (kg/m³), how they touch each other and the walls, and the liquid of the bridges."""

    density: float
    contact: Contact
    liquid: Liquid


@dataclass(frozen=True)
class Surroundings:
    """Walls, weight (m/s²) and drive in the frame of the walls.

    ``harmonics`` are those of the inertial acceleration a sin(ωt + φ) from t = 0 on, each a direction, ω (rad/s), a
    (m/s²) and φ (rad).
    """

    walls: Sequence[Wall]
    gravity: Vector = (0.0, 0.0, 0.0)
    harmonics: Sequence[tuple[float, ...]] = ()


@dataclass(frozen=True)
class Beads:
    """Where N beads are: position (m), velocity (m/s), spin (rad/s), each of shape (N, 3), and their radii (m)."""

    radius: FloatArray
    position: FloatArray
    velocity: FloatArray
    spin: FloatArray


class SecondEngine:
    """Beads that move under some laws.

    Parameters
    ----------
    beads
        Where they are at first. What touches has a bridge; springs are unstretched.
    matter, surroundings
        What acts on them.
    time_step
        s.
    clock
        Step that it is; the drive begins with step 0.
    without
        Those of the `TERMS` that do not act.
    """

    def __init__(
        self,
        beads: Beads,
        matter: Matter,
        surroundings: Surroundings,
        time_step: float,
        clock: int = 0,
        without: Collection[str] = (),
    ) -> None:
        if unknown := set(without) - set(TERMS):
            raise ValueError(f"without {unknown}: expected some of {', '.join(TERMS)}")
        self.clock = clock
        self.radius = np.ascontiguousarray(beads.radius, dtype=np.float64)
        self.constants = _constants(self.radius, matter, surroundings, time_step, without)
        self.state = _state(beads, len(self.constants.point))
        self._skin = _SKIN * float(self.radius.min())
        self._reach = self.radius + (self.constants.bridges.spans[:, kernels.RUPTURE].max() + self._skin) / 2.0
        none = np.zeros(0, dtype=np.int64)
        self.pairs = Pairs(none, none, np.zeros((0, 3)), np.zeros(0, dtype=np.bool_))
        self._list()
        self.evaluate()

    def evaluate(self) -> None:
        """Evaluate the forces once more, at the places and velocities that there are, as an engine does that starts."""
        self._advance(self.clock, (self.clock, 1), np.empty((0, len(self.radius), 9)))

    def run(self, steps: int, every: int) -> FloatArray:
        """Move on.

        Parameters
        ----------
        steps
            How many.
        every
            Steps between records.

        Returns
        -------
        ndarray, shape (steps // every, N, 9)
            Position, velocity and spin after each ``every`` steps.
        """
        begin, end = self.clock, self.clock + steps
        frames = np.empty((steps // every, len(self.radius), 9))
        while self.clock < end:
            self.clock = self._advance(end, (begin, every), frames)
            self._list()
        return frames

    def follow(self, position: FloatArray, velocity: FloatArray, spin: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Put the beads where another engine had them in the next step: the forces (N) and torques (N m) on them there.

        Parameters
        ----------
        position, velocity, spin
            Of shape (N, 3); velocities are those that the forces are to be evaluated with.
        """
        self.state.position[:], self.state.velocity[:], self.state.spin[:] = position, velocity, spin
        self.clock += 1
        self._list()
        kernels.forces(self.constants, self.state, self.pairs, self.clock, True)
        return self.state.force.copy(), self.state.torque.copy()

    def _advance(self, end: int, records: tuple[int, int], frames: FloatArray) -> int:
        """Move on to a step, or until neighbours are to be listed anew: the step that it is then."""
        clock = (self.clock, records[0], end, records[1])
        return kernels.advance(self.constants, self.state, self.pairs, self._listed, self._skin, clock, frames)

    def bridges(self) -> list[tuple[int, int]]:
        """Pairs of beads that a bridge holds together."""
        held = self.pairs.bridged
        return list(zip(self.pairs.first[held].tolist(), self.pairs.second[held].tolist(), strict=True))

    def _list(self) -> None:
        """List the neighbours; contacts and bridges go on."""
        before, self._listed = self.pairs, self.state.position.copy()
        near = cKDTree(self._listed).query_pairs(2.0 * float(self._reach.max()), output_type="ndarray").astype(np.int64)
        apart = np.linalg.norm(self._listed[near[:, 0]] - self._listed[near[:, 1]], axis=1)
        near = near[apart < self._reach[near].sum(axis=1)]
        count = len(self.radius)
        keys = np.sort(near.min(axis=1) * count + near.max(axis=1))
        pairs = Pairs(keys // count, keys % count, np.zeros((len(keys), 3)), np.zeros(len(keys), dtype=np.bool_))
        known = before.first * count + before.second
        _, new, old = np.intersect1d(keys, known, assume_unique=True, return_indices=True)
        pairs.spring[new], pairs.bridged[new] = before.spring[old], before.bridged[old]
        self.pairs = pairs


@lru_cache(maxsize=4096)
def _splined(law: BridgeLaw, surfaces: Surfaces) -> tuple[FloatArray, FloatArray]:
    """A bridge's row of `Bridges.spans` and its splines; a kink may be at the scale."""
    curve = law(surfaces)
    end, scale = curve.rupture, curve.scale or surfaces.closest
    scale = scale if scale < end else 0.4 * end
    middle = max(0.5 * end, 0.5 * (scale + end))
    t = np.linspace(0.0, 1.0, CELLS + 1)
    pieces = (scale * t, scale * (middle / scale) ** t, end - (end - middle) * (1.0 - t) ** 2)
    splines = [CubicSpline(CELLS * t, curve.forces(gaps).columns()).c.transpose(1, 0, 2) for gaps in pieces]
    return np.array([curve.formation, scale, middle, end]), np.stack(splines)


def _bridges(radius: FloatArray, matter: Matter, without: Collection[str]) -> Bridges:
    liquid = matter.liquid
    sizes, kind = np.unique(radius, return_inverse=True)
    others = [*sizes.tolist(), inf]
    between = np.empty((len(sizes), len(others)), dtype=np.int64)
    made: list[tuple[FloatArray, FloatArray]] = []
    for row, one in enumerate(sizes.tolist()):
        for column, other in enumerate(others):
            if column < row:
                between[row, column] = between[column, row]
                continue
            between[row, column] = len(made)
            surfaces = Surfaces.of(one, other, liquid, matter.contact.minimum_separation_ratio)
            made.append(_splined(law_of(liquid), surfaces))
    acts = np.array(["capillary" not in without, *["lubrication" not in without] * 4], dtype=np.float64)
    spans, splines = np.stack([one for one, _ in made]), np.stack([one for _, one in made]) * acts
    return Bridges(spans, splines, kind.astype(np.int64), between)


def _constants(
    radius: FloatArray, matter: Matter, around: Surroundings, time_step: float, without: Collection[str]
) -> Constants:
    contact = matter.contact
    modulus, ratio, loss = contact.youngs_modulus, contact.poissons_ratio, log(contact.restitution)
    damping, friction, rolling, gravity, drive = (term not in without for term in TERMS[2:])
    flat = [wall if isinstance(wall, Flat) else None for wall in around.walls]
    none = (0.0, 0.0, 0.0)
    return Constants(
        step=time_step,
        radius=radius,
        mass=4.0 / 3.0 * pi * radius**3 * matter.density,
        point=np.array([wall.point if wall else none for wall in flat]).reshape(-1, 3),
        normal=np.array([wall.normal if wall else none for wall in flat]).reshape(-1, 3),
        hollow=np.array([0.0 if isinstance(wall, Flat) else wall.radius for wall in around.walls]),
        gravity=np.array(around.gravity) * gravity,
        harmonics=np.array(around.harmonics if drive else (), dtype=np.float64).reshape(-1, 6),
        modulus=modulus / (2.0 * (1.0 - ratio**2)),
        shear_modulus=modulus / (4.0 * (1.0 + ratio) * (2.0 - ratio)),
        damping=-loss / sqrt(loss**2 + pi**2) * damping,
        friction_beads=contact.friction_bead_bead * friction,
        friction_walls=contact.friction_bead_wall * friction,
        rolling=contact.rolling_friction * rolling,
        bridges=_bridges(radius, matter, without),
    )


def _state(beads: Beads, walls: int) -> State:
    count = len(beads.radius)
    return State(
        position=np.array(beads.position, dtype=np.float64, order="C"),
        velocity=np.array(beads.velocity, dtype=np.float64, order="C"),
        spin=np.array(beads.spin, dtype=np.float64, order="C"),
        force=np.zeros((count, 3)),
        torque=np.zeros((count, 3)),
        wall_spring=np.zeros((count, walls, 3)),
        wall_bridged=np.zeros((count, walls), dtype=np.bool_),
    )


def engine_at(
    case: Case, beads: Beads, clock: int = 0, walls: Sequence[Wall] = (), without: Collection[str] = ()
) -> SecondEngine:
    """The second engine with a case's matter, walls (or some others) and drive, and some beads, at a step."""
    harmonics = [
        (*one.direction, one.angular_frequency, one.peak_acceleration, one.phase) for one in case.drive.harmonics
    ]
    around = Surroundings(walls or case.boundary.walls, case.gravity_vector, harmonics)
    matter = Matter(case.density, case.contact, case.liquid)
    return SecondEngine(beads, matter, around, case.run.time_step, clock, without)
