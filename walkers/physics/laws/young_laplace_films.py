"""As young-laplace, but bridges form when the liquid films touch, not when the beads touch.

A film of φ of a bead's volume is R ((1 + φ)^⅓ - 1) thick: 1 µm for a bead of 0.3 mm and φ = 0.01. Between beads a
bridge forms at a gap of both films, at a wall at a gap of the bead's film (nothing is known of a film on the wall).
"""

from __future__ import annotations

from dataclasses import replace

from walkers.physics.bridge import Curve, Surfaces, UnusableLawError
from walkers.physics.laws import young_laplace


def film(radius: float, volume_fraction: float) -> float:
    """Thickness of an even film on a bead (m), given the film's volume over the bead's."""
    return float(radius * ((1.0 + volume_fraction) ** (1.0 / 3.0) - 1.0))


def law(surfaces: Surfaces) -> Curve:
    """Pull and rupture of the Young–Laplace equation, Reynolds resistances; the bridge forms when the films touch."""
    if surfaces.liquid.meniscus_radius:
        raise UnusableLawError("a meniscus radius says nothing of films on beads; expected a volume_fraction")
    curve = young_laplace.law(surfaces)
    beads = [surfaces.radius] if surfaces.at_wall else [surfaces.radius, surfaces.other_radius]
    films = sum(film(radius, surfaces.liquid.volume_fraction) for radius in beads)
    return replace(curve, formation=min(films, curve.rupture))
