"""Figs. 1b, 2, 3 and 4 of the paper by engine and theory.

Each function draws a figure from finished runs and raises
`studies.paper.sources.NothingFinishedError` if there are none.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from studies.paper.sources import Sources, case_title, ruby, thresholds_with_theory
from walkers.arrays import FloatArray, IntArray
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
from walkers.postprocess.show.window import Picture, Window
from walkers.sweeps.figure import figure_of
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.table import table_of
from walkers.theory.prediction import FRICTION_MODEL, motion_of, predicted_column
from walkers.theory.quasistatic import translation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.measure.motion import Group

_INTERVAL = 0.3
"""Fig. 1b: time between images, s."""

_IMAGES = 6
"""Fig. 1b: largest number of images."""

_PIXELS = 120.0
"""Fig. 1b: pixels in the radius of the smallest bead."""

_CYCLES = 2
"""Fig. 4: number of cycles of the drive."""

_MEASURED_DASHES = (0, (6, 2, 1, 2))
"""Fig. 4: dashes of the means that the paper measured."""


class _Series(NamedTuple):
    """A velocity of Fig. 4 and its look."""

    name: str
    column: str
    """Column of its mean in the table of the sweep."""
    marker: str
    colour: str
    size: float
    """Size of the markers, points; different sizes do not hide each other."""


_SERIES = (
    _Series("walker", "velocity", "s", "#c4473a", 7.5),
    _Series("large bead", "rotation_1", "o", "#111111", 5.0),
    _Series("small bead", "rotation_2", "^", "#1f5fa8", 2.5),
)


# --- Fig. 1b --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Strip:
    """What the images of Fig. 1b show, m: along the drive and across it, from above."""

    centres: FloatArray
    """Centre of mass of the walker in each image, shape (images, 2)."""
    along: tuple[float, float]
    """Limits along the drive, which all images have in common."""
    half_width: float
    """Half of the extent across the drive, around the centre of mass."""
    height: float
    """Height of the walker."""

    def bounds(self, image: int) -> FloatArray:
        """Limits along the drive, across it, and upward, shape (3, 2)."""
        across = self.centres[image, 1]
        return np.array(
            [
                self.along,
                (across - self.half_width, across + self.half_width),
                (0.0, self.height),
            ]
        )

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Limits on the axes of an image, mm from the centre of mass at the start."""
        origin = float(self.centres[0, 0])
        left = (self.along[0] - origin) * 1e3
        right = (self.along[1] - origin) * 1e3
        return left, right, -self.half_width * 1e3, self.half_width * 1e3


@styled
def fig1b(sources: Sources) -> Figure:
    """Views of a walker from above, every 0.3 s.

    It is the first asymmetric dimer of the sweep ``alignment``, from the smallest initial angle.
    """
    table = sources.finished("alignment")
    asymmetric = table[table["sin_delta"] > 0.0].sort_values("dimers.angle")
    trajectory = sources.trajectory(asymmetric["run"].iloc[0])
    case = trajectory.case
    cycles = round(_INTERVAL * case.excitation.frequency)
    frames = np.arange(_IMAGES) * cycles * case.run.samples_per_cycle
    frames = frames[frames < len(trajectory.time)]
    strip = _strip(trajectory, frames)

    # In inches: the image, its title and the space between rows; once, heading and labels of x.
    aspect = 2.0 * strip.half_width / (strip.along[1] - strip.along[0])
    row_height = 0.97 * ONE_COLUMN * aspect + 0.22
    height = len(frames) * row_height + 0.75
    figure = new_figure(ONE_COLUMN, height)
    axes = figure.subplots(nrows=len(frames), sharex=True)
    motion = trajectory.motion.of_walkers(trajectory.walkers[:1])
    view = axes_toward(np.array([0.0, 0.0, 1.0]), trajectory.across_axis)
    pixels_per_metre = _PIXELS / float(trajectory.radii.min())
    bridges = bridges_at(motion, frames)
    for image, (panel, frame) in enumerate(zip(axes, frames, strict=True)):
        bounds = strip.bounds(image)
        scene = Scene(motion, view, 1e3 * bounds[:, 0], 1e3 * bounds[:, 1], shaken=False)
        extents = np.ptp(bounds[:2], axis=1).tolist()
        size = [round(pixels_per_metre * extent) for extent in extents]
        picture = _picture(scene, size, int(frame), bridges[image])
        panel.imshow(picture, extent=strip.extent, interpolation="bilinear")
        panel.set(yticks=[], title=f"{trajectory.time[frame]:.1f} s")
        panel.axvline(0.0, color="white", lw=0.6, ls=":")
        panel.grid(visible=False)
    axes[-1].set_xlabel("along the shaking axis,\nfrom the centre of mass at the start (mm)")
    letter_panels(axes)
    figure.suptitle(f"{case_title(case)}\nan image every {cycles} cycles")
    return figure


def _strip(trajectory: Group, frames: IntArray) -> _Strip:
    """The first walker at these frames, with space around it."""
    horizontal = np.stack([trajectory.drive_axis, trajectory.across_axis], axis=-1)
    centres = trajectory.mass_centre[frames, 0] @ horizontal
    largest = float(trajectory.radii.max())
    left = float(centres[:, 0].min()) - 2.4 * largest
    right = float(centres[:, 0].max()) + 2.4 * largest
    return _Strip(centres, (left, right), half_width=1.15 * largest, height=2.0 * largest)


def _picture(scene: Scene, size: list[int], frame: int, bridges: IntArray) -> Picture:
    """A picture of a frame, ``size`` pixels wide and high."""
    with closing(Window(scene, size)) as window:
        return window.picture(frame, bridges)


# --- Figs. 2 and 3 --------------------------------------------------------------------------------


def draw_sweep(sources: Sources, name: str, options: FigureOptions) -> Figure:
    """The figure of a sweep as `walkers plot` draws it."""
    sources.finished(name)
    table = table_of(read_sweep_record(sources.out / name))
    return figure_of(table, options, predicted_column if options.theory else None)


def fig2(sources: Sources) -> Figure:
    """Velocity against peak acceleration at several frequencies."""
    options = FigureOptions(x="drive.peak_acceleration", hue="drive.frequency", theory=True)
    return draw_sweep(sources, "fig2", options)


def fig3(sources: Sources) -> Figure:
    """Velocity against asymmetry at Γ0 = 0.5."""
    options = FigureOptions(x="sin_delta", hue="dimers.radii", theory=True)
    figure = draw_sweep(sources, "fig3", options)
    figure.axes[0].autoscale(axis="y")  # the paper's curve too, which rises far above the walkers
    return figure


@styled
def fig2_threshold(sources: Sources) -> Figure:
    """Threshold of motion against frequency.

    Runs from rest have it between the last drive with motion and the first one without. In the
    paper, and in another run, the drive falls until the walkers stop.
    """
    sources.finished("fig2-threshold")
    table = thresholds_with_theory(sources).astype(float)
    frequency = table["drive.frequency"].to_numpy()
    at_rest = table["gamma0_at_rest"].to_numpy()
    moving = table["gamma0_moving"].to_numpy()
    theory = table["theory"].to_numpy()
    ramp = table["ramp"].to_numpy()
    within = table["within"].to_numpy()

    figure = new_figure(ONE_COLUMN, 2.8)
    axes = figure.subplots()
    axes.errorbar(
        frequency,
        (at_rest + moving) / 2.0,
        (moving - at_rest) / 2.0,
        fmt="o",
        mfc="none",
        label="engine: runs from rest, rest below, motion above",
    )
    axes.errorbar(
        frequency + 1.0,  # beside the other symbol
        ramp,
        within,
        fmt="s",
        mfc="none",
        label="engine: one run, the drive falls",
    )
    axes.plot(frequency, theory, "--", color="0.2", lw=0.9, label=FRICTION_MODEL)
    largest = float(np.nanmax([*moving, *theory]))
    axes.set(xlabel="frequency (Hz)", ylabel=r"threshold of motion $\Gamma_\mathrm{c}$")
    axes.set(xticks=frequency, ylim=(0.0, 1.3 * largest))
    legend_below(axes)
    return figure


# --- Fig. 4 ---------------------------------------------------------------------------------------


@styled
def fig4(sources: Sources) -> Figure:
    """Velocities of walker and beads over two cycles: the large bead rolls, or rolls and slides."""
    table = sources.finished("fig4")
    figure = new_figure(TWO_COLUMNS, 4.0)
    axes = figure.subplots(ncols=2)
    for panel, letter, liquid in zip(axes, "ab", ("Si AK5", "Si AK10"), strict=True):
        for _, row in table[table["liquid.name"] == liquid].iterrows():
            trajectory = sources.trajectory(row["run"])
            _draw_cycles(panel, trajectory, row, letter)
            panel.set_title(f"{case_title(trajectory.case)}\n$\\Gamma_0$ = {row['gamma0']:.3g}")
        panel.plot([], [], color="0.3", lw=0.9, label=FRICTION_MODEL)
        panel.plot([], [], color="0.3", lw=1.0, ls=_MEASURED_DASHES, label="measured mean")
        legend_below(panel, title="means in mm/s")
    letter_panels(axes)
    return figure


def _draw_cycles(axes: Axes, trajectory: Group, row: pd.Series[float], letter: str) -> None:
    """Draw the last cycles of the first walker, those of the theory, and the measured means.

    Parameters
    ----------
    axes
        A panel of Fig. 4.
    trajectory
        The walkers of a run.
    row
        The row of this run in the table of the sweep.
    letter
        Letter of the panel in the paper, which the names of its measurements contain.
    """
    measured = {observation.name: observation.value for observation in ruby().file.observations}
    computed = _last_cycles(trajectory)
    theory = theory_of_cycles(trajectory)
    samples_per_cycle = trajectory.case.run.samples_per_cycle
    for series, velocity, line in zip(_SERIES, computed, theory, strict=True):
        label = f"{series.name}: {row[series.column] * 1e3:.2f}"
        mean = measured.get(f"fig4{letter}_{series.column.removesuffix('_1')}")
        if mean:
            axes.axhline(mean * 1e3, color=series.colour, ls=_MEASURED_DASHES, lw=1.0)
            label += f", measured {mean * 1e3:.1f}"
        axes.plot(
            np.arange(len(velocity)) / samples_per_cycle,
            velocity * 1e3,
            series.marker,
            color=series.colour,
            ms=series.size,
            mfc="none",
            mew=0.8,
            label=label,
        )
        axes.plot(
            np.arange(len(line)) / (len(line) - 1) * _CYCLES,
            line * 1e3,
            color=series.colour,
            lw=0.36 * series.size,
        )
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(
        xlabel="time (cycles of the drive)",
        ylabel=r"velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)",
    )


def _last_cycles(trajectory: Group) -> list[FloatArray]:
    """Velocity of the first walker and rotation velocities of its beads in the last cycles, m/s."""
    run = trajectory.case.run
    motion = gait(trajectory)
    end = run.cycles * run.samples_per_cycle
    last = slice(end - _CYCLES * run.samples_per_cycle, end + 1)
    return [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]


def theory_of_cycles(trajectory: Group) -> list[FloatArray]:
    """Velocities in the cycles of Fig. 4 by the theory.

    Parameters
    ----------
    trajectory
        The walkers of a run.

    Returns
    -------
    list of ndarray
        Velocity of the first walker and rotation velocities of its two beads, m/s. They start with
        a cycle of the engine's drive; NaN where a contact would open.
    """
    motion = motion_of(trajectory.case)
    sliding = motion.series[:, 0]
    if not np.isfinite(motion.velocity[0]):
        sliding = np.full_like(sliding, np.nan)
    velocity = translation(sliding)
    # Along x, the substrate accelerates as cos 2πft in the theory, and as -sin 2πft in the engine.
    quarter = sliding.shape[1] // 4
    ahead = quarter if trajectory.walkers[0].facing > 0 else -quarter
    cycle = np.roll([velocity, velocity - sliding[0], velocity - sliding[1]], 1 - ahead, axis=1)
    return [np.concatenate([np.tile(series, _CYCLES), series[:1]]) for series in cycle]
