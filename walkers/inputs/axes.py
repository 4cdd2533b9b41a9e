"""Axes of a sweep: lists, spaced values, values that go together, and samplers.

An axis is a set of keys with, for each of its points, one value a key, which a case file could say. To add a way of
writing an axis, add it to `values_of`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite, log, prod
from typing import TYPE_CHECKING, Any

from walkers.inputs.changes import Value
from walkers.inputs.errors import UnusableKeyError
from walkers.inputs.units import split_quantity

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

MOST_POINTS = 1_000_000
_SPACINGS = ("linspace", "geomspace")
_DISTRIBUTIONS = ("uniform", "loguniform")


@dataclass(frozen=True)
class Axis:
    """Keys that vary together: ``rows`` has for each point of the axis one value a key."""

    keys: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]

    @classmethod
    def of(cls, key: str, values: Sequence[Value]) -> Axis:
        """An axis of one key."""
        return cls((key,), tuple((value,) for value in values))


def flatten(table: Mapping[str, Any], is_leaf: Callable[[Any], bool], prefix: str = "") -> dict[str, Any]:
    """Dotted keys of nested tables: ``{"drive": {"frequency": …}}`` and ``{"drive.frequency": …}`` are the same.

    Raises
    ------
    UnusableKeyError
        If a key is given both ways.
    """
    flat: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{prefix}.{name}" if prefix else name
        below = flatten(value, is_leaf, key) if isinstance(value, Mapping) and not is_leaf(value) else {key: value}
        if twice := flat.keys() & below.keys():
            raise UnusableKeyError(twice.pop(), "is given twice")
        flat |= below
    return flat


def is_axis(value: object) -> bool:
    """Whether a table is an axis rather than a table of axes."""
    return isinstance(value, Mapping) and any(name in value for name in (*_SPACINGS, *_DISTRIBUTIONS))


def values_of(key: str, axis: object) -> list[Value]:
    """The values of an axis: a list, ``{ linspace = [first, last, number] }`` or ``{ geomspace = [...] }``.

    Raises
    ------
    UnusableKeyError
        If it is something else.
    """
    if isinstance(axis, list):
        if not axis:
            raise UnusableKeyError(key, "expected at least one value", axis)
        unit_of(key, axis)
        return axis
    if isinstance(axis, Mapping) and len(axis) == 1 and (kind := next(iter(axis))) in _SPACINGS:
        return _spaced(key, kind, axis[kind])
    raise UnusableKeyError(
        key, "expected a list of values, { linspace = [first, last, number] } or { geomspace = [...] }", axis
    )


def _spaced(key: str, kind: str, given: object) -> list[Value]:
    import numpy as np

    if not (isinstance(given, list) and len(given) == 3 and type(given[2]) is int and 1 <= given[2] <= MOST_POINTS):
        told = f'expected first value, last value and number, such as {{ {kind} = ["0.5 g", "10 g", 20] }}'
        raise UnusableKeyError(key, told, {kind: given})
    first, last, unit = _range(key, given[:2], positive=kind == "geomspace")
    numbers = [written(float(one), unit) for one in getattr(np, kind)(first, last, given[2])]
    # Between whole numbers whole ones stay whole: seeds, cycles, replicates.
    if type(given[0]) is type(given[1]) is int:
        return [int(number) if number.is_integer() else number for number in numbers]
    return numbers


def _range(key: str, given: list[Value], *, positive: bool) -> tuple[float, float, str | None]:
    """Both ends of a range and their unit."""
    unit = unit_of(key, given)
    first, last = (number_of(key, end)[0] for end in given)
    if positive and not (first > 0 and last > 0):
        raise UnusableKeyError(key, "expected two values above zero", given)
    return first, last, unit


def _quantity(value: Value) -> tuple[float, str | None] | None:
    """A value as number and unit (None: a plain number), or None if it is no finite number."""
    try:
        if isinstance(value, str):
            number, unit = split_quantity(value)
            return (number, unit) if isfinite(number) else None
        if isinstance(value, (int, float)) and not isinstance(value, bool) and isfinite(float(value)):
            return float(value), None
    except (ValueError, OverflowError):
        pass
    return None


def number_of(key: str, value: Value) -> tuple[float, str | None]:
    """A value as number and unit; the unit of a plain number is None.

    Raises
    ------
    UnusableKeyError
        If it is no finite number.
    """
    if (found := _quantity(value)) is None:
        raise UnusableKeyError(key, "expected a number, or a number with its unit in quotes", value)
    return found


def written(number: float, unit: str | None) -> Value:
    """A number as a case file has it, rounded to twelve digits so that 0.1 + 0.2 reads 0.3."""
    rounded = float(f"{number:.12g}")
    return rounded if unit is None else f"{rounded!r} {unit}"


def unit_of(key: str, values: Sequence[Value]) -> str | None:
    """The unit of the values of an axis; None if they are plain numbers, or no numbers at all (names, "auto").

    Raises
    ------
    UnusableKeyError
        If they are in several units.
    """
    parts = [part for value in values for part in (value if isinstance(value, list) else [value])]
    units = {found[1] for found in map(_quantity, parts) if found is not None}
    if len(units) > 1:
        raise UnusableKeyError(key, "expected one unit throughout", list(values))
    return units.pop() if units else None


def plain(value: Value) -> Any:
    """A value without its unit: a number where it is a quantity, else as it is."""
    found = _quantity(value) if isinstance(value, str) else None
    return value if found is None else found[0]


def different(key: str, values: Sequence[Value]) -> Sequence[Value]:
    """The values of an axis, if no two of them are the same.

    Raises
    ------
    UnusableKeyError
        If there are equal ones: points would be there twice.
    """
    known: set[str] = set()
    for value in values:
        same = repr([_quantity(part) or part for part in (value if isinstance(value, list) else [value])])
        if same in known:
            raise UnusableKeyError(key, "expected different values: this one is there twice", value)
        known.add(same)
    return values


def zipped(table: Mapping[str, Any]) -> Axis:
    """Keys whose values go together, the first with the first."""
    columns = {key: values_of(key, axis) for key, axis in flatten(table, is_axis).items()}
    if not columns:
        raise UnusableKeyError("zip", "expected keys and their values", dict(table))
    lengths = {key: len(values) for key, values in columns.items()}
    if len(set(lengths.values())) > 1:
        *_, (key, values) = columns.items()
        told = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise UnusableKeyError(key, f"expected as many values for each key of a zip: {told}", values)
    return Axis(tuple(columns), tuple(zip(*columns.values(), strict=True)))


def sampled(method: str, points: int, seed: int, ranges: Mapping[str, Any]) -> Axis:
    """Points of a sampler of `scipy.stats.qmc` in the ranges of several keys.

    Parameters
    ----------
    method, seed
        ``sobol``, ``halton`` or ``latin-hypercube``, and the seed of its scrambling.
    points
        How many; a power of two suits Sobol's sequence.
    ranges
        For each key ``{ uniform = [low, high] }`` or ``{ loguniform = [low, high] }``.
    """
    import numpy as np

    ends = ends_of(ranges)
    if not ends:
        raise UnusableKeyError("sample.ranges", "expected keys and their ranges", dict(ranges))
    columns = []
    shares = unit_cube(method, len(ends), points, seed).T
    for share, (low, high, unit, logarithmic) in zip(shares, ends.values(), strict=True):
        numbers = np.exp(log(low) + share * log(high / low)) if logarithmic else low + share * (high - low)
        columns.append([written(float(number), unit) for number in numbers])
    return Axis(tuple(ends), tuple(zip(*columns, strict=True)))


def ends_of(ranges: Mapping[str, Any]) -> dict[str, tuple[float, float, str | None, bool]]:
    """Both ends of the ranges of several keys, their unit, and whether they are of magnitudes.

    Raises
    ------
    UnusableKeyError
        If one is no ``{ uniform = [low, high] }`` or ``{ loguniform = [low, high] }``.
    """
    ends: dict[str, tuple[float, float, str | None, bool]] = {}
    for key, given in flatten(ranges, is_axis).items():
        kind = next(iter(given)) if isinstance(given, Mapping) and len(given) == 1 else ""
        if kind not in _DISTRIBUTIONS or not (isinstance(given[kind], list) and len(given[kind]) == 2):
            raise UnusableKeyError(key, "expected { uniform = [low, high] } or { loguniform = [low, high] }", given)
        low, high, unit = _range(key, given[kind], positive=kind == "loguniform")
        if low >= high:
            raise UnusableKeyError(key, "expected the smaller value first", given)
        ends[key] = (low, high, unit, kind == "loguniform")
    return ends


def unit_cube(method: str, dimensions: int, points: int, seed: int) -> npt.NDArray[np.float64]:
    """Points of a sampler in the unit cube, shape (points, dimensions); as for `sampled`."""
    import warnings

    import numpy as np
    from scipy.stats import qmc

    name = {"sobol": "Sobol", "halton": "Halton", "latin-hypercube": "LatinHypercube"}[method]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a number of points that is no power of two is the user's choice
        cube: npt.NDArray[np.float64] = getattr(qmc, name)(d=dimensions, rng=np.random.default_rng(seed)).random(points)
    return cube


def combinations(axes: Sequence[Axis]) -> tuple[tuple[str, ...], list[tuple[Value, ...]]]:
    """The keys of all axes, and for each combination of their points, the last axis running fastest, one value a key.

    Raises
    ------
    UnusableKeyError
        If a key is on two axes, or there are too many combinations.
    """
    keys = tuple(key for axis in axes for key in axis.keys)
    for number, key in enumerate(keys):
        list_of = key.partition("[")[0]
        if any(other in (key, list_of) or other.partition("[")[0] == key for other in keys[:number]):
            raise UnusableKeyError(key, "varies on two axes")
    if (many := prod(len(axis.rows) for axis in axes)) > MOST_POINTS:
        raise UnusableKeyError("axes", f"{many} points; expected at most {MOST_POINTS}")
    return keys, [tuple(value for row in rows for value in row) for rows in product(*(axis.rows for axis in axes))]
