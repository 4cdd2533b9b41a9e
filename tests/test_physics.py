"""Laws of bridges and limits of the time step.

Expected values are closed forms, published numbers, and other solutions of the same equations.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import asin, atan2, cos, cosh, inf, isfinite, log, pi, radians, sin, sinh, sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import call, document, make_case
from walkers import run as run_case
from walkers.arrays import FloatArray
from walkers.inputs.bridge_laws import by_name
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case
from walkers.inputs.resolving.length import limits_of
from walkers.inputs.resolving.loads import bridge_at_rest, delay_of_walkers
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.materials import Roughness
from walkers.physics import reynolds
from walkers.physics.bridge import Surfaces
from walkers.physics.capillary import (
    BridgeLiquid,
    largest_normal,
    rupture_distance_of_lian,
    share_of_bead,
)
from walkers.physics.laplace import force_curve, rupture_distance
from walkers.physics.laws import LAWS, rabinovich, willett, young_laplace
from walkers.physics.time_step import recommended_fractions
from walkers.runs.preview import summarise

pytestmark = pytest.mark.filterwarnings("ignore::walkers.inputs.bridge_laws.ExecutedLawWarning")

AIR_PRESSURE = 101_325.0
"""Standard atmosphere, Pa: a liquid cavitates where the pressure is lower by this."""


def surfaces(
    radius: float = 1.0,
    other_radius: float = inf,
    *,
    volume: float = 0.02,
    contact_angle: float = 0.0,
    roughness: float = 1e-3,
) -> Surfaces:
    """Two surfaces with a bridge of viscosity and surface tension 1, in any unit of length."""
    liquid = BridgeLiquid(
        surface_tension=1.0, viscosity=1.0, volume_fraction=0.01, contact_angle=contact_angle
    )
    return Surfaces(radius, other_radius, volume, liquid, roughness)


def smooth(pair: Surfaces) -> Surfaces:
    """The same surfaces without roughness, with a liquid that does not cavitate."""
    return replace(pair, roughness=0.0, liquid=replace(pair.liquid, surface_tension=0.0))


# --- the equation of Young and Laplace --------------------------------------------------------


@dataclass(frozen=True)
class Profile:
    """A surface in closed form: its radius at a height z, and the slope dr/dz there."""

    radius: Callable[[float], float]
    slope: Callable[[float], float]
    force: float
    """F/γ."""
    pressure: float
    """Excess pressure over γ."""


def catenoid_radius(z: float) -> float:
    return 0.5 * cosh(2.0 * z)


def catenoid_slope(z: float) -> float:
    return sinh(2.0 * z)


def cylinder_radius(_: float) -> float:
    return 0.5


def cylinder_slope(_: float) -> float:
    return 0.0


def sphere_radius(z: float) -> float:
    return sqrt(0.6**2 - z**2)


def sphere_slope(z: float) -> float:
    return -z / sqrt(0.6**2 - z**2)


PROFILES = [
    # F/γ = 2πr at the neck of radius 1/2; the two curvatures cancel each other.
    pytest.param(Profile(catenoid_radius, catenoid_slope, force=pi, pressure=0.0), id="catenoid"),
    # F/γ = 2πr - pπr² with p = 1/r.
    pytest.param(
        Profile(cylinder_radius, cylinder_slope, force=0.5 * pi, pressure=2.0), id="cylinder"
    ),
    # p = 2/0.6, and what p and γ exert on the equator cancels.
    pytest.param(Profile(sphere_radius, sphere_slope, force=0.0, pressure=2.0 / 0.6), id="sphere"),
]
"""Surfaces of Orr, Scriven and Rivas (1975), doi 10.1017/S0022112075000572."""


@dataclass(frozen=True)
class Cap:
    """The part of a solid that a bridge wets."""

    height: float
    volume: float
    filling_angle: float

    @classmethod
    def of_solid(cls, radius: float, foot: float) -> Cap:
        """The cap of a sphere whose rim has the radius ``foot``; a plane has none."""
        if radius == inf:
            return cls(0.0, 0.0, 0.0)
        angle = asin(foot / radius)
        height = radius * (1.0 - cos(angle))
        return cls(height, pi / 6.0 * height * (3.0 * foot**2 + height**2), angle)


def foot_of(radius: float, arc: float) -> float:
    """The radius of a wetting line whose arc from the apex of its solid is given."""
    if radius == inf:
        return arc
    return radius * sin(arc / radius)


@pytest.mark.parametrize("upper_radius", [1.0, 0.7, inf])
@pytest.mark.parametrize("profile", PROFILES)
def test_special_surfaces(profile: Profile, upper_radius: float) -> None:
    """A bridge from a sphere of radius 1 at z = -0.25 to another solid at z = 0.28.

    The volume, the contact angles and the gap of the bridge follow from its profile.
    """
    low = -0.25
    high = 0.28
    lower_cap = Cap.of_solid(1.0, profile.radius(low))
    upper_cap = Cap.of_solid(upper_radius, profile.radius(high))

    nodes, weights = np.polynomial.legendre.leggauss(40)
    heights = 0.5 * (high - low) * nodes + 0.5 * (high + low)
    areas = np.array([pi * profile.radius(height) ** 2 for height in heights])
    whole_volume = 0.5 * (high - low) * float(weights @ areas)
    contact_angles = (
        pi - atan2(1.0, profile.slope(low)) - lower_cap.filling_angle,
        atan2(1.0, profile.slope(high)) - upper_cap.filling_angle,
    )
    curve = force_curve(
        1.0,
        upper_radius,
        whole_volume - lower_cap.volume - upper_cap.volume,
        contact_angles,
        [high - low - lower_cap.height - upper_cap.height],
    )

    lower_arc, upper_arc, pressure, _ = curve.bridges[0]
    assert curve.forces[0] == pytest.approx(profile.force, abs=1e-9)
    assert pressure == pytest.approx(profile.pressure, abs=1e-9)
    assert foot_of(1.0, lower_arc) == pytest.approx(profile.radius(low), abs=1e-8)
    assert foot_of(upper_radius, upper_arc) == pytest.approx(profile.radius(high), abs=1e-8)


def test_the_solution_of_yade_at_a_gap() -> None:
    """YADE's check: radii and suction 1, gap 0.1, no contact angle.

    It interpolates in a table of solutions of the equation, so it is exact to 0.2 %.
    """
    curve = force_curve(1.0, 1.0, 0.22317611410950786, 0.0, [0.1])
    assert curve.bridges[0, 2] == pytest.approx(-1.0, rel=2e-3)
    assert curve.forces[0] == pytest.approx(3.97627790531559322, rel=2e-3)


@pytest.mark.parametrize("volume", [1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize(("degrees", "tolerance"), [(0, 0.006), (20, 0.045), (40, 0.03)])
def test_equal_spheres_rupture_as_willett_fitted(
    volume: float, degrees: float, tolerance: float
) -> None:
    """Willett et al. (2000), Eq. 15, doi 10.1021/la000657y.

    Their factor 1 + θ/2 is some 4 % too large at 20°.
    """
    bridge = (1.0, 1.0, volume, radians(degrees))
    assert rupture_distance(*bridge) == pytest.approx(willett.rupture(*bridge), rel=tolerance)


@pytest.mark.parametrize("volume", [1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("degrees", [0, 20, 40])
def test_equal_spheres_rupture_as_lian_fitted(volume: float, degrees: float) -> None:
    """Lian et al. (1993), doi 10.1006/jcis.1993.1452, whose fit lacks a term in the volume."""
    rupture = rupture_distance(1.0, 1.0, volume, radians(degrees))
    assert rupture == pytest.approx(rupture_distance_of_lian(volume, radians(degrees)), rel=0.08)


@pytest.mark.parametrize("volume", [1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("degrees", [0, 20, 40])
def test_equal_spheres_attract_as_willett_fitted(volume: float, degrees: float) -> None:
    """The fit of Willett et al. (2000) to their own solutions, within 3 % of the largest force."""
    bridge = (1.0, 1.0, volume, radians(degrees))
    largest_gap = 0.9 * min(rupture_distance(*bridge), willett.rupture(*bridge))
    gaps = np.linspace(0.0, largest_gap, 40)
    forces = force_curve(*bridge, gaps).forces
    assert willett.pull(*bridge, gaps) == pytest.approx(forces, abs=0.03 * forces[0])


@dataclass(frozen=True)
class Bridge:
    """A bridge between two solids of some radii; one contact angle, or one of each solid (rad)."""

    radius: float
    other_radius: float
    volume: float
    contact_angles: float | tuple[float, float]

    @property
    def turned(self) -> Bridge:
        """The same bridge, the other solid first."""
        angles = self.contact_angles
        if isinstance(angles, tuple):
            angles = (angles[1], angles[0])
        return Bridge(self.other_radius, self.radius, self.volume, angles)

    def scaled(self, unit: float) -> Bridge:
        """The same bridge, its lengths multiplied by a number."""
        return Bridge(
            unit * self.radius,
            unit * self.other_radius,
            unit**3 * self.volume,
            self.contact_angles,
        )

    @property
    def rupture(self) -> float:
        """The gap at which it ruptures."""
        return rupture_distance(self.radius, self.other_radius, self.volume, self.contact_angles)

    def forces(self, gaps: FloatArray) -> FloatArray:
        """F/γ at gaps."""
        return force_curve(
            self.radius, self.other_radius, self.volume, self.contact_angles, gaps
        ).forces


of_two_solids = pytest.mark.parametrize(
    "bridge",
    [
        pytest.param(Bridge(1.0, 0.5, 0.05, radians(38.2)), id="spheres"),
        pytest.param(Bridge(1.0, inf, 0.1, (0.2, 0.9)), id="sphere and plane"),
    ],
)


@of_two_solids
def test_a_bridge_does_not_depend_on_which_solid_is_first(bridge: Bridge) -> None:
    assert bridge.turned.rupture == pytest.approx(bridge.rupture, rel=1e-9)
    gaps = bridge.rupture * np.linspace(0.0, 0.95, 6)
    assert bridge.turned.forces(gaps) == pytest.approx(bridge.forces(gaps), rel=1e-7)


@of_two_solids
def test_a_bridge_does_not_depend_on_the_unit_of_length(bridge: Bridge) -> None:
    gaps = bridge.rupture * np.linspace(0.0, 0.95, 6)
    small_bridge = bridge.scaled(1e-3)
    assert small_bridge.forces(1e-3 * gaps) == pytest.approx(1e-3 * bridge.forces(gaps), rel=1e-7)


@of_two_solids
def test_there_is_no_bridge_beyond_rupture(bridge: Bridge) -> None:
    with pytest.raises(ValueError, match="ruptures"):
        bridge.forces(np.array([1.002 * bridge.rupture]))


@of_two_solids
def test_rupture_is_the_end_of_the_branch(bridge: Bridge) -> None:
    """A fold: the force falls as the root of what is left of the gap, √4 = 2 times as much."""
    left = np.array([4e-6, 1e-6, 0.0])
    four, one, end = bridge.forces(bridge.rupture * (1.0 - left))
    assert (four - end) / (one - end) == pytest.approx(2.0, rel=0.01)


# --- pulls by name ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("other_radius", "volume", "contact_angle"),
    [
        pytest.param(inf, 0.0873, 0.7, id="large, at a plane"),
        pytest.param(0.5, 1e-3, 0.2, id="between spheres"),
        pytest.param(inf, 1e-6, 0.0, id="small, at a plane"),
    ],
)
def test_the_polynomial_is_the_equation(
    other_radius: float, volume: float, contact_angle: float
) -> None:
    curve = young_laplace.law(
        surfaces(1.0, other_radius, volume=volume, contact_angle=contact_angle)
    )
    bridge = Bridge(1.0, other_radius, volume, contact_angle)
    gaps = curve.rupture * np.array([0.0, 1e-4, 0.01, 0.3, 0.7, 0.97, 0.9999, 1.0])
    expected = bridge.forces(gaps)
    assert curve.rupture == pytest.approx(bridge.rupture, rel=1e-13)
    assert curve.formation == 0.0
    assert curve.forces(gaps).pull == pytest.approx(expected, abs=1e-7 * expected[0])


def test_rabinovichs_pull_at_contact() -> None:
    """By hand for spheres of radius 1, V = 0.001, θ = 0.7.

    α² = √(2V/π) gives α = 0.15884; F = 2π (cos θ + sin α sin(θ + α)) = 5.5580.
    """
    pull = rabinovich.pull(1.0, 1.0, 1e-3, 0.7, np.zeros(1))
    assert pull == pytest.approx([5.5580], rel=1e-4)


SOULIE_GAPS = np.array([-0.1, 0.0, 0.004, 0.03, 0.2])
"""From an overlap to beyond the roughness of `soulie_surfaces`, 0.01."""


def soulie_surfaces(other_radius: float) -> Surfaces:
    """A bead of radius 1 and another surface, V = 0.01, θ = 0.3."""
    return surfaces(1.0, other_radius, volume=0.01, contact_angle=0.3, roughness=0.01)


@pytest.mark.parametrize(
    ("other_radius", "factor"),
    [
        pytest.param(0.5, sqrt(0.5), id="spheres"),  # √(R1 R2)
        pytest.param(inf, 2.0, id="plane"),  # twice that of equal spheres
    ],
)
def test_the_pull_of_soulie(other_radius: float, factor: float) -> None:
    """F = π √(R1 R2) (C + exp(A h/R + B)), by hand A = -12.630, B = 0.49273, C = 0.069711."""
    pull = by_name("soulie")(soulie_surfaces(other_radius)).forces(SOULIE_GAPS).pull
    gaps = np.maximum(SOULIE_GAPS, 0.0)
    expected = pi * factor * (np.exp(-12.630 * gaps + 0.49273) + 0.069711)
    assert pull == pytest.approx(expected, rel=1e-4)


def test_the_pull_of_soulie_in_the_example_of_yade() -> None:
    """Beads of 2.381 mm, 20.6 mN/m, 74.2 nl: YADE draws 270, 136, 71.1 and 24.7 µN."""
    liquid = BridgeLiquid(
        surface_tension=20.6e-3, viscosity=1e-3, volume_fraction=0.01, contact_angle=0.0
    )
    pair = Surfaces(2.381e-3, 2.381e-3, 74.2e-12, liquid, 1e-5)
    gaps = 1e-3 * np.array([0.0, 0.1, 0.2, 0.4])
    pull = by_name("soulie")(pair).forces(gaps).pull
    assert 1e6 * pull == pytest.approx([270.0, 136.0, 71.1, 24.7], rel=4e-3)


@pytest.mark.parametrize("other_radius", [0.5, inf], ids=["spheres", "plane"])
def test_the_rupture_of_soulie_is_that_of_lian(other_radius: float) -> None:
    """(1 + θ/2) V^(1/3)."""
    rupture = by_name("soulie")(soulie_surfaces(other_radius)).rupture
    assert rupture == rupture_distance_of_lian(0.01, 0.3)
    assert rupture == pytest.approx(1.15 * 0.01 ** (1.0 / 3.0))


@pytest.mark.parametrize(
    ("other_radius", "reduced_radius"),
    [pytest.param(0.5, 1.0 / 3.0, id="spheres"), pytest.param(inf, 1.0, id="plane")],
)
def test_the_resistances_of_soulie_are_those_of_immersed_spheres(
    other_radius: float, reduced_radius: float
) -> None:
    """N = 6πηR*/x and S = 6πηR* (8/15 ln(1/x) + 0.9588); there are no torques.

    x is the gap, but at least the roughness, over the reduced radius R*.
    """
    forces = by_name("soulie")(soulie_surfaces(other_radius)).forces(SOULIE_GAPS)
    x = np.maximum(0.01, SOULIE_GAPS) / reduced_radius
    stokes = 6.0 * pi * reduced_radius
    assert forces.normal == pytest.approx(stokes / x)
    assert forces.sliding == pytest.approx(stokes * (8.0 / 15.0 * np.log(1.0 / x) + 0.9588))
    assert not np.any(forces.coupling)
    assert not np.any(forces.rolling)


def columns_of_law(name: str, **changes_of_liquid: float) -> FloatArray:
    """Pull and four resistances of a law for a liquid, at gaps up to the usual liquid's rupture."""
    usual = surfaces(contact_angle=0.3)
    gaps = by_name(name)(usual).rupture * np.array([0.0, 0.01, 0.3, 0.9])
    changed = replace(usual, liquid=replace(usual.liquid, **changes_of_liquid))
    return by_name(name)(changed).forces(gaps).columns()


@pytest.mark.parametrize("name", LAWS)
def test_pulls_are_proportional_to_surface_tension(name: str) -> None:
    pull = columns_of_law(name)[:, 0]
    pull_of_twice_the_tension = columns_of_law(name, surface_tension=2.0)[:, 0]
    np.testing.assert_allclose(pull_of_twice_the_tension, 2.0 * pull, rtol=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_resistances_are_proportional_to_viscosity(name: str) -> None:
    """Decks of several cases scale their tables by the viscosity."""
    columns = columns_of_law(name)
    columns_of_twice_the_viscosity = columns_of_law(name, viscosity=2.0)
    np.testing.assert_allclose(columns_of_twice_the_viscosity[:, 0], columns[:, 0], rtol=1e-9)
    np.testing.assert_allclose(
        columns_of_twice_the_viscosity[:, 1:], 2.0 * columns[:, 1:], rtol=1e-9
    )


# --- the cache of solutions -------------------------------------------------------------------


@dataclass(frozen=True)
class Solution:
    """What a user's cache has of a bridge that was solved."""

    pull: float
    file: str
    contents: bytes
    """A header of 32 bytes, then the numbers."""


def solved_pull(volume: float) -> float:
    """Pull at contact of a bridge at a plane, by the cache in files or solved anew."""
    young_laplace._solved.cache_clear()
    curve = young_laplace.law(surfaces(2.0, volume=8.0 * volume))
    return float(curve.forces(np.zeros(1)).pull[0])


def solutions_in(cache: Path) -> Path:
    """The folder of the solutions in the folder of all users' caches."""
    return cache / "granular-walkers" / "young-laplace"


@pytest.fixture(scope="module")
def solutions(tmp_path_factory: pytest.TempPathFactory) -> list[Solution]:
    """The solutions of two bridges."""
    found = []
    for volume in (0.0123, 0.0124):
        cache = tmp_path_factory.mktemp("cache")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("XDG_CACHE_HOME", str(cache))
            pull = solved_pull(volume)
        (file,) = solutions_in(cache).iterdir()
        found.append(Solution(pull, file.name, file.read_bytes()))
    return found


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of solutions, which the program uses."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = solutions_in(tmp_path)
    folder.mkdir(parents=True)
    return folder


def test_a_bridge_is_solved_once(own_cache: Path, solutions: list[Solution]) -> None:
    solution = solutions[0]
    file = own_cache / solution.file
    file.write_bytes(solution.contents)
    os.utime(file, (1e9, 1e9))
    assert solved_pull(0.0123) == solution.pull
    assert [*own_cache.iterdir()] == [file]
    assert file.stat().st_mtime == 1e9


@pytest.mark.parametrize("damage", ["cut", "empty", "text", "other numbers", "of another bridge"])
def test_a_damaged_solution_is_solved_anew(
    own_cache: Path, solutions: list[Solution], damage: str
) -> None:
    solution, solution_of_another = solutions
    header = solution.contents[:32]
    numbers = np.frombuffer(solution.contents[32:])
    damaged_contents = {
        "cut": solution.contents[:100],
        "empty": b"",
        "text": b"text",
        "other numbers": header + (2.0 * numbers).tobytes(),
        "of another bridge": solution_of_another.contents,
    }
    file = own_cache / solution.file
    file.write_bytes(damaged_contents[damage])
    assert solved_pull(0.0123) == solution.pull
    assert file.read_bytes() == solution.contents


def test_a_bridge_is_solved_if_its_solution_cannot_be_kept(
    own_cache: Path, solutions: list[Solution]
) -> None:
    own_cache.rmdir()
    own_cache.write_text("no folder")
    assert solved_pull(0.0123) == solutions[0].pull


# --- resistances ------------------------------------------------------------------------------


@pytest.mark.parametrize(("gap", "factor"), [(0.025, 0.5), (0.1, 0.05)])
def test_the_normal_resistance_at_a_plane_is_that_of_pitois(gap: float, factor: float) -> None:
    """N = 6πηR² X²/h, with X² read from the figure of Pitois et al. (2000).

    The bridge has one per cent of the volume of the bead.
    """
    pair = smooth(surfaces(volume=share_of_bead(1.0, inf, 0.01)))
    normal = reynolds.resistances(pair, np.array([gap]))[0][0]
    assert normal / (6.0 * pi / gap) == pytest.approx(factor, rel=0.02)


def test_the_normal_resistance_between_equal_spheres_is_that_of_pitois() -> None:
    """N = 3/2 πηR² X²/h with X = 1 - 1/√(1 + 2V/(πRh²)) (Pitois et al. 2000).

    Here R = 1, V = 0.03 and h = 0.05.
    """
    pair = smooth(surfaces(1.0, 1.0, volume=0.03))
    normal = reynolds.resistances(pair, np.array([0.05]))[0][0]
    x = 1.0 - 1.0 / sqrt(1.0 + 2.0 * 0.03 / (pi * 0.05**2))
    assert normal == pytest.approx(1.5 * pi * x**2 / 0.05)


ROUGHNESS = 3e-4
GAPS_OF_ROUGH_SURFACES = np.array([-1e-3, 0.0, 1e-4, 0.02])

of_rough_surfaces = pytest.mark.parametrize(
    ("degrees", "cavitation_gap"),
    [pytest.param(0.0, 2e-3, id="wetting"), pytest.param(60.0, 1e-3, id="60 degrees")],
)
"""The cavitation gap 2γ cos θ/p of `rough_surfaces` is 2 mm at θ = 0, and 1 mm at 60°."""
at_both_surfaces = pytest.mark.parametrize(
    ("other_radius", "reduced_radius"),
    [pytest.param(0.5, 1.0 / 3.0, id="spheres"), pytest.param(inf, 1.0, id="plane")],
)


def rough_surfaces(other_radius: float, degrees: float) -> Surfaces:
    """Surfaces with a liquid of γ = 101.325 N/m, a thousandth of the air's pressure times 1 m."""
    pair = surfaces(1.0, other_radius, contact_angle=radians(degrees), roughness=ROUGHNESS)
    return replace(pair, liquid=replace(pair.liquid, surface_tension=1e-3 * AIR_PRESSURE))


@of_rough_surfaces
@at_both_surfaces
def test_rough_surfaces_resist_as_smooth_ones_farther_apart(
    other_radius: float, reduced_radius: float, degrees: float, cavitation_gap: float
) -> None:
    """Sliding, coupling and rolling by the roughness, approach also by the cavitation gap."""
    pair = rough_surfaces(other_radius, degrees)
    normal, *tangential = reynolds.resistances(pair, GAPS_OF_ROUGH_SURFACES)
    gaps = np.maximum(GAPS_OF_ROUGH_SURFACES, 0.0) + ROUGHNESS
    _, *smooth_tangential = reynolds.resistances(smooth(pair), gaps)
    smooth_normal = reynolds.resistances(smooth(pair), gaps + cavitation_gap)[0]
    np.testing.assert_allclose(tangential, smooth_tangential, rtol=1e-12)
    np.testing.assert_allclose(normal, smooth_normal, rtol=1e-12)


@of_rough_surfaces
@at_both_surfaces
def test_rough_surfaces_in_much_liquid_have_the_largest_normal_resistance(
    other_radius: float, reduced_radius: float, degrees: float, cavitation_gap: float
) -> None:
    """6πηR*²/h of immersed surfaces, with h the sum of roughness and cavitation gap."""
    pair = rough_surfaces(other_radius, degrees)
    normal = reynolds.resistances(replace(pair, volume=1e9), np.zeros(1))[0][0]
    expected = 6.0 * pi * reduced_radius**2 / (ROUGHNESS + cavitation_gap)
    assert normal == pytest.approx(expected, rel=1e-3)
    assert largest_normal(reduced_radius, ROUGHNESS, pair.liquid) == pytest.approx(normal, rel=1e-3)


def growth_with_the_logarithm(pair: Surfaces) -> tuple[float, float, float]:
    """What S, C and Q grow by if the gap shrinks by a factor e near contact."""
    _, sliding, coupling, rolling = reynolds.resistances(pair, np.array([1e-12, 1e-11]))
    per_factor = 1.0 / log(10.0)
    return (
        per_factor * (sliding[0] - sliding[1]),
        per_factor * (coupling[0] - coupling[1]),
        per_factor * (rolling[0] - rolling[1]),
    )


def test_limits_at_a_plane() -> None:
    """Goldman, Cox and Brenner (1967) for a sphere of radius 1 near a plane, in ηU ln(1/h).

    The force on a sphere that translates is 6π 8/15, the torque on it 8π/10, which by reciprocity
    is the force on one that rotates, and the torque on that one 8π 2/5.
    """
    s, c, q = growth_with_the_logarithm(surfaces(roughness=0.0))
    assert s == pytest.approx(6.0 * pi * 8.0 / 15.0, rel=1e-6)
    assert s + c == pytest.approx(8.0 * pi / 10.0, rel=1e-6)
    assert s + 2.0 * c + q == pytest.approx(8.0 * pi * 2.0 / 5.0, rel=1e-6)


@pytest.mark.parametrize("ratio", [1.0, 2.0, 5.0])
def test_limits_between_spheres(ratio: float) -> None:
    """Jeffrey and Onishi (1984) for radii 1 and λ: the terms in ln(1/h) of Y^A, Y^B, Y^C.

    Their units are 6π, 4π, 8π, and π (1 + λ)³ for the torque on the other sphere.
    """
    s, c, q = growth_with_the_logarithm(surfaces(1.0, ratio, roughness=0.0))
    whole = 1.0 + ratio
    ya_11 = 4.0 * ratio * (2.0 + ratio + 2.0 * ratio**2) / (15.0 * whole**3)
    yb_11 = ratio * (4.0 + ratio) / (5.0 * whole**2)
    yc_11 = 2.0 * ratio / (5.0 * whole)
    yc_12 = 4.0 * ratio**2 / (5.0 * whole**4)
    force_of_translation = s
    torque_of_translation = s + c
    torque_of_rotation = s + 2.0 * c + q
    torque_on_the_other = ratio * (s + c) - (c + q)
    assert force_of_translation == pytest.approx(6.0 * pi * ya_11, rel=1e-6)
    assert torque_of_translation == pytest.approx(4.0 * pi * yb_11, rel=1e-6)
    assert torque_of_rotation == pytest.approx(8.0 * pi * yc_11, rel=1e-6)
    assert torque_on_the_other == pytest.approx(pi * whole**3 * yc_12, rel=1e-6)


of_many_solids = pytest.mark.parametrize(
    ("radius", "other_radius"),
    [
        pytest.param(1.0, inf, id="plane"),
        pytest.param(1.0, 1.0, id="equal spheres"),
        pytest.param(0.2, 1.0, id="unequal spheres"),
    ],
)
of_many_volumes = pytest.mark.parametrize("volume_over_cube", [1e-6, 1e-3, 0.1])


def resistances_at_many_gaps(
    radius: float, other_radius: float, volume_over_cube: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """N, S, C, Q at two overlaps, at contact, and at 60 gaps up to a radius."""
    pair = surfaces(radius, other_radius, volume=volume_over_cube * radius**3, roughness=1e-4)
    gaps = np.concatenate([[-1.0, -1e-6, 0.0], np.geomspace(1e-6, radius, 60)])
    return reynolds.resistances(pair, gaps)


@of_many_solids
@of_many_volumes
def test_resistances_take_energy(
    radius: float, other_radius: float, volume_over_cube: float
) -> None:
    """N, S, Q > 0 and C² ≤ S Q; C ≤ 0, for the smaller sphere is body 1."""
    normal, sliding, coupling, rolling = resistances_at_many_gaps(
        radius, other_radius, volume_over_cube
    )
    assert np.all(normal > 0.0)
    assert np.all(sliding > 0.0)
    assert np.all(rolling > 0.0)
    assert np.all(coupling**2 <= sliding * rolling)
    assert np.all(coupling <= 0.0)


@of_many_solids
@of_many_volumes
def test_resistances_fall_with_the_gap_and_not_with_an_overlap(
    radius: float, other_radius: float, volume_over_cube: float
) -> None:
    normal, sliding, _, rolling = resistances_at_many_gaps(radius, other_radius, volume_over_cube)
    for resistance in (normal, sliding, rolling):
        at_contact = resistance[2]
        assert np.all(resistance[:2] == at_contact)
        assert np.all(np.diff(resistance[2:]) < 0.0)


def test_resistances_vanish_with_the_bridge() -> None:
    """At a plane, with y = V/(2πRh²) small.

    N = 6πηR² y²/h, S = 2πηR y, C = -πηR² y³/2, Q = πηR³ y³.
    """
    gaps = np.array([0.1, 0.2])
    y = 1e-9 / (2.0 * pi * gaps**2)
    expected = (6.0 * pi / gaps * y**2, 2.0 * pi * y, -0.5 * pi * y**3, pi * y**3)
    resistances = reynolds.resistances(smooth(surfaces(volume=1e-9)), gaps)
    np.testing.assert_allclose(resistances, expected, rtol=1e-3)


# --- menisci ----------------------------------------------------------------------------------


def surfaces_of_meniscus(other_radius: float, meniscus: float, contact_angle: float) -> Surfaces:
    """Smooth beads of 0.3 mm and another radius, with menisci of one radius (m)."""
    liquid = BridgeLiquid(
        surface_tension=0.02,
        viscosity=1.0,
        volume_fraction=0.0,
        contact_angle=contact_angle,
        meniscus_radius=meniscus,
    )
    return Surfaces.between(0.3e-3, other_radius, liquid, Roughness(bead_bead=1e-8, bead_wall=1e-8))


@pytest.mark.parametrize("other_radius", [0.2e-3, 0.5e-3, inf])
@pytest.mark.parametrize("meniscus", [20e-6, 70e-6, 150e-6])
@pytest.mark.parametrize("contact_angle", [0.2, 0.4])
def test_menisci_of_one_radius_have_one_suction(
    other_radius: float, meniscus: float, contact_angle: float
) -> None:
    """The bridge in contact has the pressure -γ/r."""
    pair = surfaces_of_meniscus(other_radius, meniscus, contact_angle)
    curve = force_curve(pair.radius, pair.other_radius, pair.volume, contact_angle, [0.0])
    pressure = curve.bridges[0, 2]
    assert pressure == pytest.approx(-1.0 / meniscus, rel=1e-8)


@pytest.mark.parametrize("other_radius", [0.2e-3, 0.5e-3, inf])
def test_a_small_meniscus_has_the_volume_of_a_toroid(other_radius: float) -> None:
    """4πR*r² for r = 10 nm: a ring of two radii of curvature."""
    pair = surfaces_of_meniscus(other_radius, 1e-8, contact_angle=0.0)
    expected = 4.0 * pi * pair.reduced_radius * 1e-8**2
    assert pair.volume == pytest.approx(expected, rel=0.03, abs=0.0)


# --- stiffness of contacts --------------------------------------------------------------------

LATEST_PHASE = 0.025
"""ωN/k, by which contacts of the modulus ``"auto"`` lag behind their load at most."""


def phase_of_largest_bead(case: Case) -> float:
    """ωN/k of a walker's largest bead at the wall, by hand.

    k = 2E*√(Rδ) is the stiffness of a Hertzian contact with the overlap δ that the capillary force
    and the weight cause, N the normal resistance of much liquid.
    """
    radius = max(case.radii)
    modulus = case.contact.youngs_modulus / (2.0 * (1.0 - 0.3**2))
    weight = 4.0 / 3.0 * pi * radius**3 * case.beads.density * case.pressing_gravity
    force = bridge_at_rest(case, radius, inf).pull + weight
    overlap = (0.75 * force / (modulus * sqrt(radius))) ** (2.0 / 3.0)
    stiffness = 2.0 * modulus * sqrt(radius * overlap)
    cavitation_gap = 2.0 * case.liquid.surface_tension / AIR_PRESSURE
    gap = case.contact.roughness.bead_wall + cavitation_gap
    resistance = 6.0 * pi * case.liquid.of_bridges.viscosity * radius**2 / gap
    return 2.0 * pi * case.drive.frequency * resistance / stiffness


@pytest.mark.parametrize(
    ("name", "modulus"),
    [
        pytest.param("fig1b", 50e6, id="fig1b"),
        pytest.param("fig4a", 200e6, id="fig4a"),
        pytest.param("fig4b", 800e6, id="fig4b"),
        pytest.param("climber", 3.2e9, id="climber"),
        pytest.param("pile-ci", 50e6, id="pile-ci"),
    ],
)
def test_the_modulus_of_auto_is_50_mpa_times_a_power_of_four(name: str, modulus: float) -> None:
    assert load_case(name).contact.youngs_modulus == modulus


@pytest.mark.parametrize("name", ["fig1b", "fig4a", "fig4b", "climber"])
def test_contacts_of_walkers_are_as_stiff_as_their_bridges_ask_for(name: str) -> None:
    case = load_case(name)
    phase = phase_of_largest_bead(case)
    assert delay_of_walkers(case, case.walkers[0]) == pytest.approx(phase, rel=1e-9)
    assert phase <= LATEST_PHASE


@pytest.mark.parametrize("name", ["fig4a", "fig4b", "climber"])
def test_contacts_of_a_quarter_of_the_modulus_of_auto_would_be_late(name: str) -> None:
    """Not of fig1b, whose modulus is the least that is taken."""
    case = load_case(name)
    softened = case.with_value_at("contact.youngs_modulus", 0.25 * case.contact.youngs_modulus)
    phase = phase_of_largest_bead(softened)
    assert delay_of_walkers(softened, case.walkers[0]) == pytest.approx(phase, rel=1e-9)
    assert phase > LATEST_PHASE


def test_the_modulus_of_auto_ends_at_51_gpa() -> None:
    """50 MPa · 4⁵ = 51.2 GPa; four times as much is more than a case may have.

    In glycerol at 1 kHz, contacts are late even with 51.2 GPa.
    """
    changes = {"liquid.name": "glycerol", "drive.frequency": "1 kHz", "run.cycles": 3}
    case = load_case("fig1b", changes)
    assert case.contact.youngs_modulus == 51.2e9
    assert delay_of_walkers(case, case.walkers[0]) > LATEST_PHASE


# --- laws of users ----------------------------------------------------------------------------

OWN_LAW = """
import numpy as np
from walkers.physics.bridge import Curve, Forces

def forces(gaps):
    ones = np.ones_like(gaps)
    return Forces(4e-5 * ones, 3e-3 * ones, 1e-3 * ones, 0.0 * ones, 0.0 * ones)

def law(surfaces):
    return Curve(forces, rupture=0.3 * surfaces.radius)
"""
"""A law that pulls with 40 µN at all gaps, up to 0.3 radii."""


@pytest.fixture(scope="module")
def documented_laws(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the laws that the page about bridge laws prints, as files."""
    folder = tmp_path_factory.mktemp("laws")
    page = (Path(__file__).parents[1] / "docs/how-to/bridge-law.md").read_text("utf-8")
    for name, text in re.findall(r'```python\n"""(\w+)\.py(.*?)```', page, re.DOTALL):
        (folder / f"{name}.py").write_text(f'"""{name}.py{text}')
    return folder


@pytest.mark.parametrize("name", ["spring", "bagheri", "dry"])
def test_a_documented_law_runs(documented_laws: Path, tmp_path: Path, name: str) -> None:
    changes = {
        "liquid.law": f"{documented_laws}/{name}.py:law",
        "run.cycles": 4,
        "run.samples_per_cycle": 2,
    }
    result = run_case(load_case("fig1b", changes), tmp_path).result
    assert isfinite(result["velocity"])


@pytest.mark.parametrize("degrees", [0, 20, 40])
def test_the_documented_law_of_bagheri_is_close_to_the_equation(
    documented_laws: Path, degrees: float
) -> None:
    """Within 2 % of the largest pull, and 0.8 % at contact, of equal spheres."""
    pair = surfaces(1.0, 1.0, volume=0.01, contact_angle=radians(degrees))
    fit = by_name(f"{documented_laws}/bagheri.py:law")(pair)
    equation = by_name("young-laplace")(pair)
    gaps = np.linspace(0.0, 0.9 * min(fit.rupture, equation.rupture), 40)
    pulls = fit.forces(gaps).pull
    expected = equation.forces(gaps).pull
    assert pulls == pytest.approx(expected, abs=0.02 * expected[0])
    assert pulls[0] == pytest.approx(expected[0], rel=0.008)


def test_the_documented_law_of_dry_contacts_is_that_of_van_der_waals(
    documented_laws: Path,
) -> None:
    """F = A R*/(6 (h + d)²), with A = 6.5e-20 J, d = 0.165 nm, R* = 1 m.

    It ends at a thousandth of the pull at contact: h = (√1000 - 1) d = 5.05 nm.
    """
    curve = by_name(f"{documented_laws}/dry.py:law")(surfaces(2.0, 2.0))
    assert curve.rupture == pytest.approx(5.05e-9, rel=1e-2)
    assert curve.formation == curve.rupture
    forces = curve.forces(np.array([0.0, curve.rupture]))
    at_contact = 6.5e-20 / (6.0 * 0.165e-9**2)
    assert forces.pull == pytest.approx([at_contact, 1e-3 * at_contact])
    resistances = forces.columns()[:, 1:]
    assert not np.any(resistances)


def test_a_file_of_the_package_may_be_named_as_a_users_law() -> None:
    pair = surfaces(1.0, 1.0, volume=0.01, contact_angle=radians(40))
    law = by_name(f"{willett.__file__}:law")
    assert law(pair).rupture == willett.law(pair).rupture


def test_a_law_is_executed_when_it_is_new_and_the_program_says_so_once(in_folder: Path) -> None:
    counting_law = f"{OWN_LAW}\nopen('executed', 'a').write('x')\n"
    (in_folder / "own.py").write_text(counting_law)
    done = call(
        "run", "fig1b", "--set", "liquid.law=own.py:law", "--set", "run.cycles=4", check=True
    )
    message = f"executes {in_folder.resolve()}/own.py, the bridge law of the case"
    assert done.stderr.count(message) == 1
    assert (in_folder / "executed").read_text() == "x"


def test_an_edited_law_has_other_loads_in_the_same_session(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also if it is as long and as old as before.

    By that Python tells whether its bytecode is current.
    """
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    file = in_folder / "own.py"

    def pull_of(text: str) -> float:
        file.write_text(text)
        os.utime(file, (1e9, 1e9))
        case = load_case("fig1b", {"liquid.law": "own.py:law"})
        return bridge_at_rest(case, 3e-4, inf).pull

    assert pull_of(OWN_LAW) == 4e-5
    assert pull_of(OWN_LAW.replace("4e-5", "8e-5")) == 8e-5
    assert [*in_folder.iterdir()] == [file]  # no bytecode


# --- limits of the time step ------------------------------------------------------------------


def test_time_step_limits_of_the_walker() -> None:
    """Rayleigh by hand for R = 0.2 mm, ρ = 4000 kg/m³, E = 50 MPa, ν = 0.3, G = E/(2 (1 + ν)).

    π R √(ρ/G)/(0.1631 ν + 0.8766) = 9.79 µs.
    """
    limits = limits_of(make_case())
    assert limits.rayleigh == pytest.approx(9.79e-6, rel=1e-3)
    assert limits.rayleigh < limits.hertz < limits.viscous


def test_viscous_limit_rules_in_glycerol() -> None:
    """The glycerol climber is wrong at 6 µs and converged at 2 µs: the limit lies between."""
    case = make_case(
        beads={"material": "glass"},
        dimers={"radii": ["0.545 mm", "0.3075 mm"]},
        liquid={"name": "glycerol 87 %"},
        drive={"frequency": "170 Hz", "peak_acceleration": "16.2 g"},
    )
    limits = limits_of(case)
    assert 2e-6 < limits.viscous < 6e-6
    assert limits.exceeded_by(6e-6) == ["viscous"]
    assert case.run.time_step < 2.1e-6


def dimer_in_glycerol(**boundary: str) -> Case:
    """A dimer of equal beads of 0.3 mm."""
    return make_case(
        dimers={"radii": ["0.3 mm", "0.3 mm"]},
        liquid={"name": "glycerol 87 %"},
        boundary=boundary,
    )


def viscous_limit_of(case: Case) -> float:
    """The viscous limit of the time step that ``walkers show`` prints, s."""
    return float(summarise(case)["time_step"]["limits"]["viscous"])


@pytest.mark.parametrize(
    ("boundary", "walls"),
    [
        pytest.param({"shape": "groove", "opening": "30 deg"}, 1.0 + sqrt(0.75), id="groove of 30"),
        pytest.param({"shape": "groove", "opening": "90 deg"}, 1.0, id="groove of 90"),
        pytest.param({"shape": "groove", "opening": "120 deg"}, 1.5, id="groove of 120"),
        pytest.param({"shape": "channel", "width": "0.6 mm"}, 2.0, id="channel as wide as a bead"),
        pytest.param({"shape": "channel", "width": "0.62 mm"}, 1.0, id="wider channel"),
    ],
)
def test_the_viscous_limit_counts_the_walls_that_a_bead_touches_at_once(
    boundary: dict[str, str], walls: float
) -> None:
    """The limit is 2/rate. A wall of normal n damps a bead at the rate c n n.

    Two walls damp it by c (n n + m m), whose largest eigenvalue is c (1 + |n·m|).
    """
    plane = dimer_in_glycerol()
    mass = 4.0 / 3.0 * np.pi * 3e-4**3 * plane.beads.density
    cavitation_gap = 2.0 * 0.061 / AIR_PRESSURE  # 61 mN/m
    gap = plane.contact.roughness.bead_wall + cavitation_gap
    rate_of_a_wall = 6.0 * np.pi * plane.liquid.of_bridges.viscosity * 3e-4**2 / gap / mass

    between_walls = dimer_in_glycerol(**boundary)
    further_rate = 2.0 / viscous_limit_of(between_walls) - 2.0 / viscous_limit_of(plane)
    assert further_rate / rate_of_a_wall == pytest.approx(walls - 1.0, abs=1e-9)
    expected_step = 0.4 * viscous_limit_of(between_walls)
    assert between_walls.run.time_step == pytest.approx(expected_step, rel=0.02)


@pytest.fixture(scope="module")
def beads_of_two_sizes() -> Case:
    """Two beads of 0.1 and 0.3 mm that are placed in a box of glycerol, and belong to no walker."""
    tables = document(
        liquid={"name": "glycerol 87 %"},
        contact={"roughness": {"bead_bead": "0.5 um", "bead_wall": "1 um"}},
        boundary={"shape": "box", "width": "20 mm", "height": "10 mm"},
        placed=[
            {"radius": "0.1 mm", "at": ["0 mm", "0 mm", "1 mm"]},
            {"radius": "0.3 mm", "at": ["1 mm", "0 mm", "1 mm"]},
        ],
    )
    del tables["dimers"]
    tables["run"] = {"duration": "0.1 s"}
    return build_case(tables, name="beads of two sizes")


def test_the_viscous_limit_of_placed_beads_is_of_the_smallest_beside_the_largest(
    beads_of_two_sizes: Case,
) -> None:
    """2/rate of the small bead of mass m at a wall, N(R)/m, and at one of 3 R and 27 m.

    The reduced radius of the two is 3/4 R, and 1/m + 1/27m = (28/27)/m. The large bead is slower:
    its rate at the wall is a third of that of the small one.
    """
    case = beads_of_two_sizes
    mass = 4.0 / 3.0 * pi * 1e-4**3 * case.beads.density
    cavitation_gap = 2.0 * 0.061 / AIR_PRESSURE  # 61 mN/m
    factor = 6.0 * pi * case.liquid.of_bridges.viscosity
    at_wall = factor * 1e-4**2 / (1e-6 + cavitation_gap)
    between_beads = factor * 0.75e-4**2 / (0.5e-6 + cavitation_gap)
    rate = (at_wall + between_beads * 28.0 / 27.0) / mass
    assert limits_of(case).viscous == pytest.approx(2.0 / rate, rel=1e-5)


def test_the_hertz_limit_of_placed_beads_is_of_the_smallest_at_a_wall(
    beads_of_two_sizes: Case,
) -> None:
    """2.87 (m²/(R E*² v))^(1/5), E* = E/(2 (1 - ν²)), E = 50 MPa, v = 4 g/(2π 80 Hz).

    An impact on the large bead takes longer: m²/R is (27/28)²/(3/4) = 1.24 times as large.
    """
    case = beads_of_two_sizes
    mass = 4.0 / 3.0 * pi * 1e-4**3 * case.beads.density
    modulus = 50e6 / (2.0 * (1.0 - 0.3**2))
    velocity = 39.2 / (2.0 * pi * 80.0)
    impact_time = 2.87 * (mass**2 / (1e-4 * modulus**2 * velocity)) ** 0.2
    assert limits_of(case).hertz == pytest.approx(impact_time, rel=1e-6)


@pytest.mark.parametrize("law", LAWS)
def test_the_viscous_limit_is_of_no_less_than_bridges_resist(law: str) -> None:
    """2/Σ(c/m) of a bead beside its equal.

    At the wall m is its mass, between the beads half of that.
    """
    case = make_case(
        dimers={"radii": ["0.3 mm", "0.3 mm"]}, liquid={"law": law, "volume_fraction": 0.1}
    )
    mass = 4.0 / 3.0 * pi * 3e-4**3 * case.beads.density

    def normal_resistance(other_radius: float) -> float:
        pair = Surfaces.between(3e-4, other_radius, case.liquid.of_bridges, case.contact.roughness)
        return float(by_name(law)(pair).forces(np.zeros(1)).normal[0])

    rate = (normal_resistance(inf) + 2.0 * normal_resistance(3e-4)) / mass
    assert 0.9 < 0.5 * limits_of(case).viscous * rate < 1.0 + 1e-9


@pytest.mark.parametrize("loose", [True, False], ids=["loose beads", "walkers"])
def test_auto_takes_at_most_half_of_each_limit(loose: bool) -> None:
    shares = recommended_fractions(loose=loose)
    assert shares.keys() == vars(limits_of(make_case())).keys()
    assert min(shares.values()) > 0.0
    assert max(shares.values()) <= 0.5


@pytest.mark.parametrize(
    ("name", "longest"),
    [
        pytest.param("fig1b", 4e-6, id="fig1b"),
        pytest.param("fig4a", 4e-6, id="fig4a"),
        pytest.param("symmetric", 4e-6, id="symmetric"),
        pytest.param("pile-small", inf, id="pile-small"),
    ],
)
def test_auto_is_the_longest_step_that_limits_allow(name: str, longest: float) -> None:
    """Walkers also have steps of at most 4 µs.

    A cycle is so many whole samples of whole steps: a step is a little shorter than is allowed.
    """
    case = load_case(name)
    limits = vars(limits_of(case))
    shares = recommended_fractions(loose=case.loose)
    allowed = min(longest, *[share * limits[limit] for limit, share in shares.items()])
    assert 0.97 * allowed < case.run.time_step <= allowed
