"""Walls and shapes of boundaries: what every kind answers, and that nobody asks which kind it is."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from walkers.arrays import FloatArray
from walkers.inputs.tables.shapes import walls
from walkers.inputs.tables.shapes.walls import Facet, Flat, Round, Wall

PACKAGE = Path(walls.__file__).parents[3]
KINDS = {"Flat", "Round", "Facet"}
_SQUARE = tuple(((x, y, 0.0), (-x / 2e-3, -y / 2e-3, 0.0), -1e-12) for x, y in ((2e-3, 0.0), (-2e-3, 0.0)))
WALLS: dict[str, Wall] = {
    "plane": Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning"),
    "cylinder": Round(4e-3),
    "face": Facet("face", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (_SQUARE,), "floor"),
    "edge": Facet("edge", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (_SQUARE,), "edge"),
    "corner": Facet("corner", (1e-4, 0.0, 2e-4), (0.0, 0.0, 0.0), (_SQUARE,), "corner"),
}


def places_in_front() -> FloatArray:
    """Places, shape (200, 3), m, of which some are behind some of the walls."""
    return np.random.default_rng(3).uniform(-2.5e-3, 2.5e-3, (200, 3))


@pytest.mark.parametrize("name", WALLS)
def test_a_wall_is_at_its_distance_along_its_normal(name: str) -> None:
    """A step toward the wall as long as the distance ends at the nearest point; along the wall nothing is nearer."""
    wall, places = WALLS[name], places_in_front()
    distances = wall.distances(places)
    places, distances = places[np.isfinite(distances)], distances[np.isfinite(distances)]
    assert len(places) > 20
    normals, points = wall.normals(places), wall.nearest_points(places)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(places - distances[:, None] * normals, points, rtol=0, atol=1e-15)
    np.testing.assert_allclose(wall.nearest_points(points + 1e-4 * normals), points, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["plane", "cylinder"])
def test_a_wall_in_pictures_touches_the_wall(name: str) -> None:
    """The planes that are drawn touch the wall and have the normal that it has there."""
    points, normals = WALLS[name].tangent_planes()
    assert len(points) == {"plane": 1, "cylinder": 64}[name]
    np.testing.assert_allclose(WALLS[name].distances(points), 0.0, atol=1e-15)
    np.testing.assert_allclose(WALLS[name].normals(points), normals, atol=1e-12)


@pytest.mark.parametrize(("name", "words"), [
    ("plane", "plane 0.0001 0.0002 -0.0003  0.48 -0.36 0.8"),
    ("cylinder", "cylinder 0.0 0.0 0.004"),
    ("face", ""),
])  # fmt: skip
def test_a_wall_stands_in_the_command_or_in_the_file_of_facets(name: str, words: str) -> None:
    assert WALLS[name].deck_words() == words
    assert bool(WALLS[name].file_rows()) == (not words)
    assert (WALLS[name].kernel_row() is None) == (not words)


# --- nobody asks which kind it is -------------------------------------------------------------------------------------


def questions_of_kind(tree: ast.AST) -> Iterator[int]:
    """Lines of a module that ask of which class a wall is, or which attributes it has."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            names = {part.id for inner in node.args for part in ast.walk(inner) if isinstance(part, ast.Name)}
            about_walls = names & {*KINDS, "wall", "Wall"}
            if node.func.id in ("isinstance", "hasattr", "getattr", "type") and about_walls:
                yield node.lineno
        if isinstance(node, ast.MatchClass) and isinstance(node.cls, ast.Name) and node.cls.id in KINDS:
            yield node.lineno


def test_the_questions_are_recognised() -> None:
    """By the forms that Python has for them."""
    lines = [
        "isinstance(wall, (Flat, Round))",
        "hasattr(wall, 'radius')",
        "type(wall)",
        "Flat((0, 0, 0), (0, 0, 1))",
        "match x:\n    case Round(radius=r): pass",
    ]
    assert [bool([*questions_of_kind(ast.parse(line))]) for line in lines] == [True, True, True, False, True]


def test_nobody_asks_which_kind_a_wall_is() -> None:
    """A new kind would fall into the branch of another one; the wall itself must answer (`walls.Wall`)."""
    modules = [path for path in sorted(PACKAGE.rglob("*.py")) if path != Path(walls.__file__)]
    asking = [f"{path}:{line}" for path in modules for line in questions_of_kind(ast.parse(path.read_text("utf-8")))]
    assert len(modules) > 100
    assert not asking
    templates = [path.read_text("utf-8") for path in sorted(PACKAGE.rglob("*.j2"))]
    assert len(templates) > 10
    assert not [text for text in templates if "wall.radius" in text or "wall.cells" in text or "wall.normal" in text]
