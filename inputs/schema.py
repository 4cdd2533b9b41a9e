"""What a case file may say: keys, types, defaults and bounds, as pydantic models.

A quantity is written as a string with its unit and held here as a number in SI units. Keys that the library of
materials and liquids can supply are optional; `walkers.inputs.reading` fills them in.
"""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

from walkers.inputs.units import (
    Acceleration,
    Angle,
    Density,
    DynamicViscosity,
    Frequency,
    KinematicViscosity,
    Length,
    Modulus,
    NonNegativeAngle,
    Radius,
    SignedLength,
    SurfaceTension,
    Time,
)


def _auto(value: object) -> object:
    if isinstance(value, str) and value.strip().lower() == "auto":
        return None
    return value


def _plain_number(value: object) -> object:
    """Accept TOML's integers and floats only: neither "0.3" nor true is a coefficient."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise PydanticCustomError("plain", "{expected}", {"expected": "expected a plain number without a unit"})
    return value


def _whole_number(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int):
        raise PydanticCustomError("whole", "{expected}", {"expected": "expected a whole number"})
    return value


ALTERNATIVES: dict[str, tuple[str, ...]] = {
    "drive.peak_acceleration": ("drive.gamma0",),
    "drive.gamma0": ("drive.peak_acceleration",),
    "liquid.kinematic_viscosity": ("liquid.dynamic_viscosity",),
    "liquid.dynamic_viscosity": ("liquid.kinematic_viscosity",),
    "beads.radii": ("beads.mean_radius", "beads.sin_delta"),
    "beads.mean_radius": ("beads.radii",),
    "beads.sin_delta": ("beads.radii",),
}
"""Keys that say the same in other words: a change of one puts the others out of force."""

AUTO = BeforeValidator(_auto)
"""Reads "auto" as None."""
Number = Annotated[float, BeforeValidator(_plain_number), Field(allow_inf_nan=False)]
Whole = Annotated[int, BeforeValidator(_whole_number)]
Coefficient = Annotated[Number, Field(ge=0, le=1e3)]


class Table(BaseModel):
    """A table of a file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class BeadsTable(Table):
    """``[beads]``: the radii, first the bead that leads (the large one, as in the paper), and what they are made of.

    The radii may also be given by their mean and the asymmetry parameter sin δ = (R1 - R2)/(R1 + R2).
    """

    radii: tuple[Radius, Radius] | None = None
    mean_radius: Radius | None = None
    sin_delta: Annotated[Number, Field(gt=-0.9, lt=0.9)] | None = None
    material: str | None = None
    density: Density | None = None


class LiquidTable(Table):
    """``[liquid]``: a name from the library, or its numbers, or both (the numbers win).

    ``viscosity_ratio`` is the viscosity of the bridges over that of the liquid: how strongly they drag;
    ``film_drag_ratio`` a drag on the beads' translation over that of Stokes in the liquid, 6π η R v. The last four,
    left out, are the library's for the surfaces, else as in `walkers.inputs.resolving`.
    """

    name: str | None = None
    surface_tension: SurfaceTension | None = None
    density: Density | None = None
    kinematic_viscosity: KinematicViscosity | None = None
    dynamic_viscosity: DynamicViscosity | None = None
    volume_fraction: Annotated[Number, Field(ge=1e-9, le=0.5)] | None = None
    viscosity_ratio: Annotated[Number, Field(ge=1e-3, le=1e4)] | None = None
    film_drag_ratio: Annotated[Number, Field(ge=0, le=1e4)] | None = None
    contact_angle: Annotated[NonNegativeAngle, Field(le=1.5708)] | None = None


class PlaneTable(Table):
    """``[boundary]`` of walkers: a plane, level (0°), tilted or a wall (90°).

    ``uphill`` is the direction of the steepest way up, from that of the drive within the plane.
    """

    shape: Literal["plane"] = "plane"
    material: str
    tilt: Annotated[NonNegativeAngle, Field(le=1.5708)] = 0.0
    uphill: Angle = 0.0


class FrictionTable(Table):
    """``[contact.friction]``: Coulomb coefficients; left out, the library's value for the two materials holds."""

    bead_bead: Coefficient | None = None
    bead_wall: Coefficient | None = None


class ContactTable(Table):
    """``[contact]``: the model of the contacts.

    The engine takes no restitution of 0.05 or less and no modulus above 1 GPa; contacts below 5 MPa change speeds.
    ``minimum_separation_ratio``, left out, is the library's for the surfaces, else 0.01.
    """

    friction: FrictionTable = FrictionTable()
    rolling_friction: Coefficient | None = None
    restitution: Annotated[Number, Field(gt=0.05, le=1)] = 0.3
    youngs_modulus: Annotated[Modulus, Field(ge=5e6, le=1e9)] = 5e7
    poissons_ratio: Annotated[Number, Field(ge=0, lt=0.5)] = 0.3
    minimum_separation_ratio: Annotated[Number, Field(ge=1e-6, le=1)] | None = None


def _axis(value: object) -> object:
    """An axis by its name, or a direction by its components."""
    if value in ("x", "y", "z"):
        return value
    if isinstance(value, list) and len(value) == 3 and any(value):
        numbers = tuple(float(one) for one in value if type(one) in (int, float) and isfinite(one))
        if len(numbers) == 3:
            return numbers
    expected = "expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]"
    raise PydanticCustomError("axis", "{expected}", {"expected": expected})


Axis = Annotated[Any, BeforeValidator(_axis)]
"""The name of an axis, or a direction: its components, in any length."""


class HarmonicTable(Table):
    """One of ``[[drive.harmonics]]``; exactly one of ``peak_acceleration`` and ``gamma0``."""

    axis: Axis | None = None
    frequency: Frequency
    peak_acceleration: Acceleration | None = None
    gamma0: Coefficient | None = None
    phase: Angle = 0.0


class DriveTable(Table):
    """``[drive]``: one harmonic by its keys, or several as ``[[drive.harmonics]]``.

    ``axis``, left out, is x on a plane, and the vertical z in a container. ``frame``, left out, is the laboratory's for
    one harmonic without a phase on a plane, else the container's.
    """

    axis: Axis | None = None
    frequency: Frequency | None = None
    peak_acceleration: Acceleration | None = None
    gamma0: Coefficient | None = None
    phase: Angle = 0.0
    frame: Literal["lab", "container"] | None = None
    harmonics: Annotated[list[HarmonicTable], Field(max_length=24)] = []


class StartTable(Table):
    """``[start]``: how many walkers there are and how each begins."""

    replicates: Annotated[Whole, Field(ge=1, le=1000)] = 6
    facing: Literal["both", "right", "left", "up", "down"] = "both"
    angle: Angle = 0.0
    angle_spread: NonNegativeAngle = 0.017453292519943295
    gap: Annotated[SignedLength | None, AUTO] = None
    gap_spread: Annotated[Number, Field(ge=0, lt=1)] = 0.2
    spacing: Annotated[Length | None, AUTO] = None
    seed: Annotated[Whole, Field(ge=0, le=2**63 - 1)] = 1


class RunTable(Table):
    """``[run]``: the time step, the length of the run and what is recorded."""

    time_step: Annotated[Time | None, AUTO] = None
    allow_unstable: bool = False
    cycles: Annotated[Whole, Field(ge=2, le=1_000_000)] = 60
    settling_cycles: Annotated[Whole, Field(ge=0, le=1_000_000)] = 20
    samples_per_cycle: Annotated[Whole, Field(ge=1, le=1000)] = 20
    bridge_samples_per_cycle: Annotated[Whole, Field(ge=1, le=1000)] = 1


class EnvironmentTable(Table):
    """``[environment]``."""

    gravity: Acceleration = 9.81


class WalkerFile(Table):
    """A case file of walkers on a plane."""

    title: str = ""
    beads: BeadsTable
    liquid: LiquidTable
    boundary: PlaneTable
    contact: ContactTable = ContactTable()
    drive: DriveTable
    start: StartTable = StartTable()
    run: RunTable = RunTable()
    environment: EnvironmentTable = EnvironmentTable()
