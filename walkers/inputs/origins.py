"""Where each value of a case comes from: the case itself, the library, a calibration, what is usual, or the others.

What nobody measures (friction, how strongly bridges drag, how much liquid there is) is told apart from what is known,
with the range in which it may lie: a speed that rests on such values is worth no more than they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

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
    key, text
        Dotted, such as ``contact.friction.bead_wall``, and the value as a case file would say it, with its unit.
    origin, source
        ``given`` by the case (or beside it), from the ``library``, ``calibrated``, the ``default``, or ``derived``
        from other values; the library's source, or from what it is derived.
    range, logarithmic
        Both ends between which it may lie as well, as a case would write them, and whether they are of magnitudes: of
        what nobody measures, unless the case gives it, and of what the case calls ``uncertain``.
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


def origins_of(case: Case) -> tuple[Origin, ...]:
    """Where the values of a case come from, in the order of a case file's tables; none of one not read from tables."""
    if not case.document:
        return ()
    from walkers.inputs.matter_tables import resolve_matter
    from walkers.inputs.schema import CaseFile

    file = CaseFile.model_validate(case.document)
    known = resolve_matter(file)[-1] | {one.key: one for one in _derived(case, file)}
    found: dict[str, Origin] = {}
    for key, raw, default in _leaves(file, case.document):
        if key == "run.settled_below" and not case.run.rests:
            continue
        if raw is not None and not (isinstance(raw, str) and raw.strip().lower() == "auto"):
            found[key] = Origin(key, text_of(raw), "given")
        elif key in known:
            found[key] = known[key]
        elif default is not None:
            found[key] = Origin(key, default, "default")
    for key, given in file.uncertain.items():
        ((distribution, (low, high)),) = given.items()
        # What has no line of its own, such as one of two radii, has one if the case calls it uncertain.
        one = found.get(key) or Origin(key, _text_at(case.document, key), "given")
        found[key] = replace(one, range=(low, high), logarithmic=distribution == "loguniform", uncertain=True)
    return tuple(found.values())


def _text_at(document: Mapping[str, Any], key: str) -> str:
    """What a document says at a dotted key, such as ``dimers.radii[1]``; a dash where it says nothing."""
    value: Any = document
    for part in re.findall(r"[^.\[\]]+", key):
        try:
            value = value[int(part)] if isinstance(value, list) else value[part]
        except (KeyError, IndexError, TypeError, ValueError):
            return "-"
    return text_of(value)


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
    kind = kind_in([*field.metadata, field.annotation])
    if name == "gravity":
        return f"{value:g} m/s^2"  # not in g: there are two
    return quantity_text(value, kind) if kind is not None else text_of(value)


def _derived(case: Case, file: CaseFile) -> Iterator[Origin]:
    """What a case's own words leave to follow from others, and defaults that depend on others."""
    from walkers.inputs.units import ACCELERATION, ANGLE, DURATION, FILE_SIZE, LENGTH, TIME, quantity_text

    run, drive, boundary = case.run, case.drive, case.boundary
    derived: dict[str, tuple[str, str]] = {}
    for key, walkers in zip(file.walkers, case.walkers, strict=True):
        derived[f"{key}.spacing"] = (quantity_text(walkers.spacing, LENGTH), "so that walkers do not meet")
        if walkers.gap is None:
            derived[f"{key}.gap"] = ("auto", "where the forces at rest balance")
    if file.dimers is not None and file.dimers.radii is None:
        radii = ", ".join(quantity_text(radius, LENGTH) for radius in case.walkers[0].radii)
        derived["dimers.radii"] = (radii, "from mean_radius and sin_delta")
    if not file.drive.harmonics:
        axis = {(1.0, 0.0, 0.0): "x", (0.0, 1.0, 0.0): "y", (0.0, 0.0, 1.0): "z"}.get(drive.direction)
        yield Origin("drive.axis", axis or text_of(drive.direction), "default", f"of a {boundary.shape}")
        peak = quantity_text(file.drive.peak_acceleration or drive.peak_acceleration, ACCELERATION)
        derived["drive.peak_acceleration"] = (peak, "from gamma0, the dimer and the liquid")
    often = str(run.samples_per_cycle) if run.cycles_per_sample == 1 else f"1 in {run.cycles_per_sample} cycles"
    if case.loose:
        derived["run.samples_per_cycle"] = (often, "from frames_per_second")
        segment = quantity_text(run.cycles_per_segment / drive.frequency, DURATION)
        derived["run.segment"] = (segment, "about 0.5 s")
        rest = quantity_text(run.longest_settling, DURATION)
        yield Origin("run.longest_settling", rest, "default", "of loose beads")
    else:
        yield Origin("run.samples_per_cycle", often, "default")
    step = quantity_text(run.time_step, TIME)
    most = f"until steady, at most {run.cycles}" if run.until_steady else str(run.cycles)
    silence, log = quantity_text(run.longest_silence(case.count), DURATION), quantity_text(run.most_log, FILE_SIZE)
    derived |= {
        "run.time_step": (step, "auto: its share of the limits, fitted into a cycle"),
        "run.cycles": (most, "from the duration" if file.run.duration else "walkers are looked at after 12 and 24"),
        "run.silence": (silence, "an engine that writes nothing for so long is ended"),
        "run.log_limit": (log, "an engine that writes a longer log is ended"),
        "run.settling_cycles": (str(run.settling_cycles), "a third of the cycles, at most 20"),
    }
    yield Origin("drive.frame", drive.frame, "default")
    if boundary.tilt and file.boundary.uphill == 0.0:
        yield Origin("boundary.uphill", quantity_text(0.0, ANGLE), "default", "the direction of the drive")
    yield from (Origin(key, text, "derived", source) for key, (text, source) in derived.items())
