"""Cases: what is shaken, in physical units, read from TOML and validated.

It stands on the laws alone (`walkers.physics`) and knows nothing of the engine's language.
"""

from walkers.inputs.case import Case
from walkers.inputs.errors import InputError, Problem, WalkersError
from walkers.inputs.reading import load_case, resolve_case, shipped_cases

__all__ = ["Case", "InputError", "Problem", "WalkersError", "load_case", "resolve_case", "shipped_cases"]
