"""Entry points of installed packages: materials, cases and bridge laws.

A package is imported only when one of its entry points is used; their names are known before.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Group = Literal["walkers.materials", "walkers.cases", "walkers.bridge_laws"]


class BrokenPackageWarning(UserWarning):
    """An entry point of a package cannot be used and is left out."""


@dataclass(frozen=True)
class Offer:
    """An entry point: its name, and the package that it is from, such as ``package mylab 1.0``."""

    name: str
    place: str
    entry: EntryPoint

    def load(self, *, call: bool = True) -> Any:
        """The function that it names, or what this returns (``call``); raises `ValueError` with the package's name."""
        try:
            found = self.entry.load()
            return found() if call else found
        except (Exception, SystemExit) as error:
            raise self.broken(f"{type(error).__name__}: {error}") from error

    def broken(self, why: object) -> ValueError:
        """The error to raise, or to warn of."""
        return ValueError(f"{self.place}: {self.entry.group} {self.name!r} cannot be used: {why}")


@cache
def offers(group: Group) -> Mapping[str, Offer]:
    """Entry points of installed packages, by name; the first one of two with the same name."""
    from importlib.metadata import entry_points

    found: dict[str, Offer] = {}
    for entry in entry_points(group=group):
        place = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value
        found.setdefault(entry.name, Offer(entry.name, f"package {place}", entry))
    return found


def warn_of(error: Exception) -> None:
    """Warn that an entry point of a package is left out."""
    warnings.warn(str(error), BrokenPackageWarning, stacklevel=2)
