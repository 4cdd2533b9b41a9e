"""Programs that are killed at any moment, and called again at once."""

import os
import random
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from tests.conftest import PROGRAM, document, engines_in, make_case, to_toml, wait_for
from walkers import run as run_case
from walkers.inputs.case import Case
from walkers.runner import find_engine, finished_run, open_run
from walkers.runner.locks import is_locked, locked

BRIEF = {"time_step": "2 us", "cycles": 3, "settling_cycles": 1, "samples_per_cycle": 2}
LONG = {"time_step": "2 us", "cycles": 4000, "settling_cycles": 2, "samples_per_cycle": 1}


def _forked(work: Callable[[], object]) -> int:
    """Do something in a process of its own, which spares it the imports; its number."""
    child = os.fork()
    if child:
        return child
    with suppress(BaseException):
        work()
    os._exit(0)


@pytest.mark.parametrize("kills", [6, pytest.param(50, marks=pytest.mark.slow)])
def test_after_each_kill_the_next_call_runs(tmp_path: Path, kills: int) -> None:
    """The launcher is killed before, at and after the birth of its engine; whoever calls then gets the run."""
    draw = random.Random(14)
    for kill in range(kills):
        case = make_case(run={**BRIEF, "cycles": 100, "seed": kill})
        child = _forked(lambda case=case: run_case(case, tmp_path, force=True))  # type: ignore[misc]
        if kill % 2:
            wait_for(lambda: engines_in(tmp_path))
        else:
            time.sleep(draw.uniform(0.0, 0.4))
        os.kill(child, signal.SIGKILL)
        outcome = run_case(case, tmp_path)
        os.waitpid(child, 0)
        assert finished_run(outcome.directory) is not None
        assert not is_locked(outcome.directory)
    wait_for(lambda: not engines_in(tmp_path))
    assert not list(tmp_path.glob("*.incomplete"))
    assert not list(tmp_path.glob("*.lock"))


def test_no_engine_is_orphaned_by_a_kill_at_its_birth(tmp_path: Path) -> None:
    """Decks that would run for minutes: an engine that its launcher's death did not reach would still be there."""
    case, draw = make_case(run=LONG), random.Random(3)
    for kill in range(20):
        folder = tmp_path / str(kill)
        child = _forked(lambda folder=folder: run_case(case, folder))  # type: ignore[misc]
        wait_for(lambda folder=folder: list(folder.glob("*.incomplete/segments/0000.new/engine.log")))  # type: ignore[misc]
        time.sleep(draw.uniform(0.0, 0.02))  # the fork, setpriv, sh and the engine follow within that time
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    wait_for(lambda: not engines_in(tmp_path))
    time.sleep(0.5)  # one that was still being born
    assert not engines_in(tmp_path)


def test_a_lock_that_somebody_has_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("walkers.runner.locks._PATIENCE_SECONDS", 0.1)
    with locked([tmp_path / "x"]) as ours, locked([tmp_path / "x", tmp_path / "y"]) as theirs:
        assert (list(ours), list(theirs)) == ([tmp_path / "x"], [tmp_path / "y"])
        assert is_locked(tmp_path / "x")
    assert not is_locked(tmp_path / "x")
    assert not list(tmp_path.iterdir())


def test_a_closed_terminal_ends_the_engine_and_the_lock(in_folder: Path) -> None:
    (in_folder / "long.toml").write_text(to_toml(document(run=LONG)))
    program = subprocess.Popen([PROGRAM, "run", "long.toml"], stderr=subprocess.PIPE, text=True)
    wait_for(lambda: engines_in(in_folder))
    program.send_signal(signal.SIGHUP)
    _, errors = program.communicate()
    assert program.returncode == 129
    assert errors.splitlines()[-1] == "walkers: the terminal was closed"
    assert not engines_in(in_folder)
    assert not list(in_folder.glob("runs/*.lock"))


def test_nohup_outlives_a_closed_terminal(in_folder: Path) -> None:
    (in_folder / "long.toml").write_text(to_toml(document(run=LONG)))
    program = subprocess.Popen(
        ["nohup", PROGRAM, "run", "long.toml"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    engines = wait_for(lambda: engines_in(in_folder))
    program.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert engines_in(in_folder) == engines
    program.terminate()
    assert program.wait() == 143
    assert not engines_in(in_folder)


def _replaced(case: Case, out: Path) -> tuple[Path, Path]:
    """A finished run, and beside it what a crash within a replacement leaves of the one before."""
    place = run_case(case, out).directory
    left = place.with_name(place.name + ".replaced")
    left.mkdir()
    (left / "manifest.json").write_text((place / "manifest.json").read_text())
    return place, left


def test_a_crash_between_renaming_and_removing_leaves_no_trace(tmp_path: Path) -> None:
    case = make_case(run=BRIEF)
    place, left = _replaced(case, tmp_path)
    assert run_case(case, tmp_path, force=True).directory == place
    assert not left.exists()
    place, left = _replaced(case, tmp_path)
    assert run_case(case, tmp_path).cached
    with open_run(case, find_engine(), tmp_path):
        assert not left.exists()


def test_what_a_replacement_left_is_no_run(tmp_path: Path) -> None:
    from walkers.runner.ensemble import finished_places

    place, _ = _replaced(make_case(run=BRIEF), tmp_path)
    assert finished_places(tmp_path) == {place.name: place}
