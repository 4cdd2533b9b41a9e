"""Uncertainty of a result: unmeasured values, and the band of the result over their ranges."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from math import isfinite, nan
from pathlib import Path
from typing import Any

from walkers.errors import refused
from walkers.inputs.library import unmeasured
from walkers.inputs.origins import Origin
from walkers.postprocess.sides import STEADY_SPEED
from walkers.rounding import SHOWN_UNITS, rounded
from walkers.runner.files import read_json
from walkers.runner.manifest import check_unchanged

SPREAD = "-spread"
SPREAD_NAME = "spread.json"
"""End of the name of a spread's directory (`spread_of`), and name of the file with the bands in it."""
ACCURACY = "-accuracy"
ACCURACY_NAME = "accuracy.json"
"""End of the name of the sweep that measures numerical errors, and name of the file with them in the run."""
LEAST_PER_VALUE = 3
"""Draws per varied value below which the band is approximate and rank correlations are not significant."""
BANDS_ON_SLOPES = {"right_facing": "velocity, facing up,", "axial_velocity": "velocity up the slope"}
"""Names of the bands of walkers on slopes."""
_OVER = "over the ranges of uncertain values"
_WIDTH = 110


def rests_on(origins: Sequence[Origin]) -> list[dict[str, Any]]:
    """Unmeasured values of a case, and values that it calls uncertain.

    Each has a ``key``, ``value`` (as in a case file), ``origin`` (``given``, ``library``, ``calibrated``, ``assumed``
    or ``default``), ``range`` (both ends, or None), ``logarithmic``, and whether it is ``guessed``.
    """
    return [
        {
            "key": one.key,
            "value": one.text,
            "origin": one.origin,
            "range": list(one.range) if one.range else None,  # a list, as in the file
            "logarithmic": one.logarithmic,
            "guessed": one.guessed,
        }
        for one in origins
        if one.key in unmeasured() or one.range is not None
    ]


def lines_of_rest(rests: Sequence[Mapping[str, Any]]) -> list[str]:
    """The uncertain values of a result (`rests_on`) as text, by origin."""

    def listed(head: str, chosen: Iterable[Mapping[str, Any]], ends: str = "") -> list[str]:
        text = ", ".join(f"{one['key'].partition('.')[2]} {one['value']}" for one in chosen) + ends
        wrapper = textwrap.TextWrapper(_WIDTH, f"  {head:10} ", " " * 13, break_on_hyphens=False)
        return wrapper.wrap(text) if text else []

    guessed = [one for one in rests if one["guessed"] and one["origin"] == "default"]
    lines = listed("guessed", guessed, " (not of these materials and this liquid)") if guessed else []
    lines += listed("uncertain", [one for one in rests if one["guessed"] and one["origin"] != "default"])
    whence = {
        "given": "given",
        "calibrated": "calibrated",
        "assumed": "assumed",
        "library": "own library",
    }
    for head, origin in whence.items():
        lines += listed(head, [one for one in rests if not one["guessed"] and one["origin"] == origin])
    return lines


def wrapped_line(line: str) -> str:
    """A line of a result's text, wrapped below the text after its label."""
    listed = line.startswith("    ") and line[4:5] != " "
    return textwrap.fill(line, _WIDTH, subsequent_indent=" " * (6 if listed else 13))


def wrapped(sentences: Iterable[str]) -> list[str]:
    """Sentences as indented lines of a text."""
    wrapper = textwrap.TextWrapper(_WIDTH, "    ", "      ", break_on_hyphens=False, break_long_words=False)
    # A number and its unit.
    tied = (re.sub(r"(?<=\d) (?=[%a-z])", "\u00a0", sentence) for sentence in sentences)
    return [line.replace("\u00a0", " ") for sentence in tied for line in wrapper.wrap(sentence)]


def not_known(rests: Sequence[Mapping[str, Any]]) -> list[str]:
    """A sentence with the values of a result (`rests_on`) that have a range, if there are any."""
    names = [
        one["key"].partition(".")[2].partition(".bead_")[0].replace("_", " ")
        for one in rests
        if one["range"] is not None
    ]
    if not names:
        return []
    return [f"uncertain parameters: {', '.join(dict.fromkeys(names))}; run with --spread to compute the resulting band"]


def spread_of(directory: Path) -> Path:
    """The directory of the spread of a run (`walkers.sweeps.spread`); it need not exist."""
    return directory.with_name(f"{directory.name}{SPREAD}")


def with_bands(directory: Path, result: Mapping[str, Any]) -> dict[str, Any]:
    """A result with what was measured beside it: the ``bands`` of a spread of the run over the same ranges, and the
    ``accuracy`` of `walkers.sweeps.accuracy`.
    """
    known = dict(result)
    with suppress(OSError, ValueError, KeyError, TypeError):
        spread = read_json(spread_of(directory.resolve()) / SPREAD_NAME)
        drawn, ranges = (
            {one["key"]: one["range"] for one in origins if one["range"]}
            for origins in (spread["varied"], result["rests_on"])
        )
        known |= {"bands": spread["bands"]} if drawn == ranges else {}
    if (directory / ACCURACY_NAME).is_file():
        known["accuracy"] = _accuracy(directory)
    return known


def _accuracy(directory: Path) -> dict[str, Any]:
    """The numerical errors of a run; `InputError` if their file was edited or is damaged."""
    try:
        contents = read_json(directory / ACCURACY_NAME)
        check_unchanged(directory, [ACCURACY_NAME])
    except (OSError, ValueError) as error:
        text = "was edited or is damaged; measure it again with"
        raise refused(directory / ACCURACY_NAME, f"{text}: walkers run {directory} --accuracy") from error
    return contents


def numerical_error(result: Mapping[str, Any], name: str = "velocity") -> float:
    """Numerical error of a number, m/s; NaN if it was not measured."""
    return float(result.get("accuracy", {}).get("errors", {}).get(name, {}).get("total", nan))


def accuracy_text(result: Mapping[str, Any], name: str, own: float) -> str:
    """The numerical error of a velocity (m/s) in per cent, or in mm/s if it is below `STEADY_SPEED`."""
    accuracy = result.get("accuracy")
    if accuracy is None:
        return "numerical error not measured; run with --accuracy to measure it"
    error, size, unit = accuracy["errors"][name], 1e3, "mm/s"
    if abs(own) > STEADY_SPEED:
        size, unit = 100.0 / abs(own), "%"
    half, stiffer, total = (size * error[part] for part in ("half_step", "stiffer", "total"))
    harder = f"{accuracy['times']:g} times Young's modulus {stiffer:+.2g} {unit}"
    text = f"numerical error {total:.2g} {unit} (half the time step {half:+.2g} {unit}, {harder})"
    if accuracy["reached"]:
        return text
    return f"{text}; not converged: the last increase of the modulus changes {100.0 * accuracy['change']:.2g} %"


def band_of(result: Mapping[str, Any], name: str, own: float | None) -> tuple[float, float] | None:
    """Both ends of the band of a quantity (SI), extended to the result ``own`` of the case; None without a band.

    The result is usually in the band, because a spread draws half of the values below and half above those of the case.
    """
    band = (result.get("bands") or {}).get(name)
    if band is None:
        return None
    ends = [band["low"], band["high"], *([own] if own is not None and isfinite(own) else [])]
    return min(ends), max(ends)


def band_text(band: tuple[float, float], unit: str) -> str:
    """Both ends of a band in the displayed unit, with three digits: ``0.489 to 5.83 mm/s``."""
    shown, factor = SHOWN_UNITS.get(unit, (unit, 1.0))
    low, high = (rounded(float(f"{end * factor:.3g}"), shown) for end in band)
    return f"{low} to {high} {shown}".rstrip()


def bands_text(result: Mapping[str, Any], units: Mapping[str, str], own: Mapping[str, Any]) -> str:
    """The bands of several quantities in a sentence; empty without bands."""
    bands = {name: band for name in units if (band := band_of(result, name, own.get(name)))}
    if not bands:
        return ""
    named = ((BANDS_ON_SLOPES.get(name, name), band_text(band, units[name])) for name, band in bands.items())
    text = "; ".join(map(" ".join, named))
    points = max(result["bands"][name]["points"] for name in bands)
    return f"{text} {_OVER} (5 to 95 % of {points} draws)"
