"""What a check gives: lines of what is expected and what was measured, each with a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """Outcome of a line; ``ERROR`` is that of a check that could not be run."""

    PASS = "pass"
    FAIL = "FAIL"
    ERROR = "ERROR"
    SKIPPED = "skipped"


@dataclass(frozen=True)
class Line:
    """One line of a table.

    Attributes
    ----------
    what
        What was measured, and the formula.
    expected, measured
        Numbers in ``unit``.
    tolerance
        Largest error that passes, over the expected number if that is not 0.
    unit
        Of both; empty for a pure number.
    unmeasured
        Why nothing was measured, as a verdict: ``ERROR`` or ``SKIPPED``.
    """

    what: str
    expected: float
    measured: float
    tolerance: float
    unit: str = ""
    unmeasured: Verdict | None = None

    @property
    def error(self) -> float:
        """The error that is judged."""
        return abs(self.measured - self.expected) / (abs(self.expected) or 1.0)

    @property
    def verdict(self) -> Verdict:
        """Pass or fail by the tolerance; an error that is no number fails."""
        return self.unmeasured or (Verdict.PASS if self.error <= self.tolerance else Verdict.FAIL)
