"""Friction that is larger at rest than in motion: the study, and the engine's own model of it."""

from pathlib import Path

import pytest

from tests.printed import spoilt
from walkers.inputs.calibration import load_calibration
from walkers.studies.audited import temporary_bench
from walkers.studies.static_friction import (
    KINETIC,
    chapter,
    evaluate,
    in_stock_engine,
    plateau_at,
    sawteeth,
    sets,
    shipped,
)

RUBY = load_calibration("ruby")


def test_the_engines_model_is_a_sawtooth_between_both_coefficients() -> None:
    """0.3 and 0.6; where the bead slides far in a step it is the lower one, where it hardly moves the mean of both."""
    with temporary_bench() as bench:
        found = sawteeth(bench)
    for one in found:
        assert 0.299 < one.least < one.mean + 1e-9
        assert one.mean - 1e-9 < one.most < 0.601
    slow, fast = ([one.mean for one in found if one.speed == speed] for speed in (1e-4, 1e-2))
    assert slow == pytest.approx([0.45, 0.45], abs=0.01)
    assert fast == pytest.approx([0.3, 0.3], abs=0.001)


def test_with_one_coefficient_both_engines_walk_alike() -> None:
    """The engine's other model with equal coefficients, on linear springs, against the second engine on Hertz's."""
    one = evaluate("shipped", shipped(), KINETIC, RUBY, ["fig2_60_6"])
    with temporary_bench() as bench:
        assert in_stock_engine(one, RUBY, bench, ["fig2_60_6"]) == pytest.approx(one.speeds, rel=0.01)


def test_the_plateau_comes_with_two_coefficients_only() -> None:
    (_, kinetic), (_, found) = ((name, evaluate(name, *one, RUBY, [])) for name, one in sets().items())
    assert plateau_at(1.0, kinetic, RUBY) > 1.2
    assert plateau_at(1.0, found, RUBY) > 1.2
    assert plateau_at(found.laws.static_ratio, found, RUBY) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_chapter(tmp_path: Path) -> None:
    made = chapter(tmp_path)
    assert "figures/validation-static-friction.png" in made.text
    assert set(made.figures) == {"static-friction"}
    assert spoilt(made.figures["static-friction"]) == []
    assert chapter(tmp_path, quick=True).numbers["plateau"]["ratios"] == [1.0, 1.6]
