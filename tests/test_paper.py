"""The paper's figures, and its facts beside ours, from shortened sweeps of the real engine."""

import shutil
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from studies.paper.comparison import _text_of, compare
from studies.paper.figures import theory_of_cycles
from studies.paper.make import FIGURES, make_figures, page_of
from studies.paper.sources import (
    NothingFinishedError,
    Sources,
    facts_sweep_name,
    parameter_sets,
    ruby,
    sweep_of,
)
from tests.printed import letters, spoilt
from walkers.arrays import FloatArray
from walkers.calibration.observations import quantities_of_run
from walkers.inputs.keys import flatten
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.sweep import SweepDefinition, expand
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure.gait import gait
from walkers.sweeps.record import read_sweep_record, write_record
from walkers.sweeps.scheduler import SweepOptions, plan_sweep, run_sweep
from walkers.theory.mathieu import Alignment, alignment
from walkers.theory.paper_range import outside_of_the_paper
from walkers.theory.prediction import alignment_of, motion_of, predicted_column

FillOnce = Callable[[str, Callable[[Path], object]], Path]
SHORT = {"dimers.replicates": 2, "run.cycles": 8, "run.settling_cycles": 4}
FEWER_POINTS: dict[str, dict[str, Any]] = {
    "fig2": {
        "drive.frequency": ["60 Hz", "90 Hz"],
        "drive.peak_acceleration": ["2 g", "4 g", "6 g"],
    },
    "fig2-threshold": {"drive.frequency": ["60 Hz", "90 Hz"]},
    "fig2-ramp": {"drive.frequency": ["60 Hz", "90 Hz"]},
    "fig3": {},
    "fig4": {},
    "alignment": {"dimers.angle": ["0 deg", "15 deg"]},
}
"""Axes of the shipped sweeps that are shortened, by sweep."""
CHANGES: dict[str, dict[str, Any]] = {
    "fig2-ramp": {"drive.ramp": [["0 s", 0.6], ["0.6 s", 0.2]]},
    "alignment": SHORT | {"run.cycles": 50},  # three images 0.3 s apart
}
"""Values in place of the `SHORT` ones, by sweep."""
SHORT_DESCENT = {"from": "1.2 g", "to": "0.2 g", "step": "0.2 g"}
FACTS = list(map(facts_sweep_name, parameter_sets()))
"""Names of the sweeps of all experiments of the calibration, one for each parameter set."""


def shortened_sweep(name: str) -> SweepDefinition:
    """A shipped sweep with fewer points and cycles, under its name."""
    file = shipped("sweep")[name]
    definition = read_toml(file)
    definition["set"] = flatten(definition.get("set", {})) | CHANGES.get(name, SHORT)
    if "axes" in definition:
        definition["axes"] = flatten(definition["axes"]) | FEWER_POINTS[name]
    if "descend" in definition:
        definition["descend"] |= SHORT_DESCENT
    return expand(definition, source=name, name=name, folder=file.parent)


def shortened_facts(name: str, out: Path) -> SweepDefinition:
    """The experiments of the calibration with a parameter set, of one walker and few cycles."""
    whole = sweep_of(name)
    columns = {}
    for key, values in zip(whole.keys, zip(*whole.rows, strict=True), strict=True):
        if key != "run.most_cycles":
            columns[key] = list(values)
    settings = SHORT | {"dimers.replicates": 1}
    definition = {"case": "fig1b", "set": settings, "zip": [columns]}
    return expand(definition, source=name, name=name, folder=out)


def run_shortened(sweep: SweepDefinition, out: Path) -> None:
    _, sweep_failures = run_sweep(sweep, out, SweepOptions(2))
    assert not sweep_failures


@pytest.fixture(scope="session")
def sources(once: FillOnce) -> Sources:
    """Shortened sweeps of the real engine; of the parameter sets one is run.

    The other sets have the points that they share with it.
    """

    def run(out: Path) -> None:
        for name in FEWER_POINTS:
            run_shortened(shortened_sweep(name), out)
        for name in FACTS:
            sweep = shortened_facts(name, out)
            write_record(plan_sweep(sweep, out, SweepOptions(1)).record)
            if name == facts_sweep_name("shipped"):
                run_shortened(sweep, out)

    return Sources(once("paper", run))


@pytest.fixture(scope="session")
def compared(sources: Sources) -> dict[str, Any]:
    """The comparison of these sweeps."""
    return compare(sources)


@pytest.fixture(scope="session")
def facts(compared: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Facts of the comparison, by name."""
    return {fact["name"]: fact for fact in compared["facts"]}


# Γ0 as the paper states it.
@pytest.mark.parametrize(
    ("case", "g", "gamma0"),
    [
        ("fig1b", 2, 0.191),
        ("fig1b", 3, 0.286),
        ("fig1b", 4, 0.381),
        ("fig1b", 5, 0.476),
        ("fig1b", 6, 0.572),
        ("fig4a", 2, 0.735),
        ("fig4b", 10, 3.49),
    ],
)
def test_peak_forces_are_the_papers(case: str, g: int, gamma0: float) -> None:
    force = dimer_of(load_case(case)).gamma0(g * ACCELERATION_OF_ONE_G)
    assert force == pytest.approx(gamma0, rel=3e-3)


@pytest.mark.parametrize(
    "changes", [{}, {"drive.frequency": "60 Hz"}, {"drive.frequency": "90 Hz"}]
)
def test_theory_says_nothing_where_the_paper_measured(changes: dict[str, str]) -> None:
    """Both ends of the measured frequencies are included."""
    assert outside_of_the_paper(load_case("fig1b", changes)) is None


@pytest.mark.parametrize(
    ("changes", "limits"),
    [
        (
            # 10 times as much as at 4 g
            {"drive.peak_acceleration": "40 g"},
            "Γ0 = 3.81 (measured up to 3.5), 40 g (up to 10 g)",
        ),
        ({"drive.frequency": "170 Hz"}, "170 Hz (60 to 90 Hz)"),
    ],
    ids=["40 g", "170 Hz"],
)
def test_theory_says_where_the_paper_measured_nothing(changes: dict[str, str], limits: str) -> None:
    case = load_case("fig1b", changes)
    reason = outside_of_the_paper(case)
    assert reason is not None
    assert limits in reason
    _, reasons = predicted_column([case], "velocity")
    assert reason in reasons


@pytest.mark.parametrize(
    ("experiment", "name"), [("walks", "fig1b"), ("fig4a", "fig4a"), ("fig4b", "fig4b")]
)
def test_the_parameter_set_called_shipped_is_that_of_the_shipped_cases(
    experiment: str, name: str
) -> None:
    cases = dict(
        zip(ruby().experiments, sweep_of(facts_sweep_name("shipped")).cases(), strict=True)
    )
    assert_same_physics(cases[experiment], load_case(name))


def test_the_sensitivity_starts_from_the_shipped_case() -> None:
    assert_same_physics(next(sweep_of("sensitivity").cases()), load_case("fig1b"))


def assert_same_physics(case: Case, shipped_case: Case) -> None:
    """Check that two cases differ in nothing but the length of their run."""
    assert case.contact == shipped_case.contact
    assert case.liquid == shipped_case.liquid
    assert case.excitation == shipped_case.excitation
    assert case.walkers[0].radii == shipped_case.walkers[0].radii


@pytest.fixture(scope="session")
def quantities(sources: Sources) -> dict[str, dict[str, float]]:
    """Quantities of the runs with the shipped parameters, by experiment."""
    runs = sources.table(facts_sweep_name("shipped"))["run"]
    measured = {}
    for label, run in zip(ruby().experiments, runs, strict=True):
        measured[label] = quantities_of_run(run)
    return measured


def test_facts_and_sets_are_those_of_the_calibration(
    facts: dict[str, dict[str, Any]], compared: dict[str, Any]
) -> None:
    assert list(facts) == [observation.name for observation in ruby().file.observations]
    assert list(compared["sets"]) == list(parameter_sets())


def test_a_velocity_is_judged_by_the_run_of_its_set_in_mm_per_s(
    facts: dict[str, dict[str, Any]], quantities: dict[str, dict[str, float]]
) -> None:
    velocity = facts["fig4a_velocity"]["values"]["shipped"]
    assert velocity == pytest.approx(quantities["fig4a"]["velocity"] * 1e3)


def test_a_ratio_is_judged_by_the_runs_of_its_set(
    facts: dict[str, dict[str, Any]], quantities: dict[str, dict[str, float]]
) -> None:
    """Mean velocity at 60 and 90 Hz at 10 g over that at 6 g: it agrees from 0.8 to 1.2."""
    at_10_g = quantities["slide_60_10"]["velocity"] + quantities["slide_90_10"]["velocity"]
    at_6_g = quantities["slide_60_6"]["velocity"] + quantities["slide_90_6"]["velocity"]
    ratio = at_10_g / at_6_g
    plateau = facts["plateau_10g"]
    assert plateau["values"]["shipped"] == pytest.approx(ratio)
    assert plateau["agree"]["shipped"] == (0.8 <= ratio <= 1.2)


def test_a_fact_is_not_judged_by_runs_of_another_set(facts: dict[str, dict[str, Any]]) -> None:
    """Only the shipped set was run at 10 g."""
    values = dict(facts["plateau_10g"]["values"])
    assert values.pop("shipped") is not None
    assert set(values.values()) == {None}


def test_facts_that_agree_are_counted_without_those_that_follow_from_others(
    facts: dict[str, dict[str, Any]], compared: dict[str, Any]
) -> None:
    independent = [fact for fact in facts.values() if not fact["derived"]]
    assert len(independent) < len(facts)
    for name, counts in compared["sets"].items():
        assert counts["agree"] == sum(fact["agree"][name] for fact in independent)
        assert counts["of"] == len(independent)


def test_theory_is_not_judged_by_shortened_runs(facts: dict[str, dict[str, Any]]) -> None:
    """It is of many cycles."""
    velocity = float(motion_of(load_case("fig4a")).velocity[0])
    assert facts["fig4a_velocity"]["theory"] == pytest.approx(velocity * 1e3)


@pytest.fixture(scope="session")
def curve(compared: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Rows of the comparison with the curve of the paper, by the point of the figure."""
    return {row["of"]: row for row in compared["curve"]}


@pytest.mark.parametrize(
    ("point", "velocity"),
    [
        ("Fig. 2, 2 g", 0.30),
        ("Fig. 2, 4 g", 1.23),
        ("Fig. 2, 6 g", 2.96),
        ("Fig. 3, sin δ = 0.000", 0.0),
        ("Fig. 3, sin δ = 0.143", 1.47),
        ("Fig. 3, sin δ = 0.273", 3.42),
        ("Fig. 3, sin δ = 0.333", 4.88),
    ],
)
def test_the_papers_curve_stands_beside_ours_uncounted(
    curve: dict[str, dict[str, Any]],
    facts: dict[str, dict[str, Any]],
    point: str,
    velocity: float,
) -> None:
    """Velocities in mm/s follow from κ = 0.033 s/mm."""
    assert curve[point]["curve"] == pytest.approx(velocity, abs=0.006)
    assert point not in facts


def test_velocities_beside_the_papers_curve_are_means_over_the_frequencies(
    sources: Sources, curve: dict[str, dict[str, Any]]
) -> None:
    table = sources.table("fig2").sort_values("drive.frequency")
    rows = table[np.isclose(table["drive.peak_acceleration"], 4.0)]
    at_60_hz, at_90_hz = 1e3 * rows["velocity"]
    point = curve["Fig. 2, 4 g"]
    assert point["engine"] == pytest.approx((at_60_hz + at_90_hz) / 2.0)
    assert point["by_frequency"] == pytest.approx(at_90_hz / at_60_hz)


@pytest.fixture(scope="session")
def comparison_page(compared: dict[str, Any]) -> str:
    return page_of(compared)


def test_the_page_of_the_comparison_says_every_fact(
    comparison_page: str, facts: dict[str, dict[str, Any]]
) -> None:
    for fact in facts.values():
        assert fact["says"] in comparison_page
        assert fact["expected"] in comparison_page


def test_the_page_of_the_comparison_has_a_row_for_each_entry(
    comparison_page: str, facts: dict[str, dict[str, Any]]
) -> None:
    """Of parameters and their title row, of facts, of two frequencies, and of the curve.

    Parameters of all sets have a row each, also those that only some laws of friction have. The
    curve has three points of Fig. 2 and six of Fig. 3. Each table has two lines of heads.
    """
    numbers = []
    for part in comparison_page.split("\n\n"):
        if part.startswith("|"):
            lines = part.splitlines()
            columns = {line.count("|") for line in lines}
            assert len(columns) == 1
            numbers.append(len(lines) - 2)
    symbols = set()
    for parameter_set in parameter_sets().values():
        for parameter in parameter_set.calibration.file.parameters.values():
            symbols.add(parameter.symbol)
    assert numbers == [1 + len(symbols), len(facts), 2, 3 + 6]


def test_thresholds_of_descents_and_ramps_agree(compared: dict[str, Any]) -> None:
    """All are below the smallest drive of Fig. 2, 2 g or Γ0 = 0.191."""
    assert len(compared["thresholds"]) == 2
    for row in compared["thresholds"]:
        assert 0.0 < row["gamma0_at_rest"] < row["gamma0_moving"] < 0.191
        assert row["gamma0_at_rest"] - row["within"] < row["ramp"]
        assert row["ramp"] < row["gamma0_moving"] + row["within"]


@pytest.mark.parametrize(
    ("name", "panels"),
    [
        ("fig1b", ["a", "b", "c"]),
        ("fig2", []),
        ("fig2-threshold", []),
        ("fig3", []),
        ("fig4", ["a", "b"]),
    ],
)
def test_figures_can_be_printed(sources: Sources, name: str, panels: list[str]) -> None:
    figure = FIGURES[name].draw(sources)
    assert spoilt(figure) == []
    assert letters(figure) == panels


def without_runs(sources: Sources, number: int | None, folder: Path) -> Sources:
    """The sweeps in another folder, each without so many of its first runs, or without any."""
    lost: set[str] = set()
    names = [*FEWER_POINTS, *FACTS]
    for name in names:
        lost.update(read_sweep_record(sources.out / name).runs[:number])
    for path in sources.out.iterdir():
        if path.name in names:
            shutil.copytree(path, folder / path.name)
        elif path.name not in lost:
            (folder / path.name).symlink_to(path)
    return Sources(folder)


# Not of Fig. 1b, a picture, which takes seconds.
DRAWN_FROM_SWEEPS = ["fig2", "fig2-threshold", "fig3", "fig4"]


@pytest.mark.parametrize("name", DRAWN_FROM_SWEEPS)
def test_figures_do_without_a_run_that_failed(sources: Sources, name: str, tmp_path: Path) -> None:
    FIGURES[name].draw(without_runs(sources, 1, tmp_path))


@pytest.mark.parametrize("name", DRAWN_FROM_SWEEPS)
def test_figures_are_not_drawn_without_any_run(sources: Sources, name: str, tmp_path: Path) -> None:
    remaining = without_runs(sources, None, tmp_path)
    with pytest.raises(NothingFinishedError):
        FIGURES[name].draw(remaining)


@pytest.mark.parametrize(
    ("number", "lost", "left"),
    [(1, ["walks"], ["fig4a_velocity"]), (None, ["walks", "fig4a_velocity"], [])],
    ids=["the first run of each sweep", "all runs"],
)
def test_the_comparison_does_without_runs_that_failed(
    sources: Sources, tmp_path: Path, number: int | None, lost: list[str], left: list[str]
) -> None:
    """A fact without its runs does not agree, and its row says "no walker"."""
    comparison = compare(without_runs(sources, number, tmp_path))
    missing = []
    for fact in comparison["facts"]:
        if fact["values"]["shipped"] is None:
            missing.append(fact["name"])
            assert not fact["agree"]["shipped"]
    assert set(lost) <= set(missing)
    assert not set(left) & set(missing)
    page = page_of(comparison)
    assert page.count("no walker") >= len(missing)


def test_the_theory_of_fig4_goes_through_the_cycle_as_the_engine_does(sources: Sources) -> None:
    """Phase and sign: curves lie on the engine's samples within a tenth of their range."""
    table = sources.finished("fig4").set_index("liquid.name")
    trajectory = sources.trajectory(table["run"]["Si AK5"])
    motion = gait(trajectory)
    last_cycles = slice(-2 * trajectory.case.run.samples_per_cycle - 1, None)
    by_engine = [
        motion.velocity[last_cycles, 0],
        motion.rotation[last_cycles, 0, 0],
        motion.rotation[last_cycles, 0, 1],
    ]
    for samples, curve in zip(by_engine, theory_of_cycles(trajectory), strict=True):
        phase_of_samples = np.linspace(0.0, 1.0, len(samples))
        phase_of_curve = np.linspace(0.0, 1.0, len(curve))
        by_theory = np.interp(phase_of_samples, phase_of_curve, curve)
        deviation = np.sqrt(np.mean((by_theory - samples) ** 2))
        assert deviation < 0.1 * np.ptp(samples)


def swung(pendulum: Alignment, theta: FloatArray, start: float, phase: float) -> FloatArray:
    """Angles of the pendulum of Mathieu's equation with sin ψ in place of ψ, from rest."""

    def slope(time: float, state: FloatArray) -> list[float]:
        pull = pendulum.u - 4.0 * pendulum.v * np.cos(2.0 * time + phase)
        return [state[1], -2.0 * pendulum.damping * state[1] - pull * np.sin(state[0])]

    span = (0.0, theta[-1])
    solution = solve_ivp(slope, span, [start, 0.0], t_eval=theta, rtol=1e-8, atol=1e-10)
    angles: FloatArray = solution.y[0]
    return angles


def test_dimers_turn_as_the_pendulum_does_but_as_much_faster_as_their_beads_are_free(
    sources: Sources,
) -> None:
    """From 15°, after the jerk of the start: from cycle 3 to cycle 8.

    The rates of `alignment_of` are those of small angles.
    """
    table = sources.finished("alignment")
    asymmetric = np.isclose(table["dimers.angle"], 15.0) & (table["sin_delta"] > 0.0)
    (run,) = table["run"][asymmetric]
    trajectory = sources.trajectory(run)
    case = trajectory.case
    begin = 3 * case.run.samples_per_cycle
    end = 8 * case.run.samples_per_cycle
    rates = alignment_of(case)
    theta = np.pi * case.excitation.frequency * trajectory.time[: end + 1]
    for number, walker in enumerate(trajectory.walkers):
        psi = trajectory.orientation[: end + 1, number]
        by_pendulum = swung(alignment(case), theta, psi[0], np.pi / 2.0 * walker.facing)
        ratio = (psi[-1] - psi[begin]) / (by_pendulum[-1] - by_pendulum[begin])
        assert ratio == pytest.approx(rates["rate"] / rates["rolling_rate"], rel=0.3)


def test_a_run_that_failed_is_left_out_and_told(tmp_path: Path) -> None:
    """An engine that is stopped at once."""
    options = SweepOptions(1, time_limit=1e-3)
    made = make_figures(tmp_path / "runs", tmp_path / "to", options, only=["fig3"])
    assert made.failures["fig3"]
    for failure in made.failures["fig3"]:
        assert failure.reason == "TimeLimitExceeded"
    assert list(made.left_out) == ["fig3"]
    assert not made.files


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.84985, "0.8498"),
        (0.8503, "0.8503"),
        (0.8523, "0.852"),
        (1.0, "1"),
        (0.7, "0.7"),
        (1e-5, "0"),
        (nan, None),
    ],
)
def test_a_number_of_the_comparison_has_the_digits_that_decide(
    value: float, text: str | None
) -> None:
    """1 ± 0.15 is expected: 0.84985 does not agree, and is not printed as the limit, 0.85."""
    observations = {observation.name: observation for observation in ruby().file.observations}
    assert _text_of(value, observations["frequency_4g"]) == text
