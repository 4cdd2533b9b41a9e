"""Tables and figures of a calibration: facts beside the engine's numbers, and what is known of the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.arrays import FloatArray
from walkers.calibration.calibrate import PROPOSED, Outcome
from walkers.calibration.file import Calibration
from walkers.files import write_bytes, write_json
from walkers.inputs.keys import flatten
from walkers.inputs.toml import toml_bytes
from walkers.postprocess.show.drawing import TWO_COLUMNS, new_figure, save_figure, styled
from walkers.text import aligned, rendered

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

CALIBRATION_NAME = "calibration.json"
_ENDS = (0.05, 0.5, 0.95)


def write_outcome(outcome: Outcome, to: Path) -> list[Path]:
    """Write posterior (samples of equal weight, columns in the units of the parameters), record, table, case, figure.

    The case ``best.toml`` is that of the first experiment at the highest posterior.
    """
    import pandas as pd

    to.mkdir(parents=True, exist_ok=True)
    record, calibration = calibration_record(outcome), outcome.calibration
    samples = pd.DataFrame(
        calibration.values(outcome.posterior.samples), columns=[*calibration.file.parameters]
    )
    files = [
        to / file for file in ("posterior.parquet", CALIBRATION_NAME, "calibration.md", "best.toml")
    ]
    write_bytes(files[0], samples.to_parquet(index=False))
    write_json(files[1], record)
    write_bytes(files[3], toml_bytes(best_case(calibration, outcome.sets[PROPOSED[0]], samples)))
    write_bytes(
        files[2], rendered("walkers.calibration", "report.md.j2", {"found": record}).encode()
    )
    sources = [f"{calibration.name}-{part}" for part in ("named", "round", "proposed")]
    return files + save_figure(
        draw_facts(outcome), to / "predictions.png", sources, title=record["title"]
    )


def best_case(calibration: Calibration, best: FloatArray, samples: pd.DataFrame) -> dict[str, Any]:
    """Tables of the case of the first experiment at a point (D,), each value uncertain within 5 to 95 % of samples."""
    parameters, first = calibration.file.parameters, next(iter(calibration.experiments))
    values = dict(zip(parameters, map(_short, calibration.values(best[None])[0]), strict=True))
    tables = calibration.case(np.array([*values.values()]))
    ranges = flatten(tables.get("uncertain", {}))
    for name, parameter in parameters.items():
        low, high = map(_short, samples[name].quantile(_ENDS[::2]))
        ends = [min(low, values[name]), max(high, values[name])]
        if ends[0] < ends[1] and first in (parameter.experiments or [first]):
            written = [parameter.written(end) for end in ends]
            ranges |= dict.fromkeys(
                parameter.keys, {"loguniform": written} if parameter.log else written
            )
    return {**tables, "uncertain": ranges}


def _short(value: float) -> float:
    return float(f"{value:.4g}")  # more digits than the facts determine


def calibration_record(outcome: Outcome) -> dict[str, Any]:
    """Contents of ``calibration.json``; observations in mm/s and degrees."""
    calibration, parameters = outcome.calibration, outcome.calibration.file.parameters
    samples = dict(zip(parameters, calibration.values(outcome.posterior.samples).T, strict=True))
    prior = {
        name: parameter.values(np.array(_ENDS)).tolist() for name, parameter in parameters.items()
    }
    # Parameters that set the same keys in different experiments: where a ratio of 1 is likely, one value would do.
    alike = [
        two
        for two in combinations(parameters, 2)
        if parameters[two[0]].keys == parameters[two[1]].keys
    ]
    samples |= {f"{second}/{first}": samples[second] / samples[first] for first, second in alike}
    rows = [_row(outcome, place) for place in range(len(calibration.file.observations))]
    values = calibration.values(np.stack([*outcome.sets.values()])).tolist()
    return {
        "calibration": calibration.name,
        "title": calibration.file.title,
        "observed": "published" if calibration.file.published else "measured",
        "settings": calibration.file.model_dump(mode="json"),
        "labels": {name: parameter.label or name for name, parameter in parameters.items()},
        "number": outcome.number,
        "sets": {
            name: dict(zip(parameters, row, strict=True))
            for name, row in zip(outcome.sets, values, strict=True)
        },
        "agree": {
            name: sum(row["agrees"][name] for row in rows if not row["derived"])
            for name in outcome.sets
        },
        "of": sum(not row["derived"] for row in rows),
        "posterior": {
            name: [float(end) for end in np.quantile(column, _ENDS)]
            for name, column in samples.items()
        },
        "prior": prior,
        "effective_samples": [
            posterior.effective_samples for posterior in (outcome.posterior, outcome.held_out)
        ],
        "observations": rows,
    }


def calibration_summary(record: Mapping[str, Any]) -> str:
    """The facts that agree at each set, and the interval of each parameter, from `calibration_record`."""
    agree = [
        [name, f"{count} of {record['of']} {record['observed']} facts agree within their deviation"]
        for name, count in record["agree"].items()
    ]
    intervals = [
        [record["labels"].get(name, name), "{1:.3g} ({0:.3g} to {2:.3g})".format(*ends)]
        for name, ends in record["posterior"].items()
    ]
    note = "posterior: median, in brackets 5 to 95 %"
    if 2 * max(record["agree"].values()) < record["of"]:
        doubt = "the model, or a fact, is in question, and the intervals say little"
        note += f"; no set agrees with half of the facts: {doubt}"
    return "\n\n".join([aligned(agree), aligned(intervals), note])


def _row(outcome: Outcome, place: int) -> dict[str, Any]:
    """A fact, its number at the sets, and its prediction if it was held out."""
    observation = outcome.calibration.file.observations[place]
    (unit, scale), numbers = (
        observation.unit,
        {name: float(row[place]) for name, row in outcome.numbers.items()},
    )
    ends, emulator = outcome.predicted(observation), outcome.emulators.get(observation.name)
    return {
        **{name: getattr(observation, name) for name in ("name", "group", "title", "derived")},
        "expected": observation.text,
        "unit": unit,
        "numbers": {
            name: number * scale if isfinite(number) else None for name, number in numbers.items()
        },
        "agrees": {name: observation.agrees(number) for name, number in numbers.items()},
        "emulator_error": emulator and emulator.error,
        "predicted": None if ends is None else (ends * scale).tolist(),
    }


@styled
def draw_facts(outcome: Outcome) -> Figure:
    """Distances from the facts in deviations: of the sets, and predicted for what is held out."""
    facts = outcome.calibration.file.observations
    figure, axes = new_figure(TWO_COLUMNS, 0.25 * len(facts) + 1.5)
    places = np.arange(len(facts))[::-1]
    axes.axvspan(-1.0, 1.0, color="0.9", lw=0)
    for (name, numbers), marker in zip(
        outcome.numbers.items(), "os^DvPX*" * len(outcome.sets), strict=False
    ):
        away = [fact.residual(number) for fact, number in zip(facts, numbers, strict=True)]
        axes.plot(away, places, marker, ms=4, mfc="none", ls="none", label=name)
    for fact, place in zip(facts, places, strict=True):
        if (ends := outcome.predicted(fact)) is not None:
            axes.hlines(
                place - 0.25, fact.residual(ends[0]), fact.residual(ends[2]), color="k", lw=1.0
            )
    axes.set_yticks(places, [fact.title for fact in facts], fontsize=7)
    axes.set(
        xlabel="distance from the fact/deviation (lines: predicted)", ylim=(-0.8, len(facts) - 0.2)
    )
    axes.set_xscale("symlog", linthresh=3.0)
    figure.legend(loc="outside upper center", ncols=2)
    return figure
