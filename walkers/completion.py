"""What a shell offers as values of arguments: shipped names, files, runs and sweeps that are there.

Where nothing is offered the shell completes names of files by itself. Nothing is imported that takes time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import typer

from walkers.pipeline import DEFAULT_OUT, RECORDS

_RUN = re.compile(r".+-[0-9a-f]{12}")
_RECORD, _MANIFEST = RECORDS["sweep"], RECORDS["run"]


def cases(incomplete: str) -> list[str]:
    """Shipped cases, and TOML files."""
    from walkers.inputs.reading import shipped_cases

    return _beginning(incomplete, [*shipped_cases(), *_files(incomplete)])


def sweep_files(incomplete: str) -> list[str]:
    """Shipped sweeps, and TOML files."""
    from walkers.inputs.sweep import shipped_sweeps

    return _beginning(incomplete, [*shipped_sweeps(), *_files(incomplete)])


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


def _entries(folder: Path) -> list[str]:
    try:
        return sorted(entry.name for entry in folder.iterdir())
    except OSError:
        return []


def _named(out: Path, kind: str) -> Iterator[str]:
    """Names of what has such a file in a folder of runs."""
    for name in _entries(out):
        if (out / name / kind).is_file() and (kind == _RECORD or _RUN.fullmatch(name)):
            yield name


def _folders(incomplete: str, kind: str) -> list[str]:
    """Folders that begin as what was typed and have such a file."""
    folder = incomplete.rpartition("/")[0] + "/" if "/" in incomplete else ""
    found = [f"{folder}{name}" for name in _entries(Path(folder or "."))]
    return [path for path in found if path.startswith(incomplete) and (Path(path) / kind).is_file()]


def _files(incomplete: str) -> list[str]:
    folder = incomplete.rpartition("/")[0] + "/" if "/" in incomplete else ""
    return [f"{folder}{name}" for name in _entries(Path(folder or ".")) if name.endswith(".toml")]
