"""The theory against the paper's numbers, against itself, and against the engine."""

import json
from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import call, document, make_case, to_toml
from walkers.inputs import load_case, resolve_case
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of, resistances_at_rest
from walkers.inputs.reading import read_toml, shipped_cases
from walkers.physics.dimer import Dimer
from walkers.postprocess import read_table
from walkers.postprocess.analysis import read_result
from walkers.postprocess.gait import gait
from walkers.postprocess.motion import Group
from walkers.sweeps.run import run_sweep
from walkers.sweeps.scheduler import Options
from walkers.sweeps.table import thresholds
from walkers.theory.mathieu import Alignment, alignment, growth, is_stable, largest_stable_v, time_to_turn
from walkers.theory.motion import Friction, Walker, walk
from walkers.theory.prediction import alignment_of, describe_alignment, motion_of, threshold
from walkers.theory.quasistatic import detachment, mass_asymmetry, mean_velocity

RUBY = Dimer((0.3e-3, 0.2e-3), 4000.0, 19.2e-3)
RUBY_COSINE = float(np.sqrt(1.0 - RUBY.sin_delta**2))


def _bridged(walker: Walker) -> Walker:
    """With resistances of another size at each contact, C² < S Q, that a cycle at 80 Hz is long and short for."""
    sliding, mean = np.array([2e-3, 5e-4, 1e-3]), walker.radii.mean()
    resistances = np.array([sliding, sliding * mean * [0.3, -0.4, 0.2], sliding * mean**2 * [0.2, 0.6, 0.4]])
    return replace(walker, resistances=resistances[..., None])


def _accelerated(walker: Walker, sliding: Any) -> tuple[Any, Any]:
    """How fast sliding velocities change and what presses contacts, by the vectors of `walkers.physics.bridge`."""
    (first, second), masses, sine = RUBY.radii, RUBY.masses, RUBY.sin_delta
    velocity = (sliding[0] + sliding[1] - sliding[2]) / 2.0
    spins = np.array([[0.0, (velocity - sliding[0]) / first, 0.0], [0.0, (velocity - sliding[1]) / second, 0.0]])
    speed, up, between = np.array([velocity, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.array([RUBY_COSINE, 0.0, sine])
    forces, torques = np.zeros((2, 3)), np.zeros((2, 3))
    for number, (normal, one, other) in enumerate(((up, 0, None), (up, 1, None), (between, 0, 1))):
        there = np.zeros(3) if other is None else spins[other]
        slides = speed * (other is None) + np.cross(normal, RUBY.radii[one] * spins[one] + second * there)
        rolls = np.cross(normal, spins[one] - there)
        slide, couple, turn = walker.resistances[:, number, 0]
        force, moment = -(slide * slides + couple * rolls), -(couple * slides + turn * rolls)
        forces[one] += force
        torques[one] -= RUBY.radii[one] * np.cross(normal, force) + np.cross(normal, moment)
        if other is not None:
            forces[other] -= force
            torques[other] += np.cross(normal, moment) - second * np.cross(normal, force)
    # Of an acceleration along x and three normal forces, from the balance of both beads along x and z.
    balance = np.array(
        [[masses[0], 0, 0, -RUBY_COSINE], [0, -1, 0, -sine], [masses[1], 0, 0, RUBY_COSINE], [0, 0, -1, sine]]
    )
    gained, *pressed = np.linalg.solve(balance, forces[:, ::2].ravel())
    rolled = torques[:, 1] / (0.4 * np.array(masses) * np.array(RUBY.radii))
    return np.array([gained - rolled[0], gained - rolled[1], -rolled.sum()]), np.array(pressed)


def test_bridges_resist_with_the_forces_and_couples_of_their_law() -> None:
    """Without friction sliding velocities have the amplitudes |(iω + A)⁻¹ a0 (1, 1, 0)|, and normal forces theirs."""
    walker, frequency, peak = _bridged(Walker.of_dimer(RUBY)), 80.0, 9.8
    slowed, pressed = (
        np.array(columns).T for columns in zip(*(_accelerated(walker, one) for one in np.eye(3)), strict=True)
    )
    found = walk(walker, Friction(), frequency, peak, steps_per_cycle=512)
    response = np.linalg.solve(2j * np.pi * frequency * np.eye(3) - slowed, np.array([-peak, -peak, 0.0]))
    np.testing.assert_allclose(np.abs(found.series[:, 0]).max(axis=1), np.abs(response), rtol=1e-3)
    lifted = (walker.at_rest - found.smallest_normal_force)[:, 0] * RUBY.capillary_scale
    np.testing.assert_allclose(lifted, np.abs(pressed @ response), rtol=1e-3)


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
    case, steps, frequency = moved.case, 1000, moved.case.drive.frequency
    pull = case.axial_gravity
    motion = walk(
        Walker.of_case(case), Friction(), frequency, 0.0, steady_acceleration=pull, cycles=1, steps_per_cycle=steps
    )
    expected = motion.series[:, 0, steps // 20 - 1 :: steps // 20]
    towards_large = np.sign(dimer_of(case).sin_delta)
    found = towards_large * gait(moved).sliding[1:21, 0].T
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize(("ratio", "modulus"), [(1.0, "50 MPa"), (8.0, "50 MPa"), (20.0, "500 MPa")])
def test_bridges_slow_the_theorys_walker_as_they_do_the_engines(
    run_directory: Callable[..., Path], ratio: float, modulus: str
) -> None:
    """Its velocity, both beads' rotation and the sliding at all contacts."""
    case = make_case(
        liquid={"viscosity_ratio": ratio},
        contact={"friction": {"bead_bead": 0.1, "bead_wall": 0.2}, "youngs_modulus": modulus},
        run={"cycles": 16, "settling_cycles": 8},
    )
    result, motion = read_result(run_directory(case)), motion_of(case)
    rotation, sliding = result["rotation"], result["sliding"]
    found = [result["velocity"]["mean"], rotation["bead_1"], rotation["bead_2"]]
    found += [sliding[f"contact_{number}"] for number in (1, 2, 3)]
    expected = [motion.velocity[0], *motion.rotation[:, 0], *motion.sliding[:, 0]]
    np.testing.assert_allclose(found, expected, rtol=5e-3, atol=5e-3 * float(motion.velocity[0]))


def test_velocities_are_those_of_the_papers_closed_form() -> None:
    """The equation with h1 and h2; it has poles where contacts open, and beyond says nothing."""
    gamma, s = np.meshgrid(np.linspace(0.01, 2.5, 60), np.linspace(-0.6, 0.6, 61))
    found, mu, c = mean_velocity(gamma, s), mass_asymmetry(s), np.sqrt(1.0 - s**2)
    first = c**3 * (1.0 + mu * s)
    first /= (c**2 * (1.0 + s**2) - gamma**2 / 8.0 * (1.0 + mu * s) ** 2) ** 2 - (2.0 * c**2 * s) ** 2
    second = 4.0 * c * (1.0 + s**2) / ((c**6 - gamma**2 / 2.0 * (mu + s) ** 2) * (1.0 + 3.0 * s**2))
    closed = gamma**2 * s / (4.0 * 33.0) * (first + second)
    opened = np.sqrt(0.5) * gamma >= detachment(s).gamma
    np.testing.assert_array_equal(np.isnan(found), opened)
    assert 0.2 < opened.mean() < 0.8
    np.testing.assert_allclose(found[~opened], closed[~opened], rtol=1e-9, atol=1e-12)


def test_the_motion_under_the_papers_friction_is_quasistatic_at_low_frequency() -> None:
    """A sine instead of a square wave: the mean over its phases of what steady forces give."""
    gamma0, phases = 0.3, (np.arange(4000) + 0.5) / 4000
    forces = gamma0 * np.cos(2.0 * np.pi * phases)
    expected = np.mean([float(mean_velocity(abs(force) * np.sqrt(2.0), 0.2)) for force in forces])
    found = walk(
        Walker.of_dimer(RUBY), Friction(linear=33.0), 2.0, RUBY.peak_acceleration(gamma0), steps_per_cycle=1600
    )
    assert float(found.velocity[0]) == pytest.approx(expected, rel=0.01)


def test_a_static_coefficient_raises_the_threshold() -> None:
    accelerations = np.linspace(1.0, 30.0, 59)
    walker = Walker.of_dimer(RUBY)
    dry = walk(walker, Friction.coulomb(0.07, 0.07), 80.0, accelerations)
    sticky = walk(walker, Friction(kinetic=0.07, static=0.14, stribeck_velocity=1e-3), 80.0, accelerations)
    first, second = (accelerations[np.argmax(np.abs(motion.velocity) > 1e-6)] for motion in (dry, sticky))
    assert second > 1.5 * first


def test_a_symmetric_dimer_goes_nowhere() -> None:
    case = load_case("symmetric")
    assert float(motion_of(case, viscous=False).velocity[0]) == 0.0
    assert np.isnan(threshold(case))


def test_the_papers_law_has_no_solution_at_strong_drives() -> None:
    """Friction κ v F grows with the normal force that it causes itself."""
    found = walk(Walker.of_dimer(RUBY), Friction(linear=33.0), 80.0, np.array([40.0, 200.0]))
    assert found.solved.tolist() == [True, False]
    assert np.isnan(found.velocity).tolist() == [False, True]


def test_stribeck_friction_converges_in_the_step() -> None:
    walker, friction = Walker.of_dimer(RUBY), Friction(kinetic=0.07, static=0.14, stribeck_velocity=1e-2)
    accelerations = np.linspace(20.0, 70.0, 40)
    fine, coarse = (walk(walker, friction, 80.0, accelerations, steps_per_cycle=steps) for steps in (1024, 128))
    repeated = fine.periodic & coarse.periodic
    assert repeated.mean() > 0.5
    assert np.median(np.abs(fine.velocity - coarse.velocity)[repeated]) < 2e-5


def test_many_walkers_are_what_each_is_alone() -> None:
    accelerations = np.linspace(5.0, 80.0, 12)
    friction, walker = Friction.coulomb(0.1, 0.05), Walker.of_dimer(RUBY)
    together = walk(walker, friction, 80.0, accelerations, cycles=6).velocity
    alone = [float(walk(walker, friction, 80.0, a, cycles=6).velocity[0]) for a in accelerations]
    np.testing.assert_allclose(together, alone, atol=2e-6)


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.3])
def test_the_threshold_of_coulomb_friction_does_not_depend_on_the_frequency(friction: float) -> None:
    contact = {"friction": {"bead_bead": friction, "bead_wall": friction}}
    found = [threshold(make_case(contact=contact, drive={"frequency": f}), viscous=False) for f in ("60 Hz", "90 Hz")]
    assert found[0] == pytest.approx(found[1], rel=0.01)  # moving is a speed, and speeds go as 1/f
    assert 0.5 * friction < found[0] < 1.5 * friction


@pytest.mark.parametrize("friction", [0.05, 0.1, 0.3])
def test_theory_and_engine_agree_on_the_threshold(tmp_path: Path, friction: float) -> None:
    """The engine's walkers are lowered in steps of a tenth of the predicted threshold."""
    from walkers.inputs.sweep import expand

    tables = document(contact={"friction": {"bead_bead": friction, "bead_wall": friction}})
    tables["run"] = {"cycles": 12, "settling_cycles": 8}
    (tmp_path / "base.toml").write_text(to_toml(tables))
    expected = threshold(make_case(contact={"friction": {"bead_bead": friction, "bead_wall": friction}}))
    step = 0.1 * expected
    descend = {"key": "drive.gamma0", "from": 13 * step, "to": 7 * step, "step": step, "until_below": "2 um/s"}
    sweep = expand({"case": "base.toml", "descend": descend}, source="test", name="test", folder=tmp_path)
    record, failures = run_sweep(sweep, tmp_path / "runs", Options(1))
    assert not failures
    (end,) = thresholds(record.directory).to_dict("records")
    assert end["at_rest"] < end["moving"]
    assert (end["at_rest"] + end["moving"]) / 2.0 == pytest.approx(expected, rel=0.3)


def test_mathieu_parameters_of_the_papers_drives() -> None:
    """All below the 0.4 that the paper states, within the stable interval of ±0.45."""
    large = Dimer((0.6e-3, 0.3e-3), 4000.0, 19.2e-3)
    found = [alignment(dimer, f, 98.0).v for dimer, f in ((RUBY, 60.0), (RUBY, 80.0), (large, 80.0))]
    assert found == pytest.approx([0.35, 0.20, 0.17], abs=0.006)
    assert largest_stable_v() == pytest.approx(0.454, abs=5e-4)


def test_the_chart_of_stability_is_that_of_floquets_exponents() -> None:
    for u, v in ((0.0, 0.3), (0.0, 0.5), (0.5, 0.1), (-0.1, 0.3), (-0.5, 0.3), (1.0, 0.2), (2.5, 0.4)):
        assert bool(is_stable(u, v)) == (growth(u, v) < 1e-6), (u, v)


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.5, 2.0])
def test_the_damped_mathieu_equation_has_its_known_limits(damping: float) -> None:
    """Without a drive the damped pendulum; under a fast one Kapitza's, whose border the damping shifts."""
    assert growth(-0.0136, 0.0, damping) == pytest.approx(np.hypot(damping, np.sqrt(0.0136)) - damping, rel=1e-6)
    border = -2.0 * 0.05**2 / (1.0 + damping**2)
    assert growth(1.03 * border, 0.05, damping) > 1e-6
    assert growth(0.97 * border, 0.05, damping) < 1e-6
    assert Alignment(0.97 * border, 0.05, damping).stable
    assert (growth(0.0, 0.99 * largest_stable_v()) < 1e-6) & (growth(0.0, 1.01 * largest_stable_v()) > 1e-2)


def climber(viscosity: float, tilt: str = "90 deg", **drive: str) -> Case:
    """A dimer on a wall that leads with its large bead, half a degree off the axis; viscosity over glycerol's."""
    tables: dict[str, Any] = read_toml(shipped_cases()["climber-dimer"])
    tables["dimers"] |= {"replicates": 1, "angle": "0.5 deg", "angle_spread": "0 deg", "gap_spread": 0.0}
    tables["liquid"] |= {"viscosity_ratio": viscosity}
    tables["boundary"] |= {"tilt": tilt}
    tables["contact"] |= {"friction": {"bead_bead": 0.5, "bead_wall": 0.5}, "rolling_friction": 0.0}
    tables["drive"] |= {"frequency": "170 Hz", "peak_acceleration": "16.2 g", **drive}
    tables["run"] = {"cycles": 20, "settling_cycles": 10, "samples_per_cycle": 1}
    return resolve_case(tables, name="climber")


def test_in_viscous_bridges_a_dimer_turns_over_as_its_beads_settle() -> None:
    """Where all is slow no force between the beads holds them together: each rolls down as alone, at mgR²/Q."""
    case = climber(8.0, peak_acceleration="2 g")
    dimer = dimer_of(case)
    rolling = [resistances_at_rest(case, radius, inf)[2] for radius in dimer.radii]
    speeds = [mass * radius**2 / one for mass, radius, one in zip(dimer.masses, dimer.radii, rolling, strict=True)]
    settling = case.axial_gravity * (speeds[0] - speeds[1]) / (2.0 * np.sqrt(np.prod(dimer.radii)))
    found = alignment_of(case)
    assert found["rate"] == pytest.approx(settling, rel=0.01)
    assert found["rolling_rate"] < 0.7 * settling


def test_bridges_slow_the_turning_over_and_on_a_slope_the_drive_ends_it() -> None:
    fluid, weak, slow = (alignment_of(climber(viscosity)) for viscosity in (0.1, 1.0, 3.0))
    assert fluid["rate"] > 2.0 * weak["rate"] > 4.0 * slow["rate"] > 0.0
    assert not weak["stands"]
    assert weak["turns_over_after"] == pytest.approx(time_to_turn(weak["rate"]))
    assert f"turns over after about {weak['turns_over_after']:.2g} s" in describe_alignment(weak)[1]
    stands = alignment_of(climber(1.0, tilt="2 deg"))
    assert (stands["stands"], stands["turns_over_after"]) == (True, None)
    assert "stands: small angles decay" in describe_alignment(stands)[1]
    assert not alignment_of(climber(1.0, tilt="2 deg", peak_acceleration="2 g"))["stands"]


@pytest.mark.parametrize(("viscosity", "acceleration"), [(0.1, "16.2 g"), (1.0, "16.2 g"), (1.0, "2 g"), (3.0, "2 g")])
def test_theory_and_engine_agree_on_how_fast_a_climber_turns_over(
    run_directory: Callable[..., Path], viscosity: float, acceleration: str
) -> None:
    case = climber(viscosity, peak_acceleration=acceleration)
    angles = np.abs(read_table(run_directory(case), "trajectory")["orientation"].to_numpy())
    grown = np.log(angles[-1] / angles[8]) / (len(angles) - 9) * case.drive.frequency
    assert grown == pytest.approx(alignment_of(case)["rate"], rel=0.02)


def test_the_program_prints_theory_beside_the_engine(in_folder: Path) -> None:
    (in_folder / "test.toml").write_text(to_toml(document(run={"cycles": 12, "settling_cycles": 8})))
    assert "not run" in call("theory", "test.toml", check=True).stdout
    call("run", "test.toml", check=True)
    told = call("theory", "test.toml", "--json", check=True).stdout
    contents = json.loads(told)
    assert contents["engine"]["velocity"]["mean"] == pytest.approx(contents["viscous"]["velocity"], rel=0.08)
    sideways = document(boundary={"tilt": "10 deg", "uphill": "90 deg"})
    (in_folder / "sideways.toml").write_text(to_toml(sideways))
    assert "boundary.uphill: the theory is one of planes" in call("theory", "sideways.toml").stderr
    (in_folder / "up.toml").write_text(to_toml(document(drive={"axis": "z"})))
    done = call("theory", "up.toml")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
