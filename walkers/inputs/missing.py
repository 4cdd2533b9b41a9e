"""What a case must say that no table demands by itself: one key or another, or a key that goes with others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from walkers.inputs.boundary import SIZES
from walkers.inputs.errors import Problem

_BODIES = ("dimers", "clusters", "mixture", "placed")
_STRENGTH = (("peak_acceleration",), ("gamma0",))
_EXPECTED = {
    "radii": 'such as ["0.3 mm", "0.2 mm"]',
    "mean_radius": 'such as "0.25 mm"',
    "sin_delta": "such as 0.2",
    "arrangement": 'such as "fan", or the places of the beads (at)',
    "count": "a number of beads such as 200, or a fill_height",
    "opening": 'such as "120 deg"',
    "width": 'such as "5.3 mm"',
    "height": 'such as "5.3 mm"',
    "dynamic_viscosity": "a liquid of the library by name, or this number",
    "kinematic_viscosity": "a liquid of the library by name, or a viscosity, kinematic or dynamic",
    "density": "the liquid's density beside its kinematic_viscosity",
    "frequency": 'such as "80 Hz"',
    "peak_acceleration": 'it (such as "4 g") or gamma0',
    "duration": 'such as "4 s"',
}


def missing_keys(tables: Mapping[str, Any]) -> list[Problem]:
    """The keys that are missing of the tables of a case, which are checked by their models as well."""
    problems = [Problem(key, None, f"missing; expected {_EXPECTED[key.rpartition('.')[2]]}") for key in _keys(tables)]
    if not any(body in tables for body in _BODIES):
        message = "missing; expected bodies: [dimers], [[clusters]], [mixture] or [[placed]]"
        problems.insert(0, Problem("dimers", None, message))
    return problems


def _keys(tables: Mapping[str, Any]) -> Iterator[str]:
    drive, run = tables.get("drive"), tables.get("run", {})
    yield from _lacking("dimers", tables.get("dimers"), (("radii",), ("mean_radius", "sin_delta")))
    for number, cluster in enumerate(_list(tables.get("clusters"))):
        yield from _lacking(f"clusters[{number}]", cluster, (("radii",),))
        yield from _lacking(f"clusters[{number}]", cluster, (("arrangement",), ("at",)))
    yield from _lacking("mixture", tables.get("mixture"), (("count",), ("fill_height",)))
    if isinstance(boundary := tables.get("boundary"), Mapping):
        yield from _lacking("boundary", boundary, (tuple(SIZES.get(str(boundary.get("shape", "plane")), ())),))
    yield from _lacking("liquid", tables.get("liquid"), (("dynamic_viscosity",), ("kinematic_viscosity", "density")))
    if isinstance(drive, Mapping) and "harmonics" not in drive:
        yield from _lacking("drive", drive, (("frequency",),))
        yield from _lacking("drive", drive, _STRENGTH)
    elif isinstance(drive, Mapping):
        for number, harmonic in enumerate(_list(drive["harmonics"])):
            yield from _lacking(f"drive.harmonics[{number}]", harmonic, _STRENGTH)
    if "mixture" in tables or "placed" in tables:
        yield from _lacking("run", run, (("duration",), ("cycles",)))


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _lacking(name: str, table: Any, ways: tuple[tuple[str, ...], ...]) -> Iterator[str]:
    """Missing keys of a table that may use one of several sets of keys: those of the set of which it has a key."""
    if isinstance(table, Mapping):
        way = max(ways, key=lambda keys: (sum(key in table for key in keys) > 0, -len(keys)))
        yield from (f"{name}.{key}" for key in way if key not in table)
