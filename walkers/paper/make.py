"""All figures and the comparison, from the runs to the files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from walkers.errors import refused
from walkers.extras import require
from walkers.inputs.sweep import load_sweep
from walkers.paper.comparison import as_dict, as_markdown, compare, count
from walkers.paper.figures import fig1b, fig2, fig3, fig4, fig_sensitivity
from walkers.paper.maps import fig_alignment, fig_modes
from walkers.paper.published import NothingFinishedError, Sources
from walkers.postprocess.drawing import check_formats, save_figure
from walkers.progress import progress_of
from walkers.runner.files import write_json, write_text
from walkers.sweeps.scheduler import Failure, Options, run_sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "svg")
"""Default formats of figures, from `walkers.postprocess.drawing`."""


class Drawing(NamedTuple):
    """A figure: function, sweeps and title."""

    draw: Callable[[Sources], Figure]
    sweeps: tuple[str, ...]
    title: str


FIGURES = {
    "fig1b": Drawing(fig1b, ("alignment",), "Fig. 1b: strobed top views of a walker"),
    "fig2": Drawing(fig2, ("fig2", "fig2-threshold"), "Fig. 2: velocity against peak acceleration"),
    "fig3": Drawing(fig3, ("fig3",), "Fig. 3: velocity against asymmetry"),
    "fig4": Drawing(fig4, ("fig4",), "Fig. 4: rotation of the beads through two cycles"),
    "alignment": Drawing(fig_alignment, ("alignment",), "Alignment with the shaking axis and across it"),
    "modes": Drawing(fig_modes, ("modes",), "Modes of motion"),
    "sensitivity": Drawing(fig_sensitivity, ("sensitivity",), "Sensitivity of six observations to the parameters"),
}
COMPARISON = "comparison"
COMPARED = ("fig2", "fig2-threshold", "fig3", "fig4", "alignment")


class Made(NamedTuple):
    """Written files, failed points by sweep, and figures that could not be drawn with the reasons.

    ``agree`` of ``compared`` published numbers that test the engine agree; both are 0 without a comparison.
    """

    files: list[Path]
    failures: dict[str, list[Failure]]
    left_out: dict[str, str]
    agree: int = 0
    compared: int = 0


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
    """Make the missing runs, draw the figures and write the comparison.

    Parameters
    ----------
    out, to
        Folders of the run directories and of the figures.
    options, how
        As for `walkers.sweeps.scheduler.run_sweep`.
    only
        Names of `FIGURES`, or ``comparison``; if empty, all.
    formats
        Formats of the figures, from `walkers.postprocess.drawing.FORMATS`.
    progress
        See `walkers.progress.progress_of`.

    Raises
    ------
    InputError
        If a figure or format does not exist, or a folder is a file.
    """
    require("theory")
    import joblib

    known = (*FIGURES, COMPARISON)
    chosen = list(only) or list(known)
    for name in chosen:
        if name not in known:
            raise refused("only", f'no figure "{name}"; expected one of {", ".join(known)}')
    check_formats(formats)
    for option, folder in (("out", out), ("to", to)):
        if folder.exists() and not folder.is_dir():
            raise refused(option, f"expected a folder, {folder} is a file")
    needed = [FIGURES[name].sweeps if name in FIGURES else COMPARED for name in chosen]
    failed: dict[str, list[Failure]] = {}
    for sweep in dict.fromkeys(sweep for sweeps in needed for sweep in sweeps):
        with progress_of(sweep, progress) as advance:
            _, failures = run_sweep(load_sweep(sweep), out, options, on_progress=advance, **how)
        failed |= {sweep: failures} if failures else {}
    figures = [name for name in chosen if name in FIGURES]
    # Processes of loky do not import the caller's script, unlike those of `multiprocessing`.
    draw = joblib.Parallel(n_jobs=min(options.decks_at_once, len(figures) or 1))
    outcomes = draw(joblib.delayed(draw_figure)(name, out, to, formats) for name in figures)
    files = [path for outcome in outcomes if isinstance(outcome, list) for path in outcome]
    left_out = {name: one for name, one in zip(figures, outcomes, strict=True) if isinstance(one, str)}
    if COMPARISON not in chosen:
        return Made(files, failed, left_out)
    rows = compare(Sources(out))
    page, record = to / f"{COMPARISON}.md", to / f"{COMPARISON}.json"
    to.mkdir(parents=True, exist_ok=True)
    write_text(page, as_markdown(rows))
    write_json(record, as_dict(rows))
    return Made([*files, page, record], failed, left_out, *count(rows, measured=True))


def draw_figure(name: str, out: Path, to: Path, formats: Sequence[str]) -> list[Path] | str:
    """Draw one of `FIGURES` from finished sweeps; return the files, or the reason why it cannot be drawn."""
    drawing, sources = FIGURES[name], Sources(out)
    try:
        runs = sources.runs(*drawing.sweeps)
        return save_figure(drawing.draw(sources), to / name, runs, formats, drawing.title)
    except NothingFinishedError as missing:
        return str(missing)
