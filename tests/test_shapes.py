"""Walls and shapes of boundaries: what all kinds answer, and that nobody asks for the kind."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import islice
from math import radians
from pathlib import Path

import numpy as np
import pytest

from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.meshes.facet import Facet, HalfSpace
from walkers.inputs.reading import load_case
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.shapes import walls
from walkers.inputs.tables.shapes.container import Container
from walkers.inputs.tables.shapes.registry import SHAPES
from walkers.inputs.tables.shapes.walls import Flat, Round, Wall

PACKAGE = Path(walls.__file__).parents[3]
KINDS = {"Flat", "Round", "Facet"}
_STRIP = (
    HalfSpace((2e-3, 0.0, 0.0), (-1.0, 0.0, 0.0), -1e-12),
    HalfSpace((-2e-3, 0.0, 0.0), (1.0, 0.0, 0.0), -1e-12),
)
WALLS: dict[str, Wall] = {
    "plane": Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning"),
    "cylinder": Round(4e-3),
    "face": Facet("face", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (_STRIP,), "floor"),
    "edge": Facet("edge", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (_STRIP,), "edge"),
    "corner": Facet("corner", (1e-4, 0.0, 2e-4), (0.0, 0.0, 0.0), (_STRIP,), "corner"),
}


def places_in_front() -> FloatArray:
    """Places, shape (200, 3), m, of which some are behind some of the walls."""
    return np.random.default_rng(3).uniform(-2.5e-3, 2.5e-3, (200, 3))


@pytest.mark.parametrize("name", WALLS)
def test_a_wall_is_at_its_distance_along_its_normal(name: str) -> None:
    """A step toward the wall as long as the distance ends at the nearest point."""
    wall, places = WALLS[name], places_in_front()
    distances = wall.distances(places)
    places, distances = places[np.isfinite(distances)], distances[np.isfinite(distances)]
    assert len(places) > 20
    normals, points = wall.normals(places), wall.nearest_points(places)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(places - distances[:, None] * normals, points, rtol=0, atol=1e-15)
    nearest = wall.nearest_points(points + 1e-4 * normals)
    np.testing.assert_allclose(nearest, points, rtol=0, atol=1e-12)


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


# --- shapes -----------------------------------------------------------------------------------------------------------

PRISMS = [name for name, shape in SHAPES.items() if issubclass(shape, Container) and shape.sizes]
SHAPE_TABLES: dict[str, dict[str, float]] = {
    "plane": {},
    "channel": {"width": 3e-3},
    "groove": {"opening": radians(100.0)},
    **{name: {"width": 4e-3, "height": 3e-3} for name in PRISMS},
}


def boundary_of(name: str) -> Boundary:
    return Boundary(shape=name, material="glass", **SHAPE_TABLES[name])


@pytest.mark.parametrize("name", PRISMS)
def test_the_cross_section_of_a_container_is_that_between_its_walls(name: str) -> None:
    """Counted by places on a fine lattice."""
    boundary = boundary_of(name)
    line = (np.arange(400) + 0.5) / 400 * 4e-3 - 2e-3
    places = np.stack(np.meshgrid(line, line, 1e-3), axis=-1).reshape(-1, 3)
    counted = (boundary.geometry.side_clearance(places) > 0.0).mean() * (4e-3) ** 2
    assert boundary.geometry.cross_section == pytest.approx(counted, rel=2e-3)
    assert boundary.geometry.volume(2e-3) == pytest.approx(2e-3 * counted, rel=2e-3)


@pytest.mark.parametrize("name", PRISMS)
def test_beads_are_poured_from_places_within_the_walls(name: str) -> None:
    """Neighbours do not overlap, however they are displaced, and layers are one upon the other."""
    largest, boundary = 2e-4, boundary_of(name)
    first, second = islice(boundary.geometry.layers(largest, 0.0), 2)
    places = np.array([(x, y, first.level) for x, y in first.places])
    assert len(places) > 20
    assert (boundary.geometry.side_clearance(places) > largest).all()
    assert second.level - first.level == pytest.approx(2.06 * largest)
    distances = np.linalg.norm(places[:, None] - places, axis=-1) + np.eye(len(places))
    assert distances.min() - 2.0 * first.play(largest, largest) > 2.0 * largest * (1.0 - 1e-9)


@pytest.mark.parametrize("name", SHAPE_TABLES)
def test_a_bead_at_rest_touches_the_boundary(name: str) -> None:
    """At the height at which it rests, the walls below it are a radius away."""
    boundary, radius = boundary_of(name), 3e-4
    place = np.array([0.0, 0.0, boundary.geometry.rest_height(radius)])
    touched = [wall for wall in boundary.walls if wall.distances(place) < 1.01 * radius]
    assert len(touched) == (2 if name == "groove" else 1)
    for wall in touched:
        assert wall.distances(place) == pytest.approx(radius)
        assert wall.normals(place)[2] > 0.5


@pytest.mark.parametrize("name", SHAPE_TABLES)
def test_walls_in_pictures_are_polygons_that_look_at_the_beads(name: str) -> None:
    boundary, inside = boundary_of(name), np.array([1e-4, 2e-4, 1e-3])
    faces = boundary.geometry.outline(np.full(3, -2e-3), np.full(3, 2e-3), inside)
    assert len(faces) == len(boundary.walls) + (63 if name == "cylinder" else 0)
    for corners in faces:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        assert normal @ (inside - corners[0]) > 0.0
        gaps = np.array([wall.distances(corners) for wall in boundary.walls])
        np.testing.assert_allclose(np.abs(gaps).min(axis=0), 0.0, atol=5e-6)


# --- nobody asks which kind it is -------------------------------------------------------------------------------------


def questions_of_kind(tree: ast.AST) -> Iterator[int]:
    """Lines of a module that ask of which class a wall is, or which attributes it has."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            parts = [part for argument in node.args for part in ast.walk(argument)]
            names = {part.id for part in parts if isinstance(part, ast.Name)}
            asks = node.func.id in ("isinstance", "hasattr", "getattr", "type")
            if asks and names & {*KINDS, "wall", "Wall"}:
                yield node.lineno
        if isinstance(node, ast.MatchClass) and ast.unparse(node.cls) in KINDS:
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
    recognised = [bool([*questions_of_kind(ast.parse(line))]) for line in lines]
    assert recognised == [True, True, True, False, True]


def test_nobody_asks_which_kind_a_wall_is() -> None:
    """A new kind would fall into the branch of another one; the wall itself must answer."""
    modules = [path for path in sorted(PACKAGE.rglob("*.py")) if path != Path(walls.__file__)]
    asking = []
    for path in modules:
        lines = questions_of_kind(ast.parse(path.read_text("utf-8")))
        asking += [f"{path}:{line}" for line in lines]
    assert len(modules) > 100
    assert not asking
    templates = [path.read_text("utf-8") for path in sorted(PACKAGE.rglob("*.j2"))]
    assert len(templates) > 10
    assert not [text for text in templates if "wall." in text]


@pytest.mark.parametrize("count", range(140, 171, 3))
def test_the_height_that_is_asked_for_is_enough(count: int) -> None:
    """It is printed with two decimals, rounded up."""
    with pytest.raises(InputError, match="too low") as refusal:
        load_case("pile-ci", {"mixture.count": count, "boundary.height": "3 mm"})
    height = re.search(r"expected (\S+ mm) or more", str(refusal.value))
    assert height is not None
    load_case("pile-ci", {"mixture.count": count, "boundary.height": height[1]})


def test_walkers_stand_in_a_square_on_a_plane_and_in_a_row_in_a_channel() -> None:
    """Places about the origin, row by row along x."""
    plane = Boundary(material="glass")
    assert sorted(plane.geometry.grid(2, 1.0)) == [(0.0, -0.5), (0.0, 0.5)]
    rows = [x for x, _ in plane.geometry.grid(5, 1.0)]
    assert sorted(set(rows)) == [-0.5, 0.5]
    channel = Boundary(shape="channel", material="glass", width=4e-3)
    assert sorted(channel.geometry.grid(3, 1.0)) == [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)]
