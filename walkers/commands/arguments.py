"""Arguments and options that several commands share, and what commands do alike."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

from typer import Argument, Option

from walkers.completion import names_of_cases, offering

if TYPE_CHECKING:
    from walkers.inputs.case import Case as ResolvedCase
    from walkers.sweeps.scheduler import Options

_CASE = "A case file, or the name of a shipped case such as fig1b."
_RUN = "A run: its directory, its name in --out, or a case whose run is looked up there."
_RUN_OR_SWEEP = "A run or a sweep: its directory, its name in --out, or a case."
_SET = "Another value than the file's, such as drive.frequency=70Hz; repeatable."
_AGE = "Only what is older than this, such as 7d or 12h."

Case = Annotated[str, Argument(metavar="CASE", help=_CASE, autocompletion=offering("case"))]
Run = Annotated[str, Argument(metavar="RUN", help=_RUN, autocompletion=offering("case", "run"))]
RunOrSweep = Annotated[
    str, Argument(metavar="RUN|SWEEP", help=_RUN_OR_SWEEP, autocompletion=offering("case", "run", "sweep"))
]
Out = Annotated[Path, Option(help="Folder of the run directories.")]
Set = Annotated[list[str] | None, Option("--set", metavar="KEY=VALUE", help=_SET)]
EngineName = Annotated[str | None, Option(help="Name or path of the liggghts binary.")]
AllowFailedAudit = Annotated[bool, Option("--allow-failed-audit", help="Run on an engine that failed its audit.")]
Jobs = Annotated[int | None, Option("-j", "--jobs", min=1, help="Decks at once; all cores if left out.")]
Json = Annotated[bool, Option("--json", help="Print JSON, SI units.")]
Formats = Annotated[list[str] | None, Option("--format", help="Of the figures: png, svg or pdf; may be repeated.")]
SweepColumn = Annotated[str | None, Option(help="Of sweeps: a column; velocity, of piles climbs if left out.")]
CaseName = Annotated[
    str | None, Option(metavar="NAME", help="Only what is of the case of this name.", autocompletion=names_of_cases)
]
OlderThan = Annotated[str | None, Option(metavar="AGE", help=_AGE)]


class By(TypedDict):
    """What runs cases."""

    engine: str | None
    allow_failed_audit: bool


def load(case: str, settings: list[str] | None) -> ResolvedCase:
    """A case with values put beside its file."""
    from walkers.inputs.changes import settings_of
    from walkers.inputs.reading import load_case

    return load_case(case, settings_of(settings or ()))


def on_cores(jobs: int | None) -> Options:
    """So many decks at once on this machine; None for as many as it has cores."""
    from walkers.sweeps.scheduler import Options
    from walkers.sweeps.site import cores_here

    return Options(jobs or cores_here())


def refuse(option: str, wrong: bool, told: str) -> None:
    """Refuse an option if something is wrong with it, and tell what."""
    from walkers.inputs.errors import refused

    if wrong:
        raise refused(option, told)


def check_folder(option: str, folder: Path) -> None:
    """Refuse a file as a folder."""
    refuse(option, folder.exists() and not folder.is_dir(), f"expected a folder, {folder} is a file")


def print_as(as_json: bool, value: Callable[[], Any], text: Callable[[], str]) -> None:
    """Print a value as JSON, or its text."""
    print(json.dumps(value(), indent=2, ensure_ascii=False) if as_json else text())


def print_lines(lines: Iterable[object]) -> None:
    """Print each of some things, such as the paths of files that were written."""
    for line in lines:
        print(line)


def tell(*messages: str) -> None:
    """Print messages on standard error."""
    for message in messages:
        print(f"walkers: {message}", file=sys.stderr, flush=True)
