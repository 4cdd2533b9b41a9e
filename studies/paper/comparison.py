"""Compare our runs with the paper's measurements and statements, for each parameter set.

`compare` collects the numbers of ``comparison.md`` and ``comparison.json``; `studies.paper.make`
writes these files. Nothing is run here: the runs are in the folder of a `Sources`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isclose, isfinite, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.paper.sources import (
    Sources,
    facts_sweep_name,
    parameter_sets,
    ruby,
    sweep_of,
    thresholds_with_theory,
)
from walkers.calibration.file import Calibration
from walkers.calibration.observations import LEAST_SPEED, Observation, quantities_of_runs
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure.results import json_numbers
from walkers.runner.run_directory import case_of
from walkers.theory.prediction import FRICTION_MODEL, PAPER_FIT, predicted_column

Numbers = Mapping[str, Mapping[str, float]]
"""Quantities of walkers, SI units and degrees, by experiment of the calibration and by name."""

_LARGEST_ZERO = 5e-4
"""Numbers below this one are shown as zero; in the unit of the fact."""

_LEAST_DIGITS = 3
"""Number of significant digits of a text, if the text then agrees with the fact as the number
does."""

_MOST_DIGITS = 6
"""Largest number of significant digits of a text."""

_DECIMALS = 6
"""Drives or asymmetries of a sweep that agree to this number of decimals are the same."""

_MODELS = ("engine", "theory", "curve")
"""Columns of velocities beside the paper's curve."""


def compare(sources: Sources) -> dict[str, Any]:
    """Compare the runs with the facts of the paper.

    Parameters
    ----------
    sources
        The sweeps `studies.paper.make.COMPARED`.

    Returns
    -------
    dict
        What ``comparison.json`` contains; None stands for a number that does not exist.

        ``sets``
            For each parameter set, how many of the facts ``agree``, the number ``of`` facts, and
            the ``parameters`` as texts.
        ``facts``
            For each fact the sentence of the paper (``says``) and its ``source``, the ``expected``
            value, our ``values`` by parameter set, their ``texts``, whether they ``agree``, the
            value of the ``theory`` with the shipped set, and whether the fact is ``derived`` from
            others and therefore not counted.
        ``thresholds``
            Γc by frequency, see `thresholds_with_theory`.
        ``curve``
            Velocities by engine and theory beside the one-parameter curve of Figs. 2 and 3, mm/s.
            The curve is no measurement.
    """
    cases = {}
    numbers = {}
    for name in parameter_sets():
        cases[name] = _cases_of_facts(name)
        numbers[name] = _measured_numbers(sources, name)
    theory = _numbers_by_theory(cases["shipped"])
    facts = [_fact(observation, numbers, theory) for observation in ruby().file.observations]
    counted = [fact for fact in facts if not fact["derived"]]
    sets = {}
    for name, cases_of_set in cases.items():
        sets[name] = {
            "agree": sum(fact["agree"][name] for fact in counted),
            "of": len(counted),
            "parameters": _parameter_texts(parameter_sets()[name].calibration, cases_of_set),
        }
    thresholds: Any = thresholds_with_theory(sources).to_dict("records")
    return {
        "sets": sets,
        "facts": facts,
        "thresholds": [json_numbers(row) for row in thresholds],
        "curve": [
            *_curve(sources, "fig2", "peak_acceleration", _drive_label),
            *_curve(sources, "fig3", "sin_delta", _asymmetry_label),
        ],
    }


def _cases_of_facts(parameter_set: str) -> dict[str, Case]:
    """Cases of a parameter set by experiment of the calibration."""
    cases = sweep_of(facts_sweep_name(parameter_set)).cases()
    return dict(zip(ruby().experiments, cases, strict=True))


def _measured_numbers(sources: Sources, parameter_set: str) -> Numbers:
    """What the walkers of a parameter set did in each experiment of the calibration."""
    table = sources.table(facts_sweep_name(parameter_set))
    return dict(zip(ruby().experiments, quantities_of_runs(table), strict=True))


def _numbers_by_theory(cases: Mapping[str, Case]) -> Numbers:
    """The same numbers by friction and viscous forces.

    NaN for quantities that this model does not have, and where contacts open.
    """
    numbers: dict[str, dict[str, float]] = {experiment: {} for experiment in cases}
    for quantity in {observation.quantity for observation in ruby().file.observations}:
        predictions, _ = predicted_column(list(cases.values()), quantity)
        values = predictions.get(FRICTION_MODEL, np.full(len(cases), nan))
        for experiment, value in zip(cases, values, strict=True):
            numbers[experiment][quantity] = float(value)
    return numbers


def _parameter_texts(calibration: Calibration, cases: Mapping[str, Case]) -> dict[str, str]:
    """Calibrated parameters as a case file writes them, by their symbols."""
    parameter_texts = {}
    for name, parameter in calibration.file.parameters.items():
        experiment = next(iter(cases))
        if parameter.experiments:
            experiment = parameter.experiments[0]
        texts_by_key = {origin.key: origin.text for origin in cases[experiment].origins}
        texts = [texts_by_key[key] for key in parameter.keys]
        different = list(dict.fromkeys(texts))
        parameter_texts[parameter.symbol or name] = " and ".join(different)
    return parameter_texts


def _fact(
    observation: Observation, numbers: Mapping[str, Numbers], theory: Numbers
) -> dict[str, Any]:
    """A fact, our number for each parameter set, and the theory's, in the unit of the fact."""
    scale = observation.unit[1]
    values = {}
    texts = {}
    agree = {}
    for name, numbers_of_set in numbers.items():
        value = observation.number_from(numbers_of_set)
        values[name] = value * scale
        texts[name] = _text_of(value, observation)
        agree[name] = observation.agrees(value)
    by_theory = observation.number_from(theory) * scale
    return {
        "name": observation.name,
        "title": observation.title,
        "says": observation.says,
        "source": observation.source,
        "derived": observation.derived,
        "expected": observation.text,
        "values": json_numbers(values),
        "texts": texts,
        "agree": agree,
        "theory": by_theory if isfinite(by_theory) else None,
    }


def _text_of(value: float, observation: Observation) -> str | None:
    """A number as text that agrees with a fact if and only if the number does.

    The text has three significant digits, or as many more as that takes; it is not a limit of the
    fact either. Numbers below 0.0005 become zero, so that no rounding errors are shown.

    Parameters
    ----------
    value
        The number, in SI units or degrees.
    observation
        The fact, in whose unit the text is.

    Returns
    -------
    str or None
        None if the value is NaN.
    """
    if isnan(value):
        return None
    scale = observation.unit[1]
    scaled = value * scale
    if abs(scaled) < _LARGEST_ZERO:
        scaled = 0.0
    for digits in range(_LEAST_DIGITS, _MOST_DIGITS):
        text = f"{scaled:.{digits}g}"
        printed = float(text) / scale
        is_limit = isclose(abs(observation.residual(printed)), 1.0)
        if not is_limit and observation.agrees(printed) == observation.agrees(value):
            return text
    return f"{scaled:.{_MOST_DIGITS}g}"


# --- the paper's curve ----------------------------------------------------------------------------


def _drive_label(peak_acceleration: float) -> str:
    return f"{peak_acceleration / ACCELERATION_OF_ONE_G:.3g} g"


def _asymmetry_label(sin_delta: float) -> str:
    return f"sin δ = {sin_delta:.3f}"


def _curve(
    sources: Sources, sweep: str, column: str, label: Callable[[float], str]
) -> list[dict[str, Any]]:
    """Velocities by engine, theory and the paper's curve for each drive or asymmetry of a sweep.

    Parameters
    ----------
    sources
        The folder of the sweep.
    sweep
        Name of the sweep, which is that of a figure: ``fig2`` or ``fig3``.
    column
        Drive or asymmetry: column of the table of the sweep, SI units.
    label
        Words for a value of this column.

    Returns
    -------
    list of dict
        A row for each value of the column: what it is ``of``, the means of the models over the
        frequencies, mm/s, and ``by_frequency``, the engine's velocity at the highest frequency over
        that at the lowest.
    """
    table = sources.table(sweep)
    table = table[table["status"] == "finished"].sort_values("frequency")
    rows = []
    for _, velocities in _velocities_by_model(table, column).groupby(column):
        value = float(velocities[column].iloc[0])
        row = {name: float(velocities[name].mean()) * 1e3 for name in _MODELS}
        row["by_frequency"] = _ratio_of_ends(velocities["engine"])
        name = f"Fig. {sweep.removeprefix('fig')}, {label(value)}"
        rows.append({"of": name, **json_numbers(row)})
    return rows


def _velocities_by_model(table: pd.DataFrame, column: str) -> pd.DataFrame:
    """A column of the points of a sweep, and their velocities by engine and models, m/s."""
    predictions: Mapping[str, Any] = {}
    if len(table):
        cases = [case_of(Path(run)) for run in table["run"]]
        predictions, _ = predicted_column(cases, "velocity")
    velocities = table[[column]].astype(float).round(_DECIMALS)
    velocities["engine"] = table["velocity"]
    velocities["theory"] = predictions.get(FRICTION_MODEL, nan)
    velocities["curve"] = predictions.get(PAPER_FIT, nan)
    return velocities


def _ratio_of_ends(velocities: pd.Series[float]) -> float:
    """The last velocity over the first; NaN if there is only one, or the first is too small."""
    slow = float(velocities.iloc[0])
    fast = float(velocities.iloc[-1])
    if len(velocities) < 2 or abs(slow) <= LEAST_SPEED:
        return nan
    return fast / slow
