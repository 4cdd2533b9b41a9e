"""Decks: what they tell the engine, the tables of bridge laws beside them, and their version."""

from __future__ import annotations

import re
import subprocess
from contextlib import chdir, nullcontext
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import brief_pile, call, document, make_case, to_toml
from tests.test_physics import OWN_LAW
from walkers import run as run_case
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.bridge_laws import by_name
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.ranks import processor_grid
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case
from walkers.physics.bridge import Surfaces, UnusableLawError
from walkers.physics.laws import LAWS
from walkers.runner.binary import find_engine
from walkers.runner.run_directory import run_place
from walkers.templates.bridge_tables import TOLERANCE, RecordedLaw, bridge_tables, tabulated
from walkers.templates.deck import (
    BEADS_NAME,
    CONTENT_VERSION,
    Deck,
    Segment,
    _beads_data,
    compose,
    plan_of,
    render_deck,
    settling_steps,
)
from walkers.templates.placement import Bead, PlacedBodies, place

pytestmark = pytest.mark.filterwarnings("ignore::walkers.inputs.bridge_laws.ExecutedLawWarning")


@cache
def shipped_deck(name: str) -> Deck:
    """The deck of a shipped case; rendering that of a pile takes seconds."""
    return render_deck(load_case(name))


def variables_of(deck: Deck) -> dict[str, str]:
    """The values of the string variables of a deck, by name."""
    return dict(re.findall(r"^variable +(\w+) string (\S+)", deck.text, re.MULTILINE))


def units_of(deck: Deck) -> dict[str, str]:
    """The units of the string variables of a deck: the first word of the comment behind each."""
    notes = re.findall(r"^variable +(\w+) string .*? # (.*)$", deck.text, re.MULTILINE)
    units = {}
    for name, note in notes:
        units[name] = note.partition(":")[0]
    return units


def centres_of(deck: Deck) -> list[tuple[float, ...]]:
    """Centres of the beads (m) as the engine reads them, from commands or from a file."""
    if BEADS_NAME in deck.files:
        lines = deck.files[BEADS_NAME].partition("Atoms\n\n")[2].partition("\n\n")[0].splitlines()
        first_column = 4
    else:
        lines = [line for line in deck.text.splitlines() if line.startswith("create_atoms")]
        first_column = 3
    centres = []
    for line in lines:
        coordinates = line.split()[first_column : first_column + 3]
        centres.append(tuple(map(float, coordinates)))
    return centres


def placed_centres(case: Case) -> list[tuple[float, ...]]:
    """Centres (m) at which the beads of a case are placed."""
    scene, _ = place((case,))
    return [bead.centre for bead in scene.beads]


def rows_of_tables(text: str) -> FloatArray:
    """The rows of all bridge tables of a deck: gap, pull and four resistances."""
    lines = re.findall(r"(?m)^\d.*", text)
    return np.array([line.split() for line in lines], dtype=float)


# --- parameters -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", shipped("case"))
def test_the_time_step_of_a_deck_has_full_precision(name: str) -> None:
    """The deck computes it as 1/(frequency · steps per cycle), which must give the same bits."""
    deck = shipped_deck(name)
    values = variables_of(deck)
    steps_per_second = float(values["frequency"]) * int(values["steps_per_cycle"])
    assert 1.0 / steps_per_second == load_case(name).run.time_step
    assert "timestep        ${time_step}\n" in deck.text


@pytest.mark.parametrize("name", shipped("case"))
def test_the_friction_of_a_deck_has_full_precision(name: str) -> None:
    friction = variables_of(shipped_deck(name))["friction_bead_wall"]
    assert float(friction) == load_case(name).contact.friction.bead_wall


@pytest.mark.parametrize("name", shipped("case"))
def test_a_deck_has_a_model_of_rolling_friction_only_if_the_case_has_a_coefficient(
    name: str,
) -> None:
    expected = load_case(name).contact.rolling_friction > 0.0
    assert ("rolling_friction cdt" in shipped_deck(name).text) == expected


@pytest.mark.parametrize(
    ("drive", "further_units"),
    [
        pytest.param({}, {}, id="usual"),
        pytest.param({"phase": "30 deg"}, {"phase": "rad"}, id="with a phase"),
        pytest.param({"frame": "lab"}, {"peak_velocity": "m/s"}, id="moving walls"),
    ],
)
def test_parameters_of_a_deck_have_si_units(
    drive: dict[str, str], further_units: dict[str, str]
) -> None:
    expected = {
        "frequency": "Hz",
        "peak_acceleration": "m/s^2",
        "gravity": "m/s^2",
        "density": "kg/m^3",
        "youngs_modulus": "Pa",
        "viscosity": "Pa s",
        "amplitude": "m",
        "time_step": "s",
        **further_units,
    }
    assert expected.items() <= units_of(render_deck(make_case(drive=drive))).items()


def test_atoms_of_walkers_are_not_sorted() -> None:
    assert "atom_modify     map array sort 0 0.0\n" in shipped_deck("fig1b").text


def test_atoms_of_piles_are_sorted() -> None:
    assert "atom_modify     map array\n" in shipped_deck("pile-ci").text


# --- beads, box and processes -----------------------------------------------------------------


@pytest.mark.parametrize("name", shipped("case"))
def test_beads_of_a_deck_are_exactly_where_they_are_placed(name: str) -> None:
    assert centres_of(shipped_deck(name)) == placed_centres(load_case(name))


def test_beads_from_a_file_move_as_those_that_commands_create(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The dumps of 20 beads of two sizes, which fall and are shaken, are the same bytes."""

    def dumps_of(most_created: int) -> list[bytes]:
        """The dumps if a deck creates at most so many beads by commands."""
        monkeypatch.setattr("walkers.templates.deck.MOST_CREATED", most_created)
        case = brief_pile()
        assert (BEADS_NAME in render_deck(case).files) == (most_created < 20)
        directory = run_case(case, tmp_path / str(most_created)).directory
        dumps = []
        for name in ("beads.bin", "bridges.pairs.txt", "bridges.walls.txt"):
            dumps += [path.read_bytes() for path in sorted(directory.rglob(name))]
        return dumps

    dumps_from_a_file = dumps_of(19)
    assert len(dumps_from_a_file) >= 6  # three files of two or more segments
    assert dumps_from_a_file == dumps_of(20)


def test_beads_of_a_file_may_have_densities_of_their_own() -> None:
    """Columns: id, type, diameter (m), density (kg/m³), centre (m)."""
    without_density = Bead(1, (0.0, 0.0, 1e-3), 1e-3)
    with_density = Bead(2, (0.0, 3e-3, 1e-3), 1e-3, surface=2, density=2500.0)
    scene = PlacedBodies(
        (without_density, with_density), (), lower=(-1.0, -1.0, 0.0), upper=(1.0, 1.0, 1.0)
    )
    atoms = _beads_data(scene, 4000.0, types=3).partition("Atoms\n\n")[2].splitlines()
    assert atoms[0] == "1 1 0.002 4000.0 0.0 0.0 0.001"
    assert atoms[1] == "2 2 0.002 2500.0 0.0 0.003 0.001"


def test_a_mixture_is_placed_by_its_seed() -> None:
    pile = load_case("pile-ci")
    first_seed = pile.with_value_at("run.seed", 1)
    second_seed = pile.with_value_at("run.seed", 2)
    assert placed_centres(first_seed) == placed_centres(first_seed)
    assert placed_centres(first_seed) != placed_centres(second_seed)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", [0, 1], ids=["x", "y"])
def test_the_box_of_a_deck_has_room_for_beads_that_are_placed_far_from_the_origin(
    axis: int, sign: int
) -> None:
    """A bead of radius 0.5 mm is 30 mm from the origin.

    The box ends beyond 30.5 mm on that side, and is as small as ever in the other direction.
    """
    centre = [0.0, 0.0, 0.5]
    centre[axis] = 30.0 * sign
    bead = {"radius": "0.5 mm", "at": [f"{coordinate} mm" for coordinate in centre]}
    tables = document(run={"duration": "0.1 s"}, placed=[bead])
    del tables["run"]["cycles"]
    del tables["run"]["settling_cycles"]
    scene, _ = place((build_case(tables, name="far"),))
    end = scene.upper if sign > 0 else scene.lower
    assert 30.5e-3 < sign * end[axis] < 45e-3
    assert sign * end[1 - axis] < 30e-3


@pytest.mark.parametrize(
    ("ranks", "width", "depth", "grid"),
    [
        pytest.param(1, 1.0, 1.0, (1, 1), id="one rank"),
        pytest.param(2, 1.0, 1.0, (2, 1), id="two ranks in a square"),
        pytest.param(2, 1.0, 3.0, (1, 2), id="two ranks in a deep box"),
        pytest.param(4, 1.0, 1.0, (2, 2), id="four ranks in a square"),
        pytest.param(6, 6.0, 1.0, (6, 1), id="six ranks in a wide box"),
    ],
)
def test_ranks_form_a_grid_with_short_cuts(
    ranks: int, width: float, depth: float, grid: tuple[int, int]
) -> None:
    assert processor_grid(ranks, width, depth) == grid


def test_a_deck_of_several_ranks_has_their_grid() -> None:
    plan = plan_of(load_case("pile-ci", {"run.ranks": 2}))
    deep = replace(plan.scene, lower=(0.0, 0.0, 0.0), upper=(0.01, 0.03, 0.09))
    assert re.search(r"(?m)^processors +1 2 1$", compose(replace(plan, scene=deep)).text)


@pytest.mark.parametrize(("ranks", "fits"), [(4, True), (8, False), (16, False)])
def test_ranks_whose_parts_are_narrower_than_the_search_for_neighbours_are_refused(
    ranks: int, fits: bool
) -> None:
    """The box of pile-ci is 4.4 mm wide: 2.2 mm for 2 by 2 ranks, 1.1 mm for 4 by 2 and 4 by 4."""
    message = r"run\.ranks = \d+: expected fewer: .* 1\.1 mm wide, .* searched within 1\.4 mm"
    with nullcontext() if fits else pytest.raises(InputError, match=message):
        load_case("pile-ci", {"run.ranks": ranks})


# --- bridges ----------------------------------------------------------------------------------


def test_bridges_that_push_let_loose_beads_move_faster() -> None:
    """At a contact angle of 90° bridges push beads apart, at 84° they do not.

    The deck expects the speeds that follow, for the distance at which it lists neighbours.
    """

    def fastest(contact_angle: str) -> float:
        few_radii = {"mixture.small": ["0.3 mm"] * 2, "mixture.large": ["0.545 mm"] * 2}
        changes = {"liquid.contact_angle": contact_angle, **few_radii}
        return render_deck(load_case("pile-ci", changes)).fastest

    assert fastest("90 deg") > fastest("84 deg")


def test_bridges_without_viscosity_have_no_resistances() -> None:
    deck = render_deck(make_case(liquid={"viscosity_ratio": 0}))
    resistances = rows_of_tables(deck.files["bridges.txt"])[:, 2:]
    assert len(resistances) > 100
    assert not resistances.any()


@pytest.mark.parametrize("other_radius", [inf, 2e-4], ids=["wall", "beads"])
@pytest.mark.parametrize("name", LAWS)
def test_the_engine_reads_the_law_out_of_its_table(name: str, other_radius: float) -> None:
    """At 200 random gaps, more of them near contact: within 20 tolerances of what is larger.

    Forces that are small beside their largest value have an error relative to a thousandth of it.
    """
    law = by_name(name)
    case = make_case(liquid={"contact_angle": "20 deg"})
    surfaces = Surfaces.between(3e-4, other_radius, case.liquid.of_bridges, case.contact.roughness)
    table = tabulated(law, surfaces)
    gaps = table.curve.rupture * np.random.default_rng(1).random(200) ** 3
    expected = law(surfaces).forces(gaps).columns()

    header = f"bridge 1 1 {surfaces.radius!r} {surfaces.other_radius!r}"
    recorded_law = RecordedLaw(f"\n{header}\n{table.text()}", None)
    forces = recorded_law(surfaces).forces(gaps).columns()

    scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max(axis=0))
    error = np.abs(forces - expected)
    np.testing.assert_array_less(error, 20.0 * TOLERANCE * scale + 1e-30)


@pytest.mark.parametrize("other_radius", [inf, 2e-4], ids=["wall", "beads"])
def test_a_recorded_law_has_the_forces_of_each_volume(other_radius: float) -> None:
    """Where liquid is conserved, the tables of two surfaces differ in their volume alone."""
    case = brief_pile().with_value_at("liquid.conserved", True)
    liquid = case.liquid.of_bridges
    sizes = {(1, 2e-4), (1, 3e-4)}
    recorded_law = RecordedLaw(bridge_tables([(case.contact, liquid)], sizes), None)
    surfaces = Surfaces.between(3e-4, other_radius, liquid, case.contact.roughness)
    assert len(surfaces.volumes) > 1
    for with_volume in surfaces.volumes:
        expected = case.law(with_volume)
        curve = recorded_law(with_volume)
        assert curve.rupture == expected.rupture
        gap = np.array([0.5 * curve.rupture])
        pull = expected.forces(gap).pull
        np.testing.assert_allclose(curve.forces(gap).pull, pull, rtol=1e-3)


def test_a_recorded_law_gives_the_tables_that_were_recorded() -> None:
    """Within the tolerance of tables of conserved liquid, and in the same order."""
    case = brief_pile().with_value_at("liquid.conserved", True)
    surfaces = [(case.contact, case.liquid.of_bridges)]
    sizes = {(1, 3e-4)}
    recorded_text = bridge_tables(surfaces, sizes)
    again = bridge_tables(surfaces, sizes, RecordedLaw(recorded_text, None))
    heads = re.compile("(?m)^(?:bridge|liquid|range) .*")
    assert heads.findall(again) == heads.findall(recorded_text)
    assert rows_of_tables(again) == pytest.approx(rows_of_tables(recorded_text), rel=1e-3)


def test_a_recorded_law_refuses_a_volume_that_the_run_did_not_have() -> None:
    case = brief_pile().with_value_at("liquid.conserved", True)
    liquid = case.liquid.of_bridges
    recorded_law = RecordedLaw(bridge_tables([(case.contact, liquid)], {(1, 3e-4)}), None)
    surfaces = Surfaces.between(3e-4, inf, liquid, case.contact.roughness)
    with pytest.raises(UnusableLawError, match="none of this volume"):
        recorded_law(replace(surfaces, volume=1.1 * surfaces.volume))


# --- a law of the user's, as a run records it -------------------------------------------------


@dataclass(frozen=True)
class RecordedRun:
    """A run with a law of the user's, and what the program says of it.

    Attributes
    ----------
    run
        The directory of the run, which the program has exported as a deck.
    deck
        The folder of that deck.
    exported
        The command that exported it.
    shown
        What ``walkers show`` prints of the run, by the state of the user's file.
    exists
        Whether the case of the user's file has a run, by the state of that file.
    """

    run: Path
    deck: Path
    exported: subprocess.CompletedProcess[str]
    shown: dict[str, subprocess.CompletedProcess[str]]
    exists: dict[str, bool]


@pytest.fixture(scope="module", params=[1, 2], ids=["deck of one case", "deck of two cases"])
def recorded_run(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> RecordedRun:
    """The first run of a sweep with `OWN_LAW`.

    Cases that differ in surface tension alone share a deck.
    """
    folder = tmp_path_factory.mktemp("law")
    sweep = {
        "case": "fig1b",
        "set": {"liquid.law": "own.py:law", "run.cycles": 4},
        "axes": {"liquid.surface_tension": ["20 mN/m", "30 mN/m"][: request.param]},
    }
    (folder / "tensions.toml").write_text(to_toml(sweep))
    law = folder / "own.py"
    law.write_text(OWN_LAW)

    with chdir(folder):
        call("sweep", "tensions.toml", "-j", "1", check=True)
        run = next((folder / "runs").glob("fig1b-*"))
        shown = {"as it was": call("show", str(run), check=True)}
        exported = call("export", str(run), "--format", "deck", "-o", "deck", check=True)
        exists = {"as it was": first_case_has_a_run()}
        law.write_text(OWN_LAW.replace("4e-5", "9e-5"))
        shown["edited"] = call("show", str(run), check=True)
        exists["edited"] = first_case_has_a_run()
        law.unlink()
        shown["gone"] = call("show", str(run), check=True)
    return RecordedRun(run, folder / "deck", exported, shown, exists)


def first_case_has_a_run() -> bool:
    """Whether the first point of ``tensions.toml`` has a run in ``runs``."""
    case = next(load_sweep("tensions.toml").cases())
    return run_place(case, find_engine(), Path("runs")).exists()


def test_a_run_keeps_the_file_of_its_law(recorded_run: RecordedRun) -> None:
    assert (recorded_run.run / "law.py").read_text() == OWN_LAW


def test_a_run_shows_the_pull_of_its_law(recorded_run: RecordedRun) -> None:
    """`OWN_LAW` pulls with 40 µN: each of the two beads at the wall, and the two together."""
    assert recorded_run.shown["as it was"].stdout.count("40 µN") == 3


@pytest.mark.parametrize("state", ["as it was", "edited", "gone"])
def test_a_run_shows_its_law_without_executing_the_users_file(
    recorded_run: RecordedRun, state: str
) -> None:
    """A warning on standard error would say that the file is executed."""
    shown = recorded_run.shown[state]
    assert shown.stderr == ""
    assert shown.stdout == recorded_run.shown["as it was"].stdout


def test_a_run_exports_its_law_without_executing_the_users_file(recorded_run: RecordedRun) -> None:
    assert "executes" not in recorded_run.exported.stderr


@pytest.mark.parametrize("recorded_run", [1], indirect=True, ids=["deck of one case"])
def test_an_exported_deck_has_the_tables_that_the_run_recorded(recorded_run: RecordedRun) -> None:
    """Those that are exported are made anew, of values that are interpolated in those recorded."""
    exported_text = (recorded_run.deck / "bridges.txt").read_text("utf-8")
    recorded_text = (recorded_run.run / "bridges.txt").read_text("utf-8")
    np.testing.assert_allclose(
        rows_of_tables(exported_text), rows_of_tables(recorded_text), rtol=1e-5
    )


def test_a_case_with_an_edited_law_has_another_run(recorded_run: RecordedRun) -> None:
    assert recorded_run.exists == {"as it was": True, "edited": False}


# --- the version of decks ---------------------------------------------------------------------

CONTENT = {10: "475ccccd48ea42bd"}
"""Digest of all that the engine reads of some cases, for the version of the decks' content."""


THREE_IN_A_THICK_LIQUID: dict[str, Any] = {
    "liquid": {"viscosity_ratio": 2.0},
    "dimers": {"replicates": 3, "angle": "10 deg"},
}
"""Changes of the reference case."""


def content_of(deck: Deck) -> str:
    """The commands and files of a deck.

    Numbers have fewer digits than those in which machines differ. A table has many numbers, of
    which one may be close to the border between two digits, so they have fewer than commands.
    """
    commands_without_comments = re.sub("#.*", "", deck.text)
    contents = [rounded_numbers(commands_without_comments, 9)]
    for name, text in deck.files.items():
        contents.append(f"{name} {rounded_numbers(text, 6)}")
    return " ".join(contents)


@cache
def rounded_numbers(text: str, digits: int) -> str:
    """A text with its numbers rounded to some digits, and its words one blank apart."""
    number = re.compile(r"[-+.\de]*\d[-+.\de]*")
    words = []
    for word in text.split():
        if number.fullmatch(word):
            words.append(f"{float(word):.{digits}g}")
        else:
            words.append(word)
    return " ".join(words)


def decks_of_walkers() -> list[Deck]:
    """Decks of one case: one walker, several walkers, two harmonics, the laboratory's frame."""
    two_harmonics = document(contact={"rolling_friction": 0.01}, boundary={"tilt": "20 deg"})
    two_harmonics["drive"] = {
        "harmonics": [
            {
                "frequency": "80 Hz",
                "peak_acceleration": "4 g",
                "axis": [1, 0, 1],
                "phase": "30 deg",
            },
            {"frequency": "120 Hz", "peak_acceleration": "1 g"},
        ]
    }
    cases = [make_case(), make_case(**THREE_IN_A_THICK_LIQUID), build_case(two_harmonics)]
    for axis in ("x", "y", "z"):
        drive = {"frame": "lab", "axis": axis}
        cases.append(make_case(**THREE_IN_A_THICK_LIQUID, drive=drive))
    return [render_deck(case) for case in cases]


def decks_of_several_cases() -> list[Deck]:
    """A deck of two cases with other contacts, and of a third with another drive and liquid."""
    usual = make_case()
    elastic = make_case(contact={"restitution": 0.6}, run={"seed": 2})
    across = make_case(
        **THREE_IN_A_THICK_LIQUID,
        drive={"peak_acceleration": "2 g", "axis": "y"},
        boundary={"tilt": "20 deg"},
    )
    return [compose(plan_of(usual, elastic)), compose(plan_of(usual, elastic, across))]


def decks_of_piles() -> list[Deck]:
    """Decks of two segments each: settling, and the first that is driven."""
    pile = load_case("pile-ci")
    square = pile.boundary
    cylinder = Boundary(
        shape="cylinder", material=square.material, width=square.width, height=square.height
    )
    decks = []
    for case in (
        pile,
        load_case("cluster"),
        pile.with_value_at("run.ranks", 2),
        pile.with_values(boundary=cylinder),
    ):
        settled = settling_steps(case)
        end = settled + case.run.cycles_per_segment * case.run.steps_per_cycle
        decks.append(render_deck(case, Segment(0, settled, None)))
        decks.append(render_deck(case, Segment(settled, end, settled)))
    return decks


def test_a_change_of_what_decks_compute_asks_for_another_version() -> None:
    """Runs are named by the case and `CONTENT_VERSION`.

    A change of a comment in a deck must leave that version alone, any other change must raise it.
    If this fails and the decks are meant to have changed: raise it, and write it and the digest
    down in `CONTENT`.
    """
    decks = decks_of_walkers() + decks_of_several_cases() + decks_of_piles()
    contents = "\n".join(map(content_of, decks))
    digest = sha256(contents.encode()).hexdigest()[:16]
    assert {CONTENT_VERSION: digest} == CONTENT
