"""Bodies on boundaries: clusters, trays, channels, several bodies at once, and what the engine makes of them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import REFERENCE, call, make_case, to_toml
from walkers.inputs import resolve_case
from walkers.inputs.arrangements import ARRANGEMENTS
from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads
from walkers.postprocess.meetings import groups_of
from walkers.templates.placement import place
from walkers.theory.prediction import describe, predict

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


def cluster(arrangement: str, sizes: str, **start: Any) -> dict[str, Any]:
    """A table of ``[[clusters]]``: large (L) and small (s) beads in an arrangement."""
    table = {"arrangement": arrangement, "radii": [SIZES[size] for size in sizes], "replicates": 2}
    return {**table, **start}


def of_tables(**tables: Any) -> Case:
    """The conditions of Fig. 1b with other tables."""
    return resolve_case({**FIG1B, **tables}, name="cluster")


def of_clusters(*tables: dict[str, Any], **changes: dict[str, Any]) -> Case:
    """The conditions of Fig. 1b with clusters, and other tables."""
    return of_tables(clusters=list(tables), **changes)


@pytest.mark.parametrize(
    ("arrangement", "sizes"),
    [("chain", "Lss"), ("fan", "Lss"), ("fan", "Lsss"), ("ring", "Lsss"), ("diamond", "Lsss"), ("diamond", "LsLs")],
)
def test_beads_of_a_cluster_touch_as_its_arrangement_says(arrangement: str, sizes: str) -> None:
    """Touching pairs overlap by what carries their load, the beads the floor too, and no others overlap."""
    case = of_clusters(cluster(arrangement, sizes, gap_spread=0.0))
    make, loads = case.walkers[0], contact_loads(case, case.walkers[0])
    scene, (first, _) = place((case,))
    beads = [next(bead for bead in scene.beads if bead.id == number) for number in first.beads]
    assert [bead.radius - bead.centre[2] for bead in beads] == pytest.approx(loads.overlaps[: len(sizes)], rel=1e-6)
    for one, other in combinations(range(len(sizes)), 2):
        apart = np.linalg.norm(np.subtract(beads[one].centre, beads[other].centre))
        overlap = beads[one].radius + beads[other].radius - apart
        if (one, other) in make.pairs:
            expected = loads.overlaps[len(sizes) + make.pairs.index((one, other))]
            assert overlap == pytest.approx(expected, rel=1e-4)
        else:
            assert overlap < 0.0


def test_a_cluster_heads_to_its_large_bead_or_where_its_first_one_is() -> None:
    """Of s-L-s the centroids coincide, and alike beads have no large ones: then the design gives the heading."""
    heading = {sizes: of_clusters(cluster("chain", sizes)).walkers[0].toward_large for sizes in ("Lss", "sLs", "sss")}
    assert heading["Lss"] == (1.0, -0.5, -0.5)
    assert heading["sLs"] == pytest.approx((1.0, 0.0, -1.0), abs=1e-12)
    assert heading["sss"] == pytest.approx((1.0, 0.0, -1.0), abs=1e-12)


def test_a_chain_of_two_is_a_dimer() -> None:
    start = {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0}
    dimer = make_case()
    chain = resolve_case(
        {
            **{key: value for key, value in REFERENCE.items() if key != "dimers"},
            "clusters": [cluster("chain", "Ls", **start)],
        },
        name="test",
    )
    assert chain == dimer
    fan = of_clusters(cluster("fan", "Ls"))
    starts = [[bead.centre for bead in place((case,))[0].beads] for case in (fan, of_clusters(cluster("chain", "Ls")))]
    np.testing.assert_allclose(*starts, atol=1e-15)


FIG1B_SPEED = 1.079 * MM_PER_S
"""The shipped walker's, as measured; half and twice the time step give the same within 0.2 %."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arrangement", "sizes", "speed"), [("fan", "Lss", 0.615), ("chain", "Lss", 1.09), ("diamond", "Lsss", 0.639)]
)
def test_clusters_turn_to_the_axis_and_walk(arrangement: str, sizes: str, speed: float, tmp_path: Path) -> None:
    """From 0° and 20°, the large bead leading; speeds as measured (test_crosscheck has the fan)."""
    run = {"run": {"cycles": 120, "settling_cycles": 80}}
    case = of_clusters(cluster(arrangement, sizes), cluster(arrangement, sizes, angle="20 deg"), **run)
    for make in walkers.run(case, tmp_path).result["makes"]:
        assert make["velocity"]["mean"] == pytest.approx(speed * MM_PER_S, rel=0.02)
        assert abs(np.degrees(make["orientation_end"]["largest"])) < 6.0


def test_several_makes_of_walkers_stand_together(tmp_path: Path) -> None:
    """A dimer beside trimers walks as it does alone, and each make has its part of the result."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2}}
    case = of_clusters(cluster("fan", "Lss"), cluster("chain", "Lss", replicates=1), **dimers, run=BRIEF)
    done = walkers.run(case, tmp_path)
    makes = done.result["makes"]
    assert [make["walkers"] for make in makes] == [2, 2, 1]
    assert makes[0]["velocity"]["mean"] == pytest.approx(FIG1B_SPEED, rel=2e-3)
    assert done.walkers["make"].tolist() == [0, 0, 1, 1, 2]
    assert done.walkers["rotation_3"].isna().tolist() == [True, True, False, False, False]
    assert "of 0.3/0.2/0.2 mm" in done.describe()
    assert {path.name for path in done.plot()} == {"walk.png", "gait.png"}
    assert done.vtk().exists()
    assert done.render()[0].stat().st_size > 10_000


@pytest.fixture(scope="module")
def tray(once: Callable[..., Path]) -> walkers.Run:
    """Nine walkers of Fig. 1b, 1.6 mm apart."""
    start = {"replicates": 9, "spacing": "1.6 mm", "meet": True, "angle_spread": "20 deg"}
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], **start}}
    case = of_clusters(**dimers, run={"cycles": 30, "settling_cycles": 18})
    return walkers.find_run(next(once("tray", lambda folder: walkers.run(case, folder)).glob("cluster-*")))


def test_walkers_on_a_tray_meet_and_stick(tray: walkers.Run) -> None:
    """Heads that run into each other stick; the table of meetings and the bridges between walkers say the same."""
    meetings, bridges = tray.table("meetings"), tray.table("bridges")
    merged = meetings[meetings["event"] == "merged"]
    assert tray.result["merged"] == len(merged) >= 2
    assert tray.result["largest_group"] >= 2
    between = bridges[bridges["other_walker"] >= 0]
    assert (between["contact"] == 0).all()
    for row in merged.itertuples():
        joined = between[(between["walker"] == row.walker) & (between["other_walker"] == row.other)]
        assert joined["time"].min() == pytest.approx(row.time)
    assert "together" in tray.describe()
    assert "spacing" not in tray.describe()  # a meeting is no fault here
    assert (tray.directory / "meetings.parquet").exists()


def test_momentum_on_a_tray_is_sane(tray: walkers.Run) -> None:
    """After the start, which throws a little, no mass centre is faster than a tenth of the plate; who met holds on."""
    group = tray.motion.groups[0]
    strobe = group.case.run.samples_per_cycle
    centre = group.mass_centre[::strobe]
    speed = np.linalg.norm(np.diff(centre, axis=0), axis=-1) * group.case.drive.frequency
    assert speed[5:].max() < 0.1 * group.case.drive.peak_velocity
    first = tray.result["groups_at_end"][0]
    assert len(first) >= 2
    apart = np.linalg.norm(centre[-12:, first[1]] - centre[-12:, first[0]], axis=-1)
    assert apart.max() < 1.1 * group.make.length  # they hold on to each other, however they turn


def test_a_picture_of_a_tray_shows_all_walkers(tray: walkers.Run) -> None:
    from matplotlib.image import imread

    (picture,) = tray.render()
    reds = imread(picture)
    assert picture.name == "series.png"
    ruby = (reds[..., 0] > 0.4) & (reds[..., 1] < 0.25) & (reds[..., 2] < 0.35)
    assert ruby.mean() > 0.005


def test_groups_are_connected_components() -> None:
    assert sorted(groups_of(frozenset({(0, 1), (1, 3)}), 5)) == [[0, 1, 3], [2], [4]]
    assert groups_of(frozenset(), 2) == [[0], [1]]


def test_a_dimer_in_a_wide_channel_walks_as_on_a_plane(tmp_path: Path) -> None:
    """The walls take no part where they are not touched."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2}}
    boundary = {"boundary": {"shape": "channel", "width": "1.4 mm", "material": "chromium-coated glass"}}
    case = of_clusters(**dimers, **boundary, run=BRIEF)
    done = walkers.run(case, tmp_path)
    assert done.result["velocity"]["mean"] == pytest.approx(FIG1B_SPEED, rel=2e-3)
    assert set(done.table("bridges")["wall"]) == {0, -1}


def test_a_bead_in_a_narrow_channel_is_held_by_its_walls(tmp_path: Path) -> None:
    """The large bead touches both side walls from the start: three bridges hold it, and it is slower."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1, "angle_spread": "0 deg"}}
    boundary = {"boundary": {"shape": "channel", "width": "0.5998 mm", "material": "chromium-coated glass"}}
    done = walkers.run(of_clusters(**dimers, **boundary, run=BRIEF), tmp_path)
    bridges = done.table("bridges")
    last = bridges[(bridges["time"] == bridges["time"].max()) & (bridges["bead_1"] == 0)]
    assert sorted(last["wall"]) == [-1, 0, 1, 2]
    assert (last["normal_force"].abs() < 2e-3).all()
    assert abs(done.result["velocity"]["mean"]) < 1.0 * MM_PER_S


def test_a_bead_rests_on_both_walls_of_a_groove() -> None:
    groove = make_case(boundary={"shape": "groove", "opening": "60 deg"}).boundary
    height = groove.rest_height(3e-4)
    assert height == pytest.approx(2.0 * 3e-4)
    assert [np.dot(wall.normal, (0.0, 0.0, height)) for wall in groove.walls] == pytest.approx([3e-4, 3e-4])


def test_a_dimer_in_a_groove_rolls_on_both_walls(tmp_path: Path) -> None:
    """It touches both walls, as high as that needs, is held by both, rolls about its chord, v = R sin(60°) dφ/dt."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2}}
    boundary = {"boundary": {"shape": "groove", "opening": "120 deg", **FIG1B["boundary"]}}
    done = walkers.run(of_tables(**dimers, **boundary, run=BRIEF), tmp_path)
    height = np.sin(np.radians(60.0)) * done.motion.position[-1, :, 2] / done.motion.radius
    np.testing.assert_allclose(height, 1.0, atol=1e-3)
    bridges = done.table("bridges")
    held = bridges[(bridges["wall"] >= 0) & (bridges["time"] == bridges["time"].max())]
    assert held.groupby("bead_1")["wall"].apply(sorted).tolist() == [[0, 1]] * 4
    assert done.result["velocity"]["mean"] == pytest.approx(0.818 * MM_PER_S, rel=0.01)
    rolling = np.sin(np.radians(60.0)) * done.result["rotation"]["bead_1"]
    assert rolling == pytest.approx(done.result["velocity"]["mean"], rel=0.04)
    assert done.vtk().exists()


def test_walkers_may_run_in_segments_and_rest_first(tmp_path: Path) -> None:
    """A walker of three segments, and one that rests before the drive, walk as one in one does (restarts: 1e-3)."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1}}
    run = {"cycles": 24, "settling_cycles": 12}
    split = walkers.run(of_clusters(**dimers, run={**run, "segment": "0.1 s"}), tmp_path)
    assert [path.name for path in sorted((split.directory / "segments").iterdir())] == ["0000", "0001", "0002"]
    rested = walkers.run(of_clusters(**dimers, run={**run, "longest_settling": "0.1 s"}), tmp_path)
    assert rested.motion.time[0] < 0.0 == rested.trajectory["time"].min()
    for done in (split, rested):
        assert done.result["velocity"]["mean"] == pytest.approx(FIG1B_SPEED, rel=2e-3)


@pytest.mark.parametrize("frequency", ["73 Hz", "74 Hz"])
def test_a_rest_before_the_drive_is_one(tmp_path: Path, frequency: str) -> None:
    """Whatever part of a cycle it takes: nothing moves meanwhile, the bridges drag as they do without it."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1, "angle_spread": "0 deg"}}
    drive = {"drive": {"frequency": frequency, "peak_acceleration": "4 g"}}
    run = {"cycles": 16, "settling_cycles": 12}
    speeds = []
    for rest in ("0 s", "0.06 s"):
        done = walkers.run(of_tables(**dimers, **drive, run={**run, "longest_settling": rest}), tmp_path)
        speeds.append(done.result["velocity"]["mean"])
    resting = done.motion.time < 0.0
    assert resting.any()
    assert np.abs(done.motion.velocity[resting]).max() < 1e-4
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)


def test_contacts_are_those_of_the_first_make_where_there_are_several(tmp_path: Path) -> None:
    """Contact 3 is bead on bead of a dimer, and bead 3 on the floor of a trimer: they are not averaged."""
    run = {"run": {"cycles": 6, "settling_cycles": 2}}
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1}}
    both = walkers.run(of_clusters(cluster("fan", "Lss"), **dimers, **run), tmp_path).result
    assert both["sliding"] == both["makes"][0]["sliding"]
    assert len(both["makes"][1]["sliding"]) == 6


def test_a_sweep_of_an_entry_of_a_list_says_which(tmp_path: Path) -> None:
    case = to_toml(FIG1B) + "[[clusters]]\n" + to_toml(cluster("fan", "Lss"))
    (tmp_path / "case.toml").write_text(case)
    (tmp_path / "sweep.toml").write_text('case = "case.toml"\n[axes]\nclusters.angle = ["0 deg", "45 deg"]\n')
    done = call("sweep", str(tmp_path / "sweep.toml"), "--dry-run")
    assert done.returncode == 2
    assert "clusters is a list: say which one, such as clusters[0]" in done.stderr


def test_walkers_on_a_slope_are_told_apart_by_where_they_go(tmp_path: Path) -> None:
    """Up 0.60, down 1.64 mm/s: the mean is no walker's, and theory is set beside those that go up."""
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2}}
    boundary = {"boundary": {**FIG1B["boundary"], "tilt": "5 deg"}}
    done = walkers.run(of_tables(**dimers, **boundary, run=BRIEF), tmp_path)
    assert "velocity   facing up 0.60" in done.describe()
    assert describe(predict(done.case), done.result).count("engine                            0.60") == 1
    assert len(repr(done.motion)) < 100 > len(repr(done.motion.groups[0]))
    with pytest.raises(FileNotFoundError, match="has no table bed; it has bridges, trajectory, walkers"):
        done.table("bed")


def test_a_case_of_every_body_comes_back_from_its_json() -> None:
    case = resolve_case(everything())
    assert Case.from_dict(case.as_dict()) == case
    assert case.all_radii[:2] == [5e-4, 3e-4]


def everything() -> dict[str, Any]:
    """A dimer in a box, a bead beside it, and a handful poured on them."""
    return {
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


def test_walkers_placed_beads_and_a_mixture_share_a_box(tmp_path: Path) -> None:
    """All analyses that mean something are in the result, and nobody starts within another."""
    case = resolve_case(everything(), name="everything")
    beads = place((case,))[0].beads
    for one, other in combinations(beads, 2):
        if not {one.id, other.id} <= {1, 2}:  # the dimer's own beads touch
            assert np.linalg.norm(np.subtract(one.centre, other.centre)) > one.radius + other.radius
    done = walkers.run(case, tmp_path)
    assert set(done.result["analyses"]) == {"walking", "pile"}
    assert done.result["beads"] == 23
    assert done.result["walkers"] == 1
    assert len(done.motion.radius) == 23
    assert done.table("bed")["time"].max() >= 0.03


def test_a_bead_may_lie_on_a_plane_beside_walkers_or_alone(tmp_path: Path) -> None:
    """It rolls along the drive, held down; alone there is nothing to measure, but its motion and a picture."""
    bead = {"placed": [{"radius": "0.3 mm", "at": ["5 mm", "-3 mm", "0.29999 mm"]}]}
    dimers = {"dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 1}}
    run = {"run": {"cycles": 8, "settling_cycles": 4, "samples_per_cycle": 20, "longest_settling": "0 s"}}
    for tables, names in (({**bead, **dimers}, {"walking"}), (bead, set[str]())):
        done = walkers.run(of_tables(**tables, **run), tmp_path)
        assert set(done.result["analyses"]) == names
        place_of_bead = done.motion.position[-1, -1]
        assert place_of_bead[1:] == pytest.approx([-3e-3, 0.3e-3], abs=1e-6)
        assert "80 Hz" in done.describe()
    assert done.render()


def test_every_arrangement_is_told_of(tmp_path: Path) -> None:
    """The documents have all of them, with the meaning that the program knows."""
    told = (Path(__file__).parents[1] / "docs" / "reference" / "cases.md").read_text()
    for name, arrangement in ARRANGEMENTS.items():
        assert f"`{name}`" in told
        assert arrangement.meaning in told


def test_extents_bound_the_beads() -> None:
    """A walker's length is that of its beads seen from above."""
    for arrangement, sizes in (("chain", "Ls"), ("fan", "Lsss"), ("ring", "Lsss"), ("diamond", "LssL")):
        case = of_clusters(cluster(arrangement, sizes, replicates=1))
        beads = place((case,))[0].beads
        widest = max(
            hypot(one.centre[0] - other.centre[0], one.centre[1] - other.centre[1]) + one.radius + other.radius
            for one, other in combinations(beads, 2)
        )
        assert case.walkers[0].length == pytest.approx(widest, rel=2e-3)
