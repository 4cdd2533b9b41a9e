"""Statistics of climbs: a made-up pile with three climbs, worked out by hand or by a second formula; a real sweep."""

from __future__ import annotations

import json
import tomllib
from itertools import combinations, product
from math import exp, log, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from scipy.stats import poisson

import walkers
from docs import tables
from tests.conftest import call, to_toml
from walkers.inputs.reading import shipped
from walkers.sweeps.climbing import (
    PARTS,
    climb_summary,
    conditions_in,
    leaders,
    survival,
)
from walkers.sweeps.climbing_output import climbing_table, climbs_figure, texts_of

BEADS, LARGE, LENGTH = 20, 4, 10.0
CLIMB: dict[str, Any] = {
    "speed": 2e-3,
    "height": 0.01,
    "out_of_pile": True,
    "large": 1,
    "leader_large": True,
    "walls": 1,
}
CLIMBS = pd.DataFrame(
    [
        CLIMB
        | {
            "onset": 6.0,
            "qualified": 7.0,
            "wall_names": "+x, +y",
            "leader": 1,
            "leader_large": False,
            "size": 4,
        }
        | {"walls": 2},
        CLIMB | {"onset": 1.5, "qualified": 2.0, "wall_names": "+x", "leader": 0, "size": 2},
        CLIMB
        | {
            "onset": 3.0,
            "qualified": 4.0,
            "wall_names": "-y",
            "leader": 0,
            "size": 3,
            "speed": 4e-3,
        }
        | {"out_of_pile": False},
    ]
).assign(pile=[0, 0, 1])
"""Climbs of four runs of 10 s; the first climb of the first run is the second in the table."""
GARWOOD = {0: (0.0, 3.6889), 1: (0.0253, 5.5716), 2: (0.2422, 7.2247), 3: (0.6187, 8.7673)}
"""Exact 95 % intervals of the mean of a Poisson distribution by the observed number, as tabulated."""


PILES = pd.DataFrame({"beads": BEADS, "large": LARGE, "driven": [LENGTH] * 4})


def drawn(
    begins: Any, lengths: Any, takes: float, within: float | None = None, **columns: Any
) -> dict[str, Any]:
    """`climb_summary` of runs whose first climbs began so and take so long to gain enough, where the run shows that, s."""
    rows = pd.DataFrame(
        [CLIMB | {"size": 2, "leader": 0, "wall_names": "+x"}] * len(begins)
    ).assign(**columns)
    rows = rows.assign(pile=range(len(begins)), onset=begins, qualified=np.add(begins, takes))
    piles = pd.DataFrame({"beads": BEADS, "large": LARGE, "driven": lengths})
    return climb_summary(piles, rows[rows["qualified"] <= lengths], within)


def test_a_rate_has_the_exact_interval_of_a_poisson_distribution() -> None:
    """Each end leaves 2.5 %: so many climbs or more at the lower end, so many or fewer at the upper one."""
    found = climb_summary(PILES, CLIMBS)
    rows = climbing_table([{**found, "condition": "few"}]).set_index("where")
    for where, climbs in {"all": 3, "plain walls": 2, "corners": 1}.items():
        row = rows.loc[where]
        assert (row["condition"], row["runs"], row["climbs"]) == ("few", 4, climbs)
        assert (row["rate_low"] * 40.0, row["rate_high"] * 40.0) == pytest.approx(
            GARWOOD[climbs], abs=6e-5
        )
    assert [*rows["probability"]] == [0.5, 0.5, 0.25]
    ends = (rows["probability_low"]["all"], rows["probability_high"]["all"])
    assert ends == pytest.approx((0.0676, 0.9324), abs=6e-5)
    for part, climbs in {"": 3, "on_plain_walls": 2, "in_corners": 1, "out_of_pile": 2}.items():
        one = found[part] if part else found
        assert (one["climbs"], one["seconds"], one["rate"]) == (
            climbs,
            40.0,
            pytest.approx(climbs / 40.0),
        ), part
        low, high = np.array(one["rate_interval"]) * 40.0
        assert (low, high) == pytest.approx(GARWOOD[climbs], abs=6e-5), part
        assert (poisson.sf(climbs - 1, low), poisson.cdf(climbs, high)) == pytest.approx(
            (0.025, 0.025)
        ), part
    none = climb_summary(PILES[2:], CLIMBS[:0])
    assert (none["rate"], none["dispersion"]) == (0.0, None)
    assert np.array(none["rate_interval"]) * 20.0 == pytest.approx(GARWOOD[0], abs=6e-5)


def test_times_dispersion_and_probability_of_three_climbs_also_of_runs_cut() -> None:
    found = climb_summary(PILES, CLIMBS)
    expected = {
        "within": LENGTH,
        "times": [2.0, 4.0],
        "onsets": [1.5, 3.0],
        "median": 4.0,
        "censored": 2,
        "ended": 0,
    }
    expected |= {"speeds": [2e-3, 2e-3, 4e-3], "sizes": [4, 2, 3], "led_by_large": 2}
    assert {name: found[name] for name in expected} == expected
    # Two of four, Clopper and Pearson: p with (1-p)⁴ + 4p(1-p)³ + 6p²(1-p)² = 0.025 at the upper end.
    assert (found["probability"], found["estimator"]) == (0.5, "Clopper-Pearson")
    assert found["interval"] == pytest.approx([0.0676, 0.9324], abs=6e-5)
    # Counts 2, 1, 0, 0: mean 3/4, variance (25/16 + 1/16 + 18/16)/3 = 11/12.
    assert found["dispersion"] == pytest.approx(11.0 / 12.0 / 0.75)
    # Runs cut at 5 s: counts 1, 1, 0, 0, mean 1/2, variance (4 × 1/4)/3.
    cut = climb_summary(PILES, CLIMBS, within=5.0)
    assert (cut["within"], cut["seconds"], cut["climbs"], cut["climbed"], cut["rate"]) == (
        5.0,
        20.0,
        2,
        2,
        0.1,
    )
    assert cut["dispersion"] == pytest.approx(2.0 / 3.0)
    printed = texts_of({**found, "condition": ""})
    texts = {"climbed": "2 of 4", "half by (s)": "4", "led by large": "2 of 3", "beads": "2 to 4"}
    texts |= {"rate": "0.075 (0.015 to 0.22)", "in corners": "0.025 (0.00063 to 0.14)"}
    texts |= {"speed (mm/s)": "2 to 4", "median speed (mm/s)": "2"}
    assert {name: printed[name] for name in texts} == texts


def test_the_share_of_runs_of_all_lengths_is_kaplans_and_meiers() -> None:
    """Climbs after 1, 3 and 4 s, ends without one after 2, 5 and 6 s: 6, then 4, then 3 piles were at risk."""
    first, watched = (
        np.array([1.0, np.inf, 3.0, 4.0, np.inf, np.inf]),
        np.array([7.0, 2.0, 7.0, 7.0, 5.0, 6.0]),
    )
    found = survival(first, watched, 4.5)
    stay = 5.0 / 6.0 * 3.0 / 4.0 * 2.0 / 3.0
    assert (found["climbed"], found["ended"], found["censored"], found["median"]) == (3, 1, 3, 4.0)
    assert (found["probability"], found["estimator"]) == (pytest.approx(1.0 - stay), "Kaplan-Meier")
    # Greenwood's variance of ln(-ln S).
    deviation = sqrt(1.0 / (6.0 * 5.0) + 1.0 / (4.0 * 3.0) + 1.0 / (3.0 * 2.0)) / -log(stay)
    ends = [1.0 - stay ** exp(sign * 1.959964 * deviation) for sign in (-1.0, 1.0)]
    assert found["interval"] == pytest.approx(ends, abs=1e-6)


def test_runs_that_climbers_ended_tell_of_later_times() -> None:
    """Two piles have climbed, and their climbers left. A third has not by 2.5 s: nobody knows after that."""
    left = survival(np.array([1.0, 2.0]), np.array([3.0, 3.5]), 5.0)
    assert (left["probability"], left["interval"]) == (1.0, pytest.approx([0.025**0.5, 1.0]))
    half = survival(
        np.array([1.0, np.inf]), np.array([1.5, 3.5]), 3.0
    )  # one of two, Clopper and Pearson
    assert half["interval"] == pytest.approx([1.0 - 0.975**0.5, 0.975**0.5])
    assert (
        survival(np.array([1.0, 2.0, np.inf]), np.array([3.0, 3.5, 2.5]), 5.0)["probability"]
        is None
    )


def test_as_many_large_leaders_by_chance_are_enumerated() -> None:
    """Two of three leaders are large; as many by chance, over all ways to deal the labels."""
    found = leaders(PILES, CLIMBS)
    first = [sum(bead < LARGE for bead in pair) for pair in combinations(range(BEADS), 2)]
    second = [bead < LARGE for bead in range(BEADS)]
    among_beads = np.mean([one + other >= 2 for one, other in product(first, second)])
    assert found["p_among_beads"] == pytest.approx(among_beads, abs=0.01)
    assert found["share_of_large"] == LARGE / BEADS
    # Both of two beads that lead are large, of two large ones in three: 2/3 · 1/2.
    pair = CLIMBS[:2].assign(leader=[0, 1], leader_large=True)
    few = leaders(PILES.assign(beads=3, large=2), pair)
    assert (few["led_by_large"], few["p_among_beads"]) == (2, pytest.approx(1.0 / 3.0, abs=0.02))
    # One bead that leads twice counts twice: 4 of 20 beads are large.
    twice = leaders(PILES, CLIMBS[1:2].iloc[[0, 0]])
    assert twice["p_among_beads"] == pytest.approx(LARGE / BEADS, abs=0.02)


def test_piles_that_were_not_driven_have_no_rate() -> None:
    found = climb_summary(PILES.assign(driven=0.0), CLIMBS[:0])
    assert (found["seconds"], found["rate"], found["rate_interval"]) == (0.0, None, None)
    assert texts_of({**found, "condition": ""})["rate"] == "–"


@pytest.mark.parametrize(("shortest", "has_dispersion"), [(9.1, True), (8.9, False)])
def test_runs_whose_lengths_differ_by_more_than_a_tenth_have_no_dispersion(
    shortest: float, has_dispersion: bool
) -> None:
    """Numbers of climbs of runs of different lengths vary even if climbs are as frequent."""
    found = climb_summary(PILES.assign(driven=[10.0, 10.0, 10.0, shortest]), CLIMBS)
    assert (found["dispersion"] is not None) == has_dispersion


def test_chances_are_printed_with_the_share_of_large_beads() -> None:
    """Of 4 large beads in 20; a probability cannot be told below two of the 10,000 draws."""
    found = climb_summary(PILES, CLIMBS)
    printed = texts_of({**found, "condition": ""})
    assert printed["large beads (%)"] == "20"
    assert float(printed["p by chance"]) == pytest.approx(found["p_among_beads"], rel=0.05)
    rare = texts_of({**found, "condition": "", "p_among_beads": 1e-4})
    assert rare["p by chance"] == "0.0002"
    none = texts_of({**climb_summary(PILES, CLIMBS[:0]), "condition": ""})
    absent = (
        "p by chance",
        "dispersion",
        "half by (s)",
        "speed (mm/s)",
        "median speed (mm/s)",
        "height (mm)",
        "beads",
    )
    assert {name: none[name] for name in absent} == dict.fromkeys(absent, "–")
    assert (none["climbed"], none["led by large"]) == ("0 of 4", "0 of 0")


def test_speeds_of_two_climbs_are_told_by_their_range_and_median() -> None:
    """2 and 4 mm/s, and one that was not measured."""
    climbs = CLIMBS.assign(speed=[np.nan, 2e-3, 4e-3], height=[5e-3, 10e-3, 12e-3])
    printed = texts_of({**climb_summary(PILES, climbs), "condition": ""})
    assert (printed["speed (mm/s)"], printed["median speed (mm/s)"]) == ("2 to 4", "3")
    assert printed["height (mm)"] == "5 to 12"


@pytest.mark.parametrize(
    ("times", "within", "probability", "estimator"),
    [
        ([np.inf] * 4, 9.5, 0.0, "Clopper-Pearson"),
        ([1.0, 2.0, 3.0, 9.0], 9.5, 1.0, "Clopper-Pearson"),
    ],
    ids=["none", "all"],
)
def test_where_none_or_all_have_climbed_the_interval_is_exact(
    times: list[float], within: float, probability: float, estimator: str
) -> None:
    """Though runs ended before: of four, one without a climb at 9 s leaves three to tell of 9.5 s."""
    watched = np.array([10.0, 10.0, 10.0, 9.0])
    found = survival(np.array(times), watched, within)
    assert (found["probability"], found["estimator"]) == (probability, estimator)
    followed = 3 if probability == 0.0 else 4
    edge = 0.025 ** (1.0 / followed)
    expected = [0.0, 1.0 - edge] if probability == 0.0 else [edge, 1.0]
    assert found["interval"] == pytest.approx(expected)


def test_a_longer_run_does_not_make_climbs_likelier() -> None:
    """The same piles, shaken for 2 s and for 8 s: what began within 2 s and gained enough later is no climb by then."""
    begins = np.random.default_rng(1).exponential(2.0, 40)
    short, long = (drawn(begins, np.full(40, seconds), 1.0, within=2.0) for seconds in (2.0, 8.0))
    assert short["climbed"] == (begins <= 1.0).sum() < (begins <= 2.0).sum()
    for key in ("climbed", "probability", "interval", "climbs", "onsets"):
        assert short[key] == long[key], key


def test_runs_of_different_lengths_tell_one_probability() -> None:
    """Times to the first climb drawn from an exponential distribution, runs that end before it from another."""
    draw = np.random.default_rng(1)
    begins, driven = draw.exponential(2.0, 400), draw.uniform(0.5, 6.0, 400)
    found = drawn(begins, driven, 0.0, within=3.0)
    expected = 1.0 - np.exp(-3.0 / 2.0)
    assert found["probability"] == pytest.approx(expected, abs=0.06)
    assert (
        found["climbed"] / found["runs"] < expected - 0.05
    )  # as if those that had ended had not climbed
    assert found["median"] == pytest.approx(2.0 * np.log(2.0), abs=0.2)
    assert found["censored"] == (begins > np.minimum(driven, 3.0)).sum()
    assert found["ended"] == (begins > driven)[driven < 3.0].sum()
    assert drawn(begins, driven, 0.0, within=7.0)["probability"] is None


def test_the_parts_of_climbs_are_judged_at_the_time_of_the_whole() -> None:
    """Three runs: two climb, on a plain wall after 6 s and in a corner after 2 s; the third ends at 8 s.

    Climbers that hung on a wall since the pouring can be left out.
    """
    hung = drawn([0.5, 1.0, 1.5, 2.0], np.full(4, 8.0), 1.0, out_of_pile=[False, True, False, True])
    assert (hung["climbed"], hung["out_of_pile"]["climbed"], hung["out_of_pile"]["onsets"]) == (
        4,
        2,
        [1.0, 2.0],
    )
    assert hung["median"] == 2.0  # half have qualified then; half had begun a second before
    found = drawn([5.0, 1.0, 20.0], np.array([9.0, 7.0, 8.0]), 1.0, walls=[1, 2, 1])
    parts = [found, found["on_plain_walls"], found["in_corners"]]
    assert [one["within"] for one in parts] == [8.0] * 3
    assert [one["probability"] for one in parts] == pytest.approx([2 / 3, 1 / 3, 1 / 3])


def _found(condition: str, climbs: pd.DataFrame = CLIMBS) -> dict[str, Any]:
    """The statistics of a condition as `walkers.climb` returns them."""
    return {
        **climb_summary(PILES, climbs),
        "condition": condition,
        "each": climbs.to_dict("records"),
    }


def _points(axes: Axes) -> dict[Any, list[Any]]:
    """The points of each line of a panel, by label."""
    return {line.get_label(): np.array(line.get_data()).T.tolist() for line in axes.lines}


def test_the_figure_shows_speeds_in_mm_per_s_against_sizes_on_plain_walls_and_in_corners() -> None:
    survival_panel, climbs_panel, _ = climbs_figure([_found("usual")]).axes
    assert climbs_panel.get_xlabel() == "beads"
    assert climbs_panel.get_ylabel() == "speed (mm/s)"
    points = _points(climbs_panel)
    assert points["plain walls"] == [[2.0, pytest.approx(2.0)], [3.0, pytest.approx(4.0)]]
    assert points["corners"] == [[4.0, pytest.approx(2.0)]]
    # One of four has climbed from 2 s on, two from 4 s on.
    (share,) = survival_panel.lines
    assert share.get_xydata().tolist() == [[0.0, 0.0], [2.0, 0.25], [4.0, 0.5], [10.0, 0.5]]  # type: ignore[union-attr]


def test_the_figure_has_the_rates_of_each_condition_beside_its_name() -> None:
    """Three climbs in 40 s, two of them on plain walls; and one."""
    conditions = [_found("drive.frequency = 100 Hz"), _found("mixture.count = 60", CLIMBS[1:2])]
    rates = climbs_figure(conditions).axes[2]
    labels = [label.get_text() for label in rates.get_yticklabels()]
    assert labels == ["frequency 100 Hz: 2/4 climbed", "count 60: 1/4 climbed"]
    drawn = {container.get_label(): container for container in rates.containers}
    expected = {"all": [3, 1], "plain walls": [2, 1], "corners": [1, 0]}
    assert drawn.keys() == expected.keys()
    for label, climbs in expected.items():
        line, _, (bars,) = drawn[label]  # type: ignore[misc]
        assert list(line.get_xdata()) == pytest.approx([number / 40.0 for number in climbs])
        ends = [segment[:, 0].tolist() for segment in bars.get_segments()]
        assert np.array(ends) * 40.0 == pytest.approx(
            np.array([GARWOOD[number] for number in climbs]), abs=6e-5
        )


def test_a_band_of_the_share_that_has_climbed_does_not_fall() -> None:
    """Greenwood's band: both ends of it grow with time, as the share does."""
    for seed in range(40):
        random = np.random.default_rng(seed)
        first, watched = random.exponential(4.0, 14), random.uniform(1.0, 9.0, 14)
        found = survival(np.where(first <= watched, first, np.inf), watched, 1.0)["curve"]
        json.dumps(found, allow_nan=False)
        curve = pd.DataFrame(found).astype(float)
        inside = curve.dropna()
        assert (
            curve["probability"].is_monotonic_increasing and inside["high"].is_monotonic_increasing
        ), seed
        assert (inside[["low", "probability", "high"]].diff(axis=1).iloc[:, 1:] >= 0.0).all(
            axis=None
        )


def test_conditions_are_named_by_what_is_not_usual() -> None:
    """Of one key at a time, the seeds and lists of numbers among them; the last point is not finished."""
    columns = {
        "run.seed": "",
        "mixture.large[0]": "mm",
        "mixture.large[1]": "mm",
        "drive.frequency": "Hz",
    }
    rows = [
        (seed, *values)
        for seed in (1, 2)
        for values in ((0.5, 0.6, 170.0), (0.4, 0.4, 170.0), (0.5, 0.6, 100.0), (0.5, 0.6, 250.0))
    ]
    frame = pd.DataFrame(rows, columns=list(columns)).assign(
        run=list("01234567"), status=["finished"] * 7 + [""]
    )
    frame.attrs |= {"units": columns, "varied": list(columns), "sweep": ""}
    frame.attrs["axes"] = [("run.seed",), ("mixture.large", "drive.frequency")]
    assert {label: rows["run"].tolist() for label, rows in conditions_in(frame)} == {
        "": ["0", "4"],
        "mixture.large = 0.4/0.4 mm": ["1", "5"],
        "drive.frequency = 100 Hz": ["2", "6"],
        "drive.frequency = 250 Hz": ["3"],
    }


def test_clusters_climb_from_the_friction_of_no_velocity_on() -> None:
    """Of two liquids in any order: 3/4 of the way from 0.2 to 0.3, and at a friction of the sweep itself."""
    friction, speeds = (
        [0.3, 0.1, 0.2, 0.4],
        {"water": [1e-3, -9e-3, -3e-3, 5e-3], "oil": [-4e-3, -6e-3, -5e-3, 0.0]},
    )
    frames = [
        pd.DataFrame(
            {"contact.friction.bead_wall": friction, "axial_velocity": speed, "liquid.name": liquid}
        )
        for liquid, speed in speeds.items()
    ]
    found = [list(row.values()) for row in tables.least_frictions(pd.concat(frames))]
    assert found == [["water", "0.28", "5"], ["oil", "0.40", "0"]]
    rough = pd.concat(frames).assign(**{"contact.roughness.bead_wall": 0.1})
    assert [row["cluster"] for row in tables.least_frictions(rough)] == [
        "water, 0.1 um",
        "oil, 0.1 um",
    ]


def test_a_sweep_of_piles_has_a_table_and_chances(tmp_path: Path) -> None:
    """Two starts that do not climb, of beads whose friction nobody gave."""
    tables = tomllib.loads(shipped("case")["pile-ci"].read_text())
    del tables["contact"]["friction"]
    tables["run"] |= {"duration": "0.02 s", "time_step": "3 us", "longest_settling": "0.05 s"}
    (tmp_path / "base.toml").write_text(to_toml(tables))
    (tmp_path / "starts.toml").write_text('case = "base.toml"\n[axes]\nrun.seed = [1, 2]\n')
    starts = walkers.sweep(tmp_path / "starts.toml", tmp_path / "runs", jobs=1)
    frame, out = starts.table(), ("--out", str(tmp_path / "runs"))
    assert frame[["beads", "climbs"]].to_numpy().tolist() == [[60, 0]] * 2
    assert frame["surface_end"].between(1e-3, 9e-3).all()
    printed = json.loads(call("climb", "starts", *out, "--json", check=True).stdout)
    (found,) = printed
    assert (found["condition"], found["runs"], found["climbed"], found["each"]) == (
        "starts",
        2,
        0,
        [],
    )
    assert found["interval"] == pytest.approx(
        [0.0, 1.0 - 0.025**0.5]
    )  # none of two, Clopper and Pearson
    upper = 3.6889 / found["seconds"]  # of no event (Garwood 1936)
    assert [found[part]["rate_interval"] for part in PARTS] == [
        pytest.approx([0.0, upper], rel=1e-4)
    ] * 3
    to = tmp_path / "climbs"
    run = str(starts.runs[0].directory)
    for form, within in ((".csv", "1s"), (".svg", "10ms")):
        done = call(
            "climb", "starts", run, *out, "--to", f"{to}{form}", "--within", within, check=True
        )
        assert [done.stdout.count(f"0 of {number}\n") for number in (2, 1)] == [1, 1], done.stdout
        assert "warning" not in done.stderr  # such as one of a layout that failed
        lines = [line for line in done.stdout.splitlines() if line.startswith("guessed")]
        assert len(lines) == 2 and all("friction.bead_wall 0.25" in line for line in lines)
    written = pd.read_csv(f"{to}.csv")
    assert written["condition"].drop_duplicates().to_list() == [
        "starts",
        starts.runs[0].directory.name,
    ]
    assert written["rate_high"].to_list()[:3] == pytest.approx([upper] * 3, rel=1e-4)
    assert "share that has climbed" in Path(f"{to}.svg").read_text()
    (starts.runs[1].directory / "manifest.json").unlink()
    done = call("climb", "starts", *out, check=True)
    assert (
        "0 of 1\n" in done.stdout and "–" not in done.stdout
    )  # no speeds and no other numbers of no climbs
    assert "walkers: warning: starts: 1 of 2 points are not finished and left out\n" in done.stderr
