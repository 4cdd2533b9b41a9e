"""Uncertainty of a result: unmeasured values, and the band of the result over their ranges.

A *spread* makes a run many times, each time with values that are drawn from the ranges of the
uncertain ones: each of these runs is a *draw*. The *band* of a number contains the middle 90 % of
the draws.

This module reads what `walkers.sweeps.spread` and `walkers.sweeps.accuracy` have written beside and
in a run directory. It runs nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from walkers.errors import input_error
from walkers.files import read_json
from walkers.inputs.origins import Origin
from walkers.inputs.resolving.from_library import OF_LIQUIDS
from walkers.inputs.resolving.library import unmeasured
from walkers.inputs.units import with_symbols
from walkers.runner.manifest import check_unchanged
from walkers.terminal import wrapped

SPREAD = "-spread"
"""End of the name of the directory of a spread (`spread_of`)."""
SPREAD_TITLE = ": uncertain values drawn from their ranges"
"""End of the title of a spread, after the condition of its run."""
SPREAD_NAME = "spread.json"
"""Name of the file with the bands in the directory of a spread."""
ACCURACY = "-accuracy"
"""End of the name of the sweep that measures numerical errors."""
ACCURACY_TITLE = ": smaller time steps and harder beads"
"""End of the title of the sweep that measures numerical errors, after the condition of its run."""
ACCURACY_NAME = "accuracy.json"
"""Name of the file with the numerical errors in a run directory."""
LEAST_PER_VALUE = 3
"""Least number of draws per varied value (`few_draws`)."""
OF_OTHERS = "not of these materials and this liquid"
"""What guessed values are."""
_LEAST = 6
"""Least number of draws: of five, no rank correlation is larger than two standard errors, 2/√4."""
_PAGE_WIDTH = 110
"""Width of lines in reports, characters."""
_HEAD_WIDTH = 13
"""Width of the head beside which wrapped lines stand, characters."""
_HEADS = ("guessed", "uncertain", "given", "calibrated", "assumed", "library", "own library")
"""Heads of the lines of `uncertain_value_lines`, in their order."""


def uncertain_values(origins: Sequence[Origin]) -> list[dict[str, Any]]:
    """List the values of a case that nobody has measured, and those that it calls uncertain.

    The velocity of half of a rise of friction is listed with an uncertain rise, which says nothing
    without it.

    Parameters
    ----------
    origins
        Sources of the values of the case.

    Returns
    -------
    list of dict
        For each value ``key``, ``value`` (as in a case file), ``origin`` (``given``, ``library``,
        ``calibrated``, ``assumed`` or ``default``), ``range`` (both ends, or None),
        ``logarithmic``, and whether it is ``guessed``.
    """
    with_range = {origin.key for origin in origins if origin.range is not None}
    values = []
    for origin in origins:
        table, _, name = origin.key.rpartition(".")
        is_of_rise = name == "half_rise_velocity" and f"{table}.rise" in with_range
        if not (is_of_rise or origin.key in unmeasured() or origin.key in with_range):
            continue
        values.append(
            {
                "key": origin.key,
                "value": origin.text,
                "origin": origin.origin,
                "range": list(origin.range) if origin.range else None,  # a list, as in the file
                "logarithmic": origin.logarithmic,
                # A velocity of half of a rise has no range.
                "guessed": origin.guessed or origin.origin == "default",
            }
        )
    return values


def uncertain_value_lines(
    values: Sequence[Mapping[str, Any]], width: int = _PAGE_WIDTH
) -> list[str]:
    """Write uncertain values as lines, by their origin.

    Parameters
    ----------
    values
        Values of `uncertain_values`.
    width
        Width of the lines, characters; default: that of lines in reports.

    Returns
    -------
    list of str
        The lines; none without values.
    """
    values_by_head: dict[str, list[str]] = {}
    for value in values:
        values_by_head.setdefault(_head_of(value), []).append(_value_text(value))
    if "guessed" in values_by_head:
        values_by_head["guessed"][-1] += f" ({OF_OTHERS})"
    lines: list[str] = []
    for head in _HEADS:
        if head in values_by_head:
            lines += wrapped_lines(f"  {head:10} {', '.join(values_by_head[head])}", width)
    return lines


def _head_of(value: Mapping[str, Any]) -> str:
    """The head below which an uncertain value is listed."""
    if not value["guessed"]:
        return str(value["origin"])
    return "guessed" if value["origin"] == "default" else "uncertain"


def _value_text(value: Mapping[str, Any]) -> str:
    """An uncertain value with its key in its table: ``bead_wall 0.25``."""
    _, _, key_in_table = value["key"].partition(".")
    return f"{key_in_table} {with_symbols(str(value['value']))}"


def guesses(values: Sequence[Mapping[str, Any]]) -> list[str]:
    """Write the uncertain values that the program guessed: ``bead_wall 0.25``.

    Parameters
    ----------
    values
        Values of `uncertain_values`.
    """
    guessed = [value for value in values if _head_of(value) == "guessed"]
    return [_value_text(value) for value in guessed]


def wrapped_lines(text: str, width: int | None = None) -> list[str]:
    """Wrap a text; its further lines stand beside its head of 13 characters.

    Lines have the width of the terminal unless a ``width`` is given.
    """
    return wrapped(text, " " * _HEAD_WIDTH, width)


def fixed_values(origins: Sequence[Origin]) -> tuple[Origin, ...]:
    """Values that a spread keeps fixed, because they have no range.

    Parameters
    ----------
    origins
        Sources of the values of a case.

    Returns
    -------
    tuple of Origin
        Those of the liquid, and other unmeasured ones.
    """
    keys = {"liquid.name", *OF_LIQUIDS, *unmeasured()}
    without_range = [value for value in origins if value.key in keys and not value.range]
    return tuple(value for value in without_range if value.origin != "derived")


def fixed_values_text(values: Sequence[Origin]) -> str:
    """Write the values that a spread keeps fixed.

    Parameters
    ----------
    values
        Values of `fixed_values`.

    Returns
    -------
    str
        The values of the liquid, its name, and the other values.
    """
    liquid = _key_and_value(values, OF_LIQUIDS)
    if liquid:
        names = [f" ({value.text})" for value in values if value.key == "liquid.name"]
        liquid += "".join(names)
    unmeasured_values = _key_and_value(values, unmeasured())
    listed = ", ".join(text for text in (liquid, unmeasured_values) if text)
    rest = "all other values; to vary one, add its range in [uncertain]"
    return f"{listed} and {rest}" if listed else rest


def _key_and_value(values: Sequence[Origin], keys: Collection[str]) -> str:
    """The values that have some keys, as text."""
    listed = [f"{value.key} {value.text}" for value in values if value.key in keys]
    return with_symbols(", ".join(listed))


def few_draws(draws: int, values: int) -> bool:
    """Tell whether a spread has too few draws for the number of its varied values.

    Then its bands are approximate, and its rank correlations are not significant.
    """
    return draws < max(_LEAST, LEAST_PER_VALUE * values)


def spread_of(directory: Path) -> Path:
    """The directory of the spread of a run (`walkers.sweeps.spread`); it need not exist."""
    return directory.with_name(f"{directory.name}{SPREAD}")


def bands_of(
    directory: Path, values: Sequence[Mapping[str, Any]], numbers: Mapping[str, Any]
) -> dict[str, float]:
    """Read the bands of numbers from the spread beside a run.

    Parameters
    ----------
    directory
        The run directory.
    values
        The uncertain values of the case (`uncertain_values`). The spread counts only if it is over
        their ranges.
    numbers
        The numbers of the result, SI units.

    Returns
    -------
    dict of str to float
        ``velocity_low``, ``velocity_high``, ``velocity_draws``, ``velocity_approximate``, …; empty
        without such a spread, or if its file cannot be read. A band is extended to the number of
        the case, which is usually in it, because a spread draws half of the values below and half
        above those of the case.
    """
    bands: dict[str, float] = {}
    try:
        spread = read_json(spread_of(directory.resolve()) / SPREAD_NAME)
        ranges = _ranges(spread["varied"])
        if ranges == _ranges(values):
            for name, band in spread["bands"].items():
                bands |= _band_numbers(name, band, numbers.get(name), len(ranges))
    except (OSError, ValueError, KeyError, TypeError):
        pass  # there is no spread, or its file is damaged; bands read before count
    return bands


def _ranges(values: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Ranges of uncertain values by their keys."""
    return {value["key"]: value["range"] for value in values if value["range"]}


def _band_numbers(
    name: str, band: Mapping[str, Any], number: float | None, varied_values: int
) -> dict[str, float]:
    """Both ends of a band, which contains the number of the case, and its draws."""
    ends = [band["low"], band["high"]]
    if number is not None and isfinite(number):
        ends.append(number)
    return {
        f"{name}_low": min(ends),
        f"{name}_high": max(ends),
        f"{name}_draws": band["points"],
        f"{name}_approximate": few_draws(band["points"], varied_values),
    }


def accuracy_of(directory: Path) -> dict[str, Any]:
    """Read the recorded numerical errors of a run (`walkers.sweeps.accuracy`).

    Parameters
    ----------
    directory
        The run directory.

    Returns
    -------
    dict
        The contents of ``accuracy.json``; empty if there is no such file.

    Raises
    ------
    InputError
        If the file was edited or is damaged.
    """
    path = directory / ACCURACY_NAME
    if not path.is_file():
        return {}
    try:
        contents = read_json(path)
        check_unchanged(directory, [ACCURACY_NAME])
    except (OSError, ValueError) as error:
        raise input_error(
            path,
            f"was edited or is damaged; measure it again with: walkers run {directory} --accuracy",
        ) from error
    return contents
