"""Dotted keys, such as ``drive.harmonics[1].phase``, and values that replace those of a case file.

They come from the command line (``drive.frequency=70Hz``), a mapping in Python, or a sweep's points.
"""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any

from walkers.inputs.errors import InputError, Problem, unusable

Value = Any
"""A TOML value: text with a unit, a number, or a list of such."""
MISSING = object()


@lru_cache(maxsize=4096)
def parts_of(key: str) -> tuple[str | int, ...]:
    """Names of tables and places in lists."""
    return tuple(int(part) if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", key))


def joined(parts: Sequence[str | int]) -> str:
    """A dotted key of its parts."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).removeprefix(".")


def value_at(document: Any, parts: Sequence[str | int]) -> Any:
    """What nested tables and lists have at a place; `MISSING` if there is none."""
    for part in parts:
        try:
            document = document[part]
        except (KeyError, IndexError, TypeError):
            return MISSING
    return document


def flatten(table: Mapping[str, Any], is_leaf: Callable[[Any], bool] = lambda _: False) -> dict[str, Any]:
    """Dotted keys of nested tables: ``{"drive": {"frequency": …}}`` and ``{"drive.frequency": …}`` are the same.

    Raises
    ------
    InputError
        If a key is given both ways.
    """
    flat: dict[str, Any] = {}
    for name, value in table.items():
        below = {name: value}
        if isinstance(value, Mapping) and value and not is_leaf(value):
            below = {f"{name}.{key}": one for key, one in flatten(value, is_leaf).items()}
        if twice := flat.keys() & below.keys():
            raise unusable(twice.pop(), "is given twice; expected one value")
        flat |= below
    return flat


def dotted(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Values of nested tables by dotted keys, entries of lists of tables one by one."""
    if isinstance(value, Mapping):
        for name, one in value.items():
            yield from dotted(one, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        for number, one in enumerate(value):
            yield from dotted(one, f"{key}[{number}]")
    else:
        yield key, value


def settings_of(words: Iterable[str]) -> dict[str, Value]:
    """Values from ``key=value``, the value as a case file has it; quotes about text may be left out.

    Raises
    ------
    InputError
        If there is no ``=``, or a key is given twice.

    Examples
    --------
    >>> settings_of(["drive.frequency=70 Hz", "contact.restitution=0.4", "dimers.radii=[0.3 mm, 0.2 mm]"])
    {'drive.frequency': '70 Hz', 'contact.restitution': 0.4, 'dimers.radii': ['0.3 mm', '0.2 mm']}
    """
    settings: dict[str, Value] = {}
    for word in words:
        key, separator, text = (part.strip() for part in word.partition("="))
        if not (key and separator and text):
            raise InputError("--set", [Problem(word, None, "expected key=value, such as drive.frequency=70Hz")])
        if key in settings:
            raise InputError("--set", [Problem(key, text, "is given twice; expected one value")])
        settings[key] = _value(text)
    return settings


def _value(text: str) -> Value:
    with suppress(ValueError):  # no TOML, or further keys on further lines
        (value,) = tomllib.loads(f"value = {text}").values()
        return value
    if text.startswith("[") and text.endswith("]") and "[" not in text[1:]:
        return [_value(part.strip()) for part in text[1:-1].split(",")]
    return text


def changed(document: Mapping[str, Any], changes: Mapping[str, Value]) -> dict[str, Any]:
    """A case's tables with dotted keys (``dimers.radii[0]`` for one of a list) given other values.

    What a new value stands for in other words (`walkers.inputs.schema.ALTERNATIVES`) goes, unless it changes too.

    Raises
    ------
    InputError
        If there is no such place in a list.
    """
    from walkers.inputs.schema import ALTERNATIVES

    tables = copy.deepcopy(dict(document))
    for key, value in changes.items():
        *table, name = parts_of(key)
        others = [other.rpartition(".")[2] for other in ALTERNATIVES.get(f"{key.split('.')[0]}.{name}", ())]
        _put(tables, key, value, [other for other in others if joined([*table, other]) not in changes])
    return tables


def _put(tables: dict[str, Any], key: str, value: Value, without: Sequence[str]) -> None:
    """Give the place of a dotted key another value; other keys there go."""
    place: Any = tables
    parts = parts_of(key)
    for number, part in enumerate(parts):
        if isinstance(part, int):
            if not isinstance(place, list) or part >= len(place):
                other = f"a place below [{len(place)}]" if isinstance(place, list) else "the whole list"
                message = f"the base case has no {joined(parts[:number])} of that length; expected {other}"
                raise unusable(key, message, value)
        elif isinstance(place, list):
            here = joined(parts[:number])
            raise unusable(key, f"{here} is a list: say which one, such as {here}[0]", value)
        elif not isinstance(place, dict):  # the base case is wrong there, which its own check tells
            return
        if number + 1 < len(parts):
            place = place[part] if isinstance(part, int) else place.setdefault(part, {})
    for other in without:
        place.pop(other, None)
    place[parts[-1]] = value
