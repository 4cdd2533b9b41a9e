"""Files that describe the project to others: they agree with pyproject.toml and the Makefile."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import jinja2

from walkers.files import read_json

ROOT = Path(__file__).resolve().parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = PYPROJECT["project"]
CODEMETA, ZENODO = read_json(ROOT / "codemeta.json"), read_json(ROOT / ".zenodo.json")


def _found(pattern: str, file: str) -> str:
    match = re.search(pattern, (ROOT / file).read_text("utf-8"), re.MULTILINE)
    assert match, f"{pattern} is not in {file}"
    return match[1]


def _rendered_recipe() -> list[str]:
    def load_file_data(name: str, *, from_recipe_dir: bool) -> dict[str, Any]:
        assert from_recipe_dir
        return tomllib.loads((ROOT / "recipe" / name).read_text("utf-8"))

    template = jinja2.Template((ROOT / "recipe" / "meta.yaml").read_text("utf-8"))
    text = template.render(load_file_data=load_file_data, environ={}, PYTHON="python")
    return [line.strip() for line in text.splitlines()]


def test_name_version_licence_and_authors_are_the_same_everywhere() -> None:
    licences = PROJECT["license"].split(" AND ")
    version = PYPROJECT["tool"]["setuptools_scm"]["fallback_version"]
    (author,) = (one["name"] for one in CODEMETA["author"])
    recipe = _rendered_recipe()
    for said, expected in (
        ({CODEMETA["name"], ZENODO["title"], _found("^title: (.*)", "CITATION.cff")}, PROJECT["name"]),
        ({_found("^title: '([^:]*)", "paper/paper.md")}, PROJECT["name"]),
        ({CODEMETA["version"], ZENODO["version"], _found("^version: (.*)", "CITATION.cff")}, version),
        ({_found(r"^## (\S+)", "CHANGELOG.md"), _found(r"VERSION=(\d[\d.]*)\+", "containers/Dockerfile")}, version),
        ({ZENODO["license"], _found("^license: (.*)", "CITATION.cff")}, licences[0]),
        ({*(one["name"] for one in ZENODO["creators"]), _found("^  - name: (.*)", "CITATION.cff")}, author),
        ({_found("^  - name: (.*)", "paper/paper.md")}, author),
        ({CODEMETA["description"].split(":")[0]}, PROJECT["description"]),
    ):
        assert said == {expected}
    assert [Path(one).name for one in CODEMETA["license"]] == licences
    assert {f"name: {PROJECT['name']}", f'version: "{version}"', f"license: {PROJECT['license']}"} <= set(recipe)


def test_the_recipe_needs_what_the_package_needs() -> None:
    recipe = _rendered_recipe()
    needed = recipe[recipe.index("run:") + 1 : recipe.index("test:")]
    assert [one.removeprefix("- ").replace(" ", "") for one in needed if one][1:] == PROJECT["dependencies"]


def test_the_site_is_built_with_the_packages_of_the_makefile() -> None:
    packages = _found(r"apt_packages: \[(.*)\]", ".readthedocs.yaml").split(", ")
    assert packages == _found("^ENGINE := (.*)", "Makefile").split()
