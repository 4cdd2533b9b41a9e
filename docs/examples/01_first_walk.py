"""
A first walk
============

Run the walker of Fig. 1b of the paper, print its velocity, and look at it.
"""

import walkers

run = walkers.run("fig1b")
print(run.describe())

# %%
# A picture of one walker at three times. The grid is fixed to the substrate.

run.render("runs/first_walk.png", images=3)

# %%
# The tables of a run are pandas data frames in SI units.

print(run.walkers[["walker", "facing", "velocity", "steady"]].round(6))
