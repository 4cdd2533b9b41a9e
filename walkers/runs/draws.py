"""The difference and the ratio of a number of two cases, over the draws of both spreads.

A *draw* is a run of a case with its uncertain values drawn from their ranges
(`walkers.sweeps.spread`). How far the numbers of two cases lie apart depends on whether the unknown
values are the same in both. They are *common* if the same beads walk in two liquids: then a draw of
one case is paired with the draw of the other that has the same values. They are *independent* if
each case has its own beads: then each draw of one is taken with each draw of the other.

This module reads no files.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from walkers.arrays import FloatArray
from walkers.postprocess.measure.sides import REST

LEAST_PAIRS = 2
"""Smallest number of pairs of draws that have a band."""
_DIGITS = 12
"""Significant digits in which the values of paired draws agree: their units may differ."""
_PERCENTILES = (5.0, 50.0, 95.0)
"""Percentiles of a band, and between them its median."""


@dataclass(frozen=True)
class Unknown:
    """An uncertain value of a case. Two are equal if their SI values are.

    Attributes
    ----------
    value
        The value of the case, which is the median of the draws, in SI units; text if the case says
        it in words, such as ``auto``.
    low, high
        Both ends of its range in SI units.
    logarithmic
        Whether the range is log-uniform.
    text
        The value as case files have it: ``0.2``.
    ends
        Both ends of the range as case files have them: numbers, or texts such as ``29 um``.
    """

    value: float | str
    low: float
    high: float
    logarithmic: bool
    text: str = field(compare=False)
    ends: tuple[float | str, float | str] = field(compare=False)

    @property
    def range_text(self) -> str:
        """The range as text: ``0.1 to 0.6``."""
        return " to ".join(map(str, self.ends))


@dataclass(frozen=True)
class Draws:
    """The finished draws of the spread of a case.

    Attributes
    ----------
    unknowns
        The uncertain values by their keys.
    values
        The drawn values in SI units, shape (N, K), in the order of the unknowns.
    numbers
        The numbers of the results in SI units, shape (N,) each; NaN for draws without it, such as
        the velocity of walkers that came apart.
    """

    unknowns: Mapping[str, Unknown]
    values: FloatArray
    numbers: Mapping[str, FloatArray]


@dataclass(frozen=True)
class Band:
    """Percentiles 5, 50 and 95 of a number."""

    low: float
    median: float
    high: float


@dataclass(frozen=True)
class PairsOfDraws:
    """The numbers of pairs that have a draw of each case.

    Attributes
    ----------
    pairs
        Number of pairs.
    difference
        Band of the second number less the first one, SI units.
    ratio
        Band of the second number over the first one. None if the first number is zero in a pair, or
        does not have the same sign in all of them; walkers at rest count as zero.
    second_larger
        Share of the pairs in which the second number is larger.
    """

    pairs: int
    difference: Band
    ratio: Band | None
    second_larger: float


@dataclass(frozen=True)
class ComparedDraws:
    """A number of two cases, over the draws of both.

    Attributes
    ----------
    quantity
        Name of the number.
    unit
        Its SI unit.
    draws
        Numbers of draws of the first and of the second case.
    common
        With common unknowns: pairs of draws that have the same values. None if there are none.
    independent
        With independent unknowns: all pairs.
    common_unknowns
        Keys of the unknowns that have the same value and the same range in both cases.
    other_unknowns
        The other unknowns as sentences, such as ``contact.friction.bead_wall 0.1 to 0.6, and 0.2 to
        0.4``. If there are any, draws cannot be paired.
    for_first, for_second
        What each case must take over from the other for pairs, by the keys: the unknowns that it
        lacks; the second case also those that it has with another value or range.
    """

    quantity: str
    unit: str
    draws: tuple[int, int]
    common: PairsOfDraws | None
    independent: PairsOfDraws
    common_unknowns: Sequence[str]
    other_unknowns: Sequence[str]
    for_first: Mapping[str, Unknown]
    for_second: Mapping[str, Unknown]


def compare_draws(first: Draws, second: Draws, quantity: str, unit: str) -> ComparedDraws | None:
    """Compare a number of two cases over their draws.

    Parameters
    ----------
    first, second
        The draws of both cases.
    quantity
        Name of the number.
    unit
        Its SI unit.

    Returns
    -------
    ComparedDraws or None
        None if fewer than `LEAST_PAIRS` draws of a case have the number.
    """
    numbers = []
    for draws in (first, second):
        column = draws.numbers.get(quantity, np.array([]))
        numbers.append(column[np.isfinite(column)])
    if min(map(len, numbers)) < LEAST_PAIRS:
        return None
    every_first = np.repeat(numbers[0], len(numbers[1]))
    every_second = np.tile(numbers[1], len(numbers[0]))
    common = None
    other_unknowns = _other_unknowns(first.unknowns, second.unknowns)
    if not other_unknowns:
        paired_first, paired_second = _paired(first, second, quantity)
        if len(paired_first) >= LEAST_PAIRS:
            common = _pairs(paired_first, paired_second, unit)
    return ComparedDraws(
        quantity=quantity,
        unit=unit,
        draws=(len(numbers[0]), len(numbers[1])),
        common=common,
        independent=_pairs(every_first, every_second, unit),
        common_unknowns=_common_unknowns(first.unknowns, second.unknowns),
        other_unknowns=other_unknowns,
        for_first=_lacking(first.unknowns, second.unknowns),
        for_second=_different(second.unknowns, first.unknowns),
    )


def _lacking(case: Mapping[str, Unknown], other_case: Mapping[str, Unknown]) -> dict[str, Unknown]:
    """The unknowns of the other case that a case lacks."""
    return {key: unknown for key, unknown in other_case.items() if key not in case}


def _different(
    case: Mapping[str, Unknown], other_case: Mapping[str, Unknown]
) -> dict[str, Unknown]:
    """The unknowns of the other case that a case lacks, or has with another value or range."""
    return {key: unknown for key, unknown in other_case.items() if case.get(key) != unknown}


def _common_unknowns(first: Mapping[str, Unknown], second: Mapping[str, Unknown]) -> list[str]:
    """Keys of the unknowns that have the same value and range in both cases."""
    return [key for key, unknown in first.items() if second.get(key) == unknown]


def _other_unknowns(first: Mapping[str, Unknown], second: Mapping[str, Unknown]) -> list[str]:
    """The unknowns that differ in value or range, or are those of one case, as sentences."""
    sentences = []
    for key in dict.fromkeys([*first, *second]):
        in_first = first.get(key)
        in_second = second.get(key)
        if in_first == in_second:
            continue
        if in_first is None or in_second is None:
            side = "second" if in_first is None else "first"
            sentences.append(f"{key} in the {side} case alone")
        elif (in_first.low, in_first.high) != (in_second.low, in_second.high):
            sentences.append(f"{key} {in_first.range_text}, and {in_second.range_text}")
        elif in_first.value != in_second.value:
            sentences.append(f"{key} around {in_first.text}, and {in_second.text}")
        else:
            sentences.append(f"{key} drawn uniformly, and log-uniformly")
    return sentences


def _paired(first: Draws, second: Draws, quantity: str) -> tuple[FloatArray, FloatArray]:
    """The numbers of the draws that have the same values in both cases, shape (N,) each.

    Pairs are left out if one of their draws does not have the number.
    """
    order = [list(second.unknowns).index(key) for key in first.unknowns]
    second_numbers = {}
    for values, number in zip(
        second.values[:, order].tolist(), second.numbers[quantity].tolist(), strict=True
    ):
        second_numbers[_rounded_values(values)] = number
    pairs = []
    for values, number in zip(first.values.tolist(), first.numbers[quantity].tolist(), strict=True):
        pairs.append((number, second_numbers.get(_rounded_values(values), np.nan)))
    both = np.array(pairs)
    both = both[np.isfinite(both).all(axis=1)]
    return both[:, 0], both[:, 1]


def _rounded_values(values: Sequence[float]) -> tuple[str, ...]:
    """The values of a draw in the digits in which those of paired draws agree."""
    return tuple([f"{value:.{_DIGITS}g}" for value in values])


def _pairs(first: FloatArray, second: FloatArray, unit: str) -> PairsOfDraws:
    """The numbers of pairs, from the numbers (in this SI unit) of both cases, shape (N,) each."""
    ratio = None
    zero = REST if unit == "m/s" else 0.0
    if first.min() > zero or first.max() < -zero:
        ratio = _band(second / first)
    return PairsOfDraws(
        pairs=len(first),
        difference=_band(second - first),
        ratio=ratio,
        second_larger=float(np.mean(second > first)),
    )


def _band(numbers: FloatArray) -> Band:
    return Band(*np.percentile(numbers, _PERCENTILES).tolist())
