"""Laws of friction in the calibration of the paper's walkers.

`calibration_with` gives the shipped calibration ``ruby`` with another law of friction between beads
or with other unknowns, and the same facts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

from walkers.calibration.file import Calibration, read_calibration
from walkers.inputs.reading import find_input
from walkers.inputs.toml import read_toml
from walkers.inputs.units import SPEED, parse_quantity

Document = dict[str, Any]
"""The tables of a calibration file."""

_BEADS = "contact.friction.bead_bead"
_WALL = "contact.friction.bead_wall"
_ON_SLIDE_OF_FIG_4 = ("fig4a", "fig4b")
"""Experiments of Fig. 4."""
_VISCOSITY_OF_FIG_4B = 2.022
"""Dynamic viscosity of the oil of Fig. 4b over that of the other figures."""


@dataclass(frozen=True)
class FrictionLaw:
    """A law of friction of the beads and of the substrate.

    Attributes
    ----------
    title
        What tables call it.
    changes
        Functions that change the tables of the calibration ``ruby``, one after the other.
    sets
        Values of the parameters in sets that are run by themselves, by the names of the sets.
    """

    title: str
    changes: tuple[Callable[[Document], None], ...] = ()
    sets: Mapping[str, Mapping[str, float]] | None = None


def _coulomb(document: Document) -> None:
    """A coefficient between the beads, in place of a friction that grows."""
    del document["set"]["contact"]
    del document["parameters"]["rise"]
    document["parameters"]["friction_bead"] = {
        "keys": [_BEADS],
        "range": [0.04, 0.3],
        "log": True,
        "symbol": "friction of beads",
    }


def _two_wall_frictions(document: Document) -> None:
    """A friction of the substrate in Fig. 4, and one in the other figures."""
    not_fig4 = [name for name in document["experiments"] if name not in _ON_SLIDE_OF_FIG_4]
    wall = document["parameters"]["friction_wall"]
    wall |= {"range": [0.08, 0.5], "experiments": not_fig4, "symbol": "wall friction, Figs. 1 to 3"}
    document["parameters"]["friction_slide"] = wall | {
        "experiments": list(_ON_SLIDE_OF_FIG_4),
        "symbol": "wall friction, Fig. 4",
    }


def _without_edges(document: Document) -> None:
    """No viscous forces on the edges of menisci."""
    del document["parameters"]["edges"]
    document["set"]["liquid"]["edge_ratio"] = 0.0


def _with_viscosity(document: Document) -> None:
    """The friction of the beads grows with the product of velocity and viscosity.

    The velocity of half of the rise is the calibration's with the oil of most figures, and lower by
    the ratio of the viscosities with that of Fig. 4b.
    """
    contact = document["set"].pop("contact")
    velocity = contact["friction"]["bead_bead"]["half_rise_velocity"]
    for name, changes in document["experiments"].items():
        of_experiment = velocity
        if name == "fig4b":
            of_experiment = f"{parse_quantity(velocity, SPEED) / _VISCOSITY_OF_FIG_4B:.4g} m/s"
        contact_of_experiment = {"friction": {"bead_bead": {"half_rise_velocity": of_experiment}}}
        changes["contact"] = contact_of_experiment


def _beads_saturate(document: Document) -> None:
    """The rise of the friction of the beads ends at a velocity that is unknown."""
    del document["set"]["contact"]
    document["parameters"]["rise"]["range"] = [0.02, 2.0]
    document["parameters"]["half_rise_velocity"] = _half_rise_velocity(_BEADS, "beads")


def _walls_grow(document: Document) -> None:
    """The friction of the substrate grows in place of that of the beads."""
    _coulomb(document)
    parameters = document["parameters"]
    parameters["friction_wall"]["keys"] = [f"{_WALL}.at_rest"]
    parameters["wall_rise"] = {
        "keys": [f"{_WALL}.rise"],
        "range": [0.02, 2.0],
        "log": True,
        "symbol": "rise of the wall friction",
    }
    parameters["wall_velocity"] = _half_rise_velocity(_WALL, "wall")


def _half_rise_velocity(key: str, of: str) -> dict[str, Any]:
    """The unknown velocity of half of the rise of a friction."""
    return {
        "keys": [f"{key}.half_rise_velocity"],
        "range": [2.0, 300.0],
        "unit": "mm/s",
        "log": True,
        "symbol": f"velocity of half the rise, {of}",
    }


_ESTIMATED = {"rolling_friction": 0.005, "roughness": 35.0, "meniscus_radius": 70.0}
"""Values of the parameters that are not fitted, in sets of Coulomb's law."""

_COULOMB_TWO_WALLS = {
    "friction_wall": 0.175,
    "friction_slide": 0.325,
    "friction_bead": 0.11,
    **_ESTIMATED,
}
_COULOMB_ONE_WALL = {"friction_wall": 0.25, "friction_bead": 0.11, **_ESTIMATED}

LAWS: Mapping[str, FrictionLaw] = {
    # Without changes: the calibration `ruby-grows` is `ruby` under the name of its law.
    "grows": FrictionLaw("beads grow; edges"),
    "grows-with-viscosity": FrictionLaw("beads grow with ηv; edges", (_with_viscosity,)),
    "saturates": FrictionLaw("beads grow and saturate; edges", (_beads_saturate,)),
    "walls-grow": FrictionLaw("walls grow and saturate; edges", (_walls_grow,)),
    "coulomb-one-wall-edges": FrictionLaw("Coulomb, one wall; edges", (_coulomb,)),
    "coulomb-two-walls-edges": FrictionLaw(
        "Coulomb, two walls; edges", (_coulomb, _two_wall_frictions)
    ),
    "coulomb-one-wall": FrictionLaw(
        "Coulomb, one wall",
        (_coulomb, _without_edges),
        {"Coulomb, one wall friction": _COULOMB_ONE_WALL},
    ),
    "coulomb-two-walls": FrictionLaw(
        "Coulomb, two walls",
        (_coulomb, _two_wall_frictions, _without_edges),
        {"Coulomb, two wall frictions": _COULOMB_TWO_WALLS},
    ),
}
"""Laws by name. In the first one, that of the shipped calibration, the friction of the beads grows
in proportion to the velocity and that of the substrate, the same in all figures, does not."""


def calibration_with(law: str) -> Calibration:
    """The calibration ``ruby`` with another law of friction.

    Parameters
    ----------
    law
        A name of `LAWS`.

    Returns
    -------
    Calibration
        It is called ``ruby-LAW``.
    """
    path = find_input("ruby", "calibration")
    document = deepcopy(dict(read_toml(path)))
    chosen = LAWS[law]
    for change in chosen.changes:
        change(document)
    if chosen.changes:  # the sets of the file have other parameters
        document["sets"] = {name: dict(values) for name, values in (chosen.sets or {}).items()}
    return read_calibration(
        document, source=f"ruby with {chosen.title}", name=f"ruby-{law}", folder=path.parent
    )
