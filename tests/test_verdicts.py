"""Verdicts that must be able to fail: checks, comparisons of two engines, benchmarks, with made-up numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkers.check.benchmarks import largest
from walkers.check.crosscheck import Comparison, Start
from walkers.check.report import Chapter, Line, Verdict, as_dict, outcome
from walkers.inputs.reading import load_case
from walkers.postprocess.motion import Motion

GOOD, BAD = Line("good", 1.0, 1.05, 0.1), Line("bad", 1.0, 1.2, 0.1)
CHAPTERS = (Chapter("one", "One", (GOOD,)), Chapter("two", "Two", (GOOD, BAD, GOOD)))


def test_one_failed_line_fails_all_checks() -> None:
    assert [line.verdict for line in (GOOD, BAD)] == [Verdict.PASS, Verdict.FAIL]
    assert not as_dict(CHAPTERS)["passed"]
    assert as_dict(CHAPTERS[:1])["passed"]
    assert (outcome(CHAPTERS), outcome(CHAPTERS[:1])) == ("1 of 4 lines fail", "all 1 lines pass")


def _pile(cycles: list[float]) -> Motion:
    """Three beads of a pile at rest, at some cycles of its drive."""
    case, frames = load_case("pile-ci"), len(cycles)
    still = np.zeros((frames, 3, 3))
    position = still + 1e-3 * np.arange(3.0)[:, None]
    time = np.array(cycles) / case.excitation.frequency
    walls = np.zeros((frames, 3))
    radius = np.array([0.6e-3, 0.3e-3, 0.6e-3])
    return Motion(
        case, time, position, still, still, walls, walls, radius, (), [(Path("s"), 0)] * frames, truncated=False
    )


@pytest.mark.parametrize(("away", "cycle"), [(2, 0.5), (3, 1.5), (4, None)])
def test_a_pile_fails_if_a_bead_leaves_its_motion_in_the_first_cycle(away: int, cycle: float | None) -> None:
    """By 1.1 % of the smallest radius, one bead of three."""
    first = _pile([0.0, 0.25, 0.5, 1.5])
    moved = first.position.copy()
    moved[away:, 1, 0] += 0.011 * 0.3e-3
    start = Start(first, replace(first, position=moved))
    assert start.together == (cycle if cycle is None else pytest.approx(cycle))
    assert start.line().measured == pytest.approx(0.0 if cycle is None else 3.3)
    failures = Comparison(first.case, (), (GOOD,), (start,)).chapter().failures
    assert len(failures) == (cycle == 0.5)


def test_the_largest_difference_has_either_sign() -> None:
    measured = np.array([1.01, 0.9, 1.02])
    line = largest("x", 1.0, measured, 0.05)
    assert (line.measured, line.verdict) == (pytest.approx(-0.1), Verdict.FAIL)
    assert largest("x", measured + 0.01, measured, 0.05).verdict is Verdict.PASS
