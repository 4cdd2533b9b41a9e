"""The terminal: its width, and colours where they help.

Running text fills the width of the terminal, and 80 columns elsewhere. Colours are those of rich,
and there are none in pipes and files, with ``NO_COLOR``, or on a terminal without them;
``FORCE_COLOR`` asks for them anywhere.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable
from functools import lru_cache
from typing import TextIO

_USUAL_WIDTH = 80
"""Width of text that is not for a terminal, characters."""
_LEAST_WIDTH = 40
"""Smallest width to which text is fitted; narrower terminals break the lines."""
_ESCAPES = re.compile(r"\x1b\[[0-9;]*m")
"""Sequences that switch colours."""

HEADING = "bold"
"""Style of headings, and of the main number of a result."""
WARNING = "yellow"
"""Style of the word before a warning."""
ERROR = "bold red"
"""Style of the word before an error."""
ASIDE = "dim"
"""Style of sources and hints."""
_STATUSES = {
    "failed": "red",
    "FAIL": "red",
    "ERROR": "red",
    "interrupted": "yellow",
    "missing": "yellow",
    "running": "cyan",
    "finished": "green",
    "pass": "green",
}
"""Styles of statuses, the worst first."""


def text_width() -> int:
    """Width of running text: that of the terminal, or 80 in a pipe; ``COLUMNS`` overrides it."""
    if sys.stdout.isatty() or "COLUMNS" in os.environ:
        return max(_LEAST_WIDTH, shutil.get_terminal_size((_USUAL_WIDTH, 24)).columns)
    return _USUAL_WIDTH


def table_width() -> int | None:
    """Width to which tables are fitted; None in a pipe, where each row is one line.

    A program that reads the output finds all columns in a line. ``COLUMNS`` overrides it.
    """
    if sys.stdout.isatty() or "COLUMNS" in os.environ:
        return text_width()
    return None


def wrapped(text: str, indent: str = "", width: int | None = None) -> list[str]:
    """Wrap a text between words.

    Parameters
    ----------
    text
        The text; spaces at its start are kept.
    indent
        Start of its further lines.
    width
        Width of the lines; default: that of `text_width`.

    Returns
    -------
    list of str
        The lines. A word that is longer than a line, such as a path, has a line of its own.
    """
    return textwrap.wrap(
        text,
        width or text_width(),
        subsequent_indent=indent,
        break_on_hyphens=False,
        break_long_words=False,
    )


def fitted_lines(lines: Iterable[str]) -> str:
    """Lines that are wrapped on a terminal; in a pipe each remains one line."""
    width = table_width()
    fitted: list[str] = []
    for line in lines:
        fitted += [line] if width is None else wrapped(line, "    ", width)
    return "\n".join(fitted)


def wrapped_after(head: str, text: str, style: str, indent: str = "") -> list[str]:
    """Wrap a text after a head that has a style; ``indent`` begins the further lines."""
    first, *rest = wrapped(head + text, indent)
    return [styled(head, style) + first[len(head) :], *rest]


def message_text(text: str, stream: TextIO) -> str:
    """A message that fits the terminal; a single line elsewhere, in which programs find it."""
    if not stream.isatty():
        return text
    return "\n".join(wrapped(text, "    ", text_width()))


def visible_length(text: str) -> int:
    """Number of characters of a text that are seen, without colours."""
    return len(_ESCAPES.sub("", text))


def styled(text: str, style: str, stream: TextIO | None = None) -> str:
    """A text in a style, if the stream shows styles.

    Parameters
    ----------
    text
        The text.
    style
        A style of rich, such as ``bold red``.
    stream
        Where the text is printed; default: the standard output.
    """
    if not text or not _has_colours(stream or sys.stdout):
        return text
    return _in_style(text, style)


def styled_status(text: str) -> str:
    """A status, such as ``failed: BeadsLost``, or several, in the style of the worst."""
    words = re.findall(r"\w+", text)
    for status, style in _STATUSES.items():
        if status in words:
            return styled(text, style)
    return text


def _has_colours(stream: TextIO) -> bool:
    """Whether a stream is a terminal with colours, or colours are forced."""
    if not stream.isatty() and not os.environ.get("FORCE_COLOR"):
        return False  # without the import of rich, which takes time
    from rich.console import Console

    console = Console(file=stream)
    return console.color_system is not None and not console.no_color


@lru_cache
def _in_style(text: str, style: str) -> str:
    """A text between the sequences of a style."""
    from rich.color import ColorSystem
    from rich.style import Style

    return Style.parse(style).render(text, color_system=ColorSystem.STANDARD)
