"""The second engine: beads between walls that move freely, or follow a given motion step by step."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import lru_cache
from math import inf, log, pi, sqrt

import numpy as np
from scipy.interpolate import CubicSpline

from walkers.arrays import FloatArray
from walkers.errors import input_error
from walkers.inputs.resolving.loads import surfaces_of
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import KernelRow, Wall
from walkers.physics.bridge import BridgeLaw, Surfaces
from walkers.second_engine import kernels
from walkers.second_engine.kernels import CELLS, BridgeSplines, Constants, State

TERMS = ("capillary", "lubrication", "damping", "friction", "rolling-friction", "gravity", "drive")
"""Terms that can be left out: pull and resistances of bridges, damping of contacts, the tangential contact force, the
torque against rolling, weight, the inertial force of the frame."""
_SKIN = 0.4
"""Fraction of the smallest radius; neighbour lists are rebuilt when a bead has moved nearly half of it."""


class SecondEngine:
    """Beads that move in the frame of the walls.

    Parameters
    ----------
    case
        Gives density, contacts, liquid, weight, drive, time step, and the walls unless others are given.
    radius : ndarray, shape (N,)
        Radii of the beads, m.
    start : ndarray, shape (N, 9)
        Position (m), velocity (m/s) and spin (rad/s). Touching beads have a bridge; where liquid is conserved, bridges
        between beads form from the next step on, as in LIGGGHTS. Springs are unstretched, films full.
    clock, without
        Number of the first step; the drive begins with step 0. `TERMS` that are left out.
    """

    def __init__(
        self,
        case: Case,
        radius: FloatArray,
        start: FloatArray,
        *,
        walls: Sequence[Wall] = (),
        clock: int = 0,
        without: Collection[str] = (),
    ) -> None:
        self.clock = clock
        radius = np.ascontiguousarray(radius, dtype=np.float64)
        self.constants = _constants(case, radius, walls or case.boundary.walls, without)
        place, velocity, spin = (
            np.array(start[:, column : column + 3], dtype=np.float64, order="C")
            for column in (0, 3, 6)
        )
        beads = len(radius)
        contacts = (beads, beads + len(self.constants.point))
        self.state = State(
            *(
                place,
                velocity,
                spin,
                np.zeros_like(place),
                np.zeros_like(place),
                np.ones(beads),
                np.zeros(beads),
            ),
            *(
                np.zeros((*contacts, 3)),
                np.full(contacts, -1),
                np.zeros((beads, beads), np.bool_),
                place.copy(),
            ),
        )
        kernels.look_around(self.constants, self.state)
        self.evaluate()

    def evaluate(self) -> None:
        """Evaluate the forces at the present positions and velocities, as LIGGGHTS does at its start."""
        kernels.forces(self.constants, self.state, self.clock, False)

    def run(self, steps: int, every: int) -> FloatArray:
        """Integrate: position, velocity and spin after each ``every`` steps, shape (steps // every, N, 9)."""
        frames = np.empty((steps // every, len(self.state.film), 9))
        kernels.advance(self.constants, self.state, self.clock, every, frames)
        self.clock += every * len(frames)
        return frames

    def follow(self, frame: FloatArray) -> FloatArray:
        """Move the beads to a state (N, 9) at the next step; return forces (N) and torques (N m), (N, 6)."""
        state = self.state
        state.position[:], state.velocity[:], state.spin[:] = (
            frame[:, :3],
            frame[:, 3:6],
            frame[:, 6:],
        )
        self.clock += 1
        kernels.look_around(self.constants, state)
        kernels.forces(self.constants, state, self.clock, True)
        return np.hstack([state.force, state.torque])

    def liquid(self) -> float:
        """Liquid on all beads and in all bridges, m³."""
        bridges, held = self.constants.bridges, self.state.bridge
        return float(bridges.liquid @ self.state.film + bridges.volume[held[held >= 0]].sum())


@lru_cache(maxsize=4096)
def _splined(law: BridgeLaw, surfaces: Surfaces) -> tuple[FloatArray, FloatArray]:
    """A bridge's row of `Bridges.spans` and its splines; a kink may be at the scale."""
    curve = law(surfaces)
    end, scale = curve.rupture, curve.scale or surfaces.roughness
    scale = scale if scale < end else 0.4 * end
    middle = max(0.5 * end, 0.5 * (scale + end))
    t = np.linspace(0.0, 1.0, CELLS + 1)
    pieces = (scale * t, scale * (middle / scale) ** t, end - (end - middle) * (1.0 - t) ** 2)
    splines = [
        CubicSpline(CELLS * t, curve.forces(gaps).columns()).c.transpose(1, 0, 2) for gaps in pieces
    ]
    return np.array([curve.formation, scale, middle, end]), np.stack(splines)


def _bridges(case: Case, radius: FloatArray, without: Collection[str]) -> BridgeSplines:
    sizes, kind = np.unique(radius, return_inverse=True)
    between, full = (
        np.empty((len(sizes), len(sizes) + 1), dtype=np.int64),
        np.zeros((len(sizes), len(sizes) + 1, 2)),
    )
    tables: list[tuple[FloatArray, FloatArray, float]] = []
    for row, small in enumerate(sizes.tolist()):
        between[row, :row], full[row, :row] = between[:row, row], full[:row, row, ::-1]
        for column, large in list(enumerate([*sizes.tolist(), inf]))[row:]:
            surfaces = surfaces_of(case, small, large)
            between[row, column], full[row, column] = len(tables), surfaces.films[0]
            tables += [
                (*_splined(case.law, meeting), meeting.volume) for meeting in surfaces.volumes
            ]
    acts = np.array(
        ["capillary" not in without, *["lubrication" not in without] * 4], dtype=np.float64
    )
    spans, splines, volumes = map(np.stack, zip(*tables, strict=True))
    liquid = 4.0 / 3.0 * pi * radius**3 * case.liquid.of_bridges.volume_fraction
    steps = 8 if case.liquid.conserved else 0
    return BridgeSplines(
        spans, splines * acts, kind.astype(np.int64), between, volumes, steps, full, liquid
    )


def _rows_of(case: Case, walls: Sequence[Wall]) -> list[KernelRow]:
    rows = []
    for wall in walls:
        row = wall.kernel_row()
        if row is None:
            raise input_error(
                case.name,
                "boundary.mesh: expected a vessel of planes; the second engine knows no facets",
            )
        rows.append(row)
    return rows


def _constants(
    case: Case, radius: FloatArray, walls: Sequence[Wall], without: Collection[str]
) -> Constants:
    contact = case.contact
    modulus, ratio, loss = contact.youngs_modulus, contact.poissons_ratio, log(contact.restitution)
    damping, friction, rolling, gravity, drive = (term not in without for term in TERMS[2:])
    waves = [
        (*wave.direction, wave.angular_frequency, wave.peak_acceleration, wave.phase)
        for wave in case.excitation.harmonics
    ]
    course = np.zeros((0, 3))
    if drive and (case.drive.ramp or case.drive.record):
        waves, times = [], case.run.time_step * np.arange(case.run.steps + 1, dtype=np.float64)
        course = np.zeros((len(times), 3))
        for direction, moved in case.excitation.motions(times):
            course -= np.outer(moved[2], direction)
    bridges, skin = _bridges(case, radius, without), _SKIN * float(radius.min())
    rows = _rows_of(case, walls)
    return Constants(
        step=case.run.time_step,
        radius=radius,
        mass=4.0 / 3.0 * pi * radius**3 * case.beads.density,
        point=np.array([row.point for row in rows]).reshape(-1, 3),
        normal=np.array([row.normal for row in rows]).reshape(-1, 3),
        hollow=np.array([row.radius for row in rows]),
        gravity=np.array(case.gravity_vector) * gravity,
        harmonics=np.array(waves if drive else (), dtype=np.float64).reshape(-1, 6),
        course=course,
        modulus=modulus / (2.0 * (1.0 - ratio**2)),
        shear_modulus=modulus / (4.0 * (1.0 + ratio) * (2.0 - ratio)),
        damping=-loss / sqrt(loss**2 + pi**2) * damping,
        friction_beads=contact.friction.bead_bead * friction,
        friction_walls=contact.friction.bead_wall * friction,
        rolling=contact.rolling_friction * rolling,
        reach=radius + (bridges.spans[:, kernels.RUPTURE].max() + skin) / 2.0,
        skin=skin,
        bridges=bridges,
    )
