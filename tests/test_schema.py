"""The JSON schema of case files, with which editors complete and check them."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from tests.conftest import call
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.schema import case_schema
from walkers.inputs.table import changed, keys_in


def test_a_new_case_names_its_schema_which_all_shipped_cases_keep(in_folder: Path) -> None:
    """And it is a case as it was without the schema."""
    assert call("new", "mine", "cluster", "--schema", check=True).stdout == "mine.toml\ncase.schema.json\n"
    first, empty, rest = Path("mine.toml").read_text().split("\n", 2)
    assert (first, empty, rest) == ("#:schema case.schema.json", "", shipped("case")["cluster"].read_text())
    assert load_case("mine").determinants() == load_case("cluster").determinants()
    schema = json.loads(Path("case.schema.json").read_text())
    assert schema["properties"].keys() == {*keys_in(Case), "library"}
    for path in shipped("case").values():
        Draft202012Validator(schema).validate(tomllib.loads(path.read_text()))
    assert "](" not in json.dumps(schema)  # links lead nowhere in an editor


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"drive.frequenzy": "80 Hz"}, "drive"),
        ({"drive.frequency": 80}, "drive.frequency"),
        ({"drive.frequency": "80"}, "drive.frequency"),
        ({"drive": "80 Hz"}, "drive"),
        ({"dimers.radii": ["0.3 mm", 0.2]}, "dimers.radii.1"),
        ({"dimers.radii": ["0.3 mm"]}, "dimers.radii"),
        ({"dimers.radii": ["0.3 mm"] * 3}, "dimers.radii"),
        ({"dimers.spacing": 3}, "dimers.spacing"),
        ({"dimers.meet": "yes"}, "dimers.meet"),
        ({"dimers.facing": "north"}, "dimers.facing"),
        ({"run.cycles": "many"}, "run.cycles"),
        ({"run.steps_per_cycle": 3}, "run"),
        ({"contact.restitution": 0.01}, "contact.restitution"),
        ({"contact.restitution": 1.2}, "contact.restitution"),
        ({"name": "x"}, ""),
    ],
)
def test_the_schema_refuses_what_the_program_refuses(changes: dict[str, Any], place: str) -> None:
    tables = tomllib.loads(shipped("case")["fig1b"].read_text())
    schema = Draft202012Validator(case_schema())
    schema.validate(changed(Case, tables, {"run.cycles": "auto"}))
    wrong = changed(Case, tables, changes)
    (error,) = schema.iter_errors(wrong)
    assert ".".join(map(str, error.absolute_path)) == place
    with pytest.raises(InputError):
        load_case(wrong)
