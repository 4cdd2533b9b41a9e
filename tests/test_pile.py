"""Piles by the real engine: settled, shaken, interrupted, on two ranks, in both frames, and what is read from them."""

import json
import os
import shutil
import signal
import subprocess
import threading
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import walkers
from tests.conftest import PROGRAM, call, engines_in, open_run, to_toml, wait_for
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import shipped
from walkers.postprocess.results import measure, read
from walkers.postprocess.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.directory import run_place, segment_directories
from walkers.runner.failures import EngineError, EngineKilled, RunBusy
from walkers.sweeps.scheduler import Options
from walkers.sweeps.site import Slurm
from walkers.templates.deck import Deck, Segment, render_deck


def document(**changes: dict[str, Any]) -> dict[str, Any]:
    tables = tomllib.loads(shipped("case")["pile-ci"].read_text())
    for table, values in changes.items():
        tables.setdefault(table, {}).update(values)
    return tables


def small(**changes: dict[str, Any]) -> Case:
    return Case.read(document(**changes), name="pile-ci")


FloatArray = npt.NDArray[np.float64]
Once = Callable[[str, Callable[[Path], object]], Path]
# Two thirds of the steps of "auto"; the beads are shaken as soon as they have come down.
QUICK = {"time_step": "3 us", "longest_settling": "0.05 s"}
# Three segments of the drive, each as short as it can be and still have frames.
BRIEF = {"duration": "0.045 s", "segment": "0.015 s", **QUICK}
# Restarts must not lose how much liquid each bead has.
OF_BRIEF: dict[str, dict[str, Any]] = {"run": BRIEF, "liquid": {"conserved": True, "law": "willett"}}


@pytest.fixture
def run(pile_run: Path) -> Path:
    return pile_run


def brief() -> Case:
    return Case.read(document(**OF_BRIEF), name="brief")


@dataclass(frozen=True)
class Killed:
    """A folder of runs with a brief pile whose program was killed within its second segment, and its engine.

    Where the folder has a file such as ``halt-0002``, the engine stops in the midst of that segment, once, and the file
    is ``halted-0002`` then.
    """

    out: Path
    engine: str

    @property
    def place(self) -> Path:
        """Where the run is to be."""
        return run_place(brief(), find_engine(self.engine), self.out)

    @property
    def unfinished(self) -> Path:
        """Where it is."""
        return self.place.with_name(self.place.name + ".incomplete")

    def copied(self, out: Path) -> "Killed":
        """The same in a folder that may be changed."""
        shutil.copytree(self.out, out)
        return replace(self, out=out)


HALTING = """#!/bin/sh
segment=$(basename "$PWD" .new)
halt=../../../halt-$segment
if [ -e $halt ]; then
    sed -i 's/^\\(run *\\)[0-9]*/\\1999999999/' walker.lig  # else it may be over before it is stopped
    (while ! [ -e beads.bin ]; do sleep 0.02; done; kill -STOP $$; mv $halt ../../../halted-$segment) &
fi
exec liggghts "$@"
"""


@pytest.fixture(scope="session")
def killed(once: Once) -> Killed:
    """Somebody else calls before the kill: there is a file ``refused`` if that was refused."""

    def make(folder: Path) -> None:
        front, out = folder / "front", folder / "out"
        front.write_text(HALTING)
        front.chmod(0o755)
        out.mkdir()
        (out / "halt-0001").touch()
        (folder / "brief.toml").write_text(to_toml(document(**OF_BRIEF)))
        command = [PROGRAM, "run", str(folder / "brief.toml"), "--out", str(out), "--engine", str(front)]
        program = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            wait_for((out / "halted-0001").exists)
            try:
                walkers.run(brief(), out, engine=str(front))
            except RunBusy:
                (out / "refused").touch()
        finally:
            program.kill()
            program.wait()
        wait_for(lambda: not engines_in(out))

    folder = once("killed-pile", make)
    return Killed(folder / "out", str(folder / "front"))


def test_an_interrupted_pile_goes_on_bit_for_bit(killed: Killed, tmp_path: Path) -> None:
    """Killed while it makes its second segment, and the engine alone while it makes the third.

    Nobody else made it meanwhile. Restart files are kept for the last two parts only.
    """
    assert (killed.out / "refused").exists()
    run = walkers.run(brief(), tmp_path).directory
    begun = killed.copied(tmp_path / "out")
    place, unfinished = begun.place, begun.unfinished
    assert len(segment_directories(unfinished)) == 1
    (begun.out / "halt-0002").touch()

    def kill_the_engine() -> None:
        wait_for((begun.out / "halted-0002").exists)
        for process in engines_in(unfinished):
            os.kill(process, signal.SIGKILL)

    killer = threading.Thread(target=kill_the_engine, daemon=True)
    killer.start()
    with pytest.raises(EngineKilled):
        walkers.run(brief(), begun.out, engine=begun.engine)
    killer.join()
    assert len(segment_directories(unfinished)) == 2
    assert not place.exists()
    walkers.run(brief(), begun.out, engine=begun.engine)
    assert len(segment_directories(run)) == 4
    assert [path.name for path in segment_directories(place)] == [path.name for path in segment_directories(run)]
    for here, there in zip(segment_directories(place), segment_directories(run), strict=True):
        for name in ("beads.bin", "bridges.pairs.txt", "bridges.walls.txt"):
            assert (here / name).read_bytes() == (there / name).read_bytes()
    for name in read(place).about["tables"]:
        assert read_table(place, name).equals(read_table(run, name))
    kept = [(path / "state.restart").exists() for path in segment_directories(place)]
    assert kept == [False, False, True, True]


def test_damaged_piles_are_told_in_a_line(run: Path, tmp_path: Path) -> None:
    def broken(name: str) -> Path:
        place = tmp_path / f"{name}-{run.name}"
        shutil.copytree(run, place)
        return place

    gap, cut, said, lines, lacking = (broken(name) for name in ("gap", "cut", "said", "lines", "lacking"))
    shutil.rmtree(segment_directories(gap)[1])
    dump = segment_directories(cut)[1] / "beads.bin"
    dump.write_bytes(dump.read_bytes()[:-100])
    (segment_directories(said)[1] / "segment.json").write_text("{")
    text = segment_directories(lines)[1] / "bridges.walls.txt"
    text.write_text(text.read_text()[:-200])
    (lacking / "case.json").write_text('{"name": "pile-ci"}')
    vtk = "export --to vtk"
    for command, place in (("plot", lacking), *((vtk, one) for one in (gap, cut, said, lines, lacking))):
        done = call(*command.split(), str(place))
        assert done.returncode == (2 if place == lacking else 1)
        assert str(place) in done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr
    assert call("plot", str(cut)).returncode == 0  # figures are of the tables


def test_looking_before_the_end_leaves_nothing_stale(killed: Killed, tmp_path: Path) -> None:
    begun = killed.copied(tmp_path / "out")
    (begun.unfinished / "failure.json").write_text("{}")
    measure(begun.unfinished)
    assert read(begun.unfinished)["driven"] == 0.0
    assert (read_table(begun.unfinished, "bed")["time"] <= 0.0).all()
    finished = walkers.run(brief(), begun.out, engine=begun.engine)
    assert finished.result["driven"] > 0.04
    assert not (finished.directory / "failure.json").exists()


def written(run: Path) -> dict[str, int]:
    """When the engine wrote the beads of each whole segment, ns."""
    return {path.name: (path / "beads.bin").stat().st_mtime_ns for path in segment_directories(run)}


def test_an_error_of_the_engine_leaves_the_parts_before(tmp_path: Path) -> None:
    case, engine = small(run={**BRIEF, "duration": "0.015 s"}), find_engine(None)
    place = run_place(case, engine, tmp_path)

    def broken(case: Case, segment: Segment) -> Deck:
        deck = render_deck(case, segment)
        return deck if segment.drive_from is None else replace(deck, text=deck.text.replace("nve/sphere", "nve/cube"))

    with pytest.raises(EngineError, match="nve/cube"), open_run(case, engine, tmp_path) as opened:
        opened.make(render=broken)
    unfinished = place.with_name(place.name + ".incomplete")
    assert json.loads((unfinished / "failure.json").read_text())["reason"] == "EngineError"
    kept = written(unfinished)
    assert kept
    finished = walkers.run(case, tmp_path)
    assert kept.items() <= written(finished.directory).items()


def test_ranks_take_cores_of_this_machine_and_of_a_cluster() -> None:
    site = Slurm(cores=8, nodes=2).config()
    assert Options(6, site).for_ranks(2).decks_at_once == 8
    assert Options(6).for_ranks(2).decks_at_once == 3
    with pytest.raises(InputError, match="16 MPI processes"):
        Options(6, site).for_ranks(16)
