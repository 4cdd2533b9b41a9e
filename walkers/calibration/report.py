"""Tables and figures of a calibration: observations, predictions and the posterior."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.calibration.calibrate import Outcome
from walkers.calibration.emulator import FloatArray, Space, transformed
from walkers.calibration.file import QUANTITIES, Parameter
from walkers.calibration.posterior import LEAST_SAMPLES, Posterior
from walkers.inputs.units import SPEED
from walkers.postprocess.drawing import TWO_COLUMNS, new_figure, save_figure, styled
from walkers.runner.files import write_bytes, write_json, write_text
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RECORD_NAME = "calibration.json"
_SIGMAS = 2.0
_NARROW, _NARROWER = 1.0 / 3.0, 2.0 / 3.0
"""A parameter is identified if its posterior interval is below a third of the prior's (narrowed: two thirds)."""

# --- tables -----------------------------------------------------------------------------------------------------------


def write_outcome(found: Outcome, to: Path) -> list[Path]:
    """Write ``posterior.parquet``, ``calibration.json`` and ``.md``, and figures (`figures_of`); return their paths.

    Columns of the samples are the parameters (in their units), ``discrepancy_GROUP`` (in standard deviations) and
    ``log_density``.
    """
    import pandas as pd

    to.mkdir(parents=True, exist_ok=True)
    record, posterior = record_of(found), found.posterior
    samples = pd.DataFrame(found.space.values(posterior.unit), columns=[one.name for one in found.space.parameters])
    for place, group in enumerate(posterior.groups):
        samples[f"discrepancy_{group}"] = posterior.discrepancy[:, place]
    samples["log_density"] = posterior.log_density
    files = [to / name for name in ("posterior.parquet", RECORD_NAME, "calibration.md")]
    write_bytes(files[0], samples.to_parquet(index=False))
    write_json(files[1], record)
    discrepancies = np.percentile(posterior.discrepancy, (5.0, 50.0, 95.0), axis=0).T.tolist()
    more: dict[str, Any] = {"observed": _observed(found)}
    more |= {"samples": len(found.predictive.unit), "least": LEAST_SAMPLES, "narrow": _NARROW}
    page = rendered("walkers.calibration", "report.md.j2", found=record, discrepancies=discrepancies, **more)
    write_text(files[2], page)
    sources = [Path(run).name for run in found.predictive.table["run"]]
    for name, figure in figures_of(found, record["observations"]).items():
        files += save_figure(figure, to / f"{name}.png", sources, title=f"{found.calibration.file.title}: {name}")
    return files


def _observed(found: Outcome) -> str:
    """What the observations are called."""
    return "published" if found.calibration.file.published else "measured"


def record_of(found: Outcome) -> dict[str, Any]:
    """Contents of ``calibration.json``; observations in mm/s and degrees."""
    calibration, posterior, emulators = found.calibration, found.posterior, found.emulators
    names = [one.name for one in found.space.parameters]
    rows = [_row(found, place) for place in range(len(emulators.each))]
    own = [row["agrees"] for row in rows if not row["derived"]]
    values = np.percentile(found.space.values(posterior.unit), (5.0, 50.0, 95.0), axis=0).T.tolist()
    # Width of the 5 to 95 % interval over that of the prior: 1 if nothing was learned.
    widths = np.ptp(np.percentile(posterior.unit, (5.0, 95.0), axis=0), axis=0)
    priors = np.array([np.ptp(one.ppf((0.05, 0.95))) for one in found.space.priors])
    narrowed = dict(zip(names, (widths / priors).tolist(), strict=True))
    mean, deviation = emulators.predict(found.predictive.unit)
    seen = [
        transformed(values, one.observation)
        for values, one in zip(found.predictive.outcome.T, emulators.each, strict=True)
    ]
    errors = np.abs(np.stack(seen, axis=1) - mean) / deviation
    errors = errors[np.isfinite(errors)]
    return {
        "calibration": calibration.name,
        "title": calibration.file.title,
        "settings": calibration.file.model_dump(mode="json"),
        "parameters": {one.name: _labelled(one) for one in found.space.parameters},
        "sets": len(found.unit),
        "best": dict(zip(names, found.space.values(found.checks["best"].unit[0]).tolist(), strict=True)),
        "intervals": dict(zip(names, values, strict=True)),
        "discrepancies": dict(zip(posterior.groups, np.median(posterior.discrepancy, axis=0).tolist(), strict=True)),
        "narrowing": narrowed,
        "words": {name: words_of(share, converged=posterior.converged) for name, share in narrowed.items()},
        "posterior": _worth(posterior),
        "held_out_posteriors": {name: _worth(one) for name, one in found.held_out.items()},
        "emulators": {
            one.observation.name: {
                key: _finite(getattr(one, key)) for key in ("explained", "error", "error_inflation", "sets")
            }
            for one in emulators.each
        },
        "emulators_checked": len(errors),
        "emulators_within_two_errors": float(np.mean(errors <= _SIGMAS)) if len(errors) else None,
        "feasible": {
            "seen": float(np.mean(~np.isnan(found.predictive.outcome))),
            "expected": float(emulators.feasible(found.predictive.unit).mean()),
        },
        "agree": sum(own),
        "of": len(own),
        "observations": rows,
    }


def _row(found: Outcome, place: int) -> dict[str, Any]:
    """An observation, and its predictions by engine and emulator, at the best set and over samples."""
    emulator = found.emulators.each[place]
    observation, best = emulator.observation, found.checks["best"].unit
    speed = QUANTITIES[observation.quantity] is SPEED
    unit, scale = ("", 1.0) if observation.over else ("mm/s", 1e3) if speed else ("°", 1.0)
    seen = found.predictive.outcome[:, place] * scale
    seen = seen[np.isfinite(seen)]
    engine, finer, longer = (_finite(float(wave.outcome[0, place]) * scale) for wave in found.checks.values())
    below, emulated, above = (float(emulator.draw(best, np.full(1, sigmas))[0]) * scale for sigmas in (-1.0, 0.0, 1.0))
    held_out = {}
    for name, posterior in found.held_out.items():
        if observation.group in found.calibration.file.held_out[name]:
            normal = np.random.default_rng(0).standard_normal(len(posterior.unit))
            low, middle, high = np.percentile(emulator.draw(posterior.unit, normal), (16.0, 50.0, 84.0)) * scale
            held_out[name] = (float(middle), float(high - low) / 2.0)
    value, deviation = observation.value * scale, observation.deviation * scale
    return {
        "name": observation.name,
        "group": observation.group,
        "title": observation.title,
        "unit": unit,
        "value": value,
        "deviation": deviation,
        "engine": engine,
        "low": float(seen.min()) if len(seen) else None,
        "high": float(seen.max()) if len(seen) else None,
        "samples": len(seen),
        "emulator": emulated,
        "error": (above - below) / 2.0,
        "feasible": float(found.emulators.feasible(best)[0, place]),
        "agrees": engine is not None and abs(engine - value) <= deviation,
        "derived": observation.derived,
        "half_step": finer,
        "twice_as_long": longer,
        "held_out": held_out,
    }


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


def _worth(posterior: Posterior) -> dict[str, Any]:
    return {name: getattr(posterior, name) for name in ("converged", "points", "effective_samples")}


def _labelled(parameter: Parameter) -> str:
    return f"{parameter.symbol} ({parameter.unit})" if parameter.unit else parameter.symbol


def words_of(share: float, *, converged: bool) -> str:
    """Verdict on a parameter, given the ratio of its posterior interval to that of the prior."""
    if not converged:
        return "undetermined: the posterior has not converged"
    return "identified" if share < _NARROW else "narrowed" if share < _NARROWER else "not identified"


# --- figures ----------------------------------------------------------------------------------------------------------


def figures_of(found: Outcome, rows: list[dict[str, Any]]) -> dict[str, Figure]:
    """``corner`` and ``predictions``; rows are the record's observations."""
    corners = draw_corners(found.space, found.posterior.unit, found.checks["best"].unit[0])
    return {"corner": corners, "predictions": _predictions(rows, _observed(found))}


@styled
def draw_corners(space: Space, sets: FloatArray, best: FloatArray) -> Figure:
    """The distributions of D parameters over sets (N, D) of the unit cube, of each pair of them, and the best set."""
    import corner
    from matplotlib.ticker import MaxNLocator
    from matplotlib.transforms import ScaledTranslation

    def drawn(unit: FloatArray) -> FloatArray:
        values = space.values(unit)
        return np.asarray(np.log10(values, out=values, where=space.logarithmic))

    count, words = space.dimensions, [("log " if one.log else "") + _labelled(one) for one in space.parameters]
    figure, _ = new_figure(TWO_COLUMNS, TWO_COLUMNS, nrows=count, ncols=count)
    # corner places its panels itself, which the constrained layout engine refuses.
    figure.set_layout_engine("tight")
    figure.set_layout_engine("none")
    corner.corner(
        drawn(sets),
        fig=figure,
        labels=["\n".join(label.split()) for label in words],  # panels may be as narrow as a word
        range=drawn(np.array([np.zeros(count), np.ones(count)])).T.tolist(),
        truths=None if count == 1 else drawn(best),  # corner cannot mark a value in a single panel
        truth_color="C1",
        quantiles=[0.05, 0.5, 0.95],
        label_kwargs={"fontsize": 7},
        plot_datapoints=False,
        smooth=1.0,
        bins=24,
        hist_kwargs={"linewidth": 0.8},
        contour_kwargs={"linewidths": 0.6},
    )
    if count == 1:
        figure.axes[0].axvline(float(drawn(best)[0]), color="C1")
    # Few ticks, none at a corner; the distance of labels depends on the ticks, not on the width of panels.
    edge, away = 1.0 / TWO_COLUMNS, -26.0 / 72.0
    figure.subplots_adjust(left=edge, bottom=edge, right=0.99, top=0.99, wspace=0.1, hspace=0.1)
    beneath, beside = (ScaledTranslation(*way, figure.dpi_scale_trans) for way in ((0.0, away), (away, 0.0)))
    for panel in figure.axes:
        panel.grid(visible=False)
        panel.xaxis.set_label_coords(0.5, 0.0, transform=panel.transAxes + beneath)
        panel.yaxis.set_label_coords(0.0, 0.5, transform=panel.transAxes + beside)
        for axis in (panel.xaxis, panel.yaxis):
            locator = axis.get_major_locator()
            if isinstance(locator, MaxNLocator):
                locator.set_params(nbins=3, prune="both")
    return figure


@styled
def _predictions(rows: list[dict[str, Any]], observed: str) -> Figure:
    """Residuals in standard deviations: the engine at the best set and over the posterior, and what was held out."""
    figure, axes = new_figure(TWO_COLUMNS, 0.3 * len(rows) + 1.2)
    places = np.arange(len(rows))[::-1]
    axes.axvspan(-1.0, 1.0, color="0.9", lw=0)
    axes.axvline(0.0, color="0.4", lw=0.8)
    value, deviation, low, high, best = (
        np.array([row[name] for row in rows], dtype=np.float64)  # None is NaN
        for name in ("value", "deviation", "low", "high", "engine")
    )
    ends = ((one - value) / deviation for one in (low, high))
    axes.hlines(places, *ends, color="C0", lw=4.0, alpha=0.5, label="engine over the posterior")
    axes.plot((best - value) / deviation, places, "o", ms=5, color="C1", label="engine at the best set")
    for number, trial in enumerate(dict.fromkeys(trial for row in rows for trial in row["held_out"])):
        seen = [place for place, row in enumerate(rows) if trial in row["held_out"]]
        middle, width = np.array([rows[place]["held_out"][trial] for place in seen]).T
        residual, error = (middle - value[seen]) / deviation[seen], width / deviation[seen]
        look = {"fmt": "s", "ms": 4, "color": f"C{number + 2}", "lw": 1.0}
        axes.errorbar(residual, places[seen] - 0.22, xerr=error, label=trial, **look)
    axes.set_yticks(places, [row["title"] for row in rows], fontsize=7)
    axes.set(xlabel=f"(predicted - {observed})/standard deviation", ylim=(-0.8, len(rows) - 0.2))
    axes.set_xscale("symlog", linthresh=3.0)
    figure.legend(loc="outside upper center", ncols=2)
    return figure
