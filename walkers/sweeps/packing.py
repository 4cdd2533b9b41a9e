"""Which points travel in which deck: by predicted cost, so that all cores finish together.

A deck costs a start-up and a share a step whoever is in it, so that fewer decks are cheaper; more of them fill the
cores more evenly and give results sooner. The packing is one of the whole sweep and of the number of workers: it does
not depend on what is finished, so that an interrupted sweep goes on with the decks that it would have had.
"""

from __future__ import annotations

import heapq
from bisect import bisect_left
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil

from walkers.inputs.case import Case
from walkers.runner.cost import pairs_of_beads, predicted_seconds
from walkers.templates.scene import sharing_key

MOST_WALKERS = 96
"""In a deck; with 96 the share of the deck's own cost is down to 4 %."""
MOST_POINTS = 64
LONGEST_SECONDS = 60.0
"""Predicted time of a deck of several points: results are to keep coming."""
_TRIALS = 24
_AS_GOOD = 1.02


@dataclass(frozen=True)
class PlannedDeck:
    """Numbers of the points of a deck, in order, and its predicted time in s on one core."""

    points: tuple[int, ...]
    seconds: float


def pack(cases: Mapping[int, Case], workers: int, longest_seconds: float = LONGEST_SECONDS) -> list[PlannedDeck]:
    """Pack points into decks, longest first: the order in which they are to be started.

    Parameters
    ----------
    cases
        From the number of a point to its case.
    workers
        How many decks run at once.
    longest_seconds
        Predicted time that no deck of several points may exceed.
    """
    groups: dict[Hashable, list[int]] = {}
    for number, case in cases.items():
        groups.setdefault(sharing_key(case), []).append(number)
    together = list(groups.values())
    singles = [_deck([number], cases).seconds for number in cases]
    if len(together) == len(cases):
        lengths = [max(singles, default=0.0)]
    else:
        whole = sum(_deck(group, cases).seconds for group in together)
        lengths = [2.0 * max(whole / workers, *singles) * 2.0 ** (-number / 4) for number in range(_TRIALS)]
    plans = [
        [deck for group in together for deck in _parted(group, cases, min(length, longest_seconds))]
        for length in lengths
    ]
    spans = [makespan((deck.seconds for deck in plan), workers) for plan in plans]
    # Of plans that take as long, the one with the smallest decks.
    good = max(number for number, span in enumerate(spans) if span <= _AS_GOOD * min(spans))
    return sorted(plans[good], key=lambda deck: -deck.seconds)


def _parted(group: Sequence[int], cases: Mapping[int, Case], longest: float) -> list[PlannedDeck]:
    """A group in the fewest decks that keep to the bounds; a point by itself may exceed them."""
    most_replicates = max(pairs_of_beads(cases[number]) for number in group)

    def allowed(parts: int) -> bool:
        points = ceil(len(group) / parts)
        walkers = points * most_replicates
        seconds = predicted_seconds(cases[group[0]], walkers)  # a group shares the number of steps
        return points == 1 or (points <= MOST_POINTS and walkers <= MOST_WALKERS and seconds <= longest)

    fewest = bisect_left(range(1, len(group)), True, key=allowed) + 1
    return [_deck(part, cases) for part in _parts(group, fewest)]


def _parts(group: Sequence[int], count: int) -> list[Sequence[int]]:
    """A sequence in so many consecutive parts, of equal lengths as far as that goes."""
    edges = [len(group) * number // count for number in range(count + 1)]
    return [group[start:end] for start, end in pairwise(edges)]


def _deck(points: Sequence[int], cases: Mapping[int, Case]) -> PlannedDeck:
    walkers = sum(pairs_of_beads(cases[number]) for number in points)
    return PlannedDeck(tuple(points), predicted_seconds(cases[points[0]], walkers))


def makespan(seconds: Iterable[float], workers: int) -> float:
    """Time until all is done when each free worker takes the longest that is left, s."""
    durations = sorted(seconds, reverse=True)
    ends = [0.0] * max(1, min(workers, len(durations)))
    for duration in durations:
        heapq.heapreplace(ends, ends[0] + duration)
    return max(ends)


def unfinished_parts(
    points: Sequence[int], cases: Mapping[int, Case], is_finished: Callable[[int], bool]
) -> list[PlannedDeck]:
    """What is left of a deck: itself, or those of its halves, halves of halves …, of which nothing is finished.

    A deck that fails is tried again in halves; so what is left of it consists of the same decks, whenever the sweep was
    interrupted.
    """
    finished = [is_finished(number) for number in points]
    if all(finished):
        return []
    if not any(finished):
        return [_deck(points, cases)]
    return [part for half in halves(points) for part in unfinished_parts(half, cases, is_finished)]


def halves(points: Sequence[int]) -> list[Sequence[int]]:
    """The two halves of a deck of several points."""
    return _parts(points, 2)
