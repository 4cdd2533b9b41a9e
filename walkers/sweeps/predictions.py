"""Predictions of models for the points of a sweep, and curves between the points."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.case_building import changed_case
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.quantities import unit_shown
from walkers.postprocess.measure.results import derived
from walkers.sweeps.factors import Factor
from walkers.sweeps.left_out import warn_left_out
from walkers.sweeps.table import SweepTable

if TYPE_CHECKING:
    import pandas as pd

Predict = Callable[[Sequence[Case], str], tuple[Mapping[str, FloatArray], Mapping[str, int]]]
"""Function of N cases and a column: predictions of models, SI units, shape (N,); remarks, with the number of cases."""
_CURVE_POINTS = 61
"""Number of points of a model's curve."""
_OF_SHAPE = ("radii", "volume_fraction", "meniscus_radius", "contact_angle")
"""Ends of the keys that change the shape of bridges, each of which takes a tenth of a second to solve."""


@dataclass(frozen=True)
class Theory:
    """Predictions of models for the finished points of a sweep.

    Attributes
    ----------
    predict
        The function that predicts.
    done
        Rows of the finished points.
    column
        The predicted column.
    log
        Letters of logarithmic axes.
    cases
        The cases of the points.
    values
        The predictions for the points by the names of the models, in the displayed unit.
    remarks
        Reasons why a model does not apply to points.
    """

    predict: Predict
    done: pd.DataFrame
    column: str
    log: str
    cases: Sequence[Case]
    values: Mapping[str, FloatArray]
    remarks: Collection[str]

    @classmethod
    def at_points(cls, table: SweepTable, column: str, log: str, predict: Predict) -> Theory | None:
        """The theory of the finished points; None if it has no such number, which a warning says."""
        done = table.finished
        cases = list(table.cases.values())
        predicted, remarks = predict(cases, column)
        for remark, number in remarks.items():
            warn_left_out(f"{number} of {len(done)} points: {remark}")
        if not predicted:
            return None
        values = _shown(done, column, predicted)
        return cls(predict, done, column, log, cases, values, remarks.keys())

    def curves(
        self, rows: npt.NDArray[np.int64], places: FloatArray, x: Factor | None
    ) -> tuple[FloatArray, Mapping[str, FloatArray]]:
        """Predictions along the x axis: a fine curve if the points differ in one number, else those of the points.

        Parameters
        ----------
        rows
            Numbers of the points, in the order of their places.
        places
            Their places on the x axis.
        x
            The factor on the x axis; None if no line joins the points. If it is no key, such as Γ0,
            the key that varies is changed.

        Returns
        -------
        along : ndarray
            Places on the x axis.
        values : mapping
            Predictions there by the names of the models, in the displayed unit.
        """
        of_points = places, {model: values[rows] for model, values in self.values.items()}
        key = None if x is None else self._key_along(rows, x)
        if x is None or key is None:
            return of_points
        numbers, cases = self._cases_along(rows, key)
        predicted, remarks = self.predict(cases, self.column)
        if predicted.keys() != self.values.keys():
            return of_points
        if not all(np.isfinite(values).all() for values in predicted.values()):
            for remark in remarks.keys() - self.remarks:
                warn_left_out(f"the theory's curve has gaps: {remark}")
        along = numbers
        name = x.keys[0]
        if name != key:
            along = [units_per_si(self.done, name) * derived(case)[name] for case in cases]
        return np.array(along), _shown(self.done, self.column, predicted)

    def _key_along(self, rows: npt.NDArray[np.int64], x: Factor) -> str | None:
        """The key that varies along an axis; None if points differ in several keys, or a curve would take long."""
        points = self.done.iloc[rows]
        varied = [key for key in self.done.attrs["varied"] if points[key].nunique() > 1]
        if len(varied) != 1:
            return None
        key: str = varied[0]
        if x.keys[0] != key and x.keys[0] not in derived(self.cases[rows[0]]):
            return None
        if key.endswith(_OF_SHAPE) or points[key].dtype.kind not in "if":
            return None
        return key

    def _cases_along(self, rows: npt.NDArray[np.int64], key: str) -> tuple[list[float], list[Case]]:
        """Numbers of a key between the smallest and the largest of some points, and the cases with these numbers."""
        low = float(self.done.iloc[rows][key].min())
        high = float(self.done.iloc[rows][key].max())
        spacing = np.geomspace if "x" in self.log and low > 0.0 else np.linspace
        between = spacing(low, high, _CURVE_POINTS).tolist()[1:-1]
        unit = self.done.attrs["units"][key] or ""
        first = self.cases[rows[0]]
        numbers = [low]
        cases = [_with_number(first, key, low, unit)]
        for number in between:
            # Between two points there may be numbers that no case has, such as half an integer.
            with suppress(InputError):
                cases.append(_with_number(first, key, number, unit))
                numbers.append(number)
        numbers.append(high)
        cases.append(_with_number(first, key, high, unit))
        return numbers, cases


def _with_number(case: Case, key: str, value: float, unit: str) -> Case:
    """The case with a number of a key in a unit; without a unit it is a plain number, in case files too."""
    if unit:
        return changed_case(case, {key: f"{value!r} {unit}"})
    return changed_case(case, {key: int(value) if value.is_integer() else value})


def _shown(
    done: pd.DataFrame, column: str, predicted: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Predictions in the displayed unit of a column."""
    factor = units_per_si(done, column)
    return {model: factor * values for model, values in predicted.items()}


def units_per_si(done: pd.DataFrame, column: str) -> float:
    """How many displayed units an SI unit of a column is."""
    return unit_shown(done.attrs["units"].get(column) or "")[1]
