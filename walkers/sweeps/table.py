"""The table of a sweep: one row per point, with the varied keys and the numbers of the run.

Lists, figures, reports and spreads group and print this table; they are made elsewhere.

The ``attrs`` of the data frame describe its columns and the sweep:

- ``units``, ``meanings``: unit and meaning of each column
- ``sweep``, ``title``: name and title of the sweep
- ``varied``: the columns of the varied keys
- ``axes``: for each axis, the keys that vary together
- ``sampled``: for each key that is drawn from a range, whether the range is log-uniform
- ``until_below``: the speed (m/s) below which a descent ends; None if the sweep has no descent

A *descent* lowers the last varied key from point to point until the walkers rest; its *threshold*
lies between the last point at which they move and the first at which they rest.
"""

from __future__ import annotations

import io
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from math import nan
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, input_error, suggestion
from walkers.files import json_bytes, write_bytes
from walkers.inputs.axes import ranges_of
from walkers.inputs.origins import text_of
from walkers.postprocess.measure.numbers import headline
from walkers.postprocess.measure.quantities import (
    ENDS,
    GROUPS,
    Quantity,
    described_columns,
    is_declared,
    unit_shown,
)
from walkers.postprocess.measure.results import Results, modules_of
from walkers.postprocess.measure.sides import SEPARATED
from walkers.postprocess.measure.tables import pandas_metadata
from walkers.rounding import counted, rounded
from walkers.runner.run_directory import case_of
from walkers.runs.case_text import short_keys
from walkers.runs.status import PointState, status_text
from walkers.sweeps.record import SweepRecord, read_sweep_record, states
from walkers.terminal import HEADING, styled, wrapped
from walkers.text import aligned_blocks, with_unit

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.sweep import SweepDefinition
    from walkers.inputs.tables.case import Case

STATE = {
    "status": ("", "finished, failed, running or missing"),
    "lost": (
        "",
        "number of beads that left the simulation box; a run that loses beads has no result",
    ),
    "reason": ("", "name of the failure, or empty"),
    "message": ("", "message of the failure, how much of an interrupted run is done, or empty"),
    "run": ("", "run directory, relative to the folder in which the table was written"),
}
"""Columns about the state of a point: their units and meanings."""
_RESULTS = ("velocity", "climbs")
"""Main results of walkers and of piles."""
SIDES = ("right_facing", "left_facing")
"""Velocity columns that replace the mean if `sides_differ`."""
FACING_DOWN = {"right_facing": "left_facing", "axial_velocity": "axial_left_facing"}
"""Columns of walkers that face down, by the columns of those that face up (`main_columns`)."""
SEEDS = ("run.seed", "seed")
"""Keys of the random numbers of a start; points that differ only in them repeat an experiment."""
TABLE_FORMATS = ("csv", "parquet", "json")
"""Formats of table files, which are the endings of their names."""
_SHOWN = {
    # walkers
    "gamma0",
    "sin_delta",
    "rotation_1",
    "sliding_1",
    "steady",
    "walkers",
    "upright",
    "work",
    "cost_of_transport",
    # walkers that meet
    "merged",
    "clustered_share",
    "held_share",
    "free_speed",
    "slow_share",
    "coverage",
    # piles
    "beads",
    "large",
    "duration",
    "climbs",
    "onset",
    "speed",
    "highest",
    "led_by_large",
    "clusters",
    "surface_end",
    "brazil_nut_end",
    "settling",
}
"""Numbers of results in the printed table, beside the main one."""
_NOT_PRINTED = ("lost", "reason", "message")
"""Columns of `STATE` that the printed table leaves out."""
_MOST_FAILURES = 10
"""Largest number of failed points whose messages are printed."""


@dataclass(frozen=True)
class SweepTable:
    """The table of a sweep with the results of its finished points, all read once.

    Attributes
    ----------
    frame
        One row per point, as from `load_table`.
    results
        Results of the finished points by their numbers.
    """

    frame: pd.DataFrame
    results: Mapping[int, Results] = field(default_factory=dict)

    @property
    def finished(self) -> pd.DataFrame:
        """The rows of the finished points."""
        return self.frame[self.frame["status"] == "finished"]

    @cached_property
    def readable_cases(self) -> Mapping[int, Case]:
        """Cases of the finished points by their numbers, as their runs have recorded them.

        Those of runs that were damaged after they had been measured are left out. To expand the
        record again would take three times as long, and it would give the values of today's
        library.
        """
        cases = {}
        for point, result in self.results.items():
            with suppress(OSError, ValueError, KeyError, TypeError):
                cases[point] = case_of(result.directory)
        return cases

    @cached_property
    def cases(self) -> Mapping[int, Case]:
        """The `readable_cases`, which must be those of all finished points."""
        for point, result in self.results.items():
            if point not in self.readable_cases:
                case_of(result.directory)  # says what is wrong with it
        return self.readable_cases

    def results_of(self, rows: pd.DataFrame) -> list[Results]:
        """The results of some rows of the table, once for each run."""
        by_directory = {}
        for point in rows["point"]:
            result = self.results[point]
            by_directory[result.directory] = result
        return list(by_directory.values())


def load_table(directory: str | Path) -> pd.DataFrame:
    """The table of a sweep in a directory such as ``runs/fig2``.

    Returns
    -------
    pandas.DataFrame
        Columns are ``point``, the keys that vary (in the unit of the sweep file), and in SI units
        the numbers of results (NaN for unfinished points) and `STATE`.

    Raises
    ------
    InputError
        If the directory contains no sweep.
    """
    return table_of(read_sweep_record(directory)).frame


def table_of(record: SweepRecord) -> SweepTable:
    """The table of a recorded sweep, with the results of its finished points."""
    points = states(record, results=True)
    results = {}
    for number, state in enumerate(points):
        if state.result is not None:
            results[number] = state.result
    return SweepTable(_frame(record.sweep, points), results)


def _frame(sweep: SweepDefinition, points: Sequence[PointState]) -> pd.DataFrame:
    """The data frame of a sweep, with descriptions of its columns and of the sweep."""
    import pandas as pd

    varied = _varied_columns(sweep)
    numbers: set[str] = set()
    for point in points:
        numbers.update(point.result or ())
    if not all(point.result for point in points):
        numbers.update(_declared_numbers(sweep))
    described = {
        "point": ("", "number of the point"),
        **varied,
        **described_columns(numbers),
        **STATE,
    }
    rows = [_row(number, sweep, state) for number, state in enumerate(points)]
    frame = pd.DataFrame(rows, columns=list(described))
    frame.attrs["units"] = {}
    frame.attrs["meanings"] = {}
    for name, (unit, meaning) in described.items():
        frame.attrs["units"][name] = unit
        frame.attrs["meanings"][name] = meaning
    frame.attrs["sweep"] = sweep.name
    frame.attrs["title"] = sweep.title or sweep.name
    frame.attrs["until_below"] = sweep.until_below
    frame.attrs["varied"] = list(varied)
    frame.attrs["axes"] = [axis.keys for axis in sweep.axes]
    frame.attrs["sampled"] = {}
    for sample in sweep.file.get("sample", []):
        for key, span in ranges_of(sample["ranges"]).items():
            frame.attrs["sampled"][key] = span.logarithmic
    return frame


def _varied_columns(sweep: SweepDefinition) -> dict[str, tuple[str, str]]:
    """Unit and meaning of the columns of the varied keys.

    A key with several numbers has a column for each number. If the key is a word at other points,
    such as an axis that is ``"x"`` or a direction, the words have a column too.
    """
    columns = {}
    values_by_key = zip(*sweep.values, strict=True)
    for (key, unit), values in zip(sweep.units.items(), values_by_key, strict=True):
        parts = 0
        for value in values:
            if isinstance(value, list):
                parts = max(parts, len(value))
            else:
                columns[key] = (unit or "", "varied")
        for part in range(parts):
            columns[f"{key}[{part}]"] = (unit or "", "varied")
    return columns


def _declared_numbers(sweep: SweepDefinition) -> list[str]:
    """The numbers that results of a sweep's cases have, without those of single beads.

    The list is empty if the first case cannot be read.
    """
    try:
        modules = modules_of(next(sweep.cases()))
    except InputError:
        return []
    numbers: list[Quantity] = []
    for module in modules:
        numbers += GROUPS[module.NAME]
    numbers += GROUPS["drive"]
    return [number.name for number in numbers if not number.name.endswith("*")]


def _row(number: int, sweep: SweepDefinition, state: PointState) -> dict[str, Any]:
    """The row of a point by the names of its columns."""
    row: dict[str, Any] = {"point": number, **(state.result or {})}
    for key, value in zip(sweep.keys, sweep.values[number], strict=True):
        if isinstance(value, list):
            for part, item in enumerate(value):
                row[f"{key}[{part}]"] = item
        else:
            row[key] = value
    row["status"] = state.status
    row["lost"] = state.lost
    row["reason"] = state.reason or ""
    row["message"] = state.message or ""
    row["run"] = os.path.relpath(state.directory) if state.directory else ""
    return row


def seed_groups(frame: pd.DataFrame) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    """Group the points of a sweep's table that differ in nothing but their seeds.

    Yields
    ------
    values : dict
        Values of the varied columns that distinguish the group; empty if only seeds vary.
    rows : pandas.DataFrame
        The rows of the group.
    """
    columns = []
    for name in frame.attrs["varied"]:
        differs = frame[name].nunique(dropna=False) > 1
        if differs and name not in SEEDS:
            columns.append(name)
    if not columns:
        yield {}, frame
        return
    for values, rows in frame.groupby(columns, sort=False, dropna=False):
        # Rows of the table itself have its `attrs`; pandas does not promise them for groups.
        yield dict(zip(columns, values, strict=True)), frame.loc[rows.index]


def walking_points(frame: pd.DataFrame) -> pd.DataFrame:
    """The points of a sweep's table without those whose walkers came apart and have no velocity."""
    if "separated_fraction" not in frame:
        return frame
    return frame[~(frame["separated_fraction"] > SEPARATED)]


def sides_differ(frame: pd.DataFrame) -> bool:
    """Whether walkers that face right (up) and left (down) differ at any point of a table.

    If they do, their mean velocity means nothing.
    """
    return "facings_differ" in frame and bool(frame["facings_differ"].eq(True).any())


def main_columns(frame: pd.DataFrame) -> list[str]:
    """The main results in order of preference: the `headline` of points, then the other ones."""
    if "velocity" not in frame:
        return list(_RESULTS)
    finished: Any = frame.dropna(subset="velocity").to_dict("records")
    headlines = {headline(row) for row in finished}
    for name in ("axial_velocity", "right_facing"):
        if name in headlines:
            return [name, *_RESULTS]
    return list(_RESULTS)


def default_column(frame: pd.DataFrame) -> str:
    """The column of a table that is shown by default."""
    for name in main_columns(frame):
        if name in frame:
            return name
    return "frequency"


def find_name(option: str, word: str, names: Iterable[str]) -> str:
    """Find the name that a word means.

    Parameters
    ----------
    option
        The option or argument that has the word, for the message of the error.
    word
        A name, or its last part: what follows a point.
    names
        All names.

    Raises
    ------
    InputError
        If no name or several names end with the word.
    """
    candidates = list(dict.fromkeys(names))
    if word in candidates:
        return word
    matches = [name for name in candidates if name.endswith(f".{word}")]
    if len(matches) == 1:
        return matches[0]
    expected = f"expected one of {', '.join(matches or candidates)}"
    if not matches:
        expected += suggestion(word, candidates)
    raise input_error(option, f'"{word}": {expected}')


def value_text(value: Any, unit: str | None = None) -> str:
    """A value of a key as text; several numbers are separated by slashes.

    The unit follows unless the value is a word such as auto.
    """
    text = "/".join(map(text_of, value)) if isinstance(value, list) else text_of(value)
    if unit and not isinstance(value, str):
        return f"{text} {unit}"
    return text


def key_values(frame: pd.DataFrame, key: str) -> tuple[list[Any], str | None]:
    """The values of a varied key at all points.

    Returns
    -------
    values : list
        A value for each row of the table; a list for a key with several numbers.
    unit : str or None
        Their unit.
    """
    names = [name for name in frame.attrs["varied"] if name == key or name.startswith(f"{key}[")]
    rows = frame[names].astype(object)
    unit = frame.attrs["units"][names[0]]
    if names == [key]:
        return rows[key].tolist(), unit
    values: list[Any] = []
    for _, row in rows.iterrows():
        given = row.dropna()
        values.append(given[key] if key in given else given.tolist())
    return values, unit


def key_texts(frame: pd.DataFrame) -> pd.DataFrame:
    """The values of the varied keys as text with units: a column for each key, a row per point."""
    import pandas as pd

    texts = {}
    for keys in frame.attrs["axes"]:
        for key in keys:
            values, unit = key_values(frame, key)
            texts[key] = [value_text(value, unit) for value in values]
    return pd.DataFrame(texts, index=frame.index, dtype=object)


def encoded(frame: pd.DataFrame, form: str) -> bytes:
    """A sweep's table as the contents of a file, in one of `TABLE_FORMATS`.

    CSV has the units in its head, JSON has units and meanings beside the points, and parquet has
    both in the metadata of its columns, and all ``attrs`` of the frame for pandas.
    """
    if form == "csv":
        return _csv_bytes(frame)
    if form == "json":
        return _json_bytes(frame)
    return _parquet_bytes(frame)


def _csv_bytes(frame: pd.DataFrame) -> bytes:
    units = frame.attrs["units"]
    heads = [with_unit(name, units[name]) for name in frame.columns]
    return str(frame.to_csv(index=False, header=heads)).encode()


def _json_bytes(frame: pd.DataFrame) -> bytes:
    """The table as JSON; not by `pandas.DataFrame.to_json`, which rounds to decimals."""
    rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
    contents = {"units": frame.attrs["units"], "meanings": frame.attrs["meanings"], "points": rows}
    return json_bytes(contents)


def _parquet_bytes(frame: pd.DataFrame) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    units = frame.attrs["units"]
    meanings = frame.attrs["meanings"]
    table = pa.Table.from_pandas(frame.astype(_column_types(frame)), preserve_index=False)
    fields = []
    for column in table.schema:
        metadata = {"unit": units[column.name], "meaning": meanings[column.name]}
        fields.append(column.with_metadata(metadata))
    file_metadata: dict[Any, Any] = dict(table.schema.metadata or {})
    file_metadata |= pandas_metadata(frame.attrs)
    schema = pa.schema(fields, metadata=file_metadata)
    buffer = io.BytesIO()
    pq.write_table(table.cast(schema), buffer, compression="zstd")
    return buffer.getvalue()


def _column_types(frame: pd.DataFrame) -> dict[str, str]:
    """The types of columns that hold several types, because a parquet column holds one.

    Numbers and words ("auto") become words; booleans and NaN (not finished) become booleans.
    """
    types = {}
    for name in frame.columns:
        if frame[name].dtype != object:
            continue
        kinds = set(frame[name].map(type))
        if str in kinds and len(kinds) > 1:
            types[name] = "str"
        elif bool in kinds and str not in kinds:
            types[name] = "boolean"
    return types


def write_table_file(frame: pd.DataFrame, path: Path) -> None:
    """Write a table in the format of the path's suffix; `InputError` for an unknown suffix."""
    form = path.suffix.lstrip(".")
    if form not in TABLE_FORMATS:
        raise input_error(path, f"expected a name that ends in .{', .'.join(TABLE_FORMATS)}")
    write_bytes(path, encoded(frame, form))


def cells_of(
    frame: pd.DataFrame, heading_of: Callable[[str], str] | None = None
) -> tuple[pd.DataFrame, str]:
    """The varied keys and the main results of a table as text, for people.

    Numbers are in mm, mm/s, nJ and degrees; those of keys are in the unit of the sweep file.

    Parameters
    ----------
    frame
        A sweep's table, or its thresholds.
    heading_of
        The heading of a column; None: keys are called by their last parts, and other columns by
        their names.

    Returns
    -------
    cells : pandas.DataFrame
        Texts, with the units in the headings.
    same : str
        The results that are the same at all finished points of a sweep, which have no column.
    """
    import pandas as pd

    names = _printed_columns(frame)
    varied = frame.attrs["varied"]
    always = set(names)
    with_results = frame
    if "status" in names:  # not in a table of thresholds
        with_results = frame[frame["status"] == "finished"]
        always = {"point", *varied, *main_columns(frame)}
    short = dict(zip(varied, short_keys(varied, names), strict=True))
    cells = {}
    same = []
    for name in names:
        heading = heading_of(name) if heading_of else short.get(name, name)
        texts, unit = _column_texts(frame, name)
        different = set(texts) - {"-", ""}
        is_everywhere = bool(with_results[name].notna().all())
        if name in always or len(different) > 1 or (different and not is_everywhere):
            cells[with_unit(heading, unit)] = texts
        elif different and name != "status":
            same.append(f"{heading} {different.pop()} {unit}".rstrip())
    return pd.DataFrame(cells), ", ".join(same)


def _printed_columns(frame: pd.DataFrame) -> list[str]:
    """Names of the columns that may be printed, in the order of the table.

    They are all keys, the most important results (`_SHOWN`), and the main results with the ends of
    their bands, but without numerical errors. If `sides_differ`, the velocities of both sides are
    printed instead of their mean.
    """
    printed = set(_SHOWN)
    if sides_differ(frame):
        printed.update(SIDES)
    else:
        printed.update(("velocity", default_column(frame)))
    for name in main_columns(frame):
        for end in ENDS:
            if end != "error":
                printed.add(f"{name}_{end}")
    names = []
    for name in map(str, frame):
        is_result = is_declared(name)
        if name in printed or not (is_result or name in _NOT_PRINTED):
            names.append(name)
    return names


def _column_texts(frame: pd.DataFrame, name: str) -> tuple[list[str], str]:
    """The texts of a column, and their unit."""
    unit = frame.attrs["units"][name]
    factor = 1.0
    if name not in frame.attrs["varied"]:
        unit, factor = unit_shown(unit)
    return [_cell(value, factor, unit) for value in frame[name].tolist()], unit


def _cell(value: Any, factor: float, unit: str) -> str:
    """A value as text: a word, or a number that is rounded as usual for its unit.

    The factor converts the number to the unit, which is not written. A missing value, None or NaN,
    is a dash.
    """
    if isinstance(value, (bool, str)):
        return str(value)
    if value is None:
        return "-"
    # `rounded` gives the dash of NaN.
    if factor == 1.0:  # whole numbers stay whole
        return rounded(value, unit)
    return rounded(value * factor, unit)


def aligned_table(frame: pd.DataFrame, width: int | None = None) -> str:
    """The `cells_of` a table, with a line below for the results that are the same at all points.

    A table that is wider than ``width`` is split; its parts begin with the varied keys.
    """
    cells, same = cells_of(frame)
    heads = [styled(str(head), HEADING) for head in cells]
    keys = len(frame.attrs["varied"])
    if "point" in frame:
        keys += 1
    text = aligned_blocks(
        [heads, *cells.to_numpy().tolist()], width, repeated=keys, right=range(len(heads))
    )
    if same:
        same_lines = wrapped(f"the same at all points: {same}", width=width)
        text += "\n\n" + "\n".join(same_lines)
    return text


def thresholds(frame: pd.DataFrame) -> pd.DataFrame:
    """The ends of the descents in a sweep's table.

    Returns
    -------
    pandas.DataFrame
        A row for each descent. Beside the other varied keys, ``moving`` is the last value of the
        lowered key at which the walkers move, and ``at_rest`` the first one at which they rest.
        ``gamma0_moving`` and ``gamma0_at_rest`` are the dimensionless peak forces Γ0 there. NaN
        where no such point is finished.

    Raises
    ------
    InputError
        If the sweep has no descent.
    """
    import pandas as pd

    if frame.attrs["until_below"] is None:
        raise input_error(
            frame.attrs["sweep"], "the sweep has no descent and therefore no thresholds"
        )
    *other_keys, lowered = frame.attrs["varied"]
    rows = []
    # The lowered key varies fastest: so many points in a row are one descent.
    for _, points in frame.groupby(frame["point"] // frame[lowered].nunique()):
        row = {name: points.iloc[0][name] for name in other_keys}
        row |= _threshold(points, lowered, frame.attrs["until_below"])
        rows.append(row)
    table = pd.DataFrame(rows)
    units = {name: frame.attrs["units"][name] for name in other_keys}
    units |= {
        "moving": frame.attrs["units"][lowered],
        "gamma0_moving": "",
        "at_rest": frame.attrs["units"][lowered],
        "gamma0_at_rest": "",
    }
    table.attrs["units"] = units
    table.attrs["varied"] = other_keys
    return table


def _threshold(points: pd.DataFrame, lowered: str, until_below: float) -> dict[str, float]:
    """The last value of the lowered key at which walkers move, and the first at which they rest.

    Parameters
    ----------
    points
        The points of one descent.
    lowered
        The key that the descent lowers.
    until_below
        Speed in m/s below which walkers are at rest.
    """
    finished = points[points["status"] == "finished"]
    slow = finished["velocity"].astype(float).abs() < until_below
    ends = {
        # The last point before the first slow one: a later point may be fast by chance.
        "moving": finished[~slow.cummax()].tail(1),
        "at_rest": finished[slow].head(1),
    }
    numbers = {}
    for name, end in ends.items():
        numbers[name] = nan
        numbers[f"gamma0_{name}"] = nan
        if len(end):
            numbers[name] = end.iloc[0][lowered]
            numbers[f"gamma0_{name}"] = end.iloc[0]["gamma0"]
    return numbers


def describe_status(frame: pd.DataFrame) -> str:
    """The state of a sweep as lines of text.

    They are the numbers of points by status; the messages of failed points, of the first
    `_MOST_FAILURES` alone; how much is done of each interrupted point, which has the status
    ``missing`` and a message; and the thresholds of descents.
    """
    statuses = status_text(Counter(frame["status"])) or "none"
    lines = [f"{frame.attrs['sweep']}: {counted(len(frame), 'point')}, {statuses}"]
    failed = frame[frame["status"] == "failed"]
    for row in failed[:_MOST_FAILURES].itertuples():
        point = f"  failed     point {row.point}"
        lines.append(f"{point}: {row.message}")
    if len(failed) > _MOST_FAILURES:
        lines.append(f"             and {len(failed) - _MOST_FAILURES} more")
    interrupted = frame[(frame["status"] == "missing") & (frame["message"] != "")]
    for row in interrupted.itertuples():
        point = f"  interrupted  point {row.point}"
        lines.append(f"{point}: {row.message}")
    if frame.attrs["until_below"] is not None:
        lines.append(indent(aligned_table(thresholds(frame)), "  "))
    return "\n".join(lines)
