"""The theory of dimers against the paper's numbers, closed forms, and the engine."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, pi, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import typeof
from numba.core.types import FunctionType
from scipy.special import mathieu_a, mathieu_b

from tests.conftest import COULOMB, call, document, make_case, to_toml
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
from walkers.theory.motion import PredictedMotion, Walker, predict_motion
from walkers.theory.prediction import alignment_of, motion_of, predict, threshold
from walkers.theory.prediction_text import prediction_text
from walkers.theory.quasistatic import (
    CONTACTS,
    detachment,
    mass_asymmetry,
    mean_velocity,
    normal_force_matrix,
)
from walkers.theory.stepping import compiled_effect


def with_gamma0(case: Case, gamma0: float) -> Case:
    """A case at the dimensionless peak acceleration Γ0, to nine digits."""
    peak = dimer_of(case).peak_acceleration(gamma0)
    return changed_case(case, {"drive.peak_acceleration": f"{peak:.9g} m/s^2"})


def velocity_of(case: Case) -> float:
    """The theory's velocity of a case, m/s."""
    return float(motion_of(case).velocity[0])


# --- motion, as in the engine -----------------------------------------------------------------


@pytest.mark.parametrize("radii", [["0.3 mm", "0.2 mm"], ["0.2 mm", "0.3 mm"]], ids=" ".join)
def test_a_dimer_without_friction_comes_to_its_speed_on_a_slope_as_in_the_engine(
    trajectory: Callable[..., Group], radii: list[str]
) -> None:
    """Nothing but its bridges holds it back: three decays, from rest through the first cycle."""
    moved = trajectory(
        dimers={"radii": radii},
        liquid={"viscosity_ratio": 8.0, "edge_ratio": 0.0},
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "youngs_modulus": "500 MPa"},
        boundary={"tilt": "20 deg"},
        drive={"peak_acceleration": "0 g"},
        run={"cycles": 3, "settling_cycles": 1, "samples_per_cycle": 20},
    )
    case = moved.case
    motion = predict_motion(
        Walker.of_case(case),
        case.excitation.frequency,
        0.0,
        steady_acceleration=case.axial_gravity,
        cycles=1,
        steps_per_cycle=1000,
    )
    every = 1000 // 20
    expected = motion.series[:, 0, every - 1 :: every]
    towards_large = np.sign(dimer_of(case).sin_delta)
    sliding = towards_large * gait(moved).sliding[1:21, 0].T
    largest = np.abs(expected).max()
    np.testing.assert_allclose(sliding, expected, rtol=1e-3, atol=1e-4 * largest)


_REFERENCE = {"contact.friction.bead_wall": 0.2, "run.cycles": 16, "run.settling_cycles": 8}
_SHIPPED = {
    "contact.rolling_friction": 0.0,
    "dimers.angle": "0 deg",
    "dimers.replicates": 1,
    "run.most_cycles": 40,
}


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        pytest.param(None, _REFERENCE, id="reference"),
        pytest.param(
            None,
            {
                **_REFERENCE,
                "liquid.viscosity_ratio": 20.0,
                "contact.youngs_modulus": "500 MPa",
            },
            id="viscous",
        ),
        pytest.param(
            "fig1b",
            # Soft beads without rolling friction creep while contacts stick, as they do in a part
            # of each cycle at 2 g: with 50 MPa the walker is 6 % slow.
            {
                **_SHIPPED,
                "contact.youngs_modulus": "800 MPa",
                "drive.peak_acceleration": "2 g",
            },
            id="weak drive",
        ),
        pytest.param("fig1b", {**_SHIPPED, "drive.peak_acceleration": "6 g"}, id="strong drive"),
        pytest.param(
            "fig1b",
            {
                **_SHIPPED,
                "drive.peak_acceleration": "6 g",
                "liquid.meniscus_radius": "150 um",
            },
            id="menisci",
        ),
    ],
)
def test_bridges_slow_the_theorys_walker_as_they_do_the_engines(
    run_directory: Callable[..., Path], name: str | None, changes: dict[str, Any]
) -> None:
    """Its velocity, the rotation of both beads and the sliding at all contacts, within 0.5 %.

    Without a name, the case is the reference case of the tests.
    """
    case = changed_case(make_case(), changes) if name is None else load_case(name, changes)
    result = read_results(run_directory(case))
    motion = motion_of(case)
    of_theory = {
        "velocity": motion.velocity[0],
        "rotation_1": motion.rotation[0, 0],
        "rotation_2": motion.rotation[1, 0],
        "sliding_1": motion.sliding[0, 0],
        "sliding_2": motion.sliding[1, 0],
        "sliding_pair_1": motion.sliding[2, 0],
    }
    of_engine = [result[key] for key in of_theory]
    tolerance = 5e-3 * float(motion.velocity[0])
    np.testing.assert_allclose(of_engine, [*of_theory.values()], rtol=5e-3, atol=tolerance)


def drag_of_the_first_bead(
    sliding: tuple[float, float, float],
    _normal: FloatArray,
    friction: FloatArray,
    parameters: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """An effect for `predict_motion`.

    A drag on the centre of the first bead, which moves at (s1 + s2 - s3)/2, and other friction. The
    parameters are the coefficient of the drag and the factor of the friction.
    """
    drag = parameters[0] * 0.5 * (sliding[0] + sliding[1] - sliding[2])
    torques = 0.5 * drag * np.array([-1.0, 1.0, -1.0])
    return parameters[1] * friction, np.array([drag, 0.0, 0.0]), torques


def test_the_cache_of_numba_does_not_name_the_function_of_an_effect() -> None:
    """Otherwise it could not be loaded by programs that lack the module of the function."""
    effect_type = typeof(compiled_effect(drag_of_the_first_bead))
    assert isinstance(effect_type, FunctionType)
    assert "drag" not in str(effect_type)


AGAIN = """
from walkers import load_case
from walkers.theory.motion import Walker, predict_motion
from walkers.theory.stepping import integrate

predict_motion(Walker.of_case(load_case("fig1b")), 80.0, 39.2, cycles=1)
print(sum(integrate.stats.cache_misses.values()))
"""
"""A program that prints how often numba had to compile the integrator for a walker with edges."""


def test_the_integrator_is_compiled_once_for_all_processes() -> None:
    predict_motion(Walker.of_case(load_case("fig1b")), 80.0, 39.2, cycles=1)
    done = subprocess.run([sys.executable, "-c", AGAIN], capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"


@pytest.mark.slow
def test_a_further_effect_is_what_the_same_forces_of_bridges_are() -> None:
    """A drag c on the centre of the first bead, and twice the friction with the substrate.

    As resistances of the bridge to the substrate that drag is S = c, C = -cR and Q = cR². The
    loads count too.
    """
    walker = Walker.of_case(make_case(liquid={"edge_ratio": 0.0}))
    drag = 3e-4  # N s/m
    radius = walker.radii[0, 0]
    resistances = walker.resistances.copy()
    resistances[0, 0] += drag
    resistances[1, 0] -= drag * radius
    resistances[2, 0] += drag * radius**2
    changed_walker = replace(walker, friction=2.0 * walker.friction, resistances=resistances)
    expected = predict_motion(changed_walker, 80.0, 60.0)
    parameters = np.array([[drag / walker.force_unit[0], 2.0]])
    motion = predict_motion(
        walker, 80.0, 60.0, steps_per_cycle=1024, effect=(drag_of_the_first_bead, parameters)
    )

    velocity = float(expected.velocity[0])
    without_effect = float(predict_motion(walker, 80.0, 60.0).velocity[0])
    assert abs(without_effect / velocity - 1.0) > 0.2
    np.testing.assert_allclose(motion.sliding, expected.sliding, rtol=5e-3, atol=5e-3 * velocity)
    np.testing.assert_allclose(
        motion.smallest_normal_force, expected.smallest_normal_force, rtol=5e-3
    )


def test_the_program_asks_for_a_run_beside_which_to_print_theory(in_folder: Path) -> None:
    (in_folder / "test.toml").write_text(to_toml(document()))
    shown = call("show", "test.toml", "--theory", check=True)
    assert "run it: walkers run CASE" in shown.stdout


def test_the_program_prints_theory_beside_the_engine(in_folder: Path) -> None:
    run = {"cycles": 12, "settling_cycles": 8}
    (in_folder / "test.toml").write_text(to_toml(document(run=run)))
    call("run", "test.toml", check=True)
    shown = call("show", "test.toml", "--theory", "--json", check=True)
    prediction = json.loads(shown.stdout)
    velocity = prediction["viscous"]["velocity"]
    velocity_of_engine = prediction["engine"]["velocity"]
    assert velocity_of_engine == pytest.approx(velocity, rel=0.08)
    lines = prediction_text(prediction, prediction["engine"]).splitlines()
    assert f"{velocity * 1e3:.3f}" in lines[3]
    assert f"{velocity_of_engine * 1e3:.3f}" in lines[4]


def test_the_program_has_no_theory_of_vertical_shaking(in_folder: Path) -> None:
    (in_folder / "up.toml").write_text(to_toml(document(drive={"axis": "z"})))
    done = call("show", "up.toml", "--theory")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1


# --- velocities -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Velocities:
    """Mean velocities of the paper's model on a grid of drives and asymmetries."""

    gamma: FloatArray
    sin_delta: FloatArray
    velocity: FloatArray
    opened: np.ndarray
    """Whether a contact opens, at which the model ends."""


@pytest.fixture(scope="module")
def velocities() -> Velocities:
    gamma, sin_delta = np.meshgrid(np.linspace(0.01, 2.5, 60), np.linspace(-0.6, 0.6, 61))
    opened = np.sqrt(0.5) * gamma >= detachment(sin_delta).gamma
    return Velocities(gamma, sin_delta, mean_velocity(gamma, sin_delta), opened)


def test_the_papers_model_has_no_velocity_where_contacts_open(velocities: Velocities) -> None:
    np.testing.assert_array_equal(np.isnan(velocities.velocity), velocities.opened)
    assert 0.2 < velocities.opened.mean() < 0.8


def test_velocities_are_those_of_the_papers_closed_form(velocities: Velocities) -> None:
    """The equation with h1 and h2; it has poles where contacts open, and beyond says nothing."""
    closed = ~velocities.opened
    gamma = velocities.gamma[closed]
    s = velocities.sin_delta[closed]
    mu = mass_asymmetry(s)
    c = np.sqrt(1.0 - s**2)
    pole_1 = (c**2 * (1.0 + s**2) - gamma**2 / 8.0 * (1.0 + mu * s) ** 2) ** 2
    pole_1 -= (2.0 * c**2 * s) ** 2
    pole_2 = (c**6 - gamma**2 / 2.0 * (mu + s) ** 2) * (1.0 + 3.0 * s**2)
    first = c**3 * (1.0 + mu * s) / pole_1
    second = 4.0 * c * (1.0 + s**2) / pole_2
    expected = gamma**2 * s / (4.0 * 33.0) * (first + second)
    np.testing.assert_allclose(velocities.velocity[closed], expected, rtol=1e-9, atol=1e-12)


def test_a_symmetric_dimer_goes_nowhere() -> None:
    case = load_case("symmetric")
    assert velocity_of(case) == 0.0
    assert np.isnan(threshold(case))


def test_cycles_that_differ_by_the_error_of_the_steps_are_of_one_gait() -> None:
    """Under 2 mm/s the cycles of these walkers alternate by 4 µm/s for ever."""
    cases = []
    for peak in ("0.9 g", "0.95 g", "1.1 g", "1.25 g"):
        case = make_case(
            beads={"material": "chrome steel"},
            dimers={"radii": ["0.8 mm", "0.5 mm"]},
            liquid={"name": "ethylene glycol"},
            boundary={"material": "PTFE"},
            drive={"peak_acceleration": peak},
        )
        cases.append(case)
    motion = motion_of(*cases)
    assert motion.periodic.all()
    assert (np.diff(motion.velocity) > 0.0).all()


def test_many_walkers_are_what_each_is_alone() -> None:
    walker = Walker.of_case(make_case())
    peaks = np.linspace(5.0, 80.0, 12)
    expected = []
    for peak in peaks:
        alone = predict_motion(walker, 80.0, peak, cycles=6)
        expected.append(alone.velocity[0])
    together = predict_motion(walker, 80.0, peaks, cycles=6)
    np.testing.assert_array_equal(together.velocity, expected)


# --- the threshold of walking -----------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_the_engines_walkers_start_at_the_theorys_threshold(
    run_directory: Callable[..., Path], friction: float
) -> None:
    """At 0.7 of it they are slower than 2 µm/s, at 1.3 they are faster."""
    case = make_case(
        contact={"friction": {"bead_bead": friction, "bead_wall": friction}},
        run={"cycles": 12, "settling_cycles": 8},
    )
    expected = threshold(case)
    case_below = changed_case(case, {"drive.gamma0": 0.7 * expected})
    case_above = changed_case(case, {"drive.gamma0": 1.3 * expected})
    assert abs(read_results(run_directory(case_below))["velocity"]) < 2e-6
    assert read_results(run_directory(case_above))["velocity"] > 2e-6


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="reference"),
        pytest.param({"boundary.tilt": "3 deg"}, id="slope"),
        pytest.param({"contact.friction.bead_wall": 0.3}, id="more friction"),
    ],
)
def test_walkers_rest_just_below_the_threshold_and_move_just_above(changes: dict[str, Any]) -> None:
    """Slower and faster than 1 µm/s, at drives 0.2 % off."""
    case = changed_case(make_case(), changes)
    expected = threshold(case)
    assert 0.0 <= velocity_of(with_gamma0(case, 0.998 * expected)) < 1e-6
    assert 1e-6 < velocity_of(with_gamma0(case, 1.002 * expected)) < 2e-6


def test_a_walker_whose_small_bead_is_first_goes_backward() -> None:
    small_last = make_case(dimers={"radii": ["0.3 mm", "0.2 mm"]})
    small_first = make_case(dimers={"radii": ["0.2 mm", "0.3 mm"]})
    assert velocity_of(small_first) == pytest.approx(-velocity_of(small_last), rel=1e-4)


def test_the_threshold_does_not_depend_on_the_order_of_the_beads() -> None:
    """Γ0 = 0.0811, by the motion at many drives."""
    small_last = make_case(dimers={"radii": ["0.3 mm", "0.2 mm"]})
    small_first = make_case(dimers={"radii": ["0.2 mm", "0.3 mm"]})
    assert threshold(small_first) == pytest.approx(threshold(small_last), rel=1e-3)
    assert threshold(small_first) == pytest.approx(0.0811, rel=0.01)


# --- contacts that open -----------------------------------------------------------------------


@dataclass(frozen=True)
class Opening:
    """A walker on a rough substrate, driven from 4 g on in steps of 1 g."""

    cases: list[Case]
    motion: PredictedMotion
    first: int
    """Place of the weakest drive at which a contact opens."""

    @property
    def contact(self) -> str:
        """The contact that opens there, alone."""
        (opened,) = np.flatnonzero(self.motion.smallest_normal_force[:, self.first] <= 0.0)
        return str(CONTACTS[opened])


@pytest.fixture(scope="module")
def opening() -> Opening:
    cases = []
    for peak in range(4, 12):
        changes = {"contact.friction.bead_wall": 0.7, "drive.peak_acceleration": f"{peak} g"}
        cases.append(load_case("fig4b", changes))
    motion = motion_of(*cases)
    return Opening(cases, motion, first=int(np.argmax(motion.opened)))


def test_a_prediction_names_the_contact_that_opens(opening: Opening) -> None:
    """Instead of a velocity."""
    assert opening.motion.solved[opening.first]
    prediction = predict(opening.cases[opening.first])
    assert prediction["viscous"]["reason"] == f"{opening.contact} would open"


def test_a_prediction_says_at_which_drive_a_contact_opens(opening: Opening) -> None:
    """Between the drive at which the first one opens and the one 1 g below, at which none does."""
    weakest, before, after = (
        opening.cases[place] for place in (0, opening.first - 1, opening.first)
    )
    prediction = predict(weakest)
    assert prediction["viscous"]["reason"] is None
    assert prediction["detachment"]["reason"] == f"{opening.contact} would open"
    gamma = prediction["detachment"]["gamma"]
    dimer = dimer_of(before)
    assert dimer.gamma0(before.excitation.peak_acceleration) < gamma
    assert gamma < dimer.gamma0(after.excitation.peak_acceleration)


@pytest.fixture(scope="module")
def ruby_walkers() -> Case:
    """Two walkers of Fig. 1b, for 24 cycles."""
    changes = {"dimers.replicates": 2, "run.cycles": 24, "run.settling_cycles": 12}
    return load_case("fig1b", changes)


@pytest.fixture(scope="module")
def end_of_ruby_walkers(ruby_walkers: Case) -> dict[str, Any]:
    """The drive at which the theory says that one of their contacts opens, and which does."""
    prediction: dict[str, Any] = predict(ruby_walkers)["detachment"]
    return prediction


def test_contacts_open_at_three_times_the_drive_of_the_papers_model(
    ruby_walkers: Case, end_of_ruby_walkers: dict[str, Any]
) -> None:
    """In the paper's model they open at Γ0 = 1.27; the engine judges the drive of theory below."""
    of_the_paper = detachment(dimer_of(ruby_walkers).sin_delta).gamma
    assert end_of_ruby_walkers["gamma"] == pytest.approx(3.0 * of_the_paper, rel=0.01)


def test_the_engines_contacts_stay_closed_below_the_drive_at_which_one_opens(
    run_directory: Callable[..., Path], ruby_walkers: Case, end_of_ruby_walkers: dict[str, Any]
) -> None:
    """At 0.8 of the theory's drive."""
    case = with_gamma0(ruby_walkers, 0.8 * end_of_ruby_walkers["gamma"])
    result = read_results(run_directory(case))
    assert result["open_1"] == 0.0
    assert result["open_2"] == 0.0
    assert result["open_pair_1"] == 0.0


def test_the_engines_contact_opens_that_the_theory_names(
    run_directory: Callable[..., Path], ruby_walkers: Case, end_of_ruby_walkers: dict[str, Any]
) -> None:
    """At 1.25 of the theory's drive, in more than a tenth of the time."""
    assert end_of_ruby_walkers["reason"] == "bead on bead would open"
    case = with_gamma0(ruby_walkers, 1.25 * end_of_ruby_walkers["gamma"])
    assert read_results(run_directory(case))["open_pair_1"] > 0.1


def test_contacts_of_beads_that_slide_at_a_small_friction_stay_closed() -> None:
    """Up to the strongest drive that is tried: 16 times the largest load. The text says so.

    The friction between the beads does not grow with their velocity.
    """
    case = load_case("symmetric", COULOMB)
    prediction = predict(case)
    strongest = 16.0 * float(Walker.of_case(case).normal_at_rest.max())
    assert prediction["detachment"] == {"gamma": strongest, "reason": None}
    sentence = f"stay closed up to about Γ0 = {strongest:.2g}, the strongest drive tried"
    assert sentence in prediction_text(prediction, None)


# --- alignment with the axis: the Mathieu equation --------------------------------------------


@pytest.mark.parametrize(
    ("name", "frequency", "v"),
    [("fig1b", "60 Hz", 0.35), ("fig1b", "80 Hz", 0.20), ("fig4b", "80 Hz", 0.17)],
)
def test_mathieu_parameters_of_the_papers_drives(name: str, frequency: str, v: float) -> None:
    """All are below the 0.4 that the paper states, within the stable interval of ±0.45."""
    drive = {"drive.frequency": frequency, "drive.peak_acceleration": "10 g"}
    assert alignment(load_case(name, drive)).v == pytest.approx(v, abs=0.006)


@pytest.mark.parametrize(
    ("u", "v"),
    [(0.0, 0.3), (0.0, 0.5), (0.5, 0.1), (-0.1, 0.3), (-0.5, 0.3), (1.0, 0.2), (2.5, 0.4)],
)
def test_small_angles_stay_small_where_the_mathieu_equation_is_stable(u: float, v: float) -> None:
    """Between its characteristic values a_n(q) and b_(n+1)(q), with q = 2V and a = U."""
    q = 2.0 * v
    stable = any(mathieu_a(n, q) < u < mathieu_b(n + 1, q) for n in range(6))
    assert Alignment(u, v).stable == stable


def test_the_largest_stable_v_is_where_a_characteristic_value_is_zero() -> None:
    assert float(mathieu_b(1, 2.0 * LARGEST_STABLE_V)) == pytest.approx(0.0, abs=1e-3)


def test_small_angles_grow_above_the_largest_stable_v_and_not_below() -> None:
    assert Alignment(0.0, 0.99 * LARGEST_STABLE_V).growth < 1e-6
    assert Alignment(0.0, 1.01 * LARGEST_STABLE_V).growth > 1e-2


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.5, 2.0])
def test_without_a_drive_a_dimer_on_its_head_falls_as_a_damped_pendulum(damping: float) -> None:
    """√(β² - U) - β."""
    growth = Alignment(-0.0136, 0.0, damping).growth
    assert growth == pytest.approx(np.sqrt(damping**2 + 0.0136) - damping, rel=1e-6)


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.5, 2.0])
def test_under_a_fast_drive_a_dimer_on_its_head_stands_as_kapitzas_pendulum(
    damping: float,
) -> None:
    """If U is above -2V²/(1 + β²)."""
    border = -2.0 * 0.05**2 / (1.0 + damping**2)
    beyond = Alignment(1.03 * border, 0.05, damping)
    within = Alignment(0.97 * border, 0.05, damping)
    assert beyond.growth > 1e-6
    assert within.growth < 1e-6
    assert within.stable


# --- alignment with the axis: walkers that turn -----------------------------------------------


def climber(viscosity_ratio: float, tilt: str = "90 deg", peak: str = "16.2 g") -> Case:
    """A dimer that leads with its large bead up a wall, half a degree off the axis."""
    tables: dict[str, Any] = read_toml(shipped("case")["climber-dimer"])
    tables["dimers"] |= {
        "replicates": 1,
        "angle": "0.5 deg",
        "angle_spread": "0 deg",
        "gap_spread": 0.0,
    }
    tables["liquid"]["viscosity_ratio"] = viscosity_ratio
    tables["boundary"]["tilt"] = tilt
    tables["contact"]["friction"] = {"bead_bead": 0.5, "bead_wall": 0.5}
    tables["contact"]["rolling_friction"] = 0.0
    tables["drive"] |= {"frequency": "170 Hz", "peak_acceleration": peak}
    tables["run"] = {"cycles": 20, "settling_cycles": 10, "samples_per_cycle": 1}
    return build_case(tables, name="climber")


def test_in_viscous_bridges_a_dimer_turns_over_as_its_beads_settle() -> None:
    """Where all is slow no force between the beads holds them together.

    Each rolls down as alone, at mgR²/Q, and the line between their contacts, L = 2√(R1 R2), turns.
    """
    case = climber(8.0, peak="2 g")
    dimer = dimer_of(case)
    speeds = []
    for mass, radius in zip(dimer.masses, dimer.radii, strict=True):
        rolling_resistance = resistances_at_rest(case, radius, inf)[2]
        speeds.append(mass * case.axial_gravity * radius**2 / rolling_resistance)
    expected = (speeds[0] - speeds[1]) / (2.0 * np.sqrt(np.prod(dimer.radii)))
    turning = alignment_of(case)
    assert turning["rate"] == pytest.approx(expected, rel=0.01)
    assert turning["rolling_rate"] < 0.8 * expected


def test_bridges_slow_the_turning_over() -> None:
    thin, glycerol, thick = (alignment_of(climber(ratio))["rate"] for ratio in (0.1, 1.0, 3.0))
    assert thin > 2.0 * glycerol
    assert glycerol > 2.0 * thick
    assert thick > 0.0


def test_a_climber_turns_over_after_the_time_from_1_to_90_degrees() -> None:
    """ln(tan 45°/tan 0.5°) = 4.7413 over the rate."""
    turning = alignment_of(climber(1.0))
    assert not turning["stands"]
    assert turning["turns_over_after"] == pytest.approx(4.7413 / turning["rate"], rel=1e-4)


def test_on_a_slope_a_strong_drive_keeps_a_climber_from_turning_over() -> None:
    turning = alignment_of(climber(0.1, tilt="2 deg"))
    assert turning["stands"]
    assert turning["turns_over_after"] is None


def test_on_a_slope_a_weak_drive_lets_a_climber_turn_over() -> None:
    assert not alignment_of(climber(0.1, tilt="2 deg", peak="2 g"))["stands"]


@pytest.mark.parametrize("rate", [1.0, 8.0])
def test_the_time_to_turn_over_is_that_of_an_angle_from_1_to_90_degrees(rate: float) -> None:
    """dψ/dt = rate · sin ψ, integrated by the midpoint rule in steps of 1e-4/rate."""
    angle = radians(1.0)
    step = 1e-4 / rate
    steps = 0
    while angle < pi / 2.0:
        middle = angle + 0.5 * step * rate * sin(angle)
        angle += step * rate * sin(middle)
        steps += 1
    assert time_to_turn(rate) == pytest.approx(steps * step, rel=1e-4)


@pytest.mark.parametrize(("viscosity_ratio", "peak"), [(0.1, "16.2 g"), (1.0, "2 g"), (3.0, "2 g")])
def test_theory_and_engine_agree_on_how_fast_a_climber_turns_over(
    run_directory: Callable[..., Path], viscosity_ratio: float, peak: str
) -> None:
    """The angle to the axis grows exponentially: its logarithm from the ninth cycle to the last."""
    case = climber(viscosity_ratio, peak=peak)
    angles = np.abs(read_table(run_directory(case), "trajectory")["orientation"].to_numpy())
    seconds = (len(angles) - 9) / case.excitation.frequency
    rate = np.log(angles[-1] / angles[8]) / seconds
    assert rate == pytest.approx(alignment_of(case)["rate"], rel=0.02)


@pytest.mark.parametrize(
    ("frequency", "peak", "expected"),
    [
        ("60 Hz", "1.5 g", -0.179),
        ("90 Hz", "1.5 g", -0.121),
        ("60 Hz", "10 g", -15.4),
        ("90 Hz", "10 g", -2.94),
    ],
)
def test_on_a_level_plate_ruby_stays_on_the_axis(
    frequency: str, peak: str, expected: float
) -> None:
    """As in the paper: small angles decay.

    In the engine, an angle of 1° decays by 0.188 and 0.121 per second at 1.5 g, and by 15.8 and
    2.61 at 10 g.
    """
    drive = {"drive.frequency": frequency, "drive.peak_acceleration": peak}
    rate = turning_rate(load_case("fig1b", drive))
    assert rate == pytest.approx(expected, rel=0.01)


def test_on_a_level_plate_symmetric_dimers_turn_across_it() -> None:
    """As in the paper; the engine's walkers turn by 1.45/s, from 1° through 60 cycles.

    The rigid cone has no torque for equal beads: V = 0.
    """
    changes = {"drive.gamma0": 0.5, "dimers.radii": ["0.25 mm", "0.25 mm"]}
    turning = alignment_of(load_case("fig1b", changes))
    assert turning["rate"] == pytest.approx(1.475, rel=0.01)
    assert turning["v"] == 0.0
    assert not turning["stands"]
    assert turning["turns_over_after"] is None


def test_the_text_says_that_symmetric_dimers_turn_across_it() -> None:
    text = prediction_text(predict(load_case("symmetric")), None)
    assert "no torque toward the axis if the beads roll" in text
    assert "turns away from the axis, from 1° to 10° in about" in text


def test_the_load_between_rolling_beads_falls_forward_by_masses_and_tilt() -> None:
    """Equal forces T at both feet and at the contact change its load by T (mu + sin d)/cos d."""
    sin_delta = 0.2
    rolls_forward = np.array([1.0, 1.0, -1.0])

    change = normal_force_matrix(sin_delta)[2] @ rolls_forward

    by_masses = mass_asymmetry(sin_delta) / np.sqrt(1.0 - sin_delta**2)
    by_tilt = sin_delta / np.sqrt(1.0 - sin_delta**2)
    assert change == pytest.approx(-(by_masses + by_tilt))
    assert by_masses == pytest.approx(0.554, abs=0.001)
    assert by_tilt == pytest.approx(0.204, abs=0.001)
