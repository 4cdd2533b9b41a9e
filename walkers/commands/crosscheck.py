"""``walkers crosscheck``: a case beside the second engine."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from walkers.commands.arguments import AllowFailedAudit, Case, EngineName, Json, Out, Set, check_out, load, refuse
from walkers.pipeline import DEFAULT_OUT, Run, run

if TYPE_CHECKING:
    from walkers.inputs.case import Case as Resolved

Cycles = Annotated[int | None, typer.Option("--cycles", help="Of the drive, in place of the case's own.")]
Without = Annotated[
    list[str] | None, typer.Option("--without", metavar="TERM", help="Leave a term out, such as friction.")
]
Seeds = Annotated[int, typer.Option("--seeds", min=1, help="Of a pile: so many starts, for the statistics.")]


def command(
    case: Case,
    out: Out = DEFAULT_OUT,
    cycles: Cycles = None,
    without: Without = None,
    settings: Set = None,
    seeds: Seeds = 1,
    as_json: Json = False,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Compare a case's run with an engine of our own, written from the published formulas; exit 1 if they differ."""
    from walkers.check.comparison import crosscheck, describe, shortened
    from walkers.check.engine import TERMS
    from walkers.inputs.errors import InputError, Problem
    from walkers.progress import progress_of

    loaded = load(case, settings)
    check_out(out)
    refuse("--seeds", seeds > 1 and loaded.mixture is None, "is for piles: walkers and placed beads start but one way")
    for term in without or ():
        if term not in TERMS:
            raise InputError(f"--without {term}", [Problem("", None, f"expected one of {', '.join(TERMS)}")])
    try:
        loaded = loaded if cycles is None else shortened(loaded, cycles)
    except ValueError as error:
        raise InputError("--cycles", [Problem("", None, str(error))]) from error

    def make(one: Resolved, folder: Path) -> Run:
        with progress_of(one.name) as advance:
            return run(one, folder, engine=engine, progress=advance, allow_failed_audit=allow_failed_audit)

    found = crosscheck(loaded, out, without or (), seeds=seeds, make=make)
    if as_json:
        print(json.dumps(found.as_dict(), ensure_ascii=False))
    else:
        print(describe(found))
        for one in found.disagreements:
            print(f"walkers: {loaded.name}: differs: {one}", file=sys.stderr)
    return 1 if found.disagreements else 0
