"""Fig. 4: velocity and rotation of the beads through two cycles, where the large bead rolls and where it slides too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.paper import dimers, published
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.postprocess.gait import gait
from walkers.theory.prediction import motion_of
from walkers.theory.quasistatic import translation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from walkers.postprocess.motion import Group

_CYCLES = 2
_SERIES = (
    ("walker", "velocity", "s", "#c4473a"),
    ("large bead", "rotation_1", "o", "#111111"),
    ("small bead", "rotation_2", "^", "#1f5fa8"),
)
"""Name, column of a sweep's table, marker and colour."""
_PUBLISHED = (0, (6, 2, 1, 2))
"""Dashes of the published means."""


@styled
def fig4(sources: Sources) -> Figure:
    """Velocity and rotation velocities through two cycles, large beads."""
    table = sources.finished("fig4")
    figure, axes = new_figure(TWO_COLUMNS, 3.6, ncols=2)
    means: dict[str, list[str]] = {name: [] for name, *_ in _SERIES}
    for panel, letter, peak in zip(axes, "ab", published.FIG4_PEAKS, strict=True):
        known = _published(letter)
        rows = table[np.isclose(table["peak_acceleration"], peak * published.GRAVITY)]
        for _, row in rows.iterrows():
            trajectory = sources.trajectory(row["run"])
            _draw(panel, trajectory)
            panel.set_title(f"{dimers.described(trajectory.case)}, $\\Gamma_0$ = {row['gamma0']:.3g}")
            for name, column, *_ in _SERIES:
                paper = f", published {known[name] * 1e3:g}" if name in known else ""
                means[name].append(f"({letter}) {row[column] * 1e3:.2f}{paper}")
        for name, _, _, colour in _SERIES:
            if name in known:
                panel.axhline(known[name] * 1e3, color=colour, ls=_PUBLISHED, lw=1.0)
    letter_panels(axes)
    figure.legend(handles=_handles(means), loc="outside lower center", ncols=2, title="means in mm/s")
    return figure


def _handles(means: Mapping[str, Sequence[str]]) -> list[Line2D]:
    """Of the one legend: the engine's symbols with their means, theory, published means."""
    from matplotlib.lines import Line2D

    symbols = [
        Line2D([], [], ls="", marker=marker, ms=4, mfc="none", color=colour, label=f"{name}: {'; '.join(means[name])}")
        for name, _, marker, colour in _SERIES
    ]
    theory = Line2D([], [], color="0.3", lw=0.9, label="lines: Coulomb friction and drag")
    return [*symbols, theory, Line2D([], [], color="0.3", lw=1.0, ls=_PUBLISHED, label="published means")]


def _published(letter: str) -> dict[str, float]:
    """Published means of a panel, m/s."""
    keys = {"walker": f"fig4{letter}_velocity", "large bead": f"fig4{letter}_rotation"}
    return {name: published.BY_KEY[key].si for name, key in keys.items() if key in published.BY_KEY}


def _draw(axes: Axes, trajectory: Group) -> None:
    """The last cycles of the first walker, the theory's last cycle beside it."""
    case = trajectory.case
    samples = case.run.samples_per_cycle
    last = slice((case.run.cycles - _CYCLES) * samples, case.run.cycles * samples + 1)
    motion = gait(trajectory)
    values = [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]
    phase = np.arange(len(values[0])) / samples
    for (_, _, marker, colour), series, line in zip(_SERIES, values, model(trajectory), strict=True):
        axes.plot(phase, series * 1e3, marker, color=colour, ms=4, mfc="none", mew=0.8)
        axes.plot(np.arange(len(line)) / (len(line) - 1) * _CYCLES, line * 1e3, color=colour, lw=0.9)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(xlabel="time (cycles of the drive)", ylabel=r"velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)")


def model(trajectory: Group) -> list[npt.NDArray[np.float64]]:
    """Velocity of the walker and rotation velocities of its beads as the theory has them, through the cycles shown.

    Returns
    -------
    list of ndarray, shape (cycles × steps + 1,)
        m/s, from the begin of a cycle of the engine's drive; NaN where a contact would open.
    """
    motion = motion_of(trajectory.case)
    sliding = motion.series[:, 0] if np.isfinite(motion.velocity[0]) else np.full_like(motion.series[:, 0], np.nan)
    velocity = translation(sliding)
    # The theory's substrate accelerates as cos 2πft, the engine's, which moves as sin 2πft, as -sin 2πft along x.
    quarter = sliding.shape[1] // 4
    ahead = quarter if trajectory.walkers[0].facing > 0 else -quarter
    one = [np.roll(series, 1 - ahead) for series in (velocity, velocity - sliding[0], velocity - sliding[1])]
    return [np.concatenate([np.tile(series, _CYCLES), series[:1]]) for series in one]
