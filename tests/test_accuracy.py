"""Numerical errors by smaller time steps and harder beads: what they are worth, when none is given, how they last."""

from __future__ import annotations

import json
from itertools import pairwise
from math import hypot
from pathlib import Path
from zipfile import ZipFile

import pytest

import walkers
from tests.conftest import call, make_case
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.postprocess.numbers import rows
from walkers.sweeps.accuracy import measure_accuracy, times_of
from walkers.sweeps.scheduler import Options

ROOT = Path(__file__).parent.parent
QUICK = {"time_step": "4 us", "cycles": 6, "settling_cycles": 2, "samples_per_cycle": 5}
PAIR = {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2}


def changed(case: Case, shorter: float, harder: float) -> Case:
    """A case with a part of its time step and a multiple of its modulus."""
    step, modulus = 1e6 * case.run.time_step * shorter, 1e-6 * case.contact.youngs_modulus * harder
    return case.changed({"run.time_step": f"{step!r} us", "contact.youngs_modulus": f"{modulus!r} MPa"})


def test_the_error_is_the_distance_from_far_harder_beads_at_a_far_smaller_step(tmp_path: Path) -> None:
    """100 times as hard, at half the step that the modulus allows: within the share that was asked for."""
    case = load_case("fig1b")
    done, reference = (walkers.run(one, tmp_path) for one in (case, changed(case, 0.05, 100.0)))
    own, limit = (run.result["velocity"] for run in (done, reference))
    assert "velocity_error" not in done.result
    found = done.accuracy()
    error = found.errors["velocity"]
    assert found.reached
    assert abs(own + error["stiffer"] - limit) < found.share * limit
    assert error["stiffer"] > 0.01 * own  # the limit is faster …
    half = walkers.run(changed(case, 0.5, 1.0), tmp_path)
    assert half.cached  # it is one of the runs
    assert error["half_step"] == pytest.approx(half.result["velocity"] - own)
    assert error["total"] == pytest.approx(hypot(error["half_step"], error["stiffer"]))
    # … as what rolls: the large bead.
    assert found.errors["rotation_1"]["stiffer"] == pytest.approx(error["stiffer"], rel=0.05)
    assert done.result["velocity_error"] == done.result["numerical_error"] == error["total"]
    speeds = walkers.load(tmp_path / found.sweep).table()["velocity"]
    cells = " | ".join(f"{100.0 * (one / own - 1.0):+.2f}".replace("-", "−") for one in speeds)
    assert f"| `fig1b`, 4 g | {1e3 * own:.3f} | {cells} |" in (ROOT / "docs/explanation/physics.md").read_text("utf-8")
    (row,) = (row for row in rows(done.result) if row.name == "velocity")
    assert f"numerical error {1e3 * error['total']:.2g}" in row.error
    assert row.error in done.describe()
    assert f"\n{done.directory.name} " in call("list", "--out", str(tmp_path), check=True).stdout  # beside the sweep
    with ZipFile(done.export("archive", tmp_path / "run.zip")) as archive:
        entities = json.loads(archive.read("ro-crate-metadata.json"))["@graph"]
    (made,) = (one for one in entities if one["@type"] == "CreateAction" and "/accuracy.json" in str(one["result"]))
    assert made["name"].startswith("Tables of")  # the engine has not made it
    call("check", "files", str(done.directory), check=True)


def test_an_interrupted_accuracy_continues_and_an_edited_one_can_be_measured_again(tmp_path: Path) -> None:
    done = walkers.run(make_case(run=QUICK), tmp_path)

    def stop(_: object) -> None:
        if len([*tmp_path.glob("*/manifest.json")]) > 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_accuracy(done.directory, Options(1), on_progress=stop)
    assert "velocity_error" not in done.result
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/manifest.json")}
    assert len(before) >= 2
    kept = done.accuracy()
    del before[done.directory / "manifest.json"]  # it lists the new file
    assert before == {path: path.stat().st_mtime_ns for path in before}
    (done.directory / "accuracy.json").write_text('{"errors": {}}')
    told = call("run", str(done.directory))
    assert (told.returncode, told.stderr.count("\n")) == (2, 1)
    assert told.stderr.endswith(f"damaged; measure it again with: walkers run {done.directory} --accuracy\n")
    again = call("run", str(done.directory), "--accuracy", "--json", check=True)
    assert json.loads(again.stdout.splitlines()[-1])["velocity_error"] == kept.errors["velocity"]["total"]


def test_what_is_not_reached_is_said(tmp_path: Path) -> None:
    """Up to 100 GPa: of 1000 MPa there are two larger moduli … and the last one changes more than the share."""
    done = walkers.run(make_case(run={**QUICK, "time_step": "0.8 us"}, contact={"youngs_modulus": "1 GPa"}), tmp_path)
    found = done.accuracy(1e-6)
    assert (found.reached, found.times) == (False, 64.0)
    assert any(
        f"not converged: the hardest beads still change {100.0 * found.change:.2g} %" in one
        for one in done.result.warnings
    )
    with pytest.raises(InputError, match=r"youngs_modulus.*at most 6250 MPa"):
        times_of(make_case(contact={"youngs_modulus": "10 GPa"}))


def test_walkers_up_and_down_a_slope_both_converge(tmp_path: Path) -> None:
    case = make_case(run=QUICK, boundary={"material": "glass", "tilt": "20 deg"}, dimers=PAIR)
    done = walkers.run(case, tmp_path)
    found = done.accuracy()
    speeds = [
        [run[f"{way}_facing"] for way in ("right", "left")]
        for run in (walkers.run(changed(case, times**-0.5, times), tmp_path).result for times in (4.0, 16.0, 64.0))
    ]
    changes = [max(abs(after / before - 1.0) for before, after in zip(*pair, strict=True)) for pair in pairwise(speeds)]
    times, change = next((16.0 * 4.0**place, one) for place, one in enumerate(changes) if one < 0.01)
    assert found.times == times
    assert found.change == pytest.approx(change, rel=0.02)
