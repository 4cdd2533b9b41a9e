"""The map of modes: how a walker moves at each drive and asymmetry, in the engine, and where the models change."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from inputs.dimer import dimer_of
from paper import dimers
from paper.sources import Sources
from postprocess.drawing import new_figure
from theory.prediction import MOVING, motion_of
from theory.quasistatic import detachment

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from theory.motion import Motion

REST = 2e-6
"""A walker slower than this, m/s, is at rest."""
SLIDES = 0.1
"""The large bead slides if its mean sliding velocity is more than this share of its mean rotation velocity."""
MODES = ("at rest", "large bead rolls", "large bead rolls and slides", "leaves the axis", "detached")
_MARKERS = ("x", "o", "s", "v", "*")


def classify(table: pd.DataFrame) -> npt.NDArray[np.int64]:
    """The mode of each point of a sweep, a place in `MODES`; -1 where it is not finished.

    Detached goes before all others: a contact open in some of the samples. Then at rest: velocity and the large bead's
    sliding below `REST`. Then leaves the axis: not all replicates steady, or some turned round. What is left rolls, or
    slides by more than `SLIDES` of its rotation as well.
    """
    opened = table[["open_1", "open_2", "open_3"]].max(axis=1) > 0.0
    still = (table["velocity"].abs() < REST) & (table["sliding_1"].abs() < REST)
    astray = (table["steady"] < table["walkers"]) | (table["turned_round"] > 0)
    slides = table["sliding_1"].abs() > SLIDES * table["rotation_1"].abs()
    modes = np.select([opened, still, astray, slides], [4, 0, 3, 2], default=1)
    return np.where(table["status"] == "finished", modes, -1)


def fig_modes(sources: Sources) -> Figure:
    """Γ0 against sin δ: the engine's modes as symbols, velocity as lightness, the models' borders as lines."""
    table = sources.table("modes")
    modes, speed = classify(table), table["velocity"].to_numpy() * 1e3
    figure, axes = new_figure(7.2, 5.0)
    shades = {"cmap": "cividis", "vmin": 0.0, "vmax": float(np.nanmax(speed))}
    scale = None
    for mode, (name, marker) in enumerate(zip(MODES, _MARKERS, strict=True)):
        here = modes == mode
        count = f"{name} ({here.sum()})"
        place = table["sin_delta"][here], table["gamma0"][here]
        if marker == "x":
            axes.scatter(*place, marker=marker, color="0.1", s=30, label=count)
            continue
        drawn = axes.scatter(*place, c=speed[here], marker=marker, s=46, ec="0.1", lw=0.5, label=count, **shades)
        scale = drawn if here.any() else scale
    if scale is not None:
        figure.colorbar(scale, ax=axes, label="velocity in the engine (mm/s)")
    _borders(axes, float(table["gamma0"].max()))
    axes.set(xlabel=r"asymmetry $\sin\delta$", ylabel=r"dimensionless peak force $\Gamma_0$", ylim=(0.0, None))
    case = dimers.shipped()
    axes.set_title(f"mean R = {dimer_of(case).mean_radius * 1e3:g} mm, {case.drive.frequency:g} Hz, {case.liquid.name}")
    figure.legend(loc="outside lower center", ncols=3, fontsize=7)
    return figure


def _borders(axes: Axes, top: float) -> None:
    """Where Coulomb friction and the bridges say that the walker starts, slides, detaches; the quasi-static end."""
    case = dimers.shipped()
    sines = np.linspace(0.0, 0.4, 33)
    gammas = np.concatenate([np.linspace(0.02, 0.4, 58)[:-1], np.linspace(0.4, 1.15 * top, 14)])
    grid = [dimers.of_asymmetry(case, float(sine), float(gamma)) for sine in sines for gamma in gammas]
    borders = _borders_of(motion_of(*grid), gammas)
    for (name, gamma), style in zip(borders.items(), ("-", "--", "-."), strict=True):
        told = f"theory: {name}" if np.isfinite(gamma).any() else f"theory: {name}: nowhere below {gammas[-1]:.2g}"
        axes.plot(sines, gamma, style, color="0.1", lw=1.3, label=told)
    end = np.sqrt(2.0) * detachment(sines).gamma
    axes.plot(sines, end, ":", color="0.1", lw=1.6, label="theory: detaches, quasi-static ±Γ0/√2")


def _borders_of(motion: Motion, gammas: npt.NDArray[np.float64]) -> dict[str, npt.NDArray[np.float64]]:
    """For each asymmetry the smallest Γ0 at which a walker moves, its large bead slides, a contact opens."""
    moves = (np.abs(motion.sliding[0]) > MOVING) | (np.abs(motion.velocity) > MOVING)
    slides = np.abs(motion.sliding[0]) > np.maximum(SLIDES * np.abs(motion.rotation[0]), MOVING)
    found = {}
    for name, condition in (("Γc", moves), ("slides", slides), ("detaches", motion.opened)):
        rows = condition.reshape(-1, len(gammas))
        found[name] = np.where(rows.any(axis=1), gammas[rows.argmax(axis=1)], np.nan)
    return found
