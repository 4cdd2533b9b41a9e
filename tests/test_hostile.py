"""A user's texts and paths in other languages: what becomes of them is the same program, page, deck and folder.

They become code where one language is put into another without quoting: titles, names, paths, settings.
"""

import json
import os
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.conftest import PROGRAM, SHORT, call, document, make_case, to_toml
from walkers import run as run_case
from walkers.archive.writing import write_archive
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import load_sweep
from walkers.postprocess.drawing import new_figure, plain_text, save_figure
from walkers.postprocess.paraview import write_vtk
from walkers.postprocess.report.run import result_html
from walkers.postprocess.results import read
from walkers.runner.directory import CASE_NAME, case_of
from walkers.runner.files import write_json
from walkers.runner.manifest import recomputed
from walkers.show import describe, summarise
from walkers.sweeps.table import load
from walkers.templates.deck import render_deck
from walkers.text import rendered

HOSTILE: dict[str, str] = {
    "three double quotes": '"""; open("pwned", "w"); """',
    "three single quotes": "'''; open('pwned', 'w'); '''",
    "quotes": '"a" \'b\' "',
    "braces": "{0} {x!r} }{",
    "backslashes": r"C:\Users\new\x \N{BULLET}",
    "backslash at the end": "ends in \\",
    "newline": "one\nimport os; open('pwned', 'w')\nshell touch pwned",
    "carriage return": "one\ropen('pwned', 'w')\rshell touch pwned",
    "other ends of lines": "one\x0bshell touch pwned\x0cshell touch pwned\x85shell touch pwned\u2028shell touch pwned",
    "tab and escape": "one\ttwo \x1b[31mred\x1b[0m",
    "script": "</title></script><script>open('pwned')</script>",
    "attribute": '" onload="open(1)" x="',
    "comment of HTML": "--><script>open('pwned')</script><!--",
    "expression of jinja": "{{ 7 * 7 }}{{7*7}}",
    "block of jinja": "{% raw %}{% include 'x' %}{# comment #}",
    "ampersand": "a & b &amp; &lt;script&gt;",
    "variable of a shell": "${HOME} $HOME $(touch pwned)",
    "backquotes": "`touch pwned`",
    "shell": "; touch pwned; '\"; touch pwned #",
    "hash": "# heading # comment",
    "table of markdown": "a | b | [link](javascript:open) ![x](y) *z* <b>",
    "end of CDATA": "]]><x/>",
    "YAML": "- a: *b\n%x",
    "no ASCII": "Γ0 = 0,38 · 粒子 · é · \U0001f41d · \u202e",
    "very long": "long " * 20_000,
}
"""From what they hold to texts that a case file may hold; whoever runs one finds a file ``pwned``."""
EACH = pytest.mark.parametrize("name", HOSTILE)


class _Tags(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, tuple[str, ...]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, tuple(name for name, _ in attrs)))

    def handle_comment(self, data: str) -> None:
        self.found.append(("comment", ()))


def _tags(page: str) -> list[tuple[str, tuple[str, ...]]]:
    """Tags of a page with the names of their attributes: no text of anybody's may add one."""
    return _Tags(page).found


def _with_texts(case: Case, text: str) -> Case:
    """The case as somebody could hand it over: each text of it another."""
    named = case.put("beads.material", text).put("liquid.name", text).put("boundary.material", text)
    return named.but(name=text, title=text)


@pytest.fixture
def stranger(run_directory: Callable[..., Path], tmp_path: Path) -> Callable[[str], Path]:
    """A run directory whose case has a text everywhere, and a manifest that says so."""
    given = run_directory(run=SHORT)

    def made(text: str) -> Path:
        place = tmp_path / given.name
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(given, place)
        with recomputed(place, [CASE_NAME]):
            write_json(place / CASE_NAME, _with_texts(case_of(given), text).as_dict())
        return place

    return made


@EACH
def test_a_title_is_no_line_of_a_deck(name: str) -> None:
    tables = document(run=SHORT, beads={"density": "4 g/cm^3"})
    plain, text = Case.read(tables, name="plain"), HOSTILE[name]
    odd = _with_texts(Case.read({**tables, "title": text}, name=text), text)
    decks = [render_deck(case) for case in (plain, odd)]
    assert (decks[1].text, decks[1].files) == (decks[0].text, decks[0].files)


@EACH
def test_a_title_is_in_no_file_for_paraview(name: str, stranger: Callable[[str], Path], tmp_path: Path) -> None:
    texts = {"plain": "plain", "odd": HOSTILE[name]}
    exported = [write_vtk(stranger(text), tmp_path / folder) for folder, text in texts.items()]
    listings = {path.read_bytes() for path in exported}
    scripts = {path.with_name("show.py").read_bytes() for path in exported}
    assert len(listings) == len(scripts) == 1


@EACH
def test_a_result_in_a_notebook_has_the_tags_of_any_other(name: str, stranger: Callable[[str], Path]) -> None:
    pages = [result_html(read(place)) for place in map(stranger, ("plain", HOSTILE[name]))]
    assert _tags(pages[1]) == _tags(pages[0])


@pytest.mark.parametrize("name", ["script", "newline", "shell", "quotes", "no ASCII", "variable of a shell"])
def test_an_archive_of_a_stranger_has_json_and_holds_what_it_lists(
    name: str, stranger: Callable[[str], Path], tmp_path: Path
) -> None:
    text = HOSTILE[name]
    place = stranger(text)
    manifest = json.loads((place / "manifest.json").read_text())
    manifest |= {"platform": text, "engine": {**manifest["engine"], "sha256": text}}
    write_json(place / "manifest.json", manifest)
    path = write_archive(place, tmp_path / "archive.zip")
    with zipfile.ZipFile(path) as archive:
        json.loads(archive.read("ro-crate-metadata.json"))
        listed = archive.read("sha256sums.txt").decode().split("\n")[:-1]
        assert {line.partition("  ")[2] for line in listed} <= set(archive.namelist())
    shutil.unpack_archive(path, tmp_path / "unpacked")
    call("check", "files", str(tmp_path / "unpacked"), check=True)


@EACH
def test_a_figure_is_xml_and_shows_a_text_as_it_is(name: str, tmp_path: Path) -> None:
    figure, _ = new_figure(3.0, 2.0)
    figure.suptitle(plain_text(HOSTILE[name][:2000]))
    (path,) = save_figure(figure, tmp_path / "figure", [], ["svg"], HOSTILE[name])
    ElementTree.parse(path)


@EACH
def test_a_calibrations_title_is_no_line_of_its_report(name: str) -> None:
    def told(text: str) -> str:
        row = {"title": text, "value": 1.0, "deviation": 0.1, "unit": "", "engine": 1.0, "low": None, "emulator": 1.0}
        row |= {"error": 0.1, "agrees": True, "derived": False, "held_out": {text: (1.0, 0.1)}}
        weights = {"points": 1, "effective_samples": 1.0, "converged": True}
        found = {
            "title": text, "calibration": text, "agree": 1, "of": 1, "sets": 1, "parameters": {"a": text},
            "best": {"a": 1.0}, "intervals": {"a": (0.0, 1.0, 2.0)}, "words": {"a": ""}, "observations": [row],
            "discrepancies": {text: 1.0}, "emulators_within_two_errors": 1.0, "emulators_checked": 1,
            "feasible": {"seen": 1.0, "expected": 1.0}, "posterior": weights, "held_out_posteriors": {text: weights},
            "settings": {"parameters": {"a": {"range": (0.0, 1.0)}}},
        }  # fmt: skip
        given = {"samples": 1, "least": 1.0, "narrow": 0.5, "observed": "measured"}
        return rendered("walkers.calibration", "report.md.j2", found=found, discrepancies=[(0.0, 1.0, 2.0)], **given)

    plain, odd = told("plain").split("\n"), told(HOSTILE[name])
    assert "\r" not in odd
    assert len(odd.split("\n")) == len(plain)
    for one, other in zip(odd.split("\n"), plain, strict=True):
        assert one.replace("\\|", "").count("|") == other.count("|")
        assert "<" not in one.replace("\\<", "")


@EACH
def test_a_summary_of_a_case_has_no_line_of_its_title(name: str) -> None:
    case = make_case(run=SHORT)
    plain, odd = (describe(summarise(case.but(title=title))) for title in ("plain", HOSTILE[name]))
    assert len(odd.splitlines()) == len(plain.splitlines())
    assert all(line.isprintable() for line in odd.split("\n"))


# --- names and folders ------------------------------------------------------------------------------------------------


ODD = {
    "all that shells take": '--sp ace; it\'s "so" $(touch executed)`touch executed`;touch executed;&& ${HOME}\\ [a]*?',
    "umlauts, a newline and two hundred characters": "äöü-γ-走\ntwo lines" + "x" * 180,
}
NO_UTF8 = os.fsdecode(b"x\xff")


@pytest.fixture
def case_file(in_folder: Path) -> Path:
    file = in_folder / "base.toml"
    file.write_text(to_toml(document(run=SHORT)))
    (in_folder / "site.toml").write_text("cores = 2\n")
    return file


@pytest.mark.parametrize("name", ODD)
def test_odd_paths_without_a_site_file_are_paths(name: str, case_file: Path, in_folder: Path) -> None:
    odd = ODD[name]
    (in_folder / f"{odd}.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    call("sweep", f"./{odd}.toml", "--out", f"./{odd}", "-j", "1", check=True)
    assert list(load(in_folder / odd / odd)["status"]) == ["finished"] * 2
    case = case_file.rename(f"{odd}.toml")
    for command in (("run",), ("plot",), ("export", "--to", "vtk")):
        assert "Traceback" not in call(*command, f"./{case}", "--out", f"./{odd}", check=True).stderr
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
        assert "expected letters, digits and" in done.stderr
    assert sorted(in_folder.rglob("*")) == before


@pytest.mark.parametrize("command", [f"run base.toml --out {NO_UTF8}", f"run {NO_UTF8}.toml"])
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
    """The libraries of the tables take whole paths, and no others."""
    folder = in_folder / NO_UTF8
    folder.mkdir()
    done = subprocess.run([PROGRAM, "run", "../base.toml"], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, len(done.stderr.splitlines()), list(folder.iterdir())) == (2, 1, [])
    tries: list[Callable[[], object]] = [
        lambda: run_case("base.toml", folder),
        lambda: load_case(f"{NO_UTF8}.toml"),
        lambda: run_case(load_case("base.toml").but(name=NO_UTF8), in_folder),
    ]
    for attempt in tries:
        with pytest.raises(InputError, match=r"x\\xff.*: expected UTF-8 text"):
            attempt()


def test_files_without_a_name_are_refused(case_file: Path, in_folder: Path) -> None:
    """Their stems are the folder and the one above: a sweep would write there."""
    before = sorted(in_folder.rglob("*"))
    for name in ("...toml", "..toml"):
        (in_folder / name).write_text('case = "base.toml"\n')
        for reader in (load_sweep, load_case):
            with pytest.raises(InputError, match=r"expected a name before \.toml"):
                reader(name)
        assert call("sweep", name).returncode == 2
        (in_folder / name).unlink()
    assert sorted(in_folder.rglob("*")) == before
