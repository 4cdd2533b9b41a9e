"""What is plotted of a run, as panels with lines: drawn by matplotlib for print and by Bokeh in reports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.gait import averages, distance_walked, gait, walk, ways
from walkers.postprocess.motion import Group
from walkers.postprocess.slopes import fit_slopes
from walkers.postprocess.tables import Columns

MOST_NAMED = 12
"""Walkers, or climbs, that a legend names."""
MARKS = {"freed": "^", "split": "<", "merged": ">", "rejoined": "v", "detached": "x"}
"""How events are marked (`walkers.postprocess.clusters.Event`)."""
_FEWEST_SAMPLES = 8
"""Samples a cycle below which a gait shows nothing."""
_GREY, _OTHERS = "#5b6770", "#c78a2c"


@dataclass(frozen=True)
class Line:
    """A line, in the units of its panel.

    Attributes
    ----------
    x, y : ndarray, shape (K,)
    label
        In the legend; none if empty.
    colour
        Its number among the colours of a figure, or a colour.
    marker
        As matplotlib calls it; none if empty.
    width
        Points; 0 for marks alone.
    error
        Of each y; not drawn if None.
    """

    x: FloatArray
    y: FloatArray
    label: str = ""
    colour: int | str = 0
    marker: str = ""
    dashed: bool = False
    width: float = 1.1
    error: FloatArray | None = None


@dataclass(frozen=True)
class Panel:
    """A plot: its title, axes and lines.

    Attributes
    ----------
    title, x, y
        Of the plot and its axes.
    lines
        From the lowest to the uppermost.
    band
        Two lines of the same x, between which it is grey.
    settled
        Up to which x it is grey.
    log
        Whether y is logarithmic.
    """

    title: str
    x: str
    y: str
    lines: list[Line]
    band: tuple[Line, Line] | None = None
    settled: float = 0.0
    log: bool = False


def walk_panels(groups: list[Group]) -> list[Panel]:
    """Distance walked, orientation, and paths from above, of all walkers, once a cycle."""
    case = groups[0].case
    strobe, facing = case.run.samples_per_cycle, ways(uphill=case.goes_uphill)
    walked: list[Line] = []
    turned: list[Line] = []
    paths: list[Line] = []
    for group in groups:
        time, distance = distance_walked(group)
        settled = time[case.run.settled_strobes]
        slope, _ = fit_slopes(time[case.run.settled_strobes :], distance[case.run.settled_strobes :])
        way = (group.mass_centre[::strobe] - group.mass_centre[0]) * 1e3
        for place, walker in enumerate(group.walkers):
            number = walker.walker
            told = f"{number}: {facing[int(walker.facing < 0)]}, {slope[place] * 1e3:.3g} mm/s"
            look = (told if number < MOST_NAMED else "", number)
            walked.append(Line(time, distance[:, place] * 1e3, *look))
            turned.append(Line(time, np.degrees(group.orientation[::strobe, place]), *look))
            paths.append(Line(way[:, place] @ group.drive_axis, way[:, place] @ group.across_axis, *look))
    return [
        Panel("Distance along the heading; grey: settling", "time (s)", "distance walked (mm)", walked, None, settled),
        Panel("Orientation", "time (s)", "orientation ψ (°)", turned, None, settled),
        Panel("Paths of the mass centres, seen from above", "along the drive axis (mm)", "across it (mm)", paths),
    ]


def gait_panels(group: Group) -> list[Panel]:
    """Velocities of the first walker through its last two cycles (Fig. 4 of Khan et al.), and of the substrate.

    None if the run was sampled less than eight times a cycle.
    """
    samples, first = group.case.run.samples_per_cycle, group.walkers[0]
    if samples < _FEWEST_SAMPLES or len(group.time) <= 2 * samples:
        return []
    motion = gait(group)
    cycles = (len(group.time) - 1) // samples
    last = slice((cycles - 2) * samples, cycles * samples + 1)
    phase = group.time[last] * group.case.drive.frequency - (cycles - 2)
    shaken = group.motion.substrate_velocity[last] @ np.array(group.case.drive.direction)
    series = [("walker", motion.velocity[last, 0], walk(group).velocity[0], "s", "#c4473a")]
    marks = [("o", "#1a1a1a"), ("^", "#1f3b73"), ("v", "#3f7f93"), ("D", "#808080")]
    series += [
        (f"bead {bead + 1}", motion.rotation[last, 0, bead], mean, *marks[bead % len(marks)])
        for bead, mean in enumerate(averages(group).rotation[0])
    ]
    lines = [
        Line(phase, values * 1e3, f"{name} (mean {mean * 1e3:.2f} mm/s)", colour, marker)
        for name, values, mean, marker, colour in series
    ]
    x = "time (cycles of the drive), the last two"
    panels = [Panel(f"walker {first.walker}", x, "velocity; beads:\n−R dφ/dt (mm/s)", lines)]
    if np.any(shaken):  # faster than its walkers by far: in their panel it would make them all flat
        line = Line(phase, first.facing * shaken * 1e3, colour=_GREY, dashed=True)
        panels.append(Panel("substrate, positive as for the walker", x, "velocity\n(mm/s)", [line]))
    return panels


def pile_panels(tables: Mapping[str, Columns]) -> list[Panel]:
    """Heights of the clusters' leaders over the pile's surface with events, segregation, bridges, agitation.

    Of the tables of a pile (`walkers.postprocess.analysis.tables_of`).
    """
    bed, x = tables["bed"], "time from the begin of the drive (s)"
    time = bed["time"]

    def of_bed(name: str, label: str = "", colour: int | str = 0, *, dashed: bool = False, scale: float = 1.0) -> Line:
        return Line(time, scale * bed[name], label, colour, dashed=dashed)

    edge = [of_bed(f"surface_{side}", "surface, 10th to\n90th percentile", scale=1e3) for side in ("low", "high")]
    surface = of_bed("surface", "surface, median", _GREY, scale=1e3)
    agitation = Line(time, np.maximum(bed["mean_square_velocity"], 1e-12))
    return [
        Panel(
            "Clusters' leaders",
            x,
            "height (mm)",
            [surface, *_leaders(tables), *_events(tables["events"])],
            (edge[0], edge[1]),
        ),
        Panel(
            "Segregation: (z of large − z of small) / their sum",
            x,
            "Brazil-nut\nindex",
            [of_bed("brazil_nut", "all beads"), of_bed("brazil_nut_of_bulk", "bulk alone", 2, dashed=True)],
        ),
        Panel(
            "Bridges and contacts with other beads",
            x,
            "how many a bead,\nto other beads",
            [of_bed("bridges", "bridges"), of_bed("contacts", "contacts", 2, dashed=True)],
        ),
        Panel("Agitation, once a cycle", x, "mean square\nvelocity, strobed\n(m²/s²)", [agitation], log=True),
    ]


def _leaders(tables: Mapping[str, Columns]) -> Iterator[Line]:
    """The height of each cluster's leader, thick where it climbed."""
    clusters, members = tables["clusters"], tables["members"]
    named = np.cumsum(clusters["climbed"])
    for track, (climbed, leader) in enumerate(zip(clusters["climbed"], clusters["leader"], strict=True)):
        own = (members["track"] == track) & (members["bead"] == leader)
        leads, speed = "large" if clusters["leader_large"][track] else "small", clusters["speed"][track] * 1e3
        told = f"{clusters['size'][track]} beads climb, led by a\n{leads} one: {speed:.1f} mm/s"
        label = told if climbed and named[track] <= MOST_NAMED else ""
        colour, width = (2, 1.6) if climbed else (_OTHERS, 0.6)
        yield Line(members["time"][own], members["height"][own] * 1e3, label, colour, width=width)
    if len(named) and named[-1] > MOST_NAMED:
        nothing = np.empty(0)
        yield Line(nothing, nothing, f"and {named[-1] - MOST_NAMED} more climbs", 2, width=1.6)


def _events(events: Columns) -> Iterator[Line]:
    """A mark where something happened to a cluster, at the height of its leader."""
    for kind, marker in MARKS.items():
        these = events["event"] == kind
        if these.any():
            yield Line(events["time"][these], events["height"][these] * 1e3, kind, _GREY, marker, width=0.0)


def velocity_panel(groups: list[Group]) -> Panel:
    """The velocity of each walker with the standard error of its fit."""
    facing = ways(uphill=groups[0].case.goes_uphill)
    number, faced = (np.array([getattr(w, key) for one in groups for w in one.walkers]) for key in ("walker", "facing"))
    walks = [walk(one) for one in groups]
    velocity, error = (
        1e3 * np.concatenate([getattr(one, key) for one in walks]) for key in ("velocity", "standard_error")
    )
    lines = [
        Line(number[these], velocity[these], f"started facing {name}", colour, marker, width=0.0, error=error[these])
        for (way, colour, marker), name in zip(((1, 0, "o"), (-1, 1, "s")), facing, strict=True)
        if (these := faced == way).any()
    ]
    return Panel("Velocity of each walker, standard error of its fit", "number of the walker", "velocity (mm/s)", lines)
