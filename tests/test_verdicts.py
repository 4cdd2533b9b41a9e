"""Verdicts that must be able to fail: checks, comparisons of two engines, benchmarks, with made-up numbers."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

from walkers.check.benchmarks import largest
from walkers.check.crosscheck import courses
from walkers.check.lines import Line, Verdict, as_dict, as_text, failures
from walkers.inputs.reading import load_case
from walkers.postprocess.motion import Motion

GOOD, BAD = Line("good", 1.0, 1.05, 0.1), Line("bad", 1.0, 1.2, 0.1, check="second")


@pytest.mark.parametrize(
    ("line", "verdict"),
    [
        (GOOD, Verdict.PASS),
        (BAD, Verdict.FAIL),
        (replace(GOOD, measured=float("nan")), Verdict.FAIL),
        (replace(GOOD, expected=0.0, measured=0.2), Verdict.FAIL),
        (replace(BAD, scale=10.0), Verdict.PASS),
        (replace(BAD, tolerance=inf), Verdict.NOT_JUDGED),
        (replace(GOOD, given=Verdict.FAIL), Verdict.FAIL),
    ],
)
def test_a_line_is_judged_by_its_tolerance(line: Line, verdict: Verdict) -> None:
    assert line.verdict is verdict


def test_one_failed_line_fails_all_checks() -> None:
    lines = (GOOD, replace(GOOD, check="second"), BAD)
    assert not as_dict(lines)["passed"]
    assert as_dict(lines[:1])["passed"]
    assert failures(lines) == [BAD]
    told = [line.split() for line in as_text(lines[1:], "engine: ").splitlines()]
    assert [words[0] for words in told if words] == ["second", "expected", "pass", "FAIL", "engine:"]
    assert told[-1][1:] == ["1", "of", "2", "lines", "fail"]
    assert as_text(lines[:1]).endswith("\nall 1 lines pass")


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


@pytest.mark.parametrize(("away", "cycle"), [(2, 0.5), (3, 1.5), (4, 1.5)])
def test_a_pile_fails_if_a_bead_leaves_its_motion_in_the_first_cycle(away: int, cycle: float) -> None:
    """By 1.1 % of the smallest radius, one bead of three."""
    first = _pile([0.0, 0.25, 0.5, 1.5])
    moved = first.position.copy()
    moved[away:, 1, 0] += 0.011 * 0.3e-3
    together, farthest = courses(first, replace(first, position=moved))
    assert (together.expected, together.measured) == pytest.approx((1.5, cycle))
    assert farthest.measured == pytest.approx(0.0 if away == 4 else 3.3)
    assert together.failed == (cycle == 0.5)
    assert not farthest.failed


def test_the_largest_difference_has_either_sign() -> None:
    measured = np.array([1.01, 0.9, 1.02])
    line = largest("x", 1.0, measured, 0.05)
    assert (line.measured, line.verdict) == (pytest.approx(-0.1), Verdict.FAIL)
    assert largest("x", measured + 0.01, measured, 0.05).verdict is Verdict.PASS
