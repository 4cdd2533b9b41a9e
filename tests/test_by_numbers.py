"""Numbers worked out by hand, or by a second formula, on motions that no engine has made."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from math import exp, inf, pi, radians, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import walkers
from tests.conftest import document, make_case
from walkers.files import write_json
from walkers.inputs.axes import Range
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.loads import bridge_at_rest, contact_loads
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.drive import Harmonic, waveform
from walkers.postprocess.measure import meetings
from walkers.postprocess.measure.clusters import HeldCluster
from walkers.postprocess.measure.gait import averages, fit_slopes, settled_samples
from walkers.postprocess.measure.motion import Bridges, Group, Motion
from walkers.postprocess.measure.numbers import short_text
from walkers.postprocess.measure.piles import _of_climbs, _state_of
from walkers.postprocess.measure.uncertainty import SPREAD_NAME, bands_of, spread_of
from walkers.postprocess.measure.walking import _doubts, _posture, _scatter, _velocities, tables_of
from walkers.postprocess.show.films import speed_text
from walkers.postprocess.show.report.player import _points
from walkers.postprocess.show.scene import Scene, orientations_of, rotations_at
from walkers.runner.cost import predicted_overhead, predicted_seconds
from walkers.runner.manifest import iso_time
from walkers.runs.making import pace_in, progress_in
from walkers.runs.preview import preview_text, summarise
from walkers.templates.deck import Segment, compose, plan_of, render_deck
from walkers.templates.placement import place

FloatArray = npt.NDArray[np.float64]

LARGE = 3e-4
"""Radius of the large bead of the reference case, m."""
SMALL = 2e-4
"""Radius of its small bead, m."""
PEAK = 39.2
"""Its peak acceleration of 4 g, m/s²; g is 9.8 m/s² in this unit."""
OMEGA = 2.0 * pi * 80.0
"""Its angular frequency, 1/s."""
FLOOR = 0
SIDE = 3
"""Index of a side wall of a box."""
FEW = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
SUBSTRATE = {"material": "chromium-coated glass"}
BOX = {"shape": "box", "width": "20 mm", "height": "10 mm", **SUBSTRATE}
DIMER = {"radii": ["0.3 mm", "0.2 mm"]}
PILE: dict[str, Any] = {
    "placed": [
        {"radius": "0.5 mm", "at": ["0 mm", "0 mm", "1 mm"]},
        {"radius": "0.5 mm", "at": ["1 mm", "0 mm", "1 mm"]},
        {"radius": "0.3 mm", "at": ["2 mm", "0 mm", "1 mm"]},
        {"radius": "0.3 mm", "at": ["3 mm", "0 mm", "1 mm"]},
    ],
    "boundary": BOX,
    "run": {"duration": "0.1 s"},
}


def make_other_case(**tables: Any) -> Case:
    """Make a case of other bodies, with the liquid, the contacts and the drive of the reference."""
    reference = document(boundary={}, run={})
    del reference["dimers"]
    reference["boundary"] = SUBSTRATE
    reference["run"] = FEW
    return build_case({**reference, **tables}, name="made up")


def make_resting(case: Case, frames: int | None = None) -> Motion:
    """Make a motion in which beads stay at their starts, in some samples of a run or in all."""
    scene, placed = place((case,))
    if frames is None:
        frames = case.run.cycles * case.run.samples_per_cycle + 1
    position = np.tile([bead.centre for bead in scene.beads], (frames, 1, 1))
    at_rest = np.zeros_like(position)
    bodies = []
    for body in placed:  # beads are numbered from 1 in the engine
        bodies.append(replace(body, beads=tuple(bead - 1 for bead in body.beads)))
    return Motion(
        case=case,
        time=np.arange(frames) / (case.run.samples_per_cycle * case.excitation.frequency),
        position=position,
        velocity=at_rest,
        spin=at_rest,
        substrate=at_rest[:, 0],
        radius=np.array([bead.radius for bead in scene.beads]),
        walkers=tuple(bodies),
        frames=[(Path("made-up"), number) for number in range(frames)],
        truncated=False,
    )


def with_orientation(group: Group, orientation: FloatArray) -> Group:
    """Give walkers other orientations, rad, shape (F, W), whatever the positions of their beads."""
    turned = replace(group)
    turned.__dict__["orientation"] = orientation  # a cached property
    return turned


def with_bridges(motion: Motion, bridges: list[Bridges]) -> Motion:
    """Give a motion bridges, as if they had been read from its dumps."""
    motion.__dict__["bridges"] = bridges  # a cached property
    return motion


def make_bridges(frame: int, contacts: list[tuple[int, int, int]]) -> Bridges:
    """Make bridges of two beads and -1, or of a bead, -1 and a wall; all pull, none touches."""
    ones = np.ones(len(contacts))
    return Bridges(frame, np.array(contacts), ones, ones)


# --- cases ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("logarithmic", "median", "quarters"),
    [
        pytest.param(True, None, [0.01, 0.1**1.5, 0.1, 0.1**0.5, 1.0], id="logarithmic"),
        pytest.param(True, 0.25, [0.01, 0.05, 0.25, 0.5, 1.0], id="logarithmic about a median"),
        pytest.param(False, 0.21, [0.01, 0.11, 0.21, 0.605, 1.0], id="even about a median"),
    ],
)
def test_quarters_of_a_range(
    logarithmic: bool, median: float | None, quarters: list[float]
) -> None:
    """From 0.01 to 1; with a median, each half is distributed by itself."""
    numbers = Range(0.01, 1.0, None, logarithmic, median).quantiles(np.linspace(0.0, 1.0, 5))
    np.testing.assert_allclose(numbers, quarters, rtol=1e-12)


def sawtooth_acceleration(first: Harmonic, time: FloatArray) -> FloatArray:
    """The acceleration of a sawtooth whose first harmonic is given, m/s²."""
    total = np.zeros_like(time)
    for harmonic in waveform("sawtooth", first):
        phase = harmonic.angular_frequency * time + harmonic.phase
        total += harmonic.peak_acceleration * np.sin(phase)
    return total


def test_a_phase_of_a_waveform_is_an_earlier_start_of_the_whole() -> None:
    time = np.linspace(0.0, 0.1, 200)
    phase = radians(50.0)
    plain = Harmonic(axis="x", frequency=20.0, peak_acceleration=10.0)
    earlier = sawtooth_acceleration(plain, time + phase / (2.0 * pi * 20.0))
    shifted = sawtooth_acceleration(plain.with_values(phase=phase), time)
    np.testing.assert_allclose(shifted, earlier, atol=1e-9)
    assert np.abs(earlier).max() > 9.0


@pytest.mark.parametrize(("bead", "radius"), [(0, LARGE), (1, SMALL)], ids=["large", "small"])
def test_a_bead_on_a_slope_presses_with_a_part_of_its_weight(bead: int, radius: float) -> None:
    """At 60° with half of it, and with its capillary force: Hertz's 4/3 E* √R δ^1.5 = F.

    E* = E/(2(1 - ν²)), of 50 MPa and ν = 0.3.
    """
    case = make_case(boundary={"tilt": "60 deg"})
    modulus = 5e7 / (2.0 * (1.0 - 0.09))
    weight = 4.0 / 3.0 * pi * radius**3 * case.beads.density * case.environment.gravity
    overlap = contact_loads(case)[bead].overlap
    normal = 4.0 / 3.0 * modulus * sqrt(radius) * overlap**1.5
    pressed = normal - bridge_at_rest(case, radius, inf).pull
    assert pressed == pytest.approx(0.5 * weight, rel=1e-6)


def test_two_beads_on_a_slope_are_pressed_by_their_bridge_alone() -> None:
    """Hertz's 4/3 E* √R δ^1.5 = F with the reduced radius."""
    pair = contact_loads(make_case(boundary={"tilt": "60 deg"}))[2]
    modulus = 5e7 / (2.0 * (1.0 - 0.09))
    reduced = LARGE * SMALL / (LARGE + SMALL)
    normal = 4.0 / 3.0 * modulus * sqrt(reduced) * pair.overlap**1.5
    assert normal == pytest.approx(pair.pull)


@pytest.mark.parametrize(
    ("angle", "facing", "directions"),
    [(30.0, "both", (30.0, 210.0)), (-20.0, "left", (160.0, 160.0))],
)
def test_walkers_start_at_their_angle_to_the_left(
    angle: float, facing: str, directions: tuple[float, float]
) -> None:
    """Seen from above: those that face left, at 180°, turn the same way."""
    dimers = {
        "replicates": 2,
        "facing": facing,
        "angle": f"{angle} deg",
        "angle_spread": "0 deg",
    }
    group = make_resting(make_case(dimers=dimers)).groups[0]
    arm = group.position[0, :, 0] - group.position[0, :, 1]
    assert np.degrees(np.arctan2(arm[:, 1], arm[:, 0])) % 360.0 == pytest.approx(directions)
    np.testing.assert_allclose(np.degrees(group.orientation), angle, atol=1e-9)


@pytest.mark.parametrize(
    ("frequency", "duration", "cycles"),
    [
        pytest.param("100 Hz", "0.07 s", 7, id="7 and a rounding error"),
        pytest.param("80 Hz", "0.101 s", 9, id="8.08"),
        pytest.param("100 Hz", "0.29 s", 29, id="29 less a rounding error"),
    ],
)
def test_a_duration_is_whole_cycles(frequency: str, duration: str, cycles: int) -> None:
    """A cycle that is begun counts."""
    drive = {"frequency": frequency, "peak_acceleration": "4 g"}
    case = make_other_case(dimers=DIMER, drive=drive, run={"duration": duration})
    assert case.run.cycles == cycles


def test_measuring_begins_after_all_of_the_settling_cycles() -> None:
    """A frame in two cycles, seven cycles to settle: frame 4, of cycle 8, is the first."""
    run = {"frames_per_second": 40, "cycles": 20, "settling_cycles": 7}
    case = make_other_case(dimers=DIMER, run=run)
    assert case.run.cycles_per_sample == 2
    assert case.run.samples_per_cycle == 1
    assert case.run.settled_strobes == 4
    samples = settled_samples(make_resting(case, 11).group(0).case.run)
    assert samples.start == 4
    assert samples.stop == 10


def test_a_deck_of_several_cases_is_watched_with_the_highest_of_their_limits() -> None:
    slow = make_case(drive={"peak_acceleration": "2 g"})
    fast = make_case(drive={"peak_acceleration": "8 g"})
    limit = compose(plan_of(slow, fast)).fastest
    assert limit == render_deck(fast).fastest
    assert limit > 1.1 * render_deck(slow).fastest


def origin_of_rolling_friction(case: Case, folder: Path) -> str:
    """Where the result of a case says that its rolling friction is from."""
    values = walkers.load(case, folder).result.about["rests_on"]
    (value,) = [value for value in values if value["key"] == "contact.rolling_friction"]
    return str(value["origin"])


def test_a_result_rests_on_the_values_of_the_case_that_is_asked_for(tmp_path: Path) -> None:
    """Two cases of the same numbers share a run; one states a value that the other leaves out."""
    tables = document(run=FEW)
    del tables["contact"]["rolling_friction"]
    silent = build_case(tables, name="test")
    contact = {"rolling_friction": silent.contact.rolling_friction}
    stated = build_case(document(run=FEW, contact=contact), name="test")
    assert stated == silent
    walkers.run(silent, tmp_path)
    assert origin_of_rolling_friction(stated, tmp_path) == "given"
    assert origin_of_rolling_friction(silent, tmp_path) != "given"


# --- what is printed --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shown() -> str:
    """What ``walkers show`` prints of the reference case."""
    return preview_text(summarise(make_case()))


@pytest.mark.parametrize(
    "text",
    [
        # 4/3 π (0.3³ + 0.2³) mm³ = 0.1466 mm³, of 4000 kg/m³; 1 % of it is liquid.
        pytest.param("1 small and 1 large, 0.5864 mg, 0.1466 µL with ", id="mass"),
        pytest.param("with 0.00147 µL of liquid", id="liquid"),
        # 39.2 m/s² over ω² and ω, ω = 2π · 80 Hz = 502.65/s.
        pytest.param("amplitude 0.1551 mm, peak velocity 77.99 mm/s", id="amplitude"),
        # 0.5864 mg · 9.81 m/s².
        pytest.param("M = 0.5864 mg, weight 5.753 µN, mean radius 0.25 mm, ", id="weight"),
        # (0.3 - 0.2)/(0.3 + 0.2), and (27 - 8)/(27 + 8).
        pytest.param("sin δ = 0.2, mass asymmetry (m1 - m2)/M = 0.5429", id="asymmetry"),
    ],
)
def test_what_show_prints_of_a_case_is_in_its_units(shown: str, text: str) -> None:
    """Beads of 0.3 and 0.2 mm, 4 g at 80 Hz."""
    assert text in " ".join(shown.split())


def test_what_show_prints_of_a_bridge_is_in_its_units(shown: str) -> None:
    """Of the large bead to the substrate, with half of its 1 % of liquid, 0.565 nL.

    The largest capillary force is 4πγR; the rupture distance and the overlap are in µm and nm.
    """
    case = make_case()
    (line,) = [line for line in shown.splitlines() if "bead 1 on substrate" in line]
    force = 4.0 * pi * case.liquid.surface_tension * LARGE
    assert f" {1e6 * force:.4g} µN" in line
    assert " 0.565 nL" in line
    assert f" {1e6 * bridge_at_rest(case, LARGE, inf).rupture:.3g} µm " in line
    assert line.endswith(f" {1e9 * contact_loads(case)[0].overlap:.4g} nm")


def rayleigh_limit(case: Case) -> str:
    """What ``walkers show`` prints of the Rayleigh limit of the time step."""
    lines = preview_text(summarise(case)).splitlines()
    (line,) = [line for line in lines if line.startswith("  rayleigh")]
    return line


def test_what_show_prints_of_walkers_is_that_auto_takes_up_to_0_4_of_the_rayleigh_limit() -> None:
    """They do not collide."""
    assert rayleigh_limit(make_case()).endswith('("auto": at most 0.4)')


def test_what_show_prints_of_loose_beads_is_that_auto_takes_up_to_0_2_of_it() -> None:
    assert rayleigh_limit(make_other_case(**PILE)).endswith('("auto": at most 0.2)')


def test_measuring_takes_as_long_as_a_run_has_places_of_beads_in_its_first_attempt() -> None:
    """Of twelve beads in 20 frames of each of 12 cycles; the beads of a pile have no tables.

    30 µs for a place of a bead, and 37 ms for each of two cases with a tabulated bridge law.
    """
    law = {"liquid.law": "rabinovich"}
    dimers = load_case("fig1b", law)
    pile = changed_case(make_other_case(**PILE), law)
    assert dimers.count == 12
    assert dimers.run.attempts == (12, 24, 60)
    seconds = 2 * 0.037 + 30e-6 * 12 * 20 * 12
    assert predicted_overhead([dimers, pile]) == pytest.approx(seconds)


def test_a_pile_is_predicted_to_rest_three_times() -> None:
    """Each time for 0.05 s, which are 4 cycles of 5000 steps of 2.5 us, in a start of the engine.

    A start takes 0.04 s, and a step of four beads 1.5 µs and 4/10.7 µs.
    """

    def seconds(longest_settling: str) -> float:
        run = {"duration": "0.1 s", "time_step": "2.5 us", "longest_settling": longest_settling}
        return predicted_seconds(make_other_case(**(PILE | {"run": run})))

    seconds_of_rest = 3 * (0.04 + 4 * 5000 * (1.5e-6 + 4 / 10.7e6))
    assert seconds("0.2 s") - seconds("0 s") == pytest.approx(seconds_of_rest)


def test_a_tenth_of_runs_that_may_end_early_is_predicted_to_need_each_further_attempt() -> None:
    """Six dimers take 0.9 + 6 * 0.22 µs a step, and a start of the engine 0.04 s.

    Attempts have 12, 24 and 60 cycles of 3200 steps: 12 + 2.4 + 6 cycles.
    """
    case = load_case("fig1b")
    assert case.run.attempts == (12, 24, 60)
    assert case.run.steps_per_cycle == 3200
    seconds = 0.04 + 20.4 * 3200 * (0.9e-6 + 6 * 0.22e-6)
    assert predicted_seconds(case) == pytest.approx(seconds)


def test_four_processes_are_predicted_to_compute_a_pile_3_7_times_as_fast_as_one() -> None:
    """The part of a step that each bead takes, 1/10.7 µs, in 8 cycles of 5000 steps."""

    def seconds(ranks: int) -> float:
        run = {"duration": "0.1 s", "time_step": "2.5 us", "longest_settling": "0 s"}
        return predicted_seconds(make_other_case(**(PILE | {"run": run | {"ranks": ranks}})))

    of_beads = 8 * 5000 * 4 / 10.7e6
    assert seconds(1) - seconds(4) == pytest.approx(of_beads * (1.0 - 1.0 / 3.7))


CONTINUED = Segment(1104, 1200, 0)
"""The last steps of a run of 1200 steps, of which 1104 had been done by an earlier call."""


def progress_of_continued(step: int, seconds: float) -> Any:
    """Progress of the reference case, of 20 cycles in 1200 steps, after so many seconds."""
    case = make_case(
        run={"time_step": "250 us", "allow_unstable": True, "cycles": 20, "settling_cycles": 2}
    )
    assert case.run.steps == 1200
    pace = pace_in(case, [], step - CONTINUED.begin, seconds)
    return progress_in(case, 20, CONTINUED, step, pace)


def test_the_time_left_of_a_run_that_goes_on_is_that_of_the_steps_that_are_left() -> None:
    """48 of 1200 steps took 1080 s; with 3 % of 1200 as if they had taken none, they are 84.

    They count less as 4 % of the work is done, exp(-4/20) times: so many seconds are left.
    """
    progress = progress_of_continued(1152, 1080.0)
    seconds = 48 * 1080.0 / (48 + exp(-0.2) * 36)
    assert progress == (0.96, f"96 %, {seconds / 60:.0f} min left, 0.240 s simulated", "96 %")


def test_only_a_run_of_which_nothing_is_done_is_starting() -> None:
    """The last steps of a run are predicted to take less than a second."""
    assert progress_of_continued(1104, 0.0).text == "92 %, 0 s left, 0.230 s simulated"
    case = make_case()
    begun = progress_in(case, case.run.cycles, Segment(0, case.run.steps, 0), 0, pace_in(case, []))
    assert begun.stage == "starting"


def test_a_run_that_may_end_early_is_in_its_longest_attempt_after_the_shorter_ones() -> None:
    """Half way through 60 cycles, after attempts of 12 and 24 cycles."""
    case = load_case("fig1b")
    run = case.run
    whole = Segment(0, run.steps, 0)
    progress = progress_in(case, run.cycles, whole, run.steps // 2, pace_in(case, []))
    assert progress.share == pytest.approx((12 + 24 + 30) / (12 + 24 + 60))
    assert "at most" in progress.text


def test_steps_in_which_a_pile_comes_to_rest_are_part_of_its_work() -> None:
    """At most three segments of 0.05 s; once the drive has begun after two, these are counted."""
    run = {"duration": "0.1 s", "time_step": "2.5 us"}
    case = make_other_case(**(PILE | {"run": run}))
    driven = case.run.steps
    pace = pace_in(case, [])
    resting = progress_in(case, case.run.cycles, Segment(20_000, 40_000, None), 30_000, pace)
    begun = progress_in(case, case.run.cycles, Segment(40_000, 60_000, 40_000), 50_000, pace)
    assert resting.share == pytest.approx(30_000 / (60_000 + driven))
    assert resting.text.startswith("coming to rest, ")
    assert begun.share == pytest.approx(50_000 / (40_000 + driven))


@pytest.fixture
def in_tokyo(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Local time nine hours before UTC."""
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


def test_times_of_a_manifest_are_utc(in_tokyo: None) -> None:
    assert iso_time(1e9) == "2001-09-09T01:46:40Z"


# --- walkers ----------------------------------------------------------------------------------


def test_the_scatter_is_the_deviation_of_a_sample() -> None:
    """Of 1, 2 and 4: the squares (16 + 1 + 25)/9 over two are 7/3."""
    assert _scatter(np.array([1.0, 2.0, 4.0])) == pytest.approx(sqrt(7.0 / 3.0))


def test_a_single_walker_has_no_scatter() -> None:
    assert np.isnan(_scatter(np.array([1.0])))


def test_slopes_are_those_of_a_fit_of_a_line() -> None:
    """Of values about 1000 with a noise of 0.1, as NumPy fits them."""
    time = np.linspace(3.0, 4.0, 30)
    noise = 0.1 * np.random.default_rng(5).standard_normal((30, 2))
    values = np.outer(time, [2.0, -1.0]) + noise + 1e3
    first = np.polyfit(time - 3.5, values[:, 0] - 1e3, 1)[0]
    second = np.polyfit(time - 3.5, values[:, 1] - 1e3, 1)[0]
    np.testing.assert_allclose(fit_slopes(time, values), [first, second], rtol=1e-9)


WALKERS = {
    "make": np.zeros(5, dtype=int),
    "facing": np.array([1, 1, 1, -1, -1]),
    "start_angle": np.zeros(5),
    "velocity": np.array([1e-3, 2e-3, 4e-3, 5e-3, 8e-3]),
    "axial_velocity": np.array([1.1e-3, 2.1e-3, 4.1e-3, -5.1e-3, -8.1e-3]),
    "lateral_velocity": np.array([3e-5, 1e-5, -2e-5, 4e-5, -6e-5]),
    "separated_fraction": np.array([0.0, 0.02, 0.04, 0.0, 0.04]),
    "orientation_end": np.array([0.1, -0.2, 0.3, 0.0, -0.4]),
    "turned_at": np.array([np.nan, np.nan, 2.0, np.nan, 1.0]),
    "steady": np.array([True, True, False, True, False]),
}
"""Three walkers that face right and two that face left; no two of their velocities are the same."""


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("velocity", 4e-3),
        # Deviations from 4 mm/s: -3, -2, 0, 1, 4.
        ("scatter", sqrt((9 + 4 + 0 + 1 + 16) / 4.0) * 1e-3),
        ("smallest", 1e-3),
        ("largest", 8e-3),
        ("right_facing", 7e-3 / 3.0),
        ("left_facing", 6.5e-3),
        ("right_scatter", sqrt(7.0 / 3.0) * 1e-3),
        ("left_scatter", sqrt(4.5) * 1e-3),
        # Of those that face right: over all, both ways would cancel.
        ("axial_velocity", 7.3e-3 / 3.0),
        ("axial_left_facing", -6.6e-3),
        ("lateral_velocity", 0.0),
        ("separated_fraction", 0.02),
        ("orientation_end", -0.04),
        ("orientation_smallest", -0.4),
        ("orientation_largest", 0.3),
        ("walkers", 5),
        ("facing_right", 3),
        ("facing_left", 2),
        ("steady", 3),
        ("turned_round", 2),
    ],
)
def test_the_numbers_of_walkers_of_both_headings(name: str, number: float) -> None:
    assert _velocities(WALKERS, make_case())[name] == pytest.approx(number, abs=1e-12)


def test_both_headings_are_one_on_a_level_substrate_under_a_sine() -> None:
    """The steady walkers, at 1, 2 and 5 mm/s, are not: they depend on their start."""
    numbers = _velocities(WALKERS, make_case())
    assert not numbers["facings_differ"]
    assert numbers["depends_on_start"]
    assert not numbers["came_apart"]


def test_on_a_tray_axial_velocities_of_both_ways_cancel() -> None:
    case = make_case(
        dimers={"replicates": 5, "meet": True, "spacing": "2 mm"},
        run={"cycles": 6, "settling_cycles": 2},
    )
    numbers = _velocities(WALKERS, case)
    mean = (1.1 + 2.1 + 4.1 - 5.1 - 8.1) * 1e-3 / 5.0
    assert numbers["axial_velocity"] == pytest.approx(mean)
    assert not numbers["depends_on_start"]


def test_on_a_slope_means_are_those_of_the_walkers_that_face_up() -> None:
    """The three that face right."""
    numbers = _velocities(WALKERS, make_case(boundary={"tilt": "10 deg"}))
    assert numbers["velocity"] == pytest.approx(7e-3 / 3.0)
    assert numbers["smallest"] == pytest.approx(1e-3)
    assert numbers["largest"] == pytest.approx(4e-3)
    assert numbers["axial_velocity"] == pytest.approx(7.3e-3 / 3.0)
    assert numbers["facings_differ"]


def test_walkers_that_turned_to_the_other_side_before_the_start_face_there() -> None:
    """The second one starts at 170° to the right, the fourth at -170° to the left."""
    angles = np.radians([0.0, 170.0, 0.0, -170.0, 0.0])
    numbers = _velocities({**WALKERS, "start_angle": angles}, make_case())
    assert numbers["right_facing"] == pytest.approx((1e-3 + 4e-3 + 5e-3) / 3.0)
    assert numbers["left_facing"] == pytest.approx((2e-3 + 8e-3) / 2.0)
    assert numbers["facing_right"] == 3
    assert numbers["facing_left"] == 2


@pytest.mark.parametrize(
    ("velocities", "depends"),
    [
        pytest.param([1e-3, 1.04e-3, 9e-3, 1.02e-3, 9e-3], False, id="within 5 %"),
        pytest.param([1e-3, 1.08e-3, 9e-3, 1.02e-3, 9e-3], True, id="by more"),
        pytest.param([1e-6, 9e-6, 9e-3, 5e-6, 9e-3], False, id="at rest"),
    ],
)
def test_steady_walkers_that_differ_depend_on_their_start(
    velocities: list[float], depends: bool
) -> None:
    """The third and the last one are not steady: they do not count."""
    numbers = _velocities({**WALKERS, "velocity": np.array(velocities)}, make_case())
    assert numbers["depends_on_start"] == depends


@pytest.mark.parametrize(
    ("kinds", "depends"),
    [
        pytest.param([0, 0, 0, 1, 1], False, id="of another kind"),
        pytest.param([0, 0, 0, 0, 0], True, id="of the same kind"),
    ],
)
def test_kinds_of_walkers_differ_without_depending_on_their_start(
    kinds: list[int], depends: bool
) -> None:
    """The fourth walker is twice as fast as the other steady ones."""
    table = {
        **WALKERS,
        "velocity": np.array([1e-3, 1e-3, 9e-3, 2e-3, 9e-3]),
        "make": np.array(kinds),
    }
    assert _velocities(table, make_case())["depends_on_start"] == depends


def test_walkers_of_two_tones_have_a_velocity_for_each_heading() -> None:
    """The tones push one way: walkers of one heading are alike, those of the other are faster."""
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g"},
    ]
    case = make_other_case(dimers={**DIMER, "replicates": 5}, drive={"harmonics": tones})
    table = {**WALKERS, "velocity": np.array([1e-3, 1e-3, 1e-3, 2e-3, 2e-3])}
    numbers = _velocities(table, case)
    assert numbers["facings_differ"]
    assert not numbers["depends_on_start"]


@pytest.fixture
def postures() -> dict[str, Any]:
    """Numbers of five walkers on a slope, which turn evenly to 0°, 10°, 100°, 20° and 120°.

    The third and the last have turned over, after 2 and 1 s.
    """
    case = make_case(boundary={"tilt": "10 deg"}, dimers={"replicates": 5}, run=FEW)
    (group,) = make_resting(case).groups
    angles = np.radians([0.0, 10.0, 100.0, 20.0, 120.0])
    turned = with_orientation(group, np.linspace(0.0 * angles, angles, len(group.time)))
    axial = np.array([1e-3, 1e-6, -1e-3, 3e-6, 4e-6])
    return _posture([turned], {**WALKERS, "axial_velocity": axial, "orientation_end": angles})


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("upright", 1),
        ("leaning", 2),  # at 10° one still turns
        ("turned_over", 2),
        ("turned_first", 1.0),
        ("turned_last", 2.0),
        ("ends_within", radians(20.0)),  # of those that have not turned over
        ("climbing", 3),  # at 1 mm/s, 3 µm/s and 4 µm/s
        ("descending", 1),  # at -1 mm/s; at 1 µm/s one is at rest
    ],
)
def test_postures_and_ways_of_walkers_on_a_slope(
    postures: dict[str, Any], name: str, number: float
) -> None:
    assert postures[name] == pytest.approx(number)


SOUND = {
    "walkers": 3,
    "steady": 3,
    "meets": False,
    "came_apart": False,
    "separated_fraction": 0.0,
    "depends_on_start": False,
    "walkers_met": False,
}


@pytest.mark.parametrize(
    ("numbers", "text"),
    [
        pytest.param(
            {"steady": 2},
            "1 of 3 walkers is not steady: the velocity depends on the length of the run",
            id="one is not steady",
        ),
        pytest.param(
            {"steady": 1},
            "2 of 3 walkers are not steady: the velocity depends on the length of the run",
            id="two are not steady",
        ),
        pytest.param(
            {"steady": 1, "came_apart": True, "separated_fraction": 0.254},
            "walkers came apart: beads are beyond the rupture distance for 25 % of the time",
            id="they came apart",
        ),
        pytest.param(
            {"depends_on_start": True},
            "steady copies differ by more than 5 %: the velocity depends on the start",
            id="copies differ",
        ),
        pytest.param(
            {"walkers_met": True},
            "walkers came close to each other and are not independent: increase the spacing",
            id="they met",
        ),
    ],
)
def test_reasons_to_doubt_a_velocity(numbers: dict[str, Any], text: str) -> None:
    assert list(_doubts({**SOUND, **numbers}, changes=False)) == [text]


@pytest.mark.parametrize(
    ("numbers", "changes"),
    [
        pytest.param({}, False, id="sound"),
        pytest.param({"steady": 1}, True, id="not steady under a drive that changes"),
        pytest.param({"steady": 1, "meets": True}, False, id="not steady as walkers meet"),
        pytest.param({"depends_on_start": True}, True, id="copies under a drive that changes"),
        pytest.param({"walkers_met": True, "meets": True}, False, id="they were to meet"),
    ],
)
def test_no_reasons_to_doubt_a_velocity(numbers: dict[str, Any], changes: bool) -> None:
    assert list(_doubts({**SOUND, **numbers}, changes=changes)) == []


def test_a_walker_is_separated_where_any_of_its_pairs_is() -> None:
    """The last bead of three goes away for the last ten of 40 measured samples."""
    chain = {"arrangement": "chain", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"], "replicates": 1}
    motion = make_resting(make_other_case(clusters=[chain]))
    position = motion.position.copy()
    position[50:, 2, 0] -= 1e-3
    (group,) = replace(motion, position=position).groups
    separated = tables_of(group)["walkers"]["separated_fraction"]
    assert separated == pytest.approx(10.0 / 40.0)


@pytest.mark.parametrize(
    ("end", "turned_at"),
    [
        pytest.param(180.0, np.nan, id="by 80°"),
        pytest.param(100.0, np.nan, id="not at all"),
        # By 26.7° in a cycle: by 106.7° after four of six.
        pytest.param(-60.0, 4.0 / 80.0, id="by -160°"),
    ],
)
def test_a_walker_has_turned_over_90_degrees_from_its_start(end: float, turned_at: float) -> None:
    """It starts at 100° to the axis."""
    case = make_case(dimers={"angle": "100 deg"}, run=FEW)
    (group,) = make_resting(case).groups
    orientation = np.radians(np.linspace(100.0, end, len(group.time)))
    turned = with_orientation(group, orientation[:, None])
    assert turned.turned_at == pytest.approx(turned_at, nan_ok=True)


def test_the_work_of_two_harmonics_with_phases() -> None:
    """The force M a sin(ωt + φ) does the work π M a b in a period on a motion -b cos(ωt + φ).

    The second harmonic, of half the acceleration and along y, has two periods in a cycle.
    """
    first = {"frequency": "80 Hz", "peak_acceleration": "4 g", "phase": "70 deg"}
    second = {"frequency": "160 Hz", "peak_acceleration": "2 g", "phase": "-40 deg", "axis": "y"}
    case = make_other_case(
        dimers={**DIMER, "replicates": 1},
        drive={"harmonics": [first, second]},
        run={**FEW, "samples_per_cycle": 40},
    )
    motion = make_resting(case)
    along_x = OMEGA * motion.time + radians(70.0)
    along_y = 2.0 * OMEGA * motion.time + radians(-40.0)
    position = motion.position.copy()
    position[..., 0] -= 1e-4 * np.cos(along_x)[:, None]
    position[..., 1] -= 3e-5 * np.cos(along_y)[:, None]
    velocity = motion.velocity.copy()
    velocity[..., 0] += 1e-4 * OMEGA * np.sin(along_x)[:, None]
    velocity[..., 1] += 3e-5 * 2.0 * OMEGA * np.sin(along_y)[:, None]
    (group,) = replace(motion, position=position, velocity=velocity).groups
    mass = 4.0 / 3.0 * pi * (LARGE**3 + SMALL**3) * case.beads.density
    work = pi * mass * (PEAK * 1e-4 + 2.0 * PEAK / 2.0 * 3e-5)
    np.testing.assert_allclose(averages(group).work, np.full((6, 1), work), rtol=1e-3)


def test_a_ramp_down_and_up_has_two_thresholds() -> None:
    """The short text has both of them instead of the mean velocity."""
    numbers = {
        "velocity": 1e-3,
        "walkers": 1,
        "stops_at": 7.84,
        "starts_at": 8.82,
        "goes_uphill": False,
    }
    assert short_text(numbers) == "stops at 0.8 g, starts at 0.9 g"


# --- bands ------------------------------------------------------------------------------------


def write_band(run: Path, varied: list[dict[str, Any]], draws: int = 8) -> None:
    """Write that the velocity was between 1 and 2 in draws of some varied values."""
    folder = spread_of(run)
    folder.mkdir(exist_ok=True)
    band = {"low": 1.0, "high": 2.0, "points": draws}
    write_json(folder / SPREAD_NAME, {"varied": varied, "bands": {"velocity": band}})


def varied_value(key: str) -> dict[str, Any]:
    """A value that is varied between 0 and 1."""
    return {"key": key, "range": [0.0, 1.0]}


def test_a_result_without_draws_has_no_band(tmp_path: Path) -> None:
    assert bands_of(tmp_path / "run", [], {"velocity": 1.5}) == {}


@pytest.mark.parametrize(
    ("own", "low", "high"),
    [
        pytest.param(1.5, 1.0, 2.0, id="within"),
        pytest.param(2.5, 1.0, 2.5, id="above"),
        pytest.param(0.5, 0.5, 2.0, id="below"),
        pytest.param(None, 1.0, 2.0, id="none"),
        pytest.param(inf, 1.0, 2.0, id="infinite"),
    ],
)
def test_a_band_holds_the_result(
    tmp_path: Path, own: float | None, low: float, high: float
) -> None:
    write_band(tmp_path / "run", [])
    bands = bands_of(tmp_path / "run", [], {"velocity": own})
    assert bands == {
        "velocity_low": low,
        "velocity_high": high,
        "velocity_draws": 8,
        "velocity_approximate": False,
    }


def test_a_band_over_other_values_than_those_that_vary_does_not_count(tmp_path: Path) -> None:
    write_band(tmp_path / "run", [])
    varied = [varied_value("liquid.volume_fraction")]
    assert bands_of(tmp_path / "run", varied, {"velocity": 1.5}) == {}


@pytest.mark.parametrize(
    ("draws", "values", "is_approximate"),
    [(5, 1, True), (6, 1, False), (6, 2, False), (8, 3, True), (9, 3, False)],
)
def test_a_band_needs_three_draws_of_each_varied_value_and_six_in_all(
    tmp_path: Path, draws: int, values: int, is_approximate: bool
) -> None:
    varied = [varied_value(str(number)) for number in range(values)]
    write_band(tmp_path / "run", varied, draws)
    bands = bands_of(tmp_path / "run", varied, {"velocity": 1.5})
    assert bands["velocity_approximate"] == is_approximate


# --- walkers that meet ------------------------------------------------------------------------


def test_a_tray_that_has_hardly_been_driven_has_meetings_alone() -> None:
    """Two frames; in the first one a bridge joins two of three dimers."""
    case = make_other_case(dimers={**DIMER, "replicates": 3, "meet": True})
    motion = with_bridges(make_resting(case, 2), [make_bridges(0, [(0, 3, -1)])])
    measured = meetings.measure(motion)
    table = measured.tables["meetings"]
    assert table["walker"].tolist() == [0]
    assert table["other"].tolist() == [1]
    assert table["size"].tolist() == [2]
    assert measured.numbers == {"merged": 1, "parted": 0, "largest_group": 2}


def make_tray(bridges: dict[int, list[tuple[int, int, int]]], **tables: Any) -> Motion:
    """Make a tray of three dimers, of beads 0 to 5, with bridges in some cycles.

    Bridges are two beads and -1, or a bead, -1 and a wall. Bead 0 is on the floor in all cycles.
    """
    dimers = {
        **DIMER,
        "replicates": 3,
        "meet": True,
        "angle_spread": "0 deg",
        "facing": "both",
    }
    motion = make_resting(make_other_case(dimers=dimers, **tables))
    samples = motion.case.run.samples_per_cycle
    recorded = []
    for cycle in range(motion.case.run.cycles + 1):
        contacts = [(0, -1, FLOOR), *bridges.get(cycle, [])]
        recorded.append(make_bridges(cycle * samples, contacts))
    return with_bridges(motion, recorded)


@pytest.fixture
def three_that_meet() -> Motion:
    """Walkers 0 and 1 have bridges in cycles 1 to 3, in the second one another than in the third.

    Walkers 1 and 2 have one from cycle 2 on.
    """
    first = (0, 3, -1)
    second = (1, 2, -1)
    of_others = (3, 4, -1)
    return make_tray(
        {
            1: [first, second],
            2: [second, of_others],
            3: [first, of_others],
            4: [of_others],
            5: [of_others],
            6: [of_others],
        }
    )


def test_a_meeting_lasts_from_the_first_bridge_to_the_last_one(three_that_meet: Motion) -> None:
    table = meetings.measure(three_that_meet).tables["meetings"]
    assert table["event"].tolist() == ["merged", "merged", "parted"]
    assert table["walker"].tolist() == [0, 1, 0]
    assert table["other"].tolist() == [1, 2, 1]
    assert table["size"].tolist() == [2, 3, 1]
    assert table["time"] == pytest.approx(np.array([1.0, 2.0, 4.0]) / 80.0)


def test_a_meeting_is_at_the_angle_between_the_headings(three_that_meet: Motion) -> None:
    """Walker 0 faces right, the others left."""
    assert [walker.facing for walker in three_that_meet.walkers] == [1, -1, -1]
    table = meetings.measure(three_that_meet).tables["meetings"]
    assert table["angle"] == pytest.approx([pi, 0.0, pi])


def test_meetings_and_clusters_are_counted(three_that_meet: Motion) -> None:
    """Two walkers take part in each of two meetings of three walkers in 6 cycles of 1/80 s."""
    numbers = meetings.measure(three_that_meet).numbers
    assert numbers["merged"] == 2
    assert numbers["parted"] == 1
    assert numbers["largest_group"] == 3
    assert numbers["largest_cluster"] == 2  # at the end
    assert numbers["clustered_share"] == pytest.approx(2.0 / 3.0)
    assert numbers["meeting_rate"] == pytest.approx(2 * 2 / (3 * 6.0 / 80.0))


@pytest.mark.parametrize(
    ("bridges", "share"),
    [
        pytest.param([(0, 3, -1), (3, -1, SIDE)], 2.0 / 3.0, id="one of two that are joined"),
        pytest.param([(0, 3, -1)], 0.0, id="none: the floor holds nobody"),
        pytest.param([(0, 3, -1), (5, -1, SIDE)], 1.0 / 3.0, id="a third one"),
    ],
)
def test_a_cluster_is_held_where_one_of_its_beads_has_a_bridge_to_a_side_wall(
    bridges: list[tuple[int, int, int]], share: float
) -> None:
    """Walkers 0 and 1, of beads 0 to 3, are joined in the last cycle."""
    tray = make_tray({6: bridges}, boundary=BOX)
    assert meetings.measure(tray).numbers["held_share"] == pytest.approx(share)


def test_a_bead_of_no_walker_at_a_side_wall_holds_no_walker() -> None:
    """Bead 6 is placed beside three dimers, of beads 0 to 5.

    With such a bead, bridges are in every sample: here in one a cycle.
    """
    placed = [{"radius": "0.3 mm", "at": ["9.7 mm", "0 mm", "0.3 mm"]}]
    run = FEW | {"samples_per_cycle": 1}
    tray = make_tray({6: [(6, -1, SIDE)]}, boundary=BOX, placed=placed, run=run)
    assert tray.walker_of.tolist() == [0, 0, 1, 1, 2, 2, -1]
    assert meetings.measure(tray).numbers["held_share"] == 0.0


def test_all_walls_of_a_groove_are_its_floor_for_walkers() -> None:
    """A walker in it has bridges to both walls always, and is not held by them."""
    groove = {"shape": "groove", "opening": "100 deg", "material": "glass"}
    tray = make_tray({6: [(0, -1, 1)]}, boundary=groove)
    assert meetings.measure(tray).numbers["held_share"] == 0.0


@pytest.mark.parametrize(
    ("boundary", "floor"),
    [
        pytest.param({}, 3 * (2.0 * 2.0), id="plane"),
        pytest.param({"shape": "channel", "width": "1.5 mm"}, 3 * (2.0 * 1.5), id="channel"),
        pytest.param({"shape": "box", "width": "20 mm", "height": "10 mm"}, 20.0**2, id="box"),
        pytest.param(
            {"shape": "cylinder", "width": "20 mm", "height": "10 mm"}, pi * 10.0**2, id="cylinder"
        ),
    ],
)
def test_the_coverage_is_that_of_the_floor_of_all_walkers(
    boundary: dict[str, Any], floor: float
) -> None:
    """Of three dimers of beads of 0.3 and 0.2 mm, 2 mm apart; the floor is in mm²."""
    dimers = {
        **DIMER,
        "replicates": 3,
        "meet": True,
        "spacing": "2 mm",
        "angle_spread": "0 deg",
    }
    case = make_other_case(dimers=dimers, boundary={**SUBSTRATE, **boundary})
    coverage = 3 * pi * (0.3**2 + 0.2**2) / floor
    assert meetings.derived(case)["coverage"] == pytest.approx(coverage, rel=5e-3)


def make_course(time: FloatArray, centre: FloatArray, heading: FloatArray) -> meetings.TrayCourse:
    """Make the course of walkers that are neither joined nor held by a wall."""
    shape = centre.shape[:2]
    alone = np.ones(shape, dtype=np.int64)
    return meetings.TrayCourse(time, centre, heading, alone, np.zeros(shape, dtype=bool))


@pytest.fixture(params=[0.0, 90.0], ids=["along x", "along y"])
def three_ways(request: pytest.FixtureRequest) -> dict[str, Any]:
    """Numbers of walkers at 1 mm/s along the axis of the drive, against it and across, for 1 s."""
    angle = np.radians(request.param)
    axis = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-axis[1], axis[0]])
    heading = np.broadcast_to([axis, -axis, across], (11, 3, 2))
    time = np.linspace(2.0, 3.0, 11)
    course = make_course(time, 1e-3 * time[:, None, None] * heading, heading)
    return meetings.collective(course, 6, axis)


def test_the_order_of_walkers_is_about_the_axis_of_the_drive(three_ways: dict[str, Any]) -> None:
    """(1 + 1 - 1)/3, and a mean heading of 1/3."""
    assert three_ways["nematic_order"] == pytest.approx(1.0 / 3.0)
    assert three_ways["polar_order"] == pytest.approx(1.0 / 3.0)


def test_walkers_that_are_alone_are_free(three_ways: dict[str, Any]) -> None:
    """Two walkers take part in each of six meetings of three walkers in 1 s."""
    assert three_ways["meeting_rate"] == pytest.approx(2 * 6 / 3.0)
    assert three_ways["free_speed"] == pytest.approx(1e-3)
    assert three_ways["slow_share"] == 0.0
    assert three_ways["clustered_share"] == 0.0
    assert three_ways["held_share"] == 0.0
    assert np.isnan(three_ways["joined_speed"])
    assert np.isnan(three_ways["speed_ratio"])


def test_the_end_of_a_tray_is_the_last_tenth_of_its_drive() -> None:
    """One walker goes on at 1 mm/s, one stops after 0.85 s of 1 s and is slow at the end.

    One slows down to 0.15 mm/s and is not: slow is less than a tenth of the speed. All turn from
    along the axis to across after 0.85 s.
    """
    time = np.linspace(0.0, 1.0, 101)
    goes_on = 1e-3 * time
    stops = 1e-3 * np.minimum(time, 0.85)
    slows = 1e-3 * np.where(time < 0.85, time, 0.85 + 0.15 * (time - 0.85))
    centre = np.zeros((101, 3, 2))
    centre[..., 0] = np.stack([goes_on, stops, slows], axis=1)
    turned = np.where(time < 0.85, 0.0, 1.0)[:, None]
    heading = np.stack([1.0 - turned, turned], axis=-1) * np.ones((1, 3, 1))
    numbers = meetings.collective(make_course(time, centre, heading), 0, np.array([1.0, 0.0]))
    assert numbers["slow_share"] == pytest.approx(1.0 / 3.0)
    assert numbers["nematic_order"] == pytest.approx(-1.0)


def test_the_end_of_a_drive_of_two_frames_is_the_time_between_them() -> None:
    """In 0.1 s one walks 0.1 mm and one rests: their mean speed is 0.5 mm/s."""
    centre = np.zeros((2, 2, 2))
    centre[1, 0] = [1e-4, 0.0]
    heading = np.broadcast_to([1.0, 0.0], (2, 2, 2))
    course = make_course(np.array([0.0, 0.1]), centre, heading)
    numbers = meetings.collective(course, 0, np.array([1.0, 0.0]))
    assert numbers["free_speed"] == pytest.approx(5e-4)
    assert numbers["slow_share"] == 0.5


# --- piles ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def bed() -> SimpleNamespace:
    """The state of two large beads, 0 and 1, and two small ones, 2 and 3.

    Beads 0 and 1 touch, and 0 is on the floor: they are the bulk. Bead 2 is at a side wall and has
    an open bridge to bead 1; beads 2 and 3 count as a cluster.
    """
    motion = make_resting(make_other_case(**PILE), 2)
    position = motion.position.copy()
    position[1, :, 2] = [1e-3, 2e-3, 5e-3, 4e-3]
    velocity = motion.velocity.copy()
    velocity[1, 0] = [1e-3, 2e-3, 2e-3]
    velocity[1, 2] = [0.0, 3e-3, 4e-3]
    contacts = np.array([(0, 1, -1), (1, 2, -1), (0, -1, FLOOR), (2, -1, SIDE)])
    force = np.array([1e-6, 3e-6, 1e-6, 1e-6])
    gap = np.array([-1e-9, 2e-6, -1e-9, -1e-9])
    state = _state_of(
        replace(motion, position=position, velocity=velocity),
        Bridges(1, contacts, force, gap),
        np.array([True, True, False, False]),
        [HeldCluster(frozenset({2, 3}), frozenset({SIDE}))],
        FLOOR,
    )
    return SimpleNamespace(**state)


def test_bridges_of_a_bed_are_counted_between_beads(bed: SimpleNamespace) -> None:
    """Of two bridges of four beads one touches: 2 · 1/4 contacts and 2 · 2/4 bridges per bead."""
    assert bed.touching == 1
    assert bed.opened == 1
    assert bed.contacts == 0.5
    assert bed.bridges == 1.0
    assert bed.mean_force == pytest.approx(2e-6)


def test_beads_of_a_bed_are_counted_at_side_walls_and_in_the_bulk(bed: SimpleNamespace) -> None:
    """That on the floor is not at a side wall."""
    assert bed.at_wall == 1
    assert bed.large_at_wall == 0
    assert bed.bulk == 2
    assert bed.clusters == 1


def test_the_mean_square_velocity_of_a_bed_is_that_of_all_components(
    bed: SimpleNamespace,
) -> None:
    """One bead of four has 1 + 4 + 4 mm²/s², another one 9 + 16."""
    assert bed.mean_square_velocity == pytest.approx((9e-6 + 25e-6) / 4.0)


def test_the_brazil_nut_index_of_a_bed_is_the_difference_of_heights_over_their_sum(
    bed: SimpleNamespace,
) -> None:
    """Large beads are at 1.5 mm in the mean, small ones at 4.5 mm; the bulk has no small ones."""
    assert bed.brazil_nut == pytest.approx((1.5 - 4.5) / (1.5 + 4.5))
    assert bed.brazil_nut_of_bulk == 0.0


def test_the_surface_of_a_bed_is_the_top_of_the_highest_bead_of_each_cell(
    bed: SimpleNamespace,
) -> None:
    """Both large beads are in one cell, 2 mm wide; the top of the higher one is at 2.5 mm."""
    assert bed.surface == pytest.approx(2.5e-3)
    assert bed.highest == pytest.approx(5e-3)


CLUSTERS = {
    "track": np.arange(3),
    "climbed": np.array([True, True, False]),
    "begin": np.array([3.0, 1.0, 0.1]),
    "onset": np.array([0.5, 1.0, np.nan]),
    "speed": np.array([2e-3, np.nan, 9e-3]),
    "height": np.array([5e-3, 4e-3, 8e-3]),
    "leader_large": np.array([False, True, True]),
}
"""Two climbs, and a cluster that did not climb."""


def test_the_numbers_of_climbs() -> None:
    """The first counts from 0.5 s, though its greatest gain begins later.

    The speed of the second is not measured.
    """
    assert _of_climbs(CLUSTERS) == {
        "climbs": 2,
        "onset": 0.5,
        "speed": 2e-3,
        "highest": 5e-3,
        "led_by_large": 1,
    }


def test_the_numbers_of_no_climbs() -> None:
    without_climbs = {name: column[2:] for name, column in CLUSTERS.items()}
    numbers = {"climbs": 0, "onset": np.nan, "speed": np.nan, "highest": np.nan, "led_by_large": 0}
    assert _of_climbs(without_climbs) == pytest.approx(numbers, nan_ok=True)


# --- pictures and films -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("slowdown", "text"), [(20.0, "20 × slower"), (1.0, "real time"), (0.25, "4 × faster")]
)
def test_slow_motion_in_words(slowdown: float, text: str) -> None:
    assert speed_text(slowdown) == text


@pytest.mark.parametrize(
    ("frame", "direction"),
    [
        (0, [1.0, 0.0, 0.0]),
        (1, [0.0, 1.0, 0.0]),
        (1.5, [0.0, sqrt(0.5), sqrt(0.5)]),
        (2, [0.0, 0.0, 1.0]),
    ],
)
def test_a_bead_turns_about_axes_that_stay_where_they_are(
    frame: float, direction: list[float]
) -> None:
    """A quarter turn about z, then one about x: what was x is y, then z. The other bead rests.

    Spins are means over the time since the frame before.
    """
    motion = make_resting(make_case(run=FEW), 3)
    quarter = 0.5 * pi / (motion.time[1] - motion.time[0])
    spin = np.zeros_like(motion.spin)
    spin[1, 0] = [0.0, 0.0, quarter]
    spin[2, 0] = [quarter, 0.0, 0.0]
    turned = orientations_of(replace(motion, mean_spin=spin))
    assert turned is not None
    first, second = rotations_at(turned, frame)[:2]
    np.testing.assert_allclose(first @ [1.0, 0.0, 0.0], direction, atol=1e-12)
    np.testing.assert_allclose(second, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(
    ("chosen", "large", "small"),
    [
        pytest.param(True, [0xB0, 0x20, 0x3C], [0xE0, 0x56, 0x6C], id="ruby"),
        pytest.param(False, [0x8C, 0x9A, 0xA5], [0xC9, 0xD2, 0xD8], id="grey"),
    ],
)
def test_beads_have_the_colours_of_their_class(
    chosen: bool, large: list[int], small: list[int]
) -> None:
    """Ruby if they are pointed out, else grey; the large one is the darker."""
    scene = Scene.around(make_resting(make_case(run=FEW), 2), np.eye(3))
    assert scene.colours(np.full(2, chosen))[0].tolist() == [large, small]


def test_points_of_a_player_are_as_wide_as_the_beads() -> None:
    """In mm."""
    points = _points(make_resting(make_other_case(**PILE), 2), np.zeros(4))
    np.testing.assert_allclose(points.point_sizes, [1.0, 1.0, 0.6, 0.6], rtol=1e-6)


def test_points_of_a_player_are_at_the_places_of_the_beads() -> None:
    """In mm."""
    points = _points(make_resting(make_other_case(**PILE), 2), np.zeros(4))
    np.testing.assert_allclose(points.positions["0.000000"][3], [3.0, 0.0, 1.0], atol=1e-3)
