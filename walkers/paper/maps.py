"""Figures beyond the paper: alignment of dimers, modes of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.paper.published import FIG3_FIT, GRAVITY, OBSERVATIONS, Sources, described, of_asymmetry, shipped
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.postprocess.gait import gait, settled_samples
from walkers.postprocess.sides import REST
from walkers.theory.mathieu import Alignment, alignment, is_stable, turning
from walkers.theory.prediction import MOVING, motion_of, pendulum_of
from walkers.theory.quasistatic import FloatArray, detachment, translation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Group

SLIDES = 0.1
"""Ratio of rms sliding velocity to rms rotation velocity above which the large bead slides."""
MODES = {
    "at rest": ("x", "0.1"),
    "large bead rolls": ("o", "#1f4e8c"),
    "large bead rolls and slides": ("s", "#5aa9dd"),
    "leaves the axis": ("v", "#dd9d1f"),
    "detached": ("*", "#c4473a"),
}
"""Modes with their markers and colours."""
_LARGEST_DRIVE = 10.0
"""Peak acceleration in g up to which the paper shakes."""
_BEGINNINGS, _SMALL = (15.0, 45.0), 0.15
"""Starts (degrees) whose beginnings are compared with the theory, for this time (s)."""


def paper_drives() -> dict[str, Alignment]:
    """U and V at the largest drive of each of the paper's experiments on horizontal walkers."""
    walker, large = dimer_of(shipped()), dimer_of(load_case("fig4b"))
    peak = _LARGEST_DRIVE * GRAVITY
    found = {f"Fig. 2, {f:g} Hz, 10 g": alignment(walker, f, peak) for f in (60.0, 70.0, 80.0, 90.0)}
    for r1, r2 in FIG3_FIT:
        dimer = replace(walker, radii=(r1 * 1e-3, r2 * 1e-3))
        found[f"Fig. 3, {r1:g}/{r2:g} mm"] = alignment(dimer, 80.0, dimer.peak_acceleration(0.5))
    found["Fig. 4a"] = alignment(large, 80.0, 2.0 * GRAVITY)
    found["Fig. 4b"] = alignment(large, 80.0, peak)
    return found


def climber(*, large_bead_below: bool) -> Alignment:
    """U and V of the shipped climber, shaken and pulled along its wall."""
    case = load_case("climber-dimer")
    weight = case.axial_gravity if large_bead_below else -case.axial_gravity
    return alignment(dimer_of(case), case.excitation.frequency, case.excitation.peak_acceleration, weight)


@styled
def fig_alignment(sources: Sources) -> Figure:
    """ψ(t) of asymmetric and symmetric dimers, its first cycles with the theory, and the stability chart."""
    from matplotlib import colormaps
    from matplotlib.ticker import MultipleLocator

    table, dark_to_green = sources.finished("alignment"), colormaps["viridis"]
    figure, axes = new_figure(TWO_COLUMNS, 6.0, mosaic=[["asymmetric", "symmetric"], ["beginning", "chart"]])
    beginning = axes["beginning"]
    for name in ("asymmetric", "symmetric"):
        for _, row in OBSERVATIONS[f"alignment_{name}"].of[0].rows(table).iterrows():
            trajectory, angle = sources.trajectory(row["run"]), row["dimers.angle"]
            strobe, colour = trajectory.case.run.samples_per_cycle, dark_to_green(0.8 * angle / 90.0)
            lines = axes[name].plot(
                trajectory.time[::strobe], np.degrees(trajectory.orientation[::strobe]), color=colour
            )
            lines[0].set_label(f"{angle:g}°")
            if name == "asymmetric" and angle in _BEGINNINGS:
                _draw_beginning(beginning, trajectory, colour)
        axes[name].set(xlabel="time (s)", ylabel=r"orientation $\psi$ (°)")
    beginning.set(xlabel="time (ms)", ylabel=r"orientation $\psi$ (°)")
    for name in ("asymmetric", "symmetric", "beginning"):
        few = np.ptp(axes[name].get_ylim()) < 720.0
        axes[name].yaxis.set_major_locator(MultipleLocator(90.0 if few else 180.0))
    axes["asymmetric"].set_title("asymmetric: along the axis, ψ = 0, ±180°, …")
    axes["symmetric"].set_title("symmetric: across the axis, ψ = ±90°")
    handles, labels = axes["asymmetric"].get_legend_handles_labels()
    title = "(a) to (c): started at an angle of"
    figure.legend(handles, labels, title=title, loc="outside lower center", ncols=len(labels))
    beginning.plot([], [], color="0.2", label="engine")
    beginning.plot([], [], "--", color="0.2", label="rolling without sliding")
    legend_below(beginning, ncols=2)
    beginning.set_title("asymmetric: the first cycles, one facing each way")
    _draw_chart(axes["chart"])
    letter_panels(axes.values())
    figure.suptitle("; ".join(dict.fromkeys(described(sources.trajectory(run).case) for run in table["run"])))
    return figure


def _draw_beginning(axes: Axes, trajectory: Group, colour: tuple[float, ...]) -> None:
    """Each walker with the solution for the same start."""
    drive, few = trajectory.case.excitation, trajectory.time <= _SMALL
    time = trajectory.time[few]
    for number, walker in enumerate(trajectory.walkers):
        psi = trajectory.orientation[few, number]
        axes.plot(time * 1e3, np.degrees(psi), color=colour)
        # The substrate moves as sin 2πft: it accelerates as -sin 2πft along x, along or against the heading.
        phase = pi / 2.0 * walker.facing
        predicted = turning(pendulum_of(trajectory.case), float(psi[0]), pi * drive.frequency * time, phase)
        axes.plot(time * 1e3, np.degrees(predicted), "--", color=colour, lw=0.9)


def _draw_chart(axes: Axes) -> None:
    """The stable region of the (V, U) plane, after McLachlan, with the paper's drives in it."""
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 401), np.linspace(-0.4, 1.4, 361))
    axes.contourf(v, u, is_stable(u, v), levels=[0.5, 1.5], colors=["0.87"])
    axes.contour(v, u, is_stable(u, v).astype(float), levels=[0.5], colors=["0.4"], linewidths=0.8)
    for number, prefix in enumerate(("Fig. 2", "Fig. 3", "Fig. 4")):
        points = [one for name, one in paper_drives().items() if name.startswith(prefix)]
        axes.plot([one.v for one in points], [one.u for one in points], "osD"[number], color=f"C{number}", label=prefix)
    for below, marker, label in ((True, "v", "climber, large bead below"), (False, "^", "climber, large bead above")):
        one = climber(large_bead_below=below)
        axes.plot(one.v, one.u, marker, color="C4", ms=5, label=f"{label}: U = {one.u:.1g}")
    axes.axvline(OBSERVATIONS["mathieu"].si, color="0.45", ls="-.", lw=0.8, label="paper's bound, 0.4")
    axes.set(xlabel="V", ylabel="U", title="where small angles stay small (grey)", ylim=(-0.4, 1.4))
    legend_below(axes, ncols=2)


# --- modes of motion --------------------------------------------------------------------------------------------------


def sliding_share(trajectory: Group) -> float:
    """Sliding over rotation velocity of the large beads after the settling cycles, root mean squares."""
    motion, samples = gait(trajectory), settled_samples(trajectory)
    return _share(motion.sliding[samples][..., 0].ravel(), motion.rotation[samples][..., 0].ravel())


def _share(sliding: FloatArray, rotation: FloatArray) -> float:
    largest = float(np.sqrt(np.mean(rotation**2)))
    return float(np.sqrt(np.mean(sliding**2))) / largest if largest > REST else 0.0


def classify(table: pd.DataFrame, shares: Sequence[float]) -> npt.NDArray[np.int64]:
    """The mode of each finished point of a sweep, an index in `MODES`; ``shares`` are their `sliding_share`.

    The first mode that applies: detached (a contact is open in some samples); at rest (velocity and mean sliding of the
    large bead below `REST`); leaves the axis (some replicates not steady or turned round); slides (`SLIDES`); rolls.
    """
    opened = table[["open_1", "open_2", "open_pair_1"]].max(axis=1) > 0.0
    still = (table["velocity"].abs() < REST) & (table["sliding_1"].abs() < REST)
    astray = (table["steady"] < table["walkers"]) | (table["turned_round"] > 0)
    modes: npt.NDArray[np.int64] = np.select([opened, still, astray, np.asarray(shares) > SLIDES], [4, 0, 3, 2], 1)
    return modes


@styled
def fig_modes(sources: Sources) -> Figure:
    """Γ0 against sin δ: modes of the engine with the borders of the models, and velocity of the engine."""
    table, case = sources.finished("modes"), shipped()
    modes = classify(table, [sliding_share(sources.trajectory(run)) for run in table["run"]])
    figure, (kinds, speeds) = new_figure(TWO_COLUMNS, 4.4, ncols=2, sharey=True)
    for mode, (name, (marker, colour)) in enumerate(MODES.items()):
        here = modes == mode
        look: dict[str, Any] = {"color": colour} if marker == "x" else {"fc": colour, "ec": "0.1"}
        look |= {"marker": marker, "s": 36.0 if marker == "*" else 20.0, "label": f"{name} ({here.sum()})"}
        kinds.scatter(table["sin_delta"][here], table["gamma0"][here], lw=0.5, **look)
    _draw_borders(kinds, float(table["gamma0"].max()))
    kinds.set(ylabel=r"dimensionless peak force $\Gamma_0$", ylim=(0.0, None), title="modes in the engine")
    speed = table["velocity"].to_numpy() * 1e3
    low, high = np.nanpercentile(speed, (2.0, 95.0))  # a few values must not set the scale
    look = {"cmap": "viridis", "vmin": min(low, 0.0), "vmax": high}
    drawn = speeds.scatter(table["sin_delta"], table["gamma0"], c=speed, marker="s", s=26, **look)
    speeds.set_title("velocity in the engine")
    figure.colorbar(drawn, ax=speeds, label="velocity (mm/s)", extend="both", location="right")
    for panel in (kinds, speeds):
        panel.set_xlabel(r"asymmetry $\sin\delta$")
    letter_panels((kinds, speeds))
    radius, drive = f"mean R = {dimer_of(case).mean_radius * 1e3:g} mm", f"{case.excitation.frequency:g} Hz"
    figure.suptitle(f"{radius}, {drive}, {case.liquid.name}")
    figure.legend(*kinds.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _draw_borders(axes: Axes, top: float) -> None:
    """Borders by Coulomb friction and bridges: the walker starts, slides, detaches; and the quasi-static limit."""
    case, sines = shipped(), np.linspace(0.005, 0.4, 33)
    gammas = np.concatenate([np.linspace(0.02, 0.4, 58)[:-1], np.linspace(0.4, 1.15 * top, 14)])
    motion = motion_of(*[of_asymmetry(case, float(sine), float(gamma)) for sine in sines for gamma in gammas])
    velocity = translation(motion.series)
    shares = [_share(*pair) for pair in zip(motion.series[0], velocity - motion.series[0], strict=True)]
    moves = (np.abs(motion.sliding[0]) > MOVING) | (np.abs(motion.velocity) > MOVING)
    borders = (
        ("Γc", "-", moves),
        ("slides", "--", moves & (np.array(shares) > SLIDES)),
        ("detaches", "-.", motion.opened),
    )
    for name, style, condition in borders:
        rows = condition.reshape(-1, len(gammas))
        smallest = np.where(rows.any(axis=1), gammas[rows.argmax(axis=1)], np.nan)
        nowhere = "" if rows.any() else f": nowhere below {gammas[-1]:.2g}"
        axes.plot(sines, smallest, style, color="0.1", lw=1.3, label=f"theory: {name}{nowhere}")
    end = np.sqrt(2.0) * detachment(sines).gamma
    axes.plot(sines, end, ":", color="0.1", lw=1.6, label="paper's model, quasi-static ±Γ0/√2: detaches")
