"""Checks are lines: a quantity, its expected and measured value, and the tolerance."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import groupby
from math import inf, isfinite, nan
from typing import Any, TypeVar

from walkers.errors import expected_of, input_error
from walkers.postprocess.measure.results import json_numbers
from walkers.runner.failures import EngineFailure
from walkers.text import aligned

T = TypeVar("T")


class Verdict(StrEnum):
    """Outcome of a line: ``ERROR`` if it could not be measured, ``NOT_JUDGED`` without a tolerance."""

    PASS = "pass"
    FAIL = "FAIL"
    ERROR = "ERROR"
    NOT_JUDGED = "-"


@dataclass(frozen=True)
class Line:
    """One comparison, part of the ``check`` of that name.

    ``expected`` and ``measured`` are in ``unit`` (of two engines: LIGGGHTS and the second engine). ``tolerance`` is the
    largest error that passes, infinite without a judgement. Errors are relative to ``scale``; default: the expected
    number, or 1 if that is 0. ``decided`` is a verdict that does not follow from the error.
    """

    quantity: str
    expected: float
    measured: float
    tolerance: float = inf
    unit: str = ""
    scale: float | None = None
    decided: Verdict | None = None
    check: str = ""

    @property
    def error(self) -> float:
        """The error that is judged."""
        return abs(self.measured - self.expected) / (self.scale or abs(self.expected) or 1.0)

    @property
    def verdict(self) -> Verdict:
        """Pass or fail by the tolerance; NaN fails."""
        if self.decided or self.tolerance == inf:
            return self.decided or Verdict.NOT_JUDGED
        return Verdict.PASS if self.error <= self.tolerance else Verdict.FAIL

    @property
    def failed(self) -> bool:
        """Whether the line fails or could not be measured."""
        return self.verdict in (Verdict.FAIL, Verdict.ERROR)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types; NaN and infinity become null."""
        names = ("check", "quantity", "unit", "expected", "measured", "error", "tolerance")
        return json_numbers({name: getattr(self, name) for name in names}) | {
            "verdict": str(self.verdict)
        }


def run_checks(
    checks: Mapping[str, Callable[[T], Iterable[Line]]],
    argument: T,
    only: Collection[str] = (),
    on_done: Callable[[str], None] | None = None,
    mapped: Callable[[Callable[[str], list[Line]], Iterable[str]], Iterable[list[Line]]] = map,
) -> list[Line]:
    """Lines of checks, or ``only`` of some; a check that cannot be computed is a line. ``on_done`` gets each name."""
    for name in only:
        if name not in checks:
            raise input_error("check", f"no check {name!r}; {expected_of(name, checks)}")

    def lines_of(name: str) -> list[Line]:
        try:
            lines = list(checks[name](argument))
        except Exception as failure:  # another build of the engine may fail in any way
            reason = failure.message if isinstance(failure, EngineFailure) else str(failure)
            reason = reason or type(failure).__name__
            lines = [Line(f"could not be computed: {reason}", nan, nan, decided=Verdict.ERROR)]
        if on_done:
            on_done(name)
        return [replace(line, check=name) for line in lines]

    return [
        line
        for lines in mapped(lines_of, [name for name in checks if name in only or not only])
        for line in lines
    ]


def failures(lines: Iterable[Line]) -> list[Line]:
    """Lines that fail or could not be measured."""
    return [line for line in lines if line.failed]


def lines_text(lines: Sequence[Line], of: str = "") -> str:
    """A table below the name of each check, and the number of lines that pass, after the words ``of``."""
    tables = [
        f"{check}\n{_table(rows)}\n" for check, rows in groupby(lines, lambda line: line.check)
    ]
    passed, failed, unknown = (
        sum(line.verdict is verdict for line in lines)
        for verdict in (Verdict.PASS, Verdict.FAIL, Verdict.ERROR)
    )
    outcome = f"{failed} of {passed + failed} lines fail" if failed else f"all {passed} lines pass"
    outcome += f", {unknown} could not be measured" if unknown else ""
    return "\n".join([*tables, of + outcome])


def _table(lines: Iterable[Line]) -> str:
    rows = [["", "", "expected", "measured"]]
    for line in lines:
        judged = (
            f"error {line.error:.1e} of {line.tolerance:.0e}"
            if isfinite(line.error + line.tolerance)
            else ""
        )
        pair = [
            f"{value:.6g}" if isfinite(value) else "-" for value in (line.expected, line.measured)
        ]
        rows.append([line.verdict, line.quantity, *pair, line.unit, judged])
    return aligned([[*row, "", ""][:6] for row in rows], right=(2, 3))


def as_dict(lines: Sequence[Line], **more: Any) -> dict[str, Any]:
    """Plain JSON types of all lines and of further values."""
    return {**more, "passed": not failures(lines), "lines": [line.as_dict() for line in lines]}
