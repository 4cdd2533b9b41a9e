"""Figures of sweeps, in Python and for ``walkers plot SWEEP``: the table and predictions of the theory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.postprocess.drawing import FORMATS, check_place, save_figure
from walkers.postprocess.results import derived
from walkers.runner.directory import case_of
from walkers.sweeps.figure import Curves, Factor, LeftOutWarning, column_of, figure_of, tell
from walkers.sweeps.figure_options import FigureOptions
from walkers.sweeps.readable import readable_unit
from walkers.sweeps.table import load, varied_columns

if TYPE_CHECKING:
    import numpy.typing as npt
    import pandas as pd
    from matplotlib.figure import Figure

    from walkers.theory.quasistatic import FloatArray

__all__ = ["LeftOutWarning", "plot_sweep", "sweep_figure"]
_OF_SHAPE = ("radii", "volume_fraction", "contact_angle")
"""Ends of the keys that change the shape of bridges, each of which takes a quarter of a second to solve."""


def plot_sweep(directory: str | Path, to: str | Path | None = None, options: FigureOptions = FigureOptions()) -> Path:
    """Plot a sweep's table to a file.

    Parameters
    ----------
    directory
        A sweep's directory, such as ``runs/fig2``.
    to
        The file, with a suffix of `walkers.postprocess.drawing.FORMATS`; None: in the sweep's directory, named after
        its column.
    options
        See `sweep_figure`.

    Raises
    ------
    InputError
        As `sweep_figure`, or if the suffix of the file is unknown.
    """
    table = load(directory)
    place = Path(to) if to is not None else Path(directory) / f"{column_of(table, options.y)}.png"
    check_place(place, *(f".{form}" for form in FORMATS))
    figure = figure_of(table, options, _models if options.theory else None)
    runs = [Path(run).name for run in table.loc[table["status"] == "finished", "run"]]
    return save_figure(figure, place, runs, place.suffix.lower()[1:], str(table.attrs["sweep"]))[0]


def sweep_figure(directory: str | Path, options: FigureOptions = FigureOptions()) -> Figure:
    """Plot a sweep's table as a matplotlib figure.

    Parameters
    ----------
    directory
        A sweep's directory, such as ``runs/fig2``.
    options
        What is drawn. x, hue and panels are chosen automatically if None. Without y, on slopes where the walkers that
        face up and down differ, both are drawn. The theory is `walkers.theory.prediction.predicted_column`.

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
    return figure_of(load(directory), options, _models if options.theory else None)


def _models(done: pd.DataFrame, column: str) -> tuple[Mapping[str, FloatArray], Curves | None]:
    """Predictions of the theory for the points (SI units), and a function that gives them between the points."""
    from walkers.paper.published import outside_of_the_paper
    from walkers.theory.prediction import predicted_column

    cases = [case_of(Path(run)) for run in done["run"]]
    predicted, reasons = predicted_column(cases, column)
    for reason, number in reasons.items():
        tell(f"not drawn at {number} of {len(done)} points: {reason}")
    if predicted and (beyond := [sentence for case in cases if (sentence := outside_of_the_paper(case))]):
        tell(f"{len(beyond)} of {len(done)} points are {beyond[0]}" + (", …" if len(beyond) > 1 else ""))

    def curves(rows: npt.NDArray[np.int64], x: Factor, places: FloatArray) -> tuple[FloatArray, dict[str, FloatArray]]:
        along, between = _between(done.iloc[rows], cases[rows[0]], x, places)
        found, gaps = predicted_column(between, column) if between else ({}, {})
        for reason in gaps.keys() - reasons.keys():
            tell(f"the theory's curve has gaps: {reason}")
        size = readable_unit(done.attrs["units"][column])[1]
        return along, {model: values / size for model, values in found.items()}

    return predicted, curves if predicted else None


def _between(rows: pd.DataFrame, case: Case, x: Factor, places: FloatArray) -> tuple[FloatArray, Sequence[Case]]:
    """Cases at places between points that differ in one key, and their x; none if they take too long.

    If x is no key, such as Γ0, the key that varies is changed.
    """
    (key, *further), units, known = x.keys, rows.attrs["units"], varied_columns(rows)
    if key not in known:
        moving = [name for name in known if rows[name].nunique() > 1]
        if len(moving) != 1 or key not in derived(case) or rows[moving[0]].dtype.kind not in "if":
            return places, []
        (key,) = moving
        places = np.linspace(rows[key].min(), rows[key].max(), len(places))
    if further or not case.document or key.endswith(_OF_SHAPE):
        return places, []
    cases: dict[float, Case] = {}
    for place in places.tolist():
        with suppress(InputError, ValueError):  # a value that no case may have
            cases[place] = case.changed({key: f"{place!r} {units[key]}" if units[key] else place})
    along = list(cases)
    if key != x.keys[0]:
        along = [derived(one)[x.keys[0]] / readable_unit(units[x.keys[0]])[1] for one in cases.values()]
    return np.array(along), list(cases.values())
