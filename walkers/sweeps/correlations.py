"""Rank correlations of results with the values that a sample draws."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from walkers.postprocess.measure.uncertainty import few_draws
from walkers.sweeps.table import walking_points

if TYPE_CHECKING:
    import pandas as pd


def rank_correlations(
    finished: pd.DataFrame, column: str, keys: Sequence[str]
) -> dict[str, float] | None:
    """Rank correlations of a result with drawn keys, if larger than two standard errors.

    Parameters
    ----------
    finished
        Rows of finished points. Points without a number in the column, or whose walkers came apart,
        do not count.
    column
        The column of the result.
    keys
        The drawn keys.

    Returns
    -------
    dict or None
        Spearman's correlations by key, the strongest first; None if the draws are too few
        (`walkers.postprocess.measure.uncertainty.few_draws`).
    """
    points = walking_points(finished).dropna(subset=column)
    if few_draws(len(points), len(keys)):
        return None
    two_standard_errors = 2.0 / sqrt(len(points) - 1)
    ranks = {}
    for key in keys:
        rank = _rank_correlation(points[key], points[column])
        if abs(rank) > two_standard_errors:
            ranks[key] = rank
    return dict(sorted(ranks.items(), key=lambda item: -abs(item[1])))


def _rank_correlation(first: pd.Series, second: pd.Series) -> float:
    """Spearman's correlation of two columns, that of their ranks; 0 if one column is constant."""
    ranks = first.astype(float).rank()
    correlation = ranks.corr(second.astype(float).rank())
    return 0.0 if np.isnan(correlation) else float(correlation)
