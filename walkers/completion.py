"""What a shell offers as values of arguments: shipped names, files, runs and sweeps that are there.

Where nothing is offered the shell completes names of files by itself. Nothing is imported that takes time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import typer

from walkers.pipeline import DEFAULT_OUT, RECORDS

_RUN = re.compile(r".+-[0-9a-f]{12}")
_RECORD, _MANIFEST = RECORDS["sweep"], RECORDS["run"]


def cases(incomplete: str) -> list[str]:
    """Shipped cases, and TOML files."""
    from walkers.inputs.reading import shipped_cases

    return _beginning(incomplete, [*shipped_cases(), *_typed(incomplete, "*.toml")])


def sweep_files(incomplete: str) -> list[str]:
    """Shipped sweeps, and TOML files."""
    from walkers.inputs.sweep import shipped_sweeps

    return _beginning(incomplete, [*shipped_sweeps(), *_typed(incomplete, "*.toml")])


def runs(ctx: typer.Context, incomplete: str) -> list[str]:
    """Shipped cases, names of finished runs in ``--out``, and their directories."""
    from walkers.inputs.reading import shipped_cases

    return _beginning(incomplete, [*shipped_cases(), *_named(_out(ctx), _MANIFEST), *_folders(incomplete, _MANIFEST)])


def sweeps(incomplete: str) -> list[str]:
    """Directories of sweeps."""
    return _beginning(incomplete, _folders(incomplete or f"{DEFAULT_OUT}/", _RECORD))


def runs_and_sweeps(ctx: typer.Context, incomplete: str) -> list[str]:
    """Those of `runs`, and sweeps by name and directory."""
    of_sweeps = [*_named(_out(ctx), _RECORD), *_folders(incomplete, _RECORD)]
    return [*runs(ctx, incomplete), *_beginning(incomplete, of_sweeps)]


def case_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Names of the cases that were run in ``--out``."""
    return _beginning(incomplete, (name.rpartition("-")[0] for name in _named(_out(ctx), _MANIFEST)))


def _out(ctx: typer.Context) -> Path:
    return Path(ctx.params.get("out") or DEFAULT_OUT)


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in dict.fromkeys(names) if name.startswith(incomplete)]


def _named(out: Path, kind: str) -> list[str]:
    """Names of what has such a file in a folder of runs."""
    folders = sorted(path.parent.name for path in out.glob(f"*/{kind}"))
    return [name for name in folders if kind == _RECORD or _RUN.fullmatch(name)]


def _folders(incomplete: str, kind: str) -> list[str]:
    """Folders that begin as what was typed and have such a file."""
    return _typed(incomplete, f"*/{kind}")


def _typed(incomplete: str, pattern: str) -> list[str]:
    """What there is of a pattern in the folder that was typed: its first part."""
    folder = incomplete.rpartition("/")[0] + "/" if "/" in incomplete else ""
    found = Path(folder or ".").glob(pattern)
    return sorted(f"{folder}{path.relative_to(folder).parts[0]}" for path in found)
