"""
The threshold of motion
=======================

Lower the drive in steps until the walkers stop, at two frequencies. This is the protocol of the paper.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import walkers

Path("runs").mkdir(exist_ok=True)
Path("runs/threshold.toml").write_text("""
case = "fig1b"

[set]
dimers.replicates = 2

[axes]
drive.frequency = ["60 Hz", "90 Hz"]

[descend]
key         = "drive.peak_acceleration"
from        = "1.6 g"
to          = "0.4 g"
step        = "0.2 g"
until_below = "0.002 mm/s"
""")
table = walkers.sweep("runs/threshold.toml").table()

# %%
# Each step is a run from rest.

figure, axes = plt.subplots(figsize=(7, 4))
for frequency, steps in table.groupby("drive.frequency"):
    axes.plot(steps["drive.peak_acceleration"], 1e3 * steps["velocity"], "o-", label=f"{frequency:g} Hz")
axes.set(xlabel="peak acceleration (g)", ylabel="velocity (mm/s)")
axes.legend()
plt.show()
