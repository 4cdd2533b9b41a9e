"""What a run is worth later: its manifest, its checksums, and archives that others can read, check and use again."""

import hashlib
import importlib.resources
import io
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rocrate.rocrate import ROCrate

import walkers
from tests.conftest import SHORT, brief_pile, call, document, make_case, to_toml
from walkers import Run, load_case
from walkers.archive.contents import Contents, contents_of
from walkers.archive.crate import PAPER, Author, describe_crate
from walkers.archive.writing import write_archive
from walkers.files import write_json
from walkers.inputs.tables.case import Case
from walkers.runner.directory import leave_out_dumps
from walkers.runner.manifest import FileChanged, read_manifest
from walkers.runner.model_sources import model_version
from walkers.runner.provenance import software
from walkers.sweeps.table import load

AUTHOR = ("--author", "Josiah Carberry", "--orcid", "0000-0002-1825-0097")
CONTEXT = "https://w3id.org/ro/crate/1.1/context"
CRATE, SUMS = "ro-crate-metadata.json", "sha256sums.txt"


@pytest.fixture
def run(run_directory: Callable[..., Path], tmp_path: Path) -> Path:
    """A copy of a finished run, to be changed."""
    there = run_directory(run=SHORT)
    return Path(shutil.copytree(there, tmp_path / "runs" / there.name))


@pytest.fixture
def shared(once: Callable[[str, Callable[[Path], object]], Path], tmp_path: Path) -> Path:
    """The runs of a sweep whose points share a deck, to be changed."""

    def fill(folder: Path) -> None:
        (folder / "base.toml").write_text(to_toml(document(run=SHORT)))
        (folder / "angles.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
        call("sweep", "angles.toml", "-j", "1", check=True, folder=folder)

    return Path(shutil.copytree(once("archived-sweep", fill) / "runs", tmp_path / "shared"))


def _issues(archive: Path, folder: Path) -> list[str]:
    """What the validator of RO-Crates finds, without a network: its cache is given the context that rocrate ships."""
    import requests
    from requests_cache import CachedSession
    from rocrate_validator.models import Severity
    from rocrate_validator.services import ValidationSettings, validate
    from urllib3 import HTTPResponse

    session = CachedSession(cache_name=str(folder / "http"), backend="sqlite", expire_after=-1)
    text = (importlib.resources.files("rocrate") / "data" / "ro-crate.jsonld").read_bytes()
    asked = requests.Request("GET", CONTEXT).prepare()
    head = {"Content-Type": "application/ld+json"}
    raw = HTTPResponse(io.BytesIO(text), head, 200, preload_content=False, request_url=CONTEXT)
    session.cache.save_response(requests.adapters.HTTPAdapter().build_response(asked, raw))
    session.close()
    how = {"offline": True, "cache_path": folder / "http", "requirement_severity": Severity.REQUIRED}
    asked_of = ValidationSettings(rocrate_uri=str(archive), profile_identifier="process-run-crate", **how)
    return [str(issue.check.name) for issue in validate(asked_of).get_issues()]


def _verified(path: Path, status: int = 0) -> list[str]:
    """Lines that ``walkers check files`` prints."""
    done = call("check", "files", str(path))
    assert done.returncode == status, (done.stdout, done.stderr)
    return (done.stdout + done.stderr).splitlines()


def test_manifests_say_what_made_the_run(run: Path) -> None:
    manifest = read_manifest(run)
    files = {path.relative_to(run).as_posix(): path for path in run.rglob("*") if path.is_file()}
    del files["manifest.json"]
    assert manifest["sha256"] == {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}
    assert manifest["files"] == {name: path.stat().st_size for name, path in files.items()}
    assert manifest["packages"]["numpy"] == np.__version__
    assert manifest["commit"] == software()["commit"]


def test_what_changed_is_named(run: Path, tmp_path: Path) -> None:
    """Nothing is read from pictures and films; a folder of segments is taken for a part of the run."""
    files = len(read_manifest(run)["files"])
    assert _verified(run) == [f"{run.name}: {files} files are unchanged"]
    for name in ("film.mp4", "vtk/beads_000000.vtu", "\x1b[2J"):
        (run / name).parent.mkdir(exist_ok=True)
        (run / name).write_bytes(b"new")
    since = [f"  made since {name}" for name in (r"\x1b[2J", "film.mp4", "vtk/")]
    assert _verified(run)[1:] == since
    dump = run / "segments" / "0000" / "beads.bin"
    dump.write_bytes(bytes([dump.read_bytes()[0] ^ 1]) + dump.read_bytes()[1:])
    (run / "walkers.parquet").unlink()
    (run / "segments" / "0001").mkdir()
    (run / "segments" / "0002").symlink_to(tmp_path)
    unknown = ("climbs.parquet", "segments/0000/walk.png")
    for name in unknown:
        (run / name).touch()
    assert _verified(run, 1) == [
        f"{run.name}: {files - 2} files are unchanged",
        "  changed    segments/0000/beads.bin",
        "  missing    walkers.parquet",
        *(f"  not listed {name}" for name in (*unknown, "segments/0001", "segments/0002")),
        *since,
    ]


def test_an_archive_of_a_run(run: Path, tmp_path: Path) -> None:
    archive, again = tmp_path / "run.zip", tmp_path / "again.zip"
    for path in (archive, again):
        call("export", str(run), "--to", "archive", "-o", str(path), *AUTHOR, check=True)
    assert archive.read_bytes() == again.read_bytes()
    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(archive, unpacked)
    assert len(_verified(unpacked)) == 1
    subprocess.run(["sha256sum", "--check", "--quiet", SUMS], cwd=unpacked, check=True)
    there = unpacked / "runs" / run.name
    assert Run(there).result == Run(run).result
    assert load_case(there / "test.toml") == make_case(run=SHORT)
    (there / "result.json").unlink()
    (there / "result.json").symlink_to("nowhere")
    assert _verified(unpacked, 1)[1] == f"  missing    runs/{run.name}/result.json"
    crate, manifest, place = ROCrate(unpacked), read_manifest(run), f"runs/{run.name}"
    root = crate.root_dataset
    assert (root["citation"].id, root["license"].id.rpartition("/")[2]) == (PAPER, "CC-BY-4.0")
    assert root["datePublished"] == manifest["finished"]
    assert {name: crate.get(f"{place}/{name}")["sha256"] for name in manifest["sha256"]} == manifest["sha256"]
    engine, analysis = root["mentions"]
    assert engine["instrument"]["sha256"] == manifest["engine"]["sha256"]
    names = {what: {Path(item.id).name for item in engine[what]} for what in ("object", "result")}
    assert names["object"] >= {"walker.lig", "bridges.txt", "run.sh"}
    assert names["result"] == {"beads.bin", "bridges.pairs.txt", "bridges.walls.txt", "engine.log", "segment.json"}
    assert {Path(item.id).name for item in analysis["result"]} >= {"result.json", "trajectory.parquet"}


def test_an_archive_has_the_date_of_its_last_run() -> None:
    dates = ("2026-03-01T10:00:00Z", "2026-03-02T09:00:00Z", "2026-02-28T23:00:00Z")
    assert Contents("three", "", {date: {"finished": date} for date in dates}, {}, []).finished == dates[1]


def test_the_tables_of_an_archive_are_made_by_the_program_that_made_the_last(shared: Path) -> None:
    """One run was measured again, by a later version, after both were finished."""
    contents = contents_of(shared / "angles")
    last = next(iter(contents.manifests.values()))
    last["tabulated"] = {**software(), "granular_walkers": "99.0", "commit": None, "date": "2099-01-01T00:00:00Z"}
    entities = {one["@id"]: one for one in describe_crate(contents, [], "CC0-1.0")["@graph"]}
    (tables,) = (one for one in entities.values() if one.get("name") == "Tables of angles")
    assert entities[tables["instrument"]["@id"]]["softwareVersion"] == "99.0"
    assert tables["endTime"] == "2099-01-01T00:00:00Z"


def test_an_archive_without_dumps(run: Path, tmp_path: Path) -> None:
    archive, again = tmp_path / "run.zip", tmp_path / "again.zip"
    call("export", str(run), "--to", "archive", "-o", str(archive), "--without-dumps", check=True)
    shutil.unpack_archive(archive, tmp_path / "unpacked")
    there = tmp_path / "unpacked" / "runs" / run.name
    dumps = [f"  left out   segments/0000/{name}" for name in ("beads.bin", "bridges.pairs.txt", "bridges.walls.txt")]
    files = len(read_manifest(run)["files"])
    assert _verified(there) == [f"{run.name}: {files - 3} files are unchanged", "  made since test.toml", *dumps]
    assert Run(there).result == Run(run).result
    call("export", str(there), "--to", "archive", "-o", str(again), "--without-dumps", check=True)
    assert archive.read_bytes() == again.read_bytes()
    done = call("render", str(there))
    assert (done.returncode, "beads.bin" in done.stderr) == (1, True)


def test_an_archive_of_a_sweep(shared: Path, tmp_path: Path) -> None:
    """Runs that shared a deck come with it, and the table is what it was."""
    archive, unpacked = tmp_path / "sweep.zip", tmp_path / "unpacked"
    call("export", str(shared / "angles"), "--to", "archive", "-o", str(archive), *AUTHOR, check=True)
    assert _issues(archive, tmp_path) == []
    shutil.unpack_archive(archive, unpacked)
    there = unpacked / "runs" / "angles"
    before, after = (load(folder).drop(columns="run") for folder in (shared / "angles", there))
    assert list(after["status"]) == ["finished"] * 2
    assert before.equals(after)
    places = [unpacked / place for place in pd.read_csv(there / "table.csv")["run"]]
    assert [place.name for place in places] == [Path(place).name for place in load(shared / "angles")["run"]]
    for place, angle in zip(places, ("0 deg", "10 deg"), strict=True):
        assert load_case(place / "base.toml") == Case.read(document(run=SHORT, dimers={"angle": angle}), name="base")
    actions = [action["name"].split()[0] for action in ROCrate(unpacked).root_dataset["mentions"]]
    assert actions == ["Simulation", "Simulation", "Tables"]
    assert _verified(there)[0] == "angles: 2 points have a run"
    deck = places[0] / "shared_deck" / "walker.lig"
    deck.write_text(deck.read_text().replace("gravity", "levity"))
    assert _verified(there, 1).count("  changed    shared_deck/walker.lig") == 1
    for place in places:
        shutil.rmtree(place)
    gone = _verified(there, 1)
    assert (gone[0], sum("(missing: point " in line for line in gone)) == ("angles: 0 points have a run", 2)
    refused = call("export", str(there), "--to", "archive", "-o", str(tmp_path / "two.zip"))
    assert (refused.returncode, "2 of 2 points are not finished" in refused.stderr) == (2, True)


def test_a_run_without_dumps_keeps_its_results_and_is_whole(run: Path) -> None:
    """All that only pictures read has gone, as of draws of a spread; the check says that it was left out."""
    leave_out_dumps(run)
    names = ("beads.bin", "bridges.pairs.txt", "bridges.txt", "bridges.walls.txt", "state.restart")
    assert not [path for path in run.rglob("*") if path.name in names]
    left = [line.split("/")[-1] for line in _verified(run) if line.startswith("  left out ")]
    assert sorted(left) == [name for name in names if name != "state.restart"]
    assert Run(run).result["velocity"] == Run(run).result.table("walkers")["velocity"].mean()


def test_an_archive_that_cannot_be_made_leaves_the_older_one(run: Path, archive: Path, tmp_path: Path) -> None:
    older = Path(shutil.copy(archive, tmp_path / "run.zip"))
    with next(run.rglob("engine.log")).open("a") as log:
        log.write("more\n")
    with pytest.raises(FileChanged, match=r"engine\.log has changed"):
        write_archive(run, older, dumps=False)
    assert older.read_bytes() == archive.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.zip", "runs"]


@pytest.mark.parametrize(
    ("name", "contents", "status", "said"),
    [
        ("film.mp4", b"new", 0, "made since film.mp4"),
        ("notes.txt", b"new", 1, "not listed notes.txt"),
        ("result.json", None, 1, "result.json"),
        (CRATE, None, 1, f"missing    {CRATE}"),
        (SUMS, b"what it is not", 2, "expected a checksum and a path"),
        (SUMS, None, 2, f"or an archive ({SUMS})"),
    ],
)
def test_archives_whose_lists_are_not_what_they_hold(
    archive: Path, tmp_path: Path, name: str, contents: bytes | None, status: int, said: str
) -> None:
    """A file is added or replaced; without contents it is removed."""
    shutil.unpack_archive(archive, tmp_path / "unpacked")
    files = {path.name: path for path in (tmp_path / "unpacked").rglob("*")}
    path = files.get(name, tmp_path / "unpacked" / name)
    path.unlink() if contents is None else path.write_bytes(contents)
    assert any(said in line for line in _verified(tmp_path / "unpacked", status))


@pytest.fixture(scope="session")
def built_model(archive: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """The contact model as it is compiled from the sources in an archive: four seconds."""

    def fill(folder: Path) -> None:
        shutil.unpack_archive(archive, folder)
        subprocess.run(["sh", "contact_model/build.sh"], cwd=folder, check=True)

    return once("built-model", fill) / "contact_model" / "bridge.so"


Repeat = Callable[[Path, str], subprocess.CompletedProcess[str]]


@pytest.fixture
def repeat(built_model: Path) -> Repeat:
    """Calls the script of an unpacked archive that repeats a run; it knows of no granular-walkers."""

    def called(unpacked: Path, run: str) -> subprocess.CompletedProcess[str]:
        shutil.copy(built_model, unpacked / "contact_model")
        command = ["sh", "repeat.sh", f"runs/{run}", "repeated"]
        return subprocess.run(command, cwd=unpacked, capture_output=True, text=True, check=False)

    return called


def _long_run(folder: Path) -> Path:
    """A pile in three segments."""
    return walkers.run(brief_pile(), folder / "runs").directory


def _parallel_run(folder: Path) -> Path:
    """A pile by two MPI processes, which wait for each other where cores are busy."""
    return walkers.run(brief_pile(ranks=2, duration="0.01 s"), folder / "runs").directory


def _edited_deck(folder: Path) -> Path:
    """A deck that was edited and run by hand, with tables that the engine rescales for its viscosity."""
    (folder / "case.toml").write_text(to_toml(document(run=SHORT)))
    deck = folder / "by-hand"
    call("export", str(folder / "case.toml"), "--to", "deck", "-o", str(deck), check=True)
    text = (deck / "walker.lig").read_text()
    (deck / "walker.lig").write_text(re.sub(r"(variable +viscosity string) \S+", r"\1 0.01", text))
    subprocess.run(["sh", "run.sh"], cwd=deck, check=True)
    call("run", str(deck), check=True)
    return deck


@pytest.mark.parametrize("make", [_long_run, pytest.param(_parallel_run, marks=pytest.mark.slow), _edited_deck])
def test_liggghts_alone_repeats_the_run_of_an_archive(
    make: Callable[[Path], Path], repeat: Repeat, tmp_path: Path
) -> None:
    """By the words of its README: the contact model is compiled from the sources in the archive."""
    directory = make(tmp_path)
    call("export", str(directory), "--to", "archive", "-o", str(tmp_path / "run.zip"), check=True)
    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(tmp_path / "run.zip", unpacked)
    shutil.rmtree(tmp_path / "runs", ignore_errors=True)
    done = repeat(unpacked, directory.name)
    assert done.returncode == 0, done.stderr
    dumps = len([*unpacked.glob("runs/**/beads.bin"), *unpacked.glob("runs/**/bridges.*s.txt")])
    assert done.stdout.count("the same   ") == len(done.stdout.splitlines()) == dumps >= 3
    assert f"sh repeat.sh runs/{directory.name} ../repeated-by-liggghts" in (unpacked / "README.md").read_text()
    # A dump that is not the engine's is found.
    beads = sorted(unpacked.glob("runs/**/beads.bin"))[-1]
    beads.write_bytes(beads.read_bytes()[:-1] + b"x")
    shutil.rmtree(unpacked / "repeated")
    again = repeat(unpacked, directory.name)
    assert (again.returncode, again.stdout.count("different  ")) == (1, 1)


def test_an_archive_says_what_it_cannot_repeat(shared: Path, repeat: Repeat, tmp_path: Path) -> None:
    """A shared deck is run for all of its runs; without tables of forces there is nothing to run."""
    call("export", str(shared / "angles"), "--to", "archive", "-o", str(tmp_path / "two.zip"), check=True)
    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(tmp_path / "two.zip", unpacked)
    run = Path(pd.read_csv(unpacked / "runs" / "angles" / "table.csv")["run"][0]).name
    done = repeat(unpacked, run)
    assert done.returncode == 0, done.stderr
    assert "written    shared_deck/beads.bin (nothing to compare with)" in done.stdout
    assert (unpacked / "repeated" / "shared_deck" / "beads.bin").stat().st_size > 10_000
    shutil.rmtree(unpacked / "repeated")
    (unpacked / "runs" / run / "shared_deck" / "bridges.txt").unlink()
    refused = repeat(unpacked, run)
    assert (refused.returncode, "tables of forces (bridges.txt) were left out" in refused.stderr) == (2, True)


def test_the_readme_says_who_made_the_archive_and_with_which_contact_model(run: Path, tmp_path: Path) -> None:
    assert read_manifest(run)["contact_model"].items() >= model_version().items()
    author = [Author("A. User")]
    texts = []
    for version in (model_version(), {"forces_version": model_version()["forces_version"]}, {}):
        manifest = read_manifest(run)
        manifest["contact_model"] = {"path": "", "sha256": "", **version}
        write_json(run / "manifest.json", manifest)
        with zipfile.ZipFile(write_archive(run, tmp_path / "run.zip", authors=author)) as packed:
            texts.append(packed.read("README.md").decode())
    assert "computed from it.\n\nBy A. User. Licence: CC-BY-4.0" in texts[0]
    same, other, unknown = texts
    assert "The runs were made with these sources." in same
    assert "other sources that compute the same forces" in other
    assert "or do not record it" in unknown


@pytest.fixture(scope="session")
def uncertain(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A folder with a sweep of two points, each with a spread, and with the accuracy of the first one."""

    def fill(folder: Path) -> None:
        ranges = {"uncertain": {"contact.restitution": [0.2, 0.5]}}
        (folder / "base.toml").write_text(to_toml(document(run=SHORT, **ranges)))
        (folder / "angles.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
        command = ["sweep", "angles.toml", "-j", "1", "--spread", "--points", "2"]
        call(*command, check=True, folder=folder)
        call("run", "base.toml", "--accuracy", check=True, folder=folder)

    return once("uncertain", fill)


@pytest.mark.parametrize("what", ["a run", "a sweep"])
def test_archives_have_the_spread_and_the_accuracy(what: str, uncertain: Path, tmp_path: Path) -> None:
    """A colleague sees the same band, error and figures, and the check finds nothing missing."""
    table = load(uncertain / "runs" / "angles")
    runs = [Path(run).name for run in table["run"]]
    packed = runs[0] if what == "a run" else "angles"
    archive, unpacked = tmp_path / "archive.zip", tmp_path / "unpacked"
    command = ["export", str(uncertain / "runs" / packed), "--to", "archive", "-o", str(archive)]
    call(*command, check=True)
    shutil.unpack_archive(archive, unpacked)
    assert _issues(archive, tmp_path) == []
    there = unpacked / "runs"
    assert len(_verified(unpacked)) == 1
    for run in runs[:1] if what == "a run" else runs:
        before, after = (Run(folder / run).result for folder in (uncertain / "runs", there))
        assert {"velocity_low", "velocity_high", "velocity_draws"} <= after.keys()
        assert after == before
        assert list(load(there / f"{run}-spread")["status"]) == ["finished"] * len(load(there / f"{run}-spread"))
        call("plot", str(there / f"{run}-spread"), "--to", str(tmp_path / "draws.png"), check=True)
    assert Run(there / runs[0]).result["velocity_error"] == Run(uncertain / "runs" / runs[0]).result["velocity_error"]
    assert (there / f"{runs[0]}-accuracy" / "sweep.json").is_file()
    told = call("run", str(there / runs[0]), check=True).stdout
    assert re.search(r"velocity along the heading .* band [0-9.]+ to [0-9.]+", told)
    if what == "a sweep":
        columns = ["velocity", "velocity_low", "velocity_high"]
        assert load(there / "angles")[columns].equals(table[columns])
