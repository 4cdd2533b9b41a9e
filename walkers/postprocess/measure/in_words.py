"""What the beads of walkers do, in words: which of them roll, and how far the others slide."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from walkers.postprocess.measure.numbers import headline
from walkers.postprocess.measure.sides import REST

_NEARLY = 0.05
"""Share of its way that a bead may slide and is still said to roll."""
_FRACTIONS = {
    1.0 / 4.0: "a quarter",
    1.0 / 3.0: "a third",
    1.0 / 2.0: "half",
    2.0 / 3.0: "two thirds",
    3.0 / 4.0: "three quarters",
}
"""Shares that have a name."""
_CLOSE = 0.02
"""Difference up to which a share has the name of a fraction."""


class _Verb(NamedTuple):
    """What one bead does, and the same of several beads."""

    of_one: str
    of_several: str


_RESTS = _Verb("rests", "rest")
_SPINS = _Verb("spins in place", "spin in place")
_ROLLS = _Verb("rolls", "roll")
_SLIDES = _Verb("slides", "slide")
_SLIDES_ROLLING_BACKWARD = _Verb("slides and turns backward", "slide and turn backward")
_TURNS_TOO_FAST = _Verb("turns faster than it moves", "turn faster than they move")


def motion_in_words(numbers: Mapping[str, Any]) -> str:
    """Say what the beads of walkers do on their wall.

    Parameters
    ----------
    numbers
        The numbers of a result, SI units.

    Returns
    -------
    str
        Such as ``the large bead rolls, the small bead slides a third of the way``. Empty if the
        means over the walkers say nothing about a bead: in piles, under a ramp, for walkers of
        several kinds, and if walkers came apart, turned, or walk differently to both sides.
    """
    if headline(numbers) != "velocity" or numbers.get("came_apart"):
        return ""
    if "stops_at" in numbers or numbers.get("turned_round"):
        return ""
    if any(name.startswith("walkers_make_") for name in numbers):
        return ""
    verbs = {}
    bead = 1
    while f"rotation_{bead}" in numbers and f"sliding_{bead}" in numbers:
        verb = _verb_of(numbers[f"rotation_{bead}"], numbers[f"sliding_{bead}"])
        verbs[_name_of_bead(bead, numbers)] = verb
        bead += 1
    different = set(verbs.values())
    if len(verbs) > 1 and len(different) == 1:
        subject = "both beads" if len(verbs) == 2 else "all beads"
        return f"{subject} {different.pop().of_several}"
    return ", ".join(f"{name} {verb.of_one}" for name, verb in verbs.items())


def _name_of_bead(bead: int, numbers: Mapping[str, Any]) -> str:
    """What a bead is called: the large or the small one of a dimer, otherwise by its number."""
    if "sin_delta" not in numbers:  # no dimers
        return f"bead {bead}"
    radius = numbers[f"radius_{bead}"]
    other_radius = numbers[f"radius_{3 - bead}"]
    if radius == other_radius:
        return f"bead {bead}"
    return "the large bead" if radius > other_radius else "the small bead"


def _verb_of(rotation: float, sliding: float) -> _Verb:
    """What a bead does, from its rolling velocity −R dφ/dt and its sliding velocity, m/s."""
    velocity = rotation + sliding
    if abs(velocity) < REST:
        return _RESTS if abs(rotation) < REST else _SPINS
    share = sliding / velocity
    if share < -_NEARLY:
        return _TURNS_TOO_FAST
    if share < _NEARLY:
        return _ROLLS
    if share > 1.0 + _NEARLY:
        return _SLIDES_ROLLING_BACKWARD
    if share > 1.0 - _NEARLY:
        return _SLIDES
    part = f"{_fraction_text(share)} of the way"
    return _Verb(f"slides {part}", f"slide {part}")


def _fraction_text(share: float) -> str:
    """A share as a fraction in words if it is close to one, otherwise in per cent."""
    for fraction, name in _FRACTIONS.items():
        if abs(share - fraction) < _CLOSE:
            return name
    return f"{100.0 * share:.0f} %"
