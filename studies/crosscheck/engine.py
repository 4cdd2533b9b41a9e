"""The second engine: beads between walls that move on from where they are put."""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np
from scipy.spatial import cKDTree

from walkers.studies.crosscheck import kernels
from walkers.studies.crosscheck.kernels import Constants, FloatArray, IntArray, Pairs, State
from walkers.studies.crosscheck.laws import ForceTable, Laws

_STATIC = {"none": kernels.NONE, "velocity": kernels.BY_VELOCITY, "stick-slip": kernels.STICK_SLIP}
_WALLS = {"halves": kernels.HALVES, "plane-normal": kernels.PLANE_NORMAL, "plane": kernels.PLANE}
_SKIN = 0.4
"""Of the smallest radius: neighbours are listed anew when a bead has gone nearly half as far."""


@dataclass(frozen=True)
class Matter:
    """What beads, walls and liquid are made of, SI units.

    Attributes
    ----------
    density
        Of the beads, kg/m³.
    youngs_modulus, poissons_ratio, restitution
        Of beads and walls; Pa and pure numbers.
    friction_beads, friction_walls, rolling_friction
        Coefficients between beads, at walls, at both.
    surface_tension, viscosity, film_viscosity
        N/m; Pa s of the bridges and of the film on the walls.
    volume_fraction, contact_angle
        Liquid on a bead over its volume; effective angle, rad.
    separation_ratio
        Gap over reduced radius below which viscous forces stop growing.
    """

    density: float
    youngs_modulus: float
    poissons_ratio: float = 0.3
    restitution: float = 1.0
    friction_beads: float = 0.0
    friction_walls: float = 0.0
    rolling_friction: float = 0.0
    surface_tension: float = 0.0
    viscosity: float = 0.0
    film_viscosity: float = 0.0
    volume_fraction: float = 0.01
    contact_angle: float = 0.0
    separation_ratio: float = 0.01


@dataclass(frozen=True)
class Surroundings:
    """Walls, weight and drive in the frame of the walls.

    Attributes
    ----------
    point, normal : ndarray, shape (W, 3)
        Of the walls: a point of each, m, and its unit normal toward the beads.
    gravity : tuple of float
        m/s².
    harmonics : ndarray, shape (H, 6)
        Of the inertial acceleration a sin(ωt + φ): direction, ω (rad/s), a (m/s²), φ (rad); from t = 0 on.
    """

    point: FloatArray
    normal: FloatArray
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    harmonics: FloatArray | None = None


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
    matter, surroundings, laws
        What acts on them.
    time_step
        s.
    clock
        Step that it is; the drive begins with step 0.
    """

    def __init__(
        self,
        beads: Beads,
        matter: Matter,
        surroundings: Surroundings,
        laws: Laws,
        time_step: float,
        clock: int = 0,
    ) -> None:
        self.clock = clock
        self.radius = np.ascontiguousarray(beads.radius, dtype=np.float64)
        self._tables = _Tables(laws.capillary_tables, self.radius)
        self.constants = _constants(self.radius, matter, surroundings, laws, time_step, self._tables)
        self.state = _state(beads, matter, len(self.constants.point), self._tables)
        self._skin = _SKIN * float(self.radius.min())
        # However much liquid a bead takes over, it is hardly ever more than it has.
        film = 2.0 * 4.0 / 3.0 * pi * self.radius**3 * matter.volume_fraction
        bridge = (1.0 + 0.5 * matter.contact_angle) * np.cbrt(film / 2.0)
        self._reach = self.radius + np.maximum(bridge, self._tables.longest / 2.0) + self._skin / 2.0
        self._pairs = _no_pairs()
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

    def _advance(self, end: int, records: tuple[int, int], frames: FloatArray) -> int:
        """Move on to a step, or until neighbours are to be listed anew: the step that it is then."""
        clock = (self.clock, records[0], end, records[1])
        return kernels.advance(self.constants, self.state, self._pairs, self._listed, self._skin, clock, frames)

    @property
    def energy(self) -> float:
        """Kinetic energy, J."""
        c, state = self.constants, self.state
        moving = 0.5 * c.mass @ np.sum(state.velocity**2, axis=1)
        return float(moving + 0.2 * (c.mass * c.radius**2) @ np.sum(state.spin**2, axis=1))

    def bridges(self) -> list[tuple[int, int]]:
        """Pairs of beads that a bridge holds together."""
        held = self._pairs.bridged
        return list(zip(self._pairs.first[held].tolist(), self._pairs.second[held].tolist(), strict=True))

    def _list(self) -> None:
        """List the neighbours; contacts and bridges go on."""
        before, self._listed = self._pairs, self.state.position.copy()
        near = cKDTree(self._listed).query_pairs(2.0 * float(self._reach.max()), output_type="ndarray").astype(np.int64)
        apart = np.linalg.norm(self._listed[near[:, 0]] - self._listed[near[:, 1]], axis=1)
        near = near[apart < self._reach[near].sum(axis=1)]
        count = len(self.radius)
        keys = np.sort(near.min(axis=1) * count + near.max(axis=1))
        first, second = keys // count, keys % count
        none = np.zeros(len(keys), dtype=np.bool_)
        pairs = Pairs(first, second, np.empty((len(keys), 6)), np.zeros((len(keys), 3)), none, none.copy())
        known = before.first * count + before.second
        common, new, old = np.intersect1d(keys, known, assume_unique=True, return_indices=True)
        del common
        for now, then in zip(pairs[3:], before[3:], strict=True):
            now[new] = then[old]
        self._tables.assign(pairs.bridge, first, second)
        kernels.set_bridges(self.constants, self.state, pairs)
        self._pairs = pairs


class _Tables:
    """Tables of forces and which bridges they are of."""

    def __init__(self, tables: tuple[ForceTable, ...], radius: FloatArray) -> None:
        self.tables = tables
        sizes, self.size_of = np.unique(radius, return_inverse=True)
        self.between = np.full((len(sizes), len(sizes)), -1)
        self.at_wall = np.full(len(sizes), -1)
        for number, table in enumerate(tables):
            for one, size in enumerate(sizes):
                if table.fits(size, None):
                    self.at_wall[one] = number
                for other, second in enumerate(sizes):
                    if table.fits(size, second):
                        self.between[one, other] = number
        self.rupture = np.array([*(table.gap[-1] for table in tables), 0.0])
        self.longest = float(self.rupture.max())

    def forces(self, tension: float) -> FloatArray:
        """Pull at evenly spaced gaps, N, shape (T, TABLE_POINTS)."""
        values = np.zeros((max(len(self.tables), 1), kernels.TABLE_POINTS))
        for row, table in zip(values, self.tables, strict=False):
            gaps = np.linspace(0.0, table.gap[-1], kernels.TABLE_POINTS)
            row[:] = tension * np.interp(gaps, table.gap, table.force_over_tension)
        return values

    def assign(self, bridge: FloatArray, first: IntArray, second: IntArray) -> None:
        """Say of bridges between beads which table they follow, and where it ends."""
        self._put(bridge, self.between[self.size_of[first], self.size_of[second]])

    def assign_walls(self, bridge: FloatArray) -> None:
        """The same of bridges to walls."""
        self._put(bridge, self.at_wall[self.size_of])

    def _put(self, bridge: FloatArray, table: IntArray) -> None:
        bridge[:, kernels.TABLE] = table
        bridge[:, kernels.RUPTURE] = self.rupture[table]


def _constants(
    radius: FloatArray, matter: Matter, around: Surroundings, laws: Laws, time_step: float, tables: _Tables
) -> Constants:
    modulus, ratio = matter.youngs_modulus, matter.poissons_ratio
    damping = -log(matter.restitution) / sqrt(log(matter.restitution) ** 2 + pi**2)
    liquid = 4.0 / 3.0 * pi * radius**3 * matter.volume_fraction
    harmonics = around.harmonics if around.harmonics is not None and laws.drive else np.zeros((0, 6))
    return Constants(
        step=time_step,
        radius=radius,
        mass=4.0 / 3.0 * pi * radius**3 * matter.density,
        film=6.0 * pi * matter.film_viscosity * radius * laws.film,
        reach=(1.0 + 0.5 * matter.contact_angle) * np.cbrt(liquid / 2.0),
        point=np.ascontiguousarray(around.point, dtype=np.float64),
        normal=np.ascontiguousarray(around.normal, dtype=np.float64),
        gravity=np.array(around.gravity) * laws.gravity,
        harmonics=np.ascontiguousarray(harmonics, dtype=np.float64),
        modulus=modulus / (2.0 * (1.0 - ratio**2)),
        shear_modulus=modulus / (4.0 * (1.0 + ratio) * (2.0 - ratio)),
        normal_damping=damping * laws.normal_damping,
        tangential_damping=damping * laws.tangential_damping,
        friction_beads=matter.friction_beads,
        friction_walls=matter.friction_walls,
        rolling=matter.rolling_friction * laws.rolling_friction,
        tension=matter.surface_tension,
        contact_angle=matter.contact_angle,
        capillary=laws.capillary,
        normal_viscosity=matter.viscosity * laws.normal_lubrication,
        tangential_viscosity=matter.viscosity * laws.tangential_lubrication,
        separation=matter.separation_ratio,
        tables=tables.forces(matter.surface_tension),
        friction=laws.friction,
        spring=laws.tangential_spring,
        limit_with_damping=laws.coulomb_limit == "elastic-and-damping",
        static=_STATIC[laws.static_friction],
        static_ratio=laws.static_ratio,
        static_velocity=laws.static_velocity,
        wall_lubrication=_WALLS[laws.wall_lubrication],
        transfer=laws.liquid_transfer,
        copies=float(laws.wall_copies),
    )


def _state(beads: Beads, matter: Matter, walls: int, tables: _Tables) -> State:
    count = len(beads.radius)
    wall_bridge = np.zeros((count, 6))
    tables.assign_walls(wall_bridge)
    return State(
        position=np.array(beads.position, dtype=np.float64, order="C"),
        velocity=np.array(beads.velocity, dtype=np.float64, order="C"),
        spin=np.array(beads.spin, dtype=np.float64, order="C"),
        force=np.zeros((count, 3)),
        torque=np.zeros((count, 3)),
        liquid=np.full(count, matter.volume_fraction),
        wall_bridge=wall_bridge,
        wall_spring=np.zeros((count, walls, 3)),
        wall_bridged=np.zeros((count, walls), dtype=np.bool_),
        wall_slips=np.zeros((count, walls), dtype=np.bool_),
    )


def _no_pairs() -> Pairs:
    none = np.zeros(0, dtype=np.int64)
    flags = np.zeros(0, dtype=np.bool_)
    return Pairs(none, none, np.zeros((0, 6)), np.zeros((0, 3)), flags, flags.copy())
