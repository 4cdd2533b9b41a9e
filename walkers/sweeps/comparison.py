"""Two runs, or two sweeps point by point, side by side: what differs in what was asked, and in what came out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite, nan, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.readable import differing, flattened, readable, readable_unit
from walkers.runner.directory import case_of
from walkers.sweeps.columns import result_columns, row_of
from walkers.sweeps.factors import find_name, value_text, with_unit
from walkers.sweeps.figure_layout import ERRORS, default_column
from walkers.sweeps.listing import aligned, with_error
from walkers.sweeps.record import read_record, result_in
from walkers.sweeps.table import load, varied_columns

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.case import Case

_SPREADS = ("smallest", "largest", "standard_error")
"""Columns of a sweep's table that are errors rather than results."""
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
class Pair:
    """A quantity of both sides.

    Attributes
    ----------
    quantity, unit
        What it is, and its SI unit.
    values, errors
        Of the first and the second, and their standard errors; NaN where there is none.
    """

    quantity: str
    unit: str
    values: tuple[float, float]
    errors: tuple[float, float]

    @property
    def difference(self) -> float:
        """Second minus first."""
        return self.values[1] - self.values[0]

    @property
    def standard_errors(self) -> float:
        """The difference in units of its standard error; NaN where one of them is not known."""
        error = hypot(*self.errors)
        return self.difference / error if error > 0.0 else nan

    def as_dict(self) -> dict[str, Any]:
        """As JSON; None for what is not known."""
        names = ("first", "second", "first_standard_error", "second_standard_error", "difference", "in_standard_errors")
        numbers = (*self.values, *self.errors, self.difference, self.standard_errors)
        known = [value if isfinite(value) else None for value in numbers]
        return {"quantity": self.quantity, "unit": self.unit, **dict(zip(names, known, strict=True))}

    def cells(self) -> list[str]:
        """As text, in the usual unit."""
        unit, size = readable_unit(self.unit)
        told = [with_error(value / size, error / size) for value, error in zip(self.values, self.errors, strict=True)]
        apart = f"{self.difference / size:+.3g}" if isfinite(self.difference) else "-"
        share = f"{self.standard_errors:+.3g}" if isfinite(self.standard_errors) else "-"
        return [with_unit(self.quantity, unit), *told, apart, share]


def parameters_text(names: Sequence[str], parameters: Mapping[str, tuple[Any, Any]]) -> str:
    """Keys and their values on both sides, in the usual units; empty if there are none."""
    rows = [[key, *(readable(key, value) for value in values)] for key, values in parameters.items()]
    return aligned([["parameter", *names], *rows]) if rows else ""


@dataclass(frozen=True)
class Comparison:
    """Two runs or cases.

    Attributes
    ----------
    names
        What they are called.
    parameters
        For each key by which the cases differ its values, SI units; what merely follows from other keys is left out.
    results
        What came out of both; empty if one of them was not run.
    not_run
        Names of those without a finished run.
    """

    names: tuple[str, str]
    parameters: Mapping[str, tuple[Any, Any]]
    results: Sequence[Pair]
    not_run: Sequence[str]

    def as_dict(self) -> dict[str, Any]:
        """As JSON, SI units."""
        return {
            "first": self.names[0],
            "second": self.names[1],
            "parameters": {key: list(values) for key, values in self.parameters.items()},
            "results": [pair.as_dict() for pair in self.results],
            "not_run": list(self.not_run),
        }

    def as_text(self) -> str:
        """As text, in the usual units."""
        text = [parameters_text(self.names, self.parameters) or "the cases are the same"]
        apart = [pair for pair in self.results if pair.values[0] != pair.values[1]]
        if apart:
            head = ["result", *self.names, "difference", "in standard errors"]
            text.append(aligned([head, *(pair.cells() for pair in apart)]))
        if same := [pair.quantity for pair in self.results if pair not in apart]:
            text.append(f"the same in both: {', '.join(same)}")
        text += [f"{name}: no finished run; the parameters alone are compared" for name in self.not_run]
        return "\n\n".join(text)


def compare_runs(first: Side, second: Side) -> Comparison:
    """Compare two runs, or cases that may not have been run.

    Raises
    ------
    sweeps.record.DamagedRunError
        If a run can neither be read nor be tabulated anew.
    """
    pairs = _pairs(first.directory, second.directory) if first.directory and second.directory else []
    not_run = [side.name for side in (first, second) if side.directory is None]
    return Comparison((first.name, second.name), different_parameters(first.case, second.case), pairs, not_run)


def different_parameters(first: Case, second: Case) -> dict[str, tuple[Any, Any]]:
    """The values of both cases by which they differ, SI units, without what merely follows from others."""
    cases = [flattened(one.as_dict()) for one in (first, second)]
    return {key: (cases[0].get(key), cases[1].get(key)) for key in differing(cases)}


def _pairs(first: Path, second: Path) -> list[Pair]:
    """All numbers that the analyses give of two runs."""
    results = [result_in(run) for run in (first, second)]
    rows = [row_of(result) for result in results]
    errors = [_errors(run, result) for run, result in zip((first, second), results, strict=True)]
    units = result_columns(list(dict.fromkeys(name for result in results for name in result["analyses"])))
    pairs = []
    for name, (unit, _) in units.items():
        values = (number_of(rows[0].get(name)), number_of(rows[1].get(name)))
        if name not in _SPREADS and any(map(isfinite, values)):
            pairs.append(Pair(name, unit, values, (errors[0].get(name, nan), errors[1].get(name, nan))))
    return pairs


def number_of(value: Any) -> float:
    """A value of a table or a result as a number; NaN where it is none."""
    return nan if value is None or isinstance(value, str) else float(value)


def _errors(run: Path, result: Mapping[str, Any]) -> dict[str, float]:
    """Standard errors of columns: as the result has them, and of means over walkers from the table of the walkers."""
    if "velocity" not in result:
        return {}
    known = {"velocity": result["velocity"], **{name: result[name] for name in ("right_facing", "left_facing")}}
    errors = {name: number_of(spread["standard_error"]) for name, spread in known.items()}
    from walkers.postprocess.tables import read_table

    walkers = read_table(run, "walkers")
    for name in walkers.columns:
        of_first = name.rpartition("_")[0] in _FIRST_MAKE
        rows = walkers[walkers["make"] == 0] if of_first else walkers
        if len(rows) > 1 and (of_first or name in _OF_ALL):
            errors[name] = float(rows[name].std(ddof=1)) / sqrt(len(rows))
    return errors


_SIDES = ("first", "second")


@dataclass(frozen=True)
class SweepComparison:
    """A column of two sweeps, point by point.

    Attributes
    ----------
    names, keys
        Of the sweeps; what varies in both, with its unit.
    points
        The values of the keys, and the column of both sweeps.
    unmatched
        How many points of each sweep the other has not, or that are not finished in both.
    parameters
        By what else the cases of the points differ, as the first of them shows.
    """

    names: tuple[str, str]
    keys: Mapping[str, str | None]
    points: Sequence[tuple[tuple[Any, ...], Pair]]
    unmatched: tuple[int, int]
    parameters: Mapping[str, tuple[Any, Any]]

    def as_dict(self) -> dict[str, Any]:
        """As JSON, SI units but for the keys, which have those of the sweeps' files."""
        return {
            "first": self.names[0],
            "second": self.names[1],
            "keys": dict(self.keys),
            "parameters": {key: list(values) for key, values in self.parameters.items()},
            "points": [{"point": dict(zip(self.keys, at, strict=True)), **pair.as_dict()} for at, pair in self.points],
            "unmatched": list(self.unmatched),
        }

    def as_text(self) -> str:
        """As text, in the usual units."""
        quantity = self.points[0][1].cells()[0]
        sides = [f"{name}: {quantity}" for name in self.names]
        head = [*_with_units(self.keys), *sides, "difference", "in standard errors"]
        told = [[*map(value_text, at), *pair.cells()[1:]] for at, pair in self.points]
        largest = max((pair for _, pair in self.points), key=lambda pair: abs(pair.difference))
        unit, size = readable_unit(largest.unit)
        line = f"{len(self.points)} points in both; largest difference {largest.difference / size:+.3g} {unit}".rstrip()
        if any(self.unmatched):
            line += f"; left out: {self.unmatched[0]} of {self.names[0]}, {self.unmatched[1]} of {self.names[1]}"
        return "\n\n".join(filter(None, [parameters_text(self.names, self.parameters), aligned([head, *told]), line]))


def compare_sweeps(first: Path, second: Path, column: str | None = None) -> SweepComparison:
    """Compare a column of two sweeps that vary the same keys, at the points that are finished in both.

    Parameters
    ----------
    first, second
        Directories of sweeps.
    column
        Of their tables; ``velocity``, of piles ``climbs`` if left out.

    Raises
    ------
    InputError
        If they vary other keys, have no finished point in common, or not that column.
    """
    records, source = (read_record(first), read_record(second)), f"{first}, {second}"
    units = dict(records[0].units)
    if units != dict(records[1].units):
        varied = " and ".join(", ".join(_with_units(record.units)) or "nothing" for record in records)
        told = f"expected sweeps that vary the same keys in the same units: {varied}"
        raise InputError(source, [Problem("", None, told)])
    tables = [load(directory) for directory in (first, second)]
    numbers = [name for name in tables[0].columns if name in tables[1] and tables[0][name].dtype.kind in "fiu"]
    column = find_name("--y", column, numbers) if column else default_column(tables[0])
    both = _matched([table[table["status"] == "finished"] for table in tables], varied_columns(tables[0]))
    if both.empty:
        raise InputError(source, [Problem("", None, "have no finished point in common")])
    unit = tables[0].attrs["units"][column]
    rows = [{str(name): value for name, value in row.items()} for row in both.to_dict("records")]
    names = records[0].name, records[1].name
    return SweepComparison(
        names=(str(first), str(second)) if names[0] == names[1] else names,
        keys=units,
        points=[(tuple(records[0].values[row["point_first"]]), _pair(column, unit, row)) for row in rows],
        unmatched=(len(tables[0]) - len(both), len(tables[1]) - len(both)),
        parameters=different_parameters(*(case_of(Path(rows[0][f"run_{side}"])) for side in _SIDES)),
    )


def _with_units(units: Mapping[str, str | None]) -> list[str]:
    return [with_unit(key, unit or "") for key, unit in units.items()]


def _matched(tables: Sequence[pd.DataFrame], keys: list[str]) -> pd.DataFrame:
    """The rows of two tables whose keys have the same values, the columns of both beside each other."""
    first, second = (table.astype(dict.fromkeys(keys, object)) for table in tables)
    how = {"on": keys} if keys else {"how": "cross"}
    return first.merge(second, suffixes=[f"_{side}" for side in _SIDES], **how)


def _pair(column: str, unit: str, row: Mapping[str, Any]) -> Pair:
    values, errors = (
        tuple(number_of(row.get(f"{name}_{side}")) for side in _SIDES) for name in (column, ERRORS.get(column, ""))
    )
    return Pair(column, unit, (values[0], values[1]), (errors[0], errors[1]))
