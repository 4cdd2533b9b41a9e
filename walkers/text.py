"""Text from templates: decks and reports with their numbers filled in."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def rendered(package: str, template: str, values: Mapping[str, Any]) -> str:
    """The text of a template of a package, with values by the names that the template uses.

    Filters: ``number`` (shortest text that reads back as the same double) and ``numbers`` of several, ``format`` as
    Python's for numbers, with a dash for missing ones, ``plain`` for a user's text in Markdown.
    `jinja2.UndefinedError` if it names a value that is not given.
    """
    return environment(package).get_template(template).render(values)


def printable(text: str) -> str:
    r"""A user's text on one line: white space is a space, and invisible characters are written out.

    Examples
    --------
    >>> printable("one\ntwo \x1b[31m")
    'one two \\x1b[31m'
    """
    return "".join(
        letter if letter.isprintable() else repr(letter)[1:-1] for letter in " ".join(text.split())
    )


def aligned(rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> str:
    """Rows of cells as text with aligned columns, those with the numbers ``right`` at their right ends."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    justify = [str.rjust if number in right else str.ljust for number in range(len(widths))]
    filled = (
        [fill(cell, width) for fill, cell, width in zip(justify, row, widths, strict=True)]
        for row in rows
    )
    return "\n".join("  ".join(row).rstrip() for row in filled)


def _formatted(value: float | None, form: str, missing: str = "-") -> str:
    return missing if value is None or not isfinite(value) else f"{value:{form}}"


def _plain(text: str) -> str:
    return re.sub(r"[\\`*_<>|&\[\]]", r"\\\g<0>", printable(text))


_FILTERS: Mapping[str, Callable[..., Any]] = {
    "number": lambda value: repr(float(value)),
    "numbers": lambda values: " ".join([repr(float(value)) for value in values]),
    "format": _formatted,
    "plain": _plain,
    "any": any,
    "zip": zip,
}


def with_unit(words: str, unit: str | None) -> str:
    """A label with its unit, if there is one."""
    return f"{words} ({unit})" if unit else words


@cache
def environment(*packages: str, html: bool = False) -> Environment:
    """The environment that renders templates of packages; in ``html`` values are escaped."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package, ".") for package in packages]),
        undefined=StrictUndefined,
        autoescape=html,
        keep_trailing_newline=not html,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    environment.filters.update(_FILTERS)
    return environment
