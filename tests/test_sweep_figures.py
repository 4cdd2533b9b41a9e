"""Figures of sweeps: what goes where, what is drawn, what is left out and said."""

import shutil
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import walkers
from tests.conftest import call
from walkers.inputs.errors import InputError
from walkers.inputs.reading import load_case
from walkers.plotting import LeftOutWarning
from walkers.runner.directory import case_of
from walkers.sweeps.factors import factors_of
from walkers.sweeps.figure_layout import layout_of
from walkers.sweeps.record import SweepRecord
from walkers.theory.prediction import MODEL, PAPER, predict, predicted_column


def _panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.axison]


def _drawn(axes: Axes) -> list[tuple[Any, Any, Any]]:
    """Of each series its x, its y and the half length of its error bars."""
    found = []
    for container in axes.containers:
        line, _, (bars,) = container  # type: ignore[misc]
        ends = np.array([segment[:, 1] for segment in bars.get_segments()])
        found.append((line.get_xdata(), line.get_ydata(), (ends[:, 1] - ends[:, 0]) / 2.0))
    return found


def _legend(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def test_the_axis_with_most_values_is_x_and_the_other_has_colours(looked_through: Path) -> None:
    table = walkers.load(looked_through / "grid")
    figure = walkers.sweep_figure(looked_through / "grid")
    (axes,) = _panels(figure)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("peak acceleration (g)", "velocity (mm/s)")
    assert _legend(figure) == ["60 Hz", "80 Hz"]
    for frequency, (x, y, errors) in zip((60.0, 80.0), _drawn(axes), strict=True):
        rows = table[table["drive.frequency"] == frequency]
        assert list(x) == [2.0, 4.0, 6.0]
        assert y == pytest.approx(rows["velocity"].to_numpy() * 1e3)
        assert errors == pytest.approx(rows["standard_error"].to_numpy() * 1e3)
        assert (errors > 0.0).all()


def test_a_third_axis_has_panels_with_the_same_scales(looked_through: Path) -> None:
    first, second = _panels(walkers.sweep_figure(looked_through / "three"))
    titles = [axes.get_title(loc="left") for axes in (first, second)]
    assert titles == ["(a) frequency = 60 Hz", "(b) frequency = 80 Hz"]
    assert first.get_ylim() == second.get_ylim()
    assert [len(_drawn(axes)) for axes in (first, second)] == [2, 2]
    table = walkers.load(looked_through / "three")
    rows = table[(table["contact.friction.bead_wall"] == 0.2) & (table["drive.frequency"] == 80.0)]
    assert _drawn(second)[1][1] == pytest.approx(rows["velocity"].to_numpy() * 1e3)


def test_what_goes_where_can_be_chosen(looked_through: Path) -> None:
    chosen = {"x": "frequency", "hue": "bead_wall", "panels": "none", "y": "sliding_2"}
    with pytest.warns(LeftOutWarning, match="not told apart: peak acceleration"):
        figure = walkers.sweep_figure(looked_through / "three", **chosen)
    (axes,) = _panels(figure)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("frequency (Hz)", "sliding 2 (mm/s)")
    assert _legend(figure) == ["0.1", "0.2"]
    # A column that follows from an axis stands for it.
    (axes,) = _panels(walkers.sweep_figure(looked_through / "grid", x="gamma0", log="x"))
    assert (axes.get_xlabel(), axes.get_xscale()) == ("Γ0", "log")
    assert len(_drawn(axes)) == 2


def test_pairs_of_beads_are_shown_by_their_asymmetry_and_texts_as_categories(looked_through: Path) -> None:
    directory = looked_through / "beads"
    figure = walkers.sweep_figure(directory)
    (axes,) = _panels(figure)
    assert axes.get_xlabel() == "asymmetry sin δ"
    assert _drawn(axes)[0][0] == pytest.approx([0.05 / 0.45, 0.2, 0.15 / 0.55])
    assert _legend(figure) == ["Si AK5", "Si AK10"]
    figure = walkers.sweep_figure(directory, x="liquid.name")
    (axes,) = _panels(figure)
    assert [label.get_text() for label in axes.get_xticklabels()] == ["Si AK5", "Si AK10"]
    assert _legend(figure) == ["0.3/0.2 mm", "0.25/0.2 mm", "0.35/0.2 mm"]
    places = np.array([x for x, _, _ in _drawn(axes)])
    assert np.abs(places - [0.0, 1.0]).max() < 0.3, "symbols are beside their category"
    with pytest.raises(InputError, match="has no numbers"):
        walkers.sweep_figure(directory, x="liquid.name", log="x")


def test_samples_have_a_panel_for_each_key(looked_through: Path) -> None:
    directory = looked_through / "sampled"
    table, figure = walkers.load(directory), walkers.sweep_figure(directory)
    for axes, key in zip(_panels(figure), ("bead_wall", "bead_bead"), strict=True):
        assert axes.get_xlabel() == f"friction {key.replace('_', ' ')}"
        x, y, _ = _drawn(axes)[0]
        order = table.sort_values(f"contact.friction.{key}")
        assert (list(x), list(y)) == (
            pytest.approx(order[f"contact.friction.{key}"].tolist()),
            pytest.approx((order["velocity"] * 1e3).tolist()),
        )
        assert axes.containers[0][0].get_linestyle() == "None"  # type: ignore[index]


def test_keys_that_go_together_are_one_factor() -> None:
    """A zip of equal numbers, one of texts, and one that only together tell its points apart."""

    def factors(
        units: dict[str, str | None], values: list[list[Any]], **file: Any
    ) -> list[tuple[tuple[str, ...], list[Any], bool]]:
        record = SweepRecord(Path("x"), "x", "", units, values, [[]] * len(values), [""] * len(values), None, [], file)
        return [(one.keys, one.levels, one.is_sample) for one in factors_of(record)]

    both = {"contact.friction.bead_wall": None, "contact.friction.bead_bead": None}
    zipped = [{"contact": {"friction": {"bead_wall": [], "bead_bead": []}}}]
    assert factors(both, [[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]], zip=zipped) == [(tuple(both), [0.1, 0.2, 0.3], False)]
    sampled = [{"ranges": {key: {"uniform": [0, 1]} for key in both}}]
    for file in ({"zip": zipped}, {"sample": sampled}):
        assert factors(both, [[0.1, 0.4], [0.2, 0.2], [0.3, 0.6]], **file) == [
            (("contact.friction.bead_wall",), [0.1, 0.2, 0.3], True),
            (("contact.friction.bead_bead",), [0.2, 0.4, 0.6], True),
        ]
    named = {"liquid.name": None, "drive.peak_acceleration": "g"}
    zipped = [dict.fromkeys(named)]
    assert factors(named, [["a", 2.0], ["b", 10.0]], zip=zipped) == [(tuple(named), ["a", "b"], False)]
    assert factors(named, [["a", 2.0], ["a", 10.0], ["b", 2.0]], zip=zipped) == [
        (tuple(named), ["a, 2 g", "a, 10 g", "b, 2 g"], False)
    ]
    assert len(factors(named, [["a", 2.0], ["a", 10.0], ["b", 2.0], ["b", 10.0]])) == 2
    assert factors(named, [["a", 2.0]]) == []


def test_theory_is_what_the_theory_says_of_each_point(looked_through: Path) -> None:
    directory = looked_through / "grid"
    figure = walkers.sweep_figure(directory, theory=True)
    (axes,) = _panels(figure)
    assert _legend(figure)[2:] == ["theory", "paper's fit, κ = 0.033 s/mm"]
    lines = {line.get_linestyle(): line for line in axes.lines if line.get_color() == "C1"}
    table = walkers.load(directory)
    rows = table[table["drive.frequency"] == 80.0]
    predicted = [predict(case_of(Path(run))) for run in rows["run"]]
    for style, model in (("--", "viscous"), (":", "paper")):
        wanted = [one[model]["velocity"] * 1e3 for one in predicted]
        assert lines[style].get_ydata() == pytest.approx(wanted, rel=1e-6)  # type: ignore[arg-type]
    with pytest.warns(LeftOutWarning, match="6 of 6 points: the theory has no orientation_end"):
        walkers.sweep_figure(directory, y="orientation_end", theory=True)


def test_the_papers_friction_is_drawn_only_of_what_it_was_fitted_to() -> None:
    """Its velocities are of ruby in silicone oils: of glass in glycol they would be wrong tenfold, and unseen so."""
    friction = {"contact.friction.bead_wall": 0.3, "contact.friction.bead_bead": 0.1}
    changes: list[dict[str, Any]] = [
        {},
        {"liquid.name": "ethylene glycol"},
        {"beads.material": "glass", "contact.rolling_friction": 0.0, **friction},
        {"boundary.material": "polystyrene", "contact.rolling_friction": 0.0, **friction},
    ]
    ours, *others = [load_case("fig1b", one) for one in changes]
    predicted, reasons = predicted_column([ours, *others], "velocity")
    assert np.isfinite(predicted[MODEL]).all()
    assert predicted[PAPER][0] == pytest.approx(predict(ours)["paper"]["velocity"])
    assert np.isnan(predicted[PAPER][1:]).all()
    told = "is one of ruby on level chromium-coated glass or glass in Si AK5 or Si AK10"
    assert reasons == {f"the {PAPER}, {told}": 3}
    assert list(predicted_column(others, "velocity")[0]) == [MODEL]
    assert predicted_column(others, "rotation_1")[1] == {}


def test_points_that_are_not_finished_are_left_out_and_counted(looked_through: Path, tmp_path: Path) -> None:
    out = tmp_path / "runs"
    shutil.copytree(looked_through, out)
    runs = walkers.load(out / "grid")["run"]
    shutil.rmtree(runs[0])
    with pytest.warns(LeftOutWarning, match="1 of 6 points left out: 1 missing"):
        figure = walkers.sweep_figure(out / "grid")
    assert [len(x) for x, _, _ in _drawn(_panels(figure)[0])] == [2, 3]
    for run in runs[1:]:
        shutil.rmtree(run)
    with pytest.raises(InputError, match=r"no point is finished \(6 missing\)"):
        walkers.sweep_figure(out / "grid")


def test_plot_writes_what_the_suffix_says(looked_through: Path, tmp_path: Path) -> None:
    for suffix, begin in ((".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")):
        to = tmp_path / f"figure{suffix}"
        done = call("plot", "grid", "--out", str(looked_through), "--to", str(to), check=True)
        assert (done.stdout, done.stderr) == (f"{to}\n", "")
        assert to.read_bytes().startswith(begin)
    assert len(list(tmp_path.iterdir())) == 3


def test_plot_tells_runs_from_sweeps(looked_through: Path, tmp_path: Path) -> None:
    shutil.copytree(looked_through / "grid", tmp_path / "runs" / "grid")
    run = walkers.load(looked_through / "grid")["run"][0]
    shutil.copytree(run, tmp_path / "runs" / Path(run).name)
    done = call("plot", "runs/grid", folder=tmp_path)
    assert (done.returncode, done.stdout) == (0, "runs/grid/velocity.png\n")
    assert "5 of 6 points left out: 5 missing" in done.stderr
    assert call("plot", Path(run).name, folder=tmp_path, check=True).stdout.split()[0].endswith("walk.png")
    refused = call("plot", Path(run).name, "--hue", "frequency", folder=tmp_path)
    assert (refused.returncode, refused.stderr) == (2, "walkers: --hue: is for sweeps\n")


def test_what_cannot_be_drawn_is_told(looked_through: Path, tmp_path: Path) -> None:
    for arguments, told in (
        (["--y", "velocitty"], 'did you mean "velocity"?'),
        (["--y", "reason"], '"reason" has no number'),
        (["--x", "bead_wall"], '"bead_wall": expected one of'),
        (["--to", str(tmp_path / "figure.jpg")], "ends in .png, .svg, .pdf"),
    ):
        done = call("plot", "grid", "--out", str(looked_through), *arguments)
        assert done.returncode == 2
        assert told in done.stderr
    assert not list(tmp_path.iterdir())


def test_what_would_take_too_many_panels_is_not_told_apart() -> None:
    """Of five keys of three values one is along x, one has colours, and two have nine panels: the last is named."""
    keys = ["drive.frequency", *(f"contact.friction.{name}" for name in ("a", "b", "c", "d"))]
    rows = [list(row) for row in product((1.0, 2.0, 3.0), repeat=5)]
    record = SweepRecord(Path("x"), "x", "", dict.fromkeys(keys), rows, [[]] * 243, [""] * 243, None, [], {})
    table = pd.DataFrame(rows, columns=pd.Index(keys)).assign(point=range(243))
    table.attrs["units"] = {}
    layout = layout_of(record, table)
    assert layout.panels is not None
    assert len(layout.panels.levels) == 9
    assert len(layout.untold) == 1
    assert layout_of(record, table, panels="none").panels is None
