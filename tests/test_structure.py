"""CONTRIBUTING describes the house as it is, and the code takes decisions from values."""

from __future__ import annotations

import ast
import re
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
CUTTING = {
    "partition",
    "rpartition",
    "split",
    "rsplit",
    "replace",
    "startswith",
    "endswith",
    "removeprefix",
    "removesuffix",
    "find",
    "index",
    "count",
}
"""Methods that search a text or cut it."""
TEXTS = {
    "message",
    "reason",
    "expected",
    "meaning",
    "label",
    "notes",
    "warnings",
    "problems",
    "args",
}
"""Attributes that are sentences, or hold them."""
ALLOWED = {
    # Parsl repeats its first error, and has no other form of it.
    ("walkers/sweeps/workers.py", "str(error).partition('Error 2:')"),
    # A label with a place for the number of a bead, such as "rotation of bead *".
    (
        "walkers/postprocess/measure/quantities.py",
        "label.replace('*', number[1] if number else '*')",
    ),
}
"""What takes no decision."""


def _is_message(value: ast.expr, errors: set[str]) -> bool:
    """Whether an expression is the text of an error, or an attribute that is a sentence."""
    match value:
        case ast.Call(func=ast.Name("str"), args=[ast.Name(name)]):
            return name in errors
        case ast.Call(func=ast.Attribute(attr="join"), args=[argument]):
            return _is_message(argument, errors)
        case ast.Subscript(value=inner):
            return _is_message(inner, errors)
        case ast.Attribute(attr=name) | ast.Name(name):
            return name in TEXTS
    return False


def _decisions_from_texts(tree: ast.AST) -> Iterator[str]:
    """Expressions that search or cut a message."""
    errors = {"error", "failure", "stop", "warning", "problem"}
    for node in ast.walk(tree):
        if isinstance(node, ast.ExceptHandler) and node.name:
            errors.add(node.name)
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Attribute(value=value, attr=method), args=[_, *_]):
                if method in CUTTING and _is_message(value, errors):
                    yield ast.unparse(node)
            case ast.Compare(
                left=ast.Constant(str()), ops=[ast.In() | ast.NotIn()], comparators=[value]
            ):
                if _is_message(value, errors):
                    yield ast.unparse(node)
            case ast.Assign(targets=[ast.Attribute(attr="args")]):
                yield ast.unparse(node)


@pytest.mark.parametrize(
    "line",
    [
        "'timestamp' in str(error)",
        "str(failure).split(' (see ')[0]",
        "failure.message.partition(' (see ')",
        "'facing up' in quantity.meaning",
        "error.problems[0].expected.replace('a', 'b')",
        "'edited' in ' '.join(run.notes)",
        "stop.args = ('words',)",
    ],
)
def test_what_searches_or_cuts_a_message_is_recognised(line: str) -> None:
    (decision,) = _decisions_from_texts(ast.parse(line))
    assert decision in line


def test_no_message_is_searched_or_cut() -> None:
    decisions = set()
    for path in (ROOT / "walkers").rglob("*.py"):
        for text in _decisions_from_texts(ast.parse(path.read_text("utf-8"))):
            decisions.add((path.relative_to(ROOT).as_posix(), text))
    assert decisions == ALLOWED


def _first_cells(heads: str) -> list[str]:
    """First cells of the rows of a table of CONTRIBUTING, which follow its heads."""
    _, _, table = CONTRIBUTING.partition(heads)
    rows = table.split("\n\n")[0]
    return re.findall(r"(?m)^\| (`[^|]+) \|", rows)


def _rooms_of_the_table() -> list[str]:
    """Names of the rooms of ``walkers/``, in the order of the table of CONTRIBUTING."""
    rooms = []
    for cell in _first_cells("| room | holds |"):
        room = re.fullmatch(r"`walkers/(\w+)(?:\.py)?`", cell)
        if room:
            rooms.append(room[1])
    return rooms


def test_contributing_names_every_room_and_no_other() -> None:
    packages = {path.parent.name for path in (ROOT / "walkers").glob("*/__init__.py")}
    assert set(_rooms_of_the_table()) == packages | {"api", "main"}


def test_rooms_are_listed_in_the_order_in_which_they_know_each_other() -> None:
    """The first contract of import-linter has the layers; what knows all others comes first."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    contract = project["tool"]["importlinter"]["contracts"][0]
    layer_of_room = {}
    for number, layer in enumerate(reversed(contract["layers"])):
        for room in layer.split(" | "):
            layer_of_room[room] = number
    rooms = _rooms_of_the_table()
    assert rooms == sorted(rooms, key=lambda room: layer_of_room[room])


def test_contributing_gives_a_reason_for_every_entry_at_the_top() -> None:
    entries = re.findall(r"`([\w.]+)`", "".join(_first_cells("| entry | reason |")))
    command = ["git", "ls-files"]
    files = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert set(entries) == {file.partition("/")[0] for file in files.splitlines()}


def test_places_that_contributing_names_exist() -> None:
    """More than 50 are named."""
    places = set(re.findall(r"`((?:walkers|studies|tests|docs)/[\w./-]+)`", CONTRIBUTING))
    assert len(places) > 50
    for place in places:
        assert (ROOT / place).exists(), place


def test_folders_that_tests_fill_once_have_different_names() -> None:
    names = []
    for path in sorted((ROOT / "tests").glob("*.py")):
        names += re.findall(r'\bonce\(\s*"([^"]+)"', path.read_text("utf-8"))
    assert len(names) > 20
    assert sorted(names) == sorted(set(names))
