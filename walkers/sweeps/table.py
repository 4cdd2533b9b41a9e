"""The table of a sweep: one row per point, what was varied, what follows from it, and what came out."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem
from walkers.runner.files import write_bytes
from walkers.sweeps.columns import derived_columns, result_columns, row_of
from walkers.sweeps.factors import with_unit
from walkers.sweeps.record import DamagedRunError, PointState, SweepRecord, chains, read_record, result_in, states

if TYPE_CHECKING:
    import pandas as pd

STATE = {
    "status": ("", "finished, failed, running or missing"),
    "lost": ("", "number of beads that left the simulation box, so that there is no result"),
    "reason": ("", "name of the failure, empty where there is none"),
    "run": ("", "run directory, from where the table was made; of a failed point what is left of it"),
}

_INPUTS = ("peak_velocity",)
"""Speeds that are no results."""
_LEFT_OUT = {
    *("mass_asymmetry", "frequency", "peak_acceleration", "peak_velocity", "amplitude", "radius_1", "radius_2"),
    *("standard_error", "right_facing", "left_facing", "sliding_2", "sliding_3", "open_1", "open_2", "open_3"),
    *("separated_fraction", "orientation_end", "turned_round", "walkers_met", "lost", "reason"),
}
"""Columns that a table to look at leaves out."""

FORMATS = ("csv", "parquet", "json")
_VARIED = "varied"
"""Meaning of the columns of what varies."""


def load(directory: str | Path) -> pd.DataFrame:
    """The table of a sweep.

    Parameters
    ----------
    directory
        A sweep's directory, such as ``runs/fig2``.

    Returns
    -------
    DataFrame
        One row per point, in the order of the sweep; a descent's points below its end are left out. Columns are
        ``point``, the keys that vary (in the unit of the sweep file), and (SI units)
        `walkers.sweeps.columns.derived_columns`, `walkers.sweeps.columns.result_columns` and `STATE`.
        ``attrs["units"]`` maps columns to units, ``attrs["meanings"]`` to what they are. Numbers of points that are
        not finished are NaN.

    Raises
    ------
    InputError
        If it is no sweep's directory.
    """
    import pandas as pd

    record = read_record(directory)
    rows = [_row(record, number, state) for number, state in enumerate(states(record)) if state.status != "not needed"]
    described = {**_varied(record), **derived_columns(record.analyses), **result_columns(record.analyses), **STATE}
    described = {"point": ("", "number of the point"), **described}
    frame = _with_units(pd.DataFrame(rows, columns=list(described)), described)
    frame.attrs["sweep"] = record.name
    return frame


def _with_units(frame: pd.DataFrame, described: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    """A table with the units and meanings of its columns."""
    frame.attrs["units"] = {name: unit for name, (unit, _) in described.items()}
    frame.attrs["meanings"] = {name: meaning for name, (_, meaning) in described.items()}
    return frame


def _varied(record: SweepRecord) -> dict[str, tuple[str, str]]:
    """The columns of the keys that vary; a key with several numbers, such as the radii, has one for each."""
    columns: dict[str, tuple[str, str]] = {}
    for place, (key, unit) in enumerate(record.units.items()):
        parts = max((len(values[place]) for values in record.values if isinstance(values[place], list)), default=0)
        names = [f"{key}[{part}]" for part in range(parts)] or [key]
        columns |= dict.fromkeys(names, (unit or "", _VARIED))
    return columns


def varied_columns(frame: pd.DataFrame) -> list[str]:
    """The columns of a sweep's table that have the keys that vary."""
    return [name for name, meaning in frame.attrs["meanings"].items() if meaning == _VARIED]


def _row(record: SweepRecord, number: int, state: PointState) -> dict[str, Any]:
    row: dict[str, Any] = {"point": number}
    for key, value in zip(record.units, record.values[number], strict=True):
        row |= {f"{key}[{part}]": one for part, one in enumerate(value)} if isinstance(value, list) else {key: value}
    row |= dict(zip(derived_columns(record.analyses), record.derived[number], strict=True))
    row |= dict.fromkeys(result_columns(record.analyses), nan) | {
        "status": state.status,
        "lost": state.lost,
        "reason": state.reason or "",
        "run": os.path.relpath(state.directory) if state.directory else "",
    }
    if state.status != "finished" or state.directory is None:
        return row
    try:
        return row | row_of(result_in(state.directory))
    except DamagedRunError:
        return row | {"status": "failed", "reason": DamagedRunError.__name__}


def encoded(frame: pd.DataFrame, form: str) -> bytes:
    """A sweep's table as CSV (units in the head), JSON (with units and meanings) or parquet (units in the metadata)."""
    units = frame.attrs["units"]
    if form == "csv":
        heads = [with_unit(name, units[name]) for name in frame.columns]
        return str(frame.to_csv(index=False, header=heads)).encode()
    if form == "parquet":
        return _parquet(frame)
    # Not DataFrame.to_json, which rounds to decimals.
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    contents = {"units": units, "meanings": frame.attrs["meanings"], "points": rows}
    return (json.dumps(contents, indent=2, ensure_ascii=False) + "\n").encode()


def short_text(frame: pd.DataFrame) -> str:
    """A table to look at: what varied, Γ0, sin δ, speeds in mm/s, status, run."""
    import pandas as pd

    shown = frame.drop(columns=[name for name in frame.columns if name in _LEFT_OUT])
    units = dict(frame.attrs.get("units", {}))
    for name, unit in units.items():
        if name in shown and unit == "m/s" and name not in _INPUTS:
            shown[name], units[name] = shown[name].astype(float) * 1e3, "mm/s"
    shown.columns = pd.Index([with_unit(name, units.get(name, "")) for name in shown.columns])
    return str(shown.to_string(index=False, float_format=lambda value: f"{value:.4g}", na_rep="-"))


def _parquet(frame: pd.DataFrame) -> bytes:
    import io

    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_pandas(frame.astype(_types(frame)), preserve_index=False)
    units, meanings = frame.attrs["units"], frame.attrs["meanings"]
    fields = [
        field.with_metadata({"unit": units[field.name], "meaning": meanings[field.name]}) for field in table.schema
    ]
    buffer = io.BytesIO()
    pq.write_table(table.cast(pa.schema(fields, metadata=table.schema.metadata)), buffer, compression="zstd")
    return buffer.getvalue()


def _types(frame: pd.DataFrame) -> dict[str, str]:
    """Types of columns of several: of numbers and words ("auto") words, of booleans and NaN (not finished) booleans."""
    mixed = {name: set(frame[name].map(type)) for name in frame.columns if frame[name].dtype == object}
    words = {name: "str" for name, kinds in mixed.items() if str in kinds and len(kinds) > 1}
    return words | {name: "boolean" for name, kinds in mixed.items() if bool in kinds and str not in kinds}


def thresholds(directory: str | Path) -> pd.DataFrame:
    """Where the descents of a sweep ended.

    Parameters
    ----------
    directory
        The directory of a sweep with a descent.

    Returns
    -------
    DataFrame
        One row per descent: the other keys that vary, ``moving`` and ``at_rest``, the last values of the lowered key at
        which the walkers moved and the first at which they did not (NaN where there is none, yet or at all), and
        ``gamma0_moving`` and ``gamma0_at_rest``, the dimensionless peak forces Γ0 there.

    Raises
    ------
    InputError
        If it is no such directory.
    """
    import numpy as np
    import pandas as pd

    record = read_record(directory)
    descent = record.descent
    if descent is None:
        raise InputError(str(directory), [Problem("", None, "the sweep has no descent, hence no thresholds")])
    frame = load(directory).set_index("point", drop=False)
    others = [name for name in varied_columns(frame) if name != descent.key]
    rows = []
    for chain in chains(record):
        points = frame.loc[[number for number in chain if number in frame.index]]
        finished = points[points["status"] == "finished"]
        slow = np.abs(finished["velocity"].to_numpy(dtype=float)) < descent.until_below
        row = {name: points.iloc[0][name] for name in others}
        for name, part in (("moving", finished[~slow].tail(1)), ("at_rest", finished[slow].head(1))):
            row[name] = part.iloc[0][descent.key] if len(part) else nan
            row[f"gamma0_{name}"] = part.iloc[0]["gamma0"] if len(part) else nan
        rows.append(row)
    table, unit = pd.DataFrame(rows), record.units[descent.key] or ""
    described = {name: (frame.attrs["units"][name], _VARIED) for name in others} | {
        "moving": (unit, f"last {descent.key} at which the walkers moved"),
        "gamma0_moving": ("", "dimensionless peak force Γ0 of moving"),
        "at_rest": (unit, f"first {descent.key} at which they did not"),
        "gamma0_at_rest": ("", "dimensionless peak force Γ0 of at_rest"),
    }
    return _with_units(table, described)


def write_table_file(frame: pd.DataFrame, path: Path) -> None:
    """Write a table in the form that the file's name ends in.

    Raises
    ------
    InputError
        If that is none of `FORMATS`.
    """
    if path.suffix.lstrip(".") not in FORMATS:
        raise InputError(str(path), [Problem("", None, f"expected a name that ends in .{', .'.join(FORMATS)}")])
    write_bytes(path, encoded(frame, path.suffix.lstrip(".")))
