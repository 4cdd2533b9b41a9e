"""
A film
======

Film a walker for four cycles of the drive, 50 times slower than in reality. The film shows how the
beads roll and how the substrate shakes.
"""

from IPython.display import Image

import walkers

run = walkers.run("fig4b")
film = run.film(
    "runs/walk.gif",
    size=(480, 240),  # pixels
    fps=20,
    slowdown=50.0,
    walker=0,
    begin=0.05,  # s
    end=0.1,
)
Image(film)

# %%
# A name that ends in ``.mp4`` gives an MP4 file.
