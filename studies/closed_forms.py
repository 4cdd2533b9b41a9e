"""Motions of one bead with closed forms: the audit's group 11 as a chapter, with the ways drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.audit.bench import Bench
from walkers.audit.check import Line, Verdict
from walkers.audit.checks import closed_forms as forms
from walkers.audit.checks.benchmarks import WALLS
from walkers.inputs.text import rendered
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, styled
from walkers.studies.audited import as_numbers, failures, line_table, lines_of, temporary_bench
from walkers.studies.chapter import Chapter

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WALL_STYLES: dict[str, dict[str, Any]] = {
    "single wall": {"ls": "", "marker": "o", "color": "C1", "ms": 3.5, "mfc": "none"},
    "doubled wall": {"ls": "", "marker": "x", "color": "C2", "ms": 5.0},
}
_EVERY = 8
"""Of the recorded points one in so many is drawn."""


@dataclass(frozen=True)
class Measured:
    """The ways, by wall; those down the slope also by whether the bead rolls."""

    sliding: Mapping[str, forms.Way]
    rolling: Mapping[str, forms.Way]
    sliding_in_film: Mapping[str, forms.Way]
    rolling_in_film: Mapping[str, forms.Way]
    thrown: Mapping[str, forms.Thrown]


def measure(bench: Bench) -> Measured:
    """Let the beads go."""
    return Measured(
        {wall: forms.sliding_way(bench, wall) for wall in WALLS},
        {wall: forms.rolling_way(bench, wall) for wall in WALLS},
        {wall: forms.film_way(bench, wall, 0.0) for wall in WALLS},
        {wall: forms.film_way(bench, wall, 0.5) for wall in WALLS},
        {wall: forms.thrown(bench, wall) for wall in WALLS},
    )


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """The closed forms on the installed engine; they take seconds, however ``quick`` it is to be, and leave no runs."""
    del out, quick
    with temporary_bench() as bench:
        measured, lines = measure(bench), lines_of(forms.CHECKS, bench)
    return Chapter(
        name="closed-forms",
        title="One bead: closed forms",
        text=rendered("walkers.studies", "closed_forms.md.j2", **_contents(lines)),
        figures={"closed-forms": fig_ways(measured)},
        numbers=as_numbers(lines),
        failed=failures(lines),
    )


def _contents(lines: list[Line]) -> dict[str, str]:
    kinds = {
        "judged": (Verdict.PASS, Verdict.FAIL),
        "defects": (Verdict.PRESENT, Verdict.GONE),
        "reported": (Verdict.REPORT,),
    }
    return {name: line_table(line for line in lines if line.verdict in kind) for name, kind in kinds.items()}


@styled
def fig_ways(measured: Measured) -> Figure:
    """Velocities along the four ways and after the spinning impact; lines are the closed forms."""
    figure, ((slide, roll), (film, throw)) = new_figure(TWO_COLUMNS, 6.2, nrows=2, ncols=2)
    _draw(slide, measured.sliding, spin=True)
    slide.set_title("slides until it rolls")
    _draw(roll, measured.rolling)
    roll.set_title("rolls to rest")
    _draw(film, measured.sliding_in_film, sign=-1.0)
    _draw(film, measured.rolling_in_film, sign=-1.0, dashed=True)
    film.set_title("down a slope in a film: slides (line), rolls (dashes)")
    found = measured.thrown["single wall"]
    throw.plot(found.spin, found.expected, color="0.3", label="rigid bead")
    throw.plot(found.spin, found.model, color="0.3", ls=":", label="Mindlin's spring, integrated")
    for wall, one in measured.thrown.items():
        throw.plot(one.spin, one.sideways, label=wall, **_WALL_STYLES[wall])
    throw.set(xlabel="Rω/(μ vₙ)", ylabel="velocity sideways/(μ vₙ)", title="spins as it falls")
    legend_below(throw, ncols=2)
    letter_panels((slide, roll, film, throw))
    return figure


def _draw(
    axes: Axes, ways: Mapping[str, forms.Way], *, spin: bool = False, sign: float = 1.0, dashed: bool = False
) -> None:
    way = ways["single wall"]
    styles = [("velocity", way.expected_velocity, "-")] + [("Rω", way.expected_rolling, "-.")] * spin
    for name, expected, dash in styles:
        label = None if dashed else f"{name}, closed form"
        axes.plot(way.time * 1e3, sign * expected * 1e3, color="0.3", ls="--" if dashed else dash, label=label)
    for wall, one in ways.items():
        label = None if dashed else wall
        for values in (one.velocity, one.rolling) if spin else (one.velocity,):
            axes.plot(one.time[::_EVERY] * 1e3, sign * values[::_EVERY] * 1e3, label=label, **_WALL_STYLES[wall])
            label = None
    axes.set(xlabel="time (ms)", ylabel="velocity (mm/s)")
    if not dashed:
        legend_below(axes, ncols=2)
