"""Shared by the tests: cases of the walker of Fig. 2, and their runs by the real engine.

What takes long, such as the run of a case, is made once a session, and no test changes it.
"""

from __future__ import annotations

import copy
import fcntl
import io
import os
import pty
import re
import runpy
import shutil
import signal
import struct
import subprocess
import sys
import termios
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import pytest
from tomli_w import dumps as to_toml

from walkers import run as run_case
from walkers.archive.writing import write_archive
from walkers.cache import make_cache_folder
from walkers.inputs.case_building import build_case
from walkers.inputs.origins import Origin
from walkers.inputs.reading import shipped
from walkers.inputs.sweep import expand
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.main import main
from walkers.postprocess.measure.motion import Group, read_motion
from walkers.postprocess.show import series
from walkers.runner.binary import Engine
from walkers.runner.failures import RunBusy
from walkers.runner.run_directory import locked, run_place
from walkers.runs.making import OpenRun, open_locked
from walkers.sweeps.scheduler import SweepOptions, run_sweep

if TYPE_CHECKING:
    from walkers.second_engine.scenes import Bench

# The walker of the published tables: R 0.3/0.2 mm, Si AK5, 80 Hz, Coulomb's law, no rolling
# friction, edges of menisci that do not resist, one walker that starts on the axis in equilibrium.
REFERENCE: dict[str, Any] = {
    "beads": {"material": "ruby"},
    "dimers": {
        "radii": ["0.3 mm", "0.2 mm"],
        "replicates": 1,
        "angle_spread": "0 deg",
        "gap_spread": 0.0,
    },
    "liquid": {
        "name": "Si AK5",
        "volume_fraction": 0.01,
        "viscosity_ratio": 1.0,
        "contact_angle": "0 deg",
        "edge_ratio": 0.0,
    },
    "boundary": {"material": "chromium-coated glass"},
    "contact": {
        "friction": {"bead_bead": 0.1, "bead_wall": 0.1},
        "rolling_friction": 0.0,
        "restitution": 0.3,
        "youngs_modulus": "50 MPa",
        "roughness": {"bead_bead": "1 um", "bead_wall": "1 um"},
    },
    "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
    # Its speed is that of 60 cycles, 20 of them to settle, to nine digits.
    "run": {"cycles": 24, "settling_cycles": 8},
}
COULOMB: dict[str, Any] = {
    "contact.friction.bead_bead": 0.11,
    "contact.friction.bead_wall": 0.175,
    "liquid.edge_ratio": 0.0,
}
"""Changes of a case of ruby walkers: a friction that does not depend on the velocity, and edges of
menisci that do not resist."""
# A shell that starts the tests in the background has SIGINT ignored, by them and all they start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# MPI processes that wait for each other then let other processes run. On a busy machine, this makes
# them ten times as fast.
for name in ("COLUMNS", "NO_COLOR", "FORCE_COLOR", "WALKERS_RUNS"):  # those of the developer
    os.environ.pop(name, None)
os.environ["OMPI_MCA_mpi_yield_when_idle"] = "1"  # noqa: SIM112
_LONGEST = (
    "through_slurm",
    "test_figures_and_comparison",
    "test_a_pile_is_drawn",
    "[a pile, killed]",
    "test_the_installed_engine_passes",
    "test_a_dimer_on_the_axis_climbs",
)
"""Parts of the names of tests that take more than a few seconds, the longest first."""
FillOnce = Callable[[str, Callable[[Path], object]], Path]
"""The type of the fixture `once`: the name of a folder, and what fills it; returns the folder."""
T = TypeVar("T")
ESCAPE = re.compile(r"\x1b\[[0-9;]*m")
"""A sequence that switches colours."""
PROGRAM = str(Path(sys.executable).with_name("walkers"))
SHORT = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
BRIEF = {
    "time_step": "2 us",
    "cycles": 3,
    "settling_cycles": 1,
    "samples_per_cycle": 2,
}
TINY = {
    "time_step": "2 us",
    "cycles": 4,
    "settling_cycles": 1,
    "samples_per_cycle": 5,
}
LONG = {
    "time_step": "2 us",
    "cycles": 4000,
    "settling_cycles": 2,
    "samples_per_cycle": 1,
}
"""Tables `run`, from the shortest to one that no test waits for."""


def document(**changes: Any) -> dict[str, Any]:
    """The reference case as the tables of a file.

    Changes such as ``drive={"frequency": "60 Hz"}`` are merged into its tables.
    """
    merged = copy.deepcopy(REFERENCE)
    for table, values in changes.items():
        if isinstance(values, dict):
            merged.setdefault(table, {}).update(values)
        else:
            merged[table] = values
    return merged


def make_case(**changes: Any) -> Case:
    """The reference case with the changes of `document`."""
    return build_case(document(**changes), name="test")


def origins(case: Case) -> dict[str, Origin]:
    """The origins of a case's values, by key."""
    return {origin.key: origin for origin in case.origins}


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let each worker begin with some of the longest tests, so that none of them comes last.

    Each worker gets an equal share of the tests in the order in which they were collected; workers
    that are done take tests from others.
    """
    long_tests = []
    for name in _LONGEST:
        long_tests += [item for item in items if name in item.name]
    short_tests = [item for item in items if item not in long_tests]
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    items.clear()
    tests_left = len(long_tests) + len(short_tests)
    for worker in range(workers):
        share = tests_left // (workers - worker)
        tests_left -= share
        own_long_tests = long_tests[worker::workers]
        fillers = max(share - len(own_long_tests), 0)
        items += own_long_tests + short_tests[:fillers]
        del short_tests[:fillers]
    items += short_tests


@contextmanager
def open_run(case: Case, engine: Engine, out: Path) -> Iterator[OpenRun]:
    """A run in progress in a folder, which a test makes with another deck or leaves unfinished."""
    out.mkdir(parents=True, exist_ok=True)
    place = run_place(case, engine, out)
    with locked([place]) as locks, open_locked(case, engine, place, list(locks.values())) as run:
        yield run


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of all workers of the session."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        return folder.parent
    return folder


@pytest.fixture(scope="session")
def once(session_folder: Path) -> FillOnce:
    """Folders that are filled once a session, by the worker that asks first; others wait for it."""

    def filled_folder(name: str, fill: Callable[[Path], object]) -> Path:
        folder = session_folder / name
        mark = session_folder / f"{name}.filled"
        with (session_folder / f"{name}.filling").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not mark.exists():
                shutil.rmtree(folder, ignore_errors=True)  # an earlier attempt failed
                folder.mkdir()
                fill(folder)
                mark.touch()
        return folder

    return filled_folder


@pytest.fixture(scope="session", autouse=True)
def cache(once: FillOnce) -> None:
    """A cache of the session's own: the audits of the engine stay apart from those of the user.

    What takes long to make, and has a name that follows from all that it depends on, comes from the
    cache of the user: solutions of equations, a tenth of a second each, and the compiled contact
    model, four seconds.
    """

    def fill_cache(folder: Path) -> None:
        cache_of_user = make_cache_folder()
        own_cache = folder / cache_of_user.name
        own_cache.mkdir()
        for name in ("young-laplace", "menisci"):
            (own_cache / name).symlink_to(make_cache_folder(name))
        for model in cache_of_user.glob("bridge-*"):
            shutil.copy(model, own_cache)  # the program does not load a model through a link

    os.environ["XDG_CACHE_HOME"] = str(once("cache", fill_cache))


@pytest.fixture(scope="session")
def runs_folder(session_folder: Path) -> Path:
    """The folder with the runs of the session, in which no case is run twice."""
    folder = session_folder / "runs"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def run_directory(runs_folder: Path) -> Callable[..., Path]:
    """Run a case, or else the changed reference case, and return its run directory."""

    def run(case: Case | None = None, **changes: Any) -> Path:
        wanted_case = case or make_case(**changes)

        def directory() -> Path | None:
            with suppress(RunBusy):  # another worker is making it
                return run_case(wanted_case, runs_folder).directory
            return None

        return wait_for(directory)

    return run


@pytest.fixture(scope="session")
def trajectory(run_directory: Callable[..., Path]) -> Callable[..., Group]:
    """Run a case, or else the changed reference case, and read the motion of its walkers."""

    def walkers_of(case: Case | None = None, **changes: Any) -> Group:
        return read_motion(run_directory(case, **changes)).groups[0]

    return walkers_of


_FREQUENCIES = {"drive.frequency": ["60 Hz", "80 Hz"]}
_PEAKS = {"drive.peak_acceleration": ["2 g", "4 g", "6 g"]}
LOOKED_THROUGH: dict[str, dict[str, Any]] = {
    "grid": {"axes": _FREQUENCIES | _PEAKS},
    "rough": {
        "set": {"contact.friction.bead_wall": 0.2},
        "axes": _FREQUENCIES | {"drive.peak_acceleration": ["4 g", "2 g"]},
    },
    "three": {"axes": {"contact.friction.bead_wall": [0.1, 0.2]} | _FREQUENCIES | _PEAKS},
    "beads": {
        "axes": {
            "liquid.name": ["Si AK5", "Si AK10"],
            "dimers.radii": [["0.3 mm", "0.2 mm"], ["0.25 mm", "0.2 mm"], ["0.35 mm", "0.2 mm"]],
        }
    },
    "sampled": {
        "sample": [
            {
                "points": 4,
                "ranges": {
                    "contact.friction.bead_wall": {"uniform": [0.05, 0.3]},
                    "contact.friction.bead_bead": {"uniform": [0.05, 0.3]},
                },
            }
        ]
    },
}
"""Sweeps that are plotted, listed and compared, of two walkers each for four cycles."""


@pytest.fixture(scope="session")
def looked_through(once: FillOnce) -> Path:
    """A folder with the runs of `LOOKED_THROUGH`; a test that changes it takes a copy."""

    def run_sweeps(folder: Path) -> None:
        case = document(run=TINY, dimers={"replicates": 2, "angle_spread": "1 deg"})
        (folder / "base.toml").write_text(to_toml(case))
        for name, axes in LOOKED_THROUGH.items():
            sweep = expand({"case": "base.toml", **axes}, source=name, name=name, folder=folder)
            _, failures = run_sweep(sweep, folder / "runs", SweepOptions(2))
            assert not failures

    return once("looked-through", run_sweeps) / "runs"


def brief_pile(**run: Any) -> Case:
    """A third of the shipped pile, settled and shaken for some hundredths of a second."""
    tables = read_toml(shipped("case")["pile-ci"])
    tables["mixture"]["count"] = 20
    brief_run = {
        "duration": "0.03 s",
        "time_step": "3 us",
        "longest_settling": "0.02 s",
        "segment": "0.01 s",
    }
    return build_case({**tables, "run": brief_run | run}, name="brief")


HALF = {"duration": "0.1 s", "segment": "0.05 s"}
"""Table `run` of the shipped pile: half as long as it ships, in as many segments."""


@pytest.fixture(scope="session")
def pile_run(once: FillOnce) -> Path:
    """The shipped pile of 60 beads."""

    def run_pile(out: Path) -> None:
        tables = read_toml(shipped("case")["pile-ci"])
        tables["run"].update(HALF)
        assert not run_case(build_case(tables, name="pile-ci"), out).cached

    (directory,) = once("piles", run_pile).glob("pile-ci-*")
    return directory


@pytest.fixture(scope="session")
def archive(run_directory: Callable[..., Path], once: FillOnce) -> Path:
    """The archive of a run, of which tests damage copies."""

    def write_it(folder: Path) -> None:
        write_archive(run_directory(run=SHORT), folder / "run.zip")

    return once("archived-run", write_it) / "run.zip"


@pytest.fixture(scope="session", autouse=True)
def small_pictures() -> None:
    """Views of a quarter of the width and height: a processor takes long to draw them."""
    series._USUAL_HEIGHT = 250  # type: ignore[misc]
    series._LARGEST_HEIGHT = 400  # type: ignore[misc]
    series._LARGEST_WIDTH = 475  # type: ignore[misc]


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path


@pytest.fixture
def bench(in_folder: Path) -> Iterator[Bench]:
    """A place for the decks of experiments."""
    from studies.literature.experiments import workbench

    with workbench() as bench:
        yield bench


def write_engine(path: Path, script: str) -> str:
    """Write an engine that is a shell script, most often around the real one; return its path."""
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def front(tmp_path: Path) -> Callable[[str], str]:
    """Write an engine that is a shell script into the temporary folder of the test."""

    def write(script: str) -> str:
        return write_engine(tmp_path / "front", script)

    return write


def finished_places(out: Path) -> dict[str, Path]:
    """Directories of all finished runs of a folder, by name."""
    places = {}
    for manifest in sorted(out.glob("*/manifest.json")):
        place = manifest.parent
        if place.suffix not in (".incomplete", ".replaced"):
            places[place.name] = place
    return places


def bits(out: Path) -> dict[Path, bytes]:
    """What finished runs computed, by paths: dumps, restart files, tables, results."""
    endings = (".bin", ".parquet", ".restart", ".txt", "result.json")
    contents = {}
    for place in finished_places(out).values():
        for path in place.rglob("*"):
            if path.name.endswith(endings):
                contents[path.relative_to(out)] = path.read_bytes()
    return contents


def engines_in(directory: Path) -> list[int]:
    """Process ids of the engines that work in a directory or below."""
    # With "-in" they are not the ldd that asks what the engine is linked to.
    return processes_in(directory, b"liggghts", b"\0-in\0")


def processes_in(directory: Path, *words: bytes) -> list[int]:
    """Process ids of those in a directory, or below, whose command has all of some words in it."""
    ids = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended, or belongs to somebody else
            command = (process / "cmdline").read_bytes()
            folder = (process / "cwd").resolve()
            if all(word in command for word in words) and folder.is_relative_to(directory):
                ids.append(int(process.name))
    return ids


PATIENCE = 300.0
"""Time limit of waiting in s: many times what anything takes, also on a busy machine."""


def wait_for(condition: Callable[[], T | None], seconds: float = PATIENCE) -> T:
    """Wait until a condition returns anything that is true, and return that."""
    end = time.monotonic() + seconds
    while True:
        start = time.monotonic()
        if start >= end:
            raise AssertionError("waited in vain")
        value = condition()
        if value:
            return value
        # Looking takes at most a fifth of the processor from what is waited for.
        looked_for = time.monotonic() - start
        time.sleep(min(max(0.02, 4.0 * looked_for), 0.5))


@contextmanager
def _warnings_of_a_process() -> Iterator[None]:
    """Show the warnings that a Python process of its own shows."""
    with warnings.catch_warnings():
        warnings.resetwarnings()
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        yield


@contextmanager
def _state_is_restored() -> Iterator[None]:
    """Restore the arguments of the process and its signal handlers."""
    arguments = sys.argv
    handlers = {}
    for number in (signal.SIGTERM, signal.SIGHUP):
        handlers[number] = signal.getsignal(number)
    try:
        yield
    finally:
        sys.argv = arguments
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _captured_stream() -> io.TextIOWrapper:
    """A stream that keeps what is written to it."""
    return io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)


def _text_of(stream: io.TextIOWrapper) -> str:
    """What was written to a captured stream."""
    return stream.buffer.getvalue().decode()  # type: ignore[attr-defined, no-any-return]


def on_terminal(
    *arguments: str, folder: Path, columns: int = 80, errors: bool = False, **variables: str
) -> str:
    """What the program prints on a terminal of its own with so many columns.

    With ``errors``, that is also what it prints on the standard error.
    """
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    environment = {**os.environ, "TERM": "xterm-256color", **variables}
    process = subprocess.Popen(
        [PROGRAM, *arguments],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs if errors else subprocess.DEVNULL,
    )
    os.close(theirs)
    output = b""
    with suppress(OSError):  # the end of a terminal is an error
        while part := os.read(ours, 65536):
            output += part
    os.close(ours)
    assert process.wait() == 0
    return output.decode().replace("\r\n", "\n")


def call(
    *arguments: str, check: bool = False, folder: Path | None = None, study: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Call the program in this process, which saves the half second that a new one takes to start.

    Where signals, pipes or the end of the interpreter matter, tests start `PROGRAM` instead.

    Parameters
    ----------
    arguments
        The arguments of the program.
    check
        Whether its exit status must be zero.
    folder
        Its working directory; None: the present one.
    study
        A module such as ``studies.paper``, which is run as by ``python -m`` instead of the program.

    Returns
    -------
    subprocess.CompletedProcess
        Its exit status, and what it wrote to stdout and stderr.
    """
    output = _captured_stream()
    errors = _captured_stream()
    with (
        redirect_stdout(output),
        redirect_stderr(errors),
        chdir(folder or "."),
        _warnings_of_a_process(),
        _state_is_restored(),
    ):
        try:
            if study:
                sys.argv = [study, *arguments]
                # `runpy` warns about a module that a test has imported.
                warnings.filterwarnings("ignore", ".*unpredictable", RuntimeWarning)
                runpy.run_module(study, run_name="__main__")
            else:
                main(list(arguments))
        except SystemExit as end:
            status = int(end.code or 0)
    done = subprocess.CompletedProcess(
        [PROGRAM, *arguments], status, _text_of(output), _text_of(errors)
    )
    if check:
        assert done.returncode == 0, done.stderr
    return done


@contextmanager
def mounted(place: Path, size: str) -> Iterator[Path]:
    """A file system of a size such as ``2m``; tests that need one are for root."""
    place.mkdir()
    arguments = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    if subprocess.run(arguments, capture_output=True, check=False).returncode:
        pytest.skip("a small file system can only be mounted by root")
    try:
        yield place
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def fill(place: Path) -> Path:
    """Fill a file system with a file, until no byte is left, and return the file."""
    ballast = place / "ballast"
    with suppress(OSError), ballast.open("ab", buffering=0) as file:
        while file.write(b"\0" * 4096):
            pass
    return ballast
