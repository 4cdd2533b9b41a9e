"""Run the checks on an engine, two decks at a time, and collect the table."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import nan
from pathlib import Path

from walkers.check import motions, scenes
from walkers.check.bench import Bench
from walkers.check.lines import Check, Line, Verdict
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.library import suggestion
from walkers.runner.audits import AuditRecord, write_audit
from walkers.runner.binary import Engine, find_engine

CHECKS: tuple[Check, ...] = (*scenes.CHECKS, *motions.CHECKS)


@dataclass(frozen=True)
class CheckedLines:
    """A check with its lines and the seconds that it took."""

    check: Check
    lines: tuple[Line, ...]
    seconds: float


@dataclass(frozen=True)
class AuditReport:
    """What an audit found."""

    engine: Engine
    version: str
    checked: tuple[CheckedLines, ...]

    @property
    def lines(self) -> list[Line]:
        """All lines."""
        return [line for checked in self.checked for line in checked.lines]

    @property
    def failures(self) -> list[Line]:
        """The lines that fail, or could not be measured."""
        return [line for line in self.lines if line.verdict in (Verdict.FAIL, Verdict.ERROR)]

    def count(self, verdict: Verdict) -> int:
        """How many lines have a verdict."""
        return sum(line.verdict is verdict for line in self.lines)


def selected(only: Sequence[str] = (), *, quick: bool = False) -> tuple[Check, ...]:
    """The checks to run: those named, or all, or all quick ones.

    Raises
    ------
    InputError
        If a name is not that of a check.
    """
    names = [check.name for check in CHECKS]
    for name in only:
        if name not in names:
            hint = suggestion(name, names)
            raise InputError(
                "--only", [Problem("", None, f"no check {name!r}; expected one of {', '.join(names)}{hint}")]
            )
    return tuple(check for check in CHECKS if (check.name in only if only else check.quick or not quick))


def run_audit(
    checks: Sequence[Check] = CHECKS,
    *,
    engine: Engine | None = None,
    on_done: Callable[[CheckedLines], None] | None = None,
) -> AuditReport:
    """Run checks on an engine.

    Parameters
    ----------
    checks
        Which ones.
    engine
        The binary; the installed one if None.
    on_done
        Called with each check as it is done.
    """
    binary = engine or find_engine()
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench = Bench(binary, Path(folder))

        def measure(check: Check) -> CheckedLines:
            begin = time.perf_counter()
            try:
                lines = tuple(check.measure(bench))
            except Exception as failure:  # whatever another build of the engine does, the table must come
                reason = str(failure).split(" (see ", 1)[0] or type(failure).__name__
                lines = (Line(f"{check.title}: {reason}", nan, nan, 0.0, unmeasured=Verdict.ERROR),)
            checked = CheckedLines(check, lines, time.perf_counter() - begin)
            if on_done:
                on_done(checked)
            return checked

        pool = ThreadPoolExecutor(2)
        try:
            checked = tuple(pool.map(measure, checks))
        finally:
            bench.stop.set()
            pool.shutdown(cancel_futures=True)
        return AuditReport(binary, bench.version, checked)


def record(report: AuditReport, *, quick: bool) -> AuditRecord | None:
    """Keep a report for the user: runs on this binary name it, and are refused if it failed.

    A report with a line that could not be measured says something of the machine, not of the binary: it is not kept.
    """
    if report.count(Verdict.ERROR):
        return None
    kept = AuditRecord(
        engine=report.engine.sha256,
        version=report.version,
        scope="quick" if quick else "full",
        lines=len(report.lines),
        failures=tuple(line.what for line in report.failures),
        skipped=report.count(Verdict.SKIPPED),
        date=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    )
    write_audit(kept)
    return kept
