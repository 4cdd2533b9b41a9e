"""Which terms act in the second engine, and in which form: so that "what if" has an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

CoulombLimit = Literal["elastic-and-damping", "elastic"]
StaticFriction = Literal["none", "velocity", "stick-slip"]
WallLubrication = Literal["halves", "plane-normal", "plane"]


@dataclass(frozen=True)
class ForceTable:
    """The pull of a bridge as a table, of the Young-Laplace equation for instance, in place of Soulié's formula.

    Attributes
    ----------
    radii
        Of the two beads, m; or of a bead and None for a wall.
    gap
        Distances of the surfaces, m, increasing from 0; the bridge breaks at the last one.
    force_over_tension
        Pull over surface tension at these, m; at a wall all of it, however many copies the wall has.
    """

    radii: tuple[float, float | None]
    gap: tuple[float, ...]
    force_over_tension: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.gap) < 2 or len(self.gap) != len(self.force_over_tension):
            raise ValueError("a table of forces: expected as many forces as gaps, at least two")
        if self.gap[0] != 0.0 or np.any(np.diff(self.gap) <= 0.0):
            raise ValueError("a table of forces: expected gaps that increase from 0")

    def fits(self, radius: float, other: float | None, tolerance: float = 1e-6) -> bool:
        """Whether it is of these two, in either order."""
        first, second = self.radii
        if second is None or other is None:
            return second is None and other is None and abs(first - radius) <= tolerance * radius
        return any(
            abs(one - radius) <= tolerance * radius and abs(two - other) <= tolerance * other
            for one, two in ((first, second), (second, first))
        )


@dataclass(frozen=True)
class Laws:
    """The terms of the second engine; as they stand, those of the decks.

    Attributes
    ----------
    normal_damping
        Damping of Hertz's contact (Tsuji, Tanaka, Ishida 1992), which sets the restitution.
    friction
        Tangential contact force, limited by Coulomb's law.
    tangential_spring, tangential_damping
        Its two parts (Mindlin 1949); without the spring it is the damping up to Coulomb's limit.
    coulomb_limit
        μ|F_elastic + F_damping|, as LIGGGHTS has it, or μ F_elastic.
    static_friction
        ``none``; ``velocity``: μ = μ_k (1 + (s − 1)/(1 + |v_t|/v_s)), which weakens with the sliding velocity;
        ``stick-slip``: the spring holds up to s μ_k F and from then on μ_k F, until its load falls or turns.
    static_ratio, static_velocity
        s = μ_s/μ_k, and v_s in m/s.
    capillary, capillary_tables
        Pull of the bridges after Soulié et al. (2006), and tables that take its place for some radii.
    normal_lubrication, tangential_lubrication
        Viscous forces of the bridges.
    wall_lubrication
        ``plane-normal``: a wall is an equal sphere, R* = R/2, as many times as the wall has copies, and what is missing
        then of the normal force of a sphere and a plane, 6πηR v/max(ε, h/R), is added within reach of a bridge, whether
        or not there is one. ``halves``: without that. ``plane``: normal and tangential with R* = R, once.
    liquid_transfer
        When a bridge between beads breaks they share its liquid by their volumes.
    rolling_friction
        Torque of constant size against the rolling (Ai et al. 2011).
    film
        Drag of the film on the walls.
    gravity, drive
        Weight, and the inertial force of the shaken frame.
    wall_copies
        How many equal spheres a wall counts as (`walkers.physics.wall` has the reason).
    """

    normal_damping: bool = True
    friction: bool = True
    tangential_spring: bool = True
    tangential_damping: bool = True
    coulomb_limit: CoulombLimit = "elastic-and-damping"
    static_friction: StaticFriction = "none"
    static_ratio: float = 1.0
    static_velocity: float = 1e-3
    capillary: bool = True
    capillary_tables: tuple[ForceTable, ...] = ()
    normal_lubrication: bool = True
    tangential_lubrication: bool = True
    wall_lubrication: WallLubrication = "plane-normal"
    liquid_transfer: bool = True
    rolling_friction: bool = True
    film: bool = True
    gravity: bool = True
    drive: bool = True
    wall_copies: int = 2

    def __post_init__(self) -> None:
        if self.static_ratio < 1.0 or not isfinite(self.static_ratio):
            raise ValueError("law static-ratio: expected at least 1, static friction over kinetic friction")
        if not 0.0 < self.static_velocity < float("inf"):
            raise ValueError("law static-velocity: expected more than 0 m/s")
        if self.wall_copies < 1:
            raise ValueError("law wall-copies: expected at least 1")

    def differences(self) -> list[str]:
        """What is unlike the decks, each as ``name=value``."""
        decks = Laws()
        changed = [one.name for one in fields(self) if getattr(self, one.name) != getattr(decks, one.name)]
        return [f"{_shown(name)}={_value(getattr(self, name))}" for name in changed]


TERMS = tuple(_name.replace("_", "-") for _name, _type in get_type_hints(Laws).items() if _type is bool)
"""What ``--without`` takes."""
SETTINGS = tuple(
    _name.replace("_", "-")
    for _name, _type in get_type_hints(Laws).items()
    if _type is not bool and _name != "capillary_tables"
)
"""What ``--law`` takes."""


def laws_from(without: Sequence[str] = (), settings: Sequence[str] = ()) -> Laws:
    """The decks' laws without some terms, and with some settings.

    Parameters
    ----------
    without
        Of `TERMS`.
    settings
        Each ``name=value``, the name of `SETTINGS`.

    Raises
    ------
    ValueError
        If one is unknown.

    Examples
    --------
    >>> laws_from(["film"], ["wall-lubrication=plane"]).differences()
    ['wall-lubrication=plane', 'film=off']
    """
    changes: dict[str, Any] = {}
    for term in without:
        if term not in TERMS:
            raise ValueError(f"without {term}: expected one of {', '.join(TERMS)}")
        changes[term.replace("-", "_")] = False
    types = get_type_hints(Laws)
    for setting in settings:
        name, _, value = setting.partition("=")
        if name not in SETTINGS:
            raise ValueError(f"law {setting}: expected NAME=VALUE, the name one of {', '.join(SETTINGS)}")
        key = name.replace("-", "_")
        changes[key] = _read(name, value, types[key])
    if {"static_ratio", "static_velocity"} & set(changes) and changes.get("static_friction", "none") == "none":
        raise ValueError("law static-ratio, static-velocity: expected static-friction=velocity or stick-slip with them")
    return replace(Laws(), **changes)


def _read(name: str, value: str, kind: type) -> str | float | int:
    """A setting as what it is.

    Raises
    ------
    ValueError
        If it is none.
    """
    if kind in (int, float):
        try:
            number = int(value) if kind is int else float(value)
        except ValueError:
            raise ValueError(f"law {name}={value}: expected a {'whole ' if kind is int else ''}number") from None
        return number
    known = get_args(kind)
    if value not in known:
        raise ValueError(f"law {name}={value}: expected one of {', '.join(known)}")
    return value


def _shown(name: str) -> str:
    return name.replace("_", "-")


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"{len(value)} tables" if isinstance(value, tuple) else f"{value}"
