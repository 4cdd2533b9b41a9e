"""Published laws of bridges beside Young–Laplace, the engine's above all, and what their errors do to walkers."""

from __future__ import annotations

import json
from math import cos, inf, log, pi, radians
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import run_case
from tests.printed import spoilt
from walkers.inputs import resolve_case
from walkers.inputs.loads import contact_loads
from walkers.inputs.reading import load_case, read_toml, shipped_cases
from walkers.physics.capillary import derjaguin_radius
from walkers.physics.laplace import FloatArray, force_curve
from walkers.studies.bridge_laws import ENGINE, LAWS, Law
from walkers.studies.bridges import (
    CASES,
    CONTACT_NAMES,
    PAIRS,
    Condition,
    capillary_errors,
    chapter,
    deviation,
    reference,
    shipped,
    speeds,
)

MUCH_LIQUID = Condition("wall", 3e-4, inf, 0.171, radians(38.2))


@pytest.mark.parametrize("law", LAWS[2:], ids=lambda law: law.name)
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: Law, radius_2: float) -> None:
    """All but the engine's and Willett et al.'s long form, polynomials in ln V that end at larger volumes."""
    radius = derjaguin_radius(1.0, radius_2)
    pull = law.force(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


@pytest.mark.parametrize("law", [law for law in LAWS if law.name[:5] in {"Lambe", "Rabin"}], ids=lambda law: law.name)
def test_laws_for_small_volumes(law: Law) -> None:
    """Of a volume of a millionth of the radius cubed they are right until the bridge is near its end."""
    curve = force_curve(1.0, 1.0, 1e-6, 0.0)
    near = curve.gaps < 0.5 * curve.rupture
    assert law.force(1.0, 1.0, 1e-6, 0.0, curve.gaps[near]) == pytest.approx(
        curve.forces[near], abs=0.025 * curve.forces[0]
    )


def test_weigerts_toroid_at_contact() -> None:
    for volume in (1e-3, 1e-2, 1e-1):
        pull = next(law for law in LAWS if law.name == "Weigert 1999").force(1.0, 1.0, volume, 0.0, np.zeros(1))[0]
        assert pull == pytest.approx(force_curve(1.0, 1.0, volume, 0.0, [0.0]).forces[0], rel=0.08)


def test_deviation_of_a_law_that_is_known() -> None:
    """Young–Laplace's own forces, a tenth larger and to a shorter gap."""
    exact = reference(MUCH_LIQUID)

    def larger(one: float, other: float, volume: float, angle: float, gaps: FloatArray) -> FloatArray:
        return 1.1 * np.interp(gaps, exact.gaps, exact.forces)

    found = deviation(Law("larger", larger, lambda *_: 0.8 * exact.rupture), MUCH_LIQUID)
    end = force_curve(*MUCH_LIQUID.bridge, [0.8 * exact.rupture])
    assert found.pull == pytest.approx(1.1)
    assert found.rupture == pytest.approx(0.8)
    assert found.work == pytest.approx(1.1 * (end.energies[0] - exact.energies[0]) / exact.work, rel=2e-3)
    # Beyond 0.8 it pulls not at all where the reference still does.
    assert found.largest == pytest.approx(end.forces[0] / exact.forces[0], rel=0.05)


def test_the_engines_law() -> None:
    """What docs state of it: doubling is right at walls at contact, not beyond, and dimers are held too strongly."""
    wall = deviation(ENGINE, MUCH_LIQUID)
    assert wall.pull == pytest.approx(1.07, abs=0.01)
    assert wall.work > 1.3
    assert wall.rupture > 1.3
    for pair in PAIRS:
        beads = deviation(ENGINE, Condition("beads", *pair, 0.171, radians(38.2)))
        assert 1.28 < beads.pull < 1.41
        assert beads.work == pytest.approx(1.0, abs=0.03)
    equal = deviation(ENGINE, Condition("beads", 3e-4, 3e-4, 0.171, radians(38.2)))
    assert equal.pull == pytest.approx(1.2, abs=0.02)
    dry = deviation(ENGINE, Condition("wall", 2e-4, inf, 0.01, 0.0))
    assert dry.pull == pytest.approx(0.957, abs=0.01)


def test_the_conditions_are_those_of_shipped_cases() -> None:
    for name in CASES:
        case = load_case(name)
        assert case.liquid.volume_fraction == shipped()[0]
        assert case.liquid.contact_angle == pytest.approx(shipped()[1])
        assert case.walkers[0].radii in [pytest.approx(pair) for pair in PAIRS]


def test_errors_are_those_of_the_cases_own_contacts() -> None:
    case = load_case("fig4a")
    found = capillary_errors(case)
    assert tuple(one.name for one in found) == CONTACT_NAMES
    assert tuple(one.engine_pull for one in found) == contact_loads(case).capillary
    for one in found:
        assert one.deviation.pull == pytest.approx(one.engine_pull / one.pull)
        assert one.forces[0] == one.pull
        assert one.gaps[0] == 0.0
    assert [one.condition.volume for one in found] == pytest.approx(contact_loads(case).bridge_volumes)


@pytest.mark.parametrize("name", CASES)
def test_the_engine_is_as_sensitive_to_pulls_as_the_theory(name: str, tmp_path: Path) -> None:
    """The surface tension changes all pulls alike; whether walkers slow by them is asked of the engine."""
    velocities = []
    factors = (0.96, 1.04)
    for factor in factors:
        document = read_toml(shipped_cases()[name])
        tension = factor * load_case(name).liquid.surface_tension
        document.setdefault("liquid", {})["surface_tension"] = f"{1e3 * tension!r} mN/m"
        document["dimers"]["replicates"] = 2
        document["run"] = {"cycles": 20, "settling_cycles": 12}
        result = run_case(resolve_case(document, name=name), tmp_path).result
        velocities.append(result["velocity"]["mean"])
    slope = log(velocities[1] / velocities[0]) / log(factors[1] / factors[0])
    assert slope == pytest.approx(speeds(load_case(name)).sensitivities[3], rel=0.1)


def test_weaker_bridges_make_walkers_faster() -> None:
    found = speeds(load_case("fig1b"))
    assert found.young_laplace == pytest.approx(1.085 * found.engine, rel=0.01)
    large, small, pair, together = found.sensitivities
    assert abs(large) < 0.1
    assert large + small + pair == pytest.approx(together, abs=0.02)


def test_chapter(tmp_path: Path) -> None:
    found = chapter(tmp_path, quick=True)
    assert not found.failed
    assert set(found.figures) == {"bridges"}
    assert "figures/validation-bridges.png" in found.text
    assert spoilt(found.figures["bridges"]) == []
    assert "nan" not in json.dumps(found.numbers, allow_nan=False)
    assert {row["name"] for row in found.numbers["laws"]} == {law.name for law in LAWS}
    assert len(found.numbers["engine"]) == 8
