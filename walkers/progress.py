"""Progress: a line that is written again in place on a terminal or in a notebook, a line now and then elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

_BAR = 24  # letters of the bar
_FIRST_LINE_SECONDS = 1.0
_LONGEST_SILENCE_SECONDS = 60.0


class Progress(NamedTuple):
    """Progress of a run, a sweep or a film.

    Attributes
    ----------
    share
        The completed share, from 0 to 1.
    text
        What is done.
    stage
        The same in one or two words, of a run: its share in per cent, ``starting`` or ``coming to rest``.
    """

    share: float
    text: str
    stage: str = ""


Tell = Callable[[Progress], None]
"""A function that is called a few times per second; its exceptions stop what is made."""


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


@contextmanager
def progress_of(name: str, shown: bool | None = True) -> Iterator[Tell | None]:
    """Yield a function that shows the progress, or None if it is not wanted (None: it is wanted in notebooks only)."""
    notebook = in_notebook()
    if not (notebook if shown is None else shown):
        yield None
        return
    stream, begin, due = (
        sys.stdout if notebook else sys.stderr,
        time.monotonic(),
        _FIRST_LINE_SECONDS,
    )
    in_place, wide = notebook or stream.isatty(), shutil.get_terminal_size().columns - 1

    def show(progress: Progress) -> None:
        nonlocal due
        elapsed = time.monotonic() - begin
        if in_place:
            bar = "━" * round(_BAR * progress.share)
            print(
                f"\r{f'{name} {bar:─<{_BAR}} {progress.text}'[:wide]:{wide}}",
                end="",
                file=stream,
                flush=True,
            )
        elif elapsed >= due:  # lines become rarer with time
            due = elapsed + min(elapsed, _LONGEST_SILENCE_SECONDS)
            print(f"{name}: {progress.text}", file=stream, flush=True)

    try:
        yield show
    finally:
        if in_place:
            print(f"\r{'':{wide}}", end="\r", file=stream, flush=True)
