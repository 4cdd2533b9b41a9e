"""The numbers of `walkers climb`: a made-up pile with three climbs, worked out by hand or by a second formula."""

from __future__ import annotations

from itertools import combinations, product
from math import exp, log, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import poisson

from walkers.sweeps.climbing import Condition, describe_climbs, summarise_climbs, survival
from walkers.sweeps.climbing_figure import write_climbs

BEADS, LARGE, LENGTH = 20, 4, 10.0
CLIMB: dict[str, Any] = {"speed": 2e-3, "height": 0.01, "out_of_pile": True}
LATE = CLIMB | {"onset": 6.0, "qualified": 7.0, "walls": ["+x", "+y"], "leader": 1, "leader_large": False}
EARLY = CLIMB | {"onset": 1.5, "qualified": 2.0, "walls": ["+x"], "leader": 0, "leader_large": True}
OTHER = CLIMB | {"onset": 3.0, "qualified": 4.0, "walls": ["-y"], "leader": 0, "leader_large": True, "speed": 4e-3}
RUNS = [
    [LATE | {"large": 1, "size": 4}, EARLY | {"large": 1, "size": 2}],
    [OTHER | {"large": 1, "size": 3, "out_of_pile": False}],
    [],
    [],
]
"""Climbs of four runs of 10 s; the first climb of the first run is the second in its list."""
GARWOOD = {0: (0.0, 3.6889), 1: (0.0253, 5.5716), 2: (0.2422, 7.2247), 3: (0.6187, 8.7673)}
"""Exact 95 % intervals of the mean of a Poisson distribution by the observed number, as tabulated."""


@pytest.fixture
def pile(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    results = {
        Path(str(number)): {"beads": BEADS, "large": LARGE, "driven": LENGTH, "climbs": climbs}
        for number, climbs in enumerate(RUNS)
    }
    monkeypatch.setattr("walkers.sweeps.climbing._result_of", results.__getitem__)
    return list(results)


def test_a_rate_has_the_exact_interval_of_a_poisson_distribution(pile: list[Path]) -> None:
    """Each end leaves 2.5 %: so many climbs or more at the lower end, so many or fewer at the upper one."""
    found = summarise_climbs(pile)
    expected = {"": (3, 40.0), "on_plain_walls": (2, 40.0), "in_corners": (1, 40.0), "out_of_pile": (2, 40.0)}
    for part, (climbs, seconds) in expected.items():
        one = found[part] if part else found
        assert (one["climbs"], one["seconds"], one["rate"]) == (climbs, seconds, pytest.approx(climbs / seconds)), part
        low, high = np.array(one["rate_interval"]) * seconds
        assert (low, high) == pytest.approx(GARWOOD[climbs], abs=6e-5), part
        assert (poisson.sf(climbs - 1, low), poisson.cdf(climbs, high)) == pytest.approx((0.025, 0.025)), part
    assert "climbs     3: 0.075 per run and second (0.015 to 0.22 with 95 % confidence)" in describe_climbs(found)
    # Of first climbs, 2 in 2 + 4 + 10 + 10 seconds.
    assert found["first_rate"] == pytest.approx(2.0 / 26.0)
    assert np.array(found["first_rate_interval"]) * 26.0 == pytest.approx(GARWOOD[2], abs=6e-5)
    none = summarise_climbs(pile[2:])
    assert (none["rate"], none["dispersion"]) == (0.0, None)
    assert np.array(none["rate_interval"]) * 20.0 == pytest.approx(GARWOOD[0], abs=6e-5)


def test_climbs_within_a_time_are_those_of_the_runs_cut_there(pile: list[Path]) -> None:
    found = summarise_climbs(pile, within=5.0)
    assert (found["within"], found["seconds"], found["climbs"], found["climbed"]) == (5.0, 20.0, 2, 2)
    assert found["rate"] == pytest.approx(2.0 / 20.0)
    assert found["first_rate"] == pytest.approx(2.0 / (2.0 + 4.0 + 5.0 + 5.0))
    # Counts 1, 1, 0, 0: mean 1/2, variance (4 × 1/4)/3.
    assert found["dispersion"] == pytest.approx(2.0 / 3.0)


def test_times_dispersion_and_probability_of_three_climbs(pile: list[Path]) -> None:
    found = summarise_climbs(pile)
    assert found["within"] == LENGTH
    assert (found["times"], found["onsets"]) == ([2.0, 4.0], [1.5, 3.0])
    assert (found["median"], found["censored"], found["ended"]) == (4.0, 2, 0)
    assert sorted(found["speeds"]) == [2e-3, 2e-3, 4e-3]
    assert (sorted(found["sizes"]), found["led_by_large"]) == ([2, 3, 4], 2)
    # Two of four, Clopper and Pearson: p with (1-p)⁴ + 4p(1-p)³ + 6p²(1-p)² = 0.025 at the upper end.
    assert (found["probability"], found["estimator"]) == (0.5, "Clopper-Pearson")
    assert found["interval"] == pytest.approx([0.0676, 0.9324], abs=6e-5)
    # Counts 2, 1, 0, 0: mean 3/4, variance (25/16 + 1/16 + 18/16)/3 = 11/12.
    assert found["dispersion"] == pytest.approx(11.0 / 12.0 / 0.75)


def test_the_share_of_runs_of_all_lengths_is_kaplans_and_meiers() -> None:
    """Climbs after 1, 3 and 4 s, ends without one after 2, 5 and 6 s: 6, then 4, then 3 piles were at risk."""
    first, watched = np.array([1.0, np.inf, 3.0, 4.0, np.inf, np.inf]), np.array([7.0, 2.0, 7.0, 7.0, 5.0, 6.0])
    found = survival(first, watched, 4.5)
    stay = 5.0 / 6.0 * 3.0 / 4.0 * 2.0 / 3.0
    assert (found["climbed"], found["ended"], found["censored"], found["median"]) == (3, 1, 3, 4.0)
    assert (found["probability"], found["estimator"]) == (pytest.approx(1.0 - stay), "Kaplan-Meier")
    # Greenwood's variance of ln(-ln S).
    deviation = sqrt(1.0 / (6.0 * 5.0) + 1.0 / (4.0 * 3.0) + 1.0 / (3.0 * 2.0)) / -log(stay)
    ends = [1.0 - stay ** exp(sign * 1.959964 * deviation) for sign in (-1.0, 1.0)]
    assert found["interval"] == pytest.approx(ends, abs=1e-6)


def test_as_many_large_leaders_by_chance_are_enumerated(pile: list[Path]) -> None:
    """Two of three leaders are large; as many by chance, over all ways to deal the labels and to choose leaders."""
    found = summarise_climbs(pile)
    first = [sum(bead < LARGE for bead in pair) for pair in combinations(range(BEADS), 2)]
    second = [bead < LARGE for bead in range(BEADS)]
    among_beads = np.mean([one + other >= 2 for one, other in product(first, second)])
    assert found["p_among_beads"] == pytest.approx(among_beads, abs=0.01)
    assert among_beads == pytest.approx((12.0 + 128.0 / 5.0) / 380.0)
    # One large bead each in clusters of 4, 2 and 3.
    led = [sum(place == 0 for place in leaders) for leaders in product(range(4), range(2), range(3))]
    among_own = np.mean([one >= 2 for one in led])
    assert found["p_among_own"] == pytest.approx(among_own, abs=0.015)
    assert among_own == pytest.approx(7.0 / 24.0)


def test_the_table_of_climbs_has_a_row_of_numbers_for_each_part(pile: list[Path], tmp_path: Path) -> None:
    write_climbs([Condition("", {}, {}, pile)], [summarise_climbs(pile)], tmp_path / "climbs.csv")
    rows = pd.read_csv(tmp_path / "climbs.csv").set_index("where")
    for where, climbs in {"all": 3, "plain walls": 2, "corners": 1}.items():
        row = rows.loc[where]
        assert (row["runs"], row["climbs"], row["rate"]) == (4, climbs, pytest.approx(climbs / 40.0))
        assert (row["rate_low"] * 40.0, row["rate_high"] * 40.0) == pytest.approx(GARWOOD[climbs], abs=6e-5)
    assert (rows["probability"]["all"], rows["probability"]["corners"]) == (0.5, 0.25)
    assert (rows["probability_low"]["all"], rows["probability_high"]["all"]) == pytest.approx(
        (0.0676, 0.9324), abs=6e-5
    )
