"""``walkers check engine``: run the checks on an engine, two decks at a time, and report the results."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from walkers.check.lines import Line, Verdict, as_dict, as_text, count, failures, outcome
from walkers.check.scenes import CHECKS, LONG, Bench
from walkers.errors import expected_of, refused
from walkers.runner.binary import AuditRecord, Engine, find_engine, model_sha256, write_audit


@dataclass(frozen=True)
class Audit:
    """Lines of an audit; ``contact_model`` is the SHA-256 of the contact model, empty without one."""

    engine: Engine
    contact_model: str
    version: str
    lines: tuple[Line, ...]

    @property
    def failures(self) -> list[Line]:
        """The lines that fail, or could not be measured."""
        return failures(self.lines)

    def as_text(self) -> str:
        """A table for each check, and the outcome."""
        text = f"{self.version}, binary and contact model {self.engine.sha256[:12]}: {outcome(self.lines)}"
        return f"{as_text(self.lines)}\n\n{text}"

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        engine = {"path": str(self.engine.path), "sha256": self.engine.sha256, "version": self.version}
        return as_dict(self.lines, engine=engine)


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
    on_done: Callable[[str], None] | None = None,
) -> Audit:
    """Run some of the `CHECKS` on an engine, the installed one if None is given; ``on_done`` is told each name."""
    binary = engine or find_engine()
    model = model_sha256(binary) or ""
    with tempfile.TemporaryDirectory(prefix="walkers-audit-") as folder:
        bench = Bench(binary, Path(folder))

        def measure(name: str) -> list[Line]:
            try:
                lines = list(CHECKS[name](bench))
            except Exception as failure:  # another build of the engine may fail in any way
                reason = str(failure).split(" (see ", 1)[0] or type(failure).__name__
                lines = [Line.without_number(reason, Verdict.ERROR)]
            if on_done:
                on_done(name)
            return [replace(line, check=name) for line in lines]

        pool = ThreadPoolExecutor(2)
        try:
            lines = tuple(chain.from_iterable(pool.map(measure, names)))
        finally:
            bench.stop.set()
            pool.shutdown(cancel_futures=True)
        return Audit(binary, model, bench.version, lines)


def record(audit: Audit, *, quick: bool) -> AuditRecord | None:
    """Keep an audit for the user: runs with this binary name it, and are refused if it failed.

    An audit with lines that could not be measured is not kept, because the reason is the machine, not the binary.
    """
    if count(audit.lines, Verdict.ERROR):
        return None
    kept = AuditRecord(
        engine=audit.engine.sha256,
        contact_model=audit.contact_model,
        version=audit.version,
        scope="quick" if quick else "full",
        lines=len(audit.lines),
        failures=tuple(line.what for line in audit.failures),
        skipped=count(audit.lines, Verdict.SKIPPED),
        date=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    )
    write_audit(kept)
    return kept
