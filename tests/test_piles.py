"""Piles by the real engine: settled, shaken, in both frames, in all containers; what is read."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
import pytest

import walkers
from tests.conftest import HALF, call
from tests.printed import spoilt
from walkers.errors import InputError
from walkers.files import read_json
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.resolving.loads import (
    bridge_at_rest,
    delay_of_loose_beads,
    largest_delay,
    softness_warning,
)
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.motion import FLOOR_INDEX, Motion, read_bridges, read_motion
from walkers.postprocess.measure.results import Results, read_results
from walkers.postprocess.show.figures import figures_of
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runs.preview import notes

FloatArray = npt.NDArray[np.float64]
Once = Callable[[str, Callable[[Path], object]], Path]
QUICK = {"time_step": "3 us", "longest_settling": "0.05 s"}
"""Half the steps of "auto"; the beads are shaken as soon as they have come down."""


def make_document(case: str = "pile-ci", **changes: dict[str, Any]) -> dict[str, Any]:
    """Make the tables of a shipped case with changes; None takes a key away."""
    tables = read_toml(shipped("case")[case])
    for name, values in changes.items():
        table = tables.setdefault(name, {})
        for key, value in values.items():
            if value is None:
                table.pop(key, None)
            else:
                table[key] = value
    return tables


def make_pile(**changes: dict[str, Any]) -> Case:
    """Make the case of the shipped pile of 60 beads with changes."""
    return build_case(make_document(**changes), name="pile-ci")


def make_placed(*beads: tuple[float, float, float], **changes: dict[str, Any]) -> Case:
    """Make a case of beads of a radius at x and z, mm, in the box of the shipped cluster."""
    tables = make_document("cluster", **changes)
    tables["placed"] = []
    for radius, x, z in beads:
        tables["placed"].append({"radius": f"{radius} mm", "at": [f"{x} mm", "0 mm", f"{z} mm"]})
    return build_case(tables, name="cluster")


# --- the shipped pile -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def motion(pile_run: Path) -> Motion:
    """The motion of the shipped pile, in the frame of its container."""
    return read_motion(pile_run)


@pytest.fixture(scope="module")
def result(pile_run: Path) -> Results:
    """The result of the shipped pile."""
    return read_results(pile_run)


@pytest.fixture(scope="module")
def bed(result: Results) -> pd.DataFrame:
    """The state of the shipped pile in each frame."""
    return result.table("bed")


def agitation_of(motion: Motion) -> FloatArray:
    """The mean square velocity of the beads in each frame, m²/s²."""
    return (motion.velocity**2).sum(axis=2).mean(axis=1)


def test_a_pile_has_the_beads_of_its_case(motion: Motion) -> None:
    case = make_pile(run=HALF)
    assert case.mixture is not None
    assert sorted(motion.radius) == pytest.approx(sorted(case.all_radii))
    assert int(motion.large.sum()) == case.mixture.counts[1]


def test_a_pile_is_recorded_at_equal_times_until_the_end_of_its_drive(motion: Motion) -> None:
    """From before the drive, which begins at 0 s."""
    case = make_pile(run=HALF)
    assert motion.time[0] < 0.0
    assert motion.time[-1] == pytest.approx(case.run.cycles / case.excitation.frequency)
    interval = case.run.steps_per_sample * case.run.time_step
    np.testing.assert_allclose(np.diff(motion.time), interval)


def test_a_pile_is_settled_before_it_is_shaken(pile_run: Path, motion: Motion) -> None:
    """The drive starts when the mean weighted by mass is below 5 mm/s.

    Here all beads count equally, hence 6 mm/s.
    """
    settled = read_json(pile_run / MANIFEST_NAME)["settled"]
    assert settled < make_pile(run=HALF).run.settled_below
    assert agitation_of(motion)[motion.first_driven] < 6e-3**2


def test_a_pile_is_shaken_through_all_of_its_drive(motion: Motion) -> None:
    """From the third frame on its beads are faster than 10 mm/s."""
    assert agitation_of(motion)[motion.first_driven + 3 :].min() > 1e-2**2


def test_the_beads_of_a_pile_stay_in_the_container(motion: Motion) -> None:
    """But for overlaps of 10 µm."""
    half_width = make_pile(run=HALF).boundary.width / 2.0
    farthest = half_width - motion.radius[:, None] + 1e-5
    assert (np.abs(motion.position[..., :2]) <= farthest).all()
    assert (motion.position[..., 2] >= motion.radius - 1e-5).all()


def test_each_frame_of_a_pile_has_its_bridges_and_its_state(
    motion: Motion, bed: pd.DataFrame
) -> None:
    assert len(list(read_bridges(motion))) == len(motion.time)
    assert len(bed) == len(motion.time)


def test_the_gap_of_a_bridge_is_that_between_its_beads(motion: Motion) -> None:
    """In the last frame."""
    *_, bridges = read_bridges(motion)
    first, second = bridges.beads.T
    position = motion.position[-1]
    apart = np.linalg.norm(position[first] - position[second], axis=1)
    gap = apart - motion.radius[first] - motion.radius[second]
    np.testing.assert_allclose(bridges.gap[: len(gap)], gap, atol=1e-9)


def test_beads_with_a_bridge_to_the_floor_are_at_the_floor(motion: Motion) -> None:
    """At most 0.2 mm above it, and with one bridge each."""
    *_, bridges = read_bridges(motion)
    beads, walls = bridges.at_walls
    on_floor = beads[walls == FLOOR_INDEX]
    assert len(on_floor) > 3
    assert len(on_floor) == len(set(on_floor.tolist()))
    assert (motion.position[-1, on_floor, 2] - motion.radius[on_floor] < 2e-4).all()


def test_members_of_clusters_are_at_the_heights_of_their_beads(
    motion: Motion, result: Results, bed: pd.DataFrame
) -> None:
    members = result.table("members")
    frames = np.searchsorted(bed["time"], members["time"])
    heights = motion.position[frames, members["bead"], 2]
    np.testing.assert_array_equal(members["height"], heights)


def test_the_clusters_of_a_frame_are_those_that_have_members(
    result: Results, bed: pd.DataFrame
) -> None:
    tracks = result.table("members").groupby("time")["track"].nunique()
    assert tracks.sum() == bed["clusters"].sum()


def test_bridges_per_bead_are_those_between_beads_twice(motion: Motion, bed: pd.DataFrame) -> None:
    """At rest; those to walls and the floor count for none."""
    rest = bed[bed["time"] <= 0.0].iloc[-1]
    bridges = list(read_bridges(motion))[rest.name]
    expected = 2.0 * len(bridges.beads) / len(motion.radius)
    assert rest["bridges"] == pytest.approx(expected)


@pytest.mark.parametrize("name", ["contacts", "bridges"])
def test_contacts_and_bridges_are_counted_at_rest_and_in_the_second_half_of_the_drive(
    result: Results, bed: pd.DataFrame, name: str
) -> None:
    rest = bed[bed["time"] <= 0.0].iloc[-1]
    driven = bed["time"][bed["time"] >= 0.0]
    late = bed[bed["time"] >= driven.mean()]
    assert result[f"{name}_at_rest"] == pytest.approx(rest[name])
    assert result[f"{name}_shaken"] == pytest.approx(late[name].mean())


@pytest.mark.parametrize("name", ["surface", "brazil_nut"])
def test_numbers_at_the_start_are_those_of_the_first_frame_of_the_drive(
    result: Results, bed: pd.DataFrame, name: str
) -> None:
    """Not of the first frame of the run, in which the beads still fall."""
    values = bed[name]
    driven = values[bed["time"] >= 0.0]
    assert values.iloc[0] != driven.iloc[0]
    assert driven.iloc[0] != driven.iloc[-1]
    assert result[f"{name}_start"] == pytest.approx(driven.iloc[0])
    assert result[f"{name}_end"] == pytest.approx(driven.iloc[-1])


def test_a_pile_settles_before_0_s_and_is_driven_from_then_on(
    result: Results, bed: pd.DataFrame
) -> None:
    start = bed["time"].iloc[0]
    assert start < 0.0
    assert result["settling"] == pytest.approx(-start)
    assert result["driven"] == pytest.approx(bed["time"].iloc[-1])


# --- frames and containers --------------------------------------------------------------------


SHAKEN = {"duration": "0.03 s", "frames_per_second": 680.0, **QUICK}
"""Four frames in each cycle of 1/170 s."""


def make_in_frame(frame: str) -> Case:
    """Make a pile that is shaken briefly, computed in a frame."""
    return make_pile(drive={"frame": frame}, run=SHAKEN)


@pytest.fixture(scope="module")
def frames_folder(once: Once) -> Path:
    """The folder of the runs of a pile in both frames, made once a session."""

    def run_both(folder: Path) -> None:
        walkers.run(make_in_frame("container"), folder)
        walkers.run(make_in_frame("lab"), folder)

    return once("pile-in-both-frames", run_both)


@pytest.fixture(scope="module")
def in_container_frame(frames_folder: Path) -> Motion:
    """The driven motion of a pile that was computed in the frame of the container."""
    return walkers.load(make_in_frame("container"), frames_folder).motion.driven


@pytest.fixture(scope="module")
def in_lab_frame(frames_folder: Path) -> Motion:
    """The driven motion in the container of a pile that was computed in the laboratory's frame."""
    return walkers.load(make_in_frame("lab"), frames_folder).motion.driven


def test_both_frames_shake_beads_to_the_same_places(
    in_container_frame: Motion, in_lab_frame: Motion
) -> None:
    """For three cycles, until chaotic trajectories part, within a twentieth of the amplitude.

    In the laboratory the container's motion is subtracted at four phases of the cycle.
    """
    assert in_lab_frame.case.run.samples_per_cycle == 4
    difference = in_container_frame.position - in_lab_frame.position
    rms = np.sqrt((difference**2).sum(axis=2).mean(axis=1))
    assert rms[:12].max() < 0.05 * in_lab_frame.case.excitation.amplitude


def test_both_frames_agitate_beads_as_much(
    in_container_frame: Motion, in_lab_frame: Motion
) -> None:
    in_container = agitation_of(in_container_frame).mean()
    in_lab = agitation_of(in_lab_frame).mean()
    assert in_container == pytest.approx(in_lab, rel=0.1)


def test_in_the_laboratory_of_both_frames_the_lowest_beads_stay_on_the_floor(
    in_lab_frame: Motion,
) -> None:
    """Throughout the cycle, within a fifth of the amplitude."""
    lowest = (in_lab_frame.position[..., 2] - in_lab_frame.radius).min(axis=1)
    assert np.abs(lowest).max() < 0.2 * in_lab_frame.case.excitation.amplitude


WALLS = {"cylinder": 1, "octagon": 8}
"""Number of side walls by shape of the container."""


def run_container(shape: str, once: Once) -> Motion:
    """Shake a pile in a container 5 mm wide, once a session."""
    case = make_pile(boundary={"shape": shape, "width": "5 mm"}, run=SHAKEN)

    def run_pile(folder: Path) -> None:
        walkers.run(case, folder)

    return walkers.load(case, once(f"pile-in-{shape}", run_pile)).motion


@pytest.fixture(scope="module", params=WALLS)
def in_container(request: pytest.FixtureRequest, once: Once) -> Motion:
    """The motion of a pile in a container of each shape."""
    return run_container(request.param, once)


def test_a_container_holds_its_beads(in_container: Motion) -> None:
    """The closest is at the wall, but for overlaps of 10 µm; the beads are everywhere in it."""
    position = in_container.driven.position
    geometry = in_container.case.boundary.geometry
    clearance = geometry.side_clearance(position.reshape(-1, 3)).reshape(position.shape[:2])
    gap = clearance - in_container.radius
    assert -1e-5 < gap.min() < 0.05 * 2.5e-3
    assert position[..., :2].std() > 0.2 * 2.5e-3


def test_beads_have_bridges_to_the_walls_of_their_container(in_container: Motion) -> None:
    walls = WALLS[in_container.case.boundary.shape]
    at_sides = 0
    for bridges in read_bridges(in_container):
        _, indices = bridges.at_walls
        assert set(indices.tolist()) <= set(range(1 + walls))
        at_sides += int((indices != FLOOR_INDEX).sum())
    assert at_sides >= 2


def test_a_bead_has_at_most_one_bridge_to_the_side_wall_of_a_cylinder(once: Once) -> None:
    """In an octagon it may have two, in a corner."""
    for bridges in read_bridges(run_container("cylinder", once)):
        beads, walls = bridges.at_walls
        at_sides = beads[walls != FLOOR_INDEX].tolist()
        assert len(at_sides) == len(set(at_sides))


@pytest.fixture(scope="module")
def trough(once: Once) -> walkers.Run:
    """A few beads in a trough: two slanted faces without a floor."""
    tables = make_document(
        "pile-trough", mixture={"count": 20}, run={"duration": "0.02 s", **QUICK}
    )
    case = build_case(tables, name="trough")

    def run_pile(folder: Path) -> None:
        walkers.run(case, folder)

    return walkers.load(case, once("pile-in-trough", run_pile))


def test_beads_touch_both_faces_of_a_trough(trough: walkers.Run) -> None:
    *_, bridges = read_bridges(trough.motion)
    _, walls = bridges.at_walls
    assert {0, 1} <= set(walls.tolist())


def test_all_walls_of_a_trough_are_side_walls(trough: walkers.Run) -> None:
    """What touches either face is at a wall."""
    beads_at_walls = []
    for bridges in read_bridges(trough.motion):
        beads, _ = bridges.at_walls
        beads_at_walls.append(len(set(beads.tolist())))
    assert trough.table("bed")["at_wall"].tolist() == beads_at_walls


# --- climbers ---------------------------------------------------------------------------------


def test_a_climber_that_leaves_the_container_ends_the_run(tmp_path: Path) -> None:
    """It climbs at 8.63 mm/s; its upper bead is 3.2 mm below where the walls end.

    Segments of 0.05 s end somewhat later.
    """
    case = make_placed(
        (0.545, 2.5001 - 0.545, 2.0),
        (0.3075, 2.5001 - 0.3075, 1.18135),
        boundary={"height": "2.6 mm"},
        run={"duration": "1 s", "segment": "0.05 s"},
    )
    run = walkers.run(case, tmp_path)
    assert run.result["driven"] == pytest.approx(3.2e-3 / 8.63e-3, abs=0.1)
    assert "over its walls" in read_json(run.directory / MANIFEST_NAME)["ended"]
    assert "climbers left the container" in run.describe()
    assert call("check", "files", str(run.directory)).returncode == 0


@pytest.fixture(scope="module")
def two_dimers(once: Once) -> walkers.Run:
    """Two dimers on walls across from each other, the first one with its large bead above.

    The beads, of 50 MPa, are as soft as those of `tests.test_bodies`.
    """
    case = make_placed(
        (0.545, 2.5001 - 0.545, 8.0),
        (0.3075, 2.5001 - 0.3075, 7.18135),
        (0.3075, -(2.5001 - 0.3075), 8.0),
        (0.545, -(2.5001 - 0.545), 7.18135),
        run={"duration": "0.5 s"},
        contact={"youngs_modulus": "50 MPa"},
    )

    def run_pile(folder: Path) -> None:
        walkers.run(case, folder)

    return walkers.load(case, once("two-dimers", run_pile))


def test_a_placed_dimer_climbs_like_the_climber(two_dimers: walkers.Run) -> None:
    """The same dimer as that of `tests.test_bodies`, by the other way: as a pile in a box.

    Hard beads climb at 8.2 mm/s.
    """
    assert two_dimers.result["climbs"] == 1
    table = two_dimers.table("clusters")
    (climb,) = table[table["climbed"]].to_dict("records")
    assert climb["speed"] * 1e3 == pytest.approx(8.63, rel=0.03)
    assert climb["begin"] == pytest.approx(0.0, abs=0.05)
    assert climb["size"] == 2
    assert climb["large"] == 1
    assert climb["leader_large"]
    assert climb["wall_names"] == "+x"


def test_a_placed_dimer_that_its_small_bead_leads_goes_down(two_dimers: walkers.Run) -> None:
    """By more than a millimetre from 8 mm."""
    assert two_dimers.motion.position[-1, 2:, 2].max() < 7e-3


def make_early_climb(**run: Any) -> Case:
    """Make a pile of 20 beads in silicone oil, of which two or more climb after 0.14 s."""
    case = {"duration": "0.4 s", "segment": "0.1 s", "seed": 1, **QUICK}
    return make_pile(liquid={"name": "Si AK5"}, mixture={"count": 20}, run={**case, **run})


@pytest.fixture(scope="module")
def early_climbs(once: Once) -> Path:
    """The folder of runs of a pile for the whole time, and until a cluster has climbed."""

    def run_both(folder: Path) -> None:
        walkers.run(make_early_climb(), folder)
        walkers.run(make_early_climb(until="climb"), folder)

    return once("early-climbs", run_both)


@pytest.fixture(scope="module")
def until_climb(early_climbs: Path) -> walkers.Run:
    """The pile until a cluster has climbed."""
    return walkers.load(make_early_climb(until="climb"), early_climbs)


def test_a_pile_ends_with_the_segment_of_its_first_climb(
    early_climbs: Path, until_climb: walkers.Run
) -> None:
    """The climb qualifies at 0.18 s, in the second segment of 0.1 s.

    Without ``until`` the same start is shaken for the whole time.
    """
    whole = walkers.load(make_early_climb(), early_climbs)
    assert whole.result["driven"] == pytest.approx(0.4, abs=0.02)
    assert until_climb.result["driven"] == pytest.approx(0.2, abs=0.02)
    assert until_climb.result["onset"] == whole.result["onset"]
    assert until_climb.result["onset"] < until_climb.result["driven"]


def test_a_pile_that_ends_with_a_climb_says_so(until_climb: walkers.Run) -> None:
    """And not that climbers left the container."""
    ended = read_json(until_climb.directory / MANIFEST_NAME)["ended"]
    assert ended == "a cluster has climbed (run.until)"
    assert "climbers left" not in " ".join(until_climb.result.warnings)


# --- cases of piles ---------------------------------------------------------------------------


@pytest.mark.parametrize(("mixed_by", "counts"), [("mass", (80, 10)), ("number", (45, 45))])
def test_a_share_is_of_what_a_mixture_is_mixed_by(mixed_by: str, counts: tuple[int, int]) -> None:
    """The share is a half, of 90 beads; those of twice the radius have eight times the mass."""
    mixture = {
        "small": ["0.25 mm"] * 2,
        "large": ["0.5 mm"] * 2,
        "mixed_by": mixed_by,
        "count": 90,
    }
    case = make_pile(mixture=mixture)
    assert case.mixture is not None
    assert case.mixture.counts == counts


def test_a_fill_height_gives_the_number_of_beads() -> None:
    """Of the packing fraction 0.55: 2 mm · (4 mm)² of it are 17.6 mm³; a mean bead has 0.24 mm³."""
    mixture = make_pile(mixture={"count": None, "fill_height": "2 mm"}).mixture
    assert mixture is not None
    assert 60 <= sum(mixture.counts) <= 90


LONG = {"duration": "4000 s", "time_step": "2 us"}
"""A drive of nearly as many steps as the engine counts: 2^31 steps of 2 us are 4,295 s."""


def test_a_drive_fits_if_the_engine_can_count_the_steps_of_a_rest_too() -> None:
    """4,000 s after a rest of 100 s; steps are somewhat shorter than 2 us."""
    run = make_pile(run={**LONG, "longest_settling": "100 s"}).run
    assert 3900.0 < run.steps * run.time_step < 4001.0


def test_the_engine_counts_the_steps_of_a_rest_too() -> None:
    """A drive of 4,000 s does not fit after a rest of 300 s."""
    message = r"run\.duration.*expected at most \d+ s: the engine counts steps"
    with pytest.raises(InputError, match=message):
        make_pile(run={**LONG, "longest_settling": "300 s"})


def test_the_longest_drive_leaves_a_second_for_the_last_segment_of_a_rest() -> None:
    """At 80 Hz, 2^31 steps of 2.5 us are 429,496 whole cycles; a rest of 299 + 1 s takes 24,000.

    The 405,496 cycles that are left are 5068.7 s; without the second they would be 5069.7 s.
    """
    rested = {"duration": "6000 s", "time_step": "2.5 us", "longest_settling": "299 s"}
    with pytest.raises(InputError, match=r"run\.duration.*expected at most 5068 s: the engine"):
        make_pile(run=rested, drive={"frequency": "80 Hz"})


CYLINDER = {"shape": "cylinder"}


def test_placed_beads_above_the_border_of_radii_are_large() -> None:
    case = make_placed((0.545, 0.0, 8.0), (0.3075, 0.0, 6.0), (0.3075, 0.0, 4.0), boundary=CYLINDER)
    assert [radius > case.border for radius in case.all_radii] == [True, False, False]


def test_placed_beads_reach_the_side_of_a_cylinder() -> None:
    """Its radius is 2.5 mm: 1 µm from the wall a bead is inside, 20 µm beyond it is not."""
    make_placed((0.545, 2.5 - 0.545 - 1e-3, 8.0), boundary=CYLINDER)
    with pytest.raises(InputError, match="within the boundary"):
        make_placed((0.545, 2.5 - 0.545 + 0.02, 8.0), boundary=CYLINDER)


# --- what is said before and after ------------------------------------------------------------


def test_nothing_is_said_of_the_shipped_pile_before_it_is_shaken() -> None:
    assert notes(load_case("pile-small")) == []


@pytest.mark.parametrize(
    ("changes", "pattern"),
    [
        pytest.param({"mixture.small_share": 1}, "no large beads", id="small beads alone"),
        pytest.param({"mixture.small_share": 0}, "no small beads", id="large beads alone"),
        # (2 · 40 mm - 41 µL/(0.55 (5.3 mm)²))/10 s = 7.7 mm/s.
        pytest.param({"run.until": "auto"}, r"climbers faster than 7\.[67] mm/s", id="low walls"),
        pytest.param(
            {"run.time_step": "4 us"},
            r"the time step is 2\.4 times the largest of auto \(0\.4 of the viscous",
            id="long time step",
        ),
    ],
)
def test_what_is_said_of_a_pile_before_it_is_shaken(changes: dict[str, Any], pattern: str) -> None:
    (note,) = notes(load_case("pile-small", changes))
    assert re.match(pattern, note)


def notes_with_cores(cores: int) -> list[str]:
    """Notes about a pile that two processes share, on so many cores of this machine."""
    available = os.sched_getaffinity(0)
    if len(available) < cores:
        pytest.skip(f"this machine has less than {cores} cores")
    os.sched_setaffinity(0, sorted(available)[:cores])
    try:
        return notes(load_case("pile-ci", {"run.ranks": 2}))
    finally:
        os.sched_setaffinity(0, available)


def test_more_processes_than_cores_are_noted_before_a_run() -> None:
    (note,) = notes_with_cores(1)
    assert "2 MPI processes (run.ranks) share 1 core of" in note


def test_as_many_processes_as_cores_are_not_noted_before_a_run() -> None:
    assert notes_with_cores(2) == []


def output_of(*command: str) -> str:
    """What the program prints with these arguments."""
    return call(*command, check=True).stdout.strip()


def test_the_program_prints_the_numbers_of_a_pile(pile_run: Path) -> None:
    printed = output_of("run", str(pile_run), "-v")
    assert re.search(r"\n  beads +60\n(.*\n)*  bridges per bead to others, at rest ", printed)


def test_the_program_plots_the_climbs_of_a_pile(pile_run: Path, in_folder: Path) -> None:
    assert output_of("plot", str(pile_run), "--to", "here") == "here/climb.png"
    assert (in_folder / "here" / "climb.png").exists()


def test_the_figure_of_a_pile_is_legible(result: Results) -> None:
    assert spoilt(figures_of(result)["climb"]) == []


def test_nothing_of_a_pile_is_cut_off_in_its_picture(pile_run: Path, in_folder: Path) -> None:
    """All edges of the picture are white."""
    import pyvista as pv

    place = output_of("render", str(pile_run), "--to", "here/box.png", "--images", "2")
    assert place == "here/box.png"
    picture = pv.read(in_folder / place)
    width, height, _ = picture.dimensions
    pixels = picture.point_data.active_scalars.reshape(height, width, -1)[..., :3]
    for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]):
        assert (edge == 255).all()


def test_a_pile_is_exported_to_vtk(pile_run: Path, motion: Motion, in_folder: Path) -> None:
    """Every fourth frame of the drive; the box is 4 mm wide and 20 mm high."""
    import pyvista as pv

    arguments = ("--format", "vtk", "--every", "4", "-o", "here/vtk")
    reader = pv.get_reader(output_of("export", str(pile_run), *arguments))
    driven = np.flatnonzero(motion.time >= 0.0)[::4]
    np.testing.assert_allclose(reader.time_values, motion.time[driven], atol=1e-12)
    second = driven[1]
    beads = pv.read(f"here/vtk/beads_{second:06d}.vtu")
    np.testing.assert_allclose(beads.points, motion.position[second], rtol=1e-6, atol=1e-9)
    assert set(np.unique(beads["is_climber"])) <= {0, 1}
    assert pv.read(f"here/vtk/bridges_{second:06d}.vtu").n_cells > 50
    box = pv.read(f"here/vtk/boundary_{second:06d}.vtu")
    np.testing.assert_allclose(box.bounds, [-2e-3, 2e-3, -2e-3, 2e-3, 0.0, 20e-3], atol=1e-9)


def test_a_deck_of_a_pile_explains_how_its_beads_come_to_rest(in_folder: Path) -> None:
    deck = output_of("export", "pile-ci", "--format", "deck")
    assert "in which the beads come to rest" in deck


# --- soft beads -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("liquid", "modulus", "largest"),
    [
        ("water", 5e7, 0.025),
        ("Si AK5", 2e8, 0.025),
        ("ethylene glycol", 2e8, 0.025),
        ("glycerol 87 %", 3.2e9, 0.025),
        ("glycerol", 5.12e10, 0.05),  # no bead is made harder than 51.2 GPa
    ],
)
def test_placed_beads_are_softened_as_far_as_bridges_delay_no_contact_by_more_than_0_025_rad(
    liquid: str, modulus: float, largest: float
) -> None:
    case = load_case("cluster", {"liquid.name": liquid})
    assert case.contact.youngs_modulus == modulus
    assert largest_delay(case) < largest


@pytest.mark.parametrize(
    ("liquid", "modulus"),
    [
        ("Si AK5", 2e8),
        ("ethylene glycol", 2e8),
        ("glycerol 87 %", 3.2e9),
        ("glycerol", 5.12e10),
    ],
)
def test_placed_beads_are_softened_no_further_in_more_viscous_liquids(
    liquid: str, modulus: float
) -> None:
    """A quarter of the modulus would delay a contact by more than 0.025 rad."""
    changes = {"liquid.name": liquid, "contact.youngs_modulus": f"{modulus / 4} Pa"}
    assert largest_delay(load_case("cluster", changes)) > 0.025


def test_the_delay_of_loose_beads_is_the_resistance_of_a_bridge_over_the_stiffness() -> None:
    """2πfN/k of the largest bead at the wall.

    N = 6πηR²/(σ + h_c), k = 2E*√(Rδ), and δ is Hertz's overlap under the capillary force.
    """
    case = load_case("cluster", {"contact.youngs_modulus": "50 MPa"})
    radius = 0.545e-3
    liquid = case.liquid.of_bridges
    gap = case.contact.roughness.bead_wall + 2.0 * liquid.surface_tension / 101_325.0
    resistance = 6.0 * np.pi * liquid.viscosity * radius**2 / gap
    modulus = 5e7 / (2.0 * (1.0 - case.contact.poissons_ratio**2))
    pull = bridge_at_rest(case, radius, np.inf).pull
    overlap = (3.0 * pull / (4.0 * modulus * np.sqrt(radius))) ** (2.0 / 3.0)
    stiffness = 2.0 * modulus * np.sqrt(radius * overlap)
    delay = 2.0 * np.pi * case.excitation.frequency * resistance / stiffness
    assert delay_of_loose_beads(case) == pytest.approx(delay, rel=1e-12)
    assert delay == pytest.approx(0.336, abs=0.001)


def test_a_mixture_in_a_thin_liquid_is_as_soft_as_other_beads() -> None:
    """50 MPa."""
    assert load_case("pile-small", {"liquid.name": "glycerol 87 %"}).contact.youngs_modulus == 5e7


def test_a_mixture_is_hardened_as_far_as_its_time_step_stays() -> None:
    """In glycerol, whose bridges limit the time step."""
    hardened = load_case("pile-small", {"liquid.name": "glycerol"})
    soft = load_case("pile-small", {"liquid.name": "glycerol", "contact.youngs_modulus": "50 MPa"})
    assert hardened.contact.youngs_modulus == 1.28e10
    assert hardened.run.time_step == soft.run.time_step


@pytest.mark.parametrize(("modulus", "error"), [("50 MPa", "up to 9 %"), ("10 MPa", "up to 12 %")])
def test_results_say_how_far_soft_beads_change_speeds(modulus: str, error: str) -> None:
    warning = softness_warning(load_case("cluster", {"contact.youngs_modulus": modulus}))
    assert error in str(warning)


def test_results_of_hard_beads_say_nothing_of_their_softness() -> None:
    case = load_case("cluster", {"contact.youngs_modulus": "3.2 GPa"})
    assert softness_warning(case) is None


def test_results_of_very_soft_beads_are_called_wrong() -> None:
    """In glycerol, contacts of beads of 5 MPa are late by 18 rad.

    Speeds were measured up to 3.8 rad.
    """
    case = load_case("cluster", {"liquid.name": "glycerol", "contact.youngs_modulus": "5 MPa"})
    assert delay_of_loose_beads(case) > 10.0
    assert "wrong, even in their direction" in str(softness_warning(case))
