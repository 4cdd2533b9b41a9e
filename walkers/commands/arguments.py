"""Arguments, options and functions that several commands share."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

from typer import Argument, Option

from walkers.completion import names_of_cases, offering

if TYPE_CHECKING:
    from walkers.api import Run as FoundRun
    from walkers.api import Sweep
    from walkers.inputs.case import Case as ResolvedCase
    from walkers.sweeps.scheduler import Options

_CASE = "A case file, the name of a shipped case such as fig1b, or a run (name or folder)."
_RUN = "A run: its folder, its name in --out, or its case (file or name)."
_RUN_OR_SWEEP = "A run or a sweep: its folder, its name in --out, or its case (file or name)."
_SET = "Replace a value of the case, such as drive.frequency=70Hz. Repeatable."
_AGE = "Only runs and sweeps older than this, such as 7d or 12h."

Case = Annotated[str, Argument(metavar="CASE", help=_CASE, autocompletion=offering("case", "run"))]
Run = Annotated[str, Argument(metavar="RUN", help=_RUN, autocompletion=offering("case", "run"))]
RunOrSweep = Annotated[
    str, Argument(metavar="RUN|SWEEP", help=_RUN_OR_SWEEP, autocompletion=offering("case", "run", "sweep"))
]
Out = Annotated[Path, Option(help="Folder that contains the runs.")]
Set = Annotated[list[str] | None, Option("--set", metavar="KEY=VALUE", help=_SET)]
EngineName = Annotated[str | None, Option(help="Name or path of the liggghts binary.")]
AllowFailedAudit = Annotated[
    bool, Option("--allow-failed-audit", help="Use an engine that failed walkers check engine.")
]
Jobs = Annotated[int | None, Option("-j", "--jobs", min=1, help="Number of parallel decks; default: one per core.")]
Json = Annotated[bool, Option("--json", help="Print JSON in SI units.")]
Formats = Annotated[list[str] | None, Option("--format", help="Format of the figures: png, svg or pdf. Repeatable.")]
SweepColumn = Annotated[str | None, Option(help="Sweeps: column of the table; default: velocity, or climbs for piles.")]
CaseName = Annotated[
    str | None, Option(metavar="NAME", help="Only runs of the case with this name.", autocompletion=names_of_cases)
]
OlderThan = Annotated[str | None, Option(metavar="AGE", help=_AGE)]


class By(TypedDict):
    """Arguments for the engine that runs cases."""

    engine: str | None
    allow_failed_audit: bool


def changes_of(settings: list[str] | None) -> dict[str, Any]:
    """The values given by ``--set``, by their keys."""
    from walkers.inputs.keys import settings_of

    return settings_of(settings or ())


def load_case(case: str, settings: list[str] | None, out: Path) -> ResolvedCase:
    """The named case, with changed values."""
    from walkers.api import case_at

    return case_at(case, out, changes_of(settings))[0]


def load_run(run: str, settings: list[str] | None, out: Path) -> FoundRun:
    """The named run, or that of its case with changed values."""
    from walkers.api import NOT_A_RUN, Run
    from walkers.errors import refused

    found = load_any(run, settings, out)
    if not isinstance(found, Run):
        raise refused(run, NOT_A_RUN["sweep"])
    return found


def load_any(what: str, settings: list[str] | None, out: Path) -> FoundRun | Sweep:
    """The named sweep or run, with changed values."""
    from walkers.api import load

    return load(what, out, changes_of(settings))


def on_cores(jobs: int | None) -> Options:
    """Options for a number of parallel decks on this machine; None: one per core."""
    from walkers.runner.launch import cores_here
    from walkers.sweeps.scheduler import Options

    return Options(jobs or cores_here())


def refuse(option: str, wrong: bool, why: str) -> None:
    """Raise an `InputError` with the reason if an option is ``wrong``."""
    from walkers.errors import refused

    if wrong:
        raise refused(option, why)


def refuse_given(options: dict[str, Any], why: str) -> None:
    """Raise an `InputError` with the reason if one of these options is given."""
    for option, value in options.items():
        refuse(option, value not in (None, False, [], ()), why)


def check_folder(option: str, folder: Path) -> None:
    """Refuse a folder that is a file."""
    refuse(option, folder.exists() and not folder.is_dir(), f"expected a folder, {folder} is a file")


def print_as(as_json: bool, value: Callable[[], Any], text: Callable[[], str]) -> None:
    """Print a value as JSON, or its text."""
    print(json.dumps(value(), indent=2, ensure_ascii=False) if as_json else text())


def print_lines(lines: Iterable[object]) -> None:
    """Print one item per line, such as the paths of written files."""
    for line in lines:
        print(line)


def tell(*messages: str) -> None:
    """Print messages on standard error."""
    for message in messages:
        print(f"walkers: {message}", file=sys.stderr, flush=True)
