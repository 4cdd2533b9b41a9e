"""Run directories and engines: what is there, what is made again, and every failure, provoked for real."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

import walkers
from tests.conftest import (
    BRIEF,
    LONG,
    PATIENCE,
    PROGRAM,
    SHORT,
    brief_pile,
    call,
    document,
    engines_in,
    finished_places,
    make_case,
    open_run,
    processes_in,
    to_toml,
    wait_for,
    wait_for_engines,
)
from walkers import run as run_case
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.runner import binary, failures
from walkers.runner.binary import find_engine, plugin_of
from walkers.runner.directory import (
    FIRST_SEGMENT,
    case_of,
    is_finished,
    is_locked,
    layout_of,
    locked,
    run_place,
    write_deck,
)
from walkers.runner.failures import EngineNeverStarted
from walkers.runner.files import beside
from walkers.runner.launch import _off_the_network, judge, launch
from walkers.runner.manifest import read_manifest
from walkers.sweeps.making import make_runs
from walkers.templates.deck import Deck, Segment, render_deck, whole

PATIENCE_OF_LOCKS = "walkers.runner.directory._PATIENCE_SECONDS"


def _toml(folder: Path, **run: object) -> str:
    file = folder / "test.toml"
    file.write_text(to_toml(document(run=run or SHORT)))
    return str(file)


# --- what is there ----------------------------------------------------------------------------------------------------


def test_the_name_depends_on_what_determines_the_run() -> None:
    def name(**changes: object) -> str:
        return run_place(make_case(**changes), find_engine(), Path()).name

    names = {
        name(),
        name(drive={"peak_acceleration": "4.01 g"}),
        name(run={"seed": 2}),
        name(contact={"rolling_friction": 0.001}),
        name(run={"cycles": 61}),
        name(drive={"frame": "lab"}),
    }
    assert len(names) == 6
    assert name(title="another title") == name()
    other = replace(find_engine(), sha256="0" * 64)
    assert run_place(make_case(), other, Path()).name != name()
    long = run_place(make_case().but(name="a b/" * 100), other, Path()).name
    assert len(long) < 100
    assert "/" not in long


def test_contents_of_a_run_directory(tmp_path: Path) -> None:
    """And the deck can be run by hand, with the same numbers."""
    case = make_case(run=SHORT)
    run = run_case(case, tmp_path / "runs").directory
    assert is_finished(run)
    assert {path.name for path in run.iterdir()} == {
        *("case.json", "manifest.json", "result.json", "segments"),
        *("trajectory.parquet", "walkers.parquet", "bridges.parquet", "cycles.parquet"),
    }
    assert {path.name for path in (run / "segments").iterdir()} == {"0000"}
    assert {path.name for path in (run / FIRST_SEGMENT).iterdir()} == {
        *("layout.json", "walker.lig", "bridges.txt", "engine.log", "segment.json", "run.sh"),
        *("beads.bin", "bridges.pairs.txt", "bridges.walls.txt"),
    }
    assert case_of(run) == case
    assert layout_of(run / FIRST_SEGMENT) == render_deck(case).layout
    manifest = read_manifest(run)
    assert (manifest["status"], manifest["steps"]) == ("finished", case.run.steps)
    assert manifest["steps_per_second"] > 0
    assert manifest["engine"]["sha256"] == find_engine().sha256
    assert {"host", "started", "finished", "seconds"} <= set(manifest)
    by_hand = tmp_path / "byhand"
    call("export", _toml(tmp_path), "--to", "deck", "-o", str(by_hand), check=True)
    subprocess.run(["sh", "run.sh"], cwd=by_hand, check=True)
    assert (by_hand / "beads.bin").read_bytes() == (run / FIRST_SEGMENT / "beads.bin").read_bytes()


def test_a_run_is_found_by_its_directory_its_name_or_its_case_with_other_values_too(in_folder: Path) -> None:
    case_file = _toml(in_folder)
    first, second = (json.loads(call("run", case_file, "--json", check=True).stdout) for _ in range(2))
    assert (first["cached"], second["cached"]) == (False, True)
    assert first["velocity"] == second["velocity"]
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert walkers.load(named).directory == Path(first["run"])
        assert f"{first['velocity'] * 1e3:.3f}" in call("run", str(named), check=True).stdout
    setting = ("--set", "drive.frequency=70Hz")
    assert f"first do: walkers run {case_file} --set drive.frequency=70Hz" in call("plot", case_file, *setting).stderr
    slower = json.loads(call("run", first["run"], *setting, "--json", check=True).stdout)
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert walkers.load(named, "runs", {"drive.frequency": "70 Hz"}).directory == Path(slower["run"])
        assert json.loads(call("run", named, *setting, "--json", check=True).stdout)["cached"]
        assert "70Hz" in call("show", named, *setting, check=True).stdout
    assert walkers.run(case_file, "runs").directory == walkers.run(first["run"]).directory == Path(first["run"])


def test_a_running_simulation_is_looked_at_stopped_and_continued(in_folder: Path) -> None:
    case_file = _toml(in_folder, **LONG)
    program = subprocess.Popen([PROGRAM, "run", case_file], stderr=subprocess.DEVNULL)
    wait_for(lambda: list(Path("runs").glob("*.incomplete/case.json")))
    (place,) = Path("runs").glob("*.lock")
    run = walkers.load(place.with_suffix(""))
    assert isinstance(run, walkers.Run)
    wait_for(lambda: run.progress and run.progress.share > 2 / run.case.run.cycles)
    assert (run.status, walkers.load(case_file).status, len(engines_in(in_folder))) == ("running", "running", 1)
    assert "running: " in call("list", check=True).stdout
    assert f"{run.directory}: the run is running: " in call("plot", case_file).stderr
    program.send_signal(signal.SIGINT)
    assert program.wait(30) == 130
    assert (run.status, run.progress, engines_in(in_folder)) == ("interrupted", None, [])
    refused = call("plot", f"{run.directory}.incomplete").stderr
    assert f"the run is interrupted; continue it with: walkers run {run.directory}" in refused
    stopped = call("run", str(run.directory), "--limit", "0.2")
    assert (stopped.returncode, "time limit of 0.2 s" in stopped.stderr) == (1, True)
    assert (run.status, "time limit of 0.2 s" in run.describe()) == ("failed", True)


@pytest.mark.parametrize("out", ["test.toml/x", "/proc/x"])
def test_places_that_cannot_be_written(in_folder: Path, out: str) -> None:
    done = call("run", _toml(in_folder), "--out", out)
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert done.stderr.startswith("walkers: ")


# --- again, and on ----------------------------------------------------------------------------------------------------


def test_a_finished_run_is_run_again_by_force_only(tmp_path: Path) -> None:
    """One by force that fails leaves the old one."""
    case = make_case(run=SHORT)
    first = run_case(case, tmp_path)
    again = run_case(case, tmp_path)
    assert (first.cached, again.cached) == (False, True)
    assert again.result == first.result
    dump = first.directory / FIRST_SEGMENT / "beads.bin"

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    with dump.open("rb") as before:  # as long as it is open no other file gets its number
        with pytest.raises(KeyboardInterrupt):
            make_runs([case], tmp_path, find_engine(), force=True, on_progress=interrupt)
        assert run_case(case, tmp_path).cached
        assert os.path.samestat(os.fstat(before.fileno()), dump.stat())
        contents = dump.read_bytes()
        assert not run_case(case, tmp_path, force=True).cached
        assert not os.path.samestat(os.fstat(before.fileno()), dump.stat())
    assert dump.read_bytes() == contents, "the same to the last bit"
    assert [path.name for path in tmp_path.iterdir()] == [first.directory.name]


def test_a_run_that_somebody_else_finished_meanwhile_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = make_case(run=SHORT)
    written = (run_case(case, tmp_path).directory / "manifest.json").stat().st_mtime_ns
    # It is not there at the first look, but at the second, after the run has been locked.
    answers, at_last = iter([False]), is_finished
    monkeypatch.setattr("walkers.runner.directory.is_finished", lambda place: next(answers, at_last(place)))
    outcome = run_case(case, tmp_path)
    assert not list(answers)  # the first look has been
    assert (outcome.directory / "manifest.json").stat().st_mtime_ns == written
    assert not list(tmp_path.glob("*.incomplete"))


def test_a_crash_within_a_replacement_leaves_no_trace(tmp_path: Path) -> None:
    """Between its two renames the old run is put back; after them it goes, and is no run meanwhile."""
    case = make_case(run=BRIEF)
    place = run_case(case, tmp_path).directory
    left = place.with_name(place.name + ".replaced")
    place.rename(left)
    with open_run(case, find_engine(), tmp_path):
        assert is_finished(place)
    shutil.copytree(place, left)
    assert finished_places(tmp_path) == {place.name: place}
    assert run_case(case, tmp_path).cached
    assert run_case(case, tmp_path, force=True).directory == place
    assert not left.exists()


# --- locks and kills --------------------------------------------------------------------------------------------------


def test_a_lock_that_somebody_has_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PATIENCE_OF_LOCKS, 0.1)
    with locked([tmp_path / "x"]) as ours, locked([tmp_path / "x", tmp_path / "y"]) as theirs:
        assert (list(ours), list(theirs)) == ([tmp_path / "x"], [tmp_path / "y"])
        assert is_locked(tmp_path / "x")
    assert not is_locked(tmp_path / "x")
    assert not list(tmp_path.iterdir())


def test_tables_are_run_as_their_file_is(tmp_path: Path, run_directory: Callable[..., Path]) -> None:
    found = walkers.run(document(run=SHORT), tmp_path)
    assert found.result["velocity"] == walkers.load(run_directory(run=SHORT)).result["velocity"]
    with pytest.raises(InputError, match=r"no finished run .*; first do: walkers run case --set run\.seed=3"):
        walkers.load(document(run=SHORT), tmp_path, {"run.seed": 3})


Front = Callable[[str], str]


def _launch(
    case: Case,
    out: Path,
    change: Callable[[str], str] = str,
    *,
    engine: str | None = None,
    time_limit: float | None = None,
    **bounds: float,
) -> None:
    """Make a run whose decks are changed, perhaps with other bounds of the engine."""

    def render(case: Case, segment: Segment) -> Deck:
        deck = render_deck(case, segment)
        return replace(deck, text=change(deck.text), **bounds)  # type: ignore[arg-type]

    with open_run(case, find_engine(engine), out) as run:
        run.make(render=render, time_limit=time_limit)


def _reason(out: Path) -> str:
    """Why a run failed, as the one unfinished directory says that it leaves."""
    (part,) = out.glob("*.incomplete")
    assert not list(out.glob("*/manifest.json"))
    return str(json.loads((part / "failure.json").read_text())["reason"])


# --- before the engine starts -----------------------------------------------------------------------------------------


def test_engine_missing(tmp_path: Path) -> None:
    with pytest.raises(failures.EngineMissing, match="apt-get install liggghts"):
        run_case(make_case(), tmp_path / "runs", engine="no-such-liggghts")
    assert not (tmp_path / "runs").exists()


def test_a_binary_that_says_to_be_another_version_is_never_started(front: Front, tmp_path: Path) -> None:
    engine = front('# LIGGGHTS-PUBLIC 3.9.1, compiled\ntouch ../../../../started\nexec liggghts "$@"')
    with pytest.raises(failures.OtherEngine, match=r"3\.9\.1"):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=engine)
    assert not (tmp_path / "started").exists()


def test_a_contact_model_that_cannot_be_compiled_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a compiler, and with one that fails; nothing stays in the cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "bin").mkdir()
    for program in filter(None, map(shutil.which, ("liggghts", "mpicxx", "ldd", "sh", "bash"))):
        (tmp_path / "bin" / Path(program).name).symlink_to(program)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(failures.ContactModelMissing, match=r"apt-get install g\+\+ libliggghts-dev libopenmpi-dev"):
        plugin_of(find_engine())
    compiler = tmp_path / "bin" / "g++"
    compiler.write_text("#!/bin/sh\necho 'bridge.cpp:1: error: no such thing' >&2\nexit 1\n")
    compiler.chmod(0o755)
    with pytest.raises(failures.ContactModelMissing, match=r"the compiler says: .*no such thing"):
        plugin_of(find_engine())
    assert not list((tmp_path / "cache").rglob("*.so"))


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A contact model in a cache of the test's own, of sources that are compiled in a fraction of a second."""
    sources = tmp_path / "engine"
    sources.mkdir()
    shutil.copy(binary.SOURCES / "bridge.map", sources)
    (sources / "table.h").touch()
    (sources / "bridge.cpp").write_text("// FORCES_VERSION 1\nint small = 1;\n")
    monkeypatch.setattr(binary, "SOURCES", sources)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return plugin_of(find_engine())


def _grown(model: Path) -> None:
    with model.open("ab") as file:
        file.write(b"planted")


def _linked(model: Path) -> None:
    model.symlink_to(model.rename(model.with_name("other.so")))


def _of_another_user(model: Path) -> None:
    if os.geteuid():
        pytest.skip("only root can give files away")
    os.chown(model, 12345, 12345)


def _unlike_its_name(model: Path) -> None:
    record = model.with_suffix(".json")
    record.write_text(json.dumps({**json.loads(record.read_text()), "compiled_from": "0" * 64}))


UNTRUSTED: dict[str, Callable[[Path], object]] = {
    "planted": _grown,
    "cut": lambda model: os.truncate(model, 5000),
    "empty": lambda model: os.truncate(model, 0),
    "a symbolic link": _linked,
    "of another user": _of_another_user,
    "writable by others": lambda model: model.chmod(0o777),
    "writable by the group": lambda model: model.chmod(0o775),
    "without a checksum": lambda model: model.with_suffix(".json").unlink(),
    "a checksum that others can write": lambda model: model.with_suffix(".json").chmod(0o666),
    "compiled from something else": _unlike_its_name,
    "in a folder that others can write": lambda model: model.parent.chmod(0o777),
}


@pytest.mark.parametrize("name", UNTRUSTED)
def test_a_contact_model_that_may_not_be_the_compiled_is_compiled_anew(name: str, model: Path) -> None:
    right, before = model.read_bytes(), model.stat().st_ino
    assert plugin_of(find_engine()) == model
    assert model.stat().st_ino == before, "what is right is not compiled again"
    UNTRUSTED[name](model)
    assert plugin_of(find_engine()) == model
    assert model.read_bytes() == right
    assert model.lstat().st_ino != before
    about = model.lstat()
    assert (about.st_uid, about.st_mode & 0o022, model.parent.stat().st_mode & 0o022) == (os.geteuid(), 0, 0)


def test_the_cache_of_another_user_is_refused(model: Path) -> None:
    if os.geteuid():
        pytest.skip("only root can give files away")
    os.chown(model.parent, 12345, 12345)
    with pytest.raises(failures.ContactModelMissing, match=r"belongs to another user.*set XDG_CACHE_HOME"):
        plugin_of(find_engine())


def test_a_cache_that_cannot_be_used_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without one, without a home of a user whom the system does not know."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(failures.ContactModelMissing, match=r"cannot be written .*set XDG_CACHE_HOME"):
        plugin_of(find_engine())
    if os.geteuid():
        pytest.skip("only root can become another user")
    with subprocess.Popen([sys.executable, "-c", NOBODY], stdout=subprocess.PIPE, text=True) as program:
        told, _ = program.communicate()
    assert re.search("cannot be written .*set XDG_CACHE_HOME", told)


NOBODY = """
import os
from walkers.runner.binary import find_engine, plugin_of
from walkers.runner.failures import ContactModelMissing
for name in ("HOME", "XDG_CACHE_HOME"):
    os.environ.pop(name, None)
os.setuid(12345)
try:
    plugin_of(find_engine())
except ContactModelMissing as failure:
    print(failure)
"""


def test_another_version_of_the_forces_is_another_engine_within_a_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(binary.SOURCES, tmp_path / "engine")
    monkeypatch.setattr(binary, "SOURCES", tmp_path / "engine")
    before, source = find_engine(), tmp_path / "engine" / "bridge.cpp"
    text = source.read_text()
    source.write_text(f"{text}// another line\n")
    assert find_engine() == before
    source.write_text(re.sub(r"FORCES_VERSION \d+", "FORCES_VERSION 0", text))
    assert find_engine() != before


# --- decks and engines that fail --------------------------------------------------------------------------------------


def _half(text: str) -> str:
    return re.sub(
        r"^(run +|variable +cycles string )(\d+)",
        lambda found: f"{found[1]}{int(found[2]) // 2}",
        text,
        flags=re.MULTILINE,
    )


def _narrow(text: str) -> str:
    """A box whose wall stands half a millimetre ahead of the walker."""
    (start,) = set(re.findall(r"create_atoms +1 single (\S+)", text)[:1])
    return re.sub(r"(region +box block \S+) \S+", r"\1 0.0010", text).replace(start, "0.0005")


# A force that becomes infinity minus infinity a few hundred steps on.
INFINITE = "variable bad equal (step>300)*(1e308*100-1e308*100)\nfix bad all addforce v_bad 0 0\nfix motion"
FAST = {"drive": {"peak_acceleration": "8 g"}, "run": {"cycles": 60, "settling_cycles": 2}}
UNSTABLE = {
    "liquid": {"name": "glycerol 87 %"},
    "run": {"time_step": "30 us", "allow_unstable": True, "samples_per_cycle": 1, "cycles": 60, "settling_cycles": 2},
}
BAD_DECKS: dict[str, tuple[dict[str, object], Callable[[str], str], type[failures.EngineFailure], str]] = {
    "an error": (
        {"run": SHORT},
        lambda text: re.sub("run  ", "wobble  ", text),
        failures.EngineError,
        "Unknown.*wobble",
    ),
    "an error in bytes": (
        {"run": SHORT},
        lambda text: re.sub("run  ", "w\udcff\udcfebble  ", text),
        *(failures.EngineError, r"Unknown command: w\\xff\\xfebble"),
    ),
    "half of the steps": ({"run": SHORT}, _half, failures.MissingFrames, "31 of 61 frames"),
    "beads that are lost": (FAST, _narrow, failures.BeadsLost, "left the simulation box"),
    "a large time step": (UNSTABLE, str, failures.BlowUp, "time step"),
    "no numbers": ({"run": SHORT}, lambda text: re.sub("fix +motion", INFINITE, text), failures.BlowUp, "not a number"),
    "a long one": ({"run": LONG}, str, failures.TimeLimitExceeded, r"0\.6 s"),
}


@pytest.mark.parametrize("name", BAD_DECKS)
def test_decks_that_fail(tmp_path: Path, name: str) -> None:
    changes, change, kind, told = BAD_DECKS[name]
    limit = 0.6 if kind is failures.TimeLimitExceeded else None
    with pytest.raises(kind, match=told) as failure:
        _launch(make_case(**changes), tmp_path, change, time_limit=limit)
    assert failure.value.directory == next(tmp_path.glob("*.incomplete/segments/0000.new"))
    assert _reason(tmp_path) == kind.__name__
    assert not engines_in(tmp_path)


# After the banner's version an engine may say nothing or too much, and not care for SIGTERM.
STRANGE_ENGINES = {
    "another version": (
        'liggghts "$@" | sed "s/LIGGGHTS-PUBLIC 3.8.0/LIGGGHTS-PUBLIC 4.0.0/"',
        *(failures.OtherEngine, r"4\.0\.0.*3\.8\.0"),
    ),
    "crashes": ("kill -SEGV $$", failures.EngineKilled, "SIGSEGV"),
    "is killed": ('liggghts "$@" & sleep 0.3; kill -KILL $$', failures.EngineKilled, "SIGKILL"),
    "cuts a dump": ('liggghts "$@" && truncate -s -5 bridges.pairs.txt', failures.MissingFrames, r"wrote \d+ of"),
    "empties a dump": ('liggghts "$@" && truncate -s 0 bridges.walls.txt', failures.MissingFrames, "wrote 0 of"),
    "ends without a word": ("exit 7", failures.EngineFailure, "exit status 7, without output"),
    "says nothing": (
        "trap '' TERM; while :; do sleep 0.1; done",
        *(failures.EngineSilent, r"nothing for 0\.5 s after step 0 of \d+"),
    ),
    "stops saying anything": (
        "liggghts -log none -in walker.lig; exec sleep 4711",
        *(failures.EngineSilent, r"step (\d+) of \1;"),
    ),
    "writes a line without end": ("exec tr '\\0' x < /dev/zero", failures.LogTooLong, "beyond 2 MB"),
    "writes lines without end": ("trap '' TERM; yes | tee -i /dev/null", failures.LogTooLong, "beyond 2 MB"),
    "ends after too long a log": (
        'yes | head -c 2100000; exec liggghts "$@"',
        *(failures.LogTooLong, "beyond 2 MB"),
    ),
}


@pytest.mark.parametrize("name", STRANGE_ENGINES)
def test_strange_engines_are_ended_and_told(front: Front, tmp_path: Path, name: str) -> None:
    script, kind, told = STRANGE_ENGINES[name]
    # An engine starts within seconds even on a busy machine.
    bounds = {"silence": {"says nothing": 0.5, "stops saying anything": 3.0}.get(name, 60.0), "log_limit": 2e6}
    with pytest.raises(kind, match=told) as failure:
        _launch(make_case(run=SHORT), tmp_path / "runs", engine=front(script), time_limit=PATIENCE, **bounds)
    assert "last line" not in str(failure.value)
    wait_for(lambda: not processes_in(tmp_path))
    assert _reason(tmp_path / "runs") == type(failure.value).__name__
    (log,) = tmp_path.glob("runs/*/segments/*/engine.log")
    assert log.stat().st_size <= 2_000_000


def test_an_engine_that_writes_now_and_then_is_not_silent(front: Front, tmp_path: Path) -> None:
    engine = front('for i in 1 2 3; do sleep 0.8; echo; done\nexec liggghts "$@"')
    _launch(make_case(run=SHORT), tmp_path / "runs", engine=engine, silence=2.0)


# --- surroundings -----------------------------------------------------------------------------------------------------


def _path_without(programs: Collection[str], folder: Path) -> str:
    """A PATH with all programs but some."""
    folder.mkdir()
    for place in os.environ["PATH"].split(":"):
        for path in Path(place).glob("*"):
            if path.name not in programs and not (folder / path.name).is_symlink():
                (folder / path.name).symlink_to(path)
    return str(folder)


def test_ranks_need_mpirun_but_neither_ssh_nor_unshare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in containers; without `unshare` it is said that mpirun listens on the network."""
    monkeypatch.setenv("PATH", _path_without(("ssh", "rsh", "unshare"), tmp_path / "bin"))
    _off_the_network.cache_clear()
    try:
        with pytest.warns(UserWarning, match="listens on all networks"):
            assert not run_case(brief_pile(ranks=2), tmp_path / "runs", time_limit=PATIENCE).cached
    finally:
        _off_the_network.cache_clear()
    (tmp_path / "bin" / "mpirun").unlink()
    with pytest.raises(EngineNeverStarted, match=r"run\.ranks = 2 needs mpirun: apt-get install openmpi-bin"):
        run_case(brief_pile(ranks=2), tmp_path / "other")


def test_a_script_of_a_run_starts_the_engine_that_ran(front: Front, tmp_path: Path) -> None:
    engine = front('exec liggghts "$@"')
    run = run_case(make_case(run=SHORT), tmp_path / "runs", engine=engine)
    assert f" {engine} -in " in next(run.directory.rglob("run.sh")).read_text()


def test_a_file_can_be_written_by_many_threads_at_once(tmp_path: Path) -> None:
    barrier = threading.Barrier(2)

    def write(text: str) -> None:
        with beside(tmp_path / "file") as new:
            new.write_text(text)
            barrier.wait(PATIENCE)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(write, ("a", "b")))
    assert (tmp_path / "file").read_text() in ("a", "b")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_failed_run_is_remembered_when_the_spread_of_the_next_one_succeeds(in_folder: Path) -> None:
    guessed = {"contact": {"restitution": 0.3}, "uncertain": {"contact.restitution": [0.2, 0.4]}}
    (in_folder / "hot.toml").write_text(to_toml(document(**UNSTABLE, **guessed)))
    (in_folder / "good.toml").write_text(to_toml(document(run=SHORT, **guessed)))
    done = call("run", "hot.toml", "good.toml", "--spread", "--points", "2", "--json")
    assert done.returncode == 1
    assert "walkers: hot: blow-up" in done.stderr
    (printed,) = map(json.loads, done.stdout.splitlines())
    assert (printed["case"], "spread" in printed) == ("good", True)
    assert call("run", "good.toml", "--spread", "--points", "2").returncode == 0


# --- engines are born -------------------------------------------------------------------------------------------------


def test_of_many_engines_eight_at_a_time_all_start(tmp_path: Path) -> None:
    run = {"time_step": "2 us", "cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1}
    deck, engine = render_deck(make_case(run=run, drive={"frequency": "2 kHz"})), find_engine()

    def start(each: int) -> None:
        directory = tmp_path / str(each)
        directory.mkdir()
        write_deck(deck, directory)
        launch(deck, directory, engine, starts=1)
        shutil.rmtree(directory)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(start, range(16)))


@pytest.mark.parametrize("times", [2, 99])
def test_an_engine_that_never_started_is_tried_twice_again(
    times: int, front: Callable[[str], str], tmp_path: Path
) -> None:
    """The first times it cannot initialise MPI, for it asks for a component there is not."""
    births = tmp_path / "births"
    births.touch()
    fails = f'echo born >> "{births}"\n[ $(wc -l < "{births}") -le {times} ] && export OMPI_MCA_coll=none-such\n'
    engine, case = front(f'{fails}exec liggghts "$@"'), make_case(run=SHORT)
    if times == 2:
        assert run_case(case, tmp_path / "runs", engine=engine).result["velocity"] > 0.0
    else:
        with pytest.raises(EngineNeverStarted, match="never started: exit status"):
            run_case(case, tmp_path / "runs", engine=engine)
        assert "EngineNeverStarted" in next((tmp_path / "runs").glob("*.incomplete/failure.json")).read_text()
    assert births.read_text().count("born") == 3


# --- surroundings -----------------------------------------------------------------------------------------------------


MPI = ("btl=tcp", "pml=cm", "mtl=no", "rmaps=no", "oob=no", "ess=singleton", "orte_default_hostfile=/none")
SURROUNDINGS = {
    "settings of Open MPI": {f"OMPI_MCA_{one.partition('=')[0]}": one.partition("=")[2] for one in MPI},
    "a library to preload that is not there": {"LD_PRELOAD": "/no/such/library.so"},
    "no place for temporary files": {"TMPDIR": "/proc"},
}


@pytest.mark.parametrize("name", SURROUNDINGS)
def test_what_a_user_has_set_in_the_environment_does_not_matter(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin_of(find_engine())  # is there: a compiler needs temporary files
    for variable, value in SURROUNDINGS[name].items():
        monkeypatch.setenv(variable, value)
    assert not run_case(make_case(run=SHORT), tmp_path).cached
    if "MPI" in name:
        assert not run_case(brief_pile(ranks=2), tmp_path, time_limit=PATIENCE).cached


def test_a_launcher_that_was_stopped_does_not_take_that_for_silence(tmp_path: Path) -> None:
    """As a job is that SLURM suspends: launcher and engine stop, and go on together."""
    child = os.fork()
    if not child:
        with suppress(BaseException):
            _launch(make_case(run=LONG), tmp_path, silence=3.0)
        os._exit(0)
    try:
        everybody = [child, *wait_for_engines(tmp_path)]
        for number, seconds in ((signal.SIGSTOP, 4.0), (signal.SIGCONT, 1.0)):
            for process in everybody:
                os.kill(process, number)
            time.sleep(seconds)
        assert os.waitpid(child, os.WNOHANG) == (0, 0)
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        wait_for(lambda: not engines_in(tmp_path))


LOGS: dict[str, tuple[list[tuple[int, int, float]], type[failures.EngineFailure], str]] = {
    # Step, lost beads and speed (m/s) of lines that are read in one look.
    "a step that is printed twice": ([(100, 0, 0.01), (100, 1, 0.01)], failures.EngineFailure, "bead"),
    "a calm line after a failure": (
        [(100, 0, 0.01), (200, 0, 1000.0), (300, 0, 0.01)],
        *(failures.BlowUp, r"moves at 1e\+03 m/s after step 200"),
    ),
}


@pytest.mark.parametrize("name", LOGS)
def test_lines_of_a_log_are_judged(name: str, tmp_path: Path) -> None:
    deck = render_deck(make_case(run=SHORT), whole(make_case(run=SHORT)))
    rows, kind, told = LOGS[name]
    lines = [f" {step} {deck.layout.atoms - lost} {speed} -1e-3 1e-3 -1e-3 1e-3 0 1e-3" for step, lost, speed in rows]
    log = tmp_path / "engine.log"
    log.write_text("\n".join(["LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, x)", *lines, ""]))
    with pytest.raises(kind, match=told):
        judge(deck, tmp_path, log)


def test_limits_of_restitution_and_modulus_are_the_engines(tmp_path: Path) -> None:
    """The last values that the engine takes run. Beyond its largest modulus a deck has to say that beads are hard."""
    quick = {"time_step": "0.4 us", "cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1, "allow_unstable": True}
    last = {"restitution": 0.0501, "youngs_modulus": "1 GPa"}
    case = make_case(contact=last, run=quick, drive={"frequency": "2 kHz"})
    assert not run_case(case, tmp_path).cached
    with pytest.raises(failures.EngineError, match="coefficientRestitution <= 1 required"):
        run_case(case.put("contact.restitution", 0.05), tmp_path)
    assert "hard_particles" not in render_deck(case).text
    with pytest.raises(failures.EngineError, match="youngsModulus <= 1e9 required"):
        _launch(
            case.put("contact.youngs_modulus", 1.001e9),
            tmp_path / "hard",
            lambda text: text.replace("hard_particles  yes", ""),
        )
