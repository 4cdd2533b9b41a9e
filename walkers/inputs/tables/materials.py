"""Materials, liquid and contacts of a case, and gravity.

`walkers.inputs.resolving.from_library` looks up the values of these tables that are in the library.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Annotated, ClassVar

from pydantic import AfterValidator, Tag

from walkers.inputs import units
from walkers.inputs.config_table import (
    NUMBER_FORM,
    NUMBER_OR_TABLE,
    TABLE_FORM,
    Choice,
    ConfigTable,
    Indirect,
    key,
)
from walkers.inputs.units import Coefficient, Number
from walkers.physics.capillary import DEFAULT_LAW, BridgeLiquid
from walkers.physics.friction import SlidingFriction
from walkers.rounding import to_fifteen_digits

SLIDING_VELOCITY = replace(units.SPEED, example="80 mm/s", smallest=1e-6, largest=1.0)
"""Velocities at which half of the rise of a friction may be reached."""
STIFFEST = 1e11
"""Largest Young's modulus of contacts, Pa: that of glass or steel, with which a run takes a day."""
_SOFTENED = Annotated[float, replace(units.MODULUS, smallest=5e6, largest=STIFFEST)]


class BeadsTable(ConfigTable):
    """``[beads]``: the material of all beads."""

    material: Indirect[str] = key(
        "Material of all beads, from the library, which gives the density.", None, "ruby"
    )
    density: units.Density = key("Density of the beads.")


class LiquidTable(ConfigTable):
    """``[liquid]``: a name from the library, numbers, or both (numbers take precedence)."""

    choices: ClassVar = (
        Choice(("dynamic_viscosity",), ("kinematic_viscosity",), instead="a liquid of the library"),
        Choice(("volume_fraction",), ("meniscus_radius",)),
    )
    name: Indirect[str] = key(
        "Liquid from the library. The other keys override its values.", None, "Si AK5"
    )
    mass_fraction: Indirect[Number] = key(
        "Mass fraction of glycerol in `water-glycerol`.", None, 0.87, ge=0, le=1
    )
    temperature: Indirect[units.Temperature] = key(
        "Temperature of `water-glycerol`. Default: 20 °C.", None
    )
    surface_tension: units.SurfaceTension = key("Surface tension.")
    density: Indirect[units.Density] = key("Density of the liquid.", None)
    kinematic_viscosity: Indirect[units.KinematicViscosity] = key("Kinematic viscosity.", None)
    dynamic_viscosity: units.DynamicViscosity | None = key(
        "Dynamic viscosity, instead of the kinematic one.", None
    )
    volume_fraction: Number | None = key(
        "Ratio of the volumes of liquid and bead. The bridges share the liquid.",
        None,
        0.01,
        ge=1e-9,
        le=0.5,
    )
    meniscus_radius: units.Length | None = key(
        "Radius of the menisci of all bridges, which exchange liquid through the film "
        "on a wetted substrate.",
        None,
        "70 um",
    )
    viscosity_ratio: Number = key(
        "Factor of the viscosity of the bridges. It scales their viscous forces, those of edges by "
        "its power 2/3.",
        1.0,
        ge=0,
        le=1e4,
    )
    edge_ratio: Number | None = key(
        "Factor of the viscous forces on the edges of menisci that move over wet surfaces; without "
        "it, edges do not resist. See [](../../explanation/unexplained.md).",
        None,
        1.0,
        ge=0,
        le=10,
    )
    contact_angle: units.UpToRightAngle = key(
        "Contact angle at every bridge. A case whose bridges push the beads of a walker apart "
        "at rest is refused."
    )
    conserved: units.Flag = key(
        "Whether bridges take their liquid from the films of their beads, and give it back. "
        "For piles.",
        False,
    )
    law: str = key("Law of the bridges. See [](../../how-to/bridge-law.md).", DEFAULT_LAW)


class Liquid(LiquidTable):
    """The liquid of a resolved case.

    It has either a ``volume_fraction`` or a ``meniscus_radius``.
    """

    dynamic_viscosity: units.DynamicViscosity

    @cached_property
    def of_bridges(self) -> BridgeLiquid:
        """The properties of the liquid on which the forces of bridges depend, in SI units.

        Either the volume fraction or the radius of the menisci is given; the other is 0.
        """
        return BridgeLiquid(
            surface_tension=self.surface_tension,
            viscosity=to_fifteen_digits(self.dynamic_viscosity * self.viscosity_ratio),
            volume_fraction=self.volume_fraction or 0.0,
            meniscus_radius=self.meniscus_radius or 0.0,
            contact_angle=self.contact_angle,
            conserved=self.conserved,
            law=self.law,
            edge_ratio=self.edge_ratio or 0.0,
        )


def _not_weakening(rise: float) -> float:
    """The rise of a friction; raises `ValueError` if it is negative."""
    if rise < 0.0:
        raise ValueError(
            "expected at least 0: friction that falls with the velocity makes contacts stick and "
            "slip from one time step to the next"
        )
    return rise


class FrictionLaw(ConfigTable):
    """``[contact.friction.bead_bead]``: a friction that grows with the sliding velocity."""

    at_rest: Coefficient = key("Friction coefficient of a contact at rest.", example=0.03)
    rise: Annotated[Number, AfterValidator(_not_weakening)] = key(
        "Rise of the coefficient at high sliding velocities; 0 is Coulomb's law.",
        example=0.5,
        le=1e3,
    )
    half_rise_velocity: Annotated[float, SLIDING_VELOCITY] = key(
        "Sliding velocity at which half of the rise is reached."
    )


CoefficientOrLaw = Annotated[
    Annotated[Coefficient, Tag(NUMBER_FORM)] | Annotated[FrictionLaw, Tag(TABLE_FORM)],
    NUMBER_OR_TABLE,
]
"""A number is Coulomb's coefficient; a table is a friction that grows with the velocity."""


class Friction(ConfigTable):
    """``[contact.friction]``: Coulomb's coefficients, or frictions that grow with the velocity."""

    bead_bead: CoefficientOrLaw = key("Friction coefficient between two beads.", example=0.25)
    bead_wall: CoefficientOrLaw = key(
        "Friction coefficient between a bead and the boundary.", example=0.25
    )

    @property
    def grows(self) -> bool:
        """Whether any of the two grows with the velocity."""
        return self.between_beads.rise > 0.0 or self.at_walls.rise > 0.0

    @property
    def between_beads(self) -> SlidingFriction:
        """The law of friction between two beads."""
        return _law_of(self.bead_bead)

    @property
    def at_walls(self) -> SlidingFriction:
        """The law of friction between a bead and the boundary."""
        return _law_of(self.bead_wall)

    @property
    def of_dimer(self) -> tuple[SlidingFriction, SlidingFriction, SlidingFriction]:
        """The laws of the three contacts of a dimer: each bead at the boundary, then both beads."""
        return self.at_walls, self.at_walls, self.between_beads


def _law_of(friction: float | FrictionLaw) -> SlidingFriction:
    """The law of a friction in either form."""
    if isinstance(friction, FrictionLaw):
        return SlidingFriction(friction.at_rest, friction.rise, friction.half_rise_velocity)
    return SlidingFriction(friction)


class Roughness(ConfigTable):
    """``[contact.roughness]``: the gap for liquid between surfaces whose asperities touch."""

    bead_bead: units.Length = key(
        "Roughness of a contact of two beads: the root of the sum of both squares.", example="30 nm"
    )
    bead_wall: units.Length = key(
        "Roughness of a contact of a bead and the boundary.", example="30 nm"
    )


class ContactTable(ConfigTable):
    """``[contact]``: the model of the contacts, whose Young's modulus is that of softened bodies.

    An automatic modulus is 50 MPa for loose beads. For walkers it is the lowest of 50, 200, 800, …
    MPa at which bridges hardly delay the contacts (`walkers.inputs.resolving.loads.largest_delay`).
    """

    friction: Friction = key("")
    roughness: Roughness = key("")
    rolling_friction: Coefficient = key(
        "Coefficient of rolling friction (constant directional torque).", example=0.01
    )
    restitution: Number = key(
        "Coefficient of restitution of the dry contact.", example=0.5, gt=0.05, le=1
    )
    youngs_modulus: Annotated[_SOFTENED | None, units.AUTO] = key(
        "Young's modulus of beads and boundary: lower than the real one, so that the time step "
        "can be longer.",
        None,
    )
    poissons_ratio: Number = key("Poisson's ratio.", 0.3, ge=0, lt=0.5)


class Contact(ContactTable):
    """The contacts of a resolved case."""

    youngs_modulus: _SOFTENED


class Environment(ConfigTable):
    """``[environment]``: gravity."""

    gravity: Annotated[float, replace(units.ACCELERATION, example="9.81 m/s^2")] = key(
        "Acceleration of gravity.", 9.81
    )
