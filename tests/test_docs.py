"""What README and docs/ show is today's: links, pictures, outputs, numbers in sentences, examples, notebooks."""

from __future__ import annotations

import doctest
import json
import re
import shutil
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from importlib import import_module
from pathlib import Path

import nbformat
import pytest

import walkers
from docs.illustrations import (
    ILLUSTRATIONS,
    RECORD,
    digest,
    facts,
    facts_in,
    output_of,
    outputs_in,
    pages_of,
    refresh_pages,
    stale,
    without_hashes,
)
from tests.notebooks import executed, notebooks, stored, tagged
from walkers.inputs import load_case
from walkers.runner.files import read_json, write_json

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SMALL_PICTURES = "from walkers.postprocess import series; series._TALL, series._TALLEST, series._WIDEST = 250, 400, 475"
WRITTEN_BY_THE_BUILD = ("docs/gallery", "docs/reference/api", "docs/reference/generated")
PAGES = [page for page in pages_of(DOCS) if not page.relative_to(ROOT).as_posix().startswith(WRITTEN_BY_THE_BUILD)]

# --- links ------------------------------------------------------------------------------------------------------------

_FENCE = re.compile(r"^(\s*)(```+|~~~+).*?^\1\2\s*$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"`[^`\n]*`")
_LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?[^)]*\)|<img[^>]*\ssrc=\"([^\"]+)\"")
_HEADING = re.compile(r"^#{1,6}\s+(.+?)\s*#*$", re.MULTILINE)


@cache
def prose(page: Path) -> str:
    return _FENCE.sub("", page.read_text("utf-8"))


@cache
def anchors(page: Path) -> set[str]:
    """As GitHub and myst make them of headings: lower case, hyphens for blanks, no punctuation."""
    titles = (re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", title) for title in _HEADING.findall(prose(page)))
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    missing = []
    for link in (groups[0] or groups[1] for groups in _LINK.findall(_CODE.sub("", prose(page)))):
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        known = re.match(r"[a-z]+:", link) or (target.exists() and (not anchor or anchor in anchors(target)))
        missing += [] if known else [link]
    assert not missing


def test_pages_named_in_the_code_are_there() -> None:
    """Comments and messages say ``docs/….md``: of pages that have been moved they would not."""
    files = [file for suffix in ("py", "toml", "j2") for file in (ROOT / "walkers").rglob(f"*.{suffix}")]
    named = {name for file in files for name in re.findall(r"\bdocs/[\w/-]+\.md", file.read_text("utf-8"))}
    assert named
    assert not {name for name in named if not (ROOT / name).is_file()}


# --- pictures, outputs, numbers ---------------------------------------------------------------------------------------


def test_no_picture_or_table_is_of_other_parameters_than_todays() -> None:
    """If this fails, run ``make docs-pictures``."""
    assert stale(DOCS) == {}


def test_a_picture_of_another_case_is_stale(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("docs.illustrations.ILLUSTRATIONS", {one: ILLUSTRATIONS[one] for one in ("walker", "fig4")})
    record = read_json(DOCS / RECORD)
    other = {"pictures/walker.png": digest([load_case("fig1b", {"run.cycles": 59})])}
    for file in record:
        place = tmp_path / file
        place.parent.mkdir(parents=True, exist_ok=True)
        place.touch()
    write_json(tmp_path / RECORD, {**record, **other})
    (tmp_path / "figures" / "fig4.png").unlink()
    assert stale(tmp_path) == {"walker": ["pictures/walker.png"], "fig4": ["figures/fig4.png"]}


@pytest.mark.parametrize("page", [page for page in PAGES if outputs_in(page)], ids=lambda page: page.name)
def test_outputs_on_pages_are_todays(page: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> None:
    for command, text in outputs_in(page).items():

        def print_it(folder: Path, command: str = command) -> None:
            (folder / "printed.txt").write_text(output_of(command, folder / "runs"), encoding="utf-8")

        # Several pages show the same command.
        printed = once(f"output-{sha256(command.encode()).hexdigest()[:12]}", print_it) / "printed.txt"
        assert text == without_hashes(printed.read_text("utf-8")), command


def test_numbers_in_sentences_are_the_comparisons() -> None:
    known = facts(DOCS)
    quoted = [(page.name, name, text) for page in PAGES for name, text in facts_in(page)]
    assert len(quoted) >= 5
    assert [(page, name, known[name]) for page, name, _ in quoted] == quoted


def test_pages_are_written_anew(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "Walks at <!--fact fig4b_velocity-->9.99<!--/fact--> mm/s.\n\n<!--output-->\n```console\n"
        "$ walkers list\nsomething old\n```\n\n```console\n$ walkers show --theory fig1b\n...\n```\n"
    )
    other = shutil.copy(DOCS / "index.md", tmp_path)
    assert refresh_pages([page, Path(other)], facts(DOCS), tmp_path) == [page]
    text = page.read_text()
    assert f"<!--fact fig4b_velocity-->{facts(DOCS)['fig4b_velocity']}<!--/fact--> mm/s" in text
    assert "something old" not in text
    assert "0 runs, 0 B\n" in text
    assert "$ walkers show --theory fig1b\n...\n" in text  # not marked


# --- examples and notebooks -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "module", ["walkers.pipeline", "walkers.handles", "walkers.inputs.reading", "walkers.postprocess.motion"]
)
def test_examples_give_what_they_say(module: str, runs_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder of the tests (``tmp``), with what a user would have imported."""
    if module == "pipeline":  # its sweep is there for its table: Fig. 4b would take all of 60 cycles
        monkeypatch.setattr("walkers.inputs.run_tables._MOST_CYCLES", 12)
    failed, tried = doctest.testmod(
        import_module(f"walkers.{module}"), extraglobs={"tmp": runs_folder, "walkers": walkers}
    )
    assert tried
    assert not failed


@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_a_notebook_gives_what_it_gave(path: Path, tmp_path: Path) -> None:
    """Executed anew, without an error. Speeds: to 0.1 %, as other machines round otherwise, or 0.01 mm/s."""
    now, before = executed(path, tmp_path, SMALL_PICTURES), nbformat.read(path, as_version=4)
    assert tagged(now, "velocity") == pytest.approx(tagged(before, "velocity"), rel=1e-3, abs=1e-5)
    kinds = [[output["output_type"] for output in cell.get("outputs", [])] for cell in stored(now).cells]
    assert kinds == [[output["output_type"] for output in cell.get("outputs", [])] for cell in before.cells]
    # Progress is shown while the engine runs, and a line is left of it.
    assert re.search(r"(fig1b|fig3\S*): done", json.dumps(now.cells[1]))


def test_stored_notebooks_are_small_and_of_no_machine() -> None:
    for path in notebooks():
        text = path.read_text("utf-8")
        assert len(text) < 1_000_000
        words = re.sub(r"[A-Za-z0-9+/=\\n]{200,}", "", text)  # pictures
        assert not re.search(r"(?<![\w.)\]])/(tmp|home|root|work|usr|var)/", words)
        assert all(cell.get("execution_count") for cell in json.loads(text)["cells"] if cell["cell_type"] == "code")
