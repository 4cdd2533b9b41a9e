"""Two cases compared over the draws of their spreads, with common and with independent unknowns."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import LineCollection

import walkers
from tests.conftest import ESCAPE, TINY, FillOnce, call, document, on_terminal, to_toml
from walkers.errors import InputError
from walkers.postprocess.measure.uncertainty import spread_of
from walkers.runs.draws import Band, ComparedDraws, Draws, Unknown, compare_draws
from walkers.runs.draws_text import compared_draws_text
from walkers.sweeps.spread import draws_of
from walkers.sweeps.table import cells_of, load_table

FRICTION = "contact.friction.bead_wall"
RESTITUTION = "contact.restitution"
ROUGHNESS = "contact.roughness.bead_bead"
RANGE = [0.05, 0.3]
WIDER_RANGE = [0.05, 0.4]
POINTS = 4


def make_unknown(
    value: float = 0.2, low: float = 0.1, high: float = 0.6, *, logarithmic: bool = False
) -> Unknown:
    return Unknown(value, low, high, logarithmic, text=f"{value}", ends=(low, high))


UNKNOWN = make_unknown()


def make_draws(
    frictions: list[float], velocities: list[float], unknown: Unknown = UNKNOWN
) -> Draws:
    """Draws of one unknown, with velocities in m/s."""
    values = np.array(frictions)[:, np.newaxis]
    return Draws({FRICTION: unknown}, values, {"velocity": np.array(velocities)})


def compared(first: Draws, second: Draws) -> ComparedDraws:
    """The velocities of draws, compared."""
    result = compare_draws(first, second, "velocity", "m/s")
    assert result is not None
    return result


def numbers_of(band: Band | None) -> list[float]:
    """A band in its order, from 5 to 95 %."""
    assert band is not None
    return [band.low, band.median, band.high]


FIRST = make_draws([0.1, 0.2, 0.3], [1.0, 2.0, 4.0])
SECOND = make_draws([0.3, 0.1, 0.2], [8.0, 3.0, 4.0])
"""The same draws in another order."""


def test_draws_of_the_same_values_are_pairs_in_any_order() -> None:
    """Pairs are 1 and 3, 2 and 4, 4 and 8; percentiles lie between neighbours in proportion."""
    pairs = compared(FIRST, SECOND).common
    assert pairs is not None
    assert pairs.pairs == 3
    assert numbers_of(pairs.difference) == pytest.approx([2.0, 2.0, 3.8])
    assert numbers_of(pairs.ratio) == pytest.approx([2.0, 2.0, 2.9])
    assert pairs.second_larger == 1.0


def test_independent_unknowns_take_each_draw_with_each() -> None:
    """Differences are -1, 0, 1, 2, 2, 3, 4, 6, 7."""
    pairs = compared(FIRST, SECOND).independent
    assert pairs.pairs == 9
    assert numbers_of(pairs.difference) == pytest.approx([-0.6, 2.0, 6.6])
    assert pairs.second_larger == pytest.approx(7 / 9)


def test_values_in_another_unit_differ_by_rounding_and_are_pairs() -> None:
    second = make_draws([0.1 * (1.0 + 1e-15), 0.2, 0.3], [3.0, 4.0, 8.0])
    pairs = compared(FIRST, second).common
    assert pairs is not None
    assert pairs.pairs == 3


def test_a_pair_without_a_velocity_is_left_out() -> None:
    """The walkers of a draw came apart."""
    second = make_draws([0.1, 0.2, 0.3], [3.0, np.nan, 8.0])
    comparison = compared(FIRST, second)
    assert comparison.common is not None
    assert comparison.common.pairs == 2
    assert comparison.draws == (3, 2)
    assert comparison.independent.pairs == 6


@pytest.mark.parametrize(
    ("velocities", "has_ratio"),
    [
        pytest.param([1.0, 2.0, 4.0], True, id="forward"),
        pytest.param([-1.0, -2.0, -4.0], True, id="backward"),
        pytest.param([1.0, -2.0, 4.0], False, id="both ways"),
        pytest.param([1.0, 1e-6, 4.0], False, id="one at rest"),
    ],
)
def test_a_ratio_needs_a_velocity_of_one_sign(velocities: list[float], has_ratio: bool) -> None:
    comparison = compared(make_draws([0.1, 0.2, 0.3], velocities), SECOND)
    assert (comparison.independent.ratio is not None) == has_ratio
    text = compared_draws_text(comparison, "a", "b")
    assert ("no ratio" in text) != has_ratio


@pytest.mark.parametrize(
    ("unknown", "reason"),
    [
        pytest.param(make_unknown(high=0.4), "0.1 to 0.6, and 0.1 to 0.4", id="range"),
        pytest.param(make_unknown(value=0.3), "around 0.2, and 0.3", id="value"),
        pytest.param(
            make_unknown(logarithmic=True), "drawn uniformly, and log-uniformly", id="scale"
        ),
    ],
)
def test_draws_of_other_ranges_are_not_pairs(unknown: Unknown, reason: str) -> None:
    comparison = compared(FIRST, make_draws([0.1, 0.2, 0.3], [3.0, 4.0, 8.0], unknown))
    assert comparison.common is None
    assert comparison.other_unknowns == [f"{FRICTION} {reason}"]
    text = " ".join(compared_draws_text(comparison, "a", "b").split())
    assert f"no pairs of draws with common unknowns, because some differ: {FRICTION}" in text


def test_an_unknown_of_one_case_alone_leaves_no_pairs() -> None:
    unknowns = {FRICTION: make_unknown(), RESTITUTION: make_unknown()}
    velocities = {"velocity": np.array([1.0, 2.0])}
    first = Draws(unknowns, np.array([[0.1, 0.3], [0.2, 0.4]]), velocities)
    comparison = compared(first, SECOND)
    assert comparison.common is None
    assert comparison.common_unknowns == [FRICTION]
    assert comparison.other_unknowns == [f"{RESTITUTION} in the first case alone"]
    assert comparison.for_first == {}
    assert comparison.for_second == {RESTITUTION: unknowns[RESTITUTION]}


def test_ranges_to_take_over_are_printed_as_lines_of_a_case_file() -> None:
    """Values and ranges of the first case for the second one, and what that has alone."""
    unknowns = {
        FRICTION: Unknown(0.3, 0.1, 0.6, False, "0.3", (0.1, 0.6)),
        ROUGHNESS: Unknown(3e-8, 2e-8, 8e-8, True, "30 nm", ("20 nm", "80 nm")),
    }
    velocities = {"velocity": np.array([1.0, 2.0])}
    second = Draws(unknowns, np.array([[0.1, 3e-8], [0.2, 4e-8]]), velocities)
    printed = compared_draws_text(compared(FIRST, second), "a", "b")
    lines = [
        "for a:",
        "  [uncertain]",
        '  contact.roughness.bead_bead = { loguniform = ["20 nm", "80 nm"] } # around 30 nm',
        "for b:",
        "  [uncertain]",
        "  contact.friction.bead_wall = [0.1, 0.6] # around 0.2",
    ]
    assert printed.endswith("\n".join(["", *lines]))


def test_draws_of_no_equal_values_say_how_to_have_pairs() -> None:
    comparison = compared(FIRST, make_draws([0.15, 0.25], [3.0, 4.0]))
    assert comparison.common is None
    assert "the same number of --points" in compared_draws_text(comparison, "a", "b")


# --- on the engine ----------------------------------------------------------------------------


def uncertain_case(friction: list[float]) -> dict[str, Any]:
    """The tables of a case in which a range of the friction is the only unknown."""
    return document(run=TINY, liquid={"edge_ratio": 0.0}, uncertain={FRICTION: friction})


@pytest.fixture(scope="module")
def spreads(once: FillOnce) -> Path:
    """A sweep of two accelerations with spreads, and a case of another range of the friction."""

    def fill(folder: Path) -> None:
        base = folder / "base.toml"
        base.write_text(to_toml(uncertain_case(RANGE)))
        tables = {"case": str(base), "axes": {"drive.peak_acceleration": ["3 g", "6 g"]}}
        (folder / "fast.toml").write_text(to_toml(tables))
        walkers.sweep(folder / "fast.toml", folder / "runs", spread=POINTS)
        wider = folder / "wider.toml"
        wider.write_text(to_toml(uncertain_case(WIDER_RANGE)))
        walkers.run(wider, folder / "runs").spread(POINTS)

    return once("spreads-to-compare", fill)


@pytest.fixture
def copied_runs(spreads: Path, tmp_path: Path) -> Path:
    """A copy of the runs, for a test that changes them."""
    return Path(shutil.copytree(spreads / "runs", tmp_path / "runs"))


@pytest.fixture
def both_points(spreads: Path) -> list[Path]:
    """The runs of both points of the sweep."""
    return [run.directory for run in walkers.Sweep(spreads / "runs" / "fast").runs]


def draws_in_mm(run: Path) -> pd.DataFrame:
    """Friction, and velocity in mm/s, of the draws of a run's spread."""
    table = load_table(spread_of(run))
    return table[[FRICTION]].assign(velocity=1e3 * table["velocity"])


def test_two_runs_are_compared_at_equal_frictions(both_points: list[Path]) -> None:
    first, second = map(draws_in_mm, both_points)
    pairs = first.merge(second, on=FRICTION)
    assert len(pairs) == POINTS
    contents: Any = walkers.compare(*both_points).contents["draws"]
    assert contents["common_unknowns"] == [FRICTION]
    difference = (pairs["velocity_y"] - pairs["velocity_x"]).quantile([0.05, 0.5, 0.95])
    ratio = (pairs["velocity_y"] / pairs["velocity_x"]).quantile([0.05, 0.5, 0.95])
    band = contents["common"]
    assert [1e3 * end for end in band["difference"].values()] == pytest.approx(difference.tolist())
    assert list(band["ratio"].values()) == pytest.approx(ratio.tolist())


def test_common_unknowns_narrow_the_ratio(both_points: list[Path]) -> None:
    draws: Any = walkers.compare(*both_points).contents["draws"]
    width = {}
    for name in ("common", "independent"):
        ratio = draws[name]["ratio"]
        width[name] = ratio["high"] - ratio["low"]
    assert width["common"] < width["independent"]


def test_the_program_prints_which_unknowns_are_common(both_points: list[Path]) -> None:
    printed = call("compare", *map(str, both_points), check=True).stdout
    assert f"\ncommon unknowns: {FRICTION} have the same value in both runs" in printed
    assert "\nindependent unknowns: each run has its own values of them\n" in printed
    assert "which may shift both results alike" not in printed


def test_other_ranges_are_told_and_give_the_independent_band_alone(
    both_points: list[Path], spreads: Path
) -> None:
    done = call("compare", str(both_points[0]), "wider.toml", folder=spreads)
    lines = done.stdout.splitlines()
    assert [line for line in lines if line.startswith("common ")] == []
    assert len([line for line in lines if line.startswith("independent  ")]) == 1
    assert f"{FRICTION} 0.05 to 0.3, and 0.05 to 0.4" in done.stdout


def test_a_range_that_is_given_later_counts(
    both_points: list[Path], copied_runs: Path, tmp_path: Path
) -> None:
    """The run of the case does not know the range of its file, which changes no number."""
    (tmp_path / "wider.toml").write_text(to_toml(uncertain_case([0.05, 0.35])))
    call("run", "wider.toml", "--spread", "--points", str(POINTS), check=True, folder=tmp_path)
    first = copied_runs / both_points[0].name
    done = call("compare", str(first), "wider.toml", check=True, folder=tmp_path)
    assert f"{FRICTION} 0.05 to 0.3, and 0.05 to 0.35" in done.stdout


def test_the_points_of_a_sweep_are_compared_with_the_first(
    both_points: list[Path], spreads: Path
) -> None:
    done = call("compare", "fast", "--json", folder=spreads, check=True)
    (point,) = json.loads(done.stdout)["points"]
    assert point.pop("point") == 1
    of_runs = walkers.compare(*both_points).contents["draws"]
    assert point == json.loads(json.dumps(of_runs))
    printed = call("compare", "fast", folder=spreads, check=True).stdout
    assert printed.startswith("fast: velocity (mm/s) of each point against point 0 (3 g)\n")
    assert "\n1      common       6 g " in printed
    assert "\n1      independent  6 g " in printed


@pytest.mark.parametrize("names", ["fast", "both points"])
def test_compared_bands_fit_a_terminal(names: str, both_points: list[Path], spreads: Path) -> None:
    compared_names = [str(point) for point in both_points] if names == "both points" else [names]
    printed = ESCAPE.sub("", on_terminal("compare", *compared_names, folder=spreads))
    lines = [line for line in printed.splitlines() if str(spreads) not in line]
    assert "second larger" in printed
    assert max(map(len, lines)) <= 80


def test_parts_of_a_split_comparison_name_point_and_unknowns(spreads: Path) -> None:
    printed = ESCAPE.sub("", on_terminal("compare", "fast", folder=spreads, columns=50))
    parts = re.findall(r"(?m)^point +unknowns .*\n1 +common .*\n1 +independent .*$", printed)
    assert len(parts) > 1


def test_a_sweep_needs_two_points_with_a_spread(both_points: list[Path], copied_runs: Path) -> None:
    runs = copied_runs
    (spread_of(runs / both_points[1].name) / "spread.json").unlink()
    with pytest.raises(InputError, match="expected a spread of the first point and of another"):
        walkers.compare("fast", out=runs)


def test_a_band_of_one_point_alone_has_a_column(both_points: list[Path], copied_runs: Path) -> None:
    shutil.rmtree(spread_of(copied_runs / both_points[1].name))
    frame = load_table(copied_runs / "fast")
    cells, same = cells_of(frame)
    with_band, without = cells["velocity_low (mm/s)"].tolist()
    assert float(with_band) == pytest.approx(1e3 * frame["velocity_low"][0], rel=1e-2)
    assert without == "-"
    assert "velocity_" not in same


def test_a_band_between_points_without_one_is_drawn_as_a_bar(
    both_points: list[Path], copied_runs: Path
) -> None:
    sweep = walkers.Sweep(copied_runs / "fast")
    assert bars_of(sweep) == []  # the band joins both points
    shutil.rmtree(spread_of(copied_runs / both_points[1].name))
    low, high = sweep.refresh().table().loc[0, ["velocity_low", "velocity_high"]]
    ((place, *ends),) = bars_of(sweep)
    assert place == 3.0  # g, of the first point
    assert ends == pytest.approx([1e3 * low, 1e3 * high])


def bars_of(sweep: walkers.Sweep) -> list[list[float]]:
    """Place, lower and upper end of the bars in the only panel of the figure of a sweep."""
    (axes,) = sweep.figure().axes
    bars = []
    for lines in axes.collections:
        if isinstance(lines, LineCollection) and lines.get_linewidth()[0] == 4.0:
            for (place, low), (_, high) in lines.get_segments():
                bars.append([place, low, high])
    return bars


def test_a_damaged_spread_counts_as_none(both_points: list[Path], copied_runs: Path) -> None:
    runs = copied_runs
    first = runs / both_points[0].name
    assert draws_of(first) is not None
    (spread_of(first) / "sweep.json").write_text("{")
    assert draws_of(first) is None
    comparison = walkers.compare(first, runs / both_points[1].name)
    assert comparison.contents["draws"] is None
    assert "which may shift both results alike" in comparison.text
