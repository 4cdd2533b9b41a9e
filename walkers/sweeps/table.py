"""The table of a sweep: one row per point, what was varied, what follows from it, and what came out.

Figure, report, comparison and spread of a sweep are made from it. Its ``attrs`` tell of the columns (``units``,
``meanings``) and of the sweep (``sweep``, ``title``, ``axes``: the keys that vary, those together that go together).
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterable, Mapping
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import refused
from walkers.inputs.library import suggestion
from walkers.runner.files import write_bytes
from walkers.sweeps.record import (
    RECORD_NAME,
    DamagedRunError,
    PointState,
    SweepRecord,
    derived_columns,
    read_record,
    result_columns,
    result_in,
    row_of,
    states,
)

if TYPE_CHECKING:
    import pandas as pd

STATE = {
    "status": ("", "finished, failed, running or missing"),
    "lost": ("", "number of beads that left the simulation box, so that there is no result"),
    "reason": ("", "name of the failure, empty where there is none"),
    "run": ("", "run directory, from where the table was made; of a failed point what is left of it"),
}
RESULTS = ("velocity", "climbs")
"""What is shown of a sweep if nothing else is asked for, the first that the table has."""
ERRORS = {"velocity": "standard_error"}
"""Columns with the standard errors of others."""
FORMATS = ("csv", "parquet", "json")
_LEFT_OUT = {
    *("mass_asymmetry", "frequency", "peak_acceleration", "peak_velocity", "amplitude", "radius_1", "radius_2"),
    *("standard_error", "right_facing", "left_facing", "sliding_2", "sliding_3", "open_1", "open_2", "open_3"),
    *("separated_fraction", "orientation_end", "turned_round", "walkers_met", "lost", "reason"),
}
"""Columns that a table to look at leaves out."""
_VARIED = "varied"
"""Meaning of the columns of what varies."""
_STATUSES = ("finished", "running", "failed", "missing", "not needed")
_MOST_FAILURES = 10


def load(directory: str | Path) -> pd.DataFrame:
    """The table of a sweep, given its directory such as ``runs/fig2``; `InputError` if it is none.

    Returns
    -------
    DataFrame
        One row per point, in the order of the sweep; a descent's points below its end are left out. Columns are
        ``point``, the keys that vary (in the unit of the sweep file), and (SI units)
        `walkers.sweeps.record.derived_columns`, `walkers.sweeps.record.result_columns` and `STATE`.
        ``attrs["units"]`` maps columns to units, ``attrs["meanings"]`` to what they are. Numbers of points that are
        not finished are NaN.
    """
    import pandas as pd

    record = read_record(directory)
    varied: dict[str, tuple[str, str]] = {}
    for place, (key, unit) in enumerate(record.units.items()):
        # A key with several numbers, such as the radii, has a column for each.
        parts = max((len(values[place]) for values in record.values if isinstance(values[place], list)), default=0)
        varied |= dict.fromkeys([f"{key}[{part}]" for part in range(parts)] or [key], (unit or "", _VARIED))
    found = {**derived_columns(record.analyses), **result_columns(record.analyses)}
    described = {"point": ("", "number of the point"), **varied, **found, **STATE}
    rows = [
        dict.fromkeys(found, nan) | _row(record, number, state)
        for number, state in enumerate(states(record))
        if state.status != "not needed"
    ]
    frame = _with_units(pd.DataFrame(rows, columns=list(described)), described)
    frame.attrs |= {"sweep": record.name, "title": record.title or record.name, "axes": record.axes}
    return frame


def _with_units(frame: pd.DataFrame, described: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    frame.attrs["units"] = {name: unit for name, (unit, _) in described.items()}
    frame.attrs["meanings"] = {name: meaning for name, (_, meaning) in described.items()}
    return frame


def _row(record: SweepRecord, number: int, state: PointState) -> dict[str, Any]:
    """What is known of a point."""
    row: dict[str, Any] = {"point": number}
    for key, value in zip(record.units, record.values[number], strict=True):
        row |= {f"{key}[{part}]": one for part, one in enumerate(value)} if isinstance(value, list) else {key: value}
    row |= record.derived[number]
    row |= {"status": state.status, "lost": state.lost, "reason": state.reason or ""}
    row["run"] = os.path.relpath(state.directory) if state.directory else ""
    if state.status != "finished" or state.directory is None:
        return row
    try:
        return row | row_of(result_in(state.directory))
    except DamagedRunError:
        return row | {"status": "failed", "reason": DamagedRunError.__name__}


def varied_columns(frame: pd.DataFrame) -> list[str]:
    """The columns of a sweep's table that have the keys that vary."""
    return [name for name, meaning in frame.attrs["meanings"].items() if meaning == _VARIED]


def default_column(frame: pd.DataFrame) -> str:
    """The column of a table that is shown if nothing else is asked for."""
    return next((name for name in RESULTS if name in frame), "frequency")


def find_name(option: str, wanted: str, names: Iterable[str]) -> str:
    """The name that is meant: itself, or the only one that ends so; `InputError` if there is none, or are several."""
    known = list(dict.fromkeys(names))
    found = [name for name in known if name == wanted] or [name for name in known if name.endswith(f".{wanted}")]
    if len(found) == 1:
        return found[0]
    told = f"expected one of {', '.join(found or known)}{'' if found else suggestion(wanted, known)}"
    raise refused(option, f'"{wanted}": {told}')


def with_unit(words: str, unit: str | None) -> str:
    """A label with its unit, if there is one."""
    return f"{words} ({unit})" if unit else words


def value_text(value: Any) -> str:
    """A value of a key as text, several with strokes between them."""
    if isinstance(value, list):
        return "/".join(map(value_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def encoded(frame: pd.DataFrame, form: str) -> bytes:
    """A sweep's table as CSV (units in the head), JSON (with units and meanings) or parquet (units in the metadata)."""
    units, meanings = frame.attrs["units"], frame.attrs["meanings"]
    if form == "csv":
        heads = [with_unit(name, units[name]) for name in frame.columns]
        return str(frame.to_csv(index=False, header=heads)).encode()
    if form == "json":  # not by DataFrame.to_json, which rounds to decimals
        rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
        contents = {"units": units, "meanings": meanings, "points": rows}
        return (json.dumps(contents, indent=2, ensure_ascii=False) + "\n").encode()
    import pyarrow as pa
    import pyarrow.parquet as pq

    # Of numbers and words ("auto") words, of booleans and NaN (not finished) booleans.
    mixed = {name: set(frame[name].map(type)) for name in frame.columns if frame[name].dtype == object}
    types = {name: "boolean" for name, kinds in mixed.items() if bool in kinds and str not in kinds}
    types |= {name: "str" for name, kinds in mixed.items() if str in kinds and len(kinds) > 1}
    table = pa.Table.from_pandas(frame.astype(types), preserve_index=False)
    fields = [one.with_metadata({"unit": units[one.name], "meaning": meanings[one.name]}) for one in table.schema]
    buffer = io.BytesIO()
    pq.write_table(table.cast(pa.schema(fields, metadata=table.schema.metadata)), buffer, compression="zstd")
    return buffer.getvalue()


def write_table_file(frame: pd.DataFrame, path: Path) -> None:
    """Write a table in the form that the file's name ends in; `InputError` if that is none of `FORMATS`."""
    if path.suffix.lstrip(".") not in FORMATS:
        raise refused(path, f"expected a name that ends in .{', .'.join(FORMATS)}")
    write_bytes(path, encoded(frame, path.suffix.lstrip(".")))


def short_text(frame: pd.DataFrame) -> str:
    """A table to look at: what varied, Γ0, sin δ, speeds in mm/s, status, run."""
    import pandas as pd

    shown = frame.drop(columns=[name for name in frame.columns if name in _LEFT_OUT])
    units = dict(frame.attrs.get("units", {}))
    for name in shown.columns:
        if units.get(name) == "m/s":
            shown[name], units[name] = shown[name].astype(float) * 1e3, "mm/s"
    shown.columns = pd.Index([with_unit(name, units.get(name)) for name in shown.columns])
    return str(shown.to_string(index=False, float_format=lambda value: f"{value:.4g}", na_rep="-"))


def thresholds(directory: str | Path) -> pd.DataFrame:
    """Where the descents of a sweep ended; `InputError` if it has none.

    Returns
    -------
    DataFrame
        One row per descent: the other keys that vary, ``moving`` and ``at_rest``, the last values of the lowered key at
        which the walkers moved and the first at which they did not (NaN where there is none, yet or at all), and
        ``gamma0_moving`` and ``gamma0_at_rest``, the dimensionless peak forces Γ0 there.
    """
    import numpy as np
    import pandas as pd

    record = read_record(directory)
    descent = record.descent
    if descent is None:
        raise refused(directory, "the sweep has no descent, hence no thresholds")
    frame = load(directory)
    others = [name for name in varied_columns(frame) if name != descent.key]
    rows = []
    for _, points in frame.groupby(frame["point"] // descent.steps):
        finished = points[points["status"] == "finished"]
        slow = np.abs(finished["velocity"].to_numpy(dtype=float)) < descent.until_below
        row = {name: points.iloc[0][name] for name in others}
        for name, part in (("moving", finished[~slow].tail(1)), ("at_rest", finished[slow].head(1))):
            row[name] = part.iloc[0][descent.key] if len(part) else nan
            row[f"gamma0_{name}"] = part.iloc[0]["gamma0"] if len(part) else nan
        rows.append(row)
    unit = record.units[descent.key] or ""
    described = {name: (frame.attrs["units"][name], _VARIED) for name in others} | {
        "moving": (unit, f"last {descent.key} at which the walkers moved"),
        "gamma0_moving": ("", "dimensionless peak force Γ0 of moving"),
        "at_rest": (unit, f"first {descent.key} at which they did not"),
        "gamma0_at_rest": ("", "dimensionless peak force Γ0 of at_rest"),
    }
    return _with_units(pd.DataFrame(rows), described)


def sweeps_in(directory: Path) -> list[Path]:
    """The sweep's directory itself, or those in a folder; `InputError` if there is none."""
    if (directory / RECORD_NAME).exists():
        return [directory]
    found = sorted(path.parent for path in directory.glob(f"*/{RECORD_NAME}"))
    if not found:
        raise refused(directory, f"neither a sweep's directory (with a {RECORD_NAME}) nor a folder of such")
    return found


def describe_status(directory: Path) -> str:
    """Numbers of points by what has become of them, failures with their reasons, and the thresholds of descents."""
    record = read_record(directory)
    found = states(record)
    count = {status: sum(state.status == status for state in found) for status in _STATUSES}
    told = ", ".join(f"{number} {status}" for status, number in count.items() if number)
    lines = [f"{record.name}: {len(found)} points, {told or 'none'}"]
    failed = [(number, state) for number, state in enumerate(found) if state.status == "failed"]
    lines += [f"  failed     point {number}: {state.message}" for number, state in failed[:_MOST_FAILURES]]
    if len(failed) > _MOST_FAILURES:
        lines.append(f"             and {len(failed) - _MOST_FAILURES} more")
    if record.descent is not None:
        lines += [f"  {line}" for line in short_text(thresholds(directory)).splitlines()]
    lines.append(f"  table      walkers table {directory}")
    return "\n".join(lines)
