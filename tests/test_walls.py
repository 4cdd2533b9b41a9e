"""Walls of the contact model: what they tell of contacts, where they stand, and commands that are refused."""

from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from walkers.check.scenes import DRY, FLOOR, Bench, bench_case, over, prescribed, recording, standing
from walkers.inputs.boundary import Flat, Round, Wall
from walkers.physics.contact import hertz_overlap, reduced_modulus
from walkers.postprocess.dump import FloatArray, local_frames
from walkers.runner.binary import find_engine
from walkers.runner.failures import EngineError
from walkers.templates.deck import Checkpoint, Plan, compose
from walkers.templates.layout import WALL_BRIDGES
from walkers.templates.scene import Bead

RADIUS, GRAVITY = 3e-4, 9.81


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(find_engine(), tmp_path)


def _rows(bench: Bench, plan: Plan) -> tuple[FloatArray, FloatArray]:
    """Contacts of the last step, all columns, and the beads' places then."""
    plan = replace(plan, recording=replace(plan.recording, wall_bridge_columns=WALL_BRIDGES))
    series = bench.run(plan)
    *_, (_, rows) = local_frames(series.directory / "bridges.walls.txt", WALL_BRIDGES)
    return rows, series.frames[-1, :, :3]


def test_a_bead_at_rest_in_a_cylinder_presses_with_its_weight(bench: Bench) -> None:
    """The cylinder lies on its side: the overlap is Hertz's, the nearest point on the lowest line."""
    case = bench_case(
        liquid=DRY, contact={"restitution": 0.3}, environment={"gravity": f"{GRAVITY} m/s^2"},
        boundary={"tilt": "90 deg", "uphill": "90 deg"},
    )  # fmt: skip
    wall, weight = Round(3e-3), 4.0 / 3.0 * pi * RADIUS**3 * case.density * GRAVITY
    overlap = hertz_overlap(weight, RADIUS, reduced_modulus(case.contact.youngs_modulus, case.contact.poissons_ratio))
    bead = Bead(0, (0.0, -(wall.radius - RADIUS + overlap), 5e-3), RADIUS)
    (row,), _ = _rows(bench, Plan(case, standing([bead], [FLOOR, wall]), recording(20_000, 20_000)))
    told = dict(zip(WALL_BRIDGES, row.tolist(), strict=True))
    assert told["overlap"] == pytest.approx(overlap, rel=1e-4)
    assert (told["fx"], told["fy"], told["fz"]) == pytest.approx((0.0, weight, 0.0), rel=1e-4, abs=1e-6 * weight)
    assert (told["x"], told["y"], told["z"]) == pytest.approx((0.0, -wall.radius, 5e-3), abs=1e-12)
    assert (told["wall"], told["id"]) == (1, 1)


def test_walls_are_as_far_as_the_boundary_says(bench: Bench) -> None:
    """Planes in any direction and a cylinder: overlaps and nearest points are those of `walkers.inputs.boundary`."""
    walls: list[Wall] = [Flat((1e-4, 2e-4, -3e-4), (0.48, -0.36, 0.8), "leaning"), Round(2.5e-3)]
    turn, out = 2.0, 2.5e-3 - RADIUS + 1e-6
    beads = [over(walls[0], -1e-6, RADIUS), Bead(0, (out * cos(turn), out * sin(turn), 4e-3), RADIUS)]  # type: ignore[arg-type]
    rows, places = _rows(bench, prescribed(bench_case(), standing(beads, walls), 3))
    assert rows[:, WALL_BRIDGES.index("wall")].tolist() == [0, 1]
    for wall, row, place in zip(walls, rows, places, strict=True):
        distance, normal = float(wall.distances(place)), wall.normals(place)
        np.testing.assert_allclose(row[:3], place - distance * normal, atol=1e-12)
        np.testing.assert_allclose(row[3:6], place, atol=1e-12)
        assert row[-1] == pytest.approx(RADIUS - distance, abs=1e-13)


REFUSED = {
    "plane 0 0 0 0 0 1": "expected a type",
    "type 3 plane 0 0 0 0 0 1": "expected a type",
    "type 2": "expected a plane or a cylinder",
    "type 2 plane 0 0 0 0 0 0": "a normal of no length",
    "type 2 cylinder 0 0 -1": "a radius that is not above 0",
    "type 2 cylinder 0 0": "ends early",
    "type 2 wobble": "unknown keyword wobble",
    "type 2 plane 0 0 0 0 0 1 frame moon": "expected lab or walls, not moon",
    "type 2 plane 0 0 0 0 0 1 loads missing.txt": "missing.txt has no loads",
    "type 2 plane 0 0 0 0 0 1 loads bridges.txt": "bridges.txt has no loads",
}


@pytest.mark.parametrize("command", REFUSED)
def test_commands_that_are_refused(bench: Bench, command: str) -> None:
    deck = compose(prescribed(bench_case(), standing([over(FLOOR, 0.0, RADIUS)]), 3))
    lines = deck.text.replace("&\n", " ").splitlines()
    changed = [f"fix walls all wall/bridge {command}" if "wall/bridge" in line else line for line in lines]
    with pytest.raises(EngineError, match=REFUSED[command]):
        bench.run(replace(deck, text="\n".join([*changed, ""])))


def test_a_restart_with_other_walls_is_refused(bench: Bench) -> None:
    case, beads = bench_case(), [over(FLOOR, -1e-6, RADIUS)]
    first = prescribed(case, standing(beads), 10, checkpoint=Checkpoint(write="half.restart"))
    carry = bench.run(first).directory / "half.restart"
    scene = standing(beads, [FLOOR, Round(2.5e-3)])
    second = replace(first, recording=replace(recording(20), begin=10), checkpoint=Checkpoint(read="half.restart"))
    with pytest.raises(EngineError, match="another number of walls"):
        bench.run(replace(second, scene=scene), carry)
