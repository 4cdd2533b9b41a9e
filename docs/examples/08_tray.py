"""
A tray of walkers that meet
===========================

Place nine walkers close to each other. They meet and stick together in pairs.
"""

import walkers

run = walkers.run("tray")
print(run.describe())

# %%
# Views from above, at equal time intervals:

run.render("runs/tray.png")

# %%
# The table ``meetings`` lists who merged with whom, and when.

print(run.table("meetings").head(8).to_string(index=False))
