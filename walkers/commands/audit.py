"""``walkers audit``: prove what the installed engine does."""

from __future__ import annotations

import json
import sys
import warnings
from typing import Annotated

import typer

from walkers.commands.arguments import EngineName, Json

Only = Annotated[list[str] | None, typer.Option("--only", help="Name of a check; may be repeated.")]
Quick = Annotated[bool, typer.Option("--quick", help="Leave out the checks that take longest.")]


def command(
    only: Only = None,
    quick: Quick = False,
    as_json: Json = False,
    engine: EngineName = None,
) -> int:
    """Measure forces of engine and contact model beside a second engine and closed forms; exit 1 if a line fails."""
    from walkers.check.audit import Checked, record, run_audit, selected
    from walkers.inputs.errors import InputError, Problem
    from walkers.runner.binary import find_engine
    from walkers.runner.failures import EngineMissing

    def tell(checked: Checked) -> None:
        print(f"walkers: {checked.name} ({checked.seconds:.1f} s)", file=sys.stderr, flush=True)

    checks = selected(only or (), quick=quick)
    try:
        binary = find_engine(engine)
    except EngineMissing as missing:
        if engine is None:
            raise
        raise InputError("--engine", [Problem("", None, str(missing))]) from missing
    report = run_audit(checks, engine=binary, on_done=tell)
    print(json.dumps(report.as_dict(), indent=2, ensure_ascii=False) if as_json else report.as_text())
    if not only:
        try:
            record(report, quick=quick)
        except OSError as error:
            warnings.warn(f"the outcome cannot be kept: {error}", stacklevel=1)
    return 1 if report.failures else 0
