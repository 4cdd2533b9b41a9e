"""Experiments of others, repeated with the engine.

A symmetric dimer is shaken by two tones, a bead is thrown onto a plate, a dry bead slides under two
tones, beads hit a wet plate, and beads roll on and below a wet incline. A line is judged if its
reference is exact or shares the assumptions of the model; the other lines show physics that the
model lacks. The documentation names the sources and their measurements (``explanation/others``).
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
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

FRICTION = 0.2
"""Coefficient of friction of beads on the plate."""

G = 9.81
"""Gravity, m/s²."""

SLIDING_DECELERATION = 3.5 * FRICTION * G
"""Deceleration of the surface of a sliding solid sphere, m/s², 7/2 of that of its centre."""

BASE_FREQUENCY = 80.0
"""Frequency of the first of two tones, Hz; the second tone has twice this frequency."""

CYCLES = 12
"""Number of cycles of the first tone in an experiment with two tones."""

UNMEASURED_CYCLES = 4
"""Number of cycles at the start that are not measured."""

PHASES = np.arange(0.0, 180.0, 30.0)
"""Phases of the second tone, degrees."""

STRENGTHS = np.array([2.0, 4.0, 8.0, 16.0])
"""Peak accelerations of both tones over `SLIDING_DECELERATION`."""

GLASS_RADIUS = 2.75e-3
"""Radius of the beads that hit a wet plate, m."""

GLASS_DENSITY = 2500.0
"""Density of these beads, kg/m³."""

FILM = 0.45e-3
"""Thickness of the film on the plate, m."""

ROUGHNESS = 1e-7
"""Roughness of the plate, m."""

DRY_RESTITUTION = 0.97
"""Coefficient of restitution of a dry bead."""

VISCOSITIES = np.array([0.25, 0.5, 1.0, 2.0, 4.0]) * 4.6e-3
"""Viscosities of the film, Pa s."""

SPEEDS = np.array([0.25, 0.5, 1.0, 2.0])
"""Speeds of the impacts, m/s."""

_Z = 2
"""Column of the height in the frames of `run_beads`."""

_VX = 3
"""Column of the velocity along x."""

_VZ = 5
"""Column of the upward velocity."""

_SPIN_Y = 7
"""Column of the angular velocity about y, which is positive for beads that roll along x."""

_SPACING = 8e-3
"""Distance between beads that are simulated at the same time, m."""

_DRY = {
    **DRY,
    "environment.gravity": f"{G} m/s^2",
    "contact.restitution": 0.5,
    "contact.friction.bead_wall": FRICTION,
}
"""Changes of a case for dry beads on a plate, by dotted keys."""


@contextmanager
def workbench() -> Iterator[Bench]:
    """A bench with the installed engine, in a folder that is removed at the end."""
    with tempfile.TemporaryDirectory(prefix="walkers-experiments-") as folder:
        yield Bench(find_engine(), Path(folder))


def experiments(out: Path) -> Iterator[Line]:
    """Compare all experiments; ``out`` is the folder of the runs of walkers."""
    yield from symmetry(out)
    with workbench() as bench:
        yield from thrown_bead(bench)
        yield from two_tones(bench)
        yield from impacts(bench)
        yield from incline(bench)


def run_beads(
    bench: Bench,
    beads: Sequence[tuple[Bead, Case]],
    steps: int,
    steps_per_frame: int,
    walls: Sequence[Wall] = (BOTTOM,),
) -> FloatArray:
    """Simulate beads that do not touch each other, each in a case of its own.

    Parameters
    ----------
    bench
        Runs the engine.
    beads
        N beads with their cases. They are moved to distances of 8 mm along y.
    steps
        Number of time steps, those of the first case.
    steps_per_frame
        Number of time steps between frames.
    walls
        Walls that all beads share.

    Returns
    -------
    ndarray
        Position, velocity and spin at each frame, SI units, shape (steps // steps_per_frame + 1,
        N, 9).
    """
    cases = [case for _, case in beads]
    surfaces = list(dict.fromkeys(map(surface_of, cases)))
    placed = []
    for number, (bead, case) in enumerate(beads):
        moved = replace(
            bead,
            id=number + 1,
            centre=(0.0, _SPACING * number, bead.centre[2]),
            surface=1 + surfaces.index(surface_of(case)),
            loading=number,
        )
        placed.append(moved)
    scene = PlacedBodies(
        beads=tuple(placed),
        walls=tuple(walls),
        lower=(-0.05, -0.01, -0.01),
        upper=(0.05, _SPACING * len(placed), 0.1),
        surfaces=tuple(surfaces),
        loadings=tuple(map(loading_of, cases)),
    )
    return bench.run(recorded_plan(cases[0], scene, steps, steps_per_frame)).frames


# --- a symmetric walker ---------------------------------------------------------------------------


def symmetry(out: Path) -> Iterator[Line]:
    """Compare the drift of a symmetric wet dimer under pairs of tones with its symmetry.

    It drifts under 80 and 120 Hz (2:3), but not under 40 and 120 Hz (1:3), whose waveform changes
    its sign after half a period. The opposite waveform reverses the drift.
    """
    speeds = []
    for first, start in ((40, 0), (80, 0), (80, 180)):
        case = _symmetric_case(first, start)
        speeds.append(1e3 * run(case, out).result["velocity"])
    one_to_three, two_to_three, opposite = speeds
    yield Line("symmetric dimer, tones 2:3: velocity (not zero)", 0.0, two_to_three, unit="mm/s")
    title = "symmetric dimer: velocity at 1:3 over velocity at 2:3"
    yield Line(title, 0.0, one_to_three / two_to_three, 1e-3)
    title = "symmetric dimer, 2:3: velocity by the opposite waveform over velocity by the waveform"
    yield Line(title, -1, opposite / two_to_three, 0.01)


def _symmetric_case(frequency: int, phase: int) -> Case:
    """A symmetric dimer under a tone of 4 g, of a frequency (Hz) and phase (°), and one of 3 g.

    The second tone has 120 Hz, and a phase that is larger by 90°.
    """
    document = load_case("symmetric", {"dimers.replicates": 1, "run.cycles": 30}).document
    first = {
        "frequency": f"{frequency} Hz",
        "peak_acceleration": "4 g",
        "phase": f"{phase} deg",
    }
    second = {
        "frequency": "120 Hz",
        "peak_acceleration": "3 g",
        "phase": f"{phase + 90} deg",
    }
    drive = {"harmonics": [first, second]}
    return build_case({**document, "drive": drive}, name="symmetric")


# --- dry beads ------------------------------------------------------------------------------------


def thrown_bead(bench: Bench, speed: float = 0.05) -> Iterator[Line]:
    """Compare a dry bead that is thrown sliding with the solid sphere of mechanics.

    It rolls at 5/7 of its initial speed v after the time 2v/7μg. ``speed`` is v in m/s.
    """
    case = bench_case(_DRY)
    sliding_time = speed / SLIDING_DECELERATION
    overlap = contact_loads(case)[0].overlap
    bead = bead_at_plane(BOTTOM, -overlap, LARGE_RADIUS, velocity=(speed, 0.0, 0.0), spin=AT_REST)
    # A frame every ten steps, for one and a half times the time 2v/7μg during which it slides.
    steps = 10 * round(0.15 * sliding_time / case.run.time_step)
    frames = run_beads(bench, [(bead, case)], steps, 10)[:, 0]
    slip = frames[:, _VX] - LARGE_RADIUS * frames[:, _SPIN_Y]
    time = 10.0 * case.run.time_step * np.arange(len(frames))
    slides = slip > 0.05 * speed  # without the frames around the change to rolling
    slope, initial_slip = np.polyfit(time[slides], slip[slides], 1)
    title = "thrown bead: speed of rolling over speed of the throw"
    yield Line(title, 5.0 / 7.0, frames[-1, _VX] / speed, 1e-3)
    expected = 2.0 * speed / (7.0 * FRICTION * G)
    yield Line("thrown bead: time until it rolls", expected, -initial_slip / slope, 1e-3, "s")


def frictionless_velocity(phase: float, angle: FloatArray | float) -> FloatArray:
    """Velocity of the plate under two tones of frequencies 1:2 and equal accelerations, reversed.

    Parameters
    ----------
    phase
        Phase of the second tone, degrees.
    angle
        Phase of the cycle, rad, of any shape.

    Returns
    -------
    ndarray
        Velocity of a bead without friction relative to the plate, over the speed of the first tone.
    """
    return np.asarray(-np.cos(angle) - 0.5 * np.cos(2.0 * np.asarray(angle) + radians(phase)))


def weak_friction_drift(phase: float) -> float:
    """Drift in the limit of weak friction, where a slider slides forward as long as backward.

    ``phase`` is that of the second tone in degrees; the unit is the speed of the first tone.
    """
    angles = np.linspace(0.0, 2.0 * pi, 20_000, endpoint=False)
    return -float(np.median(frictionless_velocity(phase, angles)))


def coulomb_drift(phase: float, steps: int = 2500) -> FloatArray:
    """Drift of a mass with Coulomb friction on the plate under two tones.

    Parameters
    ----------
    phase
        Phase of the second tone, degrees.
    steps
        Number of time steps in a cycle. Friction can stop the mass at the end of a step.

    Returns
    -------
    ndarray
        Mean sliding velocity for each of `STRENGTHS`, over the speed of the first tone.
    """
    step = 2.0 * pi / steps
    displacement = np.zeros_like(STRENGTHS)
    slip = frictionless_velocity(phase, 0.0) + weak_friction_drift(phase) + displacement
    for number in range(CYCLES * steps):
        before = frictionless_velocity(phase, number * step)
        after = frictionless_velocity(phase, (number + 1) * step)
        slip = slip + after - before
        slip = np.sign(slip) * np.maximum(np.abs(slip) - step / STRENGTHS, 0.0)
        if number >= UNMEASURED_CYCLES * steps:
            displacement += slip
    return displacement / ((CYCLES - UNMEASURED_CYCLES) * steps)


def measured_drift(bench: Bench, phase: float) -> FloatArray:
    """Drift of a dry bead on the plate under two tones, by the engine.

    The surface of the bead moves as a slider with 7/2 times the friction. The bead starts at the
    velocity of the limit of weak friction.

    Parameters
    ----------
    bench
        Runs the engine.
    phase
        Phase of the second tone, degrees.

    Returns
    -------
    ndarray
        Mean sliding velocity for each of `STRENGTHS`, over the speed of the first tone.
    """
    undriven = bench_case(_DRY)
    gap = -contact_loads(undriven)[0].overlap
    drift = weak_friction_drift(phase)
    # The centre does not drift: it has 2/7, and the rotation 5/7 of the drift of the surface.
    velocity = float(frictionless_velocity(phase, 0.0)) + 2.0 / 7.0 * drift
    spin = -5.0 / 7.0 * drift / LARGE_RADIUS
    peaks = SLIDING_DECELERATION * STRENGTHS
    speeds = SLIDING_DECELERATION * STRENGTHS / (2.0 * pi * BASE_FREQUENCY)
    beads = []
    for peak, speed in zip(peaks, speeds.tolist(), strict=True):
        bead = bead_at_plane(
            BOTTOM,
            gap,
            LARGE_RADIUS,
            velocity=(velocity * speed, 0.0, 0.0),
            spin=(0.0, spin * speed, 0.0),
        )
        beads.append((bead, undriven.with_value_at("drive.harmonics", _tones(peak, phase))))
    steps_per_cycle = round(1.0 / BASE_FREQUENCY / undriven.run.time_step)
    steps_per_frame = 50
    frames = run_beads(bench, beads, CYCLES * steps_per_cycle, steps_per_frame)
    measured = frames[1 + UNMEASURED_CYCLES * steps_per_cycle // steps_per_frame :]
    sliding = measured[..., _VX] - LARGE_RADIUS * measured[..., _SPIN_Y]
    return np.asarray(sliding.mean(axis=0) / speeds)


def _tones(peak_acceleration: float, phase: float) -> tuple[Harmonic, Harmonic]:
    """Two tones with equal peak accelerations, m/s²; the second one has the phase, degrees."""
    first = Harmonic(
        axis="x", frequency=BASE_FREQUENCY, peak_acceleration=peak_acceleration, phase=0.0
    )
    second = Harmonic(
        axis="x",
        frequency=2.0 * BASE_FREQUENCY,
        peak_acceleration=peak_acceleration,
        phase=radians(phase),
    )
    return first, second


def two_tones(bench: Bench) -> Iterator[Line]:
    """Compare the drift of a dry bead under two tones with Coulomb friction and with limits."""
    drifts = np.array([measured_drift(bench, phase) for phase in PHASES])
    expected = np.array([coulomb_drift(phase) for phase in PHASES])
    largest = float(np.abs(drifts - expected).max())
    title = (
        f"dry bead, two tones, {drifts.size} drives: "
        "largest distance of the drift from the friction model"
    )
    yield Line(title, 0.0, largest, 5e-3)
    title = "dry bead, two tones in phase, weak friction: drift"
    yield Line(title, weak_friction_drift(0.0), drifts[0, -1], 0.03)
    for phase, growth in ((0, 2.0), (90, 1.0)):
        before, doubled = drifts[list(PHASES).index(phase), -2:] * STRENGTHS[-2:]
        title = f"dry bead, two tones, {phase}°: growth of the drift at twice the drive"
        yield Line(title, growth, doubled / before)


# --- beads on a wet plate -------------------------------------------------------------------------


def law_with_film(surfaces: Surfaces) -> Curve:
    """The default law, with bridges that form where the bead meets the surface of the film."""
    return replace(young_laplace.law(surfaces), formation=FILM)


def _wet_case(radius: float, film: float, changes: Mapping[str, Any]) -> Case:
    """A glass bead on a film, with a bridge of the liquid that it displaces, as high as the film.

    Radius and film are in m; the changes have dotted keys.
    """
    displaced = 2.0 * pi * radius * film**2 / bead_volume(radius)
    values = {
        "beads.density": "2.5 g/cm^3",
        "dimers.radii": [f"{radius} m"] * 2,
        "contact.restitution": DRY_RESTITUTION,
        "liquid.volume_fraction": displaced,
        "contact.roughness.bead_wall": f"{ROUGHNESS} m",
    }
    return bench_case({**values, **changes})


def restitutions(
    bench: Bench, modulus: float = 7e10, law: str = "young-laplace"
) -> tuple[FloatArray, FloatArray]:
    """Let glass beads hit a wet plate at all `SPEEDS` with all `VISCOSITIES`.

    Parameters
    ----------
    bench
        Runs the engine.
    modulus
        Young's modulus of beads and plate, Pa.
    law
        Bridge law, as in a case file.

    Returns
    -------
    stokes, restitution : ndarray
        Stokes numbers ρDv/9η, and speeds after the impact over those before it (0 if a bead stays),
        both of shape (viscosities, speeds).
    """
    mass = GLASS_DENSITY * bead_volume(GLASS_RADIUS)
    impact = Impact(mass, GLASS_RADIUS, reduced_modulus(modulus, 0.3))
    changes = {
        "run.time_step": f"{impact.duration(SPEEDS.max()) / 100.0} s",
        "liquid.law": law,
        "contact.youngs_modulus": f"{modulus} Pa",
    }
    case = _wet_case(GLASS_RADIUS, FILM, changes)
    start = 1.001 * FILM  # just above the film
    distance = 1.01 * bridge_at_rest(case, GLASS_RADIUS, inf).rupture  # where the bridge has broken
    beads = []
    for viscosity in VISCOSITIES.tolist():
        with_film = case.with_value_at("liquid.dynamic_viscosity", viscosity)
        for speed in SPEEDS.tolist():
            bead = bead_at_plane(
                BOTTOM, start, GLASS_RADIUS, velocity=(0.0, 0.0, -speed), spin=AT_REST
            )
            beads.append((bead, with_film))
    # The slowest bead has time to arrive, and to rise to the distance at a fifth of its speed.
    duration = (start + 5.0 * distance) / SPEEDS.min() + 2.0 * impact.duration(SPEEDS.min())
    frame_count = 200
    steps_per_frame = round(duration / case.run.time_step / frame_count)
    frames = run_beads(bench, beads, frame_count * steps_per_frame, steps_per_frame)
    stokes = GLASS_DENSITY * 2.0 * GLASS_RADIUS * SPEEDS / (9.0 * VISCOSITIES[:, None])
    speeds_after = _speeds_of_departure(frames, GLASS_RADIUS + distance)
    return stokes, speeds_after.reshape(stokes.shape) / SPEEDS


def _speeds_of_departure(frames: FloatArray, height: float) -> FloatArray:
    """Upward speeds, m/s, when the beads first rise above a height, m; 0 for those that do not.

    ``frames`` is as from `run_beads`, shape (frames, N, 9); the speeds have the shape (N,).
    """
    has_left = (frames[..., _Z] > height) & (frames[..., _VZ] > 0.0)
    first = has_left.argmax(axis=0)
    speeds = frames[first, range(frames.shape[1]), _VZ]
    return np.where(has_left.any(axis=0), speeds, 0.0)


def impacts(bench: Bench) -> Iterator[Line]:
    """Compare the restitution of a glass bead on a wet plate with lubrication theory.

    At 1 m/s the viscosity varies. At one Stokes number, the speed, the start of the bridge and the
    modulus of the bead vary.
    """
    stokes, hard = restitutions(bench)
    _, soft = restitutions(bench, modulus=5e7)
    _, filled = restitutions(bench, law=f"{__file__}:law_with_film")
    inverse = 1.0 / stokes[:, 2]
    restitution = hard[:, 2]
    slope, dry = np.polyfit(inverse, restitution, 1)
    largest = np.abs(dry + slope * inverse - restitution).max()
    plate = "glass bead on a wet plate"
    yield Line(f"{plate}: largest distance of e from a line in 1/St", 0.0, largest, 0.02)
    yield Line(f"{plate}: e at 1/St = 0, dry bead", DRY_RESTITUTION, dry, 0.02)
    title = f"{plate}: critical Stokes number, ln(film/roughness) of approach"
    yield Line(title, log(FILM / ROUGHNESS), -slope / dry)
    title = f"{plate}, St = {stokes[2, 2]:.0f}: e"
    yield Line(f"{title} at 1 m/s and at 2 m/s", restitution[2], hard[3, 3])
    yield Line(f"{title}, bridge from the surface of the film", restitution[2], filled[2, 2])
    yield Line(f"{title}, bead of 50 MPa", restitution[2], soft[2, 2])


def incline(bench: Bench, radius: float = 1e-3, film: float = 7.5e-5) -> Iterator[Line]:
    """Compare beads on and below a plate of 20° with a viscous film with the balance of torques.

    They roll with and without friction. Below the plate, a bead hangs if the bridge carries it.

    Parameters
    ----------
    bench
        Runs the engine.
    radius
        Radius of the beads, m.
    film
        Thickness of the film, m.
    """
    changes = {
        "boundary.tilt": "20 deg",
        "environment.gravity": f"{G} m/s^2",
        "run.time_step": "0.2 us",
    }
    case = _wet_case(radius, film, changes)
    oily = case.with_value_at("liquid.dynamic_viscosity", 0.1)
    rough = oily.with_value_at("contact.friction.bead_wall", FRICTION)
    thin = case.with_value_at("liquid.dynamic_viscosity", 4.6e-3)
    load = contact_loads(case)[0]
    ceiling_height = 0.02  # m, out of reach of the beads on the plate
    ceiling = Flat((0.0, 0.0, ceiling_height), (0.0, 0.0, -1.0), "ceiling")
    above = bead_at_plane(BOTTOM, -load.overlap, radius, spin=AT_REST)
    below = bead_at_plane(ceiling, -load.overlap, radius, spin=AT_REST)
    largest_density = load.pull / (bead_volume(radius) * case.pressing_gravity)
    light = replace(below, density=0.9 * largest_density)
    heavy = replace(below, density=1.1 * largest_density)
    beads = [(above, oily), (above, rough), (below, oily), (light, thin), (heavy, thin)]
    steps = 300_000  # 60 ms, long enough to roll steadily or to fall
    last = run_beads(bench, beads, steps, 3000, (BOTTOM, ceiling))[-1]

    rolling_share = np.abs(radius * last[:, _SPIN_Y] / last[:, _VX])
    sliding, coupling, rolling = resistances_at_rest(oily, radius, inf)
    torque_free = (radius * sliding + coupling) / (
        radius * sliding + 2.0 * coupling + rolling / radius
    )
    title = "bead on a wet incline, no friction: Rω/v"
    yield Line(title, torque_free, rolling_share[0], 1e-2)
    yield Line("bead on a wet incline, friction 0.2: Rω/v", 1.0, rolling_share[1], 1e-2)
    title = "bead below a wet incline, no friction: Rω/v"
    yield Line(title, torque_free, rolling_share[2], 1e-2)
    gaps = ceiling_height - radius - last[:, _Z]
    for times, hangs, gap in ((0.9, 1.0, gaps[3]), (1.1, 0.0, gaps[4])):
        title = f"bead below a wet incline, {times} times the weight that its bridge holds: hangs"
        yield Line(title, hangs, float(gap < film), 0.0)
