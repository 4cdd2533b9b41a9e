"""Runs that are looked at before they are finished: their logs, pictures and exports."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from signal import SIGKILL

import numpy as np
import pytest
from PIL import Image
from tomli_w import dumps as to_toml

import walkers
from tests.conftest import (
    LONG,
    PATIENCE,
    PROGRAM,
    FillOnce,
    brief_pile,
    call,
    document,
    engines_in,
    make_case,
    wait_for,
)
from walkers.postprocess.measure.motion import read_motion
from walkers.postprocess.show.start import (
    NOTHING_HAS_RUN,
    drive_directions,
    motion_at_start,
    walls_by_size,
)
from walkers.runner.run_directory import unfinished, write_case

FIRST_HEADING = "==> segments/0000/engine.log <=="
"""First line of a log."""


@pytest.fixture
def pile_file(tmp_path: Path) -> Path:
    """The file of a pile that runs for some seconds, longer than a program takes to start."""
    file = tmp_path / "brief.toml"
    file.write_text(to_toml(brief_pile(duration="0.15 s").document))
    return file


def _headings(log: str) -> list[str]:
    return [line for line in log.splitlines() if line.startswith("==> ")]


def test_the_log_of_a_pile_is_followed_to_its_end(pile_file: Path) -> None:
    folder = pile_file.parent
    run = subprocess.Popen([PROGRAM, "run", pile_file.name, "-q"], cwd=folder)
    wait_for(lambda: list(folder.glob("runs/*/segments/0000*/engine.log")))
    followed = call("log", pile_file.name, "--follow", check=True, folder=folder)
    assert run.wait(PATIENCE) == 0
    whole = call("log", pile_file.name, check=True, folder=folder).stdout
    assert followed.stdout == whole
    segments = sorted(folder.glob("runs/*/segments/*"))
    assert _headings(whole) == [f"==> segments/{path.name}/engine.log <==" for path in segments]


def test_an_interrupted_run_has_a_log(tmp_path: Path) -> None:
    (tmp_path / "long.toml").write_text(to_toml(document(run=LONG)))
    program = subprocess.Popen([PROGRAM, "run", "long.toml", "-q"], cwd=tmp_path)
    wait_for(lambda: list(tmp_path.glob("runs/*/segments/0000.new/*.bin")))
    os.kill(program.pid, SIGKILL)
    program.wait()
    wait_for(lambda: not engines_in(tmp_path))
    run = walkers.load(tmp_path / "long.toml", tmp_path / "runs")
    assert isinstance(run, walkers.Run)
    assert run.log().startswith(f"{FIRST_HEADING}\nLIGGGHTS ")
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


def test_render_draws_the_start_before_any_run(in_folder: Path) -> None:
    done = call("render", "fig1b", check=True)
    assert done.stdout == "fig1b-start.png\n"
    assert done.stderr == f"walkers: fig1b: {NOTHING_HAS_RUN}\n"
    assert [path.name for path in in_folder.iterdir()] == ["fig1b-start.png"]
    with Image.open("fig1b-start.png") as picture:
        red, _, blue = np.asarray(picture.convert("RGB"), dtype=float).transpose(2, 0, 1)
    assert (red > blue + 60.0).mean() > 0.1  # the walker
    call("render", "pile-ci", "--to", "there/pile.png", "-q", check=True)
    assert Path("there/pile.png").is_file()


def test_pictures_of_one_time_cannot_be_several(in_folder: Path) -> None:
    done = call("render", "fig1b", "--images", "3")
    assert done.returncode == 2
    assert done.stderr == f"walkers: --images: {NOTHING_HAS_RUN}\n"
    assert not list(in_folder.iterdir())


def test_the_start_is_where_the_engine_starts(run_directory: Callable[..., Path]) -> None:
    motion = read_motion(run_directory())
    start = motion_at_start(motion.case)
    assert start.position[0] == pytest.approx(motion.position[0], abs=1e-12)
    assert start.radius == pytest.approx(motion.radius)
    assert start.walkers == motion.walkers


@pytest.mark.parametrize(
    ("boundary", "names"),
    [
        ({"shape": "box"}, {"floor", "-x", "+x", "-y", "+y"}),
        ({"shape": "cylinder", "width": "6 mm"}, {"floor", "side"}),
    ],
)
def test_walls_are_named_where_they_are(boundary: dict[str, str], names: set[str]) -> None:
    tables = brief_pile().document
    case = walkers.load_case({**tables, "boundary": {**tables["boundary"], **boundary}})
    named = walls_by_size(motion_at_start(case))
    assert {wall.name for wall in named} == names
    half = case.boundary.inner_width / 2.0
    for wall in named:
        outward = -wall.normal
        limit = 0.0 if wall.name == "floor" else half
        assert wall.middle @ outward == pytest.approx(limit, rel=0.01)
        if wall.name[0] in "+-":
            sign = 1.0 if wall.name[0] == "+" else -1.0
            assert outward["xyz".index(wall.name[1])] == pytest.approx(sign)


def test_harmonics_of_one_direction_have_one_arrow() -> None:
    harmonic = {"frequency": "80 Hz", "peak_acceleration": "2 g"}
    first = {**harmonic, "axis": "z"}
    second = {**harmonic, "axis": "z", "frequency": "160 Hz"}
    along = {**harmonic, "axis": "x"}
    tables = {**document(), "drive": {"harmonics": [first, second, along]}}
    directions = drive_directions(walkers.load_case(tables))
    assert [direction.tolist() for direction in directions] == [[0, 0, 1], [1, 0, 0]]


@pytest.fixture(scope="session")
def killed_pile(once: FillOnce) -> Path:
    """The folder of a brief pile that was killed during its drive; its case is ``brief.toml``."""

    def run_and_kill(folder: Path) -> None:
        case = brief_pile(duration="10 s").document
        (folder / "brief.toml").write_text(to_toml(case))
        program = subprocess.Popen([PROGRAM, "run", "brief.toml", "-q"], cwd=folder)
        wait_for(lambda: list(folder.glob("runs/*/segments/0004")))
        os.kill(program.pid, SIGKILL)
        program.wait()
        wait_for(lambda: not engines_in(folder))

    return once("killed-pile", run_and_kill)


def test_pictures_of_a_killed_pile_show_its_complete_segments(
    killed_pile: Path, in_folder: Path
) -> None:
    out = killed_pile / "runs"
    before = sorted(out.rglob("*"))
    complete = len(list(out.glob("*/segments/[0-9][0-9][0-9][0-9]")))
    case = str(killed_pile / "brief.toml")
    for command, files in {
        "render": ["series.png"],
        "plot": ["climb.png"],
        "report": ["report.html"],
    }.items():
        done = call(command, case, "--runs", str(out), check=True)
        assert done.stdout.splitlines() == [f"brief-so-far/{name}" for name in files]
        assert f"brief: segments 1 to {complete} of " in done.stderr
        assert done.stderr.endswith(": the run is interrupted\n")
    assert f"(segments 1 to {complete} of " in Path("brief-so-far/report.html").read_text("utf-8")
    assert sorted(out.rglob("*")) == before


def test_the_view_of_a_killed_pile_has_its_beads(killed_pile: Path) -> None:
    run = walkers.load(killed_pile / "brief.toml", killed_pile / "runs")
    assert isinstance(run, walkers.Run)
    with pytest.warns(UserWarning, match=r"brief: segments 1 to \d+ of \d+: "):
        assert run.view().objects


def test_the_total_of_segments_is_that_of_the_finished_run(pile_run: Path, tmp_path: Path) -> None:
    place = tmp_path / pile_run.name
    incomplete = unfinished(place)
    shutil.copytree(pile_run, incomplete, ignore=shutil.ignore_patterns("manifest.json"))
    number = len(list(incomplete.glob("segments/*")))
    with pytest.warns(UserWarning, match=f"segments 1 to {number} of {number}: "):
        (picture,) = walkers.Run(place).plot(tmp_path)
    assert picture.is_file()
    assert [path.name for path in tmp_path.glob(".*")] == []


def test_a_run_in_one_segment_has_no_pictures_before_its_end(in_folder: Path) -> None:
    place = in_folder / "runs/test-0123456789ab.incomplete"
    (place / "segments").mkdir(parents=True)
    write_case(place, make_case(run=LONG))
    done = call("render", "test-0123456789ab")
    assert done.returncode == 2
    assert "the run is interrupted; continue it with: walkers run" in done.stderr
