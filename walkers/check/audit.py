"""``walkers check engine``: run the checks on an engine, two decks at a time, and keep the outcome."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from walkers.check.lines import Line, Verdict, count, failures, run_checks
from walkers.check.scenes import CHECKS, Bench
from walkers.runner.binary import AuditRecord, Engine, find_engine, model_sha256, write_audit


def run_audit(
    only: Collection[str] = (), *, engine: Engine | None = None, on_done: Callable[[str], None] | None = None
) -> tuple[list[Line], str]:
    """Run all `CHECKS` or some on an engine, the installed one if None is given: lines, and the engine's version.

    ``on_done`` is told the name of each check.
    """
    binary = engine or find_engine()
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench, pool = Bench(binary, Path(folder)), ThreadPoolExecutor(2)
        try:
            return run_checks(CHECKS, bench, only, on_done, pool.map), bench.version
        finally:
            bench.stop.set()
            pool.shutdown(cancel_futures=True)


def record(lines: Sequence[Line], engine: Engine, version: str) -> AuditRecord | None:
    """Keep an audit for the user: runs with this binary name it, and are refused if it failed.

    An audit with lines that could not be measured is not kept, because the reason is the machine, not the binary.
    """
    if count(lines, Verdict.ERROR):
        return None
    kept = AuditRecord(
        engine=engine.sha256,
        contact_model=model_sha256(engine) or "",
        version=version,
        lines=len(lines),
        failures=tuple(line.quantity for line in failures(lines)),
        skipped=count(lines, Verdict.SKIPPED),
        date=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    )
    write_audit(kept)
    return kept
