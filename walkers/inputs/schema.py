"""Schema of a case file: keys, types, defaults and bounds, as pydantic models and classes of the case.

A quantity is written as a string with its unit and held here as a number in SI units. What the library of materials
and liquids supplies (`walkers.inputs.resolving.SUPPLIED`) has been filled in before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from math import isfinite
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from walkers.inputs.axes import is_axis, ranges_of
from walkers.inputs.bodies import Walkers
from walkers.inputs.boundary import Boundary
from walkers.inputs.changes import flatten
from walkers.inputs.errors import InputError, unusable
from walkers.physics import units
from walkers.physics.matter import Contact, Liquid
from walkers.physics.units import AUTO, Angle, Coefficient, Duration, Length, Number, Radius, SignedLength, Whole


def _axis(value: object) -> object:
    """An axis by its name, or a direction by its components."""
    if value in ("x", "y", "z"):
        return value
    if isinstance(value, list) and len(value) == 3 and any(value):
        numbers = tuple(float(one) for one in value if type(one) in (int, float) and isfinite(one))
        if len(numbers) == 3:
            return numbers
    raise ValueError("expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]")


def _ranges(value: object) -> object:
    """Ranges by dotted keys: each two values of one unit, the smaller first."""
    if not isinstance(value, dict):
        return value
    try:
        ranges = {key: one if is_axis(one) else {"uniform": one} for key, one in flatten(value, is_axis).items()}
        found = ranges_of(ranges)
    except InputError as error:
        (problem,) = error.problems
        message = problem.expected.replace("{ uniform = [low, high] }", "[low, high]")
        raise ValueError(f"{problem.key}: {message}") from error
    for key, one in found.items():
        if one.median is not None:
            raise ValueError(f"{key}: expected [low, high]: the case's own value is the median")
    return ranges


def _friction(contact: object) -> object:
    """Its table of friction written as dotted keys."""
    if not isinstance(contact, dict):
        return contact
    friction = contact.get("friction", {})
    if not isinstance(friction, dict):
        raise unusable("contact.friction", "expected a table [contact.friction]")
    others = {key: value for key, value in contact.items() if key != "friction"}
    return others | {f"friction.{pair}": coefficient for pair, coefficient in friction.items()}


_SAME: Sequence[Sequence[tuple[str, ...]]] = (
    (("drive.peak_acceleration",), ("drive.gamma0",)),
    (("liquid.kinematic_viscosity",), ("liquid.dynamic_viscosity",)),
    (("dimers.radii",), ("dimers.mean_radius", "dimers.sin_delta")),
    (("run.cycles",), ("run.duration",), ("run.most_cycles",)),
    (("run.samples_per_cycle",), ("run.frames_per_second",)),
    (("mixture.count",), ("mixture.fill_height",)),
)
ALTERNATIVES: Mapping[str, tuple[str, ...]] = {
    key: tuple(other for others in ways if others is not way for other in others)
    for ways in _SAME
    for way in ways
    for key in way
}
"""Keys that replace each other, by first and last part: no table within a table may give such a name others."""

MOST_BEADS = 20_000
Axis = Annotated[Any, BeforeValidator(_axis)]
"""The name of an axis, or a direction: its components, in any length."""
Ranges = Annotated[dict[str, Any], BeforeValidator(_ranges)]
"""As a sweep's samplers take them: for each key ``{"uniform": [low, high]}`` or ``{"loguniform": [low, high]}``."""


class Table(BaseModel):
    """A table of a file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def fields_of(table: type) -> dict[str, tuple[str, FieldInfo]]:
    """What a table takes, by its keys, and the attribute that holds it: nothing of what is no table.

    A table is a model of pydantic's, or a dataclass if a resolved case has it as well.
    """
    found = dict(table.model_fields) if issubclass(table, BaseModel) else {}
    if is_dataclass(table):
        hints = get_type_hints(table, include_extras=True)
        for one in fields(table):
            default = PydanticUndefined if one.default is MISSING else one.default
            found[one.name] = FieldInfo.from_annotated_attribute(hints[one.name], default)
    return {field.alias or name: (name, field) for name, field in found.items()}


class BeadsTable(Table):
    """``[beads]``: what all beads are made of."""

    material: str | None = None
    density: units.Density


class MixtureTable(Table):
    """``[mixture]``: beads that are poured: two classes, each a range of radii filled with ``sizes`` constant radii."""

    small: tuple[Radius, Radius]
    large: tuple[Radius, Radius]
    small_share: Annotated[Number, Field(ge=0, le=1)] = 0.5
    mixed_by: Literal["mass", "volume", "number"] = "mass"
    sizes: Annotated[Whole, Field(ge=1, le=20)] = 4
    count: Annotated[Whole, Field(ge=1, le=MOST_BEADS)] | None = None
    fill_height: Length | None = None


class PlacedTable(Table):
    """One of ``[[placed]]``: a bead and where it begins, from the middle of the floor."""

    radius: Radius
    at: tuple[SignedLength, SignedLength, SignedLength]


class HarmonicTable(Table):
    """One of ``[[drive.harmonics]]``; exactly one of ``peak_acceleration`` and ``gamma0``."""

    axis: Axis | None = None
    frequency: units.Frequency
    peak_acceleration: units.Acceleration | None = None
    gamma0: Coefficient | None = None
    phase: Angle = 0.0


class DriveTable(HarmonicTable):
    """``[drive]``: one harmonic by its keys, or several as ``[[drive.harmonics]]``.

    The ``waveform`` is that of the acceleration. ``axis``, left out, is x on a plane, the vertical z in containers.
    In the ``frame`` of the container, as is usual, the beads feel the inertial force; in that of the laboratory the
    walls move, which they can for one harmonic without a phase.
    """

    frequency: units.Frequency | None = None  # type: ignore[assignment]
    waveform: Literal["sine", "triangle", "sawtooth"] = "sine"
    frame: Literal["lab", "container"] | None = None
    harmonics: Annotated[list[HarmonicTable], Field(max_length=24)] = []


class RunTable(Table):
    """``[run]``: the time step, the length of the run and what is recorded.

    The length is given by ``cycles`` or as a ``duration``, the sampling by ``samples_per_cycle`` or
    ``frames_per_second``. Left out, or ``cycles = "auto"``, walkers run until their velocities are constant, for 60
    cycles (``most_cycles``) of 20 samples at most, a third of them, at most 20, to settle; loose beads have a duration,
    are recorded 60 times a second, and rest before the drive (``settled_below``, ``longest_settling``).
    """

    time_step: Annotated[units.Time | None, AUTO] = None
    allow_unstable: units.Flag = False
    cycles: Annotated[Annotated[Whole, Field(ge=2, le=1_000_000)] | None, AUTO] = None
    most_cycles: Annotated[Whole, Field(ge=2, le=1_000_000)] | None = None
    duration: Duration | None = None
    settling_cycles: Annotated[Whole, Field(ge=0, le=1_000_000)] | None = None
    samples_per_cycle: Annotated[Whole, Field(ge=1, le=1000)] | None = None
    bridge_samples_per_cycle: Annotated[Whole, Field(ge=1, le=1000)] | None = None
    frames_per_second: Annotated[Number, Field(gt=0, le=1e6)] | None = None
    segment: Duration | None = None
    settled_below: units.Speed | None = None
    longest_settling: units.NonNegativeDuration | None = None
    ranks: Annotated[Whole, Field(ge=1, le=64)] = 1
    seed: Annotated[Whole, Field(ge=0, le=2**63 - 1)] = 1


class EnvironmentTable(Table):
    """``[environment]``."""

    gravity: units.Acceleration = 9.81


class CaseFile(Table):
    """A case file: bodies on a boundary under a drive, with a liquid and contacts.

    ``uncertain`` has, for keys whose values are guesses, the range in which the truth may lie: ``[low, high]``, or
    ``{ loguniform = [low, high] }`` for one of magnitudes.
    """

    title: str = ""
    beads: BeadsTable
    dimers: Walkers | None = None
    clusters: Annotated[list[Walkers], Field(max_length=100)] = []
    mixture: MixtureTable | None = None
    placed: Annotated[list[PlacedTable], Field(max_length=MOST_BEADS)] = []
    boundary: Boundary
    drive: DriveTable
    liquid: Liquid
    contact: Annotated[Contact, BeforeValidator(_friction)]
    run: RunTable = RunTable()
    environment: EnvironmentTable = EnvironmentTable()
    uncertain: Ranges = {}

    @property
    def walkers(self) -> dict[str, Walkers]:
        """The tables of walkers by their keys, dimers first."""
        dimers = {} if self.dimers is None else {"dimers": self.dimers}
        return {**dimers, **{f"clusters[{number}]": table for number, table in enumerate(self.clusters)}}
