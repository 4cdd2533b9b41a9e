"""Axes of a sweep: lists of values, spaced values, values that vary together, and samplers.

An axis is written in a sweep file and expanded here into its values, as a case file has them. Cases
are not made here: see `walkers.inputs.sweep`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, TypeGuard

import numpy as np

from walkers.arrays import FloatArray
from walkers.errors import key_error
from walkers.inputs.keys import DISTRIBUTIONS, SPACINGS, Value, flatten, is_below
from walkers.inputs.units import as_quantity

MOST_POINTS_OF_SWEEP = 1_000_000
"""Largest number of points of an axis, and of a sweep."""
_ROUNDING = 1e-9
"""Rounding error of a number of steps: 4 g to 0.5 g in steps of 0.1 g are 35 steps, not 34.99…."""


class NotARange(ValueError):
    """A value has none of the forms of a range. The caller says which forms it accepts."""


@dataclass(frozen=True)
class Range:
    """Range of a random number.

    Attributes
    ----------
    low
        The lower end, in ``unit``.
    high
        The upper end.
    unit
        The unit as the file has it; None for plain numbers.
    logarithmic
        Whether the logarithm of the number is distributed evenly, rather than the number.
    median
        If given, half of the draws are below it, and half above.
    """

    low: float
    high: float
    unit: str | None
    logarithmic: bool
    median: float | None = None

    def quantiles(self, shares: FloatArray) -> FloatArray:
        """The numbers below which given shares of the draws lie, in the unit of the range."""
        numbers = [self.low, self.high]
        if self.median is not None:
            numbers.insert(1, self.median)
        nodes = np.array(numbers)
        shares_of_nodes = np.linspace(0.0, 1.0, len(nodes))
        if self.logarithmic:
            return np.asarray(np.exp(np.interp(shares, shares_of_nodes, np.log(nodes))))
        return np.asarray(np.interp(shares, shares_of_nodes, nodes))


@dataclass(frozen=True)
class Axis:
    """Keys that vary together.

    Attributes
    ----------
    keys
        The dotted keys.
    rows
        For each point of the axis, one value for each key.
    """

    keys: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]

    @classmethod
    def from_columns(cls, columns: Mapping[str, Sequence[Value]]) -> Axis:
        """Make an axis from the values of each key."""
        return cls(keys=tuple(columns), rows=tuple(zip(*columns.values(), strict=True)))

    @property
    def units(self) -> tuple[str | None, ...]:
        """The unit of each key, as `unit_of` its values."""
        columns = zip(*self.rows, strict=True)
        return tuple(unit_of(key, values) for key, values in zip(self.keys, columns, strict=True))


def values_of(key: str, axis: object) -> list[Value]:
    """The values of one key of an axis, written in one of three forms.

    Parameters
    ----------
    key
        The dotted key, for messages.
    axis
        A list of values, ``{ linspace = [first, last, number] }`` or ``{ geomspace = [...] }``.

    Returns
    -------
    list
        Values as a case file has them.

    Raises
    ------
    InputError
        If the axis has another form, no values, or values of several units.
    """
    if isinstance(axis, list):
        if not axis:
            raise key_error(key, "expected at least one value", axis)
        unit_of(key, axis)  # refuses a second unit
        return axis
    if isinstance(axis, Mapping) and len(axis) == 1:
        spacing, given = next(iter(axis.items()))
        if spacing in SPACINGS:
            return _spaced(key, axis, spacing, given)
    message = (
        "expected a list of values, { linspace = [first, last, number] } or { geomspace = [...] }"
    )
    raise key_error(key, message, axis)


def _spaced(key: str, axis: object, spacing: str, given: object) -> list[Value]:
    """Values from a first to a last one; ``given`` are these two and the number of values."""
    if not _are_ends_and_number(given):
        example = f'{{ {spacing} = ["0.5 g", "10 g", 20] }}'
        message = f"expected first value, last value and number, such as {example}"
        raise key_error(key, message, axis)
    first_value, last_value, number = given
    are_whole = type(first_value) is int and type(last_value) is int
    geometric = spacing == "geomspace"
    (first, last), unit = _numbers(key, [first_value, last_value], positive=geometric)
    spaced = np.geomspace if geometric else np.linspace
    values = []
    for spaced_number in spaced(first, last, number):
        value = value_in_unit(float(spaced_number), unit)
        # Between whole numbers whole ones stay whole: seeds, cycles, replicates.
        if are_whole and value.is_integer():
            value = int(value)
        values.append(value)
    return values


def _are_ends_and_number(given: object) -> TypeGuard[list[Any]]:
    """Whether a value is a list of a first value, a last value and a number of points."""
    if not isinstance(given, list) or len(given) != 3:
        return False
    number = given[2]
    return type(number) is int and 1 <= number <= MOST_POINTS_OF_SWEEP


def _numbers(key: str, given: list[Value], *, positive: bool) -> tuple[list[float], str | None]:
    """The numbers of values without their unit, and this unit, which all must have."""
    unit = unit_of(key, given)
    numbers = [number_of(key, value) for value in given]
    if positive and min(numbers) <= 0:
        raise key_error(key, "expected values above zero", given)
    return numbers, unit


def number_of(key: str, value: Value) -> float:
    """The number of a value, without its unit; `InputError` if it is not a finite number."""
    quantity = as_quantity(value)
    if quantity is None:
        raise key_error(key, "expected a number, or a number with its unit in quotes", value)
    return quantity[0]


def without_unit(value: Value) -> Any:
    """A value, or the values of a list, as numbers without units; words stay as they are.

    A table, such as a friction that grows with the velocity, becomes words.
    """
    if isinstance(value, Mapping):
        return ", ".join(f"{name} = {entry}" for name, entry in value.items())
    if isinstance(value, list):
        return [without_unit(entry) for entry in value]
    if not isinstance(value, str):
        return value
    quantity = as_quantity(value)
    if quantity is None:
        return value
    return quantity[0]


def value_in_unit(number: float, unit: str | None) -> Value:
    """A number as a case file has it: with its unit, or plain if the unit is None.

    It is rounded to twelve digits, so that 0.1 + 0.2 gives 0.3.
    """
    rounded = float(f"{number:.12g}")
    if unit is None:
        return rounded
    return f"{rounded!r} {unit}"


def unit_of(key: str, values: Sequence[Value]) -> str | None:
    """The one unit of the values of a key.

    Returns
    -------
    str or None
        None if the values are plain numbers, or no numbers at all (names, "auto").

    Raises
    ------
    InputError
        If the values have several units.
    """
    units = set()
    for value in values:
        for entry in _entries(value):
            quantity = as_quantity(entry)
            if quantity is not None:
                units.add(quantity[1])
    if len(units) > 1:
        raise key_error(key, "expected one unit throughout", list(values))
    return units.pop() if units else None


def _entries(value: Value) -> list[Value]:
    """The entries of a list, or the value alone."""
    return value if isinstance(value, list) else [value]


def axis_of(key: str, given: object) -> Axis:
    """An axis of one key; its values must differ, so that no point occurs twice."""
    values = values_of(key, given)
    occurred: set[str] = set()
    for value in values:
        # "0.50 mm" is the same value as "0.5 mm".
        normalised = repr([as_quantity(entry) or entry for entry in _entries(value)])
        if normalised in occurred:
            raise key_error(key, "expected different values: this one occurs twice", value)
        occurred.add(normalised)
    return Axis.from_columns({key: values})


def crossed(table: Mapping[str, Any]) -> list[Axis]:
    """An axis for each key of a table."""
    return [axis_of(key, given) for key, given in flatten(table).items()]


def zipped(table: Mapping[str, Any]) -> Axis:
    """An axis of keys that vary together: all first values, then all second ones, and so on."""
    columns = {key: values_of(key, given) for key, given in flatten(table).items()}
    if not columns:
        raise key_error("zip", "expected keys and their values", dict(table))
    lengths = {key: len(values) for key, values in columns.items()}
    if len(set(lengths.values())) > 1:
        last = list(columns)[-1]
        counts = ", ".join(f"{key} has {length}" for key, length in lengths.items())
        message = f"expected as many values for each key of a zip: {counts}"
        raise key_error(last, message, columns[last])
    return Axis.from_columns(columns)


def one_at_a_time(table: Mapping[str, Any]) -> Axis:
    """An axis that starts at the first value of each key and changes one key at a time."""
    columns: dict[str, list[Value]] = {}
    for key, given in flatten(table).items():
        columns[key] = [value for (value,) in axis_of(key, given).rows]
    first = {key: values[0] for key, values in columns.items()}
    rows = [tuple(first.values())]
    for key, values in columns.items():
        for value in values[1:]:
            changed = {**first, key: value}
            rows.append(tuple(changed.values()))
    return Axis(keys=tuple(columns), rows=tuple(rows))


def sampled(points: int, seed: int, ranges: Mapping[str, Any]) -> Axis:
    """An axis of points of Sobol's sequence.

    Parameters
    ----------
    points
        Number of points.
    seed
        Seed of the scrambling of the sequence.
    ranges
        Keys and their ranges, as `ranges_of` reads them.

    Raises
    ------
    InputError
        If there are no ranges, or one cannot be used.
    """
    spans = ranges_of(ranges)
    if not spans:
        raise key_error("sample.ranges", "expected keys and their ranges", dict(ranges))
    shares = unit_cube(len(spans), points, seed)
    columns: dict[str, list[Value]] = {}
    for (key, span), share in zip(spans.items(), shares.T, strict=True):
        numbers = span.quantiles(share).tolist()
        columns[key] = [value_in_unit(number, span.unit) for number in numbers]
    return Axis.from_columns(columns)


def descending(key: str, start: Value, to: Value, step: Value) -> Axis:
    """An axis of a key that is lowered from a start to a last value in equal steps.

    Parameters
    ----------
    key
        The dotted key.
    start, to, step
        ``from``, ``to`` and ``step`` of ``[descend]`` in a sweep file, all in one unit.

    Raises
    ------
    InputError
        If a value is not a number, the units differ, or the steps do not lead downwards.
    """
    first = number_of("descend.from", start)
    last = number_of("descend.to", to)
    difference = number_of("descend.step", step)
    unit = unit_of(key, [start, to, step])
    downwards = first >= last and difference > 0
    if not downwards or first - last >= MOST_POINTS_OF_SWEEP * difference:
        message = "`from` must not be below `to`, and `step` must be positive"
        raise key_error("descend", message, f"{start} to {to}")
    steps = int((first - last) / difference + _ROUNDING)
    values = [value_in_unit(first - difference * count, unit) for count in range(steps + 1)]
    return Axis.from_columns({key: values})


def ranges_of(ranges: Mapping[str, Any]) -> dict[str, Range]:
    """The ranges of several keys, each in a form that `range_of` reads, by dotted keys."""
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
        ``{"uniform": [low, high]}`` or ``{"loguniform": [low, high]}``. The median may stand
        between the ends.

    Raises
    ------
    NotARange
        If the value has another form.
    InputError
        If the numbers are not of one unit and in ascending order, or not above zero for
        ``loguniform``.
    """
    if not isinstance(given, Mapping) or len(given) != 1:
        raise NotARange(key)
    distribution, values = next(iter(given.items()))
    if distribution not in DISTRIBUTIONS:
        raise NotARange(key)
    if not isinstance(values, list) or len(values) not in (2, 3):
        raise NotARange(key)
    logarithmic = distribution == "loguniform"
    numbers, unit = _numbers(key, values, positive=logarithmic)
    low = numbers[0]
    high = numbers[-1]
    median = numbers[1] if len(numbers) == 3 else None
    if low >= high or (median is not None and not low <= median <= high):
        raise key_error(key, "expected the smaller value first", given)
    return Range(low, high, unit, logarithmic, median)


def unit_cube(dimensions: int, points: int, seed: int) -> FloatArray:
    """Points of Sobol's sequence in the unit cube.

    Parameters
    ----------
    dimensions
        Number of coordinates of a point.
    points
        Number of points, best a power of two.
    seed
        Seed of the scrambling of the sequence.

    Returns
    -------
    ndarray, shape (points, dimensions)
        Coordinates from 0 to 1.
    """
    from scipy.stats import qmc

    with warnings.catch_warnings():
        # scipy warns of a number of points that is no power of two, but it is the user's choice.
        warnings.simplefilter("ignore", UserWarning)
        sampler = qmc.Sobol(dimensions, rng=np.random.default_rng(seed))
        return np.asarray(sampler.random(points))


def combinations(axes: Sequence[Axis]) -> tuple[tuple[str, ...], list[tuple[Value, ...]]]:
    """All combinations of the points of several axes.

    Parameters
    ----------
    axes
        The axes; the last one varies fastest.

    Returns
    -------
    keys : tuple of str
        The keys of all axes.
    rows : list of tuple
        For each combination, one value for each key.

    Raises
    ------
    InputError
        If a key varies on two axes, or there are too many combinations.
    """
    keys: list[str] = []
    for axis in axes:
        for key in axis.keys:
            if any(overlap(earlier, key) for earlier in keys):
                raise key_error(key, "varies on two axes; expected one")
            keys.append(key)
    number = prod(len(axis.rows) for axis in axes)
    if number > MOST_POINTS_OF_SWEEP:
        raise key_error("axes", f"{number} points; expected at most {MOST_POINTS_OF_SWEEP}")
    rows = []
    for rows_of_axes in product(*(axis.rows for axis in axes)):
        values: list[Value] = []
        for row_of_axis in rows_of_axes:
            values.extend(row_of_axis)
        rows.append(tuple(values))
    return tuple(keys), rows


def overlap(first: str, second: str) -> bool:
    """Whether two keys are the same, or one is a part of the value of the other."""
    return first == second or is_below(first, second) or is_below(second, first)
