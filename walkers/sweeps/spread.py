"""What a result is worth: the case run again with all that nobody measured drawn from its ranges."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, astuple, dataclass
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.axes import sampled, unit_cube, unit_of
from walkers.inputs.case import Case
from walkers.inputs.changes import flatten
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.library import unmeasured
from walkers.inputs.origins import Origin
from walkers.inputs.readable import readable_unit
from walkers.inputs.sweep import Sweep
from walkers.postprocess.analysis import analyses
from walkers.postprocess.walking import SEPARATED
from walkers.runner.binary import find_engine
from walkers.runner.directory import run_name
from walkers.sweeps.columns import analyses_of_all, headlines, result_columns, row_of
from walkers.sweeps.run import run_sweep
from walkers.sweeps.scheduler import Failure, Options, SweepProgress

if TYPE_CHECKING:
    import pandas as pd

POINTS = 32
"""Enough for 5 and 95 %, and for ranks that tell what matters most; a power of two, as Sobol's sequence likes it."""
_SEEDS = range(1, 65)
"""Of the scrambling, of which the one is taken whose columns hang together least: of few points in many dimensions some
do by 0.7, and which of two values matters could not be told."""
_LEAST_PER_VALUE = 3
"""Points for each value that is drawn, below which ranks are chance."""
_AT_REST = 2e-5
"""m/s: below, walkers are at rest, as in the sweeps that look for the threshold of motion."""


@dataclass(frozen=True)
class Band:
    """Of a result over the points, SI units: 5, 50 and 95 %, the ends, and how many points gave it."""

    low: float
    median: float
    high: float
    smallest: float
    largest: float
    points: int


@dataclass(frozen=True)
class Spread:
    """What came out over the ranges.

    Attributes
    ----------
    directory
        The sweep's, with a table of all points.
    varied, held
        What was drawn, each from its range; what nobody measured but the case gives, which stayed as it is.
    bands
        Of the results that count, by the columns of the sweep's table; without walkers that came apart.
    depends
        For each of these columns, rank correlations (Spearman) with what was drawn, the strongest first; only those
        beyond two standard errors of none.
    counts
        Of points: ``forward`` (toward the large bead), ``backward``, ``at_rest``, ``separated``; of piles none.
    failures
        Points that failed; they are in no band.
    """

    directory: Path
    varied: tuple[Origin, ...]
    held: tuple[Origin, ...]
    bands: Mapping[str, Band]
    depends: Mapping[str, Mapping[str, float]]
    counts: Mapping[str, int]
    failures: tuple[Failure, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types, SI units."""
        return {
            **{key: value for key, value in asdict(self).items() if key != "failures"},
            "directory": str(self.directory),
            "failed": len(self.failures),
        }


def uncertain(case: Case) -> tuple[Origin, ...]:
    """The values of a case that may lie elsewhere: guessed, calibrated, or called uncertain."""
    return tuple(one for one in case.origins if one.range is not None)


def spread_sweep(case: Case, points: int = POINTS, engine: str | None = None) -> Sweep:
    """A sweep over all that is uncertain in a case: Sobol's sequence, scrambled so that its columns are least alike.

    Raises
    ------
    InputError
        If nothing in it is, or the case was changed after it was read.
    """
    if not case.as_read:
        told = "was changed after it was read; expected a case as load_case(name, changes) gives it"
        raise InputError(case.name, [Problem("", None, told)])
    varied = uncertain(case)
    if not varied:
        told = "nothing here is uncertain: say ranges in [uncertain], such as contact.restitution = [0.2, 0.8]"
        raise InputError(case.name, [Problem("", None, told)])
    ranges = {one.key: {"loguniform" if one.logarithmic else "uniform": list(one.range or ())} for one in varied}
    seed = min(_SEEDS, key=lambda one: _likeness(one, points, len(varied)))
    axis = sampled("sobol", points, seed, ranges)
    units = tuple(unit_of(key, [row[number] for row in axis.rows]) for number, key in enumerate(axis.keys))
    return Sweep(
        name=f"{run_name(case, find_engine(engine))}-spread",
        title=f"{case.title or case.name}: what nobody measured, over its ranges",
        source=case.name,
        case_name=case.name,
        document=case.document,
        keys=axis.keys,
        units=units,
        rows=axis.rows,
        descent=None,
        file={
            "case": case.name,
            "set": flatten(case.document, lambda _: False),
            "sample": [{"method": "sobol", "points": points, "seed": seed, "ranges": ranges}],
        },
    )


def _likeness(seed: int, points: int, dimensions: int) -> float:
    """Largest correlation of two columns of the sampler's points."""
    import numpy as np

    if dimensions < 2:
        return 0.0
    cube = unit_cube("sobol", dimensions, points, seed)
    return float(np.abs(np.corrcoef(cube.T) - np.eye(dimensions)).max())


def run_spread(
    case: Case,
    out: Path,
    options: Options,
    *,
    points: int = POINTS,
    engine: str | None = None,
    allow_failed_audit: bool = False,
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> Spread:
    """Run a case with all that nobody measured drawn from its ranges.

    Parameters
    ----------
    case
        Read from a file: its own values say what is uncertain (`uncertain`).
    out, options, engine, allow_failed_audit, on_progress
        As for `walkers.sweeps.run.run_sweep`.
    points
        How many.

    Raises
    ------
    InputError
        If nothing in the case is uncertain, or a point cannot be used.
    runner.EngineFailure
        If there is no engine, or its audit failed.

    Notes
    -----
    Each value is drawn by itself. Those of a calibration hang together (docs/explanation/calibration.md), so that the
    band of a calibrated case is wider than that of its posterior.
    """
    from walkers.sweeps.table import load

    sweep = spread_sweep(case, points, engine)
    record, failures = run_sweep(
        sweep, out, options, engine=engine, allow_failed_audit=allow_failed_audit, on_progress=on_progress
    )
    table = load(record.directory)
    table = table[table["status"] == "finished"]
    together = table[~(table["separated_fraction"] > SEPARATED)] if "velocity" in table else table
    names = analyses_of_all([case])
    shown = [name for name in headlines(names) if name in result_columns(names)]
    return Spread(
        directory=record.directory,
        varied=uncertain(case),
        held=tuple(one for one in case.origins if one.key in unmeasured() and one.range is None),
        bands={name: _band(together[name]) for name in shown if together[name].notna().any()},
        depends={name: _ranks(together, name, sweep.keys) for name in shown},
        counts=_counts(together, len(table)) if "velocity" in table else {},
        failures=tuple(failures),
    )


def _band(values: pd.Series[float]) -> Band:
    given = values.dropna().astype(float)
    low, median, high = (float(given.quantile(share)) for share in (0.05, 0.5, 0.95))
    return Band(low, median, high, float(given.min()), float(given.max()), len(given))


def _ranks(table: pd.DataFrame, name: str, keys: tuple[str, ...]) -> dict[str, float]:
    """Rank correlations of a column with each key, the strongest first, if they are more than chance."""
    given = table[table[name].notna()]
    if len(given) < _LEAST_PER_VALUE * len(keys) or given[name].nunique() < 2:
        return {}
    ranks = {key: float(given[key].rank().corr(given[name].rank())) for key in keys}
    certain = {key: rank for key, rank in ranks.items() if abs(rank) > 2.0 / sqrt(len(given) - 1)}
    return dict(sorted(certain.items(), key=lambda one: -abs(one[1])))


def _counts(together: pd.DataFrame, points: int) -> dict[str, int]:
    return {
        "forward": int((together["velocity"] > _AT_REST).sum()),
        "backward": int((together["velocity"] < -_AT_REST).sum()),
        "at_rest": int((together["velocity"].abs() <= _AT_REST).sum()),
        "separated": points - len(together),
    }


_WORDS = {
    "forward": "walk toward the large bead",
    "backward": "walk toward the small one",
    "at_rest": "rest (below 0.02 mm/s)",
    "separated": "come apart",
}
_DIGITS = 5
"""After the point, of what is shown: less than 1e-5 mm/s is 0."""


def describe(spread: Spread, result: Mapping[str, Any] | None = None) -> str:
    """A spread in a few lines: mm, mm/s; with the result of the case itself, whether that lies outside the band."""
    own = row_of(result) if result else {}
    points = max((band.points for band in spread.bands.values()), default=0)
    lines = [f"  spread     over {points} points, each of these drawn from its range by itself:"]
    lines += [f"             {one.key} {one.range[0]} to {one.range[1]}" for one in spread.varied if one.range]
    if spread.held:
        told = ", ".join(f"{one.key} {one.text}" for one in spread.held)
        lines.append(f"    as given {told}: to be drawn too, they need ranges in [uncertain]")
    for name in spread.bands:
        lines += _lines_of_band(spread, name, own.get(name))
    found = [f"{count} {_WORDS[name]}" for name, count in spread.counts.items() if count]
    found += [f"{len(spread.failures)} failed"] if spread.failures else []
    lines += [f"    of these {', '.join(found)}"] if found else []
    return "\n".join([*lines, f"    table    {spread.directory}"])


def _lines_of_band(spread: Spread, name: str, own: float | None) -> list[str]:
    band = spread.bands[name]
    unit, size = readable_unit(result_columns([one.name for one in analyses()])[name][0])
    low, median, high, smallest, largest = (f"{round(value / size, _DIGITS):.3g}" for value in astuple(band)[:5])
    lines = [f"{low} to {high} {unit} (5 to 95 %), median {median}; smallest {smallest}, largest {largest}"]
    if own is not None and not band.low <= own <= band.high:
        side = "above" if own > band.high else "below"
        lines.append(f"the case's own lies {side} that: some of its values stand at the end of their ranges")
    ranks = ", ".join(f"{key} {rank:+.2f}" for key, rank in spread.depends[name].items())
    if band.points < _LEAST_PER_VALUE * len(spread.varied):
        lines.append("too few points to say on what it depends, and for more than a rough band")
    else:
        lines.append(f"depends most on {ranks} (rank correlation)" if ranks else "on none of them clearly")
    return [f"{begin:13}{line}" for begin, line in zip([f"    {name}", *[""] * len(lines)], lines, strict=False)]
