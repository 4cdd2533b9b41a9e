"""Shared by the tests: cases built from the walker of Fig. 2, run by the real engine, each once a session."""

from __future__ import annotations

import copy
import fcntl
import io
import os
import runpy
import shutil
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout, suppress
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

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

# The walker of the published tables: R 0.3/0.2 mm, Si AK5, 80 Hz, no rolling friction, one walker that starts on the
# axis in equilibrium.
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
# Whoever starts the tests in the background of a shell has SIGINT ignored, and so would all that they start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# MPI processes that wait for each other give way to others meanwhile: on a busy machine they are ten times as fast so.
os.environ["OMPI_MCA_mpi_yield_when_idle"] = "1"  # noqa: SIM112
_LONGEST = (
    *("test_a_sweep_through_slurm", "test_figures_and_comparison", "test_a_pile_is_drawn"),
    *("[a pile, killed]", "test_the_installed_engine_passes", "test_a_dimer_on_the_axis_climbs"),
)
"""Parts of the names of tests that take more than a few seconds, the longest first."""
T = TypeVar("T")
PROGRAM = str(Path(sys.executable).with_name("walkers"))
SHORT = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}
BRIEF = {"time_step": "2 us", "cycles": 3, "settling_cycles": 1, "samples_per_cycle": 2}
TINY = {"time_step": "2 us", "cycles": 4, "settling_cycles": 1, "samples_per_cycle": 5}
LONG = {"time_step": "2 us", "cycles": 4000, "settling_cycles": 2, "samples_per_cycle": 1}


def document(**changes: Any) -> dict[str, Any]:
    """The reference case with changes such as ``drive={"frequency": "60 Hz"}`` merged into its tables."""
    merged = copy.deepcopy(REFERENCE)
    for table, values in changes.items():
        if isinstance(values, dict):
            merged.setdefault(table, {}).update(values)
        else:
            merged[table] = values
    return merged


def make_case(**changes: Any) -> Case:
    """`document`, resolved."""
    return build_case(document(**changes), name="test")


def origins(case: Case) -> dict[str, Origin]:
    """The origins of a case's values, by key."""
    return {one.key: one for one in case.origins}


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let each worker begin with some of the longest tests, so that none of them begins when all others have ended.

    Workers get equal pieces of what was collected, in its order, and take from each other later.
    """
    long = [item for name in _LONGEST for item in items if name in item.name]
    short = iter([item for item in items if item not in long])
    workers, left = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")), len(items)
    items.clear()
    for worker in range(workers):
        piece, share = left // (workers - worker), long[worker::workers]
        items += [*share, *islice(short, max(piece - len(share), 0))]
        left -= piece
    items += short


@contextmanager
def open_run(case: Case, engine: Engine, out: Path) -> Iterator[OpenRun]:
    """A run that is being made in a folder, to be made with other decks or to be left unfinished."""
    out.mkdir(parents=True, exist_ok=True)
    place = run_place(case, engine, out)
    with locked([place]) as ours, open_locked(case, engine, place, list(ours.values())) as run:
        yield run


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of all workers of the session."""
    folder = tmp_path_factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


@pytest.fixture(scope="session")
def once(session_folder: Path) -> Callable[[str, Callable[[Path], object]], Path]:
    """Folders that are filled once a session, by the worker that asks first; the others wait for it."""

    def filled(name: str, fill: Callable[[Path], object]) -> Path:
        folder, mark = session_folder / name, session_folder / f"{name}.filled"
        with (session_folder / f"{name}.filling").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not mark.exists():
                shutil.rmtree(folder, ignore_errors=True)  # somebody failed to fill it
                folder.mkdir()
                fill(folder)
                mark.touch()
        return folder

    return filled


@pytest.fixture(scope="session", autouse=True)
def cache(once: Callable[[str, Callable[[Path], object]], Path]) -> None:
    """A cache of the session's own, for audits of the engine are kept in that of the user.

    It has of it what is named by all that it depends on: solutions of equations, a tenth of a second each, and the
    compiled contact model, four seconds.
    """

    def fill_it(folder: Path) -> None:
        kept = make_cache_folder()
        (own := folder / kept.name).mkdir()
        for name in ("young-laplace", "menisci"):
            (own / name).symlink_to(make_cache_folder(name))
        for model in kept.glob("bridge-*"):  # a copy: a link to it is not loaded
            shutil.copy(model, own)

    os.environ["XDG_CACHE_HOME"] = str(once("cache", fill_it))


@pytest.fixture(scope="session")
def runs_folder(session_folder: Path) -> Path:
    """Where the session's runs are kept, so that no case is run twice."""
    folder = session_folder / "runs"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def run_directory(runs_folder: Path) -> Callable[..., Path]:
    """Run the changed reference case (or a given one) and return its run directory."""

    def run(case: Case | None = None, **changes: Any) -> Path:
        wanted = case or make_case(**changes)

        def directory() -> Path | None:
            with suppress(RunBusy):  # another worker is just making it
                return run_case(wanted, runs_folder).directory
            return None

        return wait_for(directory)

    return run


@pytest.fixture(scope="session")
def trajectory(run_directory: Callable[..., Path]) -> Callable[..., Group]:
    """Run and read the trajectory."""

    return lambda case=None, **changes: read_motion(run_directory(case, **changes)).groups[0]


_FREQUENCIES, _PEAKS = (
    {"drive.frequency": ["60 Hz", "80 Hz"]},
    {"drive.peak_acceleration": ["2 g", "4 g", "6 g"]},
)
_FRICTIONS = {
    f"contact.friction.bead_{other}": {"uniform": [0.05, 0.3]} for other in ("wall", "bead")
}
LOOKED_THROUGH: dict[str, dict[str, Any]] = {
    "grid": {"axes": {**_FREQUENCIES, **_PEAKS}},
    "rough": {
        "set": {"contact.friction.bead_wall": 0.2},
        "axes": {**_FREQUENCIES, "drive.peak_acceleration": ["4 g", "2 g"]},
    },
    "three": {"axes": {"contact.friction.bead_wall": [0.1, 0.2], **_FREQUENCIES, **_PEAKS}},
    "beads": {
        "axes": {
            "liquid.name": ["Si AK5", "Si AK10"],
            "dimers.radii": [["0.3 mm", "0.2 mm"], ["0.25 mm", "0.2 mm"], ["0.35 mm", "0.2 mm"]],
        }
    },
    "sampled": {"sample": [{"points": 4, "ranges": _FRICTIONS}]},
}
"""Sweeps that are plotted, listed and compared, of two walkers each for four cycles."""


@pytest.fixture(scope="session")
def looked_through(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A folder with the runs of `LOOKED_THROUGH`; who changes it takes a copy."""
    changes = {"run": TINY, "dimers": {"replicates": 2, "angle_spread": "1 deg"}}

    def fill(folder: Path) -> None:
        (folder / "base.toml").write_text(to_toml(document(**changes)))
        for name, axes in LOOKED_THROUGH.items():
            sweep = expand({"case": "base.toml", **axes}, source=name, name=name, folder=folder)
            _, failures = run_sweep(sweep, folder / "runs", SweepOptions(2))
            assert not failures

    return once("looked-through", fill) / "runs"


def brief_pile(**run: Any) -> Case:
    """A third of the shipped pile, settled and shaken for some hundredths of a second."""
    tables = read_toml(shipped("case")["pile-ci"])
    tables["mixture"] |= {"count": 20}
    brief = {
        "duration": "0.03 s",
        "time_step": "3 us",
        "longest_settling": "0.02 s",
        "segment": "0.01 s",
    }
    return build_case({**tables, "run": {**brief, **run}}, name="brief")


HALF = {"duration": "0.1 s", "segment": "0.05 s"}
"""Of the shipped pile: half as long as it ships, in as many segments."""


@pytest.fixture(scope="session")
def pile_run(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """The shipped pile of 60 beads."""

    def make(out: Path) -> None:
        tables = read_toml(shipped("case")["pile-ci"])
        tables["run"] |= HALF
        assert not run_case(build_case(tables, name="pile-ci"), out).cached

    (directory,) = once("piles", make).glob("pile-ci-*")
    return directory


@pytest.fixture(scope="session")
def archive(
    run_directory: Callable[..., Path], once: Callable[[str, Callable[[Path], object]], Path]
) -> Path:
    """The archive of a run, to be copied and damaged."""
    return (
        once(
            "archived-run",
            lambda folder: write_archive(run_directory(run=SHORT), folder / "run.zip"),
        )
        / "run.zip"
    )


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
def front(tmp_path: Path) -> Callable[[str], str]:
    """An engine that is a shell script, most often around the real one."""

    def made(script: str) -> str:
        path = tmp_path / "front"
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        return str(path)

    return made


def finished_places(out: Path) -> dict[str, Path]:
    """Directories of all finished runs of a folder, by name."""
    places = (path.parent for path in sorted(out.glob("*/manifest.json")))
    return {
        place.name: place for place in places if place.suffix not in (".incomplete", ".replaced")
    }


def bits(out: Path) -> dict[Path, bytes]:
    """What finished runs computed, by paths: dumps, restart files, tables, results."""
    kinds = (".bin", ".parquet", ".restart", ".txt", "result.json")
    files = (path for place in finished_places(out).values() for path in place.rglob("*"))
    return {path.relative_to(out): path.read_bytes() for path in files if path.name.endswith(kinds)}


def engines_in(directory: Path) -> list[int]:
    """Process ids of the engines that work in a directory or below."""
    return processes_in(
        directory, b"liggghts", b"\0-in\0"
    )  # not ldd, which asks what the engine is linked to


def processes_in(directory: Path, *words: bytes) -> list[int]:
    """Process ids of those that work in a directory or below and whose command has some words in it."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # gone by now, or none of ours
            command, folder = (process / "cmdline").read_bytes(), (process / "cwd").resolve()
            if all(word in command for word in words) and folder.is_relative_to(directory):
                found.append(int(process.name))
    return found


PATIENCE = 300.0
"""How long is waited for what is to happen, in s: many times what it takes on a machine that is busy elsewhere."""


def wait_for(condition: Callable[[], T | None], seconds: float = PATIENCE) -> T:
    """What a condition gives as soon as that is anything."""
    end = time.monotonic() + seconds
    while (began := time.monotonic()) < end:
        if found := condition():
            return found
        # A look may take the processor from what is waited for.
        time.sleep(min(max(0.02, 4.0 * (time.monotonic() - began)), 0.5))
    raise AssertionError("waited in vain")


def call(
    *arguments: str, check: bool = False, folder: Path | None = None, study: str | None = None
) -> subprocess.CompletedProcess[str]:
    """What the program does with these arguments, without the half second that a process of its own takes.

    With a ``study``, such as ``studies.paper``, what ``python -m`` does with that module.

    Its warnings are those of a process of its own, and the handlers that it sets are taken back. Where signals, pipes
    or the interpreter's end matter, tests start `PROGRAM`.
    """
    out, errors = (
        io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2)
    )
    argv = sys.argv
    handlers = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    with (
        redirect_stdout(out),
        redirect_stderr(errors),
        chdir(folder or "."),
        warnings.catch_warnings(),
    ):
        warnings.resetwarnings()
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        try:
            if study:
                sys.argv = [study, *arguments]
                warnings.filterwarnings(
                    "ignore", ".*unpredictable", RuntimeWarning
                )  # a test may have imported it
                runpy.run_module(study, run_name="__main__")
            else:
                main([*arguments])
        except SystemExit as end:
            status = end.code
        finally:
            sys.argv = argv
            for number, handler in handlers.items():
                signal.signal(number, handler)
    told = [stream.buffer.getvalue().decode() for stream in (out, errors)]  # type: ignore[attr-defined]
    done = subprocess.CompletedProcess([PROGRAM, *arguments], int(status or 0), *told)
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
    """Leave no byte on a file system; the file that takes them."""
    with suppress(OSError), (place / "ballast").open("ab", buffering=0) as file:
        while file.write(b"\0" * 4096):
            pass
    return place / "ballast"
