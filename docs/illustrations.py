"""Pictures, tables, outputs of commands and numbers in the documentation that come from simulations.

All of them follow from the shipped parameters. `make_illustrations` makes them again and records a digest of the cases
that each picture and table shows. `stale` lists those that show other cases than the current ones.

Pages contain two kinds of invisible marks. A code block below ``<!--output-->`` begins with a command and contains its
output. ``<!--fact fig4b_velocity-->8.15<!--/fact-->`` contains a number of the comparison.
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
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from docs import tables
from studies import effects
from studies.literature import experiments
from studies.literature.benchmarks import curve_of, published
from studies.literature.checks import LITERATURE
from studies.paper.make import COMPARED, FIGURES, make_figures
from studies.paper.sources import sweep_of
from walkers import load_case, run, sweep
from walkers.api import Changes, climb
from walkers.calibration.calibrate import calibrate
from walkers.calibration.file import load_calibration
from walkers.calibration.report import write_outcome
from walkers.errors import InputError, Problem
from walkers.files import read_json, write_bytes, write_json
from walkers.inputs.sweep import SweepDefinition, load_sweep
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.results import VERSION, modules_of
from walkers.postprocess.show.drawing import (
    TWO_COLUMNS,
    legend_below,
    letter_panels,
    new_figure,
    save_figure,
    styled,
)
from walkers.second_engine.lines import as_dict, failures, run_checks
from walkers.sweeps.climbing_output import texts_of
from walkers.sweeps.scheduler import SweepOptions
from walkers.templates.deck import CONTENT_VERSION

if TYPE_CHECKING:
    from walkers.second_engine.scenes import Bench

RECORD = Path("figures") / "made-from.json"
CHECKED = Path("figures") / "validation.json"
"""Lines of ``python -m studies.literature``, of which pages quote numbers."""
_BLOCK = re.compile(
    r"(?ms)(?P<head><!--output-->\n```console\n\$ (?P<command>walkers [^\n]+)\n).*?(?=^```)"
)
_FACT = re.compile(r"<!--fact (?P<name>\S+)-->[^<]*<!--/fact-->")
_RUN_HASH = re.compile(r"-[0-9a-f]{12}\b")
_PILES = ("pile-starts", "pile-frictions", "pile-contacts", "pile-paper")
_OF_CLIMBS = (
    *("pile", "climbed", "half by (s)", "climbs", "rate", "on plain walls", "in corners"),
    *("led by large", "p by chance", "speed (mm/s)"),
)


Make: TypeAlias = Callable[[Path, Path], object]
"""Makes the files of an illustration from the folders of runs and docs."""


class Versions(NamedTuple):
    """Versions of the decks and of the results with which an illustration was made."""

    decks: int = CONTENT_VERSION
    results: int = VERSION


class Illustration(NamedTuple):
    """Files of docs/, the cases that they show, and the function and the versions that make them."""

    files: tuple[str, ...]
    cases: Callable[[], Iterable[Case]]
    make: Make
    versions: Versions


_TODAY = Versions()
_OF_PILES = Versions(decks=9, results=1)
"""Statistics of chaotic piles stand until what piles do changes: four core-hours, for other last digits of tables."""


ILLUSTRATIONS: dict[str, Illustration] = {}


def _illustration(
    name: str, *files: str, cases: Callable[[], Iterable[Case]], versions: Versions = _TODAY
) -> Callable[[Make], Make]:
    def enter(make: Make) -> Make:
        ILLUSTRATIONS[name] = Illustration(files, cases, make, versions)
        return make

    return enter


def _cases(
    *names: str, of: Callable[[str], SweepDefinition] = load_sweep
) -> Callable[[], Iterable[Case]]:
    """The cases of sweeps."""
    return lambda: [case for name in names for case in of(name).cases()]


def _shipped(*names: str, changes: Changes = None) -> Callable[[], Iterable[Case]]:
    return lambda: [load_case(name, changes) for name in names]


def _picture(
    name: str, case: str, changes: Changes = None, film: Changes = None, walker: int | None = None
) -> None:
    """A picture of one run, or of one walker in it, as `walkers render` makes it, or a film."""
    file = f"pictures/{name}"

    @_illustration(
        Path(name).stem if not film else "film", file, cases=_shipped(case, changes=changes)
    )
    def make(out: Path, docs: Path) -> None:
        done = run(load_case(case, changes), out)
        done.film(docs / file, **film) if film else done.render(docs / file, walker=walker)


_picture("walker.png", "fig1b", {"run.cycles": 60})
_FILM = {"size": (512, 216), "fps": 20, "slowdown": 20.0, "walker": 0, "end": 0.4}
_picture("walker.gif", "fig1b", {"run.cycles": 60}, film=_FILM)
_picture("tray.png", "tray")
_picture("climber.png", "climber", walker=3)  # it starts 9.7° off the vertical, furthest of all six
_picture("pile.png", "pile-small")


def _of_paper(name: str, *files: str, sweeps: Iterable[str]) -> None:
    @_illustration(name, *files, cases=_cases(*sweeps, of=sweep_of))
    def make(out: Path, docs: Path) -> None:
        make_figures(out, docs / "figures", SweepOptions(), only=[name], formats=("png",))


for _name, _figure in FIGURES.items():
    _of_paper(_name, f"figures/{_name}.png", sweeps=_figure.sweeps)
_of_paper("comparison", "figures/comparison.md", "figures/comparison.json", sweeps=COMPARED)

_BY_FRICTION = {"x": "contact.friction.bead_wall", "y": "axial_velocity", "hue": "liquid.name"}
_SWEEPS: Mapping[str, tuple[Mapping[str, str], Callable[[Any], list[dict[str, str]]] | None]] = {
    "climb-liquids": (
        {**_BY_FRICTION, "panels": "contact.roughness.bead_wall"},
        tables.least_frictions,
    ),
    "climb-corner": (_BY_FRICTION, tables.least_frictions),
    "zoo": ({"y": "axial_velocity", "hue": "none"}, None),
    "zoo-corner": ({"y": "axial_velocity"}, None),
    "tray-phases": (
        {
            "x": "drive.peak_acceleration",
            "y": "clustered_share",
            "hue": "walkers",
            "panels": "coverage",
        },
        tables.means_of_trays,
    ),
}
"""Sweeps, how their figures show them, and the rows of their tables if they have one."""


_ZOOS = ("zoo", "zoo-corner")
"""Sweeps of clusters, whose figures show how many stay upright."""


@styled
def mark_upright(figure: Figure, table: pd.DataFrame) -> None:
    """Fill the symbols of clusters by how many of their walkers stay upright: all, some, or none."""
    (axes,) = [panel for panel in figure.axes if panel.lines]
    (points,) = [line for line in axes.lines if line.get_marker() == "o"]
    shares = table["upright"].to_numpy(dtype=float) / table["walkers"].to_numpy(dtype=float)
    places, heights = map(np.asarray, points.get_data())
    points.set_marker("none")
    kinds = {
        "all upright": ("full", shares == 1.0),
        "some upright": ("left", (shares > 0.0) & (shares < 1.0)),
        "none upright": ("none", shares == 0.0),
    }
    for label, (fill, of_kind) in kinds.items():
        look = {
            "fillstyle": fill,
            "markerfacecoloralt": "white",
            "markersize": 6.0,
            "clip_on": False,
        }
        axes.plot(places[of_kind], heights[of_kind], "ko", label=label, zorder=3, **look)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)


def _of_sweep(name: str) -> None:
    options, rows = _SWEEPS[name]
    files = [f"figures/{name}.png", *([f"figures/{name}.md"] if rows else [])]

    @_illustration(name, *files, cases=_cases(name))
    def make(out: Path, docs: Path) -> None:
        done = sweep(name, out)
        figure = done.figure(**options)
        if name in _ZOOS:
            mark_upright(figure, done.table())
        save_figure(figure, docs / files[0], [point.directory.name for point in done.runs])
        if rows:
            write_bytes(
                docs / files[1], tables.page(f"walkers list {name}", rows(done.table())).encode()
            )


for _name in _SWEEPS:
    _of_sweep(_name)


@_illustration(
    "pile-climbs",
    "figures/pile-climbs.png",
    "figures/pile-climbs.md",
    cases=_cases(*_PILES),
    versions=_OF_PILES,
)
def _make_climbs(out: Path, docs: Path) -> None:
    climbs = climb(
        [sweep(name, out).directory for name in _PILES], to=docs / "figures" / "pile-climbs.png"
    )
    rows = [{name: texts[name] for name in _OF_CLIMBS} for texts in map(texts_of, climbs)]
    write_bytes(
        docs / "figures" / "pile-climbs.md",
        tables.page(f"walkers climb {' '.join(_PILES)}", rows).encode(),
    )


@_illustration("unexplained", "figures/unexplained.md", cases=_shipped("fig1b", "fig4a", "fig4b"))
def _make_effects(_: Path, docs: Path) -> None:
    write_bytes(
        docs / "figures" / "unexplained.md", tables.page(effects.COMMAND, effects.rows()).encode()
    )


_CHECKED_CASES = _shipped("fig1b", "fig4a", "fig4b", "climber", "climber-dimer", "pile-ci")


@_illustration("validation", CHECKED.as_posix(), "figures/benchmarks.png", cases=_CHECKED_CASES)
def _make_validation(out: Path, docs: Path) -> None:
    lines = run_checks(LITERATURE, out)
    write_json(docs / CHECKED, as_dict(lines))
    save_figure(
        _benchmarks(),
        docs / "figures" / "benchmarks.png",
        (),
        title="Published benchmarks of impacts",
    )
    for line in failures(lines):
        print(f"walkers: not as expected: {line.check}: {line.quantity}", file=sys.stderr)


@styled
def _benchmarks() -> Figure:
    """Published points and the curves of the second engine, without those of the second material of test 4."""
    panels = {key: panel for key, panel in published().items() if not key.startswith("alloy-")}
    figure = new_figure(TWO_COLUMNS, 11.0)
    grid = figure.subplots(nrows=4, ncols=2)
    for axes, (key, panel) in zip(grid.flat, panels.items(), strict=True):
        for series, marker in zip(panel["series"], "osD^"[: len(panel["series"])], strict=True):
            axes.plot(*series["points"].T, marker, mfc="none", ms=4.0, label=series["name"])
        axes.plot(*curve_of(key), color="k", lw=1.0, label="second engine")
        axes.set(xlabel=panel["x"], ylabel=panel["y"], title=panel["title"])
        axes.set_xscale("log" if key == "spin" else "linear")
        legend_below(axes, ncols=2)
    letter_panels(grid.flat)
    return figure


@_illustration("others", "figures/others.png", cases=_shipped("symmetric"))
def _make_others(_: Path, docs: Path) -> None:
    with experiments.workbench() as bench:
        save_figure(
            _experiments(bench), docs / "figures" / "others.png", (), title="Experiments of others"
        )


@styled
def _experiments(bench: Bench) -> Figure:
    """Drift by two tones against phase and strength, and restitution on a wet plate against 1/St."""
    figure = new_figure(TWO_COLUMNS, 3.2)
    phases, strengths, impacts = figure.subplots(ncols=3)
    at, fine = experiments.PHASES, np.arange(0.0, 181.0, 10.0)
    drifts = np.array([experiments.measured_drift(bench, phase) for phase in at])
    curves = np.array([experiments.coulomb_drift(phase) for phase in fine])
    for number, strength in enumerate(experiments.STRENGTHS):
        phases.plot(at, drifts[:, number], "o", mfc="none", ms=4.0, color=f"C{number}")
        phases.plot(
            fine, curves[:, number], lw=1.0, color=f"C{number}", label=f"a = {strength:g} · 7/2 μg"
        )
    phases.plot(
        fine,
        [experiments.weak_friction_drift(phase) for phase in fine],
        "k--",
        lw=1.0,
        label="weak friction",
    )
    for number, phase in enumerate((0.0, 90.0)):
        of, curve = (
            -rows[list(places).index(phase)] * experiments.STRENGTHS
            for rows, places in ((drifts, at), (curves, fine))
        )
        strengths.plot(
            experiments.STRENGTHS,
            of,
            "o",
            mfc="none",
            ms=4.0,
            color=f"C{number}",
            label=f"{phase:g}°",
        )
        strengths.plot(experiments.STRENGTHS, curve, lw=1.0, color=f"C{number}")
    for label, how in (
        ("70 GPa", {}),
        ("70 GPa, bridge from the film on", {"law": f"{experiments.__file__}:law_with_film"}),
        ("50 MPa", {"modulus": 5e7}),
    ):
        stokes, e = experiments.restitutions(bench, **how)
        impacts.plot(1.0 / stokes[:, 2], e[:, 2], "o-", mfc="none", ms=4.0, lw=1.0, label=label)
    inverse = np.array([0.0, 1.0 / stokes[:, 2].min()])
    loss = np.log(experiments.FILM / experiments.ROUGHNESS) * inverse
    impacts.plot(
        inverse,
        experiments.DRY_RESTITUTION * (1.0 - loss),
        "k--",
        lw=1.0,
        label="lubrication, approach",
    )
    phases.set(xlabel="phase of the second tone (°)", ylabel="drift / speed of the first tone")
    strengths.set(xlabel="a/(7/2 μg)", ylabel="drift / (7/2 μg/ω)")
    impacts.set(xlabel="1/St", ylabel="restitution", ylim=(0.0, 1.0), xticks=(0.0, 0.005, 0.01))
    for axes in (phases, strengths, impacts):
        legend_below(axes)
    letter_panels((phases, strengths, impacts))
    return figure


_CALIBRATED = {
    f"figures/{name.replace('predictions', 'calibration')}": name
    for name in ("calibration.md", "calibration.json", "predictions.png")
}


@_illustration(
    "calibration", *_CALIBRATED, cases=lambda: load_calibration("ruby").sweep("ruby").cases()
)
def _make_calibration(out: Path, docs: Path) -> None:
    write_outcome(calibrate(load_calibration("ruby"), out, SweepOptions()), out / "ruby")
    for file, name in _CALIBRATED.items():
        shutil.copy(out / "ruby" / name, docs / file)


def _changed_modules(cases: Iterable[Case]) -> dict[str, int]:
    """Versions of the modules that measure the cases, where they differ from that of results."""
    modules = [module for case in cases for module in modules_of(case)]
    return {module.NAME: module.VERSION for module in modules if module.VERSION != VERSION}


def digest(illustration: Illustration) -> str:
    """Twelve hex digits over the cases of an illustration and its versions; the engine binary does not count."""
    cases = list(illustration.cases())
    determinants = [case.determinants() for case in cases]
    contents = {"cases": determinants, **illustration.versions._asdict()}
    if illustration.versions == _TODAY and (changed := _changed_modules(cases)):
        contents["modules"] = changed
    return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()[:12]


def stale(docs: Path) -> dict[str, list[str]]:
    """The illustrations with files that are missing or show other cases than the current ones, and these files."""
    record, old = read_json(docs / RECORD), {}
    for name, illustration in ILLUSTRATIONS.items():
        today = digest(illustration)
        old[name] = [
            file
            for file in illustration.files
            if record.get(file) != today or not (docs / file).is_file()
        ]
    return {name: files for name, files in old.items() if files}


def make_illustrations(out: Path, docs: Path, only: Sequence[str] = ()) -> list[Path]:
    """Make the named pictures and tables, or all that are stale, then update the pages.

    ``out`` is the folder of the run directories. Missing runs are made.
    """
    for name in only:
        if name not in ILLUSTRATIONS:
            raise InputError(
                "illustrations", [Problem("", name, f"expected one of {', '.join(ILLUSTRATIONS)}")]
            )
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
        old = page.read_text("utf-8")
        new = refreshed(old, numbers, lambda command: output_of(command, out))
        if without_hashes(new) != without_hashes(old):
            write_bytes(page, new.encode())
            written.append(page)
    return written


def pages_of(docs: Path) -> list[Path]:
    """README, the article and all pages of the documentation."""
    return [
        docs.parent / "README.md",
        docs.parent / "studies" / "article.md",
        *sorted(docs.rglob("*.md")),
    ]


def facts(docs: Path) -> dict[str, str]:
    """Numbers that sentences may quote: of comparison and calibration, of `CHECKED`, of the tables of climbs."""
    compared: dict[str, Any] = read_json(docs / "figures" / "comparison.json")
    shipped, counted = next(iter(compared["sets"].items()))
    values = {fact["name"]: fact["values"][shipped] for fact in compared["facts"]}
    numbers = {name: f"{value:.3g}" for name, value in values.items() if value is not None}
    numbers["agree"] = f"{counted['agree']} of {counted['of']}"
    numbers["threshold"] = (
        f"{np.mean([list(row.values())[1:3] for row in compared['thresholds']]):.2f}"
    )
    by_frequency = {row["of"]: row["by_frequency"] for row in compared["curve"]}
    numbers["by_frequency_5g"] = f"{by_frequency['Fig. 2, 5 g']:.2f}"
    checked = read_json(docs / CHECKED)["lines"]
    numbers |= tables.calibration_numbers(read_json(docs / "figures" / "calibration.json"))
    return {**numbers, **_of_checks(checked), **dict(tables.cell_texts(docs / "figures"))}


def _of_checks(lines: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The measured and the expected number of each line by check and words, and some numbers of many lines."""
    numbers: dict[str, str] = {}
    for line in lines:
        name = "_".join(re.findall(r"\w+", f"{line['check']} {line['quantity']}".lower()))
        numbers |= {name: f"{line['measured']:.4g}", f"{name}_expected": f"{line['expected']:.4g}"}
    for check in LITERATURE:
        judged = [
            line for line in lines if line["check"] == check and line["tolerance"] is not None
        ]
        passed = sum(line["verdict"] == "pass" for line in judged)
        numbers[f"{check}_pass"] = f"{passed} of {len(judged)}"
        for test in sorted(
            {line["quantity"][0] for line in judged} if check == "benchmarks" else ()
        ):
            shares = [
                line["error"] / line["tolerance"]
                for line in judged
                if line["quantity"].startswith(test)
            ]
            numbers[f"benchmarks_{test}"] = f"{100.0 * max(shares):.0f}"
    crossed = [line for line in lines if line["check"] == "crosscheck"]
    walked = [line["error"] for line in crossed if line["quantity"].endswith(": velocity")]
    apart = [
        line["measured"]
        for line in crossed
        if line["quantity"].endswith(": largest distance of a bead")
    ]
    cycles = [
        line["measured"] for line in crossed if re.search("start .*: cycles", line["quantity"])
    ]
    return {
        **numbers,
        "crosscheck_velocity": f"{max(walked):.1g}",
        "crosscheck_distance": f"{max(apart[: -len(cycles)]):.1g}",
        "crosscheck_cycles": f"{min(cycles):.0f} to {max(cycles):.0f}",
    }


def refreshed(page: str, numbers: Mapping[str, str], printed: Callable[[str], str]) -> str:
    """The text of a page with the current numbers, and with what its commands print."""
    page = _FACT.sub(
        lambda fact: f"<!--fact {fact['name']}-->{numbers[fact['name']]}<!--/fact-->", page
    )
    return _BLOCK.sub(lambda block: block["head"] + printed(block["command"]), page)


without_hashes = partial(_RUN_HASH.sub, "")
"""A text without the hashes of run names, which depend on the engine binary."""


def output_of(command: str, out: Path) -> str:
    """What a command on a case prints; runs are in ``runs``, wherever that is."""
    _, name, *arguments = shlex.split(command)
    if "--theory" in arguments:
        run(
            next(word for word in arguments if not word.startswith("-")), out
        )  # which it prints beside the models
    words = [sys.executable, "-m", "walkers.main", name, *arguments, "--out", str(out)]
    words += ["--force"] if name == "run" else []  # else it says that it was run already
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return printed.replace(str(out), "runs")


if __name__ == "__main__":
    for path in make_illustrations(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]):
        print(path)
