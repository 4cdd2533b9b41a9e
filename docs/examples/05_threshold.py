"""
The threshold of motion
=======================

Lower the drive in steps until the walkers stop, at two frequencies; or in one run, as in the paper.
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
    axes.plot(
        steps["drive.peak_acceleration"], 1e3 * steps["velocity"], "o-", label=f"{frequency:g} Hz"
    )
axes.set(xlabel="peak acceleration (g)", ylabel="velocity (mm/s)")
axes.legend()
plt.show()

# %%
# In one run the drive falls by a ramp. The result has the drive at which the walkers stop; it is as exact as the drive
# changes in eight cycles.

falling = {
    "drive.peak_acceleration": "1.2 g",
    "drive.ramp": [["0 s", 1], ["1 s", 0.5]],
    "dimers.replicates": 2,
}
result = walkers.run(walkers.load_case("fig1b", falling)).result
print(f"they stop at {result['stops_at'] / 9.8:.2f} g, within {result['stops_within'] / 9.8:.2f} g")
