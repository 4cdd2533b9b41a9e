"""Friction that grows with the sliding velocity: decks, engines, theory and case files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from studies.literature import experiments
from tests.conftest import COULOMB, origins
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.reading import find_input, load_case, read_case
from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.loads import contact_loads
from walkers.inputs.sweep import expand, load_sweep
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.walls import BOTTOM
from walkers.physics.friction import SlidingFriction
from walkers.postprocess.measure.uncertainty import uncertain_value_lines, uncertain_values
from walkers.runner.binary import find_engine
from walkers.runs.case_text import flattened
from walkers.runs.comparison import ComparedRun, compare_runs
from walkers.runs.listing import ListEntry, by_case
from walkers.second_engine import scenes
from walkers.second_engine.engine import SecondEngine
from walkers.second_engine.lines import Verdict
from walkers.second_engine.scenes import (
    AT_REST,
    DRY,
    LARGE_RADIUS,
    SMALL_RADIUS,
    Bench,
    bead_at_plane,
    bench_case,
)
from walkers.sweeps.spread import spread_sweep
from walkers.templates.deck import render_deck
from walkers.theory.motion import Walker, predict_motion

G = 9.81
AT_WALL = "contact.friction.bead_wall"
BETWEEN_BEADS = "contact.friction.bead_bead"
LAW = SlidingFriction(at_rest=0.1, rise=0.4, half_rise_velocity=0.02)
"""A friction that grows from 0.1 to 0.5, by half at 20 mm/s."""


def table(law: SlidingFriction) -> dict[str, Any]:
    """A law as a case file has it."""
    return {
        "at_rest": law.at_rest,
        "rise": law.rise,
        "half_rise_velocity": f"{law.half_rise_velocity!r} m/s",
    }


def test_the_coefficient_grows_from_rest_by_half_of_the_rise_at_its_velocity() -> None:
    speeds = np.array([0.0, 0.02, 0.06, 1e9])
    assert LAW.coefficient(speeds) == pytest.approx([0.1, 0.3, 0.4, 0.5])


def test_the_slope_is_that_of_the_coefficient_at_rest() -> None:
    small = 1e-7
    assert LAW.slope == pytest.approx((LAW.coefficient(small) - LAW.at_rest) / small, rel=1e-4)


# --- a bead that is thrown sliding ----------------------------------------------------------------


def dry_case(friction: float | Mapping[str, Any]) -> Case:
    """A dry bead on a level floor with a friction."""
    changes = {
        **DRY,
        "environment.gravity": f"{G} m/s^2",
        "contact.restitution": 0.5,
        AT_WALL: friction,
    }
    return bench_case(changes)


def thrown(bench: experiments.Bench, case: Case, speed: float, seconds: float) -> FloatArray:
    """Velocities along x and spins of a bead that is thrown sliding, a frame every ten steps.

    Returns
    -------
    ndarray, shape (frames, 3)
        Time (s), velocity (m/s), and velocity Rω of the surface (m/s).
    """
    overlap = contact_loads(case)[0].overlap
    bead = bead_at_plane(BOTTOM, -overlap, LARGE_RADIUS, velocity=(speed, 0.0, 0.0), spin=AT_REST)
    steps = 10 * round(0.1 * seconds / case.run.time_step)
    frames = experiments.run_beads(bench, [(bead, case)], steps, 10)[:, 0]
    time = 10.0 * case.run.time_step * np.arange(len(frames))
    return np.column_stack([time, frames[:, 3], LARGE_RADIUS * frames[:, 7]])


def sliding_time(law: SlidingFriction, first: float, last: FloatArray | float) -> FloatArray:
    """Time (s) in which the sliding velocity of a dry sphere falls from a first to a last one.

    From ds/dt = -7/2 μ(s) g, with μ(s) = μ₀ + Δμ s/(s + s_h): with M = μ₀ + Δμ,

        7/2 g M t = s₁ - s₂ + s_h (1 - μ₀/M) ln((M s₁ + μ₀ s_h)/(M s₂ + μ₀ s_h)).
    """
    most = law.at_rest + law.rise
    threshold = law.at_rest * law.half_rise_velocity
    logarithm = np.log((most * first + threshold) / (most * last + threshold))
    growing = law.half_rise_velocity * (1.0 - law.at_rest / most) * logarithm
    return np.asarray((first - last + growing) / (3.5 * G * most))


def test_a_thrown_bead_slows_down_as_the_closed_form_says(bench: experiments.Bench) -> None:
    """The times at which it slides at 45, 30, 15 and 5 mm/s agree within 0.1 %."""
    stopping = float(sliding_time(LAW, 0.05, 0.0))
    time, velocity, surface = thrown(bench, dry_case(table(LAW)), 0.05, 1.2 * stopping).T
    speeds = np.array([0.045, 0.03, 0.015, 0.005])
    sliding = velocity - surface
    measured = np.interp(-speeds, -sliding, time)
    assert measured == pytest.approx(sliding_time(LAW, 0.05, speeds), rel=1e-3)


def test_a_thrown_bead_rolls_after_the_time_of_the_closed_form(bench: experiments.Bench) -> None:
    """It then rolls at 5/7 of its speed, whatever the friction."""
    stopping = float(sliding_time(LAW, 0.05, 0.0))
    time, velocity, surface = thrown(bench, dry_case(table(LAW)), 0.05, 1.2 * stopping).T
    sliding = velocity - surface
    rolls = time[np.argmax(sliding < 1e-5)]
    assert rolls == pytest.approx(stopping, rel=5e-3)  # a frame is 0.2 % of it
    assert velocity[-1] == pytest.approx(5.0 / 7.0 * 0.05, rel=1e-3)


def test_the_energy_of_a_sliding_bead_only_falls(bench: experiments.Bench) -> None:
    """Kinetic energy of motion and rotation, m v²/2 + m (Rω)²/5, from frame to frame."""
    _, velocity, surface = thrown(bench, dry_case(table(LAW)), 0.05, 0.01).T
    energy = velocity**2 / 2.0 + surface**2 / 5.0
    assert energy[-1] < 0.75 * energy[0]
    assert np.diff(energy).max() < 1e-6 * energy[0]


def test_without_a_rise_friction_is_that_of_coulomb_byte_for_byte(
    bench: experiments.Bench,
) -> None:
    no_rise = SlidingFriction(at_rest=0.2, rise=0.0, half_rise_velocity=0.02)
    by_law = thrown(bench, dry_case(table(no_rise)), 0.05, 0.01)
    by_number = thrown(bench, dry_case(0.2), 0.05, 0.01)
    assert by_law.tobytes() == by_number.tobytes()


def test_a_contact_that_sticks_does_not_feel_the_rise(bench: experiments.Bench) -> None:
    """A bead that is set down rolling, and never slides, moves as by Coulomb's law."""
    case = dry_case(0.1)
    overlap = contact_loads(case)[0].overlap
    spin = (0.0, 0.01 / SMALL_RADIUS, 0.0)
    bead = bead_at_plane(BOTTOM, -overlap, SMALL_RADIUS, velocity=(0.01, 0.0, 0.0), spin=spin)
    by_law = experiments.run_beads(bench, [(bead, dry_case(table(LAW)))], 2000, 10)
    by_number = experiments.run_beads(bench, [(bead, case)], 2000, 10)
    assert by_law.tobytes() == by_number.tobytes()


@pytest.fixture
def growing_scenes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Bench:
    """A bench whose scenes have a friction that grows with the velocity."""
    for key, friction in scenes._GROWING_FRICTION.items():
        monkeypatch.setitem(scenes._FULL, key, friction)
    return Bench(find_engine(), tmp_path)


def test_a_restart_changes_no_force(growing_scenes: Bench) -> None:
    lines = list(scenes.restart_lines(growing_scenes))
    assert [line.verdict for line in lines] == [Verdict.PASS] * 4


def test_two_ranks_have_the_forces_of_one(growing_scenes: Bench) -> None:
    lines = list(scenes.rank_lines(growing_scenes))
    assert [line.verdict for line in lines] == [Verdict.PASS] * 2


# --- walkers --------------------------------------------------------------------------------------

WALKER = {
    AT_WALL: 0.255,
    BETWEEN_BEADS: {"at_rest": 0.029, "rise": 0.527, "half_rise_velocity": "86 mm/s"},
    "liquid.edge_ratio": 0.0,
    "contact.rolling_friction": 0.0,
    "dimers.replicates": 2,
}
"""Changes of ``fig1b``: a friction between the beads that grows with the velocity.

Edges of menisci do not resist, so that friction alone differs from Coulomb's law.
"""


def test_the_second_engine_leaves_out_the_growth_with_the_friction() -> None:
    """A dry bead that slides without friction keeps its velocity."""
    case = dry_case(table(LAW))
    overlap = contact_loads(case)[0].overlap
    start = np.array([[0.0, 0.0, LARGE_RADIUS - overlap, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0]])
    engine = SecondEngine(
        case, np.array([LARGE_RADIUS]), start, walls=[BOTTOM], without=["friction", "drive"]
    )
    (last,) = engine.run(1000, 1000)[-1]
    assert last[3] == pytest.approx(0.05, rel=1e-12)


@pytest.mark.parametrize("growing", [BETWEEN_BEADS, AT_WALL])
def test_theory_and_engine_agree_on_a_walker(growing: str, in_folder: Path) -> None:
    """Within 3 %: the theory has rigid beads, the engine softened ones.

    At 8 g, both contacts of the beads with the wall slide too.
    """
    changes = {
        BETWEEN_BEADS: 0.11,
        AT_WALL: 0.2,
        growing: {"at_rest": 0.08, "rise": 0.3, "half_rise_velocity": "20 mm/s"},
        "liquid.edge_ratio": 0.0,
        "contact.rolling_friction": 0.0,
        "dimers.replicates": 2,
        "drive.peak_acceleration": "8 g",
    }
    case = load_case("fig1b", changes)
    motion = predict_motion(Walker.of_case(case), 80.0, case.excitation.peak_acceleration)
    velocity = walkers.run(case, Path("runs"), progress=False).result["velocity"]
    assert velocity == pytest.approx(motion.velocity[0], rel=0.03)


def test_a_walker_whose_beads_slide_easily_at_rest_walks_slower_at_weak_drives(
    in_folder: Path,
) -> None:
    """Measured by the theory: 0.67 at 3 g, where Coulomb's law has 1.5 mm/s."""
    viscous = {"liquid.viscosity_ratio": 2.46, "drive.peak_acceleration": "3 g"}
    case = load_case("fig1b", {**WALKER, **viscous, "drive.frequency": "60 Hz"})
    velocity = walkers.run(case, Path("runs"), progress=False).result["velocity"]
    assert velocity == pytest.approx(0.69e-3, rel=0.05)


def test_the_deck_has_both_numbers_as_parameters() -> None:
    text = render_deck(load_case("fig1b", WALKER)).text
    assert "variable        friction_rise_bead_bead string 0.527" in text
    assert "variable        friction_velocity_bead_bead string 0.086" in text
    assert "frictionRise peratomtypepair 2 ${friction_rise_bead_bead} 0.0 0.0 0.0" in text


def test_a_deck_by_coulombs_law_does_not_know_the_rise() -> None:
    assert "Rise" not in render_deck(load_case("fig1b", COULOMB)).text


def test_a_fast_rise_shortens_the_time_step() -> None:
    """20/(7/2 μ'N/m) with μ' = 0.3/30 µm/s at the wall of the small bead, whose load is 38 µN.

    Its mass is 0.134 mg; with its weight at 1 + 4 g the load is 44.6 µN.
    """
    fast = {"at_rest": 0.1, "rise": 0.3, "half_rise_velocity": "0.03 mm/s"}
    case = load_case("fig1b", {AT_WALL: fast})
    mass = 4000.0 * 4.0 / 3.0 * np.pi * 0.2e-3**3
    load = 38.03e-6 + mass * (9.81 + 4.0 * 9.8)
    expected = 20.0 / (3.5 * 1e4 * load / mass)
    assert limits_of(case).friction == pytest.approx(expected, rel=1e-3)
    assert case.run.time_step <= 0.4 * limits_of(case).friction


@pytest.mark.parametrize("large", [0.2e-3, 0.3e-3], ids=["equal radii", "unequal radii"])
def test_a_fast_rise_between_beads_shortens_the_time_step(large: float) -> None:
    """20/(7/2 μ'N (1/m₁ + 1/m₂)) with μ' = 0.3/30 µm/s between the beads, 4πγR* + m₁ a of load.

    A little liquid between surfaces that touch pulls with 4πγR*, γ = 19.2 mN/m. The limit is that
    of the large bead, whose weight m₁ a at 1 + 4 g is larger.
    """
    fast = {"at_rest": 0.1, "rise": 0.3, "half_rise_velocity": "0.03 mm/s"}
    changes = {
        "dimers.radii": [f"{large!r} m", "0.2 mm"],
        BETWEEN_BEADS: fast,
        AT_WALL: 0.2,
        "liquid.law": "rabinovich",
        "liquid.volume_fraction": 1e-8,
    }
    case = load_case("fig1b", changes)
    small = 0.2e-3
    large_mass = 4000.0 * 4.0 / 3.0 * np.pi * large**3
    small_mass = 4000.0 * 4.0 / 3.0 * np.pi * small**3
    pull = 4.0 * np.pi * 0.0192 * large * small / (large + small)
    load = pull + large_mass * (9.81 + 4.0 * 9.8)
    expected = 20.0 / (3.5 * 1e4 * load * (1.0 / large_mass + 1.0 / small_mass))
    assert limits_of(case).friction == pytest.approx(expected, rel=1e-4)


def test_without_a_rise_friction_limits_no_time_step() -> None:
    assert limits_of(load_case("fig1b", COULOMB)).friction == np.inf


# --- case files -----------------------------------------------------------------------------------


def test_a_key_of_the_table_changes_alone() -> None:
    case = load_case("fig1b", {**WALKER, f"{BETWEEN_BEADS}.rise": 0.4})
    assert case.contact.friction.between_beads == SlidingFriction(0.029, 0.4, 0.086)


def test_changes_of_a_case_leave_the_tables_of_the_caller_as_they_are() -> None:
    given = table(LAW)
    load_case("fig1b", {BETWEEN_BEADS: given, f"{BETWEEN_BEADS}.rise": 0.3})
    assert given == table(LAW)


def test_a_number_replaces_a_table() -> None:
    case = load_case("fig1b", {**WALKER, BETWEEN_BEADS: 0.11})
    assert case.contact.friction.between_beads == SlidingFriction(0.11)


def keys_of(place: str, law: SlidingFriction) -> dict[str, Any]:
    """The changes of a case that give all keys of a law at a place."""
    return {f"{place}.{part}": value for part, value in table(law).items()}


REPLACES = "give all keys of the table that replaces it: contact.friction."
"""Part of the message about some keys of a table in the place of a number."""


@pytest.mark.parametrize(
    ("case", "changes", "message"),
    [
        pytest.param(
            "climber",
            {f"{AT_WALL}.at_rest": 0.1},
            f"{AT_WALL}.at_rest = 0.1: {AT_WALL} is the number 0.5 here; {REPLACES}bead_wall"
            ".at_rest, .rise, .half_rise_velocity",
            id="number of the case",
        ),
        pytest.param(
            "fig1b",
            {BETWEEN_BEADS: 0.1, f"{BETWEEN_BEADS}.rise": 1},
            f"{BETWEEN_BEADS}.rise = 1: {BETWEEN_BEADS} is the number 0.1 here; {REPLACES}",
            id="number beside it",
        ),
        pytest.param(
            "fig1b",
            {f"{BETWEEN_BEADS}.rise": 1, BETWEEN_BEADS: 0.1},
            f"{BETWEEN_BEADS}.rise = 1: {BETWEEN_BEADS} is the number 0.1 here; {REPLACES}",
            id="number after it",
        ),
        pytest.param(
            "fig1b",
            {BETWEEN_BEADS: 0.1, **keys_of(BETWEEN_BEADS, LAW)},
            "is given as the number 0.1 too; expected either of them",
            id="number and table",
        ),
        pytest.param(
            "fig1b",
            {f"{AT_WALL}.rise": 1},
            f"{AT_WALL}.at_rest: missing; without the table, {AT_WALL} is the number 0.2: "
            f"{REPLACES}",
            id="number of the library",
        ),
    ],
)
def test_a_part_of_a_table_in_the_place_of_a_number_is_refused(
    case: str, changes: Mapping[str, Any], message: str
) -> None:
    with pytest.raises(InputError) as error:
        load_case(case, changes)
    assert message in str(error.value)


@pytest.mark.parametrize("case", ["climber", "fig1b"])
def test_all_keys_of_a_table_replace_the_number(case: str) -> None:
    """That of the case ``climber``, and that of the library for ``fig1b``."""
    changed = load_case(case, keys_of(AT_WALL, LAW))
    assert changed.contact.friction.at_walls == LAW


def test_a_part_of_a_table_counts_wherever_the_table_is_among_the_changes() -> None:
    case = load_case("fig1b", {f"{BETWEEN_BEADS}.rise": 0.3, BETWEEN_BEADS: table(LAW)})
    assert case.contact.friction.between_beads == LAW._replace(rise=0.3)


@pytest.mark.parametrize(
    ("case", "name", "message"),
    [
        ("climber", f"{BETWEEN_BEADS}.rise", f"{BETWEEN_BEADS} is the number 0.5 here"),
        ("fig1b", BETWEEN_BEADS, f"is a table in the case; expected {BETWEEN_BEADS}.at_rest or"),
    ],
)
def test_a_range_of_the_other_form_of_a_friction_is_refused(
    case: str, name: str, message: str
) -> None:
    document = {**read_case(find_input(case, "case")), "uncertain": {name: [0.01, 0.9]}}
    with pytest.raises(InputError) as error:
        load_case(document)
    assert f"uncertain.{name} = [0.01, 0.9]: " in str(error.value)
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        pytest.param(
            {"rise": -0.2},
            "rise = -0.2: expected at least 0: friction that falls with the velocity",
            id="weakening",
        ),
        pytest.param(
            {"half_rise_velocity": "0 mm/s"},
            'half_rise_velocity = "0 mm/s": expected a speed with its unit',
            id="no velocity",
        ),
        pytest.param(
            {"half_rise_velocity": "1.1 m/s"},
            "it must lie between 1e-06 and 1 m/s",
            id="too fast",
        ),
        pytest.param(
            {"pace": 3},
            "pace = 3: unknown key; [contact.friction.bead_bead] takes at_rest, rise, "
            "half_rise_velocity",
            id="unknown key",
        ),
        pytest.param({"at_rest": "a"}, 'at_rest = "a": expected a plain number', id="no number"),
    ],
)
def test_a_bad_table_is_refused_with_the_reason(changes: Mapping[str, Any], message: str) -> None:
    with pytest.raises(InputError) as error:
        load_case("fig1b", {BETWEEN_BEADS: {**table(LAW), **changes}})
    assert message in str(error.value)


LIBRARY = """
[materials."my ruby"]
density = { value = "4.0 g/cm^3", source = "weighed" }
roughness = { value = "20 nm", source = "mine" }

[[surface_pairs]]
materials = ["my ruby", "my ruby"]
friction = { value = 0.03, source = "a tribometer", range = [0.02, 0.05] }
friction_rise = { value = 0.5, source = "a tribometer", range = [0.3, 0.7] }
half_rise_velocity = { value = "80 mm/s", source = "a tribometer" }
"""
"""A library with a friction that grows with the velocity between two beads."""


@pytest.fixture
def own_case(tmp_path: Path) -> Path:
    """A case beside this library."""
    (tmp_path / "library.toml").write_text(LIBRARY)
    shipped = resources.files("walkers.inputs").joinpath("cases/fig1b.toml")
    text = shipped.read_text("utf-8").replace('"ruby"', '"my ruby"')
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return path


def test_a_library_gives_the_law_of_a_pair_of_surfaces(own_case: Path) -> None:
    case = load_case(own_case)
    assert case.contact.friction.between_beads == SlidingFriction(0.03, 0.5, 0.08)
    assert origins(case)[f"{BETWEEN_BEADS}.rise"].range == (0.3, 0.7)


def test_a_case_gives_a_part_of_the_law_of_a_library_itself(own_case: Path) -> None:
    case = load_case(own_case, {f"{BETWEEN_BEADS}.rise": 0.2})
    assert case.contact.friction.between_beads == SlidingFriction(0.03, 0.2, 0.08)


def test_a_number_of_a_case_replaces_the_law_of_a_library(own_case: Path) -> None:
    case = load_case(own_case, {BETWEEN_BEADS: 0.2})
    assert case.contact.friction.between_beads == SlidingFriction(0.2)


def test_a_spread_draws_the_numbers_of_a_law_from_their_ranges(own_case: Path) -> None:
    cases = list(spread_sweep(load_case(own_case), 8).cases())
    rises = [case.contact.friction.between_beads.rise for case in cases]
    assert min(rises) >= 0.3
    assert max(rises) <= 0.7
    assert len(set(rises)) == 8


def test_a_library_without_the_velocity_of_a_rise_is_refused(own_case: Path) -> None:
    library = own_case.parent / "library.toml"
    lines = [line for line in LIBRARY.splitlines() if "half_rise" not in line]
    library.write_text("\n".join(lines))
    with pytest.raises(InputError, match="friction, friction_rise and half_rise_velocity together"):
        load_case(own_case)


def test_a_library_with_the_table_of_a_case_is_refused_in_one_sentence(own_case: Path) -> None:
    library = own_case.parent / "library.toml"
    lines = [line for line in LIBRARY.splitlines() if "rise" not in line]
    text = "\n".join(lines).replace(
        'friction = { value = 0.03, source = "a tribometer", range = [0.02, 0.05] }',
        'friction = { at_rest = 0.03, rise = 0.5, half_rise_velocity = "80 mm/s" }',
    )
    library.write_text(text)
    with pytest.raises(InputError) as error:
        load_case(own_case)
    (problem,) = error.value.problems
    assert problem.key == "surface_pairs[0].friction"
    assert "keys of their own beside it, friction_rise and half_rise_velocity" in problem.expected


def test_the_roughness_of_materials_without_a_range_has_none(own_case: Path) -> None:
    assert origins(load_case(own_case))["contact.roughness.bead_bead"].range is None


def test_a_sweep_varies_the_rise() -> None:
    document = {"case": "fig1b", "set": WALKER, "axes": {f"{BETWEEN_BEADS}.rise": [0.2, 0.4]}}
    sweep = expand(document, source="test", name="test")
    rises = [case.contact.friction.between_beads.rise for case in sweep.cases()]
    assert rises == [0.2, 0.4]


def test_a_sweep_of_a_part_where_the_case_has_a_number_is_refused() -> None:
    document = {"case": "climber", "axes": {f"{BETWEEN_BEADS}.rise": [0.2, 0.4]}}
    with pytest.raises(InputError, match=f"{BETWEEN_BEADS} is the number 0.5 here"):
        expand(document, source="test", name="test")


def test_a_sweep_does_not_vary_a_friction_and_a_part_of_it() -> None:
    axes = {BETWEEN_BEADS: [0.1, 0.2], f"{BETWEEN_BEADS}.rise": [0.2, 0.4]}
    with pytest.raises(InputError, match=r"bead_bead\.rise: varies on two axes"):
        expand({"case": "fig1b", "axes": axes}, source="test", name="test")


def test_a_part_of_what_varies_in_a_sweep_cannot_be_set() -> None:
    document = {"case": "fig1b", "axes": {BETWEEN_BEADS: [0.1, 0.2]}}
    with pytest.raises(InputError, match="varies in this sweep and cannot be set"):
        load_sweep(document, {f"{BETWEEN_BEADS}.rise": 0.4})


@pytest.mark.parametrize(
    ("in_file", "changes", "expected"),
    [
        ({BETWEEN_BEADS: table(LAW)}, {BETWEEN_BEADS: 0.1}, SlidingFriction(0.1)),
        ({BETWEEN_BEADS: 0.1}, keys_of(BETWEEN_BEADS, LAW), LAW),
    ],
)
def test_a_change_of_a_sweep_replaces_the_other_form_of_a_friction(
    in_file: Mapping[str, Any], changes: Mapping[str, Any], expected: SlidingFriction
) -> None:
    (case,) = load_sweep({"case": "fig1b", "set": in_file}, changes).cases()
    assert case.contact.friction.between_beads == expected


@pytest.fixture
def case_by_coulomb(own_case: Path) -> Path:
    """A case beside a library whose friction between two beads was found with Coulomb's law."""
    library = own_case.parent / "library.toml"
    lines = [line for line in LIBRARY.splitlines() if "rise" not in line]
    library.write_text("\n".join(lines))
    return own_case


def test_a_library_by_coulombs_law_gives_no_rise(case_by_coulomb: Path) -> None:
    case = load_case(case_by_coulomb)
    assert case.contact.friction.between_beads == SlidingFriction(0.03)


def test_a_table_does_not_take_its_friction_at_rest_from_coulombs_law(
    case_by_coulomb: Path,
) -> None:
    growth = {f"{BETWEEN_BEADS}.rise": 0.4, f"{BETWEEN_BEADS}.half_rise_velocity": "80 mm/s"}
    with pytest.raises(InputError, match=r"bead_bead\.at_rest: missing"):
        load_case(case_by_coulomb, growth)


def test_a_table_without_its_velocity_is_refused(case_by_coulomb: Path) -> None:
    with pytest.raises(InputError, match=r"bead_bead\.half_rise_velocity: missing"):
        load_case(case_by_coulomb, {BETWEEN_BEADS: {"at_rest": 0.1, "rise": 0.2}})


# --- results and lists ----------------------------------------------------------------------------


def test_a_list_of_runs_shows_a_number_and_a_growing_friction_in_one_column() -> None:
    """Such as 0.1 + 0.4 v/(v + 20 mm/s)."""
    runs = []
    for name, friction in [("first", 0.25), ("second", table(LAW))]:
        case = load_case("fig1b", {AT_WALL: friction})
        entry = ListEntry(
            kind="run",
            name=name,
            case="fig1b",
            status="finished",
            directory=Path(name),
            parameters=flattened(case),
        )
        runs.append(entry)
    (runs_of_case,) = by_case(runs)
    head, first, second = runs_of_case.as_text().splitlines()
    column = head.index("friction.bead_wall")
    assert first[column:].split() == ["0.25"]
    assert second[column:].startswith("0.1 + 0.4 v/(v + 20 mm/s)")
    assert "rise" not in head


@pytest.mark.parametrize(
    ("changes", "row"),
    [
        ({AT_WALL: table(LAW)}, [AT_WALL, "0.25", "0.1 + 0.4 v/(v + 20 mm/s)", "given"]),
        (
            {AT_WALL: 0.25, BETWEEN_BEADS: 0.1},
            [BETWEEN_BEADS, "0.05 + 3.5 v/(v + 1000 mm/s)", "0.1", "calibrated / assumed / given"],
        ),
    ],
)
def test_a_comparison_shows_a_number_and_a_growing_friction_in_one_row(
    changes: Mapping[str, Any], row: list[str]
) -> None:
    first = ComparedRun("first", load_case("fig1b", {AT_WALL: 0.25}), None)
    second = ComparedRun("second", load_case("fig1b", changes), None)
    comparison = compare_runs(first, second)
    table_of_parameters, _, _ = comparison.text.partition("\n\n")
    (line,) = table_of_parameters.splitlines()[1:]
    assert re.split(" {2,}", line) == row
    assert f"{row[0]}.rise" in comparison.contents["parameters"]


def test_a_comparison_of_two_growing_frictions_shows_the_number_that_differs() -> None:
    cases = [load_case("fig1b", {AT_WALL: table(LAW._replace(rise=rise))}) for rise in (0.4, 0.5)]
    comparison = compare_runs(*[ComparedRun(str(case.name), case, None) for case in cases])
    (line,) = comparison.text.partition("\n\n")[0].splitlines()[1:]
    assert line.split() == [f"{AT_WALL}.rise", "0.4", "0.5", "given"]


@pytest.mark.parametrize(("liquid", "head"), [("Si AK5", "assumed"), ("glycerol 87 %", "guessed")])
def test_a_result_has_the_velocity_of_an_uncertain_rise(liquid: str, head: str) -> None:
    """With a liquid other than that of the calibration, it is a guess as the rise is."""
    case = load_case("fig1b", {"liquid.name": liquid})
    lines = uncertain_value_lines(uncertain_values(case.origins))
    words = " ".join(" ".join(lines).split())
    before, _, _ = words.partition("friction.bead_bead.half_rise_velocity 1 m/s")
    assert before != words
    heads = [word for word in before.split() if word in {"guessed", "calibrated", "assumed"}]
    assert heads[-1] == head


def test_a_result_has_no_velocity_of_a_rise_without_a_range() -> None:
    case = load_case("fig1b", WALKER)
    keys = [value["key"] for value in uncertain_values(case.origins)]
    assert f"{BETWEEN_BEADS}.half_rise_velocity" not in keys
