"""
A walker in a groove
====================

Put the walker of Fig. 1b into a V-shaped groove and vary the opening angle. Each bead then touches
two walls.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import walkers

Path("runs").mkdir(exist_ok=True)
Path("runs/groove.toml").write_text("""
case = "fig1b"

[set]
boundary.shape    = "groove"
dimers.replicates = 2

[axes]
boundary.opening = { linspace = ["90 deg", "170 deg", 9] }
""")
sweep = walkers.sweep("runs/groove.toml")
table = sweep.table()

figure, axes = plt.subplots(figsize=(7, 4))
axes.plot(table["boundary.opening"], 1e3 * table["velocity"], "o-")
axes.set(xlabel="opening of the groove (°)", ylabel="velocity (mm/s)")
plt.show()

# %%
# The picture shows the narrowest groove, the first point of the sweep.

sweep.runs[0].render("runs/groove.png", images=3)
