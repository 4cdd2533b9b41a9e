"""
A sweep: velocity against the drive
===================================

Vary the peak acceleration from 1 to 9 g. The lines are predictions of the theory; nothing in them
is fitted to the runs.
"""

from pathlib import Path

import walkers

Path("runs").mkdir(exist_ok=True)
Path("runs/drive.toml").write_text("""
title = "Velocity against the drive"
case  = "fig1b"

[axes]
drive.peak_acceleration = { linspace = ["1 g", "9 g", 9] }
""")
sweep = walkers.sweep("runs/drive.toml")
table = sweep.table()
print(table[["drive.peak_acceleration", "gamma0", "velocity", "steady"]].round(6))

# %%
# ``plot`` writes a figure of the table; ``figure`` returns it, so that you can change it.

sweep.plot("runs/drive.png", theory=True)
