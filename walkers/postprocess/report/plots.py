"""Interactive plots of a run (Bokeh): where walkers went and how fast, their gait; what a pile did."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.postprocess.analysis import analyses_of
from walkers.postprocess.gait import averages, distance_walked, gait, walk
from walkers.postprocess.motion import Group, read_motion
from walkers.postprocess.piles import PileAnalysis, analyse
from walkers.postprocess.posture import ways
from walkers.postprocess.tables import read_table
from walkers.runner.directory import case_of

if TYPE_CHECKING:
    from bokeh.models import Model
    from bokeh.plotting import figure as Figure  # noqa: N812

FloatArray = npt.NDArray[np.float64]

COLOURS = ("#b0203c", "#1f3b73", "#3f7f93", "#c78a2c", "#5b6770", "#7a4a8c", "#4c8c4a", "#1d2429")
_FEWEST_SAMPLES = 8
"""Samples a cycle below which a gait shows nothing."""
_MOST_WALKERS = 12
"""Of which each has a line of its own in a legend."""
_MOST_POINTS = 600
"""Of a line; what is longer is thinned out."""


def plots_of(directory: Path) -> Model | None:
    """The plots of a run, one below the other; None where there is nothing to plot."""
    from bokeh.layouts import column

    names = {one.name for one in analyses_of(case_of(directory))}
    panels: list[Figure] = []
    if "walking" in names:
        groups = read_motion(directory).groups
        panels += [_distances(groups), _paths(groups), _velocities(directory)]
        samples = groups[0].case.run.samples_per_cycle
        if samples >= _FEWEST_SAMPLES and len(groups[0].time) > 2 * samples:
            panels.append(_gait(groups[0]))
    if "pile" in names:
        panels += _pile(analyse(directory))
    return column(*panels, sizing_mode="stretch_width") if panels else None


def new_plot(title: str, x: str, y: str, *, height: int = 300, **options: Any) -> Figure:
    """An empty plot as wide as the page."""
    from bokeh.models.annotations import Title
    from bokeh.plotting import figure

    plot = figure(
        title=Title(text=title, text_font_size="14px"),
        x_axis_label=x,
        y_axis_label=y,
        height=height,
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save,hover",
        toolbar_location="right",
        **options,
    )
    plot.toolbar.logo = None
    plot.toolbar.active_scroll = None  # the wheel scrolls the page
    return plot


def with_legend(plot: Figure) -> Figure:
    """The plot with its legend beside it, by which lines can be hidden."""
    if plot.legend:
        plot.add_layout(plot.legend[0], "right")
        plot.legend.click_policy = "hide"
        plot.legend.label_text_font_size = "11px"
        plot.legend.spacing = 0
    return plot


def error_bars(plot: Figure, x: Sequence[Any] | FloatArray, y: FloatArray, error: FloatArray) -> None:
    """Whiskers of one standard error."""
    from bokeh.models import ColumnDataSource
    from bokeh.models.annotations import Whisker

    known = np.isfinite(error)
    columns: dict[str, Any] = {"x": np.asarray(x)[known], "low": (y - error)[known], "high": (y + error)[known]}
    plot.add_layout(Whisker(source=ColumnDataSource(columns), base="x", lower="low", upper="high"))


def _label(group: Group, place: int) -> dict[str, Any]:
    """The entry of a walker in a legend, if there is room for so many."""
    walker = group.walkers[place]
    facing = ways(uphill=group.case.goes_uphill)[int(walker.facing < 0)]
    return {"legend_label": f"walker {walker.walker}, {facing}"} if len(group.motion.walkers) <= _MOST_WALKERS else {}


def _colour(number: int) -> str:
    return COLOURS[number % len(COLOURS)]


def _distances(groups: list[Group]) -> Figure:
    plot = new_plot("Distance walked along the heading, at the end of each cycle", "time (s)", "distance (mm)")
    for group in groups:
        time, distance = distance_walked(group)
        for place, walker in enumerate(group.walkers):
            colour, values = _colour(walker.walker), distance[:, place] * 1e3
            plot.line(time, values, color=colour, **_label(group, place))
            if len(time) <= _MOST_POINTS:
                plot.scatter(time, values, color=colour, size=4, **_label(group, place))
    _shade_settling(plot, groups[0])
    return with_legend(plot)


def _shade_settling(plot: Figure, group: Group) -> None:
    from bokeh.models.annotations import BoxAnnotation

    run = group.case.run
    settled = run.settling_cycles / group.case.drive.frequency
    plot.add_layout(BoxAnnotation(left=0.0, right=settled, fill_color="#888888", fill_alpha=0.12))


def _paths(groups: list[Group]) -> Figure:
    plot = new_plot(
        "Paths of the mass centres from their starts, at the end of each cycle, seen from above",
        "along the drive axis (mm)",
        "across it (mm)",
    )
    for group in groups:
        strobed = group.mass_centre[:: group.case.run.samples_per_cycle]
        way = (strobed - strobed[0]) * 1e3
        for place, walker in enumerate(group.walkers):
            along, across = way[:, place] @ group.drive_axis, way[:, place] @ group.across_axis
            plot.line(along, across, color=_colour(walker.walker), **_label(group, place))
            plot.scatter(along[-1:], across[-1:], color=_colour(walker.walker), size=7, **_label(group, place))
    return with_legend(plot)


def _velocities(directory: Path) -> Figure:

    from bokeh.models import BasicTicker

    table = read_table(directory, "walkers")
    plot = new_plot(
        "Velocity of each walker with the standard error of its fit",
        "number of the walker",
        "velocity (mm/s)",
        height=240,
    )
    number, velocity = table["walker"].to_numpy(), table["velocity"].to_numpy() * 1e3
    error_bars(plot, number, velocity, table["standard_error"].to_numpy() * 1e3)
    for facing, colour, marker in ((1, COLOURS[0], "circle"), (-1, COLOURS[1], "square")):
        these = (table["facing"] == facing).to_numpy()
        name = ways(uphill=case_of(directory).goes_uphill)[int(facing < 0)]
        if these.any():
            plot.scatter(
                number[these],
                velocity[these],
                marker=marker,
                size=9,
                color=colour,
                legend_label=f"started facing {name}",
            )
    plot.xaxis.ticker = BasicTicker(min_interval=1)
    return with_legend(plot)


def _gait(group: Group) -> Figure:
    """As Fig. 4 of Khan et al.: velocity and rotation velocities of the first walker in its last two cycles."""
    samples, frequency = group.case.run.samples_per_cycle, group.case.drive.frequency
    motion, first = gait(group), group.walkers[0]
    cycles = (len(group.time) - 1) // samples
    last = slice((cycles - 2) * samples, cycles * samples + 1)
    phase = group.time[last] * frequency - (cycles - 2)
    plot = new_plot(
        f"Gait of walker {first.walker} through its last two cycles", "time (cycles of the drive)", "velocity (mm/s)"
    )
    means = averages(group).rotation[0]
    lines = [(f"walker (mean {walk(group).velocity[0] * 1e3:.3f})", motion.velocity[last, 0])]
    lines += [
        (f"bead {bead + 1}, −R dφ/dt (mean {mean * 1e3:.3f})", motion.rotation[last, 0, bead])
        for bead, mean in enumerate(means)
    ]
    shaken = group.motion.substrate_velocity[last] @ np.array(group.case.drive.direction)
    if np.any(shaken):
        lines.append(("substrate", first.facing * shaken))
    for number, (name, values) in enumerate(lines):
        dash = "dotted" if name == "substrate" else "solid"
        plot.line(phase, values * 1e3, color=_colour(number), line_dash=dash, legend_label=name)
    return with_legend(plot)


def _pile(found: PileAnalysis) -> list[Figure]:
    """Heights of the leaders of clusters above the pile's surface, and the bed."""
    time = found.motion.time
    thin = slice(None, None, -(-len(time) // _MOST_POINTS))

    def of_beds(name: str) -> FloatArray:
        return np.array([getattr(bed, name) for bed in found.beds])[thin]

    before = "time from the begin of the drive (s)"
    heights = new_plot(
        "Heights of the clusters' leading beads and of the pile's surface", before, "height (mm)", height=380
    )
    heights.varea(
        time[thin], of_beds("surface_low") * 1e3, of_beds("surface_high") * 1e3, color="#5b6770", alpha=0.2,
        legend_label="surface, 10th to 90th percentile",
    )  # fmt: skip
    heights.line(time[thin], of_beds("surface") * 1e3, color="#5b6770", legend_label="surface, median")
    for number, (track, climb) in enumerate(zip(found.tracks, found.climbs, strict=True)):
        places = [frame for frame, members in zip(track.frames, track.members, strict=True) if climb.leader in members]
        told = f"cluster {number} climbs" if climb.climbed else "clusters that do not climb"
        heights.line(
            time[places],
            found.motion.position[places, climb.leader, 2] * 1e3,
            color=_colour(number) if climb.climbed else "#c78a2c",
            line_width=2.0 if climb.climbed else 0.7,
            legend_label=told,
        )
    shared: dict[str, Any] = {"x_range": heights.x_range, "height": 220}
    index = new_plot("Segregation: (z of large − z of small) / their sum", before, "Brazil-nut index", **shared)
    index.line(time[thin], of_beds("brazil_nut"), color=COLOURS[0], legend_label="all beads")
    index.line(time[thin], of_beds("brazil_nut_of_bulk"), color=COLOURS[1], legend_label="bulk alone")
    bridges = new_plot("Bridges and contacts with other beads", before, "how many a bead", **shared)
    bridges.line(time[thin], of_beds("bridges"), color=COLOURS[0], legend_label="bridges")
    bridges.line(time[thin], of_beds("contacts"), color=COLOURS[1], legend_label="contacts")
    agitation = new_plot("Agitation, once a cycle", before, "mean square velocity (m²/s²)", y_axis_type="log", **shared)
    agitation.line(time[thin], np.maximum(of_beds("mean_square_velocity"), 1e-12), color=COLOURS[0])
    return [with_legend(plot) for plot in (heights, index, bridges, agitation)]
