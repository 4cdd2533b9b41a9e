"""Published laws of bridges beside Young–Laplace, and the engine's tables."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, inf, pi, radians
from pathlib import Path

import numpy as np
import pytest

from tests.printed import spoilt
from walkers.check.bridge_laws import LAWS, Law
from walkers.check.bridges import chapter, deviation, reference, shape_of
from walkers.inputs.reading import load_case
from walkers.physics.bridge import FloatArray, Surfaces
from walkers.physics.capillary import derjaguin_radius
from walkers.physics.laplace import force_curve

BY_NAME = {law.name.split()[0]: law for law in LAWS}


def with_liquid(radius: float, other: float, volume_fraction: float, contact_angle: float) -> Surfaces:
    liquid = replace(load_case("fig1b").liquid, volume_fraction=volume_fraction, contact_angle=contact_angle)
    return Surfaces.of(radius, other, liquid, 0.01)


MUCH_LIQUID = with_liquid(3e-4, inf, 0.171, radians(38.2))


@pytest.mark.parametrize("law", LAWS[2:], ids=lambda law: law.name)
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: Law, radius_2: float) -> None:
    """All but Soulié et al.'s and Willett et al.'s long form, polynomials in ln V that end at larger volumes."""
    radius = derjaguin_radius(1.0, radius_2)
    pull = law.pull(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


@pytest.mark.parametrize("name", ["Lambert", "Rabinovich"])
def test_laws_for_small_volumes(name: str) -> None:
    """Of a volume of a millionth of the radius cubed they are right until the bridge is near its end."""
    curve = force_curve(1.0, 1.0, 1e-6, 0.0)
    near = curve.gaps < 0.5 * curve.rupture
    pull = BY_NAME[name].pull(1.0, 1.0, 1e-6, 0.0, curve.gaps[near])
    assert pull == pytest.approx(curve.forces[near], abs=0.025 * curve.forces[0])


def test_weigerts_toroid_at_contact() -> None:
    for volume in (1e-3, 1e-2, 1e-1):
        pull = BY_NAME["Weigert"].pull(1.0, 1.0, volume, 0.0, np.zeros(1))[0]
        assert pull == pytest.approx(force_curve(1.0, 1.0, volume, 0.0, [0.0]).forces[0], rel=0.08)


def test_deviation_of_a_law_that_is_known() -> None:
    """Young–Laplace's own forces, a tenth larger and to a shorter gap."""
    shape = shape_of(MUCH_LIQUID)
    exact = reference(shape)

    def larger(one: float, other: float, volume: float, angle: float, gaps: FloatArray) -> FloatArray:
        return 1.1 * np.interp(gaps, exact.gaps, exact.forces)

    found = deviation(Law("larger", larger, lambda *_: 0.8 * exact.rupture), MUCH_LIQUID)
    end = force_curve(*shape, [0.8 * exact.rupture])
    assert found.pull == pytest.approx(1.1)
    assert found.rupture == pytest.approx(0.8)
    assert found.work == pytest.approx(1.1 * (end.energies[0] - exact.energies[0]) / exact.work, rel=2e-3)


def test_what_is_wrong_with_soulies_law() -> None:
    """Doubling is right at walls at contact, not beyond; dimers are held too strongly at large contact angles."""
    wall = deviation(BY_NAME["Soulié"], MUCH_LIQUID)
    assert wall.pull == pytest.approx(1.07, abs=0.01)
    assert wall.work > 1.3
    assert wall.rupture > 1.3
    unequal, equal = (with_liquid(one, 3e-4, 0.171, radians(38.2)) for one in (6e-4, 3e-4))
    assert deviation(BY_NAME["Soulié"], unequal).pull == pytest.approx(1.40, abs=0.02)
    assert deviation(BY_NAME["Soulié"], equal).pull == pytest.approx(1.2, abs=0.02)


def test_chapter(tmp_path: Path) -> None:
    found = chapter(tmp_path, quick=True)
    assert not found.failed
    assert set(found.figures) == {"bridges"}
    assert "figures/validation-bridges.png" in found.text
    assert spoilt(found.figures["bridges"]) == []
    json.dumps(found.numbers, allow_nan=False)
    assert [row["name"] for row in found.numbers["laws"]] == [law.name for law in LAWS]
