"""Completion of arguments in a shell: shipped names, files, existing runs and sweeps.

If nothing is offered, the shell completes names of files by itself. Slow imports are avoided.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import typer

from walkers import DEFAULT_OUT, RECORDS

_RUN = re.compile(r".+-[0-9a-f]{12}")


def offering(*kinds: str) -> Callable[[typer.Context, str], list[str]]:
    """A function that offers values of some kinds that begin with the typed text.

    Parameters
    ----------
    kinds
        ``case``, ``sweep file``: shipped ones, and TOML files. ``run``, ``sweep``: names in ``--out``, and directories.
    """

    def offered(ctx: typer.Context, incomplete: str) -> list[str]:
        from walkers.inputs.reading import shipped

        names: list[str] = []
        for kind in kinds:
            if kind in RECORDS:
                names += [*_names(ctx, kind), *_typed(incomplete, f"*/{RECORDS[kind]}")]
            else:
                names += [*shipped("case" if kind == "case" else "sweep"), *_typed(incomplete, "*.toml")]
        return [name for name in dict.fromkeys(names) if name.startswith(incomplete)]

    return offered


def names_of_cases(ctx: typer.Context, incomplete: str) -> list[str]:
    """Names of the cases that were run in ``--out``."""
    names = dict.fromkeys(name.rpartition("-")[0] for name in _names(ctx, "run"))
    return [name for name in names if name.startswith(incomplete)]


def _names(ctx: typer.Context, kind: str) -> list[str]:
    """Names of runs or sweeps in ``--out``."""
    out = Path(ctx.params.get("out") or DEFAULT_OUT)
    folders = sorted(path.parent.name for path in out.glob(f"*/{RECORDS[kind]}"))
    return [name for name in folders if kind == "sweep" or _RUN.fullmatch(name)]


def _typed(incomplete: str, pattern: str) -> list[str]:
    """Files that match a pattern in the folder at the beginning of the typed text."""
    folder = incomplete.rpartition("/")[0] + "/" if "/" in incomplete else ""
    found = Path(folder or ".").glob(pattern)
    return sorted(f"{folder}{path.relative_to(folder).parts[0]}" for path in found)
