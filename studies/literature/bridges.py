"""Published bridge laws compared with the Young–Laplace equation, alone and in walkers.

A published law gives the capillary force divided by the surface tension, F/γ (m), of a bridge of
constant volume against the gap. Laws for equal spheres use Derjaguin's radius
(`walkers.physics.capillary.derjaguin_radius`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf, pi
from pathlib import Path

import numpy as np

from walkers.api import run
from walkers.arrays import FloatArray
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.loads import dimer_of, surfaces_of
from walkers.physics import capillary
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import rabinovich, soulie, willett, young_laplace
from walkers.second_engine.lines import Line

COMPARED = ("fig1b", "climber-dimer")
"""Cases whose bridges are compared: with the liquid of the walkers, and with that of the piles."""

WALKED = ("fig1b", "fig4a")
"""Cases whose velocities are compared; they have the first law of `WALKED_BY`."""

WALKED_BY = ("young-laplace", "willett", "rabinovich", "soulie")
"""Laws with which these cases walk."""

_GAPS = 280
"""Number of gaps at which a law is evaluated."""


def _rupture_distance_of_lian(
    _radius: float, _other_radius: float, volume: float, contact_angle: float
) -> float:
    return capillary.rupture_distance_of_lian(volume, contact_angle)


@dataclass(frozen=True)
class Law:
    """A published law of the capillary force between two surfaces.

    Attributes
    ----------
    pull
        Gives F/γ (m), shape (N,), from the two radii (m), the volume of the bridge (m³), the
        contact angle (rad) and the gaps (m), shape (N,).
    rupture
        Gives the rupture distance, m, from the same arguments without the gaps; default: that of
        Lian et al. (1993), for any radii.
    error
        Published relative error of the capillary force at contact, for laws that were fitted to
        solutions of the Young–Laplace equation; infinite for other laws.
    """

    pull: Callable[[float, float, float, float, FloatArray], FloatArray]
    rupture: Callable[[float, float, float, float], float] = _rupture_distance_of_lian
    error: float = inf


LAWS = {
    "Soulié 2006": Law(soulie.pull),
    "Willett 2000": Law(willett.pull, willett.rupture, error=0.04),
    "Rabinovich 2005": Law(rabinovich.pull),
    "Lambert 2008": Law(rabinovich.lambert),
}
"""Published laws by author and year."""


def pulls() -> Iterator[Line]:
    """Compare force at contact, work and rupture distance of each law with Young–Laplace."""
    for name in COMPARED:
        case = load_case(name)
        large, small = dimer_of(case).radii
        for contact, other_radius in (("beads", small), ("wall", inf)):
            surfaces = surfaces_of(case, large, other_radius)
            yield from _compare_laws(f"{name}, {contact}", surfaces)


def _compare_laws(bridge: str, surfaces: Surfaces) -> Iterator[Line]:
    """Lines of all laws for the bridge between two surfaces, over the values of Young–Laplace."""
    arguments = (
        surfaces.radius,
        surfaces.other_radius,
        surfaces.volume,
        surfaces.liquid.contact_angle,
    )
    exact = young_laplace.law(surfaces)
    exact_gaps = _gaps_until(exact.rupture)
    exact_pull = exact.forces(exact_gaps).pull / surfaces.liquid.surface_tension
    for author, law in LAWS.items():
        gaps = _gaps_until(law.rupture(*arguments))
        pull = law.pull(*arguments, gaps)
        at_contact = float(pull[0] / exact_pull[0])
        work = float(np.trapezoid(pull, gaps) / np.trapezoid(exact_pull, exact_gaps))
        rupture = float(gaps[-1] / exact.rupture)
        title = f"{author}, {bridge}"
        yield Line(f"{title}: pull at contact over Young–Laplace", 1.0, at_contact, law.error)
        yield Line(f"{title}: work over Young–Laplace", 1.0, work)
        yield Line(f"{title}: rupture distance over Young–Laplace", 1.0, rupture)


def _gaps_until(rupture: float) -> FloatArray:
    """Gaps from contact to a rupture distance, m, densest at both ends; shape (`_GAPS`,)."""
    return 0.5 * rupture * (1.0 - np.cos(np.linspace(0.0, pi, _GAPS)))


def velocities(out: Path) -> Iterator[Line]:
    """Compare velocities of walkers with other laws with those with Young–Laplace.

    Parameters
    ----------
    out
        Folder of the runs; missing runs are made.

    Yields
    ------
    Line
        Velocities in mm/s.
    """
    reference, *laws = WALKED_BY
    for name in WALKED:
        expected = _velocity(name, reference, out)
        for law in laws:
            title = f"velocity of {name}: {reference}, {law}"
            yield Line(title, expected, _velocity(name, law, out), unit="mm/s")


def _velocity(name: str, law: str, out: Path) -> float:
    """Velocity of the walkers of a case with a bridge law, mm/s."""
    case = load_case(name, {"liquid.law": law})
    return float(1e3 * run(case, out).result["velocity"])
