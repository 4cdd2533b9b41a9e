"""Sweep files: a base case and the values to vary, read from TOML and expanded into points."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from walkers.errors import InputError, Problem, apply_all, input_error, key_error, shortened
from walkers.inputs.axes import (
    MOST_POINTS_OF_SWEEP,
    Axis,
    combinations,
    crossed,
    descending,
    one_at_a_time,
    overlap,
    sampled,
    without_unit,
    zipped,
)
from walkers.inputs.case_building import build_case
from walkers.inputs.config_table import (
    ConfigTable,
    alternatives,
    changed,
    gives_whole_table,
    replaced_keys,
)
from walkers.inputs.keys import Value, flatten, is_below
from walkers.inputs.messages import attributed_to, check_key, validated
from walkers.inputs.reading import find_input, keys_of_files, read_case, shipped
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.toml import read_toml, with_files
from walkers.inputs.units import Speed, Whole

_LONGEST_NAME = 120
"""Largest length of the name of a sweep, in bytes."""
_DIGITS_OF_DIGEST = 12
"""Length of the hexadecimal digest at the end of a shortened name."""


class SampleTable(ConfigTable):
    """``[[sample]]``: points of Sobol's sequence, best a power of two, over ranges of keys."""

    method: Literal["sobol"] = "sobol"
    points: Annotated[Whole, Field(ge=1, le=MOST_POINTS_OF_SWEEP)]
    seed: Annotated[Whole, Field(ge=0)] = 1
    ranges: dict[str, Any]


class DescendTable(ConfigTable):
    """``[descend]``: a key that is lowered step by step, to find where the walkers stop."""

    key: str = "drive.peak_acceleration"
    start: Any = Field(alias="from", examples=["4 g"])
    to: Any = Field(examples=["0.5 g"])
    step: Any = Field(examples=["0.1 g"])
    until_below: Speed = Field(examples=["0.02 mm/s"])


class SweepFile(ConfigTable):
    """A sweep file."""

    title: str = ""
    case: str = Field(examples=["fig1b"])
    set: dict[str, Any] = Field({})
    axes: dict[str, Any] = Field({})
    zip: list[dict[str, Any]] = Field([])
    one_at_a_time: dict[str, Any] = Field({})
    sample: list[SampleTable] = Field([])
    descend: DescendTable | None = None

    def all_axes(self) -> list[Axis]:
        """All axes in their order; the last one varies fastest. A descent is last."""
        axes = crossed(self.axes)
        axes += [zipped(table) for table in self.zip]
        if self.one_at_a_time:
            axes.append(one_at_a_time(self.one_at_a_time))
        axes += [sampled(table.points, table.seed, table.ranges) for table in self.sample]
        descent = self.descend
        if descent:
            axes.append(descending(descent.key, descent.start, descent.to, descent.step))
        return axes


@dataclass(frozen=True, repr=False)
class SweepDefinition:
    """A base case and its variations.

    Attributes
    ----------
    name
        Name of the sweep file and of the directory of the sweep.
    source
        What messages call the sweep.
    case_name
        What the names of the directories of the runs begin with.
    base
        Tables of the file of the base case.
    file
        Tables of the sweep file.
    document
        Tables of the base case, changed by ``[set]``.
    axes
        The keys that vary, and their values.
    rows
        The points: one value for each key.
    until_below
        If the last axis is a descent: speed, m/s, below which walkers are at rest; else None.
    """

    name: str
    source: str
    case_name: str
    base: Mapping[str, Any]
    file: Mapping[str, Any]
    document: Mapping[str, Any]
    axes: Sequence[Axis]
    rows: Sequence[tuple[Value, ...]]
    until_below: float | None

    @property
    def title(self) -> str:
        """The title that the file gives; empty without one."""
        return str(self.file.get("title", ""))

    @cached_property
    def values(self) -> list[tuple[Any, ...]]:
        """The points as numbers without units; words stay as they are."""
        return [tuple(map(without_unit, row)) for row in self.rows]

    @cached_property
    def units(self) -> dict[str, str | None]:
        """The units of the varied keys; None for a key without one."""
        units: dict[str, str | None] = {}
        for axis in self.axes:
            units.update(zip(axis.keys, axis.units, strict=True))
        return units

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys."""
        return tuple(self.units)

    def replaced_by(self, changes: Mapping[str, Value]) -> dict[str, list[str]]:
        """The keys of the base case that changes of it replace (`replaced_keys`)."""
        return replaced_keys(CaseFile, self.base, changes)

    def cases(self) -> Iterator[Case]:
        """The resolved case of each point, one after the other.

        Raises
        ------
        InputError
            If a point cannot be used. The message says which one.
        """
        for number, row in enumerate(self.rows):
            changes = dict(zip(self.keys, row, strict=True))
            point = ", ".join(f"{key} = {value}" for key, value in changes.items())
            source = self.source
            if point:
                source = f"{self.source}: point {number} ({point})"
            with attributed_to(source):
                document = changed(CaseFile, self.document, changes)
            case = build_case(document, source=source, name=self.case_name)
            if point:
                # The title of the base case need not hold for a point.
                case = case.with_values(title=f"{shortened(self.name)}: {shortened(point)}")
            yield case


def load_sweep(
    sweep: str | Path | Mapping[str, Any], changes: Mapping[str, Value] | None = None
) -> SweepDefinition:
    """Read a sweep and expand it into its points.

    Parameters
    ----------
    sweep
        A sweep file, the name of a shipped sweep such as ``fig2``, or the tables of a sweep file.
        A sweep of tables is named ``sweep@`` and a digest of them, so that different tables are
        different sweeps.
    changes
        Values by dotted keys, which are added to the ``[set]`` of the file. The name of the sweep
        contains them.

    Returns
    -------
    SweepDefinition
        Its points are not resolved yet: `SweepDefinition.cases` validates them.

    Raises
    ------
    InputError
        If the file does not exist or cannot be used, or a change is one of a key that varies.
    """
    if isinstance(sweep, Mapping):
        document = dict(sweep)
        source = "<sweep>"
        name = _name_of_tables(sweep)
        folder = Path()
    else:
        path = find_input(sweep, "sweep")
        document = read_toml(path)
        source = str(sweep)
        name = path.stem
        folder = path.parent
    if changes:
        with attributed_to(source):
            settings = document.get("set", {})
            if not isinstance(settings, Mapping):
                raise key_error("set", "expected a table of keys")
            document = {**document, "set": _with_changes(settings, changes)}
        name = _name_with(name, changes)
    definition = expand(document, source=source, name=name, folder=folder)
    problems = []
    for key, value in (changes or {}).items():
        if any(overlap(key, varied) for varied in definition.keys):
            message = "varies in this sweep and cannot be set"
            problems.append(Problem(key, f'"{value}"', message))
    if problems:
        raise InputError(source, problems)
    return definition


def _name_of_tables(tables: Mapping[str, Any]) -> str:
    """The name of a sweep that has no file: the same tables have the same name, and no others.

    It is ``sweep@`` and a digest. The order of keys counts, because it is that of the points.
    """
    try:
        contents = json.dumps(tables, default=str, skipkeys=True)
    except (ValueError, RecursionError) as error:
        raise input_error("<sweep>", "has infinitely nested tables") from error
    return f"sweep@{hashlib.sha256(contents.encode()).hexdigest()[:_DIGITS_OF_DIGEST]}"


def _with_changes(settings: Mapping[str, Any], changes: Mapping[str, Value]) -> dict[str, Any]:
    """The values of ``[set]`` with changes, without what the changes replace.

    A number replaces a table, and all keys of the table replace the number.
    """
    remaining = {}
    for key, value in flatten(settings).items():
        replaced = any(is_below(key, change) for change in changes)
        if not replaced and not gives_whole_table(CaseFile, key, changes):
            remaining[key] = value
    return {**remaining, **changes}


def _name_with(name: str, changes: Mapping[str, Value]) -> str:
    """The name of a sweep with changes, which differs from the name without them.

    It ends with the changes, or with a digest of them if it would be too long.
    """
    settings = ",".join(f"{key}={value}" for key, value in changes.items())
    text = f"{name},{settings}"
    full_name = re.sub(r"[^\w.+=,-]+", "_", text)
    encoded = full_name.encode("utf-8", "surrogateescape")
    if len(encoded) <= _LONGEST_NAME:
        return full_name
    digest = hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()
    start = encoded[: _LONGEST_NAME - _DIGITS_OF_DIGEST - 1].decode("utf-8", "ignore")
    # Not with a hyphen, with which it might be the name of a run.
    return f"{start}@{digest[:_DIGITS_OF_DIGEST]}"


def expand(
    document: Mapping[str, Any],
    *,
    source: str,
    name: str,
    folder: Path = Path(),
    base: tuple[str, Mapping[str, Any]] | None = None,
) -> SweepDefinition:
    """Expand the tables of a sweep file into its points.

    Parameters
    ----------
    document
        The tables.
    source
        What messages call the sweep.
    name
        Name of the sweep.
    folder
        Where the base case is, and the files that the sweep names.
    base
        The name of the base case and its tables; no file of a case is read then.

    Returns
    -------
    SweepDefinition
        Its points are not resolved yet: `SweepDefinition.cases` validates them.

    Raises
    ------
    InputError
        If the sweep or the file of its base case cannot be used.
    """
    sweep_file = validated(SweepFile, document, source, "a sweep")
    if base is None:
        path = _base_file(sweep_file.case, source, folder)
    try:
        with attributed_to(source):
            axes = sweep_file.all_axes()
            settings = flatten(sweep_file.set)
            keys, rows = combinations(axes)
            _check_keys(settings, keys)
            first_point = {**settings, **dict(zip(keys, rows[0], strict=True))}
            if base is None:
                case_name = path.stem
                base_tables: Mapping[str, Any] = read_case(path, folder, first_point)
            else:
                case_name, base_tables = base
            # Meshes and records that values of the sweep name belong to the tables of a case.
            values = [*settings.items(), *_values_of_axes(axes)]
            keys_of_base = keys_of_files(base_tables, first_point)
            base_tables = with_files(base_tables, folder, values, keys_of_base)
            changed_base = changed(CaseFile, base_tables, settings)
            # Refuse keys that lead nowhere in the base case before all points are made.
            changed(CaseFile, changed_base, dict(zip(keys, rows[0], strict=True)))
    except RecursionError as error:
        raise input_error(source, "has infinitely nested tables") from error
    until_below = None
    if sweep_file.descend:
        until_below = sweep_file.descend.until_below
    return SweepDefinition(
        name=name,
        source=source,
        case_name=case_name,
        base=base_tables,
        file=document,
        document=changed_base,
        axes=axes,
        rows=rows,
        until_below=until_below,
    )


def _check_keys(settings: Iterable[str], keys: Collection[str]) -> None:
    """Refuse keys of ``[set]`` and of axes that no case has, and axes that exclude each other."""
    if "title" in keys:
        raise key_error("title", "expected another key, for title does not determine a run")
    apply_all(partial(check_key, CaseFile), (*settings, *keys))
    for key in keys:
        for excluded in alternatives(CaseFile, key).intersection(keys):
            message = f"expected one of {key} and {excluded}, which replace each other"
            raise key_error(key, message)


def _values_of_axes(axes: Iterable[Axis]) -> Iterator[tuple[str, Value]]:
    """The values of all axes with their keys."""
    for axis in axes:
        for row in axis.rows:
            yield from zip(axis.keys, row, strict=True)


def _base_file(case: str, source: str, folder: Path) -> Path:
    """The file of the base case.

    It is beside the sweep, named with or without ``.toml``, or where a command finds it.
    """
    try:
        path = _file_beside(case, folder) or find_input(case or "no name", "case")
        if path.is_dir():
            raise input_error(path, "expected a case file, or the name of a shipped case")
    except InputError as error:
        problem = replace(error.problems[0], key="case", value=f'"{case}"')
        raise InputError(source, [problem]) from error
    except OSError as error:
        problem = Problem("case", f'"{case}"', f"cannot be read: {error.strerror}")
        raise InputError(source, [problem]) from error
    return path


def _file_beside(case: str, folder: Path) -> Path | None:
    """The case file of this name in a folder; None if the folder has none."""
    if not case:
        return None
    names = [case]
    if case not in shipped("case"):
        names.append(f"{case}.toml")
    for name in names:
        if (folder / name).is_file():
            return folder / name
    return None
