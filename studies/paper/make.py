"""All figures and the comparison, from the runs to the files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from walkers.errors import refused
from walkers.extras import require
from walkers.files import write_bytes, write_json
from walkers.paper.comparison import compare
from walkers.paper.figures import fig1b, fig2_threshold, fig3, fig4, of_sweep
from walkers.paper.sources import NothingFinishedError, Sources, of_facts, sets, sweep_of
from walkers.postprocess.show.drawing import check_formats, save_figure
from walkers.progress import progress_of
from walkers.sweeps.scheduler import Failure, Options, run_sweep
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")
"""Default formats of figures, from `walkers.postprocess.show.drawing`."""


class Drawing(NamedTuple):
    """A figure: function, sweeps and title."""

    draw: Callable[[Sources], Figure]
    sweeps: tuple[str, ...]
    title: str


_FIG2 = partial(of_sweep, name="fig2", x="drive.peak_acceleration", hue="drive.frequency", theory=True)
FIGURES = {
    "fig1b": Drawing(fig1b, ("alignment",), "Fig. 1b: strobed top views of a walker"),
    "fig2": Drawing(_FIG2, ("fig2",), "Fig. 2: velocity against peak acceleration"),
    "fig2-threshold": Drawing(
        fig2_threshold, ("fig2-threshold", "fig2-ramp"), "Fig. 2, inset: the threshold of motion"
    ),
    "fig3": Drawing(fig3, ("fig3",), "Fig. 3: velocity against asymmetry"),
    "fig4": Drawing(fig4, ("fig4",), "Fig. 4: rotation of the beads through two cycles"),
}
COMPARISON = "comparison"
COMPARED = (*map(of_facts, sets()), "fig2-threshold", "fig2-ramp", "fig2", "fig3")
"""Sweeps of the comparison."""


class Made(NamedTuple):
    """Written files, failed points by sweep, figures that could not be drawn, and facts that agree and all by set."""

    files: list[Path]
    failures: dict[str, list[Failure]]
    left_out: dict[str, str]
    counts: dict[str, tuple[int, int]]


def make_figures(
    out: Path,
    to: Path,
    options: Options,
    *,
    only: Sequence[str] = (),
    formats: Sequence[str] = FORMATS,
    progress: bool | None = False,
    **how: Any,
) -> Made:
    """Make the missing runs in the folder ``out``, draw the figures and write the comparison to the folder ``to``.

    ``only`` are names of `FIGURES`, or ``comparison``; if empty, all. ``options`` and ``how`` are as for
    `walkers.sweeps.scheduler.run_sweep`. `InputError` if a figure or format does not exist, or a folder is a file.
    """
    require("theory")
    names = (*FIGURES, COMPARISON)
    chosen = list(only) or list(names)
    for name in chosen:
        if name not in names:
            raise refused("only", f'no figure "{name}"; expected one of {", ".join(names)}')
    check_formats(formats)
    for option, folder in (("out", out), ("to", to)):
        if folder.exists() and not folder.is_dir():
            raise refused(option, f"expected a folder, {folder} is a file")
    needed = [FIGURES[name].sweeps if name in FIGURES else COMPARED for name in chosen]
    failed: dict[str, list[Failure]] = {}
    for sweep in dict.fromkeys(sweep for sweeps in needed for sweep in sweeps):
        with progress_of(sweep, progress) as advance:
            _, failures = run_sweep(sweep_of(sweep), out, options, on_progress=advance, **how)
        failed |= {sweep: failures} if failures else {}
    files: list[Path] = []
    left_out: dict[str, str] = {}
    for name in (name for name in chosen if name in FIGURES):
        drawing, sources = FIGURES[name], Sources(out)
        try:
            runs = sources.runs(drawing.sweeps)
            files += save_figure(drawing.draw(sources), to / name, runs, formats, drawing.title)
        except NothingFinishedError as missing:
            left_out[name] = str(missing)
    counts: dict[str, tuple[int, int]] = {}
    if COMPARISON in chosen:
        comparison = compare(Sources(out))
        files += [page := to / f"{COMPARISON}.md", record := to / f"{COMPARISON}.json"]
        to.mkdir(parents=True, exist_ok=True)
        write_bytes(page, rendered("walkers.paper", "comparison.md.j2", **comparison).encode())
        write_json(record, comparison)
        counts = {name: (facts["agree"], facts["of"]) for name, facts in comparison["sets"].items()}
    return Made(files, failed, left_out, counts)
