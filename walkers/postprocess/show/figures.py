"""Figures of one run, drawn from the columns of its tables: walks, gaits, paths on trays, climbs.

`FIGURES` lists their panels by names of columns; labels and units are those of the quantities. The
figures of sweeps are in `walkers.sweeps.figure`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray, IntArray
from walkers.errors import input_error
from walkers.inputs.tables.bodies import Walkers
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

Tables = Callable[[str], Columns]
"""The tables of a run: their columns by the name of the table."""
Look = dict[str, Any]
"""The look of a line: keyword arguments of `matplotlib.axes.Axes.plot`."""


@dataclass(frozen=True)
class Panel:
    """A plot of columns of a table.

    Attributes
    ----------
    table
        Name of the table.
    x
        Column of the abscissa.
    y
        Columns of the ordinate; ``rotation_*`` stands for the rotations of all beads.
    title
        The title; words in braces are filled in by the function that draws the figure.
    lines
        Column whose values tell which rows form a line; empty if each column is one line.
    height
        Height, inches.
    """

    table: str
    x: str
    y: tuple[str, ...]
    title: str
    lines: str = ""
    height: float = 1.6


FIGURES: Mapping[str, Sequence[Panel]] = {
    "walk": (
        Panel(
            table="cycles",
            x="time",
            y=("distance",),
            lines="walker",
            title="Distance {direction} since settling (grey)",
        ),
        Panel(
            table="cycles",
            x="time",
            y=("orientation",),
            lines="walker",
            title="Angle to {reference}",
        ),
        Panel(
            table="cycles",
            x="along",
            y=("across",),
            lines="walker",
            title="Paths of the centres of mass, {seen}",
        ),
    ),
    "gait": (
        Panel(
            table="trajectory",
            x="cycle",
            y=("velocity", "rotation_*"),
            title=(
                "Walker {number}; a bead rolls without sliding where its curve coincides "
                "with the walker's"
            ),
            height=3.2,
        ),
    ),
    "paths": (
        Panel(
            table="trajectory",
            x="x",
            y=("y",),
            lines="walker",
            title="Paths seen from above; circles: start; beads at the end, to scale",
        ),
    ),
    "climb": (
        Panel(
            table="members",
            x="time",
            y=("height",),
            lines="track",
            title="Clusters' leaders",
            height=3.2,
        ),
        Panel(
            table="bed",
            x="time",
            y=("brazil_nut", "brazil_nut_of_bulk"),
            title="Segregation: (z of large − z of small) / their sum",
        ),
        Panel(
            table="bed",
            x="time",
            y=("bridges", "contacts"),
            title="Bridges and contacts with other beads",
        ),
    ),
}
"""The panels of each figure, from top to bottom."""
MOST_NAMED = 12
"""Largest number of lines in a legend."""
_SMALLEST_RANGES = {"m": 0.1, "rad": 0.1, "m/s": 0.01}
"""Smallest ranges of axes by the unit of the column, in the units of the axes: mm, ° and mm/s.
Otherwise rounding errors would look like motion."""
_TITLE_LETTERS = 100
"""Letters of a line of the title."""
_LABEL_LETTERS = 13
"""Letters of a line of the label of y, per inch of the height of its panel."""
_ASIDE = 10.0
"""Smallest angle at the start that a legend names, degrees."""
_INTERPOLATED = 10
"""Points of a smooth curve per interval between samples."""
_SAMPLES_BEFORE = 3
"""Samples before a smooth curve, which give its slope at the start."""
_GREY = "#5b6770"
"""Colour of surfaces, edges, events and starts."""
_PALE = "#b4bec5"
"""Colour of lines behind others."""
_NOT_CLIMBING = "#8d99a1"
"""Colour of clusters that did not climb."""
_DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)))
"""Styles of lines, which repeat."""
_MARKERS = "os^Dv"
"""Markers of lines, which repeat."""
_EVENT_MARKERS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""Markers of the events of clusters."""


def figures_of(results: Results) -> dict[str, Figure]:
    """The figures of a run by the names of their files, drawn from its tables."""
    case = case_of(results.directory)
    tables = results.columns
    figures = {}
    if case.walkers:
        figures["walk"] = walk_figure(case, tables)
        resolves_cycles = case.run.samples_per_cycle >= LEAST_SAMPLES
        if resolves_cycles and tables("trajectory")["cycle"].max() >= 2.0:
            figures["gait"] = gait_figure(case, tables)
    if case.meets:
        figures["paths"] = paths_figure(case, tables)
    if case.loose and case.boundary.closed:
        figures["climb"] = climb_figure(case, tables)
    return figures


def plot_run(
    directory: Path, destination: Path | None = None, formats: str | Sequence[str] = ("png",)
) -> list[Path]:
    """Draw the figures of a run, ``walk``, ``gait``, ``paths`` or ``climb``, into a folder.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The folder; None: the run directory.
    formats
        Formats of the files, of `walkers.postprocess.show.drawing.FORMATS`; commas may join several
        in one text.

    Returns
    -------
    list of Path
        The files, one for each figure and format.

    Raises
    ------
    InputError
        If a format does not exist, or the destination is the name of a picture.
    """
    formats = check_formats(formats)
    destination = destination or directory
    if destination.suffix.lower()[1:] in FORMATS and not destination.is_dir():
        raise input_error(destination, "expected a folder, because a run may have several figures")
    destination.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for name, figure in figures_of(read_results(directory)).items():
        written += save_figure(figure, destination / name, [directory.name], formats)
    return written


def line_styles(labels: Sequence[str]) -> list[Look]:
    """Looks of lines that differ with and without colours.

    Markers of lines that coincide are beside each other. Lines beyond `MOST_NAMED` are grey; the
    label of the first of them tells how many there are.

    Parameters
    ----------
    labels
        The label of each line.
    """
    looks: list[Look] = []
    for number, label in enumerate(labels[:MOST_NAMED]):
        look = {
            "label": label,
            "color": f"C{number}",
            "linestyle": _DASHES[number % len(_DASHES)],
            "linewidth": 0.9,
            "marker": _MARKERS[number % len(_MARKERS)],
            "mfc": "none",
            # A marker at every 12 % of the diagonal of the axes, shifted by 2 % from line to line.
            "markevery": (0.02 * (number % 6), 0.12),
        }
        looks.append(look)
    more = len(labels) - len(looks)
    for number in range(more):
        look = {"color": _PALE, "linewidth": 0.5, "zorder": 1.5, "rasterized": True}
        if number == 0:
            look["label"] = f"and {more} more"
        looks.append(look)
    return looks


def _draw_panel(
    axes: Axes, panel: Panel, title: str, columns: Columns, looks: Sequence[Look]
) -> None:
    """Draw a panel: a line, with its look, for each column of y and each value of ``lines``."""
    names = _columns_of_y(panel, columns)
    if panel.lines:
        line_of_row = columns[panel.lines]
    else:
        line_of_row = np.zeros(len(columns[panel.x]), dtype=np.int64)
    line_values = np.unique(line_of_row)
    x_label, x_factor = axis(panel.table, panel.x)
    for (name, line), look in zip(product(names, line_values), looks, strict=True):
        _, y_factor = axis(panel.table, name)
        rows = line_of_row == line
        axes.plot(x_factor * columns[panel.x][rows], y_factor * columns[name][rows], **look)
    y_label, _ = axis(panel.table, names[0])
    axes.set(xlabel=x_label, title=title)
    axes.set_ylabel("\n".join(wrap(y_label, round(_LABEL_LETTERS * panel.height))))
    x_limits = _widened(axes.dataLim.intervalx, declared(panel.x, panel.table).unit)
    if x_limits is not None:
        axes.set_xlim(*x_limits)
    y_limits = _widened(axes.dataLim.intervaly, declared(names[0], panel.table).unit)
    if y_limits is not None:
        axes.set_ylim(*y_limits)


def _columns_of_y(panel: Panel, columns: Columns) -> list[str]:
    """The names of the columns that a panel draws."""
    names: list[str] = []
    for pattern in panel.y:
        names += [name for name in columns if matches(pattern, name)]
    return names


def _widened(limits: npt.NDArray[Any], unit: str) -> npt.NDArray[Any] | None:
    """Limits of an axis that are as far apart as its unit needs; None if those given are."""
    smallest = _SMALLEST_RANGES.get(unit, 0.0)
    if not np.isfinite(limits).all() or np.ptp(limits) >= smallest:
        return None
    widened: npt.NDArray[Any] = limits.mean() + np.array([-0.5, 0.5]) * smallest
    return widened


def _draw_figure(
    name: str,
    case: Case,
    tables: Mapping[str, Columns],
    looks: Sequence[Sequence[Look]],
    words: Mapping[str, object],
) -> tuple[Figure, list[Axes]]:
    """Draw a figure of `FIGURES` without legends.

    Parameters
    ----------
    name
        Name of the figure.
    case
        The case, for the title.
    tables
        Columns by the names of their tables.
    looks
        The looks of the lines of each panel.
    words
        What stands in the titles of panels for the words in braces.

    Returns
    -------
    figure
        The figure.
    panels
        Its axes, one below the other.
    """
    heights = [panel.height for panel in FIGURES[name]]
    figure = new_figure(TWO_COLUMNS, sum(heights))
    grid = figure.subplots(nrows=len(heights), height_ratios=heights, squeeze=False)
    panels: list[Axes] = list(grid[:, 0])
    for axes, panel, panel_looks in zip(panels, FIGURES[name], looks, strict=True):
        title = panel.title.format(**words)
        _draw_panel(axes, panel, title, tables[panel.table], panel_looks)
    for upper, lower in pairwise(panels):
        if upper.get_xlabel() == lower.get_xlabel():
            upper.sharex(lower)
            upper.set_xlabel("")
            upper.tick_params(labelbottom=False)
    title_lines: list[str] = []
    for part in (case.title or case.name, *caption(case).split("; ")):
        title_lines += wrap(part, _TITLE_LETTERS)
    figure.suptitle(plain_text("\n".join(title_lines)))
    return figure, panels


def _add_legend(figure: Figure, panels: Sequence[Axes], title: str = "") -> None:
    """Add a legend of the lines of the first panel, and letters if there are several panels."""
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", title=title)
    if len(panels) > 1:
        letter_panels(panels)
    figure.align_ylabels()


@dataclass(frozen=True)
class _Starts:
    """How W walkers start.

    Attributes
    ----------
    direction : ndarray of int, shape (W,)
        1: in the positive direction of the drive axis, −1: opposite. Walkers that may meet have 1.
    angle : ndarray, shape (W,)
        Angle from this direction, rad.
    turn : ndarray, shape (W,)
        Angle in the table minus the angle from this direction, rad: 0 or ±π.
    """

    direction: IntArray
    angle: FloatArray
    turn: FloatArray


def _starts(case: Case, cycles: Columns, walkers: Columns) -> _Starts:
    """How walkers start, in the order of the table ``walkers``.

    The rows of cycle 0 in the table ``cycles`` have the same order.
    """
    angle = cycles["orientation"][cycles["cycle"] == 0]
    facing = walkers["facing"]
    direction = np.ones_like(facing) if case.meets else sides(facing, angle)
    turn = np.where(direction == facing, 0.0, np.copysign(np.pi, angle))
    return _Starts(direction, angle - turn, turn)


@styled
def walk_figure(case: Case, tables: Tables) -> Figure:
    """Draw distance, orientation and path from above of all walkers, once a cycle.

    Distances are along the heading, on slopes uphill. Orientations are from the direction that the
    legend names; those of walkers that may meet are from the drive axis.
    """
    uphill = case.goes_uphill
    walkers = tables("walkers")
    cycles = dict(tables("cycles"))
    starts = _starts(case, cycles, walkers)
    samples = len(cycles["cycle"]) // len(starts.turn)
    cycles["orientation"] = cycles["orientation"] - np.repeat(starts.turn, samples)
    settled_strobes = case.for_cycles(int(cycles["cycle"].max())).run.settled_strobes
    looks = line_styles(_walk_labels(case, walkers, starts))
    words = {
        "direction": "along the heading",
        "reference": "the starting direction that the legend names",
        "seen": "seen from above",
    }
    if uphill:
        words["direction"] = "uphill"
        along, across = cycles["along"], cycles["across"]
        cycles |= {"distance": along, "along": across, "across": along}
    # Each walker starts with a jump of its own, until its bridges have their shapes.
    at_settling = cycles["distance"].reshape(-1, samples)[:, settled_strobes]
    cycles["distance"] = cycles["distance"] - np.repeat(at_settling, samples)
    if case.meets:
        words["reference"] = "the drive axis"
    if case.boundary.tilted:
        words["seen"] = f"{case.boundary.tilted}, seen along its normal"
    figure, panels = _draw_figure("walk", case, {"cycles": cycles}, [looks] * 3, words)
    distance, orientation, paths = panels
    settled = cycles["time"][settled_strobes]
    for axes in (distance, orientation):
        axes.axvspan(0.0, float(settled), color="0.93", zorder=0)
        axes.set_xlim(left=0.0)
    if uphill:
        paths.invert_xaxis()  # left in the picture is to the left of a walker that goes up
        paths.set(xlabel="across the slope, to the left (mm)", ylabel="uphill (mm)")
        distance.set_ylabel("uphill (mm)")
    start_word = "angle" if case.meets else "facing"
    title = f"walker: {start_word} at the start,\nvelocity {words['direction']}"
    _add_legend(figure, panels, title)
    return figure


def _walk_labels(case: Case, walkers: Columns, starts: _Starts) -> list[str]:
    """Labels of walkers in the order of their numbers: start and mean velocity.

    ``starts`` has the rows of ``walkers``.
    """
    uphill = case.goes_uphill
    velocities = walkers["axial_velocity" if uphill else "velocity"]
    degrees = np.degrees(starts.angle)
    labels = []
    for row in np.argsort(walkers["walker"]):
        angle = f"{degrees[row]:.0f}°"
        forward, backward = direction_names(uphill=uphill)
        start = backward if starts.direction[row] < 0 else forward
        if case.meets:
            start = angle
        elif abs(degrees[row]) > _ASIDE:
            start += f" at {angle}"
        velocity = rounded(1e3 * velocities[row], "mm/s")
        labels.append(f"{walkers['walker'][row]}: {start}, {velocity} mm/s")
    return labels


@styled
def gait_figure(case: Case, tables: Tables) -> Figure:
    """Draw velocities of the first walker and of its beads in the last two cycles, smoothed.

    As Fig. 4 of Khan et al.
    """
    trajectory = tables("trajectory")
    walkers = tables("walkers")
    number = walkers["walker"][0]
    samples = 2 * case.run.samples_per_cycle + 1 + _SAMPLES_BEFORE
    last = np.flatnonzero(trajectory["walker"] == number)[-samples:]
    names = ["velocity"]
    names += [name for name in trajectory if matches("rotation_*", name)]
    names = [name for name in names if np.isfinite(trajectory[name][last]).all()]
    smooth = dict(_smooth({name: trajectory[name][last] for name in ("cycle", *names)}, "cycle"))
    smooth["cycle"] = smooth["cycle"] - (smooth["cycle"][-1] - 2.0)
    looks: list[Look] = []
    widths = np.linspace(6.0, 1.1, len(names))  # thinner lines lie upon thicker ones: all are seen
    for line, name in enumerate(names):
        label = declared(name, "trajectory").label
        mean = rounded(1e3 * walkers[name][0], "mm/s")
        look = {
            "color": f"C{line}" if line else _PALE,
            "linewidth": widths[line],
            "label": f"{label}\n(mean of the run {mean} mm/s)",
        }
        looks.append(look)
    words = {"number": number}
    figure, (axes,) = _draw_figure("gait", case, {"trajectory": smooth}, [looks], words)
    axes.axhline(0.0, color="0.4", lw=0.6)
    axes.axhline(
        1e3 * walkers["velocity"][0], color="0.4", lw=0.9, ls="--", label="mean velocity of the run"
    )
    axes.set_xlabel("time in the last two cycles (cycles)")
    axes.set_ylabel("velocity relative to the substrate;\nbeads: −R dφ/dt (mm/s)")
    axes.set_xlim(0.0, 2.02)
    _add_legend(figure, [axes])
    return figure


def _smooth(columns: Columns, x: str) -> Columns:
    """Columns at more places between samples, by cubic interpolation that does not overshoot."""
    places = columns[x]
    parts = np.arange(_INTERPOLATED * (len(places) - 1) + 1) / _INTERPOLATED
    dense = np.interp(parts, np.arange(len(places)), places)
    return {name: _interpolated(places, values, dense) for name, values in columns.items()}


_NO_WEIGHT = 1e-9
"""Largest sum of weights, over the largest one, that counts as zero; as in SciPy."""


def _interpolated(
    places: npt.NDArray[Any], values: npt.NDArray[Any], dense: npt.NDArray[Any]
) -> npt.NDArray[Any]:
    """Values at dense places, by Akima's modified cubic interpolation.

    This is ``scipy.interpolate.Akima1DInterpolator(places, values, method="makima")(dense)``,
    without half a second for the import. The slope at a sample is a mean of the slopes of the
    intervals around it, weighted by how much the slopes change on the other side.

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
    changes_of_slope = np.abs(np.diff(slopes))
    size_of_slopes = 0.5 * np.abs(slopes[1:] + slopes[:-1])  # the modification of Akima's weights
    weight_terms = changes_of_slope + size_of_slopes
    before = weight_terms[2:]  # weight of the interval before a sample
    after = weight_terms[:-2]  # weight of the interval after a sample
    weights = before + after
    mean = 0.5 * (slopes[3:] + slopes[:-3])  # where all slopes around a sample are zero
    is_curved = weights > _NO_WEIGHT * weights.max(initial=-np.inf)
    weighted = before * slopes[1:-2] + after * slopes[2:-1]
    tangents = np.where(is_curved, weighted / np.where(is_curved, weights, 1.0), mean)
    interval = np.clip(np.searchsorted(places, dense, side="right") - 1, 0, len(steps) - 1)
    step = steps[interval]
    start = values[interval]
    slope = slopes[2:-2][interval]
    first = tangents[:-1][interval]
    second = tangents[1:][interval]
    offset = dense - places[interval]
    cubic = (first + second - 2.0 * slope) / step**2
    square = (3.0 * slope - 2.0 * first - second) / step
    smooth: npt.NDArray[Any] = start + offset * (first + offset * (square + offset * cubic))
    return smooth


@styled
def paths_figure(case: Case, tables: Tables) -> Figure:
    """Draw paths of walkers that may meet, with a point per cycle, and their beads at the end.

    In a container, the edge of its floor is drawn too.
    """
    trajectory = tables("trajectory")  # one walker after the other
    walkers = tables("walkers")
    count = len(walkers["walker"])
    x = trajectory["x"].reshape(count, -1)
    y = trajectory["y"].reshape(count, -1)
    angle = trajectory["orientation"].reshape(count, -1)
    once_per_cycle = slice(None, None, case.run.samples_per_cycle)
    x_per_cycle = x[:, once_per_cycle]
    y_per_cycle = y[:, once_per_cycle]
    columns = {
        "walker": np.repeat(walkers["walker"], x_per_cycle.shape[1]),
        "x": x_per_cycle.ravel(),
        "y": y_per_cycle.ravel(),
    }
    looks = line_styles([f"walker {number}" for number in range(count)])
    for look in looks:
        look |= {"marker": "", "linestyle": "-"}
    figure, (axes,) = _draw_figure("paths", case, {"trajectory": columns}, [looks], {})
    margin = 2.0 * max(kind.length for kind in case.walkers)
    aspect = (np.ptp(y) + margin) / (np.ptp(x) + margin)
    # Height for the legend and the labels, and for axes that are neither flat nor very high.
    figure.set_figheight(0.9 + 0.7 * TWO_COLUMNS * min(1.2, max(0.3, aspect)))
    axes.plot(1e3 * x[:, 0], 1e3 * y[:, 0], "o", color=_GREY, mfc="none", ms=2.5, mew=0.6)
    for row, number in enumerate(walkers["walker"]):
        kind = case.walkers[walkers["make"][row]]
        centre = [x[row, -1], y[row, -1]]
        places = _bead_places(case, kind, walkers["facing"][row], angle[row, -1]) + centre
        _draw_beads(axes, places, kind.radii, looks[number]["color"])
    if case.boundary.closed:
        _draw_edge(axes, case)
    axes.set_aspect("equal")
    axes.margins(0.08)
    _add_legend(figure, [axes])
    return figure


def _bead_places(case: Case, kind: Walkers, facing: int, angle: float) -> FloatArray:
    """Centres of the beads of a walker relative to its centre of mass, seen from above, m.

    Parameters
    ----------
    case
        The case, which gives the drive axis.
    kind
        The kind of walker, of n beads.
    facing
        1 or −1: the direction along the drive axis in which the walker was placed.
    angle
        Its orientation, rad.

    Returns
    -------
    ndarray, shape (n, 2)
        x and y of each bead.
    """
    design = np.array(kind.design)
    masses = np.array(kind.radii) ** 3
    place = facing * (design - masses @ design / masses.sum())
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    drive_axis = np.array(case.drive_axis)
    across_axis = np.cross([0.0, 0.0, 1.0], case.drive_axis)
    beads: FloatArray = place @ turn @ np.array([drive_axis, across_axis])[:, :2]
    return beads


def _draw_beads(axes: Axes, places: FloatArray, radii: Sequence[float], colour: str) -> None:
    """Draw beads (places and radii in m) as discs to scale into axes in mm."""
    from matplotlib.patches import Circle

    for place, radius in zip(places, radii, strict=True):
        axes.add_patch(Circle(1e3 * place, 1e3 * radius, fc=colour, ec="none", alpha=0.5))


def _draw_edge(axes: Axes, case: Case) -> None:
    """Draw the outline of a container: where the distance to its side walls is zero.

    The outline is that at half of its height, where neither the floor nor a rim is near. Side walls
    are upright; where those of a mesh lean, the outline is not that of the floor.
    """
    boundary = case.boundary
    # From side to side and a little beyond, in steps of a two-hundredth of the width. The middle of
    # a container is at the origin; the width of a mesh is twice its largest distance from there.
    edge = np.linspace(-0.55, 0.55, 221) * boundary.inner_width
    grid = np.stack(np.meshgrid(edge, edge, boundary.inner_height / 2.0), axis=-1)
    places = grid[:, :, 0]
    clearance = boundary.geometry.side_clearance(places.reshape(-1, 3))
    clearance = clearance.reshape(places.shape[:2])  # m
    axes.contour(1e3 * edge, 1e3 * edge, clearance, levels=[0.0], colors=[_GREY], linewidths=1.0)


@styled
def climb_figure(case: Case, tables: Tables) -> Figure:
    """Draw heights of clusters' leaders and of the surface, events, segregation, and bridges."""
    clusters = tables("clusters")
    members = _driven(tables("members"))
    bed = _driven(tables("bed"))
    leader_of_track = np.append(clusters["leader"], -1)
    is_leader = members["bead"] == leader_of_track[members["track"]]
    leaders = {name: values[is_leader] for name, values in members.items()}
    looks = [
        _leader_looks(clusters, np.unique(leaders["track"])),
        _two_lines("all beads", "bulk alone"),
        _two_lines("bridges", "contacts"),
    ]
    figure, panels = _draw_figure("climb", case, {"members": leaders, "bed": bed}, looks, {})
    heights, _, bridges_panel = panels
    _draw_surface(heights, bed)
    _draw_events(heights, _driven(tables("events")))
    bridges_panel.set_ylabel("number per bead")
    bridges_panel.axhline(0.0, color="0.4", lw=0.6)
    for axes in panels:
        axes.set_xlim(left=0.0)
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
    letter_panels(panels)
    figure.align_ylabels()
    return figure


def _driven(columns: Columns) -> Columns:
    """The rows of a table from the start of the drive on; before, the beads fall."""
    is_driven = columns["time"] >= 0.0
    return {name: values[is_driven] for name, values in columns.items()}


def _leader_looks(clusters: Columns, tracks: IntArray) -> list[Look]:
    """Looks of the leaders of tracks: coloured if they climbed, and at most `MOST_NAMED` named."""
    climbs = np.cumsum(clusters["climbed"])
    more = climbs[-1] - MOST_NAMED if len(climbs) else 0
    looks: list[Look] = []
    has_others = False
    for track in tracks:
        number = climbs[track]
        look: Look = {"color": _NOT_CLIMBING, "linewidth": 0.6}
        if clusters["climbed"][track]:
            look = {"color": f"C{number}", "linewidth": 1.6, "label": ""}
            if number <= MOST_NAMED:
                look["label"] = _climb_label(clusters, track)
            elif number == MOST_NAMED + 1:
                look["label"] = f"and {more} more climbs"
        elif not has_others:
            look["label"] = "clusters that\ndid not climb"
            has_others = True
        looks.append(look)
    return looks


def _climb_label(clusters: Columns, track: int) -> str:
    """What a legend says of a climb: size of the cluster, size class of its leader, speed."""
    leader = "large" if clusters["leader_large"][track] else "small"
    speed = clusters["speed"][track] * 1e3
    return f"{clusters['size'][track]} beads climb, led by a\n{leader} one: {speed:.1f} mm/s"


def _two_lines(first: str, second: str) -> list[Look]:
    """Looks of two lines with these labels."""
    return [
        {"color": "C0", "label": first},
        {"color": "C2", "linestyle": "--", "label": second},
    ]


def _draw_surface(axes: Axes, bed: Columns) -> None:
    """Draw the height of the surface of a pile: its median, and 10th to 90th percentile."""
    _, factor = axis("bed", "surface")
    low = factor * bed["surface_low"]
    median = factor * bed["surface"]
    high = factor * bed["surface_high"]
    label = "surface, 10th to\n90th percentile"
    axes.fill_between(bed["time"], low, high, color="0.85", lw=0, label=label, zorder=0)
    axes.plot(bed["time"], median, color=_GREY, label="surface, median", zorder=1)


def _draw_events(axes: Axes, events: Columns) -> None:
    """Mark the events of clusters at their times and heights."""
    for event, marker in _EVENT_MARKERS.items():
        rows = events["event"] == event
        if rows.any():
            axes.plot(
                events["time"][rows],
                1e3 * events["height"][rows],
                marker=marker,
                mfc="none",
                ls="none",
                color=_GREY,
                label=event,
            )
