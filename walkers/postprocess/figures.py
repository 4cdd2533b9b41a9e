"""Figures of a run (matplotlib): where walkers went and turned, their gait; what clusters rose over a pile."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.postprocess.drawing import (
    TWO_COLUMNS,
    letter_panels,
    new_figure,
    plain_text,
    save_figure,
    series_look,
    styled,
)
from walkers.postprocess.gait import averages, distance_walked, gait, walk
from walkers.postprocess.motion import Group, read_motion
from walkers.postprocess.piles import PileAnalysis, analyse
from walkers.postprocess.posture import ways
from walkers.postprocess.slopes import fit_slopes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_NAMED = 12
"""Walkers, or climbs, that a legend names."""
_MARKS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""How events are marked (`walkers.postprocess.events`)."""
_FEWEST_SAMPLES = 8
"""Samples a cycle below which a gait shows nothing."""


def plot_walkers(directory: Path, destination: Path, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Draw the walkers of a run.

    Parameters
    ----------
    directory
        The run directory.
    destination
        Folder for the pictures.
    formats
        Of `walkers.postprocess.drawing.FORMATS`.

    Returns
    -------
    list of Path
        ``walk`` (strobed positions, distance walked and orientation against time) and, if the run was sampled at least
        eight times a cycle, ``gait`` (velocity and rotation velocities through two cycles, as in Fig. 4 of Khan et
        al., and the substrate's velocity), in each format.
    """
    groups = read_motion(directory).groups
    written = save_figure(_walk_figure(groups), destination / "walk", [directory.name], formats)
    samples = groups[0].case.run.samples_per_cycle
    if samples >= _FEWEST_SAMPLES and len(groups[0].time) > 2 * samples:
        written += save_figure(_gait_figure(groups[0]), destination / "gait", [directory.name], formats)
    return written


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
    walked, turned = axes["walked"], axes["turned"]
    figure.suptitle(_title(groups[0].case))
    _draw_strobe(axes["strobe"], groups[0])
    run, facing = groups[0].case.run, ways(uphill=groups[0].case.goes_uphill)
    for group in groups:
        time, distance = distance_walked(group)
        slope, _ = fit_slopes(time[run.settled_strobes :], distance[run.settled_strobes :])
        for place, walker in enumerate(group.walkers):
            number = walker.walker
            # Marks of walkers that do the same stand beside each other.
            look = series_look(number) | {"markevery": (number % 6, 6), "linewidth": 0.9}
            told = f"{number}: {facing[int(walker.facing < 0)]}, {slope[place] * 1e3:.3g} mm/s"
            label = told if number < _MOST_NAMED else None
            walked.plot(time, distance[:, place] * 1e3, label=label, **look)
            turned.plot(time, np.degrees(group.orientation[:: run.samples_per_cycle, place]), **look)
    for panel in (walked, turned):
        panel.axvspan(0.0, time[run.settled_strobes], color="0.93", zorder=0)
        panel.set_xlabel("time (s)")
    walked.set(ylabel="distance walked (mm)", title="grey: settling")
    turned.set(ylabel=r"orientation $\psi$ (°)")
    letter_panels(axes.values())
    more = " (the first 12)" if sum(len(group.walkers) for group in groups) > _MOST_NAMED else ""
    figure.legend(loc="outside lower center", ncols=4, title=f"walker: facing at the start, velocity{more}")
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
def _gait_figure(group: Group) -> Figure:
    run = group.case.run
    motion = gait(group)
    cycles = (len(group.time) - 1) // run.samples_per_cycle
    last = slice((cycles - 2) * run.samples_per_cycle, cycles * run.samples_per_cycle + 1)
    phase = group.time[last] * group.case.drive.frequency - (cycles - 2)
    shaken = group.motion.substrate_velocity[last] @ np.array(group.case.drive.direction)
    # The substrate is faster than its walkers by far: in their panel it would make them all flat.
    rows = [["walker"], ["substrate"]] if np.any(shaken) else [["walker"]]
    figure, panels = new_figure(
        TWO_COLUMNS, 3.0 + 1.3 * len(rows), mosaic=rows, height_ratios=[2.5, 1.0][: len(rows)], sharex=True
    )
    figure.suptitle(_title(group.case))
    axes = panels["walker"]
    marks = [("o", "0.1"), ("^", "#1f3b73"), ("v", "#3f7f93"), ("D", "0.5")]
    means = averages(group).rotation[0]
    series = [("walker", motion.velocity[last, 0], walk(group).velocity[0], "s", "#c4473a")]
    series += [
        (f"bead {bead + 1}", motion.rotation[last, 0, bead], mean, *marks[bead % len(marks)])
        for bead, mean in enumerate(means)
    ]
    for label, values, mean, marker, colour in series:
        look = {"marker": marker, "color": colour, "mfc": "none"}
        axes.plot(phase, values * 1e3, label=f"{label} (mean {mean * 1e3:.2f} mm/s)", **look)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(title="walker 0", ylabel="velocity; beads:\n" r"$-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)")
    if "substrate" in panels:
        panels["substrate"].plot(phase, group.walkers[0].facing * shaken * 1e3, color="0.4", ls="--")
        panels["substrate"].axhline(0.0, color="0.4", lw=0.6)
        panels["substrate"].set(title="substrate, positive as for the walker", ylabel="velocity\n(mm/s)")
        letter_panels(panels.values())
    panels[rows[-1][0]].set_xlabel("time (cycles of the drive), the last two")
    figure.legend(*axes.get_legend_handles_labels(), ncols=4, loc="outside lower center")
    return figure


def plot_pile(directory: Path, destination: Path, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Draw what a pile did.

    Parameters
    ----------
    directory, destination, formats
        As for `plot_walkers`.

    Returns
    -------
    list of Path
        ``climb``: heights of the clusters' leaders over the pile's surface against time with the events in their
        lives, the Brazil-nut index, contacts and bridges a bead, the mean square velocity.
    """
    return save_figure(_climb_figure(analyse(directory)), destination / "climb", [directory.name], formats)


@styled
def _climb_figure(found: PileAnalysis) -> Figure:
    rows = [["height"], ["height"], ["index"], ["bridges"], ["agitation"]]
    figure, axes = new_figure(TWO_COLUMNS, 8.0, mosaic=rows, sharex=True)
    time, case = found.motion.time, found.motion.case
    beside = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5), "borderaxespad": 0.0}
    _heights(axes["height"], found)
    axes["height"].legend(**beside)
    axes["index"].plot(time, [bed.brazil_nut for bed in found.beds], color="C0", label="all beads")
    axes["index"].plot(time, [bed.brazil_nut_of_bulk for bed in found.beds], "--", color="C2", label="bulk alone")
    axes["index"].set_ylabel("Brazil-nut\nindex")
    axes["index"].legend(**beside)
    axes["bridges"].plot(time, [bed.bridges for bed in found.beds], color="C0", label="bridges")
    axes["bridges"].plot(time, [bed.contacts for bed in found.beds], "--", color="C2", label="contacts")
    axes["bridges"].set(ylabel="how many a bead,\nto other beads", ylim=(0.0, None))
    axes["bridges"].legend(**beside)
    axes["agitation"].semilogy(time, [max(bed.mean_square_velocity, 1e-12) for bed in found.beds], color="C0")
    axes["agitation"].set(
        xlabel="time from the begin of the drive (s)", ylabel="mean square\nvelocity, strobed\n(m²/s²)"
    )
    letter_panels(axes.values())
    figure.align_ylabels()
    figure.suptitle(f"{plain_text(case.title or case.name)}\n{case.count} beads, {case.drive.described()}")
    return figure


def _heights(axes: Axes, found: PileAnalysis) -> None:
    time, height = found.motion.time, found.motion.position[:, :, 2]
    low, middle, high = (
        np.array([getattr(bed, name) for bed in found.beds]) * 1e3
        for name in ("surface_low", "surface", "surface_high")
    )
    axes.fill_between(time, low, high, color="0.85", lw=0, label="surface, 10th to\n90th percentile")
    axes.plot(time, middle, color="0.4", lw=1.0, label="surface, median")
    named = 0
    for track, climb in zip(found.tracks, found.climbs, strict=True):
        places = [frame for frame, members in zip(track.frames, track.members, strict=True) if climb.leader in members]
        leads = "large" if found.motion.large[climb.leader] else "small"
        colour, width = ("C2", 1.6) if climb.climbed else ("C1", 0.6)
        line = axes.plot(time[places], height[places, climb.leader] * 1e3, color=colour, lw=width)[0]
        named += climb.climbed
        if climb.climbed and named <= _MOST_NAMED:
            line.set_label(f"{climb.size} beads climb, led by a\n{leads} one: {climb.speed * 1e3:.1f} mm/s")
    _mark_events(axes, found)
    if named > _MOST_NAMED:
        axes.plot([], [], color="C2", lw=1.6, label=f"and {named - _MOST_NAMED} more climbs")
    axes.set(ylabel="height (mm)")


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
