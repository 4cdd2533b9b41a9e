"""What the table of a sweep shows of its points: what follows from each case, and what its run gave."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import nan
from typing import Any

from walkers.inputs.case import Case
from walkers.postprocess.analysis import Described, analyses, analyses_in, analyses_of

_DRIVE = {
    "frequency": ("Hz", "of the drive"),
    "peak_acceleration": ("m/s^2", "of the boundary"),
    "peak_velocity": ("m/s", "of the boundary"),
    "amplitude": ("m", "of the boundary's displacement"),
}
"""Columns that every case has."""


def analyses_of_all(cases: Iterable[Case]) -> list[str]:
    """Names of the analyses that mean something for any of several cases."""
    found = {one.name for case in cases for one in analyses_of(case)}
    return [one.name for one in analyses() if one.name in found]


def derived_columns(names: Sequence[str]) -> Described:
    """Columns that follow from a case, of the analyses of these names: unit and meaning."""
    return {**{key: told for one in analyses() if one.name in names for key, told in one.derived.items()}, **_DRIVE}


def result_columns(names: Sequence[str]) -> Described:
    """Columns that a run gives, of the analyses of these names: unit and meaning."""
    return {key: told for one in analyses() if one.name in names for key, told in one.columns.items()}


def headlines(names: Sequence[str]) -> list[str]:
    """The columns that count first, of the analyses of these names."""
    return [key for one in analyses() if one.name in names for key in one.headlines]


def derived_of(case: Case, names: Sequence[str]) -> list[float]:
    """The columns `derived_columns` of a case; NaN where it has none."""
    drive = case.drive
    known = {
        **{key: value for one in analyses_of(case) for key, value in one.derived_of(case).items()},
        "frequency": drive.frequency,
        "peak_acceleration": drive.peak_acceleration,
        "peak_velocity": drive.peak_velocity,
        "amplitude": drive.amplitude,
    }
    return [known.get(key, nan) for key in derived_columns(names)]


def row_of(result: Mapping[str, Any]) -> dict[str, Any]:
    """The columns `result_columns` of a result."""
    return {key: value for one in analyses_in(result) for key, value in one.row(result).items()}


def velocity_in(result: Mapping[str, Any]) -> float:
    """Mean velocity of walkers, m/s; NaN where there are none."""
    return float(result["velocity"]["mean"]) if "velocity" in result else nan
