"""Recorded shaking: the acceleration of the boundary against time, from a file of comma-separated values.

Between its rows the acceleration is a cubic spline, without its mean: the offset of a sensor, and gravity along z.
Integrated twice it gives the displacement, a polynomial of fifth order from row to row; its constants are such that the
boundary starts at no displacement and comes back to it at the end. With p rows a period, the spline of a sine is off by
(2π/p)⁴/384 of its peak: 4e-5 with 18 rows, 2e-10 with 400.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from walkers.inputs.table import SAME_RUN, Table
from walkers.inputs.units import ACCELERATION, TIME, parse_quantity
from walkers.physics.bridge import FloatArray

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

FEWEST, MOST = 16, 100_000
"""Numbers of rows."""
_GAP = 1.5  # longest time between two rows, in medians of all
_COARSE = 0.1  # largest change by leaving out every second row, root mean square; a sine does with six rows a period
_FAINT = 0.05  # share of the strongest amplitude in the spectrum below which others do not count
_HEADER = (
    "expected a header of a time and accelerations along x, y or z, with commas between them, such as "
    '"time (ms), x (g), z (m/s^2)"'
)


class Record(Table):
    """The rows of a file: time (s), acceleration along x, y and z (m/s²); whether they are a period, which repeats."""

    file: Annotated[str, SAME_RUN] = ""
    rows: tuple[tuple[float, float, float, float], ...]
    repeats: Annotated[bool, SAME_RUN] = False  # as the key of the drive says

    @cached_property
    def course(self) -> PPoly:
        """Displacement along x, y and z, m, against the time since the first row, s."""
        course = _spline(np.array(self.rows), self.repeats).antiderivative(2)
        drift = course(course.x[-1]) / course.x[-1]
        course.c[-2] -= drift
        course.c[-1] -= drift * course.x[:-1, None]
        return course

    @property
    def length(self) -> float:
        """Time from the first to the last row, s."""
        return self.rows[-1][0] - self.rows[0][0]

    @property
    def axes(self) -> dict[str, int]:
        """The axes that are shaken, and their places among x, y and z."""
        return {axis: place for place, axis in enumerate("xyz") if any(row[1 + place] for row in self.rows)}

    def largest(self, order: int) -> float:
        """Largest displacement (order 0, m), velocity (1) or acceleration (2) at the rows."""
        return float(np.linalg.norm(self.course(self.course.x, order), axis=1).max())

    @cached_property
    def direction(self) -> tuple[float, float, float]:
        """Direction in which the acceleration has its largest root mean square, a unit vector."""
        acceleration = self.course(self.course.x, 2)
        axis = np.linalg.eigh(acceleration.T @ acceleration)[1][:, -1]
        x, y, z = (axis * np.sign(axis[np.argmax(np.abs(axis))])).tolist()
        return (x, y, z)

    @cached_property
    def frequencies(self) -> tuple[float, float]:
        """Frequency of a cycle (of all lines, if the record repeats; else the strongest), and the highest one, Hz."""
        count = len(self.rows)
        window = 1.0 if self.repeats else np.hanning(count + 1)[:-1, None]
        even = self.course(np.arange(count) * self.length / count, 2)
        lines = np.linalg.norm(np.fft.rfft(even * window, axis=0), axis=1)
        high = np.flatnonzero(lines > _FAINT * lines[1:].max())
        cycles, peak = float(np.gcd.reduce(high)), int(lines[1:].argmax()) + 1
        if not self.repeats:
            left, top, right = np.log(lines[peak - 1 : peak + 2])
            cycles = peak + 0.5 * float((left - right) / (left - 2.0 * top + right))
        return cycles / self.length, float(high[-1]) / self.length

    def motion(self, time: FloatArray) -> FloatArray:
        """Displacement, velocity and acceleration along x, y and z at times (s), shape (3, N, 3)."""
        beyond = "periodic" if self.repeats else None
        return np.stack([self.course(time, order, extrapolate=beyond) for order in range(3)])


def course_text(times: FloatArray, powers: FloatArray, repeats: bool = False) -> str:
    """A course as the engine reads it: a period or 0, then each piece's time and powers, given the highest first."""
    powers = powers[::-1].tolist() + [[0.0] * powers.shape[1]] * (6 - len(powers))
    rows = zip(times.tolist(), *powers, strict=False)
    return "\n".join([repr(float(times[-1] * repeats)), *(" ".join(map(repr, row)) for row in rows)]) + "\n"


def _spline(rows: FloatArray, repeats: bool = False) -> PPoly:
    """The acceleration through rows, shape (N, 4), without its mean."""
    from scipy.interpolate import CubicSpline

    if repeats:
        rows[-1, 1:] = rows[0, 1:]
    spline = CubicSpline(rows[:, 0] - rows[0, 0], rows[:, 1:], bc_type="periodic" if repeats else "not-a-knot")
    spline.c[-1] -= spline.integrate(0.0, spline.x[-1]) / spline.x[-1]
    return spline


def record_of(value: object) -> object:
    """A record from its file's name and its rows, which stand in the place of the name in a case."""
    try:
        rows = tuple((float(time), float(x), float(y), float(z)) for time, x, y, z in value["rows"])  # type: ignore[index]
    except (LookupError, TypeError, ValueError) as error:
        raise ValueError("expected text: a file of comma-separated values") from error
    _check(rows)
    return Record(file=value.get("file", ""), rows=rows)  # type: ignore[attr-defined]


def read_record(path: Path) -> list[list[float]]:
    """Rows of a file: time, s, and acceleration along x, y and z, m/s²; raises `ValueError` if it has none."""
    import pandas as pd

    try:
        table = pd.read_csv(path, skipinitialspace=True, index_col=False)
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from error
    except ValueError as error:  # its subclasses are of pandas
        raise ValueError(f"expected rows of numbers with commas below a header: {error}".strip()) from error
    heads = [text.strip().removesuffix(")").partition("(") for text in table.columns]
    names, kinds = [name.strip() for name, _, _ in heads], dict.fromkeys("xyz", ACCELERATION) | {"time": TIME}
    if names[:1] != ["time"] or len(names) < 2 or len({*names}) < len(names) or not kinds.keys() >= {*names}:
        raise ValueError(_HEADER)
    rows = np.zeros((len(table), 4))
    for name, (_, _, unit), (_, column) in zip(names, heads, table.items(), strict=True):
        numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
        try:
            rows[:, ("time", *"xyz").index(name)] = numbers * parse_quantity(f"1 {unit}", kinds[name])
        except ValueError as error:
            raise ValueError(f'column "{name} ({unit})": {error}, in brackets behind the name') from error
    return rows.tolist()


def _check(rows: Sequence[Sequence[float]]) -> None:
    """Raise `ValueError` for rows that give no motion."""
    if not FEWEST <= len(rows) <= MOST:
        raise ValueError(f"has {len(rows)} rows; expected {FEWEST} to {MOST}")
    array, largest = np.array(rows), ACCELERATION.largest
    if (odd := ~np.isfinite(array).all(axis=1) | (np.abs(array[:, 1:]) > largest).any(axis=1)).any():
        expected = f"expected a number in each column, accelerations up to {largest:g} m/s²"
        raise ValueError(f"row {np.argmax(odd) + 1}: {expected}")
    steps = np.diff(array[:, 0])
    usual = np.median(steps)
    if (odd := (steps <= 0.0) | (steps > _GAP * usual)).any():
        after = f"row {np.argmax(odd) + 2} is {1e3 * steps[np.argmax(odd)]:.6g} ms after the one before"
        raise ValueError(f"{after}; expected times that increase without gaps, about {1e3 * usual:.6g} ms apart")
    whole, half = (_spline(part)(array[:, 0] - array[0, 0]) for part in (array, array[::2]))
    if not whole.any():
        raise ValueError("expected an acceleration that changes")
    change = float(np.linalg.norm((whole - half)[:-1]) / np.linalg.norm(whole))
    if change > _COARSE:
        message = "rows are too far apart, or too noisy: leaving out every second one changes the acceleration by"
        raise ValueError(f"{message} {change:.0%} (root mean square); expected at most {_COARSE:.0%}")
