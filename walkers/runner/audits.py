"""What is known of an engine's binary from audits: one record a binary, in the user's cache."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from walkers.runner.files import read_json, write_json


@dataclass(frozen=True)
class AuditRecord:
    """Outcome of an audit.

    Attributes
    ----------
    engine
        Hash of the binary (`walkers.runner.binary.Engine.sha256`).
    version
        What its banner says.
    scope
        ``full`` or ``quick``.
    lines
        How many lines the audit had.
    failures
        Those that failed.
    skipped
        How many could not be measured for want of a program, such as mpirun.
    date
        UTC, ISO 8601.
    """

    engine: str
    version: str
    scope: str
    lines: int
    failures: tuple[str, ...]
    skipped: int
    date: str

    @property
    def passed(self) -> bool:
        """Whether no line failed."""
        return not self.failures

    def summary(self) -> Mapping[str, Any]:
        """What a run's manifest says of it."""
        return {name: getattr(self, name) for name in ("scope", "passed", "lines", "skipped", "date")}


def _place(engine: str, scope: str) -> Path:
    from platformdirs import user_cache_path

    return user_cache_path("granular-walkers") / "audits" / f"{engine}.{scope}.json"


def _read(engine: str, scope: str) -> AuditRecord | None:
    try:
        values = read_json(_place(engine, scope))
        return AuditRecord(**{**values, "failures": tuple(values["failures"])})
    except (OSError, ValueError, KeyError, TypeError):
        return None


def read_audit(engine: str) -> AuditRecord | None:
    """The record of a binary, by its hash: one that failed if there is one, else the full one, else the quick one.

    None if the binary was never audited or its records cannot be read.
    """
    known = [record for scope in ("full", "quick") if (record := _read(engine, scope)) is not None]
    return next((record for record in known if not record.passed), known[0] if known else None)


def write_audit(record: AuditRecord) -> None:
    """Keep a record. A full audit replaces a quick one, for it holds all of its lines; a quick one stands beside it.

    Raises
    ------
    OSError
        If the user's cache cannot be written.
    """
    place = _place(record.engine, record.scope)
    place.parent.mkdir(parents=True, exist_ok=True)
    write_json(place, asdict(record))
    if record.scope == "full":
        _place(record.engine, "quick").unlink(missing_ok=True)
