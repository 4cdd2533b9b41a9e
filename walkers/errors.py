"""The project's errors, all under one root.

A user can mend an `InputError` in a file or on the command line (exit status 2). Failures of the engine are listed in
`walkers.runner.failures` (exit status 1).
"""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TypeVar

from walkers.text import printable

T = TypeVar("T")
R = TypeVar("R")
_LONGEST_VALUE = 80
_LONGEST_TEXT = 1000  # longest quotation of a value, and of a file's name or an expectation, in a message, in letters


class WalkersError(Exception):
    """Root of every error that this project raises on purpose."""


class Stopped(WalkersError):
    """The user stopped the run; not a failure."""


@dataclass(frozen=True)
class Problem:
    """One error of an input.

    ``key`` is dotted, such as ``drive.frequency``, and empty for the file as a whole; ``value`` as the user wrote it,
    None where there is none to quote; ``expected`` describes right values.
    """

    key: str
    value: str | None
    expected: str

    def __str__(self) -> str:
        where = " = ".join(
            shortened(printable(part)) for part in (self.key, self.value) if part is not None
        )
        expected = shortened(printable(self.expected), _LONGEST_TEXT)
        return f"{where}: {expected}" if where else expected


class InputError(WalkersError):
    """An unusable input.

    Attributes
    ----------
    source
        The file, option or argument that cannot be used.
    problems
        All of its problems, at least one. The message has a line for each.
    """

    def __init__(self, source: str, problems: Sequence[Problem]) -> None:
        self.source = source
        self.problems = tuple(problems)
        super().__init__(source, self.problems)

    def __str__(self) -> str:
        source = shortened(printable(self.source), _LONGEST_TEXT)
        return "\n".join(f"{source}: {problem}" for problem in self.problems)

    def renamed(self, name_of: Callable[[str], str]) -> InputError:
        """The error with another name of its source, such as that of an option for an argument."""
        return InputError(name_of(self.source), self.problems)


class InputErrors(InputError):
    """Errors of several inputs, each with its own source.

    Attributes
    ----------
    errors
        The errors, at least one.
    source
        That of the first error.
    problems
        Those of all errors.
    """

    def __init__(self, errors: Sequence[InputError]) -> None:
        super().__init__(
            errors[0].source, [problem for error in errors for problem in error.problems]
        )
        self.errors = tuple(errors)

    def __reduce__(self) -> tuple[type[InputErrors], tuple[Sequence[InputError]]]:
        """How it is made again in another process."""
        return InputErrors, (self.errors,)

    def __str__(self) -> str:
        return "\n".join(dict.fromkeys(map(str, self.errors)))

    def renamed(self, name_of: Callable[[str], str]) -> InputErrors:
        """The errors with other names of their sources."""
        return InputErrors([error.renamed(name_of) for error in self.errors])


def input_error(source: object, expected: str) -> InputError:
    """An error for an unusable file, option or other source, with the expectation."""
    return InputError(str(source), [Problem("", None, expected)])


def key_error(key: str, expected: str, value: object = None) -> InputError:
    """An error for an unusable value of a key; the reader adds file name and value (`walkers.inputs.messages`)."""
    return InputError("", [Problem(key, None if value is None else quoted(value), expected)])


def apply_all(function: Callable[[T], R], arguments: Iterable[T]) -> list[R]:
    """Results of a function for several arguments; raises `InputErrors` with the problems of all of them."""
    results: list[R] = []
    errors: list[InputError] = []
    for argument in arguments:
        try:
            results.append(function(argument))
        except InputError as error:
            errors.append(error)
    if errors:
        raise InputErrors(errors) from errors[0]
    return results


def quoted(value: object) -> str:
    """A value as the user may have written it, shortened."""
    try:
        return shortened(json.dumps(value, ensure_ascii=False, default=str))
    except (ValueError, RecursionError):  # integers of thousands of digits, brackets without end
        return "..."


def shortened(text: str, longest: int = _LONGEST_VALUE) -> str:
    """A text as a message quotes it."""
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def check_limits(name: str, value: float | None, low: float, high: float = inf) -> None:
    """Refuse an argument that is given and not within its limits."""
    if value is not None and not low <= value <= high:
        raise input_error(
            name,
            f"{value:g}: expected "
            + (f"{low:g} to {high:g}" if high < inf else f"{low:g} or more"),
        )


def check_utf8(word: str | Path) -> None:
    """Refuse a path or a word that is no UTF-8, which no table or deck could name, its odd bytes written out."""
    try:
        str(word).encode("utf-8")
    except UnicodeEncodeError as error:
        odd = os.fsencode(str(word)).decode("utf-8", "backslashreplace")
        raise input_error(odd, "expected UTF-8 text") from error


def expected_of(word: str, names: Iterable[str]) -> str:
    """``expected one of …``, with a suggestion if a name is similar."""
    names = list(names)
    return f"expected one of {', '.join(names)}{suggestion(word, names)}"


def suggestion(word: str, names: Iterable[str]) -> str:
    """``; did you mean "…"?`` with the names that contain the word or begin it, and the most similar one; or empty."""
    names, folded = list(names), word.casefold()
    alike = (
        name
        for name in names
        if folded in name.casefold() or folded.startswith(f"{name.casefold()} ")
    )
    holding = sorted(alike, key=len) if len(word) > 2 else []
    near = dict.fromkeys([*holding, *difflib.get_close_matches(word, names, n=1, cutoff=0.6)])
    return "; did you mean " + " or ".join(f'"{name}"' for name in near) + "?" if near else ""
