"""The tables of a run: parquet files whose columns have units and meanings.

They are written with pyarrow alone, because pandas takes a third of a second to import.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, get_type_hints

import numpy as np
import numpy.typing as npt

from walkers.runner.files import beside
from walkers.runner.manifest import check_unchanged

if TYPE_CHECKING:
    import pandas as pd

Columns: TypeAlias = dict[str, npt.NDArray[Any]]
NUMBERED = "numbered"
"""Marks a field with several columns, one per bead or contact: ``rotation_1``, ``rotation_2``, …"""


def described(table: type) -> dict[str, tuple[str, str]]:
    """Units and meanings of the columns of a table.

    A table is a dataclass, which contains either the arrays of all columns or a single row. Each field is
    ``Annotated`` with unit and meaning, and `NUMBERED` if it has several columns: then its name gets ``_*``.
    """
    found = {name: hint.__metadata__ for name, hint in get_type_hints(table, include_extras=True).items()}
    return {f"{name}_*" if one[2:] else name: one[:2] for name, one in found.items()}


def columns_of(table: Any) -> Columns:
    """The columns of a table that contains arrays; the last axis of numbered columns is the number."""
    columns: Columns = {}
    for name in described(type(table)):
        values = getattr(table, name.removesuffix("_*"))
        if name.endswith("_*"):
            columns |= {f"{name[:-1]}{number + 1}": values[..., number] for number in range(values.shape[-1])}
        else:
            columns[name] = values
    return columns


def columns_of_rows(table: type, rows: Sequence[Any]) -> Columns:
    """Columns of a table from its rows; there may be no rows."""
    kinds = get_type_hints(table)
    return {name: np.array([getattr(row, name) for row in rows], dtype=kinds[name]) for name in described(table)}


def write_table(directory: Path, name: str, table: type, columns: Columns) -> None:
    """Write a table into a run directory, beside its final place, and rename it; KeyError if a column is missing."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    declared = described(table)
    numbered = {key: f"{key.rpartition('_')[0]}_*" for key in columns}
    present = {key: one for key, one in declared.items() if not key.endswith("_*")}
    present |= {key: declared[name] for key, name in numbered.items() if name in declared}
    arrays = [_arrow(columns[key]) for key in present]
    fields = [
        pa.field(key, array.type, metadata={"unit": unit, "meaning": meaning})
        for (key, (unit, meaning)), array in zip(present.items(), arrays, strict=True)
    ]
    reals = [field.name for field in fields if pa.types.is_floating(field.type)]
    with beside(directory / f"{name}.parquet") as new:
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
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(np.ascontiguousarray(values))])


def intact(directory: Path, names: Iterable[str]) -> bool:
    """Whether the tables of a run directory exist and are complete (parquet magic bytes at both ends)."""
    for name in names:
        path = directory / f"{name}.parquet"
        if not path.is_file() or path.stat().st_size < 12:
            return False
        with path.open("rb") as file:
            head = file.read(4)
            file.seek(-4, 2)
            if not head == file.read(4) == b"PAR1":
                return False
    return True


def read_table(directory: str | Path, name: str) -> pd.DataFrame:
    """Read a table of a run directory into pandas, SI units.

    Parameters
    ----------
    directory
        The run directory.
    name
        A table of its analyses, such as ``trajectory``, ``walkers`` or ``bridges``; of a pile ``bed`` or ``clusters``.

    Returns
    -------
    DataFrame
        ``attrs["units"]`` maps columns to units.

    Raises
    ------
    FileNotFoundError
        If the directory has no such table.
    runner.manifest.FileChanged
        If the table has changed since the run was finished.
    """
    table = _read(Path(directory), name)
    frame: pd.DataFrame = table.to_pandas()
    frame.attrs["units"] = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    return frame


def read_columns(directory: Path, name: str) -> Columns:
    """Like `read_table`, as arrays without pandas."""
    table = _read(directory, name)
    return {column: table[column].to_numpy() for column in table.column_names}


def _read(directory: Path, name: str) -> Any:
    import pyarrow.parquet as pq

    path = directory / f"{name}.parquet"
    if not path.exists():
        there = ", ".join(sorted(one.stem for one in directory.glob("*.parquet")))
        raise FileNotFoundError(f"{directory} has no table {name}; it has {there or 'none'}")
    check_unchanged(directory, [path.name])
    return pq.read_table(path)
