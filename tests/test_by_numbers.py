"""Numbers worked out by hand, or by a second formula, on motions that no engine has made."""

from __future__ import annotations

import time
from dataclasses import replace
from math import inf, pi, radians, sqrt
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
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
from walkers.postprocess.measure.motion import Bridges, Motion
from walkers.postprocess.measure.numbers import short_text
from walkers.postprocess.measure.piles import _of_climbs, _state_of
from walkers.postprocess.measure.uncertainty import SPREAD_NAME, bands_of, spread_of
from walkers.postprocess.measure.walking import _doubts, _posture, _scatter, _velocities, tables_of
from walkers.postprocess.show.films import speed_text
from walkers.postprocess.show.report.player import _points
from walkers.postprocess.show.scene import Scene, orientations_of, rotations_at
from walkers.runner.cost import predicted_overhead
from walkers.runner.manifest import iso_time
from walkers.runs.making import progress_in
from walkers.runs.preview import preview_text, summarise
from walkers.templates.deck import Segment, compose, plan_of, render_deck
from walkers.templates.placement import place

DENSITY, LARGE, SMALL = 4000.0, 3e-4, 2e-4
"""Of the reference case: kg/m³, m, m."""
FLOOR, SIDE = 0, 3
FEW = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
PILE: dict[str, Any] = {
    "placed": [
        {"radius": f"{radius} mm", "at": [f"{x} mm", "0 mm", "1 mm"]}
        for x, radius in enumerate((0.5, 0.5, 0.3, 0.3))
    ],
    "boundary": {
        "shape": "box",
        "width": "20 mm",
        "height": "10 mm",
        "material": "chromium-coated glass",
    },
    "run": {"duration": "0.1 s"},
}


def case_of(**changes: Any) -> Case:
    """The reference's liquid, contacts and drive with other bodies, boundary or run."""
    tables = {
        name: table
        for name, table in document().items()
        if name not in {"dimers", "boundary", "run"}
    }
    plate = {"material": "chromium-coated glass"}
    return build_case({**tables, "boundary": plate, "run": FEW, **changes}, name="made up")


def resting(case: Case, frames: int | None = None) -> Motion:
    """The beads of a case at their starts, in all samples of its run."""
    scene, placed = place((case,))
    count = case.run.cycles * case.run.samples_per_cycle + 1 if frames is None else frames
    time = np.arange(count) / (case.run.samples_per_cycle * case.excitation.frequency)
    position = np.tile([bead.centre for bead in scene.beads], (count, 1, 1))
    nothing = np.zeros_like(position)
    return Motion(
        case=case,
        time=time,
        position=position,
        velocity=nothing,
        spin=nothing,
        substrate=nothing[:, 0],
        radius=np.array([bead.radius for bead in scene.beads]),
        walkers=tuple(replace(one, beads=tuple(bead - 1 for bead in one.beads)) for one in placed),
        frames=[(Path("made-up"), number) for number in range(count)],
        truncated=False,
    )


def test_quarters_of_a_range() -> None:
    for scale, median, quarters in (
        (True, None, [0.01, 0.1**1.5, 0.1, 0.1**0.5, 1.0]),
        (True, 0.25, [0.01, 0.05, 0.25, 0.5, 1.0]),
        (False, 0.21, [0.01, 0.11, 0.21, 0.605, 1.0]),
    ):
        np.testing.assert_allclose(
            Range(0.01, 1.0, None, scale, median).quantiles(np.linspace(0, 1, 5)), quarters, rtol=1e-12
        )


def test_a_phase_of_a_waveform_is_an_earlier_begin_of_the_whole() -> None:
    time, frequency, phase = np.linspace(0.0, 0.1, 200), 20.0, radians(50.0)

    def acceleration(first: Harmonic, time: Any) -> Any:
        waves = waveform("sawtooth", first)
        return sum(
            one.peak_acceleration * np.sin(one.angular_frequency * time + one.phase)
            for one in waves
        )

    plain = Harmonic(axis="x", frequency=frequency, peak_acceleration=10.0)
    earlier = acceleration(plain, time + phase / (2.0 * pi * frequency))
    np.testing.assert_allclose(
        acceleration(plain.with_values(phase=phase), time), earlier, atol=1e-9
    )
    assert np.abs(earlier).max() > 9.0


def test_a_bead_on_a_slope_presses_with_a_part_of_its_weight() -> None:
    """At 60° with half of it: the overlap is Hertz's, 4/3 E* √R δ^1.5 = F."""
    case = make_case(boundary={"tilt": "60 deg"})
    loads, modulus = contact_loads(case), 5e7 / (2.0 * (1.0 - 0.09))
    for number, radius in enumerate((LARGE, SMALL)):
        weight = 4.0 / 3.0 * pi * radius**3 * case.beads.density * case.environment.gravity
        pressed = 4.0 / 3.0 * modulus * sqrt(radius) * loads[number].overlap ** 1.5
        assert pressed - bridge_at_rest(case, radius, inf).pull == pytest.approx(
            0.5 * weight, rel=1e-6
        )
    reduced = LARGE * SMALL / (LARGE + SMALL)
    assert 4.0 / 3.0 * modulus * sqrt(reduced) * loads[2].overlap ** 1.5 == pytest.approx(
        loads[2].pull
    )


@pytest.mark.parametrize(
    ("angle", "facing", "ways"), [("30 deg", "both", (30, 210)), ("-20 deg", "left", (160, 160))]
)
def test_walkers_start_at_their_angle_to_the_left(
    angle: str, facing: str, ways: tuple[int, int]
) -> None:
    start = {"replicates": 2, "facing": facing, "angle": angle, "angle_spread": "0 deg"}
    group = resting(make_case(dimers=start)).groups[0]
    arm = group.position[0, :, 0] - group.position[0, :, 1]
    assert np.degrees(np.arctan2(arm[:, 1], arm[:, 0])) % 360.0 == pytest.approx(ways)
    np.testing.assert_allclose(
        np.degrees(group.orientation), float(angle.removesuffix(" deg")), atol=1e-9
    )


def test_a_duration_is_whole_cycles() -> None:
    """0.07 · 100 is 7 and a rounding error."""
    for frequency, duration, cycles in (
        ("100 Hz", "0.07 s", 7),
        ("80 Hz", "0.101 s", 9),
        ("100 Hz", "0.29 s", 29),
    ):
        drive = {"frequency": frequency, "peak_acceleration": "4 g"}
        dimers = {"radii": ["0.3 mm", "0.2 mm"]}
        assert case_of(dimers=dimers, drive=drive, run={"duration": duration}).run.cycles == cycles


def test_measuring_begins_after_all_of_the_settling_cycles() -> None:
    """A frame in two cycles, seven cycles to settle: frame 4, of cycle 8, is the first."""
    tables = {"dimers": {"radii": ["0.3 mm", "0.2 mm"]}}
    case = case_of(**tables, run={"frames_per_second": 40, "cycles": 20, "settling_cycles": 7})
    assert (case.run.cycles_per_sample, case.run.samples_per_cycle, case.run.settled_strobes) == (
        2,
        1,
        4,
    )
    samples = settled_samples(resting(case, 11).group(0).case.run)
    assert (samples.start, samples.stop) == (4, 10)


def test_a_deck_of_several_cases_is_watched_with_the_highest_of_their_limits() -> None:
    slow, fast = (make_case(drive={"peak_acceleration": peak}) for peak in ("2 g", "8 g"))
    assert (
        compose(plan_of(slow, fast)).fastest
        == render_deck(fast).fastest
        > 1.1 * render_deck(slow).fastest
    )


def test_what_show_prints_of_a_case_is_in_its_units() -> None:
    """Beads of 0.3 and 0.2 mm, 1 % of liquid, 4 g at 80 Hz: masses, volumes, forces and the amplitude by hand."""
    case, omega, volume = make_case(), 2.0 * pi * 80.0, 4.0 / 3.0 * pi * (LARGE**3 + SMALL**3)
    text = preview_text(summarise(case))
    assert (
        f"1 small and 1 large, {1e6 * DENSITY * volume:.4g} mg, {1e9 * volume:.4g} µL with " in text
    )
    assert f"with {1e7 * volume:.3g} µL of liquid" in text
    assert (
        f"amplitude {1e3 * 39.2 / omega**2:.4g} mm, peak velocity {1e3 * 39.2 / omega:.4g} mm/s"
        in text
    )
    mass = DENSITY * volume
    assert f"M = {1e6 * mass:.4g} mg, weight {9.81e6 * mass:.4g} µN, mean radius 0.25 mm, " in text
    assert f"sin δ = 0.2, mass asymmetry (m1 - m2)/M = {(27 - 8) / (27 + 8):.4g}" in text
    wall = next(line for line in text.splitlines() if "bead 1 on substrate" in line)
    assert f" {1e6 * 4.0 * pi * case.liquid.surface_tension * LARGE:.4g} µN" in wall
    assert (
        f" {1e12 * 0.5 * 0.01 * 4.0 / 3.0 * pi * LARGE**3:.3g} nL" in wall
    )  # half of the bead's liquid
    assert f" {1e6 * bridge_at_rest(case, LARGE, inf).rupture:.3g} µm " in wall
    assert wall.endswith(f" {1e9 * contact_loads(case)[0].overlap:.4g} nm")
    pile = preview_text(summarise(case_of(**PILE)))
    for shown, share in (
        (text, 0.4),
        (pile, 0.2),
    ):  # of the Rayleigh limit: walkers alone do not collide
        (limit,) = (line for line in shown.splitlines() if line.startswith("  rayleigh"))
        assert limit.endswith(f'("auto": at most {share})')


def test_measuring_takes_as_long_as_a_run_has_places_of_beads_in_its_first_attempt() -> None:
    """Of twelve beads of walkers in 20 frames of each of 12 cycles; the beads of a pile have no tables."""
    law = {"liquid.law": "rabinovich"}
    walkers, pile = load_case("fig1b", law), changed_case(case_of(**PILE), law)
    assert (walkers.count, walkers.run.attempts) == (12, (12, 24, 60))
    assert predicted_overhead([walkers, pile]) == pytest.approx(2 * 0.037 + 30e-6 * 12 * 20 * 12)


def test_the_speed_of_a_run_that_goes_on_is_that_of_this_call() -> None:
    """Of 1200 steps, 1104 were there: 48 took a second, so 48 more take another."""
    run = make_case(
        run={"time_step": "250 us", "allow_unstable": True, "cycles": 20, "settling_cycles": 2}
    ).run
    assert run.steps == 1200
    segment = Segment(1104, 1200, 0)
    progress = progress_in(run, 20, segment, 1152, 1.0)
    assert progress == (0.96, "96 %, 1 s left, 0.240 s simulated, 48 steps/s", "96 %")
    assert [progress_in(run, 20, segment, step, 0.9).text for step in (1104, 1128)] == [
        "starting",
        "94 %",
    ]
    steady = load_case("fig1b").run
    begin = sum(steady.attempts[:-1]) * steady.steps_per_cycle
    middle = progress_in(steady, steady.cycles, Segment(0, steady.steps, 0), steady.steps // 2, 1.0)
    assert middle.share == pytest.approx((begin + steady.steps / 2) / (begin + steady.steps))
    assert "at most" in middle.text


def test_times_of_a_manifest_are_utc(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    try:
        time.tzset()
        assert iso_time(1e9) == "2001-09-09T01:46:40Z"
    finally:
        monkeypatch.undo()
        time.tzset()


def test_a_result_rests_on_the_values_of_the_case_that_is_asked_for(tmp_path: Path) -> None:
    """Two cases of the same numbers have a run in common; one says a value that the other leaves out."""
    tables = document(run=FEW)
    del tables["contact"]["rolling_friction"]
    plain = build_case(tables, name="test")
    contact = {**tables["contact"], "rolling_friction": plain.contact.rolling_friction}
    said = build_case({**tables, "contact": contact}, name="test")
    assert said == plain
    walkers.run(plain, tmp_path)
    rests = [walkers.load(case, tmp_path).result.about["rests_on"] for case in (plain, said)]
    found = [
        one["origin"]
        for of_case in rests
        for one in of_case
        if one["key"] == "contact.rolling_friction"
    ]
    assert found[0] != found[1] == "given"


def test_scatter_and_slopes_of_walkers() -> None:
    """The scatter is the deviation of a sample, sqrt(7/3) of 1, 2 and 4; a single one has none."""
    assert _scatter(np.array([1.0, 2.0, 4.0])) == pytest.approx(sqrt(7.0 / 3.0))
    assert np.isnan(_scatter(np.array([1.0])))
    time = np.linspace(3.0, 4.0, 30)
    values = (
        np.outer(time, [2.0, -1.0]) + 0.1 * np.random.default_rng(5).standard_normal((30, 2)) + 1e3
    )
    expected = [np.polyfit(time - 3.5, column - 1e3, 1)[0] for column in values.T]
    np.testing.assert_allclose(fit_slopes(time, values), expected, rtol=1e-9)


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
"""Three walkers that face right and two that face left; nothing of one is as large as that of another."""


def test_the_numbers_of_walkers_of_both_headings() -> None:
    found = _velocities(WALKERS, make_case())
    expected = {
        "velocity": 4e-3,
        "scatter": sqrt((9 + 4 + 0 + 1 + 16) / 4.0) * 1e-3,
        "smallest": 1e-3,
        "largest": 8e-3,
        "right_facing": 7e-3 / 3.0,
        "left_facing": 6.5e-3,
        "right_scatter": sqrt(7.0 / 3.0) * 1e-3,
        "left_scatter": sqrt(4.5) * 1e-3,
        "axial_velocity": 7.3e-3
        / 3.0,  # of those that face right: over all, both ways would cancel
        "axial_left_facing": -6.6e-3,
        "lateral_velocity": 0.0,
        "separated_fraction": 0.02,
        "orientation_end": -0.04,
        "orientation_smallest": -0.4,
        "orientation_largest": 0.3,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=1e-12)
    counts = {"walkers": 5, "facing_right": 3, "facing_left": 2, "steady": 3, "turned_round": 2}
    assert {name: found[name] for name in counts} == counts
    # On a level floor under a sine both headings are one, and the steady ones differ: 1, 2 and 5 mm/s.
    assert (found["facings_differ"], found["depends_on_start"], found["came_apart"]) == (
        False,
        True,
        False,
    )


def test_on_a_tray_axial_velocities_of_both_ways_cancel() -> None:
    case = make_case(
        dimers={"replicates": 5, "meet": True, "spacing": "2 mm"},
        run={"cycles": 6, "settling_cycles": 2},
    )
    found = _velocities(WALKERS, case)
    assert found["axial_velocity"] == pytest.approx((1.1 + 2.1 + 4.1 - 5.1 - 8.1) * 1e-3 / 5.0)
    assert not found["depends_on_start"]


def test_on_a_slope_means_are_those_of_the_walkers_that_face_up() -> None:
    found = _velocities(WALKERS, make_case(boundary={"tilt": "10 deg"}))
    expected = {
        "velocity": 7e-3 / 3.0,
        "smallest": 1e-3,
        "largest": 4e-3,
        "axial_velocity": 7.3e-3 / 3.0,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert found["facings_differ"]


def test_walkers_that_turned_to_the_other_side_before_the_start_face_there() -> None:
    """The second one starts at 170° to the right, the fourth at -170° to the left."""
    angles = np.radians([0.0, 170.0, 0.0, -170.0, 0.0])
    found = _velocities({**WALKERS, "start_angle": angles}, make_case())
    assert (found["right_facing"], found["left_facing"]) == pytest.approx((10e-3 / 3.0, 5e-3))
    assert (found["facing_right"], found["facing_left"]) == (3, 2)


@pytest.mark.parametrize(
    ("velocities", "depends"),
    [
        ([1e-3, 1.04e-3, 9e-3, 1.02e-3, 9e-3], False),
        ([1e-3, 1.08e-3, 9e-3, 1.02e-3, 9e-3], True),
        ([1e-6, 9e-6, 9e-3, 5e-6, 9e-3], False),
    ],
    ids=["within 5 %", "by more", "at rest"],
)
def test_steady_walkers_that_differ_depend_on_their_start(
    velocities: list[float], depends: bool
) -> None:
    """The third and the last one are not steady: they do not count."""
    found = _velocities({**WALKERS, "velocity": np.array(velocities)}, make_case())
    assert found["depends_on_start"] == depends


def test_kinds_of_walkers_differ_without_depending_on_their_start() -> None:
    """The second kind has the fourth walker, which is twice as fast as the steady ones of the first."""
    kinds = {
        **WALKERS,
        "velocity": np.array([1e-3, 1e-3, 9e-3, 2e-3, 9e-3]),
        "make": np.array([0, 0, 0, 1, 1]),
    }
    assert not _velocities(kinds, make_case())["depends_on_start"]
    assert _velocities({**kinds, "make": np.zeros(5, dtype=int)}, make_case())["depends_on_start"]


def test_walkers_of_two_tones_have_a_velocity_for_each_heading() -> None:
    """The tones push one way: walkers of one heading are alike, and those of the other are faster."""
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g"},
    ]
    case = case_of(
        dimers={"radii": ["0.3 mm", "0.2 mm"], "replicates": 5}, drive={"harmonics": tones}
    )
    found = _velocities({**WALKERS, "velocity": np.array([1e-3, 1e-3, 1e-3, 2e-3, 2e-3])}, case)
    assert (found["facings_differ"], found["depends_on_start"]) == (True, False)


def test_postures_and_ways_of_walkers_on_a_slope() -> None:
    """Of five: two turned over, after 1 and 2 s; one is at rest within 2 µm/s; three go up, one down."""
    case = make_case(boundary={"tilt": "10 deg"}, dimers={"replicates": 5}, run=FEW)
    (group,) = resting(case).groups
    angles = np.radians([0.0, 10.0, 100.0, 20.0, 120.0])
    turned = replace(group)
    turned.__dict__["orientation"] = np.linspace(0.0 * angles, angles, len(group.time))
    axial = np.array([1e-3, 1e-6, -1e-3, 3e-6, 4e-6])
    found = _posture([turned], {**WALKERS, "axial_velocity": axial, "orientation_end": angles})
    # The second one still turns, and leans.
    assert {name: found[name] for name in ("upright", "leaning", "turned_over")} == {
        "upright": 1,
        "leaning": 2,
        "turned_over": 2,
    }
    assert (found["climbing"], found["descending"]) == (3, 1)
    assert (found["turned_first"], found["turned_last"]) == (1.0, 2.0)
    assert found["ends_within"] == pytest.approx(np.radians(20.0))


_SOUND = {
    "walkers": 3,
    "steady": 3,
    "meets": False,
    "came_apart": False,
    "separated_fraction": 0.0,
    "depends_on_start": False,
    "walkers_met": False,
}


@pytest.mark.parametrize(
    ("numbers", "changes", "told"),
    [
        ({}, False, ""),
        (
            {"steady": 2},
            False,
            "1 of 3 walkers is not steady: the velocity depends on the length of the run",
        ),
        (
            {"steady": 1},
            False,
            "2 of 3 walkers are not steady: the velocity depends on the length of the run",
        ),
        ({"steady": 1}, True, ""),
        ({"steady": 1, "meets": True}, False, ""),
        (
            {"steady": 1, "came_apart": True, "separated_fraction": 0.254},
            False,
            "walkers came apart: beads are beyond the rupture distance for 25 % of the time",
        ),
        (
            {"depends_on_start": True},
            False,
            "steady copies differ by more than 5 %: the velocity depends on the start",
        ),
        ({"depends_on_start": True}, True, ""),
        (
            {"walkers_met": True},
            False,
            "walkers came close to each other and are not independent: increase the spacing",
        ),
        ({"walkers_met": True, "meets": True}, False, ""),
    ],
)
def test_reasons_to_doubt_a_velocity(numbers: dict[str, Any], changes: bool, told: str) -> None:
    assert "\n".join(_doubts({**_SOUND, **numbers}, changes=changes)) == told


def test_a_walker_is_separated_where_any_of_its_pairs_is() -> None:
    """The last bead of three goes away for the last ten of 40 measured samples, the others touch."""
    case = case_of(
        clusters=[
            {"arrangement": "chain", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"], "replicates": 1}
        ]
    )
    motion = resting(case)
    position = motion.position.copy()
    position[50:, 2, 0] -= 1e-3
    (group,) = replace(motion, position=position).groups
    assert tables_of(group)["walkers"]["separated_fraction"] == pytest.approx(10.0 / 40.0)


def test_a_walker_has_turned_over_90_degrees_from_its_start() -> None:
    """It starts at 100° to the axis: 80° further it has not, but at -10°, after four of six cycles."""
    case = make_case(dimers={"angle": "100 deg"}, run=FEW)
    (group,) = resting(case).groups
    for end, over in (
        (180.0, np.nan),
        (100.0, np.nan),
        (-60.0, 4.0 / 80.0),
    ):  # 26.7° a cycle: 106.7° after four
        turned = replace(group)
        turned.__dict__["orientation"] = np.radians(np.linspace(100.0, end, len(group.time)))[
            :, None
        ]
        assert turned.turned_at == pytest.approx(over, nan_ok=True)


def test_the_work_of_two_harmonics_with_phases() -> None:
    """Mass centres that move as -b cos(ωt + φ) along the force M a sin(ωt + φ): π M a b in a period."""
    first = {"frequency": "80 Hz", "peak_acceleration": "4 g", "phase": "70 deg"}
    second = {"frequency": "160 Hz", "peak_acceleration": "2 g", "phase": "-40 deg", "axis": "y"}
    case = case_of(
        dimers={"radii": ["0.3 mm", "0.2 mm"], "replicates": 1},
        drive={"harmonics": [first, second]},
        run={**FEW, "samples_per_cycle": 40},
    )
    motion = resting(case)
    position, velocity = motion.position.copy(), motion.velocity.copy()
    ways = {0: (1e-4, 2.0 * pi * 80.0, radians(70.0)), 1: (3e-5, 2.0 * pi * 160.0, radians(-40.0))}
    for axis, (way, omega, phase) in ways.items():
        position[..., axis] -= way * np.cos(omega * motion.time + phase)[:, None]
        velocity[..., axis] += way * omega * np.sin(omega * motion.time + phase)[:, None]
    (group,) = replace(motion, position=position, velocity=velocity).groups
    mass = 4.0 / 3.0 * pi * (LARGE**3 + SMALL**3) * case.beads.density
    expected = (
        pi * mass * (39.2 * 1e-4 + 2.0 * 19.6 * 3e-5)
    )  # the second one has two periods in a cycle
    np.testing.assert_allclose(averages(group).work, np.full((6, 1), expected), rtol=1e-3)


def test_a_band_holds_the_result(tmp_path: Path) -> None:
    """Three draws of each varied value, and six in all, are enough for it."""
    run, band = tmp_path / "run", {"velocity": {"low": 1.0, "high": 2.0, "points": 8}}
    assert bands_of(run, [], {"velocity": 1.5}) == {}
    spread_of(run).mkdir()
    write_json(spread_of(run) / SPREAD_NAME, {"varied": [], "bands": band})
    for own, low, high in (
        (1.5, 1.0, 2.0),
        (2.5, 1.0, 2.5),
        (0.5, 0.5, 2.0),
        (None, 1.0, 2.0),
        (inf, 1.0, 2.0),
    ):
        ends = {
            "velocity_low": low,
            "velocity_high": high,
            "velocity_draws": 8,
            "velocity_approximate": False,
        }
        assert bands_of(run, [], {"velocity": own}) == ends
    assert (
        bands_of(run, [{"key": "liquid.volume_fraction", "range": [0.0, 1.0]}], {"velocity": 1.5})
        == {}
    )
    for draws, values, few in (
        (5, 1, True),
        (6, 1, False),
        (6, 2, False),
        (8, 3, True),
        (9, 3, False),
    ):
        varied = [{"key": str(number), "range": [0.0, 1.0]} for number in range(values)]
        write_json(
            spread_of(run) / SPREAD_NAME,
            {"varied": varied, "bands": {"velocity": {**band["velocity"], "points": draws}}},
        )
        assert bands_of(run, varied, {"velocity": 1.5})["velocity_approximate"] == few


def test_a_tray_that_has_hardly_been_driven_has_meetings_alone() -> None:
    """One frame, in which a bridge joins two of three dimers."""
    dimers = {"radii": ["0.3 mm", "0.2 mm"], "replicates": 3, "meet": True}
    motion = resting(case_of(dimers=dimers), 2)
    motion.__dict__["bridges"] = [Bridges(0, np.array([(0, 3, -1)]), np.ones(1), np.ones(1))]
    measured = meetings.measure(motion)
    assert [measured.tables["meetings"][name].tolist() for name in ("walker", "other", "size")] == [
        [0],
        [1],
        [2],
    ]
    assert measured.numbers == {"merged": 1, "parted": 0, "largest_group": 2}


def _tray(bridges: dict[int, list[tuple[int, int, int]]], **tables: Any) -> Motion:
    """Three dimers, of beads 0 to 5, in whose cycles these bridges (two beads or -1, a wall or -1) are there."""
    dimers = {
        "radii": ["0.3 mm", "0.2 mm"],
        "replicates": 3,
        "meet": True,
        "angle_spread": "0 deg",
        "facing": "both",
    }
    motion = resting(case_of(dimers=dimers, **tables))
    samples = motion.case.run.samples_per_cycle
    seen = []
    for cycle in range(motion.case.run.cycles + 1):
        contacts = [(0, -1, FLOOR), *bridges.get(cycle, [])]
        ones = np.ones(len(contacts))
        seen.append(Bridges(cycle * samples, np.array(contacts), ones, ones))
    motion.__dict__["bridges"] = seen
    return motion


def test_a_meeting_lasts_from_the_first_bridge_to_the_last_one() -> None:
    """Walkers 0 and 1 have two bridges, then one, in cycles 1 to 3; 1 and 2 have one from cycle 2 on."""
    first, second, other = (0, 3, -1), (1, 2, -1), (3, 4, -1)
    motion = _tray(
        {
            1: [first, second],
            2: [second, other],
            3: [first, other],
            4: [other],
            5: [other],
            6: [other],
        }
    )
    measured = meetings.measure(motion)
    table = measured.tables["meetings"]
    assert table["event"].tolist() == ["merged", "merged", "parted"]
    assert [*zip(table["walker"].tolist(), table["other"].tolist(), strict=True)] == [
        (0, 1),
        (1, 2),
        (0, 1),
    ]
    assert table["size"].tolist() == [2, 3, 1]
    assert table["time"] == pytest.approx(np.array([1.0, 2.0, 4.0]) / 80.0)
    assert [walker.facing for walker in motion.walkers] == [1, -1, -1]
    assert table["angle"] == pytest.approx([pi, 0.0, pi])
    numbers = measured.numbers
    assert (numbers["merged"], numbers["parted"], numbers["largest_group"]) == (2, 1, 3)
    assert (numbers["largest_cluster"], numbers["clustered_share"]) == (
        2,
        pytest.approx(2.0 / 3.0),
    )  # at the end
    assert numbers["meeting_rate"] == pytest.approx(2 * 2 / (3 * 6.0 / 80.0))


def test_a_cluster_is_held_where_one_of_its_beads_has_a_bridge_to_a_side_wall() -> None:
    """Walkers 0 and 1 are joined, and 1 is held: both are; the floor holds nobody."""
    box = {"shape": "box", "width": "20 mm", "height": "10 mm", "material": "chromium-coated glass"}
    motion = _tray({6: [(0, 3, -1), (3, -1, SIDE)]}, boundary=box)
    assert meetings.measure(motion).numbers["held_share"] == pytest.approx(2.0 / 3.0)
    assert meetings.measure(_tray({6: [(0, 3, -1)]}, boundary=box)).numbers["held_share"] == 0.0
    # A side wall that another walker touches holds that one alone.
    alone = _tray({6: [(0, 3, -1), (5, -1, SIDE)]}, boundary=box)
    assert meetings.measure(alone).numbers["held_share"] == pytest.approx(1.0 / 3.0)


@pytest.mark.parametrize(
    ("boundary", "floor"),
    [
        ({}, 3 * (2.0 * 2.0)),
        ({"shape": "channel", "width": "1.5 mm"}, 3 * (2.0 * 1.5)),
        ({"shape": "box", "width": "20 mm", "height": "10 mm"}, 20.0**2),
        ({"shape": "cylinder", "width": "20 mm", "height": "10 mm"}, pi * 10.0**2),
    ],
)
def test_the_coverage_is_that_of_the_floor_of_all_walkers(
    boundary: dict[str, Any], floor: float
) -> None:
    """Of three dimers of beads of 0.3 and 0.2 mm, 2 mm apart; in mm²."""
    dimers = {
        "radii": ["0.3 mm", "0.2 mm"],
        "replicates": 3,
        "meet": True,
        "spacing": "2 mm",
        "angle_spread": "0 deg",
    }
    case = case_of(dimers=dimers, boundary={"material": "chromium-coated glass", **boundary})
    expected = 3 * pi * (0.3**2 + 0.2**2) / floor
    assert meetings.derived(case)["coverage"] == pytest.approx(expected, rel=5e-3)


def test_all_walls_of_a_groove_are_its_floor_for_walkers() -> None:
    """A walker in it has bridges to both walls always, and is not held by them."""
    motion = _tray(
        {6: [(0, -1, 1)]}, boundary={"shape": "groove", "opening": "100 deg", "material": "glass"}
    )
    assert meetings.measure(motion).numbers["held_share"] == 0.0


@pytest.mark.parametrize("turn", [0.0, 90.0])
def test_the_order_of_walkers_is_about_the_axis_of_the_drive(turn: float) -> None:
    """Of three that face along the axis, against it and across: (1 + 1 - 1)/3, and a mean heading of 1/3."""
    axis = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    across = np.array([-axis[1], axis[0]])
    heading = np.broadcast_to([axis, -axis, across], (11, 3, 2))
    alone, free = np.ones((11, 3), dtype=np.int64), np.zeros((11, 3), dtype=bool)
    time = np.linspace(2.0, 3.0, 11)
    centre = 1e-3 * time[:, None, None] * heading
    course = meetings.TrayCourse(time, centre, heading, alone, free)
    found = meetings.collective(course, 6, axis)
    assert found["meeting_rate"] == pytest.approx(2 * 6 / 3.0)
    assert found["nematic_order"] == pytest.approx(1.0 / 3.0)
    assert found["polar_order"] == pytest.approx(1.0 / 3.0)
    assert found["free_speed"] == pytest.approx(1e-3)
    assert (found["slow_share"], found["clustered_share"], found["held_share"]) == (0.0, 0.0, 0.0)
    assert np.isnan([found["joined_speed"], found["speed_ratio"]]).all()


def test_the_end_of_a_tray_is_the_last_tenth_of_its_drive() -> None:
    """A walker that stops after 0.85 s of 1 s is slow at the end; one that slows down to 0.15 is not: that is 0.1."""
    time = np.linspace(0.0, 1.0, 101)
    stops = 1e-3 * np.minimum(time, 0.85)
    slows = 1e-3 * np.where(time < 0.85, time, 0.85 + 0.15 * (time - 0.85))
    centre = np.stack([1e-3 * time, stops, slows], axis=1)[..., None] * np.array([1.0, 0.0])
    turned = np.where(time < 0.85, 0.0, 1.0)[:, None]
    late = np.stack([1.0 - turned[:, 0], turned[:, 0]], axis=1)
    heading = np.stack([late, late, late], axis=1)
    alone, free = np.ones((101, 3), dtype=np.int64), np.zeros((101, 3), dtype=bool)
    course = meetings.TrayCourse(time, centre, heading, alone, free)
    found = meetings.collective(course, 0, np.array([1.0, 0.0]))
    assert found["slow_share"] == pytest.approx(1.0 / 3.0)
    assert found["nematic_order"] == pytest.approx(-1.0)


def test_the_end_of_a_drive_of_two_frames_is_the_time_between_them() -> None:
    time, heading = np.array([0.0, 0.1]), np.broadcast_to([[1.0, 0.0], [1.0, 0.0]], (2, 2, 2))
    centre = np.zeros((2, 2, 2))
    centre[1, 0] = [1e-4, 0.0]  # one walks at 1 mm/s, one rests: their mean is 0.5 mm/s
    alone, free = np.ones((2, 2), dtype=np.int64), np.zeros((2, 2), dtype=bool)
    course = meetings.TrayCourse(time, centre, heading, alone, free)
    found = meetings.collective(course, 0, np.array([1.0, 0.0]))
    assert (found["free_speed"], found["slow_share"]) == (pytest.approx(5e-4), 0.5)


def test_the_state_of_a_bed() -> None:
    """Two large beads that touch, one on the floor; a small one at a side wall, with an open bridge; one alone."""
    motion = resting(case_of(**PILE), 2)
    position, velocity = motion.position.copy(), motion.velocity.copy()
    position[1, :, 2] = [1e-3, 2e-3, 5e-3, 4e-3]
    velocity[1] = 1e-3 * np.array(
        [(1.0, 2.0, 2.0), (0.0, 0.0, 0.0), (0.0, 3.0, 4.0), (0.0, 0.0, 0.0)]
    )
    contacts = np.array([(0, 1, -1), (1, 2, -1), (0, -1, FLOOR), (2, -1, SIDE)])
    bridges = Bridges(
        1, contacts, np.array([1e-6, 3e-6, 1e-6, 1e-6]), np.array([-1e-9, 2e-6, -1e-9, -1e-9])
    )
    bulk = np.array([True, True, False, False])
    moved = replace(motion, position=position, velocity=velocity)
    cluster = HeldCluster(frozenset({2, 3}), frozenset({SIDE}))
    state = _state_of(moved, bridges, bulk, [cluster], FLOOR)
    bed = SimpleNamespace(**state)
    assert (bed.touching, bed.opened, bed.contacts, bed.bridges) == (1, 1, 0.5, 1.0)
    assert (bed.at_wall, bed.large_at_wall, bed.bulk, bed.clusters) == (1, 0, 2, 1)
    assert bed.mean_square_velocity == pytest.approx((9e-6 + 25e-6) / 4.0)
    assert bed.brazil_nut == pytest.approx((1.5 - 4.5) / 6.0)
    assert bed.brazil_nut_of_bulk == 0.0
    assert (bed.mean_force, bed.highest) == pytest.approx((2e-6, 5e-3))
    assert bed.surface == pytest.approx(2.5e-3)  # both large beads are in one cell, 2 mm wide


def test_the_numbers_of_climbs() -> None:
    """The first counts from 0.5 s, though its greatest gain begins later; the speed of the second is not measured."""
    clusters = {
        "track": np.arange(3),
        "climbed": np.array([True, True, False]),
        "begin": np.array([3.0, 1.0, 0.1]),
        "onset": np.array([0.5, 1.0, np.nan]),
        "speed": np.array([2e-3, np.nan, 9e-3]),
        "height": np.array([5e-3, 4e-3, 8e-3]),
        "leader_large": np.array([False, True, True]),
    }
    assert _of_climbs(clusters) == {
        "climbs": 2,
        "onset": 0.5,
        "speed": 2e-3,
        "highest": 5e-3,
        "led_by_large": 1,
    }
    none = {"climbs": 0, "onset": np.nan, "speed": np.nan, "highest": np.nan, "led_by_large": 0}
    assert _of_climbs({name: column[2:] for name, column in clusters.items()}) == pytest.approx(
        none, nan_ok=True
    )


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


def test_slow_motion_in_words() -> None:
    assert [speed_text(slowdown) for slowdown in (20.0, 1.0, 0.25)] == [
        "20 × slower",
        "real time",
        "4 × faster",
    ]


def test_a_bead_turns_about_axes_that_stay_where_they_are() -> None:
    """A quarter turn about z, then one about x: what was x is y, then z. The other bead does not turn."""
    motion = resting(make_case(run=FEW), 3)
    spin = np.zeros_like(motion.spin)
    quarter = 0.5 * pi / (motion.time[1] - motion.time[0])
    spin[1, 0], spin[2, 0] = (
        (0.0, 0.0, quarter),
        (quarter, 0.0, 0.0),
    )  # means since the frame before
    turned = orientations_of(replace(motion, mean_spin=spin))
    assert turned is not None
    half = [0.0, sqrt(0.5), sqrt(0.5)]
    for frame, expected in {
        0: [1.0, 0.0, 0.0],
        1: [0.0, 1.0, 0.0],
        1.5: half,
        2: [0.0, 0.0, 1.0],
    }.items():
        first, other = rotations_at(turned, frame)[:2]
        np.testing.assert_allclose(first @ [1.0, 0.0, 0.0], expected, atol=1e-12)
        np.testing.assert_allclose(other, np.eye(3), atol=1e-12)


def test_beads_have_the_colours_of_their_class() -> None:
    """Ruby for those pointed out, grey for the others; in both the large one is the darker."""
    motion = resting(make_case(run=FEW), 2)
    scene = Scene.around(motion, np.eye(3))
    ruby, grey = (scene.colours(np.full(2, chosen))[0].tolist() for chosen in (True, False))
    assert ruby == [[0xB0, 0x20, 0x3C], [0xE0, 0x56, 0x6C]]
    assert grey == [[0x8C, 0x9A, 0xA5], [0xC9, 0xD2, 0xD8]]


def test_points_of_a_player_are_as_wide_as_the_beads() -> None:
    points = _points(resting(case_of(**PILE), 2), np.zeros(4))
    np.testing.assert_allclose(points.point_sizes, [1.0, 1.0, 0.6, 0.6], rtol=1e-6)  # mm
    np.testing.assert_allclose(points.positions["0.000000"][3], [3.0, 0.0, 1.0], atol=1e-3)
