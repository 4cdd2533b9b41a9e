"""The library of materials, liquids and surface pairs (``library.toml``), each number with its source."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from typing import Any

from walkers.inputs import units

_KINDS = {
    "density": units.DENSITY,
    "youngs_modulus": units.MODULUS,
    "surface_tension": units.SURFACE_TENSION,
    "kinematic_viscosity": units.KINEMATIC_VISCOSITY,
    "contact_angle": units.ANGLE,
}


@cache
def _contents() -> dict[str, Any]:
    return tomllib.loads(resources.files("walkers.inputs").joinpath("library.toml").read_text("utf-8"))


def materials() -> tuple[str, ...]:
    """Names of the materials."""
    return tuple(_contents()["materials"])


def liquids() -> tuple[str, ...]:
    """Names of the liquids."""
    return tuple(_contents()["liquids"])


def _number(key: str, entry: Mapping[str, Any]) -> float:
    value = entry["value"]
    return units.parse_quantity(value, _KINDS[key]) if isinstance(value, str) else float(value)


def material(name: str) -> dict[str, float]:
    """Density (kg/m³), Young's modulus (Pa) and Poisson's ratio of a material.

    Raises
    ------
    KeyError
        If the library has no such material.
    """
    return {key: _number(key, entry) for key, entry in _contents()["materials"][name].items()}


def liquid(name: str) -> dict[str, float]:
    """Surface tension (N/m), kinematic viscosity (m²/s) and density (kg/m³) of a liquid.

    Raises
    ------
    KeyError
        If the library has no such liquid.
    """
    return {key: _number(key, entry) for key, entry in _contents()["liquids"][name].items()}


def surface_pair(first: str | None, second: str | None) -> dict[str, float] | None:
    """How two wet surfaces touch, or None where the library has no value for them.

    ``friction``, ``rolling_friction`` and, where they are known, ``minimum_separation_ratio``, ``viscosity_ratio``,
    ``film_drag_ratio``, ``contact_angle`` (rad), ``volume_fraction`` and ``restitution``.
    """
    for entry in _contents()["surface_pairs"]:
        if sorted(entry["materials"]) == sorted([first or "", second or ""]):
            return {key: _number(key, known) for key, known in entry.items() if key != "materials"}
    return None


def surface_pairs() -> list[tuple[str, str]]:
    """The pairs of materials whose friction the library has."""
    return [(entry["materials"][0], entry["materials"][1]) for entry in _contents()["surface_pairs"]]


def sources(table: str, name: str) -> dict[str, str]:
    """Source of each number of a material (``table="materials"``) or liquid (``"liquids"``)."""
    return {key: entry["source"] for key, entry in _contents()[table][name].items()}


def suggestion(word: str, known: Iterable[str]) -> str:
    """``; did you mean "…"?`` where a known name is close to the word, else nothing."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f'; did you mean "{close[0]}"?' if close else ""
