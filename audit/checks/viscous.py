"""Group 4: viscous forces, between beads and at the six faces of a box at rest and moving, with and without riders."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from audit.bench import Bench, Measured, bench_case, bench_recording, scene_on_floor
from audit.check import Check, Line
from audit.laws import Partner, bridge_law, largest_error
from inputs import forces
from inputs.case import WalkerCase
from postprocess.dump import FloatArray
from templates.deck import Plan
from templates.engine import ALL_REMEDIES, Remedies
from templates.scene import AXES, Bead, Face, Point, Scene, vector_along

HALF = 3e-3
"""Half of the box's inner side, m."""
_OUTSIDE = 1.2e-3
_OVERLAP = 2e-7
_RETREAT = 0.02
_ALONG: Point = (0.03, -0.02, 0.025)
_SPIN: Point = (60.0, -80.0, 40.0)
_NASE = "6πηR* v_n/max(ε, h/R*), Nase et al. in Shi, McCarthy 2008, Eqs. 40, 41"
_NEEDS = frozenset({"riders", "walls"})


def viscous_case(frame: str = "container", acceleration: str = "0 g") -> WalkerCase:
    """Si AK5's viscosity, everything else as on the bench."""
    return bench_case(
        liquid={"dynamic_viscosity": "4.6 mPa*s"},
        drive={"frame": frame, "peak_acceleration": acceleration},
    )


def box_scene(radius: float, ranks: int = 1) -> Scene:
    """26 beads at the faces, edges and corners of a cube, six riders outside it for every rank (split along x)."""
    faces = [Face(axis, side, vector_along(axis, -side * HALF)) for axis in AXES for side in (1, -1)]
    far = HALF + _OUTSIDE
    riders: list[Point] = []
    for rank in range(ranks):
        x = far if ranks == 1 else (rank - (ranks - 1) / 2.0) * 2.0 * far / ranks
        riders += [(x, y, z) for y in (-far, far) for z in (-1e-3, 0.0, 1e-3)]
    beads = []
    for number, place in enumerate(p for p in product((-1, 0, 1), repeat=3) if any(p)):
        centre = [side * (HALF - radius + _OVERLAP) if side else 3e-4 for side in place]
        velocity = [-side * _RETREAT if side else along for side, along in zip(place, _ALONG, strict=True)]
        beads.append(
            Bead(
                len(riders) + 1 + number,
                (centre[0], centre[1], centre[2]),
                radius,
                (velocity[0], velocity[1], velocity[2]),
                _SPIN,
            )
        )
    edge = HALF + 2.0 * _OUTSIDE
    return Scene(tuple(beads), tuple(faces), tuple(riders), (-edge,) * 3, (edge,) * 3)


def box_errors(case: WalkerCase, scene: Scene, series: Measured, shift: int = 0) -> dict[int, FloatArray]:
    """Largest relative errors of force and torque, by the number of walls that a bead is bound to.

    Parameters
    ----------
    shift
        How many riders the deck was run without.
    """
    radius = scene.beads[0].radius
    errors: dict[int, FloatArray] = {}
    drive = case.drive
    time = series.steps * case.run.time_step
    moving = drive.frame == "lab"
    displacement = np.zeros((len(time), 3))
    speed = np.zeros((len(time), 3))
    if moving:
        axis = AXES.index(drive.axis)
        displacement[:, axis] = drive.amplitude * np.sin(drive.angular_frequency * time)
        speed[:, axis] = drive.peak_velocity * np.cos(drive.angular_frequency * time)
    for bead in scene.beads:
        row = bead.id - 1 - shift
        force, torque = np.zeros_like(displacement), np.zeros_like(displacement)
        walls = 0
        for axis in range(3):
            side = int(np.sign(bead.centre[axis])) if abs(bead.centre[axis]) > HALF - 2 * radius else 0
            if not side:
                continue
            walls += 1
            normal = np.zeros_like(displacement)
            normal[:, axis] = -side
            gap = HALF - side * (series.position[:, row, axis] - displacement[:, axis]) - radius
            velocity = series.velocity[:, row] - speed
            law = bridge_law(
                case, radius, Partner(radius, wall=True), normal, gap, velocity, radius * series.spin[:, row]
            )
            force, torque = force + law[0], torque + law[1]
        # The first frame of moving walls is left out: they move from the first step on.
        found = np.array(
            [
                largest_error(series.force[moving:, row], force[moving:]),
                largest_error(series.torque[moving:, row], torque[moving:]),
            ]
        )
        errors[walls] = np.maximum(errors.get(walls, np.zeros(2)), found)
    return errors


def run_box(bench: Bench, case: WalkerCase, remedies: Remedies, ranks: int = 1) -> dict[int, FloatArray]:
    """Retract the 26 beads from their walls, from touching to past rupture, and compare with the law."""
    radius = case.beads.radii[0]
    scene = box_scene(radius, ranks)
    rupture = forces.rupture_distance(forces.bridge_volume_at_wall(radius, case.liquid.volume_fraction), 0.0)
    steps = int(1.4 * rupture / (_RETREAT * case.run.time_step) / 100) * 100
    plan = Plan(case, scene, bench_recording(steps, 10), remedies=remedies, prescribed=True, ranks=ranks)
    series = bench.run(plan)
    return box_errors(case, scene, series, 0 if remedies.riders else len(scene.riders))


def box_lines(where: str, errors: dict[int, FloatArray], needs: frozenset[str]) -> Iterator[Line]:
    """Lines of the errors of force and torque at faces, edges and corners."""
    for walls, name in ((1, "on the six faces"), (2, "along the twelve edges"), (3, "in the eight corners")):
        for what, error in zip(("force", "torque"), errors[walls], strict=True):
            yield Line(
                f"viscous and capillary {what} {name}, {where}",
                _NASE,
                0.0,
                float(error),
                "rel.",
                1e-3,
                float(error),
                needs,
            )


def between_beads(bench: Bench) -> Iterator[Line]:
    """Beads that part, slide and spin past each other, touching and open."""
    case = viscous_case()
    beads: list[Bead] = []
    pairs = ((2e-4, 2e-4), (3e-4, 2e-4), (6e-4, 2e-4))
    for number, (large, small) in enumerate(pairs):
        x = 6e-3 * (number - 1)
        beads.append(Bead(0, (x, 0.0, 5e-3), large, spin=(-30.0, 50.0, 20.0)))
        beads.append(Bead(0, (x, 0.0, 5e-3 + large + small - _OVERLAP), small, (0.015, -0.01, _RETREAT), _SPIN))
    plan = Plan(case, scene_on_floor(beads), bench_recording(3000, 10), remedies=bench.remedies, prescribed=True)
    series = bench.run(plan)
    first = 2 if bench.remedies.riders else 1
    for number, (large, small) in enumerate(pairs):
        low, high = first - 1 + 2 * number, first + 2 * number
        arm = series.position[:, high] - series.position[:, low]
        distance = np.linalg.norm(arm, axis=1)
        turning = small * series.spin[:, high] + large * series.spin[:, low]
        force, torque = bridge_law(
            case, small, Partner(large), arm / distance[:, None], distance - large - small,
            series.velocity[:, high] - series.velocity[:, low], turning,
        )  # fmt: skip
        for what, error in (
            ("force", largest_error(series.force[:, high], force)),
            ("torque", largest_error(series.torque[:, high], torque)),
        ):
            yield Line(
                f"viscous and capillary {what} between beads, R {large * 1e3:g}/{small * 1e3:g} mm", _NASE, 0.0, error,
                "rel.", 1e-3, error,
            )  # fmt: skip


def at_walls(bench: Bench) -> Iterator[Line]:
    """Six faces at rest and moving, faces, edges and corners."""
    yield from box_lines("walls at rest", run_box(bench, viscous_case(), bench.remedies), _NEEDS)
    moving = viscous_case("lab", "0.25 g")
    yield from box_lines("walls moving", run_box(bench, moving, bench.remedies), _NEEDS)


def without_riders(bench: Bench) -> Iterator[Line]:
    """The raw engine's forces of open wall bridges."""
    errors = run_box(bench, viscous_case(), Remedies(riders=False, wall_copies=ALL_REMEDIES.wall_copies))
    present = float(max(error[0] for error in errors.values()) > 0.1)
    yield Line(
        "defect: without riders open wall bridges read a stranger's velocity (1: yes)", "force off by more than 10 %",
        1.0, present, "", 0.0,
    )  # fmt: skip


CHECKS = (
    Check("viscous-beads", 4, "viscous force between beads", True, between_beads),
    Check("viscous-walls", 4, "viscous force at faces, edges and corners, at rest and moving", True, at_walls),
    Check("viscous-riders", 4, "the same without riders", True, without_riders),
)
