"""``walkers check engine``: run the checks on an engine, two decks at a time, and report the results."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.check.report import Chapter, Line, Verdict, as_dict, count, outcome
from walkers.check.scenes import CHECKS, LONG, Bench
from walkers.errors import expected_of, refused
from walkers.runner.binary import AuditRecord, Engine, find_engine, model_sha256, write_audit


@dataclass(frozen=True)
class AuditReport:
    """Results of an audit; ``contact_model`` is its SHA-256, empty without one."""

    engine: Engine
    contact_model: str
    version: str
    chapters: tuple[Chapter, ...]

    @property
    def failures(self) -> list[Line]:
        """The lines that fail, or could not be measured."""
        return [line for chapter in self.chapters for line in chapter.failures]

    def as_text(self) -> str:
        """A table for each check, and the outcome."""
        text = f"{self.version}, binary and contact model {self.engine.sha256[:12]}: {outcome(self.chapters)}"
        return "\n\n".join([*(chapter.as_text() for chapter in self.chapters), text])

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        engine = {"path": str(self.engine.path), "sha256": self.engine.sha256, "version": self.version}
        return as_dict(self.chapters, engine=engine)


def selected(only: Collection[str] = (), *, quick: bool = False) -> tuple[str, ...]:
    """Names of the checks to run: the given ones, else all, or all quick ones; `InputError` for unknown names."""
    for name in only:
        if name not in CHECKS:
            raise refused("only", f"no check {name!r}; {expected_of(name, CHECKS)}")
    return tuple(name for name in CHECKS if (name in only if only else not (quick and name in LONG)))


def run_audit(
    names: Collection[str] = tuple(CHECKS),
    *,
    engine: Engine | None = None,
    on_done: Callable[[Chapter], None] | None = None,
) -> AuditReport:
    """Run some of the `CHECKS` on an engine, the installed one if None is given; ``on_done`` is called after each."""
    binary = engine or find_engine()
    model = model_sha256(binary) or ""
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench = Bench(binary, Path(folder))

        def measure(name: str) -> Chapter:
            begin, title = time.perf_counter(), (CHECKS[name].__doc__ or "").rstrip(".")
            try:
                lines = tuple(CHECKS[name](bench))
            except Exception as failure:  # another build of the engine may fail in any way
                reason = str(failure).split(" (see ", 1)[0] or type(failure).__name__
                lines = (Line.without_number(f"{title}: {reason}", Verdict.ERROR),)
            chapter = Chapter(name, title, lines, seconds=time.perf_counter() - begin)
            if on_done:
                on_done(chapter)
            return chapter

        pool = ThreadPoolExecutor(2)
        try:
            chapters = tuple(pool.map(measure, names))
        finally:
            bench.stop.set()
            pool.shutdown(cancel_futures=True)
        return AuditReport(binary, model, bench.version, chapters)


def record(report: AuditReport, *, quick: bool) -> AuditRecord | None:
    """Keep a report for the user: runs with this binary name it, and are refused if it failed.

    A report with lines that could not be measured is not kept, because the reason is the machine, not the binary.
    """
    if count(report.chapters, Verdict.ERROR):
        return None
    kept = AuditRecord(
        engine=report.engine.sha256,
        contact_model=report.contact_model,
        version=report.version,
        scope="quick" if quick else "full",
        lines=sum(len(chapter.lines) for chapter in report.chapters),
        failures=tuple(line.what for line in report.failures),
        skipped=count(report.chapters, Verdict.SKIPPED),
        date=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    )
    write_audit(kept)
    return kept
