"""
Shake as your own shaker does
=============================

Drive walkers by the acceleration that a sensor on the plate has recorded: here two tones of a
shaker, with noise and the offset of the sensor.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import walkers

time = np.arange(0.0, 0.4, 1e-4)  # s
first_tone = -4.0 * np.sin(2 * np.pi * 80.0 * time)  # g
second_tone = -1.0 * np.sin(2 * np.pi * 160.0 * time + 1.0)
offset = 0.05
noise = np.random.default_rng(1).normal(scale=0.05, size=len(time))
acceleration = first_tone + second_tone + offset + noise

Path("runs").mkdir(exist_ok=True)
table = np.column_stack([1e3 * time, acceleration])
header = "time (ms), x (g)"
np.savetxt("runs/trace.csv", table, "%.4f", delimiter=", ", header=header, comments="")

run = walkers.run(walkers.load_case("fig1b", {"drive.record": "runs/trace.csv"}))
print(run)

# %%
# A cycle is the period of the strongest tone. Plot the distance of each walker once per cycle.

figure, axes = plt.subplots(figsize=(7, 4))
for walker, cycles in run.table("cycles").groupby("walker"):
    axes.plot(cycles["time"], 1e3 * cycles["distance"], label=f"walker {walker}")
axes.set(xlabel="time (s)", ylabel="distance along the heading (mm)")
axes.legend()
plt.show()
