"""Climbs of made-up trajectories: what counts as a climb; how clusters begin, meet, part, end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

from walkers.inputs.reading import load_case
from walkers.inputs.tables.shapes.walls import Flat
from walkers.postprocess.measure import clusters
from walkers.postprocess.measure.clusters import (
    PileBeads,
    Track,
    _walls_apart,
    assembly_of,
    at_sides,
    bulk_of,
    climbs_of,
    connected,
    floor_of,
)
from walkers.postprocess.measure.motion import Bridges
from walkers.postprocess.measure.piles import segregation
from walkers.postprocess.measure.tables import Columns
from walkers.sweeps.climbing import climb_summary

FloatArray = npt.NDArray[np.float64]
Pairs = list[tuple[int, int]]

BEADS = 24
BULK = list(range(20))
"""Beads of the bulk: a chain whose bead 0 is at a side wall and whose bead 1 is on the floor."""
LEADER = 20
"""The only large bead."""
TAIL = 21
ON_PILE = [(22, 19), (23, 19)]
"""Bridges that join beads 22 and 23 to the bulk."""
INTERVAL = 0.02
"""Time between two frames, s."""
TIME = np.arange(0.0, 4.0, INTERVAL)
FRAMES = len(TIME)
MIDDLE = FRAMES // 2
NAMES = ("floor", "-x", "+x", "-y", "+y")
SIDE = 3
"""Index of the wall -y."""
UP = 3e-3 * TIME[:, None]
"""Rise at 3 mm/s, m, shape (FRAMES, 1)."""
SEEDS = pytest.mark.parametrize("seed", [None, 0, 1, 2], ids=["still", "0", "1", "2"])
"""Trajectories without noise, and with three draws of it."""


def pair_apart(frame: int) -> Pairs:
    """Leader and tail are joined to each other alone, in all frames."""
    return [(LEADER, TAIL), *ON_PILE]


def no_pairs(frame: int) -> Pairs:
    """No further bridges, in all frames."""
    return []


def leader_at_wall(frame: int) -> dict[int, int]:
    """The leader has a bridge to the side wall, in all frames."""
    return {LEADER: SIDE}


def no_walls(frame: int) -> dict[int, int]:
    """No bead of the cluster has a bridge to a wall, in all frames."""
    return {}


def make_bridges(pairs: Pairs, walls: dict[int, int], frame: int = 0) -> Bridges:
    """Make bridges that touch and pull, between pairs of beads and from beads to walls."""
    contacts = []
    for first, second in pairs:
        contacts.append((first, second, -1))
    for bead, wall in walls.items():
        contacts.append((bead, -1, wall))
    ones = np.ones(len(contacts))
    return Bridges(frame, np.array(contacts), ones, -ones)


def table_rows(columns: Columns) -> list[Any]:
    """The rows of a table, each with its values as attributes."""
    rows = []
    for values in zip(*columns.values(), strict=True):
        rows.append(SimpleNamespace(**dict(zip(columns, values, strict=True))))
    return rows


@dataclass
class Scene:
    """A made-up pile, the clusters that were followed in it, and the table of their climbs."""

    beads: PileBeads
    tracks: list[Track]
    table: Columns

    @property
    def climbs(self) -> list[Any]:
        """The rows of the table, one for each cluster."""
        return table_rows(self.table)

    @property
    def events(self) -> list[tuple[str, int, int]]:
        """Kind, cluster and second cluster of each event."""
        columns = clusters.events_of(self.tracks, self.table, self.beads)
        return list(zip(columns["event"], columns["track"], columns["other"], strict=True))

    @property
    def frames(self) -> list[int]:
        """Number of frames in which each cluster was followed."""
        return [len(track.frames) for track in self.tracks]


def make_scene(
    rise: npt.ArrayLike = 0.0,
    pairs: Callable[[int], Pairs] = no_pairs,
    walls: Callable[[int], dict[int, int]] = leader_at_wall,
    joined: Callable[[int], Pairs] = pair_apart,
    names: Sequence[str] = NAMES,
) -> Scene:
    """Make a pile of 24 beads, 20 of them the bulk, and follow its clusters.

    Without changes the large bead 20 leads bead 21 and is at a side wall; beads 22 and 23 are
    joined to the bulk.

    Parameters
    ----------
    rise
        What beads rise above 5 mm, m: four columns for beads 20 to 23, else for 20 and 21.
    pairs
        Further bridges between beads, by frame.
    walls
        Beads at walls, by frame.
    joined
        Bridges between beads 20 to 23, and from these to the bulk, by frame.
    names
        Names of the walls.
    """
    rise = np.asarray(rise)
    height = np.zeros((FRAMES, BEADS))
    height[:, BULK] = np.linspace(0.0, 4e-3, len(BULK))
    height[:, LEADER:] = 5e-3
    if rise.ndim == 2 and rise.shape[1] == 4:
        height[:, LEADER:] += rise
    else:
        height[:, LEADER : TAIL + 1] += rise
    floor = floor_of(names)
    bulks = []
    free_clusters = []
    for frame in range(FRAMES):
        bridges = make_bridges(
            [*pairwise(BULK), *joined(frame), *pairs(frame)],
            {0: SIDE, 1: 0, **walls(frame)},
        )
        labels = connected(BEADS, bridges.beads)
        bulk = bulk_of(labels, bridges, floor=floor)
        bulks.append(bulk)
        free_clusters.append(list(clusters.held_clusters(labels, bridges, bulk, floor)))
    beads = PileBeads(TIME, height, np.arange(BEADS) == LEADER, np.zeros(FRAMES), bulks, 0, names)
    tracks = clusters.follow(TIME, free_clusters)
    return Scene(beads, tracks, climbs_of(tracks, beads))


def hop_at(frame: int) -> FloatArray:
    """Rise by 4 mm from one frame to the next, shape (FRAMES, 1)."""
    return 4e-3 * (np.arange(FRAMES) >= frame)[:, None]


def jitter(seed: int | None) -> FloatArray:
    """Noise of 5 µm from frame to frame, as of clusters that hang on a shaken wall."""
    if seed is None:
        return np.zeros((FRAMES, 1))
    return np.random.default_rng(seed).normal(0.0, 5e-6, (FRAMES, 1))


# --- what a climb is --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def overtaking() -> Scene:
    """A cluster that rises at 3 mm/s, whose tail overtakes its leader for the last 20 frames.

    The tail is 0.8 mm below the leader, then 0.2 mm above it.
    """
    tail = np.where(np.arange(FRAMES) < FRAMES - 20, -8e-4, 2e-4)
    return make_scene(UP + np.stack([np.zeros(FRAMES), tail], axis=1))


def test_a_rising_cluster_climbs(overtaking: Scene) -> None:
    """Its mean height gains 3 mm/s and, as one of two beads rises by 1 mm, another 0.5 mm."""
    (climb,) = overtaking.climbs
    assert climb.climbed
    assert climb.speed == pytest.approx((3e-3 * TIME[-1] + 0.5e-3) / TIME[-1], rel=1e-9)
    assert overtaking.frames == [FRAMES]
    assert overtaking.events == []  # free and at the wall from the first frame to the last


def test_the_leader_of_a_climb_is_the_bead_that_is_topmost_for_most_of_it(
    overtaking: Scene,
) -> None:
    (climb,) = overtaking.climbs
    assert climb.leader == LEADER
    assert climb.size == 2
    assert climb.large == 1
    assert climb.wall_names == "-y"


def test_a_rising_cluster_is_above_the_surface_as_it_is_at_the_end(overtaking: Scene) -> None:
    """The surface sinks from 3 to 1 mm; the leader rises from 5 mm at 3 mm/s."""
    sinking = replace(overtaking.beads, surface=np.linspace(3e-3, 1e-3, FRAMES))
    (climb,) = table_rows(climbs_of(overtaking.tracks, sinking))
    assert climb.height == pytest.approx(5e-3 + 3e-3 * TIME[-1])
    assert climb.above_surface == pytest.approx(4e-3 + 3e-3 * TIME[-1])


def test_the_error_of_a_speed_is_its_scatter() -> None:
    """The stated error is the scatter of the speeds of 200 climbs.

    Their velocity differs from frame to frame, 5 mm/s in the mean with a deviation of 20 mm/s.
    """
    draw = np.random.default_rng(1)
    scene = make_scene()
    speeds = []
    errors = []
    for _ in range(200):
        height = scene.beads.height.copy()
        steps = draw.normal(5e-3, 20e-3, FRAMES) * INTERVAL
        height[:, LEADER : TAIL + 1] += np.cumsum(steps)[:, None]
        (climb,) = table_rows(climbs_of(scene.tracks, replace(scene.beads, height=height)))
        speeds.append(climb.speed)
        errors.append(climb.standard_error)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(speeds), rel=0.25)


@pytest.mark.parametrize(("rise", "climbed"), [(1.99e-3, False), (2.01e-3, True)])
def test_a_rise_of_2_mm_is_a_climb(rise: float, climbed: bool) -> None:
    (climb,) = make_scene(np.clip(UP, None, rise)).climbs
    assert climb.climbed == climbed
    assert climb.gain == pytest.approx(rise)


@pytest.mark.parametrize(("frames", "climbed"), [(2, False), (3, True), (4, True)])
def test_a_rise_through_three_frames_is_a_climb(frames: int, climbed: bool) -> None:
    """3 mm, from one frame to the next or through one or two in between."""
    height = np.interp(np.arange(FRAMES), [100, 100 + frames - 1], [0.0, 3e-3])
    (climb,) = make_scene(height[:, None]).climbs
    assert climb.climbed == climbed
    assert climb.gain == pytest.approx(3e-3)


# --- what is no climb -------------------------------------------------------------------------


def joined_upward_at_times(frame: int) -> Pairs:
    """A second pair, joined to the first one in ten frames of twenty."""
    pairs = [(LEADER, TAIL), (22, 23)]
    if frame % 20 < 10:
        pairs.append((TAIL, 22))
    return pairs


def at_wall_in_two_frames(frame: int) -> dict[int, int]:
    """The leader is at the wall in the first frame, and in the fifth."""
    if frame in (0, 4):
        return {LEADER: SIDE}
    return {}


def tail_on_pile(frame: int) -> Pairs:
    """The tail of the cluster is joined to the bulk, in all frames."""
    return [(TAIL, 19)]


def tail_on_pile_alone(frame: int) -> Pairs:
    """The tail is joined to the bulk and not to the leader, in all frames."""
    return [*ON_PILE, (TAIL, 19)]


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param(
            {
                "rise": np.array([0.0, 0.0, 4e-3, 4e-3]) * np.ones((FRAMES, 1)),
                "joined": joined_upward_at_times,
            },
            id="beads 4 mm higher come and go",
        ),
        pytest.param({"rise": hop_at(100) - UP / 300.0}, id="it hops between two frames"),
        pytest.param(
            {"rise": hop_at(4), "walls": at_wall_in_two_frames},
            id="it leaves the wall and is there again 4 mm higher 0.08 s later",
        ),
    ],
)
def test_a_cluster_that_is_higher_later_has_not_always_climbed(changes: dict[str, Any]) -> None:
    scene = make_scene(**changes)
    assert scene.tracks
    assert not scene.table["climbed"].any()


def test_a_cluster_that_sinks_gains_nothing() -> None:
    scene = make_scene(8e-3 - UP / 3.0)
    (climb,) = scene.climbs
    assert not climb.climbed
    assert climb.gain < 1e-4


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param(
            {"rise": (40e-3 * TIME - 10e-3 * TIME**2)[:, None], "walls": no_walls},
            id="it is thrown into the air",
        ),
        pytest.param({"rise": UP, "pairs": tail_on_pile}, id="it rises with the pile"),
        pytest.param(
            {"rise": UP * [1.0, 0.0], "joined": tail_on_pile_alone}, id="it is a single bead"
        ),
    ],
)
def test_what_is_not_a_cluster_free_of_the_pile_and_at_a_wall_is_not_followed(
    changes: dict[str, Any],
) -> None:
    scene = make_scene(**changes)
    assert scene.tracks == []
    assert scene.climbs == []


@SEEDS
def test_a_hop_between_two_heights_at_which_a_cluster_hangs_is_no_climb(seed: int | None) -> None:
    (climb,) = make_scene(hop_at(100) + jitter(seed)).climbs
    assert climb.gain == pytest.approx(4e-3, abs=5e-5)
    assert not climb.climbed
    assert np.isnan(climb.speed)


# --- which part of a trajectory is the climb --------------------------------------------------


def tail_on_pile_between(start: float, end: float) -> Callable[[int], Pairs]:
    """Make further bridges: the tail is joined to the bulk from one time to another, s."""

    def pairs(frame: int) -> Pairs:
        if start <= TIME[frame] < end:
            return [(TAIL, 19)]
        return []

    return pairs


@pytest.mark.parametrize(
    ("falls", "lost"), [(0.0, 0.24e-3), (1e-3, 1e-3)], ids=["hangs meanwhile", "falls by 1 mm"]
)
def test_a_tail_that_brushes_the_pile_does_not_end_a_climb(falls: float, lost: float) -> None:
    """It touches the pile for three frames: what it rises meanwhile does not count, a fall does.

    From the last frame before to the first one after are 0.08 s: at 3 mm/s it rises 0.24 mm, which
    is not part of the gain. With a fall of 1 mm it is 0.76 mm lower after, which is taken off the
    gain as well.
    """
    rise = UP - np.where(TIME[:, None] >= 2.01, falls, 0.0)
    (climb,) = make_scene(rise, tail_on_pile_between(2.0, 2.06)).climbs
    assert climb.climbed
    assert climb.gain == pytest.approx(3e-3 * TIME[-1] - lost)


def test_a_tail_that_stays_on_the_pile_ends_a_climb() -> None:
    """For 0.3 s: after that it is another cluster, which climbs too."""
    scene = make_scene(UP, tail_on_pile_between(2.0, 2.3))
    assert scene.table["climbed"].tolist() == [True, True]


UP_TWICE = np.interp(
    TIME, [0.0, 0.8, 1.6, 3.2, 3.5, 3.52], [0.0, 2.4e-3, -0.5e-3, 4.8e-3, 0.0, 6e-3]
)[:, None]
"""Up 2.4 mm, down by more, up twice as far, down, a hop; m, shape (FRAMES, 1)."""


@pytest.fixture(scope="module")
def risen_twice() -> Scene:
    """A cluster that rises as `UP_TWICE`."""
    return make_scene(UP_TWICE)


def test_a_climb_qualifies_with_its_first_2_mm_and_begins_with_its_largest_rise(
    risen_twice: Scene,
) -> None:
    """2 mm of 2.4 mm in 0.8 s take 2/3 s; the largest rise is that from 1.6 s on."""
    (climb,) = risen_twice.climbs
    assert climb.qualified == pytest.approx(2.0 / 3.0, abs=0.02)
    assert climb.onset == pytest.approx(0.0, abs=0.02)
    assert climb.begin == pytest.approx(1.6, abs=0.02)


def test_what_comes_later_does_not_change_when_a_climb_qualified(risen_twice: Scene) -> None:
    """Records of any length agree about the time that they have in common."""
    (track,) = risen_twice.tracks
    (whole,) = risen_twice.climbs
    for frames in range(1, FRAMES):
        shorter = Track(track.frames[:frames], track.members[:frames], track.walls[:frames])
        (climb,) = table_rows(climbs_of([shorter], risen_twice.beads))
        assert climb.climbed == (TIME[frames - 1] >= whole.qualified)
        if climb.climbed:
            assert climb.onset == whole.onset
            assert climb.qualified == whole.qualified


def test_a_cluster_that_never_gains_2_mm_never_qualifies() -> None:
    """It rises a tenth as far as `UP_TWICE`."""
    (climb,) = make_scene(0.1 * UP_TWICE).climbs
    assert not climb.climbed
    assert np.isnan(climb.qualified)


def test_a_fall_ends_a_climb_at_its_top() -> None:
    """Up 6 mm in 2 s, then down at 2 mm/s."""
    (climb,) = make_scene(np.minimum(UP, 6e-3 - 2e-3 * (TIME[:, None] - 2.0))).climbs
    assert climb.climbed
    assert climb.end == pytest.approx(2.0, rel=0.02)
    assert climb.gain == pytest.approx(6e-3, rel=0.02)


def test_a_fall_does_not_count_in_the_speed_of_the_climb_before_it() -> None:
    """Up 6 mm in 2 s, then down at 2 mm/s."""
    (climb,) = make_scene(np.minimum(UP, 6e-3 - 2e-3 * (TIME[:, None] - 2.0))).climbs
    assert climb.speed == pytest.approx(3e-3, rel=0.01)


@SEEDS
@pytest.mark.parametrize(
    ("height", "begin", "end"),
    [
        pytest.param(3e-3 * np.clip(TIME - 2.0, 0.0, None), 2.0, TIME[-1], id="hangs, rises"),
        pytest.param(3e-3 * np.clip(TIME, None, 2.0), 0.0, 2.0, id="rises, hangs"),
        pytest.param(3e-3 * np.clip(TIME - 1.0, 0.0, 1.5), 1.0, 2.5, id="hangs, rises, hangs"),
        pytest.param(
            1e-3 * np.clip(1.0 - TIME, 0.0, None) + 3e-3 * np.clip(TIME - 2.0, 0.0, None),
            2.0,
            TIME[-1],
            id="sinks, hangs, rises",
        ),
    ],
)
def test_the_time_for_which_a_cluster_hangs_still_is_not_part_of_its_climb(
    height: FloatArray, begin: float, end: float, seed: int | None
) -> None:
    """At 3 mm/s a frame gains 0.06 mm; the jitter may move either end by one frame."""
    (climb,) = make_scene(height[:, None] + jitter(seed)).climbs
    assert climb.climbed
    assert climb.speed == pytest.approx(3e-3, rel=0.01)
    assert climb.begin == pytest.approx(begin, abs=0.021)
    assert climb.onset == pytest.approx(begin, abs=0.021)
    assert climb.end == pytest.approx(end, abs=0.021)
    lowest = height[round(begin / INTERVAL)]
    assert climb.gain == pytest.approx(height.max() - lowest, abs=4e-5)


# --- how clusters begin, meet, part and end ---------------------------------------------------


def meeting_in_the_middle(frame: int) -> Pairs:
    """Two pairs, joined from the middle of the drive on."""
    pairs = [(LEADER, TAIL), (22, 23)]
    if frame >= MIDDLE:
        pairs.append((TAIL, 22))
    return pairs


def parting_in_the_middle(frame: int) -> Pairs:
    """Two pairs, joined until the middle of the drive."""
    pairs = [(LEADER, TAIL), (22, 23)]
    if frame < MIDDLE:
        pairs.append((TAIL, 22))
    return pairs


def test_two_clusters_that_meet_go_on_as_one() -> None:
    def both_at_wall(frame: int) -> dict[int, int]:
        return {LEADER: SIDE, 22: SIDE}

    scene = make_scene(UP * np.ones(4), walls=both_at_wall, joined=meeting_in_the_middle)
    assert sorted(scene.frames) == [MIDDLE, FRAMES]
    ((event, _, _),) = scene.events
    assert event == "merged"
    (merged,) = [track for track in scene.tracks if track.merged_into >= 0]
    assert len(merged.frames) == MIDDLE
    assert scene.table["size"].max() == 4


def test_a_cluster_that_parts_is_followed_by_its_beads() -> None:
    """The beads of the leader keep the cluster; the others, at another wall, are a new one."""

    def at_two_walls(frame: int) -> dict[int, int]:
        return {LEADER: SIDE, 23: SIDE + 1}

    scene = make_scene(
        UP * np.array([1.0, 1.0, 1 / 3, 1 / 3]), walls=at_two_walls, joined=parting_in_the_middle
    )
    assert scene.frames == [FRAMES, FRAMES - MIDDLE]
    assert scene.events == [("split", 1, 0)]
    last_members = {track.members[-1] for track in scene.tracks}
    assert last_members == {frozenset({LEADER, TAIL}), frozenset({22, 23})}
    assert set(scene.table["wall_names"]) == {"-y", "+y"}


@pytest.mark.parametrize(
    ("freed", "let_go", "fallen", "events"),
    [
        pytest.param(
            5, range(0), range(MIDDLE, FRAMES), ["freed", "rejoined"], id="falls onto the pile"
        ),
        pytest.param(
            5, range(MIDDLE, FRAMES), range(0), ["freed", "detached"], id="leaves the wall"
        ),
        pytest.param(
            0,
            range(MIDDLE, FRAMES),
            range(MIDDLE + 3, FRAMES),
            ["rejoined"],
            id="leaves the wall, is on the pile three frames later",
        ),
        pytest.param(
            0, range(FRAMES - 3, FRAMES), range(0), [], id="leaves the wall just before the end"
        ),
    ],
)
def test_how_a_cluster_begins_and_ends(
    freed: int, let_go: range, fallen: range, events: list[str]
) -> None:
    """It is on the pile in so many first frames, off the wall in some, on the pile again in some.

    A cluster that is off the wall for the last three frames only may be there again: no event.
    """

    def on_pile(frame: int) -> Pairs:
        if frame < freed or frame in fallen:
            return [(TAIL, 19)]
        return []

    def at_wall(frame: int) -> dict[int, int]:
        if frame in let_go:
            return {}
        return {LEADER: SIDE}

    scene = make_scene(pairs=on_pile, walls=at_wall)
    assert scene.events == [(event, 0, -1) for event in events]
    (climb,) = scene.climbs
    assert climb.out_of_pile == (freed == 5)  # 0.1 s on the pile


# --- where the beads of a climb came from -----------------------------------------------------


def make_assembly(scene: Scene, joined: Callable[[int], Pairs], wall: int) -> pd.DataFrame:
    """Make the table of assembly of a scene whose leader is at a wall in all frames."""
    bridges = []
    for frame in range(FRAMES):
        pairs = [*pairwise(BULK), *joined(frame)]
        bridges.append(make_bridges(pairs, {LEADER: wall}, frame))
    return pd.DataFrame(assembly_of(scene.tracks, scene.table, scene.beads, bridges))


def third_bead_joins(frame: int) -> Pairs:
    """Bead 22 leaves the pile at 1 s and joins the tail of the pair."""
    pairs = [(LEADER, TAIL), (23, 19)]
    if TIME[frame] < 1.0:
        pairs.append((22, 19))
    else:
        pairs.append((TAIL, 22))
    return pairs


@pytest.fixture(scope="module")
def assembled() -> Scene:
    """Two beads at a wall, which bead 22 of the pile joins at 1 s; they climb from 2 s on."""
    rise = 3e-3 * np.clip(TIME[:, None] - 2.0, 0.0, None) * [1.0, 1.0, 1.0, 0.0]
    return make_scene(rise, joined=third_bead_joins)


@pytest.fixture(scope="module")
def assembly(assembled: Scene) -> pd.DataFrame:
    """One row for each bead of the climb and each frame until the climb qualifies."""
    return make_assembly(assembled, third_bead_joins, SIDE)


def test_the_beads_of_a_climb_are_listed_until_it_qualifies(
    assembled: Scene, assembly: pd.DataFrame
) -> None:
    qualified = assembled.climbs[0].qualified
    assert qualified > 2.0
    assert assembly["time"].max() == qualified
    assert set(assembly["bead"]) == {LEADER, TAIL, 22}


def test_a_bead_that_joins_a_climb_later_is_listed_in_the_bulk_until_then(
    assembly: pd.DataFrame,
) -> None:
    third = assembly[assembly["bead"] == 22]
    early = third["time"] < 1.0
    assert early.any()
    assert third["in_bulk"].tolist() == early.tolist()
    assert third["joined"].tolist() == (~early).tolist()


def test_the_neighbours_of_the_beads_of_a_climb_are_counted(assembly: pd.DataFrame) -> None:
    """The chain of beads 20, 21 and 22 in the last frame."""
    assert assembly["neighbours"].tolist()[-3:] == [1, 2, 1]


def test_the_bead_of_a_climb_with_a_bridge_to_a_wall_is_at_the_wall(assembly: pd.DataFrame) -> None:
    assert set(assembly["bead"][assembly["at_wall"]]) == {LEADER}


def test_a_bead_on_the_first_wall_of_a_vessel_without_a_floor_is_at_a_wall() -> None:
    """In a box the first wall is the floor; here it is a slanted face."""

    def at_first_wall(frame: int) -> dict[int, int]:
        return {LEADER: 0}

    scene = make_scene(UP, walls=at_first_wall, names=("60°", "-60°", "-y", "+y"))
    assembly = make_assembly(scene, pair_apart, 0)
    assert set(assembly["bead"][assembly["at_wall"]]) == {LEADER}


# --- walls ------------------------------------------------------------------------------------


CYLINDER = {"boundary.shape": "cylinder", "boundary.width": "6 mm"}


@pytest.mark.parametrize(
    ("case", "changes", "walls", "where"),
    [
        pytest.param("pile-trough", {}, {20: 0}, "on_plain_walls", id="the first face"),
        pytest.param("pile-trough", {}, {20: 1}, "on_plain_walls", id="a face"),
        pytest.param("pile-trough", {}, {20: 3}, "on_plain_walls", id="a face normal to an axis"),
        pytest.param("pile-trough", {}, {20: 1, 21: 3}, "in_corners", id="two faces"),
        pytest.param("pile-ci", {}, {20: 1}, "on_plain_walls", id="a side"),
        pytest.param("pile-ci", {}, {20: 1, 21: 3}, "in_corners", id="a corner"),
        pytest.param("pile-ci", CYLINDER, {20: 1}, "on_plain_walls", id="a cylinder"),
    ],
)
def test_a_climb_is_in_a_corner_if_two_walls_hold_it(
    case: str, changes: dict[str, Any], walls: dict[int, int], where: str
) -> None:
    """Each case maps beads of the cluster to the walls to which they have bridges."""

    def at_walls(frame: int) -> dict[int, int]:
        return walls

    names = [wall.name for wall in load_case(case, changes).boundary.walls]
    scene = make_scene(UP, walls=at_walls, names=names)
    assert scene.table["wall_names"].tolist() == [", ".join(names[wall] for wall in walls.values())]
    piles = pd.DataFrame({"beads": [BEADS], "large": [1], "driven": [TIME[-1]]})
    summary = climb_summary(piles, pd.DataFrame(scene.table).assign(pile=0))
    expected = {"on_plain_walls": 0, "in_corners": 0}
    expected[where] = 1
    for part, climbs in expected.items():
        assert summary[part]["climbs"] == climbs, part


@pytest.mark.parametrize(
    ("turn", "walls"),
    [
        pytest.param(15.0, 1, id="faces of a round vessel"),
        pytest.param(44.0, 1, id="below 45°"),
        pytest.param(46.0, 2, id="above 45°"),
        pytest.param(90.0, 2, id="corner of a box"),
        pytest.param(180.0, 2, id="two walls of a slot"),
    ],
)
def test_walls_that_turn_little_are_no_corner(turn: float, walls: int) -> None:
    """A cluster in the middle of two planes whose normals are at an angle, in degrees."""
    angle = np.radians(turn)
    planes = [
        Flat((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Flat((0.0, 0.0, 0.0), (np.cos(angle), np.sin(angle), 0.0)),
    ]
    beads = PileBeads(
        TIME,
        np.zeros((FRAMES, BEADS)),
        np.arange(BEADS) == LEADER,
        np.zeros(FRAMES),
        [],
        0,
        ["+x", "side"],
        walls=planes,
        position=np.ones((FRAMES, BEADS, 3)),
    )
    assert _walls_apart([0, 1], 3, [0, 1], beads) == walls


def bulk_and_wall_beads(wall: int, names: Sequence[str]) -> tuple[list[int], list[int]]:
    """Beads of the bulk and beads at side walls, if the leader of a free pair is at a wall."""
    bridges = make_bridges([*pairwise(BULK), (LEADER, TAIL)], {LEADER: wall})
    floor = floor_of(names)
    bulk = bulk_of(connected(BEADS, bridges.beads), bridges, floor=floor)
    at_wall = at_sides(bridges, BEADS, floor)
    return np.flatnonzero(bulk).tolist(), np.flatnonzero(at_wall).tolist()


TROUGH = ("face 1", "face 2", "-y", "+y")


def test_a_pair_on_the_first_wall_of_a_box_is_part_of_the_bulk() -> None:
    """The first wall is the floor."""
    assert bulk_and_wall_beads(0, NAMES) == ([*BULK, LEADER, TAIL], [])


def test_a_trough_has_no_floor_but_a_first_side() -> None:
    """The pair hangs on the first wall."""
    assert bulk_and_wall_beads(0, TROUGH) == (BULK, [LEADER])


@pytest.mark.parametrize("names", [NAMES, TROUGH], ids=["box", "trough"])
def test_a_pair_on_the_second_wall_of_any_vessel_hangs_on_a_side(names: Sequence[str]) -> None:
    assert bulk_and_wall_beads(1, names) == (BULK, [LEADER])


# --- the bulk ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("walls", "bulk"),
    [
        pytest.param({}, BULK, id="a pair in the air"),
        pytest.param({LEADER: 0}, [*BULK, LEADER, TAIL], id="a pair on the floor"),
    ],
)
def test_the_bulk_is_the_component_of_most_beads_and_what_is_on_the_floor(
    walls: dict[int, int], bulk: list[int]
) -> None:
    bridges = make_bridges([*pairwise(BULK), (LEADER, TAIL)], walls)
    assert np.flatnonzero(bulk_of(connected(BEADS, bridges.beads), bridges)).tolist() == bulk


@pytest.mark.parametrize(
    ("height", "index"),
    [
        pytest.param([2.0, 2.0, 0.0, 0.0], 1.0, id="all large beads above"),
        pytest.param([1.0, 2.0, 2.0, 1.0], 0.0, id="mixed"),
    ],
)
def test_the_segregation_is_1_with_all_large_beads_above(height: list[float], index: float) -> None:
    large = np.array([True, True, False, False])
    assert segregation(np.array(height), large) == pytest.approx(index)


def test_beads_of_one_size_have_no_segregation() -> None:
    assert segregation(np.ones(3), np.zeros(3, dtype=bool)) == 0.0
