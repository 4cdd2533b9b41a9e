"""Sweep files: a base case and the values to vary, read from TOML and expanded into points."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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
    sampled,
    without_unit,
    zipped,
)
from walkers.inputs.case_building import build_case
from walkers.inputs.config_table import ConfigTable, alternatives, changed
from walkers.inputs.keys import Value, flatten
from walkers.inputs.messages import attributed_to, check_key, validated
from walkers.inputs.reading import find_input, read_case, shipped
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.toml import read_toml, with_files
from walkers.inputs.units import Speed, Whole

_LONGEST_NAME = 120


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
        axes = [*crossed(self.axes), *(zipped(table) for table in self.zip)]
        axes += [one_at_a_time(self.one_at_a_time)] if self.one_at_a_time else []
        axes += [sampled(table.points, table.seed, table.ranges) for table in self.sample]
        if table := self.descend:
            axes.append(descending(table.key, table.start, table.to, table.step))
        return axes


@dataclass(frozen=True, repr=False)
class SweepDefinition:
    """A base case and its variations."""

    name: str  # of its file, and of its directory
    source: str  # what messages call it
    case_name: str  # with which the runs' directories begin
    base: Mapping[str, Any]  # tables of the file of the base case
    file: Mapping[str, Any]  # tables of the sweep file
    document: Mapping[str, Any]  # tables of the base case, changed by ``[set]``
    axes: Sequence[Axis]  # keys that vary, and their values
    rows: Sequence[tuple[Value, ...]]  # the points: one value a key
    until_below: (
        float | None
    )  # speed (m/s) below which walkers are at rest on the last axis, if that is a descent

    @property
    def title(self) -> str:
        """The title that the file gives, if it does."""
        return str(self.file.get("title", ""))

    @cached_property
    def values(self) -> list[tuple[Any, ...]]:
        """The points without units."""
        return [tuple(map(without_unit, row)) for row in self.rows]

    @cached_property
    def units(self) -> dict[str, str | None]:
        """The varied keys with their units; None if one has no unit."""
        return {
            key: unit for axis in self.axes for key, unit in zip(axis.keys, axis.units, strict=True)
        }

    @property
    def keys(self) -> tuple[str, ...]:
        """The varied keys."""
        return tuple(self.units)

    def cases(self) -> Iterator[Case]:
        """The case of each point, resolved; raises `InputError` if a point cannot be used; it says which."""
        for number, row in enumerate(self.rows):
            changes = dict(zip(self.keys, row, strict=True))
            text = ", ".join(f"{key} = {value}" for key, value in changes.items())
            where = f"{self.source}: point {number} ({text})" if text else self.source
            with attributed_to(where):
                document = changed(CaseFile, self.document, changes)
            case = build_case(document, source=where, name=self.case_name)
            # The title of the base case may not hold here.
            yield (
                case.with_values(title=f"{shortened(self.name)}: {shortened(text)}")
                if text
                else case
            )


def load_sweep(
    sweep: str | Path | Mapping[str, Any], changes: Mapping[str, Value] | None = None
) -> SweepDefinition:
    """Read a sweep file, a shipped sweep such as ``fig2``, or the tables of a sweep file, and expand it.

    ``changes`` are put beside its ``[set]``; its name tells of them. Its points are checked by `Sweep.cases`.
    """
    path = Path("sweep.toml") if isinstance(sweep, Mapping) else find_input(sweep, "sweep")
    document, name = dict(sweep) if isinstance(sweep, Mapping) else read_toml(path), path.stem
    source = "<sweep>" if isinstance(sweep, Mapping) else str(sweep)
    if changes:
        with attributed_to(source):
            if not isinstance(document.get("set", {}), Mapping):
                raise key_error("set", "expected a table of keys")
            document = {**document, "set": {**flatten(document.get("set", {})), **changes}}
        name = _name_with(name, changes)
    expanded = expand(document, source=source, name=name, folder=path.parent)
    if varied := {key: value for key, value in (changes or {}).items() if key in expanded.keys}:
        text = "varies in this sweep and cannot be set"
        raise InputError(
            source, [Problem(key, f'"{value}"', text) for key, value in varied.items()]
        )
    return expanded


def _name_with(name: str, changes: Mapping[str, Value]) -> str:
    """Name of a sweep with changes; it differs from the name without changes."""
    text = ",".join(f"{key}={value}" for key, value in changes.items())
    full = re.sub(r"[^\w.+=,-]+", "_", f"{name},{text}")
    encoded = full.encode("utf-8", "surrogateescape")
    if len(encoded) <= _LONGEST_NAME:
        return full
    digest = hashlib.sha256(f"{name},{text}".encode("utf-8", "surrogateescape")).hexdigest()[:12]
    return f"{encoded[: _LONGEST_NAME - 13].decode('utf-8', 'ignore')}@{digest}"  # with a hyphen it might be a run's


def expand(
    document: Mapping[str, Any],
    *,
    source: str,
    name: str,
    folder: Path = Path(),
    base: tuple[str, Mapping[str, Any]] | None = None,
) -> SweepDefinition:
    """Expand a sweep given as nested tables, with files that it names in a ``folder``.

    With ``base``, the name of the base case and its tables, no file is read.
    """
    file = validated(SweepFile, document, source, "a sweep")
    path = None if base else _base(file.case, source, folder)
    try:
        with attributed_to(source):
            axes, settings = file.all_axes(), flatten(file.set)
            keys, rows = combinations(axes)
            if "title" in keys:
                raise key_error("title", "expected another key, for title does not determine a run")
            apply_all(partial(check_key, CaseFile), (*settings, *keys))
            for key in keys:
                for alternative in alternatives(CaseFile, key) & {*keys}:
                    raise key_error(
                        key, f"expected one of {key} and {alternative}, which replace each other"
                    )
            case_name, given = (path.stem, read_case(path, folder)) if path else base or ("", {})
            varied = (
                pair
                for axis in axes
                for row in axis.rows
                for pair in zip(axis.keys, row, strict=True)
            )
            given = with_files(given, folder, [*settings.items(), *varied])
            tables = changed(CaseFile, given, settings)
            changed(CaseFile, tables, dict(zip(keys, rows[0], strict=True)))
    except RecursionError as error:
        raise input_error(source, "has infinitely nested tables") from error
    until = file.descend.until_below if file.descend else None
    return SweepDefinition(name, source, case_name, given, document, tables, axes, rows, until)


def _base(case: str, source: str, folder: Path) -> Path:
    """The file of the base case: beside the sweep, with or without ``.toml``, or as a command finds it."""
    names = [case] if case in shipped("case") else [case, f"{case}.toml"]
    try:
        beside = (folder / name for name in names if case and (folder / name).is_file())
        base = next(beside, None) or find_input(case or "no name", "case")
        if base.is_dir():
            raise input_error(base, "expected a case file, or the name of a shipped case")
    except (OSError, InputError) as error:
        why = (
            error.problems[0].expected
            if isinstance(error, InputError)
            else f"cannot be read: {error.strerror}"
        )
        raise InputError(source, [Problem("case", f'"{case}"', why)]) from error
    return base
