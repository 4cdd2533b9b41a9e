"""Results of checks: chapters of lines with expected value, measured value and verdict.

``walkers check literature`` makes a page of chapters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from math import inf, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.errors import WalkersError, expected_of, refused
from walkers.postprocess.drawing import save_figure
from walkers.runner.files import write_text
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHAPTERS = ("benchmarks", "bridges", "crosscheck")
"""Chapters in the order of the page; each is the function ``chapter`` of a module of `walkers.check`."""
PAGE = "validation.md"


class Verdict(StrEnum):
    """Outcome of a line: ``ERROR`` if it could not be measured, ``NOT_JUDGED`` without a tolerance."""

    PASS = "pass"
    FAIL = "FAIL"
    ERROR = "ERROR"
    SKIPPED = "skipped"
    NOT_JUDGED = "-"


@dataclass(frozen=True)
class Line:
    """One line of a table.

    ``expected`` and ``measured`` are in ``unit`` (of two engines: the first and the second). ``tolerance`` is the
    largest error that passes, infinite without a judgement. Errors are relative to ``scale``; default: the expected
    number, or 1 if that is 0. ``given`` is a verdict that does not follow from the error.
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
        """A line without a measured value."""
        return cls(what, nan, nan, given=verdict)

    @property
    def error(self) -> float:
        """The error that is judged."""
        return abs(self.measured - self.expected) / (self.scale or abs(self.expected) or 1.0)

    @property
    def verdict(self) -> Verdict:
        """Pass or fail by the tolerance; an error that is no number fails."""
        if self.given or self.tolerance == inf:
            return self.given or Verdict.NOT_JUDGED
        return Verdict.PASS if self.error <= self.tolerance else Verdict.FAIL

    @property
    def failed(self) -> bool:
        """Whether the line fails or could not be measured."""
        return self.verdict in (Verdict.FAIL, Verdict.ERROR)

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types; numbers that are none become null."""
        numbers = {name: getattr(self, name) for name in ("expected", "measured", "error", "tolerance")}
        finite = {name: value if isfinite(value) else None for name, value in numbers.items()}
        return {"what": self.what, "unit": self.unit, **finite, "verdict": str(self.verdict)}


@dataclass(frozen=True)
class Chapter:
    """Lines of one subject, with its ``name`` in commands, and the ``seconds`` that it took.

    ``text`` is Markdown for the page: what was compared, with citations, what agrees, and an explanation of each
    disagreement; it refers to ``figures`` by their names, as ``![…](figures/validation-NAME.png)``.
    """

    name: str
    title: str
    lines: tuple[Line, ...]
    text: str = ""
    figures: Mapping[str, Figure] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def failures(self) -> list[Line]:
        """Lines that fail or could not be measured."""
        return [line for line in self.lines if line.failed]

    def as_text(self) -> str:
        """A table, below the title."""
        width = max((len(line.what) for line in self.lines), default=0)
        rows = [f"{self.name}: {self.title}"]
        for line in self.lines:
            judged = f"error {line.error:.1e} of {line.tolerance:.0e}" if isfinite(line.error + line.tolerance) else ""
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
    """Number of lines with a verdict."""
    return sum(line.verdict is verdict for chapter in chapters for line in chapter.lines)


def outcome(chapters: Sequence[Chapter]) -> str:
    """Number of lines that pass, as text."""
    passed, failed = count(chapters, Verdict.PASS), count(chapters, Verdict.FAIL)
    sentence = f"{failed} of {passed + failed} lines fail" if failed else f"all {passed} lines pass"
    for other, words in ((Verdict.ERROR, "could not be measured"), (Verdict.SKIPPED, "skipped")):
        sentence += f", {number} {words}" if (number := count(chapters, other)) else ""
    return sentence


def as_dict(chapters: Sequence[Chapter], **more: Any) -> dict[str, Any]:
    """Plain JSON types of all chapters and of further values."""
    passed = not any(chapter.failures for chapter in chapters)
    return {**more, "passed": passed, "checks": [chapter.as_dict() for chapter in chapters]}


# --- the page ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Validation:
    """Chapters in the order of the page, and written files."""

    chapters: tuple[Chapter, ...]
    files: tuple[Path, ...]

    @property
    def failed(self) -> list[str]:
        """Lines that fail, with the name of their chapter."""
        return [f"{chapter.name}: {line.what}" for chapter in self.chapters for line in chapter.failures]


def validate(
    out: Path,
    to: Path,
    *,
    only: Sequence[str] = (),
    quick: bool = False,
    jobs: int = 1,
    on_done: Callable[[Chapter], None] | None = None,
) -> Validation:
    """Compute the chapters with a number of parallel ``jobs``, and write the page and its pictures.

    Parameters
    ----------
    out, to
        Folders of the run directories and of the page; pictures go into ``figures`` in it.
    only
        Names of `CHAPTERS`, which are then in the name of the page; if empty, all. `InputError` for other names.
    quick
        Compute only the part of each chapter that takes seconds.
    on_done
        Called with each finished chapter.
    """
    from joblib import Parallel, delayed

    for name in only:
        if name not in CHAPTERS:
            raise refused("walkers check literature", f"no chapter {name!r}; {expected_of(name, CHAPTERS)}")
    names = tuple(name for name in CHAPTERS if name in only or not only)
    made: dict[str, Chapter] = {}
    works = Parallel(jobs, return_as="generator_unordered")
    for chapter in works(delayed(_chapter)(name, out, quick) for name in names):
        made[chapter.name] = chapter
        if on_done:
            on_done(chapter)
    chapters = tuple(made[name] for name in names)
    # A page with some of the chapters, or with quick ones, does not replace the full page.
    some = [*(["quick"] if quick else []), *(names if names != CHAPTERS else [])]
    page = f"validation-{'-'.join(some)}.md" if some else PAGE
    files: list[Path] = [to / page]
    for chapter in chapters:
        for name, figure in chapter.figures.items():
            files += save_figure(figure, to / "figures" / f"validation-{name}.png", (), title=chapter.title)
    to.mkdir(parents=True, exist_ok=True)
    write_text(to / page, rendered("walkers.check", "validation.md.j2", chapters=chapters))
    return Validation(chapters, tuple(files))


def _chapter(name: str, out: Path, quick: bool) -> Chapter:
    """A chapter, or the error that prevented it: the other chapters are computed anyway."""
    try:
        chapter: Chapter = import_module(f"walkers.check.{name}").chapter(out, quick=quick)
    except WalkersError as error:
        return Chapter(name, name, (Line.without_number(f"could not be computed: {error}", Verdict.ERROR),))
    return chapter
