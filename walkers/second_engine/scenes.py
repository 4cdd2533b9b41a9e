"""Scenes of a few beads, which compare the engine with the second engine.

In most scenes the engine moves the beads along prescribed paths, and the second engine follows their positions: forces
and torques of each step are compared, relative to the largest of the scene. In other scenes the beads move freely, and
their displacements and spins are compared. Most scenes have the bridge law `law`, with independent pull and
resistances; two scenes test each law of the program.
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
"""Tolerance between the engines, relative to the largest force, torque or displacement (interpolation errors)."""
DRY = {"liquid.law": f"{__file__}:dry"}
"""Changes of a case without bridges."""
FLOOR = BOTTOM
R, S = 3e-4, 2e-4
DEEP = 1.7123e-6
"""m; overlap of touching beads."""
STILL: Vector = (0.0, 0.0, 0.0)
WAY, SPIN = (0.031, -0.023, 0.053), (61.0, -83.0, 47.0)


def dry(surfaces: Surfaces) -> Curve:
    """A law without forces."""
    return Curve(lambda gaps: Forces(*[np.zeros_like(gaps)] * 5), rupture=surfaces.roughness)


def law(surfaces: Surfaces) -> Curve:
    """A bridge that forms before surfaces touch, with a kink near contact, and resistances of all kinds."""
    size, scale = surfaces.reduced_radius, surfaces.roughness
    uneven = (
        1.0 - surfaces.radius / surfaces.other_radius
    )  # none of equal beads, which have no order
    drag = 6.0 * pi * 0.03 * size

    def forces(gaps: FloatArray) -> Forces:
        near = 1.0 / np.maximum(gaps / scale, 1.0)
        return Forces(
            pull=0.05 * size * np.exp(-12.0 * gaps / size),
            normal=drag * near * size / surfaces.roughness,
            sliding=drag * (4.0 + np.log(near)),
            coupling=-0.7 * uneven * drag * size * (1.0 + near),
            rolling=drag * size**2 * (4.0 + 2.0 * near),
        )

    return Curve(forces, rupture=0.25 * size, formation=0.03 * size)


_BARE = {
    "beads": {"density": "4.0 g/cm^3"},
    "dimers": {"radii": ["0.3 mm", "0.2 mm"]},
    "liquid": {"surface_tension": "19.2 mN/m", "dynamic_viscosity": "0 Pa*s"},
    "boundary": {"material": "glass"},
    "contact": {
        **{
            "friction": {"bead_bead": 0.0, "bead_wall": 0.0},
            "rolling_friction": 0.0,
            "restitution": 1.0,
        },
        **{"roughness": {"bead_bead": "2 um", "bead_wall": "2 um"}, "youngs_modulus": "50 MPa"},
    },
    "drive": {"frequency": "80 Hz", "peak_acceleration": "0 g", "frame": "container"},
    "run": {"time_step": "1 us", "samples_per_cycle": 1},
    "environment": {"gravity": "0 m/s^2"},
}
_FULL = {
    **{"contact.friction.bead_bead": 0.23, "contact.friction.bead_wall": 0.31},
    **{"contact.rolling_friction": 0.04, "contact.restitution": 0.4},
    **{"liquid.dynamic_viscosity": "4.6 mPa*s", "liquid.law": f"{__file__}:law"},
}


def bench_case(changes: Mapping[str, Any]) -> Case:
    """A case without friction, damping, viscosity, gravity and drive, with changes by dotted keys."""
    return build_case(_BARE, source="<audit>", name="audit", changes=changes)


def full_case(changes: Mapping[str, Any]) -> Case:
    """A case with friction, rolling friction, damping and the law of this module, with changes by dotted keys."""
    return bench_case({**_FULL, **changes})


def over(
    wall: Flat,
    gap: float,
    radius: float,
    velocity: Vector = STILL,
    spin: Vector = SPIN,
    x: float = 0.0,
) -> Bead:
    """A bead at a gap (m) from a wall, at a distance along x (m) from the point of the wall."""
    centre = [at + (radius + gap) * n for at, n in zip(wall.point, wall.normal, strict=True)]
    return Bead(0, (centre[0] + x, centre[1], centre[2]), radius, velocity, spin)


def bead_in_cylinder(wall: Round, gap: float, radius: float, turn: float, velocity: Vector) -> Bead:
    """A bead at a gap (m) from a cylindrical wall at an azimuth (rad); velocity: radial, azimuthal, axial."""
    out, (away, along, up) = wall.radius - radius - gap, velocity
    x, y = cos(turn), sin(turn)
    return Bead(
        0,
        (out * x, out * y, 10.0 * turn * R),
        radius,
        (away * x - along * y, away * y + along * x, up),
        SPIN,
    )


def pair(
    gap: float,
    apart: float,
    slide: Vector,
    spins: tuple[Vector, Vector] = (SPIN, (-29.0, 53.0, 19.0)),
) -> list[Bead]:
    """Two free beads of different sizes at a gap (m), with a separation velocity and a common velocity (m/s)."""
    n = np.array([0.48, 0.6, 0.64])
    first, second = np.array([-3e-3, 1e-3, 4e-3]), apart * n + np.array(slide)
    place = first + (R + S + gap) * n
    return [
        Bead(0, (first[0], first[1], first[2]), R, spin=spins[0]),
        Bead(0, (place[0], place[1], place[2]), S, (second[0], second[1], second[2]), spins[1]),
    ]


def moved(beads: Sequence[Bead], x: float, y: float, speed: float = 0.0) -> list[Bead]:
    """Beads shifted by x and y (m), with an additional velocity along x (m/s)."""
    places = [np.add(bead.centre, (x, y, 0.0)).tolist() for bead in beads]
    speeds = [np.add(bead.velocity, (speed, 0.0, 0.0)).tolist() for bead in beads]
    return [
        replace(bead, centre=tuple(place), velocity=tuple(velocity))
        for bead, place, velocity in zip(beads, places, speeds, strict=True)
    ]


def scene_of(beads: Sequence[Bead], walls: Sequence[Wall] = (FLOOR,)) -> PlacedBodies:
    """A scene of beads between walls in a box of 2 cm around the origin."""
    numbered = tuple(replace(bead, id=number) for number, bead in enumerate(beads, 1))
    return PlacedBodies(numbered, tuple(walls), (-0.01,) * 3, (0.01,) * 3)


def recording(steps: int, sample_every: int = 1) -> dict[str, Any]:
    """Options of a plan that records beads with their forces and torques, and bridges at the start and the end."""
    every = {"sample_every": sample_every, "bridge_every": steps, "status_every": steps}
    return {
        "segment": Segment(0, steps, 0),
        **every,
        "bead_columns": (*BEAD_COLUMNS, *FORCE_COLUMNS),
    }


def prescribed(case: Case, scene: PlacedBodies, steps: int = 2000, **options: Any) -> Plan:
    """Move the beads of a scene with their velocities, recording each step."""
    return Plan(case, scene, prescribed=True, **recording(steps), **options)


def second_engine(case: Case, scene: PlacedBodies) -> SecondEngine:
    """The second engine with the beads of a scene."""
    start = np.array([[*bead.centre, *bead.velocity, *bead.spin] for bead in scene.beads])
    radius = np.array([bead.radius for bead in scene.beads])
    without = () if case.drive.frame == "container" else ("drive",)
    return SecondEngine(case, radius, start, walls=scene.walls, without=without)


@dataclass(frozen=True)
class SceneOutput:
    """Output of a deck, SI units: F times, frames (F, N, 9: position, velocity, spin), forces and torques (F, N, 6)."""

    time: FloatArray
    frames: FloatArray
    forces: FloatArray
    directory: Path


@dataclass
class Bench:
    """Runs decks in a folder, until ``stop`` is set; ``version`` is printed by the engine."""

    engine: Engine
    folder: Path
    stop: threading.Event = field(default_factory=threading.Event)
    version: str = "unknown"

    def run(self, plan: Plan | Deck, carry: Path | None = None) -> SceneOutput:
        """Run a plan that records forces, or its deck, with a file such as a restart file beside it."""
        deck = compose(plan) if isinstance(plan, Plan) else plan
        deck = replace(deck, fastest=inf)  # prescribed beads may be faster than shaken ones
        directory = Path(mkdtemp(dir=self.folder))
        write_deck(deck, directory)
        if carry is not None:
            shutil.copy(carry, directory)
        self.version = launch(deck, directory, self.engine, on_step=self._look).version
        dump = BinaryDump(directory / deck.layout.bead_dump, deck.layout.bead_columns)
        beads = dump.stack()
        vectors = [
            beads[:, :, dump.columns.index(name) :][:, :, :3]
            for name in ("x", "vx", "omegax", "fx", "tqx")
        ]
        time = dump.steps.astype(np.float64) * deck.layout.time_step
        return SceneOutput(
            time, np.concatenate(vectors[:3], -1), np.concatenate(vectors[3:], -1), directory
        )

    def _look(self, _: int) -> None:
        if self.stop.is_set():
            raise Stopped("the audit was stopped")


def farthest(measured: FloatArray, expected: FloatArray) -> float:
    """The largest distance of two series of vectors, over the largest expected vector."""
    scale = np.linalg.norm(expected, axis=-1).max()
    return float(np.linalg.norm(measured - expected, axis=-1).max() / (scale or 1.0))


@dataclass(frozen=True)
class Setting:
    """A scene, the ``changes`` of `full_case`, and the number of steps if beads move ``freely``."""

    beads: Sequence[Bead]
    walls: Sequence[Wall] = (FLOOR,)
    changes: Mapping[str, Any] = field(default_factory=dict)
    freely: int = 0

    def lines(self, name: str, bench: Bench) -> Iterator[Line]:
        """Run the scene in both engines and compare the results."""
        case, scene = full_case(self.changes), scene_of(self.beads, self.walls)
        engine = second_engine(case, scene)
        if self.freely:
            every = self.freely // 100
            series = bench.run(Plan(case, scene, **recording(self.freely, every)))
            start, frames = series.frames[0, :, :3], engine.run(self.freely, every)
            pairs = {
                "displacement": (series.frames[1:, :, :3] - start, frames[..., :3] - start),
                "spin": (series.frames[1:, :, 6:], frames[..., 6:]),
            }
        else:
            series = bench.run(prescribed(case, scene))
            forces = np.array([engine.follow(frame) for frame in in_walls(case, series)])
            parts = {"force": slice(0, 3), "torque": slice(3, 6)}
            pairs = {
                quantity: (series.forces[1:, :, part], forces[..., part])
                for quantity, part in parts.items()
            }
        for quantity, both in pairs.items():
            yield Line(f"{name}: {quantity}, both engines", 0.0, farthest(*both), EQUAL)


def in_walls(case: Case, series: SceneOutput) -> FloatArray:
    """Frames after the first in the frame of the walls, with the velocities used for the forces."""
    frames = series.frames[1:].copy()
    frames[..., :3] -= prescribed_motion(case.excitation, series.time[1:])[0][:, None]
    # Velocities of beads and walls are from half a step before.
    frames[..., 3:6] -= prescribed_motion(
        case.excitation, series.time[1:] - 0.5 * case.run.time_step
    )[1][:, None]
    return frames


_LEANING = Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning")
_SIDE = Flat((0.0, 6.0e-4, 1e-3), (0.0, -1.0, 0.0), "+y")
_ROUND = Round(2.5e-3)
_LEAVING, _PARTING = over(FLOOR, -DEEP, R, WAY), pair(-DEEP, 0.043, (0.02, -0.011, 0.005))
_ROLL: Vector = (0.0, 0.03 / R, 0.0)
CLIMBING = [
    Bead(0, (0.0, 0.0, R - DEEP), R, (0.01, 0.02, 0.0), (5.0, 9.0, 40.0)),
    Bead(0, (R + S - DEEP, 0.0, S + 1e-4), S, (0.01, 0.03, -0.04), SPIN),
    Bead(0, (0.0, R + R - DEEP, R - DEEP), R, (0.0113, 0.0447, 0.0511), (3.0, -80.0, 5.0)),
]
_WEIGHT = {"environment.gravity": "9.81 m/s^2"}
_FAST = {"drive.frequency": "300 Hz", "drive.peak_acceleration": "8 g", "drive.frame": "lab"}

SCENES: dict[str, Setting] = {
    "beads on the floor leave, approach, slide, roll, and spin in place": Setting(
        [
            _LEAVING,
            over(FLOOR, 2e-5, S, WAY, x=2e-3),
            over(FLOOR, 9e-5, R, (0.031, 0.023, -0.053), x=4e-3),
            over(FLOOR, -DEEP, R, (0.02, 0.013, 0.0), STILL, x=6e-3),
            over(FLOOR, -DEEP, R, (0.03, 0.0, 0.0), _ROLL, x=8e-3),
            over(FLOOR, -DEEP, R, x=-2e-3),
            over(FLOOR, 2e-6, S, x=-4e-3),
        ]
    ),
    "a bead leaves a tilted wall": Setting([over(_LEANING, -DEEP, R, WAY)], [_LEANING]),
    "beads leave a cylindrical wall": Setting(
        [
            bead_in_cylinder(_ROUND, -DEEP, size, turn, (-0.05, 0.03, 0.02))
            for size, turn in ((R, 0.7), (S, 3.0))
        ],
        [_ROUND],
    ),
    "beads move along a cylindrical wall": Setting(
        [
            bead_in_cylinder(_ROUND, -DEEP, R, 0.3, (-0.02, 0.3, 0.0)),
            bead_in_cylinder(_ROUND, 1e-5, S, 2.0, (0.0, -0.4, 0.1)),
        ],
        [FLOOR, _ROUND],
    ),
    "a bead in a corner": Setting(
        [Bead(0, (1e-4, 6.0e-4 - R + DEEP, R - DEEP), R, (0.031, -0.043, 0.037), SPIN)],
        [FLOOR, _SIDE],
    ),
    "pairs separate, of either order, approach, and roll on each other": Setting(
        [
            *_PARTING,
            *moved(_PARTING[::-1], 3e-3, 0.0),
            *moved(pair(4.1e-5, -0.023, (0.004, -0.003, 0.002)), 6e-3, 0.0),
            *moved(pair(-DEEP, 0.0, STILL), 9e-3, 0.0),
        ]
    ),
    "three beads on the floor": Setting(CLIMBING),
    "the floor oscillates horizontally": Setting(
        [over(FLOOR, -DEEP, R), over(FLOOR, -5e-7, S, spin=STILL, x=2e-3)], changes=_FAST
    ),
    "the floor oscillates vertically": Setting(
        [over(FLOOR, -DEEP, R), over(FLOOR, 3e-6, S, spin=_ROLL, x=2e-3)],
        changes={**_FAST, "drive.peak_acceleration": "25 g", "drive.axis": "z"},
    ),
    "weight and drive": Setting(
        [over(FLOOR, -DEEP, R), Bead(0, (2e-3, 0.0, 5e-3), S)],
        changes={**_FAST, "drive.frame": "container", "drive.axis": "z", **_WEIGHT},
    ),
    "thrown beads": Setting(
        [
            over(FLOOR, 2e-5, R, (0.04, -0.03, -0.2), x=1e-3),
            over(FLOOR, -1e-7, S, (0.05, 0.0, 0.0), STILL, x=-1e-3),
            over(FLOOR, -1e-7, R, (0.03, 0.0, 0.0), _ROLL, x=3e-3),
            *pair(1e-5, -0.1, (0.01, -0.02, 0.0)),
            Bead(0, (0.0, 0.0, 5e-3), R, (0.1, 0.2, 0.0), (1.0, 2.0, 3.0)),
        ],
        changes={**_WEIGHT, "drive.peak_acceleration": "4 g"},
        freely=6000,
    ),
    **{
        f"beads leave the floor and each other ({name})": Setting(
            [_LEAVING, *_PARTING], changes={"liquid.law": name, "liquid.contact_angle": "10 deg"}
        )
        for name in LAWS
    },
}
"""Scenes by name: with prescribed motion, and of beads that move freely."""


def restart_lines(bench: Bench) -> Iterator[Line]:
    """Springs and open bridges of pairs and walls continue from a restart file as in an uninterrupted run."""
    beads = [
        over(FLOOR, -DEEP, R, (0.002, 0.001, 0.0), STILL),
        *pair(-DEEP, 0.001, (0.001, -0.002, 0.001)),
    ]
    leaving = replace(over(FLOOR, -DEEP, S, WAY), centre=(3e-3, 0.0, S - DEEP))
    scene = scene_of([*beads, leaving, *moved(pair(-DEEP, 0.04, STILL), 0.0, 3e-3)])
    whole = bench.run(prescribed(full_case({}), scene, 1000))
    first = prescribed(full_case({}), scene, 500, restart_to="half.restart")
    carry = bench.run(first).directory / "half.restart"
    second = replace(
        first, segment=Segment(500, 1000, 0), restart_to=None, restart_from="half.restart"
    )
    forces = bench.run(second, carry).forces[1:, :, :3]
    kept = ("wall spring", 0), ("pair spring", 1), ("open wall bridge", 3), ("open pair bridge", 5)
    for quantity, number in kept:
        error = farthest(forces[:, number], whole.forces[501:, number, :3])
        yield Line(f"{quantity}: with and without a restart", 0.0, error, EQUAL)


def rank_lines(bench: Bench) -> Iterator[Line]:
    """A deck on two MPI ranks against the same on one."""
    # The engine exchanges the beads of a pair that has crossed from one rank to the other.
    first, last = pair(-DEEP, 0.01, STILL)
    crossing = [*moved([first, last], 2.6e-3, 0.0, 0.9), *moved([last, first], 2.6e-3, 2e-3, 0.9)]
    scene = scene_of([*CLIMBING, *crossing])
    single, double = (
        bench.run(prescribed(full_case({}), scene, 1000, ranks=ranks)).forces for ranks in (1, 2)
    )
    yield Line(
        "forces: two MPI ranks and one", 0.0, farthest(double[..., :3], single[..., :3]), 1e-9
    )
    yield Line(
        "torques: two MPI ranks and one", 0.0, farthest(double[..., 3:], single[..., 3:]), 1e-9
    )


def stock_lines(bench: Bench) -> Iterator[Line]:
    """Two beads separate: Debian's own ``cohesion easo/capillary/viscous`` against the contact model's Soulié law."""
    liquid = {
        "liquid.dynamic_viscosity": "4.6 mPa*s",
        "liquid.contact_angle": "20 deg",
        "liquid.law": "soulie",
    }
    bare = bench_case({**liquid, "contact.restitution": 0.5})
    scene = scene_of(pair(-DEEP, 0.05, STILL, (STILL, STILL)))
    deck = compose(prescribed(bare, scene))
    meeting = surfaces_of(bare, S, R)
    fine = tabulated(by_name(bare.liquid.law), meeting, tolerance=1e-10).text()
    tables = deck.files[BRIDGES_NAME].split("bridge ")
    tables = [
        f"1 1 {S!r} {R!r}\n{fine}" if table.startswith(f"1 1 {S!r} {R!r}") else table
        for table in tables
    ]
    ours = bench.run(replace(deck, files={**deck.files, BRIDGES_NAME: "bridge ".join(tables)}))
    angle = degrees(sqrt(2.0 * bare.liquid.contact_angle))
    closest = meeting.roughness / meeting.reduced_radius
    given = {
        "case": bare,
        "scene": scene,
        "layout": deck.layout,
        "angle": angle,
        "closest": closest,
    }
    text = rendered("walkers.second_engine", "stock.lig.j2", given)
    theirs = bench.run(replace(deck, text=text))
    error = farthest(ours.forces[..., :3], theirs.forces[..., :3])
    yield Line("two beads separate: force, Debian's own bridge model", 0.0, error, 1e-9)


def liquid_lines(bench: Bench, ranks: int = 1) -> Iterator[Line]:
    """Beads that fly through each other along a floor and share their liquid, in both engines."""
    draw = np.random.default_rng(3)
    liquid = {"liquid.volume_fraction": 0.02, "liquid.law": "willett"}  # whose tables take no time
    case = bench_case(liquid).with_value_at("liquid.conserved", True)
    radii = draw.choice([2e-4, 2.5e-4, 3e-4], 16)
    start = np.column_stack(
        [draw.uniform(-8e-4, 8e-4, (16, 2)), radii + draw.uniform(-3e-5, 8e-5, 16)]
    )
    velocity = np.column_stack([draw.uniform(-0.3, 0.3, (16, 2)), draw.uniform(-0.03, 0.03, 16)])
    places, speeds = map(tuple, start.tolist()), map(tuple, velocity.tolist())
    beads = [Bead(0, *bead) for bead in zip(places, radii.tolist(), speeds, strict=True)]
    plan = prescribed(case, scene_of(beads), 4000, ranks=ranks)
    plan = replace(plan, bead_columns=(*BEAD_COLUMNS, *FORCE_COLUMNS, FILM_COLUMN))
    series, engine = bench.run(plan), second_engine(case, plan.scene)
    films, everything = [engine.state.film.copy()], engine.liquid()
    for frame in series.frames[1:]:
        engine.follow(frame)
        films.append(engine.state.film.copy())
    dump = BinaryDump(series.directory / "beads.bin", plan.bead_columns).stack()
    away = float(np.abs(dump[:, :, -1] - films).max())
    yield Line("films of beads that meet and part, both engines", 0.0, away, 1e-9)
    yield Line(
        "liquid at the end over liquid at the start", 1.0, engine.liquid() / everything, 1e-9
    )
    yield Line("smallest film", 0.0, float(np.min(films)))
    yield Line("largest film", 1.0, float(np.max(films)))


def company_lines(bench: Bench) -> Iterator[Line]:
    """A walker in a shared deck against the same walker in a deck of its own; and a repeated run."""
    alone = load_case(
        "fig1b", {"dimers.replicates": 1, "contact.rolling_friction": 0.0}
    )  # which amplifies rounding
    alone = alone.with_values(
        run=alone.run.with_values(cycles=10, cycles_per_segment=10, until_steady=False)
    )
    stronger = alone.with_value_at(
        "drive.peak_acceleration", 2.0 * alone.excitation.peak_acceleration
    )
    sloping = alone.with_value_at("boundary.tilt", 0.3)

    def ran(*cases: Case) -> SceneOutput:
        return bench.run(replace(plan_of(*cases), bead_columns=(*BEAD_COLUMNS, *FORCE_COLUMNS)))

    first, again, together = ran(alone), ran(alone), ran(stronger, alone, sloping)
    displacements = [
        series.frames[..., :3] - series.frames[0, :, :3] for series in (first, together)
    ]
    error = farthest(displacements[1][:, 2:4], displacements[0][:, :2])
    yield Line("displacement of a walker: shared deck and own deck", 0.0, error, 1e-9)
    same = (first.directory / "beads.bin").read_bytes() == (
        again.directory / "beads.bin"
    ).read_bytes()
    yield Line("a repeated run is bit-identical (0: yes)", 0.0, float(not same), 0.0)


CHECKS: Mapping[str, Callable[[Bench], Iterable[Line]]] = {
    "scenes": lambda bench: (
        line for name, setting in SCENES.items() for line in setting.lines(name, bench)
    ),
    "restart": restart_lines,
    "ranks": rank_lines,
    "stock": stock_lines,
    "liquid": liquid_lines,
    "company": company_lines,
}
"""Checks by name; each runs decks on a bench and returns lines."""
