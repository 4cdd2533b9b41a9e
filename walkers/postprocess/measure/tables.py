"""The tables of a run: parquet files whose columns have units, labels and meanings.

They are written with pyarrow alone, because pandas takes a third of a second to import.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from walkers.errors import input_error
from walkers.files import read_regular, replacing
from walkers.postprocess.measure.quantities import TABLES, declared, matches

if TYPE_CHECKING:
    import pandas as pd

Columns: TypeAlias = dict[str, npt.NDArray[Any]]


def numbered_columns(name: str, values: npt.NDArray[Any]) -> Columns:
    """Columns ``name_1``, ``name_2``, … of beads or contacts, which are the last axis of the values."""
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
    """Write a table of a run.

    KeyError if columns are missing or not in `walkers.postprocess.measure.quantities.TABLES`.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    quantities = TABLES[name]
    order = [
        column for quantity in quantities for column in columns if matches(quantity.name, column)
    ]
    missing = {
        quantity.name for quantity in quantities if not quantity.name.endswith("_*")
    } - columns.keys()
    if wrong := missing | columns.keys() - set(order):
        raise KeyError(
            f"columns of {name} that are missing or not declared: {', '.join(sorted(wrong))}"
        )
    arrays = [_arrow(columns[column]) for column in order]
    fields = []
    for column, array in zip(order, arrays, strict=True):
        quantity = declared(column, name)
        unit = quantity.si_unit  # ``units`` and ``long_name`` are attributes of the CF conventions
        metadata = {
            "unit": unit,
            "meaning": quantity.meaning,
            "units": unit,
            "long_name": quantity.label,
        }
        fields.append(pa.field(column, array.type, metadata=metadata))
    reals = [field.name for field in fields if pa.types.is_floating(field.type)]
    with replacing(directory / f"{name}.parquet") as new:
        pq.write_table(
            pa.Table.from_arrays(arrays, schema=pa.schema(fields)),
            new,
            compression="zstd",
            use_dictionary=[field.name for field in fields if field.name not in reals],
            use_byte_stream_split=reals,
        )


def _arrow(values: npt.NDArray[Any]) -> Any:
    """An arrow array that shares numpy's memory; ``pyarrow.array`` would import pandas."""
    import pyarrow as pa

    if values.dtype.kind == "U":
        return pa.array(values.tolist(), pa.string())
    if values.dtype == np.bool_:
        bits = pa.py_buffer(np.packbits(values, bitorder="little").tobytes())
        return pa.Array.from_buffers(pa.bool_(), len(values), [None, bits])
    kind = pa.from_numpy_dtype(values.dtype)
    return pa.Array.from_buffers(
        kind, len(values), [None, pa.py_buffer(np.ascontiguousarray(values))]
    )


def read_table(directory: str | Path, name: str) -> pd.DataFrame:
    """Read a table of a run directory, such as ``trajectory``, ``walkers`` or ``bed``, into pandas, SI units.

    ``attrs["units"]`` and ``attrs["long_name"]`` map its columns to units and labels. `InputError` if the directory has
    no such table, or it is damaged.
    """
    table = _read(Path(directory), name)
    frame: pd.DataFrame = table.to_pandas()
    for name_of in ("units", "long_name"):
        frame.attrs[name_of] = {
            field.name: field.metadata[name_of.encode()].decode() for field in table.schema
        }
    return frame


def read_columns(directory: Path, name: str) -> Columns:
    """Like `read_table`, as arrays without pandas."""
    table = _read(directory, name)
    return {name: _numpy(table[name]) for name in table.column_names}


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
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = directory / f"{name}.parquet"
    if not path.exists():
        tables = ", ".join(sorted(path.stem for path in directory.glob("*.parquet")))
        raise input_error(directory, f"has no table {name}; it has {tables or 'none'}")
    try:
        # Not pq.read_table, which imports pandas and pyarrow.dataset: a third of a second.
        return pq.ParquetFile(pa.BufferReader(read_regular(path))).read()
    except (OSError, ValueError) as error:  # errors of pyarrow are both
        raise input_error(
            path, f"cannot be read ({error}); walkers run {directory} measures the run again"
        ) from error
