"""Spread of a result: the case with all unmeasured values drawn from their ranges."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, check_limits, input_error, key_error
from walkers.files import write_json
from walkers.inputs.axes import Range, ranges_of, unit_cube, value_in_unit
from walkers.inputs.messages import attributed_to
from walkers.inputs.origins import Origin
from walkers.inputs.sweep import SweepDefinition, expand
from walkers.inputs.tables.case import Case
from walkers.inputs.units import parse_quantity
from walkers.postprocess.measure.numbers import MAIN
from walkers.postprocess.measure.quantities import declared, unit_shown
from walkers.postprocess.measure.sides import REST
from walkers.postprocess.measure.uncertainty import (
    SPREAD_NAME,
    few_draws,
    held_of,
    held_text,
    in_lines,
    spread_of,
)
from walkers.progress import Tell
from walkers.rounding import counted, rounded
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import run_place
from walkers.runs.case_text import quantity_kind
from walkers.sweeps.correlations import rank_correlations
from walkers.sweeps.figure import figure_of
from walkers.sweeps.left_out import LeftOutWarning
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.table import main_columns, table_of, walking_points
from walkers.sweeps.workers import Failure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

POINTS = 32
"""Enough points for 5 and 95 %, and for the strongest rank correlations; a power of two, for Sobol's sequence."""
_SEEDS = range(1, 65)
"""Seeds of the scrambling; the one with the least correlated columns is used. With few points in many dimensions,
correlations of columns reach 0.7, and the influences of the values could not be separated."""
_WORDS = {
    "forward": "walk along the heading",
    "backward": "walk against the heading",
    "at_rest": f"rest (below {1e3 * REST:g} mm/s)",
    "separated": "come apart",
}
_ON_A_SLOPE = {"forward": "go up the slope", "backward": "go down"}


@dataclass(frozen=True)
class Spread:
    """Results of a spread, in the directory of its sweep.

    ``varied`` are the values that were drawn from their ranges, ``held`` those of the liquid and unmeasured ones that
    have no range (`walkers.postprocess.measure.uncertainty.held_of`).
    ``bands`` has percentiles of the main results by the columns of the sweep's table (``low``, ``median`` and ``high``
    for 5, 50 and 95 %), their ``smallest`` and ``largest`` values (SI units), and numbers of ``points``, without
    walkers that came apart; ``depends`` has their rank correlations (Spearman) with the drawn values, the strongest
    first, if larger than two standard errors.
    ``counts`` are numbers of points whose walkers go ``forward`` (along the heading), …; empty for piles.
    ``doubts`` are the warnings of each point that has any.
    """

    directory: Path
    varied: tuple[Origin, ...]
    held: tuple[Origin, ...]
    bands: Mapping[str, Mapping[str, float]]
    depends: Mapping[str, Mapping[str, float]]
    counts: Mapping[str, int]
    failures: tuple[Failure, ...]
    doubts: Sequence[Sequence[str]] = ()

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types, SI units."""
        contents = asdict(self) | {"directory": str(self.directory), "failed": len(self.failures)}
        del contents["failures"]
        return contents


def _range_of(value: Origin) -> dict[str, list[Any]]:
    """The range of a value for the sampler of a sweep; half of the draws are at or below the value of the case."""
    name, (low, high) = (
        "loguniform" if value.logarithmic else "uniform",
        value.range or (None, None),
    )
    ends: Range = ranges_of({value.key: {name: [low, high]}})[value.key]
    kind = quantity_kind(value.key)
    try:
        unit = parse_quantity(f"1 {ends.unit}", kind) if kind and ends.unit else 1.0
        usual = (
            parse_quantity(value.text, kind) if kind and ends.unit else float(value.text)
        ) / unit
    except ValueError:  # a value that the program computes, such as a time step
        return {name: [low, high]}
    if not ends.low * (1.0 - 1e-9) <= usual <= ends.high * (1.0 + 1e-9):
        message = f"expected a range that holds the case's own value, {value.text}"
        raise key_error(f"uncertain.{value.key}", message, [low, high])
    return {name: [low, value_in_unit(min(max(usual, ends.low), ends.high), ends.unit), high]}


def spread_sweep(case: Case, points: int = POINTS, engine: str | None = None) -> SweepDefinition:
    """A sweep over the uncertain values of a case by Sobol's sequence, scrambled for the least correlated columns.

    Half of the draws are at or below the value of the case. `InputError` if no value is uncertain, a range does not
    contain the value of the case, or there are not 2 to 4096 points.
    """
    import numpy as np

    check_limits("points", points, 2, 4096)
    varied = [value for value in case.origins if value.range is not None]
    if not varied:
        message = "no value is uncertain: give ranges in [uncertain], such as contact.restitution = [0.2, 0.8]"
        raise input_error(case.name, message)
    with attributed_to(case.name, case.document):
        ranges = {value.key: _range_of(value) for value in varied}

    def likeness(seed: int) -> float:
        cube = unit_cube(len(varied), points, seed)
        return float(np.abs(np.corrcoef(cube.T) - np.eye(len(varied))).max())

    seed = min(_SEEDS, key=likeness) if len(varied) > 1 else _SEEDS[0]
    file = {
        "title": f"{case.title or case.name}: uncertain values drawn from their ranges",
        "case": case.name,
        "sample": [{"method": "sobol", "points": points, "seed": seed, "ranges": ranges}],
    }
    name = spread_of(run_place(case, find_engine(engine), Path())).name
    return expand(file, source=case.name, name=name, base=(case.name, case.document))


def run_spread(
    case: Case,
    out: Path,
    options: SweepOptions,
    *,
    points: int = POINTS,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> Spread:
    """Run a case with all unmeasured values drawn from their ranges, and write the bands beside the sweep's record.

    The case must be as read from a file. Runs that are made keep no dumps, which only pictures need. Other arguments:
    see `walkers.sweeps.scheduler.run_sweep`. From then on, texts and reports of the case's run contain the bands.

    Notes
    -----
    Values are drawn independently. Calibrated values are correlated (docs/explanation/calibration.md): for them, the
    band is wider than that of the posterior.
    """
    options = replace(options, dumps=False)
    draws = spread_sweep(case, points, engine)
    record, failures = run_sweep(draws, out, options, engine=engine, on_progress=on_progress)
    table = table_of(record)
    doubts = [result.warnings for result in table.results.values() if result.warnings]
    spread = replace(spread_in(table.frame, case, record.directory, failures), doubts=doubts)
    write_json(
        record.directory / SPREAD_NAME, {**spread.as_dict(), "directory": record.directory.name}
    )
    return spread


def spread_in(
    table: pd.DataFrame, case: Case, directory: Path, failures: Sequence[Failure] = ()
) -> Spread:
    """The spread of a case by the table of its sweep in a directory."""
    table = table[table["status"] == "finished"]
    whole, counts = walking_points(table), {}
    if "velocity" in table:
        speeds = whole[main_columns(whole)[0]]
        counts = {"forward": int((speeds > REST).sum()), "backward": int((speeds < -REST).sum())}
        counts |= {
            "at_rest": int((speeds.abs() <= REST).sum()),
            "separated": len(table) - len(whole),
        }
    shown = (
        [main_columns(whole)[0]]
        if "velocity" in table
        else [name for name in MAIN if name in table]
    )
    varied, bands = tuple(value for value in case.origins if value.range is not None), {}
    for name in (name for name in shown if whole[name].notna().any()):
        ends = whole[name].astype(float).quantile([0.05, 0.5, 0.95, 0.0, 1.0])
        bands[name] = dict(
            zip(("low", "median", "high", "smallest", "largest"), ends.tolist(), strict=True)
        )
        bands[name]["points"] = int(whole[name].count())
    return Spread(
        directory=directory,
        varied=varied,
        held=held_of(case.origins),
        bands=bands,
        depends={
            name: rank_correlations(whole, name, [value.key for value in varied]) or {}
            for name in shown
        },
        counts=counts,
        failures=tuple(failures),
    )


def figures_of_spread(run: Path) -> dict[str, Figure]:
    """The figure of the spread of a run, for its report; none if it has no spread, or no draw is finished."""
    directory = spread_of(run.resolve())
    if (directory / SPREAD_NAME).is_file():
        with suppress(InputError), warnings.catch_warnings():
            warnings.simplefilter("ignore", LeftOutWarning)
            return {"spread": figure_of(table_of(read_sweep_record(directory)))}
    return {}


def spread_text(spread: Spread) -> str:
    """A spread in a few lines: mm, mm/s."""
    points = max((band["points"] for band in spread.bands.values()), default=0)
    half = "half of them at or below the value of the case"
    lines = [f"  spread     {points} draws; values drawn independently from their ranges, {half}"]
    lines += [
        f"{'':13}{value.key} {value.text} ({' to '.join(map(str, value.range or ()))})"
        for value in spread.varied
    ]
    lines += in_lines(f"    fixed    {held_text(spread.held)}")
    for name, band in spread.bands.items():
        unit, factor = unit_shown(declared(name).unit)
        texts = {
            end: rounded(float(f"{number * factor:.3g}"), unit) for end, number in band.items()
        }
        ends = "{low} to {high} {unit} (5 to 95 %), median {median}; smallest {smallest}, largest {largest}"
        lines.append(f"    {declared(name).label:8} {ends.format(unit=unit, **texts)}")
        text = "no clear dependence on any of them"
        if few_draws(int(band["points"]), len(spread.varied)):
            text = "too few draws for rank correlations; the band is approximate"
        elif ranks := ", ".join(f"{key} {rank:+.2f}" for key, rank in spread.depends[name].items()):
            text = f"strongest dependence: {ranks} (rank correlation)"
        lines.append(f"{'':13}{text}")
    words = _WORDS | (
        _ON_A_SLOPE if {"right_facing", "axial_velocity"} & spread.bands.keys() else {}
    )
    draws = [f"{count} {words[name]}" for name, count in spread.counts.items() if count]
    draws += [f"{len(spread.failures)} failed, not in the band"] if spread.failures else []
    lines += [f"    draws    {', '.join(draws)}"] if draws else []
    if spread.doubts:
        lines += in_lines(
            f"    warning  {counted(len(spread.doubts), 'draw')} with warnings, first: {spread.doubts[0][0]}"
        )
    return "\n".join([*lines, f"    table    {spread.directory}"])
