"""From pydantic's errors to sentences with key, value and expectation, by the type of the error."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from walkers.errors import InputError, Problem, key_error, quoted, suggestion
from walkers.inputs.config_table import ConfigTable, dotted_keys, example_of, table_in, table_keys
from walkers.inputs.keys import MISSING, joined, parts_of, value_at
from walkers.inputs.units import AUTO, WRITTEN

FileModel = TypeVar("FileModel", bound=BaseModel)

_SENTENCES = {
    "greater_than": "expected more than {gt:g}",
    "greater_than_equal": "expected at least {ge:g}",
    "less_than": "expected less than {lt:g}",
    "less_than_equal": "expected at most {le:g}",
    "finite_number": "expected a finite number",
    "string_type": "expected text in quotes",
    "string_too_short": "expected text in quotes",
    "string_pattern_mismatch": "expected {meaning}{such}",
    "float_type": "expected a plain number without a unit",
    "int_type": "expected a whole number",
    "bool_type": "expected true or false",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
    "literal_error": "expected {expected}",
    "value_error": "{error}",
    **dict.fromkeys(
        ("model_type", "dict_type", "model_attributes_type"), "expected a table [{key}]"
    ),
}
"""By the type of an error of pydantic, with the values of its context."""
_GIVEN_ELSEWHERE = {"beads": "a material", "liquid": "a liquid", "contact": "surfaces"}
"""Entries of the library that give keys of these tables."""


def quoted_at(document: Mapping[str, Any], parts: Sequence[str | int]) -> str | None:
    """The value at a place of a document, quoted; None if there is none."""
    value = value_at(document, parts)
    if isinstance(value, Mapping) and "rows" in value:  # a record: a case has the name of its file
        value = value.get("file", value)
    return None if value is MISSING else quoted(value)


def _quoting(problems: Iterable[Problem], document: Mapping[str, Any]) -> list[Problem]:
    """Problems with the values at fault as the document has them."""
    return [
        replace(problem, value=problem.value or quoted_at(document, parts_of(problem.key)))
        for problem in problems
    ]


@contextmanager
def attributed_to(source: str, document: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Add to errors that name no source this one, and the value at fault as the document has it."""
    try:
        yield
    except InputError as error:
        if error.source:
            raise
        raise InputError(source, _quoting(error.problems, document or {})) from error


def validated(
    model: type[FileModel],
    document: Mapping[str, Any],
    source: str,
    whole: str = "a case",
    further: Sequence[Problem] = (),
) -> FileModel:
    """Nested tables as a kind of file (``whole``); raises `InputError` with all problems, the ``further`` ones too."""
    problems = {problem.key: problem for problem in _quoting(further, document)}
    try:
        file = model.model_validate(document, context=WRITTEN)
    except ValidationError as error:
        # A default that follows from a wrong value is no problem of its own.
        causes = (
            details for details in error.errors() if details["type"] != "default_factory_not_called"
        )
        refused = [_problem_of(details, document, model, whole) for details in causes]
        problems = {problem.key: problem for problem in refused} | problems
    if problems:
        raise InputError(source, list(problems.values()))
    return file


def _problem_of(
    details: ErrorDetails, document: Mapping[str, Any], file: type[BaseModel], whole: str
) -> Problem:
    kind, context = details["type"], details.get("ctx", {})
    location = tuple(part for part in details["loc"] if part != "[key]")  # of a name of the user's
    of_list = kind == "missing" and isinstance(location[-1], int)
    parts: tuple[str | int, ...] = location[:-1] if of_list else location
    key, field = joined(parts), dotted_keys(file).get(_place(parts, dotted_keys(file)))
    example = example_of(field) if field else "a value"
    such = f", {example.removeprefix('a value ')}" if example.startswith("a value such as") else ""
    if kind == "extra_forbidden":
        message = _unknown_key(
            [str(part) for part in location if isinstance(part, str)], file, whole
        )
    elif of_list or kind in ("too_long", "too_short"):
        value = value_at(document, parts_of(key))
        number = len(value) if isinstance(value, list) else 0
        bounds = {"max_length": "at most ", "min_length": "at least "}
        bound = next(
            (f"{word}{context[name]}" for name, word in bounds.items() if name in context), ""
        )
        bound = bound or f"{int(location[-1]) + 1}"
        message = f"has {number} value{'s' * (number != 1)}; expected {bound}{such}"
    elif kind == "missing":
        message = f"missing; expected {f'a table [{key}]' if field and table_in(field.annotation) else example}"
        if len(parts) > 1 and (entry := _GIVEN_ELSEWHERE.get(str(parts[0]))):
            message += f", or {entry} of the library"
    else:
        form = _SENTENCES.get(kind, "expected {example}")
        words = {
            "example": example,
            "such": such,
            "meaning": field.description if field else "",
            "key": key,
        }
        message = form.format(**{**words, **context})
        if kind == "literal_error":
            message += suggestion(
                str(details["input"]), re.findall(r"'([^']+)'", str(context["expected"]))
            )
        elif kind in ("list_type", "tuple_type") and field:
            message = (
                f"expected tables [[{key}]]"
                if table_in(field.annotation)
                else f"expected a list{such}"
            )
        elif kind in ("model_type", "dict_type") and str(context.get("class_name", "")).startswith(
            "Sourced"
        ):
            message = 'expected { value = ..., source = "..." }'
        if field and AUTO in field.metadata and kind != "value_error":
            message += ', or "auto"'
    return Problem(key, quoted_at(document, parts_of(key)), message)


def _place(location: Sequence[str | int], keys: Collection[str]) -> str:
    """The key of a kind of file for a key of a file, with an asterisk for a name of the user's."""
    place = ""
    for part in (part for part in location if isinstance(part, str)):
        below = f"{place}.{part}".lstrip(".")
        place = below if below in keys else f"{place}.*"
    return place


def check_key(model: type[ConfigTable], key: str) -> None:
    """Refuse a key that no case has; raises `InputError` if it is one."""
    parts, fields = re.sub(r"\[\d+\]", "", key).split("."), dotted_keys(model)
    if "" in parts:
        raise key_error(key, "is not a key of a case; expected one such as drive.frequency")
    if (field := fields.get(".".join(parts))) is None:
        raise key_error(key, _unknown_key(parts, model, "a case"))
    if table_in(field.annotation):
        raise key_error(key, "is a table of a case; expected one of its keys")


def _unknown_key(location: list[str], file: type[BaseModel], whole: str) -> str:
    *tables, word = location
    fields = dotted_keys(file)
    field = fields.get(_place(tables, fields))
    table = table_in(field.annotation) if field else None if tables else file
    siblings = list(table_keys(table)) if table else []
    keys = {
        re.sub(r"^(clusters|placed|drive\.harmonics)\.", r"\1[0].", key): field
        for key, field in fields.items()
    }
    hint = suggestion(word, siblings) if siblings else suggestion(".".join(location), keys)
    plain = [
        key for key, field in keys.items() if "*" not in key and not table_in(field.annotation)
    ]
    elsewhere = [key for key in plain if key.split(".")[-1] == word]
    if not hint and elsewhere:
        hint = f'; did you mean "{elsewhere[0]}"?'
    within = f"[{'.'.join(tables)}]" if tables else whole
    return f"unknown key{f'; {within} takes ' if siblings else ''}{', '.join(siblings)}{hint}"
