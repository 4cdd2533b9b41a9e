"""Harm: damaged runs, full disks, streams that nobody reads, texts and paths that other languages take for code.

Each kind is a table, and a command that meets it says so in one line.
"""

import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import tracemalloc
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
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
from walkers.postprocess.measure.dump import BinaryDump, DumpError, local_frames
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.measure.results import measure, read_results
from walkers.postprocess.show.paraview import write_vtk
from walkers.postprocess.show.report.run import result_html
from walkers.runner.failures import DiskFull, RunBusy
from walkers.runner.launch import launch
from walkers.runner.run_directory import CASE_NAME, FIRST_SEGMENT, case_of, locked, recomputed
from walkers.sweeps.table import load_table
from walkers.templates.deck import Deck, render_deck
from walkers.templates.layout import BEAD_COLUMNS, MEAN_SPIN_COLUMNS
from walkers.text import environment


@pytest.fixture
def short_case(in_folder: Path) -> Path:
    (in_folder / "sweep.toml").write_text(
        'case = "short.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
    )
    file = in_folder / "short.toml"
    file.write_text(to_toml({"title": "price: 5$ and 3$", **document(run=SHORT)}))
    return file


@pytest.fixture
def parts(in_folder: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A copy of a run of three segments, to be damaged."""

    def make(folder: Path) -> None:
        (folder / "short.toml").write_text(
            to_toml(document(run={**SHORT, "time_step": "2 us", "segment": "25 ms"}))
        )
        call("run", "short.toml", check=True, folder=folder)

    shutil.copytree(once("short-run", make), in_folder, dirs_exist_ok=True)
    (run,) = Path("runs").glob("short-*")
    return run


Damage = Callable[[Path], object]


def edited(name: str, change: Callable[[dict[str, Any]], object]) -> Damage:
    def edit(run: Path) -> None:
        contents = json.loads((run / name).read_text())
        change(contents)
        (run / name).write_text(json.dumps(contents))

    return edit


def cut(name: str, size: int) -> Damage:
    return lambda run: os.truncate(
        run / name, size if size > 0 else (run / name).stat().st_size + size
    )


def written_over(name: str, end: bytes) -> Damage:
    """Other bytes at the end of a file, as a disk could write them."""
    return lambda run: (run / name).write_bytes((run / name).read_bytes()[: -len(end)] + end)


def unmeasured(damage: Damage) -> Damage:
    """The result is gone too, so that it is made of what is damaged."""

    def both(run: Path) -> None:
        damage(run)
        (run / "result.json").unlink()

    return both


READERS = {
    "run short.toml": "case",
    "run {run}": "case",
    "plot {run}": "case result tables",
    "report {run} --to out.html": "case result tables beads bridges",
    "export {run} --to vtk -o vtk": "case result beads bridges",
    "export {run} --to lammps -o out.lammpstrj": "case result beads",
    "export {run} --to archive -o out.zip": "case result tables beads bridges",
    "compare {run} {run}": "case result",
    "compare short.toml fig1b": "",
    "show short.toml --theory": "",
}
"""Commands that are given a run, and what they read of it."""
SECOND = "segments/0001"
DAMAGES: dict[str, tuple[Damage, str, str]] = {
    # What is done to a run, who reads that, what is said.
    "an edited case": (
        edited("case.json", lambda case: case["drive"].update(frequency=81.0)),
        "case",
        "has changed",
    ),
    "no case": (lambda run: (run / "case.json").unlink(), "case", "case.json"),
    "a manifest that was cut": (cut("manifest.json", 100), "case", "manifest.json"),
    "a result that was cut": (cut("result.json", 100), "result", "its result.json cannot be read"),
    "a table that was cut": (cut("trajectory.parquet", 100), "tables", "trajectory.parquet"),
    "a layout that was cut": (cut(f"{SECOND}/layout.json", 100), "beads", "layout.json"),
    "a missing segment": (lambda run: shutil.rmtree(run / SECOND), "beads", "segment|0001"),
    "a dump that was cut": (
        cut(f"{SECOND}/beads.bin", 1000),
        "beads",
        "beads.bin|dump is incomplete",
    ),
    "no number in a dump": (
        written_over(f"{SECOND}/beads.bin", struct.pack("=d", np.nan)),
        *("beads", "is not a number at step .*: the dump was damaged after|has changed"),
    ),
    "a text that was cut": (
        cut(f"{SECOND}/bridges.walls.txt", -200),
        "bridges",
        "bridges.walls.txt",
    ),
    "a dump to be measured": (
        unmeasured(written_over(f"{SECOND}/beads.bin", b"\xff" * 64)),
        *("case result", "beads.bin has changed|has no result.json"),
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_run_is_told_in_a_line_by_all_that_read_what_is_damaged(
    name: str, parts: Path
) -> None:
    (damage, what, told), run = DAMAGES[name], parts
    damage(run)
    files = {
        path: path.read_bytes()
        for path in run.rglob("*")
        if path.is_file() and path.suffix != ".lock"
    }
    for command, reads in READERS.items():
        damaged = {*what.split()} & {*reads.split()}
        if not damaged and (reads or what not in ("case", "result")):
            continue  # without a case they ask for the numbers of a run alone
        done = call(*command.format(run=run).split())
        lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
        assert "Traceback" not in done.stderr, (command, done.stderr)
        assert (done.returncode in (1, 2)) == (len(lines) == 1) == bool(damaged), (command, done)
        assert not lines or (str(run) in lines[0] and re.search(told, lines[0])), (command, lines)
        assert all(path.read_bytes() == contents for path, contents in files.items()), (
            "nothing on disk is lost"
        )
    if what in ("result", "tables"):
        call("run", str(run), check=True)
        call("export", "--to", "archive", str(run), "-o", "out.zip", check=True)


@pytest.mark.parametrize("name", ["a manifest that was cut", "a dump to be measured"])
def test_a_sweep_goes_on_without_a_damaged_run_and_says_which(name: str, short_case: Path) -> None:
    case = to_toml(document(run={**SHORT, "time_step": "2 us", "segment": "25 ms"}))
    short_case.write_text(case)
    call("sweep", "sweep.toml", check=True)
    runs = list(load_table("runs/sweep")["run"])
    DAMAGES[name][0](Path(runs[0]))
    whole = name != "a dump to be measured"  # the table is of results alone
    status = ["finished" if whole else "failed", "finished"]
    table = load_table("runs/sweep")
    assert (list(table["status"]), list(table["run"]), walkers.load("runs/sweep").status) == (
        status,
        runs,
        status[0],
    )
    told = {}
    for command in ("list runs/sweep", "plot runs/sweep", "list --all", "sweep sweep.toml"):
        done = call(*command.split())
        assert "Traceback" not in done.stderr, (command, done.stderr)
        assert done.returncode == int(command.startswith("sweep") and not whole), command
        told[command] = done.stdout + done.stderr
    for command in ("list runs/sweep", "sweep sweep.toml"):
        assert f"2 points, {'2 finished' if whole else '1 finished, 1 failed'}\n" in told[command]
    assert told["sweep sweep.toml"].count("point 0") == 2 * (not whole)
    assert ("1 of 2 points left out: 1 failed" in told["plot runs/sweep"]) is not whole


def test_a_result_whose_making_was_killed_is_made_anew(parts: Path) -> None:
    """Between the table that is new and the manifest that does not yet say so."""
    run, names = parts, ["result.json", "walkers.parquet", "trajectory.parquet"]
    right = read_results(run).as_dict()
    with suppress(KeyboardInterrupt), recomputed(run, names):
        edited("result.json", lambda result: result["numbers"].update(velocity=99.0))(run)
        raise KeyboardInterrupt
    assert walkers.run(run).result.as_dict() == right
    assert json.loads((run / "manifest.json").read_text())["sha256"].keys() >= set(names)


def test_a_run_is_measured_by_one_process_at_a_time(parts: Path) -> None:
    before = (parts / "manifest.json").read_bytes()
    with locked([parts]), pytest.raises(RunBusy, match="measuring"):
        measure(parts)
    assert (parts / "manifest.json").read_bytes() == before


def test_a_dump_of_beads_is_read_but_for_a_last_frame_that_was_cut(
    run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    beads, short = (
        run_directory(dimers={"replicates": 2}, run=SHORT) / FIRST_SEGMENT / "beads.bin",
        tmp_path / "short",
    )
    columns = (*BEAD_COLUMNS, *MEAN_SPIN_COLUMNS)
    dump, contents = BinaryDump(beads, columns), beads.read_bytes()
    frames = dump.stack()
    assert frames.shape == (61, 4, len(columns))
    np.testing.assert_allclose(
        frames[0, :, dump.columns.index("radius")], [3e-4, 2e-4, 3e-4, 2e-4], rtol=1e-15
    )
    for less in (1, 200, 550):  # of a frame of 704 bytes, 104 of them its head
        short.write_bytes(contents[:-less])
        assert BinaryDump(short, columns).truncated
        np.testing.assert_array_equal(BinaryDump(short, columns).stack(), frames[:60])
    short.write_bytes(contents[:-8] + struct.pack("=d", np.inf))
    with pytest.raises(DumpError, match="is not a number at step"):
        BinaryDump(short, columns).stack()
    for nonsense in (
        b"no dump at all, but text that is long enough for a header" * 5,
        b"\xff" * 500,
    ):
        short.write_bytes(nonsense)
        for read_it in (
            lambda: BinaryDump(short, BEAD_COLUMNS),
            lambda: list(local_frames(short, ("x",))),
        ):
            with pytest.raises(DumpError, match="short"):
                read_it()


def test_motion_takes_little_more_memory_than_its_arrays(
    run_directory: Callable[..., Path],
) -> None:
    """Position, velocity and two spins are 96 bytes a bead and frame; copies would take as much again."""
    directory = run_directory(dimers={"replicates": 40}, run={**SHORT, "samples_per_cycle": 20})
    read_motion(directory)  # what is imported and kept takes memory once
    tracemalloc.start()
    motion = read_motion(directory)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    frames, beads, _ = motion.position.shape
    assert motion.mean_spin is not None
    assert 96.0 <= peak / (frames * beads) < 130.0


def test_a_local_dump_is_read_whole_or_not_at_all(
    run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    segment = run_directory(dimers={"replicates": 2}, run=SHORT) / FIRST_SEGMENT
    path = Path(shutil.copy(segment / "bridges.pairs.txt", tmp_path))
    columns = tuple(json.loads((segment / "layout.json").read_text())["pair_bridge_columns"])
    assert sum(len(frame) for _, frame in local_frames(path, columns)) == 7 * 2
    whole = path.read_bytes()
    lines, last = whole.split(b"\n"), whole.rindex(b"ITEM: TIMESTEP")
    words = lines[9].split()
    harmed = [
        whole[:end] for end in (*range(last + 1, len(whole), 7), len(whole) - 1)
    ]  # in its header, its rows
    rows = (b" ".join([word, *words[1:]]) for word in (b"nan", b"inf", b"x", b"1 2", b""))
    harmed += [b"\n".join([*lines[:9], row, *lines[10:]]) for row in rows]
    for contents in harmed:
        path.write_bytes(contents)
        with pytest.raises(DumpError, match=r"bridges\.pairs\.txt"):
            list(local_frames(path, columns))


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


READ_FILES = (
    "case.json",
    "manifest.json",
    "result.json",
    "trajectory.parquet",
    "segments/0001/layout.json",
    "segments/0001/segment.json",
    "segments/0001/beads.bin",
    "segments/0001/bridges.pairs.txt",
)
WAYS_TO_READ = (
    "list",
    "show {run}",
    "compare {run} {run}",
    "plot {run}",
    "export {run} --to lammps -o out.lammpstrj",
    "export {run} --to vtk -o vtk",
    "export {run} --to archive -o out.zip",
    "check files {run}",
    "run {run}",
)


@pytest.mark.parametrize("name", READ_FILES)
def test_nothing_waits_for_a_fifo_in_place_of_a_file(name: str, parts: Path) -> None:
    """Commands that need the file refuse it in a line, and the list has the other runs."""
    (parts / name).unlink()
    os.mkfifo(parts / name)
    refusals = 0
    for command in WAYS_TO_READ:
        with _at_most(60):
            done = call(*command.format(run=parts).split())
        assert "Traceback" not in done.stderr, (command, done.stderr)
        assert done.returncode in (0, 1, 2)
        if command == "list":
            assert (done.returncode, "1 run" in done.stdout) == (0, True), done
        refusals += done.returncode != 0
    assert refusals


@pytest.mark.parametrize("kind", ["fifo", "socket", "device", "folder"])
def test_only_regular_files_are_opened(kind: str, in_folder: Path) -> None:
    place = in_folder / "file.json"
    if kind == "fifo":
        os.mkfifo(place)
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind("file.json")
    elif kind == "device":
        place.symlink_to("/dev/zero")
    else:
        place.mkdir()
    with (
        _at_most(60),
        pytest.raises(OSError, match=r"(not a regular file|Is a directory): .*file\.json"),
    ):
        read_json(place)


def test_a_fifo_in_place_of_a_lock_is_no_lock(parts: Path) -> None:
    os.mkfifo(parts.with_name(f"{parts.name}.lock"))
    with _at_most(60):
        assert call("list", check=True).stdout.count(parts.name) == 1


NO_LOCKS = "#include <errno.h>\nint flock(int file, int operation) { errno = ENOLCK; return -1; }\n"


def _built(source: str, folder: Path) -> str:
    """A library that replaces functions of the system, for ``LD_PRELOAD``."""
    library = folder / "shim.so"
    command = ["g++", "-shared", "-fPIC", "-x", "c", "-", "-o", str(library)]
    subprocess.run(command, input=source, text=True, check=True)
    return str(library)


def test_a_file_system_without_locks_is_named_with_advice(short_case: Path, tmp_path: Path) -> None:
    shim = _built(NO_LOCKS, tmp_path)
    command = [PROGRAM, "run", "short.toml"]
    done = subprocess.run(
        command, env={**os.environ, "LD_PRELOAD": shim}, capture_output=True, text=True, check=False
    )
    lines = done.stderr.splitlines()
    told = [line for line in lines if "ERROR: ld.so" not in line and "never audited" not in line]
    assert (done.returncode, len(told)) == (2, 1), done
    assert re.search(r"runs: files cannot be locked \(No locks available\): .*--out", told[0])


@pytest.mark.parametrize("kilobytes", [20, 600])
def test_a_limit_of_the_size_of_files_is_named_with_advice(
    kilobytes: int, short_case: Path
) -> None:
    """The first limit stops the deck, the second one the engine."""
    many = "run.samples_per_cycle=250"
    script = (
        f"ulimit -f {kilobytes}; exec {PROGRAM} run short.toml --set {many} --set run.cycles=40"
    )
    # Python does not notice that byte code which it writes was cut.
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        ["bash", "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    last = done.stderr.splitlines()[-1]
    assert (done.returncode, "Traceback" in done.stderr) == (1, False), done
    assert re.search(
        rf"limit of {kilobytes * 1.024:g} kB \(ulimit -f\): .*\(see runs/short-", last
    ), last


def test_a_folder_that_cannot_be_made_is_named(short_case: Path) -> None:
    for command in ("run short.toml", "sweep sweep.toml"):
        done = call(*command.split(), "--out", "/proc/runs")
        assert done.returncode == 2
        assert "/proc/runs" in done.stderr
        assert "cannot create the folder" in done.stderr


FULL = {
    "run short.toml --out {}/a": 1,
    "sweep sweep.toml --out {}/c": 2,
    "plot runs/sweep --to {}/d.png": 2,
    "export --to vtk {run} -o {}/e": 2,
    "export --to deck {run} -o {}/deck": 2,
    "render {run} --images 1 --to {}/f.png": 2,
    "list runs/sweep --to {}/g.csv": 2,
}
"""Commands that write to a disk, and their exit status if it is full."""


def test_a_full_disk_is_told_in_a_line_and_nothing_half_written_stays(
    short_case: Path, tmp_path: Path
) -> None:
    call("sweep", "sweep.toml", check=True)
    (run, _) = Path("runs").glob("short-*")
    with mounted(tmp_path / "disk", "256k") as disk:
        ballast = fill(disk)
        for command, status in FULL.items():
            done = call(*command.format(disk, run=run).split())
            lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
            assert (done.returncode, len(lines), str(disk) in done.stderr) == (status, 1, True), (
                command,
                done,
            )
            assert "No space left on device" in lines[0] or "disk full" in lines[0]
        assert not (disk / "deck").exists()
        assert [path for path in disk.rglob("*") if path.is_file() and path.stat().st_size] == [
            ballast
        ]
        assert not [
            path for path in disk.rglob("*") if ".new" in path.name or path.suffix == ".lock"
        ]


def test_a_case_file_that_cannot_be_written_is_not_left_behind(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "256k") as disk:
        ballast = fill(disk)
        done = call("new", str(disk / "x"))
        assert (done.returncode, "No space left on device" in done.stderr) == (2, True)
        assert list(disk.iterdir()) == [ballast]
        ballast.unlink()
        call("new", str(disk / "x"), check=True)


def test_mpirun_needs_room_for_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without it its processes would wait for each other without end; one process needs nothing there."""
    with mounted(tmp_path / "tmp", "2m") as place:
        monkeypatch.setenv("TMPDIR", str(place))
        assert not run_case(make_case(run=SHORT), tmp_path / "runs").cached
        with pytest.raises(DiskFull, match=rf"disk full: 16 MB .* are free \(see {place}\)"):
            run_case(brief_pile(ranks=2), tmp_path / "runs", time_limit=PATIENCE)


def test_a_run_goes_on_when_a_full_disk_has_room_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is filled when the second segment begins: nothing is lost, and the numbers are those of another disk."""
    case = brief_pile(duration="0.06 s", segment="0.03 s")
    with mounted(tmp_path / "disk", "16m") as place:

        def on_a_full_disk(deck: Deck, folder: Path, *given: Any, **how: Any) -> Any:
            if folder.name == "0001.new":
                fill(place)
            return launch(deck, folder, *given, **how)

        with monkeypatch.context() as patch:
            patch.setattr("walkers.runs.making.launch", on_a_full_disk)
            with pytest.raises(DiskFull, match="disk full"):
                run_case(case, place)
        assert not list(place.glob("*/manifest.json"))
        (first,) = place.glob("*.incomplete/segments/0000/beads.bin")
        node = first.stat().st_ino
        (place / "ballast").unlink()
        done = run_case(case, place)
        assert (done.directory / FIRST_SEGMENT / "beads.bin").stat().st_ino == node
        assert done.result == run_case(case, tmp_path / "runs").result


@pytest.mark.parametrize("command", ["run short.toml", "--help"])
def test_a_reader_may_have_had_enough(command: str, short_case: Path) -> None:
    script = ["bash", "-c", f'{PROGRAM} {command} | true; exit "${{PIPESTATUS[0]}}"']
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert (done.returncode, re.search("Traceback|BrokenPipe", done.stderr)) == (0, None), done
    if command != "--help":
        assert read_results(next(Path("runs").glob("short-*")))["velocity"] > 0.0


def test_a_closed_output_is_no_error(short_case: Path) -> None:
    script = f"exec {PROGRAM} run short.toml <&- >&- 2>&-"
    done = subprocess.run(["bash", "-c", script], check=False)
    assert done.returncode == 0
    assert read_results(next(Path("runs").glob("short-*")))["velocity"] > 0.0


@pytest.mark.parametrize(
    ("variable", "value", "command"),
    [("PYTHONIOENCODING", "ascii", "show fig1b"), ("MPLBACKEND", "nonsense", "plot short.toml")],
)
def test_an_odd_environment_does_not_matter(
    variable: str, value: str, command: str, short_case: Path
) -> None:
    """An encoding without the letters of units, and a backend that matplotlib does not have."""
    call("run", "short.toml", check=True)
    environment = {**os.environ, variable: value}
    done = subprocess.run(
        [PROGRAM, *command.split()], env=environment, capture_output=True, text=True, check=False
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert r"m/s\xb2" in done.stdout or "walk.png" in done.stdout


def test_what_is_no_file_to_read_is_refused_at_once(tmp_path: Path) -> None:
    """A byte order mark is no mistake."""
    os.mkfifo(tmp_path / "fifo.toml")
    (tmp_path / "large.toml").write_text(f'title = "{"x" * (17 << 20)}"\n')
    for path in (Path("/dev/zero"), tmp_path / "fifo.toml"):
        with pytest.raises(InputError, match="is a pipe, a socket or a device; expected a file"):
            read_toml(path)
    with pytest.raises(InputError, match="expected a file of at most 16 MB"):
        read_toml(tmp_path / "large.toml")
    (tmp_path / "windows.toml").write_text(to_toml(document()), encoding="utf-8-sig")
    assert load_case(tmp_path / "windows.toml") == make_case().with_values(name="windows")


HOSTILE: dict[str, str] = {
    "markup": '</title></script><script>open(\'pwned\')</script>--><!-- " onload="open(1)" ]]><x/> a & b &amp; <b>',
    "quotes": """'''; open('pwned', 'w'); ''' "b" {0} {x!r} }{ C:\\new\\x \\N{BULLET} # - a: *b | c [d](e) `z`""",
    "other quotes": '"""; open("pwned", "w"); """ ends in \\',
    "shell": "${HOME} $HOME $(touch pwned) `touch pwned`; touch pwned; '\"; touch pwned #",
    "templates": "{{ 7 * 7 }}{{7*7}}{% raw %}{% include 'x' %}{# comment #}",
    "lines": "one\nimport os; open('pwned', 'w')\rshell touch pwned\x0bshell touch\x85x\u2028shell \x1b[31mred\t",
    "no ASCII": "Γ0 = 0,38 · 粒子 · é · \U0001f41d · \u202e",
    "very long": "long " * 20_000,
}
"""From what they hold to texts that a case file may hold; whoever runs one finds a file ``pwned``."""


def _with_texts(case: Case, text: str) -> Case:
    """The case as somebody could hand it over: each text of it another."""
    named = (
        case.with_value_at("beads.material", text)
        .with_value_at("liquid.name", text)
        .with_value_at("boundary.material", text)
    )
    return named.with_values(name=text, title=text)


Stranger = Callable[[str], Path]


@pytest.fixture
def stranger(run_directory: Callable[..., Path], tmp_path: Path) -> Stranger:
    """A run directory whose case has a text everywhere, and a manifest that says so."""
    given = run_directory(run=SHORT)

    def made(text: str) -> Path:
        place = Path(
            shutil.copytree(given, tmp_path / f"{len([*tmp_path.iterdir()])}" / given.name)
        )
        with recomputed(place, [CASE_NAME]):
            write_json(place / CASE_NAME, _with_texts(case_of(given), text).as_dict())
        return place

    return made


def _deck(text: str, stranger: Stranger, folder: Path) -> object:
    tables = document(run=SHORT, beads={"density": "4 g/cm^3"}, title=text)
    deck = render_deck(_with_texts(build_case(tables, name=text), text))
    return deck.text, deck.files


def _paraview(text: str, stranger: Stranger, folder: Path) -> object:
    path = write_vtk(stranger(text), folder / "vtk")
    return path.read_bytes(), path.with_name("show.py").read_bytes()


def _page(text: str, stranger: Stranger, folder: Path) -> object:
    """Tags: no text may add one."""
    return re.findall(r"<!?[/\w-]+", result_html(read_results(stranger(text))))


def _markdown(text: str, stranger: Stranger, folder: Path) -> object:
    """Lines, and characters that mean something and are not escaped."""
    told = environment("walkers.calibration").from_string("{{ text | plain }}").render(text=text)
    return len(told.splitlines()), re.findall(r"[`*_<>|&\[\]]", re.sub(r"\\.", "", told))


def _archive(text: str, stranger: Stranger, folder: Path) -> object:
    """The names of its files, which are those that it lists, unchanged."""
    run = stranger(text)
    manifest = json.loads((run / "manifest.json").read_text())
    manifest |= {"platform": text, "engine": {**manifest["engine"], "sha256": text}}
    write_json(run / "manifest.json", manifest)
    with zipfile.ZipFile(write_archive(run, folder / "archive.zip")) as archive:
        json.loads(archive.read("archive.json"))
        archive.extractall(folder / "unpacked")
        names = [
            name.replace(Path(name).name, "") if name.endswith(".toml") else name
            for name in archive.namelist()
        ]
    call("check", "files", str(folder / "unpacked"), check=True)
    return names


@pytest.mark.parametrize(
    "where", [_deck, _paraview, _page, _markdown, _archive], ids=lambda one: one.__name__[1:]
)
def test_a_text_changes_nothing_but_itself(
    where: Callable[[str, Stranger, Path], object], stranger: Stranger, tmp_path: Path
) -> None:
    told = {}
    for number, (name, text) in enumerate({"plain": "plain", **HOSTILE}.items()):
        (folder := tmp_path / f"folder {number}").mkdir()
        told[name] = where(text, stranger, folder)
    assert [name for name in HOSTILE if told[name] != told["plain"]] == []


ODD = (
    '--sp ace; it\'s "so" $(touch executed)`touch executed`;touch executed;&& ${HOME}\\ [a]*?äγ走\ntwo'
    + "x" * 120
)
NO_UTF8 = os.fsdecode(b"x\xff")


def test_odd_paths_are_paths_without_a_site_file_and_are_refused_with_one(
    short_case: Path, in_folder: Path
) -> None:
    """Before anything is done; also names that are no UTF-8, which the libraries of the tables do not take."""
    (in_folder / "site.toml").write_text("cores = 2\n")
    (sweep := in_folder / f"{ODD}.toml").write_text((in_folder / "sweep.toml").read_text())
    (in_folder / f"{NO_UTF8}.toml").write_bytes(short_case.read_bytes())
    (in_folder / NO_UTF8).mkdir()
    before = sorted(in_folder.rglob("*"))
    for file, out in (("sweep.toml", f"./{ODD}"), (f"./{ODD}.toml", "runs")):
        done = call("sweep", file, "--out", out, "--site", "site.toml")
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
        assert "expected letters, digits and" in done.stderr
    for attempt in (
        lambda: run_case("short.toml", in_folder / NO_UTF8),
        lambda: load_case(f"{NO_UTF8}.toml"),
        lambda: run_case(load_case("short.toml").with_values(name=NO_UTF8), in_folder),
    ):
        with pytest.raises(InputError, match=r"x\\xff.*: expected UTF-8 text"):
            attempt()
    assert sorted(in_folder.rglob("*")) == before
    call("sweep", f"./{ODD}.toml", "--out", f"./{ODD}", "-j", "1", check=True)
    assert list(load_table(in_folder / ODD / ODD)["status"]) == ["finished"] * 2
    short_case.rename(sweep)
    for command in (("run",), ("plot",), ("export", "--to", "vtk")):
        assert (
            "Traceback"
            not in call(*command, f"./{ODD}.toml", "--out", f"./{ODD}", check=True).stderr
        )
    assert not list(in_folder.rglob("executed"))
