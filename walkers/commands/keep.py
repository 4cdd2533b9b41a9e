"""Commands that export and remove runs."""

from __future__ import annotations

import sys
from itertools import zip_longest
from pathlib import Path
from typing import Any, Literal

import typer
from typer import Argument, Option

from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    CaseName,
    OlderThan,
    Out,
    RunOrSweep,
    Set,
    changes_of,
    check_folder,
    load_any,
    load_run,
    refuse,
    refuse_given,
    tell,
)
from walkers.completion import offering

_FORM = (
    "Format of the export. deck: LIGGGHTS deck of the case. vtk, paraview: .vtu files, their .pvd and a ParaView "
    "script; prints the .pvd or the script. lammps: the trajectory as a LAMMPS dump, for OVITO, ASE, MDAnalysis. "
    "archive: an RO-Crate (.zip) to publish."
)
_OUTPUT = "File or folder to write; default: in the run's folder, archives in the current folder. Decks are printed."
_EVERY = "vtk, paraview, lammps: write every Nth sample; default: one per cycle; for lammps and piles all."
_AS_PLACED = "vtk, paraview: keep independent walkers at their positions in the deck, not side by side."
_COLOUR = "vtk, paraview: array that colours the beads in the script; default: walker, for piles speed."
_WITHOUT_DUMPS = "archive: leave out the engine's dumps; tables and results are included."
_LICENCE = "archive: CC-BY-4.0 (default), CC0-1.0, CC-BY-SA-4.0 or BSD-3-Clause."
_ANY = offering("case", "run", "sweep")
_RUNS = "Runs and sweeps: folder, name in --out, or case."


def export(
    what: RunOrSweep,
    form: Literal["deck", "vtk", "paraview", "lammps", "archive"] = Option(..., "--to", help=_FORM),
    output: Path | None = Option(None, "-o", help=_OUTPUT),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    every: int | None = Option(None, min=1, help=_EVERY),
    as_placed: bool = Option(False, "--as-placed", help=_AS_PLACED),
    colour: str | None = Option(None, help=_COLOUR),
    start: bool = Option(False, "--open", help="paraview: start ParaView with the script."),
    without_dumps: bool = Option(False, "--without-dumps", help=_WITHOUT_DUMPS),
    author: list[str] | None = Option(None, help="archive: name of an author. Repeatable."),
    orcid: list[str] | None = Option(None, help="archive: ORCID of an author, in the order of --author. Repeatable."),
    licence: str | None = Option(None, help=_LICENCE),
) -> None:
    """Write a run for other programs: LIGGGHTS deck, VTK, ParaView, LAMMPS dump, or an archive to publish."""
    given = {
        "--every": (every, ("vtk", "paraview", "lammps")),
        **{"--as-placed": (as_placed, ("vtk", "paraview")), "--colour": (colour, ("vtk", "paraview"))},
        "--open": (start, ("paraview",)),
        **{"--without-dumps": (without_dumps, ("archive",)), "--licence": (licence, ("archive",))},
        **{"--author": (author, ("archive",)), "--orcid": (orcid, ("archive",))},
    }
    for option, (value, forms) in given.items():
        if form not in forms:
            refuse_given({option: value}, f"is for --to {', '.join(forms)}")
    if form == "deck":
        from walkers.api import case_and_run
        from walkers.sweeps.by_hand import as_run, write_folder
        from walkers.templates.deck import RUN_NAME, render_deck, whole

        case = as_run(*case_and_run(what, out, changes_of(settings)))
        if output is None:
            print(render_deck(case, whole(case)).text, end="")
        else:
            print(f"{write_folder(case, output)}    run it there with: sh {RUN_NAME}    then: walkers run {output}")
        if case.run.continuation:
            tell(f"{case.run.attempts[0]} cycles; {case.run.continuation}")
        return
    if form == "archive":
        from walkers.archive.crate import Author

        options: dict[str, Any]

        refuse("-o", output is not None and output.suffix != ".zip", "expected the name of a .zip file")
        refuse("--orcid", len(orcid or ()) > len(author or ()), "expected an --author for each")
        authors = [Author(name, number) for name, number in zip_longest(author or (), orcid or ())]
        options = {"dumps": not without_dumps, "authors": authors, "licence": licence or "CC-BY-4.0"}
        print(load_any(what, settings, out).export("archive", output, **options))
        return
    found = load_run(what, settings, out)
    wrong = as_placed and not found.case.apart
    refuse("--as-placed", wrong, "is for independent walkers: these stand where they are")
    options = {"every": every}
    if form in ("vtk", "paraview"):
        options |= {"as_placed": as_placed, "colour": colour}
    print(written := found.export(form, output, **options))
    if start:
        from walkers.postprocess.paraview import open_paraview

        open_paraview(written)


def clean(
    runs: list[str] | None = Argument(None, metavar="RUN|SWEEP", help=_RUNS, autocompletion=_ANY),
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    finished: bool = Option(False, "--finished", help="Also remove finished runs, except those of sweeps."),
    case: CaseName = None,
    older_than: OlderThan = None,
    dry_run: bool = Option(False, "--dry-run", help="Print what would be removed, and remove nothing."),
    yes: bool = Option(False, "--yes", "-y", help="Do not ask for confirmation."),
) -> int:
    """Remove interrupted and failed runs, or the given runs and sweeps. Asks first. Runs in progress stay."""
    from walkers.api import directory_of
    from walkers.errors import each
    from walkers.runner.directory import UNFINISHED
    from walkers.sweeps.folder import clean, plan_cleaning

    check_folder("--out", out)
    refuse("--finished", finished and bool(runs), "has no meaning with given runs")
    refuse("--set", bool(settings) and not runs, "is for given runs and sweeps")
    changes = changes_of(settings)

    def place_of(one: str) -> Path:
        return folder if (folder := out / Path(one).name).suffix == UNFINISHED else directory_of(one, out, changes)

    given = each(place_of, runs or ())
    plan = plan_cleaning(out, given, finished=finished, case=case, older_than=older_than)
    print(plan.as_text())
    if dry_run or not (plan.remove or plan.locks):
        return 0
    if not yes:
        refuse("--yes", not sys.stdin.isatty(), "expected, because there is no terminal to ask for confirmation")
        if not typer.confirm("remove them?"):
            print("nothing removed")
            return 0
    left = clean(plan)
    tell(*(f"{directory}: {why}" for directory, why in left.items()))
    return 1 if left else 0
