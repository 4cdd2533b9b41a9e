"""Drive of the boundary: the table ``[drive]``, and the shaking that it stands for.

A drive is a sum of sines A sin(2π f t + φ), or a record. The cycle of a sum is the common period of
its sines; its peak acceleration, and the dimensionless Γ0 (`walkers.physics.dimer`), belong to the
largest sine. Files of records are read in `walkers.inputs.records`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import degrees, floor, gcd, hypot, inf, isclose, lcm, pi
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeGuard

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from walkers.arrays import FloatArray, Vector
from walkers.errors import Problem, key_error
from walkers.inputs import units
from walkers.inputs.config_table import Choice, ConfigTable, Indirect, key
from walkers.inputs.records.record import FEWEST_PERIODS, Record, course_text, record_of
from walkers.inputs.units import ACCELERATION_OF_ONE_G, Angle, Coefficient

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Frame = Literal["lab", "container"]
"""Frame of reference of positions and velocities: the laboratory or the walls."""
AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Unit vectors of the axes by their names."""
LARGEST_RATIO = 24
"""Largest integer in the ratio of two frequencies: 24/1 and 23/24 are accepted, 25/1 is not."""
MOST_PERIODS = 1000
"""Largest number of periods of the fastest sine in a cycle."""
_HIGHEST_MULTIPLE = 9
"""Highest harmonic of the waveforms, in multiples of the frequency."""
_DESCRIBED_HARMONICS = 3
"""Largest number of harmonics that the description of a drive names one by one."""
_LINE_SHARE = 0.95
"""The description of a record has the amplitude of its strongest spectral line if it is below this
share of the record's largest acceleration."""
_TIME_TOLERANCE = 1e-9
"""Relative tolerance of equal times, and tolerance of whole numbers of cycles."""
_SHORTEST_VECTOR = 1e-100
"""Length below which a vector has no direction."""
_LONGEST_VECTOR = 1e100
"""Length above which a vector has no direction: squares of its components would overflow."""
_MARGIN = 9.0
"""Time before and after a ramp in its spline, s; slow drives have a longer one."""
_AT_MOST_24 = Field(max_length=24)


def _triangle() -> Iterator[tuple[int, float]]:
    """The harmonics of a triangle, as in `WAVEFORMS`."""
    for multiple in range(1, _HIGHEST_MULTIPLE + 1, 2):
        yield multiple, 8.0 / pi**2 / multiple**2 * (-1.0) ** (multiple // 2)


def _sawtooth() -> Iterator[tuple[int, float]]:
    """The harmonics of a sawtooth, as in `WAVEFORMS`."""
    for multiple in range(1, _HIGHEST_MULTIPLE + 1):
        yield multiple, 2.0 / pi / multiple * (-1.0) ** (multiple + 1)


WAVEFORMS: Mapping[str, tuple[tuple[int, float], ...]] = {
    "sine": ((1, 1.0),),
    "triangle": tuple(_triangle()),
    "sawtooth": tuple(_sawtooth()),
}
"""Fourier series of the accelerations of waveforms, by name.

Each harmonic has its multiple of the frequency and its share of the peak acceleration. The sum of
the harmonics of a triangle, which end at the 9th, has 0.96 of the peak acceleration.
"""


def _is_direction(value: object) -> TypeGuard[Sequence[float]]:
    """Whether a value has three numbers as components, and a length that is not zero or huge."""
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        return False
    for component in value:
        # A bool is an int to `isinstance`, but no component.
        if type(component) not in (int, float) or not abs(component) < _LONGEST_VECTOR:
            return False
    return _has_direction(value)


def _read_axis(value: object) -> object:
    """An axis by its name, or a direction by its components; other values raise `ValueError`."""
    if value in ("x", "y", "z"):
        return value
    if _is_direction(value):
        x, y, z = value
        return (float(x), float(y), float(z))
    raise ValueError("expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]")


_VECTOR_SCHEMA = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
_Direction = Annotated[
    str | Vector,
    BeforeValidator(_read_axis),
    WithJsonSchema({"anyOf": [{"enum": list(AXES)}, _VECTOR_SCHEMA]}),
]
_Recorded = Annotated[Any, BeforeValidator(record_of), WithJsonSchema({"type": "string"})]
Ramp = tuple[tuple[float, float], ...]
"""Times after the start of the drive, s, and factors of the displacement at them."""


def _usable_ramp(ramp: Ramp) -> Ramp:
    """The ramp; raises `ValueError` if its times do not increase or all its factors are zero."""
    for (time, _), (later, _) in pairwise(ramp):
        if time >= later:
            raise ValueError("expected times that increase")
    if ramp and not any(factor for _, factor in ramp):
        raise ValueError("expected a factor above zero at some time")
    return ramp


_Factors = Annotated[
    tuple[tuple[units.NonNegativeDuration, Coefficient], ...],
    AfterValidator(_usable_ramp),
    WithJsonSchema({"type": "array", "items": {"type": "array", "minItems": 2, "maxItems": 2}}),
]


class _SineTable(ConfigTable):
    """A sine A sin(2π f t + φ) along a direction, as in ``[drive]`` and ``[[drive.harmonics]]``."""

    choices: ClassVar[tuple[Choice, ...]] = (Choice(("peak_acceleration",), ("gamma0",)),)
    axis: _Direction | None = key(
        "Direction of the shaking. Default: `x`; in containers `z`.", None
    )
    frequency: units.Frequency | None = key("Frequency in cycles per second.", None)
    peak_acceleration: units.Acceleration | None = key(
        "Peak acceleration of the boundary; `g` is 9.8 m/s².", None
    )
    gamma0: Indirect[Coefficient] = key(
        "Γ0 = a0 M/(4πγR̄) of the dimer of mass M and mean radius R̄, instead of a0.", None, 0.5
    )
    phase: Angle = key("Phase of the sine.", 0.0)


class HarmonicTable(_SineTable):
    """One of ``[[drive.harmonics]]``: A sin(2π f t + φ) along a direction.

    The frequency is f, the peak acceleration A (2πf)².
    """

    frequency: units.Frequency = key("Frequency in cycles per second.")


class Harmonic(HarmonicTable):
    """A harmonic of a resolved case."""

    axis: _Direction
    peak_acceleration: units.Acceleration

    @property
    def direction(self) -> Vector:
        """Direction of the shaking, a unit vector."""
        if isinstance(self.axis, str):
            return AXES[self.axis]
        return unit_vector(self.axis)

    @property
    def angular_frequency(self) -> float:
        """2πf, rad/s."""
        return 2.0 * pi * self.frequency

    @property
    def amplitude(self) -> float:
        """Displacement amplitude A, m."""
        return self.peak_acceleration / self.angular_frequency**2

    @property
    def peak_velocity(self) -> float:
        """Velocity amplitude 2πf A, m/s."""
        return self.peak_acceleration / self.angular_frequency


class DriveTable(_SineTable):
    """``[drive]``: one harmonic by its keys, several as ``[[drive.harmonics]]``, or a record.

    In the ``frame`` of the container, the default, the beads feel the inertial force. In the frame
    of the laboratory the walls move, which is possible for a single harmonic without a phase and
    for a record.
    """

    choices: ClassVar[tuple[Choice, ...]] = (
        Choice(("peak_acceleration",), ("gamma0",), ("harmonics",), ("record",)),
        Choice(("frequency",), ("harmonics",), ("record",)),
        Choice(("axis",), ("record",), required=False),
        Choice(("phase",), ("record",), required=False),
        Choice(("waveform",), ("record",), required=False),
    )
    waveform: Literal["sine", "triangle", "sawtooth"] = key(
        "Waveform of the acceleration. `triangle` and `sawtooth` contain harmonics up to the 9th.",
        "sine",
    )
    frame: Frame = key(
        "`container`: the beads feel the inertial force. `lab`: the boundary moves. "
        "Velocities agree within 10⁻⁶.",
        "container",
    )
    harmonics: Annotated[tuple[HarmonicTable, ...], _AT_MOST_24] = key("Several harmonics.", ())
    record: _Recorded | None = key(
        "File with the acceleration of the boundary against time. "
        "See [](../cases.md#recorded-shaking).",
        None,
        "trace.csv",
    )
    repeats: units.Flag | None = key(
        "Whether the record is a period, which repeats. Default: false.", None
    )
    ramp: _Factors = key(
        "Times after the start of the drive and factors of the displacement, "
        "which is linear in between.",
        (),
        [["0 s", 1], ["2 s", 0.2]],
    )

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Keys of a single harmonic beside several; without several, the problems of any table."""
        if not given.get("harmonics"):
            yield from super().problems(given, place)
            return
        excluded = {*HarmonicTable.model_fields, "waveform", "record"}
        for name in sorted(given.keys() & excluded):
            expected = f"expected none beside {place}.harmonics"
            if name in HarmonicTable.model_fields:
                expected = f"{expected}: write {place}.harmonics[0].{name}"
            yield Problem(f"{place}.{name}", None, expected)


class Drive(DriveTable):
    """The drive of a resolved case: a record, several harmonics, or a single one.

    The keys of the table itself describe a single harmonic; with a record or several harmonics,
    they have no values.
    """

    harmonics: Annotated[tuple[Harmonic, ...], _AT_MOST_24]

    @cached_property
    def excitation(self) -> Excitation:
        """The sum of sines that the keys describe, or the record."""
        if self.record:
            record = self.record.with_values(repeats=bool(self.repeats))
            return Excitation(harmonics=(), frame=self.frame, record=record, ramp=self.ramp)
        if self.harmonics:
            harmonics = tuple(_sine(harmonic) for harmonic in self.harmonics)
        else:
            harmonics = waveform(self.waveform, _sine(self))
        return Excitation(harmonics=harmonics, frame=self.frame, ramp=self.ramp)


def _sine(table: _SineTable) -> Harmonic:
    """The harmonic that the keys of a table describe, without those that act through others."""
    return Harmonic(
        axis=table.axis,
        frequency=table.frequency,
        peak_acceleration=table.peak_acceleration,
        phase=table.phase,
    )


@dataclass(frozen=True)
class Excitation:
    """The shaking of the boundary: a sum of sines or a record, times the factor of a ramp.

    Attributes
    ----------
    harmonics : tuple of Harmonic
        The sines; empty for a record.
    frame : {"lab", "container"}
        Whether the walls move, or an inertial force acts on the beads.
    record : Record or None
        The recorded shaking.
    ramp : tuple of tuple
        Times (s) after the start of the drive and factors of the displacement; empty for no ramp.
    """

    harmonics: tuple[Harmonic, ...]
    frame: Frame
    record: Record | None = None
    ramp: Ramp = ()

    @property
    def largest(self) -> Harmonic:
        """The harmonic of the largest peak acceleration, the first of equal ones."""
        return max(self.harmonics, key=lambda harmonic: harmonic.peak_acceleration)

    @property
    def direction(self) -> Vector:
        """Direction of the largest harmonic or of the record, a unit vector."""
        if self.record:
            return self.record.direction
        return self.largest.direction

    @property
    def peak_acceleration(self) -> float:
        """Peak acceleration of the largest harmonic or of the record, m/s².

        It includes the largest factor of the ramp.
        """
        if self.record:
            return self.largest_factor * self.record.largest(2)
        return self.largest_factor * self.largest.peak_acceleration

    @property
    def is_plain(self) -> bool:
        """Whether the drive is a single sine without phase, which the laboratory frame requires."""
        return len(self.harmonics) == 1 and self.harmonics[0].phase == 0.0

    @property
    def frequency(self) -> float:
        """Frequency of the cycle, Hz; harmonics without a common period raise `ValueError`."""
        if self.record:
            return self.record.frequencies[0]
        return common_frequency(self._frequencies)

    @property
    def fastest(self) -> float:
        """The highest frequency, Hz."""
        if self.record:
            return self.record.frequencies[1]
        return max(self._frequencies)

    @property
    def _frequencies(self) -> list[float]:
        """Frequencies of the harmonics, Hz."""
        return [harmonic.frequency for harmonic in self.harmonics]

    @property
    def amplitude(self) -> float:
        """Largest displacement, m: an upper bound for several harmonics.

        The displacement of a record is that without its slow part.
        """
        if self.record:
            displacement = self.record.largest(0)
        else:
            displacement = sum(harmonic.amplitude for harmonic in self.harmonics)
        return self.largest_factor * displacement

    @property
    def peak_velocity(self) -> float:
        """Largest speed, m/s: an upper bound for several harmonics.

        The speed of a record is that without its slow part.
        """
        if self.record:
            speed = self.record.largest(1)
        else:
            speed = sum(harmonic.peak_velocity for harmonic in self.harmonics)
        return self.largest_factor * speed

    @property
    def farthest(self) -> float:
        """Largest displacement of the boundary in the frame ``lab``, m.

        It includes the slow part of a record.
        """
        if self.record:
            return self.largest_factor * self.record.farthest
        return self.amplitude

    @property
    def changes(self) -> bool:
        """Whether the strength of the drive changes.

        It changes by a ramp, or with the amplitude of a record (`Record.is_stationary`).
        """
        return bool(self.ramp) or (self.record is not None and not self.record.is_stationary)

    def local_amplitude(self, time: FloatArray) -> FloatArray:
        """Peak acceleration of the drive around given times.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Times after the start of the drive, s.

        Returns
        -------
        ndarray, shape (N,)
            Peak acceleration of the largest harmonic, or `Record.local_amplitude` of a record,
            times the factor of the ramp, m/s².
        """
        if self.record:
            return np.asarray(self.factor(time) * self.record.local_amplitude(time))
        return np.asarray(self.factor(time) * self.largest.peak_acceleration)

    @property
    def largest_factor(self) -> float:
        """Largest factor of the ramp; 1 without a ramp."""
        return max((factor for _, factor in self.ramp), default=1.0)

    @property
    def cycle_limits(self) -> tuple[float, float]:
        """Smallest and largest number of cycles of a run.

        A run lasts at least to the end of the ramp, and at most to the end of a record that does
        not repeat. If the ramp ends with the record, the last whole cycle of the record is enough.
        """
        end_of_ramp = 0.0
        if self.ramp:
            end_of_ramp = self.ramp[-1][0]
        fewest = end_of_ramp * self.frequency
        if not self.ends:
            return fewest, inf
        most = self.length * self.frequency
        if end_of_ramp <= self.length * (1.0 + _TIME_TOLERANCE):
            fewest = min(fewest, floor(most + _TIME_TOLERANCE))
        return fewest, most

    @property
    def ends(self) -> bool:
        """Whether the drive is a record that does not repeat."""
        return self.record is not None and not self.record.repeats

    @property
    def length(self) -> float:
        """Length of a record that does not repeat, s; infinite for other drives."""
        if self.record and self.ends:
            return self.record.length
        return inf

    @cached_property
    def factor(self) -> PPoly:
        """Factor of the ramp against time (s).

        It is the mean of the linear ramp over a cycle, so that velocities do not jump at its kinks.
        With the integral F of the linear ramp and the period T of the cycle, the factor at time t
        is (F(t + T/2) - F(t - T/2)) / T: a polynomial of second order between the kinks of the two
        terms.
        """
        from scipy.interpolate import PPoly, make_interp_spline

        times, factors = np.array(self.ramp or ((0.0, 1.0),)).T
        cycle = 1.0 / self.frequency
        half = cycle / 2.0
        # The factor is constant outside the ramp. The result ends a cycle before the ends of the
        # spline. With more than one and a half cycles outside the ramp, its first and last pieces
        # are constant, too.
        margin = max(_MARGIN, 1.6 * cycle)
        start = times[0] - margin
        end = times[-1] + margin
        linear = make_interp_spline([start, *times, end], [factors[0], *factors, factors[-1]], k=1)
        integral = linear.antiderivative()
        knots = np.unique(
            np.concatenate([[start + cycle], times - half, times + half, [end - cycle]])
        )
        left = knots[:-1]
        middle = (knots[1:] + knots[:-1]) / 2.0

        # The second derivative jumps at the knots; it is the same everywhere between two of them.
        second = integral(middle + half, 2) - integral(middle - half, 2)
        first = integral(left + half, 1) - integral(left - half, 1)
        value = integral(left + half) - integral(left - half)
        powers = np.stack([second / (2.0 * cycle), first / cycle, value / cycle])
        return PPoly(powers, knots)

    def shaking(self, time: FloatArray) -> FloatArray:
        """Displacement without the slow part of a record (`Record.slow_course`), as in pictures.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Times after the start of the drive, s.

        Returns
        -------
        ndarray, shape (N, 3)
            Displacement along x, y and z, m.
        """
        if self.record:
            displacement = self.record.shaking(time)
            if self.ramp:
                displacement = displacement * self.factor(time)[:, None]
            return displacement
        parts = [np.outer(course[0], direction) for direction, course in self.motions(time)]
        return np.asarray(np.sum(parts, axis=0))

    def motions(self, time: FloatArray) -> Iterator[tuple[Vector, tuple[FloatArray, ...]]]:
        """The motion along the direction of each harmonic, or along each axis of a record.

        Parameters
        ----------
        time : ndarray, shape (N,)
            Times after the start of the drive, s.

        Yields
        ------
        direction : Vector
            A unit vector.
        course : tuple of ndarray, shape (N,)
            Displacement (m), velocity (m/s) and acceleration (m/s²) along it.
        """
        for harmonic in self.harmonics:
            angle = harmonic.angular_frequency * time + harmonic.phase
            sine = np.sin(angle)
            displacement = harmonic.amplitude * sine
            velocity = harmonic.peak_velocity * np.cos(angle)
            acceleration = -harmonic.peak_acceleration * sine
            yield harmonic.direction, self._ramped(time, displacement, velocity, acceleration)
        if self.record:
            motion = self.record.motion(time)
            for axis, column in self.record.axes.items():
                displacement, velocity, acceleration = motion[..., column]
                yield AXES[axis], self._ramped(time, displacement, velocity, acceleration)

    def _ramped(
        self, time: FloatArray, x: FloatArray, v: FloatArray, a: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacement x (m), velocity v (m/s) and acceleration a (m/s²), multiplied by the ramp.

        The ramp is a factor of the displacement; the others follow by the product rule. Without a
        ramp all of them are returned unchanged.
        """
        if not self.ramp:
            return x, v, a
        factor = self.factor(time)
        slope = self.factor(time, 1)
        curvature = self.factor(time, 2)
        return factor * x, factor * v + slope * x, factor * a + 2.0 * slope * v + curvature * x

    def course_files(self) -> dict[str, str]:
        """Names and contents of the files from which the engine reads a record and a ramp."""
        files = {}
        if self.record is not None:
            course = self.record.course
            for axis, column in self.record.axes.items():
                text = course_text(course.x, course.c[..., column], self.record.repeats)
                files[f"record.{axis}.txt"] = text
        if self.ramp:
            files["ramp.txt"] = course_text(self.factor.x, self.factor.c)
        return files

    def described(self, *, in_g: bool = False) -> str:
        """The drive in a few words: ``80 Hz, a0 = 39.2 m/s² + 160 Hz, a0 = 29.4 m/s², 90°``.

        Accelerations are in m/s², or in units of 9.8 m/s² as ``a0 = 4 g``.
        """
        if self.record:
            text = self._described_record(self.record)
        else:
            text = self._described_harmonics(in_g=in_g)
        if self.ramp:
            text += ", ramp " + " to ".join(f"{factor:g}" for _, factor in self.ramp)
        return text

    def _described_record(self, record: Record) -> str:
        """Frequency and largest acceleration of a record.

        The amplitude of its strongest spectral line follows if it is below `_LINE_SHARE` of this
        acceleration.
        """
        largest_acceleration = record.largest(2)
        _, line_amplitude = record.amplitude_range  # in time; the line may come and go
        text = f"record, {self.frequency:.4g} Hz, a0 = {largest_acceleration:.4g} m/s²"
        if line_amplitude < _LINE_SHARE * largest_acceleration:
            text += f" (its line: {line_amplitude:.4g} m/s²)"
        return text

    def _described_harmonics(self, *, in_g: bool) -> str:
        """All harmonics if there are at most three, else the largest and the number of others."""
        if len(self.harmonics) <= _DESCRIBED_HARMONICS:
            texts = [_described_harmonic(harmonic, in_g=in_g) for harmonic in self.harmonics]
            return " + ".join(texts)
        largest = _described_harmonic(self.largest, in_g=in_g)
        return f"{largest} + {len(self.harmonics) - 1} harmonics up to {self.fastest:g} Hz"


def _described_harmonic(harmonic: Harmonic, *, in_g: bool) -> str:
    """Frequency and peak acceleration of a harmonic, and its phase if it has one."""
    acceleration = f"{harmonic.peak_acceleration:.4g} m/s²"
    if in_g:
        acceleration = f"{harmonic.peak_acceleration / ACCELERATION_OF_ONE_G:.4g} g"
    text = f"{harmonic.frequency:g} Hz, a0 = {acceleration}"
    if harmonic.phase:
        text += f", {degrees(harmonic.phase):g}°"
    return text


def check_drive(drive: Excitation) -> None:
    """Check the record and the ramp of a drive.

    Parameters
    ----------
    drive
        The drive of a case whose peak accelerations are known.

    Raises
    ------
    InputError
        With the key ``drive.record`` if the record is too fast, or too short for its offset. With
        the key ``drive.ramp`` if the ramp makes the drive too strong, or if there is a ramp
        although the amplitude of the record changes by itself.
    """
    if drive.record:
        _check_record(drive.record)
    if drive.ramp:
        _check_ramp(drive)


def _check_record(record: Record) -> None:
    """Raise `InputError` for a record that is too fast, or too short for its offset."""
    highest = units.FREQUENCY.largest
    if record.frequencies[1] > highest:
        actual = f"found {record.frequencies[1]:.4g} Hz: is the unit of the time right?"
        raise key_error(
            "drive.record", f"expected frequencies up to {highest:g} Hz; {actual}", record.file
        )
    periods = record.strongest_line * record.length
    if not record.repeats and periods < FEWEST_PERIODS:
        expected = f"expected at least {FEWEST_PERIODS:g} periods of its strongest line"
        reason = "the offset of the sensor cannot be told from the shaking"
        remedy = "drive.repeats = true takes it as a whole period"
        message = f"{expected}, found {periods:.2g}: {reason}; {remedy}"
        raise key_error("drive.record", message, record.file)


def _check_ramp(drive: Excitation) -> None:
    """Raise `InputError` if the ramp makes the drive too strong, or if a record changes too."""
    largest = units.ACCELERATION.largest
    if drive.peak_acceleration > largest:
        expected = f"expected factors that give accelerations up to {largest:g} m/s²"
        actual = f"the largest one gives {drive.peak_acceleration:.6g} m/s²"
        raise key_error("drive.ramp", f"{expected}; {actual}")
    if drive.record and not drive.record.is_stationary:
        weakest, strongest = drive.record.amplitude_range
        low = weakest / units.ACCELERATION_OF_ONE_G
        high = strongest / units.ACCELERATION_OF_ONE_G
        reason = f"the amplitude of drive.record changes by itself, from {low:.3g} to {high:.3g} g"
        raise key_error("drive.ramp", f"expected none: {reason}")


def common_frequency(frequencies: list[float]) -> float:
    """Frequency of the common period of several oscillations.

    Parameters
    ----------
    frequencies
        The frequencies, Hz.

    Returns
    -------
    float
        The reciprocal of the common period, Hz.

    Raises
    ------
    ValueError
        If a ratio of frequencies is not one of whole numbers up to `LARGEST_RATIO`, or if the
        common period is longer than `MOST_PERIODS` of the shortest periods.
    """
    first = frequencies[0]
    if len(frequencies) == 1:  # the usual case, for each of the many points of a sweep
        return first
    ratios = [_ratio(frequency, first) for frequency in frequencies]
    denominator = lcm(*(ratio.denominator for ratio in ratios))
    numerators = [int(ratio * denominator) for ratio in ratios]
    common = gcd(*numerators)
    if max(numerators) > MOST_PERIODS * common:
        raise ValueError(
            f"their common period is longer than {MOST_PERIODS} times the shortest period"
        )
    return first * common / denominator


def _ratio(frequency: float, first: float) -> Fraction:
    """A frequency over the first; raises `ValueError` unless it is a ratio of small integers."""
    ratio = Fraction(frequency / first).limit_denominator(LARGEST_RATIO)
    is_exact = isclose(float(ratio) * first, frequency, rel_tol=1e-9)
    if not is_exact or ratio.numerator > LARGEST_RATIO:
        ratio_text = f"{frequency:g} Hz / {first:g} Hz"
        raise ValueError(f"{ratio_text} is not a ratio of whole numbers up to {LARGEST_RATIO}")
    return ratio


def waveform(name: str, first: Harmonic) -> tuple[Harmonic, ...]:
    """The harmonics of a periodic acceleration.

    Parameters
    ----------
    name
        One of `WAVEFORMS`.
    first
        A sine of the frequency, the peak acceleration, the direction and the phase of the waveform.
    """
    harmonics = []
    for multiple, share in WAVEFORMS[name]:
        phase = multiple * first.phase
        if share < 0.0:
            phase += pi
        harmonic = first.with_values(
            frequency=multiple * first.frequency,
            peak_acceleration=abs(share) * first.peak_acceleration,
            phase=phase,
        )
        harmonics.append(harmonic)
    return tuple(harmonics)


def _has_direction(vector: Sequence[float]) -> bool:
    """Whether the length of a vector is neither too small nor too large to divide it by."""
    return _SHORTEST_VECTOR < hypot(*vector) < _LONGEST_VECTOR


def unit_vector(vector: Vector) -> Vector:
    """A direction of length one; raises `ValueError` if the vector is zero or huge."""
    if not _has_direction(vector):
        raise ValueError("expected a direction such as [1, 0, 1]")
    length = hypot(*vector)
    x, y, z = vector
    return (x / length, y / length, z / length)
