"""Experiments of others in the engine: a thrown bead, two tones, impacts on a wet plate, a wet incline.

Lines are judged if the reference is exact or has the assumptions of the model; the other lines show missing physics.
The documentation has the sources and their measurements (``explanation/others``).
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from math import inf, log, pi, radians
from pathlib import Path
from typing import Any

import numpy as np

from walkers.api import run
from walkers.arrays import FloatArray
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.loads import bridge_at_rest, contact_loads, resistances_at_rest
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import Harmonic
from walkers.inputs.tables.shapes.walls import BOTTOM, Flat, Wall
from walkers.physics.bridge import Curve, Surfaces
from walkers.physics.capillary import bead_volume
from walkers.physics.contact import Impact, reduced_modulus
from walkers.physics.laws import young_laplace
from walkers.runner.binary import find_engine
from walkers.second_engine.lines import Line
from walkers.second_engine.scenes import (
    AT_REST,
    DRY,
    LARGE_RADIUS,
    Bench,
    bead_at_plane,
    bench_case,
    recorded_plan,
)
from walkers.templates.placement import Bead, PlacedBodies, loading_of, surface_of

FRICTION, G = 0.2, 9.81
SLIDING_DECELERATION = (
    3.5 * FRICTION * G
)  # m/s²; friction slows the surface of a solid sphere 7/2 times as much as its centre
BASE, CYCLES, FIRST = (
    80.0,
    12,
    4,
)  # Hz; number of cycles, and number of first cycles that are not measured
PHASES = np.arange(0.0, 180.0, 30.0)  # of the second tone, degrees
STRENGTHS = np.array(
    [2.0, 4.0, 8.0, 16.0]
)  # peak acceleration of both tones over the deceleration `SLIDING_DECELERATION`
GLASS, FILM, ROUGHNESS, DRY_RESTITUTION = (
    2.75e-3,
    0.45e-3,
    1e-7,
    0.97,
)  # radius of a bead, film, roughness, m; of a dry bead
VISCOSITIES = np.array([0.25, 0.5, 1.0, 2.0, 4.0]) * 4.6e-3  # viscosities, Pa s
SPEEDS = np.array([0.25, 0.5, 1.0, 2.0])  # of impacts, m/s
_DRY = {
    **DRY,
    "environment.gravity": f"{G} m/s^2",
    "contact.restitution": 0.5,
    "contact.friction.bead_wall": FRICTION,
}


@contextmanager
def workbench() -> Iterator[Bench]:
    """A bench with the installed engine in a folder that goes away."""
    with tempfile.TemporaryDirectory(prefix="walkers-experiments-") as folder:
        yield Bench(find_engine(), Path(folder))


def experiments(out: Path) -> Iterator[Line]:
    """All lines; ``out`` is the folder of the runs of walkers."""
    yield from symmetry(out)
    with workbench() as bench:
        for lines in (thrown_bead, two_tones, impacts, incline):
            yield from lines(bench)


def symmetry(out: Path) -> Iterator[Line]:
    """A symmetric wet dimer drifts at 80 and 120 Hz, not at 40 and 120 Hz; the opposite waveform reverses its drift."""
    given = load_case("symmetric", {"dimers.replicates": 1, "run.cycles": 30}).document
    speeds = []
    for first, start in ((40, 0), (80, 0), (80, 180)):
        sines = [
            {"frequency": f"{tone} Hz", "peak_acceleration": f"{peak} g", "phase": f"{phase} deg"}
            for tone, peak, phase in ((first, 4, start), (120, 3, start + 90))
        ]
        case = build_case({**given, "drive": {"harmonics": sines}}, name="symmetric")
        speeds.append(1e3 * run(case, out).result["velocity"])
    odd, even, opposite = speeds
    yield Line("symmetric dimer, tones 2:3: velocity (not zero)", 0.0, even, unit="mm/s")
    yield Line("symmetric dimer: velocity at 1:3 over velocity at 2:3", 0.0, odd / even, 1e-3)
    title = "symmetric dimer, 2:3: velocity by the opposite waveform over velocity by the waveform"
    yield Line(title, -1, opposite / even, 0.01)


def run_beads(
    bench: Bench,
    cases: Sequence[Case],
    beads: Sequence[Bead],
    steps: int,
    every: int,
    walls: Sequence[Wall] = (BOTTOM,),
) -> FloatArray:
    """Frames of beads, each with its own case, 8 mm apart along y; shape (steps // every + 1, beads, 9)."""
    kinds = list(dict.fromkeys(map(surface_of, cases)))
    placed = []
    for n, (case, bead) in enumerate(zip(cases, beads, strict=True)):
        centre, surface = (0.0, 8e-3 * n, bead.centre[2]), 1 + kinds.index(surface_of(case))
        placed.append(replace(bead, id=n + 1, centre=centre, surface=surface, loading=n))
    room = (-0.05, -0.01, -0.01), (0.05, 8e-3 * len(placed), 0.1)
    scene = PlacedBodies(
        tuple(placed), tuple(walls), *room, tuple(kinds), tuple(map(loading_of, cases))
    )
    return bench.run(recorded_plan(cases[0], scene, steps, every)).frames


def thrown_bead(bench: Bench, speed: float = 0.05) -> Iterator[Line]:
    """A dry bead that is thrown sliding rolls at 5/7 of its speed after 2v/7μg."""
    case, ends = bench_case(_DRY), speed / SLIDING_DECELERATION
    bead = over(BOTTOM, -contact_loads(case)[0].overlap, LARGE_RADIUS, (speed, 0.0, 0.0), AT_REST)
    frames = run_beads(bench, [case], [bead], 10 * round(0.15 * ends / case.run.time_step), 10)[
        :, 0
    ]
    slip, time = (
        frames[:, 3] - LARGE_RADIUS * frames[:, 7],
        10.0 * case.run.time_step * np.arange(len(frames)),
    )
    slope, start = np.polyfit(time[slip > 0.05 * speed], slip[slip > 0.05 * speed], 1)
    yield Line(
        "thrown bead: speed of rolling over speed of the throw",
        5.0 / 7.0,
        frames[-1, 3] / speed,
        1e-3,
    )
    yield Line(
        "thrown bead: time until it rolls",
        2.0 * speed / (7.0 * FRICTION * G),
        -start / slope,
        1e-3,
        "s",
    )


def frictionless_velocity(phase: float, angle: FloatArray | float) -> FloatArray:
    """Velocity by two tones, at a phase of the cycle (rad), without friction; over the speed of the first tone.

    Tones have the frequencies 1:2 and equal accelerations; ``phase`` is the phase of the second tone, degrees.
    """
    return np.asarray(-np.cos(angle) - 0.5 * np.cos(2.0 * np.asarray(angle) + radians(phase)))


def weak_friction_drift(phase: float) -> float:
    """Drift in the limit of weak friction, in which a slider slides forward as long as backward."""
    return -float(
        np.median(frictionless_velocity(phase, np.linspace(0.0, 2.0 * pi, 20_000, endpoint=False)))
    )


def coulomb_drift(phase: float, steps: int = 2500) -> FloatArray:
    """Drift of a mass with Coulomb friction, which can stop it at the end of a step; shape and unit as in `measured_drift`."""
    step, displacement = 2.0 * pi / steps, np.zeros_like(STRENGTHS)
    slip = frictionless_velocity(phase, 0.0) + weak_friction_drift(phase) + displacement
    for number in range(CYCLES * steps):
        slip = (
            slip
            + frictionless_velocity(phase, (number + 1) * step)
            - frictionless_velocity(phase, number * step)
        )
        slip = np.sign(slip) * np.maximum(np.abs(slip) - step / STRENGTHS, 0.0)
        displacement += slip * (number >= FIRST * steps)
    return displacement / ((CYCLES - FIRST) * steps)


def measured_drift(bench: Bench, phase: float) -> FloatArray:
    """Mean sliding velocity of a dry bead on the plate by `STRENGTHS`, over the speed of the first tone.

    Its surface moves as a slider with 7/2 times the friction. It starts at the velocity of the limit of weak friction.
    """
    plain, start, drift = (
        bench_case(_DRY),
        float(frictionless_velocity(phase, 0.0)),
        weak_friction_drift(phase),
    )
    speeds = SLIDING_DECELERATION * STRENGTHS / (2.0 * pi * BASE)
    gap, steps, cases = (
        -contact_loads(plain)[0].overlap,
        round(1.0 / BASE / plain.run.time_step),
        [],
    )
    for peak in SLIDING_DECELERATION * STRENGTHS:
        tones = (BASE, 0.0), (2.0 * BASE, radians(phase))
        sines = (
            Harmonic(axis="x", frequency=tone, peak_acceleration=peak, phase=angle)
            for tone, angle in tones
        )
        cases.append(plain.with_value_at("drive.harmonics", tuple(sines)))
    moves, turns = (
        start + 2.0 / 7.0 * drift,
        -5.0 / 7.0 * drift / LARGE_RADIUS,
    )  # so that the centre stays here
    beads = [
        bead_at_plane(
            BOTTOM,
            gap,
            LARGE_RADIUS,
            velocity=(moves * speed, 0.0, 0.0),
            spin=(0.0, turns * speed, 0.0),
        )
        for speed in speeds.tolist()
    ]
    frames = run_beads(bench, cases, beads, CYCLES * steps, 50)[1 + FIRST * steps // 50 :]
    return np.asarray((frames[..., 3] - LARGE_RADIUS * frames[..., 7]).mean(axis=0) / speeds)


def two_tones(bench: Bench) -> Iterator[Line]:
    """Drift of a dry bead by two tones, beside the friction model and limits."""
    drifts, expected = (
        np.array([drift(phase) for phase in PHASES])
        for drift in (partial(measured_drift, bench), coulomb_drift)
    )
    title = "dry bead, two tones"
    away = float(np.abs(drifts - expected).max())
    yield Line(
        f"{title}, {drifts.size} drives: largest distance of the drift from the friction model",
        0.0,
        away,
        5e-3,
    )
    yield Line(
        f"{title} in phase, weak friction: drift", weak_friction_drift(0.0), drifts[0, -1], 0.03
    )
    for phase, growth in ((0, 2.0), (90, 1.0)):
        last = drifts[list(PHASES).index(phase), -2:] * STRENGTHS[-2:]
        yield Line(
            f"{title}, {phase}°: growth of the drift at twice the drive", growth, last[1] / last[0]
        )


def law_with_film(surfaces: Surfaces) -> Curve:
    """The default law with bridges that form where the bead meets the surface of the film."""
    return replace(young_laplace.law(surfaces), formation=FILM)


def _wet(radius: float, film: float, changes: Mapping[str, Any]) -> Case:
    """A glass bead and a film, m. A bridge has the liquid that the bead displaces: it is as high as the film."""
    share = 2.0 * pi * radius * film**2 / bead_volume(radius)
    liquid = {"liquid.volume_fraction": share, "contact.roughness.bead_wall": f"{ROUGHNESS} m"}
    bead = {
        "beads.density": "2.5 g/cm^3",
        "dimers.radii": [f"{radius} m"] * 2,
        "contact.restitution": DRY_RESTITUTION,
    }
    return bench_case({**bead, **liquid, **changes})


def restitutions(
    bench: Bench, modulus: float = 7e10, law: str = "young-laplace"
) -> tuple[FloatArray, FloatArray]:
    """Stokes numbers ρDv/9η and restitutions of glass beads of a modulus (Pa) on a wet plate, (`VISCOSITIES`, `SPEEDS`)."""
    impact = Impact(2500.0 * bead_volume(GLASS), GLASS, reduced_modulus(modulus, 0.3))
    step = {"run.time_step": f"{impact.duration(SPEEDS.max()) / 100.0} s"}
    plain = _wet(
        GLASS, FILM, {**step, "liquid.law": law, "contact.youngs_modulus": f"{modulus} Pa"}
    )
    cases = [
        plain.with_value_at("liquid.dynamic_viscosity", oil)
        for oil in VISCOSITIES.tolist()
        for _ in SPEEDS
    ]
    high, far = 1.001 * FILM, 1.01 * bridge_at_rest(plain, GLASS, inf).rupture
    beads = [
        bead_at_plane(BOTTOM, high, GLASS, velocity=(0.0, 0.0, -speed), spin=AT_REST)
        for _ in VISCOSITIES
        for speed in SPEEDS.tolist()
    ]
    lasts = (high + 5.0 * far) / SPEEDS.min() + 2.0 * impact.duration(SPEEDS.min())
    every = round(lasts / plain.run.time_step / 200)
    frames = run_beads(bench, cases, beads, 200 * every, every)
    has_left = (frames[..., 2] > GLASS + far) & (frames[..., 5] > 0.0)
    after = np.where(
        has_left.any(axis=0), frames[has_left.argmax(axis=0), range(len(beads)), 5], 0.0
    )
    stokes = 2500.0 * 2.0 * GLASS * SPEEDS / (9.0 * VISCOSITIES[:, None])
    return stokes, after.reshape(stokes.shape) / SPEEDS


def impacts(bench: Bench) -> Iterator[Line]:
    """Restitution of a glass bead on a wet plate at 1 m/s by viscosity; effects of other changes at a Stokes number."""
    (stokes, hard), (_, soft) = restitutions(bench), restitutions(bench, 5e7)
    filled = restitutions(bench, law=f"{__file__}:law_with_film")[1]
    drag, e = 1.0 / stokes[:, 2], hard[:, 2]
    slope, start = np.polyfit(drag, e, 1)
    title = "glass bead on a wet plate"
    yield Line(
        f"{title}: largest distance of e from a line in 1/St",
        0.0,
        np.abs(start + slope * drag - e).max(),
        0.02,
    )
    yield Line(f"{title}: e at 1/St = 0, dry bead", DRY_RESTITUTION, start, 0.02)
    yield Line(
        f"{title}: critical Stokes number, ln(film/roughness) of approach",
        log(FILM / ROUGHNESS),
        -slope / start,
    )
    title += f", St = {stokes[2, 2]:.0f}: e"
    yield Line(f"{title} at 1 m/s and at 2 m/s", e[2], hard[3, 3])
    yield Line(f"{title}, bridge from the surface of the film", e[2], filled[2, 2])
    yield Line(f"{title}, bead of 50 MPa", e[2], soft[2, 2])


def incline(bench: Bench, radius: float = 1e-3, film: float = 7.5e-5) -> Iterator[Line]:
    """A bead on and below a plate of 20° with a viscous film, with and without friction, and which beads hang."""
    weight = {
        "boundary.tilt": "20 deg",
        "environment.gravity": f"{G} m/s^2",
        "run.time_step": "0.2 us",
    }
    plain = _wet(radius, film, weight)
    oily, thin = (
        plain.with_value_at("liquid.dynamic_viscosity", viscosity) for viscosity in (0.1, 4.6e-3)
    )
    ceiling, load = Flat((0.0, 0.0, 0.02), (0.0, 0.0, -1.0), "ceiling"), contact_loads(plain)[0]
    held = load.pull / (bead_volume(radius) * plain.pressing_gravity)
    beads = [
        bead_at_plane(wall, -load.overlap, radius, spin=AT_REST)
        for wall in (BOTTOM, BOTTOM, ceiling, ceiling, ceiling)
    ]
    beads[3:] = [
        replace(bead, density=share * held)
        for bead, share in zip(beads[3:], (0.9, 1.1), strict=True)
    ]
    cases = oily, oily.with_value_at("contact.friction.bead_wall", FRICTION), oily, thin, thin
    last = run_beads(bench, cases, beads, 300_000, 3000, (BOTTOM, ceiling))[-1]
    rolls, gaps = np.abs(radius * last[:, 7] / last[:, 3]), 0.02 - radius - last[:, 2]
    sliding, coupling, rolling = resistances_at_rest(oily, radius, inf)
    free = (radius * sliding + coupling) / (
        radius * sliding + 2.0 * coupling + rolling / radius
    )  # no torque
    yield Line("bead on a wet incline, no friction: Rω/v", free, rolls[0], 1e-2)
    yield Line("bead on a wet incline, friction 0.2: Rω/v", 1.0, rolls[1], 1e-2)
    yield Line("bead below a wet incline, no friction: Rω/v", free, rolls[2], 1e-2)
    for times, hangs, gap in ((0.9, 1.0, gaps[3]), (1.1, 0.0, gaps[4])):
        title = f"bead below a wet incline, {times} times the weight that its bridge holds: hangs"
        yield Line(title, hangs, float(gap < film), 0.0)
