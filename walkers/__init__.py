"""Wet granular walkers, simulated with LIGGGHTS: the front door to the four rooms of the project.

`run_case` takes a case from file to result as ``walkers run`` does. The rooms are `inputs` (cases), `templates`
(decks), `runner` (run directories) and `postprocess` (what runs mean); each can be used by itself.
"""

from walkers.pipeline import Outcome, find_run, run_case

__all__ = ["Outcome", "find_run", "run_case"]
