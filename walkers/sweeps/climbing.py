"""Statistics of climbs over runs of piles: probability, waiting time, rate, speed and leaders.

A run without a climb shows only that its first climb comes later than its end: it is
*right-censored*. The share of piles that have climbed by a time is estimated from runs of any
length by their survival (Kaplan and Meier 1958). A pile has climbed when a cluster has gained
enough height, not when the rise begins: otherwise a rise shortly before that time would count in
a run that is long enough to show its outcome, and not in a shorter one.

Texts, tables and figures of these statistics are made in `walkers.sweeps.climbing_output`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import input_error
from walkers.postprocess.measure.results import Results, json_numbers
from walkers.postprocess.measure.uncertainty import guesses
from walkers.sweeps.table import SEEDS, key_texts, seed_groups

if TYPE_CHECKING:
    import pandas as pd

CONFIDENCE = 0.95
"""Confidence level of all intervals."""
_TAIL = (1.0 - CONFIDENCE) / 2.0
"""Probability that each end of an interval leaves out."""
DRAWS = 10_000
"""Number of random permutations in the test of the leaders."""
PARTS = ("on_plain_walls", "in_corners", "out_of_pile")
"""Subsets of the climbs; the last one leaves out clusters that were on a wall before the drive."""
WALLS_OF_CORNER = 2
"""Smallest number of side walls that hold a climb in a corner."""
_SAME_LENGTH = 1e-6
"""Relative difference below which two lengths of runs are equal."""


def conditions_in(frame: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Group the finished points of a sweep's table by conditions, which differ not only in seeds.

    Parameters
    ----------
    frame
        The table of a sweep of piles.

    Yields
    ------
    label : str
        The varied values of a condition, such as ``drive.frequency = 100 Hz``, without those that
        at least half of the conditions have; empty for the usual condition.
    rows : pandas.DataFrame
        Its points.

    Raises
    ------
    InputError
        If no point is finished.
    """
    import pandas as pd

    finished = frame[frame["status"] == "finished"]
    if finished.empty:
        raise input_error(
            frame.attrs["sweep"], "expected a finished run of a pile: no point is finished"
        )
    conditions = []
    first_points = []
    for _, rows in seed_groups(finished):
        conditions.append(rows)
        first_points.append(key_texts(rows.head(1)))
    texts = pd.concat(first_points)
    texts = texts.drop(columns=list(SEEDS), errors="ignore")
    usual = {key: _usual_text(column) for key, column in texts.items()}
    for number, rows in enumerate(conditions):
        unusual = []
        for key, text in texts.iloc[number].items():
            if text != usual[key]:
                unusual.append(f"{key} = {text}")
        yield ", ".join(unusual), rows


def _usual_text(column: pd.Series) -> str | None:
    """The text that at least half of the conditions have; None if there is none, or two of them."""
    most_frequent = column.mode().tolist()
    number = int((column == most_frequent[0]).sum())
    if len(most_frequent) > 1 or 2 * number < len(column):
        return None
    return str(most_frequent[0])


def summarise_climbs(results: Sequence[Results], within: float | None = None) -> dict[str, Any]:
    """The `climb_summary` of runs of piles that differ only in their seeds.

    Parameters
    ----------
    results
        Results of the runs.
    within
        Time in s up to which climbs count, see `climb_summary`.

    Returns
    -------
    dict
        The items of `climb_summary`; ``each``, all climbs as in the table ``clusters`` with the
        names of their runs, whenever they qualified; and ``guessed``, the values of the case that
        the program guessed, as texts.

    Raises
    ------
    InputError
        If a result is not that of a pile.
    """
    import pandas as pd

    pile_rows = []
    tables = []
    for number, result in enumerate(results):
        if "climbs" not in result:
            raise input_error(result.directory, "expected a finished run of a pile")
        pile_rows.append(
            {"beads": result["beads"], "large": result["large"], "driven": result["driven"]}
        )
        clusters_of_run = result.table("clusters")
        tables.append(clusters_of_run.assign(pile=number, run=result.directory.name))
    piles = pd.DataFrame(pile_rows)
    clusters = pd.concat(tables)
    climbs = clusters[clusters["climbed"].astype(bool)]
    records: Any = climbs.to_dict("records")
    summary = climb_summary(piles, climbs, within)
    summary["each"] = [json_numbers(record) for record in records]
    summary["guessed"] = guesses(results[0].about["rests_on"])
    return summary


def climb_summary(
    piles: pd.DataFrame, climbs: pd.DataFrame, within: float | None = None
) -> dict[str, Any]:
    """The `climb_statistics` of all climbs, and of each of `PARTS` by the same time.

    Parameters
    ----------
    piles, climbs
        As for `climb_statistics`.
    within
        Time in s up to which climbs count, and by which a pile has climbed or not. None: all climbs
        count, and the time is the end of the shortest run without a climb, the longest time at
        which all runs count.
    """
    if within is None:
        counted_until = inf
        deadline = _longest_common_time(piles, climbs)
    else:
        counted_until = within
        deadline = within
    in_corners = climbs["walls"] >= WALLS_OF_CORNER
    parts = {
        "on_plain_walls": ~in_corners,
        "in_corners": in_corners,
        "out_of_pile": climbs["out_of_pile"].astype(bool),
    }
    summary = climb_statistics(piles, climbs, counted_until, deadline)
    for name in PARTS:
        summary[name] = climb_statistics(piles, climbs[parts[name]], counted_until, deadline)
    return summary


def _longest_common_time(piles: pd.DataFrame, climbs: pd.DataFrame) -> float:
    """End of the shortest run without a climb, or of the longest run if all have climbs, in s.

    A run ends early if a climber leaves the container; a longer run would show the same first
    climb. So the ends of runs with climbs do not limit the time.
    """
    without_climb = piles["driven"][~piles.index.isin(climbs["pile"])]
    if len(without_climb):
        return float(without_climb.min())
    return float(piles["driven"].max())


def climb_statistics(
    piles: pd.DataFrame, climbs: pd.DataFrame, counted_until: float, deadline: float
) -> dict[str, Any]:
    """Statistics of climbs over several piles that differ only in their seed.

    Parameters
    ----------
    piles
        A row per run: ``beads`` and ``large``, the numbers of all and of large beads, and
        ``driven``, the length of the drive in s.
    climbs
        Rows of the tables ``clusters``, with the index of their ``pile``.
    counted_until
        Time in s up to which climbs count.
    deadline
        Time in s by which a pile has climbed or not.

    Returns
    -------
    dict
        The items of `survival` for first climbs, and those of `leaders` and:

        - ``within``: the time ``deadline``, s
        - ``runs``: number of runs
        - ``seconds``: time of drive of all runs, each up to ``counted_until``
        - ``climbs``: number of climbs
        - ``rate``, ``rate_interval``: climbs of a run per time, 1/s, with the exact Poisson
          interval
        - ``dispersion``, ``dispersion_interval``: variance over mean of the number of climbs of a
          run, with its interval; 1 if climbs are independent
        - ``times``, ``onsets``: when the first climbs of runs qualified and began, s
        - ``speeds`` (m/s), ``heights`` (m, of the leaders at the end) and ``sizes`` (beads) of all
          climbs
    """
    watched = piles["driven"].astype(float).clip(upper=counted_until)
    counted = climbs[climbs["qualified"] <= counted_until]
    firsts = counted.sort_values("qualified").drop_duplicates("pile").sort_values("pile")
    first = firsts.set_index("pile")["qualified"].astype(float).reindex(piles.index, fill_value=inf)
    seconds = float(watched.sum())
    return {
        "within": deadline,
        "runs": len(piles),
        "seconds": seconds,
        **survival(np.array(first, dtype=float), np.array(watched, dtype=float), deadline),
        "climbs": len(counted),
        **_rate(len(counted), seconds),
        **dispersion(counted, watched),
        "times": firsts["qualified"].tolist(),
        "onsets": firsts["onset"].tolist(),
        "speeds": counted["speed"].dropna().tolist(),
        "heights": counted["height"].tolist(),
        "sizes": counted["size"].tolist(),
        **leaders(piles, counted),
    }


def dispersion(climbs: pd.DataFrame, watched: pd.Series) -> dict[str, Any]:
    """Variance over mean of the number of climbs of a run, with its 95 % interval.

    Parameters
    ----------
    climbs
        A row per climb, with the index of its ``pile``.
    watched
        Time of drive of each run, s.

    Returns
    -------
    dict
        ``dispersion`` and ``dispersion_interval``; None without climbs, or for one run.

    Notes
    -----
    It is Pearson's statistic over its N - 1 degrees of freedom, so that N runs may differ in their
    lengths: each is expected to have climbs in proportion to its length. The statistic over the
    true dispersion has about the distribution χ² (McCullagh and Nelder 1989, section 6.2.4).
    """
    from scipy.stats import chi2

    watched = watched[watched > 0.0]
    freedom = len(watched) - 1
    if climbs.empty or freedom < 1:
        return {"dispersion": None, "dispersion_interval": None}
    numbers = climbs["pile"].value_counts().reindex(watched.index, fill_value=0)
    expected = watched * len(climbs) / watched.sum()
    statistic = float(((numbers - expected) ** 2 / expected).sum())
    low, high = statistic / chi2.ppf([1.0 - _TAIL, _TAIL], freedom)
    return {
        "dispersion": statistic / freedom,
        "dispersion_interval": [float(low), float(high)],
    }


def _rate(events: int, seconds: float) -> dict[str, Any]:
    """Rate of events, 1/s, with its exact interval (Garwood 1936); None if the time is zero."""
    from scipy.stats import chi2

    if seconds <= 0.0:
        return {"rate": None, "rate_interval": None}
    fewest = 0.0
    if events:
        fewest = chi2.ppf(_TAIL, 2 * events) / 2.0
    most = chi2.ppf(1.0 - _TAIL, 2 * events + 2) / 2.0
    return {
        "rate": events / seconds,
        "rate_interval": [float(fewest / seconds), float(most / seconds)],
    }


def _interval_of_share(part: int, whole: int) -> list[float]:
    """The exact interval of a share of so many (Clopper and Pearson 1934)."""
    from scipy.stats import binomtest

    ends = binomtest(part, whole).proportion_ci(CONFIDENCE)
    return [float(ends.low), float(ends.high)]


def leaders(piles: pd.DataFrame, climbs: pd.DataFrame) -> dict[str, Any]:
    """Test whether large beads lead climbs more often than expected by chance.

    Parameters
    ----------
    piles, climbs
        As for `climb_statistics`.

    Returns
    -------
    dict
        - ``led_by_large``: number of climbs that a large bead leads
        - ``share_led_by_large``, ``share_led_by_large_interval``: their share of the climbs, with
          the exact interval (Clopper and Pearson 1934); None without climbs
        - ``share_of_large``: share of large beads in all runs
        - ``p_among_beads``: one-sided probability of at least as many climbs that large beads lead
          if the labels "large" and "small" are permuted within each run, from 10,000 draws; None
          without climbs

    Notes
    -----
    Climbs of one run are not independent: a bead that leads twice counts twice in each draw.
    """
    generator = np.random.default_rng(0)
    led_by_large = int(climbs["leader_large"].sum())
    drawn = np.zeros(DRAWS)
    for pile, rows in climbs.groupby("pile"):
        beads = piles["beads"][pile]
        large_left = np.full(DRAWS, piles["large"][pile])  # labels for further leaders
        climbs_of_leaders = rows["leader"].value_counts().sort_index()
        for labelled, number in enumerate(climbs_of_leaders):
            is_large = generator.random(DRAWS) < large_left / (beads - labelled)
            drawn += number * is_large
            large_left -= is_large
    probability = None
    share = None
    interval = None
    if len(climbs):
        probability = float((1 + (drawn >= led_by_large).sum()) / (1 + DRAWS))
        share = led_by_large / len(climbs)
        interval = _interval_of_share(led_by_large, len(climbs))
    return {
        "led_by_large": led_by_large,
        "share_led_by_large": share,
        "share_led_by_large_interval": interval,
        "share_of_large": float(piles["large"].sum() / piles["beads"].sum()),
        "p_among_beads": probability,
    }


def survival(first: FloatArray, watched: FloatArray, deadline: float) -> dict[str, Any]:
    """Probability that an event has happened by a time, from N records of different lengths.

    Parameters
    ----------
    first
        Time of the first event of each record in s, shape (N,); infinite without an event. A time
        after the end of the record counts as none.
    watched
        Lengths of the records in s, shape (N,).
    deadline
        The time in s by which the event has happened or not.

    Returns
    -------
    dict
        - ``climbed``: number of records with the event by the time
        - ``ended``: number of records that ended before the time, without the event
        - ``censored``: number of records without the event
        - ``probability``, ``interval``: probability and its 95 % confidence interval; None if no
          record is long enough
        - ``estimator``: method of the interval, see Notes
        - ``median``: time in s by which half of the records have the event; None if it is not
          reached
        - ``curve``: ``probability`` and its band, ``low`` and ``high``, at each ``time`` (s) at
          which the probability changes; None where it is not defined

    Notes
    -----
    The probability and the curve are Kaplan and Meier's estimate (1958), the band is by Greenwood's
    variance of log(-log) of the survival. The interval is of the same kind (``Kaplan-Meier``) if
    records ended before the time and some, but not all, have the event. Otherwise it is the exact
    binomial interval of Clopper and Pearson (1934; ``Clopper-Pearson``).
    """
    from scipy.stats import CensoredData, ecdf

    censored = first > watched
    long_enough = watched >= deadline * (1.0 - _SAME_LENGTH)
    records = CensoredData.right_censored(np.minimum(first, watched), censored)
    share = ecdf(records).cdf
    with warnings.catch_warnings():  # at times at which all have climbed
        warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
        band = share.confidence_interval(CONFIDENCE, method="log-log")
    climbed = int((~censored & (first <= deadline)).sum())
    ended = int((censored & ~long_enough).sum())
    probability = None
    if long_enough.any() or not censored.any():
        probability = float(share.evaluate(deadline))
    estimator = "Clopper-Pearson"
    interval = None
    if ended and probability is not None and 0.0 < probability < 1.0:
        estimator = "Kaplan-Meier"
        interval = [float(band.low.evaluate(deadline)), float(band.high.evaluate(deadline))]
    elif probability is not None:
        followed = int((long_enough | (first <= np.minimum(watched, deadline))).sum())
        interval = _interval_of_share(climbed, followed)
    times_of_half = share.quantiles[share.probabilities >= 0.5]
    times = np.array([0.0, *np.unique(share.quantiles)])
    return {
        "climbed": climbed,
        "ended": ended,
        "censored": int(censored.sum()),
        "probability": probability,
        "interval": interval,
        "estimator": estimator,
        "median": float(times_of_half[0]) if len(times_of_half) else None,
        "curve": {
            "time": _finite_or_none(times),
            "probability": _finite_or_none(share.evaluate(times)),
            "low": _finite_or_none(band.low.evaluate(times)),
            "high": _finite_or_none(band.high.evaluate(times)),
        },
    }


def _finite_or_none(values: FloatArray) -> list[float | None]:
    """Numbers as JSON has them: None for those that are not finite."""
    return [value if isfinite(value) else None for value in values.tolist()]
