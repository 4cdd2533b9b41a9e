"""The Young–Laplace equation, solved numerically, with Reynolds' resistances.

The capillary force between beads and at a plane is the closed solution of `walkers.physics.laplace`
for the given volume and contact angle. The bridge breaks at the largest gap at which the equation
has a solution. Near rupture, the pull falls as the square root of the remaining gap, with an
infinite slope. It is smooth in t = √(1 - h/rupture), and a polynomial in t through a few dozen
solutions is as accurate as the equation. The user's cache keeps the polynomial of each shape of
bridge, which saves a tenth of a second.

`walkers.physics.reynolds` gives the resistances.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.polynomial import Chebyshev

from walkers.arrays import FloatArray
from walkers.cache import cached_numbers, is_trusted, place_of_numbers
from walkers.physics import reynolds
from walkers.physics.bridge import Curve, Surfaces
from walkers.physics.capillary import solver
from walkers.physics.portable import chebyshev_coefficients, chebyshev_nodes

NODES = (48, 96)
"""Numbers of gaps at which the equation is solved, increased until the last coefficients are small.

The largest one suffices for errors below 1e-7 of the force at contact at volumes above 1e-6 R³.
"""
_Shape = tuple[float, float, float]
"""The other radius and the volume, in units of the bead's radius, and the contact angle (rad)."""
_SMALL = 1e-9
"""Largest last coefficients of an accurate polynomial, relative to the pull at contact."""


def law(surfaces: Surfaces) -> Curve:
    """Pull and rupture distance of the Young–Laplace equation, and Reynolds resistances.

    Raises `walkers.physics.laplace.NoBridgeError` if the contact angle is so large that the liquid
    is not held between the surfaces.
    """
    radius = surfaces.radius
    farthest, smooth = _solved(_shape(surfaces))
    rupture = radius * farthest

    def pull(gaps: FloatArray) -> FloatArray:
        return radius * np.asarray(smooth(np.sqrt(np.clip(1.0 - gaps / rupture, 0.0, 1.0))))

    return reynolds.curve(surfaces, pull, rupture)


def unsolved(bridges: Iterable[Surfaces]) -> int:
    """Number of bridge shapes without a cached solution; each takes a tenth of a second."""
    shapes = {_shape(surfaces) for surfaces in bridges}
    return sum(not is_trusted(_place(shape)) for shape in shapes)


def _shape(surfaces: Surfaces) -> _Shape:
    """The shape of a bridge, rounded so that bridges of equal shape share a solution."""
    radius = surfaces.radius
    return (
        _rounded(surfaces.other_radius / radius),
        _rounded(surfaces.volume / (radius * radius * radius)),
        _rounded(surfaces.liquid.contact_angle),
    )


def _rounded(number: float) -> float:
    """A number with 14 significant digits."""
    return float(f"{number:.14g}")


def _place(shape: _Shape) -> Path:
    """Path of the cached solution of a shape."""
    return place_of_numbers("young-laplace", solver() + repr((NODES, _SMALL, shape)).encode())


@lru_cache(maxsize=4096)
def _solved(shape: _Shape) -> tuple[float, Chebyshev]:
    """Rupture distance, and F/γ as a polynomial in √(1 - h/rupture).

    Both are in units of the bead's radius.
    """
    numbers = cached_numbers(_place(shape), lambda: _solve(shape))
    return float(numbers[0]), Chebyshev(numbers[1:], domain=[0.0, 1.0])


def _solve(shape: _Shape) -> FloatArray:
    """The rupture distance, then the coefficients of the polynomial."""
    from walkers.physics.laplace import force_curve, rupture_distance

    bridge = (1.0, *shape)
    rupture = rupture_distance(*bridge)
    for nodes in NODES:
        parts = 0.5 * (1.0 + chebyshev_nodes(nodes))
        forces = force_curve(*bridge, rupture * (1.0 - parts**2)).forces
        smooth = Chebyshev(chebyshev_coefficients(forces), domain=[0.0, 1.0])
        if np.abs(smooth.coef[-4:]).max() < _SMALL * abs(smooth(1.0)):
            break
    return np.array([rupture, *smooth.coef])
