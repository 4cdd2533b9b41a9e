"""Numbers of sweeps by a second formula: bands of spreads, thresholds of descents, comparisons, plans of decks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

import walkers
from tests.conftest import document, make_case, to_toml
from walkers.inputs.loads import dimer_of
from walkers.postprocess.uncertainty import SPREAD_NAME, spread_of
from walkers.runner.files import read_json
from walkers.sweeps.spread import spread_in
from walkers.sweeps.table import groups, thresholds

# --- spread -----------------------------------------------------------------------------------------------------------

FRICTION, RESTITUTION, ROLLING = "contact.friction.bead_wall", "contact.restitution", "contact.rolling_friction"
UNCERTAIN = {FRICTION: [0.05, 0.3], RESTITUTION: [0.2, 0.8], ROLLING: [0.0, 0.01]}


def _with_rank(order: np.ndarray[Any, Any], seed: int, low: float, high: float) -> list[float]:
    """Numbers from 0 to 1 whose rank correlation with an order is between two values, by trial."""
    draw = np.random.default_rng(seed)
    while True:
        values = draw.random(len(order))
        if low < spearmanr(values, order).statistic < high:
            return [*map(float, values)]


def test_a_spread_has_the_quantiles_and_the_signed_ranks_of_its_draws() -> None:
    """32 speeds 0.1 × 1.2ⁿ - 0.5 mm/s that fall with friction; two walkers came apart, a point failed."""
    number = np.arange(32)
    speeds = 1e-4 * 1.2**number - 5e-4
    strong, weak = _with_rank(number, 1, 0.55, 0.6), _with_rank(number, 2, 0.25, 0.3)
    whole = pd.DataFrame({"velocity": speeds, FRICTION: 0.3 - 0.005 * number, RESTITUTION: strong, ROLLING: weak})
    whole["status"], whole["separated_fraction"] = "finished", 0.0
    others = pd.DataFrame({"velocity": [1.0, -1.0, 2.0], "separated_fraction": [0.5, 0.2, 0.0]})
    others = others.assign(status=["finished", "finished", "failed"], **dict.fromkeys(UNCERTAIN, 0.2))
    table = pd.concat([whole, others]).sample(frac=1.0, random_state=1).reset_index(drop=True)
    spread = spread_in(table, make_case(uncertain=UNCERTAIN), Path())
    band = spread.bands["velocity"]
    # Of 32 sorted numbers, from 0 to 31, 5 and 95 % are at 1.55 and 29.45, the median between the two in the middle.
    assert band["low"] == pytest.approx(speeds[1] + 0.55 * (speeds[2] - speeds[1]))
    assert band["median"] == pytest.approx((speeds[15] + speeds[16]) / 2.0)
    assert band["high"] == pytest.approx(speeds[29] + 0.45 * (speeds[30] - speeds[29]))
    assert (band["smallest"], band["largest"], band["points"]) == (speeds[0], speeds[31], 32)
    # 0.1 × 1.2ⁿ is below 0.5 up to n = 8.
    assert spread.counts == {"forward": 23, "backward": 9, "at_rest": 0, "separated": 2}
    # Two standard errors are 0.36: rolling friction is left out.
    depends = spread.depends["velocity"]
    assert list(depends.items()) == [
        (FRICTION, pytest.approx(-1.0)),
        (RESTITUTION, pytest.approx(spearmanr(strong, speeds).statistic)),
    ]


def test_bands_along_a_sweep_are_those_of_each_points_spread(tmp_path: Path) -> None:
    run = {"time_step": "2 us", "cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5}
    case = tmp_path / "base.toml"
    case.write_text(to_toml(document(run=run, uncertain={FRICTION: [0.05, 0.3]})))
    tables = {"case": str(case), "axes": {"drive.peak_acceleration": ["3 g", "6 g"]}}
    table = walkers.sweep(tables, tmp_path, spread=4).table()
    for row in table.itertuples():
        spread = read_json(spread_of(tmp_path / Path(row.run).name) / SPREAD_NAME)["bands"]["velocity"]
        assert row.velocity_low == min(spread["low"], row.velocity)
        assert row.velocity_high == max(spread["high"], row.velocity)
        assert row.velocity_low < row.velocity_high
    assert table["velocity_high"].is_monotonic_increasing


# --- groups -----------------------------------------------------------------------------------------------------------


def test_points_that_differ_in_their_seed_alone_are_a_group() -> None:
    """A law that a case may leave to the program ("auto", none) is a value as others."""
    values = {"drive.frequency": [90.0, 60.0] * 3, "contact.law": ["auto", 1.0, "auto", None, "auto", None]}
    table = pd.DataFrame({**values, "run.seed": [1, 1, 2, 1, 3, 2], "boundary.tilt": 0.0})
    table.attrs["varied"] = list(table)
    found = [(named, list(rows.index)) for named, rows in groups(table)]
    assert [rows for _, rows in found] == [[0, 2, 4], [1], [3, 5]]
    assert found[1][0] == {"drive.frequency": 60.0, "contact.law": 1.0}
    ((named, rows),) = groups(table.loc[[0, 2, 4]])
    assert (named, list(rows.index), rows.attrs["varied"]) == ({}, [0, 2, 4], list(table))


# --- descents ---------------------------------------------------------------------------------------------------------


def test_a_descents_thresholds_have_the_gamma0_of_their_own_drives() -> None:
    """Two descents from 1.2 g in steps of 0.2 g; walkers of the first go toward their small beads."""
    speeds = [[-3e-4, -1e-4, 1e-6], [2e-4, -1e-6, 2e-5]]
    dimer = dimer_of(make_case())
    rows = [
        {"point": 5 * descent + step, "drive.frequency": 60.0 + 30.0 * descent, "velocity": speed, "status": "finished"}
        for descent, of in enumerate(speeds)
        for step, speed in enumerate(of)
    ]
    rows.append({"point": 3, "drive.frequency": 60.0, "velocity": np.nan, "status": "failed"})
    table = pd.DataFrame(rows).sort_values("point", ignore_index=True)
    table["drive.peak_acceleration"] = 1.2 - 0.2 * (table["point"] % 5)
    table["gamma0"] = [dimer.gamma0(9.80665 * g) for g in table["drive.peak_acceleration"]]
    units = {"drive.frequency": "Hz", "drive.peak_acceleration": "g"}
    table.attrs |= {"units": units, "varied": list(units), "until_below": 1e-5}
    first, second = thresholds(table).to_dict("records")
    for row, moving, at_rest in ((first, 1.0, 0.8), (second, 1.2, 1.0)):
        assert (row["moving"], row["at_rest"]) == pytest.approx((moving, at_rest))
        # Γ0 = M a0/4πγR̄ is proportional to the drive.
        mass, force = 4000.0 * 4.0 / 3.0 * np.pi * (0.3e-3**3 + 0.2e-3**3), 4.0 * np.pi * 19.2e-3 * 0.25e-3
        expected = [mass * 9.80665 * g / force for g in (moving, at_rest)]
        assert [row["gamma0_moving"], row["gamma0_at_rest"]] == pytest.approx(expected, rel=0.05)
        assert row["gamma0_moving"] / row["gamma0_at_rest"] == pytest.approx(moving / at_rest)
