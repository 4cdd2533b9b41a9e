"""Tables of files as frozen models: a file's keys are the fields, values are in SI units."""

from __future__ import annotations

import copy
from collections.abc import Collection, Iterator, Mapping
from functools import cache, cached_property
from typing import Annotated, Any, ClassVar, Self, TypeVar, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError, PydanticUndefined

from walkers.errors import Problem, key_error, quoted
from walkers.inputs.keys import joined, parts_of
from walkers.inputs.units import WRITTEN, is_auto, kind_in

T = TypeVar("T")
Completed = TypeVar("Completed", bound="ConfigTable")
SAME_RUN = "same run"
"""Annotation of a key: another value does not make another run, by itself."""
_TYPES: Mapping[Any, str] = {
    str: "text in quotes",
    int: "a whole number",
    list: "a list",
    dict: "a table",
}


def _only_derived(value: object, validation: ValidationInfo) -> object:
    if validation.context == WRITTEN:
        raise PydanticCustomError("extra_forbidden", "no file has this key")
    return value


_DERIVED = BeforeValidator(_only_derived)
Indirect = Annotated[T | None, SAME_RUN]
"""A key that acts through others: None unless it is given, and no determinant of the run."""
Derived = Annotated[T, _DERIVED, SkipJsonSchema()]
"""A field that follows from others, which no file has."""


def key(meaning: str, default: Any = PydanticUndefined, example: Any = None, **bounds: Any) -> Any:
    """A key of a table: its meaning, default (required without one), an example as a file has it, and bounds."""
    return Field(
        default, description=meaning, examples=None if example is None else [example], **bounds
    )


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
        """Keys that a key excludes."""
        without = [names for names in self.expressions if name not in names]
        if len(without) == len(self.expressions):
            return set()
        return {key for names in without for key in names}


class ConfigTable(BaseModel):
    """A table of a file. Its fields are the keys; values are in SI units; unknown keys are refused."""

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
        """The same table with other values, which are not validated."""
        table = self.model_copy(update=values)
        for name in table.__dict__.keys() - type(self).model_fields.keys():
            del table.__dict__[name]  # cached properties of the former values
        return table

    def with_value_at(self, name: str, value: Any) -> Self:
        """The same tables with another value at a dotted key, which is not validated."""
        first, *rest = parts_of(name)
        if not rest:
            return self.with_values(**{str(first): value})
        below = getattr(self, str(first))
        if isinstance(below, tuple):
            number, *inner = rest
            new = below[int(number)].with_value_at(joined(inner), value) if inner else value
            return self.with_values(
                **{str(first): (*below[: int(number)], new, *below[int(number) + 1 :])}
            )
        return self.with_values(**{str(first): below.with_value_at(joined(rest), value)})

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
                value = value[part] if isinstance(value, tuple) and part < len(value) else None
            else:
                has_key = isinstance(value, ConfigTable) and part in type(value).model_fields
                value = getattr(value, part) if has_key else None
        return value

    def leaves(self, prefix: str = "") -> Iterator[tuple[str, Any, FieldInfo]]:
        """Values of all keys, tables in tables by dotted keys, each with its field; without derived fields."""
        for name, field in table_keys(type(self)).items():
            value, place = getattr(self, name), f"{prefix}{name}"
            if isinstance(value, ConfigTable):
                yield from value.leaves(f"{place}.")
            elif isinstance(value, tuple) and value and isinstance(value[0], ConfigTable):
                for number, entry in enumerate(value):
                    yield from entry.leaves(f"{place}[{number}].")
            else:
                yield place, value, field

    def determinants(self) -> dict[str, Any]:
        """The values that make another run if they differ, by the fields that hold them; absent ones are left out.

        A new key therefore renames no runs; a field of another name, or another default, renames all.
        """
        kept = {}
        for name, field in type(self).model_fields.items():
            if SAME_RUN in field.metadata or (value := getattr(self, name)) in (None, ()):
                continue
            several = isinstance(value, tuple) and isinstance(value[0], ConfigTable)
            kept[name] = [entry.determinants() for entry in value] if several else value
            if isinstance(value, ConfigTable):
                kept[name] = value.determinants()
        return kept

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Contradictions and gaps of a table that is given at a place."""
        for choice in cls.choices:
            yield from cls.problems_of(choice, given, place)

    @classmethod
    def problems_of(cls, choice: Choice, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """The problem of a table that has several expressions of a choice, or a part of one, or none."""
        begun = [
            names
            for names in choice.expressions
            if any(not is_auto(given.get(name, "auto")) for name in names)
        ]
        if len(begun) > 1:
            name = next(name for name in begun[1] if name in given)
            two = " or ".join(map(" and ".join, begun[:2]))
            yield Problem(key_within(place, name), None, f"expected either {two}, not both")
        elif begun or choice.required:
            expected = begun[0] if begun else choice.expressions[0]
            instead = [
                " and ".join(names)
                for names in choice.expressions
                if not begun and names != expected
            ]
            instead += [choice.instead] if choice.instead else []
            for name in (name for name in expected if name not in given):
                yield cls.missing(name, place, "".join(f", or {words}" for words in instead))

    @classmethod
    def missing(cls, name: str, place: str, instead: str = "") -> Problem:
        """The problem of a missing key of a table at a place, with an example, and alternatives."""
        return Problem(
            key_within(place, name),
            None,
            f"missing; expected {example_of(cls.model_fields[name])}{instead}",
        )


def present(value: T | None, name: str) -> T:
    """A value of a dotted key that the choices of its table require; raises `InputError` if it is missing."""
    if value is None:
        raise key_error(name, "missing")
    return value


def key_within(place: str, name: str) -> str:
    """The dotted key of a key of a table at a place."""
    return f"{place}.{name}".removeprefix(".")


@cache
def table_keys(model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """The keys of a table, as a file has them, with their fields."""
    fields = model.model_fields.items()
    return {field.alias or name: field for name, field in fields if _DERIVED not in field.metadata}


@cache
def dotted_keys(model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """All dotted keys of a kind of file with their fields; ``.*`` stands for names of the user's."""
    keys: dict[str, FieldInfo] = {}
    for name, field in table_keys(model).items():
        table, names = (
            table_in(field.annotation),
            f"{name}.*" if get_origin(field.annotation) is dict else name,
        )
        keys |= {name: field, names: field} if table else {name: field}
        keys |= (
            {f"{names}.{key}": below for key, below in dotted_keys(table).items()} if table else {}
        )
    return keys


def table_in(annotation: Any) -> type[ConfigTable] | None:
    """The table that a field holds, alone, in a tuple or by names."""
    if isinstance(annotation, type) and issubclass(annotation, ConfigTable):
        return annotation
    return next((table for inner in get_args(annotation) if (table := table_in(inner))), None)


def example_of(field: FieldInfo) -> str:
    """An example of a value of a key: ``a value such as "80 Hz"``; its type if the field has none."""
    if field.examples:
        return f"a value such as {quoted(field.examples[0])}"
    kind = kind_in([*field.metadata, field.annotation])
    if kind:
        return f'a value such as "{kind.example}"'
    return _TYPES.get(get_origin(field.annotation) or field.annotation, "a value")


def contradictions(model: type[ConfigTable], document: Any, place: str = "") -> Iterator[Problem]:
    """Contradictions and gaps of the tables of a document (`Table.problems`)."""
    if not isinstance(document, Mapping):
        return
    yield from model.problems(
        {name: value for name, value in document.items() if value != []}, place
    )
    for name, below in document.items():
        field, where = table_keys(model).get(name), key_within(place, name)
        if field is None or (inner := table_in(field.annotation)) is None:
            continue
        for number, entry in enumerate(below if isinstance(below, list) else [below]):
            yield from contradictions(
                inner, entry, f"{where}[{number}]" if isinstance(below, list) else where
            )


def alternatives(model: type[ConfigTable], name: str) -> set[str]:
    """Dotted keys that a key excludes."""
    *path, last = parts_of(name)
    if path:
        field = dotted_keys(model).get(".".join(part for part in path if isinstance(part, str)))
        if (table := table_in(field.annotation) if field else None) is None:
            return set()
        model = table
    return {
        joined([*path, name]) for choice in model.choices for name in choice.excluded_by(str(last))
    }


def changed(
    model: type[ConfigTable], document: Mapping[str, Any], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """A document with other values at dotted keys (``dimers.radii[0]`` for one of a list).

    Keys that a new one excludes (`Table.choices`) go, unless they change too.
    """
    tables = copy.deepcopy(dict(document))
    for name, value in changes.items():
        _put(tables, name, value, alternatives(model, name) - changes.keys())
    return tables


def _put(tables: dict[str, Any], name: str, value: Any, instead_of: Collection[str]) -> None:
    place: Any = tables
    parts = parts_of(name)
    for number, part in enumerate(parts):
        above = parts[:number]
        if isinstance(part, int):
            if not isinstance(place, list) or part >= len(place):
                expected = (
                    f"a place below [{len(place)}]" if isinstance(place, list) else "the whole list"
                )
                message = (
                    f"the base case has no {joined(above)} of that length; expected {expected}"
                )
                raise key_error(name, message, value)
        elif isinstance(place, list):
            raise key_error(
                name, f"{joined(above)} is a list: say which one, such as {joined(above)}[0]", value
            )
        elif not isinstance(place, dict):  # the base case is wrong there, which its own check tells
            return
        if number + 1 < len(parts):
            place = place[part] if isinstance(part, int) else place.setdefault(part, {})
    for replaced in instead_of:
        place.pop(parts_of(replaced)[-1], None)
    place[parts[-1]] = value
