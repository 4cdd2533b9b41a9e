"""The library of materials, liquids and surface pairs (``library.toml``), each number with its source."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from walkers.physics import units

_KINDS = {
    "density": units.DENSITY,
    "youngs_modulus": units.MODULUS,
    "surface_tension": units.SURFACE_TENSION,
    "kinematic_viscosity": units.KINEMATIC_VISCOSITY,
    "contact_angle": units.ANGLE,
}


@dataclass(frozen=True)
class Known:
    """A number of the library.

    Attributes
    ----------
    value, written, source
        SI; as the library has it, with its unit; where it is from.
    range
        Ends between which a calibrated number may lie as well (5 to 95 % of the posterior), as a case would write them.
    calibrated_with
        Names of the liquids of the experiments that it was calibrated to; empty if it was not.
    """

    value: float
    written: Any
    source: str = ""
    range: tuple[Any, Any] | None = None
    calibrated_with: tuple[str, ...] = ()


@dataclass(frozen=True)
class Unmeasured:
    """What nobody measures and a case may leave out: what is usual then, None if it must be said, and its range.

    ``logarithmic`` says whether the range is of magnitudes; ``range`` is as a case would write it.
    """

    usual: Known | None
    range: tuple[Any, Any]
    logarithmic: bool


@cache
def _contents() -> dict[str, Any]:
    return tomllib.loads(resources.files("walkers.inputs").joinpath("library.toml").read_text("utf-8"))


def _known(key: str, entry: Mapping[str, Any], liquids: tuple[str, ...] = ()) -> Known:
    kind, value = _KINDS.get(key.rpartition(".")[2]), entry["value"]
    number = units.parse_quantity(value, kind) if kind else float(value)
    source = f"calibrated with {' and '.join(liquids)}" if liquids else entry.get("source", "")
    ends = (entry["range"][0], entry["range"][1]) if "range" in entry else None
    return Known(number, value, source, ends, liquids)


def materials() -> tuple[str, ...]:
    """Names of the materials."""
    return tuple(_contents()["materials"])


def liquids() -> tuple[str, ...]:
    """Names of the liquids."""
    return tuple(_contents()["liquids"])


@cache
def material(name: str) -> Mapping[str, Known]:
    """Density (kg/m³), Young's modulus (Pa) and Poisson's ratio of a material (KeyError: there is none)."""
    return {key: _known(key, entry) for key, entry in _contents()["materials"][name].items()}


@cache
def liquid(name: str) -> Mapping[str, Known]:
    """Surface tension (N/m), kinematic viscosity (m²/s) and density (kg/m³) of a liquid (KeyError: there is none)."""
    return {key: _known(key, entry) for key, entry in _contents()["liquids"][name].items()}


@cache
def surface_pair(first: str | None, second: str | None) -> Mapping[str, Known]:
    """How two wet surfaces touch; empty where the library has no value for them.

    ``friction``, ``rolling_friction`` and, where they are known, ``minimum_separation_ratio``, ``viscosity_ratio``,
    ``contact_angle`` (rad), ``volume_fraction`` and ``restitution``.
    """
    for pair in _contents()["surface_pairs"]:
        if sorted(pair["materials"]) == sorted([first or "", second or ""]):
            liquids = tuple(pair["calibrated_with"])
            return {key: _known(key, one, liquids) for key, one in pair.items() if isinstance(one, dict)}
    return {}


def surface_pairs() -> list[tuple[str, str]]:
    """The pairs of materials whose friction the library has."""
    return [(entry["materials"][0], entry["materials"][1]) for entry in _contents()["surface_pairs"]]


@cache
def unmeasured() -> Mapping[str, Unmeasured]:
    """What nobody measures, by the keys of a case."""
    found = {}
    for key, entry in _contents()["unmeasured"].items():
        usual = _known(key, {"value": entry["usual"]}) if "usual" in entry else None
        found[key] = Unmeasured(usual, (entry["range"][0], entry["range"][1]), entry.get("log", False))
    return found


def expected_of(word: str, known: Iterable[str]) -> str:
    """``expected one of …``, with the known name that the word is close to, if it is to one."""
    names = list(known)
    return f"expected one of {', '.join(names)}{suggestion(word, names)}"


def suggestion(word: str, known: Iterable[str]) -> str:
    """``; did you mean "…"?`` where a known name is close to the word, else nothing."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f'; did you mean "{close[0]}"?' if close else ""
