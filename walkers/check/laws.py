"""Which terms act in the second engine: so that "what if" has an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Laws:
    """The terms of the second engine; as they stand, those of the decks.

    Attributes
    ----------
    capillary
        Pull of the bridges.
    lubrication
        Their resistances.
    damping
        Of Hertz's contact and of the spring along the surfaces (Tsuji, Tanaka, Ishida 1992).
    friction
        All of the tangential contact force.
    rolling_friction
        Torque of constant size against the rolling (Ai et al. 2011).
    gravity, drive
        Weight, and the inertial force of the shaken frame.
    """

    capillary: bool = True
    lubrication: bool = True
    damping: bool = True
    friction: bool = True
    rolling_friction: bool = True
    gravity: bool = True
    drive: bool = True

    def differences(self) -> list[str]:
        """What is left out, each as ``name=off``."""
        return [f"{term}=off" for term in TERMS if not getattr(self, term.replace("-", "_"))]


TERMS = tuple(_field.name.replace("_", "-") for _field in fields(Laws))
"""What ``--without`` takes."""


def laws_from(without: Sequence[str] = ()) -> Laws:
    """The decks' laws without some of the `TERMS`.

    Raises
    ------
    ValueError
        If one is unknown.

    Examples
    --------
    >>> laws_from(["drive"]).differences()
    ['drive=off']
    """
    for term in without:
        if term not in TERMS:
            raise ValueError(f"without {term}: expected one of {', '.join(TERMS)}")
    return Laws(**{term.replace("-", "_"): False for term in without})
