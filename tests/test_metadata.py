"""Files that describe the project to others: they agree with pyproject.toml and the Makefile."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PROJECT = PYPROJECT["project"]
VERSION = PYPROJECT["tool"]["setuptools_scm"]["fallback_version"]
LICENCE_OF_PYTHON = PROJECT["license"].split(" AND ")[0]


def _match(pattern: str, file: str) -> str:
    """The first group of a pattern in a file of the project."""
    match = re.search(pattern, (ROOT / file).read_text("utf-8"), re.MULTILINE)
    assert match, f"{pattern} is not in {file}"
    return match[1]


@pytest.mark.parametrize(
    ("pattern", "file", "expected"),
    [
        ("^title: (.*)", "CITATION.cff", PROJECT["name"]),
        ("^title: '([^:]*)", "docs/joss/paper.md", PROJECT["name"]),
        ("^version: (.*)", "CITATION.cff", VERSION),
        ("^license: (.*)", "CITATION.cff", LICENCE_OF_PYTHON),
    ],
)
def test_name_version_and_licence_are_the_same_everywhere(
    pattern: str, file: str, expected: str
) -> None:
    assert _match(pattern, file) == expected


def test_a_container_has_the_version_of_the_package() -> None:
    """The Dockerfile reads it with a command, which is run here."""
    command = _match(r"version=\$\((.*)\)", "Dockerfile")
    printed = subprocess.run(
        command, shell=True, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert printed == f"{VERSION}\n"


def test_both_papers_name_the_same_authors() -> None:
    assert _match("^  - name: (.*)", "docs/joss/paper.md") == _match(
        "^  - name: (.*)", "CITATION.cff"
    )


def test_the_site_is_built_with_the_packages_of_the_makefile() -> None:
    packages = _match(r"apt_packages: \[(.*)\]", ".readthedocs.yaml").split(", ")
    assert packages == _match("^ENGINE := (.*)", "Makefile").split()


ROOMS = ["inputs", "templates", "runner", "postprocess"]


@pytest.mark.parametrize("room", ROOMS)
def test_a_link_at_the_top_leads_to_its_room(room: str) -> None:
    assert (ROOT / room).resolve() == ROOT / "walkers" / room


@pytest.mark.parametrize("room", ROOMS)
def test_a_link_at_the_top_refuses_to_be_a_second_copy_of_a_package(room: str) -> None:
    command = [sys.executable, "-c", f"import walkers.{room}; import {room}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    message = f"ImportError: {room} is a link to the package walkers.{room}: import walkers.{room}"
    assert done.stderr.splitlines()[-1] == message
