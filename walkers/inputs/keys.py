"""Dotted keys, such as ``drive.harmonics[1].phase``, and values given by them."""

from __future__ import annotations

import json
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
"""What `value_at` returns where there is no value, which may itself be None."""
SPACINGS = ("linspace", "geomspace")
"""Names of the spacings of an axis, those of numpy."""
DISTRIBUTIONS = ("uniform", "loguniform")
"""Names of the distributions of a range."""


@lru_cache(maxsize=4096)
def parts_of(key: str) -> tuple[str | int, ...]:
    """Names of tables and keys, and indices of lists, from 0.

    Examples
    --------
    >>> parts_of("drive.harmonics[1]")
    ('drive', 'harmonics', 1)
    """
    words = re.findall(r"[^.\[\]]+", key)
    return tuple(int(word) if word.isdigit() else word for word in words)


def joined(parts: Sequence[str | int]) -> str:
    """The dotted key from names and indices; the inverse of `parts_of`."""
    key = ""
    for part in parts:
        key += f"[{part}]" if isinstance(part, int) else f".{part}"
    return key.removeprefix(".")


def is_below(key: str, whole_key: str) -> bool:
    """Whether a dotted key is a part of the value of another one.

    Examples
    --------
    >>> is_below("drive.harmonics[1].phase", "drive.harmonics")
    True
    """
    return key.startswith((f"{whole_key}.", f"{whole_key}["))


def value_at(document: Any, parts: Sequence[str | int]) -> Any:
    """The value of nested tables and lists by names and indices; `MISSING` if there is none."""
    value = document
    for part in parts:
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            return MISSING
    return value


def is_axis(value: object) -> bool:
    """Whether a value is an axis or a range, such as ``{"linspace": …}``, not a table of them."""
    if not isinstance(value, Mapping):
        return False
    return not value.keys().isdisjoint((*SPACINGS, *DISTRIBUTIONS))


def flatten(table: Mapping[str, Any]) -> dict[str, Any]:
    """The values of nested tables by dotted keys; axes and empty tables are values.

    Raises
    ------
    InputError
        If a key is given twice, once dotted and once in a table.

    Examples
    --------
    >>> flatten({"drive": {"frequency": "80 Hz"}})
    {'drive.frequency': '80 Hz'}
    """
    flat: dict[str, Any] = {}
    for name, value in table.items():
        below = {name: value}
        if isinstance(value, Mapping) and value and not is_axis(value):
            below = {f"{name}.{key}": inner for key, inner in flatten(value).items()}
        repeated = flat.keys() & below.keys()
        if repeated:
            raise key_error(repeated.pop(), "is given twice; expected one value")
        flat |= below
    return flat


def written(value: Value) -> str:
    """A value as a command line has it, the inverse of what `settings_of` reads.

    Examples
    --------
    >>> written("70 Hz"), written(["0.3 mm", "0.2 mm"]), written({"at_rest": 0.1, "rise": 0.2})
    ('70 Hz', '[0.3 mm, 0.2 mm]', '{ at_rest = 0.1, rise = 0.2 }')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        entries = ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items())
        return f"{{ {entries} }}"
    if isinstance(value, (list, tuple)):
        if any(isinstance(entry, (list, tuple, Mapping)) for entry in value):
            return _toml(value)
        return f"[{', '.join(map(written, value))}]"
    return str(value)


def _toml(value: Value) -> str:
    """A value as TOML has it within a list or a table."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    return written(value)


def settings_of(words: Iterable[str]) -> dict[str, Value]:
    """Values by dotted keys from words of a command line.

    Parameters
    ----------
    words
        Each ``key=value`` with the value as a case file has it; text needs no quotes.

    Raises
    ------
    InputError
        If a word is not of this form, or a key is given twice. The message names the option
        ``--set`` as the source.

    Examples
    --------
    >>> settings_of(["drive.frequency=70 Hz", "dimers.radii=[0.3 mm, 0.2 mm]"])
    {'drive.frequency': '70 Hz', 'dimers.radii': ['0.3 mm', '0.2 mm']}
    >>> settings_of(["contact.restitution=0.4"])
    {'contact.restitution': 0.4}
    """
    settings: dict[str, Value] = {}
    for word in words:
        before, _, after = word.partition("=")
        key = before.strip()
        text = after.strip()
        if not key or not text:
            problem = Problem(word, None, "expected key=value, such as drive.frequency=70Hz")
            raise InputError("--set", [problem])
        if key in settings:
            raise InputError("--set", [Problem(key, text, "is given twice; expected one value")])
        settings[key] = _value(text)
    return settings


def _value(text: str) -> Value:
    """A value from a command line: as TOML if it is, else a list without quotes, else text."""
    tables: dict[str, Any] = {}
    with suppress(ValueError):
        tables = tomllib.loads(f"value = {text}")
    if len(tables) == 1:  # further lines of the text might be further keys
        return tables["value"]
    if text.startswith("[") and text.endswith("]") and "[" not in text[1:]:
        return [_value(part.strip()) for part in text[1:-1].split(",")]
    return text
