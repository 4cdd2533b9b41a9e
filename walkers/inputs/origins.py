"""Origin of each value of a case: the case, the library, a calibration, a default, or other values.

Unmeasured values (friction, drag of the bridges, volume of liquid) are distinguished from known values,
with the range in which it may lie: a speed that rests on such values is worth no more than they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

from walkers.inputs.changes import MISSING, parts_of, value_at

if TYPE_CHECKING:
    from walkers.inputs.schema import CaseFile
    from walkers.physics.units import Kind

Whence = Literal["given", "library", "own library", "calibrated", "assumed", "default", "derived"]
_LEFT_OUT = ("title", "uncertain", "placed")
"""What is no value, or hundreds of them."""


@dataclass(frozen=True)
class Origin:
    """Origin of a value of a case.

    Attributes
    ----------
    key, text
        Dotted, such as ``contact.friction.bead_wall``, and the value as a case file would say it, with its unit.
    origin, source
        ``given`` by the case (or beside it), from the ``library`` of the program or the user's ``own library``,
        ``calibrated``, ``assumed`` (fixed in the calibration), the ``default``, or ``derived`` from other values; the
        library's source (after its file), or from what it is derived.
    range, logarithmic
        Both ends between which it may lie as well, as a case would write them, and whether they are of magnitudes: of
        what nobody measures, unless the case gives it, and of what the case calls ``uncertain``.
    uncertain
        Whether the case calls it so.
    value
        In SI units.
    """

    key: str
    text: str
    origin: Whence
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
        """``guessed`` for a default that has a range; else the origin, and ``uncertain`` if the case calls it so."""
        if self.origin == "default" and self.range is not None:
            return "guessed"
        return f"{self.origin}, uncertain" if self.uncertain else self.origin


class Notes(dict[str, Origin]):
    """Where values come from that a case leaves out, by their keys, noted as they are filled in.

    Without a text, the value itself is shown in the unit of its key.
    """

    def derived(self, key: str, value: Any, source: str) -> None:
        """Note what follows from other values."""
        self[key] = Origin(key, "", "derived", source, value=value)

    def default(self, key: str, value: Any, source: str = "") -> None:
        """Note a default that depends on other values."""
        self[key] = Origin(key, "", "default", source, value=value)


def origins_of(file: CaseFile, document: Mapping[str, Any], notes: Mapping[str, Origin]) -> tuple[Origin, ...]:
    """Origins of the values of a case, in the order of the tables of a case file.

    Parameters
    ----------
    file, document
        What the case says, validated and as it is written.
    notes
        On what it leaves out and has no default of its own.
    """
    from walkers.physics.units import ABSENT

    found: dict[str, Origin] = {}
    for key, raw, value, kind in _leaves(file, document):
        if raw is not None and not (isinstance(raw, str) and raw.strip().lower() == "auto"):
            found[key] = Origin(key, text_of(raw), "given", value=value)
        elif one := notes.get(key):
            found[key] = replace(one, key=key, text=one.text or text_of(one.value, kind))
        elif value not in ABSENT:
            found[key] = Origin(key, text_of(value, kind), "default", value=value)
    for key, given in file.uncertain.items():
        ((distribution, (low, high)),) = given.items()
        # What has no line of its own, such as one of two radii, has one if the case calls it uncertain.
        raw = value_at(document, parts_of(key))
        one = found.get(key) or Origin(key, "-" if raw is MISSING else text_of(raw), "given")
        found[key] = replace(one, range=(low, high), logarithmic=distribution == "loguniform", uncertain=True)
    return tuple(found.values())


def _leaves(table: Any, document: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any, Any, Kind | None]]:
    """Keys of a table: each with what the document says (None: nothing), its value, and of which kind it is."""
    from walkers.inputs.schema import fields_of
    from walkers.physics.units import kind_in

    for name, (attribute, about) in fields_of(type(table)).items():
        value, raw, key = getattr(table, attribute), value_at(document, parts_of(name)), f"{prefix}{name}"
        raw = None if raw is MISSING else raw
        if key in _LEFT_OUT:
            continue
        if fields_of(type(value)):
            yield from _leaves(value, raw or {}, f"{key}.")
        elif isinstance(value, list) and value and fields_of(type(value[0])):
            for number, (one, said) in enumerate(zip(value, raw or [], strict=True)):
                yield from _leaves(one, said, f"{key}[{number}].")
        else:
            yield key, raw, value, kind_in([*about.metadata, about.annotation])


def text_of(value: Any, kind: Kind | None = None) -> str:
    """A value of a case file as text: lists with commas, tables by their keys; numbers of a kind are in SI units."""
    if isinstance(value, (list, tuple)):
        forms = ["({})" if isinstance(one, (list, tuple)) else "{}" for one in value]
        return ", ".join(forms).format(*(text_of(one, kind) for one in value))
    if kind is not None and not isinstance(value, str):
        from walkers.physics.units import quantity_text

        return quantity_text(value, kind)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "; ".join(f"{key} {text_of(one)}" for key, one in value.items())
    return f"{value:.6g}" if isinstance(value, float) else str(value)
