"""
A cluster climbs a wall
=======================

A large bead above two small ones side by side, with one more below, stands on a vertical wall that is shaken
vertically. Six such clusters start up to 10° off the vertical. All of them turn upright and climb.
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
    strobed = climber.iloc[::samples]
    angles.semilogy(strobed["time"], np.degrees(np.abs(strobed["orientation"])))
    heights.plot(strobed["time"], 1e3 * (strobed["x"] - strobed["x"].iloc[0]))
angles.set(xlabel="time (s)", ylabel="angle from the vertical (°)", ylim=(1e-4, 20.0))
heights.set(xlabel="time (s)", ylabel="height climbed (mm)")
figure.tight_layout()
plt.show()

# %%
run.render("runs/climber.png")
