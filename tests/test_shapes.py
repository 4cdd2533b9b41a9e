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
# The facets end at x = ±2 mm.
STRIP = (
    HalfSpace((2e-3, 0.0, 0.0), (-1.0, 0.0, 0.0), -1e-12),
    HalfSpace((-2e-3, 0.0, 0.0), (1.0, 0.0, 0.0), -1e-12),
)
PLANE = Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning")
CYLINDER = Round(4e-3)
FACE = Facet("face", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (STRIP,), "floor")
EDGE = Facet("edge", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (STRIP,), "edge")
CORNER = Facet("corner", (1e-4, 0.0, 2e-4), (0.0, 0.0, 0.0), (STRIP,), "corner")


@pytest.fixture(
    params=[
        pytest.param(PLANE, id="plane"),
        pytest.param(CYLINDER, id="cylinder"),
        pytest.param(FACE, id="face"),
        pytest.param(EDGE, id="edge"),
        pytest.param(CORNER, id="corner"),
    ]
)
def wall(request: pytest.FixtureRequest) -> Wall:
    """A wall of each kind."""
    return request.param


def places_in_front_of(wall: Wall) -> FloatArray:
    """Places from which a wall is at some distance, shape (n, 3), m."""
    places = np.random.default_rng(3).uniform(-2.5e-3, 2.5e-3, (200, 3))
    in_front = places[np.isfinite(wall.distances(places))]
    assert len(in_front) > 20
    return in_front


def test_normals_of_a_wall_are_unit_vectors(wall: Wall) -> None:
    normals = wall.normals(places_in_front_of(wall))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)


def test_a_wall_is_at_its_distance_along_its_normal(wall: Wall) -> None:
    """A step against the normal as long as the distance ends at the nearest point."""
    places = places_in_front_of(wall)
    ends = places - wall.distances(places)[:, None] * wall.normals(places)
    np.testing.assert_allclose(ends, wall.nearest_points(places), rtol=0, atol=1e-15)


def test_the_nearest_point_stays_the_same_along_its_normal(wall: Wall) -> None:
    places = places_in_front_of(wall)
    points = wall.nearest_points(places)
    closer_places = points + 1e-4 * wall.normals(places)
    np.testing.assert_allclose(wall.nearest_points(closer_places), points, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("wall", "count"),
    [pytest.param(PLANE, 1, id="plane"), pytest.param(CYLINDER, 64, id="cylinder")],
)
def test_planes_in_pictures_touch_the_wall(wall: Wall, count: int) -> None:
    """The planes that are drawn for a wall have the normal that it has at their points."""
    points, normals = wall.tangent_planes()
    assert len(points) == count
    np.testing.assert_allclose(wall.distances(points), 0.0, atol=1e-15)
    np.testing.assert_allclose(wall.normals(points), normals, atol=1e-12)


@pytest.mark.parametrize(
    ("wall", "words"),
    [
        pytest.param(PLANE, "plane 0.0001 0.0002 -0.0003  0.48 -0.36 0.8", id="plane"),
        pytest.param(CYLINDER, "cylinder 0.0 0.0 0.004", id="cylinder"),
    ],
)
def test_a_simple_wall_stands_in_the_command_alone(wall: Wall, words: str) -> None:
    assert wall.deck_words() == words
    assert not wall.file_rows()
    assert wall.kernel_row() is not None


def test_a_facet_stands_in_the_file_of_facets_alone() -> None:
    assert FACE.deck_words() == ""
    assert FACE.file_rows()
    assert FACE.kernel_row() is None


# --- shapes -------------------------------------------------------------------------------------
SHAPE_SIZES: dict[str, dict[str, float]] = {
    "plane": {},
    "channel": {"width": 3e-3},
    "groove": {"opening": radians(100.0)},
}
"""Sizes of a boundary of each shape but the vessel, m and rad."""
CONTAINERS = []
"""Names of the shapes of containers that are described by their width and height."""
for _name, _shape in SHAPES.items():
    if issubclass(_shape, Container) and _shape.sizes:
        CONTAINERS.append(_name)
        SHAPE_SIZES[_name] = {"width": 4e-3, "height": 3e-3}


def make_boundary(name: str) -> Boundary:
    """A boundary of a shape, of glass, with the sizes of `SHAPE_SIZES`."""
    return Boundary(shape=name, material="glass", **SHAPE_SIZES[name])


@pytest.mark.parametrize("name", CONTAINERS)
def test_the_cross_section_of_a_container_is_that_between_its_walls(name: str) -> None:
    """Counted by the places of a lattice of 10 µm in 4 mm × 4 mm."""
    geometry = make_boundary(name).geometry
    line = (np.arange(400) + 0.5) / 400 * 4e-3 - 2e-3
    places = np.stack(np.meshgrid(line, line, 1e-3), axis=-1).reshape(-1, 3)
    counted = (geometry.side_clearance(places) > 0.0).mean() * (4e-3) ** 2
    assert geometry.cross_section == pytest.approx(counted, rel=2e-3)
    assert geometry.volume(2e-3) == pytest.approx(2e-3 * counted, rel=2e-3)


LARGEST = 2e-4
"""Radius of the largest bead that is poured, m."""


@pytest.mark.parametrize("name", CONTAINERS)
def test_beads_are_poured_from_places_within_the_walls(name: str) -> None:
    geometry = make_boundary(name).geometry
    layer = next(iter(geometry.layers(LARGEST, 0.0)))
    places = np.array([(x, y, layer.level) for x, y in layer.places])
    assert len(places) > 20
    assert (geometry.side_clearance(places) > LARGEST).all()


@pytest.mark.parametrize("name", CONTAINERS)
def test_neighbours_that_are_poured_do_not_overlap(name: str) -> None:
    """Even if both are displaced toward each other as far as a layer displaces them at random."""
    layer = next(iter(make_boundary(name).geometry.layers(LARGEST, 0.0)))
    places = np.array(layer.places)
    distances = np.linalg.norm(places[:, None] - places, axis=-1)
    np.fill_diagonal(distances, np.inf)
    least = distances.min() - 2.0 * layer.play(LARGEST, LARGEST)
    assert least > 2.0 * LARGEST * (1.0 - 1e-9)


@pytest.mark.parametrize("name", CONTAINERS)
def test_layers_of_poured_beads_are_one_upon_the_other(name: str) -> None:
    """A diameter of the largest bead apart, and 3 % more."""
    first, second = islice(make_boundary(name).geometry.layers(LARGEST, 0.0), 2)
    assert second.level - first.level == pytest.approx(2.06 * LARGEST)


@pytest.mark.parametrize("name", SHAPE_SIZES)
def test_a_bead_at_rest_touches_the_boundary(name: str) -> None:
    """At the height at which it rests, the walls below it are a radius away: two in a groove."""
    boundary = make_boundary(name)
    radius = 3e-4
    place = np.array([0.0, 0.0, boundary.geometry.rest_height(radius)])
    touched = [wall for wall in boundary.walls if wall.distances(place) < 1.01 * radius]
    assert len(touched) == {"groove": 2}.get(name, 1)
    for wall in touched:
        assert wall.distances(place) == pytest.approx(radius)
        assert wall.normals(place)[2] > 0.5


INSIDE = np.array([1e-4, 2e-4, 1e-3])
"""A place of a bead in all boundaries, m."""


def polygons_of(boundary: Boundary) -> list[FloatArray]:
    """Corners of the walls in pictures, drawn within ±2 mm, m."""
    return boundary.geometry.outline(np.full(3, -2e-3), np.full(3, 2e-3), INSIDE)


@pytest.mark.parametrize("name", SHAPE_SIZES)
def test_each_wall_is_a_polygon_in_pictures(name: str) -> None:
    """The round wall of a cylinder is 64 of them."""
    boundary = make_boundary(name)
    expected = len(boundary.walls)
    if name == "cylinder":
        expected += 63
    assert len(polygons_of(boundary)) == expected


@pytest.mark.parametrize("name", SHAPE_SIZES)
def test_polygons_of_walls_look_at_the_beads(name: str) -> None:
    """Their corners are counterclockwise as seen from a bead."""
    for corners in polygons_of(make_boundary(name)):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        assert normal @ (INSIDE - corners[0]) > 0.0


@pytest.mark.parametrize("name", SHAPE_SIZES)
def test_corners_of_polygons_are_on_the_walls(name: str) -> None:
    """Within 5 µm, by which the planes around a cylinder stand off at their corners."""
    boundary = make_boundary(name)
    for corners in polygons_of(boundary):
        gaps = np.array([wall.distances(corners) for wall in boundary.walls])
        np.testing.assert_allclose(np.abs(gaps).min(axis=0), 0.0, atol=5e-6)


# --- nobody asks which kind it is ---------------------------------------------------------------
KINDS = {"Flat", "Round", "Facet"}
QUESTIONS = {"isinstance", "hasattr", "getattr", "type"}


def _names_in_arguments(call: ast.Call) -> set[str]:
    """Names that occur in the arguments of a call."""
    names = set()
    for argument in call.args:
        for node in ast.walk(argument):
            if isinstance(node, ast.Name):
                names.add(node.id)
    return names


def questions_of_kind(tree: ast.AST) -> Iterator[int]:
    """Lines of a module that ask of which class a wall is, or which attributes it has."""
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=function)) if function in QUESTIONS:
                if _names_in_arguments(node) & {*KINDS, "wall", "Wall"}:
                    yield node.lineno
            case ast.MatchClass(cls=ast.Name(id=kind)) if kind in KINDS:
                yield node.lineno


@pytest.mark.parametrize(
    "code",
    [
        "isinstance(wall, (Flat, Round))",
        "hasattr(wall, 'radius')",
        "type(wall)",
        "match x:\n    case Round(radius=r): pass",
    ],
)
def test_a_question_of_kind_is_recognised(code: str) -> None:
    assert [*questions_of_kind(ast.parse(code))]


def test_making_a_wall_is_no_question_of_kind() -> None:
    assert not [*questions_of_kind(ast.parse("Flat((0, 0, 0), (0, 0, 1))"))]


def test_nobody_asks_which_kind_a_wall_is() -> None:
    """A new kind would fall into the branch of another one; the wall itself must answer."""
    modules = sorted(PACKAGE.rglob("*.py"))
    modules.remove(Path(walls.__file__))
    questions = []
    for path in modules:
        for line in questions_of_kind(ast.parse(path.read_text("utf-8"))):
            questions.append(f"{path}:{line}")
    assert len(modules) > 100
    assert questions == []


def test_templates_do_not_look_into_walls() -> None:
    templates = sorted(PACKAGE.rglob("*.j2"))
    assert len(templates) > 10
    for path in templates:
        code = re.sub(r"\{#.*?#\}", "", path.read_text("utf-8"), flags=re.DOTALL)  # no comments
        assert "wall." not in code, path


# --- heights and places -------------------------------------------------------------------------
@pytest.mark.parametrize("count", range(140, 171, 3))
def test_the_height_that_is_asked_for_is_enough(count: int) -> None:
    """It is printed with two decimals, rounded up."""
    with pytest.raises(InputError, match="too low") as refusal:
        load_case("pile-ci", {"mixture.count": count, "boundary.height": "3 mm"})
    height = re.search(r"expected (\S+ mm) or more", str(refusal.value))
    assert height is not None
    load_case("pile-ci", {"mixture.count": count, "boundary.height": height[1]})


def test_two_walkers_stand_side_by_side_on_a_plane() -> None:
    plane = Boundary(material="glass")
    assert sorted(plane.geometry.grid(2, 1.0)) == [(0.0, -0.5), (0.0, 0.5)]


def test_walkers_stand_in_a_square_on_a_plane() -> None:
    """Five walkers in two rows about the origin."""
    plane = Boundary(material="glass")
    rows = {x for x, _ in plane.geometry.grid(5, 1.0)}
    assert rows == {-0.5, 0.5}


def test_walkers_stand_in_a_row_in_a_channel() -> None:
    channel = Boundary(shape="channel", material="glass", width=4e-3)
    assert sorted(channel.geometry.grid(3, 1.0)) == [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)]
