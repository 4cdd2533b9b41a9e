"""Comparison with the paper's measurements and statements, for each parameter set: ``comparison.md`` and ``.json``."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from math import isclose, isnan, nan
from pathlib import Path
from typing import Any

import numpy as np

from studies.paper.sources import (
    Sources,
    facts_sweep_name,
    parameter_sets,
    ruby,
    sweep_of,
    thresholds_with_theory,
)
from walkers.calibration.observations import LEAST_SPEED, Observation, quantities_of_runs
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure.results import json_numbers
from walkers.runner.run_directory import case_of
from walkers.theory.prediction import COULOMB_MODEL, PAPER_FIT, predicted_column

Numbers = Mapping[str, Mapping[str, float]]
"""Quantities of walkers by experiment of the calibration."""
_NOTHING = 5e-4
"""In the unit of a fact, what is shown as zero."""
_MOST_DIGITS = 6
_PLACES = 6
"""Decimal places at which drives and asymmetries of a sweep are the same."""


def compare(sources: Sources) -> dict[str, Any]:
    """The comparison, as in ``comparison.json``; None for numbers that do not exist.

    ``sets``: for each parameter set the number of facts that ``agree``, their number (``of``), and its ``parameters``.
    ``facts``: the sentence of the paper (``says``) and its ``source``, the ``expected`` value, our ``values``, their
    ``texts`` and whether they ``agree`` by set, the ``theory`` of the shipped set, and whether the fact is ``derived``
    from others and not counted. ``thresholds``: Γc as from `thresholds_with_theory`. ``curve``: engine and theory
    beside the one-parameter curve of Figs. 2 and 3, which is no measurement, mm/s.
    """
    experiments = list(ruby().experiments)
    cases = {
        name: dict(zip(experiments, sweep_of(facts_sweep_name(name)).cases(), strict=True))
        for name in parameter_sets()
    }
    tables = {name: sources.table(facts_sweep_name(name)) for name in parameter_sets()}
    numbers = {
        name: dict(zip(experiments, quantities_of_runs(table), strict=True))
        for name, table in tables.items()
    }
    theory = _by_theory(cases["shipped"])
    facts = [_fact(observation, numbers, theory) for observation in ruby().file.observations]
    counted = [fact["agree"] for fact in facts if not fact["derived"]]
    thresholds: Any = thresholds_with_theory(sources).to_dict("records")
    return {
        "sets": {
            name: {
                "agree": sum(agrees[name] for agrees in counted),
                "of": len(counted),
                "parameters": _parameters(of),
            }
            for name, of in cases.items()
        },
        "facts": facts,
        "thresholds": [json_numbers(row) for row in thresholds],
        "curve": [
            *_curve(
                sources,
                "fig2",
                "peak_acceleration",
                lambda peak: f"{peak / ACCELERATION_OF_ONE_G:.3g} g",
            ),
            *_curve(sources, "fig3", "sin_delta", lambda sine: f"sin δ = {sine:.3f}"),
        ],
    }


def _parameters(cases: Mapping[str, Case]) -> dict[str, str]:
    """Texts of the calibrated parameters, as in a case file, by their symbols."""
    shown = {}
    for name, parameter in ruby().file.parameters.items():
        case = cases[parameter.experiments[0] if parameter.experiments else next(iter(cases))]
        texts = {origin.key: origin.text for origin in case.origins}
        shown[parameter.symbol or name] = " and ".join(
            dict.fromkeys(texts[key] for key in parameter.keys)
        )
    return shown


def _by_theory(cases: Mapping[str, Case]) -> Numbers:
    """Speeds by Coulomb friction and drag; NaN for other quantities, and where contacts open."""
    numbers: dict[str, dict[str, float]] = {label: defaultdict(lambda: nan) for label in cases}
    for quantity in {observation.quantity for observation in ruby().file.observations}:
        values = predicted_column(list(cases.values()), quantity)[0].get(
            COULOMB_MODEL, np.full(len(cases), nan)
        )
        for label, value in zip(cases, values, strict=True):
            numbers[label][quantity] = float(value)
    return numbers


def _fact(
    observation: Observation, numbers: Mapping[str, Numbers], theory: Numbers
) -> dict[str, Any]:
    values, scale = (
        {name: observation.number_from(of_set) for name, of_set in numbers.items()},
        observation.unit[1],
    )
    return {
        **{
            name: getattr(observation, name)
            for name in ("name", "title", "says", "source", "derived")
        },
        "expected": observation.text,
        "values": json_numbers({name: value * scale for name, value in values.items()}),
        "texts": {name: _text_of(value, observation) for name, value in values.items()},
        "agree": {name: observation.agrees(value) for name, value in values.items()},
        **json_numbers({"theory": observation.number_from(theory) * scale}),
    }


def _text_of(value: float, observation: Observation) -> str | None:
    """A number (SI) in the unit of a fact, with three digits, or as many more as a reader needs for the verdict.

    The text is no limit of the fact, and agrees with it if the number does. Numbers below 0.0005 are zero, so that
    rounding errors are not shown. None for NaN.
    """
    if isnan(value):
        return None
    scale = observation.unit[1]
    shown = value * scale
    if abs(shown) < _NOTHING:
        shown = 0.0
    for digits in range(3, _MOST_DIGITS):
        text = f"{shown:.{digits}g}"
        printed = float(text) / scale
        is_limit = isclose(abs(observation.residual(printed)), 1.0)
        if not is_limit and observation.agrees(printed) == observation.agrees(value):
            return text
    return f"{shown:.{_MOST_DIGITS}g}"


def _curve(
    sources: Sources, sweep: str, column: str, label: Callable[[float], str]
) -> list[dict[str, Any]]:
    """Rows of a sweep: label, and means over the frequencies by engine, theory and the paper's curve, mm/s.

    ``by_frequency`` is the engine's velocity at the highest frequency over that at the lowest.
    """
    table = sources.table(sweep)
    table = table[table["status"] == "finished"].sort_values("frequency")
    models = (
        predicted_column([case_of(Path(run)) for run in table["run"]], "velocity")[0]
        if len(table)
        else {}
    )
    models_of_curve = {
        "engine": table["velocity"],
        "theory": models.get(COULOMB_MODEL, nan),
        "curve": models.get(PAPER_FIT, nan),
    }
    numbers = table[[column]].astype(float).round(_PLACES).assign(**models_of_curve)
    rows = []
    for _, group in numbers.groupby(column):
        slow, fast = (float(group["engine"].iloc[end]) for end in (0, -1))
        ratio = fast / slow if len(group) > 1 and abs(slow) > LEAST_SPEED else nan
        means = {name: float(group[name].mean()) * 1e3 for name in models_of_curve}
        name = f"Fig. {sweep.removeprefix('fig')}, {label(float(group[column].iloc[0]))}"
        rows.append({"of": name, **json_numbers({**means, "by_frequency": ratio})})
    return rows
