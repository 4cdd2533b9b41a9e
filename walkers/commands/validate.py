"""``walkers validate``: published benchmarks, exact solutions and a second engine beside what decks give."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Json, Out, check_folder, check_out
from walkers.pipeline import DEFAULT_OUT

Chapters = Annotated[list[str] | None, typer.Argument(metavar="[CHAPTER]...", help="Some chapters; all if left out.")]
Quick = Annotated[bool, typer.Option("--quick", help="Of each the part that takes seconds.")]
To = Annotated[Path | None, typer.Option("--to", help="Folder of the page; OUT/validation if left out.")]
Jobs = Annotated[int | None, typer.Option("-j", "--jobs", min=1, help="Chapters at once; all cores if left out.")]


def command(
    chapters: Chapters = None,
    quick: Quick = False,
    out: Out = DEFAULT_OUT,
    to: To = None,
    jobs: Jobs = None,
    as_json: Json = False,
) -> int:
    """Check the decks against published benchmarks, exact solutions and a second engine, and write a page of it."""
    from walkers.check.validate import validate
    from walkers.sweeps.site import cores_here

    check_out(out)
    folder = to or out / "validation"
    check_folder("--to", folder)
    made = validate(
        out,
        folder,
        only=chapters or (),
        quick=quick,
        jobs=jobs or cores_here(),
        on_done=lambda chapter: print(f"walkers: {chapter.name} done", file=sys.stderr),
    )
    if as_json:
        print(json.dumps({chapter.name: dict(chapter.numbers) for chapter in made.chapters}, indent=2))
    else:
        for file in made.files:
            print(file)
    for statement in made.failed:
        print(f"walkers: not as expected: {statement}", file=sys.stderr)
    return 1 if made.failed else 0
