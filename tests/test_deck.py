"""The deck: readable and exact."""

import re
from dataclasses import replace
from hashlib import sha256
from itertools import combinations_with_replacement
from math import inf

import pytest

from tests.conftest import document, make_case
from walkers.inputs import load_case, resolve_case, shipped_cases
from walkers.inputs.boundary import Box, Cylinder
from walkers.templates import render_deck
from walkers.templates.deck import CONTENT_VERSION, Deck, Segment, render_shared_deck, settling_steps
from walkers.templates.scene import place


@pytest.fixture(scope="module")
def deck() -> str:
    return render_deck(load_case("fig1b")).text


def _lines(deck: str, start: str) -> list[list[str]]:
    return [line.split() for line in deck.splitlines() if line.startswith(start)]


def test_the_walls_stand_once_and_contacts_have_the_tables(deck: str) -> None:
    assert _walls(deck).startswith("fix walls all wall/bridge type 2 plane 0.0 0.0 0.0 0.0 0.0 1.0 shaken")
    (pair,) = _lines(deck, "pair_style")
    assert pair[-2:] == ["table", "bridges.txt"]


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


def _walls(deck: str) -> str:
    """The command of the walls' fix on one line."""
    (command,) = re.findall(r"^fix +walls .*", deck.replace("&\n", " "), flags=re.MULTILINE)
    return " ".join(str(command).split())


def test_walls_are_planes_and_cylinders_as_the_boundary_has_them() -> None:
    across = "-0.002 0.0 0.0 1.0 0.0 0.0", "0.002 0.0 0.0 -1.0 0.0 0.0"
    along = "0.0 -0.002 0.0 0.0 1.0 0.0", "0.0 0.002 0.0 0.0 -1.0 0.0"
    boundaries = {
        Box(material="glass", width=4e-3, height=2e-2): " ".join(f"plane {one}" for one in across + along),
        Cylinder(material="glass", width=4e-3, height=2e-2): "cylinder 0.0 0.0 0.002",
    }
    for boundary, sides in boundaries.items():
        deck = render_deck(replace(load_case("pile-ci"), boundary=boundary), Segment(0, 1000, None)).text
        assert _walls(deck) == f"fix walls all wall/bridge type 2 plane 0.0 0.0 0.0 0.0 0.0 1.0 {sides}"


def test_beads_start_with_the_substrate_in_the_laboratory_frame() -> None:
    case = make_case(drive={"frame": "lab"})
    deck = render_deck(case).text
    velocities = _lines(deck, "velocity")
    assert [(line[1], float(line[3])) for line in velocities] == [("all", case.drive.peak_velocity)]
    assert _walls(deck).endswith("begin 0 frame lab")


def test_the_container_frame_has_walls_at_rest() -> None:
    case = make_case()
    deck, wave = render_deck(case).text, case.drive.harmonics[0]
    assert not _lines(deck, "velocity")
    assert _walls(deck).endswith(f"shaken {wave.amplitude!r} 0.0 0.0 {wave.frequency} 0.0 begin 0 frame walls")
    (gravity,) = [line for line in _lines(deck, "fix") if line[1] == "gravity"]
    assert gravity[2:5] == ["all", "gravity", "9.81"]


def test_rolling_friction_is_left_out_where_there_is_none() -> None:
    assert "rolling" not in "\n".join(line for line in render_deck(make_case()).text.splitlines() if line[:1] != "#")
    assert render_deck(make_case(contact={"rolling_friction": 0.003})).text.count("rolling_friction cdt") == 1


@pytest.mark.parametrize("name", shipped_cases())
def test_numbers_are_rendered_in_full_precision(name: str) -> None:
    case = load_case(name)
    deck = render_deck(case).text
    assert f"timestep        {case.run.time_step!r}\n" in deck
    scene, _ = place((case,))
    starts = [tuple(map(float, line[3:6])) for line in _lines(deck, "create_atoms")]
    assert starts == [bead.centre for bead in scene.beads]


CONTENT = {7: "df054a97f44f8810"}
"""Digest of all that the engine reads of some cases, for the version of the decks' content."""


def _reads(deck: Deck) -> str:
    """The commands and files of a deck; numbers to fewer digits than what other machines' arithmetic leaves alone."""
    commands = [line for line in deck.text.splitlines() if not line.startswith("#")]
    files = [f"{name} {text}" for name, text in deck.files.items()]  # a million numbers: one may be close to a half
    return f"{_rounded(commands, 9)} {_rounded(files, 6)}"


def _rounded(texts: list[str], digits: int) -> str:
    number = re.compile(r"[-+.\de]*\d[-+.\de]*")
    words = " ".join(texts).split()
    return " ".join(f"{float(word):.{digits}g}" if number.fullmatch(word) else word for word in words)


def test_a_change_of_what_decks_compute_asks_for_another_version() -> None:
    """Runs are named by the case and this version, so that a comment leaves them alone; a change of the rest must not.

    If this fails and the decks are meant to have changed: raise `CONTENT_VERSION`, write it and its digest down.
    """
    harmonics = [{"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": [1, 0, 1], "phase": "30 deg"}]
    several = document(contact={"rolling_friction": 0.01}, boundary={"tilt": "20 deg"})
    several["drive"] = {"harmonics": [*harmonics, {"frequency": "120 Hz", "peak_acceleration": "1 g"}]}
    thick = {"liquid": {"viscosity_ratio": 2.0}, "dimers": {"replicates": 3, "angle": "10 deg"}}
    decks = [render_deck(case) for case in (make_case(), make_case(**thick), resolve_case(several))]
    decks += [render_deck(make_case(**thick, drive={"frame": "lab", "axis": axis})) for axis in "xyz"]
    shared = [
        make_case(),
        make_case(contact={"restitution": 0.6}, run={"seed": 2}),
        make_case(**thick, drive={"peak_acceleration": "2 g", "axis": "y"}, boundary={"tilt": "20 deg"}),
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
    assert {CONTENT_VERSION: digest} == CONTENT


def test_a_mixture_is_placed_by_its_seed() -> None:
    pile = load_case("pile-ci")
    places = [[bead.centre for bead in place((replace(pile, seed=seed),))[0].beads] for seed in (1, 1, 2)]
    assert places[0] == places[1] != places[2]
