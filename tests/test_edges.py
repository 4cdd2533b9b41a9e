"""Edges of menisci that move over wet surfaces: in bridges, both engines and the theory."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from studies.literature import experiments
from tests.conftest import COULOMB
from walkers.arrays import FloatArray, Vector
from walkers.errors import InputError
from walkers.inputs.reading import find_input, load_case, read_case
from walkers.inputs.resolving.loads import contact_loads, surfaces_of
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import BOTTOM
from walkers.physics.capillary import BridgeLiquid
from walkers.physics.dimer import Dimer
from walkers.physics.edges import edge_resistance, wetted_radius
from walkers.runner.binary import find_engine
from walkers.second_engine.scenes import (
    AT_REST,
    DRY,
    LARGE_RADIUS,
    SMALL_RADIUS,
    Bench,
    bead_at_plane,
    bench_case,
    dry,
    pair,
    prescribed,
    scene_of,
)
from walkers.templates.bridge_tables import RecordedLaw, bridge_tables
from walkers.templates.deck import BRIDGES_NAME, render_deck
from walkers.templates.placement import Bead
from walkers.theory.mathieu import AxialMotion, _sideways_edges, turning_rate
from walkers.theory.motion import Walker, predict_motion

MASS = 4000.0 * 4.0 / 3.0 * pi * LARGE_RADIUS**3
"""Mass of a large bead of 4 g/cm³, kg."""


# --- the resistance -------------------------------------------------------------------------------


def test_the_resistance_at_a_wall_is_that_of_bretherton() -> None:
    """7.905 γ r_w (η/γ)^(2/3) of Si AK5: γ = 19.2 mN/m, η = 4.6 mPa s, 5.79 nL under 0.3 mm.

    r_w = (4 · 0.3 mm · 5.79e-12 m³/π)^(1/4) = 0.2168 mm.
    """
    case = load_case("fig1b", {"liquid.edge_ratio": 1.0})
    surfaces = contact_loads(case)[0].surfaces
    assert wetted_radius(surfaces) == pytest.approx(0.2168e-3, rel=1e-3)
    expected = 7.905 * 0.0192 * 0.2168e-3 * (0.0046 / 0.0192) ** (2.0 / 3.0)
    assert edge_resistance(surfaces) == pytest.approx(expected, rel=2e-3)


def test_the_resistance_is_proportional_to_the_ratio() -> None:
    surfaces = [
        contact_loads(load_case("fig1b", {"liquid.edge_ratio": ratio}))[0].surfaces
        for ratio in (1.0, 1.5)
    ]
    assert edge_resistance(surfaces[1]) == pytest.approx(1.5 * edge_resistance(surfaces[0]))


def test_edges_of_much_liquid_are_narrower_than_the_bead() -> None:
    case = load_case("fig1b", {"liquid.volume_fraction": 0.5, "liquid.edge_ratio": 1.0})
    assert wetted_radius(contact_loads(case)[0].surfaces) == 0.8 * 0.3e-3


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        pytest.param("fig1b", {"liquid.edge_ratio": 0.0}, id="a ratio of zero"),
        pytest.param("climber-dimer", {}, id="no ratio"),
    ],
)
def test_without_a_ratio_edges_do_not_resist(name: str, changes: dict[str, float]) -> None:
    """The library has a ratio for ruby on chromium-coated glass, and none for glass beads."""
    case = load_case(name, changes)
    assert edge_resistance(contact_loads(case)[0].surfaces) == 0.0
    assert "edge" not in render_deck(case).files[BRIDGES_NAME]


# --- beads with edges alone -----------------------------------------------------------------------


def case_of_edges(**changes: object) -> Case:
    """Beads without friction, damping and other forces of bridges, whose edges resist."""
    return bench_case(
        {
            **DRY,
            "environment.gravity": "9.81 m/s^2",
            "liquid.dynamic_viscosity": "4.6 mPa*s",
            "liquid.edge_ratio": 1.0,
            **changes,
        }
    )


def slowed(bench: experiments.Bench, case: Case, *, velocity: Vector, spin: Vector) -> FloatArray:
    """Frames of a large bead on the floor every 100 steps of 1 µs, shape (frames, 9)."""
    overlap = contact_loads(case)[0].overlap
    bead = bead_at_plane(BOTTOM, -overlap, LARGE_RADIUS, velocity=velocity, spin=spin)
    return experiments.run_beads(bench, [(bead, case)], 20_000, 100)[:, 0]


def resistance_at_floor(case: Case) -> float:
    """Resistance of the edges of a large bead at the floor, N (s/m)^(2/3)."""
    return edge_resistance(surfaces_of(case, LARGE_RADIUS, np.inf))


def test_edges_slow_a_bead_as_the_closed_form_says(bench: experiments.Bench) -> None:
    """The equation m dv/dt = -E v^(2/3) has the solution v^(1/3) = v₀^(1/3) - E t/(3m)."""
    case = case_of_edges()
    frames = slowed(bench, case, velocity=(0.05, 0.0, 0.0), spin=AT_REST)
    time = 1e-4 * np.arange(len(frames))
    root = 0.05 ** (1.0 / 3.0) - resistance_at_floor(case) * time / (3.0 * MASS)
    assert frames[-1, 3] < 0.035
    assert frames[:, 3] == pytest.approx(root**3, rel=1e-4)


def test_edges_slow_the_rotation_of_a_bead_as_the_closed_form_says(
    bench: experiments.Bench,
) -> None:
    """With I = 2/5 mR², u = Rω slows down 5/2 times as fast as the velocity does."""
    case = case_of_edges()
    frames = slowed(bench, case, velocity=AT_REST, spin=(0.0, 0.05 / LARGE_RADIUS, 0.0))
    time = 1e-4 * np.arange(len(frames))
    root = 0.05 ** (1.0 / 3.0) - 2.5 * resistance_at_floor(case) * time / (3.0 * MASS)
    assert LARGE_RADIUS * frames[:, 7] == pytest.approx(root**3, rel=5e-4)


def test_edges_do_not_turn_a_bead_that_moves_without_rotation(bench: experiments.Bench) -> None:
    frames = slowed(bench, case_of_edges(), velocity=(0.05, 0.0, 0.0), spin=AT_REST)
    assert np.abs(LARGE_RADIUS * frames[:, 6:9]).max() < 1e-4 * 0.05


def test_a_bead_that_turns_at_a_bead_at_rest_does_not_turn_it(tmp_path: Path) -> None:
    """Only its own edge moves; its force presses on both beads, toward the one at rest."""
    case = case_of_edges(**{"environment.gravity": "0 m/s^2"})
    beads = pair(-1e-6, 0.0, AT_REST, (AT_REST, (50.0, -80.0, 30.0)))
    output = Bench(find_engine(), tmp_path).run(prescribed(case, scene_of(beads), 10))
    at_rest, turning = output.forces[1, :, 3:]
    assert np.abs(at_rest).max() < 1e-9 * np.abs(turning).max()
    assert np.abs(output.forces[1, :, :3]).max() > 0.0


def test_edges_between_beads_conserve_momentum_and_angular_momentum(tmp_path: Path) -> None:
    """Relative to the largest force and torque on a pair that slides and turns."""
    case = case_of_edges(**{"environment.gravity": "0 m/s^2"})
    beads = pair(-1e-6, 0.0, (0.02, -0.03, 0.01))
    output = Bench(find_engine(), tmp_path).run(prescribed(case, scene_of(beads), 100))
    places = output.frames[-1, :, :3]
    forces = output.forces[-1, :, :3]
    torques = output.forces[-1, :, 3:]
    total_torque = (torques + np.cross(places, forces)).sum(axis=0)
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).max()
    assert np.abs(total_torque).max() < 1e-9 * np.abs(torques).max()


@pytest.fixture(
    params=[
        pytest.param((0.3e-3, 0.2e-3), id="the first bead is larger"),
        pytest.param((0.2e-3, 0.3e-3), id="the second bead is larger"),
    ]
)
def dimer(request: pytest.FixtureRequest) -> Dimer:
    """Two beads of 4 g/cm³ with Si AK5."""
    return Dimer(request.param, 4000.0, 0.0192)


ACROSS = np.array([2e-3, 4e-5, -3e-5, 0.11, -0.23, 0.31, 0.17])
"""Small ψ (rad), velocities of both beads across the drive (m/s), and their spins about the drive
and about the vertical (rad/s): the variables of `walkers.theory.mathieu`."""
AXIAL_SPINS = (150.0, -220.0)
"""Spins of both beads across the drive, rad/s."""
AXIAL_VELOCITY = 0.05
"""Velocity of both beads along the drive, m/s."""
OVERLAP = 1e-9
"""Overlap of surfaces, m: they touch, and hardly repel each other."""


def moving_bead(number: int, radius: float, centre: FloatArray) -> Bead:
    """A bead of a dimer, with the velocity and the spin that it has by `ACROSS`."""
    velocity = (AXIAL_VELOCITY, float(ACROSS[1 + number]), 0.0)
    spin = (float(ACROSS[3 + number]), AXIAL_SPINS[number], float(ACROSS[5 + number]))
    x, y, z = centre.tolist()
    return Bead(0, (x, y, z), radius, velocity, spin)


def beads_of(dimer: Dimer) -> list[Bead]:
    """The two beads as they touch each other, far from walls, and again apart on the floor."""
    touching = []
    on_floor = []
    sine = dimer.sin_delta
    cosine = (1.0 - sine**2) ** 0.5
    axis = np.array([cosine * np.cos(ACROSS[0]), cosine * np.sin(ACROSS[0]), sine])
    distance = sum(dimer.radii) - OVERLAP
    for number, radius in enumerate(dimer.radii):
        middle = np.array([0.0, 0.0, 5e-3])
        place = (0.5 - number) * distance * axis
        touching.append(moving_bead(number, radius, middle + place))
        beside = np.array([3e-3 * number, 3e-3, BOTTOM.point[2] + radius - OVERLAP])
        on_floor.append(moving_bead(number, radius, beside))
    return touching + on_floor


def axial_motion(case: Case, dimer: Dimer) -> AxialMotion:
    """The motion along the drive that goes with `beads_of`, of one step."""
    first, second = dimer.radii
    contacts = [(first, np.inf), (second, np.inf), (first, second)]
    edges = [edge_resistance(surfaces_of(case, *radii)) for radii in contacts]
    return AxialMotion(
        sliding=np.zeros((3, 1)),
        normal=np.zeros((3, 1)),
        spin=np.array(AXIAL_SPINS)[:, None],
        force=np.zeros(1),
        torque=np.zeros((2, 1)),
        velocity=np.array([AXIAL_VELOCITY]),
        edges=np.array(edges),
    )


def test_edges_that_move_across_the_drive_resist_in_the_theory_as_in_the_engine(
    dimer: Dimer, tmp_path: Path
) -> None:
    """Forces F and couples M at the three contacts, in a direction c across the walker.

    With the unit vector n toward a bead, its torque is -R n × F - n × M, so that M is the part of
    -torque along n × c, without R F. The velocities across are a thousandth of those along the
    drive: the theory, which is linear in them, leaves out the square.
    """
    case = case_of_edges(**{"environment.gravity": "0 m/s^2"})
    output = Bench(find_engine(), tmp_path).run(prescribed(case, scene_of(beads_of(dimer)), 1))
    axis = output.frames[1, 0, :3] - output.frames[1, 1, :3]
    axis /= np.linalg.norm(axis)
    across_walker = np.array([-axis[1], axis[0], 0.0]) / np.hypot(axis[0], axis[1])
    across_drive = np.array([0.0, 1.0, 0.0])
    upward = np.array([0.0, 0.0, 1.0])
    contacts = [  # number of the bead in the scene, its radius, n and c
        (2, dimer.radii[0], upward, across_drive),
        (3, dimer.radii[1], upward, across_drive),
        (0, dimer.radii[0], axis, across_walker),
    ]
    engine_forces = []
    engine_couples = []
    for bead, radius, normal, across in contacts:
        force = output.forces[1, bead, :3] @ across
        torque = output.forces[1, bead, 3:] @ np.cross(normal, across)
        engine_forces.append(force)
        engine_couples.append(-torque - radius * force)

    forces, couples = _sideways_edges(dimer, axial_motion(case, dimer))
    assert forces[:, 0] @ ACROSS == pytest.approx(engine_forces, rel=1e-4)
    assert couples[:, 0] @ ACROSS == pytest.approx(engine_couples, rel=1e-4)


# --- conserved liquid -----------------------------------------------------------------------------


@dataclass(frozen=True)
class BridgeOfVolume:
    """A table of the engine's file: radii (m), volume (m³) and edge resistance, N (s/m)^(2/3)."""

    radius: float
    other_radius: float
    volume: float
    resistance: float


def bridges_with_liquid(volume_fraction: float) -> list[BridgeOfVolume]:
    """The tables of a bead of 0.2 mm at a wall, at its like and at one of 0.3 mm, and of that one.

    The liquid is Si AK5 with an edge ratio of 1.5, and it is conserved.
    """
    case = bench_case(DRY)
    liquid = BridgeLiquid(
        surface_tension=0.0192,
        viscosity=0.0046,
        contact_angle=0.0,
        volume_fraction=volume_fraction,
        conserved=True,
        edge_ratio=1.5,
    )
    text = bridge_tables([(case.contact, liquid)], {(1, 0.2e-3), (1, 0.3e-3)}, dry)
    head = r"^bridge \d+ \d+ (\S+) (\S+)\nliquid (\S+) .*\nedge (\S+)$"
    bridges = []
    for numbers in re.findall(head, text, re.MULTILINE):
        radius, other_radius, volume, resistance = map(float, numbers)
        bridges.append(BridgeOfVolume(radius, other_radius, volume, resistance))
    assert len(bridges) == text.count("bridge ")
    return bridges


def resistance_by_hand(bridge: BridgeOfVolume) -> float:
    """1.5 · 7.905 γ r_w (η/γ)^(2/3), with r_w = (4 R* V/π)^(1/4) or 0.8 of the smaller radius."""
    reduced_radius = 1.0 / (1.0 / bridge.radius + 1.0 / bridge.other_radius)
    wetted = (4.0 * reduced_radius * bridge.volume / pi) ** 0.25
    wetted = min(wetted, 0.8 * bridge.radius)
    return 1.5 * 7.905 * 0.0192 * wetted * (0.0046 / 0.0192) ** (2.0 / 3.0)


@pytest.mark.parametrize("volume_fraction", [0.01, 0.3], ids=["little liquid", "much liquid"])
def test_edges_of_conserved_liquid_resist_as_those_of_the_volume(volume_fraction: float) -> None:
    bridges = bridges_with_liquid(volume_fraction)
    assert len(bridges) == 5 * 10
    resistances = [bridge.resistance for bridge in bridges]
    by_hand = [resistance_by_hand(bridge) for bridge in bridges]
    assert resistances == pytest.approx(by_hand, rel=1e-3)


def test_sixteen_times_the_conserved_liquid_doubles_the_resistance_of_edges() -> None:
    """E is proportional to r_w = (4 R* V/π)^(1/4), hence to V^(1/4): by a step of √2, 2^(1/8)."""
    at_wall = bridges_with_liquid(0.01)[:10]
    assert at_wall[8].volume == pytest.approx(16.0 * at_wall[0].volume)
    assert at_wall[8].resistance == pytest.approx(2.0 * at_wall[0].resistance)
    resistances = np.array([bridge.resistance for bridge in at_wall])
    assert resistances[1:] / resistances[:-1] == pytest.approx(2.0**0.125)


def test_edges_that_the_bead_limits_do_not_grow_with_the_conserved_liquid() -> None:
    """At a wall r_w = (8/3 φ)^(1/4) R with φ = 0.3: it is limited from 0.51 of the volume on.

    0.8⁴ = 0.41 of 8/3 · 0.3 = 0.8. Of the volumes in steps of √2, the last three are larger.
    """
    at_wall = bridges_with_liquid(0.3)[:10]
    last = at_wall[-1].resistance
    assert at_wall[-3].resistance == last
    assert at_wall[-2].resistance == last
    assert at_wall[-4].resistance == pytest.approx((0.4 / 0.4096) ** 0.25 * last)


# --- walkers --------------------------------------------------------------------------------------

EDGES = {
    "liquid.edge_ratio": 1.5,
    "contact.rolling_friction": 0.0,
    "dimers.replicates": 2,
}


@pytest.mark.parametrize("peak", ["3 g", "10 g"])
def test_theory_and_engine_agree_on_a_walker_with_edges(peak: str, in_folder: Path) -> None:
    """Within 3 %, as without edges: the engine has softened beads."""
    case = load_case("fig1b", {**EDGES, "drive.peak_acceleration": peak})
    motion = predict_motion(Walker.of_case(case), 80.0, case.excitation.peak_acceleration)
    velocity = walkers.run(case, Path("runs"), progress=False).result["velocity"]
    assert velocity == pytest.approx(motion.velocity[0], rel=0.03)


def test_edges_slow_a_walker_by_a_third_at_a_weak_drive() -> None:
    """At 2 g and 60 Hz, where it walks at 1.1 mm/s by Coulomb's law without them."""
    drive = {"drive.peak_acceleration": "2 g", "drive.frequency": "60 Hz"}
    plain, edged = (
        predict_motion(
            Walker.of_case(load_case("fig1b", {**COULOMB, **drive, **edges})), 60.0, 19.6
        )
        for edges in ({}, {"liquid.edge_ratio": 1.0})
    )
    assert edged.velocity[0] / plain.velocity[0] == pytest.approx(0.68, abs=0.03)


@pytest.mark.parametrize(
    ("radii", "peak", "expected_sign"),
    [
        pytest.param(["0.3 mm", "0.2 mm"], "4 g", -1.0, id="turns to the axis"),
        pytest.param(["0.25 mm", "0.25 mm"], "6 g", 1.0, id="turns across the axis"),
    ],
)
def test_walkers_with_edges_turn_at_the_rate_of_the_theory(
    radii: list[str], peak: str, expected_sign: float, run_directory: Callable[..., Path]
) -> None:
    """Within 10 %; without edges, the rates of theory are 1.6 and 2.9 times as high.

    At 4 g, the symmetric walker sticks to the substrate through the whole cycle and does not turn.
    """
    changes = {
        "liquid.edge_ratio": 1.5,
        "contact.rolling_friction": 0.0,
        "drive.peak_acceleration": peak,
        "dimers.radii": radii,
        "dimers.angle": "3 deg",
        "dimers.angle_spread": "0 deg",
        "dimers.replicates": 2,
        "run.cycles": 60,
        "run.settling_cycles": 10,
    }
    run = walkers.load(run_directory(load_case("fig1b", changes)))
    group = run.motion.groups[0]
    strobed = slice(20 * run.case.run.samples_per_cycle, None, run.case.run.samples_per_cycle)
    tangent = np.tan(np.abs(group.orientation[strobed, 0]))
    rate = np.polyfit(group.time[strobed], np.log(np.abs(tangent)), 1)[0]
    assert np.sign(rate) == expected_sign
    assert turning_rate(run.case) == pytest.approx(rate, rel=0.1)


def test_the_theory_takes_no_other_effect_beside_edges() -> None:
    walker = Walker.of_case(load_case("fig1b", EDGES))
    with pytest.raises(ValueError, match="no effect beside the edges"):
        predict_motion(walker, 80.0, 39.2, effect=(lambda: None, np.zeros((1, 0))))  # type: ignore[arg-type, return-value]


def test_a_recorded_law_is_found_again_in_tables_with_edges() -> None:
    case = load_case("fig1b", EDGES)
    tables = render_deck(case).files[BRIDGES_NAME]
    surfaces = surfaces_of(case, SMALL_RADIUS, np.inf)
    curve = RecordedLaw(tables, None)(surfaces)
    assert curve.rupture == pytest.approx(case.law(surfaces).rupture)


LIBRARY = """
[materials."my ruby"]
density = { value = "4.0 g/cm^3", source = "weighed" }

[[surface_pairs]]
materials  = ["my ruby", "my ruby"]
edge_ratio = { value = 2.0, source = "mine" }
"""
"""A library with a factor for the edges of menisci on two surfaces of one material."""
OF_BEADS = {"beads.material": "my ruby", "boundary.material": "glass"}


@pytest.fixture
def with_library() -> dict[str, Any]:
    """The case ``fig1b`` with this library."""
    document = read_case(find_input("fig1b", "case"))
    return {**document, "library": tomllib.loads(LIBRARY)}


def test_a_factor_of_a_library_for_two_beads_alone_is_refused(with_library: dict[str, Any]) -> None:
    """All menisci have that of beads and boundary, which this library does not have."""
    with pytest.raises(InputError) as error:
        load_case(with_library, OF_BEADS)
    (problem,) = error.value.problems
    assert problem.key == "liquid.edge_ratio"
    assert "2.0 for my ruby on my ruby" in problem.expected
    assert "that of my ruby on glass: give edge_ratio there or here" in problem.expected


def test_a_factor_of_a_case_precedes_that_of_a_library_for_two_beads(
    with_library: dict[str, Any],
) -> None:
    case = load_case(with_library, {**OF_BEADS, "liquid.edge_ratio": 0.5})
    assert case.liquid.edge_ratio == 0.5


def test_a_boundary_of_the_material_of_the_beads_has_the_factor_of_this_pair(
    with_library: dict[str, Any],
) -> None:
    case = load_case(with_library, {**OF_BEADS, "boundary.material": "my ruby"})
    assert case.liquid.edge_ratio == 2.0


def test_the_factor_of_beads_and_boundary_precedes_that_of_two_beads(
    with_library: dict[str, Any],
) -> None:
    at_boundary = {
        "materials": ["my ruby", "glass"],
        "edge_ratio": {"value": 3.0, "source": "mine"},
    }
    with_library["library"]["surface_pairs"].append(at_boundary)
    assert load_case(with_library, OF_BEADS).liquid.edge_ratio == 3.0
