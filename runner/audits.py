"""What is known of an engine's binary from audits: one record a binary, in the user's cache."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from runner.files import read_json, write_json


@dataclass(frozen=True)
class AuditRecord:
    """Outcome of an audit.

    Attributes
    ----------
    engine
        Hash of the binary (`runner.binary.Engine.sha256`).
    version
        What its banner says.
    scope
        ``full`` or ``quick``.
    lines
        How many lines the audit had.
    failures
        Those that failed.
    date
        UTC, ISO 8601.
    """

    engine: str
    version: str
    scope: str
    lines: int
    failures: tuple[str, ...]
    date: str

    @property
    def passed(self) -> bool:
        """Whether no line failed."""
        return not self.failures

    def summary(self) -> Mapping[str, Any]:
        """What a run's manifest says of it."""
        return {"scope": self.scope, "passed": self.passed, "lines": self.lines, "date": self.date}


def _place(engine: str) -> Path:
    from platformdirs import user_cache_path

    return user_cache_path("granular-walkers") / "audits" / f"{engine}.json"


def read_audit(engine: str) -> AuditRecord | None:
    """The record of a binary, by its hash; None if it was never audited or the record cannot be read."""
    try:
        values = read_json(_place(engine))
        return AuditRecord(**{**values, "failures": tuple(values["failures"])})
    except (OSError, ValueError, KeyError, TypeError):
        return None


def write_audit(record: AuditRecord) -> None:
    """Keep a record. A quick audit that passes does not displace a full one that did.

    Raises
    ------
    OSError
        If the user's cache cannot be written.
    """
    known = read_audit(record.engine)
    if known and known.passed and known.scope == "full" and record.scope == "quick" and record.passed:
        return
    place = _place(record.engine)
    place.parent.mkdir(parents=True, exist_ok=True)
    write_json(place, asdict(record))
