"""README and docs/ are up to date: links, names, pictures, outputs, numbers, examples."""

from __future__ import annotations

import ast
import doctest
import re
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path

import pandas as pd
import pytest

import walkers
from docs._ext import generated
from docs.illustrations import (
    facts,
    output_of,
    pages_of,
    refreshed,
    stale,
    without_hashes,
)
from docs.sweep_figures import clusters_figure, trays_figure
from studies.paper.make import page_of
from walkers import load_case
from walkers.files import read_json
from walkers.theory.prediction import PAPER_FIT, predicted_column

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = [page for page in pages_of(DOCS) if not page.is_relative_to(DOCS / "gallery")]

_FENCE = re.compile(r"^([ \t]*)(```+|~~~+).*?^\1\2[ \t]*$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"`[^`\n]*`")
_LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?[^)]*\)|<img[^>]*\ssrc=\"([^\"]+)\"")
_HEADING = re.compile(r"^#{1,6}\s+(.+?)\s*#*$", re.MULTILINE)


@cache
def prose(page: Path) -> str:
    return _FENCE.sub("", page.read_text("utf-8"))


@cache
def anchors(page: Path) -> set[str]:
    """Anchors of headings, as GitHub and myst make them.

    They have lower case, hyphens for blanks, and no punctuation.
    """
    names = set()
    for heading in _HEADING.findall(prose(page)):
        title = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        letters = re.sub(r"[^\w\- ]", "", title.lower())
        names.add(letters.replace(" ", "-"))
    return names


def leads_somewhere(link: str, page: Path) -> bool:
    """Whether a link of a page is an address, or the name of a file and one of its headings."""
    if re.match(r"[a-z]+:", link):
        return True
    name, _, anchor = link.partition("#")
    target = page
    if name:
        target = (page.parent / name).resolve()
    return target.exists() and (not anchor or anchor in anchors(target))


def path_in_project(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=path_in_project)
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    missing = []
    for of_text, of_picture in _LINK.findall(_CODE.sub("", prose(page))):
        link = of_text or of_picture
        if not leads_somewhere(link, page):
            missing.append(link)
    assert missing == []


_NAME = re.compile(r"(?<!`)`([A-Za-z_][\w.]*)`(?!`)")
_OF_PACKAGE = re.compile(r"(?<![\w./-])(?:walkers|studies)(?:\.[A-Za-z_]\w*)+")
_FILES = ("pvd", "parquet", "sif", "def", "css")
"""Suffixes of files that are named ``walkers``."""
_ERRORS = ("walkers.errors.", "walkers.runner.failures.")


def exists(name: str) -> bool:
    """Whether a dotted name is that of a module, or of an attribute of one.

    Fields of a dataclass are annotations.
    """
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        with suppress(ImportError):
            owner: object = import_module(".".join(parts[:count]))
            for part in parts[count:]:
                if not hasattr(owner, part):
                    return part in getattr(owner, "__annotations__", {})
                owner = getattr(owner, part)
            return True
    return False


def names_in_code(tree: ast.Module) -> set[str | None]:
    """Names in the code of a module: variables, attributes, arguments, functions and classes."""
    names = set()
    for node in ast.walk(tree):
        for field in ("id", "attr", "arg", "name"):
            names.add(getattr(node, field, None))
    return names


def names_in_docstrings(tree: ast.Module) -> list[str]:
    """Names in backquotes in the docstrings of a module."""
    names = []
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                names += _NAME.findall(text)
    return names


def exists_for(name: str, module: str) -> bool:
    """Whether a name exists as it is, in a module, beside it, among the errors, or in Python."""
    package = module.rpartition(".")[0]
    for home in ("", f"{module}.", f"{package}.", "builtins.", *_ERRORS):
        if exists(f"{home}{name}"):
            return True
    return False


@pytest.mark.parametrize(("folder", "at_least"), [("walkers", 300), ("studies", 5)])
def test_names_in_docstrings_are_there(folder: str, at_least: int) -> None:
    """In the code of the file, of a module beside it or of an error, or by a full path."""
    missing = []
    number = 0
    for file in sorted((ROOT / folder).rglob("*.py")):
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        tree = ast.parse(file.read_text("utf-8"))
        code = names_in_code(tree)
        for name in names_in_docstrings(tree):
            number += 1
            if not (set(name.split(".")) <= code or exists_for(name, module)):
                missing.append(f"{path_in_project(file)}: {name}")
    assert number > at_least
    assert missing == []


def files_for_readers() -> list[Path]:
    """Pages, and the templates of pages and reports."""
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    for pattern in ("walkers/**/*.j2", "studies/**/*.j2", "studies/*.md"):
        files += ROOT.glob(pattern)
    for pattern in ("**/*.md", "**/*.rst"):
        files += DOCS.glob(pattern)
    return files


def test_names_of_the_package_on_pages_and_in_templates_are_there() -> None:
    number = 0
    missing = []
    for file in files_for_readers():
        for name in set(_OF_PACKAGE.findall(file.read_text("utf-8"))):
            if name.split(".")[1] in _FILES:
                continue
            number += 1
            if not exists(name):
                missing.append(f"{path_in_project(file)}: {name}")
    assert number > 10
    assert missing == []


def test_no_picture_or_table_is_of_other_parameters_than_todays() -> None:
    """If this fails, run ``make docs-pictures``."""
    assert stale(DOCS) == {}


def has_outputs(page: Path) -> bool:
    """Whether a page has numbers or outputs that the program fills in."""
    return "<!--fact " in prose(page) or "<!--output-->" in prose(page)


@pytest.mark.parametrize("page", list(filter(has_outputs, PAGES)), ids=path_in_project)
def test_no_line_begins_with_the_mark_of_a_number(page: Path) -> None:
    """A comment at the beginning of a line ends the paragraph."""
    assert re.findall(r"^\s*<!--fact .*", prose(page), re.MULTILINE) == []


@pytest.mark.parametrize("page", list(filter(has_outputs, PAGES)), ids=path_in_project)
def test_numbers_and_outputs_on_pages_are_todays(
    page: Path, once: Callable[[str, Callable[[Path], object]], Path]
) -> None:
    """Several pages show the same command, which runs once."""

    def printed(command: str) -> str:
        def print_it(folder: Path) -> None:
            output = output_of(command, folder / "runs")
            (folder / "printed.txt").write_text(output, encoding="utf-8")

        name = f"output-{sha256(command.encode()).hexdigest()[:12]}"
        return (once(name, print_it) / "printed.txt").read_text("utf-8")

    text = page.read_text("utf-8")
    assert without_hashes(refreshed(text, facts(DOCS), printed)) == without_hashes(text)


@pytest.mark.parametrize(
    "module", ["walkers.api", "walkers.inputs.reading", "walkers.postprocess.measure.motion"]
)
def test_examples_give_what_they_say(
    module: str, runs_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder of the tests (``tmp``), with what a user would have imported."""
    # The sweep of `walkers.api` is there for its table: Fig. 4b would take all of 60 cycles.
    monkeypatch.setattr("walkers.inputs.resolving.length._MOST_CYCLES", 12)
    names = {"tmp": runs_folder, "walkers": walkers}
    failed, tried = doctest.testmod(import_module(module), extraglobs=names)
    assert tried
    assert not failed


_SESSION = re.compile(r"^(```|~~~)pycon\n(.+?)^\1$", re.MULTILINE | re.DOTALL)
"""A Python session on a page."""


@pytest.mark.parametrize("page", [ROOT / "README.md", DOCS / "index.md"], ids=path_in_project)
def test_sessions_on_the_first_pages_print_what_they_say(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both pages run the case whose picture is `docs/pictures/walker.png`."""
    monkeypatch.chdir(tmp_path)
    sessions = [lines for _, lines in _SESSION.findall(page.read_text("utf-8"))]
    session = doctest.DocTestParser().get_doctest("".join(sessions), {}, page.name, None, 0)
    assert len(session.examples) > 3
    assert doctest.DocTestRunner().run(session).failed == 0
    assert Path("walker.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", generated.PAGES)
def test_generated_pages_of_the_reference_are_todays(name: str) -> None:
    """If this fails, run ``python -m docs._ext.generated``."""
    assert (generated.FOLDER / f"{name}.md").read_text("utf-8") == generated.PAGES[name]()


def test_the_page_of_the_comparison_is_of_todays_template() -> None:
    """Its sentences say when a fact agrees, as `Observation.agrees` decides."""
    page = DOCS / "figures" / "comparison.md"
    compared = read_json(page.with_suffix(".json"))
    assert page.read_text("utf-8") == page_of(compared)


def test_the_first_velocity_stands_beside_the_curve_of_the_paper() -> None:
    text = " ".join((ROOT / "README.md").read_text("utf-8").split())
    printed = re.search(r"fig1b: velocity ([\d.]+) mm/s", text)
    assert printed is not None
    by_model, _ = predicted_column([load_case("fig1b")], "velocity")
    curve = 1e3 * by_model[PAPER_FIT][0]
    excess = 100.0 * (float(printed[1]) / curve - 1.0)
    assert f"{excess:.0f} % above the curve" in text
    assert f"({curve:.2f} mm/s at this drive, no measured point" in text


def test_clusters_are_sorted_and_filled_by_how_many_stay_upright() -> None:
    """Of six walkers at each of four points, none, 6, 1 and 6 stay upright."""
    table = pd.DataFrame(
        {"upright": [0, 6, 1, 6], "walkers": 6, "axial_velocity": [5e-3, 2e-3, 4e-3, 3e-3]}
    )
    figure = clusters_figure(table, [load_case("climber")] * 4, [1e-4] * 4, "wall")
    symbols = []
    for line in figure.axes[0].lines:
        if line.get_marker() == "o":
            symbols.append((line.get_fillstyle(), list(line.get_ydata())))
    assert symbols == [("full", [3.0, 2.0]), ("left", [4.0]), ("none", [5.0])]
    drawings = figure.axes[0].child_axes
    assert [len(drawing.patches) for drawing in drawings] == [4, 4, 4, 4]  # beads of the climber


def test_means_of_trays_have_bars_from_the_smallest_to_the_largest_seed() -> None:
    table = pd.DataFrame(
        {
            "coverage": 0.05,
            "walkers": [16, 16, 16, 64],
            "drive.peak_acceleration": 4.0,
            "clustered_share": [0.2, 0.3, 0.7, 0.5],
        }
    )
    panel = trays_figure(table).axes[0]
    means = [float(container.lines[0].get_ydata()[0]) for container in panel.containers]
    assert means == pytest.approx([0.4, 0.5])
    (bar,) = panel.containers[0].lines[2][0].get_segments()
    assert bar[:, 1] == pytest.approx([0.2, 0.7])


def imported_from_package(tree: ast.Module) -> set[str]:
    """Modules of the package that a module imports."""
    modules: set[str | None] = set()
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module=module):
                modules.add(module)
            case ast.Import(names=names):
                for alias in names:
                    modules.add(alias.name)
    return {module for module in modules if module and module.split(".")[0] == "walkers"}


def used_names(tree: ast.Module) -> set[str]:
    """Names of the package that a module uses as ``walkers.NAME``."""
    names = set()
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(value=ast.Name(id="walkers"), attr=name):
                names.add(name)
    return names


@pytest.mark.parametrize(
    "path", sorted((DOCS / "examples").glob("*.py")), ids=lambda path: path.stem
)
def test_examples_of_the_gallery_use_public_names_alone(path: Path) -> None:
    """Except in the texts of bridge laws that they write. The site's build runs each example."""
    tree = ast.parse(path.read_text("utf-8"))
    assert imported_from_package(tree) == {"walkers"}
    assert used_names(tree) <= set(walkers.__all__)
