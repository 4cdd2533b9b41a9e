"""Engines are born: many at a time, again where nothing came of it, without a daemon or an open port."""

import socket
import subprocess
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from tests.benchmark_starts import failed_starts
from tests.conftest import PROGRAM, SHORT, document, engines_in, make_case, to_toml, wait_for
from walkers import run as run_case
from walkers.runner.failures import EngineNeverStarted
from walkers.templates.engine import ALONE

LONG = {"time_step": "2 us", "cycles": 4000, "settling_cycles": 2, "samples_per_cycle": 1}


@pytest.mark.slow
def test_of_two_hundred_engines_eight_at_a_time_all_start(tmp_path: Path) -> None:
    """5,000 of them by `make bench-starts`."""
    assert failed_starts(200, tmp_path) == []


def test_of_sixteen_engines_eight_at_a_time_all_start(tmp_path: Path) -> None:
    assert failed_starts(16, tmp_path) == []


@pytest.fixture
def stillborn(tmp_path: Path) -> Callable[[int], str]:
    """A front of the real engine that cannot initialise MPI the first times: it asks for a component there is not."""

    def front(times: int) -> str:
        path, births = tmp_path / "front", tmp_path / "births"
        births.touch()
        path.write_text(
            f'#!/bin/sh\necho born >> "{births}"\n'
            f'[ $(wc -l < "{births}") -le {times} ] && export OMPI_MCA_coll=none-such\nexec liggghts "$@"\n'
        )
        path.chmod(0o755)
        return str(path)

    return front


def test_an_engine_that_never_started_is_tried_again(stillborn: Callable[[int], str], tmp_path: Path) -> None:
    outcome = run_case(make_case(run=SHORT), tmp_path / "runs", engine=stillborn(2))
    assert outcome.result["velocity"]["mean"] > 0.0
    assert (tmp_path / "births").read_text().count("born") == 3


def test_an_engine_that_never_starts_is_told_by_its_name(stillborn: Callable[[int], str], tmp_path: Path) -> None:
    with pytest.raises(EngineNeverStarted, match="never started: exit status"):
        run_case(make_case(run=SHORT), tmp_path / "runs", engine=stillborn(99))
    assert (tmp_path / "births").read_text().count("born") == 3
    assert "EngineNeverStarted" in next((tmp_path / "runs").glob("*.incomplete/failure.json")).read_text()


def test_an_engine_starts_where_nothing_temporary_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", "/proc")
    assert not run_case(make_case(run=SHORT), tmp_path).cached


def _below(process: psutil.Process) -> list[psutil.Process]:
    return [process, *process.children(recursive=True)]


def test_a_plain_sweep_listens_to_nobody_and_has_no_daemon(in_folder: Path) -> None:
    (in_folder / "base.toml").write_text(to_toml(document(run=LONG)))
    (in_folder / "test.toml").write_text(
        'case = "base.toml"\n[axes]\ndrive.frequency = ["60 Hz", "70 Hz", "80 Hz", "90 Hz"]\n'
    )
    program = subprocess.Popen([PROGRAM, "sweep", "test.toml", "-j", "2"], stderr=subprocess.DEVNULL)
    try:
        running = wait_for(lambda: [one for one in engines_in(in_folder) if _has_begun(one)][1:])
        assert running
        family = _below(psutil.Process(program.pid))
        assert not [one.name() for one in family if "orted" in one.name()]
        open_ports = [each for one in family for each in one.net_connections() if each.status == psutil.CONN_LISTEN]
        assert open_ports == []
        for engine in running:
            assert psutil.Process(engine).environ().items() >= ALONE.items()
        assert not list(in_folder.glob("runs/*/failure.json"))  # the box of 4,000 cycles at 60 Hz has many bins
    finally:
        program.kill()
        program.wait()


def _has_begun(engine: int) -> bool:
    """Whether MPI is up in an engine: it writes frames by then."""
    return any(Path(each.path).name == "beads.bin" for each in psutil.Process(engine).open_files())


def test_a_listener_would_be_seen() -> None:
    """What the test before looks for is there where somebody listens."""
    with socket.socket() as ours:
        ours.bind(("127.0.0.1", 0))
        ours.listen()
        found = [each.laddr.port for each in psutil.Process().net_connections() if each.status == psutil.CONN_LISTEN]
        assert ours.getsockname()[1] in found
