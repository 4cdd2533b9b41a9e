"""Tables of the documentation that come from simulations, and their cells as numbers that sentences may quote."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

_PARTS = {"on plain walls": "on_plain_walls", "in corners": "in_corners", "out of the pile": "out_of_pile"}
_OF_TRAYS = ["merged", "parted", "clustered_share", "largest_cluster", "slow_share", "nematic_order", "speed_ratio"]


def climbs_of(climbs: Mapping[str, Any]) -> dict[str, str]:
    """Statistics of climbs in one condition as texts; rates in 1/s with their 95 % interval."""

    def rate(part: Mapping[str, Any]) -> str:
        if part["rate"] is None:
            return "–"
        low, high = part["rate_interval"]
        return f"{part['rate']:.2g} ({low:.2g} to {high:.2g})"

    def between(values: Sequence[float], factor: float = 1.0) -> str:
        return f"{factor * min(values):.2g} to {factor * max(values):.2g}" if values else "–"

    return {
        "pile": climbs["condition"] or "usual",
        "climbed": f"{climbs['climbed']} of {climbs['runs']}",
        "within (s)": f"{climbs['within']:.3g}",
        "half by (s)": "–" if climbs["median"] is None else f"{climbs['median']:.2g}",
        "climbs": f"{climbs['climbs']}",
        "rate": rate(climbs),
        **{words: rate(climbs[part]) for words, part in _PARTS.items()},
        "led by large": f"{climbs['led_by_large']} of {climbs['climbs']}",
        "large beads (%)": f"{100.0 * climbs['share_of_large']:.0f}",
        "p by chance": "–" if climbs["p_among_beads"] is None else f"{max(climbs['p_among_beads'], 2e-4):.2g}",
        "beads": between(climbs["sizes"]),
        "speed (mm/s)": between(climbs["speeds"], 1e3),
        "median speed (mm/s)": f"{1e3 * np.median(climbs['speeds']):.2g}" if climbs["speeds"] else "–",
    }


def means_of_trays(table: pd.DataFrame) -> list[dict[str, str]]:
    """Means ± standard deviations over the seeds of the sweep `tray-phases`, and the sums of the meetings."""
    percent = (100.0 * table["coverage"]).round()
    seeds = table.groupby([table["walkers"], percent, table["drive.peak_acceleration"]])[_OF_TRAYS]
    texts = (seeds.mean().map("{:.2g}".format) + " ± " + seeds.std().map("{:.2g}".format)).replace("nan ± nan", "–")
    rows = [
        {"tray": "{} walkers, {:g} % covered, {:g} g".format(*key), **row} for key, row in texts.T.to_dict().items()
    ]
    sums = table[_OF_TRAYS[:2]].sum().astype(int).map(str).to_dict()
    return [*rows, {"tray": "all", **dict.fromkeys(_OF_TRAYS, "–"), **sums}]


def page(command: str, rows: Sequence[Mapping[str, str]]) -> str:
    """A page with a table, below the command that prints its numbers."""
    lines = [list(rows[0]), ["---"] * len(rows[0]), *(list(row.values()) for row in rows)]
    return "\n".join([f"# {command}", "", *(f"| {' | '.join(line)} |" for line in lines), ""])


def cells(folder: Path) -> Iterator[tuple[str, str]]:
    """Names and texts of all cells of the pages that `page` wrote: of the file, the row and the column."""
    for file in sorted(folder.glob("*.md")):
        lines = [
            line.strip("| ").split(" | ") for line in file.read_text("utf-8").splitlines() if line.startswith("| ")
        ]
        for row in lines[2:] if file.read_text("utf-8").startswith("# walkers ") else ():
            yield from ((_name(file.stem, row[0], column), text) for column, text in zip(lines[0], row, strict=True))


def _name(*words: str) -> str:
    return "_".join(re.findall(r"\w+", " ".join(words).lower()))
