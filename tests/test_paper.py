"""The paper's figures and numbers beside ours, from shortened sweeps of the real engine."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from tests.conftest import call, run_shipped, shipped_sweep
from tests.printed import letters, spoilt
from walkers.inputs.axes import is_axis
from walkers.inputs.keys import flatten
from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.toml import read_toml
from walkers.paper import published
from walkers.paper.comparison import Value, _row, as_dict, as_markdown, compare, count, evaluate
from walkers.paper.figures import OBSERVED, PARAMETERS, sensitivities, theory_of_cycles
from walkers.paper.make import FIGURES, make_figures
from walkers.paper.maps import MODES, classify, climber, paper_drives, sliding_share
from walkers.paper.published import OBSERVATIONS, NothingFinishedError, Observation, Point, Sources
from walkers.postprocess.drawing import save_figure
from walkers.postprocess.gait import gait, steady_walkers
from walkers.postprocess.results import read
from walkers.sweeps.scheduler import Options
from walkers.sweeps.table import read_record
from walkers.theory.mathieu import turning
from walkers.theory.prediction import alignment_of, motion_of, pendulum_of
from walkers.theory.quasistatic import mean_velocity

SHORT = {"dimers.replicates": 2, "run.cycles": 8, "run.settling_cycles": 4, "run.time_step": "3.9 us"}
FEWER: dict[str, dict[str, Any]] = {
    "fig2": {
        "drive.frequency": ["60 Hz", "90 Hz"],
        "drive.peak_acceleration": ["2 g", "3 g", "4 g", "5 g", "6 g", "10 g"],
    },
    "fig2-threshold": {"drive.frequency": ["60 Hz", "90 Hz"]},
    "fig3": {},
    "fig4": {},
    "alignment": {"dimers.angle": ["0 deg", "15 deg"]},
    "modes": {"dimers.sin_delta": [0.0, 0.2], "drive.gamma0": [0.05, 0.15, 0.5]},
}
COMPARED = [number for number in OBSERVATIONS.values() if number.compared]


@pytest.fixture(scope="session")
def sources(once: Callable[[str, Callable[[Path], object]], Path]) -> Sources:
    """The shipped sweeps with fewer points and cycles, under their names."""

    def run(out: Path) -> None:
        for name, axes in FEWER.items():
            given = shipped_sweep(name, SHORT, axes)
            if name == "alignment":
                given["set"] |= {"run.cycles": 50}  # three images 0.3 s apart
            if "descend" in given:
                given["descend"] |= {"from": "1.4 g", "to": "0.4 g", "step": "0.2 g"}
            run_shipped(name, given, out)

    return Sources(once("paper", run))


def test_the_published_fits_are_the_papers_model() -> None:
    """To the digits given, from κ = 0.033 s/mm: Γ0 from the beads and the drive, Γ0 = 0.5 in Fig. 3."""
    dimer = dimer_of(published.shipped())
    for g, speed in published.FIT.items():
        ours = float(mean_velocity(dimer.gamma0(g * published.GRAVITY), dimer.sin_delta))
        assert ours == pytest.approx(speed, abs=6e-6)
    for (r1, r2), speed in published.FIG3_FIT.items():
        assert float(mean_velocity(0.5, (r1 - r2) / (r1 + r2))) == pytest.approx(speed, abs=6e-6)


def test_all_drives_of_the_paper_are_stable() -> None:
    drives = paper_drives()
    assert len(drives) == 11
    assert all(one.stable and one.v < OBSERVATIONS["mathieu"].si for one in drives.values())
    assert climber(large_bead_below=True).u == pytest.approx(-climber(large_bead_below=False).u)
    assert climber(large_bead_below=True).u > 0.0


def test_every_published_number_is_compared(sources: Sources) -> None:
    rows = compare(sources)
    assert [row["key"] for row in rows] == [number.key for number in COMPARED]
    assert all(number.depends_on for number in COMPARED if number.measured)
    for row in rows:
        assert (row["engine"] is not None) or not row["measured"] or row["left_out"]
        assert bool(row["why"]) != row["agrees"]
        if row["ratio"] is not None:
            ours = row["engine"] if row["engine"] is not None else row["theory"]
            assert row["ratio"] * row["published"] == pytest.approx(ours)
    assert [row["key"] for row in rows if row["published"] is None] == ["fig2_threshold"]
    assert count(rows, measured=False) == (9, 9)
    contents = json.loads(json.dumps(as_dict(rows)))
    assert contents["agree"] == sum(row["agrees"] for row in rows if row["measured"] and row["published"] is not None)
    assert contents["of"] == sum(row["measured"] for row in rows) - 1
    told = as_markdown(rows)
    assert all(f"| {row['what']} |" in told for row in rows)
    assert all(line.count("|") == 7 for line in told.splitlines() if line.startswith("|"))


def test_compared_numbers_are_those_of_the_runs(sources: Sources) -> None:
    rows = {row["key"]: row for row in compare(sources)}
    table = sources.table("fig2")
    at_four = table[np.isclose(table["drive.peak_acceleration"], 4.0)]["velocity"] * 1e3
    assert rows["fig2_4g"]["engine"] == pytest.approx(at_four.mean())
    assert rows["fig2_4g"]["low"] == pytest.approx(at_four.min())
    fig4 = sources.table("fig4").set_index("liquid.name")
    assert rows["fig4a_velocity"]["engine"] == pytest.approx(fig4["velocity"]["Si AK5"] * 1e3)
    # Of Fig. 4b some walkers leave the axis or are not steady: they are left out, and told.
    walkers, row = steady_walkers(read(fig4["run"]["Si AK10"])), rows["fig4b_rotation"]
    assert row["left_out"] == fig4["walkers"]["Si AK10"] - len(walkers)
    assert row["engine"] == (pytest.approx(walkers["rotation_1"].mean() * 1e3) if len(walkers) else None)
    # Theory is of many cycles: it does not know the shortened runs.
    predicted = float(motion_of(load_case("fig4a")).velocity[0]) * 1e3
    assert rows["fig4a_velocity"]["theory"] == pytest.approx(predicted)


def test_ratios_and_agreement_are_those_by_hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Γc of 0.2 to 0.3 at 60 Hz and 0.4 to 0.6 at 90 Hz: the ratio is 2, from 0.4/0.3 to 0.6/0.2."""
    ends = pd.DataFrame(
        {
            "drive.frequency": [90.0, 60.0],
            "gamma0_at_rest": [0.4, 0.2],
            "gamma0_moving": [0.6, 0.3],
            "status": "finished",
        }
    )
    monkeypatch.setattr("walkers.paper.comparison.thresholds", lambda _: ends)
    sources, none = Sources(tmp_path), pd.DataFrame({"status": []})
    sources.table = lambda name: ends if name == "fig2-threshold" else none
    row = next(row for row in compare(sources) if row["key"] == "fig2_threshold_frequency")
    assert [row[name] for name in ("engine", "low", "high")] == pytest.approx([2.0, 4.0 / 3.0, 3.0])
    # Speeds of 2 and 8 mm/s at 6 g over 1 and 2 mm/s at 3 g, at 60 and 90 Hz: ratios of 2 and 4.
    speeds = {(60.0, 6.0): 2e-3, (90.0, 6.0): 8e-3, (60.0, 3.0): 1e-3, (90.0, 3.0): 2e-3}
    table = pd.DataFrame([*speeds], columns=["frequency", "peak_acceleration"]).assign(radius_1=3e-4, radius_2=2e-4)
    table["peak_acceleration"] *= published.GRAVITY
    table["velocity"] = table["smallest"] = table["largest"] = [*speeds.values()]
    of, over = (tuple(Point("fig2", (0.3, 0.2), frequency, peak) for frequency in (60.0, 90.0)) for peak in (6.0, 3.0))
    found = evaluate(Observation("x", "x", of=of, over=over, quantity="velocity_of_all"), table)
    assert (found.engine, found.low, found.high) == pytest.approx((3.0, 2.0, 4.0))
    # Within 15 % of the published value, or 0.05 mm/s of zero.
    for value, ours, agrees in (
        (4.0, 4.5, True),
        (4.0, 4.7, False),
        (0.5, 0.6, False),
        (0.0, 0.04, True),
        (0.0, 0.06, False),
    ):
        assert _row(Observation("x", "x", value), Value(ours))["agrees"] is agrees, (value, ours)


PANELS = {
    "fig1b": 3,
    "fig2": 3,
    "fig3": 0,
    "fig4": 2,
    "alignment": 4,
    "modes": 2,
}


@pytest.mark.parametrize("name", PANELS)
def test_figures_can_be_printed_and_say_what_they_were_made_from(sources: Sources, tmp_path: Path, name: str) -> None:
    drawing = FIGURES[name]
    runs = sources.runs(*drawing.sweeps)
    figure = drawing.draw(sources)
    assert spoilt(figure) == []
    assert letters(figure) == list("abcd")[: PANELS[name]]
    if name != "fig4":
        return
    paths = save_figure(figure, tmp_path / name, runs, ("png", "svg", "pdf"), drawing.title)
    assert Image.open(paths[0]).info["Source"].split() == list(dict.fromkeys(runs))
    text = "".join(ElementTree.parse(paths[1]).getroot().itertext())
    assert runs
    assert all(run in text for run in runs)
    contents = paths[2].read_bytes()
    assert all(run.encode() in contents for run in runs)
    assert b"/FontFile2" in contents  # TrueType, embedded
    assert b"/Type3" not in contents
    save_figure(figure, tmp_path / "again", runs, ("pdf",), drawing.title)
    assert (tmp_path / "again.pdf").read_bytes() == contents
    assert not list(tmp_path.glob("*.new"))


def test_the_sensitivity_study_covers_each_parameter_both_ways(
    once: Callable[[str, Callable[[Path], object]], Path],
) -> None:
    """The shipped study, two cycles a run, of three of its six experiments."""

    def run(out: Path) -> None:
        given = read_toml(shipped("sweep")["sensitivity"])
        zipped = flatten(given["zip"][0], is_axis) | {"run.cycles": [2] * 6, "run.settling_cycles": [0] * 6}
        del zipped["run.most_cycles"]
        given["zip"][0] = {key: [values[number] for number in (0, 3, 5)] for key, values in zipped.items()}
        given["set"]["run.samples_per_cycle"] = 4
        run_shipped("sensitivity", given, out)

    study = Sources(once("sensitivity", run))
    found = sensitivities(study)
    assert list(found["parameter"]).count("shipped") == 1
    for name in PARAMETERS:
        lower, higher = sorted(found["value"][found["parameter"] == name])
        assert lower < higher
    # Two cycles are too few for a walker to be steady.
    assert found[["astray", "angle_after_60"]].notna().all().all()
    figure = FIGURES["sensitivity"].draw(study)
    assert len(figure.axes) == len(letters(figure)) == len(OBSERVED)
    assert spoilt(figure) == []


def test_figures_and_comparison_do_without_what_failed(sources: Sources, tmp_path: Path) -> None:
    """A copy of the sweeps of which each has lost its first run, and then all."""
    out = tmp_path / "runs"
    shutil.copytree(sources.out, out)
    runs = {sweep: [out / run for run in read_record(out / sweep).runs] for sweep in FEWER}
    drawings = [drawing for drawing in FIGURES.values() if runs.keys() & set(drawing.sweeps)]
    for lost in (1, None):
        for run in [run for each in runs.values() for run in each[:lost]]:
            shutil.rmtree(run, ignore_errors=True)
        left = Sources(out)
        for drawing in drawings:
            if lost:
                drawing.draw(left)
            else:
                with pytest.raises(NothingFinishedError):
                    drawing.draw(left)
        rows = compare(left)
        assert len(rows) == len(COMPARED)
        for row in rows:
            if row["engine"] is None and not row["key"].startswith("mathieu"):
                assert not row["agrees"]
                assert "missing" in row["why"]


def test_the_theory_of_fig4_goes_through_the_cycle_as_the_engine_does(sources: Sources) -> None:
    """Phase and sign: curves lie on the engine's samples within a tenth of their range, where contacts stay closed."""
    table = sources.finished("fig4").set_index("liquid.name")
    assert motion_of(sources.trajectory(table["run"]["Si AK10"]).case).opened[0]  # Fig. 4b
    trajectory = sources.trajectory(table["run"]["Si AK5"])
    motion, samples = gait(trajectory), trajectory.case.run.samples_per_cycle
    last = slice(-2 * samples - 1, None)
    engine = [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]
    for series, line in zip(engine, theory_of_cycles(trajectory), strict=True):
        shown = np.interp(np.linspace(0.0, 1.0, len(series)), np.linspace(0.0, 1.0, len(line)), line)
        assert np.sqrt(np.mean((shown - series) ** 2)) < 0.1 * np.ptp(series)


def test_dimers_turn_as_the_pendulum_does_but_as_much_faster_as_their_beads_are_free(sources: Sources) -> None:
    """After the jerk of the start, from 15°; the rates are those of small angles."""
    table = OBSERVATIONS["alignment_asymmetric"].of[0].rows(sources.finished("alignment"))
    (run,) = table["run"][np.isclose(table["dimers.angle"], 15.0)]
    trajectory = sources.trajectory(run)
    case = trajectory.case
    begin, end = 3 * case.run.samples_per_cycle, 8 * case.run.samples_per_cycle
    free = alignment_of(case)
    for number, walker in enumerate(trajectory.walkers):
        psi = trajectory.orientation[: end + 1, number]
        theta = np.pi * case.excitation.frequency * trajectory.time[: end + 1]
        predicted = turning(pendulum_of(case), float(psi[0]), theta, np.pi / 2.0 * walker.facing)
        turned = (psi[-1] - psi[begin]) / (predicted[-1] - predicted[begin])
        assert turned == pytest.approx(free["rate"] / free["rolling_rate"], rel=0.3)


def test_modes_are_told_apart(sources: Sources) -> None:
    rolling = {"velocity": 1e-3, "sliding_1": 0.0, "open_1": 0.0, "open_2": 0.0, "open_pair_1": 0.0}
    rolling |= {"steady": 2, "walkers": 2, "turned_round": 0}
    changes = [{"velocity": 0.0}, {}, {}, {"steady": 1}, {"open_pair_1": 0.1}, {"turned_round": 1}]
    modes = classify(pd.DataFrame([rolling | change for change in changes]), [0.0, 0.0, 0.4, 0.0, 0.0, 0.0])
    assert [list(MODES)[mode] for mode in modes] == [*MODES, "leaves the axis"]
    table = sources.finished("modes")
    found = classify(table, [sliding_share(sources.trajectory(run)) for run in table["run"]])
    assert (found[np.isclose(table["drive.gamma0"], 0.05)] == 0).all()
    assert (found[(table["drive.gamma0"] > 0.4) & (table["sin_delta"] > 0.1)] > 0).all()


def test_the_program_draws_what_is_asked_for(in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("walkers.inputs.run._MOST_CYCLES", 12)  # of 60: Fig. 4b would take them all
    done = call("paper", "figures", "--only", "fig4", "-j", "1", check=True)
    assert done.stdout.splitlines() == ["figures/fig4.png", "figures/fig4.svg"]
    done = call("paper", "figures", "--only", "fig4", "--format", "pdf", "-j", "1", check=True)
    assert done.stdout.splitlines() == ["figures/fig4.pdf"]


def test_a_run_that_failed_is_left_out_and_told(tmp_path: Path) -> None:
    """An engine that is stopped at once."""
    made = make_figures(tmp_path / "runs", tmp_path / "to", Options(1, time_limit=1e-3), only=["fig3"])
    assert {failure.reason for failure in made.failures["fig3"]} == {"TimeLimitExceeded"}
    assert list(made.left_out) == ["fig3"]
    assert not made.files
