"""Progress of what takes long, shown to the user.

On a terminal or in a notebook it is a bar of rich, elsewhere a line now and then.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple, TextIO

from walkers.rounding import duration_text

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar

_MOST_BAR_LETTERS = 24
"""Largest length of the bar; it is shorter where the text needs the width."""
_FEWEST_BAR_LETTERS = 4
"""Smallest length of the bar, on narrow terminals."""
_MOST_NAME_LETTERS = 16
"""Letters of a name that are shown in any case."""
_FIRST_LINE_SECONDS = 1.0
"""Time before the first line, where there is no bar: shorter work is not worth one."""
_LONGEST_SILENCE_SECONDS = 60.0
"""Time after the last line after which a new one is due."""
_SHORTEST_SILENCE_SECONDS = 5.0
"""Shortest time between lines, of which one is due at each tenth of the work."""


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
    elif notebook:
        yield _shown_in_notebook(name)
    elif _shows_bars(sys.stderr):
        from rich.console import Console

        bar = _new_bar(name, Console(file=sys.stderr))
        with bar:  # what is printed on the standard error meanwhile stands above the bar
            yield _shown_in(bar, name)
    else:
        lines = _Lines(name, sys.stderr)
        yield lines.tell
        lines.end()


def _shows_bars(stream: TextIO) -> bool:
    """Whether a stream is a terminal on which a line can be written over."""
    if not stream.isatty():
        return False  # without the import of rich, which takes time
    from rich.console import Console

    return not Console(file=stream).is_dumb_terminal


def _new_bar(name: str, console: Console | None = None) -> Bar:
    """A bar on a console, with a name before and a text after it; it goes when it is stopped."""
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar
    from rich.table import Column

    of_name = Column(no_wrap=True, min_width=min(len(name), _MOST_NAME_LETTERS))
    of_bar = Column(min_width=_FEWEST_BAR_LETTERS, max_width=_MOST_BAR_LETTERS)
    of_text = Column(no_wrap=True)  # it is cut where the terminal is narrow
    return Bar(
        TextColumn("{task.description}", table_column=of_name, markup=False),
        BarColumn(bar_width=None, table_column=of_bar),
        TextColumn("{task.fields[text]}", table_column=of_text, markup=False),
        console=console,
        auto_refresh=False,
        transient=True,
        redirect_stdout=False,
    )


def _shown_in(bar: Bar, name: str) -> Tell:
    """A function that shows progress in a bar, with the name before it."""
    task = bar.add_task(name, total=1.0, text="")

    def tell(progress: Progress) -> None:
        bar.update(task, completed=progress.share, text=progress.text, refresh=True)

    return tell


def _shown_in_notebook(name: str) -> Tell:
    """A function that shows progress in a bar below the cell; the last state of the bar stays.

    It is an output that is replaced: the live display of rich needs the widgets of notebooks.
    """
    display = import_module("IPython.display").display
    bar = _new_bar(name)
    tell_bar = _shown_in(bar, name)
    handle = display(bar, display_id=True)

    def tell(progress: Progress) -> None:
        tell_bar(progress)
        handle.update(bar)

    return tell


class _Lines:
    """Lines with the progress: one at the start, some on the way, and one at the end.

    On the way, a line that says something new is due after a minute, and at each tenth of the work.

    Parameters
    ----------
    name
        Name of what is made, with which each line begins.
    stream
        Where the lines are written.
    """

    def __init__(self, name: str, stream: TextIO) -> None:
        self._name = name
        self._stream = stream
        self._start = time.monotonic()
        self._written: float | None = None
        self._text = ""
        self._tenth = 0

    def tell(self, progress: Progress) -> None:
        """Write a line if one is due."""
        now = time.monotonic()
        tenth = int(10.0 * progress.share)
        if self._written is None:
            due = now - self._start >= _FIRST_LINE_SECONDS
        else:
            silence = now - self._written
            is_later = tenth > self._tenth and silence >= _SHORTEST_SILENCE_SECONDS
            due = is_later or silence >= _LONGEST_SILENCE_SECONDS
        if due and progress.text != self._text:
            self._write(progress.text)
            self._written = now
            self._tenth = tenth

    def end(self) -> None:
        """Write how long it took, if there was a line before."""
        if self._written is not None:
            self._write(f"done in {duration_text(time.monotonic() - self._start)}")

    def _write(self, text: str) -> None:
        self._text = text
        print(f"{self._name}: {text}", file=self._stream, flush=True)
