"""Progress: a bar on a terminal or in a notebook, plain lines elsewhere, on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, TypeVar

from walkers.notebook import in_notebook, progress_bar

if TYPE_CHECKING:
    from walkers.runner.launch import Progress
    from walkers.sweeps.scheduler import SweepProgress

T = TypeVar("T")
_FIRST_LINE_SECONDS = 1.0
_LONGEST_SILENCE_SECONDS = 60.0


@contextmanager
def progress_of(name: str) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows how far the run of a case is."""
    with _shown(name) as show:
        yield lambda progress: show(progress.steps, progress.step, _words_of_run(progress), progress.elapsed)


@contextmanager
def progress_of_sweep(name: str) -> Iterator[Callable[[SweepProgress], None]]:
    """Yield a function that shows how far a sweep is."""
    with _shown(name) as show:
        yield lambda progress: show(
            progress.points, progress.done + progress.failed, _words_of_sweep(progress), progress.elapsed
        )


def shown_if(wanted: bool | None, progress: AbstractContextManager[T]) -> AbstractContextManager[T | None]:
    """A progress if it is wanted, or if nobody says and this is a notebook; else what gives None."""
    return progress if (in_notebook() if wanted is None else wanted) else nullcontext()


@contextmanager
def progress_of_film(name: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that shows how many pictures of a film are made, of how many."""
    begin = time.monotonic()
    with _shown(name) as show:
        yield lambda made, count: show(count, made, f"{made} of {count} pictures", time.monotonic() - begin)


@contextmanager
def _shown(name: str) -> Iterator[Callable[[float, float, str, float], None]]:
    """Yield a function that shows the whole, how much of it is done, words, given the seconds that have passed."""
    if in_notebook():
        with progress_bar(name) as show:
            yield show
        return
    if not sys.stderr.isatty():
        is_due = _rarely()

        def line(whole: float, done: float, words: str, elapsed: float) -> None:
            del whole, done
            if is_due(elapsed):
                print(f"{name}: {words}", file=sys.stderr, flush=True)

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[words]}"))
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None, words="")
        yield lambda whole, done, words, _: bar.update(task, total=whole, completed=done, words=words)


def _rarely() -> Callable[[float], bool]:
    """Whether a line is due after so many seconds: they grow rarer with time, down to one a minute."""
    due = _FIRST_LINE_SECONDS

    def is_due(elapsed: float) -> bool:
        nonlocal due
        if elapsed < due:
            return False
        due = elapsed + min(elapsed, _LONGEST_SILENCE_SECONDS)
        return True

    return is_due


def _words_of_run(progress: Progress) -> str:
    """How far a run is, on a line."""
    rate = progress.made / progress.elapsed if progress.elapsed else 0.0
    doing = "coming to rest" if progress.resting else f"{100 * progress.step / progress.steps:.0f} %"
    left = f"{(progress.steps - progress.step) / rate:.0f} s left" if rate else "starting"
    return f"{doing}, {progress.simulated:.3f} s simulated, {rate:.0f} steps/s, {left}"


def _words_of_sweep(progress: SweepProgress) -> str:
    """How far a sweep is, on a line."""
    rate = (progress.done - progress.found) / progress.elapsed if progress.elapsed else 0.0
    segments = [
        f"{progress.done} of {progress.points} points done",
        f"{progress.running} running",
        f"{progress.failed} failed",
        f"{rate:.2g} points/s",
    ]
    if progress.left is not None:
        segments.append(f"{progress.left:.0f} s left")
    if progress.worst_failure is not None:
        segments.append(f"worst failure: point {progress.worst_failure.point}, {progress.worst_failure.reason}")
    return ", ".join(segments)
