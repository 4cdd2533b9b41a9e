"""What a user means by a name: a run, a sweep, a calibration, an archive, a deck or a case.

A name is looked up once, by `find`. The `Reference` that it gives knows its case and its run, and
is handed on.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from glob import escape
from pathlib import Path
from typing import Any, Literal, Protocol, TypeAlias, runtime_checkable

from walkers import DEFAULT_OUT, RECORDS
from walkers.errors import InputError, WalkersError, check_changes, check_text_or_path, input_error
from walkers.inputs.case_building import changed_case
from walkers.inputs.config_table import replaced_keys
from walkers.inputs.reading import find_input, is_sweep_file, load_case, shipped
from walkers.inputs.tables.case import Case, CaseFile
from walkers.inputs.toml import read_toml
from walkers.runner import run_directory
from walkers.runner.binary import find_engine
from walkers.runner.failures import EngineMissing
from walkers.runner.manifest import read_manifest

NotARun = Literal["sweep", "calibration", "archive", "deck", "folder"]
"""Kinds of names for which there is no single run."""
NameKind = Literal["run", "case"] | NotARun
"""What a name may mean; a deck is one that was run by hand, a folder one without a run."""


@runtime_checkable
class InDirectory(Protocol):
    """What has a directory, such as a `walkers.Run` or a `walkers.Sweep`, and is named by it."""

    @property
    def directory(self) -> Path:
        """The directory."""


Given: TypeAlias = "Case | str | Path | Mapping[str, Any]"
"""What may stand for a case: a resolved case, its file or name, or its tables."""
Changes: TypeAlias = "Mapping[str, Any] | None"
"""Other values of a case, by dotted keys."""

_NOT_A_RUN: Mapping[NotARun, str] = {
    "folder": "not a finished run: expected a folder with a manifest.json",
    "deck": 'is a deck that was run by hand; first do: walkers.run("{name}")',
    "calibration": "a calibration's outcome: its report is calibration.md",
    "sweep": 'is a sweep: expected one of its runs; walkers.load("{name}") loads it',
    "archive": "an archive: unpack it and give a run or a sweep in it",
}
"""Why a name of a kind is refused where a run is expected."""
_NOT_A_RUN_IN_COMMAND: Mapping[NotARun, str] = {
    "deck": "is a deck that was run by hand; first do: walkers run {name}",
    "sweep": "is a sweep: expected one of its runs; walkers list, plot and report take sweeps",
}
"""The same on the command line, where it differs."""


def not_a_run(name: object, kind: NotARun) -> InputError:
    """An error that says what a name means, where a run was expected."""
    in_command = _NOT_A_RUN_IN_COMMAND.get(kind)
    if in_command is not None:
        in_command = in_command.format(name=name)
    return input_error(name, _NOT_A_RUN[kind].format(name=name), in_command)


@dataclass(frozen=True)
class Reference:
    """What a user means by a name.

    Attributes
    ----------
    given
        The name, the path, or the case itself.
    kind
        What it is, without the changes: changed, a run is another case.
    path
        Where it is. For a run that is not finished, its final directory; for a shipped case, its
        name; for a case that is given itself, the folder ``out``.
    out
        Folder of the run directories.
    changes
        Other values of the case, by dotted keys.
    """

    given: Given
    kind: NameKind
    path: Path
    out: Path
    changes: Mapping[str, Any]

    @property
    def means_case(self) -> bool:
        """Whether it is a case, or something else whose case is changed."""
        return self.kind == "case" or bool(self.changes)

    @property
    def folder(self) -> Path:
        """The folder in which the run of the case belongs."""
        return self.path.parent if self.kind == "run" else self.out

    @cached_property
    def case(self) -> Case:
        """The case, with the changes.

        Raises
        ------
        InputError
            If it has no single case, or the case cannot be read.
        """
        given = self.given
        if isinstance(given, Case):
            return changed_case(given, self.changes)
        if isinstance(given, Mapping):
            return load_case(given, self.changes)
        if self.kind == "run":
            return changed_case(readable_case(self.path), self.changes)
        if self.kind in ("sweep", "calibration"):
            # The error of `find_input` says what the file or the directory is instead of a case.
            # There is none for a file whose kind it cannot tell.
            source = str(given) if is_sweep_file(Path(given)) else self.path
            find_input(source, "case")
            raise not_a_run(given, self.kind)
        if self.kind == "folder":
            raise input_error(given, "is a folder without a run")
        if self.kind in ("deck", "archive"):
            raise not_a_run(given, self.kind)
        return load_case(given, self.changes)

    @cached_property
    def replaced(self) -> Mapping[str, Sequence[str]]:
        """The keys of the case that its changes replace by other keys (`replaced_keys`).

        Empty if there are no changes, or if there is no case that can be read.
        """
        if not self.changes:
            return {}
        try:
            document = self._document
        except InputError:  # told when the case is used
            return {}
        return replaced_keys(CaseFile, document, self.changes)

    @property
    def _document(self) -> Mapping[str, Any]:
        """The tables of the case without the changes; empty if the name is not that of a case."""
        if isinstance(self.given, Case):
            return self.given.document
        if isinstance(self.given, Mapping):
            return self.given
        if self.kind == "run":
            return readable_case(self.path).document
        if self.kind == "case":
            return read_toml(find_input(self.given, "case"))
        return {}

    @cached_property
    def finished_run(self) -> Path | None:
        """The directory of the finished run of the case; None if there is none."""
        if self.kind == "run" and not self.changes:
            place = self.path
        else:
            try:
                place = run_directory.run_place(self.case, find_engine(), self.folder)
            except EngineMissing:
                return None
        if not run_directory.is_finished(place):
            return None
        return place


def find(
    given: Given | InDirectory | Reference,
    out: str | Path = DEFAULT_OUT,
    changes: Changes = None,
) -> Reference:
    """Find what a user means by a name. No case is read, and no run.

    A folder does not hide a shipped case of the same name. The file of a sweep means the sweep if
    it was run.

    Parameters
    ----------
    given
        The directory of a run or a sweep, its name in the folder ``out``, an archive, a deck that
        was run by hand, a run or a sweep itself, or a case (resolved, tables, file or shipped
        name). A reference is returned as it is, whatever ``out`` and ``changes`` are.
    out
        Folder of the run directories.
    changes
        Other values of the case, by dotted keys.

    Raises
    ------
    InputError
        If an argument is of another type.
    """
    if isinstance(given, Reference):
        return given
    if not isinstance(given, (Case, Mapping)):
        if isinstance(given, InDirectory):
            given = given.directory
        check_text_or_path("case", given, "a case, its file, name or tables, or a run")
    check_text_or_path("out", out)
    check_changes(changes)
    kind: NameKind = "case"
    path = Path(out)
    if isinstance(given, (str, Path)):
        path = Path(given)
        with suppress(OSError):  # a name that no file system accepts
            kind, path = next(_meanings(path, Path(out), is_shipped=str(given) in shipped("case")))
    return Reference(given, kind, path, Path(out), changes or {})


def _meanings(path: Path, out: Path, *, is_shipped: bool) -> Iterator[tuple[NameKind, Path]]:
    """What a path may mean, and where that is, the most likely first.

    Parameters
    ----------
    path
        What the user gave.
    out
        Folder of the run directories.
    is_shipped
        Whether it is the name of a shipped case.
    """
    kinds: tuple[NameKind, ...] = ("run", "sweep", "calibration")
    for place in (path, out / path):
        for kind in kinds:
            if (place / RECORDS[kind]).is_file():
                yield kind, place
        complete = place.parent / place.name.removesuffix(run_directory.UNFINISHED)
        if run_directory.is_run_name(complete.name) and is_begun(complete):
            yield "run", complete
        if run_directory.is_deck_folder(place) and not is_shipped:
            yield "deck", place
    for place in _draws_named(path.name, out):
        yield "run", place
    sweep = out / path.stem
    if (sweep / RECORDS["sweep"]).is_file() and is_sweep_file(path):
        yield "sweep", sweep
    if path.suffix == ".zip" and path.is_file():
        yield "archive", path
    if path.is_dir() and not is_shipped:
        yield "folder", path
    yield "case", path


def _draws_named(name: str, out: Path) -> list[Path]:
    """Finished runs of a name in the directories of spreads and accuracies."""
    if not run_directory.is_run_name(name):
        return []
    draws = []
    for place in out.glob(f"*/{escape(name)}"):
        if (place.parent / RECORDS["sweep"]).is_file() and run_directory.is_finished(place):
            draws.append(place)
    return draws


def is_begun(place: Path) -> bool:
    """Whether a place belongs to a running or interrupted run."""
    case = run_directory.unfinished(place) / run_directory.CASE_NAME
    return case.is_file() or run_directory.is_locked(place)


def readable_case(directory: Path) -> Case:
    """The case of a run, finished or not, whose files can be read.

    Parameters
    ----------
    directory
        The final directory of the run.

    Raises
    ------
    InputError
        If a file that describes the run cannot be read.
    """
    is_finished = run_directory.is_finished(directory)
    if is_finished:
        with refusing(directory, "the run's manifest.json"):
            read_manifest(directory)
    current = directory if is_finished else run_directory.unfinished(directory)
    with refusing(directory, "the run's case.json"):
        case = run_directory.case_of(current)
    if is_finished:
        with refusing(directory, "the run's layout.json"):
            run_directory.read_layout(run_directory.segment_directories(directory)[0])
    return case


@contextmanager
def refusing(directory: Path, contents: str) -> Iterator[None]:
    """Turn the errors of damaged files into an `InputError`.

    Parameters
    ----------
    directory
        What the message is about.
    contents
        What is read in the block, for the message.
    """
    try:
        yield
    except (
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        IndexError,
        WalkersError,
    ) as error:
        raise input_error(directory, f"{contents} cannot be read ({error})") from error
