"""The page of all studies, and what becomes of a chapter that cannot be made. Each study has tests of its own."""

from pathlib import Path

import pytest

from tests.conftest import call
from walkers.check import bridges
from walkers.check.validate import CHAPTERS, PAGE, Chapter, validate
from walkers.runner.failures import EngineFailure


def test_a_quick_chapter_has_a_page_of_its_own(in_folder: Path) -> None:
    done = call("validate", "benchmarks", "--quick", "-j", "1", check=True)
    page = Path("runs/validation/validation-quick-benchmarks.md")
    assert str(page) in done.stdout
    assert "## Published benchmarks of impacts" in page.read_text()
    assert (page.parent / "figures" / "validation-benchmarks.png").exists()
    assert not (page.parent / PAGE).exists()


def test_a_chapter_that_cannot_be_made_leaves_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(out: Path, *, quick: bool = False) -> Chapter:
        raise EngineFailure("no engine here")

    monkeypatch.setattr(bridges, "chapter", fail)
    made = validate(tmp_path, tmp_path, only=("bridges", "benchmarks"), quick=True)
    assert made.failed == ["bridges: could not be made: no engine here"]
    page = made.files[0].read_text()
    assert "no engine here" in page
    assert "## Published benchmarks of impacts" in page


def test_docs_have_all_chapters() -> None:
    page = (Path(__file__).parent.parent / "docs" / "explanation" / PAGE).read_text()
    assert page.count("\n## ") == len(CHAPTERS)
    assert "Not as expected" not in page


def test_an_unknown_chapter_is_told() -> None:
    done = call("validate", "benchmark")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "did you mean" in done.stderr
