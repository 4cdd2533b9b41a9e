"""Uncertainty of a result: unmeasured values, and the band of the result over their ranges."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Any

from walkers.errors import input_error
from walkers.files import read_json
from walkers.inputs.origins import Origin
from walkers.inputs.resolving.from_library import OF_LIQUIDS
from walkers.inputs.resolving.library import unmeasured
from walkers.runner.manifest import check_unchanged

SPREAD = "-spread"
SPREAD_NAME = "spread.json"
"""End of the name of a spread's directory (`spread_of`), and name of the file with the bands in it."""
ACCURACY = "-accuracy"
ACCURACY_NAME = "accuracy.json"
"""End of the name of the sweep that measures numerical errors, and name of the file with them in the run."""
LEAST_PER_VALUE = 3
"""Least number of draws per varied value (`few_draws`)."""
_LEAST = 6
"""Least number of draws: of five, no rank correlation is larger than two standard errors, 2/√4."""
_WIDTH = 110


def uncertain_values(origins: Sequence[Origin]) -> list[dict[str, Any]]:
    """Unmeasured values of a case, and values that it calls uncertain.

    Each has a ``key``, ``value`` (as in a case file), ``origin`` (``given``, ``library``, ``calibrated``, ``assumed``
    or ``default``), ``range`` (both ends, or None), ``logarithmic``, and whether it is ``guessed``.
    """
    return [
        {
            "key": value.key,
            "value": value.text,
            "origin": value.origin,
            "range": list(value.range) if value.range else None,  # a list, as in the file
            "logarithmic": value.logarithmic,
            "guessed": value.guessed,
        }
        for value in origins
        if value.key in unmeasured() or value.range is not None
    ]


_HEADS = ("guessed", "uncertain", "given", "calibrated", "assumed", "library", "own library")


def uncertain_value_lines(rests: Sequence[Mapping[str, Any]]) -> list[str]:
    """The uncertain values of a result (`uncertain_values`) as text, by origin; those of other materials are guessed."""
    listed: dict[str, list[str]] = {}
    for value in rests:
        guess = "guessed" if value["origin"] == "default" else "uncertain"
        values = listed.setdefault(guess if value["guessed"] else value["origin"], [])
        values.append(f"{value['key'].partition('.')[2]} {value['value']}")
    if "guessed" in listed:
        listed["guessed"][-1] += " (not of these materials and this liquid)"
    texts = [f"  {head:10} {', '.join(listed[head])}" for head in _HEADS if head in listed]
    return [line for text in texts for line in wrapped_lines(text)]


def guesses(rests: Sequence[Mapping[str, Any]]) -> list[str]:
    """Values of a result (`uncertain_values`) that the program guessed, as text: ``friction.bead_wall 0.25``."""
    return [
        f"{value['key'].partition('.')[2]} {value['value']}"
        for value in rests
        if value["guessed"] and value["origin"] == "default"
    ]


def wrapped_lines(text: str) -> list[str]:
    """A text beside a head of 13 letters, in lines for a terminal."""
    return textwrap.wrap(text, _WIDTH, subsequent_indent=" " * 13, break_on_hyphens=False)


def fixed_values(origins: Sequence[Origin]) -> tuple[Origin, ...]:
    """Values of a case without a range, which a spread holds fixed: those of the liquid, and other unmeasured ones."""
    keys = {"liquid.name", *OF_LIQUIDS, *unmeasured()}
    return tuple(
        value
        for value in origins
        if value.key in keys and value.origin != "derived" and not value.range
    )


def fixed_values_text(held: Sequence[Origin]) -> str:
    """Values that a spread holds fixed (`fixed_values`), those of the liquid first and with its name."""
    name = "".join(f" ({value.text})" for value in held if value.key == "liquid.name")
    of_liquid, unknown = (
        ", ".join(f"{value.key} {value.text}" for value in held if value.key in keys)
        for keys in (OF_LIQUIDS, unmeasured())
    )
    listed = ", ".join(filter(None, [f"{of_liquid}{name}" if of_liquid else "", unknown]))
    return f"{listed}{' and ' if listed else ''}all other values; to vary one, add its range in [uncertain]"


def few_draws(draws: int, values: int) -> bool:
    """Whether draws of some values are too few: the band is approximate, and rank correlations are not significant."""
    return draws < max(_LEAST, LEAST_PER_VALUE * values)


def spread_of(directory: Path) -> Path:
    """The directory of the spread of a run (`walkers.sweeps.spread`); it need not exist."""
    return directory.with_name(f"{directory.name}{SPREAD}")


def bands_of(
    directory: Path, rests: Sequence[Mapping[str, Any]], numbers: Mapping[str, Any]
) -> dict[str, float]:
    """Bands of numbers (SI) by the spread beside a run: ``velocity_low``, ``velocity_high``, ``velocity_draws``, ….

    The spread must be over the ranges of the uncertain values ``rests``. A band is extended to the number of the case,
    which is usually in it, because a spread draws half of the values below and half above those of the case.
    """
    bands: dict[str, float] = {}
    with suppress(OSError, ValueError, KeyError, TypeError):
        spread = read_json(spread_of(directory.resolve()) / SPREAD_NAME)
        drawn, ranges = (
            {value["key"]: value["range"] for value in part if value["range"]}
            for part in (spread["varied"], rests)
        )
        for name, band in spread["bands"].items() if drawn == ranges else ():
            number = numbers.get(name)
            ends = [
                band["low"],
                band["high"],
                *([number] if number is not None and isfinite(number) else []),
            ]
            bands |= {
                f"{name}_low": min(ends),
                f"{name}_high": max(ends),
                f"{name}_draws": band["points"],
            }
            bands[f"{name}_approximate"] = few_draws(band["points"], len(drawn))
    return bands


def accuracy_of(directory: Path) -> dict[str, Any]:
    """The recorded numerical errors of a run (`walkers.sweeps.accuracy`), if any; `InputError` for edited files."""
    if not (directory / ACCURACY_NAME).is_file():
        return {}
    try:
        contents = read_json(directory / ACCURACY_NAME)
        check_unchanged(directory, [ACCURACY_NAME])
        return contents
    except (OSError, ValueError) as error:
        text = "was edited or is damaged; measure it again with"
        raise input_error(
            directory / ACCURACY_NAME, f"{text}: walkers run {directory} --accuracy"
        ) from error
