"""The table of a sweep.

The table has one row per point: the varied keys and the numbers of the run. Lists, figures, reports and spreads are
groupings and prints of it. Its ``attrs`` describe the columns (``units``, ``meanings``) and the sweep
(``sweep``, ``title``, ``varied``: columns of the varied keys, ``axes``: keys that vary together, ``sampled``: whether
keys that are drawn from ranges are log-uniform, ``until_below``: the speed (m/s) at which descents end, or None).
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
from typing import TYPE_CHECKING, Any

from walkers.errors import InputError, input_error, suggestion
from walkers.files import json_bytes, write_bytes
from walkers.inputs.axes import ranges_of
from walkers.inputs.origins import text_of
from walkers.postprocess.measure.numbers import headline
from walkers.postprocess.measure.quantities import (
    ENDS,
    GROUPS,
    described_columns,
    is_declared,
    unit_shown,
)
from walkers.postprocess.measure.results import Results, modules_of
from walkers.postprocess.measure.sides import SEPARATED
from walkers.rounding import counted, rounded
from walkers.runner.run_directory import case_of
from walkers.runs.case_text import short_keys
from walkers.runs.status import PointState, status_text
from walkers.sweeps.record import SweepRecord, read_sweep_record, states
from walkers.text import aligned, with_unit

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
_RESULTS = ("velocity", "climbs")
SIDES = ("right_facing", "left_facing")
"""Velocity columns that replace the mean if `sides_differ`."""
FACING_DOWN = {"right_facing": "left_facing", "axial_velocity": "axial_left_facing"}
"""Columns of walkers that face down, by the columns of those that face up (`main_columns`)."""
SEEDS = ("run.seed", "seed")
"""Keys of the random numbers of a start: points that differ in nothing else repeat an experiment."""
TABLE_FORMATS = ("csv", "parquet", "json")
_SHOWN = {
    *(
        "gamma0",
        "sin_delta",
        "rotation_1",
        "sliding_1",
        "steady",
        "walkers",
        "upright",
        "work",
        "cost_of_transport",
    ),
    *("merged", "clustered_share", "held_share", "free_speed", "slow_share", "coverage"),
    *(
        "beads",
        "large",
        "duration",
        "climbs",
        "onset",
        "speed",
        "highest",
        "led_by_large",
        "clusters",
    ),
    *("surface_end", "brazil_nut_end", "settling"),
}
"""Numbers of results in the printed table, beside the main one."""
_ASIDE = ("lost", "reason", "message")
"""Columns of `STATE` that the printed table leaves out."""
_MOST_FAILURES = 10


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
    def cases(self) -> Mapping[int, Case]:
        """Cases of the finished points by their numbers, as their runs have recorded them.

        To expand the record again would take three times as long, and it would give the values of
        today's library.
        """
        return {point: case_of(result.directory) for point, result in self.results.items()}

    def results_of(self, rows: pd.DataFrame) -> list[Results]:
        """The results of some rows of the table, once for each run."""
        results = {self.results[point].directory: self.results[point] for point in rows["point"]}
        return list(results.values())


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
        If there is no sweep.
    """
    return table_of(read_sweep_record(directory)).frame


def table_of(record: SweepRecord) -> SweepTable:
    """The table of a sweep with its results, by its record."""
    points = states(record, results=True)
    results = {
        number: state.result for number, state in enumerate(points) if state.result is not None
    }
    return SweepTable(_frame(record.sweep, points), results)


def _frame(sweep: SweepDefinition, points: Sequence[PointState]) -> pd.DataFrame:
    """The data frame of a sweep, with descriptions of its columns and of the sweep."""
    import pandas as pd

    varied = _varied_columns(sweep)
    numbers: set[str] = set()
    for point in points:
        numbers.update(point.result or ())
    if not all(point.result for point in points):
        numbers.update(_declared(sweep))
    described = {
        "point": ("", "number of the point"),
        **varied,
        **described_columns(numbers),
        **STATE,
    }
    rows = [_row(number, sweep, state) for number, state in enumerate(points)]
    frame = pd.DataFrame(rows, columns=list(described))
    frame.attrs["units"] = {name: unit for name, (unit, _) in described.items()}
    frame.attrs["meanings"] = {name: meaning for name, (_, meaning) in described.items()}
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

    A key with several numbers has a column for each. If it has a word at other points, such as an
    axis that is ``"x"`` or a direction, the words have a column too.
    """
    columns = {}
    values_of = zip(*sweep.values, strict=True)
    for (key, unit), values in zip(sweep.units.items(), values_of, strict=True):
        lengths = [len(value) for value in values if isinstance(value, list)]
        names = [f"{key}[{part}]" for part in range(max(lengths, default=0))]
        if len(lengths) < len(values):
            names.insert(0, key)
        for name in names:
            columns[name] = (unit or "", "varied")
    return columns


def _declared(sweep: SweepDefinition) -> list[str]:
    """The numbers of results of a sweep's cases, without numbers of single beads; empty if a case cannot be read."""
    with suppress(InputError):
        groups = [module.NAME for module in modules_of(next(sweep.cases()))]
        return [
            number.name
            for group in [*groups, "drive"]
            for number in GROUPS[group]
            if number.name[-1] != "*"
        ]
    return []


def _row(number: int, sweep: SweepDefinition, state: PointState) -> dict[str, Any]:
    row: dict[str, Any] = {"point": number, **(state.result or {})}
    for key, value in zip(sweep.keys, sweep.values[number], strict=True):
        row |= (
            {f"{key}[{part}]": item for part, item in enumerate(value)}
            if isinstance(value, list)
            else {key: value}
        )
    row |= {name: getattr(state, name) or "" for name in ("status", "reason", "message")}
    return row | {
        "lost": state.lost,
        "run": os.path.relpath(state.directory) if state.directory else "",
    }


def seed_groups(frame: pd.DataFrame) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    """The points of a sweep's table in groups that differ in nothing but their seeds.

    Each has the values of the varied columns that distinguish it (none if only seeds vary), and its rows.
    """
    keys = [
        name
        for name in frame.attrs["varied"]
        if name not in SEEDS and frame[name].nunique(dropna=False) > 1
    ]
    if not keys:
        yield {}, frame
        return
    for values, rows in frame.groupby(keys, sort=False, dropna=False):
        yield dict(zip(keys, values, strict=True)), frame.loc[rows.index]


def walking_points(frame: pd.DataFrame) -> pd.DataFrame:
    """The points of a sweep's table without those whose walkers came apart, which have no velocity."""
    return (
        frame[~(frame["separated_fraction"] > SEPARATED)]
        if "separated_fraction" in frame
        else frame
    )


def sides_differ(frame: pd.DataFrame) -> bool:
    """Whether walkers facing right (up) and left (down) differ at a point: then their mean velocity means nothing."""
    return "facings_differ" in frame and bool(frame["facings_differ"].eq(True).any())


def main_columns(frame: pd.DataFrame) -> list[str]:
    """The main results in order of preference: first the `headline` of a point, then `_RESULTS`."""
    if "velocity" not in frame:
        return list(_RESULTS)
    finished: Any = frame.dropna(subset="velocity").to_dict("records")
    heads = set(map(headline, finished))
    return [name for name in ("axial_velocity", "right_facing") if name in heads][:1] + list(
        _RESULTS
    )


def default_column(frame: pd.DataFrame) -> str:
    """The column of a table that is shown by default."""
    return next((name for name in main_columns(frame) if name in frame), "frequency")


def find_name(option: str, word: str, names: Iterable[str]) -> str:
    """Find a name, or the only name that ends with ``.`` and it; `InputError` if there is none or several."""
    candidates = list(dict.fromkeys(names))
    matches = (
        [word] if word in candidates else [name for name in candidates if name.endswith(f".{word}")]
    )
    if len(matches) == 1:
        return matches[0]
    text = f"expected one of {', '.join(matches or candidates)}{'' if matches else suggestion(word, candidates)}"
    raise input_error(option, f'"{word}": {text}')


def value_text(value: Any, unit: str | None = None) -> str:
    """A value of a key as text, with its unit unless it is a word such as auto; several are separated by slashes."""
    text = "/".join(map(text_of, value)) if isinstance(value, list) else text_of(value)
    return f"{text} {unit}" if unit and not isinstance(value, str) else text


def key_values(frame: pd.DataFrame, key: str) -> tuple[list[Any], str | None]:
    """The values of a varied key at each point of a sweep's table, lists of keys with several numbers; their unit."""
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
    """The values of the varied keys at each point of a sweep's table as text with units; a column for each key."""
    import pandas as pd

    texts = {}
    for key in (key for axis in frame.attrs["axes"] for key in axis):
        values, unit = key_values(frame, key)
        texts[key] = [value_text(value, unit) for value in values]
    return pd.DataFrame(texts, index=frame.index, dtype=object)


def encoded(frame: pd.DataFrame, form: str) -> bytes:
    """A sweep's table as CSV (units in the head), JSON (with units and meanings) or parquet (units in the metadata)."""
    units, meanings = frame.attrs["units"], frame.attrs["meanings"]
    if form == "csv":
        heads = [with_unit(name, units[name]) for name in frame.columns]
        return str(frame.to_csv(index=False, header=heads)).encode()
    if form == "json":  # not by DataFrame.to_json, which rounds to decimals
        rows = frame.astype(object).where(frame.notna(), None).to_dict("records")
        return json_bytes({"units": units, "meanings": meanings, "points": rows})
    import pyarrow as pa
    import pyarrow.parquet as pq

    # Numbers and words ("auto") become words, booleans and NaN (not finished) become booleans.
    mixed = {
        name: set(frame[name].map(type)) for name in frame.columns if frame[name].dtype == object
    }
    types = {name: "boolean" for name, kinds in mixed.items() if bool in kinds and str not in kinds}
    types |= {name: "str" for name, kinds in mixed.items() if str in kinds and len(kinds) > 1}
    table = pa.Table.from_pandas(frame.astype(types), preserve_index=False)
    fields = [
        field.with_metadata({"unit": units[field.name], "meaning": meanings[field.name]})
        for field in table.schema
    ]
    buffer = io.BytesIO()
    pq.write_table(
        table.cast(pa.schema(fields, metadata=table.schema.metadata)), buffer, compression="zstd"
    )
    return buffer.getvalue()


def write_table_file(frame: pd.DataFrame, path: Path) -> None:
    """Write a table in the format of the file's suffix; `InputError` if it is none of `TABLE_FORMATS`."""
    if path.suffix.lstrip(".") not in TABLE_FORMATS:
        raise input_error(path, f"expected a name that ends in .{', .'.join(TABLE_FORMATS)}")
    write_bytes(path, encoded(frame, path.suffix.lstrip(".")))


def cells_of(
    frame: pd.DataFrame, named: Callable[[str], str] | None = None
) -> tuple[pd.DataFrame, str]:
    """Varied keys, Γ0, sin δ and the main results of a table as text in mm, mm/s, nJ and degrees, with units in heads.

    The second value has the results that are the same at all points of a sweep. Columns are called ``named``; None: by
    the last parts of keys.
    """
    import pandas as pd

    main = main_columns(frame)
    shown = _SHOWN | (set(SIDES) if sides_differ(frame) else {"velocity", default_column(frame)})
    shown |= {f"{name}_{end}" for name in main for end in ENDS.keys() - {"error"}}
    names = [
        name
        for name in map(str, frame)
        if name in shown or not (is_declared(name) or name in _ASIDE)
    ]
    varied, cells, same = frame.attrs["varied"], {}, []
    kept = {"point", *varied, *main} if "status" in names else {*names}
    short = dict(zip(varied, short_keys(varied, names), strict=True))
    for name in names:
        unit, factor = frame.attrs["units"][name], 1.0
        if name not in varied:
            unit, factor = unit_shown(unit)
        texts = [_cell(value, factor, unit) for value in frame[name].tolist()]
        head, different = named(name) if named else short.get(name, name), {*texts} - {"-", ""}
        if name in kept or len(different) > 1:
            cells[with_unit(head, unit)] = texts
        elif different and name != "status":
            same.append(f"{head} {different.pop()} {unit}".rstrip())
    return pd.DataFrame(cells), ", ".join(same)


def _cell(value: Any, factor: float, unit: str) -> str:
    if isinstance(value, (bool, str)):
        return str(value)
    return "-" if value is None else rounded(value if factor == 1.0 else value * factor, unit)


def short_text(frame: pd.DataFrame) -> str:
    """`cells_of` a table as text, with a line below for the results that are the same at all points."""
    cells, same = cells_of(frame)
    text = aligned([[*cells], *cells.to_numpy().tolist()], right=range(len(cells.columns)))
    return f"{text}\n\nthe same at all points: {same}" if same else text


def thresholds(frame: pd.DataFrame) -> pd.DataFrame:
    """The ends of the descents in a sweep's table, a row each; `InputError` if it has none.

    Values of the lowered key: the last one at which the walkers move, and the first one at which they rest, with the
    dimensionless peak forces Γ0 there; NaN where there is none.
    """
    import pandas as pd

    if (until_below := frame.attrs["until_below"]) is None:
        raise input_error(
            frame.attrs["sweep"], "the sweep has no descent and therefore no thresholds"
        )
    *kept, lowered = frame.attrs["varied"]
    rows = []
    for _, points in frame.groupby(frame["point"] // frame[lowered].nunique()):
        finished = points[points["status"] == "finished"]
        slow = finished["velocity"].astype(float).abs() < until_below
        row = {name: points.iloc[0][name] for name in kept}
        for name, part in (
            ("moving", finished[~slow.cummax()].tail(1)),
            ("at_rest", finished[slow].head(1)),
        ):
            row[name] = part.iloc[0][lowered] if len(part) else nan
            row[f"gamma0_{name}"] = part.iloc[0]["gamma0"] if len(part) else nan
        rows.append(row)
    table, units = pd.DataFrame(rows), frame.attrs["units"]
    ends = {
        "moving": units[lowered],
        "gamma0_moving": "",
        "at_rest": units[lowered],
        "gamma0_at_rest": "",
    }
    table.attrs |= {"units": {name: units[name] for name in kept} | ends, "varied": kept}
    return table


def describe_status(frame: pd.DataFrame) -> str:
    """Numbers of points by status, failures with their messages, and the thresholds of descents."""
    lines = [
        f"{frame.attrs['sweep']}: {counted(len(frame), 'point')}, {status_text(Counter(frame['status'])) or 'none'}"
    ]
    failed = frame[frame["status"] == "failed"]
    lines += [
        f"  failed     point {row.point}: {row.message}"
        for row in failed[:_MOST_FAILURES].itertuples()
    ]
    if len(failed) > _MOST_FAILURES:
        lines.append(f"             and {len(failed) - _MOST_FAILURES} more")
    begun = frame[(frame["status"] == "missing") & (frame["message"] != "")]
    lines += [f"  interrupted  point {row.point}: {row.message}" for row in begun.itertuples()]
    if frame.attrs["until_below"] is not None:
        lines += [f"  {line}" for line in short_text(thresholds(frame)).splitlines()]
    return "\n".join(lines)
