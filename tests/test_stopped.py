"""Programs and engines that are stopped at any moment.

Nobody is left behind, and the next call gives the same bits.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from ipaddress import ip_address
from pathlib import Path
from signal import SIGHUP, SIGINT, SIGKILL, SIGTERM
from typing import Any, Literal

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
from walkers.files import read_json, write_json
from walkers.inputs.reading import shipped
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.results import measure, read_results
from walkers.runner.binary import find_engine
from walkers.runner.failures import RunBusy
from walkers.runner.process import ALONE, off_the_network

HALTING = """#!/bin/sh
if [ -n "$HALT" ]; then
    pwd >> "$HALT"/launches
    mkdir "$HALT"/first 2>/dev/null ||
        sed -i 's/^run .*/timestep 1e-12\\nrun 1999999999/' walker.lig
fi
exec liggghts "$@"
"""
"""An engine; if a folder ``HALT`` is set, only the first of its processes comes to an end."""


def _pile() -> dict[str, Any]:
    """The shipped pile with 14 beads, whose liquid is conserved, so that a restart must keep it."""
    tables = read_toml(shipped("case")["pile-ci"])
    tables["liquid"] |= {"conserved": True, "law": "willett"}
    tables["mixture"] |= {
        "count": 14,
        "small": ["0.3 mm", "0.3 mm"],
        "large": ["0.5 mm", "0.5 mm"],
    }
    tables["run"] = {
        "time_step": "3 us",
        "longest_settling": "0.02 s",
        "duration": "0.03 s",
        "segment": "0.01 s",
    }
    return tables


FILES: dict[str, dict[str, Any]] = {
    "walker": document(run={**SHORT, "time_step": "2 us", "segment": "25 ms"}),
    "pile": _pile(),
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


@dataclass(frozen=True)
class Stop:
    """A program, how it is stopped, and what it then says.

    Attributes
    ----------
    command
        Its arguments.
    runs
        The start of the names of the runs that it makes; empty if they are not kept.
    engines
        How many engines work when it is stopped.
    target
        What is stopped: the program, its group of processes, or an engine; or its output is
        removed.
    status
        Its exit status.
    signals
        What is sent, in this order.
    last_line
        Words of its last line; empty if a signal ends it before it can say anything.
    under_nohup
        Whether ``nohup`` starts it, under which it ignores SIGHUP.
    """

    command: str
    runs: str
    engines: int
    target: Literal["program", "group", "engine", "output"]
    status: int
    signals: tuple[signal.Signals, ...] = ()
    last_line: str = ""
    under_nohup: bool = False

    @property
    def uses_pilots(self) -> bool:
        """Whether pilot jobs of a site run the engines."""
        return "--site" in self.command

    @property
    def can_clean_up(self) -> bool:
        """Whether the program ends by itself after a signal (130: SIGINT, 143: SIGTERM)."""
        return self.status in (130, 143)


STOPS: dict[str, Stop] = {
    "a run, Ctrl-C": Stop(
        command="run walker.toml",
        runs="walker-",
        engines=1,
        target="program",
        signals=(SIGINT,),
        status=130,
        last_line="interrupted",
    ),
    "a run, closed terminal under nohup": Stop(
        command="run walker.toml",
        runs="walker-",
        engines=1,
        target="program",
        signals=(SIGHUP, SIGTERM),
        status=143,
        last_line="terminated",
        under_nohup=True,
    ),
    "a run, engine killed": Stop(
        command="run walker.toml",
        runs="walker-",
        engines=1,
        target="engine",
        signals=(SIGKILL,),
        status=1,
        last_line="the engine was killed by SIGKILL",
    ),
    "a check, Ctrl-C": Stop(
        command="check engine --only restart",
        runs="",
        engines=1,
        target="program",
        signals=(SIGINT,),
        status=130,
        last_line="interrupted",
    ),
    "a pile, killed": Stop(
        command="run pile.toml",
        runs="pile-",
        engines=1,
        target="program",
        signals=(SIGKILL,),
        status=-SIGKILL,
    ),
    "a sweep, Ctrl-C": Stop(
        command="sweep sweep.toml -j 2",
        runs="base-",
        engines=2,
        target="group",
        signals=(SIGINT,),
        status=130,
        last_line="interrupted",
    ),
    "a sweep, killed": Stop(
        command="sweep sweep.toml -j 2",
        runs="base-",
        engines=2,
        target="program",
        signals=(SIGKILL,),
        status=-SIGKILL,
    ),
    "a sweep, output removed": Stop(
        command="sweep sweep.toml -j 2",
        runs="base-",
        engines=2,
        target="output",
        status=1,
        last_line="was removed while it was written",
    ),
    "pilots, killed": Stop(
        command="sweep sweep.toml --site site.py",
        runs="base-",
        engines=2,
        target="program",
        signals=(SIGKILL,),
        status=-SIGKILL,
    ),
}


def _stops_that(condition: Callable[[Stop], bool]) -> list[Any]:
    """Names of stops as parameters of a test; those of pilots are slow."""
    parameters = []
    for name, stop in STOPS.items():
        if condition(stop):
            marks = [pytest.mark.slow] if stop.uses_pilots else []
            parameters.append(pytest.param(name, marks=marks, id=name))
    return parameters


ALL = _stops_that(lambda _: True)
ON_THIS_MACHINE = _stops_that(lambda stop: not stop.uses_pilots)
WITH_LAST_LINE = _stops_that(lambda stop: stop.last_line != "")
CLEANING_UP = _stops_that(lambda stop: stop.can_clean_up)
KEEPING_RUNS = _stops_that(lambda stop: stop.runs != "")
KEEPING_DUMPS = _stops_that(lambda stop: stop.runs != "" and stop.target != "output")


@dataclass(frozen=True)
class StoppedProgram:
    """What is seen of a program before, at and after its stop.

    Attributes
    ----------
    children
        Names of the processes that descend from it while engines work.
    isolated
        Whether these engines have the environment `ALONE`.
    ports
        Ports that it and its descendants listen on; of pilots, those beyond this machine.
    finished_dumps
        Dumps of segments that are complete at the stop, with the time in ns of their last change.
    status, error_lines
        Its exit status and what it says.
    engines_left
        Engines that work after its end.
    scratch_left
        Temporary folders that it leaves.
    """

    children: list[str]
    isolated: bool
    ports: list[str]
    finished_dumps: dict[str, int]
    status: int
    error_lines: list[str]
    engines_left: list[int]
    scratch_left: list[str]


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


def _halted_engines(folder: Path, number: int) -> list[int]:
    """The engines that do not end, once there are ``number`` and the first one has ended."""
    launches = folder / "launches"
    if not launches.exists() or len(launches.read_text().split()) != number + 1:
        return []  # without a look at all processes, which takes long
    engines = engines_in(folder)
    return engines if len(engines) == number else []


def _open_ports(stop: Stop, program: psutil.Process, folder: Path) -> list[str]:
    """Ports that a program or a descendant listens on; of pilots, those beyond this machine."""
    if stop.uses_pilots:
        return _reachable(program.pid, folder)
    ports = []
    for process in (program, *program.children(recursive=True)):
        for port in process.net_connections():
            if port.status == psutil.CONN_LISTEN:
                ports.append(f"{process.name()} {port.laddr}")
    return ports


def _stop(stop: Stop, program: int, engine: int, out: Path) -> None:
    """Send the signals of a stop, or remove the output."""
    if stop.target == "output":
        shutil.rmtree(out, ignore_errors=True)
    for number in stop.signals:
        if stop.target == "group":
            os.killpg(program, number)
        elif stop.target == "engine":
            os.kill(engine, number)
        else:
            os.kill(program, number)


def _started_and_stopped(stop: Stop, folder: Path) -> StoppedProgram:
    """Start a program in a folder, and stop it when its first engine alone has ended."""
    command = [PROGRAM, *stop.command.split(), "--engine", "./engine"]
    if stop.under_nohup:
        command.insert(0, "nohup")
    program = subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, "TMPDIR": str(folder), "HALT": str(folder)},
        start_new_session=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    try:
        wait_for(lambda: _halted_engines(folder, stop.engines) or program.poll() is not None)
        assert program.poll() is None, program.communicate()
        process = psutil.Process(program.pid)
        engines = [psutil.Process(engine) for engine in engines_in(folder)]
        children = [child.name() for child in process.children(recursive=True)]
        isolated = all(engine.environ().items() >= ALONE.items() for engine in engines)
        ports = _open_ports(stop, process, folder)
        _stop(stop, program.pid, engines[0].pid, folder / "runs")
        finished_dumps = {}
        for dump in folder.glob("runs/*/segments/????/beads.bin"):
            finished_dumps[str(dump.relative_to(folder))] = dump.stat().st_mtime_ns
        _, errors = program.communicate(timeout=PATIENCE)
    finally:
        program.kill()
    return StoppedProgram(
        children=children,
        isolated=isolated,
        ports=ports,
        finished_dumps=finished_dumps,
        status=program.returncode,
        error_lines=errors.splitlines(),
        engines_left=engines_in(folder),
        scratch_left=[path.name for path in folder.glob("walkers-*")],
    )


@pytest.fixture(scope="session")
def stopped_folder(
    undisturbed: Path, once: Callable[[str, Callable[[Path], object]], Path]
) -> Callable[[str], Path]:
    """The folder in which the program of a stop has worked, and ``stopped.json`` about it."""

    def made(name: str) -> Path:
        def fill(folder: Path) -> None:
            for path in undisturbed.iterdir():
                if path.is_file():
                    shutil.copy(path, folder)
            stopped = _started_and_stopped(STOPS[name], folder)
            write_json(folder / "stopped.json", asdict(stopped))
            # However the program ended, its engines and other children end, too.
            wait_for(lambda: not processes_in(folder))

        return once(re.sub(r"\W+", "-", f"stopped {name}"), fill)

    return made


@pytest.fixture(scope="session")
def stopped(stopped_folder: Callable[[str], Path]) -> Callable[[str], StoppedProgram]:
    """The program of a stop, by the name of the stop."""

    def read(name: str) -> StoppedProgram:
        return StoppedProgram(**read_json(stopped_folder(name) / "stopped.json"))

    return read


@pytest.fixture(scope="session")
def resumed(
    stopped_folder: Callable[[str], Path], once: Callable[[str, Callable[[Path], object]], Path]
) -> Callable[[str], Path]:
    """A copy of the folder of a stop in which the same command was given again, to its end."""

    def made(name: str) -> Path:
        def fill(folder: Path) -> None:
            shutil.copytree(stopped_folder(name), folder, dirs_exist_ok=True)
            out = folder / "runs"
            for unfinished in (*out.glob("*.incomplete"), *out.rglob("*.new")):
                (unfinished / "leftover").touch()
            for pile in out.glob("pile*.incomplete"):
                measure(pile)  # nothing of it may stay
                assert read_results(pile)["driven"] == 0.0, "stopped while it settled"
            command = STOPS[name].command.partition(" --site")[0]
            call(*command.split(), "--engine", "./engine", check=True, folder=folder)

        return once(re.sub(r"\W+", "-", f"resumed {name}"), fill)

    return made


@pytest.mark.parametrize("name", ALL)
def test_a_program_listens_to_nobody(name: str, stopped: Callable[[str], StoppedProgram]) -> None:
    """No port is open at all; with pilots, none that other machines reach."""
    assert stopped(name).ports == []


@pytest.mark.parametrize("name", ON_THIS_MACHINE)
def test_a_program_has_isolated_engines_as_its_only_children(
    name: str, stopped: Callable[[str], StoppedProgram]
) -> None:
    """Daemons of Open MPI would be further children."""
    assert stopped(name).children == ["liggghts"] * STOPS[name].engines
    assert stopped(name).isolated


@pytest.mark.parametrize("name", ALL)
def test_a_program_that_is_stopped_has_the_exit_status_of_the_stop(
    name: str, stopped: Callable[[str], StoppedProgram]
) -> None:
    """128 and the number of a signal that it handles; 1 if a run failed."""
    assert stopped(name).status == STOPS[name].status
    assert "Traceback" not in "\n".join(stopped(name).error_lines)


@pytest.mark.parametrize("name", WITH_LAST_LINE)
def test_a_program_that_is_stopped_says_so_in_its_last_line(
    name: str, stopped: Callable[[str], StoppedProgram]
) -> None:
    assert STOPS[name].last_line in stopped(name).error_lines[-1]


@pytest.mark.parametrize("name", CLEANING_UP)
def test_a_program_that_is_stopped_ends_its_engines_and_removes_its_scratch(
    name: str, stopped: Callable[[str], StoppedProgram]
) -> None:
    assert stopped(name).engines_left == []
    assert stopped(name).scratch_left == []


@pytest.mark.parametrize("name", KEEPING_RUNS)
def test_a_stopped_run_goes_on_to_the_same_bits(
    name: str, resumed: Callable[[str], Path], undisturbed: Path
) -> None:
    expected = {}
    for path, contents in bits(undisturbed / "runs").items():
        if path.parts[0].startswith(STOPS[name].runs):
            expected[path] = contents
    assert expected
    assert bits(resumed(name) / "runs") == expected


@pytest.mark.parametrize("name", KEEPING_DUMPS)
def test_segments_that_a_stopped_run_has_completed_are_not_computed_again(
    name: str, stopped: Callable[[str], StoppedProgram], resumed: Callable[[str], Path]
) -> None:
    """The first engine of each has ended well before the stop."""
    dumps = stopped(name).finished_dumps
    assert dumps
    for dump, changed in dumps.items():
        path = resumed(name) / dump.replace(".incomplete", "")
        assert path.stat().st_mtime_ns == changed


@pytest.mark.parametrize("name", KEEPING_RUNS)
def test_a_stopped_run_that_went_on_leaves_nothing_beside_it(
    name: str, resumed: Callable[[str], Path]
) -> None:
    for path in (resumed(name) / "runs").rglob("*"):
        assert path.suffix not in (".incomplete", ".lock", ".new")
        assert path.name != "leftover"


def _is_loopback(ip: str) -> bool:
    """Whether only this machine reaches an address.

    IPv6 may add a device (``fe80::1%eth0``), and writes IPv4 addresses as ``::ffff:127.0.0.1``.
    """
    return ip_address(ip.partition("%")[0].removeprefix("::ffff:")).is_loopback


def _ports_beyond_loopback(pid: int) -> list[str]:
    """Ports that a process listens on and that other machines may reach."""
    process = psutil.Process(pid)
    devices = Path(f"/proc/{pid}/net/dev").read_text().splitlines()[2:]
    if [line.split(":")[0].strip() for line in devices] == ["lo"]:
        return []  # it has a network of its own, without a device to the outside
    ports = []
    for port in process.net_connections("inet"):
        if port.laddr and not port.raddr and not _is_loopback(port.laddr.ip):
            ports.append(f"{process.name()} {port.type.name} {port.laddr}")
    return ports


def _reachable(program: int, folder: Path) -> list[str]:
    """Ports beyond this machine of a program and of all processes that work in a folder."""
    pids = set(processes_in(folder))
    pids |= {child.pid for child in psutil.Process(program).children(recursive=True)}
    ports = []
    for pid in sorted(pids):
        with suppress(psutil.Error, OSError):  # gone by now
            ports += _ports_beyond_loopback(pid)
    return ports


def test_mpirun_and_its_engines_listen_to_nobody_beyond_this_machine(in_folder: Path) -> None:
    if not off_the_network():
        pytest.skip("mpirun listens on every address where nobody may have a network of his own")
    program = subprocess.Popen(
        [PROGRAM, "run", "pile-ci", "--set", "run.ranks=2", "--set", "run.duration=100 s"],
        start_new_session=True,
        stderr=subprocess.DEVNULL,
    )
    ports = []

    def beads_have_moved() -> bool:
        """Look for ports until then."""
        assert program.poll() is None
        ports.extend(_reachable(program.pid, in_folder))
        return any(dump.stat().st_size > 1000 for dump in in_folder.glob("runs/**/beads.bin"))

    try:
        wait_for(beads_have_moved)
    finally:
        program.terminate()
        program.wait(timeout=PATIENCE)
    assert ports == []


def test_an_engine_that_outlives_its_launcher_keeps_others_away(
    front: Callable[[str], str], in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel ends an engine whose launcher dies, but not the engine's children."""
    monkeypatch.setattr("walkers.runner.run_directory._PATIENCE_SECONDS", 0.5)
    case = make_case(run=LONG)
    engine = front('liggghts "$@"\nexit 0')  # the real engine is a child of the shell
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
