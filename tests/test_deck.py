"""The deck: readable and exact."""

import re
from dataclasses import replace
from hashlib import sha256
from itertools import combinations_with_replacement
from math import inf
from typing import Literal

import numpy as np
import pytest

from tests.conftest import document, make_case
from walkers.inputs import load_case, resolve_case, shipped_cases
from walkers.inputs.boundary import SIDES, Cylinder, Face
from walkers.postprocess.dump import FloatArray
from walkers.templates import render_deck
from walkers.templates.deck import CONTENT_VERSION, Deck, Segment, render_shared_deck, settling_steps
from walkers.templates.placement import place
from walkers.templates.walls import face_triangle, strip


@pytest.fixture(scope="module")
def deck() -> str:
    return render_deck(load_case("fig1b")).text


def _lines(deck: str, start: str) -> list[list[str]]:
    return [line.split() for line in deck.splitlines() if line.startswith(start)]


def test_the_walls_stand_once_and_all_contacts_have_the_tables(deck: str) -> None:
    (mesh,) = [line[1] for line in _lines(deck, "fix") if line[3] == "mesh/surface"]
    (wall,) = [line for line in _lines(deck, "fix") if line[3] == "wall/gran"]
    assert wall[-7:] == ["mesh", "n_meshes", "1", "meshes", mesh, "table", "bridges.txt"]
    (pair,) = _lines(deck, "pair_style")
    assert pair[-2:] == ["table", "bridges.txt"]
    assert render_deck(load_case("fig1b")).files["walls.stl"].count("facet normal") == 1


def test_each_two_surfaces_that_may_meet_have_a_table() -> None:
    cases = [
        make_case(),
        make_case(liquid={"volume_fraction": 0.02}),
        make_case(dimers={"radii": ["0.4 mm", "0.2 mm"]}),
    ]
    tables = _lines(render_shared_deck(cases).files["bridges.txt"], "bridge")
    met = {(int(one), int(two), float(radius), float(other)) for _, one, two, radius, other in tables}
    assert len(met) == len(tables)
    radii = {1: (2e-4, 3e-4, 4e-4), 2: (2e-4, 3e-4)}
    walls = {(kind, 3, radius, inf) for kind, sizes in radii.items() for radius in sizes}
    pairs = {(kind, kind, *pair) for kind, sizes in radii.items() for pair in combinations_with_replacement(sizes, 2)}
    assert met == walls | pairs


def test_the_triangle_is_far_larger_than_the_box_and_its_centroid_in_it() -> None:
    case = load_case("fig4b")
    stl = render_deck(case).files["walls.stl"]
    corners = [tuple(map(float, match)) for match in re.findall(r"vertex (\S+) (\S+) (\S+)", stl)]
    scene, _ = place((case,))
    centroid = [sum(corner[axis] for corner in corners) / 3 for axis in range(3)]
    assert all(low < middle < high for low, middle, high in zip(scene.lower, centroid, scene.upper, strict=True))
    assert min(abs(corner[1]) for corner in corners) > 10 * scene.upper[1]


def test_beads_start_with_the_substrate_in_the_laboratory_frame() -> None:
    case = make_case(drive={"frame": "lab"})
    deck = render_deck(case).text
    velocities = _lines(deck, "velocity")
    assert [(line[1], float(line[3])) for line in velocities] == [("all", case.drive.peak_velocity)]
    assert len([line for line in _lines(deck, "fix") if "wiggle" in line]) == 1


def test_the_container_frame_has_a_signed_gravity_and_walls_at_rest() -> None:
    deck = render_deck(make_case()).text
    assert "wiggle" not in deck
    assert not _lines(deck, "velocity")
    (drive,) = [line for line in _lines(deck, "fix") if "v_drive_1" in line]
    assert drive[-4:] == ["vector", "1.0", "0.0", "0.0"]
    (gravity,) = [line for line in _lines(deck, "fix") if line[1] == "gravity"]
    assert gravity[2:5] == ["all", "gravity", "9.81"]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("side", [1, -1])
def test_a_face_is_wound_about_its_normal(axis: Literal["x", "y", "z"], side: Literal[1, -1]) -> None:
    face = Face(axis, side, (1e-3, 2e-3, 3e-3))
    text = face_triangle(face, 0.1)
    corners = np.array([list(map(float, match)) for match in re.findall(r"vertex (\S+) (\S+) (\S+)", text)])
    np.testing.assert_allclose(corners.mean(axis=0), face.centroid, atol=1e-15)
    wound = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    np.testing.assert_allclose(wound / np.linalg.norm(wound), face.normal, atol=1e-15)


def _triangles(stl: str) -> FloatArray:
    """Corners, shape (T, 3, 3)."""
    return np.array([list(map(float, one)) for one in re.findall(r"vertex (\S+) (\S+) (\S+)", stl)]).reshape(-1, 3, 3)


def test_a_round_wall_has_a_mesh_for_each_size_of_beads_whose_faces_are_shared_but_for_the_precision() -> None:
    square = load_case("pile-ci").boundary
    round_one = Cylinder(material=square.material, width=square.width, height=square.height)
    case = replace(load_case("pile-ci"), boundary=round_one)
    scene, _ = place((case,))
    deck = render_deck(case)
    meshes = [line for line in _lines(deck.text, "fix") if line[3] == "mesh/surface"]
    groups = _lines(deck.text, "group           walls_")
    assert sorted(int(one) for line in groups for one in line[3:]) == [bead.id for bead in scene.beads]
    assert len({line[5] for line in meshes}) == len(meshes) > 1
    faces = round_one.faces()
    for line in meshes:
        precision = float(line[line.index("precision") + 1])
        ids = {int(one) for group in groups if group[1] == line[2] for one in group[3:]}
        radii = [bead.radius for bead in scene.beads if bead.id in ids]
        corners = _triangles(deck.files[line[5]])
        assert len(corners) == 1 + (len(faces) - 1) * faces[1].triangles
        wound = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = np.array([faces[0].normal, *(one.normal for one in faces[1:] for _ in range(one.triangles))])
        np.testing.assert_allclose(wound / np.linalg.norm(wound, axis=1)[:, None], normals, atol=1e-12)
        # Beads that touch the wall find their faces' ends meeting, never a gap between them.
        half = np.linalg.norm(np.diff(corners[1:, :, :2], axis=1), axis=2).max() / 2.0
        inner = (round_one.width / 2.0 - np.array(radii)) * np.tan(np.pi / SIDES)
        assert np.all((half > inner) & (half < 1.03 * inner))
        # The ends of adjacent faces are one for the engine, those of one face are two.
        apart = 2.0 * (round_one.width / 2.0 * np.tan(np.pi / SIDES) - half)
        assert apart < precision < np.sqrt(2.0) * half


def test_a_high_cylinder_has_no_triangle_too_slender_for_the_engine() -> None:
    wall = Cylinder(material="glass", width=5e-3, height=0.2).faces()[1]
    assert wall.of is not None
    half = wall.of.half_width(5e-3 / 8.0)
    corners = _triangles(strip(wall, wall.of, half))
    assert len(corners) == 2 * wall.of.pieces > 2
    sides = corners - np.roll(corners, 1, axis=1)
    lengths = np.sort(np.linalg.norm(sides, axis=2), axis=1)
    assert np.all(lengths[:, 0] / lengths[:, 2] >= 1e-3)


def test_rolling_friction_is_left_out_where_there_is_none() -> None:
    assert "rolling" not in "\n".join(line for line in render_deck(make_case()).text.splitlines() if line[:1] != "#")
    assert render_deck(make_case(contact={"rolling_friction": 0.003})).text.count("rolling_friction cdt") == 2


@pytest.mark.parametrize("name", shipped_cases())
def test_numbers_are_rendered_in_full_precision(name: str) -> None:
    case = load_case(name)
    deck = render_deck(case).text
    assert f"timestep        {case.run.time_step!r}\n" in deck
    scene, _ = place((case,))
    starts = [tuple(map(float, line[3:6])) for line in _lines(deck, "create_atoms")]
    assert starts == [bead.centre for bead in scene.beads]


def test_every_block_says_why_it_is_as_it_is(deck: str) -> None:
    blocks = re.split(r"^# --- .*$", deck, flags=re.MULTILINE)[1:]
    assert len(blocks) == 8
    assert all(block.lstrip("\n").startswith("# ") for block in blocks)


def test_there_is_one_run_and_one_thermo_style(deck: str) -> None:
    assert len(_lines(deck, "run ")) == 1
    assert len(_lines(deck, "thermo_style")) == 1


CONTENT = {
    1: "7dc0566616dc45cc",
    2: "c2be1211d5b6b532",
    3: "e993195041abe10b",
    4: "9700ab33da1ab01e",
    5: "e7fab73da94479b5",
    6: "3cb4429f05c982e1",
}
"""Digest of all that the engine reads of some cases, by the version of the decks' content."""


def _reads(deck: Deck) -> str:
    """The commands and files of a deck, numbers to eleven digits: other machines' sines may differ in the last one."""
    commands = [line for line in deck.text.splitlines() if not line.startswith("#")]
    words = " ".join([*commands, *(f"{name} {text}" for name, text in deck.files.items())]).split()
    return " ".join(f"{float(word):.11g}" if re.fullmatch(r"[-+.\de]*\d[-+.\de]*", word) else word for word in words)


def test_a_change_of_what_decks_compute_asks_for_another_version() -> None:
    """Runs are named by the case and this version, so that a comment leaves them alone; a change of the rest must not.

    If this fails and the decks are meant to have changed: raise `CONTENT_VERSION` and write its digest down here.
    """
    harmonics = [{"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": [1, 0, 1], "phase": "30 deg"}]
    several = document(contact={"rolling_friction": 0.01}, boundary={"tilt": "20 deg"})
    several["drive"] = {"harmonics": [*harmonics, {"frequency": "120 Hz", "peak_acceleration": "1 g"}]}
    film = {"liquid": {"film_drag_ratio": 0.5}, "dimers": {"replicates": 3, "angle": "10 deg"}}
    decks = [render_deck(case) for case in (make_case(), make_case(**film), resolve_case(several))]
    decks += [render_deck(make_case(**film, drive={"frame": "lab", "axis": axis})) for axis in "xyz"]
    shared = [
        make_case(),
        make_case(contact={"restitution": 0.6}, run={"seed": 2}),
        make_case(**film, drive={"peak_acceleration": "2 g", "axis": "y"}, boundary={"tilt": "20 deg"}),
    ]
    decks += [render_shared_deck(shared[:2]), render_shared_deck(shared)]
    piles = [load_case("pile-ci"), load_case("cluster")]
    square = piles[0].boundary
    round_one = Cylinder(material=square.material, width=square.width, height=square.height)
    piles += [replace(piles[0], run=replace(piles[0].run, ranks=2)), replace(piles[0], boundary=round_one)]
    for case in piles:
        settled = settling_steps(case)
        end = settled + case.run.cycles_per_segment * case.run.steps_per_cycle
        decks += [render_deck(case, Segment(0, settled, None)), render_deck(case, Segment(settled, end, settled))]
    digest = sha256("\n".join(map(_reads, decks)).encode()).hexdigest()[:16]
    assert digest == CONTENT[CONTENT_VERSION]
