"""Figures of walkers and piles: panels with lines, drawn by matplotlib here and by Bokeh in reports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, plain_text, series_look, styled
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.gait import averages, distance_walked, fit_slopes, gait, walk
from walkers.postprocess.motion import Group
from walkers.postprocess.sides import sides, ways
from walkers.postprocess.tables import Columns

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_NAMED = 12  # walkers, or climbs, in a legend
_MARKS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""Markers of events (`walkers.postprocess.clusters.Event`)."""
_HEIGHT = 1.6  # height of a panel, inches
_LETTERS = 90  # letters of a line of a title
_LEAST_DISTANCE, _LEAST_ANGLE, _LEAST_SPEED = 0.01, 0.1, 0.01
"""Smallest ranges of axes in mm, ° and mm/s, so that rounding errors do not look like motion."""
_ASIDE, _WIDE = 10.0, 26  # smallest angle at the start (°) in a legend; letters of labels in three columns
_ALONG = "displacement along the drive axis (mm)"
_GREY, _PALE, _OTHERS = "#5b6770", "#b4bec5", "#c78a2c"


@dataclass(frozen=True)
class Line:
    """A line of K points in the units of its panel.

    ``colour`` is a number of a colour of the figure, or a colour; ``marker`` is one of matplotlib; a ``width`` (points)
    of 0 means markers alone.
    """

    x: FloatArray
    y: FloatArray
    label: str = ""
    colour: int | str = 0
    marker: str = ""
    dashed: bool = False
    width: float = 1.1


@dataclass(frozen=True)
class Panel:
    """A plot: title, labels of its axes, lines from bottom to top, and grey background intervals.

    ``band`` are two lines of the same x with grey between them, ``settled`` is the end of the grey interval of x,
    ``log`` is a logarithmic y axis, ``zero`` draws a line at y = 0, ``least`` is the smallest range of y, ``height`` is
    relative to other panels.
    """

    title: str
    x: str
    y: str
    lines: list[Line]
    band: tuple[Line, Line] | None = None
    settled: float = 0.0
    log: bool = False
    zero: bool = False
    height: float = 1.0
    least: float = 0.0

    @property
    def limits(self) -> tuple[float, float] | None:
        """Limits of y if its range is below the smallest range, otherwise None."""
        shown = [np.zeros(int(self.zero)), *(np.asarray(line.y)[np.isfinite(line.y)] for line in self.lines)]
        values = np.concatenate(shown)
        if not len(values) or np.ptp(values) >= self.least:
            return None
        middle = float(values.max() + values.min()) / 2.0
        return middle - self.least / 2.0, middle + self.least / 2.0


def nested_widths(count: int, largest: float = 3.0) -> list[float]:
    """Widths of lines (points), the lowest line first, so that coinciding lines are visible."""
    return [1.1] if count < 2 else np.linspace(min(1.1 + 2.2 * (count - 1), largest), 1.1, count).tolist()


def velocity_text(value: float) -> str:
    """A velocity (mm/s) as text with three digits and at most three decimals."""
    return "0" if round(value, 3) == 0.0 else f"{value:.3g}" if abs(value) >= 0.1 else f"{value:.3f}"


def walk_panels(groups: list[Group]) -> list[Panel]:
    """Distance along the heading, on slopes uphill, orientation, and paths from above, of all walkers, once a cycle.

    Orientations are from the direction that the legend names; those of walkers that may meet are from the drive axis.
    """
    case, uphill = groups[0].case, groups[0].case.goes_uphill
    strobe, settled, facing = case.run.samples_per_cycle, case.run.settled_strobes, ways(uphill=uphill)
    widths = nested_widths(sum(len(group.walkers) for group in groups))
    walked: list[Line] = []
    turned: list[Line] = []
    paths: list[Line] = []
    references: dict[str, None] = {}
    for group in groups:
        time, distance = distance_walked(group)
        if uphill:
            distance = (group.mass_centre[::strobe] - group.mass_centre[0]) @ group.drive_axis
        slope = fit_slopes(time[settled:], distance[settled:])
        way = (group.mass_centre[::strobe] - group.mass_centre[0]) * 1e3
        for place, walker in enumerate(group.walkers):
            number = walker.walker
            angles = np.degrees(group.orientation[::strobe, place])
            side = 1 if case.meets else int(sides(walker.facing, walker.start_angle))
            angles -= np.copysign(180.0, angles[0]) if side != walker.facing else 0.0
            at, named_side = f"{angles[0]:.0f}°", facing[int(side < 0)]
            start = at if case.meets else f"{named_side} at {at}" if abs(angles[0]) > _ASIDE else named_side
            references[named_side] = None
            text = f"{number}: {start}, {velocity_text(slope[place] * 1e3)} mm/s"
            look: dict[str, Any] = {"label": text if number < MOST_NAMED else "", "colour": number}
            look["width"] = widths[len(walked)]
            walked.append(Line(time, distance[:, place] * 1e3, **look))
            turned.append(Line(time, angles, **look))
            along, across = way[:, place] @ group.drive_axis, way[:, place] @ group.across_axis
            paths.append(Line(-across, along, **look) if uphill else Line(along, across, **look))
    begin, named = walked[-1].x[settled], named_of(len(walked))
    names = ("across the slope (mm)", "uphill (mm)") if uphill else (_ALONG, "across it (mm)")
    seen = f"{case.boundary.tilted}, seen along its normal" if case.boundary.tilted else "seen from above"
    toward = "uphill" if uphill else "along the heading"
    title, y = f"Distance {toward}; grey: settling{named}", f"distance\n{toward} (mm)"
    reference = f"orientation ψ from\n{'the drive axis' if case.meets else ' or '.join(references)} (°)"
    return [
        Panel(title, "time (s)", y, walked, settled=begin, least=_LEAST_DISTANCE),
        Panel(f"Orientation{named}", "time (s)", reference, turned, settled=begin, least=_LEAST_ANGLE),
        Panel(f"Paths of the centres of mass, {seen}{named}", *names, paths, least=_LEAST_DISTANCE),
    ]


def named_of(count: int) -> str:
    """Number of walkers that a legend names, if not all."""
    return f" ({MOST_NAMED} of {count} walkers named)" if count > MOST_NAMED else ""


def gait_panels(group: Group) -> list[Panel]:
    """Velocities of the first walker and of the substrate in the last two cycles (Fig. 4 of Khan et al.).

    No panels if the run has less than eight samples per cycle.
    """
    samples, first = group.case.run.samples_per_cycle, group.walkers[0]
    if not group.motion.follows_cycles or len(group.time) <= 2 * samples:
        return []
    motion = gait(group)
    cycles = (len(group.time) - 1) // samples
    last = slice((cycles - 2) * samples, cycles * samples + 1)
    phase = group.time[last] * group.case.excitation.frequency - (cycles - 2)
    names = ["walker", *(f"bead {bead + 1}" for bead in range(motion.rotation.shape[-1]))]
    values = 1e3 * np.column_stack([motion.velocity[last, 0], motion.rotation[last, 0]])
    means = 1e3 * np.array([walk(group).velocity[0], *averages(group).rotation[0]])
    labels = [f"{name} (mean of the run {velocity_text(mean)} mm/s)" for name, mean in zip(names, means, strict=True)]
    widths, colours = nested_widths(len(names), 6.0), [_PALE, *range(1, len(names))]
    lines = [
        Line(phase, values[:, number], labels[number], colours[number], width=widths[number])
        for number in range(len(names))
    ]
    x = "time (cycles of the drive, last two)"
    title = f"walker {first.walker}; a bead rolls without sliding where its curve coincides with the walker's"
    y = "velocity along the heading of the moment,\nrelative to the substrate; beads: −R dφ/dt (mm/s)"
    panels = [Panel(title, x, y, lines, zero=True, height=2.5, least=_LEAST_SPEED)]
    velocity, toward, named = group.motion.substrate_velocity[last], group.heading[last, 0], "along the same heading"
    if not velocity[:, :2].any():
        toward, named = np.array([0.0, 0.0, 1.0]), "along the normal of the floor"
    if velocity.any():  # much faster than the walkers, hence in a panel of its own
        line = Line(phase, (velocity * toward).sum(axis=-1) * 1e3, colour=_GREY, dashed=True)
        panels.append(
            Panel(f"velocity of the substrate {named}", x, "velocity\n(mm/s)", [line], zero=True, least=_LEAST_SPEED)
        )
    return panels


def pile_panels(tables: Mapping[str, Columns]) -> list[Panel]:
    """Heights of the clusters' leaders and of the surface, events, segregation, bridges and agitation.

    ``tables`` are those of a pile (`walkers.postprocess.analysis.tables_of`).
    """
    bed, x = tables["bed"], "time since the start of the drive (s)"
    time = bed["time"]
    surface = Line(time, 1e3 * bed["surface"], "surface, median", _GREY)
    low, high = (
        Line(time, 1e3 * bed[f"surface_{side}"], "surface, 10th to\n90th percentile") for side in ("low", "high")
    )
    leaders = [surface, *_leaders(tables), *_events(tables["events"])]
    panels = [Panel("Clusters' leaders", x, "height (mm)", leaders, (low, high), height=2.0)]
    segregation = {"brazil_nut": "all beads", "brazil_nut_of_bulk": "bulk alone"}
    joined = {"bridges": "bridges", "contacts": "contacts"}
    for title, y, columns in (
        ("Segregation: (z of large − z of small) / their sum", "Brazil-nut\nindex", segregation),
        ("Bridges and contacts with other beads", "number\nper bead", joined),
        (
            f"Mean square velocity, every {np.median(np.diff(time)):.3g} s",
            "mean square\nvelocity\n(m²/s²)",
            {"mean_square_velocity": ""},
        ),
    ):
        named = enumerate(columns.items())
        lines = [Line(time, bed[name], label, 2 * number, dashed=number > 0) for number, (name, label) in named]
        panels.append(Panel(title, x, y, lines, log=len(lines) == 1, zero=columns is joined))
    return panels


def _leaders(tables: Mapping[str, Columns]) -> Iterator[Line]:
    """Height of the leader of each cluster; thick lines, each of another colour, for climbs."""
    clusters, members = tables["clusters"], tables["members"]
    named = np.cumsum(clusters["climbed"])
    others = "clusters that\ndid not climb"
    for track, (climbed, leader) in enumerate(zip(clusters["climbed"], clusters["leader"], strict=True)):
        own = (members["track"] == track) & (members["bead"] == leader)
        leads, speed = "large" if clusters["leader_large"][track] else "small", clusters["speed"][track] * 1e3
        text = f"{clusters['size'][track]} beads climb, led by a\n{leads} one: {speed:.1f} mm/s"
        look: dict[str, Any] = {"colour": _OTHERS, "width": 0.6, "label": others}
        if climbed:
            look = {"colour": int(named[track]), "width": 1.6, "label": text if named[track] <= MOST_NAMED else ""}
        else:
            others = ""  # named once
        yield Line(members["time"][own], members["height"][own] * 1e3, **look)
    if len(named) and named[-1] > MOST_NAMED:
        nothing = np.empty(0)
        yield Line(nothing, nothing, f"and {named[-1] - MOST_NAMED} more climbs", _GREY, width=1.6)


def assembly_panels(tables: Mapping[str, Columns]) -> list[Panel]:
    """History of the beads of the first climb out of a pile, from rest until it qualifies.

    Heights, with thick lines while bridges join a bead to the others; numbers of beads that are joined, in the bulk,
    and at a wall. No panels if nothing climbed out of the pile.
    """
    clusters, past = tables["clusters"], tables["assembly"]
    first = np.flatnonzero(clusters["climbed"] & clusters["out_of_pile"])
    if not len(first):
        return []
    track = min(first, key=lambda number: float(clusters["qualified"][number]))
    own = {name: column[past["track"] == clusters["track"][track]] for name, column in past.items()}
    x, heights = "time since the start of the drive (s)", []
    for number, bead in enumerate(np.unique(own["bead"])):
        time, height, joined = (own[name][own["bead"] == bead] for name in ("time", "height", "joined"))
        leads = ", leads" if bead == clusters["leader"][track] else ""
        text = f"{'large' if own['large'][own['bead'] == bead][0] else 'small'} bead {bead}{leads}"
        heights.append(Line(time, 1e3 * height, "", number, width=0.6))
        heights.append(Line(time, 1e3 * np.where(joined, height, np.nan), text, number, width=2.0))
    times, at = np.unique(own["time"], return_inverse=True)
    counts = {"joined to most of them": "joined", "in the pile's bulk": "in_bulk", "at a side wall": "at_wall"}
    numbers = [
        Line(times, np.bincount(at, own[name]).astype(float), text, 2 * number, dashed=number > 0)
        for number, (text, name) in enumerate(counts.items())
    ]
    bed = tables["bed"]
    seen = (bed["time"] >= times[0]) & (bed["time"] <= times[-1])
    heights.insert(0, Line(bed["time"][seen], 1e3 * bed["surface"][seen], "surface of the pile", _GREY))
    return [
        Panel("Beads of the first climb; thick: joined to most of the others", x, "height (mm)", heights, height=2.0),
        Panel("Number of these beads that are", x, "beads", numbers, zero=True),
    ]


def _events(events: Columns) -> Iterator[Line]:
    """Markers of events of clusters at the height of the leader."""
    for kind, marker in _MARKS.items():
        these = events["event"] == kind
        if these.any():
            yield Line(events["time"][these], events["height"][these] * 1e3, kind, _GREY, marker, width=0.0)


@styled
def walk_figure(case: Case, panels: Sequence[Panel]) -> Figure:
    """Distance, orientation and paths of all walkers (`walk_panels`)."""
    figure, axes = new_figure(TWO_COLUMNS, 4.8, mosaic=[["walked", "turned"], ["paths", "paths"]])
    figure.suptitle(_title(case))
    for one, panel in zip(axes.values(), panels, strict=False):
        draw_panel(one, panel)
        one.set(xlabel=panel.x, title="grey: settling" if one is axes["walked"] else "")
        for number, line in enumerate(one.lines):
            # Markers of coinciding lines are next to each other.
            line.set(**series_look(number), markevery=(0.02 * (number % 6), 0.12), linewidth=0.9)
    axes["paths"].set_title(panels[2].title.removesuffix(named_of(len(panels[2].lines))))
    letter_panels(axes.values())
    lines, labels = axes["walked"].get_legend_handles_labels()
    start = "orientation from the drive axis" if case.meets else "facing"
    velocity = "velocity up the slope" if case.goes_uphill else "velocity along the heading"
    text = f"walker: {start} at the start, {velocity}{named_of(len(panels[0].lines))}"
    columns = 4 if max(map(len, labels)) < _WIDE else 3
    figure.legend(lines, labels, loc="outside lower center", ncols=columns, title=text)
    return figure


@styled
def stacked(panels: Sequence[Panel], case: Case) -> Figure:
    """Panels of a run one below the other, with legends on the right."""
    ratios = [panel.height for panel in panels]
    height = _HEIGHT * sum(ratios)
    figure, axes = new_figure(TWO_COLUMNS, height, nrows=len(panels), height_ratios=ratios, sharex=True, squeeze=False)
    figure.suptitle(_title(case))
    for one, panel in zip(axes[:, 0], panels, strict=True):
        draw_panel(one, panel)
        one.set_title(panel.title)
        if any(line.label for line in panel.lines):
            one.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), borderaxespad=0.0)
    axes[-1, 0].set_xlabel(panels[-1].x)
    letter_panels(axes[:, 0] if len(panels) > 1 else ())
    figure.align_ylabels()
    return figure


def draw_panel(axes: Axes, panel: Panel) -> None:
    """Draw a panel without title and legend."""
    for line in panel.lines:
        colour = f"C{line.colour}" if isinstance(line.colour, int) else line.colour
        look: dict[str, Any] = {"marker": line.marker, "mfc": "none"} if line.marker else {}
        dashes = "--" if line.dashed else "-"
        axes.plot(line.x, line.y, color=colour, lw=line.width, ls=dashes, label=line.label or None, **look)
    if panel.band:
        low, high = panel.band
        axes.fill_between(low.x, low.y, high.y, color="0.85", lw=0, label=low.label, zorder=0)
    if panel.settled:
        axes.axvspan(0.0, panel.settled, color="0.93", zorder=0)
    if panel.zero:
        axes.axhline(0.0, color="0.4", lw=0.6)
    if panel.log:
        axes.set_yscale("log", nonpositive="mask")
    if panel.limits:
        axes.set_ylim(panel.limits)
    axes.set_ylabel(panel.y)


def _title(case: Case) -> str:
    shown, gamma0 = f"{case.count} beads", ""
    if case.walkers and not case.loose:
        makes = [" / ".join(f"{radius * 1e3:g}" for radius in make.radii) for make in case.walkers]
        shown = f"R = {'; '.join(makes)} mm"
        if len(case.walkers[0].radii) == 2:
            gamma0 = f" ($\\Gamma_0$ = {dimer_of(case).gamma0(case.excitation.peak_acceleration):.3g})"
    tilted = f", {case.boundary.tilted}" if case.boundary.tilted else ""
    title = "\n".join(wrap(plain_text(case.title or case.name), _LETTERS))
    return f"{title}\n{shown}{tilted}, {case.excitation.described()}{gamma0}"
