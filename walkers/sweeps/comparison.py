"""Comparison of two runs, or of two sweeps point by point: parameters and results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import refused
from walkers.postprocess.numbers import ASIDE, band_text, declared, fell, is_error
from walkers.postprocess.quantities import unit_shown
from walkers.postprocess.results import Results, read
from walkers.postprocess.sides import alike
from walkers.postprocess.uncertainty import not_known
from walkers.rounding import percent, rounded
from walkers.runner.directory import case_of
from walkers.sweeps.readable import differing, flattened, readable
from walkers.sweeps.table import (
    ERRORS,
    columns_of,
    default_column,
    find_name,
    load,
    read_record,
    sides_differ,
    value_text,
    with_unit,
)
from walkers.text import aligned

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.case import Case

_SIDES = ("first", "second")
_VELOCITIES = ("velocity", "right_facing", "left_facing")
"""Columns whose scatter is in the result."""
_UPHILL = {
    "right_facing": "along the heading, facing up",
    "left_facing": "along the heading, facing down",
    "axial_velocity": "velocity up the slope",
    "axial_left_facing": "velocity up the slope, facing down",
}
"""Names of columns if the drive axis goes up a slope."""
_FIRST_MAKE = ("rotation", "sliding", "sliding_pair", "open", "open_pair")
_OF_ALL = ("orientation_end", "separated_fraction")
"""Columns that are means over walkers of the first make, and over all walkers."""


@dataclass(frozen=True)
class Side:
    """One of two that are compared: its name, its case, and the directory of its finished run if there is one."""

    name: str
    case: Case
    directory: Path | None


@dataclass(frozen=True)
class Comparison:
    """Differences as JSON, in SI units (keys of sweeps in the units of their files), and as text in readable units."""

    contents: Mapping[str, Any]
    text: str


def _pair(
    quantity: str, unit: str, values: Sequence[float], scatters: Sequence[float], numerical: float = nan
) -> tuple[dict[str, Any], list[str]]:
    """A quantity of both sides, with difference and errors, as JSON (SI units) and cells of text (readable units)."""
    difference = values[1] - values[0]
    names = ("first", "second", "first_scatter", "second_scatter", "difference", "numerical_error")
    numbers = zip(names, (*values, *scatters, difference, numerical), strict=True)
    contents = {"quantity": quantity, "unit": unit, **{name: one if isfinite(one) else None for name, one in numbers}}
    usual, size = unit_shown(unit)
    printed = [rounded(value * size, usual) for value in values]
    apart = difference * size
    if abs(difference) < 2e-3 * abs(values[0]):  # digits that are not printed would contradict the printed ones
        apart = float(printed[1]) - float(printed[0])
    cells = [*printed, _difference(apart, usual)]
    spreads = [(one, _two_digits(one * size, usual)) for one in scatters if isfinite(one)]
    both = " and ".join("<0.001" if one > 0.0 and text == "0" and usual == "mm/s" else text for one, text in spreads)
    return contents, [with_unit(quantity, usual), *cells, both or "-", _two_digits(numerical * size, usual)]


def _difference(value: float, unit: str) -> str:
    text = rounded(value, unit)
    return text if text[:1] == "-" or text == "0" else f"+{text}"


def _two_digits(value: float, unit: str) -> str:
    return rounded(float(f"{value:.2g}"), unit)


def compare_runs(first: Side, second: Side) -> Comparison:
    """Compare two runs, or cases not yet run."""
    names = [side.name for side in (first, second)]
    parameters, differences = _different([first.case, second.case], names)
    not_run = [side.name for side in (first, second) if side.directory is None]
    runs = [side.directory for side in (first, second) if side.directory]
    results = [] if not_run else [read(run) for run in runs]
    pairs = _pairs(results) if results else []
    lengths = [cells[1:3] for one, cells in pairs if one["quantity"] == "cycles" and one["first"] != one["second"]]
    same_cases = "".join(["the cases are the same", *(f", but ran {' and '.join(one)} cycles" for one in lengths)])
    text = [differences or same_cases]
    if apart := [cells for one, cells in pairs if one["first"] != one["second"]]:
        text.append(aligned([["result", *names, "difference", "scatter of copies", "numerical error"], *apart]))
        text += _errors_text(results, names)
    if same := [one["quantity"] for one, _ in pairs if one["first"] == one["second"]]:
        text.append(f"the same in both: {', '.join(same)}" if apart else "all results are the same")
    text += [f"{name}: no finished run; only the parameters are compared" for name in not_run]
    contents: dict[str, Any] = {**dict(zip(_SIDES, names, strict=True)), "parameters": parameters}
    contents |= {"results": [one for one, _ in pairs], "not_run": not_run}
    return Comparison(contents, "\n\n".join(text))


def _different(cases: Sequence[Case], names: Sequence[str]) -> tuple[dict[str, list[Any]], str]:
    """The given values by which two cases differ, without derived ones, in SI units, and as text."""
    flat = [flattened(one) for one in cases]
    parameters = {key: [one.get(key) for one in flat] for key in differing(flat)}
    rows = [[key, *(readable(key, value) for value in values)] for key, values in parameters.items()]
    return parameters, aligned([["parameter", *names], *rows]) if rows else ""


def _number_of(value: Any) -> float:
    return nan if value is None or isinstance(value, str) else float(value)


def _pairs(results: Sequence[Results]) -> list[tuple[dict[str, Any], list[str]]]:
    """The numbers of two results, without errors, values of the case and conditions."""
    scatters = [_scatters(result) for result in results]
    units = columns_of({name for result in results for name in result if name not in {*ASIDE, "coverage"}})
    meant = _VELOCITIES if any(map(fell, results)) else ("velocity",) if _differ(results) else ()
    units = {name: entry for name, entry in units.items() if name not in meant}  # these are no walker's way
    uphill, pairs = all(result.get("goes_uphill") for result in results), []
    for name, (unit, _) in units.items():
        values = [_number_of(result.get(name)) for result in results]
        if any(map(isfinite, values)) and not is_error(name):
            error = hypot(*(_number_of(result.get(f"{name}_error")) for result in results))
            one, cells = _pair(name, unit, values, [known.get(name, nan) for known in scatters], error)
            if uphill and name in _UPHILL:
                cells[0] = cells[0].replace(name, _UPHILL[name])
            pairs.append((one, cells))
    return pairs


def _differ(results: Iterable[Mapping[str, Any]]) -> bool:
    """Whether walkers of a result that face right (up) and left (down) differ."""
    return any(result.get("facings_differ") for result in results)


def _scatters(result: Results) -> dict[str, float]:
    """Standard deviations of columns over copies, from the result or from the table of the walkers."""
    if "velocity" not in result:
        return {}
    scatters = {name: float(result[declared(name).error]) for name in _VELOCITIES}
    walkers = result.table("walkers")
    walkers = walkers[alike(walkers, uphill=result["goes_uphill"])]
    for name in walkers.columns:
        of_first = name.rpartition("_")[0] in _FIRST_MAKE
        rows = walkers[walkers["make"] == 0] if of_first else walkers
        if len(rows) > 1 and (of_first or name in _OF_ALL):
            scatters[name] = float(rows[name].std(ddof=1))
    return scatters


def _errors_text(results: Sequence[Results], names: Sequence[str]) -> list[str]:
    """Sentences that compare the difference of two velocities with numerical errors and bands."""
    if not all("velocity" in result for result in results):
        return []
    if any(map(fell, results)):  # errors and bands are those of velocities along the heading
        return []
    name_of = "right_facing" if _differ(results) else "velocity"
    errors = [_number_of(one.get(f"{name_of}_error")) for one in results]
    own = [_number_of(one[name_of]) for one in results]
    total = hypot(*errors)
    lines = []
    if isfinite(total + own[0] + own[1]) and total > 0.0:
        times = abs(own[1] - own[0]) / total
        words = "less than" if times < 1.0 else f"{_two_digits(times, '')} times"
        shares = " and ".join(
            f"{percent(float(f'{error / abs(value):.2g}'))} of {name}"
            for name, error, value in zip(names, errors, own, strict=True)
            if value
        )
        facing = "up" if all(one["goes_uphill"] for one in results) else "right"
        whose = "" if name_of == "velocity" else f" of those facing {facing}"
        lines.append(f"the velocities{whose} differ by {words} their numerical error ({shares})")
    lines += [
        f"{name}: the numerical error is not measured: walkers run {one.directory.name} --accuracy"
        for name, one, error in zip(names, results, errors, strict=True)
        if not isfinite(error)
    ]
    for name, one in zip(names, results, strict=True):
        if f"{name_of}_low" in one:
            band = band_text(one[f"{name_of}_low"], one[f"{name_of}_high"], "m/s")
            lines.append(f"{name}: {band} mm/s over the ranges of uncertain values (5 to 95 %)")
        else:
            lines += [f"{name}: {sentence}" for sentence in not_known(one.about["rests_on"])]
    return ["\n".join(lines)] if lines else []


def compare_sweeps(first: Path, second: Path, column: str | None = None) -> Comparison:
    """Compare a column of two sweeps (default: ``velocity`` or ``climbs``) at the points that are finished in both.

    `InputError` if the varied keys differ, no finished point is common, or a sweep has no such column.
    """
    sweeps, source = [read_record(directory).sweep for directory in (first, second)], f"{first}, {second}"
    keys = [[with_unit(key, unit) for key, unit in one.units.items()] for one in sweeps]
    if sweeps[0].units != sweeps[1].units:
        differences = " and ".join(", ".join(one) or "nothing" for one in keys)
        raise refused(source, f"expected sweeps that vary the same keys in the same units: {differences}")
    tables = [load(directory) for directory in (first, second)]
    numbers = [name for name in tables[0].columns if name in tables[1] and tables[0][name].dtype.kind in "fiu"]
    default = default_column(max(tables, key=sides_differ))
    column = find_name("column", column, numbers) if column else default
    varied = list(dict.fromkeys(name for table in tables for name in table.attrs["varied"]))  # of the longest lists
    both = _matched([table[table["status"] == "finished"] for table in tables], varied)
    if both.empty:
        raise refused(source, "have no finished point in common")
    names = [sweep.name for sweep in sweeps]
    names = [str(first), str(second)] if names[0] == names[1] else names
    parameters, differences = _different([case_of(Path(both[f"run_{side}"].iloc[0])) for side in _SIDES], names)
    points, lines = [], []
    for row in both.to_dict("records"):
        names_of = (column, ERRORS.get(column))
        values, scatters = ([_number_of(row.get(f"{name}_{side}")) for side in _SIDES] for name in names_of)
        one, (quantity, *cells) = _pair(column, tables[0].attrs["units"][column], values, scatters)
        at = dict(zip(sweeps[0].keys, sweeps[0].values[row["point_first"]], strict=True))
        points.append({"point": at, **one})
        lines.append([*map(value_text, at.values()), *cells[:-1]])
    unmatched = [len(table) - len(both) for table in tables]
    heads = [*keys[0], *(f"{name}: {quantity}" for name in names), "difference", "scatter of copies"]
    unit, size = unit_shown(tables[0].attrs["units"][column])
    largest = max((one["difference"] or 0.0 for one in points), key=abs)
    line = f"{len(both)} points in both; largest difference {_difference(largest * size, unit)} {unit}".rstrip()
    if any(unmatched):
        line += f"; left out: {unmatched[0]} of {names[0]}, {unmatched[1]} of {names[1]}"
    contents: dict[str, Any] = {**dict(zip(_SIDES, names, strict=True)), "keys": sweeps[0].units}
    contents |= {"parameters": parameters, "points": points, "unmatched": unmatched}
    return Comparison(contents, "\n\n".join(filter(None, [differences, aligned([heads, *lines]), line])))


def _matched(tables: Sequence[pd.DataFrame], keys: list[str]) -> pd.DataFrame:
    """The rows of two tables with the same values of the keys, the columns of both side by side."""
    columns = list(dict.fromkeys([*keys, *tables[0].columns, *tables[1].columns]))
    first, second = (table.reindex(columns=columns).astype(dict.fromkeys(keys, object)) for table in tables)
    how: dict[str, Any] = {"on": keys} if keys else {"how": "cross"}
    return first.merge(second, suffixes=(f"_{_SIDES[0]}", f"_{_SIDES[1]}"), **how)
