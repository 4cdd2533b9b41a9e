"""Origin of each value of a case: the case, the library, a calibration, a default, or other values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from walkers.inputs.units import QuantityKind, quantity_text

SourceKind = Literal["given", "library", "own library", "calibrated", "assumed", "default", "derived"]


class Source(NamedTuple):
    """Where a value is from that a file does not give, as in `Origin`."""

    origin: SourceKind
    why: str = ""  # the `Origin.source`
    text: str = ""  # empty: the value is a number, in the unit of its key
    range: tuple[Any, Any] | None = None
    logarithmic: bool = False


@dataclass(frozen=True)
class Origin:
    """Origin of a value of a case.

    It is ``given`` by the case (or beside it), from the ``library`` of the program or the user's ``own library``,
    ``calibrated``, ``assumed`` (fixed in the calibration), the ``default``, or ``derived`` from other values.
    """

    key: str  # dotted, such as ``contact.friction.bead_wall``
    text: str  # the value as a case file would say it, with its unit
    origin: SourceKind
    source: str = ""  # of the library (after its file), or the values from which it is derived
    range: tuple[Any, Any] | None = (
        None  # ends between which an unmeasured or uncertain value may lie, as in a case
    )
    logarithmic: bool = False  # whether the range is of magnitudes
    uncertain: bool = False  # whether the case calls it so
    value: Any = field(
        default=None, compare=False
    )  # SI; as text if the case says it in words, such as ``auto``

    @property
    def guessed(self) -> bool:
        """Whether the value is a default of an unmeasured quantity, or uncertain in the case."""
        return self.uncertain or self.word == "guessed"

    @property
    def word(self) -> str:
        """``guessed`` for a default that has a range; else the origin, and ``uncertain`` if the case calls it so."""
        if self.origin == "default" and self.range is not None:
            return "guessed"
        return f"{self.origin}, uncertain" if self.uncertain else self.origin


def text_of(value: Any, kind: QuantityKind | None = None) -> str:
    """A value of a case file as text: lists with commas, tables by their keys; numbers of a kind are in SI units."""
    if isinstance(value, (list, tuple)):
        texts = ((text_of(entry, kind), isinstance(entry, (list, tuple))) for entry in value)
        return ", ".join(f"({text})" if nested else text for text, nested in texts)
    if isinstance(value, bool):
        return "true" if value else "false"
    if kind is not None and isinstance(value, (int, float)):
        return quantity_text(value, kind)
    if isinstance(value, Mapping):
        return "; ".join(f"{name} {text_of(below)}" for name, below in value.items())
    return f"{value:.6g}" if isinstance(value, float) else str(value)
