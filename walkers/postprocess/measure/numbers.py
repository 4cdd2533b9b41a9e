"""Numbers of results as rows of text: of the printed result, reports and notebooks."""

from __future__ import annotations

from collections.abc import Mapping
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
from walkers.postprocess.measure.sides import REST
from walkers.postprocess.measure.tables import Columns
from walkers.rounding import counted, rounded, with_decimals


@dataclass(frozen=True)
class Measurement:
    """What a module measures: tables, numbers in SI units, reasons to doubt them.

    Names of numbers are those of `walkers.postprocess.measure.quantities.GROUPS`. A number that is
    not defined is None or NaN.
    """

    tables: Mapping[str, Columns]
    numbers: Mapping[str, Any]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """A number of a result as text: label, value, its displayed unit, and its errors in this unit."""

    name: str
    label: str
    text: str
    unit: str
    error: str = ""


MAIN_NUMBERS = ("velocity", "right_facing", "axial_velocity", "climbs", "highest", "speed")
"""Main numbers, of which a spread measures bands."""
NOT_SHOWN_ALONE = SHOWN["aside"]
"""Numbers that are not shown by themselves: errors of others, values of the case, conditions."""


def headline(numbers: Mapping[str, Any]) -> str:
    """Name of the main number of a result: climbs of piles, or a velocity that walkers have.

    On a slope the velocity up the slope if some walkers do not stay upright; the velocity of those that face right (up)
    if it differs from that of the others. Empty without walkers and piles.
    """
    if "velocity" not in numbers:
        return "climbs" if "climbs" in numbers else ""
    if not_all_upright(numbers):
        return "axial_velocity"
    return "right_facing" if numbers.get("facings_differ") else "velocity"


def not_all_upright(numbers: Mapping[str, Any]) -> bool:
    """Whether walkers turned over or lean on a slope: then a velocity along the heading says little about their way."""
    return "upright" in numbers and bool(numbers["upright"] < numbers["walkers"])


def state(numbers: Mapping[str, Any]) -> str:
    """State of walkers whose mean velocity is not informative: ``at rest``, of a ramp ``stops at 0.8 g``, or empty."""
    if numbers.get("came_apart"):
        return "came apart"
    thresholds = {verb: numbers.get(f"{verb}_at", nan) for verb in ("stops", "starts")}
    if texts := [
        f"{verb} at {' '.join(number_text(peak, 'm/s^2'))}"
        for verb, peak in thresholds.items()
        if isfinite(peak)
    ]:
        return ", ".join(texts)
    if "stops_at" in numbers:
        return "no threshold within the ramp"
    if isfinite(numbers.get("slow_share", nan)):
        count = numbers["walkers"]
        slow, clustered = (
            round(count * numbers[name]) for name in ("slow_share", "clustered_share")
        )
        return f"{slow} of {count} walkers slow, {clustered} in clusters"
    return "at rest" if "velocity" in numbers and abs(numbers[headline(numbers)]) < REST else ""


def short_text(numbers: Mapping[str, Any]) -> str:
    """The state or the main number (`headline`): ``3 climbs``, ``1.080 mm/s``; a dash without walkers and piles."""
    main = headline(numbers)
    if main in ("", "climbs"):
        return counted(numbers[main], "climb") if main else "-"
    if text := state(numbers):
        return text
    text = f"{number_text(numbers[main], 'm/s')[0]} mm/s"
    if main == "right_facing":
        right, left = ("up", "down") if numbers["goes_uphill"] else ("right", "left")
        return (
            f"{text} facing {right}, {number_text(numbers['left_facing'], 'm/s')[0]} facing {left}"
        )
    return f"{text} up the slope" if main == "axial_velocity" else text


def rows(numbers: Mapping[str, Any]) -> list[Row]:
    """The numbers of a result as text, in displayed units, in the order of their declarations.

    Numbers that say nothing about any walker are left out: velocities and steadiness of walkers that came apart, means
    over two directions that differ or under a ramp, orientations of walkers of which some turned round.
    """
    main, hidden = headline(numbers), NOT_SHOWN_ALONE | SHOWN["hidden"]
    if main == "axial_velocity" or (main == "right_facing" and numbers["goes_uphill"]):
        hidden -= {"axial_velocity", "axial_left_facing"}
    if not_all_upright(numbers):
        hidden |= {"right_facing", "left_facing"}
    if not (
        numbers.get("facing_right") and numbers.get("facing_left")
    ):  # the velocity is that of the only direction
        hidden |= {"right_facing", "left_facing", "axial_left_facing"}
    if main != "velocity":
        hidden |= {"velocity"}
    if 0 < numbers.get("turned_round", 0) < numbers.get("walkers", 0):
        hidden |= {"orientation_end"}
    hidden |= meaningless_numbers(numbers)
    listed = []
    for name in ordered(numbers.keys() - hidden):
        number = numbers[name]
        if isinstance(number, (bool, str)) or not isfinite(number) or is_error(name):
            continue
        if number or not any(fnmatchcase(name, pattern) for pattern in SHOWN["if_any"]):
            quantity = declared(name)
            text, unit = number_text(number, quantity.unit)
            listed.append(
                Row(name, _label(quantity, numbers), text, unit, _errors(numbers, quantity))
            )
    return listed


def meaningless_numbers(numbers: Mapping[str, Any]) -> set[str]:
    """Names of the numbers that say nothing about walkers that came apart or under a ramp."""
    patterns = SHOWN["not_of_a_ramp"] if "stops_at" in numbers else frozenset()
    patterns |= SHOWN["not_of_parts"] if numbers.get("came_apart") else frozenset()
    return {name for name in numbers if any(fnmatchcase(name, pattern) for pattern in patterns)}


def _label(quantity: Quantity, numbers: Mapping[str, Any]) -> str:
    """Label of a number: on a slope directions are up and down, and means over those that face up are called so."""
    ground = "slope" if numbers.get("goes_uphill", False) else "level"
    label = LABELS.get(quantity.name, {}).get(ground, quantity.label)
    if ground == "slope" and leaves_out_facing_down(quantity, numbers):
        return f"{label}, facing up"
    return label


def leaves_out_facing_down(quantity: Quantity, numbers: Mapping[str, Any]) -> bool:
    """Whether a number of a slope leaves out walkers that face down, of which there are some."""
    is_mean_over_up = any(fnmatchcase(quantity.name, pattern) for pattern in SHOWN["facing_up"])
    return bool(numbers["goes_uphill"] and numbers.get("facing_left") and is_mean_over_up)


def number_text(number: float, unit: str) -> tuple[str, str]:
    """A number (SI) as text in the displayed unit, and this unit; velocities have all decimals."""
    usual, factor = unit_shown(unit)
    value = number if factor == 1.0 else number * factor
    return (with_decimals(value, 3) if usual == "mm/s" else rounded(value, usual)), usual


def _errors(numbers: Mapping[str, Any], quantity: Quantity) -> str:
    """Scatter or resolution, band and numerical error of a number in its displayed unit; of an angle, its range."""
    parts = []
    if quantity.name == "orientation_end" and numbers["walkers"] > 1:
        ends = (
            number_text(numbers[f"orientation_{end}"], quantity.unit)[0]
            for end in ("smallest", "largest")
        )
        parts.append(f"walkers {' to '.join(ends)}")
    if isfinite(scatter := numbers.get(quantity.error, nan)):
        word = "resolution" if quantity.error.endswith("_within") else "scatter of copies"
        parts.append(f"{word} {error_text(scatter, quantity.unit)}")
    parts += filter(None, [band_of(numbers, quantity)])
    if isfinite(error := numbers.get(f"{quantity.name}_error", nan)):
        parts.append(f"numerical error {error_text(error, quantity.unit)}")
    return ", ".join(parts)


def error_text(error: float, unit: str) -> str:
    """An error (SI) with two digits in the displayed unit, without the unit; a dash for NaN."""
    usual, factor = unit_shown(unit)
    text = rounded(float(f"{error * factor:.2g}"), usual)
    return "below 0.001" if text == "0" and usual == "mm/s" else text


def band_of(numbers: Mapping[str, Any], quantity: Quantity) -> str:
    """The band of a number in the displayed unit, with the number of its draws; empty if it has none."""
    low, high = (numbers.get(f"{quantity.name}_{end}") for end in ("low", "high"))
    if low is None or high is None:
        return ""
    draws = draws_text(
        numbers[f"{quantity.name}_draws"], approximate=numbers[f"{quantity.name}_approximate"]
    )
    return f"band {band_text(low, high, quantity.unit)} ({draws})"


def draws_text(draws: object, *, approximate: bool) -> str:
    """How many draws a band is of, and whether it is approximate because they are few."""
    return f"{draws} draws, approximate" if approximate else f"{draws} draws"


def band_text(low: float, high: float, unit: str) -> str:
    """Both ends of a band in the displayed unit, with three digits, without the unit: ``0.489 to 5.83``."""
    usual, factor = unit_shown(unit)
    return " to ".join(rounded(float(f"{end * factor:.3g}"), usual) for end in (low, high))
