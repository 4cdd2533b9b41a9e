"""
Velocity against asymmetry: Fig. 3
==================================

The paper's pairs of beads, each driven with the same dimensionless peak force: the engine and the theory beside the
published values. A symmetric dimer does not walk.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import walkers
from walkers.paper.published import FIG3_FIT
from walkers.theory.prediction import motion_of

table = walkers.sweep("fig3").table()
print((1e3 * table[["radius_1", "radius_2", "velocity"]]).assign(sin_delta=table["sin_delta"]).to_string(index=False))

# %%
# The theory for the same beads: Coulomb friction, drag of the bridges.

points = [walkers.Run(Path(place)).case for place in table["run"]]
figure, axes = plt.subplots(figsize=(7, 4.5))
published = [((r1 - r2) / (r1 + r2), 1e3 * v) for (r1, r2), v in FIG3_FIT.items()]
axes.plot(*np.transpose(published), "*", color="0.5", ms=12, label="published")
mean, low, high = (1e3 * table[key] for key in ("velocity", "smallest", "largest"))
axes.errorbar(table["sin_delta"], mean, [mean - low, high - mean], fmt="s", color="C2", label="engine, mean and range")
axes.plot(table["sin_delta"], 1e3 * motion_of(*points).velocity, "x", color="0.1", label="theory, these beads")
axes.set(xlabel=r"asymmetry $\sin\delta = (R_1 - R_2)/(R_1 + R_2)$", ylabel="velocity (mm/s)")
axes.legend()
plt.show()

# %%
# At the largest asymmetry the engine stays below the published value, which no set of parameters gives together with
# the rest: :doc:`/explanation/calibration`.
