"""Where each value of a case comes from: the case itself, the library, a calibration, what is usual, or the others.

What nobody measures (friction, how strongly bridges drag, how much liquid there is) is told apart from what is known,
with the range in which it may lie: a speed that rests on such values is worth no more than they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from walkers.inputs.library import Known, unmeasured

if TYPE_CHECKING:
    from pydantic import BaseModel

    from walkers.inputs.case import Case
    from walkers.inputs.schema import CaseFile

Whence = Literal["given", "library", "calibrated", "default", "derived"]


@dataclass(frozen=True)
class Origin:
    """Where a value of a case comes from.

    Attributes
    ----------
    key
        Dotted, such as ``contact.friction.bead_wall``.
    text
        The value as a case file would say it, with its unit.
    origin
        ``given`` by the case (or beside it), from the ``library``, ``calibrated``, the ``default``, or ``derived``
        from other values.
    source
        The library's, or from what it is derived.
    range
        Both ends between which it may lie as well, as a case would write them: of what nobody measures, unless the
        case gives it, and of what the case calls ``uncertain``.
    logarithmic
        Whether the range is one of magnitudes.
    uncertain
        Whether the case calls it so.
    """

    key: str
    text: str
    origin: Whence
    source: str = ""
    range: tuple[Any, Any] | None = None
    logarithmic: bool = False
    uncertain: bool = False

    @property
    def guessed(self) -> bool:
        """Whether it is a default of what nobody measures, or the case calls it uncertain."""
        return self.uncertain or (self.range is not None and self.origin == "default")


class Choices:
    """Chooses, of what may say a value, who says it first; and keeps from where it came.

    What was calibrated with other liquids is a guess for this one.

    Parameters
    ----------
    liquid
        Name of the case's.

    Attributes
    ----------
    origins
        Of all that the case does not say itself, by its key.
    """

    def __init__(self, liquid: str | None) -> None:
        self.origins: dict[str, Origin] = {}
        self._liquid = liquid

    def choose(self, key: str, given: float | None, known: Known | None) -> float | None:
        """The value of a key as given, else as the library knows it, else as is usual; None if nobody says it."""
        if given is not None:
            return given
        if known is not None:
            self.origins[key] = self._known(key, known)
            return known.value
        loose = unmeasured().get(key)
        if loose is None or loose.usual is None:
            return None
        self.origins[key] = Origin(key, loose.usual.text, "default", "", loose.range, loose.logarithmic)
        return loose.usual.value

    def _known(self, key: str, known: Known) -> Origin:
        loose = unmeasured().get(key)
        if loose is None or not known.calibrated_with:
            return Origin(key, known.text, "library", known.source)
        if self._liquid in known.calibrated_with:
            return Origin(key, known.text, "calibrated", known.source, known.range, loose.logarithmic)
        return Origin(key, known.text, "default", known.source, loose.range, loose.logarithmic)

    def derive(self, key: str, text: str, source: str) -> None:
        """Keep from what a value follows."""
        self.origins[key] = Origin(key, text, "derived", source)


def origins_of(case: Case) -> tuple[Origin, ...]:
    """Where the values of a case come from, in the order of a case file's tables.

    Returns
    -------
    tuple of Origin
        Empty for a case that was not read from tables.
    """
    if not case.document:
        return ()
    from walkers.inputs.matter_tables import resolve_matter
    from walkers.inputs.schema import CaseFile

    file = CaseFile.model_validate(case.document)
    known = resolve_matter(file)[-1].origins | {one.key: one for one in _derived(case, file)}
    found = [
        _origin(key, raw, default, known)
        for key, raw, default in _leaves(file, case.document)
        if case.run.rests or key != "run.settled_below"
    ]
    listed = {one.key: one for one in found if one is not None}
    # What has no line of its own, such as one of two radii, has one if the case calls it uncertain.
    alone = {key: Origin(key, _text_at(case.document, key), "given") for key in file.uncertain if key not in listed}
    return tuple(_uncertain(one, file.uncertain) for one in (listed | alone).values())


def _text_at(document: Mapping[str, Any], key: str) -> str:
    """What a document says at a dotted key, such as ``dimers.radii[1]``; a dash where it says nothing."""
    value: Any = document
    for part in re.findall(r"[^.\[\]]+", key):
        try:
            value = value[int(part)] if isinstance(value, list) else value[part]
        except (KeyError, IndexError, TypeError, ValueError):
            return "-"
    return text_of(value)


def _origin(key: str, raw: Any, default: str | None, known: Mapping[str, Origin]) -> Origin | None:
    """That of a key; None of one that says nothing in this case."""
    automatic = isinstance(raw, str) and raw.strip().lower() == "auto"
    if raw is not None and not automatic:
        return Origin(key, text_of(raw), "given")
    if key in known:
        return known[key]
    return Origin(key, default, "default") if default is not None else None


def _uncertain(one: Origin, ranges: Mapping[str, Any]) -> Origin:
    """With the range that the case says its value may have."""
    if one.key not in ranges:
        return one
    ((distribution, (low, high)),) = ranges[one.key].items()
    return replace(one, range=(low, high), logarithmic=distribution == "loguniform", uncertain=True)


def text_of(value: Any) -> str:
    """A value of a case file as text: lists with commas, tables by their keys."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return ", ".join(f"({text_of(one)})" if isinstance(one, (list, tuple)) else text_of(one) for one in value)
    if isinstance(value, Mapping):
        return "; ".join(f"{key} {text_of(one)}" for key, one in value.items())
    return f"{value:.6g}" if isinstance(value, float) else str(value)


_LEFT_OUT = ("title", "uncertain", "placed")
"""What is no value, or hundreds of them."""


def _leaves(table: BaseModel, document: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any, str | None]]:
    """Keys of a validated table, each with what the document says (None: nothing) and its default as text."""
    from pydantic import BaseModel

    for name in type(table).model_fields:
        value, raw = getattr(table, name), document.get(name)
        key = f"{prefix}.{name}" if prefix else name
        if name in _LEFT_OUT and not prefix:
            continue
        if isinstance(value, BaseModel):
            yield from _leaves(value, raw or {}, key)
        elif isinstance(value, list) and value and isinstance(value[0], BaseModel):
            for number, (one, said) in enumerate(zip(value, raw or [], strict=True)):
                yield from _leaves(one, said, f"{key}[{number}]")
        elif not isinstance(value, list) or raw is not None:
            yield key, raw, _default_text(table, name) if raw is None else None


def _default_text(table: BaseModel, name: str) -> str | None:
    from walkers.inputs.units import kind_in, quantity_text

    field, value = type(table).model_fields[name], getattr(table, name)
    if value is None or value == "":
        return None
    kind = next((one for one in map(kind_in, [*field.metadata, field.annotation]) if one), None)
    if name == "gravity":
        return f"{value:g} m/s^2"  # not in g: there are two
    return quantity_text(value, kind) if kind is not None else text_of(value)


def _derived(case: Case, file: CaseFile) -> Iterator[Origin]:
    """What a case's own words leave to follow from others."""
    from walkers.inputs.units import ACCELERATION, ANGLE, DURATION, FILE_SIZE, LENGTH, TIME, quantity_text

    def derived(key: str, text: str, source: str) -> Origin:
        return Origin(key, text, "derived", source)

    run, drive = case.run, case.drive
    keys = ["dimers"] * (file.dimers is not None) + [f"clusters[{number}]" for number in range(len(file.clusters))]
    for key, walkers in zip(keys, case.walkers, strict=True):
        yield derived(f"{key}.spacing", quantity_text(walkers.spacing, LENGTH), "so that walkers do not meet")
        if walkers.gap is None:
            yield derived(f"{key}.gap", "auto", "where the forces at rest balance")
    if file.dimers is not None and file.dimers.radii is None:
        radii = ", ".join(quantity_text(radius, LENGTH) for radius in case.walkers[0].radii)
        yield derived("dimers.radii", radii, "from mean_radius and sin_delta")
    if not file.drive.harmonics:
        axis = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}.get(drive.direction)
        yield Origin("drive.axis", axis or text_of(drive.direction), "default", f"of a {case.boundary.shape}")
        peak = quantity_text(file.drive.peak_acceleration or drive.peak_acceleration, ACCELERATION)
        yield derived("drive.peak_acceleration", peak, "from gamma0, the dimer and the liquid")
    yield Origin("drive.frame", drive.frame, "default")
    yield derived(
        "run.time_step", quantity_text(run.time_step, TIME), "auto: its share of the limits, fitted into a cycle"
    )
    most = f"until steady, at most {run.cycles}" if run.until_steady else str(run.cycles)
    yield derived(
        "run.cycles", most, "from the duration" if file.run.duration else "walkers are looked at after 12 and 24"
    )
    silence = quantity_text(run.longest_silence(case.count), DURATION)
    yield derived("run.silence", silence, "an engine that writes nothing for so long is ended")
    yield derived(
        "run.log_limit", quantity_text(run.most_log, FILE_SIZE), "an engine that writes a longer log is ended"
    )
    yield derived("run.settling_cycles", str(run.settling_cycles), "a third of the cycles, at most 20")
    often = str(run.samples_per_cycle) if run.cycles_per_sample == 1 else f"1 in {run.cycles_per_sample} cycles"
    yield Origin(
        "run.samples_per_cycle",
        often,
        "derived" if case.loose else "default",
        "from frames_per_second" if case.loose else "",
    )
    if case.loose:
        yield derived("run.segment", quantity_text(run.cycles_per_segment / drive.frequency, DURATION), "about 0.5 s")
        yield Origin("run.longest_settling", quantity_text(run.longest_settling, DURATION), "default", "of loose beads")
    if case.boundary.tilt and file.boundary.uphill == 0.0:
        yield Origin("boundary.uphill", quantity_text(0.0, ANGLE), "default", "the direction of the drive")
