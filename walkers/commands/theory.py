"""``walkers theory``: what the models predict for a case."""

from __future__ import annotations

import json
from contextlib import suppress
from typing import Any

from walkers.commands.arguments import Case, Json, Out, Set, load
from walkers.pipeline import DEFAULT_OUT


def command(case: Case, settings: Set = None, out: Out = DEFAULT_OUT, as_json: Json = False) -> None:
    """Print what the paper's model and its extensions predict, beside the engine's result if the case was run."""
    from walkers.inputs.errors import InputError, Problem
    from walkers.pipeline import find_run
    from walkers.runner.failures import EngineMissing
    from walkers.theory.prediction import describe, predict

    try:
        loaded = load(case, settings)
        prediction = predict(loaded)
    except ValueError as error:
        key, _, told = str(error).partition(": ")
        raise InputError(case, [Problem(key, None, told)]) from error
    result: dict[str, Any] | None = None
    with suppress(InputError, EngineMissing):  # not run yet, or never to be run here
        result = find_run(loaded, out).result
    print(json.dumps({**prediction, "engine": result}, indent=2) if as_json else describe(prediction, result))
