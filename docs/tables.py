"""Tables of the documentation that come from simulations.

Each function makes the rows of a table from the table of a sweep. The cells of the written tables
are also numbers that sentences may quote (`cell_texts`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

_FRICTION = "contact.friction.bead_wall"
"""Key that varies in the sweeps of climbing clusters."""

_LIQUIDS = {"liquid.name": "{}", "contact.roughness.bead_wall": "{:g} um"}
"""Keys that identify the curves of these sweeps, with the forms of their values."""

_COUNTS_OF_TRAYS = ["merged", "parted"]
"""Columns of trays that are also summed over all runs."""

_COLUMNS_OF_TRAYS = [
    *_COUNTS_OF_TRAYS,
    "clustered_share",
    "largest_cluster",
    "slow_share",
    "nematic_order",
    "speed_ratio",
]
"""Columns of the table of trays."""

_MISSING = "–"
"""A cell without a number."""


def means_of_trays(table: pd.DataFrame) -> list[dict[str, str]]:
    """Means ± standard deviations over seeds, and sums of the meetings of walkers.

    Parameters
    ----------
    table
        The table of the sweep ``tray-phases``.

    Returns
    -------
    list of dict
        Texts by column, a row for each number of walkers, coverage and drive, and one for all runs.
    """
    percent = (100.0 * table["coverage"]).round()
    conditions = [table["walkers"], percent, table["drive.peak_acceleration"]]
    replicates = table.groupby(conditions)[_COLUMNS_OF_TRAYS]
    means = replicates.mean().map("{:.2g}".format)
    deviations = replicates.std().map("{:.2g}".format)
    texts = (means + " ± " + deviations).replace("nan ± nan", _MISSING)
    rows = []
    for (walkers, coverage, peak), row in texts.T.to_dict().items():
        tray = f"{walkers} walkers, {coverage:g} % covered, {peak:g} g"
        rows.append({"tray": tray, **row})
    total = {"tray": "all", **dict.fromkeys(_COLUMNS_OF_TRAYS, _MISSING)}
    for column in _COUNTS_OF_TRAYS:
        total[column] = str(int(table[column].sum()))
    return [*rows, total]


def least_frictions(table: pd.DataFrame) -> list[dict[str, str]]:
    """Friction above which clusters climb, and their largest velocity.

    The friction is interpolated between the last one at which a cluster goes down, and the next
    one of the sweep.

    Parameters
    ----------
    table
        The table of the sweep ``climb-liquids`` or ``climb-corner``.

    Returns
    -------
    list of dict
        Texts by column, a row for each liquid and roughness.
    """
    keys = [key for key in _LIQUIDS if key in table]
    rows = []
    for _, curve in table.groupby(keys, sort=False):
        points = curve.sort_values(_FRICTION)[[_FRICTION, "axial_velocity"]].dropna()
        friction, velocity = points.to_numpy().T
        last = np.flatnonzero(velocity <= 0.0)[-1]
        ends = slice(last, last + 2)
        least = np.interp(0.0, velocity[ends], friction[ends])
        values = [_LIQUIDS[key].format(curve[key].iloc[0]) for key in keys]
        row = {
            "cluster": ", ".join(values),
            "climbs from": f"{least:.2f}",
            "fastest (mm/s)": f"{1e3 * velocity.max():.2g}",
        }
        rows.append(row)
    return rows


def page(command: str, rows: Sequence[Mapping[str, str]]) -> str:
    """A page with a table, below the command that prints its numbers.

    Parameters
    ----------
    command
        The command, which becomes the title of the page.
    rows
        Texts by the heads of the columns.
    """
    heads = list(rows[0])
    return f"# {command}\n\n{markdown(heads, [list(row.values()) for row in rows])}"


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table of cells below heads."""
    lines = [heads, ["---"] * len(heads)]
    for row in rows:
        lines.append([_escaped(cell) for cell in row])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _escaped(cell: str) -> str:
    return cell.replace("|", "\\|").replace("\n", " ")


def cell_texts(folder: Path) -> Iterator[tuple[str, str]]:
    """The cells of all tables that `page` wrote.

    Parameters
    ----------
    folder
        The folder of the tables.

    Yields
    ------
    name : str
        Names of file, row and column in lower case, such as ``climb_corner_water_climbs_from``.
    text : str
        The cell.
    """
    for file in sorted(folder.glob("*.md")):
        text = file.read_text("utf-8")
        if not text.startswith(("# walkers ", "# python ")):
            continue
        lines = []
        for line in text.splitlines():
            if line.startswith("| "):
                lines.append(line.strip("| ").split(" | "))
        heads, _, *rows = lines
        for row in rows:
            for head, cell in zip(heads, row, strict=True):
                yield _name(file.stem, row[0], head), cell


def _name(*words: str) -> str:
    """The name of a number that a sentence may quote."""
    return "_".join(re.findall(r"\w+", " ".join(words).lower()))


def calibration_numbers(record: Mapping[str, Any]) -> dict[str, str]:
    """Numbers of a calibration that sentences may quote.

    Parameters
    ----------
    record
        The content of ``calibration.json``.

    Returns
    -------
    dict
        Texts by name: agreeing facts and values of each parameter set, intervals of the parameters,
        and the numbers that were predicted.
    """
    numbers = {"calibration_sets": str(record["number"])}
    for name, agree in record["agree"].items():
        numbers[_name("calibration", name)] = f"{agree} of {record['of']}"
        for row in record["observations"]:
            numbers[_name("calibration", name, row["name"])] = _short(row["numbers"][name])
    for name, interval in record["posterior"].items():
        numbers[_name("calibration", "posterior", name)] = _interval_text(interval)
    for row in record["observations"]:
        if row["predicted"]:
            numbers[_name("calibration", "predicted", row["name"])] = _interval_text(
                row["predicted"]
            )
    return numbers


def _interval_text(interval: Sequence[float]) -> str:
    """The median of an interval, and its ends; the interval has the lower end first."""
    low, median, high = map(_short, interval)
    return f"{median} ({low} to {high})"


def _short(number: float | None) -> str:
    return "no number" if number is None else f"{number:.3g}"
