"""Laws of bridges: published numbers, limits of lubrication, and Reynolds' equation solved another way."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import warnings
import zipfile
from dataclasses import replace
from math import inf, isfinite, log, pi, radians, sqrt
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import call, make_case, to_toml
from walkers import run as run_case
from walkers.errors import InputError
from walkers.inputs.loads import bridge_at_rest, dimer_of
from walkers.inputs.reading import load_case
from walkers.inputs.run import limits_of
from walkers.physics import reynolds
from walkers.physics.bridge import Curve, FloatArray, Forces, Surfaces, UnusableLawError
from walkers.physics.capillary import (
    BridgeLiquid,
    share_of_bead,
)
from walkers.physics.capillary import rupture_distance as rupture_of_lian
from walkers.physics.laplace import force_curve, rupture_distance
from walkers.physics.laws import LAWS, by_name, rabinovich, willett, young_laplace
from walkers.physics.laws import soulie as soulie_law
from walkers.physics.time_step import AUTO_FRACTIONS, WALKER_FRACTIONS
from walkers.templates.bridge_tables import TOLERANCE, RecordedLaw, tabulated

pytestmark = pytest.mark.filterwarnings("ignore::walkers.physics.laws.ExecutedLawWarning")

PAIRS = [(1.0, inf), (1.0, 1.0), (0.5, 1.0), (0.2, 1.0)]


def _liquid(surface_tension: float, viscosity: float, angle: float) -> BridgeLiquid:
    return BridgeLiquid(surface_tension=surface_tension, viscosity=viscosity, volume_fraction=0.01, contact_angle=angle)


def surfaces(
    radius: float = 1.0, other: float = inf, volume: float = 0.02, angle: float = 0.0, closest: float = 1e-3
) -> Surfaces:
    """Of viscosity and surface tension 1."""
    return Surfaces(radius, other, volume, _liquid(1.0, 1.0, angle), closest)


def matrix(pair: Surfaces, gap: float) -> tuple[float, float, float]:
    _, sliding, coupling, rolling = (float(one[0]) for one in reynolds.resistances(pair, np.array([gap])))
    return sliding, coupling, rolling


# --- The pull -------------------------------------------------------------------------------------------------------


def test_published_numbers() -> None:
    """YADE's example, beads of 2.381 mm, 20.6 mN/m, 74.2 nl, by Willett et al.'s Eq. 12 and by Soulié et al."""
    pair = Surfaces(2.381e-3, 2.381e-3, 74.2e-9 * 1e-3, _liquid(20.6e-3, 1e-3, 0.0), 0.01)
    gaps = 1e-3 * np.array([0.0, 0.1, 0.2, 0.4])
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


def test_bridges_may_form_where_films_touch() -> None:
    """An even film of a hundredth of a bead's volume is R φ/3 thick, to a third of φ."""
    liquid = _liquid(0.061, 0.12, 0.0)
    at_wall, between = (Surfaces.of(3e-4, other, liquid, 0.01) for other in (inf, 5e-4))
    films = by_name("young-laplace-films")
    assert films(at_wall).formation == pytest.approx(1e-6, rel=0.004)
    assert films(between).formation == pytest.approx(8e-6 / 3.0, rel=0.004)
    assert films(between).rupture == by_name("young-laplace")(between).rupture


def test_rabinovichs_pull_at_contact() -> None:
    """By hand, of spheres of 1, V = 0.001, θ = 0.7: α² = √(2V/π), F = 2π (cos θ + sin α sin(θ + α))."""
    assert rabinovich.pull(1.0, 1.0, 1e-3, 0.7, np.zeros(1)) == pytest.approx([5.5580], rel=1e-4)


# --- The resistances ------------------------------------------------------------------------------------------------


def test_the_force_of_pitois() -> None:
    """X² of one per cent of a bead's volume on a plane; between equal spheres 3/2 πηR² X²/h (Pitois et al. 2000)."""
    wall = surfaces(volume=share_of_bead(1.0, inf, 0.01))
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
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    solve, solved = young_laplace._solve, []
    monkeypatch.setattr(young_laplace, "_solve", lambda shape: solved.append(shape) or solve(shape))

    def pull(volume: float) -> float:
        young_laplace._solved.cache_clear()
        return float(young_laplace.law(surfaces(2.0, volume=8.0 * volume)).forces(np.zeros(1)).pull[0])

    first = pull(0.0123)
    assert pull(0.0123) == first
    assert len(solved) == 1
    folder = tmp_path / "granular-walkers" / "young-laplace"
    (kept,) = folder.iterdir()
    right, other = kept.read_bytes(), folder / "other"
    numbers = np.frombuffer(right[32:])
    damages = [right[:100], b"", b"text", right[:32] + (2.0 * numbers).tobytes()]
    for save, values in [(np.save, 2.0 * numbers), (np.save, 1.0), (np.save, np.ones((2, 3))), (np.savez, numbers)]:
        with other.open("wb") as file:
            save(file, values)
        damages.append(other.read_bytes())
    for number, damage in enumerate(damages, 2):
        kept.write_bytes(damage)
        assert pull(0.0123) == first
        assert len(solved) == number
    pull(0.0124)
    (another,) = set(folder.iterdir()) - {kept, other}
    kept.write_bytes(another.read_bytes())  # the solution of another bridge
    assert pull(0.0123) == first
    shutil.rmtree(folder)
    folder.write_text("no folder")
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


# --- The others, and names ------------------------------------------------------------------------------------------


DOCUMENTED = re.findall(
    r'```python\n"""(\w+)\.py(.*?)```', Path("docs/how-to/bridge-law.md").read_text("utf-8"), re.DOTALL
)


@pytest.fixture
def documented(tmp_path: Path) -> Path:
    """A folder with the laws that the documentation shows in full."""
    for name, text in DOCUMENTED:
        (tmp_path / f"{name}.py").write_text(f'"""{name}.py{text}')
    return tmp_path


def test_the_documented_law_of_van_der_waals(documented: Path) -> None:
    curve = by_name(f"{documented}/dry.py:law")(surfaces(2.0, 2.0))
    assert curve.formation == curve.rupture == pytest.approx(5.05e-9, rel=1e-2)
    found = curve.forces(np.array([0.0, curve.rupture]))
    assert found.pull[0] == pytest.approx(6.5e-20 / (6.0 * 0.165e-9**2))
    assert found.pull[1] == pytest.approx(1e-3 * found.pull[0])
    assert not np.any(found.columns()[:, 1:])


@pytest.mark.parametrize("degrees", [0, 20, 40])
def test_the_documented_law_of_bagheri_fits_young_laplace(documented: Path, degrees: float) -> None:
    """Within 2 % of the pull at contact, and 0.8 % at contact."""
    given = surfaces(1.0, 1.0, volume=0.01, angle=radians(degrees))
    curve, exact = by_name(f"{documented}/bagheri.py:law")(given), by_name("young-laplace")(given)
    gaps = np.linspace(0.0, 0.9 * min(curve.rupture, exact.rupture), 40)
    pulls, expected = curve.forces(gaps).pull, exact.forces(gaps).pull
    assert pulls == pytest.approx(expected, abs=0.02 * expected[0])
    assert pulls[0] == pytest.approx(expected[0], rel=0.008)


@pytest.mark.parametrize("name", [name for name, _ in DOCUMENTED])
def test_documented_laws_run(documented: Path, name: str) -> None:
    changes = {"liquid.law": f"{documented}/{name}.py:law", "run.cycles": 4, "run.samples_per_cycle": 2}
    speed = run_case(load_case("fig1b", changes), documented).result["velocity"]
    assert isfinite(speed)


def test_a_law_of_ones_own(tmp_path: Path) -> None:
    """Also what is no plain function."""
    (tmp_path / "own.py").write_text(
        "from functools import partial\nfrom walkers.physics.laws import willett\nlaw = partial(willett.law)\n"
    )
    given, gaps = surfaces(), np.array([0.0, 0.05])
    own, known = (by_name(name)(given).forces(gaps) for name in (f"{tmp_path}/own.py:law", "willett"))
    assert (own.columns() == known.columns()).all()
    assert by_name("walkers.physics.laws.willett:law")(given).rupture == willett.law(given).rupture


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no-such-law", "expected one of .*soulie, .*young-laplace"),
        ("nowhere.py:law", "nowhere.py cannot be read: No such file"),
        ("walkers.physics.laws.willett:law\n", "expected one of"),
        ("walkers.nowhere:law", "cannot be imported"),
        ("walkers.physics.laws.willett:nothing", "has no function nothing"),
        ("walkers.physics.laws.willett:", "expected one of"),
    ],
)
def test_names_that_are_no_laws(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        by_name(name)


# --- tables that the engine reads -------------------------------------------------------------------------------------


CASE = make_case(liquid={"contact_angle": "20 deg"})
AT_WALL = Surfaces.of(3e-4, inf, CASE.liquid.of_bridges, CASE.contact.minimum_separation_ratio)
BETWEEN = Surfaces.of(3e-4, 2e-4, CASE.liquid.of_bridges, CASE.contact.minimum_separation_ratio)


@pytest.mark.parametrize("given", [AT_WALL, BETWEEN], ids=["wall", "beads"])
@pytest.mark.parametrize("name", LAWS)
def test_the_engine_reads_the_law_out_of_its_table(name: str, given: Surfaces) -> None:
    law = by_name(name)
    table = tabulated(law, given)
    gaps = table.curve.rupture * np.random.default_rng(1).random(200) ** 3
    expected = law(given).forces(gaps).columns()
    scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max(axis=0))
    read = RecordedLaw(f"\nbridge 1 1 {given.radius!r} {given.other_radius!r}\n{table.text()}", None)(given)
    np.testing.assert_array_less(np.abs(read.forces(gaps).columns() - expected), 10 * TOLERANCE * scale + 1e-30)


@pytest.mark.parametrize("name", LAWS)
def test_pulls_and_resistances_are_proportional_to_tension_and_viscosity(name: str) -> None:
    """Decks scale their tables by it."""
    liquid = AT_WALL.liquid
    twice = replace(liquid, surface_tension=2.0 * liquid.surface_tension, viscosity=2.0 * liquid.viscosity)
    once, doubled = (by_name(name)(replace(AT_WALL, liquid=one)) for one in (liquid, twice))
    gaps = once.rupture * np.array([0.0, 0.01, 0.3, 0.9])
    np.testing.assert_allclose(doubled.forces(gaps).columns(), 2.0 * once.forces(gaps).columns(), rtol=1e-9)


def _law(**changes: object) -> Curve:
    def forces(gaps: FloatArray) -> Forces:
        one = np.ones_like(gaps)
        made = Forces(pull=1e-5 * one, normal=one, sliding=one, coupling=0.0 * one, rolling=one)
        return replace(made, **{key: value(gaps) for key, value in changes.items() if callable(value)})

    sizes = {key: value for key, value in changes.items() if isinstance(value, float)}
    return Curve(forces, **{"rupture": 1e-4, **sizes})


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"pull": lambda gaps: np.log(gaps - 1e-5)}, "the pull is not a number at a gap of 0 m"),
        ({"normal": lambda gaps: 1.0 - gaps / 5e-5}, "the normal resistance is negative"),
        ({"coupling": lambda gaps: 2.0 + gaps}, "sliding and rolling together generate energy"),
        (
            {"pull": lambda gaps: np.where(gaps < 3.3e-5, 1.0, 0.0)},
            "the finest table, of 256 cells per octave",
        ),
        ({"rupture": 0.0}, "the bridge breaks at a gap of 0 m"),
        ({"rupture": inf}, "the bridge breaks at a gap of inf m"),
        ({"formation": 2e-4}, "the bridge forms at a gap of 0.0002 m; expected 0 to its rupture"),
    ],
)
def test_a_law_that_cannot_be_used_is_refused(changes: dict[str, object], told: str) -> None:
    with pytest.raises(UnusableLawError, match=told):
        tabulated(lambda _: _law(**changes), AT_WALL)


# --- limits of the time step, numbers of the paper --------------------------------------------------------------------


def test_published_gamma0() -> None:
    """Of the walker of Fig. 2 at 2 to 6 g, and of those of Fig. 4."""
    for acceleration, gamma0 in ((2, 0.191), (3, 0.286), (4, 0.381), (5, 0.476), (6, 0.572)):
        case = make_case(drive={"peak_acceleration": f"{acceleration} g"})
        assert dimer_of(case).gamma0(case.excitation.peak_acceleration) == pytest.approx(gamma0, abs=6e-4)
    for name, gamma0 in (("fig4a", 0.74), ("fig4b", 3.5)):
        case = load_case(name)
        assert dimer_of(case).gamma0(case.excitation.peak_acceleration) == pytest.approx(gamma0, rel=0.01)


def test_time_step_limits_of_the_walker() -> None:
    """By hand for R 0.2 mm, ρ 4000, E 50 MPa, ν 0.3: π R √(ρ/G)/(0.1631 ν + 0.8766) = 9.79 µs."""
    case = make_case()
    limits = limits_of(case)
    assert limits.rayleigh == pytest.approx(9.79e-6, rel=1e-3)
    assert limits.rayleigh < limits.hertz < limits.viscous


def test_viscous_limit_rules_in_glycerol() -> None:
    """The glycerol climber is wrong at 6 µs and converged at 2 µs: the limit lies between, auto below 2.1 µs."""
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


@pytest.mark.parametrize("name", ["fig1b", "fig4a", "symmetric", "pile-small"])
def test_auto_respects_every_limit_with_margin(name: str) -> None:
    """And is no shorter than that asks for: loose beads by their own shares, walkers at most 4 µs."""
    case = load_case(name)
    limits = vars(limits_of(case))
    shares = AUTO_FRACTIONS if case.loose else WALKER_FRACTIONS
    assert shares.keys() == limits.keys()
    assert all(0.0 < share <= 0.5 for share in shares.values())
    allowed = min(share * limits[limit] for limit, share in shares.items())
    longest = allowed if case.loose else min(allowed, 4e-6)
    # A cycle is so many whole samples of whole steps: a little less than what is allowed.
    assert 0.97 * longest < case.run.time_step <= longest


# --- laws of users ----------------------------------------------------------------------------------------------------

CURVE = """
import random, sys
import numpy as np
from walkers.physics.bridge import Curve, Forces

def forces(gaps, pull=4e-5):
    one = np.ones_like(gaps)
    return Forces(pull * one, 3e-3 * one, 1e-3 * one, 0.0 * one, 0.0 * one)

def law(surfaces):
    return Curve(forces, rupture=0.3 * surfaces.radius)
"""


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("def law(surfaces): raise KeyError('x')", "raises KeyError: 'x'"),
        ("def law(surfaces): return None", "returns NoneType; expected walkers.physics.bridge.Curve"),
        ("def law(surfaces): yield 1", "returns generator; expected"),
        ("def law(surfaces, other): return None", "raises TypeError: law() missing 1 required positional"),
        ("class law:\n    def __init__(self, surfaces): pass", "returns law; expected"),
        ("def law(surfaces): sys.exit()", "raises SystemExit"),
        ("sys.exit()", "raises SystemExit"),
        ("1 / 0", "raises ZeroDivisionError"),
        ("law = 3", "has no function law"),
        ("def law(surfaces): return Curve(forces, -1.0)", "breaks at a gap of -1 m; expected a positive number"),
        ("def law(surfaces): return Curve(forces, 1e3)", "breaks at a gap of 1000 m; expected at most 0.003"),
        ("def law(surfaces): return Curve(forces, '1')", "breaks at a gap of '1'; expected a number"),
        ("def law(surfaces): return Curve(forces, 1e-4, scale=-1.0)", "vary over a gap of -1 m; expected zero or more"),
        ("def law(surfaces): return Curve(forces, 1e-4, scale=np.nan)", "vary over a gap of nan m"),
        ("def law(surfaces): return Curve(lambda gaps: gaps, 1e-4)", "forces are ndarray; expected"),
        ("def law(surfaces): return Curve(lambda gaps: forces(gaps, np.nan), 1e-4)", "the pull is not a number"),
        ("def law(surfaces): return Curve(lambda gaps: forces(gaps, 1j), 1e-4)", "the pull has type complex128"),
        ("def law(surfaces): return Curve(lambda gaps: Forces(*'abcde'), 1e-4)", "the pull has type <U1"),
        ("def law(surfaces): return Curve(lambda gaps: Forces(*[np.ones(3)] * 5), 1e-4)", "and shape (3,); expected"),
        ("def law(surfaces): return Curve(forces, random.uniform(1e-5, 1e-4))", "gives other numbers"),
        ("K = random.random()\ndef law(surfaces): return Curve(lambda gaps: forces(gaps, K), 1e-4)", "other numbers"),
    ],
)
def test_an_unusable_law_of_a_user_is_one_message(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "own.py").write_text(f"{CURVE}\n{text}\n")
    for case in ("fig1b", "pile-small"):
        with warnings.catch_warnings(action="ignore"), pytest.raises(InputError) as caught:
            load_case(case, {"liquid.law": f"{tmp_path}/own.py:law"})
        (problem,) = caught.value.problems
        assert problem.key.endswith("liquid.law")
        assert told in problem.expected


@pytest.mark.parametrize(
    ("law", "told"),
    [
        ("os:system", "raises TypeError"),
        ("no/such.py:law", "such.py cannot be read: No such file"),
        ("own.py:law\\nrange", "expected one of"),
        ("own.py:none", "has no function none"),
    ],
)
def test_a_name_of_a_law_that_cannot_be_used_exits_with_status_2(in_folder: Path, law: str, told: str) -> None:
    (in_folder / "own.py").write_text(CURVE)
    done = call("show", "fig1b", "--set", f'liquid.law="{law}"')
    assert (done.returncode, done.stdout, done.stderr.count("Traceback")) == (2, "", 0)
    assert 'liquid.law = "' in done.stderr
    assert told in done.stderr


def test_a_law_is_executed_when_it_is_new_and_the_program_says_so_once(in_folder: Path) -> None:
    (in_folder / "own.py").write_text(f"{CURVE}\nopen('executed', 'a').write('x')\n")
    done = call("run", "fig1b", "--set", "liquid.law=own.py:law", "--set", "run.cycles=4", check=True)
    assert done.stderr.count(f"executes {in_folder.resolve()}/own.py, the bridge law of the case") == 1
    assert (in_folder / "executed").read_text() == "xx", "twice, to compare the numbers"


def test_an_edited_law_has_other_loads_in_the_same_session(in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also if it is as long and as old as before, by which Python tells whether its bytecode is current."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    file = in_folder / "own.py"
    pulls = []
    for pull in ("4e-5", "8e-5"):
        file.write_text(CURVE.replace("4e-5", pull))
        os.utime(file, (1e9, 1e9))
        pulls.append(bridge_at_rest(load_case("fig1b", {"liquid.law": "own.py:law"}), 3e-4, inf).pull)
    assert pulls == [4e-5, 8e-5]
    assert [*in_folder.iterdir()] == [file]


@pytest.mark.parametrize("shared", [False, True])
def test_a_run_shows_and_exports_the_law_that_it_recorded(in_folder: Path, shared: bool) -> None:
    """Whether its file is there, was edited or is gone; nothing of it is executed."""
    law = in_folder / "own.py"
    law.write_text(CURVE)
    setting = ("--set", "liquid.law=own.py:law", "--set", "run.cycles=4")
    if shared:
        sweep = {
            "case": "fig1b",
            "set": {"liquid.law": "own.py:law", "run.cycles": 4},
            "axes": {"liquid.surface_tension": ["20 mN/m", "30 mN/m"]},
        }
        (in_folder / "two.toml").write_text(to_toml(sweep))
        call("sweep", "two.toml", "-j", "1", check=True)
        run = str(next((in_folder / "runs").glob("fig1b-*")))
    else:
        run = str(json.loads(call("run", "fig1b", *setting, "--json", check=True).stdout)["run"])
    expected = call("show", run, check=True)
    deck = call("export", run, "--to", "deck", "-o", "deck", check=True)
    assert "executes" not in expected.stderr + deck.stderr
    assert expected.stdout.count("40 µN") == 3
    if not shared:
        assert numbers_of(Path("deck")) == numbers_of(Path(run, "segments", "0000"))
    for text in (CURVE.replace("4e-5", "9e-5"), None):
        law.write_text(text) if text else law.unlink()
        again = call("show", run, check=True)
        assert (again.stdout, again.stderr) == (expected.stdout, "")
    assert Path(run, "law.py").read_text() == CURVE
    archive = call("export", run, "--to", "archive", "-o", "run.zip", check=True)
    assert archive.stderr == ""
    with zipfile.ZipFile("run.zip") as packed:
        assert packed.read(f"runs/{Path(run).name}/law.py").decode() == CURVE
    missing = call("show", "fig1b", *setting)
    assert (missing.returncode, missing.stderr.count("\n")) == (2, 1)
    assert "own.py cannot be read: No such file" in missing.stderr


def numbers_of(folder: Path) -> list[list[float]]:
    lines = (folder / "bridges.txt").read_text().splitlines()
    return [[float(f"{float(word):.6g}") for word in line.split()] for line in lines if line[0].isdigit()]
