"""Run directories and engines: what is there, what is made again, and every failure, provoked for real."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import walkers
from tests.conftest import (
    BRIEF,
    LONG,
    PATIENCE,
    PROGRAM,
    SHORT,
    brief_pile,
    call,
    document,
    engines_in,
    finished_places,
    make_case,
    open_run,
    processes_in,
    to_toml,
    wait_for,
)
from walkers import run as run_case
from walkers.cache import is_trusted
from walkers.inputs.tables.case import Case
from walkers.physics.laws import young_laplace
from walkers.runner import audit, failures, model_sources, run_directory
from walkers.runner.binary import find_engine
from walkers.runner.compiled_model import plugin_of
from walkers.runner.failures import EngineNeverStarted
from walkers.runner.launch import EngineReport, judge
from walkers.runner.manifest import FinishedRun, read_manifest, write_manifest
from walkers.runner.run_directory import (
    FIRST_SEGMENT,
    case_of,
    is_finished,
    is_locked,
    leave_out_dumps,
    locked,
    read_layout,
    run_place,
)
from walkers.runs.making import make_runs
from walkers.runs.names import find
from walkers.templates.deck import RESTART_NAME, Deck, Segment, render_deck, single_segment

PATIENCE_OF_LOCKS = "walkers.runner.run_directory._PATIENCE_SECONDS"


def _toml(folder: Path, **run: object) -> str:
    file = folder / "test.toml"
    file.write_text(to_toml(document(run=run or SHORT)))
    return str(file)


def test_the_name_depends_on_what_determines_the_run() -> None:
    def name(**changes: object) -> str:
        return run_place(make_case(**changes), find_engine(), Path()).name

    changes: list[dict[str, object]] = [
        {},
        {"run": {"seed": 2}},
        {"run": {"cycles": 61}},
        {"drive": {"frame": "lab"}},
    ]
    changes += [
        {"drive": {"peak_acceleration": "4.01 g"}},
        {"contact": {"rolling_friction": 0.001}},
    ]
    assert len({name(**one) for one in changes}) == len(changes)
    assert name(title="another title") == name()
    other = replace(find_engine(), sha256="0" * 64)
    assert run_place(make_case(), other, Path()).name != name()
    long = run_place(make_case().with_values(name="a b/" * 100), other, Path()).name
    assert (len(long) < 100, "/" in long) == (True, False)


def test_contents_of_a_run_directory(tmp_path: Path) -> None:
    case = make_case(run=SHORT)
    run = run_case(case, tmp_path).directory
    tables = {f"{name}.parquet" for name in ("trajectory", "walkers", "bridges", "cycles")}
    assert {path.name for path in run.iterdir()} == {
        "case.json",
        "manifest.json",
        "result.json",
        "segments",
        *tables,
    }
    dumps = {"beads.bin", "bridges.pairs.txt", "bridges.walls.txt"}
    deck = {"layout.json", "walker.lig", "bridges.txt", "engine.log", "segment.json", "run.sh"}
    assert {path.name for path in (run / FIRST_SEGMENT).iterdir()} == deck | dumps
    assert (case_of(run), read_layout(run / FIRST_SEGMENT)) == (case, render_deck(case).layout)
    manifest = read_manifest(run)
    assert (manifest["status"], manifest["steps"]) == ("finished", case.run.steps)
    assert manifest["engine"]["sha256"] == find_engine().sha256


def test_a_run_is_found_by_its_directory_its_name_or_its_case_with_other_values_too(
    in_folder: Path,
) -> None:
    case_file = _toml(in_folder)
    first, second = (
        json.loads(call("run", case_file, "--json", check=True).stdout) for _ in range(2)
    )
    assert (first["cached"], second["cached"]) == (False, True)
    assert first["velocity"] == second["velocity"]
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert walkers.load(named).directory == Path(first["run"])
    setting = ("--set", "drive.frequency=70Hz")
    assert (
        f"first do: walkers run {case_file} --set drive.frequency=70Hz"
        in call("plot", case_file, *setting).stderr
    )
    slower = json.loads(call("run", first["run"], *setting, "--json", check=True).stdout)
    for named in (first["run"], Path(first["run"]).name, case_file):
        assert walkers.load(named, "runs", {"drive.frequency": "70 Hz"}).directory == Path(
            slower["run"]
        )
        assert json.loads(call("run", named, *setting, "--json", check=True).stdout)["cached"]
    assert (
        walkers.run(case_file, "runs").directory
        == walkers.run(first["run"]).directory
        == Path(first["run"])
    )


def test_a_run_with_other_values_belongs_beside_the_run(tmp_path: Path) -> None:
    """Where its path says, whatever the folder of runs is; a changed case belongs in the folder of runs."""
    first = run_case(make_case(run=BRIEF), tmp_path / "elsewhere").directory
    changes = {"drive.frequency": "70 Hz"}
    named = find(first, tmp_path / "runs", changes)
    assert (named.kind, named.folder, named.finished_run) == ("run", first.parent, None)
    assert find("fig1b", tmp_path / "runs", changes).folder == tmp_path / "runs"
    second = run_case(named.case, named.folder).directory
    assert walkers.load(first, tmp_path / "runs", changes).directory == second


def test_a_running_simulation_is_looked_at_stopped_and_continued(in_folder: Path) -> None:
    case_file = _toml(in_folder, **LONG)
    program = subprocess.Popen([PROGRAM, "run", case_file], stderr=subprocess.DEVNULL)
    wait_for(lambda: list(Path("runs").glob("*.incomplete/case.json")))
    run = walkers.load(next(Path("runs").glob("*.lock")).with_suffix(""))
    assert isinstance(run, walkers.Run)
    wait_for(lambda: run.progress and run.progress.share > 2 / run.case.run.cycles)
    assert (run.status, walkers.load(case_file).status, len(engines_in(in_folder))) == (
        "running",
        "running",
        1,
    )
    assert f"{run.directory}: the run is running: " in call("plot", case_file).stderr
    program.send_signal(signal.SIGINT)
    assert program.wait(PATIENCE) == 130
    assert (run.status, run.progress, engines_in(in_folder)) == ("interrupted", None, [])
    stopped = call("run", str(run.directory), "--limit", "0.2")
    assert (stopped.returncode, "time limit of 0.2 s" in stopped.stderr) == (1, True)
    assert (run.status, "time limit of 0.2 s" in run.describe()) == ("failed", True)


def test_a_finished_run_is_run_again_by_force_only(tmp_path: Path) -> None:
    """One by force that fails leaves the old one."""
    case = make_case(run=SHORT)
    first, again = run_case(case, tmp_path), run_case(case, tmp_path)
    assert (first.cached, again.cached, again.result == first.result) == (False, True, True)
    dump = first.directory / FIRST_SEGMENT / "beads.bin"

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    with dump.open("rb") as before:  # as long as it is open no other file gets its number
        with pytest.raises(KeyboardInterrupt):
            make_runs([case], tmp_path, find_engine(), force=True, on_progress=interrupt)
        assert run_case(case, tmp_path).cached
        assert os.path.samestat(os.fstat(before.fileno()), dump.stat())
        assert not run_case(case, tmp_path, force=True).cached
        assert not os.path.samestat(os.fstat(before.fileno()), dump.stat())
        assert dump.read_bytes() == before.read(), "the same to the last bit"
    assert [path.name for path in tmp_path.iterdir()] == [first.directory.name]


def test_a_crash_within_a_replacement_leaves_no_trace(tmp_path: Path) -> None:
    """Between its two renames the old run is put back; after them it goes, and is no run meanwhile."""
    case = make_case(run=BRIEF)
    place = run_case(case, tmp_path).directory
    left = place.with_name(place.name + ".replaced")
    place.rename(left)
    with open_run(case, find_engine(), tmp_path):
        assert is_finished(place)
    shutil.copytree(place, left)
    assert finished_places(tmp_path) == {place.name: place}
    assert run_case(case, tmp_path).cached
    assert run_case(case, tmp_path, force=True).directory == place
    assert not left.exists()


def test_a_lock_that_somebody_has_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(PATIENCE_OF_LOCKS, 0.1)
    with locked([tmp_path / "x"]) as ours, locked([tmp_path / "x", tmp_path / "y"]) as theirs:
        assert (list(ours), list(theirs)) == ([tmp_path / "x"], [tmp_path / "y"])
        assert is_locked(tmp_path / "x")
    assert not is_locked(tmp_path / "x")
    assert not list(tmp_path.iterdir())


Front = Callable[[str], str]


def _launch(
    case: Case,
    out: Path,
    change: Callable[[str], str] = str,
    *,
    engine: str | None = None,
    time_limit: float | None = None,
    **bounds: float,
) -> None:
    """Make a run whose decks are changed, perhaps with other bounds of the engine."""

    def render(case: Case, segment: Segment) -> Deck:
        deck = render_deck(case, segment)
        return replace(deck, text=change(deck.text), **bounds)  # type: ignore[arg-type]

    with open_run(case, find_engine(engine), out) as run:
        run.make(render=render, time_limit=time_limit)


def _reason(out: Path) -> str:
    """Why a run failed, as the one unfinished directory says that it leaves."""
    (part,) = out.glob("*.incomplete")
    assert not list(out.glob("*/manifest.json"))
    return str(json.loads((part / "failure.json").read_text())["reason"])


def test_engine_missing(tmp_path: Path) -> None:
    with pytest.raises(failures.EngineMissing, match="apt-get install liggghts"):
        run_case(make_case(), tmp_path / "runs", engine="no-such-liggghts")
    assert not (tmp_path / "runs").exists()


def test_a_contact_model_that_cannot_be_compiled_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a compiler, and with one that fails; nothing stays in the cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "bin").mkdir()
    for program in filter(None, map(shutil.which, ("liggghts", "mpicxx", "ldd", "sh", "bash"))):
        (tmp_path / "bin" / Path(program).name).symlink_to(program)
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    with pytest.raises(
        failures.ContactModelMissing, match=r"apt-get install g\+\+ libliggghts-dev libopenmpi-dev"
    ):
        plugin_of(find_engine())
    compiler = tmp_path / "bin" / "g++"
    compiler.write_text("#!/bin/sh\necho 'bridge.cpp:1: error: no such thing' >&2\nexit 1\n")
    compiler.chmod(0o755)
    with pytest.raises(failures.ContactModelMissing, match=r"the compiler says: .*no such thing"):
        plugin_of(find_engine())
    assert not list((tmp_path / "cache").rglob("*.so"))


UNTRUSTED: dict[str, Callable[[Path], object]] = {
    "planted": lambda model: model.write_bytes(model.read_bytes() + b"planted"),
    "cut": lambda model: os.truncate(model, 5000),
    "a symbolic link": lambda model: model.symlink_to(model.rename(model.with_name("other.so"))),
    "of another user": lambda model: os.chown(model, 12345, 12345),
    "writable by the group": lambda model: model.chmod(0o775),
    "without a checksum": lambda model: model.with_suffix(".json").unlink(),
    "a checksum that others can write": lambda model: model.with_suffix(".json").chmod(0o666),
    "compiled from something else": lambda model: model.with_suffix(".json").write_text(
        re.sub(
            '"compiled_from": "\\w+',
            f'"compiled_from": "{"0" * 64}',
            model.with_suffix(".json").read_text(),
        )
    ),
    "in a folder that others can write": lambda model: model.parent.chmod(0o777),
}


@pytest.mark.parametrize("name", UNTRUSTED)
def test_a_contact_model_that_may_not_be_the_compiled_is_compiled_anew(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of sources that are compiled in a fraction of a second. A cache of another user is refused."""
    if os.geteuid():
        pytest.skip("only root can give files away")
    (sources := tmp_path / "engine").mkdir()
    shutil.copy(model_sources.SOURCES / "bridge.map", sources)
    (sources / "bridge.cpp").write_text("// FORCES_VERSION 1\nint small = 1;\n")
    monkeypatch.setattr(model_sources, "SOURCES", sources)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    model = plugin_of(find_engine())
    right, before = model.read_bytes(), model.stat().st_mtime_ns
    assert plugin_of(find_engine()) == model
    assert model.stat().st_mtime_ns == before, "what is right is not compiled again"
    UNTRUSTED[name](model)
    assert plugin_of(find_engine()) == model
    about = model.lstat()
    assert (model.read_bytes() == right, about.st_mtime_ns != before, about.st_uid) == (
        True,
        True,
        os.geteuid(),
    )
    assert (about.st_mode & 0o022, model.parent.stat().st_mode & 0o022) == (0, 0)
    os.chown(model.parent, 12345, 12345)
    with pytest.raises(
        failures.ContactModelMissing, match=r"belongs to another user.*set XDG_CACHE_HOME"
    ):
        plugin_of(find_engine())


NOBODY = 65534


def _double(file: Path) -> None:
    """Double the numbers of a file of the cache, with the right checksum."""
    numbers = 2.0 * np.frombuffer(file.read_bytes()[32:])
    checksum = hashlib.sha256(file.stem.encode() + numbers.tobytes()).digest()
    file.write_bytes(checksum + numbers.tobytes())


def _folder_of_another_user(file: Path) -> None:
    os.chown(file.parent, NOBODY, NOBODY)
    os.chown(file, NOBODY, NOBODY)


def _link_of_another_user(file: Path) -> None:
    elsewhere = file.parent.rename(file.parents[1] / "elsewhere")
    file.parent.symlink_to(elsewhere)
    os.chown(file.parent, NOBODY, NOBODY, follow_symlinks=False)


PLANTED: dict[str, Callable[[Path], object]] = {
    "a file of another user": lambda file: os.chown(file, NOBODY, NOBODY),
    "a file that others can write": lambda file: file.chmod(0o666),
    "a folder that others can write": lambda file: file.parent.chmod(0o777),
    "a folder of another user": _folder_of_another_user,
    "a link of another user": _link_of_another_user,
    "a cache that others can write": lambda file: file.parents[1].chmod(0o777),
    "a cache of another user": lambda file: os.chown(file.parents[1], NOBODY, NOBODY),
}
"""How the numbers in a file of the cache can be those of another user."""


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache without contents, and a solver that has forgotten its solutions."""
    if os.geteuid():
        pytest.skip("only root can give files away")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    young_laplace._solved.cache_clear()
    return tmp_path / "cache" / "granular-walkers"


def _force_at_contact() -> float:
    """Capillary force of a bead on a substrate at contact, in units of R γ."""
    young_laplace._solved.cache_clear()
    _, force = young_laplace._solved((math.inf, 0.01, 0.0))
    return float(force(1.0))


@pytest.mark.parametrize("name", PLANTED)
def test_capillary_forces_that_another_user_wrote_are_not_believed(
    name: str, empty_cache: Path
) -> None:
    """They are computed again, and a cache of the user's own keeps them."""
    force = _force_at_contact()
    assert 9.0 < force < 4.0 * math.pi, "the bridge pulls a little less than 4 π R γ"
    (file,) = empty_cache.glob("young-laplace/*.bin")
    _double(file)
    assert _force_at_contact() == 2.0 * force, "numbers of the user are read"
    PLANTED[name](file)
    assert _force_at_contact() == force
    is_foreign = name == "a cache of another user"
    assert is_trusted(file) != is_foreign
    assert (_force_at_contact(), empty_cache.stat().st_uid == NOBODY) == (force, is_foreign)


@pytest.mark.parametrize("name", PLANTED)
def test_audits_that_another_user_wrote_are_not_believed(name: str, empty_cache: Path) -> None:
    passed = {"passed": True, "lines": 80, "failures": [], "date": "2026-01-01T00:00:00Z"}
    audit.write_audit("engine", {"contact_model": "0" * 64, **passed})
    assert audit.read_audit("engine", None) == passed
    (file,) = empty_cache.glob("audits/*.json")
    PLANTED[name](file)
    assert audit.read_audit("engine", None) is None


def test_an_audit_is_kept_whatever_files_others_of_the_group_may_write(empty_cache: Path) -> None:
    before = os.umask(0o002)
    try:
        audit.write_audit(
            "engine", {"contact_model": "0", "passed": True, "lines": 1, "failures": [], "date": ""}
        )
    finally:
        os.umask(before)
    assert audit.read_audit("engine", "0") is not None


def test_another_version_of_the_forces_is_another_engine(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(model_sources.SOURCES, tmp_path / "engine")
    monkeypatch.setattr(model_sources, "SOURCES", tmp_path / "engine")
    before, source = find_engine(), tmp_path / "engine" / "bridge.cpp"
    text = source.read_text()
    for changed, same in (
        (f"{text}// another line\n", True),
        (re.sub(r"(FORCES_VERSION) \d+", r"\1 0", text), False),
    ):
        source.write_text(changed)
        assert (find_engine() == before) == same


def _half(text: str) -> str:
    return re.sub(
        r"(?m)^(run +|variable +cycles string )(\d+)",
        lambda one: f"{one[1]}{int(one[2]) // 2}",
        text,
    )


def _narrow(text: str) -> str:
    """A box whose wall stands half a millimetre ahead of the walker."""
    (start,) = set(re.findall(r"create_atoms +1 single (\S+)", text)[:1])
    return re.sub(r"(region +box block \S+) \S+", r"\1 0.0010", text).replace(start, "0.0005")


# A force that becomes infinity minus infinity a few hundred steps on.
INFINITE = "variable bad equal (step>300)*(1e308*100-1e308*100)\nfix bad all addforce v_bad 0 0\nfix motion"
FAST = {"drive": {"peak_acceleration": "8 g"}, "run": {"cycles": 60, "settling_cycles": 2}}
UNSTABLE = {
    "liquid": {"name": "glycerol 87 %"},
    "run": {
        "time_step": "30 us",
        "allow_unstable": True,
        "samples_per_cycle": 1,
        "cycles": 60,
        "settling_cycles": 2,
    },
}
BAD_DECKS: dict[
    str, tuple[dict[str, object], Callable[[str], str], type[failures.EngineFailure], str]
] = {
    "an error": (
        {"run": SHORT},
        lambda text: re.sub("run  ", "w\udcff\udcfebble  ", text),
        *(failures.EngineError, r"Unknown command: w\\xff\\xfebble"),
    ),
    "half of the steps": ({"run": SHORT}, _half, failures.MissingFrames, "31 of 61 frames"),
    "beads that are lost": (FAST, _narrow, failures.BeadsLost, "left the simulation box"),
    "no numbers": (
        {"run": SHORT},
        lambda text: re.sub("fix +motion", INFINITE, text),
        failures.BlowUp,
        "not a number",
    ),
    "a long one": ({"run": LONG}, str, failures.TimeLimitExceeded, r"0\.6 s"),
}


@pytest.mark.parametrize("name", BAD_DECKS)
def test_decks_that_fail(tmp_path: Path, name: str) -> None:
    changes, change, kind, told = BAD_DECKS[name]
    limit = 0.6 if kind is failures.TimeLimitExceeded else None
    with pytest.raises(kind, match=told) as failure:
        _launch(make_case(**changes), tmp_path, change, time_limit=limit)
    assert failure.value.directory == next(tmp_path.glob("*.incomplete/segments/0000.new"))
    assert _reason(tmp_path) == kind.__name__
    assert not engines_in(tmp_path)


# After the banner's version an engine may say nothing or too much, and not care for SIGTERM.
STRANGE_ENGINES = {
    "another version": (
        'liggghts "$@" | sed "s/LIGGGHTS-PUBLIC 3.8.0/LIGGGHTS-PUBLIC 4.0.0/"',
        *(failures.OtherEngine, r"4\.0\.0.*3\.8\.0"),
    ),
    "crashes": ("kill -SEGV $$", failures.EngineKilled, "SIGSEGV"),
    "is killed": ('liggghts "$@" & sleep 0.3; kill -KILL $$', failures.EngineKilled, "SIGKILL"),
    "cuts a dump": (
        'liggghts "$@" && truncate -s -5 bridges.pairs.txt',
        failures.MissingFrames,
        r"wrote \d+ of",
    ),
    "ends without a word": ("exit 7", failures.EngineFailure, "exit status 7, without output"),
    "says nothing": (
        "trap '' TERM; while :; do sleep 0.1; done",
        *(failures.EngineSilent, r"nothing for 0\.5 s after step 0 of \d+"),
    ),
    "stops saying anything": (
        "liggghts -log none -in walker.lig; exec sleep 4711",
        *(failures.EngineSilent, r"step (\d+) of \1;"),
    ),
    "writes lines without end": (
        "trap '' TERM; yes | tee -i /dev/null",
        failures.LogTooLong,
        "beyond 2 MB",
    ),
    "ends after too long a log": (
        'yes | head -c 2100000; exec liggghts "$@"',
        *(failures.LogTooLong, "beyond 2 MB"),
    ),
}


@pytest.mark.parametrize("name", STRANGE_ENGINES)
def test_strange_engines_are_ended_and_told(front: Front, tmp_path: Path, name: str) -> None:
    script, kind, told = STRANGE_ENGINES[name]
    # An engine starts within seconds even on a busy machine.
    bounds = {
        "silence": {"says nothing": 0.5, "stops saying anything": 4.0}.get(name, 60.0),
        "log_limit": 2e6,
    }
    with pytest.raises(kind, match=told) as failure:
        _launch(
            make_case(run=SHORT),
            tmp_path / "runs",
            engine=front(script),
            time_limit=PATIENCE,
            **bounds,
        )
    assert "last line" not in str(failure.value)
    wait_for(lambda: not processes_in(tmp_path))
    assert _reason(tmp_path / "runs") == type(failure.value).__name__
    (log,) = tmp_path.glob("runs/*/segments/*/engine.log")
    assert log.stat().st_size <= 2_000_000


def test_a_failed_run_is_remembered_when_the_spread_of_the_next_one_succeeds(
    in_folder: Path,
) -> None:
    guessed = {"contact": {"restitution": 0.3}, "uncertain": {"contact.restitution": [0.2, 0.4]}}
    (in_folder / "hot.toml").write_text(to_toml(document(**UNSTABLE, **guessed)))
    (in_folder / "good.toml").write_text(to_toml(document(run=SHORT, **guessed)))
    done = call("run", "hot.toml", "good.toml", "--spread", "--points", "2", "--json")
    assert done.returncode == 1
    assert "walkers: hot: blow-up" in done.stderr
    (printed,) = map(json.loads, done.stdout.splitlines())
    assert (printed["case"], "spread" in printed) == ("good", True)
    assert call("run", "good.toml", "--spread", "--points", "2").returncode == 0


def test_an_engine_that_never_started_is_tried_twice_again(front: Front, tmp_path: Path) -> None:
    """The first times it cannot initialise MPI, for it asks for a component there is not."""
    births, case = tmp_path / "births", make_case(run=SHORT)
    for times in (2, 99):
        births.write_text("")
        fails = f'echo born >> "{births}"\n[ $(wc -l < "{births}") -le {times} ] && export OMPI_MCA_coll=none-such\n'
        engine, out = front(f'{fails}exec liggghts "$@"'), tmp_path / f"runs-{times}"
        if times == 2:
            assert run_case(case, out, engine=engine).result["velocity"] > 0.0
        else:
            with pytest.raises(EngineNeverStarted, match="never started: exit status"):
                run_case(case, out, engine=engine)
        assert births.read_text().count("born") == 3


MPI = (
    "btl=tcp",
    "pml=cm",
    "mtl=no",
    "rmaps=no",
    "oob=no",
    "ess=singleton",
    "orte_default_hostfile=/none",
)
SURROUNDINGS = {
    "settings of Open MPI": {
        f"OMPI_MCA_{one.partition('=')[0]}": one.partition("=")[2] for one in MPI
    },
    "what is not there": {"LD_PRELOAD": "/no/such/library.so", "TMPDIR": "/proc"},
}


@pytest.mark.parametrize("name", SURROUNDINGS)
def test_what_a_user_has_set_in_the_environment_does_not_matter(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin_of(find_engine())  # is there: a compiler needs temporary files
    for variable, value in SURROUNDINGS[name].items():
        monkeypatch.setenv(variable, value)
    assert not run_case(make_case(run=SHORT), tmp_path).cached
    if "MPI" in name:
        pile = brief_pile(ranks=2, duration="0.01 s", longest_settling="0.01 s")
        assert not run_case(pile, tmp_path, time_limit=PATIENCE).cached


def test_lines_of_a_log_are_judged(tmp_path: Path) -> None:
    """A step that is printed twice; a calm line after a failure, read in one look."""
    deck = render_deck(make_case(run=SHORT), single_segment(make_case(run=SHORT)))
    twice, calm = (
        [(100, 0, 0.01), (100, 1, 0.01)],
        [(100, 0, 0.01), (200, 0, 1000.0), (300, 0, 0.01)],
    )
    for rows, kind, told in (
        (twice, failures.EngineFailure, "bead"),
        (calm, failures.BlowUp, r"moves at 1e\+03 m/s after step 200"),
    ):  # step, lost beads, speed (m/s)
        lines = [
            f" {step} {deck.layout.atoms - lost} {speed} -1e-3 1e-3 -1e-3 1e-3 0 1e-3"
            for step, lost, speed in rows
        ]
        log = tmp_path / "engine.log"
        log.write_text("\n".join(["LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, x)", *lines, ""]))
        with pytest.raises(kind, match=told):
            judge(deck, tmp_path, log)


def test_tables_of_an_edited_deck_have_decimal_points_in_any_language(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine calls awk, which would write the decimal commas of the user's language."""
    (in_folder / "bin").mkdir()
    awk = in_folder / "bin" / "awk"
    awk.write_text(
        f'#!/bin/sh\necho "$LC_ALL" >> {in_folder}/language\nexec {shutil.which("awk")} "$@"\n'
    )
    awk.chmod(0o755)
    monkeypatch.setenv("PATH", f"{in_folder}/bin:{os.environ['PATH']}")
    monkeypatch.setenv("LC_ALL", "de_DE.UTF-8")
    call("export", _toml(in_folder), "--to", "deck", "-o", "deck", check=True)
    deck = in_folder / "deck" / "walker.lig"
    deck.write_text(re.sub(r"(variable +viscosity string) \S+", r"\1 0.01", deck.read_text()))
    subprocess.run(["sh", "run.sh"], cwd=deck.parent, check=True)
    assert (in_folder / "language").read_text() == "C\n"


def test_a_pile_without_dumps_has_no_restart_files(pile_run: Path, tmp_path: Path) -> None:
    """The run of a pile has segments, and a file to continue from after each."""
    copy = Path(shutil.copytree(pile_run, tmp_path / pile_run.name))
    assert len(list(copy.rglob(RESTART_NAME))) > 1
    leave_out_dumps(copy)
    assert not list(copy.rglob(RESTART_NAME))
    assert walkers.load(copy).result.as_dict() == walkers.load(pile_run).result.as_dict()


def test_steps_per_second_are_those_of_the_engines_loop(tmp_path: Path) -> None:
    """1000 steps in 2 s; the engine also took 2 s to start."""
    report = EngineReport("LIGGGHTS", wall_seconds=4.0, loop_seconds=2.0, steps=1000)
    run = FinishedRun(
        case=make_case(),
        name="test-0123456789ab",
        engine=None,
        report=report,
        started=time.time() - 5.0,
        segments=1,
        drive_from=0,
    )
    write_manifest(tmp_path, run)
    manifest = read_manifest(tmp_path)
    assert (manifest["steps"], manifest["steps_per_second"]) == (1000, 500.0)
    assert (manifest["seconds"]["engine"], manifest["seconds"]["engine_loop"]) == (4.0, 2.0)
    assert manifest["seconds"]["total"] == pytest.approx(5.0, abs=1.0)


@pytest.mark.parametrize("name", ["CONTENT_VERSION", "FORMAT"])
def test_decks_of_another_version_are_other_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, engine = make_case(), find_engine()
    place = run_place(case, engine, tmp_path)
    assert run_place(case, engine, tmp_path) == place
    monkeypatch.setattr(run_directory, name, getattr(run_directory, name) + 1)
    assert run_place(case, engine, tmp_path) != place


def test_another_engine_makes_other_runs(tmp_path: Path) -> None:
    case, engine = make_case(), find_engine()
    other = replace(engine, sha256="0" * 64)
    assert run_place(case, other, tmp_path) != run_place(case, engine, tmp_path)
