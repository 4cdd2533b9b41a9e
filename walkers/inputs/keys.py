"""Dotted keys, such as ``drive.harmonics[1].phase``, and values given by them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any

from walkers.errors import InputError, Problem, key_error

Value = Any
"""A TOML value: text with a unit, a number, or a list of such."""
MISSING = object()
SPACINGS = ("linspace", "geomspace")
DISTRIBUTIONS = ("uniform", "loguniform")


@lru_cache(maxsize=4096)
def parts_of(key: str) -> tuple[str | int, ...]:
    """Names of tables and places in lists."""
    return tuple(int(part) if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", key))


def joined(parts: Sequence[str | int]) -> str:
    """A dotted key of its parts."""
    return "".join(
        f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts
    ).removeprefix(".")


def value_at(document: Any, parts: Sequence[str | int]) -> Any:
    """What nested tables and lists have at a place; `MISSING` if there is none."""
    for part in parts:
        try:
            document = document[part]
        except (KeyError, IndexError, TypeError):
            return MISSING
    return document


def is_axis(value: object) -> bool:
    """Whether a table is an axis rather than a table of axes."""
    return isinstance(value, Mapping) and any(name in value for name in (*SPACINGS, *DISTRIBUTIONS))


def flatten(table: Mapping[str, Any]) -> dict[str, Any]:
    """Dotted keys of nested tables and axes; ``{"drive": {"frequency": …}}`` is ``{"drive.frequency": …}``."""
    flat: dict[str, Any] = {}
    for name, value in table.items():
        below = {name: value}
        if isinstance(value, Mapping) and value and not is_axis(value):
            below = {f"{name}.{key}": leaf for key, leaf in flatten(value).items()}
        if twice := flat.keys() & below.keys():
            raise key_error(twice.pop(), "is given twice; expected one value")
        flat |= below
    return flat


def settings_of(words: Iterable[str]) -> dict[str, Value]:
    """Values from ``key=value``, the value as a case file has it; quotes about text may be left out.

    Examples
    --------
    >>> settings_of(["drive.frequency=70 Hz", "contact.restitution=0.4", "dimers.radii=[0.3 mm, 0.2 mm]"])
    {'drive.frequency': '70 Hz', 'contact.restitution': 0.4, 'dimers.radii': ['0.3 mm', '0.2 mm']}
    """
    settings: dict[str, Value] = {}
    for word in words:
        key, separator, text = (part.strip() for part in word.partition("="))
        if not (key and separator and text):
            raise InputError(
                "--set", [Problem(word, None, "expected key=value, such as drive.frequency=70Hz")]
            )
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
