"""Names and folders that a shell, a deck or a file name could stumble over."""

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import PROGRAM, SHORT, call, document, to_toml
from walkers import run as run_case
from walkers.inputs import InputError, load_case
from walkers.inputs.sweep import load_sweep
from walkers.sweeps.site import check_path
from walkers.sweeps.table import load

ODD = {
    "all that shells take": 'sp ace; it\'s "so" $(touch executed)`touch executed`;touch executed;&& ${HOME}\\ [a]*?',
    "umlauts and a newline": "äöü-γ-走\ntwo lines",
    "two hundred characters": "x" * 200,
    "a dash": "--dash",
}
NO_UTF8 = os.fsdecode(b"x\xff")


@pytest.fixture
def case_file(in_folder: Path) -> Path:
    file = in_folder / "base.toml"
    file.write_text(to_toml(document(run=SHORT)))
    (in_folder / "site.toml").write_text('scheduler = "local"\ncores = 2\n[executor]\naddress = "127.0.0.1"\n')
    return file


@pytest.mark.parametrize("name", ODD)
def test_odd_paths_without_a_site_file_are_paths(name: str, case_file: Path, in_folder: Path) -> None:
    odd = ODD[name]
    (in_folder / f"{odd}.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    call("sweep", f"./{odd}.toml", "--out", f"./{odd}", "-j", "1", check=True)
    assert list(load(in_folder / odd / odd)["status"]) == ["finished"] * 2
    case = case_file.rename(f"{odd}.toml")
    for command in ("run", "plot", "vtk"):
        assert "Traceback" not in call(command, f"./{case}", "--out", f"./{odd}", check=True).stderr
    assert not list(in_folder.rglob("executed"))


@pytest.mark.parametrize("odd", ["sp ace", "$(x)", "a\nb"])
def test_with_a_site_file_odd_paths_are_refused_before_anything_is_done(
    odd: str, case_file: Path, in_folder: Path
) -> None:
    (in_folder / "plain.toml").write_text('case = "base.toml"\n')
    (in_folder / f"{odd}.toml").write_text('case = "base.toml"\n')
    before = sorted(in_folder.rglob("*"))
    for sweep, out in (("plain.toml", f"./{odd}"), (f"./{odd}.toml", "runs")):
        done = call("sweep", sweep, "--out", out, "--site", "site.toml")
        assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
        assert done.stderr.startswith("walkers: --out: ")
        assert "expected letters, digits and" in done.stderr
    assert sorted(in_folder.rglob("*")) == before


def test_what_a_shell_takes_as_it_is_is_not_refused(tmp_path: Path) -> None:
    for name in ("äöü-γ-走", "x" * 200, "--dash"):
        check_path(tmp_path / name)


@pytest.mark.parametrize("command", [f"run base.toml --out {NO_UTF8}", f"run {NO_UTF8}.toml", f"result runs/{NO_UTF8}"])
def test_paths_that_are_no_utf8_are_refused_before_anything_is_done(
    command: str, case_file: Path, in_folder: Path
) -> None:
    (in_folder / f"{NO_UTF8}.toml").write_bytes(case_file.read_bytes())
    before = sorted(in_folder.rglob("*"))
    done = subprocess.run([PROGRAM, *command.split()], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert r"x\xff" in done.stderr
    assert "expected UTF-8 text" in done.stderr
    assert sorted(in_folder.rglob("*")) == before


def test_a_folder_that_is_no_utf8_is_refused_before_anything_is_done(case_file: Path, in_folder: Path) -> None:
    """The tables' and ParaView's libraries take whole paths, and no others."""
    folder = in_folder / NO_UTF8
    folder.mkdir()
    done = subprocess.run([PROGRAM, "run", "../base.toml"], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stderr.splitlines()), list(folder.iterdir())) == (2, 1, [])
    tries: list[Callable[[], object]] = [
        lambda: run_case("base.toml", folder),
        lambda: load_case(f"{NO_UTF8}.toml"),
        lambda: run_case(load_case("base.toml").renamed(NO_UTF8), in_folder),
    ]
    for attempt in tries:
        with pytest.raises(InputError, match=r"x\\xff.*: expected UTF-8 text"):
            attempt()


def test_files_without_a_name_are_refused(case_file: Path, in_folder: Path) -> None:
    """Their stems are the folder and the one above: a sweep would write there."""
    before = sorted(in_folder.rglob("*"))
    for name in ("...toml", "..toml"):
        (in_folder / name).write_text('case = "base.toml"\n')
        for read in (load_sweep, load_case):
            with pytest.raises(InputError, match=r"expected a name before \.toml"):
                read(name)
        assert call("sweep", name).returncode == 2
        (in_folder / name).unlink()
    assert sorted(in_folder.rglob("*")) == before
