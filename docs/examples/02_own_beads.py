"""
Your own beads and liquid
=========================

Write a case for steel beads in a water-glycerol mixture on glass. The case gives every number that
the library does not have.
"""

from pathlib import Path

import walkers

Path("runs").mkdir(exist_ok=True)
file = Path("runs/steel.toml")
file.write_text("""
title = "Steel beads in water-glycerol on glass"

[dimers]
radii = ["0.5 mm", "0.4 mm"]

[beads]
density = "7.8 g/cm^3"

[liquid]
surface_tension   = "68 mN/m"
density           = "1.13 g/cm^3"
dynamic_viscosity = "6 mPa*s"
volume_fraction   = 0.02

[boundary]
material = "soda-lime glass"

[contact]
friction         = { bead_bead = 0.2, bead_wall = 0.3 }
roughness        = { bead_bead = "50 nm", bead_wall = "50 nm" }
rolling_friction = 0.003

[drive]
frequency = "60 Hz"
gamma0    = 0.5
""")
run = walkers.run(file)
print(run.describe())

# %%
# The result lists the values that have not been measured: here friction, roughness and the liquid.
# See :doc:`/how-to/own-beads` for the uncertainty that these values cause.

run.render("runs/steel.png", images=3)

# %%
# Change a value without editing the file:

smoother = walkers.run(walkers.load_case(file, {"contact.friction.bead_wall": 0.15}))
print(f"{1e3 * smoother.result['velocity']:.2f} mm/s with half of the friction")
