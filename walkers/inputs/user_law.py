"""Laws of users: their files are executed, and the curves that they return are checked."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

from walkers.arrays import FloatArray
from walkers.physics.bridge import BridgeLaw, Curve, Forces, Surfaces, UnusableLawError, columns_at

_FARTHEST = 10.0
"""Largest rupture distance, in radii of the smaller bead."""


def loaded(name: str, file: Path) -> BridgeLaw:
    """The function of a file; its curves are checked (`_curve`).

    Raises `ValueError` if there is none, or if its file raises an error or exits.
    """
    function = name.rpartition(":")[2]
    # Not as Python imports a file, which takes an edited one of the same length and second for the former one.
    law = _called(runpy.run_path, str(file)).get(function)
    if not callable(law):
        raise ValueError(f"bridge law {name!r}: {file} has no function {function}")
    return lambda surfaces: _curve(law, surfaces)


def _curve(law: BridgeLaw, surfaces: Surfaces) -> Curve:
    """The curve of a law; `UnusableLawError` if it, or its forces, cannot be used, or it reaches beyond `_FARTHEST`."""
    given = _called(law, surfaces)
    if not isinstance(given, Curve):
        raise UnusableLawError(
            f"returns {type(given).__name__}; expected walkers.physics.bridge.Curve"
        )
    if given.rupture > (farthest := _FARTHEST * surfaces.radius):
        raise UnusableLawError(
            f"the bridge breaks at a gap of {given.rupture:g} m; expected at most {farthest:g} m"
        )

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
