"""Vessels of the user's own: surfaces from files, and the forces of faces, edges and corners."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import cos, pi, sin, sqrt, tan
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import walkers
from tests.conftest import to_toml
from walkers import Run
from walkers.arrays import FloatArray, IntArray, Vector
from walkers.errors import InputError
from walkers.inputs.case_building import build_case, changed_case, stored_case
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.standing import starting_groups
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.shapes.shape import LOOSE_PITCH
from walkers.inputs.tables.shapes.walls import FLOOR
from walkers.postprocess.measure.motion import read_bridges
from walkers.postprocess.show.meshes import walls_of
from walkers.postprocess.show.necks import bridge_ends
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import run_place
from walkers.runs.preview import preview_text, summarise
from walkers.second_engine.crosscheck import compare_motions
from walkers.second_engine.scenes import DRY, Bench, bench_case, full_case, prescribed, scene_of
from walkers.templates.deck import render_deck
from walkers.templates.placement import Bead

RunCase = Callable[..., Path]
Profile = list[tuple[float, float]]
"""Corners of a profile in x and z, m."""


# --- surfaces; `tests.test_meshes` uses them too ------------------------------------------------
def halves_of(a: IntArray, b: IntArray, c: IntArray, d: IntArray) -> IntArray:
    """Two triangles for each quadrangle; its corners a, b, c, d are numbers of points."""
    first = np.stack([a, b, c], axis=-1).reshape(-1, 3)
    second = np.stack([a, c, d], axis=-1).reshape(-1, 3)
    return np.concatenate([first, second])


def cuboid(low: FloatArray, high: FloatArray, toward: float = 1.0) -> Vessel:
    """A block with beads around it, or (-1) a room with beads in it."""
    points = np.array(list(product(*zip(low, high, strict=True))))
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = halves_of(*np.array(quads).T)
    if toward < 0.0:
        triangles = triangles[:, ::-1]
    return Vessel(points, triangles)


def extruded(profile: Profile, half: float = 5e-3) -> Vessel:
    """A profile in x and z, extended along y, with beads above it."""
    points = []
    for x, z in profile:
        points += [(x, -half, z), (x, half, z)]
    near = 2 * np.arange(len(profile) - 1)  # the points at y = -half
    triangles = halves_of(near + 1, near, near + 2, near + 3)
    return Vessel(np.array(points), triangles)


def prism(sides: int, inner: float, height: float) -> Vessel:
    """A prism open above, of the inner radius and the height, m.

    The floor comes first, then the sides from -x on; those of a box are -x, +x, -y and +y.
    """
    turns = pi + 2.0 * pi * (np.arange(sides) - 0.5) / sides
    ring = inner / cos(pi / sides) * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    points = np.round(np.concatenate([ring, ring + np.array([0.0, 0.0, height])]), 9)
    low = np.arange(sides)
    if sides == 4:
        low = np.array([0, 2, 1, 3])
    after = (low + 1) % sides
    floor = [[0, corner, corner + 1] for corner in range(1, sides - 1)]
    walls = halves_of(after, low, sides + low, sides + after)
    return Vessel(points, np.concatenate([floor, walls]))


def bowl(radius: float, rings: int) -> Vessel:
    """Half a sphere of facets, four sides around it for each ring."""
    bends = np.linspace(0.0, pi / 2.0, rings + 1)
    turns = pi / (2.0 * rings) * np.arange(4 * rings)
    ring = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    points = []
    for bend in bends:
        points.append(radius * sin(bend) * ring + [0.0, 0.0, radius * (1.0 - cos(bend))])
    number = np.arange((rings + 1) * len(turns)).reshape(rings + 1, -1)
    after = np.roll(number, -1, axis=1)
    triangles = halves_of(number[:-1], after[:-1], after[1:], number[1:])
    return Vessel(np.concatenate(points), triangles)


def square_dish(half: float, points: int, depth: Callable[[FloatArray], FloatArray]) -> Vessel:
    """A square of 2·half by 2·half (m) whose height is a function of the distance from its middle.

    There are so many points along each side, and two triangles between four of them.
    """
    across = np.linspace(-half, half, points)
    x, y = np.meshgrid(across, across)
    z = depth(np.hypot(x, y))
    number = np.arange(points**2).reshape(points, points)
    triangles = halves_of(number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    return Vessel(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), triangles)


# --- forces on beads that are held or moved -----------------------------------------------------
R = 1e-4
"""Radius of the beads, m."""
DEEP = 1e-6
"""Overlap of a bead and a wall, m."""
HERTZ = 4.0 / 3.0 * 50e6 / (2.0 * (1.0 - 0.3**2)) * sqrt(R) * DEEP**1.5
"""Repulsion of a bead from a plane that it overlaps by `DEEP`, N.

By Hertz, 4/3 E* √R δ^1.5 with 1/E* = 2 (1 - ν²) / E; `bench_case` has E = 50 MPa and ν = 0.3.
"""


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(find_engine(), tmp_path)


def forces_on(
    bench: Bench,
    case: Case,
    vessel: Vessel,
    centres: FloatArray,
    *,
    velocity: Vector = (0.0, 0.0, 0.0),
    steps: int = 2,
) -> FloatArray:
    """Forces on n beads that keep a velocity (m/s), N, shape (steps, n, 3)."""
    beads = [Bead(0, tuple(centre), R, velocity) for centre in centres.tolist()]
    plan = prescribed(case, scene_of(beads, vessel.facets), steps)
    return bench.run(plan).forces[..., :3]


def places_around(half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places of 40 beads that overlap a block by `DEEP`, m, and the directions from it to them.

    Each touches the block in a random point of a face, an edge or a corner. The direction is across
    the face or the edge, or anywhere outward from the corner. Beads do not touch each other.
    """
    draw = np.random.default_rng(1)
    centres: list[FloatArray] = []
    directions: list[FloatArray] = []
    while len(centres) < 40:
        way = draw.normal(size=3)
        nearest = half * np.clip(draw.uniform(-2.0, 2.0, size=3), -1.0, 1.0)
        outward = np.where(np.abs(nearest) == half, np.sign(nearest) * np.abs(way), 0.0)
        if not outward.any():
            continue  # a point within the block
        direction = outward / np.linalg.norm(outward)
        centre = nearest + (R - DEEP) * direction
        if all(np.linalg.norm(centre - neighbour) > 2.1 * R for neighbour in centres):
            centres.append(centre)
            directions.append(direction)
    return np.array(centres), np.array(directions)


def test_faces_edges_and_corners_repel_as_planes_do(bench: Bench) -> None:
    """Each bead around a block that is turned touches the nearest point of it once."""
    half = np.array([4e-4, 3e-4, 2e-4])
    centres, directions = places_around(half)
    components = np.count_nonzero(directions, axis=1)  # 1 across a face, 2 across an edge
    assert (np.bincount(components)[1:] > 2).all()
    turn = Rotation.from_rotvec([0.4, -0.7, 0.9])
    block = cuboid(-half, half)
    turned_block = Vessel(turn.apply(block.points), block.triangles)
    forces = forces_on(bench, bench_case(DRY), turned_block, turn.apply(centres))[0]
    expected = HERTZ * turn.apply(directions)
    np.testing.assert_allclose(forces, expected, rtol=0, atol=1e-12 * HERTZ)


# Profiles (x, z) of surfaces, m; beads are above them.
FLAT = [(-1e-3, 0.0), (2e-5, 0.0), (1e-3, 0.0)]
RIDGE = [(-1e-3, -1e-3), (0.0, 0.0), (1e-3, -1e-3)]
VALLEY = [(-1e-3, 1e-3), (0.0, 0.0), (1e-3, 1e-3)]
SHALLOW_VALLEY = [(-1e-3, 1e-3 * tan(0.1)), (0.0, 0.0), (1e-3, 0.0)]
STEP = [(-1e-3, 0.0), (0.0, 0.0), (0.0, 2e-4), (1e-3, 2e-4)]
SLOT = [(-1e-3, 0.0), (-6e-5, 0.0), (-6e-5, -1e-3), (6e-5, -1e-3), (6e-5, 0.0), (1e-3, 0.0)]
NEAR = R - DEEP
"""Distance of the centre of a bead from what it touches, m."""
OVER_SLOT = sqrt(NEAR**2 - 6e-5**2)
"""Height of a bead that touches both edges of the slot, m."""
DIAGONAL = sqrt(0.5)
TOUCHES = [
    # A profile, the place (x, z) of a bead, and the directions in which it is pushed as by a plane.
    pytest.param(FLAT, (-3e-4, NEAR), [(0.0, 1.0)], id="a face"),
    pytest.param(FLAT, (2e-5, NEAR), [(0.0, 1.0)], id="two triangles of a face"),
    pytest.param(FLAT, (0.0, -NEAR), [], id="behind a face"),
    pytest.param(RIDGE, (0.0, NEAR), [(0.0, 1.0)], id="upon a ridge"),
    pytest.param(
        RIDGE,
        (NEAR * sin(0.3), NEAR * cos(0.3)),
        [(sin(0.3), cos(0.3))],
        id="beside a ridge",
    ),
    pytest.param(
        RIDGE,
        (DIAGONAL * NEAR, DIAGONAL * NEAR),
        [(DIAGONAL, DIAGONAL)],
        id="where a face ends at a ridge",
    ),
    pytest.param(
        VALLEY,
        (0.0, NEAR / DIAGONAL),
        [(DIAGONAL, DIAGONAL), (-DIAGONAL, DIAGONAL)],
        id="a valley",
    ),
    pytest.param(SHALLOW_VALLEY, (3e-5, NEAR), [(0.0, 1.0)], id="a face beside a valley"),
    pytest.param(STEP, (-NEAR, NEAR), [(0.0, 1.0), (-1.0, 0.0)], id="the foot of a step"),
    pytest.param(
        STEP,
        (-NEAR * sin(0.5), 2e-4 + NEAR * cos(0.5)),
        [(-sin(0.5), cos(0.5))],
        id="the edge of a step",
    ),
    pytest.param(
        SLOT,
        (0.0, OVER_SLOT),
        [(6e-5 / NEAR, OVER_SLOT / NEAR), (-6e-5 / NEAR, OVER_SLOT / NEAR)],
        id="over a slot",
    ),
]


@pytest.mark.parametrize(("profile", "place", "pushes"), TOUCHES)
def test_a_bead_touches_what_is_nearest_around_it_once(
    bench: Bench, profile: Profile, place: tuple[float, float], pushes: Profile
) -> None:
    x, z = place
    centre = np.array([(x, 0.0, z)])
    force = forces_on(bench, bench_case(DRY), extruded(profile), centre)[0, 0]
    expected = np.zeros(3)
    for push_x, push_z in pushes:
        expected += HERTZ * np.array([push_x, 0.0, push_z])
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-12 * HERTZ)


@pytest.mark.parametrize(("profile", "place", "pushes"), TOUCHES)
def test_as_many_facets_are_nearest_to_a_bead_as_push_it(
    profile: Profile, place: tuple[float, float], pushes: Profile
) -> None:
    centre = np.array([place[0], 0.0, place[1]])
    distances = [float(facet.distances(centre)) for facet in extruded(profile).facets]
    assert np.sum(np.array(distances) < R) == len(pushes)


STEPS = 400
ALONG = 0.02
"""Speed across a ridge, m/s: 8 µm in 400 steps of 1 µs, too little to slip."""


@pytest.mark.parametrize(
    ("gap", "velocity"),
    [
        pytest.param(-DEEP, (ALONG, 0.0, 0.0), id="touching"),
        # Lifted from contact to a gap of 0.2 R. A new bridge does not form at such a gap, so that
        # only the bridge of before can pull.
        pytest.param(0.0, (ALONG, 0.0, 0.2 * R / (STEPS * 1e-6)), id="lifted"),
    ],
)
def test_bridge_and_spring_go_with_a_bead_over_an_edge(
    bench: Bench, gap: float, velocity: Vector
) -> None:
    """The bead slides from a face over a ridge of 0.01 rad onto the next as on a plane."""
    changes = {"contact.friction.bead_wall": 100.0, "contact.rolling_friction": 0.0}
    case = full_case(changes)
    start = np.array([(-4e-6, 0.0, R + gap)])
    plane = [(-1e-3, 0.0), (0.0, 0.0), (1e-3, 0.0)]
    ridge = [(-1e-3, 0.0), (0.0, 0.0), (1e-3, -1e-3 * tan(0.01))]
    over_ridge = forces_on(bench, case, extruded(ridge), start, velocity=velocity, steps=STEPS)[
        :, 0
    ]
    on_plane = forces_on(bench, case, extruded(plane), start, velocity=velocity, steps=STEPS)[:, 0]
    last_x, _, last_z = np.abs(on_plane[-1])
    assert min(last_x, last_z) > 1e-6
    np.testing.assert_allclose(over_ridge, on_plane, rtol=0, atol=0.05 * np.abs(on_plane).max())


# --- vessels from files -------------------------------------------------------------------------
POURED: dict[str, Any] = {
    "mixture": {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 12},
    "beads": {"material": "glass"},
    "liquid": {"name": "water", "volume_fraction": 0.01},
    "contact": {"friction": {"bead_bead": 0.4, "bead_wall": 0.4}, "rolling_friction": 0.0},
    "drive": {"frequency": "100 Hz", "peak_acceleration": "3 g"},
    "run": {"duration": "0.02 s", "longest_settling": "0.02 s"},
}


def poured(**boundary: Any) -> dict[str, Any]:
    """Tables of a case in which a dozen beads are poured into a container of glass."""
    return {**POURED, "boundary": {"material": "glass", **boundary}}


def placed(at: list[str], **boundary: Any) -> dict[str, Any]:
    """Tables of a case with one bead of 0.3 mm at a place in a container of glass."""
    tables = poured(**boundary)
    del tables["mixture"]
    tables["placed"] = [{"radius": "0.3 mm", "at": at}]
    return tables


def write(folder: Path, vessel: Vessel, name: str = "own.obj") -> str:
    """Write a surface to a file whose unit is 1 mm; its path."""
    meshio.Mesh(1e3 * vessel.points, [("triangle", vessel.triangles)]).write(folder / name)
    return str(folder / name)


def boundary_of_mesh(folder: Path, vessel: Vessel) -> Boundary:
    """The boundary of a case whose vessel is read from a file."""
    return build_case(poured(mesh=write(folder, vessel), scale="1 mm")).boundary


BOX: dict[str, Any] = {"shape": "box", "width": "4 mm", "height": "12 mm"}
PLANES = [
    {"point": ["-2 mm", "0 mm", "0 mm"], "normal": [1, 0, 0]},
    {"point": ["2 mm", "0 mm", "0 mm"], "normal": [-1, 0, 0]},
    {"point": ["0 mm", "-2 mm", "0 mm"], "normal": [0, 1, 0]},
    {"point": ["0 mm", "0 mm", "0 mm"], "normal": [0, 0, 1]},
    {"point": ["0 mm", "2 mm", "0 mm"], "normal": [0, -1, 0]},
]
"""The box by its planes, in any order."""


@pytest.fixture
def box() -> Case:
    """A bead in a box by its size."""
    return build_case(placed(["0 mm", "0 mm", "1 mm"], **BOX))


@pytest.fixture
def box_of_mesh(tmp_path: Path) -> Case:
    """A bead in the same box from a mesh file."""
    mesh = write(tmp_path, prism(4, 2e-3, 12e-3))
    return build_case(placed(["0 mm", "0 mm", "1 mm"], mesh=mesh, scale="1 mm"))


@pytest.fixture
def box_of_planes() -> Case:
    """A bead in the same box by its planes."""
    return build_case(placed(["0 mm", "0 mm", "1 mm"], planes=PLANES, height="12 mm"))


@pytest.fixture(params=["box_of_mesh", "box_of_planes"])
def own_box(request: pytest.FixtureRequest) -> Case:
    return request.getfixturevalue(request.param)


def test_an_own_box_has_the_deck_of_a_box(box: Case, own_box: Case) -> None:
    deck = render_deck(own_box)
    expected = render_deck(box)
    assert deck.text == expected.text
    assert deck.files == expected.files


def test_an_own_box_has_the_walls_of_a_box(box: Case, own_box: Case) -> None:
    """The same names in the same order, by which bridges are numbered."""
    assert own_box.boundary.walls == box.boundary.walls


def test_an_own_box_has_the_cross_section_of_a_box(box: Case, own_box: Case) -> None:
    expected = box.boundary.geometry.cross_section
    assert own_box.boundary.geometry.cross_section == pytest.approx(expected, rel=1e-9)


def test_a_mesh_and_planes_of_a_box_name_the_same_run(
    box_of_mesh: Case, box_of_planes: Case
) -> None:
    assert box_of_mesh.determinants() == box_of_planes.determinants()


@pytest.mark.parametrize(
    "stretch",
    [pytest.param([1.0, 3.0, 1.0], id="along y"), pytest.param([3.0, 1.0, 1.0], id="along x")],
)
def test_the_width_of_a_vessel_is_its_extent_along_x_or_y_whichever_is_larger(
    tmp_path: Path, stretch: list[float]
) -> None:
    """Of a box 4 mm by 12 mm, turned either way."""
    low = prism(4, 2e-3, 12e-3)
    boundary = boundary_of_mesh(tmp_path, Vessel(low.points * stretch, low.triangles))
    assert boundary.width == pytest.approx(12e-3, rel=1e-9)


def test_facets_move_with_the_vessel_in_the_frame_of_the_laboratory(tmp_path: Path) -> None:
    """A bead that its bridge holds in a bowl moves alike in both frames, relative to the bowl."""
    mesh = write(tmp_path, bowl(5e-3, 4))
    tables = placed(["0 mm", "0 mm", "0.5 mm"], mesh=mesh, scale="1 mm")
    tables["run"] = {"duration": "0.2 s", "longest_settling": "0.02 s"}
    drive = {"axis": "x", "frequency": "30 Hz", "peak_acceleration": "3 g"}
    position = {}
    for frame in ("container", "lab"):
        case = build_case({**tables, "drive": {**drive, "frame": frame}})
        assert case.excitation.amplitude > 0.8e-3  # 3 g / (2π · 30 Hz)² = 0.83 mm
        position[frame] = walkers.run(case, tmp_path / frame).motion.position
    np.testing.assert_allclose(position["container"], position["lab"], rtol=0, atol=1e-8)


EXACT_FORMATS = [".vtk", ".vtu", ".off"]
"""Formats of meshes with all digits, and the order of the points as written."""
OTHER_FORMATS = [".stl", ".ply", ".msh"]


def hexagon_case(folder: Path, suffix: str) -> Case:
    """Beads in a hexagon from a mesh file of a format, which is gone afterwards."""
    path = Path(write(folder, prism(6, 4e-3, 12e-3), f"a{suffix}"))
    case = build_case(poured(mesh=str(path), scale="1 mm"))
    path.unlink()
    return case


@pytest.fixture(scope="module", params=EXACT_FORMATS + OTHER_FORMATS)
def hexagon(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    return hexagon_case(tmp_path_factory.mktemp("hexagon"), request.param)


@pytest.mark.parametrize("hexagon", EXACT_FORMATS, indirect=True)
def test_a_run_is_named_by_the_numbers_of_its_vessel(tmp_path: Path, hexagon: Case) -> None:
    """Not by its file, whose format, name and place may be any."""
    engine = find_engine()
    of_obj = hexagon_case(tmp_path, ".obj")
    assert run_place(hexagon, engine, tmp_path) == run_place(of_obj, engine, tmp_path)


def test_a_case_is_whole_without_its_mesh_file(hexagon: Case) -> None:
    assert stored_case(hexagon.as_dict()).boundary == hexagon.boundary
    assert changed_case(hexagon, {}).boundary == hexagon.boundary
    assert build_case(hexagon.document).boundary == hexagon.boundary


def test_a_vessel_of_another_scale_is_another_run(tmp_path: Path, hexagon: Case) -> None:
    larger = changed_case(hexagon, {"boundary.scale": "1.5 mm"})
    engine = find_engine()
    assert larger.boundary.width == pytest.approx(1.5 * hexagon.boundary.width)
    assert run_place(larger, engine, tmp_path) != run_place(hexagon, engine, tmp_path)


def test_a_hexagon_has_a_floor_and_six_sides(hexagon: Case) -> None:
    walls = hexagon.boundary.walls
    assert len(walls) == 7
    assert walls[0].name == FLOOR


def elsewhere(points: FloatArray, triangles: IntArray) -> meshio.Mesh:
    """The surface away from the origin."""
    return meshio.Mesh(points + np.array([3.0, -2.0, 7.0]), [("triangle", triangles)])


def of_quads(points: FloatArray, triangles: IntArray) -> meshio.Mesh:
    """The surface with a quadrangle for each side.

    The first two triangles are the floor; then come the lower halves of the sides and the upper
    ones.
    """
    quads = np.column_stack([triangles[2:6], triangles[6:, 2]])
    return meshio.Mesh(points, [("triangle", triangles[:2]), ("quad", quads)])


def of_single_precision(points: FloatArray, triangles: IntArray) -> meshio.Mesh:
    """The surface with seven digits of each coordinate."""
    return meshio.Mesh(points.astype(np.float32), [("triangle", triangles)])


def of_either_orientation(points: FloatArray, triangles: IntArray) -> meshio.Mesh:
    """The surface with every second triangle turned round."""
    mixed = triangles.copy()
    mixed[1::2] = mixed[1::2, ::-1]
    return meshio.Mesh(points, [("triangle", mixed)])


@pytest.mark.parametrize(
    "make_mesh", [elsewhere, of_quads, of_single_precision, of_either_orientation]
)
def test_files_of_one_vessel_give_the_same_boundary(
    tmp_path: Path, make_mesh: Callable[[FloatArray, IntArray], meshio.Mesh]
) -> None:
    """A box of 5.3 mm; its coordinate 2.65 has no exact value in single precision."""
    square = prism(4, 2.65e-3, 12e-3)
    expected = boundary_of_mesh(tmp_path, square)
    make_mesh(1e3 * square.points, square.triangles).write(tmp_path / "same.vtk")
    boundary = build_case(poured(mesh=str(tmp_path / "same.vtk"), scale="1 mm")).boundary
    assert boundary.walls == expected.walls
    assert boundary.width == 5.3e-3
    assert boundary.height == 12e-3
    assert boundary.geometry.volume(6e-3) == pytest.approx(5.3e-3**2 * 6e-3, rel=1e-9)


BODY_LOW = np.array([-1e-3, -5e-4, 2e-3])
BODY_HIGH = np.array([5e-4, 1e-3, 3e-3])


@pytest.fixture(scope="module", params=[1.0, -1.0], ids=["outward", "inward"])
def box_with_body(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Boundary:
    """A box of 4 mm with a block floating in it, whose triangles are turned either way."""
    square = prism(4, 2e-3, 4e-3)
    body = cuboid(BODY_LOW, BODY_HIGH, request.param)
    points = np.concatenate([square.points, body.points])
    triangles = np.concatenate([square.triangles, len(square.points) + body.triangles])
    vessel = Vessel(points, triangles)
    return boundary_of_mesh(tmp_path_factory.mktemp("body"), vessel)


def test_a_body_in_a_vessel_takes_its_volume(box_with_body: Boundary) -> None:
    expected = 4e-3**3 - np.prod(BODY_HIGH - BODY_LOW)
    assert box_with_body.geometry.volume(4e-3) == pytest.approx(expected, rel=1e-2)


def test_beads_are_between_a_vessel_and_a_body_in_it(box_with_body: Boundary) -> None:
    """0.2 mm above the body, 0.1 mm below its top, and 0.2 mm beside it."""
    places = np.array([[0.0, 0.0, 3.2e-3], [0.0, 0.0, 2.9e-3], [0.7e-3, 0.0, 2.5e-3]])
    clearance = box_with_body.geometry.side_clearance(places)
    np.testing.assert_allclose(clearance, [2e-4, -1e-4, 2e-4], atol=1e-12)


def test_a_vessel_is_as_high_as_the_lowest_point_of_its_rim(tmp_path: Path) -> None:
    """A hexagon whose rim rises with x / 2 and is 12 mm high at x = 0."""
    hexagon = prism(6, 4e-3, 12e-3)
    points = hexagon.points.copy()
    at_rim = points[:, 2] > 0.0
    points[at_rim, 2] += 0.5 * points[at_rim, 0]
    height = 12e-3 - 0.5 * np.abs(points[:, 0]).max()
    area = 6.0 * (4e-3) ** 2 / sqrt(3.0)  # of a hexagon with this inner radius
    boundary = boundary_of_mesh(tmp_path, Vessel(points, hexagon.triangles))
    assert boundary.height == pytest.approx(height)
    assert boundary.geometry.volume(2.0 * height) == pytest.approx(area * height)


@pytest.mark.parametrize(
    ("level", "volume"), [(0.5, 0.5), (1.0, 1.0), (1.5, 1.0), (3.0, 1.0), (np.inf, 1.0)]
)
def test_liquid_runs_out_at_the_lowest_point_of_a_rim(level: float, volume: float) -> None:
    """A square of 1 m whose rim rises from 1 m to 2 m holds 1 m³, however high the level."""
    floor = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    rim = [(0.0, 0.0, 1.0), (1.0, 0.0, 2.0), (1.0, 1.0, 2.0), (0.0, 1.0, 1.0)]
    low = np.arange(4)
    after = (low + 1) % 4
    walls = halves_of(low, 4 + low, 4 + after, after)
    square = Vessel(np.array(floor + rim), np.concatenate([[(0, 1, 2), (0, 2, 3)], walls]))
    assert square.volume(level) == pytest.approx(volume)


# --- beads that are poured ----------------------------------------------------------------------
@pytest.fixture(scope="module")
def partly_filled(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Tables of a hexagon 8 mm high, in which the top of a placed bead is at 2.5 mm."""
    mesh = write(tmp_path_factory.mktemp("hexagon"), prism(6, 2.5e-3, 8e-3))
    tables = poured(mesh=mesh, scale="1 mm")
    tables["placed"] = [{"radius": "0.5 mm", "at": ["0 mm", "0 mm", "2 mm"]}]
    tables["mixture"] = {**POURED["mixture"], "large": ["0.5 mm", "0.5 mm"]}
    return tables


def with_count(tables: dict[str, Any], count: int) -> Case:
    """A case in which so many beads are poured."""
    return build_case({**tables, "mixture": {**tables["mixture"], "count": count}})


@pytest.fixture(scope="module")
def largest_count(partly_filled: dict[str, Any]) -> int:
    """The number of beads for which the hexagon has places, as the refusal of more of them says."""
    message = r"the vessel has places for .* up to twice its height of 8 mm"
    with pytest.raises(InputError, match=message) as refusal:
        with_count(partly_filled, 5000)
    return int(str(refusal.value).split()[-1])


def test_as_many_beads_are_poured_above_others_as_a_vessel_has_places(
    partly_filled: dict[str, Any], largest_count: int
) -> None:
    (_, pile), _ = starting_groups(with_count(partly_filled, largest_count))
    assert len(pile.beads) == largest_count


def test_beads_are_poured_above_others_up_to_twice_the_height(
    partly_filled: dict[str, Any], largest_count: int
) -> None:
    """From upon the placed bead, up to 16 mm, where less than a layer is left free."""
    (_, pile), _ = starting_groups(with_count(partly_filled, largest_count))
    heights = [bead.z for bead in pile.beads]
    radius = LOOSE_PITCH * 0.5e-3
    assert min(heights) == pytest.approx(2.5e-3 + radius)
    assert 16e-3 - 3.0 * radius < max(heights) < 16e-3 - radius


def inner_radius(case: Case) -> float:
    """Distance of the last wall of a prism from its axis, m."""
    return abs(float(case.boundary.walls[-1].distances(np.zeros(3))))


def test_the_mesh_of_a_case_is_beside_the_file_that_names_it(tmp_path: Path) -> None:
    """Not in the working folder."""
    write(tmp_path, prism(6, 3e-3, 12e-3), "3.obj")
    (tmp_path / "vessel.toml").write_text(to_toml(poured(mesh="3.obj", scale="1 mm")))
    assert inner_radius(load_case(tmp_path / "vessel.toml")) == pytest.approx(3e-3)


def test_meshes_of_a_sweep_are_beside_the_file_that_names_them(tmp_path: Path) -> None:
    """Not in the working folder."""
    write(tmp_path, prism(6, 3e-3, 12e-3), "3.obj")
    write(tmp_path, prism(6, 4e-3, 12e-3), "4.obj")
    (tmp_path / "vessel.toml").write_text(to_toml(poured(mesh="3.obj", scale="1 mm")))
    sweep = 'case = "vessel.toml"\n[axes]\n"boundary.mesh" = ["3.obj", "4.obj"]\n'
    (tmp_path / "sizes.toml").write_text(sweep)
    radii = [inner_radius(case) for case in load_sweep(tmp_path / "sizes.toml").cases()]
    assert radii == pytest.approx([3e-3, 4e-3])


# --- faces and planes ---------------------------------------------------------------------------
@pytest.mark.parametrize(("sides", "planes"), [(6, 7), (12, 0)], ids=["hexagon", "dodecagon"])
def test_planes_are_where_no_edge_is_obtuse(sides: int, planes: int) -> None:
    """A plane without end would pull behind an obtuse edge."""
    assert len(prism(sides, 4e-3, 8e-3).planes()) == planes


@pytest.mark.parametrize(
    ("widening", "planes"), [(1.1, 0), (0.9, 0), (1.0, 5)], ids=["funnel", "flask", "box"]
)
def test_planes_are_where_walls_are_upright_at_the_rim(widening: float, planes: int) -> None:
    """A plane without end goes on above the rim."""
    square = prism(4, 4e-3, 8e-3)
    points = square.points.copy()
    points[points[:, 2] > 0.0, :2] *= widening
    assert len(Vessel(points, square.triangles).planes()) == planes


def test_a_shallow_dish_is_not_a_plane() -> None:
    """Its triangles turn by less than 1 mrad from one to the next, and by 70 mrad from rim to rim.

    No triangle turns from the face that it belongs to by more than 1 mrad.
    """
    dish = square_dish(0.025, 60, lambda distance: distance**2 / 2.0)
    normals_of_faces = dish.normals[dish.faces]
    cosine = np.sum(dish.normals * normals_of_faces, axis=1)
    assert np.arccos(np.minimum(cosine, 1.0)).max() < 1.001e-3


# --- a round bowl -------------------------------------------------------------------------------
BOWL_RADIUS = 5e-3


@pytest.fixture(scope="module")
def bowls(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Case]:
    """A dozen beads in half a sphere of facets, by its number of rings."""
    cases = {}
    for rings in (4, 8, 16):
        folder = tmp_path_factory.mktemp("bowl")
        mesh = write(folder, bowl(BOWL_RADIUS, rings))
        cases[rings] = build_case(poured(mesh=mesh, scale="1 mm"))
    return cases


def missing_volume(case: Case) -> float:
    """Share of the volume of half a sphere, 2/3 π R³, that a bowl of facets lacks."""
    return 1.0 - case.boundary.vessel.volume() / (2.0 / 3.0 * pi * BOWL_RADIUS**3)


def test_a_bowl_of_facets_becomes_round(bowls: dict[int, Case]) -> None:
    """With half as large facets, a quarter of the volume is missing."""
    ratio = missing_volume(bowls[8]) / missing_volume(bowls[16])
    assert ratio == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("rings", [4, 8, 16])
def test_a_bowl_is_as_high_as_its_radius(bowls: dict[int, Case], rings: int) -> None:
    assert bowls[rings].boundary.vessel.height == pytest.approx(BOWL_RADIUS)


@pytest.mark.parametrize("rings", [4, 8, 16])
def test_the_volume_below_a_level_of_a_bowl_is_that_of_a_cap(
    bowls: dict[int, Case], rings: int
) -> None:
    """A cap of the height h has the volume π h² (R - h/3); here h is R/2."""
    height = BOWL_RADIUS / 2.0
    cap = pi * height**2 * (BOWL_RADIUS - height / 3.0)
    tolerance = 3.0 * missing_volume(bowls[rings])
    assert bowls[rings].boundary.geometry.volume(height) == pytest.approx(cap, rel=tolerance)


def test_show_counts_the_triangles_and_faces_of_a_bowl(bowls: dict[int, Case]) -> None:
    """16 rings have 64 sides of two triangles each; those without an area are left out."""
    vessel = bowls[16].boundary.vessel
    walls = f"{len(vessel.triangles)} triangles in {len(set(vessel.faces.tolist()))} faces"
    size = "(the mesh has 2048 triangles), open toward +z, 10 mm × 10 mm wide, 5 mm high"
    shown = " ".join(preview_text(summarise(bowls[16])).split())
    assert f"vessel {walls} {size}" in shown


def test_a_bowl_of_too_many_walls_for_its_beads_needs_a_coarser_mesh(
    bowls: dict[int, Case],
) -> None:
    message = r"faces, edges and corners; expected at most .* for 50000 beads: a coarser mesh"
    with pytest.raises(InputError, match=message):
        changed_case(bowls[16], {"mixture.count": 50_000})


def places_in_bowl() -> FloatArray:
    """400 random places within the bowl, 0.9 of its radius from its centre, m.

    They are below its rim, for their directions are steep: the vertical component counts threefold.
    """
    direction = np.random.default_rng(1).normal(size=(400, 3))
    direction[:, 2] = -3.0 * np.abs(direction[:, 2])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return np.array([0.0, 0.0, BOWL_RADIUS]) + 0.9 * BOWL_RADIUS * direction


def distances_of_faces(case: Case, places: FloatArray) -> FloatArray:
    """Distances of places from the faces of a vessel, m, shape (faces, places).

    They are infinite where the nearest point is not within the face.
    """
    faces = [wall for wall in case.boundary.walls if wall.kind == "face"]
    return np.array([face.distances(places) for face in faces])


def test_the_facets_of_a_bowl_are_where_the_sphere_is(bowls: dict[int, Case]) -> None:
    """Places at 0.9 R are 0.1 R away from it."""
    distances = distances_of_faces(bowls[16], places_in_bowl()).min(axis=0)
    np.testing.assert_allclose(distances, 0.1 * BOWL_RADIUS, atol=0.01 * BOWL_RADIUS)


def test_the_clearance_in_a_bowl_is_the_distance_of_the_nearest_face(
    bowls: dict[int, Case],
) -> None:
    places = places_in_bowl()
    expected = distances_of_faces(bowls[16], places).min(axis=0)
    clearance = bowls[16].boundary.geometry.side_clearance(places)
    np.testing.assert_allclose(clearance, expected, atol=1e-12)


def test_about_one_face_of_a_bowl_is_nearest_around_a_place(bowls: dict[int, Case]) -> None:
    """The places in front of a face are a prism upon it, as wide as the face.

    The sphere of 0.9 R has 0.9² of the area of the bowl, so that 1 / 0.9² prisms overlap there.
    """
    distances = distances_of_faces(bowls[16], places_in_bowl())
    faces_per_place = np.isfinite(distances).sum() / distances.shape[1]
    assert faces_per_place == pytest.approx(1.0 / 0.9**2, rel=0.03)


# --- runs in vessels ----------------------------------------------------------------------------
def funnel() -> Vessel:
    """A hexagon of 2.5 mm inner radius that widens twofold from 2 mm to 6 mm above the floor."""
    neck = prism(6, 2.5e-3, 8e-3)
    ring = neck.points[:6]
    up = np.array([0.0, 0.0, 1e-3])
    points = np.concatenate([ring, ring + 2.0 * up, 2.0 * ring + 6.0 * up])
    sides = neck.triangles[4:]  # behind the four triangles of the floor
    return Vessel(points, np.concatenate([neck.triangles, sides + 6]))


VESSELS = {"hexagon": prism(6, 2.5e-3, 8e-3), "funnel": funnel()}


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Mesh files of `VESSELS`, by name."""
    folder = tmp_path_factory.mktemp("meshes")
    return {name: write(folder, vessel, f"{name}.obj") for name, vessel in VESSELS.items()}


@pytest.fixture(scope="module", params=list(VESSELS))
def filled(request: pytest.FixtureRequest, run_directory: RunCase, meshes: dict[str, str]) -> Run:
    """A dozen beads that were poured into a vessel; those in a funnel fall into its neck."""
    return Run(run_directory(load_case(poured(mesh=meshes[request.param], scale="1 mm"))))


def test_beads_are_poured_into_a_vessel_and_stay_there(filled: Run) -> None:
    """No bead overlaps a wall by more than 2 % of its radius."""
    motion = filled.motion
    clearance = filled.case.boundary.geometry.side_clearance(motion.position[-1])
    assert (clearance > 0.98 * motion.radius).all()


def test_bridges_to_facets_have_the_gaps_of_their_beads(filled: Run) -> None:
    motion = filled.motion
    bridges = list(read_bridges(motion))[-1]
    walls = filled.case.boundary.walls
    beads, numbers = bridges.at_walls
    assert len(beads) > 3
    gaps = []
    for bead, number in zip(beads, numbers, strict=True):
        distance = float(walls[number].distances(motion.position[-1, bead]))
        gaps.append(distance - motion.radius[bead])
    between_beads = len(bridges.beads)  # bridges to walls come after these
    np.testing.assert_allclose(gaps, bridges.gap[between_beads:], atol=1e-9)


def test_bridges_to_facets_are_drawn_as_far_as_the_vessel(filled: Run) -> None:
    motion = filled.motion
    bridges = list(read_bridges(motion))[-1]
    at_walls = bridges.contacts[len(bridges.beads) :]
    _, ends = bridge_ends(motion, motion.position[-1], at_walls)
    np.testing.assert_allclose(filled.case.boundary.vessel.clearance(ends), 0.0, atol=1e-9)


def test_walls_of_a_vessel_in_pictures_are_its_triangles(filled: Run) -> None:
    """A polygon of n corners takes n - 2 of them."""
    triangles = sum(len(corners) - 2 for corners in walls_of(filled.motion))
    assert triangles == len(filled.case.boundary.vessel.triangles)


def test_a_vessel_has_a_floor(filled: Run) -> None:
    assert FLOOR in [wall.name for wall in filled.case.boundary.walls]


@pytest.mark.parametrize("filled", ["funnel"], indirect=True)
def test_the_second_engine_refuses_facets(filled: Run) -> None:
    with pytest.raises(InputError, match="the second engine knows no facets"):
        compare_motions([filled.motion])


# --- walkers in vessels -------------------------------------------------------------------------
@pytest.fixture(scope="module")
def round_vessel(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The table ``[boundary]`` of a vessel of twelve sides, 8 mm wide: its floor is a face."""
    return {
        "mesh": write(tmp_path_factory.mktemp("round"), prism(12, 4e-3, 3e-3)),
        "scale": "1 mm",
        "material": "chromium-coated glass",
    }


def walker_on_plane() -> Case:
    """The walker of Fig. 1b, alone, for ten cycles."""
    changes = {
        "dimers.replicates": 1,
        "dimers.facing": "right",
        "run.cycles": 10,
        "run.settling_cycles": 4,
    }
    return load_case("fig1b", changes)


@pytest.fixture(scope="module")
def walker_in_vessel(round_vessel: dict[str, Any]) -> Case:
    return build_case({**walker_on_plane().document, "boundary": round_vessel}, name="vessel")


def test_walkers_in_a_vessel_walk_as_on_a_plane(tmp_path: Path, walker_in_vessel: Case) -> None:
    velocity = walkers.run(walker_in_vessel, tmp_path).result["velocity"]
    expected = walkers.run(walker_on_plane(), tmp_path).result["velocity"]
    assert velocity == pytest.approx(expected, rel=1e-6)


@pytest.fixture(scope="module")
def most_walkers(walker_in_vessel: Case) -> int:
    """The number of walkers that fit into the vessel, as the refusal of more of them says."""
    message = r"of the vessel; expected at most \d+, a smaller dimers\.spac"
    with pytest.raises(InputError, match=message) as refusal:
        changed_case(walker_in_vessel, {"dimers.replicates": 30, "dimers.meet": True})
    return int(str(refusal.value).split("at most ")[1].split(",")[0])


def test_as_many_walkers_fit_a_vessel_as_its_message_says(
    walker_in_vessel: Case, most_walkers: int
) -> None:
    """Of two beads each."""
    case = changed_case(walker_in_vessel, {"dimers.replicates": most_walkers, "dimers.meet": True})
    assert most_walkers > 1
    assert case.count == 2 * most_walkers


def test_one_walker_more_does_not_fit_a_vessel(walker_in_vessel: Case, most_walkers: int) -> None:
    changes = {"dimers.replicates": most_walkers + 1, "dimers.meet": True}
    with pytest.raises(InputError, match=f"expected at most {most_walkers},"):
        changed_case(walker_in_vessel, changes)


def test_walkers_apart_do_not_fit_a_small_vessel(round_vessel: dict[str, Any]) -> None:
    """The six of the shipped case, which do not meet."""
    tables = {**load_case("fig1b").document, "boundary": round_vessel}
    message = r"dimers\.replicates = 6: the walkers, .* of the vessel; expected 1, a"
    with pytest.raises(InputError, match=message):
        build_case(tables, name="vessel")
