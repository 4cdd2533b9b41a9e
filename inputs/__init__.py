"""Cases: what is shaken, in physical units, read from TOML and validated.

It stands on the laws alone (`walkers.physics`) and knows nothing of the engine's language.
"""

from walkers.inputs.case import WalkerCase
from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.inputs.pile import PileCase
from walkers.inputs.reading import load_any, load_case, load_pile, resolve_case, resolve_pile_case, shipped_cases

__all__ = [
    "InputError",
    "PileCase",
    "Problem",
    "WalkerCase",
    "WalkersError",
    "load_any",
    "load_case",
    "load_pile",
    "resolve_case",
    "resolve_pile_case",
    "shipped_cases",
]
