"""Group 5: friction, rolling resistance, restitution, Hertz contacts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import pi, sqrt

import numpy as np

from walkers.audit.bench import FIRST_BEAD, Bench, Measured, bench_case, bench_recording, scene_on_floor
from walkers.audit.check import Check, Line
from walkers.audit.impacts import walls_of
from walkers.audit.laws import Partner, damping_law, hertz_law, largest_error
from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads
from walkers.physics.contact import reduced_shear_modulus, restitution_of_copies
from walkers.physics.wall import WALL_COPIES
from walkers.templates.deck import Plan
from walkers.templates.scene import Bead

_WALL = frozenset({"walls"})
_HERTZ = "4/3 E* √R* δ^(3/2)"


def _pressed_bead(case: Case) -> tuple[Bead, float]:
    """A bead at the overlap at which the elastic repulsion carries its capillary load, and that load."""
    loads = contact_loads(case)
    radius = case.walkers[0].radii[0]
    return Bead(0, (0.0, 0.0, radius - loads.overlaps[0]), radius), loads.capillary[0]


def friction(bench: Bench) -> Iterator[Line]:
    """A bead under its capillary load, drawn slowly along the wall: a spring at first, then μ F_N."""
    speed, coefficient = 1e-4, 0.3
    case = bench_case(contact={"friction": {"bead_bead": 0.0, "bead_wall": coefficient}})
    bead, load = _pressed_bead(case)
    bead = replace(bead, velocity=(speed, 0.0, 0.0))
    recording = bench_recording(1500, 10)
    series = bench.run(Plan(case, scene_on_floor([bead]), recording, workarounds=bench.workarounds, prescribed=True))
    drag = -series.force[:, series.row(FIRST_BEAD), 0]
    yield Line(
        "sliding friction under the capillary load",
        "μ F_N, F_N = capillary load",
        coefficient * load,
        float(drag[-1]),
        "N",
        1e-3,
        None,
        _WALL,
    )
    overlap = contact_loads(case).overlaps[0]
    reduced_shear = reduced_shear_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio)
    spring = 2.0 * 8.0 * reduced_shear * sqrt(bead.radius * overlap)
    moved = speed * case.run.time_step * series.steps.astype(np.float64)
    held = spring * moved < 0.9 * coefficient * load
    yield Line(
        "at rest below μ F_N: tangential spring of a doubled wall", "2 · 8 G* √(Rδ) s (Mindlin)",
        float(spring * moved[held][-1]), float(drag[held][-1]), "N", 1e-3,
        largest_error(drag[held, None], spring * moved[held, None]), _WALL,
    )  # fmt: skip


def coulomb_limit(bench: Bench) -> Iterator[Line]:
    """A damped bead that slides fast while it is pressed on, and while it leaves: damping counts in Coulomb's limit."""
    coefficient, speed = 0.3, 0.003
    case = bench_case(
        contact={"friction": {"bead_bead": 0.0, "bead_wall": coefficient}, "restitution": 0.3},
        run={"time_step": "0.2 us"},
    )
    still, _ = _pressed_bead(case)
    for what, sense in (("pressed on", -1.0), ("leaving", 1.0)):
        bead = replace(still, velocity=(0.2, 0.0, sense * speed))
        recording = bench_recording(100, 10)
        plan = Plan(case, scene_on_floor([bead]), recording, workarounds=bench.workarounds, prescribed=True)
        series = bench.run(plan)
        row, partner = series.row(FIRST_BEAD), Partner(bead.radius, wall=True)
        gap = series.position[:, row, 2] - bead.radius
        elastic = hertz_law(case, bead.radius, partner, gap)
        mass = 4.0 / 3.0 * pi * bead.radius**3 * case.density
        law = coefficient * np.abs(elastic - damping_law(case, bead.radius, partner, gap, mass) * sense * speed)
        drag = -series.force[:, row, 0]
        slides = slice(2, None)  # the spring is loaded by then
        error = float(np.abs(drag / law - 1.0)[slides].max())
        share = float((law / (coefficient * elastic))[slides].mean())
        yield Line(
            f"sliding friction of a bead that is {what}, {share:.2f} times μ F_elastic",
            "μ |F_elastic + F_damping|",
            float(law[-1]),
            float(drag[-1]),
            "N",
            1e-3,
            error,
            _WALL,
        )


def rolling(bench: Bench) -> Iterator[Line]:
    """The torque on a bead that spins under its capillary load."""
    coefficient = 0.05
    case = bench_case(contact={"rolling_friction": coefficient, "friction": {"bead_bead": 0.0, "bead_wall": 0.0}})
    bead, load = _pressed_bead(case)
    bead = replace(bead, spin=(0.0, 20.0, 0.0))
    series = bench.run(
        Plan(case, scene_on_floor([bead]), bench_recording(20, 10), workarounds=bench.workarounds, prescribed=True)
    )
    torque = series.torque[-1, series.row(FIRST_BEAD), 1]
    yield Line(
        "rolling resistance torque",
        "μ_r R F_N",
        coefficient * bead.radius * load,
        float(-torque),
        "N m",
        1e-3,
        None,
        _WALL,
    )


def _pressed_pair(case: Case) -> tuple[list[Bead], float]:
    """Two beads at the overlap that carries the capillary load between them, one above the other, and that load."""
    loads = contact_loads(case)
    large, small = case.walkers[0].radii
    lower = Bead(0, (0.0, 0.0, 5e-3), large)
    return [lower, Bead(0, (0.0, 0.0, 5e-3 + large + small - loads.overlaps[2]), small)], loads.capillary[2]


def between_beads(bench: Bench) -> Iterator[Line]:
    """Sliding friction and rolling resistance of two beads under their capillary load."""
    sliding, rolling_coefficient = 0.3, 0.05
    case = bench_case(contact={"friction": {"bead_bead": sliding, "bead_wall": 0.0}})
    (lower, upper), load = _pressed_pair(case)
    moving = replace(upper, velocity=(1e-4, 0.0, 0.0))
    plan = Plan(
        case,
        scene_on_floor([lower, moving]),
        bench_recording(1500, 100),
        workarounds=bench.workarounds,
        prescribed=True,
    )
    series = bench.run(plan)
    drag = -series.force[-1, series.row(FIRST_BEAD + 1), 0]
    yield Line("sliding friction between beads", "μ F_N, F_N = capillary load", sliding * load, float(drag), "N", 1e-3)
    case = bench_case(
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "rolling_friction": rolling_coefficient}
    )
    spinning = replace(upper, spin=(0.0, 20.0, 0.0))
    plan = Plan(
        case, scene_on_floor([lower, spinning]), bench_recording(20, 10), workarounds=bench.workarounds, prescribed=True
    )
    series = bench.run(plan)
    torque = -series.torque[-1, series.row(FIRST_BEAD + 1), 1]
    reduced = lower.radius * upper.radius / (lower.radius + upper.radius)
    expected = rolling_coefficient * reduced * load
    yield Line("rolling resistance torque between beads", "μ_r R* F_N", expected, float(torque), "N m", 1e-3)


def reported_forces(bench: Bench) -> Iterator[Line]:
    """What ``compute wall/gran/local`` says of a sliding, damped contact, against the bead's own total force."""
    case = bench_case(contact={"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "restitution": 0.3})
    bead, _ = _pressed_bead(case)
    sliding = replace(bead, velocity=(0.05, 0.0, 0.0))
    plan = Plan(
        case, scene_on_floor([sliding]), bench_recording(200, 200), workarounds=bench.workarounds, prescribed=True
    )
    series = bench.run(plan)
    steps, drag = series.wall_bridges("fx")
    reported = drag[steps == series.steps[-1]].sum()
    off = float(abs(reported / series.force[-1, series.row(FIRST_BEAD), 0] - 1.0) > 0.1)
    what = "the reported friction of a sliding contact is not what acts"
    yield Line(what, "off by more than 10 %: 1", 1.0, off, defect=True)


def hertz(bench: Bench) -> Iterator[Line]:
    """Dry beads pressed onto the wall and onto each other."""
    case = bench_case(liquid={"volume_fraction": 1e-9})
    radius, small = case.walkers[0].radii
    sink = -0.001
    beads = [
        Bead(0, (0.0, 0.0, radius), radius, velocity=(0.0, 0.0, sink)),
        Bead(0, (6e-3, 0.0, 5e-3), radius),
        Bead(0, (6e-3, 0.0, 5e-3 + radius + small), small, velocity=(0.0, 0.0, sink)),
    ]
    series = bench.run(
        Plan(case, scene_on_floor(beads), bench_recording(500, 25), workarounds=bench.workarounds, prescribed=True)
    )
    row = series.row(FIRST_BEAD)
    at_wall = series.position[:, row, 2] - radius
    between = series.position[:, row + 2, 2] - series.position[:, row + 1, 2] - radius - small
    for what, gap, measured, size, partner, needs in (
        ("doubled wall", at_wall, series.force[:, row, 2], radius, Partner(radius, wall=True), _WALL),
        ("beads", between, series.force[:, row + 2, 2], small, Partner(radius), frozenset[str]()),
    ):
        law = hertz_law(case, size, partner, gap)
        error = largest_error(measured[:, None], law[:, None])
        yield Line(
            f"Hertz force against overlap, {what}", _HERTZ, float(law[-1]), float(measured[-1]), "N", 1e-4, error, needs
        )


def _rebound(series: Measured, bead: int, speed: float) -> float:
    return float(series.velocity[-1, series.row(bead), 2] / speed)


def restitution(bench: Bench) -> Iterator[Line]:
    """Dry impacts: on a single wall, on the doubled wall, between beads."""
    speed = 0.05
    for coefficient in (0.3, 0.6, 0.9):
        case = bench_case(
            liquid={"volume_fraction": 1e-9}, contact={"restitution": coefficient}, run={"time_step": "0.2 us"}
        )
        radius = case.walkers[0].radii[0]
        beads = [
            Bead(0, (0.0, 0.0, radius + 1e-7), radius, velocity=(0.0, 0.0, -speed)),
            Bead(0, (6e-3, 0.0, 5e-3), radius, velocity=(0.0, 0.0, speed)),
            Bead(0, (6e-3, 0.0, 5e-3 + 2.0 * radius + 1e-7), radius, velocity=(0.0, 0.0, -speed)),
        ]
        recording = bench_recording(2000, 2000)
        found = {
            name: bench.run(Plan(case, scene_on_floor(beads), recording, workarounds=workarounds))
            for name, workarounds in walls_of(bench).items()
        }
        yield Line(
            f"restitution {coefficient:g} on a single wall",
            "given coefficient",
            coefficient,
            _rebound(found["single wall"], FIRST_BEAD, speed),
            "",
            0.02,
        )
        twice, rebound = (
            restitution_of_copies(coefficient, WALL_COPIES),
            _rebound(found["doubled wall"], FIRST_BEAD, speed),
        )
        what = f"restitution {coefficient:g} on the doubled wall"
        yield Line(what, "e of √2 times the damping ratio", twice, rebound, "", 0.02, None, _WALL)
        yield Line(
            f"restitution {coefficient:g} between beads",
            "given coefficient",
            coefficient,
            _rebound(found["doubled wall"], FIRST_BEAD + 2, speed),
            "",
            0.02,
        )


CHECKS = (
    Check("friction", 5, "sliding friction and rest under the capillary load", True, friction),
    Check("rolling-friction", 5, "rolling resistance torque", True, rolling),
    Check("coulomb-limit", 5, "friction of a bead that is pressed on or leaves", True, coulomb_limit),
    Check("friction-beads", 5, "sliding friction and rolling resistance between beads", True, between_beads),
    Check("reported-forces", 5, "reported forces of a sliding contact", True, reported_forces),
    Check("hertz", 5, "Hertz force against overlap", True, hertz),
    Check("restitution", 5, "restitution of dry impacts", True, restitution),
)
