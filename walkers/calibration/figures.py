"""Figures of a calibration: the posterior's corners, predictions beside observations, what depends on what."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from walkers.calibration.calibrate import Outcome
from walkers.calibration.report import Row, labelled
from walkers.calibration.space import Space
from walkers.calibration.waves import seen_in
from walkers.inputs.calibration import Band
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, save_figure, styled

_AGAINST = {
    "peak_acceleration": "peak acceleration (m/s²)",
    "gamma0": r"dimensionless peak force $\Gamma_0$",
    "frequency": "frequency (Hz)",
    "sin_delta": r"asymmetry $\sin\,\delta$",
}
FloatArray = npt.NDArray[np.float64]

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def draw(found: Outcome, rows: list[Row], to: Path) -> list[Path]:
    """Write ``corner.png``, ``predictions.png``, ``sobol.png`` and, if the file has any, ``bands.png``."""
    sources = [Path(run).name for run in found.predictive.table["run"]]
    files = []
    for name, figure in figures_of(found, rows).items():
        files += save_figure(figure, to / f"{name}.png", sources, title=f"{found.calibration.file.title}: {name}")
    return files


def figures_of(found: Outcome, rows: list[Row]) -> dict[str, Figure]:
    """The figures of a calibration by name."""
    corners = draw_corners(found.space, found.posterior.unit, found.checks["best"].unit[0])
    figures = {"corner": corners, "predictions": _predictions(rows), "sobol": _sobol(found)}
    return figures | ({"bands": _bands(found)} if found.calibration.file.bands else {})


@styled
def draw_corners(space: Space, sets: FloatArray, best: FloatArray) -> Figure:
    """The distributions of K parameters and of each pair of them, and where the best set is.

    Parameters
    ----------
    space
        Of the parameters.
    sets
        Of the posterior, in the unit cube, shape (N, K).
    best
        In the unit cube, shape (K,).
    """
    import corner

    parameters, alone = space.parameters, len(space.parameters) == 1
    logs = np.array([one.log for one in parameters])

    def drawn(unit: FloatArray) -> FloatArray:
        values = space.values(unit)
        return np.where(logs, np.log10(np.where(logs, values, 1.0)), values)

    figure, _ = new_figure(TWO_COLUMNS, TWO_COLUMNS, nrows=len(parameters), ncols=len(parameters))
    # corner places its panels itself; after the constrained engine alone that would be refused.
    figure.set_layout_engine("tight")
    figure.set_layout_engine("none")
    corner.corner(
        drawn(sets),
        fig=figure,
        # A word on each line: panels of many parameters are no wider.
        labels=["\n".join(("log " + labelled(one) if one.log else labelled(one)).split()) for one in parameters],
        range=drawn(np.array([np.zeros(len(parameters)), np.ones(len(parameters))])).T.tolist(),
        # Of one parameter corner has a panel, in which it cannot mark any.
        truths=None if alone else drawn(best),
        truth_color="C1",
        quantiles=[0.05, 0.5, 0.95],
        label_kwargs={"fontsize": 7},
        plot_datapoints=False,
        smooth=1.0,
        bins=24,
        hist_kwargs={"linewidth": 0.8},
        contour_kwargs={"linewidths": 0.6},
    )
    if alone:
        figure.axes[0].axvline(float(drawn(best)[0]), color="C1")
    _make_room(figure)
    return figure


def _make_room(figure: Figure) -> None:
    """Few ticks, none at a corner, and labels as far from the panels as the ticks ask for, not as panels are wide."""
    from matplotlib.ticker import MaxNLocator
    from matplotlib.transforms import ScaledTranslation

    edge = 1.0 / TWO_COLUMNS
    figure.subplots_adjust(left=edge, bottom=edge, right=0.99, top=0.99, wspace=0.1, hspace=0.1)
    away = -26.0 / 72.0
    for panel in figure.axes:
        panel.grid(visible=False)
        beneath, beside = (ScaledTranslation(*way, figure.dpi_scale_trans) for way in ((0.0, away), (away, 0.0)))
        panel.xaxis.set_label_coords(0.5, 0.0, transform=panel.transAxes + beneath)
        panel.yaxis.set_label_coords(0.0, 0.5, transform=panel.transAxes + beside)
        for axis in (panel.xaxis, panel.yaxis):
            locator = axis.get_major_locator()
            if isinstance(locator, MaxNLocator):
                locator.set_params(nbins=3, prune="both")


@styled
def _predictions(rows: list[Row]) -> Figure:
    """Residuals in standard deviations: the engine at the best set and over the posterior, and what was held out."""
    figure, axes = new_figure(TWO_COLUMNS, 0.3 * len(rows) + 1.2)
    places = np.arange(len(rows))[::-1]
    axes.axvspan(-1.0, 1.0, color="0.9", lw=0)
    axes.axvline(0.0, color="0.4", lw=0.8)
    _bars(axes, rows, places)
    trials = list(dict.fromkeys(trial for row in rows for trial in row.held_out))
    for number, trial in enumerate(trials):
        seen = [(place, row) for place, row in zip(places, rows, strict=True) if trial in row.held_out]
        middle = [(row.held_out[trial][0] - row.value) / row.deviation for _, row in seen]
        width = [row.held_out[trial][1] / row.deviation for _, row in seen]
        heights = [place - 0.22 for place, _ in seen]
        axes.errorbar(middle, heights, xerr=width, fmt="s", ms=4, color=f"C{number + 2}", lw=1.0, label=trial)
    axes.set_yticks(places, [row.title for row in rows], fontsize=7)
    axes.set(xlabel="(predicted - published)/standard deviation", ylim=(-0.8, len(rows) - 0.2))
    axes.set_xscale("symlog", linthresh=3.0)
    figure.legend(loc="outside upper center", ncols=2)
    return figure


def _bars(axes: Axes, rows: list[Row], places: np.ndarray[tuple[int], np.dtype[np.int64]]) -> None:
    published, deviation = (np.array([getattr(row, name) for row in rows]) for name in ("value", "deviation"))
    low, high, best = (
        (np.array([getattr(row, name) for row in rows], dtype=np.float64) - published) / deviation  # None is NaN
        for name in ("low", "high", "engine")
    )
    axes.hlines(places, low, high, color="C0", lw=4.0, alpha=0.5, label="engine over the posterior")
    axes.plot(best, places, "o", ms=5, color="C1", label="engine at the best set")


@styled
def _bands(found: Outcome) -> Figure:
    """The engine over the posterior and at the best set, against what the experiments differ in."""
    bands = found.calibration.file.bands
    columns = min(len(bands), 3)
    lines = -(-len(bands) // columns)
    figure, axes = new_figure(TWO_COLUMNS, 2.3 * lines + 0.4, nrows=lines, ncols=columns, squeeze=False)
    for place, band in zip(axes.flat, bands, strict=False):
        _band(place, band, found)
    for place in axes.flat[len(bands) :]:
        place.set_visible(False)
    letter_panels(axes.flat[: len(bands)])
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


def _band(axes: Axes, band: Band, found: Outcome) -> None:
    labels = list(found.calibration.experiments)
    chosen = [labels.index(one) for one in band.of]
    table = found.checks["best"].table
    where = table[band.against].to_numpy()[chosen]
    order = np.argsort(where)
    many, best = (
        seen_in(found.calibration, wave.table, {band.quantity})[band.quantity][:, chosen] * 1e3
        for wave in (found.predictive, found.checks["best"])
    )
    order_seen = order[np.isfinite(many[:, order]).any(axis=0)]
    low, high = (of(many[:, order_seen], axis=0) for of in (np.nanmin, np.nanmax))
    axes.fill_between(where[order_seen], low, high, color="C0", alpha=0.3, lw=0, label="engine over the posterior")
    axes.plot(where[order], best[0, order], "o-", ms=4, lw=1.0, color="C1", label="engine at the best set")
    published = [
        (where[chosen.index(labels.index(of))], one)
        for one in found.calibration.observations
        if one.quantity == band.quantity and not one.over
        for of in one.of
        if of in band.of
    ]
    values, errors = ([getattr(one, name) * 1e3 for _, one in published] for name in ("value", "deviation"))
    axes.errorbar([x for x, _ in published], values, errors, fmt="ks", ms=4, lw=1.0, label="published")
    quantity, _, which = band.quantity.partition("_")
    place = f" at contact {which}" if quantity == "sliding" else f" of bead {which}" if which else ""
    axes.set(title=band.title, xlabel=_AGAINST[band.against], ylabel=f"{quantity}{place} (mm/s)")


@styled
def _sobol(found: Outcome) -> Figure:
    names = [one.symbol for one in found.space.parameters]
    figure, axes = new_figure(TWO_COLUMNS, 0.2 * len(found.emulators.each) + 1.6)
    total = found.sobol
    image = axes.imshow(total, aspect="auto", cmap="Blues", vmin=0.0, vmax=1.0)
    for row, column in np.argwhere(np.isfinite(total)):
        colour = "w" if total[row, column] > 0.55 else "0.2"
        axes.text(column, row, f"{total[row, column]:.2f}", ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=7)
    axes.set_yticks(
        range(len(found.emulators.each)), [one.observation.title for one in found.emulators.each], fontsize=7
    )
    axes.grid(visible=False)
    figure.colorbar(image, ax=axes, label="total Sobol index")
    return figure
