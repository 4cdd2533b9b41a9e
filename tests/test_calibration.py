"""Calibrations: files, emulators and posteriors of known functions, parameters found again from the engine's data."""

import copy
import json
import tomllib
from dataclasses import replace
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import multivariate_normal, norm

from tests.conftest import call, to_toml
from tests.printed import spoilt
from walkers.calibration.calibrate import (
    FINAL,
    Outcome,
    Wave,
    _finer_and_longer,
    calibrate,
    next_wave,
    ranking,
    run_wave,
    wave_sweep,
)
from walkers.calibration.emulator import Emulator, Emulators, FloatArray, Space, fit_emulators
from walkers.calibration.file import (
    Calibration,
    Observation,
    Parameter,
    SharedError,
    load_calibration,
    read_calibration,
)
from walkers.calibration.posterior import Density, Posterior, log_likelihood, observation_covariance, sample_posterior
from walkers.calibration.report import figures_of, record_of, words_of
from walkers.errors import InputError
from walkers.inputs.reading import shipped
from walkers.sweeps.scheduler import Options


def parameter(name: str, low: float, high: float, *, log: bool = False, **more: Any) -> Parameter:
    return Parameter(name=name, symbol=name, keys=[name], range=(low, high), log=log, experiments=["one"], **more)


SPACE = Space((parameter("a", 0.1, 10.0, log=True), parameter("b", -1.0, 3.0)))


def emulated(
    unit: FloatArray, outcome: FloatArray, *values: float, deviation: float = 0.1, group: str = "", filling: int = 0
) -> Emulators:
    """Emulators of observations a, b, …, each a group unless it is named."""
    named = [
        Observation(name=name, group=group or name, title=name, of=["one"], value=value, deviation=deviation)
        for name, value in zip(ascii_lowercase, values, strict=False)
    ]
    return fit_emulators(unit, outcome, named, 1, filling)


def posterior_of(emulators: Emulators, points: int, *held_out: str) -> Posterior:
    return sample_posterior(Density(emulators, SPACE, held_out), points, 1)


def drawn(emulator: Emulator, unit: FloatArray, sigmas: float = 0.0) -> FloatArray:
    return emulator.draw(unit, np.full(len(unit), sigmas))


def test_the_cube_and_the_parameters_are_one() -> None:
    unit = SPACE.design(40, 3)
    assert np.histogram2d(*unit.T, bins=3, range=[[0, 1], [0, 1]])[0].min() >= 2
    values = SPACE.values(unit)
    assert 0.1 <= values[:, 0].min() < values[:, 0].max() <= 10.0
    np.testing.assert_allclose(SPACE.unit(values), unit)
    np.testing.assert_allclose(SPACE.values(np.array([0.5, 0.5])), [1.0, 1.0])
    narrowed = Space((parameter("a", 0.1, 10.0, log=True, normal=(1.0, 0.5)),))
    densities = narrowed.log_prior(np.array([[0.5], [0.9], [1.1]]))
    expected = -0.5 * (np.log(SPACE.values(np.array([0.9, 0.0]))[0]) / 0.5) ** 2
    assert densities[1] - densities[0] == pytest.approx(expected)
    assert densities[2] == -np.inf


def _known(unit: FloatArray) -> FloatArray:
    """Two observations of two parameters, one of them with a cliff's tail."""
    x, y = unit.T
    return np.stack([3.0 + 2.0 * x + np.sin(3.0 * y), 1.0 + x * y + 1e3 * np.maximum(x - 0.9, 0.0)], axis=1)


TRUTH = np.array([[0.4, 0.6]])


@pytest.fixture(scope="module")
def known() -> Emulators:
    design = SPACE.design(64, 1)
    return emulated(design, _known(design), *_known(TRUTH)[0], deviation=0.05)


def test_emulators_know_their_error(known: Emulators) -> None:
    fresh = np.random.default_rng(5).random((200, 2)) * [0.85, 1.0]
    for place, emulator in enumerate(known.each):
        low, value, high = (drawn(emulator, fresh, sigmas) for sigmas in (-1.0, 0.0, 1.0))
        miss = np.abs(value - _known(fresh)[:, place])
        assert np.median(miss) < 0.05
        assert np.mean(miss <= 1.5 * (high - low) + 1e-6) > 0.9
        assert emulator.explained > 0.9


def test_errors_are_widened_as_the_later_sets_have_them(known: Emulators) -> None:
    """A plane of 40 sets, and 24 later ones with noise: the process takes its variance for 24/64 of theirs, at all."""
    design, draw = SPACE.design(64, 1), np.random.default_rng(3)
    plane, noise = design.sum(axis=1), 0.05 * draw.standard_normal(64)
    noise *= 0.05 / np.sqrt(np.mean(noise[40:] ** 2))
    late, early = np.arange(64) >= 40, np.arange(64) < 24
    (one,) = emulated(design, (plane + noise * late)[:, None], 1.0, deviation=100.0, filling=40).each
    assert one.error_inflation == pytest.approx(np.sqrt(64.0 / 24.0), rel=0.15)
    (other,) = emulated(design, (plane + noise * early)[:, None], 1.0, deviation=100.0, filling=24).each
    assert other.error_inflation == 1.0
    plain = known.each[0].process.predict(design, return_std=True)[1]
    np.testing.assert_allclose(replace(known.each[0], error_inflation=3.0).predict(design)[1], 3.0 * plain)


def test_the_record_has_quantiles_errors_and_agreement_of_a_known_outcome(known: Emulators, tmp_path: Path) -> None:
    """A posterior even in a from 0.4 to 0.6 of its logarithmic range and in b over all; one of two numbers agrees."""
    number = np.arange(101) / 100.0
    unit = np.stack([0.4 + 0.2 * number, number], axis=1)
    even = Posterior(unit, np.zeros((101, 2)), np.zeros(101), ("a", "b"), unit[50], 5000, 1000.0)
    best = np.array([[0.5, 0.5]])
    value, deviation = np.array([(one.observation.value, one.observation.deviation) for one in known.each]).T
    waves = [Wave(best, value + np.array([[way, -0.9]]) * deviation, pd.DataFrame(), []) for way in (1.5, 1.0, 0.5)]
    checks = dict(zip(("best", "half-step", "twice-as-long"), waves, strict=True))
    drawn = Wave(unit[[0, 100]], np.array([value - deviation, value + deviation]), pd.DataFrame(), [])
    calibration = small(tmp_path, held_out={})
    found = record_of(Outcome(calibration, SPACE, unit, known, even, {}, drawn, checks, {}))
    assert found["best"] == {"a": pytest.approx(1.0), "b": pytest.approx(1.0)}
    assert found["intervals"]["a"] == pytest.approx([0.1 * 100.0**at for at in (0.41, 0.5, 0.59)])
    assert found["intervals"]["b"] == pytest.approx([-0.8, 1.0, 2.8])
    assert found["narrowing"] == {"a": pytest.approx(0.2), "b": pytest.approx(1.0)}
    assert found["words"] == {"a": "identified", "b": "not identified"}
    assert (found["agree"], found["of"], [row["agrees"] for row in found["observations"]]) == (1, 2, [False, True])
    mean, width = (numbers[0] for numbers in known.predict(best))
    for place, row in enumerate(found["observations"]):
        assert (row["engine"], row["half_step"], row["twice_as_long"]) == pytest.approx(
            [1e3 * wave.outcome[0, place] for wave in waves]
        )
        assert (row["low"], row["high"]) == pytest.approx(
            (row["value"] - row["deviation"], row["value"] + row["deviation"])
        )
        # sinh(m + s) - sinh(m - s) = 2 cosh m sinh s
        half = np.cosh(mean[place]) * np.sinh(width[place]) * 1e3 * deviation[place]
        assert row["error"] == pytest.approx(half)


def test_the_checks_have_half_the_time_step_and_twice_the_cycles(tmp_path: Path) -> None:
    found, values = small(tmp_path), np.array([[0.1, 2.0]])
    extras = _finer_and_longer(found, values)
    assert list(extras) == ["best", "half-step", "twice-as-long"]
    usual, finer, longer = (
        [case.run for case in wave_sweep(found, values, name, extra).cases()] for name, extra in extras.items()
    )
    assert len(usual) == 3
    for one, half, twice in zip(usual, finer, longer, strict=True):
        assert half.time_step == pytest.approx(one.time_step / 2.0, rel=0.02)  # whole steps in a cycle
        assert (half.cycles, twice.time_step, twice.cycles) == (one.cycles, one.time_step, 2 * one.cycles)


def test_later_waves_look_around_the_best_sets(tmp_path: Path) -> None:
    found = small(tmp_path)
    unit = next_wave(found, np.zeros((0, 2)), np.zeros((0, 4)), 12, 0)
    miss = np.linalg.norm(unit - [0.2, 0.8], axis=1)[:, None]
    outcome = np.array([one.value for one in found.observations]) * (1.0 + miss)
    chosen = next_wave(found, unit, outcome, 12, len(unit))
    assert len(np.unique(chosen, axis=0)) == 12
    assert ((chosen >= 0.0) & (chosen <= 1.0)).all()
    # The best set that there may be is known; half of the wave is nearer to it than all that was run but a few.
    near = np.sort(np.linalg.norm(chosen[3:9] - [0.2, 0.8], axis=1))
    assert near[0] < np.sort(miss[:, 0])[2]
    assert near[-1] < 0.5
    np.testing.assert_array_equal(chosen, next_wave(found, unit, outcome, 12, len(unit)))


def test_what_is_held_out_is_predicted_wider_and_what_is_derived_weighs_nothing(known: Emulators) -> None:
    whole, without = posterior_of(known, 20_000), posterior_of(known, 4000, "b")
    assert np.abs(whole.best - TRUTH[0]).max() < 0.06
    assert without.groups == ("a",)
    assert drawn(known.each[1], without.unit).std() > 1.5 * drawn(known.each[1], whole.unit).std()
    derived = replace(known.each[1], observation=known.each[1].observation.model_copy(update={"derived": True}))
    np.testing.assert_array_equal(posterior_of(replace(known, each=(known.each[0], derived)), 4000).unit, without.unit)


def test_the_best_set_gives_most_observations_and_then_the_least_misfit(tmp_path: Path) -> None:
    found = small(tmp_path)
    deviation = np.array([one.deviation for one in found.observations])
    residuals = np.array([[0.0, 0.0, 5.0, 5.0], [0.9, 0.9, 0.9, 3.0], [0.9, 0.2, 0.2, 2.0], [0.2, 0.2, 0.2, np.nan]])
    outcome = np.array([one.value for one in found.observations]) + residuals * deviation
    assert ranking(found, outcome).tolist() == [2, 1, 3, 0]
    # Nothing to observe at all is worst, and as bad as thirty deviations.
    worse = np.concatenate([outcome, np.full((1, 4), np.nan), [outcome[0] + 100.0 * deviation]])
    assert ranking(found, worse).tolist() == [2, 1, 3, 0, 4, 5]


@pytest.mark.parametrize("mean", [0.0, 1.0, 3.0, -4.1])
@pytest.mark.parametrize("deviation", [0.05, 0.3, 0.6])
def test_the_likelihood_is_the_integral_over_what_the_emulator_does_not_know(mean: float, deviation: float) -> None:
    discrepancy = 1.5
    z = np.linspace(-8.0, 8.0, 400_001)
    exponents = norm.logpdf(np.sinh(z), 0.0, np.hypot(1.0, discrepancy)) + norm.logpdf(z, mean, deviation)
    exact = np.log(np.sum(np.exp(exponents - exponents.max())) * (z[1] - z[0])) + exponents.max()
    one = np.eye(1)
    found = log_likelihood(*(np.array([[value]]) for value in (mean, deviation)), one, one, np.array([[discrepancy]]))
    assert found[0] - 0.5 * np.log(2.0 * np.pi) == pytest.approx(exact, abs=0.03)


def test_the_likelihood_knows_what_errors_share() -> None:
    """Two observations, beside the integral over a grid: both too large is likelier than one, the other too small."""
    mean, deviation, discrepancy = np.array([[1.2, 0.9]]), np.array([[0.3, 0.2]]), np.array([[0.5, 0.1]])
    emulated, published = np.array([[1.0, 0.6], [0.6, 1.0]]), np.array([[1.0, 0.8], [0.8, 1.0]])
    axis = np.linspace(-2.0, 4.0, 1201)
    z = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    of_engine = multivariate_normal(mean[0], emulated * deviation[0] * deviation[0][:, None]).pdf(z)
    of_numbers = multivariate_normal([0.0, 0.0], published + np.diag(discrepancy[0] ** 2)).pdf(np.sinh(z))
    exact = np.log(np.sum(of_numbers * of_engine)) + 2.0 * np.log(axis[1] - axis[0])
    both, one = (log_likelihood(mean * [1.0, s], deviation, emulated, published, discrepancy)[0] for s in (1, -1))
    assert both - np.log(2.0 * np.pi) == pytest.approx(exact, abs=0.02)
    assert both > one + 1.0


def test_points_of_one_curve_weigh_less_than_as_many_numbers() -> None:
    """Ten observations of one parameter whose errors are shared tell little more than one of them."""
    design = SPACE.design(32, 1)
    found = emulated(design, np.repeat(design[:, :1], 10, axis=1), *[0.5] * 10, group="one")
    observations = [one.observation for one in found.each]
    shared = {"curve": SharedError(observations=list("abcdefghij"), share=0.9)}
    np.testing.assert_allclose(observation_covariance(observations, shared), 0.9 + 0.1 * np.eye(10))
    posteriors = [sample_posterior(Density(found, SPACE, shared_errors=one), 4000, 1) for one in ({}, shared)]
    apart, together = (np.ptp(np.percentile(one.unit[:, 0], (16, 84))) for one in posteriors)
    assert together > 2.0 * apart
    assert together == pytest.approx(0.2 * np.sqrt(0.91), rel=0.25)


def test_sets_at_rest_and_sets_without_a_walker_do_not_make_one_that_walks_between_them() -> None:
    """64 sets none of which is acceptable: at rest, 6.7 deviations off, or beyond a cliff, without a walker."""
    design = SPACE.design(64, 1)
    outcome = np.where(design[:, 0] < 0.5, -6.7 + 0.3 * (design[:, 1] - 0.5), np.nan)[:, None]
    unit = posterior_of(emulated(design, outcome, 0.0, deviation=1.0), 4000).unit
    assert np.mean(np.abs(unit[:, 0] - 0.5) < 0.02) < 0.05
    assert np.mean(unit[:, 0] < 0.5) > 0.7
    alike = np.histogram(unit[:, 0], bins=4, range=(0.0, 0.4))[0]
    assert alike.max() < 1.5 * alike.min()


def test_where_walkers_are_is_learned() -> None:
    """A disc; what is missing in the same sets is one event, and a ratio says nothing beside its two speeds."""
    design = SPACE.design(128, 1)
    one, other = np.linalg.norm(design - 0.3, axis=1) < 0.4, design[:, 0] < 0.5
    outcome = np.where(np.stack([one, one, other, one & other, np.ones(128, bool)], axis=1), 1.0, np.nan)
    found = emulated(design, outcome, *[1.0] * 5)
    assert found.event[0] == found.event[1]
    assert len(found.classifiers) == 4
    fresh = np.random.default_rng(2).random((500, 2))
    probability, inside = found.feasible(fresh), np.linalg.norm(fresh - 0.3, axis=1) < 0.4
    assert np.mean((probability[:, 0] - inside) ** 2) < 0.06  # a quarter if nothing is known
    assert (probability[:, 4] > 0.98).all()
    assert set(found.needed([0, 1, 2, 3])) == {found.event[0], found.event[2]}
    assert found.needed([3]) == [found.event[3]]


@pytest.mark.parametrize("made", [0, 1, 4, 63, 64])
def test_few_feasible_sets_and_few_others_can_be_had(made: int) -> None:
    design = SPACE.design(64, 1)
    outcome, few = np.column_stack([np.full(64, np.nan), design[:, 1]]), np.argsort(design[:, 0])[:made]
    outcome[few, 0] = 1.0 + design[few, 1]
    found = emulated(design, outcome, 1.5, 0.5)
    assert found.each[0].sets == made
    posterior = posterior_of(found, 1000)
    assert np.isfinite(posterior.log_density).all()
    assert np.abs(np.median(posterior.unit[:, 1]) - 0.5) < 0.1
    assert np.isfinite(drawn(found.each[0], posterior.unit)).all()
    low, high = found.feasible(np.array([[0.02, 0.5], [0.98, 0.5]]))[:, 0]
    assert low > high - 0.02
    if made in {0, 63, 64}:
        assert (low > 0.8) == (made > 0)


def test_few_points_are_not_believed_and_more_are_drawn_where_they_weigh(known: Emulators) -> None:
    few, many = (posterior_of(known, points) for points in (100, 2000))
    assert not few.converged
    assert few.points == 800
    assert many.converged
    assert 2000 < many.points < 8 * 2000  # the prior alone does not do, and it stops as soon as it may
    assert words_of(0.1, converged=False).startswith("undetermined")
    shares = (0.1, 0.5, 0.9)
    assert [words_of(share, converged=True) for share in shares] == ["identified", "narrowed", "not identified"]


def test_weights_are_those_of_the_density_from_wherever_points_are_drawn(known: Emulators) -> None:
    """Means and deviations beside those of a grid over parameters and both discrepancies."""
    posterior = posterior_of(known, 10_000)
    coarse = np.stack(np.meshgrid(*[np.linspace(-3.0, 3.0, 13)] * 2), axis=-1).reshape(-1, 2)
    fine = norm.ppf(np.stack(np.meshgrid(*[np.linspace(0.02, 0.98, 25)] * 2), axis=-1)).reshape(-1, 2)
    density = Density(known, SPACE)
    total = np.zeros(len(fine))
    for one in coarse:
        # Uniform steps in the cube: the prior's normal density of the parameters is not counted.
        points = np.column_stack([fine, np.broadcast_to(one, fine.shape)])
        total += np.exp(density(points) + 0.5 * np.sum(fine**2, axis=1))
    unit, weight = norm.cdf(fine), total / total.sum()
    mean = weight @ unit
    np.testing.assert_allclose(posterior.unit.mean(axis=0), mean, atol=0.02)
    np.testing.assert_allclose(posterior.unit.std(axis=0), np.sqrt(weight @ (unit - mean) ** 2), rtol=0.15)


def test_an_impossible_observation_is_a_discrepancy() -> None:
    """Those that agree and one that no parameter gives: it does not bend the others."""
    design = SPACE.design(64, 1)
    outcome = np.concatenate([_known(design), design, 5.0 + 0.1 * design[:, :1]], axis=1)
    posterior = posterior_of(emulated(design, outcome, *_known(TRUTH)[0], *TRUTH[0], 0.0, deviation=0.05), 4000)
    middle = dict(zip(posterior.groups, np.median(posterior.discrepancy, axis=0), strict=True))
    assert middle.pop("e") > 20.0
    assert max(middle.values()) < 2.0
    assert np.abs(np.median(posterior.unit, axis=0) - TRUTH[0]).max() < 0.1


# --- the real engine --------------------------------------------------------------------------------------------------

TRUE = {"friction": 0.1, "drag": 2.0}
REDUCED: dict[str, Any] = {
    "title": "Friction and drag from three speeds",
    "case": "fig1b",
    "set": {"dimers": {"replicates": 1}, "run": {"cycles": 10, "settling_cycles": 6, "samples_per_cycle": 10}},
    "parameters": {
        "friction": {
            "keys": ["contact.friction.bead_wall", "contact.friction.bead_bead"],
            "range": [0.04, 0.25],
            "log": True,
        },
        "drag": {"keys": ["liquid.viscosity_ratio"], "range": [0.4, 10.0], "log": True},
    },
    "experiments": {
        "slow": {"drive.frequency": "60 Hz", "drive.peak_acceleration": "3 g"},
        "fast": {"drive.frequency": "90 Hz", "drive.peak_acceleration": "3 g"},
        "strong": {"drive.frequency": "90 Hz", "drive.peak_acceleration": "6 g"},
    },
    "held_out": {"ratio": ["r"]},
    "design": {"waves": [12, 6, 4], "predictive": 2, "points": 3000, "seed": 2},
}


def reduced(values: dict[str, float]) -> dict[str, Any]:
    observations = [
        {"name": name, "group": "v", "of": [name], "value": f"{value} m/s", "deviation": f"{0.03 * value} m/s"}
        for name, value in values.items()
    ]
    ratio = {"name": "ratio", "group": "r", "of": ["fast"], "over": ["slow"], "deviation": 0.03}
    ratio["value"] = values["fast"] / values["slow"]
    return {**copy.deepcopy(REDUCED), "observations": [*observations, ratio]}


def small(folder: Path, **changes: Any) -> Calibration:
    """The reduced calibration, other tables in place of its own."""
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3}) | changes
    return read_calibration(document, source="small", name="small", folder=folder)


def run_sets(found: Calibration, values: list[list[float]], out: Path, options: Options) -> Wave:
    sets = np.array(values)
    return run_wave(found, Space(found.parameters).unit(sets), wave_sweep(found, sets, "sets"), out, options)


def test_known_parameters_are_found_from_what_the_engine_made_of_them(tmp_path: Path) -> None:
    out = tmp_path / "runs"
    wave = run_sets(small(tmp_path), [list(TRUE.values())], out, Options(2))
    assert not wave.failures
    document = reduced(dict(zip(REDUCED["experiments"], wave.outcome[0, :3].tolist(), strict=True)))
    document["observations"].append({**document["observations"][0], "name": "again", "derived": True})
    file = tmp_path / "reduced.toml"
    file.write_text(to_toml(document))
    told = call("calibrate", str(file), "--out", str(out), "--to", str(tmp_path / "here"), check=True).stdout
    names = "posterior.parquet calibration.json calibration.md corner.png predictions.png"
    assert [Path(line).name for line in told.splitlines()] == names.split()
    said = json.loads((tmp_path / "here" / "calibration.json").read_text())
    assert said["sets"] == 22
    assert said["posterior"]["converged"]
    page = (tmp_path / "here" / "calibration.md").read_text()
    assert "not converged" not in page
    assert ("published" in page, "| observation | measured |" in page) == (False, True)
    for name, true in TRUE.items():
        low, middle, high = said["intervals"][name]
        assert low * 0.97 < true < high * 1.03, name
        # Less of both gives the three speeds nearly as well: the engine tells them apart, so few sets do not.
        assert middle == pytest.approx(true, rel=0.6), name
        assert said["best"][name] == pytest.approx(true, rel=0.5), name
    assert (said["agree"], said["of"], len(said["observations"])) == (4, 4, 5)  # what is derived does not count
    assert said["emulators_checked"] == 10
    assert said["emulators_within_two_errors"] >= 0.6
    samples = pd.read_parquet(tmp_path / "here" / "posterior.parquet")
    assert {"friction", "drag", "discrepancy_v", "discrepancy_r", "log_density"} == set(samples.columns)
    for row in said["observations"]:
        assert row["engine"] == pytest.approx(row["value"], rel=0.03)  # of the best set
        assert row["half_step"] == pytest.approx(row["engine"], rel=0.02)
        assert list(row["held_out"]) == (["ratio"] if row["group"] == "r" else [])
        for middle, width in row["held_out"].values():
            assert middle == pytest.approx(row["value"], abs=max(0.05, 2.0 * width))
    # Everything is there: again is no run, and the same outcome.
    runs = {path.name: path.stat().st_mtime_ns for path in out.glob("*/manifest.json")}
    again = calibrate(load_calibration(file), out, Options(2))
    assert {path.name: path.stat().st_mtime_ns for path in out.glob("*/manifest.json")} == runs
    assert json.loads(json.dumps(record_of(again)["intervals"])) == said["intervals"]
    for figure in figures_of(again, said["observations"]).values():
        assert spoilt(figure) == []


def test_beads_that_came_apart_are_no_walker(tmp_path: Path) -> None:
    """They roll fast, each for itself; there is nothing to be observed."""
    few = {"dimers": {"replicates": 1}, "run": {"cycles": 40, "settling_cycles": 20, "samples_per_cycle": 10}}
    wet = {"liquid": {"volume_fraction": 0.01, "law": "soulie"}, "contact": {"rolling_friction": 0.003}}
    found = small(
        tmp_path,
        case="fig4b",
        experiments={"strong": {"drive.peak_acceleration": "10 g"}},
        observations=reduced(dict.fromkeys(REDUCED["experiments"], 1e-3))["observations"][2:3],
        held_out={},
        set=few | wet,
    )
    wave = run_sets(found, [[0.1, 0.5], [0.2, 9.9]], tmp_path / "runs", Options(2))
    whole, apart = wave.table["separated_fraction"]
    assert whole < 0.1
    assert apart > 0.5
    assert wave.outcome[0, 0] == pytest.approx(wave.table["velocity"][0])
    assert np.isnan(wave.outcome[1, 0])


def test_values_have_their_units_and_guesses_lead_the_first_wave(tmp_path: Path) -> None:
    angle = {"keys": ["liquid.contact_angle"], "range": [0.0, 60.0], "unit": "deg"}
    guesses = [{"angle": 30.0, "drag": 2.0, "friction": 0.1}]
    found = small(tmp_path, parameters={**REDUCED["parameters"], "angle": angle}, guesses=guesses)
    case = next(iter(wave_sweep(found, np.array(found.guesses), "units").cases()))
    assert case.liquid.contact_angle == pytest.approx(np.pi / 6.0)
    unit = next_wave(found, np.zeros((0, 3)), np.zeros((0, 4)), 12, 0)
    assert len(unit) == 13
    np.testing.assert_allclose(Space(found.parameters).values(unit[0]), [0.1, 2.0, 30.0])


def test_a_set_that_loses_its_beads_is_told_and_not_run_again(tmp_path: Path) -> None:
    """A step ten times beyond the viscous limit; whoever goes on finds what is left of it, and the rest finished."""
    step = {**REDUCED["set"]["run"], "time_step": "40 us", "allow_unstable": True}
    settings = {**REDUCED["set"], "run": step, "contact": {"minimum_separation_ratio": 1e-3}}
    found, runs = small(tmp_path, set=settings), tmp_path / "runs"
    wave = run_sets(found, [[0.1, 9.0]], runs, Options(2))
    assert {failure.reason for failure in wave.failures} <= FINAL
    assert np.isnan(wave.outcome[0]).all()
    remains = {path: path.stat().st_mtime_ns for path in runs.rglob("failure.json")}
    assert len(remains) == len(wave.failures) == 3
    assert run_sets(found, [[0.1, 9.0]], runs, Options(2, final=FINAL)).failures == wave.failures
    assert {path: path.stat().st_mtime_ns for path in runs.rglob("failure.json")} == remains


# --- files ------------------------------------------------------------------------------------------------------------


def test_the_example_of_the_docs_can_be_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "calibrate.md").read_text()
    document = tomllib.loads(page.split("```toml\n")[1].split("```")[0])
    found = read_calibration({**document, "case": "fig1b"}, source="docs", name="docs", folder=tmp_path)
    assert {one.group for one in found.observations} == {"speeds"}


@pytest.mark.parametrize("name", shipped("calibration"))
def test_shipped_calibrations_can_be_run(name: str) -> None:
    found = load_calibration(name)
    sweep = wave_sweep(found, Space(found.parameters).values(np.full((1, len(found.parameters)), 0.5)), name)
    cases = list(sweep.cases())
    assert len(cases) == len(found.experiments)
    assert found.file.published  # not measured by the reader


def _bad(path: str, value: Any, folder: Path) -> Calibration:
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3})
    document["observations"][3]["derived"] = True
    *tables, key = path.split("/")
    table: Any = document
    for name in tables:
        table = table[int(name)] if isinstance(table, list) else table[name]
    table[key] = value
    return read_calibration(document, source="bad.toml", name="bad", folder=folder)


_BOTH = {"observations": ["slow", "fast"], "share": 0.5}


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        ("parameters/drag/range", [3.0, 1.0], r"parameters\.drag\.range"),
        ("parameters/drag/range", [0.0, 1.0], r"parameters\.drag\.range"),  # it is logarithmic
        ("parameters/drag/range", [1.0, 2.0, 3.0], r"drag\.range.*has 3 values; expected .*2, such as \[0\.05, 0\.5\]"),
        ("parameters/drag/rang", [0.0, 1.0], r"parameters\.drag\.rang.*range"),
        ("parameters/drag/keys", ["contact.friction.bead_wall"], r"set by friction already"),
        ("parameters/drag/experiments", [], r"parameters\.drag\.experiments"),
        ("parameters/drag/experiments", ["slow"], r"no parameter sets liquid\.viscosity_ratio for fast, strong"),
        ("observations/0/of", ["slo"], r'observations\[0\]\.of.*"slow"'),
        ("observations/3/over", ["fast"], r"observations\[3\]\.over: expected other experiments"),
        ("observations/0/value", 1.0, r"observations\[0\]\.value.*speed"),
        ("observations/3/value", "1 mm/s", r"observations\[3\]\.value.*ratio"),
        ("observations/3/derived", 3, r"observations\[3\]\.derived"),
        ("experiments/fast/dimers.angle", "3 deg", r"experiments\.fast"),
        ("guesses", [{"friction": 0.1}], r"guesses\[0\]\.drag.*missing"),
        ("guesses", [{"friction": 0.1, "drag": 11.0}], r"guesses\[0\]\.drag.*0\.4 to 10"),
        ("held_out", {"x": ["v"]}, r"held_out\.x"),  # all but what is derived
        ("shared_errors", {"x": _BOTH | {"observations": ["slow", "fats"]}}, r'errors\.x\.observations.*"fats".*fast'),
        ("shared_errors", {"x": _BOTH | {"observations": ["slow", "slow"]}}, r"errors\.x\.observations.*once"),
        ("shared_errors", {"x": _BOTH | {"observations": ["slow"]}}, r"shared_errors\.x"),
        ("shared_errors", {"x": _BOTH | {"share": 1.0}}, r"shared_errors\.x\.share"),
        ("shared_errors", {"x": _BOTH, "y": _BOTH}, r"shared_errors.*slow to have an error of its own.*x, y"),
        ("observations", [], "observations"),
    ],
)
def test_a_bad_calibration_is_told_by_its_key(path: str, value: Any, told: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=told):
        _bad(path, value, tmp_path)


def test_a_key_that_is_none_of_a_case_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="viscosity_ratio"):
        calibrate(_bad("parameters/drag/keys", ["liquid.viscosity_ration"], tmp_path), tmp_path, Options(1))
    experiments = {name: {"drive.frequency": "170 Hz"} for name in REDUCED["experiments"]}
    parameters = {"drag": REDUCED["parameters"]["drag"]}
    pile = small(tmp_path, case="pile-ci", set={}, experiments=experiments, parameters=parameters)
    with pytest.raises(InputError, match="expected a case of dimers"):
        calibrate(pile, tmp_path, Options(1))
