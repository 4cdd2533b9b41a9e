"""Figures of a run (matplotlib): where the walkers went and turned, and their gait through two cycles."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.case import WalkerCase
from walkers.inputs.dimer import dimer_of
from walkers.postprocess.drawing import new_figure, plain_text, save_figure, styled
from walkers.postprocess.gait import distance_walked, fit_slopes, gait
from walkers.postprocess.trajectory import Trajectory, read_trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WALK_NAME = "walk.png"
GAIT_NAME = "gait.png"
_FEWEST_SAMPLES = 8
"""Samples a cycle below which a gait shows nothing."""


def plot_run(directory: Path, destination: Path | None = None) -> list[Path]:
    """Draw the figures of a run.

    Parameters
    ----------
    directory
        A run directory.
    destination
        Folder for the pictures; the run directory itself if None.

    Returns
    -------
    list of Path
        ``walk.png`` (strobed positions, distance walked and orientation against time) and, if the run was sampled at
        least eight times a cycle, ``gait.png`` (velocity and rotation velocities through two cycles, as in Fig. 4 of
        Khan et al.).
    """
    trajectory = read_trajectory(directory)
    destination = destination or directory
    destination.mkdir(parents=True, exist_ok=True)
    written = save_figure(_walk_figure(trajectory), destination / WALK_NAME, [directory.name])
    samples = trajectory.case.run.samples_per_cycle
    if samples >= _FEWEST_SAMPLES and len(trajectory.time) > 2 * samples:
        written += save_figure(_gait_figure(trajectory), destination / GAIT_NAME, [directory.name])
    return written


def _title(case: WalkerCase) -> str:
    gamma0 = dimer_of(case).gamma0(case.drive.peak_acceleration)
    first, second = (f"{radius * 1e3:g}" for radius in case.beads.radii)
    return (
        f"{plain_text(case.title or case.name)}\nR = {first}/{second} mm, {case.drive.described()} "
        f"($\\Gamma_0$ = {gamma0:.3g})"
    )


@styled
def _walk_figure(trajectory: Trajectory) -> Figure:
    figure, axes = new_figure(7.6, 5.4, mosaic=[["strobe", "walked"], ["strobe", "turned"]], width_ratios=[1, 1.6])
    top, middle, bottom = axes["strobe"], axes["walked"], axes["turned"]
    figure.suptitle(_title(trajectory.case), fontsize=10)
    _draw_strobe(top, trajectory)
    time, distance = distance_walked(trajectory)
    settled = trajectory.case.run.settling_cycles
    slope, _ = fit_slopes(time[settled:], distance[settled:])
    strobe = trajectory.case.run.samples_per_cycle
    for number, walker in enumerate(trajectory.layout.walkers):
        label = f"{number}: {'right' if walker.facing > 0 else 'left'}, {slope[number] * 1e3:.3g} mm/s"
        middle.plot(time, distance[:, number] * 1e3, "o" if number % 2 == 0 else "s", mfc="none", label=label)
        bottom.plot(time, np.degrees(trajectory.orientation[::strobe, number]))
    middle.axvspan(0.0, time[settled], color="0.93", zorder=0, label="settling")
    middle.set(ylabel="distance walked (mm)", xlabel="time (s)")
    if len(trajectory.layout.walkers) <= 12:
        middle.legend(fontsize=7, ncols=2, title="walker: facing at the start, velocity", title_fontsize=7)
    bottom.set(ylabel=r"orientation $\psi$ (°)", xlabel="time (s)")
    return figure


def _draw_strobe(axes: Axes, trajectory: Trajectory) -> None:
    """The first walker from above, both beads to scale, at eight times (as in Fig. 1b of the paper).

    Rows are even: the way along the drive axis and the orientation are shown, not the drift across the axis.
    """
    from matplotlib.patches import Circle

    strobe = trajectory.case.run.samples_per_cycle
    ground = np.stack([trajectory.drive_axis, trajectory.across_axis], axis=-1)
    position = trajectory.position[::strobe, 0] @ ground * 1e3
    radii = trajectory.radii * 1e3
    middle = position.mean(axis=1)
    shown = np.unique(np.linspace(0, len(position) - 1, 8).round().astype(int))
    pitch = 2.6 * float(radii.max())
    ends = []
    for row, frame in enumerate(shown):
        for bead in range(2):
            along = float(position[frame, bead, 0] - middle[0, 0])
            across = float(position[frame, bead, 1] - middle[frame, 1]) - row * pitch
            size = float(radii[bead])
            axes.add_patch(Circle((along, across), size, fc="0.75" if bead else "0.45", ec="0.2", lw=0.6))
            ends += [along - size, along + size]
        seconds = f"{trajectory.time[frame * strobe]:.2f} s"
        place = (1.01, -row * pitch)
        axes.annotate(seconds, place, xycoords=("axes fraction", "data"), fontsize=7, va="center")
    axes.set(xlim=(min(ends) - radii.max(), max(ends) + radii.max()), ylim=(-pitch * (len(shown) - 0.4), 0.6 * pitch))
    axes.set_aspect("equal")
    axes.set(xlabel="along the drive axis (mm)", yticks=[], title="walker 0, time downward")
    axes.grid(visible=False)


@styled
def _gait_figure(trajectory: Trajectory) -> Figure:
    run = trajectory.case.run
    motion = gait(trajectory)
    cycles = (len(trajectory.time) - 1) // run.samples_per_cycle
    last = slice((cycles - 2) * run.samples_per_cycle, cycles * run.samples_per_cycle + 1)
    phase = trajectory.time[last] * trajectory.case.drive.frequency - (cycles - 2)
    figure, axes = new_figure(6.4, 3.8)
    figure.suptitle(_title(trajectory.case), fontsize=10)
    series = [
        ("walker", motion.velocity[last, 0], "s", "#c4473a"),
        ("bead 1", motion.rotation[last, 0, 0], "o", "0.1"),
        ("bead 2", motion.rotation[last, 0, 1], "^", "#1f3b73"),
    ]
    for label, values, marker, colour in series:
        mean = values[:-1].mean() * 1e3
        axes.plot(phase, values * 1e3, marker=marker, color=colour, label=f"{label} (mean {mean:.2f} mm/s)")
    shaken = trajectory.substrate_velocity[last] @ np.array(trajectory.case.drive.direction)
    if np.any(shaken):
        facing = trajectory.layout.walkers[0].facing
        axes.plot(phase, facing * shaken * 1e3, color="0.6", ls=":", label="substrate")
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(
        xlabel="time (cycles of the drive), the last two of walker 0",
        ylabel=r"walker: velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)",
    )
    figure.legend(fontsize=7, ncols=4, loc="outside lower center")
    return figure
