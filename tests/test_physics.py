"""The walker's speeds against measured values and symmetries, by the real engine."""

from collections.abc import Callable
from dataclasses import replace
from math import sin
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import make_case
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import by_name
from walkers.postprocess.gait import Walk, gait, settled_samples, walk
from walkers.postprocess.motion import Group
from walkers.runner.binary import find_engine
from walkers.runner.directory import write_deck
from walkers.runner.launch import launch
from walkers.templates.deck import render_deck

Walked = Callable[..., Walk]
Moved = Callable[..., Group]
MM_PER_S = 1e-3


@pytest.mark.parametrize(("acceleration", "velocity"), [("2 g", 1.375), ("4 g", 3.806), ("6 g", 5.391), ("8 g", 7.045)])
def test_velocity_against_acceleration_by_soulie(walked: Walked, acceleration: str, velocity: float) -> None:
    # Measured with an independent prototype deck; other engines with the same forces agree within 0.4 %.
    found = walked(drive={"peak_acceleration": acceleration}, liquid={"law": "soulie"}).velocity[0]
    assert found == pytest.approx(velocity * MM_PER_S, rel=0.01)


@pytest.mark.parametrize(
    ("friction", "liquid", "acceleration", "velocity", "rotation", "sliding"),
    [
        (0.07, {}, "2 g", 2.37, 2.39, None),  # Fig. 4a: published 2.3, the large bead rotating with hardly any sliding
        (None, {"name": "Si AK10"}, "10 g", 8.54, 11.13, -2.52),  # Fig. 4b: published 8.0, 13.3 and -5.3
    ],
)
def test_the_large_bead_rolls_at_moderate_drive_and_slides_at_a_strong_one(
    trajectory: Moved, friction: float, liquid: dict[str, str], acceleration: str, velocity: float, rotation: float,
    sliding: float | None,
) -> None:  # fmt: skip
    moved = trajectory(
        dimers={"radii": ["0.6 mm", "0.3 mm"]},
        drive={"peak_acceleration": acceleration},
        contact={"friction": {"bead_bead": friction, "bead_wall": friction}} if friction else {},
        liquid={"law": "soulie", **liquid},
    )
    motion, samples = gait(moved), settled_samples(moved)
    turns, slides = (part[samples, 0].mean(axis=0) / MM_PER_S for part in (motion.rotation, motion.sliding))
    assert walk(moved).velocity[0] / MM_PER_S == pytest.approx(velocity, rel=0.02)
    assert turns[0] == pytest.approx(rotation, rel=0.02)
    assert slides[0] == pytest.approx(sliding, rel=0.02) if sliding else abs(slides[0]) < 0.05 * slides[1]


def test_symmetric_dimer_does_not_walk(walked: Walked) -> None:
    assert abs(walked(dimers={"radii": ["0.25 mm", "0.25 mm"]}).velocity[0]) < 0.01 * MM_PER_S
    # As shipped it leaves the axis meanwhile: a hundredth of a walker's 1.3 mm/s.
    shipped = load_case("symmetric")
    shorter = shipped.but(run=shipped.run.but(cycles=30, settling_cycles=10))
    assert np.all(np.abs(walked(shorter).velocity) < 0.02 * MM_PER_S)


def test_exchanged_beads_walk_the_other_way_at_the_same_speed(walked: Walked) -> None:
    there, back = walked(), walked(dimers={"radii": ["0.2 mm", "0.3 mm"]})
    assert back.axial_velocity[0] == pytest.approx(-there.axial_velocity[0], rel=1e-3)
    assert back.velocity[0] == pytest.approx(there.velocity[0], rel=1e-3)  # toward the large bead in both
    assert walked(dimers={"facing": "left"}).axial_velocity[0] == pytest.approx(-there.axial_velocity[0], rel=1e-3)


def test_laboratory_and_container_frame_agree(walked: Walked) -> None:
    """To the square of ω times the step."""
    run = {"cycles": 12, "settling_cycles": 4}
    laboratory, container = (walked(drive={"frame": frame}, run=run) for frame in ("lab", "container"))
    assert container.velocity[0] == pytest.approx(laboratory.velocity[0], rel=1e-5)


@pytest.mark.parametrize("frame", ["lab", "container"])
def test_bridges_drag_rolling_beads_that_nothing_else_holds(trajectory: Moved, frame: str) -> None:
    """Without friction the bridges' resistances and inertia alone: M du/dt = -K u - M a(t), u = (v, R1 ω1, R2 ω2)."""
    moved = trajectory(
        liquid={"viscosity_ratio": 20.0},
        contact={"friction": {"bead_bead": 0.0, "bead_wall": 0.0}},
        drive={"peak_acceleration": "1 g", "frame": frame},
        run={"cycles": 20, "settling_cycles": 10},
    )
    case, dimer = moved.case, dimer_of(moved.case)
    inertia = np.diag([dimer.total_mass, *(0.4 * mass for mass in dimer.masses)])
    answer = np.linalg.solve(
        1j * case.excitation.largest.angular_frequency * inertia + _resistance(case),
        np.array([dimer.total_mass * case.excitation.peak_acceleration, 0.0, 0.0]),
    )
    settled = settled_samples(moved)
    found = np.sqrt(2.0 * np.mean(moved.velocity[settled, 0, :, 0] ** 2, axis=0))
    np.testing.assert_allclose(found, abs(answer[0]), rtol=2e-4)


def _resistance(case: Case) -> np.ndarray:
    """K of a dimer at rest whose contacts are closed, shape (3, 3), by `walkers.physics.bridge`.

    Along x and about y: n × y is -x at the floor; between the beads, where both go at v, only they slide.
    """
    large, small = case.walkers[0].radii
    total = np.zeros((3, 3))
    for radius, other, slides, rolls in (
        (large, np.inf, [1.0, -1.0, 0.0], [0.0, -1.0 / large, 0.0]),
        (small, np.inf, [1.0, 0.0, -1.0], [0.0, 0.0, -1.0 / small]),
        (small, large, [0.0, 1.0, 1.0], [0.0, -1.0 / large, 1.0 / small]),
    ):
        surfaces = Surfaces.of(radius, other, case.liquid.of_bridges, case.contact.minimum_separation_ratio)
        _, _, sliding, coupling, rolling = by_name(case.liquid.law)(surfaces).forces(np.zeros(1)).columns()[0]
        motions = np.array([slides, rolls])
        total += motions.T @ np.array([[sliding, coupling], [coupling, rolling]]) @ motions
    return total


@pytest.mark.parametrize(("frequency", "step", "samples"), [("60 Hz", "auto", 7), ("83.7 Hz", "1.7 us", 20)])
def test_a_cycle_is_a_whole_multiple_of_the_sampling_interval(frequency: str, step: str, samples: int) -> None:
    case = make_case(drive={"frequency": frequency}, run={"time_step": step, "samples_per_cycle": samples})
    assert case.run.steps_per_cycle % samples == 0
    assert case.run.steps_per_cycle * case.run.time_step * case.excitation.frequency == pytest.approx(1.0, rel=1e-14)
    assert step == "auto" or case.run.time_step <= 1.7e-6 * (1 + 1e-12)


@pytest.mark.parametrize("frame", ["lab", "container"])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_substrate_moves_as_prescribed(trajectory: Moved, axis: str, frame: str) -> None:
    """A sin ωt along the axis, zero across: of the walls that move, or are held in thought; walkers start at rest."""
    moved = trajectory(drive={"axis": axis, "frame": frame}, run={"cycles": 4, "settling_cycles": 1})
    drive, motion, along = moved.case.excitation, moved.motion, "xyz".index(axis)
    phase = drive.largest.angular_frequency * moved.time
    places, speeds = motion.substrate, motion.substrate_velocity[:, along]
    np.testing.assert_allclose(places[:, along], drive.amplitude * np.sin(phase), atol=1e-9 * drive.amplitude + 1e-15)
    np.testing.assert_allclose(speeds, drive.peak_velocity * np.cos(phase), atol=1e-9 * drive.peak_velocity)
    assert not np.any(np.delete(places, along, axis=1))
    assert np.abs(moved.velocity[0]).max() < 1e-12


def test_bead_on_a_still_substrate_stays_where_it_is(trajectory: Moved) -> None:
    """Started in the equilibrium of capillary, elastic and gravity forces: nothing moves by more than a nanometre."""
    moved = trajectory(drive={"peak_acceleration": "0 g"}, run={"cycles": 4, "settling_cycles": 1})
    assert np.abs(moved.position - moved.position[:1]).max() < 2e-8
    first = moved.position[0, 0]
    assert first[0, 2] < moved.radii[0]


def test_rolling_friction_turns_a_walker_to_the_axis_and_a_symmetric_dimer_away(trajectory: Moved) -> None:
    contact = {
        "friction": {"bead_bead": 0.2, "bead_wall": 0.2},
        "rolling_friction": 0.003,
        "minimum_separation_ratio": 1.0,
    }
    liquid = {"dynamic_viscosity": "100 mPa*s"}
    common = {"contact": contact, "liquid": liquid, "run": {"cycles": 40, "settling_cycles": 20}}
    asymmetric = trajectory(dimers={"angle": "5 deg"}, **common).orientation[-1, 0]
    symmetric = trajectory(dimers={"radii": ["0.25 mm", "0.25 mm"], "angle": "5 deg"}, **common).orientation[-1, 0]
    assert abs(sin(asymmetric)) < 0.5 * sin(np.radians(5.0))
    assert abs(sin(symmetric)) > 2.0 * sin(np.radians(5.0))


# --- replicates -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ensemble() -> Case:
    """The shipped walker of Fig. 1b, six replicates, ten cycles."""
    case = load_case("fig1b")
    return case.but(run=case.run.but(cycles=10, settling_cycles=4, until_steady=False))


def test_replicates_are_perturbed_and_keep_their_distance(trajectory: Callable[..., Group], ensemble: Case) -> None:
    moved = trajectory(ensemble)
    assert [walker.facing for walker in moved.walkers] == [1, -1, 1, -1, 1, -1]
    angles = [walker.start_angle for walker in moved.walkers]
    assert len(set(angles)) == 6
    assert max(map(abs, angles)) <= np.radians(1.0)
    np.testing.assert_allclose(moved.orientation[0], angles, atol=1e-12)
    overlaps = moved.radii[0] - moved.position[0, :, 0, 2]
    assert len(set(overlaps)) == 6
    assert np.all(overlaps > 0.0)
    centre = moved.mass_centre[..., :2]
    first, second = np.triu_indices(6, 1)
    assert np.linalg.norm(centre[:, first] - centre[:, second], axis=-1).min() > 0.5 * ensemble.walkers[0].spacing
    other = {walker.start_angle for walker in render_deck(ensemble.put("run.seed", 2)).layout.walkers}
    assert not other & set(angles)


def test_reporting_bridges_does_not_disturb_the_walkers(tmp_path: Path, ensemble: Case) -> None:
    """The engine evaluates contacts once more to report them; that must leave no trace in the motion."""
    deck = render_deck(ensemble)
    reports = ("compute pair_bridges", "dump pairs", "dump walls", "dump_modify pairs", "dump_modify walls")
    silent = [line for line in deck.text.splitlines() if not " ".join(line.split()).startswith(reports)]
    assert len(silent) == len(deck.text.splitlines()) - len(reports)
    dumps = []
    for name, text in (("reporting", deck.text), ("silent", "\n".join(silent) + "\n")):
        directory = tmp_path / name
        directory.mkdir()
        frames = deck.layout.bridge_frames if name == "reporting" else 0
        changed = replace(deck, text=text, layout=replace(deck.layout, bridge_frames=frames))
        write_deck(changed, directory)
        launch(changed, directory, find_engine())
        dumps.append((directory / "beads.bin").read_bytes())
    assert (tmp_path / "reporting" / "bridges.pairs.txt").exists()
    assert not (tmp_path / "silent" / "bridges.pairs.txt").exists()
    assert dumps[0] == dumps[1]
