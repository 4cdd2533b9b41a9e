"""Figures of a run (matplotlib): where walkers went and turned, their gait; what clusters rose over a pile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.postprocess.drawing import new_figure, plain_text, save_figure, styled
from walkers.postprocess.gait import averages, distance_walked, gait, walk
from walkers.postprocess.motion import Group, read_motion
from walkers.postprocess.piles import PileAnalysis, analyse
from walkers.postprocess.posture import ways
from walkers.postprocess.slopes import fit_slopes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WALK_NAME = "walk.png"
GAIT_NAME = "gait.png"
CLIMB_NAME = "climb.png"
_MARKS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""How events are marked (`walkers.postprocess.events`)."""
_FEWEST_SAMPLES = 8
"""Samples a cycle below which a gait shows nothing."""


def plot_walkers(directory: Path, destination: Path) -> list[Path]:
    """Draw the walkers of a run.

    Returns
    -------
    list of Path
        ``walk.png`` (strobed positions, distance walked and orientation against time) and, if the run was sampled at
        least eight times a cycle, ``gait.png`` (velocity and rotation velocities through two cycles, as in Fig. 4 of
        Khan et al.).
    """
    groups = read_motion(directory).groups
    written = save_figure(_walk_figure(groups), destination / WALK_NAME, [directory.name])
    samples = groups[0].case.run.samples_per_cycle
    if samples >= _FEWEST_SAMPLES and len(groups[0].time) > 2 * samples:
        written += save_figure(_gait_figure(groups[0]), destination / GAIT_NAME, [directory.name])
    return written


def _title(case: Case) -> str:
    makes = [" / ".join(f"{radius * 1e3:g}" for radius in make.radii) for make in case.walkers]
    gamma0 = ""
    if len(case.walkers[0].radii) == 2:
        gamma0 = f" ($\\Gamma_0$ = {dimer_of(case).gamma0(case.drive.peak_acceleration):.3g})"
    return f"{plain_text(case.title or case.name)}\nR = {'; '.join(makes)} mm, {case.drive.described()}{gamma0}"


@styled
def _walk_figure(groups: list[Group]) -> Figure:
    figure, axes = new_figure(7.6, 5.4, mosaic=[["strobe", "walked"], ["strobe", "turned"]], width_ratios=[1, 1.6])
    top, middle, bottom = axes["strobe"], axes["walked"], axes["turned"]
    figure.suptitle(_title(groups[0].case), fontsize=10)
    _draw_strobe(top, groups[0])
    run, facing = groups[0].case.run, ways(uphill=groups[0].case.goes_uphill)
    for group in groups:
        time, distance = distance_walked(group)
        slope, _ = fit_slopes(time[run.settled_strobes :], distance[run.settled_strobes :])
        for place, walker in enumerate(group.walkers):
            number = walker.walker
            label = f"{number}: {facing[int(walker.facing < 0)]}, {slope[place] * 1e3:.3g} mm/s"
            middle.plot(time, distance[:, place] * 1e3, "o" if number % 2 == 0 else "s", mfc="none", label=label)
            bottom.plot(time, np.degrees(group.orientation[:: run.samples_per_cycle, place]))
    middle.axvspan(0.0, time[run.settled_strobes], color="0.93", zorder=0, label="settling")
    middle.set(ylabel="distance walked (mm)", xlabel="time (s)")
    if sum(len(group.walkers) for group in groups) <= 12:
        middle.legend(fontsize=7, ncols=2, title="walker: facing at the start, velocity", title_fontsize=7)
    bottom.set(ylabel=r"orientation $\psi$ (°)", xlabel="time (s)")
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
    figure, axes = new_figure(6.4, 3.8)
    figure.suptitle(_title(group.case), fontsize=10)
    marks = [("o", "0.1"), ("^", "#1f3b73"), ("v", "#3f7f93"), ("D", "0.5")]
    means = averages(group).rotation[0]
    series = [("walker", motion.velocity[last, 0], walk(group).velocity[0], "s", "#c4473a")]
    series += [
        (f"bead {bead + 1}", motion.rotation[last, 0, bead], mean, *marks[bead % len(marks)])
        for bead, mean in enumerate(means)
    ]
    for label, values, mean, marker, colour in series:
        axes.plot(phase, values * 1e3, marker=marker, color=colour, label=f"{label} (mean {mean * 1e3:.2f} mm/s)")
    shaken = group.motion.substrate_velocity[last] @ np.array(group.case.drive.direction)
    if np.any(shaken):
        facing = group.walkers[0].facing
        axes.plot(phase, facing * shaken * 1e3, color="0.6", ls=":", label="substrate")
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(
        xlabel="time (cycles of the drive), the last two of walker 0",
        ylabel=r"walker: velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)",
    )
    figure.legend(fontsize=7, ncols=4, loc="outside lower center")
    return figure


def plot_pile(directory: Path, destination: Path) -> list[Path]:
    """Draw what a pile did.

    Returns
    -------
    list of Path
        ``climb.png``: heights of the clusters' leaders over the pile's surface against time with the events in their
        lives, the Brazil-nut index, contacts and bridges a bead, the mean square velocity.
    """
    return save_figure(_climb_figure(analyse(directory)), destination / CLIMB_NAME, [directory.name])


@styled
def _climb_figure(found: PileAnalysis) -> Figure:
    rows = [["height"], ["height"], ["index"], ["bridges"], ["agitation"]]
    figure, axes = new_figure(7.6, 7.8, mosaic=rows, sharex=True)
    time, case = found.motion.time, found.motion.case
    _heights(axes["height"], found)
    axes["index"].plot(time, [bed.brazil_nut for bed in found.beds], color="C0", label="all beads")
    axes["index"].plot(time, [bed.brazil_nut_of_bulk for bed in found.beds], "--", color="C2", label="bulk alone")
    axes["index"].set_ylabel("Brazil-nut\nindex")
    axes["index"].legend(fontsize=7)
    axes["bridges"].plot(time, [bed.bridges for bed in found.beds], color="C0", label="bridges")
    axes["bridges"].plot(time, [bed.contacts for bed in found.beds], "--", color="C2", label="contacts")
    axes["bridges"].set(ylabel="how many a bead,\nto other beads", ylim=(0.0, None))
    axes["bridges"].legend(fontsize=7, loc="lower right", ncols=2)
    axes["agitation"].semilogy(time, [max(bed.mean_square_velocity, 1e-12) for bed in found.beds], color="C0")
    axes["agitation"].set(
        xlabel="time from the begin of the drive (s)", ylabel="mean square\nvelocity, strobed\n(m²/s²)"
    )
    figure.suptitle(
        f"{plain_text(case.title or case.name)}\n{case.count} beads, {case.drive.described()}",
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
