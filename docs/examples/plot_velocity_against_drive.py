"""
Velocity against the drive
==========================

Fig. 1b's walker, shaken at 80 Hz from 1 to 9 g: the engine, and beside it the theory with Coulomb friction and the drag
of the bridges, computed in another way, into which nothing is fitted; and with friction alone.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import walkers
from walkers.theory.prediction import motion_of

# %%
# A sweep file, its runs (those that are missing) and its table.

Path("runs").mkdir(exist_ok=True)
file = Path("runs/drive.toml")
file.write_text("""
case = "fig1b"

[axes]
drive.peak_acceleration = { linspace = ["1 g", "9 g", 9] }
""")
table = walkers.sweep(file).table()
print(table[["drive.peak_acceleration", "gamma0", "velocity", "rotation_1", "steady"]].to_string(index=False))

# %%
# The theory takes cases, as the engine does; a sweep gives the case of each of its points.

points = [walkers.Run(Path(place)).case for place in table["run"]]
figure, axes = plt.subplots(figsize=(7, 4.5))
x, mean, low, high = (table[key] for key in ("drive.peak_acceleration", "velocity", "smallest", "largest"))
axes.errorbar(
    x, 1e3 * mean, 1e3 * np.array([mean - low, high - mean]), fmt="o", label="engine, mean and range of 6 walkers"
)
axes.plot(x, 1e3 * motion_of(*points).velocity, color="0.2", label="theory: Coulomb friction, resistance of bridges")
axes.plot(x, 1e3 * motion_of(*points, viscous=False).velocity, ":", color="0.5", label="theory: Coulomb friction alone")
axes.set(xlabel="peak acceleration (g)", ylabel="velocity (mm/s)", ylim=(0.0, 13.0))
axes.legend(loc="upper left")
plt.show()
