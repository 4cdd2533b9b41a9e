"""Values beside a case file: ``drive.frequency=70Hz`` from the command line, a mapping in Python, a sweep's points."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from walkers.inputs.errors import InputError, Problem, UnusableKeyError

Value = Any
"""A TOML value: text with a unit, a number, or a list of such."""

_PART = re.compile(r"(?P<name>[^.\[\]]+)(?:\[(?P<index>\d+)\])?")


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
            raise InputError("--set", [Problem(key, text, "is given twice")])
        settings[key] = _value(text)
    return settings


def _value(text: str) -> Value:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, KeyError):
        pass
    if text.startswith("[") and text.endswith("]") and "[" not in text[1:]:
        return [_value(part.strip()) for part in text[1:-1].split(",")]
    return text


def check_key(key: str) -> None:
    """Refuse a key that no case has.

    Raises
    ------
    UnusableKeyError
        If it is one.
    """
    from walkers.inputs.messages import suggested_key

    if "" in key.split("."):
        raise UnusableKeyError(key, "is no key of a case")
    if unknown := suggested_key(re.sub(r"\[\d+\]", "", key)):
        raise UnusableKeyError(key, unknown)


def changed(document: Mapping[str, Any], changes: Mapping[str, Value]) -> dict[str, Any]:
    """A case's tables with dotted keys (``dimers.radii[0]`` for one of a list) given other values.

    Raises
    ------
    UnusableKeyError
        If there is no such place in a list.

    What a new value stands for in other words (`walkers.inputs.schema.ALTERNATIVES`) goes, unless it changes too.
    """
    from walkers.inputs.schema import ALTERNATIVES

    tables = copy.deepcopy(dict(document))
    for key, value in changes.items():
        place, _, name = key.rpartition(".")
        others = [other.rpartition(".")[2] for other in ALTERNATIVES.get(f"{key.split('.')[0]}.{name}", ())]
        _put(tables, key, value, [other for other in others if f"{place}.{other}" not in changes])
    return tables


def _put(document: dict[str, Any], key: str, value: Value, without: Sequence[str]) -> None:
    """Give the place of a dotted key, such as ``drive.harmonics[1].phase``, another value; other keys there go."""
    *tables, (last, last_index) = [(match["name"], match["index"]) for match in _PART.finditer(key)]
    table: Any = document
    for name, index in tables:
        table = table.setdefault(name, {}) if index is None else _entries(table, name, index, key, value)[int(index)]
        if isinstance(table, list):
            raise UnusableKeyError(key, f"{name} is a list: say which one, such as {name}[0]", value)
        if not isinstance(table, dict):  # the base case is wrong there, which its own check tells
            return
    for other in without:
        table.pop(other, None)
    if last_index is None:
        table[last] = value
    else:
        entries = _entries(table, last, last_index, key, value)
        table[last] = [value if place == int(last_index) else one for place, one in enumerate(entries)]


def _entries(table: dict[str, Any], name: str, index: str, key: str, value: Value) -> list[Any]:
    entries = table.get(name)
    if not isinstance(entries, list) or int(index) >= len(entries):
        listed = re.sub(r"\[\d+\][^\[]*$", "", key)
        raise UnusableKeyError(key, f"the base case has no {listed} of that length", value)
    return entries
