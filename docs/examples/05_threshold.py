"""
The threshold of motion
=======================

Lower the drive until the walkers stop: in steps, at two frequencies, or in a single run, as
in the paper.
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
    peak_acceleration = steps["drive.peak_acceleration"]
    axes.plot(peak_acceleration, 1e3 * steps["velocity"], "o-", label=f"{frequency:g} Hz")
axes.set(xlabel="peak acceleration (g)", ylabel="velocity (mm/s)")
axes.legend()
plt.show()

# %%
# In a single run, the drive falls by a ramp. The result has the peak acceleration at which the
# walkers stop, and its uncertainty, the fall of the drive in eight cycles; both are in m/s².

falling_drive = {
    "drive.peak_acceleration": "1 g",
    "drive.ramp": [["0 s", 1], ["1 s", 0.3]],
    "dimers.replicates": 2,
}
run = walkers.run(walkers.load_case("fig1b", falling_drive))
stops_at = run.result["stops_at"] / 9.8
stops_within = run.result["stops_within"] / 9.8
print(f"they stop at {stops_at:.2f} g, within {stops_within:.2f} g")
