"""Runs that are looked at before they are finished: their logs, pictures and exports."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from signal import SIGKILL

import pytest
from tomli_w import dumps as to_toml

import walkers
from tests.conftest import (
    LONG,
    PATIENCE,
    PROGRAM,
    brief_pile,
    call,
    document,
    engines_in,
    wait_for,
)
from walkers.runner.run_directory import write_case

SEGMENTS = [f"==> segments/000{number}/engine.log <==" for number in range(3)]
"""Headings of the segments of a brief pile in its log."""


@pytest.fixture
def pile_file(tmp_path: Path) -> Path:
    """The file of a brief pile."""
    file = tmp_path / "brief.toml"
    file.write_text(to_toml(brief_pile().document))
    return file


def _headings(log: str) -> list[str]:
    return [line for line in log.splitlines() if line.startswith("==> ")]


def test_the_log_of_a_pile_is_followed_to_its_end(pile_file: Path) -> None:
    folder = pile_file.parent
    run = subprocess.Popen([PROGRAM, "run", pile_file.name, "-q"], cwd=folder)
    wait_for(lambda: list(folder.glob("runs/*/segments/0000*/engine.log")))
    followed = subprocess.run(
        [PROGRAM, "log", pile_file.name, "--follow"],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert run.wait(PATIENCE) == 0
    whole = call("log", pile_file.name, check=True, folder=folder).stdout
    assert followed.stdout == whole
    assert _headings(whole) == SEGMENTS


def test_an_interrupted_run_has_a_log(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text(to_toml(document(run=LONG)))
    program = subprocess.Popen([PROGRAM, "run", "long.toml", "-q"], cwd=tmp_path)
    wait_for(lambda: list(tmp_path.glob("runs/*/segments/0000.new/*.bin")))
    os.kill(program.pid, SIGKILL)
    program.wait()
    wait_for(lambda: not engines_in(tmp_path))
    run = walkers.load(tmp_path / "long.toml", tmp_path / "runs")
    assert isinstance(run, walkers.Run)
    assert run.log().startswith(f"{SEGMENTS[0]}\nLIGGGHTS ")
    assert "".join(run.follow_log()) == run.log()


def test_points_of_a_shared_deck_have_its_log(looked_through: Path) -> None:
    directory = next(looked_through.glob("*/shared_deck")).parent
    assert walkers.Run(directory).log().startswith("LIGGGHTS ")


def test_a_run_without_a_log_says_so(tmp_path: Path) -> None:
    place = tmp_path / "runs/brief-0123456789ab.incomplete"
    (place / "segments").mkdir(parents=True)
    write_case(place, brief_pile())
    for options in ([], ["--follow"]):
        done = call("log", "brief-0123456789ab", *options, folder=tmp_path)
        assert done.returncode == 2
        (line,) = done.stderr.splitlines()
        assert line.endswith("the run has no log: the engine has not started yet")
