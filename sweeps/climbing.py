"""How often, how soon, how fast and led by whom: climbs over the runs of piles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.errors import InputError, Problem
from walkers.postprocess.clusters import Climb, ClimbCriteria
from walkers.postprocess.piles import Pile, analyse, classified
from walkers.runner.directory import CASE_NAME, MANIFEST_NAME, finished_run
from walkers.runner.files import read_json
from walkers.sweeps.record import RECORD_NAME, read_record, result_in, states

_CONFIDENCE = 0.95
_NO_CONDITION = ("name", "title", "seed")
"""Keys of a case that are none of a condition under which a pile is shaken."""


def piles_in(directory: Path) -> dict[str, list[Path]]:
    """The finished runs of piles of a sweep, or in a folder, or the run itself, by what they have in common.

    Returns
    -------
    dict
        From what distinguishes them, the seed aside, to the runs; each run once, whatever names it has.

    Raises
    ------
    InputError
        If there is none, or one cannot be read.
    """
    if (directory / RECORD_NAME).exists():
        found = [state.directory for state in states(read_record(directory)) if state.directory is not None]
    elif (directory / CASE_NAME).exists():
        found = [directory]
    else:
        found = sorted(path.parent for path in directory.glob(f"*/{MANIFEST_NAME}"))
    runs = [run for path in found if (run := finished_run(path)) is not None]
    try:
        piles = {run.directory.name.rpartition("-")[2]: run for run in runs if Pile().applies(run.case)}
        cases = {run.directory: _conditions(read_json(run.directory / CASE_NAME)) for run in piles.values()}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(str(directory), [Problem("", None, f"a case cannot be read ({error})")]) from error
    if not cases:
        raise InputError(str(directory), [Problem("", None, "expected a finished run of a pile, or a folder or sweep")])
    keys = dict.fromkeys(key for case in cases.values() for key in case if key not in _NO_CONDITION)
    differ = [key for key in keys if len({str(case.get(key)) for case in cases.values()}) > 1]
    groups: dict[str, list[Path]] = {}
    for path, case in cases.items():
        groups.setdefault(", ".join(f"{key} = {_short(case.get(key))}" for key in differ), []).append(path)
    return groups


def _conditions(value: Any, key: str = "") -> dict[str, Any]:
    """Dotted keys of a resolved case, entries of lists of tables one by one."""
    if isinstance(value, Mapping):
        parts = {f"{key}.{name}" if key else name: one for name, one in value.items()}
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        parts = {f"{key}[{number}]": one for number, one in enumerate(value)}
    else:
        return {key: value}
    return {name: one for part, within in parts.items() for name, one in _conditions(within, part).items()}


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def summarise_climbs(runs: Sequence[Path], within: float | None = None) -> dict[str, Any]:
    """Climbs over several runs that differ by their seeds alone.

    Parameters
    ----------
    runs
        Run directories of piles.
    within
        Seconds of drive; climbs that begin later do not count, and runs that are shorter are left out.

    Returns
    -------
    dict
        ``runs``, ``climbed`` (runs with a climb), ``probability`` with its binomial ``interval`` (95 %, Clopper and
        Pearson 1934), ``climbs``, ``onsets`` (s, of the first climb of each run), ``speeds`` (m/s), ``sizes``,
        ``led_by_large``, ``in_corners``.
    """
    from scipy.stats import binomtest

    results = [result_in(run) for run in runs]
    seconds = within if within is not None else min(result["driven"] for result in results)
    results = [result for result in results if result["driven"] >= seconds * (1.0 - 1e-6)]
    counted = [[climb for climb in result["climbs"] if climb["begin"] <= seconds] for result in results]
    climbed = sum(bool(climbs) for climbs in counted)
    every = [climb for climbs in counted for climb in climbs]
    chance = binomtest(climbed, len(results)) if results else None
    interval = chance.proportion_ci(_CONFIDENCE) if chance else None
    return {
        "within": seconds,
        "runs": len(results),
        "climbed": climbed,
        "probability": climbed / len(results) if results else None,
        "interval": [float(interval.low), float(interval.high)] if interval else None,
        "climbs": len(every),
        "onsets": [min(climb["begin"] for climb in climbs) for climbs in counted if climbs],
        "speeds": [climb["speed"] for climb in every if climb["speed"] is not None],
        "in_corners": sum(len(climb["walls"]) > 1 for climb in every),
        "sizes": [climb["size"] for climb in every],
        "led_by_large": sum(climb["leader_large"] for climb in every),
    }


VARIATIONS = {
    "min_rise": (1e-3, 2e-3, 3e-3, 5e-3),
    "max_gap": (0.03, 0.1, 0.2),
    "min_overlap": (0.3, 0.5, 0.7),
}
"""Other thresholds of `walkers.postprocess.clusters.ClimbCriteria`, tried one at a time."""


def sensitivity(runs: Sequence[Path]) -> list[dict[str, Any]]:
    """How the outcome depends on the thresholds of what counts as a climb.

    Parameters
    ----------
    runs
        Run directories of piles.

    Returns
    -------
    list of dict
        One row per definition, the usual one first: ``threshold`` and ``value`` (empty and None for the usual one),
        ``runs``, ``climbed`` (runs with a climb), ``climbs``, ``led_by_large``, ``median_speed`` (m/s).
    """
    usual = ClimbCriteria()
    tried: list[tuple[str, float | None, ClimbCriteria]] = [("", None, usual)]
    for name, values in VARIATIONS.items():
        tried += [(name, value, replace(usual, **{name: value})) for value in values if value != getattr(usual, name)]
    counted: list[list[list[Climb]]] = [[] for _ in tried]
    larges: list[npt.NDArray[np.bool_]] = []
    for run in runs:
        found = analyse(run)
        larges.append(found.motion.large)
        for climbs, (_, _, definition) in zip(counted, tried, strict=True):
            climbs.append([climb for climb in classified(found, definition).climbs if climb.climbed])
    rows = []
    for climbs, (name, value, _) in zip(counted, tried, strict=True):
        speeds = [climb.speed for one in climbs for climb in one]
        led = sum(bool(large[climb.leader]) for one, large in zip(climbs, larges, strict=True) for climb in one)
        rows.append(
            {
                "threshold": name,
                "value": value,
                "runs": len(runs),
                "climbed": sum(bool(one) for one in climbs),
                "climbs": len(speeds),
                "led_by_large": led,
                "median_speed": float(np.median(speeds)) if speeds else None,
            }
        )
    return rows


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
    """`summarise_climbs` as text; mm/s."""
    if not found["runs"]:
        return f"no run is as long as {found['within']:g} s"
    low, high = found["interval"]
    lines = [
        f"{found['climbed']} of {found['runs']} runs climbed within {found['within']:.3g} s: probability "
        f"{found['probability']:.2f} ({low:.2f} to {high:.2f} with {_CONFIDENCE:.0%} confidence)"
    ]
    if found["climbs"]:
        speeds, onsets = np.array(found["speeds"]) * 1e3, np.array(found["onsets"])
        sizes = ", ".join(f"{size}: {found['sizes'].count(size)}" for size in sorted(set(found["sizes"])))
        lines += [
            f"  climbs     {found['climbs']}, led by a large bead {found['led_by_large']}, "
            f"in a corner {found['in_corners']}",
            f"  onset      {onsets.min():.2f} to {onsets.max():.2f} s, median {np.median(onsets):.2f} s",
            f"  speed      {speeds.min():.2f} to {speeds.max():.2f} mm/s, median {np.median(speeds):.2f} mm/s",
            f"  clusters   beads: how many   {sizes}",
        ]
    return "\n".join(lines)
