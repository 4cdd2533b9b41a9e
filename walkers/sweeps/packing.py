"""Pack the points of a sweep into decks.

Each deck has a start-up time and a cost per step that do not depend on its contents: few decks are
cheaper. Many decks use the cores more evenly and give results sooner. Decks are packed by their
predicted cost, so that all cores finish together.

The packing depends on the whole sweep and the number of workers, not on the finished points: an
interrupted sweep continues with the same decks.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Hashable, Iterable, Sequence
from dataclasses import dataclass
from math import ceil

from walkers.inputs.tables.case import Case
from walkers.runner.cost import pairs_of_beads, predicted_seconds
from walkers.templates.placement import sharing_key

MOST_WALKERS = 96
"""Largest number of walkers of a deck, counted as pairs of beads (`pairs_of_beads`).

With 96, the cost of the deck itself is 4 % of the total.
"""
MOST_POINTS = 64
"""Largest number of points of a deck."""
LONGEST_SECONDS = 60.0
"""Largest predicted time of a deck of several points, s, so that results appear regularly."""
_TRIALS = 24
"""Number of plans that are compared; the decks of each are 2^(1/4) times shorter than before."""
_AS_GOOD = 1.02
"""Plans that take at most this many times as long as the fastest one are equally good."""


@dataclass(frozen=True)
class PlannedDeck:
    """Points that one deck makes.

    Attributes
    ----------
    points
        Numbers of the points, in order.
    seconds
        Predicted time on one core, s.
    """

    points: tuple[int, ...]
    seconds: float

    @classmethod
    def of_points(cls, points: Sequence[int], cases: Sequence[Case]) -> PlannedDeck:
        """The deck of some points of a sweep with these cases."""
        walkers = sum(pairs_of_beads(cases[number]) for number in points)
        return cls(tuple(points), predicted_seconds(cases[points[0]], walkers))


def pack(
    cases: Sequence[Case], workers: int, longest_seconds: float = LONGEST_SECONDS
) -> list[PlannedDeck]:
    """Pack points into decks; the longest decks come first.

    Parameters
    ----------
    cases
        The cases of all points of a sweep.
    workers
        Number of decks that run at the same time.
    longest_seconds
        Largest predicted time of a deck of several points, s.
    """
    groups = _sharing_points(cases)
    total = 0.0
    for group in groups:
        total += PlannedDeck.of_points(group, cases).seconds
    longest = max(predicted_seconds(case, pairs_of_beads(case)) for case in cases)
    # Without points that can share a deck, all plans are the same.
    trials = _TRIALS if len(groups) < len(cases) else 1
    plans = []
    spans = []
    for trial in range(trials):
        # The first plan has decks of up to twice the time that all workers need together.
        length = min(2.0 * max(total / workers, longest) * 2.0 ** (-trial / 4), longest_seconds)
        decks: list[PlannedDeck] = []
        for group in groups:
            decks += _split_group(group, cases, length)
        plans.append(decks)
        spans.append(makespan(seconds_of(decks), workers))
    good = [number for number, span in enumerate(spans) if span <= _AS_GOOD * min(spans)]
    # Later trials have smaller decks, which are better if they take equally long.
    chosen = plans[max(good)]
    return sorted(chosen, key=lambda deck: -deck.seconds)


def _sharing_points(cases: Sequence[Case]) -> list[list[int]]:
    """Numbers of the points in groups that can share a deck."""
    groups: dict[Hashable, list[int]] = {}
    for number, case in enumerate(cases):
        groups.setdefault(sharing_key(case), []).append(number)
    return list(groups.values())


def seconds_of(decks: Iterable[PlannedDeck]) -> list[float]:
    """Predicted times of decks on one core, s."""
    return [deck.seconds for deck in decks]


def _split_group(
    group: Sequence[int], cases: Sequence[Case], longest_seconds: float
) -> list[PlannedDeck]:
    """Split points that can share a deck into as few decks as possible.

    A deck has at most `MOST_POINTS`, `MOST_WALKERS` and ``longest_seconds`` of predicted time, as
    if each of its points had the walkers of the largest one. A deck of a single point has no
    limits.
    """
    most_walkers = max(pairs_of_beads(cases[number]) for number in group)

    def is_possible(points: int) -> bool:
        """Whether a deck may have so many points of the group."""
        walkers = points * most_walkers
        seconds = predicted_seconds(cases[group[0]], walkers)  # a group shares the number of steps
        is_small = points <= MOST_POINTS and walkers <= MOST_WALKERS
        return points == 1 or (is_small and seconds <= longest_seconds)

    decks = 1
    while not is_possible(ceil(len(group) / decks)):
        decks += 1
    return [PlannedDeck.of_points(part, cases) for part in parts_of(group, decks)]


def parts_of(points: Sequence[int], count: int) -> list[Sequence[int]]:
    """Split a sequence into consecutive parts whose lengths differ by at most one."""
    parts = []
    for number in range(count):
        start = len(points) * number // count
        end = len(points) * (number + 1) // count
        parts.append(points[start:end])
    return parts


def makespan(seconds: Iterable[float], workers: int) -> float:
    """Time in s until all decks are done, if each free worker takes the longest deck that is left.

    Parameters
    ----------
    seconds
        Times of the decks, s.
    workers
        Number of decks that run at the same time.
    """
    durations = sorted(seconds, reverse=True)
    ends = [0.0] * max(1, min(workers, len(durations)))
    for duration in durations:
        heapq.heapreplace(ends, ends[0] + duration)
    return max(ends)


def unfinished_parts(
    points: Sequence[int], cases: Sequence[Case], finished: Collection[int]
) -> list[PlannedDeck]:
    """The unfinished part of a deck as decks.

    It is the deck itself, or its largest halves, quarters, … without a finished point. A deck that
    fails is repeated as two halves. So the same decks are left whenever the sweep is interrupted.

    Parameters
    ----------
    points
        Numbers of the points of the deck.
    cases
        The cases of all points of the sweep.
    finished
        Numbers of the finished points of the sweep.
    """
    finished_points = set(points).intersection(finished)
    if not finished_points:
        return [PlannedDeck.of_points(points, cases)]
    if len(finished_points) == len(points):
        return []
    first, second = parts_of(points, 2)
    return [
        *unfinished_parts(first, cases, finished),
        *unfinished_parts(second, cases, finished),
    ]
