"""Engines are born: many at a time, again where nothing came of it, without a daemon or an open port."""

import shutil
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil
import pytest

from tests.conftest import LONG, PROGRAM, SHORT, document, engines_in, make_case, to_toml, wait_for
from walkers import run as run_case
from walkers.runner import find_engine, launch
from walkers.runner.binary import plugin_of
from walkers.runner.directory import write_deck
from walkers.runner.failures import EngineNeverStarted
from walkers.templates.deck import render_deck
from walkers.templates.engine import ALONE


@pytest.mark.parametrize("number", [16, pytest.param(1000, marks=pytest.mark.slow)])
def test_of_many_engines_eight_at_a_time_all_start(number: int, tmp_path: Path) -> None:
    run = {"time_step": "2 us", "cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1}
    deck, engine = render_deck(make_case(run=run, drive={"frequency": "2 kHz"})), find_engine()

    def start(each: int) -> None:
        directory = tmp_path / str(each)
        directory.mkdir()
        write_deck(deck, directory)
        launch(deck, directory, engine, starts=1)
        shutil.rmtree(directory)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(start, range(number)))


@pytest.mark.parametrize("times", [2, 99])
def test_an_engine_that_never_started_is_tried_twice_again(
    times: int, front: Callable[[str], str], tmp_path: Path
) -> None:
    """The first times it cannot initialise MPI, for it asks for a component there is not."""
    births = tmp_path / "births"
    births.touch()
    fails = f'echo born >> "{births}"\n[ $(wc -l < "{births}") -le {times} ] && export OMPI_MCA_coll=none-such\n'
    engine, case = front(f'{fails}exec liggghts "$@"'), make_case(run=SHORT)
    if times == 2:
        assert run_case(case, tmp_path / "runs", engine=engine).result["velocity"]["mean"] > 0.0
    else:
        with pytest.raises(EngineNeverStarted, match="never started: exit status"):
            run_case(case, tmp_path / "runs", engine=engine)
        assert "EngineNeverStarted" in next((tmp_path / "runs").glob("*.incomplete/failure.json")).read_text()
    assert births.read_text().count("born") == 3


def test_an_engine_starts_where_nothing_temporary_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin_of(find_engine())  # is there: a compiler needs such files
    monkeypatch.setenv("TMPDIR", "/proc")
    assert not run_case(make_case(run=SHORT), tmp_path).cached


def test_a_plain_sweep_listens_to_nobody_and_has_no_daemon(in_folder: Path) -> None:
    (in_folder / "base.toml").write_text(to_toml(document(run=LONG)))
    (in_folder / "test.toml").write_text(
        'case = "base.toml"\n[axes]\ndrive.frequency = ["60 Hz", "70 Hz", "80 Hz", "90 Hz"]\n'
    )
    program = subprocess.Popen([PROGRAM, "sweep", "test.toml", "-j", "2"], stderr=subprocess.DEVNULL)
    try:
        running = wait_for(lambda: [one for one in engines_in(in_folder) if _has_begun(one)][1:])
        assert running
        starter = psutil.Process(program.pid)
        family = [starter, *starter.children(recursive=True)]
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
