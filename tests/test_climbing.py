"""Statistics of climbs: of a made-up table, by hand or by a second formula; of a real sweep."""

from __future__ import annotations

import json
import shutil
import tomllib
from collections.abc import Callable
from math import comb, exp, log, sqrt
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
from walkers.sweeps import climbing
from walkers.sweeps.climbing import (
    PARTS,
    climb_summary,
    conditions_in,
    dispersion,
    leaders,
    survival,
)
from walkers.sweeps.climbing_output import climbing_table, climbs_figure, texts_of

BEADS = 20
"""Beads of a pile."""
LARGE = 4
"""Large beads of a pile."""
LENGTH = 10.0
"""Length of the drive, s."""


def make_climb(**changes: Any) -> dict[str, Any]:
    """Make a row of the table ``clusters``: a climb on one wall, led by a large bead."""
    climb = {
        "speed": 2e-3,
        "height": 0.01,
        "size": 2,
        "large": 1,
        "leader": 0,
        "leader_large": True,
        "walls": 1,
        "wall_names": "+x",
        "out_of_pile": True,
    }
    climb.update(changes)
    return climb


IN_CORNER = make_climb(
    pile=0,
    onset=6.0,
    qualified=7.0,
    walls=2,
    wall_names="+x, +y",
    leader=1,
    leader_large=False,
    size=4,
)
"""The second climb of the first run."""
FIRST = make_climb(pile=0, onset=1.5, qualified=2.0)
OF_SECOND_RUN = make_climb(
    pile=1,
    onset=3.0,
    qualified=4.0,
    wall_names="-y",
    size=3,
    speed=4e-3,
    out_of_pile=False,
)
CLIMBS = pd.DataFrame([IN_CORNER, FIRST, OF_SECOND_RUN])
"""All climbs of four runs of 10 s, not in the order of time."""
NO_CLIMBS = CLIMBS[:0]
PILES = pd.DataFrame({"beads": BEADS, "large": LARGE, "driven": [LENGTH] * 4})
SECONDS = 4 * LENGTH
"""Time of drive of the four runs, s."""
GARWOOD = {0: (0.0, 3.6889), 1: (0.0253, 5.5716), 2: (0.2422, 7.2247), 3: (0.6187, 8.7673)}
"""Exact 95 % intervals of the mean of a Poisson distribution by the observed number, as tabulated.

Garwood, Biometrika 28, 437 (1936).
"""


@pytest.fixture(scope="module")
def summary() -> dict[str, Any]:
    """Statistics of the three climbs of four runs."""
    return climb_summary(PILES, CLIMBS)


def make_summary(
    begins: Any,
    lengths: Any,
    takes: float,
    *,
    within: float | None = None,
    walls: Any = 1,
    out_of_pile: Any = True,
) -> dict[str, Any]:
    """Make the `climb_summary` of runs that have one climb each, if their length shows it.

    Parameters
    ----------
    begins
        When the climbs begin, s.
    lengths
        Lengths of the runs, s.
    takes
        Time from the begin of a climb until it has gained enough, s.
    within, walls, out_of_pile
        As of `climb_summary` and of its table.
    """
    rows = pd.DataFrame([make_climb()] * len(begins))
    rows = rows.assign(
        pile=range(len(begins)),
        onset=begins,
        qualified=np.add(begins, takes),
        walls=walls,
        out_of_pile=out_of_pile,
    )
    piles = pd.DataFrame({"beads": BEADS, "large": LARGE, "driven": lengths})
    return climb_summary(piles, rows[rows["qualified"] <= lengths], within)


def printed(statistics: dict[str, Any], **changes: Any) -> dict[str, str]:
    """Statistics as they are printed, with other values of some."""
    return texts_of({**statistics, "condition": "", **changes})


# --- rates ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "climbs"),
    [(None, 3), ("on_plain_walls", 2), ("in_corners", 1), ("out_of_pile", 2)],
    ids=["all", "on_plain_walls", "in_corners", "out_of_pile"],
)
def test_a_rate_has_the_exact_interval_of_a_poisson_distribution(
    summary: dict[str, Any], part: str | None, climbs: int
) -> None:
    """Each end leaves 2.5 %.

    That is the chance of so many climbs or more at the lower end, of so many or fewer at the upper.
    """
    statistics = summary
    if part is not None:
        statistics = summary[part]
    assert statistics["climbs"] == climbs
    assert statistics["seconds"] == SECONDS
    assert statistics["rate"] == pytest.approx(climbs / SECONDS)
    low, high = np.array(statistics["rate_interval"]) * SECONDS
    assert (low, high) == pytest.approx(GARWOOD[climbs], abs=6e-5)
    assert poisson.sf(climbs - 1, low) == pytest.approx(0.025)
    assert poisson.cdf(climbs, high) == pytest.approx(0.025)


@pytest.mark.parametrize(
    ("where", "climbs", "probability"),
    [("all", 3, 0.5), ("plain walls", 2, 0.5), ("corners", 1, 0.25)],
)
def test_the_table_has_a_row_for_plain_walls_and_one_for_corners(
    summary: dict[str, Any], where: str, climbs: int, probability: float
) -> None:
    """Two of four runs have a climb, both one on a plain wall and one of them one in a corner."""
    row = climbing_table([{**summary, "condition": "few"}]).set_index("where").loc[where]
    assert row["condition"] == "few"
    assert row["runs"] == 4
    assert row["climbs"] == climbs
    assert row["probability"] == probability
    rates = (row["rate_low"] * SECONDS, row["rate_high"] * SECONDS)
    assert rates == pytest.approx(GARWOOD[climbs], abs=6e-5)


def test_the_table_has_the_interval_of_the_probability(summary: dict[str, Any]) -> None:
    """Two of four, Clopper and Pearson."""
    table = climbing_table([{**summary, "condition": "few"}]).set_index("where")
    ends = (table["probability_low"]["all"], table["probability_high"]["all"])
    assert ends == pytest.approx((0.0676, 0.9324), abs=6e-5)


def test_a_rate_within_a_time_is_of_that_time_of_each_run() -> None:
    """Each of four runs counts for 5 s; the climb that qualified at 7 s does not count."""
    cut = climb_summary(PILES, CLIMBS, within=5.0)
    assert cut["within"] == 5.0
    assert cut["seconds"] == 20.0
    assert cut["climbs"] == 2
    assert cut["climbed"] == 2
    assert cut["rate"] == 0.1


def test_piles_without_climbs_have_a_rate_of_zero_with_an_upper_end() -> None:
    """Two runs, 20 s in all."""
    statistics = climb_summary(PILES[2:], NO_CLIMBS)
    assert statistics["rate"] == 0.0
    assert np.array(statistics["rate_interval"]) * 20.0 == pytest.approx(GARWOOD[0], abs=6e-5)


def test_piles_that_were_not_driven_have_no_rate() -> None:
    statistics = climb_summary(PILES.assign(driven=0.0), NO_CLIMBS)
    assert statistics["seconds"] == 0.0
    assert statistics["rate"] is None
    assert statistics["rate_interval"] is None
    assert printed(statistics)["rate"] == "–"


# --- dispersion -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("within", "dispersion"),
    [
        # Numbers 2, 1, 0, 0: mean 3/4, variance (25/16 + 1/16 + 2 · 9/16)/3 = 11/12.
        pytest.param(None, 11.0 / 12.0 / 0.75, id="whole runs"),
        # Numbers 1, 1, 0, 0: mean 1/2, variance (4 · 1/4)/3 = 1/3.
        pytest.param(5.0, 2.0 / 3.0, id="up to 5 s"),
    ],
)
def test_the_dispersion_is_the_variance_over_the_mean_of_the_climbs_of_a_run(
    within: float | None, dispersion: float
) -> None:
    statistics = climb_summary(PILES, CLIMBS, within)
    assert statistics["dispersion"] == pytest.approx(dispersion)


def test_runs_of_different_lengths_are_expected_to_have_climbs_in_proportion() -> None:
    """Of 10, 10, 5 and 5 s: 1, 1, 1/2 and 1/2 are expected, and 2, 1, 0, 0 were seen."""
    statistics = climb_summary(PILES.assign(driven=[10.0, 10.0, 5.0, 5.0]), CLIMBS)
    assert statistics["dispersion"] == pytest.approx((1.0 + 0.0 + 0.5 + 0.5) / 3.0)


def test_the_interval_of_the_dispersion_is_by_chi_square(summary: dict[str, Any]) -> None:
    """The tabulated quantiles of χ² of three degrees of freedom are 0.2158 and 9.3484."""
    low, high = summary["dispersion_interval"]
    assert low == pytest.approx(3.0 * summary["dispersion"] / 9.3484, rel=1e-4)
    assert high == pytest.approx(3.0 * summary["dispersion"] / 0.2158, rel=1e-3)


def test_the_interval_of_the_dispersion_covers_one_in_95_of_100_ensembles() -> None:
    """Of thirty runs of 10 s with 3 independent climbs each; 2,000 ensembles, 2.8 deviations."""
    numbers = np.random.default_rng(1).poisson(3.0, (2000, 30))
    piles = pd.DataFrame({"driven": [10.0] * 30})
    covered = 0
    for ensemble in numbers:
        climbs = pd.DataFrame({"pile": np.repeat(np.arange(30), ensemble)})
        low, high = dispersion(climbs, piles["driven"])["dispersion_interval"]
        covered += low <= 1.0 <= high
    assert covered / len(numbers) == pytest.approx(0.95, abs=0.014)


def test_piles_without_climbs_have_no_dispersion() -> None:
    statistics = climb_summary(PILES[2:], NO_CLIMBS)
    assert statistics["dispersion"] is None
    assert statistics["dispersion_interval"] is None


# --- first climbs of runs of one length -------------------------------------------------------


def test_first_climbs_are_those_that_qualified_first(summary: dict[str, Any]) -> None:
    """After 2 s in the first run and 4 s in the second; half of the runs have climbed then."""
    assert summary["times"] == [2.0, 4.0]
    assert summary["onsets"] == [1.5, 3.0]
    assert summary["median"] == 4.0
    assert summary["within"] == LENGTH
    assert summary["censored"] == 2
    assert summary["ended"] == 0


def test_speeds_and_sizes_are_of_all_climbs(summary: dict[str, Any]) -> None:
    assert summary["speeds"] == [2e-3, 2e-3, 4e-3]
    assert summary["sizes"] == [4, 2, 3]
    assert summary["led_by_large"] == 2


def test_the_probability_of_runs_of_one_length_has_clopper_and_pearsons_interval(
    summary: dict[str, Any],
) -> None:
    """Two of four; at the upper end (1-p)⁴ + 4p(1-p)³ + 6p²(1-p)² = 0.025."""
    assert summary["probability"] == 0.5
    assert summary["estimator"] == "Clopper-Pearson"
    assert summary["interval"] == pytest.approx([0.0676, 0.9324], abs=6e-5)


# --- first climbs of runs of different lengths ------------------------------------------------


@pytest.fixture(scope="module")
def six_runs() -> dict[str, Any]:
    """First climbs after 1, 3 and 4 s; ends without a climb after 2, 5 and 6 s; by 4.5 s."""
    first = np.array([1.0, np.inf, 3.0, 4.0, np.inf, np.inf])
    watched = np.array([7.0, 2.0, 7.0, 7.0, 5.0, 6.0])
    return survival(first, watched, 4.5)


SHARE_LEFT = 5.0 / 6.0 * 3.0 / 4.0 * 2.0 / 3.0
"""Of `six_runs`, without a climb by 4.5 s: at the three climbs 6, 4 and 3 runs were going on."""


def test_the_share_of_runs_of_all_lengths_is_kaplans_and_meiers(six_runs: dict[str, Any]) -> None:
    assert six_runs["probability"] == pytest.approx(1.0 - SHARE_LEFT)
    assert six_runs["estimator"] == "Kaplan-Meier"
    assert six_runs["climbed"] == 3
    assert six_runs["ended"] == 1
    assert six_runs["censored"] == 3
    assert six_runs["median"] == 4.0


def test_the_interval_of_kaplan_and_meier_is_by_greenwoods_variance_of_the_log_log(
    six_runs: dict[str, Any],
) -> None:
    """The deviation of ln(-ln S) is √(Σ d/(n(n-d))) / -ln S; 1.959964 of them are 95 %."""
    variance = 1.0 / (6.0 * 5.0) + 1.0 / (4.0 * 3.0) + 1.0 / (3.0 * 2.0)
    deviation = sqrt(variance) / -log(SHARE_LEFT)
    low = 1.0 - SHARE_LEFT ** exp(-1.959964 * deviation)
    high = 1.0 - SHARE_LEFT ** exp(1.959964 * deviation)
    assert six_runs["interval"] == pytest.approx([low, high], abs=1e-6)


def test_runs_that_climbers_ended_tell_of_later_times() -> None:
    """Two piles have climbed and their climbers left at 3 and 3.5 s: both have by 5 s.

    Two of two, Clopper and Pearson: p² = 0.025 at the lower end.
    """
    statistics = survival(np.array([1.0, 2.0]), np.array([3.0, 3.5]), 5.0)
    assert statistics["probability"] == 1.0
    assert statistics["interval"] == pytest.approx([0.025**0.5, 1.0])


def test_a_run_that_ended_after_its_climb_counts_in_the_interval() -> None:
    """By 3 s one of two has climbed, Clopper and Pearson: 1 - p² = 0.975 at the upper end."""
    statistics = survival(np.array([1.0, np.inf]), np.array([1.5, 3.5]), 3.0)
    assert statistics["interval"] == pytest.approx([1.0 - 0.975**0.5, 0.975**0.5])


def test_nobody_knows_of_a_time_at_which_no_run_without_a_climb_goes_on() -> None:
    """The third pile has not climbed by 2.5 s, where its run ends."""
    statistics = survival(np.array([1.0, 2.0, np.inf]), np.array([3.0, 3.5, 2.5]), 5.0)
    assert statistics["probability"] is None


WATCHED = np.array([10.0, 10.0, 10.0, 9.0])
"""Lengths of four runs of which the last one ends before 9.5 s."""


def test_where_none_have_climbed_the_interval_is_exact() -> None:
    """Three runs tell of 9.5 s: (1-p)³ = 0.025 at the upper end."""
    statistics = survival(np.array([np.inf] * 4), WATCHED, 9.5)
    assert statistics["probability"] == 0.0
    assert statistics["estimator"] == "Clopper-Pearson"
    assert statistics["interval"] == pytest.approx([0.0, 1.0 - 0.025 ** (1.0 / 3.0)])


def test_where_all_have_climbed_the_interval_is_exact() -> None:
    """All four runs tell of 9.5 s, as the last one had climbed: p⁴ = 0.025 at the lower end."""
    statistics = survival(np.array([1.0, 2.0, 3.0, 9.0]), WATCHED, 9.5)
    assert statistics["probability"] == 1.0
    assert statistics["estimator"] == "Clopper-Pearson"
    assert statistics["interval"] == pytest.approx([0.025 ** (1.0 / 4.0), 1.0])


def test_a_longer_run_does_not_make_climbs_likelier() -> None:
    """The same 40 piles, shaken for 2 s and for 8 s, count the same climbs within 2 s.

    A climb that begins within 2 s qualifies a second later: those that qualify after 2 s do not
    count, however long the run.
    """
    begins = np.random.default_rng(1).exponential(2.0, 40)
    short = make_summary(begins, np.full(40, 2.0), 1.0, within=2.0)
    long = make_summary(begins, np.full(40, 8.0), 1.0, within=2.0)
    assert short["climbed"] == (begins <= 1.0).sum()
    assert short["climbed"] < (begins <= 2.0).sum()
    for key in ("climbed", "probability", "interval", "climbs", "onsets"):
        assert short[key] == long[key], key


BEGINS = np.random.default_rng(1).exponential(2.0, 400)
"""Times of first climbs in s, exponentially distributed with the mean 2 s."""
LENGTHS = np.random.default_rng(2).uniform(0.5, 6.0, 400)
"""Lengths of the runs in s; many end before the climb."""


@pytest.fixture(scope="module")
def of_many() -> dict[str, Any]:
    """Statistics of 400 runs of different lengths by 3 s.

    Ten draws of who leads instead of 10,000, for nobody asks for that: hundreds of climbs take
    seconds.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(climbing, "DRAWS", 10)
        return make_summary(BEGINS, LENGTHS, 0.0, within=3.0)


def test_runs_of_different_lengths_tell_the_probability_of_the_distribution(
    of_many: dict[str, Any],
) -> None:
    """1 - exp(-3/2) by 3 s, half after 2 ln 2 s.

    The share of runs with a climb is smaller, for it counts runs that ended before as runs without.
    """
    expected = 1.0 - np.exp(-3.0 / 2.0)
    assert of_many["probability"] == pytest.approx(expected, abs=0.06)
    assert of_many["median"] == pytest.approx(2.0 * np.log(2.0), abs=0.2)
    assert of_many["climbed"] / of_many["runs"] < expected - 0.05


def test_runs_without_a_climb_by_a_time_are_counted_and_those_that_ended_before_it(
    of_many: dict[str, Any],
) -> None:
    without_climb = np.minimum(LENGTHS, 3.0) < BEGINS
    assert of_many["censored"] == without_climb.sum()
    assert of_many["ended"] == (without_climb & (LENGTHS < 3.0)).sum()


def test_there_is_no_probability_by_a_time_after_the_end_of_all_runs() -> None:
    first = np.where(BEGINS <= LENGTHS, BEGINS, np.inf)
    assert survival(first, LENGTHS, 7.0)["probability"] is None


def test_climbs_out_of_the_pile_are_counted_apart() -> None:
    """Clusters that hung on a wall since the pouring can be left out: the first and the third."""
    statistics = make_summary(
        [0.5, 1.0, 1.5, 2.0], np.full(4, 8.0), 1.0, out_of_pile=[False, True, False, True]
    )
    assert statistics["climbed"] == 4
    assert statistics["out_of_pile"]["climbed"] == 2
    assert statistics["out_of_pile"]["onsets"] == [1.0, 2.0]


def test_half_of_the_runs_have_climbed_when_their_climbs_have_qualified() -> None:
    """Climbs begin after 0.5, 1, 1.5 and 2 s and qualify a second later."""
    statistics = make_summary([0.5, 1.0, 1.5, 2.0], np.full(4, 8.0), 1.0)
    assert statistics["median"] == 2.0


def test_the_parts_of_climbs_are_judged_at_the_time_of_the_whole() -> None:
    """Of three runs two climb, on a plain wall and in a corner; the third ends at 8 s."""
    statistics = make_summary([5.0, 1.0, 20.0], np.array([9.0, 7.0, 8.0]), 1.0, walls=[1, 2, 1])
    assert statistics["within"] == 8.0
    assert statistics["probability"] == pytest.approx(2.0 / 3.0)
    for part in ("on_plain_walls", "in_corners"):
        assert statistics[part]["within"] == 8.0
        assert statistics[part]["probability"] == pytest.approx(1.0 / 3.0)


@pytest.fixture(scope="module")
def curves() -> list[dict[str, Any]]:
    """The share that has climbed over time, of 40 draws of 14 runs of different lengths."""
    drawn = []
    for seed in range(40):
        random = np.random.default_rng(seed)
        first = random.exponential(4.0, 14)
        watched = random.uniform(1.0, 9.0, 14)
        statistics = survival(np.where(first <= watched, first, np.inf), watched, 1.0)
        drawn.append(statistics["curve"])
    return drawn


def test_the_band_of_the_share_that_has_climbed_does_not_fall(
    curves: list[dict[str, Any]],
) -> None:
    """Greenwood's band: its upper end grows with time, as the share does."""
    for curve in curves:
        columns = pd.DataFrame(curve).astype(float)
        assert columns["probability"].is_monotonic_increasing
        assert columns.dropna()["high"].is_monotonic_increasing


def test_the_band_of_the_share_that_has_climbed_holds_the_share(
    curves: list[dict[str, Any]],
) -> None:
    for curve in curves:
        columns = pd.DataFrame(curve).astype(float).dropna()
        assert (columns["low"] <= columns["probability"]).all()
        assert (columns["probability"] <= columns["high"]).all()


def test_the_share_that_has_climbed_has_no_numbers_that_json_lacks(
    curves: list[dict[str, Any]],
) -> None:
    """Ends of the band that are not defined are None, not NaN."""
    for curve in curves:
        json.dumps(curve, allow_nan=False)


# --- leaders ----------------------------------------------------------------------------------


def test_the_chance_of_as_many_large_leaders_is_that_over_all_ways_to_deal_the_labels() -> None:
    """Two of three leaders are large, two of them beads of one pile: 4 of 20 beads are large.

    Both of the first pile are with C(4,2)/C(20,2); one of them with 4 · 16/C(20,2), and then that
    of the second pile must be, with 4/20.
    """
    statistics = leaders(PILES, CLIMBS)
    pairs = comb(BEADS, 2)
    chance = comb(LARGE, 2) / pairs + LARGE * (BEADS - LARGE) / pairs * LARGE / BEADS
    assert statistics["led_by_large"] == 2
    assert statistics["p_among_beads"] == pytest.approx(chance, abs=0.01)
    assert statistics["share_of_large"] == LARGE / BEADS


def test_labels_of_a_pile_are_dealt_without_replacement() -> None:
    """Both of two leaders are large, of two large ones in three beads: 2/3 · 1/2."""
    pair = CLIMBS[:2].assign(leader=[0, 1], leader_large=True)
    statistics = leaders(PILES.assign(beads=3, large=2), pair)
    assert statistics["led_by_large"] == 2
    assert statistics["p_among_beads"] == pytest.approx(1.0 / 3.0, abs=0.02)


def test_the_share_of_large_leaders_has_clopper_and_pearsons_interval(
    summary: dict[str, Any],
) -> None:
    """Two of three, as tabulated."""
    assert summary["share_led_by_large"] == pytest.approx(2.0 / 3.0)
    assert summary["share_led_by_large_interval"] == pytest.approx([0.0943, 0.9916], abs=6e-5)


def test_a_bead_that_leads_twice_counts_twice_in_each_deal() -> None:
    """It is large with the probability 4/20, and then so are both leaders."""
    statistics = leaders(PILES, CLIMBS[1:2].iloc[[0, 0]])
    assert statistics["p_among_beads"] == pytest.approx(LARGE / BEADS, abs=0.02)


# --- what is printed --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("climbed", "2 of 4"),
        ("half by (s)", "4"),
        ("led by large", "2 of 3"),
        ("share led by large", "0.67 (0.09 to 0.99)"),
        ("dispersion", "1.2 (0.39 to 17)"),
        ("beads", "2 to 4"),
        ("rate", "0.075 (0.015 to 0.22)"),
        ("in corners", "0.025 (0.00063 to 0.14)"),
        ("speed (mm/s)", "2 to 4"),
        ("median speed (mm/s)", "2"),
        ("large beads (%)", "20"),
    ],
)
def test_statistics_are_printed_in_their_units(
    summary: dict[str, Any], name: str, text: str
) -> None:
    """Rates are Garwood's numbers over 40 s."""
    assert printed(summary)[name] == text


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("climbed", "0 of 4"),
        ("led by large", "0 of 0"),
        ("share led by large", "–"),
        ("p by chance", "–"),
        ("dispersion", "–"),
        ("half by (s)", "–"),
        ("speed (mm/s)", "–"),
        ("median speed (mm/s)", "–"),
        ("height (mm)", "–"),
        ("beads", "–"),
    ],
)
def test_what_is_not_known_without_climbs_is_printed_as_a_dash(name: str, text: str) -> None:
    assert printed(climb_summary(PILES, NO_CLIMBS))[name] == text


def test_the_chance_of_as_many_large_leaders_is_printed(summary: dict[str, Any]) -> None:
    chance = float(printed(summary)["p by chance"])
    assert chance == pytest.approx(summary["p_among_beads"], rel=0.05)


def test_no_chance_is_printed_that_the_draws_cannot_tell(summary: dict[str, Any]) -> None:
    """10,000 draws do not resolve a probability below 2/10,000."""
    assert printed(summary, p_among_beads=1e-4)["p by chance"] == "0.0002"


def test_speeds_of_two_climbs_are_told_by_their_range_and_median() -> None:
    """2 and 4 mm/s, and one that was not measured."""
    climbs = CLIMBS.assign(speed=[np.nan, 2e-3, 4e-3], height=[5e-3, 10e-3, 12e-3])
    texts = printed(climb_summary(PILES, climbs))
    assert texts["speed (mm/s)"] == "2 to 4"
    assert texts["median speed (mm/s)"] == "3"
    assert texts["height (mm)"] == "5 to 12"


# --- figures ----------------------------------------------------------------------------------


def make_condition(name: str, climbs: pd.DataFrame = CLIMBS) -> dict[str, Any]:
    """Make the statistics of a condition as `walkers.climb` returns them."""
    condition = climb_summary(PILES, climbs)
    condition["condition"] = name
    condition["each"] = climbs.to_dict("records")
    return condition


def points_of_lines(axes: Axes) -> dict[Any, list[Any]]:
    """The points of each line of a panel, by label."""
    return {line.get_label(): np.array(line.get_data()).T.tolist() for line in axes.lines}


def test_the_figure_shows_speeds_in_mm_per_s_against_sizes_on_plain_walls_and_in_corners() -> None:
    _, climbs_panel, _ = climbs_figure([make_condition("usual")]).axes
    assert climbs_panel.get_xlabel() == "beads"
    assert climbs_panel.get_ylabel() == "speed (mm/s)"
    points = points_of_lines(climbs_panel)
    assert points["plain walls"] == [[2.0, pytest.approx(2.0)], [3.0, pytest.approx(4.0)]]
    assert points["corners"] == [[4.0, pytest.approx(2.0)]]


def test_the_figure_shows_the_share_that_has_climbed_over_time() -> None:
    """One of four from 2 s on, two from 4 s on."""
    survival_panel, _, _ = climbs_figure([make_condition("usual")]).axes
    ((label, points),) = points_of_lines(survival_panel).items()
    assert label
    assert points == [[0.0, 0.0], [2.0, 0.25], [4.0, 0.5], [10.0, 0.5]]


@pytest.fixture(scope="module")
def rates_panel() -> Axes:
    """The rates of all three climbs, and of the first one alone, in 40 s."""
    usual = make_condition("drive.frequency = 100 Hz")
    few = make_condition("mixture.count = 60", CLIMBS[1:2])
    return climbs_figure([usual, few]).axes[2]


def test_the_figure_names_the_rates_of_each_condition(rates_panel: Axes) -> None:
    labels = [label.get_text() for label in rates_panel.get_yticklabels()]
    assert labels == ["frequency 100 Hz: 2/4 climbed", "count 60: 1/4 climbed"]


def test_the_figure_has_rates_of_all_climbs_and_of_both_kinds(rates_panel: Axes) -> None:
    labels = {container.get_label() for container in rates_panel.containers}
    assert labels == {"all", "plain walls", "corners"}


@pytest.mark.parametrize(
    ("label", "climbs"), [("all", [3, 1]), ("plain walls", [2, 1]), ("corners", [1, 0])]
)
def test_the_figure_shows_rates_with_their_intervals(
    rates_panel: Axes, label: str, climbs: list[int]
) -> None:
    """The first condition has three climbs, two of them on plain walls; the second has one."""
    containers = {container.get_label(): container for container in rates_panel.containers}
    line, _, (bars,) = containers[label]  # type: ignore[misc]
    assert np.array(line.get_xdata()) * SECONDS == pytest.approx(climbs)
    for segment, number in zip(bars.get_segments(), climbs, strict=True):
        assert segment[:, 0] * SECONDS == pytest.approx(GARWOOD[number], abs=6e-5)


# --- conditions of a sweep --------------------------------------------------------------------


def test_conditions_are_named_by_what_is_not_usual() -> None:
    """A sweep of two seeds over four conditions; the last point is not finished."""
    units = {
        "run.seed": "",
        "mixture.large[0]": "mm",
        "mixture.large[1]": "mm",
        "drive.frequency": "Hz",
    }
    rows = []
    for seed in (1, 2):
        rows.append((seed, 0.5, 0.6, 170.0))
        rows.append((seed, 0.4, 0.4, 170.0))
        rows.append((seed, 0.5, 0.6, 100.0))
        rows.append((seed, 0.5, 0.6, 250.0))
    frame = pd.DataFrame(rows, columns=list(units))
    frame["run"] = list("01234567")
    frame["status"] = ["finished"] * 7 + [""]
    frame.attrs["units"] = units
    frame.attrs["varied"] = list(units)
    frame.attrs["sweep"] = ""
    frame.attrs["axes"] = [("run.seed",), ("mixture.large", "drive.frequency")]
    runs = {label: rows["run"].tolist() for label, rows in conditions_in(frame)}
    assert runs == {
        "": ["0", "4"],
        "mixture.large = 0.4/0.4 mm": ["1", "5"],
        "drive.frequency = 100 Hz": ["2", "6"],
        "drive.frequency = 250 Hz": ["3"],
    }


def velocities_of(liquid: str, velocities: list[float]) -> pd.DataFrame:
    """A table of a sweep of frictions, whose rows are in no order."""
    return pd.DataFrame(
        {
            "contact.friction.bead_wall": [0.3, 0.1, 0.2, 0.4],
            "axial_velocity": velocities,
            "liquid.name": liquid,
        }
    )


@pytest.fixture
def of_two_liquids() -> pd.DataFrame:
    """In water clusters climb from a friction between 0.2 and 0.3 on, in oil they rest at 0.4."""
    water = velocities_of("water", [1e-3, -9e-3, -3e-3, 5e-3])
    oil = velocities_of("oil", [-4e-3, -6e-3, -5e-3, 0.0])
    return pd.concat([water, oil])


def test_clusters_climb_from_the_friction_of_no_velocity_on(of_two_liquids: pd.DataFrame) -> None:
    """In water from 3/4 of the way from -3 to 1 mm/s on, 0.275; in oil from 0.4 on."""
    in_water, in_oil = tables.least_frictions(of_two_liquids)
    assert list(in_water.values()) == ["water", "0.28", "5"]
    assert list(in_oil.values()) == ["oil", "0.40", "0"]


def test_clusters_on_rough_walls_are_named_by_the_roughness(of_two_liquids: pd.DataFrame) -> None:
    rough = of_two_liquids.assign(**{"contact.roughness.bead_wall": 0.1})
    in_water, in_oil = tables.least_frictions(rough)
    assert in_water["cluster"] == "water, 0.1 um"
    assert in_oil["cluster"] == "oil, 0.1 um"


# --- a sweep by the engine --------------------------------------------------------------------


@pytest.fixture(scope="session")
def runs_of_starts(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """The folder of a sweep of two piles that do not climb, of beads whose friction nobody gave.

    Piles of 20 beads, shaken for 0.02 s. Who changes the folder takes a copy.
    """

    def make_sweep(folder: Path) -> None:
        case = tomllib.loads(shipped("case")["pile-ci"].read_text())
        del case["contact"]["friction"]
        case["mixture"]["count"] = 20
        case["run"]["duration"] = "0.02 s"
        case["run"]["time_step"] = "3 us"
        case["run"]["longest_settling"] = "0.05 s"
        (folder / "base.toml").write_text(to_toml(case))
        (folder / "starts.toml").write_text('case = "base.toml"\n[axes]\nrun.seed = [1, 2]\n')
        walkers.sweep(folder / "starts.toml", folder / "runs", jobs=1)

    return once("sweep-of-piles", make_sweep) / "runs"


@pytest.fixture
def starts(runs_of_starts: Path) -> walkers.Sweep:
    """The sweep of two piles."""
    return walkers.Sweep(runs_of_starts / "starts")


def test_a_sweep_of_piles_has_a_table(starts: walkers.Sweep) -> None:
    """About two layers of beads of a millimetre."""
    table = starts.table()
    assert table["beads"].tolist() == [20, 20]
    assert table["climbs"].tolist() == [0, 0]
    assert table["surface_end"].between(1e-3, 3e-3).all()


def test_a_sweep_of_piles_has_chances(runs_of_starts: Path) -> None:
    """None of two, Clopper and Pearson: (1-p)² = 0.025 at the upper end."""
    done = call("climb", "starts", "--out", str(runs_of_starts), "--json", check=True)
    (statistics,) = json.loads(done.stdout)
    assert statistics["condition"] == "starts"
    assert statistics["runs"] == 2
    assert statistics["climbed"] == 0
    assert statistics["each"] == []
    assert statistics["interval"] == pytest.approx([0.0, 1.0 - 0.025**0.5])
    upper = GARWOOD[0][1] / statistics["seconds"]
    for part in PARTS:
        assert statistics[part]["rate_interval"] == pytest.approx([0.0, upper], rel=1e-4)


@pytest.fixture
def command(starts: walkers.Sweep, runs_of_starts: Path) -> tuple[str, ...]:
    """Arguments of the program: the sweep, and the first of its runs by itself."""
    return ("climb", "starts", str(starts.runs[0].directory), "--out", str(runs_of_starts))


def test_a_sweep_of_piles_and_a_run_by_itself_are_printed_as_two_conditions(
    command: tuple[str, ...],
) -> None:
    printed = call(*command, check=True).stdout
    assert printed.count("0 of 2\n") == 1
    assert printed.count("0 of 1\n") == 1


def test_a_sweep_of_piles_and_a_run_by_itself_are_two_conditions_of_a_table(
    command: tuple[str, ...], starts: walkers.Sweep, tmp_path: Path
) -> None:
    """The first three rows are those of the sweep; the runs last for less than a second."""
    table = tmp_path / "climbs.csv"
    done = call(*command, "--to", str(table), "--within", "1s", check=True)
    assert "warning" not in done.stderr
    written = pd.read_csv(table)
    run = starts.runs[0].directory.name
    assert written["condition"].drop_duplicates().tolist() == ["starts", run]
    upper = GARWOOD[0][1] / starts.table()["driven"].sum()
    assert written["rate_high"].tolist()[:3] == pytest.approx([upper] * 3, rel=1e-4)
    assert written["guessed"].str.contains("friction.bead_wall 0.25", regex=False).all()


def test_the_climbs_of_a_sweep_of_piles_are_drawn_without_a_warning(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    """Such as one of a layout that failed."""
    figure = tmp_path / "climbs.svg"
    done = call(*command, "--to", str(figure), "--within", "10ms", check=True)
    assert "share that has climbed" in figure.read_text()
    assert "warning" not in done.stderr


def test_the_climbs_of_a_sweep_of_piles_rest_on_the_frictions_that_were_guessed(
    command: tuple[str, ...],
) -> None:
    """A line for each of the two conditions."""
    lines = call(*command, check=True).stdout.splitlines()
    guessed = [line for line in lines if line.startswith("guessed")]
    assert len(guessed) == 2
    for line in guessed:
        assert "friction.bead_wall 0.25" in line
        assert line.endswith(" (not of these materials and this liquid)")


def test_a_sweep_of_piles_that_lacks_points_is_printed_with_a_warning(
    runs_of_starts: Path, tmp_path: Path
) -> None:
    """There are no speeds, and no other numbers, of climbs that did not happen."""
    runs = Path(shutil.copytree(runs_of_starts, tmp_path / "runs"))
    (walkers.Sweep(runs / "starts").runs[1].directory / "manifest.json").unlink()
    done = call("climb", "starts", "--out", str(runs), check=True)
    assert "0 of 1\n" in done.stdout
    assert "–" not in done.stdout
    assert "walkers: warning: starts: 1 of 2 points are not finished and left out\n" in done.stderr
