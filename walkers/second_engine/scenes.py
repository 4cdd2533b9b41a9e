"""Checks of the engine on small decks, most of them scenes of a few beads in both engines.

In most scenes LIGGGHTS moves the beads along prescribed paths and the second engine follows their
positions: the forces and torques of each step are compared, relative to the largest of the scene.
In other scenes the beads move freely, and their displacements and spins are compared. Most scenes
have the bridge law `law`, whose capillary force and resistances are independent; two scenes test
each law of the program.

`CHECKS` lists all checks; `walkers.second_engine.audit` runs them. Whole runs are compared in
`walkers.second_engine.crosscheck`.
"""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import cos, degrees, inf, pi, sin, sqrt
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from walkers.arrays import FloatArray, Vector
from walkers.errors import Stopped
from walkers.inputs.bridge_laws import by_name
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.loads import surfaces_of
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import BOTTOM, Flat, Round, Wall
from walkers.physics.bridge import Curve, Forces, Surfaces
from walkers.physics.laws import LAWS
from walkers.postprocess.measure.dump import BinaryDump
from walkers.postprocess.measure.motion import prescribed_motion
from walkers.runner.binary import Engine
from walkers.runner.launch import launch
from walkers.runner.run_directory import write_deck
from walkers.second_engine.engine import SecondEngine
from walkers.second_engine.lines import Line
from walkers.templates.bridge_tables import tabulated
from walkers.templates.deck import BRIDGES_NAME, Deck, Plan, Segment, compose, plan_of
from walkers.templates.layout import BEAD_COLUMNS, FILM_COLUMN, FORCE_COLUMNS
from walkers.templates.placement import Bead, PlacedBodies
from walkers.text import rendered

EQUAL = 1e-6
"""Largest difference between the engines that passes, relative to the largest force, torque or
displacement of a scene. It is the error of interpolation."""
EQUAL_DECKS = 1e-9
"""Largest relative difference that passes between two decks that compute the same."""
DRY = {"liquid.law": f"{__file__}:dry"}
"""Changes of a case without bridges."""
LARGE_RADIUS = 3e-4
"""Radius of large beads, m."""
SMALL_RADIUS = 2e-4
"""Radius of small beads, m."""
OVERLAP = 1.7123e-6
"""Overlap of touching beads, m."""
AT_REST: Vector = (0.0, 0.0, 0.0)
"""Velocity (m/s) or spin (rad/s) of a bead that does not move or turn."""
SPIN: Vector = (61.0, -83.0, 47.0)
"""Spin of most beads, rad/s."""
_UPWARD: Vector = (0.031, -0.023, 0.053)
"""Velocity of beads that leave a wall, m/s."""
_OTHER_SPIN: Vector = (-29.0, 53.0, 19.0)
"""Spin of the second bead of most pairs, rad/s."""
_RECORDED_COLUMNS = (*BEAD_COLUMNS, *FORCE_COLUMNS)
"""Columns of the dumps of scenes: beads with their forces and torques."""


# --- cases ----------------------------------------------------------------------------------------


def dry(surfaces: Surfaces) -> Curve:
    """A law without forces."""

    def no_forces(gaps: FloatArray) -> Forces:
        zero = np.zeros_like(gaps)
        return Forces(pull=zero, normal=zero, sliding=zero, coupling=zero, rolling=zero)

    return Curve(no_forces, rupture=surfaces.roughness)


def law(surfaces: Surfaces) -> Curve:
    """A bridge that forms before surfaces touch, with a kink near contact and all resistances."""
    size = surfaces.reduced_radius
    scale = surfaces.roughness
    # Equal beads have no order, and therefore no coupling.
    asymmetry = 1.0 - surfaces.radius / surfaces.other_radius
    stokes = 6.0 * pi * 0.03 * size

    def forces(gaps: FloatArray) -> Forces:
        nearness = 1.0 / np.maximum(gaps / scale, 1.0)
        return Forces(
            pull=0.05 * size * np.exp(-12.0 * gaps / size),
            normal=stokes * nearness * size / surfaces.roughness,
            sliding=stokes * (4.0 + np.log(nearness)),
            coupling=-0.7 * asymmetry * stokes * size * (1.0 + nearness),
            rolling=stokes * size**2 * (4.0 + 2.0 * nearness),
        )

    return Curve(forces, rupture=0.25 * size, formation=0.03 * size)


_FREE_FRAMES = 100
"""Number of frames of beads that move freely."""
_BARE_CASE = {
    "beads": {"density": "4.0 g/cm^3"},
    "dimers": {"radii": ["0.3 mm", "0.2 mm"]},
    "liquid": {"surface_tension": "19.2 mN/m", "dynamic_viscosity": "0 Pa*s"},
    "boundary": {"material": "glass"},
    "contact": {
        "friction": {"bead_bead": 0.0, "bead_wall": 0.0},
        "rolling_friction": 0.0,
        "restitution": 1.0,
        "roughness": {"bead_bead": "2 um", "bead_wall": "2 um"},
        "youngs_modulus": "50 MPa",
    },
    "drive": {"frequency": "80 Hz", "peak_acceleration": "0 g", "frame": "container"},
    "run": {"time_step": "1 us", "samples_per_cycle": 1},
    "environment": {"gravity": "0 m/s^2"},
}
"""A case in which only elastic contacts and capillary forces act: no friction, damping, viscosity,
gravity or drive."""
_FULL = {
    "contact.friction.bead_bead": 0.23,
    "contact.friction.bead_wall": 0.31,
    "contact.rolling_friction": 0.04,
    "contact.restitution": 0.4,
    "liquid.dynamic_viscosity": "4.6 mPa*s",
    "liquid.law": f"{__file__}:law",
}
"""Changes of the bare case: friction, rolling friction, damping and the law of this module."""
_WEIGHT = {"environment.gravity": "9.81 m/s^2"}
"""Changes of a case whose beads have weight."""
_GROWING_FRICTION = {
    "contact.friction.bead_bead": {
        "at_rest": 0.05,
        "rise": 0.6,
        "half_rise_velocity": "30 mm/s",
    },
    "contact.friction.bead_wall": {
        "at_rest": 0.12,
        "rise": 0.25,
        "half_rise_velocity": "8 mm/s",
    },
}
_FAST_DRIVE = {
    "drive.frequency": "300 Hz",
    "drive.peak_acceleration": "8 g",
    "drive.frame": "lab",
}
"""Changes of a case whose walls oscillate fast, in the frame of the laboratory."""


def bench_case(changes: Mapping[str, Any]) -> Case:
    """A case without friction, damping, viscosity, gravity and drive; changes are by dotted key."""
    return build_case(_BARE_CASE, source="<audit>", name="audit", changes=changes)


def full_case(changes: Mapping[str, Any]) -> Case:
    """A case with friction, rolling friction, damping and the law of this module.

    ``changes`` are by dotted key. There is no gravity and no drive without changes.
    """
    return bench_case({**_FULL, **changes})


# --- beads ----------------------------------------------------------------------------------------


def bead_at_plane(  # noqa: PLR0913 (the three after the star have a name in each call)
    wall: Flat,
    gap: float,
    radius: float,
    *,
    velocity: Vector = AT_REST,
    spin: Vector = SPIN,
    x: float = 0.0,
) -> Bead:
    """A bead at a plane.

    Parameters
    ----------
    wall
        The plane.
    gap
        Gap between bead and plane, negative for an overlap, m.
    radius
        Radius of the bead, m.
    velocity, spin
        Velocity (m/s) and spin (rad/s).
    x
        Distance along x from the point of the plane, m.
    """
    height = radius + gap
    centre = (
        wall.point[0] + height * wall.normal[0] + x,
        wall.point[1] + height * wall.normal[1],
        wall.point[2] + height * wall.normal[2],
    )
    return Bead(0, centre, radius, velocity, spin)


def bead_in_cylinder(
    wall: Round, gap: float, radius: float, azimuth: float, velocity: Vector
) -> Bead:
    """A bead at the inside of an upright cylinder.

    Parameters
    ----------
    wall
        The cylinder.
    gap
        Gap between bead and wall, negative for an overlap, m.
    radius
        Radius of the bead, m.
    azimuth
        Azimuth of the centre of the bead, rad. Beads with a larger azimuth are higher.
    velocity
        Radial, azimuthal and axial velocity, m/s.
    """
    distance = wall.radius - radius - gap
    x = cos(azimuth)
    y = sin(azimuth)
    radial, azimuthal, axial = velocity
    centre = (distance * x, distance * y, 10.0 * azimuth * LARGE_RADIUS)
    cartesian = (radial * x - azimuthal * y, radial * y + azimuthal * x, axial)
    return Bead(0, centre, radius, cartesian, SPIN)


def pair(
    gap: float,
    separation_velocity: float,
    common_velocity: Vector,
    spins: tuple[Vector, Vector] = (SPIN, _OTHER_SPIN),
) -> list[Bead]:
    """A large bead at rest and a small bead that moves, away from all walls.

    Parameters
    ----------
    gap
        Gap between both beads, negative for an overlap, m.
    separation_velocity
        Velocity of the small bead away from the large bead, m/s.
    common_velocity
        Velocity that is added to it, m/s.
    spins
        Spins of the large and the small bead, rad/s.
    """
    normal = np.array([0.48, 0.6, 0.64])
    first = np.array([-3e-3, 1e-3, 4e-3])
    second = first + (LARGE_RADIUS + SMALL_RADIUS + gap) * normal
    velocity = separation_velocity * normal + np.array(common_velocity)
    return [
        Bead(0, _vector(first), LARGE_RADIUS, spin=spins[0]),
        Bead(0, _vector(second), SMALL_RADIUS, _vector(velocity), spins[1]),
    ]


def shifted_beads(beads: Sequence[Bead], x: float, y: float, speed: float = 0.0) -> list[Bead]:
    """Beads that are shifted by x and y (m), with an additional velocity along x (m/s)."""
    shifted = []
    for bead in beads:
        centre = _vector(np.add(bead.centre, (x, y, 0.0)))
        velocity = _vector(np.add(bead.velocity, (speed, 0.0, 0.0)))
        shifted.append(replace(bead, centre=centre, velocity=velocity))
    return shifted


def _vector(components: FloatArray) -> Vector:
    x, y, z = components.tolist()
    return (x, y, z)


def scene_of(beads: Sequence[Bead], walls: Sequence[Wall] = (BOTTOM,)) -> PlacedBodies:
    """A scene of beads between walls in a box of 2 cm around the origin."""
    numbered = tuple(replace(bead, id=number) for number, bead in enumerate(beads, 1))
    lower = (-0.01, -0.01, -0.01)
    upper = (0.01, 0.01, 0.01)
    return PlacedBodies(numbered, tuple(walls), lower, upper)


# --- runs of both engines -------------------------------------------------------------------------


def recorded_plan(case: Case, scene: PlacedBodies, steps: int, sample_every: int = 1) -> Plan:
    """A plan that records forces and torques too; the beads of the scene move freely.

    Parameters
    ----------
    case
        Materials, liquid, contacts, drive, gravity and time step.
    scene
        Beads and walls.
    steps
        Number of steps; bridges are recorded at the start and at the end.
    sample_every
        Number of steps between frames of beads.
    """
    return Plan(
        case,
        scene,
        segment=Segment(0, steps, 0),
        sample_every=sample_every,
        bridge_every=steps,
        status_every=steps,
        bead_columns=_RECORDED_COLUMNS,
    )


def prescribed(case: Case, scene: PlacedBodies, steps: int = 2000) -> Plan:
    """A plan in which the beads of a scene keep their velocities, and each step is recorded."""
    return replace(recorded_plan(case, scene, steps), prescribed=True)


def second_engine(case: Case, scene: PlacedBodies) -> SecondEngine:
    """The second engine with the beads of a scene, in the frame of the walls.

    Its frames of prescribed scenes come from LIGGGHTS. If walls move in the laboratory, their
    inertial forces do not act there and are left out.
    """
    start = np.array([[*bead.centre, *bead.velocity, *bead.spin] for bead in scene.beads])
    radius = np.array([bead.radius for bead in scene.beads])
    without = () if case.drive.frame == "container" else ("drive",)
    return SecondEngine(case, radius, start, walls=scene.walls, without=without)


@dataclass(frozen=True)
class SceneOutput:
    """What LIGGGHTS has written for a deck: F frames of N beads.

    Attributes
    ----------
    time : ndarray, shape (F,)
        Time of each frame, s.
    frames : ndarray, shape (F, N, 9)
        Position (m), velocity (m/s) and spin (rad/s).
    forces : ndarray, shape (F, N, 6)
        Force (N) and torque (N m).
    directory
        Folder of the deck and of all its output.
    """

    time: FloatArray
    frames: FloatArray
    forces: FloatArray
    directory: Path


@dataclass
class Bench:
    """Runs decks with LIGGGHTS, each in a folder of its own.

    Attributes
    ----------
    engine
        The engine.
    folder
        Folder of the folders of the decks.
    stop
        Once it is set, running decks are stopped with `Stopped`.
    version
        The version that the engine has printed.
    """

    engine: Engine
    folder: Path
    stop: threading.Event = field(default_factory=threading.Event)
    version: str = "unknown"

    def run(self, plan: Plan | Deck, carry: Path | None = None) -> SceneOutput:
        """Run a deck and read its dump of beads.

        Parameters
        ----------
        plan
            A plan that records forces and torques, or its deck.
        carry
            A file that is copied beside the deck, such as a restart file.

        Raises
        ------
        EngineFailure
            If the engine fails.
        Stopped
            If ``stop`` is set.
        """
        deck = compose(plan) if isinstance(plan, Plan) else plan
        # Prescribed beads may be faster than any bead that is shaken.
        deck = replace(deck, fastest=inf)
        directory = Path(mkdtemp(dir=self.folder))
        write_deck(deck, directory)
        if carry is not None:
            shutil.copy(carry, directory)
        self.version = launch(deck, directory, self.engine, on_step=self._check_stop).version
        dump = BinaryDump(directory / deck.layout.bead_dump, deck.layout.bead_columns)
        beads = dump.stack()

        def vectors(*names: str) -> FloatArray:
            """The vectors that begin at columns, side by side."""
            parts = []
            for name in names:
                column = dump.columns.index(name)
                parts.append(beads[:, :, column : column + 3])
            return np.concatenate(parts, axis=-1)

        return SceneOutput(
            time=dump.steps.astype(np.float64) * deck.layout.time_step,
            frames=vectors("x", "vx", "omegax"),
            forces=vectors("fx", "tqx"),
            directory=directory,
        )

    def _check_stop(self, _: int) -> None:
        if self.stop.is_set():
            raise Stopped("the audit was stopped")


def relative_error(measured: FloatArray, expected: FloatArray) -> float:
    """The largest difference of two arrays of vectors, over the largest expected vector."""
    scale = np.linalg.norm(expected, axis=-1).max()
    difference = np.linalg.norm(measured - expected, axis=-1).max()
    return float(difference / (scale or 1.0))


def in_frame_of_walls(case: Case, output: SceneOutput) -> FloatArray:
    """Frames after the first in the frame of the walls, as the forces of these frames need them.

    Velocities of beads and walls are those of half a step before.

    Returns
    -------
    ndarray, shape (F - 1, N, 9)
        Position (m), velocity (m/s) and spin (rad/s).
    """
    frames = output.frames[1:].copy()
    time = output.time[1:]
    displacement = prescribed_motion(case.excitation, time)[0]
    velocity = prescribed_motion(case.excitation, time - 0.5 * case.run.time_step)[1]
    frames[..., :3] -= displacement[:, None]
    frames[..., 3:6] -= velocity[:, None]
    return frames


@dataclass(frozen=True)
class Setting:
    """A scene that both engines compute.

    Attributes
    ----------
    beads
        Beads at the start.
    walls
        Walls of the scene.
    changes
        Changes of `full_case`, by dotted key.
    free_steps
        Number of steps in which the beads move freely; 0 if their motion is prescribed.
    """

    beads: Sequence[Bead]
    walls: Sequence[Wall] = (BOTTOM,)
    changes: Mapping[str, Any] = field(default_factory=dict)
    free_steps: int = 0

    def lines(self, name: str, bench: Bench) -> Iterator[Line]:
        """Run the scene in both engines and compare; ``name`` is that of the scene."""
        case = full_case(self.changes)
        scene = scene_of(self.beads, self.walls)
        if self.free_steps:
            errors = self._errors_of_motion(case, scene, bench)
        else:
            errors = _errors_of_forces(case, scene, bench)
        for quantity, error in errors.items():
            yield Line(f"{name}: {quantity}, both engines", 0.0, error, EQUAL)

    def _errors_of_motion(self, case: Case, scene: PlacedBodies, bench: Bench) -> dict[str, float]:
        """Relative errors of displacement and spin of beads that move freely for some steps."""
        steps_per_frame = self.free_steps // _FREE_FRAMES
        output = bench.run(recorded_plan(case, scene, self.free_steps, steps_per_frame))
        start = output.frames[0, :, :3]
        frames_of_liggghts = output.frames[1:]
        frames_of_second_engine = second_engine(case, scene).run(self.free_steps, steps_per_frame)
        displacement = frames_of_liggghts[:, :, :3] - start
        second_displacement = frames_of_second_engine[..., :3] - start
        return {
            "displacement": relative_error(displacement, second_displacement),
            "spin": relative_error(frames_of_liggghts[:, :, 6:], frames_of_second_engine[..., 6:]),
        }


def _errors_of_forces(case: Case, scene: PlacedBodies, bench: Bench) -> dict[str, float]:
    """Relative errors of forces and torques on beads with a prescribed motion."""
    engine = second_engine(case, scene)
    output = bench.run(prescribed(case, scene))
    forces = np.array([engine.follow(frame) for frame in in_frame_of_walls(case, output)])
    return {
        "force": relative_error(output.forces[1:, :, :3], forces[..., :3]),
        "torque": relative_error(output.forces[1:, :, 3:], forces[..., 3:]),
    }


# --- scenes ---------------------------------------------------------------------------------------

_LEANING_WALL = Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning")
"""A tilted plane through a point (m) with a unit normal along no axis."""
_SIDE_WALL = Flat((0.0, 6.0e-4, 1e-3), (0.0, -1.0, 0.0), "+y")
"""An upright plane at y = 0.6 mm."""
_ROUND_WALL = Round(2.5e-3)
"""An upright cylinder with a radius of 2.5 mm."""
_ROLLING_SPIN: Vector = (0.0, 0.03 / LARGE_RADIUS, 0.0)
"""Spin of a large bead that rolls along x at 3 cm/s, rad/s."""
_LEAVING_BEAD = bead_at_plane(BOTTOM, -OVERLAP, LARGE_RADIUS, velocity=_UPWARD)
"""A bead that touches the floor and leaves it."""
_PARTING_PAIR = pair(-OVERLAP, 0.043, (0.02, -0.011, 0.005))
"""Two beads that touch and part."""
CLIMBING = [
    Bead(0, (0.0, 0.0, LARGE_RADIUS - OVERLAP), LARGE_RADIUS, (0.01, 0.02, 0.0), (5.0, 9.0, 40.0)),
    Bead(
        0,
        (LARGE_RADIUS + SMALL_RADIUS - OVERLAP, 0.0, SMALL_RADIUS + 1e-4),
        SMALL_RADIUS,
        (0.01, 0.03, -0.04),
        SPIN,
    ),
    Bead(
        0,
        (0.0, LARGE_RADIUS + LARGE_RADIUS - OVERLAP, LARGE_RADIUS - OVERLAP),
        LARGE_RADIUS,
        (0.0113, 0.0447, 0.0511),
        (3.0, -80.0, 5.0),
    ),
]
"""Three beads: two touch the floor and each other, one touches the first bead above the floor."""

SCENES: dict[str, Setting] = {
    "beads on the floor leave, approach, slide, roll, and spin in place": Setting(
        [
            _LEAVING_BEAD,
            bead_at_plane(BOTTOM, 2e-5, SMALL_RADIUS, velocity=_UPWARD, x=2e-3),
            bead_at_plane(BOTTOM, 9e-5, LARGE_RADIUS, velocity=(0.031, 0.023, -0.053), x=4e-3),
            bead_at_plane(
                BOTTOM, -OVERLAP, LARGE_RADIUS, velocity=(0.02, 0.013, 0.0), spin=AT_REST, x=6e-3
            ),
            bead_at_plane(
                BOTTOM,
                -OVERLAP,
                LARGE_RADIUS,
                velocity=(0.03, 0.0, 0.0),
                spin=_ROLLING_SPIN,
                x=8e-3,
            ),
            bead_at_plane(BOTTOM, -OVERLAP, LARGE_RADIUS, x=-2e-3),
            bead_at_plane(BOTTOM, 2e-6, SMALL_RADIUS, x=-4e-3),
        ]
    ),
    "a bead leaves a tilted wall": Setting(
        [bead_at_plane(_LEANING_WALL, -OVERLAP, LARGE_RADIUS, velocity=_UPWARD)], [_LEANING_WALL]
    ),
    "beads leave a cylindrical wall": Setting(
        [
            bead_in_cylinder(_ROUND_WALL, -OVERLAP, LARGE_RADIUS, 0.7, (-0.05, 0.03, 0.02)),
            bead_in_cylinder(_ROUND_WALL, -OVERLAP, SMALL_RADIUS, 3.0, (-0.05, 0.03, 0.02)),
        ],
        [_ROUND_WALL],
    ),
    "beads move along a cylindrical wall": Setting(
        [
            bead_in_cylinder(_ROUND_WALL, -OVERLAP, LARGE_RADIUS, 0.3, (-0.02, 0.3, 0.0)),
            bead_in_cylinder(_ROUND_WALL, 1e-5, SMALL_RADIUS, 2.0, (0.0, -0.4, 0.1)),
        ],
        [BOTTOM, _ROUND_WALL],
    ),
    "a bead in a corner": Setting(
        [
            Bead(
                0,
                (1e-4, 6.0e-4 - LARGE_RADIUS + OVERLAP, LARGE_RADIUS - OVERLAP),
                LARGE_RADIUS,
                (0.031, -0.043, 0.037),
                SPIN,
            )
        ],
        [BOTTOM, _SIDE_WALL],
    ),
    "pairs separate, of either order, approach, and roll on each other": Setting(
        [
            *_PARTING_PAIR,
            *shifted_beads(_PARTING_PAIR[::-1], 3e-3, 0.0),
            *shifted_beads(pair(4.1e-5, -0.023, (0.004, -0.003, 0.002)), 6e-3, 0.0),
            *shifted_beads(pair(-OVERLAP, 0.0, AT_REST), 9e-3, 0.0),
        ]
    ),
    "three beads on the floor": Setting(CLIMBING),
    "three beads on the floor, edges of menisci resist": Setting(
        CLIMBING, changes={"liquid.edge_ratio": 1.0}
    ),
    "three beads on the floor, friction grows with the velocity": Setting(
        CLIMBING, changes=_GROWING_FRICTION
    ),
    "the floor oscillates horizontally": Setting(
        [
            bead_at_plane(BOTTOM, -OVERLAP, LARGE_RADIUS),
            bead_at_plane(BOTTOM, -5e-7, SMALL_RADIUS, spin=AT_REST, x=2e-3),
        ],
        changes=_FAST_DRIVE,
    ),
    "the floor oscillates vertically": Setting(
        [
            bead_at_plane(BOTTOM, -OVERLAP, LARGE_RADIUS),
            bead_at_plane(BOTTOM, 3e-6, SMALL_RADIUS, spin=_ROLLING_SPIN, x=2e-3),
        ],
        changes={**_FAST_DRIVE, "drive.peak_acceleration": "25 g", "drive.axis": "z"},
    ),
    "weight and drive": Setting(
        [bead_at_plane(BOTTOM, -OVERLAP, LARGE_RADIUS), Bead(0, (2e-3, 0.0, 5e-3), SMALL_RADIUS)],
        changes={**_FAST_DRIVE, "drive.frame": "container", "drive.axis": "z", **_WEIGHT},
    ),
    "thrown beads, friction grows with the velocity": Setting(
        [
            bead_at_plane(
                BOTTOM, -1e-7, SMALL_RADIUS, velocity=(0.05, 0.0, 0.0), spin=AT_REST, x=-1e-3
            ),
            bead_at_plane(BOTTOM, 2e-5, LARGE_RADIUS, velocity=(0.04, -0.03, -0.2), x=1e-3),
            *pair(1e-5, -0.1, (0.01, -0.02, 0.0)),
        ],
        changes={**_WEIGHT, **_GROWING_FRICTION},
        free_steps=6000,
    ),
    "thrown beads": Setting(
        [
            bead_at_plane(BOTTOM, 2e-5, LARGE_RADIUS, velocity=(0.04, -0.03, -0.2), x=1e-3),
            bead_at_plane(
                BOTTOM, -1e-7, SMALL_RADIUS, velocity=(0.05, 0.0, 0.0), spin=AT_REST, x=-1e-3
            ),
            bead_at_plane(
                BOTTOM, -1e-7, LARGE_RADIUS, velocity=(0.03, 0.0, 0.0), spin=_ROLLING_SPIN, x=3e-3
            ),
            *pair(1e-5, -0.1, (0.01, -0.02, 0.0)),
            Bead(0, (0.0, 0.0, 5e-3), LARGE_RADIUS, (0.1, 0.2, 0.0), (1.0, 2.0, 3.0)),
        ],
        changes={**_WEIGHT, "drive.peak_acceleration": "4 g"},
        free_steps=6000,
    ),
}
"""Scenes by name: with prescribed motion, and of beads that move freely."""

for _law_name in LAWS:
    SCENES[f"beads leave the floor and each other ({_law_name})"] = Setting(
        [_LEAVING_BEAD, *_PARTING_PAIR],
        changes={"liquid.law": _law_name, "liquid.contact_angle": "10 deg"},
    )


# --- checks ---------------------------------------------------------------------------------------


def scene_lines(bench: Bench) -> Iterator[Line]:
    """All scenes in both engines."""
    for name, setting in SCENES.items():
        yield from setting.lines(name, bench)


def restart_lines(bench: Bench) -> Iterator[Line]:
    """Springs and open bridges continue from a restart file as in an uninterrupted run."""
    leaving_bead = replace(
        bead_at_plane(BOTTOM, -OVERLAP, SMALL_RADIUS, velocity=_UPWARD),
        centre=(3e-3, 0.0, SMALL_RADIUS - OVERLAP),
    )
    beads = [
        bead_at_plane(BOTTOM, -OVERLAP, LARGE_RADIUS, velocity=(0.002, 0.001, 0.0), spin=AT_REST),
        *pair(-OVERLAP, 0.001, (0.001, -0.002, 0.001)),
        leaving_bead,
        *shifted_beads(pair(-OVERLAP, 0.04, AT_REST), 0.0, 3e-3),
    ]
    case = full_case({})
    scene = scene_of(beads)
    uninterrupted = bench.run(prescribed(case, scene, 1000))
    first_half = replace(prescribed(case, scene, 500), restart_to="half.restart")
    restart_file = bench.run(first_half).directory / "half.restart"
    second_half = replace(
        first_half,
        segment=Segment(500, 1000, 0),
        restart_to=None,
        restart_from="half.restart",
    )
    continued = bench.run(second_half, restart_file)
    contact_of_bead = {
        0: "wall spring",
        1: "pair spring",
        3: "open wall bridge",
        5: "open pair bridge",
    }
    for bead, contact in contact_of_bead.items():
        expected = uninterrupted.forces[501:, bead, :3]
        error = relative_error(continued.forces[1:, bead, :3], expected)
        yield Line(f"{contact}: with and without a restart", 0.0, error, EQUAL)


def rank_lines(bench: Bench) -> Iterator[Line]:
    """A deck on two MPI ranks against the same deck on one."""
    first, last = pair(-OVERLAP, 0.01, AT_REST)
    # LIGGGHTS exchanges the beads of a pair that has crossed from one rank to the other.
    crossing = [
        *shifted_beads([first, last], 2.6e-3, 0.0, 0.9),
        *shifted_beads([last, first], 2.6e-3, 2e-3, 0.9),
    ]
    plan = prescribed(full_case({}), scene_of([*CLIMBING, *crossing]), 1000)
    single = bench.run(plan).forces
    double = bench.run(replace(plan, ranks=2)).forces
    force_error = relative_error(double[..., :3], single[..., :3])
    torque_error = relative_error(double[..., 3:], single[..., 3:])
    yield Line("forces: two MPI ranks and one", 0.0, force_error, EQUAL_DECKS)
    yield Line("torques: two MPI ranks and one", 0.0, torque_error, EQUAL_DECKS)


def stock_lines(bench: Bench) -> Iterator[Line]:
    """Two beads separate, with a bridge model of LIGGGHTS and with the contact model.

    Debian's own model is ``cohesion easo/capillary/viscous``; it has the law of Soulié et al.
    """
    changes = {
        "liquid.dynamic_viscosity": "4.6 mPa*s",
        "liquid.contact_angle": "20 deg",
        "liquid.law": "soulie",
        "contact.restitution": 0.5,
    }
    case = bench_case(changes)
    surfaces = surfaces_of(case, SMALL_RADIUS, LARGE_RADIUS)
    scene = scene_of(pair(-OVERLAP, 0.05, AT_REST, (AT_REST, AT_REST)))
    deck = compose(prescribed(case, scene))
    with_contact_model = bench.run(_with_fine_table(deck, case, surfaces))
    stock_deck = rendered(
        "walkers.second_engine",
        "stock.lig.j2",
        {
            "case": case,
            "scene": scene,
            "layout": deck.layout,
            "angle": degrees(sqrt(2.0 * case.liquid.contact_angle)),
            "closest": surfaces.roughness / surfaces.reduced_radius,
        },
    )
    with_stock_model = bench.run(replace(deck, text=stock_deck))
    error = relative_error(with_contact_model.forces[..., :3], with_stock_model.forces[..., :3])
    quantity = "two beads separate: force, Debian's own bridge model"
    yield Line(quantity, 0.0, error, EQUAL_DECKS)


def _with_fine_table(deck: Deck, case: Case, surfaces: Surfaces) -> Deck:
    """A deck with a more accurate table of the bridge between a small and a large bead."""
    fine = tabulated(by_name(case.liquid.law), surfaces, tolerance=1e-10).text()
    heading = f"1 1 {SMALL_RADIUS!r} {LARGE_RADIUS!r}"
    tables = deck.files[BRIDGES_NAME].split("bridge ")
    for number, table in enumerate(tables):
        if table.startswith(heading):
            tables[number] = f"{heading}\n{fine}"
    return replace(deck, files={**deck.files, BRIDGES_NAME: "bridge ".join(tables)})


def liquid_lines(bench: Bench, ranks: int = 1) -> Iterator[Line]:
    """Beads fly through each other along a floor and share their liquid, in both engines.

    Parameters
    ----------
    bench
        Runs the deck.
    ranks
        Number of MPI processes of LIGGGHTS.
    """
    # The tables of this law take no time.
    changes = {"liquid.volume_fraction": 0.02, "liquid.law": "willett"}
    case = bench_case(changes).with_value_at("liquid.conserved", True)
    plan = replace(
        prescribed(case, scene_of(_flying_beads(16)), 4000),
        ranks=ranks,
        bead_columns=(*_RECORDED_COLUMNS, FILM_COLUMN),
    )
    output = bench.run(plan)
    engine = second_engine(case, plan.scene)
    films = [engine.state.film.copy()]
    liquid_at_start = engine.liquid()
    for frame in output.frames[1:]:
        engine.follow(frame)
        films.append(engine.state.film.copy())
    dump = BinaryDump(output.directory / "beads.bin", plan.bead_columns).stack()
    error = float(np.abs(dump[:, :, -1] - films).max())
    remaining = engine.liquid() / liquid_at_start
    yield Line("films of beads that meet and part, both engines", 0.0, error, EQUAL_DECKS)
    yield Line("liquid at the end over liquid at the start", 1.0, remaining, EQUAL_DECKS)
    yield Line("smallest film", 0.0, float(np.min(films)))
    yield Line("largest film", 1.0, float(np.max(films)))


def _flying_beads(count: int) -> list[Bead]:
    """Beads of three sizes near the floor with random positions and velocities, without spin."""
    draw = np.random.default_rng(3)
    radii = draw.choice([2e-4, 2.5e-4, 3e-4], count)
    horizontal = draw.uniform(-8e-4, 8e-4, (count, 2))
    height = radii + draw.uniform(-3e-5, 8e-5, count)
    centres = np.column_stack([horizontal, height])
    horizontal_velocity = draw.uniform(-0.3, 0.3, (count, 2))
    vertical_velocity = draw.uniform(-0.03, 0.03, count)
    velocities = np.column_stack([horizontal_velocity, vertical_velocity])
    beads = []
    for centre, radius, velocity in zip(centres, radii.tolist(), velocities, strict=True):
        beads.append(Bead(0, _vector(centre), radius, _vector(velocity)))
    return beads


def shared_deck_lines(bench: Bench) -> Iterator[Line]:
    """A walker in a shared deck against the same walker in a deck of its own; a repeated run."""
    # Rolling friction would amplify rounding.
    changes = {"dimers.replicates": 1, "contact.rolling_friction": 0.0}
    case = load_case("fig1b", changes)
    run = case.run.with_values(cycles=10, cycles_per_segment=10, until_steady=False)
    case = case.with_values(run=run)
    peak_acceleration = case.excitation.peak_acceleration
    stronger = case.with_value_at("drive.peak_acceleration", 2.0 * peak_acceleration)
    sloping = case.with_value_at("boundary.tilt", 0.3)
    alone = _run_whole(bench, case)
    repeated = _run_whole(bench, case)
    shared = _run_whole(bench, stronger, case, sloping)
    displacement = alone.frames[..., :3] - alone.frames[0, :, :3]
    shared_displacement = shared.frames[..., :3] - shared.frames[0, :, :3]
    # The walker has the beads 0 and 1 of its own deck, and the beads 2 and 3 of the shared deck.
    error = relative_error(shared_displacement[:, 2:4], displacement[:, :2])
    yield Line("displacement of a walker: shared deck and own deck", 0.0, error, EQUAL_DECKS)
    dump = (alone.directory / "beads.bin").read_bytes()
    repeated_dump = (repeated.directory / "beads.bin").read_bytes()
    differs = float(dump != repeated_dump)
    yield Line("a repeated run is bit-identical (0: yes)", 0.0, differs, 0.0)


def _run_whole(bench: Bench, *cases: Case) -> SceneOutput:
    """Run the deck of one or several cases, with forces and torques."""
    return bench.run(replace(plan_of(*cases), bead_columns=_RECORDED_COLUMNS))


CHECKS: Mapping[str, Callable[[Bench], Iterable[Line]]] = {
    "scenes": scene_lines,
    "restart": restart_lines,
    "ranks": rank_lines,
    "stock": stock_lines,
    "liquid": liquid_lines,
    "company": shared_deck_lines,
}
"""Checks by name; each runs decks on a bench and gives lines."""
