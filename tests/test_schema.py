"""The JSON schema of case files, with which editors complete and check them, and the JSON of cases in runs."""

from __future__ import annotations

import json
import re
import tomllib
from contextlib import nullcontext
from itertools import chain
from math import inf
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import call
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.schema import case_schema
from walkers.inputs.table import changed, keys_in


def wrong_by(schema: dict[str, Any], value: Any, whole: dict[str, Any], place: str = "") -> list[str]:
    """Places of a value that a JSON schema refuses, for the words that the schema of cases has."""
    if "$ref" in schema:
        schema = whole["$defs"][schema["$ref"].rpartition("/")[2]]
    if "anyOf" in schema:
        ways = [wrong_by(one, value, whole, place) for one in schema["anyOf"]]
        return min(ways, key=len)
    kind = schema.get("type", "string")
    kinds = {"string": str, "boolean": bool, "object": dict, "array": list, "integer": int, "number": (int, float)}
    if not isinstance(value, kinds[kind]) or (isinstance(value, bool) and kind != "boolean"):
        return [place]
    if isinstance(value, dict):
        keys = schema.get("properties", {})
        strange = {*value} - {*keys} if keys else set()
        inside = [wrong_by(keys[key], value[key], whole, f"{place}.{key}") for key in keys.keys() & value]
        missing = {*schema.get("required", ())} - {*value}
        return [*(f"{place}.{key}" for key in strange | missing), *chain(*inside)]
    if isinstance(value, list):
        fits = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        inside = [wrong_by(schema["items"], one, whole, f"{place}[{number}]") for number, one in enumerate(value)]
        return [*chain(*inside), *([] if fits else [place])]
    fits = value in schema.get("enum", [value]) and value == schema.get("const", value)
    if isinstance(value, str):
        fits &= re.search(schema.get("pattern", ""), value) is not None
    if isinstance(value, (int, float)):
        fits &= schema.get("minimum", value) <= value <= schema.get("maximum", value)
        fits &= not (value <= schema.get("exclusiveMinimum", -inf) or value >= schema.get("exclusiveMaximum", inf))
    return [] if fits else [place]


def test_a_new_case_names_its_schema_which_all_shipped_cases_keep(in_folder: Path) -> None:
    """And it is a case as it was without the schema."""
    assert call("new", "mine", "cluster", "--schema", check=True).stdout == "mine.toml\ncase.schema.json\n"
    first, empty, rest = Path("mine.toml").read_text().split("\n", 2)
    assert (first, empty, rest) == ("#:schema case.schema.json", "", shipped("case")["cluster"].read_text())
    assert load_case("mine").determinants() == load_case("cluster").determinants()
    schema = json.loads(Path("case.schema.json").read_text())
    assert schema["properties"].keys() == {*keys_in(Case), "library"}
    for name, path in shipped("case").items():
        assert not wrong_by(schema, tomllib.loads(path.read_text()), schema), name
    assert "](" not in json.dumps(schema)  # links lead nowhere in an editor


@pytest.mark.parametrize("name", [*shipped("case"), "harmonics", "places"])
def test_a_case_is_read_again_from_the_json_of_its_run(name: str) -> None:
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "gamma0": 0.5, "axis": [1, 0, 1]},
    ]
    places = {"radii": ["0.2 mm", "0.2 mm"], "at": [["0.2 mm", "0 mm"], ["-0.2 mm", "0 mm"]], "gap": "auto"}
    others: dict[str, dict[str, Any]] = {"harmonics": {"drive": {"harmonics": tones}}, "places": {"clusters": [places]}}
    path = shipped("case")["fig1b" if name in others else name]
    tables = {**tomllib.loads(path.read_text()), **others.get(name, {})}
    case = load_case(tables)
    again = Case.from_dict(json.loads(json.dumps(case.as_dict())))
    assert again == case
    assert again.sources == case.sources
    assert again.origins == case.origins


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"drive.frequenzy": "80 Hz"}, ".drive.frequenzy"),
        ({"drive.frequency": 80}, ".drive.frequency"),
        ({"drive.frequency": "80"}, ".drive.frequency"),
        ({"dimers.radii": ["0.3 mm", 0.2]}, ".dimers.radii[1]"),
        ({"dimers.radii": ["0.3 mm"] * 3}, ".dimers.radii"),
        ({"dimers.facing": "north"}, ".dimers.facing"),
        ({"run.cycles": "many"}, ".run.cycles"),
        ({"run.cycles": "auto"}, ""),
        ({"contact.restitution": 0.01}, ".contact.restitution"),
    ],
)
def test_the_schema_refuses_what_the_program_refuses(changes: dict[str, Any], place: str) -> None:
    tables = changed(Case, tomllib.loads(shipped("case")["fig1b"].read_text()), changes)
    schema = case_schema()
    assert wrong_by(schema, tables, schema) == ([place] if place else [])
    with pytest.raises(InputError) if place else nullcontext():
        load_case(tables)
