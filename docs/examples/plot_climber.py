"""
A climber comes upright
=======================

A large bead above two small ones side by side, with one more below, on a wall that is shaken vertically. Six of them
begin up to 10° off the vertical. A dimer would turn over; these touch the wall on triangles, come upright and climb.
"""

import matplotlib.pyplot as plt
import numpy as np

import walkers

run = walkers.run("climber")
print(run.describe())

# %%
# Their angles from the vertical, on a logarithmic scale, and how high they have come, once a cycle.

samples = run.case.run.samples_per_cycle
figure, (angles, heights) = plt.subplots(1, 2, figsize=(9, 4))
for _, climber in run.trajectory.groupby("walker"):
    strobed = climber.iloc[::samples]
    angles.semilogy(strobed["time"], np.degrees(np.abs(strobed["orientation"])))
    heights.plot(strobed["time"], 1e3 * (strobed["x"] - strobed["x"].iloc[0]))
angles.set(xlabel="time (s)", ylabel="angle from the vertical (°)", ylim=(1e-4, 20.0))
heights.set(xlabel="time (s)", ylabel="height climbed (mm)")
figure.tight_layout()
plt.show()
