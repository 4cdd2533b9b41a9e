"""
The pull of a bridge, by the engine's law and by others
=======================================================

The engine pulls beads together by the Young–Laplace equation. Other laws are had by name, as by ``liquid.law`` of a
case. Here Soulié's formula :cite:p:`soulie2006`, the stock engine's, is drawn beside it for the bridges of Fig. 1b's
walker, up to the gap at which each says that the bridge breaks.
"""

from math import inf

import matplotlib.pyplot as plt
import numpy as np

import walkers
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import by_name

case = walkers.load_case("fig1b")
large, small = case.walkers[0].radii

# %%
# A plane is a sphere without curvature, of infinite radius. Soulié's law takes a wall for an equal sphere, twice.

pairs = {"large bead on the plane": (large, inf), "bead on bead": (large, small)}
figure, axes = plt.subplots(figsize=(7, 4.5))
for colour, (name, pair) in zip(("C0", "C1"), pairs.items(), strict=True):
    surfaces = Surfaces.of(*pair, case.liquid, case.contact.minimum_separation_ratio)
    for law, line in ((case.liquid.law, "-"), ("soulie", "--")):
        curve = by_name(law)(surfaces)
        gaps = np.linspace(0.0, curve.rupture, 200)
        pull = curve.forces(gaps).pull
        axes.plot(1e6 * gaps, 1e6 * pull, line, color=colour, label=f"{name}: {law}")
        axes.plot(1e6 * curve.rupture, 0.0, "|", color=colour, ms=14)
        print(f"{name}, {law}: {1e6 * pull[0]:.1f} µN at contact, breaks at {1e6 * curve.rupture:.0f} µm")
axes.set(xlabel="gap (µm)", ylabel="pull (µN)", ylim=(0.0, None))
axes.legend()
plt.show()

# %%
# How the laws of others compare, and what they do to walkers, is in the :doc:`/explanation/validation`.
