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
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from docs import effects, tables
from walkers import load_case, run, sweep
from walkers.api import Changes, climb
from walkers.calibration.calibrate import calibrate
from walkers.calibration.file import load_calibration
from walkers.calibration.report import write_outcome
from walkers.check import experiments
from walkers.check.benchmarks import curve_of, published
from walkers.check.lines import as_dict, failures, run_checks
from walkers.check.literature import LITERATURE
from walkers.errors import InputError, Problem
from walkers.inputs.case import Case
from walkers.inputs.sweep import load_sweep
from walkers.paper.make import COMPARED, FIGURES, make_figures
from walkers.paper.sources import sweep_of
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, save_figure, styled
from walkers.postprocess.results import VERSION
from walkers.runner.files import read_json, write_bytes, write_json
from walkers.sweeps.climbing import texts_of
from walkers.sweeps.scheduler import Options
from walkers.templates.deck import CONTENT_VERSION

if TYPE_CHECKING:
    from walkers.check.scenes import Bench

RECORD = Path("figures") / "made-from.json"
CHECKED = Path("figures") / "validation.json"
"""Lines of ``walkers check literature``, of which pages quote numbers."""
_BLOCK = re.compile(r"(?ms)(?P<head><!--output-->\n```console\n\$ (?P<command>walkers [^\n]+)\n)(?P<text>.*?)(?=^```)")
_FACT = re.compile(r"<!--fact (?P<name>\S+)-->(?P<text>[^<]*)<!--/fact-->")
_RUN_HASH = re.compile(r"-[0-9a-f]{12}\b")
_CLIMBS = {f"contact.roughness.bead_{surface}": "0.2 um" for surface in ("bead", "wall")}
"""The small pile of which clusters climb within its four seconds."""
_PILES = ("pile-starts", "pile-frictions", "pile-contacts", "pile-paper")
_OF_CLIMBS = (
    *("pile", "climbed", "climbs", "rate", "on plain walls", "in corners"),
    *("led by large", "p by chance", "speed (mm/s)"),
)
_OF_CALIBRATION = ("calibration.md", "calibration.json", "predictions.png")


@dataclass(frozen=True)
class Illustration:
    """Files of docs/, the cases that they show, and the function that makes them from the folders of runs and docs."""

    files: tuple[str, ...]
    cases: Callable[[], Iterable[Case]]
    make: Callable[[Path, Path], None]


def _of_figure(name: str, *files: str, sweeps: Iterable[str]) -> Illustration:
    def make(out: Path, docs: Path) -> None:
        make_figures(out, docs / "figures", Options(), only=[name], formats=("png",))

    return Illustration(files, lambda: [case for sweep in sweeps for case in sweep_of(sweep).cases()], make)


def _of_run(name: str, case: str, changes: Changes = None, film: Changes = None) -> Illustration:
    """A picture of one run as `walkers render` makes it, or a film."""
    file = f"pictures/{name}.gif" if film else f"pictures/{name}.png"

    def make(out: Path, docs: Path) -> None:
        done = run(load_case(case, changes), out)
        if film:
            done.film(docs / file, **film)
        else:
            done.render(docs / file)

    return Illustration((file,), lambda: [load_case(case, changes)], make)


def _make_climbs(out: Path, docs: Path) -> None:
    """Figure and table of the climbs in all sweeps of piles."""
    climbs = climb([sweep(name, out).directory for name in _PILES], to=docs / "figures" / "pile-climbs.png")
    rows = [{name: texts[name] for name in _OF_CLIMBS} for texts in map(texts_of, climbs)]
    write_bytes(docs / "figures" / "pile-climbs.md", tables.page(f"walkers climb {' '.join(_PILES)}", rows).encode())


def _make_validation(out: Path, docs: Path) -> None:
    lines = run_checks(LITERATURE, out)
    write_json(docs / CHECKED, as_dict(lines))
    save_figure(_benchmarks(), docs / "figures" / "benchmarks.png", (), title="Published benchmarks of impacts")
    for line in failures(lines):
        print(f"walkers: not as expected: {line.check}: {line.quantity}", file=sys.stderr)


@styled
def _benchmarks() -> Figure:
    """Published points and the curves of the second engine, without those of the second material of test 4."""
    panels = {key: panel for key, panel in published().items() if not key.startswith("alloy-")}
    figure, grid = new_figure(TWO_COLUMNS, 11.0, nrows=4, ncols=2)
    for axes, (key, panel) in zip(grid.flat, panels.items(), strict=True):
        for series, marker in zip(panel["series"], "osD^"[: len(panel["series"])], strict=True):
            axes.plot(*series["points"].T, marker, mfc="none", ms=4.0, label=series["name"])
        axes.plot(*curve_of(key), color="k", lw=1.0, label="second engine")
        axes.set(xlabel=panel["x"], ylabel=panel["y"], title=panel["title"])
        axes.set_xscale("log" if key == "spin" else "linear")
        legend_below(axes, ncols=2)
    letter_panels(grid.flat)
    return figure


def _make_others(_: Path, docs: Path) -> None:
    with experiments.workbench() as bench:
        save_figure(_experiments(bench), docs / "figures" / "others.png", (), title="Experiments of others")


@styled
def _experiments(bench: Bench) -> Figure:
    """Drift by two tones against phase and strength, and restitution on a wet plate against 1/St."""
    figure, (phases, strengths, impacts) = new_figure(TWO_COLUMNS, 3.2, ncols=3)
    at, fine = experiments.PHASES, np.arange(0.0, 181.0, 10.0)
    drifts = np.array([experiments.slider(bench, phase) for phase in at])
    curves = np.array([experiments.modelled(phase) for phase in fine])
    for number, strength in enumerate(experiments.STRENGTHS):
        phases.plot(at, drifts[:, number], "o", mfc="none", ms=4.0, color=f"C{number}")
        phases.plot(fine, curves[:, number], lw=1.0, color=f"C{number}", label=f"a = {strength:g} · 7/2 μg")
    phases.plot(fine, [experiments.weak(phase) for phase in fine], "k--", lw=1.0, label="weak friction")
    for number, phase in enumerate((0.0, 90.0)):
        of, curve = (
            -rows[list(places).index(phase)] * experiments.STRENGTHS for rows, places in ((drifts, at), (curves, fine))
        )
        strengths.plot(experiments.STRENGTHS, of, "o", mfc="none", ms=4.0, color=f"C{number}", label=f"{phase:g}°")
        strengths.plot(experiments.STRENGTHS, curve, lw=1.0, color=f"C{number}")
    for label, how in (
        ("70 GPa", {}),
        ("70 GPa, bridge from the film on", {"law": f"{experiments.__name__}:filmed"}),
        ("50 MPa", {"modulus": 5e7}),
    ):
        stokes, e = experiments.restitutions(bench, **how)
        impacts.plot(1.0 / stokes[:, 2], e[:, 2], "o-", mfc="none", ms=4.0, lw=1.0, label=label)
    inverse = np.array([0.0, 1.0 / stokes[:, 2].min()])
    loss = np.log(experiments.FILM / experiments.ROUGH) * inverse
    impacts.plot(inverse, experiments.RESTITUTION * (1.0 - loss), "k--", lw=1.0, label="lubrication, approach")
    phases.set(xlabel="phase of the second tone (°)", ylabel="drift / speed of the first tone")
    strengths.set(xlabel="a/(7/2 μg)", ylabel="drift / (7/2 μg/ω)")
    impacts.set(xlabel="1/St", ylabel="restitution", ylim=(0.0, 1.0), xticks=(0.0, 0.005, 0.01))
    for axes in (phases, strengths, impacts):
        legend_below(axes)
    letter_panels((phases, strengths, impacts))
    return figure


def _make_calibration(out: Path, docs: Path) -> None:
    write_outcome(calibrate(load_calibration("ruby"), out, Options()), out / "ruby")
    for name in _OF_CALIBRATION:
        shutil.copy(out / "ruby" / name, docs / "figures" / name.replace("predictions", "calibration"))


def _calibrated() -> list[Case]:
    """The experiments of the calibration with the shipped values of its parameters."""
    return list(load_calibration("ruby").sweep("ruby").cases())


_BY_FRICTION = {"x": "contact.friction.bead_wall", "y": "axial_velocity", "hue": "liquid.name"}
_SWEEPS: Mapping[str, Mapping[str, str]] = {
    "climb-liquids": {**_BY_FRICTION, "panels": "contact.roughness.bead_wall"},
    "climb-corner": _BY_FRICTION,
    "zoo": {"y": "axial_velocity", "hue": "none"},
    "zoo-corner": {"y": "axial_velocity"},
    "tray-phases": {"x": "drive.peak_acceleration", "y": "clustered_share", "hue": "walkers", "panels": "coverage"},
}
"""Sweeps and how their figures show them."""
_TABLES = {
    "climb-liquids": tables.least_frictions,
    "climb-corner": tables.least_frictions,
    "tray-phases": tables.means_of_trays,
}
"""Those of which there is a table too."""


def _of_sweep(name: str, options: Mapping[str, Any]) -> Illustration:
    """The figure of a sweep, and its table."""
    files = [f"figures/{name}.png", *([f"figures/{name}.md"] if name in _TABLES else [])]

    def make(out: Path, docs: Path) -> None:
        done = sweep(name, out)
        save_figure(done.figure(**options), docs / files[0], [point.directory.name for point in done.runs])
        for file in files[1:]:
            write_bytes(docs / file, tables.page(f"walkers list {name}", _TABLES[name](done.table())).encode())

    return Illustration(tuple(files), lambda: load_sweep(name).cases(), make)


def _shipped(*names: str) -> Callable[[], list[Case]]:
    return lambda: [load_case(name) for name in names]


ILLUSTRATIONS: Mapping[str, Illustration] = {
    "walker": _of_run("walker", "fig1b", {"run.cycles": 60}),
    "film": _of_run(
        *("walker", "fig1b", {"run.cycles": 60}),
        film={"size": (512, 216), "fps": 20, "slowdown": 20.0, "walker": 0, "end": 0.4},
    ),
    "tray": _of_run("tray", "tray"),
    "climber": _of_run("climber", "climber"),
    "pile-climbs": Illustration(
        ("figures/pile-climbs.png", "figures/pile-climbs.md"),
        lambda: [case for name in _PILES for case in load_sweep(name).cases()],
        _make_climbs,
    ),
    "pile": _of_run("pile", "pile-small", _CLIMBS),
    **{name: _of_figure(name, f"figures/{name}.png", sweeps=figure.sweeps) for name, figure in FIGURES.items()},
    **{name: _of_sweep(name, options) for name, options in _SWEEPS.items()},
    "comparison": _of_figure("comparison", "figures/comparison.md", "figures/comparison.json", sweeps=COMPARED),
    "unexplained": Illustration(
        ("figures/unexplained.md",),
        _shipped("fig1b", "fig4a", "fig4b"),
        lambda _, docs: write_bytes(docs / "figures" / "unexplained.md", effects.table().encode()),
    ),
    "validation": Illustration(
        (CHECKED.as_posix(), "figures/benchmarks.png"),
        _shipped("fig1b", "fig4a", "fig4b", "climber", "climber-dimer", "pile-ci"),
        _make_validation,
    ),
    "others": Illustration(("figures/others.png",), lambda: [load_case("symmetric")], _make_others),
    "calibration": Illustration(
        tuple(f"figures/calibration.{ending}" for ending in ("md", "json", "png")), _calibrated, _make_calibration
    ),
}


def digest(cases: Iterable[Case]) -> str:
    """Twelve hex digits over cases, deck version and version of the results; the engine binary does not count."""
    contents = {
        "cases": [case.determinants() for case in cases],
        "decks": CONTENT_VERSION,
        "results": VERSION,
    }
    return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()[:12]


def stale(docs: Path) -> dict[str, list[str]]:
    """The illustrations with files that are missing or show other cases than the current ones, and these files."""
    record, old = read_json(docs / RECORD), {}
    for name, illustration in ILLUSTRATIONS.items():
        today = digest(illustration.cases())
        old[name] = [file for file in illustration.files if record.get(file) != today or not (docs / file).is_file()]
    return {name: files for name, files in old.items() if files}


def make_illustrations(out: Path, docs: Path, only: Sequence[str] = ()) -> list[Path]:
    """Make the named pictures and tables, or all that are stale, then update the pages.

    ``out`` is the folder of the run directories. Missing runs are made.
    """
    for name in only:
        if name not in ILLUSTRATIONS:
            raise InputError("illustrations", [Problem("", name, f"expected one of {', '.join(ILLUSTRATIONS)}")])
    written = []
    for name in only or stale(docs):
        print(f"walkers: {name}", file=sys.stderr)
        illustration = ILLUSTRATIONS[name]
        illustration.make(out, docs)
        record = read_json(docs / RECORD) | dict.fromkeys(illustration.files, digest(illustration.cases()))
        write_json(docs / RECORD, dict(sorted(record.items())))
        written += [docs / file for file in illustration.files]
    return written + refresh_pages(pages_of(docs), facts(docs), out)


def pages_of(docs: Path) -> list[Path]:
    """README and all pages of the documentation."""
    return [docs.parent / "README.md", *sorted(docs.rglob("*.md"))]


def facts(docs: Path) -> dict[str, str]:
    """Numbers that sentences may quote: of comparison and calibration, of `CHECKED`, of the tables of climbs."""
    compared: dict[str, Any] = read_json(docs / "figures" / "comparison.json")
    shipped, counted = next(iter(compared["sets"].items()))
    values = {fact["name"]: fact["values"][shipped] for fact in compared["facts"]}
    numbers = {name: f"{value:.3g}" for name, value in values.items() if value is not None}
    numbers["agree"] = f"{counted['agree']} of {counted['of']}"
    numbers["threshold"] = f"{np.mean([list(row.values())[1:3] for row in compared['thresholds']]):.2f}"
    by_frequency = {row["of"]: row["by_frequency"] for row in compared["curve"]}
    numbers["by_frequency_5g"] = f"{by_frequency['Fig. 2, 5 g']:.2f}"
    checked = read_json(docs / CHECKED)["lines"]
    numbers |= tables.of_calibration(read_json(docs / "figures" / "calibration.json"))
    return {**numbers, **_of_checks(checked), **dict(tables.cells(docs / "figures"))}


def _of_checks(lines: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The measured and the expected number of each line by check and words, and some numbers of many lines."""
    numbers: dict[str, str] = {}
    for line in lines:
        name = "_".join(re.findall(r"\w+", f"{line['check']} {line['quantity']}".lower()))
        numbers |= {name: f"{line['measured']:.4g}", f"{name}_expected": f"{line['expected']:.4g}"}
    for check in LITERATURE:
        judged = [line for line in lines if line["check"] == check and line["tolerance"] is not None]
        passed = sum(line["verdict"] == "pass" for line in judged)
        numbers[f"{check}_pass"] = f"{passed} of {len(judged)}"
        for test in sorted({line["quantity"][0] for line in judged} if check == "benchmarks" else ()):
            shares = [line["error"] / line["tolerance"] for line in judged if line["quantity"].startswith(test)]
            numbers[f"benchmarks_{test}"] = f"{100.0 * max(shares):.0f}"
    crossed = [line for line in lines if line["check"] == "crosscheck"]
    walked = [line["error"] for line in crossed if line["quantity"].endswith(": velocity")]
    apart = [line["measured"] for line in crossed if line["quantity"].endswith(": largest distance of a bead")]
    cycles = [line["measured"] for line in crossed if re.search("start .*: cycles", line["quantity"])]
    return {
        **numbers,
        "crosscheck_velocity": f"{max(walked):.1g}",
        "crosscheck_distance": f"{max(apart[: -len(cycles)]):.1g}",
        "crosscheck_cycles": f"{min(cycles):.0f} to {max(cycles):.0f}",
    }


def refresh_pages(pages: Iterable[Path], numbers: Mapping[str, str], out: Path) -> list[Path]:
    """Write the current outputs and numbers into pages; return the pages that changed."""
    changed = []
    for page in pages:
        old = page.read_text("utf-8")
        new = _FACT.sub(lambda fact: f"<!--fact {fact['name']}-->{numbers[fact['name']]}<!--/fact-->", old)
        new = _BLOCK.sub(lambda block: block["head"] + output_of(block["command"], out), new)
        if without_hashes(new) != without_hashes(old):
            write_bytes(page, new.encode())
            changed.append(page)
    return changed


def outputs_in(page: Path) -> dict[str, str]:
    """The commands of a page with their outputs, without the hashes of run names."""
    return {block["command"]: without_hashes(block["text"]) for block in _BLOCK.finditer(page.read_text("utf-8"))}


def facts_in(page: Path) -> list[tuple[str, str]]:
    """The names and texts of the facts that a page quotes."""
    return [(fact["name"], fact["text"]) for fact in _FACT.finditer(page.read_text("utf-8"))]


without_hashes = partial(_RUN_HASH.sub, "")
"""A text without the hashes of run names, which depend on the engine binary."""


def output_of(command: str, out: Path) -> str:
    """What a command on a case prints; runs are in ``runs``, wherever that is."""
    _, name, *arguments = shlex.split(command)
    if "--theory" in arguments:
        run(next(word for word in arguments if not word.startswith("-")), out)  # which it prints beside the models
    words = [sys.executable, "-m", "walkers.main", name, *arguments, "--out", str(out)]
    words += ["--force"] if name == "run" else []  # else it says that it was run already
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return printed.replace(str(out), "runs")


if __name__ == "__main__":
    for path in make_illustrations(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]):
        print(path)
