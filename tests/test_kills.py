"""Programs that are killed at any moment, and called again at once."""

import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from tests.conftest import BRIEF, LONG, PROGRAM, document, engines_in, make_case, to_toml, wait_for
from walkers import run as run_case
from walkers.runner import find_engine, finished_run, open_run
from walkers.runner.directory import finished_places
from walkers.runner.locks import is_locked, locked


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


def test_a_crash_within_a_replacement_leaves_no_trace(tmp_path: Path) -> None:
    """Between its two renames the old run is put back; after them it goes, and is no run meanwhile."""
    case = make_case(run=BRIEF)
    place = run_case(case, tmp_path).directory
    left = place.with_name(place.name + ".replaced")
    place.rename(left)
    with open_run(case, find_engine(), tmp_path):
        assert finished_run(place) is not None
    shutil.copytree(place, left)
    assert finished_places(tmp_path) == {place.name: place}
    assert run_case(case, tmp_path).cached
    assert run_case(case, tmp_path, force=True).directory == place
    assert not left.exists()
