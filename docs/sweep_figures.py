"""Figures of sweeps in the documentation that `walkers plot` does not draw in this form."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from walkers.inputs.tables.case import Case
from walkers.postprocess.show.drawing import (
    TWO_COLUMNS,
    letter_panels,
    new_figure,
    ordered_colours,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UPRIGHT = (
    ("all upright", "full"),
    ("some upright", "left"),
    ("none upright", "none"),
)
"""Clusters by how many of their walkers stay upright, and how their symbols are filled."""
_FASTEST_SLIDE = 10.0
"""Largest velocity downward in figures of the onset of climbing, mm/s."""
_DRAWING = 0.4
"""Height of the drawings of clusters below the axes, over the height of the axes."""
_HALF_CELL = 1.0
"""Half of the width that a drawing has, mm."""
_DODGE = 0.12
"""Distance of the symbols of trays of different sizes, g."""


def upright_groups(table: pd.DataFrame) -> list[int]:
    """The group of `UPRIGHT` of each point of a sweep of clusters."""
    groups = []
    for upright, walkers in zip(table["upright"], table["walkers"], strict=True):
        if upright == walkers:
            groups.append(0)
        else:
            groups.append(1 if upright > 0 else 2)
    return groups


@styled
def clusters_figure(
    table: pd.DataFrame, cases: Sequence[Case], scatter: Sequence[float], wall: str
) -> Figure:
    """Velocities of clusters up a wall or a corner, above drawings of the clusters.

    Parameters
    ----------
    table
        The finished points of a sweep of clusters.
    cases
        Their cases.
    scatter
        Standard deviations of their velocities, m/s.
    wall
        What the clusters climb.

    Notes
    -----
    Clusters that stay upright come first; in each group the fastest is on the left.
    """
    velocity = 1e3 * table["axial_velocity"].to_numpy(dtype=float)
    groups = upright_groups(table)
    order = sorted(range(len(table)), key=lambda point: (groups[point], -velocity[point]))
    figure = new_figure(TWO_COLUMNS, 3.5)
    axes = figure.subplots()
    axes.axhline(0.0, color="0.4", lw=0.6)
    errors = 1e3 * np.array(scatter)
    for group, (label, fill) in enumerate(UPRIGHT):
        places = [place for place, point in enumerate(order) if groups[point] == group]
        points = [order[place] for place in places]
        if not points:
            continue
        axes.errorbar(
            places,
            velocity[points],
            yerr=errors[points],
            fmt="ko",
            fillstyle=fill,
            markerfacecoloralt="white",
            markersize=6.0,
            elinewidth=0.9,
            capsize=0,
            label=label,
        )
    _draw_clusters(axes, [cases[point] for point in order])
    axes.set(ylabel=f"velocity up the {wall} (mm/s)", xlim=(-0.6, len(order) - 0.4), xticks=[])
    axes.set_xlabel("clusters as they start; bars: standard deviation of six copies", labelpad=72.0)
    figure.legend(loc="outside lower center", ncols=len(UPRIGHT))
    return figure


def _draw_clusters(axes: Axes, cases: Sequence[Case]) -> None:
    """Draw the beads of clusters to scale below the axes, the direction that they face up."""
    shapes = []
    for case in cases:
        kind = case.walkers[0]
        ahead, aside = np.array(kind.design).T * 1e3  # mm
        shapes.append((aside, ahead, np.array(kind.radii) * 1e3))
    half_height = max(float(np.ptp(ahead) / 2.0 + radii.max()) for _, ahead, radii in shapes)
    width = 1.0 / (len(cases) + 0.2)
    for number, (aside, ahead, radii) in enumerate(shapes):
        left = (number + 0.1) * width
        drawing = axes.inset_axes((left, -0.04 - _DRAWING, width, _DRAWING))
        for x, y, radius in zip(aside - aside.mean(), ahead, radii, strict=True):
            drawing.add_patch(Circle((x, y), radius, fc="0.85", ec="0.3", lw=0.6, clip_on=False))
        top = float((ahead + radii).max())
        drawing.set(
            aspect="equal", ylim=(top - 2.0 * half_height, top), xlim=(-_HALF_CELL, _HALF_CELL)
        )
        drawing.set_anchor("N")
        drawing.set_axis_off()


@styled
def onset_figure(figure: Figure) -> Figure:
    """Show the onset of climbing in a figure of velocities against friction; others are cut off."""
    panels = [axes for axes in figure.axes if axes.axison]
    fastest = 0.0
    for axes in panels:
        for line in axes.lines:
            fastest = max(fastest, float(np.nanmax(np.asarray(line.get_ydata(), dtype=float))))
    panels[0].set_ylim(-_FASTEST_SLIDE, 1.08 * fastest)
    for axes in panels:
        axes.set_ylabel("velocity up the wall\n(mm/s)" if axes.get_ylabel() else "")
        axes.axhline(0.0, color="0.4", lw=0.8)
    figure.suptitle(
        f"{figure.get_suptitle()}\nvelocities below −{_FASTEST_SLIDE:g} mm/s are not shown"
    )
    return figure


@styled
def trays_figure(table: pd.DataFrame) -> Figure:
    """Shares of walkers in clusters: means over seeds, and from the smallest to the largest."""
    coverages = sorted(table["coverage"].round(2).unique())
    sizes = sorted(table["walkers"].unique())
    figure = new_figure(TWO_COLUMNS, 2.6)
    panels = figure.subplots(ncols=len(coverages), sharey=True, squeeze=False)[0]
    colours = ordered_colours(len(sizes))
    for axes, coverage in zip(panels, coverages, strict=True):
        in_panel = table[table["coverage"].round(2) == coverage]
        for number, size in enumerate(sizes):
            trays = in_panel[in_panel["walkers"] == size]
            shares = trays.groupby("drive.peak_acceleration")["clustered_share"]
            mean = shares.mean()
            axes.errorbar(
                mean.index + _DODGE * (number - 1),
                mean,
                [mean - shares.min(), shares.max() - mean],
                fmt="osD"[number],
                color=colours[number],
                ls="-",
                lw=0.7,
                elinewidth=1.0,
                capsize=2,
                label=f"{size:g}",
            )
        axes.set(title=f"coverage {coverage:g}", xticks=(1, 2, 4, 8), ylim=(-0.03, 1.03))
        axes.set_xlabel("peak acceleration (g)")
    panels[0].set_ylabel("share of walkers in clusters")
    letter_panels(panels)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="outside lower center",
        ncols=len(sizes),
        title="walkers; symbols: means of three seeds, bars: smallest to largest",
    )
    return figure
