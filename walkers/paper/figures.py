"""Figs. 1b, 2, 3 and 4 of the paper: engine, theory and published values; sensitivity to the parameters."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.inputs.loads import dimer_of
from walkers.paper import published
from walkers.paper.comparison import evaluate
from walkers.paper.published import GRAVITY, OBSERVATIONS, Sources, described, driven, of_asymmetry, of_radii, shipped
from walkers.postprocess.drawing import (
    ONE_COLUMN,
    TWO_COLUMNS,
    errors_seen,
    legend_below,
    letter_panels,
    new_figure,
    styled,
)
from walkers.postprocess.gait import gait
from walkers.postprocess.necks import bridges_at
from walkers.postprocess.scene import Scene, Window, axes_toward
from walkers.sweeps.table import load, thresholds
from walkers.theory.prediction import motion_of, threshold
from walkers.theory.quasistatic import FloatArray, detachment, mean_velocity, translation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Group

_INTERVAL, _IMAGES = 0.3, 6
"""Fig. 1b: seconds between images, and number of images."""
_MARKERS = {60.0: "D", 70.0: "o", 80.0: "^", 90.0: "s"}
"""Fig. 2: the paper's symbols by frequency, Hz."""
_DASHES = ("-", (0, (6, 2)), (0, (3, 2)), (0, (1, 1.5)))
"""Dashes from the lowest to the highest frequency."""
_FINE = 61
_CYCLES = 2
"""Cycles of Fig. 4."""
_SERIES = (
    ("walker", "velocity", "s", "#c4473a", 7.5),
    ("large bead", "rotation_1", "o", "#111111", 5.0),
    ("small bead", "rotation_2", "^", "#1f5fa8", 2.5),
)
"""Fig. 4: name, column of a sweep's table, marker, colour, and size, so that none hides another."""
_PUBLISHED_DASHES = (0, (6, 2, 1, 2))


@styled
def fig1b(sources: Sources) -> Figure:
    """The first dimer of the sweep ``alignment`` that starts on the axis, seen from above every 0.3 s."""
    table = OBSERVATIONS["alignment_asymmetric"].of[0].rows(sources.finished("alignment"))
    trajectory = sources.trajectory(table.sort_values("dimers.angle")["run"].iloc[0])
    case, largest = trajectory.case, float(trajectory.radii.max())
    cycles = round(_INTERVAL * case.excitation.frequency)
    frames = np.arange(_IMAGES) * cycles * case.run.samples_per_cycle
    frames = frames[frames < len(trajectory.time)]
    centre = trajectory.mass_centre[frames, 0] @ np.stack([trajectory.drive_axis, trajectory.across_axis], axis=-1)
    along = (float(centre[:, 0].min()) - 2.4 * largest, float(centre[:, 0].max()) + 2.4 * largest)
    half, origin = 1.15 * largest, float(centre[0, 0])
    row = 0.97 * ONE_COLUMN * 2.0 * half / (along[1] - along[0]) + 0.22
    figure, axes = new_figure(ONE_COLUMN, len(frames) * row + 0.75, nrows=len(frames), sharex=True)
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
    figure.suptitle(f"{described(case)}\nan image every {cycles} cycles")
    return figure


def _errorbars(axes: Axes, x: pd.Series[float], rows: pd.DataFrame, *, seen: bool, **look: Any) -> None:
    """Means, with bars from the smallest to the largest walker, as in the paper, if the range is visible."""
    mean, low, high = (rows[name].to_numpy() * 1e3 for name in ("velocity", "smallest", "largest"))
    axes.errorbar(x, mean, yerr=[mean - low, high - mean] if seen else None, mfc="none", **look)


def _range_seen(rows: pd.DataFrame) -> bool:
    """Whether any range of velocities exceeds the size of a symbol."""
    return errors_seen((rows["largest"] - rows["smallest"]) / 2.0, rows["velocity"])


@styled
def fig2(sources: Sources) -> Figure:
    """Velocity against peak acceleration at four frequencies, dry friction alone, and the threshold of motion."""
    table, case = sources.finished("fig2"), shipped()
    dimer, seen = dimer_of(case), _range_seen(table)
    rows = [["engine", "dry"], ["engine", "threshold"]]
    figure, axes = new_figure(TWO_COLUMNS, 4.8, mosaic=rows, width_ratios=[1.5, 1.0], height_ratios=[1.4, 1.0])
    engine, dry = axes["engine"], axes["dry"]
    top = float(table["peak_acceleration"].max()) / GRAVITY
    peaks = np.linspace(0.02, top, _FINE) * GRAVITY
    paper = mean_velocity(np.array([dimer.gamma0(peak) for peak in peaks]), dimer.sin_delta) * 1e3
    for number, frequency in enumerate(sorted(table["frequency"].unique())):
        there, name = table[table["frequency"] == frequency], f"{frequency:g} Hz"
        line: dict[str, Any] = {"color": f"C{number}", "ls": _DASHES[number % len(_DASHES)]}
        symbol = {"fmt": _MARKERS[frequency], "color": line["color"], "ms": 4, "lw": 0.7, "mew": 0.8}
        _errorbars(engine, there["peak_acceleration"] / GRAVITY, there, seen=seen, label=name, **symbol)
        cases = driven(case, frequency, peaks)
        engine.plot(peaks / GRAVITY, motion_of(*cases).velocity * 1e3, lw=0.9, **line)
        dry.plot(peaks / GRAVITY, motion_of(*cases, viscous=False).velocity * 1e3, label=name, **line)
    for panel in (engine, dry):
        panel.plot(peaks / GRAVITY, paper, color="0.45", lw=2.0, zorder=0)
        panel.plot(list(published.FIT), np.array(list(published.FIT.values())) * 1e3, "*", color="0.45", ms=8, zorder=0)
        panel.axhline(0.0, color="0.4", lw=0.6)
        panel.set(xlabel=r"peak acceleration $a_0$ (g, 9.8 m/s²)", ylabel="velocity (mm/s)", xlim=(0.0, top * 1.03))
    # The paper's fit extends beyond its measurements; this part must not set the scale.
    measured = [*table["smallest"], *table["largest"], *published.FIT.values()]
    low, high = min(0.0, np.nanmin(measured) * 1e3), np.nanmax(measured) * 1e3
    engine.set_ylim(low - 0.04 * (high - low), high + 0.1 * (high - low))
    engine.set_title("engine, and theory with bridges")
    dry.set_title("theory: Coulomb friction, dry")
    dry.locator_params(nbins=5)
    scale = dimer.gamma0(GRAVITY)
    above = engine.secondary_xaxis("top", functions=(lambda g: g * scale, lambda gamma0: gamma0 / scale))
    above.set_xlabel(r"dimensionless peak force $\Gamma_0$")
    engine.plot([], [], color="0.2", lw=0.9, label="lines: Coulomb friction, bridges")
    engine.plot([], [], color="0.45", lw=2.0, marker="*", ms=8, label="paper's fit, κ = 0.033 s/mm")
    text = "mean and range of 6 walkers" if seen else "mean of 6 walkers, their range is smaller"
    legend_below(engine, ncols=3, title=f"symbols: engine, {text}; in (c) of 2")
    legend_below(dry, ncols=4, columnspacing=1.0, handlelength=1.8, handletextpad=0.4)
    _threshold(axes["threshold"], sources)
    letter_panels((engine, dry, axes["threshold"]))
    figure.suptitle(f"R = {'/'.join(f'{radius * 1e3:g}' for radius in dimer.radii)} mm, {case.liquid.name}")
    return figure


def _threshold(axes: Axes, sources: Sources) -> None:
    """Γc by the protocol of the paper: between the last drive with motion and the first one without."""
    sources.finished("fig2-threshold")
    ends = thresholds(load(sources.out / "fig2-threshold"))
    bounds = ends[["gamma0_at_rest", "gamma0_moving"]].to_numpy(dtype=float)
    for number, (frequency, (low, high)) in enumerate(zip(ends["drive.frequency"], bounds, strict=True)):
        look: dict[str, Any] = {"fmt": _MARKERS[float(frequency)], "color": f"C{number}", "ms": 4, "lw": 1.0}
        axes.errorbar(frequency, (low + high) / 2.0, yerr=(high - low) / 2.0, mfc="none", **look)
    case = shipped()
    predicted = [threshold(driven(case, frequency, [case.excitation.peak_acceleration])[0]) for frequency in _MARKERS]
    axes.plot(list(_MARKERS), predicted, "--", color="0.2", lw=0.9)
    axes.set(ylim=(0.0, 1.3 * float(np.nanmax([*bounds.flat, *predicted]))))
    axes.set(xlim=(55.0, 95.0), xticks=list(_MARKERS))
    axes.locator_params(axis="y", nbins=5)
    axes.set(title="threshold of motion; dashed: theory", xlabel="frequency (Hz)", ylabel=r"$\Gamma_\mathrm{c}$")


@styled
def fig3(sources: Sources) -> Figure:
    """Velocity against asymmetry at Γ0 = 0.5."""
    table, case = sources.finished("fig3"), shipped()
    figure, axes = new_figure(ONE_COLUMN, 4.1)
    sines, gamma0 = np.linspace(1e-3, 0.4, _FINE), float(table["gamma0"].iloc[0])
    axes.plot(sines, mean_velocity(gamma0, sines) * 1e3, color="0.45", lw=2.0, label="paper's fit, κ = 0.033 s/mm")
    fitted = [((r1 - r2) / (r1 + r2), v * 1e3) for (r1, r2), v in published.FIG3_FIT.items()]
    axes.plot(*zip(*fitted, strict=True), "*", color="0.45", ms=8)
    cases = [of_asymmetry(case, sine, gamma0) for sine in sines]
    for viscous, style, name in ((True, "--", "bridges"), (False, ":", "dry")):
        label = f"Coulomb friction, {name}, mean R 0.25 mm"
        axes.plot(sines, motion_of(*cases, viscous=viscous).velocity * 1e3, style, color="0.1", lw=0.9, label=label)
    pairs = list(zip(table["radius_1"], table["radius_2"], strict=True))
    same = motion_of(*[of_radii(case, radii, gamma0) for radii in pairs]).velocity * 1e3
    axes.plot(table["sin_delta"], same, "x", color="0.1", ms=6, label="Coulomb friction, bridges, these beads")
    seen = _range_seen(table)
    text = "engine, mean and range" if seen else "engine, mean (the range is smaller than the symbol)"
    _errorbars(axes, table["sin_delta"], table, seen=seen, fmt="s", color="C2", ms=5, label=text)
    # The beads stand above the axes, away from symbols; upright, because some asymmetries are nearly the same.
    above = axes.secondary_xaxis("top")
    above.set_xticks(table["sin_delta"], [f"{one * 1e3:g}/{other * 1e3:g}" for one, other in pairs], rotation=90)
    above.set_xlabel("$R_1/R_2$ (mm)")
    shown = np.linspace(0.0, 0.41, 400)
    if (ended := np.sqrt(0.5) * gamma0 >= detachment(shown).gamma).any():  # the paper's model does
        axes.axvline(float(shown[np.argmax(ended)]), color="0.45", ls="-.", lw=0.8)
    axes.set(xlabel=r"asymmetry $\sin\delta = (R_1 - R_2)/(R_1 + R_2)$", ylabel="velocity (mm/s)")
    axes.set(xlim=(-0.01, 0.41), ylim=(-0.3, None))
    figure.suptitle(rf"$\Gamma_0$ = {gamma0:g}, {case.excitation.frequency:g} Hz, {case.liquid.name}")
    legend_below(axes)
    return figure


@styled
def fig4(sources: Sources) -> Figure:
    """Velocity and rotation of the beads over two cycles: the large bead rolls, or rolls and slides."""
    from matplotlib.lines import Line2D

    table = sources.finished("fig4")
    figure, axes = new_figure(TWO_COLUMNS, 3.6, ncols=2)
    means: dict[str, list[str]] = {name: [] for name, *_ in _SERIES}
    for panel, letter, peak in zip(axes, "ab", published.FIG4_PEAKS, strict=True):
        keys = {"walker": f"fig4{letter}_velocity", "large bead": f"fig4{letter}_rotation"}
        known = {name: OBSERVATIONS[key].si * 1e3 for name, key in keys.items() if key in OBSERVATIONS}
        for _, row in table[np.isclose(table["peak_acceleration"], peak * GRAVITY)].iterrows():
            trajectory = sources.trajectory(row["run"])
            _draw_cycles(panel, trajectory)
            panel.set_title(f"{described(trajectory.case)}, $\\Gamma_0$ = {row['gamma0']:.3g}")
            for name, column, *_ in _SERIES:
                paper = f", published {known[name]:g}" if name in known else ""
                means[name].append(f"({letter}) {row[column] * 1e3:.2f}{paper}")
        for name, _, _, colour, _ in _SERIES:
            if name in known:
                panel.axhline(known[name], color=colour, ls=_PUBLISHED_DASHES, lw=1.0)
    letter_panels(axes)
    handles = [
        Line2D([], [], ls="", marker=marker, ms=ms, mfc="none", color=colour, label=f"{name}: {'; '.join(means[name])}")
        for name, _, marker, colour, ms in _SERIES
    ]
    handles.append(Line2D([], [], color="0.3", lw=0.9, label="lines: Coulomb friction and drag"))
    handles.append(Line2D([], [], color="0.3", lw=1.0, ls=_PUBLISHED_DASHES, label="published means"))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, title="means in mm/s")
    return figure


def _draw_cycles(axes: Axes, trajectory: Group) -> None:
    """Last cycles of the first walker, with the last cycle of the theory."""
    run, motion = trajectory.case.run, gait(trajectory)
    samples = run.samples_per_cycle
    last = slice((run.cycles - _CYCLES) * samples, run.cycles * samples + 1)
    values = [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]
    for (_, _, marker, colour, ms), series, line in zip(_SERIES, values, theory_of_cycles(trajectory), strict=True):
        axes.plot(np.arange(len(series)) / samples, series * 1e3, marker, color=colour, ms=ms, mfc="none", mew=0.8)
        axes.plot(np.arange(len(line)) / (len(line) - 1) * _CYCLES, line * 1e3, color=colour, lw=0.36 * ms)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(xlabel="time (cycles of the drive)", ylabel=r"velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)")


def theory_of_cycles(trajectory: Group) -> list[FloatArray]:
    """Velocity of the walker and rotation velocities of its beads by the theory, m/s, through the cycles shown.

    Starts with a cycle of the engine's drive; NaN where a contact would open.
    """
    motion = motion_of(trajectory.case)
    sliding = motion.series[:, 0] if np.isfinite(motion.velocity[0]) else np.full_like(motion.series[:, 0], np.nan)
    velocity = translation(sliding)
    # Along x, the substrate accelerates as cos 2πft in the theory, and as -sin 2πft in the engine.
    quarter = sliding.shape[1] // 4
    ahead = quarter if trajectory.walkers[0].facing > 0 else -quarter
    one = [np.roll(series, 1 - ahead) for series in (velocity, velocity - sliding[0], velocity - sliding[1])]
    return [np.concatenate([np.tile(series, _CYCLES), series[:1]]) for series in one]


# --- sensitivity to the parameters ------------------------------------------------------------------------------------

PARAMETERS = {
    "friction": "contact.friction.bead_wall",
    "rolling friction": "contact.rolling_friction",
    "minimum separation ratio": "contact.minimum_separation_ratio",
    "liquid volume fraction": "liquid.volume_fraction",
    "Young's modulus (MPa)": "contact.youngs_modulus",
    "viscosity ratio": "liquid.viscosity_ratio",
    "contact angle (°)": "liquid.contact_angle",
    "restitution": "contact.restitution",
}
"""Varied parameters and their columns (bead-bead friction varies with bead-wall friction)."""
OBSERVED = {
    "fig2_4g": "Fig. 2: v at 80 Hz, 4 g (mm/s)",
    "fig3_0.4_0.2": "Fig. 3: v for 0.4/0.2 mm (mm/s)",
    "fig2_frequency": "Fig. 2: v(90 Hz)/v(60 Hz) at 6 g",
    "fig2_plateau": "v(10 g)/v(6 g) at 60 Hz",
    "astray": "off the axis, 60 Hz, 10 g (%)",
    "angle_after_60": "angle after a start at 60° (°)",
}
"""Shown `walkers.paper.published.OBSERVATIONS`, with their labels."""
_TOGETHER = "uncalibrated"
_NO_RANGE = 1e-6


def sensitivities(sources: Sources) -> pd.DataFrame:
    """`OBSERVED` for the shipped parameters and for each parameter lower and higher, in the order of the sweep.

    Columns are ``parameter`` (``shipped``, one of `PARAMETERS`, or ``uncalibrated``), its ``value``, and the
    observations: NaN where a run is not finished, and for speeds if no walker stays on the axis.
    """
    import pandas as pd

    table = sources.table("sensitivity")
    keys = [*PARAMETERS.values(), "contact.friction.bead_bead"]
    shipped = table[keys].iloc[0]
    rows = []
    for values, group in table.groupby(keys, sort=False):
        changed = [name for name, key in PARAMETERS.items() if group[key].iloc[0] != shipped[key]]
        name = changed[0] if len(changed) == 1 else _TOGETHER if changed else "shipped"
        value = values[keys.index(PARAMETERS[name])] if name in PARAMETERS else np.nan
        done = group[group["status"] == "finished"]
        found = {key: evaluate(OBSERVATIONS[key], done).engine for key in OBSERVED}
        rows.append({"parameter": name, "value": value, **found})
    return pd.DataFrame(rows)


@styled
def fig_sensitivity(sources: Sources) -> Figure:
    """Tornado plot: one panel per observation, one bar per parameter from its lower to its higher value."""
    found = sensitivities(sources)
    figure, axes = new_figure(TWO_COLUMNS, 7.4, nrows=2, ncols=len(OBSERVED) // 2, sharey=True)
    names = []
    for name in PARAMETERS:
        low, high = sorted(found["value"][found["parameter"] == name])
        names.append(f"{name}\n{low:.3g} … {high:.3g}")
    for panel, key in zip(axes.flat, OBSERVED, strict=True):
        _tornado(panel, found, key)
    axes[0, 0].set_yticks(range(len(names) + 1), [*names, "friction 0.07,\nuncalibrated"])
    axes[0, 0].invert_yaxis()
    letter_panels(axes.flat)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _tornado(axes: Axes, found: pd.DataFrame, key: str) -> None:
    shipped = float(found[key][found["parameter"] == "shipped"].iloc[0])
    known = bool(np.isfinite(shipped))
    for place, name in enumerate(PARAMETERS):
        ends = found[found["parameter"] == name].sort_values("value")[key]
        for end, offset, colour, label in zip(ends, (-0.17, 0.17), ("0.75", "0.35"), ("lower", "higher"), strict=True):
            shown_label = label if place == 0 else None
            if known:
                axes.barh(place + offset, end - shipped, 0.32, shipped, fc=colour, ec="0.1", lw=0.5, label=shown_label)
            else:  # bars have no start
                axes.plot(end, place + offset, "o", color=colour, mec="0.1", ms=6)
    together = found[found["parameter"] == _TOGETHER][key]
    axes.plot(together, [len(PARAMETERS)] * len(together), "D", color="C2", ms=6, label=_TOGETHER)
    if known:
        axes.axvline(shipped, color="0.1", lw=1.0, label="shipped")
    else:
        axes.set_title("shipped set:\nno walker on the axis")
    axes.axvline(OBSERVATIONS[key].value or 0.0, color="C1", ls="--", lw=1.4, label="published")
    axes.margins(x=0.08)
    low, high = axes.get_xlim()
    if high - low < _NO_RANGE:  # no effect: do not scale to rounding errors
        axes.set_xlim(low - 1.0, high + 1.0)
    axes.set_xlabel(OBSERVED[key])
    axes.grid(axis="y", visible=False)
