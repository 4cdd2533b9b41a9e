"""Tables and figures of a calibration: facts beside the engine's numbers, and the posterior.

The calibration itself is made in `walkers.calibration.calibrate`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray, IntArray
from walkers.calibration.calibrate import PROPOSED, Outcome
from walkers.calibration.file import Calibration
from walkers.calibration.observations import Observation
from walkers.files import write_bytes, write_json
from walkers.inputs.keys import flatten
from walkers.inputs.toml import toml_bytes
from walkers.postprocess.show.drawing import TWO_COLUMNS, new_figure, save_figure, styled
from walkers.text import aligned, rendered

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CALIBRATION_NAME = "calibration.json"
"""Name of the record of a calibration."""
_INTERVAL = (0.05, 0.5, 0.95)
"""Quantiles of parameters that are reported."""
_HEIGHT_OF_FACT = 0.25
"""Height of the row of a fact in the figure, inches."""
_HEIGHT_AROUND_FACTS = 1.5
"""Height of the axis and the legend of the figure, inches."""
_FARTHEST = 3
"""Largest distance from a fact that the figure shows, in deviations."""
_MARKERS = "os^DvPX*"
"""Markers of the sets in figures, which are repeated."""


def write_outcome(outcome: Outcome, to: Path) -> list[Path]:
    """Write the files of a calibration.

    Parameters
    ----------
    outcome
        The outcome.
    to
        The folder, which is made if necessary.

    Returns
    -------
    list of Path
        ``posterior.parquet``, samples of equal weight, whose columns are the parameters in their
        units; ``calibration.json``, the record; ``calibration.md``, its tables; ``best.toml``, the
        case of `best_case` at the highest posterior; and the figure ``predictions.png`` with what
        belongs to it.
    """
    import pandas as pd

    to.mkdir(parents=True, exist_ok=True)
    calibration = outcome.calibration
    record = calibration_record(outcome)
    values = calibration.values(outcome.posterior.samples)
    samples = pd.DataFrame(values, columns=list(calibration.file.parameters))
    best = best_case(calibration, outcome.sets[PROPOSED[0]], samples)
    report = rendered("walkers.calibration", "report.md.j2", {"found": record})
    posterior_path = to / "posterior.parquet"
    record_path = to / CALIBRATION_NAME
    report_path = to / "calibration.md"
    best_path = to / "best.toml"
    write_bytes(posterior_path, samples.to_parquet(index=False))
    write_json(record_path, record)
    write_bytes(best_path, toml_bytes(best))
    write_bytes(report_path, report.encode())
    sources = [f"{calibration.name}-{part}" for part in ("named", "round", "proposed")]
    figure = draw_facts(outcome)
    pictures = save_figure(figure, to / "predictions.png", sources, title=record["title"])
    return [posterior_path, record_path, report_path, best_path, *pictures]


def best_case(calibration: Calibration, best: FloatArray, samples: pd.DataFrame) -> dict[str, Any]:
    """Tables of the case of the first experiment at a parameter set.

    Parameters
    ----------
    calibration
        The calibration.
    best : ndarray, shape (D,)
        The set, a point of the unit cube of the prior.
    samples
        Samples of the posterior, with a column of values for each parameter.

    Returns
    -------
    dict
        The tables of a case file. ``uncertain`` has the range from 5 to 95 % of the samples for the
        keys of each parameter, and includes the value.
    """
    first = next(iter(calibration.experiments))
    parameters = calibration.file.parameters
    values = [_rounded(value) for value in calibration.values(best[None])[0]]
    tables = calibration.case(np.array(values))
    ranges = flatten(tables.get("uncertain", {}))
    for (name, parameter), value in zip(parameters.items(), values, strict=True):
        lower_end = float(samples[name].quantile(_INTERVAL[0]))
        upper_end = float(samples[name].quantile(_INTERVAL[2]))
        low = min(_rounded(lower_end), value)
        high = max(_rounded(upper_end), value)
        if low >= high or not parameter.acts_in(first):
            continue
        limits: Any = [parameter.written(low), parameter.written(high)]
        if parameter.log:
            limits = {"loguniform": limits}
        ranges |= dict.fromkeys(parameter.keys, limits)
    return {**tables, "uncertain": ranges}


def _rounded(value: float) -> float:
    """A value with four digits; the facts do not determine more."""
    return float(f"{value:.4g}")


def calibration_record(outcome: Outcome) -> dict[str, Any]:
    """The contents of ``calibration.json``.

    Observations are in mm/s and degrees, parameters in their units. A *set* is a value of each
    parameter.

    Returns
    -------
    dict
        By name, in plain JSON types:

        - ``calibration``, ``title``: its name and title
        - ``observed``: ``published`` or ``measured``, what the facts are
        - ``settings``: the contents of the calibration file
        - ``labels``: the label of each parameter
        - ``number``: number of sets to which the emulators are fitted
        - ``sets``: the sets of the file and those that the calibration proposes, by their names
        - ``agree``: for each of these sets, how many facts the engine's numbers agree with
        - ``of``: the number of these facts, without those that are derived from others
        - ``posterior``, ``prior``: 5 %, median and 95 % of each parameter. ``posterior`` also has
          ratios of parameters, such as ``second/first``, that set the same keys in different
          experiments: where a ratio of 1 is likely, one value would do
        - ``effective_samples``: effective number of samples of the posterior from all facts, then
          of that without the facts that are held out
        - ``observations``: for each fact, the engine's number at each set, whether they agree, and
          the prediction if it was held out; None for numbers that do not exist
    """
    calibration = outcome.calibration
    file = calibration.file
    parameters = file.parameters
    interval = np.array(_INTERVAL)
    rows = [_observation_row(outcome, number) for number in range(len(file.observations))]
    independent_rows = [row for row in rows if not row["derived"]]
    agree = {}
    for name in outcome.sets:
        agreements = [row["agrees"][name] for row in independent_rows]
        agree[name] = agreements.count(True)
    posterior = {}
    for name, samples in _posterior_samples(outcome).items():
        posterior[name] = np.quantile(samples, interval).tolist()
    prior = {}
    labels = {}
    for name, parameter in parameters.items():
        prior[name] = parameter.values(interval).tolist()
        labels[name] = parameter.label or name
    values_of_sets = calibration.values(np.stack(list(outcome.sets.values()))).tolist()
    sets = {}
    for name, values in zip(outcome.sets, values_of_sets, strict=True):
        sets[name] = dict(zip(parameters, values, strict=True))
    return {
        "calibration": calibration.name,
        "title": file.title,
        "observed": "published" if file.published else "measured",
        "settings": file.model_dump(mode="json"),
        "labels": labels,
        "number": outcome.number_of_fitted_sets,
        "sets": sets,
        "agree": agree,
        "of": len(independent_rows),
        "posterior": posterior,
        "prior": prior,
        "effective_samples": [
            outcome.posterior.effective_samples,
            outcome.held_out.effective_samples,
        ],
        "observations": rows,
    }


def _posterior_samples(outcome: Outcome) -> dict[str, FloatArray]:
    """Samples of the posterior by the names of parameters, in their units, shape (samples,) each.

    Further entries ``second/first`` have the ratio of two parameters that set the same keys.
    """
    calibration = outcome.calibration
    parameters = calibration.file.parameters
    values = calibration.values(outcome.posterior.samples)
    samples: dict[str, FloatArray] = dict(zip(parameters, values.T, strict=True))
    for first, second in combinations(parameters, 2):
        if parameters[first].keys == parameters[second].keys:
            samples[f"{second}/{first}"] = samples[second] / samples[first]
    return samples


def _observation_row(outcome: Outcome, number: int) -> dict[str, Any]:
    """An observation, its number at each set, and its prediction if it was held out.

    Numbers are in the ``unit`` of the row, and None where a number does not exist.
    """
    observation = outcome.calibration.file.observations[number]
    unit, scale = observation.unit
    numbers: dict[str, float | None] = {}
    agrees = {}
    for name, numbers_of_set in outcome.numbers.items():
        value = float(numbers_of_set[number])
        numbers[name] = value * scale if isfinite(value) else None
        agrees[name] = observation.agrees(value)
    emulator = outcome.emulators.get(observation.name)
    predicted = outcome.predicted(observation)
    return {
        "name": observation.name,
        "group": observation.group,
        "title": observation.title,
        "derived": observation.derived,
        "expected": observation.text,
        "unit": unit,
        "numbers": numbers,
        "agrees": agrees,
        "emulator_error": None if emulator is None else emulator.error,
        "predicted": None if predicted is None else (predicted * scale).tolist(),
    }


def calibration_summary(record: Mapping[str, Any]) -> str:
    """How many facts agree at each set, and the interval of each parameter, as text.

    ``record`` is that of `calibration_record`.
    """
    agreement = []
    for name, count in record["agree"].items():
        text = f"{count} of {record['of']} {record['observed']} facts agree within their deviation"
        agreement.append([name, text])
    intervals = []
    for name, (low, median, high) in record["posterior"].items():
        label = record["labels"].get(name, name)
        intervals.append([label, f"{median:.3g} ({low:.3g} to {high:.3g})"])
    note = "posterior: median, in brackets 5 to 95 %"
    if 2 * max(record["agree"].values()) < record["of"]:
        note += (
            "; no set agrees with half of the facts: the model, or a fact, is in question, "
            "and the intervals say little"
        )
    return "\n\n".join([aligned(agreement), aligned(intervals), note])


@styled
def draw_facts(outcome: Outcome) -> Figure:
    """Distances of numbers from the facts, in deviations.

    Markers are the numbers of the engine at each set; a grey bar is the prediction of a fact that
    was held out, from 5 to 95 %.
    """
    facts = outcome.calibration.file.observations
    figure = new_figure(TWO_COLUMNS, _HEIGHT_OF_FACT * len(facts) + _HEIGHT_AROUND_FACTS)
    axes = figure.subplots()
    heights = np.arange(len(facts))[::-1]
    axes.axvspan(-1.0, 1.0, color="0.93", lw=0)
    for fact, height in zip(facts, heights, strict=True):
        predicted = outcome.predicted(fact)
        if predicted is not None:
            low = fact.residual(predicted[0])
            high = fact.residual(predicted[2])
            axes.hlines(height, low, high, color="0.7", lw=5.0, zorder=1.5)
    for index, (name, numbers) in enumerate(outcome.numbers.items()):
        _draw_set(axes, np.array(_residuals(facts, numbers)), heights, index, name)
    axes.plot([], [], color="0.7", lw=5.0, label="predicted without the fact, 5 to 95 %")
    axes.set_yticks(heights, [fact.title for fact in facts], fontsize=7)
    axes.set_xlabel("distance from the fact/its deviation; arrows: beyond")
    axes.set_xticks(range(-_FARTHEST, _FARTHEST + 1))
    axes.set_xlim(-_FARTHEST - 0.4, _FARTHEST + 0.4)
    axes.set_ylim(-0.8, len(facts) - 0.2)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def _draw_set(axes: Axes, distances: FloatArray, heights: IntArray, index: int, name: str) -> None:
    """Draw the distances of a parameter set from the facts; arrows at the ends for far ones."""
    colour = f"C{index}"
    near = np.abs(distances) <= _FARTHEST
    style: dict[str, Any] = {"ms": 4, "mfc": "none", "ls": "none", "color": colour}
    axes.plot(distances[near], heights[near], _MARKERS[index % len(_MARKERS)], label=name, **style)
    for marker, is_beyond in ((">", distances > _FARTHEST), ("<", distances < -_FARTHEST)):
        # Arrows of different sets at the same place are side by side.
        places = np.sign(distances[is_beyond]) * (_FARTHEST + 0.25 - 0.12 * (index % 3))
        axes.plot(places, heights[is_beyond], marker, **style)


def _residuals(facts: list[Observation], numbers: FloatArray) -> list[float]:
    """Distances of the numbers of a set, shape (K,), from K facts in deviations."""
    return [fact.residual(number) for fact, number in zip(facts, numbers, strict=True)]
