"""Figs. 1b, 2, 3 and 4 of the paper by engine and theory.

Each function draws a figure from finished runs and raises
`studies.paper.sources.NothingFinishedError` if there are none.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from studies.paper.sources import Sources, case_title, ruby, thresholds_with_theory
from walkers.arrays import FloatArray, IntArray
from walkers.postprocess.measure.caption import liquid_text, radii_text
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
from walkers.postprocess.show.scene import FloorGrid, Scene
from walkers.postprocess.show.window import Picture, Window
from walkers.runner.run_directory import case_of
from walkers.sweeps.figure import figure_of
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.table import table_of
from walkers.theory.prediction import FRICTION_MODEL, PAPER_FIT, motion_of, predicted_column
from walkers.theory.quasistatic import mean_velocity, translation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.measure.motion import Group

_INTERVAL = 0.3
"""Fig. 1b: time between images, s."""

_IMAGES = 6
"""Fig. 1b: largest number of images."""

_GRID_STEP = 0.5
"""Fig. 1b: distance of the lines on the floor, which are at the ticks, mm."""

_PIXELS = 120.0
"""Fig. 1b: pixels in the radius of the smallest bead."""

_CYCLES = 2
"""Fig. 4: number of cycles of the drive."""

_MEASURED_DASHES = (0, (6, 2, 1, 2))
"""Fig. 4: dashes of the means that the paper measured."""


_THEORY_DOTS = 0.1
"""Fig. 4: distance of the dots of the theory, cycles."""

_PLATEAU = "velocity_6g"
"""Fig. 2: name of the paper's velocity at the onset of the plateau, 6 g."""

_FAR_FROM_CURVE = 0.3
"""Fig. 3: distance from the paper's curve from which radii stand above a point, mm/s."""

_SMALL = 7.0
"""Size of texts beside points, points."""

_BESIDE = 1.0
"""Threshold: distance of the bars of the two protocols, Hz."""


class _Series(NamedTuple):
    """A velocity of Fig. 4 and its look."""

    name: str
    column: str
    """Column of its mean in the table of the sweep."""
    colour: str
    width: float
    """Width of the line, points; different widths do not hide each other."""


_SERIES = (
    _Series("walker, v", "velocity", "C2", 2.4),
    _Series("large bead, −R₁ dφ₁/dt", "rotation_1", "C0", 1.4),
    _Series("small bead, −R₂ dφ₂/dt", "rotation_2", "C1", 0.7),
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
    origin = 1e3 * strip.centres[0] @ view[:2, :2]
    grid = FloorGrid(step=_GRID_STEP, origin=(float(origin[0]), float(origin[1])))
    for image, (panel, frame) in enumerate(zip(axes, frames, strict=True)):
        bounds = strip.bounds(image)
        scene = Scene(motion, view, 1e3 * bounds[:, 0], 1e3 * bounds[:, 1], shaken=False, grid=grid)
        extents = np.ptp(bounds[:2], axis=1).tolist()
        size = [round(pixels_per_metre * extent) for extent in extents]
        picture = _picture(scene, size, int(frame), bridges[image])
        panel.imshow(picture, extent=strip.extent, interpolation="bilinear")
        panel.set(yticks=[], title=f"{trajectory.time[frame]:.1f} s")
        panel.axvline(0.0, color="0.4", lw=0.8, ls=":")
        panel.grid(visible=False)
        panel.spines[["left", "bottom"]].set_visible(panel is axes[-1])
        panel.tick_params(bottom=panel is axes[-1])
    axes[-1].spines["left"].set_visible(False)
    axes[-1].set_xlabel("x (mm)")
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


@styled
def fig2(sources: Sources) -> Figure:
    """Velocity against peak acceleration at several frequencies, and the paper's plateau."""
    options = FigureOptions(x="drive.peak_acceleration", hue="drive.frequency", theory=True)
    figure = draw_sweep(sources, "fig2", options)
    (axes,) = figure.axes
    plateau = _observed(_PLATEAU) * 1e3
    axes.plot([6.0, 10.0], [plateau, plateau], ls=_MEASURED_DASHES, color="0.3", lw=1.0)
    axes.annotate(
        "plateau of the paper, from 6 g",
        (8.0, plateau),
        xytext=(0.0, 3.0),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize=_SMALL,
    )
    axes.set_xlim(0.0, 10.3)
    axes.set_ylim(top=plateau + 0.5)
    return figure


def _observed(name: str) -> float:
    """A number of the paper by the name of its observation, SI units."""
    (value,) = (fact.value for fact in ruby().file.observations if fact.name == name)
    assert value is not None  # it is a number of the paper
    return value


@styled
def fig3(sources: Sources) -> Figure:
    """Velocity against asymmetry at Γ0 = 0.5, with the radii of each pair of beads."""
    table = sources.finished("fig3")
    cases = [case_of(Path(directory)) for directory in table["run"]]
    asymmetry = table["sin_delta"].to_numpy(dtype=float)
    velocity = table["velocity"].to_numpy(dtype=float) * 1e3
    gamma0 = float(table["gamma0"].mean())
    predictions, _ = predicted_column(cases, "velocity")
    fine = np.linspace(0.0, 1.02 * asymmetry.max(), 100)

    figure = new_figure(ONE_COLUMN, 3.2)
    axes = figure.subplots()
    axes.plot(fine, 1e3 * mean_velocity(gamma0, fine), ":", color="0.3", label=PAPER_FIT)
    theory = predictions[FRICTION_MODEL] * 1e3
    axes.plot(asymmetry, theory, "_", color="0.3", ms=12, label=FRICTION_MODEL)
    axes.plot(asymmetry, velocity, "ko", mfc="none", label="engine")
    style: dict[str, Any] = {"textcoords": "offset points", "fontsize": _SMALL}
    for place, height, case in zip(asymmetry, velocity, cases, strict=True):
        distance = abs(height - 1e3 * float(mean_velocity(gamma0, place)))
        radii = radii_text(case.walkers[0].radii)
        if distance > _FAR_FROM_CURVE:
            axes.annotate(radii, (place, height), (0.0, 10.0), ha="center", va="bottom", **style)
        else:  # to the lower right, away from the curve, which rises
            axes.annotate(radii, (place, height), (4.0, -4.0), ha="left", va="top", **style)
    axes.set(
        xlabel=r"asymmetry $\sin\,\delta$",
        ylabel="velocity (mm/s)",
        title=f"$\\Gamma_0$ = {gamma0:.3g}, {liquid_text(cases[0])}; radii in mm",
        xticks=(0.0, 0.1, 0.2, 0.3),
        xlim=(-0.04, 0.38),
        ylim=(-0.6, None),
    )
    legend_below(axes)
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
        frequency - _BESIDE / 2.0,
        (at_rest + moving) / 2.0,
        (moving - at_rest) / 2.0,
        fmt="none",
        ecolor="C0",
        capsize=3,
        label="engine, runs from rest: from rest to motion",
    )
    axes.errorbar(
        frequency + _BESIDE / 2.0,
        ramp,
        within,
        fmt="s",
        color="C1",
        mfc="none",
        capsize=3,
        label="engine, one run: the drive falls until rest",
    )
    axes.plot(frequency, theory, "--", color="0.2", lw=0.9, label=FRICTION_MODEL)
    largest = float(np.nanmax([*moving, *theory]))
    axes.set(xlabel="frequency (Hz)", ylabel=r"threshold of motion $\Gamma_\mathrm{c}$")
    axes.set(xticks=frequency, ylim=(0.0, 1.3 * largest))
    legend_below(axes, title=f"the two are drawn {_BESIDE:g} Hz apart")
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
        panel.plot([], [], ".", color="0.3", ms=6.0, label=FRICTION_MODEL)
        panel.plot([], [], color="0.3", lw=1.0, ls=_MEASURED_DASHES, label="measured mean")
        legend_below(panel, title="engine; means in mm/s")
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
    for series, velocity, predicted in zip(_SERIES, computed, theory, strict=True):
        label = f"{series.name}: {row[series.column] * 1e3:.2f}"
        mean = measured.get(f"fig4{letter}_{series.column.removesuffix('_1')}")
        if mean:
            axes.axhline(mean * 1e3, color=series.colour, ls=_MEASURED_DASHES, lw=1.0)
            label += f", measured {mean * 1e3:.1f}"
        axes.plot(
            np.arange(len(velocity)) / samples_per_cycle,
            velocity * 1e3,
            color=series.colour,
            lw=series.width,
            label=label,
        )
        time = np.arange(len(predicted)) / (len(predicted) - 1) * _CYCLES
        dots = np.arange(0.0, _CYCLES + _THEORY_DOTS / 2.0, _THEORY_DOTS)
        heights = np.interp(dots, time, predicted * 1e3)
        axes.plot(dots, heights, ".", color=series.colour, mec="white", mew=0.5, ms=7.0, zorder=3)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(
        xlabel="time (cycles of the drive)",
        ylabel="velocity (mm/s)",
        xlim=(0.0, _CYCLES),
        xticks=np.arange(0.0, _CYCLES + 0.25, 0.5),
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
