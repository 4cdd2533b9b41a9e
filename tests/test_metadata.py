"""Files that describe the project to others: they agree with pyproject.toml and the Makefile."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

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


# --- what `make` installs -------------------------------------------------------------------------


@pytest.fixture
def bare_folder(tmp_path: Path) -> Path:
    """A folder with the Makefile and what it reads, but without an environment."""
    for name in ("Makefile", "requirements.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def _make(folder: Path, *arguments: str) -> str:
    """What `make` prints in a folder."""
    # The options of a `make` that started the tests are not for this one.
    environment = {name: value for name, value in os.environ.items() if "MAKE" not in name}
    return subprocess.run(
        ["make", "--no-print-directory", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def test_make_tells_what_it_is_going_to_install(bare_folder: Path) -> None:
    packages = _match("^ENGINE := (.*)", "Makefile")
    assert _make(bare_folder, "plan", "NEEDED_engine=sh no-such-command").splitlines() == [
        f"to install with apt-get (1 GB): {packages}",
        "to install with pip into .venv (1.2 GB): granular-walkers[film] and what it needs",
    ]


def test_make_tells_nothing_if_it_installs_nothing(bare_folder: Path) -> None:
    (bare_folder / ".venv").mkdir()
    (bare_folder / ".venv" / "ready").touch()
    assert not _make(bare_folder, "plan", "NEEDED_engine=sh /usr")


@pytest.mark.parametrize(
    ("target", "extra", "groups"),
    [
        ("walker", "film", ["liggghts"]),
        ("pile", "film", ["liggghts"]),
        ("test", "dev", ["liggghts", "slurm-wlm", "chromium"]),
    ],
)
def test_a_target_tells_what_it_installs_before_it_does(
    target: str, extra: str, groups: list[str], bare_folder: Path
) -> None:
    commands = _make(bare_folder, "--dry-run", target)
    told, _, rest = commands.partition(f"granular-walkers[{extra}] and what it needs")
    assert re.findall(r"apt-get \([^)]*\): ([\w-]+)", told) == groups
    assert "apt-get install" not in told
    assert "apt-get install" in rest


# --- files for GitHub -----------------------------------------------------------------------------

FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("[!c]*.yml"))
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def _yaml(path: Path) -> dict[str, Any]:
    """A YAML file. Its key ``on`` is True: YAML 1.1 takes it for a word for yes."""
    return yaml.safe_load(path.read_text("utf-8"))


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_has_shell_steps_that_a_shell_reads(workflow: Path) -> None:
    content = _yaml(workflow)
    assert True in content
    steps: list[dict[str, Any]] = []
    for job in content["jobs"].values():
        steps += job["steps"]
    for step in steps:
        assert ("run" in step) != ("uses" in step)
        if "run" in step:
            subprocess.run(["bash", "-n", "-c", step["run"]], check=True)


def test_the_tests_run_on_each_debian_whose_python_the_package_names() -> None:
    job = _yaml(ROOT / ".github" / "workflows" / "test.yml")["jobs"]["test"]
    assert job["strategy"]["matrix"]["debian"] == ["bookworm", "trixie"]
    versions = []
    for classifier in PROJECT["classifiers"]:
        match = re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", classifier)
        if match:
            versions.append(match[1])
    assert versions == ["3.11", "3.13"]  # of these two


@pytest.mark.parametrize("form", FORMS, ids=lambda path: path.stem)
def test_a_form_of_an_issue_has_what_github_asks_for(form: Path) -> None:
    content = _yaml(form)
    assert {"name", "description", "body"} <= content.keys()
    fields = [field["id"] for field in content["body"]]
    assert len(set(fields)) == len(fields)
    for field in content["body"]:
        assert field["type"] in {"textarea", "input"}
        assert field["attributes"]["label"]


def test_dependabot_watches_the_actions_and_the_packages() -> None:
    updates = _yaml(ROOT / ".github" / "dependabot.yml")["updates"]
    assert [update["package-ecosystem"] for update in updates] == ["github-actions", "pip"]


def test_the_package_says_that_it_has_types() -> None:
    assert (ROOT / "walkers" / "py.typed").read_bytes() == b""
    assert "Typing :: Typed" in PROJECT["classifiers"]
    assert PYPROJECT["tool"]["setuptools"]["package-data"]["walkers"] == ["py.typed"]
