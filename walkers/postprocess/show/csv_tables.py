"""The tables and the numbers of a run as CSV files, for spreadsheets and other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from walkers.files import CSV_SCRATCH
from walkers.postprocess.measure.quantities import TABLES, declared
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.table_units import UnitSystem, check_units, in_units, unit_in
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.export_folder import files_of_earlier_export, filled_folder
from walkers.rounding import to_fifteen_digits
from walkers.text import with_unit

if TYPE_CHECKING:
    import pandas as pd

_RESULT = "result"
"""Name of the file with the numbers of the result, without its suffix."""


def write_csv(
    directory: Path, destination: Path | None = None, *, units: UnitSystem = "SI"
) -> Path:
    """Write all tables of a run, and the numbers of its result, as CSV files in a folder.

    Each table is a file of its own. Its header has the names of the columns with their units, such
    as ``time (s)``. The file ``result.csv`` has a row for each number: name, value, unit, meaning.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The folder to write; None: ``csv`` in the run directory.
    units
        ``SI``, or ``mm`` for the units of printed results.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        If a table cannot be read, or the destination has other files than those of such an export.
    """
    check_units(units)
    destination = destination or directory / "csv"
    names = {f"{name}.csv" for name in (_RESULT, *TABLES)}
    earlier_files = files_of_earlier_export(destination, names)
    frames = {_RESULT: _numbers(directory, units)}
    for name in _names_of_tables(directory):
        frame = in_units(read_table(directory, name), units)
        frames[name] = frame.rename(columns=_heads(frame))
    with filled_folder(destination, earlier_files, CSV_SCRATCH) as new:
        for name, frame in frames.items():
            frame.to_csv(new / f"{name}.csv", index=False)
    return destination


def _names_of_tables(directory: Path) -> list[str]:
    """Names of the tables of a run, in the order of their declarations."""
    return [name for name in TABLES if (directory / f"{name}.parquet").exists()]


def _heads(frame: pd.DataFrame) -> dict[str, str]:
    """The names of columns with their units."""
    return {name: with_unit(name, unit) for name, unit in frame.attrs["units"].items()}


def _numbers(directory: Path, units: UnitSystem) -> pd.DataFrame:
    """The numbers of the result, a row for each."""
    import pandas as pd

    rows = []
    for name, value in read_results(directory).items():
        quantity = declared(name)
        unit, factor = unit_in(units, quantity.si_unit)
        number = value
        if factor != 1.0 and value is not None:
            number = to_fifteen_digits(factor * value)
        rows.append([name, number, unit, quantity.meaning])
    return pd.DataFrame(rows, columns=["number", "value", "unit", "meaning"])
