"""Figs. 2 and 3: the walker's velocity against its drive and its asymmetry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.inputs.loads import dimer_of
from walkers.paper import dimers, published
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import ONE_COLUMN, TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.sweeps.table import thresholds
from walkers.theory.prediction import motion_of, threshold
from walkers.theory.quasistatic import detachment, mean_velocity

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = {60.0: "D", 70.0: "o", 80.0: "^", 90.0: "s"}
"""The paper's symbols by frequency, Hz."""
_DASHES = ("-", (0, (6, 2)), (0, (3, 2)), (0, (1, 1.5)))
"""From the lowest frequency to the highest."""
_FINE = 61


@styled
def fig2(sources: Sources) -> Figure:
    """Velocity against peak acceleration at four frequencies, dry friction alone, and the threshold of motion."""
    table, case = sources.finished("fig2"), dimers.shipped()
    dimer = dimer_of(case)
    rows = [["engine", "dry"], ["engine", "threshold"]]
    figure, axes = new_figure(TWO_COLUMNS, 4.8, mosaic=rows, width_ratios=[1.5, 1.0], height_ratios=[1.4, 1.0])
    engine, dry = axes["engine"], axes["dry"]
    top = float(table["peak_acceleration"].max()) / published.GRAVITY
    peaks = np.linspace(0.02, top, _FINE) * published.GRAVITY
    gammas = np.array([dimer.gamma0(peak) for peak in peaks])
    paper = mean_velocity(gammas, dimer.sin_delta) * 1e3
    for number, frequency in enumerate(sorted(table["frequency"].unique())):
        rows_there = table[table["frequency"] == frequency]
        colour, dashes = f"C{number}", _DASHES[number % len(_DASHES)]
        look = {
            "fmt": MARKERS[frequency],
            "color": colour,
            "ms": 4,
            "lw": 0.7,
            "mew": 0.8,
            "label": f"{frequency:g} Hz",
        }
        _points(engine, rows_there["peak_acceleration"] / published.GRAVITY, rows_there, **look)
        cases = dimers.driven(case, frequency, peaks)
        engine.plot(peaks / published.GRAVITY, motion_of(*cases).velocity * 1e3, ls=dashes, color=colour, lw=0.9)
        slippery = motion_of(*cases, viscous=False).velocity * 1e3
        dry.plot(peaks / published.GRAVITY, slippery, ls=dashes, color=colour, label=f"{frequency:g} Hz")
    for panel in (engine, dry):
        panel.plot(peaks / published.GRAVITY, paper, color="0.45", lw=2.0, zorder=0)
        panel.plot(list(published.FIT), np.array(list(published.FIT.values())) * 1e3, "*", color="0.45", ms=8, zorder=0)
        panel.axhline(0.0, color="0.4", lw=0.6)
        panel.set(xlabel=r"peak acceleration $a_0$ (g, 9.8 m/s²)", ylabel="velocity (mm/s)", xlim=(0.0, top * 1.03))
    # The paper's fit goes on beyond what the paper measured: that is not to flatten the rest.
    engine.set_ylim(*_limits([*table["smallest"], *table["largest"], *published.FIT.values()]))
    engine.set_title("engine, and theory with bridges")
    dry.set_title("theory: Coulomb friction, dry")
    dry.locator_params(nbins=5)
    above = engine.secondary_xaxis(
        "top", functions=(lambda g: g * dimer.gamma0(published.GRAVITY), lambda x: x / dimer.gamma0(published.GRAVITY))
    )
    above.set_xlabel(r"dimensionless peak force $\Gamma_0$")
    engine.plot([], [], color="0.2", lw=0.9, label="lines: Coulomb friction, bridges")
    engine.plot([], [], color="0.45", lw=2.0, marker="*", ms=8, label="paper's fit, κ = 0.033 s/mm")
    legend_below(engine, ncols=3, title="symbols: engine, mean and range of 6 walkers; in (c) of 2")
    legend_below(dry, ncols=4, columnspacing=1.0, handlelength=1.8, handletextpad=0.4)
    _threshold(axes["threshold"], sources)
    letter_panels((engine, dry, axes["threshold"]))
    figure.suptitle(f"{_beads(dimer.radii)}, {case.liquid.name}")
    return figure


def _limits(speeds: Sequence[float]) -> tuple[float, float]:
    """From below zero and all speeds, m/s, to above them, mm/s."""
    low, high = min(0.0, np.nanmin(speeds) * 1e3), np.nanmax(speeds) * 1e3
    return low - 0.04 * (high - low), high + 0.1 * (high - low)


def _points(axes: Axes, x: pd.Series[float], rows: pd.DataFrame, **look: Any) -> None:
    """Means with bars from the smallest to the largest of the walkers, as in the paper."""
    mean, low, high = (rows[name].to_numpy() * 1e3 for name in ("velocity", "smallest", "largest"))
    axes.errorbar(x, mean, yerr=[mean - low, high - mean], mfc="none", **look)


def _threshold(axes: Axes, sources: Sources) -> None:
    """Γc by the paper's protocol: between the last drive that moved the walkers and the first that did not."""
    sources.finished("fig2-threshold")
    ends = thresholds(sources.out / "fig2-threshold")
    for number, row in enumerate(ends.to_dict("records")):
        frequency = row["drive.frequency"]
        bounds = [row["gamma0_at_rest"], row["gamma0_moving"]]
        middle, half = sum(bounds) / 2.0, (bounds[1] - bounds[0]) / 2.0
        axes.errorbar(
            frequency, middle, yerr=half, fmt=MARKERS[float(frequency)], color=f"C{number}", ms=4, lw=1.0, mfc="none"
        )
    case = dimers.shipped()
    predicted = [threshold(one) for f in MARKERS for one in dimers.driven(case, f, [case.drive.peak_acceleration])]
    axes.plot(list(MARKERS), predicted, "--", color="0.2", lw=0.9)
    known = np.array([*ends["gamma0_moving"], *ends["gamma0_at_rest"], *predicted], dtype=float)
    axes.set(ylim=(0.0, 1.3 * float(np.nanmax(known))), xlim=(55.0, 95.0), xticks=list(MARKERS))
    axes.locator_params(axis="y", nbins=5)
    axes.set(title="threshold of motion; dashed: theory", xlabel="frequency (Hz)", ylabel=r"$\Gamma_\mathrm{c}$")


@styled
def fig3(sources: Sources) -> Figure:
    """Velocity against asymmetry at Γ0 = 0.5."""
    table, case = sources.finished("fig3"), dimers.shipped()
    figure, axes = new_figure(ONE_COLUMN, 4.1)
    sines = np.linspace(1e-3, 0.4, _FINE)
    gamma0 = float(table["gamma0"].iloc[0])
    axes.plot(sines, mean_velocity(gamma0, sines) * 1e3, color="0.45", lw=2.0, label="paper's fit, κ = 0.033 s/mm")
    fitted = [((r1 - r2) / (r1 + r2), v * 1e3) for (r1, r2), v in published.FIG3_FIT.items()]
    axes.plot(*zip(*fitted, strict=True), "*", color="0.45", ms=8)
    for viscous, style, label in (
        (True, "--", "Coulomb friction, bridges, mean R 0.25 mm"),
        (False, ":", "Coulomb friction, dry, mean R 0.25 mm"),
    ):
        cases = [dimers.of_asymmetry(case, sine, gamma0) for sine in sines]
        axes.plot(sines, motion_of(*cases, viscous=viscous).velocity * 1e3, style, color="0.1", lw=0.9, label=label)
    same = [dimers.of_radii(case, (row["radius_1"], row["radius_2"]), gamma0) for _, row in table.iterrows()]
    axes.plot(
        table["sin_delta"],
        motion_of(*same).velocity * 1e3,
        "x",
        color="0.1",
        ms=6,
        label="Coulomb friction, bridges, these beads",
    )
    _points(axes, table["sin_delta"], table, fmt="s", color="C2", ms=5, label="engine")
    _name_pairs(axes, table)
    _mark_end(axes, gamma0)
    axes.set(
        xlabel=r"asymmetry $\sin\delta = (R_1 - R_2)/(R_1 + R_2)$",
        ylabel="velocity (mm/s)",
        xlim=(-0.01, 0.41),
        ylim=(-0.3, None),
    )
    figure.suptitle(rf"$\Gamma_0$ = {gamma0:g}, {case.drive.frequency:g} Hz, {case.liquid.name}")
    legend_below(axes)
    return figure


def _name_pairs(axes: Axes, table: pd.DataFrame) -> None:
    """The beads above the axes, where they meet no symbol; upright, for some asymmetries are nearly the same."""
    above = axes.secondary_xaxis("top")
    pairs = [f"{row['radius_1'] * 1e3:g}/{row['radius_2'] * 1e3:g}" for _, row in table.iterrows()]
    above.set_xticks(table["sin_delta"], pairs, rotation=90)
    above.set_xlabel("$R_1/R_2$ (mm)")


def _mark_end(axes: Axes, gamma0: float) -> None:
    """Where the paper's model ends, if it does within the axes."""
    sines = np.linspace(0.0, 0.41, 400)
    ended = np.sqrt(0.5) * gamma0 >= detachment(sines).gamma
    if ended.any():
        axes.axvline(float(sines[np.argmax(ended)]), color="0.45", ls="-.", lw=0.8)


def _beads(radii: tuple[float, float]) -> str:
    return "R = " + "/".join(f"{radius * 1e3:g}" for radius in radii) + " mm"
