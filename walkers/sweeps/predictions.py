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
"""Function of N cases and a column.

It returns predictions by the names of models, SI units, shape (N,), and the reasons why a model
does not apply, with the number of cases.
"""
_CURVE_POINTS = 61
"""Number of points of a model's curve."""
_KEYS_OF_SHAPE = ("radii", "volume_fraction", "meniscus_radius", "contact_angle")
"""Ends of the keys that change the shape of bridges, each of which takes 0.1 s to solve."""


@dataclass(frozen=True)
class Theory:
    """Predictions of models for the finished points of a sweep.

    Attributes
    ----------
    predict
        The function that predicts.
    finished
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
    finished: pd.DataFrame
    column: str
    log: str
    cases: Sequence[Case]
    values: Mapping[str, FloatArray]
    remarks: Collection[str]

    @classmethod
    def at_points(cls, table: SweepTable, column: str, log: str, predict: Predict) -> Theory | None:
        """The theory of the finished points of a sweep.

        None, with a warning, if no model predicts the column.
        """
        finished = table.finished
        cases = list(table.cases.values())
        predicted, remarks = predict(cases, column)
        for remark, number in remarks.items():
            warn_left_out(f"{number} of {len(finished)} points: {remark}")
        if not predicted:
            return None
        return cls(
            predict=predict,
            finished=finished,
            column=column,
            log=log,
            cases=cases,
            values=_in_displayed_unit(finished, column, predicted),
            remarks=remarks.keys(),
        )

    def curves(
        self, rows: npt.NDArray[np.int64], places: FloatArray, x: Factor | None
    ) -> tuple[FloatArray, Mapping[str, FloatArray]]:
        """Predictions along the x axis.

        If the points differ in one number, this is a fine curve, otherwise the predictions for the
        points.

        Parameters
        ----------
        rows
            Numbers of the points, in the order of their places.
        places
            Their places on the x axis.
        x
            The factor on the x axis; None if no line joins the points. If it is a result, such as
            Γ0, the key that varies is changed.

        Returns
        -------
        places : ndarray
            Places on the x axis.
        values : mapping
            Predictions there by the names of the models, in the displayed unit.
        """
        at_points = places, {model: values[rows] for model, values in self.values.items()}
        if x is None:
            return at_points
        key = self._varying_key(rows, x)
        if key is None:
            return at_points
        numbers, cases = self._cases_between(rows, key)
        predicted, remarks = self.predict(cases, self.column)
        if predicted.keys() != self.values.keys():
            return at_points
        if not all(np.isfinite(values).all() for values in predicted.values()):
            for remark in remarks.keys() - self.remarks:
                warn_left_out(f"the theory's curve has gaps: {remark}")
        curve_places = numbers
        name = x.keys[0]
        if name != key:
            factor = units_per_si(self.finished, name)
            curve_places = [factor * derived(case)[name] for case in cases]
        curves = _in_displayed_unit(self.finished, self.column, predicted)
        return np.array(curve_places), curves

    def _varying_key(self, rows: npt.NDArray[np.int64], x: Factor) -> str | None:
        """The only key in which points along the x axis differ.

        None if there are several, or if a curve along the key would take long to compute.
        """
        points = self.finished.iloc[rows]
        varied = [key for key in self.finished.attrs["varied"] if points[key].nunique() > 1]
        if len(varied) != 1:
            return None
        key: str = varied[0]
        if x.keys[0] != key and x.keys[0] not in derived(self.cases[rows[0]]):
            return None
        if key.endswith(_KEYS_OF_SHAPE) or points[key].dtype.kind not in "if":
            return None
        return key

    def _cases_between(
        self, rows: npt.NDArray[np.int64], key: str
    ) -> tuple[list[float], list[Case]]:
        """Cases between points that differ in one key, for a curve.

        Parameters
        ----------
        rows
            Numbers of the points.
        key
            The key.

        Returns
        -------
        numbers : list of float
            Numbers of the key from the smallest to the largest of the points, in the unit of the
            sweep file; evenly spaced on the x axis.
        cases : list of Case
            The cases with these numbers.
        """
        low = float(self.finished.iloc[rows][key].min())
        high = float(self.finished.iloc[rows][key].max())
        spacing = np.geomspace if "x" in self.log and low > 0.0 else np.linspace
        between = spacing(low, high, _CURVE_POINTS).tolist()[1:-1]
        unit = self.finished.attrs["units"][key] or ""
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
    """The case with a number of a key in a unit; a plain number, as in case files, without one."""
    if unit:
        return changed_case(case, {key: f"{value!r} {unit}"})
    if value.is_integer():
        return changed_case(case, {key: int(value)})
    return changed_case(case, {key: value})


def _in_displayed_unit(
    rows: pd.DataFrame, column: str, predicted: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Predictions of a column in its displayed unit, by the names of the models."""
    factor = units_per_si(rows, column)
    return {model: factor * values for model, values in predicted.items()}


def units_per_si(rows: pd.DataFrame, column: str) -> float:
    """How many displayed units of a column one SI unit is."""
    _, factor = unit_shown(rows.attrs["units"].get(column) or "")
    return factor
