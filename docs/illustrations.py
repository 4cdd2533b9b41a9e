"""What the documentation shows of our own numbers: pictures, tables, outputs of commands, numbers in sentences.

All of it follows from the shipped parameters. `make_illustrations` makes it anew and records, for each picture and
table, a digest of the cases that it shows; `stale` tells which are of other cases than today's.

Pages have two kinds of marks, which readers do not see. A block of code that begins with a command and stands below
``<!--output-->`` is what that command prints; ``<!--fact fig4b_velocity-->8.15<!--/fact-->`` is a number of the
comparison.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.calibration.calibrate import calibrate
from walkers.calibration.figures import draw
from walkers.calibration.report import rows_of, write_tables
from walkers.check.validate import validate
from walkers.inputs.calibration import load_calibration
from walkers.inputs.case import Case
from walkers.inputs.changes import flatten, settings_of
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import load_sweep
from walkers.paper.make import COMPARED, FIGURES, make_figures
from walkers.paper.model_terms import try_model_terms, write_model_terms
from walkers.pipeline import run
from walkers.postprocess.analysis import analyses
from walkers.postprocess.films import FilmOptions
from walkers.postprocess.series import render_run, render_series
from walkers.runner.files import read_json, write_json, write_text
from walkers.sweeps.scheduler import Options
from walkers.sweeps.site import cores_here
from walkers.templates.deck import CONTENT_VERSION

RECORD = Path("figures") / "made-from.json"
_BLOCK = re.compile(r"(?ms)(?P<head><!--output-->\n```console\n\$ (?P<command>walkers [^\n]+)\n)(?P<text>.*?)(?=^```)")
_FACT = re.compile(r"<!--fact (?P<name>\S+)-->(?P<text>[^<]*)<!--/fact-->")
_RUN_HASH = re.compile(r"-[0-9a-f]{12}\b")


@dataclass(frozen=True)
class Illustration:
    """Files of docs/, the cases whose runs they show, and what makes them: folder of the runs, folder of the docs."""

    files: tuple[str, ...]
    cases: Callable[[], Iterable[Case]]
    make: Callable[[Path, Path], None]


def _of_figure(name: str, *files: str, sweeps: Iterable[str]) -> Illustration:
    def make(out: Path, docs: Path) -> None:
        make_figures(out, docs / "figures", Options(cores_here()), only=[name], formats=("png",))

    return Illustration(files, lambda: _points(sweeps), make)


def _points(sweeps: Iterable[str]) -> Iterator[Case]:
    for sweep in sweeps:
        yield from load_sweep(sweep).cases()


def _rendered(name: str, case: str, *settings: str, apart: float | None = None) -> Illustration:
    """A picture of one run: as `walkers render` has it, or views so many s apart."""

    def make(out: Path, docs: Path) -> None:
        done, place = run(loaded(), out), docs / "pictures" / f"{name}.png"
        if apart is None:
            render_run(done.directory, place)
        else:
            render_series(done.directory, place, apart=apart)

    def loaded() -> Case:
        return load_case(case, settings_of(settings))

    return Illustration((f"pictures/{name}.png",), lambda: [loaded()], make)


def _model_terms(_: Path, docs: Path) -> None:
    write_model_terms(try_model_terms(), docs / "figures")


def _film(out: Path, docs: Path) -> None:
    options = FilmOptions(size=(512, 216), fps=20, slowdown=20.0, walker=0, end=0.4)
    run(load_case("fig1b", {"run.cycles": 60}), out).film(docs / "pictures" / "walker.gif", options)


def _validation(out: Path, docs: Path) -> None:
    made = validate(out, docs / "explanation", jobs=cores_here())
    for statement in made.failed:
        print(f"walkers: not as expected: {statement}", file=sys.stderr)


def _calibration(out: Path, docs: Path) -> None:
    found = calibrate(load_calibration("ruby"), out, Options(cores_here()))
    rows = rows_of(found)
    write_tables(found, rows, out / "ruby")
    draw(found, rows, out / "ruby")
    for name in ("bands", "corner", "predictions", "sobol"):
        shutil.copy(out / "ruby" / f"{name}.png", docs / "figures" / f"calibration-{name}.png")
    shutil.copy(out / "ruby" / "calibration.md", docs / "figures" / "calibration.md")


def _calibrated() -> list[Case]:
    """The experiments of the calibration with the shipped values of what it varies."""
    read = load_calibration("ruby")
    base = flatten(read.file.set, lambda _: False)
    return [load_case(read.file.case, {**base, **values}) for values in read.experiments.values()]


ILLUSTRATIONS: Mapping[str, Illustration] = {
    "walker": _rendered("walker", "fig1b", "run.cycles=60"),
    "film": Illustration(("pictures/walker.gif",), lambda: [load_case("fig1b", {"run.cycles": 60})], _film),
    "tray": _rendered("tray", "tray"),
    "climber": _rendered("climber", "climber"),
    "pile": _rendered("pile", "pile-small", "run.duration=10 s", apart=2.0),
    **{name: _of_figure(name, f"figures/{name}.png", sweeps=one.sweeps) for name, one in FIGURES.items()},
    "comparison": _of_figure("comparison", "figures/comparison.md", "figures/comparison.json", sweeps=COMPARED),
    "model-terms": Illustration(
        ("figures/model_terms.md", "figures/model_terms.json"),
        lambda: [load_case("fig1b"), load_case("fig4a")],
        _model_terms,
    ),
    "validation": Illustration(
        ("explanation/validation.md",),
        lambda: [load_case(name) for name in ("fig1b", "fig4a", "fig4b", "climber", "climber-dimer", "pile-ci")],
        _validation,
    ),
    "calibration": Illustration(
        tuple(f"figures/calibration-{name}.png" for name in ("bands", "corner", "predictions", "sobol")),
        _calibrated,
        _calibration,
    ),
}


def digest(cases: Iterable[Case]) -> str:
    """Twelve hex digits over all that cases' runs depend on but the engine's binary, and over how they are measured."""
    told = {
        "cases": [case.determinants() for case in cases],
        "decks": CONTENT_VERSION,
        "analyses": {one.name: one.version for one in analyses()},
    }
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:12]


def stale(docs: Path) -> list[str]:
    """Files of the documentation that are missing, or show other cases than today's."""
    record = recorded(docs)
    return [file for one in ILLUSTRATIONS.values() for file in _outdated(one, digest(one.cases()), record, docs)]


def _outdated(one: Illustration, today: str, record: Mapping[str, str], docs: Path) -> list[str]:
    return [file for file in one.files if record.get(file) != today or not (docs / file).is_file()]


def recorded(docs: Path) -> dict[str, str]:
    """The digest of the cases that each file was made from."""
    return read_json(docs / RECORD) if (docs / RECORD).is_file() else {}


def make_illustrations(out: Path, docs: Path, only: Sequence[str] = ()) -> list[Path]:
    """Make pictures and tables, then what pages print of them: those named, or all that are missing or of other cases.

    ``out`` is the folder of the run directories; runs that are missing are made.
    """
    for name in only:
        if name not in ILLUSTRATIONS:
            raise InputError("illustrations", [Problem("", name, f"expected one of {', '.join(ILLUSTRATIONS)}")])
    written = []
    for name, one in ILLUSTRATIONS.items():
        if only and name not in only:
            continue
        today = digest(one.cases())
        if only or _outdated(one, today, recorded(docs), docs):
            print(f"walkers: {name}", file=sys.stderr)
            one.make(out, docs)
            record = {**recorded(docs), **dict.fromkeys(one.files, today)}
            write_json(docs / RECORD, dict(sorted(record.items())))
            written += [docs / file for file in one.files]
    return written + refresh_pages(pages_of(docs), facts(docs), out)


def pages_of(docs: Path) -> list[Path]:
    """README and all pages of the documentation."""
    return [docs.parent / "README.md", *sorted(docs.rglob("*.md"))]


def facts(docs: Path) -> dict[str, str]:
    """Numbers that sentences may quote: the engine's of the comparison, three digits, and how many agree."""
    compared: dict[str, Any] = read_json(docs / "figures" / "comparison.json")
    numbers = {one["key"]: f"{one['engine']:.3g}" for one in compared["numbers"] if one["engine"] is not None}
    return {**numbers, "agree": f"{compared['agree']} of {compared['of']}"}


def refresh_pages(pages: Iterable[Path], known: Mapping[str, str], out: Path) -> list[Path]:
    """Write what today's commands print and today's numbers into pages; those that changed."""
    changed = []
    for page in pages:
        old = page.read_text("utf-8")
        new = _FACT.sub(lambda found: f"<!--fact {found['name']}-->{known[found['name']]}<!--/fact-->", old)
        new = _BLOCK.sub(lambda found: found["head"] + output_of(found["command"], out), new)
        if without_hashes(new) != without_hashes(old):
            write_text(page, new)
            changed.append(page)
    return changed


def outputs_in(page: Path) -> dict[str, str]:
    """The commands of a page whose output is below them, and that output; names of runs without their hash."""
    found = _BLOCK.finditer(page.read_text("utf-8"))
    return {one["command"]: without_hashes(one["text"]) for one in found}


def without_hashes(text: str) -> str:
    """A text with the names of runs without what depends on the engine's binary."""
    return _RUN_HASH.sub("", text)


def facts_in(page: Path) -> list[tuple[str, str]]:
    """The facts that a page quotes, and how."""
    return [(one["name"], one["text"]) for one in _FACT.finditer(page.read_text("utf-8"))]


def output_of(command: str, out: Path) -> str:
    """What a command on a case prints; runs are in ``runs``, wherever that is."""
    _, name, *arguments = shlex.split(command)
    if name == "theory":
        run(load_case(arguments[0]), out)  # which it prints beside the models
    words = [sys.executable, "-m", "walkers.main", name, *arguments, "--out", str(out)]
    words += ["--force"] if name == "run" else []  # else it says that it was run already
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return printed.replace(str(out), "runs")


def main() -> None:
    """``python -m docs.illustrations RUNS DOCS [NAME...]``."""
    out, docs, *only = sys.argv[1:]
    for path in make_illustrations(Path(out), Path(docs), only):
        print(path)


if __name__ == "__main__":
    main()
