"""Van der Waals attraction of dry surfaces, F = A R* / (6 (h + d0)²), without resistances.

A is the Hamaker constant, for silica in vacuum 6.5e-20 J (Bergström 1997), and d0 = 0.165 nm the distance of touching
surfaces (Israelachvili 2011, Sec. 13.13). The attraction begins and ends at the gap at which it is `SMALLEST` times its
value at contact, (1/√SMALLEST - 1) d0 = 5 nm.

The law is for smooth surfaces: 0.12 mN for a bead of 0.3 mm on a plane, as much as a bridge. Asperities of a few
nanometres reduce it to a hundredth or less (take a larger ``cutoff``). It changes within nanometres; the motion in a
time step must be much smaller.

For another constant, define a law in your own file (`walkers.physics.laws`):

    law = functools.partial(walkers.physics.laws.van_der_waals.law, hamaker_constant=15e-20)

References
----------
H. C. Hamaker, Physica 4 (1937) 1058–1072, doi 10.1016/S0031-8914(37)80203-7.
L. Bergström, Adv. Colloid Interface Sci. 70 (1997) 125–169, doi 10.1016/S0001-8686(97)00003-1.
J. N. Israelachvili, Intermolecular and Surface Forces, 3rd ed. (2011).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from walkers.physics.bridge import Curve, FloatArray, Forces, Surfaces

SMALLEST = 1e-3
"""Cut-off: smallest attraction, relative to that at contact."""


def law(surfaces: Surfaces, hamaker_constant: float = 6.5e-20, cutoff: float = 0.165e-9) -> Curve:
    """Hamaker attraction of two spheres, or of a sphere and a plane, in the Derjaguin limit of small gaps.

    Parameters
    ----------
    surfaces
        The pair; its liquid does not matter.
    hamaker_constant
        A, J.
    cutoff
        d0, m.
    """

    def forces(gaps: FloatArray) -> Forces:
        pull = hamaker_constant * surfaces.reduced_radius / (6.0 * (gaps + cutoff) ** 2)
        return Forces(pull, *np.zeros((4, len(gaps))))

    reach = (1.0 / sqrt(SMALLEST) - 1.0) * cutoff
    return Curve(forces, rupture=reach, formation=reach, scale=cutoff)
