"""``walkers check engine``: run the checks on an engine, two at a time, and record the outcome.

The checks themselves are in `walkers.second_engine.scenes`.
"""

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
    """Run the checks of `CHECKS` on an engine.

    Parameters
    ----------
    only
        Names of the checks to run; empty: all.
    engine
        The engine; None: the installed one.
    on_done
        Called with the name of each check when it is done.

    Returns
    -------
    lines : list of Line
        The lines of the checks.
    version : str
        The version that the engine prints.

    Raises
    ------
    InputError
        If there is no check of a name in ``only``.
    """
    binary = engine or find_engine()
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench = Bench(binary, Path(folder))
        pool = ThreadPoolExecutor(2)
        try:
            lines = run_checks(CHECKS, bench, only, on_done, pool.map)
            return lines, bench.version
        finally:
            bench.stop.set()
            pool.shutdown(cancel_futures=True)


def record(lines: Sequence[Line], engine: Engine, version: str) -> None:
    """Record an audit for the user: runs with this binary name it, and are refused if it failed.

    An audit with lines that could not be measured is not recorded, because the machine is the
    reason, not the binary.

    Parameters
    ----------
    lines
        The lines of all checks.
    engine
        The engine that was checked.
    version
        The version that the engine prints.
    """
    if any(line.verdict is Verdict.ERROR for line in lines):
        return
    failed = [line.quantity for line in failures(lines)]
    outcome = {
        "contact_model": model_sha256(engine),
        "version": version,
        "passed": not failed,
        "lines": len(lines),
        "failures": failed,
        "date": iso_time(time.time()),
    }
    write_audit(engine.sha256, outcome)
