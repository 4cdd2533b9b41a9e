"""
The gait of a walker
====================

Plot what each bead of the walker of Fig. 4b does in two cycles of the drive. Its contacts stay
closed: a negative gap is an overlap, which shows how the load moves between the contacts.
"""

import matplotlib.pyplot as plt

import walkers

run = walkers.run("fig4b")

# %%
# The table ``trajectory`` has one row per sample and walker. Take the last two cycles of the first
# walker:

walker = run.trajectory.query("walker == 0")
last = walker[walker["cycle"] >= walker["cycle"].max() - 2.0]

# %%
# Velocities above, gaps of the contacts below:

velocities = {
    "velocity": "mass centre, relative to the substrate",
    "rotation_1": "rotation of the large bead",
    "rotation_2": "rotation of the small bead",
}
contacts = {
    "gap_1": "large bead on substrate",
    "gap_2": "small bead on substrate",
    "gap_pair_1": "bead on bead",
}
figure, (upper, lower) = plt.subplots(2, sharex=True, figsize=(7, 6))
for column, label in velocities.items():
    upper.plot(last["cycle"], 1e3 * last[column], label=label)
for column, label in contacts.items():
    lower.plot(last["cycle"], 1e6 * last[column], label=label)
lower.axhline(0.0, color="0.5", lw=0.8)
upper.set(ylabel="velocity (mm/s)")
lower.set(xlabel="cycle", ylabel="gap (µm)")
upper.set_title("(a) velocities", loc="right")
lower.set_title("(b) gaps", loc="right")
for axes in (upper, lower):
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize="small", frameon=False
    )
plt.show()
