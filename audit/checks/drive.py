"""Group 6: the motion of the walls, what a bead on them feels, and the two frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from audit.bench import Bench, bench_case
from audit.check import Check, Line
from inputs import resolve_case
from inputs.case import WalkerCase
from postprocess.gait import walk
from postprocess.local_dump import read_local_dump
from postprocess.trajectory import read_trajectory
from runner.directory import CASE_NAME
from runner.files import write_json
from templates.deck import render_deck

_SINE = "A sin ωt, A = a0/ω²"


def reference_walker(**changes: dict[str, object]) -> WalkerCase:
    """The walker of Fig. 2 at 4 g, friction 0.1, alone and on the axis: its speed is known from other engines."""
    tables: dict[str, dict[str, object]] = {
        "beads": {"radii": ["0.3 mm", "0.2 mm"], "material": "ruby"},
        "liquid": {"name": "Si AK5"},
        "substrate": {"material": "chromium-coated glass"},
        "contact": {"friction": {"bead_bead": 0.1, "bead_wall": 0.1}, "rolling_friction": 0.0},
        "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        "start": {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0},
        "run": {"cycles": 30, "settling_cycles": 10},
    }
    for table, values in changes.items():
        tables[table] = {**tables.get(table, {}), **values}
    return resolve_case(tables, source="<audit>", name="audit")


def walking_speed(bench: Bench, case: WalkerCase) -> float:
    """Velocity of the first walker of a case, m/s."""
    return float(walk(read_trajectory(_walker_directory(bench, case))).velocity[0])


def _walker_directory(bench: Bench, case: WalkerCase) -> Path:
    series = bench.run_deck(render_deck(case, bench.remedies))
    write_json(series.directory / CASE_NAME, case.as_dict())
    return series.directory


def wall_motion(bench: Bench) -> Iterator[Line]:
    """Rider and wall in the laboratory frame, shaken vertically; a bead held to the wall by its bridge."""
    case = bench_case(
        drive={"axis": "z", "frame": "lab", "peak_acceleration": "1 g"},
        contact={"restitution": 0.3, "friction": {"bead_bead": 0.1, "bead_wall": 0.1}},
        start={"replicates": 1},
        run={
            "cycles": 6,
            "settling_cycles": 2,
            "samples_per_cycle": 40,
            "bridge_samples_per_cycle": 40,
            "time_step": "auto",
        },
        environment={"gravity": "9.81 m/s^2"},
    )
    deck = render_deck(case, bench.remedies)
    series = bench.run_deck(deck)
    drive, time = case.drive, series.steps * case.run.time_step
    sine, cosine = np.sin(drive.angular_frequency * time), np.cos(drive.angular_frequency * time)
    if bench.remedies.riders:
        displacement = series.position[:, 0, 2] - series.position[0, 0, 2]
        error = float(np.abs(displacement - drive.amplitude * sine).max() / drive.amplitude)
        yield Line("position of the rider", _SINE, drive.amplitude, float(displacement.max()), "m", 1e-3, error)
        error = float(np.abs(series.velocity[:, 0, 2] - drive.peak_velocity * cosine).max() / drive.peak_velocity)
        yield Line(
            "velocity of the rider",
            "Aω cos ωt",
            drive.peak_velocity,
            float(series.velocity[:, 0, 2].max()),
            "m/s",
            1e-3,
            error,
        )
    columns = deck.layout.wall_bridge_columns
    steps, rows = read_local_dump(series.directory / deck.layout.wall_bridge_dump, columns)
    wall = rows[:, columns.index("z")]
    expected = drive.amplitude * np.sin(drive.angular_frequency * steps * case.run.time_step)
    error = float(np.abs(wall - expected).max() / drive.amplitude)
    # The reported point is a step old: 2π/6000 of the amplitude.
    yield Line(
        "position of the wall, where beads touch it", _SINE, drive.amplitude, float(wall.max()), "m", 2e-3, error
    )
    row = 1 if bench.remedies.riders else 0
    mass = case.beads.density * 4.0 / 3.0 * np.pi * case.beads.radii[0] ** 3
    last = slice(4 * case.run.samples_per_cycle, 6 * case.run.samples_per_cycle)
    felt = float(np.abs(series.force[last, row, 2] / mass).max())
    yield Line("peak acceleration of a bead held to the wall", "a0", drive.peak_acceleration, felt, "m/s²", 5e-3)


def frames(bench: Bench) -> Iterator[Line]:
    """The walker in the laboratory and in the container frame, with a fine step."""
    case = reference_walker(run={"cycles": 30, "settling_cycles": 10, "time_step": "0.5 us"})
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


def known_speed(bench: Bench) -> Iterator[Line]:
    """The walker that YADE, MercuryDPM and a hand-written loop agree on within 0.4 %."""
    found = walking_speed(bench, reference_walker())
    needs = frozenset({"walls"})
    yield Line(
        "walker's speed at 4 g, friction 0.1",
        "same forces in three other engines",
        3.806e-3,
        found,
        "m/s",
        0.01,
        None,
        needs,
    )


CHECKS = (
    Check("wall-motion", 6, "motion of rider and wall, acceleration of a bead on it", True, wall_motion),
    Check("known-speed", 6, "speed of the reference walker", True, known_speed),
    Check("frames", 6, "laboratory against container frame", False, frames),
)
