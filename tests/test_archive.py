"""What a run is worth later: its manifest, its checksums, and archives that others can read, check and use again."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from pathlib import Path

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
from walkers.runner.run_directory import leave_out_dumps
from walkers.sweeps.table import load_table

AUTHOR = ("--author", "Josiah Carberry", "--licence", "CC-BY-4.0")
RECORD = "archive.json"
SUMS = "sha256sums.txt"


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
        (folder / "angles.toml").write_text(
            'case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
        )
        call("sweep", "angles.toml", "-j", "1", check=True, folder=folder)

    return Path(shutil.copytree(once("archived-sweep", fill) / "runs", tmp_path / "shared"))


def _verified(path: Path, status: int = 0) -> list[str]:
    """Lines that ``walkers check files`` prints."""
    done = call("check", "files", str(path))
    assert done.returncode == status, (done.stdout, done.stderr)
    return (done.stdout + done.stderr).splitlines()


def test_manifests_say_what_made_the_run(run: Path) -> None:
    manifest = read_manifest(run)
    files = {path.relative_to(run).as_posix(): path for path in run.rglob("*") if path.is_file()}
    del files["manifest.json"]
    assert manifest["sha256"] == {
        name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()
    }
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
    manifest = read_manifest(run)
    listed = dict(line.split("  ")[::-1] for line in (unpacked / SUMS).read_text().splitlines())
    assert {name: listed[f"runs/{run.name}/{name}"] for name in manifest["sha256"]} == manifest[
        "sha256"
    ]
    record = read_json(unpacked / RECORD)
    assert (record["authors"], record["licence"]) == (["Josiah Carberry"], "CC-BY-4.0")
    assert (record["name"], record["finished"]) == (run.name, manifest["finished"])
    about = record["runs"][f"runs/{run.name}"]
    assert (about["case"], about["made_by"]["commit"]) == ("test", manifest["commit"])
    assert about["made_by"]["packages"] == manifest["packages"]
    assert about["engine"] == {name: manifest["engine"][name] for name in ("version", "sha256")}
    assert about["contact_model"]["sources"] == model_version()["sources"]
    assert "measured_by" not in about
    assert str(Path.home()) not in (unpacked / RECORD).read_text(), "no path of this machine"


def test_an_archive_has_the_date_of_its_last_run() -> None:
    dates = ("2026-03-01T10:00:00Z", "2026-03-02T09:00:00Z", "2026-02-28T23:00:00Z")
    manifests = {date: {"finished": date} for date in dates}
    assert Contents("three", "", manifests, cases={}, files={}, main=[]).finished == dates[1]


def test_the_record_of_an_archive_names_the_programs_that_made_and_measured_a_run(
    run: Path, tmp_path: Path
) -> None:
    """The run was measured again by a later version. Nothing is said that the user does not say."""
    later = {
        **software(),
        "granular_walkers": "99.0",
        "commit": None,
        "date": "2099-01-01T00:00:00Z",
        "files": [],
    }
    write_json(run / "manifest.json", {**read_manifest(run), "tabulated": later})
    with zipfile.ZipFile(write_archive(run, tmp_path / "run.zip")) as packed:
        record = json.loads(packed.read(RECORD))
        readme = packed.read("README.md").decode()
    about = record["runs"][f"runs/{run.name}"]
    assert about["made_by"]["granular_walkers"] == software()["granular_walkers"]
    assert (about["measured_by"]["granular_walkers"], about["measured_by"]["date"]) == (
        "99.0",
        later["date"],
    )
    assert (record["authors"], record["licence"]) == ([], None)
    assert "Licence:" not in readme
    assert "\nBy " not in readme


def test_an_archive_without_dumps(run: Path, tmp_path: Path) -> None:
    archive, again = tmp_path / "run.zip", tmp_path / "again.zip"
    call("export", str(run), "--to", "archive", "-o", str(archive), "--without-dumps", check=True)
    shutil.unpack_archive(archive, tmp_path / "unpacked")
    there = tmp_path / "unpacked" / "runs" / run.name
    dumps = [
        f"  left out   segments/0000/{name}"
        for name in ("beads.bin", "bridges.pairs.txt", "bridges.walls.txt")
    ]
    files = len(read_manifest(run)["files"])
    assert _verified(there) == [
        f"{run.name}: {files - 3} files are unchanged",
        "  made since test.toml",
        *dumps,
    ]
    assert Run(there).result == Run(run).result
    call("export", str(there), "--to", "archive", "-o", str(again), "--without-dumps", check=True)
    assert archive.read_bytes() == again.read_bytes()
    done = call("render", str(there))
    assert (done.returncode, "beads.bin" in done.stderr) == (1, True)


def test_an_archive_of_a_sweep(shared: Path, tmp_path: Path) -> None:
    """Runs that shared a deck come with it, and the table is what it was."""
    archive, unpacked = tmp_path / "sweep.zip", tmp_path / "unpacked"
    call(
        "export", str(shared / "angles"), "--to", "archive", "-o", str(archive), *AUTHOR, check=True
    )
    shutil.unpack_archive(archive, unpacked)
    there = unpacked / "runs" / "angles"
    before, after = (
        load_table(folder).drop(columns="run") for folder in (shared / "angles", there)
    )
    assert list(after["status"]) == ["finished"] * 2
    assert before.equals(after)
    places = [unpacked / place for place in pd.read_csv(there / "table.csv")["run"]]
    assert [place.name for place in places] == [
        Path(place).name for place in load_table(shared / "angles")["run"]
    ]
    for place, angle in zip(places, ("0 deg", "10 deg"), strict=True):
        assert load_case(place / "base.toml") == build_case(
            document(run=SHORT, dimers={"angle": angle}), name="base"
        )
    assert list(read_json(unpacked / RECORD)["runs"]) == [f"runs/{place.name}" for place in places]
    assert _verified(there)[0] == "angles: 2 points have a run"
    deck = places[0] / "shared_deck" / "walker.lig"
    deck.write_text(deck.read_text().replace("gravity", "levity"))
    assert _verified(there, 1).count("  changed    shared_deck/walker.lig") == 1
    for place in places:
        shutil.rmtree(place)
    gone = _verified(there, 1)
    assert (gone[0], sum("(missing: point " in line for line in gone)) == (
        "angles: 0 points have a run",
        2,
    )
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


@pytest.mark.parametrize(
    ("name", "contents", "status", "said"),
    [
        ("film.mp4", b"new", 0, "made since film.mp4"),
        ("notes.txt", b"new", 1, "not listed notes.txt"),
        ("result.json", None, 1, "result.json"),
        (RECORD, None, 1, f"missing    {RECORD}"),
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


def _rewritten(archive: Path, to: Path, contents: dict[str, bytes | None]) -> None:
    """A copy of a zip file with other contents of some files; those with None are left out, unknown ones are added."""
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(to, "w", zipfile.ZIP_DEFLATED) as copy:
        files = {name: source.read(name) for name in source.namelist()}
        for name, text in {**files, **contents}.items():
            if text is not None:
                copy.writestr(name, text)


def _with_a_second(archive: Path, to: Path, name: str) -> None:
    """A copy of a zip file with a second file of a name."""
    shutil.copy(archive, to)
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(to, "a") as copy:
        copy.writestr(zipfile.ZipInfo(name), source.read(name))


def _with_a_flipped_byte(archive: Path, to: Path, name: str) -> None:
    """A copy of a zip file in which a byte of a compressed file is another one."""
    with zipfile.ZipFile(archive) as source:
        entry = source.getinfo(name)
    contents = bytearray(archive.read_bytes())
    contents[entry.header_offset + 30 + len(name) + entry.compress_size // 2] ^= 0xFF
    to.write_bytes(contents)


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_an_archive_that_is_not_unpacked_is_checked_as_it_is(archive: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(archive) as packed:
        files = packed.namelist()
    table = next(name for name in files if name.endswith("walkers.parquet"))
    whole, one_less = (
        f"{len(files) - 1} files are unchanged",
        f"{len(files) - 2} files are unchanged",
    )
    assert _verified(archive) == [f"run.zip: {whole}"]
    to = tmp_path / "copy.zip"
    _rewritten(archive, to, {table: b"other"})
    assert _verified(to, 1) == [f"copy.zip: {one_less}", f"  changed    {table}"]
    _rewritten(archive, to, {table: None})
    assert _verified(to, 1) == [f"copy.zip: {one_less}", f"  missing    {table}"]
    _rewritten(archive, to, {"\x1b[2J.txt": b"new"})
    assert _verified(to, 1) == [f"copy.zip: {whole}", r"  not listed \x1b[2J.txt"]
    _with_a_second(archive, to, table)
    assert _verified(to, 1) == [f"copy.zip: {whole}", f"  not listed {table}"]
    _with_a_flipped_byte(archive, to, table)
    assert _verified(to, 1) == [f"copy.zip: {one_less}", f"  changed    {table}"]


@pytest.mark.parametrize(
    ("contents", "said"),
    [
        (lambda archive: archive.read_bytes()[:-100], "expected an archive, a zip file"),
        (lambda _: b"no zip", "expected an archive, a zip file"),
        (lambda _: b"PK\x05\x06" + bytes(18), f"expected an archive, which has a {SUMS}"),
    ],
    ids=["cut", "text", "empty"],
)
def test_what_is_no_archive_is_refused(
    contents: Callable[[Path], bytes], said: str, archive: Path, tmp_path: Path
) -> None:
    to = tmp_path / "copy.zip"
    to.write_bytes(contents(archive))
    (line,) = _verified(to, 2)
    assert said in line
    assert str(to) in line


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


def _commands(readme: str, heading: str) -> str:
    """The commands that a README prints below a heading, but those that install packages, as a shell script."""
    section = readme.split(f"## {heading}\n")[1].split("\n## ", maxsplit=1)[0]
    lines = [line.strip() for line in section.splitlines() if line.startswith("    ")]
    return "\n".join(line for line in lines if not line.startswith("apt-get "))


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


def _short_run(folder: Path) -> Path:
    return walkers.run(make_case(run=SHORT), folder / "runs").directory


def _sweep(folder: Path) -> Path:
    """A sweep whose points share a deck."""
    (folder / "base.toml").write_text(to_toml(document(run=SHORT)))
    (folder / "angles.toml").write_text(
        'case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
    )
    return walkers.sweep(folder / "angles.toml", folder / "runs").directory


@pytest.mark.parametrize(
    "make",
    [  # each compiles the contact model
        _short_run,
        pytest.param(_edited_deck, marks=pytest.mark.slow),
        pytest.param(_sweep, marks=pytest.mark.slow),
    ],
)
def test_the_commands_of_a_readme_repeat_the_run(
    make: Callable[[Path], Path], tmp_path: Path
) -> None:
    """As they are printed: with LIGGGHTS alone by the script and by hand, and with the program."""
    (tmp_path / "made").mkdir()
    directory = make(tmp_path / "made")
    archive = write_archive(directory, tmp_path / "run.zip")
    shutil.rmtree(tmp_path / "made")
    unpacked = tmp_path / "unpacked"
    shutil.unpack_archive(archive, unpacked)
    told = _followed(unpacked, "With LIGGGHTS alone")
    (by_hand,) = (path.parent for path in tmp_path.glob("repeated-by-liggghts/**/log.liggghts"))
    run = unpacked / next(iter(read_json(unpacked / RECORD)["runs"]))
    if by_hand.name == "shared_deck":
        assert "written    shared_deck/beads.bin (nothing to compare with)" in told
    else:
        deck = by_hand.relative_to(tmp_path / "repeated-by-liggghts")
        assert told.count("the same   ") == 3
        assert (by_hand / "beads.bin").read_bytes() == (run / deck / "beads.bin").read_bytes()
    shutil.rmtree(unpacked)
    shutil.unpack_archive(archive, unpacked)
    told = _followed(unpacked, "With granular-walkers")
    assert "archive.json: OK" in told
    assert f"\n{unpacked.name}: " in told
    (repeated,) = (tmp_path / "repeated").glob("*/manifest.json")
    assert Run(repeated.parent).result["velocity"] == pytest.approx(
        Run(run).result["velocity"], rel=1e-9
    )


@pytest.mark.parametrize(
    "make", [_long_run, pytest.param(_parallel_run, marks=pytest.mark.slow), _edited_deck]
)
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
    assert (
        f"sh repeat.sh runs/{directory.name} ../repeated-by-liggghts"
        in (unpacked / "README.md").read_text()
    )
    # A dump that is not the engine's is found.
    beads = sorted(unpacked.glob("runs/**/beads.bin"))[-1]
    beads.write_bytes(beads.read_bytes()[:-1] + b"x")
    shutil.rmtree(unpacked / "repeated")
    again = repeat(unpacked, directory.name)
    assert (again.returncode, again.stdout.count("different  ")) == (1, 1)


def test_an_archive_says_what_it_cannot_repeat(
    shared: Path, repeat: Repeat, tmp_path: Path
) -> None:
    """A shared deck is run for all of its runs; without tables of forces there is nothing to run."""
    call(
        "export",
        str(shared / "angles"),
        "--to",
        "archive",
        "-o",
        str(tmp_path / "two.zip"),
        check=True,
    )
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
    assert (
        refused.returncode,
        "tables of forces (bridges.txt) were left out" in refused.stderr,
    ) == (2, True)


def test_the_readme_says_who_made_the_archive_and_with_which_contact_model(
    run: Path, tmp_path: Path
) -> None:
    assert read_manifest(run)["contact_model"].items() >= model_version().items()
    texts = []
    models = [
        {"path": "", **model_version()},
        {"forces_version": model_version()["forces_version"]},
        {},
        None,
    ]
    for model in models:
        manifest = read_manifest(run)
        manifest["contact_model"] = model
        write_json(run / "manifest.json", manifest)
        archive = write_archive(
            run, tmp_path / "run.zip", authors=["A. User", "*B*"], licence="CC0-1.0"
        )
        with zipfile.ZipFile(archive) as packed:
            texts.append(packed.read("README.md").decode())
    assert (
        "computed from it.\n\nBy A. User, \\*B\\*. Licence: CC0-1.0. The contact model" in texts[0]
    )
    same, other, unknown, by_hand = texts
    assert "The runs were made with these sources." in same
    assert "other sources that compute the same forces" in other
    assert "or do not record it" in unknown
    assert "or do not record it" in by_hand, "a deck that was run by hand"


@pytest.fixture(scope="session")
def uncertain(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A folder with a sweep of two points, each with a spread, and with the accuracy of the first one."""

    def fill(folder: Path) -> None:
        ranges = {"uncertain": {"contact.restitution": [0.2, 0.5]}}
        (folder / "base.toml").write_text(to_toml(document(run=SHORT, **ranges)))
        (folder / "angles.toml").write_text(
            'case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n'
        )
        command = ["sweep", "angles.toml", "-j", "1", "--spread", "--points", "2"]
        call(*command, check=True, folder=folder)
        call("run", "base.toml", "--accuracy", check=True, folder=folder)

    return once("uncertain", fill)


def test_the_archive_of_a_draw_says_that_liggghts_cannot_repeat_it(
    uncertain: Path, tmp_path: Path
) -> None:
    """It has no tables of forces; the program repeats it."""
    runs = [Path(run).name for run in load_table(uncertain / "runs" / "angles")["run"]]
    draw = (
        uncertain
        / "runs"
        / Path(load_table(uncertain / "runs" / f"{runs[1]}-spread")["run"][0]).name
    )
    assert not list(draw.rglob("bridges.txt"))
    archive, unpacked = tmp_path / "draw.zip", tmp_path / "unpacked"
    call("export", str(draw), "--to", "archive", "-o", str(archive), check=True)
    shutil.unpack_archive(archive, unpacked)
    readme = (unpacked / "README.md").read_text()
    assert f"The run `runs/{draw.name}` cannot be repeated in this way" in readme
    assert "repeat.sh" not in _commands(readme, "With LIGGGHTS alone")
    _followed(unpacked, "With granular-walkers")
    repeated = Run(tmp_path / "repeated" / draw.name).result["velocity"]
    assert repeated == pytest.approx(Run(draw).result["velocity"], rel=1e-9)


@pytest.mark.parametrize("what", ["a run", "a sweep"])
def test_archives_have_the_spread_and_the_accuracy(
    what: str, uncertain: Path, tmp_path: Path
) -> None:
    """A colleague sees the same band, error and figures, and the check finds nothing missing."""
    table = load_table(uncertain / "runs" / "angles")
    runs = [Path(run).name for run in table["run"]]
    packed = runs[0] if what == "a run" else "angles"
    archive, unpacked = tmp_path / "archive.zip", tmp_path / "unpacked"
    command = ["export", str(uncertain / "runs" / packed), "--to", "archive", "-o", str(archive)]
    call(*command, check=True)
    shutil.unpack_archive(archive, unpacked)
    there = unpacked / "runs"
    assert len(_verified(unpacked)) == 1
    for run in runs[:1] if what == "a run" else runs:
        before, after = (Run(folder / run).result for folder in (uncertain / "runs", there))
        assert {"velocity_low", "velocity_high", "velocity_draws"} <= after.keys()
        assert after == before
        assert list(load_table(there / f"{run}-spread")["status"]) == ["finished"] * len(
            load_table(there / f"{run}-spread")
        )
        call("plot", str(there / f"{run}-spread"), "--to", str(tmp_path / "draws.png"), check=True)
    assert (
        Run(there / runs[0]).result["velocity_error"]
        == Run(uncertain / "runs" / runs[0]).result["velocity_error"]
    )
    assert (there / f"{runs[0]}-accuracy" / "sweep.json").is_file()
    told = call("run", str(there / runs[0]), check=True).stdout
    assert re.search(r"velocity along the heading .* band [0-9.]+ to [0-9.]+", told)
    if what == "a sweep":
        columns = ["velocity", "velocity_low", "velocity_high"]
        assert load_table(there / "angles")[columns].equals(table[columns])
