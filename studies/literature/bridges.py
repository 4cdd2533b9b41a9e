"""Published bridge laws compared with the Young–Laplace equation, and velocities of walkers with other laws.

A published law gives the pull divided by the surface tension, F/γ, of a bridge of constant volume against the gap; laws
for equal spheres use Derjaguin's radius (`walkers.physics.capillary.derjaguin_radius`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from walkers.api import run
from walkers.arrays import FloatArray
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.loads import dimer_of, surfaces_of
from walkers.physics import capillary
from walkers.physics.laws import rabinovich, soulie, willett, young_laplace
from walkers.second_engine.lines import Line

COMPARED = ("fig1b", "climber-dimer")
"""Cases whose bridges are compared: with the liquid of the walkers, and with the liquid of the piles."""
WALKED, WALKED_BY = ("fig1b", "fig4a"), ("young-laplace", "willett", "rabinovich", "soulie")
"""Cases and laws of the velocities; the cases have the first law."""
_GAPS = 280


class Law(NamedTuple):
    """A published law: its ``pull`` (radii, volume, contact angle, gaps → F/γ) and its ``rupture`` distance.

    The default rupture distance is by Lian et al. (1993), for any radii. ``error`` is the published relative error of
    the pull at contact, for fits to solutions of the Young–Laplace equation.
    """

    pull: Callable[[float, float, float, float, FloatArray], FloatArray]
    rupture: Callable[[float, float, float, float], float] = lambda *bridge: (
        capillary.rupture_distance_of_lian(*bridge[2:])
    )
    error: float = inf


LAWS = {
    "Soulié 2006": Law(soulie.pull),
    "Willett 2000": Law(willett.pull, willett.rupture, 0.04),
    "Rabinovich 2005": Law(rabinovich.pull),
    "Lambert 2008": Law(rabinovich.lambert),
}


def pulls() -> Iterator[Line]:
    """Pull at contact, work and rupture distance of each law, divided by the values of Young–Laplace."""
    for name in COMPARED:
        case = load_case(name)
        large, small = dimer_of(case).radii
        for place, radius in (("beads", small), ("wall", inf)):
            surfaces = surfaces_of(case, large, radius)
            shape = (
                surfaces.radius,
                surfaces.other_radius,
                surfaces.volume,
                surfaces.liquid.contact_angle,
            )
            exact = young_laplace.law(surfaces)
            distances = _even(exact.rupture)
            true = exact.forces(distances).pull / surfaces.liquid.surface_tension
            for author, law in LAWS.items():
                gaps = _even(law.rupture(*shape))
                pull = law.pull(*shape, gaps)
                work = float(np.trapezoid(pull, gaps) / np.trapezoid(true, distances))
                title = f"{author}, {name}, {place}"
                yield Line(
                    f"{title}: pull at contact over Young–Laplace",
                    1.0,
                    float(pull[0] / true[0]),
                    law.error,
                )
                yield Line(f"{title}: work over Young–Laplace", 1.0, work)
                yield Line(
                    f"{title}: rupture distance over Young–Laplace",
                    1.0,
                    float(gaps[-1] / exact.rupture),
                )


def velocities(out: Path) -> Iterator[Line]:
    """Velocities of walkers by other laws than Young–Laplace; ``out`` is the folder of their runs."""
    for name in WALKED:
        exact, *by_laws = (
            1e3 * run(load_case(name, {"liquid.law": law}), out).result["velocity"]
            for law in WALKED_BY
        )
        for law, speed in zip(WALKED_BY[1:], by_laws, strict=True):
            yield Line(f"velocity of {name}: {WALKED_BY[0]}, {law}", exact, speed, unit="mm/s")


def _even(rupture: float) -> FloatArray:
    """Gaps from contact to rupture, m."""
    return 0.5 * rupture * (1.0 - np.cos(np.linspace(0.0, pi, _GAPS)))
