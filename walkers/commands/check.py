"""Commands that check the program, compare with the paper, calibrate, and show what comes with the program."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from typer import Argument, Option

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.arguments import (
    AllowFailedAudit,
    By,
    EngineName,
    Formats,
    Jobs,
    Json,
    Out,
    Set,
    changes_of,
    check_folder,
    load_case,
    on_cores,
    print_as,
    print_lines,
    refuse,
    tell,
)

if TYPE_CHECKING:
    from walkers.inputs.case import Case as Resolved

_FILES = "An unpacked archive, or a run or a sweep (folder, name in --out, or case)."
_NAME = "A material, a liquid, a bridge law, a case, a sweep or a calibration."
_LITERATURE = "benchmarks, bridges or crosscheck; default: all."
_CALIBRATION = "A calibration file, or the name of a shipped calibration such as ruby."


def check_engine(
    only: list[str] | None = Option(None, help="Run only the check with this name. Repeatable."),
    quick: bool = Option(False, "--quick", help="Skip the slowest checks."),
    as_json: Json = False,
    engine: EngineName = None,
) -> int:
    """Compare the forces of the engine and its contact model with a second engine and exact formulas."""
    from walkers.check.audit import record, run_audit, selected
    from walkers.errors import refused
    from walkers.runner.binary import find_engine
    from walkers.runner.failures import EngineMissing

    checks = selected(only or (), quick=quick)
    try:
        binary = find_engine(engine)
    except EngineMissing as missing:
        if engine is None:
            raise
        raise refused("--engine", str(missing)) from missing
    audit = run_audit(checks, engine=binary, on_done=tell)
    print_as(as_json, audit.as_dict, audit.as_text)
    if not only:
        try:
            record(audit, quick=quick)
        except OSError as error:
            warnings.warn(f"the outcome cannot be kept: {error}", stacklevel=1)
    return 1 if audit.failures else 0


def check_literature(
    only: list[str] | None = Argument(None, metavar="CHECK", help=_LITERATURE),
    quick: bool = Option(False, "--quick", help="Run only the fast part of each check."),
    out: Out = DEFAULT_OUT,
    as_json: Json = False,
) -> int:
    """Compare engine and bridge laws with published benchmarks, exact solutions and a second engine."""
    from walkers.check.lines import as_dict, as_text, failures, outcome
    from walkers.check.literature import literature

    check_folder("--out", out)
    lines = literature(out, only or (), quick=quick, on_done=tell)
    print_as(as_json, lambda: as_dict(lines), lambda: f"{as_text(lines)}\n\n{outcome(lines)}")
    return 1 if failures(lines) else 0


def check_files(what: str = Argument(metavar="PATH", help=_FILES), settings: Set = None, out: Out = DEFAULT_OUT) -> int:
    """Compare the files of a run, a sweep or an archive with their checksums."""
    from walkers.api import directory_of
    from walkers.archive.verification import verify

    found = verify(directory_of(what, out, changes_of(settings)))
    print_lines(one.describe() for one in found)
    return 0 if all(one.passed for one in found) else 1


def check_case(
    context: typer.Context,
    settings: Set = None,
    out: Out = DEFAULT_OUT,
    cycles: int | None = Option(None, help="Number of drive cycles; default: as in the case."),
    without: list[str] | None = Option(None, metavar="TERM", help="Leave out a force, such as friction. Repeatable."),
    seeds: int = Option(1, min=1, help="Piles: number of random starts."),
    as_json: Json = False,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Run CASE with LIGGGHTS and with an independent second engine in Python, and compare the motion."""
    from walkers.check.crosscheck import crosscheck, shortened
    from walkers.check.engine import TERMS
    from walkers.check.lines import as_dict, as_text, failures
    from walkers.errors import refused

    loaded = load_case(str(context.info_name), settings, out)
    check_folder("--out", out)
    refuse("--seeds", seeds > 1 and loaded.mixture is None, "is for piles: walkers and placed beads have one start")
    for term in without or ():
        refuse(f"--without {term}", term not in TERMS, f"expected one of {', '.join(TERMS)}")
    try:
        loaded = loaded if cycles is None else shortened(loaded, cycles)
    except ValueError as error:
        raise refused("--cycles", str(error)) from error

    def make(one: Resolved, folder: Path) -> walkers.Run:
        return walkers.run(one, folder, engine=engine, progress=True, allow_failed_audit=allow_failed_audit)

    lines = crosscheck(loaded, out, without or (), seeds=seeds, make=make)
    print_as(as_json, lambda: as_dict(lines, case=loaded.name, without=without or []), lambda: as_text(lines))
    if not as_json:
        tell(*(f"{loaded.name}: differs: {line.what}" for line in failures(lines)))
    return 1 if failures(lines) else 0


def library(name: str | None = Argument(None, metavar="NAME", help=_NAME)) -> None:
    """List materials, liquids, friction, bridge laws, cases, sweeps and calibrations, or print one with its sources."""
    from walkers.commands.catalogue import catalogue, describe, describe_one

    found = catalogue()
    print(describe_one(found, name) if name else describe(found))


def paper_figures(
    out: Out = DEFAULT_OUT,
    to: Path = Option(Path("figures"), help="Folder to write the figures to."),
    only: list[str] | None = Option(None, help="Draw only the figure with this name, or comparison. Repeatable."),
    formats: Formats = None,
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Draw the paper's figures with simulation, theory and published values. Missing runs are made first."""
    from walkers.paper.make import FORMATS, make_figures
    from walkers.progress import progress_of_sweep

    how = By(engine=engine, allow_failed_audit=allow_failed_audit)
    wanted, shown = only or (), formats or FORMATS
    made = make_figures(out, to, on_cores(jobs), only=wanted, formats=shown, progress_of=progress_of_sweep, **how)
    for name, failures in made.failures.items():
        tell(*(f"{name}: point {failure.point}, {failure.run}: {failure.message}" for failure in failures))
    tell(*(f"{figure} is left out: {reason}" for figure, reason in made.left_out.items()))
    print_lines(made.files)
    if made.compared:
        print(f"{made.agree} of {made.compared} published numbers agree: {to / 'comparison.md'}")
    return 1 if made.failures or made.left_out else 0


def calibrate(
    calibration: str = Argument(metavar="CALIBRATION", help=_CALIBRATION),
    out: Out = DEFAULT_OUT,
    to: Path | None = Option(None, help="Folder to write tables and figures to; default: OUT/NAME."),
    jobs: Jobs = None,
    engine: EngineName = None,
    allow_failed_audit: AllowFailedAudit = False,
) -> int:
    """Calibrate unknown parameters to published numbers. An interrupted calibration continues."""
    from walkers.calibration.file import load_calibration
    from walkers.calibration.report import write_outcome

    folder = to or out / load_calibration(calibration).name
    check_folder("--out", out)
    check_folder("--to", folder)
    how = By(engine=engine, allow_failed_audit=allow_failed_audit)
    found = walkers.calibrate(calibration, out, jobs=jobs, progress=True, **how)
    tell(*(f"{name}: {len(failures)} points failed" for name, failures in found.failures.items()))
    print_lines(write_outcome(found, folder))
    return 0  # a set whose run fails is an outcome: it counts as far off
