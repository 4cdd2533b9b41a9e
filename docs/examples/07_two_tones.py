"""
Two tones move a symmetric dimer
================================

A dimer of two equal beads does not walk under one tone. A second tone at twice the frequency breaks
the symmetry of the drive. The direction depends on the phase between the tones.
"""

from pathlib import Path

import matplotlib.pyplot as plt

import walkers

Path("runs").mkdir(exist_ok=True)
Path("runs/two_tones_case.toml").write_text("""
[dimers]
radii      = ["0.25 mm", "0.25 mm"]
facing     = "right"
replicates = 2

[beads]
material = "ruby"

[liquid]
name = "Si AK5"

[boundary]
material = "chromium-coated glass"

[[drive.harmonics]]
frequency         = "80 Hz"
peak_acceleration = "4 g"

[[drive.harmonics]]
frequency         = "160 Hz"
peak_acceleration = "3 g"

[run]
cycles = 24
""")
Path("runs/two_tones.toml").write_text("""
case = "two_tones_case.toml"

[axes]
"drive.harmonics[1].phase" = { linspace = ["0 deg", "360 deg", 13] }
""")
table = walkers.sweep("runs/two_tones.toml").table()

# %%
# The velocity is positive in the direction that the walkers face.

phase = table["drive.harmonics[1].phase"]
figure, axes = plt.subplots(figsize=(7, 4))
axes.plot(phase, 1e3 * table["velocity"], "o-")
axes.axhline(0.0, color="0.5", lw=0.8)
axes.set(xlabel="phase of the second tone (°)", ylabel="velocity (mm/s)", xticks=range(0, 361, 90))
plt.show()
