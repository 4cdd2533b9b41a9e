"""Recorded shaking: the acceleration of the boundary against time, from the rows of a file.

Between its rows the acceleration is a cubic spline, without its offset: that of a sensor, and
gravity along z. The offset is a mean with the weights of a Hann window, sin²(πt/T) for a record of
length T. Recorded sines rarely end after whole periods, and the plain mean of a part of a period is
not zero: subtracted, it acts as a tilt of the substrate. Only a record that repeats has its plain
mean subtracted, because it consists of whole periods.

Integrated twice, the acceleration gives the displacement, a polynomial of fifth order from row to
row. Two constants are free: the boundary starts at no displacement, and a constant velocity, which
no bead feels, brings it back to it at the end of the record. The velocities at both ends differ
unless the record repeats.

With p rows a period, the spline of a sine is off by (2π/p)⁴/384 of its peak: 4e-5 with 18 rows,
2e-10 with 400.

Files are read in `walkers.inputs.records.record_file`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import asin, degrees
from typing import TYPE_CHECKING, Annotated

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.config_table import SAME_RUN, ConfigTable
from walkers.inputs.records.signals import (
    ComplexArray,
    hann_mean,
    leakage,
    local_amplitude,
    longest,
    periods_by_phase,
    slow_part,
)
from walkers.inputs.units import ACCELERATION, ACCELERATION_OF_ONE_G
from walkers.rounding import counted

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

FEWEST, MOST = 16, 100_000
"""Numbers of rows."""
FEWEST_PERIODS = 3.0
"""Shortest record that does not repeat, in periods of its strongest line."""
WINDOW = 8
"""Periods of the strongest line in a window for the local amplitude."""
_SLOW = 4  # periods of the slowest line in a window for the slow part of the displacement
STATIONARY = 0.1
"""Largest difference of local amplitudes of a stationary record, over the largest one."""
_UNEVEN = (
    1.5  # longest time between two rows, in medians of all; longer where single rows are lost …
)
_LOST = 2.5  # … up to this one …
_MOST_LOST = 0.01  # … and for this share of all rows
_REPEATED = 0.05  # share of times that repeat, from which on they have too few digits
_WHOLE = 1e-3  # error of the number of periods: a record ends after whole ones if it nearly does
_COARSE = 0.1  # largest change by leaving out every second row, root mean square; a sine does with six rows a period
_FAINT = 0.05  # share of the strongest amplitude in the spectrum below which others do not count
_BEATS = 16  # fewest beats of two lines in a record; the amplitude of one with fewer changes slowly
_CONSTANT = 1e-9  # change of a dead sensor, over its value
_TILT = (
    1.75e-3 * ACCELERATION_OF_ONE_G
)  # acceleration along a substrate that is tilted by 0.1°, m/s²
_DISPLACEMENTS = (
    1e-9,
    1.0,
)  # smallest and largest amplitude of an electrodynamic shaker, with a margin, m


class Record(ConfigTable):
    """The rows of a file: time (s), acceleration along x, y and z (m/s²).

    ``repeats`` says whether they are a period, which repeats. ``ignored_columns`` are the names of
    columns of the file that are neither a time nor an acceleration.
    """

    file: Annotated[str, SAME_RUN] = ""
    rows: tuple[tuple[float, float, float, float], ...]
    repeats: Annotated[bool, SAME_RUN] = False  # as the key of the drive says
    ignored_columns: Annotated[tuple[str, ...], SAME_RUN] = ()

    @cached_property
    def course(self) -> PPoly:
        """Displacement along x, y and z, m, against the time since the first row, s."""
        course = _without_offset(np.array(self.rows), self.repeats).antiderivative(2)
        drift = course(course.x[-1]) / course.x[-1]
        course.c[-2] -= drift
        course.c[-1] -= drift * course.x[:-1, None]
        return course

    @cached_property
    def slow_course(self) -> PPoly | None:
        """The slow part of the displacement along x, y and z, m, against time, s; None if the record repeats.

        The error of a sensor, integrated twice, grows to millimetres within a second. What changes
        slowly compared with four periods of the slowest line is no shaking, and no bead feels it:
        amplitudes and pictures leave it out (`walkers.inputs.records.signals.slow_part`). The run contains
        it.
        """
        from scipy.interpolate import CubicSpline

        if self.repeats:
            return None
        count = len(self.rows)
        width = int(min(_SLOW / self._lines[0], 1.0) * count)
        time = np.linspace(0.0, self.length, count)
        slow = slow_part(self.course(time), width)
        nodes = np.unique(np.linspace(0, count - 1, 4 + 16 * count // width).astype(np.int64))
        return CubicSpline(time[nodes], slow[nodes])

    @property
    def length(self) -> float:
        """Time from the first to the last row, s."""
        return self.rows[-1][0] - self.rows[0][0]

    @property
    def axes(self) -> dict[str, int]:
        """The axes that are shaken, and their places among x, y and z."""
        return {
            axis: place
            for place, axis in enumerate("xyz")
            if any(row[1 + place] for row in self.rows)
        }

    def largest(self, order: int) -> float:
        """Largest displacement (order 0, m), velocity (1, m/s) or acceleration (2, m/s²) of the spline.

        It is the largest length of the vector, at the rows and at three times between any two: with
        six rows a period, the rows alone miss the peak of a sine by up to 13 %. Displacement and
        velocity are without their slow part, which is uncertain near both ends of a record: they
        are not evaluated there.
        """
        rows = np.arange(len(self.course.x))
        time = np.interp(np.arange(0.0, rows[-1] + 0.125, 0.25), rows, self.course.x)
        if order < 2 and not self.repeats:
            margin = min(_SLOW / self._lines[0], 0.4) * self.length
            time = time[(time >= margin) & (time <= self.length - margin)]
        return float(np.linalg.norm(self.shaking(time, order), axis=1).max())

    def shaking(self, time: FloatArray, order: int = 0) -> FloatArray:
        """Displacement without its slow part (order 0, m), velocity (1) or acceleration (2) at times (s), (N, 3)."""
        values = self.course(time, order, extrapolate=self._beyond)
        if order < 2 and self.slow_course is not None:
            values = values - self.slow_course(time, order)
        return np.asarray(values)

    @cached_property
    def farthest(self) -> float:
        """Largest displacement at the rows with its slow part, m: how far the walls move in the frame ``lab``."""
        return float(np.linalg.norm(self.course(self.course.x), axis=1).max())

    @cached_property
    def direction(self) -> tuple[float, float, float]:
        """Direction in which the acceleration has its largest root mean square, a unit vector."""
        acceleration = self.course(self.course.x, 2)
        axis = np.linalg.eigh(acceleration.T @ acceleration)[1][:, -1]
        x, y, z = (axis * np.sign(axis[np.argmax(np.abs(axis))])).tolist()
        return (x, y, z)

    @cached_property
    def _even(self) -> FloatArray:
        """The acceleration at as many even times as there are rows, m/s², shape (N, 3)."""
        count = len(self.rows)
        return np.asarray(self.course(np.arange(count) * self.length / count, 2))

    @cached_property
    def _phasors(self) -> ComplexArray:
        """Spectrum of the acceleration along x, y and z by the number of periods in the record, m/s², shape (K, 3)."""
        count = len(self.rows)
        window = np.ones((count, 1)) if self.repeats else np.hanning(count + 1)[:-1, None]
        return np.asarray(np.fft.rfft(self._even * window, axis=0) * 2.0 / window.mean() / count)

    @cached_property
    def _spectrum(self) -> FloatArray:
        """Length of the vectors of the spectrum, m/s², shape (K,)."""
        return np.asarray(np.linalg.norm(self._phasors, axis=1))

    @cached_property
    def _strongest(self) -> int:
        """Periods in the record of the strongest line."""
        return int(self._spectrum[1:].argmax()) + 1

    @cached_property
    def _lines(self) -> list[int]:
        """Periods in the record of its lines: maxima of the spectrum from two periods on that are not faint."""
        spectrum = self._spectrum
        strong = _FAINT * spectrum[1:].max()
        lines = [
            number
            for number in range(2, len(spectrum) - 1)
            if spectrum[number] > strong
            and spectrum[number - 1] <= spectrum[number] > spectrum[number + 1]
        ]
        return lines or [self._strongest]

    @cached_property
    def strongest_line(self) -> float:
        """Frequency of the strongest line of the spectrum, Hz."""
        peak = self._strongest
        if self.repeats:
            return peak / self.length
        least = np.finfo(np.float64).tiny
        left, top, right = np.log(np.maximum(self._spectrum[peak - 1 : peak + 2], least))
        periods = peak + 0.5 * float((left - right) / (left - 2.0 * top + right))
        periods = periods_by_phase(self._even, periods)
        whole = round(periods)
        return (whole if abs(periods - whole) < _WHOLE else periods) / self.length

    @cached_property
    def frequencies(self) -> tuple[float, float]:
        """Frequency of a cycle (of all lines, if the record repeats; else the strongest), and the highest one, Hz."""
        high = np.flatnonzero(self._spectrum > _FAINT * self._spectrum[1:].max())
        fastest = float(high[-1]) / self.length
        if self.repeats:
            return float(np.gcd.reduce(high)) / self.length, fastest
        return self.strongest_line, fastest

    @cached_property
    def _amplitudes(self) -> FloatArray:
        """Local amplitude at the times of `_even`, m/s²."""
        count = len(self.rows)
        if self.repeats:
            return np.full(count, longest(self._phasors[[self._strongest]])[0])
        periods = self.strongest_line * self.length
        width = WINDOW / periods
        # Beats with another line, which come and go within a few cycles, are no change of the amplitude.
        beats = [abs(line - periods) for line in self._lines]
        fewest = min((number for number in beats if number >= _BEATS), default=count)
        width = max(width, 2.0 / fewest)
        return local_amplitude(self._even, periods / count, max(int(width * count), 2))

    def local_amplitude(self, time: FloatArray) -> FloatArray:
        """Local amplitude of the acceleration at times (s), m/s², shape (N,).

        This is the amplitude of the strongest line of the spectrum in a Hann window of eight of its
        periods, as a lock-in amplifier measures it: noise, harmonics and other lines do not count.
        The window is two beats of the strongest line with the nearest other one, if these are
        longer. In the half window at either end, the amplitude is that of the first or last whole
        window. A record that repeats has one amplitude.
        """
        even = np.arange(len(self.rows)) * self.length / len(self.rows)
        return np.interp(time, even, self._amplitudes)

    @property
    def is_stationary(self) -> bool:
        """Whether the local amplitude stays within a tenth of its largest value."""
        low, high = self.amplitude_range
        return high - low <= STATIONARY * high

    @cached_property
    def amplitude_range(self) -> tuple[float, float]:
        """Smallest and largest local amplitude, m/s²."""
        return float(self._amplitudes.min()), float(self._amplitudes.max())

    def motion(self, time: FloatArray) -> FloatArray:
        """Displacement, velocity and acceleration along x, y and z at times (s), shape (3, N, 3)."""
        return np.stack([self.course(time, order, extrapolate=self._beyond) for order in range(3)])

    @property
    def _beyond(self) -> str | None:
        """How a course continues after the last row."""
        return "periodic" if self.repeats else None

    @cached_property
    def uncertain_offset(self) -> float:
        """Largest error of the offset by lines that do not end after whole periods, m/s²."""
        if self.repeats:
            return 0.0
        lines = np.array(self._lines)
        return float(np.sum(self._spectrum[lines] * leakage(np.maximum(lines, 2.0))))

    @cached_property
    def change_of_offset(self) -> float:
        """Change of the offset from the first to the second half, m/s²; zero if lines could cause it."""
        if self.repeats:
            return 0.0
        half = len(self._even) // 2
        change = float(np.linalg.norm(hann_mean(self._even[-half:]) - hann_mean(self._even[:half])))
        lines = np.array(self._lines)
        possible = 2.0 * np.sum(self._spectrum[lines] * leakage(np.maximum(lines / 2.0, 1.5)))
        return change if change > possible else 0.0

    @property
    def doubts(self) -> list[str]:
        """Reasons why the offset of the sensor may act as a tilt."""
        reasons = []
        if (error := self.uncertain_offset) > _TILT:
            periods = f"{self._lines[0]} periods of its slowest line"
            reasons.append(
                f"drive.record has only {periods}: its offset is uncertain by {_as_tilt(error)}"
            )
        if (change := self.change_of_offset) > 2.0 * _TILT:
            halves = "the offset of drive.record changes from its first to its second half"
            reasons.append(
                f"{halves}: the rest acts as {_as_tilt(change / 2.0)}, first one way, then the other"
            )
        return reasons

    @property
    def notes(self) -> list[str]:
        """What a user should know of a record before it is run."""
        lines = []
        if self.ignored_columns:
            names = ", ".join(f'"{name}"' for name in self.ignored_columns)
            lines.append(
                f"drive.record: columns that are no acceleration along x, y or z are left out: {names}"
            )
        if lost := int(np.sum(_gaps(np.array(self.rows)[:, 0]))):
            lines.append(
                f"drive.record lacks {counted(lost, 'row')}: the spline goes over the gaps"
            )
        amplitude, (smallest, largest) = self.largest(0), _DISPLACEMENTS
        if not smallest < amplitude < largest:
            size = f"{self.frequencies[0]:.4g} Hz and an amplitude of {amplitude:.2g} m"
            lines.append(f"drive.record has {size}: is the unit of the time right?")
        return [*lines, *self.doubts]


def course_text(times: FloatArray, powers: FloatArray, repeats: bool = False) -> str:
    """A course as the engine reads it: a period or 0, then each piece's time and powers, given the highest first."""
    powers = powers[::-1].tolist() + [[0.0] * powers.shape[1]] * (6 - len(powers))
    rows = zip(times.tolist(), *powers, strict=False)
    return (
        "\n".join([repr(float(times[-1] * repeats)), *(" ".join(map(repr, row)) for row in rows)])
        + "\n"
    )


def _as_tilt(acceleration: float) -> str:
    """An acceleration as text, in g, with the tilt of a substrate that gives it."""
    share = acceleration / ACCELERATION_OF_ONE_G
    tilt = degrees(asin(min(share, 1.0)))
    return f"{share:.2g} g, like a tilt of {tilt:.2g}°"


def _through(rows: FloatArray, repeats: bool = False) -> PPoly:
    """The spline of the acceleration through rows, shape (N, 4)."""
    from scipy.interpolate import CubicSpline

    if repeats:
        rows[-1, 1:] = rows[0, 1:]
    return CubicSpline(
        rows[:, 0] - rows[0, 0], rows[:, 1:], bc_type="periodic" if repeats else "not-a-knot"
    )


def _without_offset(rows: FloatArray, repeats: bool = False) -> PPoly:
    """The acceleration through rows, shape (N, 4), without its offset."""
    spline = _through(rows, repeats)
    length = spline.x[-1]
    if repeats:
        offset = spline.integrate(0.0, length) / length
    else:
        offset = hann_mean(spline(np.linspace(0.0, length, 2 * len(rows) - 1)[1:-1]))
    spline.c[-1] -= offset
    return spline


def record_of(value: object) -> object:
    """A record from its file's name and its rows, which stand in the place of the name in a case."""
    if isinstance(value, Record):
        return value
    try:
        rows = tuple((float(time), float(x), float(y), float(z)) for time, x, y, z in value["rows"])  # type: ignore[index]
    except (LookupError, TypeError, ValueError) as error:
        raise ValueError("expected text: a file of comma-separated values") from error
    _check(rows)
    ignored = tuple(map(str, value.get("ignored_columns", ())))  # type: ignore[attr-defined]
    return Record(file=value.get("file", ""), rows=rows, ignored_columns=ignored)  # type: ignore[attr-defined]


def _gaps(time: FloatArray) -> FloatArray:
    """Where single rows are lost, shape (N - 1,)."""
    steps = np.diff(time)
    return np.asarray(steps > _UNEVEN * np.median(steps))


def _check(rows: Sequence[Sequence[float]]) -> None:
    """Raise `ValueError` for rows that give no motion."""
    if not FEWEST <= len(rows) <= MOST:
        raise ValueError(f"has {len(rows)} rows; expected {FEWEST} to {MOST}")
    array, largest = np.array(rows), ACCELERATION.largest
    if (
        odd := ~np.isfinite(array).all(axis=1) | (np.abs(array[:, 1:]) > largest).any(axis=1)
    ).any():
        expected = f"expected a number in each column, accelerations up to {largest:g} m/s²"
        raise ValueError(f"row {np.argmax(odd) + 1}: {expected}")
    _check_times(array[:, 0])
    spread = np.ptp(array[:, 1:], axis=0)
    if (spread <= _CONSTANT * np.abs(array[:, 1:]).max(axis=0)).all():
        raise ValueError(
            "the acceleration is constant, as from a dead sensor; expected one that changes"
        )
    if spread.max() < 2.0 * ACCELERATION.smallest:
        amplitude = f"{spread.max() / 2.0:.2g} m/s²"
        raise ValueError(
            f"expected an acceleration of {ACCELERATION.smallest:g} m/s² or more, found {amplitude}"
        )
    time = array[:, 0] - array[0, 0]
    from_half = _through(array[::2])(time)
    difference = (array[:, 1:] - from_half)[:-1]  # half of the rows may end before the last one
    change = float(np.linalg.norm(difference) / np.linalg.norm(_without_offset(array)(time)))
    if change > _COARSE:
        message = "rows are too far apart, or too noisy: leaving out every second one changes the acceleration by"
        raise ValueError(
            f"{message} {change:.0%} (root mean square); expected at most {_COARSE:.0%}"
        )


def _check_times(time: FloatArray) -> None:
    """Raise `ValueError` for times (s) that do not increase evenly."""
    steps = np.diff(time)
    if (steps < 0.0).all():
        raise ValueError(
            "times decrease from row to row; expected the first measurement in the first row"
        )
    repeated = steps == 0.0
    if repeated.mean() > _REPEATED and (steps >= 0.0).all():
        first = int(np.argmax(repeated)) + 1
        coarse = (
            f"times repeat: rows {first} and {first + 1} are both at {1e3 * time[first]:.6g} ms"
        )
        raise ValueError(f"{coarse}; expected times with more digits, such as whole microseconds")
    usual = np.median(steps)
    lost = (steps > _UNEVEN * usual) & (steps <= _LOST * usual)
    odd = (steps <= 0.0) | (steps > _UNEVEN * usual)
    if lost.sum() <= _MOST_LOST * len(time):
        odd &= ~lost
    if odd.any():
        after = (
            f"row {np.argmax(odd) + 2} is {1e3 * steps[np.argmax(odd)]:.6g} ms after the one before"
        )
        raise ValueError(
            f"{after}; expected times that increase without gaps, about {1e3 * usual:.6g} ms apart"
        )
