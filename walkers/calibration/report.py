"""Tables and figures of a calibration: facts beside the engine's numbers, and what is known of the parameters."""

from __future__ import annotations

from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.calibration.calibrate import BEST, Outcome
from walkers.calibration.emulator import LEAST_SAMPLES, Posterior, distances
from walkers.calibration.file import Parameter
from walkers.calibration.observations import FloatArray
from walkers.postprocess.drawing import TWO_COLUMNS, new_figure, save_figure, styled
from walkers.runner.files import write_bytes, write_json, write_text
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORD_NAME = "calibration.json"
_NARROW, _NARROWER = 1.0 / 3.0, 2.0 / 3.0
"""A parameter is identified if its posterior interval is below a third of the prior's (narrowed: two thirds)."""


def write_outcome(found: Outcome, to: Path) -> list[Path]:
    """Write ``posterior.parquet``, ``calibration.json`` and ``.md``, and figures; return their paths.

    Rows of the first are samples of equal weight, columns are the parameters in their units.
    """
    import pandas as pd

    to.mkdir(parents=True, exist_ok=True)
    calibration, record = found.calibration, record_of(found)
    samples = pd.DataFrame(calibration.values(found.posterior.samples), columns=[*calibration.file.parameters])
    files = [to / name for name in ("posterior.parquet", RECORD_NAME, "calibration.md")]
    write_bytes(files[0], samples.to_parquet(index=False))
    write_json(files[1], record)
    more = {"least": LEAST_SAMPLES, "narrow": _NARROW}
    write_text(files[2], rendered("walkers.calibration", "report.md.j2", found=record, **more))
    sources = [f"{calibration.name}-{part}" for part in ("sets", "proposed")]
    for name, figure in {"corner": draw_corners(found), "predictions": draw_predictions(record)}.items():
        files += save_figure(figure, to / f"{name}.png", sources, title=f"{calibration.file.title}: {name}")
    return files


def record_of(found: Outcome) -> dict[str, Any]:
    """Contents of ``calibration.json``; observations in mm/s and degrees."""
    calibration, names = found.calibration, [*found.calibration.file.parameters]
    posterior, values = found.posterior, calibration.values(found.unit)
    samples = calibration.values(posterior.samples)
    chosen = {**found.names, "most facts": found.best}
    rows = [_row(found, place, chosen) for place in range(len(found.emulators))]
    own = [row for row in rows if not row["derived"]]
    # Width of the 5 to 95 % interval over that of the prior: 1 if nothing was learned.
    narrowing = dict(zip(names, np.ptp(np.percentile(posterior.samples, (5, 95), axis=0), axis=0) / 0.9, strict=True))
    proposed = found.unit[found.names[BEST] :]
    return {
        "calibration": calibration.name,
        "title": calibration.file.title,
        "observed": "published" if calibration.file.published else "measured",
        "settings": calibration.file.model_dump(mode="json"),
        "parameters": {name: _label(name, one) for name, one in calibration.file.parameters.items()},
        "number": len(found.unit),
        "sets": {name: dict(zip(names, values[place].tolist(), strict=True)) for name, place in chosen.items()},
        "agree": {name: sum(row["agrees"][name] for row in own) for name in chosen},
        "of": len(own),
        "intervals": _intervals(dict(zip(names, samples.T, strict=True))),
        "narrowing": {name: float(share) for name, share in narrowing.items()},
        "words": {name: words_of(share, converged=posterior.converged) for name, share in narrowing.items()},
        "ratios": _intervals(_ratios(calibration.file.parameters, samples)),
        "posterior": _worth(posterior),
        "held_out": None if found.held_out is None else _worth(found.held_out),
        "emulators_within_two_errors": _accuracy(found, proposed),
        "observations": rows,
    }


def _row(found: Outcome, place: int, chosen: dict[str, int]) -> dict[str, Any]:
    """A fact, and its number at the chosen sets; of a group that is held out also the prediction from the others."""
    emulator = found.emulators[place]
    one, (unit, scale) = emulator.observation, emulator.observation.unit
    numbers = {name: float(found.numbers[row, place]) for name, row in chosen.items()}
    predicted = None
    if found.held_out is not None and one.group in found.calibration.file.design.held_out:
        samples = found.held_out.samples
        normal = np.random.default_rng(found.held_out.seed).standard_normal(len(samples))
        predicted = [float(end) * scale for end in np.percentile(emulator.numbers(samples, normal), (5, 50, 95))]
    return {
        **{name: getattr(one, name) for name in ("name", "group", "title", "says", "source", "derived")},
        "expected": one.text,
        "unit": unit,
        "numbers": {name: number * scale if isfinite(number) else None for name, number in numbers.items()},
        "away": {name: one.residual(number) if isfinite(number) else None for name, number in numbers.items()},
        "agrees": {name: one.agrees(number) for name, number in numbers.items()},
        "emulator_error": emulator.error,
        "missing": int(np.isnan(found.numbers[:, place]).sum()),
        "predicted": predicted,
        "predicted_away": predicted and [one.residual(end / scale) for end in predicted],
    }


def _accuracy(found: Outcome, proposed: FloatArray) -> float | None:
    """Share of the engine's numbers at sets that no emulator has seen within two errors of the emulators."""
    away = []
    for place, emulator in enumerate(found.emulators):
        mean, error = emulator.predict(proposed)
        seen = distances(emulator.observation, found.numbers[-len(proposed) :, place])
        away += [float(one) for one in np.abs(seen - mean) / error]
    return float(np.mean(np.array(away) <= 2.0))


def _ratios(parameters: dict[str, Parameter], samples: FloatArray) -> dict[str, FloatArray]:
    """Ratios of parameters that set the same keys in different experiments: where 1 is likely, one value would do."""
    columns = dict(zip(parameters, samples.T, strict=True))
    alike = [
        (one, other) for one, other in combinations(parameters, 2) if parameters[one].keys == parameters[other].keys
    ]
    return {
        f"{_label(other, parameters[other])} / {_label(one, parameters[one])}": columns[other] / columns[one]
        for one, other in alike
    }


def _intervals(samples: dict[str, FloatArray]) -> dict[str, list[float]]:
    """5 %, median and 95 %."""
    return {name: np.percentile(column, (5.0, 50.0, 95.0)).tolist() for name, column in samples.items()}


def _worth(posterior: Posterior) -> dict[str, Any]:
    names = ("converged", "effective_samples", "log_evidence")
    return {"points": len(posterior.points), **{name: getattr(posterior, name) for name in names}}


def _label(name: str, parameter: Parameter) -> str:
    return f"{parameter.symbol or name}{f' ({parameter.unit})' if parameter.unit else ''}"


def words_of(share: float, *, converged: bool) -> str:
    """Verdict on a parameter, given the ratio of its posterior interval to that of the prior."""
    if not converged:
        return "undetermined: the posterior has not converged"
    return "identified" if share < _NARROW else "narrowed" if share < _NARROWER else "not identified"


@styled
def draw_corners(found: Outcome) -> Figure:
    """The posterior of each parameter and of each pair; lines: the set with most facts."""
    import corner

    parameters, values = found.calibration.file.parameters, found.calibration.values
    logarithmic = np.array([one.log for one in parameters.values()])

    def drawn(unit: FloatArray) -> FloatArray:
        scaled = values(unit)
        return np.asarray(np.log10(scaled, out=scaled, where=logarithmic))

    count = len(parameters)
    figure, _ = new_figure(TWO_COLUMNS, TWO_COLUMNS, nrows=count, ncols=count)
    figure.set_layout_engine("none")  # corner places its panels itself
    corner.corner(
        drawn(found.posterior.samples),
        fig=figure,
        labels=["\n".join([*("log",) * one.log, *_label(name, one).split()]) for name, one in parameters.items()],
        range=drawn(np.array([np.zeros(count), np.ones(count)])).T.tolist(),
        truths=drawn(found.unit[[found.best]])[0],
        truth_color="C1",
        quantiles=[0.05, 0.5, 0.95],
        label_kwargs={"fontsize": 7},
        max_n_ticks=3,
        plot_datapoints=False,
        smooth=1.0,
        bins=24,
    )
    return figure


@styled
def draw_predictions(record: dict[str, Any]) -> Figure:
    """Distances from the facts in deviations: of the named sets, and predicted for what is held out."""
    rows = record["observations"]
    figure, axes = new_figure(TWO_COLUMNS, 0.25 * len(rows) + 1.5)
    places = np.arange(len(rows))[::-1]
    axes.axvspan(-1.0, 1.0, color="0.9", lw=0)
    for number, name in enumerate(record["agree"]):
        away = [np.nan if row["away"][name] is None else row["away"][name] for row in rows]
        axes.plot(away, places, "os^Dv"[number % 5], ms=4, color=f"C{number}", mfc="none", label=name)
    for row, place in zip(rows, places, strict=True):
        if row["predicted_away"]:
            axes.hlines(place - 0.25, row["predicted_away"][0], row["predicted_away"][2], color="k", lw=1.0)
    axes.set_yticks(places, [row["title"] for row in rows], fontsize=7)
    axes.set(xlabel="distance from the fact/deviation (lines: predicted from the others)", ylim=(-0.8, len(rows) - 0.2))
    axes.set_xscale("symlog", linthresh=3.0)
    figure.legend(loc="outside upper center", ncols=3)
    return figure
