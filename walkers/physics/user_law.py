"""Laws of users: their files are executed, and the curves that they return are checked."""

from __future__ import annotations

import runpy
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from walkers.physics.bridge import BridgeLaw, Curve, FloatArray, Forces, Surfaces, UnusableLawError, columns_at

_FARTHEST = 10.0
"""Largest rupture distance, in radii of the smaller bead."""


def loaded(name: str, place: str) -> Sequence[BridgeLaw]:
    """The function of a module, or of a file that is executed twice, so that numbers left to chance are detected.

    Raises `ValueError` if there is none, or if its file raises an error or exits.
    """
    function, is_file = name.rpartition(":")[2], place.endswith(".py")
    # Not as Python imports a file, which takes an edited one of the same length and second for the former one.
    read = runpy.run_path if is_file else lambda module: vars(import_module(module))
    laws = [_called(read, place).get(function) for _ in range(2 if is_file else 1)]
    if not all(map(callable, laws)):
        raise ValueError(f"bridge law {name!r}: {place} has no function {function}")
    return laws


def checked(laws: Sequence[BridgeLaw]) -> BridgeLaw:
    """A law that checks its curves; ``laws`` are the same law, loaded twice.

    It raises `UnusableLawError` if the law raises an error, returns something else than a `Curve` of usable `Forces`,
    reaches further than `_FARTHEST` radii, or gives other numbers when it is evaluated again.
    """

    def law(surfaces: Surfaces) -> Curve:
        curve, *repeated = [_curve(law, surfaces) for law in (*laws, laws[0])]
        if any(_numbers(law) != _numbers(curve) for law in repeated):
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
    """The value that a user's function returns; `UnusableLawError` for its errors, exits among them."""
    try:
        return function(*arguments)
    except (UnusableLawError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise UnusableLawError(f"raises {type(error).__name__}: {error}") from error
