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
from walkers.sweeps.left_out import tell
from walkers.sweeps.table import SweepTable

if TYPE_CHECKING:
    import pandas as pd

Predict = Callable[[Sequence[Case], str], tuple[Mapping[str, FloatArray], Mapping[str, int]]]
"""Function of N cases and a column: predictions of models, SI units, shape (N,); remarks, with the number of cases."""
_CURVE = 61  # points of a model's curve
_OF_SHAPE = ("radii", "volume_fraction", "meniscus_radius", "contact_angle")
"""Ends of the keys that change the shape of bridges, each of which takes a tenth of a second to solve."""


@dataclass(frozen=True)
class Theory:
    """Predictions of models for the cases of the points (``values``, in the displayed unit), and between them."""

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
        factor = factor_shown(done, column)
        predicted, remarks = predict(cases, column)
        for remark, number in remarks.items():
            tell(f"{number} of {len(done)} points: {remark}")
        values = {model: factor * values for model, values in predicted.items()}
        return cls(predict, done, column, log, cases, values, remarks.keys()) if values else None

    def curves(
        self, rows: npt.NDArray[np.int64], at: FloatArray, x: Factor | None
    ) -> tuple[FloatArray, Mapping[str, FloatArray]]:
        """Places on the x axis and predictions there: those of the points, which are ``at`` these places.

        A fine curve instead for an axis ``x`` along which the points differ in one number. If x is no key, such as Γ0,
        the key that varies is changed.
        """
        points, case = self.done.iloc[rows], self.cases[rows[0]]
        of_points = at, {model: values[rows] for model, values in self.values.items()}
        moving = [key for key in self.done.attrs["varied"] if points[key].nunique() > 1]
        if x is None or len(moving) != 1 or not (x.keys[0] in moving or x.keys[0] in derived(case)):
            return of_points
        key, name = moving[0], x.keys[0]
        if key.endswith(_OF_SHAPE) or points[key].dtype.kind not in "if":
            return of_points
        low, high = float(points[key].min()), float(points[key].max())
        spacing = np.geomspace if "x" in self.log and low > 0.0 else np.linspace
        numbers = spacing(low, high, _CURVE).tolist()
        unit = self.done.attrs["units"][key] or ""
        cases = [(low, _with_number(case, key, low, unit))]
        for value in numbers[1:-1]:
            # Between two points there may be values that no case has, such as half an integer.
            with suppress(InputError):
                cases.append((value, _with_number(case, key, value, unit)))
        cases.append((high, _with_number(case, key, high, unit)))
        predicted, remarks = self.predict([moved for _, moved in cases], self.column)
        if predicted.keys() != self.values.keys():
            return of_points
        if not all(np.isfinite(values).all() for values in predicted.values()):
            for remark in remarks.keys() - self.remarks:
                tell(f"the theory's curve has gaps: {remark}")
        along = [
            value if name == key else factor_shown(self.done, name) * derived(moved)[name] for value, moved in cases
        ]
        factor = factor_shown(self.done, self.column)
        return np.array(along), {model: factor * values for model, values in predicted.items()}


def _with_number(case: Case, key: str, value: float, unit: str) -> Case:
    """The case with a number of a key in a unit; without a unit it is a plain number, in case files too."""
    if unit:
        return changed_case(case, {key: f"{value!r} {unit}"})
    return changed_case(case, {key: int(value) if value.is_integer() else value})


def factor_shown(done: pd.DataFrame, column: str) -> float:
    """How many displayed units an SI unit of a column is."""
    return unit_shown(done.attrs["units"].get(column) or "")[1]
