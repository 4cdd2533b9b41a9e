"""Contacts of softened beads: Hertz repulsion 4/3 E* √R* δ^(3/2), and the elastic Hertz impact.

E* = E/(2(1 − ν²)) and G* = E/(4(1 + ν)(2 − ν)) (Mindlin 1949) of two bodies of the same modulus. A
wall is a sphere of infinite radius: R* is the radius of the bead and m* its mass. In an impact at a
normal speed v_n

    δ_max = (15 m* v_n²/(16 E* √R*))^(2/5),    F_max = 4/3 E* √R* δ_max^(3/2),    and the contact
    lasts 2.943 δ_max/v_n.

References
----------
H. Hertz, J. reine angew. Math. 92 (1882) 156, doi 10.1515/crll.1882.92.156; R. D. Mindlin, J. Appl.
Mech. 16 (1949) 259; K. L. Johnson, Contact Mechanics (1985), doi 10.1017/CBO9781139171731 (the
duration: ch. 11.4).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from walkers.physics.portable import cube_root

_DURATION = 2.9432750
"""Duration of the Hertz impact in units of δ_max/v_n."""


def reduced_modulus(youngs_modulus: float, poissons_ratio: float) -> float:
    """E* of two bodies of the same modulus, Pa."""
    return youngs_modulus / (2.0 * (1.0 - poissons_ratio**2))


def hertz_overlap(force: float, reduced_radius: float, reduced_modulus: float) -> float:
    """Overlap (m) at which the repulsion balances a load; zero for a tensile load.

    Parameters
    ----------
    force
        The load, N.
    reduced_radius
        R*, m.
    reduced_modulus
        E*, Pa.
    """
    if force <= 0.0:
        return 0.0
    root = cube_root(3.0 * force / (4.0 * reduced_modulus * sqrt(reduced_radius)))
    return root * root


def hertz_stiffness(overlap: float, reduced_radius: float, reduced_modulus: float) -> float:
    """Stiffness of a contact, the increase of the repulsion with the overlap, N/m.

    Parameters
    ----------
    overlap
        δ, m.
    reduced_radius
        R*, m.
    reduced_modulus
        E*, Pa.
    """
    return 2.0 * reduced_modulus * sqrt(reduced_radius * overlap)


class Impact(NamedTuple):
    """Elastic impact of two bodies; its methods take the normal velocity of the bodies (m/s)."""

    mass: float
    """Reduced mass m*, kg."""
    radius: float
    """Reduced radius R*, m."""
    modulus: float
    """Reduced modulus E*, Pa."""

    def depth(self, speed: float) -> float:
        """Largest overlap, m."""
        return float(
            (15.0 * self.mass * speed**2 / (16.0 * self.modulus * sqrt(self.radius))) ** 0.4
        )

    def peak_force(self, speed: float) -> float:
        """Largest force, N."""
        return float(4.0 / 3.0 * self.modulus * sqrt(self.radius) * self.depth(speed) ** 1.5)

    def duration(self, speed: float) -> float:
        """Duration of the contact, s."""
        return _DURATION * self.depth(speed) / speed
