"""Cases: what is shaken, in physical units, read from TOML and validated.

The first room of the project: it knows nothing of the engine's language.
"""

from inputs.case import WalkerCase
from inputs.errors import InputError, Problem, WalkersError
from inputs.reading import load_case, resolve_case, shipped_cases

__all__ = ["InputError", "Problem", "WalkerCase", "WalkersError", "load_case", "resolve_case", "shipped_cases"]
