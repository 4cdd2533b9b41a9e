"""Fig. 4: velocity and rotation of the beads through two cycles, where the large bead rolls and where it slides too."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paper import published
from paper.sources import Sources
from postprocess.drawing import new_figure
from postprocess.gait import gait
from theory.prediction import motion_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from postprocess.trajectory import Trajectory

_CYCLES = 2
_SERIES = (("walker", "s", "#c4473a"), ("large bead", "o", "#111111"), ("small bead", "^", "#1f5fa8"))


def fig4(sources: Sources) -> Figure:
    """Velocity and rotation velocities through two cycles, large beads."""
    table = sources.table("fig4").sort_values("peak_acceleration")
    figure, axes = new_figure(9.6, 4.4, ncols=2)
    for panel, letter, (_, row), speed in zip(axes, "ab", table.iterrows(), published.FIG4_VELOCITY, strict=True):
        trajectory = sources.trajectory(row["run"])
        _draw(panel, trajectory)
        panel.axhline(speed * 1e3, color="#c4473a", ls=(0, (6, 2, 1, 2)), lw=1.0)
        place = (1.01, speed * 1e3)
        told = f"published\nmean {speed * 1e3:g}"
        panel.annotate(told, place, xycoords=("axes fraction", "data"), fontsize=7, va="center", annotation_clip=False)
        drive = trajectory.case.drive
        panel.set_title(
            f"{letter}   {drive.peak_acceleration / published.GRAVITY:g} g ($\\Gamma_0$ = {row['gamma0']:.3g}), "
            f"{drive.frequency:g} Hz, {trajectory.case.liquid.name}",
            fontsize=9,
        )
    figure.suptitle("R = 0.6/0.3 mm; markers: engine, lines: Coulomb friction and bridges", fontsize=10)
    return figure


def _draw(axes: Axes, trajectory: Trajectory) -> None:
    """The last cycles of the first walker; the theory's last cycle beside it, twice."""
    case = trajectory.case
    samples = case.run.samples_per_cycle
    last = slice((case.run.cycles - _CYCLES) * samples, case.run.cycles * samples + 1)
    motion = gait(trajectory)
    values = [motion.velocity[last, 0], motion.rotation[last, 0, 0], motion.rotation[last, 0, 1]]
    phase = np.arange(len(values[0])) / samples
    model = _model(trajectory)
    for (label, marker, colour), series, line in zip(_SERIES, values, model, strict=True):
        mean = series[:-1].mean() * 1e3
        axes.plot(phase, series * 1e3, marker, color=colour, ms=4, mfc="none", label=f"{label}, mean {mean:.2f}")
        axes.plot(np.arange(len(line)) / (len(line) - 1) * _CYCLES, line * 1e3, color=colour, lw=0.9)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set(xlabel="time (cycles of the drive)", ylabel=r"velocity; beads: $-R\,\mathrm{d}\varphi/\mathrm{d}t$ (mm/s)")
    axes.legend(
        fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, title="engine, mm/s", title_fontsize=7
    )


def _model(trajectory: Trajectory) -> list[np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Walker, large and small bead through the cycles shown; nothing where a contact would open."""
    motion = motion_of(trajectory.case)
    sliding = motion.series[:, 0]
    if motion.opened[0]:
        sliding = np.full_like(sliding, np.nan)
    velocity = (sliding[0] + sliding[1] - sliding[2]) / 2.0
    # The theory's substrate accelerates as cos 2πft, the engine's, which moves as sin 2πft, as -sin 2πft along x.
    quarter = sliding.shape[1] // 4
    ahead = quarter if trajectory.layout.walkers[0].facing > 0 else -quarter
    one = [np.roll(series, 1 - ahead) for series in (velocity, velocity - sliding[0], velocity - sliding[1])]
    return [np.concatenate([np.tile(series, _CYCLES), series[:1]]) for series in one]
