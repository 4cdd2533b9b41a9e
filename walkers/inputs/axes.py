"""Axes of a sweep: lists, spaced values, zipped values, and samplers."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from itertools import product
from math import prod
from typing import Any, NamedTuple

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import key_error
from walkers.inputs.keys import DISTRIBUTIONS, SPACINGS, Value, flatten
from walkers.inputs.units import as_quantity

MOST_POINTS_OF_SWEEP = 1_000_000


class Range(NamedTuple):
    """Range of a random number in a unit (None: a plain number); with a ``median``, half of the draws are below it."""

    low: float
    high: float
    unit: str | None
    logarithmic: bool
    median: float | None = None

    def quantiles(self, shares: FloatArray) -> FloatArray:
        """Quantiles of the range."""
        ends = np.array(
            [self.low, self.high] if self.median is None else [self.low, self.median, self.high]
        )
        numbers = np.interp(
            shares, np.linspace(0.0, 1.0, len(ends)), np.log(ends) if self.logarithmic else ends
        )
        return np.asarray(np.exp(numbers) if self.logarithmic else numbers)


class Axis(NamedTuple):
    """Keys that vary together: ``rows`` has one value per key for each point of the axis."""

    keys: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]

    @classmethod
    def of(cls, columns: Mapping[str, Sequence[Value]]) -> Axis:
        """Make an axis from the values of each key."""
        return cls(tuple(columns), tuple(zip(*columns.values(), strict=True)))

    @property
    def units(self) -> tuple[str | None, ...]:
        """The unit of each key, as `unit_of` its values."""
        return tuple(map(unit_of, self.keys, zip(*self.rows, strict=True)))


def values_of(key: str, axis: object) -> list[Value]:
    """The values of an axis: a list, ``{ linspace = [first, last, number] }`` or ``{ geomspace = [...] }``."""
    if isinstance(axis, list):
        if not axis:
            raise key_error(key, "expected at least one value", axis)
        unit_of(key, axis)
        return axis
    kind, given = (
        next(iter(axis.items())) if isinstance(axis, Mapping) and len(axis) == 1 else ("", None)
    )
    if kind not in SPACINGS:
        message = "expected a list of values, { linspace = [first, last, number] } or { geomspace = [...] }"
        raise key_error(key, message, axis)
    if not (
        isinstance(given, list)
        and len(given) == 3
        and type(given[2]) is int
        and 1 <= given[2] <= MOST_POINTS_OF_SWEEP
    ):
        message = f'expected first value, last value and number, such as {{ {kind} = ["0.5 g", "10 g", 20] }}'
        raise key_error(key, message, axis)
    (first, last), unit = _numbers(key, given[:2], positive=kind == "geomspace")
    numbers = [value_in_unit(float(number), unit) for number in getattr(np, kind)(first, last, given[2])]
    # Between whole numbers whole ones stay whole: seeds, cycles, replicates.
    whole = type(given[0]) is type(given[1]) is int
    return [int(number) if whole and number.is_integer() else number for number in numbers]


def _numbers(key: str, given: list[Value], *, positive: bool) -> tuple[list[float], str | None]:
    """The numbers of a range and their unit."""
    unit, numbers = unit_of(key, given), [number_of(key, value) for value in given]
    if positive and min(numbers) <= 0:
        raise key_error(key, "expected values above zero", given)
    return numbers, unit


def number_of(key: str, value: Value) -> float:
    """The number of a value, without its unit; raises `InputError` if it is not a finite number."""
    if (quantity := as_quantity(value)) is None:
        raise key_error(key, "expected a number, or a number with its unit in quotes", value)
    return quantity[0]


def without_unit(value: Value) -> Any:
    """A value, or the values of a list, without unit: a number where it is a quantity, else as it is."""
    if isinstance(value, list):
        return [*map(without_unit, value)]
    quantity = as_quantity(value) if isinstance(value, str) else None
    return quantity[0] if quantity else value


def value_in_unit(number: float, unit: str | None) -> Value:
    """A number as written in a case file, rounded to twelve digits so that 0.1 + 0.2 gives 0.3."""
    rounded = float(f"{number:.12g}")
    return rounded if unit is None else f"{rounded!r} {unit}"


def unit_of(key: str, values: Sequence[Value]) -> str | None:
    """The one unit of the values of an axis; None if they are plain numbers, or no numbers at all (names, "auto")."""
    parts = [part for value in values for part in (value if isinstance(value, list) else [value])]
    units = {quantity[1] for quantity in map(as_quantity, parts) if quantity}
    if len(units) > 1:
        raise key_error(key, "expected one unit throughout", list(values))
    return units.pop() if units else None


def listed(key: str, given: object) -> Axis:
    """An axis of one key with different values, so that no point occurs twice."""
    values = values_of(key, given)
    occurred: set[str] = set()
    for value in values:
        same = repr(
            [as_quantity(part) or part for part in (value if isinstance(value, list) else [value])]
        )
        if same in occurred:
            raise key_error(key, "expected different values: this one occurs twice", value)
        occurred.add(same)
    return Axis.of({key: values})


def crossed(table: Mapping[str, Any]) -> list[Axis]:
    """An axis of each key."""
    return [listed(key, given) for key, given in flatten(table).items()]


def zipped(table: Mapping[str, Any]) -> Axis:
    """An axis of keys that vary together, first value with first value."""
    columns = {key: values_of(key, axis) for key, axis in flatten(table).items()}
    if not columns:
        raise key_error("zip", "expected keys and their values", dict(table))
    lengths = {key: len(values) for key, values in columns.items()}
    if len(set(lengths.values())) > 1:
        *_, (key, values) = columns.items()
        message = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise key_error(key, f"expected as many values for each key of a zip: {message}", values)
    return Axis.of(columns)


def one_at_a_time(table: Mapping[str, Any]) -> Axis:
    """The first values of all keys, then each other value of one key with the first values of the others."""
    columns = {axis.keys[0]: axis.rows for axis in crossed(table)}
    usual = {key: rows[0][0] for key, rows in columns.items()}
    changes = [{}, *({key: value} for key, rows in columns.items() for (value,) in rows[1:])]
    return Axis(tuple(usual), tuple(tuple((usual | change).values()) for change in changes))


def sampled(points: int, seed: int, ranges: Mapping[str, Any]) -> Axis:
    """Points of Sobol's sequence, scrambled with the seed, in the ranges of several keys (`ranges_of`)."""
    ends = ranges_of(ranges)
    if not ends:
        raise key_error("sample.ranges", "expected keys and their ranges", dict(ranges))
    shares = zip(unit_cube(len(ends), points, seed).T, ends.items(), strict=True)
    drawn = ((key, span.unit, span.quantiles(share).tolist()) for share, (key, span) in shares)
    return Axis.of(
        {key: [value_in_unit(number, unit) for number in numbers] for key, unit, numbers in drawn}
    )


def descending(key: str, ends: Mapping[str, Value]) -> Axis:
    """An axis of a key from a value down to another in steps; ``ends`` has the three by their keys in a sweep file."""
    start, to, step = (number_of(name, value) for name, value in ends.items())
    unit = unit_of(key, list(ends.values()))
    if not (start >= to and step > 0 and start - to < MOST_POINTS_OF_SWEEP * step):
        first, last, _ = ends.values()
        raise key_error(
            "descend",
            "`from` must not be below `to`, and `step` must be positive",
            f"{first} to {last}",
        )
    number = int((start - to) / step + 1e-9) + 1
    return Axis.of({key: [value_in_unit(start - step * count, unit) for count in range(number)]})


class NotARange(ValueError):
    """A value has none of the forms of a range; who asked for the range says which forms there are."""


def ranges_of(ranges: Mapping[str, Any]) -> dict[str, Range]:
    """The ranges of several keys, ``{ uniform = [low, high] }`` or ``{ loguniform = [low, median, high] }``."""
    spans: dict[str, Range] = {}
    for key, given in flatten(ranges).items():
        try:
            spans[key] = range_of(key, given)
        except NotARange as error:
            message = "expected { uniform = [low, high] } or { loguniform = [low, high] }"
            raise key_error(key, message, given) from error
    return spans


def range_of(key: str, given: object) -> Range:
    """The range of a key.

    Parameters
    ----------
    key
        The dotted key, for messages.
    given
        ``{"uniform": [low, high]}`` or ``{"loguniform": [low, high]}``; the median may stand between the ends.

    Raises
    ------
    NotARange
        If the value has another form.
    InputError
        If the ends are no numbers of one unit, the smaller one first.
    """
    if not isinstance(given, Mapping) or len(given) != 1:
        raise NotARange(key)
    distribution, ends = next(iter(given.items()))
    if distribution not in DISTRIBUTIONS or not isinstance(ends, list) or len(ends) not in (2, 3):
        raise NotARange(key)
    logarithmic = distribution == "loguniform"
    (low, *median, high), unit = _numbers(key, ends, positive=logarithmic)
    if low >= high or not all(low <= middle <= high for middle in median):
        raise key_error(key, "expected the smaller value first", given)
    return Range(low, high, unit, logarithmic, *median)


def unit_cube(dimensions: int, points: int, seed: int) -> FloatArray:
    """Points of Sobol's sequence in the unit cube, shape (points, dimensions), scrambled with a seed."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", UserWarning
        )  # a number of points that is no power of two is the user's choice
        return np.asarray(qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(points))


def combinations(axes: Sequence[Axis]) -> tuple[tuple[str, ...], list[tuple[Value, ...]]]:
    """The keys of all axes, and one row of values for each combination of points; the last axis varies fastest."""
    keys = tuple(key for axis in axes for key in axis.keys)
    for number, key in enumerate(keys):
        list_of = key.partition("[")[0]
        if any(
            earlier in (key, list_of) or earlier.partition("[")[0] == key
            for earlier in keys[:number]
        ):
            raise key_error(key, "varies on two axes; expected one")
    if (many := prod(len(axis.rows) for axis in axes)) > MOST_POINTS_OF_SWEEP:
        raise key_error("axes", f"{many} points; expected at most {MOST_POINTS_OF_SWEEP}")
    return keys, [
        tuple(value for row in rows for value in row)
        for rows in product(*(axis.rows for axis in axes))
    ]
