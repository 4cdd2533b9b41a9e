"""Decks: exact, and of one version as long as they compute the same; tables of bridges; the law that a run records."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from hashlib import sha256
from math import inf
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import brief_pile, call, document, make_case, to_toml
from tests.test_physics import OWN
from walkers import run as run_case
from walkers.inputs.bridge_laws import by_name
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.boundary import Boundary
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import LAWS
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import run_place
from walkers.templates.bridge_tables import TOLERANCE, RecordedLaw, tabulated
from walkers.templates.deck import (
    BEADS_NAME,
    CONTENT_VERSION,
    Deck,
    Segment,
    _beads_data,
    compose,
    plan_of,
    processor_grid,
    render_deck,
    settling_steps,
)
from walkers.templates.placement import Bead, PlacedBodies, place


@pytest.mark.parametrize("name", shipped("case"))
def test_numbers_are_rendered_in_full_precision(name: str) -> None:
    case = load_case(name)
    deck = render_deck(case).text
    given = dict(re.findall(r"^variable +(\w+) string (\S+)", deck, re.MULTILINE))
    assert "timestep        ${time_step}\n" in deck
    assert 1.0 / (float(given["frequency"]) * int(given["steps_per_cycle"])) == case.run.time_step
    assert float(given["friction_bead_wall"]) == case.contact.friction.bead_wall
    beads = place((case,))[0].beads
    assert _centres(render_deck(case)) == [bead.centre for bead in beads]
    rolls = "rolling_friction cdt" in deck
    assert rolls == (case.contact.rolling_friction > 0.0)


def _centres(deck: Deck) -> list[tuple[float, ...]]:
    """Centres of the beads as the engine reads them, from the commands or from the file of many beads."""
    if BEADS_NAME not in deck.files:
        lines = [line.split() for line in deck.text.splitlines() if line.startswith("create_atoms")]
        return [tuple(map(float, line[3:6])) for line in lines]
    atoms = deck.files[BEADS_NAME].partition("Atoms\n\n")[2].partition("\n\n")[0]
    return [tuple(map(float, line.split()[4:7])) for line in atoms.splitlines()]


def test_beads_from_a_file_are_those_that_commands_create(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine's dumps are the same bytes, of beads of two sizes that fall and are shaken."""
    dumps = []
    for most_created in (19, 20):
        monkeypatch.setattr("walkers.templates.deck.MOST_CREATED", most_created)
        case = brief_pile()
        assert (BEADS_NAME in render_deck(case).files) == (most_created == 19)
        place = run_case(case, tmp_path / str(most_created)).directory
        names = ("beads.bin", "bridges.pairs.txt", "bridges.walls.txt")
        dumps.append([path.read_bytes() for name in names for path in sorted(place.rglob(name))])
    assert dumps[0] == dumps[1]
    assert len(dumps[0]) >= 6


def test_beads_of_a_file_may_have_densities_of_their_own() -> None:
    """Id, type, diameter (m), density (kg/m³), centre (m); 4000 kg/m³ for beads without their own."""
    beads = (
        Bead(1, (0.0, 0.0, 1e-3), 1e-3),
        Bead(2, (0.0, 3e-3, 1e-3), 1e-3, surface=2, density=2500.0),
    )
    scene = PlacedBodies(beads, (), (-1.0, -1.0, 0.0), (1.0, 1.0, 1.0))
    atoms = _beads_data(scene, 4000.0, types=3).partition("Atoms\n\n")[2].splitlines()[:2]
    assert atoms == ["1 1 0.002 4000.0 0.0 0.0 0.001", "2 2 0.002 2500.0 0.0 0.003 0.001"]


def test_walkers_are_not_sorted_and_piles_are() -> None:
    assert "atom_modify     map array sort 0 0.0\n" in render_deck(load_case("fig1b")).text
    assert "atom_modify     map array\n" in render_deck(load_case("pile-ci")).text


@pytest.mark.parametrize(
    ("ranks", "width", "depth", "grid"),
    [
        (1, 1.0, 1.0, (1, 1)),
        (2, 1.0, 1.0, (2, 1)),
        (2, 1.0, 3.0, (1, 2)),
        (4, 1.0, 1.0, (2, 2)),
        (6, 6.0, 1.0, (6, 1)),
    ],
)
def test_ranks_form_a_grid_with_short_cuts(
    ranks: int, width: float, depth: float, grid: tuple[int, int]
) -> None:
    plan = plan_of(load_case("pile-ci"))
    box = replace(plan.scene, lower=(0.0, 0.0, 0.0), upper=(width, depth, 9.0))
    assert processor_grid(replace(plan, scene=box, ranks=ranks)) == grid


UNITS = {
    "frequency": "Hz",
    "peak_acceleration": "m/s^2",
    "gravity": "m/s^2",
    "density": "kg/m^3",
    "youngs_modulus": "Pa",
    "viscosity": "Pa s",
    "amplitude": "m",
    "time_step": "s",
}
"""Units of the parameters of every deck of a walker."""


@pytest.mark.parametrize(
    ("drive", "more"),
    [
        ({}, {}),
        ({"phase": "30 deg"}, {"phase": "rad"}),
        ({"frame": "lab"}, {"peak_velocity": "m/s"}),
    ],
)
def test_parameters_of_a_deck_have_si_units(drive: dict[str, str], more: dict[str, str]) -> None:
    deck = render_deck(make_case(drive=drive)).text
    notes = dict(re.findall(r"^variable +(\w+) string .*? # (.*)$", deck, re.MULTILINE))
    expected = UNITS | more
    found = {name: note.partition(":")[0] for name, note in notes.items() if name in expected}
    assert found == expected


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_box_of_a_deck_has_room_for_beads_that_are_placed_far_from_the_origin(
    axis: int, sign: int
) -> None:
    place_of_bead = [0.0, 0.0, 0.5]
    place_of_bead[axis] = 30.0 * sign
    at = [f"{coordinate} mm" for coordinate in place_of_bead]
    tables = document(run={"duration": "0.1 s"}, placed=[{"radius": "0.5 mm", "at": at}])
    for key in ("cycles", "settling_cycles"):
        del tables["run"][key]
    scene, _ = place((build_case(tables, name="far"),))
    outer = [scene.lower, scene.upper][sign > 0][axis]
    other = [scene.lower, scene.upper][sign > 0][1 - axis]
    assert 30.5e-3 < sign * outer < 45e-3
    assert sign * other < 30e-3


def test_a_mixture_is_placed_by_its_seed() -> None:
    pile = load_case("pile-ci")
    places = [
        [bead.centre for bead in place((pile.with_value_at("run.seed", seed),))[0].beads]
        for seed in (1, 1, 2)
    ]
    assert places[0] == places[1] != places[2]


def test_bridges_may_push_loose_beads_and_have_no_viscosity() -> None:
    few = {
        "mixture.small": ["0.3 mm"] * 2,
        "mixture.large": ["0.545 mm"] * 2,
    }  # radii, and so tables
    pile, less = (
        load_case("pile-ci", {"liquid.contact_angle": f"{angle} deg", **few}) for angle in (90, 84)
    )
    assert render_deck(pile).fastest > render_deck(less).fastest
    tables = render_deck(make_case(liquid={"viscosity_ratio": 0})).files["bridges.txt"].splitlines()
    resistances = [
        [float(number) for number in line.split()[2:]] for line in tables if line[0] in "0123456789"
    ]
    assert len(resistances) > 100
    assert not any(map(any, resistances))


CONTENT = {10: "475ccccd48ea42bd"}
"""Digest of all that the engine reads of some cases, for the version of the decks' content."""


def _reads(deck: Deck) -> str:
    """The commands and files of a deck; numbers to fewer digits than what other machines' arithmetic leaves alone."""
    commands = _rounded("\n".join(line.partition("#")[0] for line in deck.text.splitlines()), 9)
    files = (
        f"{name} {_rounded(text, 6)}" for name, text in deck.files.items()
    )  # many: one may be close to a half
    return " ".join([commands, *files])


@cache
def _rounded(text: str, digits: int) -> str:
    number = re.compile(r"[-+.\de]*\d[-+.\de]*")
    return " ".join(
        f"{float(word):.{digits}g}" if number.fullmatch(word) else word for word in text.split()
    )


def test_a_change_of_what_decks_compute_asks_for_another_version() -> None:
    """Runs are named by the case and this version, so that a comment leaves them alone; a change of the rest must not.

    If this fails and the decks are meant to have changed: raise `CONTENT_VERSION`, write it and its digest down.
    """
    harmonics = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": [1, 0, 1], "phase": "30 deg"}
    ]
    several = document(contact={"rolling_friction": 0.01}, boundary={"tilt": "20 deg"})
    several["drive"] = {
        "harmonics": [*harmonics, {"frequency": "120 Hz", "peak_acceleration": "1 g"}]
    }
    thick = {"liquid": {"viscosity_ratio": 2.0}, "dimers": {"replicates": 3, "angle": "10 deg"}}
    decks = [render_deck(case) for case in (make_case(), make_case(**thick), build_case(several))]
    decks += [
        render_deck(make_case(**thick, drive={"frame": "lab", "axis": axis})) for axis in "xyz"
    ]
    shared = [
        make_case(),
        make_case(contact={"restitution": 0.6}, run={"seed": 2}),
        make_case(
            **thick, drive={"peak_acceleration": "2 g", "axis": "y"}, boundary={"tilt": "20 deg"}
        ),
    ]
    decks += [compose(plan_of(*shared[:2])), compose(plan_of(*shared))]
    piles = [load_case("pile-ci"), load_case("cluster")]
    square = piles[0].boundary
    round_one = Boundary(
        shape="cylinder", material=square.material, width=square.width, height=square.height
    )
    piles += [piles[0].with_value_at("run.ranks", 2), piles[0].with_values(boundary=round_one)]
    for case in piles:
        settled = settling_steps(case)
        end = settled + case.run.cycles_per_segment * case.run.steps_per_cycle
        decks += [
            render_deck(case, Segment(0, settled, None)),
            render_deck(case, Segment(settled, end, settled)),
        ]
    digest = sha256("\n".join(map(_reads, decks)).encode()).hexdigest()[:16]
    assert {CONTENT_VERSION: digest} == CONTENT


@pytest.mark.parametrize("other", [inf, 2e-4], ids=["wall", "beads"])
@pytest.mark.parametrize("name", LAWS)
def test_the_engine_reads_the_law_out_of_its_table(name: str, other: float) -> None:
    case, law = make_case(liquid={"contact_angle": "20 deg"}), by_name(name)
    given = Surfaces.between(3e-4, other, case.liquid.of_bridges, case.contact.roughness)
    table = tabulated(law, given)
    gaps = table.curve.rupture * np.random.default_rng(1).random(200) ** 3
    expected = law(given).forces(gaps).columns()
    scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max(axis=0))
    read = RecordedLaw(
        f"\nbridge 1 1 {given.radius!r} {given.other_radius!r}\n{table.text()}", None
    )(given)
    np.testing.assert_array_less(
        np.abs(read.forces(gaps).columns() - expected), 20 * TOLERANCE * scale + 1e-30
    )


@pytest.mark.parametrize("shared", [False, True])
def test_a_run_shows_and_exports_the_law_that_it_recorded(in_folder: Path, shared: bool) -> None:
    """Whether its file is there, was edited or is gone; nothing of it is executed. With another law it is another."""
    (law := in_folder / "own.py").write_text(OWN)
    settings = {"liquid.law": "own.py:law", "run.cycles": 4}
    axes = {"liquid.surface_tension": ["20 mN/m", "30 mN/m"] if shared else ["20 mN/m"]}
    (in_folder / "two.toml").write_text(to_toml({"case": "fig1b", "set": settings, "axes": axes}))
    call("sweep", "two.toml", "-j", "1", check=True)
    run = next((in_folder / "runs").glob("fig1b-*"))
    case = next(load_sweep("two.toml").cases())
    assert run_place(case, find_engine(), Path("runs")).exists()
    expected = call("show", str(run), check=True)
    deck = call("export", str(run), "--to", "deck", "-o", "deck", check=True)
    assert "executes" not in expected.stderr + deck.stderr
    assert expected.stdout.count("40 µN") == 3
    tables = [
        re.findall(r"(?m)^\d.*", (folder / "bridges.txt").read_text())
        for folder in (Path("deck"), run)
    ]
    for one, other in zip(*tables, strict=True) if not shared else ():
        assert [*map(float, one.split())] == pytest.approx([*map(float, other.split())], rel=1e-5)
    law.write_text(OWN.replace("4e-5", "9e-5"))
    assert not run_place(case, find_engine(), Path("runs")).exists()
    for _ in range(2):
        again = call("show", str(run), check=True)
        assert (again.stdout, again.stderr) == (expected.stdout, "")
        law.unlink(missing_ok=True)
    assert (run / "law.py").read_text() == OWN
