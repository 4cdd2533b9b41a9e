"""
Velocity against asymmetry: Fig. 3
==================================

Run the six pairs of beads of Fig. 3 of the paper, each at the same dimensionless peak force. A
symmetric dimer does not walk.
"""

import walkers

sweep = walkers.sweep("fig3")
table = sweep.table()
shown = 1e3 * table[["radius_1", "radius_2", "velocity"]]  # mm, mm/s
shown["sin_delta"] = table["sin_delta"]
print(shown.to_string(index=False))

# %%
# The lines are the theory, and the formula that the paper fits to its measurements.

sweep.plot("runs/fig3.png", x="sin_delta", theory=True)
