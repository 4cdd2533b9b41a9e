"""Two sweeps of the same keys side by side, point by point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem
from walkers.inputs.readable import readable_unit
from walkers.runner.directory import case_of
from walkers.sweeps.comparison import Pair, different_parameters, number_of, parameters_text
from walkers.sweeps.factors import value_text
from walkers.sweeps.listing import aligned
from walkers.sweeps.record import read_record
from walkers.sweeps.table import load

if TYPE_CHECKING:
    import pandas as pd


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
        points = [{"point": dict(zip(self.keys, at, strict=True)), **pair.as_dict()} for at, pair in self.points]
        return {
            "first": self.names[0],
            "second": self.names[1],
            "keys": dict(self.keys),
            "parameters": {key: list(values) for key, values in self.parameters.items()},
            "points": points,
            "unmatched": list(self.unmatched),
        }

    def as_text(self) -> str:
        """As text, in the usual units."""
        parameters = parameters_text(self.names, self.parameters)
        text = [parameters] if parameters else []
        quantity = self.points[0][1].cells()[0]
        keys = [f"{key} ({unit})" if unit else key for key, unit in self.keys.items()]
        head = [*keys, *(f"{name}: {quantity}" for name in self.names), "difference", "in standard errors"]
        told = [[*map(value_text, at), *pair.cells()[1:]] for at, pair in self.points]
        text.append(aligned([head, *told]))
        text.append(self._summary())
        return "\n\n".join(text)

    def _summary(self) -> str:
        largest = max((pair for _, pair in self.points), key=lambda pair: abs(pair.difference))
        unit, size = readable_unit(largest.unit)
        line = f"{len(self.points)} points in both; largest difference {largest.difference / size:+.3g} {unit}".rstrip()
        if any(self.unmatched):
            line += f"; left out: {self.unmatched[0]} of {self.names[0]}, {self.unmatched[1]} of {self.names[1]}"
        return line


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
    from walkers.sweeps.factors import find_name
    from walkers.sweeps.figure_layout import default_column

    records, source = (read_record(first), read_record(second)), f"{first}, {second}"
    units = dict(records[0].units)
    if units != dict(records[1].units):
        told = " and ".join(_keys_text(record.units) for record in records)
        raise InputError(
            source, [Problem("", None, f"expected sweeps that vary the same keys in the same units: {told}")]
        )
    tables = [load(directory) for directory in (first, second)]
    numbers = [name for name in tables[0].columns if name in tables[1] and tables[0][name].dtype.kind in "fiu"]
    column = find_name("--y", column, numbers) if column else default_column(tables[0])
    both = _matched([table[table["status"] == "finished"] for table in tables], list(units))
    if both.empty:
        raise InputError(source, [Problem("", None, "have no finished point in common")])
    unit = tables[0].attrs["units"][column]
    rows = [{str(name): value for name, value in row.items()} for row in both.to_dict("records")]
    parameters = different_parameters(*(case_of(Path(rows[0][f"run_{side}"])) for side in _SIDES))
    return SweepComparison(
        names=(str(first), str(second)) if records[0].name == records[1].name else (records[0].name, records[1].name),
        keys=units,
        points=[(tuple(records[0].values[row["point_first"]]), _pair(column, unit, row)) for row in rows],
        unmatched=(len(tables[0]) - len(both), len(tables[1]) - len(both)),
        parameters=parameters,
    )


def _keys_text(units: Mapping[str, str | None]) -> str:
    return ", ".join(f"{key} ({unit})" if unit else key for key, unit in units.items()) or "nothing"


def _matched(tables: Sequence[pd.DataFrame], units: Sequence[str]) -> pd.DataFrame:
    """The rows of two tables whose keys have the same values, the columns of both beside each other."""
    keys = [name for name in tables[0].columns if name.partition("[")[0] in units]
    first, second = (table.astype(dict.fromkeys(keys, object)) for table in tables)
    how = {"on": keys} if keys else {"how": "cross"}
    return first.merge(second, suffixes=[f"_{side}" for side in _SIDES], **how)


def _pair(column: str, unit: str, row: Mapping[str, Any]) -> Pair:
    values, errors = (
        tuple(number_of(row.get(f"{name}_{side}")) for side in _SIDES)
        for name in (column, "standard_error" if column == "velocity" else "")
    )
    return Pair(column, unit, (values[0], values[1]), (errors[0], errors[1]))
