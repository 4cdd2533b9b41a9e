"""The figure and the numbers of docs/explanation/why-it-walks.md: a cycle of the walker of Fig. 1b.

Velocities of the engine are beside those of the theory, which also gives the forces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from docs.notation import LARGE_BEAD, SMALL_BEAD
from walkers import Run, load_case
from walkers import run as walk
from walkers.arrays import FloatArray
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.tables.case import Case
from walkers.physics.dimer import Dimer
from walkers.postprocess.measure.gait import gait
from walkers.postprocess.show.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.theory.mathieu import AxialMotion, axial_motion
from walkers.theory.motion import Walker

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

_WORDS = ("rolls back", "turns", "rolls ahead", "turns")
"""What the walker does in the four panels."""
_LENGTH_OF_LOAD = 0.5 / 70e-6
"""Length of an arrow over the force that it shows, mm/N."""
_DELAY = 0.25
"""The drive of the theory begins a quarter of a cycle later than that of the engine."""
_LOAD_COLOUR = "#2c5aa0"
"""Colour of loads, and of what happens between the beads."""
_FRICTION_COLOUR = LARGE_BEAD
_LEAST_VELOCITY = 2.0
"""Velocity above which a sketch has arrows of the motion, mm/s."""
SHOWN = "fig1b"
"""The case that the figure shows."""
WITHOUT_FRICTION: dict[str, float] = {"contact.friction.bead_bead": 0.0}
"""Changes of the case that take the friction between the beads away."""
WITHOUT_VISCOSITY: dict[str, float] = {"liquid.viscosity_ratio": 0.0}
"""Changes of the case that take the viscous forces of the bridges away."""


def shown_case() -> Case:
    """The case that the figure shows, resolved."""
    return load_case(SHOWN)


def cycle() -> AxialMotion:
    """The motion of the walker through a cycle, by the theory.

    Raises
    ------
    ValueError
        If its motion is not periodic.
    """
    case = shown_case()
    motion = axial_motion(case, Walker.of_case(case))
    if motion is None:
        raise ValueError("expected a periodic motion")
    return motion


def _fastest(motion: AxialMotion) -> dict[str, int]:
    """The steps in which the walker is fastest, ``ahead`` and ``back``."""
    return {"ahead": int(np.argmax(motion.velocity)), "back": int(np.argmin(motion.velocity))}


def _times(motion: AxialMotion) -> FloatArray:
    """The middle of each step, cycles."""
    steps = len(motion.velocity)
    return (np.arange(steps) + 0.5) / steps


def _friction(case: Case, motion: AxialMotion) -> FloatArray:
    """The friction between the beads in each step, N."""
    coefficient = case.contact.friction.between_beads.coefficient(np.abs(motion.sliding[2]))
    return np.asarray(coefficient * motion.normal[2])


def numbers(out: Path) -> dict[str, float]:
    """Velocities (mm/s), loads and frictions (µN) that the page quotes.

    Parameters
    ----------
    out
        Folder with runs; missing ones are made.
    """
    motion = cycle()
    friction = _friction(shown_case(), motion)
    values: dict[str, float] = {}
    for direction, step in _fastest(motion).items():
        values[f"{direction}_speed"] = 1e3 * abs(float(motion.velocity[step]))
        values[f"{direction}_sliding_speed"] = 1e3 * abs(float(motion.sliding[2, step]))
        values[f"{direction}_load"] = 1e6 * float(motion.normal[2, step])
        values[f"{direction}_friction"] = 1e6 * float(friction[step])
    values["mean_velocity"] = 1e3 * float(motion.velocity.mean())
    for name, changes in (("frictionless", WITHOUT_FRICTION), ("inviscid", WITHOUT_VISCOSITY)):
        values[name] = 1e3 * float(walk(load_case(SHOWN, changes), out).result["velocity"])
    return values


@styled
def figure(run: Run) -> Figure:
    """Four sketches of the walker, and below them its velocity and loads through a cycle.

    Parameters
    ----------
    run
        The run of `shown_case` with the velocities of the engine.
    """
    case = shown_case()
    motion = cycle()
    steps = len(motion.velocity)
    turns = np.flatnonzero(np.diff(np.sign(motion.velocity))).tolist()
    moments = sorted([*_fastest(motion).values(), *turns[:2]])
    drawn = new_figure(TWO_COLUMNS, 4.2)
    grid = drawn.add_gridspec(2, 4, height_ratios=(1.0, 1.6))
    sketches = [drawn.add_subplot(grid[0, column]) for column in range(4)]
    for axes, step, words in zip(sketches, moments, _WORDS, strict=True):
        _sketch(axes, dimer_of(case), motion, step)
        axes.set_title(f"{step / steps:.2f} of a cycle: {words}", fontsize="small")
    courses = [drawn.add_subplot(grid[1, :2]), drawn.add_subplot(grid[1, 2:])]
    _draw_velocity(courses[0], motion, run)
    _draw_loads(courses[1], case, motion)
    for axes in courses:
        for step in moments:
            axes.axvline(step / steps, color="0.8", lw=0.8, zorder=0)
        axes.set(xlabel="time (cycles of the drive)", xlim=(0.0, 1.0))
        axes.legend(fontsize="small", loc="best")
    letter_panels([*sketches, *courses])
    return drawn


def _sketch(axes: Axes, dimer: Dimer, motion: AxialMotion, step: int) -> None:
    """Draw the beads, how they move, and the loads of the three contacts at a moment."""
    large = 1e3 * dimer.radii[0]
    small = 1e3 * dimer.radii[1]
    distance = 2.0 * np.sqrt(large * small)
    centres = np.array([[distance, large], [0.0, small]])
    for centre, radius, colour in zip(
        centres, (large, small), (LARGE_BEAD, SMALL_BEAD), strict=True
    ):
        axes.add_patch(
            Circle(tuple(centre), radius, facecolor=colour, alpha=0.35, edgecolor=colour)
        )
    axes.axhline(0.0, color="0.3", lw=1.5)
    velocity = 1e3 * float(motion.velocity[step])
    if abs(velocity) > _LEAST_VELOCITY:
        start = 0.5 * distance - 0.012 * velocity
        axes.annotate(
            "",
            xy=(0.5 * distance + 0.012 * velocity, 0.85),
            xytext=(start, 0.85),
            arrowprops={"arrowstyle": "-|>", "color": "k", "lw": 1.5},
        )
        for centre, radius, spin in zip(centres, (large, small), motion.spin[:, step], strict=True):
            _draw_turn(axes, centre, 0.55 * radius, clockwise=spin > 0.0)
    lengths = _LENGTH_OF_LOAD * motion.normal[:, step]
    for centre, length in zip(centres, lengths[:2], strict=True):
        _draw_load(axes, np.array([centre[0], 0.0]), np.array([0.0, 1.0]), length)
    toward_large = (centres[0] - centres[1]) / np.linalg.norm(centres[0] - centres[1])
    touching = centres[1] + small * toward_large
    _draw_load(axes, touching, toward_large, lengths[2])
    _draw_load(axes, touching, -toward_large, lengths[2])
    axes.set(xlim=(-0.4, distance + 0.45), ylim=(-0.05, 0.95), aspect="equal")
    axes.axis("off")


def _draw_turn(axes: Axes, centre: np.ndarray, radius: float, *, clockwise: bool) -> None:
    """Draw an arc with an arrow that shows how a bead turns."""
    angles = np.radians(np.linspace(150.0, 30.0, 20))
    if not clockwise:
        angles = angles[::-1]
    x = centre[0] + radius * np.cos(angles)
    y = centre[1] + radius * np.sin(angles)
    axes.plot(x[:-1], y[:-1], color="k", lw=0.9)
    axes.annotate(
        "", xy=(x[-1], y[-1]), xytext=(x[-3], y[-3]), arrowprops={"arrowstyle": "-|>", "color": "k"}
    )


def _draw_load(axes: Axes, point: np.ndarray, direction: np.ndarray, length: float) -> None:
    """Draw the normal force that presses a surface at a point."""
    axes.annotate(
        "",
        xy=tuple(point + length * direction),
        xytext=tuple(point),
        arrowprops={"arrowstyle": "-|>", "color": _LOAD_COLOUR, "lw": 1.8},
    )


def _draw_velocity(axes: Axes, motion: AxialMotion, run: Run) -> None:
    """Draw the velocity of the walker, and that at which the beads slide on each other."""
    time = _times(motion)
    axes.plot(time, 1e3 * motion.velocity, color="k", label="walker, theory")
    axes.plot(time, 1e3 * motion.sliding[2], color=_LOAD_COLOUR, label="bead on bead, theory")
    recorded = run.motion
    walker = gait(recorded.groups[0])
    last_cycle = slice(-int(recorded.case.run.samples_per_cycle) - 1, -1)
    phase = (recorded.time[last_cycle] * recorded.case.excitation.frequency + _DELAY) % 1.0
    axes.plot(phase, 1e3 * walker.velocity[last_cycle, 0], "o", color="k", ms=3, label="engine")
    axes.plot(phase, 1e3 * walker.sliding[last_cycle, 0, 2], "o", color=_LOAD_COLOUR, ms=3)
    axes.axhline(1e3 * motion.velocity.mean(), color="k", ls=":", label="mean of the walker")
    axes.set(ylabel="velocity (mm/s)", title="walker and surfaces", ylim=(-45.0, 85.0))


def _draw_loads(axes: Axes, case: Case, motion: AxialMotion) -> None:
    """Draw the load and the friction of the contact between the beads."""
    time = _times(motion)
    axes.plot(time, 1e6 * motion.normal[2], color=_LOAD_COLOUR, label="load")
    axes.plot(time, 1e6 * _friction(case, motion), color=_FRICTION_COLOUR, label="friction")
    axes.set(ylabel="force (µN)", title="between the beads", ylim=(0.0, None))
