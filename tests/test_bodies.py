"""Bodies on boundaries: clusters, trays, channels, several bodies at once, and what the engine makes of them."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import REFERENCE, make_case
from walkers.inputs import resolve_case
from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads
from walkers.templates.scene import place

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
    return resolve_case({**FIG1B, "clusters": list(clusters), **tables}, name="cluster")


@pytest.mark.parametrize(
    ("arrangement", "sizes"),
    [("chain", "Lss"), ("fan", "Lss"), ("fan", "Lsss"), ("ring", "Lsss"), ("diamond", "Lsss"), ("diamond", "LsLs")],
)
def test_beads_of_a_cluster_touch_as_its_arrangement_says(arrangement: str, sizes: str) -> None:
    """Touching pairs overlap by what carries their load, the beads the floor too, and no others overlap."""
    case = of_tables(cluster(arrangement, sizes, gap_spread=0.0))
    make, loads = case.walkers[0], contact_loads(case, case.walkers[0])
    scene, (first, _) = place((case,))
    beads = [next(bead for bead in scene.beads if bead.id == number) for number in first.beads]
    assert [bead.radius - bead.centre[2] for bead in beads] == pytest.approx(loads.overlaps[: len(sizes)], rel=1e-6)
    extents = []
    for one, other in combinations(range(len(sizes)), 2):
        between, both = np.subtract(beads[one].centre, beads[other].centre), beads[one].radius + beads[other].radius
        overlap = both - np.linalg.norm(between)
        if (one, other) in make.pairs:
            expected = loads.overlaps[len(sizes) + make.pairs.index((one, other))]
            assert overlap == pytest.approx(expected, rel=1e-4)
        else:
            assert overlap < 0.0
        extents.append(np.hypot(*between[:2]) + both)
    assert make.length == pytest.approx(max(extents), rel=2e-3)


def test_a_cluster_heads_to_its_large_bead_or_where_its_first_one_is() -> None:
    """Of s-L-s the centroids coincide, and alike beads have no large ones: then the design gives the heading."""
    expected = {"Lss": (1.0, -0.5, -0.5), "sLs": (1.0, 0.0, -1.0), "sss": (1.0, 0.0, -1.0)}
    for sizes, heading in expected.items():
        walker = of_tables(cluster("chain", sizes)).walkers[0]
        assert walker.toward_large == pytest.approx(heading, abs=1e-12)


def test_a_chain_of_two_is_a_dimer() -> None:
    tables = {key: value for key, value in REFERENCE.items() if key != "dimers"}
    start = {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0}
    assert resolve_case({**tables, "clusters": [cluster("chain", "Ls", **start)]}, name="test") == make_case()
    cases = [of_tables(cluster(arrangement, "Ls")) for arrangement in ("fan", "chain")]
    np.testing.assert_allclose(*([bead.centre for bead in place((case,))[0].beads] for case in cases), atol=1e-15)


def test_several_makes_of_walkers_stand_together(tmp_path: Path) -> None:
    """A dimer beside trimers walks as it does alone, and each make has its part of the result."""
    tables = cluster("fan", "Lss"), cluster("chain", "Lss", replicates=1)
    done = walkers.run(of_tables(*tables, dimers=dimers(2), run=BRIEF), tmp_path)
    makes = done.result["makes"]
    assert [make["walkers"] for make in makes] == [2, 2, 1]
    assert makes[0]["velocity"]["mean"] == pytest.approx(FIG1B_SPEED, rel=2e-3)
    assert done.walkers["make"].tolist() == [0, 0, 1, 1, 2]
    assert done.walkers["rotation_3"].isna().tolist() == [True, True, False, False, False]
    assert "of 0.3/0.2/0.2 mm" in done.describe()
    assert {path.name for path in done.plot()} == {"walk.png", "gait.png"}
    assert done.vtk().exists()
    assert done.render()[0].stat().st_size > 10_000
    # Contact 3 is bead on bead of a dimer, and bead 3 on the floor of a trimer: they are not averaged.
    assert done.result["sliding"] == makes[0]["sliding"]
    assert len(makes[1]["sliding"]) == 6


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
    assert "together" in tray.describe()
    assert "spacing" not in tray.describe()  # a meeting is no fault here
    group = tray.motion.groups[0]
    centre = group.mass_centre[:: group.case.run.samples_per_cycle]
    speed = np.linalg.norm(np.diff(centre, axis=0), axis=-1) * group.case.drive.frequency
    assert speed[5:].max() < 0.1 * group.case.drive.peak_velocity
    first = tray.result["groups_at_end"][0]
    apart = np.linalg.norm(centre[-12:, first[1]] - centre[-12:, first[0]], axis=-1)
    assert apart.max() < 1.1 * group.make.length  # they hold on to each other, however they turn


@pytest.mark.parametrize("width", ["1.4 mm", "0.5998 mm"])
def test_a_dimer_in_a_channel_is_held_by_the_walls_that_it_touches(width: str, tmp_path: Path) -> None:
    """In a wide one it walks as on a plane; in a narrow one both side walls hold its large bead, and it is slower."""
    boundary = {**FIG1B["boundary"], "shape": "channel", "width": width}
    done = walkers.run(of_tables(dimers=dimers(1, angle_spread="0 deg"), boundary=boundary, run=BRIEF), tmp_path)
    bridges, velocity = done.table("bridges"), done.result["velocity"]["mean"]
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


def test_a_dimer_in_a_groove_rolls_on_both_walls(tmp_path: Path) -> None:
    """It touches both walls, as high as that needs, is held by both, rolls about its chord, v = R sin(60°) dφ/dt."""
    boundary = {**FIG1B["boundary"], "shape": "groove", "opening": "120 deg"}
    done = walkers.run(of_tables(dimers=dimers(2), boundary=boundary, run=BRIEF), tmp_path)
    height = np.sin(np.radians(60.0)) * done.motion.position[-1, :, 2] / done.motion.radius
    np.testing.assert_allclose(height, 1.0, atol=1e-3)
    bridges = done.table("bridges")
    held = bridges[(bridges["wall"] >= 0) & (bridges["time"] == bridges["time"].max())]
    assert held.groupby("bead_1")["wall"].apply(sorted).tolist() == [[0, 1]] * 4
    assert done.result["velocity"]["mean"] == pytest.approx(0.818 * MM_PER_S, rel=0.01)
    rolling = np.sin(np.radians(60.0)) * done.result["rotation"]["bead_1"]
    assert rolling == pytest.approx(done.result["velocity"]["mean"], rel=0.04)
    assert done.vtk().exists()


def test_walkers_may_run_in_segments(tmp_path: Path) -> None:
    """A walker of three segments walks as one in one does (restarts: 1e-3)."""
    run = {"cycles": 24, "settling_cycles": 12, "segment": "0.1 s"}
    done = walkers.run(of_tables(dimers=dimers(1), run=run), tmp_path)
    assert [path.name for path in sorted((done.directory / "segments").iterdir())] == ["0000", "0001", "0002"]
    assert done.result["velocity"]["mean"] == pytest.approx(FIG1B_SPEED, rel=2e-3)


@pytest.mark.parametrize("frequency", ["73 Hz", "74 Hz"])
def test_a_rest_before_the_drive_is_one(tmp_path: Path, frequency: str) -> None:
    """Whatever part of a cycle it takes: nothing moves meanwhile, the bridges drag as they do without it."""
    tables = {"dimers": dimers(1, angle_spread="0 deg"), "drive": {"frequency": frequency, "peak_acceleration": "4 g"}}
    speeds = []
    for rest in ("0 s", "0.06 s"):
        run = {"cycles": 16, "settling_cycles": 12, "longest_settling": rest}
        done = walkers.run(of_tables(**tables, run=run), tmp_path)
        speeds.append(done.result["velocity"]["mean"])
    resting = done.motion.time < 0.0
    assert resting.any()
    assert done.trajectory["time"].min() == 0.0
    assert np.abs(done.motion.velocity[resting]).max() < 1e-4
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)


def test_walkers_placed_beads_and_a_mixture_share_a_box(tmp_path: Path) -> None:
    """All analyses that mean something are in the result, and nobody starts within another."""
    case = resolve_case(EVERYTHING, name="everything")
    assert Case.from_dict(case.as_dict()) == case
    assert case.all_radii[:2] == [5e-4, 3e-4]
    for one, other in combinations(place((case,))[0].beads, 2):
        if not {one.id, other.id} <= {1, 2}:  # the dimer's own beads touch
            assert np.linalg.norm(np.subtract(one.centre, other.centre)) > one.radius + other.radius
    done = walkers.run(case, tmp_path)
    assert set(done.result["analyses"]) == {"walking", "pile"}
    assert (done.result["beads"], done.result["walkers"], len(done.motion.radius)) == (23, 1, 23)
    assert done.table("bed")["time"].max() >= 0.03


def test_a_bead_may_lie_on_a_plane_beside_walkers_or_alone(tmp_path: Path) -> None:
    """It rolls along the drive, held down; alone there is nothing to measure, but its motion and a picture."""
    bead = {"placed": [{"radius": "0.3 mm", "at": ["5 mm", "-3 mm", "0.29999 mm"]}]}
    run = {"cycles": 8, "settling_cycles": 4, "samples_per_cycle": 20, "longest_settling": "0 s"}
    for tables, names in (({**bead, "dimers": dimers(1)}, {"walking"}), (bead, set[str]())):
        done = walkers.run(of_tables(**tables, run=run), tmp_path)
        assert set(done.result["analyses"]) == names
        assert done.motion.position[-1, -1][1:] == pytest.approx([-3e-3, 0.3e-3], abs=1e-6)
        assert "80 Hz" in done.describe()
    assert done.render()
