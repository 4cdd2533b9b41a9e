"""Calibration files: free parameters of a case, and the published numbers to reproduce.

case = "fig1b"

[parameters.friction]
keys  = ["contact.friction.bead_wall"]
range = [0.05, 0.5]
log   = true

[experiments.slow]
drive.peak_acceleration = "4 g"

[[observations]]
name      = "v_4g"
group     = "fig2"
of        = ["slow"]
value     = "1.23 mm/s"
deviation = "0.18 mm/s"
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, ValidationInfo, field_validator

from walkers.errors import InputError, Problem, suggestion
from walkers.inputs.keys import Value, flatten
from walkers.inputs.messages import validated
from walkers.inputs.reading import find_input
from walkers.inputs.table import Table
from walkers.inputs.toml import read_toml
from walkers.inputs.units import ANGLE, SPEED, WRITTEN, Kind, Number, Whole, parse_quantity

_MOST = 10_000
Speed = Literal["velocity", "rotation_1", "rotation_2", "sliding_1", "sliding_2", "sliding_pair_1"]
"""A column of a sweep's table that is a speed."""
QUANTITIES: dict[str, Kind] = {**dict.fromkeys(get_args(Speed), SPEED), "misalignment": ANGLE}
"""Quantities of observations: columns of the table of a sweep, or the largest angle to the drive axis."""
Names = Annotated[list[str], Field(min_length=1)]


class ParameterTable(Table):
    """``[parameters.NAME]``: keys of the case that take the value, range, and prior.

    Numbers are in its ``unit``, if it has one; those of a ``log`` range, and its median, are above zero.
    """

    keys: Names
    log: bool = False
    range: tuple[Number, Number]
    unit: str = ""
    experiments: Names | None = None
    symbol: str = ""
    normal: tuple[Number, Annotated[Number, Field(gt=0)]] | None = None

    @field_validator("range", "normal")
    @classmethod
    def _check(cls, value: tuple[float, float] | None, info: ValidationInfo) -> tuple[float, float] | None:
        low, high = value or (1.0, 2.0)
        if info.field_name == "range" and low >= high:
            raise ValueError("expected a smaller and a larger number")
        if info.data.get("log") and low <= 0.0:
            raise ValueError("expected numbers above zero: log is that of magnitudes")
        return value


class Parameter(ParameterTable):
    """A free parameter: its table, its name, and the experiments that it belongs to."""

    name: str
    experiments: list[str]


class Observation(Table):
    """``[[observations]]``: a mean over experiments, or its ratio to the mean over others.

    A ``derived`` observation follows from others: it is reported, but has no weight in the posterior.
    ``value`` and ``deviation`` are in SI units, angles in degrees; a file has them with their unit, but of a ratio.
    """

    name: str
    group: str
    title: str = Field(default_factory=lambda given: str(given.get("name", "")))
    quantity: Literal[Speed, "misalignment"] = "velocity"
    of: Names
    over: list[str] = Field([])
    value: Number
    deviation: Annotated[Number, Field(gt=0)]
    derived: bool = False

    @field_validator("value", "deviation", mode="before")
    @classmethod
    def _number(cls, value: Any, info: ValidationInfo) -> Any:
        if info.context != WRITTEN:
            return value
        if info.data.get("over"):
            if isinstance(value, str):
                raise ValueError("expected a plain number: a ratio has no unit")
            return value
        kind = QUANTITIES[info.data.get("quantity", "velocity")]
        if not isinstance(value, str):
            raise ValueError(kind.expectation)
        number = parse_quantity(value, kind)
        return degrees(number) if kind is ANGLE else number


class SharedError(Table):
    """``[shared_errors.NAME]``: observations with correlated errors, and the shared part of the variance.

    ``share`` of the variance of each is shared: so large is the correlation of any two of them.
    """

    observations: Annotated[list[str], Field(min_length=2)]
    share: Annotated[Number, Field(gt=0, lt=1)]


class DesignTable(Table):
    """``[design]``: sizes of the waves and of the predictive check, and how many points of the prior are weighed."""

    seed: Annotated[Whole, Field(ge=0)] = 1
    waves: Annotated[list[Annotated[Whole, Field(ge=4, le=_MOST)]], Field(min_length=1)] = Field([64])
    predictive: Annotated[Whole, Field(ge=2, le=1000)] = 8
    points: Annotated[Whole, Field(ge=100, le=1_000_000)] = 20_000


class CalibrationFile(Table):
    """A calibration file; ``published`` is what tables and figures call the observations, instead of measured."""

    title: str = ""
    published: bool = False
    case: str
    set: dict[str, Any] = Field({})
    parameters: Annotated[dict[str, ParameterTable], Field(min_length=1)]
    experiments: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    observations: Annotated[list[Observation], Field(min_length=1)]
    shared_errors: dict[str, SharedError] = Field({})
    guesses: list[dict[str, Number]] = Field([])
    held_out: dict[str, list[str]] = Field({})
    design: DesignTable = DesignTable()


@dataclass(frozen=True)
class Calibration:
    """A calibration, read from its file.

    Attributes
    ----------
    name, source, folder
        Of the file.
    file
        What it says.
    parameters
        What is free, with the experiments that each belongs to.
    experiments
        Values of the same keys for each.
    """

    name: str
    source: str
    folder: Path
    file: CalibrationFile
    parameters: tuple[Parameter, ...]
    experiments: Mapping[str, Mapping[str, Value]]

    @property
    def observations(self) -> tuple[Observation, ...]:
        """The observations to reproduce."""
        return tuple(self.file.observations)

    @property
    def guesses(self) -> tuple[tuple[float, ...], ...]:
        """Sets that the first wave has beside those that fill the ranges: values in the order of the parameters."""
        return tuple(tuple(guess[label] for label in self.file.parameters) for guess in self.file.guesses)

    @property
    def design(self) -> DesignTable:
        """Sizes of the waves and of the posterior."""
        return self.file.design


def load_calibration(calibration: str | Path) -> Calibration:
    """Read a calibration file, or a shipped calibration such as ``ruby``.

    Raises `InputError` if there is no such file or anything in it cannot be used.
    """
    path = find_input(calibration, "calibration")
    return read_calibration(read_toml(path), source=str(calibration), name=path.stem, folder=path.parent)


def read_calibration(document: Mapping[str, Any], *, source: str, name: str, folder: Path) -> Calibration:
    """A calibration given as nested tables; parameters and errors as for `walkers.inputs.sweep.expand`."""
    file = validated(CalibrationFile, document, source, "a calibration")
    problems = [*_unknown_names(file), *_contradictions(file), *_problems_of_guesses(file), *_problems_of_keys(file)]
    if problems:
        raise InputError(source, problems)
    parameters = []
    for label, table in file.parameters.items():
        filled = {"symbol": table.symbol or label, "experiments": table.experiments or list(file.experiments)}
        parameters.append(Parameter(**{**vars(table), **filled}, name=label))
    return Calibration(
        name=name,
        source=source,
        folder=folder,
        file=file,
        parameters=tuple(parameters),
        experiments={label: flatten(table) for label, table in file.experiments.items()},
    )


def _unknown_names(file: CalibrationFile) -> Iterator[Problem]:
    """References to names that the file does not define."""
    observations, groups = ([getattr(one, key) for one in file.observations] for key in ("name", "group"))
    named: list[tuple[str, Collection[str], Collection[str], str]] = []
    for label, parameter in file.parameters.items():
        place = f"parameters.{label}.experiments"
        named.append((place, parameter.experiments or file.experiments, file.experiments, "an experiment"))
    for number, one in enumerate(file.observations):
        place = f"observations[{number}]"
        named.append((f"{place}.of", one.of, file.experiments, "an experiment"))
        named.append((f"{place}.over", one.over, file.experiments, "an experiment"))
    for label, error in file.shared_errors.items():
        named.append((f"shared_errors.{label}.observations", error.observations, observations, "an observation"))
    for number, guess in enumerate(file.guesses):
        named += [(f"guesses[{number}].{label}", [label], file.parameters, "a parameter") for label in guess]
    for label, held in file.held_out.items():
        named.append((f"held_out.{label}", held, groups, "a group of observations"))
    for place, given, known, what in named:
        for name in given:
            if name not in known:
                expected = f"expected {what}: one of {', '.join(sorted(set(known)))}{suggestion(name, known)}"
                yield Problem(place, f'"{name}"', expected)


def _contradictions(file: CalibrationFile) -> Iterator[Problem]:
    names = [one.name for one in file.observations]
    for number, one in enumerate(file.observations):
        if names.index(one.name) != number:
            yield Problem(f"observations[{number}].name", f'"{one.name}"', "expected a name of its own")
        if one.over and set(one.over) == set(one.of):
            text = "expected other experiments than in of: the ratio would be 1"
            yield Problem(f"observations[{number}].over", None, text)
    if all(one.derived for one in file.observations):
        yield Problem("observations", None, "expected one that is not derived")
    for label, error in file.shared_errors.items():
        for name in sorted({name for name in error.observations if error.observations.count(name) > 1}):
            yield Problem(f"shared_errors.{label}.observations", f'"{name}"', "expected each observation once")
    for name in names:
        having = {label: error.share for label, error in file.shared_errors.items() if name in error.observations}
        if (whole := sum(having.values())) >= 1.0:
            text = f"expected {name} to have an error of its own: the shares of {', '.join(having)} are {whole:g} of it"
            yield Problem("shared_errors", None, text)
    weighed = {one.group for one in file.observations if not one.derived}
    for label, held in file.held_out.items():
        if set(held) >= weighed:
            yield Problem(f"held_out.{label}", None, "expected to leave a group to calibrate on")


def _problems_of_guesses(file: CalibrationFile) -> Iterator[Problem]:
    """A guess has all parameters, each within its range."""
    for number, guess in enumerate(file.guesses):
        for label, table in file.parameters.items():
            place, (low, high) = f"guesses[{number}].{label}", table.range
            if label not in guess:
                yield Problem(place, None, "missing; a guess has all parameters")
            elif not low <= guess[label] <= high:
                text = f"expected a number within the parameter's range, {low:g} to {high:g}"
                yield Problem(place, f"{guess[label]:g}", text)


def _problems_of_keys(file: CalibrationFile) -> Iterator[Problem]:
    """All experiments have the same keys, each of a parameter too, and of one parameter alone."""
    first, *others = [(label, set(flatten(table))) for label, table in file.experiments.items()]
    for label, keys in others:
        for key in sorted(keys ^ first[1]):
            text = f"expected the same keys in every experiment; {first[0]} and {label} differ in {key}"
            yield Problem(f"experiments.{label}", None, text)
    taken: dict[str, dict[str, str]] = {}
    for name, table in file.parameters.items():
        for key in table.keys:
            for experiment in table.experiments or file.experiments:
                other = taken.setdefault(key, {}).setdefault(experiment, name)
                if other != name:
                    text = f"{key} of the experiment {experiment} is set by {other} already"
                    yield Problem(f"parameters.{name}.keys", None, text)
    for key, having in taken.items():
        if lacking := [experiment for experiment in file.experiments if experiment not in having]:
            text = f"no parameter sets {key} for {', '.join(lacking)}: expected it for all experiments or none"
            yield Problem("parameters", None, text)
