"""Progress on the terminal: a bar where there is one, plain lines where there is not; both on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from walkers.inputs.case import WalkerCase
    from walkers.inputs.pile import PileCase
    from walkers.inputs.reading import AnyCase
    from walkers.runner.launch import Progress
    from walkers.runner.segments import PileProgress
    from walkers.sweeps.scheduler import Progress as SweepProgress

_FIRST_LINE_SECONDS = 1.0
_LONGEST_SILENCE_SECONDS = 60.0


@contextmanager
def progress_of(case: AnyCase) -> Iterator[Callable[[Any], None]]:
    """Yield a function that shows how far a run of a case is."""
    from walkers.inputs.pile import PileCase

    if isinstance(case, PileCase):
        with _progress_of_pile(case) as advance:
            yield advance
    elif sys.stderr.isatty():
        with _bar(case) as advance:
            yield advance
    else:
        yield _lines(case)


@contextmanager
def _bar(case: WalkerCase) -> Iterator[Callable[[Progress], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[simulated]:.3f} s simulated, {task.fields[rate]:.0f} steps/s"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(case.name, total=case.run.steps, simulated=0.0, rate=0.0)

        def advance(progress: Progress) -> None:
            bar.update(task, completed=progress.step, simulated=progress.simulated, rate=_rate(progress))

        yield advance


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


def _lines(case: WalkerCase) -> Callable[[Progress], None]:
    is_due = _rarely()

    def advance(progress: Progress) -> None:
        if not is_due(progress.elapsed):
            return
        rate = _rate(progress)
        left = f"{(progress.steps - progress.step) / rate:.0f} s left" if rate else "starting"
        print(
            f"{case.name}: {100 * progress.step / progress.steps:.0f} %, {progress.simulated:.3f} s simulated, "
            f"{rate:.0f} steps/s, {left}",
            file=sys.stderr,
            flush=True,
        )

    return advance


@contextmanager
def _progress_of_pile(case: PileCase) -> Iterator[Callable[[PileProgress], None]]:
    if sys.stderr.isatty():
        with _told_bar(case.name) as show:
            yield lambda progress: show(1.0, progress.share, _told_of_pile(progress))
        return
    is_due = _rarely()

    def advance(progress: PileProgress) -> None:
        if is_due(progress.elapsed):
            print(f"{case.name}: {_told_of_pile(progress)}", file=sys.stderr, flush=True)

    yield advance


def _told_of_pile(progress: PileProgress) -> str:
    doing = f"{100 * progress.share:.0f} % of the drive" if progress.driven else "settling"
    return f"{doing}, {progress.simulated:.2f} s simulated"


@contextmanager
def progress_of_sweep(name: str) -> Iterator[Callable[[SweepProgress], None]]:
    """Yield a function that shows how far a sweep is."""
    if sys.stderr.isatty():
        with _sweep_bar(name) as advance:
            yield advance
    else:
        yield _sweep_lines(name)


@contextmanager
def _sweep_bar(name: str) -> Iterator[Callable[[SweepProgress], None]]:
    with _told_bar(name) as show:
        yield lambda progress: show(progress.points, progress.done + progress.failed, _told(progress))


@contextmanager
def _told_bar(name: str) -> Iterator[Callable[[float, float, str], None]]:
    """Yield a function that shows a bar, given its whole, how much of it is done, and words beside it."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[told]}"))
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=None, told="")
        yield lambda whole, done, told: bar.update(task, total=whole, completed=done, told=told)


def _sweep_lines(name: str) -> Callable[[SweepProgress], None]:
    is_due = _rarely()

    def advance(progress: SweepProgress) -> None:
        if is_due(progress.elapsed):
            print(f"{name}: {_told(progress)}", file=sys.stderr, flush=True)

    return advance


def _told(progress: SweepProgress) -> str:
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


def _rate(progress: Progress) -> float:
    return progress.step / progress.elapsed if progress.elapsed else 0.0
