"""Options that several commands share, and functions that print."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number
from cyclopts.validators import Path as OfPath

from walkers import DEFAULT_OUT, RECORDS
from walkers.errors import input_error

if TYPE_CHECKING:
    from cyclopts.completion import CompletionContext

    from walkers.api import Run, Sweep


def _names(context: CompletionContext) -> list[str]:
    """For the completion of a shell: case files, shipped cases, and what is in the folder of runs."""
    from walkers.inputs.reading import shipped

    out = Path(context["out"].raw or DEFAULT_OUT)
    records = sorted(
        path.parent.name for file in RECORDS.values() for path in out.glob(f"*/{file}")
    )
    return [*(path.name for path in Path().glob("*.toml")), *shipped("case"), *records]


AT_LEAST_1 = Number(gte=1)
NOT_NEGATIVE = Number(gte=0)
_CASE = "A case file, the name of a shipped case such as fig1b, or a run (name or folder)."
_RUN = "its folder, its name in --out, or its case (file or name)."
CaseArgument = Annotated[str, Parameter(name="CASE", completer=_names, help=_CASE)]
RunArgument = Annotated[str, Parameter(name="RUN", completer=_names, help=f"A run: {_RUN}")]
RunOrSweepArgument = Annotated[
    str, Parameter(name="RUN|SWEEP", completer=_names, help=f"A run or a sweep: {_RUN}")
]
Folder = Annotated[Path, Parameter(validator=OfPath(file_okay=False))]
OutOption = Annotated[Folder, Parameter(help="Folder that contains the runs.")]
JobsOption = Annotated[
    int | None,
    Parameter(
        ("--jobs", "-j"),
        validator=AT_LEAST_1,
        help="Number of parallel decks; default: one per core.",
    ),
]
JsonOption = Annotated[bool, Parameter("--json", help="Print JSON in SI units.")]
FormatsOption = Annotated[
    list[str] | None,
    Parameter("--format", help="Format of the figures: png, svg or pdf. Repeatable."),
]


@Parameter(name="*")
@dataclass(frozen=True)
class LookupOptions:
    """The folder of runs, and new values of the case.

    Parameters
    ----------
    changes
        Replace a value of the case, such as drive.frequency=70Hz. Repeatable.
    """

    changes: Annotated[list[str] | None, Parameter("--set", metavar="KEY=VALUE")] = None
    out: OutOption = DEFAULT_OUT

    @property
    def values(self) -> dict[str, Any]:
        """The values given by ``--set``, by their keys."""
        from walkers.inputs.keys import settings_of

        return settings_of(self.changes or ())

    def load(self, name: str) -> Run | Sweep:
        """The named sweep or run."""
        from walkers.api import load

        return load(name, self.out, self.values)

    def run(self, name: str) -> Run:
        """The named run."""
        from walkers.api import Run
        from walkers.runs.names import not_a_run

        loaded = self.load(name)
        if not isinstance(loaded, Run):
            raise not_a_run(name, "sweep")
        return loaded


def _check_engine(_: object, name: str | None) -> None:
    """Refuse a binary that is not on this machine before anything is done."""
    if name and shutil.which(name) is None:
        raise input_error(f"--engine {name}", "expected the name or path of a liggghts binary")


EngineOption = Annotated[
    str | None, Parameter(validator=_check_engine, help="Name or path of the liggghts binary.")
]


def refuse(option: str, wrong: bool, why: str) -> None:
    """Raise an `InputError` with the reason if an option is ``wrong``."""
    if wrong:
        raise input_error(option, why)


def refuse_any(given: dict[str, Any], why: str) -> None:
    """Raise an `InputError` with the reason if one of these options is given."""
    if option := next((name for name, value in given.items() if value), None):
        raise input_error(f"--{option.replace('_', '-')}", why)


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
