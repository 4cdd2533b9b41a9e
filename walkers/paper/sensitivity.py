"""What the disagreements with the paper depend on: the shipped sweep ``sensitivity``, one parameter at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from walkers.paper import published
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.postprocess.steady_state import on_axis, steady_walkers
from walkers.postprocess.tables import read_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
"""What is varied, and the column that says so (the friction of bead on bead goes with that of bead on wall)."""
_TOGETHER = "uncalibrated"
_EXPERIMENT = ["dimers.radii[0]", "drive.frequency", "drive.peak_acceleration", "dimers.angle"]


def misalignment(run: str | Path) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Angles of a run's walkers to the drive axis at the end, whichever way they face, degrees, each 0 to 90."""
    ends = np.degrees(read_table(run, "walkers")["orientation_end"].to_numpy())
    angles: np.ndarray[tuple[int], np.dtype[np.float64]] = np.abs((ends + 90.0) % 180.0 - 90.0)
    return angles


_MEASURES: Mapping[str, Callable[[str], float]] = {
    "mm/s": lambda run: float(steady_walkers(run)["velocity"].mean()) * 1e3,
    "%": lambda run: 100.0 * float((~on_axis(read_table(run, "walkers"))).mean()),
    "°": lambda run: float(misalignment(run).max()),
}
"""Mean velocity of those that are steady (NaN if none is), share of walkers off the axis in the end, largest angle."""


class Observation(NamedTuple):
    """Something that the paper observes, as a number of a set of parameters.

    Attributes
    ----------
    name
        With its unit.
    published
        The paper's.
    unit
        That says what is measured (`_MEASURES`).
    of, over
        Of which experiment, as R1 (mm), frequency (Hz), peak acceleration (g) and start (degrees); and of which the
        ratio to it is taken.
    """

    name: str
    published: float
    unit: str
    of: tuple[float, ...]
    over: tuple[float, ...] | None = None


_STRONG, _SIX = (0.3, 60.0, 10.0, 0.0), (0.3, 60.0, 6.0, 0.0)
OBSERVATIONS = (
    Observation("Fig. 2: v at 80 Hz, 4 g (mm/s)", published.FIT[4.0] * 1e3, "mm/s", (0.3, 80.0, 4.0, 0.0)),
    Observation(
        "Fig. 3: v for 0.4/0.2 mm (mm/s)", published.FIG3_FIT[0.4, 0.2] * 1e3, "mm/s", (0.4, 80.0, 3.0612, 0.0)
    ),
    Observation("Fig. 2: v(90 Hz)/v(60 Hz) at 6 g", 1.0, "mm/s", (0.3, 90.0, 6.0, 0.0), _SIX),
    Observation("plateau: v(10 g)/v(6 g) at 60 Hz", 1.0, "mm/s", _STRONG, _SIX),
    Observation("walkers astray at 60 Hz, 10 g (%)", 0.0, "%", _STRONG),
    Observation("angle after a start at 60° (°)", 0.0, "°", (0.3, 80.0, 4.0, 60.0)),
)


def sensitivities(sources: Sources) -> pd.DataFrame:
    """The observations for the shipped parameters and for each parameter lower and higher.

    Returns
    -------
    DataFrame
        A row a set of parameters, in the order of the sweep: ``parameter`` (``shipped``, one of `PARAMETERS`, or
        ``uncalibrated``), ``value``, and a column an observation: NaN where a run of it is not finished, and for speeds
        of which no walker is left on the axis.
    """
    import pandas as pd

    table = sources.table("sensitivity").copy()
    keys = [*PARAMETERS.values(), "contact.friction.bead_bead"]
    shipped = table[keys].iloc[0]
    rows = []
    for values, group in table.groupby(keys, sort=False):
        changed = [name for name, key in PARAMETERS.items() if group[key].iloc[0] != shipped[key]]
        name = changed[0] if len(changed) == 1 else _TOGETHER if changed else "shipped"
        value = values[keys.index(PARAMETERS[name])] if name in PARAMETERS else np.nan
        runs = group[group["status"] == "finished"].set_index(_EXPERIMENT)["run"]
        found = {one.name: _value(one, runs) for one in OBSERVATIONS}
        rows.append({"parameter": name, "value": value, **found})
    return pd.DataFrame(rows)


def _value(observation: Observation, runs: pd.Series[str]) -> float:
    try:
        values = [_MEASURES[observation.unit](runs[one]) for one in (observation.of, observation.over) if one]
    except KeyError:  # a run that it needs is missing
        return np.nan
    return values[0] / values[1] if observation.over else values[0]


_NO_RANGE = 1e-6


@styled
def fig_sensitivity(sources: Sources) -> Figure:
    """A tornado plot: a panel an observation, a bar a parameter from its lower to its higher value."""
    found = sensitivities(sources)
    figure, axes = new_figure(TWO_COLUMNS, 7.4, nrows=2, ncols=len(OBSERVATIONS) // 2, sharey=True)
    for panel, observation in zip(axes.flat, OBSERVATIONS, strict=True):
        _tornado(panel, found, observation)
    names = [_label(found, name) for name in PARAMETERS]
    axes[0, 0].set_yticks(range(len(names) + 1), [*names, "friction 0.07,\nliquid as it is"])
    axes[0, 0].invert_yaxis()
    letter_panels(axes.flat)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return figure


def _label(found: pd.DataFrame, parameter: str) -> str:
    low, high = sorted(found["value"][found["parameter"] == parameter])
    return f"{parameter}\n{low:.3g} … {high:.3g}"


def _tornado(axes: Axes, found: pd.DataFrame, observation: Observation) -> None:
    shipped = float(found[observation.name][found["parameter"] == "shipped"].iloc[0])
    known = bool(np.isfinite(shipped))
    for place, name in enumerate(PARAMETERS):
        rows = found[found["parameter"] == name].sort_values("value")
        ends = rows[observation.name].to_numpy()
        styles = zip(ends, (-0.17, 0.17), ("0.75", "0.35"), ("lower", "higher"), strict=True)
        for end, offset, colour, label in styles:
            told = label if place == 0 else None
            if not known:  # bars have nothing to begin at
                axes.plot(end, place + offset, "o", color=colour, mec="0.1", ms=6)
                continue
            axes.barh(place + offset, end - shipped, 0.32, shipped, fc=colour, ec="0.1", lw=0.5, label=told)
    together = found[found["parameter"] == _TOGETHER][observation.name]
    axes.plot(together, [len(PARAMETERS)] * len(together), "D", color="C2", ms=6, label=_TOGETHER)
    if known:
        axes.axvline(shipped, color="0.1", lw=1.0, label="shipped")
    else:
        axes.set_title("shipped: none on the axis")
    axes.axvline(observation.published, color="C1", ls="--", lw=1.4, label="published")
    axes.margins(x=0.08)
    low, high = axes.get_xlim()
    if high - low < _NO_RANGE:  # nothing changes it: a scale of its rounding would say nothing
        axes.set_xlim(low - 1.0, high + 1.0)
    axes.set_xlabel(observation.name)
    axes.grid(axis="y", visible=False)
