"""Tables as CSV files in two systems of units, and the units of parquet files in pandas."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

import walkers
from tests.conftest import TINY, call
from walkers.errors import InputError
from walkers.postprocess.measure.quantities import TABLES
from walkers.postprocess.measure.table_units import in_units
from walkers.postprocess.measure.tables import read_table
from walkers.runs.removal import unfinished_in


@pytest.fixture
def run(run_directory: Callable[..., Path], tmp_path: Path) -> walkers.Run:
    """A copy of a run of a walker."""
    directory = run_directory(run=TINY)
    return walkers.Run(Path(shutil.copytree(directory, tmp_path / "runs" / directory.name)))


def test_all_tables_of_a_run_are_written(run: walkers.Run, tmp_path: Path) -> None:
    folder = run.export("csv", tmp_path / "tables")
    tables = {path.stem for path in run.directory.glob("*.parquet")}
    assert tables <= TABLES.keys()
    assert {path.name for path in folder.iterdir()} == {
        f"{name}.csv" for name in tables | {"result"}
    }


def test_tables_are_in_si_units_with_all_digits(run: walkers.Run) -> None:
    folder = run.export("csv")
    assert folder == run.directory / "csv"
    written = pd.read_csv(folder / "trajectory.csv", dtype=str)
    table = run.table("trajectory")
    assert written.columns.tolist()[:4] == ["walker", "time (s)", "cycle", "x (m)"]
    assert [float(text) for text in written["velocity (m/s)"]] == table["velocity"].tolist()


def test_tables_are_in_the_units_of_printed_results(run: walkers.Run) -> None:
    folder = run.export("csv", units="mm")
    written = pd.read_csv(folder / "trajectory.csv")
    table = run.table("trajectory")
    assert (1e3 * table["x"]).tolist() == pytest.approx(written["x (mm)"].tolist())
    degrees = table["orientation"] * 57.29577951308232
    assert written["orientation (°)"].tolist() == pytest.approx(degrees.tolist())
    assert written["time (s)"].tolist() == table["time"].tolist()
    bridges = pd.read_csv(folder / "bridges.csv")
    forces = 1e6 * run.table("bridges")["normal_force"]
    assert bridges["normal_force (µN)"].tolist() == pytest.approx(forces.tolist())


@pytest.mark.parametrize(("units", "factor", "unit"), [("SI", 1.0, "m/s"), ("mm", 1e3, "mm/s")])
def test_the_numbers_of_the_result_have_rows(
    run: walkers.Run, units: str, factor: float, unit: str
) -> None:
    folder = run.export("csv", units=units)  # type: ignore[arg-type]
    rows = pd.read_csv(folder / "result.csv").set_index("number")
    velocity = rows.loc["velocity"]
    assert float(velocity["value"]) == pytest.approx(factor * run.result["velocity"], rel=1e-14)
    assert velocity["unit"] == unit
    assert velocity["meaning"]


def test_another_export_replaces_the_first_and_nothing_else(
    run: walkers.Run, tmp_path: Path
) -> None:
    folder = run.export("csv", tmp_path / "tables", units="mm")
    run.export("csv", folder)
    assert "x (m)" in pd.read_csv(folder / "trajectory.csv").columns
    (folder / "mine.csv").write_text("x\n")
    with pytest.raises(InputError, match=r"it holds mine\.csv"):
        run.export("csv", folder)
    assert (folder / "mine.csv").read_text() == "x\n"
    assert "x (m)" in pd.read_csv(folder / "trajectory.csv").columns


def test_an_export_leaves_no_folder_of_its_own_behind(run: walkers.Run) -> None:
    before = {path.name for path in run.directory.iterdir()}
    run.export("csv")
    assert {path.name for path in run.directory.iterdir()} == before | {"csv"}


def test_what_a_killed_export_left_behind_is_cleaned(run: walkers.Run) -> None:
    (run.directory / ".csv-killed" / "new").mkdir(parents=True)
    left = [removal.path for removal in unfinished_in(run.directory.parent)]
    assert left == [run.directory / ".csv-killed"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--format", "csv", "--every", "2"], "--every: is for --format vtk, lammps"),
        (["--format", "vtk", "--units", "mm"], "--units: is for --format csv"),
    ],
)
def test_options_of_other_exports_are_refused(
    run: walkers.Run, arguments: list[str], message: str
) -> None:
    done = call("export", str(run.directory), *arguments)
    assert done.returncode == 2
    assert done.stderr == f"walkers: {message}\n"
    assert not (run.directory / "csv").exists()


def test_units_that_do_not_exist_are_refused(run: walkers.Run) -> None:
    with pytest.raises(InputError, match="expected one of SI, mm"):
        run.export("csv", units="cm")  # type: ignore[arg-type]


@pytest.mark.parametrize("units", [[], ["--units", "mm"]], ids=["SI", "mm"])
def test_a_sweep_in_place_of_a_run_names_the_command_of_its_table(
    looked_through: Path, units: list[str]
) -> None:
    done = call("export", "grid", "--format", "csv", *units, "--runs", str(looked_through))
    assert done.returncode == 2
    assert "walkers list " in done.stderr
    with pytest.raises(InputError, match=r"its table is given by table\(\)"):
        walkers.load("grid", looked_through).export("csv")


def test_the_table_of_a_sweep_is_written_in_other_units(
    looked_through: Path, tmp_path: Path
) -> None:
    """The keys that vary keep the units of the sweep file."""
    path = tmp_path / "table.csv"
    command = ("list", "grid", "--runs", str(looked_through), "--to", str(path), "--units", "mm")
    call(*command, check=True)
    written = pd.read_csv(path)
    table = walkers.load("grid", looked_through).table()  # type: ignore[call-arg]
    velocity = (1e3 * table["velocity"]).tolist()
    assert written["velocity (mm/s)"].tolist() == pytest.approx(velocity)
    for key in table.attrs["varied"]:
        unit = table.attrs["units"][key]
        assert written[f"{key} ({unit})" if unit else key].tolist() == table[key].tolist()


def test_keys_that_vary_are_not_converted() -> None:
    """Whatever their unit is."""
    table = pd.DataFrame({"dimers.spacing": [0.5], "distance": [0.5]})
    table.attrs["units"] = {"dimers.spacing": "m", "distance": "m"}
    converted = in_units(table, "mm", ["dimers.spacing"])
    assert converted.to_dict("list") == {"dimers.spacing": [0.5], "distance": [500.0]}
    assert converted.attrs["units"] == {"dimers.spacing": "m", "distance": "mm"}
    assert table.attrs["units"]["distance"] == "m"


def test_units_of_a_list_need_a_file(looked_through: Path) -> None:
    done = call("list", "grid", "--units", "mm", "--runs", str(looked_through))
    assert done.stderr == "walkers: --units: is for --to\n"


# --- parquet ----------------------------------------------------------------------------------


def test_pandas_reads_the_units_and_labels_of_a_table(run: walkers.Run) -> None:
    frame = pd.read_parquet(run.directory / "trajectory.parquet")
    assert frame.attrs == run.table("trajectory").attrs
    assert frame.attrs["units"]["velocity"] == "m/s"
    assert frame.attrs["long_name"]["x"] == "x"


def test_pandas_reads_the_units_of_the_table_of_a_sweep(
    looked_through: Path, tmp_path: Path
) -> None:
    path = tmp_path / "table.parquet"
    call("list", "grid", "--runs", str(looked_through), "--to", str(path), check=True)
    attributes = pd.read_parquet(path).attrs
    assert attributes["units"]["velocity"] == "m/s"
    assert attributes["sweep"] == "grid"


def test_a_table_that_an_earlier_version_wrote_is_read(run: walkers.Run) -> None:
    """Units of its columns alone, none for pandas."""
    path = run.directory / "trajectory.parquet"
    expected = run.table("trajectory")
    table = pq.read_table(path)
    pq.write_table(table.replace_schema_metadata(None), path)
    assert pd.read_parquet(path).attrs == {}
    frame = read_table(run.directory, "trajectory")
    assert frame.attrs == expected.attrs
    pd.testing.assert_frame_equal(frame, expected)
