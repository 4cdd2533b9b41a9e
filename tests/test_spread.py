"""What a result is worth that rests on guessed values: its spread over their ranges."""

from __future__ import annotations

from pathlib import Path

import pytest

import walkers
from tests.conftest import REFERENCE
from tests.test_inputs import GLASS
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.library import unmeasured
from walkers.postprocess.numbers import band_text
from walkers.sweeps.scheduler import Options
from walkers.sweeps.spread import describe, run_spread, spread_sweep


def test_a_spread_over_what_nobody_measured(runs_folder: Path) -> None:
    """Glass on polystyrene at 10 g walks or not as one guesses; the single number, exact to 1e-5, does not say so."""
    case = Case.read({**GLASS, "run": {"cycles": 6}}, name="guessed")
    spread = run_spread(case, runs_folder, Options(2), points=4)
    assert {one.key for one in spread.varied} == {one.key for one in case.origins if one.guessed}
    assert {one.key for one in spread.held} == {"contact.friction.bead_bead", "contact.rolling_friction"}
    assert "contact_angle 0 deg (0 deg to 60 deg)" in describe(spread)
    table = walkers.load(spread.directory).table()
    assert table["contact.friction.bead_wall"].between(0.1, 0.6).all()
    assert (table["liquid.viscosity_ratio"] > 1.0).sum() == 2  # half of the draws: the case's own is the median
    assert (table["liquid.contact_angle"] == 0.0).sum() == 2  # its own is the end of what is possible
    assert sum(spread.counts.values()) == 4
    # The headline has the band from now on, which holds it.
    done, band = walkers.run(case, runs_folder), spread.bands["velocity"]
    assert band["high"] - band["low"] > 1e-4  # m/s
    own, ends = done.result["velocity"], (done.result["velocity_low"], done.result["velocity_high"])
    assert ends == (min(band["low"], own), max(band["high"], own))
    assert f"band {band_text(*ends, 'm/s')}" in done.describe()
    told = {one["key"]: one["origin"] for one in done.result.about["rests_on"]}
    assert told["contact.friction.bead_wall"] == "given"
    assert told.keys() == unmeasured().keys()
    # It is for its ranges alone, with which a run does not change its name.
    done = walkers.run(
        Case.read({**case.document, "uncertain": {"contact.friction.bead_wall": [0.2, 0.6]}}), runs_folder
    )
    assert "velocity_low" not in done.result
    with pytest.raises(InputError, match=r"uncertain.contact.restitution.*: expected a range that holds"):
        spread_sweep(Case.read({**GLASS, "uncertain": {"contact.restitution": [0.4, 0.8]}}, name="beside"))
    with pytest.raises(InputError, match="no value is uncertain"):
        run_spread(Case.read(REFERENCE), runs_folder, Options(2))
