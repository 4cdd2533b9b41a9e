"""Beads on prescribed ways, by the engine and, put where it had them, by the second engine, whose laws are the same.

Forces and torques of each step are compared, over the largest of the scene. Most scenes have `law`, whose pull and
resistances are all there, and have nothing to do with each other; each law that comes with the program has two more.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from math import cos, degrees, nan, pi, sin, sqrt

import numpy as np

from walkers.check.bench import FLOOR, Bench, Measured, bench_case, bench_recording, bench_scene, farthest
from walkers.check.engine import Beads, SecondEngine, engine_at
from walkers.check.lines import Line, Verdict
from walkers.inputs.boundary import Flat, Round
from walkers.inputs.case import Case
from walkers.inputs.drive import Vector
from walkers.inputs.text import rendered
from walkers.physics.bridge import Curve, FloatArray, Forces, Surfaces
from walkers.physics.laws import LAWS, law_of
from walkers.postprocess.motion import prescribed_motion
from walkers.templates.bridge_tables import tabulated
from walkers.templates.deck import BRIDGES_NAME, Checkpoint, Plan, compose
from walkers.templates.scene import Bead, Scene

EQUAL = 1e-6
"""Of the largest force or torque: how far two engines may differ, each with its own interpolation of the law."""
R, S = 3e-4, 2e-4
_DEEP = 1.7123e-6
"""m; overlap of what touches."""
_WAY, _SPIN = (0.031, -0.023, 0.053), (61.0, -83.0, 47.0)
_STEPS = 2000


def law(surfaces: Surfaces) -> Curve:
    """A bridge that forms before surfaces touch, with a kink near contact, and resistances of all kinds."""
    size, scale = surfaces.reduced_radius, surfaces.closest
    uneven = 1.0 - surfaces.radius / surfaces.other_radius  # none of equal beads, which have no order
    drag = 6.0 * pi * 0.03 * size

    def forces(gaps: FloatArray) -> Forces:
        near = 1.0 / np.maximum(gaps / scale, 1.0)
        return Forces(
            pull=0.05 * size * np.exp(-12.0 * gaps / size),
            normal=drag * near / surfaces.minimum_separation_ratio,
            sliding=drag * (4.0 + np.log(near)),
            coupling=-0.7 * uneven * drag * size * (1.0 + near),
            rolling=drag * size**2 * (4.0 + 2.0 * near),
        )

    return Curve(forces, rupture=0.25 * size, formation=0.03 * size)


def full_case(**changes: dict[str, object]) -> Case:
    """Friction, rolling friction, damping and the law of this module, but for some changes."""
    contact: dict[str, object] = {
        "friction": {"bead_bead": 0.23, "bead_wall": 0.31}, "rolling_friction": 0.04, "restitution": 0.4,
    }  # fmt: skip
    liquid: dict[str, object] = {"dynamic_viscosity": "4.6 mPa*s", "law": f"{__name__}:law"}
    return bench_case(**{**changes, "contact": contact, "liquid": {**liquid, **changes.get("liquid", {})}})


def second_engine(case: Case, scene: Scene) -> SecondEngine:
    """The second engine with the beads of a scene."""
    start = [[getattr(bead, name) for bead in scene.beads] for name in ("radius", "centre", "velocity", "spin")]
    without = () if case.drive.frame == "container" else ("drive",)
    return engine_at(case, Beads(*map(np.array, start)), walls=scene.walls, without=without)


def deviation(case: Case, scene: Scene, series: Measured) -> tuple[float, float]:
    """How far forces and torques of a series are from the second engine's, over the largest ones."""
    shift, _ = prescribed_motion(case.drive, series.time)
    _, speed = prescribed_motion(case.drive, series.time - 0.5 * case.run.time_step)  # when the beads had theirs
    engine = second_engine(case, scene)
    ways = (series.position - shift[:, None], series.velocity - speed[:, None], series.spin)
    found = [engine.follow(*(way[step] for way in ways)) for step in range(1, len(series.time))]
    force, torque = (np.array([one[which] for one in found]) for which in (0, 1))
    return farthest(series.force[1:], force), farthest(series.torque[1:], torque)


def prescribed(case: Case, scene: Scene, steps: int = _STEPS, **options: object) -> Plan:
    """Move the beads of a scene with their velocities, recording each step."""
    return Plan(case, scene, bench_recording(steps), prescribed=True, **options)  # type: ignore[arg-type]


def over(
    wall: Flat, gap: float, radius: float, velocity: Vector = (0.0, 0.0, 0.0), spin: Vector = _SPIN, x: float = 0.0
) -> Bead:
    """A bead at a gap (m) from a wall, so far along x (m) from its point."""
    centre = [at + (radius + gap) * n for at, n in zip(wall.point, wall.normal, strict=True)]
    return Bead(0, (centre[0] + x, centre[1], centre[2]), radius, velocity, spin)


def within(wall: Round, gap: float, radius: float, turn: float, velocity: Vector) -> Bead:
    """A bead at a gap (m) from a round wall, toward an azimuth (rad); its velocity is outward, along and upward."""
    out, (away, along, up) = wall.radius - radius - gap, velocity
    x, y = cos(turn), sin(turn)
    return Bead(0, (out * x, out * y, 10.0 * turn * R), radius, (away * x - along * y, away * y + along * x, up), _SPIN)


def pair(
    gap: float, apart: float, slide: Vector, spins: tuple[Vector, Vector] = (_SPIN, (-29.0, 53.0, 19.0))
) -> list[Bead]:
    """Two beads of unlike size in mid-air, at a gap (m), with a velocity apart (m/s) and another one besides."""
    n = np.array([0.48, 0.6, 0.64])
    first, second = np.array([-3e-3, 1e-3, 4e-3]), apart * n + np.array(slide)
    place = first + (R + S + gap) * n
    return [
        Bead(0, (first[0], first[1], first[2]), R, spin=spins[0]),
        Bead(0, (place[0], place[1], place[2]), S, (second[0], second[1], second[2]), spins[1]),
    ]


_LEANING = Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning")
_SIDE = Flat((0.0, 6.0e-4, 1e-3), (0.0, -1.0, 0.0), "+y")
_ROUND = Round(2.5e-3)
_IN_CORNER = Bead(0, (1e-4, 6.0e-4 - R + _DEEP, R - _DEEP), R, (0.031, -0.043, 0.037), _SPIN)
_CLIMBING = [
    Bead(0, (0.0, 0.0, R - _DEEP), R, (0.01, 0.02, 0.0), (5.0, 9.0, 40.0)),
    Bead(0, (R + S - _DEEP, 0.0, S + 1e-4), S, (0.01, 0.03, -0.04), _SPIN),
    Bead(0, (0.0, R + R - _DEEP, R - _DEEP), R, (0.0113, 0.0447, 0.0511), (3.0, -80.0, 5.0)),
]
_ROLL: Vector = (0.0, 0.03 / R, 0.0)
_STILL: Vector = (0.0, 0.0, 0.0)
_LAB = partial(full_case, drive={"frame": "lab", "frequency": "300 Hz", "peak_acceleration": "8 g"})
_UPRIGHT = partial(full_case, drive={"frame": "lab", "frequency": "300 Hz", "peak_acceleration": "25 g", "axis": "z"})
_DRIVEN = partial(
    full_case,
    drive={"frequency": "300 Hz", "peak_acceleration": "8 g", "axis": "z"},
    environment={"gravity": "9.81 m/s^2"},
)
_LEAVING = [over(FLOOR, -_DEEP, R, _WAY), over(FLOOR, 2e-5, S, _WAY, x=2e-3)]
_SHAKEN = [over(FLOOR, -_DEEP, R), over(FLOOR, -5e-7, S, spin=_STILL, x=2e-3)]
_LIFTED = [over(FLOOR, -_DEEP, R), over(FLOOR, 3e-6, S, spin=_ROLL, x=2e-3)]
_PARTING = pair(-_DEEP, 0.043, (0.02, -0.011, 0.005))
_ON_ROUND = [within(_ROUND, -_DEEP, size, turn, (-0.05, 0.03, 0.02)) for size, turn in ((R, 0.7), (S, 3.0))]
_ALONG_ROUND = [within(_ROUND, -_DEEP, R, 0.3, (-0.02, 0.3, 0.0)), within(_ROUND, 1e-5, S, 2.0, (0.0, -0.4, 0.1))]

SCENES: dict[str, tuple[Callable[[], Case], Scene]] = {
    "a bead leaves the floor": (full_case, bench_scene(_LEAVING)),
    "a bead comes to the floor": (full_case, bench_scene([over(FLOOR, 9e-5, R, (0.031, 0.023, -0.053))])),
    "a bead slides": (full_case, bench_scene([over(FLOOR, -_DEEP, R, (0.02, 0.013, 0.0), _STILL)])),
    "a bead rolls": (full_case, bench_scene([over(FLOOR, -_DEEP, R, (0.03, 0.0, 0.0), _ROLL)])),
    "a bead spins where it is": (full_case, bench_scene([over(FLOOR, -_DEEP, R), over(FLOOR, 2e-6, S, x=2e-3)])),
    "a bead leaves a leaning wall": (full_case, bench_scene([over(_LEANING, -_DEEP, R, _WAY)], [_LEANING])),
    "beads leave a round wall": (full_case, bench_scene(_ON_ROUND, [_ROUND])),
    "beads move along a round wall": (full_case, bench_scene(_ALONG_ROUND, [FLOOR, _ROUND])),
    "a bead in a corner": (full_case, bench_scene([_IN_CORNER], [FLOOR, _SIDE])),
    "two beads part": (full_case, bench_scene(_PARTING)),
    "two beads part, the smaller first": (full_case, bench_scene(_PARTING[::-1])),
    "two beads meet": (full_case, bench_scene(pair(4.1e-5, -0.023, (0.004, -0.003, 0.002)))),
    "two beads roll on each other": (full_case, bench_scene(pair(-_DEEP, 0.0, _STILL))),
    "three beads on the floor": (full_case, bench_scene(_CLIMBING)),
    "the floor moves to and fro": (_LAB, bench_scene(_SHAKEN)),
    "the floor moves up and down": (_UPRIGHT, bench_scene(_LIFTED)),
    "weight and drive": (_DRIVEN, bench_scene([over(FLOOR, -_DEEP, R), Bead(0, (2e-3, 0.0, 5e-3), S)])),
}
"""Each with its case."""
for _name in LAWS:
    _case = partial(full_case, liquid={"law": _name, "contact_angle": "10 deg"})
    SCENES[f"a bead leaves the floor ({_name})"] = _case, bench_scene([over(FLOOR, -_DEEP, R, _WAY)])
    SCENES[f"two beads part ({_name})"] = _case, bench_scene(_PARTING)


def scene_lines(bench: Bench) -> Iterator[Line]:
    """Beads on prescribed ways beside the second engine."""
    for name, (make, scene) in SCENES.items():
        case = make()
        errors = deviation(case, scene, bench.run(prescribed(case, scene)))
        for what, error in zip(("force", "torque"), errors, strict=True):
            yield Line(f"{name}: {what} beside the second engine's", 0.0, error, EQUAL)


def restart_lines(bench: Bench) -> Iterator[Line]:
    """Springs and open bridges, of pairs and at walls, go on from a restart file as without one."""
    case = full_case()
    beads = [over(FLOOR, -_DEEP, R, (0.002, 0.001, 0.0), _STILL), *pair(-_DEEP, 0.001, (0.001, -0.002, 0.001))]
    gone = replace(over(FLOOR, -_DEEP, S, _WAY), centre=(3e-3, 0.0, S - _DEEP))
    scene = bench_scene([*beads, gone, *(_moved(bead, 0.0, 3e-3) for bead in pair(-_DEEP, 0.04, _STILL))])
    whole = bench.run(prescribed(case, scene, 1000))
    first = prescribed(case, scene, 500, checkpoint=Checkpoint(write="half.restart"))
    carry = bench.run(first).directory / "half.restart"
    recording = replace(bench_recording(1000), begin=500)
    second = bench.run(replace(first, recording=recording, checkpoint=Checkpoint(read="half.restart")), carry)
    kept = ("a spring at a wall", 0), ("a spring of a pair", 1), ("an open bridge to a wall", 3), ("one of a pair", 5)
    for what, number in kept:
        error = farthest(second.force[1:, number], whole.force[501:, number])
        yield Line(f"{what} after a restart beside one without", 0.0, error, EQUAL)


def _moved(bead: Bead, x: float, y: float, speed: float = 0.0) -> Bead:
    """A bead elsewhere (m), so much faster along x (m/s)."""
    place, velocity = bead.centre, bead.velocity
    return replace(
        bead, centre=(place[0] + x, place[1] + y, place[2]), velocity=(velocity[0] + speed, velocity[1], velocity[2])
    )


def rank_lines(bench: Bench) -> Iterator[Line]:
    """A deck on two MPI ranks against the same on one."""
    if shutil.which("mpirun") is None:
        yield Line("two MPI ranks: no mpirun on this machine", nan, nan, 0.0, unmeasured=Verdict.SKIPPED)
        return
    # The engine takes a pair the other way round where it has crossed from one rank to the other.
    first, last = pair(-_DEEP, 0.01, _STILL)
    crossing = [
        _moved(bead, 2.6e-3, y, 0.9) for y, beads in ((0.0, (first, last)), (2e-3, (last, first))) for bead in beads
    ]
    case, scene = full_case(), bench_scene([*_CLIMBING, *crossing])
    one, two = (bench.run(prescribed(case, scene, 1000, ranks=ranks)) for ranks in (1, 2))
    yield Line("forces on two MPI ranks beside one", 0.0, farthest(two.force, one.force), 1e-9)
    yield Line("torques on two MPI ranks beside one", 0.0, farthest(two.torque, one.torque), 1e-9)


def stock_lines(bench: Bench) -> Iterator[Line]:
    """Two beads that part by Debian's own ``cohesion easo/capillary/viscous``, against the contact model's Soulié."""
    bare = bench_case(
        liquid={"dynamic_viscosity": "4.6 mPa*s", "contact_angle": "20 deg", "law": "soulie"},
        contact={"restitution": 0.5},
    )
    scene = bench_scene(pair(-_DEEP, 0.05, _STILL, (_STILL, _STILL)))
    deck = compose(prescribed(bare, scene))
    meeting = Surfaces.of(S, R, bare.liquid, bare.contact.minimum_separation_ratio)
    fine = tabulated(law_of(bare.liquid), meeting, tolerance=1e-10).text()
    tables = deck.files[BRIDGES_NAME].split("bridge ")
    tables = [f"1 1 {S!r} {R!r}\n{fine}" if one.startswith(f"1 1 {S!r} {R!r}") else one for one in tables]
    ours = bench.run(replace(deck, files={**deck.files, BRIDGES_NAME: "bridge ".join(tables)}))
    angle = degrees(sqrt(2.0 * bare.liquid.contact_angle))
    text = rendered("walkers.check", "stock.lig.j2", case=bare, scene=scene, layout=deck.layout, angle=angle)
    theirs = bench.run(replace(deck, text=text))
    error = farthest(ours.force, theirs.force)
    yield Line("two beads part: force beside that of Debian's model of bridges", 0.0, error, 1e-9)
