"""Audits of an engine: their outcomes in the user's cache, and what they decide about runs.

An audit compares the forces and motions of a few beads, as the engine computes them, with the
expected ones. It is valid for one binary and one build of the contact model.
`walkers.second_engine.audit` makes it.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from platform import node
from typing import Any

from walkers.cache import cache_folder, is_trusted, make_cache_folder
from walkers.files import read_json, write_json
from walkers.runner.binary import ENGINE_VARIABLE, Engine
from walkers.runner.compiled_model import model_sha256
from walkers.runner.failures import AuditFailed, UnauditedEngineWarning
from walkers.warning import warn_user

_OUTCOME = ("passed", "lines", "failures", "date")
"""Entries of the outcome of an audit: whether it passed, its lines, those that failed, the date."""


def check_audit(engine: Engine) -> None:
    """Refuse an engine whose audit failed, and warn of one without an audit.

    An audit is valid for one binary and one build of the contact model. Another binary or another
    build has none until ``walkers check engine`` audits it.

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
        If the engine was never audited with its contact model; once on a machine. The manifests of
        its runs say so, too.
    """
    model = model_sha256(engine)
    audit = read_audit(engine.sha256, model)
    if audit is None:
        _warn_unaudited(engine, model)
    elif not audit["passed"]:
        failures = audit["failures"]
        raise AuditFailed(
            f"{engine.path} failed its audit in {len(failures)} line(s), first: {failures[0]}; "
            f"to see them and to audit it again: {_audit_command(engine)}; to run, install "
            "Debian's package liggghts again, or name another binary by --engine (in "
            f"Python engine=) or {ENGINE_VARIABLE}"
        )


def _audit_command(engine: Engine) -> str:
    """The command with which the user audits an engine."""
    return f"walkers check engine --engine {shlex.quote(str(engine.path))}"


@lru_cache(maxsize=8)
def _warn_unaudited(engine: Engine, model: str | None) -> None:
    """Warn of an engine without an audit, unless this machine has been warned of it before.

    What the cache notes is the name of the machine, because home folders may be shared. Where the
    cache cannot be written, each process warns.
    """
    note = cache_folder() / "unaudited" / f"{node()}-{engine.sha256[:12]}-{(model or '')[:12]}"
    if note.exists():
        return
    with suppress(OSError):
        make_cache_folder(note.parent.name)
        note.touch()
    warn_user(
        f"{engine.path} was never audited with its contact model: {_audit_command(engine)} "
        "compares the forces of this binary with the expected ones, once for a machine. Until "
        "then, runs are computed all the same, but nothing shows that their forces are right "
        "(this is said once)",
        UnauditedEngineWarning,
    )


def read_audit(engine: str, model: str | None) -> dict[str, Any] | None:
    """The outcome of the audit of a binary.

    Parameters
    ----------
    engine
        SHA-256 of the engine (`walkers.runner.binary.Engine`).
    model
        SHA-256 of the contact model; None: any.

    Returns
    -------
    dict or None
        The entries of `_OUTCOME`; None without an audit of the engine with this contact model.
    """
    path = cache_folder() / "audits" / f"{engine}.json"
    if not is_trusted(path):
        return None
    with suppress(OSError, ValueError, KeyError):
        record = read_json(path)
        if model in (None, record["contact_model"]):
            return {name: record[name] for name in _OUTCOME}
    return None


def write_audit(engine: str, record: Mapping[str, Any]) -> None:
    """Save the record of the audit of a binary, by the binary's SHA-256, in place of the last one.

    Raises `OSError` if the cache cannot be written.
    """
    path = make_cache_folder("audits") / f"{engine}.json"
    write_json(path, record)
    path.chmod(0o644)  # for any umask: a record that others can write is not believed
