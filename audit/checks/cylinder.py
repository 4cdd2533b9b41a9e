"""Group 4, too: forces at the round wall of a cylinder, which is to hold a bead as one plane wherever it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np

from walkers.audit.bench import Bench, Measured, bench_recording
from walkers.audit.check import Check, Line
from walkers.audit.checks.viscous import viscous_case
from walkers.audit.laws import Exerted, Partner, bridge_law, frame_by_frame_error
from walkers.inputs.boundary import SIDES, Cylinder, Span
from walkers.inputs.case import Case
from walkers.physics.capillary import rupture_distance_at_wall
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import prescribed_motion
from walkers.templates.deck import Plan
from walkers.templates.scene import Bead, Scene

_CYLINDER = Cylinder(material="glass", width=5e-3, height=20e-3)
_RADII = (2e-4, 3.5e-4, 5.5e-4)
_OVERLAP = 2e-6
_RETREAT = 0.02
_SPEED = 1.0
_ALONG = 0.03
_SPIN = (60.0, -80.0, 40.0)
_GAP = 0.08
"""Of the radius: the gap in the middle of the ways around the wall."""
_LAW = "Soulié et al. 2006, Eqs. 13, 14; Nase et al.; at one plane"
_NEEDS = frozenset({"carriers", "walls"})


def _scene(beads: list[Bead]) -> Scene:
    room = _CYLINDER.room(Span(0.0, 0.0, 0.0, 0.0, max(_RADII)), 1)
    first = len(room.carriers) + 1
    numbered = tuple(replace(bead, id=first + number) for number, bead in enumerate(beads))
    return Scene(numbered, _CYLINDER.faces(), room.carriers, room.lower, room.upper)


def _places(number: int, face: int) -> tuple[float, float]:
    """Azimuth of the middle of a face, and a height of its own, for each bead."""
    return 2.0 * pi * (face % SIDES + 0.5) / SIDES, 1.2e-3 * (number + 1)


def _at(azimuth: float, out: float, aside: float, z: float) -> tuple[float, float, float]:
    """A place so far from the axis toward an azimuth and so far to its left, m."""
    return out * cos(azimuth) - aside * sin(azimuth), out * sin(azimuth) + aside * cos(azimuth), z


def _leaving() -> list[Bead]:
    """Beads of three sizes that leave a face from five places across it, sliding up and spinning."""
    beads: list[Bead] = []
    for radius in _RADII:
        inner = _CYLINDER.width / 2.0 - radius
        for share in (-0.6, -0.3, 0.0, 0.3, 0.6):
            azimuth, z = _places(len(beads), 11 * len(beads))
            place = _at(azimuth, inner + _OVERLAP, share * inner * pi / SIDES, z)
            x, y, _ = _at(azimuth, -_RETREAT, 0.0, 0.0)
            beads.append(Bead(0, place, radius, (x, y, _ALONG), _SPIN))
    return beads


def _half_chord(radius: float) -> float:
    """Half the length of the way of a bead around the wall, in whose middle its gap is `_GAP`, m."""
    return sqrt(2.0 * (_CYLINDER.width / 2.0 - radius) * _GAP * radius)


def _around() -> list[Bead]:
    """Beads of three sizes that move on chords past several faces, either way: touching, open, touching again."""
    beads: list[Bead] = []
    for radius in _RADII:
        inner = _CYLINDER.width / 2.0 - radius
        for way in (1.0, -1.0):
            azimuth, z = _places(len(beads), 12 + 8 * len(beads))  # none whose triangles are numbered like a bead
            reach = _half_chord(radius)
            place = _at(azimuth, sqrt(inner**2 - reach**2) + _OVERLAP, -way * reach, z)
            x, y, _ = _at(azimuth, 0.0, way * _SPEED, 0.0)
            beads.append(Bead(0, place, radius, (x, y, 0.0), _SPIN))
    return beads


def _law(case: Case, bead: Bead, series: Measured) -> Exerted:
    """What the nearest face of the prism is to exert on a bead, standing twice in the deck."""
    row = series.row(bead.id)
    displacement, speed = prescribed_motion(case.drive, series.steps * case.run.time_step)
    place = series.position[:, row] - displacement
    faces = _CYLINDER.faces()[1:]
    normals, middles = np.array([face.normal for face in faces]), np.array([face.centroid for face in faces])
    heights = place @ normals.T - np.einsum("kx,kx->k", normals, middles)
    nearest = heights.argmin(axis=1)
    return bridge_law(
        case, bead.radius, Partner(bead.radius, wall=True), normals[nearest], heights.min(axis=1) - bead.radius,
        series.velocity[:, row] - speed, series.spin[:, row],
    )  # fmt: skip


def _run(bench: Bench, case: Case, scene: Scene, seconds: float, every: int) -> Measured:
    steps = int(seconds / case.run.time_step / every) * every
    recording = bench_recording(steps, every)
    return bench.run(Plan(case, scene, recording, workarounds=bench.workarounds, prescribed=True, skin=2e-4))


def at_cylinder(bench: Bench) -> Iterator[Line]:
    """Beads that leave the wall, at rest and moving; beads on their way around it; the wall without its strips."""
    scene = _scene(_leaving())
    for where, case in (("at rest", viscous_case()), ("moving along x", viscous_case("lab", "0.25 g", "x"))):
        farthest = rupture_distance_at_wall(max(_RADII), case.liquid.volume_fraction, 0.0)
        series = _run(bench, case, scene, 1.2 * farthest / _RETREAT, 20)
        judged = slice(int(case.drive.frame == "lab"), None)  # moving walls do so from the first step on
        force = torque = 0.0
        for bead in scene.beads:
            law, row = _law(case, bead, series), series.row(bead.id)
            force = max(force, frame_by_frame_error(series.force[judged, row], law.force[judged]))
            torque = max(torque, frame_by_frame_error(series.torque[judged, row], law.torque[judged]))
        for what, error in (("force", force), ("torque", torque)):
            line = f"{what} on beads that leave the wall of a cylinder, {where}, R 0.2 to 0.55 mm"
            yield Line(line, _LAW, 0.0, error, "rel.", 2e-3, error, _NEEDS)
    case, scene = viscous_case(), _scene(_around())
    mean = _mean_errors(case, scene, _around_run(bench, case, scene))
    for radius in _RADII:
        for number, way in enumerate(("one way", "the other way")):
            error = mean[scene.beads[2 * _RADII.index(radius) + number].id]
            what = f"force on a bead around the wall of a cylinder {way}, mean error, R {radius * 1e3:g} mm"
            yield Line(what, _LAW, 0.0, error, "rel.", 0.02, error, frozenset({"walls"}))
    plain = replace(scene, faces=tuple(replace(face, of=None) for face in scene.faces))
    worst = max(_mean_errors(case, scene, _around_run(bench, case, plain)).values())
    what = "a prism of large triangles holds beads by several of its faces"
    yield Line(what, "force off by more than 10 % in the mean: 1", 1.0, float(worst > 0.1), defect=True)


def _around_run(bench: Bench, case: Case, scene: Scene) -> Measured:
    return _run(bench, case, scene, 2.0 * _half_chord(max(_RADII)) / _SPEED, 1)


def _mean_errors(case: Case, scene: Scene, series: Measured) -> dict[int, float]:
    """Mean deviation of the force over a bead's way, relative to the mean force, while it is near the wall."""
    errors = {}
    for bead in scene.beads:
        law = _law(case, bead, series)
        there = slice(0, int(2.0 * _half_chord(bead.radius) / _SPEED / case.run.time_step))
        deviation: FloatArray = np.linalg.norm(series.force[there, series.row(bead.id)] - law.force[there], axis=1)
        errors[bead.id] = float(deviation.mean() / np.linalg.norm(law.force[there], axis=1).mean())
    return errors


CHECKS = (Check("cylinder", 4, "forces at a round wall, at any place and on the way around it", True, at_cylinder),)
