"""What the documentation shows follows today's parameters: pictures, tables, outputs, numbers in sentences."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

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
from walkers.inputs import load_case
from walkers.runner.files import read_json, write_json

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = [page for page in pages_of(DOCS) if outputs_in(page)]


def test_no_picture_or_table_is_of_other_parameters_than_todays() -> None:
    """If this fails, run ``make docs-pictures``."""
    assert stale(DOCS) == []


def test_a_picture_of_another_case_is_stale(tmp_path: Path) -> None:
    record = read_json(DOCS / RECORD)
    (tmp_path / RECORD).parent.mkdir()
    write_json(tmp_path / RECORD, {**record, "pictures/walker.png": digest([load_case("fig1b", {"run.cycles": 59})])})
    for file in record:
        place = tmp_path / file
        place.parent.mkdir(parents=True, exist_ok=True)
        place.touch()
    (tmp_path / "figures" / "fig4.png").unlink()
    assert sorted(stale(tmp_path)) == [
        "figures/fig4.png",
        "pictures/walker.png",
    ]


def test_every_picture_of_the_pages_is_made_by_the_command() -> None:
    pictures = {
        file.relative_to(DOCS).as_posix() for kind in ("figures", "pictures") for file in (DOCS / kind).iterdir()
    }
    made = {file for one in ILLUSTRATIONS.values() for file in one.files}
    beside = {RECORD.as_posix(), "figures/calibration.md"}  # made with the pictures of the calibration
    assert pictures - beside == {file for file in made if not file.startswith(("explanation", "tutorial"))}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_outputs_on_pages_are_todays(page: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> None:
    for command, text in outputs_in(page).items():

        def print_it(folder: Path, command: str = command) -> None:
            (folder / "printed.txt").write_text(output_of(command, folder / "runs"), encoding="utf-8")

        # Several pages show the same command.
        printed = once(f"output-{sha256(command.encode()).hexdigest()[:12]}", print_it) / "printed.txt"
        assert text == without_hashes(printed.read_text("utf-8")), command


def test_numbers_in_sentences_are_the_comparisons() -> None:
    known = facts(DOCS)
    quoted = [(page.name, name, text) for page in pages_of(DOCS) for name, text in facts_in(page)]
    assert len(quoted) >= 5
    assert [(page, name, known[name]) for page, name, _ in quoted] == quoted


def test_pages_are_written_anew(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "Walks at <!--fact fig4b_velocity-->9.99<!--/fact--> mm/s.\n\n<!--output-->\n```console\n"
        "$ walkers theory fig1b\nsomething old\n```\n\n```console\n$ walkers show fig1b\n...\n```\n"
    )
    other = shutil.copy(DOCS / "index.md", tmp_path)
    assert refresh_pages([page, Path(other)], facts(DOCS), tmp_path) == [page]
    text = page.read_text()
    assert f"<!--fact fig4b_velocity-->{facts(DOCS)['fig4b_velocity']}<!--/fact--> mm/s" in text
    assert "something old" not in text
    assert "Coulomb friction and drag" in text
    assert "$ walkers show fig1b\n...\n" in text  # not marked
