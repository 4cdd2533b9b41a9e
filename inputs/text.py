"""Text from templates: decks and reports read as what they give, their numbers filled in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def rendered(package: str, template: str, **values: Any) -> str:
    """The text of a template of a package.

    Filters: ``number`` (shortest text that reads back as the same double) and ``numbers`` of several, ``format`` as
    Python's for numbers, a dash for what is none, ``cell`` for a table's.

    Raises
    ------
    jinja2.UndefinedError
        If it names a value that is not given.
    """
    return _environment(package).get_template(template).render(**values)


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(values: Iterable[float]) -> str:
    return " ".join([repr(float(value)) for value in values])


def _formatted(value: float | None, form: str, missing: str = "-") -> str:
    return missing if value is None or not isfinite(value) else f"{value:{form}}"


def _cell(text: object) -> str:
    return str(text).replace("|", "\\|")


_FILTERS: Mapping[str, Callable[..., Any]] = {
    "number": _number,
    "numbers": _numbers,
    "format": _formatted,
    "cell": _cell,
    "any": any,
    "zip": zip,
}


@cache
def _environment(package: str) -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(package, "."),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
    environment.filters.update(_FILTERS)
    return environment
