"""Statistics of climbs over runs of piles: probability, waiting time, rate, speed and leaders.

A run without a climb shows only that its first climb comes later than its end: it is *right-censored*. The share of
piles that have climbed by a time is estimated from runs of any length by their survival (Kaplan and Meier 1958). A pile
has climbed when a cluster has gained enough height, not when the rise begins: otherwise a rise shortly before the time
would count in a run that is long enough to show its outcome, and not in a shorter one.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.errors import refused
from walkers.inputs.keys import dotted
from walkers.postprocess import piles
from walkers.postprocess.results import plain, read
from walkers.rounding import percent
from walkers.runner.directory import CASE_NAME, case_of, finished_places, is_finished
from walkers.runner.manifest import read_manifest
from walkers.sweeps.table import RECORD_NAME, read_record, states, value_text

FloatArray = npt.NDArray[np.float64]

_CONFIDENCE = 0.95
_NO_CONDITION = ("name", "title", "run.seed", "run.cycles", "run.duration", "run.cycles_per_segment")
"""Keys of a case that do not define a condition: names, seeds and lengths (a segment is as long as a short run)."""
_DRAWS = 10_000
_PARTS: Mapping[str, Callable[[Mapping[str, Any]], bool]] = {
    "on_plain_walls": lambda climb: len(climb["walls"]) == 1,
    "in_corners": lambda climb: len(climb["walls"]) > 1,
    "out_of_pile": lambda climb: climb["out_of_pile"],
}
"""Subsets of the climbs of a result."""
_ALIKE = 1e-6  # relative difference below which lengths of runs are equal


@dataclass(frozen=True)
class Condition:
    """Finished runs of piles that differ only in seed and length.

    ``source`` is the sweep or folder, if there are several; ``usual`` has the most common value of each key, if there
    is a single one; ``differs`` has the values of this condition that are not usual.
    """

    source: str
    usual: Mapping[str, str]
    differs: Mapping[str, str]
    runs: Sequence[Path]

    @property
    def label(self) -> str:
        """Label that distinguishes the condition from the others; empty if there is only one."""
        return ", ".join([self.source] * bool(self.source) + [f"{key} = {told}" for key, told in self.differs.items()])

    def value(self, key: str) -> str:
        """The value of a key, its own or the usual one."""
        return self.differs.get(key, self.usual.get(key, ""))


def conditions_in(directories: Sequence[Path]) -> list[Condition]:
    """The conditions of finished runs of piles; ``directories`` are sweeps, folders or runs.

    Each run counts once. Of runs that differ only in length, only the longest one counts, because it contains the
    others. `InputError` if a directory has no finished run of a pile.
    """
    found = []
    for directory in directories:
        groups = _groups(directory)
        known = [values for values, _ in groups]
        keys = list(dict.fromkeys(key for values in known for key in values))
        counts = {key: Counter(values.get(key, "") for values in known).most_common(2) for key in keys}
        usual = {key: most[0][0] for key, most in counts.items() if len({number for _, number in most}) == len(most)}
        source = directory.name if len(directories) > 1 else ""
        for values, runs in groups:
            differs = {key: values[key] for key in keys if key in values and values[key] != usual.get(key)}
            found.append(Condition(source, usual, differs, runs))
    return found


def unfinished_points(directory: Path) -> str:
    """Sentence with the number of unfinished points of a sweep; empty if there are none."""
    if not (directory / RECORD_NAME).exists():
        return ""
    found = [state.status for state in states(read_record(directory))]
    left = len(found) - found.count("finished")
    return f"{directory.name}: {left} of {len(found)} points are not finished and left out" if left else ""


def _groups(directory: Path) -> list[tuple[dict[str, str], list[Path]]]:
    """For each condition in a directory the values of the varied keys as text, and the runs."""
    varied: dict[Path, dict[str, str]] = {}
    if (directory / RECORD_NAME).exists():
        record = read_record(directory)
        for values, state in zip(record.sweep.values, states(record), strict=True):
            named = zip(record.sweep.units.items(), values, strict=True)
            told = {key: value_text(value, unit) for (key, unit), value in named}
            if state.status == "finished" and state.directory is not None:
                varied[state.directory] = {key: text for key, text in told.items() if key not in _NO_CONDITION}
    else:
        places = [directory] if (directory / CASE_NAME).exists() else finished_places(directory).values()
        varied = {place: {} for place in places}
    runs = filter(is_finished, varied)
    try:
        found = {str(read_manifest(run).get("run", run)): run for run in runs if piles.applies(case_of(run))}
        cases = {run: _determinants(run) for run in found.values()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise refused(directory, f"a case cannot be read ({error})") from error
    if not cases:
        raise refused(directory, "expected a finished run of a pile, or a folder or sweep")
    keys = dict.fromkeys(key for case in cases.values() for key in case if key not in _NO_CONDITION)
    differ = [key for key in keys if len({str(case.get(key)) for case in cases.values()}) > 1]
    groups: dict[str, tuple[dict[str, str], dict[Any, Path]]] = {}
    for path, case in sorted(cases.items(), key=lambda one: -one[1].get("run.cycles", 0)):
        own, exact = {key: value_text(case.get(key)) for key in differ}, str([case.get(key) for key in differ])
        made_by = {key: own[key] for key in ("deck version", "engine") if key in own}
        _, starts = groups.setdefault(exact, ((varied[path] | made_by) if varied[path] else own, {}))
        starts.setdefault(case.get("run.seed"), path)
    order = {path: number for number, path in enumerate(varied)}
    sets = [(values, sorted(starts.values(), key=order.__getitem__)) for values, starts in groups.values()]
    return sorted(sets, key=lambda one: order[one[1][0]])


def _determinants(run: Path) -> dict[str, Any]:
    """Inputs that determine a run, by dotted keys, with deck version and engine."""
    manifest = read_manifest(run)
    made_by = {"deck version": manifest.get("deck_version"), "engine": manifest["engine"]["sha256"][:8]}
    return dict(dotted(case_of(run).determinants())) | made_by


def summarise_climbs(runs: Sequence[Path], within: float | None = None) -> dict[str, Any]:
    """Statistics of climbs over several runs that differ only in seed and length.

    Parameters
    ----------
    runs
        Run directories of piles.
    within
        Time of the drive in s by which a pile has climbed or not; later parts of runs do not count. Default: the end of
        the shortest run without a climb, which is the longest time at which all runs count.

    Returns
    -------
    dict
        ``within`` (s), ``runs`` and ``seconds`` (of drive, of all runs up to a given ``within``). For the first climbs:
        the items of `survival`, and ``first_rate`` with its ``first_rate_interval`` (1/s, first climbs divided by the
        time until them: the rate, if waiting times are exponentially distributed).

        For all climbs that qualified in this time: ``climbs``; ``rate`` (1/s, of one start) with the exact Poisson
        ``rate_interval``; ``dispersion``, variance divided by mean of the number of climbs of a run (1 for independent
        climbs; None if lengths of runs differ by more than a tenth); ``times`` and ``onsets`` (s, when the first climb
        of each run qualified and began), ``speeds`` (m/s), ``heights`` (m, of the leaders at the end), ``sizes``; and
        the items of `leaders`.

        ``each`` has each climb as in the results, whenever it qualified, with the name of its run.

        ``on_plain_walls``, ``in_corners`` and ``out_of_pile`` (without those on a wall since before the drive)
        have all of these items for a part of the climbs, by the same time.
    """
    results = [_result_of(run) for run in runs]
    found = _summary(results, within)
    found["each"] = [
        {"run": run.name, **climb} for run, one in zip(runs, results, strict=True) for climb in one["climbs"]
    ]
    for name, belongs in _PARTS.items():
        some = [{**result, "climbs": list(filter(belongs, result["climbs"]))} for result in results]
        found[name] = _summary(some, within, found["within"])
    return found


def _result_of(run: Path) -> dict[str, Any]:
    """Numbers of a pile, and its ``climbs`` as rows of the table ``clusters``; None for numbers that are not finite."""
    results = read(run)
    columns = results.columns("clusters")
    names = [str(names).split() for names in columns["wall_names"]]
    climbs = [
        {**plain({name: values[number] for name, values in columns.items()}), "walls": names[number]}
        for number in np.flatnonzero(columns["climbed"])
    ]
    return {**{name: results[name] for name in ("beads", "large", "driven")}, "climbs": climbs}


def _summary(results: Sequence[Mapping[str, Any]], within: float | None, at: float | None = None) -> dict[str, Any]:
    """`summarise_climbs` of results, with the probability by the time ``at`` (s)."""
    driven = np.array([result["driven"] for result in results])
    # A run that ended because a climber left the container shows its first climb as a longer run does.
    still = [float(result["driven"]) for result in results if not result["climbs"]]
    cut = np.inf if within is None else within
    at = within if at is None else at
    at = min(still, default=float(driven.max())) if at is None else at
    watched = np.minimum(driven, cut)
    counted = [[climb for climb in result["climbs"] if climb["qualified"] <= cut] for result in results]
    firsts = [min(climbs, key=lambda climb: climb["qualified"]) for climbs in counted if climbs]
    first = np.array([min((climb["qualified"] for climb in climbs), default=np.inf) for climbs in counted])
    every = [climb for climbs in counted for climb in climbs]
    numbers, seconds = [len(climbs) for climbs in counted], float(watched.sum())
    alike = np.ptp(watched) <= 0.1 * watched.max() and len(numbers) > 1 and every
    return {
        "within": at,
        "runs": len(results),
        "seconds": seconds,
        **survival(first, watched, at),
        **_rate("first_rate", len(firsts), float(np.minimum(first, watched).sum())),
        "climbs": len(every),
        **_rate("rate", len(every), seconds),
        "curve": survival_curve(first, watched),
        "dispersion": float(np.var(numbers, ddof=1) / np.mean(numbers)) if alike else None,
        "times": [climb["qualified"] for climb in firsts],
        "onsets": [climb["onset"] for climb in firsts],
        "speeds": [climb["speed"] for climb in every if climb["speed"] is not None],
        "heights": [climb["height"] for climb in every],
        "sizes": [climb["size"] for climb in every],
        **leaders(
            [(result["beads"], result["large"], climbs) for result, climbs in zip(results, counted, strict=True)]
        ),
    }


def _rate(name: str, events: int, seconds: float) -> dict[str, Any]:
    """Rate of events, 1/s, with the exact 95 % interval (Garwood 1936); None if the time is zero."""
    from scipy.stats import chi2

    if seconds <= 0.0:
        return {name: None, f"{name}_interval": None}
    tail = (1.0 - _CONFIDENCE) / 2.0
    ends = chi2.ppf((tail, 1.0 - tail), (2 * events, 2 * events + 2)) / 2.0  # NaN: no lower end without events
    return {name: events / seconds, f"{name}_interval": (np.nan_to_num(ends) / seconds).tolist()}


def leaders(climbs: Sequence[tuple[int, int, Sequence[Mapping[str, Any]]]]) -> dict[str, Any]:
    """Test whether large beads lead climbs more often than expected by chance.

    Parameters
    ----------
    climbs
        For each run the number of beads, the number of large beads, and the climbs as in the results.

    Returns
    -------
    dict
        ``led_by_large`` climbs; ``share_of_large`` in the beads of all runs; ``p_among_beads``, the probability of at
        least as many climbs led by large beads if the labels "large" and "small" are permuted within each run (a bead
        that leads twice counts twice: climbs of one run are not independent); ``p_among_own``, the same if any bead of
        each climbing cluster leads. Both are from 10,000 draws, one-sided; None without climbs.
    """
    draw = np.random.default_rng(0)
    led = sum(climb["leader_large"] for _, _, told in climbs for climb in told)
    beads, large = sum(one[0] for one in climbs), sum(one[1] for one in climbs)
    found: dict[str, Any] = {"led_by_large": led, "share_of_large": large / beads}
    found |= {"p_among_beads": None, "p_among_own": None}
    if not any(told for _, _, told in climbs):
        return found
    dealt, own = np.zeros(_DRAWS), np.zeros(_DRAWS)
    for number, some, told in climbs:
        _, times = np.unique([climb["leader"] for climb in told], return_counts=True)
        left = np.full(_DRAWS, some)  # labels "large" that are left for the next leaders
        for place, weight in enumerate(times):
            is_large = draw.random(_DRAWS) < left / (number - place)
            dealt += weight * is_large
            left -= is_large
        for climb in told:
            own += draw.random(_DRAWS) < climb["large"] / climb["size"]
    for name, drawn in (("p_among_beads", dealt), ("p_among_own", own)):
        found[name] = float((1 + (drawn >= led).sum()) / (1 + _DRAWS))
    return found


def survival(first: FloatArray, watched: FloatArray, at: float) -> dict[str, Any]:
    """Probability that an event has happened by a time, from records of different lengths (Kaplan-Meier).

    Parameters
    ----------
    first : ndarray, shape (N,)
        Time of the event in each record, s; infinite if there is none. Later events than the record's end are ignored.
    watched : ndarray, shape (N,)
        Length of each record, s.
    at
        The time, s.

    Returns
    -------
    dict
        ``climbed`` (records with the event by then), ``ended`` (records that ended before, without it);
        ``probability`` of the event by then with its ``interval`` (95 %), both None if no record is long enough;
        ``median`` (s, time by which half have it; None if not reached), ``censored`` (records that ended without it).

        ``estimator`` names the interval: ``Clopper-Pearson`` (1934, exact, binomial) for records that are long enough
        or have the event; ``Kaplan-Meier`` (Greenwood's variance of log(-log) of the survival) if records ended before
        and the interval exists, that is, neither none nor all have climbed.
    """
    from scipy.stats import binomtest

    censored = first > watched
    watched_so_long = watched >= at * (1.0 - _ALIKE)
    followed = int((watched_so_long | (first <= np.minimum(watched, at))).sum())
    share = _share(first, watched)
    half = np.flatnonzero(share.probabilities >= 0.5)
    probability = float(share.evaluate(at)) if watched_so_long.any() or not censored.any() else None
    climbed, ended = int((~censored & (first <= at)).sum()), int((censored & ~watched_so_long).sum())
    interval, estimator = None, "Clopper-Pearson"
    if ended and probability is not None and 0.0 < probability < 1.0:
        ends = _greenwood(share)
        interval, estimator = [float(ends.low.evaluate(at)), float(ends.high.evaluate(at))], "Kaplan-Meier"
    elif probability is not None:
        exact = binomtest(climbed, followed).proportion_ci(_CONFIDENCE)
        interval = [float(exact.low), float(exact.high)]
    return {
        "climbed": climbed,
        "ended": ended,
        "censored": int(censored.sum()),
        "probability": probability,
        "interval": interval,
        "estimator": estimator,
        "median": float(share.quantiles[half[0]]) if len(half) else None,
    }


def _share(first: FloatArray, watched: FloatArray) -> Any:
    """Kaplan and Meier's estimate of the share with the event, by scipy."""
    from scipy.stats import CensoredData, ecdf

    return ecdf(CensoredData.right_censored(np.minimum(first, watched), first > watched)).cdf


def _greenwood(share: Any) -> Any:
    """The 95 % interval of a share by Greenwood's variance of log(-log) of the survival."""
    with warnings.catch_warnings():  # at times at which all have climbed
        warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
        return share.confidence_interval(_CONFIDENCE, method="log-log")


def survival_curve(first: FloatArray, watched: FloatArray) -> dict[str, list[float | None]]:
    """The share of `survival` at every time (s) at which it changes: ``time``, ``probability``, ``low``, ``high``.

    The band is by Greenwood's variance at all times; None while none or all have climbed.
    """
    share = _share(first, watched)
    time = np.array([0.0, *np.unique(share.quantiles)])
    ends = _greenwood(share)
    found = {"time": time, "probability": share.evaluate(time)}
    found |= {"low": ends.low.evaluate(time), "high": ends.high.evaluate(time)}
    return {name: [one if isfinite(one) else None for one in values.tolist()] for name, values in found.items()}


def describe_climbs(found: Mapping[str, Any]) -> str:
    """`summarise_climbs` as text, below the label of its ``condition``, if any; s, mm, mm/s."""
    label = [found["condition"]] if found.get("condition") else []
    if found["probability"] is None:
        return "\n".join([*label, f"no run is as long as {found['within']:g} s"])
    half = "not reached" if found["median"] is None else f"{found['median']:.2f} s"
    lines = [
        *label,
        f"{found['climbed']} of {found['runs']} runs climbed within {found['within']:.3g} s"
        + (f", {found['ended']} ended before without a climb" if found["ended"] else "")
        + f": probability {found['probability']:.2f}{_interval(found['interval'], '.2f', found['estimator'])}",
        f"  waiting    median {half}; {found['censored']} of {found['runs']} runs ended without a climb",
        f"  climbs     {_rate_text(found)}"
        + ("" if found["dispersion"] is None else f"; dispersion {found['dispersion']:.1f} (Poisson: 1)"),
    ]
    if found["climbs"]:
        sizes = ", ".join(f"{size}: {found['sizes'].count(size)}" for size in sorted(set(found["sizes"])))
        lines += [
            *(f"    {name.replace('_', ' '):15} {_rate_text(found[name])}" for name in _PARTS),
            f"  leader     large in {found['led_by_large']} of {found['climbs']} climbs (random bead of the pile, "
            f"{100 * found['share_of_large']:.0f} % large: {_p_text(found['p_among_beads'])}; "
            f"random bead of the cluster: {_p_text(found['p_among_own'])})",
            f"  first one  begins after {_range(found['onsets'])} s, counts after {_range(found['times'])} s",
            f"  beads      {sizes} (beads: climbs)",
            f"  height     {_range(np.array(found['heights']) * 1e3)} mm",
        ]
    if found["speeds"]:
        speeds = np.array(found["speeds"]) * 1e3
        lines.append(f"  speed      {_range(speeds)} mm/s, median {np.median(speeds):.2f} mm/s")
    return "\n".join(lines)


def _p_text(value: float) -> str:
    return f"p = {value:.2g}" if value > 1.5 / _DRAWS else f"p < {2 / _DRAWS:g}"


def _rate_text(found: Mapping[str, Any]) -> str:
    rate = "-" if found["rate"] is None else f"{found['rate']:.2g} per run and second"
    return f"{found['climbs']}: {rate}{_interval(found['rate_interval'])}"


def _interval(ends: Sequence[float] | None, digits: str = ".2g", estimator: str = "") -> str:
    text = ", ".join(filter(None, (f"{percent(_CONFIDENCE)} confidence", estimator)))
    return "" if ends is None else f" ({ends[0]:{digits}} to {ends[1]:{digits}} with {text})"


def _range(values: Sequence[float] | FloatArray) -> str:
    return " to ".join(dict.fromkeys(f"{end:.2f}" for end in (min(values), max(values))))
