"""Values of a case in usual units by the keys of a case file; differences between cases."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import cache
from math import isclose
from typing import Any

from pydantic_core import to_jsonable_python

from walkers.errors import input_error
from walkers.inputs import units
from walkers.inputs.config_table import dotted_keys
from walkers.inputs.origins import text_of
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.units import QuantityKind


class FlatCase(dict[str, Any]):
    """The values of a case by dotted key, SI units; ``words`` say where each is from, as `walkers.inputs.origins`."""

    words: Mapping[str, str] = {}


def flattened(case: Case) -> FlatCase:
    """The values of a case as plain JSON types, by the keys of a case file."""
    flat = FlatCase(
        (origin.key, to_jsonable_python(origin.value))
        for origin in case.origins
        if origin.value is not None
    )
    if case.placed:  # which have no origins, because there may be hundreds
        flat["placed"] = [[*bead.at, bead.radius] for bead in case.placed]
    flat.words = {"placed": "given", **{origin.key: origin.word for origin in case.origins}}
    return flat


def readable(key: str, value: Any) -> str:
    """A value of `flattened` as a case file has it, such as ``4 g``; a dash for none."""
    if value is None:
        return "-"
    if key == "environment.gravity":  # the unit g is the paper's 9.8 m/s², not gravity
        return f"{value:.6g} m/s^2"
    if key.startswith("contact.roughness."):
        return f"{value * 1e9:.6g} nm"
    if key == "drive.ramp":  # pairs of a time and a pure number
        return ", ".join(
            f"({text_of(time, quantity_kind(key))}, {text_of(factor)})" for time, factor in value
        )
    return text_of(value, quantity_kind(key))


def has_value(case: Mapping[str, Any], condition: str) -> bool | None:
    """Whether a flattened case has a value, ``KEY=VALUE`` as a case file has it, such as ``frequency=80 Hz``.

    The key may be the end of a key. None if there is no such key. `InputError` if the condition cannot be read.
    """
    key, _, text = (part.strip() for part in condition.partition("="))
    if not (key and text):
        raise input_error(
            "where", f'"{condition}": expected KEY=VALUE, such as "drive.frequency=80 Hz"'
        )
    values = {name: value for name, value in case.items() if f".{name}".endswith(f".{key}")}
    return (
        any(_is(name, value, text.strip('"')) for name, value in values.items()) if values else None
    )


def _is(key: str, value: Any, text: str) -> bool:
    """Whether a value is equal to a value as text, in any unit of its kind."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not number or text == str(value):
        return text.lower() in (readable(key, value).lower(), str(value).lower())
    kind = quantity_kind(key)
    try:
        return isclose(
            units.parse_quantity(text, kind) if kind else float(text), value, rel_tol=1e-6
        )
    except ValueError as error:
        raise input_error(
            "where", f'"{key}={text}": {error if kind else "expected a number without a unit"}'
        ) from error


@cache
def quantity_kind(key: str) -> QuantityKind | None:
    """Kind of quantity of a key of a case, such as ``dimers.radii[0]``; None for pure numbers."""
    fields = (
        field for name, field in dotted_keys(CaseFile).items() if _ending(name) == _ending(key)
    )
    return next(
        filter(None, (units.kind_in([*field.metadata, field.annotation]) for field in fields)), None
    )


def _ending(key: str) -> str:
    """The last two parts of a key, without places in lists: ``bead_wall`` is a friction or a roughness."""
    return ".".join(part.partition("[")[0] for part in key.split(".")[-2:])


def differing(cases: Sequence[FlatCase]) -> tuple[list[str], list[str]]:
    """The keys whose values differ among flattened cases, in the cases' order: those that a case gives, and others.

    No case gives the others itself: a time step that ``"auto"`` chose, the properties of a liquid in the library. A
    default, or a value derived from others, that some cases do not have is left out: it is of a table that they lack.
    """
    keys = dict.fromkeys(key for case in cases for key in case)
    varied = [key for key in keys if len({_comparable(case.get(key)) for case in cases}) > 1]
    words = {key: {case.words.get(key, "") for case in cases} for key in varied}
    given = [key for key in varied if any(word.startswith("given") for word in words[key])]
    rest = [key for key in varied if key not in given]
    return given, [
        key for key in rest if "" not in words[key] or words[key] - {"", "default", "derived"}
    ]


def short_keys(keys: Sequence[str], reserved: Iterable[str] = ("name",)) -> list[str]:
    """The last parts of keys; the whole key if another key has the same last part, or if it is ``reserved``."""
    last = [key.rpartition(".")[2] for key in keys]
    taken = set(reserved).difference(keys)
    return [
        key if end in taken or last.count(end) > 1 else end
        for key, end in zip(keys, last, strict=True)
    ]


def _comparable(value: Any) -> Hashable:
    if isinstance(value, (list, tuple)):
        return tuple(_comparable(item) for item in value)
    return float(f"{value:.12g}") if isinstance(value, float) else value
