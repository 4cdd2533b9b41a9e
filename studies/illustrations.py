"""What the documentation shows of our own numbers: pictures, tables, outputs of commands, numbers in sentences.

All of it follows from the shipped parameters. `make_illustrations` makes it anew and records, for each picture and
table, a digest of the cases that it shows; `stale` tells which are of other cases than today's.

Pages have two kinds of marks, which readers do not see:

    <!-- $ walkers theory fig1b -->                      the block below it is what this command prints
    <!--fact fig4b_velocity-->8.15<!--/fact-->          this number is the comparison's
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.inputs.changes import settings_of
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import load_sweep
from walkers.paper.make import COMPARED, FIGURES, make_figures
from walkers.paper.model_terms import try_model_terms, write_model_terms
from walkers.pipeline import run
from walkers.postprocess.analysis import analyses
from walkers.postprocess.pictures import render_run
from walkers.postprocess.series import render_series
from walkers.runner.files import read_json, write_json, write_text
from walkers.sweeps.scheduler import Options
from walkers.sweeps.site import cores_here
from walkers.templates.deck import CONTENT_VERSION

RECORD = Path("figures") / "made-from.json"
_BLOCK = re.compile(r"(?P<mark><!-- \$ (?P<command>walkers [^>]+) -->\n\n)(?P<block>(?:    [^\n]*\n|\n(?=    ))+)")
_FACT = re.compile(r"<!--fact (?P<name>\S+)-->(?P<text>[^<]*)<!--/fact-->")
_RUN_HASH = re.compile(r"-[0-9a-f]{12}\b")


@dataclass(frozen=True)
class Illustration:
    """Files of the documentation, the cases that they show, how they are made, and whether that takes long.

    Attributes
    ----------
    files
        In the documentation's folder.
    cases
        All whose runs they show.
    make
        Makes the files: folder of the runs, folder of the documentation.
    long
        Whether only if it is asked for by name: a quarter of an hour and more.
    """

    files: tuple[str, ...]
    cases: Callable[[], Iterable[Case]]
    make: Callable[[Path, Path], None]
    long: bool = False


def _of_figure(name: str) -> Illustration:
    return Illustration(
        (f"figures/{name}.png",),
        lambda: _points(FIGURES[name].sweeps),
        lambda out, docs: _figures(name, out, docs),
        long=FIGURES[name].only_asked,
    )


def _figures(name: str, out: Path, docs: Path) -> None:
    make_figures(out, docs / "figures", Options(cores_here()), only=[name], formats=("png",))


def _points(sweeps: Iterable[str]) -> Iterator[Case]:
    for sweep in sweeps:
        yield from load_sweep(sweep).cases()


def _rendered(name: str, case: str, *settings: str, apart: float | None = None, long: bool = False) -> Illustration:
    """A picture of one run: as `walkers render` has it, or views so many s apart."""

    def make(out: Path, docs: Path) -> None:
        done, place = run(loaded(), out), docs / "pictures" / f"{name}.png"
        if apart is None:
            render_run(done.directory, place)
        else:
            render_series(done.directory, place, apart=apart)

    def loaded() -> Case:
        return load_case(case, settings_of(settings))

    return Illustration((f"pictures/{name}.png",), lambda: [loaded()], make, long)


def _model_terms(out: Path, docs: Path) -> None:
    del out
    write_model_terms(try_model_terms(), docs / "figures")


ILLUSTRATIONS: Mapping[str, Illustration] = {
    "walker": _rendered("walker", "fig1b", "run.cycles=60"),
    "tray": _rendered("tray", "tray"),
    "climber": _rendered("climber", "climber"),
    "pile": _rendered("pile", "pile-small", "run.duration=10 s", apart=2.0, long=True),
    **{name: _of_figure(name) for name in FIGURES},
    "comparison": Illustration(
        ("figures/comparison.md", "figures/comparison.json"),
        lambda: _points(COMPARED),
        lambda out, docs: _figures("comparison", out, docs),
    ),
    "model-terms": Illustration(
        ("figures/model_terms.md", "figures/model_terms.json"),
        lambda: [load_case("fig1b"), load_case("fig4a")],
        _model_terms,
        long=True,
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
    record = read_json(docs / RECORD)
    return [
        file
        for one in ILLUSTRATIONS.values()
        for today in [digest(one.cases())]
        for file in one.files
        if record.get(file) != today or not (docs / file).is_file()
    ]


def make_illustrations(out: Path, docs: Path, only: Sequence[str] = ()) -> list[Path]:
    """Make pictures and tables of the documentation, then what its pages print of them.

    Parameters
    ----------
    out
        Folder of the run directories; runs that are missing are made.
    docs
        Folder of the documentation.
    only
        Names of `ILLUSTRATIONS`; if empty, all but those that take long and are of today's cases.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    InputError
        If there is no such illustration.
    """
    for name in only:
        if name not in ILLUSTRATIONS:
            raise InputError("illustrations", [Problem("", name, f"expected one of {', '.join(ILLUSTRATIONS)}")])
    old = set(stale(docs))
    written = []
    for name, one in ILLUSTRATIONS.items():
        if name in only or (not only and not (one.long and old.isdisjoint(one.files))):
            print(f"walkers: {name}", file=sys.stderr)
            one.make(out, docs)
            record = {**read_json(docs / RECORD), **dict.fromkeys(one.files, digest(one.cases()))}
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
    """Write what today's commands print and today's numbers into pages; those that changed.

    Raises
    ------
    KeyError
        If a page quotes a fact that there is not.
    """
    changed = []
    for page in pages:
        old = page.read_text("utf-8")
        new = _FACT.sub(lambda found: f"<!--fact {found['name']}-->{known[found['name']]}<!--/fact-->", old)
        new = _BLOCK.sub(lambda found: found["mark"] + _indented(output_of(found["command"], out)), new)
        if _RUN_HASH.sub("", new) != _RUN_HASH.sub("", old):
            write_text(page, new)
            changed.append(page)
    return changed


def outputs_in(page: Path) -> dict[str, str]:
    """The commands of a page whose output is below them, and that output; names of runs without their hash."""
    found = _BLOCK.finditer(page.read_text("utf-8"))
    return {one["command"]: _RUN_HASH.sub("", one["block"]) for one in found}


def facts_in(page: Path) -> list[tuple[str, str]]:
    """The facts that a page quotes, and how."""
    return [(one["name"], one["text"]) for one in _FACT.finditer(page.read_text("utf-8"))]


def output_of(command: str, out: Path) -> str:
    """What a command of this program prints; runs are in ``runs``, wherever that is.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    words = [sys.executable, "-m", "walkers.main", *shlex.split(command)[1:]]
    if words[3] in ("run", "theory", "sweep", "crosscheck", "result"):
        words += ["--out", str(out)]
    if words[3] == "run":
        words.append("--force")  # else it says that it was run already
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return printed.replace(str(out), "runs")


def _indented(text: str) -> str:
    return "".join(f"    {line}\n" if line else "\n" for line in text.rstrip("\n").split("\n"))


def main() -> None:
    """``python -m walkers.studies.illustrations RUNS DOCS [NAME...]``."""
    out, docs, *only = sys.argv[1:]
    for path in make_illustrations(Path(out), Path(docs), only):
        print(path)


if __name__ == "__main__":
    main()
