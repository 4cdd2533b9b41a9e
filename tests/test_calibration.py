"""Calibrations: facts, files, emulators of known functions, known parameters from the engine's own numbers."""

import copy
import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from tests.conftest import call, to_toml
from tests.printed import spoilt
from walkers import run
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

# --- facts ------------------------------------------------------------------------------------------------------------


def fact(name: str = "a", **given: Any) -> Observation:
    return Observation(**{"name": name, "group": name, "of": ["one"], "deviation": 0.1, **given})


FACTS = [  # what is said, number, distance in deviations, text
    ({"value": 1e-3, "deviation": 1e-4}, 1.05e-3, 0.5, "1 ± 0.1 mm/s"),
    ({"value": 1e-3, "deviation": 1e-4}, 0.8e-3, -2.0, "1 ± 0.1 mm/s"),
    ({"least": 1.0, "over": ["two"]}, 1.7, 0.0, "at least 1 ± 0.1"),
    ({"least": 1.0, "over": ["two"]}, 0.95, -0.5, "at least 1 ± 0.1"),
    ({"most": 0.15, "quantity": "slip_1"}, 0.35, 2.0, "at most 0.15 ± 0.1"),
    (
        {"least": 0.2, "most": 0.4, "quantity": "slip_2"},
        0.3,
        0.0,
        "at least 0.2 and at most 0.4 ± 0.1",
    ),
    ({"value": 90.0, "deviation": 10.0, "quantity": "smallest_angle"}, 79.0, -1.1, "90 ± 10 °"),
]


@pytest.mark.parametrize(("given", "number", "away", "text"), FACTS)
def test_a_number_agrees_within_a_deviation_of_what_is_said(
    given: dict[str, Any], number: float, away: float, text: str
) -> None:
    one = fact(**given)
    assert one.residual(number) == pytest.approx(away)
    assert (one.agrees(number), one.agrees(np.nan), one.text) == (abs(away) <= 1.0, False, text)


def test_numbers_are_means_and_ratios_of_means() -> None:
    numbers = {
        name: {**NO_NUMBERS, "velocity": v, "slip_1": s}
        for name, v, s in [("a", 2e-3, 0.1), ("b", 4e-3, 0.0)]
    }
    numbers["rest"] = {**NO_NUMBERS, "velocity": 1e-8}
    for given, expected in [
        ({"of": ["a", "b"]}, 3e-3),
        ({"of": ["b"], "over": ["a", "b"]}, 4.0 / 3.0),
        ({"of": ["a"], "over": ["rest"]}, np.nan),  # a ratio to nothing
        ({"of": ["a", "b"], "quantity": "slip_1"}, 0.05),
        ({"of": ["a"], "quantity": "largest_angle"}, np.nan),
    ]:
        assert fact(value=1.0, **given).number_from(numbers) == pytest.approx(expected, nan_ok=True)
    # Of walkers that walk backward, and of which one does.
    numbers |= {name: {**NO_NUMBERS, "velocity": -v} for name, v in [("-a", 1e-3), ("-b", 2e-3)]}
    for of, over, expected in [("-b", "-a", 2.0), ("b", "-b", -2.0), ("-a", "a", -0.5)]:
        assert fact(value=1.0, of=[of], over=[over]).number_from(numbers) == pytest.approx(expected)
    ends = pd.DataFrame({"orientation_end": np.radians([3.0, -8.0, 178.0, 95.0, -270.0])})
    np.testing.assert_allclose(misalignment(ends), [3.0, 8.0, 2.0, 85.0, 90.0])


# --- parameters, emulators and posteriors of known functions ----------------------------------------------------------


def parameter(low: float, high: float, **more: Any) -> Parameter:
    return Parameter(keys=["key"], range=(low, high), **more)


def test_values_of_the_prior() -> None:
    shares = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(parameter(-1.0, 3.0).values(shares), -1.0 + 4.0 * shares)
    np.testing.assert_allclose(parameter(0.1, 10.0, log=True).values(shares), 0.1 * 100.0**shares)
    narrow = parameter(10.0, 200.0, log=True, normal=(40.0, 0.5))
    values = narrow.values(shares)
    assert (values[0], values[-1]) == (pytest.approx(10.0), pytest.approx(200.0))
    ends = norm.cdf(np.log(np.array([10.0, 200.0]) / 40.0) / 0.5)
    expected = (norm.cdf(np.log(values / 40.0) / 0.5) - ends[0]) / (ends[1] - ends[0])
    np.testing.assert_allclose(shares, expected, atol=1e-9)
    np.testing.assert_allclose(narrow.shares(values), shares, atol=1e-9)


def known(unit: FloatArray) -> FloatArray:
    """Two numbers of two parameters."""
    x, y = unit.T
    return np.stack([3.0 + 2.0 * x + np.sin(3.0 * y), 1.0 + x * y], axis=1)


DESIGN, TRUTH = unit_cube(2, 64, 1), np.array([[0.4, 0.6]])


@pytest.fixture(scope="module")
def emulators() -> tuple[Emulator, ...]:
    each = zip("ab", known(TRUTH)[0], known(DESIGN).T, strict=True)
    return tuple(
        Emulator.fit(fact(name, value=value, deviation=0.2), DESIGN, column, 1)
        for name, value, column in each
    )


def test_emulators_know_their_error(emulators: tuple[Emulator, ...]) -> None:
    """Also of noise, and as sets that are left out one after the other have it."""
    fresh = np.random.default_rng(5).random((200, 2))
    for emulator, true in zip(emulators, known(fresh).T, strict=True):
        value, above = (emulator.numbers(fresh, np.full(200, sigmas)) for sigmas in (0.0, 2.0))
        assert np.median(np.abs(value - true)) < 0.01
        assert np.mean(np.abs(value - true) <= above - value + 1e-6) > 0.9
    numbers = DESIGN.sum(axis=1) + 0.2 * np.random.default_rng(3).standard_normal(64)
    noisy = Emulator.fit(fact(value=1.0, deviation=0.1), DESIGN, numbers, 1)
    assert min(one.inflation for one in (*emulators, noisy)) >= 1.0
    mean, error = noisy.process.predict(DESIGN, return_std=True)
    np.testing.assert_allclose([mean, 3.0 * error], replace(noisy, inflation=3.0).predict(DESIGN))
    left = []
    for place in range(64):
        others = np.arange(64) != place
        one = copy.deepcopy(noisy.process).set_params(kernel=noisy.process.kernel_, optimizer=None)
        left.append(
            numbers[place] - one.fit(DESIGN[others], numbers[others]).predict(DESIGN[[place]])[0]
        )
    # Without its own share in the mean and the scale.
    assert 10.0 * np.sqrt(np.mean(np.square(left))) == pytest.approx(noisy.error, rel=0.1)


@pytest.mark.parametrize(
    ("given", "far"),
    [("value", -LARGEST_DISTANCE), ("least", -LARGEST_DISTANCE), ("most", LARGEST_DISTANCE)],
)
def test_what_does_not_exist_is_far_off(given: str, far: float) -> None:
    outcome = np.where(DESIGN[:, 0] > 0.5, np.nan, 1.0)
    emulator = Emulator.fit(fact(**{given: 1.0}), DESIGN, outcome, 1)
    assert emulator.predict(np.array([[0.1, 0.5], [0.9, 0.5]]))[0] == pytest.approx(
        [0.0, far], abs=1.0
    )


def test_likelihoods_are_students_of_the_distance_and_of_the_side_of_a_limit(
    emulators: tuple[Emulator, ...],
) -> None:
    at, value = np.array([[0.1, 0.2], [0.8, 0.7]]), known(TRUTH)[0, 0]
    mean, error = emulators[0].predict(at)
    expected = student(4.0, loc=mean, scale=np.hypot(1.0, error))
    for given, probability in [
        ({"value": value}, expected.pdf(0.0)),
        ({"least": value}, expected.sf(0.0)),
        ({"most": value}, expected.cdf(0.0)),
        ({"least": value - 0.4, "most": value + 0.2}, expected.cdf(1.0) - expected.cdf(-2.0)),
    ]:
        one = fact(**given, deviation=0.2)
        shift = (value - middle(one)) / 0.2  # the process learned distances from the value
        process = SimpleNamespace(predict=lambda _, return_std, shift=shift: (mean + shift, error))
        likelihood = Emulator(one, process, 0.0, 1.0).log_likelihood(at)
        np.testing.assert_allclose(np.exp(likelihood), probability)


def test_the_posterior_is_that_of_a_grid_and_of_what_is_used(
    emulators: tuple[Emulator, ...],
) -> None:
    posterior = Posterior.from_emulators(emulators, 1 << 14, 1)
    grid = np.stack(np.meshgrid(*[np.linspace(0.005, 0.995, 100)] * 2), axis=-1).reshape(-1, 2)
    weight = np.exp(np.sum([one.log_likelihood(grid) for one in emulators], axis=0))
    mean = weight @ grid / weight.sum()
    np.testing.assert_allclose(posterior.samples.mean(axis=0), mean, atol=0.01)
    spread = np.sqrt(weight @ (grid - mean) ** 2 / weight.sum())
    np.testing.assert_allclose(posterior.samples.std(axis=0), spread, rtol=0.05)
    np.testing.assert_allclose(posterior.best, TRUTH[0], atol=0.05)
    assert posterior.effective_samples == pytest.approx(
        weight.sum() ** 2 / np.sum(weight**2) * 1.6384, rel=0.05
    )
    without = Posterior.from_emulators(emulators, 1 << 12, 1, "b")
    narrow, wide = (
        emulators[1].numbers(one.samples, np.zeros(4000)).std() for one in (posterior, without)
    )
    assert wide > 1.5 * narrow
    derived = replace(emulators[1], observation=fact("b", value=1.0, derived=True))
    np.testing.assert_array_equal(
        Posterior.from_emulators([emulators[0], derived], 1 << 12, 1).samples, without.samples
    )


def test_the_nearest_set_has_the_least_misfit_of_what_has_a_weight() -> None:
    away = np.array(
        [[0.0, 0.0, 5.0, 5.0], [0.9, 0.9, 0.9, 3.0], [0.9, 0.2, 0.2, 2.0], [0.2, 0.2, 0.2, np.nan]]
    )
    for weight, best in [({}, 2), ({"derived": True}, 3), ({"costly": True}, 3)]:
        facts = [*(fact(name, value=1.0) for name in "abc"), fact("d", value=1.0, **weight)]
        assert nearest(facts, 1.0 + 0.1 * away) == best


# --- the real engine --------------------------------------------------------------------------------------------------

TRUE = {"friction": 0.1, "drag": 2.0}
REDUCED = tomllib.loads("""
title = "Friction and drag from three speeds"
case  = "fig1b"
[set]
drive.frequency     = "90 Hz"
dimers.replicates   = 1
run = { cycles = 10, settling_cycles = 6, samples_per_cycle = 10 }
[parameters]
friction = { keys = ["contact.friction.bead_wall", "contact.friction.bead_bead"], range = [0.04, 0.25], log = true }
drag     = { keys = ["liquid.viscosity_ratio"], range = [0.4, 10.0], log = true }
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


def reduced(speeds: dict[str, float], slip: float = 0.3) -> dict[str, Any]:
    """The reduced calibration with facts: three speeds (m/s), the ratio of two, and the sliding of a bead."""
    facts: list[dict[str, Any]] = [
        {
            "name": name,
            "group": "v",
            "of": [name],
            "value": f"{speed} m/s",
            "deviation": f"{0.08 * speed} m/s",
        }
        for name, speed in speeds.items()
    ]
    ratio = {"name": "ratio", "group": "r", "of": ["fast"], "over": ["slow"], "deviation": 0.05}
    ratio["value"] = speeds["fast"] / speeds["slow"]
    slides = {
        "name": "slip",
        "group": "v",
        "quantity": "slip_1",
        "of": ["strong"],
        "value": slip,
        "deviation": 0.04,
    }
    return {**copy.deepcopy(REDUCED), "observations": [*facts, ratio, slides]}


def small(folder: Path, **changes: Any) -> Calibration:
    """The reduced calibration, other tables in place of its own."""
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3}) | changes
    return read_calibration(document, source="small", name="small", folder=folder)


def numbers(
    found: Calibration, values: list[float], out: Path, options: SweepOptions
) -> dict[str, dict[str, float]]:
    """Quantities of the experiments at a parameter set."""
    record, _ = run_sweep(found.sweep("one", np.array([values])), out, options)
    return dict(
        zip(found.experiments, quantities_of_runs(load_table(record.directory)), strict=True)
    )


@pytest.mark.slow
def test_known_parameters_are_found_from_what_the_engine_made_of_them(tmp_path: Path) -> None:
    """Within a quarter; the second time nothing is run."""
    out, to = tmp_path / "runs", tmp_path / "runs" / "reduced"
    seen = numbers(small(tmp_path), list(TRUE.values()), out, SweepOptions(2))
    document = reduced(
        {name: one["velocity"] for name, one in seen.items()}, seen["strong"]["slip_1"]
    )
    document["observations"].append(
        {**document["observations"][0], "name": "again", "derived": True}
    )
    file = tmp_path / "reduced.toml"
    file.write_text(to_toml(document))
    told = call("calibrate", str(file), "--out", str(out), check=True).stdout
    calibration_summary, names = told.rpartition("\n\n")[0], told.splitlines()[-5:]
    assert [Path(line).name for line in names] == [
        *("posterior.parquet", "calibration.json", "calibration.md", "best.toml", "predictions.png")
    ]
    assert "| fact | measured |" in (to / "calibration.md").read_text()
    said = json.loads((to / "calibration.json").read_text())
    assert (said["number"], said["of"], len(said["observations"])) == (13, 5, 6)
    assert said["effective_samples"][0] > 100.0
    for name, true in TRUE.items():
        low, middle, high = said["posterior"][name]
        assert low < true < high, name
        assert [middle, said["sets"][PROPOSED[0]][name]] == pytest.approx([true, true], rel=0.25), (
            name
        )
        assert f"{middle:.3g} ({low:.3g} to {high:.3g})" in calibration_summary
    assert said["agree"]["guess"] < said["agree"][PROPOSED[0]]
    assert (
        f"{said['agree']['guess']} of 5 measured facts agree within their deviation"
        in calibration_summary
    )
    best, values = load_case(to / "best.toml"), said["sets"][PROPOSED[0]]
    assert best.contact.friction.bead_wall == pytest.approx(values["friction"], rel=1e-3)
    for key, name in (
        ("contact.friction.bead_bead", "friction"),
        ("liquid.viscosity_ratio", "drag"),
    ):
        low, _, high = said["posterior"][name]
        ends = min(low, values[name]), max(high, values[name])
        assert best.uncertain[key]["loguniform"] == pytest.approx(ends, rel=1e-3)
    assert list(pd.read_parquet(to / "posterior.parquet").columns) == list(TRUE)
    predicted = {row["name"]: row["predicted"] for row in said["observations"] if row["predicted"]}
    assert predicted["ratio"][0] < document["observations"][3]["value"] < predicted.pop("ratio")[2]
    assert not predicted
    runs = {path.name: path.stat().st_mtime_ns for path in out.glob("*/manifest.json")}
    assert len([*out.glob("*/segments/*/beads.bin")]) == len(
        seen
    )  # of the runs that the calibration did not make
    again = calibrate(load_calibration(file), out, SweepOptions(2))
    assert {path.name: path.stat().st_mtime_ns for path in out.glob("*/manifest.json")} == runs
    assert json.loads(json.dumps(calibration_record(again))) == said
    assert spoilt(draw_facts(again)) == []


def test_a_bead_that_cannot_slide_rolls_and_one_without_friction_is_dragged(tmp_path: Path) -> None:
    """What a walker is like within the cycle, and that means are those of its table."""
    found = small(
        tmp_path,
        experiments={"slow": {"drive.peak_acceleration": "6 g"}},
        observations=[LONE],
        design={},
    )
    rough = numbers(found, [0.2, 0.5], tmp_path / "runs", SweepOptions(2))["slow"]
    smooth = numbers(found, [0.06, 2.0], tmp_path / "runs", SweepOptions(2))["slow"]
    assert rough["slip_1"] < 0.02
    assert smooth["slip_1"] > 5.0 * rough["slip_1"]
    assert rough["velocity"] == pytest.approx(rough["rotation_1"] + rough["sliding_1"], rel=0.02)


def test_a_run_that_ended_early_slides_as_one_of_so_many_cycles(tmp_path: Path) -> None:
    """Of which the first third is left out."""
    early = run(load_case("fig1b", {"dimers.replicates": 1}), tmp_path)
    cycles = round(early.result.table("trajectory")["cycle"].max())
    assert cycles < early.case.run.cycles
    given = {"dimers.replicates": 1, "run.cycles": cycles, "run.settling_cycles": cycles // 3}
    fixed = quantities_of_run(run(load_case("fig1b", given), tmp_path).directory)
    assert quantities_of_run(early.directory) == pytest.approx(fixed, rel=1e-6, nan_ok=True)
    assert fixed["slip_1"] > 0.0
    # There is nothing to be observed of walkers that came apart.
    with recomputed(early.directory, ["walkers.parquet"]):
        columns = read_columns(early.directory, "walkers")
        write_table(
            early.directory,
            "walkers",
            columns | {"separated_fraction": columns["separated_fraction"] + 0.5},
        )
    assert np.isnan([*quantities_of_run(early.directory).values()]).all()


LONE = {"name": "v", "group": "v", "of": ["slow"], "value": "1 mm/s", "deviation": "1 mm/s"}


def test_a_walker_that_still_turns_is_observed_by_its_angle_alone(
    run_directory: Callable[..., Path],
) -> None:
    """It starts across the drive; the other numbers are those of the steady walker beside it, as it walks alone."""
    start = {"facing": "right", "gap_spread": 0.0, "angle_spread": "90 deg"}
    times = {"cycles": 12, "settling_cycles": 6, "samples_per_cycle": 20, "seed": 39}
    changes = {"run": times, "drive": {"peak_acceleration": "3 g"}}
    both, alone = (
        quantities_of_run(run_directory(dimers={**start, "replicates": count}, **changes))
        for count in (2, 1)
    )
    assert both.pop("largest_angle") > 30.0
    assert alone.pop("largest_angle") < 1.0
    assert both == pytest.approx(alone, rel=1e-6)


# --- what is written --------------------------------------------------------------------------------------------------


def test_the_record_has_quantiles_and_agreement_of_a_known_outcome(
    emulators: tuple[Emulator, ...], tmp_path: Path
) -> None:
    """A posterior even in the first parameter from 0.4 to 0.6 of its range and in the second over all."""
    number = np.arange(4096) / 4096.0
    even = Posterior(
        np.stack([0.4 + 0.2 * number, number], axis=1), np.full(4096, -np.log(4096.0)), 1
    )
    one, other = (emulator.observation for emulator in emulators)
    rows = known(TRUTH) + 0.2 * np.array([[1.5, -0.9], [0.5, np.nan], [0.9, 0.9]])
    calibration = small(tmp_path)
    parameters = calibration.file.parameters
    parameters["drag"] = parameters["friction"].with_values(range=(0.4, 10.0))
    design = calibration.file.design.with_values(held_out=["b"])
    calibration = replace(
        calibration, file=calibration.file.with_values(observations=[one, other], design=design)
    )
    without = Posterior(np.array([[0.9, 0.5]]), np.zeros(1), 1)  # what is held out
    names = ("guess", *PROPOSED[::2])
    sets, seen = (
        zip(names, [[0.5, 0.5], [0.1, 0.1], [0.9, 0.9]], strict=True),
        zip(names, rows, strict=True),
    )
    unit = {name: np.array(row) for name, row in sets}
    found = calibration_record(
        Outcome(
            calibration,
            unit,
            dict(seen),
            10,
            dict(zip("ab", emulators, strict=True)),
            even,
            without,
            {},
        )
    )
    assert found["sets"]["guess"] == {"friction": pytest.approx(0.1), "drag": pytest.approx(2.0)}
    assert list(found["agree"].values()) == [1, 1, 2]
    assert found["posterior"]["friction"] == pytest.approx(
        [0.04 * 6.25**at for at in (0.41, 0.5, 0.59)], rel=1e-3
    )
    assert found["prior"]["friction"] == pytest.approx(
        [0.04 * 6.25**at for at in (0.05, 0.5, 0.95)]
    )
    # Both set the same keys: 25^y/6.25^(0.4 + 0.2 y), that is 10/0.04 ... of equal quantiles.
    ratios = (
        10.0
        * 25.0 ** np.array([0.05, 0.5, 0.95])
        / 6.25 ** (0.4 + 0.2 * np.array([0.05, 0.5, 0.95]))
    )
    assert found["posterior"]["drag/friction"] == pytest.approx(ratios, rel=1e-2)
    assert found["observations"][0]["numbers"]["guess"] == pytest.approx(
        1e3 * (known(TRUTH)[0, 0] + 0.3)
    )
    assert found["observations"][1]["numbers"][PROPOSED[0]] is None
    predicted = [row["predicted"] for row in found["observations"]]
    assert predicted == [None, pytest.approx([1e3 * known(without.points)[0, 1]] * 3, rel=0.02)]
    for agree, doubted in (([0, 1], False), ([0, 0], True)):  # of two facts
        said = calibration_summary({**found, "agree": dict(zip(names, agree, strict=False))})
        assert ("no set agrees with half" in said) == doubted
    assert "| drag/friction |" in rendered("walkers.calibration", "report.md.j2", {"found": found})


# --- files ------------------------------------------------------------------------------------------------------------


def test_values_have_their_units_and_experiments_what_all_set(tmp_path: Path) -> None:
    angle = {"keys": ["liquid.contact_angle"], "range": [0.0, 60.0], "unit": "deg"}
    sets = {"guess": {"angle": 30.0, "drag": 2.0, "friction": 0.1}}
    found = small(tmp_path, parameters={**REDUCED["parameters"], "angle": angle}, sets=sets)
    cases = list(found.sweep("units", found.values(found.sets)).cases())
    assert [round(case.excitation.frequency) for case in cases] == [60, 90, 90]
    for case in cases:
        assert case.liquid.contact_angle == pytest.approx(np.pi / 6.0)
        assert (case.contact.friction.bead_wall, case.liquid.viscosity_ratio) == (0.1, 2.0)
    assert len(list(found.sweep("as it is").cases())) == 3


def test_the_example_of_the_docs_can_be_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "calibrate.md").read_text()
    document = tomllib.loads(page.split("```toml\n")[1].split("```")[0])
    found = read_calibration(
        {**document, "case": "fig1b"}, source="docs", name="docs", folder=tmp_path
    )
    assert {one.group for one in found.file.observations} == {"speeds"}


@pytest.mark.parametrize("name", shipped("calibration"))
def test_shipped_calibrations_can_be_run(name: str) -> None:
    found = load_calibration(name)
    cases = list(found.sweep(name, found.values(found.sets)).cases())
    assert len(cases) == len(found.experiments) * len(found.file.sets)
    assert found.file.published  # not measured by the reader
    for one in found.file.observations:
        assert one.says
        assert one.source


_SET = {"friction": 0.1, "drag": 1.0}


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        ("parameters/drag/range", [3.0, 1.0], r"parameters\.drag\.range"),
        ("parameters/drag/range", [0.0, 1.0], r"parameters\.drag\.range"),  # it is logarithmic
        ("parameters/drag/range", [1.0, 2.0, 3.0], r"drag\.range.*has 3 values; expected .*2, such as \[0\.05, 0\.5\]"),
        ("parameters/drag/rang", [0.0, 1.0], r"parameters\.drag\.rang.*range"),
        ("parameters/drag/normal", [1.0, 0.0], r"parameters\.drag\.normal"),
        ("parameters/drag/keys", ["contact.friction.bead_wall"], r"sets contact\.friction\.bead_wall for slow.* 2 do"),
        ("parameters/drag/experiments", [], r"parameters\.drag\.experiments"),
        ("parameters/drag/experiments", ["slow"], r"sets liquid\.viscosity_ratio for fast.* 0 do"),
        ("observations/0/of", ["slo"], r'observations\[0\]\.of.*"slo".*slow'),
        ("observations/3/over", ["fast"], r"observations\[3\]\.over: expected other experiments"),
        ("observations/0/value", 1.0, r"observations\[0\]\.value.*speed"),
        ("observations/0/group", 1, r"^bad\.toml: observations\[0\]\.group = 1: expected [^;\n]*$"),  # no title missing
        ("observations/0/least", "1 mm/s", r"observations\[0\]: expected either a value or limits"),
        ("observations/3/value", "1 mm/s", r"observations\[3\]\.value.*ratio"),
        ("observations/3/derived", 3, r"observations\[3\]\.derived"),
        ("observations/1/name", "slow", r"observations\[1\]\.name.*name of its own"),
        ("observations", [], "observations"),
        ("experiments/fast/dimers.angle", "3 deg", r"experiments\.slow\.dimers\.angle: missing; .* \[set\]"),
        ("sets/guess", {"friction": 0.1}, r"sets\.guess\.drag.*0\.4 to 10"),
        ("sets/guess", _SET | {"drag": 11.0}, r"sets\.guess\.drag.*0\.4 to 10"),
        ("sets/guess", _SET | {"drog": 1.0}, r'sets\.guess = "drog".*drag'),
        ("design/held_out", ["x"], r'design\.held_out.*"x"'),
        ("design/held_out", ["v"], r"observations: expected one that is neither"),  # all but what is derived
    ],
)  # fmt: skip
def test_a_bad_calibration_is_told_by_its_key(
    path: str, value: Any, told: str, tmp_path: Path
) -> None:
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3})
    document["observations"][3]["derived"] = True
    *tables, key = path.split("/")
    table: Any = document
    for name in tables:
        table = table[int(name)] if isinstance(table, list) else table[name]
    table[key] = value
    with pytest.raises(InputError, match=told):
        read_calibration(document, source="bad.toml", name="bad", folder=tmp_path)


def test_calibrations_that_make_no_sense_are_refused_before_anything_is_written(
    tmp_path: Path,
) -> None:
    """A value of their range that a case refuses; a case without dimers."""
    drag = {"keys": ["contact.restitution"], "range": [0.01, 0.9]}
    beyond = {"parameters": REDUCED["parameters"] | {"drag": drag}, "sets": {}}
    shaken = {name: {"drive.frequency": "170 Hz"} for name in REDUCED["experiments"]}
    for changes, told in (
        (beyond, r"small: point 0 .*: contact\.restitution = 0\.01: expected more"),
        ({"case": "pile-ci", "set": {}, "experiments": shaken}, "expected a case of dimers"),
    ):
        with pytest.raises(InputError, match=told):
            calibrate(small(tmp_path, **changes), tmp_path / "runs", SweepOptions(1))
    assert not (tmp_path / "runs").exists()
