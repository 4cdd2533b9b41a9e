"""Every failure of a run, provoked for real on the installed engine."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conftest import (
    PATIENCE,
    PROGRAM,
    SHORT,
    call,
    document,
    engines_in,
    make_case,
    mounted,
    processes_in,
    to_toml,
    wait_for,
    wait_for_engines,
)
from walkers import run as run_case
from walkers.inputs import load_case, resolve_case
from walkers.inputs.case import Case
from walkers.inputs.readable import differing, flattened
from walkers.inputs.reading import read_toml, shipped_cases
from walkers.runner import Engine, find_engine, open_run
from walkers.runner.directory import run_name
from walkers.runner.failures import (
    BeadsLost,
    BlowUp,
    ContactModelMissing,
    DiskFull,
    EngineError,
    EngineFailure,
    EngineKilled,
    EngineMissing,
    EngineSilent,
    LogTooLong,
    MissingFrames,
    OtherEngine,
    TimeLimitExceeded,
)
from walkers.runner.launch import Progress, postponed_interrupts
from walkers.runner.plugin import plugin_of
from walkers.templates import Deck, render_deck
from walkers.templates.deck import Segment

LONG = {"cycles": 4000, "settling_cycles": 2, "samples_per_cycle": 1}


def _launch(case: Case, out: Path, change: Callable[[str], str] = str, **options: object) -> None:
    """Make a run whose decks are changed."""

    def render(case: Case, segment: Segment) -> Deck:
        deck = render_deck(case, segment)
        return replace(deck, text=change(deck.text))

    with open_run(case, find_engine(), out) as run:
        run.make(render=render, **options)  # type: ignore[arg-type]


def _remains(out: Path) -> dict[str, str]:
    """What a failed run leaves: one unfinished directory that says why."""
    (part,) = out.glob("*.incomplete")
    assert not list(out.glob("*/manifest.json"))
    failure: dict[str, str] = json.loads((part / "failure.json").read_text())
    return failure


def test_engine_missing(tmp_path: Path) -> None:
    with pytest.raises(EngineMissing, match="apt-get install liggghts"):
        run_case(make_case(), tmp_path / "runs", engine="no-such-liggghts")
    assert not (tmp_path / "runs").exists()


def test_another_version_of_the_engine_is_refused(tmp_path: Path) -> None:
    """The real engine behind a front that changes the version in its banner."""
    front = tmp_path / "liggghts-next"
    front.write_text('#!/bin/sh\nliggghts "$@" | sed "s/LIGGGHTS-PUBLIC 3.8.0/LIGGGHTS-PUBLIC 4.0.0/"\n')
    front.chmod(0o755)
    with pytest.raises(OtherEngine, match=r"4\.0\.0.*3\.8\.0"):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=str(front))


def test_a_binary_that_says_to_be_another_version_is_never_started(tmp_path: Path) -> None:
    front, started = tmp_path / "front", tmp_path / "started"
    front.write_text(f'#!/bin/sh\n# LIGGGHTS-PUBLIC 3.9.1, compiled\ntouch {started}\nexec liggghts "$@"\n')
    front.chmod(0o755)
    with pytest.raises(OtherEngine, match=r"3\.9\.1"):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=str(front))
    assert not started.exists()


def test_a_contact_model_that_cannot_be_compiled_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a compiler, and with one that fails; nothing is started, and nothing stays in the cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    compiler = tmp_path / "bin" / "g++"
    compiler.parent.mkdir()
    needed = [*filter(None, map(shutil.which, ("liggghts", "mpicxx", "ldd", "sh", "bash")))]
    for program in needed:
        (tmp_path / "bin" / Path(program).name).symlink_to(program)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(ContactModelMissing, match=r"apt-get install g\+\+ libliggghts-dev libopenmpi-dev"):
        plugin_of(find_engine())
    compiler.write_text("#!/bin/sh\necho 'bridge.cpp:1: error: no such thing' >&2\nexit 1\n")
    compiler.chmod(0o755)
    with pytest.raises(ContactModelMissing, match=r"the compiler says: .*no such thing"):
        plugin_of(find_engine())
    assert not list((tmp_path / "cache").rglob("*.so"))


def test_error_line_is_quoted(tmp_path: Path) -> None:
    with pytest.raises(EngineError, match=r"ERROR: Unknown command: wobble") as failure:
        _launch(make_case(run=SHORT), tmp_path, lambda text: text.replace("run             ", "wobble          "))
    assert failure.value.line.startswith("ERROR")
    assert failure.value.directory == next(tmp_path.glob("*.incomplete/segments/0000.new"))
    assert _remains(tmp_path)["reason"] == "EngineError"


def test_error_line_with_bytes_that_are_not_utf8(tmp_path: Path) -> None:
    with pytest.raises(EngineError, match=r"Unknown command: w\\xff\\xfebble"):
        _launch(make_case(run=SHORT), tmp_path, lambda text: text.replace("run             ", "w\udcff\udcfebble "))


def test_crash_of_the_engine(tmp_path: Path) -> None:
    front = tmp_path / "front"
    front.write_text("#!/bin/sh\nkill -SEGV $$\n")
    front.chmod(0o755)
    with pytest.raises(EngineKilled, match="SIGSEGV"):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=str(front))
    assert _remains(tmp_path / "runs")["reason"] == "EngineKilled"


def test_engine_killed(tmp_path: Path) -> None:
    def kill_soon() -> None:
        wait_for(lambda: list(tmp_path.glob("*.incomplete/segments/0000.new/beads.bin")))
        for engine in engines_in(tmp_path):
            os.kill(engine, signal.SIGKILL)

    killer = threading.Thread(target=kill_soon)
    killer.start()
    with pytest.raises(EngineKilled, match="SIGKILL") as failure:
        _launch(make_case(run=LONG), tmp_path)
    killer.join()
    assert failure.value.signal == signal.SIGKILL
    assert _remains(tmp_path)["reason"] == "EngineKilled"


def test_exit_without_the_expected_frames(tmp_path: Path) -> None:
    def stop_half_way(text: str) -> str:
        steps = int(re.findall(r"^run +(\d+)", text, re.MULTILINE)[0])
        return text.replace(f"run             {steps}", f"run             {steps // 2}")

    with pytest.raises(MissingFrames, match="31 of 61 frames"):
        _launch(make_case(run=SHORT), tmp_path, stop_half_way)
    assert _remains(tmp_path)["reason"] == "MissingFrames"


@pytest.mark.parametrize(("found", "told"), [(120.9399038, "wrote 120 of 121"), (0.0, "wrote 0 of 121")])
def test_frames_are_told_in_whole_numbers(found: float, told: str, tmp_path: Path) -> None:
    assert told in str(MissingFrames(found, 121, tmp_path))


def test_an_engine_that_says_nothing_is_quoted_with_nothing(tmp_path: Path) -> None:
    silent = tmp_path / "silent"
    silent.write_text("#!/bin/sh\nexit 7\n")
    silent.chmod(0o755)
    with pytest.raises(EngineFailure, match="exit status 7, without a word") as failure:
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=str(silent))
    assert "last words" not in str(failure.value)


@pytest.mark.parametrize("what", ["run long.toml", "sweep sweep.toml"])
def test_an_output_that_was_removed_meanwhile_is_told(what: str, in_folder: Path) -> None:
    (in_folder / "long.toml").write_text(to_toml(document(run=LONG)))
    (in_folder / "sweep.toml").write_text('case = "long.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    with subprocess.Popen([PROGRAM, *what.split()], stderr=subprocess.PIPE, text=True) as program:
        wait_for(lambda: list(in_folder.glob("runs/**/beads.bin")))
        shutil.rmtree(in_folder / "runs", ignore_errors=True)
        _, told = program.communicate()
    assert program.returncode == 1, told
    assert "was removed while it was written" in told
    assert "Traceback" not in told


def test_lost_beads(tmp_path: Path) -> None:
    """A box whose wall stands one and a half millimetres ahead of the walker."""

    def narrow(text: str) -> str:
        return re.sub(r"(region +box block \S+) \S+", r"\1 0.0010", text).replace(
            re.findall(r"create_atoms +1 single (\S+)", text)[0], "0.0005"
        )

    case = make_case(drive={"peak_acceleration": "8 g"}, run={"cycles": 60, "settling_cycles": 2})
    with pytest.raises(BeadsLost, match="left the simulation box"):
        _launch(case, tmp_path, narrow)
    assert _remains(tmp_path)["reason"] == "BeadsLost"


def test_too_large_a_time_step_blows_up(tmp_path: Path) -> None:
    case = make_case(
        liquid={"name": "glycerol 87 %"},
        run={"time_step": "30 us", "allow_unstable": True, "samples_per_cycle": 1, "cycles": 60, "settling_cycles": 2},
    )
    with pytest.raises(BlowUp, match="time step"):
        _launch(case, tmp_path)
    assert _remains(tmp_path)["reason"] == "BlowUp"


def test_a_position_that_is_no_number(tmp_path: Path) -> None:
    """A force that becomes infinity minus infinity a few hundred steps on."""
    bad = "variable        bad equal (step>300)*(1e308*100-1e308*100)\nfix             bad all addforce v_bad 0 0\n"
    with pytest.raises(BlowUp, match="no number"):
        _launch(make_case(run=SHORT), tmp_path, lambda text: text.replace("fix             motion", f"{bad}fix motion"))
    assert _remains(tmp_path)["reason"] == "BlowUp"


@pytest.mark.parametrize("dump", ["bridges.pairs.txt", "bridges.walls.txt"])
@pytest.mark.parametrize("cut", ["0", "-5", "-100"])
def test_dumps_of_bridges_that_are_cut_short(tmp_path: Path, dump: str, cut: str) -> None:
    front = tmp_path / "front"
    front.write_text(f'#!/bin/sh\nliggghts "$@" && truncate -s {cut} {dump}\n')
    front.chmod(0o755)
    with pytest.raises(MissingFrames):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=str(front))


def test_children_that_do_not_care_for_sigterm_are_ended_too(tmp_path: Path) -> None:
    front, deaf = tmp_path / "front", tmp_path / "deaf"
    front.write_text(f'#!/bin/sh\n(trap "" TERM; echo > {deaf}; exec sleep 4711) &\nexec sleep 4711\n')
    front.chmod(0o755)

    def interrupt(_: Progress) -> None:
        if deaf.exists():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=str(front), progress=interrupt)
    wait_for(lambda: not processes_in(tmp_path, b"sleep"))


def test_time_limit(tmp_path: Path) -> None:
    with pytest.raises(TimeLimitExceeded, match=r"0\.6 s"):
        _launch(make_case(run=LONG), tmp_path, time_limit=0.6)
    assert not engines_in(tmp_path)
    assert _remains(tmp_path)["reason"] == "TimeLimitExceeded"


STRANGE_ENGINES = {
    "says nothing": ("exec sleep 4711", EngineSilent, r"nothing for 0\.5 s \(run\.silence\) after step 0 of \d+"),
    "and does not care for SIGTERM": ("trap '' TERM; while :; do sleep 0.1; done", EngineSilent, "nothing for"),
    "stops saying anything": ("liggghts -log none -in walker.lig; exec sleep 4711", EngineSilent, r"step (\d+) of \1,"),
    "writes a line without end": ("exec tr '\\0' x < /dev/zero", LogTooLong, r"beyond 2 MB \(run\.log_limit\)"),
    "writes lines without end": ("exec yes", LogTooLong, "beyond 2 MB"),
    "and does not mind SIGTERM": ("trap '' TERM; yes | tee -i /dev/null", LogTooLong, "beyond 2 MB"),
    "ends after too long a log": ('yes | head -c 2100000; exec liggghts "$@"', LogTooLong, "beyond 2 MB"),
}


@pytest.mark.parametrize("name", STRANGE_ENGINES)
def test_engines_that_say_nothing_or_too_much_are_ended(tmp_path: Path, name: str) -> None:
    script, kind, told = STRANGE_ENGINES[name]
    front = tmp_path / "front"
    front.write_text(f"#!/bin/sh\n{script}\n")
    front.chmod(0o755)
    case = make_case(run={**SHORT, "silence": "0.5 s", "log_limit": "2 MB"})
    with pytest.raises(kind, match=told):
        run_case(case, tmp_path / "runs", engine=str(front), time_limit=PATIENCE)
    wait_for(lambda: not processes_in(tmp_path))
    assert _remains(tmp_path / "runs")["reason"] == kind.__name__
    (log,) = tmp_path.glob("runs/*/segments/*/engine.log")
    assert log.stat().st_size <= 2_000_000


def test_an_engine_that_writes_now_and_then_is_not_silent(tmp_path: Path) -> None:
    """Five times a quarter of what would be silence."""
    front = tmp_path / "front"
    front.write_text('#!/bin/sh\nfor i in 1 2 3 4 5; do sleep 1; echo; done\nexec liggghts "$@"\n')
    front.chmod(0o755)
    run_case(make_case(run={**SHORT, "silence": "4 s"}), tmp_path / "runs", engine=str(front))


def test_a_launcher_that_was_stopped_does_not_take_that_for_silence(tmp_path: Path) -> None:
    """As a job is that SLURM suspends: launcher and engine stop, and go on together."""
    (tmp_path / "long.toml").write_text(to_toml(document(run={**LONG, "silence": "3 s"})))
    command = [PROGRAM, "run", "long.toml"]
    program = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    try:
        everybody = [program.pid, *wait_for_engines(tmp_path, program)]
        for number in (signal.SIGSTOP, signal.SIGCONT):
            for process in everybody:
                os.kill(process, number)
            time.sleep(4.0 if number == signal.SIGSTOP else 1.0)
        assert program.poll() is None
    finally:
        program.terminate()
        program.communicate(timeout=PATIENCE)


def test_bounds_of_the_engine_are_no_matter_of_a_runs_name(tmp_path: Path) -> None:
    """Nor a difference between runs; `walkers show` says them, and with slow decks they are larger."""
    (tmp_path / "a.toml").write_text(to_toml(document(run=SHORT)))
    (tmp_path / "b.toml").write_text(to_toml(document(run={**SHORT, "silence": "20 s", "log_limit": "5 MB"})))
    usual, bounded = (load_case(tmp_path / f"{name}.toml").renamed("same") for name in "ab")
    assert run_name(usual, find_engine()) == run_name(bounded, find_engine())
    assert not differing([flattened(usual.as_dict()), flattened(bounded.as_dict())])
    assert Case.from_dict(bounded.as_dict()).run == bounded.run
    for name, told in (("a", ("600 s", "64 MB")), ("b", ("20 s", "5 MB"))):
        shown = call("show", f"{name}.toml", folder=tmp_path, check=True).stdout
        assert re.findall(r"^    (?:silence|log_limit) +(\S+ \S+)", shown, re.MULTILINE) == list(told)
    slow = make_case(drive={"frequency": "0.01 Hz"}, run={**SHORT, "time_step": "1 us", "samples_per_cycle": 1})
    assert slow.run.longest_silence(slow.count) > 20.0 * 2.7e-6 * slow.run.steps_per_cycle
    long = make_case(run={"cycles": 600_000, "samples_per_cycle": 1})
    assert long.run.most_log > 10.0 * 600_000 * 500.0


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of two megabytes."""
    with mounted(tmp_path / "disk", "2m") as place:
        yield place


def test_no_room_for_the_dump_is_seen_before_the_launch(small_disk: Path) -> None:
    case = make_case(run={"cycles": 600, "samples_per_cycle": 20})
    with pytest.raises(DiskFull, match="disk full"):
        _launch(case, small_disk / "runs")
    assert _remains(small_disk / "runs")["reason"] == "DiskFull"


def test_a_disk_that_fills_up_during_the_run(small_disk: Path) -> None:
    case = make_case(run={"cycles": 180, "settling_cycles": 2, "samples_per_cycle": 20})

    def fill() -> None:
        wait_for(lambda: list(small_disk.glob("runs/*.incomplete/segments/0000.new/beads.bin")))
        with suppress(OSError), (small_disk / "ballast").open("wb", buffering=0) as file:
            while file.write(b"\0" * 4096):
                pass

    filler = threading.Thread(target=fill)
    filler.start()
    with pytest.raises(DiskFull):
        _launch(case, small_disk / "runs")
    filler.join()
    assert not list(small_disk.glob("runs/*/manifest.json"))
    assert not engines_in(small_disk)


def _brief_pile(**run: object) -> Case:
    """Settled and shaken for some hundredths of a second."""
    tables = read_toml(shipped_cases()["pile-ci"])
    tables["run"] = {
        "duration": "0.03 s",
        "time_step": "3 us",
        "longest_settling": "0.02 s",
        "segment": "0.01 s",
        **run,
    }
    return resolve_case(tables, name="brief")


def test_variables_of_open_mpi_that_a_user_has_set_do_not_matter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    variables = {
        "btl": "tcp",
        "pml": "cm",
        "mtl": "nonsense",
        "rmaps": "nonsense",
        "oob": "nonsense",
        "ess": "singleton",
    }
    for name, value in {**variables, "orte_default_hostfile": "/nonexistent"}.items():
        monkeypatch.setenv(f"OMPI_MCA_{name}", value)
    for case in (_brief_pile(ranks=2), make_case(run=SHORT)):
        assert not run_case(case, tmp_path, time_limit=PATIENCE).cached


def test_a_full_folder_of_temporary_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One process needs nothing there; mpirun would have its processes wait for each other without end."""
    with mounted(tmp_path / "tmp", "2m") as place:
        monkeypatch.setenv("TMPDIR", str(place))
        assert not run_case(make_case(run=SHORT), tmp_path / "runs").cached
        with pytest.raises(DiskFull, match=rf"disk full: 16 MB .* are free \(see {place}\)"):
            run_case(_brief_pile(ranks=2), tmp_path / "runs", time_limit=PATIENCE)
    monkeypatch.undo()
    assert not run_case(_brief_pile(ranks=2), tmp_path / "runs", time_limit=PATIENCE).cached


def _fill(place: Path) -> Path:
    """Leave no byte on a file system; the file that takes them."""
    with suppress(OSError), (place / "ballast").open("ab", buffering=0) as file:
        while file.write(b"\0" * 4096):
            pass
    return place / "ballast"


def test_a_pile_that_was_killed_goes_on_when_a_full_disk_has_room_again(tmp_path: Path) -> None:
    """Nothing is lost, and the numbers are those of a pile that nobody stopped."""
    case = _brief_pile(duration="0.1 s")
    with mounted(tmp_path / "disk", "16m") as place:
        child = os.fork()
        if not child:
            with suppress(BaseException):
                run_case(case, place)
            os._exit(0)
        (whole,) = wait_for(lambda: list(place.glob("*.incomplete/segments/0001")))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        wait_for(lambda: not engines_in(place))
        node = (whole / "beads.bin").stat().st_ino
        ballast = _fill(place)
        with pytest.raises(DiskFull, match="disk full"):
            run_case(case, place)
        ballast.unlink()
        done = run_case(case, place)
        assert (done.directory / "segments" / "0001" / "beads.bin").stat().st_ino == node
        assert done.result == run_case(case, tmp_path / "runs").result


def test_a_sweep_on_a_disk_that_is_full_goes_on_when_there_is_room(tmp_path: Path) -> None:
    """One that is full from the start, and one that an engine leaves full, for the tables; then none."""
    (tmp_path / "base.toml").write_text(to_toml(document(run=SHORT)))
    (tmp_path / "test.toml").write_text('case = "base.toml"\n[axes]\nrun.seed = [1, 2]\n')
    front = tmp_path / "front"
    with mounted(tmp_path / "disk", "2m") as place:
        front.write_text(
            f'#!/bin/sh\nliggghts "$@" || exit 1\n[ -e {place}/room ] || cat /dev/zero > {place}/ballast\n'
        )
        front.write_text(front.read_text() + "exit 0\n")
        front.chmod(0o755)
        sweep = ["sweep", "test.toml", "--out", str(place / "runs"), "--engine", str(front), "-j", "1"]
        ballast = _fill(place)
        told = [call(*sweep, folder=tmp_path)]
        ballast.unlink()
        told.append(call(*sweep, folder=tmp_path))
        silent = "warning", " points done"
        lines = [
            [line for line in done.stderr.splitlines() if not any(map(line.__contains__, silent))] for done in told
        ]
        assert [done.returncode for done in told] == [2, 1]
        assert [len(one) for one in lines] == [1, 2]
        assert "No space left on device" in lines[0][0]
        assert all("disk full" in line and str(place) in line for line in lines[1]), lines
        ballast.unlink()
        (place / "room").touch()
        assert "2 finished" in call(*sweep, folder=tmp_path, check=True).stdout
        _fill(place)
        done = call("table", str(place / "runs" / "test"), "--to", str(place / "table.csv"))
        assert (done.returncode, done.stderr) == (2, f"walkers: {place}/table.csv: No space left on device\n")
        subprocess.run(["mount", "-o", "remount,ro", str(place)], check=True)
        for command in (["table", "runs/test", "--to", "table.csv"], ["plot", "runs/test"]):
            done = call(*command, folder=place)
            assert (done.returncode, done.stderr.count("\n")) == (2, 1)
            assert re.fullmatch(r"walkers: [\w/]+\.(csv|png): Read-only file system\n", done.stderr)


def test_an_interrupt_while_the_engine_is_being_started_comes_after() -> None:
    started = False
    with pytest.raises(KeyboardInterrupt), postponed_interrupts():
        signal.raise_signal(signal.SIGINT)
        time.sleep(0.01)
        started = True
    assert started


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupts_stop_the_engine_and_leave_no_run(number: signal.Signals, status: int, in_folder: Path) -> None:
    (in_folder / "long.toml").write_text(to_toml(document(run=LONG)))
    program = subprocess.Popen([PROGRAM, "run", "long.toml"], stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for_engines(in_folder, program)
    program.send_signal(number)
    _, errors = program.communicate(timeout=PATIENCE)
    assert program.returncode == status
    assert errors.splitlines()[-1] == {130: "walkers: interrupted", 143: "walkers: terminated"}[status]
    assert "Traceback" not in errors
    assert not engines_in(in_folder)
    assert not list(in_folder.glob("runs/*/manifest.json"))


def test_a_failed_run_is_reported_and_the_next_one_goes_on(in_folder: Path) -> None:
    (in_folder / "hot.toml").write_text(
        to_toml(
            document(
                liquid={"name": "glycerol 87 %"},
                run={"time_step": "30 us", "allow_unstable": True, "samples_per_cycle": 1, "cycles": 60},
            )
        )
    )
    (in_folder / "good.toml").write_text(to_toml(document(run=SHORT)))
    done = call("run", "hot.toml", "good.toml", "--json")
    assert done.returncode == 1
    assert "walkers: hot: blow-up" in done.stderr
    assert json.loads(done.stdout)["case"] == "good"


def test_every_failure_says_where_its_remains_are(tmp_path: Path) -> None:
    failures = EngineFailure.__subclasses__()
    assert len(failures) >= 9
    assert all(failure.__doc__ for failure in failures)
    assert isinstance(find_engine(), Engine)
