"""
A bridge law of your own
========================

Write the law of the capillary bridges as a Python function, and run a walker with it. Here the
capillary force is constant up to the gap at which the bridge breaks.
"""

from pathlib import Path

import walkers

Path("runs").mkdir(exist_ok=True)
Path("runs/constant.py").write_text("""
import numpy as np
from walkers.physics.bridge import Curve, Forces


def law(surfaces):
    def forces(gaps):  # m, shape (n,)
        one = np.ones_like(gaps)
        return Forces(
            pull=4e-5 * one,  # N
            normal=3e-3 * one,  # N s/m
            sliding=1e-3 * one,  # N s/m
            coupling=0.0 * one,  # N s
            rolling=0.0 * one,  # N m s
        )

    return Curve(forces, rupture=0.3 * surfaces.radius)
""")
run = walkers.run(walkers.load_case("fig1b", {"liquid.law": "runs/constant.py:law"}))
print(run.describe())

# %%
# Compare it with other laws of the program. ``walkers.sweep`` runs them all.

Path("runs/laws.toml").write_text("""
case = "fig1b"

[axes]
liquid.law = ["young-laplace", "willett", "rabinovich", "soulie"]
""")
sweep = walkers.sweep("runs/laws.toml")
print(f"constant: {1e3 * run.result['velocity']:.2f} mm/s")
velocities = 1e3 * sweep.table().set_index("liquid.law")["velocity"]
print(velocities.round(2).to_string())

# %%
# The figure of the sweep has a point for each law.

sweep.plot("runs/laws.png")
