"""Audits of an engine: their outcomes in the user's cache, and what they decide about runs.

An audit is of a binary and of a build of the contact model. `walkers.second_engine.audit` makes it.
"""

from __future__ import annotations

import shlex
import warnings
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any

from walkers.cache import cache_folder, is_trusted, make_cache_folder
from walkers.files import read_json, write_json
from walkers.runner.binary import ENGINE_VARIABLE, Engine
from walkers.runner.compiled_model import model_sha256
from walkers.runner.failures import AuditFailed, UnauditedEngineWarning


def check_audit(engine: Engine) -> None:
    """Refuse an engine whose audit failed, and warn of one without an audit.

    An audit is of a binary and of a build of the contact model. Another binary or another build has none until
    ``walkers check engine`` audits it.

    Parameters
    ----------
    engine
        The engine that is to run a deck.

    Raises
    ------
    AuditFailed
        If a force of this engine with its contact model was not as expected.

    Warns
    -----
    UnauditedEngineWarning
        If the engine was never audited with its contact model; once in a process.
    """
    audit = read_audit(engine.sha256, model_sha256(engine))
    if audit is None:
        _warn_unaudited(engine)
    elif not audit["passed"]:
        failures = audit["failures"]
        raise AuditFailed(
            f"{engine.path} failed its audit in {len(failures)} line(s), first: {failures[0]}; to see them and to "
            f"audit it again: walkers check engine --engine {shlex.quote(str(engine.path))}; to run, install Debian's "
            f"package liggghts again, or name another binary by --engine or {ENGINE_VARIABLE}"
        )


@lru_cache(maxsize=8)
def _warn_unaudited(engine: Engine) -> None:
    """Warn of an engine without an audit. The cache makes this once in a process."""
    command = f"walkers check engine --engine {shlex.quote(str(engine.path))}"
    warnings.warn(
        f"{engine.path} was never audited with its contact model: {command}",
        UnauditedEngineWarning,
        stacklevel=4,
    )


def read_audit(engine: str, model: str | None) -> dict[str, Any] | None:
    """Outcome of the audit of a binary, by its hash; None without one with this contact model (its hash; None: any)."""
    path = cache_folder() / "audits" / f"{engine}.json"
    if not is_trusted(path):
        return None
    with suppress(OSError, ValueError, KeyError):
        record = read_json(path)
        if model in (None, record["contact_model"]):
            return {name: record[name] for name in ("passed", "lines", "failures", "date")}
    return None


def write_audit(engine: str, record: Mapping[str, Any]) -> None:
    """Save the record of a binary in place of the one before. Raises `OSError` if the cache cannot be written."""
    path = make_cache_folder("audits") / f"{engine}.json"
    write_json(path, record)
    path.chmod(0o644)  # whatever the umask: a record that others can write is not believed
