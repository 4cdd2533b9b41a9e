"""Inputs of the laws: liquid of the bridges and films, and contacts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import Annotated

from pydantic import Field

from walkers.physics import units
from walkers.physics.units import Coefficient, Number

DEFAULT_LAW = "young-laplace"


@dataclass(frozen=True, kw_only=True)
class Liquid:
    """``[liquid]``: a name from the library, numbers, or both (numbers take precedence).

    ``mass_fraction`` (of glycerol) and ``temperature`` (default: 20 °C) belong to ``water-glycerol``.
    ``volume_fraction`` is the volume of the liquid on a bead over that of the bead, ``viscosity_ratio`` the viscosity
    of the bridges over that of the liquid. If liquid is ``conserved``, a bridge takes its volume from the films of its
    beads and gives it back when it breaks (Shi and McCarthy 2008); otherwise its volume does not depend on other
    bridges. In a resolved case, ``dynamic_viscosity`` is that of the bridges. ``law`` is
    the bridge law: one of `walkers.physics.laws`, or your own function, ``file.py:function``.
    """

    name: str | None = None
    mass_fraction: Annotated[Number | None, Field(ge=0, le=1, exclude=True)] = None
    temperature: Annotated[units.Temperature | None, Field(exclude=True)] = None
    surface_tension: units.SurfaceTension
    density: units.Density | None = None
    kinematic_viscosity: Annotated[units.KinematicViscosity | None, Field(exclude=True)] = None
    dynamic_viscosity: units.DynamicViscosity = nan
    volume_fraction: Annotated[Number, Field(ge=1e-9, le=0.5)]
    viscosity_ratio: Annotated[Number, Field(ge=0, le=1e4, exclude=True)] = 1.0
    contact_angle: units.UpToRightAngle
    conserved: units.Flag = False
    law: str = DEFAULT_LAW


@dataclass(frozen=True, kw_only=True)
class Contact:
    """``[contact]``: the model of the contacts; the Young's modulus is that of the softened beads and walls.

    The engine requires a restitution above 0.05 and a modulus up to 1 GPa; a modulus below 5 MPa changes velocities.
    """

    friction_bead_bead: Annotated[Coefficient, Field(alias="friction.bead_bead")]
    friction_bead_wall: Annotated[Coefficient, Field(alias="friction.bead_wall")]
    rolling_friction: Coefficient
    restitution: Annotated[Number, Field(gt=0.05, le=1)]
    youngs_modulus: Annotated[float, replace(units.MODULUS, smallest=5e6, largest=1e9)] = 5e7
    poissons_ratio: Annotated[Number, Field(ge=0, lt=0.5)] = 0.3
    minimum_separation_ratio: Annotated[Number, Field(ge=1e-6, le=1)]
