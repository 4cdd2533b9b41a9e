"""Tables of bridge laws: as exact as they are said to be, and refused where a law is of no use."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from tests.conftest import make_case
from walkers.physics.bridge import Curve, FloatArray, Forces, Surfaces
from walkers.physics.laws import LAWS, by_name
from walkers.templates.bridge_tables import TOLERANCE, UnusableLawError, tabulated

CASE = make_case(liquid={"contact_angle": "20 deg"})
AT_WALL = Surfaces.of(3e-4, inf, CASE.liquid, CASE.contact.minimum_separation_ratio)
BETWEEN = Surfaces.of(3e-4, 2e-4, CASE.liquid, CASE.contact.minimum_separation_ratio)


@pytest.mark.parametrize("surfaces", [AT_WALL, BETWEEN], ids=["wall", "beads"])
@pytest.mark.parametrize("name", [name for name in LAWS if name != "van-der-waals"])
def test_the_engine_reads_the_law_out_of_its_table(name: str, surfaces: Surfaces) -> None:
    law = by_name(name)
    table = tabulated(law, surfaces)
    gaps = table.curve.rupture * np.random.default_rng(1).random(200) ** 3
    expected = law(surfaces).forces(gaps).columns()
    scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max(axis=0))
    np.testing.assert_array_less(np.abs(interpolated(table.text(), gaps) - expected), 10 * TOLERANCE * scale + 1e-30)


def interpolated(text: str, gaps: FloatArray) -> FloatArray:
    """Pull and resistances, shape (n, 5), at gaps (m), of a table after its first line.

    It is what walkers/engine/table.h makes of it, written down once more from the format alone.
    """
    head, *lines = text.splitlines()
    rupture, scale = (float(word) for word in head.split()[2:4])
    octaves, cells = (int(word) for word in head.split()[4:])
    rows = np.array([[float(word) for word in line.split()] for line in lines])
    middle = scale * (2.0**octaves - 1.0)
    mantissa, exponent = np.frexp(1.0 + gaps / scale)
    near = cells * ((exponent - 1) + 2.0 * mantissa - 1.0)
    far = cells * (octaves + 2.0 * (1.0 - np.sqrt((rupture - gaps) / (rupture - middle))))
    place = np.where(gaps < middle, near, far)
    cell = np.minimum(place.astype(int), (len(rows) - 1) // 3 - 1)
    fours = [rows[3 * number : 3 * number + 4, 1:] for number in cell]
    cubics = [np.polynomial.polynomial.polyfit(np.arange(4) / 3.0, four, 3) for four in fours]
    return np.array([(at ** np.arange(4)) @ cubic for at, cubic in zip(place - cell, cubics, strict=True)])


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
        ({"pull": lambda gaps: np.log(gaps - 1e-5)}, "the pull is no number at a gap of 0 m"),
        ({"normal": lambda gaps: 1.0 - gaps / 5e-5}, "the normal resistance is negative"),
        ({"coupling": lambda gaps: 2.0 + gaps}, "sliding and rolling together give energy"),
        (
            {"pull": lambda gaps: np.where(gaps < 3.3e-5, 1.0, 0.0)},
            "the finest table, of 256 cells an octave",
        ),
        ({"rupture": 0.0}, "the bridge breaks at a gap of 0 m"),
        ({"rupture": inf}, "the bridge breaks at a gap of inf m"),
        ({"formation": 2e-4}, "the bridge forms at a gap of 0.0002 m; expected 0 to its rupture"),
    ],
)
def test_a_law_that_cannot_be_used_is_refused(changes: dict[str, object], told: str) -> None:
    with pytest.raises(UnusableLawError, match=told):
        tabulated(lambda _: _law(**changes), AT_WALL)
