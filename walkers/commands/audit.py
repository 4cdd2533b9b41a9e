"""``walkers audit``: prove what the installed engine does."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import Json

Only = Annotated[list[str] | None, typer.Option("--only", help="Name of a check; may be repeated.")]
Quick = Annotated[bool, typer.Option("--quick", help="Leave out the checks that take longest.")]
Markdown = Annotated[Path | None, typer.Option("--markdown", help="Write docs/engine.md: the defects and the table.")]
EngineOption = Annotated[str | None, typer.Option("--engine", help="Name or path of the liggghts binary.")]


def command(
    only: Only = None,
    quick: Quick = False,
    as_json: Json = False,
    markdown: Markdown = None,
    engine: EngineOption = None,
) -> int:
    """Measure the engine's forces and our remedies against published formulas; exit status 1 if a line fails."""
    from audit.run import CheckedLines, record, run_audit, selected
    from audit.table import as_dict, as_markdown, as_text
    from runner.binary import find_engine
    from runner.files import write_text

    def tell(checked: CheckedLines) -> None:
        print(f"walkers: {checked.check.name} ({checked.seconds:.1f} s)", file=sys.stderr, flush=True)

    checks = selected(only or (), quick=quick)
    report = run_audit(checks, engine=find_engine(engine), on_done=tell)
    if not only:
        record(report, quick=quick)
    if markdown is not None:
        write_text(markdown, as_markdown(report))
    print(json.dumps(as_dict(report), indent=2, ensure_ascii=False) if as_json else as_text(report))
    return 1 if report.failures else 0
