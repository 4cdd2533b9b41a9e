"""
The pull of a bridge, against the Young–Laplace equation
========================================================

The engine pulls beads together by Soulié's formula :cite:p:`soulie2006`, which was fitted to solutions of the
Young–Laplace equation. Here that equation is solved again, for the bridges of Fig. 1b's walker, and the formula drawn
beside it, up to the gap at which each says that the bridge breaks.
"""

from math import inf

import matplotlib.pyplot as plt
import numpy as np

import walkers
from walkers.physics.capillary import bridge_volume_at_wall, bridge_volume_between_beads
from walkers.physics.laplace import force_curve
from walkers.studies.bridge_laws import ENGINE

case = walkers.load_case("fig1b")
large, small = case.walkers[0].radii
liquid = case.liquid

# %%
# A plane is a sphere without curvature, of infinite radius. The engine takes a wall for an equal sphere, twice.

bridges = {
    "large bead on the plane": (large, inf, bridge_volume_at_wall(large, liquid.volume_fraction)),
    "bead on bead": (large, small, bridge_volume_between_beads(large, small, liquid.volume_fraction)),
}
figure, axes = plt.subplots(figsize=(7, 4.5))
for colour, (name, bridge) in zip(("C0", "C1"), bridges.items(), strict=True):
    exact = force_curve(*bridge, liquid.contact_angle)
    end = ENGINE.rupture(*bridge, liquid.contact_angle)
    gaps = np.linspace(0.0, end, 200)
    formula = ENGINE.force(*bridge, liquid.contact_angle, gaps)
    pull = 1e6 * liquid.surface_tension
    axes.plot(1e6 * exact.gaps, pull * exact.forces, color=colour, label=f"{name}: Young–Laplace")
    axes.plot(1e6 * gaps, pull * formula, "--", color=colour, label=f"{name}: the engine's formula")
    axes.plot(1e6 * np.array([end, exact.rupture]), [0.0, 0.0], "|", color=colour, ms=14)
    print(
        f"{name}: {formula[0] / exact.forces[0]:.3f} of it at contact, {end / exact.rupture:.3f} of its gap at rupture"
    )
axes.set(xlabel="gap (µm)", ylabel="pull (µN)", ylim=(0.0, None))
axes.legend()
plt.show()

# %%
# How the laws of others compare, and what the difference does to walkers, is in the :doc:`/explanation/validation`.
