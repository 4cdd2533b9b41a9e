"""The tables of a library file, which check what its user has written.

Their models take time to build: only what reads such files imports this module.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Annotated, Any, Generic, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from walkers.inputs import units
from walkers.inputs.config_table import ConfigTable
from walkers.inputs.tables.materials import SLIDING_VELOCITY, FrictionLaw
from walkers.inputs.units import Coefficient, Number

Q = TypeVar("Q")


def _printable(text: str) -> str:
    """The text; raises `ValueError` if it is empty, or cannot be printed on one line."""
    if not text or not text.isprintable():
        raise ValueError("expected printable text on one line")
    return text


Text = Annotated[str, AfterValidator(_printable)]
"""A name or a source, which commands and reports print as it is."""


class Sourced(ConfigTable, Generic[Q]):
    """A number of a library: ``{ value = …, source = "…" }``.

    ``range`` has the lower and the upper end between which an uncertain number can lie.
    """

    value: Q
    source: Text = Field(examples=["weighed"])
    range: tuple[Q, Q] | None = None

    @field_validator("range")
    @classmethod
    def _contains_the_value(
        cls, ends: tuple[Any, Any] | None, validation: ValidationInfo
    ) -> tuple[Any, Any] | None:
        """The ends; raises `ValueError` unless they are in order, with the value between them."""
        if ends is None:
            return None
        low, high = ends
        if not low < high:
            raise ValueError("expected the lower end first: [low, high]")
        value = validation.data.get("value")  # missing if it is wrong itself
        if value is not None and not low <= value <= high:
            raise ValueError("expected two ends with the value between them")
        return ends


class MaterialTable(ConfigTable):
    """``[materials."NAME"]``.

    Its modulus is that of the material; that of contacts is ``contact.youngs_modulus`` of the case.
    """

    density: Sourced[units.Density]
    youngs_modulus: Sourced[Annotated[float, units.MODULUS]] | None = None
    poissons_ratio: Sourced[Annotated[Number, Field(ge=-1, le=0.5)]] | None = None
    roughness: Sourced[units.Length] | None = None


class LibraryLiquidTable(ConfigTable):
    """``[liquids."NAME"]``, with either of the two viscosities."""

    surface_tension: Sourced[units.SurfaceTension]
    density: Sourced[units.Density]
    kinematic_viscosity: Sourced[units.KinematicViscosity] | None = None
    dynamic_viscosity: Sourced[units.DynamicViscosity] | None = None

    @model_validator(mode="after")
    def _has_a_viscosity(self) -> LibraryLiquidTable:
        """The table; raises `ValueError` unless it has one viscosity."""
        if (self.kinematic_viscosity is None) == (self.dynamic_viscosity is None):
            raise ValueError("expected either kinematic_viscosity or dynamic_viscosity")
        return self


class SurfacePairTable(ConfigTable):
    """``[[surface_pairs]]``: how wet surfaces of two materials touch."""

    materials: tuple[Text, Text]
    friction: Sourced[Coefficient] | None = None
    friction_rise: Sourced[Coefficient] | None = None
    half_rise_velocity: Sourced[Annotated[float, SLIDING_VELOCITY]] | None = None
    rolling_friction: Sourced[Coefficient] | None = None
    restitution: Sourced[Number] | None = None
    volume_fraction: Sourced[Number] | None = None
    meniscus_radius: Sourced[units.Length] | None = None
    edge_ratio: Sourced[Number] | None = None
    contact_angle: Sourced[units.UpToRightAngle] | None = None

    @field_validator("friction", mode="before")
    @classmethod
    def _is_no_table_of_a_case(cls, friction: object) -> object:
        """The friction; raises `ValueError` for the table that a case has."""
        keys: Set[str] = set()
        if isinstance(friction, Mapping):
            keys = friction.keys()
        if keys & FrictionLaw.model_fields.keys():
            raise ValueError(
                'expected { value = ..., source = "..." } for the friction at rest; keys of their '
                "own beside it, friction_rise and half_rise_velocity, have the other two numbers"
            )
        return friction

    @model_validator(mode="after")
    def _has_a_whole_law_of_friction(self) -> SurfacePairTable:
        """The table; raises `ValueError` for a friction that grows without all its numbers."""
        law = (self.friction, self.friction_rise, self.half_rise_velocity)
        grows = self.friction_rise is not None or self.half_rise_velocity is not None
        if grows and None in law:
            raise ValueError("expected friction, friction_rise and half_rise_velocity together")
        return self


class LibraryFile(ConfigTable):
    """A library: materials, liquids and surface pairs, each number with its source."""

    materials: dict[Text, MaterialTable] = Field(default={})
    liquids: dict[Text, LibraryLiquidTable] = Field(default={})
    surface_pairs: list[SurfacePairTable] = Field(default=[])
