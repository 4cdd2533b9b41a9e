"""Tables of the documentation that come from simulations, and their cells as numbers that sentences may quote."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

_FRICTION = "contact.friction.bead_wall"
_LIQUIDS = {"liquid.name": "{}", "contact.roughness.bead_wall": "{:g} um"}
_OF_TRAYS = [
    "merged",
    "parted",
    "clustered_share",
    "largest_cluster",
    "slow_share",
    "nematic_order",
    "speed_ratio",
]


def means_of_trays(table: pd.DataFrame) -> list[dict[str, str]]:
    """Means ± standard deviations over the seeds of the sweep `tray-phases`, and the sums of the meetings."""
    percent = (100.0 * table["coverage"]).round()
    seeds = table.groupby([table["walkers"], percent, table["drive.peak_acceleration"]])[_OF_TRAYS]
    texts = (seeds.mean().map("{:.2g}".format) + " ± " + seeds.std().map("{:.2g}".format)).replace(
        "nan ± nan", "–"
    )
    rows = [
        {"tray": "{} walkers, {:g} % covered, {:g} g".format(*key), **row}
        for key, row in texts.T.to_dict().items()
    ]
    sums = table[_OF_TRAYS[:2]].sum().astype(int).map(str).to_dict()
    return [*rows, {"tray": "all", **dict.fromkeys(_OF_TRAYS, "–"), **sums}]


def least_frictions(table: pd.DataFrame) -> list[dict[str, str]]:
    """Friction above which clusters of the sweeps `climb-liquids` and `climb-corner` climb, and their largest velocity.

    It is interpolated between the last friction of the sweep at which they go down, and the next one.
    """
    rows = []
    for _, some in table.groupby([name for name in _LIQUIDS if name in table], sort=False):
        friction, speed = (
            some.sort_values(_FRICTION)[[_FRICTION, "axial_velocity"]].dropna().to_numpy().T
        )
        last = np.flatnonzero(speed <= 0.0)[-1]
        least = np.interp(0.0, speed[last : last + 2], friction[last : last + 2])
        cluster = ", ".join(
            text.format(some[name].iloc[0]) for name, text in _LIQUIDS.items() if name in some
        )
        rows.append(
            {
                "cluster": cluster,
                "climbs from": f"{least:.2f}",
                "fastest (mm/s)": f"{1e3 * speed.max():.2g}",
            }
        )
    return rows


def page(command: str, rows: Sequence[Mapping[str, str]]) -> str:
    """A page with a table, below the command that prints its numbers."""
    return f"# {command}\n\n{markdown(list(rows[0]), (list(row.values()) for row in rows))}"


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of Markdown."""
    cells = ([cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows)
    return (
        "\n".join(f"| {' | '.join(line)} |" for line in (heads, ["---"] * len(heads), *cells))
        + "\n"
    )


def cell_texts(folder: Path) -> Iterator[tuple[str, str]]:
    """Names and texts of all cells of the pages that `page` wrote: of the file, the row and the column."""
    for file in sorted(folder.glob("*.md")):
        lines = [
            line.strip("| ").split(" | ")
            for line in file.read_text("utf-8").splitlines()
            if line.startswith("| ")
        ]
        for row in (
            lines[2:] if file.read_text("utf-8").startswith(("# walkers ", "# python ")) else ()
        ):
            yield from (
                (_name(file.stem, row[0], column), text)
                for column, text in zip(lines[0], row, strict=True)
            )


def _name(*words: str) -> str:
    return "_".join(re.findall(r"\w+", " ".join(words).lower()))


def calibration_numbers(record: Mapping[str, Any]) -> dict[str, str]:
    """Numbers of ``calibration.json``: agreeing facts and values by set, intervals, and what was predicted."""
    numbers = {"calibration_sets": str(record["number"])}
    for name, agree in record["agree"].items():
        numbers[_name("calibration", name)] = f"{agree} of {record['of']}"
        for row in record["observations"]:
            numbers[_name("calibration", name, row["name"])] = _short(row["numbers"][name])
    intervals = {f"posterior {name}": ends for name, ends in record["posterior"].items()}
    intervals |= {
        f"predicted {row['name']}": row["predicted"]
        for row in record["observations"]
        if row["predicted"]
    }
    texts = {
        name: "{1} ({0} to {2})".format(*map(_short, ends)) for name, ends in intervals.items()
    }
    return numbers | {_name("calibration", name): text for name, text in texts.items()}


def _short(number: float | None) -> str:
    return "no number" if number is None else f"{number:.3g}"
