"""Words: identifiers say what they name, and the pages use the words of the glossary in CONTRIBUTING.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EMPTY = {
    *(
        "asked",
        "data",
        "each",
        "foo",
        "found",
        "gone",
        "helper",
        "here",
        "info",
        "known",
        "made",
        "one",
        "other",
    ),
    *(
        "others",
        "own",
        "said",
        "stuff",
        "temp",
        "there",
        "these",
        "thing",
        "things",
        "those",
        "tmp",
        "told",
        "utils",
    ),
    *("wanted", "way", "ways", "what", "whence"),
}
"""Words that name nothing."""


def names_in(tree: ast.AST) -> Iterator[tuple[str | None, int]]:
    """Names that a module defines, with their lines: variables, attributes, arguments, functions and classes."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name="__eq__"):
                node.args.args.pop()  # other, by convention
            case (
                ast.Name(id=name, ctx=ast.Store())
                | ast.Attribute(attr=name, ctx=ast.Store())
                | ast.arg(arg=name)
            ):
                yield name, node.lineno
            case (
                ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.ExceptHandler(name=name)
            ):
                yield name, node.lineno


@pytest.mark.parametrize("folder", ["walkers", "studies", "docs"])
def test_identifiers_say_what_they_name(folder: str) -> None:
    files = [file for file in sorted((ROOT / folder).rglob("*.py")) if "gallery" not in file.parts]
    names = [
        (file, name, line)
        for file in files
        for name, line in names_in(ast.parse(file.read_text("utf-8")))
    ]
    assert len(names) > 100
    empty = [
        f"{file}:{line} {name}" for file, name, line in names if name and name.strip("_") in EMPTY
    ]
    assert not empty


def test_pages_use_the_words_of_the_glossary() -> None:
    _, _, glossary = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("## Glossary")
    words = [
        word for row in re.findall(r"(?m)^\| ([^|]+) \|", glossary)[1:] for word in row.split(", ")
    ]
    text = "\n".join(
        page.read_text("utf-8") for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    )
    assert 20 < len(words) == len(set(words))
    assert [word for word in words if not re.search(rf"\b{word}", text, re.IGNORECASE)] == []
