"""Progress of what takes long, shown to the user.

On a terminal or in a notebook it is a line that is written again in place, elsewhere a line now and
then.
"""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TextIO

_BAR_LETTERS = 24
"""Largest length of the bar."""
_FEWEST_BAR_LETTERS = 4
"""Smallest length of the bar, on narrow terminals."""
_FIRST_LINE_SECONDS = 1.0
"""Time before the first line, where lines are not written in place."""
_LONGEST_SILENCE_SECONDS = 60.0
"""Longest time between such lines."""


class Progress(NamedTuple):
    """Progress of a run, a sweep or a film.

    Attributes
    ----------
    share
        The completed share, from 0 to 1.
    text
        What is done.
    stage
        The same in one or two words, of a run: its share in per cent, ``starting`` or
        ``coming to rest``.
    """

    share: float
    text: str
    stage: str = ""


Tell = Callable[[Progress], None]
"""A function that is called with the progress a few times per second.

Its exceptions stop what makes the progress.
"""


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


@contextmanager
def progress_of(name: str, shown: bool | None = True) -> Iterator[Tell | None]:
    """Show the progress of a ``with`` block.

    Parameters
    ----------
    name
        Name of what is made, which the line begins with.
    shown
        Whether to show the progress; None: in notebooks only.

    Yields
    ------
    function or None
        Shows a `Progress`; None if the progress is not shown.
    """
    notebook = in_notebook()
    if shown is None:
        shown = notebook
    if not shown:
        yield None
        return
    stream = sys.stdout if notebook else sys.stderr
    if not notebook and not stream.isatty():
        yield _show_line_by_line(name, stream)
        return
    width = shutil.get_terminal_size().columns - 1
    try:
        yield _show_in_place(name, stream, width)
    finally:
        print(f"\r{'':{width}}", end="\r", file=stream, flush=True)


def _show_in_place(name: str, stream: TextIO, width: int) -> Tell:
    """A function that writes the progress over the line before, in a line of ``width`` letters.

    The bar is as long as the text allows.
    """

    def show(progress: Progress) -> None:
        space = width - len(name) - len(progress.text) - 2
        letters = min(_BAR_LETTERS, max(_FEWEST_BAR_LETTERS, space))
        bar = "━" * round(letters * progress.share)
        line = f"{name} {bar:─<{letters}} {progress.text}"
        print(f"\r{line[:width]:{width}}", end="", file=stream, flush=True)

    return show


def _show_line_by_line(name: str, stream: TextIO) -> Tell:
    """A function that writes a line now and then; lines become rarer with time."""
    begin = time.monotonic()
    due = _FIRST_LINE_SECONDS

    def show(progress: Progress) -> None:
        nonlocal due
        elapsed = time.monotonic() - begin
        if elapsed >= due:
            due = elapsed + min(elapsed, _LONGEST_SILENCE_SECONDS)
            print(f"{name}: {progress.text}", file=stream, flush=True)

    return show
