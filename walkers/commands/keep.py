"""Commands that export and remove runs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from walkers import DEFAULT_OUT
from walkers.api import Export, Sweep, check_export, directory_of
from walkers.commands.options import LookupOptions, OutOption, RunOrSweepArgument, refuse, tell
from walkers.errors import apply_all
from walkers.postprocess.measure.table_units import UnitSystem
from walkers.runner.run_directory import UNFINISHED
from walkers.runs.by_hand import as_run, write_folder
from walkers.runs.removal import Removal, removal_text, remove, unfinished_in
from walkers.sweeps.removal import removals_in
from walkers.templates.deck import RUN_NAME, render_deck, single_segment

_REMOVED = (
    "Runs, with their spreads and accuracies, and sweeps, with the runs that no other sweep has "
    "and that were not run by themselves."
)


@Parameter(name="*")
@dataclass(frozen=True)
class ExportOptions:
    """Options of exports.

    Parameters
    ----------
    every
        vtk, lammps: write every Nth sample; default: one per cycle; for lammps and piles all.
    units
        csv: SI, or mm for mm, mm/s, g (9.8 m/s^2), µN, nJ and degrees; default: SI.
    dumps
        archive: leave out the engine's dumps; tables and results are included.
    authors
        archive: name of an author. Repeatable.
    licence
        archive: licence of the data, such as CC-BY-4.0; default: not stated.
    follow
        vtk: write the complete segments of a run that goes on, and each further one, until the run
        ends; default folder: NAME-vtk.
    """

    every: int | None = None
    units: UnitSystem | None = None
    dumps: Annotated[bool, Parameter("--without-dumps")] = False
    authors: Annotated[list[str] | None, Parameter("--author")] = None
    licence: str | None = None
    follow: Annotated[bool, Parameter(("--follow", "-f"))] = False


def export(
    name: RunOrSweepArgument,
    /,
    *,
    form: Annotated[Export, Parameter("--format", metavar="FORMAT")],
    to: Annotated[Path | None, Parameter(("--to", "-o"))] = None,
    lookup: LookupOptions = LookupOptions(),
    options: ExportOptions = ExportOptions(),
) -> None:
    """Write a run for other programs: LIGGGHTS deck, VTK for ParaView, LAMMPS dump, CSV tables, or
    an archive to publish.

    Parameters
    ----------
    form
        Format of the export. deck: LIGGGHTS deck of the case. vtk: .vtu files, their .pvd, and the
        script show.py that shows them in ParaView. lammps: the trajectory as a LAMMPS dump, for
        OVITO, ASE, MDAnalysis. csv: a folder of all tables, with units. archive: a zip file with
        checksums, to publish.
    to
        File or folder to write; default: in the run's folder, archives in the current folder.
        Decks are printed.
    """
    given = _given_options(options)
    check_export(form, list(given))
    if form == "deck":
        _export_deck(name, to, lookup)
        return
    loaded = lookup.load(name)
    if isinstance(loaded, Sweep) and form != "archive":
        loaded.export(form)  # refuses it; sweeps do not know the options of other forms
    if options.follow:
        given["progress"] = True
    print(loaded.export(form, to, **given))


def _given_options(options: ExportOptions) -> dict[str, Any]:
    """The options that the user has given, as arguments of `walkers.Run.export`."""
    given: dict[str, Any] = {}
    if options.every is not None:
        given["every"] = options.every
    if options.units is not None:
        given["units"] = options.units
    if options.dumps:  # the option is --without-dumps
        given["dumps"] = False
    if options.authors is not None:
        given["authors"] = options.authors
    if options.licence is not None:
        given["licence"] = options.licence
    if options.follow:
        given["follow"] = True
    return given


def _export_deck(name: str, to: Path | None, lookup: LookupOptions) -> None:
    """Print the deck of a case, or write its folder; with the cycles that its finished run took."""
    reference = lookup.find(name)
    case = as_run(reference.case, reference.finished_run)
    if to is None:
        print(render_deck(case, single_segment(case)).text, end="")
    else:
        deck = write_folder(case, to)
        print(f"{deck}    run it there with: sh {RUN_NAME}    then: walkers run {to}")
    if case.run.continuation:
        tell(f"{case.run.attempts[0]} cycles; {case.run.continuation}")


def clean(
    *runs: Annotated[RunOrSweepArgument, Parameter(help=_REMOVED)],
    out: OutOption = DEFAULT_OUT,
    yes: Annotated[bool, Parameter(("--yes", "-y"))] = False,
) -> int:
    """Remove interrupted and failed runs, or the given runs and sweeps. Asks first. Runs in
    progress stay.

    Parameters
    ----------
    yes
        Do not ask for confirmation.
    """
    removals = _removals(runs, out)
    print(removal_text(removals))
    if not removals:
        return 0
    if not yes:
        refuse(
            "--yes",
            not sys.stdin.isatty(),
            "expected, because there is no terminal to ask for confirmation",
        )
        if not _is_confirmed("remove them?"):
            print("nothing removed")
            return 0
    left = remove(removals)
    for path, reason in left.items():
        tell(f"{path}: {reason}")
    return 1 if left else 0


def _removals(names: Sequence[str], out: Path) -> list[Removal]:
    """The named runs and sweeps; without names, all unfinished work in the folder of runs."""
    if not names:
        return unfinished_in(out)
    directories = apply_all(partial(_directory_to_remove, out=out), names)
    return removals_in(out, directories)


def _directory_to_remove(name: str, out: Path) -> Path:
    """The directory of a named run or sweep, or the directory of an unfinished run of this name."""
    path = Path(name)
    if path.suffix != UNFINISHED:
        return directory_of(name, out)
    return path if path.is_dir() else out / name


def _is_confirmed(question: str) -> bool:
    """Whether the user answers yes; the end of the input (Ctrl-D) means no."""
    try:
        answer = input(f"{question} [y/N] ")
    except EOFError:
        print()
        return False
    return answer.strip().lower() in ("y", "yes")
