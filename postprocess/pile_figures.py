"""Figures of a pile: clusters that rise over its surface, segregation and agitation; the box seen from the side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from postprocess.drawing import new_figure, save_figure
from postprocess.pile_result import PileAnalysis, analyse
from postprocess.rendering import side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CLIMB_NAME = "climb.png"
SERIES_NAME = "series.png"
_SHOWN = 6
"""Pictures in a time series."""


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
        ``climb.png``: heights of the clusters' leaders over the pile's surface against time, the Brazil-nut index, the
        mean square velocity.
    """
    place = (destination or directory) / CLIMB_NAME
    return save_figure(_climb_figure(analyse(directory)), place, [directory.name])


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
        f"{case.title or case.name}\n{sum(case.beads.counts)} beads, {case.drive.frequency:g} Hz, "
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
    axes.set(ylabel="height (mm)")
    axes.legend(fontsize=7, loc="upper left")


def render_series(directory: Path, destination: Path | None = None, *, images: int = _SHOWN) -> list[Path]:
    """Side views of the box beside each other, evenly through the drive, climbers coloured, as in Fig. 1a.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The PNG to write; ``series.png`` in the run directory if None.
    images
        How many.
    """
    place = destination or directory / SERIES_NAME
    found = analyse(directory)
    motion = found.motion
    start = int(np.searchsorted(motion.time, 0.0))
    frames = np.unique(np.linspace(start, len(motion.time) - 1, images).round().astype(int))
    top = 1.05 * float((motion.position[start:, :, 2] + motion.radius).max())
    width = motion.case.container.width
    across = max(0.8, 4.0 * width / top + 0.3)  # inches a picture, which is four inches high
    figure, axes = new_figure(1.0 + across * len(frames), 5.0, ncols=len(frames), sharey=True)
    for panel, frame in zip(np.atleast_1d(axes), frames, strict=True):
        picture = side_view(motion, frame, _climbers(found, int(frame)), top)
        panel.imshow(picture, extent=(-width * 500.0, width * 500.0, 0.0, top * 1e3), interpolation="bilinear")
        panel.set(title=f"{motion.time[frame]:.2f} s", xlabel="x (mm)")
        panel.title.set_fontsize(8)
        panel.grid(visible=False)
    np.atleast_1d(axes)[0].set_ylabel("height (mm)")
    return save_figure(figure, place, [directory.name])


def _climbers(found: PileAnalysis, frame: int) -> set[int]:
    """Beads of the clusters that climb and are free in a frame."""
    return {
        bead
        for track, climb in zip(found.tracks, found.climbs, strict=True)
        if climb.climbed
        for bead in track.members_at(frame)
    }
