"""The readers of the engine's dumps, on what the engine wrote."""

import shutil
from collections.abc import Callable
from math import inf
from pathlib import Path

import numpy as np
import pytest

import walkers
from tests.conftest import SHORT, make_case
from walkers.inputs.loads import contact_loads, dimer_of
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import law_of
from walkers.postprocess import tabulate
from walkers.postprocess.dump import BinaryDump, DumpError, local_frames
from walkers.runner import finished_run
from walkers.runner.directory import FIRST_SEGMENT
from walkers.runner.manifest import FileChanged
from walkers.templates.layout import BEAD_COLUMNS, MEAN_SPIN_COLUMNS


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    return run_directory(dimers={"replicates": 2}, run=SHORT)


COLUMNS = (*BEAD_COLUMNS, *MEAN_SPIN_COLUMNS)


@pytest.fixture(scope="module")
def beads(directory: Path) -> Path:
    """The engine's dump of the beads."""
    return directory / FIRST_SEGMENT / "beads.bin"


def test_all_frames_are_read(directory: Path, beads: Path) -> None:
    run = finished_run(directory)
    assert run is not None
    dump = BinaryDump(beads, COLUMNS)
    assert len(dump) == run.layout.frames == 61
    assert not dump.truncated
    np.testing.assert_array_equal(np.diff(dump.steps), run.layout.sample_every)
    frames = dump.stack()
    assert frames.shape == (61, 4, len(COLUMNS))
    np.testing.assert_array_equal(frames[:, :, dump.column("id")], np.tile(np.arange(1, 5), (61, 1)))
    np.testing.assert_allclose(frames[0, :, dump.column("radius")], [3e-4, 2e-4, 3e-4, 2e-4], rtol=1e-15)
    assert beads.stat().st_size == run.layout.bead_dump_bytes


@pytest.mark.parametrize("cut", [1, 8, 200, 470, 550])  # of a frame of 704 bytes, 104 of them its head
def test_a_truncated_last_frame_is_left_out_and_told(beads: Path, tmp_path: Path, cut: int) -> None:
    whole = beads.read_bytes()
    short = tmp_path / "short.bin"
    short.write_bytes(whole[:-cut])
    dump = BinaryDump(short, COLUMNS)
    assert dump.truncated
    assert len(dump) == 60
    np.testing.assert_array_equal(dump.stack(), BinaryDump(beads, COLUMNS).stack()[:60])
    short.write_bytes(b"")
    empty = BinaryDump(short, COLUMNS)
    assert (len(empty), empty.truncated) == (0, False)


@pytest.mark.parametrize("contents", [b"no dump at all, but text that is long enough for a header" * 5, b"\xff" * 500])
def test_what_is_no_dump_or_has_other_columns_is_refused(contents: bytes, beads: Path, tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="2 columns"):
        BinaryDump(beads, ("id", "x"))
    (tmp_path / "other.bin").write_bytes(contents)
    with pytest.raises(DumpError, match=r"other\.bin"):
        BinaryDump(tmp_path / "other.bin", BEAD_COLUMNS)
    with pytest.raises(DumpError, match=r"other\.bin"):
        list(local_frames(tmp_path / "other.bin", ("x",)))


def test_bridges_of_a_walker_at_rest_carry_the_capillary_load(tmp_path: Path) -> None:
    """On a still substrate the elastic repulsion balances the capillary pull: no net normal force, all touching."""
    case = make_case(drive={"peak_acceleration": "0 g"}, run={"cycles": 4, "settling_cycles": 1})
    bridges = walkers.run(case, tmp_path).table("bridges")
    last = bridges[bridges["time"] == bridges["time"].max()]
    assert list(zip(last["contact"], last["touching"], strict=True)) == [(1, True), (2, True), (3, True)]
    weight = 9.81 * np.array([*dimer_of(case).masses, 0.0])
    loads = np.array(contact_loads(case).capillary)
    assert np.all(np.abs(last["normal_force"].to_numpy() + weight) < 0.02 * loads)


def test_an_open_bridge_pulls_with_the_capillary_force(tmp_path: Path) -> None:
    """Shaken vertically beyond what bridges hold, contacts open: the force is the law's at the gap."""
    case = make_case(
        drive={"axis": "z", "peak_acceleration": "20 g"},
        liquid={"dynamic_viscosity": "1e-9 mPa*s"},
        run={"cycles": 10, "settling_cycles": 2, "bridge_samples_per_cycle": 20},
    )
    bridges = walkers.run(case, tmp_path).table("bridges")
    # Until the beads first part, 5 ms on: then their bridge's liquid is shared out anew and the volumes change.
    opened = bridges[~bridges["touching"] & (bridges["time"] < 5e-3)]
    assert set(opened["contact"]) >= {1, 3}  # a bead on the substrate and bead on bead
    large, small = case.walkers[0].radii
    ends = {1: (large, inf), 2: (small, inf), 3: (small, large)}
    for contact, gap, found in opened[["contact", "gap", "normal_force"]].itertuples(index=False):
        surfaces = Surfaces.of(*ends[contact], case.liquid, case.contact.minimum_separation_ratio)
        curve = law_of(case.liquid)(surfaces)
        assert gap < curve.rupture
        assert found == pytest.approx(curve.forces(np.array([gap])).pull[0], rel=1e-6)


def test_truncated_dumps_are_tabulated_with_a_warning(directory: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(directory, copy)
    dump = copy / FIRST_SEGMENT / "beads.bin"
    dump.write_bytes(dump.read_bytes()[:-100])
    with pytest.raises(FileChanged, match=r"beads\.bin is not what it was"):
        tabulate(copy)
    (copy / "manifest.json").unlink()  # of a run that is not finished it is no damage
    result = tabulate(copy)
    assert result["truncated"]
    assert result["velocity"]["mean"] > 0
