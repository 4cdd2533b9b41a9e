"""
A pile in a box
===============

Pour 60 wet beads of two sizes into a box 4 mm wide and shake it vertically. This run is too short
for clusters to climb; ``pile-small`` is shaken until one has climbed.
"""

import matplotlib.pyplot as plt

import walkers

run = walkers.run("pile-ci")
print(run.describe())

# %%
# Views from the side, at equal time intervals:

run.render("runs/pile.png")

# %%
# The table ``bed`` has one row per frame.

bed = run.table("bed")
figure, axes = plt.subplots(figsize=(7, 4))
axes.plot(bed["time"], 1e3 * bed["surface"])
axes.axvline(0.0, color="0.5", lw=0.8)
axes.set(xlabel="time since the drive began (s)", ylabel="surface of the pile (mm)")
plt.show()
