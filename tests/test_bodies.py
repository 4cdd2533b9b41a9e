"""Bodies on boundaries under drives: clusters, trays, channels, slopes, several harmonics, by the real engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from math import cos, dist, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import REFERENCE, document, make_case
from walkers.errors import InputError
from walkers.inputs.boundary import Boundary
from walkers.inputs.case import Case
from walkers.inputs.drive import Excitation, Harmonic, common_frequency
from walkers.inputs.loads import contact_loads
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.standing import standing
from walkers.inputs.toml import read_toml
from walkers.postprocess.figures import figures_of
from walkers.postprocess.gait import postures, turned_over_at
from walkers.postprocess.meetings import collective
from walkers.postprocess.motion import read_motion
from walkers.postprocess.results import read
from walkers.postprocess.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.directory import finished_places, run_place
from walkers.show import summarise
from walkers.sweeps.comparison import Side, compare_runs
from walkers.sweeps.folder import as_text, inventory
from walkers.sweeps.making import make_runs
from walkers.templates.deck import render_deck
from walkers.templates.scene import place
from walkers.theory.prediction import motion_of, predict

MM_PER_S = 1e-3
FIG1B: dict[str, Any] = {
    "beads": {"material": "ruby"},
    "liquid": {"name": "Si AK5"},
    "boundary": {"material": "chromium-coated glass"},
    "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
}
SIZES = {"L": "0.3 mm", "s": "0.2 mm"}
# A dimer's speed is that of 40 cycles, 20 of them to settle, to a thousandth.
BRIEF = {"cycles": 20, "settling_cycles": 12}
DRIVEN = {"cycles": 20, "settling_cycles": 8, "samples_per_cycle": 10}
FIG1B_SPEED = 1.079 * MM_PER_S
"""The shipped walker's, as measured; half and twice the time step give the same within 0.2 %."""
# A dimer in a box, a bead beside it, and a handful poured on them.
EVERYTHING: dict[str, Any] = {
    "dimers": {"radii": ["0.5 mm", "0.3 mm"], "replicates": 1},
    "placed": [{"radius": "0.4 mm", "at": ["1.9 mm", "1.9 mm", "0.4 mm"]}],
    "mixture": {"small": ["0.3 mm", "0.315 mm"], "large": ["0.5 mm", "0.59 mm"], "count": 20},
    "beads": {"material": "glass"},
    "liquid": {"name": "glycerol 87 %"},
    "boundary": {"shape": "box", "width": "5.3 mm", "height": "20 mm", "material": "polystyrene"},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.0},
    "drive": {"frequency": "170 Hz", "peak_acceleration": "16.2 g"},
    "run": {"duration": "0.03 s", "segment": "0.02 s"},
}


def cluster(arrangement: str, sizes: str, **start: Any) -> dict[str, Any]:
    """A table of ``[[clusters]]``: large (L) and small (s) beads in an arrangement."""
    return {"arrangement": arrangement, "radii": [SIZES[size] for size in sizes], "replicates": 2, **start}


def dimers(replicates: int, **start: Any) -> dict[str, Any]:
    """The table of ``[dimers]``."""
    return {"radii": ["0.3 mm", "0.2 mm"], "replicates": replicates, **start}


def of_tables(*clusters: dict[str, Any], **tables: Any) -> Case:
    """The conditions of Fig. 1b with other tables."""
    return Case.read({**FIG1B, "clusters": list(clusters), **tables}, name="cluster")


def numbers_of(case: Case) -> tuple[str, ...]:
    """What the engine is given of a case."""
    deck = render_deck(case)
    return deck.text, *deck.files.values()


def fig1b(**changes: Any) -> Case:
    """The shipped walker of Fig. 1b, one of it, briefly."""
    once = {"replicates": 1, "facing": "right", "angle_spread": "0 deg", "gap_spread": 0.0}
    start = {f"dimers.{key}": value for key, value in once.items()}
    return load_case("fig1b", {**start, "run.cycles": 20, "run.settling_cycles": 8, **changes})


@pytest.mark.parametrize(
    ("arrangement", "sizes"),
    [
        ("chain", "Lss"),
        ("fan", "Lss"),
        ("fan", "Lsss"),
        ("ring", "Lsss"),
        ("diamond", "Lsss"),
        ("diamond", "LsLs"),
        ("raft", "sssssss"),
    ],
)
def test_beads_of_a_cluster_touch_as_its_arrangement_says(arrangement: str, sizes: str) -> None:
    """Touching pairs overlap by what carries their load, the beads the floor too, and no others overlap."""
    case = of_tables(cluster(arrangement, sizes, gap_spread=0.0))
    make, loads = case.walkers[0], contact_loads(case, case.walkers[0])
    scene, (first, _) = place((case,))
    beads = [next(bead for bead in scene.beads if bead.id == number) for number in first.beads]
    assert [bead.radius - bead.centre[2] for bead in beads] == pytest.approx(
        [load.overlap for load in loads[: len(sizes)]], rel=1e-6
    )
    extents = []
    for one, other in combinations(range(len(sizes)), 2):
        between, both = np.subtract(beads[one].centre, beads[other].centre), beads[one].radius + beads[other].radius
        overlap = both - np.linalg.norm(between)
        if (one, other) in make.pairs:
            expected = loads[len(sizes) + make.pairs.index((one, other))].overlap
            assert overlap == pytest.approx(expected, rel=1e-4)
        else:
            assert overlap < 0.0
        extents.append(np.hypot(*between[:2]) + both)
    assert make.length == pytest.approx(max(extents), rel=2e-3)


def test_pairs_of_beads_are_numbered_along_the_arrangement() -> None:
    """Columns of results are numbered by them. The last pair closes a ring; none closes a fan all around."""
    ring, fan = (
        of_tables(cluster(name, sizes)).walkers[0].pairs for name, sizes in (("ring", "ssss"), ("fan", "s" * 7))
    )
    assert ring == ((0, 1), (1, 2), (2, 3), (0, 3))
    assert fan == (*((0, bead) for bead in range(1, 7)), *((bead, bead + 1) for bead in range(1, 6)))


def test_a_cluster_heads_to_its_large_bead_or_where_its_first_one_is() -> None:
    """Of s-L-s the centroids coincide, and alike beads have no large ones: then the design gives the heading."""
    expected = {"Lss": (1.0, -0.5, -0.5), "sLs": (1.0, 0.0, -1.0), "sss": (1.0, 0.0, -1.0)}
    for sizes, heading in expected.items():
        walker = of_tables(cluster("chain", sizes)).walkers[0]
        assert walker.toward_large == pytest.approx(heading, abs=1e-12)


def test_a_chain_of_two_is_a_dimer() -> None:
    tables = {key: value for key, value in REFERENCE.items() if key != "dimers"}
    start = {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0}
    chain = Case.read({**tables, "clusters": [cluster("chain", "Ls", **start)]}, name="test")
    assert numbers_of(chain) == numbers_of(make_case())
    cases = [of_tables(cluster(arrangement, "Ls")) for arrangement in ("fan", "chain")]
    np.testing.assert_allclose(*([bead.centre for bead in place((case,))[0].beads] for case in cases), atol=1e-15)


@pytest.mark.parametrize(
    ("body", "written"),
    [
        ("dimers", {"radii": None, "diameters": ["1 mm", "0.6 mm"]}),
        ("mixture", {"small": None, "small_diameters": ["0.6 mm", "0.63 mm"]}),
        ("mixture", {"large": None, "large_diameters": ["1 mm", "1.18 mm"]}),
        ("placed", {"radius": None, "diameter": "0.8 mm"}),
        ("clusters", {"radii": None, "diameters": ["0.6 mm", "0.4 mm", "0.4 mm"]}),
    ],
)
def test_diameters_are_twice_the_radii(body: str, written: dict[str, Any]) -> None:
    """The same deck, and the same run."""
    bodies = {"clusters": [{"arrangement": "fan", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"], "replicates": 1}]}
    tables = EVERYTHING if body != "clusters" else {**FIG1B, **bodies}
    given = tables[body]
    said = {**(given[0] if isinstance(given, list) else given), **written}
    said = {key: value for key, value in said.items() if value is not None}
    by_radii, by_diameters = Case.read(tables), Case.read({**tables, body: [said] if isinstance(given, list) else said})
    assert numbers_of(by_diameters) == numbers_of(by_radii)
    assert by_diameters.determinants() == by_radii.determinants()


def test_a_raft_holds_together_and_stays(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    """Seven equal beads, each in the ring joined to three: none is large, and the drive has no direction."""
    run = {"cycles": 12, "settling_cycles": 6, "samples_per_cycle": 10}
    case = of_tables(cluster("raft", "sssssss"), drive={**FIG1B["drive"], "peak_acceleration": "10 g"}, run=run)
    assert [len(neighbours) for _, neighbours in case.walkers[0].bridged] == [6, *[3] * 6]
    result = read(run_directory(case))
    assert result["separated_fraction"] == 0.0
    assert result["work"] > 1e-9
    assert abs(result["axial_velocity"]) < 1e-6


@pytest.mark.parametrize(("step", "beyond"), [("1 us", False), ("20 us", True)])
def test_results_know_a_time_step_beyond_its_limits(step: str, beyond: bool, tmp_path: Path) -> None:
    run = {"cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1, "time_step": step, "allow_unstable": True}
    warnings = walkers.run(make_case(run=run), tmp_path).result.warnings
    assert any("beyond a limit of stability (rayleigh)" in one for one in warnings) == beyond


def test_several_makes_of_walkers_stand_together(tmp_path: Path) -> None:
    """A dimer beside trimers walks as it does alone, and each make has its part of the result."""
    tables = cluster("fan", "Lss"), cluster("chain", "Lss", replicates=1)
    done = walkers.run(of_tables(*tables, dimers=dimers(2), run=BRIEF), tmp_path)
    result = done.result
    assert [result[f"walkers_make_{make}"] for make in (1, 2, 3)] == [2, 2, 1]
    assert result["velocity_make_1"] == pytest.approx(FIG1B_SPEED, rel=2e-3)
    assert done.walkers["make"].tolist() == [0, 0, 1, 1, 2]
    assert done.walkers["rotation_3"].isna().tolist() == [True, True, False, False, False]
    assert result["velocity_make_3"] == pytest.approx(done.walkers["velocity"].iloc[4])
    assert {path.name for path in done.plot()} == {"walk.png", "gait.png"}
    assert done.export("vtk").exists()
    # What is said of single beads is that of the dimers, and so is its scatter.
    side = Side("one", done.case, done.directory)
    compared = {one["quantity"]: one for one in compare_runs(side, side).contents["results"]}
    for name in ("rotation_1", "sliding_2"):
        assert result[name] == pytest.approx(done.walkers[name][:2].mean())
        assert compared[name]["first_scatter"] == pytest.approx(done.walkers[name][:2].std())
    # A column is of one kind of contact: of the third bead and the floor, or of two beads.
    assert {name for name in result if name.startswith("sliding")} == {"sliding_1", "sliding_2", "sliding_pair_1"}
    for family, table in (("sliding", done.walkers), ("open", done.walkers), ("gap", done.trajectory)):
        third, pair = (table[f"{family}_{name}"][table["walker"] < 2] for name in ("3", "pair_1"))
        assert third.isna().all()
        assert pair.notna().all()
    chain = walkers.run(of_tables(cluster("chain", "Lss", replicates=1), run=BRIEF), tmp_path)
    sliding = [name for name in chain.result if name.startswith("sliding")]
    assert sorted(sliding) == ["sliding_1", "sliding_2", "sliding_3", "sliding_pair_1", "sliding_pair_2"]
    assert [chain.result[name] for name in sliding] == [chain.walkers[name][0] for name in sliding]


@pytest.mark.parametrize("count", [2, 3, 4, 6, 9, 12, 16])
def test_neighbours_on_a_tray_face_opposite_ways(count: int) -> None:
    """Along the rows and across them; so they do in a square of odd rows by their numbers alone."""
    case = of_tables(dimers=dimers(count, meet=True))
    _, tray = place((case,))
    least = 1.1 * case.walkers[0].spacing
    near = [(one, other) for one, other in combinations(tray, 2) if dist(one.origin, other.origin) < least]
    assert len(near) >= count - 1
    assert all(one.facing == -other.facing for one, other in near)


def test_rows_of_a_tray_are_shifted_where_neighbours_would_face_the_same_way() -> None:
    """In even rows, unless walkers face any way, or are told one, or do not meet."""
    turned = {"angle_spread": "180 deg"}
    for count, start, shifted in [(16, {}, 4), (9, {}, 0), (16, turned, 0), (16, {"facing": "right"}, 0)]:
        assert of_tables(dimers=dimers(count, meet=True, **start)).shifted_rows == shifted
    assert of_tables(dimers=dimers(16)).shifted_rows == 0


def test_walkers_on_a_tray_of_even_rows_meet(tmp_path: Path) -> None:
    close = dimers(4, spacing="1.6 mm", meet=True)
    assert walkers.run(of_tables(dimers=close, run={"cycles": 60, "settling_cycles": 18}), tmp_path).result["merged"]


def test_walkers_on_a_tray_meet_and_stick(tmp_path: Path) -> None:
    """Heads that run into each other stick; the table of meetings and the bridges between walkers say the same."""
    close = dimers(9, spacing="1.6 mm", meet=True, angle_spread="20 deg")
    tray = walkers.run(of_tables(dimers=close, run={"cycles": 30, "settling_cycles": 18}), tmp_path)
    meetings, bridges = tray.table("meetings"), tray.table("bridges")
    merged = meetings[meetings["event"] == "merged"]
    assert tray.result["merged"] == len(merged) >= 2
    assert tray.result["largest_group"] >= 2
    between = bridges[bridges["other_walker"] >= 0]
    assert (between["contact"] == 0).all()
    for row in merged.itertuples():
        joined = between[(between["walker"] == row.walker) & (between["other_walker"] == row.other)]
        assert joined["time"].min() == pytest.approx(row.time)
    numbers = tray.result
    slow, connected = (round(9 * numbers[name]) for name in ("slow_share", "clustered_share"))
    for text in (as_text(inventory(tmp_path)), tray.describe().splitlines()[0]):
        assert f"{slow} of 9 slow, {connected} of 9 connected" in text
    assert not [warning for warning in numbers.warnings if "not steady" in warning]  # walkers that have met stop
    assert not numbers["facings_differ"]
    group = tray.motion.groups[0]
    centre = group.mass_centre[:: group.case.run.samples_per_cycle]
    speed = np.linalg.norm(np.diff(centre, axis=0), axis=-1) * group.case.excitation.frequency
    assert speed[5:].max() < 0.1 * group.case.excitation.peak_velocity
    parted = set(meetings[meetings["event"] == "parted"][["walker", "other"]].itertuples(index=False, name=None))
    pairs = merged[["walker", "other"]].itertuples(index=False, name=None)
    first = next(pair for pair in pairs if pair not in parted)
    apart = np.linalg.norm(centre[-12:, first[1]] - centre[-12:, first[0]], axis=-1)
    assert apart.max() < 1.1 * group.make.length  # they hold on to each other, however they turn
    assert {path.name for path in tray.plot()} >= {"walk.png", "paths.png"}
    short = {"size": (64, 64), "fps": 10, "end": 5e-3}
    films = [tray.film(tmp_path / "film.gif", walker=one, **short).read_bytes() for one in (3, 4)]
    assert films[0] != films[1]
    (axes,) = figures_of(tray.directory)["paths"].axes
    for walker, line in enumerate(axes.lines[:9]):  # in the plane, where they stood
        np.testing.assert_allclose(line.get_xydata(), 1e3 * centre[:, walker, :2])
    beads = tray.motion.position[-1, group.rows].reshape(-1, 3)
    np.testing.assert_allclose([bead.center for bead in axes.patches], 1e3 * beads[:, :2], atol=0.01)  # type: ignore[attr-defined]
    assert axes.get_aspect() == 1.0


def test_what_walkers_do_as_many_is_counted() -> None:
    """Two meet head on at 5 s and rest; two walk side by side at half the speed from 1 to 3 s, and part."""
    time = np.linspace(0.0, 10.0, 101)
    heading = np.array([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    size, held = np.ones((101, 4), dtype=np.int64), np.zeros((101, 4), dtype=bool)
    size[50:, :2] = size[10:31, 2:] = 2
    held[-1, 3] = True  # in the last frame it has come to a wall
    speed = np.ones((100, 4)) * MM_PER_S
    speed[50:, :2], speed[10:30, 2:] = 0.0, 0.5 * MM_PER_S
    way = np.concatenate([np.zeros((1, 4)), np.cumsum(0.1 * speed, axis=0)])
    headings = np.broadcast_to(heading, (101, 4, 2))
    found = collective(time, way[..., None] * heading, headings, size, held, 2, np.array([1.0, 0.0]))
    joined = 40 * 0.5 / 140  # of 140 intervals between frames in which one was joined, 40 at half the speed
    assert found == pytest.approx(
        {
            "meeting_rate": 2 * 2 / (4 * 10.0),
            "clustered_share": 0.5,
            "largest_cluster": 2,
            "held_share": 0.25,
            "nematic_order": (3 - 1) / 4,
            "polar_order": np.sqrt(2.0) / 4,
            "free_speed": MM_PER_S,
            "joined_speed": joined * MM_PER_S,
            "speed_ratio": joined,
            "slow_share": 0.5,
        }
    )


@pytest.mark.parametrize("width", ["1.4 mm", "0.5998 mm"])
def test_a_dimer_in_a_channel_is_held_by_the_walls_that_it_touches(width: str, tmp_path: Path) -> None:
    """In a wide one it walks as on a plane; in a narrow one both side walls hold its large bead, and it is slower."""
    boundary = {**FIG1B["boundary"], "shape": "channel", "width": width}
    done = walkers.run(of_tables(dimers=dimers(1, angle_spread="0 deg"), boundary=boundary, run=BRIEF), tmp_path)
    bridges, velocity = done.table("bridges"), done.result["velocity"]
    last = bridges[(bridges["time"] == bridges["time"].max()) & (bridges["bead_1"] == 0)]
    if width == "1.4 mm":
        assert velocity == pytest.approx(FIG1B_SPEED, rel=2e-3)
        assert set(bridges["wall"]) == {0, -1}
    else:
        assert sorted(last["wall"]) == [-1, 0, 1, 2]
        assert (last["normal_force"].abs() < 2e-3).all()
        assert abs(velocity) < 1.0 * MM_PER_S


def test_a_bead_rests_on_both_walls_of_a_groove() -> None:
    groove = make_case(boundary={"shape": "groove", "opening": "60 deg"}).boundary
    height = groove.rest_height(3e-4)
    assert height == pytest.approx(2.0 * 3e-4)
    assert [np.dot(wall.normal, (0.0, 0.0, height)) for wall in groove.walls] == pytest.approx([3e-4, 3e-4])


@pytest.mark.parametrize("shape", ["channel", "groove", "box", "octagon"])
def test_a_flat_wall_is_named_by_the_side_on_which_it_stands(shape: str) -> None:
    """The wall +x−y of an octagon is seen from the middle where x is positive and y negative."""
    sizes = {"opening": radians(60.0)} if shape == "groove" else {"width": 4e-3, "height": 4e-3}
    named = {wall.name: wall.normal for wall in Boundary(shape=shape, material="glass", **sizes).walls}
    assert len(named) == {"channel": 3, "groove": 2, "box": 5, "octagon": 9}[shape]
    for name in named.keys() - {"floor"}:
        outward = [("-", "", "+")[int(np.sign(-along)) + 1] for along in named[name][:2]]
        assert name == "".join(sign + axis for sign, axis in zip(outward, "xy", strict=True) if sign)


@pytest.mark.parametrize("first", ["x", "y"])
def test_walkers_face_along_the_first_of_equal_harmonics(first: str) -> None:
    axes = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    tones = [{"axis": axis, "frequency": "80 Hz", "peak_acceleration": "2 g"} for axis in dict.fromkeys((first, *axes))]
    case = Case.read({**document(), "drive": {"harmonics": tones}})
    assert case.drive_axis == axes[first]
    ((_, start),) = standing(case)
    large, small = start.beads
    assert np.sign(np.round([large.x - small.x, large.y - small.y], 9)).tolist() == list(axes[first][:2])


@pytest.mark.parametrize(
    ("boundary", "walls"),
    [
        ({"shape": "groove", "opening": "30 deg"}, 1.0 + np.sqrt(0.75)),
        ({"shape": "groove", "opening": "60 deg"}, 1.5),
        ({"shape": "groove", "opening": "90 deg"}, 1.0),
        ({"shape": "groove", "opening": "120 deg"}, 1.5),
        ({"shape": "channel", "width": "0.6 mm"}, 2.0),
        ({"shape": "channel", "width": "0.62 mm"}, 1.0),
    ],
)
def test_the_viscous_limit_counts_the_walls_that_a_bead_touches_at_once(boundary: dict[str, str], walls: float) -> None:
    """Two walls damp a bead by c (n n + m m), whose largest eigenvalue is c (1 + |n·m|)."""

    def rate(**changes: str) -> float:
        case = make_case(dimers={"radii": ["0.3 mm", "0.3 mm"]}, liquid={"name": "glycerol 87 %"}, boundary=changes)
        found = summarise(case)["time_step"]["limits"]["viscous"]
        assert case.run.time_step == pytest.approx(0.4 * found, rel=0.02)
        return float(2.0 / found)

    case = make_case(liquid={"name": "glycerol 87 %"})
    mass = 4.0 / 3.0 * np.pi * 3e-4**3 * case.beads.density
    of_a_wall = 6.0 * np.pi * case.liquid.of_bridges.viscosity * 3e-4 / case.contact.minimum_separation_ratio / mass
    assert (rate(**boundary) - rate()) / of_a_wall == pytest.approx(walls - 1.0, abs=1e-9)


def test_a_dimer_in_a_groove_rolls_on_both_walls(tmp_path: Path) -> None:
    """It touches both walls, as high as that needs, is held by both, rolls about its chord, v = R sin(60°) dφ/dt."""
    boundary = {**FIG1B["boundary"], "shape": "groove", "opening": "120 deg"}
    done = walkers.run(of_tables(dimers=dimers(2), boundary=boundary, run=BRIEF), tmp_path)
    height = np.sin(np.radians(60.0)) * done.motion.position[-1, :, 2] / done.motion.radius
    np.testing.assert_allclose(height, 1.0, atol=1e-3)
    bridges = done.table("bridges")
    held = bridges[(bridges["wall"] >= 0) & (bridges["time"] == bridges["time"].max())]
    assert held.groupby("bead_1")["wall"].apply(sorted).tolist() == [[0, 1]] * 4
    assert done.result["velocity"] == pytest.approx(0.818 * MM_PER_S, rel=0.01)
    rolling = np.sin(np.radians(60.0)) * done.result["rotation_1"]
    assert rolling == pytest.approx(done.result["velocity"], rel=0.04)
    assert done.export("vtk").exists()


@pytest.mark.parametrize("frequency", ["73 Hz", "74 Hz"])
def test_a_rest_before_the_drive_is_one(tmp_path: Path, frequency: str) -> None:
    """Whatever part of a cycle it takes: nothing moves meanwhile, the bridges drag as they do without it."""
    tables = {"dimers": dimers(1, angle_spread="0 deg"), "drive": {"frequency": frequency, "peak_acceleration": "4 g"}}
    speeds = []
    for rest in ("0 s", "0.06 s"):
        run = {"cycles": 16, "settling_cycles": 12, "longest_settling": rest}
        done = walkers.run(of_tables(**tables, run=run), tmp_path)
        speeds.append(done.result["velocity"])
    resting = done.motion.time < 0.0
    assert resting.any()
    assert done.trajectory["time"].min() == 0.0
    assert np.abs(done.motion.velocity[resting]).max() < 1e-4
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)


def test_a_mixture_is_poured_from_above_the_walkers() -> None:
    """Their large beads, 1 mm across, are higher than the placed one of 0.8 mm; all poured beads are above both."""
    case = Case.read(EVERYTHING, name="everything")
    kinds = {number: one.beads for number, one in standing(case)}
    tops = [max(bead.z + bead.radius for bead in beads) for beads in (kinds[0], kinds[2])]
    assert tops == pytest.approx([1e-3, 0.8e-3], rel=1e-3)
    assert min(bead.z - bead.radius for bead in kinds[1]) > 1e-3


def test_walkers_placed_beads_and_a_mixture_share_a_box(tmp_path: Path) -> None:
    """All analyses that mean something are in the result, and nobody starts within another."""
    case = Case.read(EVERYTHING, name="everything")
    assert Case.from_dict(case.as_dict()) == case
    assert case.all_radii[:2] == [5e-4, 3e-4]
    for one, other in combinations(place((case,))[0].beads, 2):
        if not {one.id, other.id} <= {1, 2}:  # the dimer's own beads touch
            assert np.linalg.norm(np.subtract(one.centre, other.centre)) > one.radius + other.radius
    done = walkers.run(case, tmp_path)
    assert {"velocity", "surface_end"} < set(done.result)
    assert (done.result["beads"], done.result["walkers"], len(done.motion.radius)) == (23, 1, 23)
    assert done.table("bed")["time"].max() >= 0.03


def test_a_bead_may_lie_on_a_plane_beside_walkers_or_alone(tmp_path: Path) -> None:
    """It rolls along the drive, held down; alone there is nothing to measure, but its motion and a picture."""
    bead = {"placed": [{"radius": "0.3 mm", "at": ["5 mm", "-3 mm", "0.29999 mm"]}]}
    run = {"cycles": 8, "settling_cycles": 4, "samples_per_cycle": 20, "longest_settling": "0 s"}
    for tables, walks in (({**bead, "dimers": dimers(1)}, True), (bead, False)):
        done = walkers.run(of_tables(**tables, run=run), tmp_path)
        assert ("velocity" in done.result) == walks
        assert done.motion.position[-1, -1][1:] == pytest.approx([-3e-3, 0.3e-3], abs=1e-6)
        assert "80 Hz" in done.describe()
    assert done.render()


# --- drives and slopes ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frequencies", "common"),
    [([80.0], 80.0), ([80.0, 160.0], 80.0), ([60.0, 90.0], 30.0), ([90.0, 60.0, 40.0], 10.0), ([0.1, 0.3], 0.1)],
)
def test_a_cycle_is_the_common_period(frequencies: list[float], common: float) -> None:
    assert common_frequency(frequencies) == pytest.approx(common, rel=1e-12)


def test_frequencies_without_a_cycle_are_refused() -> None:
    for other in (80.0 * 25, 80.0 * 2**0.5, 81.3):
        with pytest.raises(ValueError, match="not a ratio of whole numbers"):
            common_frequency([80.0, other])
    with pytest.raises(ValueError, match="common period"):
        common_frequency([1.0, 23 / 24, 22 / 23, 21 / 22, 19 / 20, 17 / 18])


def test_a_drive_is_its_largest_harmonic_where_one_number_is_asked_for() -> None:
    drive = Excitation(
        (
            Harmonic(axis="x", frequency=160.0, peak_acceleration=10.0),
            Harmonic(axis="z", frequency=80.0, peak_acceleration=30.0, phase=1.0),
        ),
        "container",
    )
    assert (drive.direction, drive.peak_acceleration, drive.frequency) == ((0.0, 0.0, 1.0), 30.0, 80.0)
    two = [{"frequency": "160 Hz", "peak_acceleration": "10 m/s^2"}]
    two += [{"frequency": "80 Hz", "peak_acceleration": "30 m/s^2", "axis": "z", "phase": "1 rad"}]
    case = Case.read(document() | {"drive": {"harmonics": two}})
    assert case.excitation == drive
    assert Case.from_dict(case.as_dict()) == case


def test_one_harmonic_is_the_drive_that_its_keys_describe() -> None:
    written = document(run=DRIVEN)
    written["drive"] = {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": "x"}]}
    assert numbers_of(Case.read(written, name="test")) == numbers_of(make_case(run=DRIVEN))


def test_a_phase_and_an_axis_aslant_change_the_start_and_not_the_walk(run_directory: Callable[..., Path]) -> None:
    speeds = [
        read(run_directory(make_case(run=DRIVEN, drive=drive)))["velocity"]
        for drive in ({"frame": "container"}, {"frame": "container", "phase": "90 deg"}, {"axis": [1, 1, 0]})
    ]
    assert speeds[1:] == pytest.approx([speeds[0]] * 2, rel=0.02)


def test_a_triangle_is_the_sum_of_its_harmonics() -> None:
    """Of the acceleration: odd harmonics as 1/k², within 4 % of the peak everywhere and 1 % on the flanks."""
    case = make_case(drive={"waveform": "triangle"})
    assert [one.frequency for one in case.excitation.harmonics] == [80.0, 240.0, 400.0, 560.0, 720.0]
    assert case.drive.frame == "container"
    cycle = np.linspace(0.0, 1.0, 401)
    phases = [one.angular_frequency * cycle / 80.0 + one.phase for one in case.excitation.harmonics]
    summed = sum(
        one.peak_acceleration * np.sin(phase) for one, phase in zip(case.excitation.harmonics, phases, strict=True)
    )
    triangle = 39.2 * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * cycle))
    assert np.abs(summed - triangle).max() < 0.045 * 39.2
    flank = np.abs(triangle) < 0.8 * 39.2
    assert np.abs(summed - triangle)[flank].max() < 0.01 * 39.2


def test_a_sawtooth_moves_a_symmetric_dimer(run_directory: Callable[..., Path]) -> None:
    """It rises evenly and falls at once: both go the same way, whichever they face. Measured: 0.206 mm/s."""
    drive = {"waveform": "sawtooth", "peak_acceleration": "4 g", "axis": "x"}
    case = make_case(dimers={"radii": ["0.25 mm", "0.25 mm"], "replicates": 2}, drive=drive, run=DRIVEN)
    time = np.linspace(-0.5, 0.5, 201)[20:-20] / 80.0
    waves = [
        one.peak_acceleration * np.sin(one.angular_frequency * time + one.phase) for one in case.excitation.harmonics
    ]
    np.testing.assert_allclose(sum(waves), 39.2 * 2.0 * 80.0 * time, atol=0.12 * 39.2)
    result = read(run_directory(case))
    axial = read_table(result.directory, "walkers").set_index("facing")["axial_velocity"]
    assert result["axial_velocity"] == pytest.approx(0.206e-3, rel=0.03)
    assert result["axial_left_facing"] == pytest.approx(axial[1].mean(), rel=0.01)


def test_two_tones_move_a_symmetric_dimer_and_their_phase_says_which_way(run_directory: Callable[..., Path]) -> None:
    """f + 2f breaks the symmetry under half a period; shifted by π, 2f is the mirrored drive. Measured: ∓2.28 mm/s."""
    case = fig1b(**{"dimers.radii": ["0.25 mm", "0.25 mm"]})

    def speed(phase: float) -> float:
        first = {"frequency": "80 Hz", "peak_acceleration": "4 g"}
        second = {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": f"{phase} deg"}
        both = Case.read(case.document | {"drive": {"harmonics": [first, second]}})
        return float(read(run_directory(both))["velocity"])

    one_way = speed(90.0)
    assert one_way == pytest.approx(-2.28e-3, rel=0.03)
    assert speed(270.0) == pytest.approx(-one_way, rel=0.01)
    assert abs(speed(0.0)) < 0.1 * abs(one_way)


@pytest.mark.parametrize(("tilt", "uphill"), [(0.0, 0.0), (30.0, 0.0), (90.0, 0.0), (30.0, 90.0), (90.0, 180.0)])
def test_gravity_on_a_plane(tilt: float, uphill: float) -> None:
    plane = Boundary(material="glass", tilt=radians(tilt), uphill=radians(uphill))
    found = plane.gravity(9.81)
    way = (cos(radians(uphill)), sin(radians(uphill)))
    down = 9.81 * sin(radians(tilt))
    np.testing.assert_allclose(found, (-down * way[0], -down * way[1], -9.81 * cos(radians(tilt))), atol=1e-14)
    assert (found[2] == 0.0) == (tilt == 90.0)
    sloped = fig1b(**{"boundary.tilt": f"{tilt} deg", "boundary.uphill": f"{uphill} deg"})
    assert sloped.goes_uphill == (tilt > 0.0 and uphill == 0.0)


def test_a_walker_walks_up_a_slope_until_it_is_too_steep(run_directory: Callable[..., Path]) -> None:
    """As measured: its speed falls with the tilt and changes sign between 10° and 20°."""
    slopes = (fig1b(**{"boundary.tilt": tilt}) for tilt in ("5 deg", "20 deg"))
    gentle, steep = (read(run_directory(slope)) for slope in slopes)
    assert gentle["velocity"] == pytest.approx(0.605e-3, rel=0.03)
    assert steep["axial_velocity"] < 0.0


# --- climbers on a wall -----------------------------------------------------------------------------------------------


FRICTIONS = {0.1: -9.57e-3, 0.2: -3.33e-3, 0.3: 4.77e-3}
"""Climbing speeds in m/s, as measured; the theory has those that climb a tenth faster."""


# Its speed is that of 120 cycles of 2 µs, 40 of them to settle, to three digits.
CLIMB = {"time_step": "4 us", "cycles": 24, "settling_cycles": 12}


def on_a_wall(friction: float = 0.3, **start: Any) -> Case:
    case = Case.read({**read_toml(shipped("case")["climber-dimer"]), "run": CLIMB}, name="climber-dimer")
    begin = {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0, "spacing": "0.1 m", **start}
    frictions = {f"contact.friction.bead_{other}": friction for other in ("bead", "wall")}
    return case.changed({**frictions, **{f"dimers.{key}": value for key, value in begin.items()}})


@pytest.fixture(scope="module")
def climbers(once: Callable[..., Path]) -> dict[str, Path]:
    """Climbers of several kinds, side by side in as few decks as may be."""
    case, engine = on_a_wall(), find_engine(None)
    symmetric = case.changed({"dimers.radii": ["0.42625 mm", "0.42625 mm"]})
    cases = {str(friction): on_a_wall(friction) for friction in FRICTIONS}
    cases |= {f"below {friction}": on_a_wall(friction, facing="left") for friction in (0.2, 0.3)}
    cases["symmetric"] = symmetric
    out = once("climbers", lambda folder: make_runs(list(cases.values()), folder, engine))
    places = finished_places(out)
    return {name: places[run_place(case, engine, out).name] for name, case in cases.items()}


def test_a_dimer_on_a_wall_is_one_on_a_plane_at_90_degrees() -> None:
    """Facing right is facing up there: the same case, hence the same run."""
    tables = read_toml(shipped("case")["climber-dimer"])
    assert tables["boundary"]["tilt"] == "90 deg"
    tables["dimers"]["facing"] = "right"
    assert Case.read(tables).determinants() == load_case("climber-dimer").determinants()


@pytest.mark.parametrize("friction", list(FRICTIONS))
def test_a_dimer_on_the_axis_climbs_if_friction_suffices(climbers: dict[str, Path], friction: float) -> None:
    velocity = read(climbers[str(friction)])["velocity"]
    assert velocity == pytest.approx(FRICTIONS[friction], rel=0.03)
    assert float(motion_of(on_a_wall(friction)).velocity[0]) == pytest.approx(velocity, rel=0.12)


@pytest.mark.parametrize("friction", [0.2, 0.3])
def test_with_the_large_bead_below_it_falls(climbers: dict[str, Path], friction: float) -> None:
    """As a symmetric one does."""
    assert read(climbers[f"below {friction}"])["axial_left_facing"] < -5e-3
    assert read(climbers["symmetric"])["axial_velocity"] < -1e-3


def test_a_climbers_weight_pulls_along_the_axis() -> None:
    case = on_a_wall()
    assert (case.pressing_gravity, case.axial_gravity) == (0.0, case.environment.gravity)
    assert predict(case)["alignment"]["u"] < 0.0  # it stands on its head
    with pytest.raises(InputError, match=r"dimers\.facing"):
        Case.read(document(boundary={"uphill": "90 deg", "tilt": "90 deg"}, dimers={"facing": "up"}))
    with pytest.raises(InputError, match=r"dimers\.facing"):
        Case.read(document(dimers={"facing": "up"}))


@pytest.fixture(scope="module")
def upright(once: Callable[..., Path]) -> Path:
    """The shipped climber, with its spread of starts, for a fifth of its time."""
    run = {"time_step": "2 us", "cycles": 36, "settling_cycles": 24, "samples_per_cycle": 1}
    tables = {**read_toml(shipped("case")["climber"]), "run": run}
    case, engine = Case.read(tables, name="climber"), find_engine(None)
    out = once("upright", lambda folder: make_runs([case], folder, engine))
    return finished_places(out)[run_place(case, engine, out).name]


def test_the_shipped_climber_comes_upright_and_climbs(upright: Path) -> None:
    result, walkers = read(upright), read_table(upright, "walkers")
    assert np.degrees(walkers["start_angle"].abs().max()) > 9.0
    assert np.degrees(walkers["orientation_end"].abs().max()) < 0.3
    assert result["upright"] == result["climbing"] == result["walkers"] == 6
    assert result["velocity"] == pytest.approx(3.62e-3, rel=0.03)
    assert 0.0 < np.degrees(result["ends_within"]) < 0.3


def test_posture_is_that_of_the_whole_run(upright: Path) -> None:
    """The same motion, turned: leaning from 15° on, turned over from 90° after the start, whatever comes after."""
    group = read_motion(upright).groups[0]
    assert postures(group) == ["upright"] * 6
    assert np.isnan(turned_over_at(group)).all()
    tilting = np.linspace(0.0, np.radians(20.0), len(group.time))[:, None]
    over = np.where(group.time == group.time[9], np.radians(100.0), 0.0)[:, None]
    low, high, back = (np.full((len(group.time), 1), np.radians(angle)) for angle in (14.0, 16.0, 150.0))
    turns = ((low, "upright"), (high, "leaning"), (back, "leaning"), (tilting, "leaning"), (0.5 * tilting, "leaning"))
    for turn, expected in (*turns, (over, "turned_over")):
        turned = replace(group)
        turned.__dict__["orientation"] = np.broadcast_to(turn, group.orientation.shape)
        assert postures(turned) == [expected] * 6
    turned.__dict__["orientation"] = np.broadcast_to(over, group.orientation.shape)
    assert turned_over_at(turned) == pytest.approx(group.time[9])
