"""The theory against the paper's numbers, against itself, and against the engine."""

import json
from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import njit
from scipy.special import mathieu_a, mathieu_b

from tests.conftest import call, document, make_case, to_toml
from walkers.arrays import FloatArray
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.loads import dimer_of, resistances_at_rest
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.gait import gait
from walkers.postprocess.measure.motion import Group
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.tables import read_table
from walkers.theory.mathieu import (
    LARGEST_STABLE_V,
    Alignment,
    alignment,
    time_to_turn,
    turning_rate,
)
from walkers.theory.motion import Walker, predict_motion
from walkers.theory.prediction import alignment_of, motion_of, predict, threshold
from walkers.theory.prediction_text import prediction_text
from walkers.theory.quasistatic import CONTACTS, detachment, mass_asymmetry, mean_velocity


@pytest.mark.parametrize("radii", [["0.3 mm", "0.2 mm"], ["0.2 mm", "0.3 mm"]])
def test_a_dimer_without_friction_comes_to_its_speed_on_a_slope_as_in_the_engine(
    trajectory: Callable[..., Group], radii: list[str]
) -> None:
    """Held back by nothing but its bridges: three decays, seen from rest through the first cycle."""
    moved = trajectory(
        dimers={"radii": radii},
        liquid={"viscosity_ratio": 8.0},
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "youngs_modulus": "500 MPa"},
        boundary={"tilt": "20 deg"},
        drive={"peak_acceleration": "0 g"},
        run={"cycles": 3, "settling_cycles": 1, "samples_per_cycle": 20},
    )
    case, steps, frequency = moved.case, 1000, moved.case.excitation.frequency
    pull = case.axial_gravity
    motion = predict_motion(
        Walker.of_case(case),
        frequency,
        0.0,
        steady_acceleration=pull,
        cycles=1,
        steps_per_cycle=steps,
    )
    expected = motion.series[:, 0, steps // 20 - 1 :: steps // 20]
    towards_large = np.sign(dimer_of(case).sin_delta)
    found = towards_large * gait(moved).sliding[1:21, 0].T
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())


_REFERENCE = {"contact.friction.bead_wall": 0.2, "run.cycles": 16, "run.settling_cycles": 8}
_SHIPPED = {
    "contact.rolling_friction": 0.0,
    "dimers.angle": "0 deg",
    "dimers.replicates": 1,
    "run.most_cycles": 40,
}
# Soft beads without rolling friction creep while contacts stick, as in a part of each cycle at 2 g: 6 % slow at 50 MPa.
_RIGID = {**_SHIPPED, "contact.youngs_modulus": "800 MPa"}


@pytest.mark.parametrize(
    ("case", "changes"),
    [
        (None, _REFERENCE),
        (None, {**_REFERENCE, "liquid.viscosity_ratio": 20.0, "contact.youngs_modulus": "500 MPa"}),
        ("fig1b", {**_RIGID, "drive.peak_acceleration": "2 g"}),
        ("fig1b", {**_SHIPPED, "drive.peak_acceleration": "6 g"}),
        (
            "fig1b",
            {**_SHIPPED, "drive.peak_acceleration": "6 g", "liquid.meniscus_radius": "150 um"},
        ),
    ],
)
def test_bridges_slow_the_theorys_walker_as_they_do_the_engines(
    run_directory: Callable[..., Path], case: str | None, changes: dict[str, Any]
) -> None:
    """Its velocity, both beads' rotation and the sliding at all contacts."""
    case = load_case(case, changes) if case else changed_case(make_case(), changes)
    result, motion = read_results(run_directory(case)), motion_of(case)
    found = [result["velocity"], result["rotation_1"], result["rotation_2"]]
    found += [result["sliding_1"], result["sliding_2"], result["sliding_pair_1"]]
    expected = [motion.velocity[0], *motion.rotation[:, 0], *motion.sliding[:, 0]]
    np.testing.assert_allclose(found, expected, rtol=5e-3, atol=5e-3 * float(motion.velocity[0]))


@njit
def _drag_of_the_first_bead(
    sliding: tuple[float, float, float],
    _normal: FloatArray,
    friction: FloatArray,
    terms: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    drag = terms[0] * 0.5 * (sliding[0] + sliding[1] - sliding[2])
    return terms[1] * friction, np.array([drag, 0.0, 0.0]), 0.5 * drag * np.array([-1.0, 1.0, -1.0])


@pytest.mark.slow
def test_a_further_effect_is_what_the_same_forces_of_bridges_are() -> None:
    """A drag on the centre of the first bead, and twice the friction with the substrate: the loads count too."""
    walker, drag = Walker.of_case(make_case()), 3e-4  # N s/m
    lever = -walker.radii[0, 0]
    drags = (
        walker.resistances
        + drag * np.array([1.0, lever, lever**2])[:, None, None] * np.eye(3)[0][:, None]
    )
    expected = predict_motion(
        replace(walker, friction=2.0 * walker.friction, resistances=drags), 80.0, 60.0
    )
    terms = np.array([[drag / walker.force_unit[0], 2.0]])
    found = predict_motion(
        walker, 80.0, 60.0, steps_per_cycle=1024, effect=(_drag_of_the_first_bead, terms)
    )
    assert abs(predict_motion(walker, 80.0, 60.0).velocity[0] / expected.velocity[0] - 1.0) > 0.2
    np.testing.assert_allclose(
        found.sliding, expected.sliding, rtol=5e-3, atol=5e-3 * float(expected.velocity[0])
    )
    np.testing.assert_allclose(
        found.smallest_normal_force, expected.smallest_normal_force, rtol=5e-3
    )


def test_velocities_are_those_of_the_papers_closed_form() -> None:
    """The equation with h1 and h2; it has poles where contacts open, and beyond says nothing."""
    gamma, s = np.meshgrid(np.linspace(0.01, 2.5, 60), np.linspace(-0.6, 0.6, 61))
    found, mu, c = mean_velocity(gamma, s), mass_asymmetry(s), np.sqrt(1.0 - s**2)
    first = c**3 * (1.0 + mu * s)
    first /= (c**2 * (1.0 + s**2) - gamma**2 / 8.0 * (1.0 + mu * s) ** 2) ** 2 - (
        2.0 * c**2 * s
    ) ** 2
    second = 4.0 * c * (1.0 + s**2) / ((c**6 - gamma**2 / 2.0 * (mu + s) ** 2) * (1.0 + 3.0 * s**2))
    closed = gamma**2 * s / (4.0 * 33.0) * (first + second)
    opened = np.sqrt(0.5) * gamma >= detachment(s).gamma
    np.testing.assert_array_equal(np.isnan(found), opened)
    assert 0.2 < opened.mean() < 0.8
    np.testing.assert_allclose(found[~opened], closed[~opened], rtol=1e-9, atol=1e-12)


def test_a_symmetric_dimer_goes_nowhere() -> None:
    case = load_case("symmetric")
    assert float(motion_of(case).velocity[0]) == 0.0
    assert np.isnan(threshold(case))


def test_cycles_that_differ_by_the_error_of_the_steps_are_of_one_gait() -> None:
    """Under 2 mm/s cycles alternate by 4 µm/s for ever."""
    steel, pair = {"material": "chrome steel"}, {"radii": ["0.8 mm", "0.5 mm"]}
    setup = {
        "beads": steel,
        "dimers": pair,
        "liquid": {"name": "ethylene glycol"},
        "boundary": {"material": "PTFE"},
    }
    motion = motion_of(
        *(make_case(**setup, drive={"peak_acceleration": f"{g} g"}) for g in (0.9, 0.95, 1.1, 1.25))
    )
    assert motion.periodic.all()
    assert (np.diff(motion.velocity) > 0.0).all()


def test_many_walkers_are_what_each_is_alone() -> None:
    walker, accelerations = Walker.of_case(make_case()), np.linspace(5.0, 80.0, 12)
    alone = [predict_motion(walker, 80.0, one, cycles=6).velocity[0] for one in accelerations]
    np.testing.assert_array_equal(
        predict_motion(walker, 80.0, accelerations, cycles=6).velocity, alone
    )


@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_the_engines_walkers_start_at_the_theorys_threshold(
    run_directory: Callable[..., Path], friction: float
) -> None:
    """They rest at 0.7 of it, and move at 1.3."""
    law = {"friction": {"bead_bead": friction, "bead_wall": friction}}
    case = make_case(contact=law, run={"cycles": 12, "settling_cycles": 8})
    expected = threshold(case)
    cases = [changed_case(case, {"drive.gamma0": share * expected}) for share in (0.7, 1.3)]
    below, above = (read_results(run_directory(one))["velocity"] for one in cases)
    assert abs(below) < 2e-6 < above


@pytest.mark.parametrize(
    "changes", [{}, {"boundary": {"tilt": "3 deg"}}, {"contact": {"friction": {"bead_wall": 0.3}}}]
)
def test_walkers_rest_just_below_the_threshold_and_move_just_above(changes: dict[str, Any]) -> None:
    """Slower and faster than 1 µm/s, at drives 0.2 % off."""
    case = make_case(**changes)
    found = threshold(case)
    drives = [
        f"{dimer_of(case).peak_acceleration(share * found):.9g} m/s^2" for share in (0.998, 1.002)
    ]
    speeds = motion_of(
        *(make_case(**changes, drive={"peak_acceleration": one}) for one in drives)
    ).velocity
    assert 0.0 <= speeds[0] < 1e-6 < speeds[1] < 2e-6


def test_the_threshold_does_not_depend_on_the_order_of_the_beads() -> None:
    """With the small bead first, a walker goes backward, and begins to do so at the same drive."""
    first, second = (
        make_case(dimers={"radii": radii}) for radii in (["0.3 mm", "0.2 mm"], ["0.2 mm", "0.3 mm"])
    )
    assert float(motion_of(second).velocity[0]) == pytest.approx(
        -float(motion_of(first).velocity[0]), rel=1e-4
    )
    assert threshold(second) == pytest.approx(threshold(first), rel=1e-3)
    assert threshold(second) == pytest.approx(0.0811, rel=0.01)


def test_a_prediction_names_the_contact_that_opens() -> None:
    """At the weakest drive, in steps of 1 g, at which one does: the two others stay closed."""
    rough = {"contact.friction.bead_wall": 0.7}
    cases = [
        load_case("fig4b", {**rough, "drive.peak_acceleration": f"{peak} g"})
        for peak in range(4, 12)
    ]
    motion = motion_of(*cases)
    place = int(np.argmax(motion.opened))
    (opened,) = np.flatnonzero(motion.smallest_normal_force[:, place] <= 0.0)
    assert motion.solved[place]
    assert predict(cases[place])["viscous"]["reason"] == f"{CONTACTS[opened]} would open"
    below = predict(cases[0])
    assert below["viscous"]["reason"] is None
    assert below["detachment"]["reason"] == f"{CONTACTS[opened]} would open"
    before, after = (
        dimer_of(case).gamma0(case.excitation.peak_acceleration)
        for case in cases[place - 1 : place + 1]
    )
    assert before < below["detachment"]["gamma"] < after


def test_the_engines_contacts_open_where_the_theory_says(
    run_directory: Callable[..., Path],
) -> None:
    """At more than three times the drive at which the model of the paper opens one."""
    case = load_case("fig1b", {"dimers.replicates": 2, "run.cycles": 24, "run.settling_cycles": 12})
    end = predict(case)["detachment"]
    assert end["gamma"] > 3.0 * detachment(dimer_of(case).sin_delta).gamma
    peaks = [
        f"{dimer_of(case).peak_acceleration(share * end['gamma']):.9g} m/s^2"
        for share in (0.8, 1.25)
    ]
    closed, opened = (
        read_results(run_directory(changed_case(case, {"drive.peak_acceleration": peak})))
        for peak in peaks
    )
    assert [closed[f"open_{contact}"] for contact in ("1", "2", "pair_1")] == [0.0] * 3
    assert (end["reason"], opened["open_pair_1"] > 0.1) == ("bead on bead would open", True)


def test_contacts_of_beads_that_slide_at_a_small_friction_stay_closed() -> None:
    """Up to the strongest drive that is tried, and the sentence says so."""
    case = load_case("symmetric")
    prediction, strongest = predict(case), 16.0 * float(Walker.of_case(case).at_rest.max())
    assert prediction["detachment"] == {"gamma": strongest, "reason": None}
    assert (
        f"stay closed up to about Γ0 = {strongest:.2g}, the strongest drive tried"
        in prediction_text(prediction, None)
    )


def test_mathieu_parameters_of_the_papers_drives() -> None:
    """All below the 0.4 that the paper states, within the stable interval of ±0.45."""
    drives = [("fig1b", 60), ("fig1b", 80), ("fig4b", 80)]
    cases = [
        load_case(name, {"drive.frequency": f"{f} Hz", "drive.peak_acceleration": "10 g"})
        for name, f in drives
    ]
    assert [alignment(case).v for case in cases] == pytest.approx([0.35, 0.20, 0.17], abs=0.006)


def _growth(u: float, v: float, damping: float = 0.0) -> float:
    return Alignment(u, v, damping).growth


def test_small_angles_stay_small_where_the_mathieu_equation_is_stable() -> None:
    """Between its characteristic values a_n(q) and b_(n+1)(q), q = 2V and a = U."""
    for u, v in (
        (0.0, 0.3),
        (0.0, 0.5),
        (0.5, 0.1),
        (-0.1, 0.3),
        (-0.5, 0.3),
        (1.0, 0.2),
        (2.5, 0.4),
    ):
        stable = any(mathieu_a(n, 2.0 * v) < u < mathieu_b(n + 1, 2.0 * v) for n in range(6))
        assert Alignment(u, v).stable == stable, (u, v)
    assert float(mathieu_b(1, 2.0 * LARGEST_STABLE_V)) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.5, 2.0])
def test_the_damped_mathieu_equation_has_its_known_limits(damping: float) -> None:
    """Without a drive the damped pendulum; under a fast one Kapitza's, whose border the damping shifts."""
    assert _growth(-0.0136, 0.0, damping) == pytest.approx(
        np.hypot(damping, np.sqrt(0.0136)) - damping, rel=1e-6
    )
    border = -2.0 * 0.05**2 / (1.0 + damping**2)
    assert _growth(1.03 * border, 0.05, damping) > 1e-6
    assert _growth(0.97 * border, 0.05, damping) < 1e-6
    assert Alignment(0.97 * border, 0.05, damping).stable
    assert (_growth(0.0, 0.99 * LARGEST_STABLE_V) < 1e-6) & (
        _growth(0.0, 1.01 * LARGEST_STABLE_V) > 1e-2
    )


def climber(viscosity: float, tilt: str = "90 deg", **drive: str) -> Case:
    """A dimer on a wall that leads with its large bead, half a degree off the axis; viscosity over glycerol's."""
    tables: dict[str, Any] = read_toml(shipped("case")["climber-dimer"])
    tables["dimers"] |= {
        "replicates": 1,
        "angle": "0.5 deg",
        "angle_spread": "0 deg",
        "gap_spread": 0.0,
    }
    tables["liquid"] |= {"viscosity_ratio": viscosity}
    tables["boundary"] |= {"tilt": tilt}
    tables["contact"] |= {"friction": {"bead_bead": 0.5, "bead_wall": 0.5}, "rolling_friction": 0.0}
    tables["drive"] |= {"frequency": "170 Hz", "peak_acceleration": "16.2 g", **drive}
    tables["run"] = {"cycles": 20, "settling_cycles": 10, "samples_per_cycle": 1}
    return build_case(tables, name="climber")


def test_in_viscous_bridges_a_dimer_turns_over_as_its_beads_settle() -> None:
    """Where all is slow no force between the beads holds them together: each rolls down as alone, at mgR²/Q."""
    case = climber(8.0, peak_acceleration="2 g")
    dimer = dimer_of(case)
    rolling = [resistances_at_rest(case, radius, inf)[2] for radius in dimer.radii]
    speeds = [
        mass * radius**2 / one
        for mass, radius, one in zip(dimer.masses, dimer.radii, rolling, strict=True)
    ]
    settling = case.axial_gravity * (speeds[0] - speeds[1]) / (2.0 * np.sqrt(np.prod(dimer.radii)))
    found = alignment_of(case)
    assert found["rate"] == pytest.approx(settling, rel=0.01)
    assert found["rolling_rate"] < 0.8 * settling


def test_bridges_slow_the_turning_over_and_on_a_slope_the_drive_ends_it() -> None:
    fluid, weak, slow = (alignment_of(climber(viscosity)) for viscosity in (0.1, 1.0, 3.0))
    assert fluid["rate"] > 2.0 * weak["rate"] > 4.0 * slow["rate"] > 0.0
    assert not weak["stands"]
    assert weak["turns_over_after"] == pytest.approx(
        4.7413 / weak["rate"], rel=1e-4
    )  # ln(1/tan 0.5°)
    stands = alignment_of(climber(0.1, tilt="2 deg"))
    assert (stands["stands"], stands["turns_over_after"]) == (True, None)
    assert not alignment_of(climber(0.1, tilt="2 deg", peak_acceleration="2 g"))["stands"]


def test_the_time_to_turn_over_is_that_of_an_angle_from_1_to_90_degrees() -> None:
    """Integrated step by step: dψ/dt = rate · sin ψ."""
    for rate in (1.0, 8.0):
        angle, step, seconds = np.radians(1.0), 1e-5 / rate, 0.0
        while angle < np.pi / 2.0:
            middle = angle + 0.5 * step * rate * np.sin(angle)
            angle += step * rate * np.sin(middle)
            seconds += step
        assert time_to_turn(rate) == pytest.approx(seconds, rel=1e-4)


@pytest.mark.parametrize(
    ("viscosity", "acceleration"), [(0.1, "16.2 g"), (1.0, "2 g"), (3.0, "2 g")]
)
def test_theory_and_engine_agree_on_how_fast_a_climber_turns_over(
    run_directory: Callable[..., Path], viscosity: float, acceleration: str
) -> None:
    case = climber(viscosity, peak_acceleration=acceleration)
    angles = np.abs(read_table(run_directory(case), "trajectory")["orientation"].to_numpy())
    grown = np.log(angles[-1] / angles[8]) / (len(angles) - 9) * case.excitation.frequency
    assert grown == pytest.approx(alignment_of(case)["rate"], rel=0.02)


def test_the_program_prints_theory_beside_the_engine(in_folder: Path) -> None:
    (in_folder / "test.toml").write_text(
        to_toml(document(run={"cycles": 12, "settling_cycles": 8}))
    )
    assert "run it: walkers run CASE" in call("show", "test.toml", "--theory", check=True).stdout
    call("run", "test.toml", check=True)
    contents = json.loads(call("show", "test.toml", "--theory", "--json", check=True).stdout)
    assert contents["engine"]["velocity"] == pytest.approx(
        contents["viscous"]["velocity"], rel=0.08
    )
    table = prediction_text(contents, contents["engine"]).splitlines()
    assert f"{contents['viscous']['velocity'] * 1e3:.3f}" in table[3]
    (in_folder / "up.toml").write_text(to_toml(document(drive={"axis": "z"})))
    done = call("show", "up.toml", "--theory")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)


def test_on_a_level_plate_ruby_stays_on_the_axis_and_symmetric_dimers_turn_across_it() -> None:
    """As in the paper; the rigid cone has no torque for equal beads."""
    ends = (
        {"drive.frequency": f, "drive.peak_acceleration": a}
        for f in ("60 Hz", "90 Hz")
        for a in ("1.5 g", "10 g")
    )
    rates = [turning_rate(load_case("fig1b", drive)) or inf for drive in ends]
    assert -30.0 < min(rates) < max(rates) < -0.3
    turns = alignment_of(
        load_case("fig1b", {"drive.gamma0": 0.5, "dimers.radii": ["0.25 mm", "0.25 mm"]})
    )
    assert turns["rate"] == pytest.approx(1.5, rel=0.01)
    assert (turns["v"], turns["stands"], turns["turns_over_after"]) == (0.0, False, None)
    told = prediction_text(predict(load_case("symmetric")), None)
    assert "no torque toward the axis if the beads roll" in told
    assert "turns away from the axis, from 1° to 10° in about" in told
