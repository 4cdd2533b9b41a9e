"""Figures of a run (matplotlib): where walkers went and turned, their gait; what clusters rose over a pile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.postprocess.drawing import (
    TWO_COLUMNS,
    letter_panels,
    new_figure,
    plain_text,
    series_look,
    styled,
)
from walkers.postprocess.motion import Group
from walkers.postprocess.panels import MOST_NAMED, Panel, gait_panels, pile_panels, walk_panels
from walkers.postprocess.tables import Columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def walk_figures(groups: list[Group]) -> dict[str, Figure]:
    """The figures of the walkers of a run.

    Returns
    -------
    dict
        ``walk``, strobed positions, distance walked and orientation against time; and, if the run was sampled at least
        eight times a cycle, ``gait``, velocity and rotation velocities through two cycles, as in Fig. 4 of Khan et al.,
        and the substrate's velocity.
    """
    panels = gait_panels(groups[0])
    return {"walk": _walk_figure(groups), **({"gait": _gait_figure(groups[0], panels)} if panels else {})}


def _draw(axes: Axes, panel: Panel) -> None:
    """A panel without its title and what is below it; lines with a number of many are marked to be told apart."""
    for line in panel.lines:
        look: dict[str, Any] = {"color": line.colour, "lw": line.width, "ls": "--" if line.dashed else "-"}
        if isinstance(line.colour, int):
            look["color"] = f"C{line.colour}"
        if line.marker:
            look |= {"marker": line.marker, "mfc": "none"}
        axes.plot(line.x, line.y, label=line.label or None, **look)
    if panel.band:
        low, high = panel.band
        axes.fill_between(low.x, low.y, high.y, color="0.85", lw=0, label=low.label, zorder=0)
    if panel.settled:
        axes.axvspan(0.0, panel.settled, color="0.93", zorder=0)
    if panel.log:
        axes.set_yscale("log")
    axes.set_ylabel(panel.y)


def _title(case: Case) -> str:
    makes = [" / ".join(f"{radius * 1e3:g}" for radius in make.radii) for make in case.walkers]
    gamma0 = ""
    if len(case.walkers[0].radii) == 2:
        gamma0 = f" ($\\Gamma_0$ = {dimer_of(case).gamma0(case.drive.peak_acceleration):.3g})"
    return f"{plain_text(case.title or case.name)}\nR = {'; '.join(makes)} mm, {case.drive.described()}{gamma0}"


@styled
def _walk_figure(groups: list[Group]) -> Figure:
    rows = [["strobe", "walked"], ["strobe", "turned"]]
    figure, axes = new_figure(TWO_COLUMNS, 5.2, mosaic=rows, width_ratios=[1, 1.6])
    figure.suptitle(_title(groups[0].case))
    _draw_strobe(axes["strobe"], groups[0])
    for name, panel in zip(("walked", "turned"), walk_panels(groups), strict=False):
        _draw(axes[name], panel)
        axes[name].set_xlabel(panel.x)
        for number, line in enumerate(axes[name].lines):
            # Marks of walkers that do the same stand beside each other.
            line.set(**series_look(number), markevery=(number % 6, 6), linewidth=0.9)
    axes["walked"].set_title("grey: settling")
    letter_panels(axes.values())
    more = " (the first 12)" if sum(len(group.walkers) for group in groups) > MOST_NAMED else ""
    handles = axes["walked"].get_legend_handles_labels()
    title = f"walker: facing at the start, velocity{more}"
    figure.legend(*handles, loc="outside lower center", ncols=4, title=title)
    return figure


def _draw_strobe(axes: Axes, group: Group) -> None:
    """The first walker from above, its beads to scale, at eight times (as in Fig. 1b of the paper).

    Rows are even: the way along the drive axis and the orientation are shown, not the drift across the axis.
    """
    from matplotlib.patches import Circle

    strobe = group.case.run.samples_per_cycle
    ground = np.stack([group.drive_axis, group.across_axis], axis=-1)
    position = group.position[::strobe, 0] @ ground * 1e3
    radii = group.radii * 1e3
    middle = position.mean(axis=1)
    shown = np.unique(np.linspace(0, len(position) - 1, 8).round().astype(int))
    extent = max(float(np.ptp(position[..., 1], axis=1).max()), 0.6 * float(radii.max()))
    pitch = 2.0 * float(radii.max()) + extent
    ends = []
    for row, frame in enumerate(shown):
        for bead in range(len(radii)):
            along = float(position[frame, bead, 0] - middle[0, 0])
            across = float(position[frame, bead, 1] - middle[frame, 1]) - row * pitch
            size = float(radii[bead])
            axes.add_patch(Circle((along, across), size, fc="0.45" if bead == 0 else "0.75", ec="0.2", lw=0.6))
            ends += [along - size, along + size]
        seconds = f"{group.time[frame * strobe]:.2f} s"
        place = (1.01, -row * pitch)
        axes.annotate(seconds, place, xycoords=("axes fraction", "data"), fontsize=7, va="center")
    axes.set(xlim=(min(ends) - radii.max(), max(ends) + radii.max()), ylim=(-pitch * (len(shown) - 0.4), 0.6 * pitch))
    axes.set_aspect("equal")
    axes.set(xlabel="along the drive axis (mm)", yticks=[], title="walker 0, time downward")
    axes.grid(visible=False)


@styled
def _gait_figure(group: Group, panels: Sequence[Panel]) -> Figure:
    ratios = [2.5, 1.0][: len(panels)]
    figure, axes = new_figure(
        TWO_COLUMNS, 3.0 + 1.3 * len(panels), nrows=len(panels), height_ratios=ratios, sharex=True, squeeze=False
    )
    figure.suptitle(_title(group.case))
    for one, panel in zip(axes[:, 0], panels, strict=True):
        _draw(one, panel)
        one.axhline(0.0, color="0.4", lw=0.6)
        one.set_title(panel.title)
    if len(panels) > 1:
        letter_panels(axes[:, 0])
    axes[-1, 0].set_xlabel(panels[-1].x)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), ncols=4, loc="outside lower center")
    return figure


@styled
def climb_figure(case: Case, tables: Mapping[str, Columns]) -> Figure:
    """What a pile did: `walkers.postprocess.panels.pile_panels`, one below the other."""
    panels = pile_panels(tables)
    figure, axes = new_figure(TWO_COLUMNS, 8.0, nrows=len(panels), height_ratios=[2, 1, 1, 1], sharex=True)
    for one, panel in zip(axes, panels, strict=True):
        _draw(one, panel)
        if any(line.label for line in panel.lines):
            one.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
    axes[2].set_ylim(0.0, None)
    axes[-1].set_xlabel(panels[-1].x)
    letter_panels(axes)
    figure.align_ylabels()
    figure.suptitle(f"{plain_text(case.title or case.name)}\n{case.count} beads, {case.drive.described()}")
    return figure
