"""Laws of users: their files are executed, and what they return is checked."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from walkers.physics.bridge import BridgeLaw, Curve, FloatArray, Forces, Surfaces, UnusableLawError, columns_at

_FARTHEST = 10.0
"""Largest rupture distance, in radii of the smaller bead."""


def loaded(name: str, place: str) -> Sequence[BridgeLaw]:
    """The function of a module, or of a file that is executed twice, so that numbers left to chance are detected.

    Raises `ValueError` if there is none, or if its file raises an error or exits.
    """
    function = name.rpartition(":")[2]
    modules = [_executed(place), _executed(place)] if place.endswith(".py") else [_called(import_module, place)]
    laws = [getattr(module, function, None) for module in modules]
    if not all(map(callable, laws)):
        raise ValueError(f"bridge law {name!r}: {place} has no function {function}")
    return laws  # type: ignore[return-value]


def checked(laws: Sequence[BridgeLaw]) -> BridgeLaw:
    """A law that checks its curves; ``laws`` are the same law, loaded twice.

    It raises `UnusableLawError` if the law raises an error, returns something else than a `Curve` of usable `Forces`,
    reaches further than `_FARTHEST` radii, or gives other numbers when it is evaluated again.
    """

    def law(surfaces: Surfaces) -> Curve:
        curve, *others = [_curve(one, surfaces) for one in (*laws, laws[0])]
        if any(_numbers(one) != _numbers(curve) for one in others):
            raise UnusableLawError("gives other numbers when it is evaluated again")
        return curve

    return law


def _numbers(curve: Curve) -> list[float]:
    forces = curve.forces(curve.rupture * np.linspace(0.0, 1.0, 9)).columns()
    return [curve.rupture, curve.formation, curve.scale, *forces.ravel().tolist()]


def _curve(law: BridgeLaw, surfaces: Surfaces) -> Curve:
    given = _called(law, surfaces)
    if not isinstance(given, Curve):
        raise UnusableLawError(f"returns {type(given).__name__}; expected walkers.physics.bridge.Curve")
    if given.rupture > (farthest := _FARTHEST * surfaces.radius):
        raise UnusableLawError(f"the bridge breaks at a gap of {given.rupture:g} m; expected at most {farthest:g} m")

    def forces(gaps: FloatArray) -> Forces:
        return Forces(*_called(columns_at, given, gaps).T)

    return Curve(forces, given.rupture, given.formation, given.scale)


def _called(function: Callable[..., Any], *arguments: object) -> Any:
    """What a user's function returns; `UnusableLawError` for its errors, exits among them."""
    try:
        return function(*arguments)
    except (UnusableLawError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise UnusableLawError(f"raises {type(error).__name__}: {error}") from error


def _executed(place: str) -> ModuleType:
    """A file as a module; it is in `sys.modules` while it runs, where its dataclasses look for it."""
    key = f"walkers_law_{place}"
    module = sys.modules[key] = ModuleType(key)
    module.__file__ = place
    try:  # not as Python imports it, which takes an edited file of the same length and second for the former one
        _called(lambda: exec(compile(Path(place).read_bytes(), place, "exec"), vars(module)))
    finally:
        del sys.modules[key]
    return module
