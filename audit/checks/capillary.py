"""Groups 1 to 3: capillary forces between beads and at walls, rupture, contact angle."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, degrees, pi, radians, sqrt

import numpy as np

from walkers.audit.bench import FIRST_BEAD, Bench, Measured, bench_case, bench_recording, scene_on_floor
from walkers.audit.check import Check, Line
from walkers.audit.laws import Partner, bridge_law, capillary_law, hertz_law, largest_error
from walkers.inputs.case import Case
from walkers.physics.capillary import (
    bridge_volume_at_wall,
    bridge_volume_between_beads,
    capillary_force,
    capillary_force_at_wall,
    rupture_distance,
)
from walkers.postprocess.dump import FloatArray
from walkers.templates.deck import Plan
from walkers.templates.engine import Workarounds
from walkers.templates.scene import Bead

_SPEED = 0.02
_OVERLAP = 2e-7
_RATIOS = (1.0, 1.5, 3.0)
_SMALL = 2e-4
_SOULIE = "Soulié et al. 2006, Eqs. 13, 14"
_WALL = frozenset({"walls"})


def _pairs(ratios: tuple[float, ...], gap: float, speed: float) -> list[Bead]:
    """Pairs high above the floor; the upper bead of each moves away from the lower one."""
    beads = []
    for number, ratio in enumerate(ratios):
        x, large = 6e-3 * (number - 1), ratio * _SMALL
        beads.append(Bead(0, (x, 0.0, 5e-3), large))
        beads.append(Bead(0, (x, 0.0, 5e-3 + large + _SMALL + gap), _SMALL, velocity=(0.0, 0.0, speed)))
    return beads


def _steps_to(distance: float, case: Case, samples: int = 100) -> tuple[int, int]:
    every = max(1, int(distance / (_SPEED * case.run.time_step * samples)))
    return every * samples, every


def _gap(series: Measured, first: int, second: int, sizes: float) -> FloatArray:
    arm = series.position[:, series.row(first)] - series.position[:, series.row(second)]
    gap: FloatArray = np.linalg.norm(arm, axis=-1) - sizes
    return gap


def _rupture(gap: FloatArray, pull: FloatArray) -> float:
    """Middle between the last gap with a pull and the first without; not a number if it never ends or never was."""
    held = pull > 0.0
    broken = ~held & (gap > 0.0)
    return float(0.5 * (gap[held].max() + gap[broken].min())) if held.any() and broken.any() else float("nan")


def bead_on_bead(bench: Bench) -> Iterator[Line]:
    """Force against gap from touching to past rupture, for three size ratios and three liquid fractions."""
    for fraction in (0.005, 0.01, 0.03):
        case = bench_case(liquid={"volume_fraction": fraction})
        scene = scene_on_floor(_pairs(_RATIOS, -_OVERLAP, _SPEED))
        volumes = [bridge_volume_between_beads(ratio * _SMALL, _SMALL, fraction) for ratio in _RATIOS]
        ruptures = [rupture_distance(volume, 0.0) for volume in volumes]
        steps, every = _steps_to(1.1 * max(ruptures), case)
        series = bench.run(
            Plan(case, scene, bench_recording(steps, every), workarounds=bench.workarounds, prescribed=True)
        )
        for number, ratio in enumerate(_RATIOS):
            upper, large = 3 + 2 * number, ratio * _SMALL
            gap = _gap(series, upper, upper - 1, large + _SMALL)
            pull = -series.force[:, series.row(upper), 2]
            partner = Partner(large)
            still = np.zeros_like(series.force[:, 0])
            normal = still + np.array([0.0, 0.0, 1.0])
            law = -bridge_law(case, _SMALL, partner, normal, gap, still, still).force[:, 2]
            opened = int(np.argmax(gap > 0.0))
            where = f"R1/R2 = {ratio:g}, {100 * fraction:g} % liquid"
            yield Line(
                f"bead on bead, force against gap, {where}",
                _SOULIE,
                float(law[opened]),
                float(pull[opened]),
                "N",
                1e-4,
                largest_error(pull[:, None], law[:, None]),
            )
            measured = _rupture(gap, pull)
            resolution = (gap[1] - gap[0]) / ruptures[number]
            yield Line(
                f"rupture distance between beads, {where}", "(1 + θ/2) V^(1/3), Lian et al. 1993", ruptures[number],
                float(measured), "m", float(resolution),
            )  # fmt: skip


def before_contact(bench: Bench) -> Iterator[Line]:
    """A bead brought within a fifth of a micrometre of another, and of the wall, without touching: no force."""
    case = bench_case()
    beads = [
        Bead(0, (0.0, 0.0, 5e-3), _SMALL),
        Bead(0, (0.0, 0.0, 5e-3 + 2 * _SMALL + 2e-6), _SMALL, velocity=(0.0, 0.0, -_SPEED)),
        Bead(0, (6e-3, 0.0, _SMALL + 2e-6), _SMALL, velocity=(0.0, 0.0, -_SPEED)),
    ]
    recording = bench_recording(90, 10)
    series = bench.run(Plan(case, scene_on_floor(beads), recording, workarounds=bench.workarounds, prescribed=True))
    for what, bead in (("bead", 3), ("wall", 4)):
        largest = float(np.abs(series.force[:, series.row(bead)]).max())
        yield Line(
            f"no force on a bead before its first contact with a {what}",
            "bridges form on contact",
            0.0,
            largest,
            "N",
            0.0,
        )


def _retract_from_wall(bench: Bench, case: Case, workarounds: Workarounds) -> tuple[FloatArray, FloatArray]:
    radius = case.walkers[0].radii[0]
    bead = Bead(0, (0.0, 0.0, radius - _OVERLAP), radius, velocity=(0.0, 0.0, _SPEED))
    volume = bridge_volume_at_wall(radius, case.liquid.volume_fraction)
    steps, every = _steps_to(1.1 * rupture_distance(volume, case.liquid.contact_angle), case)
    plan = Plan(case, scene_on_floor([bead]), bench_recording(steps, every), workarounds=workarounds, prescribed=True)
    series = bench.run(plan)
    row = series.row(FIRST_BEAD)
    return series.position[:, row, 2] - radius, -series.force[:, row, 2]


def at_wall(bench: Bench) -> Iterator[Line]:
    """Force of the single and of the doubled wall, beside sphere–plane theory."""
    case = bench_case()
    radius, tension = case.walkers[0].radii[0], case.liquid.surface_tension
    scale = pi * tension * radius
    gap, pull = _retract_from_wall(bench, case, bench.workarounds)
    still = np.zeros((len(gap), 3))
    normal = still + np.array([0.0, 0.0, 1.0])
    law = -bridge_law(case, radius, Partner(radius, wall=True), normal, gap, still, still).force[:, 2]
    volume = bridge_volume_at_wall(radius, case.liquid.volume_fraction)
    first_open = int(np.argmax(gap > 0))
    yield Line(
        "doubled wall, force against gap, over πγR", f"2 × equal spheres, {_SOULIE}", float(law[first_open] / scale),
        float(pull[first_open] / scale), "", 1e-4, largest_error(pull[:, None], law[:, None]), _WALL,
    )  # fmt: skip
    rupture = rupture_distance(volume, 0.0)
    measured = _rupture(gap, pull)
    resolution = float((gap[1] - gap[0]) / rupture)
    yield Line(
        "rupture distance at a wall", "(1 + θ/2) V^(1/3), Lian et al. 1993", rupture, float(measured), "m", resolution
    )
    raw_gap, raw_pull = _retract_from_wall(bench, case, Workarounds(wall_copies=1))
    first_open = int(np.argmax(raw_gap > 0))
    raw = capillary_force(tension, radius, radius, volume, 0.0, float(raw_gap[first_open])) / scale
    yield Line(
        "a single wall pulls half as hard, over πγR", f"equal spheres, {_SOULIE}", raw,
        float(raw_pull[first_open] / scale), "", 1e-4, defect=True,
    )  # fmt: skip
    first_open = int(np.argmax(gap > 0))
    what = "doubled wall, first open gap, against the sphere-plane limit"
    yield Line(what, "4πγR cos θ", 4.0 * cos(0.0), float(pull[first_open] / scale))
    for share in (0.0, 0.25, 0.5):
        number = max(first_open, int(np.argmin(np.abs(gap - share * rupture))))
        h = float(gap[number])
        theory = 4.0 * (1.0 - h / sqrt(h * h + volume / (pi * radius)))
        yield Line(
            f"doubled wall against finite volume, gap {share:g} of rupture",
            "4πγR cos θ (1 - h/√(h² + V/πR)), Rabinovich et al. 2005", theory, float(pull[number] / scale),
        )  # fmt: skip


def contact_angle(bench: Bench) -> Iterator[Line]:
    """Force at effective contact angles through the deck's translation, and what the raw engine makes of them."""
    for angle in (0.0, 10.0, 30.0, 60.0):
        case = bench_case(liquid={"contact_angle": f"{angle} deg"})
        needs = frozenset({"angle"}) if angle else frozenset[str]()
        gap, pull = _retract_from_wall(bench, case, bench.workarounds)
        law = _pull_law(case, case.walkers[0].radii[0], Partner(case.walkers[0].radii[0], wall=True), gap)
        yield _angle_line(f"contact angle {angle:g}°, bead on wall", gap, pull, law, needs | _WALL)
        gap, pull = _part_beads(bench, case)
        law = _pull_law(case, _SMALL, Partner(_SMALL), gap)
        yield _angle_line(f"contact angle {angle:g}°, bead on bead", gap, pull, law, needs)
    case = bench_case(liquid={"contact_angle": "30 deg"})
    gap, pull = _retract_from_wall(bench, case, Workarounds(contact_angle=False))
    # The raw engine takes ½ θi θj: solve its force at the first open gap for the angle that it used.
    number = int(np.argmax(gap > 0))
    radius, tension = case.walkers[0].radii[0], case.liquid.surface_tension
    volume = bridge_volume_at_wall(radius, case.liquid.volume_fraction)
    angles = np.radians(np.linspace(0.0, 60.0, 6001))
    candidates = [
        capillary_force_at_wall(tension, radius, volume, float(angle), float(gap[number])) for angle in angles
    ]
    used = degrees(angles[int(np.argmin(np.abs(np.array(candidates) - pull[number])))])
    acting = degrees(0.5 * radians(30.0) ** 2)
    yield Line("contactAngle of 30° acts as", "½ θi θj in radians", acting, used, "°", 0.01, defect=True)


def _pull_law(case: Case, radius: float, partner: Partner, gap: FloatArray) -> FloatArray:
    """Net pull at each gap, touching ones included, N."""
    pull: FloatArray = capillary_law(case, radius, partner, gap) - hertz_law(case, radius, partner, gap)
    return pull


def _angle_line(what: str, gap: FloatArray, pull: FloatArray, law: FloatArray, needs: frozenset[str]) -> Line:
    opened = int(np.argmax(gap > 0))
    error = largest_error(pull[:, None], law[:, None])
    source = f"{_SOULIE}, θ effective"
    return Line(
        f"{what}, touching to rupture", source, float(law[opened]), float(pull[opened]), "N", 1e-3, error, needs
    )


def _part_beads(bench: Bench, case: Case) -> tuple[FloatArray, FloatArray]:
    volume = bridge_volume_between_beads(_SMALL, _SMALL, case.liquid.volume_fraction)
    steps, every = _steps_to(1.1 * rupture_distance(volume, case.liquid.contact_angle), case)
    scene = scene_on_floor(_pairs((1.0,), -_OVERLAP, _SPEED))
    series = bench.run(Plan(case, scene, bench_recording(steps, every), workarounds=bench.workarounds, prescribed=True))
    return _gap(series, 3, 2, 2.0 * _SMALL), -series.force[:, series.row(3), 2]


CHECKS = (
    Check("capillary-beads", 1, "capillary force between beads against gap, rupture", True, bead_on_bead),
    Check("capillary-before-contact", 1, "no force before the first contact", True, before_contact),
    Check("capillary-wall", 2, "capillary force at a wall, single and doubled", True, at_wall),
    Check("contact-angle", 3, "contact angle through the deck's translation", True, contact_angle),
)
