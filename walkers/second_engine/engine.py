"""The second engine: beads between walls that move freely, or follow a given motion step by step.

It makes the constants of a case for the compiled formulas of `walkers.second_engine.kernels`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
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
from walkers.physics.edges import edge_resistance
from walkers.physics.friction import SlidingFriction
from walkers.second_engine import kernels
from walkers.second_engine.kernels import CELLS, BridgeSplines, Constants, State

TERMS = ("capillary", "lubrication", "damping", "friction", "rolling-friction", "gravity", "drive")
"""Terms that can be left out: capillary force and viscous forces of bridges, damping of contacts,
tangential contact force, torque against rolling, weight, inertial force of the frame."""
_SKIN = 0.4
"""Skin of neighbour lists over the smallest radius. A list is rebuilt when a bead has moved by
nearly half the skin."""


_VOLUME_STEPS = 8
"""Steps of √2 from the smallest volume of a bridge to that of a bridge of full films, where liquid
is conserved (`walkers.physics.bridge.Surfaces.volumes`)."""


class SecondEngine:
    """Beads that move in the frame of the walls.

    Parameters
    ----------
    case
        Gives density, contacts, liquid, weight, drive, time step, and the walls unless others are
        given.
    radius : ndarray, shape (N,)
        Radii of the beads, m.
    start : ndarray, shape (N, 9)
        Position (m), velocity (m/s) and spin (rad/s). Beads that touch have a bridge; where
        liquid is conserved, bridges between beads form from the next step on, as in LIGGGHTS.
        Springs are unstretched and films are full.
    walls
        Walls between which the beads move; empty: those of the case.
    clock
        Number of the step of the start; the drive begins at step 0.
    without
        Those of `TERMS` that are left out.

    Raises
    ------
    InputError
        If a wall is a facet of a mesh.
    """

    def __init__(  # noqa: PLR0913 (keyword-only, and described above)
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
        strengths = dict.fromkeys(TERMS, 1.0)
        for term in without:
            strengths[term] = 0.0
        self.constants = _constants(case, radius, walls or case.boundary.walls, strengths)
        self.state = _state(start, wall_count=len(self.constants.wall_point))
        kernels.list_neighbours(self.constants, self.state)
        self.evaluate()

    def evaluate(self) -> None:
        """Evaluate the forces at the present positions, as LIGGGHTS does at its start."""
        kernels.update_forces(self.constants, self.state, self.clock, False)

    def run(self, steps: int, steps_per_frame: int) -> FloatArray:
        """Integrate, and return frames.

        Parameters
        ----------
        steps
            Number of steps.
        steps_per_frame
            Number of steps between frames.

        Returns
        -------
        ndarray, shape (steps // steps_per_frame, N, 9)
            Position (m), velocity (m/s) and spin (rad/s).
        """
        frames = np.empty((steps // steps_per_frame, len(self.state.film), 9))
        kernels.advance(self.constants, self.state, self.clock, steps_per_frame, frames)
        self.clock += steps_per_frame * len(frames)
        return frames

    def follow(self, frame: FloatArray) -> FloatArray:
        """Move the beads to a given state at the next step, and return what acts on them there.

        Parameters
        ----------
        frame : ndarray, shape (N, 9)
            Position (m), velocity (m/s) and spin (rad/s).

        Returns
        -------
        ndarray, shape (N, 6)
            Forces (N) and torques (N m).
        """
        state = self.state
        state.position[:] = frame[:, :3]
        state.velocity[:] = frame[:, 3:6]
        state.spin[:] = frame[:, 6:]
        self.clock += 1
        kernels.list_neighbours(self.constants, state)
        kernels.update_forces(self.constants, state, self.clock, True)
        return np.hstack([state.force, state.torque])

    def liquid(self) -> float:
        """Liquid on all beads and in all bridges, m³."""
        bridges = self.constants.bridges
        present = self.state.bridge[self.state.bridge >= 0]
        return float(bridges.liquid @ self.state.film + bridges.volume[present].sum())


def _state(start: FloatArray, wall_count: int) -> State:
    """The state of beads with full films, without contacts; ``start`` as for `SecondEngine`."""
    beads = len(start)
    contacts = (beads, beads + wall_count)
    position = np.array(start[:, :3], dtype=np.float64, order="C")
    return State(
        position=position,
        velocity=np.array(start[:, 3:6], dtype=np.float64, order="C"),
        spin=np.array(start[:, 6:9], dtype=np.float64, order="C"),
        force=np.zeros((beads, 3)),
        torque=np.zeros((beads, 3)),
        film=np.ones(beads),
        previous_film=np.zeros(beads),
        spring=np.zeros((*contacts, 3)),
        bridge=np.full(contacts, -1),
        neighbours=np.zeros((beads, beads), np.bool_),
        listed_position=position.copy(),
    )


def _constants(
    case: Case, radius: FloatArray, walls: Sequence[Wall], strengths: Mapping[str, float]
) -> Constants:
    """The constants of a case for beads between walls, in SI units.

    ``radius`` has the shape (N,), in m. ``strengths`` are factors of `TERMS`: 1, or 0 for terms
    that are left out. `InputError` if a wall is a facet of a mesh.
    """
    contact = case.contact
    youngs_modulus = contact.youngs_modulus
    poissons_ratio = contact.poissons_ratio
    log_restitution = log(contact.restitution)
    rows = _kernel_rows(case, walls)
    harmonics, inertial_acceleration = _drive(case)
    if not strengths["drive"]:
        harmonics = np.zeros((0, 6))
        inertial_acceleration = np.zeros((0, 3))
    bridges = _bridges(case, radius, strengths)
    skin = _SKIN * float(radius.min())
    longest_bridge = bridges.spans[:, kernels.RUPTURE].max()
    return Constants(
        step=case.run.time_step,
        radius=radius,
        mass=4.0 / 3.0 * pi * radius**3 * case.beads.density,
        wall_point=np.array([row.point for row in rows]).reshape(-1, 3),
        wall_normal=np.array([row.normal for row in rows]).reshape(-1, 3),
        cylinder_radius=np.array([row.radius for row in rows]),
        gravity=np.array(case.gravity_vector) * strengths["gravity"],
        harmonics=harmonics,
        inertial_acceleration=inertial_acceleration,
        # Effective moduli of two bodies of the same material.
        modulus=youngs_modulus / (2.0 * (1.0 - poissons_ratio**2)),
        shear_modulus=youngs_modulus / (4.0 * (1.0 + poissons_ratio) * (2.0 - poissons_ratio)),
        # β of Tsuji's damping as LIGGGHTS has it, from the coefficient of restitution.
        damping=-log_restitution / sqrt(log_restitution**2 + pi**2) * strengths["damping"],
        friction_beads=_scaled_friction(contact.friction.between_beads, strengths["friction"]),
        friction_walls=_scaled_friction(contact.friction.at_walls, strengths["friction"]),
        rolling=contact.rolling_friction * strengths["rolling-friction"],
        # Beads closer than the sum of both search radii are neighbours.
        search_radius=radius + (longest_bridge + skin) / 2.0,
        skin=skin,
        bridges=bridges,
    )


def _scaled_friction(friction: SlidingFriction, factor: float) -> SlidingFriction:
    """A law of friction whose coefficient is multiplied by a factor at all speeds."""
    return friction._replace(at_rest=friction.at_rest * factor, rise=friction.rise * factor)


def _kernel_rows(case: Case, walls: Sequence[Wall]) -> list[KernelRow]:
    """Walls as the kernels take them; `InputError` for facets."""
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


def _drive(case: Case) -> tuple[FloatArray, FloatArray]:
    """The fields ``harmonics`` and ``inertial_acceleration`` of `Constants`.

    They give the inertial acceleration of the beads in the frame of the walls, which is opposite to
    the acceleration of the walls.

    Returns
    -------
    harmonics : ndarray, shape (H, 6)
        Direction (3 columns), angular frequency ω (rad/s), peak acceleration A (m/s²) and phase φ
        (rad) of each A sin(ωt + φ); no rows for a drive with a ramp or from a record. The walls are
        displaced along sin(ωt + φ), so that their own acceleration is −A sin(ωt + φ).
    inertial_acceleration : ndarray, shape (steps + 1, 3)
        At each step of a drive with a ramp or from a record, m/s²; otherwise no rows.
    """
    if case.drive.ramp or case.drive.record:
        times = case.run.time_step * np.arange(case.run.steps + 1, dtype=np.float64)
        acceleration = np.zeros((len(times), 3))
        for direction, motion in case.excitation.motions(times):
            _, _, wall_acceleration = motion  # after displacement and velocity
            acceleration -= np.outer(wall_acceleration, direction)
        return np.zeros((0, 6)), acceleration
    harmonics = [
        (*wave.direction, wave.angular_frequency, wave.peak_acceleration, wave.phase)
        for wave in case.excitation.harmonics
    ]
    return np.array(harmonics, dtype=np.float64).reshape(-1, 6), np.zeros((0, 3))


def _bridges(case: Case, radius: FloatArray, strengths: Mapping[str, float]) -> BridgeSplines:
    """Bridges between all sizes of beads and between beads and walls.

    The strengths of the terms ``capillary`` and ``lubrication`` act here.
    """
    sizes, size_of_bead = np.unique(radius, return_inverse=True)
    count = len(sizes)
    other_radii = [*sizes.tolist(), inf]
    first_bridge = np.empty((count, count + 1), dtype=np.int64)
    contribution = np.zeros((count, count + 1, 2))
    spans = []
    splines = []
    edges: list[float] = []
    volumes: list[float] = []
    for row, small in enumerate(sizes.tolist()):
        first_bridge[row, :row] = first_bridge[:row, row]
        contribution[row, :row] = contribution[:row, row, ::-1]
        for column in range(row, count + 1):
            surfaces = surfaces_of(case, small, other_radii[column])
            first_bridge[row, column] = len(volumes)
            contribution[row, column] = surfaces.films[0]
            for with_volume in surfaces.volumes:
                span, coefficients = _spline(case.law, with_volume)
                spans.append(span)
                splines.append(coefficients)
                edges.append(edge_resistance(with_volume))
                volumes.append(with_volume.volume)
    lubrication = strengths["lubrication"]
    factors = np.array([strengths["capillary"], lubrication, lubrication, lubrication, lubrication])
    return BridgeSplines(
        spans=np.stack(spans),
        splines=np.stack(splines) * factors,
        size=size_of_bead.astype(np.int64),
        first_bridge=first_bridge,
        edge=lubrication * np.array(edges),
        volume=np.array(volumes),
        full_step=_VOLUME_STEPS if case.liquid.conserved else 0,
        contribution=contribution,
        liquid=4.0 / 3.0 * pi * radius**3 * case.liquid.of_bridges.volume_fraction,
    )


@lru_cache(maxsize=4096)
def _spline(law: BridgeLaw, surfaces: Surfaces) -> tuple[FloatArray, FloatArray]:
    """The row of a bridge in `BridgeSplines.spans`, and its splines.

    The first piece ends at the law's ``scale``, where forces may have a kink, so that no spline
    crosses it.
    """
    curve = law(surfaces)
    rupture = curve.rupture
    scale = curve.scale if curve.scale else surfaces.roughness
    if scale >= rupture:  # all pieces must end below the rupture; there is no kink before it
        scale = 0.4 * rupture
    middle = max(0.5 * rupture, 0.5 * (scale + rupture))
    t = np.linspace(0.0, 1.0, CELLS + 1)
    knots_of_pieces = (
        scale * t,
        scale * (middle / scale) ** t,
        rupture - (rupture - middle) * (1.0 - t) ** 2,
    )
    splines = []
    for gaps in knots_of_pieces:
        spline = CubicSpline(CELLS * t, curve.forces(gaps).columns())
        splines.append(spline.c.transpose(1, 0, 2))
    return np.array([curve.formation, scale, middle, rupture]), np.stack(splines)
