"""Programs and engines that are stopped at any moment: nobody is left behind, and the next call gives the same bits."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.cluster import LOCAL
from tests.conftest import (
    BRIEF,
    LONG,
    PATIENCE,
    PROGRAM,
    SHORT,
    bits,
    call,
    document,
    engines_in,
    make_case,
    open_run,
    processes_in,
    to_toml,
    wait_for,
)
from walkers import run as run_case
from walkers.inputs.reading import shipped
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.results import measure, read_results
from walkers.runner.binary import find_engine
from walkers.runner.failures import RunBusy
from walkers.runner.process import ALONE, off_the_network

HALTING = """#!/bin/sh
if [ -n "$HALT" ]; then
    pwd >> "$HALT"/launches
    mkdir "$HALT"/first 2>/dev/null || sed -i 's/^run .*/timestep 1e-12\\nrun 1999999999/' walker.lig
fi
exec liggghts "$@"
"""
"""An engine that does not end, but for the first that starts if there is a folder ``HALT``."""
SETTLING = {
    "time_step": "3 us",
    "longest_settling": "0.02 s",
    "duration": "0.03 s",
    "segment": "0.01 s",
}
FILES: dict[str, dict[str, Any]] = {
    "walker": document(run={**SHORT, "time_step": "2 us", "segment": "25 ms"}),
    # Restarts must not lose how much liquid each bead has.
    "pile": {**read_toml(shipped("case")["pile-ci"]), "run": SETTLING},
    "base": document(run=BRIEF),
    # Three decks, each of two points: another division after a stop would give other bits.
    "sweep": {
        "case": "base.toml",
        "axes": {
            "drive.frequency": ["60 Hz", "70 Hz", "80 Hz"],
            "dimers.angle": ["0 deg", "10 deg"],
        },
    },
}
FILES["pile"]["liquid"] |= {"conserved": True, "law": "willett"}
FILES["pile"]["mixture"] |= {"count": 14, "small": ["0.3 mm"] * 2, "large": ["0.5 mm"] * 2}
SWEEP, SITE = "sweep sweep.toml -j 2", "sweep sweep.toml --site site.py"
STOPS: dict[str, tuple[str, int, str, str, int, str]] = {
    # Command, engines at that time, signals, to whom, exit status, last line.
    "a run, Ctrl-C": ("run walker.toml", 1, "INT", "program", 130, "interrupted"),
    "a run, closed terminal under nohup": (
        "run walker.toml",
        1,
        "HUP TERM",
        "nohup",
        143,
        "terminated",
    ),
    "a run, engine killed": (
        "run walker.toml",
        1,
        "KILL",
        "engine",
        1,
        "the engine was killed by SIGKILL",
    ),
    "a check, Ctrl-C": ("check engine --only restart", 1, "INT", "program", 130, "interrupted"),
    "a pile, killed": ("run pile.toml", 1, "KILL", "program", -9, ""),
    "a sweep, Ctrl-C": (SWEEP, 2, "INT", "group", 130, "interrupted"),
    "a sweep, killed": (SWEEP, 2, "KILL", "program", -9, ""),
    "a sweep, output removed": (SWEEP, 2, "", "output", 1, "was removed while it was written"),
    "pilots, killed": (SITE, 2, "KILL", "program", -9, ""),
}


@pytest.fixture(scope="session")
def undisturbed(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A folder with the files and their runs, which nobody stops."""

    def fill(folder: Path) -> None:
        for name, tables in FILES.items():
            (folder / f"{name}.toml").write_text(to_toml(tables))
        (folder / "site.py").write_text(LOCAL)
        (folder / "engine").write_text(HALTING)
        (folder / "engine").chmod(0o755)
        for command in ("run walker.toml pile.toml", "sweep sweep.toml"):
            call(*command.split(), "--engine", "./engine", check=True, folder=folder)

    return once("undisturbed", fill)


@pytest.fixture
def stopping(undisturbed: Path, in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files alone, in which engines halt."""
    for path in undisturbed.iterdir():
        if path.is_file():
            shutil.copy(path, in_folder)
    monkeypatch.setenv("TMPDIR", str(in_folder))
    monkeypatch.setenv("HALT", str(in_folder))
    return in_folder


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.slow] * ("pilots" in one)) for one in STOPS]
)
def test_stopped_and_gone_on(
    name: str, stopping: Path, undisturbed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first engine has ended well by then: its segment or run is kept, and nobody makes it again."""
    (command, number, signals, whom, status, last), out = STOPS[name], stopping / "runs"
    program = subprocess.Popen(
        [
            *(["nohup"] if whom == "nohup" else []),
            PROGRAM,
            *command.split(),
            "--engine",
            "./engine",
        ],
        start_new_session=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    try:
        engines = wait_for(lambda: _halted(stopping, number) or program.poll() is not None)
        assert program.poll() is None, program.communicate()
        if "--site" in command:
            assert not _reachable(program.pid, stopping)
        else:
            _listens_to_nobody(program.pid)
        if whom == "output":
            shutil.rmtree(out, ignore_errors=True)
        kept = {path: path.stat().st_mtime_ns for path in out.glob("*/segments/????/beads.bin")}
        assert kept or whom == "output" or command.startswith("check")
        for each in signals.split():
            send = os.killpg if whom == "group" else os.kill
            send(engines[0] if whom == "engine" else program.pid, getattr(signal, f"SIG{each}"))
        _, errors = program.communicate(timeout=PATIENCE)
    finally:
        program.kill()
    assert (program.returncode, "Traceback" in errors) == (status, False), errors
    assert last in [*errors.splitlines(), ""][-1 if status < 0 else -2], errors
    if status in (129, 130, 143):
        assert not engines_in(stopping)
        assert not list(stopping.glob("walkers-*"))
    wait_for(lambda: processes_in(stopping) == [os.getpid()])
    if command.startswith("check"):
        return
    for folder in (*out.glob("*.incomplete"), *out.rglob("*.new")):
        (folder / "leftover").touch()
    for part in out.glob("pile*.incomplete"):
        measure(part)  # nothing of it may stay
        assert read_results(part)["driven"] == 0.0
    monkeypatch.delenv("HALT")
    call(*command.partition(" --site")[0].split(), "--engine", "./engine", check=True)
    whole = bits(undisturbed / "runs")
    there = {path: contents for path, contents in whole.items() if (out / path.parts[0]).exists()}
    assert bits(out) == there
    assert there
    for path, written in kept.items():
        assert Path(str(path).replace(".incomplete", "")).stat().st_mtime_ns == written
    assert not [path for kind in ("incomplete", "lock", "new") for path in out.rglob(f"*.{kind}")]
    assert not list(out.rglob("leftover"))


def _halted(folder: Path, number: int) -> list[int]:
    """The engines that do not end, as soon as there are so many and the first has ended."""
    launches = (folder / "launches").read_text().split() if (folder / "launches").exists() else []
    engines = (
        engines_in(folder) if len(launches) == number + 1 else []
    )  # a look at all processes takes long
    return engines if len(engines) == number else []


def _listens_to_nobody(program: int) -> None:
    """A program has engines as its only children, without daemons; no port is open."""
    engines = wait_for(
        lambda: [one for one in psutil.Process(program).children() if one.name() == "liggghts"]
    )
    family = [psutil.Process(program), *psutil.Process(program).children(recursive=True)]
    assert len(family) == len(engines) + 1, family
    ports = [port for each in family for port in each.net_connections()]
    assert not [port for port in ports if port.status == psutil.CONN_LISTEN]
    assert all(each.environ().items() >= ALONE.items() for each in engines)


def _reachable(program: int, folder: Path) -> set[str]:
    """What a program and those that work in a folder listen on that others than this machine may reach."""
    found = set()
    for pid in {
        *processes_in(folder),
        *(one.pid for one in psutil.Process(program).children(recursive=True)),
    }:
        with suppress(psutil.Error, OSError):  # gone by now
            process, devices = (
                psutil.Process(pid),
                Path(f"/proc/{pid}/net/dev").read_text().splitlines()[2:],
            )
            ports = (
                process.net_connections("inet")
                if [line.split(":")[0].strip() for line in devices] != ["lo"]
                else ()
            )
            for port in (port for port in ports if port.laddr and not port.raddr):
                if not ip_address(
                    port.laddr.ip.partition("%")[0].removeprefix("::ffff:")
                ).is_loopback:
                    found.add(f"{process.name()} {port.type.name} {port.laddr}")
    return found


def test_mpirun_and_its_engines_listen_to_nobody_beyond_this_machine(in_folder: Path) -> None:
    if not off_the_network():
        pytest.skip("mpirun listens on every address where nobody may have a network of his own")
    command = [PROGRAM, "run", "pile-ci", "--set", "run.ranks=2", "--set", "run.duration=100 s"]
    program, found = (
        subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL),
        set[str](),
    )

    def looked() -> bool:
        """Until beads have moved."""
        assert program.poll() is None
        found.update(_reachable(program.pid, in_folder))
        return any(dump.stat().st_size > 1000 for dump in in_folder.glob("runs/**/beads.bin"))

    try:
        wait_for(looked)
    finally:
        program.terminate()
        program.wait(timeout=PATIENCE)
    assert not found


def test_an_engine_that_outlives_its_launcher_keeps_others_away(
    front: Callable[[str], str], in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel ends an engine whose launcher dies, but not the engine's children."""
    monkeypatch.setattr("walkers.runner.run_directory._PATIENCE_SECONDS", 0.5)
    case, engine = make_case(run=LONG), front('liggghts "$@"\nexit 0')
    (in_folder / "test.toml").write_text(to_toml(document(run=LONG)))
    program = subprocess.Popen(
        [PROGRAM, "run", "test.toml", "--engine", engine], stderr=subprocess.DEVNULL
    )
    wait_for(lambda: program.poll() is not None or list(in_folder.rglob("beads.bin")))
    assert program.poll() is None
    program.kill()
    program.wait()
    try:
        with pytest.raises(RunBusy):
            run_case(case, in_folder / "runs", engine=engine)
    finally:
        for orphan in engines_in(in_folder):
            os.kill(orphan, signal.SIGKILL)
    with open_run(case, find_engine(engine), in_folder / "runs"):
        pass
