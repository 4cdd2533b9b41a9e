"""What a case file may say: keys, types, defaults and bounds, as pydantic models.

A quantity is written as a string with its unit and held here as a number in SI units. What the library of materials
and liquids supplies (`walkers.inputs.resolving.SUPPLIED`) has been filled in before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite, radians
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from walkers.inputs import units
from walkers.inputs.axes import ends_of, is_axis
from walkers.inputs.changes import flatten
from walkers.inputs.errors import InputError
from walkers.inputs.units import Angle, Duration, Length, NonNegativeAngle, Radius, SignedLength
from walkers.physics.matter import DEFAULT_LAW


def _auto(value: object) -> object:
    return None if isinstance(value, str) and value.strip().lower() == "auto" else value


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
        ends_of(ranges)
    except InputError as error:
        (problem,) = error.problems
        told = problem.expected.replace("{ uniform = [low, high] }", "[low, high]")
        raise ValueError(f"{problem.key}: {told}") from error
    return ranges


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
"""Keys that say the same in other words: a change of one puts the others out of force."""

MOST_BEADS = 20_000
AUTO = BeforeValidator(_auto)
"""Reads "auto" as None."""
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""TOML's integers and floats only: neither "0.3" nor true is a coefficient."""
Whole = Annotated[int, Field(strict=True)]
UpToRightAngle = Annotated[float, replace(units.ANGLE, largest=1.5708, sign=units.NOT_NEGATIVE)]
Coefficient = Annotated[Number, Field(ge=0, le=1e3)]
Axis = Annotated[Any, BeforeValidator(_axis)]
"""The name of an axis, or a direction: its components, in any length."""
Ranges = Annotated[dict[str, Any], BeforeValidator(_ranges)]
"""As a sweep's samplers take them: for each key ``{"uniform": [low, high]}`` or ``{"loguniform": [low, high]}``."""


class Table(BaseModel):
    """A table of a file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class BeadsTable(Table):
    """``[beads]``: what all beads are made of."""

    material: str | None = None
    density: units.Density


class WalkersTable(Table):
    """What ``[dimers]`` and ``[[clusters]]`` have in common: how many walkers there are and how each begins.

    ``meet = true`` says that they may stand and come as near as they like; without it they are replicates.
    """

    replicates: Annotated[Whole, Field(ge=1, le=1000)] = 6
    facing: Literal["both", "right", "left", "up", "down"] = "both"
    angle: Angle = 0.0
    angle_spread: NonNegativeAngle = radians(1.0)
    gap: Annotated[SignedLength | None, AUTO] = None
    gap_spread: Annotated[Number, Field(ge=0, lt=1)] = 0.2
    spacing: Annotated[Length | None, AUTO] = None
    meet: bool = False


class DimersTable(WalkersTable):
    """``[dimers]``: the radii, first the bead that leads (the large one, as in the paper).

    The radii may also be given by their mean and the asymmetry parameter sin δ = (R1 - R2)/(R1 + R2).
    """

    radii: tuple[Radius, Radius] | None = None
    mean_radius: Radius | None = None
    sin_delta: Annotated[Number, Field(gt=-0.9, lt=0.9)] | None = None


class ClusterTable(WalkersTable):
    """One of ``[[clusters]]``: walkers of several beads, in an arrangement, or at places beside each other.

    ``at`` has a place for each bead, ahead and to the left, in the direction that the walker faces.
    """

    radii: Annotated[list[Radius], Field(min_length=2, max_length=100)]
    arrangement: str | None = None
    at: Annotated[list[tuple[SignedLength, SignedLength]], Field(max_length=100)] | None = None


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


class LiquidTable(Table):
    """``[liquid]``: a name from the library, or its numbers, or both (the numbers win).

    ``viscosity_ratio`` is the viscosity of the bridges over that of the liquid: how strongly they drag. ``law`` is that
    of the bridges, one of `walkers.physics.laws` or a function of yours, ``file.py:function``.
    """

    name: str | None = None
    surface_tension: units.SurfaceTension
    density: units.Density | None = None
    kinematic_viscosity: units.KinematicViscosity | None = None
    dynamic_viscosity: units.DynamicViscosity | None = None
    volume_fraction: Annotated[Number, Field(ge=1e-9, le=0.5)]
    viscosity_ratio: Annotated[Number, Field(ge=0, le=1e4)]
    contact_angle: UpToRightAngle
    law: str = DEFAULT_LAW


class BoundaryTable(Table):
    """``[boundary]``: what the beads stand on and lie in.

    A plane, a channel (two walls and a floor, of a ``width``), a groove (two walls at an
    angle, its ``opening``), or a container open above (of a ``width`` and a
    ``height``). It leans by ``tilt``: 0° is level, a plane at 90° a wall. ``uphill`` is the direction of the steepest
    way up, from that of the drive within the floor.
    """

    shape: Literal["plane", "channel", "groove", "box", "cylinder", "octagon"] = "plane"
    material: str
    opening: Annotated[float, replace(units.ANGLE, smallest=0.5, largest=3.1, sign=units.POSITIVE)] | None = None
    width: Length | None = None
    height: Length | None = None
    tilt: UpToRightAngle = 0.0
    uphill: Angle = 0.0


class FrictionTable(Table):
    """``[contact.friction]``: Coulomb coefficients."""

    bead_bead: Coefficient
    bead_wall: Coefficient


class ContactTable(Table):
    """``[contact]``: the model of the contacts.

    The engine takes no restitution of 0.05 or less and no modulus above 1 GPa; contacts below 5 MPa change speeds.
    """

    friction: FrictionTable
    rolling_friction: Coefficient
    restitution: Annotated[Number, Field(gt=0.05, le=1)]
    youngs_modulus: Annotated[float, replace(units.MODULUS, smallest=5e6, largest=1e9)] = 5e7
    poissons_ratio: Annotated[Number, Field(ge=0, lt=0.5)] = 0.3
    minimum_separation_ratio: Annotated[Number, Field(ge=1e-6, le=1)]


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
    ``frames_per_second``. Left out, or ``cycles = "auto"``, walkers run until they are steady, for 60 cycles
    (``most_cycles``) of 20 samples at most, a third of them, at most 20, to settle; loose beads have a duration, are
    recorded 60 times a second, and rest before the drive (``settled_below``, ``longest_settling``). An engine that says
    nothing for ``silence``, or more than ``log_limit``, is ended: no numbers depend on these two.
    """

    time_step: Annotated[units.Time | None, AUTO] = None
    allow_unstable: bool = False
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
    silence: Annotated[Duration | None, AUTO] = None
    log_limit: Annotated[units.FileSize | None, AUTO] = None


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
    dimers: DimersTable | None = None
    clusters: Annotated[list[ClusterTable], Field(max_length=100)] = []
    mixture: MixtureTable | None = None
    placed: Annotated[list[PlacedTable], Field(max_length=MOST_BEADS)] = []
    boundary: BoundaryTable
    drive: DriveTable
    liquid: LiquidTable
    contact: ContactTable
    run: RunTable = RunTable()
    environment: EnvironmentTable = EnvironmentTable()
    uncertain: Ranges = {}

    @property
    def walkers(self) -> dict[str, DimersTable | ClusterTable]:
        """The tables of walkers by their keys, dimers first."""
        dimers = {} if self.dimers is None else {"dimers": self.dimers}
        return {**dimers, **{f"clusters[{number}]": table for number, table in enumerate(self.clusters)}}
