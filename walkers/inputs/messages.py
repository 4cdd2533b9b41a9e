"""Messages about bad input: pydantic's errors as sentences with key, value and expectation.

The sentence depends on the type of pydantic's error. What pydantic does not detect is worded where
it is detected (`walkers.errors.key_error`); this module adds the source and the value at fault.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from walkers.errors import InputError, Problem, key_error, quoted, suggestion
from walkers.inputs.config_table import (
    NUMBER_FORM,
    TABLE_FORM,
    ConfigTable,
    dotted_keys,
    example_of,
    is_list_of_tables,
    is_table,
    table_class_of,
    table_keys,
)
from walkers.inputs.keys import MISSING, joined, parts_of, value_at
from walkers.inputs.units import AUTO, WRITTEN
from walkers.rounding import counted

FileModel = TypeVar("FileModel", bound=BaseModel)

_NOT_IN_FILES = ("[key]", NUMBER_FORM, TABLE_FORM)
"""Parts of the locations of pydantic's errors that are no keys of a file."""
_SENTENCES = {
    "greater_than": "expected more than {gt:g}",
    "greater_than_equal": "expected at least {ge:g}",
    "less_than": "expected less than {lt:g}",
    "less_than_equal": "expected at most {le:g}",
    "finite_number": "expected a finite number",
    "string_type": "expected text in quotes",
    "string_too_short": "expected text in quotes",
    "string_pattern_mismatch": "expected {meaning}{such_as}",
    "float_type": "expected a plain number without a unit",
    "int_type": "expected a whole number",
    "bool_type": "expected true or false",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
    "literal_error": "expected {expected}",
    "value_error": "{error}",
    "model_type": "expected a table [{key}]",
    "dict_type": "expected a table [{key}]",
    "model_attributes_type": "expected a table [{key}]",
}
"""Sentences by the type of pydantic's error, with words of its context and of `_wrong_value`."""
_LIBRARY_ENTRIES = {"beads": "a material", "liquid": "a liquid", "contact": "surfaces"}
"""What a case may name instead of the keys of a table: an entry of the library has them."""
_LISTS_OF_TABLES = re.compile(r"^(clusters|placed|drive\.harmonics)\.")
"""Start of the key of a table of which a case has several; a message suggests ``clusters[0].…``."""


@dataclass(frozen=True)
class _Place:
    """Where a document is wrong."""

    parts: tuple[str | int, ...]
    """Names of tables and indices of lists."""
    field: FieldInfo | None
    """The field of the key; None if the kind of file has no such key."""

    @property
    def key(self) -> str:
        """The dotted key."""
        return joined(self.parts)

    @property
    def is_table(self) -> bool:
        """Whether the value at the place is a table, or a list of tables."""
        return is_table(self.field)

    @property
    def meaning(self) -> str:
        """What the key means; empty without a field."""
        return str(self.field.description) if self.field else ""

    @property
    def example(self) -> str:
        """``a value such as …``, or the type of the value."""
        return example_of(self.field) if self.field else "a value"

    @property
    def such_as(self) -> str:
        """The example as the end of a sentence, ``, such as …``; empty if there is none."""
        if self.example.startswith("a value such as"):
            return f", {self.example.removeprefix('a value ')}"
        return ""


def quoted_at(document: Mapping[str, Any], parts: Sequence[str | int]) -> str | None:
    """The value at a place of a document, quoted; None if there is none."""
    value = value_at(document, parts)
    if value is MISSING:
        return None
    if isinstance(value, Mapping) and "rows" in value:
        # The contents of a record stand in the place of the name of its file, which the user wrote.
        value = value.get("file", value)
    return quoted(value)


def _with_quotations(problems: Iterable[Problem], document: Mapping[str, Any]) -> list[Problem]:
    """Problems with the values at fault, quoted from the document where they have none yet."""
    complete = []
    for problem in problems:
        value = problem.value or quoted_at(document, parts_of(problem.key))
        complete.append(replace(problem, value=value))
    return complete


@contextmanager
def attributed_to(source: str, document: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Give the input errors that are raised in a ``with`` block a source, if they have none.

    Parameters
    ----------
    source
        The file, option or argument that messages name.
    document
        Its tables, from which the values at fault are quoted.
    """
    try:
        yield
    except InputError as error:
        if error.source:
            raise
        raise InputError(source, _with_quotations(error.problems, document or {})) from error


def validated(
    model: type[FileModel],
    document: Mapping[str, Any],
    source: str,
    file_kind: str = "a case",
    further: Sequence[Problem] = (),
) -> FileModel:
    """Nested tables as a model of a kind of file.

    Parameters
    ----------
    model
        The class of the whole file.
    document
        The tables; quantities are text with units.
    source
        What messages call the document.
    file_kind
        The kind of file in words, for messages.
    further
        Problems of the document that were detected before.

    Returns
    -------
    FileModel
        The values in SI units.

    Raises
    ------
    InputError
        With all problems, the further ones too; one for each key.
    """
    problems: dict[str, Problem] = {}
    file = None
    try:
        file = model.model_validate(document, context=WRITTEN)
    except ValidationError as error:
        for details in error.errors():
            # A default that follows from a wrong value is no problem of its own.
            if details["type"] != "default_factory_not_called":
                problem = _problem_of(details, document, model, file_kind)
                problems[problem.key] = problem
    for problem in _with_quotations(further, document):
        problems[problem.key] = problem
    if problems or file is None:
        raise InputError(source, list(problems.values()))
    return file


def _problem_of(
    details: ErrorDetails, document: Mapping[str, Any], model: type[BaseModel], file_kind: str
) -> Problem:
    """One of pydantic's errors as a problem of a file."""
    error_type = details["type"]
    # Pydantic marks a name that the user gives, and that is wrong itself, by a part "[key]", and
    # names the form of a value of several forms.
    location = tuple(part for part in details["loc"] if part not in _NOT_IN_FILES)
    parts = location
    lacks_entry = error_type == "missing" and isinstance(location[-1], int)
    if lacks_entry:
        parts = location[:-1]  # the list is too short, rather than its entry wrong
    fields = dotted_keys(model)
    place = _Place(parts, fields.get(_general_key(parts, fields)))
    if error_type == "extra_forbidden":
        names = [part for part in parts if isinstance(part, str)]
        message = _unknown_key(names, model, file_kind)
    elif lacks_entry:
        message = _wrong_length(place, document, str(int(location[-1]) + 1))
    elif error_type == "too_long":
        message = _wrong_length(place, document, f"at most {details['ctx']['max_length']}")
    elif error_type == "too_short":
        message = _wrong_length(place, document, f"at least {details['ctx']['min_length']}")
    elif error_type == "missing":
        message = _missing(place)
    else:
        message = _wrong_value(place, details)
    return Problem(place.key, quoted_at(document, parts_of(place.key)), message)


def _wrong_length(place: _Place, document: Mapping[str, Any], expected: str) -> str:
    """The message about a list with too few or too many values."""
    value = value_at(document, parts_of(place.key))
    number = 0
    if isinstance(value, list):
        number = len(value)
    return f"has {counted(number, 'value')}; expected {expected}{place.such_as}"


def _missing(place: _Place) -> str:
    """The message about a required key or table that the file leaves out."""
    expected = f"a table [{place.key}]" if place.is_table else place.example
    message = f"missing; expected {expected}"
    entry = _LIBRARY_ENTRIES.get(str(place.parts[0]))
    is_key_of_table = len(place.parts) > 1  # the table itself must be there to name the entry
    if entry and is_key_of_table:
        message += f", or {entry} of the library"
    return message


def _wrong_value(place: _Place, details: ErrorDetails) -> str:
    """The message about a value of the wrong type or outside its bounds."""
    error_type = details["type"]
    context = details.get("ctx", {})
    is_sourced = str(context.get("class_name", "")).startswith("Sourced")  # a number of the library
    if error_type in ("list_type", "tuple_type") and place.is_table:
        message = f"expected tables [[{place.key}]]"
    elif error_type in ("list_type", "tuple_type"):
        message = f"expected a list{place.such_as}"
    elif error_type == "model_type" and is_sourced:
        message = 'expected { value = ..., source = "..." }'
    else:
        words = {
            "example": place.example,
            "such_as": place.such_as,
            "meaning": place.meaning,
            "key": place.key,
        }
        message = _SENTENCES.get(error_type, "expected {example}").format(**(words | context))
    if error_type == "literal_error":
        literals = re.findall(r"'([^']+)'", str(context["expected"]))
        message += suggestion(str(details["input"]), literals)
    if place.field and AUTO in place.field.metadata and error_type != "value_error":
        message += ', or "auto"'
    return message


def _general_key(location: Sequence[str | int], keys: Collection[str]) -> str:
    """The key among those of a kind of file that stands for a key of a file.

    It has no indices of lists, and an asterisk for a name that the user gives.
    """
    general = ""
    for part in location:
        if isinstance(part, str):
            below = f"{general}.{part}".lstrip(".")
            if below not in keys:
                below = f"{general}.*"
            general = below
    return general


def check_key(model: type[ConfigTable], key: str) -> None:
    """Refuse a dotted key that a case does not have, or that is a table; raises `InputError`."""
    parts = re.sub(r"\[\d+\]", "", key).split(".")
    if "" in parts:
        raise key_error(key, "is not a key of a case; expected one such as drive.frequency")
    field = dotted_keys(model).get(".".join(parts))
    if field is None:
        raise key_error(key, _unknown_key(parts, model, "a case"))
    if is_list_of_tables(field):
        message = f"is a list of tables, which only a case file has: [[{key}]]"
        raise key_error(key, f"{message}; expected a key of one of them, such as {key}[0].KEY")
    if is_table(field):
        raise key_error(key, "is a table of a case; expected one of its keys")


def _unknown_key(names: Sequence[str], model: type[BaseModel], file_kind: str) -> str:
    """The message about a key that does not exist.

    It lists the keys of its table and suggests one that the user may mean. If there is no such
    table, it only suggests one.

    Parameters
    ----------
    names
        The names of the tables, and last that of the key.
    model
        The class of the whole file.
    file_kind
        The kind of file in words.
    """
    *tables, name = names
    keys_of_table = _keys_of_table(tables, model)
    fields = _fields_by_indexed_key(model)
    same_key_elsewhere = _same_key_elsewhere(name, fields)
    if not keys_of_table:
        return f"unknown key{suggestion('.'.join(names), fields) or same_key_elsewhere}"
    table = file_kind
    if tables:
        table = f"[{'.'.join(tables)}]"
    hint = suggestion(name, keys_of_table) or same_key_elsewhere
    return f"unknown key; {table} takes {', '.join(keys_of_table)}{hint}"


def _keys_of_table(tables: Sequence[str], model: type[BaseModel]) -> list[str]:
    """The keys of the innermost of nested tables; none if there is no such table."""
    if not tables:
        return list(table_keys(model))
    fields = dotted_keys(model)
    table = table_class_of(fields.get(_general_key(tables, fields)))
    if table is None:
        return []
    return list(table_keys(table))


def _fields_by_indexed_key(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields of a kind of file by their keys, with the index [0] for lists of tables."""
    fields = {}
    for key, field in dotted_keys(model).items():
        fields[_LISTS_OF_TABLES.sub(r"\1[0].", key)] = field
    return fields


def _same_key_elsewhere(name: str, fields: Mapping[str, FieldInfo]) -> str:
    """A suggestion of the first key of this name in another table; empty if there is none."""
    for key, field in fields.items():
        is_plain = "*" not in key and not is_table(field)
        if is_plain and key.split(".")[-1] == name:
            return f'; did you mean "{key}"?'
    return ""
