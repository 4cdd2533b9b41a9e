"""Contacts of softened beads: Hertz's repulsion 4/3 E* √R* δ^(3/2), its damping, Mindlin's tangential modulus.

E* = E/(2(1 − ν²)) and G* = E/(4(1 + ν)(2 − ν)) of two bodies of the same modulus. Hertz 1881; Mindlin 1949; K. L.
Johnson, Contact Mechanics (1985). A wall is a sphere without end: R* is the bead's radius and m* its mass. Coulomb's
limit is μ times the elastic repulsion, which carries the load of the bridge.
"""

from __future__ import annotations

from math import sqrt


def reduced_modulus(youngs_modulus: float, poissons_ratio: float) -> float:
    """E* of two bodies of the same modulus, Pa."""
    return youngs_modulus / (2.0 * (1.0 - poissons_ratio**2))


def hertz_overlap(force: float, reduced_radius: float, reduced_modulus: float) -> float:
    """Overlap at which the repulsion of two beads carries a load, m.

    Parameters
    ----------
    force
        Load, N; one that pulls apart presses nothing.
    reduced_radius, reduced_modulus
        R* in m, E* in Pa.
    """
    return float((3.0 * max(force, 0.0) / (4.0 * reduced_modulus * sqrt(reduced_radius))) ** (2.0 / 3.0))
