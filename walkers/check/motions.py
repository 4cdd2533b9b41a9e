"""Beads that move as they will: thrown, in the air, a walker with smaller steps and in company."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from walkers.check.bench import FLOOR, Bench, bench_case, bench_recording, bench_scene, farthest
from walkers.check.lines import Line
from walkers.check.scenes import R, S, full_case, over, pair, second_engine
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.templates.deck import Plan, plan_of
from walkers.templates.layout import BEAD_COLUMNS, FORCE_COLUMNS
from walkers.templates.scene import Bead

GRAVITY, RADIUS = 9.81, 3e-4


def thrown_lines(bench: Bench) -> Iterator[Line]:
    """Beads that are thrown onto the floor and each other, in both engines from the same start."""
    case = full_case(environment={"gravity": f"{GRAVITY} m/s^2"}, drive={"peak_acceleration": "4 g"})
    beads = [
        over(FLOOR, 2e-5, R, (0.04, -0.03, -0.2), x=1e-3),
        over(FLOOR, -1e-7, S, (0.05, 0.0, 0.0), (0.0, 0.0, 0.0), x=-1e-3),
        over(FLOOR, -1e-7, R, (0.03, 0.0, 0.0), (0.0, 0.03 / R, 0.0), x=3e-3),
        *pair(1e-5, -0.1, (0.01, -0.02, 0.0)),
    ]
    scene = bench_scene(beads)
    series = bench.run(Plan(case, scene, bench_recording(6000, 60)))
    frames = second_engine(case, scene).run(6000, 60)
    for what, first, second in (("ways", series.position, frames[..., :3]), ("spins", series.spin, frames[..., 6:])):
        start = first[0]
        yield Line(
            f"thrown beads: {what} beside the second engine's", 0.0, farthest(first[1:] - start, second - start), 1e-6
        )


def flight_lines(bench: Bench) -> Iterator[Line]:
    """A bead in the air, in the frame of walls that are shaken."""
    case = bench_case(
        drive={"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": "x"},
        environment={"gravity": f"{GRAVITY} m/s^2"},
    )
    bead = Bead(0, (0.0, 0.0, 5e-3), RADIUS, (0.1, 0.2, 0.0), (1.0, 2.0, 3.0))
    series = bench.run(Plan(case, bench_scene([bead]), bench_recording(10_000, 100)))
    wave, t = case.drive.harmonics[0], series.time
    shaken = wave.peak_acceleration / wave.angular_frequency * (1.0 - np.cos(wave.angular_frequency * t))
    expected = np.stack([0.1 + shaken, 0.2 + 0.0 * t, -GRAVITY * t], axis=-1)
    yield Line("free flight: velocity, at most off by", 0.0, farthest(series.velocity[:, 0], expected), 1e-5)
    expected = np.broadcast_to((1.0, 2.0, 3.0), (len(t), 3))
    yield Line("free flight: spin, at most off by", 0.0, farthest(series.spin[:, 0], expected), 1e-12)


def _walker(cycles: int) -> Case:
    """The walker of Fig. 1b, alone, for so many cycles."""
    case = load_case("fig1b")
    run = replace(case.run, cycles=cycles, cycles_per_segment=cycles, until_steady=False)
    return replace(case, walkers=(replace(case.walkers[0], replicates=1),), run=run)


def _recorded(*cases: Case) -> Plan:
    """The plan of cases that share a deck, with forces."""
    plan = plan_of(*cases)
    return replace(plan, recording=replace(plan.recording, bead_columns=(*BEAD_COLUMNS, *FORCE_COLUMNS)))


def step_lines(bench: Bench) -> Iterator[Line]:
    """A walker's way in four cycles, with the step that ``auto`` takes, its half and its quarter."""
    case = _walker(4)
    ways = []
    for finer in (1, 2, 4):
        plan = plan_of(replace(case, run=replace(case.run, time_step=case.run.time_step / finer, steps_per_cycle=0)))
        steps = round(4.0 / case.drive.frequency / case.run.time_step) * finer
        series = bench.run(replace(plan, recording=bench_recording(steps, steps)))
        ways.append(series.position[-1] - series.position[0])
    coarse, fine = farthest(ways[0], ways[2]), farthest(ways[1], ways[2])
    yield Line("a walker's way with half a step, off that with a quarter by", 0.0, fine, 2e-3)
    yield Line("the same with a whole step", 0.0, coarse, 5e-3)


def company_lines(bench: Bench) -> Iterator[Line]:
    """A walker among others of its deck, driven otherwise or not, beside the same one alone; and a rerun."""
    alone = _walker(10)
    alone = replace(alone, contact=replace(alone.contact, rolling_friction=0.0))  # which amplifies rounding
    other = replace(alone, drive=alone.drive.with_peak(2.0 * alone.drive.peak_acceleration))
    sloping = replace(alone, boundary=replace(alone.boundary, tilt=0.3))
    first, again = (bench.run(_recorded(alone)) for _ in range(2))
    together = bench.run(_recorded(other, alone, sloping))
    ways = (first.position[:, :2] - first.position[0, :2], together.position[:, 2:4] - together.position[0, 2:4])
    yield Line("a walker's way among others beside that alone, off by", 0.0, farthest(ways[1], ways[0]), 1e-9)
    dumps = [(series.directory / "beads.bin").read_bytes() for series in (first, again)]
    yield Line("a rerun is the same to the last bit: 0", 0.0, float(dumps[0] != dumps[1]), 0.0)
