"""
A zoo of clusters
=================

Run clusters of one large bead and several small ones on a level substrate, and compare their
velocities.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import walkers

CASE = """
[[clusters]]
arrangement = "{arrangement}"
radii       = [{radii}]
facing      = "right"
replicates  = 2

[beads]
material = "ruby"

[liquid]
name = "Si AK5"

[boundary]
material = "chromium-coated glass"

[drive]
frequency         = "80 Hz"
peak_acceleration = "4 g"

[run]
cycles = 40
"""
ZOO = [("chain", 2), ("chain", 3), ("fan", 3), ("fan", 4), ("diamond", 4), ("ring", 5)]

# %%
# The first bead of each cluster is the large one; it leads. Draw the beads at the end of each run.

Path("runs").mkdir(exist_ok=True)
figure, panels = plt.subplots(2, 3, figsize=(7.5, 5.5))
for panel, (arrangement, number) in zip(panels.flat, ZOO, strict=True):
    small_beads = ['"0.2 mm"'] * (number - 1)
    radii = ", ".join(['"0.3 mm"', *small_beads])
    file = Path(f"runs/{arrangement}_of_{number}.toml")
    file.write_text(CASE.format(arrangement=arrangement, radii=radii))
    run = walkers.run(file)

    # The beads of the first cluster in the last frame, in mm from their centre.
    centres = 1e3 * run.motion.position[-1, :number, :2]
    centres = centres - centres.mean(axis=0)
    for centre, radius in zip(centres, 1e3 * run.motion.radius[:number], strict=True):
        panel.add_patch(plt.Circle(centre, radius, facecolor="0.85", edgecolor="0.3"))
    velocity = 1e3 * run.result["velocity"]
    panel.set_title(f"{arrangement} of {number}\n{velocity:.2f} mm/s")
    panel.set(xlim=(-0.9, 0.9), ylim=(-0.8, 0.8), aspect="equal")
    panel.set_axis_off()
plt.show()
