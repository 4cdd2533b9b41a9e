"""README and docs/ are up to date: links, pictures, outputs, numbers in sentences, keys, examples."""

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
from matplotlib.figure import Figure

import walkers
from docs._ext import generated
from docs.illustrations import (
    facts,
    mark_upright,
    output_of,
    pages_of,
    refreshed,
    stale,
    without_hashes,
)
from walkers import load_case
from walkers.files import read_json
from walkers.text import rendered
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
    """As GitHub and myst make them of headings: lower case, hyphens for blanks, no punctuation."""
    titles = (
        re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", title)
        for title in _HEADING.findall(prose(page))
    )
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    missing = []
    for link in (groups[0] or groups[1] for groups in _LINK.findall(_CODE.sub("", prose(page)))):
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        known = re.match(r"[a-z]+:", link) or (
            target.exists() and (not anchor or anchor in anchors(target))
        )
        missing += [] if known else [link]
    assert not missing


_NAME = re.compile(r"(?<!`)`([A-Za-z_][\w.]*)`(?!`)")
_OF_PACKAGE = re.compile(r"(?<![\w./-])(?:walkers|studies)(?:\.[A-Za-z_]\w*)+")
_FILES = ("pvd", "parquet", "sif", "def", "css")
"""Suffixes of files that are named ``walkers``."""
_ERRORS = ("walkers.errors.", "walkers.runner.failures.")


def is_there(name: str) -> bool:
    """Whether a dotted name is that of a module, or of an attribute of one; fields of a dataclass are annotations."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        with suppress(ImportError):
            holder: object = import_module(".".join(parts[:count]))
            for part in parts[count:]:
                if not hasattr(holder, part):
                    return part in getattr(holder, "__annotations__", {})
                holder = getattr(holder, part)
            return True
    return False


def test_names_in_docstrings_are_there() -> None:
    """Those in backquotes: names in the code of the file, of a module beside it, of an error, or a full path."""
    wrong, count = [], 0
    for file in sorted([*(ROOT / "walkers").rglob("*.py"), *(ROOT / "studies").rglob("*.py")]):
        module = ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        homes = ("", f"{module}.", f"{module.rpartition('.')[0]}.", "builtins.", *_ERRORS)
        nodes = [*ast.walk(ast.parse(file.read_text("utf-8")))]
        code = {
            getattr(node, field, None) for node in nodes for field in ("id", "attr", "arg", "name")
        }
        texts = [
            node.value.value
            for node in nodes
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        ]
        for name in (name for text in texts for name in _NAME.findall(str(text))):
            count += 1
            if not ({*name.split(".")} <= code or any(is_there(f"{home}{name}") for home in homes)):
                wrong.append(f"{file.relative_to(ROOT)}: {name}")
    assert count > 300
    assert not wrong


def test_names_of_the_package_on_pages_and_in_templates_are_there() -> None:
    places = {
        ROOT: (
            "README.md",
            "CONTRIBUTING.md",
            "walkers/**/*.j2",
            "studies/**/*.j2",
            "studies/*.md",
        ),
        DOCS: ("**/*.md", "**/*.rst"),
    }
    files = [
        file for folder, kinds in places.items() for kind in kinds for file in folder.glob(kind)
    ]
    found = {
        (file, name) for file in files for name in _OF_PACKAGE.findall(file.read_text("utf-8"))
    }
    named = {(file, name) for file, name in found if name.split(".")[1] not in _FILES}
    assert len(named) > 10
    assert not sorted(
        f"{file.relative_to(ROOT)}: {name}" for file, name in named if not is_there(name)
    )


def test_no_picture_or_table_is_of_other_parameters_than_todays() -> None:
    """If this fails, run ``make docs-pictures``."""
    assert stale(DOCS) == {}


@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if "<!--fact " in prose(page) or "<!--output-->" in prose(page)],
    ids=lambda page: page.name,
)
def test_numbers_and_outputs_on_pages_are_todays(
    page: Path, once: Callable[[str, Callable[[Path], object]], Path]
) -> None:
    def printed(command: str) -> str:
        def print_it(folder: Path) -> None:
            (folder / "printed.txt").write_text(
                output_of(command, folder / "runs"), encoding="utf-8"
            )

        # Several pages show the same command.
        return (
            once(f"output-{sha256(command.encode()).hexdigest()[:12]}", print_it) / "printed.txt"
        ).read_text()

    text = page.read_text("utf-8")
    assert without_hashes(refreshed(text, facts(DOCS), printed)) == without_hashes(text)


@pytest.mark.parametrize(
    "module", ["walkers.api", "walkers.inputs.reading", "walkers.postprocess.measure.motion"]
)
def test_examples_give_what_they_say(
    module: str, runs_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder of the tests (``tmp``), with what a user would have imported."""
    if (
        module == "walkers.api"
    ):  # its sweep is there for its table: Fig. 4b would take all of 60 cycles
        monkeypatch.setattr("walkers.inputs.resolving.length._MOST_CYCLES", 12)
    failed, tried = doctest.testmod(
        import_module(module), extraglobs={"tmp": runs_folder, "walkers": walkers}
    )
    assert tried
    assert not failed


@pytest.mark.parametrize("name", generated.PAGES)
def test_generated_pages_of_the_reference_are_todays(name: str) -> None:
    """If this fails, run ``python -m docs._ext.generated``."""
    assert (generated.FOLDER / f"{name}.md").read_text("utf-8") == generated.PAGES[name]()


def test_the_page_of_the_comparison_is_of_todays_template() -> None:
    """Its sentences say when a fact agrees: `walkers.calibration.observations.Observation.agrees`."""
    page = DOCS / "figures" / "comparison.md"
    compared = read_json(page.with_suffix(".json"))
    assert page.read_text("utf-8") == rendered("studies.paper", "comparison.md.j2", compared)


def test_the_table_of_performance_is_the_benchmarks() -> None:
    """`make bench` keeps the ratios."""
    page = (DOCS / "explanation" / "performance.md").read_text("utf-8")
    told = [float(number) for number in re.findall(r"beads \| ([\d.]+) \|", page)]
    ratios = [
        deck["minimal"] for deck in read_json(ROOT / "tests" / "benchmark_ratios.json").values()
    ]
    assert told == pytest.approx(ratios, abs=0.06)


def test_the_first_velocity_stands_beside_the_curve_of_the_paper() -> None:
    text = " ".join((ROOT / "README.md").read_text("utf-8").split())
    velocity = float(re.search(r"velocity along the heading +([\d.]+) mm/s", text)[1])
    curve = 1e3 * predicted_column([load_case("fig1b")], "velocity")[0][PAPER_FIT][0]
    assert f"{100.0 * (velocity / curve - 1.0):.0f} % above the curve" in text
    assert f"({curve:.2f} mm/s at this drive, no measured point)" in text


def test_symbols_of_clusters_are_filled_by_how_many_stay_upright() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.errorbar([0.0, 1.0, 2.0], [3.0, 4.0, 5.0], marker="o", ls="none")
    mark_upright(figure, pd.DataFrame({"upright": [6, 1, 0], "walkers": 6}))
    shown = {line.get_label(): line for line in axes.lines if line.get_marker() == "o"}
    assert {label: line.get_fillstyle() for label, line in shown.items()} == {
        "all upright": "full",
        "some upright": "left",
        "none upright": "none",
    }
    assert [list(line.get_ydata()) for line in shown.values()] == [[3.0], [4.0], [5.0]]


@pytest.mark.parametrize(
    "path", sorted((DOCS / "examples").glob("*.py")), ids=lambda path: path.stem
)
def test_examples_of_the_gallery_use_public_names_alone(path: Path) -> None:
    """Laws of bridges, in texts that an example writes, are not looked at; the site's build runs each example."""
    tree = ast.parse(path.read_text("utf-8"))
    imported = [one.module for one in ast.walk(tree) if isinstance(one, ast.ImportFrom)]
    imported += [
        name.name for one in ast.walk(tree) if isinstance(one, ast.Import) for name in one.names
    ]
    assert {name for name in imported if name and name.split(".")[0] == "walkers"} == {"walkers"}
    used = [
        one
        for one in ast.walk(tree)
        if isinstance(one, ast.Attribute) and isinstance(one.value, ast.Name)
    ]
    assert {one.attr for one in used if one.value.id == "walkers"} <= set(walkers.__all__)
