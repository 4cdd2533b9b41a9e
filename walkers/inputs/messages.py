"""From what pydantic says of an unusable case to sentences that name key, value and what was expected."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from walkers.inputs.errors import InputError, Problem, UnusableKeyError, shortened
from walkers.inputs.library import suggestion
from walkers.inputs.schema import CaseFile

File = TypeVar("File", bound=BaseModel)

_EXAMPLES = {
    "beads": 'a [beads] table, such as material = "ruby"',
    "dimers.radii": 'such as ["0.3 mm", "0.2 mm"]',
    "liquid": 'a [liquid] table, such as name = "Si AK5"',
    "boundary": 'a [boundary] table, such as material = "chromium-coated glass"',
    "boundary.material": 'such as "chromium-coated glass"',
    "drive": "a [drive] table with a frequency and a peak_acceleration or gamma0",
    "drive.frequency": 'such as "80 Hz"',
    "case": 'a case file, or the name of a shipped case, such as "fig1b"',
    "descend.from": 'where the descent begins, such as "4 g"',
    "descend.to": 'where it ends at the latest, such as "0.5 g"',
    "descend.step": 'such as "0.1 g"',
    "descend.until_below": 'the speed below which walkers count as at rest, such as "0.02 mm/s"',
}


_BOUNDS = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
_BOUND_UNITS = {
    "contact.youngs_modulus": " Pa (softer contacts change the speed, harder ones the engine refuses)",
    "liquid.contact_angle": " rad",
    "boundary.tilt": " rad (90 degrees, a wall)",
    "boundary.opening": " rad (from 30 to 177 degrees)",
}
_PLAIN = {
    "tuple_type": "expected a list",
    "bool_type": "expected true or false",
    "bool_parsing": "expected true or false",
    "string_type": "expected text in quotes",
    "finite_number": "expected a finite number",
    "string_pattern_mismatch": 'expected hours, minutes and seconds, such as "02:00:00"',
    "list_type": "expected a list (a table of tables is written [[name]])",
}


def _shown(value: Any) -> str:
    """A value as the user may have written it, shortened."""
    try:
        text = json.dumps(value, ensure_ascii=False, default=str)
    except (ValueError, RecursionError):  # integers of thousands of digits, brackets without end
        return "..."
    return shortened(text)


def quoted(document: Mapping[str, Any], location: Sequence[str | int]) -> str | None:
    """The value at a place of a document, quoted; None if there is none."""
    value: Any = document
    for part in location:
        known = value if isinstance(value, Mapping) else dict(enumerate(value)) if isinstance(value, list) else {}
        if part not in known:
            return None
        value = known[part]
    return _shown(value)


@contextmanager
def blaming(source: str, document: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Tell an `UnusableKeyError` as an `InputError` of a source, with the value at fault or the document's there."""
    try:
        yield
    except UnusableKeyError as error:
        parts = [int(part) if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", error.key)]
        value = quoted(document or {}, parts) if error.value is None else _shown(error.value)
        raise InputError(source, [Problem(error.key, value, error.expected)]) from error


def validated(model: type[File], document: Mapping[str, Any], source: str, whole: str = "a case") -> File:
    """Nested tables as a kind of file; ``source`` and ``whole`` are what messages call it, and any of its kind.

    Raises
    ------
    InputError
        With all that pydantic finds wrong.
    """
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise InputError(source, [_problem_of(one, document, model, whole) for one in error.errors()]) from error


def _problem_of(details: ErrorDetails, document: Mapping[str, Any], file: type[BaseModel], whole: str) -> Problem:
    location = details["loc"]
    key = _dotted(location)
    if details["type"] == "missing":
        if isinstance(location[-1], int):
            return Problem(_dotted(location[:-1]), quoted(document, location[:-1]), _entries(_dotted(location[:-1])))
        return Problem(key, None, f"missing; expected {_EXAMPLES.get(key, 'a value')}")
    return Problem(key, quoted(document, location), _expectation(details, key, file, whole))


def _entries(key: str) -> str:
    """What is wrong with a list of places or radii that is too short or too long."""
    if key.startswith("placed"):
        return "expected three places: x, y, z"
    if key.startswith("clusters"):
        return "expected two places: ahead and to the left"
    return "expected two radii" if "radii" in key or key.startswith("mixture") else "expected two numbers"


def _dotted(location: Sequence[str | int]) -> str:
    key = ""
    for part in location:
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else str(part)
    return key


def _expectation(details: ErrorDetails, key: str, file: type[BaseModel], whole: str) -> str:
    kind, context = details["type"], details.get("ctx", {})
    if kind == "too_long":
        most = context["max_length"]
        return _entries(key) if "radii" in key or most == 2 else f"expected at most {most} entries"
    if kind in _PLAIN:
        return _PLAIN[kind] + (f", {_EXAMPLES[key]}" if kind == "tuple_type" and key in _EXAMPLES else "")
    if kind == "extra_forbidden":
        return _unknown_key([str(part) for part in details["loc"] if isinstance(part, str)], file, whole)
    if kind == "literal_error":
        choices = str(context["expected"]).replace(" or ", ", ").replace("'", "").split(", ")
        return f"expected {context['expected']}{suggestion(str(details['input']), choices)}"
    if kind in ("model_type", "dict_type", "model_attributes_type"):
        return f"expected a table [{key}]"
    bounds = " and ".join(f"{words} {context[name]:g}" for name, words in _BOUNDS.items() if name in context)
    return f"expected {bounds}{_BOUND_UNITS.get(key, '')}" if bounds else details["msg"]


def _nested(annotation: Any) -> tuple[type[BaseModel], str] | None:
    """The model that a field holds, alone or in a list, or by names of the user's (then with ``.*``), or None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, ""
    for inner in get_args(annotation):
        if (found := _nested(inner)) is not None:
            return found[0], ".*" if get_origin(annotation) is dict else found[1]
    return None


def _walk(table: type[BaseModel], prefix: str) -> Iterator[tuple[str, type[BaseModel] | None]]:
    for name, field in table.model_fields.items():
        inner, named = _nested(field.annotation) or (None, "")
        yield f"{prefix}{name}", None if named else inner
        if named:
            yield f"{prefix}{name}{named}", inner
        if inner is not None:
            yield from _walk(inner, f"{prefix}{name}{named}.")


@cache
def keys_of(file: type[BaseModel]) -> Mapping[str, type[BaseModel] | None]:
    """All dotted keys of a kind of file; those of tables with the table's model."""
    return {"": file, **dict(_walk(file, ""))}


def suggested_key(key: str, file: type[BaseModel] = CaseFile) -> str | None:
    """What to say of a dotted key of a kind of case file if there is no such key; None if there is."""
    if key in keys_of(file):
        return "is a table of a case; expected one of its keys" if keys_of(file)[key] else None
    return _unknown_key(key.split("."), file, "a case")


def _unknown_key(location: list[str], file: type[BaseModel], whole: str) -> str:
    *tables, word = location
    known, place = keys_of(file), ""
    for part in tables:
        below = f"{place}.{part}".lstrip(".")
        place = below if below in known or f"{below}.*" in known else f"{place}.*"
    table = known.get(place)
    siblings = [field.alias or name for name, field in table.model_fields.items()] if table else []
    hint = suggestion(word, siblings)
    elsewhere = [key for key, inner in known.items() if inner is None and "*" not in key and key.split(".")[-1] == word]
    if not hint and elsewhere:
        hint = f'; did you mean "{elsewhere[0]}"?'
    within = f"[{'.'.join(tables)}]" if tables else whole
    return f"unknown key{f'; {within} takes ' if siblings else ''}{', '.join(siblings)}{hint}"
