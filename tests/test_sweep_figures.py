"""Figures of sweeps: axes, colours and panels, error bars, theory, and what is left out."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import walkers
from tests.conftest import TINY, FillOnce, document, to_toml
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.tables.case import Case
from walkers.runner.run_directory import case_of
from walkers.sweeps.factors import factors_of
from walkers.sweeps.figure import SCATTER
from walkers.sweeps.figure import figure_of as figure_of_table
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.left_out import LeftOutWarning
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.table import SweepTable, table_of
from walkers.theory.prediction import FRICTION_MODEL, PAPER_FIT, predict

COLOURS = ["#111111", "#1f4e8c"]
"""The first two of `walkers/postprocess/show/style.mplstyle`."""
BOTH_WAYS = ["started facing right (up)", "started facing left (down)"]
"""Legend of a figure with the velocities of both headings."""
THEORY_POINTS = 61
"""Number of points of a curve of the theory."""
WALL = "contact.friction.bead_wall"
BEAD = "contact.friction.bead_bead"


@dataclass(frozen=True)
class DrawnSeries:
    """The points of one colour as a panel shows them, in displayed units."""

    x: FloatArray
    y: FloatArray
    error: FloatArray
    """Half length of the error bars."""


def make_table(
    units: dict[str, str],
    rows: Sequence[Sequence[Any]],
    *,
    are_axes: bool = False,
    **columns: Any,
) -> pd.DataFrame:
    """The table of a sweep without its runs.

    Parameters
    ----------
    units
        Units of the keys that vary, by key.
    rows
        The values of the keys at each point.
    are_axes
        Whether each key is an axis of its own; otherwise all vary together on one.
    columns
        Results at the points, in m/s.
    """
    keys = list(units)
    table = pd.DataFrame(rows, columns=keys)
    table = table.assign(point=range(len(rows)), status="finished", **columns)
    table.attrs["units"] = units | dict.fromkeys(columns, "m/s")
    table.attrs["varied"] = keys
    table.attrs["axes"] = [(key,) for key in keys] if are_axes else [tuple(keys)]
    table.attrs["title"] = ""
    return table


def figure_of(frame: pd.DataFrame, options: FigureOptions = FigureOptions()) -> Figure:
    """The figure of a table that `make_table` made."""
    return figure_of_table(SweepTable(frame), options)


def panels_of(figure: Figure) -> list[Axes]:
    """The panels of a figure, without the axes that are switched off."""
    return [axes for axes in figure.axes if axes.axison]


def only_panel(figure: Figure) -> Axes:
    """The panel of a figure that has one."""
    (panel,) = panels_of(figure)
    return panel


def titles_of(figure: Figure) -> list[str]:
    """The titles of the panels."""
    return [panel.get_title(loc="left") for panel in panels_of(figure)]


def drawn_series(panel: Axes) -> list[DrawnSeries]:
    """The series of a panel whose points have error bars."""
    series = []
    for container in panel.containers:
        line, _, (bars,) = container
        ends = np.array([segment[:, 1] for segment in bars.get_segments()])
        error = (ends[:, 1] - ends[:, 0]) / 2.0
        series.append(DrawnSeries(line.get_xdata(), line.get_ydata(), error))
    return series


def theory_lines(panel: Axes) -> list[Line2D]:
    """The dashed and dotted lines, which are those of the theory."""
    return [line for line in panel.lines if line.get_linestyle() in ("--", ":")]


def theory_curves(panel: Axes) -> list[tuple[FloatArray, FloatArray]]:
    """The x and the y of each line of the theory."""
    return [line.get_data() for line in theory_lines(panel)]


def legend_of(figure: Figure) -> list[str]:
    """The texts of the legends of a figure."""
    texts: list[str] = []
    for legend in figure.legends:
        texts += [text.get_text() for text in legend.get_texts()]
    return texts


def tick_labels(panel: Axes) -> list[str]:
    """The labels below the x axis."""
    return [label.get_text() for label in panel.get_xticklabels()]


# --- made-up tables ---------------------------------------------------------------------------


def test_a_figure_keeps_the_colours_of_the_project_wherever_it_is_drawn() -> None:
    """The names C0, C1, … would be looked up in the style of the program that draws it."""
    rows = list(product(("water", "Si AK5"), (0.1, 0.2)))
    units = {"liquid.name": "", WALL: ""}
    table = make_table(units, rows, are_axes=True, velocity=[1e-3, 3e-3, 2e-3, 4e-3])
    assert [line.get_color() for line in lines_of_series(figure_of(table))] == COLOURS


def lines_of_series(figure: Figure) -> list[Line2D]:
    """The lines with symbols through two points in the only panel of a figure."""
    lines = []
    for line in only_panel(figure).lines:
        if len(line.get_xdata()) == 2 and line.get_marker() != "None":
            lines.append(line)
    return lines


def test_colours_of_numbers_become_lighter_from_the_smallest_to_the_largest() -> None:
    rows = list(product((90.0, 60.0, 75.0), (0.1, 0.2)))
    units = {"drive.frequency": "Hz", WALL: ""}
    velocity = np.arange(1.0, 7.0) * 1e-3
    table = make_table(units, rows, are_axes=True, velocity=velocity)
    figure = figure_of(table, FigureOptions(x=WALL))
    assert legend_of(figure) == ["60 Hz", "75 Hz", "90 Hz"]
    lightness = [float(np.mean(to_rgb(line.get_color()))) for line in lines_of_series(figure)]
    assert lightness == sorted(lightness)
    assert lightness[2] > lightness[0] + 0.1


@pytest.mark.parametrize(
    ("velocities", "are_nested"),
    [
        # Values of 60 Hz, then of 70 Hz. Symbols of 0.02 of the range cover each other.
        pytest.param([1e-3, 3e-3, 2e-3, 4e-3], False, id="apart"),
        pytest.param([1e-3, 3e-3, 1.03e-3, 4e-3], True, id="one pair within 1 % of the range"),
    ],
)
def test_filled_symbols_have_different_sizes_only_if_some_cover_each_other(
    velocities: list[float], are_nested: bool
) -> None:
    rows = list(product((60.0, 70.0), (0.1, 0.2)))
    units = {"drive.frequency": "Hz", WALL: ""}
    table = make_table(units, rows, are_axes=True, velocity=velocities)
    figure = figure_of(table, FigureOptions(x=WALL))
    first, second = (line.get_markersize() for line in lines_of_series(figure))
    assert (first > second) is are_nested


@pytest.mark.parametrize(
    ("scatter", "bars", "title"),
    [
        # Bars are seen if the scatter exceeds 2 % of the range of the velocities, here 0.04 mm/s.
        pytest.param(2e-4, 3, SCATTER, id="0.2 mm/s"),
        pytest.param(2e-6, 0, "", id="0.002 mm/s"),
    ],
)
def test_error_bars_that_symbols_would_hide_are_left_out_and_the_title_explains_only_drawn_ones(
    scatter: float, bars: int, title: str
) -> None:
    rows = [[60.0], [70.0], [80.0]]
    velocity = [1e-3, 2e-3, 3e-3]
    table = make_table({"drive.frequency": "Hz"}, rows, velocity=velocity, scatter=scatter)
    figure = figure_of(table)
    segments = 0
    for collection in only_panel(figure).collections:
        if isinstance(collection, LineCollection):
            segments += len(collection.get_segments())
    assert segments == bars
    assert " ".join(figure.get_suptitle().split()) == title
    assert figure.legends == []


@pytest.mark.parametrize(
    "velocities",
    [
        pytest.param([1e-3, 1e-3 * (1.0 + 1e-9), 1e-3], id="equal but for rounding"),
        pytest.param([3.2e-18, -3.2e-18, 0.0], id="zero but for rounding"),
    ],
)
def test_axes_do_not_magnify_rounding(velocities: list[float]) -> None:
    """The angle of -3.2e-15°, which is zero but for rounding, is labelled 0, too."""
    rows = [[-30.0], [-3.2e-15], [30.0]]
    table = make_table({"dimers.angle": "deg"}, rows, velocity=velocities, scatter=0.0)
    panel = only_panel(figure_of(table))
    assert np.ptp(panel.get_ylim()) > 0.1  # mm/s
    assert tick_labels(panel) == ["-30", "0", "30"]


def test_a_key_with_one_value_among_the_finished_points_takes_no_colours() -> None:
    """The point with the second surface tension is missing, so the colours are the frictions."""
    units = {"drive.frequency": "Hz", "liquid.surface_tension": "N/m", WALL: ""}
    rows = [
        [60.0, 0.03, 0.1],
        [70.0, 0.03, 0.1],
        [60.0, 0.03, 0.2],
        [70.0, 0.03, 0.2],
        [60.0, 0.07, 0.1],
    ]
    table = make_table(units, rows, are_axes=True, velocity=[1e-3, 2e-3, 3e-3, 4e-3, 5e-3])
    table.loc[4, "status"] = "missing"
    with pytest.warns(LeftOutWarning, match="1 missing"):
        figure = figure_of(table)
    assert legend_of(figure) == ["0.1", "0.2"]


def table_of_all_pairs(keys: list[str]) -> pd.DataFrame:
    """A table in which each key is 0.1 or 0.2, in all combinations."""
    rows = list(product((0.1, 0.2), repeat=len(keys)))
    velocity = np.arange(len(rows)) * 1e-3
    return make_table(dict.fromkeys(keys, ""), rows, are_axes=True, velocity=velocity)


THREE_KEYS = ["drive.frequency", "contact.restitution", WALL]
FOUR_KEYS = [*THREE_KEYS, "boundary.tilt"]


@pytest.mark.parametrize(
    ("keys", "options", "message"),
    [
        pytest.param(
            THREE_KEYS,
            FigureOptions(),
            "panels: contact.friction.bead_wall varies beside drive.frequency (x), "
            "contact.restitution (hue): expected contact.friction.bead_wall, or none to draw all "
            "values alike",
            id="one key without a place",
        ),
        pytest.param(
            FOUR_KEYS,
            FigureOptions(x="restitution"),
            "panels: contact.friction.bead_wall, boundary.tilt vary beside contact.restitution "
            "(x), drive.frequency (hue): expected one of them, with the others fixed in the sweep "
            "file, or none to draw all values alike",
            id="two keys without a place",
        ),
        pytest.param(
            FOUR_KEYS,
            FigureOptions(panels="tilt"),
            "hue: contact.friction.bead_wall varies beside drive.frequency (x), "
            "contact.restitution (hue), boundary.tilt (panels): expected fewer keys in the sweep "
            "file, or none to draw all values alike",
            id="all places taken",
        ),
    ],
)
def test_a_figure_does_not_hide_keys_by_itself(
    keys: list[str], options: FigureOptions, message: str
) -> None:
    with pytest.raises(InputError) as error:
        figure_of(table_of_all_pairs(keys), options)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("keys", "options"),
    [
        pytest.param(THREE_KEYS, FigureOptions(panels="none"), id="three keys, no panels"),
        pytest.param(
            FOUR_KEYS, FigureOptions(x="restitution", panels="none"), id="four keys, no panels"
        ),
        pytest.param(
            FOUR_KEYS, FigureOptions(panels="tilt", hue="none"), id="four keys, no colours"
        ),
    ],
)
def test_a_figure_that_is_told_to_hide_keys_names_them_and_joins_no_points(
    keys: list[str], options: FigureOptions
) -> None:
    """A line through points that differ in a hidden key would mean nothing."""
    with pytest.warns(LeftOutWarning, match="not distinguished: .*friction bead wall"):
        figure = figure_of(table_of_all_pairs(keys), options)
    assert panels_of(figure)[0].lines[0].get_linestyle() == "None"


@pytest.fixture
def dependent_keys() -> pd.DataFrame:
    """A table of five keys: restitution and the column `slope` follow from the tilt.

    The peak acceleration has three values, the other keys have two; the seed only repeats points.
    """
    keys = [
        "drive.frequency",
        "boundary.tilt",
        "contact.restitution",
        "drive.peak_acceleration",
        "run.seed",
    ]
    rows = []
    slopes = []
    for frequency, tilt, acceleration, seed in product((60, 70), (0, 10), (2, 4, 6), (1, 2)):
        rows.append([frequency, tilt, 0.3 + tilt / 100.0, acceleration, seed])
        slopes.append(tilt)
    table = make_table(dict.fromkeys(keys, ""), rows, are_axes=True, velocity=1e-3)
    table["slope"] = slopes
    table.attrs["units"]["slope"] = ""
    return table


def test_what_follows_from_shown_columns_is_not_called_hidden(dependent_keys: pd.DataFrame) -> None:
    """With panels by slope, neither tilt nor restitution is hidden, and a seed needs no colours."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", LeftOutWarning)
        figure = figure_of(dependent_keys, FigureOptions(panels="slope"))
    assert titles_of(figure) == ["(a) slope = 0", "(b) slope = 10"]


def test_the_key_with_most_values_is_along_x_and_the_first_other_key_in_colours(
    dependent_keys: pd.DataFrame,
) -> None:
    figure = figure_of(dependent_keys, FigureOptions(panels="slope"))
    for panel in panels_of(figure):
        assert panel.get_xlabel() == "peak acceleration"
    assert legend_of(figure) == ["60", "70"]  # the frequencies


@pytest.fixture
def six_draws() -> pd.DataFrame:
    """A sample of a restitution, even in its range, and a friction, even in its logarithm.

    The rank correlation of six draws is 1 - 6 Σd²/(6·35), with the differences d of ranks. The
    velocities have the ranks 6, 5, 4, 3, 2, 1.
    Friction has 1, 2, 3, 4, 6, 5:    Σd² = 25 + 9 + 1 + 1 + 16 + 16 = 68, so -0.94.
    Restitution has 1, 6, 2, 4, 3, 5: Σd² = 25 + 1 + 4 + 1 + 1 + 16 = 48, so -0.37, which is chance.
    """
    rows = [[0.3, 0.1], [0.8, 0.2], [0.4, 0.3], [0.6, 0.4], [0.5, 0.6], [0.7, 0.5]]
    units = {"contact.restitution": "", WALL: ""}
    table = make_table(units, rows, velocity=[6e-3, 5e-3, 4e-3, 3e-3, 2e-3, 1e-3])
    table.attrs["sampled"] = {"contact.restitution": False, WALL: True}
    return table


def test_panels_of_a_sample_begin_with_the_strongest_key(six_draws: pd.DataFrame) -> None:
    figure = figure_of(six_draws)
    first, second = panels_of(figure)
    assert first.get_xlabel() == "friction bead wall"
    assert second.get_xlabel() == "restitution"
    assert titles_of(figure) == ["(a) rank correlation -0.94", "(b) no clear dependence"]


def test_keys_of_log_uniform_ranges_have_logarithmic_axes(six_draws: pd.DataFrame) -> None:
    friction, restitution = panels_of(figure_of(six_draws))
    assert friction.get_xscale() == "log"
    assert restitution.get_xscale() == "linear"


def test_five_draws_are_too_few_for_the_strongest_key(six_draws: pd.DataFrame) -> None:
    figure = figure_of(six_draws[:5])
    assert figure.get_suptitle().endswith("5 draws: too few for rank correlations")
    assert titles_of(figure) == ["(a)", "(b)"]


def test_a_draw_that_came_apart_does_not_count_for_the_strongest_key(
    six_draws: pd.DataFrame,
) -> None:
    """Five draws are left, which are too few."""
    figure = figure_of(six_draws.assign(separated_fraction=[0.5, 0.0, 0.0, 0.0, 0.0, 0.0]))
    assert figure.get_suptitle().endswith("6 draws: too few for rank correlations")
    assert titles_of(figure) == ["(a)", "(b)"]


AROUND_USUAL = [[0.2, 0.5], [0.1, 0.5], [0.3, 0.5], [0.2, 0.9]]
"""Friction and restitution, of which one at a time leaves its usual value, 0.2 or 0.5."""


@pytest.mark.parametrize(
    ("rows", "frictions", "restitutions"),
    [
        pytest.param(AROUND_USUAL, [0.1, 0.2, 0.3], [0.5, 0.9], id="one at a time"),
        pytest.param(
            [*AROUND_USUAL, [0.1, 0.9]],
            [0.1, 0.1, 0.2, 0.2, 0.3],
            [0.5, 0.5, 0.5, 0.9, 0.9],
            id="a point with both changed",
        ),
    ],
)
def test_keys_that_vary_one_at_a_time_are_each_shown_with_the_usual_others(
    rows: list[list[float]], frictions: list[float], restitutions: list[float]
) -> None:
    """If both keys change at a point, there is no usual value, and each panel shows all points."""
    velocity = np.arange(len(rows)) * 1e-3
    units = {WALL: "", "contact.restitution": ""}
    table = make_table(units, rows, velocity=velocity, scatter=1e-4)
    first, second = panels_of(figure_of(table))
    assert list(drawn_series(first)[0].x) == frictions
    assert list(drawn_series(second)[0].x) == restitutions


# --- factors ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "rows",
    [
        pytest.param([[0.1, 0.2], [0.2, 0.4], [0.3, 0.6]], id="both rise"),
        pytest.param([[0.1, 0.6], [0.2, 0.4], [0.3, 0.2]], id="one rises, one falls"),
    ],
)
def test_numbers_that_go_together_are_one_factor(rows: list[list[float]]) -> None:
    (factor,) = factors_of(make_table({WALL: "", BEAD: ""}, rows))
    assert factor.keys == (WALL, BEAD)
    assert factor.levels == [0.1, 0.2, 0.3]  # those of the first key
    assert not factor.is_sample


@pytest.mark.parametrize(
    ("rows", "levels_of_second"),
    [
        pytest.param([[0.1, 0.6], [0.2, 0.6], [0.3, 0.2]], [0.2, 0.6], id="constant, then falls"),
        pytest.param([[0.1, 0.2], [0.2, 0.2], [0.3, 0.6]], [0.2, 0.6], id="constant, then rises"),
        pytest.param([[0.1, 0.4], [0.2, 0.2], [0.3, 0.6]], [0.2, 0.4, 0.6], id="falls, then rises"),
    ],
)
def test_numbers_that_do_not_go_together_are_factors_of_a_sample(
    rows: list[list[float]], levels_of_second: list[float]
) -> None:
    first, second = factors_of(make_table({WALL: "", BEAD: ""}, rows))
    assert first.keys == (WALL,)
    assert first.levels == [0.1, 0.2, 0.3]
    assert second.keys == (BEAD,)
    assert second.levels == levels_of_second
    assert first.is_sample
    assert second.is_sample


@pytest.mark.parametrize(
    ("rows", "levels"),
    [
        pytest.param([["a", 2.0], ["b", 10.0]], ["a", "b"], id="the text tells them apart"),
        pytest.param(
            [["a", 2.0], ["a", 10.0], ["b", 2.0]],
            ["a, 2 g", "a, 10 g", "b, 2 g"],
            id="only both tell them apart",
        ),
    ],
)
def test_a_text_and_a_number_that_go_together_are_one_factor_of_named_points(
    rows: list[list[Any]], levels: list[str]
) -> None:
    units = {"liquid.name": "", "drive.peak_acceleration": "g"}
    (factor,) = factors_of(make_table(units, rows))
    assert factor.keys == ("liquid.name", "drive.peak_acceleration")
    assert factor.levels == levels
    assert not factor.is_sample


def test_a_single_point_has_no_factors() -> None:
    units = {"liquid.name": "", "drive.peak_acceleration": "g"}
    assert factors_of(make_table(units, [["a", 2.0]])) == []


# --- sweeps of the real engine ----------------------------------------------------------------


@pytest.fixture(scope="module")
def panels_by_frequency(looked_through: Path) -> Figure:
    """Velocity against peak acceleration, colours by friction, a panel for 60 and for 80 Hz."""
    return walkers.load(looked_through / "three").figure(panels="frequency")


def test_panels_are_titled_and_labelled(panels_by_frequency: Figure) -> None:
    assert titles_of(panels_by_frequency) == ["(a) frequency = 60 Hz", "(b) frequency = 80 Hz"]
    first, _ = panels_of(panels_by_frequency)
    assert first.get_xlabel() == "peak acceleration (g)"
    assert first.get_ylabel() == "velocity along the heading\n(mm/s)"
    assert legend_of(panels_by_frequency) == ["0.1", "0.2"]  # the frictions


def test_panels_have_the_same_scale(panels_by_frequency: Figure) -> None:
    first, second = panels_of(panels_by_frequency)
    assert first.get_ylim() == second.get_ylim()


@pytest.mark.parametrize(("colour", "friction"), [(0, 0.1), (1, 0.2)])
def test_a_series_has_the_points_of_its_colour_in_its_panel(
    colour: int, friction: float, panels_by_frequency: Figure, looked_through: Path
) -> None:
    table = walkers.load(looked_through / "three").table()
    rows = table[(table[WALL] == friction) & (table["drive.frequency"] == 80.0)]
    _, second = panels_of(panels_by_frequency)
    series = drawn_series(second)[colour]
    assert list(series.x) == [2.0, 4.0, 6.0]
    assert series.y == pytest.approx(rows["velocity"].to_numpy() * 1e3)
    assert series.error == pytest.approx(rows["scatter"].to_numpy() * 1e3)
    assert (series.error > 0.0).all()


def test_the_axis_the_colours_and_the_column_can_be_chosen(looked_through: Path) -> None:
    sweep = walkers.load(looked_through / "three")
    with pytest.warns(LeftOutWarning, match="not distinguished: peak acceleration"):
        figure = sweep.figure(x="frequency", hue="bead_wall", panels="none", y="sliding_2")
    panel = only_panel(figure)
    assert panel.get_xlabel() == "frequency (Hz)"
    assert panel.get_ylabel() == "sliding of bead 2 (mm/s)"


def test_a_column_that_follows_from_an_axis_can_stand_for_it(looked_through: Path) -> None:
    """Γ0 is proportional to the peak acceleration; the two colours are the frequencies."""
    panel = only_panel(walkers.load(looked_through / "grid").figure(x="gamma0", log="x"))
    assert panel.get_xlabel() == "Γ0"
    assert panel.get_xscale() == "log"
    assert len(drawn_series(panel)) == 2


@pytest.mark.parametrize(
    ("x", "log", "message"),
    [
        pytest.param("liquid.name", "x", "has no numbers", id="of names"),
        pytest.param(None, "z", r"^log: 'z': expected one of x, y, xy$", id="of no such axis"),
    ],
)
def test_a_logarithm_that_makes_no_sense_is_an_input_error(
    x: str | None, log: str, message: str, looked_through: Path
) -> None:
    with pytest.raises(InputError, match=message):
        walkers.load(looked_through / "beads").figure(x=x, log=log)


def test_pairs_of_beads_can_be_shown_by_their_asymmetry(looked_through: Path) -> None:
    """The sine of δ is (R1 - R2)/(R1 + R2), here for 0.25, 0.3 and 0.35 mm beside 0.2 mm."""
    figure = walkers.load(looked_through / "beads").figure(x="sin_delta")
    panel = only_panel(figure)
    assert panel.get_xlabel() == "sin δ"
    assert drawn_series(panel)[0].x == pytest.approx([0.05 / 0.45, 0.1 / 0.5, 0.15 / 0.55])
    assert legend_of(figure) == ["Si AK5", "Si AK10"]


def test_texts_are_categories_and_symbols_stand_beside_them(looked_through: Path) -> None:
    """The categories are at x = 0 and 1; each pair of beads is a little beside them."""
    figure = walkers.load(looked_through / "beads").figure(x="liquid.name")
    panel = only_panel(figure)
    assert tick_labels(panel) == ["Si AK5", "Si AK10"]
    assert legend_of(figure) == ["0.3/0.2 mm", "0.25/0.2 mm", "0.35/0.2 mm"]
    for series in drawn_series(panel):
        assert np.abs(series.x - [0.0, 1.0]).max() < 0.3


@pytest.fixture(scope="module")
def sampled_panels(looked_through: Path) -> dict[str, Axes]:
    """The panels of a sample of two frictions, by their x label."""
    figure = walkers.load(looked_through / "sampled").figure()
    return {panel.get_xlabel(): panel for panel in panels_of(figure)}


def test_a_sample_has_a_panel_for_each_key(sampled_panels: dict[str, Axes]) -> None:
    assert sampled_panels.keys() == {"friction bead wall", "friction bead bead"}


@pytest.mark.parametrize(
    ("key", "label"), [(WALL, "friction bead wall"), (BEAD, "friction bead bead")]
)
def test_a_panel_of_a_sample_has_all_draws_without_a_line(
    key: str, label: str, sampled_panels: dict[str, Axes], looked_through: Path
) -> None:
    table = walkers.load(looked_through / "sampled").table().sort_values(key)
    panel = sampled_panels[label]
    series = drawn_series(panel)[0]
    assert list(series.x) == pytest.approx(table[key].tolist())
    assert list(series.y) == pytest.approx((table["velocity"] * 1e3).tolist())
    assert panel.containers[0][0].get_linestyle() == "None"


@pytest.fixture
def own_runs(looked_through: Path, tmp_path: Path) -> Path:
    """A copy of the runs, some of which a test removes."""
    return Path(shutil.copytree(looked_through, tmp_path / "runs"))


def test_points_that_are_not_finished_are_left_out_and_counted(own_runs: Path) -> None:
    """The first of the three points at 60 Hz is removed."""
    shutil.rmtree(walkers.load(own_runs / "grid").table()["run"][0])
    with pytest.warns(LeftOutWarning, match="1 of 6 points left out: 1 missing"):
        figure = walkers.load(own_runs / "grid").figure()
    at_60_hz, at_80_hz = drawn_series(only_panel(figure))
    assert len(at_60_hz.x) == 2
    assert len(at_80_hz.x) == 3


def test_a_sweep_without_finished_points_has_no_figure(own_runs: Path) -> None:
    for run in walkers.load(own_runs / "grid").table()["run"]:
        shutil.rmtree(run)
    with pytest.raises(InputError, match=r"no point is finished \(6 missing\)"):
        walkers.load(own_runs / "grid").figure()


# --- headings ---------------------------------------------------------------------------------


def run_two_tones(folder: Path) -> None:
    """Run the sweep of `two_tones` in a folder."""
    times = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
    tables = document(dimers={"replicates": 2}, run=times)
    tables["drive"] = {
        "harmonics": [
            {"frequency": "80 Hz", "peak_acceleration": "4 g"},
            {"frequency": "160 Hz", "peak_acceleration": "3 g"},
        ]
    }
    sweep = {"case": "tones.toml", "axes": {"drive.harmonics[1].phase": ["0 deg", "90 deg"]}}
    (folder / "tones.toml").write_text(to_toml(tables))
    (folder / "phases.toml").write_text(to_toml(sweep))
    walkers.sweep(folder / "phases.toml", folder / "runs")


@pytest.fixture(scope="module")
def two_tones(once: FillOnce) -> walkers.Sweep:
    """Walkers on a level floor that two tones push, at two phases of the second tone.

    Walkers of both headings are pushed the same way: one goes forward and the other backward.
    """
    return walkers.load(once("two-tones", run_two_tones) / "runs" / "phases")


def test_headings_differ_on_a_level_floor_under_an_asymmetric_drive(
    two_tones: walkers.Sweep,
) -> None:
    assert two_tones.table()["facings_differ"].any()


def test_headings_that_differ_are_printed_beside_each_other(two_tones: walkers.Sweep) -> None:
    headers = []
    for line in two_tones.describe().splitlines():
        if line.split()[:1] == ["point"]:
            headers.append(line.split())
    (header,) = headers
    assert "right_facing" in header
    assert "left_facing" in header
    assert "velocity" not in header


def test_headings_that_differ_are_drawn_beside_each_other(two_tones: walkers.Sweep) -> None:
    assert legend_of(two_tones.figure()) == BOTH_WAYS


def run_tilted(folder: Path) -> None:
    """Run the sweep of `tilted` in a folder."""
    times = {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 10}
    (folder / "slope.toml").write_text(to_toml(document(dimers={"replicates": 2}, run=times)))
    sweep = {"case": "slope.toml", "axes": {"boundary.tilt": ["0 deg", "10 deg", "20 deg"]}}
    (folder / "tilt.toml").write_text(to_toml(sweep))
    walkers.sweep(folder / "tilt.toml", folder / "runs")


@pytest.fixture(scope="module")
def tilted(once: FillOnce) -> walkers.Sweep:
    """A walker that faces up and one that faces down, on slopes of 0°, 10° and 20°."""
    return walkers.load(once("tilted", run_tilted) / "runs" / "tilt")


def velocities_of_both_ways(panel: Axes) -> FloatArray:
    """The two drawn series of three slopes, mm/s, shape (2, 3)."""
    return np.array([line.get_ydata() for line in panel.lines if len(line.get_xdata()) == 3])


def test_walkers_that_face_down_a_slope_are_a_series_beside_those_that_face_up(
    tilted: walkers.Sweep,
) -> None:
    figure = tilted.figure()
    assert legend_of(figure) == BOTH_WAYS
    panel = only_panel(figure)
    assert panel.get_ylabel() == "velocity (mm/s)"
    expected = tilted.table()[["right_facing", "left_facing"]].to_numpy().T
    np.testing.assert_allclose(velocities_of_both_ways(panel), 1e3 * expected)


def test_of_walkers_that_lean_velocities_up_and_down_the_slope_are_drawn(
    tilted: walkers.Sweep,
) -> None:
    """None of them counts as upright, so the drawn velocities are those along the slope."""
    table = tilted.table()
    panel = only_panel(figure_of(table.assign(upright=0)))
    assert panel.get_ylabel() == "velocity along the drive\naxis (mm/s)"
    expected = np.zeros((2, 3))
    for point, run in enumerate(table["run"]):
        velocity = walkers.load(Path(run)).walkers.set_index("facing")["axial_velocity"]
        expected[:, point] = [velocity[1], velocity[-1]]
    np.testing.assert_allclose(velocities_of_both_ways(panel), 1e3 * expected)


def test_a_chosen_column_is_drawn_without_walkers_that_face_down(tilted: walkers.Sweep) -> None:
    assert not legend_of(tilted.figure(y="right_facing"))


def test_a_series_of_walkers_that_face_down_needs_numbers(tilted: walkers.Sweep) -> None:
    table = tilted.table().assign(upright=0, axial_left_facing=np.nan)
    assert not legend_of(figure_of(table))


# --- theory -----------------------------------------------------------------------------------


def velocities_of_theory(runs: Sequence[str]) -> dict[str, list[float]]:
    """Velocities of runs as both models predict them, mm/s, by model."""
    velocities: dict[str, list[float]] = {"viscous": [], "paper": []}
    for run in runs:
        prediction = predict(case_of(Path(run)))
        for model, values in velocities.items():
            values.append(1e3 * prediction[model]["velocity"])
    return velocities


def test_the_theory_of_a_sweep_is_a_curve_of_each_model_through_its_velocity_at_each_point(
    looked_through: Path,
) -> None:
    """Checked at 80 Hz, whose points have the second colour; the curves span their range.

    The paper's fit does not depend on the frequency, and has one curve.
    """
    sweep = walkers.load(looked_through / "grid")
    figure = sweep.figure(theory=True)
    assert legend_of(figure)[2:] == [FRICTION_MODEL, PAPER_FIT]
    panel = only_panel(figure)
    points = drawn_series(panel)[1].x
    at_60_hz, at_80_hz, of_paper = theory_lines(panel)
    assert at_60_hz.get_color() != at_80_hz.get_color()
    curves = [at_80_hz, of_paper]
    table = sweep.table()
    velocities = velocities_of_theory(table.loc[table["drive.frequency"] == 80.0, "run"])
    for curve, style, model in zip(curves, ("--", ":"), ("viscous", "paper"), strict=True):
        assert curve.get_linestyle() == style
        x, y = map(np.asarray, curve.get_data())
        assert len(x) == THEORY_POINTS
        assert [x[0], x[-1]] == [min(points), max(points)]
        assert np.interp(points, x, y) == pytest.approx(velocities[model], rel=5e-3)
        # The axis shows some of it.
        low, high = panel.get_ylim()
        assert low < y.max()
        assert y.min() < high


def test_a_column_that_the_theory_does_not_have_is_said(looked_through: Path) -> None:
    sweep = walkers.load(looked_through / "grid")
    with pytest.warns(LeftOutWarning, match="6 of 6 points: the theory has no orientation_end"):
        sweep.figure(y="orientation_end", theory=True)


@pytest.mark.parametrize(
    ("far_ends", "end_of_axis"),
    [
        pytest.param((0.1, 0.2), 1, id="above"),
        pytest.param((-0.2, -0.1), 0, id="below"),
    ],
)
def test_a_theory_far_from_the_runs_is_shown_up_to_its_nearer_end(
    far_ends: tuple[float, float], end_of_axis: int, looked_through: Path
) -> None:
    """Of a curve from 100 to 200 mm/s above or below runs of some mm/s, the end at 100 mm/s."""

    def straight_lines(
        cases: Sequence[Case], _: str
    ) -> tuple[dict[str, FloatArray], dict[str, int]]:
        near = np.linspace(1e-3, 2e-3, len(cases))
        far = np.linspace(*far_ends, len(cases))
        return {"near": near, "far": far}, {}

    table = table_of(read_sweep_record(looked_through / "grid"))
    panel = only_panel(figure_of_table(table, predict=straight_lines))
    assert 100.0 < abs(panel.get_ylim()[end_of_axis]) < 120.0


def run_without_units(folder: Path) -> None:
    """Run the sweeps of `without_units` in a folder."""
    tables = document(run=TINY, dimers={"replicates": 2, "angle_spread": "1 deg"})
    tables["drive"] = {"frequency": "80 Hz", "gamma0": 0.6}
    (folder / "walker.toml").write_text(to_toml(tables))
    axes: dict[str, dict[str, list[float]]] = {
        "driven": {"drive.gamma0": [0.3, 0.6, 0.9]},
        "rubbed": {WALL: [0.05, 0.1, 0.2]},
        "repeated": {"dimers.replicates": [1, 3]},
    }
    for name, axis in axes.items():
        (folder / f"{name}.toml").write_text(to_toml({"case": "walker.toml", "axes": axis}))
        walkers.sweep(folder / f"{name}.toml", folder / "runs", jobs=1)


@pytest.fixture(scope="module")
def without_units(once: FillOnce) -> Path:
    """Folder with sweeps of a walker along Γ0, along a friction, and along its replicates."""
    return once("without-units", run_without_units) / "runs"


@pytest.mark.parametrize("name", ["driven", "rubbed"])
def test_the_theory_is_a_fine_curve_along_keys_without_a_unit(
    name: str, without_units: Path
) -> None:
    sweep = walkers.load(without_units / name)
    panel = only_panel(sweep.figure(theory=True))
    (series,) = drawn_series(panel)
    velocities = velocities_of_theory(sweep.table()["run"])
    for (x, y), model in zip(theory_curves(panel), ("viscous", "paper"), strict=True):
        assert len(x) == THEORY_POINTS
        assert x[0] == series.x[0]
        assert x[-1] == series.x[-1]
        assert np.interp(series.x, x, y) == pytest.approx(velocities[model], rel=5e-3)


def assert_curves_span_their_points(panel: Axes) -> None:
    """The model with friction has a curve for each series, from its first to its last point."""
    dashed = [line.get_data() for line in theory_lines(panel) if line.get_linestyle() == "--"]
    for (x, _), series in zip(dashed, drawn_series(panel), strict=True):
        assert len(x) == THEORY_POINTS
        assert x[[0, -1]] == pytest.approx(series.x[[0, -1]], rel=1e-9)


def test_a_curve_along_an_acceleration_that_follows_from_gamma0_is_in_the_unit_of_the_axis(
    without_units: Path,
) -> None:
    """The axis is in g, not in m/s²."""
    figure = walkers.load(without_units / "driven").figure(theory=True, x="peak_acceleration")
    assert_curves_span_their_points(only_panel(figure))


def test_a_curve_along_gamma0_that_follows_from_an_acceleration_is_in_the_unit_of_the_axis(
    looked_through: Path,
) -> None:
    figure = walkers.load(looked_through / "grid").figure(theory=True, x="gamma0")
    assert_curves_span_their_points(only_panel(figure))


def test_numbers_of_replicates_have_no_theory_between_them(without_units: Path) -> None:
    """Among 61 numbers from 1 to 3, only 1, 2 and 3 are numbers of replicates."""
    panel = only_panel(walkers.load(without_units / "repeated").figure(theory=True))
    of_coulomb_model, of_paper_fit = theory_curves(panel)
    assert list(of_coulomb_model[0]) == [1.0, 2.0, 3.0]
    assert list(of_paper_fit[0]) == [1.0, 2.0, 3.0]
