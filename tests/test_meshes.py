"""Mesh files: which are read, what becomes of a solid, and what is refused with its place."""

from __future__ import annotations

import os
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import walkers
from tests.test_vessels import bowl, cuboid, poured, prism, write
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.case_building import build_case
from walkers.inputs.meshes.flat_faces import LEAST_STEP
from walkers.inputs.meshes.mesh_file import MOST_BYTES, read_mesh
from walkers.inputs.meshes.mesh_surface import vessel_of
from walkers.inputs.meshes.vessel import Vessel
from walkers.inputs.meshes.wall_names import names_of_faces
from walkers.inputs.tables.shapes.vessel import VesselShape
from walkers.runner import failures
from walkers.runner.cost import predicted_seconds
from walkers.runs.preview import preview_text, summarise

DATA = Path(__file__).parent / "data" / "meshes"
BOXES = [
    "plain.obj",
    "negative-indices.obj",
    "negative-indices-shifted.obj",
    "normals-per-face.obj",
    "texture-per-corner.obj",
    "vertex-colours.obj",
    "colour-per-face.ply",
    "polydata.vtp",
    "polydata.vtk",
    "comments.off",
    "quads.off",
    "trailing-blank-line.stl",
    "open-box.stl",
]
"""Files of one box, 8 mm wide and 20 mm high."""


def vessel_of_file(path: Path) -> Vessel:
    return vessel_of(read_mesh(path), 1e-3)


def vessel_of_arrays(vessel: Vessel) -> Vessel:
    """What becomes of a surface in m as if it were in a file."""
    return vessel_of(
        {"points": vessel.points.tolist(), "triangles": vessel.triangles.tolist()}, 1.0
    )


def revolved(profile: list[tuple[float, float]], sides: int = 24) -> Vessel:
    """A closed surface of a profile (radius, height; m) about the z axis, from its lowest to its highest point."""
    turns = 2.0 * pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    points = np.concatenate([radius * ring + [0.0, 0.0, height] for radius, height in profile])
    number = np.arange(len(points)).reshape(len(profile), sides)
    after = np.roll(number, -1, axis=1)
    corners = (number[:-1], after[:-1], after[1:], number[1:])
    a, b, c, d = (each.ravel() for each in corners)
    return Vessel(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def turned(vessel: Vessel, axis: str, angle: float = 90.0) -> Vessel:
    """The surface, turned about an axis by an angle in degrees."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_euler(axis, angle, degrees=True)
    return Vessel(turn.apply(vessel.points), vessel.triangles)


def solid_cup(inner: float, floor: float, lip: float | None = None) -> Vessel:
    """A cup as a solid of 10 mm radius and 20 mm height: inner radius, thickness of the floor, radius at the rim; m."""
    at_rim = inner if lip is None else lip
    return revolved(
        [(0.0, 0.0), (10e-3, 0.0), (10e-3, 20e-3), (at_rim, 20e-3), (inner, floor), (0.0, floor)]
    )


# --- reading ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", BOXES)
def test_a_box_is_read_from_what_programs_write(name: str) -> None:
    vessel = vessel_of_file(DATA / name)
    np.testing.assert_array_equal(np.ptp(vessel.points, axis=0), [8e-3, 8e-3, 20e-3])
    assert len(vessel.planes()) == 5
    assert vessel.volume() == pytest.approx(1.28e-6)


def test_points_of_single_precision_are_those_that_were_written(tmp_path: Path) -> None:
    """2.65 is 2.65, of either order of bytes, and digits of double precision stay where VTK reads them."""
    box = prism(4, 2.65e-3, 12e-3)
    write(tmp_path, box, "own.stl")
    points = np.array(read_mesh(tmp_path / "own.stl")["points"])
    assert set(np.abs(points).ravel().tolist()) == {0.0, 2.65, 12.0}
    digits = 1e3 * box.points + 0.123456789012
    meshio.Mesh(digits, [("triangle", box.triangles)]).write(tmp_path / "own.vtu")
    np.testing.assert_array_equal(read_mesh(tmp_path / "own.vtu")["points"], digits)


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5], [3, 4, 5, 0, 1, 2]])
def test_polygons_may_be_concave(tmp_path: Path, order: list[int]) -> None:
    """An L, whose fan from its first corner overlaps, or not."""
    corners = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
    lines = [f"v {x} {y} {z}" for z in (0, 5) for x, y in corners]
    lines.append("f " + " ".join(str(1 + corner) for corner in order))
    lines += [f"f {1 + k} {1 + (k + 1) % 6} {7 + (k + 1) % 6} {7 + k}" for k in range(6)]
    (tmp_path / "own.obj").write_text("\n".join(lines))
    vessel = vessel_of_file(tmp_path / "own.obj")
    assert vessel.volume() == pytest.approx(12e-6 * 5e-3)
    assert len({*vessel.faces.tolist()}) == 7


XDMF = """<Xdmf Version="3.0"><Domain><Grid Name="Grid"><Geometry GeometryType="XYZ"><DataItem DataType="Float"
Dimensions="8 3" Format="Binary" Precision="8">/etc/passwd</DataItem></Geometry></Grid></Domain></Xdmf>"""
VTP = """<VTKFile type="PolyData" version="0.1"><PolyData><Piece NumberOfPoints="40000000000" NumberOfPolys="1">
</Piece></PolyData></VTKFile>"""
PLY = """ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y
property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n"""
FAR = "\n".join(
    [*(f"v 50000{x} {y} 0.5" for x in range(3) for y in range(3)), "f 1 2 4", "f 2 4 5", "f 3 4 5"]
)
FAR_STL = "\n".join(
    [
        "solid far",
        *(
            f"facet normal 0 0 1\nouter loop\nvertex 1000000.{k} 0 0\nvertex 1000020 0 0\nvertex 1000020 {k + 1} 0\n"
            "endloop\nendfacet"
            for k in range(3)
        ),
        "endsolid far",
    ]
)
UNREADABLE = {
    "words.obj": ("v a b c", "Failed to parse 0th vertex value at L.1"),
    "nan.obj": (
        "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3",
        "point 1 is (nan, 0, 0), which is no place",
    ),
    "beyond.obj": (
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9",
        "a polygon has the corner 9, but there are 3 points",
    ),
    "far.obj": (FAR, "too far for 7 digits; move the mesh to the origin"),
    "far.stl": (FAR_STL, "too far for 7 digits; move the mesh to the origin"),
    "empty.stl": ("", "Premature EOF while reading header"),
    "empty.obj": ("", "it has no points"),
    "short.off": (
        "OFF\n8 6 0\n0 0 0\n",
        "it announces 8 points and 6 faces, and has 1 lines of them",
    ),
    "crashing.ply": (PLY, "The result is out of range"),
    "large.vtp": (VTP, "it announces NumberOfPoints = 40000000000; at most 3,000,000 are read"),
    "elsewhere.xdmf": (XDMF, 'its data are in another file (Format="Binary")'),
    "including.inp": ("*NODE\n*INCLUDE, INPUT=/etc/passwd\n", "it includes another file"),
    "own.unknown": ("", "Could not deduce file format"),
    "own.msh": ("nothing", "Couldn't read file"),
}
"""Contents of files, and the reason that stands in the message."""


@pytest.mark.parametrize("name", UNREADABLE)
def test_the_reason_of_the_reader_is_told(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    contents, reason = UNREADABLE[name]
    (tmp_path / name).write_text(contents)
    with pytest.raises(
        ValueError, match=r"cannot be read: .*; expected the surface of a vessel as STL"
    ) as refusal:
        read_mesh(tmp_path / name)
    assert reason in str(refusal.value)
    assert capfd.readouterr() == ("", "")


def test_files_of_any_size_and_pipes_are_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(ValueError, match="is no file; expected a mesh"):
        read_mesh(tmp_path / "pipe.stl")
    with (tmp_path / "large.stl").open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    with pytest.raises(
        ValueError, match="has 67 MB; expected at most 67 MB, 20000 triangles: decimate"
    ):
        read_mesh(tmp_path / "large.stl")


# --- solids -----------------------------------------------------------------------------------------------------------


def test_the_inner_skin_of_a_solid_is_the_vessel() -> None:
    """As of a cup of 14 mm with walls and a floor of 3 mm."""
    vessel = vessel_of_file(DATA / "cup-as-solid.stl")
    np.testing.assert_allclose(np.ptp(vessel.points, axis=0), [8e-3, 8e-3, 17e-3], rtol=1e-12)
    assert vessel.height == pytest.approx(17e-3)
    assert vessel.volume() == pytest.approx(8e-3**2 * 17e-3)
    assert sorted(facet.name for facet in vessel.facets if facet.kind == "face") == [
        "+x",
        "+y",
        "-x",
        "-y",
        "floor",
    ]


@pytest.mark.parametrize(
    ("inner", "floor", "lip"), [(9e-3, 1e-3, None), (5e-3, 2e-3, None), (9e-3, 2e-3, 3e-3)]
)
def test_the_inner_skin_of_round_cups(inner: float, floor: float, lip: float | None) -> None:
    """Of thin and thick walls, and of a jar whose mouth is narrower than its body."""
    vessel = vessel_of_arrays(solid_cup(inner, floor, lip))
    top = inner if lip is None else lip
    mean = (inner**2 + inner * top + top**2) / 3.0
    area = 12.0 * sin(2.0 * pi / 24.0)  # of the polygon of 24 sides in the unit circle
    assert vessel.height == pytest.approx(20e-3 - floor)
    assert vessel.volume() == pytest.approx(area * mean * (20e-3 - floor), rel=1e-6)


def test_the_inner_skin_ends_at_the_lowest_point_of_an_oblique_rim() -> None:
    cup = solid_cup(9e-3, 1e-3)
    top = cup.points[:, 2] > 19e-3
    cup.points[top, 2] += 0.2 * cup.points[top, 0]
    vessel = vessel_of_arrays(cup)
    assert vessel.height == pytest.approx(20e-3 - 0.2 * 9e-3 - 1e-3, rel=0.02)
    assert np.ptp(vessel.points[vessel.rims[0], 2]) < 1e-9


def v_blender() -> Vessel:
    """A closed V of two arms, 10 mm deep along y."""
    outline = [
        (-9e-3, 12e-3),
        (-1e-3, 0.0),
        (1e-3, 0.0),
        (9e-3, 12e-3),
        (4e-3, 12e-3),
        (0.0, 6e-3),
        (-4e-3, 12e-3),
    ]
    count = len(outline)
    points = np.array([(x, y, z) for y in (-5e-3, 5e-3) for x, z in outline])
    end = [(0, 1, 6), (1, 5, 6), (1, 2, 5), (2, 3, 5), (3, 4, 5)]
    sides = [((k + 1) % count, k, count + k) for k in range(count)]
    sides += [((k + 1) % count, count + k, count + (k + 1) % count) for k in range(count)]
    other = [(count + a, count + c, count + b) for a, b, c in end]
    return Vessel(points, np.array([*end, *sides, *other]))


ROOMS = {
    "a drum that lies": turned(
        revolved([(0.0, 0.0), (8e-3, 0.0), (8e-3, 12e-3), (0.0, 12e-3)]), "x"
    ),
    "an hourglass": revolved([(0.0, 0.0), (8e-3, 0.0), (3e-3, 9e-3), (8e-3, 18e-3), (0.0, 18e-3)]),
    "a V-blender": v_blender(),
    "a can with a dished lid": revolved([(0.0, 0.0), (8e-3, 0.0), (8e-3, 12e-3), (0.0, 11e-3)]),
}


@pytest.mark.parametrize("name", ROOMS)
def test_closed_rooms_are_vessels(name: str) -> None:
    room = ROOMS[name]
    vessel = vessel_of_arrays(room)
    assert len(vessel.rims) == 0
    assert vessel.volume() == pytest.approx(abs(room.surface.volume), rel=1e-6)
    assert not (vessel.clearance(np.array([[0.0, 0.0, 1.5 * vessel.height]])) > 0.0).any()


SOLIDS: dict[str, tuple[Vessel, str]] = {
    "lies along y": (turned(solid_cup(9e-3, 2e-3), "x"), "is a solid whose inside opens toward -y"),
    "lies along x": (
        turned(solid_cup(5e-3, 2e-3), "y"),
        r"is a solid whose inside opens toward \+x",
    ),
    "is upside down": (
        turned(solid_cup(9e-3, 2e-3), "x", 180.0),
        "is a solid whose inside opens toward -z",
    ),
    "is a tube": (
        revolved([(8e-3, 0.0), (10e-3, 0.0), (10e-3, 20e-3), (8e-3, 20e-3), (8e-3, 0.0)]),
        "is closed, and 36 % of its convex hull",
    ),
    "is half full": (solid_cup(9e-3, 13e-3), "is closed, with a hollow in its top, 7 mm deep"),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_that_is_no_vessel_is_refused(name: str) -> None:
    solid, message = SOLIDS[name]
    with pytest.raises(InputError, match=message):
        vessel_of_arrays(solid)


# --- openings and parts -----------------------------------------------------------------------------------------------

REFUSED = {
    "jar-lying-y-up.stl": r"an opening that faces \+y, at \(0, 16, 0\) mm; expected .* \+z, which is up: rotate the",
    "two-boxes-side-by-side.stl": r"a closed part beside the vessel, at \(9, -4, 0\) mm; expected parts within it",
    "open-box-and-box-beside.stl": r"a closed part beside the vessel, at \(15, -4, 0\) mm; expected parts within it",
    "above.stl": r"a closed part above the vessel, at \(-1, -1, 25\) mm; expected parts within it",
    "bowtie.stl": r"openings that meet in a point, or .*, at \(0, 0, 8\) mm; expected one, at its top",
    "slot.stl": r"a rim that dips by 6.74 mm, at \(5, 2, 1\) mm; expected a rim about in one plane: close slots",
    "slotlid.stl": r"an opening that faces \+x, at \(5, 0, 4.5\) mm; expected one that faces \+z",
    "window.stl": r"an opening that faces \+x, at \(5, 0, 4\) mm; expected .* close a hole in its side",
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_beads_would_leave_is_refused_with_its_place(name: str) -> None:
    with pytest.raises(InputError, match=REFUSED[name]):
        vessel_of_file(DATA / name)


def test_a_hollow_pin_is_subtracted_once() -> None:
    """A box of 20 mm, a pin of 6 mm in it, and a hollow of 4 mm in the pin."""
    vessel = vessel_of_file(DATA / "hollow.stl")
    assert vessel.volume() == pytest.approx(8000e-9 - 216e-9)
    assert len({*vessel.faces.tolist()}) == 5 + 6


def test_beads_are_poured_into_a_jar_above_its_opening_alone(tmp_path: Path) -> None:
    """Its shoulder is 12 mm wide and its mouth 8 mm; a closed one has no places above it."""
    vessel = vessel_of_file(DATA / "jar-upright.stl")
    above = np.array([[0.0, 0.0, 20e-3], [5e-3, 0.0, 20e-3], [0.0, 5e-3, 17e-3]])
    assert (vessel.clearance(above) > 0.0).tolist() == [True, False, False]
    below = np.array([[5e-3, 0.0, 6e-3], [0.0, 0.0, 15e-3]])
    np.testing.assert_allclose(vessel.clearance(below), [1e-3, 4e-3], rtol=1e-9)
    case = build_case(poured(mesh=str(DATA / "jar-upright.stl"), scale="1 mm"))
    largest = max(case.mixture.radii) if case.mixture else 0.0
    for layer in case.boundary.geometry.layers(largest, 0.0):
        if layer.level > 16e-3:
            assert np.abs(layer.places).max() < 4e-3


def test_a_vessel_without_room_for_a_bead_says_so(tmp_path: Path) -> None:
    closed = write(tmp_path, cuboid(np.zeros(3), np.array([8e-3, 8e-3, 1e-3]), -1.0))
    with pytest.raises(
        InputError, match=r"no place to pour a bead of 1.\d+ mm from, .* open at its top"
    ) as refusal:
        build_case(poured(mesh=closed, scale="1 mm"))
    assert "at most 0" not in str(refusal.value)


# --- triangles that cross ---------------------------------------------------------------------------------------------


def cone(count: int) -> Vessel:
    """A fan of triangles at one tip, open above."""
    turns = 2.0 * pi * np.arange(count) / count
    ring = 5e-3 * np.stack([np.cos(turns), np.sin(turns), 1.0 + 0.0 * turns], axis=1)
    triangles = [(0, 1 + k, 1 + (k + 1) % count) for k in range(count)]
    return Vessel(np.concatenate([[[0.0, 0.0, 0.0]], ring]), np.array(triangles))


def test_a_fan_of_thousands_of_triangles_is_a_cone() -> None:
    vessel = vessel_of_arrays(cone(3000))
    assert vessel.volume() == pytest.approx(pi * 5e-3**3 / 3.0, rel=1e-5)


@pytest.mark.parametrize(
    ("low", "high"),
    [((-1e-3, -1e-3, 1e-3), (1e-3, 1e-3, 4e-3)), ((1e-3, -1.1e-4, 3e-3), (4e-3, 2.3e-4, 4e-3))],
    ids=["around the axis", "through the wall"],
)
def test_a_body_that_crosses_a_fan_is_found(
    low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    fan, body = cone(300), cuboid(np.array(low), np.array(high))
    points = np.concatenate([fan.points, body.points])
    both = Vessel(points, np.concatenate([fan.triangles, len(fan.points) + body.triangles]))
    with pytest.raises(InputError, match="has triangles that intersect, at"):
        vessel_of_arrays(both)


def test_a_flap_that_is_folded_back_is_found() -> None:
    """Its triangle lies upon its neighbour, with which it has an edge in common."""
    box = prism(4, 2e-3, 4e-3)
    points = np.concatenate([box.points, [[0.0, -2e-3, 2e-3]]])
    at_rim = np.flatnonzero(points[:, 2] > 3e-3)
    left, right = [k for k in at_rim if points[k, 1] < 0.0]
    flapped = np.concatenate(
        [box.triangles, [[left, right, len(points) - 1]], [[right, left, len(points) - 1]]]
    )
    with pytest.raises(InputError, match=r"overlap in a plane|triangles at an edge"):
        vessel_of_arrays(Vessel(points, flapped[:-1]))


# --- faces ------------------------------------------------------------------------------------------------------------


def steps_between_faces(vessel: Vessel) -> list[float]:
    """Distances of corners from the planes of the faces that they belong to, m."""
    steps = []
    for facet in vessel.facets:
        if facet.kind == "face":
            corners = np.array([point for cell in facet.cells for point, _, _ in cell])
            steps.append(float(np.abs((corners - facet.point) @ facet.direction).max()))
    return steps


def dish(radius: float) -> Vessel:
    """A part of a sphere of 10 mm by 10 mm, of 2,000 triangles."""
    across = np.linspace(-5e-3, 5e-3, 33)
    x, y = (axis.ravel() for axis in np.meshgrid(across, across))
    number = np.arange(len(x)).reshape(33, 33)
    a, b, c, d = (
        each.ravel()
        for each in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    )
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Vessel(np.stack([x, y, radius - np.sqrt(radius**2 - x**2 - y**2)], axis=1), triangles)


@pytest.mark.parametrize("radius", [0.1, 1.0, 100.0])
def test_a_shallow_dish_has_no_steps(radius: float) -> None:
    """None above those of its triangles, however small the angles between them are."""
    assert max(steps_between_faces(dish(radius))) < 1.001 * LEAST_STEP


def test_a_plane_of_many_triangles_of_single_precision_is_one_face() -> None:
    """Turned so that no corner is exactly in the plane."""
    flat = dish(1e6)
    rounded = turned(flat, "xyz", [10.0, 20.0, 30.0]).points.astype(np.float32).astype(float)  # type: ignore[arg-type]
    assert len({*Vessel(rounded, flat.triangles).faces.tolist()}) < 10


def test_a_bead_slides_over_a_seam_of_strips(tmp_path: Path) -> None:
    """Three strips that turn by 0.9 mrad: it stays on them, and is not thrown up by a step of micrometres."""
    case = {
        "boundary": {
            "mesh": str(DATA / "floor-strips-0.9mrad.stl"),
            "scale": "1 mm",
            "material": "polystyrene",
        },
        "beads": {"material": "glass"},
        "placed": [{"radius": "0.5 mm", "at": ["3 mm", "0 mm", "0.508 mm"]}],
        "liquid": {"name": "glycerol 87 %", "volume_fraction": 1e-4, "viscosity_ratio": 0.0},
        "contact": {"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "rolling_friction": 0.0},
        "drive": {"axis": "x", "frequency": "10 Hz", "peak_acceleration": "1 g"},
        "run": {"duration": "0.25 s", "longest_settling": "0.05 s"},
    }
    done = walkers.run(build_case(case), tmp_path)
    assert 0.5e-3 < done.motion.position[:, 0, 2].max() < 0.523e-3


# --- names ------------------------------------------------------------------------------------------------------------


def names(vessel: Vessel) -> list[str]:
    return [facet.name for facet in vessel.facets]


def test_walls_are_named_by_their_side() -> None:
    hexagon = names_of_faces([(-cos(k * pi / 3.0), -sin(k * pi / 3.0), 0.0) for k in range(6)])
    assert hexagon == ["+x", "60°", "120°", "-x", "240°", "300°"]
    slope = (-sin(pi / 6.0), 0.0, cos(pi / 6.0))
    assert names_of_faces([(0.0, 0.0, 1.0), slope, (0.0, 0.0, -1.0)], floor=True) == [
        "floor",
        "+x slope 30°",
        "lid",
    ]


def test_walls_of_one_side_are_told_apart_by_their_height() -> None:
    """Of a jar with a narrow mouth, whose shoulder hangs over."""
    found = names(vessel_of_file(DATA / "jar-upright.stl"))
    assert {"floor", "+x 0–12 mm", "+x 14–16 mm", "+x slope 135°"} <= {*found}


def test_names_of_walls_are_unique() -> None:
    for vessel in (
        vessel_of_arrays(bowl(5e-3, 12)),
        vessel_of_file(DATA / "hollow.stl"),
        cuboid(-np.ones(3), np.ones(3)),
    ):
        found = names(vessel)
        assert len({*found}) == len(found)
        assert not any("," in name for name in found)


# --- what is told -----------------------------------------------------------------------------------------------------


def text_of(boundary: dict[str, Any]) -> str:
    lines = preview_text(summarise(build_case(poured(**boundary)))).splitlines()
    return next(line for line in lines if line.startswith("vessel"))


def test_show_tells_opening_height_and_volume(tmp_path: Path) -> None:
    solid = text_of({"mesh": str(DATA / "cup-as-solid.stl"), "scale": "1 mm"})
    opened = "open toward +z, 8 mm × 8 mm wide, 17 mm high, 1.09 cm³"
    assert solid == f"vessel     5 planes (the mesh has 28 triangles), {opened}"
    closed = write(tmp_path, cuboid(np.zeros(3), np.array([10e-3, 10e-3, 20e-3]), -1.0))
    told = text_of({"mesh": closed, "scale": "1 mm"})
    assert (
        told
        == "vessel     6 planes, closed: beads are within this surface, 20 mm high, 2 cm³ inside"
    )


def test_a_run_at_more_facets_takes_longer(tmp_path: Path) -> None:
    """Of the same beads, in bowls of 96 and of 2,700 facets; the facets are most of the time at last."""
    seconds = []
    for rings in (4, 25):
        case = build_case(poured(mesh=write(tmp_path, bowl(5e-3, rings)), scale="1 mm"))
        seconds.append(predicted_seconds(case) / case.run.cycles)
    assert seconds[1] > 3.0 * seconds[0]


def test_layers_of_a_wide_vessel_are_made_when_beads_need_them() -> None:
    """Of a box 160 mm wide and 400 mm high there are 17,000 places in a layer, and 40 beads."""
    case = build_case(poured(mesh=str(DATA / "open-box.stl"), scale="20 mm"))
    assert case.boundary.width == pytest.approx(0.16)
    made: list[FloatArray] = []

    class Counting(VesselShape):
        def side_clearance(self, places: FloatArray) -> FloatArray:
            made.append(places)
            return super().side_clearance(places)

    boundary = case.boundary
    counted = Counting(
        boundary.width, boundary.height, boundary.planes, boundary.points, boundary.triangles
    )
    next(iter(counted.layers(0.6e-3, 0.0)))
    assert sum(map(len, made)) < 10_000


def test_beads_that_leave_a_vessel_are_not_called_walkers(tmp_path: Path) -> None:
    low = write(tmp_path, prism(6, 4e-3, 2e-3))
    tables = poured(mesh=low, scale="1 mm")
    tables["drive"] = {"axis": "z", "frequency": "80 Hz", "peak_acceleration": "200 g"}
    tables["run"] = {"duration": "0.2 s", "longest_settling": "0.05 s"}
    with pytest.raises(
        (failures.BeadsLost, failures.BeadsOverTheTop), match="left the vessel over its rim"
    ) as loss:
        walkers.run(build_case(tables), tmp_path)
    assert "walkers" not in str(loss.value).replace(str(tmp_path), "")
