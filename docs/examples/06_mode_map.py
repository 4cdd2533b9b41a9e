"""
A map of modes
==============

Vary two quantities: the asymmetry of the beads and the dimensionless peak force. Walkers rest at a
weak drive and walk faster with more asymmetry.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import walkers

Path("runs").mkdir(exist_ok=True)
Path("runs/map.toml").write_text("""
case = "fig1b"

[set]
dimers.mean_radius = "0.25 mm"
dimers.replicates  = 2

[axes]
dimers.sin_delta = { linspace = [0.1, 0.4, 4] }
drive.gamma0     = { linspace = [0.03, 1.23, 7] }
""")
table = walkers.sweep("runs/map.toml").table()

# %%
# ``pivot`` of pandas makes a table with a row per asymmetry and a column per force.

velocity = table.pivot(index="dimers.sin_delta", columns="drive.gamma0", values="velocity")
figure, axes = plt.subplots(figsize=(7, 4))
colours = axes.pcolormesh(velocity.columns, velocity.index, 1e3 * velocity, shading="nearest")
lines = axes.contour(velocity.columns, velocity.index, 1e3 * velocity, levels=5, colors="white")
axes.clabel(lines, fmt="%g")
figure.colorbar(colours, label="velocity (mm/s)")
axes.set(xlabel=r"dimensionless peak force $\Gamma_0$", ylabel=r"asymmetry $\sin\,\delta$")
plt.show()
