"""A resolved case as people read it: its values by dotted key, as near a case file's as may be, in the usual units."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from math import isclose, pi
from typing import Any

from walkers.inputs import units
from walkers.inputs.case import BOUNDS
from walkers.inputs.units import Kind

READABLE_UNITS: Mapping[str, tuple[str, float]] = {
    "m": ("mm", 1e-3),
    "m/s": ("mm/s", 1e-3),
    "m/s^2": ("g", units.ACCELERATION_OF_ONE_G),
    "rad": ("deg", pi / 180.0),
    "N/m": ("mN/m", 1e-3),
    "Pa*s": ("mPa*s", 1e-3),
    "Pa": ("MPa", 1e6),
    "kg/m^3": ("g/cm^3", 1e3),
}
"""For SI units the unit in which the field states such quantities, and what it is in the SI unit."""
_RENAMED = {
    "material": "beads.material",
    "density": "beads.density",
    "gravity": "environment.gravity",
    "seed": "run.seed",
    "liquid.dynamic_viscosity": "liquid.bridge_viscosity",
    "contact.friction_bead_bead": "contact.friction.bead_bead",
    "contact.friction_bead_wall": "contact.friction.bead_wall",
}
"""Values that a case file has under another key."""
_SOLE = {"walkers[0].": "walkers.", "drive.harmonics[0].": "drive."}
"""Entries of lists that are told by the list's name where they are the only one."""
_FOLLOWS: Mapping[str, tuple[str, ...]] = {
    **{key: (key,) for key in ("run.time_step", "boundary.uphill", "beads.density")},
    **{key: (key,) for key in ("liquid.surface_tension", "liquid.density")},
    "run.steps_per_cycle": ("run.time_step",),
    "run.until_steady": ("run.cycles", "run.duration"),
    "liquid.dynamic_viscosity": ("liquid.dynamic_viscosity", "liquid.kinematic_viscosity", "liquid.density"),
}
"""Values that may follow from others, with the keys by which a case file would give them."""
_NOT_COMPARED = ("name", "title", "document", "recorded", *(f"run.{bound}" for bound in BOUNDS))
"""What does not determine a run, or only says when it is ended."""


class FlatCase(dict[str, Any]):
    """The values of a resolved case by dotted key, SI units.

    Attributes
    ----------
    given
        What the case itself says, by a case file's keys, as text; None where that was not recorded with the run.
    """

    given: Mapping[str, str] | None = None


def flattened(case: Mapping[str, Any]) -> FlatCase:
    """The values of a resolved case by dotted key, SI units.

    Parameters
    ----------
    case
        As `walkers.inputs.case.Case.as_dict` gives it, or a run directory's ``case.json`` has it.

    Returns
    -------
    FlatCase
        By a case file's keys where it has the value; ``walkers.radii`` are those of ``[dimers]`` or ``[[clusters]]``,
        ``walkers[1].radii`` where there are several. ``liquid.bridge_viscosity`` stands for the liquid's viscosity and
        the bridges' ratio to it where these were not recorded.
    """
    told = {key: value for key, value in case.items() if key not in _NOT_COMPARED}
    flat = {key: value for key, value in dotted(told) if key not in _NOT_COMPARED}
    for listed, alone in _SOLE.items():
        if not any(key.startswith(listed.replace("0", "1")) for key in flat):
            flat = {alone + key.removeprefix(listed) if key.startswith(listed) else key: flat[key] for key in flat}
    recorded = {one["key"]: one for one in case.get("recorded") or ()}
    found = FlatCase(_with_ratio({_RENAMED.get(key, key): value for key, value in flat.items()}, recorded))
    if recorded:
        found.given = {key: one["text"] for key, one in recorded.items() if one["origin"] == "given"}
    return found


def _with_ratio(flat: dict[str, Any], recorded: Mapping[str, Any]) -> dict[str, Any]:
    """A resolved case has the product of viscosity and ratio; the factors are among what was recorded, as texts."""
    try:
        viscosity = units.parse_quantity(recorded["liquid.dynamic_viscosity"]["text"], units.DYNAMIC_VISCOSITY)
        ratio = float(recorded["liquid.viscosity_ratio"]["text"])
    except (KeyError, ValueError):
        return flat
    product = "liquid.bridge_viscosity"
    # Of a case that was changed since it was read, what is recorded is not what the laws take.
    if product not in flat or not isclose(viscosity * ratio, flat[product], rel_tol=1e-4, abs_tol=1e-12):
        return flat
    factors = {"liquid.dynamic_viscosity": viscosity, "liquid.viscosity_ratio": ratio}
    items = list(flat.items())
    place = list(flat).index(product)
    return {**dict(items[:place]), **factors, **dict(items[place + 1 :])}


def dotted(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Values of nested tables by dotted keys, entries of lists of tables one by one."""
    if isinstance(value, Mapping):
        for name, one in value.items():
            yield from dotted(one, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and value and isinstance(value[0], Mapping):
        for number, one in enumerate(value):
            yield from dotted(one, f"{key}[{number}]")
    else:
        yield key, value


def readable(key: str, value: Any) -> str:
    """A value of `flattened` in the usual unit, such as ``4 g`` or ``0.3/0.2 mm``; a dash for none."""
    if value is None:
        return "-"
    kind = _kinds().get(key.rpartition(".")[2])
    if kind is None or isinstance(value, str):
        return _number(value, 1.0)
    unit, size = readable_unit(kind.unit) if kind is not units.TIME else ("us", 1e-6)
    if key == "environment.gravity":  # the paper's g, 9.8 m/s², is not the case's gravity
        unit, size = kind.unit, 1.0
    return f"{_number(value, size)} {unit}"


def readable_unit(unit: str) -> tuple[str, float]:
    """The unit in which the field states what has such an SI unit, and what it is in the SI unit."""
    return READABLE_UNITS.get(unit, (unit, 1.0))


@cache
def _kinds() -> Mapping[str, Kind]:
    """What the numbers of a resolved case are, by the last part of their keys; the others are pure numbers."""
    from walkers.inputs.messages import keys_of
    from walkers.inputs.schema import CaseFile

    found = {"beads": units.LENGTH, "places": units.LENGTH, "bridge_viscosity": units.DYNAMIC_VISCOSITY}
    for table in filter(None, keys_of(CaseFile).values()):
        of_table = {
            name: units.kind_in([*field.metadata, field.annotation]) for name, field in table.model_fields.items()
        }
        found |= {name: kind for name, kind in of_table.items() if kind is not None and name != "radius"}
    return found


def _number(value: Any, size: float) -> str:
    if isinstance(value, list):
        return "/".join(_number(one, size) for one in value) or "-"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return f"{value / size:.6g}"


def differing(cases: Sequence[Mapping[str, Any]]) -> list[str]:
    """The keys whose values differ among flattened cases, in the cases' order, without those that follow from others.

    A time step that ``"auto"`` chose, and the numbers of a liquid that the library knows by name, are left out where
    something else differs; what one of the cases gives itself, and another does not or otherwise, never is.
    """
    keys = dict.fromkeys(key for case in cases for key in case)
    varied = [key for key in keys if len({_comparable(case.get(key)) for case in cases}) > 1]
    return [key for key in varied if not _may_follow(key, cases)] or varied


def _may_follow(key: str, cases: Sequence[Mapping[str, Any]]) -> bool:
    """Whether a value may follow from others: none of the cases gives it, or all give it in the same words."""
    told = set()
    for case in cases:
        given = case.given if isinstance(case, FlatCase) else None
        if given is None or not (key in _FOLLOWS or key.endswith(".spacing")):
            return False
        told.add(tuple(given.get(one) for one in _FOLLOWS.get(key, [one for one in given if one.endswith(".spacing")])))
    return len(told) == 1


def _comparable(value: Any) -> Hashable:
    if isinstance(value, list):
        return tuple(_comparable(one) for one in value)
    return float(f"{value:.12g}") if isinstance(value, float) else value


def agrees(case: Mapping[str, Any], key: str, wanted: str) -> bool:
    """Whether a flattened case has a value, as a user writes both.

    The key may be the end of one, such as ``frequency`` (``dimers`` and ``clusters[0]`` are ``walkers``), the value a
    number, with its unit or without, a text, or a list as `readable` writes it.
    """
    return any(_is(one, value, wanted.strip().strip('"')) for one, value in case.items() if _names(key, one))


def has_key(case: Mapping[str, Any], key: str) -> bool:
    """Whether a flattened case has a key, or one that ends so."""
    return any(_names(key, one) for one in case)


def _names(given: str, key: str) -> bool:
    for table in ("dimers.", "clusters[0]."):
        given = given.replace(table, "walkers.") if given.startswith(table) else given
    return f".{key}".endswith(f".{given}")


def _is(key: str, value: Any, wanted: str) -> bool:
    if wanted in (readable(key, value), str(value)):
        return True
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value).lower() == wanted.lower()
    kind = _kinds().get(key.rpartition(".")[2])
    with suppress(ValueError):
        return isclose(units.parse_quantity(wanted, kind) if kind else float(wanted), value, rel_tol=1e-6)
    return False
