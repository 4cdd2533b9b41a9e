"""Forces of the walls that decks add: where they are, and their formulas. The audit measures them."""

import math
import tomllib
from collections.abc import Callable
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import make_case
from walkers.inputs import load_case, resolve_case, shipped_cases
from walkers.inputs.boundary import Boundary, Box, Channel, Cylinder, Face, Groove, Plane
from walkers.physics.film import film_drag, film_thickness
from walkers.physics.lubrication import normal_drag, normal_drag_at_wall
from walkers.templates import render_deck
from walkers.templates.scene import Bead
from walkers.templates.wall_forces import WallForces, formula_walls, wall_forces

PLACES = np.random.default_rng(1).uniform(-1e-3, 1e-3, (50, 3))
"""m; in all of the boundaries."""


def nearest_first(boundary: Boundary, place: tuple[float, float, float], **moved: float) -> list[float]:
    """What the engine's formulas give, m."""
    names = dict(zip("xyz", place, strict=True)) | {name: getattr(math, name) for name in ("cos", "sin", "atan2")}
    names |= {"abs": abs, "round": round} | moved  # type: ignore[dict-item]
    walls = formula_walls(boundary.faces(), "".join(name[-1] for name in moved))
    return sorted(eval(wall.distance, {}, names) for wall in walls)


def across(boundary: Boundary) -> Callable[[float, float, float], list[float]]:
    """The same from the boundary's own geometry: the floor, and the nearest wall of each pair."""
    half = boundary.inner_width / 2.0
    known: dict[type[Boundary], Callable[[float, float, float], list[float]]] = {
        Plane: lambda x, y, z: [z],
        Channel: lambda x, y, z: [z, half - abs(y)],
        Box: lambda x, y, z: [z, half - abs(x), half - abs(y)],
        Cylinder: lambda x, y, z: [z, boundary.side_clearance(x, y)],
    }
    return known[type(boundary)]


@pytest.mark.parametrize(
    "boundary",
    [
        Plane(material="glass"),
        Channel(material="glass", width=5e-3),
        Box(material="glass", width=5e-3, height=0.02),
        Cylinder(material="glass", width=5e-3, height=0.02),
    ],
    ids=lambda one: one.shape,
)
def test_the_engines_formulas_are_distances_from_the_walls(boundary: Boundary) -> None:
    for x, y, z in PLACES:
        assert nearest_first(boundary, (x, y, z)) == pytest.approx(sorted(across(boundary)(x, y, z)), abs=1e-12)


def test_in_a_groove_they_are_those_from_its_two_walls() -> None:
    groove = Groove(material="glass", opening=pi / 2.0)
    for x, y, z in PLACES:
        expected = sorted([(z + y) / sqrt(2.0), (z - y) / sqrt(2.0)])
        assert nearest_first(groove, (x, y, z)) == pytest.approx(expected, abs=1e-9)


def test_walls_that_move_are_followed() -> None:
    box = Box(material="glass", width=5e-3, height=0.02)
    at = (1e-3, 2e-4, 5e-3)
    assert nearest_first(box, at, v_wall_z=1e-4) == pytest.approx([1.5e-3, 2.3e-3, 4.9e-3])


def test_a_film_is_as_thick_as_a_bridge_reaches() -> None:
    case = make_case(liquid={"film_drag_ratio": 2.0, "volume_fraction": 0.02})
    files, liquid = render_deck(case).files, case.liquid
    number, *lines = files["reach.txt"].splitlines()
    assert int(number) == case.count == len(lines)
    reaches = [float(line.split()[1]) for line in lines]
    drags = [float(line.split()[1]) for line in files["film_drag.txt"].splitlines()[1:]]
    for radius, reach, drag in zip(case.all_radii, reaches, drags, strict=True):
        volume = 0.5 * 4.0 / 3.0 * pi * radius**3 * 0.02
        assert reach == pytest.approx(radius + volume ** (1.0 / 3.0))
        assert reach == pytest.approx(radius + film_thickness(radius, liquid.volume_fraction, liquid.contact_angle))
        assert drag == pytest.approx(film_drag(2.0 * 5e-6 * 920.0, radius))


Vector = tuple[float, float, float]
ONE = Bead(1, (0.0, 0.0, 0.0), 3e-4)


def evaluated(forces: WallForces, place: Vector, velocity: Vector) -> list[float]:
    """What the engine's formulas give for one bead, N."""
    names: dict[str, Any] = {name: getattr(math, name) for name in ("sqrt", "cos", "sin", "atan2")}
    names |= {"abs": abs, "round": round} | {f"v_{name}": share[ONE.id] for name, share in forces.shares.items()}
    names |= dict(zip("xyz", place, strict=True)) | dict(zip(("vx", "vy", "vz"), velocity, strict=True))
    return [float(eval(forces.formulas.get(axis, "0"), {}, names)) for axis in "xyz"]


def dragged(boundary: Boundary, place: Vector, velocity: Vector) -> list[float]:
    """The velocity that a film drags of a bead with a radius of 0.3 mm, m/s."""
    liquid = load_case("pile-small").liquid
    film = wall_forces([ONE], [0.1], liquid, boundary.faces(), minimum_separation_ratio=None)
    return [force / -film_drag(0.1, ONE.radius) for force in evaluated(film, place, velocity)]


V = (0.03, -0.02, 0.05)


def test_films_drag_along_their_walls() -> None:
    box = Box(material="glass", width=5e-3, height=0.02)
    assert dragged(box, (0.0, 0.0, 5e-3), V) == [0.0, 0.0, 0.0]
    assert dragged(box, (0.0, 0.0, 3e-4), V) == pytest.approx([V[0], V[1], 0.0])
    assert dragged(box, (-2.2e-3, 0.0, 5e-3), V) == pytest.approx([0.0, V[1], V[2]])
    assert dragged(box, (2.2e-3, 2.2e-3, 5e-3), V) == pytest.approx([V[0], V[1], 2.0 * V[2]])
    assert dragged(box, (2.2e-3, -2.2e-3, 3e-4), V) == pytest.approx([2.0 * V[0], 2.0 * V[1], 2.0 * V[2]])
    narrow = Channel(material="glass", width=7e-4)
    assert dragged(narrow, (0.0, 0.0, 5e-3), V) == pytest.approx([2.0 * V[0], 0.0, 2.0 * V[2]])


def test_in_a_cylinder_and_a_groove_what_is_normal_to_the_wall_is_left_out() -> None:
    round_one = Cylinder(material="glass", width=5e-3, height=0.02)
    turn = round_one.faces()[5].turn
    outward, along = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    velocity = tuple(float(part) for part in 0.04 * outward + 0.03 * along + np.array([0.0, 0.0, 0.02]))
    place = tuple(float(part) for part in 2.2e-3 * outward + np.array([0.0, 0.0, 5e-3]))
    expected = 0.03 * along + np.array([0.0, 0.0, 0.02])
    assert dragged(round_one, place, velocity) == pytest.approx(expected.tolist())  # type: ignore[arg-type]
    assert dragged(round_one, (0.0, 0.0, 5e-3), V) == [0.0, 0.0, 0.0]
    groove = Groove(material="glass", opening=pi / 2.0)
    normal = np.array([0.0, 1.0, 1.0]) / sqrt(2.0)  # of the wall to the right; the other one is out of reach
    at = (0.0, -1e-3, 1e-3 + 3.2e-4 * sqrt(2.0))
    expected = np.array(V) - np.dot(V, normal) * normal
    assert dragged(groove, at, V) == pytest.approx(expected.tolist())


def test_piles_have_a_film_on_each_of_their_walls() -> None:
    """The shipped ones: the floor drags what goes sideways, the walls also what climbs."""
    deck = render_deck(load_case("pile-small")).text
    loads = {line.split()[1]: line for line in deck.splitlines() if line.startswith("variable        load_")}
    assert [loads[f"load_{axis}"].count("<v_reach") for axis in "xyz"] == [3, 3, 3]


def test_without_a_film_the_deck_has_none() -> None:
    assert "film" not in render_deck(make_case()).text


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.0])
def test_an_open_bridge_gets_the_half_that_the_engine_leaves_out(turn: float) -> None:
    """Twice 6πηR*/max(ε, h/R*) with R* = R/2, and the rest of a plane's, at the sides of a round wall."""
    liquid, radius, nearest = load_case("pile-small").liquid, ONE.radius, 0.02
    round_one = Cylinder(material="glass", width=5e-3, height=0.02)
    forces = wall_forces([ONE], [0.0], liquid, round_one.faces(), minimum_separation_ratio=nearest)
    side = min(round_one.faces()[1:], key=lambda face: abs((face.turn - turn) % (2.0 * pi)))
    inward = np.array(side.normal)
    reach = forces.shares["reach"][1] - radius
    for gap in (-1e-7, 0.0, 0.3 * nearest * radius, 0.7 * nearest * radius, 1.5 * nearest * radius, 0.99 * reach):
        place = (radius + gap - 2.5e-3) * inward + np.array([0.0, 0.0, 5e-3])
        expected = normal_drag_at_wall(liquid.dynamic_viscosity, radius, nearest, gap)
        expected -= 2.0 * normal_drag(liquid.dynamic_viscosity, radius / 2.0, nearest, gap)
        found = evaluated(forces, tuple(place), V)  # type: ignore[arg-type]
        assert found == pytest.approx((-expected * (inward @ V) * inward).tolist(), rel=1e-9, abs=1e-15)
    beyond = (radius + 1.01 * reach - 2.5e-3) * inward + np.array([0.0, 0.0, 5e-3])
    assert evaluated(forces, tuple(beyond), V) == [0.0, 0.0, 0.0]  # type: ignore[arg-type]


def test_bridges_that_break_before_anything_is_missing_get_nothing() -> None:
    assert wall_forces(
        [ONE], [0.0], load_case("pile-small").liquid, [Face("z", 1, (0.0, 0.0, 0.0))], minimum_separation_ratio=1.0
    ) == WallForces({}, {})


def test_the_film_goes_on_after_a_restart_and_slows_what_falls(tmp_path: Path) -> None:
    """Three beads slide down a wall without friction, in one part, in several, and without a film."""

    def end(film: float, segment: str) -> float:
        tables = tomllib.loads(shipped_cases()["cluster"].read_text())
        tables["liquid"] |= {"film_drag_ratio": film}
        tables["contact"] = {"friction": {"bead_bead": 0.0, "bead_wall": 0.0}, "rolling_friction": 0.0}
        tables["drive"]["peak_acceleration"] = "1 g"
        tables["run"] = {"duration": "0.12 s", "segment": segment, "longest_settling": "0.05 s"}
        motion = walkers.run(resolve_case(tables, name="falling"), tmp_path).motion
        return float(motion.position[-1, 0, 2] - motion.position[0, 0, 2])

    whole, bare = end(3.0, "1 s"), end(0.0, "1 s")
    assert end(3.0, "0.04 s") == pytest.approx(whole, abs=1e-7)
    assert bare < 2.0 * whole < 0.0  # 2.9 times as far
