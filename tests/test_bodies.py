"""Bodies on boundaries under drives, by the real engine: how they stand, and how fast they walk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from math import cos, dist, pi, radians, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.conftest import REFERENCE, make_case
from walkers import Run
from walkers.arrays import FloatArray
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.loads import contact_loads
from walkers.inputs.resolving.standing import starting_groups
from walkers.inputs.tables.bodies import Walkers
from walkers.inputs.tables.boundary import Boundary
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.gait import postures
from walkers.postprocess.measure.meetings import TrayCourse, collective
from walkers.postprocess.measure.motion import Group, read_motion
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.figures import figures_of
from walkers.runner.binary import find_engine
from walkers.runner.launch import launch
from walkers.runner.run_directory import write_deck
from walkers.templates.deck import Deck, render_deck
from walkers.templates.placement import Bead, place
from walkers.theory.prediction import motion_of

RunCase = Callable[..., Path]
ReadTrajectory = Callable[..., Group]
FIG1B: dict[str, Any] = {
    "beads": {"material": "ruby"},
    "liquid": {"name": "Si AK5"},
    "boundary": {"material": "chromium-coated glass"},
    "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
}
SIZES = {"L": "0.3 mm", "m": "0.21 mm", "s": "0.2 mm"}
# A dimer's speed is that of 40 cycles, 20 of them to settle, to a thousandth.
BRIEF = {"cycles": 20, "settling_cycles": 12}
FIG1B_SPEED = 1.459e-3
"""The shipped walker's, as measured, m/s; with half and twice the time step it is within 0.2 %.

Without rolling friction and with contacts ten times as stiff, engine and theory have 1.501e-3.
"""
STRAIGHT_START = {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0}
"""One walker that starts on the axis, at the gap of equilibrium."""
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


def make_cluster(arrangement: str, sizes: str, **start: Any) -> dict[str, Any]:
    """A table of ``[[clusters]]`` with beads of `SIZES`, such as ``Lss``."""
    radii = [SIZES[size] for size in sizes]
    return {"arrangement": arrangement, "radii": radii, "replicates": 2, **start}


def make_dimers(replicates: int, **start: Any) -> dict[str, Any]:
    """A table ``[dimers]`` with the beads of Fig. 1b."""
    return {"radii": ["0.3 mm", "0.2 mm"], "replicates": replicates, **start}


def case_of_tables(*clusters: dict[str, Any], **tables: Any) -> Case:
    """A case with the conditions of Fig. 1b and other walkers."""
    return build_case({**FIG1B, "clusters": list(clusters), **tables}, name="cluster")


def make_fig1b(**changes: Any) -> Case:
    """The shipped case of Fig. 1b with a single walker, which walks for 20 cycles."""
    start: dict[str, Any] = {"dimers.facing": "right"}
    for key, value in STRAIGHT_START.items():
        start[f"dimers.{key}"] = value
    return load_case("fig1b", {**start, "run.cycles": 20, "run.settling_cycles": 8, **changes})


# --- how walkers stand --------------------------------------------------------------------------
@dataclass
class StandingCluster:
    """The first cluster of a case as it is placed, with the overlaps that carry its load (m)."""

    kind: Walkers
    beads: list[Bead]
    floor_overlaps: list[float]
    pair_overlaps: dict[tuple[int, int], float]

    def pairs(self) -> list[tuple[int, int]]:
        """All pairs of beads, by their numbers in the cluster, touching or not."""
        return list(combinations(range(len(self.beads)), 2))

    def distance(self, pair: tuple[int, int]) -> float:
        """Distance between the centres of two beads, m."""
        return dist(self.beads[pair[0]].centre, self.beads[pair[1]].centre)

    def radii(self, pair: tuple[int, int]) -> float:
        """Sum of the radii of two beads, m."""
        return self.beads[pair[0]].radius + self.beads[pair[1]].radius


@pytest.fixture(params=["chain Lss", "fan Lsss", "ring Lsss", "diamond LsLs", "diamond LsLL"])
def standing_cluster(request: pytest.FixtureRequest) -> StandingCluster:
    arrangement, sizes = request.param.split()
    case = case_of_tables(make_cluster(arrangement, sizes, gap_spread=0.0))
    kind = case.walkers[0]
    overlaps = [load.overlap for load in contact_loads(case, kind)]
    scene, (first, _) = place((case,))
    bead_of = {bead.id: bead for bead in scene.beads}
    count = len(sizes)
    return StandingCluster(
        kind,
        [bead_of[number] for number in first.beads],
        overlaps[:count],
        dict(zip(kind.pairs, overlaps[count:], strict=True)),
    )


def test_beads_of_a_cluster_overlap_the_floor_by_what_carries_their_load(
    standing_cluster: StandingCluster,
) -> None:
    overlaps = [bead.radius - bead.centre[2] for bead in standing_cluster.beads]
    assert overlaps == pytest.approx(standing_cluster.floor_overlaps, rel=1e-6)


def test_touching_beads_of_a_cluster_overlap_by_what_carries_their_load(
    standing_cluster: StandingCluster,
) -> None:
    for pair, expected in standing_cluster.pair_overlaps.items():
        overlap = standing_cluster.radii(pair) - standing_cluster.distance(pair)
        assert overlap == pytest.approx(expected, rel=1e-4)


def test_beads_of_a_cluster_that_its_arrangement_keeps_apart_do_not_touch(
    standing_cluster: StandingCluster,
) -> None:
    for pair in standing_cluster.pairs():
        if pair not in standing_cluster.pair_overlaps:
            assert standing_cluster.distance(pair) > standing_cluster.radii(pair)


def test_a_cluster_is_as_long_as_its_beads_are_apart(standing_cluster: StandingCluster) -> None:
    """The largest extent of two beads in the plane, between their far sides."""
    extents = []
    for first, second in standing_cluster.pairs():
        x, y, _ = np.subtract(
            standing_cluster.beads[first].centre, standing_cluster.beads[second].centre
        )
        extents.append(np.hypot(x, y) + standing_cluster.radii((first, second)))
    assert standing_cluster.kind.length == pytest.approx(max(extents), rel=2e-3)


SPOKES_OF_SEVEN = [(0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (0, 6)]
RIM_OF_SEVEN = [(1, 2), (2, 3), (3, 4), (4, 5), (5, 6)]


@pytest.mark.parametrize(
    ("arrangement", "sizes", "pairs"),
    [
        ("ring", "ssss", [(0, 1), (1, 2), (2, 3), (0, 3)]),
        ("fan", "sssssss", SPOKES_OF_SEVEN + RIM_OF_SEVEN),
    ],
)
def test_pairs_of_beads_are_numbered_along_the_arrangement(
    arrangement: str, sizes: str, pairs: list[tuple[int, int]]
) -> None:
    """The last pair closes a ring, but not a fan, even with beads all around its first one."""
    kind = case_of_tables(make_cluster(arrangement, sizes)).walkers[0]
    assert list(kind.pairs) == pairs


@pytest.mark.parametrize(
    ("sizes", "heading"),
    [
        pytest.param("Lss", (1.0, -0.5, -0.5), id="large first"),
        pytest.param("sLs", (1.0, 0.0, -1.0), id="large in the middle"),
        pytest.param("sss", (1.0, 0.0, -1.0), id="equal"),
    ],
)
def test_a_chain_heads_to_its_large_bead(sizes: str, heading: tuple[float, ...]) -> None:
    """From the mean of the small beads to the large one; a symmetric chain heads to its first bead.

    The numbers are the weights of the beads in the vector of the heading.
    """
    kind = case_of_tables(make_cluster("chain", sizes)).walkers[0]
    assert kind.toward_large == pytest.approx(heading, abs=1e-12)


def test_a_chain_with_its_large_bead_about_in_the_middle_heads_to_its_front() -> None:
    """The centroids of the large bead and of the small ones are a fiftieth of its length apart."""
    kind = case_of_tables(make_cluster("chain", "sLm")).walkers[0]
    assert kind.toward_large == kind.front


CLIMBER = read_toml(shipped("case")["climber-dimer"])
CLIMBER_FACING_RIGHT = {**CLIMBER, "dimers": {**CLIMBER["dimers"], "facing": "right"}}
CHAIN_OF_TWO = {**REFERENCE, "clusters": [make_cluster("chain", "Ls", **STRAIGHT_START)]}
del CHAIN_OF_TWO["dimers"]
DRIVE_AS_HARMONIC = {**REFERENCE, "drive": {"harmonics": [{**REFERENCE["drive"], "axis": "x"}]}}
EVERYTHING_BY_DIAMETERS = {
    **EVERYTHING,
    "dimers": {"diameters": ["1 mm", "0.6 mm"], "replicates": 1},
    "mixture": {
        "small_diameters": ["0.6 mm", "0.63 mm"],
        "large_diameters": ["1 mm", "1.18 mm"],
        "count": 20,
    },
    "placed": [{"diameter": "0.8 mm", "at": EVERYTHING["placed"][0]["at"]}],
}
SAME_RUN = [
    pytest.param(CLIMBER, CLIMBER_FACING_RIGHT, id="a climber faces up the wall"),
    pytest.param(EVERYTHING, EVERYTHING_BY_DIAMETERS, id="diameters for radii"),
]
"""Tables of a case, and others that say the same."""
SAME_DECK = [
    *SAME_RUN,
    pytest.param(REFERENCE, CHAIN_OF_TWO, id="a dimer is a chain of two"),
    pytest.param(REFERENCE, DRIVE_AS_HARMONIC, id="a sine is a harmonic"),
]


@pytest.mark.parametrize(("tables", "same_tables"), SAME_DECK)
def test_other_words_give_the_same_deck(
    tables: dict[str, Any], same_tables: dict[str, Any]
) -> None:
    deck = render_deck(build_case(tables))
    same_deck = render_deck(build_case(same_tables))
    assert same_deck.text == deck.text
    assert same_deck.files == deck.files


@pytest.mark.parametrize(("tables", "same_tables"), SAME_RUN)
def test_other_words_name_the_same_run(tables: dict[str, Any], same_tables: dict[str, Any]) -> None:
    assert build_case(same_tables).determinants() == build_case(tables).determinants()


@pytest.mark.parametrize("count", [2, 3, 4, 6, 9, 12, 16])
def test_neighbours_on_a_tray_face_opposite_ways(count: int) -> None:
    """Along the rows and across them."""
    case = case_of_tables(dimers=make_dimers(count, meet=True))
    _, tray = place((case,))
    neighbours = []
    for first, second in combinations(tray, 2):
        if dist(first.origin, second.origin) < 1.1 * case.walkers[0].spacing:
            neighbours.append((first.facing, second.facing))
    assert len(neighbours) >= count - 1
    for facing, opposite in neighbours:
        assert facing == -opposite


@pytest.mark.parametrize("count", [2, 3, 4, 6, 9, 12, 16])
@pytest.mark.parametrize(
    "start",
    [
        pytest.param({"meet": True, "angle_spread": "180 deg"}, id="any direction"),
        pytest.param({"meet": True, "facing": "right"}, id="a stated direction"),
        pytest.param({}, id="walkers that do not meet"),
    ],
)
def test_rows_of_a_tray_are_not_shifted_without_opposite_neighbours(
    count: int, start: dict[str, Any]
) -> None:
    assert case_of_tables(dimers=make_dimers(count, **start)).shifted_rows == 0


@pytest.mark.parametrize(
    ("shape", "sizes", "walls"),
    [
        ("channel", {"width": 4e-3, "height": 4e-3}, 3),
        ("groove", {"opening": radians(60.0)}, 2),
        ("box", {"width": 4e-3, "height": 4e-3}, 5),
        ("octagon", {"width": 4e-3, "height": 4e-3}, 9),
    ],
)
def test_a_flat_wall_is_named_by_the_side_on_which_it_stands(
    shape: str, sizes: dict[str, float], walls: int
) -> None:
    """The wall +x−y of an octagon is seen from the middle where x is positive and y negative."""
    boundary = Boundary(shape=shape, material="glass", **sizes)
    normals = {wall.name: wall.normal for wall in boundary.walls}
    assert len(normals) == walls
    normals.pop("floor", None)
    sign = {1.0: "-", 0.0: "", -1.0: "+"}  # a normal points inward, from the side of its wall
    for name, (x, y, _) in normals.items():
        expected = ""
        for axis, component in {"x": x, "y": y}.items():
            if component:
                expected += sign[float(np.sign(component))] + axis
        assert name == expected


def test_a_bead_in_a_groove_rests_on_both_walls() -> None:
    """In a groove of 60° a bead of 0.3 mm rests at R / sin(30°) = 0.6 mm, R from either wall."""
    groove = Boundary(shape="groove", material="glass", opening=radians(60.0))
    height = groove.geometry.rest_height(3e-4)
    assert height == pytest.approx(6e-4)
    for wall in groove.walls:
        assert np.dot(wall.normal, (0.0, 0.0, height)) == pytest.approx(3e-4)


def test_a_mixture_is_poured_from_above_the_walkers() -> None:
    """The large bead of the dimer, 1 mm across, is higher than the placed one of 0.8 mm."""
    groups = {number: group.beads for number, group in starting_groups(build_case(EVERYTHING))}
    dimer, poured, placed = groups[0], groups[1], groups[2]
    assert max(bead.z + bead.radius for bead in dimer) == pytest.approx(1e-3, rel=1e-3)
    assert max(bead.z + bead.radius for bead in placed) == pytest.approx(0.8e-3, rel=1e-3)
    assert min(bead.z - bead.radius for bead in poured) > 1e-3


# --- drives and gravity -------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("frequency", "step", "samples"), [("60 Hz", "auto", 7), ("83.7 Hz", "1.7 us", 20)]
)
def test_a_cycle_is_a_whole_multiple_of_the_sampling_interval(
    frequency: str, step: str, samples: int
) -> None:
    case = make_case(
        drive={"frequency": frequency}, run={"time_step": step, "samples_per_cycle": samples}
    )
    cycle = case.run.steps_per_cycle * case.run.time_step
    assert case.run.steps_per_cycle % samples == 0
    assert cycle * case.excitation.frequency == pytest.approx(1.0, rel=1e-14)


def test_the_time_step_is_shortened_for_whole_cycles() -> None:
    """1.7 µs is no whole part of a cycle of 1/83.7 s; the step used is at most as long."""
    case = make_case(
        drive={"frequency": "83.7 Hz"}, run={"time_step": "1.7 us", "samples_per_cycle": 20}
    )
    assert case.run.time_step <= 1.7e-6 * (1.0 + 1e-12)


def acceleration_of(waveform: str, turn: FloatArray) -> FloatArray:
    """The sum of the harmonics of a waveform of 4 g at 80 Hz, m/s², at parts of a cycle."""
    total = np.zeros_like(turn)
    for harmonic in make_case(drive={"waveform": waveform}).excitation.harmonics:
        phase = 2.0 * pi * harmonic.frequency * turn / 80.0 + harmonic.phase
        total += harmonic.peak_acceleration * np.sin(phase)
    return total


PEAK = 4.0 * 9.8
"""4 g, m/s²."""


def test_a_triangle_is_the_sum_of_its_harmonics() -> None:
    """It rises from -4 g to 4 g in half a cycle and falls in the other half."""
    turn = np.linspace(-0.4, 0.4, 321)
    expected = PEAK * 2.0 / pi * np.arcsin(np.sin(2.0 * pi * turn))
    np.testing.assert_allclose(acceleration_of("triangle", turn), expected, atol=0.045 * PEAK)


def test_a_sawtooth_is_the_sum_of_its_harmonics() -> None:
    """It rises from -4 g to 4 g in a cycle and then jumps; near the jump the sum overshoots."""
    turn = np.linspace(-0.4, 0.4, 321)
    expected = PEAK * 2.0 * turn
    np.testing.assert_allclose(acceleration_of("sawtooth", turn), expected, atol=0.12 * PEAK)


TILTS = [(0.0, 0.0), (30.0, 0.0), (90.0, 0.0), (30.0, 90.0), (90.0, 180.0)]
"""Tilt of a plane and the direction that is uphill, in degrees."""


@pytest.mark.parametrize(("tilt", "uphill"), TILTS)
def test_gravity_on_a_plane(tilt: float, uphill: float) -> None:
    """In the frame of the plane: g sin(tilt) downhill and g cos(tilt) into it."""
    plane = Boundary(material="glass", tilt=radians(tilt), uphill=radians(uphill))
    gravity = plane.gravity(9.81)
    downhill = 9.81 * sin(radians(tilt))
    expected = (
        -downhill * cos(radians(uphill)),
        -downhill * sin(radians(uphill)),
        -9.81 * cos(radians(tilt)),
    )
    np.testing.assert_allclose(gravity, expected, atol=1e-14)
    assert (gravity[2] == 0.0) == (tilt == 90.0)  # exactly, so that nothing presses on a wall


@pytest.mark.parametrize(("tilt", "uphill"), TILTS)
def test_walkers_go_uphill_if_the_drive_is_along_the_slope(tilt: float, uphill: float) -> None:
    sloped = make_fig1b(**{"boundary.tilt": f"{tilt} deg", "boundary.uphill": f"{uphill} deg"})
    assert sloped.goes_uphill == (tilt > 0.0 and uphill == 0.0)


@pytest.fixture(params=["lab", "container"])
def frame(request: pytest.FixtureRequest) -> str:
    """In the laboratory the walls move; in the frame of the container they are at rest."""
    return str(request.param)


@pytest.fixture(params=["x", "y", "z"])
def axis(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def shaken(trajectory: ReadTrajectory, axis: str, frame: str) -> Group:
    return trajectory(drive={"axis": axis, "frame": frame}, run={"cycles": 4, "settling_cycles": 1})


def test_the_substrate_moves_as_prescribed(shaken: Group, axis: str) -> None:
    """A sin ωt along the axis and nothing across, in both frames."""
    excitation = shaken.case.excitation
    sine = np.sin(excitation.largest.angular_frequency * shaken.time)
    expected = np.zeros((len(sine), 3))
    expected[:, "xyz".index(axis)] = excitation.amplitude * sine
    np.testing.assert_allclose(
        shaken.motion.substrate, expected, atol=1e-9 * excitation.amplitude + 1e-15
    )


def test_the_substrate_does_not_move_across_the_axis(shaken: Group, axis: str) -> None:
    across = np.delete(shaken.motion.substrate, "xyz".index(axis), axis=1)
    assert not across.any()


def test_walkers_start_at_rest(shaken: Group) -> None:
    assert np.abs(shaken.velocity[0]).max() < 1e-12


@pytest.fixture(params=["73 Hz", "74 Hz"])
def frequency(request: pytest.FixtureRequest) -> str:
    """Of a drive after a rest of 0.06 s, which is 4.38 or 4.44 cycles long."""
    return str(request.param)


def run_after_rest(run_directory: RunCase, frequency: str, rest: str) -> Run:
    """The walker of Fig. 1b at a frequency, after a rest of at most some time."""
    case = make_fig1b(
        **{
            "run.cycles": 16,
            "run.settling_cycles": 12,
            "run.longest_settling": rest,
            "drive.frequency": frequency,
        }
    )
    return Run(run_directory(case))


def test_nothing_moves_during_the_rest_before_the_drive(
    run_directory: RunCase, frequency: str
) -> None:
    """Times before the drive are negative."""
    motion = run_after_rest(run_directory, frequency, "0.06 s").motion
    resting = motion.time < 0.0
    assert resting.any()
    assert np.abs(motion.velocity[resting]).max() < 1e-4


def test_the_trajectory_begins_after_the_rest(run_directory: RunCase, frequency: str) -> None:
    done = run_after_rest(run_directory, frequency, "0.06 s")
    assert done.trajectory["time"].min() == 0.0


def test_a_rest_before_the_drive_does_not_change_the_speed(
    run_directory: RunCase, frequency: str
) -> None:
    """Whatever part of a cycle it takes."""
    rested = run_after_rest(run_directory, frequency, "0.06 s").result["velocity"]
    expected = run_after_rest(run_directory, frequency, "0 s").result["velocity"]
    assert rested == pytest.approx(expected, rel=0.01)


# --- speeds of single walkers -------------------------------------------------------------------
# Expected speeds are in mm/s and were measured with this package. Those by Soulié's law were also
# measured with an independent prototype deck (not Fig. 4b, whose gaps are others); other engines
# with the same forces agree within 0.4 %. The reference case has Coulomb's law.
EQUAL_BEADS = {"dimers.radii": ["0.25 mm", "0.25 mm"]}
SOULIE = {
    "liquid.law": "soulie",
    "contact.roughness.bead_bead": "1.2 um",
    "contact.roughness.bead_wall": "2 um",
}
LARGE_BY_SOULIE = {
    "liquid.law": "soulie",
    "contact.roughness.bead_bead": "2 um",
    "contact.roughness.bead_wall": "3 um",
    "dimers.radii": ["0.6 mm", "0.3 mm"],
}


def speeds_of(directory: Path, names: list[str]) -> list[float]:
    """Numbers of a result, in mm/s."""
    result = read_results(directory)
    speeds = []
    for name in names:
        speeds.append(1e3 * result[name])
    return speeds


@pytest.mark.parametrize(
    ("peak", "speed"), [("2 g", 1.375), ("4 g", 3.806), ("6 g", 5.391), ("8 g", 7.045)]
)
def test_the_speed_by_soulies_law_is_that_of_the_prototype(
    run_directory: RunCase, peak: str, speed: float
) -> None:
    case = load_case(REFERENCE, {**SOULIE, "drive.peak_acceleration": peak})
    assert speeds_of(run_directory(case), ["velocity"]) == pytest.approx([speed], rel=0.02)


def test_the_walker_of_fig4a_rotates_with_hardly_any_sliding(run_directory: RunCase) -> None:
    """Published is a speed of 2.3 mm/s."""
    changes = {
        **LARGE_BY_SOULIE,
        "drive.peak_acceleration": "2 g",
        "contact.friction.bead_bead": 0.07,
        "contact.friction.bead_wall": 0.07,
    }
    directory = run_directory(load_case(REFERENCE, changes))
    speeds = speeds_of(directory, ["velocity", "rotation_1", "sliding_1"])
    assert speeds == pytest.approx([2.37, 2.39, 0.0], rel=0.02, abs=0.01)


def test_the_walker_of_fig4b_slides(run_directory: RunCase) -> None:
    """Published are 8.0, 13.3 and -5.3 mm/s."""
    changes = {
        **LARGE_BY_SOULIE,
        "drive.peak_acceleration": "10 g",
        "liquid.name": "Si AK10",
    }
    directory = run_directory(load_case(REFERENCE, changes))
    speeds = speeds_of(directory, ["velocity", "rotation_1", "sliding_1"])
    assert speeds == pytest.approx([8.88, 11.07, -2.176], rel=0.02, abs=0.01)


EXCHANGED_BEADS = {"dimers.radii": ["0.2 mm", "0.3 mm"]}


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="as shipped"),
        pytest.param(EXCHANGED_BEADS, id="exchanged beads"),
        pytest.param({"dimers.facing": "left"}, id="facing left"),
        pytest.param({"drive.phase": "90 deg"}, id="phase of the drive"),
        pytest.param({"drive.axis": [1, 1, 0]}, id="axis aslant"),
        pytest.param({"boundary.shape": "channel", "boundary.width": "1.4 mm"}, id="wide channel"),
    ],
)
def test_the_speed_of_fig1b_does_not_depend_on_the_setup(
    run_directory: RunCase, changes: dict[str, Any]
) -> None:
    speeds = speeds_of(run_directory(make_fig1b(**changes)), ["velocity"])
    assert speeds == pytest.approx([1e3 * FIG1B_SPEED], rel=0.02)


@pytest.mark.parametrize(
    ("changes", "sign"),
    [
        pytest.param({}, 1.0, id="large bead on the right"),
        pytest.param(EXCHANGED_BEADS, -1.0, id="exchanged beads"),
        pytest.param({"dimers.facing": "left"}, -1.0, id="facing left"),
    ],
)
def test_a_walker_goes_toward_its_large_bead(
    run_directory: RunCase, changes: dict[str, Any], sign: float
) -> None:
    speeds = speeds_of(run_directory(make_fig1b(**changes)), ["axial_velocity"])
    assert speeds == pytest.approx([sign * 1e3 * FIG1B_SPEED], rel=0.02)


def test_symmetric_dimer_does_not_walk(run_directory: RunCase) -> None:
    speeds = speeds_of(run_directory(make_fig1b(**EQUAL_BEADS)), ["axial_velocity"])
    assert speeds == pytest.approx([0.0], abs=0.01)


@pytest.mark.parametrize(("phase", "speed"), [("90 deg", -2.461), ("270 deg", 2.461)])
def test_a_symmetric_dimer_walks_by_two_tones(
    run_directory: RunCase, phase: str, speed: float
) -> None:
    """80 and 160 Hz break the symmetry under half a period.

    With the octave shifted by π, the drive is mirrored. The second engine has the same speed, and
    with half the time step it is within 0.1 %.
    """
    tables = make_fig1b(**EQUAL_BEADS).document
    tone = {"frequency": "80 Hz", "peak_acceleration": "4 g"}
    octave = {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": phase}
    case = build_case({**tables, "drive": {"harmonics": [tone, octave]}})
    assert speeds_of(run_directory(case), ["velocity"]) == pytest.approx([speed], rel=0.02)


@pytest.mark.parametrize("facing", ["right", "left"])
def test_a_symmetric_dimer_walks_by_a_sawtooth_whichever_way_it_faces(
    run_directory: RunCase, facing: str
) -> None:
    """The sawtooth rises evenly and falls at once."""
    changes = {
        **EQUAL_BEADS,
        "dimers.facing": facing,
        "drive.waveform": "sawtooth",
        "run.cycles": 20,
        "run.samples_per_cycle": 10,
    }
    directory = run_directory(load_case(REFERENCE, changes))
    assert speeds_of(directory, ["axial_velocity"]) == pytest.approx([-0.126], abs=0.01)


def test_a_walker_rolls_down_a_steep_slope(run_directory: RunCase) -> None:
    """The theory has -0.656 mm/s."""
    directory = run_directory(make_fig1b(**{"boundary.tilt": "20 deg"}))
    speeds = speeds_of(directory, ["axial_velocity", "rotation_1", "sliding_1"])
    assert speeds == pytest.approx([-0.655, -0.655, 0.0], rel=0.02, abs=0.001)


def test_a_walker_is_slower_up_a_slope(run_directory: RunCase) -> None:
    """Without rolling friction it has 0.934 mm/s, and the theory, too."""
    directory = run_directory(make_fig1b(**{"boundary.tilt": "5 deg"}))
    assert speeds_of(directory, ["velocity"]) == pytest.approx([0.902], rel=0.02)


def test_a_walker_in_a_groove_rolls_about_its_chord(run_directory: RunCase) -> None:
    """In a groove of 120°, v = R sin(60°) dφ/dt, and rotation_1 is R dφ/dt.

    The second engine has the same speed; the other way, or with half the time step, it is within
    0.02 %.
    """
    changes = {"boundary.shape": "groove", "boundary.opening": "120 deg"}
    velocity, rotation = speeds_of(run_directory(make_fig1b(**changes)), ["velocity", "rotation_1"])
    assert velocity == pytest.approx(0.671, rel=0.02)
    assert rotation == pytest.approx(0.671 / sin(radians(60.0)), rel=0.02)


def final_sine_of_heading(trajectory: ReadTrajectory, **dimers: Any) -> float:
    """|sin| of the final angle to the axis of a dimer with rolling friction that starts at 5°."""
    friction = {"bead_bead": 0.2, "bead_wall": 0.2}
    group = trajectory(
        dimers={"angle": "5 deg", **dimers},
        contact={"friction": friction, "rolling_friction": 0.01},
        run={"cycles": 40, "settling_cycles": 20},
    )
    return abs(sin(group.orientation[-1, 0]))


def test_rolling_friction_turns_a_walker_to_the_axis(trajectory: ReadTrajectory) -> None:
    assert final_sine_of_heading(trajectory) < 0.5 * sin(radians(5.0))


def test_rolling_friction_turns_a_symmetric_dimer_away_from_the_axis(
    trajectory: ReadTrajectory,
) -> None:
    final = final_sine_of_heading(trajectory, radii=["0.25 mm", "0.25 mm"])
    assert final > 2.0 * sin(radians(5.0))


REPORTS = (
    "compute pair_bridges",
    "dump pairs",
    "dump walls",
    "dump_modify pairs",
    "dump_modify walls",
)
"""First words of the commands of a deck that report the bridges."""


def run_deck(deck: Deck, directory: Path) -> bytes:
    """Run a deck; the positions and velocities of its beads as the engine wrote them."""
    directory.mkdir()
    write_deck(deck, directory)
    launch(deck, directory, find_engine())
    return (directory / "beads.bin").read_bytes()


def test_reporting_bridges_does_not_disturb_the_walkers(tmp_path: Path) -> None:
    """LIGGGHTS evaluates contacts once more to report them, which must not change the motion."""
    deck = render_deck(load_case("fig1b", {"run.cycles": 10, "run.settling_cycles": 4}))
    lines = deck.text.splitlines()
    silent_lines = []
    for line in lines:
        if not " ".join(line.split()).startswith(REPORTS):
            silent_lines.append(line)
    assert len(silent_lines) == len(lines) - len(REPORTS)
    silent = replace(
        deck,
        text="\n".join(silent_lines) + "\n",
        layout=replace(deck.layout, bridge_frames=0),
    )
    motion = run_deck(deck, tmp_path / "reporting")
    silent_motion = run_deck(silent, tmp_path / "silent")
    assert (tmp_path / "reporting" / "bridges.pairs.txt").exists()
    assert not (tmp_path / "silent" / "bridges.pairs.txt").exists()
    assert motion == silent_motion


# --- several kinds of walkers -------------------------------------------------------------------
def test_contacts_of_several_kinds_are_as_stiff_as_one_of_them_asks_for() -> None:
    """Larger beads ask for stiffer contacts; the order of the kinds does not matter."""
    soft = {"arrangement": "chain", "radii": ["0.2 mm"] * 3, "replicates": 1}
    stiff = {"arrangement": "chain", "radii": ["0.6 mm"] * 3, "replicates": 1}
    of_soft = case_of_tables(soft).contact.youngs_modulus
    of_stiff = case_of_tables(stiff).contact.youngs_modulus
    assert of_soft < of_stiff
    assert case_of_tables(soft, stiff).contact.youngs_modulus == of_stiff
    assert case_of_tables(stiff, soft).contact.youngs_modulus == of_stiff


@pytest.fixture(scope="module")
def several_kinds(run_directory: RunCase) -> Run:
    """Two dimers, two trimers as fans and one as a chain, which do not meet."""
    fans = make_cluster("fan", "Lss")
    chain = make_cluster("chain", "Lss", replicates=1)
    return Run(run_directory(case_of_tables(fans, chain, dimers=make_dimers(2), run=BRIEF)))


def test_walkers_of_each_kind_are_counted(several_kinds: Run) -> None:
    result = several_kinds.result
    assert [result[f"walkers_make_{number}"] for number in (1, 2, 3)] == [2, 2, 1]
    assert several_kinds.walkers["make"].tolist() == [0, 0, 1, 1, 2]


def test_a_dimer_beside_trimers_walks_as_it_does_alone(several_kinds: Run) -> None:
    assert several_kinds.result["velocity_make_1"] == pytest.approx(FIG1B_SPEED, rel=2e-3)


def test_the_velocity_of_a_kind_is_that_of_its_walkers(several_kinds: Run) -> None:
    """The fifth walker is the only one of the third kind."""
    velocity = several_kinds.walkers["velocity"].iloc[4]
    assert several_kinds.result["velocity_make_3"] == pytest.approx(velocity)


@pytest.mark.parametrize("name", ["rotation_1", "sliding_2"])
def test_numbers_of_single_beads_are_those_of_the_first_kind(several_kinds: Run, name: str) -> None:
    of_dimers = several_kinds.walkers[name][:2]
    assert several_kinds.result[name] == pytest.approx(of_dimers.mean())


def test_a_result_has_the_sliding_of_the_contacts_of_the_first_kind(several_kinds: Run) -> None:
    sliding = {name for name in several_kinds.result if name.startswith("sliding")}
    assert sliding == {"sliding_1", "sliding_2", "sliding_pair_1"}


def test_a_column_of_sliding_is_of_one_kind_of_contact(several_kinds: Run) -> None:
    """Of the third bead and the floor, which a dimer does not have, or of the first two beads."""
    table = several_kinds.walkers
    dimers = table["walker"] < 2
    assert table["sliding_3"][dimers].isna().all()
    assert table["sliding_pair_1"].notna().all()


# --- walkers that meet --------------------------------------------------------------------------
@pytest.fixture(scope="module")
def tray(run_directory: RunCase) -> Run:
    """Nine walkers in three rows of three, so close that heads run into each other and stick."""
    close = make_dimers(9, spacing="1.6 mm", meet=True, angle_spread="20 deg")
    return Run(
        run_directory(case_of_tables(dimers=close, run={"cycles": 30, "settling_cycles": 18}))
    )


def merged_of(tray: Run) -> pd.DataFrame:
    """Meetings after which walkers stick together."""
    meetings = tray.table("meetings")
    return meetings[meetings["event"] == "merged"]


def test_walkers_on_a_tray_meet_and_stick(tray: Run) -> None:
    assert tray.result["merged"] == len(merged_of(tray))
    assert tray.result["merged"] >= 2
    assert tray.result["largest_group"] >= 2


def test_meetings_on_a_tray_begin_with_the_bridge_between_the_walkers(tray: Run) -> None:
    bridges = tray.table("bridges")
    for meeting in merged_of(tray).itertuples():
        of_walker = bridges["walker"] == meeting.walker
        to_partner = bridges["other_walker"] == meeting.other
        assert bridges["time"][of_walker & to_partner].min() == pytest.approx(meeting.time)


def test_walkers_on_a_tray_need_not_be_steady(tray: Run) -> None:
    """Walkers that have met stop."""
    for warning in tray.result.warnings:
        assert "not steady" not in warning


def test_paths_on_a_tray_are_drawn_where_the_walkers_went(tray: Run) -> None:
    """In the plane, in mm, a point a cycle for each of the nine walkers."""
    group = tray.motion.groups[0]
    centre = group.mass_centre[:: group.case.run.samples_per_cycle]
    (axes,) = figures_of(tray.result)["paths"].axes
    for walker, line in enumerate(axes.lines[:9]):
        np.testing.assert_allclose(line.get_xydata(), 1e3 * centre[:, walker, :2])


def test_beads_on_a_tray_are_drawn_at_the_ends_of_their_paths(tray: Run) -> None:
    group = tray.motion.groups[0]
    beads = tray.motion.position[-1, group.rows].reshape(-1, 3)
    (axes,) = figures_of(tray.result)["paths"].axes
    drawn = [bead.center for bead in axes.patches]  # type: ignore[attr-defined]
    np.testing.assert_allclose(drawn, 1e3 * beads[:, :2], atol=0.01)


@pytest.fixture
def collective_numbers() -> dict[str, Any]:
    """Numbers of four walkers that walk at 1 mm/s for 10 s, in 101 frames.

    The first two head right and left, meet at 5 s and rest. The others head right and along y; they
    are joined from 1 to 3 s, at half the speed until a wall holds them at 2.5 s, and part. In the
    last frame the fourth one is held by a wall.
    """
    time = np.linspace(0.0, 10.0, 101)
    heading = np.array([[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    size = np.ones((101, 4), dtype=np.int64)
    size[50:, :2] = 2
    size[10:31, 2:] = 2
    held = np.zeros((101, 4), dtype=bool)
    held[25:31, 2:] = True
    held[-1, 3] = True
    speed = np.full((100, 4), 1e-3)
    speed[50:, :2] = 0.0
    speed[10:25, 2:] = 0.5e-3
    speed[25:30, 2:] = 0.0
    path = np.concatenate([np.zeros((1, 4)), np.cumsum(0.1 * speed, axis=0)])
    course = TrayCourse(
        time=time,
        centre=path[..., None] * heading,
        heading=np.broadcast_to(heading, (101, 4, 2)),
        size=size,
        held=held,
    )
    return collective(course, meetings=2, axis=np.array([1.0, 0.0]))


def test_meetings_are_counted_per_walker_and_time(collective_numbers: dict[str, Any]) -> None:
    """Two walkers take part in each of the two meetings: 2·2 / (4 walkers · 10 s)."""
    assert collective_numbers["meeting_rate"] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        pytest.param("clustered_share", 2 / 4, id="the two that met"),
        pytest.param("held_share", 1 / 4, id="the one at the wall"),
        pytest.param("slow_share", 2 / 4, id="the two that rest"),
        pytest.param("largest_cluster", 2, id="the pair"),
    ],
)
def test_walkers_in_clusters_or_at_rest_are_counted_at_the_end(
    collective_numbers: dict[str, Any], name: str, expected: float
) -> None:
    assert collective_numbers[name] == pytest.approx(expected)


def test_the_order_of_headings_is_that_along_the_axis_and_of_their_mean(
    collective_numbers: dict[str, Any],
) -> None:
    """The mean of 2 cos² - 1 is (1 + 1 + 1 - 1) / 4; the sum of the headings is (1, 1)."""
    assert collective_numbers["nematic_order"] == pytest.approx(0.5)
    assert collective_numbers["polar_order"] == pytest.approx(sqrt(2.0) / 4.0)


def test_joined_walkers_have_a_speed_of_their_own(collective_numbers: dict[str, Any]) -> None:
    """Walkers that no wall holds are joined in 128 intervals between frames.

    The first two rest in 2 · 50 of them. The others have half the speed in 2 · 14, between the
    frames of 1.0 and 2.4 s; in that of 2.5 s they are held.
    """
    ratio = 28 * 0.5 / 128
    assert collective_numbers["free_speed"] == pytest.approx(1e-3)
    assert collective_numbers["joined_speed"] == pytest.approx(ratio * 1e-3)
    assert collective_numbers["speed_ratio"] == pytest.approx(ratio)


def test_all_collective_numbers_are_tested(collective_numbers: dict[str, Any]) -> None:
    shares = {"clustered_share", "held_share", "slow_share", "largest_cluster"}
    orders = {"nematic_order", "polar_order"}
    speeds = {"free_speed", "joined_speed", "speed_ratio"}
    assert collective_numbers.keys() == {"meeting_rate"} | shares | orders | speeds


# --- climbers -----------------------------------------------------------------------------------
CLIMBING_SPEEDS = {0.1: -5.16e-3, 0.2: -2.39e-3, 0.3: 1.845e-3}
"""Speeds in m/s by coefficient of friction, as measured; negative ones are down."""


def make_climber(friction: float, **dimers: Any) -> Case:
    """The shipped dimer on a wall, with softer contacts, which save time.

    Its speed is that of 120 cycles of 2 µs, 40 of them to settle, to three digits.
    """
    tables = {
        **CLIMBER,
        "run": {"time_step": "4 us", "cycles": 24, "settling_cycles": 12},
        "contact": {**CLIMBER["contact"], "youngs_modulus": "50 MPa"},
    }
    changes: dict[str, Any] = {
        "contact.friction.bead_bead": friction,
        "contact.friction.bead_wall": friction,
    }
    for key, value in {**STRAIGHT_START, "spacing": "0.1 m", **dimers}.items():
        changes[f"dimers.{key}"] = value
    return changed_case(build_case(tables, name="climber-dimer"), changes)


@pytest.mark.parametrize(("friction", "speed"), list(CLIMBING_SPEEDS.items()))
def test_a_dimer_on_the_axis_climbs_if_friction_suffices(
    run_directory: RunCase, friction: float, speed: float
) -> None:
    result = read_results(run_directory(make_climber(friction)))
    assert result["velocity"] == pytest.approx(speed, rel=0.03)


@pytest.mark.parametrize("friction", list(CLIMBING_SPEEDS))
def test_the_theory_predicts_the_speed_of_a_climber_within_12_per_cent(
    run_directory: RunCase, friction: float
) -> None:
    """In theory, dimers that climb are a tenth faster."""
    case = make_climber(friction)
    result = read_results(run_directory(case))
    assert float(motion_of(case).velocity[0]) == pytest.approx(result["velocity"], rel=0.12)


@pytest.mark.parametrize("friction", list(CLIMBING_SPEEDS))
def test_a_dimer_with_its_large_bead_below_falls(run_directory: RunCase, friction: float) -> None:
    result = read_results(run_directory(make_climber(friction, facing="left")))
    assert result["axial_left_facing"] < -5e-3


@pytest.mark.parametrize("friction", list(CLIMBING_SPEEDS))
def test_a_symmetric_dimer_on_a_wall_falls(run_directory: RunCase, friction: float) -> None:
    """Its radius is the mean of those of the shipped climber."""
    symmetric = make_climber(friction, radii=["0.42625 mm", "0.42625 mm"])
    assert read_results(run_directory(symmetric))["axial_velocity"] < -1e-3


@pytest.fixture(scope="module")
def shipped_climber(run_directory: RunCase) -> Path:
    """The shipped climbers, six with a spread of starts, for a fifth of their time."""
    run = {"cycles": 36, "settling_cycles": 24, "samples_per_cycle": 1}
    tables = {**read_toml(shipped("case")["climber"]), "run": run}
    return run_directory(build_case(tables, name="climber"))


def test_the_shipped_climbers_start_up_to_ten_degrees_off(shipped_climber: Path) -> None:
    angles = read_table(shipped_climber, "walkers")["start_angle"]
    assert np.degrees(angles.abs().max()) > 9.0


def test_all_shipped_climbers_come_upright_and_climb(shipped_climber: Path) -> None:
    result = read_results(shipped_climber)
    assert result["walkers"] == 6
    assert result["upright"] == 6
    assert result["climbing"] == 6


def test_the_shipped_climbers_are_as_fast_as_measured(shipped_climber: Path) -> None:
    assert read_results(shipped_climber)["velocity"] == pytest.approx(2.67e-3, rel=0.03)


def with_angles(group: Group, degrees: FloatArray) -> Group:
    """Walkers of which all are at the same angle to the axis, one angle a frame."""
    turned = replace(group)
    angles = np.broadcast_to(np.radians(degrees)[:, None], group.orientation.shape)
    turned.__dict__["orientation"] = angles  # where the cached property keeps it
    return turned


@pytest.mark.parametrize(
    ("start", "end", "posture"),
    [
        pytest.param(14.0, 14.0, "upright", id="below the limit of 15°"),
        pytest.param(16.0, 16.0, "leaning", id="above the limit of 15°"),
        pytest.param(0.0, 20.0, "leaning", id="tilting more and more"),
    ],
)
def test_the_posture_is_that_of_the_end(
    shipped_climber: Path, start: float, end: float, posture: str
) -> None:
    group = read_motion(shipped_climber).groups[0]
    turned = with_angles(group, np.linspace(start, end, len(group.time)))
    assert postures(turned) == [posture] * 6


def test_the_posture_is_turned_over_whatever_comes_after(shipped_climber: Path) -> None:
    """By more than 90° in the tenth frame, but upright before and after."""
    group = read_motion(shipped_climber).groups[0]
    degrees = np.zeros(len(group.time))
    degrees[9] = 100.0
    turned = with_angles(group, degrees)
    assert postures(turned) == ["turned_over"] * 6
    assert turned.turned_at == pytest.approx(group.time[9])
