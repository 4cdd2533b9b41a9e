"""Make the figures of the paper and the comparison with it, from the runs to the files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.paper.comparison import compare
from studies.paper.figures import fig1b, fig2, fig2_threshold, fig3, fig4
from studies.paper.sources import (
    NothingFinishedError,
    Sources,
    facts_sweep_name,
    parameter_sets,
    sweep_of,
)
from walkers.errors import input_error
from walkers.extras import require
from walkers.files import write_bytes, write_json
from walkers.postprocess.show.drawing import check_formats, save_figure
from walkers.progress import progress_of
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.workers import Failure
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")
"""Default formats of figures, from `walkers.postprocess.show.drawing`."""


@dataclass(frozen=True)
class Drawing:
    """A figure of the paper.

    Attributes
    ----------
    draw
        Draws the figure.
    sweeps
        Names of the sweeps that it shows.
    title
        Title in the metadata of its files.
    """

    draw: Callable[[Sources], Figure]
    sweeps: tuple[str, ...]
    title: str


FIGURES = {
    "fig1b": Drawing(fig1b, ("alignment",), "Fig. 1b: strobed top views of a walker"),
    "fig2": Drawing(fig2, ("fig2",), "Fig. 2: velocity against peak acceleration"),
    "fig2-threshold": Drawing(
        fig2_threshold, ("fig2-threshold", "fig2-ramp"), "Fig. 2, inset: the threshold of motion"
    ),
    "fig3": Drawing(fig3, ("fig3",), "Fig. 3: velocity against asymmetry"),
    "fig4": Drawing(fig4, ("fig4",), "Fig. 4: rotation of the beads through two cycles"),
}
"""Figures by name."""

COMPARISON = "comparison"
"""Name of the comparison among those of the figures."""

COMPARED = (
    *map(facts_sweep_name, parameter_sets()),
    "fig2-threshold",
    "fig2-ramp",
    "fig2",
    "fig3",
)
"""Sweeps of the comparison."""


@dataclass(frozen=True)
class PaperFiles:
    """What `make_figures` has written, and what is missing.

    Attributes
    ----------
    files
        The written files.
    failures
        Failed points by sweep.
    left_out
        Reasons why figures could not be drawn, by figure.
    counts
        By parameter set, the number of facts that agree, and the number of facts.
    """

    files: list[Path]
    failures: dict[str, list[Failure]]
    left_out: dict[str, str]
    counts: dict[str, tuple[int, int]]


def make_figures(  # noqa: PLR0913
    out: Path,
    to: Path,
    options: SweepOptions,
    *,
    only: Sequence[str] = (),
    formats: Sequence[str] = FORMATS,
    engine: str | None = None,
    progress: bool | None = False,
) -> PaperFiles:
    """Make the missing runs, draw the figures and write the comparison.

    Parameters
    ----------
    out
        Folder of the runs.
    to
        Folder of the figures and the comparison.
    options
        How many decks run at the same time, and where.
    only
        Names of `FIGURES`, or ``comparison``; if empty, all of them.
    formats
        Formats of the figures: png, svg or pdf.
    engine
        Name or path of the binary; default: the installed one.
    progress
        Whether to show the progress of sweeps; None: in notebooks only.

    Returns
    -------
    PaperFiles
        The written files, and what is missing.

    Raises
    ------
    walkers.errors.InputError
        If a figure or a format does not exist, or a folder is a file.
    """
    require("theory")
    chosen = list(only) or [*FIGURES, COMPARISON]
    _check_names(chosen)
    check_formats(formats)
    _check_folder("out", out)
    _check_folder("to", to)
    failures: dict[str, list[Failure]] = {}
    for sweep in _sweeps_of(chosen):
        with progress_of(sweep, progress) as advance:
            _, failed = run_sweep(sweep_of(sweep), out, options, engine=engine, on_progress=advance)
        if failed:
            failures[sweep] = failed
    files: list[Path] = []
    left_out: dict[str, str] = {}
    for name in chosen:
        if name not in FIGURES:
            continue
        try:
            files += _save(name, Sources(out), to, formats)
        except NothingFinishedError as missing:
            left_out[name] = str(missing)
    counts: dict[str, tuple[int, int]] = {}
    if COMPARISON in chosen:
        comparison = compare(Sources(out))
        files += _write_comparison(comparison, to)
        for name, facts in comparison["sets"].items():
            counts[name] = (facts["agree"], facts["of"])
    return PaperFiles(files, failures, left_out, counts)


def _check_names(chosen: Iterable[str]) -> None:
    names = (*FIGURES, COMPARISON)
    for name in chosen:
        if name not in names:
            raise input_error("only", f'no figure "{name}"; expected one of {", ".join(names)}')


def _check_folder(option: str, folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise input_error(option, f"expected a folder, {folder} is a file")


def _sweeps_of(chosen: Iterable[str]) -> list[str]:
    """Sweeps of figures and of the comparison, each once."""
    sweeps: dict[str, None] = {}
    for name in chosen:
        needed = FIGURES[name].sweeps if name in FIGURES else COMPARED
        sweeps |= dict.fromkeys(needed)
    return list(sweeps)


def _save(name: str, sources: Sources, to: Path, formats: Sequence[str]) -> list[Path]:
    drawing = FIGURES[name]
    runs = sources.runs(drawing.sweeps)
    return save_figure(drawing.draw(sources), to / name, runs, formats, drawing.title)


def _write_comparison(comparison: dict[str, Any], to: Path) -> list[Path]:
    """Write the comparison as a page and as JSON."""
    page = to / f"{COMPARISON}.md"
    record = to / f"{COMPARISON}.json"
    to.mkdir(parents=True, exist_ok=True)
    write_bytes(page, page_of(comparison).encode())
    write_json(record, comparison)
    return [page, record]


def page_of(comparison: dict[str, Any]) -> str:
    """The page of a comparison with the paper, in Markdown.

    Parameters
    ----------
    comparison
        As from `studies.paper.comparison.compare`, or read from its JSON file.
    """
    labels: dict[str, None] = {}  # of the parameters of all sets, in order, each once
    for parameter_set in comparison["sets"].values():
        labels |= dict.fromkeys(parameter_set["parameters"])
    return rendered("studies.paper", "comparison.md.j2", comparison | {"labels": list(labels)})
