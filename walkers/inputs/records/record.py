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

A *line* is a maximum of the spectrum of the acceleration: a frequency at which the boundary shakes.
The *local amplitude* of a record is that of its strongest line around a time.

Files are read in `walkers.inputs.records.record_file`. The numerics of sampled signals are in
`walkers.inputs.records.signals`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import asin, degrees
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from walkers.arrays import BoolArray, FloatArray
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

FEWEST_ROWS = 16
"""Smallest number of rows of a record."""
MOST_ROWS = 100_000
"""Largest number of rows of a record."""
FEWEST_PERIODS = 3.0
"""Shortest record that does not repeat, in periods of its strongest spectral line."""
AMPLITUDE_WINDOW_PERIODS = 8
"""Width of the window for the local amplitude, in periods of the strongest line."""
STATIONARY = 0.1
"""Largest difference of local amplitudes of a stationary record, over the largest one."""
_SLOW_WINDOW_PERIODS = 4
"""Width of the window for the slow part of the displacement, in periods of the slowest line."""
_LARGEST_MARGIN = 0.4
"""Largest share of a record at either end in which the slow part counts as uncertain."""
_NODES_PER_WINDOW = 16
"""Nodes of the spline of the slow part in each of its windows, within which it hardly changes."""
_FEWEST_NODES = 4
"""Smallest number of nodes of this spline."""
_UNEVEN_STEP = 1.5
"""Longest time between two rows, in medians of all such times, unless single rows are lost."""
_LOST_STEP = 2.5
"""Longest time between two rows between which one is lost, in medians of all such times."""
_LARGEST_LOST_SHARE = 0.01
"""Largest number of lost rows, over that of all rows."""
_LARGEST_REPEATED_SHARE = 0.05
"""Share of times that repeat, above which the times have too few digits."""
_WHOLE_PERIODS_ERROR = 1e-3
"""A number of periods that differs by less from a whole number is taken for whole."""
_LARGEST_COARSENESS = 0.1
"""Largest relative change of the acceleration (root mean square) by leaving out every second row.

A sine with six rows a period changes by as much.
"""
_FAINT_SHARE = 0.05
"""Amplitude in the spectrum below which a line does not count, over that of the strongest one."""
_FEWEST_BEATS = 16
"""Smallest number of beats of two lines in a record; with fewer, the amplitude changes slowly."""
_CONSTANT_SHARE = 1e-9
"""Largest change of the acceleration of a dead sensor, over its value."""
_TILT = 1.75e-3 * ACCELERATION_OF_ONE_G
"""Acceleration along a substrate that is tilted by 0.1°, m/s²."""
_SMALLEST_DISPLACEMENT = 1e-9
"""Smallest amplitude of an electrodynamic shaker, with a margin, m."""
_LARGEST_DISPLACEMENT = 1.0
"""Largest amplitude of an electrodynamic shaker, with a margin, m."""
_SLOWEST_SAMPLING = 20.0
"""Smallest number of rows a second of a logger for shaking, which is at 40 Hz and more."""
_FASTEST_SHAKING = 5e3
"""Highest frequency of an electrodynamic shaker, Hz."""
_POWERS_IN_TEXT = 6
"""Number of coefficients of each piece of a course, as the engine reads it."""


class Record(ConfigTable):
    """The rows of a file of recorded shaking.

    Attributes
    ----------
    file
        Name of the file, as the case has it.
    rows
        Time, s, and acceleration along x, y and z, m/s².
    repeats
        Whether the rows are a period, which repeats, as the key of the drive says.
    ignored_columns
        Names of the columns of the file that are neither a time nor an acceleration.
    """

    file: Annotated[str, SAME_RUN] = ""
    rows: tuple[tuple[float, float, float, float], ...]
    repeats: Annotated[bool, SAME_RUN] = False
    ignored_columns: Annotated[tuple[str, ...], SAME_RUN] = ()

    @cached_property
    def course(self) -> PPoly:
        """Displacement along x, y and z, m, against the time since the first row, s."""
        course = _without_offset(np.array(self.rows), repeats=self.repeats).antiderivative(2)
        # The velocity that no bead feels brings the displacement back to zero at the end.
        drift = course(course.x[-1]) / course.x[-1]
        course.c[-2] -= drift
        course.c[-1] -= drift * course.x[:-1, None]
        return course

    @cached_property
    def slow_course(self) -> PPoly | None:
        """The slow part of the displacement along x, y and z, m, against time as in `course`.

        None if the record repeats. The error of a sensor, integrated twice, grows to millimetres
        within a second. What changes slowly compared with four periods of the slowest line is no
        shaking, and no bead feels it: amplitudes and pictures leave it out
        (`walkers.inputs.records.signals.slow_part`). The run contains it.
        """
        from scipy.interpolate import CubicSpline

        if self.repeats:
            return None
        count = len(self.rows)
        share_of_window = min(_SLOW_WINDOW_PERIODS / self._periods_of_lines[0], 1.0)
        rows_in_window = int(share_of_window * count)
        time = np.linspace(0.0, self.length, count)
        slow = slow_part(self.course(time), rows_in_window)
        node_count = _FEWEST_NODES + _NODES_PER_WINDOW * count // rows_in_window
        nodes = np.unique(np.linspace(0, count - 1, node_count).astype(np.int64))
        return CubicSpline(time[nodes], slow[nodes])

    @property
    def length(self) -> float:
        """Time from the first to the last row, s."""
        return self.rows[-1][0] - self.rows[0][0]

    @property
    def axes(self) -> dict[str, int]:
        """The axes that are shaken, and their places among x, y and z."""
        return {axis: place for place, axis in enumerate("xyz") if self._is_shaken(place)}

    def _is_shaken(self, place: int) -> bool:
        """Whether any row has an acceleration along an axis, by its place among x, y and z."""
        return any(row[1 + place] for row in self.rows)

    def largest(self, order: int) -> float:
        """Largest displacement, velocity or acceleration of the spline.

        It is the largest length of the vector, at the rows and at three instants between
        neighbouring rows: with six rows a period, the rows alone miss the peak of a sine by up to
        13 %. Displacement and velocity are without their slow part. That part is uncertain near
        both ends of a record, so displacement and velocity are not evaluated there.

        Parameters
        ----------
        order
            0 for the displacement, m, 1 for the velocity, m/s, or 2 for the acceleration, m/s².
        """
        rows = np.arange(len(self.course.x))
        quarters = np.arange(0.0, rows[-1] + 0.125, 0.25)  # of a row, to the last row
        time = np.interp(quarters, rows, self.course.x)
        if order < 2 and not self.repeats:
            margin = min(_SLOW_WINDOW_PERIODS / self._periods_of_lines[0], _LARGEST_MARGIN)
            margin *= self.length
            time = time[(time >= margin) & (time <= self.length - margin)]
        return float(np.linalg.norm(self.shaking(time, order), axis=1).max())

    def shaking(self, time: FloatArray, order: int = 0) -> FloatArray:
        """Displacement without its slow part, or its time derivative.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Times since the first row, s.
        order
            0 for the displacement, 1 for the velocity, or 2 for the acceleration, whose slow part
            is not subtracted.

        Returns
        -------
        ndarray, shape (N, 3)
            Components along x, y and z in m, m/s or m/s².
        """
        values = self.course(time, order, extrapolate=self._extrapolation)
        if order < 2 and self.slow_course is not None:
            values = values - self.slow_course(time, order)
        return np.asarray(values)

    @cached_property
    def farthest(self) -> float:
        """Largest displacement at the rows with its slow part, m.

        The walls move by it in the frame of reference ``lab``.
        """
        return float(np.linalg.norm(self.course(self.course.x), axis=1).max())

    @cached_property
    def direction(self) -> tuple[float, float, float]:
        """Direction in which the acceleration has its largest root mean square, a unit vector."""
        acceleration = self.course(self.course.x, 2)
        _, vectors = np.linalg.eigh(acceleration.T @ acceleration)
        axis = vectors[:, -1]
        x, y, z = (axis * np.sign(axis[np.argmax(np.abs(axis))])).tolist()
        return (x, y, z)

    @cached_property
    def _even_samples(self) -> FloatArray:
        """The acceleration at as many even times as there are rows, m/s², shape (N, 3)."""
        count = len(self.rows)
        return np.asarray(self.course(np.arange(count) * self.length / count, 2))

    @cached_property
    def _phasors(self) -> ComplexArray:
        """Spectrum of the acceleration along x, y and z, m/s², shape (K, 3).

        Row k is the component with k periods in the record.
        """
        count = len(self.rows)
        window = np.ones((count, 1)) if self.repeats else np.hanning(count + 1)[:-1, None]
        spectrum = np.fft.rfft(self._even_samples * window, axis=0)
        return np.asarray(spectrum * 2.0 / window.mean() / count)

    @cached_property
    def _spectrum(self) -> FloatArray:
        """Length of the vectors of the spectrum, m/s², shape (K,)."""
        return np.asarray(np.linalg.norm(self._phasors, axis=1))

    @cached_property
    def _strongest_periods(self) -> int:
        """Number of periods of the strongest line in the record."""
        return int(self._spectrum[1:].argmax()) + 1

    @cached_property
    def _periods_of_lines(self) -> list[int]:
        """Number of periods of each line in the record, increasing.

        Lines are maxima of the spectrum at two periods or more that are not faint (`_FAINT_SHARE`).
        If there are none, the only line is the strongest component.
        """
        spectrum = self._spectrum
        strong = _FAINT_SHARE * spectrum[1:].max()
        periods = []
        for number in range(2, len(spectrum) - 1):
            is_maximum = spectrum[number - 1] <= spectrum[number] > spectrum[number + 1]
            if is_maximum and spectrum[number] > strong:
                periods.append(number)
        return periods or [self._strongest_periods]

    @cached_property
    def strongest_line(self) -> float:
        """Frequency of the strongest line of the spectrum, Hz."""
        peak = self._strongest_periods
        if self.repeats:
            return peak / self.length
        # A parabola through the logarithms of the spectrum, and then the phase of the line.
        least = np.finfo(np.float64).tiny
        left, top, right = np.log(np.maximum(self._spectrum[peak - 1 : peak + 2], least))
        periods = peak + 0.5 * float((left - right) / (left - 2.0 * top + right))
        periods = periods_by_phase(self._even_samples, periods)
        whole_periods = round(periods)
        if abs(periods - whole_periods) < _WHOLE_PERIODS_ERROR:
            return whole_periods / self.length
        return periods / self.length

    @cached_property
    def frequencies(self) -> tuple[float, float]:
        """Frequency of a cycle, and the highest frequency, Hz.

        The cycle is that of all lines if the record repeats, or else of the strongest one.
        """
        periods = np.flatnonzero(self._spectrum > _FAINT_SHARE * self._spectrum[1:].max())
        highest = float(periods[-1]) / self.length
        cycle = self.strongest_line
        if self.repeats:
            cycle = float(np.gcd.reduce(periods)) / self.length
        return cycle, highest

    @cached_property
    def _amplitudes(self) -> FloatArray:
        """Local amplitude at the times of `_even_samples`, m/s², shape (N,)."""
        count = len(self.rows)
        if self.repeats:
            return np.full(count, longest(self._phasors[[self._strongest_periods]])[0])
        periods = self.strongest_line * self.length
        width = AMPLITUDE_WINDOW_PERIODS / periods
        # Beats with another line come and go within a few cycles: the amplitude does not change.
        fewest_beats = float(count)
        for line_periods in self._periods_of_lines:
            beats = abs(line_periods - periods)
            if beats >= _FEWEST_BEATS:
                fewest_beats = min(beats, fewest_beats)
        width = max(width, 2.0 / fewest_beats)
        samples_in_window = max(int(width * count), 2)
        return local_amplitude(self._even_samples, periods / count, samples_in_window)

    def local_amplitude(self, time: FloatArray) -> FloatArray:
        """Local amplitude of the acceleration.

        This is the amplitude of the strongest line of the spectrum in a Hann window of eight of its
        periods, as a lock-in amplifier measures it: noise, harmonics and other lines do not count.
        The window is two beats of the strongest line with the nearest other one, if these are
        longer. In the half window at either end, the amplitude is that of the first or last whole
        window. A record that repeats has one amplitude.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Times since the first row, s.

        Returns
        -------
        ndarray, shape (N,)
            In m/s².
        """
        even_times = np.arange(len(self.rows)) * self.length / len(self.rows)
        return np.interp(time, even_times, self._amplitudes)

    @property
    def is_stationary(self) -> bool:
        """Whether the local amplitude stays within a tenth of its largest value."""
        low, high = self.amplitude_range
        return high - low <= STATIONARY * high

    @cached_property
    def amplitude_range(self) -> tuple[float, float]:
        """Smallest and largest `local_amplitude` of the strongest spectral line in time, m/s²."""
        return float(self._amplitudes.min()), float(self._amplitudes.max())

    def motion(self, time: FloatArray) -> FloatArray:
        """Displacement, m, velocity, m/s, and acceleration, m/s², along x, y and z.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Times since the first row, s.

        Returns
        -------
        ndarray, shape (3, N, 3)
            The three by the order of the time derivative.
        """
        extrapolation = self._extrapolation
        return np.stack([self.course(time, order, extrapolate=extrapolation) for order in range(3)])

    @property
    def _extrapolation(self) -> str | None:
        """How a course continues after the last row, as scipy's ``extrapolate``."""
        return "periodic" if self.repeats else None

    @cached_property
    def uncertain_offset(self) -> float:
        """Largest error of the offset due to lines that do not end after whole periods, m/s²."""
        if self.repeats:
            return 0.0
        periods = np.array(self._periods_of_lines)
        return float(np.sum(self._spectrum[periods] * leakage(np.maximum(periods, 2.0))))

    @cached_property
    def change_of_offset(self) -> float:
        """Change of the offset from the first half to the second, m/s²; 0 if lines may cause it."""
        if self.repeats:
            return 0.0
        half = len(self._even_samples) // 2
        first = hann_mean(self._even_samples[:half])
        second = hann_mean(self._even_samples[-half:])
        change = float(np.linalg.norm(second - first))
        periods = np.array(self._periods_of_lines)
        leakages = leakage(np.maximum(periods / 2.0, 1.5))  # half the periods in each half
        possible = 2.0 * np.sum(self._spectrum[periods] * leakages)
        if change <= possible:
            return 0.0
        return change

    @property
    def doubts(self) -> list[str]:
        """Reasons why the unit of the time may be wrong, or the offset act as a tilt, in words."""
        doubts = self._doubts_about_time
        error = self.uncertain_offset
        if error > _TILT:
            periods = f"{self._periods_of_lines[0]} periods of its slowest line"
            doubts.append(
                f"drive.record has only {periods}: its offset is uncertain by {_as_tilt(error)}"
            )
        change = self.change_of_offset
        if change > 2.0 * _TILT:
            halves = "the offset of drive.record changes from its first to its second half"
            tilt = _as_tilt(change / 2.0)
            doubts.append(f"{halves}: the rest acts as {tilt}, first one way, then the other")
        return doubts

    @property
    def notes(self) -> list[str]:
        """What a user should know of a record before it is run, in words.

        Notes are about columns that are left out, rows that are lost, and the `doubts` about the
        unit of the time and the offset.
        """
        notes = []
        if self.ignored_columns:
            columns = "columns that are no acceleration along x, y or z"
            names = ", ".join(f'"{name}"' for name in self.ignored_columns)
            notes.append(f"drive.record: {columns} are left out: {names}")
        # Each gap is of a single row: `_check_times` has refused longer ones.
        lost_rows = int(np.sum(_are_gaps(np.array(self.rows)[:, 0])))
        if lost_rows:
            rows = counted(lost_rows, "row")
            notes.append(f"drive.record lacks {rows}: the spline goes over the gaps")
        return [*notes, *self.doubts]

    @property
    def _doubts_about_time(self) -> list[str]:
        """A note on times whose unit is probably another one, in words; else none."""
        amplitude = self.largest(order=0)
        rate = (len(self.rows) - 1) / self.length
        frequency = self.frequencies[0]
        description = (
            f"drive.record has {rate:.3g} rows a second, a frequency of {frequency:.4g} Hz "
            f"and an amplitude of {amplitude:.3g} m"
        )
        question = "is the unit of the time right? It seems"
        if amplitude > _LARGEST_DISPLACEMENT or rate < _SLOWEST_SAMPLING:
            return [f"{description}: {question} that milliseconds are taken for seconds"]
        if amplitude < _SMALLEST_DISPLACEMENT or frequency > _FASTEST_SHAKING:
            return [f"{description}: {question} that seconds are taken for milliseconds"]
        return []


def course_text(times: FloatArray, powers: FloatArray, repeats: bool = False) -> str:
    """A piecewise polynomial of time as the engine reads it.

    Parameters
    ----------
    times : ndarray, shape (N + 1,)
        Start of each piece, and the end of the last one, s.
    powers : ndarray, shape (K, N)
        Coefficients of each piece, that of the highest power first, K up to 6.
    repeats
        Whether the course repeats after its end.

    Returns
    -------
    str
        The period, s, or 0, on the first line; then a line for each piece with its start and six
        coefficients, the constant first.
    """
    period = 0.0
    if repeats:
        period = float(times[-1])
    lines = [repr(period)]
    missing_powers = [0.0] * (_POWERS_IN_TEXT - len(powers))
    pieces = powers[::-1].T.tolist()
    for start, coefficients in zip(times[:-1].tolist(), pieces, strict=True):
        numbers = [start, *coefficients, *missing_powers]
        lines.append(" ".join(map(repr, numbers)))
    return "\n".join(lines) + "\n"


def _as_tilt(acceleration: float) -> str:
    """An acceleration as text, in g, with the tilt of a substrate that gives it."""
    share = acceleration / ACCELERATION_OF_ONE_G
    tilt = degrees(asin(min(share, 1.0)))
    return f"{share:.2g} g, like a tilt of {tilt:.2g}°"


def _spline(rows: FloatArray, *, repeats: bool = False) -> PPoly:
    """The spline of the acceleration through rows, shape (N, 4).

    The last row of a record that repeats is replaced by the first.
    """
    from scipy.interpolate import CubicSpline

    ends = "not-a-knot"
    if repeats:
        ends = "periodic"
        rows[-1, 1:] = rows[0, 1:]
    return CubicSpline(rows[:, 0] - rows[0, 0], rows[:, 1:], bc_type=ends)


def _without_offset(rows: FloatArray, *, repeats: bool = False) -> PPoly:
    """The spline of the acceleration through rows, without its mean over time.

    Parameters
    ----------
    rows
        Time (s) and acceleration (m/s²) along x, y and z, shape (N, 4).
    repeats
        Whether the record is one period of a motion. Otherwise, the mean has the weights of a Hann
        window, because the record may begin and end anywhere in a cycle.
    """
    spline = _spline(rows, repeats=repeats)
    length = spline.x[-1]
    if repeats:
        offset = spline.integrate(0.0, length) / length
    else:
        # The rows and the points halfway between them; the window is zero at both ends.
        times = np.linspace(0.0, length, 2 * len(rows) - 1)[1:-1]
        offset = hann_mean(spline(times))
    spline.c[-1] -= offset
    return spline


def record_of(value: object) -> object:
    """A record from the value of its key in a case.

    Parameters
    ----------
    value
        The name of its file (``file``), its ``rows`` and ``ignored_columns``, which stand in the
        place of the name in a case; or a record, which is returned.

    Raises
    ------
    ValueError
        If the value is something else, or the rows give no motion that can be run.
    """
    if isinstance(value, Record):
        return value
    expected = "expected text: a file of comma-separated values"
    if not isinstance(value, Mapping):
        raise ValueError(expected)
    try:
        rows = tuple(_row_of(row) for row in value["rows"])
    except (LookupError, TypeError, ValueError) as error:
        raise ValueError(expected) from error
    _check(rows)
    ignored_columns = tuple(map(str, value.get("ignored_columns", ())))
    return Record(file=value.get("file", ""), rows=rows, ignored_columns=ignored_columns)


def _row_of(row: Sequence[Any]) -> tuple[float, float, float, float]:
    """A row as numbers: time, s, and acceleration along x, y and z, m/s²."""
    time, x, y, z = row
    return (float(time), float(x), float(y), float(z))


def _are_gaps(time: FloatArray) -> BoolArray:
    """Whether at least one row is lost between two successive ones, shape (N - 1,).

    `_check_times` allows gaps of one lost row alone.
    """
    steps = np.diff(time)
    return np.asarray(steps > _UNEVEN_STEP * np.median(steps))


def _check(rows: Sequence[Sequence[float]]) -> None:
    """Raise `ValueError` for rows that give no motion that can be run."""
    if not FEWEST_ROWS <= len(rows) <= MOST_ROWS:
        raise ValueError(f"has {len(rows)} rows; expected {FEWEST_ROWS} to {MOST_ROWS}")
    array = np.array(rows)
    _check_numbers(array)
    _check_times(array[:, 0])
    _check_change(array[:, 1:])
    _check_resolution(array)


def _check_numbers(rows: FloatArray) -> None:
    """Raise `ValueError` for rows, shape (N, 4), with numbers that are not finite or too large."""
    largest = ACCELERATION.largest
    not_finite = ~np.isfinite(rows).all(axis=1)
    too_large = (np.abs(rows[:, 1:]) > largest).any(axis=1)
    unusable = not_finite | too_large
    if unusable.any():
        expected = f"expected a number in each column, accelerations up to {largest:g} m/s²"
        raise ValueError(f"row {np.argmax(unusable) + 1}: {expected}")


def _check_change(acceleration: FloatArray) -> None:
    """Raise `ValueError` for an acceleration, m/s², shape (N, 3), that hardly changes."""
    change = np.ptp(acceleration, axis=0)
    if (change <= _CONSTANT_SHARE * np.abs(acceleration).max(axis=0)).all():
        raise ValueError(
            "the acceleration is constant, as from a dead sensor; expected one that changes"
        )
    if change.max() < 2.0 * ACCELERATION.smallest:
        expected = f"expected an acceleration of {ACCELERATION.smallest:g} m/s² or more"
        raise ValueError(f"{expected}, found {change.max() / 2.0:.2g} m/s²")


def _check_resolution(rows: FloatArray) -> None:
    """Raise `ValueError` for rows, shape (N, 4), that are too far apart for their acceleration."""
    time = rows[:, 0] - rows[0, 0]
    from_half = _spline(rows[::2])(time)
    difference = (rows[:, 1:] - from_half)[:-1]  # half of the rows may end before the last one
    size = np.linalg.norm(_without_offset(rows)(time))
    change = float(np.linalg.norm(difference) / size)
    if change > _LARGEST_COARSENESS:
        cause = "rows are too far apart, or too noisy"
        effect = f"leaving out every second one changes the acceleration by {change:.0%}"
        expected = f"expected at most {_LARGEST_COARSENESS:.0%}"
        raise ValueError(f"{cause}: {effect} (root mean square); {expected}")


def _check_times(time: FloatArray) -> None:
    """Raise `ValueError` for times, s, shape (N,), that do not increase evenly.

    Single lost rows, up to 1 % of all rows, are accepted. Messages number rows from 1.
    """
    steps = np.diff(time)
    if (steps < 0.0).all():
        raise ValueError(
            "times decrease from row to row; expected the first measurement in the first row"
        )
    repeated = steps == 0.0
    if repeated.mean() > _LARGEST_REPEATED_SHARE and (steps >= 0.0).all():
        row = int(np.argmax(repeated)) + 1
        same_time = f"{1e3 * time[row]:.6g} ms"
        problem = f"times repeat: rows {row} and {row + 1} are both at {same_time}"
        raise ValueError(f"{problem}; expected times with more digits, such as whole microseconds")
    usual_step = np.median(steps)
    is_too_long = steps > _UNEVEN_STEP * usual_step
    lacks_one_row = is_too_long & (steps <= _LOST_STEP * usual_step)
    is_uneven = (steps <= 0.0) | is_too_long
    if lacks_one_row.sum() <= _LARGEST_LOST_SHARE * len(time):
        is_uneven &= ~lacks_one_row
    if is_uneven.any():
        first = np.argmax(is_uneven)  # a step; it ends at the row first + 1 from 0
        problem = f"row {first + 2} is {1e3 * steps[first]:.6g} ms after the one before"
        expected = "expected times that increase without gaps"
        raise ValueError(f"{problem}; {expected}, about {1e3 * usual_step:.6g} ms apart")
