"""Drive of the boundary: the table ``[drive]``, and the sum of sines A sin(2π f t + φ) that it stands for.

The cycle of a drive is the common period of its sines; its peak acceleration, and Γ0, belong to the largest one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import degrees, floor, gcd, hypot, inf, isclose, isfinite, lcm, pi
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from walkers.arrays import FloatArray, Vector
from walkers.errors import Problem, key_error
from walkers.inputs import units
from walkers.inputs.config_table import Choice, ConfigTable, Indirect, key
from walkers.inputs.records.record import FEWEST_PERIODS, Record, course_text, record_of
from walkers.inputs.units import Angle, Coefficient

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Frame = Literal["lab", "container"]
AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
LARGEST_RATIO = 24
"""Largest integer in the ratio of two frequencies: 24/1 and 23/24 are accepted, 25/1 is not."""
WAVEFORMS: Mapping[str, tuple[tuple[int, float], ...]] = {
    "sine": ((1, 1.0),),
    "triangle": tuple((k, 8.0 / pi**2 / k**2 * (-1.0) ** (k // 2)) for k in range(1, 10, 2)),
    "sawtooth": tuple((k, 2.0 / pi / k * (-1.0) ** (k + 1)) for k in range(1, 10)),
}
"""Of the acceleration: multiples of the frequency and shares of the peak. A triangle's series is cut at 0.96 of it."""
_LINE_ALONE = (
    0.95  # share of the largest acceleration of a record below which its line is named beside it
)
_FEW = 3
_FEW_ENOUGH = Field(max_length=24)
_SAME_TIME = 1e-9  # relative error of times, and of numbers of cycles
MOST_PERIODS = 1000
"""Largest number of periods of the fastest sine in a cycle."""


def _axis(value: object) -> object:
    """An axis by its name, or a direction by its components."""
    if value in ("x", "y", "z"):
        return value
    if isinstance(value, (list, tuple)) and len(value) == 3 and any(value):
        numbers = tuple(float(x) for x in value if type(x) in (int, float) and isfinite(x))
        if len(numbers) == 3:
            return numbers
    raise ValueError("expected 'x', 'y' or 'z', or a direction such as [1, 0, 1]")


_VECTOR = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
_Direction = Annotated[
    str | Vector, BeforeValidator(_axis), WithJsonSchema({"anyOf": [{"enum": list(AXES)}, _VECTOR]})
]
_Recorded = Annotated[Any, BeforeValidator(record_of), WithJsonSchema({"type": "string"})]
Ramp = tuple[tuple[float, float], ...]


def _usable_ramp(ramp: Ramp) -> Ramp:
    """A ramp whose times increase and whose factors are not all zero."""
    if any(time >= later for (time, _), (later, _) in pairwise(ramp)):
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
    """A sine A sin(2π f t + φ) along a direction: its keys in ``[drive]`` and in ``[[drive.harmonics]]``."""

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
    """One of ``[[drive.harmonics]]``: A sin(2π f t + φ) along a direction, frequency f, peak acceleration A (2πf)²."""

    frequency: units.Frequency = key("Frequency in cycles per second.")


class Harmonic(HarmonicTable):
    """A harmonic of a resolved case."""

    axis: _Direction
    peak_acceleration: units.Acceleration

    @property
    def direction(self) -> Vector:
        """Direction of the shaking, a unit vector."""
        return AXES[self.axis] if isinstance(self.axis, str) else unit_vector(self.axis)

    @property
    def angular_frequency(self) -> float:
        """2πf, rad/s."""
        return 2.0 * pi * self.frequency

    @property
    def amplitude(self) -> float:
        """A, m."""
        return self.peak_acceleration / self.angular_frequency**2

    @property
    def peak_velocity(self) -> float:
        """A 2πf, m/s."""
        return self.peak_acceleration / self.angular_frequency


class DriveTable(_SineTable):
    """``[drive]``: one harmonic by its keys, or several as ``[[drive.harmonics]]``.

    In the ``frame`` of the container, as is usual, the beads feel the inertial force; in the frame of the laboratory
    the walls move, which they can for one harmonic without a phase, and for a record.
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
        "`container`: the beads feel the inertial force. `lab`: the boundary moves. Velocities agree within 10⁻⁶.",
        "container",
    )
    harmonics: Annotated[tuple[HarmonicTable, ...], _FEW_ENOUGH] = key("Several harmonics.", ())
    record: _Recorded | None = key(
        "File with the acceleration of the boundary against time. See [](../cases.md#recorded-shaking).",
        None,
        "trace.csv",
    )
    repeats: units.Flag | None = key(
        "Whether the record is a period, which repeats. Default: false.", None
    )
    ramp: _Factors = key(
        "Times after the start of the drive and factors of the displacement, which is linear in between.",
        (),
        [["0 s", 1], ["2 s", 0.2]],
    )

    @classmethod
    def problems(cls, given: Mapping[str, Any], place: str) -> Iterator[Problem]:
        """Keys of a single harmonic beside several, or contradictions and gaps as of every table."""
        if not given.get("harmonics"):
            yield from super().problems(given, place)
            return
        for name in sorted(given.keys() & {*HarmonicTable.model_fields, "waveform", "record"}):
            instead = (
                f": write {place}.harmonics[0].{name}" if name in HarmonicTable.model_fields else ""
            )
            yield Problem(
                f"{place}.{name}", None, f"expected none beside {place}.harmonics{instead}"
            )


class Drive(DriveTable):
    """The drive of a resolved case: a record, several harmonics, or a single one by the keys of the table.

    With a record or several harmonics, the keys of the single one have no values.
    """

    harmonics: Annotated[tuple[Harmonic, ...], _FEW_ENOUGH]

    @cached_property
    def excitation(self) -> Excitation:
        """The sum of sines that the keys describe, or the record."""
        if self.record:
            return Excitation(
                (), self.frame, self.record.with_values(repeats=bool(self.repeats)), self.ramp
            )
        if self.harmonics:
            harmonics = tuple(_sine(harmonic) for harmonic in self.harmonics)
        else:
            harmonics = waveform(self.waveform, _sine(self))
        return Excitation(harmonics, self.frame, ramp=self.ramp)


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
    """A sum of sines or a record, a ramp, and the frame: moving walls, or an inertial force on the beads."""

    harmonics: tuple[Harmonic, ...]
    frame: Frame
    record: Record | None = None
    ramp: Ramp = ()

    @property
    def largest(self) -> Harmonic:
        """The harmonic of the largest peak acceleration, the first of equal ones."""
        return max(self.harmonics, key=lambda sine: sine.peak_acceleration)

    @property
    def direction(self) -> Vector:
        """Direction of the largest harmonic or of the record, a unit vector."""
        return self.record.direction if self.record else self.largest.direction

    @property
    def peak_acceleration(self) -> float:
        """Peak acceleration of the largest harmonic or of the record at the ramp's largest factor, m/s²."""
        return self.largest_factor * (
            self.record.largest(2) if self.record else self.largest.peak_acceleration
        )

    @property
    def is_plain(self) -> bool:
        """Whether the drive is a single sine without phase, which the laboratory frame requires."""
        return len(self.harmonics) == 1 and self.harmonics[0].phase == 0.0

    @property
    def frequency(self) -> float:
        """Frequency of the cycle, the common period of the harmonics, Hz; raises `ValueError` if they have none."""
        if self.record:
            return self.record.frequencies[0]
        return common_frequency([sine.frequency for sine in self.harmonics])

    @property
    def fastest(self) -> float:
        """The highest frequency, Hz."""
        return (
            self.record.frequencies[1]
            if self.record
            else max(sine.frequency for sine in self.harmonics)
        )

    @property
    def amplitude(self) -> float:
        """Largest displacement that the harmonics could add up to, or of a record without its slow part, m."""
        largest = (
            self.record.largest(0)
            if self.record
            else sum(sine.amplitude for sine in self.harmonics)
        )
        return self.largest_factor * largest

    @property
    def peak_velocity(self) -> float:
        """Largest speed that the harmonics could add up to, or of a record without its slow part, m/s."""
        largest = (
            self.record.largest(1)
            if self.record
            else sum(sine.peak_velocity for sine in self.harmonics)
        )
        return self.largest_factor * largest

    @property
    def farthest(self) -> float:
        """Largest displacement of the boundary in the frame ``lab``, with the slow part of a record, m."""
        return self.largest_factor * self.record.farthest if self.record else self.amplitude

    @property
    def changes(self) -> bool:
        """Whether the strength of the drive changes: by a ramp, or because a record is not stationary."""
        return bool(self.ramp) or (self.record is not None and not self.record.is_stationary)

    def local_amplitude(self, time: FloatArray) -> FloatArray:
        """Peak acceleration of the largest harmonic at times (s), m/s², shape (N,).

        This is its constant one times the factor of the ramp; of a record, `Record.local_amplitude` times the factor.
        """
        if self.record:
            return np.asarray(self.factor(time) * self.record.local_amplitude(time))
        return np.asarray(self.factor(time) * self.largest.peak_acceleration)

    @property
    def largest_factor(self) -> float:
        """Largest factor of the ramp."""
        return max((factor for _, factor in self.ramp), default=1.0)

    @property
    def cycle_limits(self) -> tuple[float, float]:
        """Smallest and largest number of cycles of a run: to the end of the ramp, and of a record that ends.

        A ramp that ends with the record ends with its last whole cycle.
        """
        end = self.ramp[-1][0] if self.ramp else 0.0
        fewest, most = end * self.frequency, inf
        if self.ends:
            most = self.length * self.frequency
            if end <= self.length * (1.0 + _SAME_TIME):
                fewest = min(fewest, floor(most + _SAME_TIME))
        return fewest, most

    @property
    def ends(self) -> bool:
        """Whether the drive is a record that does not repeat."""
        return self.record is not None and not self.record.repeats

    @property
    def length(self) -> float:
        """Length of a record that does not repeat, s; infinite for other drives."""
        return self.record.length if self.record and self.ends else inf

    @cached_property
    def factor(self) -> PPoly:
        """Factor of the ramp against time (s): its mean over a cycle, so that velocities do not jump at its kinks."""
        from scipy.interpolate import PPoly, make_interp_spline

        times, factors = np.array(self.ramp or ((0.0, 1.0),)).T
        cycle, far = 1.0 / self.frequency, (times[0] - 9.0, times[-1] + 9.0)
        even = make_interp_spline(
            [far[0], *times, far[1]], [factors[0], *factors, factors[-1]], k=1
        ).antiderivative()
        knots = np.unique(
            [far[0] + cycle, *(times - cycle / 2.0), *(times + cycle / 2.0), far[1] - cycle]
        )
        places = (
            (knots[1:] + knots[:-1]) / 2.0,
            knots[:-1],
            knots[:-1],
        )  # the second derivative is not continuous
        mean = [
            even(at + cycle / 2.0, k) - even(at - cycle / 2.0, k)
            for k, at in zip((2, 1, 0), places, strict=True)
        ]
        return PPoly(np.stack(mean) / [[2.0 * cycle], [cycle], [cycle]], knots)

    def shaking(self, time: FloatArray) -> FloatArray:
        """Displacement along x, y and z at times (s), m, shape (N, 3), without the slow part of a record.

        Pictures show this displacement. See `Record.slow_course`.
        """
        if self.record:
            displacement = self.record.shaking(time)
            if self.ramp:
                displacement = displacement * self.factor(time)[:, None]
            return displacement
        parts = [np.outer(course[0], direction) for direction, course in self.motions(time)]
        return np.asarray(np.sum(parts, axis=0))

    def motions(self, time: FloatArray) -> Iterator[tuple[Vector, tuple[FloatArray, ...]]]:
        """Direction of each harmonic or axis of a record, and displacement, velocity and acceleration at times (s)."""
        for harmonic in self.harmonics:
            turn = harmonic.angular_frequency * time + harmonic.phase
            sine = np.sin(turn)
            speed = harmonic.peak_velocity * np.cos(turn)
            course = (harmonic.amplitude * sine, speed, -harmonic.peak_acceleration * sine)
            yield harmonic.direction, self._ramped(time, *course)
        if self.record:
            moved = self.record.motion(time)
            for axis, place in self.record.axes.items():
                yield AXES[axis], self._ramped(time, *moved[..., place])

    def _ramped(self, time: FloatArray, *course: FloatArray) -> tuple[FloatArray, ...]:
        """A motion with the ramp."""
        if not self.ramp:
            return course
        (x, v, a), (factor, slope, bend) = course, (self.factor(time, order) for order in range(3))
        return factor * x, factor * v + slope * x, factor * a + 2.0 * slope * v + bend * x

    def course_files(self) -> dict[str, str]:
        """Names and contents of the files from which the engine reads a record and a ramp."""
        record = self.record
        files = {} if record is None else {
            f"record.{axis}.txt": course_text(record.course.x, record.course.c[..., place], record.repeats)
            for axis, place in record.axes.items()
        }  # fmt: skip
        return files | (
            {"ramp.txt": course_text(self.factor.x, self.factor.c)} if self.ramp else {}
        )

    def described(self) -> str:
        """The drive in a few words, such as ``80 Hz, a0 = 39.2 m/s² + 160 Hz, a0 = 29.4 m/s², 90°``."""
        ramp = (
            f", ramp {' to '.join(f'{factor:g}' for _, factor in self.ramp)}" if self.ramp else ""
        )
        if self.record:
            largest, line = self.record.largest(2), self.record.amplitude_range[1]
            of_line = f" (its line: {line:.4g} m/s²)" if line < _LINE_ALONE * largest else ""
            return f"record, {self.frequency:.4g} Hz, a0 = {largest:.4g} m/s²{of_line}{ramp}"
        shown = self.harmonics if len(self.harmonics) <= _FEW else (self.largest,)
        words = [
            f"{harmonic.frequency:g} Hz, a0 = {harmonic.peak_acceleration:.4g} m/s²"
            + (f", {degrees(harmonic.phase):g}°" if harmonic.phase else "")
            for harmonic in shown
        ]
        if len(shown) < len(self.harmonics):
            highest = max(harmonic.frequency for harmonic in self.harmonics)
            words.append(f"{len(self.harmonics) - 1} harmonics up to {highest:g} Hz")
        return " + ".join(words) + ramp


def check_drive(drive: Excitation) -> None:
    """Refuse a drive that is too strong or too fast, or a record that is too short or changes beside a ramp.

    Parameters
    ----------
    drive
        The drive of a case whose peak accelerations are known.

    Raises
    ------
    InputError
        With the key ``drive.record`` or ``drive.ramp``.
    """
    record = drive.record
    if record:
        _check_record(record)
    largest = units.ACCELERATION.largest
    if drive.ramp and drive.peak_acceleration > largest:
        strongest = f"the largest one gives {drive.peak_acceleration:.6g} m/s²"
        raise key_error(
            "drive.ramp",
            f"expected factors that give accelerations up to {largest:g} m/s²; {strongest}",
        )
    if drive.ramp and record and not record.is_stationary:
        low, high = (
            amplitude / units.ACCELERATION_OF_ONE_G for amplitude in record.amplitude_range
        )
        changes = f"the amplitude of drive.record changes by itself, from {low:.3g} to {high:.3g} g"
        raise key_error("drive.ramp", f"expected none: {changes}")


def _check_record(record: Record) -> None:
    """Refuse a record that is too fast, or too short for its offset."""
    highest = units.FREQUENCY.largest
    if record.frequencies[1] > highest:
        actual = f"found {record.frequencies[1]:.4g} Hz: is the unit of the time right?"
        raise key_error(
            "drive.record", f"expected frequencies up to {highest:g} Hz; {actual}", record.file
        )
    periods = record.strongest_line * record.length
    if not record.repeats and periods < FEWEST_PERIODS:
        least = f"expected at least {FEWEST_PERIODS:g} periods of its strongest line, found {periods:.2g}"
        reason = "the offset of the sensor cannot be told from the shaking"
        cure = "drive.repeats = true takes it as a whole period"
        raise key_error("drive.record", f"{least}: {reason}; {cure}", record.file)


def common_frequency(frequencies: list[float]) -> float:
    """Frequency of the common period of several, Hz; raises `ValueError` if there is none, or it is too long."""
    first = frequencies[0]
    if len(frequencies) == 1:  # asked for at every turn of a sweep's plan
        return first
    ratios = [
        Fraction(frequency / first).limit_denominator(LARGEST_RATIO) for frequency in frequencies
    ]
    for frequency, ratio in zip(frequencies, ratios, strict=True):
        if (
            not isclose(float(ratio) * first, frequency, rel_tol=1e-9)
            or ratio.numerator > LARGEST_RATIO
        ):
            raise ValueError(
                f"{frequency:g} Hz / {first:g} Hz is not a ratio of whole numbers up to {LARGEST_RATIO}"
            )
    below = lcm(*(ratio.denominator for ratio in ratios))
    numerators = [int(ratio * below) for ratio in ratios]
    common = gcd(*numerators)
    if max(numerators) > MOST_PERIODS * common:
        raise ValueError(
            f"their common period is longer than {MOST_PERIODS} times the shortest period"
        )
    return first * common / below


def waveform(name: str, first: Harmonic) -> tuple[Harmonic, ...]:
    """The harmonics of a periodic acceleration of `WAVEFORMS`, given its frequency, peak, direction and phase."""
    return tuple(
        first.with_values(
            frequency=multiple * first.frequency,
            peak_acceleration=abs(share) * first.peak_acceleration,
            phase=multiple * first.phase + (pi if share < 0.0 else 0.0),
        )
        for multiple, share in WAVEFORMS[name]
    )


def unit_vector(vector: Vector) -> Vector:
    """A direction of length one; raises `ValueError` if the vector is zero."""
    length = hypot(*vector)
    if not 1e-100 < length < 1e100:
        raise ValueError("expected a direction such as [1, 0, 1]")
    x, y, z = (component / length for component in vector)
    return (x, y, z)
