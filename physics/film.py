"""The film on a wall: a drag on a bead's translation along it, 6πηR v as Stokes has it, η that of the film.

It stands for what Coulomb friction and the bridge's lubrication leave out. The latter, in the engine, goes with the
velocity of the surfaces at the contact, v - ωR, and is nothing for a bead that rolls; but a bead that rolls in a bridge
presses liquid in at the front and draws it out at the back. For liquid within a radius r_w on the wall, and a gap h,
the Reynolds equation gives a force of about (0.2 ln(r_w²/2Rh) - 0.33)(v + ωR) in units of 6πηR, and as much torque: a
rolling bead with a bridge of one per cent of its volume is dragged by 0.4 to 3 times 6πηR v at gaps from 10⁻² R to
10⁻⁵ R, one that is immersed by 3 to 5 times (Goldman, Cox, Brenner 1967). On a film of oil beads are seen to roll and
slide at once, their surfaces slower than they go (Bico et al. 2009). So a film of about one Stokes is what to expect
of a bead that rolls, and it acts where there is a bridge to the wall, or may be one.

References
----------
A. J. Goldman, R. G. Cox, H. Brenner, Chem. Eng. Sci. 22 (1967) 637-651.
J. Bico, J. Ashmore-Chakrabarty, G. H. McKinley, H. A. Stone, Phys. Fluids 21 (2009) 082103, doi 10.1063/1.3207884.
"""

from __future__ import annotations

from math import pi

from walkers.physics.capillary import rupture_distance_at_wall


def film_drag(film_viscosity: float, radius: float) -> float:
    """Coefficient of the drag that the film on a wall has on a bead's translation, 6πηR, N s/m.

    Parameters
    ----------
    film_viscosity, radius
        η in Pa s, R in m.
    """
    return 6.0 * pi * film_viscosity * radius


def film_thickness(radius: float, volume_fraction: float, contact_angle: float) -> float:
    """Gap up to which the film on a wall drags a bead, m: that at which a bridge to the wall breaks.

    Parameters
    ----------
    radius
        m.
    volume_fraction
        Liquid on a bead over the bead's volume.
    contact_angle
        Effective contact angle, rad.
    """
    return rupture_distance_at_wall(radius, volume_fraction, contact_angle)
