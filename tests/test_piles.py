"""Piles by the real engine: settled, shaken, in both frames, in all containers, and what is read from them."""

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
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
from walkers.postprocess.measure.motion import FLOOR_INDEX, read_bridges, read_motion
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.show.figures import figures_of
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runs.preview import notes

QUICK = {"time_step": "3 us", "longest_settling": "0.05 s"}
"""Half the steps of "auto"; the beads are shaken as soon as they have come down."""


def document(case: str = "pile-ci", **changes: dict[str, Any]) -> dict[str, Any]:
    """A shipped case with changes; None takes a key away."""
    tables = read_toml(shipped("case")[case])
    for name, values in changes.items():
        table = {**tables.get(name, {}), **values}
        tables[name] = {key: value for key, value in table.items() if value is not None}
    return tables


def small(**changes: dict[str, Any]) -> Case:
    return build_case(document(**changes), name="pile-ci")


def placed(*beads: tuple[float, float, float], **changes: dict[str, Any]) -> Case:
    """Beads of a radius at x and z, mm, in the box of the shipped cluster."""
    tables = document("cluster", **changes)
    tables["placed"] = [
        {"radius": f"{r} mm", "at": [f"{x} mm", "0 mm", f"{z} mm"]} for r, x, z in beads
    ]
    return build_case(tables, name="cluster")


def test_a_pile_settles_is_shaken_and_is_whole(pile_run: Path) -> None:
    case, motion = small(run=HALF), read_motion(pile_run)
    assert case.mixture is not None
    assert read_json(pile_run / MANIFEST_NAME)["settled"] < case.run.settled_below
    assert sorted(motion.radius) == pytest.approx(sorted(case.all_radii))
    assert int(motion.large.sum()) == case.mixture.counts[1]
    assert motion.time[0] < 0.0
    assert motion.time[-1] == pytest.approx(case.run.cycles / case.excitation.frequency)
    np.testing.assert_allclose(np.diff(motion.time), case.run.steps_per_sample * case.run.time_step)
    # All beads are within the container, but for overlaps, and on its floor.
    room = case.boundary.width / 2.0 - motion.radius[:, None] + 1e-5
    assert (np.abs(motion.position[..., :2]) <= room).all()
    assert (motion.position[..., 2] >= motion.radius - 1e-5).all()
    agitation = (motion.velocity**2).sum(axis=2).mean(axis=1)
    start = motion.first_driven
    assert agitation[start] < 6e-3**2  # it is to begin below 5 mm/s, weighed by mass
    assert agitation[start + 3 :].min() > 1e-2**2


def test_bridges_and_tables_are_of_the_beads(pile_run: Path) -> None:
    motion, result = read_motion(pile_run), read_results(pile_run)
    frames, bed, members = list(read_bridges(motion)), result.table("bed"), result.table("members")
    assert len(frames) == len(motion.time) == len(bed)
    bridges, position, radius = frames[-1], motion.position[-1], motion.radius
    apart = np.linalg.norm(position[bridges.beads[:, 0]] - position[bridges.beads[:, 1]], axis=1)
    np.testing.assert_allclose(
        bridges.gap[: len(apart)], apart - radius[bridges.beads].sum(axis=1), atol=1e-9
    )
    beads, walls = bridges.at_walls
    on_floor = beads[walls == FLOOR_INDEX]
    assert len(on_floor) == len(set(on_floor.tolist())) > 3
    assert (position[on_floor, 2] - radius[on_floor] < 2e-4).all()
    at = np.searchsorted(bed["time"], members["time"])
    np.testing.assert_array_equal(members["height"], motion.position[at, members["bead"], 2])
    assert members.groupby("time")["track"].nunique().sum() == bed["clusters"].sum()
    # Contacts and bridges are counted at rest and while shaken, those to walls and the floor for none.
    rest = bed[bed["time"] <= 0.0].iloc[-1]
    late = bed[bed["time"] >= bed["time"][bed["time"] >= 0.0].mean()]
    assert rest["bridges"] == pytest.approx(2.0 * len(frames[rest.name].beads) / len(radius))
    for name in ("contacts", "bridges"):
        assert [result[f"{name}_at_rest"], result[f"{name}_shaken"]] == pytest.approx(
            [rest[name], late[name].mean()]
        )


def test_numbers_at_the_start_are_those_of_the_first_frame_of_the_drive(pile_run: Path) -> None:
    """Not of the first frame of the run, in which the beads still fall."""
    result = read_results(pile_run)
    bed = result.table("bed")
    driven = bed[bed["time"] >= 0.0]
    for name in ("surface", "brazil_nut"):
        assert bed[name].iloc[0] != driven[name].iloc[0] != driven[name].iloc[-1]
        assert result[f"{name}_start"] == pytest.approx(driven[name].iloc[0])
        assert result[f"{name}_end"] == pytest.approx(driven[name].iloc[-1])
    assert bed["time"].iloc[0] < 0.0
    assert result["settling"] == pytest.approx(-bed["time"].iloc[0])
    assert result["driven"] == pytest.approx(bed["time"].iloc[-1])


def test_both_frames_shake_alike(tmp_path: Path) -> None:
    """Until chaotic trajectories part; in the laboratory the container's motion is taken off at any phase."""
    run = {"duration": "0.03 s", "frames_per_second": 680.0, **QUICK}
    cases = [small(drive={"frame": frame}, run=run) for frame in ("container", "lab")]
    amplitude = cases[1].excitation.amplitude
    here, there = (walkers.run(case, tmp_path).motion.driven for case in cases)
    assert cases[1].run.samples_per_cycle == 4
    apart = np.sqrt(((here.position - there.position) ** 2).sum(axis=2).mean(axis=1))
    assert apart[:12].max() < 0.05 * amplitude
    agitation = [float((motion.velocity**2).sum(axis=2).mean()) for motion in (here, there)]
    assert agitation[0] == pytest.approx(agitation[1], rel=0.1)
    # The lowest beads lie on the floor throughout the cycle.
    assert np.abs((there.position[..., 2] - there.radius).min(axis=1)).max() < 0.2 * amplitude


@pytest.mark.parametrize(("shape", "walls"), [("cylinder", 1), ("octagon", 8)])
def test_a_container_holds_its_beads(shape: str, walls: int, tmp_path: Path) -> None:
    run = {"duration": "0.03 s", "frames_per_second": 680.0, **QUICK}
    case = small(boundary={"shape": shape, "width": "5 mm"}, run=run)
    motion = walkers.run(case, tmp_path).motion
    driven = motion.driven.position
    room = (
        case.boundary.geometry.side_clearance(driven.reshape(-1, 3)).reshape(driven.shape[:2])
        - motion.radius
    )
    assert -1e-5 < room.min() < 0.05 * 2.5e-3
    assert driven[..., :2].std() > 0.2 * 2.5e-3
    held = [
        bridges.at_walls[0, bridges.at_walls[1] != FLOOR_INDEX] for bridges in read_bridges(motion)
    ]
    assert sum(map(len, held)) >= 2
    assert all(
        set(bridges.at_walls[1].tolist()) <= set(range(1 + walls))
        for bridges in read_bridges(motion)
    )
    assert shape == "octagon" or all(len(beads) == len(set(beads.tolist())) for beads in held)


def test_all_walls_of_a_trough_are_side_walls(tmp_path: Path) -> None:
    """It is two slanted faces without a floor: what touches either is at a wall."""
    tables = document("pile-trough", mixture={"count": 20}, run={"duration": "0.02 s", **QUICK})
    done = walkers.run(build_case(tables, name="trough"), tmp_path)
    frames = list(read_bridges(done.motion))
    touched = [bridges.at_walls for bridges in frames]
    assert {0, 1} <= set(touched[-1][1].tolist())
    beads_at_walls = [len(set(beads.tolist())) for beads, _ in touched]
    assert done.table("bed")["at_wall"].tolist() == beads_at_walls


def test_a_climber_that_leaves_the_container_ends_the_run(tmp_path: Path) -> None:
    """It climbs at 8.6 mm/s; its upper bead is 3.2 mm below where the walls end; segments are of 0.05 s."""
    beads = [
        (radius, 2.5001 - radius, height) for radius, height in ((0.545, 2.0), (0.3075, 1.18135))
    ]
    case = placed(
        *beads, boundary={"height": "2.6 mm"}, run={"duration": "1 s", "segment": "0.05 s"}
    )
    finished = walkers.run(case, tmp_path)
    assert finished.result["driven"] == pytest.approx(3.2e-3 / 8.63e-3, abs=0.1)
    assert "over its walls" in read_json(finished.directory / MANIFEST_NAME)["ended"]
    assert "climbers left the container" in finished.describe()
    assert call("check", "files", str(finished.directory)).returncode == 0


def test_a_placed_dimer_climbs_like_the_climber_and_falls_the_other_way_round(
    tmp_path: Path,
) -> None:
    """The same dimer as that of `tests.test_bodies`, by the other way: a box, the pile's recording, clusters, climbs.

    It is as soft as that one; hard beads climb at 8.2 mm/s.
    On the wall across from it is a dimer led by its small bead.
    """
    radii = ((1, (0.545, 0.3075)), (-1, (0.3075, 0.545)))
    beads = [
        (r, side * (2.5001 - r), z)
        for side, pair in radii
        for r, z in zip(pair, (8.0, 7.18135), strict=True)
    ]
    finished = walkers.run(
        placed(*beads, run={"duration": "0.5 s"}, contact={"youngs_modulus": "50 MPa"}), tmp_path
    )
    assert finished.result["climbs"] == 1
    clusters = finished.table("clusters")
    (climb,) = clusters[clusters["climbed"]].to_dict("records")
    assert climb["speed"] * 1e3 == pytest.approx(8.63, rel=0.03)
    assert (climb["size"], climb["large"], climb["leader_large"], climb["wall_names"]) == (
        2,
        1,
        True,
        "+x",
    )
    assert climb["begin"] == pytest.approx(0.0, abs=0.05)
    assert finished.motion.position[-1, 2:, 2].max() < 7e-3


@pytest.mark.parametrize(("mixed_by", "counts"), [("mass", (80, 10)), ("number", (45, 45))])
def test_a_share_is_of_what_a_mixture_is_mixed_by(mixed_by: str, counts: tuple[int, int]) -> None:
    """Beads of twice the radius have eight times the volume, and the mass; the share is a half, of 90 beads."""
    case = small(
        mixture={
            "small": ["0.25 mm"] * 2,
            "large": ["0.5 mm"] * 2,
            "mixed_by": mixed_by,
            "count": 90,
        }
    )
    assert case.mixture is not None
    assert case.mixture.counts == counts
    by_height = small(mixture={"count": None, "fill_height": "2 mm"}).mixture
    assert (
        60 <= sum(by_height.counts) <= 90
    )  # a packing fraction of 0.55, with beads of 0.24 mm³ in the mean


def test_the_engine_counts_the_steps_of_a_rest_too() -> None:
    """2^31 steps of at most 2 us are 4,295 s: a drive of 4,000 s fits after a rest of 100 s, not after one of 300 s."""
    run = {"duration": "4000 s", "time_step": "2 us", "longest_settling": "100 s"}
    fits = small(run=run).run
    assert 3900.0 < fits.steps * fits.time_step < 4001.0
    with pytest.raises(
        InputError, match=r"run\.duration.*expected at most \d+ s: the engine counts steps"
    ):
        small(run={**run, "longest_settling": "300 s"})


def test_placed_beads_reach_the_side_of_a_cylinder() -> None:
    boundary = {"boundary": {"shape": "cylinder"}}
    radii = [0.545, 0.3075, 0.3075]
    case = placed(
        *((radius, 0.0, 8.0 - 2.0 * number) for number, radius in enumerate(radii)), **boundary
    )
    assert [radius > case.border for radius in case.all_radii] == [True, False, False]
    placed((0.545, 2.5 - 0.545 - 1e-3, 8.0), **boundary)
    with pytest.raises(InputError, match="within the boundary"):
        placed((0.545, 2.5 - 0.545 + 0.02, 8.0), **boundary)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, []),
        ({"mixture.small_share": 1}, ["no large beads"]),
        ({"mixture.small_share": 0}, ["no small beads"]),
        ({"run.until": "auto"}, [r"climbers faster than 7\.[67] mm/s"]),
        (
            {"run.time_step": "4 us"},
            [r"the time step is 2\.4 times the largest of auto \(0\.4 of the viscous"],
        ),
    ],
)
def test_what_is_said_of_a_pile_before_it_is_shaken(
    changes: dict[str, Any], told: list[str]
) -> None:
    """(2 · 40 mm - 41 µL/(0.55 (5.3 mm)²))/10 s is 7.7 mm/s."""
    found = notes(load_case("pile-small", changes))
    assert len(found) == len(told)
    assert all(re.match(one, other) for one, other in zip(told, found, strict=True))


@pytest.mark.parametrize(("cores", "share"), [(1, "share 1 core of"), (2, "")])
def test_more_processes_than_cores_are_noted_before_a_run(cores: int, share: str) -> None:
    ours = os.sched_getaffinity(0)
    if len(ours) < cores:
        pytest.skip(f"this machine has less than {cores} cores")
    os.sched_setaffinity(0, sorted(ours)[:cores])
    try:
        told = notes(load_case("pile-ci", {"run.ranks": 2}))
    finally:
        os.sched_setaffinity(0, ours)
    assert [f"2 MPI processes (run.ranks) {share}" in note for note in told] == [True] * bool(share)


def test_the_program_on_piles(pile_run: Path, in_folder: Path) -> None:
    import pyvista as pv

    def told(*command: str) -> str:
        return call(*command, check=True).stdout.strip()

    run, motion = str(pile_run), read_motion(pile_run)
    assert re.search(
        r"\n  beads +60\n(.*\n)*  bridges per bead to others, at rest ", told("run", run)
    )
    assert told("plot", run, "--to", "here") == "here/climb.png"
    assert spoilt(figures_of(read_results(pile_run))["climb"]) == []
    assert told("render", run, "--to", "here/box.png", "--images", "2") == "here/box.png"
    picture = pv.read(in_folder / "here" / "box.png")
    across, up, _ = picture.dimensions
    edges = picture.point_data.active_scalars.reshape(up, across, -1)[..., :3]
    assert all(
        (edge == 255).all() for edge in (edges[0], edges[-1], edges[:, 0], edges[:, -1])
    )  # nothing is cut
    reader = pv.get_reader(told("export", run, "--to", "vtk", "--every", "4", "-o", "here/vtk"))
    driven = np.flatnonzero(motion.time >= 0.0)[::4]
    np.testing.assert_allclose(reader.time_values, motion.time[driven], atol=1e-12)
    beads, bridges, box = (
        pv.read(f"here/vtk/{name}_{driven[1]:06d}.vtu") for name in ("beads", "bridges", "boundary")
    )
    np.testing.assert_allclose(beads.points, motion.position[driven[1]], rtol=1e-6, atol=1e-9)
    assert set(np.unique(beads["is_climber"])) <= {0, 1}
    assert bridges.n_cells > 50
    np.testing.assert_allclose(box.bounds, [-2e-3, 2e-3, -2e-3, 2e-3, 0.0, 20e-3], atol=1e-9)
    assert "in which the beads come to rest" in told("export", "pile-ci", "--to", "deck")


def test_a_pile_ends_with_the_segment_of_its_first_climb(tmp_path: Path) -> None:
    """Silicone oil climbs early; without ``until`` the same start is shaken for the whole time."""
    changes = {
        "liquid.name": "Si AK5",
        "run.seed": 3,
        "run.segment": "0.1 s",
        "run.duration": "0.8 s",
    }
    whole = walkers.run(load_case("pile-ci", changes), tmp_path)
    ended = walkers.run(load_case("pile-ci", {**changes, "run.until": "climb"}), tmp_path)
    assert whole.result["driven"] == pytest.approx(0.8, abs=0.02)
    onset = ended.result["onset"]
    assert onset == whole.result["onset"]
    assert onset < ended.result["driven"] < 0.7
    assert (
        read_json(ended.directory / MANIFEST_NAME)["ended"] == "a cluster has climbed (run.until)"
    )
    assert not ended.result.warnings or "climbers left" not in " ".join(ended.result.warnings)


@pytest.mark.parametrize(
    ("liquid", "modulus"),
    [
        ("water", 5e7),
        ("Si AK5", 2e8),
        ("ethylene glycol", 2e8),
        ("glycerol 87 %", 3.2e9),
        ("glycerol", 5.12e10),
    ],
)
def test_placed_beads_are_softened_less_in_more_viscous_liquids(
    liquid: str, modulus: float
) -> None:
    """The lowest modulus at which bridges delay no contact by more than 0.025 rad; 51.2 GPa at most."""
    case = load_case("cluster", {"liquid.name": liquid})
    assert case.contact.youngs_modulus == modulus
    assert largest_delay(case) < (0.025 if liquid != "glycerol" else 0.05)
    if modulus > 5e7:
        softer = load_case(
            "cluster", {"liquid.name": liquid, "contact.youngs_modulus": f"{modulus / 4} Pa"}
        )
        assert largest_delay(softer) > 0.025


def test_the_delay_of_loose_beads_is_the_resistance_of_a_bridge_over_the_stiffness_of_its_contact() -> (
    None
):
    """2πfN/k of the largest bead at the wall: N = 6πηR²/(σ + h_c), k = 2E*√(Rδ), δ from its bridge's pull."""
    case = load_case("cluster", {"contact.youngs_modulus": "50 MPa"})
    radius, liquid = 0.545e-3, case.liquid.of_bridges
    gap = case.contact.roughness.bead_wall + 2.0 * liquid.surface_tension / 101_325.0
    resistance = 6.0 * np.pi * liquid.viscosity * radius**2 / gap
    modulus = 5e7 / (2.0 * (1.0 - case.contact.poissons_ratio**2))
    pull = bridge_at_rest(case, radius, np.inf).pull
    overlap = (3.0 * pull / (4.0 * modulus * np.sqrt(radius))) ** (2.0 / 3.0)
    stiffness = 2.0 * modulus * np.sqrt(radius * overlap)
    expected = 2.0 * np.pi * case.excitation.frequency * resistance / stiffness
    assert delay_of_loose_beads(case) == pytest.approx(expected, rel=1e-12)
    assert expected == pytest.approx(0.336, abs=0.001)


def test_a_mixture_is_hardened_as_far_as_its_time_step_stays() -> None:
    soft, thick = (
        load_case("pile-small", {"liquid.name": name}) for name in ("glycerol 87 %", "glycerol")
    )
    assert soft.contact.youngs_modulus == 5e7
    assert thick.contact.youngs_modulus == 1.28e10
    same = load_case("pile-small", {"liquid.name": "glycerol", "contact.youngs_modulus": "50 MPa"})
    assert thick.run.time_step == same.run.time_step


@pytest.mark.parametrize(
    ("modulus", "error"), [("50 MPa", "up to 9 %"), ("10 MPa", "up to 12 %"), ("3.2 GPa", None)]
)
def test_results_say_how_far_soft_beads_change_speeds(modulus: str, error: str | None) -> None:
    warning = softness_warning(load_case("cluster", {"contact.youngs_modulus": modulus}))
    assert (warning is None) if error is None else (error in str(warning))


def test_results_of_very_soft_beads_are_called_wrong() -> None:
    """In glycerol, contacts of beads of 5 MPa are late by 18 rad; speeds were measured up to 3.8 rad."""
    case = load_case("cluster", {"liquid.name": "glycerol", "contact.youngs_modulus": "5 MPa"})
    assert delay_of_loose_beads(case) > 10.0
    assert "wrong, even in their direction" in str(softness_warning(case))
