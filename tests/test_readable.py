"""How the code reads: what packs several thoughts into a line, and what `ruff` has no rule against.

The limits of the densities are about twice what lmfit, signac and foamlib have.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
DISPLAYS = (ast.Tuple, ast.List, ast.Set, ast.Dict, ast.IfExp, ast.BinOp)
LIMITS = {"comprehension": 25, "conditional expression": 12, "assignment of a tuple": 6}
"""Largest number per 1,000 lines of code of a folder."""
KEYWORD_BAGS = {"walkers/inputs/config_table.py with_values"}
"""Public functions that hand keyword arguments on to a library, or to templates."""


def _is_condition(node: ast.expr) -> bool:
    """Whether an expression is true or false by its form."""
    match node:
        case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
            return True
    return False


def _holds(node: ast.AST, kinds: tuple[type[ast.AST], ...]) -> bool:
    """Whether a node of some kinds stands inside a node."""
    return any(isinstance(child, kinds) for child in ast.walk(node) if child is not node)


def _in_comprehension(node: ast.AST) -> Iterator[str]:
    match node:
        case ast.ListComp() | ast.SetComp() | ast.DictComp() | ast.GeneratorExp():
            yield "comprehension"
            if len(node.generators) > 1 or _holds(node, COMPREHENSIONS):
                yield "nested comprehension"


def _in_conditional_expression(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.IfExp):
        yield "conditional expression"
        if _holds(node, (ast.IfExp,)):
            yield "nested conditional expression"


def _in_assignment(node: ast.AST) -> Iterator[str]:
    match node:
        case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple()):
            yield "assignment of a tuple"
            if len(names) > 3:
                yield "assignment of more than three values"
        case ast.Assign(targets=[ast.Name(id="_")]):
            yield "assignment to nothing"


def _in_display(node: ast.AST) -> Iterator[str]:
    unpacked: list[ast.expr] = []
    match node:
        case ast.Dict(keys=keys, values=values):
            unpacked = [value for key, value in zip(keys, values, strict=True) if key is None]
        case ast.List(elts=items) | ast.Tuple(elts=items) | ast.Set(elts=items):
            unpacked = [item.value for item in items if isinstance(item, ast.Starred)]
    if any(isinstance(value, DISPLAYS) for value in unpacked):
        yield "display that is unpacked in a display"


def _in_product(node: ast.AST) -> Iterator[str]:
    match node:
        case ast.BinOp(op=ast.Mult(), left=left, right=right):
            if _is_condition(left) or _is_condition(right):
                yield "product with a condition"


def _constructs(tree: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """What packs code: the name of the construct, and where it stands."""
    for node in ast.walk(tree):
        for names in (
            _in_comprehension(node),
            _in_conditional_expression(node),
            _in_assignment(node),
            _in_display(node),
            _in_product(node),
        ):
            for name in names:
                yield name, node


COUNTED = set(LIMITS)


def _files(folder: str) -> list[Path]:
    """Modules of a folder; pictures of the gallery are not ours."""
    return [path for path in sorted((ROOT / folder).rglob("*.py")) if "gallery" not in path.parts]


def _lines_of_code(text: str, tree: ast.AST) -> int:
    """Number of lines without blank lines, comments and docstrings."""
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT):
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                lines.difference_update(range(node.lineno, (node.end_lineno or 0) + 1))
    return len(lines)


@pytest.mark.parametrize(
    ("line", "construct"),
    [
        ("[[x for x in row] for row in rows]", "nested comprehension"),
        ("[x for row in rows for x in row]", "nested comprehension"),
        ("1 if a else 2 if b else 3", "nested conditional expression"),
        ("a, b, c, d = 1, 2, 3, 4", "assignment of more than three values"),
        ("_ = run.result", "assignment to nothing"),
        ("{**{'a': 1}, 'b': 2}", "display that is unpacked in a display"),
        ("[*(x if y else []), 1]", "display that is unpacked in a display"),
        ("'s' * (n > 1)", "product with a condition"),
        ("(not a) * 's'", "product with a condition"),
    ],
)
def test_what_packs_code_is_recognised(line: str, construct: str) -> None:
    assert construct in [name for name, _ in _constructs(ast.parse(line))]


MODULES = [*_files("walkers"), *_files("studies"), *_files("docs"), *_files("tests")]


@pytest.mark.parametrize(
    "path",
    MODULES,
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_a_line_holds_one_thought(path: Path) -> None:
    packed = []
    for construct, node in _constructs(ast.parse(path.read_text("utf-8"))):
        if construct not in COUNTED:
            packed.append(f"{path}:{node.lineno} {construct}: {ast.unparse(node)}")
    assert packed == []


@pytest.mark.parametrize("folder", ["walkers", "studies", "docs", "tests"])
def test_code_is_not_dense(folder: str) -> None:
    lines = 0
    constructs: Counter[str] = Counter()
    for path in _files(folder):
        text = path.read_text("utf-8")
        tree = ast.parse(text)
        lines += _lines_of_code(text, tree)
        constructs.update(name for name, _ in _constructs(tree))
    dense = {}
    for construct, limit in LIMITS.items():
        per_thousand = 1000 * constructs[construct] / lines
        if per_thousand > limit:
            dense[construct] = round(per_thousand, 1)
    assert dense == {}


def _bags(tree: ast.Module) -> Iterator[str]:
    """Public functions and methods of a module that take any keyword argument."""
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    for scope in (tree, *classes):
        for node in scope.body:
            match node:
                case ast.FunctionDef(name=name, args=ast.arguments(kwarg=ast.arg())):
                    if not name.startswith("_"):
                        yield name


def test_public_functions_name_their_arguments() -> None:
    bags = set()
    for path in _files("walkers") + _files("studies"):
        for name in _bags(ast.parse(path.read_text("utf-8"))):
            bags.add(f"{path.relative_to(ROOT).as_posix()} {name}")
    assert bags == KEYWORD_BAGS
