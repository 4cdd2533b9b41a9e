"""Two runs or two sweeps side by side."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from math import hypot
from pathlib import Path

import pytest

import walkers
from tests.conftest import call, document, to_toml
from tests.test_folder import SHORTEST
from walkers.inputs.sweep import expand
from walkers.postprocess.uncertainty import ACCURACY_NAME
from walkers.runner.directory import case_of
from walkers.runner.files import read_json, write_json
from walkers.runner.manifest import MANIFEST_NAME, checksums
from walkers.sweeps.comparison import Side, compare_runs
from walkers.sweeps.scheduler import Options, run_sweep
from walkers.sweeps.table import load


@pytest.fixture
def out(looked_through: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder, as ``runs`` of the current one, with the case of its sweeps; nothing in it changes."""
    (tmp_path / "runs").symlink_to(looked_through)
    shutil.copy(looked_through.parent / "base.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    yield Path("runs")


def test_compare_tells_parameters_and_results_of_two_runs(out: Path) -> None:
    table = walkers.load(out / "beads").table().set_index(["liquid.name", "dimers.radii[0]"])
    rows = [table.loc[("Si AK5", 0.3)], table.loc[("Si AK10", 0.3)]]
    found = json.loads(call("compare", *(Path(row["run"]).name for row in rows), "--json", check=True).stdout)
    assert found["parameters"] == {"liquid.name": ["Si AK5", "Si AK10"]}
    results = {one["quantity"]: one for one in found["results"]}
    for name, number in {"": "velocity", "_scatter": "scatter"}.items():
        sides = [results["velocity"][f"{side}{name}"] for side in ("first", "second")]
        assert sides == [row[number] for row in rows]
    assert results["velocity"]["numerical_error"] is None
    # Cases may be named, and one that was not run; changes are of the second side.
    told = call("compare", "base.toml", "fig4a", check=True).stdout
    assert "0.6/0.3 mm" in told and "fig4a: no finished run" in told
    assert "all results are the same" in call("compare", "base.toml", "base.toml", check=True).stdout
    for sides in (["base.toml"], ["base.toml", "base.toml"]):
        found = json.loads(call("compare", *sides, "--set", "drive.frequency=90Hz", "--json", check=True).stdout)
        assert {key: values[1] for key, values in found["parameters"].items()} == {"drive.frequency": 90.0}
        assert found["second"] == "base.toml drive.frequency=90Hz" == found["not_run"][0]


def test_compare_matches_the_points_of_two_sweeps(out: Path) -> None:
    """Whatever their order; one sweep has points that the other has not."""
    keys = ["drive.frequency", "drive.peak_acceleration"]
    tables = [walkers.load(out / name).table().set_index(keys) for name in ("grid", "rough")]
    found = json.loads(call("compare", "grid", "rough", "--json", check=True).stdout)
    assert found["parameters"] == {"contact.friction.bead_wall": [0.1, 0.2]}
    assert found["unmatched"] == [2, 0]
    assert len(found["points"]) == 4
    for one in found["points"]:
        at = tuple(one["point"][key] for key in keys)
        assert (one["first"], one["second"]) == tuple(table.loc[at, "velocity"] for table in tables)
    assert "4 points in both" in call("compare", "grid", "rough", check=True).stdout


def _changed(run: Path, to: Path, name: str, speed: float, error: float) -> Side:
    """A copy of a run whose result has another velocity and numerical error (m/s), as if measured so."""
    shutil.copytree(run, to / name)
    result = read_json(to / name / "result.json")
    result["numbers"]["velocity"] = speed
    write_json(to / name / "result.json", result)
    write_json(to / name / ACCURACY_NAME, {"errors": {"velocity": {"total": error}}})
    manifest = read_json(to / name / MANIFEST_NAME)
    manifest["sha256"] |= checksums(to / name, ["result.json", ACCURACY_NAME])
    write_json(to / name / MANIFEST_NAME, manifest)
    return Side(name, case_of(run), to / name)


def test_compared_runs_differ_by_so_many_times_both_their_numerical_errors(
    run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    """Errors of 3 and 4 µm/s make 5 µm/s of a difference of -50 µm/s."""
    run = run_directory(run={"time_step": "2 us", "cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5})
    fast, slow = _changed(run, tmp_path, "fast", 1.05e-3, 3e-6), _changed(run, tmp_path, "slow", 1e-3, 4e-6)
    found = compare_runs(fast, slow)
    (velocity,) = (one for one in found.contents["results"] if one["quantity"] == "velocity")
    assert velocity["difference"] == pytest.approx(-5e-5)
    assert velocity["numerical_error"] == pytest.approx(hypot(3e-6, 4e-6))
    assert "velocity: differs by 10 times its numerical error" in found.text
    assert re.search(r"\nvelocity \(mm/s\) +1\.05 +1 +-0\.05 ", found.text)


def test_compared_sweeps_differ_most_at_the_largest_change_of_either_sign(tmp_path: Path) -> None:
    """With more friction the walker is faster under a weak drive, and slower by more under a strong one."""
    run = {"time_step": "2 us", "cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5}
    tables = {"case": "base.toml", "axes": {"drive.peak_acceleration": ["3 g", "6 g"]}}
    sides: list[str] = []
    for friction in (0.05, 0.2):
        contact = {"friction": {"bead_bead": 0.1, "bead_wall": friction}}
        (tmp_path / "base.toml").write_text(to_toml(document(run=run, contact=contact)))
        sweep = expand(tables, source="t", name=f"rough-{friction}", folder=tmp_path)
        sides.append(str(run_sweep(sweep, tmp_path / "runs", Options(1))[0].directory))
    found = json.loads(call("compare", *sides, "--json", check=True).stdout)
    away = [one["difference"] for one in found["points"]]
    speeds = [load(Path(side))["velocity"] for side in sides]
    assert away == pytest.approx(list(speeds[1] - speeds[0]))
    assert away[0] > 1e-4
    assert away[1] < -2.0 * away[0]
    told = call("compare", *sides, check=True).stdout
    assert f"2 points in both; largest difference {1e3 * away[1]:.4g} mm/s" in told


def test_sweeps_over_lists_of_different_lengths_are_compared_either_way(in_folder: Path) -> None:
    """Clusters of three beads and of two: the longer list has a column that the other sweep has not."""
    tables = document(run=SHORTEST)
    del tables["dimers"]
    radii = ["0.3 mm", "0.2 mm"]
    (in_folder / "base.toml").write_text(
        to_toml({**tables, "clusters": [{"radii": radii, "arrangement": "chain", "replicates": 1}]})
    )
    for name, levels in (("long", [[*radii, "0.2 mm"], radii]), ("short", [radii, ["0.3 mm", "0.25 mm"]])):
        Path(f"{name}.toml").write_text(f'case = "base.toml"\naxes."clusters[0].radii" = {json.dumps(levels)}\n')
        call("sweep", f"{name}.toml", check=True)
    for names in (["long", "short"], ["short", "long"]):
        found = json.loads(call("compare", *names, "--json", check=True).stdout)
        assert [len(one["point"]["clusters[0].radii"]) for one in found["points"]] == [2]
        assert found["points"][0]["difference"] == 0.0
