"""Climbs of made-up trajectories: what counts, what does not, and what becomes of clusters that meet or part."""

from collections.abc import Callable, Sequence
from dataclasses import replace
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

BULK = list(range(20))
TIME = np.arange(0.0, 4.0, 0.02)
FRAMES = len(TIME)
MIDDLE = FRAMES // 2
SIDE = 3
NAMES = ("floor", "-x", "+x", "-y", "+y")
ON_PILE = [(22, 19), (23, 19)]
UP = 3e-3 * TIME[:, None]
"""At 3 mm/s."""


def bridges_of(pairs: list[tuple[int, int]], walls: dict[int, int]) -> Bridges:
    """Bridges that touch and pull, between beads and of beads to walls."""
    contacts = [(*pair, -1) for pair in pairs] + [(bead, -1, wall) for bead, wall in walls.items()]
    ones = np.ones(len(contacts))
    return Bridges(0, np.array(contacts), ones, -ones)


def rows_of(columns: Columns) -> list[Any]:
    """The rows of a table."""
    return [
        SimpleNamespace(**dict(zip(columns, row, strict=True)))
        for row in zip(*columns.values(), strict=True)
    ]


def seen(
    rise: npt.ArrayLike = 0.0,
    pairs: Callable[[int], list[tuple[int, int]]] = lambda frame: [],
    walls: Callable[[int], dict[int, int]] = lambda frame: {20: SIDE},
    joined: Callable[[int], list[tuple[int, int]]] = lambda frame: [(20, 21), *ON_PILE],
    names: Sequence[str] = NAMES,
) -> Any:
    """24 beads, 20 of them the bulk; 20 is large and leads 21, held to the wall, 22 and 23 stay on the bulk.

    Unless changed, by frame: ``joined`` pairs, further ``pairs``, ``walls`` of beads. ``rise`` is of 20 to 23 with four
    columns, else of 20 and 21.
    """
    height, rise = np.zeros((FRAMES, 24)), np.asarray(rise)
    height[:, BULK], height[:, 20:] = np.linspace(0.0, 4e-3, 20), 5e-3
    height[:, 20 : 24 if rise.ndim == 2 and rise.shape[1] == 4 else 22] += rise
    held, bulks = [], []
    for frame in range(FRAMES):
        bridges = bridges_of(
            [*pairwise(BULK), *joined(frame), *pairs(frame)], {0: SIDE, 1: 0, **walls(frame)}
        )
        labels = connected(24, bridges.beads)
        floor = floor_of(names)
        bulks.append(bulk_of(labels, bridges, floor=floor))
        held.append(list(clusters.held_clusters(labels, bridges, bulks[-1], floor)))
    beads = PileBeads(TIME, height, np.arange(24) == 20, np.zeros(FRAMES), bulks, 0, names)
    tracks = clusters.follow(TIME, held)
    table = climbs_of(tracks, beads)
    events = [
        (one.event, one.track, one.other)
        for one in rows_of(clusters.events_of(tracks, table, beads))
    ]
    return SimpleNamespace(
        beads=beads, tracks=tracks, table=table, climbs=rows_of(table), events=events
    )


def test_a_rising_cluster_climbs() -> None:
    """Its leader is the bead that is mostly topmost: at the end the small one overtakes."""
    tail = np.where(np.arange(FRAMES) < FRAMES - 20, -8e-4, 2e-4)
    scene = seen(UP + np.stack([np.zeros(FRAMES), tail], axis=1))
    (track,), (climb,) = scene.tracks, scene.climbs
    assert climb.climbed
    assert climb.speed == pytest.approx((3e-3 * TIME[-1] + 0.5e-3) / TIME[-1], rel=1e-9)
    assert (climb.leader, climb.size, climb.large, climb.wall_names) == (20, 2, 1, "-y")
    assert len(track.frames) == FRAMES
    assert scene.events == []  # free and held from the begin to the end
    # It is above the surface as it is then: the bed sinks from 3 to 1 mm.
    (climb,) = rows_of(
        climbs_of([track], replace(scene.beads, surface=np.linspace(3e-3, 1e-3, FRAMES)))
    )
    assert (
        climb.above_surface
        == pytest.approx(climb.height - 1e-3)
        == pytest.approx(4e-3 + 3e-3 * TIME[-1])
    )


def test_the_error_of_a_speed_is_its_scatter() -> None:
    """Climbs whose speed fluctuates from frame to frame: the stated error is the scatter over many of them."""
    draw, scene, found = np.random.default_rng(1), seen(), []
    for _ in range(200):
        height = scene.beads.height.copy()
        height[:, 20:22] += np.cumsum(draw.normal(5e-3, 20e-3, FRAMES) * 0.02)[:, None]
        (climb,) = rows_of(climbs_of(scene.tracks, replace(scene.beads, height=height)))
        found.append((climb.speed, climb.standard_error))
    speeds, errors = np.transpose(found)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(speeds), rel=0.25)


def _hop(frame: int) -> npt.NDArray[np.float64]:
    return 4e-3 * (np.arange(FRAMES) >= frame)[:, None]


NONE: dict[str, tuple[float | None, dict[str, Any]]] = {
    "beads high above come and go at the same height": (
        None,
        {
            "rise": np.array([0.0, 0.0, 4e-3, 4e-3]) * np.ones((FRAMES, 1)),
            "joined": lambda frame: [(20, 21), (22, 23), *([(21, 22)] if frame % 20 < 10 else [])],
        },
    ),
    "it sinks": (1e-4, {"rise": 8e-3 - UP / 3.0}),
    "it hops between two frames": (None, {"rise": _hop(100) - UP / 300.0}),
    "it is held at the begin, and 4 mm higher a tenth of a second later": (
        None,
        {
            "rise": 4e-3 * (np.arange(FRAMES) >= 4)[:, None],
            "walls": lambda frame: {20: SIDE} if frame in (0, 4) else {},
        },
    ),
    "it is thrown into the air": (
        0.0,
        {"rise": (40e-3 * TIME - 10e-3 * TIME**2)[:, None], "walls": lambda frame: {}},
    ),
    "it rises with the pile": (0.0, {"rise": UP, "pairs": lambda frame: [(21, 19)]}),
    "it is a single bead": (
        0.0,
        {"rise": UP * [1.0, 0.0], "joined": lambda frame: [*ON_PILE, (21, 19)]},
    ),
}


@pytest.mark.parametrize("why", NONE)
def test_what_is_no_climb(why: str) -> None:
    """Of some not even a cluster that is free and held is seen: they gain nothing."""
    gains, changes = NONE[why]
    scene = seen(**changes)
    assert bool(scene.tracks) == (gains != 0.0)
    assert not any(climb.climbed for climb in scene.climbs)
    assert gains is None or all(climb.gain < gains for climb in scene.climbs)


@pytest.mark.parametrize(
    ("seconds", "falls", "tracks"), [(0.06, 0.0, 1), (0.06, 1e-3, 1), (0.3, 0.0, 2)]
)
def test_a_tail_that_brushes_the_pile_does_not_end_a_climb(
    seconds: float, falls: float, tracks: int
) -> None:
    up = UP - falls * (TIME[:, None] >= 2.01)
    scene = seen(up, lambda frame: [(21, 19)] if 2.0 <= TIME[frame] < 2.0 + seconds else [])
    assert len(scene.tracks) == tracks
    assert all(climb.climbed for climb in scene.climbs)
    if tracks == 1:  # what it rose while it was on the pile does not count, what it fell does
        rose = 3e-3 * (seconds + 0.02)
        assert scene.climbs[0].gain == pytest.approx(
            3e-3 * TIME[-1] - rose + min(rose - falls, 0.0)
        )


def test_two_that_meet_go_on_as_one_and_one_that_parts_is_followed_by_its_beads() -> None:
    def joined(frame: int) -> list[tuple[int, int]]:
        return [(20, 21), (22, 23), *([(21, 22)] if (frame >= MIDDLE) == meets else [])]

    meets, four = True, UP * np.ones(4)
    scene = seen(four, walls=lambda frame: {20: SIDE, 22: SIDE}, joined=joined)
    assert sorted(len(track.frames) for track in scene.tracks) == [MIDDLE, FRAMES]
    assert [kind for kind, _, _ in scene.events] == ["merged"]
    (ended,) = [track for track in scene.tracks if track.merged_into >= 0]
    assert len(ended.frames) == MIDDLE
    assert max(climb.size for climb in scene.climbs) == 4
    meets = False
    scene = seen(
        four * [1.0, 1.0, 1 / 3, 1 / 3], walls=lambda frame: {20: SIDE, 23: SIDE + 1}, joined=joined
    )
    assert [len(track.frames) for track in scene.tracks] == [FRAMES, FRAMES - MIDDLE]
    assert scene.events == [("split", 1, 0)]
    assert {track.members[-1] for track in scene.tracks} == {
        frozenset({20, 21}),
        frozenset({22, 23}),
    }
    assert {climb.wall_names for climb in scene.climbs} == {"-y", "+y"}


@pytest.mark.parametrize(
    ("freed", "let_go", "fallen", "events"),
    [
        (5, range(0), range(MIDDLE, FRAMES), ["freed", "rejoined"]),
        (5, range(MIDDLE, FRAMES), range(0), ["freed", "detached"]),
        (0, range(MIDDLE, FRAMES), range(MIDDLE + 3, FRAMES), ["rejoined"]),
        (0, range(FRAMES - 3, FRAMES), range(0), []),  # which may still go on
    ],
)
def test_how_a_cluster_begins_and_ends(
    freed: int, let_go: range, fallen: range, events: list[str]
) -> None:
    """On the pile in so many first frames, off the wall in some, on the pile again in some."""
    scene = seen(
        pairs=lambda frame: [(21, 19)] if frame < freed or frame in fallen else [],
        walls=lambda frame: {} if frame in let_go else {20: SIDE},
    )
    assert scene.events == [(event, 0, -1) for event in events]
    assert [climb.out_of_pile for climb in scene.climbs] == [freed > 4]  # a tenth of a second


def test_where_the_beads_of_a_climb_came_from() -> None:
    """Two on a wall; a third leaves the pile and joins them at 1 s; they climb from 2 s on."""
    pairs = [[(20, 21), (21, 22) if now >= 1.0 else (22, 19), (23, 19)] for now in TIME]
    scene = seen(
        3e-3 * np.clip(TIME[:, None] - 2.0, 0.0, None) * [1.0, 1.0, 1.0, 0.0],
        joined=pairs.__getitem__,
    )
    bridges = [
        replace(bridges_of([*pairwise(BULK), *some], {20: SIDE}), frame=n)
        for n, some in enumerate(pairs)
    ]
    rows = rows_of(assembly_of(scene.tracks, scene.table, scene.beads, bridges))
    assert max(row.time for row in rows) == scene.climbs[0].qualified > 2.0
    of_third = [row for row in rows if row.bead == 22]
    assert [row.in_bulk for row in of_third] == [row.time < 1.0 for row in of_third]
    assert all(row.joined != row.in_bulk for row in of_third)
    assert {row.bead for row in rows} == {20, 21, 22}
    assert {row.bead for row in rows if row.at_wall} == {20}
    assert [row.neighbours for row in rows[-3:]] == [1, 2, 1]


def test_a_bead_on_the_first_wall_of_a_vessel_without_a_floor_is_at_a_wall() -> None:
    names = ("60°", "-60°", "-y", "+y")
    pairs = [[(20, 21), *ON_PILE]] * FRAMES
    scene = seen(UP, walls=lambda frame: {20: 0}, names=names)
    bridges = [
        replace(bridges_of([*pairwise(BULK), *some], {20: 0}), frame=n)
        for n, some in enumerate(pairs)
    ]
    rows = rows_of(assembly_of(scene.tracks, scene.table, scene.beads, bridges))
    assert {row.bead for row in rows if row.at_wall} == {20}


def test_what_comes_later_does_not_change_when_a_climb_qualified() -> None:
    """Up 2.4 mm, down by more, up twice as far, a hop: records of any length tell the same of the time they share."""
    up = np.interp(
        TIME, [0.0, 0.8, 1.6, 3.2, 3.5, 3.52], [0.0, 2.4e-3, -0.5e-3, 4.8e-3, 0.0, 6e-3]
    )[:, None]
    scene = seen(up)
    (track,), (whole,) = scene.tracks, scene.climbs
    assert whole.qualified == pytest.approx(2.0 / 3.0, abs=0.02)
    assert (whole.onset, whole.begin) == pytest.approx((0.0, 1.6), abs=0.02)
    for frames in range(1, FRAMES):
        shorter = Track(track.frames[:frames], track.members[:frames], track.walls[:frames])
        (climb,) = rows_of(climbs_of([shorter], scene.beads))
        assert climb.climbed == (TIME[frames - 1] >= whole.qualified)
        if climb.climbed:
            assert (climb.onset, climb.qualified) == (whole.onset, whole.qualified)
    (lower,) = seen(0.1 * up).climbs
    assert not lower.climbed
    assert np.isnan(lower.qualified)


def test_a_fall_ends_a_climb_at_its_top() -> None:
    (climb,) = seen(np.minimum(UP, 6e-3 - 2e-3 * (TIME[:, None] - 2.0))).climbs
    assert climb.climbed
    assert (climb.end, climb.gain) == pytest.approx((2.0, 6e-3), rel=0.02)


def test_a_fall_does_not_count_in_the_speed_of_the_climb_before_it() -> None:
    """Up 6 mm in 2 s, then down at 2 mm/s."""
    (climb,) = seen(np.minimum(UP, 6e-3 - 2e-3 * (TIME[:, None] - 2.0))).climbs
    assert climb.speed == pytest.approx(3e-3, rel=0.01)


def _jitter(seed: int) -> npt.NDArray[np.float64]:
    """Heights that differ from frame to frame as those of clusters that hang on a shaken wall."""
    return np.random.default_rng(seed).normal(0.0, 5e-6, (FRAMES, 1))


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
@pytest.mark.parametrize(
    ("height", "begin", "end"),
    [
        (3e-3 * np.clip(TIME - 2.0, 0.0, None), 2.0, TIME[-1]),
        (3e-3 * np.clip(TIME, None, 2.0), 0.0, 2.0),
        (3e-3 * np.clip(TIME - 1.0, 0.0, 1.5), 1.0, 2.5),
        (
            1e-3 * np.clip(1.0 - TIME, 0.0, None) + 3e-3 * np.clip(TIME - 2.0, 0.0, None),
            2.0,
            TIME[-1],
        ),
    ],
    ids=["hangs, rises", "rises, hangs", "hangs, rises, hangs", "sinks, hangs, rises"],
)
def test_the_time_for_which_a_cluster_hangs_still_is_not_part_of_its_climb(
    height: npt.NDArray[np.float64], begin: float, end: float, seed: int | None
) -> None:
    """At 3 mm/s a frame gains 0.06 mm; the jitter may move either end by one frame."""
    jitter = 0.0 if seed is None else _jitter(seed)
    (climb,) = seen(height[:, None] + jitter).climbs
    assert climb.climbed
    assert climb.speed == pytest.approx(3e-3, rel=0.01)
    assert (climb.begin, climb.onset, climb.end) == pytest.approx((begin, begin, end), abs=0.021)
    lowest = height[round(begin / 0.02)]
    assert climb.gain == pytest.approx(height.max() - lowest, abs=4e-5)


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_a_hop_between_two_heights_at_which_a_cluster_hangs_is_no_climb(seed: int | None) -> None:
    jitter = 0.0 if seed is None else _jitter(seed)
    (climb,) = seen(_hop(100) + jitter).climbs
    assert climb.gain == pytest.approx(4e-3, abs=5e-5)
    assert not climb.climbed
    assert np.isnan(climb.speed)


@pytest.mark.parametrize(("frames", "climbed"), [(2, False), (3, True), (4, True)])
def test_a_rise_through_three_frames_is_a_climb(frames: int, climbed: bool) -> None:
    """3 mm, from one frame to the next or through one or two in between."""
    height = np.interp(np.arange(FRAMES), [100, 100 + frames - 1], [0.0, 3e-3])
    (climb,) = seen(height[:, None]).climbs
    assert climb.climbed == climbed
    assert climb.gain == pytest.approx(3e-3)


@pytest.mark.parametrize(("rise", "climbed"), [(1.99e-3, False), (2.01e-3, True)])
def test_a_rise_of_2_mm_is_a_climb(rise: float, climbed: bool) -> None:
    (climb,) = seen(np.clip(UP, None, rise)).climbs
    assert climb.climbed == climbed
    assert climb.gain == pytest.approx(rise)


@pytest.mark.parametrize(
    ("case", "changes", "walls", "where"),
    [
        ("pile-trough", {}, [0], "on_plain_walls"),
        ("pile-trough", {}, [1], "on_plain_walls"),
        ("pile-trough", {}, [3], "on_plain_walls"),
        ("pile-trough", {}, [1, 3], "in_corners"),
        ("pile-ci", {}, [1], "on_plain_walls"),
        ("pile-ci", {}, [1, 3], "in_corners"),
        (
            "pile-ci",
            {"boundary.shape": "cylinder", "boundary.width": "6 mm"},
            [1],
            "on_plain_walls",
        ),
    ],
    ids=[
        "the first face",
        "a face",
        "a face normal to an axis",
        "two faces",
        "a side",
        "a corner",
        "a cylinder",
    ],
)
def test_a_climb_is_in_a_corner_if_two_walls_hold_it(
    case: str, changes: dict[str, Any], walls: list[int], where: str
) -> None:
    names = [wall.name for wall in load_case(case, changes).boundary.walls]
    held = dict(zip((20, 21), walls, strict=False))
    scene = seen(UP, walls=lambda frame: held, names=names)
    assert scene.table["wall_names"].tolist() == [", ".join(names[wall] for wall in walls)]
    piles = pd.DataFrame({"beads": [24], "large": [1], "driven": [TIME[-1]]})
    found = climb_summary(piles, pd.DataFrame(scene.table).assign(pile=0))
    expected = {"on_plain_walls": 0, "in_corners": 0, where: 1}
    assert {part: found[part]["climbs"] for part in expected} == expected


def test_a_trough_has_no_floor_but_a_first_side() -> None:
    """A bead that is held by the first wall: in a box it lies on the floor, in a trough it hangs on a side."""
    bridges = bridges_of([*pairwise(BULK), (20, 21)], {20: 0})
    labels = connected(24, bridges.beads)
    on_floor, on_side = floor_of(NAMES), floor_of(("face 1", "face 2", "-y", "+y"))
    assert np.flatnonzero(bulk_of(labels, bridges, floor=on_floor)).tolist() == [*BULK, 20, 21]
    assert np.flatnonzero(bulk_of(labels, bridges, floor=on_side)).tolist() == BULK
    assert not at_sides(bridges, 24, on_floor).any()
    assert np.flatnonzero(at_sides(bridges, 24, on_side)).tolist() == [20]
    # The second wall of both is a side.
    aside = bridges_of([*pairwise(BULK), (20, 21)], {20: 1})
    for floor in (on_floor, on_side):
        assert np.flatnonzero(bulk_of(labels, aside, floor=floor)).tolist() == BULK
        assert np.flatnonzero(at_sides(aside, 24, floor)).tolist() == [20]


def test_the_bulk_and_its_segregation() -> None:
    """The bulk is what is on the floor and the component of most beads; the index is 1 with all small ones below."""
    for walls, bulk in (({}, BULK), ({20: 0}, [*BULK, 20, 21])):
        bridges = bridges_of([*pairwise(BULK), (20, 21)], walls)
        assert np.flatnonzero(bulk_of(connected(24, bridges.beads), bridges)).tolist() == bulk
    large = np.array([True, True, False, False])
    assert segregation(np.array([2.0, 2.0, 0.0, 0.0]), large) == pytest.approx(1.0)
    assert segregation(np.array([1.0, 2.0, 2.0, 1.0]), large) == pytest.approx(0.0)
    assert segregation(np.ones(3), np.zeros(3, dtype=bool)) == 0.0


@pytest.mark.parametrize(
    ("turn", "walls"),
    [(15.0, 1), (44.0, 1), (46.0, 2), (90.0, 2), (180.0, 2)],
    ids=[
        "faces of a round vessel",
        "below 45°",
        "above 45°",
        "corner of a box",
        "two walls of a slot",
    ],
)
def test_walls_that_turn_little_are_no_corner(turn: float, walls: int) -> None:
    """A cluster in the middle of two planes whose normals are at an angle."""
    angle = np.radians(turn)
    planes = [
        Flat((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Flat((0.0, 0.0, 0.0), (np.cos(angle), np.sin(angle), 0.0)),
    ]
    beads = PileBeads(
        TIME,
        np.zeros((FRAMES, 24)),
        np.arange(24) == 20,
        np.zeros(FRAMES),
        [],
        0,
        ["+x", "side"],
        walls=planes,
        position=np.ones((FRAMES, 24, 3)),
    )
    assert _walls_apart([0, 1], 3, [0, 1], beads) == walls
