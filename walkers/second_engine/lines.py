"""Lines of checks: a quantity, its expected and measured value, and the tolerance.

The module runs checks, judges and prints their lines. What is checked stands elsewhere, such as in
`walkers.second_engine.scenes`.
"""

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
from walkers.terminal import styled_status, table_width
from walkers.text import aligned_blocks

T = TypeVar("T")
Map = Callable[[Callable[[str], list["Line"]], Iterable[str]], Iterable[list["Line"]]]
"""`map`, or the ``map`` of a pool: applies a function to the names of checks, in their order."""


class Verdict(StrEnum):
    """Outcome of a line.

    ``ERROR`` means that it could not be measured, ``NOT_JUDGED`` that it has no tolerance.
    """

    PASS = "pass"
    FAIL = "FAIL"
    ERROR = "ERROR"
    NOT_JUDGED = "-"


@dataclass(frozen=True)
class Line:
    """One comparison of a check.

    Attributes
    ----------
    quantity
        What is compared.
    expected, measured
        Both numbers, in ``unit``; of two engines, those of LIGGGHTS and of the second engine.
    tolerance
        The largest error that passes; infinite if the line is not judged.
    unit
        Unit of both numbers; empty for plain numbers.
    scale
        The number, in ``unit``, to which errors are relative. None: the expected number, or 1 if
        that is zero.
    decided
        The verdict, where it does not follow from the error.
    check
        Name of the check of which the line is a part.
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
        scale = abs(self.expected) if self.scale is None else self.scale
        if scale == 0.0:
            scale = 1.0
        return abs(self.measured - self.expected) / scale

    @property
    def verdict(self) -> Verdict:
        """Pass or fail by the tolerance, unless the verdict is decided; an error of NaN fails."""
        if self.decided is not None:
            return self.decided
        if self.tolerance == inf:
            return Verdict.NOT_JUDGED
        return Verdict.PASS if self.error <= self.tolerance else Verdict.FAIL

    @property
    def failed(self) -> bool:
        """Whether the line fails or could not be measured."""
        return self.verdict in (Verdict.FAIL, Verdict.ERROR)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types; NaN and infinity become null."""
        values = {
            "check": self.check,
            "quantity": self.quantity,
            "unit": self.unit,
            "expected": self.expected,
            "measured": self.measured,
            "error": self.error,
            "tolerance": self.tolerance,
        }
        return {**json_numbers(values), "verdict": str(self.verdict)}


def run_checks(
    checks: Mapping[str, Callable[[T], Iterable[Line]]],
    argument: T,
    only: Collection[str] = (),
    on_done: Callable[[str], None] | None = None,
    map_function: Map = map,
) -> list[Line]:
    """Run checks and collect their lines.

    A check that cannot be computed gives one line that says so.

    Parameters
    ----------
    checks
        Functions that give lines, by the names of the checks.
    argument
        What each of these functions is called with.
    only
        Names of the checks to run; empty: all.
    on_done
        Called with the name of each check when it is done.
    map_function
        `map`, or the ``map`` of a pool that runs several checks at once.

    Returns
    -------
    list of Line
        The lines in the order of the checks, each with the name of its check.

    Raises
    ------
    InputError
        If there is no check of a name in ``only``.
    """
    for name in only:
        if name not in checks:
            raise input_error("check", f"no check {name!r}; {expected_of(name, checks)}")

    def lines_of(name: str) -> list[Line]:
        try:
            lines = list(checks[name](argument))
        except Exception as failure:  # another build of the engine may fail in any way
            lines = [_error_line(failure)]
        if on_done:
            on_done(name)
        return [replace(line, check=name) for line in lines]

    chosen = [name for name in checks if name in only or not only]
    all_lines: list[Line] = []
    for lines in map_function(lines_of, chosen):
        all_lines += lines
    return all_lines


def _error_line(failure: Exception) -> Line:
    """The line of a check that cannot be computed."""
    reason = failure.message if isinstance(failure, EngineFailure) else str(failure)
    if not reason:
        reason = type(failure).__name__
    return Line(f"could not be computed: {reason}", nan, nan, decided=Verdict.ERROR)


def failures(lines: Iterable[Line]) -> list[Line]:
    """Lines that fail or could not be measured."""
    return [line for line in lines if line.failed]


def lines_text(lines: Sequence[Line], heading: str = "") -> str:
    """Tables of the lines of each check, and a sentence on how many of them pass.

    Parameters
    ----------
    lines
        The lines; those of a check follow each other.
    heading
        Words before the sentence, such as the name of the engine.
    """
    parts = []
    for check, rows in groupby(lines, lambda line: line.check):
        parts.append(f"{check}\n{_table(rows)}\n")
    verdicts = [line.verdict for line in lines]
    passed = verdicts.count(Verdict.PASS)
    failed = verdicts.count(Verdict.FAIL)
    errors = verdicts.count(Verdict.ERROR)
    outcome = f"all {passed} lines pass"
    if failed:
        outcome = f"{failed} of {passed + failed} lines fail"
    if errors:
        outcome += f", {errors} could not be measured"
    parts.append(heading + outcome)
    return "\n".join(parts)


def _table(lines: Iterable[Line]) -> str:
    """Verdict, quantity, both numbers, unit and error, with a heading."""
    rows = [["", "", "expected", "measured", "", ""]]
    for line in lines:
        error = ""
        if isfinite(line.error + line.tolerance):
            error = f"error {line.error:.1e} of {line.tolerance:.0e}"
        expected = _number_text(line.expected)
        measured = _number_text(line.measured)
        verdict = styled_status(line.verdict)
        rows.append([verdict, line.quantity, expected, measured, line.unit, error])
    return aligned_blocks(rows, table_width(), repeated=2, right=(2, 3))


def _number_text(value: float) -> str:
    return f"{value:.6g}" if isfinite(value) else "-"


def as_dict(lines: Sequence[Line], about: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Plain JSON types of all lines, with values that say what was checked before them."""
    return {
        **(about or {}),
        "passed": not failures(lines),
        "lines": [line.as_dict() for line in lines],
    }
