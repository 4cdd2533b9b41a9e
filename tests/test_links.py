"""What README and docs/ point at is there: pages, their headings, pictures, files of the project."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
WRITTEN_BY_THE_BUILD = ("docs/gallery", "docs/reference/api", "docs/reference/generated")
_FENCE = re.compile(r"^(\s*)(```+|~~~+).*?^\1\2\s*$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"`[^`\n]*`")
_LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?[^)]*\)|<img[^>]*\ssrc=\"([^\"]+)\"")
_HEADING = re.compile(r"^#{1,6}\s+(.+?)\s*#*$", re.MULTILINE)


def pages() -> list[Path]:
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in found if not page.relative_to(ROOT).as_posix().startswith(WRITTEN_BY_THE_BUILD)]


def prose(page: Path) -> str:
    return _FENCE.sub("", page.read_text("utf-8"))


@cache
def anchors(page: Path) -> set[str]:
    """As GitHub and myst make them of headings: lower case, hyphens for blanks, no punctuation."""
    titles = (re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", title) for title in _HEADING.findall(prose(page)))
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_somewhere(page: Path) -> None:
    missing = []
    for groups in _LINK.findall(_CODE.sub("", prose(page))):
        link = groups[0] or groups[1]
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            missing.append(link)
    assert not missing


def test_pages_named_in_the_code_are_there() -> None:
    """Comments and messages say ``docs/….md``: of pages that have been moved they would not."""
    files = [file for suffix in ("py", "toml", "j2") for file in (ROOT / "walkers").rglob(f"*.{suffix}")]
    named = {name for file in files for name in re.findall(r"\bdocs/[\w/-]+\.md", file.read_text("utf-8"))}
    assert named
    assert not {name for name in named if not (ROOT / name).is_file()}
