"""Calibrations: facts, priors, emulators, posteriors, and parameters from numbers of the engine."""

from __future__ import annotations

import copy
import json
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from tests.conftest import FillOnce, call, to_toml
from tests.printed import spoilt
from walkers import load, run
from walkers.arrays import FloatArray
from walkers.calibration.calibrate import PROPOSED, Outcome, calibrate, nearest
from walkers.calibration.emulator import LARGEST_DISTANCE, Emulator, Posterior, middle
from walkers.calibration.file import Calibration, Parameter, load_calibration, read_calibration
from walkers.calibration.observations import (
    NO_NUMBERS,
    Observation,
    misalignment,
    quantities_of_run,
    quantities_of_runs,
)
from walkers.calibration.report import calibration_record, calibration_summary, draw_facts
from walkers.errors import InputError
from walkers.inputs.axes import unit_cube
from walkers.inputs.reading import load_case, shipped
from walkers.postprocess.measure.tables import read_columns, write_table
from walkers.runner.run_directory import recomputed
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.table import load_table
from walkers.text import rendered


def make_fact(name: str = "a", **changes: Any) -> Observation:
    """A fact about the experiment "one", in a group of its own."""
    entries = {"name": name, "group": name, "of": ["one"], "deviation": 0.1}
    return Observation(**(entries | changes))


# --- facts ------------------------------------------------------------------------------------

SPEED = make_fact(value=1e-3, deviation=1e-4)
LOWER_LIMIT = make_fact(least=1.0, over=["two"])
UPPER_LIMIT = make_fact(most=0.15, quantity="slip_1")
BOTH_LIMITS = make_fact(least=0.2, most=0.4, quantity="slip_2")
ANGLE = make_fact(value=90.0, deviation=10.0, quantity="smallest_angle")


@pytest.mark.parametrize(
    ("observation", "number", "distance"),
    [
        pytest.param(SPEED, 1.05e-3, 0.5, id="faster"),
        pytest.param(SPEED, 0.8e-3, -2.0, id="much slower"),
        pytest.param(LOWER_LIMIT, 1.7, 0.0, id="above a lower limit"),
        pytest.param(LOWER_LIMIT, 0.95, -0.5, id="below a lower limit"),
        pytest.param(UPPER_LIMIT, 0.35, 2.0, id="above an upper limit"),
        pytest.param(BOTH_LIMITS, 0.3, 0.0, id="between limits"),
        pytest.param(ANGLE, 79.0, -1.1, id="smaller angle"),
    ],
)
def test_a_number_agrees_within_a_deviation_of_what_is_said(
    observation: Observation, number: float, distance: float
) -> None:
    """The distance is in deviations; numbers within the limits have none."""
    assert observation.residual(number) == pytest.approx(distance)
    assert observation.agrees(number) == (abs(distance) <= 1.0)


def test_a_number_that_does_not_exist_agrees_with_no_fact() -> None:
    for observation in (SPEED, LOWER_LIMIT, UPPER_LIMIT, BOTH_LIMITS, ANGLE):
        assert not observation.agrees(np.nan)


@pytest.mark.parametrize(
    ("observation", "text"),
    [
        (SPEED, "1 ± 0.1 mm/s"),
        (LOWER_LIMIT, "at least 1 ± 0.1"),
        (UPPER_LIMIT, "at most 0.15 ± 0.1"),
        (BOTH_LIMITS, "at least 0.2 and at most 0.4 ± 0.1"),
        (ANGLE, "90 ± 10 °"),
    ],
    ids=["speed", "lower limit", "upper limit", "both limits", "angle"],
)
def test_facts_are_printed_with_their_deviation_and_unit(
    observation: Observation, text: str
) -> None:
    assert observation.text == text


NUMBERS = {
    "slow": {**NO_NUMBERS, "velocity": 2e-3, "slip_1": 0.1},
    "fast": {**NO_NUMBERS, "velocity": 4e-3, "slip_1": 0.0},
    "rest": {**NO_NUMBERS, "velocity": 1e-8},
    "backward": {**NO_NUMBERS, "velocity": -1e-3},
    "fast backward": {**NO_NUMBERS, "velocity": -2e-3},
}
"""Velocities, m/s, and sliding in experiments; other numbers do not exist."""


@pytest.mark.parametrize(
    ("of", "quantity", "expected"),
    [
        (["slow", "fast"], "velocity", 3e-3),
        (["slow", "fast"], "slip_1", 0.05),
        (["slow"], "largest_angle", np.nan),
    ],
)
def test_the_number_of_a_fact_is_the_mean_over_its_experiments(
    of: list[str], quantity: str, expected: float
) -> None:
    observation = make_fact(value=1.0, of=of, quantity=quantity)
    assert observation.number_from(NUMBERS) == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("of", "over", "expected"),
    [
        pytest.param(["fast"], ["slow", "fast"], 4.0 / 3.0, id="over a mean"),
        pytest.param(["slow"], ["rest"], np.nan, id="over a walker at rest"),
        pytest.param(["fast backward"], ["backward"], 2.0, id="both backward"),
        pytest.param(["fast"], ["fast backward"], -2.0, id="over a backward walker"),
        pytest.param(["backward"], ["slow"], -0.5, id="of a backward walker"),
    ],
)
def test_numbers_are_ratios_of_means(of: list[str], over: list[str], expected: float) -> None:
    observation = make_fact(value=1.0, of=of, over=over)
    assert observation.number_from(NUMBERS) == pytest.approx(expected, nan_ok=True)


def test_the_misalignment_of_a_walker_is_its_angle_to_the_axis_of_the_drive() -> None:
    """Whichever way it faces: between 0° and 90°."""
    ends = pd.DataFrame({"orientation_end": np.radians([3.0, -8.0, 178.0, 95.0, -270.0])})
    np.testing.assert_allclose(misalignment(ends), [3.0, 8.0, 2.0, 85.0, 90.0])


# --- priors -----------------------------------------------------------------------------------

SHARES = np.linspace(0.0, 1.0, 11)
"""Shares of a prior below the values of a parameter."""


def make_parameter(low: float, high: float, **changes: Any) -> Parameter:
    """A parameter with a range."""
    return Parameter(keys=["key"], range=(low, high), **changes)


def test_a_prior_is_even_over_its_range() -> None:
    values = make_parameter(-1.0, 3.0).values(SHARES)
    np.testing.assert_allclose(values, -1.0 + 4.0 * SHARES)


def test_a_logarithmic_prior_is_even_over_the_logarithm() -> None:
    values = make_parameter(0.1, 10.0, log=True).values(SHARES)
    np.testing.assert_allclose(values, 0.1 * 100.0**SHARES)


def test_a_normal_prior_is_cut_off_at_its_range() -> None:
    """Log-normal around 40 with the width 0.5 of the logarithm, between 10 and 200."""
    values = make_parameter(10.0, 200.0, log=True, normal=(40.0, 0.5)).values(SHARES)
    assert values[0] == pytest.approx(10.0)
    assert values[-1] == pytest.approx(200.0)

    def share_below(value: Any) -> Any:
        return norm.cdf(np.log(value / 40.0) / 0.5)

    whole = share_below(200.0) - share_below(10.0)
    expected = (share_below(values) - share_below(10.0)) / whole
    np.testing.assert_allclose(SHARES, expected, atol=1e-9)


def test_shares_of_a_prior_are_the_inverse_of_its_values() -> None:
    parameter = make_parameter(10.0, 200.0, log=True, normal=(40.0, 0.5))
    np.testing.assert_allclose(parameter.shares(parameter.values(SHARES)), SHARES, atol=1e-9)


# --- emulators and posteriors of known functions ----------------------------------------------


def known_numbers(unit: FloatArray) -> FloatArray:
    """Two numbers of two parameters, which are given as shares of their priors, shape (N, 2)."""
    x, y = unit.T
    return np.stack([3.0 + 2.0 * x + np.sin(3.0 * y), 1.0 + x * y], axis=1)


DESIGN = unit_cube(2, 64, 1)
TRUTH = np.array([[0.4, 0.6]])
FRESH = np.random.default_rng(5).random((200, 2))
"""Parameter sets that are not in the design."""


@pytest.fixture(scope="module")
def emulators() -> tuple[Emulator, Emulator]:
    """Emulators of both known numbers, for the facts a and b that are true at `TRUTH`."""
    fact_a = make_fact("a", value=known_numbers(TRUTH)[0, 0], deviation=0.2)
    fact_b = make_fact("b", value=known_numbers(TRUTH)[0, 1], deviation=0.2)
    numbers = known_numbers(DESIGN)
    return (
        Emulator.fit(fact_a, DESIGN, numbers[:, 0], 1),
        Emulator.fit(fact_b, DESIGN, numbers[:, 1], 1),
    )


NOISY_NUMBERS = DESIGN.sum(axis=1) + 0.2 * np.random.default_rng(3).standard_normal(64)
"""The sum of two parameters with noise."""


@pytest.fixture(scope="module")
def noisy_emulator() -> Emulator:
    """The emulator of `NOISY_NUMBERS`."""
    return Emulator.fit(make_fact(value=1.0, deviation=0.1), DESIGN, NOISY_NUMBERS, 1)


@pytest.mark.parametrize("number", [0, 1])
def test_emulators_know_their_error(number: int, emulators: tuple[Emulator, Emulator]) -> None:
    """More than 90 % of new numbers are within two standard deviations."""
    true = known_numbers(FRESH)[:, number]
    value = emulators[number].numbers(FRESH, np.zeros(200))
    two_sigma_above = emulators[number].numbers(FRESH, np.full(200, 2.0))
    misses = np.abs(value - true)
    assert np.median(misses) < 0.01
    assert np.mean(misses <= two_sigma_above - value + 1e-6) > 0.9


def test_errors_of_emulators_are_never_narrowed(
    emulators: tuple[Emulator, Emulator], noisy_emulator: Emulator
) -> None:
    for emulator in (*emulators, noisy_emulator):
        assert emulator.inflation >= 1.0


def test_errors_of_emulators_are_widened_by_their_inflation(noisy_emulator: Emulator) -> None:
    mean, error = noisy_emulator.process.predict(DESIGN, return_std=True)
    inflated_mean, inflated_error = replace(noisy_emulator, inflation=3.0).predict(DESIGN)
    np.testing.assert_allclose(inflated_mean, mean)
    np.testing.assert_allclose(inflated_error, 3.0 * error)


def test_the_error_of_an_emulator_is_that_of_sets_that_are_left_out(
    noisy_emulator: Emulator,
) -> None:
    """Each set in turn; the kernel stays that of the fit to all sets."""
    misses = []
    for place in range(64):
        is_kept = np.arange(64) != place
        process = copy.deepcopy(noisy_emulator.process)
        process.set_params(kernel=noisy_emulator.process.kernel_, optimizer=None)
        process.fit(DESIGN[is_kept], NOISY_NUMBERS[is_kept])
        misses.append(NOISY_NUMBERS[place] - process.predict(DESIGN[[place]])[0])
    # The error is in deviations of the fact, of 0.1. The emulator keeps the mean and the scale of
    # all sets, which this loop does not: hence the tolerance.
    error = np.sqrt(np.mean(np.square(misses))) / 0.1
    assert noisy_emulator.error == pytest.approx(error, rel=0.1)


@pytest.mark.parametrize(
    ("limit", "distance"),
    [("value", -LARGEST_DISTANCE), ("least", -LARGEST_DISTANCE), ("most", LARGEST_DISTANCE)],
)
def test_what_does_not_exist_is_far_off(limit: str, distance: float) -> None:
    """Beside an upper limit it counts as far too large, otherwise as far too small."""
    numbers = np.where(DESIGN[:, 0] > 0.5, np.nan, 1.0)
    emulator = Emulator.fit(make_fact(**{limit: 1.0}), DESIGN, numbers, 1)
    mean, _ = emulator.predict(np.array([[0.1, 0.5], [0.9, 0.5]]))
    assert mean == pytest.approx([0.0, distance], abs=1.0)


SETS = np.array([[0.1, 0.2], [0.8, 0.7]])
VALUE = known_numbers(TRUTH)[0, 0]


@dataclass(frozen=True)
class KnownProcess:
    """Stands for a fitted Gaussian process: its prediction at `SETS`."""

    mean: FloatArray
    error: FloatArray

    def predict(self, _: FloatArray, return_std: bool) -> tuple[FloatArray, FloatArray]:
        """As of scikit-learn's GaussianProcessRegressor."""
        assert return_std
        return self.mean, self.error


@pytest.mark.parametrize(
    ("limits", "low", "high"),
    [
        pytest.param({"least": VALUE}, 0.0, np.inf, id="above a lower limit"),
        pytest.param({"most": VALUE}, -np.inf, 0.0, id="below an upper limit"),
        pytest.param({"least": VALUE - 0.4, "most": VALUE + 0.2}, -2.0, 1.0, id="between limits"),
    ],
)
def test_the_likelihood_of_a_limit_is_students_probability_of_its_side(
    limits: dict[str, float], low: float, high: float, emulators: tuple[Emulator, Emulator]
) -> None:
    """Low and high are the limits, less `VALUE`, in deviations of 0.2."""
    mean, error = emulators[0].predict(SETS)
    observation = make_fact(**limits, deviation=0.2)
    # An emulator of limits learns distances from the value between them.
    shift = (VALUE - middle(observation)) / 0.2
    emulator = Emulator(observation, KnownProcess(mean + shift, error), 0.0, 1.0)
    distribution = student(4.0, loc=mean, scale=np.hypot(1.0, error))
    probability = distribution.cdf(high) - distribution.cdf(low)
    np.testing.assert_allclose(np.exp(emulator.log_likelihood(SETS)), probability)


def test_the_likelihood_of_a_value_is_students_density(
    emulators: tuple[Emulator, Emulator],
) -> None:
    """Of four degrees of freedom; its width is that of the fact and of the emulator."""
    mean, error = emulators[0].predict(SETS)
    density = student(4.0, loc=mean, scale=np.hypot(1.0, error)).pdf(0.0)
    np.testing.assert_allclose(np.exp(emulators[0].log_likelihood(SETS)), density)


@pytest.fixture(scope="module")
def posterior(emulators: tuple[Emulator, Emulator]) -> Posterior:
    """The posterior of both facts, from 2¹⁴ parameter sets."""
    return Posterior.from_emulators(emulators, 1 << 14, 1)


@pytest.fixture(scope="module")
def posterior_without_b(emulators: tuple[Emulator, Emulator]) -> Posterior:
    """The posterior of fact a alone: b is held out."""
    return Posterior.from_emulators(emulators, 1 << 12, 1, "b")


def test_the_posterior_is_that_of_a_grid(
    posterior: Posterior, emulators: tuple[Emulator, Emulator]
) -> None:
    """Mean and width from the likelihoods at 100 × 100 sets, the middles of equal cells."""
    middles = np.linspace(0.005, 0.995, 100)
    grid = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    weight = np.exp(emulators[0].log_likelihood(grid) + emulators[1].log_likelihood(grid))
    mean = weight @ grid / weight.sum()
    width = np.sqrt(weight @ (grid - mean) ** 2 / weight.sum())
    np.testing.assert_allclose(posterior.samples.mean(axis=0), mean, atol=0.01)
    np.testing.assert_allclose(posterior.samples.std(axis=0), width, rtol=0.05)
    # Effective samples are in proportion to the number of sets: 2¹⁴ of them, 10⁴ of the grid.
    effective = weight.sum() ** 2 / np.sum(weight**2) * 1.6384
    assert posterior.effective_samples == pytest.approx(effective, rel=0.05)


def test_the_best_set_is_the_true_one(posterior: Posterior) -> None:
    np.testing.assert_allclose(posterior.best, TRUTH[0], atol=0.05)


def test_facts_that_are_held_out_have_no_weight(
    posterior: Posterior,
    posterior_without_b: Posterior,
    emulators: tuple[Emulator, Emulator],
) -> None:
    """The number of b is less certain, by more than half, if b is held out."""
    numbers = emulators[1].numbers(posterior.samples, np.zeros(4000))
    numbers_without_b = emulators[1].numbers(posterior_without_b.samples, np.zeros(4000))
    assert numbers_without_b.std() > 1.5 * numbers.std()


def test_derived_facts_have_no_weight(
    posterior_without_b: Posterior, emulators: tuple[Emulator, Emulator]
) -> None:
    emulator_a, emulator_b = emulators
    derived = replace(emulator_b, observation=make_fact("b", value=1.0, derived=True))
    posterior = Posterior.from_emulators([emulator_a, derived], 1 << 12, 1)
    np.testing.assert_array_equal(posterior.samples, posterior_without_b.samples)


@pytest.mark.parametrize(
    ("changes", "best"),
    [
        pytest.param({}, 2, id="all have a weight"),
        pytest.param({"derived": True}, 3, id="the last is derived"),
        pytest.param({"costly": True}, 3, id="the last is costly"),
    ],
)
def test_the_nearest_set_has_the_least_misfit_of_what_has_a_weight(
    changes: dict[str, bool], best: int
) -> None:
    """The last set is the nearest, but for a fact of which it has no number."""
    distances = np.array(  # in deviations: a row for each set, a column for each fact
        [
            [0.0, 0.0, 5.0, 5.0],
            [0.9, 0.9, 0.9, 3.0],
            [0.9, 0.2, 0.2, 2.0],
            [0.2, 0.2, 0.2, np.nan],
        ]
    )
    facts = [make_fact(name, value=1.0) for name in "abc"]
    facts.append(make_fact("d", value=1.0, **changes))
    assert nearest(facts, 1.0 + 0.1 * distances) == best


# --- the real engine --------------------------------------------------------------------------

TRUE_PARAMETERS = {"friction": 0.1, "drag": 2.0}
REDUCED = tomllib.loads("""
title = "Friction and drag from three speeds"
case  = "fig1b"
[set]
drive.frequency     = "90 Hz"
dimers.replicates   = 1
liquid.edge_ratio   = 0.0
run = { cycles = 10, settling_cycles = 6, samples_per_cycle = 10 }
[parameters.friction]
keys  = ["contact.friction.bead_wall", "contact.friction.bead_bead"]
range = [0.04, 0.25]
log   = true
[parameters.drag]
keys  = ["liquid.viscosity_ratio"]
range = [0.4, 10.0]
log   = true
[experiments]
slow   = { drive.frequency = "60 Hz", drive.peak_acceleration = "3 g" }
fast   = { drive.peak_acceleration = "3 g" }
strong = { drive.peak_acceleration = "6 g" }
[sets.guess]
friction = 0.2
drag     = 1.0
[design]
points   = 12
posterior = 16384
seed     = 2
held_out = ["r"]
""")


def make_speed_fact(name: str, speed: float) -> dict[str, Any]:
    """The fact of a speed (m/s) in the experiment of its name, known to 8 %."""
    return {
        "name": name,
        "group": "v",
        "of": [name],
        "value": f"{speed} m/s",
        "deviation": f"{0.08 * speed} m/s",
    }


def make_document(speeds: dict[str, float], slip: float = 0.3) -> dict[str, Any]:
    """`REDUCED` with five facts: three speeds (m/s), a ratio of two, the sliding of a bead.

    Places of the facts: 0 to 2 the speeds, 3 the ratio, 4 the sliding.
    """
    facts = [make_speed_fact(name, speed) for name, speed in speeds.items()]
    ratio = {
        "name": "ratio",
        "group": "r",
        "of": ["fast"],
        "over": ["slow"],
        "deviation": 0.05,
        "value": speeds["fast"] / speeds["slow"],
    }
    sliding = {
        "name": "slip",
        "group": "v",
        "quantity": "slip_1",
        "of": ["strong"],
        "value": slip,
        "deviation": 0.04,
    }
    return {**copy.deepcopy(REDUCED), "observations": [*facts, ratio, sliding]}


SAME_SPEEDS = {"slow": 1e-3, "fast": 1e-3, "strong": 1e-3}


def make_calibration(folder: Path, **changes: Any) -> Calibration:
    """The reduced calibration with other tables in place of its own."""
    document = make_document(SAME_SPEEDS) | changes
    return read_calibration(document, source="small", name="small", folder=folder)


def run_experiments(
    calibration: Calibration, values: list[float], out: Path, name: str = "one"
) -> dict[str, dict[str, float]]:
    """Quantities of the experiments at a parameter set, by experiment."""
    sweep = calibration.sweep(name, np.array([values]))
    record, _ = run_sweep(sweep, out, SweepOptions(2))
    quantities = quantities_of_runs(load_table(record.directory))
    return dict(zip(calibration.experiments, quantities, strict=True))


@dataclass(frozen=True)
class FinishedCalibration:
    """A calibration of the engine's own numbers at `TRUE_PARAMETERS`."""

    folder: Path
    """Holds the file ``reduced.toml`` and the runs, with those at the true parameters."""

    @property
    def out(self) -> Path:
        """The folder of the runs."""
        return self.folder / "runs"

    @property
    def results(self) -> Path:
        """The folder of the calibration."""
        return self.out / "reduced"

    @property
    def printed(self) -> str:
        """What the program printed."""
        return (self.folder / "printed.txt").read_text("utf-8")

    @property
    def record(self) -> dict[str, Any]:
        """Contents of the file of the results."""
        record: dict[str, Any] = json.loads((self.results / "calibration.json").read_text())
        return record

    @property
    def best_set(self) -> dict[str, float]:
        """The proposed parameters, by name."""
        best: dict[str, float] = self.record["sets"][PROPOSED[0]]
        return best


@pytest.fixture(scope="module")
def finished(once: FillOnce) -> FinishedCalibration:
    """The reduced calibration with five facts that are true, and one that is derived."""

    def calibrate_reduced(folder: Path) -> None:
        true_values = list(TRUE_PARAMETERS.values())
        numbers = run_experiments(make_calibration(folder), true_values, folder / "runs")
        speeds = {name: quantities["velocity"] for name, quantities in numbers.items()}
        document = make_document(speeds, numbers["strong"]["slip_1"])
        derived = {**document["observations"][0], "name": "again", "derived": True}
        document["observations"].append(derived)
        file = folder / "reduced.toml"
        file.write_text(to_toml(document))
        process = call("calibrate", str(file), "--out", str(folder / "runs"), check=True)
        (folder / "printed.txt").write_text(process.stdout, "utf-8")

    return FinishedCalibration(once("reduced-calibration", calibrate_reduced))


@pytest.mark.slow
@pytest.mark.parametrize("name", TRUE_PARAMETERS)
def test_known_parameters_are_found_from_what_the_engine_made_of_them(
    name: str, finished: FinishedCalibration
) -> None:
    """Within a quarter: the medians of the posterior and the values of the proposed set."""
    low, median, high = finished.record["posterior"][name]
    true = TRUE_PARAMETERS[name]
    assert low < true < high
    assert median == pytest.approx(true, rel=0.25)
    assert finished.best_set[name] == pytest.approx(true, rel=0.25)
    assert f"{median:.3g} ({low:.3g} to {high:.3g})" in finished.printed


@pytest.mark.slow
def test_a_calibration_names_its_files(finished: FinishedCalibration) -> None:
    names = [Path(line).name for line in finished.printed.splitlines()[-5:]]
    assert names == [
        "posterior.parquet",
        "calibration.json",
        "calibration.md",
        "best.toml",
        "predictions.png",
    ]
    assert "| fact | measured |" in (finished.results / "calibration.md").read_text()
    posterior = pd.read_parquet(finished.results / "posterior.parquet")
    assert list(posterior.columns) == list(TRUE_PARAMETERS)


@pytest.mark.slow
def test_a_calibration_records_the_numbers_of_sets_and_facts(
    finished: FinishedCalibration,
) -> None:
    """Twelve sets of the design and the guess; six facts, of which one is derived."""
    assert finished.record["number"] == 13
    assert finished.record["of"] == 5
    assert len(finished.record["observations"]) == 6
    assert finished.record["effective_samples"][0] > 100.0


@pytest.mark.slow
def test_the_proposed_set_agrees_with_more_facts_than_the_guess(
    finished: FinishedCalibration,
) -> None:
    agree = finished.record["agree"]
    assert agree["guess"] < agree[PROPOSED[0]]
    text = f"{agree['guess']} of 5 measured facts agree within their deviation"
    assert text in finished.printed


@pytest.mark.slow
def test_the_best_case_has_the_proposed_values_and_their_ranges(
    finished: FinishedCalibration,
) -> None:
    """A range is the band of the posterior, widened to the proposed value."""
    best = load_case(finished.results / "best.toml")
    friction = finished.best_set["friction"]
    assert best.contact.friction.bead_wall == pytest.approx(friction, rel=1e-3)
    keys = {"contact.friction.bead_bead": "friction", "liquid.viscosity_ratio": "drag"}
    for key, name in keys.items():
        low, _, high = finished.record["posterior"][name]
        value = finished.best_set[name]
        ends = [min(low, value), max(high, value)]
        assert list(best.uncertain[key]["loguniform"]) == pytest.approx(ends, rel=1e-3)


@pytest.mark.slow
def test_the_fact_that_is_held_out_is_predicted_and_no_other(
    finished: FinishedCalibration,
) -> None:
    (predicted,) = [row for row in finished.record["observations"] if row["predicted"]]
    assert predicted["name"] == "ratio"
    measured = tomllib.loads((finished.folder / "reduced.toml").read_text("utf-8"))
    low, _, high = predicted["predicted"]
    assert low < measured["observations"][3]["value"] < high


@pytest.mark.slow
def test_runs_of_a_calibration_keep_no_dumps(finished: FinishedCalibration) -> None:
    """Those with dumps are the three at the true parameters, which the calibration did not make."""
    dumps = list(finished.out.glob("*/segments/*/beads.bin"))
    assert len(dumps) == 3


@pytest.mark.slow
def test_a_calibration_that_is_repeated_runs_nothing(finished: FinishedCalibration) -> None:
    def times_of_runs() -> dict[str, int]:
        manifests = finished.out.glob("*/manifest.json")
        return {manifest.parent.name: manifest.stat().st_mtime_ns for manifest in manifests}

    times = times_of_runs()
    record = finished.record
    calibration = load_calibration(finished.folder / "reduced.toml")
    again = calibrate(calibration, finished.out, SweepOptions(2))
    assert times_of_runs() == times
    assert json.loads(json.dumps(calibration_record(again))) == record
    assert spoilt(draw_facts(again)) == []


LONE = {"name": "v", "group": "v", "of": ["slow"], "value": "1 mm/s", "deviation": "1 mm/s"}


@pytest.fixture(scope="module")
def rough_and_smooth(once: FillOnce) -> dict[str, dict[str, float]]:
    """Quantities of a walker with much friction in thin liquid, and of one with the reverse."""

    def run_both(folder: Path) -> None:
        calibration = make_calibration(
            folder,
            experiments={"slow": {"drive.peak_acceleration": "6 g"}},
            observations=[LONE],
            design={},
        )
        rough = run_experiments(calibration, [0.2, 0.5], folder / "runs", "rough")
        smooth = run_experiments(calibration, [0.06, 2.0], folder / "runs", "smooth")
        quantities = {"rough": rough["slow"], "smooth": smooth["slow"]}
        (folder / "quantities.json").write_text(json.dumps(quantities))

    folder = once("rough-and-smooth", run_both)
    quantities: dict[str, dict[str, float]] = json.loads((folder / "quantities.json").read_text())
    return quantities


def test_a_bead_that_cannot_slide_rolls_and_one_without_friction_is_dragged(
    rough_and_smooth: dict[str, dict[str, float]],
) -> None:
    """How much the large bead slides, relative to its velocity within the cycle."""
    rough_slip = rough_and_smooth["rough"]["slip_1"]
    assert rough_slip < 0.02
    assert rough_and_smooth["smooth"]["slip_1"] > 5.0 * rough_slip


def test_the_velocity_of_a_walker_is_that_of_rolling_and_of_sliding(
    rough_and_smooth: dict[str, dict[str, float]],
) -> None:
    rough = rough_and_smooth["rough"]
    assert rough["velocity"] == pytest.approx(rough["rotation_1"] + rough["sliding_1"], rel=0.02)


@pytest.fixture(scope="module")
def early_run(once: FillOnce) -> Path:
    """The directory of a run that ended before its last cycle, when its velocity was constant."""

    def run_case(folder: Path) -> None:
        run(load_case("fig1b", {"dimers.replicates": 1}), folder)

    (directory,) = once("early-run", run_case).glob("fig1b-*")
    return directory


def test_a_run_that_ended_early_slides_as_one_of_so_many_cycles(
    early_run: Path, tmp_path: Path
) -> None:
    """The first third of the cycles is left out."""
    early = load(early_run)
    cycles = round(early.result.table("trajectory")["cycle"].max())
    assert cycles < early.case.run.cycles
    changes = {
        "dimers.replicates": 1,
        "run.cycles": cycles,
        "run.settling_cycles": cycles // 3,
    }
    expected = quantities_of_run(run(load_case("fig1b", changes), tmp_path).directory)
    assert quantities_of_run(early_run) == pytest.approx(expected, rel=1e-6, nan_ok=True)
    assert expected["slip_1"] > 0.0


def test_walkers_that_came_apart_have_no_quantities(early_run: Path, tmp_path: Path) -> None:
    """A copy of a run says that their beads were apart for half of the time."""
    directory = tmp_path / early_run.name
    shutil.copytree(early_run, directory)
    columns = read_columns(directory, "walkers")
    columns["separated_fraction"] = columns["separated_fraction"] + 0.5
    with recomputed(directory, ["walkers.parquet"]):
        write_table(directory, "walkers", columns)
    assert np.isnan(list(quantities_of_run(directory).values())).all()


@pytest.fixture
def steady_and_turning(run_directory: Callable[..., Path]) -> Callable[[int], Path]:
    """Run the first one or two of two walkers: the second one starts across the drive."""

    def run_case(replicates: int) -> Path:
        return run_directory(
            dimers={
                "facing": "right",
                "gap_spread": 0.0,
                "angle_spread": "90 deg",
                "replicates": replicates,
            },
            run={"cycles": 12, "settling_cycles": 6, "samples_per_cycle": 20, "seed": 39},
            drive={"peak_acceleration": "3 g"},
        )

    return run_case


def test_a_walker_that_still_turns_is_observed_by_its_angle_alone(
    steady_and_turning: Callable[[int], Path],
) -> None:
    """The other numbers are those of the steady walker beside it, which are those it has alone."""
    both = quantities_of_run(steady_and_turning(2))
    alone = quantities_of_run(steady_and_turning(1))
    assert both.pop("largest_angle") > 30.0  # degrees
    assert alone.pop("largest_angle") < 1.0
    assert both == pytest.approx(alone, rel=1e-6)


def test_a_steady_walker_is_observed_wherever_it_is_in_the_tables(
    steady_and_turning: Callable[[int], Path], tmp_path: Path
) -> None:
    """A copy of a run has the steady walker below the one that still turns."""
    steady_first = steady_and_turning(2)
    steady_last = tmp_path / steady_first.name
    shutil.copytree(steady_first, steady_last)
    with recomputed(steady_last, ["walkers.parquet", "trajectory.parquet"]):
        for name in ("walkers", "trajectory"):
            columns = read_columns(steady_first, name)
            for column, values in columns.items():
                columns[column] = np.roll(values, len(values) // 2)
            write_table(steady_last, name, columns)
    assert read_columns(steady_last, "walkers")["steady"].tolist() == [False, True]
    expected = quantities_of_run(steady_first)
    assert quantities_of_run(steady_last) == pytest.approx(expected)


# --- what is written --------------------------------------------------------------------------

GUESS = "guess"
HIGHEST_POSTERIOR, _, NEAREST = PROPOSED
HELD_OUT_SET = np.array([[0.9, 0.5]])
"""The only parameter set of the posterior that does not know fact b."""


def make_known_outcome(emulators: tuple[Emulator, Emulator], folder: Path) -> Outcome:
    """The outcome of a calibration with known numbers, of the parameters friction and drag.

    Both parameters set the same keys; friction is from 0.04 to 0.25 and drag from 0.4 to 10, on
    logarithmic scales. The posterior is even in friction from 0.4 to 0.6 of its range, and in drag
    over all of its range. Fact b is held out.
    """
    number = np.arange(4096) / 4096.0
    points = np.stack([0.4 + 0.2 * number, number], axis=1)
    even_posterior = Posterior(points, np.full(4096, -np.log(4096.0)), 1)
    calibration = make_calibration(folder)
    parameters = calibration.file.parameters
    parameters["drag"] = parameters["friction"].with_values(range=(0.4, 10.0))
    file = calibration.file.with_values(
        observations=[emulator.observation for emulator in emulators],
        design=calibration.file.design.with_values(held_out=["b"]),
    )
    # Distances of the numbers of facts a and b from their values, in deviations of 0.2.
    true_numbers = known_numbers(TRUTH)[0]
    numbers = {
        GUESS: true_numbers + 0.2 * np.array([1.5, -0.9]),
        HIGHEST_POSTERIOR: true_numbers + 0.2 * np.array([0.5, np.nan]),
        NEAREST: true_numbers + 0.2 * np.array([0.9, 0.9]),
    }
    sets = {
        GUESS: np.array([0.5, 0.5]),
        HIGHEST_POSTERIOR: np.array([0.1, 0.1]),
        NEAREST: np.array([0.9, 0.9]),
    }
    return Outcome(
        replace(calibration, file=file),
        sets,
        numbers,
        10,
        {"a": emulators[0], "b": emulators[1]},
        even_posterior,
        Posterior(HELD_OUT_SET, np.zeros(1), 1),
        {},
    )


@pytest.fixture(scope="module")
def known_record(
    emulators: tuple[Emulator, Emulator], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """The record of the known outcome."""
    outcome = make_known_outcome(emulators, tmp_path_factory.mktemp("known-outcome"))
    return calibration_record(outcome)


def test_the_record_has_the_values_of_sets(known_record: dict[str, Any]) -> None:
    """In the middle of logarithmic ranges: √(0.04 · 0.25) = 0.1 and √(0.4 · 10) = 2."""
    guess = known_record["sets"][GUESS]
    assert guess["friction"] == pytest.approx(0.1)
    assert guess["drag"] == pytest.approx(2.0)


def test_the_record_counts_the_facts_with_which_sets_agree(known_record: dict[str, Any]) -> None:
    assert known_record["agree"] == {GUESS: 1, HIGHEST_POSTERIOR: 1, NEAREST: 2}


def test_the_record_has_quantiles_of_the_prior(known_record: dict[str, Any]) -> None:
    """5, 50 and 95 % of friction, whose range is a factor of 0.25/0.04 = 6.25."""
    expected = 0.04 * 6.25 ** np.array([0.05, 0.5, 0.95])
    assert known_record["prior"]["friction"] == pytest.approx(expected)


def test_the_record_has_quantiles_of_the_posterior(known_record: dict[str, Any]) -> None:
    """5, 50 and 95 % of a posterior that is even from 0.4 to 0.6 of the range."""
    expected = 0.04 * 6.25 ** np.array([0.41, 0.5, 0.59])
    assert known_record["posterior"]["friction"] == pytest.approx(expected, rel=1e-3)


def test_the_record_has_the_ratio_of_parameters_that_set_the_same_keys(
    known_record: dict[str, Any],
) -> None:
    """At a share y, drag is 0.4 · 25^y and friction 0.04 · 6.25^(0.4 + 0.2 y)."""
    share = np.array([0.05, 0.5, 0.95])
    expected = 0.4 * 25.0**share / (0.04 * 6.25 ** (0.4 + 0.2 * share))
    assert known_record["posterior"]["drag/friction"] == pytest.approx(expected, rel=1e-2)
    report = rendered("walkers.calibration", "report.md.j2", {"found": known_record})
    assert "| drag/friction |" in report


def test_the_record_has_the_numbers_of_sets_in_mm_per_s(known_record: dict[str, Any]) -> None:
    """The guess is 1.5 deviations of 0.2 m/s above the value; a number that is missing is None."""
    fact_a, fact_b = known_record["observations"]
    assert fact_a["numbers"][GUESS] == pytest.approx(1e3 * (VALUE + 0.3))
    assert fact_b["numbers"][HIGHEST_POSTERIOR] is None


def test_the_record_predicts_what_is_held_out_by_the_posterior_that_does_not_know_it(
    known_record: dict[str, Any],
) -> None:
    """That posterior is a single set, so that all three quantiles are its number."""
    fact_a, fact_b = known_record["observations"]
    assert fact_a["predicted"] is None
    expected = 1e3 * known_numbers(HELD_OUT_SET)[0, 1]
    assert fact_b["predicted"] == pytest.approx([expected] * 3, rel=0.02)


@pytest.mark.parametrize(
    ("agree", "is_doubted"),
    [
        pytest.param({GUESS: 0, HIGHEST_POSTERIOR: 1}, False, id="one of two"),
        pytest.param({GUESS: 0, HIGHEST_POSTERIOR: 0}, True, id="none of two"),
    ],
)
def test_a_calibration_is_doubted_if_no_set_agrees_with_half_of_the_facts(
    agree: dict[str, int], is_doubted: bool, known_record: dict[str, Any]
) -> None:
    summary = calibration_summary({**known_record, "agree": agree})
    assert ("no set agrees with half" in summary) == is_doubted


# --- files ------------------------------------------------------------------------------------


def test_values_of_parameters_have_their_units(tmp_path: Path) -> None:
    """At the guess, for each of the three experiments."""
    angle = {"keys": ["liquid.contact_angle"], "range": [0.0, 60.0], "unit": "deg"}
    calibration = make_calibration(
        tmp_path,
        parameters={**REDUCED["parameters"], "angle": angle},
        sets={"guess": {"angle": 30.0, "drag": 2.0, "friction": 0.1}},
    )
    sweep = calibration.sweep("units", calibration.values(calibration.sets))
    cases = list(sweep.cases())
    assert len(cases) == 3
    for case in cases:
        assert case.liquid.contact_angle == pytest.approx(np.pi / 6.0)
        assert case.contact.friction.bead_wall == 0.1
        assert case.liquid.viscosity_ratio == 2.0


def test_experiments_have_what_all_set_unless_they_set_it_themselves(tmp_path: Path) -> None:
    """All set 90 Hz, and the slow one sets 60 Hz; without parameter sets, too."""
    cases = list(make_calibration(tmp_path).sweep("as it is").cases())
    assert [round(case.excitation.frequency) for case in cases] == [60, 90, 90]


def test_the_example_of_the_docs_can_be_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "calibrate.md").read_text("utf-8")
    document = tomllib.loads(page.split("```toml\n")[1].split("```")[0])
    document["case"] = "fig1b"
    calibration = read_calibration(document, source="docs", name="docs", folder=tmp_path)
    for observation in calibration.file.observations:
        assert observation.group == "speeds"


@pytest.mark.parametrize("name", shipped("calibration"))
def test_shipped_calibrations_can_be_run(name: str) -> None:
    calibration = load_calibration(name)
    cases = list(calibration.sweep(name, calibration.values(calibration.sets)).cases())
    assert len(cases) == len(calibration.experiments) * len(calibration.file.sets)


@pytest.mark.parametrize("name", shipped("calibration"))
def test_facts_of_shipped_calibrations_are_published_and_have_a_source(name: str) -> None:
    file = load_calibration(name).file
    assert file.published  # not measured by the reader
    for observation in file.observations:
        assert observation.says
        assert observation.source


BAD_PARAMETERS = [
    pytest.param("range", [3.0, 1.0], r"parameters\.drag\.range", id="range backward"),
    pytest.param("range", [0.0, 1.0], r"parameters\.drag\.range", id="log range from 0"),
    pytest.param(
        "range",
        [1.0, 2.0, 3.0],
        r"drag\.range.*has 3 values; expected .*2, such as \[0\.05, 0\.5\]",
        id="range of three values",
    ),
    pytest.param("rang", [0.0, 1.0], r"parameters\.drag\.rang.*range", id="misspelt range"),
    pytest.param("normal", [1.0, 0.0], r"parameters\.drag\.normal", id="prior without a width"),
    pytest.param(
        "keys",
        ["contact.friction.bead_wall"],
        r"sets contact\.friction\.bead_wall for slow.* 2 do",
        id="key that two parameters set",
    ),
    pytest.param("experiments", [], r"parameters\.drag\.experiments", id="no experiments"),
    pytest.param(
        "experiments",
        ["slow"],
        r"sets liquid\.viscosity_ratio for fast.* 0 do",
        id="key that no parameter sets elsewhere",
    ),
]
BAD_FACTS = [
    pytest.param(
        0, {"of": ["slo"]}, r'observations\[0\]\.of.*"slo".*slow', id="misspelt experiment"
    ),
    pytest.param(
        3,
        {"over": ["fast"]},
        r"observations\[3\]\.over: expected other experiments",
        id="ratio to itself",
    ),
    pytest.param(0, {"value": 1.0}, r"observations\[0\]\.value.*speed", id="speed without a unit"),
    pytest.param(
        0,
        {"group": 1},
        r"^bad\.toml: observations\[0\]\.group = 1: expected [^;\n]*$",  # no missing title
        id="number for a group",
    ),
    pytest.param(
        0,
        {"least": "1 mm/s"},
        r"observations\[0\]: expected either a value or limits",
        id="value and limit",
    ),
    pytest.param(3, {"value": "1 mm/s"}, r"observations\[3\]\.value.*ratio", id="unit of a ratio"),
    pytest.param(3, {"derived": 3}, r"observations\[3\]\.derived", id="number for a truth"),
    pytest.param(
        1, {"name": "slow"}, r"observations\[1\]\.name.*name of its own", id="name of two facts"
    ),
]
GUESS_VALUES = {"friction": 0.1, "drag": 1.0}
BAD_SETS = [
    pytest.param({"friction": 0.1}, r"sets\.guess\.drag.*0\.4 to 10", id="value missing"),
    pytest.param(
        GUESS_VALUES | {"drag": 11.0}, r"sets\.guess\.drag.*0\.4 to 10", id="value above its range"
    ),
    pytest.param(GUESS_VALUES | {"drog": 1.0}, r'sets\.guess = "drog".*drag', id="misspelt"),
]


@pytest.fixture
def sound_document() -> dict[str, Any]:
    """A calibration whose ratio, the fact at place 3, is derived."""
    document = make_document(SAME_SPEEDS)
    document["observations"][3]["derived"] = True
    return document


def assert_is_bad(document: dict[str, Any], message: str, folder: Path) -> None:
    """A calibration is an input error with a message."""
    with pytest.raises(InputError, match=message):
        read_calibration(document, source="bad.toml", name="bad", folder=folder)


@pytest.mark.parametrize(("key", "value", "message"), BAD_PARAMETERS)
def test_a_bad_parameter_is_told_by_its_key(
    key: str, value: Any, message: str, sound_document: dict[str, Any], tmp_path: Path
) -> None:
    sound_document["parameters"]["drag"][key] = value
    assert_is_bad(sound_document, message, tmp_path)


@pytest.mark.parametrize(("place", "changes", "message"), BAD_FACTS)
def test_a_bad_fact_is_told_by_its_key(
    place: int,
    changes: dict[str, Any],
    message: str,
    sound_document: dict[str, Any],
    tmp_path: Path,
) -> None:
    sound_document["observations"][place].update(changes)
    assert_is_bad(sound_document, message, tmp_path)


@pytest.mark.parametrize(("guess", "message"), BAD_SETS)
def test_a_bad_parameter_set_is_told_by_its_key(
    guess: dict[str, float], message: str, sound_document: dict[str, Any], tmp_path: Path
) -> None:
    sound_document["sets"]["guess"] = guess
    assert_is_bad(sound_document, message, tmp_path)


def test_a_calibration_without_facts_is_bad(sound_document: dict[str, Any], tmp_path: Path) -> None:
    sound_document["observations"] = []
    assert_is_bad(sound_document, "observations", tmp_path)


def test_experiments_that_set_a_key_must_all_set_it(
    sound_document: dict[str, Any], tmp_path: Path
) -> None:
    sound_document["experiments"]["fast"]["dimers.angle"] = "3 deg"
    message = r"experiments\.slow\.dimers\.angle: missing; .* \[set\]"
    assert_is_bad(sound_document, message, tmp_path)


def test_a_group_that_is_held_out_must_exist(
    sound_document: dict[str, Any], tmp_path: Path
) -> None:
    sound_document["design"]["held_out"] = ["x"]
    assert_is_bad(sound_document, r'design\.held_out.*"x"', tmp_path)


def test_a_fact_must_be_left_that_is_neither_held_out_nor_derived(
    sound_document: dict[str, Any], tmp_path: Path
) -> None:
    """All facts but the derived ratio are in the group v."""
    sound_document["design"]["held_out"] = ["v"]
    assert_is_bad(sound_document, "observations: expected one that is neither", tmp_path)


def test_a_range_with_values_that_a_case_refuses_is_told_before_anything_is_written(
    tmp_path: Path,
) -> None:
    """A restitution of 0.01 is too small."""
    drag = {"keys": ["contact.restitution"], "range": [0.01, 0.9]}
    parameters = REDUCED["parameters"] | {"drag": drag}
    calibration = make_calibration(tmp_path, parameters=parameters, sets={})
    message = r"small: point 0 .*: contact\.restitution = 0\.01: expected more"
    with pytest.raises(InputError, match=message):
        calibrate(calibration, tmp_path / "runs", SweepOptions(1))
    assert not (tmp_path / "runs").exists()


def test_a_case_without_dimers_is_told_before_anything_is_written(tmp_path: Path) -> None:
    experiments = {name: {"drive.frequency": "170 Hz"} for name in REDUCED["experiments"]}
    calibration = make_calibration(tmp_path, case="pile-ci", set={}, experiments=experiments)
    with pytest.raises(InputError, match="expected a case of dimers"):
        calibrate(calibration, tmp_path / "runs", SweepOptions(1))
    assert not (tmp_path / "runs").exists()
