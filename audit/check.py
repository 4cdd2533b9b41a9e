"""What a check is, and the lines of the table that it gives."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite

from walkers.audit.bench import Bench


class Verdict(StrEnum):
    """Outcome of a line.

    A defect of the raw engine is present or gone, which is no failure; a check that could not be run is an error.
    """

    PASS = "pass"
    FAIL = "FAIL"
    ERROR = "ERROR"
    REPORT = "report"
    PRESENT = "present"
    GONE = "gone"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class Line:
    """One line of the audit's table.

    Attributes
    ----------
    what
        What was measured.
    source
        The formula and where it stands.
    expected, measured
        Numbers in ``unit``.
    unit
        Unit of both; empty for a pure number.
    tolerance
        Largest relative error that passes; None for a line that is only reported.
    error
        Relative error where it is not that of the two numbers: the largest over a series.
    needs
        Workarounds that this line stands on (``carriers``, ``walls``, ``angle``, ``time step``): without one it fails.
    defect
        The line measures a defect of the raw engine, expected as it was when the workarounds were made.
    unmeasured
        Why nothing was measured, as a verdict: ``ERROR`` or ``SKIPPED``.
    """

    what: str
    source: str
    expected: float
    measured: float
    unit: str = ""
    tolerance: float | None = None
    error: float | None = None
    needs: frozenset[str] = frozenset()
    defect: bool = False
    unmeasured: Verdict | None = None

    @property
    def relative_error(self) -> float:
        """The error that is judged."""
        if self.error is not None:
            return self.error
        if self.expected == 0.0:
            return abs(self.measured)
        return abs(self.measured / self.expected - 1.0)

    @property
    def verdict(self) -> Verdict:
        """Pass or fail by the tolerance; an error that is no number fails."""
        if self.unmeasured is not None:
            return self.unmeasured
        if self.defect:
            return Verdict.PRESENT if self.relative_error <= (self.tolerance or 0.0) else Verdict.GONE
        if self.tolerance is None:
            return Verdict.REPORT
        passed = isfinite(self.relative_error) and self.relative_error <= self.tolerance
        return Verdict.PASS if passed else Verdict.FAIL


@dataclass(frozen=True)
class Check:
    """A measurement on the engine.

    Attributes
    ----------
    name
        For ``walkers audit --only``.
    group
        Number of the group of things that the audit must measure.
    title
        One line on what it is about.
    quick
        Whether it is part of ``--quick``.
    measure
        Runs decks on a bench and gives the lines.
    """

    name: str
    group: int
    title: str
    quick: bool
    measure: Callable[[Bench], Iterable[Line]]
