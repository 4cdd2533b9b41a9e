"""``walkers audit``: run the checks on an engine, two decks at a time, and tell what they gave."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any

from walkers.check import motions, scenes
from walkers.check.bench import Bench
from walkers.check.lines import Line, Verdict
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.library import suggestion
from walkers.runner.binary import AuditRecord, Engine, find_engine, write_audit

CHECKS: Mapping[str, Callable[[Bench], Iterable[Line]]] = {
    "scenes": scenes.scene_lines,
    "restart": scenes.restart_lines,
    "ranks": scenes.rank_lines,
    "stock": scenes.stock_lines,
    "thrown": motions.thrown_lines,
    "flight": motions.flight_lines,
    "company": motions.company_lines,
    "step": motions.step_lines,
}
"""Each runs decks on a bench and gives lines; the first line of its docstring is its title."""
LONG = ("step",)
"""Those that ``--quick`` leaves out."""


@dataclass(frozen=True)
class Checked:
    """A check that was run: its name, its lines, and the seconds that it took."""

    name: str
    lines: tuple[Line, ...]
    seconds: float


@dataclass(frozen=True)
class AuditReport:
    """What an audit found."""

    engine: Engine
    version: str
    checked: tuple[Checked, ...]

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

    def as_text(self) -> str:
        """A line a measurement, grouped, with a verdict at the end."""
        rows = []
        for checked in self.checked:
            rows.append(f"\n{checked.name}: {_title(checked.name)}")
            rows += [_as_text(line) for line in checked.lines]
        passed, failed = self.count(Verdict.PASS), self.count(Verdict.FAIL)
        outcome = f"{failed} of {passed + failed} lines fail" if failed else f"all {passed} lines pass"
        for other, words in ((Verdict.ERROR, "could not be measured"), (Verdict.SKIPPED, "skipped")):
            outcome += f", {self.count(other)} {words}" if self.count(other) else ""
        told = f"{self.version}, binary and contact model {self.engine.sha256[:12]}: {outcome}"
        return "\n".join(rows).lstrip("\n") + f"\n\n{told}"

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types; numbers that are none become null."""
        engine = {"path": str(self.engine.path), "sha256": self.engine.sha256, "version": self.version}
        checks = [
            {
                "name": checked.name,
                "title": _title(checked.name),
                "seconds": checked.seconds,
                "lines": [_as_dict(line) for line in checked.lines],
            }
            for checked in self.checked
        ]
        return {"engine": engine, "passed": not self.failures, "checks": checks}


def _title(name: str) -> str:
    lines = str(CHECKS[name].__doc__).splitlines()
    return lines[0].rstrip(".")


def _number(value: float) -> str:
    return f"{value:.5g}" if isfinite(value) else "-"


def _as_text(line: Line) -> str:
    numbers = f"{_number(line.expected):>9} {_number(line.measured):>9} {line.unit:3}"
    return f"{line.verdict:7} {line.what:90} {numbers} error {_number(line.error)} of {line.tolerance:.0e}"


def _as_dict(line: Line) -> dict[str, Any]:
    numbers = {"expected": line.expected, "measured": line.measured, "error": line.error}
    finite = {name: value if isfinite(value) else None for name, value in numbers.items()}
    return {
        "what": line.what, "unit": line.unit, **finite, "tolerance": line.tolerance, "verdict": str(line.verdict)
    }  # fmt: skip


def selected(only: Collection[str] = (), *, quick: bool = False) -> tuple[str, ...]:
    """Names of the checks to run: those given, or all, or all quick ones.

    Raises
    ------
    InputError
        If a name is not that of a check.
    """
    for name in only:
        if name not in CHECKS:
            told = f"no check {name!r}; expected one of {', '.join(CHECKS)}{suggestion(name, CHECKS)}"
            raise InputError("--only", [Problem("", None, told)])
    return tuple(name for name in CHECKS if (name in only if only else not (quick and name in LONG)))


def run_audit(
    names: Collection[str] = tuple(CHECKS),
    *,
    engine: Engine | None = None,
    on_done: Callable[[Checked], None] | None = None,
) -> AuditReport:
    """Run checks on an engine.

    Parameters
    ----------
    names
        Which of the `CHECKS`.
    engine
        The binary; the installed one if None.
    on_done
        Called with each check as it is done.
    """
    binary = engine or find_engine()
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench = Bench(binary, Path(folder))

        def measure(name: str) -> Checked:
            begin = time.perf_counter()
            try:
                lines = tuple(CHECKS[name](bench))
            except Exception as failure:  # whatever another build of the engine does, the table must come
                reason = str(failure).split(" (see ", 1)[0] or type(failure).__name__
                lines = (Line(f"{_title(name)}: {reason}", nan, nan, 0.0, unmeasured=Verdict.ERROR),)
            checked = Checked(name, lines, time.perf_counter() - begin)
            if on_done:
                on_done(checked)
            return checked

        pool = ThreadPoolExecutor(2)
        try:
            checked = tuple(pool.map(measure, names))
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
