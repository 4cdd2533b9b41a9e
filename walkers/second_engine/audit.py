"""``walkers check engine``: run the checks on an engine, two decks at a time, and keep the outcome."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from walkers.runner.audit import write_audit
from walkers.runner.binary import Engine, find_engine
from walkers.runner.compiled_model import model_sha256
from walkers.runner.manifest import iso_time
from walkers.second_engine.lines import Line, Verdict, failures, run_checks
from walkers.second_engine.scenes import CHECKS, Bench


def run_audit(
    only: Collection[str] = (),
    *,
    engine: Engine | None = None,
    on_done: Callable[[str], None] | None = None,
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


def record(lines: Sequence[Line], engine: Engine, version: str) -> None:
    """Keep an audit for the user: runs with this binary name it, and are refused if it failed.

    An audit with lines that could not be measured is not kept, because the reason is the machine, not the binary.
    """
    if not any(line.verdict is Verdict.ERROR for line in lines):
        failed = [line.quantity for line in failures(lines)]
        outcome = {
            "passed": not failed,
            "lines": len(lines),
            "failures": failed,
            "date": iso_time(time.time()),
        }
        write_audit(
            engine.sha256, {"contact_model": model_sha256(engine), "version": version, **outcome}
        )
