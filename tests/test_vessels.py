"""Vessels of the user's own: surfaces from files, and the forces of their faces, edges and corners."""

from __future__ import annotations

from itertools import product
from math import cos, pi, sin, sqrt, tan
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import walkers
from tests.conftest import to_toml
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.case_building import build_case, changed_case, stored_case
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.standing import starting_groups
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.shapes.shape import LOOSE
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

R = 1e-4
"""Radius of the beads, m."""


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(find_engine(), tmp_path)


def cuboid(low: FloatArray, high: FloatArray, toward: float = 1.0) -> Vessel:
    """A block with beads around it, or (-1) a room with beads in it."""
    points = np.array(
        [
            [(low, high)[k][axis] for axis, k in enumerate(corner)]
            for corner in product((0, 1), repeat=3)
        ]
    )
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = np.array([[a, *pair] for a, b, c, d in quads for pair in ((b, c), (c, d))])
    return Vessel(points, triangles if toward > 0.0 else triangles[:, ::-1])


def extruded(profile: list[tuple[float, float]], half: float = 5e-3) -> Vessel:
    """A profile in x and z, beads above it, along y."""
    points = np.array([(x, y, z) for x, z in profile for y in (-half, half)])
    return Vessel(points, np.array([(k + a, k + b, k + c) for k in range(0, 2 * len(profile) - 2, 2)
                                    for a, b, c in ((0, 2, 1), (1, 2, 3))]))  # fmt: skip


def hertz(overlap: float) -> float:
    """Repulsion of a bead from a plane in `bench_case`, N."""
    return 4.0 / 3.0 * 50e6 / (2.0 * (1.0 - 0.3**2)) * sqrt(R) * overlap**1.5


def forces_on(
    bench: Bench, vessel: Vessel, centres: FloatArray, changes: dict[str, Any], **motion: Any
) -> FloatArray:
    """Forces on beads that are moved, or held, in each of some steps, N, shape (F, N, 3)."""
    beads = [Bead(0, tuple(centre), R, motion.get("velocity", (0.0, 0.0, 0.0)), motion.get("spin", (0.0, 0.0, 0.0)))
             for centre in centres.tolist()]  # fmt: skip
    case = motion.get("case", bench_case)(changes)
    return bench.run(
        prescribed(case, scene_of(beads, vessel.facets), motion.get("steps", 2))
    ).forces[..., :3]


def test_faces_edges_and_corners_repel_as_planes_do(bench: Bench) -> None:
    """Around a block that is turned, each bead touches the nearest point of it once: in a face, an edge or a corner."""
    from scipy.spatial.transform import Rotation

    turn, half, overlap = (
        Rotation.from_rotvec([0.4, -0.7, 0.9]).as_matrix(),
        np.array([4e-4, 3e-4, 2e-4]),
        1e-6,
    )
    draw, centres, ways = np.random.default_rng(1), [], []
    block = cuboid(-half, half)
    while len(centres) < 40:
        way = draw.normal(size=3)
        nearest = half * np.clip(draw.uniform(-2.0, 2.0, size=3), -1.0, 1.0)
        out = (np.abs(nearest) == half) * np.sign(nearest) * np.abs(way)
        if not out.any():
            continue
        ways.append(turn @ (out / np.linalg.norm(out)))
        centre = turn @ nearest + (R - overlap) * ways[-1]
        if all(np.linalg.norm(centre - other) > 2.1 * R for other in centres):
            centres.append(centre)
        else:
            ways.pop()
    around = np.sum(
        [np.sum(np.abs(np.array(ways) @ turn) > 1e-9, axis=1) == kind for kind in (1, 2, 3)], axis=1
    )
    assert (around > 2).all()
    found = forces_on(
        bench, Vessel(block.points @ turn.T, block.triangles), np.array(centres), DRY
    )[0]
    np.testing.assert_allclose(
        found, hertz(overlap) * np.array(ways), rtol=0, atol=1e-12 * hertz(overlap)
    )


DEEP = 1e-6
SLOT = [(-1e-3, 0.0), (-6e-5, 0.0), (-6e-5, -1e-3), (6e-5, -1e-3), (6e-5, 0.0), (1e-3, 0.0)]
RIDGE = [(-1e-3, -1e-3), (0.0, 0.0), (1e-3, -1e-3)]
VALLEY = [(-1e-3, 1e-3), (0.0, 0.0), (1e-3, 1e-3)]
FLAT = [(-1e-3, 0.0), (2e-5, 0.0), (1e-3, 0.0)]
STEP = [(-1e-3, 0.0), (0.0, 0.0), (0.0, 2e-4), (1e-3, 2e-4)]
BENT = [(-1e-3, 1e-3 * tan(0.1)), (0.0, 0.0), (1e-3, 0.0)]
_HALF = sqrt(0.5)
_RISE = sqrt((R - DEEP) ** 2 - 6e-5**2)
PROFILES: dict[
    str, tuple[list[tuple[float, float]], tuple[float, float], list[tuple[float, float]]]
] = {
    "a face": (FLAT, (-3e-4, R - DEEP), [(0.0, 1.0)]),
    "two triangles of a face": (FLAT, (2e-5, R - DEEP), [(0.0, 1.0)]),
    "upon a ridge": (RIDGE, (0.0, R - DEEP), [(0.0, 1.0)]),
    "beside a ridge": (
        RIDGE,
        ((R - DEEP) * sin(0.3), (R - DEEP) * cos(0.3)),
        [(sin(0.3), cos(0.3))],
    ),
    "where a face ends at a ridge": (
        RIDGE,
        (_HALF * (R - DEEP), _HALF * (R - DEEP)),
        [(_HALF, _HALF)],
    ),
    "a valley": (VALLEY, (0.0, (R - DEEP) / _HALF), [(_HALF, _HALF), (-_HALF, _HALF)]),
    "a face beside a valley": (BENT, (3e-5, R - DEEP), [(0.0, 1.0)]),
    "the foot of a step": (STEP, (-R + DEEP, R - DEEP), [(0.0, 1.0), (-1.0, 0.0)]),
    "the edge of a step": (
        STEP,
        (-(R - DEEP) * sin(0.5), 2e-4 + (R - DEEP) * cos(0.5)),
        [(-sin(0.5), cos(0.5))],
    ),
    "over a slot": (
        SLOT,
        (0.0, _RISE),
        [(s * 6e-5 / (R - DEEP), _RISE / (R - DEEP)) for s in (1.0, -1.0)],
    ),
    "behind a face": (FLAT, (0.0, -R + DEEP), []),
}
"""Profiles, places of a bead (x, z), and the directions in which it is pushed, each as by a plane."""


@pytest.mark.parametrize("name", PROFILES)
def test_a_bead_touches_what_is_nearest_around_it_once(bench: Bench, name: str) -> None:
    profile, (x, z), ways = PROFILES[name]
    (found,) = forces_on(bench, extruded(profile), np.array([(x, 0.0, z)]), DRY)[0]
    expected = hertz(DEEP) * np.array([0.0, 0.0, 0.0]) + sum(
        hertz(DEEP) * np.array([a, 0.0, b]) for a, b in ways
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * hertz(DEEP))
    walls = extruded(profile).facets
    assert sum(float(wall.distances(np.array([x, 0.0, z]))) < R for wall in walls) == len(ways)


def roof(turn: float) -> list[tuple[float, float]]:
    """A level face, and one that falls away from it by an angle (rad)."""
    return [(-1e-3, 0.0), (0.0, 0.0), (1e-3, -1e-3 * tan(turn))]


@pytest.mark.parametrize("gap", [-DEEP, 0.2 * R])
def test_bridge_and_spring_go_with_a_bead_over_an_edge(bench: Bench, gap: float) -> None:
    """It slides from a face over a ridge of 0.01 rad onto the next, and is held, and pulled, as on a plane.

    At a gap above that of formation only the bridge of before can pull: there is one as the bead has touched.
    """
    speed, steps = 0.02, 400  # 8 um across the ridge, less than what slips
    rough = {"contact.friction.bead_wall": 100.0, "contact.rolling_friction": 0.0}
    start = np.array([(-4e-6, 0.0, R + min(gap, 0.0))])
    moves = {"velocity": (speed, 0.0, 0.0), "steps": steps, "case": full_case}
    if gap > 0.0:  # lifted as it crosses
        moves["velocity"] = (speed, 0.0, gap / (steps * 1e-6))
    surfaces = (extruded(roof(turn)) for turn in (0.01, 0.0))
    over, plane = (forces_on(bench, surface, start, rough, **moves)[:, 0] for surface in surfaces)
    assert np.abs(plane[-1]).min(where=np.array([True, False, True]), initial=1.0) > 1e-6
    np.testing.assert_allclose(over, plane, rtol=0, atol=0.05 * np.abs(plane).max())


# --- vessels from files -----------------------------------------------------------------------------------------------

BOX: dict[str, Any] = {"shape": "box", "width": "4 mm", "height": "12 mm"}
POURED: dict[str, Any] = {
    "mixture": {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 12},
    "beads": {"material": "glass"},
    "liquid": {"name": "water", "volume_fraction": 0.01},
    "contact": {"friction": {"bead_bead": 0.4, "bead_wall": 0.4}, "rolling_friction": 0.0},
    "drive": {"frequency": "100 Hz", "peak_acceleration": "3 g"},
    "run": {"duration": "0.02 s", "longest_settling": "0.02 s"},
}


def poured(**boundary: Any) -> dict[str, Any]:
    return {**POURED, "boundary": {"material": "glass", **boundary}}


def prism(sides: int, inner: float, height: float) -> Vessel:
    """A prism open above, of the inner radius and the height: the floor first, then the sides from -x on."""
    turns = pi + 2.0 * pi * (np.arange(sides) - 0.5) / sides
    ring = inner / cos(pi / sides) * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    points = np.round(np.concatenate([ring, ring + np.array([0.0, 0.0, height])]), 9)
    floor = [[0, k, k + 1] for k in range(1, sides - 1)]
    order = (0, 2, 1, 3) if sides == 4 else range(sides)  # those of a box: -x, +x, -y, +y
    low = [((k + 1) % sides, k, sides + k) for k in order]
    return Vessel(points, np.array([*floor, *low, *((b, top, sides + b) for b, _, top in low)]))


def write(folder: Path, vessel: Vessel, name: str = "own.obj") -> str:
    meshio.Mesh(1e3 * vessel.points, [("triangle", vessel.triangles)]).write(folder / name)
    return str(folder / name)


def test_a_box_is_the_same_from_a_mesh_from_planes_and_by_its_size(tmp_path: Path) -> None:
    """The same decks, but that it is poured by levels; bridges and walls have the same names and numbers."""
    mesh = write(tmp_path, prism(4, 2e-3, 12e-3))
    planes = [{"point": [f"{2 * x} mm", f"{2 * y} mm", "0 mm"], "normal": [-x, -y, 0]}
              for x, y in ((-1, 0), (1, 0), (0, -1), (0, 1))]  # fmt: skip
    planes.insert(3, {"point": ["0 mm", "0 mm", "0 mm"], "normal": [0, 0, 1]})
    ball = {"placed": [{"radius": "0.3 mm", "at": ["0 mm", "0 mm", "1 mm"]}], "mixture": None}
    cases = []
    for boundary in (BOX, {"mesh": mesh, "scale": "1 mm"}, {"planes": planes, "height": "12 mm"}):
        tables = {
            key: value for key, value in {**poured(**boundary), **ball}.items() if value is not None
        }
        cases.append(build_case(tables))
    decks = [render_deck(case) for case in cases]
    assert decks[0].text == decks[1].text == decks[2].text
    assert decks[0].files == decks[1].files == decks[2].files
    assert cases[0].boundary.walls == cases[1].boundary.walls == cases[2].boundary.walls
    assert cases[1].determinants() == cases[2].determinants()
    for case in cases[1:]:
        assert case.boundary.geometry.cross_section == pytest.approx(
            cases[0].boundary.geometry.cross_section, rel=1e-9
        )


def test_the_width_of_a_vessel_is_its_extent_along_x_or_y_whichever_is_larger(
    tmp_path: Path,
) -> None:
    """Of a box 4 mm by 12 mm, turned either way."""
    low = prism(4, 2e-3, 12e-3)
    for stretch in ([1.0, 3.0, 1.0], [3.0, 1.0, 1.0]):
        vessel = Vessel(low.points * stretch, low.triangles)
        case = build_case(poured(mesh=write(tmp_path, vessel), scale="1 mm"))
        assert case.boundary.width == pytest.approx(12e-3, rel=1e-9)


def test_facets_move_with_the_vessel_in_the_frame_of_the_laboratory(tmp_path: Path) -> None:
    """A bead that its bridge holds in a bowl stays there in both frames, while the bowl moves by 0.8 mm."""
    mesh = write(tmp_path, bowl(5e-3, 4))
    positions = []
    for frame in ("container", "lab"):
        tables = poured(mesh=mesh, scale="1 mm")
        del tables["mixture"]
        tables["placed"] = [{"radius": "0.3 mm", "at": ["0 mm", "0 mm", "0.5 mm"]}]
        tables["drive"] = {
            "axis": "x",
            "frequency": "30 Hz",
            "peak_acceleration": "3 g",
            "frame": frame,
        }
        tables["run"] = {"duration": "0.2 s", "longest_settling": "0.02 s"}
        positions.append(walkers.run(build_case(tables), tmp_path / frame).motion.position)
    assert build_case(tables).excitation.amplitude > 0.8e-3
    np.testing.assert_allclose(positions[0], positions[1], rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["a.stl", "a.ply", "a.vtk", "a.vtu", "a.msh", "a.off"])
def test_a_run_is_named_by_the_numbers_of_its_vessel(tmp_path: Path, name: str) -> None:
    """Not by its file, whose format, name and place may be any; the case is whole without it."""
    hexagon = prism(6, 4e-3, 12e-3)
    path = Path(write(tmp_path, hexagon, name))
    tables = poured(mesh=str(path), scale="1 mm")
    case, other = (
        build_case(tables),
        build_case(poured(mesh=write(tmp_path, hexagon), scale="1 mm")),
    )
    path.unlink()
    places = [run_place(one, find_engine(), tmp_path) for one in (case, other)]
    if name in (
        "a.vtu",
        "a.vtk",
        "a.off",
    ):  # the others have fewer digits or another order of points
        assert places[0] == places[1]
    again = [stored_case(case.as_dict()), changed_case(case, {}), build_case(case.document)]
    assert all(one.boundary == case.boundary for one in again)
    larger = changed_case(case, {"boundary.scale": "1.5 mm"})
    assert larger.boundary.width == pytest.approx(1.5 * case.boundary.width)
    assert run_place(larger, find_engine(), tmp_path) != places[0]
    assert len(case.boundary.walls) == 7
    assert case.boundary.walls[0].name == FLOOR


MESHES: dict[str, Any] = {
    # Files of a box of 5.3 mm, whose sides are the pairs of triangles: points (mm), triangles.
    "elsewhere": lambda points, triangles: meshio.Mesh(
        points + np.array([3.0, -2.0, 7.0]), [("triangle", triangles)]
    ),
    "of quads": lambda points, triangles: meshio.Mesh(
        points,
        [
            ("triangle", triangles[:2]),
            ("quad", np.column_stack([triangles[2:6], triangles[6:, 2]])),
        ],
    ),
    "of single precision": lambda points, triangles: meshio.Mesh(
        points.astype(np.float32), [("triangle", triangles)]
    ),
    "turned at random": lambda points, triangles: meshio.Mesh(
        points, [("triangle", [one[:: (-1) ** k] for k, one in enumerate(triangles)])]
    ),
}


@pytest.mark.parametrize("name", MESHES)
def test_files_of_one_vessel(tmp_path: Path, name: str) -> None:
    """Wherever its points are, of polygons, of few digits, of triangles that are turned either way."""
    box = prism(4, 2.65e-3, 12e-3)
    expected = build_case(poured(mesh=write(tmp_path, box), scale="1 mm")).boundary
    MESHES[name](1e3 * box.points, box.triangles).write(tmp_path / "other.vtk")
    found = build_case(poured(mesh=str(tmp_path / "other.vtk"), scale="1 mm")).boundary
    assert (found.walls, found.width, found.height) == (expected.walls, 5.3e-3, 12e-3)
    np.testing.assert_allclose(found.geometry.volume(6e-3), 5.3e-3**2 * 6e-3, rtol=1e-9)


def test_beads_are_between_a_vessel_and_a_body_in_it(tmp_path: Path) -> None:
    """However its triangles are turned: they look away from the body."""
    low, high = np.array([-1e-3, -5e-4, 2e-3]), np.array([5e-4, 1e-3, 3e-3])
    box = prism(4, 2e-3, 4e-3)
    for toward in (1.0, -1.0):
        body = cuboid(low, high, toward)
        both = Vessel(
            np.concatenate([box.points, body.points]),
            np.concatenate([box.triangles, 8 + body.triangles]),
        )
        boundary = build_case(poured(mesh=write(tmp_path, both), scale="1 mm")).boundary
        assert boundary.geometry.volume(4e-3) == pytest.approx(
            16e-6 * 4e-3 - np.prod(high - low), rel=1e-2
        )
        places = np.array([[0.0, 0.0, 3.2e-3], [0.0, 0.0, 2.9e-3], [0.7e-3, 0.0, 2.5e-3]])
        np.testing.assert_allclose(
            boundary.geometry.side_clearance(places), [2e-4, -1e-4, 2e-4], atol=1e-12
        )


def test_a_vessel_is_as_high_as_the_lowest_point_of_its_rim(tmp_path: Path) -> None:
    points = prism(6, 4e-3, 12e-3).points
    oblique = Vessel(points * [1.0, 1.0, 1.0] + np.outer(points[:, 0] * (points[:, 2] > 0.0), [0.0, 0.0, 0.5]),
                     prism(6, 4e-3, 12e-3).triangles)  # fmt: skip
    height = 12e-3 - 0.5 * np.abs(points[:, 0]).max()
    boundary = build_case(poured(mesh=write(tmp_path, oblique), scale="1 mm")).boundary
    assert boundary.height == pytest.approx(height)
    assert boundary.geometry.volume(2.0 * height) == pytest.approx(
        6.0 * (4e-3) ** 2 / sqrt(3.0) * height
    )


def test_liquid_runs_out_at_the_lowest_point_of_a_rim() -> None:
    """A rim that rises from 1 m to 2 m across a square of 1 m: there is 1 m³, however high the level."""
    corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    points = np.array([*((x, y, 0.0) for x, y in corners), *((x, y, 1.0 + x) for x, y in corners)])
    walls = [
        side
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0))
        for side in ((a, 4 + b, b), (a, 4 + a, 4 + b))
    ]
    square = Vessel(points, np.array([(0, 1, 2), (0, 2, 3), *walls]))
    assert [square.volume(level) for level in (0.5, 1.0, 1.5, 3.0)] == pytest.approx(
        [0.5, 1.0, 1.0, 1.0]
    )
    assert square.volume() == pytest.approx(1.0)


def test_beads_are_poured_above_others_up_to_twice_the_height(tmp_path: Path) -> None:
    """As many as there are places."""
    mesh, at = write(tmp_path, prism(6, 2.5e-3, 8e-3)), ["0 mm", "0 mm", "2 mm"]
    tables = poured(mesh=mesh, scale="1 mm") | {"placed": [{"radius": "0.5 mm", "at": at}]}
    mixture = POURED["mixture"] | {"large": ["0.5 mm", "0.5 mm"]}
    with pytest.raises(
        InputError, match=r"the vessel has places for .* up to twice its height of 8 mm"
    ) as refusal:
        build_case(tables | {"mixture": mixture | {"count": 5000}})
    room = int(str(refusal.value).split()[-1])
    case = build_case(tables | {"mixture": mixture | {"count": room}})
    (_, pile), _ = starting_groups(case)
    heights, radius = [bead.z for bead in pile.beads], LOOSE * 0.5e-3
    assert len(heights) == room
    assert min(heights) == pytest.approx(2.5e-3 + radius)
    assert 16e-3 - 3.0 * radius < max(heights) < 16e-3 - radius


def test_meshes_are_beside_the_files_that_name_them(tmp_path: Path) -> None:
    """A case, and a sweep over meshes, of another folder than the working one."""
    for size in (3, 4):
        write(tmp_path, prism(6, size * 1e-3, 12e-3), f"{size}.obj")
    case = to_toml(poured(mesh="3.obj", scale="1 mm"))
    (tmp_path / "vessel.toml").write_text(case)
    sweep = 'case = "vessel.toml"\n[axes]\n"boundary.mesh" = ["3.obj", "4.obj"]\n'
    (tmp_path / "sizes.toml").write_text(sweep)
    cases = [load_case(tmp_path / "vessel.toml"), *load_sweep(tmp_path / "sizes.toml").cases()]
    across = [float(-one.boundary.walls[-1].distances(np.zeros(3))) for one in cases]
    assert np.abs(across) == pytest.approx([3e-3, 3e-3, 4e-3])


def bowl(radius: float, rings: int) -> Vessel:
    """Half a sphere of facets, four sides around it for each ring."""
    bends, turns = np.linspace(0.0, pi / 2.0, rings + 1), pi / (2.0 * rings) * np.arange(4 * rings)
    ring = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    points = np.concatenate(
        [radius * sin(at) * ring + [0.0, 0.0, radius * (1.0 - cos(at))] for at in bends]
    )
    number = np.arange(len(points)).reshape(rings + 1, -1)
    after = np.roll(number, -1, 1)
    a, b, c, d = (each.ravel() for each in (number[:-1], after[:-1], after[1:], number[1:]))
    return Vessel(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


@pytest.mark.parametrize(("sides", "planes"), [(6, 7), (12, 0)], ids=["hexagon", "dodecagon"])
def test_planes_are_where_no_edge_is_obtuse(sides: int, planes: int) -> None:
    """A plane without end would pull behind an obtuse edge."""
    assert len(prism(sides, 4e-3, 8e-3).planes()) == planes


@pytest.mark.parametrize(
    ("widening", "planes"), [(1.1, 0), (0.9, 0), (1.0, 5)], ids=["funnel", "flask", "box"]
)
def test_planes_are_where_walls_are_upright_at_the_rim(widening: float, planes: int) -> None:
    """A plane without end goes on above the rim."""
    box = prism(4, 4e-3, 8e-3)
    points = np.where(box.points[:, 2:] > 0.0, [widening, widening, 1.0], 1.0) * box.points
    assert len(Vessel(points, box.triangles).planes()) == planes


def test_a_shallow_dish_is_not_a_plane() -> None:
    """Its triangles turn by less than 1 mrad from one to the next, and by 70 mrad from rim to rim."""
    across = np.linspace(-0.025, 0.025, 60)
    x, y = (axis.ravel() for axis in np.meshgrid(across, across))
    number = np.arange(len(x)).reshape(60, 60)
    a, b, c, d = (
        each.ravel()
        for each in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    )
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    dish = Vessel(np.stack([x, y, (x**2 + y**2) / 2.0], axis=1), triangles)
    turned = np.einsum("tx,tx->t", dish.normals, dish.normals[dish.faces])
    assert np.arccos(np.minimum(turned, 1.0)).max() < 1.001e-3


def test_a_bowl_of_facets_becomes_round(tmp_path: Path) -> None:
    """Its volume, how far beads are from it, and how many of its faces are nearest around the foot of a bead."""
    size, off = 5e-3, []
    for rings in (4, 8, 16):
        case = build_case(poured(mesh=write(tmp_path, bowl(size, rings)), scale="1 mm"))
        vessel = case.boundary.vessel
        assert vessel.height == pytest.approx(size)
        off.append(1.0 - vessel.volume() / (2.0 / 3.0 * pi * size**3))
        half = pi * (size / 2) ** 2 * (size - size / 6)
        assert case.boundary.geometry.volume(size / 2) == pytest.approx(half, rel=3 * off[-1])
    assert off[1] / off[2] == pytest.approx(4.0, rel=0.1)
    walls = f"{len(vessel.triangles)} triangles in {len({*vessel.faces})} faces"
    opened = "(the mesh has 2048 triangles), open toward +z, 10 mm × 10 mm wide, 5 mm high"
    assert f"vessel     {walls} {opened}" in preview_text(summarise(case))
    with pytest.raises(
        InputError,
        match=r"faces, edges and corners; expected at most .* for 50000 beads: a coarser mesh",
    ):
        changed_case(case, {"mixture.count": 50_000})
    away, near = np.random.default_rng(1).normal(size=(400, 3)), 0.9 * size
    centres = np.array([0.0, 0.0, size]) - near * (
        away * [1.0, 1.0, 0.0] + [0.0, 0.0, 3.0] * np.abs(away)
    ) / np.linalg.norm(
        away * [1.0, 1.0, 0.0] + [0.0, 0.0, 3.0] * np.abs(away), axis=1, keepdims=True
    )
    distances = np.array(
        [wall.distances(centres) for wall in case.boundary.walls if wall.kind == "face"]
    )
    np.testing.assert_allclose(distances.min(axis=0), size - near, atol=0.01 * size)
    np.testing.assert_allclose(
        case.boundary.geometry.side_clearance(centres), distances.min(axis=0), atol=1e-12
    )
    assert (distances < np.inf).sum() / len(centres) == pytest.approx(1.0 / 0.9**2, rel=0.03)


@pytest.mark.parametrize("boundary", ["hexagon", "funnel"])
def test_beads_are_poured_into_a_vessel_and_stay_there(tmp_path: Path, boundary: str) -> None:
    """Through the opening of a funnel too, into a narrower neck; walls, bridges and pictures agree."""
    vessel = prism(6, 2.5e-3, 8e-3)
    if boundary == "funnel":
        ring, up = vessel.points[:6], np.array([0.0, 0.0, 1e-3])
        points = np.concatenate([ring, ring + 2.0 * up, 2.0 * ring + 6.0 * up])
        vessel = Vessel(points, np.concatenate([vessel.triangles, vessel.triangles[4:] + 6]))
    done = walkers.run(load_case(poured(mesh=write(tmp_path, vessel), scale="1 mm")), tmp_path)
    motion, walls = done.motion, done.case.boundary.walls
    clear = done.case.boundary.geometry.side_clearance(motion.position[-1]) - motion.radius
    assert (clear > -0.02 * motion.radius).all()
    bridges = list(read_bridges(motion))[-1]
    beads, numbers = bridges.at_walls
    assert len(beads) > 3
    places = zip(numbers, motion.position[-1, beads], strict=True)
    gaps = [float(walls[wall].distances(place)) for wall, place in places] - motion.radius[beads]
    np.testing.assert_allclose(gaps, bridges.gap[len(bridges.beads) :], atol=1e-9)
    _, ends = bridge_ends(motion, motion.position[-1], bridges.contacts[len(bridges.beads) :])
    np.testing.assert_allclose(done.case.boundary.vessel.clearance(ends), 0.0, atol=1e-9)
    if boundary == "funnel":
        with pytest.raises(InputError, match="the second engine knows no facets"):
            compare_motions([motion])
    assert sum(len(corners) - 2 for corners in walls_of(motion)) == len(vessel.triangles)
    assert {"floor"} <= {wall.name for wall in walls}


def test_walkers_in_a_vessel_walk_as_on_a_plane(tmp_path: Path) -> None:
    """On the floor of one with twelve sides, which is a face; they are refused where they do not fit."""
    changes = {
        "dimers.replicates": 1,
        "dimers.facing": "right",
        "run.cycles": 10,
        "run.settling_cycles": 4,
    }
    of = {
        "mesh": write(tmp_path, prism(12, 4e-3, 3e-3)),
        "scale": "1 mm",
        "material": "chromium-coated glass",
    }
    plane = load_case("fig1b", changes)
    vessel = build_case({**plane.document, "boundary": of}, name="vessel")
    speeds = [walkers.run(case, tmp_path).result["velocity"] for case in (plane, vessel)]
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-6)
    with pytest.raises(
        InputError, match=r"of the vessel; expected at most \d+, a smaller dimers\.spac"
    ) as refusal:
        changed_case(vessel, {"dimers.replicates": 30, "dimers.meet": True})
    most = int(str(refusal.value).split("at most ")[1].split(",")[0])
    assert (
        changed_case(vessel, {"dimers.replicates": most, "dimers.meet": True}).count == 2 * most > 2
    )
    with pytest.raises(
        InputError, match=r"dimers\.replicates = 6: the walkers, .* of the vessel; expected 1, a"
    ):
        build_case({**load_case("fig1b").document, "boundary": of}, name="vessel")
    with pytest.raises(InputError, match=f"expected at most {most},"):
        changed_case(vessel, {"dimers.replicates": most + 1, "dimers.meet": True})
