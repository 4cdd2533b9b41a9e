"""From what pydantic says of an unusable case to sentences that name key, value and what was expected."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from walkers.inputs.case import ENDED
from walkers.inputs.changes import MISSING, joined, parts_of, value_at
from walkers.inputs.errors import InputError, Problem, shown, unusable
from walkers.inputs.library import suggestion
from walkers.inputs.schema import CaseFile, fields_of
from walkers.physics.units import WRITTEN

File = TypeVar("File", bound=BaseModel)

_EXAMPLES = {
    "beads": 'a [beads] table, such as material = "ruby"',
    "dimers.radii": 'two radii, such as ["0.3 mm", "0.2 mm"]',
    "mixture.small": 'two radii, such as ["0.3 mm", "0.315 mm"]',
    "mixture.large": 'two radii, such as ["0.5 mm", "0.59 mm"]',
    "clusters.at": 'two places, ahead and to the left, such as ["0.2 mm", "0 mm"]',
    "placed.at": 'three places, x, y and z, such as ["5 mm", "-3 mm", "0.3 mm"]',
    "beads.density": 'such as "4.0 g/cm^3", or a material of the library',
    "liquid.surface_tension": 'such as "19.2 mN/m", or a liquid of the library by name',
    "*.source": 'where the number is from, such as "weighed"',
    "liquid": 'a [liquid] table, such as name = "Si AK5"',
    "boundary": 'a [boundary] table, such as material = "chromium-coated glass"',
    "boundary.material": 'such as "chromium-coated glass"',
    "drive": "a [drive] table with a frequency and a peak_acceleration or gamma0",
    "run.cycles": 'or "auto"',
    "walltime": 'hours, minutes and seconds, such as "02:00:00"',
    "case": 'a case file, or the name of a shipped case, such as "fig1b"',
    "descend.from": 'where the descent begins, such as "4 g"',
    "descend.to": 'where it ends at the latest, such as "0.5 g"',
    "descend.step": 'such as "0.1 g"',
    "descend.until_below": 'the speed below which walkers count as at rest, such as "0.02 mm/s"',
}
_WORDS = {
    "Input should be": "expected",
    "greater than or equal to": "at least",
    "greater than": "more than",
    "less than or equal to": "at most",
    "a valid tuple": "a list",
    "a valid list": "a list (a table of tables is written [[name]])",
    "a valid string": "text in quotes",
    "a valid number": "a plain number without a unit",
    "a valid integer": "a whole number",
    "a valid boolean": "true or false",
}
"""What pydantic says, and what this does."""
_LISTS = re.compile(r"^(clusters|placed|drive\.harmonics)\.")
"""Keys in a table of which a case may have several."""


def quoted(document: Mapping[str, Any], parts: Sequence[str | int]) -> str | None:
    """The value at a place of a document, quoted; None if there is none."""
    value = value_at(document, parts)
    return None if value is MISSING else shown(value)


@contextmanager
def blaming(source: str, document: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Add to errors that name no source this one, and the value at fault as the document has it."""
    try:
        yield
    except InputError as error:
        if error.source:
            raise
        found = [(one, one.value or quoted(document or {}, parts_of(one.key))) for one in error.problems]
        raise InputError(source, [replace(one, value=value) for one, value in found]) from error


@contextmanager
def blaming_changes(changes: Mapping[str, Any]) -> Iterator[None]:
    """Say in errors which keys are at fault as a change by ``--set``, not in the file."""
    try:
        yield
    except InputError as error:
        given = [parts_of(key) for key in changes]
        parts = [parts_of(one.key) for one in error.problems]
        ours = [any(of and of[: len(one)] == one[: len(of)] for one in given) for of in parts]
        if not any(ours):
            raise
        blamed = zip(error.problems, ours, strict=True)
        raise InputError(error.source, [replace(one, key="--set " * of + one.key) for one, of in blamed]) from error


def validated(
    model: type[File], document: Mapping[str, Any], source: str, whole: str = "a case", further: Sequence[Problem] = ()
) -> File:
    """Nested tables as a kind of file; ``source`` and ``whole`` are what messages call it, and any of its kind.

    Raises `InputError` with all that pydantic finds wrong, and with ``further`` problems.
    """
    try:
        file = model.model_validate(document, extra="forbid", context=WRITTEN)
    except ValidationError as error:
        found = {one.key: one for one in further}
        found |= {one.key: one for one in (_problem_of(each, document, model, whole) for each in error.errors())}
        raise InputError(source, list(found.values())) from error
    if further:
        raise InputError(source, further)
    return file


def _problem_of(details: ErrorDetails, document: Mapping[str, Any], file: type[BaseModel], whole: str) -> Problem:
    kind, context = details["type"], details.get("ctx", {})
    location = [part for part in details["loc"] if part != "[key]"]  # of a name of the user's
    message = details["msg"]
    for pydantics, ours in _WORDS.items():
        message = message.replace(pydantics, ours)
    short_list = kind == "missing" and isinstance(location[-1], int)
    key = joined(location[:-1] if short_list else location)
    example = _EXAMPLES.get(re.sub(r"\[\d+\]", "", key)) or _EXAMPLES.get(f"*.{location[-1]}")
    if kind == "missing":
        fault, other = ("too short", "two numbers") if short_list else ("missing", "a value")
        message = f"{fault}; expected {example or other}"
    elif kind == "too_long":
        most = context["max_length"]
        message = f"too long; expected {example or ('two numbers' if most == 2 else f'at most {most} entries')}"
    elif kind == "value_error":
        message = str(context["error"])
    elif kind in ("extra_forbidden", "unexpected_keyword_argument"):
        message = _unknown_key([str(part) for part in location if isinstance(part, str)], file, whole)
    elif kind == "literal_error":
        message += suggestion(str(details["input"]), re.findall(r"'([^']+)'", str(context["expected"])))
    elif kind in ("model_type", "dict_type", "model_attributes_type", "dataclass_type"):
        a_number = str(context.get("class_name", "")).startswith("Sourced")
        message = 'expected { value = ..., source = "..." }' if a_number else f"expected a table [{key}]"
    elif example:
        message = f"{message}, {example}" if message.startswith("expected") else f"expected {example}"
    return Problem(key, quoted(document, parts_of(key)), message)


def _table_in(annotation: Any) -> tuple[type | None, str]:
    """The model that a field holds, alone or in a list, or by names of the user's (then with ``.*``), or None."""
    if isinstance(annotation, type) and fields_of(annotation):
        return annotation, ""
    for inner in get_args(annotation):
        table, named = _table_in(inner)
        if table is not None:
            return table, ".*" if get_origin(annotation) is dict else named
    return None, ""


@cache
def keys_of(file: type) -> Mapping[str, type | None]:
    """All dotted keys of a kind of file; those of tables with the table's model."""
    found: dict[str, type | None] = {"": file}
    for name, (_, field) in fields_of(file).items():
        table, named = _table_in(field.annotation)
        found[name] = None if named else table
        below = keys_of(table) if table else {}
        found |= {f"{name}{named}.{key}".rstrip("."): one for key, one in below.items()}
    return found


def check_key(key: str) -> None:
    """Refuse a key that no case has; raises `InputError` if it is one."""
    parts, known = re.sub(r"\[\d+\]", "", key).split("."), keys_of(CaseFile)
    if "" in parts:
        raise unusable(key, "is not a key of a case; expected one such as drive.frequency")
    if ".".join(parts) not in known:
        raise unusable(key, _unknown_key(parts, CaseFile, "a case"))
    if known[".".join(parts)]:
        raise unusable(key, "is a table of a case; expected one of its keys")


def _unknown_key(location: list[str], file: type[BaseModel], whole: str) -> str:
    *tables, word = location
    if ".".join(location) in ENDED:
        return "expected none: this key has ended; the program limits the engine itself"
    known, place = keys_of(file), ""
    for part in tables:
        below = f"{place}.{part}".lstrip(".")
        place = below if below in known or f"{below}.*" in known else f"{place}.*"
    table = known.get(place)
    siblings = list(fields_of(table)) if table else []
    keys = {_LISTS.sub(r"\1[0].", key): inner for key, inner in known.items()}
    hint = suggestion(word, siblings) if siblings else suggestion(".".join(location), keys)
    elsewhere = [key for key, inner in keys.items() if inner is None and "*" not in key and key.split(".")[-1] == word]
    if not hint and elsewhere:
        hint = f'; did you mean "{elsewhere[0]}"?'
    within = f"[{'.'.join(tables)}]" if tables else whole
    return f"unknown key{f'; {within} takes ' if siblings else ''}{', '.join(siblings)}{hint}"
