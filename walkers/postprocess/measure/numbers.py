"""Numbers of results as rows of text: of the printed result, reports and notebooks.

It decides which numbers of a result are shown, how they are called, and with how many digits.
Names, units and meanings are declared in `walkers.postprocess.measure.quantities`. Bands and their
draws are explained in `walkers.postprocess.measure.uncertainty`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import isfinite, nan
from typing import Any

from walkers.postprocess.measure.quantities import (
    LABELS,
    SHOWN,
    Quantity,
    declared,
    is_error,
    ordered,
    unit_shown,
)
from walkers.postprocess.measure.sides import REST, direction_names
from walkers.postprocess.measure.tables import Columns
from walkers.rounding import counted, rounded, with_decimals


@dataclass(frozen=True)
class Measurement:
    """What a module measures.

    Attributes
    ----------
    tables
        Columns of its tables by the names of the tables.
    numbers
        Numbers in SI units, by the names of `walkers.postprocess.measure.quantities.GROUPS`. A
        number that is not defined is None or NaN.
    warnings
        Reasons to doubt the numbers.
    """

    tables: Mapping[str, Columns]
    numbers: Mapping[str, Any]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """A number of a result as text.

    Attributes
    ----------
    name
        Its name in the result.
    label
        What it is called.
    text
        Its value in the displayed unit.
    unit
        The displayed unit.
    error
        Its errors in this unit, with words; empty if it has none.
    """

    name: str
    label: str
    text: str
    unit: str
    error: str = ""


MAIN_NUMBERS = ("velocity", "right_facing", "axial_velocity", "climbs", "highest", "speed")
"""Main numbers of results, for which a spread measures bands."""
NOT_SHOWN_ALONE = SHOWN["aside"]
"""Numbers that are not shown by themselves: errors of others, values of the case, conditions."""


def headline(numbers: Mapping[str, Any]) -> str:
    """Name the main number of a result.

    Parameters
    ----------
    numbers
        The numbers of a result.

    Returns
    -------
    str
        ``climbs`` for piles. For walkers ``velocity``; ``right_facing`` if the velocity of those
        that face right (up) differs from that of the others; ``axial_velocity``, that up the slope,
        if some do not stay upright. Empty without walkers and piles.
    """
    if "velocity" in numbers:
        if not_all_upright(numbers):
            return "axial_velocity"
        if numbers.get("facings_differ"):
            return "right_facing"
        return "velocity"
    if "climbs" in numbers:
        return "climbs"
    return ""


def not_all_upright(numbers: Mapping[str, Any]) -> bool:
    """Tell whether walkers turned over or lean on a slope.

    Then a velocity along the heading says little about where they go.
    """
    return "upright" in numbers and bool(numbers["upright"] < numbers["walkers"])


AT_REST = "at rest"
"""State of walkers that are slower than `REST`."""


def state(numbers: Mapping[str, Any]) -> str:
    """Describe the state of walkers whose mean velocity is not informative.

    Parameters
    ----------
    numbers
        The numbers of a result.

    Returns
    -------
    str
        The first that applies: ``came apart``; under a ramp the thresholds, such as ``stops at
        0.8 g``, or that there is none; for walkers that may meet how many are slow and in clusters;
        ``at rest`` below `REST`. Empty if the velocity says more.
    """
    if numbers.get("came_apart"):
        return "came apart"
    thresholds = []
    for verb in ("stops", "starts"):
        peak_acceleration = numbers.get(f"{verb}_at", nan)
        if isfinite(peak_acceleration):
            text, unit = text_and_unit(peak_acceleration, "m/s^2")
            thresholds.append(f"{verb} at {text} {unit}")
    if thresholds:
        return ", ".join(thresholds)
    if "stops_at" in numbers:  # under a ramp, with no threshold
        return "no threshold within the ramp"
    if isfinite(numbers.get("slow_share", nan)):
        walkers = numbers["walkers"]
        slow = round(walkers * numbers["slow_share"])
        clustered = round(walkers * numbers["clustered_share"])
        return f"{slow} of {walkers} walkers slow, {clustered} in clusters"
    if "velocity" in numbers and abs(numbers[headline(numbers)]) < REST:
        return AT_REST
    return ""


def short_text(numbers: Mapping[str, Any]) -> str:
    """Say the state or the main number of a result in a few words.

    Parameters
    ----------
    numbers
        The numbers of a result.

    Returns
    -------
    str
        Such as ``3 climbs`` or ``1.080 mm/s``; a dash without walkers and piles.
    """
    main = headline(numbers)
    if main == "":
        return "-"
    if main == "climbs":
        return counted(numbers[main], "climb")
    state_of_walkers = state(numbers)
    if state_of_walkers:
        return state_of_walkers
    velocity, _ = text_and_unit(numbers[main], "m/s")
    if main == "right_facing":
        right, left = direction_names(uphill=numbers["goes_uphill"])
        left_velocity, _ = text_and_unit(numbers["left_facing"], "m/s")
        return f"{velocity} mm/s facing {right}, {left_velocity} facing {left}"
    if main == "axial_velocity":
        return f"{velocity} mm/s up the slope"
    return f"{velocity} mm/s"


def rows(numbers: Mapping[str, Any]) -> list[Row]:
    """Write the numbers of a result as text.

    Parameters
    ----------
    numbers
        The numbers of a result in SI units, NaN where undefined.

    Returns
    -------
    list of Row
        The numbers in displayed units, in the order of their declarations.

    Notes
    -----
    These have no row:

    - texts, truth values, and numbers that are not finite;
    - what another row or a warning has: errors and bands, values of the case, conditions;
    - counts and shares of exceptions if they are zero (``if_any`` in ``quantities.toml``);
    - numbers that would mislead: velocities and steadiness of walkers that came apart, means over
      two directions that differ or under a ramp, and the mean final angle if only some walkers
      turned round.
    """
    listed = []
    for name in ordered(numbers.keys() - _hidden_numbers(numbers)):
        number = numbers[name]
        if isinstance(number, (bool, str)) or not isfinite(number) or is_error(name):
            continue
        if number == 0 and _matches_any(name, SHOWN["if_any"]):
            continue
        quantity = declared(name)
        label = _label(quantity, numbers)
        text, unit = text_and_unit(number, quantity.unit)
        listed.append(Row(name, label, text, unit, _errors(numbers, quantity)))
    return listed


def important_rows(numbers: Mapping[str, Any]) -> list[Row]:
    """The most important of the `rows` of a result, without the main number that is said above.

    Parameters
    ----------
    numbers
        The numbers of a result in SI units, NaN where undefined.
    """
    names = SHOWN["important"]
    if numbers.get("facings_differ"):
        names |= {"right_facing", "left_facing"}
    if not_all_upright(numbers):
        names |= {"axial_velocity", "axial_left_facing"}
    if state(numbers):
        names |= {headline(numbers)}
    return [row for row in rows(numbers) if _matches_any(row.name, names)]


def main_errors(numbers: Mapping[str, Any]) -> str:
    """The band and the numerical error of the main number of a result; empty if it has neither."""
    main = headline(numbers)
    if not main:
        return ""
    return ", ".join(_computed_errors(numbers, declared(main)))


def _hidden_numbers(numbers: Mapping[str, Any]) -> set[str]:
    """Names of the numbers of a result that have no row."""
    main = headline(numbers)
    hidden = set(NOT_SHOWN_ALONE | SHOWN["hidden"])
    if main == "axial_velocity" or (main == "right_facing" and numbers["goes_uphill"]):
        hidden -= {"axial_velocity", "axial_left_facing"}
    if not_all_upright(numbers):
        hidden |= {"right_facing", "left_facing"}
    if not (numbers.get("facing_right") and numbers.get("facing_left")):
        # The velocity is that of the only direction.
        hidden |= {"right_facing", "left_facing", "axial_left_facing"}
    if main != "velocity":
        hidden.add("velocity")
    if 0 < numbers.get("turned_round", 0) < numbers.get("walkers", 0):
        hidden.add("orientation_end")
    return hidden | meaningless_numbers(numbers)


def _matches_any(name: str, patterns: Collection[str]) -> bool:
    """Tell whether a name matches one of some patterns with ``*``."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def meaningless_numbers(numbers: Mapping[str, Any]) -> set[str]:
    """Names of the numbers that say nothing about walkers that came apart or under a ramp."""
    patterns: set[str] = set()
    if "stops_at" in numbers:
        patterns |= SHOWN["not_of_a_ramp"]
    if numbers.get("came_apart"):
        patterns |= SHOWN["not_of_parts"]
    return {name for name in numbers if _matches_any(name, patterns)}


def _label(quantity: Quantity, numbers: Mapping[str, Any]) -> str:
    """Label of a number.

    On a slope, right and left are called up and down, and means over the walkers that face up say
    so.
    """
    ground = "slope" if numbers.get("goes_uphill", False) else "level"
    labels = LABELS.get(quantity.name, {})
    label = labels.get(ground, quantity.label)
    if ground == "slope" and leaves_out_facing_down(quantity, numbers):
        return f"{label}, facing up"
    return label


def leaves_out_facing_down(quantity: Quantity, numbers: Mapping[str, Any]) -> bool:
    """Tell whether a number leaves out walkers that face down a slope, if there are any.

    Parameters
    ----------
    quantity
        The quantity of the number.
    numbers
        The numbers of the result.
    """
    is_mean_over_up = _matches_any(quantity.name, SHOWN["facing_up"])
    return bool(numbers["goes_uphill"] and numbers.get("facing_left") and is_mean_over_up)


def text_and_unit(number: float, unit: str) -> tuple[str, str]:
    """Write a number as text in the displayed unit.

    Parameters
    ----------
    number
        The number in SI units.
    unit
        Its SI unit.

    Returns
    -------
    text, unit : str
        The number and the displayed unit. Velocities have all decimals.
    """
    displayed_unit, factor = unit_shown(unit)
    value = number if factor == 1.0 else number * factor
    if displayed_unit == "mm/s":
        return with_decimals(value, 3), displayed_unit
    return rounded(value, displayed_unit), displayed_unit


def _errors(numbers: Mapping[str, Any], quantity: Quantity) -> str:
    """Errors of a number in its displayed unit, with words.

    They are the scatter or the resolution, the band and the numerical error; for the final angle,
    also the range of the walkers.
    """
    parts = []
    if quantity.name == "orientation_end" and numbers["walkers"] > 1:
        smallest, _ = text_and_unit(numbers["orientation_smallest"], quantity.unit)
        largest, _ = text_and_unit(numbers["orientation_largest"], quantity.unit)
        parts.append(f"from {smallest} to {largest} among walkers")
    scatter = numbers.get(quantity.error, nan)
    if isfinite(scatter):
        word = "resolution" if quantity.error.endswith("_within") else "scatter of copies"
        parts.append(f"{word} {error_text(scatter, quantity.unit)}")
    parts += _computed_errors(numbers, quantity)
    return ", ".join(parts)


def _computed_errors(numbers: Mapping[str, Any], quantity: Quantity) -> list[str]:
    """The band and the numerical error of a number in its displayed unit, with words."""
    parts = []
    band = band_of(numbers, quantity)
    if band:
        parts.append(band)
    error = numbers.get(f"{quantity.name}_error", nan)
    if isfinite(error):
        parts.append(f"numerical error {error_text(error, quantity.unit)}")
    return parts


def error_text(error: float, unit: str) -> str:
    """Write an error (in this SI unit) with two digits in the displayed unit, without the unit."""
    displayed_unit, factor = unit_shown(unit)
    text = rounded(float(f"{error * factor:.2g}"), displayed_unit)
    return "below 0.001" if text == "0" and displayed_unit == "mm/s" else text


def band_of(numbers: Mapping[str, Any], quantity: Quantity) -> str:
    """Write the band of a number in the displayed unit, with the number of its draws.

    Parameters
    ----------
    numbers
        The numbers of a result.
    quantity
        The quantity of the number.

    Returns
    -------
    str
        Such as ``band 0.489 to 5.83 (40 draws)``; empty if the number has no band.
    """
    name = quantity.name
    low = numbers.get(f"{name}_low")
    high = numbers.get(f"{name}_high")
    if low is None or high is None:
        return ""
    draws = draws_text(numbers[f"{name}_draws"], approximate=numbers[f"{name}_approximate"])
    return f"band {band_text(low, high, quantity.unit)} ({draws})"


def draws_text(draws: object, *, approximate: bool) -> str:
    """Say how many draws a band has, and whether it is approximate because they are few."""
    return f"{draws} draws, approximate" if approximate else f"{draws} draws"


def band_text(low: float, high: float, unit: str) -> str:
    """Write both ends of a band (in this SI unit) with three digits: ``0.489 to 5.83``.

    The ends are in the displayed unit, which the text does not have.
    """
    displayed_unit, factor = unit_shown(unit)
    low_text = rounded(float(f"{low * factor:.3g}"), displayed_unit)
    high_text = rounded(float(f"{high * factor:.3g}"), displayed_unit)
    return f"{low_text} to {high_text}"
