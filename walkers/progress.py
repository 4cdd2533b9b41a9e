"""Progress: a bar on a terminal or in a notebook, plain lines elsewhere, on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from html import escape
from typing import TYPE_CHECKING, Any, TypeVar

from walkers.rounding import duration_text

if TYPE_CHECKING:
    from walkers.runner.launch import Progress
    from walkers.sweeps.scheduler import SweepProgress

T = TypeVar("T")
_Show = Callable[[float, float, str, float], None]
"""Shows the total, the completed part, a text and the elapsed seconds."""
_FIRST_LINE_SECONDS = 1.0
_LONGEST_SILENCE_SECONDS = 60.0


@contextmanager
def progress_of(name: str) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows the progress of a run."""
    with _shown(name) as show:

        def advance(run: Progress) -> None:
            show(run.steps, run.step, str(run), run.elapsed)

        yield advance


@contextmanager
def progress_of_sweep(name: str) -> Iterator[Callable[[SweepProgress], None]]:
    """Yield a function that shows the progress of a sweep."""
    with _shown(name) as show:

        def advance(sweep: SweepProgress) -> None:
            made = sweep.done - sweep.found
            decks = f" in {sweep.decks} decks" if 1 < sweep.decks < sweep.running else ""
            words = f"{sweep.done} of {sweep.points} points done, {sweep.running} running{decks}, {sweep.failed} failed"
            if made and (each := sweep.elapsed / made) < 10.0:
                words += f", {60.0 / each:.0f} points per minute"
            elif made:
                words += f", {duration_text(each)} per point"
            words += f", {duration_text(sweep.left)} left" if sweep.left is not None else ""
            show(sweep.points, sweep.done + sweep.failed, words, sweep.elapsed)

        yield advance


@contextmanager
def progress_of_film(name: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that shows the progress of a film."""
    begin = time.monotonic()
    with _shown(name) as show:
        yield lambda made, count: show(count, made, f"{made} of {count} frames", time.monotonic() - begin)


def shown_if(wanted: bool | None, progress: AbstractContextManager[T]) -> AbstractContextManager[T | None]:
    """The progress if it is wanted (None: only in notebooks); otherwise a context that yields None."""
    return progress if (_in_notebook() if wanted is None else wanted) else nullcontext()


def _in_notebook() -> bool:
    """Whether a Jupyter kernel runs this; IPython is not imported for it."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


@contextmanager
def _shown(name: str) -> Iterator[_Show]:
    if _in_notebook():
        with _notebook_bar(name) as show:
            yield show
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as Bar

        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[words]}"))
        with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task(name, total=None, words="")
            yield lambda whole, done, words, _: bar.update(task, total=whole, completed=done, words=words)
    else:
        due = _FIRST_LINE_SECONDS

        def line(_whole: float, _done: float, words: str, elapsed: float) -> None:
            nonlocal due
            if elapsed >= due:  # lines become rarer with time
                due = elapsed + min(elapsed, _LONGEST_SILENCE_SECONDS)
                print(f"{name}: {words}", file=sys.stderr, flush=True)

        yield line


@contextmanager
def _notebook_bar(name: str) -> Iterator[_Show]:
    """A bar that is updated in place. A stored notebook keeps its last line; of rich's widget it keeps an empty box."""
    import IPython.display

    shown: Any = IPython.display  # its types lack these functions
    handle = shown.display(shown.HTML(""), display_id=True)
    told = "stopped"

    def show(whole: float, done: float, words: str, _elapsed: float) -> None:
        bar = f'<progress max="{whole:g}" value="{done:g}"></progress>'
        handle.update(shown.HTML(f"{escape(name)} {bar} {escape(words)}"))

    try:
        yield show
        told = "done"
    finally:
        handle.update(shown.HTML(f"{escape(name)}: {told}"))
