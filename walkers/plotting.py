"""Figures of sweeps, in Python and for ``walkers plot SWEEP``: the table and predictions of the theory."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.errors import InputError, refused
from walkers.inputs.case import Case
from walkers.postprocess.drawing import FORMATS, check_place, save_figure
from walkers.runner.directory import case_of
from walkers.sweeps.figure import Factor, draw, drawn_column, layout_of
from walkers.sweeps.readable import readable_unit
from walkers.sweeps.table import FACING_DOWN, default_column, derived_of, find_name, load, varied_columns

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd
    from matplotlib.figure import Figure

    from walkers.inputs.case import Case
    from walkers.theory.quasistatic import FloatArray


_OF_SHAPE = ("radii", "volume_fraction", "contact_angle")
"""Ends of the keys that change the shape of bridges."""


class LeftOutWarning(UserWarning):
    """Something is not in a figure: points without a result, keys that are not distinguished, a theory's prediction."""


def plot_sweep(directory: str | Path, to: str | Path | None = None, **choices: Any) -> Path:
    """Plot a sweep's table to a file.

    Parameters
    ----------
    directory
        A sweep's directory, such as ``runs/fig2``.
    to
        The file, with a suffix of `walkers.postprocess.drawing.FORMATS`; None: in the sweep's directory, named after
        ``y``.
    choices
        ``x``, ``y``, ``hue``, ``panels``, ``log``, ``theory`` of `sweep_figure`.

    Raises
    ------
    InputError
        As `sweep_figure`, or if the suffix of the file is unknown.
    """
    table = load(directory)
    place = Path(to) if to is not None else Path(directory) / f"{_column(table, choices.get('y'))}.png"
    check_place(place, *(f".{form}" for form in FORMATS))
    figure = _figure_of(table, directory, **choices)
    runs = [Path(run).name for run in table.loc[table["status"] == "finished", "run"]]
    return save_figure(figure, place, runs, place.suffix.lower()[1:], str(table.attrs["sweep"]))[0]


def sweep_figure(
    directory: str | Path,
    *,
    x: str | None = None,
    y: str | None = None,
    hue: str | None = None,
    panels: str | None = None,
    log: str = "",
    theory: bool = False,
) -> Figure:
    """Plot a sweep's table as a matplotlib figure.

    Parameters
    ----------
    directory
        A sweep's directory, such as ``runs/fig2``.
    x, hue, panels
        Keys that vary, such as ``drive.frequency`` or ``frequency``, or columns of the table (`walkers.load`);
        chosen automatically if None. ``none``: no colours or panels.
    y
        A column of the table; default: ``velocity``, for piles ``climbs``; on slopes where the walkers that face up and
        down differ, both.
    log
        Which axes are logarithmic: ``x``, ``y`` or ``xy``.
    theory
        Also draw the theory (`walkers.theory.prediction.predicted_column`).

    Returns
    -------
    Figure
        Means; bars are the scatter over copies where the table has it. The axis of a key has the unit of the sweep
        file; other columns are in mm, mm/s, g (9.8 m/s²) and degrees. A `LeftOutWarning` reports what is left out.

    Raises
    ------
    InputError
        If it is no sweep's directory, no point is finished, or there is no such column.
    """
    return _figure_of(load(directory), directory, x=x, y=y, hue=hue, panels=panels, log=log, theory=theory)


def _figure_of(
    table: pd.DataFrame, source: str | Path, *, y: str | None = None, log: str = "", theory: bool = False, **layout: Any
) -> Figure:
    """The figure of the table of a sweep; ``layout`` contains the arguments of `layout_of`."""
    column = _column(table, y)
    done = table[table["status"] == "finished"]
    counts = Counter(table["status"][table["status"] != "finished"])
    others = ", ".join(f"{number} {status}" for status, number in counts.items())
    if done.empty:
        raise refused(source, f"no point is finished ({others or 'there is none'})")
    if counts:
        _tell(f"{sum(counts.values())} of {len(table)} points left out: {others}")
    if empty := int(done[column].isna().sum()):
        _tell(f"{empty} of {len(done)} finished points have no {column}")
    laid_out = layout_of(table, done, **layout)
    if laid_out.undistinguished:
        _tell(f"not distinguished: {'; '.join(laid_out.undistinguished)}")
    predicted: dict[str, FloatArray] = {}
    reasons: dict[str, int] = {}
    gaps: dict[str, int] = {}
    cases: list[Case] = []
    if theory:
        from walkers.paper.published import outside_of_the_paper
        from walkers.theory.prediction import predicted_column

        cases = [case_of(Path(run)) for run in done["run"]]
        predicted, reasons = predicted_column(cases, column)
        for reason, number in reasons.items():
            _tell(f"not drawn at {number} of {len(done)} points: {reason}")
        if predicted and (beyond := [sentence for case in cases if (sentence := outside_of_the_paper(case))]):
            _tell(f"{len(beyond)} of {len(done)} points are {beyond[0]}" + (", …" if len(beyond) > 1 else ""))
    drawn = drawn_column(done, column, predicted, None if y else FACING_DOWN.get(column))
    if predicted:
        drawn = replace(drawn, curves=partial(_curves, done, cases, column, gaps))
    figure = draw(laid_out, drawn, title=table.attrs["title"], log=log)
    for reason in gaps.keys() - reasons.keys():
        _tell(f"the theory's curve has gaps: {reason}")
    return figure


def _curves(
    table: pd.DataFrame,
    cases: Sequence[Case],
    column: str,
    gaps: dict[str, int],
    rows: npt.NDArray[np.int64],
    x: Factor,
    places: FloatArray,
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Predictions of the theory between points, and their x; empty if they take too long. Adds reasons for ``gaps``.

    If x is no key, such as Γ0, the key that varies is changed. Each new shape of bridges takes a quarter of a second to
    solve.
    """
    from pandas.api.types import is_numeric_dtype

    from walkers.theory.prediction import predicted_column

    name, case, units = x.keys[0], cases[rows[0]], table.attrs["units"]
    varied, key, unit = varied_columns(table), name, x.unit
    if name not in varied:
        keys = [one for one in varied if table[one].iloc[rows].nunique() > 1]
        if len(keys) != 1 or name not in derived_of(case) or not is_numeric_dtype(table[keys[0]]):
            return places, {}
        key, unit = keys[0], units[keys[0]]
        low, high = (float(end) for end in table[key].iloc[rows].agg(["min", "max"]))
        places = np.linspace(low, high, len(places))
    if len(x.keys) > 1 or not case.document or key.endswith(_OF_SHAPE):
        return places, {}
    at: list[int] = []
    between: list[Case] = []
    for number, place in enumerate(places.tolist()):
        with suppress(InputError, ValueError):  # a value that no case may have
            value = f"{place!r} {unit}" if unit else place
            between.append(case.changed({key: value}))
            at.append(number)
    found: dict[str, FloatArray] = {}
    predicted, reasons = predicted_column(between, column) if between else ({}, {})
    gaps.update(reasons)
    for model, values in predicted.items():
        found[model] = np.full(len(places), np.nan)
        found[model][at] = values / readable_unit(units[column])[1]
    if key != name:
        size = readable_unit(units[name])[1]
        places = np.full(len(places), np.nan)
        places[at] = [derived_of(one)[name] / size for one in between]
    return places, found


def _column(table: pd.DataFrame, wanted: str | None) -> str:
    return find_name("y", wanted, table.columns) if wanted else default_column(table)


def _tell(message: str) -> None:
    warnings.warn(message, LeftOutWarning, stacklevel=4)
