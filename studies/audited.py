"""Chapters that are made of the audit's checks: their lines as tables, and what was measured for the figures."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

from walkers.audit.bench import Bench
from walkers.audit.check import Check, Line, Verdict
from walkers.runner.binary import Engine, find_engine


@contextmanager
def temporary_bench(engine: Engine | None = None) -> Iterator[Bench]:
    """A bench of an engine (the installed one if None), gone with the block."""
    with tempfile.TemporaryDirectory(prefix="walkers-study-") as folder:
        yield Bench(engine or find_engine(), Path(folder))


def lines_of(checks: Iterable[Check], bench: Bench) -> list[Line]:
    """All lines of some checks."""
    return [line for check in checks for line in check.measure(bench)]


def failures(lines: Iterable[Line]) -> tuple[str, ...]:
    """What was expected to hold and does not: judged lines that fail, and defects that are gone."""
    return tuple(line.what for line in lines if line.verdict in (Verdict.FAIL, Verdict.GONE))


def as_numbers(lines: Iterable[Line]) -> dict[str, Any]:
    """Lines as plain numbers, by what they say."""
    return {
        line.what: {"expected": line.expected, "measured": line.measured, "verdict": str(line.verdict)}
        for line in lines
    }


def line_table(lines: Iterable[Line]) -> str:
    """A Markdown table of lines."""
    rows = [
        (
            line.what,
            line.source,
            f"{_number(line.expected)} {line.unit}".strip(),
            f"{_number(line.measured)} {line.unit}".strip(),
            f"{line.relative_error:.1e}",
            f"{line.tolerance:.0e}" if line.tolerance is not None else "",
            str(line.verdict),
        )
        for line in lines
    ]
    return table(("what", "reference", "expected", "engine", "error", "tolerance", ""), rows)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(_row(cells) for cells in (head, ["---"] * len(head), *rows))


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _number(value: float) -> str:
    return f"{value:.4g}" if isfinite(value) else "-"
