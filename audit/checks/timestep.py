"""Group 8: convergence in the time step, of the walker and of a small glycerol pile."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from walkers.audit.bench import Bench, bench_case, bench_recording, free_run
from walkers.audit.check import Check, Line
from walkers.audit.checks.drive import reference_walker, walking_speed
from walkers.inputs.boundary import Face
from walkers.inputs.case import Case
from walkers.templates.deck import Plan
from walkers.templates.scene import Bead, Scene

_SIDE = 5.3e-3
_LARGE, _SMALL = 5.45e-4, 3.075e-4
_CYCLES, _SETTLING = 10, 4
_FINEST, _TOO_LARGE = 0.5e-6, 4e-6


def walker_convergence(bench: Bench) -> Iterator[Line]:
    """The AK5 walker at 0.5, 1, 2 and 4 µs, and at the step that ``auto`` takes, which is at most 4 µs."""
    speeds = {step: walking_speed(bench, reference_walker(run={"cycles": 18, "settling_cycles": 8, "time_step": step}))
              for step in ("0.5 us", "1 us", "2 us", "4 us", "auto")}  # fmt: skip
    for step, speed in speeds.items():
        yield Line(f"walker's speed at a step of {step}", "converged at 0.5 us", speeds["0.5 us"], speed, "m/s", 0.005)


def pile_case(time_step: float | None = None) -> Case:
    """The paper's glass beads in glycerol, shaken vertically, container frame; at auto's step if none is given."""
    case = bench_case(
        beads={"density": "2.5 g/cm^3"},
        dimers={"radii": [f"{_LARGE} m", f"{_SMALL} m"]},
        liquid={"name": "glycerol 87 %", "surface_tension": "61 mN/m", "dynamic_viscosity": "120.54 mPa*s"},
        contact={"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "restitution": 0.3, "rolling_friction": 0.0},
        drive={"axis": "z", "frequency": "170 Hz", "peak_acceleration": "16.2 g", "frame": "container"},
        run={"time_step": "auto", "samples_per_cycle": 1},
        environment={"gravity": "9.81 m/s^2"},
    )
    return case if time_step is None else replace(case, run=free_run(case.run, time_step))


def pile_scene() -> Scene:
    """200 beads in layers, small ones below, in an open box of five faces; jittered by a fixed seed."""
    half = _SIDE / 2.0
    faces = (
        Face("z", 1, (1e-4, 0.0, 0.0)),
        Face("x", 1, (-half, 0.0, 0.01)), Face("x", -1, (half, 0.0, 0.01)),
        Face("y", 1, (1e-4, -half, 0.01)), Face("y", -1, (1e-4, half, 0.01)),
    )  # fmt: skip
    carriers = tuple((x, 0.0, -1.5e-3) for x in (-2e-3, -1e-3, 0.0, 1e-3, 2e-3))
    jitter = np.random.default_rng(7)
    beads: list[Bead] = []
    height = 0.0
    for radius, count in ((_SMALL, 170), (_LARGE, 30)):
        across = int(_SIDE / (2.02 * radius))
        pitch = _SIDE / across
        for number in range(count):
            layer, place = divmod(number, across * across)
            row, column = divmod(place, across)
            z = height + (1.02 + 2.04 * layer) * radius
            shift = jitter.uniform(-1.0, 1.0, 2) * 0.4 * (pitch - 2.0 * radius)
            x, y = ((index + 0.5) * pitch - half for index in (row, column))
            beads.append(Bead(len(carriers) + len(beads) + 1, (x + shift[0], y + shift[1], z), radius))
        height += (2.04 * (1 + (count - 1) // (across * across)) + 0.02) * radius
    edge = half + 3e-4
    return Scene(tuple(beads), faces, carriers, (-edge, -edge, -2.5e-3), (edge, edge, 0.02))


def agitation(bench: Bench, time_step: float) -> float:
    """Mean square velocity of the pile's beads over the last cycles, m²/s²; infinite if beads were lost."""
    from walkers.inputs.errors import WalkersError

    case, scene = pile_case(time_step), pile_scene()
    period = 1.0 / case.drive.frequency
    every = max(1, round(period / 20.0 / time_step))
    steps = every * 20 * _CYCLES
    try:
        series = bench.run(Plan(case, scene, bench_recording(steps, every), workarounds=bench.workarounds))
    except WalkersError:
        return float("inf")
    first = series.row(scene.beads[0].id)
    return float(np.mean(np.sum(series.velocity[20 * _SETTLING :, first:] ** 2, axis=-1)))


def pile_convergence(bench: Bench) -> Iterator[Line]:
    """The pile's agitation at 0.5 and 1 µs, at the step that ``auto`` takes for it, and at 4 µs."""
    auto = bench.pile_time_step or pile_case().run.time_step
    finest = agitation(bench, _FINEST)
    for name, step, needs in (
        ("1 µs", 1e-6, frozenset[str]()),
        (f"auto's step, {auto * 1e6:.3g} µs", auto, frozenset({"time step"})),
    ):
        found = agitation(bench, step)
        what = f"glycerol pile, mean square velocity at {name}"
        yield Line(what, "converged at 0.5 µs", finest, found, "m²/s²", 0.05, None, needs)
    heated = agitation(bench, _TOO_LARGE) / finest
    yield Line("glycerol pile at 4 µs over that at 0.5 µs", "converged: 1", 1.0, heated)
    yield Line(
        "a pile beyond the viscous limit heats up in silence",
        "by more than 10 %: 1",
        1.0,
        float(heated > 1.1),
        defect=True,
    )


CHECKS = (
    Check("step-walker", 8, "walker's speed against the time step", False, walker_convergence),
    Check("step-pile", 8, "a glycerol pile's agitation against the time step", False, pile_convergence),
)
