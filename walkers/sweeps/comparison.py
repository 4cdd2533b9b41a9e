"""Two runs, or two sweeps point by point, side by side: what differs in what was asked, and in what came out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite, nan, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import refused
from walkers.inputs.readable import differing, flattened, readable, readable_unit
from walkers.runner.directory import case_of
from walkers.sweeps.folder import aligned, with_error
from walkers.sweeps.table import (
    ERRORS,
    default_column,
    find_name,
    load,
    read_record,
    result_columns,
    result_in,
    row_of,
    value_text,
    varied_columns,
    with_unit,
)

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.case import Case

_SIDES = ("first", "second")
_SPREADS = ("smallest", "largest", "standard_error")  # columns of a sweep's table that are errors rather than results
_FIRST_MAKE = ("rotation", "sliding", "open")
_OF_ALL = ("orientation_end", "separated_fraction")
"""Columns that are means over walkers: of the first make, or of all. (Axial velocities are of two headings.)"""


@dataclass(frozen=True)
class Side:
    """One of two that are compared: its name, its case, and the directory of its finished run if there is one."""

    name: str
    case: Case
    directory: Path | None


@dataclass(frozen=True)
class Comparison:
    """What differs between two: as JSON, SI units (keys of sweeps in those of their files); as text in usual units."""

    contents: Mapping[str, Any]
    text: str


def _pair(
    quantity: str, unit: str, values: Sequence[float], errors: Sequence[float]
) -> tuple[dict[str, Any], list[str]]:
    """A quantity of both sides, with standard errors: as JSON, SI units, and as cells of a text, in usual units."""
    difference, error = values[1] - values[0], hypot(*errors)
    share = difference / error if error > 0.0 else nan
    names = ("first", "second", "first_standard_error", "second_standard_error", "difference", "in_standard_errors")
    numbers = zip(names, (*values, *errors, difference, share), strict=True)
    contents = {"quantity": quantity, "unit": unit, **{name: one if isfinite(one) else None for name, one in numbers}}
    usual, size = readable_unit(unit)
    told = [with_error(value / size, one / size) for value, one in zip(values, errors, strict=True)]
    told += [f"{one:+.3g}" if isfinite(one) else "-" for one in (difference / size, share)]
    return contents, [with_unit(quantity, usual), *told]


def compare_runs(first: Side, second: Side) -> Comparison:
    """Compare two runs, or cases that may not have been run; `DamagedRunError` if a run's result is lost."""
    sides = (first, second)
    names = [side.name for side in sides]
    parameters, told = _different([side.case for side in sides], names)
    not_run = [side.name for side in sides if side.directory is None]
    pairs = [] if not_run else _pairs([side.directory for side in sides if side.directory])
    text = [told or "the cases are the same"]
    if apart := [cells for one, cells in pairs if one["first"] != one["second"]]:
        text.append(aligned([["result", *names, "difference", "in standard errors"], *apart]))
    if same := [one["quantity"] for one, _ in pairs if one["first"] == one["second"]]:
        text.append(f"the same in both: {', '.join(same)}")
    text += [f"{name}: no finished run; the parameters alone are compared" for name in not_run]
    contents: dict[str, Any] = {**dict(zip(_SIDES, names, strict=True)), "parameters": parameters}
    contents |= {"results": [one for one, _ in pairs], "not_run": not_run}
    return Comparison(contents, "\n\n".join(text))


def _different(cases: Sequence[Case], names: Sequence[str]) -> tuple[dict[str, list[Any]], str]:
    """The values of both cases by which they differ, SI units, without what merely follows from others; and as text."""
    flat = [flattened(one.as_dict()) for one in cases]
    parameters = {key: [one.get(key) for one in flat] for key in differing(flat)}
    rows = [[key, *(readable(key, value) for value in values)] for key, values in parameters.items()]
    return parameters, aligned([["parameter", *names], *rows]) if rows else ""


def _number_of(value: Any) -> float:
    return nan if value is None or isinstance(value, str) else float(value)


def _pairs(runs: Sequence[Path]) -> list[tuple[dict[str, Any], list[str]]]:
    """All numbers that the analyses give of two runs."""
    results = [result_in(run) for run in runs]
    rows = [row_of(result) for result in results]
    errors = [_errors(run, result) for run, result in zip(runs, results, strict=True)]
    units = result_columns([name for result in results for name in result["analyses"]])
    pairs = []
    for name, (unit, _) in units.items():
        values = [_number_of(row.get(name)) for row in rows]
        if name not in _SPREADS and any(map(isfinite, values)):
            pairs.append(_pair(name, unit, values, [known.get(name, nan) for known in errors]))
    return pairs


def _errors(run: Path, result: Mapping[str, Any]) -> dict[str, float]:
    """Standard errors of columns: as the result has them, and of means over walkers from the table of the walkers."""
    if "velocity" not in result:
        return {}
    from walkers.postprocess.tables import read_table

    known = ("velocity", "right_facing", "left_facing")
    errors = {name: _number_of(result[name]["standard_error"]) for name in known}
    walkers = read_table(run, "walkers")
    for name in walkers.columns:
        of_first = name.rpartition("_")[0] in _FIRST_MAKE
        rows = walkers[walkers["make"] == 0] if of_first else walkers
        if len(rows) > 1 and (of_first or name in _OF_ALL):
            errors[name] = float(rows[name].std(ddof=1)) / sqrt(len(rows))
    return errors


def compare_sweeps(first: Path, second: Path, column: str | None = None) -> Comparison:
    """Compare a column of two sweeps, ``velocity`` or ``climbs`` if none is named, at the points finished in both.

    `InputError` if they vary other keys, have no finished point in common, or not that column.
    """
    records, source = (read_record(first), read_record(second)), f"{first}, {second}"
    keys = [[with_unit(key, unit) for key, unit in one.units.items()] for one in records]
    if dict(records[0].units) != dict(records[1].units):
        told = " and ".join(", ".join(one) or "nothing" for one in keys)
        raise refused(source, f"expected sweeps that vary the same keys in the same units: {told}")
    tables = [load(directory) for directory in (first, second)]
    numbers = [name for name in tables[0].columns if name in tables[1] and tables[0][name].dtype.kind in "fiu"]
    column = find_name("--y", column, numbers) if column else default_column(tables[0])
    both = _matched([table[table["status"] == "finished"] for table in tables], varied_columns(tables[0]))
    if both.empty:
        raise refused(source, "have no finished point in common")
    names = [record.name for record in records]
    names = [str(first), str(second)] if names[0] == names[1] else names
    parameters, told = _different([case_of(Path(both[f"run_{side}"].iloc[0])) for side in _SIDES], names)
    points, lines = [], []
    for row in both.to_dict("records"):
        of_sides = [[_number_of(row.get(f"{name}_{side}")) for side in _SIDES] for name in (column, ERRORS.get(column))]
        one, (quantity, *cells) = _pair(column, tables[0].attrs["units"][column], *of_sides)
        at = dict(zip(records[0].units, records[0].values[row["point_first"]], strict=True))
        points.append({"point": at, **one})
        lines.append([*map(value_text, at.values()), *cells])
    unmatched = [len(table) - len(both) for table in tables]
    heads = [*keys[0], *(f"{name}: {quantity}" for name in names), "difference", "in standard errors"]
    unit, size = readable_unit(tables[0].attrs["units"][column])
    largest = max((one["difference"] or 0.0 for one in points), key=abs)
    line = f"{len(both)} points in both; largest difference {largest / size:+.3g} {unit}".rstrip()
    if any(unmatched):
        line += f"; left out: {unmatched[0]} of {names[0]}, {unmatched[1]} of {names[1]}"
    contents: dict[str, Any] = {**dict(zip(_SIDES, names, strict=True)), "keys": dict(records[0].units)}
    contents |= {"parameters": parameters, "points": points, "unmatched": unmatched}
    return Comparison(contents, "\n\n".join(filter(None, [told, aligned([heads, *lines]), line])))


def _matched(tables: Sequence[pd.DataFrame], keys: list[str]) -> pd.DataFrame:
    """The rows of two tables whose keys have the same values, the columns of both beside each other."""
    first, second = (table.astype(dict.fromkeys(keys, object)) for table in tables)
    how: dict[str, Any] = {"on": keys} if keys else {"how": "cross"}
    return first.merge(second, suffixes=(f"_{_SIDES[0]}", f"_{_SIDES[1]}"), **how)
