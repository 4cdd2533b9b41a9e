"""Laws of users: their files are executed, and the curves that they return are checked."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

from walkers.arrays import FloatArray
from walkers.physics.bridge import BridgeLaw, Curve, Forces, Surfaces, UnusableLawError, columns_at

_FARTHEST = 10.0
"""Largest rupture distance, over the radius of the smaller bead."""


def load_law(name: str, file: Path) -> BridgeLaw:
    """Execute a user's file and return its law, whose curves are checked whenever they are made.

    Parameters
    ----------
    name
        The law as a case names it, ``path/to/file.py:function``.
    file
        The path of the file.

    Raises
    ------
    ValueError
        If the file has no such function, raises an error or exits.
    """
    function = name.rpartition(":")[2]
    # Not imported: Python takes an edited file of the same length and second for the former one.
    law = _called(runpy.run_path, str(file)).get(function)
    if not callable(law):
        raise ValueError(f"bridge law {name!r}: {file} has no function {function}")
    return lambda surfaces: _curve(law, surfaces)


def _curve(law: BridgeLaw, surfaces: Surfaces) -> Curve:
    """The curve that a law returns for two surfaces.

    `walkers.physics.bridge.columns_at` checks its forces whenever they are evaluated. Raises
    `UnusableLawError` if the law does not return a curve, or if its bridge breaks at a gap above
    `_FARTHEST` radii of the smaller bead.
    """
    curve = _called(law, surfaces)
    if not isinstance(curve, Curve):
        returned = type(curve).__name__
        raise UnusableLawError(f"returns {returned}; expected walkers.physics.bridge.Curve")
    farthest = _FARTHEST * surfaces.radius
    if curve.rupture > farthest:
        breaks = f"the bridge breaks at a gap of {curve.rupture:g} m"
        raise UnusableLawError(f"{breaks}; expected at most {farthest:g} m")

    def forces(gaps: FloatArray) -> Forces:
        columns = _called(columns_at, curve, gaps)  # one column for each field of `Forces`
        return Forces(*columns.T)

    return Curve(forces, curve.rupture, curve.formation, curve.scale)


def _called(function: Callable[..., Any], *arguments: object) -> Any:
    """The value of a user's function; `UnusableLawError` if it raises an error or exits."""
    try:
        return function(*arguments)
    except (UnusableLawError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise UnusableLawError(f"raises {type(error).__name__}: {error}") from error
