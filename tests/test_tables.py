"""Tables of runs: their columns, units and labels, and the arrays that are written."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from walkers.errors import InputError
from walkers.inputs.reading import load_case
from walkers.postprocess.quantities import TABLES, axis, declared
from walkers.postprocess.tables import read_columns, read_table, write_table


def test_each_file_has_what_is_declared(run_directory: Callable[..., Path], pile_run: Path) -> None:
    """Of six dimers, of dimers that may meet, and of a pile."""
    meeting = {"replicates": 4, "spacing": "1.6 mm", "meet": True}
    tray = run_directory(dimers=meeting, run={"cycles": 4, "settling_cycles": 1})
    runs = (run_directory(load_case("fig1b")), tray, pile_run)
    files = {path.stem: path for run in runs for path in run.glob("*.parquet")}
    assert files.keys() == TABLES.keys()
    for name, path in files.items():
        schema, known = pq.read_schema(path), TABLES[name]
        places = [next(place for place, one in enumerate(known) if one.names(column)) for column in schema.names]
        assert places == sorted(places)
        assert set(places) == set(range(len(known)))
        for field in schema:
            quantity = declared(field.name, known)
            unit, label = quantity.si_unit.encode(), quantity.label.encode()
            expected = {b"unit": unit, b"units": unit, b"long_name": label, b"meaning": quantity.meaning.encode()}
            assert field.metadata == expected
            assert "*" not in quantity.label
        attributes = read_table(path.parent, name).attrs
        assert attributes["units"].keys() == attributes["long_name"].keys() == set(schema.names)
    # Columns of dimers are of two beads and a pair; of a walker there are rows of 20 samples and 3 bridges a cycle.
    table = read_table(runs[0], "trajectory")
    assert [name for name in table if name.startswith("sliding")] == ["sliding_1", "sliding_2", "sliding_pair_1"]
    cycles = table["cycle"].max()
    assert len(table) == pytest.approx(6 * (20 * cycles + 1))
    assert len(read_table(runs[0], "bridges")) == pytest.approx(6 * 3 * (cycles + 1))


def test_labels_of_axes_have_the_displayed_unit() -> None:
    assert axis("members", "height") == ("height (mm)", 1e3)
    assert axis("walkers", "open_2") == ("bead 2 off its wall (%)", 100.0)
    assert axis("trajectory", "sliding_pair_3") == ("sliding of pair 3 of beads (mm/s)", 1e3)
    assert axis("clusters", "size") == ("beads", 1.0)
    for name in ("rotation", "rotation_", "rotation_x", "gap_1_2", "speed"):
        with pytest.raises(KeyError):
            declared(name, TABLES["trajectory"])


@pytest.mark.parametrize("rows", [0, 1, 9])
def test_a_table_is_read_as_it_was_written(tmp_path: Path, rows: int) -> None:
    draw = np.random.default_rng(rows)
    columns = {
        "time": draw.random(rows),
        "event": draw.choice(["merged", "parted"], rows),
        "walker": draw.integers(0, 9, rows),
        "other": draw.integers(0, 9, rows),
        "size": np.arange(2 * rows)[::2],
        "angle": np.where(draw.random(rows) < 0.5, np.nan, 1.0),
    }
    write_table(tmp_path, "meetings", columns)
    for name, column in read_columns(tmp_path, "meetings").items():
        np.testing.assert_array_equal(column, columns[name])
    assert pq.ParquetFile(tmp_path / "meetings.parquet").metadata.row_group(0).column(0).compression == "ZSTD"
    for wrong in (columns | {"power": np.arange(3.0)}, {"time": np.arange(3.0)}):
        with pytest.raises(KeyError, match="missing or not declared"):
            write_table(tmp_path, "meetings", wrong)
    with pytest.raises(InputError, match="has no table bed; it has meetings"):
        read_columns(tmp_path, "bed")
    path = tmp_path / "meetings.parquet"
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(InputError, match=r"meetings\.parquet: cannot be read .* measures the run again"):
        read_table(tmp_path, "meetings")
