"""The map of modes: how a walker moves at each drive and asymmetry, in the engine, and where the models change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.inputs.loads import dimer_of
from walkers.paper import dimers
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.postprocess.gait import gait, settled_samples
from walkers.theory.prediction import MOVING, motion_of
from walkers.theory.quasistatic import FloatArray, detachment, translation

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Group
    from walkers.theory.motion import Motion

REST = 2e-6
"""A walker slower than this, m/s, is at rest."""
SLIDES = 0.1
"""The large bead slides if its sliding velocity is more than this share of its rotation velocity, in the rms."""
MODES = ("at rest", "large bead rolls", "large bead rolls and slides", "leaves the axis", "detached")
_LOOKS = (("x", "0.1"), ("o", "#1f4e8c"), ("s", "#5aa9dd"), ("v", "#dd9d1f"), ("*", "#c4473a"))
"""Markers and colours of the modes."""


def sliding_share(trajectory: Group) -> float:
    """Sliding over rotation velocity of the large beads after the settling cycles, root mean squares."""
    motion, samples = gait(trajectory), settled_samples(trajectory)
    return _share(motion.sliding[samples][..., 0].ravel(), motion.rotation[samples][..., 0].ravel())


def _share(sliding: FloatArray, rotation: FloatArray) -> float:
    largest = float(np.sqrt(np.mean(rotation**2)))
    return float(np.sqrt(np.mean(sliding**2))) / largest if largest > REST else 0.0


def classify(table: pd.DataFrame, shares: Sequence[float]) -> npt.NDArray[np.int64]:
    """The mode of each point of a sweep, a place in `MODES`.

    Detached goes before all others: a contact open in some of the samples. Then at rest: velocity and the large bead's
    mean sliding below `REST`. Then leaves the axis: not all replicates steady, or some turned round. What is left
    rolls, or slides as well (`SLIDES`).

    Parameters
    ----------
    table
        Finished points.
    shares
        Their `sliding_share`.
    """
    opened = table[["open_1", "open_2", "open_3"]].max(axis=1) > 0.0
    still = (table["velocity"].abs() < REST) & (table["sliding_1"].abs() < REST)
    astray = (table["steady"] < table["walkers"]) | (table["turned_round"] > 0)
    modes: npt.NDArray[np.int64] = np.select([opened, still, astray, np.asarray(shares) > SLIDES], [4, 0, 3, 2], 1)
    return modes


@styled
def fig_modes(sources: Sources) -> Figure:
    """Γ0 against sin δ: the engine's modes with the models' borders, and the engine's velocity."""
    table = sources.finished("modes")
    shares = [sliding_share(sources.trajectory(run)) for run in table["run"]]
    modes = classify(table, shares)
    figure, (kinds, speeds) = new_figure(TWO_COLUMNS, 4.4, ncols=2, sharey=True)
    for mode, (name, (marker, colour)) in enumerate(zip(MODES, _LOOKS, strict=True)):
        here = modes == mode
        place = table["sin_delta"][here], table["gamma0"][here]
        look = {"color": colour} if marker == "x" else {"fc": colour, "ec": "0.1"}
        size = 36.0 if marker == "*" else 20.0
        kinds.scatter(*place, marker=marker, s=size, lw=0.5, label=f"{name} ({here.sum()})", **look)
    _borders(kinds, float(table["gamma0"].max()))
    kinds.set(ylabel=r"dimensionless peak force $\Gamma_0$", ylim=(0.0, None), title="modes in the engine")
    _speeds(speeds, table)
    for panel in (kinds, speeds):
        panel.set_xlabel(r"asymmetry $\sin\delta$")
    letter_panels((kinds, speeds))
    case = dimers.shipped()
    radius, drive = f"mean R = {dimer_of(case).mean_radius * 1e3:g} mm", f"{case.drive.frequency:g} Hz"
    figure.suptitle(f"{radius}, {drive}, {case.liquid.name}")
    figure.legend(*kinds.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _speeds(axes: Axes, table: pd.DataFrame) -> None:
    """Velocities as colours, the slowest 2 % and the fastest 5 % beyond the scale: few are not to darken the rest."""
    speed = table["velocity"].to_numpy() * 1e3
    low, high = (float(np.nanpercentile(speed, share)) for share in (2.0, 95.0))
    drawn = axes.scatter(
        table["sin_delta"], table["gamma0"], c=speed, marker="s", s=26, cmap="viridis", vmin=min(low, 0.0), vmax=high
    )
    axes.set_title("velocity in the engine")
    axes.figure.colorbar(drawn, ax=axes, label="velocity (mm/s)", extend="both", location="right")


def _borders(axes: Axes, top: float) -> None:
    """Where Coulomb friction and the bridges say that the walker starts, slides, detaches; the quasi-static end."""
    case = dimers.shipped()
    sines = np.linspace(0.005, 0.4, 33)
    gammas = np.concatenate([np.linspace(0.02, 0.4, 58)[:-1], np.linspace(0.4, 1.15 * top, 14)])
    grid = [dimers.of_asymmetry(case, float(sine), float(gamma)) for sine in sines for gamma in gammas]
    borders = _borders_of(motion_of(*grid), gammas)
    for (name, gamma), style in zip(borders.items(), ("-", "--", "-."), strict=True):
        told = f"theory: {name}" if np.isfinite(gamma).any() else f"theory: {name}: nowhere below {gammas[-1]:.2g}"
        axes.plot(sines, gamma, style, color="0.1", lw=1.3, label=told)
    end = np.sqrt(2.0) * detachment(sines).gamma
    axes.plot(sines, end, ":", color="0.1", lw=1.6, label="paper's model, quasi-static ±Γ0/√2: detaches")


def _borders_of(motion: Motion, gammas: FloatArray) -> dict[str, FloatArray]:
    """For each asymmetry the smallest Γ0 at which a walker moves, its large bead slides, a contact opens."""
    velocity = translation(motion.series)
    shares = [_share(*pair) for pair in zip(motion.series[0], velocity - motion.series[0], strict=True)]
    moves = (np.abs(motion.sliding[0]) > MOVING) | (np.abs(motion.velocity) > MOVING)
    slides = moves & (np.array(shares) > SLIDES)
    found = {}
    for name, condition in (("Γc", moves), ("slides", slides), ("detaches", motion.opened)):
        rows = condition.reshape(-1, len(gammas))
        found[name] = np.where(rows.any(axis=1), gammas[rows.argmax(axis=1)], np.nan)
    return found
