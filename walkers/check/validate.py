"""``walkers validate``: all chapters of docs/explanation/validation.md, to the files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from walkers.check.report import Chapter, Line, Verdict
from walkers.inputs.errors import WalkersError, refused
from walkers.inputs.library import expected_of
from walkers.inputs.text import rendered
from walkers.postprocess.drawing import save_figure
from walkers.runner.files import write_text

CHAPTERS = ("benchmarks", "bridges", "crosscheck")
"""In the order of the page; each the function ``chapter`` of a module of `walkers.check`."""
PAGE = "validation.md"


@dataclass(frozen=True)
class Validation:
    """The chapters that were made, in the order of the page, and the files."""

    chapters: tuple[Chapter, ...]
    files: tuple[Path, ...]

    @property
    def failed(self) -> list[str]:
        """What was expected to hold and does not, with the chapter's name before it."""
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
    """Make chapters, so many ``jobs`` at once, and write the page and its pictures.

    Parameters
    ----------
    out, to
        Folders of the run directories and of the page; pictures go into ``figures`` in it.
    only
        Names of `CHAPTERS`; if empty, all. A page of some has their names in its own.
    quick
        The part of each that takes seconds; of chapters that take no longer, all.
    on_done
        Called with each chapter as it is done.

    Raises
    ------
    InputError
        If there is no such chapter.
    """
    from joblib import Parallel, delayed

    for name in only:
        if name not in CHAPTERS:
            raise refused("walkers validate", f"no chapter {name!r}; {expected_of(name, CHAPTERS)}")
    names = tuple(name for name in CHAPTERS if name in only or not only)
    made: dict[str, Chapter] = {}
    works = Parallel(jobs, return_as="generator_unordered")
    for chapter in works(delayed(_chapter)(name, out, quick) for name in names):
        made[chapter.name] = chapter
        if on_done:
            on_done(chapter)
    chapters = tuple(made[name] for name in names)
    # A page of some chapters, or of quick ones, is not to take the place of one that has all.
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
    """A chapter, or what kept it from being made: the others are made all the same."""
    try:
        chapter: Chapter = import_module(f"walkers.check.{name}").chapter(out, quick=quick)
    except WalkersError as error:
        return Chapter(name, name, (Line.without_number(f"could not be made: {error}", Verdict.ERROR),))
    return chapter
