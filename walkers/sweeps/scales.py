"""Scales, ranges and ticks of the axes of a sweep's figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from walkers.arrays import FloatArray
from walkers.postprocess.show.drawing import plain_text
from walkers.sweeps.factors import ROUNDING, Factor

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_FEW_TICKS = 6
"""Largest number of x values that all have ticks."""
_TICK_DISTANCE = 0.08
"""Smallest distance of such values, relative to the range."""
_MOST_LETTERS = 40
"""Largest number of letters of all categories on an x axis; names of more letters are slanted."""
_SHORT_RANGE = 40.0
"""Ratio of the ends of a logarithmic x axis below which it has ticks between powers of ten."""
_MARGIN = 0.06
"""Free space above and below the points, relative to their range."""
_LEAST_RANGE = 1e-4
"""Smallest range of the y axis relative to the mean, so that rounding errors are not shown."""


def scale_x(axes: Axes, x: Factor, log: str, further: Sequence[float] = ()) -> None:
    """Set scale and ticks of an x axis.

    Parameters
    ----------
    axes
        The axes.
    x
        The factor on the x axis. If its range is log-uniform, the axis is logarithmic.
    log
        Letters of logarithmic axes.
    further
        Places of the user's own points, in the unit of the axis.
    """
    if not x.is_number:
        _name_categories(axes, x)
        return
    is_log = x.is_log or "x" in log
    if is_log:
        axes.set_xscale("log")
    if _has_few_values(x, further):
        labels = [f"{x.without_rounding(level):.4g}" for level in x.levels]
        axes.set_xticks(x.levels, labels)
        axes.set_xticks([], minor=True)
    elif x.is_log:
        _tick_decades(axes, x)
    elif not is_log:
        _tick_linear(axes, x)


def _name_categories(axes: Axes, x: Factor) -> None:
    """Ticks with the names of categories, which are slanted if they need much space."""
    names = [plain_text(level) for level in x.levels]
    places = range(len(names))
    if len("".join(x.levels)) > _MOST_LETTERS:
        axes.set_xticks(places, names, rotation=35, ha="right", rotation_mode="anchor")
    else:
        axes.set_xticks(places, names)
    axes.set_xlim(-0.6, len(x.levels) - 0.4)  # categories are at 0, 1, 2, …


def _has_few_values(x: Factor, further: Sequence[float]) -> bool:
    """Whether each value has a tick: there are few, not too close, and no further one is beyond."""
    if x.is_sample or len(x.levels) > _FEW_TICKS:
        return False
    if any(not x.levels[0] <= place <= x.levels[-1] for place in further):
        return False
    distances = np.diff(x.levels)
    least = _TICK_DISTANCE * (x.levels[-1] - x.levels[0])
    return bool(np.all(distances > least))


def _tick_decades(axes: Axes, x: Factor) -> None:
    """Ticks at powers of ten, and for a short range at 2 and 5 times these."""
    from matplotlib.ticker import LogLocator, NullFormatter

    ticks: tuple[float, ...] = (1.0,)
    if x.levels[-1] < _SHORT_RANGE * x.levels[0]:
        ticks = (1.0, 2.0, 5.0)
    axes.xaxis.set_major_locator(LogLocator(subs=ticks))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def _tick_linear(axes: Axes, x: Factor) -> None:
    """Ticks at round numbers; few in the narrow panels of samples, where they would overlap."""
    from matplotlib.ticker import MaxNLocator

    integer = all(float(level).is_integer() for level in x.levels)
    locator = MaxNLocator("auto", steps=[1, 2, 5, 10], integer=integer)
    if x.is_sample:
        locator.set_params(nbins=4)
    axes.xaxis.set_major_locator(locator)


def scale_y(
    axes: Axes,
    points: pd.DataFrame,
    models: Sequence[FloatArray],
    log: str,
    further: FloatArray | None = None,
) -> None:
    """Set scale and range of the y axis.

    With margins, the range contains the points, their error bars and bands, all predictions of the
    first model, and at least one prediction of each other model.

    Parameters
    ----------
    axes
        Axes with which all panels share their y axis.
    points
        Columns ``value`` and ``error``, and optionally ``down``, ``low`` and ``high``.
    models
        Predictions for the points, shape (N,) each.
    log
        Letters of logarithmic axes.
    further
        Ends of the error bars of the user's own points, which the range contains too.
    """
    from matplotlib.ticker import MaxNLocator

    if "y" in log:
        axes.set_yscale("log", nonpositive="mask")
        return
    low, high = _range_of(points, models)
    if (points["value"].dropna() % 1.0 == 0.0).all():  # counts
        axes.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        low -= 0.5
        high += 0.5
    if further is not None and len(further):
        low = min(low, float(np.nanmin(further)))
        high = max(high, float(np.nanmax(further)))
    low, high = _widened(low, high)
    margin = _MARGIN * (high - low)
    axes.set_ylim(low - margin, high + margin)


def _range_of(points: pd.DataFrame, models: Sequence[FloatArray]) -> tuple[float, float]:
    """Smallest and largest number to show, see `scale_y`."""
    errors = points["error"].fillna(0.0)
    further = points.filter(["down", "low", "high"]).to_numpy().ravel()
    shown = np.concatenate(
        [points["value"] - errors, points["value"] + errors, *models[:1], further]
    )
    low = float(np.nanmin(shown))
    high = float(np.nanmax(shown))
    for model in models[1:]:
        finite = model[np.isfinite(model)]
        if len(finite):
            low = min(low, float(finite.max()))
            high = max(high, float(finite.min()))
    return low, high


def _widened(low: float, high: float) -> tuple[float, float]:
    """The range itself, or a wider one if it is as narrow as rounding errors."""
    middle = (low + high) / 2.0
    if high - low > _LEAST_RANGE * abs(middle) and high - low >= ROUNDING:
        return low, high
    half = 1.0
    if abs(middle) > ROUNDING:  # a range of a tenth of the value
        half = 0.05 * abs(middle)
    return middle - half, middle + half
