"""Calibration files: free parameters of a case, and the observations that weigh them.

`docs/how-to/calibrate.md` has an example and all keys.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationInfo, field_validator
from scipy.stats import truncnorm, uniform

from walkers.arrays import FloatArray
from walkers.calibration.observations import Names, Observation
from walkers.errors import InputError, Problem, suggestion
from walkers.inputs.config_table import ConfigTable, changed
from walkers.inputs.keys import Value, flatten
from walkers.inputs.messages import validated
from walkers.inputs.reading import find_input
from walkers.inputs.sweep import SweepDefinition, expand
from walkers.inputs.tables.case import CaseFile
from walkers.inputs.toml import read_toml
from walkers.inputs.units import Number, Whole


class Parameter(ConfigTable):
    """``[parameters.NAME]``: keys of the case that take the value in some experiments (default: all), and the prior.

    The prior is even over the ``range``, or over its logarithm (``log``), or the part of a ``normal`` distribution in
    it: mean and deviation; with ``log`` the median, and the deviation of the logarithm. Numbers have the ``unit``.
    """

    keys: Names
    log: bool = False
    range: tuple[Number, Number] = Field(examples=[[0.05, 0.5]])
    unit: str = ""
    experiments: Names | None = None
    symbol: str = ""
    normal: tuple[Number, Annotated[Number, Field(gt=0)]] | None = None

    @field_validator("range", "normal")
    @classmethod
    def _check(
        cls, value: tuple[float, float] | None, validation: ValidationInfo
    ) -> tuple[float, float] | None:
        low, high = value or (1.0, 2.0)
        if validation.field_name == "range" and low >= high:
            raise ValueError("expected a smaller and a larger number")
        if validation.data.get("log") and low <= 0.0:
            raise ValueError("expected numbers above zero: log is that of magnitudes")
        return value

    @property
    def label(self) -> str:
        """Symbol and unit, if it has them."""
        return f"{self.symbol}{f' ({self.unit})' if self.symbol and self.unit else ''}"

    @cached_property
    def _prior(self) -> Any:
        """The prior of the value, or of its logarithm (scipy)."""
        low, high = np.log(self.range) if self.log else self.range
        if self.normal is None:
            return uniform(low, high - low)
        middle, scale = np.log(self.normal[0]) if self.log else self.normal[0], self.normal[1]
        return truncnorm((low - middle) / scale, (high - middle) / scale, middle, scale)

    def written(self, value: float) -> Value:
        """A value as a case file has it."""
        return f"{value:.6g} {self.unit}" if self.unit else float(f"{value:.6g}")

    def values(self, unit: FloatArray) -> FloatArray:
        """The values below which these shares of the prior lie."""
        scaled = np.asarray(self._prior.ppf(unit))
        return np.exp(scaled) if self.log else scaled

    def unit_of(self, values: FloatArray | float) -> FloatArray:
        """The shares of the prior below these values."""
        return np.asarray(self._prior.cdf(np.log(values) if self.log else values))


class DesignTable(ConfigTable):
    """``[design]``: numbers of parameter sets for the emulators and of points for the posterior; groups to predict."""

    seed: Annotated[Whole, Field(ge=0)] = 1
    points: Annotated[Whole, Field(ge=4, le=10_000)] = 64
    posterior: Annotated[Whole, Field(ge=256, le=1 << 20)] = 1 << 16
    held_out: list[str] = Field([])


class CalibrationFile(ConfigTable):
    """A calibration file; ``published`` is what tables and figures call the observations, instead of measured."""

    title: str = ""
    published: bool = False
    case: str
    set: dict[str, Any] = Field({})
    parameters: Annotated[dict[str, Parameter], Field(min_length=1)]
    experiments: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    observations: Annotated[list[Observation], Field(min_length=1)]
    sets: dict[str, dict[str, Number]] = Field({})
    design: DesignTable = DesignTable()


@dataclass(frozen=True)
class Calibration:
    """A calibration file with its name, what messages call it, its folder, and all keys of its experiments."""

    name: str
    source: str
    folder: Path
    file: CalibrationFile
    experiments: Mapping[str, Mapping[str, Value]]

    def values(self, unit: FloatArray) -> FloatArray:
        """Values of the D parameters at points of the unit cube of the prior, shape (N, D)."""
        shares_of = zip(self.file.parameters.values(), unit.T, strict=True)
        return np.stack([parameter.values(shares) for parameter, shares in shares_of], axis=1)

    @cached_property
    def sets(self) -> FloatArray:
        """The named sets as points of the unit cube, shape (S, D)."""
        parameters, sets = self.file.parameters, self.file.sets.values()
        rows = [
            [parameter.unit_of(given[label]) for label, parameter in parameters.items()]
            for given in sets
        ]
        return np.reshape(np.array(rows, np.float64), (-1, len(parameters)))

    @property
    def costly(self) -> set[str]:
        """Experiments that only costly observations need."""
        cheap = [observation for observation in self.file.observations if not observation.costly]
        return set(self.experiments) - {label for fact in cheap for label in (*fact.of, *fact.over)}

    def sweep(
        self, name: str, values: FloatArray | None = None, experiments: Collection[str] = ()
    ) -> SweepDefinition:
        """The sweep of experiments (default: all), for every parameter set (N, D) or with the case's own values."""
        points = [
            {**self.experiments[label], **self._changes(label, row)}
            for row in ([None] if values is None else values)
            for label in experiments or self.experiments
        ]
        usual = {
            key: value for key, value in flatten(self.file.set).items() if key not in points[0]
        }
        columns = {key: [point[key] for point in points] for key in points[0]}
        document = {
            "title": self.file.title,
            "case": self.file.case,
            "set": usual,
            "zip": [columns],
        }
        sweep = expand(document, source=self.source, name=name, folder=self.folder)
        if "dimers" not in sweep.document:
            raise InputError(
                self.source, [Problem("case", f'"{self.file.case}"', "expected a case of dimers")]
            )
        return sweep

    def case(self, values: FloatArray) -> dict[str, Any]:
        """Tables of the case of the first experiment, with these values of the parameters (D,)."""
        sweep = self.sweep(self.name, values[None], [next(iter(self.experiments))])
        return changed(CaseFile, sweep.document, dict(zip(sweep.keys, sweep.rows[0], strict=True)))

    def _changes(self, label: str, row: FloatArray | None) -> dict[str, Value]:
        """Values of the keys of parameters in an experiment, for one parameter set (D,)."""
        changes: dict[str, Value] = {}
        for parameter, value in zip(
            self.file.parameters.values(), [] if row is None else row, strict=False
        ):
            if label in (parameter.experiments or [label]):
                changes |= dict.fromkeys(parameter.keys, parameter.written(value))
        return changes


def load_calibration(calibration: str | Path) -> Calibration:
    """Read a calibration file, or a shipped calibration such as ``ruby``; `InputError` if it cannot be used."""
    path = find_input(calibration, "calibration")
    return read_calibration(
        read_toml(path), source=str(calibration), name=path.stem, folder=path.parent
    )


def read_calibration(
    document: Mapping[str, Any], *, source: str, name: str, folder: Path
) -> Calibration:
    """A calibration given as nested tables; parameters and errors as for `walkers.inputs.sweep.expand`."""
    file = validated(CalibrationFile, document, source, "a calibration")
    changed_by = {label: flatten(table) for label, table in file.experiments.items()}
    varied = dict.fromkeys(key for keys in changed_by.values() for key in keys)
    usual = {key: value for key, value in flatten(file.set).items() if key in varied}
    if problems := [
        *_unknown_names(file),
        *_contradictions(file),
        *_problems_of_keys(file, {*varied} - {*usual}),
    ]:
        raise InputError(source, problems)
    return Calibration(
        name, source, folder, file, {label: usual | keys for label, keys in changed_by.items()}
    )


def _unknown_names(file: CalibrationFile) -> Iterator[Problem]:
    """References to names that the file does not define."""
    named: list[tuple[str, Collection[str], Collection[str], str]] = [
        (
            f"parameters.{label}.experiments",
            parameter.experiments or [],
            file.experiments,
            "an experiment",
        )
        for label, parameter in file.parameters.items()
    ]
    for number, observation in enumerate(file.observations):
        for key, labels in (("of", observation.of), ("over", observation.over)):
            named.append(
                (f"observations[{number}].{key}", labels, file.experiments, "an experiment")
            )
    named += [
        (f"sets.{label}", given, file.parameters, "a parameter")
        for label, given in file.sets.items()
    ]
    groups = {observation.group for observation in file.observations}
    for place, given, names, kind in (
        *named,
        ("design.held_out", file.design.held_out, groups, "a group"),
    ):
        for name in given:
            if name not in names:
                expected = (
                    f"expected {kind}: one of {', '.join(sorted(names))}{suggestion(name, names)}"
                )
                yield Problem(place, f'"{name}"', expected)


def _contradictions(file: CalibrationFile) -> Iterator[Problem]:
    names = [observation.name for observation in file.observations]
    for number, observation in enumerate(file.observations):
        place, limits = f"observations[{number}]", [observation.least, observation.most]
        if names.index(observation.name) != number:
            yield Problem(f"{place}.name", f'"{observation.name}"', "expected a name of its own")
        if observation.over and set(observation.over) == set(observation.of):
            yield Problem(
                f"{place}.over", None, "expected other experiments than in of: the ratio would be 1"
            )
        if (observation.value is None) == (limits == [None, None]) or observation.limits[
            0
        ] > observation.limits[1]:
            yield Problem(
                place, None, "expected either a value or limits: least, most, or both in this order"
            )
    if not any(
        observation.weighed and observation.group not in file.design.held_out
        for observation in file.observations
    ):
        yield Problem(
            "observations", None, "expected one that is neither derived, costly nor held out"
        )
    for label, given in file.sets.items():
        for name, parameter in file.parameters.items():
            value, (low, high) = given.get(name), parameter.range
            if value is None or not low <= value <= high:
                expected = f"expected a number in the range of the parameter, {low:g} to {high:g}"
                yield Problem(
                    f"sets.{label}.{name}", None if value is None else f"{value:g}", expected
                )


def _problems_of_keys(file: CalibrationFile, varied: Collection[str]) -> Iterator[Problem]:
    """All experiments have the same keys: of the ``varied`` ones, and of the parameters, each of one parameter."""
    every = dict.fromkeys(key for parameter in file.parameters.values() for key in parameter.keys)
    for label, table in file.experiments.items():
        for key in sorted({*varied} - {*flatten(table)}):
            expected = "missing; expected it here or in [set]: other experiments change it"
            yield Problem(f"experiments.{label}.{key}", None, expected)
        given = [
            parameter.keys
            for parameter in file.parameters.values()
            if label in (parameter.experiments or [label])
        ]
        for key, number in ((key, sum(key in keys for keys in given)) for key in every):
            if number != 1:
                expected = f"expected one parameter that sets {key} for {label}, or none for any experiment; {number} do"
                yield Problem("parameters", None, expected)
