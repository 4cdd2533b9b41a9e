"""What checks give: chapters of lines, each with what is expected, what was measured, and a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Verdict(StrEnum):
    """Outcome of a line: ``ERROR`` if it could not be measured, ``TOLD`` if nothing judges it."""

    PASS = "pass"
    FAIL = "FAIL"
    ERROR = "ERROR"
    SKIPPED = "skipped"
    TOLD = "-"


@dataclass(frozen=True)
class Line:
    """One line of a table.

    ``expected`` and ``measured`` are in ``unit``; between two engines they are the first one's and the second one's.
    The largest error that passes is ``tolerance``, infinite where nothing is judged; it is over ``scale``, if left out
    over the expected number, or 1 if that is 0. ``given`` is a verdict that does not follow from the error.
    """

    what: str
    expected: float
    measured: float
    tolerance: float = inf
    unit: str = ""
    scale: float | None = None
    given: Verdict | None = None

    @classmethod
    def without_number(cls, what: str, verdict: Verdict) -> Line:
        """Of what could not be measured."""
        return cls(what, nan, nan, given=verdict)

    @property
    def error(self) -> float:
        """The error that is judged."""
        return abs(self.measured - self.expected) / (self.scale or abs(self.expected) or 1.0)

    @property
    def verdict(self) -> Verdict:
        """Pass or fail by the tolerance; an error that is no number fails."""
        if self.given or self.tolerance == inf:
            return self.given or Verdict.TOLD
        return Verdict.PASS if self.error <= self.tolerance else Verdict.FAIL

    @property
    def failed(self) -> bool:
        """Whether it is not as expected, or could not be measured."""
        return self.verdict in (Verdict.FAIL, Verdict.ERROR)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types; numbers that are none become null."""
        numbers = {name: getattr(self, name) for name in ("expected", "measured", "error", "tolerance")}
        finite = {name: value if isfinite(value) else None for name, value in numbers.items()}
        return {"what": self.what, "unit": self.unit, **finite, "verdict": str(self.verdict)}


@dataclass(frozen=True)
class Chapter:
    """Lines of one subject.

    ``name`` is for commands. ``text`` is Markdown of its page: what was compared, with citations and DOIs, what agrees,
    and each disagreement explained or left open; it refers to ``figures``, by the NAME of their file, as
    ``![…](figures/validation-NAME.png)``. ``seconds`` is what it took.
    """

    name: str
    title: str
    lines: tuple[Line, ...]
    text: str = ""
    figures: Mapping[str, Figure] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def failures(self) -> list[Line]:
        """The lines that fail, or could not be measured."""
        return [line for line in self.lines if line.failed]

    def as_text(self) -> str:
        """A table, below the title."""
        width = max((len(line.what) for line in self.lines), default=0)
        rows = [f"{self.name}: {self.title}"]
        for line in self.lines:
            judged = (
                f"error {line.error:.1e} of {line.tolerance:.0e}"
                if isfinite(line.error) and line.tolerance < inf
                else ""
            )
            numbers = f"{_number(line.expected):>11} {_number(line.measured):>11} {line.unit:4} {judged}"
            rows.append(f"{line.verdict:7} {line.what:{width}} {numbers}".rstrip())
        return "\n".join(rows)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        lines = [line.as_dict() for line in self.lines]
        return {"name": self.name, "title": self.title, "seconds": self.seconds, "lines": lines}


def _number(value: float) -> str:
    return f"{value:.6g}" if isfinite(value) else "-"


def count(chapters: Iterable[Chapter], verdict: Verdict) -> int:
    """How many lines have a verdict."""
    return sum(line.verdict is verdict for chapter in chapters for line in chapter.lines)


def outcome(chapters: Sequence[Chapter]) -> str:
    """How many lines pass, in words."""
    passed, failed = count(chapters, Verdict.PASS), count(chapters, Verdict.FAIL)
    told = f"{failed} of {passed + failed} lines fail" if failed else f"all {passed} lines pass"
    for other, words in ((Verdict.ERROR, "could not be measured"), (Verdict.SKIPPED, "skipped")):
        told += f", {number} {words}" if (number := count(chapters, other)) else ""
    return told


def as_dict(chapters: Sequence[Chapter], **more: Any) -> dict[str, Any]:
    """Plain JSON types of all chapters, and of what is said beside them."""
    passed = not any(chapter.failures for chapter in chapters)
    return {**more, "passed": passed, "checks": [chapter.as_dict() for chapter in chapters]}
