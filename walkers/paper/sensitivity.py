"""What the disagreements with the paper depend on: the shipped sweep ``sensitivity``, one parameter at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from walkers.paper.comparison import evaluate
from walkers.paper.published import OBSERVATIONS, Sources
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled

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
OBSERVED = {
    "fig2_4g": "Fig. 2: v at 80 Hz, 4 g (mm/s)",
    "fig3_0.4_0.2": "Fig. 3: v for 0.4/0.2 mm (mm/s)",
    "fig2_frequency": "Fig. 2: v(90 Hz)/v(60 Hz) at 6 g",
    "fig2_plateau": "plateau: v(10 g)/v(6 g) at 60 Hz",
    "astray": "walkers astray at 60 Hz, 10 g (%)",
    "angle_after_60": "angle after a start at 60° (°)",
}
"""Of `walkers.paper.published.OBSERVATIONS` those that are shown, and what they are of in the sweep."""
_TOGETHER = "uncalibrated"
_NO_RANGE = 1e-6


def sensitivities(sources: Sources) -> pd.DataFrame:
    """`OBSERVED` for the shipped parameters and for each parameter lower and higher, in the order of the sweep.

    Columns are ``parameter`` (``shipped``, one of `PARAMETERS`, or ``uncalibrated``), its ``value``, and the
    observations: NaN where a run is not finished, and for speeds of which no walker is left on the axis.
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
    """A tornado plot: a panel an observation, a bar a parameter from its lower to its higher value."""
    found = sensitivities(sources)
    figure, axes = new_figure(TWO_COLUMNS, 7.4, nrows=2, ncols=len(OBSERVED) // 2, sharey=True)
    names = []
    for name in PARAMETERS:
        low, high = sorted(found["value"][found["parameter"] == name])
        names.append(f"{name}\n{low:.3g} … {high:.3g}")
    for panel, key in zip(axes.flat, OBSERVED, strict=True):
        _tornado(panel, found, key)
    axes[0, 0].set_yticks(range(len(names) + 1), [*names, "friction 0.07,\nliquid as it is"])
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
            told = label if place == 0 else None
            if known:
                axes.barh(place + offset, end - shipped, 0.32, shipped, fc=colour, ec="0.1", lw=0.5, label=told)
            else:  # bars have nothing to begin at
                axes.plot(end, place + offset, "o", color=colour, mec="0.1", ms=6)
    together = found[found["parameter"] == _TOGETHER][key]
    axes.plot(together, [len(PARAMETERS)] * len(together), "D", color="C2", ms=6, label=_TOGETHER)
    if known:
        axes.axvline(shipped, color="0.1", lw=1.0, label="shipped")
    else:
        axes.set_title("shipped: none on the axis")
    axes.axvline(OBSERVATIONS[key].value or 0.0, color="C1", ls="--", lw=1.4, label="published")
    axes.margins(x=0.08)
    low, high = axes.get_xlim()
    if high - low < _NO_RANGE:  # nothing changes it: a scale of its rounding would say nothing
        axes.set_xlim(low - 1.0, high + 1.0)
    axes.set_xlabel(OBSERVED[key])
    axes.grid(axis="y", visible=False)
