"""The project's errors, all under one root.

A user can mend an `InputError` in a file or on the command line (exit status 2). Failures of the
engine are listed in `walkers.runner.failures` (exit status 1).
"""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from numbers import Integral, Real
from pathlib import Path
from typing import TypeVar

from walkers.text import printable

T = TypeVar("T")
R = TypeVar("R")
_LONGEST_VALUE = 80
"""Longest quotation of a value in a message, in letters."""
_LONGEST_TEXT = 1000
"""Longest quotation of a file's name or of an expectation in a message, in letters."""


class WalkersError(Exception):
    """Root of every error that this project raises on purpose."""


class Stopped(WalkersError):
    """The user stopped the run; not a failure."""


@dataclass(frozen=True)
class Problem:
    """One error of an input.

    Attributes
    ----------
    key
        Dotted key, such as ``drive.frequency``; empty for the file as a whole.
    value
        The value as the user wrote it; None if there is none to quote.
    expected
        Describes right values.
    in_command
        What the program says instead of ``expected``, which speaks to Python users: options and
        commands. None: the same.
    """

    key: str
    value: str | None
    expected: str
    in_command: str | None = None

    def __str__(self) -> str:
        place = shortened(printable(self.key))
        if self.value is not None:
            place += f" = {shortened(printable(self.value))}"
        expected = shortened(printable(self.expected), _LONGEST_TEXT)
        return f"{place}: {expected}" if place else expected


class InputError(WalkersError):
    """An input that cannot be used.

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

    def in_command(self, name_of: Callable[[str], str]) -> InputError:
        """The error in the words of the command line.

        Parameters
        ----------
        name_of
            Gives the name of the source on the command line, such as that of an option for an
            argument.
        """
        problems = []
        for problem in self.problems:
            expected = problem.expected if problem.in_command is None else problem.in_command
            problems.append(replace(problem, expected=expected))
        return InputError(name_of(self.source), problems)


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
        problems: list[Problem] = []
        for error in errors:
            problems += error.problems
        super().__init__(errors[0].source, problems)
        self.errors = tuple(errors)

    def __reduce__(self) -> tuple[type[InputErrors], tuple[Sequence[InputError]]]:
        """How the error is made again in another process."""
        return InputErrors, (self.errors,)

    def __str__(self) -> str:
        texts = [str(error) for error in self.errors]
        return "\n".join(dict.fromkeys(texts))

    def in_command(self, name_of: Callable[[str], str]) -> InputErrors:
        """The errors in the words of the command line."""
        return InputErrors([error.in_command(name_of) for error in self.errors])


def input_error(source: object, expected: str, in_command: str | None = None) -> InputError:
    """The error of an unusable file, option or other source, with what is expected.

    Parameters
    ----------
    source
        The file, option or argument.
    expected
        Describes right values.
    in_command
        What the program says instead (`Problem.in_command`).
    """
    return InputError(str(source), [Problem("", None, expected, in_command)])


def key_error(key: str, expected: str, value: object = None) -> InputError:
    """The error of an unusable value of a key.

    The reader of the file adds its name, and the value if it is None here
    (`walkers.inputs.messages`).

    Parameters
    ----------
    key
        Dotted key.
    expected
        Describes right values.
    value
        The value; None: not known here.
    """
    quotation = None if value is None else quoted(value)
    return InputError("", [Problem(key, quotation, expected)])


def apply_all(function: Callable[[T], R], arguments: Iterable[T]) -> list[R]:
    """Results of a function for several arguments.

    Raises
    ------
    InputErrors
        With the problems of all arguments, if the function raises `InputError` for some.
    """
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
    """A value as the user may have written it, shortened to `_LONGEST_VALUE` letters."""
    try:
        return shortened(json.dumps(value, ensure_ascii=False, default=str))
    except (ValueError, RecursionError):  # integers of thousands of digits, brackets without end
        return "..."


def shortened(text: str, longest: int = _LONGEST_VALUE) -> str:
    """A text as a message quotes it, with at most so many letters."""
    if len(text) <= longest:
        return text
    return f"{text[: longest - 3]}..."


def check_limits(
    name: str, value: object, low: float = -inf, high: float = inf, *, whole: bool = False
) -> None:
    """Raise `InputError` if an argument is no number within its limits; None: it was not given.

    Parameters
    ----------
    name
        Name of the argument.
    value
        Its value.
    low, high
        Smallest and largest value.
    whole
        Whether only whole numbers are accepted.
    """
    if value is None:
        return
    kind = "a whole number" if whole else "a number"
    is_number = isinstance(value, Integral if whole else Real)
    if not is_number or isinstance(value, bool):
        raise input_error(name, f"{quoted(value)}: expected {kind}")
    number = float(value)  # type: ignore[arg-type]
    if low <= number <= high:
        return
    if high < inf:
        limits = f"{low:g} to {high:g}"
    elif low > -inf:
        limits = f"{low:g} or more"
    else:
        limits = kind
    raise input_error(name, f"{number:g}: expected {limits}")


def check_text_or_path(name: str, value: object, expectation: str = "a path") -> None:
    """Raise `InputError` if an argument is neither text nor a path.

    Parameters
    ----------
    name
        Name of the argument.
    value
        Its value.
    expectation
        What is expected, in words.
    """
    if not isinstance(value, (str, Path)):
        raise input_error(name, f"{quoted(value)}: expected {expectation}")


def check_changes(changes: object) -> None:
    """Raise `InputError` if changes of a case are no values by dotted keys."""
    if changes is None or isinstance(changes, Mapping):
        return
    example = 'values by dotted keys, such as {"drive.frequency": "70 Hz"}'
    raise input_error("changes", f"{quoted(changes)}: expected {example}")


def check_utf8(word: str | Path) -> None:
    r"""Raise `InputError` if a path or a word is not UTF-8: no table or deck could name it.

    The message has escape sequences such as ``\xff`` for its other bytes.
    """
    try:
        str(word).encode("utf-8")
    except UnicodeEncodeError as error:
        escaped = os.fsencode(str(word)).decode("utf-8", "backslashreplace")
        raise input_error(escaped, "expected UTF-8 text") from error


def expected_of(word: str, names: Iterable[str]) -> str:
    """``expected one of …``, with a suggestion if a name is similar."""
    names = list(names)
    return f"expected one of {', '.join(names)}{suggestion(word, names)}"


def suggestion(word: str, names: Iterable[str]) -> str:
    """``; did you mean "…"?`` with the names that a user may have meant; empty if there are none.

    These are names that contain the word or with which it begins, the shortest first, and the most
    similar name.
    """
    names = list(names)
    related = []
    if len(word) > 2:
        related = [name for name in names if _is_related(word.casefold(), name.casefold())]
    similar = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    suggested = dict.fromkeys([*sorted(related, key=len), *similar])
    if not suggested:
        return ""
    quotations = " or ".join([f'"{name}"' for name in suggested])
    return f"; did you mean {quotations}?"


def _is_related(word: str, name: str) -> bool:
    """Whether a name contains a word, or is its first part; both in lower case."""
    return word in name or word.startswith(f"{name} ")
