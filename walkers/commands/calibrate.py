"""``walkers calibrate``: free parameters from published numbers."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from walkers.commands.arguments import AllowFailedAudit, EngineName, Out, check_folder, check_out
from walkers.pipeline import DEFAULT_OUT

File = Annotated[
    str, typer.Argument(metavar="CALIBRATION", help="A calibration file, or a shipped calibration such as ruby.")
]
To = Annotated[Path | None, typer.Option("--to", help="Folder of tables and figures; OUT/NAME if left out.")]
Jobs = Annotated[int | None, typer.Option("-j", "--jobs", min=1, help="Decks at once; all cores if left out.")]


def command(
    calibration: File,
    out: Out = DEFAULT_OUT,
    to: To = None,
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Calibrate, or go on with it: waves of runs, emulators, posterior, predictions by the engine."""
    from walkers.calibration.calibrate import calibrate
    from walkers.calibration.figures import draw
    from walkers.calibration.report import rows_of, write_tables
    from walkers.inputs.calibration import load_calibration
    from walkers.progress import progress_of_sweep
    from walkers.sweeps.scheduler import Options
    from walkers.sweeps.site import cores_here

    read = load_calibration(calibration)
    check_out(out)
    folder = to or out / read.name
    check_folder("--to", folder)
    found = calibrate(
        read,
        out,
        Options(jobs or cores_here()),
        engine=engine,
        allow_failed_audit=allow_failed_audit,
        progress_of=progress_of_sweep,
    )
    for sweep, failures in found.failures.items():
        print(f"walkers: {sweep}: {len(failures)} points failed", file=sys.stderr)
    rows = rows_of(found)
    for file in [*write_tables(found, rows, folder), *draw(found, rows, folder)]:
        print(file)
    return 0  # a set whose run fails is an outcome: it counts as far off
