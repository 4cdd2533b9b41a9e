"""Files for ParaView of a run that goes on."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from signal import SIGINT, SIGKILL

import meshio
import pytest
from tomli_w import dumps as to_toml

import walkers
from tests.conftest import PATIENCE, PROGRAM, brief_pile, call, engines_in, wait_for
from walkers.runs.following import follow_vtk

LISTED = re.compile(r'timestep="(.+?)" .* file="(.+?)"')
"""Time and name of a file in a ``.pvd``."""


@pytest.fixture
def running_pile(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A program that makes a pile in some seconds, in segments of 0.01 s."""
    file = tmp_path / "brief.toml"
    file.write_text(to_toml(brief_pile(duration="0.15 s").document))
    process = subprocess.Popen([PROGRAM, "run", file.name, "-q"], cwd=tmp_path)
    wait_for(lambda: list(tmp_path.glob("runs/*.incomplete/segments/0000*")))
    yield process
    process.kill()
    process.wait()


def listed_in(collection: Path) -> list[tuple[float, Path]]:
    """Times (s) and files that a ``.pvd`` lists; each of the files is complete."""
    listed = []
    for time, name in LISTED.findall(collection.read_text()):
        file = collection.with_name(name)
        meshio.read(file)
        listed.append((float(time), file))
    return listed


def run_in(folder: Path) -> walkers.Run:
    loaded = walkers.load(folder / "brief.toml", folder / "runs")
    assert isinstance(loaded, walkers.Run)
    return loaded


def test_files_grow_with_a_pile_and_end_as_those_of_the_finished_run(
    running_pile: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    numbers = []
    destination = tmp_path / "grown"

    def look(_: object) -> None:
        collection = destination / "walkers.pvd"
        if collection.exists():
            numbers.append(len(listed_in(collection)))

    run = run_in(tmp_path)
    collection = follow_vtk(run.directory, destination, on_progress=look)
    assert running_pile.wait(PATIENCE) == 0
    assert len(set(numbers)) > 1
    assert numbers == sorted(numbers)
    usual = run.export("vtk", tmp_path / "usual").parent
    assert {path.name: path.read_bytes() for path in collection.parent.iterdir()} == {
        path.name: path.read_bytes() for path in usual.iterdir()
    }
    assert [path.name for path in tmp_path.glob(".*")] == []


def test_the_program_follows_a_run_into_a_folder_of_its_name(
    running_pile: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    followed = call(
        "export", "brief.toml", "--format", "vtk", "--follow", check=True, folder=tmp_path
    )
    name = run_in(tmp_path).directory.name
    assert followed.stdout == f"{name}-vtk/walkers.pvd\n"
    assert f"{name}-vtk: " in followed.stderr
    assert listed_in(tmp_path / f"{name}-vtk" / "walkers.pvd")


def test_an_interrupted_run_is_followed_to_its_last_complete_segment(
    running_pile: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    wait_for(lambda: list(tmp_path.glob("runs/*.incomplete/segments/0004")))
    running_pile.send_signal(SIGINT)
    running_pile.wait(PATIENCE)
    done = call("export", "brief.toml", "--format", "vtk", "-f", check=True, folder=tmp_path)
    assert re.search(r"segments 1 to \d+ of \d+: the run is interrupted", done.stderr)
    times = [time for time, _ in listed_in(tmp_path / done.stdout.strip())]
    assert times[0] == 0.0
    assert 0.0 < times[-1] < 0.15


def test_a_run_that_ends_before_its_drive_has_nothing_to_follow(
    running_pile: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    running_pile.send_signal(SIGKILL)
    running_pile.wait()
    for engine in engines_in(tmp_path):
        os.kill(engine, SIGKILL)
    wait_for(lambda: not engines_in(tmp_path))
    for segment in sorted(tmp_path.glob("runs/*.incomplete/segments/*"))[1:]:
        segment.rename(tmp_path / segment.name)
    done = call("export", "brief.toml", "--format", "vtk", "--follow", folder=tmp_path)
    assert done.returncode == 2
    assert done.stderr.endswith("no segment of its drive is complete yet\n")
    assert not list(tmp_path.glob("*-vtk"))


def test_a_finished_run_is_exported_as_usual(pile_run: Path, tmp_path: Path) -> None:
    to = tmp_path / "to"
    done = call("export", str(pile_run), "--format", "vtk", "--follow", "-o", str(to), check=True)
    assert done.stdout == f"{to}/walkers.pvd\n"


def test_other_forms_are_not_followed(pile_run: Path) -> None:
    done = call("export", str(pile_run), "--format", "csv", "--follow")
    assert done.returncode == 2
    assert done.stderr == "walkers: --follow: is for --format vtk\n"


def test_a_folder_of_others_is_refused_before_the_run_is_followed(
    running_pile: subprocess.Popen[bytes], tmp_path: Path
) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    done = call("export", "brief.toml", "--format", "vtk", "-f", "-o", "mine", folder=tmp_path)
    assert done.returncode == 2
    assert "it holds notes.txt" in done.stderr
    assert running_pile.poll() is None
