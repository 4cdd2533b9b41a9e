"""Calibration files: which parameters of a case are free, and which published numbers they are to give.

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

from pydantic import BaseModel, ConfigDict, Field

from walkers.inputs.axes import flatten
from walkers.inputs.changes import Value
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.library import suggestion
from walkers.inputs.messages import validated
from walkers.inputs.reading import check_kind, find_input, read_toml
from walkers.inputs.schema import Number, Whole
from walkers.inputs.units import ANGLE, SPEED, Kind, parse_quantity

_MOST = 10_000
Speed = Literal["velocity", "rotation_1", "rotation_2", "sliding_1", "sliding_2", "sliding_3"]
"""A column of a sweep's table that is a speed."""
QUANTITIES: dict[str, Kind] = {
    **dict.fromkeys(get_args(Speed), SPEED),
    "misalignment": ANGLE,
}
"""What an observation may be of: a column of a sweep's table, or the largest angle of a walker to the drive axis."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ParameterTable(_Table):
    """``[parameters.NAME]``: keys of the case that take its value, its range, and what is assumed beforehand.

    Numbers are in its ``unit``, if it has one.
    """

    keys: Annotated[list[str], Field(min_length=1)]
    range: tuple[Number, Number]
    unit: str = ""
    log: bool = False
    experiments: list[str] | None = None
    symbol: str = ""
    normal: tuple[Number, Annotated[Number, Field(gt=0)]] | None = None


class ObservationTable(_Table):
    """``[[observations]]``: a mean over experiments, or its ratio to the mean over others.

    One that is ``derived`` follows from others: it is told of, but does not weigh in the posterior a second time.
    """

    name: str
    group: str
    title: str = ""
    quantity: Literal[Speed, "misalignment"] = "velocity"
    of: Annotated[list[str], Field(min_length=1)]
    over: list[str] = []
    value: str | Number
    deviation: str | Number
    derived: bool = False


class SharedError(_Table):
    """``[shared_errors.NAME]``: observations whose published values are wrong together, and by how much of the whole.

    ``share`` of the variance of each is shared: so large is the correlation of any two of them.
    """

    observations: Annotated[list[str], Field(min_length=2)]
    share: Annotated[Number, Field(gt=0, lt=1)]


class Band(_Table):
    """``[[bands]]``: a picture of a quantity of some experiments against a column of their sweep's table."""

    title: str = ""
    of: Annotated[list[str], Field(min_length=1)]
    against: Literal["peak_acceleration", "gamma0", "frequency", "sin_delta"]
    quantity: Speed = "velocity"


class DesignTable(_Table):
    """``[design]``: sizes of the waves and of the predictive check, and how many points of the prior are weighed."""

    seed: Annotated[Whole, Field(ge=0)] = 1
    waves: Annotated[list[Annotated[Whole, Field(ge=4, le=_MOST)]], Field(min_length=1)] = [64]
    predictive: Annotated[Whole, Field(ge=2, le=1000)] = 8
    points: Annotated[Whole, Field(ge=100, le=1_000_000)] = 20_000


class CalibrationFile(_Table):
    """A calibration file."""

    title: str = ""
    case: str
    set: dict[str, Any] = {}
    parameters: Annotated[dict[str, ParameterTable], Field(min_length=1)]
    experiments: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    observations: Annotated[list[ObservationTable], Field(min_length=1)]
    shared_errors: dict[str, SharedError] = {}
    guesses: list[dict[str, Number]] = []
    bands: list[Band] = []
    held_out: dict[str, list[str]] = {}
    design: DesignTable = DesignTable()


class Parameter(ParameterTable):
    """A free parameter: its table, its name, and the experiments that it belongs to."""

    name: str
    experiments: list[str]


class Observation(ObservationTable):
    """A published number: its table, value and deviation in SI units, angles in degrees."""

    value: Number
    deviation: Number


@dataclass(frozen=True)
class Calibration:
    """A calibration, read.

    Attributes
    ----------
    name, source, folder
        Of the file.
    file
        What it says.
    parameters, observations
        What is free and what it is to give.
    experiments
        Values of the same keys for each.
    guesses
        Sets that the first wave has beside those that fill the ranges: values in the order of the parameters.
    """

    name: str
    source: str
    folder: Path
    file: CalibrationFile
    parameters: tuple[Parameter, ...]
    observations: tuple[Observation, ...]
    experiments: Mapping[str, Mapping[str, Value]]
    guesses: tuple[tuple[float, ...], ...]

    @property
    def design(self) -> DesignTable:
        """Sizes of the waves and of the posterior."""
        return self.file.design


def load_calibration(calibration: str | Path) -> Calibration:
    """Read a calibration file, or a shipped calibration such as ``ruby``.

    Raises
    ------
    InputError
        If there is no such file or anything in it cannot be used.
    """
    check_kind(calibration, "calibration")
    path = find_input(calibration, "calibration")
    return read_calibration(read_toml(path), source=str(calibration), name=path.stem, folder=path.parent)


def read_calibration(document: Mapping[str, Any], *, source: str, name: str, folder: Path) -> Calibration:
    """A calibration given as nested tables; parameters and errors as for `walkers.inputs.sweep.expand`."""
    file = validated(CalibrationFile, document, source, "a calibration")
    if problems := list(_problems(file)):
        raise InputError(source, problems)
    return Calibration(
        name=name,
        source=source,
        folder=folder,
        file=file,
        parameters=tuple(
            Parameter(
                **{**vars(table), "symbol": table.symbol or label, "experiments": _experiments(file, table)}, name=label
            )
            for label, table in file.parameters.items()
        ),
        observations=tuple(map(_observation, file.observations)),
        experiments={label: flatten(table, lambda _: False) for label, table in file.experiments.items()},
        guesses=tuple(tuple(guess[label] for label in file.parameters) for guess in file.guesses),
    )


def _observation(table: ObservationTable) -> Observation:
    value, deviation = (_number(one, table.quantity) for one in (table.value, table.deviation))
    named = {"title": table.title or table.name, "value": value, "deviation": deviation}
    return Observation(**{**vars(table), **named})


def _number(value: str | float, quantity: str) -> float:
    if not isinstance(value, str):
        return float(value)
    number = parse_quantity(value, QUANTITIES[quantity])
    return degrees(number) if QUANTITIES[quantity] is ANGLE else number


def _experiments(file: CalibrationFile, table: ParameterTable) -> list[str]:
    """Those that a parameter belongs to."""
    return list(file.experiments) if table.experiments is None else table.experiments


def _problems(file: CalibrationFile) -> Iterator[Problem]:
    """What pydantic cannot see."""
    yield from _problems_of_experiments(file)
    for name, table in file.parameters.items():
        yield from _problems_of_parameter(file, name, table)
    names = [observation.name for observation in file.observations]
    for number, observation in enumerate(file.observations):
        place = f"observations[{number}]"
        if names.index(observation.name) != number:
            yield Problem(f"{place}.name", f'"{observation.name}"', "expected a name of its own")
        for key in ("of", "over"):
            yield from _unknown(f"{place}.{key}", getattr(observation, key), file.experiments, "an experiment")
        if observation.over and set(observation.over) == set(observation.of):
            yield Problem(f"{place}.over", None, "expected other experiments than in of: the ratio would be 1")
        for key in ("value", "deviation"):
            yield from _unreadable(f"{place}.{key}", getattr(observation, key), observation)
    if all(observation.derived for observation in file.observations):
        yield Problem("observations", None, "expected one that is not derived")
    yield from _problems_of_shared_errors(file, names)
    for number, guess in enumerate(file.guesses):
        yield from _problems_of_guess(file, f"guesses[{number}]", guess)
    for number, band in enumerate(file.bands):
        yield from _unknown(f"bands[{number}].of", band.of, file.experiments, "an experiment")
    groups = {observation.group for observation in file.observations}
    for name, held in file.held_out.items():
        yield from _unknown(f"held_out.{name}", held, groups, "a group of observations")
        if set(held) >= {observation.group for observation in file.observations if not observation.derived}:
            yield Problem(f"held_out.{name}", None, "expected to leave a group to calibrate on")


def _problems_of_experiments(file: CalibrationFile) -> Iterator[Problem]:
    """All experiments have the same keys, each of a parameter too, and of one parameter alone."""
    first, *others = [(label, set(flatten(table, lambda _: False))) for label, table in file.experiments.items()]
    for label, keys in others:
        for key in sorted(keys ^ first[1]):
            told = f"expected the same keys in every experiment; {first[0]} and {label} differ in {key}"
            yield Problem(f"experiments.{label}", None, told)
    taken: dict[str, dict[str, str]] = {}
    for name, table in file.parameters.items():
        for key in table.keys:
            for experiment in _experiments(file, table):
                other = taken.setdefault(key, {}).setdefault(experiment, name)
                if other != name:
                    told = f"{key} of the experiment {experiment} is set by {other} already"
                    yield Problem(f"parameters.{name}.keys", None, told)
    for key, having in taken.items():
        if lacking := [experiment for experiment in file.experiments if experiment not in having]:
            told = f"no parameter gives {key} to {', '.join(lacking)}: all experiments have it or none"
            yield Problem("parameters", None, told)


def _problems_of_parameter(file: CalibrationFile, name: str, table: ParameterTable) -> Iterator[Problem]:
    place, (low, high) = f"parameters.{name}", table.range
    if low >= high or (table.log and low <= 0.0):
        expected = "expected a smaller and a larger number" + (", both above zero" if table.log else "")
        yield Problem(f"{place}.range", f"[{low:g}, {high:g}]", expected)
    if table.normal is not None and table.log and table.normal[0] <= 0.0:
        expected = "expected a median above zero: the prior is one of the logarithm"
        yield Problem(f"{place}.normal", f"[{table.normal[0]:g}, {table.normal[1]:g}]", expected)
    if table.experiments is not None and not table.experiments:
        yield Problem(f"{place}.experiments", "[]", "expected at least one experiment")
    yield from _unknown(f"{place}.experiments", _experiments(file, table), file.experiments, "an experiment")


def _problems_of_shared_errors(file: CalibrationFile, names: list[str]) -> Iterator[Problem]:
    for label, error in file.shared_errors.items():
        place = f"shared_errors.{label}.observations"
        yield from _unknown(place, error.observations, names, "an observation")
        for name in dict.fromkeys(error.observations):
            if error.observations.count(name) > 1:
                yield Problem(place, f'"{name}"', "expected each observation once")
    for name in names:
        having = [label for label, error in file.shared_errors.items() if name in error.observations]
        whole = sum(file.shared_errors[label].share for label in having)
        if whole >= 1.0:
            told = f"expected {name} to have an error of its own: the shares of {', '.join(having)} are {whole:g} of it"
            yield Problem("shared_errors", None, told)


def _problems_of_guess(file: CalibrationFile, place: str, guess: Mapping[str, float]) -> Iterator[Problem]:
    yield from (one for name in guess for one in _unknown(f"{place}.{name}", [name], file.parameters, "a parameter"))
    for name, table in file.parameters.items():
        low, high = table.range
        if name not in guess:
            yield Problem(f"{place}.{name}", None, "missing; a guess has all parameters")
        elif not low <= guess[name] <= high:
            told = f"expected a number within the parameter's range, {low:g} to {high:g}"
            yield Problem(f"{place}.{name}", f"{guess[name]:g}", told)


def _unknown(place: str, given: Collection[str], known: Collection[str], what: str) -> Iterator[Problem]:
    for name in given:
        if name not in known:
            expected = f"expected {what}: one of {', '.join(sorted(known))}{suggestion(name, known)}"
            yield Problem(place, f'"{name}"', expected)


def _unreadable(place: str, given: str | float, observation: ObservationTable) -> Iterator[Problem]:
    kind, wrong = QUANTITIES[observation.quantity], ""
    if observation.over:
        wrong = "expected a plain number: a ratio has no unit" if isinstance(given, str) else ""
    elif not isinstance(given, str):
        wrong = kind.expectation
    else:
        try:
            parse_quantity(given, kind)
        except ValueError as error:
            wrong = str(error)
    if not wrong and place.endswith("deviation") and _number(given, observation.quantity) <= 0.0:
        wrong = "expected more than zero"
    if wrong:
        yield Problem(place, f'"{given}"' if isinstance(given, str) else f"{given:g}", wrong)
