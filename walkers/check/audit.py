"""``walkers check engine``: run the checks on an engine, two decks at a time, and keep the outcome."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from walkers.check.lines import Line, Verdict, count, failures, run_checks
from walkers.check.scenes import CHECKS, Bench
from walkers.runner.binary import AuditRecord, Engine, find_engine, model_sha256, write_audit


@dataclass(frozen=True)
class Audit:
    """Lines of an audit; ``contact_model`` is the SHA-256 of the contact model, empty without one."""

    engine: Engine
    contact_model: str
    version: str
    lines: tuple[Line, ...]


def run_audit(
    only: Collection[str] = (), *, engine: Engine | None = None, on_done: Callable[[str], None] | None = None
) -> Audit:
    """Run all `CHECKS` or some on an engine, the installed one if None is given; ``on_done`` is told each name."""
    binary = engine or find_engine()
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench, pool = Bench(binary, Path(folder)), ThreadPoolExecutor(2)
        try:
            lines = run_checks(CHECKS, bench, only, on_done, pool.map)
        finally:
            bench.stop.set()
            pool.shutdown(cancel_futures=True)
    return Audit(binary, model_sha256(binary) or "", bench.version, tuple(lines))


def record(audit: Audit) -> AuditRecord | None:
    """Keep an audit for the user: runs with this binary name it, and are refused if it failed.

    An audit with lines that could not be measured is not kept, because the reason is the machine, not the binary.
    """
    if count(audit.lines, Verdict.ERROR):
        return None
    kept = AuditRecord(
        engine=audit.engine.sha256,
        contact_model=audit.contact_model,
        version=audit.version,
        lines=len(audit.lines),
        failures=tuple(line.quantity for line in failures(audit.lines)),
        skipped=count(audit.lines, Verdict.SKIPPED),
        date=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    )
    write_audit(kept)
    return kept
