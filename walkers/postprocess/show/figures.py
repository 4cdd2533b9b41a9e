"""Figures of runs, drawn by names of columns: walks, gaits, paths on trays, climbs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.errors import input_error
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.caption import caption
from walkers.postprocess.measure.motion import LEAST_SAMPLES
from walkers.postprocess.measure.quantities import axis, declared, matches
from walkers.postprocess.measure.results import Results, read_results
from walkers.postprocess.measure.sides import direction_names, sides
from walkers.postprocess.measure.tables import Columns
from walkers.postprocess.show.drawing import (
    FORMATS,
    TWO_COLUMNS,
    check_formats,
    letter_panels,
    new_figure,
    plain_text,
    save_figure,
    styled,
)
from walkers.rounding import rounded
from walkers.runner.run_directory import case_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Panel(NamedTuple):
    """A plot: table, x, y (several columns; ``rotation_*``: of all beads), column of the lines, title, inches high."""

    table: str
    x: str
    y: str
    by: str
    title: str
    height: float = 1.6


_ROLLS = "Walker {number}; a bead rolls without sliding where its curve coincides with the walker's"
_TRAY = "Paths seen from above; circles: start; beads at the end, to scale"
FIGURES: Mapping[str, Sequence[Panel]] = {
    "walk": (
        Panel("cycles", "time", "distance", "walker", "Distance {direction}; grey: settling"),
        Panel("cycles", "time", "orientation", "walker", "Orientation from {reference}"),
        Panel("cycles", "along", "across", "walker", "Paths of the centres of mass, {seen}"),
    ),
    "gait": (Panel("trajectory", "cycle", "velocity rotation_*", "", _ROLLS, 3.2),),
    "paths": (Panel("trajectory", "x", "y", "walker", _TRAY),),
    "climb": (
        Panel("members", "time", "height", "track", "Clusters' leaders", 3.2),
        Panel(
            "bed",
            "time",
            "brazil_nut brazil_nut_of_bulk",
            "",
            "Segregation: (z of large − z of small) / their sum",
        ),
        Panel("bed", "time", "bridges contacts", "", "Bridges and contacts with other beads"),
    ),
}
MOST_NAMED = 12  # lines in a legend
LEAST = {"m": 0.01, "rad": 0.1, "m/s": 0.01}
"""Smallest ranges of axes by unit, in mm, ° and mm/s, so that rounding errors do not look like motion."""
_LETTERS, _LETTERS_OF_AN_INCH = (
    100,
    13,
)  # letters of a line of a title; of a y label per inch of its panel
_ASIDE = 10.0  # smallest angle at the start (°) in a legend
_BETWEEN, _BEFORE = (
    10,
    3,
)  # points of a smooth curve between samples; samples before it, which give its slope
_GREY, _PALE, _OTHERS = "#5b6770", "#b4bec5", "#8d99a1"
_DASHES, _MARKERS = ("-", (0, (5, 1.5)), (0, (1, 1.2))), "os^Dv"
_MARKS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""Markers of the events of clusters."""
Tables = Callable[[str], Columns]


def figures_of(results: Results) -> dict[str, Figure]:
    """The figures of a run by the names of their files, drawn from its tables."""
    case, tables = case_of(results.directory), results.columns
    figures = {}
    if case.walkers:
        figures["walk"] = walk_figure(case, tables)
        if (
            case.run.samples_per_cycle >= LEAST_SAMPLES
            and tables("trajectory")["cycle"].max() >= 2.0
        ):
            figures["gait"] = gait_figure(case, tables)
    if case.meets:
        figures["paths"] = paths_figure(case, tables)
    if case.loose and case.boundary.closed:
        figures["climb"] = climb_figure(case, tables)
    return figures


def plot_run(
    directory: Path, destination: Path | None = None, formats: str | Sequence[str] = ("png",)
) -> list[Path]:
    """Draw the figures of a run, ``walk``, ``gait``, ``paths`` or ``climb``, into a folder, by default that of the run.

    `InputError` for formats that are not in `walkers.postprocess.show.drawing.FORMATS`, and for a
    picture's name as folder.
    """
    formats = check_formats(formats)
    destination = destination or directory
    if destination.suffix.lower()[1:] in FORMATS and not destination.is_dir():
        raise input_error(destination, "expected a folder, because a run may have several figures")
    destination.mkdir(parents=True, exist_ok=True)
    return [
        path
        for name, figure in figures_of(read_results(directory)).items()
        for path in save_figure(figure, destination / name, [directory.name], formats)
    ]


def _draw(axes: Axes, panel: Panel, columns: Columns, looks: Sequence[Mapping[str, Any]]) -> None:
    """Draw a panel: a line with its look for each column ``y`` and each value of ``by``."""
    x_label, x_factor = axis(panel.table, panel.x)
    names = [name for part in panel.y.split() for name in columns if matches(part, name)]
    series = columns[panel.by] if panel.by else np.zeros(len(columns[panel.x]), dtype=np.int64)
    lines = [(name, series == value) for name in names for value in np.unique(series)]
    for (name, rows), look in zip(lines, looks, strict=True):
        factor = axis(panel.table, name)[1]
        given = {"label": declared(name, panel.table).label} if len(names) > 1 else {}
        axes.plot(
            x_factor * columns[panel.x][rows], factor * columns[name][rows], **{**given, **look}
        )
    axes.set(xlabel=x_label, title=panel.title)
    axes.set_ylabel(
        "\n".join(wrap(axis(panel.table, names[0])[0], round(_LETTERS_OF_AN_INCH * panel.height)))
    )
    for name, limits, widen in (
        (panel.x, axes.dataLim.intervalx, axes.set_xlim),
        (names[0], axes.dataLim.intervaly, axes.set_ylim),
    ):
        least = LEAST.get(declared(name, panel.table).unit, 0.0)
        if np.isfinite(limits).all() and np.ptp(limits) < least:
            widen(*(limits.mean() + np.array([-0.5, 0.5]) * least))


def line_styles(labels: Sequence[str]) -> list[dict[str, Any]]:
    """Looks of lines, told apart with and without colours; those beyond `MOST_NAMED` are grey, and say how many.

    Markers of lines that coincide are beside each other.
    """
    looks: list[dict[str, Any]] = [
        {
            **{
                "label": label,
                "color": f"C{number}",
                "linestyle": _DASHES[number % len(_DASHES)],
                "linewidth": 0.9,
            },
            **{
                "marker": _MARKERS[number % len(_MARKERS)],
                "mfc": "none",
                "markevery": (0.02 * (number % 6), 0.12),
            },
        }
        for number, label in enumerate(labels[:MOST_NAMED])
    ]
    more = len(labels) - len(looks)
    grey = {"color": _PALE, "linewidth": 0.5, "zorder": 1.5, "rasterized": True}
    return looks + [
        grey | ({} if number else {"label": f"and {more} more"}) for number in range(more)
    ]


def _panels(
    name: str,
    case: Case,
    tables: Mapping[str, Columns],
    looks: Sequence[Sequence[Mapping[str, Any]]],
    **words: object,
) -> tuple[Figure, list[Axes]]:
    """A figure of `FIGURES`, whose titles have the words, with panels one below the other and no legends."""
    heights = [panel.height for panel in FIGURES[name]]
    figure = new_figure(TWO_COLUMNS, sum(heights))
    grid = figure.subplots(nrows=len(heights), height_ratios=heights, squeeze=False)
    panels = list(grid[:, 0])
    for axes, panel, look in zip(panels, FIGURES[name], looks, strict=True):
        _draw(axes, panel._replace(title=panel.title.format(**words)), tables[panel.table], look)
    for upper, lower in pairwise(panels):
        if upper.get_xlabel() == lower.get_xlabel():
            upper.sharex(lower)
            upper.set_xlabel("")
            upper.tick_params(labelbottom=False)
    title = [
        line
        for part in (case.title or case.name, *caption(case).split("; "))
        for line in wrap(part, _LETTERS)
    ]
    figure.suptitle(plain_text("\n".join(title)))
    return figure, panels


def _explained(figure: Figure, panels: Sequence[Axes], title: str = "") -> Figure:
    """The figure with letters and a legend of the lines of its first panel."""
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", title=title)
    letter_panels(panels if len(panels) > 1 else ())
    figure.align_ylabels()
    return figure


@styled
def walk_figure(case: Case, tables: Tables) -> Figure:
    """Distance along the heading, on slopes uphill, orientation, and paths from above, of all walkers, once a cycle.

    Orientations are from the direction that the legend names; those of walkers that may meet are from the drive axis.
    """
    cycles, walkers, uphill = tables("cycles"), tables("walkers"), case.goes_uphill
    start = cycles["orientation"][cycles["cycle"] == 0]
    side = np.ones_like(walkers["facing"]) if case.meets else sides(walkers["facing"], start)
    turned = np.where(side == walkers["facing"], 0.0, np.copysign(np.pi, start))
    cycles = cycles | {
        "orientation": cycles["orientation"]
        - np.repeat(turned, len(cycles["cycle"]) // len(turned))
    }
    labels = []
    for row in np.argsort(walkers["walker"]):
        degrees, side_way = (
            np.degrees(start - turned)[row],
            direction_names(uphill=uphill)[int(side[row] < 0)],
        )
        aside = f"{side_way} at {degrees:.0f}°" if abs(degrees) > _ASIDE else side_way
        velocity = rounded(1e3 * walkers["axial_velocity" if uphill else "velocity"][row], "mm/s")
        labels.append(
            f"{walkers['walker'][row]}: {f'{degrees:.0f}°' if case.meets else aside}, {velocity} mm/s"
        )
    direction = "uphill" if uphill else "along the heading"
    if uphill:
        names = {"distance": "along", "along": "across", "across": "along"}
        cycles |= {name: cycles[column] for name, column in names.items()}
    reference = "the drive axis" if case.meets else "the direction that the legend names"
    seen = (
        f"{case.boundary.tilted}, seen along its normal"
        if case.boundary.tilted
        else "seen from above"
    )
    words = {"direction": direction, "reference": reference, "seen": seen}
    figure, panels = _panels("walk", case, {"cycles": cycles}, [line_styles(labels)] * 3, **words)
    settled = cycles["time"][case.for_cycles(int(cycles["cycle"].max())).run.settled_strobes]
    for axes in panels[:2]:
        axes.axvspan(0.0, float(settled), color="0.93", zorder=0)
    if uphill:
        panels[2].invert_xaxis()  # what is on the left is on the left of who goes up
        panels[2].set(xlabel="across the slope, to the left (mm)", ylabel="uphill (mm)")
        panels[0].set_ylabel("uphill (mm)")
    start_word = "angle" if case.meets else "facing"
    return _explained(figure, panels, f"walker: {start_word} at the start,\nvelocity {direction}")


@styled
def gait_figure(case: Case, tables: Tables) -> Figure:
    """Velocities of the first walker and of its beads in the last two cycles (Fig. 4 of Khan et al.), smooth."""
    trajectory, walkers = tables("trajectory"), tables("walkers")
    number = walkers["walker"][0]
    last = np.flatnonzero(trajectory["walker"] == number)[
        -2 * case.run.samples_per_cycle - 1 - _BEFORE :
    ]
    names = ["velocity", *(name for name in trajectory if matches("rotation_*", name))]
    names = [name for name in names if np.isfinite(trajectory[name][last]).all()]
    smooth = _smooth({name: trajectory[name][last] for name in ("cycle", *names)}, "cycle")
    widths, colours = np.linspace(6.0, 1.1, len(names)), [_PALE, *(f"C{n}" for n in range(1, 99))]
    looks = [
        {"color": colour, "linewidth": width}
        for colour, width in zip(colours, widths, strict=False)
    ]
    for look, name in zip(looks, names, strict=True):
        label, mean = declared(name, "trajectory").label, rounded(1e3 * walkers[name][0], "mm/s")
        look["label"] = f"{label}\n(mean of the run {mean} mm/s)"
    figure, (axes,) = _panels("gait", case, {"trajectory": smooth}, [looks], number=number)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.set_ylabel("velocity relative to the substrate;\nbeads: −R dφ/dt (mm/s)")
    axes.set_xlim(smooth["cycle"][-1] - 2.0, smooth["cycle"][-1] + 0.02)
    return _explained(figure, [axes])


def _smooth(columns: Columns, x: str) -> Columns:
    """Columns at more places between samples, by cubic interpolation that does not overshoot."""
    places = columns[x]
    parts = np.arange(_BETWEEN * (len(places) - 1) + 1) / _BETWEEN
    dense = np.interp(parts, np.arange(len(places)), places)
    return {name: _interpolated(places, values, dense) for name, values in columns.items()}


def _interpolated(
    places: npt.NDArray[Any], values: npt.NDArray[Any], dense: npt.NDArray[Any]
) -> npt.NDArray[Any]:
    """Values at dense places, by Akima's modified cubic interpolation.

    This is ``scipy.interpolate.Akima1DInterpolator(places, values, method="makima")(dense)``, without half a second
    for the import. The slope at a sample is a mean of the slopes of the intervals around it, weighted by how much the
    slopes change on the other side.

    Parameters
    ----------
    places, values : ndarray, shape (n,)
        Samples; places increase, and there are at least three.
    dense : ndarray, shape (m,)
        Places between the first and the last sample.

    Returns
    -------
    ndarray, shape (m,)
        The interpolated values.
    """
    steps = np.diff(places)
    slopes = np.empty(len(places) + 3)  # of the intervals, and of two more on each side
    slopes[2:-2] = np.diff(values) / steps
    slopes[1] = 2.0 * slopes[2] - slopes[3]
    slopes[0] = 2.0 * slopes[1] - slopes[2]
    slopes[-2] = 2.0 * slopes[-3] - slopes[-4]
    slopes[-1] = 2.0 * slopes[-2] - slopes[-3]
    changes = np.abs(np.diff(slopes)) + 0.5 * np.abs(slopes[1:] + slopes[:-1])
    before, after = (
        changes[2:],
        changes[:-2],
    )  # weights of the interval before a sample, and of that after it
    weights = before + after
    mean = 0.5 * (slopes[3:] + slopes[:-3])  # where all slopes around a sample are zero
    is_curved = weights > 1e-9 * weights.max(initial=-np.inf)
    weighted = before * slopes[1:-2] + after * slopes[2:-1]
    tangents = np.where(is_curved, weighted / np.where(is_curved, weights, 1.0), mean)
    interval = np.clip(np.searchsorted(places, dense, side="right") - 1, 0, len(steps) - 1)
    step, start = steps[interval], values[interval]
    slope, first, second = slopes[2:-2][interval], tangents[:-1][interval], tangents[1:][interval]
    offset = dense - places[interval]
    cubic = (first + second - 2.0 * slope) / step**2
    square = (3.0 * slope - 2.0 * first - second) / step
    smooth: npt.NDArray[Any] = start + offset * (first + offset * (square + offset * cubic))
    return smooth


@styled
def paths_figure(case: Case, tables: Tables) -> Figure:
    """Paths of walkers that may meet, once per cycle, with their beads at the end and the edge of the floor."""
    from matplotlib.patches import Circle

    trajectory, walkers = tables("trajectory"), tables("walkers")
    x, y, angle = (
        trajectory[name].reshape(len(walkers["walker"]), -1) for name in ("x", "y", "orientation")
    )
    strobe = slice(None, None, case.run.samples_per_cycle)
    columns = {"walker": np.repeat(walkers["walker"], x[:, strobe].shape[1])}
    columns |= {"x": x[:, strobe].ravel(), "y": y[:, strobe].ravel()}
    looks = [
        look | {"marker": "", "linestyle": "-"}
        for look in line_styles([f"walker {n}" for n in range(len(x))])
    ]
    reach = 2.0 * max(kind.length for kind in case.walkers)
    height = 0.7 * TWO_COLUMNS * min(1.2, max(0.3, (np.ptp(y) + reach) / (np.ptp(x) + reach)))
    figure, (axes,) = _panels("paths", case, {"trajectory": columns}, [looks])
    figure.set_figheight(0.9 + height)
    axes.plot(1e3 * x[:, 0], 1e3 * y[:, 0], "o", color=_GREY, mfc="none", ms=2.5, mew=0.6)
    drive, across = np.array(case.drive_axis), np.cross([0.0, 0.0, 1.0], case.drive_axis)
    for row, kind in enumerate(case.walkers[number] for number in walkers["make"]):
        place, weights = np.array(kind.design), np.array(kind.radii) ** 3
        place = walkers["facing"][row] * (place - weights @ place / weights.sum())
        turn = np.array(
            [
                [np.cos(angle[row, -1]), np.sin(angle[row, -1])],
                [-np.sin(angle[row, -1]), np.cos(angle[row, -1])],
            ]
        )
        beads = place @ turn @ np.array([drive, across])[:, :2] + [x[row, -1], y[row, -1]]
        for bead, radius in zip(beads, kind.radii, strict=True):
            colour = looks[walkers["walker"][row]]["color"]
            axes.add_patch(Circle(1e3 * bead, 1e3 * radius, fc=colour, ec="none", alpha=0.5))
    if case.boundary.closed:
        edge = np.linspace(-0.55, 0.55, 221) * case.boundary.inner_width
        places = np.stack(np.meshgrid(edge, edge, case.boundary.inner_height / 2.0), axis=-1)[
            :, :, 0
        ]
        inside = case.boundary.geometry.side_clearance(places.reshape(-1, 3)).reshape(
            places.shape[:2]
        )
        axes.contour(1e3 * edge, 1e3 * edge, inside, levels=[0.0], colors=[_GREY], linewidths=1.0)
    axes.set_aspect("equal")
    axes.margins(0.08)
    return _explained(figure, [axes])


@styled
def climb_figure(case: Case, tables: Tables) -> Figure:
    """Heights of the clusters' leaders and of the surface, events, segregation, and bridges."""
    clusters, members, bed = tables("clusters"), tables("members"), tables("bed")
    leads = members["bead"] == np.append(clusters["leader"], -1)[members["track"]]
    lines = {name: values[leads] for name, values in members.items()}
    named, looks = np.cumsum(clusters["climbed"]), []
    for track in np.unique(lines["track"]):
        leader, speed = (
            "large" if clusters["leader_large"][track] else "small",
            clusters["speed"][track] * 1e3,
        )
        text = f"{clusters['size'][track]} beads climb, led by a\n{leader} one: {speed:.1f} mm/s"
        look: dict[str, Any] = {"color": _OTHERS, "linewidth": 0.6}
        if clusters["climbed"][track]:
            look = {"color": f"C{named[track]}", "linewidth": 1.6, "label": text}
            if named[track] > MOST_NAMED:
                look["label"] = (
                    f"and {named[-1] - MOST_NAMED} more climbs"
                    if named[track] == MOST_NAMED + 1
                    else ""
                )
        looks.append(look)
    if not_climbing := [look for look in looks if "label" not in look]:
        not_climbing[0]["label"] = "clusters that\ndid not climb"
    two = [
        [{"color": "C0", "label": first}, {"color": "C2", "linestyle": "--", "label": second}]
        for first, second in (("all beads", "bulk alone"), ("bridges", "contacts"))
    ]
    figure, panels = _panels("climb", case, {"members": lines, "bed": bed}, [looks, *two])
    (leaders, _, joined), height = panels, axis("bed", "surface")[1]
    low, middle, high = (height * bed[name] for name in ("surface_low", "surface", "surface_high"))
    band = "surface, 10th to\n90th percentile"
    leaders.fill_between(bed["time"], low, high, color="0.85", lw=0, label=band, zorder=0)
    leaders.plot(bed["time"], middle, color=_GREY, label="surface, median", zorder=1)
    events = tables("events")
    for kind, marker in _MARKS.items():
        rows = events["event"] == kind
        if rows.any():
            look = {"marker": marker, "mfc": "none", "ls": "none", "color": _GREY, "label": kind}
            leaders.plot(events["time"][rows], 1e3 * events["height"][rows], **look)
    joined.set_ylabel("number per bead")
    joined.axhline(0.0, color="0.4", lw=0.6)
    for axes in panels:
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
    letter_panels(panels)
    figure.align_ylabels()
    return figure
