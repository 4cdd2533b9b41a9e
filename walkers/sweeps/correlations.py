"""Rank correlations of results with the values that a sample draws."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.postprocess.measure.uncertainty import few_draws
from walkers.sweeps.table import walking_points

if TYPE_CHECKING:
    import pandas as pd


def rank_correlations(
    done: pd.DataFrame, column: str, keys: Sequence[str]
) -> dict[str, float] | None:
    """Rank correlations of a column with drawn keys, the strongest first, if larger than two standard errors.

    Points without a number and walkers that came apart do not count. None if the draws are too few (`few_draws`).
    """
    points = walking_points(done).dropna(subset=column)
    if few_draws(len(points), len(keys)):
        return None
    ranks = {key: _rank_correlation(points[key], points[column]) for key in keys}
    certain = {key: rank for key, rank in ranks.items() if abs(rank) > 2.0 / sqrt(len(points) - 1)}
    return dict(sorted(certain.items(), key=lambda item: -abs(item[1])))


def _rank_correlation(first: Any, second: Any) -> float:
    """Spearman's correlation of two columns, the correlation of their ranks; 0 if one is constant."""
    import pandas as pd

    rank = pd.Series(first, dtype=float).rank().corr(pd.Series(second, dtype=float).rank())
    return 0.0 if np.isnan(rank) else float(rank)
