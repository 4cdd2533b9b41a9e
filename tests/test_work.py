"""The work of the drive on walkers."""

from collections.abc import Callable
from math import isnan
from pathlib import Path

import pytest

from walkers.inputs.loads import contact_loads, dimer_of
from walkers.postprocess.numbers import rows
from walkers.postprocess.results import read
from walkers.postprocess.tables import read_table
from walkers.runner.directory import case_of


def test_the_drive_pays_for_what_slides(run_directory: Callable[..., Path]) -> None:
    """Equal beads that keep each other from rolling, hardly held by friction: 4 A μ N in a cycle, to no end."""
    directory = run_directory(
        dimers={"radii": ["0.25 mm", "0.25 mm"], "replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0},
        liquid={"viscosity_ratio": 1e-4},
        contact={"friction": {"bead_wall": 0.01, "bead_bead": 1.0}, "rolling_friction": 0.0},
        run={"cycles": 60, "settling_cycles": 50, "samples_per_cycle": 20},
    )
    case, result = case_of(directory), read(directory)
    pressed = sum(load.pull for load in contact_loads(case)[:2]) + dimer_of(case).total_mass * case.pressing_gravity
    assert result["work"] == pytest.approx(4.0 * case.excitation.amplitude * 0.01 * pressed, rel=0.02)
    assert isnan(result["cost_of_transport"])
    works = read_table(directory, "cycles").set_index("cycle")["work"]
    assert works[50:].mean() == pytest.approx(result["work"])
    assert works.index[works.isna()].tolist() == [60]
    (row,) = (row for row in rows(result) if row.name == "work")
    assert (row.text, row.unit) == (f"{1e9 * result['work']:.4g}", "nJ")
