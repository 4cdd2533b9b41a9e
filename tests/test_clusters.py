"""Climbs of made-up trajectories: what counts, what does not, and what becomes of clusters that meet or part."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from walkers.postprocess.clusters import (
    Beads,
    Track,
    assembly_of,
    bulk_of,
    climbs_of,
    connected,
    events_of,
    follow,
    held_clusters,
)
from walkers.postprocess.dump import BoolArray, FloatArray
from walkers.postprocess.motion import Bridges
from walkers.postprocess.piles import segregation
from walkers.postprocess.tables import Columns

BULK = list(range(20))
TIME = np.arange(0.0, 4.0, 0.02)
FRAMES = len(TIME)
SIDE = 3
NAMES = ("floor", "-x", "+x", "-y", "+y")


def bridges_of(pairs: list[tuple[int, int]], walls: dict[int, int]) -> Bridges:
    """Bridges that touch and pull, between beads and of beads to walls."""
    beads = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    ones, held = np.ones(len(beads)), np.ones(len(walls))
    ends = (np.array(list(one), dtype=np.int64) for one in (walls, walls.values()))
    return Bridges(0, beads, ones, -ones, *ends, held, -held)


def rows_of(columns: Columns) -> list[SimpleNamespace]:
    """The rows of a table."""
    return [SimpleNamespace(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)]


class Scene:
    """24 beads, 20 of them the bulk; 20 leads 21, held to the wall, and 22 and 23 stay on the bulk, unless changed."""

    def __init__(self) -> None:
        self.height = np.zeros((FRAMES, 24))
        self.height[:, BULK] = np.linspace(0.0, 4e-3, 20)
        self.height[:, 20:] = 5e-3
        self.large = np.arange(24) == 20
        self.pairs = [[(20, 21), (22, 19), (23, 19)] for _ in TIME]
        self.walls: list[dict[int, int]] = [{20: SIDE, 0: SIDE, 1: 0} for _ in TIME]

    def beads(self, height: FloatArray, surface: FloatArray | None = None, bulk: Sequence[BoolArray] = ()) -> Beads:
        return Beads(TIME, height, self.large, np.zeros(FRAMES) if surface is None else surface, bulk, 0, NAMES)

    def climbs(self) -> tuple[list[Track], list[SimpleNamespace]]:
        clusters, bulks = [], []
        for pairs, walls in zip(self.pairs, self.walls, strict=True):
            bridges = bridges_of([*pairwise(BULK), *pairs], walls)
            labels = connected(24, bridges.beads)
            bulks.append(bulk_of(labels, bridges))
            clusters.append(list(held_clusters(labels, bridges, bulks[-1])))
        beads = self.seen = self.beads(self.height, bulk=bulks)
        tracks = follow(TIME, clusters)
        self.table = climbs_of(tracks, beads)
        events = rows_of(events_of(tracks, self.table, beads))
        self.events = [(event.event, event.track, event.other) for event in events]
        return tracks, rows_of(self.table)


def test_a_rising_cluster_climbs() -> None:
    """Its leader is the bead that is mostly topmost: at the end the small one overtakes."""
    scene = Scene()
    scene.height[:, 20:22] += 3e-3 * TIME[:, None]
    scene.height[:, 21] -= 8e-4
    scene.height[-20:, 21] += 1e-3
    (track,), (climb,) = scene.climbs()
    assert climb.climbed
    assert climb.speed == pytest.approx((3e-3 * TIME[-1] + 0.5e-3) / TIME[-1], rel=1e-9)
    assert (climb.leader, climb.size, climb.large, climb.wall_names) == (20, 2, 1, "-y")
    assert len(track.frames) == FRAMES
    assert scene.events == []  # free and held from the begin to the end


def test_a_climber_is_above_the_surface_as_it_is_then() -> None:
    """The bed sinks from 3 to 1 mm, while the leader rises from 5 mm at 3 mm/s."""
    scene = Scene()
    scene.height[:, 20:22] += 3e-3 * TIME[:, None]
    (track,), _ = scene.climbs()
    beads = scene.beads(scene.height, np.linspace(3e-3, 1e-3, FRAMES))
    (climb,) = rows_of(climbs_of([track], beads))
    assert climb.height == pytest.approx(5e-3 + 3e-3 * TIME[-1])
    assert climb.above_surface == pytest.approx(4e-3 + 3e-3 * TIME[-1])


def test_the_error_of_a_speed_is_its_scatter() -> None:
    """Climbs whose speed fluctuates from frame to frame: the stated error is the scatter over many of them."""
    draw, scene = np.random.default_rng(1), Scene()
    (track,), _ = scene.climbs()
    speeds, errors = [], []
    for _ in range(200):
        height = scene.height.copy()
        height[:, 20:22] += np.cumsum(draw.normal(5e-3, 20e-3, FRAMES) * 0.02)[:, None]
        (climb,) = rows_of(climbs_of([track], scene.beads(height)))
        speeds.append(climb.speed)
        errors.append(climb.standard_error)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(speeds), rel=0.25)


def _with_others(scene: Scene) -> None:
    """The same dimer at the same height, with beads high above that come and go: these gain no height."""
    scene.height[:, 22:] = 9e-3
    scene.pairs = [[(20, 21), (22, 23), *([(21, 22)] if number % 20 < 10 else [])] for number in range(FRAMES)]


def _sinking(scene: Scene) -> None:
    scene.height[:, 20:22] += 8e-3 - 1e-3 * TIME[:, None]


def _thrown_into_the_air(scene: Scene) -> None:
    scene.height[:, 20:22] += (40e-3 * TIME - 10e-3 * TIME**2)[:, None]
    for walls in scene.walls:
        del walls[20]


def _rising_with_the_pile(scene: Scene) -> None:
    scene.height[:, 20:22] += 3e-3 * TIME[:, None]
    for pairs in scene.pairs:
        pairs.append((21, 19))  # the tail stays on the pile


def _hopping_between_frames(scene: Scene) -> None:
    scene.height[100:, 20:22] += 4e-3
    scene.height[:, 20:22] -= 1e-5 * TIME[:, None]


def _hopping_between_holds(scene: Scene) -> None:
    """Held at the begin and again a tenth of a second later, 4 mm higher."""
    for number, walls in enumerate(scene.walls):
        if number not in (0, 4):
            del walls[20]
    scene.height[4:, 20:22] += 4e-3


def _single(scene: Scene) -> None:
    scene.pairs = [[(22, 19), (23, 19), (21, 19)] for _ in TIME]
    scene.height[:, 20] += 3e-3 * TIME


@pytest.mark.parametrize(
    ("made", "gains"),
    [
        (_with_others, None),
        (_sinking, 1e-4),
        (_hopping_between_frames, None),
        (_hopping_between_holds, None),
        (_thrown_into_the_air, 0.0),
        (_rising_with_the_pile, 0.0),
        (_single, 0.0),
    ],
)
def test_what_is_no_climb(made: Callable[[Scene], None], gains: float | None) -> None:
    """Of some not even a cluster that is free and held is seen: they gain nothing."""
    scene = Scene()
    made(scene)
    tracks, climbs = scene.climbs()
    assert bool(tracks) == (gains != 0.0)
    assert not any(climb.climbed for climb in climbs)
    assert gains is None or all(climb.gain < gains for climb in climbs)


@pytest.mark.parametrize(("seconds", "tracks"), [(0.06, 1), (0.3, 2)])
def test_a_tail_that_brushes_the_pile_does_not_end_a_climb(seconds: float, tracks: int) -> None:
    scene = Scene()
    scene.height[:, 20:22] += 3e-3 * TIME[:, None]
    for number in np.flatnonzero((TIME >= 2.0) & (2.0 + seconds > TIME)):
        scene.pairs[number].append((21, 19))
    found, climbs = scene.climbs()
    assert len(found) == tracks
    assert all(climb.climbed for climb in climbs)
    if tracks == 1:
        # What it rose while it was on the pile does not count.
        assert climbs[0].gain == pytest.approx(3e-3 * (TIME[-1] - seconds - 0.02))


def test_two_that_meet_go_on_as_one() -> None:
    scene, meet = Scene(), FRAMES // 2
    scene.pairs = [[(20, 21), (22, 23), *([(21, 22)] if number >= meet else [])] for number in range(FRAMES)]
    for walls in scene.walls:
        walls[22] = SIDE
    scene.height[:, 20:] += 3e-3 * TIME[:, None]
    tracks, climbs = scene.climbs()
    assert sorted(len(track.frames) for track in tracks) == [meet, FRAMES]
    assert [kind for kind, _, _ in scene.events] == ["merged"]
    (ended,) = [track for track in tracks if track.merged_into >= 0]
    assert len(ended.frames) == meet
    assert max(climb.size for climb in climbs) == 4


def test_one_that_parts_is_followed_by_its_beads() -> None:
    scene, part = Scene(), FRAMES // 2
    scene.pairs = [[(20, 21), (22, 23), *([(21, 22)] if number < part else [])] for number in range(FRAMES)]
    for walls in scene.walls:
        walls[23] = SIDE + 1
    scene.height[:, 20:22] += 3e-3 * TIME[:, None]
    scene.height[:, 22:] += 1e-3 * TIME[:, None]
    tracks, climbs = scene.climbs()
    assert [len(track.frames) for track in tracks] == [FRAMES, FRAMES - part]
    assert scene.events == [("split", 1, 0)]
    assert {tracks[0].members[-1], tracks[1].members[-1]} == {frozenset({20, 21}), frozenset({22, 23})}
    assert {climb.wall_names for climb in climbs} == {"-y", "+y"}


@pytest.mark.parametrize(
    ("freed", "let_go", "fallen", "events"),
    [
        (5, range(0), range(FRAMES // 2, FRAMES), ["freed", "rejoined"]),
        (5, range(FRAMES // 2, FRAMES), range(0), ["freed", "detached"]),
        (0, range(FRAMES // 2, FRAMES), range(FRAMES // 2 + 3, FRAMES), ["rejoined"]),
        (0, range(FRAMES - 3, FRAMES), range(0), []),  # which may still go on
    ],
)
def test_how_a_cluster_begins_and_ends(freed: int, let_go: range, fallen: range, events: list[str]) -> None:
    """On the pile in so many first frames, off the wall in some, on the pile again in some."""
    scene = Scene()
    for number in (*range(freed), *fallen):
        scene.pairs[number].append((21, 19))
    for number in let_go:
        del scene.walls[number][20]
    _, (climb,) = scene.climbs()
    assert scene.events == [(event, 0, -1) for event in events]
    assert climb.out_of_pile == (freed > 4)  # a tenth of a second


def test_where_the_beads_of_a_climb_came_from() -> None:
    """Two on a wall; a third leaves the pile and joins them at 1 s; they climb from 2 s on."""
    scene, joins = Scene(), np.searchsorted(TIME, 1.0)
    scene.pairs = [[(20, 21), (21, 22) if now >= 1.0 else (22, 19), (23, 19)] for now in TIME]
    scene.height[:, 20:23] += 3e-3 * np.clip(TIME[:, None] - 2.0, 0.0, None)
    tracks, climbs = scene.climbs()
    at_wall = np.arange(24) == 20
    joined = [(np.array([*pairwise(BULK), *pairs], dtype=np.int32), at_wall) for pairs in scene.pairs]
    rows = rows_of(assembly_of(tracks, scene.table, scene.seen, joined))
    assert max(row.time for row in rows) == climbs[0].qualified > 2.0
    of_third = [row for row in rows if row.bead == 22]
    assert [row.in_bulk for row in of_third] == [number < joins for number in range(len(of_third))]
    assert all(row.joined != row.in_bulk for row in of_third)
    assert {row.bead for row in rows} == {20, 21, 22}
    assert {row.bead for row in rows if row.at_wall} == {20}
    assert [row.neighbours for row in rows[-3:]] == [1, 2, 1]


def test_what_comes_later_does_not_change_when_a_climb_qualified() -> None:
    """Up 2.4 mm, down by more, up twice as far, a hop: records of any length tell the same of the time they share."""
    scene = Scene()
    up = np.interp(TIME, [0.0, 0.8, 1.6, 3.2, 3.5, 3.52], [0.0, 2.4e-3, -0.5e-3, 4.8e-3, 0.0, 6e-3])
    scene.height[:, 20:22] += up[:, None]
    (track,), (whole,) = scene.climbs()
    assert whole.qualified == pytest.approx(2.0 / 3.0, abs=0.02)
    assert (whole.onset, whole.begin) == pytest.approx((0.0, 1.6), abs=0.02)
    for frames in range(1, FRAMES):
        shorter = Track(track.frames[:frames], track.members[:frames], track.walls[:frames])
        (climb,) = rows_of(climbs_of([shorter], scene.beads(scene.height)))
        assert climb.climbed == (TIME[frames - 1] >= whole.qualified)
        if climb.climbed:
            assert (climb.onset, climb.qualified) == (whole.onset, whole.qualified)
    scene.height[:, 20:22] -= 0.9 * up[:, None]
    _, (lower,) = scene.climbs()
    assert not lower.climbed
    assert np.isnan(lower.qualified)


def test_a_fall_ends_a_climb_at_its_top() -> None:
    scene = Scene()
    scene.height[:, 20:22] += np.minimum(3e-3 * TIME, 6e-3 - 2e-3 * (TIME - 2.0))[:, None]
    _, (climb,) = scene.climbs()
    assert climb.climbed
    assert climb.end == pytest.approx(2.0, abs=0.03)
    assert climb.gain == pytest.approx(6e-3, rel=0.02)


def test_the_bulk_is_what_is_on_the_floor_and_the_component_of_most_beads() -> None:
    for walls, bulk in (({}, BULK), ({20: 0}, [*BULK, 20, 21])):
        bridges = bridges_of([*pairwise(BULK), (20, 21)], walls)
        assert np.flatnonzero(bulk_of(connected(24, bridges.beads), bridges)).tolist() == bulk


def test_the_brazil_nut_index_is_one_with_all_small_beads_on_the_floor() -> None:
    large = np.array([True, True, False, False])
    assert segregation(np.array([2.0, 2.0, 0.0, 0.0]), large) == pytest.approx(1.0)
    assert segregation(np.array([1.0, 2.0, 2.0, 1.0]), large) == pytest.approx(0.0)
    assert segregation(np.ones(3), np.zeros(3, dtype=bool)) == 0.0
