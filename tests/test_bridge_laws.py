"""Laws of bridges: published numbers, limits of lubrication, and Reynolds' equation solved another way."""

from __future__ import annotations

import shutil
from functools import partial
from math import inf, log, pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import diags, identity, kron
from scipy.sparse.linalg import spsolve

from walkers.check.bridges import willett_simple
from walkers.physics import reynolds
from walkers.physics.bridge import FloatArray, Surfaces
from walkers.physics.capillary import (
    bridge_volume_at_wall,
    bridge_volume_between_beads,
    capillary_force_limit_at_wall,
)
from walkers.physics.capillary import rupture_distance as rupture_of_lian
from walkers.physics.laplace import force_curve, rupture_distance
from walkers.physics.laws import by_name, rabinovich, van_der_waals, willett, young_laplace
from walkers.physics.laws import soulie as soulie_law
from walkers.physics.matter import Liquid

PAIRS = [(1.0, inf), (1.0, 1.0), (0.5, 1.0), (0.2, 1.0)]
N = np.array([0.0, 0.0, 1.0])


def surfaces(
    radius: float = 1.0, other: float = inf, volume: float = 0.02, angle: float = 0.0, closest: float = 1e-3
) -> Surfaces:
    """Of viscosity and surface tension 1."""
    return Surfaces(radius, other, volume, Liquid(1.0, 1.0, None, 0.01, angle, None), closest)


def matrix(pair: Surfaces, gap: float) -> tuple[float, float, float]:
    _, sliding, coupling, rolling = (float(one[0]) for one in reynolds.resistances(pair, np.array([gap])))
    return sliding, coupling, rolling


# --- The pull -------------------------------------------------------------------------------------------------------


def test_published_numbers() -> None:
    """YADE's example, beads of 2.381 mm, 20.6 mN/m, 74.2 nl, by Willett et al.'s Eq. 12 and by Soulié et al."""
    pair = Surfaces(2.381e-3, 2.381e-3, 74.2e-9 * 1e-3, Liquid(20.6e-3, 1e-3, None, 0.01, 0.0, None), 0.01)
    gaps = 1e-3 * np.array([0.0, 0.1, 0.2, 0.4])
    tension, radius = pair.liquid.surface_tension, pair.radius
    simple = tension * willett_simple(radius, radius, pair.volume, 0.0, gaps)
    assert 1e6 * simple == pytest.approx([308.0, 129.0, 57.1, 19.0], rel=4e-3)
    assert 1e6 * by_name("soulie")(pair).forces(gaps).pull == pytest.approx([270.0, 136.0, 71.1, 24.7], rel=4e-3)
    exact = by_name("young-laplace")(pair).forces(gaps).pull
    assert by_name("willett")(pair).forces(gaps).pull == pytest.approx(exact, abs=0.02 * exact[0])


@pytest.mark.parametrize(
    "given", [(1.0, inf, 0.0873, 0.7), (1.0, 0.5, 1e-3, 0.2), (1.0, inf, 1e-6, 0.0), (0.3, 1.0, 0.01, 1.2)]
)
def test_the_polynomial_is_the_equation(given: tuple[float, float, float, float]) -> None:
    curve = young_laplace.law(surfaces(*given))
    gaps = curve.rupture * np.array([0.0, 1e-4, 0.01, 0.3, 0.7, 0.97, 0.9999, 1.0])
    exact = force_curve(*given, gaps)
    assert curve.rupture == pytest.approx(rupture_distance(*given), rel=1e-13)
    assert curve.formation == 0.0
    assert curve.forces(gaps).pull == pytest.approx(exact.forces, abs=1e-7 * exact.forces[0])


def test_rabinovichs_pull_at_contact() -> None:
    """By hand, of spheres of 1, V = 0.001, θ = 0.7: α² = √(2V/π), F = 2π (cos θ + sin α sin(θ + α))."""
    assert rabinovich.pull(1.0, 1.0, 1e-3, 0.7, np.zeros(1)) == pytest.approx([5.5580], rel=1e-4)


# --- The resistances ------------------------------------------------------------------------------------------------


def test_the_force_of_pitois() -> None:
    """X² of one per cent of a bead's volume on a plane; between equal spheres 3/2 πηR² X²/h (Pitois et al. 2000)."""
    wall = surfaces(volume=bridge_volume_at_wall(1.0, 0.01))
    for gap, factor in ((0.025, 0.5), (0.1, 0.05)):
        normal = reynolds.resistances(wall, np.array([gap]))[0][0]
        assert normal / (6.0 * pi / gap) == pytest.approx(factor, rel=0.02)
    normal = reynolds.resistances(surfaces(1.0, 1.0, 0.03), np.array([0.05]))[0][0]
    x = 1.0 - 1.0 / sqrt(1.0 + 2.0 * 0.03 / (pi * 0.05**2))
    assert normal == pytest.approx(1.5 * pi * x**2 / 0.05)


def logarithms(pair: Surfaces) -> FloatArray:
    """What S, C, Q grow by for each e of the gap, near contact."""
    low, high = (np.array(matrix(pair, gap)) for gap in (1e-12, 1e-11))
    return (low - high) / log(10.0)


def test_limits_at_a_plane() -> None:
    """Goldman, Cox and Brenner (1967): a sphere that translates, one that rotates, and reciprocity."""
    s, c, q = logarithms(surfaces(closest=0.0))
    torque = 8.0 * pi / 10.0  # of translation; force of rotation
    assert (s, s + c, s + 2.0 * c + q) == pytest.approx((6.0 * pi * 8.0 / 15.0, torque, 8.0 * pi * 2.0 / 5.0), rel=1e-6)


@pytest.mark.parametrize("ratio", [1.0, 2.0, 5.0])
def test_limits_between_spheres(ratio: float) -> None:
    """Jeffrey and Onishi (1984): Y^A, Y^B, Y^C of spheres of radii 1 and λ, in units of 6π, 4π, 8π and π(1 + λ)³."""
    s, c, q = logarithms(surfaces(1.0, ratio, closest=0.0))
    whole = 1.0 + ratio
    ya = 4.0 * ratio * (2.0 + ratio + 2.0 * ratio**2) / (15.0 * whole**3)
    assert s == pytest.approx(6.0 * pi * ya, rel=1e-6)
    # Body 1 translates: the torque on it. Body 1 rotates: the torques on both.
    assert s + c == pytest.approx(4.0 * pi * ratio * (4.0 + ratio) / (5.0 * whole**2), rel=1e-6)
    assert s + 2.0 * c + q == pytest.approx(8.0 * pi * 2.0 * ratio / (5.0 * whole), rel=1e-6)
    on_2 = ratio * (s + c) - (c + q)
    assert on_2 == pytest.approx(pi * whole**3 * 4.0 * ratio**2 / (5.0 * whole**4), rel=1e-6)


def moved(pair: tuple[float, float], gap: float, v: FloatArray, omega: FloatArray) -> tuple[FloatArray, FloatArray]:
    """s and q of two bodies by the interface's definition; v and omega of shape (2, 3)."""
    arms = np.array(pair)[:, None] + 0.5 * gap
    relative = v[0] - v[1]
    sliding = relative - (relative @ N) * N + np.cross(N, (arms * omega).sum(axis=0))
    return sliding, np.cross(N, omega[0] - omega[1])


def solved(pair: tuple[float, float], gap: float, edge: float, v: FloatArray, omega: FloatArray) -> FloatArray:
    """Forces on both bodies and torques about their centres, (4, 3), of given motions, by finite volumes in r and θ.

    Nothing of the law is in it: the flux is that of walls that move as their bodies do at each place of them.
    """
    rings, rays = 200, 64
    dr, dt = edge / rings, 2.0 * pi / rays
    r, t = np.meshgrid((np.arange(rings) + 0.5) * dr, (np.arange(rays) + 0.5) * dt, indexing="ij")
    centres = np.array([(pair[0] + 0.5 * gap) * N, -(pair[1] + 0.5 * gap) * N])

    def wall(body: int, r: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Places of a body's surface and its velocity there."""
        rise = (0.5 * gap + r**2 / (2.0 * pair[body])) * (1.0 - 2.0 * body)
        place = np.stack([r * np.cos(t), r * np.sin(t), rise], axis=-1)
        return place, v[body] + np.cross(omega[body], place - centres[body])

    def drawn(r: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The gap, and its height times the mean velocity of the walls."""
        (one, u), (other, w) = wall(0, r, t), wall(1, r, t)
        height = one[..., 2] - other[..., 2]
        return height, 0.5 * height[..., None] * (u + w)

    # Faces across r, the innermost without length; p = 0 half a cell beyond the outermost.
    faces, at = np.meshgrid(np.arange(1, rings + 1) * dr, t[0], indexing="ij")
    height, flux = drawn(faces, at)
    through = (flux[..., 0] * np.cos(at) + flux[..., 1] * np.sin(at)) * faces * dt
    source = through - np.vstack([np.zeros(rays), through[:-1]])
    weight = (height**3 / 12.0 * faces * dt / dr)[:, 0]
    inward, outward = np.append(0.0, weight[:-1]), np.append(weight[:-1], 2.0 * weight[-1])
    across = diags([weight[:-1], -inward - outward, weight[:-1]], [-1, 0, 1])
    # Faces across θ.
    turned = t + 0.5 * dt
    height, flux = drawn(r, turned)
    through = (-flux[..., 0] * np.sin(turned) + flux[..., 1] * np.cos(turned)) * dr
    source += through - np.roll(through, 1, axis=1)
    around = diags([1.0, 1.0, -2.0, 1.0, 1.0], [1 - rays, -1, 0, 1, rays - 1], shape=(rays, rays))
    system = kron(across, identity(rays)) + kron(diags((height**3 / 12.0 * dr / (r * dt))[:, 0]), around)
    # The walls part, less what their slopes carry away.
    (one, u), (other, w) = wall(0, r, t), wall(1, r, t)
    slopes = [np.stack([-one[..., 0] / pair[0], -one[..., 1] / pair[0], np.ones_like(r)], axis=-1)]
    slopes.append(np.stack([other[..., 0] / pair[1], other[..., 1] / pair[1], np.ones_like(r)], axis=-1))
    area = r * dr * dt
    source += ((u * slopes[0]).sum(-1) - (w * slopes[1]).sum(-1)) * area
    p = spsolve(system.tocsr(), source.ravel()).reshape(rings, rays)

    dp_dr = np.gradient(np.vstack([np.roll(p[:1], rays // 2, axis=1), p, -p[-1:]]), dr, axis=0)[1:-1]
    dp_dt = (np.roll(p, -1, axis=1) - np.roll(p, 1, axis=1)) / (2.0 * dt * r)
    slope = np.stack(
        [dp_dr * np.cos(t) - dp_dt * np.sin(t), dp_dr * np.sin(t) + dp_dt * np.cos(t), np.zeros_like(p)], axis=-1
    )
    height = (one - other)[..., 2, None]
    sheared = (u - w) / height * [1.0, 1.0, 0.0]
    found = []
    for sign, normal, place, centre in zip((1.0, -1.0), slopes, (one, other), centres, strict=True):
        traction = sign * p[..., None] * normal - 0.5 * height * slope - sign * sheared
        found.append((traction * area[..., None]).sum(axis=(0, 1)))
        found.append((np.cross(place - centre, traction) * area[..., None]).sum(axis=(0, 1)))
    return np.array(found)


@pytest.mark.parametrize("pair", [(1.0, 1.0), (1.0, 3.0), (1.0, 1e4)])
def test_the_matrix_by_finite_volumes(pair: tuple[float, float]) -> None:
    """Forces and torques on both bodies in any motion, signs included: the interface's, with this S, C, Q."""
    gap, reduced = 1e-6, 1.0 / (1.0 / pair[0] + 1.0 / pair[1])
    edge = sqrt(2.0 * reduced * 4.0 * gap)  # H_w = 5 h
    volume = pi * reduced * ((5.0 * gap) ** 2 - gap**2)
    given = surfaces(*pair, volume=volume, closest=0.0)
    s, c, q = matrix(given, gap)
    for seed, still in ((1, False), (2, True)):
        v, omega = np.random.default_rng(seed).normal(size=(2, 2, 3)) * [1.0, 1.0, 0.0]
        omega[1] /= pair[1]
        if still:  # only rolling: sliding surfaces would hide it
            v[0] = v[1] - np.cross(N, ((np.array(pair) + 0.5 * gap)[:, None] * omega).sum(axis=0))
        sliding, rolling = moved(pair, gap, v, omega)
        force, couple = -(s * sliding + c * rolling), -(c * sliding + q * rolling)
        lever, turning = np.cross(N, force), np.cross(N, couple)
        found = solved(pair, gap, edge, v, omega)
        expected = [force, -pair[0] * lever - turning, -force, -pair[1] * lever + turning]
        size = float(np.max(np.abs([force, couple])))
        for one, other, lever_arm in zip(found, expected, (1.0, pair[0], 1.0, pair[1]), strict=True):
            assert one[:2] == pytest.approx(other[:2], abs=0.015 * lever_arm * size)


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("volume", [1e-6, 1e-3, 0.1])
def test_resistances_take_energy(pair: tuple[float, float], volume: float) -> None:
    """C² ≤ S Q, and all fall with the gap; below the roughness they stay as they are."""
    given = surfaces(*pair, volume=volume * pair[0] ** 3, closest=1e-4)
    gaps = np.concatenate([[0.0, 0.5 * given.closest], np.geomspace(given.closest, pair[0], 60)])
    normal, sliding, coupling, rolling = reynolds.resistances(given, gaps)
    for one in (normal, sliding, rolling):
        assert np.all(one > 0.0)
        assert np.all(np.diff(one[2:]) < 0.0)
        assert one[:2] == pytest.approx(one[2])
    assert np.all(coupling**2 <= sliding * rolling)
    assert np.all(coupling <= 0.0)


def test_resistances_vanish_with_the_bridge() -> None:
    normal, sliding, coupling, rolling = reynolds.resistances(surfaces(volume=1e-9), np.array([0.1, 0.2]))
    y = 1e-9 / (2.0 * pi * np.array([0.1, 0.2]) ** 2)
    assert normal == pytest.approx(6.0 * pi / np.array([0.1, 0.2]) * y**2, rel=1e-3)
    assert sliding == pytest.approx(2.0 * pi * y, rel=1e-3)
    assert rolling == pytest.approx(pi * y**3, rel=1e-3)
    assert coupling == pytest.approx(-0.5 * pi * y**3, rel=1e-3)


def test_what_was_solved_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bridge of one shape is solved once, and again if what was kept is damaged or cannot be kept."""
    monkeypatch.setattr(young_laplace, "user_cache_path", lambda _: tmp_path)
    solve, solved = young_laplace._solve, []
    monkeypatch.setattr(young_laplace, "_solve", lambda shape: solved.append(shape) or solve(shape))

    def pull(volume: float) -> float:
        young_laplace._solved.cache_clear()
        return float(young_laplace.law(surfaces(2.0, volume=8.0 * volume)).forces(np.zeros(1)).pull[0])

    first = pull(0.0123)
    assert pull(0.0123) == first
    assert len(solved) == 1
    (kept,) = (tmp_path / "young-laplace").iterdir()
    kept.write_bytes(kept.read_bytes()[:100])
    assert pull(0.0123) == first
    assert len(solved) == 2
    shutil.rmtree(tmp_path / "young-laplace")
    (tmp_path / "young-laplace").write_text("no folder")
    assert pull(0.0123) == first


# --- The stock engine's law, mended at walls ------------------------------------------------------------------------


@pytest.mark.parametrize("other", [0.5, inf])
def test_soulie(other: float) -> None:
    """By hand for V = 0.01, θ = 0.3: A = -12.63, B = 0.4927, C = 0.0697; at a plane that of equal spheres, twice."""
    gaps = np.array([-0.1, 0.0, 0.004, 0.03, 0.2])
    given = surfaces(1.0, other, 0.01, 0.3, 0.01)
    curve, reduced = soulie_law.law(given), 1.0 if other == inf else 1.0 / 3.0
    found = curve.forces(gaps)
    assert curve.rupture == rupture_of_lian(0.01, 0.3) == pytest.approx(1.15 * 0.01 ** (1.0 / 3.0))
    pull = np.exp(-12.630 * np.maximum(gaps, 0.0) + 0.49273) + 0.069711
    assert found.pull == pytest.approx(pi * (2.0 if other == inf else sqrt(0.5)) * pull, rel=1e-4)
    near = np.maximum(0.01, gaps / reduced)
    assert found.normal == pytest.approx(6.0 * pi * reduced / near)
    assert found.sliding == pytest.approx(6.0 * pi * reduced * (8.0 / 15.0 * np.log(1.0 / near) + 0.9588))
    assert not np.any([found.coupling, found.rolling])


def test_soulie_of_little_liquid() -> None:
    """One per cent of a bead at a wall: twice 1.74 πγR, below 4πγR; of equal spheres near 2πγR; it falls to rupture."""
    force = soulie_law.pull(1.0, inf, bridge_volume_at_wall(1.0, 0.01), 0.0, np.zeros(1))[0]
    assert force / pi == pytest.approx(3.48, abs=0.005)
    assert force < capillary_force_limit_at_wall(1.0, 1.0)
    assert soulie_law.pull(1.0, 1.0, 1e-4, 0.0, np.zeros(1))[0] == pytest.approx(2.0 * pi, rel=0.12)
    volume = bridge_volume_between_beads(3e-4, 2e-4, 0.01)
    gaps = rupture_of_lian(volume, 0.0) * np.array([0.0, 0.5, 1.0])
    touching, half, last = soulie_law.pull(3e-4, 2e-4, volume, 0.0, gaps)
    assert touching > half > last > 0.0


# --- The others, and names ------------------------------------------------------------------------------------------


def test_van_der_waals() -> None:
    curve = van_der_waals.law(surfaces(2.0, 2.0))
    assert curve.formation == curve.rupture == pytest.approx(5.05e-9, rel=1e-2)
    found = curve.forces(np.array([0.0, curve.rupture]))
    assert found.pull[0] == pytest.approx(6.5e-20 / (6.0 * 0.165e-9**2))
    assert found.pull[1] == pytest.approx(1e-3 * found.pull[0])
    assert not np.any(found.columns()[:, 1:])
    stronger = partial(van_der_waals.law, hamaker_constant=13e-20)(surfaces(2.0, 2.0)).forces(np.zeros(1))
    assert stronger.pull[0] == pytest.approx(2.0 * found.pull[0])


def test_a_law_of_ones_own(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    file.write_text(
        "from functools import partial\n"
        "from walkers.physics.laws import van_der_waals\n"
        "law = partial(van_der_waals.law, hamaker_constant=13e-20)\n"
    )
    given = surfaces()
    own, known = (by_name(name)(given).forces(np.zeros(1)) for name in (f"{file}:law", "van-der-waals"))
    assert own.pull[0] == pytest.approx(2.0 * known.pull[0])
    assert by_name("walkers.physics.laws.willett:law") is willett.law


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no-such-law", "expected one of .*soulie, .*young-laplace"),
        ("nowhere.py:law", "cannot be imported"),
        ("walkers.nowhere:law", "cannot be imported"),
        ("walkers.physics.laws.willett:nothing", "has no function nothing"),
        ("walkers.physics.laws.willett:", "expected one of"),
    ],
)
def test_names_that_are_no_laws(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        by_name(name)
