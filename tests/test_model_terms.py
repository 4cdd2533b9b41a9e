"""Fits of the theory with further terms: what is put in comes out, and what is lacking is missed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkers.paper.model_terms import (
    ADDED,
    ALWAYS,
    KAPPA,
    NOTHING_ELSE,
    as_markdown,
    fit,
    speeds,
    values_of,
    walkers_of_the_paper,
    write_model_terms,
)
from walkers.paper.published import FITTED
from walkers.runner.files import read_json
from walkers.theory.prediction import motion_of

KNOWN = {"friction_wall": 0.25, "friction_slide": 0.2, "friction_bead": 0.12, "log10_viscosity_ratio": 1.0}


def test_speeds_are_those_of_the_theory_beside_the_engine() -> None:
    """For a case with its bridges and friction the same velocity as `walkers theory` gives."""
    point = FITTED[-1].of[0]
    assert point.name == "4a"
    bare = walkers_of_the_paper()[point]
    liquid = replace(bare.liquid, dynamic_viscosity=7.0 * bare.liquid.dynamic_viscosity)
    contact = replace(bare.contact, friction_bead_wall=0.3, friction_bead_bead=0.1)
    expected = float(motion_of(replace(bare, liquid=liquid, contact=contact)).velocity[0])
    parameters = {
        **{"friction_wall": 0.05, "friction_slide": 0.3, "friction_bead": 0.1},
        "log10_viscosity_ratio": float(np.log10(7.0)),
    }
    assert expected > 1e-3
    assert speeds(parameters)["velocity"][point] == pytest.approx(expected, rel=1e-6)


def test_the_papers_law_alone_gives_its_figures_and_with_inertia_less_at_the_largest_asymmetry() -> None:
    """Of Fig. 4a and of the plateau it gives nothing."""
    found = fit((KAPPA,), fixed=NOTHING_ELSE, generations=3)
    published = {number.fitted: number.si for number in FITTED}
    assert len(published) == 16
    assert found.parameters.keys() == {"log10_kappa"}
    assert not {"Fig. 2, 4 g", "Fig. 2, 6 g", "Fig. 3, 0.3/0.2 mm"} & set(found.missed)
    assert {"Fig. 2, plateau", "Fig. 4a, velocity", "Fig. 3, 0.4/0.2 mm"} <= set(found.missed)
    assert (found.values["Fig. 3, 0.4/0.2 mm"] or 0.0) < published["Fig. 3, 0.4/0.2 mm"]
    assert (found.values["Fig. 4a, velocity"] or 0.0) > 2.0 * published["Fig. 4a, velocity"]


@pytest.mark.slow
def test_what_the_theory_made_is_found_again_and_what_it_lacks_is_missed(tmp_path: Path) -> None:
    made = {**KNOWN, "static_ratio": 1.8, "log10_stribeck_velocity": -3.0}
    wanted = FITTED[:7]
    scales = [1.0 if one.over else 1e3 for one in wanted]  # as published, in mm/s
    dry, wet = (
        [
            replace(one, value=value * scale, deviation=one.si_deviation * scale)
            for one, value, scale in zip(wanted, values_of(known, wanted).values(), scales, strict=True)
        ]
        for known in (KNOWN, made)
    )
    alone = fit((), dry, generations=30)
    assert (alone.met, alone.missed) == (len(wanted), [])
    assert alone.misfit < 0.2
    assert alone.parameters["friction_wall"] == pytest.approx(KNOWN["friction_wall"], rel=0.15)
    without, static = fit((), wet, generations=9), fit((ADDED[-1],), wet, generations=9)
    assert static.misfit < 0.5 * without.misfit
    assert set(static.parameters) == set(ALWAYS.ranges) | set(ADDED[-1].ranges)
    full = [replace(one, values=dict(values_of(one.parameters, FITTED))) for one in (without, static)]
    paths = write_model_terms(full, tmp_path)
    assert [path.name for path in paths] == ["model_terms.json", "model_terms.md"]
    assert len(read_json(paths[0])["fits"]) == 2
    assert as_markdown(full).count("\n| Fig.") == len(FITTED)
