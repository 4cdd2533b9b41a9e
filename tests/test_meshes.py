"""Mesh files: which are read, what becomes of a solid, and what is refused with its place."""

from __future__ import annotations

import os
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import walkers
from tests.test_vessels import bowl, cuboid, halves_of, poured, prism, square_dish, write
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
Profile = list[tuple[float, float]]
"""Corners of a profile: radius and height, m."""


def vessel_of_file(path: Path) -> Vessel:
    """The vessel that is read from a file whose unit is 1 mm."""
    return vessel_of(read_mesh(path), 1e-3)


def vessel_of_surface(surface: Vessel) -> Vessel:
    """What becomes of a surface in m as if it were in a file."""
    mesh = {"points": surface.points.tolist(), "triangles": surface.triangles.tolist()}
    return vessel_of(mesh, 1.0)


def joined(first: Vessel, second: Vessel) -> Vessel:
    """Two surfaces in one."""
    points = np.concatenate([first.points, second.points])
    triangles = [first.triangles, len(first.points) + second.triangles]
    return Vessel(points, np.concatenate(triangles))


def revolved(profile: Profile, sides: int = 24) -> Vessel:
    """A closed surface of a profile about the z axis, from its lowest to its highest point."""
    turns = 2.0 * pi * np.arange(sides) / sides
    ring = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    points = []
    for radius, height in profile:
        points.append(radius * ring + [0.0, 0.0, height])
    number = np.arange(len(profile) * sides).reshape(len(profile), sides)
    after = np.roll(number, -1, axis=1)
    return Vessel(np.concatenate(points), halves_of(number[:-1], after[:-1], after[1:], number[1:]))


def turned(surface: Vessel, axis: str, degrees: float = 90.0) -> Vessel:
    """The surface, turned about an axis."""
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    return Vessel(turn.apply(surface.points), surface.triangles)


def solid_cup(inner: float, floor: float, at_rim: float | None = None) -> Vessel:
    """A cup as a solid of 10 mm radius and 20 mm height.

    Its inner radius may differ at the rim; the floor has a thickness (m).
    """
    if at_rim is None:
        at_rim = inner
    outside = [(0.0, 0.0), (10e-3, 0.0), (10e-3, 20e-3)]
    inside = [(at_rim, 20e-3), (inner, floor), (0.0, floor)]
    return revolved(outside + inside)


# --- reading ------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "name",
    [
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
    ],
)
def test_a_box_is_read_from_what_programs_write(name: str) -> None:
    """All files have the same box, 8 mm wide and 20 mm high."""
    vessel = vessel_of_file(DATA / name)
    np.testing.assert_array_equal(np.ptp(vessel.points, axis=0), [8e-3, 8e-3, 20e-3])
    assert len(vessel.planes()) == 5
    assert vessel.volume() == pytest.approx(1.28e-6)


def test_points_of_single_precision_are_those_that_were_written(tmp_path: Path) -> None:
    """2.65 mm in the file is 2.65, not 2.6500000954."""
    write(tmp_path, prism(4, 2.65e-3, 12e-3), "own.stl")
    points = np.array(read_mesh(tmp_path / "own.stl")["points"])
    assert set(np.abs(points).ravel().tolist()) == {0.0, 2.65, 12.0}


def test_digits_of_double_precision_stay_where_vtk_reads_them(tmp_path: Path) -> None:
    box = prism(4, 2.65e-3, 12e-3)
    points = 1e3 * box.points + 0.123456789012
    meshio.Mesh(points, [("triangle", box.triangles)]).write(tmp_path / "own.vtu")
    np.testing.assert_array_equal(read_mesh(tmp_path / "own.vtu")["points"], points)


@pytest.mark.parametrize(
    "floor",
    [
        pytest.param("f 1 2 3 4 5 6", id="triangles from the first corner fill the L"),
        pytest.param("f 4 5 6 1 2 3", id="triangles from the first corner overlap"),
    ],
)
def test_polygons_may_be_concave(tmp_path: Path, floor: str) -> None:
    """A prism upon an L, which has an area of 12 mm², a floor and six sides."""
    corners = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
    lines = [f"v {x} {y} 0" for x, y in corners]
    lines += [f"v {x} {y} 5" for x, y in corners]
    lines.append(floor)
    for corner in range(6):
        after = (corner + 1) % 6
        lines.append(f"f {1 + corner} {1 + after} {7 + after} {7 + corner}")
    (tmp_path / "own.obj").write_text("\n".join(lines))
    vessel = vessel_of_file(tmp_path / "own.obj")
    assert vessel.volume() == pytest.approx(12e-6 * 5e-3)
    assert len(set(vessel.faces.tolist())) == 7


XDMF = """<Xdmf Version="3.0"><Domain><Grid Name="Grid"><Geometry GeometryType="XYZ">
<DataItem DataType="Float" Dimensions="8 3" Format="Binary" Precision="8">/etc/passwd</DataItem>
</Geometry></Grid></Domain></Xdmf>"""
VTP = """<VTKFile type="PolyData" version="0.1"><PolyData>
<Piece NumberOfPoints="40000000000" NumberOfPolys="1">
</Piece></PolyData></VTKFile>"""
PLY = """ply
format binary_little_endian 1.0
element vertex 4000000000
property float x
property float y
property float z
element face 12
property list uchar int vertex_indices
end_header
"""
FAR_OBJ = """v 500000 0 0.5
v 500000 1 0.5
v 500000 2 0.5
v 500001 0 0.5
v 500001 1 0.5
v 500001 2 0.5
v 500002 0 0.5
v 500002 1 0.5
v 500002 2 0.5
f 1 2 4
f 2 4 5
f 3 4 5
"""
"""Points of a lattice of 1 mm, half a kilometre away."""


def far_stl() -> str:
    """Triangles a kilometre away whose corners differ by tenths of a millimetre."""
    lines = ["solid far"]
    for number in range(3):
        lines += [
            "facet normal 0 0 1",
            "outer loop",
            f"vertex 1000000.{number} 0 0",
            "vertex 1000020 0 0",
            f"vertex 1000020 {number + 1} 0",
            "endloop",
            "endfacet",
        ]
    lines.append("endsolid far")
    return "\n".join(lines)


TOO_FAR = "too far for 7 digits; move the mesh to the origin"


@pytest.mark.parametrize(
    ("name", "contents", "reason"),
    [
        pytest.param(
            "words.obj",
            "v a b c",
            "Failed to parse 0th vertex value at L.1",
            id="words for numbers",
        ),
        pytest.param(
            "nan.obj",
            "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3",
            "point 1 is (nan, 0, 0), which is no place",
            id="a coordinate that is no number",
        ),
        pytest.param(
            "beyond.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9",
            "a polygon has the corner 9, but there are 3 points",
            id="a corner beyond the points",
        ),
        pytest.param("far.obj", FAR_OBJ, TOO_FAR, id="far from the origin, OBJ"),
        pytest.param("far.stl", far_stl(), TOO_FAR, id="far from the origin, STL"),
        pytest.param("empty.stl", "", "Premature EOF while reading header", id="empty STL"),
        pytest.param("empty.obj", "", "it has no points", id="empty OBJ"),
        pytest.param(
            "short.off",
            "OFF\n8 6 0\n0 0 0\n",
            "it announces 8 points and 6 faces, and has 1 lines of them",
            id="an end before the faces",
        ),
        pytest.param("crashing.ply", PLY, "The result is out of range", id="4e9 points, PLY"),
        pytest.param(
            "large.vtp",
            VTP,
            "it announces NumberOfPoints = 40000000000; at most 3,000,000 are read",
            id="4e10 points, VTP",
        ),
        pytest.param(
            "elsewhere.xdmf",
            XDMF,
            'its data are in another file (Format="Binary")',
            id="data elsewhere",
        ),
        pytest.param(
            "including.inp",
            "*NODE\n*INCLUDE, INPUT=/etc/passwd\n",
            "it includes another file",
            id="another file included",
        ),
        pytest.param("own.unknown", "", "Could not deduce file format", id="unknown suffix"),
        pytest.param("own.msh", "nothing", "Couldn't read file", id="contents of no format"),
    ],
)
def test_the_reason_of_the_reader_is_told(
    tmp_path: Path, name: str, contents: str, reason: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """In the message alone: the libraries that read print nothing."""
    (tmp_path / name).write_text(contents)
    message = r"cannot be read: .*; expected the surface of a vessel as STL"
    with pytest.raises(ValueError, match=message) as refusal:
        read_mesh(tmp_path / name)
    assert reason in str(refusal.value)
    assert capfd.readouterr() == ("", "")


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(ValueError, match="is no file; expected a mesh"):
        read_mesh(tmp_path / "pipe.stl")


def test_a_file_that_is_too_large_is_not_opened(tmp_path: Path) -> None:
    with (tmp_path / "large.stl").open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    message = "has 67 MB; expected at most 67 MB, 20000 triangles: decimate"
    with pytest.raises(ValueError, match=message):
        read_mesh(tmp_path / "large.stl")


# --- solids -------------------------------------------------------------------------------------
def test_the_inner_skin_of_a_solid_is_the_vessel() -> None:
    """A cup 14 mm wide and 20 mm high, whose walls and floor are 3 mm thick."""
    vessel = vessel_of_file(DATA / "cup-as-solid.stl")
    np.testing.assert_allclose(np.ptp(vessel.points, axis=0), [8e-3, 8e-3, 17e-3], rtol=1e-12)
    assert vessel.height == pytest.approx(17e-3)
    assert vessel.volume() == pytest.approx(8e-3**2 * 17e-3)


def test_the_inner_skin_of_a_solid_has_a_floor_and_four_sides() -> None:
    vessel = vessel_of_file(DATA / "cup-as-solid.stl")
    faces = {facet.name for facet in vessel.facets if facet.kind == "face"}
    assert faces == {"floor", "-x", "+x", "-y", "+y"}


@pytest.mark.parametrize(
    ("inner", "floor", "at_rim"),
    [
        pytest.param(9e-3, 1e-3, 9e-3, id="thin walls"),
        pytest.param(5e-3, 2e-3, 5e-3, id="thick walls"),
        pytest.param(9e-3, 2e-3, 3e-3, id="narrow mouth"),
    ],
)
def test_the_inner_skin_of_round_cups(inner: float, floor: float, at_rim: float) -> None:
    """A frustum of the height h between the radii a and b: its volume is A (a² + ab + b²) h / 3.

    A is the area of the polygon of 24 sides in the unit circle.
    """
    vessel = vessel_of_surface(solid_cup(inner, floor, at_rim))
    height = 20e-3 - floor
    area = 12.0 * sin(2.0 * pi / 24.0)
    mean_square = (inner**2 + inner * at_rim + at_rim**2) / 3.0
    assert vessel.height == pytest.approx(height)
    assert vessel.volume() == pytest.approx(area * mean_square * height, rel=1e-6)


def test_the_inner_skin_ends_at_the_lowest_point_of_an_oblique_rim() -> None:
    """The rim rises by x / 5; it is lowest at x = -9 mm, and the floor is 1 mm thick."""
    cup = solid_cup(9e-3, 1e-3)
    top = cup.points[:, 2] > 19e-3
    cup.points[top, 2] += 0.2 * cup.points[top, 0]
    vessel = vessel_of_surface(cup)
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
    points = [(x, -5e-3, z) for x, z in outline] + [(x, 5e-3, z) for x, z in outline]
    count = len(outline)
    front = np.array([(0, 1, 6), (1, 5, 6), (1, 2, 5), (2, 3, 5), (3, 4, 5)])
    back = count + front[:, ::-1]
    corner = np.arange(count)
    after = (corner + 1) % count
    sides = halves_of(after, corner, count + corner, count + after)
    return Vessel(np.array(points), np.concatenate([front, sides, back]))


@pytest.mark.parametrize(
    "room",
    [
        pytest.param(
            turned(revolved([(0.0, 0.0), (8e-3, 0.0), (8e-3, 12e-3), (0.0, 12e-3)]), "x"),
            id="a drum that lies",
        ),
        pytest.param(
            revolved([(0.0, 0.0), (8e-3, 0.0), (3e-3, 9e-3), (8e-3, 18e-3), (0.0, 18e-3)]),
            id="an hourglass",
        ),
        pytest.param(v_blender(), id="a V-blender"),
        pytest.param(
            revolved([(0.0, 0.0), (8e-3, 0.0), (8e-3, 12e-3), (0.0, 11e-3)]),
            id="a can with a dished lid",
        ),
    ],
)
def test_closed_rooms_are_vessels(room: Vessel) -> None:
    """They have no rim, and all of their volume is inside; above them is no place."""
    vessel = vessel_of_surface(room)
    assert len(vessel.rims) == 0
    assert vessel.volume() == pytest.approx(abs(room.surface.volume), rel=1e-6)
    above = np.array([[0.0, 0.0, 1.5 * vessel.height]])
    assert not (vessel.clearance(above) > 0.0).any()


TUBE = [(8e-3, 0.0), (10e-3, 0.0), (10e-3, 20e-3), (8e-3, 20e-3), (8e-3, 0.0)]


@pytest.mark.parametrize(
    ("solid", "message"),
    [
        pytest.param(
            turned(solid_cup(9e-3, 2e-3), "x"),
            "is a solid whose inside opens toward -y",
            id="lies along y",
        ),
        pytest.param(
            turned(solid_cup(5e-3, 2e-3), "y"),
            r"is a solid whose inside opens toward \+x",
            id="lies along x",
        ),
        pytest.param(
            turned(solid_cup(9e-3, 2e-3), "x", 180.0),
            "is a solid whose inside opens toward -z",
            id="is upside down",
        ),
        pytest.param(revolved(TUBE), "is closed, and 36 % of its convex hull", id="is a tube"),
        pytest.param(
            solid_cup(9e-3, 13e-3),
            "is closed, with a hollow in its top, 7 mm deep",
            id="is half full",
        ),
    ],
)
def test_a_solid_that_is_no_vessel_is_refused(solid: Vessel, message: str) -> None:
    with pytest.raises(InputError, match=message):
        vessel_of_surface(solid)


# --- openings and parts -------------------------------------------------------------------------
REFUSED_FILES = {
    "jar-lying-y-up.stl": (
        r"an opening that faces \+y, at \(0, 16, 0\) mm; "
        r"expected .* \+z, which is up: rotate the"
    ),
    "two-boxes-side-by-side.stl": (
        r"a closed part beside the vessel, at \(9, -4, 0\) mm; expected parts within it"
    ),
    "open-box-and-box-beside.stl": (
        r"a closed part beside the vessel, at \(15, -4, 0\) mm; expected parts within it"
    ),
    "above.stl": (
        r"a closed part above the vessel, at \(-1, -1, 25\) mm; expected parts within it"
    ),
    "bowtie.stl": (
        r"openings that meet in a point, or .*, at \(0, 0, 8\) mm; expected one, at its top"
    ),
    "slot.stl": (
        r"a rim that dips by 6.74 mm, at \(5, 2, 1\) mm; "
        r"expected a rim about in one plane: close slots"
    ),
    "slotlid.stl": (r"an opening that faces \+x, at \(5, 0, 4.5\) mm; expected one that faces \+z"),
    "window.stl": (
        r"an opening that faces \+x, at \(5, 0, 4\) mm; expected .* close a hole in its side"
    ),
}
"""Files of `DATA`, and the messages that refuse them."""


@pytest.mark.parametrize(("name", "message"), REFUSED_FILES.items(), ids=REFUSED_FILES)
def test_what_beads_would_leave_is_refused_with_its_place(name: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        vessel_of_file(DATA / name)


def test_a_hollow_pin_is_subtracted_once() -> None:
    """A box of 20 mm, a pin of 6 mm in it, and a hollow of 4 mm in the pin."""
    vessel = vessel_of_file(DATA / "hollow.stl")
    assert vessel.volume() == pytest.approx(20e-3**3 - 6e-3**3)
    assert len(set(vessel.faces.tolist())) == 5 + 6


# --- a jar --------------------------------------------------------------------------------------
@pytest.fixture
def jar() -> Vessel:
    """A square jar, 12 mm wide up to a height of 12 mm and 8 mm wide from 14 mm to 16 mm."""
    return vessel_of_file(DATA / "jar-upright.stl")


def test_places_above_a_jar_are_above_its_opening_alone(jar: Vessel) -> None:
    """Upon the axis, but not above the shoulder or beside the mouth."""
    places = np.array([[0.0, 0.0, 20e-3], [5e-3, 0.0, 20e-3], [0.0, 5e-3, 17e-3]])
    assert (jar.clearance(places) > 0.0).tolist() == [True, False, False]


def test_places_in_a_jar_are_as_far_from_its_walls_as_it_is_wide(jar: Vessel) -> None:
    """1 mm from the shoulder, which has a half width of 6 mm, and 4 mm from the mouth."""
    places = np.array([[5e-3, 0.0, 6e-3], [0.0, 0.0, 15e-3]])
    np.testing.assert_allclose(jar.clearance(places), [1e-3, 4e-3], rtol=1e-9)


def test_beads_are_poured_into_a_jar_above_its_opening_alone() -> None:
    case = build_case(poured(mesh=str(DATA / "jar-upright.stl"), scale="1 mm"))
    assert case.mixture is not None
    for layer in case.boundary.geometry.layers(max(case.mixture.radii), 0.0):
        if layer.level > 16e-3:
            assert np.abs(layer.places).max() < 4e-3


def test_a_vessel_without_room_for_a_bead_says_so(tmp_path: Path) -> None:
    """A closed room, 1 mm high."""
    closed = write(tmp_path, cuboid(np.zeros(3), np.array([8e-3, 8e-3, 1e-3]), -1.0))
    message = r"no place to pour a bead of 1.\d+ mm from, .* open at its top"
    with pytest.raises(InputError, match=message) as refusal:
        build_case(poured(mesh=closed, scale="1 mm"))
    assert "at most 0" not in str(refusal.value)


# --- triangles that cross -----------------------------------------------------------------------
def cone(count: int) -> Vessel:
    """A fan of triangles at one tip, open above; the rim has a radius and a height of 5 mm."""
    turns = 2.0 * pi * np.arange(count) / count
    rim = 5e-3 * np.stack([np.cos(turns), np.sin(turns), np.ones_like(turns)], axis=1)
    corner = np.arange(count)
    triangles = np.stack([0 * corner, 1 + corner, 1 + (corner + 1) % count], axis=1)
    return Vessel(np.concatenate([[[0.0, 0.0, 0.0]], rim]), triangles)


def test_a_fan_of_thousands_of_triangles_is_a_cone() -> None:
    """Its volume is π r² h / 3."""
    vessel = vessel_of_surface(cone(3000))
    assert vessel.volume() == pytest.approx(pi * 5e-3**3 / 3.0, rel=1e-5)


@pytest.mark.parametrize(
    ("low", "high"),
    [
        pytest.param((-1e-3, -1e-3, 1e-3), (1e-3, 1e-3, 4e-3), id="around the axis"),
        pytest.param((1e-3, -1.1e-4, 3e-3), (4e-3, 2.3e-4, 4e-3), id="through the wall"),
    ],
)
def test_a_body_that_crosses_a_fan_is_found(
    low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    body = cuboid(np.array(low), np.array(high))
    with pytest.raises(InputError, match="has triangles that intersect, at"):
        vessel_of_surface(joined(cone(300), body))


def test_a_flap_that_is_folded_back_is_found() -> None:
    """Its triangle lies upon its neighbour, with which it has an edge in common."""
    box = prism(4, 2e-3, 4e-3)
    at_rim = box.points[:, 2] > 3e-3
    left, right = np.flatnonzero(at_rim & (box.points[:, 1] < 0.0))
    middle_of_side = [0.0, -2e-3, 2e-3]
    points = np.concatenate([box.points, [middle_of_side]])
    flap = [left, right, len(box.points)]
    with pytest.raises(InputError, match=r"overlap in a plane|triangles at an edge"):
        vessel_of_surface(Vessel(points, np.concatenate([box.triangles, [flap]])))


# --- faces --------------------------------------------------------------------------------------
def steps_between_faces(vessel: Vessel) -> list[float]:
    """Largest distance of the corners of each face from its plane, m."""
    steps = []
    for facet in vessel.facets:
        if facet.kind != "face":
            continue
        corners = []
        for cell in facet.cells:
            corners += [half_space.point for half_space in cell]
        distances = np.abs((np.array(corners) - facet.point) @ facet.direction)
        steps.append(float(distances.max()))
    return steps


def dish(radius: float) -> Vessel:
    """A part of a sphere of 10 mm by 10 mm, of 2,000 triangles."""
    return square_dish(5e-3, 33, lambda distance: radius - np.sqrt(radius**2 - distance**2))


@pytest.mark.parametrize("radius", [0.1, 1.0, 100.0])
def test_a_shallow_dish_has_no_steps(radius: float) -> None:
    """Faces are as flat as asked for, however small the angles between their triangles are."""
    assert max(steps_between_faces(dish(radius))) < 1.001 * LEAST_STEP


def test_a_plane_of_many_triangles_of_single_precision_is_one_face() -> None:
    """Or a few: it is turned so that no corner is exactly in the plane after rounding."""
    flat = dish(1e6)
    turn = Rotation.from_euler("xyz", [10.0, 20.0, 30.0], degrees=True)
    rounded = turn.apply(flat.points).astype(np.float32).astype(float)
    assert len(set(Vessel(rounded, flat.triangles).faces.tolist())) < 10


def test_a_bead_slides_over_a_seam_of_strips(tmp_path: Path) -> None:
    """Three strips that turn by 0.9 mrad: the bead stays on them.

    A step of micrometres would throw it up.
    """
    case: dict[str, Any] = {
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


# --- names --------------------------------------------------------------------------------------
def test_upright_walls_are_named_by_the_direction_in_which_they_stand() -> None:
    """The sides of a hexagon, whose normals point inward."""
    angles = np.radians([0.0, 60.0, 120.0, 180.0, 240.0, 300.0])
    normals = [(-cos(angle), -sin(angle), 0.0) for angle in angles.tolist()]
    assert names_of_faces(normals) == ["+x", "60°", "120°", "-x", "240°", "300°"]


def test_other_walls_are_named_by_their_slope() -> None:
    floor = (0.0, 0.0, 1.0)
    slope = (-0.5, 0.0, sqrt(0.75))
    lid = (0.0, 0.0, -1.0)
    names = names_of_faces([floor, slope, lid], floor=True)
    assert names == ["floor", "+x slope 30°", "lid"]


def test_walls_of_one_side_are_told_apart_by_their_height(jar: Vessel) -> None:
    """The shoulder of the jar hangs over."""
    names = {facet.name for facet in jar.facets}
    assert names >= {"floor", "+x 0–12 mm", "+x 14–16 mm", "+x slope 135°"}


def assert_names_are_unique(vessel: Vessel) -> None:
    """All walls have different names, without the comma that separates names in lists."""
    names = [facet.name for facet in vessel.facets]
    assert len(set(names)) == len(names)
    assert "," not in "".join(names)


def test_names_of_walls_of_a_bowl_are_unique() -> None:
    assert_names_are_unique(vessel_of_surface(bowl(5e-3, 12)))


def test_names_of_walls_of_a_box_with_a_pin_are_unique() -> None:
    assert_names_are_unique(vessel_of_file(DATA / "hollow.stl"))


def test_names_of_walls_of_a_block_are_unique() -> None:
    assert_names_are_unique(cuboid(-np.ones(3), np.ones(3)))


# --- what is told -------------------------------------------------------------------------------
def shown_vessel(boundary: dict[str, Any]) -> str:
    """The lines of ``walkers show`` about the vessel of a case, as one."""
    text = preview_text(summarise(build_case(poured(**boundary))))
    _, _, after = text.partition("\nvessel ")
    first, *others = after.splitlines()
    lines = [f"vessel {first}"]
    for line in others:
        if not line.startswith(" " * 11):
            break
        lines.append(line.strip())
    return " ".join(lines)


def test_show_tells_opening_height_and_volume() -> None:
    """8 mm × 8 mm × 17 mm are 1.09 cm³."""
    assert shown_vessel({"mesh": str(DATA / "cup-as-solid.stl"), "scale": "1 mm"}) == (
        "vessel     5 planes (the mesh has 28 triangles), "
        "open toward +z, 8 mm × 8 mm wide, 17 mm high, 1.09 cm³"
    )


def test_show_tells_that_a_vessel_is_closed(tmp_path: Path) -> None:
    """10 mm × 10 mm × 20 mm are 2 cm³."""
    closed = write(tmp_path, cuboid(np.zeros(3), np.array([10e-3, 10e-3, 20e-3]), -1.0))
    assert shown_vessel({"mesh": closed, "scale": "1 mm"}) == (
        "vessel     6 planes, closed: beads are within this surface, 20 mm high, 2 cm³ inside"
    )


def seconds_per_cycle(folder: Path, rings: int) -> float:
    """Predicted time of a cycle of a dozen beads in a bowl of facets, s."""
    case = build_case(poured(mesh=write(folder, bowl(5e-3, rings)), scale="1 mm"))
    return predicted_seconds(case) / case.run.cycles


def test_a_run_at_more_facets_takes_longer(tmp_path: Path) -> None:
    """96 facets take little of the time, and 2,700 facets most of it."""
    assert seconds_per_cycle(tmp_path, 25) > 3.0 * seconds_per_cycle(tmp_path, 4)


def test_layers_of_a_wide_vessel_are_made_when_beads_need_them() -> None:
    """A layer of a box 160 mm wide has 17,000 places for beads of 0.6 mm, and comes in strips."""
    boundary = build_case(poured(mesh=str(DATA / "open-box.stl"), scale="20 mm")).boundary
    assert boundary.width == pytest.approx(0.16)
    asked: list[FloatArray] = []

    class CountingShape(VesselShape):
        """Notes the places whose clearance is computed."""

        def side_clearance(self, places: FloatArray) -> FloatArray:
            asked.append(places)
            return super().side_clearance(places)

    shape = CountingShape(
        boundary.width, boundary.height, boundary.planes, boundary.points, boundary.triangles
    )
    next(iter(shape.layers(0.6e-3, 0.0)))
    assert sum(map(len, asked)) < 10_000


def test_beads_that_leave_a_vessel_are_not_called_walkers(tmp_path: Path) -> None:
    """They jump out of a hexagon 2 mm high at 200 g."""
    tables = poured(mesh=write(tmp_path, prism(6, 4e-3, 2e-3)), scale="1 mm")
    tables["drive"] = {"axis": "z", "frequency": "80 Hz", "peak_acceleration": "200 g"}
    tables["run"] = {"duration": "0.2 s", "longest_settling": "0.05 s"}
    lost = (failures.BeadsLost, failures.BeadsOverTheTop)
    with pytest.raises(lost, match="left the vessel over its rim") as loss:
        walkers.run(build_case(tables), tmp_path)
    assert "walkers" not in str(loss.value).replace(str(tmp_path), "")
