"""What a run is worth later.

Its manifest, its checksums, and archives that others can read, check and use again.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import walkers
from tests.conftest import PROGRAM, SHORT, brief_pile, call, document, make_case, to_toml
from walkers import Run, load_case
from walkers.archive.contents import Contents
from walkers.archive.writing import write_archive
from walkers.files import read_json, write_json
from walkers.inputs.case_building import build_case
from walkers.runner.manifest import FileChanged, read_manifest
from walkers.runner.model_sources import model_version
from walkers.runner.provenance import software
from walkers.runner.run_directory import REQUESTED_NAME, leave_out_dumps
from walkers.sweeps.table import load_table

RECORD = "archive.json"
SUMS = "sha256sums.txt"
TWO_ANGLES = 'case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
"""A sweep of two points, which share a deck."""
Once = Callable[[str, Callable[[Path], object]], Path]


def _exported(directory: Path, archive: Path, *options: str) -> Path:
    """Export a run or a sweep as an archive; return the archive."""
    call("export", str(directory), "--format", "archive", "-o", str(archive), *options, check=True)
    return archive


def _unpacked(archive: Path, folder: Path) -> Path:
    """Unpack an archive; return the folder."""
    shutil.unpack_archive(archive, folder)
    return folder


def _text_in(archive: Path, name: str) -> str:
    """The text of a file of an archive."""
    with zipfile.ZipFile(archive) as packed:
        return packed.read(name).decode()


def _checked(path: Path, status: int = 0) -> list[str]:
    """Lines that ``walkers check files`` prints; its exit status must be that which is given."""
    done = call("check", "files", str(path))
    assert done.returncode == status, (done.stdout, done.stderr)
    return (done.stdout + done.stderr).splitlines()


def _write_sweep(folder: Path) -> None:
    """Write the case and the sweep file of `TWO_ANGLES` into a folder."""
    (folder / "base.toml").write_text(to_toml(document(run=SHORT)))
    (folder / "angles.toml").write_text(TWO_ANGLES)


@pytest.fixture
def run(run_directory: Callable[..., Path], tmp_path: Path) -> Path:
    """A copy of a finished run, to be changed; it is the run of `archive`."""
    original = run_directory(run=SHORT)
    return Path(shutil.copytree(original, tmp_path / "runs" / original.name))


@pytest.fixture
def unpacked(archive: Path, tmp_path: Path) -> Path:
    """The unpacked archive of a run, to be changed."""
    return _unpacked(archive, tmp_path / "unpacked")


@pytest.fixture(scope="session")
def sweep_runs(once: Once) -> Path:
    """A folder of runs with a sweep ``angles``, whose two points share a deck."""

    def fill(folder: Path) -> None:
        _write_sweep(folder)
        call("sweep", "angles.toml", "-j", "1", check=True, folder=folder)

    return once("archived-sweep", fill) / "runs"


@pytest.fixture(scope="session")
def sweep_archive(sweep_runs: Path, once: Once) -> Path:
    """The archive of the sweep of `sweep_runs`."""

    def fill(folder: Path) -> None:
        _exported(sweep_runs / "angles", folder / "sweep.zip")

    return once("archive-of-a-sweep", fill) / "sweep.zip"


@pytest.fixture
def unpacked_sweep(sweep_archive: Path, tmp_path: Path) -> Path:
    """The unpacked archive of a sweep, to be changed."""
    return _unpacked(sweep_archive, tmp_path / "unpacked")


def _points(unpacked: Path) -> list[Path]:
    """Run directories of the points of the sweep in an unpacked archive, by its table."""
    table = pd.read_csv(unpacked / "runs" / "angles" / "table.csv")
    return [unpacked / run for run in table["run"]]


# --- manifests and checksums of runs --------------------------------------------------------------


def test_manifests_have_the_checksums_and_sizes_of_all_files(run: Path) -> None:
    checksums = {}
    sizes = {}
    for path in run.rglob("*"):
        if path.is_file() and path.name not in ("manifest.json", REQUESTED_NAME):
            name = path.relative_to(run).as_posix()
            checksums[name] = hashlib.sha256(path.read_bytes()).hexdigest()
            sizes[name] = path.stat().st_size
    manifest = read_manifest(run)
    assert manifest["sha256"] == checksums
    assert manifest["files"] == sizes


def test_manifests_say_what_made_the_run(run: Path) -> None:
    manifest = read_manifest(run)
    assert manifest["packages"]["numpy"] == np.__version__
    assert manifest["commit"] == software()["commit"]


def test_a_run_as_it_was_made_is_unchanged(run: Path) -> None:
    files = len(read_manifest(run)["files"])
    assert _checked(run) == [f"{run.name}: {files} files are unchanged"]


def test_what_was_made_since_is_no_change(run: Path) -> None:
    """Nothing is read from films and pictures; a name that would clear the terminal is escaped."""
    (run / "vtk").mkdir()
    for name in ("film.mp4", "vtk/beads_000000.vtu", "\x1b[2J"):
        (run / name).write_bytes(b"new")
    assert _checked(run)[1:] == [
        r"  made since \x1b[2J",
        "  made since film.mp4",
        "  made since vtk/",
    ]


def test_what_changed_is_named(run: Path, tmp_path: Path) -> None:
    """A folder or a link among the segments, and a table, are taken for parts of the run."""
    files = len(read_manifest(run)["files"])
    dump = run / "segments" / "0000" / "beads.bin"
    contents = dump.read_bytes()
    dump.write_bytes(bytes([contents[0] ^ 1]) + contents[1:])
    (run / "walkers.parquet").unlink()
    (run / "climbs.parquet").touch()
    (run / "segments" / "0000" / "walk.png").touch()
    (run / "segments" / "0001").mkdir()
    (run / "segments" / "0002").symlink_to(tmp_path)
    assert _checked(run, status=1) == [
        f"{run.name}: {files - 2} files are unchanged",
        "  changed    segments/0000/beads.bin",
        "  missing    walkers.parquet",
        "  not listed climbs.parquet",
        "  not listed segments/0000/walk.png",
        "  not listed segments/0001",
        "  not listed segments/0002",
    ]


READ_BY_PICTURES = ["beads.bin", "bridges.pairs.txt", "bridges.txt", "bridges.walls.txt"]
"""Files without which a run keeps its results, as a draw of a spread does."""


def test_a_run_without_dumps_has_no_files_that_only_pictures_read(run: Path) -> None:
    """The check says that they were left out; nothing continues from its restart files."""
    leave_out_dumps(run)
    names = {path.name for path in run.rglob("*")}
    assert not names & {*READ_BY_PICTURES, "state.restart"}
    left_out = []
    for line in _checked(run):
        if line.startswith("  left out "):
            left_out.append(line.split("/")[-1])
    assert sorted(left_out) == READ_BY_PICTURES


def test_a_run_without_dumps_keeps_its_results(run: Path) -> None:
    leave_out_dumps(run)
    result = Run(run).result
    assert result["velocity"] == result.table("walkers")["velocity"].mean()


# --- archives of a run ----------------------------------------------------------------------------


def test_an_archive_of_a_run_is_always_the_same(run: Path, tmp_path: Path) -> None:
    first = _exported(run, tmp_path / "first.zip")
    second = _exported(run, tmp_path / "second.zip")
    assert first.read_bytes() == second.read_bytes()


def test_an_unpacked_archive_is_unchanged(unpacked: Path) -> None:
    """Also by the words of ``sha256sum``, which needs no granular-walkers."""
    assert len(_checked(unpacked)) == 1
    subprocess.run(["sha256sum", "--check", "--quiet", SUMS], cwd=unpacked, check=True)


def test_a_dead_link_in_an_unpacked_archive_is_missing(unpacked: Path, run: Path) -> None:
    result = unpacked / "runs" / run.name / "result.json"
    result.unlink()
    result.symlink_to("nowhere")
    assert _checked(unpacked, status=1)[1] == f"  missing    runs/{run.name}/result.json"


def test_an_unpacked_run_has_its_result_and_its_case(unpacked: Path, run: Path) -> None:
    copy = unpacked / "runs" / run.name
    assert Run(copy).result == Run(run).result
    assert load_case(copy / "test.toml") == make_case(run=SHORT)


def test_checksums_of_an_archive_are_those_of_the_manifest(unpacked: Path, run: Path) -> None:
    of_archive = {}
    for line in (unpacked / SUMS).read_text().splitlines():
        checksum, path = line.split("  ")
        of_archive[path] = checksum
    for name, checksum in read_manifest(run)["sha256"].items():
        assert of_archive[f"runs/{run.name}/{name}"] == checksum


def test_the_record_of_an_archive_says_what_it_is_and_whose(run: Path, tmp_path: Path) -> None:
    author = ("--author", "Josiah Carberry", "--licence", "CC-BY-4.0")
    record = json.loads(_text_in(_exported(run, tmp_path / "run.zip", *author), RECORD))
    assert record["authors"] == ["Josiah Carberry"]
    assert record["licence"] == "CC-BY-4.0"
    assert record["name"] == run.name
    assert record["finished"] == read_manifest(run)["finished"]


def test_the_record_of_an_archive_says_what_made_its_run(archive: Path, run: Path) -> None:
    manifest = read_manifest(run)
    about = json.loads(_text_in(archive, RECORD))["runs"][f"runs/{run.name}"]
    assert about["case"] == "test"
    assert about["made_by"]["commit"] == manifest["commit"]
    assert about["made_by"]["packages"] == manifest["packages"]
    assert about["engine"]["version"] == manifest["engine"]["version"]
    assert about["engine"]["sha256"] == manifest["engine"]["sha256"]
    assert about["engine"].keys() == {"version", "sha256"}
    assert about["contact_model"]["sources"] == model_version()["sources"]
    assert "measured_by" not in about


def test_the_record_of_an_archive_has_no_path_of_this_machine(archive: Path) -> None:
    assert str(Path.home()) not in _text_in(archive, RECORD)


def test_an_archive_has_the_date_of_its_last_run() -> None:
    manifests = {
        "first": {"finished": "2026-03-01T10:00:00Z"},
        "last": {"finished": "2026-03-02T09:00:00Z"},
        "earliest": {"finished": "2026-02-28T23:00:00Z"},
    }
    contents = Contents("three", "", manifests, cases={}, files={}, main=[])
    assert contents.finished == "2026-03-02T09:00:00Z"


def test_the_record_of_an_archive_names_the_programs_that_made_and_measured_a_run(
    run: Path, tmp_path: Path
) -> None:
    """The run was measured again by a later version."""
    later = {
        **software(),
        "granular_walkers": "99.0",
        "commit": None,
        "date": "2099-01-01T00:00:00Z",
        "files": [],
    }
    write_json(run / "manifest.json", {**read_manifest(run), "tabulated": later})
    record = json.loads(_text_in(write_archive(run, tmp_path / "run.zip"), RECORD))
    about = record["runs"][f"runs/{run.name}"]
    assert about["made_by"]["granular_walkers"] == software()["granular_walkers"]
    assert about["measured_by"]["granular_walkers"] == "99.0"
    assert about["measured_by"]["date"] == "2099-01-01T00:00:00Z"


def test_an_archive_has_no_author_and_no_licence_unless_its_user_says_so(archive: Path) -> None:
    record = json.loads(_text_in(archive, RECORD))
    readme = _text_in(archive, "README.md")
    assert record["authors"] == []
    assert record["licence"] is None
    assert "Licence:" not in readme
    assert "\nBy " not in readme


def test_the_readme_says_who_made_the_archive(run: Path, tmp_path: Path) -> None:
    """Asterisks of a name would be bold type in Markdown, and are escaped."""
    archive = write_archive(
        run, tmp_path / "run.zip", authors=["A. User", "*B*"], licence="CC0-1.0"
    )
    sentences = "computed from it.\n\nBy A. User, \\*B\\*. Licence: CC0-1.0. The contact model"
    assert sentences in _text_in(archive, "README.md")


def test_a_manifest_says_with_which_contact_model_the_run_was_made(run: Path) -> None:
    assert read_manifest(run)["contact_model"].items() >= model_version().items()


@pytest.mark.parametrize(
    ("contact_model", "sentence"),
    [
        pytest.param(
            {"path": "", **model_version()},
            "The runs were made with these sources.",
            id="the same sources",
        ),
        pytest.param(
            {"forces_version": model_version()["forces_version"]},
            "other sources that compute the same forces",
            id="the same forces",
        ),
        pytest.param({}, "or do not record it", id="not recorded"),
        pytest.param(None, "or do not record it", id="a deck that was run by hand"),
    ],
)
def test_the_readme_says_with_which_contact_model_the_run_was_made(
    contact_model: dict[str, Any] | None, sentence: str, run: Path, tmp_path: Path
) -> None:
    manifest = read_manifest(run)
    manifest["contact_model"] = contact_model
    write_json(run / "manifest.json", manifest)
    assert sentence in _text_in(write_archive(run, tmp_path / "run.zip"), "README.md")


def test_an_archive_that_cannot_be_made_leaves_the_older_one(
    run: Path, archive: Path, tmp_path: Path
) -> None:
    older = Path(shutil.copy(archive, tmp_path / "run.zip"))
    with next(run.rglob("engine.log")).open("a") as log:
        log.write("more\n")
    with pytest.raises(FileChanged, match=r"engine\.log has changed"):
        write_archive(run, older, dumps=False)
    assert older.read_bytes() == archive.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.zip", "runs"]


# --- archives without dumps -----------------------------------------------------------------------


@pytest.fixture(scope="session")
def archive_without_dumps(run_directory: Callable[..., Path], once: Once) -> Path:
    """The archive of the run of `run`, whose dumps are left out."""

    def fill(folder: Path) -> None:
        _exported(run_directory(run=SHORT), folder / "run.zip", "--without-dumps")

    return once("archive-without-dumps", fill) / "run.zip"


@pytest.fixture
def run_without_dumps(archive_without_dumps: Path, run: Path, tmp_path: Path) -> Path:
    """The run in the unpacked archive without dumps."""
    return _unpacked(archive_without_dumps, tmp_path / "unpacked") / "runs" / run.name


def test_the_check_says_which_dumps_an_archive_leaves_out(
    run_without_dumps: Path, run: Path
) -> None:
    files = len(read_manifest(run)["files"])
    assert _checked(run_without_dumps) == [
        f"{run.name}: {files - 3} files are unchanged",
        "  made since test.toml",
        "  left out   segments/0000/beads.bin",
        "  left out   segments/0000/bridges.pairs.txt",
        "  left out   segments/0000/bridges.walls.txt",
    ]


def test_an_archive_without_dumps_has_the_result(run_without_dumps: Path, run: Path) -> None:
    assert Run(run_without_dumps).result == Run(run).result


def test_an_archive_of_an_unpacked_run_is_the_same(
    run_without_dumps: Path, archive_without_dumps: Path, tmp_path: Path
) -> None:
    again = _exported(run_without_dumps, tmp_path / "again.zip", "--without-dumps")
    assert again.read_bytes() == archive_without_dumps.read_bytes()


def test_pictures_of_a_run_without_dumps_are_refused(run_without_dumps: Path) -> None:
    done = call("render", str(run_without_dumps))
    assert done.returncode == 1
    assert "beads.bin" in done.stderr


# --- archives of a sweep --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("contact_model", "sentence"),
    [
        pytest.param(
            {**model_version(), "sources": {"forces.h": "0" * 64}},
            "Some runs were made with other sources that compute the same forces.",
            id="other sources",
        ),
        pytest.param(
            None,
            "Some runs were made with another version of the contact model, or do not record it",
            id="not recorded",
        ),
    ],
)
def test_the_readme_of_a_sweep_tells_of_one_run_with_another_contact_model(
    contact_model: dict[str, Any] | None, sentence: str, sweep_runs: Path, tmp_path: Path
) -> None:
    """The other run was made with the sources in the archive."""
    runs = Path(shutil.copytree(sweep_runs, tmp_path / "runs"))
    run = runs / Path(load_table(runs / "angles")["run"].iloc[1]).name
    write_json(run / "manifest.json", {**read_manifest(run), "contact_model": contact_model})
    readme = _text_in(write_archive(runs / "angles", tmp_path / "sweep.zip"), "README.md")
    assert sentence in readme


def test_an_archive_of_a_sweep_has_its_table(unpacked_sweep: Path, sweep_runs: Path) -> None:
    table = load_table(unpacked_sweep / "runs" / "angles")
    original = load_table(sweep_runs / "angles")
    assert list(table["status"]) == ["finished", "finished"]
    assert table.drop(columns="run").equals(original.drop(columns="run"))


def test_an_archive_of_a_sweep_has_the_runs_of_its_points(
    unpacked_sweep: Path, sweep_runs: Path
) -> None:
    original = [Path(run).name for run in load_table(sweep_runs / "angles")["run"]]
    points = _points(unpacked_sweep)
    assert [point.name for point in points] == original
    record = read_json(unpacked_sweep / RECORD)
    assert list(record["runs"]) == [f"runs/{name}" for name in original]


@pytest.mark.parametrize(("number", "angle"), [(0, "0 deg"), (1, "10 deg")])
def test_an_archive_of_a_sweep_has_the_cases_of_its_points(
    unpacked_sweep: Path, number: int, angle: str
) -> None:
    expected = build_case(document(run=SHORT, dimers={"angle": angle}), name="base")
    assert load_case(_points(unpacked_sweep)[number] / "base.toml") == expected


def test_an_unpacked_sweep_is_whole(unpacked_sweep: Path) -> None:
    lines = _checked(unpacked_sweep / "runs" / "angles")
    assert lines[0] == "angles: 2 points have a run"


def test_a_changed_deck_of_an_unpacked_sweep_is_named(unpacked_sweep: Path) -> None:
    """Runs that shared a deck come with it. One part of a sweep that changed fails the check."""
    deck = _points(unpacked_sweep)[0] / "shared_deck" / "walker.lig"
    deck.write_text(deck.read_text().replace("gravity", "levity"))
    lines = _checked(unpacked_sweep / "runs" / "angles", status=1)
    assert lines.count("  changed    shared_deck/walker.lig") == 1


@pytest.fixture
def sweep_without_runs(unpacked_sweep: Path) -> Path:
    """The sweep of an unpacked archive, whose runs are removed."""
    for point in _points(unpacked_sweep):
        shutil.rmtree(point)
    return unpacked_sweep / "runs" / "angles"


def test_missing_runs_of_an_unpacked_sweep_are_named(sweep_without_runs: Path) -> None:
    lines = _checked(sweep_without_runs, status=1)
    assert lines[0] == "angles: 0 points have a run"
    assert "\n".join(lines).count("(missing: point ") == 2


def test_a_sweep_that_is_not_finished_is_not_archived(
    sweep_without_runs: Path, tmp_path: Path
) -> None:
    archive = tmp_path / "again.zip"
    refused = call("export", str(sweep_without_runs), "--format", "archive", "-o", str(archive))
    assert refused.returncode == 2
    assert "2 of 2 points are not finished" in refused.stderr


# --- damaged archives -----------------------------------------------------------------------------


def _path_in(unpacked: Path, name: str) -> Path:
    """Where a file of this name is in an unpacked archive, or would be added."""
    return next(unpacked.rglob(name), unpacked / name)


@pytest.mark.parametrize(
    ("name", "contents", "status", "message"),
    [
        ("film.mp4", b"new", 0, "made since film.mp4"),
        ("notes.txt", b"new", 1, "not listed notes.txt"),
        (SUMS, b"what it is not", 2, "expected a checksum and a path"),
    ],
)
def test_a_file_that_was_written_into_an_unpacked_archive_is_reported(
    unpacked: Path, name: str, contents: bytes, status: int, message: str
) -> None:
    _path_in(unpacked, name).write_bytes(contents)
    assert message in "\n".join(_checked(unpacked, status))


@pytest.mark.parametrize(
    ("name", "status", "message"),
    [
        ("result.json", 1, "result.json"),
        (RECORD, 1, f"missing    {RECORD}"),
        (SUMS, 2, f"or an archive ({SUMS})"),
    ],
)
def test_a_file_that_an_unpacked_archive_has_lost_is_reported(
    unpacked: Path, name: str, status: int, message: str
) -> None:
    _path_in(unpacked, name).unlink()
    assert message in "\n".join(_checked(unpacked, status))


def _with_changes(archive: Path, to: Path, changes: dict[str, bytes | None]) -> None:
    """Copy a zip file with other contents of some files.

    Files whose contents are None are left out; those that it does not have are added.
    """
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(to, "w", zipfile.ZIP_DEFLATED) as copy:
        contents: dict[str, bytes | None] = {}
        for name in source.namelist():
            contents[name] = source.read(name)
        for name, data in (contents | changes).items():
            if data is not None:
                copy.writestr(name, data)


def _with_other_contents(archive: Path, to: Path, name: str) -> None:
    """Copy a zip file with other contents of a file."""
    _with_changes(archive, to, {name: b"other"})


def _without_a_file(archive: Path, to: Path, name: str) -> None:
    """Copy a zip file without one of its files."""
    _with_changes(archive, to, {name: None})


def _with_an_odd_name(archive: Path, to: Path, name: str) -> None:
    """Copy a zip file and add a file whose name would clear the terminal."""
    _with_changes(archive, to, {"\x1b[2J.txt": b"new"})


def _with_a_second(archive: Path, to: Path, name: str) -> None:
    """Copy a zip file with a second file of the same name."""
    shutil.copy(archive, to)
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(to, "a") as copy:
        copy.writestr(zipfile.ZipInfo(name), source.read(name))


def _with_a_flipped_byte(archive: Path, to: Path, name: str) -> None:
    """Copy a zip file with another byte in the middle of a compressed file."""
    with zipfile.ZipFile(archive) as source:
        entry = source.getinfo(name)
    contents = bytearray(archive.read_bytes())
    start = entry.header_offset + 30 + len(name)  # a local header has 30 bytes and the name
    contents[start + entry.compress_size // 2] ^= 0xFF
    to.write_bytes(contents)


def _listed_files(archive: Path) -> list[str]:
    """Names of the files of an archive that have a checksum."""
    with zipfile.ZipFile(archive) as packed:
        return [name for name in packed.namelist() if name != SUMS]


def test_an_archive_that_is_not_unpacked_is_unchanged(archive: Path) -> None:
    assert _checked(archive) == [f"run.zip: {len(_listed_files(archive))} files are unchanged"]


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize(
    ("damage", "changed_files", "message"),
    [
        pytest.param(_with_other_contents, 1, "changed    {table}", id="other contents"),
        pytest.param(_without_a_file, 1, "missing    {table}", id="a missing file"),
        pytest.param(_with_an_odd_name, 0, r"not listed \x1b[2J.txt", id="an odd name"),
        pytest.param(_with_a_second, 0, "not listed {table}", id="a second file of a name"),
        pytest.param(_with_a_flipped_byte, 1, "changed    {table}", id="a flipped byte"),
    ],
)
def test_what_changed_in_an_archive_that_is_not_unpacked_is_named(
    damage: Callable[[Path, Path, str], None],
    changed_files: int,
    message: str,
    archive: Path,
    tmp_path: Path,
) -> None:
    files = _listed_files(archive)
    (table,) = (name for name in files if name.endswith("walkers.parquet"))
    copy = tmp_path / "copy.zip"
    damage(archive, copy, table)
    assert _checked(copy, status=1) == [
        f"copy.zip: {len(files) - changed_files} files are unchanged",
        f"  {message.format(table=table)}",
    ]


EMPTY_ZIP = b"PK\x05\x06" + bytes(18)
"""The record that ends a zip file, of no files."""


@pytest.mark.parametrize(
    ("contents", "message"),
    [
        pytest.param(b"no zip", "expected an archive, a zip file", id="text"),
        pytest.param(EMPTY_ZIP, f"expected an archive, which has a {SUMS}", id="empty"),
    ],
)
def test_what_is_no_archive_is_refused(contents: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "copy.zip"
    path.write_bytes(contents)
    (line,) = _checked(path, status=2)
    assert message in line
    assert str(path) in line


def test_an_archive_that_was_cut_is_refused(archive: Path, tmp_path: Path) -> None:
    """The list of its files stands at the end of a zip file."""
    path = tmp_path / "copy.zip"
    path.write_bytes(archive.read_bytes()[:-100])
    (line,) = _checked(path, status=2)
    assert "expected an archive, a zip file" in line
    assert str(path) in line


# --- runs of archives, repeated -------------------------------------------------------------------


def _short_run(folder: Path) -> Path:
    return walkers.run(make_case(run=SHORT), folder / "runs").directory


def _long_run(folder: Path) -> Path:
    """A pile in three segments."""
    return walkers.run(brief_pile(), folder / "runs").directory


def _parallel_run(folder: Path) -> Path:
    """A pile by two MPI processes, which wait for each other where cores are busy."""
    return walkers.run(brief_pile(ranks=2, duration="0.01 s"), folder / "runs").directory


def _edited_deck(folder: Path) -> Path:
    """A deck that was edited and run by hand: the engine rescales its tables for the viscosity."""
    (folder / "case.toml").write_text(to_toml(document(run=SHORT)))
    directory = folder / "by-hand"
    call("export", str(folder / "case.toml"), "--format", "deck", "-o", str(directory), check=True)
    deck = directory / "walker.lig"
    deck.write_text(re.sub(r"(variable +viscosity string) \S+", r"\1 0.01", deck.read_text()))
    subprocess.run(["sh", "run.sh"], cwd=directory, check=True)
    call("run", str(directory), check=True)
    return directory


def _two_decks(folder: Path) -> Path:
    """A sweep of two points, each of which has its deck, because there are two workers."""
    _write_sweep(folder)
    call("sweep", "angles.toml", "-j", "2", check=True, folder=folder)
    return folder / "runs" / "angles"


def _shared_deck(folder: Path) -> Path:
    """A sweep whose points share a deck, because there is one worker."""
    _write_sweep(folder)
    call("sweep", "angles.toml", "-j", "1", check=True, folder=folder)
    return folder / "runs" / "angles"


MAKERS = {
    "a short run": _short_run,
    "a long run": _long_run,
    "two MPI processes": _parallel_run,
    "an edited deck": _edited_deck,
    "a sweep of two decks": _two_decks,
    "a sweep of a shared deck": _shared_deck,
}


@pytest.fixture(scope="session")
def archive_of(once: Once) -> Callable[[str], Path]:
    """Archives of the runs of `MAKERS`; the runs themselves are gone."""

    def made(kind: str) -> Path:
        def fill(folder: Path) -> None:
            (folder / "made").mkdir()
            write_archive(MAKERS[kind](folder / "made"), folder / "run.zip")
            shutil.rmtree(folder / "made")

        return once(f"repeatable-{kind.replace(' ', '-')}", fill) / "run.zip"

    return made


def _commands(readme: str, heading: str) -> str:
    """A script of the commands below a heading of a README, without those that install packages."""
    section = readme.split(f"## {heading}\n")[1].split("\n## ", maxsplit=1)[0]
    commands = []
    for line in section.splitlines():
        if line.startswith("    ") and not line.startswith("    apt-get "):
            commands.append(line.strip())
    return "\n".join(commands)


def _followed(unpacked: Path, heading: str) -> str:
    """What the commands of an archive's README print, with the program on the path."""
    script = _commands((unpacked / "README.md").read_text(), heading)
    path = f"{Path(PROGRAM).parent}:{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", "-eu", "-c", script],
        cwd=unpacked,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (script, done.stdout, done.stderr)
    return done.stdout


def _first_run(unpacked: Path) -> Path:
    """The first run of an unpacked archive, which its README has as an example."""
    return unpacked / next(iter(read_json(unpacked / RECORD)["runs"]))


@pytest.fixture(scope="session")
def followed_with_liggghts(archive_of: Callable[[str], Path], once: Once) -> Callable[[str], Path]:
    """Folders in which the commands "With LIGGGHTS alone" of a README were given.

    They have the archive in ``unpacked``, and what the commands print in ``printed.txt``. Each
    compiles the contact model, which takes four seconds.
    """

    def made(kind: str) -> Path:
        def fill(folder: Path) -> None:
            unpacked = _unpacked(archive_of(kind), folder / "unpacked")
            (folder / "printed.txt").write_text(_followed(unpacked, "With LIGGGHTS alone"))

        return once(f"followed-{kind.replace(' ', '-')}", fill)

    return made


def _deck_by_hand(folder: Path) -> Path:
    """Where the last commands of a README have started the engine: it leaves its log there."""
    (log,) = folder.glob("repeated-by-liggghts/**/log.liggghts")
    return log.parent


@pytest.mark.parametrize(
    "kind",
    [
        "a short run",
        pytest.param("an edited deck", marks=pytest.mark.slow),
        pytest.param("a sweep of two decks", marks=pytest.mark.slow),
    ],
)
def test_commands_of_a_readme_repeat_a_run_with_liggghts_alone(
    kind: str, followed_with_liggghts: Callable[[str], Path]
) -> None:
    """As they are printed: by the script, which compares three dumps, and then by hand."""
    folder = followed_with_liggghts(kind)
    assert (folder / "printed.txt").read_text().count("the same   ") == 3
    by_hand = _deck_by_hand(folder)
    deck = by_hand.relative_to(folder / "repeated-by-liggghts")
    original = _first_run(folder / "unpacked") / deck / "beads.bin"
    assert (by_hand / "beads.bin").read_bytes() == original.read_bytes()


@pytest.mark.slow
def test_commands_of_a_readme_repeat_a_shared_deck_with_liggghts_alone(
    followed_with_liggghts: Callable[[str], Path],
) -> None:
    """Its dump has the beads of all points, and no run of the archive has such a dump."""
    folder = followed_with_liggghts("a sweep of a shared deck")
    printed = (folder / "printed.txt").read_text()
    assert "written    shared_deck/beads.bin (nothing to compare with)" in printed
    assert _deck_by_hand(folder).name == "shared_deck"


@pytest.mark.parametrize(
    "kind",
    [
        "a short run",
        pytest.param("an edited deck", marks=pytest.mark.slow),
        pytest.param("a sweep of two decks", marks=pytest.mark.slow),
        pytest.param("a sweep of a shared deck", marks=pytest.mark.slow),
    ],
)
def test_commands_of_a_readme_repeat_a_run_with_the_program(
    kind: str, archive_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """They check the archive before."""
    unpacked = _unpacked(archive_of(kind), tmp_path / "unpacked")
    printed = _followed(unpacked, "With granular-walkers")
    assert "archive.json: OK" in printed
    assert f"\n{unpacked.name}: " in printed
    (manifest,) = (tmp_path / "repeated").glob("*/manifest.json")
    expected = Run(_first_run(unpacked)).result["velocity"]
    assert Run(manifest.parent).result["velocity"] == pytest.approx(expected, rel=1e-9)


Repeat = Callable[[Path], subprocess.CompletedProcess[str]]


@pytest.fixture
def repeat(followed_with_liggghts: Callable[[str], Path]) -> Repeat:
    """Call the script of an unpacked archive for its first run; it needs no granular-walkers."""
    built_model = followed_with_liggghts("a short run") / "unpacked/contact_model/bridge.so"

    def call_script(unpacked: Path) -> subprocess.CompletedProcess[str]:
        shutil.copy(built_model, unpacked / "contact_model")
        command = ["sh", "repeat.sh", f"runs/{_first_run(unpacked).name}", "repeated"]
        return subprocess.run(command, cwd=unpacked, capture_output=True, text=True, check=False)

    return call_script


REPEATED = [
    "a long run",
    pytest.param("two MPI processes", marks=pytest.mark.slow),
    "an edited deck",
]


@pytest.mark.parametrize("kind", REPEATED)
def test_liggghts_alone_repeats_the_run_of_an_archive(
    kind: str, archive_of: Callable[[str], Path], repeat: Repeat, tmp_path: Path
) -> None:
    """A dump of beads and two of bridges for each segment are compared, and are the same."""
    unpacked = _unpacked(archive_of(kind), tmp_path / "unpacked")
    done = repeat(unpacked)
    assert done.returncode == 0, done.stderr
    dumps = [*unpacked.glob("runs/**/beads.bin"), *unpacked.glob("runs/**/bridges.*s.txt")]
    assert len(dumps) >= 3
    assert done.stdout.count("the same   ") == len(dumps)
    assert len(done.stdout.splitlines()) == len(dumps)


@pytest.mark.parametrize("kind", REPEATED)
def test_a_dump_that_liggghts_does_not_repeat_is_found(
    kind: str, archive_of: Callable[[str], Path], repeat: Repeat, tmp_path: Path
) -> None:
    """The last byte of the last dump of beads is another."""
    unpacked = _unpacked(archive_of(kind), tmp_path / "unpacked")
    beads = sorted(unpacked.glob("runs/**/beads.bin"))[-1]
    beads.write_bytes(beads.read_bytes()[:-1] + b"x")
    done = repeat(unpacked)
    assert done.returncode == 1
    assert done.stdout.count("different  ") == 1


@pytest.mark.parametrize("kind", REPEATED)
def test_a_readme_names_the_script_that_repeats_its_run(
    kind: str, archive_of: Callable[[str], Path], tmp_path: Path
) -> None:
    unpacked = _unpacked(archive_of(kind), tmp_path / "unpacked")
    command = f"sh repeat.sh runs/{_first_run(unpacked).name} ../repeated-by-liggghts"
    assert command in (unpacked / "README.md").read_text()


def test_a_shared_deck_of_an_archive_is_repeated_for_all_of_its_runs(
    unpacked_sweep: Path, repeat: Repeat
) -> None:
    done = repeat(unpacked_sweep)
    assert done.returncode == 0, done.stderr
    assert "written    shared_deck/beads.bin (nothing to compare with)" in done.stdout
    beads = unpacked_sweep / "repeated" / "shared_deck" / "beads.bin"
    assert beads.stat().st_size > 10_000


def test_a_run_without_tables_of_forces_is_not_repeated(
    unpacked_sweep: Path, repeat: Repeat
) -> None:
    (_first_run(unpacked_sweep) / "shared_deck" / "bridges.txt").unlink()
    refused = repeat(unpacked_sweep)
    assert refused.returncode == 2
    assert "tables of forces (bridges.txt) were left out" in refused.stderr


# --- archives with spreads and accuracies ---------------------------------------------------------


@pytest.fixture(scope="session")
def uncertain_runs(once: Once) -> Path:
    """A sweep ``angles`` of two points, each with a spread, and with the accuracy of the first."""

    def fill(folder: Path) -> None:
        ranges = {"contact.restitution": [0.2, 0.5]}
        (folder / "base.toml").write_text(to_toml(document(run=SHORT, uncertain=ranges)))
        (folder / "angles.toml").write_text(TWO_ANGLES)
        command = ["sweep", "angles.toml", "-j", "1", "--spread", "--points", "2"]
        call(*command, check=True, folder=folder)
        call("run", "base.toml", "--accuracy", check=True, folder=folder)

    return once("uncertain", fill) / "runs"


@pytest.fixture(scope="session")
def uncertain_names(uncertain_runs: Path) -> list[str]:
    """Names of the runs of the two points."""
    return [Path(run).name for run in load_table(uncertain_runs / "angles")["run"]]


@pytest.fixture(scope="session")
def draw(uncertain_runs: Path, uncertain_names: list[str]) -> Path:
    """A draw of the spread of the second point; draws keep no tables of forces."""
    spread = load_table(uncertain_runs / f"{uncertain_names[1]}-spread")
    draw = uncertain_runs / f"{uncertain_names[1]}-spread" / Path(spread["run"][0]).name
    assert not list(draw.rglob("bridges.txt"))
    return draw


@pytest.fixture
def unpacked_draw(draw: Path, tmp_path: Path) -> Path:
    """The unpacked archive of a draw."""
    return _unpacked(_exported(draw, tmp_path / "draw.zip"), tmp_path / "unpacked")


def test_the_archive_of_a_draw_says_that_liggghts_cannot_repeat_it(
    unpacked_draw: Path, draw: Path
) -> None:
    readme = (unpacked_draw / "README.md").read_text()
    assert f"The run `runs/{draw.name}` cannot be repeated in this way" in readme
    assert "repeat.sh" not in _commands(readme, "With LIGGGHTS alone")


def test_the_program_repeats_the_archive_of_a_draw(
    unpacked_draw: Path, draw: Path, tmp_path: Path
) -> None:
    _followed(unpacked_draw, "With granular-walkers")
    repeated = Run(tmp_path / "repeated" / draw.name).result["velocity"]
    assert repeated == pytest.approx(Run(draw).result["velocity"], rel=1e-9)


@pytest.fixture(scope="session")
def uncertain_archive(uncertain_runs: Path, uncertain_names: list[str], once: Once) -> Path:
    """A folder with the archives ``run.zip`` of the first point and ``sweep.zip`` of the sweep."""

    def fill(folder: Path) -> None:
        _exported(uncertain_runs / uncertain_names[0], folder / "run.zip")
        _exported(uncertain_runs / "angles", folder / "sweep.zip")

    return once("uncertain-archives", fill)


@pytest.fixture(params=["run", "sweep"])
def uncertain_copies(
    request: pytest.FixtureRequest, uncertain_archive: Path, tmp_path: Path
) -> Path:
    """The runs of the unpacked archive of a run, and of that of a sweep."""
    return _unpacked(uncertain_archive / f"{request.param}.zip", tmp_path / "unpacked") / "runs"


def _points_in(copies: Path, names: list[str]) -> list[Path]:
    """Those of the runs that an archive has: the first one at least."""
    points = [copies / name for name in names if (copies / name).exists()]
    assert points[0].name == names[0]
    return points


def test_archives_with_a_spread_and_an_accuracy_are_whole(uncertain_copies: Path) -> None:
    """The check finds nothing missing."""
    assert len(_checked(uncertain_copies.parent)) == 1


def test_archives_have_bands_and_errors_of_results(
    uncertain_copies: Path, uncertain_runs: Path, uncertain_names: list[str]
) -> None:
    for point in _points_in(uncertain_copies, uncertain_names):
        result = Run(point).result
        assert {"velocity_low", "velocity_high", "velocity_draws"} <= result.keys()
        assert result == Run(uncertain_runs / point.name).result
    assert "velocity_error" in Run(uncertain_copies / uncertain_names[0]).result


def test_archives_have_the_spreads_of_their_runs(
    uncertain_copies: Path, uncertain_names: list[str], tmp_path: Path
) -> None:
    """Of two draws and the case itself."""
    for point in _points_in(uncertain_copies, uncertain_names):
        spread = uncertain_copies / f"{point.name}-spread"
        assert set(load_table(spread)["status"]) == {"finished"}
        call("plot", str(spread), "--to", str(tmp_path / "draws.png"), check=True)


def test_archives_have_the_accuracy_of_their_run(
    uncertain_copies: Path, uncertain_names: list[str]
) -> None:
    assert (uncertain_copies / f"{uncertain_names[0]}-accuracy" / "sweep.json").is_file()


def test_an_unpacked_run_tells_its_band(uncertain_copies: Path, uncertain_names: list[str]) -> None:
    printed = call("run", str(uncertain_copies / uncertain_names[0]), check=True).stdout
    assert re.match(r"base: velocity .* mm/s, band [0-9.]+ to [0-9.]+", printed)


def test_an_archive_of_a_sweep_has_its_bands(
    uncertain_archive: Path, uncertain_runs: Path, tmp_path: Path
) -> None:
    unpacked = _unpacked(uncertain_archive / "sweep.zip", tmp_path / "unpacked")
    columns = ["velocity", "velocity_low", "velocity_high"]
    table = load_table(unpacked / "runs" / "angles")[columns]
    assert table.equals(load_table(uncertain_runs / "angles")[columns])
