"""Calibration files: free parameters of a case, and the observations that weigh them.

`docs/how-to/calibrate.md` has an example and all keys. `walkers.calibration.calibrate` runs a
calibration.
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
    """``[parameters.NAME]``: a free parameter and its prior.

    Attributes
    ----------
    keys
        Keys of the case that take the value of the parameter.
    log
        Whether the prior is that of the logarithm of the value.
    range
        Smallest and largest value, in ``unit``. The prior is even over this range unless ``normal``
        is given.
    unit
        Unit of the values, as in case files; empty for plain numbers.
    experiments
        Names of the experiments in which the keys take the value; None: all.
    symbol
        Symbol in tables.
    normal
        Mean and standard deviation of a normal prior, which is cut off at the ends of the range.
        With ``log``, the median of the value and the standard deviation of its logarithm. None:
        even.
    """

    keys: Names
    log: bool = False  # before `range` and `normal`, whose check needs it
    range: tuple[Number, Number] = Field(examples=[[0.05, 0.5]])
    unit: str = ""
    experiments: Names | None = None
    symbol: str = ""
    normal: tuple[Number, Annotated[Number, Field(gt=0)]] | None = None

    @field_validator("range", "normal")
    @classmethod
    def _check_range_and_normal(
        cls, value: tuple[float, float] | None, validation: ValidationInfo
    ) -> tuple[float, float] | None:
        """Refuse a range that is not in order, and numbers that have no logarithm.

        With ``log``, the smallest value of a range, or the median of a normal prior, must be above
        zero. The type of ``normal`` ensures that its standard deviation is.
        """
        if value is None:
            return None
        first, second = value
        if validation.field_name == "range" and first >= second:
            raise ValueError("expected a smaller and a larger number")
        if validation.data.get("log") and first <= 0.0:
            raise ValueError("expected numbers above zero, because log = true")
        return value

    @property
    def label(self) -> str:
        """Symbol and unit; empty without a symbol."""
        if self.symbol and self.unit:
            return f"{self.symbol} ({self.unit})"
        return self.symbol

    def acts_in(self, experiment: str) -> bool:
        """Whether the keys take the value of the parameter in an experiment."""
        return self.experiments is None or experiment in self.experiments

    def written(self, value: float) -> Value:
        """A value of the parameter as a case file has it, with its unit and six digits."""
        digits = f"{value:.6g}"
        if self.unit:
            return f"{digits} {self.unit}"
        return float(digits)

    def values(self, shares: FloatArray) -> FloatArray:
        """The values, in ``unit``, below which these shares of the prior lie."""
        scaled = np.asarray(self._prior.ppf(shares))
        return np.exp(scaled) if self.log else scaled

    def shares(self, values: FloatArray | float) -> FloatArray:
        """The shares of the prior, 0 to 1, that lie below these values, which are in ``unit``."""
        return np.asarray(self._prior.cdf(np.log(values) if self.log else values))

    @cached_property
    def _prior(self) -> Any:
        """The prior of the value, or with ``log`` of its logarithm: a distribution of scipy."""
        low, high = np.log(self.range) if self.log else self.range
        if self.normal is None:
            return uniform(low, high - low)
        centre, deviation = self.normal
        if self.log:
            centre = np.log(centre)
        return truncnorm((low - centre) / deviation, (high - centre) / deviation, centre, deviation)


class DesignTable(ConfigTable):
    """``[design]``: how a calibration is computed.

    Attributes
    ----------
    seed
        Seed of the parameter sets, of the emulators and of the posterior.
    points
        Number of parameter sets to which emulators are fitted, besides those of the file.
    posterior
        Number of points of the posterior.
    held_out
        Groups of observations that are predicted from the others.
    """

    seed: Annotated[Whole, Field(ge=0)] = 1
    points: Annotated[Whole, Field(ge=4, le=10_000)] = 64
    posterior: Annotated[Whole, Field(ge=256, le=1 << 20)] = 1 << 16
    held_out: list[str] = Field([])


class CalibrationFile(ConfigTable):
    """A calibration file.

    Attributes
    ----------
    title
        Title of the calibration.
    published
        Whether tables and figures call the observations published, instead of measured.
    case
        The base case: a file, or the name of a shipped case.
    set
        Changes of the case in all experiments.
    parameters
        Free parameters by name.
    experiments
        Changes of the case in each experiment, by the name of the experiment.
    observations
        Facts that weigh the parameters.
    sets
        Values of all parameters, by the name of the set.
    design
        How the calibration is computed.
    """

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
    """A calibration file with what belongs to it.

    Attributes
    ----------
    name
        Name of the calibration: that of its file.
    source
        What messages call the file.
    folder
        Folder of the file, to which the names of other files are relative.
    file
        The file.
    experiments
        Values of all keys that differ between experiments, by the names of the experiments.
    """

    name: str
    source: str
    folder: Path
    file: CalibrationFile
    experiments: Mapping[str, Mapping[str, Value]]

    def values(self, points: FloatArray) -> FloatArray:
        """Values of the D parameters at points of the unit cube of the prior.

        Parameters
        ----------
        points : ndarray, shape (N, D)
            Shares of the prior of each parameter, 0 to 1.

        Returns
        -------
        ndarray, shape (N, D)
            Values in the units of the parameters.
        """
        columns = []
        for parameter, shares in zip(self.file.parameters.values(), points.T, strict=True):
            columns.append(parameter.values(shares))
        return np.stack(columns, axis=1)

    @cached_property
    def sets(self) -> FloatArray:
        """The named sets of the file as points of the unit cube of the prior, shape (S, D)."""
        parameters = self.file.parameters
        points = np.empty((len(self.file.sets), len(parameters)))
        for row, values in enumerate(self.file.sets.values()):
            for column, (name, parameter) in enumerate(parameters.items()):
                points[row, column] = parameter.shares(values[name])
        return points

    @property
    def costly(self) -> set[str]:
        """Experiments that only costly observations need."""
        costly = set(self.experiments)
        for observation in self.file.observations:
            if not observation.costly:
                costly.difference_update(observation.of, observation.over)
        return costly

    def sweep(
        self, name: str, values: FloatArray | None = None, experiments: Collection[str] = ()
    ) -> SweepDefinition:
        """The sweep of parameter sets and experiments; experiments vary fastest.

        Parameters
        ----------
        name
            Name of the sweep.
        values : ndarray, shape (N, D), optional
            Parameter sets, in the units of the parameters. None: one set, with the values of the
            case.
        experiments
            Names of the experiments; empty: all.

        Raises
        ------
        InputError
            If the sweep cannot be made, or its case has no dimers.
        """
        chosen = experiments or self.experiments
        points: list[Mapping[str, Value]] = []
        if values is None:
            points = [self.experiments[experiment] for experiment in chosen]
        else:
            for row in values:
                points += [
                    {**self.experiments[experiment], **self._changes(experiment, row)}
                    for experiment in chosen
                ]
        for_all_points = flatten(self.file.set)
        columns = {}
        # All points have the same keys (`_problems_of_keys` refuses others). Their values already
        # contain those of [set], so a key that varies between points must not be set a second time.
        for key in points[0]:
            columns[key] = [point[key] for point in points]
            for_all_points.pop(key, None)
        document = {
            "title": self.file.title,
            "case": self.file.case,
            "set": for_all_points,
            "zip": [columns],
        }
        sweep = expand(document, source=self.source, name=name, folder=self.folder)
        if "dimers" not in sweep.document:
            problem = Problem("case", f'"{self.file.case}"', "expected a case of dimers")
            raise InputError(self.source, [problem])
        return sweep

    def case(self, values: FloatArray) -> dict[str, Any]:
        """Tables of the case of the first experiment.

        Parameters
        ----------
        values : ndarray, shape (D,)
            Values of the parameters, in their units.
        """
        first = next(iter(self.experiments))
        sweep = self.sweep(self.name, values[None], [first])
        changes = dict(zip(sweep.keys, sweep.rows[0], strict=True))
        return changed(CaseFile, sweep.document, changes)

    def _changes(self, experiment: str, values: FloatArray) -> dict[str, Value]:
        """Values of the keys of parameters in an experiment; ``values`` as for `case`."""
        changes: dict[str, Value] = {}
        for parameter, value in zip(self.file.parameters.values(), values, strict=True):
            if parameter.acts_in(experiment):
                changes |= dict.fromkeys(parameter.keys, parameter.written(value))
        return changes


def load_calibration(calibration: str | Path) -> Calibration:
    """Read a calibration file, or a shipped calibration such as ``ruby``.

    Raises
    ------
    InputError
        If there is no such file, or it cannot be used.
    """
    path = find_input(calibration, "calibration")
    document = read_toml(path)
    return read_calibration(document, source=str(calibration), name=path.stem, folder=path.parent)


def read_calibration(
    document: Mapping[str, Any], *, source: str, name: str, folder: Path
) -> Calibration:
    """A calibration from the tables of its file.

    Parameters
    ----------
    document
        The tables.
    source
        What messages call the file.
    name
        Name of the calibration.
    folder
        Folder to which the names of other files are relative.

    Raises
    ------
    InputError
        If the tables cannot be used; it has all problems.
    """
    file = validated(CalibrationFile, document, source, "a calibration")
    changes = {experiment: flatten(table) for experiment, table in file.experiments.items()}
    varied: dict[str, None] = {}
    for values in changes.values():
        varied |= dict.fromkeys(values)
    for_all = {key: value for key, value in flatten(file.set).items() if key in varied}
    required = varied.keys() - for_all.keys()
    problems = [
        *_unknown_names(file),
        *_problems_of_observations(file),
        *_problems_of_sets(file),
        *_problems_of_keys(file, required),
    ]
    if problems:
        raise InputError(source, problems)
    experiments = {experiment: {**for_all, **values} for experiment, values in changes.items()}
    return Calibration(name, source, folder, file, experiments)


def _unknown_names(file: CalibrationFile) -> Iterator[Problem]:
    """References to names that the file does not define."""
    experiments = file.experiments
    for name, parameter in file.parameters.items():
        place = f"parameters.{name}.experiments"
        yield from _not_in(experiments, parameter.experiments or [], place, "an experiment")
    for number, observation in enumerate(file.observations):
        place = f"observations[{number}]"
        yield from _not_in(experiments, observation.of, f"{place}.of", "an experiment")
        yield from _not_in(experiments, observation.over, f"{place}.over", "an experiment")
    for name, values in file.sets.items():
        yield from _not_in(file.parameters, values, f"sets.{name}", "a parameter")
    groups = {observation.group for observation in file.observations}
    yield from _not_in(groups, file.design.held_out, "design.held_out", "a group")


def _not_in(
    defined: Collection[str], names: Collection[str], place: str, kind: str
) -> Iterator[Problem]:
    """A problem for each name at a place of the file that the file does not define.

    ``kind`` says what the names should be, such as ``a parameter``.
    """
    for name in names:
        if name not in defined:
            defined_names = ", ".join(sorted(defined))
            expected = f"expected {kind}: one of {defined_names}{suggestion(name, defined)}"
            yield Problem(place, f'"{name}"', expected)


def _problems_of_observations(file: CalibrationFile) -> Iterator[Problem]:
    """Names that are not unique, ratios of 1, contradicting limits, and facts without weight."""
    names = set()
    has_weight = False
    for number, observation in enumerate(file.observations):
        place = f"observations[{number}]"
        if observation.name in names:
            yield Problem(f"{place}.name", f'"{observation.name}"', "expected a name of its own")
        names.add(observation.name)
        if observation.over and set(observation.over) == set(observation.of):
            expected = "expected other experiments than in of: the ratio would be 1"
            yield Problem(f"{place}.over", None, expected)
        has_value = observation.value is not None
        has_limits = observation.least is not None or observation.most is not None
        low, high = observation.limits
        if has_value == has_limits or low > high:
            expected = "expected either a value or limits: least, most, or both in this order"
            yield Problem(place, None, expected)
        if observation.weighed and observation.group not in file.design.held_out:
            has_weight = True
    if not has_weight:
        expected = "expected one that is neither derived, costly nor held out"
        yield Problem("observations", None, expected)


def _problems_of_sets(file: CalibrationFile) -> Iterator[Problem]:
    """Values of named sets that are missing or not in the range of their parameter."""
    for set_name, values in file.sets.items():
        for name, parameter in file.parameters.items():
            value = values.get(name)
            low, high = parameter.range
            if value is None or not low <= value <= high:
                written = None if value is None else f"{value:g}"
                expected = f"expected a number in the range of the parameter, {low:g} to {high:g}"
                yield Problem(f"sets.{set_name}.{name}", written, expected)


def _problems_of_keys(file: CalibrationFile, required: Collection[str]) -> Iterator[Problem]:
    """Keys that not all experiments have, or that not exactly one parameter sets.

    ``required`` are the keys that some experiments change and that ``[set]`` does not have.
    """
    keys_of_parameters: dict[str, None] = {}
    for parameter in file.parameters.values():
        keys_of_parameters |= dict.fromkeys(parameter.keys)
    for experiment, table in file.experiments.items():
        for key in sorted(set(required) - flatten(table).keys()):
            expected = "missing; expected it here or in [set]: other experiments change it"
            yield Problem(f"experiments.{experiment}.{key}", None, expected)
        for key in keys_of_parameters:
            count = 0
            for parameter in file.parameters.values():
                if parameter.acts_in(experiment) and key in parameter.keys:
                    count += 1
            if count != 1:
                expected = (
                    f"expected one parameter that sets {key} for {experiment}, "
                    f"or none for any experiment; {count} do"
                )
                yield Problem("parameters", None, expected)
