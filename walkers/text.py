"""Text from templates, such as decks and reports, and text in columns.

How numbers are rounded for people is in `walkers.rounding`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any

from walkers.terminal import HEADING, styled, styled_status, visible_length, wrapped

if TYPE_CHECKING:
    from jinja2 import Environment


_ITEM_INDENT = " " * 4
"""Start of the lines of `wrapped_items`."""
_LEAST_TEXT_WIDTH = 24
"""Smallest width of a column of running text, characters."""
_UNBROKEN = "\u2060"
"""Stands for a space at which lines are not broken; no text contains this invisible letter."""


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
    widths = _widths(rows)
    lines = []
    for row in rows:
        cells = []
        for number, (cell, width) in enumerate(zip(row, widths, strict=True)):
            space = " " * (width - visible_length(cell))
            cells.append(space + cell if number in right else cell + space)
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def _widths(rows: Sequence[Sequence[str]]) -> list[int]:
    """Widths of the columns of a table, characters."""
    return [max(map(visible_length, column)) for column in zip(*rows, strict=True)]


def fitted_table(
    rows: Sequence[Sequence[str]],
    first: int,
    width: int | None = None,
    *,
    styled_column: int | None = None,
) -> str:
    """Rows of cells as an `aligned` table that fits a width.

    Parameters
    ----------
    rows
        Texts of the cells, the heads of the columns first.
    first
        Number of columns that stand in a line if the whole table is too wide. The cells of the
        others then stand in indented lines below, each with the head of its column. Only the first
        column stands in a line if these columns are too wide, too.
    width
        Width, characters; None: any.
    styled_column
        Index of a column of statuses, which have colours on a terminal.
    """
    heads, *body = [list(row) for row in rows]
    if styled_column is not None:
        for row in body:
            row[styled_column] = styled_status(row[styled_column])
    styled_heads = [styled(head, HEADING) for head in heads]
    table = [styled_heads, *body]
    if width is None or sum(_widths(table)) + 2 * (len(heads) - 1) <= width:
        return aligned(table)
    if sum(_widths([row[:first] for row in table])) + 2 * (first - 1) > width:
        first = 1
    first_line, *first_lines = aligned([row[:first] for row in table]).split("\n")
    lines = [first_line]
    for line, row in zip(first_lines, body, strict=True):
        lines.append(line)
        named = []
        for head, cell in zip(heads[first:], row[first:], strict=True):
            if cell:
                named.append(f"{head} {cell}")
        lines += wrapped_items(named, width)
    return "\n".join(lines)


def aligned_with_text(rows: Sequence[Sequence[str]], width: int | None = None) -> str:
    """Rows of cells as an `aligned` table whose last column is running text.

    Parameters
    ----------
    rows
        Texts of the cells.
    width
        Width to which the last column is wrapped, characters; None: any. If little of it is left,
        the texts stand in indented lines below the other cells; a table whose other cells are wider
        is split (`aligned_blocks`).
    """
    first_lines = aligned([row[:-1] for row in rows]).split("\n")
    if width is None:
        return aligned(rows)
    margin = max(map(visible_length, first_lines)) + 2
    if margin - 2 > width:
        return aligned_blocks(rows, width)
    is_below = width - margin < _LEAST_TEXT_WIDTH
    lines = []
    for line, row in zip(first_lines, rows, strict=True):
        text = row[-1]
        if is_below:
            lines.append(line)
            lines += wrapped(_ITEM_INDENT + text, _ITEM_INDENT, width) if text else []
        elif text:
            space = " " * (margin - visible_length(line))
            first, *rest = wrapped(text, width=width - margin)
            lines.append(line + space + first)
            lines += [" " * margin + part for part in rest]
        else:
            lines.append(line)
    return "\n".join(lines)


def aligned_blocks(
    rows: Sequence[Sequence[str]],
    width: int | None = None,
    *,
    repeated: int = 1,
    right: Collection[int] = (),
) -> str:
    """Rows of cells as `aligned` tables below each other, each of which fits a width.

    Parameters
    ----------
    rows
        Texts of the cells, the heads of the columns first.
    width
        Width, characters; None: any, so that there is a single table.
    repeated
        Number of columns with which each table begins; one if they take more than half the width.
    right
        Indices of the columns that are aligned at their right ends.
    """
    widths = _widths(rows)
    limit = sum(widths) + 2 * len(widths) if width is None else width
    if sum(widths[:repeated]) + 2 * repeated > limit // 2:
        repeated = 1
    blocks = []
    columns = list(range(repeated))
    space_of_repeated = sum(widths[:repeated]) + 2 * repeated
    space = space_of_repeated
    for column in range(repeated, len(widths)):
        if not widths[column]:
            continue  # an empty column
        if space + widths[column] > limit and len(columns) > repeated:
            blocks.append(columns)
            columns = list(range(repeated))
            space = space_of_repeated
        columns.append(column)
        space += widths[column] + 2
    blocks.append(columns)
    tables = []
    for block in blocks:
        tables.append(_aligned_columns(rows, block, right))
    return "\n\n".join(tables)


def _aligned_columns(
    rows: Sequence[Sequence[str]], columns: Sequence[int], right: Collection[int]
) -> str:
    """Some columns of a table, as by `aligned`; ``right`` are indices of the whole table."""
    cells = []
    for row in rows:
        cells.append([row[column] for column in columns])
    at_right = [place for place, column in enumerate(columns) if column in right]
    return aligned(cells, at_right)


def wrapped_items(items: Sequence[str], width: int) -> list[str]:
    """Indented lines of items with commas between them, broken between items alone."""
    unbroken = [item.replace(" ", _UNBROKEN) for item in items]
    lines = wrapped(_ITEM_INDENT + ", ".join(unbroken), _ITEM_INDENT, width)
    return [line.replace(_UNBROKEN, " ") for line in lines if line.strip()]


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
