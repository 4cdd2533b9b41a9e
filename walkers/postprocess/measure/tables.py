"""The tables of a run: parquet files whose columns have units, labels and meanings.

They are written with pyarrow alone, because pandas takes a third of a second to import. A frame
that ``pandas.read_parquet`` reads has units and labels in its ``attrs``, as one of `read_table`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from walkers.errors import input_error
from walkers.files import read_regular, replacing
from walkers.postprocess.measure.quantities import TABLES, declared, matches

if TYPE_CHECKING:
    import pandas as pd

_ATTRIBUTES = ("units", "long_name")
"""What the ``attrs`` of a table have by column; names of the CF conventions."""
Columns: TypeAlias = dict[str, npt.NDArray[Any]]
"""Columns of a table by their names, all of one length."""


def numbered_columns(name: str, values: npt.NDArray[Any]) -> Columns:
    """Make the columns ``name_1``, ``name_2``, … of values at beads or contacts, the last axis."""
    return {f"{name}_{number + 1}": values[..., number] for number in range(values.shape[-1])}


def columns_of(rows: Sequence[Sequence[Any]], types: Mapping[str, type]) -> Columns:
    """Make columns of rows.

    Parameters
    ----------
    rows
        The rows, of which there may be none; each has a cell for each column.
    types
        Names and types of the columns.
    """
    columns: Columns = {}
    for place, (name, column_type) in enumerate(types.items()):
        columns[name] = np.array([row[place] for row in rows], dtype=column_type)
    return columns


def write_table(directory: Path, name: str, columns: Columns) -> None:
    """Write a table of a run as a parquet file.

    Parameters
    ----------
    directory
        The run directory.
    name
        Name of the table in `walkers.postprocess.measure.quantities.TABLES`.
    columns
        Its columns, SI units.

    Raises
    ------
    KeyError
        If columns are missing or not declared.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = []
    fields = []
    reals = []
    not_reals = []
    for column in _order_of(name, columns):
        array = _arrow(columns[column])
        arrays.append(array)
        fields.append(pa.field(column, array.type, metadata=_metadata(name, column)))
        if pa.types.is_floating(array.type):
            reals.append(column)
        else:
            not_reals.append(column)
    attributes = _attributes(fields)
    with replacing(directory / f"{name}.parquet") as new:
        pq.write_table(
            pa.Table.from_arrays(arrays, schema=pa.schema(fields, pandas_metadata(attributes))),
            new,
            compression="zstd",
            use_dictionary=not_reals,
            use_byte_stream_split=reals,
        )


def _order_of(table: str, columns: Columns) -> list[str]:
    """Names of the columns in the order of their declarations; `KeyError` as in `write_table`."""
    order: list[str] = []
    required = set()
    for quantity in TABLES[table]:
        order += [column for column in columns if matches(quantity.name, column)]
        if not quantity.name.endswith("_*"):
            required.add(quantity.name)
    missing = required - columns.keys()
    not_declared = columns.keys() - set(order)
    wrong = missing | not_declared
    if wrong:
        names = ", ".join(sorted(wrong))
        raise KeyError(f"columns of {table} that are missing or not declared: {names}")
    return order


def _metadata(table: str, column: str) -> dict[str, str]:
    """Unit, label and meaning of a column; two of the names are those of the CF conventions."""
    quantity = declared(column, table)
    return {
        "unit": quantity.si_unit,
        "meaning": quantity.meaning,
        "units": quantity.si_unit,
        "long_name": quantity.label,
    }


def _attributes(fields: Iterable[Any]) -> dict[str, dict[str, str]]:
    """Units and labels of columns, which are the ``attrs`` of a data frame."""
    attributes: dict[str, dict[str, str]] = {}
    for name in _ATTRIBUTES:
        attributes[name] = {}
        for field in fields:
            attributes[name][field.name] = field.metadata[name.encode()].decode()
    return attributes


def pandas_metadata(attributes: Mapping[Any, Any]) -> dict[bytes, bytes]:
    """Metadata of a parquet file that ``pandas.read_parquet`` makes the ``attrs`` of its frame.

    This is how pandas itself stores them, from version 2.1 on. Other readers ignore it.

    Parameters
    ----------
    attributes
        What ``attrs`` has, of JSON's types.
    """
    return {b"PANDAS_ATTRS": json.dumps(attributes, ensure_ascii=False).encode()}


def _arrow(values: npt.NDArray[Any]) -> Any:
    """An arrow array that shares numpy's memory; ``pyarrow.array`` would import pandas."""
    import pyarrow as pa

    if values.dtype.kind == "U":
        return pa.array(values.tolist(), pa.string())
    if values.dtype == np.bool_:
        arrow_type = pa.bool_()
        buffer = pa.py_buffer(np.packbits(values, bitorder="little").tobytes())
    else:
        arrow_type = pa.from_numpy_dtype(values.dtype)
        buffer = pa.py_buffer(np.ascontiguousarray(values))
    all_valid = None  # no bits that say which values are missing
    return pa.Array.from_buffers(arrow_type, len(values), [all_valid, buffer])


def read_table(directory: str | Path, name: str) -> pd.DataFrame:
    """Read a table of a run into pandas.

    Parameters
    ----------
    directory
        The run directory.
    name
        Name of the table, such as ``trajectory``, ``walkers`` or ``bed``.

    Returns
    -------
    pandas.DataFrame
        SI units; ``attrs["units"]`` and ``attrs["long_name"]`` map its columns to units and labels.

    Raises
    ------
    InputError
        If the directory has no such table, or it is damaged.
    """
    table = _read(Path(directory), name)
    frame: pd.DataFrame = table.to_pandas()
    frame.attrs |= _attributes(table.schema)
    return frame


def read_columns(directory: Path, name: str) -> Columns:
    """Read a table of a run as arrays; errors are those of `read_table`.

    Parameters
    ----------
    directory
        The run directory.
    name
        Name of the table.
    """
    table = _read(directory, name)
    return {column: _numpy(table[column]) for column in table.column_names}


def _numpy(column: Any) -> npt.NDArray[Any]:
    """Values of a column of an arrow table; its ``to_numpy`` would import pandas."""
    import pyarrow as pa

    if pa.types.is_string(column.type):
        return np.array(column.to_pylist(), dtype=object)
    if column.null_count or not pa.types.is_primitive(column.type) or not len(column):
        values: npt.NDArray[Any] = column.to_numpy()
        return values
    array = column.combine_chunks()
    _, buffer = array.buffers()
    if pa.types.is_boolean(array.type):
        bits = np.unpackbits(np.frombuffer(buffer, np.uint8), bitorder="little")
        return bits[array.offset : array.offset + len(array)].astype(np.bool_)
    numbers = np.frombuffer(buffer, dtype=array.type.to_pandas_dtype())
    return numbers[array.offset : array.offset + len(array)].copy()


def _read(directory: Path, name: str) -> Any:
    """The arrow table of a run; errors are those of `read_table`."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = directory / f"{name}.parquet"
    if not path.exists():
        tables = sorted(file.stem for file in directory.glob("*.parquet"))
        table_names = ", ".join(tables) if tables else "none"
        raise input_error(directory, f"has no table {name}; it has {table_names}")
    try:
        # Not pq.read_table, which imports pandas and pyarrow.dataset: a third of a second.
        return pq.ParquetFile(pa.BufferReader(read_regular(path))).read()
    except (OSError, ValueError) as error:  # errors of pyarrow are both
        raise input_error(
            path, f"cannot be read ({error}); walkers run {directory} measures the run again"
        ) from error
