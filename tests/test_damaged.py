"""Harm: damaged runs, full disks, streams that nobody reads, texts and paths that look like code.

A command that meets any of them says so in one line.
"""

import errno
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import tracemalloc
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

import walkers
from tests.conftest import (
    PATIENCE,
    PROGRAM,
    SHORT,
    brief_pile,
    call,
    document,
    fill,
    make_case,
    mounted,
    to_toml,
)
from walkers import run as run_case
from walkers.archive.writing import write_archive
from walkers.errors import InputError
from walkers.files import read_json, write_json
from walkers.inputs.case_building import build_case
from walkers.inputs.reading import load_case
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure import large_arrays, piles
from walkers.postprocess.measure.dump import BinaryDump, DumpError, local_frames
from walkers.postprocess.measure.motion import Motion, read_motion
from walkers.postprocess.measure.results import measure, read_results
from walkers.postprocess.show.paraview import write_vtk
from walkers.postprocess.show.report.run import result_html
from walkers.runner.failures import DiskFull, RunBusy
from walkers.runner.launch import launch
from walkers.runner.run_directory import (
    CASE_NAME,
    FIRST_SEGMENT,
    case_of,
    locked,
    recomputed,
    write_errors_as_failures,
)
from walkers.sweeps.table import load_table
from walkers.templates.deck import Deck, render_deck
from walkers.templates.layout import BEAD_COLUMNS, MEAN_SPIN_COLUMNS
from walkers.text import environment

Once = Callable[[str, Callable[[Path], object]], Path]
TWO_ANGLES = 'case = "short.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
SEGMENTS = {**SHORT, "time_step": "2 us", "segment": "25 ms"}
"""Of a run in three segments."""


def _write_short_files(folder: Path) -> Path:
    """Write a case and a sweep of two points; return the case file."""
    (folder / "sweep.toml").write_text(TWO_ANGLES)
    case_file = folder / "short.toml"
    case_file.write_text(to_toml({"title": "price: 5$ and 3$", **document(run=SHORT)}))
    return case_file


@pytest.fixture
def short_case(in_folder: Path) -> Path:
    """A case file in the current folder, beside a sweep of it."""
    return _write_short_files(in_folder)


@pytest.fixture
def parts(in_folder: Path, once: Once) -> Path:
    """A copy of a run of three segments, to be damaged."""

    def make(folder: Path) -> None:
        (folder / "short.toml").write_text(to_toml(document(run=SEGMENTS)))
        call("run", "short.toml", check=True, folder=folder)

    shutil.copytree(once("short-run", make), in_folder, dirs_exist_ok=True)
    (run,) = Path("runs").glob("short-*")
    return run


def _own_lines(text: str) -> list[str]:
    """Lines that the program writes, without the warning that this engine was never audited."""
    return [line for line in text.splitlines() if "never audited" not in line]


# --- damaged runs ---------------------------------------------------------------------------------


DamageFunction = Callable[[Path], object]


def _edited(name: str, change: Callable[[dict[str, Any]], object]) -> DamageFunction:
    """A change of a JSON file of a run."""

    def edit(run: Path) -> None:
        contents = json.loads((run / name).read_text())
        change(contents)
        (run / name).write_text(json.dumps(contents))

    return edit


def _removed(name: str) -> DamageFunction:
    """The removal of a file or folder of a run."""

    def remove(run: Path) -> None:
        if (run / name).is_dir():
            shutil.rmtree(run / name)
        else:
            (run / name).unlink()

    return remove


def _cut_to(name: str, size: int) -> DamageFunction:
    """A file of a run that keeps its first bytes alone."""
    return lambda run: os.truncate(run / name, size)


def _cut_by(name: str, size: int) -> DamageFunction:
    """A file of a run that has lost its last bytes."""
    return lambda run: os.truncate(run / name, (run / name).stat().st_size - size)


def _written_over(name: str, end: bytes) -> DamageFunction:
    """Other bytes at the end of a file, as a disk could write them."""
    return lambda run: (run / name).write_bytes((run / name).read_bytes()[: -len(end)] + end)


def _unmeasured(damage: DamageFunction) -> DamageFunction:
    """Damage of a run whose result is gone, too, so that it is made of what is damaged."""

    def damage_and_remove(run: Path) -> None:
        damage(run)
        (run / "result.json").unlink()

    return damage_and_remove


@dataclass(frozen=True)
class Damage:
    """What is done to a run.

    Attributes
    ----------
    apply
        Does it to a run directory.
    parts
        Parts of the run that cannot be read then, by the names of `READERS`.
    message
        A pattern of what is said.
    """

    apply: DamageFunction
    parts: set[str]
    message: str


READERS: dict[str, set[str]] = {
    "run short.toml": {"case"},
    "run {run}": {"case"},
    "plot {run}": {"case", "result", "tables"},
    "report {run} --to out.html": {"case", "result", "tables", "beads", "bridges"},
    "export {run} --format vtk -o vtk": {"case", "result", "beads", "bridges"},
    "export {run} --format lammps -o out.lammpstrj": {"case", "result", "beads"},
    "export {run} --format archive -o out.zip": {"case", "result", "tables", "beads", "bridges"},
    "compare {run} {run}": {"case", "result"},
}
"""Commands that are given a run, and which parts of it they read."""
READERS_OF_CASE_FILES = ["compare short.toml fig1b", "show short.toml --theory"]
"""Commands that ask for the numbers of a run if there is one."""
SECOND = "segments/0001"
DAMAGES: dict[str, Damage] = {
    "an edited case": Damage(
        _edited("case.json", lambda case: case["drive"].update(frequency=81.0)),
        {"case"},
        "has changed",
    ),
    "no case": Damage(_removed("case.json"), {"case"}, "case.json"),
    "a manifest that was cut": Damage(_cut_to("manifest.json", 100), {"case"}, "manifest.json"),
    "a result that was cut": Damage(
        _cut_to("result.json", 100), {"result"}, "its result.json cannot be read"
    ),
    "a table that was cut": Damage(
        _cut_to("trajectory.parquet", 100), {"tables"}, "trajectory.parquet"
    ),
    "a layout that was cut": Damage(
        _cut_to(f"{SECOND}/layout.json", 100), {"beads"}, "layout.json"
    ),
    "a missing segment": Damage(_removed(SECOND), {"beads"}, "segment|0001"),
    "a dump that was cut": Damage(
        _cut_to(f"{SECOND}/beads.bin", 1000), {"beads"}, "beads.bin|dump is incomplete"
    ),
    "no number in a dump": Damage(
        _written_over(f"{SECOND}/beads.bin", struct.pack("=d", np.nan)),
        {"beads"},
        "is not a number at step .*: the dump was damaged after|has changed",
    ),
    "a text that was cut": Damage(
        _cut_by(f"{SECOND}/bridges.walls.txt", 200), {"bridges"}, "bridges.walls.txt"
    ),
    "a dump to be measured": Damage(
        _unmeasured(_written_over(f"{SECOND}/beads.bin", b"\xff" * 64)),
        {"case", "result"},
        "beads.bin has changed|has no result.json",
    ),
}


def _damages_and_their_readers() -> list[Any]:
    """Each damage with each command that reads what is damaged."""
    parameters = []
    for name, damage in DAMAGES.items():
        for command, read_parts in READERS.items():
            if damage.parts & read_parts:
                parameters.append(pytest.param(damage, command, id=f"{name}: {command}"))
    return parameters


def _contents(folder: Path) -> dict[Path, bytes]:
    """Contents of all files of a folder but locks."""
    contents = {}
    for path in folder.rglob("*"):
        if path.is_file() and path.suffix != ".lock":
            contents[path] = path.read_bytes()
    return contents


@pytest.mark.parametrize(("damage", "command"), _damages_and_their_readers())
def test_a_damaged_run_is_reported_in_a_line_by_all_that_read_what_is_damaged(
    damage: Damage, command: str, parts: Path
) -> None:
    """And nothing on disk is lost."""
    damage.apply(parts)
    before = _contents(parts)
    done = call(*command.format(run=parts).split())
    assert "Traceback" not in done.stderr
    assert done.returncode in (1, 2)
    (line,) = _own_lines(done.stderr)
    assert str(parts) in line
    assert re.search(damage.message, line)
    assert _contents(parts).items() >= before.items()


@pytest.mark.parametrize("command", READERS_OF_CASE_FILES)
@pytest.mark.parametrize(
    "name", ["an edited case", "no case", "a manifest that was cut", "a result that was cut"]
)
def test_a_damaged_run_does_not_matter_to_commands_that_need_its_case_file_alone(
    name: str, command: str, parts: Path
) -> None:
    DAMAGES[name].apply(parts)
    before = _contents(parts)
    done = call(*command.split())
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert _own_lines(done.stderr) == []
    assert _contents(parts).items() >= before.items()


@pytest.mark.parametrize("name", ["a result that was cut", "a table that was cut"])
def test_a_damaged_result_or_table_is_made_anew_from_the_dumps(name: str, parts: Path) -> None:
    """By `run`; then the run can be archived again."""
    DAMAGES[name].apply(parts)
    call("run", str(parts), check=True)
    call("export", "--format", "archive", str(parts), "-o", "out.zip", check=True)


@dataclass(frozen=True)
class DamagedSweep:
    """A sweep ``runs/sweep`` of two points, of which the run of the first is damaged.

    Attributes
    ----------
    runs
        Names of the runs in its table before.
    status
        The status of the first point now.
    """

    runs: list[str]
    status: str

    @property
    def summary(self) -> str:
        """The line about its points."""
        if self.status == "finished":
            return "2 points, 2 finished\n"
        return "2 points, 1 finished, 1 failed\n"


@pytest.fixture(
    params=[
        # The table of a sweep is of results alone.
        pytest.param(("a manifest that was cut", "finished"), id="manifest"),
        pytest.param(("a dump to be measured", "failed"), id="dump"),
    ]
)
def damaged_sweep(request: pytest.FixtureRequest, in_folder: Path, once: Once) -> DamagedSweep:
    """A sweep in the current folder, once with a damaged manifest and once with a damaged dump."""

    def make(folder: Path) -> None:
        (folder / "short.toml").write_text(to_toml(document(run=SEGMENTS)))
        (folder / "sweep.toml").write_text(TWO_ANGLES)
        call("sweep", "sweep.toml", check=True, folder=folder)

    name, status = request.param
    shutil.copytree(once("sweep-of-segments", make), in_folder, dirs_exist_ok=True)
    runs = list(load_table("runs/sweep")["run"])
    DAMAGES[name].apply(Path(runs[0]))
    return DamagedSweep(runs, status)


def test_the_table_of_a_sweep_has_the_status_of_a_damaged_run(damaged_sweep: DamagedSweep) -> None:
    table = load_table("runs/sweep")
    assert list(table["status"]) == [damaged_sweep.status, "finished"]
    assert list(table["run"]) == damaged_sweep.runs
    assert walkers.load("runs/sweep").status == damaged_sweep.status


def test_a_listed_sweep_counts_a_damaged_run(damaged_sweep: DamagedSweep) -> None:
    done = call("list", "runs/sweep", check=True)
    assert damaged_sweep.summary in done.stdout + done.stderr


def test_a_plotted_sweep_leaves_out_a_damaged_run(damaged_sweep: DamagedSweep) -> None:
    done = call("plot", "runs/sweep", check=True)
    is_left_out = "1 of 2 points left out: 1 failed" in done.stdout + done.stderr
    assert is_left_out == (damaged_sweep.status == "failed")


def test_all_runs_are_listed_beside_a_damaged_run(damaged_sweep: DamagedSweep) -> None:
    call("list", "--all", check=True)


def test_a_sweep_goes_on_without_a_damaged_run_and_says_which(damaged_sweep: DamagedSweep) -> None:
    """A failed point is named where it fails and in the list at the end."""
    done = call("sweep", "sweep.toml")
    output = done.stdout + done.stderr
    is_failed = damaged_sweep.status == "failed"
    assert "Traceback" not in output
    assert done.returncode == int(is_failed)
    assert damaged_sweep.summary in output
    assert output.count("point 0") == 2 * int(is_failed)


def test_a_result_whose_making_was_killed_is_made_anew(parts: Path) -> None:
    """Between the table that is new and the manifest that does not yet say so."""
    names = ["result.json", "walkers.parquet", "trajectory.parquet"]
    expected = read_results(parts).as_dict()
    falsify = _edited("result.json", lambda result: result["numbers"].update(velocity=99.0))
    with suppress(KeyboardInterrupt), recomputed(parts, names):
        falsify(parts)
        raise KeyboardInterrupt
    assert walkers.run(parts).result.as_dict() == expected
    assert json.loads((parts / "manifest.json").read_text())["sha256"].keys() >= set(names)


def test_a_run_is_measured_by_one_process_at_a_time(parts: Path) -> None:
    before = (parts / "manifest.json").read_bytes()
    with locked([parts]), pytest.raises(RunBusy, match="measuring"):
        measure(parts)
    assert (parts / "manifest.json").read_bytes() == before


# --- damaged dumps --------------------------------------------------------------------------------


BEAD_DUMP_COLUMNS = (*BEAD_COLUMNS, *MEAN_SPIN_COLUMNS)


@pytest.fixture
def segment(run_directory: Callable[..., Path]) -> Path:
    """A segment with dumps of two walkers of two beads each."""
    return run_directory(dimers={"replicates": 2}, run=SHORT) / FIRST_SEGMENT


def test_a_dump_of_beads_has_a_row_for_each_bead_and_frame(segment: Path) -> None:
    """6 cycles of 10 samples and the start; radii in m."""
    dump = BinaryDump(segment / "beads.bin", BEAD_DUMP_COLUMNS)
    frames = dump.stack()
    assert frames.shape == (61, 4, len(BEAD_DUMP_COLUMNS))
    radii = frames[0, :, dump.columns.index("radius")]
    np.testing.assert_allclose(radii, [3e-4, 2e-4, 3e-4, 2e-4], rtol=1e-15)


@pytest.mark.parametrize("lost", [1, 200, 550])
def test_a_dump_of_beads_is_read_but_for_a_last_frame_that_was_cut(
    lost: int, segment: Path, tmp_path: Path
) -> None:
    """Bytes that are lost of a frame of 704, of which 104 are its head."""
    frames = BinaryDump(segment / "beads.bin", BEAD_DUMP_COLUMNS).stack()
    short = tmp_path / "short"
    short.write_bytes((segment / "beads.bin").read_bytes()[:-lost])
    assert BinaryDump(short, BEAD_DUMP_COLUMNS).truncated
    np.testing.assert_array_equal(BinaryDump(short, BEAD_DUMP_COLUMNS).stack(), frames[:60])


def test_a_dump_of_beads_with_an_infinite_number_is_refused(segment: Path, tmp_path: Path) -> None:
    infinite = tmp_path / "infinite"
    contents = (segment / "beads.bin").read_bytes()
    infinite.write_bytes(contents[:-8] + struct.pack("=d", np.inf))
    with pytest.raises(DumpError, match="is not a number at step"):
        BinaryDump(infinite, BEAD_DUMP_COLUMNS).stack()


@pytest.fixture(
    params=[
        pytest.param(b"no dump at all, but text that is long enough for a header" * 5, id="text"),
        pytest.param(b"\xff" * 500, id="bytes"),
    ]
)
def nonsense(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A file that is no dump."""
    path = tmp_path / "nonsense"
    path.write_bytes(request.param)
    return path


def test_nonsense_is_no_dump_of_beads(nonsense: Path) -> None:
    with pytest.raises(DumpError, match="nonsense"):
        BinaryDump(nonsense, BEAD_COLUMNS)


def test_nonsense_is_no_local_dump(nonsense: Path) -> None:
    with pytest.raises(DumpError, match="nonsense"):
        list(local_frames(nonsense, ("x",)))


def test_motion_takes_little_more_memory_than_its_arrays(
    run_directory: Callable[..., Path],
) -> None:
    """Position, velocity and two spins: 4 · 3 · 8 = 96 bytes a bead and frame; copies double it."""
    directory = run_directory(dimers={"replicates": 40}, run={**SHORT, "samples_per_cycle": 20})
    read_motion(directory)  # what is imported and kept takes memory once
    tracemalloc.start()
    motion = read_motion(directory)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    frames, beads, _ = motion.position.shape
    assert motion.mean_spin is not None
    assert 96.0 <= peak / (frames * beads) < 130.0


@pytest.fixture
def large_motion(pile_run: Path, monkeypatch: pytest.MonkeyPatch) -> Motion:
    """The motion of a pile whose arrays are all on the disk."""
    monkeypatch.setattr(large_arrays, "LARGEST_IN_MEMORY", 0)
    return read_motion(pile_run)


def test_a_motion_on_the_disk_takes_no_memory(
    run_directory: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the motion above, which takes 96 bytes a bead and frame."""
    directory = run_directory(dimers={"replicates": 40}, run={**SHORT, "samples_per_cycle": 20})
    monkeypatch.setattr(large_arrays, "LARGEST_IN_MEMORY", 0)
    read_motion(directory)  # what is imported and kept takes memory once
    tracemalloc.start()
    motion = read_motion(directory)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    frames, beads, _ = motion.position.shape
    assert peak / (frames * beads) < 20.0


def test_a_motion_on_the_disk_is_that_in_memory(pile_run: Path, large_motion: Motion) -> None:
    motion = read_motion(pile_run)
    np.testing.assert_array_equal(large_motion.position, motion.position)
    np.testing.assert_array_equal(large_motion.velocity, motion.velocity)
    np.testing.assert_array_equal(large_motion.spin, motion.spin)


def test_a_pile_on_the_disk_has_the_same_numbers(pile_run: Path, large_motion: Motion) -> None:
    assert piles.measure(large_motion).numbers == pytest.approx(
        piles.measure(read_motion(pile_run)).numbers, rel=0.0, abs=0.0, nan_ok=True
    )


def test_a_motion_on_the_disk_leaves_no_file(pile_run: Path, large_motion: Motion) -> None:
    names = {path.name for path in pile_run.iterdir()}
    del large_motion
    assert {path.name for path in pile_run.iterdir()} == names
    assert not any(name.startswith("tmp") for name in names)


def test_a_motion_that_no_disk_can_hold_says_how_much_it_needs(tmp_path: Path) -> None:
    """240 TB: more than a file may have."""
    with pytest.raises(DumpError, match=r"needs 2\.4e\+05 GB on its disk"):
        large_arrays.empty_array((100_000, 100_000_000, 3), tmp_path)


LIMITED = """
import resource
import signal
import sys
from pathlib import Path

from walkers.postprocess.measure import large_arrays
from walkers.postprocess.measure.dump import DumpError

large_arrays.LARGEST_IN_MEMORY = 0
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
limit = int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    print(large_arrays.empty_array((1000, 3), Path(sys.argv[1])).shape)
except DumpError as error:
    print(error)
"""
"""A program that makes an array of 24,000 bytes in a folder where files have a largest size."""


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        pytest.param(4_000, r"needs 2\.4e-05 GB on its disk .*\(File too large\)", id="a sixth"),
        pytest.param(
            23_999, r"needs 2\.4e-05 GB on its disk .*\(File too large\)", id="a byte less"
        ),
        pytest.param(24_000, r"^\(1000, 3\)$", id="all of it"),
    ],
)
def test_an_array_on_the_disk_takes_all_of_its_space_at_once(
    limit: int, expected: str, tmp_path: Path
) -> None:
    """Of each number all 8 bytes, not one."""
    command = [sys.executable, "-c", LIMITED, str(tmp_path), str(limit)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert re.search(expected, done.stdout.strip())


@pytest.fixture
def read_only(tmp_path: Path) -> Iterator[Path]:
    """A folder in which nobody can write, not even root."""
    with mounted(tmp_path / "archive", "256k") as place:
        subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)
        yield place


def test_an_array_of_a_read_only_run_is_in_the_folder_for_temporary_files(
    read_only: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(large_arrays, "LARGEST_IN_MEMORY", 0)
    array = large_arrays.empty_array((1000, 3), read_only)
    array[:] = 7.0
    assert array.sum() == 21_000.0
    place = re.escape(tempfile.gettempdir())
    with pytest.raises(DumpError, match=rf"^{place}: the motion .* needs 2\.4e\+05 GB"):
        large_arrays.empty_array((100_000, 100_000_000, 3), read_only)


@dataclass(frozen=True)
class LocalDump:
    """A copy of the dump of bridges between beads: its path, columns and contents."""

    path: Path
    columns: tuple[str, ...]
    contents: bytes

    def assert_refused_with(self, contents: bytes) -> None:
        """Reading other contents fails and names the file."""
        self.path.write_bytes(contents)
        with pytest.raises(DumpError, match=r"bridges\.pairs\.txt"):
            list(local_frames(self.path, self.columns))


@pytest.fixture
def local_dump(segment: Path, tmp_path: Path) -> LocalDump:
    path = Path(shutil.copy(segment / "bridges.pairs.txt", tmp_path))
    columns = json.loads((segment / "layout.json").read_text())["pair_bridge_columns"]
    return LocalDump(path, tuple(columns), path.read_bytes())


def test_a_local_dump_has_a_row_for_each_bridge_and_frame(local_dump: LocalDump) -> None:
    """Two walkers with a bridge each, at 6 cycles and the start."""
    rows = 0
    for _, frame in local_frames(local_dump.path, local_dump.columns):
        rows += len(frame)
    assert rows == 2 * 7


def test_a_local_dump_that_was_cut_is_refused(local_dump: LocalDump) -> None:
    """In the header of its last frame, in its rows, or before the last line break."""
    contents = local_dump.contents
    last_frame = contents.rindex(b"ITEM: TIMESTEP")
    for end in (*range(last_frame + 1, len(contents), 7), len(contents) - 1):
        local_dump.assert_refused_with(contents[:end])


@pytest.mark.parametrize("word", [b"nan", b"inf", b"x", b"1 2", b""])
def test_a_local_dump_with_a_row_that_is_no_numbers_is_refused(
    word: bytes, local_dump: LocalDump
) -> None:
    """The first row follows nine lines of header."""
    lines = local_dump.contents.split(b"\n")
    words = lines[9].split()
    lines[9] = b" ".join([word, *words[1:]])
    local_dump.assert_refused_with(b"\n".join(lines))


# --- files that are no files ----------------------------------------------------------------------


@contextmanager
def _at_most(seconds: int) -> Iterator[None]:
    """Raise `TimeoutError` in what takes longer, also if it waits for a file."""

    def stop(_number: int, _frame: object) -> NoReturn:
        raise TimeoutError(f"took more than {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


READ_FILES = [
    "case.json",
    "manifest.json",
    "result.json",
    "trajectory.parquet",
    "segments/0001/layout.json",
    "segments/0001/segment.json",
    "segments/0001/beads.bin",
    "segments/0001/bridges.pairs.txt",
]
WAYS_TO_READ = [
    "show {run}",
    "compare {run} {run}",
    "plot {run}",
    "export {run} --format lammps -o out.lammpstrj",
    "export {run} --format vtk -o vtk",
    "export {run} --format archive -o out.zip",
    "run {run}",
]


@pytest.fixture(params=READ_FILES)
def with_fifo(request: pytest.FixtureRequest, parts: Path) -> Path:
    """A run with a FIFO in place of one of its files: whoever opens it waits for a writer."""
    (parts / request.param).unlink()
    os.mkfifo(parts / request.param)
    return parts


@pytest.mark.parametrize("command", WAYS_TO_READ)
def test_no_command_waits_for_a_fifo_in_place_of_a_file(command: str, with_fifo: Path) -> None:
    with _at_most(60):
        done = call(*command.format(run=with_fifo).split())
    assert "Traceback" not in done.stderr
    assert done.returncode in (0, 1, 2)


def test_the_check_refuses_a_fifo_in_place_of_a_file(with_fifo: Path) -> None:
    with _at_most(60):
        done = call("check", "files", str(with_fifo))
    assert "Traceback" not in done.stderr
    assert done.returncode in (1, 2)


def test_a_run_with_a_fifo_in_place_of_a_file_is_listed(with_fifo: Path) -> None:
    with _at_most(60):
        done = call("list", check=True)
    assert "1 run" in done.stdout
    assert "Traceback" not in done.stderr


def _make_socket(path: Path) -> None:
    """By its name in the current folder: the path of a socket must be short."""
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind(path.name)


def _link_to_a_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(os.mkfifo, id="fifo"),
        pytest.param(_make_socket, id="socket"),
        pytest.param(_link_to_a_device, id="device"),
        pytest.param(Path.mkdir, id="folder"),
    ],
)
def test_only_regular_files_are_opened(make: Callable[[Path], object], in_folder: Path) -> None:
    path = in_folder / "file.json"
    make(path)
    message = r"(not a regular file|Is a directory): .*file\.json"
    with _at_most(60), pytest.raises(OSError, match=message):
        read_json(path)


def test_a_fifo_in_place_of_a_lock_is_no_lock(parts: Path) -> None:
    os.mkfifo(parts.with_name(f"{parts.name}.lock"))
    with _at_most(60):
        assert call("list", check=True).stdout.count(parts.name) == 1


def test_a_device_is_no_case_file() -> None:
    with pytest.raises(InputError, match="is a pipe, a socket or a device; expected a file"):
        read_toml(Path("/dev/zero"))


def test_a_fifo_is_no_case_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo.toml")
    with pytest.raises(InputError, match="is a pipe, a socket or a device; expected a file"):
        read_toml(tmp_path / "fifo.toml")


def test_a_case_file_of_17_megabytes_is_refused(tmp_path: Path) -> None:
    (tmp_path / "large.toml").write_text(f'title = "{"x" * (17 << 20)}"\n')
    with pytest.raises(InputError, match="expected a file of at most 16 MB"):
        read_toml(tmp_path / "large.toml")


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    """Editors of Windows begin files with it."""
    (tmp_path / "windows.toml").write_text(to_toml(document()), encoding="utf-8-sig")
    assert load_case(tmp_path / "windows.toml") == make_case().with_values(name="windows")


# --- limits of the system and full disks ----------------------------------------------------------


def _program(
    command: list[str], environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """What a process does, with further variables of the environment."""
    return subprocess.run(
        command,
        env={**os.environ, **(environment or {})},
        capture_output=True,
        text=True,
        check=False,
    )


NO_LOCKS = "#include <errno.h>\nint flock(int file, int operation) { errno = ENOLCK; return -1; }\n"


def _built(source: str, folder: Path) -> str:
    """A library that replaces functions of the system, for ``LD_PRELOAD``."""
    library = folder / "shim.so"
    command = ["g++", "-shared", "-fPIC", "-x", "c", "-", "-o", str(library)]
    subprocess.run(command, input=source, text=True, check=True)
    return str(library)


def test_a_file_system_without_locks_is_named_with_advice(short_case: Path, tmp_path: Path) -> None:
    library = _built(NO_LOCKS, tmp_path)
    done = _program([PROGRAM, "run", "short.toml"], {"LD_PRELOAD": library})
    assert done.returncode == 2
    (line,) = (line for line in _own_lines(done.stderr) if "ERROR: ld.so" not in line)
    assert re.search(
        r"^walkers: runs: files cannot be locked \(No locks available\): .*--runs", line
    )


@pytest.mark.parametrize(
    ("blocks", "limit"),
    [
        pytest.param(20, "20.48 kB", id="the deck"),
        pytest.param(600, "614.4 kB", id="the engine"),
    ],
)
def test_a_limit_of_the_size_of_files_is_named_with_advice(
    blocks: int, limit: str, short_case: Path
) -> None:
    """In blocks of 1024 bytes; the first limit stops the deck, the second one the engine."""
    samples = "--set run.samples_per_cycle=250 --set run.cycles=40"
    script = f"ulimit -f {blocks}; exec {PROGRAM} run short.toml {samples}"
    # Python does not notice that byte code which it writes was cut.
    done = _program(["bash", "-c", script], {"PYTHONDONTWRITEBYTECODE": "1"})
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    last_line = done.stderr.splitlines()[-1]
    assert re.search(rf"limit of {limit} \(ulimit -f\): .*\(see runs/short-", last_line)


@pytest.mark.parametrize("command", ["run short.toml", "sweep sweep.toml"])
def test_a_folder_that_cannot_be_made_is_named(command: str, short_case: Path) -> None:
    done = call(*command.split(), "--out", "/proc/runs")
    assert done.returncode == 2
    assert "/proc/runs" in done.stderr
    assert "cannot create the folder" in done.stderr


@pytest.fixture
def finished_sweep(in_folder: Path, once: Once) -> Path:
    """The run of a point of a finished sweep ``runs/sweep`` in the current folder."""

    def make(folder: Path) -> None:
        _write_short_files(folder)
        call("sweep", "sweep.toml", check=True, folder=folder)

    shutil.copytree(once("short-sweep", make), in_folder, dirs_exist_ok=True)
    (run, _) = Path("runs").glob("short-*")
    return run


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("run short.toml --out {disk}/a", 1),
        ("sweep sweep.toml --out {disk}/c", 2),
        ("plot runs/sweep --to {disk}/d.png", 2),
        ("export --format vtk {run} -o {disk}/e", 2),
        ("export --format deck {run} -o {disk}/deck", 2),
        ("render {run} --images 1 --to {disk}/f.png", 2),
        ("list runs/sweep --to {disk}/g.csv", 2),
    ],
)
def test_a_full_disk_is_reported_in_a_line_and_nothing_half_written_stays(
    command: str, status: int, finished_sweep: Path, tmp_path: Path
) -> None:
    with mounted(tmp_path / "disk", "256k") as disk:
        ballast = fill(disk)
        done = call(*command.format(disk=disk, run=finished_sweep).split())
        paths = list(disk.rglob("*"))
        written = [path for path in paths if path.is_file() and path.stat().st_size]
    assert done.returncode == status
    (line,) = _own_lines(done.stderr)
    assert str(disk) in line
    assert re.search("No space left on device|disk full", line)
    assert written == [ballast]
    for path in paths:
        assert path.suffix != ".lock"
        assert ".new" not in path.name
        assert path.name != "deck"


def test_a_case_file_that_cannot_be_written_is_not_left_behind(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "256k") as disk:
        ballast = fill(disk)
        done = call("new", str(disk / "x"))
        assert done.returncode == 2
        assert "No space left on device" in done.stderr
        assert list(disk.iterdir()) == [ballast]
        ballast.unlink()
        call("new", str(disk / "x"), check=True)


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(errno.ENOSPC, id="no space left"),
        pytest.param(errno.EDQUOT, id="quota exceeded"),
    ],
)
def test_a_run_that_cannot_be_written_for_want_of_space_fails_by_a_full_disk(
    number: int, tmp_path: Path
) -> None:
    """6 MB are needed; how many are free depends on the disk."""
    run = tmp_path / "run.incomplete"
    with (
        pytest.raises(DiskFull, match=rf"disk full: 6 MB are .* are free \(see {run}\)"),
        write_errors_as_failures(run, needed=6_000_000),
    ):
        raise OSError(number, os.strerror(number), str(run / "beads.bin"))


@pytest.fixture
def small_tmpdir(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of 2 MB for temporary files."""
    with mounted(tmp_path / "tmp", "2m") as place:
        monkeypatch.setenv("TMPDIR", str(place))
        yield place


def test_a_run_of_one_process_needs_no_room_for_temporary_files(
    small_tmpdir: Path, tmp_path: Path
) -> None:
    assert not run_case(make_case(run=SHORT), tmp_path / "runs").cached


def test_mpirun_needs_room_for_temporary_files(small_tmpdir: Path, tmp_path: Path) -> None:
    """Without it its processes would wait for each other without end."""
    with pytest.raises(DiskFull, match=rf"disk full: 16 MB .* are free \(see {small_tmpdir}\)"):
        run_case(brief_pile(ranks=2), tmp_path / "runs", time_limit=PATIENCE)


def test_a_run_goes_on_when_a_full_disk_has_room_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full when the second segment begins: nothing is lost, and the numbers are right.

    They are those of a run on another disk. The first segment is not computed again.
    """
    case = brief_pile(duration="0.06 s", segment="0.03 s")
    with mounted(tmp_path / "disk", "16m") as place:

        def launch_on_a_full_disk(deck: Deck, folder: Path, *arguments: Any, **options: Any) -> Any:
            if folder.name == "0001.new":
                fill(place)
            return launch(deck, folder, *arguments, **options)

        with monkeypatch.context() as patch:
            patch.setattr("walkers.runs.making.launch", launch_on_a_full_disk)
            with pytest.raises(DiskFull, match="disk full"):
                run_case(case, place)
        assert not list(place.glob("*/manifest.json"))
        (first,) = place.glob("*.incomplete/segments/0000/beads.bin")
        inode = first.stat().st_ino
        (place / "ballast").unlink()
        done = run_case(case, place)
        assert (done.directory / FIRST_SEGMENT / "beads.bin").stat().st_ino == inode
        assert done.result == run_case(case, tmp_path / "runs").result


# --- streams and the environment ------------------------------------------------------------------


def _into_true(command: str) -> subprocess.CompletedProcess[str]:
    """The program, whose output goes to `true`, which ends without reading."""
    return _program(["bash", "-c", f'{PROGRAM} {command} | true; exit "${{PIPESTATUS[0]}}"'])


def _velocity_of_the_run() -> float:
    """The result of the run of ``short.toml`` in the current folder."""
    (run,) = Path("runs").glob("short-*")
    return float(read_results(run)["velocity"])


def test_a_run_is_finished_whose_reader_has_had_enough(short_case: Path) -> None:
    done = _into_true("run short.toml")
    assert done.returncode == 0
    assert not re.search("Traceback|BrokenPipe", done.stderr)
    assert _velocity_of_the_run() > 0.0


def test_a_reader_of_the_help_may_have_had_enough() -> None:
    done = _into_true("--help")
    assert done.returncode == 0
    assert not re.search("Traceback|BrokenPipe", done.stderr)


def test_a_closed_output_is_no_error(short_case: Path) -> None:
    script = f"exec {PROGRAM} run short.toml <&- >&- 2>&-"
    done = subprocess.run(["bash", "-c", script], check=False)
    assert done.returncode == 0
    assert _velocity_of_the_run() > 0.0


def test_an_encoding_without_letters_of_units_does_not_matter() -> None:
    done = _program([PROGRAM, "show", "fig1b"], {"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert r"m/s\xb2" in done.stdout  # m/s²


def test_a_backend_that_matplotlib_does_not_have_does_not_matter(short_case: Path) -> None:
    call("run", "short.toml", check=True)
    done = _program([PROGRAM, "plot", "short.toml"], {"MPLBACKEND": "nonsense"})
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert "walk.png" in done.stdout


# --- texts ----------------------------------------------------------------------------------------


HOSTILE: dict[str, str] = {
    "markup": (
        "</title></script><script>open('pwned')</script>-->"
        '<!-- " onload="open(1)" ]]><x/> a & b &amp; <b>'
    ),
    "quotes": (
        "'''; open('pwned', 'w'); ''' \"b\" {0} {x!r} }{ C:\\new\\x "
        "\\N{BULLET} # - a: *b | c [d](e) `z`"
    ),
    "other quotes": '"""; open("pwned", "w"); """ ends in \\',
    "shell": "${HOME} $HOME $(touch pwned) `touch pwned`; touch pwned; '\"; touch pwned #",
    "templates": "{{ 7 * 7 }}{{7*7}}{% raw %}{% include 'x' %}{# comment #}",
    "lines": (
        "one\nimport os; open('pwned', 'w')\rshell touch pwned\x0bshell touch\x85"
        "x\u2028shell \x1b[31mred\t"
    ),
    "no ASCII": "Γ0 = 0,38 · 粒子 · é · \U0001f41d · \u202e",
    "very long": "long " * 20_000,
}
"""Texts that a case file may hold; whoever runs one finds a file ``pwned``."""


def _with_texts(case: Case, text: str) -> Case:
    """The case as somebody could hand it over: each text of it another."""
    changed = case
    for key in ("beads.material", "liquid.name", "boundary.material"):
        changed = changed.with_value_at(key, text)
    return changed.with_values(name=text, title=text)


Stranger = Callable[[str], Path]
"""Makes a run directory whose case has a text everywhere."""


@pytest.fixture
def stranger(run_directory: Callable[..., Path], tmp_path: Path) -> Stranger:
    """Make run directories whose case has a text everywhere, and a manifest that says so."""
    original = run_directory(run=SHORT)

    def make(text: str) -> Path:
        number = len(list(tmp_path.iterdir()))
        run = Path(shutil.copytree(original, tmp_path / str(number) / original.name))
        with recomputed(run, [CASE_NAME]):
            write_json(run / CASE_NAME, _with_texts(case_of(original), text).as_dict())
        return run

    return make


def _deck(text: str, stranger: Stranger, folder: Path) -> object:
    """A deck and its files."""
    tables = document(run=SHORT, beads={"density": "4 g/cm^3"}, title=text)
    deck = render_deck(_with_texts(build_case(tables, name=text), text))
    return deck.text, deck.files


def _paraview(text: str, stranger: Stranger, folder: Path) -> object:
    """Files for ParaView, and the script that shows them."""
    path = write_vtk(stranger(text), folder / "vtk")
    return path.read_bytes(), path.with_name("show.py").read_bytes()


def _page(text: str, stranger: Stranger, folder: Path) -> object:
    """Tags of a page: no text may add one."""
    return re.findall(r"<!?[/\w-]+", result_html(read_results(stranger(text))))


def _markdown(text: str, stranger: Stranger, folder: Path) -> object:
    """Lines, and characters that mean something and are not escaped."""
    markdown = environment("walkers.calibration").from_string("{{ text | plain }}")
    rendered = markdown.render(text=text)
    without_escapes = re.sub(r"\\.", "", rendered)
    return len(rendered.splitlines()), re.findall(r"[`*_<>|&\[\]]", without_escapes)


def _archive(text: str, stranger: Stranger, folder: Path) -> object:
    """The names of its files, which are those that it lists, unchanged."""
    run = stranger(text)
    manifest = json.loads((run / "manifest.json").read_text())
    manifest["platform"] = text
    manifest["engine"]["sha256"] = text
    write_json(run / "manifest.json", manifest)
    names = []
    with zipfile.ZipFile(write_archive(run, folder / "archive.zip")) as archive:
        json.loads(archive.read("archive.json"))
        archive.extractall(folder / "unpacked")
        for name in archive.namelist():
            # The name of the case file is that of the case.
            names.append(str(Path(name).parent) if name.endswith(".toml") else name)
    call("check", "files", str(folder / "unpacked"), check=True)
    return names


@pytest.mark.parametrize(
    "output",
    [
        pytest.param(_deck, id="deck"),
        pytest.param(_paraview, id="paraview"),
        pytest.param(_page, id="page"),
        pytest.param(_markdown, id="markdown"),
        pytest.param(_archive, id="archive"),
    ],
)
def test_a_text_changes_nothing_but_itself(
    output: Callable[[str, Stranger, Path], object], stranger: Stranger, tmp_path: Path
) -> None:
    """Each output of a hostile text is that of a plain text, but for the text itself."""
    folder = tmp_path / "plain"
    folder.mkdir()
    plain = output("plain", stranger, folder)
    for name, text in HOSTILE.items():
        folder = tmp_path / name
        folder.mkdir()
        assert output(text, stranger, folder) == plain, name


# --- paths ----------------------------------------------------------------------------------------


ODD = (
    '--sp ace; it\'s "so" $(touch executed)`touch executed`;touch executed;&& ${HOME}\\ '
    "[a]*?äγ走\ntwo" + "x" * 120
)
"""A name with all that shells, glob patterns and options take for more; 120 x make it long."""
NO_UTF8 = os.fsdecode(b"x\xff")


@pytest.fixture
def odd_folder(short_case: Path) -> Path:
    """A folder with a sweep file that has an odd name."""
    folder = short_case.parent
    shutil.copy(folder / "sweep.toml", folder / f"{ODD}.toml")
    return folder


@pytest.mark.parametrize(
    ("file", "out"),
    [
        pytest.param("sweep.toml", f"./{ODD}", id="folder"),
        pytest.param(f"./{ODD}.toml", "runs", id="sweep file"),
    ],
)
def test_odd_paths_are_refused_with_a_site_file(file: str, out: str, odd_folder: Path) -> None:
    """Before anything is done."""
    (odd_folder / "site.toml").write_text("cores = 2\n")
    before = sorted(odd_folder.rglob("*"))
    done = call("sweep", file, "--out", out, "--site", "site.toml")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "expected letters, digits and" in done.stderr
    assert sorted(odd_folder.rglob("*")) == before


def _run_into_a_folder_that_is_no_utf8() -> object:
    Path(NO_UTF8).mkdir(exist_ok=True)
    return run_case("short.toml", Path(NO_UTF8).absolute())


def _load_a_file_that_is_no_utf8() -> object:
    Path(f"{NO_UTF8}.toml").write_bytes(Path("short.toml").read_bytes())
    return load_case(f"{NO_UTF8}.toml")


def _run_a_case_that_is_no_utf8() -> object:
    return run_case(load_case("short.toml").with_values(name=NO_UTF8), Path.cwd())


@pytest.mark.parametrize(
    "attempt",
    [
        pytest.param(_run_into_a_folder_that_is_no_utf8, id="folder"),
        pytest.param(_load_a_file_that_is_no_utf8, id="case file"),
        pytest.param(_run_a_case_that_is_no_utf8, id="case"),
    ],
)
def test_names_that_are_no_utf8_are_refused(
    attempt: Callable[[], object], short_case: Path
) -> None:
    """The libraries of the tables do not take them. No run is begun."""
    with pytest.raises(InputError, match=r"x\\xff.*: expected UTF-8 text"):
        attempt()
    assert not list(short_case.parent.rglob("case.json"))


def test_a_sweep_may_have_an_odd_path(odd_folder: Path) -> None:
    call("sweep", f"./{ODD}.toml", "--out", f"./{ODD}", "-j", "1", check=True)
    assert list(load_table(odd_folder / ODD / ODD)["status"]) == ["finished", "finished"]
    assert not list(odd_folder.rglob("executed"))


def test_a_run_may_have_an_odd_path(short_case: Path) -> None:
    """And is plotted and exported."""
    short_case.rename(short_case.with_name(f"{ODD}.toml"))
    for command in ("run", "plot", "export --format vtk"):
        done = call(*command.split(), f"./{ODD}.toml", "--out", f"./{ODD}", check=True)
        assert "Traceback" not in done.stderr
    assert not list(short_case.parent.rglob("executed"))
