"""Pictures, tables, outputs and numbers in the documentation that come from simulations.

All of them follow from the shipped parameters. `make_illustrations` makes them again and records a
digest of the cases that each picture and table shows. `stale` lists those that show other cases
than the current ones.

Pages contain two kinds of invisible marks. A code block below ``<!--output-->`` begins with a
command and contains its output. ``<!--fact fig4b_velocity-->8.15<!--/fact-->`` contains a number of
the comparison.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from docs import notation, pile_climbs, sweep_figures, tables, why_it_walks
from studies import effects, frictions, frictions_by_engine
from studies.friction_laws import LAWS, calibration_with
from studies.literature import experiments
from studies.literature.benchmarks import curve_of, published
from studies.literature.checks import LITERATURE
from studies.paper.make import COMPARED, FIGURES, make_figures
from studies.paper.sources import sweep_of
from walkers import Sweep, load_case, run, sweep
from walkers.api import Changes
from walkers.arrays import FloatArray
from walkers.calibration.calibrate import calibrate
from walkers.calibration.file import load_calibration
from walkers.calibration.report import write_outcome
from walkers.errors import InputError, Problem
from walkers.files import read_json, replacing, write_bytes, write_json
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.results import VERSION, modules_of
from walkers.postprocess.show.drawing import (
    TWO_COLUMNS,
    legend_below,
    letter_panels,
    new_figure,
    ordered_colours,
    save_figure,
    styled,
)
from walkers.second_engine.lines import as_dict, failures, run_checks
from walkers.sweeps.scheduler import SweepOptions
from walkers.templates.deck import CONTENT_VERSION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from walkers.second_engine.scenes import Bench

RECORD = Path("figures") / "made-from.json"
"""Digests of the cases that each file shows, in docs/."""

CHECKED = Path("figures") / "validation.json"
"""Lines of ``python -m studies.literature``, of which pages quote numbers, in docs/."""

_NUMBERS_OF_A_CYCLE = Path("figures") / "why-it-walks.json"
"""Numbers of `docs.why_it_walks`, in docs/."""

_BLOCK = re.compile(
    r"(?ms)(?P<head><!--output-->\n```console\n\$ (?P<command>walkers [^\n]+)\n).*?(?=^```)"
)
"""A code block with a command and its output."""

_FACT = re.compile(r"<!--fact (?P<name>\S+)-->[^<]*<!--/fact-->")
"""A number in a sentence."""

_RUN_HASH = re.compile(r"-[0-9a-f]{12}\b")
"""The end of the name of a run."""


@dataclass(frozen=True)
class Versions:
    """Versions of the decks and of the results with which an illustration was made."""

    decks: int = CONTENT_VERSION
    results: int = VERSION


_TODAY = Versions()
"""The versions of the program that runs."""


@dataclass(frozen=True)
class Illustration:
    """Pictures and tables of the documentation that are made in one go.

    Attributes
    ----------
    files
        Their paths in docs/.
    cases
        Gives the cases that they show.
    make
        Makes the files from the folder of runs and the folder docs/. Missing runs are made.
    versions
        Versions of decks and results that the files have.
    """

    files: tuple[str, ...]
    cases: Callable[[], list[Case]]
    make: Callable[[Path, Path], None]
    versions: Versions = _TODAY


def _cases_of_sweeps(names: Iterable[str]) -> list[Case]:
    """The cases of shipped sweeps."""
    cases: list[Case] = []
    for name in names:
        cases += _cases_of_sweep(name)
    return cases


@cache
def _cases_of_sweep(name: str) -> tuple[Case, ...]:
    """The cases of a shipped sweep, which several illustrations may show."""
    return tuple(load_sweep(name).cases())


def _shipped_cases(*names: str) -> list[Case]:
    return [load_case(name) for name in names]


# --- pictures and films of a run ------------------------------------------------------------------

_SHORT_WALK = {"run.cycles": 60}
"""Changes of ``fig1b`` for its picture and its film."""


def _picture(
    file: str, name: str, changes: Changes = None, walker: int | None = None
) -> Illustration:
    """A picture of a run, or of one walker in it, as `walkers render` makes it."""

    def cases() -> list[Case]:
        return [load_case(name, changes)]

    def make(out: Path, docs: Path) -> None:
        case = load_case(name, changes)
        shown = run(case, out)
        if shown.case.title != case.title:
            shown = run(case, out, force=True)  # a sweep has made it, with a title of its own
        shown.render(docs / file, walker=walker)
        _quantize(docs / file)

    return Illustration((file,), cases, make)


def _quantize(path: Path) -> None:
    """Give a PNG a palette of 256 colours, a quarter of its size; its metadata stay."""
    from PIL import Image, PngImagePlugin

    with Image.open(path) as picture:
        metadata = PngImagePlugin.PngInfo()
        for name, text in picture.text.items():
            metadata.add_itxt(name, text)
        dots_per_inch = picture.info["dpi"]
        smaller = picture.convert("RGB").quantize(256, dither=Image.Dither.FLOYDSTEINBERG)
    with replacing(path) as new:
        smaller.save(new, format="png", optimize=True, dpi=dots_per_inch, pnginfo=metadata)


def _films(gif: str, mp4: str, name: str, changes: Changes) -> Illustration:
    """Films of the first walker of a run: a small one for GitHub, and one for the start page."""

    def cases() -> list[Case]:
        return [load_case(name, changes)]

    def make(out: Path, docs: Path) -> None:
        walk = run(load_case(name, changes), out)
        walk.film(docs / gif, size=(512, 216), fps=20, slowdown=20.0, walker=0, end=0.4)
        walk.film(docs / mp4, size=(960, 400), fps=25, slowdown=20.0, walker=0, end=0.4)

    return Illustration((gif, mp4), cases, make)


# --- figures of the paper -------------------------------------------------------------------------


def _paper(name: str, files: tuple[str, ...], sweeps: Iterable[str]) -> Illustration:
    """A figure of `studies.paper`, or its comparison, from these sweeps."""

    def cases() -> list[Case]:
        shown: list[Case] = []
        for sweep_name in sweeps:
            shown += sweep_of(sweep_name).cases()
        return shown

    def make(out: Path, docs: Path) -> None:
        make_figures(out, docs / "figures", SweepOptions(), only=[name], formats=("png",))

    return Illustration(files, cases, make)


# --- figures and tables of sweeps -----------------------------------------------------------------


@dataclass(frozen=True)
class _SweepFigure:
    """How a sweep is shown.

    Attributes
    ----------
    name
        Name of the sweep.
    y, x, hue, panels
        What its figure shows, as for `walkers.Sweep.figure`.
    rows
        Gives the rows of its table in the documentation, if it has one.
    draw
        Draws it in another form.
    """

    name: str
    y: str
    x: str | None = None
    hue: str | None = None
    panels: str | None = None
    rows: Callable[[pd.DataFrame], list[dict[str, str]]] | None = None
    draw: Callable[[Sweep, _SweepFigure], Figure] | None = None

    def of(self, finished: Sweep) -> Figure:
        """The figure of a finished sweep."""
        if self.draw is not None:
            return self.draw(finished, self)
        return self.plotted(finished)

    def plotted(self, finished: Sweep) -> Figure:
        """The figure as `walkers plot` draws it."""
        return finished.figure(x=self.x, y=self.y, hue=self.hue, panels=self.panels)


def _clusters(finished: Sweep, shown: _SweepFigure) -> Figure:
    """Velocities of clusters above drawings of them."""
    wall = "corner" if shown.name == "zoo-corner" else "wall"
    cases = []
    scatter = []
    for point in finished.runs:
        cases.append(point.case)
        scatter.append(float(point.walkers["axial_velocity"].std()))
    return sweep_figures.clusters_figure(finished.table(), cases, scatter, wall)


def _onset(finished: Sweep, shown: _SweepFigure) -> Figure:
    """Velocities against friction near the onset of climbing."""
    return sweep_figures.onset_figure(shown.plotted(finished))


def _trays(finished: Sweep, _shown: _SweepFigure) -> Figure:
    """Shares of walkers in clusters, as means over seeds."""
    return sweep_figures.trays_figure(finished.table())


_SWEEP_FIGURES = (
    _SweepFigure(
        "climb-liquids",
        y="axial_velocity",
        x="contact.friction.bead_wall",
        hue="liquid.name",
        panels="contact.roughness.bead_wall",
        rows=tables.least_frictions,
        draw=_onset,
    ),
    _SweepFigure(
        "climb-corner",
        y="axial_velocity",
        x="contact.friction.bead_wall",
        hue="liquid.name",
        rows=tables.least_frictions,
        draw=_onset,
    ),
    _SweepFigure("zoo", y="axial_velocity", draw=_clusters),
    _SweepFigure("zoo-corner", y="axial_velocity", draw=_clusters),
    _SweepFigure(
        "tray-phases",
        y="clustered_share",
        x="drive.peak_acceleration",
        hue="walkers",
        panels="coverage",
        rows=tables.means_of_trays,
        draw=_trays,
    ),
)
"""Sweeps whose figures and tables the documentation shows."""


def _sweep(shown: _SweepFigure) -> Illustration:
    """The figure of a sweep, and its table if it has one."""
    figure_file = f"figures/{shown.name}.png"
    table_file = f"figures/{shown.name}.md"

    def cases() -> list[Case]:
        return _cases_of_sweeps([shown.name])

    def make(out: Path, docs: Path) -> None:
        finished = sweep(shown.name, out)
        figure = shown.of(finished)
        runs = [point.directory.name for point in finished.runs]
        save_figure(figure, docs / figure_file, runs)
        if shown.rows:
            rows = shown.rows(finished.table())
            _write_page(docs / table_file, f"walkers list {shown.name}", rows)

    files = (figure_file, table_file) if shown.rows else (figure_file,)
    return Illustration(files, cases, make)


def _write_page(file: Path, command: str, rows: Sequence[Mapping[str, str]]) -> None:
    """Write a table below the command that prints its numbers."""
    write_bytes(file, tables.page(command, rows).encode())


# --- climbs in piles ------------------------------------------------------------------------------

_VERSIONS_OF_PILES = Versions(decks=10, results=1)
"""Versions of the piles; their statistics stay valid until the behaviour of piles changes.

Making them again takes fifteen core-hours, and changes only the last digits of tables.
"""


def _climbs_of(name: str) -> Illustration:
    """The statistics of the climbs of a sweep of piles."""

    def make(out: Path, docs: Path) -> None:
        pile_climbs.write_statistics(name, out, docs)

    file = pile_climbs.file_of(name)
    return Illustration((file,), partial(_cases_of_sweeps, [name]), make, _VERSIONS_OF_PILES)


def _climbs() -> Illustration:
    """The figure and the table of climbs, from the statistics of the sweeps."""
    figure_file = "figures/pile-climbs.png"
    table_file = "figures/pile-climbs.md"

    def cases() -> list[Case]:
        return _cases_of_sweeps(pile_climbs.SWEEPS)

    def make(_out: Path, docs: Path) -> None:
        statistics = pile_climbs.statistics_in(docs)
        figure = pile_climbs.figure_of(statistics)
        save_figure(figure, docs / figure_file, pile_climbs.SWEEPS, title="Climbs of piles")
        command = f"walkers climb {' '.join(pile_climbs.SWEEPS)}"
        _write_page(docs / table_file, command, pile_climbs.rows_of(statistics))

    return Illustration((figure_file, table_file), cases, make, _VERSIONS_OF_PILES)


# --- effects beyond the law, and the literature ---------------------------------------------------


def _effects() -> Illustration:
    """The table of `studies.effects`."""
    file = "figures/unexplained.md"

    def cases() -> list[Case]:
        return _shipped_cases("fig1b", "fig4a", "fig4b")

    def make(_out: Path, docs: Path) -> None:
        _write_page(docs / file, effects.COMMAND, effects.rows())

    return Illustration((file,), cases, make)


def _why_it_walks() -> Illustration:
    """The figure and the numbers of the page *Why it walks*."""
    figure = "figures/why-it-walks.png"

    def cases() -> list[Case]:
        shown = why_it_walks.shown_case()
        braked_less = (why_it_walks.WITHOUT_FRICTION, why_it_walks.WITHOUT_VISCOSITY)
        return [shown] + [load_case(why_it_walks.SHOWN, changes) for changes in braked_less]

    def make(out: Path, docs: Path) -> None:
        shown = run(why_it_walks.SHOWN, out)
        save_figure(why_it_walks.figure(shown), docs / figure, [shown.directory.name])
        write_json(docs / _NUMBERS_OF_A_CYCLE, why_it_walks.numbers(out))

    return Illustration((figure, str(_NUMBERS_OF_A_CYCLE)), cases, make)


def _notation() -> Illustration:
    """The drawing of the page *Notation*, which shows no run."""
    file = "figures/notation.png"

    def cases() -> list[Case]:
        return []

    def make(_out: Path, docs: Path) -> None:
        save_figure(notation.figure(), docs / file, (), title="Notation")

    return Illustration((file,), cases, make)


def _frictions() -> Illustration:
    """The table of `studies.frictions`, which takes half an hour."""
    file = "figures/frictions.md"

    def cases() -> list[Case]:
        return list(frictions.facts().experiments.values())

    def make(_out: Path, docs: Path) -> None:
        _write_page(docs / file, frictions.COMMAND, frictions.rows())

    return Illustration((file,), cases, make)


def _frictions_by_engine() -> Illustration:
    """The table of `studies.frictions_by_engine`, which takes an hour on two cores."""
    file = "figures/frictions-by-engine.md"

    def cases() -> list[Case]:
        calibrations = map(calibration_with, LAWS)
        shown: list[Case] = []
        for calibration in calibrations:
            medians = np.full((1, len(calibration.file.parameters)), 0.5)
            shown += calibration.sweep(calibration.name, calibration.values(medians)).cases()
        return shown

    def make(out: Path, docs: Path) -> None:
        _write_page(docs / file, frictions_by_engine.COMMAND, frictions_by_engine.rows(out))

    return Illustration((file,), cases, make)


def _validation() -> Illustration:
    """All comparisons of `studies.literature`, and a figure of its benchmarks."""
    figure_file = "figures/benchmarks.png"

    def cases() -> list[Case]:
        return _shipped_cases("fig1b", "fig4a", "fig4b", "climber", "climber-dimer", "pile-ci")

    def make(out: Path, docs: Path) -> None:
        lines = run_checks(LITERATURE, out)
        write_json(docs / CHECKED, as_dict(lines))
        title = "Published benchmarks of impacts"
        save_figure(_benchmarks(), docs / figure_file, (), title=title)
        for line in failures(lines):
            print(f"walkers: not as expected: {line.check}: {line.quantity}", file=sys.stderr)

    return Illustration((CHECKED.as_posix(), figure_file), cases, make)


@styled
def _benchmarks() -> Figure:
    """Published points and the curves of the second engine.

    The second material of test 4 is left out.
    """
    panels = {key: panel for key, panel in published().items() if not key.startswith("alloy-")}
    figure = new_figure(TWO_COLUMNS, 7.2)
    grid = figure.subplots(nrows=4, ncols=2)
    for axes, (key, panel) in zip(grid.flat, panels.items(), strict=True):
        for series in panel["series"]:
            marker, colour = _SOURCES[series["name"]]
            x, y = series["points"].T
            axes.plot(x, y, marker, color=colour, mfc="none", ms=4.0, label=series["name"])
        x, y = curve_of(key)
        axes.plot(x, y, color="k", lw=1.0, label="second engine")
        y_label = panel["y"].replace("-", "−", 1) if panel["y"].startswith("-") else panel["y"]
        axes.set(xlabel=panel["x"], ylabel=fill(y_label, 20), title=panel["title"])
        axes.set_xscale("log" if key == "spin" else "linear")
    letter_panels(grid.flat)
    shown = {}
    for axes in grid.flat:
        handles, labels = axes.get_legend_handles_labels()
        shown |= dict(zip(labels, handles, strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=4)
    return figure


_SOURCES = {
    "simulated": ("o", "C0"),
    "measured": ("s", "C1"),
    "finite elements": ("D", "C2"),
    "6: aluminium alloy": ("^", "C3"),
    "6: nylon": ("v", "C4"),
    "8: case A": ("P", "C5"),
    "8: case B": ("X", "C6"),
}
"""Symbol and colour of each source of the published points; one of each in all panels."""


def _repeated_experiments() -> Illustration:
    """A figure of the experiments of others, repeated with the engine."""
    file = "figures/others.png"

    def cases() -> list[Case]:
        return _shipped_cases("symmetric")

    def make(_out: Path, docs: Path) -> None:
        with experiments.workbench() as bench:
            figure = _experiments(bench)
        save_figure(figure, docs / file, (), title="Experiments of others")

    return Illustration((file,), cases, make)


@styled
def _experiments(bench: Bench) -> Figure:
    """Drift by two tones against phase and strength, and restitution on a wet plate."""
    figure = new_figure(TWO_COLUMNS, 3.2)
    panels = figure.subplots(ncols=3)
    drifts = np.array([experiments.measured_drift(bench, phase) for phase in experiments.PHASES])
    _draw_phases(panels[0], drifts)
    _draw_strengths(panels[1], drifts)
    _draw_impacts(panels[2], bench)
    for axes in panels:
        legend_below(axes)
    letter_panels(panels)
    return figure


def _draw_phases(axes: Axes, drifts: FloatArray) -> None:
    """Draw drifts against the phase of the second tone.

    ``drifts`` are over the speed of the first tone, shape (phases, strengths).
    """
    phases = np.arange(0.0, 181.0, 10.0)
    colours = ordered_colours(len(experiments.STRENGTHS))
    curves = np.array([experiments.coulomb_drift(phase) for phase in phases])
    for number, strength in enumerate(experiments.STRENGTHS):
        colour = colours[number]
        label = f"a = {strength:g} · 7/2 μg"
        axes.plot(experiments.PHASES, drifts[:, number], "o", mfc="none", ms=4.0, color=colour)
        axes.plot(phases, curves[:, number], lw=1.0, color=colour, label=label)
    limit = [experiments.weak_friction_drift(phase) for phase in phases]
    axes.plot(phases, limit, "k--", lw=1.0, label="weak friction")
    axes.set(xlabel="phase of the second tone (°)", ylabel="drift / speed of the first tone")


def _draw_strengths(axes: Axes, drifts: FloatArray) -> None:
    """Draw drifts at two phases against the strength of the tones; ``drifts`` as above."""
    strengths = experiments.STRENGTHS
    for number, phase in enumerate((0.0, 90.0)):
        colour = f"C{number}"
        measured = -drifts[list(experiments.PHASES).index(phase)] * strengths
        curve = -experiments.coulomb_drift(phase) * strengths
        label = f"phase of the second tone {phase:g}°"
        axes.plot(strengths, measured, "o", mfc="none", ms=4.0, color=colour, label=label)
        axes.plot(strengths, curve, lw=1.0, color=colour)
    axes.set(xlabel="a/(7/2 μg)", ylabel="drift / (7/2 μg/ω)")


_SHOWN_SPEED = 2
"""Index of the speed of the drawn impacts, 1 m/s, in `studies.literature.experiments.SPEEDS`."""


def _draw_impacts(axes: Axes, bench: Bench) -> None:
    """Draw the restitution of impacts at 1 m/s on a wet plate against 1/St."""
    law_with_film = f"{experiments.__file__}:law_with_film"
    curves = {
        "70 GPa": experiments.restitutions(bench),
        "70 GPa, bridge forms at the film": experiments.restitutions(bench, law=law_with_film),
        "50 MPa": experiments.restitutions(bench, modulus=5e7),
    }
    for label, (stokes, restitution) in curves.items():
        x = 1.0 / stokes[:, _SHOWN_SPEED]
        y = restitution[:, _SHOWN_SPEED]
        axes.plot(x, y, "o-", mfc="none", ms=4.0, lw=1.0, label=label)
    stokes, _ = curves["50 MPa"]
    inverse = np.array([0.0, 1.0 / stokes[:, _SHOWN_SPEED].min()])
    loss = np.log(experiments.FILM / experiments.ROUGHNESS) * inverse
    lubrication = experiments.DRY_RESTITUTION * (1.0 - loss)
    axes.plot(inverse, lubrication, "k--", lw=1.0, label="lubrication, approach")
    axes.set(xlabel="1/St", ylabel="restitution", ylim=(0.0, 1.0), xticks=(0.0, 0.005, 0.01))


# --- calibration ----------------------------------------------------------------------------------


def _calibration() -> Illustration:
    """The outcome of the calibration ``ruby``."""
    outcome_of = {
        "figures/calibration.md": "calibration.md",
        "figures/calibration.json": "calibration.json",
        "figures/calibration.png": "predictions.png",
    }

    def cases() -> list[Case]:
        return list(load_calibration("ruby").sweep("ruby").cases())

    def make(out: Path, docs: Path) -> None:
        outcome = calibrate(load_calibration("ruby"), out, SweepOptions())
        write_outcome(outcome, out / "ruby")
        for file, written in outcome_of.items():
            shutil.copy(out / "ruby" / written, docs / file)

    return Illustration(tuple(outcome_of), cases, make)


# --- all illustrations ----------------------------------------------------------------------------

ILLUSTRATIONS: dict[str, Illustration] = {
    "walker": _picture("pictures/walker.png", "fig1b", _SHORT_WALK),
    "film": _films("pictures/walker.gif", "_static/walker.mp4", "fig1b", _SHORT_WALK),
    "tray": _picture("pictures/tray.png", "tray"),
    # Walker 3 starts 9.7° off the vertical, furthest of all six.
    "climber": _picture("pictures/climber.png", "climber", walker=3),
    "pile": _picture("pictures/pile.png", "pile-small"),
}
"""All illustrations by name."""

for _name, _drawing in FIGURES.items():
    ILLUSTRATIONS[_name] = _paper(_name, (f"figures/{_name}.png",), _drawing.sweeps)
ILLUSTRATIONS["comparison"] = _paper(
    "comparison", ("figures/comparison.md", "figures/comparison.json"), COMPARED
)
for _shown in _SWEEP_FIGURES:
    ILLUSTRATIONS[_shown.name] = _sweep(_shown)
for _name in pile_climbs.SWEEPS:
    ILLUSTRATIONS[_name] = _climbs_of(_name)
ILLUSTRATIONS["pile-climbs"] = _climbs()
ILLUSTRATIONS["unexplained"] = _effects()
ILLUSTRATIONS["why-it-walks"] = _why_it_walks()
ILLUSTRATIONS["notation"] = _notation()
ILLUSTRATIONS["frictions"] = _frictions()
ILLUSTRATIONS["frictions-by-engine"] = _frictions_by_engine()
ILLUSTRATIONS["validation"] = _validation()
ILLUSTRATIONS["others"] = _repeated_experiments()
ILLUSTRATIONS["calibration"] = _calibration()


# --- what is out of date --------------------------------------------------------------------------


def digest(illustration: Illustration) -> str:
    """Twelve hex digits over the cases of an illustration and its versions.

    The binary of the engine does not count.
    """
    cases = illustration.cases()
    determinants: dict[str, Any] = {"cases": [case.determinants() for case in cases]}
    determinants.update(asdict(illustration.versions))
    if illustration.versions == _TODAY:
        changed = _changed_modules(cases)
        if changed:
            determinants["modules"] = changed
    return hashlib.sha256(json.dumps(determinants, sort_keys=True).encode()).hexdigest()[:12]


def _changed_modules(cases: Iterable[Case]) -> dict[str, int]:
    """Versions of the modules that measure the cases, where they differ from that of results."""
    versions = {}
    for case in cases:
        for module in modules_of(case):
            if module.VERSION != VERSION:
                versions[module.NAME] = module.VERSION
    return versions


def stale(docs: Path) -> dict[str, list[str]]:
    """Find what is out of date.

    Parameters
    ----------
    docs
        The folder docs/.

    Returns
    -------
    dict
        By illustration, its files that are missing or show other cases than the current ones.
        Illustrations without such files are left out.
    """
    record = read_json(docs / RECORD)
    stale_files = {}
    for name, illustration in ILLUSTRATIONS.items():
        today = digest(illustration)
        files = []
        for file in illustration.files:
            if record.get(file) != today or not (docs / file).is_file():
                files.append(file)
        if files:
            stale_files[name] = files
    return stale_files


def make_illustrations(out: Path, docs: Path, only: Sequence[str] = ()) -> list[Path]:
    """Make pictures and tables, then update the pages.

    Parameters
    ----------
    out
        Folder of the runs; missing runs are made.
    docs
        The folder docs/.
    only
        Names of `ILLUSTRATIONS`; if empty, all that are stale.

    Returns
    -------
    list of Path
        The written files and the pages that have changed.

    Raises
    ------
    InputError
        If an illustration does not exist.
    """
    for name in only:
        if name not in ILLUSTRATIONS:
            problem = Problem("", name, f"expected one of {', '.join(ILLUSTRATIONS)}")
            raise InputError("illustrations", [problem])
    written = []
    for name in only or stale(docs):
        print(f"walkers: {name}", file=sys.stderr)
        illustration = ILLUSTRATIONS[name]
        illustration.make(out, docs)
        record = read_json(docs / RECORD) | dict.fromkeys(illustration.files, digest(illustration))
        write_json(docs / RECORD, dict(sorted(record.items())))
        written += [docs / file for file in illustration.files]
    numbers = facts(docs)
    for page in pages_of(docs):
        text = page.read_text("utf-8")
        today = refreshed(text, numbers, lambda command: output_of(command, out))
        if without_hashes(today) != without_hashes(text):
            write_bytes(page, today.encode())
            written.append(page)
    return written


def pages_of(docs: Path) -> list[Path]:
    """README, the article and all pages of the documentation."""
    root = docs.parent
    return [root / "README.md", root / "studies" / "article.md", *sorted(docs.rglob("*.md"))]


# --- numbers and outputs on pages -----------------------------------------------------------------


def facts(docs: Path) -> dict[str, str]:
    """Numbers that sentences may quote.

    Parameters
    ----------
    docs
        The folder docs/ with its figures.

    Returns
    -------
    dict
        Texts by name: of the comparison with the paper, of the calibration, of `CHECKED`, of a
        cycle of a walker, and of the cells of tables.
    """
    numbers = _of_comparison(read_json(docs / "figures" / "comparison.json"))
    numbers |= tables.calibration_numbers(read_json(docs / "figures" / "calibration.json"))
    numbers |= _of_checks(read_json(docs / CHECKED)["lines"])
    for name, value in read_json(docs / _NUMBERS_OF_A_CYCLE).items():
        numbers[f"why_{name}"] = f"{value:.2g}"
    numbers |= dict(tables.cell_texts(docs / "figures"))
    return numbers


def _of_comparison(compared: Mapping[str, Any]) -> dict[str, str]:
    """Numbers of ``comparison.json`` with the shipped parameters."""
    shipped, counted = next(iter(compared["sets"].items()))
    numbers = {}
    for fact in compared["facts"]:
        value = fact["values"][shipped]
        if value is not None:
            numbers[fact["name"]] = f"{value:.3g}"
    numbers["agree"] = f"{counted['agree']} of {counted['of']}"
    ends = []
    for row in compared["thresholds"]:
        ends.append([row["gamma0_at_rest"], row["gamma0_moving"]])
    numbers["threshold"] = f"{np.mean(ends):.2f}"
    for row in compared["curve"]:
        if row["of"] == "Fig. 2, 5 g":
            numbers["by_frequency_5g"] = f"{row['by_frequency']:.2f}"
        name = "_".join(re.findall(r"\w+", row["of"].lower()))
        numbers[f"{name}_engine"] = f"{row['engine']:.3g}"
        numbers[f"{name}_paper"] = f"{row['curve']:.3g}"
    return numbers


def _of_checks(lines: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The measured and the expected number of each line by check and words, and summaries."""
    numbers: dict[str, str] = {}
    for line in lines:
        words = re.findall(r"\w+", f"{line['check']} {line['quantity']}".lower())
        name = "_".join(words)
        numbers[name] = f"{line['measured']:.4g}"
        numbers[f"{name}_expected"] = f"{line['expected']:.4g}"
    for check in LITERATURE:
        judged = []
        for line in lines:
            if line["check"] == check and line["tolerance"] is not None:
                judged.append(line)
        passed = sum(line["verdict"] == "pass" for line in judged)
        numbers[f"{check}_pass"] = f"{passed} of {len(judged)}"
        if check == "benchmarks":
            numbers |= _of_benchmarks(judged)
    return numbers | _of_crosscheck([line for line in lines if line["check"] == "crosscheck"])


def _of_benchmarks(judged: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The largest error of each benchmark test, per cent of its tolerance."""
    largest: dict[str, float] = {}
    for line in judged:
        test = line["quantity"][0]
        share = line["error"] / line["tolerance"]
        largest[test] = max(share, largest.get(test, 0.0))
    return {f"benchmarks_{test}": f"{100.0 * share:.0f}" for test, share in largest.items()}


def _of_crosscheck(lines: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Largest errors of whole runs, and the cycles after which piles move differently."""
    velocities = []
    distances = []
    cycles = []
    for line in lines:
        if line["quantity"].endswith(": velocity"):
            velocities.append(line["error"])
        if line["quantity"].endswith(": largest distance of a bead"):
            distances.append(line["measured"])
        if re.search("start .*: cycles", line["quantity"]):
            cycles.append(line["measured"])
    regular = distances[: -len(cycles)]  # piles, which are chaotic, come last
    return {
        "crosscheck_velocity": f"{max(velocities):.1g}",
        "crosscheck_distance": f"{max(regular):.1g}",
        "crosscheck_cycles": f"{min(cycles):.0f} to {max(cycles):.0f}",
    }


def refreshed(page: str, numbers: Mapping[str, str], printed: Callable[[str], str]) -> str:
    """Put the current numbers and outputs into a page.

    Parameters
    ----------
    page
        The text of the page.
    numbers
        Numbers of sentences by name, as from `facts`.
    printed
        Gives what a command prints.

    Returns
    -------
    str
        The new text of the page.
    """

    def fact(mark: re.Match[str]) -> str:
        return f"<!--fact {mark['name']}-->{numbers[mark['name']]}<!--/fact-->"

    def block(mark: re.Match[str]) -> str:
        return mark["head"] + printed(mark["command"])

    return _BLOCK.sub(block, _FACT.sub(fact, page))


without_hashes = partial(_RUN_HASH.sub, "")
"""A text without the hashes of run names, which depend on the engine binary."""


def output_of(command: str, out: Path) -> str:
    """Run a command on a case and return what it prints.

    Parameters
    ----------
    command
        The command as on a page, which has its runs in the folder ``runs``.
    out
        The folder of runs that is used instead.
    """
    _, name, *arguments = shlex.split(command)
    if "--theory" in arguments:
        # The command prints the result of the run beside the models, if there is one.
        case = next(word for word in arguments if not word.startswith("-"))
        run(case, out)
    words = [sys.executable, "-m", "walkers.main", name, *arguments, "--runs", str(out)]
    if name == "run":
        words.append("--force")  # otherwise the output says that it was run already
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return printed.replace(str(out), "runs")


if __name__ == "__main__":
    for path in make_illustrations(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]):
        print(path)
