"""Group 4: viscous forces: between beads, at six faces of a box at rest and moving, without carriers, in a film."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Literal

import numpy as np

from walkers.audit.bench import Bench, Measured, bench_case, bench_recording, scene_on_floor
from walkers.audit.check import Check, Line
from walkers.audit.laws import Partner, bridge_law, frame_by_frame_error
from walkers.inputs.boundary import AxisName, Face
from walkers.inputs.case import Case
from walkers.inputs.drive import Vector
from walkers.physics.capillary import rupture_distance_at_wall
from walkers.physics.film import film_drag, film_thickness
from walkers.physics.lubrication import normal_drag, tangential_drag, tangential_drag_at_wall
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import prescribed_motion
from walkers.templates.deck import Plan
from walkers.templates.engine import ALL_WORKAROUNDS, Workarounds
from walkers.templates.scene import Bead, Scene

AXES: tuple[AxisName, ...] = ("x", "y", "z")
HALF = 3e-3
"""Half of the box's inner side, m."""
_OUTSIDE = 1.2e-3
_OVERLAP = 2e-6
_RETREAT = 0.02
_ALONG: Vector = (0.03, -0.02, 0.025)
_SPIN: Vector = (60.0, -80.0, 40.0)
_NASE = "6πηR* v_n/max(ε, h/R*), Nase et al. in Shi, McCarthy 2008, Eqs. 40, 41"
_NEEDS = frozenset({"carriers", "walls"})
_IN_FILM = "the same and 6πηR v along the wall for each wall nearer than a bridge reaches"


def viscous_case(frame: str = "container", acceleration: str = "0 g", axis: str = "x") -> Case:
    """Si AK5's viscosity, everything else as on the bench."""
    return bench_case(
        liquid={"dynamic_viscosity": "4.6 mPa*s"},
        drive={"frame": frame, "peak_acceleration": acceleration, "axis": axis},
    )


def box_scene(radius: float, ranks: int = 1) -> Scene:
    """26 beads at the faces, edges and corners of a cube, six carriers outside it for every rank (split along x).

    One more, last, moves where no wall is near.
    """
    sides: tuple[Literal[1], Literal[-1]] = (1, -1)
    faces = [
        Face(
            axis,
            side,
            (-side * HALF * (axis == "x"), -side * HALF * (axis == "y"), -side * HALF * (axis == "z")),
            wall=f"{side}{axis}",
        )
        for axis in AXES
        for side in sides
    ]
    far = HALF + _OUTSIDE
    carriers: list[Vector] = []
    for rank in range(ranks):
        x = far if ranks == 1 else (rank - (ranks - 1) / 2.0) * 2.0 * far / ranks
        carriers += [(x, y, z) for y in (-far, far) for z in (-1e-3, 0.0, 1e-3)]
    beads = []
    for number, place in enumerate(p for p in product((-1, 0, 1), repeat=3) if any(p)):
        centre = [side * (HALF - radius + _OVERLAP) if side else 3e-4 for side in place]
        velocity = [-side * _RETREAT if side else along for side, along in zip(place, _ALONG, strict=True)]
        beads.append(
            Bead(
                len(carriers) + 1 + number,
                (centre[0], centre[1], centre[2]),
                radius,
                (velocity[0], velocity[1], velocity[2]),
                _SPIN,
            )
        )
    beads.append(Bead(len(carriers) + 1 + len(beads), (5e-4, 4e-4, 3e-4), radius, _ALONG, _SPIN))
    edge = HALF + 2.0 * _OUTSIDE
    return Scene(tuple(beads), tuple(faces), tuple(carriers), (-edge,) * 3, (edge,) * 3)


def box_errors(case: Case, scene: Scene, series: Measured) -> dict[int, FloatArray]:
    """Largest errors of viscous force and of torque, frame by frame, by the number of walls that a bead is bound to."""
    radius = scene.beads[0].radius
    errors: dict[int, FloatArray] = {}
    displacement, speed = prescribed_motion(case.drive, series.steps * case.run.time_step)
    # The first frame of moving walls is left out: they move from the first step on.
    judged = slice(int(case.drive.frame == "lab"), None)
    for bead in scene.beads[:-1]:
        row = series.row(bead.id)
        exerted, film = [], np.zeros_like(displacement)
        for axis in range(3):
            if abs(bead.centre[axis]) < HALF - 2.0 * radius:
                continue
            side = np.sign(bead.centre[axis])
            normal = np.zeros_like(displacement)
            normal[:, axis] = -side
            gap = HALF - side * (series.position[:, row, axis] - displacement[:, axis]) - radius
            velocity = series.velocity[:, row] - speed
            partner = Partner(radius, wall=True)
            exerted.append(bridge_law(case, radius, partner, normal, gap, velocity, series.spin[:, row]))
            film += _film_law(case, radius, gap, velocity * (np.arange(3) != axis))
        viscous = series.force[:, row] - sum(one.steady for one in exerted)
        found = np.array(
            [
                frame_by_frame_error(viscous[judged], (film + sum(one.viscous for one in exerted))[judged]),
                frame_by_frame_error(
                    series.torque[judged, row], np.sum([one.torque for one in exerted], axis=0)[judged]
                ),
            ]
        )
        errors[len(exerted)] = np.maximum(errors.get(len(exerted), np.zeros(2)), found)
    return errors


def _film_law(case: Case, radius: float, gap: FloatArray, velocity: FloatArray) -> FloatArray:
    """Drag of the film of a wall on a bead, N, shape (F, 3), given the gap (m) and the velocity along the wall."""
    within = gap < film_thickness(radius, case.liquid.volume_fraction, case.liquid.contact_angle)
    return -film_drag(case.liquid.film_viscosity, radius) * within[:, None] * velocity


def run_box(bench: Bench, case: Case, workarounds: Workarounds, ranks: int = 1) -> tuple[Scene, Measured]:
    """Retract the 26 beads from their walls, from touching to past rupture."""
    radius = case.walkers[0].radii[0]
    scene = box_scene(radius, ranks)
    rupture = rupture_distance_at_wall(radius, case.liquid.volume_fraction, 0.0)
    steps = int(1.4 * rupture / (_RETREAT * case.run.time_step) / 100) * 100
    plan = Plan(case, scene, bench_recording(steps, 5), workarounds=workarounds, prescribed=True, ranks=ranks)
    return scene, bench.run(plan)


def box_lines(where: str, errors: dict[int, FloatArray], needs: frozenset[str]) -> Iterator[Line]:
    """Lines of the errors of force and torque at faces, edges and corners."""
    for walls, name in ((1, "on the six faces"), (2, "along the twelve edges"), (3, "in the eight corners")):
        for what, error in zip(("force", "torque"), map(float, errors[walls]), strict=True):
            yield Line(f"viscous {what} {name}, {where}", _NASE, 0.0, error, "rel.", 1e-3, error, needs)


def between_beads(bench: Bench) -> Iterator[Line]:
    """Beads that part, slide and spin past each other, touching and open."""
    case = viscous_case()
    beads: list[Bead] = []
    pairs = ((2e-4, 2e-4), (3e-4, 2e-4), (6e-4, 2e-4))
    for number, (large, small) in enumerate(pairs):
        x = 6e-3 * (number - 1)
        beads.append(Bead(0, (x, 0.0, 5e-3), large, spin=(-30.0, 50.0, 20.0)))
        beads.append(Bead(0, (x, 0.0, 5e-3 + large + small - _OVERLAP), small, (0.015, -0.01, _RETREAT), _SPIN))
    plan = Plan(case, scene_on_floor(beads), bench_recording(3000, 10), workarounds=bench.workarounds, prescribed=True)
    series = bench.run(plan)
    for number, (large, small) in enumerate(pairs):
        low, high = series.row(2 + 2 * number), series.row(3 + 2 * number)
        arm = series.position[:, high] - series.position[:, low]
        distance = np.linalg.norm(arm, axis=1)
        law = bridge_law(
            case, small, Partner(large), arm / distance[:, None], distance - large - small,
            series.velocity[:, high] - series.velocity[:, low], series.spin[:, high], series.spin[:, low],
        )  # fmt: skip
        viscous = series.force[:, high] - law.steady
        along, whole = (
            np.einsum("fx,fx->f", force, law.normal)[:, None] * law.normal for force in (viscous, law.viscous)
        )
        for what, error in (
            ("normal viscous force", frame_by_frame_error(along, whole)),
            ("tangential viscous force", frame_by_frame_error(viscous - along, law.viscous - whole)),
            ("viscous torque", frame_by_frame_error(series.torque[:, high], law.torque)),
        ):
            where = f"between beads, R {large * 1e3:g}/{small * 1e3:g} mm"
            yield Line(f"{what} {where}", _NASE, 0.0, error, "rel.", 1e-3, error)


def at_walls(bench: Bench) -> Iterator[Line]:
    """Six faces at rest and moving along each axis; faces, edges and corners; touching and open."""
    case = viscous_case()
    yield from box_lines("walls at rest", box_errors(case, *run_box(bench, case, bench.workarounds)), _NEEDS)
    for axis in AXES:
        moving = viscous_case("lab", "0.25 g", axis)
        errors = box_errors(moving, *run_box(bench, moving, bench.workarounds))
        yield from box_lines(f"walls moving along {axis}", errors, _NEEDS)


def in_film(bench: Bench) -> Iterator[Line]:
    """Beads in the films of one, two and three walls, at rest and moving, until they leave them; and one in none."""
    for frame, axis in (("container", "x"), ("lab", "x"), ("lab", "z")):
        bare = viscous_case(frame, "0.25 g" if frame == "lab" else "0 g", axis)
        case = replace(bare, liquid=replace(bare.liquid, film_viscosity=10.0 * bare.liquid.dynamic_viscosity))
        scene, series = run_box(bench, case, bench.workarounds)
        errors = box_errors(case, scene, series)
        where = f"walls moving along {axis}" if frame == "lab" else "walls at rest"
        for walls, name in ((1, "one wall"), (2, "two walls"), (3, "three walls")):
            error = float(errors[walls][0])
            yield Line(f"force in the film of {name}, {where}", _IN_FILM, 0.0, error, "rel.", 1e-3, error, _NEEDS)
        largest = float(np.abs(series.force[:, series.row(scene.beads[-1].id)]).max())
        yield Line(f"no drag on a bead that is near no wall, {where}", "films live on walls", 0.0, largest, "N", 0.0)


def without_carriers(bench: Bench) -> Iterator[Line]:
    """The raw engine's forces of open wall bridges."""
    case = viscous_case()
    errors = box_errors(
        case, *run_box(bench, case, Workarounds(carriers=False, wall_copies=ALL_WORKAROUNDS.wall_copies))
    )
    off = float(max(error[0] for error in errors.values()) > 0.1)
    what = "without carriers open wall bridges read a stranger's velocity"
    yield Line(what, "viscous force off by more than 10 %: 1", 1.0, off, defect=True)


_PLANE = "6πηR v_n/max(ε, h/R), 6πηR (8/15 ln(1/max(ε, h/R)) + 0.9588) v_t: R* of a plane is R"


def open_bridges(bench: Bench) -> Iterator[Line]:
    """A bead that slides away from the floor, against the drags of a plane: with what decks add, and without it."""
    case = viscous_case()
    radius, liquid, nearest = case.walkers[0].radii[0], case.liquid, case.contact.minimum_separation_ratio
    bead = Bead(2, (0.0, 0.0, radius - _OVERLAP), radius, (_ALONG[0], 0.0, _RETREAT))
    steps = int(rupture_distance_at_wall(radius, liquid.volume_fraction, 0.0) / (_RETREAT * case.run.time_step))
    scene, recording = scene_on_floor([bead]), bench_recording(steps, 5)
    for workarounds, defect in ((bench.workarounds, False), (replace(bench.workarounds, open_bridges=False), True)):
        plan = Plan(case, scene, recording, workarounds=workarounds, prescribed=True)
        normal, along, gap = _drags(case, radius, bench.run(plan))
        plane = np.array([normal_drag(liquid.dynamic_viscosity, radius, nearest, float(h)) for h in gap])
        ratio = normal / plane
        opened = gap > 1.05 * nearest * radius
        if not defect:
            error = float(np.abs(ratio - 1.0).max())
            what = "normal drag of a bridge to a wall, closed and open"
            yield Line(what, _PLANE, 0.0, error, "rel.", 1e-3, error, _NEEDS)
            shear = np.array([tangential_drag(liquid.dynamic_viscosity, radius, nearest, float(h)) for h in gap])
            least = min(tangential_drag_at_wall(1.0, radius, nearest, h) / tangential_drag(1.0, radius, nearest, h)
                        for h in map(float, gap))  # fmt: skip
            what = "tangential drag of open wall bridges over a plane's, least"
            yield Line(what, _PLANE, least, float((along / shear).min()), "", 1e-3, defect=True)
        else:
            what = "normal drag of open wall bridges over a plane's, without what decks add"
            yield Line(what, _PLANE, 0.5, float(ratio[opened].mean()), "", 1e-3, defect=True)


def _drags(case: Case, radius: float, series: Measured) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of a bead that slides away from the floor: force over velocity normal to it and along it (N s/m), gap (m)."""
    row = series.row(2)
    gap = series.position[:, row, 2] - radius
    upward = np.broadcast_to([0.0, 0.0, 1.0], (len(gap), 3))
    velocity, spin = series.velocity[:, row], series.spin[:, row]
    law = bridge_law(case, radius, Partner(radius, wall=True), upward, gap, velocity, spin)
    viscous = series.force[:, row] - law.steady
    return -viscous[:, 2] / velocity[:, 2], -viscous[:, 0] / velocity[:, 0], gap


CHECKS = (
    Check("viscous-beads", 4, "viscous force between beads", True, between_beads),
    Check("viscous-walls", 4, "viscous force at faces, edges and corners, at rest and moving", True, at_walls),
    Check("film-walls", 4, "a film on one, two and three walls, at rest and moving", True, in_film),
    Check("open-bridges", 4, "drag of open bridges to a wall against that of a plane", True, open_bridges),
    Check("viscous-carriers", 4, "the same without carriers", True, without_carriers),
)
