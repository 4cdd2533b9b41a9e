"""Spread of a result: the case with all unmeasured values drawn from their ranges.

A *draw* is one run of the case with a value from each range; the *band* of a result goes from the
5th to the 95th percentile of the draws.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import InputError, check_limits, input_error, key_error
from walkers.files import read_json, write_json
from walkers.inputs.axes import ranges_of, unit_cube, value_in_unit
from walkers.inputs.messages import attributed_to
from walkers.inputs.origins import Origin
from walkers.inputs.sweep import SweepDefinition, expand
from walkers.inputs.tables.case import Case
from walkers.inputs.units import parse_quantity, unit_factor, with_symbols
from walkers.postprocess.measure.numbers import MAIN_NUMBERS
from walkers.postprocess.measure.quantities import declared, unit_shown
from walkers.postprocess.measure.sides import REST
from walkers.postprocess.measure.uncertainty import (
    SPREAD_NAME,
    SPREAD_TITLE,
    few_draws,
    fixed_values,
    fixed_values_text,
    spread_of,
    wrapped_lines,
)
from walkers.progress import Tell
from walkers.rounding import counted, rounded
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import run_place
from walkers.runs.case_text import quantity_kind
from walkers.runs.draws import Draws, Unknown
from walkers.sweeps.correlations import rank_correlations
from walkers.sweeps.figure import figure_of
from walkers.sweeps.left_out import LeftOutWarning
from walkers.sweeps.record import read_sweep_record, states
from walkers.sweeps.scheduler import (
    SweepOptions,
    SweepPlan,
    plan_sweep,
    recorded_failures,
    run_sweep,
)
from walkers.sweeps.table import main_columns, table_of, walking_points
from walkers.sweeps.workers import Failure
from walkers.warning import warn_user

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

POINTS = 32
"""Default number of draws: enough for 5 and 95 %, and for the strongest rank correlations.

It is a power of two, as Sobol's sequence needs.
"""
_SEEDS = range(1, 65)
"""Seeds of the scrambling, of which the one with the least correlated columns is used.

With few points in many dimensions, correlations of columns reach 0.7, and the influences of the
values could not be separated.
"""
_ROUNDING = 1e-9
"""Relative distance by which the value of a case may be outside of its range."""
_OUTCOMES = {
    "forward": "walk along the heading",
    "backward": "walk against the heading",
    "at_rest": f"rest (below {1e3 * REST:g} mm/s)",
    "separated": "come apart",
}
"""What walkers do, by the keys of `Spread.counts`."""
_OUTCOMES_ON_A_SLOPE = {**_OUTCOMES, "forward": "go up the slope", "backward": "go down"}
"""The same for walkers on a slope."""
_INDENT = " " * 13
"""Start of the lines below a heading."""


@dataclass(frozen=True)
class Spread:
    """Results of a spread.

    Attributes
    ----------
    directory
        Directory of the sweep.
    varied
        Values that were drawn from their ranges.
    held
        Values of the liquid, and unmeasured ones, that have no range
        (`walkers.postprocess.measure.uncertainty.fixed_values`).
    bands
        For each main result, by its column in the sweep's table, without walkers that came apart:
        percentiles (``low``, ``median`` and ``high`` for 5, 50 and 95 %), the ``smallest`` and the
        ``largest`` value, in SI units, and the number of ``points``.
    depends
        Rank correlations (Spearman) of the main results with the drawn values, the strongest first,
        if larger than two standard errors.
    counts
        Numbers of points whose walkers go ``forward`` or ``backward`` along the heading, are
        ``at_rest``, or have ``separated``; empty for piles.
    failures
        The failed points.
    doubts
        The warnings of each point that has any.
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
        contents = asdict(self)
        contents["directory"] = str(self.directory)
        contents["failed"] = len(self.failures)
        del contents["failures"]
        return contents


def check_number_of_draws(points: int, name: str = "points") -> None:
    """Raise `InputError` if a number of draws is out of its limits, 2 to 4096.

    Parameters
    ----------
    points
        The number.
    name
        Name of the argument that gives it.
    """
    check_limits(name, points, 2, 4096, whole=True)


def spread_sweep(case: Case, points: int = POINTS, engine: str | None = None) -> SweepDefinition:
    """A sweep over the uncertain values of a case by Sobol's sequence.

    The value of the case is the median of the draws. The sequence is scrambled for the least
    correlated columns.

    Parameters
    ----------
    case
        The case.
    points
        Number of draws, 2 to 4096.
    engine
        The engine that names the run of the case; None: the installed one.

    Raises
    ------
    InputError
        If no value is uncertain, a range does not contain the value of the case, or the number of
        points is out of its limits.
    """
    check_number_of_draws(points)
    varied = _uncertain_values(case)
    if not varied:
        raise input_error(
            case.name,
            "no value is uncertain: give ranges in [uncertain], such as "
            "contact.restitution = [0.2, 0.8]",
        )
    with attributed_to(case.name, case.document):
        ranges = {value.key: _range_of(value) for value in varied}
    sample = {
        "method": "sobol",
        "points": points,
        "seed": _least_correlated_seed(len(varied), points),
        "ranges": ranges,
    }
    file = {
        "title": f"{case.title or case.name}{SPREAD_TITLE}",
        "case": case.name,
        "sample": [sample],
    }
    name = spread_of(run_place(case, find_engine(engine), Path())).name
    return expand(file, source=case.name, name=name, base=(case.name, case.document))


def _uncertain_values(case: Case) -> list[Origin]:
    """The values of a case that have a range."""
    return [value for value in case.origins if value.range is not None]


def _range_of(value: Origin) -> dict[str, list[Any]]:
    """The range of an uncertain value for the sampler of a sweep, with the value as the median.

    The range of a value that the program computes, such as a time step, has no median.

    Raises
    ------
    InputError
        If the range does not contain the value.
    """
    assert value.range is not None
    low, high = value.range
    distribution = "loguniform" if value.logarithmic else "uniform"
    ends = ranges_of({value.key: {distribution: [low, high]}})[value.key]
    try:
        usual = _number_in_unit(value, ends.unit)
    except ValueError:  # a word, such as "auto", in place of a number
        return {distribution: [low, high]}
    if not ends.low * (1.0 - _ROUNDING) <= usual <= ends.high * (1.0 + _ROUNDING):
        message = f"expected a range that holds the case's own value, {value.text}"
        raise key_error(f"uncertain.{value.key}", message, [low, high])
    median = min(max(usual, ends.low), ends.high)
    return {distribution: [low, value_in_unit(median, ends.unit), high]}


def _number_in_unit(value: Origin, unit: str | None) -> float:
    """The number of a value in a unit; `ValueError` if its text is not a number."""
    kind = quantity_kind(value.key)
    if kind and unit:
        return parse_quantity(value.text, kind) / parse_quantity(f"1 {unit}", kind)
    return float(value.text)


def _least_correlated_seed(values: int, points: int) -> int:
    """The seed for which the draws of the values are least correlated with each other."""

    def largest_correlation(seed: int) -> float:
        cube = unit_cube(values, points, seed)
        return float(np.abs(np.corrcoef(cube.T) - np.eye(values)).max())

    if values == 1:
        return _SEEDS[0]
    return min(_SEEDS, key=largest_correlation)


def plan_spread(
    case: Case,
    out: Path,
    options: SweepOptions,
    *,
    points: int = POINTS,
    engine: str | None = None,
) -> SweepPlan:
    """Plan the draws of the spread of a case; nothing is written.

    The arguments and the errors are those of `run_spread`.
    """
    return plan_sweep(spread_sweep(case, points, engine), out, _options_of_draws(options), engine)


def _options_of_draws(options: SweepOptions) -> SweepOptions:
    """Options of a sweep for the draws of a spread."""
    return replace(options, dumps=False, own_runs=True)


def run_spread(  # noqa: PLR0913
    case: Case,
    out: Path,
    options: SweepOptions,
    *,
    points: int = POINTS,
    engine: str | None = None,
    on_progress: Tell | None = None,
) -> Spread:
    """Run a case with all unmeasured values drawn from their ranges.

    The bands of the results are written beside the sweep's record. From then on, texts and reports
    of the case's run contain them.

    Parameters
    ----------
    case
        The case as read from a file.
    out
        Folder of the run directories.
    options
        How the runs are made. They keep no dumps, which only pictures need, and are made in the
        directory of the spread.
    points
        Number of draws, see `spread_sweep`.
    engine, on_progress
        As for `walkers.sweeps.scheduler.run_sweep`.

    Returns
    -------
    Spread
        The bands, with the failures and the warnings of the draws.

    Raises
    ------
    InputError
        As by `spread_sweep`.
    EngineFailure, SweepStopped
        As by `walkers.sweeps.scheduler.run_sweep`.

    Warns
    -----
    UserWarning
        If the band of more draws is replaced. These draws are kept.

    Notes
    -----
    Values are drawn independently. Calibrated values are correlated
    (docs/explanation/calibration.md): for them, the band is wider than that of the posterior.
    """
    sweep = spread_sweep(case, points, engine)
    _warn_of_fewer_draws(out / sweep.name, case.name, points)
    record, failures = run_sweep(
        sweep,
        out,
        _options_of_draws(options),
        engine=engine,
        on_progress=on_progress,
    )
    table = table_of(record)
    doubts = [result.warnings for result in table.results.values() if result.warnings]
    spread = spread_in(table.frame, case, record.directory, failures)
    spread = replace(spread, doubts=doubts)
    contents = {**spread.as_dict(), "directory": record.directory.name}
    write_json(record.directory / SPREAD_NAME, contents)
    return spread


def _warn_of_fewer_draws(directory: Path, case_name: str, points: int) -> None:
    """Warn if the band of so many draws replaces one of more draws.

    Parameters
    ----------
    directory
        Directory of the spread.
    case_name
        Name of the case.
    points
        Number of draws.
    """
    try:
        bands = read_json(directory / SPREAD_NAME)["bands"].values()
        points_before = len(read_sweep_record(directory).runs)
    except (InputError, OSError, ValueError, KeyError, TypeError, AttributeError):
        return  # there is no band, or it cannot be read
    if bands and points_before > points:
        warn_user(
            f"{case_name}: the band of {points} draws replaces that of {points_before} draws, "
            f"which are kept: {points_before} points give their band again"
        )


def spread_in(
    table: pd.DataFrame, case: Case, directory: Path, failures: Sequence[Failure] = ()
) -> Spread:
    """The spread of a case, from the table of its sweep.

    Parameters
    ----------
    table
        The table of the sweep, finished or not.
    case
        The case.
    directory
        Directory of the sweep.
    failures
        The failed points.
    """
    finished = table[table["status"] == "finished"]
    not_separated = walking_points(finished)
    if "velocity" in table:
        names = [main_columns(not_separated)[0]]  # the headline velocity of these walkers
        counts = _counts_of_outcomes(finished, not_separated, names[0])
    else:
        names = [name for name in MAIN_NUMBERS if name in table]
        counts = {}
    varied = _uncertain_values(case)
    keys = [value.key for value in varied]
    bands = {}
    depends = {}
    for name in names:
        if not_separated[name].notna().any():
            bands[name] = _band_of(not_separated[name])
        # Without entries if the draws are too few, or nothing correlates significantly.
        depends[name] = rank_correlations(not_separated, name, keys) or {}
    return Spread(
        directory=directory,
        varied=tuple(varied),
        held=fixed_values(case.origins),
        bands=bands,
        depends=depends,
        counts=counts,
        failures=tuple(failures),
    )


def _counts_of_outcomes(
    finished: pd.DataFrame, not_separated: pd.DataFrame, velocity: str
) -> dict[str, int]:
    """Numbers of draws by what their walkers do.

    Parameters
    ----------
    finished
        Rows of all finished draws.
    not_separated
        Those of draws whose walkers did not come apart.
    velocity
        The column of the velocity.
    """
    speeds = not_separated[velocity]
    return {
        "forward": int((speeds > REST).sum()),
        "backward": int((speeds < -REST).sum()),
        "at_rest": int((speeds.abs() <= REST).sum()),
        "separated": len(finished) - len(not_separated),
    }


def _band_of(numbers: pd.Series) -> dict[str, float]:
    """Percentiles 5, 50 and 95, smallest and largest of the numbers of a result (`Spread.bands`).

    ``points`` is how many of them are not NaN.
    """
    ends = numbers.astype(float).quantile([0.05, 0.5, 0.95, 0.0, 1.0])
    names = ("low", "median", "high", "smallest", "largest")
    band = dict(zip(names, ends.tolist(), strict=True))
    band["points"] = int(numbers.count())
    return band


def read_spread(run: Path) -> Spread | None:
    """The spread of a run as `run_spread` has left it.

    None if the run has no spread, or its files cannot be read.

    Parameters
    ----------
    run
        The run directory.
    """
    directory = spread_of(run.resolve())
    try:
        contents = read_json(directory / SPREAD_NAME)
        record = read_sweep_record(directory)
        point_states = states(record)
        reasons = {state.reason for state in point_states if state.reason}
        return Spread(
            directory=run.with_name(directory.name),
            varied=tuple(_origin_of(value) for value in contents["varied"]),
            held=tuple(_origin_of(value) for value in contents["held"]),
            bands=contents["bands"],
            depends=contents["depends"],
            counts=contents["counts"],
            failures=tuple(recorded_failures(record, point_states, reasons)),
            doubts=contents["doubts"],
        )
    except (InputError, OSError, ValueError, KeyError, TypeError):
        return None


def _origin_of(entry: Mapping[str, Any]) -> Origin:
    """A value of a case, from its entry in the file of a spread."""
    ends = entry["range"]
    return Origin(**{**entry, "range": None if ends is None else tuple(ends)})


def draws_of(run: Path) -> Draws | None:
    """The finished draws of the spread of a run.

    None if the run has no spread, or its files cannot be read.

    Parameters
    ----------
    run
        The run directory.
    """
    import pandas as pd

    directory = spread_of(run.resolve())
    try:
        varied = read_json(directory / SPREAD_NAME)["varied"]
        unknowns = {value["key"]: _unknown_of(value) for value in varied}
        frame = table_of(read_sweep_record(directory)).frame
        finished = frame[frame["status"] == "finished"]
        columns = [_in_si_units(finished, key) for key in unknowns]
    except (InputError, OSError, ValueError, KeyError, TypeError):
        return None  # as for the bands: there is no spread, or a file is damaged
    walking = finished.index.isin(walking_points(finished).index)
    numbers = {}
    for name in MAIN_NUMBERS:
        if name in finished:
            column = pd.to_numeric(finished[name], errors="coerce").where(walking)
            numbers[name] = column.to_numpy(dtype=float)
    return Draws(unknowns, np.column_stack(columns), numbers)


def _unknown_of(value: Mapping[str, Any]) -> Unknown:
    """An uncertain value, from its entry in the file of a spread."""
    kind = quantity_kind(value["key"])
    ends = []
    for end in value["range"]:
        ends.append(parse_quantity(end, kind) if kind and isinstance(end, str) else float(end))
    low, high = ends
    return Unknown(
        value=value["value"],
        low=low,
        high=high,
        logarithmic=value["logarithmic"],
        text=value["text"],
        ends=(value["range"][0], value["range"][1]),
    )


def _in_si_units(frame: pd.DataFrame, key: str) -> FloatArray:
    """The drawn values of a key in SI units, shape (N,)."""
    kind = quantity_kind(key)
    unit = frame.attrs["units"][key]
    factor = unit_factor(unit, kind.unit) if kind and unit else 1.0
    return factor * frame[key].to_numpy(dtype=float)


def figures_of_spread(run: Path) -> dict[str, Figure]:
    """The figure of the spread of a run, for its report, by the name ``spread``.

    The mapping is empty if the run has no spread, no draw is finished, or the record of the spread
    cannot be read.
    """
    directory = spread_of(run.resolve())
    if not (directory / SPREAD_NAME).is_file():
        return {}
    with suppress(InputError), warnings.catch_warnings():
        warnings.simplefilter("ignore", LeftOutWarning)
        return {"spread": figure_of(table_of(read_sweep_record(directory)))}
    return {}


def spread_text(spread: Spread) -> str:
    """A spread as lines of text.

    Bands are in displayed units, such as mm/s; drawn values are as the case file writes them.
    """
    points = 0
    for band in spread.bands.values():
        points = max(points, int(band["points"]))
    lines = wrapped_lines(
        f"  spread     {points} draws; values drawn independently from their ranges, "
        "half of them at or below the value of the case"
    )
    for value in spread.varied:
        ends = " to ".join(map(str, value.range or ()))
        lines.append(with_symbols(f"{_INDENT}{value.key} {value.text} ({ends})"))
    lines += wrapped_lines(f"    fixed    {fixed_values_text(spread.held)}")
    for name, band in spread.bands.items():
        lines += wrapped_lines(f"    {declared(name).label:8} {_band_text(name, band)}")
        lines += wrapped_lines(f"{_INDENT}{_dependence_text(spread, name)}")
    outcomes = _outcomes_text(spread)
    if outcomes:
        lines += wrapped_lines(f"    draws    {outcomes}")
    if spread.doubts:
        draws = counted(len(spread.doubts), "draw")
        lines += wrapped_lines(f"    warning  {draws} with warnings, first: {spread.doubts[0][0]}")
    lines.append(f"    table    {spread.directory}")
    return "\n".join(lines)


def _band_text(name: str, band: Mapping[str, float]) -> str:
    """The band of a result in its displayed unit."""
    unit, factor = unit_shown(declared(name).unit)
    texts = {}
    for end, number in band.items():
        texts[end] = rounded(float(f"{number * factor:.3g}"), unit)
    return (
        f"{texts['low']} to {texts['high']} {unit} (5 to 95 %), median {texts['median']}; "
        f"smallest {texts['smallest']}, largest {texts['largest']}"
    )


def _dependence_text(spread: Spread, name: str) -> str:
    """On which drawn values a result depends most."""
    if few_draws(int(spread.bands[name]["points"]), len(spread.varied)):
        return "too few draws for rank correlations; the band is approximate"
    ranks = [f"{key} {rank:+.2f}" for key, rank in spread.depends[name].items()]
    if not ranks:
        return "no clear dependence on any of them"
    return f"strongest dependence: {', '.join(ranks)} (rank correlation)"


def _outcomes_text(spread: Spread) -> str:
    """What the walkers of the draws do; empty if nothing can be said."""
    words = _OUTCOMES
    if "right_facing" in spread.bands or "axial_velocity" in spread.bands:
        words = _OUTCOMES_ON_A_SLOPE
    texts = [f"{count} {words[name]}" for name, count in spread.counts.items() if count]
    if spread.failures:
        texts.append(f"{len(spread.failures)} failed, not in the band")
    return ", ".join(texts)
