"""
The gait of a walker
====================

Plot what each bead of the walker of Fig. 4b does in two cycles of the drive. Its contacts stay closed: a negative gap
is an overlap, which shows how the load moves between the contacts.
"""

import matplotlib.pyplot as plt

import walkers

run = walkers.run("fig4b")

# %%
# The table ``trajectory`` has one row per sample and walker. Take the last two cycles of the first walker:

walker = run.trajectory.query("walker == 0")
cycles = walker[walker["cycle"] >= walker["cycle"].max() - 2.0]

figure, (speeds, gaps) = plt.subplots(2, sharex=True, figsize=(7, 6))
speeds.plot(
    cycles["cycle"], 1e3 * cycles["velocity"], "k", label="mass centre, relative to the substrate"
)
speeds.plot(cycles["cycle"], 1e3 * cycles["rotation_1"], "C0", label="rotation of the large bead")
speeds.plot(cycles["cycle"], 1e3 * cycles["rotation_2"], "C1", label="rotation of the small bead")
speeds.set(ylabel="velocity (mm/s)")
speeds.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize="small", frameon=False)
contacts = {
    "gap_1": "large bead on substrate",
    "gap_2": "small bead on substrate",
    "gap_pair_1": "bead on bead",
}
for column, name in contacts.items():
    gaps.plot(cycles["cycle"], 1e6 * cycles[column], label=name)
gaps.axhline(0.0, color="0.5", lw=0.8)
gaps.set(xlabel="cycle", ylabel="gap (µm)")
gaps.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize="small", frameon=False)
plt.show()
