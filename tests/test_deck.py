"""The deck: readable and exact."""

import re
from hashlib import sha256

import pytest

from tests.conftest import document, make_case
from walkers.inputs.boundary import Boundary
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, shipped
from walkers.templates.deck import CONTENT_VERSION, Deck, Segment, render_deck, render_shared_deck, settling_steps
from walkers.templates.scene import place


def _lines(deck: str, start: str) -> list[list[str]]:
    return [line.split() for line in deck.splitlines() if line.startswith(start)]


def test_rolling_friction_is_left_out_where_there_is_none() -> None:
    assert "rolling" not in "\n".join(line for line in render_deck(make_case()).text.splitlines() if line[:1] != "#")
    assert render_deck(make_case(contact={"rolling_friction": 0.003})).text.count("rolling_friction cdt") == 1


@pytest.mark.parametrize("name", shipped("case"))
def test_numbers_are_rendered_in_full_precision(name: str) -> None:
    case = load_case(name)
    deck = render_deck(case).text
    given = dict(re.findall(r"^variable +(\w+) string (\S+)", deck, re.MULTILINE))
    assert "timestep        ${time_step}\n" in deck
    assert 1.0 / (float(given["frequency"]) * int(given["steps_per_cycle"])) == case.run.time_step
    assert float(given["friction_bead_wall"]) == case.contact.friction.bead_wall
    scene, _ = place((case,))
    starts = [tuple(map(float, line[3:6])) for line in _lines(deck, "create_atoms")]
    assert starts == [bead.centre for bead in scene.beads]


CONTENT = {8: "29bebb5b15f61619"}
"""Digest of all that the engine reads of some cases, for the version of the decks' content."""


def _reads(deck: Deck) -> str:
    """The commands and files of a deck; numbers to fewer digits than what other machines' arithmetic leaves alone."""
    commands = [line.partition("#")[0] for line in deck.text.splitlines()]
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
    decks = [render_deck(case) for case in (make_case(), make_case(**thick), Case.read(several))]
    decks += [render_deck(make_case(**thick, drive={"frame": "lab", "axis": axis})) for axis in "xyz"]
    shared = [
        make_case(),
        make_case(contact={"restitution": 0.6}, run={"seed": 2}),
        make_case(**thick, drive={"peak_acceleration": "2 g", "axis": "y"}, boundary={"tilt": "20 deg"}),
    ]
    decks += [render_shared_deck(shared[:2]), render_shared_deck(shared)]
    piles = [load_case("pile-ci"), load_case("cluster")]
    square = piles[0].boundary
    round_one = Boundary(shape="cylinder", material=square.material, width=square.width, height=square.height)
    piles += [piles[0].put("run.ranks", 2), piles[0].but(boundary=round_one)]
    for case in piles:
        settled = settling_steps(case)
        end = settled + case.run.cycles_per_segment * case.run.steps_per_cycle
        decks += [render_deck(case, Segment(0, settled, None)), render_deck(case, Segment(settled, end, settled))]
    digest = sha256("\n".join(map(_reads, decks)).encode()).hexdigest()[:16]
    assert {CONTENT_VERSION: digest} == CONTENT


def test_a_mixture_is_placed_by_its_seed() -> None:
    pile = load_case("pile-ci")
    places = [[bead.centre for bead in place((pile.put("run.seed", seed),))[0].beads] for seed in (1, 1, 2)]
    assert places[0] == places[1] != places[2]


def test_bridges_may_push_loose_beads() -> None:
    pile, less = (load_case("pile-ci", {"liquid.contact_angle": f"{angle} deg"}) for angle in (90, 84))
    assert pile.liquid.contact_angle == pytest.approx(1.5707963)
    assert render_deck(pile).fastest > render_deck(less).fastest


def test_a_liquid_may_have_no_viscosity() -> None:
    assert make_case(run={"time_step": "20 us", "allow_unstable": True}).run.time_step > 19e-6
    tables = render_deck(make_case(liquid={"viscosity_ratio": 0})).files["bridges.txt"].splitlines()
    resistances = [[float(number) for number in line.split()[2:]] for line in tables if line[0] in "0123456789"]
    assert len(resistances) > 100
    assert not any(map(any, resistances))
