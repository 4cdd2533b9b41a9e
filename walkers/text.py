"""Text from templates, such as decks and reports, and text in columns.

How numbers are rounded for people is in `walkers.rounding`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def rendered(package: str, template: str, values: Mapping[str, Any]) -> str:
    """The text of a template of a package.

    Parameters
    ----------
    package
        Name of the package that contains the template.
    template
        Path of the template within the package.
    values
        Values by the names that the template uses.

    Returns
    -------
    str
        The text.

    Raises
    ------
    jinja2.UndefinedError
        If the template uses a name that has no value.

    Notes
    -----
    Templates may use the filters of Jinja and these: ``number``, the shortest text that reads back
    as the same double, and ``numbers`` of several; ``format`` as Python's for numbers, with a dash
    for missing ones; ``plain`` for a user's text in Markdown; ``any`` and ``zip`` as in Python.
    """
    return environment(package).get_template(template).render(values)


def printable(text: str) -> str:
    r"""A user's text on one line: white space is a space, and invisible characters are written out.

    Examples
    --------
    >>> printable("one\ntwo \x1b[31m")
    'one two \\x1b[31m'
    """
    one_line = " ".join(text.split())
    return "".join([_printable_letter(letter) for letter in one_line])


def _printable_letter(letter: str) -> str:
    r"""A letter, or the escape sequence of an invisible one, such as ``\x1b``."""
    return letter if letter.isprintable() else repr(letter)[1:-1]


def aligned(rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> str:
    """Rows of cells as text with aligned columns.

    Parameters
    ----------
    rows
        Texts of the cells; all rows have the same number.
    right
        Indices of the columns that are aligned at their right ends.

    Examples
    --------
    >>> print(aligned([("beads", "2"), ("walls", "10")], right=[1]))
    beads   2
    walls  10
    """
    longest_cells = [max(column, key=len) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = []
        for number, (cell, longest) in enumerate(zip(row, longest_cells, strict=True)):
            width = len(longest)
            if number in right:
                cells.append(cell.rjust(width))
            else:
                cells.append(cell.ljust(width))
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def aligned_rows(rows: Sequence[Mapping[str, str]], right: Collection[int] = ()) -> str:
    """Texts by the heads of their columns as an `aligned` table, with a line of heads."""
    lines = [list(rows[0])]
    for row in rows:
        lines.append(list(row.values()))
    return aligned(lines, right)


def with_unit(words: str, unit: str | None) -> str:
    """A label with its unit in parentheses, if there is one."""
    return f"{words} ({unit})" if unit else words


def number_text(value: float) -> str:
    """A number as the shortest text that reads back as the same double."""
    return repr(float(value))


def numbers_text(values: Iterable[float]) -> str:
    """Numbers as by `number_text`, with spaces between them."""
    return " ".join([number_text(value) for value in values])


# --- filters of templates -------------------------------------------------------------------------


def _formatted(value: float | None, form: str, missing: str = "-") -> str:
    """A number in a format of Python; ``missing`` for None, NaN and infinity."""
    if value is None or not isfinite(value):
        return missing
    return f"{value:{form}}"


def _plain(text: str) -> str:
    """A user's text on one line of Markdown, whose symbols it escapes."""
    return re.sub(r"[\\`*_<>|&\[\]]", r"\\\g<0>", printable(text))


_FILTERS: Mapping[str, Callable[..., Any]] = {
    "number": number_text,
    "numbers": numbers_text,
    "format": _formatted,
    "plain": _plain,
    "any": any,
    "zip": zip,
}
"""Filters of templates, see `rendered`."""


@cache
def environment(*packages: str, html: bool = False) -> Environment:
    """The environment of Jinja that renders templates of packages.

    Parameters
    ----------
    *packages
        Packages in which templates are searched, the first one first.
    html
        Whether the templates are of HTML, in which values are escaped.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    jinja = Environment(
        loader=ChoiceLoader([PackageLoader(package, ".") for package in packages]),
        undefined=StrictUndefined,
        autoescape=html,
        keep_trailing_newline=not html,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    jinja.filters.update(_FILTERS)
    return jinja
