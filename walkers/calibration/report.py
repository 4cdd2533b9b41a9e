"""Tables and figures of a calibration: facts beside the engine's numbers, and what is known of the parameters."""

from __future__ import annotations

from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.calibration.calibrate import Outcome
from walkers.calibration.emulator import LEAST_SAMPLES
from walkers.postprocess.drawing import TWO_COLUMNS, new_figure, save_figure, styled
from walkers.runner.files import write_bytes, write_json, write_text
from walkers.text import rendered

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

RECORD_NAME = "calibration.json"
_ENDS = (5.0, 50.0, 95.0)
_NARROW = (1.0 / 3.0, 2.0 / 3.0)
"""A parameter is identified if its posterior interval is below a third of the prior's (narrowed: two thirds)."""


def write_outcome(found: Outcome, to: Path) -> list[Path]:
    """Write ``posterior.parquet`` (`samples_of`), ``calibration.json`` and ``.md``, and figures; return their paths."""
    to.mkdir(parents=True, exist_ok=True)
    record, name, title = record_of(found), found.calibration.name, found.calibration.file.title
    files = [to / file for file in ("posterior.parquet", RECORD_NAME, "calibration.md")]
    write_bytes(files[0], samples_of(found).to_parquet(index=False))
    write_json(files[1], record)
    write_text(files[2], rendered("walkers.calibration", "report.md.j2", found=record, least=LEAST_SAMPLES))
    sources = [f"{name}-{part}" for part in ("named", "round", "proposed")]
    for part, figure in {"posterior": draw_posterior(found), "predictions": draw_predictions(found)}.items():
        files += save_figure(figure, to / f"{part}.png", sources, title=f"{title}: {part}")
    return files


def samples_of(found: Outcome) -> pd.DataFrame:
    """Samples of the posterior of equal weight; columns are the parameters in their units."""
    import pandas as pd

    return pd.DataFrame(found.calibration.values(found.posterior.samples), columns=[*found.calibration.file.parameters])


def record_of(found: Outcome) -> dict[str, Any]:
    """Contents of ``calibration.json``; observations in mm/s and degrees."""
    file, samples = found.calibration.file, samples_of(found)
    converged = found.posterior.effective_samples > LEAST_SAMPLES
    # Width of the 5 to 95 % interval over that of the prior: 1 if nothing was learned.
    widths = np.ptp(np.percentile(found.posterior.samples, (5.0, 95.0), axis=0), axis=0) / 0.9
    # Parameters that set the same keys in different experiments: where a ratio of 1 is likely, one value would do.
    for one, other in combinations(file.parameters, 2):
        if file.parameters[one].keys == file.parameters[other].keys:
            samples[f"{other}/{one}"] = samples[other] / samples[one]
    rows = [_row(found, place) for place in range(len(file.observations))]
    values = found.calibration.values(np.stack([*found.sets.values()])).tolist()
    return {
        "calibration": found.calibration.name,
        "title": file.title,
        "observed": "published" if file.published else "measured",
        "settings": file.model_dump(mode="json"),
        "parameters": {name: _label(found, name) for name in file.parameters},
        "number": found.number,
        "sets": {
            name: dict(zip(file.parameters, row, strict=True)) for name, row in zip(found.sets, values, strict=True)
        },
        "agree": {name: sum(row["agrees"][name] for row in rows if not row["derived"]) for name in found.sets},
        "of": sum(not row["derived"] for row in rows),
        "intervals": {str(name): np.percentile(samples[name], _ENDS).tolist() for name in samples},
        "words": {name: words_of(width, converged) for name, width in zip(file.parameters, widths, strict=True)},
        "effective_samples": [one.effective_samples for one in (found.posterior, found.held_out)],
        "observations": rows,
    }


def _row(found: Outcome, place: int) -> dict[str, Any]:
    """A fact, its number at the sets, and the prediction from the facts that are not held out."""
    one = found.calibration.file.observations[place]
    (unit, scale), numbers = one.unit, {name: float(row[place]) for name, row in found.numbers.items()}
    emulator = next((each for each in found.emulators if each.observation is one), None)
    ends = found.predicted(one)
    return {
        **{name: getattr(one, name) for name in ("name", "group", "title", "says", "source", "derived", "weighed")},
        "expected": one.text,
        "unit": unit,
        "numbers": {name: number * scale if isfinite(number) else None for name, number in numbers.items()},
        "agrees": {name: one.agrees(number) for name, number in numbers.items()},
        "emulator_error": emulator and emulator.error,
        "predicted": None if ends is None else (ends * scale).tolist(),
    }


def _label(found: Outcome, name: str) -> str:
    parameter = found.calibration.file.parameters[name]
    return f"{parameter.symbol or name}{f' ({parameter.unit})' if parameter.unit else ''}"


def words_of(width: float, converged: bool) -> str:
    """Verdict on a parameter, given the ratio of its posterior interval to that of the prior."""
    if not converged:
        return "undetermined: the posterior has not converged"
    return "identified" if width < _NARROW[0] else "narrowed" if width < _NARROW[1] else "not identified"


@styled
def draw_posterior(found: Outcome) -> Figure:
    """Samples of each pair of parameters; each as a histogram."""
    import pandas as pd

    samples, count = samples_of(found), len(found.calibration.file.parameters)
    figure, axes = new_figure(TWO_COLUMNS, TWO_COLUMNS, nrows=count, ncols=count)
    names = {name: "\n".join(_label(found, name).split()) for name in samples}  # panels may be as narrow as a word
    pd.plotting.scatter_matrix(samples.rename(columns=names), ax=axes, s=1.0, alpha=0.2, hist_kwds={"bins": 24})
    return figure


@styled
def draw_predictions(found: Outcome) -> Figure:
    """Distances from the facts in deviations: of the sets, and predicted for what is held out."""
    facts = found.calibration.file.observations
    figure, axes = new_figure(TWO_COLUMNS, 0.25 * len(facts) + 1.5)
    places = np.arange(len(facts))[::-1]
    axes.axvspan(-1.0, 1.0, color="0.9", lw=0)
    for (name, numbers), marker in zip(found.numbers.items(), "os^DvPX*" * len(found.sets), strict=False):
        away = [one.residual(number) for one, number in zip(facts, numbers, strict=True)]
        axes.plot(away, places, marker, ms=4, mfc="none", ls="none", label=name)
    for one, place in zip(facts, places, strict=True):
        if (ends := found.predicted(one)) is not None:
            axes.hlines(place - 0.25, one.residual(ends[0]), one.residual(ends[2]), color="k", lw=1.0)
    axes.set_yticks(places, [one.title for one in facts], fontsize=7)
    axes.set(xlabel="distance from the fact/deviation (lines: predicted)", ylim=(-0.8, len(facts) - 0.2))
    axes.set_xscale("symlog", linthresh=3.0)
    figure.legend(loc="outside upper center", ncols=2)
    return figure
