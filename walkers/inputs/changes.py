"""Values beside a case file: ``drive.frequency=70Hz`` from the command line, a mapping in Python, a sweep's points."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from walkers.inputs.axes import UnusableAxisError, Value
from walkers.inputs.errors import InputError, Problem

_PART = re.compile(r"(?P<name>[^.\[\]]+)(?:\[(?P<index>\d+)\])?")
_INDEX = re.compile(r"\[\d+\]")
_LAST_INDEX = re.compile(r"\[\d+\][^\[]*$")


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
    UnusableAxisError
        If it is one.
    """
    from walkers.inputs.messages import suggested_key
    from walkers.inputs.schema import CaseFile

    if "" in key.split("."):
        raise UnusableAxisError(key, None, "is no key of a case")
    unknown = suggested_key(_INDEX.sub("", key), CaseFile)
    if unknown is not None:
        raise UnusableAxisError(key, None, unknown)


def changed(document: Mapping[str, Any], changes: Mapping[str, Value]) -> dict[str, Any]:
    """A case's tables with dotted keys (``dimers.radii[0]`` for one of a list) given other values.

    Raises
    ------
    UnusableAxisError
        If there is no such place in a list.

    What a new value stands for in other words (`walkers.inputs.schema.ALTERNATIVES`) goes, unless it changes too.
    """
    from walkers.inputs.schema import ALTERNATIVES

    changed_document = copy.deepcopy(dict(document))
    for key in changes:
        for other in ALTERNATIVES.get(key, ()):
            if other not in changes:
                _remove(changed_document, other)
    for key, value in changes.items():
        _put(changed_document, key, value)
    return changed_document


def _remove(document: dict[str, Any], key: str) -> None:
    *tables, name = key.split(".")
    table: Any = document
    for part in tables:
        table = table.get(part) if isinstance(table, dict) else None
    if isinstance(table, dict):
        table.pop(name, None)


def _put(document: dict[str, Any], key: str, value: Value) -> None:
    """Give the place of a dotted key, such as ``drive.harmonics[1].phase``, another value."""
    *tables, last = [(match["name"], match["index"]) for match in _PART.finditer(key)]
    table: Any = document
    for name, index in tables:
        table = table.setdefault(name, {}) if index is None else _entry(table, name, int(index), key, value)
        if isinstance(table, list):
            raise UnusableAxisError(key, value, f"{name} is a list: say which one, such as {name}[0]")
        if not isinstance(table, dict):  # the base case is wrong there, which its own check tells
            return
    name, index = last
    if index is None:
        table[name] = value
    else:
        _entry(table, name, int(index), key, value)
        table[name] = [value if place == int(index) else one for place, one in enumerate(table[name])]


def _entry(table: dict[str, Any], name: str, index: int, key: str, value: Value) -> Any:
    entries = table.get(name)
    if not isinstance(entries, list) or index >= len(entries):
        raise UnusableAxisError(key, value, f"the base case has no {_LAST_INDEX.sub('', key)} of that length")
    return entries[index]
