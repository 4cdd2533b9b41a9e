"""Progress: a line that is written again in place on a terminal or in a notebook, a line now and then elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, TypeVar

from walkers.rounding import duration_text

if TYPE_CHECKING:
    from walkers.runner.launch import Progress
    from walkers.sweeps.scheduler import SweepProgress

T = TypeVar("T")
_BAR = 24
"""Letters of the bar."""
_FIRST_LINE_SECONDS = 1.0
_LONGEST_SILENCE_SECONDS = 60.0


@contextmanager
def progress_of(name: str) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows the progress of a run."""
    with _shown(name) as show:
        yield lambda run: show(run.step / run.steps if run.steps else 0.0, str(run), run.elapsed)


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
            show((sweep.done + sweep.failed) / max(sweep.points, 1), words, sweep.elapsed)

        yield advance


@contextmanager
def progress_of_film(name: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that shows the progress of a film."""
    begin = time.monotonic()
    with _shown(name) as show:
        yield lambda made, count: show(made / count, f"{made} of {count} frames", time.monotonic() - begin)


def shown_if(wanted: bool | None, progress: AbstractContextManager[T]) -> AbstractContextManager[T | None]:
    """The progress if it is wanted (None: only in notebooks); otherwise a context that yields None."""
    return progress if (_in_notebook() if wanted is None else wanted) else nullcontext()


def _in_notebook() -> bool:
    """Whether a Jupyter kernel runs this; IPython is not imported for it."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


@contextmanager
def _shown(name: str) -> Iterator[Callable[[float, str, float], None]]:
    """Yield a function that shows the completed share, a text and the elapsed seconds."""
    stream, due = sys.stdout if _in_notebook() else sys.stderr, _FIRST_LINE_SECONDS
    in_place, wide = _in_notebook() or stream.isatty(), shutil.get_terminal_size().columns - 1

    def show(share: float, words: str, elapsed: float) -> None:
        nonlocal due
        if in_place:
            bar = "━" * round(_BAR * share)
            print(f"\r{f'{name} {bar:─<{_BAR}} {words}'[:wide]:{wide}}", end="", file=stream, flush=True)
        elif elapsed >= due:  # lines become rarer with time
            due = elapsed + min(elapsed, _LONGEST_SILENCE_SECONDS)
            print(f"{name}: {words}", file=stream, flush=True)

    try:
        yield show
    finally:
        if in_place:
            print(f"\r{'':{wide}}", end="\r", file=stream, flush=True)
