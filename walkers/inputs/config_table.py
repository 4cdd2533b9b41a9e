"""Tables of files as frozen models: the keys of a file are the fields, values are in SI units.

This module has what all tables have in common: keys and their meanings, keys that exclude each
other, copies with other values. The tables themselves are in `walkers.inputs.tables`.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, cached_property
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError, PydanticUndefined

from walkers.errors import Problem, key_error, quoted
from walkers.inputs.keys import MISSING, is_below, joined, parts_of, value_at, written
from walkers.inputs.units import WRITTEN, is_auto, kind_in

T = TypeVar("T")
Completed = TypeVar("Completed", bound="ConfigTable")
SAME_RUN = "same run"
"""Annotation of a key: cases that differ only in its value are the same run."""
_TYPES: Mapping[Any, str] = {
    str: "text in quotes",
    int: "a whole number",
    list: "a list",
    dict: "a table",
}
"""What messages call the types of values."""


def _only_derived(value: object, validation: ValidationInfo) -> object:
    """Refuse a value of a derived field if a user has written it."""
    if validation.context == WRITTEN:
        raise PydanticCustomError("extra_forbidden", "no file has this key")
    return value


_DERIVED = BeforeValidator(_only_derived)
Indirect = Annotated[T | None, SAME_RUN]
"""A key that acts through others: None unless it is given, and no determinant of the run."""
Derived = Annotated[T, _DERIVED, SkipJsonSchema()]
"""A field that follows from others, which no file has."""
NUMBER_FORM = "<number>"
"""Tag of a number where a file may have a number or a table."""
TABLE_FORM = "<table>"
"""Tag of a table where a file may have a number or a table."""


def _form(value: object) -> str:
    """The tag of a value where a file may have a number or a table."""
    return TABLE_FORM if isinstance(value, (Mapping, ConfigTable)) else NUMBER_FORM


NUMBER_OR_TABLE = Discriminator(_form)
"""Annotation of a union of a number and a table, which have the tags above."""


def key(  # noqa: PLR0913
    meaning: str,
    default: Any = PydanticUndefined,
    example: Any = None,
    *,
    gt: float | None = None,
    ge: float | None = None,
    lt: float | None = None,
    le: float | None = None,
) -> Any:
    """A key of a table.

    Parameters
    ----------
    meaning
        What the key means, for the reference and for editors.
    default
        Its value, in SI units, if a file leaves it out. A key without a default is required.
    example
        A value as a file has it.
    gt, ge, lt, le
        Bounds in SI units: greater than, greater or equal, less than, less or equal.

    Returns
    -------
    Any
        A pydantic field, to be assigned in the body of a `ConfigTable`.
    """
    examples = None if example is None else [example]
    return Field(default, description=meaning, examples=examples, gt=gt, ge=ge, lt=lt, le=le)


class Choice:
    """Keys that exclude each other: a table has those of one expression.

    Parameters
    ----------
    *expressions
        The keys of each expression, such as ``("radii",), ("mean_radius", "sin_delta")``.
    required
        Whether a table without any of these keys is refused.
    instead
        In words, what may stand in the place of these keys.
    """

    def __init__(
        self, *expressions: tuple[str, ...], required: bool = True, instead: str = ""
    ) -> None:
        self.expressions = expressions
        self.required = required
        self.instead = instead

    def excluded_by(self, name: str) -> set[str]:
        """The keys that a key excludes; none if the key is not part of the choice."""
        without = [names for names in self.expressions if name not in names]
        if len(without) == len(self.expressions):
            return set()
        return set().union(*without)


class ConfigTable(BaseModel):
    """A table of a file.

    Its fields are the keys. Values are in SI units, and unknown keys are refused. A table is
    frozen, hashed by its values, and equal to another of its class with equal values.

    Attributes
    ----------
    choices
        Keys of this class that exclude each other.
    """

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        ignored_types=(cached_property,),
        model_title_generator=lambda model: model.__name__.removesuffix("Table"),
    )
    choices: ClassVar[tuple[Choice, ...]] = ()

    @cached_property
    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, name) for name in type(self).model_fields)

    @cached_property
    def _hash(self) -> int:
        return hash(self._values)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self._values == other._values

    def with_values(self, **values: Any) -> Self:
        """The same table with other values of some fields, which are not validated."""
        table = self.model_copy(update=values)
        # The copy also has the cached properties, which follow from the former values.
        for name in table.__dict__.keys() - type(self).model_fields.keys():
            del table.__dict__[name]
        return table

    def with_value_at(self, name: str, value: Any) -> Self:
        """The same table with another value at a dotted key, which is not validated.

        Parameters
        ----------
        name
            The key, which may lead into tables and lists: ``drive.harmonics[1].phase``.
        value
            The value in SI units.
        """
        first, *rest = parts_of(name)
        field = str(first)
        if not rest:
            return self.with_values(**{field: value})
        below = getattr(self, field)
        if not isinstance(below, tuple):
            return self.with_values(**{field: below.with_value_at(joined(rest), value)})
        index = int(rest[0])
        inner = rest[1:]
        entries = list(below)
        if inner:
            entries[index] = entries[index].with_value_at(joined(inner), value)
        else:
            entries[index] = value
        return self.with_values(**{field: tuple(entries)})

    def completed(self, model: type[Completed], values: Mapping[str, Any]) -> Completed:
        """The table as a model that narrows this one.

        Parameters
        ----------
        model
            A subclass of the table whose values are all there once they are resolved.
        values
            Values in SI units of the keys that the file leaves out, and of others to be replaced.

        Returns
        -------
        Completed
            The model, validated: a value that is still missing is an error of the program.
        """
        former = {name: getattr(self, name) for name in type(self).model_fields}
        return model.model_validate({**former, **values})

    def value_of(self, name: str) -> Any:
        """The value of a dotted key; None if there is no such place."""
        value: Any = self
        for part in parts_of(name):
            if isinstance(part, int):
                if not isinstance(value, tuple) or part >= len(value):
                    return None
                value = value[part]
            else:
                if not isinstance(value, ConfigTable) or part not in type(value).model_fields:
                    return None
                value = getattr(value, part)
        return value

    def leaves(self, prefix: str = "") -> Iterator[tuple[str, Any, FieldInfo]]:
        """The values of all keys, also of tables in the table, without derived fields.

        Parameters
        ----------
        prefix
            What the dotted keys begin with.

        Yields
        ------
        tuple
            Dotted key, value in SI units, and field.
        """
        for name, field in table_keys(type(self)).items():
            value = getattr(self, name)
            place = f"{prefix}{name}"
            if isinstance(value, ConfigTable):
                yield from value.leaves(f"{place}.")
            elif isinstance(value, tuple) and value and isinstance(value[0], ConfigTable):
                for number, entry in enumerate(value):
                    yield from entry.leaves(f"{place}[{number}].")
            else:
                yield place, value, field

    def determinants(self) -> dict[str, Any]:
        """The values in which two different runs differ, by the names of their fields.

        The name of a run has a hash of them. Derived fields count too; keys that are marked
        `SAME_RUN` do not. Absent values (None, or an empty list) are left out: a new key therefore
        leaves all names of runs as they are, while a new name of a field, or a new default, changes
        them.

        Returns
        -------
        dict
            Values in SI units. Tables are dictionaries, and several tables lists of dictionaries.
        """
        determinants: dict[str, Any] = {}
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if SAME_RUN in field.metadata or value in (None, ()):
                continue
            if isinstance(value, ConfigTable):
                determinants[name] = value.determinants()
            elif isinstance(value, tuple) and isinstance(value[0], ConfigTable):
                determinants[name] = [entry.determinants() for entry in value]
            else:
                determinants[name] = value
        return determinants

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Contradictions and gaps of a table as a file has it.

        Parameters
        ----------
        given
            The keys that the file gives, and their values.
        place
            The dotted key of the table; empty for the whole file.
        """
        for choice in cls.choices:
            yield from cls.problems_of(choice, given, place)

    @classmethod
    def problems_of(cls, choice: Choice, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """The problems of a table that has no complete expression of a choice, or several.

        Parameters
        ----------
        choice
            The keys of which the table has one expression.
        given
            The keys that the file gives, and their values. A key with "auto" begins no expression,
            but is not missing either.
        place
            The dotted key of the table; empty for the whole file.
        """
        begun = [names for names in choice.expressions if _has_any(given, names)]
        if len(begun) > 1:
            first, second = begun[:2]
            at_fault = next(name for name in second if name in given)
            either = f"{' and '.join(first)} or {' and '.join(second)}"
            message = f"expected either {either}, not both"
            yield Problem(key_within(place, at_fault), None, message)
        elif begun or choice.required:
            expected = begun[0] if begun else choice.expressions[0]
            instead = ""
            if not begun:
                for names in choice.expressions[1:]:
                    instead += f", or {' and '.join(names)}"
            if choice.instead:
                instead += f", or {choice.instead}"
            for name in expected:
                if name not in given:
                    yield cls.missing(name, place, instead)

    @classmethod
    def replaced_by(cls, name: str, _value: object) -> set[str]:
        """The keys of this table that a new value of a key replaces.

        Parameters
        ----------
        name
            The key.
        _value
            The value as a file has it. Most tables do not depend on it.
        """
        replaced: set[str] = set()
        for choice in cls.choices:
            replaced |= choice.excluded_by(name)
        return replaced

    @classmethod
    def missing(cls, name: str, place: str, instead: str = "") -> Problem:
        """The problem of a missing key.

        Parameters
        ----------
        name
            The key.
        place
            The dotted key of its table.
        instead
            End of the message, such as ``, or diameters``: what may be given in its place.
        """
        whole_key = key_within(place, name)
        field = cls.model_fields[name]
        example = example_of(field)
        if is_list_of_tables(field):
            example = f"at least one table [[{whole_key}]]"
        return Problem(whole_key, None, f"missing; expected {example}{instead}")


def _has_any(given: Mapping[str, Any], names: Iterable[str]) -> bool:
    """Whether a table has one of some keys with a value other than "auto"."""
    return any(name in given and not is_auto(given[name]) for name in names)


def present(value: T | None, name: str) -> T:
    """A value that the choices of its table require; `InputError` for its key if it is None."""
    if value is None:
        raise key_error(name, "missing")
    return value


def key_within(place: str, name: str) -> str:
    """The dotted key of a key of the table at a place; an empty place is the whole file."""
    return f"{place}.{name}".removeprefix(".")


@cache
def table_keys(model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """The keys of a table, as a file has them, with their fields; not those of tables in it."""
    keys = {}
    for name, field in model.model_fields.items():
        if _DERIVED not in field.metadata:
            keys[field.alias or name] = field
    return keys


@cache
def dotted_keys(model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """All dotted keys of a kind of file with their fields; ``.*`` is a name that the user gives."""
    keys: dict[str, FieldInfo] = {}
    for name, field in table_keys(model).items():
        keys[name] = field
        table = table_in(field.annotation)
        if table is None:
            continue
        prefix = name
        if get_origin(field.annotation) is dict:
            prefix = f"{name}.*"
            keys[prefix] = field
        for name_below, field_below in dotted_keys(table).items():
            keys[f"{prefix}.{name_below}"] = field_below
    return keys


def table_in(annotation: Any) -> type[ConfigTable] | None:
    """The class of the tables that a field contains: one table, several in a list, or by names."""
    if isinstance(annotation, type) and issubclass(annotation, ConfigTable):
        return annotation
    for argument in get_args(annotation):
        table = table_in(argument)
        if table is not None:
            return table
    return None


def table_class_of(field: FieldInfo | None) -> type[ConfigTable] | None:
    """The class of the tables that a field contains; None for another field, and for no field."""
    return table_in(field.annotation) if field else None


def is_table(field: FieldInfo | None) -> bool:
    """Whether the value of a field is a table, or a list of tables, and never a plain value."""
    if field is None or table_in(field.annotation) is None:
        return False
    return not any(isinstance(item, Discriminator) for item in field.metadata)


def is_list_of_tables(field: FieldInfo | None) -> bool:
    """Whether the value of a field is a list of tables, such as ``[[boundary.planes]]``."""
    return field is not None and is_table(field) and get_origin(field.annotation) in (tuple, list)


def is_number_or_table(field: FieldInfo | None) -> bool:
    """Whether the value of a field may be a number, or a table in its place."""
    return table_class_of(field) is not None and not is_table(field)


def example_of(field: FieldInfo) -> str:
    """An example of a value, as in ``a value such as "80 Hz"``, or its type if there is none."""
    if field.examples:
        return f"a value such as {quoted(field.examples[0])}"
    kind = kind_in([*field.metadata, field.annotation])
    if kind:
        return f'a value such as "{kind.example}"'
    return _TYPES.get(get_origin(field.annotation) or field.annotation, "a value")


def contradictions(model: type[ConfigTable], document: Any, place: str = "") -> Iterator[Problem]:
    """Contradictions and gaps of all tables of a document.

    Parameters
    ----------
    model
        The class of the table at the place, whose `ConfigTable.problems` are asked for.
    document
        The table as a file has it. What is not a table has no problems here: the validation of the
        models refuses it.
    place
        The dotted key of the table; empty for the whole file.
    """
    if not isinstance(document, Mapping):
        return
    given = {name: value for name, value in document.items() if value != []}
    yield from model.problems(given, place)
    for name, value in document.items():
        table = table_class_of(table_keys(model).get(name))
        if table is None:
            continue
        inner_place = key_within(place, name)
        if isinstance(value, list):
            for number, entry in enumerate(value):
                yield from contradictions(table, entry, f"{inner_place}[{number}]")
        else:
            yield from contradictions(table, value, inner_place)


def _field_at(model: type[ConfigTable], parts: Iterable[str | int]) -> FieldInfo | None:
    """The field at names of tables and indices of lists; None if a kind of file has no such key."""
    names = [part for part in parts if isinstance(part, str)]
    return dotted_keys(model).get(".".join(names))


def alternatives(model: type[ConfigTable], name: str, value: object = None) -> set[str]:
    """The dotted keys that a dotted key of a kind of file excludes.

    Parameters
    ----------
    model
        The class of the whole file.
    name
        The dotted key.
    value
        The value of the key as a file has it: a shape excludes the sizes of other shapes. None: any
        value.
    """
    *path, last = parts_of(name)
    table: type[ConfigTable] | None = model
    if path:
        table = table_class_of(_field_at(model, path))
    if table is None:
        return set()
    return {joined([*path, other_name]) for other_name in table.replaced_by(str(last), value)}


def replaced_keys(
    model: type[ConfigTable], document: Mapping[str, Any], changes: Mapping[str, Any]
) -> dict[str, list[str]]:
    """The keys of a document that changes replace by other keys.

    Parameters
    ----------
    model, document, changes
        As for `changed`.

    Returns
    -------
    dict
        For each change that replaces other keys of the document, these keys in alphabetical order.
        A number replaces the keys of a table in its place, and each key of the table the number.
    """
    replaced: dict[str, list[str]] = {}
    for name, value in changes.items():
        excluded = alternatives(model, name, value) - changes.keys()
        given = _replaced_form(model, document, name, changes)
        for key in excluded:
            if value_at(document, parts_of(key)) is not MISSING:
                given.append(key)
        if given:
            replaced[name] = sorted(given)
    return replaced


def _replaced_form(
    model: type[ConfigTable], document: Mapping[str, Any], name: str, changes: Mapping[str, Any]
) -> list[str]:
    """The keys of the other form of a value that may be a number or a table.

    The parameters are those of `replaced_keys`, and the dotted key of one of the changes. Empty if
    the document has the same form, or if `changed` refuses the change.
    """
    present = value_at(document, parts_of(name))
    if isinstance(present, Mapping) and not isinstance(changes[name], Mapping):
        if is_number_or_table(_field_at(model, parts_of(name))):
            return [key_within(name, part) for part in present]
        return []
    place = joined(parts_of(name)[:-1])
    number = value_at(document, parts_of(place))
    if number is MISSING or isinstance(number, Mapping) or place in changes:
        return []
    if gives_whole_table(model, place, changes):
        return [place]
    return []


def changed(
    model: type[ConfigTable], document: Mapping[str, Any], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """A document with other values.

    Parameters
    ----------
    model
        The class of the whole document.
    document
        Tables as a file has them; they stay as they are.
    changes
        Values by dotted keys, ``dimers.radii[0]`` for one of a list.

    Returns
    -------
    dict
        The tables with the changes. Keys that a new one excludes (`alternatives`) are left out,
        unless they change too. A key and a part of its value may change together: the part counts.
        All keys of a table replace the number that may stand in its place.

    Raises
    ------
    InputError
        If a key leads to an entry that a list does not have, or to a part of a table where a number
        stands in its place.
    """
    tables = copy.deepcopy(dict(document))
    parts_last = sorted(changes, key=lambda name: any(is_below(name, whole) for whole in changes))
    for name in parts_last:
        value = changes[name]
        _make_table_of_number(model, tables, name, changes)
        excluded = alternatives(model, name, value) - changes.keys()
        _refuse_missing_entry(model, tables, name, value)
        _set_value_at(tables, name, copy.deepcopy(value), excluded)
    return tables


def _make_table_of_number(
    model: type[ConfigTable], tables: dict[str, Any], name: str, changes: Mapping[str, Any]
) -> None:
    """Replace a number by an empty table if a dotted key leads into a table in its place.

    Parameters
    ----------
    model
        The class of the whole document.
    tables
        The document, which is changed.
    name
        The dotted key.
    changes
        All changes of the document, with that of the key.

    Raises
    ------
    InputError
        If the changes do not have all keys of the table, or have the number too.
    """
    *path, _ = parts_of(name)
    field = _field_at(model, path)
    table = table_class_of(field)
    present = value_at(tables, path)
    if table is None or not is_number_or_table(field):
        return
    if present is MISSING or isinstance(present, Mapping):
        return
    place = joined(path)
    words = quoted(present)
    if isinstance(present, (int, float)):
        words = f"the number {words}"
    if not gives_whole_table(model, place, changes):
        message = f"{place} is {words} here; {whole_table_of(model, place)}"
        raise key_error(name, message, changes[name])
    if place in changes:
        message = f"{place} is given as {words} too; expected either of them"
        raise key_error(name, message, changes[name])
    _set_value_at(tables, place, {}, ())


def gives_whole_table(model: type[ConfigTable], place: str, changes: Mapping[str, Any]) -> bool:
    """Whether changes have all required keys of a table, which may replace a number.

    Parameters
    ----------
    model
        The class of the whole document.
    place
        The dotted key of the table, or any other key.
    changes
        Values by dotted keys.
    """
    field = _field_at(model, parts_of(place))
    table = table_class_of(field)
    if table is None or not is_number_or_table(field):
        return False
    for part, field_of_part in table_keys(table).items():
        if field_of_part.is_required() and key_within(place, part) not in changes:
            return False
    return True


def whole_table_of(model: type[ConfigTable], place: str) -> str:
    """The end of a message about parts of a table at a dotted key where a number stands."""
    table = table_class_of(_field_at(model, parts_of(place)))
    keys = ", ".join(f".{part}" for part in table_keys(table or model))
    return f"give all keys of the table that replaces it: {place}{keys}"


def _set_value_at(tables: dict[str, Any], name: str, value: Any, excluded: Iterable[str]) -> None:
    """Set the value of a dotted key in tables, and remove the keys that it excludes."""
    place: Any = tables
    parts = parts_of(name)
    for number, part in enumerate(parts):
        above = joined(parts[:number])
        is_index = isinstance(part, int)
        if isinstance(place, list) and not is_index:
            message = f"{above} is a list: say which one, such as {above}[0]"
            raise key_error(name, message, value)
        if not is_index and not isinstance(place, dict):
            return  # the base case is wrong there: its own validation says so
        if number == len(parts) - 1:
            break
        place = place[part] if isinstance(part, int) else place.setdefault(part, {})
    for excluded_name in excluded:
        place.pop(parts_of(excluded_name)[-1], None)
    place[parts[-1]] = value


def _refuse_missing_entry(
    model: type[ConfigTable], tables: Mapping[str, Any], name: str, value: Any
) -> None:
    """Raise `InputError` if a dotted key names an entry that the list above it does not have.

    If the tables have another key in place of the list, such as radii for diameters, the message
    says so.
    """
    parts = parts_of(name)
    for number, part in enumerate(parts):
        if not isinstance(part, int):
            continue
        above = joined(parts[:number])
        entries = value_at(tables, parts[:number])
        message = f"the base case has no {above}"
        if not isinstance(entries, list):
            raise key_error(name, message + _whole_list_instead(model, tables, above), value)
        if part >= len(entries):
            expected = f"expected an index below [{len(entries)}]"
            raise key_error(name, f"{message} of that length; {expected}", value)


def _whole_list_instead(model: type[ConfigTable], tables: Mapping[str, Any], name: str) -> str:
    """The end of a message about an entry of a list that the tables do not have.

    It names the keys that they have in place of the list, and how to give the list.
    """
    present = []
    for key in sorted(alternatives(model, name)):
        if value_at(tables, parts_of(key)) is not MISSING:
            present.append(key)
    instead = f" but {' and '.join(present)}" if present else ""
    example = ""
    field = _field_at(model, parts_of(name))
    if field is not None and field.examples:
        example = f", such as {name}={written(field.examples[0])}"
    return f"{instead}; expected the whole list{example}"
