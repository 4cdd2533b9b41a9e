"""The figure and the table of docs/explanation/pile.md: climbs under several conditions.

The statistics of each sweep are in a file of their own, from which figure and table are made: only
sweeps whose piles have changed are run again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from walkers import sweep
from walkers.api import climb
from walkers.files import read_json, write_json
from walkers.postprocess.show.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.sweeps.climbing_output import draw_rates, draw_survival, texts_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Group:
    """Conditions that stand together in the panel of rates.

    Attributes
    ----------
    title
        What they have in common.
    labels
        Labels of the conditions of sweeps by the name of the sweep, in the order of its points.
    """

    title: str
    labels: Mapping[str, Sequence[str]]


_AS_SHIPPED = "Coulomb 0.5"
_GROWING = "0.28, growing"
GROUPS = (
    Group(
        "friction of walls and beads",
        {
            "pile-frictions": ("Coulomb 0.28", _GROWING),
            "pile-starts": (_AS_SHIPPED,),
            "pile-laws": ("Coulomb 0.35", "0.5 on walls, 0.28", "0.28, growing at 94 mm/s"),
        },
    ),
    Group("friction 0.5, other liquids", {"pile-liquids": ("ethylene glycol", "silicone oil AK5")}),
    Group("friction 0.5, another container", {"pile-cylinder": ("cylinder",)}),
)
"""The conditions of figure and table."""
SWEEPS = tuple(chain.from_iterable(group.labels for group in GROUPS))
"""The sweeps whose climbs are counted."""
_CURVES = {
    "Coulomb 0.28": "#9ecae1",
    "Coulomb 0.35": "#4292c6",
    _AS_SHIPPED: "#08519c",
    _GROWING: "#d95f02",
}
"""Colours of the curves of (a): the darker, the larger a friction of Coulomb's law."""
_WITH_BANDS = (_AS_SHIPPED, _GROWING)
"""The curves that are drawn with their 95 % bands."""
_COLUMNS = (
    "climbed",
    "half by (s)",
    "climbs",
    "rate",
    "on plain walls",
    "in corners",
    "dispersion",
    "led by large",
    "share led by large",
    "p by chance",
    "speed (mm/s)",
)
"""Columns of the table, of those of `walkers climb`."""

Statistics = dict[str, dict[str, Any]]
"""Results of `walkers.climb` by the labels of conditions."""


def file_of(name: str) -> str:
    """The file in docs/ with the statistics of a sweep."""
    return f"figures/{name}.json"


def write_statistics(name: str, out: Path, docs: Path) -> None:
    """Write the statistics of a sweep, which is run if it is not finished.

    Parameters
    ----------
    name
        Name of the sweep.
    out
        The folder of runs.
    docs
        The folder docs/.
    """
    conditions = climb([sweep(name, out).directory])
    for condition in conditions:
        del condition["each"]  # the climbs one by one
    write_json(docs / file_of(name), {"conditions": conditions})


def statistics_in(docs: Path) -> Statistics:
    """The statistics of all conditions, from the files of their sweeps."""
    statistics: Statistics = {}
    for group in GROUPS:
        for name, labels in group.labels.items():
            conditions = read_json(docs / file_of(name))["conditions"]
            statistics |= zip(labels, conditions, strict=True)
    return statistics


def rows_of(statistics: Statistics) -> list[dict[str, str]]:
    """The table: texts by column, a row for each condition."""
    rows = []
    for label, condition in statistics.items():
        texts = texts_of(condition)
        rows.append({"pile": label} | {column: texts[column] for column in _COLUMNS})
    return rows


@styled
def figure_of(statistics: Statistics) -> Figure:
    """Draw when piles of four frictions have climbed, and how often piles climb."""
    figure = new_figure(TWO_COLUMNS, 4.2)
    axes = figure.subplot_mosaic([["share", "rates"]], width_ratios=[1.0, 1.1])
    _draw_shares(axes["share"], statistics)
    _draw_rates(axes["rates"], statistics)
    letter_panels(axes.values())
    return figure


def _draw_shares(axes: Axes, statistics: Statistics) -> None:
    """The share of piles that have climbed against the time of the drive."""
    for label, colour in _CURVES.items():
        band = None
        if label in _WITH_BANDS:
            band = {"color": colour, "alpha": 0.15, "linewidth": 0.0}
        draw_survival(axes, statistics[label]["curve"], colour, band=band, label=label)
    axes.set(
        xlabel="time of the drive (s)",
        ylabel="share of piles that have climbed",
        xlim=(0.0, 10.0),
        ylim=(0.0, 1.02),
    )
    axes.legend(loc="upper left", title="friction")


def _draw_rates(axes: Axes, statistics: Statistics) -> None:
    """Rates with their exact intervals, one condition below the other, with a gap after groups."""
    places: list[float] = []
    ticks: list[str] = []
    place = 0.0
    for group in GROUPS:
        axes.text(0.0, place - 0.1, group.title, fontstyle="italic", va="center", ha="left")
        for labels in group.labels.values():
            for label in labels:
                place += 1.0
                places.append(place)
                ticks.append(label)
        place += 1.2
    draw_rates(axes, [statistics[label] for label in ticks], places)
    axes.set_yticks(places, ticks)
    axes.set(xlabel="climbs per pile and second", ylim=(place - 0.5, -0.7))
    axes.legend(loc="lower right")
