"""Analyses of piles and of meetings of walkers (`walkers.postprocess.former`)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from math import nan
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, ClassVar

from walkers.inputs.case import Case

if TYPE_CHECKING:
    from walkers.postprocess.motion import Bridges, Motion
    from walkers.postprocess.tables import Columns

Described = Mapping[str, tuple[str, str]]
"""Units and meanings of columns, by name."""


@dataclass(frozen=True)
class Quantity:
    """A number of a result at a dotted path, or by a function; the name of its column."""

    path: str
    label: str = ""
    unit: str = ""
    column: str = ""
    meaning: str = ""
    of: Callable[[Mapping[str, Any]], Any] | None = None

    def value(self, result: Mapping[str, Any]) -> Any:
        """The number; NaN if the result has none."""
        if self.of is not None:
            return self.of(result)
        value: Any = result
        for part in self.path.split("."):
            value = None if value is None else value[part]
        return nan if value is None else value


class Analysis(ABC):
    """An analysis of runs, ``tables`` are the names of its tables."""

    order: ClassVar[int] = 9
    name: ClassVar[str]
    tables: ClassVar[tuple[str, ...]]
    derived: ClassVar[Described] = {}

    @abstractmethod
    def applies(self, case: Case) -> bool:
        """Whether the analysis applies to a case."""

    @abstractmethod
    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Measure a motion: tables by name, and its part of the result (SI units)."""

    @abstractmethod
    def quantities(self, result: Mapping[str, Any]) -> Iterable[Quantity]:
        """Quantities of a result."""

    def row(self, result: Mapping[str, Any]) -> dict[str, Any]:
        """Numbers of a result by the names of their columns; NaN for missing ones."""
        return {one.column: one.value(result) for one in self.quantities({}) if one.column}

    def derived_of(self, case: Case) -> dict[str, float]:
        """Numbers that follow from a case."""
        del case
        return {}

    def point_data(self, motion: Motion) -> Callable[[Bridges], Columns]:
        """A function that returns further arrays of the beads in a frame for ParaView; None if there are none."""
        del motion
        return lambda _: {}


@cache
def analyses() -> tuple[Analysis, ...]:
    """All analyses, in the order of results."""
    from walkers.postprocess.analyses import __name__ as package
    from walkers.postprocess.analyses import __path__ as place

    for module in iter_modules(place):
        import_module(f"{package}.{module.name}")
    return tuple(kind() for kind in sorted(Analysis.__subclasses__(), key=lambda kind: (kind.order, kind.name)))


def analyses_of(case: Case) -> list[Analysis]:
    """Analyses that apply to a case."""
    return [one for one in analyses() if one.applies(case)]
