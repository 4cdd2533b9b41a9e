"""Commands that check the program, calibrate, and show what comes with the program."""

from __future__ import annotations

import warnings
from typing import Annotated

from cyclopts import App, Parameter
from cyclopts.validators import Number

import walkers
from walkers import DEFAULT_OUT
from walkers.commands.options import (
    CaseArgument,
    EngineOption,
    JobsOption,
    JsonOption,
    LookupOptions,
    OutOption,
    QuietOption,
    RunOrSweepArgument,
    print_as,
    print_lines,
    refuse,
    tell,
)
from walkers.errors import input_error

# An app of its own does not inherit the heading of the options.
check = App(name="check", version_flags=(), group_parameters="Options")


@check.command
def engine(
    *,
    only: Annotated[list[str] | None, Parameter(metavar="NAME")] = None,
    as_json: JsonOption = False,
    engine: EngineOption = None,
) -> int:
    """Compare the forces of the engine and its contact model with a second engine and exact
    formulas.

    Parameters
    ----------
    only
        Run only the check with this name; a wrong one lists them. Repeatable.
    """
    from walkers.runner.binary import find_engine
    from walkers.second_engine.audit import record, run_audit
    from walkers.second_engine.lines import as_dict, failures, lines_text

    binary = find_engine(engine)
    lines, version = run_audit(only or (), engine=binary, on_done=tell)
    if not only:
        try:
            record(lines, binary, version)
        except OSError as error:
            warnings.warn(f"the outcome cannot be kept: {error}", stacklevel=1)
    about = {"path": str(binary.path), "sha256": binary.sha256, "version": version}
    heading = f"{version}, binary and contact model {binary.sha256[:12]}: "
    print_as(as_json, lambda: as_dict(lines, {"engine": about}), lambda: lines_text(lines, heading))
    return 1 if failures(lines) else 0


@check.command
def files(name: RunOrSweepArgument, /, *, lookup: LookupOptions = LookupOptions()) -> int:
    """Compare the files of a run, a sweep or an archive (a .zip file or its folder) with their
    checksums.
    """
    from walkers.api import directory_of
    from walkers.archive.verification import verify

    parts = verify(directory_of(lookup.find(name)))
    print_lines(part.describe() for part in parts)
    return 0 if all(part.passed for part in parts) else 1


@check.default
def case(
    case: CaseArgument,
    /,
    *,
    lookup: LookupOptions = LookupOptions(),
    cycles: int | None = None,
    without: Annotated[list[str] | None, Parameter(metavar="TERM")] = None,
    seeds: Annotated[int, Parameter(validator=Number(gte=1))] = 1,
    as_json: JsonOption = False,
    engine: EngineOption = None,
    quiet: QuietOption = False,
) -> int:
    """Run CASE with LIGGGHTS and with an independent second engine in Python, and compare the
    motion.

    Parameters
    ----------
    cycles
        Number of drive cycles; default: as in the case.
    without
        Leave out a force: capillary, lubrication, damping, friction, rolling-friction, gravity or
        drive. Repeatable.
    seeds
        Piles: number of random starts.
    """
    from walkers.second_engine.crosscheck import crosscheck, with_cycles
    from walkers.second_engine.engine import TERMS
    from walkers.second_engine.lines import as_dict, failures, lines_text

    loaded = lookup.find(case).case
    terms = without or []
    refuse(
        "--seeds",
        seeds > 1 and loaded.mixture is None,
        "is for piles: walkers and placed beads have one start",
    )
    for term in terms:
        refuse(f"--without {term}", term not in TERMS, f"expected one of {', '.join(TERMS)}")
    if cycles is not None:
        try:
            loaded = with_cycles(loaded, cycles)
        except ValueError as error:
            raise input_error("--cycles", str(error)) from error
    lines = crosscheck(loaded, lookup.out, terms, seeds=seeds, progress=not quiet, engine=engine)
    name = loaded.name
    print_as(
        as_json,
        lambda: as_dict(lines, {"case": name, "without": terms}),
        lambda: lines_text(lines),
    )
    return 1 if failures(lines) else 0


def library(name: Annotated[str | None, Parameter(name="NAME")] = None, /) -> None:
    """List materials, liquids, friction, bridge laws, cases, sweeps and calibrations, or print one
    with its sources.

    Parameters
    ----------
    name
        A material, a liquid, a bridge law, a case, a sweep or a calibration.
    """
    from walkers.commands.catalogue import catalogue, catalogue_text, entry_text

    entries = catalogue()
    if name:
        print(entry_text(entries, name))
    else:
        print(catalogue_text(entries))


def calibrate(
    calibration: Annotated[str, Parameter(name="CALIBRATION")],
    /,
    *,
    out: OutOption = DEFAULT_OUT,
    jobs: JobsOption = None,
    engine: EngineOption = None,
    quiet: QuietOption = False,
) -> int:
    """Calibrate unknown parameters to measured or published values. An interrupted calibration
    continues.

    Parameters
    ----------
    calibration
        A calibration file, or the name of a shipped calibration such as ruby.
    """
    from walkers.calibration.report import CALIBRATION_NAME, calibration_summary, write_outcome
    from walkers.files import read_json

    outcome = walkers.calibrate(calibration, out, jobs=jobs, progress=not quiet, engine=engine)
    for name, failures in outcome.failures.items():
        tell(f"{name}: {len(failures)} points failed")
    folder = out / outcome.calibration.name
    files = write_outcome(outcome, folder)
    print(calibration_summary(read_json(folder / CALIBRATION_NAME)))
    print_lines(files)
    return 0  # parameters whose runs fail are not an error: they count as far off
