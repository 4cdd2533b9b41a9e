"""Fig. 4: velocity and rotation of the beads through two cycles, where the large bead rolls and where it slides too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.paper import dimers, published
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import new_figure, styled
from walkers.postprocess.gait import gait
from walkers.theory.prediction import motion_of
from walkers.theory.quasistatic import translation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from walkers.postprocess.motion import Group

_CYCLES = 2
_SERIES = (("walker", "s", "#c4473a"), ("large bead", "o", "#111111"), ("small bead", "^", "#1f5fa8"))


@styled
def fig4(sources: Sources) -> Figure:
    """Velocity and rotation velocities through two cycles, large beads."""
    table = sources.finished("fig4")
    figure, axes = new_figure(9.6, 4.4, ncols=2)
    for panel, letter, peak in zip(axes, "ab", published.FIG4_PEAKS, strict=True):
        rows = table[np.isclose(table["peak_acceleration"], peak * published.GRAVITY)]
        for _, row in rows.iterrows():
            trajectory = sources.trajectory(row["run"])
            _draw(panel, trajectory, [row[name] for name in ("velocity", "rotation_1", "rotation_2")])
            panel.set_title(
                f"{letter}   {dimers.described(trajectory.case)}, $\\Gamma_0$ = {row['gamma0']:.3g}", fontsize=9
            )
        for name, value, colour in _published(letter):
            panel.axhline(value * 1e3, color=colour, ls=(0, (6, 2, 1, 2)), lw=1.0)
            place = (1.01, value * 1e3)
            told = f"{name} {value * 1e3:g}"
            panel.annotate(
                told, place, xycoords=("axes fraction", "data"), fontsize=7, va="center", annotation_clip=False
            )
    figure.suptitle("markers: engine, lines: Coulomb friction and drag, at the right: published means", fontsize=10)
    return figure


def _published(letter: str) -> list[tuple[str, float, str]]:
    """Published means of a panel: name, m/s, colour."""
    walker, large, _ = (colour for _, _, colour in _SERIES)
    means = [("walker", published.FIG4_VELOCITY["ab".index(letter)], walker)]
    return means if letter == "a" else [*means, ("large bead", published.FIG4B_ROTATION, large)]


def _draw(axes: Axes, trajectory: Group, means: Sequence[float]) -> None:
    """The last cycles of the first walker, the theory's last cycle beside it; means (m/s) are over all walkers."""
    case = trajectory.case
    samples = case.run.samples_per_cycle
    last = slice((case.run.cycles - _CYCLES) * samples, case.run.cycles * samples + 1)
    motion = gait(trajectory)
    values = [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]
    phase = np.arange(len(values[0])) / samples
    for (label, marker, colour), series, mean, line in zip(_SERIES, values, means, model(trajectory), strict=True):
        axes.plot(phase, series * 1e3, marker, color=colour, ms=4, mfc="none", label=f"{label}, mean {mean * 1e3:.2f}")
        axes.plot(np.arange(len(line)) / (len(line) - 1) * _CYCLES, line * 1e3, color=colour, lw=0.9)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(xlabel="time (cycles of the drive)", ylabel=r"velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)")
    axes.legend(
        fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, title="engine, mm/s", title_fontsize=7
    )


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
