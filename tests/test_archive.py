"""What a run is worth later: its manifest, its checksums, and archives that others can read, check and use again."""

import hashlib
import importlib.resources
import io
import json
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import requests
from requests_cache import CachedSession
from rocrate.rocrate import ROCrate
from rocrate_validator.models import Severity
from rocrate_validator.services import ValidationSettings, validate
from urllib3 import HTTPResponse

from tests.conftest import SHORT, call, document, make_case, to_toml
from walkers import Run, load_case
from walkers.archive import writing
from walkers.archive.citation import PAPER
from walkers.archive.writing import ArchiveOptions, ArchiveRefused, write_archive
from walkers.inputs.reading import resolve_case
from walkers.runner.directory import FinishedRun
from walkers.runner.provenance import commit_of, software
from walkers.sweeps.table import load

AUTHOR = ("--author", "Josiah Carberry", "--orcid", "0000-0002-1825-0097")
CONTEXT = "https://w3id.org/ro/crate/1.1/context"
NOT_SAID = {
    "Application url",  # of this project, which has no home on the web yet
    "SoftwareApplication id",
    "Root Data Entity: `publisher` property",
    "CreativeWork Author: RECOMMENDED affiliation property",
    "CreativeWork Author: RECOMMENDED Contextual Entity linked for the organizational `affiliation` property",
}
"""What the profiles recommend and archives leave open, for nobody has been asked."""


@pytest.fixture
def run(run_directory: Callable[..., Path], tmp_path: Path) -> Path:
    """A copy of a finished run, to be changed."""
    there = run_directory(run=SHORT)
    return Path(shutil.copytree(there, tmp_path / "runs" / there.name))


@pytest.fixture(scope="session")
def whole(run_directory: Callable[..., Path], once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """The archive of a run, to be copied and damaged."""
    return once("archived-run", lambda folder: write_archive(run_directory(run=SHORT), folder / "run.zip")) / "run.zip"


@pytest.fixture(scope="session")
def shared(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """The runs of a sweep whose points share a deck."""

    def fill(folder: Path) -> None:
        (folder / "base.toml").write_text(to_toml(document(run=SHORT)))
        (folder / "angles.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
        call("sweep", "angles.toml", "-j", "1", check=True, folder=folder)

    return once("archived-sweep", fill) / "runs"


def _issues(archive: Path, folder: Path, severity: Severity) -> list[str]:
    """What the validator of RO-Crates finds, without a network: its cache is given the context that rocrate ships."""
    cache = folder / "http"
    if not cache.with_suffix(".sqlite").exists():
        session = CachedSession(cache_name=str(cache), backend="sqlite", expire_after=-1)
        text = (importlib.resources.files("rocrate") / "data" / "ro-crate.jsonld").read_bytes()
        asked = requests.Request("GET", CONTEXT).prepare()
        head = {"Content-Type": "application/ld+json"}
        raw = HTTPResponse(io.BytesIO(text), head, 200, preload_content=False, request_url=CONTEXT)
        session.cache.save_response(requests.adapters.HTTPAdapter().build_response(asked, raw))
        session.close()
    settings = ValidationSettings(
        rocrate_uri=str(archive),
        profile_identifier="process-run-crate",
        requirement_severity=severity,
        offline=True,
        cache_path=cache,
    )
    return [str(issue.check.name) for issue in validate(settings).get_issues()]


def test_manifests_say_what_made_the_run(run: Path) -> None:
    manifest = FinishedRun(run).manifest
    files = {path.relative_to(run).as_posix(): path for path in run.rglob("*") if path.is_file()}
    del files["manifest.json"]
    assert manifest["sha256"] == {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}
    assert manifest["files"] == {name: path.stat().st_size for name, path in files.items()}
    assert manifest["packages"]["numpy"] == np.__version__
    assert manifest["commit"] == software().commit


def test_the_commit_of_a_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def git(*arguments: str) -> str:
        who = ("-c", "user.name=nobody", "-c", "user.email=nobody@example.org")
        done = subprocess.run(["git", *who, *arguments], cwd=tmp_path, check=True, capture_output=True, text=True)
        return done.stdout.strip()

    assert commit_of(tmp_path) is None
    git("init", "-q")
    (tmp_path / "code.py").write_text("a = 1\n")
    git("add", "code.py")
    git("commit", "-q", "-m", "begin")
    commit = git("rev-parse", "HEAD")
    (tmp_path / "runs").write_text("what git does not know\n")
    assert commit_of(tmp_path) == commit
    (tmp_path / "code.py").write_text("a = 2\n")
    assert commit_of(tmp_path) == f"{commit}+changes"
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "another"))  # as a hook of another repository has it
    assert commit_of(tmp_path) == f"{commit}+changes"


def test_what_changed_is_named(run: Path) -> None:
    files = len(FinishedRun(run).manifest["files"])
    assert call("verify", str(run)).stdout == f"{run.name}: {files} files are what they were\n"
    dump = run / "segments" / "0000" / "beads.bin"
    contents = bytearray(dump.read_bytes())
    contents[1000] ^= 1
    dump.write_bytes(contents)
    (run / "walkers.parquet").unlink()
    (run / "walk.png").write_bytes(b"drawn since")
    told = call("verify", str(run))
    assert told.returncode == 1
    assert told.stdout.splitlines() == [
        f"{run.name}: {files - 2} files are what they were",
        "  changed    segments/0000/beads.bin",
        "  missing    walkers.parquet",
        "  made since walk.png",
    ]
    refused = call("archive", str(run), "--to", str(run.parent / "run.zip"))
    assert (refused.returncode, "walkers.parquet" in refused.stderr) == (1, True)
    assert [path.name for path in run.parent.iterdir()] == [run.name]


def _without(*lists: str) -> Callable[[dict[str, Any]], object]:
    return lambda manifest: [manifest[one].pop("walkers.parquet") for one in lists]


def _with(name: str) -> Callable[[dict[str, Any]], object]:
    return lambda manifest: (manifest["files"].update({name: 0}), manifest["sha256"].update({name: EMPTY}))


EMPTY = hashlib.sha256().hexdigest()


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda manifest: manifest.update(files={}, sha256={}), "  not listed case.json\n"),
        (_without("files", "sha256"), "  not listed walkers.parquet\n"),
        (_without("sha256"), "  doubtful   walkers.parquet (manifest.json has its size or its checksum, not both)\n"),
        (_without("files"), "  doubtful   walkers.parquet (manifest.json has its size or its checksum, not both)\n"),
        (lambda manifest: manifest["files"].update({"result.json": 1}), "  changed    result.json\n"),
        (lambda manifest: manifest.pop("files"), "(it, or what it names, cannot be read: expected the key files)"),
        (lambda manifest: manifest.update(files=[]), "  doubtful   manifest.json (it, or what it names, cannot"),
        (_with("../stranger"), "expected paths below it, found '../stranger'"),
        (_with("/etc/hostname"), "expected paths below it, found '/etc/hostname'"),
        (_with("\x1b[2J"), r"  missing    '\x1b[2J'"),
        (b"[" * 200_000, "nested too deeply"),
        (b"\n" * (65 << 20), "expected at most 64 MB"),
        (b"[" + b"[]," * 2_000_000 + b"[]]", "expected at most 2000000 lists and tables"),
        (b'{"files": {}', "cannot be read"),
    ],
    ids=range(14),
)
def test_manifests_that_do_not_say_what_is_there(
    run: Path, change: bytes | Callable[[dict[str, Any]], object], told: str
) -> None:
    path = run / "manifest.json"
    if isinstance(change, bytes):
        path.write_bytes(change)
    else:
        manifest = json.loads(path.read_text())
        change(manifest)
        path.write_text(json.dumps(manifest))
    done = call("verify", str(run))
    assert (done.returncode, told in done.stdout) == (1, True), (done.stdout, done.stderr)


def test_what_a_run_does_not_list(run: Path, tmp_path: Path) -> None:
    """Nothing is read from pictures and films; a folder of segments is taken for a part of the run."""
    for name in ("film.mp4", "vtk/walkers_0000.vtp", "vtk/walkers_0001.vtp", ".DS_Store", "test.toml"):
        (run / name).parent.mkdir(exist_ok=True)
        (run / name).write_bytes(b"new")
    call("plot", str(run), check=True)
    since = call("verify", str(run), check=True).stdout.splitlines()[1:]
    drawn = [".DS_Store", "film.mp4", "gait.png", "test.toml", "vtk/ (2 files)", "walk.png"]
    assert since == [f"  made since {name}" for name in drawn]
    for folder in ("0001", "0002"):
        (run / "segments" / folder).mkdir()
    (run / "segments" / "0003").symlink_to(tmp_path)
    others = ["events.parquet", "notes.txt", "segments/0000/walk.png", "segments/0001/beads.bin"]
    for name in others:
        (run / name).write_bytes(b"new")
    told = call("verify", str(run))
    others += ["segments/0002/", "segments/0003"]
    assert (told.returncode, told.stdout.splitlines()[1:]) == (1, [f"  not listed {name}" for name in others] + since)


def test_tables_made_anew_are_what_the_manifest_says(run: Path) -> None:
    (run / "walkers.parquet").write_bytes(b"damaged")
    assert call("verify", str(run)).returncode == 1
    call("result", str(run), check=True)
    assert call("verify", str(run)).returncode == 0
    again = FinishedRun(run).manifest["tabulated"]
    assert again["commit"] == software().commit
    assert set(again["files"]) == {"result.json", "walkers.parquet", "trajectory.parquet", "bridges.parquet"}


def test_an_archive_of_a_run(run: Path, tmp_path: Path) -> None:
    archive, again = tmp_path / "run.zip", tmp_path / "again.zip"
    assert call("archive", str(run), "--to", str(archive), *AUTHOR, check=True).stdout == f"{archive}\n"
    call("archive", str(run), "--to", str(again), *AUTHOR, check=True)
    assert archive.read_bytes() == again.read_bytes()
    assert set(_issues(archive, tmp_path, Severity.RECOMMENDED)) == NOT_SAID

    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(archive, unpacked)
    subprocess.run(["sha256sum", "--check", "--quiet", "sha256sums.txt"], cwd=unpacked, check=True)
    there = unpacked / "runs" / run.name
    assert call("verify", str(unpacked)).returncode == call("verify", str(there)).returncode == 0
    assert Run(there).result == Run(run).result
    drawn = call("plot", str(there), check=True).stdout.splitlines()
    assert [Path(path).name for path in drawn] == ["walk.png", "gait.png"]
    assert load_case(there / "test.toml") == make_case(run=SHORT)


def test_what_an_archive_says_of_its_run(run: Path, tmp_path: Path) -> None:
    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(Run(run).archive(tmp_path / "run.zip", licence="CC0-1.0"), unpacked)
    crate, manifest, place = ROCrate(unpacked), FinishedRun(run).manifest, f"runs/{run.name}"
    root = crate.root_dataset
    assert root["citation"].id == PAPER
    assert "zero" in root["license"].id
    assert root["datePublished"] == manifest["finished"].replace("Z", "+00:00")
    for name, one in manifest["sha256"].items():
        assert crate.get(f"{place}/{name}")["sha256"] == one

    engine = crate.get(f"#{run.name}-engine")
    assert engine["instrument"]["sha256"] == manifest["engine"]["sha256"]
    names = {what: {Path(item.id).name for item in engine[what]} for what in ("object", "result")}
    assert names["object"] >= {"walker.lig", "bridges.txt", "run.sh"}
    assert names["result"] == {"beads.bin", "bridges.pairs.txt", "bridges.walls.txt", "engine.log", "segment.json"}
    needed = crate.get(f"#{run.name}-tables")["instrument"]["softwareRequirements"]
    versions = {one["name"]: one["softwareVersion"] for one in needed}
    assert versions == {**manifest["packages"], "Python": manifest["python"]}

    columns = crate.get(f"{place}/trajectory.parquet")["variableMeasured"]
    told = {one["name"]: (one.get("unitText", ""), one["description"]) for one in columns}
    schema = pq.read_schema(run / "trajectory.parquet")
    assert told == {
        field.name: (field.metadata[b"unit"].decode(), field.metadata[b"meaning"].decode()) for field in schema
    }
    assert manifest["engine"]["sha256"] in (unpacked / "ro-crate-preview.html").read_text()


def test_an_archive_without_dumps(run: Path, tmp_path: Path) -> None:
    archive, again = tmp_path / "run.zip", tmp_path / "again.zip"
    call("archive", str(run), "--to", str(archive), "--without-dumps", check=True)
    shutil.unpack_archive(archive, tmp_path / "unpacked")
    there = tmp_path / "unpacked" / "runs" / run.name
    files = len(FinishedRun(run).manifest["files"])
    assert f"{files - 3} files are what they were, 3 left out" in call("verify", str(there), check=True).stdout
    assert (
        call("result", str(there), check=True).stdout.splitlines()[:-1]
        == Run(run).describe().replace(" (already run)", "").splitlines()[:-1]
    )
    call("archive", str(there), "--to", str(again), "--without-dumps", check=True)
    assert archive.read_bytes() == again.read_bytes()
    assert _issues(archive, tmp_path, Severity.REQUIRED) == []
    told = call("plot", str(there))
    assert (told.returncode, "beads.bin" in told.stderr) == (1, True)


def test_an_archive_of_a_sweep(shared: Path, tmp_path: Path) -> None:
    """Runs that shared a deck come with it, and the table is what it was."""
    archive, unpacked = tmp_path / "sweep.zip", tmp_path / "unpacked"
    call("archive", str(shared / "angles"), "--to", str(archive), *AUTHOR, check=True)
    assert _issues(archive, tmp_path, Severity.REQUIRED) == []
    shutil.unpack_archive(archive, unpacked)
    before, after = (load(folder / "angles").drop(columns="run") for folder in (shared, unpacked / "runs"))
    assert list(after["status"]) == ["finished"] * 2
    assert before.equals(after)
    told = pd.read_csv(unpacked / "runs" / "angles" / "table.csv")["run"]
    assert [Path(place).name for place in told] == [Path(place).name for place in load(shared / "angles")["run"]]
    assert all((unpacked / place / "shared_deck" / "walker.lig").is_file() for place in told)
    for number, angle in enumerate(("0 deg", "10 deg")):
        name = Path(load(shared / "angles")["run"][number]).name
        (given,) = unpacked.glob(f"runs/{name}/base.toml")
        assert load_case(given) == resolve_case(document(run=SHORT, dimers={"angle": angle}), name="base")
    assert (unpacked / "runs" / "angles" / "angles.toml").read_text().startswith('case = "base.toml"\n')
    crate = ROCrate(unpacked)
    assert [action["name"].split()[0] for action in crate.root_dataset["mentions"]] == [
        *("Deck", "Engine's", "Tables"),
        *("Deck", "Engine's", "Tables"),
        "Table",
    ]

    assert call("verify", str(unpacked / "runs" / "angles"), check=True).stdout.startswith("angles: 2 points have")
    decks = list(unpacked.glob("runs/*/shared_deck/walker.lig"))
    decks[0].write_text(decks[0].read_text().replace("gravity", "levity"))
    changed = call("verify", str(unpacked / "runs" / "angles"))
    assert (changed.returncode, changed.stdout.count("  changed    shared_deck/walker.lig")) == (1, 1)
    for deck in decks:
        shutil.rmtree(deck.parent.parent)
    gone = call("verify", str(unpacked / "runs" / "angles"))
    assert (gone.returncode, gone.stdout.splitlines()[0]) == (1, "angles: 0 points have their run")
    assert gone.stdout.count("(missing: point ") == 2
    refused = call("archive", str(unpacked / "runs" / "angles"), "--to", str(tmp_path / "two.zip"))
    assert (refused.returncode, "2 of 2 points are not finished" in refused.stderr) == (2, True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--to", "run.tar"), "--to: expected the name of a .zip file"),
        (("--to", "nowhere/run.zip"), "No such file"),
        (("--licence", "MINE"), "--licence: expected one of CC-BY-4.0"),
        (("--author", " "), "--author: expected a name"),
        (("--orcid", "0000-0002-1825-0097"), "--orcid: expected an --author for each"),
        (("--author", "N", "--orcid", "0000-0002-1825-0098"), "--orcid: expected an ORCID"),
    ],
)
def test_options_that_make_no_sense(run: Path, tmp_path: Path, options: tuple[str, ...], message: str) -> None:
    refused = call("archive", str(run), *options, folder=tmp_path)
    assert (refused.returncode, message in refused.stderr) == (2, True), refused.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["runs"]


def test_what_is_no_run(run: Path, tmp_path: Path) -> None:
    unfinished = run.rename(run.with_name(f"{run.name}.incomplete"))
    (unfinished / "manifest.json").unlink()
    for command in ("archive", "verify"):
        refused = call(command, str(unfinished), folder=tmp_path)
        assert (refused.returncode, "expected a run directory" in refused.stderr) == (2, True)
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as other:
        other.writestr("readme", "no run")
    assert "it has no sha256sums.txt" in call("verify", str(tmp_path / "other.zip")).stderr


def test_a_file_that_changes_while_it_is_archived(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The list of checksums is written before the files; the engine's log grows in between."""
    preview = writing._preview

    def grown(*given: Any) -> bytes:
        with next(run.rglob("engine.log")).open("a") as log:
            log.write("more\n")
        return preview(*given)

    monkeypatch.setattr(writing, "_preview", grown)
    with pytest.raises(ArchiveRefused, match="changed while it was archived"):
        write_archive(run, tmp_path / "run.zip")
    assert not (tmp_path / "run.zip").exists()


def test_an_archive_that_was_damaged(run: Path, tmp_path: Path) -> None:
    """What fails leaves the older archive."""
    archive = write_archive(run, tmp_path / "run.zip")
    before = archive.read_bytes()
    (run / "result.json").write_text("{}")
    with pytest.raises(ArchiveRefused, match=r"changed +result\.json"):
        write_archive(run, archive, ArchiveOptions(dumps=False))
    assert archive.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.zip", "runs"]
    contents = bytearray(before)
    with zipfile.ZipFile(archive) as opened:
        place = opened.getinfo(f"runs/{run.name}/trajectory.parquet").header_offset
    contents[place + 5000] ^= 1
    archive.write_bytes(contents)
    told = call("verify", str(archive))
    assert (told.returncode, f"  changed    runs/{run.name}/trajectory.parquet" in told.stdout) == (1, True)
    archive.write_bytes(contents[: len(contents) // 2])
    assert call("verify", str(archive)).returncode == 2


def _summed(parts: dict[str, bytes], *lacking: str) -> None:
    """Give an archive the checksums of what it holds now, but of some of it."""
    lines = [
        f"{hashlib.sha256(contents).hexdigest()}  {place}\n"
        for place, contents in parts.items()
        if not place.endswith("/") and place not in ("sha256sums.txt", *lacking)
    ]
    parts["sha256sums.txt"] = "".join(lines).encode()


def _place(parts: dict[str, bytes], name: str) -> str:
    (place,) = (place for place in parts if place.endswith(f"/{name}"))
    return place


CRATE = "ro-crate-metadata.json"
AT_ODDS = f"(sha256sums.txt and {CRATE} disagree)"


def _changed(name: str, change: Callable[[bytes], bytes], *, lacking: str = "") -> Callable[[dict[str, bytes]], None]:
    """Change a file of an archive and, if need be, its list of checksums, which may lack one."""

    def changed(parts: dict[str, bytes]) -> None:
        place = name if name in parts else _place(parts, name)
        parts[place] = change(parts[place])
        _summed(parts, *([_place(parts, lacking)] if lacking else []))

    return changed


def _shorter_manifest(contents: bytes) -> bytes:
    manifest = json.loads(contents)
    _without("files", "sha256")(manifest)
    return json.dumps(manifest).encode()


def _no_sums(contents: bytes) -> bytes:
    return re.sub(rb'"sha256": "[^"]*"', b'"sha256": null', contents)


def _no_run(parts: dict[str, bytes]) -> None:
    for place in [place for place in parts if place.startswith("runs/")]:
        del parts[place]
    parts[CRATE] = NO_GRAPH
    _summed(parts)


NO_GRAPH = b'{"@graph": []}'


def _added(place: str, contents: bytes = b"new") -> Callable[[dict[str, bytes]], object]:
    return lambda parts: parts.update({place: contents})


def _folder_of_a_file(parts: dict[str, bytes]) -> None:
    parts[f"{_place(parts, 'result.json')}/inside"] = b""


def _twin(parts: dict[str, bytes]) -> None:
    place = _place(parts, "result.json")
    parts[place.upper()] = parts[place]


@pytest.mark.parametrize(
    ("change", "status", "told"),
    [
        (_added("sha256sums.txt", b""), 1, "  doubtful   sha256sums.txt (it lists no run)\n"),
        (_added("sha256sums.txt", b""), 1, "  not listed ro-crate-metadata.json\n"),
        (_changed(CRATE, bytes, lacking="result.json"), 1, "result.json\n"),
        (_changed("manifest.json", _shorter_manifest), 1, "walkers.parquet (sha256sums.txt and runs/"),
        (_changed(CRATE, lambda _: NO_GRAPH), 1, f"case.json {AT_ODDS}"),
        (
            _changed(CRATE, lambda old: old + b" " * (65 << 20)),
            0,
            f"  not read   {CRATE} (larger than 64 MB: ",
        ),
        (
            _changed("result.json", lambda _: b"{}"),
            1,
            f"result.json {AT_ODDS}",
        ),
        (_changed(CRATE, _no_sums), 1, f"case.json {AT_ODDS}"),
        (_added("a/" * 32_000 + "a"), 1, "  not listed a/a/"),
        (_no_run, 1, "  doubtful   sha256sums.txt (it lists no run)\n"),
        (_added("film.mp4"), 1, "  not listed film.mp4\n"),
        (_added("empty/", b""), 1, "  not listed empty/\n"),
        (_added("../above"), 1, "  not listed ../above\n"),
        (_added("/etc/hostname"), 1, "  not listed /etc/hostname\n"),
        (_added("\x1b[2J"), 1, r"  not listed '\x1b[2J'"),
        (_twin, 1, "RESULT.JSON (another file or folder has its name)\n"),
        (_folder_of_a_file, 1, "result.json (another file or folder has its name)\n"),
        (_added("sha256sums.txt", b"\n" * 1000), 2, "expected a checksum and a path"),
        (_added("sha256sums.txt", b"\xff"), 1, "  doubtful   sha256sums.txt (cannot be read"),
        (_added("sha256sums.txt", b"0" * 64 + b"  ../above\n"), 2, "expected a checksum and a path"),
        (_added("sha256sums.txt", b"\n" * (65 << 20)), 2, "sha256sums.txt: expected at most 64 MB"),
        (_added("zeros", bytes(300 << 20)), 2, "unpacks to 315 MB, expected at most 100 times its"),
    ],
)
def test_archives_whose_lists_are_not_what_they_hold(
    whole: Path, tmp_path: Path, change: Callable[[dict[str, bytes]], object], status: int, told: str
) -> None:
    with zipfile.ZipFile(whole) as opened:
        parts = {place: opened.read(place) for place in opened.namelist()}
    change(parts)
    archive = tmp_path / "run.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as opened:
        for place, contents in parts.items():
            opened.writestr(place, contents)
    done = call("verify", str(archive))
    assert (done.returncode, told in done.stdout + done.stderr) == (status, True), (done.stdout, done.stderr)


_CENTRAL = b"PK\x01\x02"


def _in_both_headers(contents: bytearray, place: str, at: int, value: bytes) -> None:
    """Set a field of a member, given by its distance from the name's in the local header, here and in the list."""
    name = place.encode()
    for found in re.finditer(re.escape(name), bytes(contents)):
        for start, shift in ((found.start() - 30, 0), (found.start() - 46, 2)):
            if contents[start : start + 4] == (_CENTRAL if shift else b"PK\x03\x04"):
                contents[start + shift + at : start + shift + at + len(value)] = value


def _field(at: int, value: bytes) -> Callable[[bytearray, str], None]:
    return lambda contents, place: _in_both_headers(contents, place, at, value)


def _broken(contents: bytearray, place: str) -> None:
    at = contents.index(place.encode()) + len(place) + 20
    contents[at : at + 40] = b"\xff" * 40


def _listed(before: int, value: int) -> Callable[[bytearray, str], None]:
    """Set a field of a member in the zip file's list, given by its distance from the name."""

    def change(contents: bytearray, place: str) -> None:
        at = contents.index(place.encode(), contents.index(_CENTRAL)) - before
        contents[at : at + 4] = value.to_bytes(4, "little")

    return change


def _long_list(contents: bytearray, _: str) -> None:
    end = contents.rindex(b"PK\x05\x06")
    contents[end + 12 : end + 16] = (33 << 20).to_bytes(4, "little")
    contents[:0] = bytes(33 << 20)


@pytest.mark.parametrize(
    ("damage", "status", "told"),
    [
        (_field(6, b"\x01\x00"), 1, "  doubtful   {place} (encrypted)"),
        (_field(8, b"\x0c\x00"), 1, "  doubtful   {place} (compressed by method 12, expected deflated or stored)"),
        (_field(8, b"\x63\x00"), 1, "  doubtful   {place} (compressed by method 99, expected deflated or stored)"),
        (_listed(8, 0o120777 << 16), 1, "  doubtful   {place} (a symbolic link)"),
        (_field(14, b"abcd"), 1, "  changed    {place}"),
        (_broken, 1, "  changed    {place}"),
        (_field(22, (10).to_bytes(4, "little")), 1, "  changed    {place}"),
        (_field(22, (1 << 28).to_bytes(4, "little")), 2, "expected at most 100 times its"),
        (_listed(4, 0), 2, "expected members that follow each other, they overlap"),
        (_long_list, 2, "expected a list of members of at most 32 MB"),
    ],
)
@pytest.mark.parametrize("name", ["walker.lig", "sha256sums.txt"])
def test_zip_files_that_are_not_what_they_should_be(
    whole: Path, tmp_path: Path, damage: Callable[[bytearray, str], None], status: int, told: str, name: str
) -> None:
    """Each is told in a sentence, also where it is the list itself that cannot be read."""
    contents = bytearray(whole.read_bytes())
    with zipfile.ZipFile(whole) as opened:
        place = next(place for place in opened.namelist() if place.endswith(name))
    damage(contents, place)
    archive = tmp_path / "run.zip"
    archive.write_bytes(contents)
    done = call("verify", str(archive))
    expected = told.format(place=place)
    if name == "sha256sums.txt":
        expected = expected.replace("  changed    ", "  doubtful   ")
        expected = expected.replace(f"{place} (", f"{place} (cannot be read: ")
    assert (done.returncode, expected in done.stdout + done.stderr) == (status, True), (done.stdout, done.stderr)


@pytest.mark.parametrize(
    ("command", "told"),
    [
        *((one, "an archive: unpack it") for one in ("result", "plot", "report", "render", "export --to a.xyz")),
        ("table", "not a sweep: expected a folder"),
        ("status", "neither a sweep's directory"),
    ],
)
def test_archives_are_unpacked_for_all_else(whole: Path, tmp_path: Path, command: str, told: str) -> None:
    shutil.copy(whole, tmp_path / "run.zip")
    name, *options = command.split()
    done = call(name, "run.zip", *options, folder=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert done.stderr.startswith(f"walkers: run.zip: {told}")
    assert [path.name for path in tmp_path.iterdir()] == ["run.zip"]


def test_what_an_unpacked_archive_does_not_list(whole: Path, shared: Path, tmp_path: Path) -> None:
    """What was drawn there since is no change; what is put into a run, or beside the points of a sweep, is told."""
    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(whole, unpacked)
    (run,) = unpacked.glob("runs/*")
    call("plot", str(run), check=True)
    assert f"  made since runs/{run.name}/ (2 files)\n" in call("verify", str(unpacked), check=True).stdout
    (run / "segments" / "0001").mkdir()
    (run / "result.json").unlink()
    (run / "result.json").symlink_to("nowhere")
    told = call("verify", str(unpacked))
    assert told.returncode == 1
    assert told.stdout.splitlines()[1:3] == [
        f"  missing    runs/{run.name}/result.json",
        f"  not listed runs/{run.name}/segments/0001/",
    ]
    sweep = Path(shutil.copytree(shared, tmp_path / "runs")) / "angles"
    call("plot", str(sweep), check=True)
    assert "  made since velocity.png\n" in call("verify", str(sweep), check=True).stdout
    (sweep / "sweep.old.json").write_text("{}")
    next(sweep.parent.glob("*/manifest.json")).write_text("{")
    told = call("verify", str(sweep))
    assert told.returncode == 1
    assert "  not listed sweep.old.json\n" in told.stdout
    assert "  doubtful   manifest.json (it, or what it names, cannot be read" in told.stdout
