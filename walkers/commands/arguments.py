"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from walkers import completion

if TYPE_CHECKING:
    from walkers.inputs.case import Case as ResolvedCase

Case = Annotated[
    str,
    typer.Argument(
        metavar="CASE",
        help="A case file, or the name of a shipped case such as fig1b.",
        autocompletion=completion.cases,
    ),
]
Cases = Annotated[
    list[str],
    typer.Argument(metavar="CASE...", help="Case files, or names of shipped cases.", autocompletion=completion.cases),
]
SweepFile = Annotated[
    str,
    typer.Argument(
        metavar="SWEEP",
        help="A sweep file, or a shipped sweep such as fig2.",
        autocompletion=completion.sweep_files,
    ),
]
Run = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help="A run: its directory, its name in --out, or a case whose run is looked up there.",
        autocompletion=completion.runs,
    ),
]
RunOrSweep = Annotated[
    str,
    typer.Argument(
        metavar="RUN|SWEEP",
        help="A run or a sweep: its directory, its name in --out, or a case.",
        autocompletion=completion.runs_and_sweeps,
    ),
]
Runs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[RUN|SWEEP]...",
        help="Runs and sweeps: names in --out, or directories.",
        autocompletion=completion.runs_and_sweeps,
    ),
]
Out = Annotated[Path, typer.Option("--out", help="Folder of the run directories.")]
EngineName = Annotated[str | None, typer.Option("--engine", help="Name or path of the liggghts binary.")]
AllowFailedAudit = Annotated[bool, typer.Option("--allow-failed-audit", help="Run on an engine that failed its audit.")]
Formats = Annotated[
    list[str] | None, typer.Option("--format", help="Of the figures: png, svg or pdf; may be repeated.")
]
VtkFolder = Annotated[
    Path | None, typer.Option("--to", help="Folder to write, replaced if it holds nothing else; RUN/vtk if left out.")
]
AsPlaced = Annotated[bool, typer.Option("--as-placed", help="Walkers where the deck has them, not side by side.")]
Every = Annotated[
    int | None, typer.Option("--every", min=1, help="One of so many samples of the drive; one a cycle if left out.")
]
CaseName = Annotated[
    str | None,
    typer.Option(
        "--case",
        metavar="NAME",
        help="Only what is of the case of this name.",
        autocompletion=completion.case_names,
    ),
]
OlderThan = Annotated[
    str | None, typer.Option("--older-than", metavar="AGE", help="Only what is older than this, such as 7d or 12h.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, SI units.")]

Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Another value than the file's, such as drive.frequency=70Hz; repeatable."
    ),
]


def load(case: str, settings: list[str] | None) -> ResolvedCase:
    """A case with values put beside its file."""
    from walkers.inputs.changes import settings_of
    from walkers.inputs.reading import load_case

    return load_case(case, settings_of(settings or ()))


def refuse(option: str, wrong: bool, told: str) -> None:
    """Refuse an option if something is wrong with it, and tell what."""
    from walkers.inputs.errors import InputError, Problem

    if wrong:
        raise InputError(option, [Problem("", None, told)])


def refuse_as_placed(as_placed: bool, case: ResolvedCase) -> None:
    """Refuse ``--as-placed`` of walkers that are nowhere else."""
    refuse("--as-placed", as_placed and not case.apart, "is for independent walkers: these stand where they are")


def check_folder(option: str, folder: Path) -> None:
    """Refuse a file as a folder."""
    refuse(option, folder.exists() and not folder.is_dir(), f"expected a folder, {folder} is a file")


def check_out(out: Path) -> None:
    """Refuse a file as the folder of the run directories."""
    check_folder("--out", out)
