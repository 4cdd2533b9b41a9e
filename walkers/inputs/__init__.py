"""Cases in physical units, read from TOML and validated.

It stands on the laws alone (`walkers.physics`) and knows nothing of the engine's language.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from walkers.exporting import exporting
from walkers.inputs.errors import InputError, Problem, WalkersError

if TYPE_CHECKING:
    from walkers.inputs.case import Case
    from walkers.inputs.reading import load_case, resolve_case, shipped_cases

__all__ = ["Case", "InputError", "Problem", "WalkersError", "load_case", "resolve_case", "shipped_cases"]

__getattr__ = exporting(__name__, case=["Case"], reading=["load_case", "resolve_case", "shipped_cases"])
