"""Values of a case as text, by the keys of a case file, and the keys by which cases differ.

Text is in the usual units of a case file, such as ``4 g``. Case files themselves are read in
`walkers.inputs`.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from pydantic_core import to_jsonable_python

from walkers.inputs.config_table import dotted_keys
from walkers.inputs.origins import text_of
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.units import QuantityKind, kind_in

_NANOMETRES_PER_METRE = 1e9
_MICROMETRES_PER_METRE = 1e6
_COMPARED_DIGITS = 12
"""Significant digits in which values of different cases are compared."""
_NOT_GIVEN = {"default", "derived"}
"""Origins of values that no file and no library gives."""


class FlatCase(dict[str, Any]):
    """The values of a case in SI units by dotted key.

    Attributes
    ----------
    origin_words
        For each key, where its value is from: ``given``, ``library``, ``default`` …
        (`walkers.inputs.origins.Origin.word`).
    """

    origin_words: Mapping[str, str] = {}


def flattened(case: Case) -> FlatCase:
    """The values of a case as plain JSON types, by the keys of a case file."""
    flat = FlatCase()
    origin_words = {"placed": "given"}
    for origin in case.origins:
        origin_words[origin.key] = origin.word
        if origin.value is not None:
            flat[origin.key] = to_jsonable_python(origin.value)
    if case.placed:  # placed beads have no origins, because there may be hundreds of them
        flat["placed"] = [[*bead.at, bead.radius] for bead in case.placed]
    flat.origin_words = origin_words
    return flat


def readable(key: str, value: Any) -> str:
    """A value of `flattened` as it stands in a case file, such as ``4 g``; a dash for None."""
    if value is None:
        return "-"
    if key == "environment.gravity":  # the unit g is the paper's 9.8 m/s², not gravity
        return f"{value:.6g} m/s^2"
    if key.startswith("contact.roughness."):
        return f"{value * _NANOMETRES_PER_METRE:.6g} nm"
    if key == "liquid.meniscus_radius":
        return f"{value * _MICROMETRES_PER_METRE:.6g} um"
    kind = quantity_kind(key)
    if key == "drive.ramp":  # pairs of a time and a factor, which has no unit
        pairs = [f"({text_of(time, kind)}, {text_of(factor)})" for time, factor in value]
        return ", ".join(pairs)
    return text_of(value, kind)


def value_text(case: Mapping[str, Any], key: str) -> str:
    """The value of a key of a flattened case as text, a dash if it has none.

    A friction that grows with the velocity v is ``0.05 + 3.5 v/(v + 1000 mm/s)``.
    """
    rise = case.get(f"{key}.rise")
    if rise is None:
        return readable(key, case.get(key))
    at_rest = readable(f"{key}.at_rest", case[f"{key}.at_rest"])
    velocity_key = f"{key}.half_rise_velocity"
    velocity = readable(velocity_key, case[velocity_key])
    return f"{at_rest} + {text_of(rise)} v/(v + {velocity})"


def without_parts(keys: Sequence[str]) -> list[str]:
    """Keys without those whose values `value_text` writes in the value of another one of them."""
    return [key for key in keys if key.rpartition(".")[0] not in keys]


@cache
def quantity_kind(key: str) -> QuantityKind | None:
    """The kind of quantity of a key, such as ``dimers.radii[0]``; None for pure numbers."""
    for name, field in dotted_keys(CaseFile).items():
        if _last_two_parts(name) == _last_two_parts(key):
            kind = kind_in([*field.metadata, field.annotation])
            if kind is not None:
                return kind
    return None


def _last_two_parts(key: str) -> str:
    """The last two parts of a key without indices of lists.

    One part is not enough: ``bead_wall`` is a friction or a roughness.
    """
    names = [part.partition("[")[0] for part in key.split(".")]
    return ".".join(names[-2:])


def differing(cases: Sequence[FlatCase]) -> tuple[list[str], list[str]]:
    """The keys whose values differ among cases, in the order of the cases' keys.

    A default or a derived value that some cases lack is left out: it belongs to a table that they
    do not have.

    Returns
    -------
    given : list of str
        Keys that a case gives itself.
    implied : list of str
        Keys that no case gives, such as a time step that ``"auto"`` chose, or the properties of a
        liquid of the library.
    """
    keys: dict[str, None] = {}  # as a set, but in the order of the cases
    for case in cases:
        keys |= dict.fromkeys(case)
    given = []
    implied = []
    for key in keys:
        if len({_comparable(case.get(key)) for case in cases}) == 1:
            continue
        words = {case.origin_words.get(key, "") for case in cases}
        if any(word.startswith("given") for word in words):
            given.append(key)
        elif not _follows_from_a_missing_table(words):
            implied.append(key)
    return given, implied


def _follows_from_a_missing_table(origin_words: set[str]) -> bool:
    """Whether a key has no value in some cases, and a value that nobody gave in the others."""
    return "" in origin_words and origin_words <= {"", *_NOT_GIVEN}


def short_keys(keys: Sequence[str], reserved: Iterable[str] = ("name",)) -> list[str]:
    """The last parts of keys, as headings of columns.

    A key stays whole if another key has the same last part, or if its last part is one of the
    ``reserved`` headings.
    """
    last_parts = [key.rpartition(".")[2] for key in keys]
    taken = set(reserved).difference(keys)
    short = []
    for key, last_part in zip(keys, last_parts, strict=True):
        if last_part in taken or last_parts.count(last_part) > 1:
            short.append(key)
        else:
            short.append(last_part)
    return short


def _comparable(value: Any) -> Hashable:
    """A value that can be compared: lists as tuples, numbers without their last digits."""
    if isinstance(value, (list, tuple)):
        return tuple(_comparable(item) for item in value)
    if isinstance(value, float):
        return float(f"{value:.{_COMPARED_DIGITS}g}")
    hashable: Hashable = value
    return hashable
