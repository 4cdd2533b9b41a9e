"""Identifiers say what they name, and the pages use the words of the glossary."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EMPTY = {
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
    "wanted",
    "way",
    "ways",
    "what",
    "whence",
}
"""Words that name nothing."""


def names_in(tree: ast.AST) -> Iterator[tuple[str | None, int]]:
    """Names that a module defines, with their lines.

    They are those of variables, attributes, arguments, functions and classes.
    """
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
    number = 0
    empty = []
    for file in sorted((ROOT / folder).rglob("*.py")):
        if "gallery" in file.parts or "examples/runs/" in file.as_posix():
            continue  # made by the build of the site
        for name, line in names_in(ast.parse(file.read_text("utf-8"))):
            number += 1
            if name and name.strip("_") in EMPTY:
                empty.append(f"{file}:{line} {name}")
    assert number > 100
    assert empty == []


def words_of_the_glossary() -> list[str]:
    """Words that CONTRIBUTING.md explains, several of them in some rows."""
    _, _, glossary = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("## Glossary")
    words = []
    for cell in re.findall(r"(?m)^\| ([^|]+) \|", glossary)[1:]:
        words += cell.split(", ")
    return words


def test_the_glossary_explains_each_word_once() -> None:
    words = words_of_the_glossary()
    assert len(words) > 20
    assert len(set(words)) == len(words)


def test_pages_use_the_words_of_the_glossary() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    text = "\n".join(page.read_text("utf-8") for page in pages)
    unused = []
    for word in words_of_the_glossary():
        if not re.search(rf"\b{word}", text, re.IGNORECASE):
            unused.append(word)
    assert unused == []
