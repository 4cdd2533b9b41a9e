"""How dimers turn into or across the shaking axis, beside the Mathieu equation."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.paper import dimers, published
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.theory.mathieu import Alignment, alignment, is_stable, turning
from walkers.theory.prediction import pendulum_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Group

LARGEST_DRIVE = 10.0
"""Peak acceleration in g up to which the paper shakes."""
_BEGINNINGS = (15.0, 45.0)
"""Starts in degrees whose first cycles are compared …"""
_SMALL = 0.15
"""… for so many seconds."""


@styled
def fig_alignment(sources: Sources) -> Figure:
    """ψ(t) of asymmetric and symmetric dimers, its beginning beside theory, and the chart of stability."""
    table = sources.finished("alignment")
    figure, axes = new_figure(TWO_COLUMNS, 6.0, mosaic=[["asymmetric", "symmetric"], ["beginning", "chart"]])
    shown = {"asymmetric": ~dimers.symmetric(table), "symmetric": dimers.symmetric(table)}
    for name, chosen in shown.items():
        for _, row in table[chosen].iterrows():
            _turns(axes[name], sources.trajectory(row["run"]), row["dimers.angle"])
        _mark_quarters(axes[name])
    axes["asymmetric"].set_title("asymmetric: along the axis, ψ = 0, ±180°, …")
    axes["symmetric"].set_title("symmetric: across the axis, ψ = ±90°")
    handles, labels = axes["asymmetric"].get_legend_handles_labels()
    figure.legend(
        handles, labels, title="(a) to (c): started at an angle of", loc="outside lower center", ncols=len(labels)
    )
    asymmetric = table[shown["asymmetric"]]
    for _, row in asymmetric[asymmetric["dimers.angle"].isin(_BEGINNINGS)].iterrows():
        _beginning(axes["beginning"], sources.trajectory(row["run"]), row["dimers.angle"])
    axes["beginning"].plot([], [], color="0.2", label="engine")
    axes["beginning"].plot([], [], "--", color="0.2", label="rolling without sliding")
    legend_below(axes["beginning"], ncols=2)
    axes["beginning"].set_title("asymmetric: the first cycles, one facing each way")
    _mark_quarters(axes["beginning"])
    _chart(axes["chart"])
    letter_panels(axes.values())
    kinds = dict.fromkeys(dimers.described(sources.trajectory(run).case) for run in table["run"])
    figure.suptitle("; ".join(kinds))
    return figure


def _shade(angle: float) -> tuple[float, float, float, float]:
    """From dark violet for a start on the axis to green for one across it; none is too light for thin lines."""
    from matplotlib import colormaps

    return colormaps["viridis"](0.8 * angle / 90.0)


def _mark_quarters(axes: Axes) -> None:
    """Ticks at quarters of a turn, or at halves if there are many."""
    from matplotlib.ticker import MultipleLocator

    axes.yaxis.set_major_locator(MultipleLocator(90.0 if np.ptp(axes.get_ylim()) < 720.0 else 180.0))


def _turns(axes: Axes, trajectory: Group, angle: float) -> None:
    strobe = trajectory.case.run.samples_per_cycle
    lines = axes.plot(trajectory.time[::strobe], np.degrees(trajectory.orientation[::strobe]), color=_shade(angle))
    lines[0].set_label(f"{angle:g}°")
    axes.set(xlabel="time (s)", ylabel=r"orientation $\psi$ (°)")


def _beginning(axes: Axes, trajectory: Group, angle: float) -> None:
    """Each walker with the solution that begins as it does."""
    drive, parameters = trajectory.case.drive, pendulum_of(trajectory.case)
    few = trajectory.time <= _SMALL
    for number, walker in enumerate(trajectory.walkers):
        psi = trajectory.orientation[few, number]
        axes.plot(trajectory.time[few] * 1e3, np.degrees(psi), color=_shade(angle))
        # The substrate moves as sin 2πft: it accelerates as -sin 2πft along x, to or against the heading.
        phase = pi / 2.0 * walker.facing
        predicted = turning(parameters, float(psi[0]), pi * drive.frequency * trajectory.time[few], phase)
        axes.plot(trajectory.time[few] * 1e3, np.degrees(predicted), "--", color=_shade(angle), lw=0.9)
    axes.set(xlabel="time (ms)", ylabel=r"orientation $\psi$ (°)")


def paper_drives() -> dict[str, Alignment]:
    """U and V at the largest drive of each of the paper's experiments on horizontal walkers."""
    walker, large = dimer_of(dimers.shipped()), dimer_of(load_case("fig4b"))
    peak = LARGEST_DRIVE * published.GRAVITY
    found = {f"Fig. 2, {f:g} Hz, 10 g": alignment(walker, f, peak) for f in (60.0, 70.0, 80.0, 90.0)}
    for r1, r2 in published.FIG3_FIT:
        dimer = replace(walker, radii=(r1 * 1e-3, r2 * 1e-3))
        found[f"Fig. 3, {r1:g}/{r2:g} mm"] = alignment(dimer, 80.0, dimer.peak_acceleration(0.5))
    found["Fig. 4a"] = alignment(large, 80.0, 2.0 * published.GRAVITY)
    found["Fig. 4b"] = alignment(large, 80.0, peak)
    return found


def climber(large_bead_below: bool) -> Alignment:
    """U and V of the shipped climber, shaken and pulled along its wall."""
    case = load_case("climber-dimer")
    weight = case.axial_gravity if large_bead_below else -case.axial_gravity
    return alignment(dimer_of(case), case.drive.frequency, case.drive.peak_acceleration, weight)


def _chart(axes: Axes) -> None:
    """The stable region of the (V, U) plane, after McLachlan, with the paper's drives in it."""
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 401), np.linspace(-0.4, 1.4, 361))
    axes.contourf(v, u, is_stable(u, v), levels=[0.5, 1.5], colors=["0.87"])
    axes.contour(v, u, is_stable(u, v).astype(float), levels=[0.5], colors=["0.4"], linewidths=0.8)
    for number, prefix in enumerate(("Fig. 2", "Fig. 3", "Fig. 4")):
        points = [one for name, one in paper_drives().items() if name.startswith(prefix)]
        axes.plot([one.v for one in points], [one.u for one in points], "osD"[number], color=f"C{number}", label=prefix)
    for below, marker, label in ((True, "v", "climber, large bead below"), (False, "^", "climber, large bead above")):
        one = climber(below)
        axes.plot(one.v, one.u, marker, color="C4", ms=5, label=f"{label}: U = {one.u:.1g}")
    axes.axvline(published.BY_KEY["mathieu"].si, color="0.45", ls="-.", lw=0.8, label="paper's bound, 0.4")
    axes.set(xlabel="V", ylabel="U", title="where small angles stay small (grey)", ylim=(-0.4, 1.4))
    legend_below(axes, ncols=2)
