"""The project's errors, all under one root.

`InputError` is what a user can mend in a file or on the command line (exit status 2); everything that goes wrong while
an engine runs derives from `WalkersError` too and is listed in `walkers.runner.failures` (exit status 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class WalkersError(Exception):
    """Root of every error that this project raises on purpose."""


class Stopped(WalkersError):
    """Somebody stopped what was going on: no failure."""


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with an input.

    Attributes
    ----------
    key
        Dotted key, such as ``drive.frequency``; empty for the file as a whole.
    value
        The value as the user wrote it, or None where there is none to quote.
    expected
        What would have been right, as the end of the sentence "expected …".
    """

    key: str
    value: str | None
    expected: str

    def __str__(self) -> str:
        where = f"{self.key} = {self.value}" if self.value is not None else self.key
        return f"{where}: {self.expected}" if where else self.expected


class InputError(WalkersError):
    """An input that cannot be used: names the file, the key, the value and what was expected.

    Parameters
    ----------
    source
        File (or other origin) of the input.
    problems
        Everything that is wrong with it, at least one.
    """

    def __init__(self, source: str, problems: Sequence[Problem]) -> None:
        self.source = source
        self.problems = tuple(problems)
        super().__init__("\n".join(f"{source}: {problem}" for problem in self.problems))


class UnusableKeyError(Exception):
    """A problem found between keys; `walkers.inputs.reading` adds the file and the value."""

    def __init__(self, key: str, expected: str) -> None:
        self.key = key
        self.expected = expected
        super().__init__(expected)
