"""Arguments and options that several commands share, and functions that print.

The texts of ``help`` are what ``walkers COMMAND --help`` prints.
"""

from __future__ import annotations

import json
import shutil
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number
from cyclopts.validators import Path as PathValidator

from walkers import DEFAULT_OUT, RECORDS
from walkers.errors import input_error
from walkers.terminal import message_text

if TYPE_CHECKING:
    from cyclopts.completion import CompletionContext

    from walkers.api import Run, Sweep
    from walkers.runs.names import Reference


def _completions(context: CompletionContext) -> list[str]:
    """Names that a shell completes: case files, shipped cases, runs and sweeps in ``--runs``."""
    from walkers.inputs.reading import shipped

    out = Path(context["out"].raw or DEFAULT_OUT)
    records: list[Path] = []
    for record_name in RECORDS.values():
        records += out.glob(f"*/{record_name}")
    in_folder = sorted(record.parent.name for record in records)
    case_files = [path.name for path in Path().glob("*.toml")]
    return [*case_files, *shipped("case"), *in_folder]


def _check_engine(_: object, name: str | None) -> None:
    """Refuse a binary that is not on this machine before anything is done."""
    if name and shutil.which(name) is None:
        raise input_error(f"--engine {name}", "expected the name or path of a liggghts binary")


AT_LEAST_1 = Number(gte=1)
"""Validator of a number of parallel decks, or of starts."""
NOT_NEGATIVE = Number(gte=0)
"""Validator of a time limit, s."""
_CASE = "A case file, the name of a shipped case such as fig1b, or a run (name or folder)."
_RUN = "its folder, its name in --runs, or its case (file or name)."

CaseArgument = Annotated[str, Parameter(name="CASE", completer=_completions, help=_CASE)]
RunArgument = Annotated[str, Parameter(name="RUN", completer=_completions, help=f"A run: {_RUN}")]
RunOrSweepArgument = Annotated[
    str, Parameter(name="RUN|SWEEP", completer=_completions, help=f"A run or a sweep: {_RUN}")
]
OutOption = Annotated[
    Path,
    Parameter(
        ("--runs", "--out"),
        validator=PathValidator(file_okay=False),
        help="Folder that contains the runs; WALKERS_RUNS in the environment sets its default.",
    ),
]
QuietOption = Annotated[
    bool, Parameter(("--quiet", "-q"), help="Print only results and errors, no progress.")
]
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
EngineOption = Annotated[
    str | None, Parameter(validator=_check_engine, help="Name or path of the liggghts binary.")
]


@Parameter(name="*")
@dataclass(frozen=True)
class LookupOptions:
    """Where a name is looked up, and new values of the case that it means.

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

    def find(self, name: str, *, quiet: bool = False) -> Reference:
        """What a name means.

        Keys that ``--set`` replaces by others are told on standard error, unless ``quiet``.
        """
        from walkers.runs.names import find

        reference = find(name, self.out, self.values)
        if not quiet:
            tell_replaced(reference.replaced)
        return reference

    def load(self, name: str) -> Run | Sweep:
        """The named run or sweep."""
        from walkers.api import load

        return load(self.find(name))

    def run(self, name: str) -> Run:
        """The named run; `InputError` if the name is that of a sweep."""
        return run_of(self.find(name))


def run_of(reference: Reference) -> Run:
    """The run that a reference means; `InputError` if it means a sweep."""
    from walkers.api import Run, load
    from walkers.runs.names import not_a_run

    loaded = load(reference)
    if not isinstance(loaded, Run):
        raise not_a_run(reference.given, "sweep")
    return loaded


def refuse(option: str, is_wrong: bool, reason: str) -> None:
    """Raise an `InputError` with a reason if an option is wrong."""
    if is_wrong:
        raise input_error(option, reason)


def refuse_any(options: Mapping[str, Any], reason: str) -> None:
    """Raise an `InputError` with a reason if one of several options is given.

    Parameters
    ----------
    options
        Values by the names of the options in Python; a false value is an option that is not given.
    reason
        Why none of them may be given.
    """
    for name, value in options.items():
        if value:
            raise input_error(f"--{name.replace('_', '-')}", reason)


def print_as(as_json: bool, value: Callable[[], Any], text: Callable[[], str]) -> None:
    """Print a value as JSON, or its text; only what is printed is computed."""
    if as_json:
        print(json.dumps(value(), indent=2, ensure_ascii=False))
    else:
        print(text())


def print_lines(lines: Iterable[object]) -> None:
    """Print one item per line, such as the paths of written files."""
    for line in lines:
        print(line)


def tell_replaced(replaced: Mapping[str, Sequence[str]]) -> None:
    """Tell which keys of a case the keys of ``--set`` replace, a line for each of these.

    Keys that replace the same, such as those of a table in the place of a number, share a line.

    Parameters
    ----------
    replaced
        The replaced keys by the keys that replace them.
    """
    replacing: dict[tuple[str, ...], list[str]] = {}
    for key, former in replaced.items():
        replacing.setdefault(tuple(former), []).append(key)
    for former_keys, keys in replacing.items():
        verb = "replaces" if len(keys) == 1 else "replace"
        tell(f"{', '.join(keys)} {verb} {', '.join(former_keys)} of the case")


@contextmanager
def warnings_shown(shown: bool) -> Iterator[None]:
    """Show the warnings of a ``with`` block, or leave them out."""
    with warnings.catch_warnings():
        if not shown:
            warnings.simplefilter("ignore")
        yield


def tell(*messages: str) -> None:
    """Print messages on standard error, a line each."""
    for message in messages:
        print(message_text(f"walkers: {message}", sys.stderr), file=sys.stderr, flush=True)
