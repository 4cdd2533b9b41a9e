"""Harm: damaged runs, full disks, streams that nobody reads, texts and paths that other languages take for code.

Each kind is a table, and a command that meets it says so in one line.
"""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
import threading
import zipfile
from collections.abc import Callable
from contextlib import suppress
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

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
    wait_for,
)
from walkers import run as run_case
from walkers.archive.writing import write_archive
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import load_sweep
from walkers.inputs.toml import read_toml
from walkers.postprocess.drawing import new_figure, plain_text, save_figure
from walkers.postprocess.dump import BinaryDump, DumpError, local_frames
from walkers.postprocess.paraview import write_vtk
from walkers.postprocess.report.run import result_html
from walkers.postprocess.results import measure, read
from walkers.runner.directory import CASE_NAME, FIRST_SEGMENT, case_of, recomputed
from walkers.runner.failures import DiskFull
from walkers.runner.files import write_json
from walkers.show import describe, summarise
from walkers.sweeps.table import load as load_table
from walkers.templates.deck import render_deck
from walkers.templates.layout import BEAD_COLUMNS, MEAN_SPIN_COLUMNS
from walkers.text import rendered


@pytest.fixture
def short_case(in_folder: Path) -> Path:
    (in_folder / "sweep.toml").write_text('case = "short.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    file = in_folder / "short.toml"
    file.write_text(to_toml({"title": "price: 5$ and 3$", **document(run=SHORT)}))
    return file


# --- damaged runs -----------------------------------------------------------------------------------------------------


@pytest.fixture
def parts(in_folder: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A copy of a run of three segments, to be damaged."""

    def make(folder: Path) -> None:
        (folder / "short.toml").write_text(to_toml(document(run={**SHORT, "time_step": "2 us", "segment": "25 ms"})))
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
    return lambda run: os.truncate(run / name, size if size > 0 else (run / name).stat().st_size + size)


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
    "export {run} --to paraview -o vtk": "case result beads bridges",
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
    "a case that was cut": (cut("case.json", 800), "case", "case.json has changed"),
    "an edited case": (edited("case.json", lambda case: case["drive"].update(frequency=81.0)), "case", "has changed"),
    "no case": (lambda run: (run / "case.json").unlink(), "case", "case.json"),
    "a manifest that was cut": (cut("manifest.json", 100), "case", "manifest.json"),
    "a manifest that is no table": (lambda run: (run / "manifest.json").write_text("[]"), "case", "manifest.json"),
    "a result that was cut": (cut("result.json", 100), "result", "its result.json cannot be read"),
    "a result that lacks a number": (
        edited("result.json", lambda result: result["numbers"].pop("goes_uphill")),
        *("result", "its result.json cannot be read"),
    ),
    "a table that was cut": (cut("trajectory.parquet", 100), "tables", "trajectory.parquet"),
    "a layout that was cut": (cut(f"{SECOND}/layout.json", 100), "beads", "layout.json"),
    "a missing segment": (lambda run: shutil.rmtree(run / SECOND), "beads", "segment|0001"),
    "a dump that was cut": (cut(f"{SECOND}/beads.bin", 1000), "beads", "beads.bin|dump is incomplete"),
    "nonsense in a dump": (written_over(f"{SECOND}/beads.bin", b"\xff" * 64), "beads", "not a number|has changed"),
    "no number in a dump": (
        written_over(f"{SECOND}/beads.bin", struct.pack("=d", np.nan)),
        *("beads", "is not a number at step .*: the dump was damaged after|has changed"),
    ),
    "a text that was cut": (cut(f"{SECOND}/bridges.walls.txt", -200), "bridges", "bridges.walls.txt"),
    "a dump to be measured": (
        unmeasured(written_over(f"{SECOND}/beads.bin", b"\xff" * 64)),
        *("case result", "beads.bin has changed|has no result.json"),
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_run_is_told_in_a_line_by_all_that_read_what_is_damaged(name: str, parts: Path) -> None:
    (damage, what, told), run = DAMAGES[name], parts
    for command, reads in READERS.items():
        if what in ("result", "tables") and command.startswith("run"):
            continue  # it is measured again
        damaged = {*what.split()} & {*reads.split()}
        shutil.copytree(run, "whole", dirs_exist_ok=True)
        damage(run)
        files = {path: path.read_bytes() for path in run.rglob("*") if path.is_file() and path.suffix != ".lock"}
        done = call(*command.format(run=run).split())
        lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
        assert "Traceback" not in done.stderr, (command, done.stderr)
        assert (done.returncode in (1, 2)) == (len(lines) == 1) == bool(damaged), (command, done)
        assert not lines or (str(run) in lines[0] and re.search(told, lines[0])), (command, lines)
        assert all(path.read_bytes() == contents for path, contents in files.items()), "nothing on disk is lost"
        shutil.rmtree(run)
        Path("whole").rename(run)
    if what in ("result", "tables"):
        damage(run)
        call("run", str(run), check=True)
        call("plot", str(run), check=True)


@pytest.mark.parametrize("name", ["an edited case", "a manifest that was cut", "a dump to be measured"])
def test_a_sweep_goes_on_without_a_damaged_run_and_says_which(name: str, short_case: Path) -> None:
    case = to_toml(document(run={**SHORT, "time_step": "2 us", "segment": "25 ms"}))
    short_case.write_text(case)
    call("sweep", "sweep.toml", check=True)
    runs = list(load_table("runs/sweep")["run"])
    DAMAGES[name][0](Path(runs[0]))
    whole = name != "a dump to be measured"  # the table is of results alone
    status = ["finished" if whole else "failed", "finished"]
    table = load_table("runs/sweep")
    assert (list(table["status"]), list(table["run"]), walkers.load("runs/sweep").status) == (status, runs, status[0])
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
    right = read(run).as_dict()
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


def test_a_blow_up_that_the_engine_did_not_notice_is_told(parts: Path) -> None:
    DAMAGES["no number in a dump"][0](parts)
    (parts / "manifest.json").unlink()
    with pytest.raises(DumpError, match=r"beads\.bin: .* is not a number at step .*: the simulation blew up"):
        measure(parts)


# --- dumps ------------------------------------------------------------------------------------------------------------


COLUMNS = (*BEAD_COLUMNS, *MEAN_SPIN_COLUMNS)
NO_DUMP = (b"no dump at all, but text that is long enough for a header" * 5, b"\xff" * 500)


def test_a_dump_of_beads_is_read_but_for_a_last_frame_that_was_cut(
    run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    beads, short = run_directory(dimers={"replicates": 2}, run=SHORT) / FIRST_SEGMENT / "beads.bin", tmp_path / "short"
    dump, contents = BinaryDump(beads, COLUMNS), beads.read_bytes()
    frames = dump.stack()
    assert frames.shape == (61, 4, len(COLUMNS))
    np.testing.assert_array_equal(frames[:, :, dump.column("id")], np.tile(np.arange(1, 5), (61, 1)))
    np.testing.assert_allclose(frames[0, :, dump.column("radius")], [3e-4, 2e-4, 3e-4, 2e-4], rtol=1e-15)
    for less in (1, 8, 200, 470, 550):  # of a frame of 704 bytes, 104 of them its head
        short.write_bytes(contents[:-less])
        assert BinaryDump(short, COLUMNS).truncated
        np.testing.assert_array_equal(BinaryDump(short, COLUMNS).stack(), frames[:60])
    short.write_bytes(b"")
    assert (len(BinaryDump(short, COLUMNS)), BinaryDump(short, COLUMNS).truncated) == (0, False)
    with pytest.raises(DumpError, match="2 columns"):
        BinaryDump(beads, ("id", "x"))
    for nonsense in NO_DUMP:
        short.write_bytes(nonsense)
        with pytest.raises(DumpError, match="short"):
            BinaryDump(short, BEAD_COLUMNS)
        with pytest.raises(DumpError, match="short"):
            list(local_frames(short, ("x",)))


def test_a_local_dump_is_read_whole_or_not_at_all(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    segment = run_directory(dimers={"replicates": 2}, run=SHORT) / FIRST_SEGMENT
    path = Path(shutil.copy(segment / "bridges.pairs.txt", tmp_path))
    columns = tuple(json.loads((segment / "layout.json").read_text())["pair_bridge_columns"])
    assert sum(len(frame) for _, frame in local_frames(path, columns)) == 7 * 2
    whole = path.read_bytes()
    last_frame = whole.rindex(b"ITEM: TIMESTEP")
    for end in (*range(last_frame + 1, len(whole), 7), len(whole) - 1):  # in the header, a row, before the last newline
        path.write_bytes(whole[:end])
        with pytest.raises(DumpError, match=r"bridges\.pairs\.txt"):
            list(local_frames(path, columns))
    lines = whole.split(b"\n")
    words = lines[9].split()
    for nonsense in (b"nan", b"inf", b"x", b"1 2", b""):
        path.write_bytes(b"\n".join([*lines[:9], b" ".join([nonsense, *words[1:]]), *lines[10:]]))
        with pytest.raises(DumpError, match=r"bridges\.pairs\.txt: .*the frame of step 0"):
            list(local_frames(path, columns))


# --- full disks -------------------------------------------------------------------------------------------------------


FULL = {
    "run short.toml --out {}/a": 1,
    "run pile-ci --out {}/b": 1,
    "sweep sweep.toml --out {}/c": 2,
    "plot runs/sweep --to {}/d.png": 2,
    "export --to vtk {run} -o {}/e": 2,
    "export --to deck {run} -o {}/deck": 2,
    "render {run} --to {}/f.png": 2,
    "list runs/sweep --to {}/g.csv": 2,
}
"""Commands that write to a disk, and their exit status if it is full."""


def test_a_full_disk_is_told_in_a_line_and_nothing_half_written_stays(short_case: Path, tmp_path: Path) -> None:
    call("sweep", "sweep.toml", check=True)
    (run, _) = Path("runs").glob("short-*")
    with mounted(tmp_path / "disk", "256k") as disk:
        ballast = fill(disk)
        for command, status in FULL.items():
            done = call(*command.format(disk, run=run).split())
            lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
            assert (done.returncode, len(lines)) == (status, 1), (command, done)
            assert "No space left on device" in lines[0] or "disk full" in lines[0]
            assert str(disk) in lines[0]
        assert not (disk / "deck").exists()
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        done = call("list", "runs/sweep", "--to", f"{disk}/g.csv")
        assert (done.returncode, done.stderr) == (2, f"walkers: {disk}/g.csv: Read-only file system\n")
        assert [path for path in disk.rglob("*") if path.is_file() and path.stat().st_size] == [ballast]
        assert not [path for path in disk.rglob("*") if ".new" in path.name or path.suffix == ".lock"]


def test_a_disk_that_is_full_when_the_tables_are_written_is_a_failure_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine has ended well by then; with room again only the tables are made."""
    case = make_case(run=SHORT)
    with mounted(tmp_path / "disk", "2m") as place:

        def measure_without_room(directory: Path) -> None:
            fill(place)
            measure(directory)

        monkeypatch.setattr("walkers.sweeps.making.measure", measure_without_room)
        with pytest.raises(DiskFull, match="disk full"):
            run_case(case, place / "runs")
        assert not list(place.glob("runs/*/manifest.json"))
        monkeypatch.undo()
        (place / "ballast").unlink()
        (dump,) = place.glob("runs/*.incomplete/segments/0000/beads.bin")
        node = dump.stat().st_ino
        outcome = run_case(case, place / "runs")
        assert (outcome.directory / FIRST_SEGMENT / "beads.bin").stat().st_ino == node


def test_a_disk_without_room_for_the_dump_and_one_that_fills_up_during_the_run(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "2m") as place:
        with pytest.raises(DiskFull, match="disk full"):
            run_case(make_case(run={"cycles": 600, "samples_per_cycle": 20}), place / "before")
        (failure,) = place.glob("before/*.incomplete/failure.json")
        assert "DiskFull" in failure.read_text()
    with mounted(tmp_path / "other", "2m") as place:

        def fill_soon() -> None:
            wait_for(lambda: list(place.glob("during/*.incomplete/segments/0000.new/beads.bin")))
            fill(place)

        filler = threading.Thread(target=fill_soon)
        filler.start()
        with pytest.raises(DiskFull):
            run_case(make_case(run={"cycles": 180, "settling_cycles": 2, "samples_per_cycle": 20}), place / "during")
        filler.join()
        assert not list(place.glob("during/*/manifest.json"))


def test_a_full_folder_of_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One process needs nothing there; mpirun would have its processes wait for each other without end."""
    with mounted(tmp_path / "tmp", "2m") as place:
        monkeypatch.setenv("TMPDIR", str(place))
        assert not run_case(make_case(run=SHORT), tmp_path / "runs").cached
        with pytest.raises(DiskFull, match=rf"disk full: 16 MB .* are free \(see {place}\)"):
            run_case(brief_pile(ranks=2), tmp_path / "runs", time_limit=PATIENCE)


def test_a_run_goes_on_when_a_full_disk_has_room_again(tmp_path: Path) -> None:
    """The disk is filled during the second segment: nothing is lost, and the numbers are those of another disk."""
    case = brief_pile(duration="0.06 s")
    with mounted(tmp_path / "disk", "16m") as place:

        def fill_soon() -> None:
            wait_for(lambda: list(place.glob("*.incomplete/segments/0001.new/beads.bin")))
            fill(place)

        filler = threading.Thread(target=fill_soon)
        filler.start()
        with pytest.raises(DiskFull, match="disk full"):
            run_case(case, place)
        filler.join()
        assert not list(place.glob("*/manifest.json"))
        (first,) = place.glob("*.incomplete/segments/0000/beads.bin")
        node = first.stat().st_ino
        (place / "ballast").unlink()
        done = run_case(case, place)
        assert (done.directory / FIRST_SEGMENT / "beads.bin").stat().st_ino == node
        assert done.result == run_case(case, tmp_path / "runs").result


# --- streams and files -----------------------------------------------------------------------------------------------


SCRIPTS = {
    "no terminal to ask": (
        "mkdir -p runs/x-0123456789ab.incomplete; {program} clean </dev/null",
        2,
        "walkers: --yes: expected",
    ),
    # A reader who has had enough: of the program, of who prints the help.
    "run, unread": ('{program} run short.toml | true; exit "${{PIPESTATUS[0]}}"', 0, ""),
    "help, unread": ('{program} --help | true; exit "${{PIPESTATUS[0]}}"', 0, ""),
    # A line of progress is due each time that there is some, when the reader has gone.
    "progress, unread": (
        f'{sys.executable} -c "from walkers import main, progress; progress._FIRST_LINE_SECONDS = 0.0; '
        'main.main()" sweep sweep.toml -j 1 2>&1 | true; exit "${{PIPESTATUS[0]}}"',
        *(0, ""),
    ),
}


@pytest.mark.parametrize("name", SCRIPTS)
def test_streams_that_are_unread_or_no_terminal(name: str, short_case: Path) -> None:
    script, status, told = SCRIPTS[name]
    command = ["bash", "-c", script.format(program=PROGRAM)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, told in done.stdout + done.stderr) == (status, True), done
    assert not any(word in done.stderr for word in ("Traceback", "BrokenPipe"))
    if script.startswith(("{program} run", "{program} sweep")):
        directory = next(Path("runs").glob("short-*"))
        assert read(directory)["velocity"] > 0.0
        assert b"walkers" not in next(directory.rglob("engine.log")).read_bytes()


def test_what_is_no_file_to_read_is_refused_at_once(tmp_path: Path) -> None:
    """A byte order mark is no mistake."""
    os.mkfifo(tmp_path / "fifo.toml")
    (tmp_path / "large.toml").write_text(f'title = "{"x" * (17 << 20)}"\n')
    for path in (Path("/dev/zero"), tmp_path / "fifo.toml", tmp_path / "large.toml"):
        with pytest.raises(InputError, match="expected a file of at most 16 MB"):
            read_toml(path)
    (tmp_path / "windows.toml").write_text(to_toml(document()), encoding="utf-8-sig")
    assert load_case(tmp_path / "windows.toml") == make_case().but(name="windows")


# --- texts ------------------------------------------------------------------------------------------------------------


HOSTILE: dict[str, str] = {
    "three double quotes": '"""; open("pwned", "w"); """',
    "three single quotes": "'''; open('pwned', 'w'); '''",
    "quotes": '"a" \'b\' "',
    "braces": "{0} {x!r} }{",
    "backslashes": r"C:\Users\new\x \N{BULLET}",
    "backslash at the end": "ends in \\",
    "newline": "one\nimport os; open('pwned', 'w')\nshell touch pwned",
    "carriage return": "one\ropen('pwned', 'w')\rshell touch pwned",
    "other ends of lines": "one\x0bshell touch pwned\x0cshell touch pwned\x85shell touch pwned\u2028shell touch pwned",
    "tab and escape": "one\ttwo \x1b[31mred\x1b[0m",
    "script": "</title></script><script>open('pwned')</script>",
    "attribute": '" onload="open(1)" x="',
    "comment of HTML": "--><script>open('pwned')</script><!--",
    "expression of jinja": "{{ 7 * 7 }}{{7*7}}",
    "block of jinja": "{% raw %}{% include 'x' %}{# comment #}",
    "ampersand": "a & b &amp; &lt;script&gt;",
    "variable of a shell": "${HOME} $HOME $(touch pwned)",
    "backquotes": "`touch pwned`",
    "shell": "; touch pwned; '\"; touch pwned #",
    "hash": "# heading # comment",
    "table of markdown": "a | b | [link](javascript:open) ![x](y) *z* <b>",
    "end of CDATA": "]]><x/>",
    "YAML": "- a: *b\n%x",
    "no ASCII": "Γ0 = 0,38 · 粒子 · é · \U0001f41d · \u202e",
    "very long": "long " * 20_000,
}
"""From what they hold to texts that a case file may hold; whoever runs one finds a file ``pwned``."""


class _Tags(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, tuple[str, ...]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, tuple(name for name, _ in attrs)))

    def handle_comment(self, data: str) -> None:
        self.found.append(("comment", ()))


def _tags(page: str) -> list[tuple[str, tuple[str, ...]]]:
    """Tags of a page with the names of their attributes: no text of anybody's may add one."""
    return _Tags(page).found


def _with_texts(case: Case, text: str) -> Case:
    """The case as somebody could hand it over: each text of it another."""
    named = case.put("beads.material", text).put("liquid.name", text).put("boundary.material", text)
    return named.but(name=text, title=text)


@pytest.fixture
def stranger(run_directory: Callable[..., Path], tmp_path: Path) -> Callable[[str], Path]:
    """A run directory whose case has a text everywhere, and a manifest that says so."""
    given = run_directory(run=SHORT)

    def made(text: str) -> Path:
        place = tmp_path / given.name
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(given, place)
        with recomputed(place, [CASE_NAME]):
            write_json(place / CASE_NAME, _with_texts(case_of(given), text).as_dict())
        return place

    return made


def _calibration(text: str) -> str:
    """The report of a calibration whose texts are all the same."""
    row = {"title": text, "expected": text, "numbers": {text: 1.0}, "agrees": {text: True}, "derived": False}
    row |= {"predicted": (0.0, 1.0, 2.0), "emulator_error": 0.1}
    weights = {"points": 1, "effective_samples": 1.0, "converged": True}
    found = {
        "title": text, "calibration": text, "number": 1, "of": 1, "observed": "measured", "parameters": {"a": text},
        "sets": {text: {"a": 1.0}}, "agree": {text: 1}, "intervals": {"a": (0.0, 1.0, 2.0)}, "words": {"a": ""},
        "ratios": {text: (0.0, 1.0, 2.0)}, "observations": [row], "emulators_within_two_errors": 1.0,
        "posterior": weights, "held_out": weights,
        "settings": {
            "parameters": {"a": {"range": (0.0, 1.0)}}, "experiments": {text: {}}, "design": {"held_out": [text]},
        },
    }  # fmt: skip
    return rendered("walkers.calibration", "report.md.j2", found=found, least=1.0, narrow=0.5)


Stranger = Callable[[str], Path]
PLACES: dict[str, Callable[[str, Stranger, Path], object]] = {}
"""Where texts go, and what of it no text may change."""


def place(function: Callable[[str, Stranger, Path], object]) -> Callable[[str, Stranger, Path], object]:
    return PLACES.setdefault(function.__name__, function)


@place
def deck(text: str, stranger: Stranger, folder: Path) -> object:
    """Text and tables."""
    tables = document(run=SHORT, beads={"density": "4 g/cm^3"}, title=text)
    rendered_deck = render_deck(_with_texts(Case.read(tables, name=text), text))
    return rendered_deck.text, rendered_deck.files


@place
def paraview(text: str, stranger: Stranger, folder: Path) -> object:
    path = write_vtk(stranger(text), folder / "vtk")
    return path.read_bytes(), path.with_name("show.py").read_bytes()


@place
def notebook(text: str, stranger: Stranger, folder: Path) -> object:
    """Tags and the names of their attributes."""
    return _tags(result_html(read(stranger(text))))


@place
def figure(text: str, stranger: Stranger, folder: Path) -> object:
    """It is XML."""
    drawn, _ = new_figure(3.0, 2.0)
    drawn.suptitle(plain_text(text[:2000]))
    (path,) = save_figure(drawn, folder / "figure", [], ["svg"], text)
    return ElementTree.parse(path).getroot().tag


@place
def calibration_report(text: str, stranger: Stranger, folder: Path) -> object:
    """Columns of each line; no tag."""
    lines = _calibration(text).split("\n")
    return [(line.replace("\\|", "").count("|"), "<" in line.replace("\\<", ""), "\r" in line) for line in lines]


@place
def summary(text: str, stranger: Stranger, folder: Path) -> object:
    lines = describe(summarise(make_case(run=SHORT).but(title=text)))
    return len(lines.splitlines()), [line.isprintable() for line in lines.split("\n")]


@place
def archive_of_a_run(text: str, stranger: Stranger, folder: Path) -> object:
    """The names of its files, which are those that it lists, unchanged."""
    run = stranger(text)
    manifest = json.loads((run / "manifest.json").read_text())
    manifest |= {"platform": text, "engine": {**manifest["engine"], "sha256": text}}
    write_json(run / "manifest.json", manifest)
    with zipfile.ZipFile(write_archive(run, folder / "archive.zip")) as archive:
        json.loads(archive.read("ro-crate-metadata.json"))
        archive.extractall(folder / "unpacked")
        names = [name.replace(Path(name).name, "") if name.endswith(".toml") else name for name in archive.namelist()]
    call("check", "files", str(folder / "unpacked"), check=True)
    return names


IN_ARCHIVES = ("script", "newline", "shell", "quotes", "no ASCII")
"""Archives take a second."""
TEXTS = [(where, name) for where in PLACES for name in (IN_ARCHIVES if "archive" in where else HOSTILE)]


@pytest.mark.parametrize(("where", "name"), TEXTS)
def test_a_text_changes_nothing_but_itself(where: str, name: str, stranger: Stranger, tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert PLACES[where](HOSTILE[name], stranger, tmp_path / "a") == PLACES[where]("plain", stranger, tmp_path / "b")


# --- paths ------------------------------------------------------------------------------------------------------------


ODD = {
    "all that shells take": '--sp ace; it\'s "so" $(touch executed)`touch executed`;touch executed;&& ${HOME}\\ [a]*?',
    "umlauts, a newline and two hundred characters": "äöü-γ-走\ntwo lines" + "x" * 180,
}
NO_UTF8 = os.fsdecode(b"x\xff")


@pytest.fixture
def case_file(in_folder: Path) -> Path:
    file = in_folder / "base.toml"
    file.write_text(to_toml(document(run=SHORT)))
    (in_folder / "site.toml").write_text("cores = 2\n")
    return file


@pytest.mark.parametrize("name", ODD)
def test_odd_paths_without_a_site_file_are_paths(name: str, case_file: Path, in_folder: Path) -> None:
    odd = ODD[name]
    (in_folder / f"{odd}.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    call("sweep", f"./{odd}.toml", "--out", f"./{odd}", "-j", "1", check=True)
    assert list(load_table(in_folder / odd / odd)["status"]) == ["finished"] * 2
    case = case_file.rename(f"{odd}.toml")
    for command in (("run",), ("plot",), ("export", "--to", "vtk")):
        assert "Traceback" not in call(*command, f"./{case}", "--out", f"./{odd}", check=True).stderr
    assert not list(in_folder.rglob("executed"))


@pytest.mark.parametrize("odd", ["sp ace", "$(x)", "a\nb"])
def test_with_a_site_file_odd_paths_are_refused_before_anything_is_done(
    odd: str, case_file: Path, in_folder: Path
) -> None:
    (in_folder / "plain.toml").write_text('case = "base.toml"\n')
    (in_folder / f"{odd}.toml").write_text('case = "base.toml"\n')
    before = sorted(in_folder.rglob("*"))
    for sweep, out in (("plain.toml", f"./{odd}"), (f"./{odd}.toml", "runs")):
        done = call("sweep", sweep, "--out", out, "--site", "site.toml")
        assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
        assert "expected letters, digits and" in done.stderr
    assert sorted(in_folder.rglob("*")) == before


@pytest.mark.parametrize("command", [f"run base.toml --out {NO_UTF8}", f"run {NO_UTF8}.toml"])
def test_paths_that_are_no_utf8_are_refused_before_anything_is_done(
    command: str, case_file: Path, in_folder: Path
) -> None:
    (in_folder / f"{NO_UTF8}.toml").write_bytes(case_file.read_bytes())
    before = sorted(in_folder.rglob("*"))
    done = subprocess.run([PROGRAM, *command.split()], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert r"x\xff" in done.stderr
    assert "expected UTF-8 text" in done.stderr
    assert sorted(in_folder.rglob("*")) == before


def test_a_folder_that_is_no_utf8_is_refused_before_anything_is_done(case_file: Path, in_folder: Path) -> None:
    """The libraries of the tables take whole paths, and no others."""
    folder = in_folder / NO_UTF8
    folder.mkdir()
    done = subprocess.run([PROGRAM, "run", "../base.toml"], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stderr.splitlines()), list(folder.iterdir())) == (2, 1, [])
    tries: list[Callable[[], object]] = [
        lambda: run_case("base.toml", folder),
        lambda: load_case(f"{NO_UTF8}.toml"),
        lambda: run_case(load_case("base.toml").but(name=NO_UTF8), in_folder),
    ]
    for attempt in tries:
        with pytest.raises(InputError, match=r"x\\xff.*: expected UTF-8 text"):
            attempt()


def test_files_without_a_name_are_refused(case_file: Path, in_folder: Path) -> None:
    """Their stems are the folder and the one above: a sweep would write there."""
    before = sorted(in_folder.rglob("*"))
    for name in ("...toml", "..toml"):
        (in_folder / name).write_text('case = "base.toml"\n')
        for reader in (load_sweep, load_case):
            with pytest.raises(InputError, match=r"expected a name before \.toml"):
                reader(name)
        assert call("sweep", name).returncode == 2
        (in_folder / name).unlink()
    assert sorted(in_folder.rglob("*")) == before
