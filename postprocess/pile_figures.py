"""Figures of a pile: clusters that rise over its surface, what happens to them, segregation and agitation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.postprocess.drawing import new_figure, plain_text, save_figure, styled
from walkers.postprocess.pile_result import PileAnalysis, analyse

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLIMB_NAME = "climb.png"
_MARKS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""How events are marked (`walkers.postprocess.events`)."""


def plot_pile(directory: Path, destination: Path | None = None) -> list[Path]:
    """Draw what a pile did.

    Parameters
    ----------
    directory
        A run directory.
    destination
        Folder for the picture; the run directory itself if None.

    Returns
    -------
    list of Path
        ``climb.png``: heights of the clusters' leaders over the pile's surface against time with the events in their
        lives, the Brazil-nut index, the mean square velocity.
    """
    place = (destination or directory) / CLIMB_NAME
    return save_figure(_climb_figure(analyse(directory)), place, [directory.name])


@styled
def _climb_figure(found: PileAnalysis) -> Figure:
    figure, axes = new_figure(7.6, 6.4, mosaic=[["height"], ["height"], ["index"], ["agitation"]], sharex=True)
    time, case = found.motion.time, found.motion.case
    _heights(axes["height"], found)
    axes["index"].plot(time, [bed.brazil_nut for bed in found.beds], color="C0", label="all beads")
    axes["index"].plot(time, [bed.brazil_nut_of_bulk for bed in found.beds], "--", color="C2", label="bulk alone")
    axes["index"].set_ylabel("Brazil-nut\nindex")
    axes["index"].legend(fontsize=7)
    axes["agitation"].semilogy(time, [max(bed.mean_square_velocity, 1e-12) for bed in found.beds], color="C0")
    axes["agitation"].set(
        xlabel="time from the begin of the drive (s)", ylabel="mean square\nvelocity, strobed\n(m²/s²)"
    )
    figure.suptitle(
        f"{plain_text(case.title or case.name)}\n{sum(case.beads.counts)} beads, {case.drive.frequency:g} Hz, "
        f"{case.drive.peak_acceleration:.4g} m/s²",
        fontsize=10,
    )
    return figure


def _heights(axes: Axes, found: PileAnalysis) -> None:
    time, height = found.motion.time, found.motion.position[:, :, 2]
    low, middle, high = (
        np.array([getattr(bed, name) for bed in found.beds]) * 1e3
        for name in ("surface_low", "surface", "surface_high")
    )
    axes.fill_between(time, low, high, color="0.85", lw=0, label="surface, 10th to 90th percentile")
    axes.plot(time, middle, color="0.4", lw=1.0, label="surface, median")
    for track, climb in zip(found.tracks, found.climbs, strict=True):
        places = [frame for frame, members in zip(track.frames, track.members, strict=True) if climb.leader in members]
        leads = "large" if found.motion.large[climb.leader] else "small"
        colour, width = ("C2", 1.6) if climb.climbed else ("C1", 0.6)
        line = axes.plot(time[places], height[places, climb.leader] * 1e3, color=colour, lw=width)[0]
        if climb.climbed:
            told = f"climb led by a {leads} bead, {climb.size} beads: {climb.speed * 1e3:.1f} mm/s"
            line.set_label(told)
    _mark_events(axes, found)
    axes.set(ylabel="height (mm)")
    axes.legend(fontsize=7, loc="upper left", ncols=2)


def _mark_events(axes: Axes, found: PileAnalysis) -> None:
    """A mark where something happened to a cluster, at the height of its leader in the frame nearest to it."""
    for kind, marker in _MARKS.items():
        told = [event for event in found.events if event.kind == kind]
        if not told:
            continue
        frames = np.searchsorted(found.motion.time, [event.time for event in told])
        leaders = [found.climbs[event.track].leader for event in told]
        heights = found.motion.position[frames.astype(int), np.array(leaders, dtype=int), 2] * 1e3
        axes.plot([event.time for event in told], heights, marker, ms=4, color="0.3", mfc="none", lw=0, label=kind)
