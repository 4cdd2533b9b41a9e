"""Group 6: the motion of the walls, what a bead on them feels, and the two frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from walkers.audit.bench import FIRST_BEAD, Bench, bench_case, bench_plan, changed_case
from walkers.audit.check import Check, Line
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.physics.film import film_drag
from walkers.postprocess.gait import walk
from walkers.postprocess.motion import motion_of, prescribed_motion
from walkers.templates.deck import plan_of

_SINE = "A sin ωt, A = a0/ω²"


def reference_walker(**changes: dict[str, Any]) -> Case:
    """The walker of Fig. 2 at 4 g, friction 0.1, alone, on the axis (docs/explanation/validation.md)."""
    tables: dict[str, dict[str, Any]] = {
        "beads": {"material": "ruby"},
        "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0},
        "liquid": {
            "name": "Si AK5",
            "volume_fraction": 0.01,
            "viscosity_ratio": 1.0,
            "film_drag_ratio": 0.0,
            "contact_angle": "0 deg",
        },
        "boundary": {"material": "chromium-coated glass"},
        "contact": {
            "friction": {"bead_bead": 0.1, "bead_wall": 0.1},
            "rolling_friction": 0.0,
            "minimum_separation_ratio": 0.01,
        },
        "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        "run": {"cycles": 30, "settling_cycles": 10},
    }
    return changed_case(tables, changes)


def walking_speed(bench: Bench, case: Case) -> float:
    """Velocity of the first walker of a case, m/s."""
    series = bench.run(plan_of(case, workarounds=bench.workarounds))
    whole = {"begin": 0, "end": case.run.steps, "drive_from": 0}
    return float(walk(motion_of(case, [series.directory], [whole]).groups[0]).velocity[0])


def wall_motion(bench: Bench) -> Iterator[Line]:
    """Carrier and wall in the laboratory frame, shaken vertically; a bead held to the wall by its bridge."""
    case = bench_case(
        drive={"axis": "z", "frame": "lab", "peak_acceleration": "1 g"},
        contact={"restitution": 0.3, "friction": {"bead_bead": 0.1, "bead_wall": 0.1}},
        dimers={"replicates": 1},
        run={
            "cycles": 6,
            "settling_cycles": 2,
            "samples_per_cycle": 40,
            "bridge_samples_per_cycle": 40,
            "time_step": "auto",
        },
        environment={"gravity": "9.81 m/s^2"},
    )
    series = bench.run(bench_plan(case, bench.workarounds))
    drive, time = case.drive, series.steps * case.run.time_step
    expected, speed = (motion[:, 2] for motion in prescribed_motion(drive, time))
    if bench.workarounds.carriers:
        displacement = series.position[:, 0, 2] - series.position[0, 0, 2]
        error = float(np.abs(displacement - expected).max() / drive.amplitude)
        yield Line("position of the carrier", _SINE, drive.amplitude, float(displacement.max()), "m", 1e-3, error)
        error = float(np.abs(series.velocity[:, 0, 2] - speed).max() / drive.peak_velocity)
        yield Line(
            "velocity of the carrier",
            "Aω cos ωt",
            drive.peak_velocity,
            float(series.velocity[:, 0, 2].max()),
            "m/s",
            1e-3,
            error,
        )
    steps, wall = series.wall_bridges("z")
    expected = prescribed_motion(drive, steps * case.run.time_step)[0][:, 2]
    error = float(np.abs(wall - expected).max() / drive.amplitude)
    # The reported point is a step old: 2π/6000 of the amplitude.
    yield Line(
        "position of the wall, where beads touch it", _SINE, drive.amplitude, float(wall.max()), "m", 2e-3, error
    )
    last = slice(4 * case.run.samples_per_cycle, 6 * case.run.samples_per_cycle)
    felt = float(np.abs(series.force[last, series.row(FIRST_BEAD), 2]).max() / dimer_of(case).masses[0])
    yield Line("peak acceleration of a bead held to the wall", "a0", drive.peak_acceleration, felt, "m/s²", 5e-3)


def frames(bench: Bench) -> Iterator[Line]:
    """The walker in the laboratory and in the container frame, with a fine step."""
    case = reference_walker(drive={"frame": "lab"}, run={"cycles": 18, "settling_cycles": 8, "time_step": "0.5 us"})
    laboratory = walking_speed(bench, case)
    container = walking_speed(bench, replace(case, drive=replace(case.drive, frame="container")))
    yield Line(
        "walker's speed, container against laboratory frame",
        "frames are equivalent",
        laboratory,
        container,
        "m/s",
        1e-3,
    )


def film(bench: Bench) -> Iterator[Line]:
    """A dimer that nothing but a film drags along, in both frames."""
    for frame in ("lab", "container"):
        case = reference_walker(
            liquid={"film_drag_ratio": 50.0, "viscosity_ratio": 1e-3},
            contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.0}},
            drive={"peak_acceleration": "1 g", "frame": frame},
            run={"cycles": 20, "settling_cycles": 10},
        )
        series = bench.run(plan_of(case, workarounds=bench.workarounds))
        drive, dimer = case.drive, dimer_of(case)
        last = slice(case.run.settling_cycles * case.run.samples_per_cycle, -1)
        own = series.velocity[last, series.row(FIRST_BEAD), 0]
        if frame == "lab":
            own = own - prescribed_motion(drive, series.steps[last] * case.run.time_step)[1][:, 0]
        rate = sum(film_drag(case.liquid.film_viscosity, radius) for radius in case.walkers[0].radii) / dimer.total_mass
        expected = drive.peak_acceleration / float(np.hypot(drive.angular_frequency, rate))
        found = float(np.sqrt(2.0 * np.mean(own**2)))
        yield Line(
            f"speed against the film, {frame} frame", "a0/√(ω² + β²), β = Σ 6πηR/M", expected, found, "m/s", 1e-3
        )


CHECKS = (
    Check("wall-motion", 6, "motion of carrier and wall, acceleration of a bead on it", True, wall_motion),
    Check("film", 6, "a frictionless dimer dragged along by a film", False, film),
    Check("frames", 6, "laboratory against container frame", False, frames),
)
