"""Statistics of climbs over runs of piles, as text, table and figure: probability, waiting time, rate, speed, leaders.

A run without a climb shows only that its first climb comes later than its end: it is *right-censored*. The share of
piles that have climbed by a time is estimated from runs of any length by their survival (Kaplan and Meier 1958). A pile
has climbed when a cluster has gained enough height, not when the rise begins: otherwise a rise shortly before the time
would count in a run that is long enough to show its outcome, and not in a shorter one.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from math import inf, isfinite
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import input_error
from walkers.files import write_bytes
from walkers.postprocess.measure.results import Results, json_numbers
from walkers.postprocess.measure.uncertainty import guesses
from walkers.postprocess.show.drawing import (
    TWO_COLUMNS,
    letter_panels,
    new_figure,
    plain_text,
    save_figure,
    styled,
)
from walkers.rounding import percent
from walkers.sweeps.table import SEEDS, key_texts, seed_groups
from walkers.text import aligned

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CONFIDENCE = 0.95
_DRAWS = 10_000
PARTS = ("on_plain_walls", "in_corners", "out_of_pile")
"""Subsets of the climbs; the last one leaves out clusters that were on a wall before the drive."""
_WALLS_OF_CORNER = 2
"""Smallest number of side walls that hold a climb in a corner."""
_ROW = 2.1  # inches
_ALIKE = 1e-6  # relative difference below which lengths of runs are equal
_LETTERS = 44  # of a line in labels of conditions
_KINDS = {
    "all": ("", "ko"),
    "plain walls": ("on_plain_walls", "C1s"),
    "corners": ("in_corners", "C2^"),
}
"""All climbs and their parts: key of `summarise_climbs`, colour and marker."""


def conditions_in(frame: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """The finished points in a sweep's table by conditions, groups that differ in nothing but their seeds.

    Each has its varied values, such as ``drive.frequency = 100 Hz``, without those that at least half of the conditions
    have; empty for the usual condition.
    """
    import pandas as pd

    done = frame[frame["status"] == "finished"]
    if done.empty:
        raise input_error(
            frame.attrs["sweep"], "expected a finished run of a pile: no point is finished"
        )
    sets = [rows for _, rows in seed_groups(done)]
    texts = pd.concat([key_texts(rows.head(1)) for rows in sets]).drop(
        columns=list(SEEDS), errors="ignore"
    )
    most = {key: column.mode().tolist() for key, column in texts.items()}
    usual = {
        key: values
        for key, values in most.items()
        if 2 * (texts[key] == values[0]).sum() >= len(texts)
    }
    for rows, values in zip(sets, texts.to_dict("records") or [{}], strict=True):
        unusual = [f"{key} = {text}" for key, text in values.items() if [text] != usual.get(key)]
        yield ", ".join(unusual), rows


def summarise_climbs(results: Sequence[Results], within: float | None = None) -> dict[str, Any]:
    """`climb_summary` of the climbs in runs of piles that differ only in their seed, by their results.

    ``each`` has all climbs as in the table ``clusters``, whenever they qualified, with the names of their runs;
    ``guessed`` are the values of the case that the program guessed, as texts.
    """
    import pandas as pd

    for result in results:
        if "climbs" not in result:
            raise input_error(result.directory, "expected a finished run of a pile")
    piles = pd.DataFrame(
        [{name: result[name] for name in ("beads", "large", "driven")} for result in results]
    )
    climbs = pd.concat(
        [result.table("clusters").assign(pile=pile) for pile, result in enumerate(results)]
    )
    climbs = climbs[climbs["climbed"].astype(bool)]
    records: Any = climbs.assign(
        run=[results[pile].directory.name for pile in climbs["pile"]]
    ).to_dict("records")
    guessed = guesses(results[0].about["rests_on"])
    return {
        **climb_summary(piles, climbs, within),
        "each": list(map(json_numbers, records)),
        "guessed": guessed,
    }


def climb_summary(
    piles: pd.DataFrame, climbs: pd.DataFrame, within: float | None = None
) -> dict[str, Any]:
    """`statistics` of all climbs, and of each of `PARTS` by the same time.

    Its default is the end of the shortest run without a climb: the longest time at which all runs count.
    """
    still = piles["driven"][~piles.index.isin(climbs["pile"])]
    # If a climber left the container, the run ended; a longer run would show the same first climb.
    at = float(still.min() if len(still) else piles["driven"].max()) if within is None else within
    cut = inf if within is None else within
    in_corners = climbs["walls"] >= _WALLS_OF_CORNER
    parts = (~in_corners, in_corners, climbs["out_of_pile"].astype(bool))
    of_parts = {
        name: statistics(piles, climbs[rows], cut, at)
        for name, rows in zip(PARTS, parts, strict=True)
    }
    return statistics(piles, climbs, cut, at) | of_parts


def statistics(piles: pd.DataFrame, climbs: pd.DataFrame, cut: float, at: float) -> dict[str, Any]:
    """Statistics of climbs over several piles that differ only in their seed.

    ``piles`` has a row per run: ``beads``, ``large`` (numbers of beads) and ``driven`` (s, length of the drive);
    ``climbs`` are rows of the tables ``clusters``, with the index of their ``pile``. Climbs count up to the time
    ``cut``; a pile has climbed or not by the time ``at``, s.

    The items are ``within`` (s, ``at``), ``runs`` and ``seconds`` (of drive, of all runs up to ``cut``); for first
    climbs those of `survival`, ``times`` and ``onsets`` (s, when they qualified and began). For all climbs: their
    number, ``rate`` (1/s, of one start) with the exact Poisson ``rate_interval``, ``dispersion`` (variance over mean of
    the number of climbs of a run; None if lengths of runs differ by more than a tenth), ``speeds`` (m/s), ``heights``
    (m, of the leaders at the end), ``sizes``, and the items of `leaders`.
    """
    watched = piles["driven"].astype(float).clip(upper=cut)
    counted = climbs[climbs["qualified"] <= cut]
    firsts = counted.sort_values("qualified").drop_duplicates("pile").sort_values("pile")
    first = firsts.set_index("pile")["qualified"].astype(float).reindex(piles.index, fill_value=inf)
    numbers = counted["pile"].value_counts().reindex(piles.index, fill_value=0)
    alike = np.ptp(watched) <= 0.1 * watched.max() and len(piles) > 1 and len(counted)
    return {
        "within": at,
        "runs": len(piles),
        "seconds": float(watched.sum()),
        **survival(np.array(first, dtype=float), np.array(watched, dtype=float), at),
        "climbs": len(counted),
        **_rate(len(counted), float(watched.sum())),
        "dispersion": float(numbers.var() / numbers.mean()) if alike else None,
        "times": firsts["qualified"].tolist(),
        "onsets": firsts["onset"].tolist(),
        "speeds": counted["speed"].dropna().tolist(),
        "heights": counted["height"].tolist(),
        "sizes": counted["size"].tolist(),
        **leaders(piles, counted),
    }


def _rate(events: int, seconds: float) -> dict[str, Any]:
    """Rate of events, 1/s, with the exact 95 % interval (Garwood 1936); None if the time is zero."""
    from scipy.stats import chi2

    if seconds <= 0.0:
        return {"rate": None, "rate_interval": None}
    tail = (1.0 - _CONFIDENCE) / 2.0
    ends = (
        chi2.ppf((tail, 1.0 - tail), (2 * events, 2 * events + 2)) / 2.0
    )  # NaN: no lower end without events
    return {"rate": events / seconds, "rate_interval": (np.nan_to_num(ends) / seconds).tolist()}


def leaders(piles: pd.DataFrame, climbs: pd.DataFrame) -> dict[str, Any]:
    """Test whether large beads lead climbs more often than expected by chance; parameters as of `statistics`.

    ``led_by_large`` climbs; ``share_of_large`` in the beads of all runs; ``p_among_beads``: one-sided probability, from
    10,000 draws, of at least as many if the labels "large" and "small" are permuted within each run. A bead that leads
    twice counts twice: climbs of one run are not independent. None without climbs.
    """
    draw, led = np.random.default_rng(0), int(climbs["leader_large"].sum())
    drawn = np.zeros(_DRAWS)
    for pile, rows in climbs.groupby("pile"):
        beads, left = (
            piles["beads"][pile],
            np.full(_DRAWS, piles["large"][pile]),
        )  # labels "large" for further leaders
        for place, weight in enumerate(rows["leader"].value_counts().sort_index()):
            is_large = draw.random(_DRAWS) < left / (beads - place)
            drawn += weight * is_large
            left -= is_large
    return {
        "led_by_large": led,
        "share_of_large": float(piles["large"].sum() / piles["beads"].sum()),
        "p_among_beads": float((1 + (drawn >= led).sum()) / (1 + _DRAWS)) if len(climbs) else None,
    }


def survival(first: FloatArray, watched: FloatArray, at: float) -> dict[str, Any]:
    """Probability that an event has happened by a time, from N records of different lengths (Kaplan-Meier).

    ``first`` are the times of the event in each record (infinite without one; times after its end are ignored),
    ``watched`` the lengths of the records, in s, shape (N,).

    The items are ``climbed`` (records with the event by then), ``ended`` (before, without it), ``censored`` (ended
    without it at any time), ``median`` (s, time by which half have it; None if not reached); ``probability`` with its
    95 % ``interval``, None if no record is long enough. ``estimator`` of the interval: ``Clopper-Pearson`` (1934,
    exact, binomial), or ``Kaplan-Meier`` (Greenwood's variance of log(-log) of the survival) if records ended before
    and some, but not all, have climbed. ``curve``: ``probability`` and Greenwood's band, ``low`` and ``high``, at every
    ``time`` (s) at which the share changes.
    """
    from scipy.stats import CensoredData, binomtest, ecdf

    censored, long_enough = first > watched, watched >= at * (1.0 - _ALIKE)
    share = ecdf(CensoredData.right_censored(np.minimum(first, watched), censored)).cdf
    with warnings.catch_warnings():  # at times at which all have climbed
        warnings.filterwarnings("ignore", "The confidence interval is undefined", RuntimeWarning)
        band = share.confidence_interval(_CONFIDENCE, method="log-log")
    probability = float(share.evaluate(at)) if long_enough.any() or not censored.any() else None
    climbed, ended = int((~censored & (first <= at)).sum()), int((censored & ~long_enough).sum())
    interval, estimator = None, "Clopper-Pearson"
    if ended and probability is not None and 0.0 < probability < 1.0:
        interval, estimator = (
            [float(end.evaluate(at)) for end in (band.low, band.high)],
            "Kaplan-Meier",
        )
    elif probability is not None:
        followed = int((long_enough | (first <= np.minimum(watched, at))).sum())
        interval = [*map(float, binomtest(climbed, followed).proportion_ci(_CONFIDENCE))]
    half = share.quantiles[share.probabilities >= 0.5]
    time = np.array([0.0, *np.unique(share.quantiles)])
    lines = {"probability": share, "low": band.low, "high": band.high}
    curve = {"time": time, **{name: line.evaluate(time) for name, line in lines.items()}}
    return {
        "climbed": climbed,
        "ended": ended,
        "censored": int(censored.sum()),
        "probability": probability,
        "interval": interval,
        "estimator": estimator,
        "median": float(half[0]) if len(half) else None,
        "curve": {
            name: [value if isfinite(value) else None for value in line.tolist()]
            for name, line in curve.items()
        },
    }


def texts_of(climbs: Mapping[str, Any]) -> dict[str, str]:
    """Statistics of climbs in a condition as texts; rates in climbs per run and second, 95 % intervals in brackets."""

    def with_interval(
        value: float | None, ends: Sequence[float] | None, digits: str = ".2g"
    ) -> str:
        interval = "" if ends is None else f" ({ends[0]:{digits}} to {ends[1]:{digits}})"
        return "–" if value is None else f"{value:{digits}}{interval}"

    def between(values: Sequence[float], factor: float = 1.0) -> str:
        return f"{factor * min(values):.2g} to {factor * max(values):.2g}" if values else "–"

    return {
        "pile": climbs["condition"],
        "climbed": f"{climbs['climbed']} of {climbs['runs']}",
        "within (s)": f"{climbs['within']:.3g}",
        "ended before": f"{climbs['ended']}",
        "probability": with_interval(climbs["probability"], climbs["interval"], ".2f"),
        "half by (s)": "–" if climbs["median"] is None else f"{climbs['median']:.2g}",
        "climbs": f"{climbs['climbs']}",
        "rate": with_interval(climbs["rate"], climbs["rate_interval"]),
        **{
            name.replace("_", " "): with_interval(
                climbs[name]["rate"], climbs[name]["rate_interval"]
            )
            for name in PARTS
        },
        "dispersion": "–" if climbs["dispersion"] is None else f"{climbs['dispersion']:.2g}",
        "led by large": f"{climbs['led_by_large']} of {climbs['climbs']}",
        "large beads (%)": f"{100.0 * climbs['share_of_large']:.0f}",
        "p by chance": "–"
        if climbs["p_among_beads"] is None
        else f"{max(climbs['p_among_beads'], 2.0 / _DRAWS):.2g}",
        "beads": between(climbs["sizes"]),
        "height (mm)": between(climbs["heights"], 1e3),
        "speed (mm/s)": between(climbs["speeds"], 1e3),
        "median speed (mm/s)": f"{1e3 * np.median(climbs['speeds']):.2g}"
        if climbs["speeds"]
        else "–",
        "guessed": ", ".join(climbs.get("guessed", [])) or "–",
    }


def describe_climbs(climbs: Sequence[Mapping[str, Any]]) -> str:
    """`texts_of` conditions, one below the other, without what does not exist, such as speeds if nothing climbed."""
    texts = map(texts_of, climbs)
    blocks = [
        aligned([[name, text] for name, text in of_one.items() if text != "–"]) for of_one in texts
    ]
    note = f"rates per run and second; in brackets {percent(_CONFIDENCE)} confidence"
    return "\n\n".join([*blocks, note])


def climbing_table(climbs: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """The results of `walkers.api.climb` as a table, SI units: a row for each condition and part of its climbs."""
    import pandas as pd

    rows = []
    for condition in climbs:
        for where, (key, _) in _KINDS.items():
            row = {"condition": condition["condition"], "where": where}
            for name, value in (condition[key] if key else condition).items():
                if name.endswith("interval"):
                    quantity = name.removesuffix("interval").strip("_") or "probability"
                    row |= dict(
                        zip(
                            (f"{quantity}_low", f"{quantity}_high"),
                            value or (np.nan, np.nan),
                            strict=True,
                        )
                    )
                elif not isinstance(value, (dict, list)):
                    row[name] = value
            rows.append(row)
    return pd.DataFrame(rows)


@styled
def climbs_figure(climbs: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw the results of `walkers.api.climb`.

    The first row shows the first condition: the share of piles that have climbed by a time (Kaplan and Meier's
    estimate), and speeds against sizes. Below are the rates of all conditions with their exact 95 % intervals, and the
    number of piles that climbed.
    """
    heights = [1.0, 0.3 + len(climbs) / 6.0]
    mosaic = [["survival", "climbs"], ["rates", "rates"]]
    figure, axes = new_figure(
        TWO_COLUMNS, _ROW * sum(heights), mosaic=mosaic, height_ratios=heights
    )
    curve = climbs[0]["curve"]
    time, share, low, high = (
        np.array(curve[name], dtype=float) for name in ("time", "probability", "low", "high")
    )
    axes["survival"].step(time, share, "k", where="post")
    axes["survival"].fill_between(time, low, high, step="post", color="0.85")
    axes["survival"].set(
        xlabel="time of drive (s)",
        ylabel="share that has climbed",
        ylim=(0.0, 1.02),
        xlim=(0.0, None),
    )
    risen = [climb for climb in climbs[0]["each"] if climb["speed"] is not None]
    for where, (key, look) in list(_KINDS.items())[1:]:
        of_kind = [climb for climb in risen if _is_in_corner(climb) == (key == "in_corners")]
        sizes, speeds = (
            [climb["size"] for climb in of_kind],
            [climb["speed"] * 1e3 for climb in of_kind],
        )
        looks = {
            "markerfacecolor": "none",
            "clip_on": False,
            "in_layout": False,
        }  # without climbs a layout would fail
        axes["climbs"].plot(sizes, speeds, look, label=where, **looks)
    axes["climbs"].set(xlabel="beads", ylabel="speed (mm/s)", xlim=(0.0, None), ylim=(0.0, None))
    _draw_rates(axes["rates"], climbing_table(climbs))
    letter_panels(axes.values())
    figure.legend(
        *axes["rates"].get_legend_handles_labels(), loc="outside lower center", ncols=len(_KINDS)
    )
    return figure


def _is_in_corner(climb: Mapping[str, Any]) -> bool:
    """Whether two or more side walls hold a climb; names of walls may have spaces, such as ``face 4``."""
    return bool(climb["walls"] >= _WALLS_OF_CORNER)


def _draw_rates(panel: Axes, table: pd.DataFrame) -> None:
    """Rates with their exact intervals, one condition above the other."""
    first = table[table["where"] == "all"]
    for number, (where, (_, look)) in enumerate(_KINDS.items()):
        rows = table[table["where"] == where]
        at, rates = (
            np.arange(len(rows)) + 0.2 * (number - 1),
            rows["rate"].astype(float),
        )  # NaN without a drive
        errors = [rates - rows["rate_low"], rows["rate_high"] - rates]
        panel.errorbar(
            rates, at, xerr=errors, fmt=look, label=where, linestyle="none", markersize=3.0
        )
    # With the last word of each key, such as ``frequency 100 Hz``.
    named = [re.sub(r"[\w.\[\]]*?(\w+) = ", r"\1 ", condition) for condition in first["condition"]]
    climbed = zip(named, first["climbed"], first["runs"], strict=True)
    labels = [fill("{}: {}/{} climbed".format(*row), _LETTERS) for row in climbed]
    panel.set_yticks(range(len(labels)), list(map(plain_text, labels)))
    panel.set(xlabel="climbs per run and second", xlim=(0.0, None), ylim=(len(labels) - 0.5, -0.5))


def write_climbs(climbs: Sequence[Mapping[str, Any]], runs: Sequence[str], to: Path) -> None:
    """Write the results of `walkers.api.climb` from ``runs`` as a table (.csv, SI units) or as a figure."""
    if to.suffix == ".csv":
        write_bytes(to, climbing_table(climbs).to_csv(index=False).encode())
    else:
        save_figure(climbs_figure(climbs), to, runs, [to.suffix[1:]], "How often piles climb")
