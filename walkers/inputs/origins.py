"""Where the values of a case are from: the case, the library, calibrations, or other values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from walkers.inputs.units import QuantityKind, as_quantity, quantity_text

SourceKind = Literal[
    "given", "library", "own library", "calibrated", "assumed", "default", "derived"
]
"""Where a value is from.

It is ``given`` by the case (or beside it), from the ``library`` of the program or the user's
``own library``, ``calibrated``, ``assumed`` (fixed in the calibration), the ``default``, or
``derived`` from other values.
"""


class Source(NamedTuple):
    """Where a value is from that a file does not give; `Origin` is made of it.

    Attributes
    ----------
    origin
        The kind of its source.
    why
        What becomes `Origin.source`.
    text
        The value in words; empty for a number, which is written in the unit of its key.
    range
        Ends between which an unmeasured value may lie, SI units.
    logarithmic
        Whether the logarithm of the value is distributed evenly over the range.
    """

    origin: SourceKind
    why: str = ""
    text: str = ""
    range: tuple[Any, Any] | None = None
    logarithmic: bool = False


@dataclass(frozen=True)
class Origin:
    """A value of a case, and where it is from.

    Attributes
    ----------
    key
        The dotted key, such as ``contact.friction.bead_wall``.
    text
        The value as a case file has it, with its unit.
    origin
        The kind of its source.
    source
        The source that the library gives (after the library's file), or the values from which the
        value is derived.
    range
        Ends between which an unmeasured or uncertain value may lie, as in a case.
    logarithmic
        Whether the logarithm of the value is distributed evenly over the range.
    uncertain
        Whether the case lists the value under ``[uncertain]``.
    value
        The value in SI units; text if the case says it in words, such as ``auto``.
    """

    key: str
    text: str
    origin: SourceKind
    source: str = ""
    range: tuple[Any, Any] | None = None
    logarithmic: bool = False
    uncertain: bool = False
    value: Any = field(default=None, compare=False)

    @property
    def guessed(self) -> bool:
        """Whether the value is a default of an unmeasured quantity, or uncertain in the case."""
        return self.uncertain or self.word == "guessed"

    @property
    def word(self) -> str:
        """The origin in words: ``guessed`` for a default that has a range.

        Otherwise, ``uncertain`` is added if the case lists the value as such.
        """
        if self.origin == "default" and self.range is not None:
            return "guessed"
        if self.uncertain:
            return f"{self.origin}, uncertain"
        return self.origin


def accelerations_in_g(texts: Mapping[str, str]) -> bool:
    """Whether a case gives the acceleration of its drive in g, not in m/s².

    ``texts`` are the values of the case as text, by their keys.
    """
    for key, text in texts.items():
        quantity = as_quantity(text)
        if key.endswith("acceleration") and quantity is not None and quantity[1] == "g":
            return True
    return False


def text_of(value: Any, kind: QuantityKind | None = None) -> str:
    """A value of a case as text for people: lists without brackets, words without quotes.

    Parameters
    ----------
    value
        A number, a word, a list (written with commas) or a table (written by its keys).
    kind
        The kind of quantity if numbers are in SI units; None for pure numbers. Numbers within a
        table are written without a unit, because its keys have different kinds of quantities.
    """
    if isinstance(value, (list, tuple)):
        texts = []
        for entry in value:
            text = text_of(entry, kind)
            if isinstance(entry, (list, tuple)):
                text = f"({text})"
            texts.append(text)
        return ", ".join(texts)
    if isinstance(value, bool):
        return "true" if value else "false"
    if kind is not None and isinstance(value, (int, float)):
        return quantity_text(value, kind)
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {text_of(inner)}" for name, inner in value.items())
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(value)
