"""Fig. 1b: strobed top views of a walking dimer, 0.3 s apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from walkers.paper import dimers
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import ONE_COLUMN, letter_panels, new_figure, styled
from walkers.postprocess.series import top_view

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INTERVAL = 0.3
"""Seconds between the paper's images."""
_IMAGES = 6


@styled
def fig1b(sources: Sources) -> Figure:
    """The first walker of the alignment's dimers that start on the axis, seen from above."""
    table = sources.finished("alignment")
    asymmetric = table[~dimers.symmetric(table)]
    trajectory = sources.trajectory(asymmetric.sort_values("dimers.angle")["run"].iloc[0])
    case = trajectory.case
    strobe = case.run.samples_per_cycle
    apart = round(INTERVAL * case.drive.frequency) * strobe
    frames = [number * apart for number in range(_IMAGES) if number * apart < len(trajectory.time)]
    centre = trajectory.mass_centre[frames, 0] @ np.stack([trajectory.drive_axis, trajectory.across_axis], axis=-1)
    reach = 2.4 * float(trajectory.radii.max())
    along = (float(centre[:, 0].min()) - reach, float(centre[:, 0].max()) + reach)
    half = 1.15 * float(trajectory.radii.max())
    row = 0.97 * ONE_COLUMN * 2.0 * half / (along[1] - along[0]) + 0.22
    figure, axes = new_figure(ONE_COLUMN, len(frames) * row + 0.75, nrows=len(frames), sharex=True)
    for panel, frame, middle in zip(axes, frames, centre, strict=True):
        across = (float(middle[1]) - half, float(middle[1]) + half)
        picture = top_view(trajectory, 0, frame, along, across)
        origin = float(centre[0, 0])
        edges = [(along[0] - origin) * 1e3, (along[1] - origin) * 1e3, -half * 1e3, half * 1e3]
        panel.imshow(picture, extent=edges, interpolation="bilinear")
        panel.set(yticks=[], title=f"{trajectory.time[frame]:.1f} s")
        panel.axvline(0.0, color="white", lw=0.6, ls=":")
        panel.grid(visible=False)
    axes[-1].set_xlabel("along the shaking axis,\nfrom the mass centre at the start (mm)")
    letter_panels(axes)
    figure.suptitle(f"{dimers.described(case)}\nan image every {apart // strobe} cycles")
    return figure
