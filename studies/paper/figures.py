"""Figs. 1b, 2, 3 and 4 of the paper by engine and theory."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.paper.sources import Sources, case_title, ruby, thresholds_with_theory
from walkers.arrays import FloatArray
from walkers.postprocess.measure.gait import gait
from walkers.postprocess.show.camera import axes_toward
from walkers.postprocess.show.drawing import (
    ONE_COLUMN,
    TWO_COLUMNS,
    legend_below,
    letter_panels,
    new_figure,
    styled,
)
from walkers.postprocess.show.necks import bridges_at
from walkers.postprocess.show.scene import Scene
from walkers.postprocess.show.window import Window
from walkers.sweeps.figure import figure_of
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.table import table_of
from walkers.theory.prediction import COULOMB_MODEL, motion_of, predicted_column
from walkers.theory.quasistatic import translation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.measure.motion import Group

_INTERVAL, _IMAGES = 0.3, 6
"""Fig. 1b: seconds between images, and number of images."""
_CYCLES = 2
"""Cycles of Fig. 4."""
_SERIES = (
    ("walker", "velocity", "s", "#c4473a", 7.5),
    ("large bead", "rotation_1", "o", "#111111", 5.0),
    ("small bead", "rotation_2", "^", "#1f5fa8", 2.5),
)
"""Fig. 4: name, column of a sweep's table, marker, colour, and size, so that none hides another."""
_MEASURED_DASHES = (0, (6, 2, 1, 2))


@styled
def fig1b(sources: Sources) -> Figure:
    """The first asymmetric dimer of the sweep ``alignment``, from the smallest start angle: from above every 0.3 s."""
    table = sources.finished("alignment")
    run = table[table["sin_delta"] > 0.0].sort_values("dimers.angle")["run"].iloc[0]
    trajectory = sources.trajectory(run)
    case, largest = trajectory.case, float(trajectory.radii.max())
    cycles = round(_INTERVAL * case.excitation.frequency)
    frames = np.arange(_IMAGES) * cycles * case.run.samples_per_cycle
    frames = frames[frames < len(trajectory.time)]
    centre = trajectory.mass_centre[frames, 0] @ np.stack(
        [trajectory.drive_axis, trajectory.across_axis], axis=-1
    )
    along = (float(centre[:, 0].min()) - 2.4 * largest, float(centre[:, 0].max()) + 2.4 * largest)
    half, origin = 1.15 * largest, float(centre[0, 0])
    row = 0.97 * ONE_COLUMN * 2.0 * half / (along[1] - along[0]) + 0.22
    figure = new_figure(ONE_COLUMN, len(frames) * row + 0.75)
    axes = figure.subplots(nrows=len(frames), sharex=True)
    motion = trajectory.motion.of_walkers(trajectory.walkers[:1])
    view = axes_toward(np.array([0.0, 0.0, 1.0]), trajectory.across_axis)
    pixels = 120.0 / float(trajectory.radii.min())
    bridges = bridges_at(motion, frames)
    for panel, frame, (_, middle), contacts in zip(axes, frames, centre, bridges, strict=True):
        bounds = np.array([along, (middle - half, middle + half), (0.0, 2.0 * largest)])
        scene = Scene(motion, view, 1e3 * bounds[:, 0], 1e3 * bounds[:, 1], shaken=False)
        size = [round(pixels * extent) for extent in np.ptp(bounds[:2], axis=1).tolist()]
        with closing(Window(scene, size)) as window:
            picture = window.picture(int(frame), contacts)
        edges = [(along[0] - origin) * 1e3, (along[1] - origin) * 1e3, -half * 1e3, half * 1e3]
        panel.imshow(picture, extent=edges, interpolation="bilinear")
        panel.set(yticks=[], title=f"{trajectory.time[frame]:.1f} s")
        panel.axvline(0.0, color="white", lw=0.6, ls=":")
        panel.grid(visible=False)
    axes[-1].set_xlabel("along the shaking axis,\nfrom the centre of mass at the start (mm)")
    letter_panels(axes)
    figure.suptitle(f"{case_title(case)}\nan image every {cycles} cycles")
    return figure


def draw_sweep(sources: Sources, name: str, **options: Any) -> Figure:
    """The figure of a sweep as `walkers plot` draws it."""
    chosen = FigureOptions(**options)
    sources.finished(name)
    table = table_of(read_sweep_record(sources.out / name))
    return figure_of(table, chosen, predicted_column if chosen.theory else None)


def fig3(sources: Sources) -> Figure:
    """Velocity against asymmetry at Γ0 = 0.5."""
    figure = draw_sweep(sources, "fig3", x="sin_delta", hue="dimers.radii", theory=True)
    figure.axes[0].autoscale(axis="y")  # the paper's curve too, which rises far above the walkers
    return figure


@styled
def fig2_threshold(sources: Sources) -> Figure:
    """Γc between the last drive with motion and the first one without, and by the protocol of the paper, a ramp."""
    sources.finished("fig2-threshold")
    frequencies, low, high, theory, ramp, within = (
        thresholds_with_theory(sources).to_numpy(dtype=float).T
    )
    figure = new_figure(ONE_COLUMN, 2.8)
    axes = figure.subplots()
    label = "engine: runs from rest, rest below, motion above"
    axes.errorbar(
        frequencies, (low + high) / 2.0, (high - low) / 2.0, fmt="o", mfc="none", label=label
    )
    axes.errorbar(
        frequencies + 1.0,
        ramp,
        within,
        fmt="s",
        mfc="none",
        label="engine: one run, the drive falls",
    )
    axes.plot(frequencies, theory, "--", color="0.2", lw=0.9, label=COULOMB_MODEL)
    axes.set(xlabel="frequency (Hz)", ylabel=r"threshold of motion $\Gamma_\mathrm{c}$")
    axes.set(xticks=frequencies, ylim=(0.0, 1.3 * float(np.nanmax([*high, *theory]))))
    legend_below(axes)
    return figure


@styled
def fig4(sources: Sources) -> Figure:
    """Velocity and rotation of the beads over two cycles: the large bead rolls, or rolls and slides."""
    table = sources.finished("fig4")
    figure = new_figure(TWO_COLUMNS, 4.0)
    axes = figure.subplots(ncols=2)
    for panel, letter, liquid in zip(axes, "ab", ("Si AK5", "Si AK10"), strict=True):
        for _, row in table[table["liquid.name"] == liquid].iterrows():
            trajectory = sources.trajectory(row["run"])
            _draw_cycles(panel, trajectory, row, letter)
            panel.set_title(f"{case_title(trajectory.case)}\n$\\Gamma_0$ = {row['gamma0']:.3g}")
        panel.plot([], [], color="0.3", lw=0.9, label=COULOMB_MODEL)
        panel.plot([], [], color="0.3", lw=1.0, ls=_MEASURED_DASHES, label="measured mean")
        legend_below(panel, title="means in mm/s")
    letter_panels(axes)
    return figure


def _draw_cycles(axes: Axes, trajectory: Group, row: pd.Series[float], letter: str) -> None:
    """Last cycles of the first walker, with the last cycle of the theory, and the mean that the paper measured."""
    measured = {observation.name: observation.value for observation in ruby().file.observations}
    run, motion = trajectory.case.run, gait(trajectory)
    samples = run.samples_per_cycle
    last = slice((run.cycles - _CYCLES) * samples, run.cycles * samples + 1)
    values = [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]
    theory = theory_of_cycles(trajectory)
    for (name, column, marker, colour, size), series, line in zip(
        _SERIES, values, theory, strict=True
    ):
        label = f"{name}: {row[column] * 1e3:.2f}"
        if expected := measured.get(f"fig4{letter}_{column.removesuffix('_1')}"):
            axes.axhline(expected * 1e3, color=colour, ls=_MEASURED_DASHES, lw=1.0)
            label += f", measured {expected * 1e3:.1f}"
        look: dict[str, Any] = {
            "color": colour,
            "ms": size,
            "mfc": "none",
            "mew": 0.8,
            "label": label,
        }
        axes.plot(np.arange(len(series)) / samples, series * 1e3, marker, **look)
        axes.plot(
            np.arange(len(line)) / (len(line) - 1) * _CYCLES,
            line * 1e3,
            color=colour,
            lw=0.36 * size,
        )
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(
        xlabel="time (cycles of the drive)",
        ylabel=r"velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)",
    )


def theory_of_cycles(trajectory: Group) -> list[FloatArray]:
    """Velocity of the walker and rotation velocities of its beads by the theory, m/s, through the cycles shown.

    Starts with a cycle of the engine's drive; NaN where a contact would open.
    """
    motion = motion_of(trajectory.case)
    sliding = (
        motion.series[:, 0]
        if np.isfinite(motion.velocity[0])
        else np.full_like(motion.series[:, 0], np.nan)
    )
    velocity = translation(sliding)
    # Along x, the substrate accelerates as cos 2πft in the theory, and as -sin 2πft in the engine.
    quarter = sliding.shape[1] // 4
    ahead = quarter if trajectory.walkers[0].facing > 0 else -quarter
    cycle = np.roll([velocity, velocity - sliding[0], velocity - sliding[1]], 1 - ahead, axis=1)
    return [np.concatenate([np.tile(series, _CYCLES), series[:1]]) for series in cycle]
