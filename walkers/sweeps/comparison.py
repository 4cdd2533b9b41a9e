"""Two runs side by side: what differs in what was asked, and in what came out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite, nan, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.readable import differing, flattened, readable, readable_unit
from walkers.sweeps.columns import result_columns, row_of
from walkers.sweeps.listing import aligned, with_error
from walkers.sweeps.record import result_in

if TYPE_CHECKING:
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
        numbers = {
            "first": self.values[0],
            "second": self.values[1],
            "first_standard_error": self.errors[0],
            "second_standard_error": self.errors[1],
            "difference": self.difference,
            "in_standard_errors": self.standard_errors,
        }
        known = {name: value if isfinite(value) else None for name, value in numbers.items()}
        return {"quantity": self.quantity, "unit": self.unit, **known}

    def cells(self) -> list[str]:
        """As text, in the usual unit."""
        unit, size = readable_unit(self.unit)
        told = [with_error(value / size, error / size) for value, error in zip(self.values, self.errors, strict=True)]
        apart = f"{self.difference / size:+.3g}" if isfinite(self.difference) else "-"
        share = f"{self.standard_errors:+.3g}" if isfinite(self.standard_errors) else "-"
        return [f"{self.quantity} ({unit})" if unit else self.quantity, *told, apart, share]


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
    sides = (first, second)
    pairs: list[Pair] = []
    if first.directory is not None and second.directory is not None:
        pairs = _pairs(first.directory, second.directory)
    not_run = [side.name for side in sides if side.directory is None]
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
