"""How often, how soon, how fast and led by whom: climbs over the runs of piles.

A run tells of its pile's first climb until it ends and of nothing after that: it is *right-censored*. The share of the
piles that have climbed by a time is estimated from runs of any lengths by their survival (Kaplan and Meier 1958). A
pile has climbed once a cluster has gained enough, not when that begins: counted by its begin, a climb shortly before
the time would be one in a run that is long enough to show what became of it, and none in a shorter run.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.changes import dotted
from walkers.inputs.errors import refused
from walkers.postprocess.analyses.piles import Pile, climbs_by
from walkers.postprocess.analysis import tables_of
from walkers.postprocess.clusters import ClimbCriteria
from walkers.runner.directory import CASE_NAME, FinishedRun, finished_places, finished_run
from walkers.sweeps.record import RECORD_NAME, read_record, result_in, states
from walkers.sweeps.table import value_text

FloatArray = npt.NDArray[np.float64]

_CONFIDENCE = 0.95
_NO_CONDITION = ("name", "title", "seed", "run.cycles", "run.cycles_per_segment")
"""Keys of a case that are none of a condition under which a pile is shaken: how long it was, is none."""
_ALIKE = 1e-6  # lengths of runs that differ by less, relatively, are the same


def piles_in(directory: Path) -> dict[str, list[Path]]:
    """The finished runs of piles of a sweep, or in a folder, or the run itself, by what distinguishes them.

    Seeds and lengths do not. Each run is there once, whatever names it has, and of those that begin alike and were
    shaken for different times the longest alone: it shows what the others show. `InputError` if there is none.
    """
    if (directory / RECORD_NAME).exists():
        found = [state.directory for state in states(read_record(directory)) if state.directory is not None]
    elif (directory / CASE_NAME).exists():
        found = [directory]
    else:
        found = list(finished_places(directory).values())
    runs = [run for path in found if (run := finished_run(path)) is not None]
    try:
        piles = {run.directory.name.rpartition("-")[2]: run for run in runs if Pile().applies(run.case)}
        cases = {run.directory: _determinants(run) for run in piles.values()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise refused(directory, f"a case cannot be read ({error})") from error
    if not cases:
        raise refused(directory, "expected a finished run of a pile, or a folder or sweep")
    keys = dict.fromkeys(key for case in cases.values() for key in case if key not in _NO_CONDITION)
    differ = [key for key in keys if len({str(case.get(key)) for case in cases.values()}) > 1]
    groups: dict[str, dict[Any, Path]] = {}
    for path, case in sorted(cases.items(), key=lambda one: -one[1].get("run.cycles", 0)):
        label = ", ".join(f"{key} = {value_text(case.get(key))}" for key in differ)
        groups.setdefault(label, {}).setdefault(case.get("seed"), path)
    return {label: list(starts.values()) for label, starts in groups.items()}


def _determinants(run: FinishedRun) -> dict[str, Any]:
    """What determines a run, by dotted keys. Runs of other decks or engines are no repetitions of each other."""
    manifest = run.manifest
    made_by = {"deck version": manifest.get("deck_version"), "engine": manifest["engine"]["sha256"][:8]}
    return dict(dotted(run.case.determinants())) | made_by


def summarise_climbs(runs: Sequence[Path], within: float | None = None) -> dict[str, Any]:
    """Climbs over several runs that differ by their seeds and lengths alone.

    Parameters
    ----------
    runs
        Run directories of piles.
    within
        Seconds of drive by which a pile has climbed or not, and after which no run counts any more; if left out the
        length of the shortest run, the longest time at which all of them still count.

    Returns
    -------
    dict
        ``within`` (s) and ``runs``; ``climbed`` (runs that had climbed by then), ``ended`` (runs that ended before and
        had not), ``probability`` of having climbed by then with its ``interval`` (95 %), both None where no run is so
        long; ``median`` (s, the time by which half have climbed, None where that is not reached), ``censored`` (runs
        that ended, or were cut off at a given ``within``, without a climb).

        Of the climbs that had qualified by ``within``: ``climbs``, ``times`` (s, when the first climb of each run
        qualified), ``onsets`` (s, when it had begun), ``speeds`` (m/s), ``sizes``, ``led_by_large``, ``in_corners``.

        And all of this in ``out_of_pile``, without the clusters that have hung on a wall since the pouring.
    """
    results = [result_in(run) for run in runs]
    driven = np.array([result["driven"] for result in results])
    every = [result["climbs"] for result in results]
    freed = [[climb for climb in climbs if climb["out_of_pile"]] for climbs in every]
    return {**_summary(driven, every, within), "out_of_pile": _summary(driven, freed, within)}


def _summary(driven: FloatArray, told: Sequence[Sequence[dict[str, Any]]], within: float | None) -> dict[str, Any]:
    """`summarise_climbs` of runs of such lengths (s) and their climbs."""
    first = np.array([min((climb["qualified"] for climb in climbs), default=np.inf) for climbs in told])
    at, cut = (float(driven.min()), np.inf) if within is None else (within, within)
    counted = [[climb for climb in climbs if climb["qualified"] <= at] for climbs in told]
    firsts = [min(climbs, key=lambda climb: climb["qualified"]) for climbs in counted if climbs]
    every = [climb for climbs in counted for climb in climbs]
    return {
        "within": at,
        "runs": len(told),
        **survival(first, np.minimum(driven, cut), at),
        "climbs": len(every),
        "times": [climb["qualified"] for climb in firsts],
        "onsets": [climb["onset"] for climb in firsts],
        "speeds": [climb["speed"] for climb in every if climb["speed"] is not None],
        "in_corners": sum(len(climb["walls"]) > 1 for climb in every),
        "sizes": [climb["size"] for climb in every],
        "led_by_large": sum(climb["leader_large"] for climb in every),
    }


def survival(first: FloatArray, watched: FloatArray, at: float) -> dict[str, Any]:
    """The probability that what happens once has happened by a time, from records that end at different times.

    Parameters
    ----------
    first : ndarray, shape (N,)
        When it happened in each record, s; infinite where it did not. What comes after the record's end is ignored.
    watched : ndarray, shape (N,)
        Length of each record, s.
    at
        The time, s.

    Returns
    -------
    dict
        ``climbed``, ``ended``, ``censored``, ``probability``, ``interval`` and ``median`` of `summarise_climbs`. The
        interval is that of Greenwood's variance of log(-log) of the survival, where it exists; where none or all have
        climbed, the binomial one (Clopper and Pearson 1934) of the records that are so long.
    """
    from scipy.stats import CensoredData, binomtest, ecdf

    censored = first > watched
    longest = watched >= at * (1.0 - _ALIKE)
    share = ecdf(CensoredData.right_censored(np.minimum(first, watched), censored)).cdf
    half = np.flatnonzero(share.probabilities >= 0.5)
    probability = float(share.evaluate(at)) if longest.any() else None
    interval = None
    if probability is not None and 0.0 < probability < 1.0:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
            ends = share.confidence_interval(_CONFIDENCE, method="log-log")
        interval = [float(ends.low.evaluate(at)), float(ends.high.evaluate(at))]
    elif probability is not None:
        followed = int(longest.sum())
        exact = binomtest(round(probability) * followed, followed).proportion_ci(_CONFIDENCE)
        interval = [float(exact.low), float(exact.high)]
    return {
        "climbed": int((~censored & (first <= at)).sum()),
        "ended": int((censored & ~longest).sum()),
        "censored": int(censored.sum()),
        "probability": probability,
        "interval": interval,
        "median": float(share.quantiles[half[0]]) if len(half) else None,
    }


VARIATIONS = {
    "min_rise": (1e-3, 2e-3, 3e-3, 5e-3),
    "max_gap": (0.03, 0.1, 0.2),
    "min_overlap": (0.3, 0.5, 0.7),
}
"""Other thresholds of `walkers.postprocess.clusters.ClimbCriteria`, tried one at a time."""


def sensitivity(runs: Sequence[Path]) -> list[dict[str, Any]]:
    """How the outcome depends on the thresholds of what counts as a climb.

    Returns
    -------
    list of dict
        One row per definition, the usual one first: ``threshold`` and ``value`` (empty and None for the usual one),
        ``runs``, ``climbed`` (runs with a climb), ``climbs``, ``led_by_large``, ``median_speed`` (m/s).
    """
    usual = ClimbCriteria()
    tried: list[tuple[str, float | None]] = [("", None)]
    tried += [(name, one) for name, ones in VARIATIONS.items() for one in ones if one != getattr(usual, name)]
    counts = dict.fromkeys(("climbed", "climbs", "led_by_large"), 0)
    rows: list[dict[str, Any]] = [
        {"threshold": name, "value": value, "runs": len(runs), **counts, "median_speed": []} for name, value in tried
    ]
    for run in runs:
        tables = tables_of(run)
        for row in rows:
            definition = replace(usual, **{row["threshold"]: row["value"]}) if row["threshold"] else usual
            climbs = climbs_by(tables, definition)
            row["climbed"] += bool(climbs)
            row["climbs"] += len(climbs)
            row["led_by_large"] += sum(climb.leader_large for climb in climbs)
            row["median_speed"] += [climb.speed for climb in climbs]
    return [{**row, "median_speed": median(row["median_speed"]) if row["climbs"] else None} for row in rows]


def describe_sensitivity(rows: Sequence[dict[str, Any]]) -> str:
    """`sensitivity` as text; mm, s, mm/s."""
    lines = []
    for row in rows:
        told = "as defined" if row["value"] is None else f"{row['threshold']} = {row['value']:g}"
        speed = "-" if row["median_speed"] is None else f"{row['median_speed'] * 1e3:.2f} mm/s"
        lines.append(
            f"  {told:20} {row['climbed']} of {row['runs']} runs, {row['climbs']} climbs, {row['led_by_large']} led by "
            f"a large bead, median {speed}"
        )
    return "\n".join(lines)


def describe_climbs(found: dict[str, Any]) -> str:
    """`summarise_climbs` as text; s, mm/s."""
    if found["probability"] is None:
        return f"no run is as long as {found['within']:g} s"
    low, high = found["interval"]
    half = "not reached" if found["median"] is None else f"{found['median']:.2f} s"
    lines = [
        f"{found['climbed']} of {found['runs']} runs climbed within {found['within']:.3g} s"
        + (f", {found['ended']} ended before and had not" if found["ended"] else "")
        + f": probability {found['probability']:.2f} ({low:.2f} to {high:.2f} with {_CONFIDENCE:.0%} confidence)",
        f"  to climb   median {half}; {found['censored']} of {found['runs']} runs ended without a climb",
    ]
    if found["climbs"]:
        sizes = ", ".join(f"{size}: {found['sizes'].count(size)}" for size in sorted(set(found["sizes"])))
        lines += [
            f"  climbs     {found['climbs']}, led by a large bead {found['led_by_large']}, "
            f"in a corner {found['in_corners']}",
            f"  first one  counted after {_range(found['times'])} s, begun after {_range(found['onsets'])} s",
            f"  clusters   beads: how many   {sizes}",
        ]
    if found["speeds"]:
        speeds = np.array(found["speeds"]) * 1e3
        lines.append(f"  speed      {_range(speeds)} mm/s, median {np.median(speeds):.2f} mm/s")
    return "\n".join(lines)


def _range(values: Sequence[float] | FloatArray) -> str:
    return f"{min(values):.2f} to {max(values):.2f}"
