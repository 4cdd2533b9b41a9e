"""Analyses of piles and of meetings as modules of `walkers.postprocess.results`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from walkers.postprocess.analyses.meetings import Meetings
from walkers.postprocess.analyses.piles import Pile
from walkers.postprocess.numbers import Measured

if TYPE_CHECKING:
    from walkers.inputs.case import Case
    from walkers.postprocess.analysis import Analysis
    from walkers.postprocess.motion import Motion


_WHOLE = 1.0 - 1e-6
"""Share of the duration below which a run ended early."""


class Former:
    """An analysis with the functions of a module that measures; ``NAME`` is a group of numbers."""

    def __init__(self, name: str, analysis: Analysis) -> None:
        self.NAME, self._analysis = name, analysis

    def applies(self, case: Case) -> bool:
        """Whether the analysis applies to a case."""
        return self._analysis.applies(case)

    def derived(self, case: Case) -> dict[str, float]:
        """Numbers that follow from the case."""
        return self._analysis.derived_of(case)

    def measure(self, motion: Motion) -> Measured:
        """Tables and numbers."""
        tables, result = self._analysis.of(motion)
        warnings = []
        if "driven" in result and result["driven"] < _WHOLE * result["duration"]:
            warnings.append(f"ended before {result['duration']:.3g} s: climbers left the container")
        return Measured(tables, self._analysis.row(result) | _of_bed(result), tuple(warnings))


def _of_bed(result: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of the bed of a pile."""
    if "surface" not in result:
        return {}
    numbers = {name: result[name] for name in ("beads", "large", "driven", "duration")}
    numbers |= {f"{name}_{end}": one for name in ("surface", "brazil_nut") for end, one in result[name].items()}
    for when, counts in {"at_rest": "rest", "shaken": "shaken"}.items():
        numbers |= {f"{name}_{when}": one for name, one in (result["coordination"][counts] or {}).items()}
    return numbers | {f"events_{kind}": count for kind, count in result["events"].items()}


meetings, piles = Former("meetings", Meetings()), Former("piles", Pile())
