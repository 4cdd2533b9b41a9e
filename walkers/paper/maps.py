"""Figures beyond the paper: alignment of dimers, modes of motion, climbing, trays."""

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
    from matplotlib.collections import PathCollection
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
POSTURES = {"climbs upright": "^", "stays, upright": "o", "slides down upright": "v", "leans": "D", "turns over": "X"}
"""Postures on a wall with their markers."""
STAYS = 5e-5
"""m/s; slower clusters count as at rest (a tenth of a radius per second)."""
_SHAPES = {"chain": "dimer", "fan": "fan: large, two small", "diamond": "diamond: large, two small, small"}
_MAPS = (
    ("climb-friction", "contact.friction.bead_wall", "friction, on a wall"),
    ("climb-tilt", "boundary.tilt", "tilt (°), friction 0.5"),
)
"""Rows of maps: sweep, key along x, and its label."""
_SPEEDS = (-10.0, -3.0, -1.0, 0.0, 1.0, 3.0, 10.0)
"""mm/s; ticks of the colour scale."""
_SIDE_BY_SIDE = 5
"""Number of clusters in a row."""
_OF_TRAYS = {
    "share in clusters": ("clustered_share",),
    "share in the largest cluster": ("largest_share",),
    "order": ("nematic_order", "polar_order"),
    "speed, joined / free": ("speed_ratio",),
    "share of slow walkers": ("slow_share",),
}
"""Columns of a sweep's table (solid and dashed lines) by the label of their panel."""
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
    drive, few = trajectory.case.drive, trajectory.time <= _SMALL
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


# --- on a wall --------------------------------------------------------------------------------------------------------


def postures(table: pd.DataFrame) -> npt.NDArray[np.int64]:
    """Posture of the walkers of each point of a sweep, an index in `POSTURES`.

    Turns over if any walker does; leans if any walker does not end upright; else climbs, slides down, or stays (slower
    than `STAYS`).
    """
    turned, leaning, speed = table["turned_round"] > 0, table["upright"] < table["walkers"], table["axial_velocity"]
    found: npt.NDArray[np.int64] = np.select([turned, leaning, speed < -STAYS, speed < STAYS], [4, 3, 2, 1], 0)
    return found


@styled
def fig_climbing(sources: Sources) -> Figure:
    """Dimer, fan and diamond: viscosity of the bridges against friction on a wall, and against tilt."""
    from matplotlib.lines import Line2D

    figure, rows = new_figure(TWO_COLUMNS, 4.8, nrows=2, ncols=3, sharey=True)
    for axes, (sweep, key, label) in zip(rows, _MAPS, strict=True):
        table = sources.finished(sweep)
        for one, (shape, name) in zip(axes, _SHAPES.items(), strict=True):
            drawn = _draw_map(one, table[table["clusters[0].arrangement"] == shape], key)
            one.set(xlabel=label, title=name if sweep == "climb-friction" else "")
        axes[0].set(ylabel="bridges' viscosity over the liquid's", yscale="log")
    letter_panels(rows.flat)
    figure.colorbar(drawn, ax=rows, label="up the slope (mm/s)", shrink=0.6, extend="both", ticks=_SPEEDS, format="%g")
    handles = [
        Line2D([], [], ls="", marker=marker, color="0.2", mfc="0.85", ms=5.5, mew=0.5, label=name)
        for name, marker in POSTURES.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    return figure


def _draw_map(axes: Axes, table: pd.DataFrame, key: str) -> PathCollection:
    """Draw the points of a sweep by posture; return points with the common colour scale."""
    from matplotlib.colors import SymLogNorm

    found = postures(table)
    shades = SymLogNorm(1.0, vmin=_SPEEDS[0], vmax=_SPEEDS[-1])  # a few fast ones must not set the scale
    for posture, marker in enumerate(POSTURES.values()):
        here = table[found == posture]
        drawn = axes.scatter(
            here[key], here["liquid.viscosity_ratio"], c=here["axial_velocity"] * 1e3, marker=marker, s=26, cmap="RdBu",
            norm=shades, ec="0.2", lw=0.4,
        )  # fmt: skip
    return drawn


@styled
def fig_zoo(sources: Sources) -> Figure:
    """Each cluster after one second, with its velocity and posture."""
    entries = []
    for sweep in ("zoo", "zoo-corner"):
        table = sources.finished(sweep)
        entries += [(table.iloc[[number]], sweep == "zoo-corner") for number in range(len(table))]
    rows = -(-len(entries) // _SIDE_BY_SIDE)
    figure, axes = new_figure(TWO_COLUMNS, 1.74 * rows, nrows=rows, ncols=_SIDE_BY_SIDE, squeeze=False)
    for one in axes.flat:
        one.set_axis_off()
    for one, (row, corner) in zip(axes.flat, entries, strict=False):
        _draw_cluster(one, sources.trajectory(row["run"].iloc[0]))
        speed = round(float(row["axial_velocity"].iloc[0]) * 1e3, 2) + 0.0  # not -0.00
        does = list(POSTURES)[int(postures(row)[0])]
        one.set_title(f"{does}{chr(10) + 'in a corner' if corner else ''}\n{speed:.2f} mm/s", size=7)
        if corner:
            one.axvline(0.0, color="0.8", lw=0.8, zorder=0)
    letter_panels(axes.flat[: len(entries)])
    first = axes.flat[0]
    first.plot([-0.5, 0.5], [-1.75, -1.75], color="0.1", lw=1.5, solid_capstyle="butt")
    first.annotate("1 mm", (0.0, -1.75), (0, -3), textcoords="offset points", ha="center", va="top", fontsize=7)
    first.annotate("g", (-1.3, 0.0), (-1.3, 1.4), ha="center", fontsize=8, arrowprops={"arrowstyle": "-|>", "fc": "k"})
    tilted = sources.trajectory(entries[0][0]["run"].iloc[0]).case.boundary.tilted
    figure.suptitle(f"{tilted}: up is against gravity, speeds are positive upward; dotted: at the start")
    return figure


def _draw_cluster(axes: Axes, group: Group) -> None:
    """The beads of the first walker in front of the wall, uphill is up; dotted at the start."""
    from matplotlib.patches import Circle

    for frame, style in ((0, {"ls": ":", "fc": "none", "ec": "0.6"}), (-1, {"fc": "#c9d2d8", "ec": "0.2"})):
        place = group.position[frame, 0] * 1e3
        place = place - place.mean(axis=0)
        for (x, y, _), radius in zip(place, group.radii * 1e3, strict=True):
            large = frame and radius > group.case.border * 1e3
            axes.add_patch(Circle((-y, x), radius, lw=0.8, **{**style, **({"fc": "#e0566c"} if large else {})}))
    axes.set(xlim=(-1.5, 1.5), ylim=(-2.15, 2.15), aspect="equal")


# --- trays ------------------------------------------------------------------------------------------------------------


@styled
def fig_trays(sources: Sources) -> Figure:
    """Clustering, alignment and jamming of walkers on closed trays against acceleration; one column per coverage."""
    from matplotlib.lines import Line2D

    table = sources.finished("tray-phases")
    shares = {"largest_share": table["largest_cluster"] / table["walkers"], "percent": (100.0 * table["coverage"])}
    table = table.assign(**shares).round({"percent": 0})
    coverages, numbers = sorted(table["percent"].unique()), sorted(table["walkers"].unique())
    size = {"nrows": len(_OF_TRAYS), "ncols": len(coverages), "sharex": True, "sharey": "row", "squeeze": False}
    figure, rows = new_figure(TWO_COLUMNS, 7.6, **size)
    for panels, (label, columns) in zip(rows, _OF_TRAYS.items(), strict=True):
        panels[0].set_ylabel(label)
        for panel, coverage in zip(panels, coverages, strict=True):
            for place, number in enumerate(numbers):
                here = table[(table["percent"] == coverage) & (table["walkers"] == number)]
                for column, style in zip(columns, ("-", "--"), strict=False):
                    seeds = here.groupby("drive.peak_acceleration")[column]
                    mean = seeds.mean()
                    errors = [mean - seeds.min(), seeds.max() - mean]
                    x = mean.index * 1.06 ** (place - 1)
                    panel.errorbar(x, mean, errors, fmt="os^D"[place], ls=style, color=f"C{place}", ms=3.5, capsize=2)
            panel.set_xscale("log")
            panel.set_xticks(ticks := sorted(table["drive.peak_acceleration"].unique()), [f"{one:g}" for one in ticks])
            panel.set_xticks([], minor=True)
    for panel, coverage in zip(rows[0], coverages, strict=True):
        panel.set_title(f"{coverage:g} % covered")
    for panel in rows[-1]:
        panel.set_xlabel("peak acceleration (g)")
    letter_panels(rows.flat)
    handles = [
        Line2D([], [], label=f"{number} walkers", marker="os^D"[place], color=f"C{place}")
        for place, number in enumerate(numbers)
    ]
    handles += [
        Line2D([], [], color="0.3", ls=style, label=name) for name, style in (("nematic", "-"), ("polar", "--"))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    return figure
