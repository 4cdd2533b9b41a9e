"""
A cluster climbs a wall
=======================

A cluster has a large bead above two small ones side by side, and one more small bead below. It is
on a vertical wall that is shaken vertically. Six such clusters start up to 10° off the vertical.
All of them turn upright and climb.
"""

import matplotlib.pyplot as plt
import numpy as np

import walkers

run = walkers.run("climber")
print(run.describe())

# %%
# Plot the angle from the vertical (logarithmic scale) and the height, once per cycle.

samples = run.case.run.samples_per_cycle
figure, (angles, heights) = plt.subplots(1, 2, figsize=(9, 4))
for _, climber in run.trajectory.groupby("walker"):
    once_per_cycle = climber.iloc[::samples]
    time = once_per_cycle["time"]
    angle = np.degrees(once_per_cycle["orientation"].abs())
    height = once_per_cycle["x"] - once_per_cycle["x"].iloc[0]
    angles.semilogy(time, angle)
    heights.plot(time, 1e3 * height)
angles.set(xlabel="time (s)", ylabel="angle from the vertical (°)", ylim=(1e-4, 20.0))
heights.set(xlabel="time (s)", ylabel="height climbed (mm)")
angles.set_title("(a)", loc="left")
heights.set_title("(b)", loc="left")
plt.show()

# %%
# The pictures show the first cluster at six times.

run.render("runs/climber.png")
