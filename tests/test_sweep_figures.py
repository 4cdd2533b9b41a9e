"""Figures of sweeps: what goes where, what is drawn, what is left out and said."""

import shutil
import warnings
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import walkers
from tests.conftest import TINY, document, to_toml
from walkers.errors import InputError
from walkers.runner.run_directory import case_of
from walkers.sweeps.factors import factors_of
from walkers.sweeps.figure import SCATTER
from walkers.sweeps.figure import figure_of as figure_of_table
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.left_out import LeftOutWarning
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.table import SweepTable, table_of
from walkers.theory.prediction import COULOMB_MODEL, PAPER_FIT, predict


def figure_of(frame: pd.DataFrame, options: FigureOptions = FigureOptions()) -> Figure:
    return figure_of_table(SweepTable(frame), options)


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


COLOURS = ("#111111", "#1f4e8c")
"""The first two of `walkers/postprocess/show/style.mplstyle`."""


def _table(units: dict[str, str], rows: list[list[Any]], **speeds: Any) -> pd.DataFrame:
    """That of a sweep with a single axis as far as what varies goes, and columns of velocities, m/s."""
    table = pd.DataFrame(rows, columns=list(units)).assign(
        point=range(len(rows)), status="finished", **speeds
    )
    table.attrs |= {
        "units": units | dict.fromkeys(speeds, "m/s"),
        "varied": list(units),
        "axes": [tuple(units)],
    }
    table.attrs["title"] = ""
    return table


def test_a_figure_keeps_the_colours_of_the_project_wherever_it_is_drawn() -> None:
    """The names C0, C1, … would be looked up in the style of the program that draws it."""
    keys = {"drive.frequency": "Hz", "contact.friction.bead_wall": ""}
    rows = [[frequency, friction] for friction in (0.1, 0.2) for frequency in (60.0, 70.0)]
    table = _table(keys, rows, velocity=[1e-3, 2e-3, 3e-3, 4e-3])
    table.attrs["axes"] = [(key,) for key in keys]
    (panel,) = _panels(figure_of(table))
    drawn_in = [
        line.get_color()
        for line in panel.lines
        if len(line.get_xdata()) == 2 and line.get_marker() != "None"
    ]
    assert drawn_in == list(COLOURS[:2])


@pytest.mark.parametrize(("error", "bars"), [(2e-4, 3), (2e-6, 0)])
def test_error_bars_that_symbols_would_hide_are_left_out_and_the_figure_says_so(
    error: float, bars: int
) -> None:
    speeds = {"velocity": [1e-3, 2e-3, 3e-3], "scatter": error}
    figure = figure_of(_table({"drive.frequency": "Hz"}, [[60.0], [70.0], [80.0]], **speeds))
    (panel,) = _panels(figure)
    assert (
        sum(len(one.get_segments()) for one in panel.collections if isinstance(one, LineCollection))
        == bars
    )
    said = " ".join(figure.get_suptitle().split())
    assert (said, figure.legends) == (
        SCATTER if bars else f"{SCATTER}, smaller than the symbols",
        [],
    )


def test_axes_do_not_magnify_rounding() -> None:
    for values in ([1e-3, 1e-3 * (1.0 + 1e-9), 1e-3], [3.2e-18, -3.2e-18, 0.0]):
        table = _table(
            {"dimers.angle": "deg"}, [[-30.0], [-3.2e-15], [30.0]], velocity=values, scatter=0.0
        )
        (panel,) = _panels(figure_of(table))
        assert np.ptp(panel.get_ylim()) > 0.1
        assert [label.get_text() for label in panel.get_xticklabels()] == ["-30", "0", "30"]


def test_axes_go_along_x_into_colours_and_into_panels_of_the_same_scales(
    looked_through: Path,
) -> None:
    figure = walkers.load(looked_through / "three").figure(panels="frequency")
    first, second = _panels(figure)
    titles = [axes.get_title(loc="left") for axes in (first, second)]
    assert titles == ["(a) frequency = 60 Hz", "(b) frequency = 80 Hz"]
    assert (first.get_xlabel(), first.get_ylabel()) == (
        "peak acceleration (g)",
        "velocity along the heading\n(mm/s)",
    )
    assert (first.get_ylim(), _legend(figure)) == (second.get_ylim(), ["0.1", "0.2"])
    table = walkers.load(looked_through / "three").table()
    for friction, (x, y, errors) in zip((0.1, 0.2), _drawn(second), strict=True):
        rows = table[
            (table["contact.friction.bead_wall"] == friction) & (table["drive.frequency"] == 80.0)
        ]
        assert list(x) == [2.0, 4.0, 6.0]
        assert y == pytest.approx(rows["velocity"].to_numpy() * 1e3)
        assert errors == pytest.approx(rows["scatter"].to_numpy() * 1e3)
        assert (errors > 0.0).all()


def test_a_key_with_one_value_among_the_finished_points_takes_no_colours() -> None:
    keys = {
        "drive.frequency": "Hz",
        "liquid.surface_tension": "N/m",
        "contact.friction.bead_wall": "",
    }
    rows = [
        [60.0, 0.03, 0.1],
        [70.0, 0.03, 0.1],
        [60.0, 0.03, 0.2],
        [70.0, 0.03, 0.2],
        [60.0, 0.07, 0.1],
    ]
    table = _table(keys, rows, velocity=[1e-3, 2e-3, 3e-3, 4e-3, 5e-3])
    table.attrs["axes"] = [(key,) for key in keys]
    table.loc[4, "status"] = "missing"
    with pytest.warns(LeftOutWarning, match="1 missing"):
        figure = figure_of(table)
    assert _legend(figure) == ["0.1", "0.2"]


@pytest.mark.parametrize(
    ("keys", "options", "message"),
    [
        (
            ["drive.frequency", "contact.restitution", "contact.friction.bead_wall"],
            {},
            "panels: contact.friction.bead_wall varies beside drive.frequency (x), contact.restitution (hue): "
            "expected contact.friction.bead_wall, or none to draw all values alike",
        ),
        (
            [
                "drive.frequency",
                "contact.restitution",
                "contact.friction.bead_wall",
                "boundary.tilt",
            ],
            {"x": "restitution"},
            "panels: contact.friction.bead_wall, boundary.tilt vary beside contact.restitution (x), "
            "drive.frequency (hue): expected one of them, with the others fixed in the sweep file, "
            "or none to draw all values alike",
        ),
        (
            [
                "drive.frequency",
                "contact.restitution",
                "contact.friction.bead_wall",
                "boundary.tilt",
            ],
            {"panels": "tilt"},
            "hue: contact.friction.bead_wall varies beside drive.frequency (x), contact.restitution (hue), "
            "boundary.tilt (panels): expected fewer keys in the sweep file, or none to draw all values alike",
        ),
    ],
)
def test_a_figure_does_not_hide_keys_unless_it_is_told_to(
    keys: list[str], options: dict[str, str], message: str
) -> None:
    rows = [list(values) for values in product((0.1, 0.2), repeat=len(keys))]
    table = _table(dict.fromkeys(keys, ""), rows, velocity=np.arange(len(rows)) * 1e-3)
    table.attrs["axes"] = [(key,) for key in keys]
    with pytest.raises(InputError) as refused:
        figure_of(table, FigureOptions(**options))
    assert str(refused.value) == message
    option = message.partition(":")[0]
    with pytest.warns(LeftOutWarning, match="not distinguished: .*friction bead wall"):
        (panel, *_) = _panels(figure_of(table, FigureOptions(**{**options, option: "none"})))
    assert panel.lines[0].get_linestyle() == "None", (
        "points of several values are not joined by a line"
    )


def test_colours_have_the_first_other_key_and_what_follows_from_shown_columns_is_not_hidden() -> (
    None
):
    """Tilt and restitution follow from the panel and the colour, the seed repeats; the axis has most values."""
    keys = [
        "drive.frequency",
        "boundary.tilt",
        "contact.restitution",
        "drive.peak_acceleration",
        "run.seed",
    ]
    rows = [
        [frequency, tilt, 0.3 + tilt / 100.0, acceleration, seed]
        for frequency, tilt, acceleration, seed in product((60, 70), (0, 10), (2, 4, 6), (1, 2))
    ]
    table = _table(dict.fromkeys(keys, ""), rows, velocity=1e-3).assign(
        slope=[row[1] for row in rows]
    )
    table.attrs["axes"] = [(keys[0],), (keys[1],), (keys[2],), (keys[3],), (keys[4],)]
    table.attrs["units"] |= {"slope": ""}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = figure_of(table, FigureOptions(panels="slope"))
    assert [axes.get_title(loc="left") for axes in _panels(figure)] == [
        "(a) slope = 0",
        "(b) slope = 10",
    ]
    assert {axes.get_xlabel() for axes in _panels(figure)} == {"peak acceleration"}
    assert _legend(figure) == ["60", "70"]


def test_what_goes_where_can_be_chosen(looked_through: Path) -> None:
    chosen = {"x": "frequency", "hue": "bead_wall", "panels": "none", "y": "sliding_2"}
    with pytest.warns(LeftOutWarning, match="not distinguished: peak acceleration"):
        (axes,) = _panels(walkers.load(looked_through / "three").figure(**chosen))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("frequency (Hz)", "sliding of bead 2 (mm/s)")
    # A column that follows from an axis stands for it.
    (axes,) = _panels(walkers.load(looked_through / "grid").figure(x="gamma0", log="x"))
    assert (axes.get_xlabel(), axes.get_xscale(), len(_drawn(axes))) == ("Γ0", "log", 2)
    for x, log, told in (
        ("liquid.name", "x", "has no numbers"),
        (None, "z", r"^log: 'z': expected one of x, y, xy$"),
    ):
        with pytest.raises(InputError, match=told):
            walkers.load(looked_through / "beads").figure(x=x, log=log)


def test_pairs_of_beads_can_be_shown_by_their_asymmetry_and_texts_as_categories(
    looked_through: Path,
) -> None:
    figure = walkers.load(looked_through / "beads").figure(x="sin_delta")
    (axes,) = _panels(figure)
    assert axes.get_xlabel() == "sin δ"
    assert _drawn(axes)[0][0] == pytest.approx([0.05 / 0.45, 0.2, 0.15 / 0.55])
    assert _legend(figure) == ["Si AK5", "Si AK10"]
    figure = walkers.load(looked_through / "beads").figure(x="liquid.name")
    (axes,) = _panels(figure)
    assert [label.get_text() for label in axes.get_xticklabels()] == ["Si AK5", "Si AK10"]
    assert _legend(figure) == ["0.3/0.2 mm", "0.25/0.2 mm", "0.35/0.2 mm"]
    places = np.array([x for x, _, _ in _drawn(axes)])
    assert np.abs(places - [0.0, 1.0]).max() < 0.3, "symbols are beside their category"


def test_samples_have_a_panel_for_each_key(looked_through: Path) -> None:
    directory = looked_through / "sampled"
    table, figure = walkers.load(directory).table(), walkers.load(directory).figure()
    panels = {axes.get_xlabel(): axes for axes in _panels(figure)}
    assert panels.keys() == {"friction bead wall", "friction bead bead"}
    for key in ("bead_wall", "bead_bead"):
        axes = panels[f"friction {key.replace('_', ' ')}"]
        x, y, _ = _drawn(axes)[0]
        order = table.sort_values(f"contact.friction.{key}")
        assert list(x) == pytest.approx(order[f"contact.friction.{key}"].tolist())
        assert list(y) == pytest.approx((order["velocity"] * 1e3).tolist())
        assert axes.containers[0][0].get_linestyle() == "None"  # type: ignore[index]


def test_panels_of_a_sample_begin_with_the_strongest_key_and_log_uniform_ranges_have_log_axes() -> (
    None
):
    """Titles have rank correlations, here by hand: the sum of d² of six ranks is 68; the other, 48, is too small.

    Five draws are too few, as are six of which one came apart.
    """
    keys = ("contact.restitution", "contact.friction.bead_wall")
    rows = [[0.3, 0.1], [0.8, 0.2], [0.4, 0.3], [0.6, 0.4], [0.5, 0.6], [0.7, 0.5]]
    table = _table(dict.fromkeys(keys, ""), rows, velocity=[6e-3, 5e-3, 4e-3, 3e-3, 2e-3, 1e-3])
    table.attrs["sampled"] = dict(zip(keys, (False, True), strict=True))
    panels = _panels(figure_of(table))
    assert [axes.get_xlabel() for axes in panels] == ["friction bead wall", "restitution"]
    assert [axes.get_xscale() for axes in panels] == ["log", "linear"]
    titles = [axes.get_title(loc="left") for axes in panels]
    assert titles == ["(a) rank correlation -0.94", "(b) no clear dependence"]
    apart = table.assign(separated_fraction=[0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    for few, draws in ((table[:5], 5), (apart, 6)):
        figure = figure_of(few)
        assert figure.get_suptitle().endswith(f"{draws} draws: too few for rank correlations")
        assert [axes.get_title(loc="left") for axes in _panels(figure)] == ["(a)", "(b)"]


def test_keys_that_vary_one_at_a_time_are_each_shown_with_the_usual_others() -> None:
    keys = ("contact.friction.bead_wall", "contact.restitution")
    rows = [[0.2, 0.5], [0.1, 0.5], [0.3, 0.5], [0.2, 0.9]]
    for more, shown in (
        ([], [(0.1, 0.2, 0.3), (0.5, 0.9)]),
        ([[0.1, 0.9]], [(0.1, 0.1, 0.2, 0.2, 0.3)] * 2),
    ):
        speeds = np.arange(len(rows + more)) * 1e-3
        table = _table(dict.fromkeys(keys, ""), rows + more, velocity=speeds, scatter=1e-4)
        along = [_drawn(axes)[0][0] for axes in _panels(figure_of(table))]
        assert [*map(len, along)] == [*map(len, shown)]
        assert tuple(along[0]) == shown[0]


def test_keys_that_go_together_are_one_factor() -> None:
    """A zip of equal numbers, one of texts, and one that only together tell its points apart."""
    wall, bead = both = ("contact.friction.bead_wall", "contact.friction.bead_bead")
    named = ("liquid.name", "drive.peak_acceleration")
    expected: list[tuple[tuple[str, ...], list[list[Any]], list[Any]]] = [
        (both, [[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]], [(both, [0.1, 0.2, 0.3], False)]),
        (both, [[0.1, 0.6], [0.2, 0.4], [0.3, 0.2]], [(both, [0.1, 0.2, 0.3], False)]),
        # The second stays the same in a step, and tells fewer points apart than the first.
        (
            both,
            [[0.1, 0.6], [0.2, 0.6], [0.3, 0.2]],
            [((wall,), [0.1, 0.2, 0.3], True), ((bead,), [0.2, 0.6], True)],
        ),
        (
            both,
            [[0.1, 0.2], [0.2, 0.2], [0.3, 0.6]],
            [((wall,), [0.1, 0.2, 0.3], True), ((bead,), [0.2, 0.6], True)],
        ),
        (
            both,
            [[0.1, 0.4], [0.2, 0.2], [0.3, 0.6]],
            [((wall,), [0.1, 0.2, 0.3], True), ((bead,), [0.2, 0.4, 0.6], True)],
        ),
        (named, [["a", 2.0], ["b", 10.0]], [(named, ["a", "b"], False)]),
        (
            named,
            [["a", 2.0], ["a", 10.0], ["b", 2.0]],
            [(named, ["a, 2 g", "a, 10 g", "b, 2 g"], False)],
        ),
        (named, [["a", 2.0]], []),
    ]
    for keys, rows, factors in expected:
        table = _table({key: "g" if key.endswith("acceleration") else "" for key in keys}, rows)
        assert [(one.keys, one.levels, one.is_sample) for one in factors_of(table)] == factors


def test_theory_is_what_the_theory_says_of_each_point(looked_through: Path) -> None:
    directory = looked_through / "grid"
    figure = walkers.load(directory).figure(theory=True)
    (axes,) = _panels(figure)
    assert _legend(figure)[2:] == [COULOMB_MODEL, PAPER_FIT]
    lines = {line.get_linestyle(): line for line in axes.lines if line.get_color() == COLOURS[1]}
    table = walkers.load(directory).table()
    predicted = [
        predict(case_of(Path(run))) for run in table.loc[table["drive.frequency"] == 80.0, "run"]
    ]
    for style, model in (("--", "viscous"), (":", "paper")):
        wanted = [one[model]["velocity"] * 1e3 for one in predicted]
        x, y = map(np.asarray, lines[style].get_data())
        points = _drawn(axes)[1][0]
        assert len(x) == 61
        assert (x[0], x[-1]) == (min(points), max(points))
        assert axes.get_ylim()[0] < y.max()
        assert y.min() < axes.get_ylim()[1]
        assert np.interp(points, x, y) == pytest.approx(wanted, rel=5e-3)
    with pytest.warns(LeftOutWarning, match="6 of 6 points: the theory has no orientation_end"):
        walkers.load(directory).figure(y="orientation_end", theory=True)


@pytest.mark.parametrize(
    ("far", "side"), [((0.1, 0.2), 1), ((-0.2, -0.1), 0)], ids=["above", "below"]
)
def test_a_theory_far_from_the_runs_is_shown_up_to_its_nearer_end(
    far: tuple[float, float], side: int, looked_through: Path
) -> None:
    """Of curves from 100 to 200 mm/s above or below runs of some mm/s, the end at 100 mm/s."""
    curves = {"near": (1e-3, 2e-3), "far": far}
    (axes,) = _panels(
        figure_of_table(
            table_of(read_sweep_record(looked_through / "grid")),
            predict=lambda cases, _: (
                {name: np.linspace(*ends, len(cases)) for name, ends in curves.items()},
                {},
            ),
        )
    )
    assert 100.0 < abs(axes.get_ylim()[side]) < 120.0


@pytest.fixture(scope="module")
def without_units(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with sweeps of a walker along Γ0, along a friction, and along the number of replicates."""
    folder = tmp_path_factory.mktemp("without-units")
    tables = document(run=TINY, dimers={"replicates": 2, "angle_spread": "1 deg"})
    tables["drive"] = {"frequency": "80 Hz", "gamma0": 0.6}
    (folder / "walker.toml").write_text(to_toml(tables))
    axes: dict[str, tuple[str, list[float]]] = {
        "driven": ("drive.gamma0", [0.3, 0.6, 0.9]),
        "rubbed": ("contact.friction.bead_wall", [0.05, 0.1, 0.2]),
        "repeated": ("dimers.replicates", [1, 3]),
    }
    for name, (key, values) in axes.items():
        sweep = {"case": "walker.toml", "axes": {key: values}}
        (folder / f"{name}.toml").write_text(to_toml(sweep))
        walkers.sweep(folder / f"{name}.toml", folder / "runs", jobs=1)
    return folder / "runs"


def _of_theory(axes: Axes) -> list[tuple[Any, Any]]:
    """Of the line of each model its x and its y."""
    return [line.get_data() for line in axes.lines if line.get_linestyle() in ("--", ":")]


@pytest.mark.parametrize("name", ["driven", "rubbed"])
def test_the_theory_is_a_fine_curve_along_keys_without_a_unit(
    name: str, without_units: Path
) -> None:
    sweep = walkers.load(without_units / name)
    (axes,) = _panels(sweep.figure(theory=True))
    ((points, _, _),) = _drawn(axes)
    predicted = [predict(case_of(Path(run))) for run in sweep.table()["run"]]
    lines = _of_theory(axes)
    assert len(lines) == 2
    for (x, y), model in zip(lines, ("viscous", "paper"), strict=True):
        assert (len(x), x[0], x[-1]) == (61, points[0], points[-1])
        velocities = [one[model]["velocity"] * 1e3 for one in predicted]
        assert np.interp(points, x, y) == pytest.approx(velocities, rel=5e-3)


def test_a_curve_along_a_number_that_follows_from_the_key_is_in_the_unit_of_the_axis(
    without_units: Path, looked_through: Path
) -> None:
    """The acceleration (in g) that follows from Γ0, and Γ0, which follows from the acceleration."""
    for sweep, x in (
        (without_units / "driven", "peak_acceleration"),
        (looked_through / "grid", "gamma0"),
    ):
        (axes,) = _panels(walkers.load(sweep).figure(theory=True, x=x))
        points = [x for x, _, _ in _drawn(axes)]
        lines = _of_theory(axes)
        assert len(lines) == 2 * len(points)
        for line, (at, _) in enumerate(lines):
            ends = points[line // 2][[0, -1]]
            assert len(at) == 61
            assert at[[0, -1]] == pytest.approx(ends, rel=1e-9)


def test_numbers_of_replicates_have_no_theory_between_them(without_units: Path) -> None:
    """From 1 to 3 in 61 steps, 2 alone is one."""
    (axes,) = _panels(walkers.load(without_units / "repeated").figure(theory=True))
    assert [list(x) for x, _ in _of_theory(axes)] == [[1.0, 2.0, 3.0]] * 2


def test_points_that_are_not_finished_are_left_out_and_counted(
    looked_through: Path, tmp_path: Path
) -> None:
    out = tmp_path / "runs"
    shutil.copytree(looked_through, out)
    runs = walkers.load(out / "grid").table()["run"]
    shutil.rmtree(runs[0])
    with pytest.warns(LeftOutWarning, match="1 of 6 points left out: 1 missing"):
        figure = walkers.load(out / "grid").figure()
    assert [len(x) for x, _, _ in _drawn(_panels(figure)[0])] == [2, 3]
    for run in runs[1:]:
        shutil.rmtree(run)
    with pytest.raises(InputError, match=r"no point is finished \(6 missing\)"):
        walkers.load(out / "grid").figure()


def test_headings_that_differ_on_a_level_floor_are_not_averaged(tmp_path: Path) -> None:
    """Two tones push walkers of both headings the same way, the one forward and the other backward."""
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g"},
    ]
    short = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
    tables = {**document(dimers={"replicates": 2}, run=short), "drive": {"harmonics": tones}}
    sweep = {"case": "tones.toml", "axes": {"drive.harmonics[1].phase": ["0 deg", "90 deg"]}}
    for name, contents in (("tones", tables), ("phases", sweep)):
        (tmp_path / f"{name}.toml").write_text(to_toml(contents))
    swept = walkers.sweep(tmp_path / "phases.toml", tmp_path / "runs")
    assert swept.table()["facings_differ"].any()
    (header,) = (
        line.split() for line in swept.describe().splitlines() if line.split()[:1] == ["point"]
    )
    assert {"right_facing", "left_facing"} <= {*header}
    assert "velocity" not in header
    assert _legend(swept.figure()) == ["started facing right (up)", "started facing left (down)"]


def test_walkers_that_face_down_a_slope_are_a_series_beside_those_that_face_up(
    tmp_path: Path,
) -> None:
    short = {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 10}
    (tmp_path / "slope.toml").write_text(to_toml(document(dimers={"replicates": 2}, run=short)))
    (tmp_path / "tilt.toml").write_text(
        'case = "slope.toml"\n[axes]\nboundary.tilt = ["0 deg", "10 deg", "20 deg"]\n'
    )
    swept = walkers.sweep(tmp_path / "tilt.toml", tmp_path / "runs")
    table, figure = swept.table(), swept.figure()
    assert _legend(figure) == ["started facing right (up)", "started facing left (down)"]
    # Of walkers that lean or turned over, velocities are those up the slope.
    leaning = table.assign(upright=0)
    each = [
        walkers.load(Path(run)).walkers.set_index("facing")["axial_velocity"]
        for run in table["run"]
    ]
    for drawn, label, expected in (
        (figure, "velocity (mm/s)", table[["right_facing", "left_facing"]].to_numpy().T),
        (
            figure_of(leaning),
            "velocity along the drive\naxis (mm/s)",
            [[one[way] for one in each] for way in (1, -1)],
        ),
    ):
        (axes,) = _panels(drawn)
        assert axes.get_ylabel() == label
        series = [line.get_ydata() for line in axes.lines if len(line.get_xdata()) == 3]
        np.testing.assert_allclose(series, 1e3 * np.array(expected))
    assert not _legend(swept.figure(y="right_facing"))
    assert not _legend(figure_of(leaning.assign(axial_left_facing=np.nan)))
