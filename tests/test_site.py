"""The site in a browser: formulas, header and start page on screens of usual width."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
TEXT_WIDTH = 624
"""Width of the text of a page in a window of 1280 pixels, as the theme lays it out."""
THEME = (
    "div.math { align-items: center; display: flex; flex-direction: row-reverse; max-width: 100%; }"
)
"""What pydata-sphinx-theme says about formulas, before our own style sheet."""
EXTENSIONS = (
    "numpydoc",
    "sphinx.ext.autodoc",
    "myst_parser",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinxcontrib.bibtex",
    "mathml",
)
"""Extensions of the site, without the one that runs the examples of the gallery for minutes."""
WIDTHS = (1280, 390)
"""Widths of a window, in pixels: a small laptop and a phone."""

_FORMULAS = """() => Array.from(document.querySelectorAll("div.math"), box => ({
    text: box.textContent.replace(/\\s+/g, " "),
    needs: box.scrollWidth,
    has: box.clientWidth,
}))"""
"""The text of each formula, the width that it needs and the width of its box, in pixels."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import sync_playwright

    flags = ["--no-sandbox", "--no-first-run", "--disable-background-networking"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; the pages of its gallery are empty."""
    pytest.importorskip("sphinx", reason="sites are built by the packages of `make docs`")
    source = tmp_path_factory.mktemp("source")
    shutil.copytree(DOCS, source / "docs", ignore=shutil.ignore_patterns("gallery", "examples"))
    (source / "studies").mkdir()
    for name in ("CHANGELOG.md", "CONTRIBUTING.md", "studies/article.md"):
        shutil.copy(ROOT / name, source / name)
    gallery = source / "docs" / "gallery"
    gallery.mkdir()
    (gallery / "index.md").write_text("# Gallery\n\n```{toctree}\n04_sweep\n```\n", "utf-8")
    (gallery / "04_sweep.md").write_text("# Sweep\n", "utf-8")
    pages = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    command += ["-c", str(DOCS), "-D", f"extensions={','.join(EXTENSIONS)}"]
    subprocess.run([*command, str(source / "docs"), str(pages)], check=True)
    return pages


def opened(browser: Browser, path: Path, width: int) -> Page:
    """A page in a window of this width, in pixels, once its fonts are loaded."""
    page = browser.new_page(viewport={"width": width, "height": 1000})
    page.goto(path.as_uri())
    page.evaluate("document.fonts.ready")
    return page


def test_a_formula_that_is_too_wide_shows_its_beginning(browser: Browser, tmp_path: Path) -> None:
    """A sum of 81 terms; what does not fit must be on its right."""
    terms = "<mi>a</mi><mo>+</mo>" * 80 + "<mi>b</mi>"
    formula = f"<div class='math'><math display='block'>{terms}</math></div>"
    styles = (DOCS / "_static" / "walkers.css").read_text("utf-8")
    path = tmp_path / "formula.html"
    path.write_text(
        f'<!doctype html><meta charset="utf-8"><style>{THEME}\n{styles}</style>'
        f'<div style="width: {TEXT_WIDTH}px">{formula}</div>',
        encoding="utf-8",
    )
    page = opened(browser, path, 1280)
    (pixels,) = page.evaluate(_FORMULAS)
    assert pixels["needs"] > pixels["has"]
    box = page.locator("div.math").bounding_box()
    start = page.locator("math").bounding_box()
    assert box is not None
    assert start is not None
    assert start["x"] >= box["x"]


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_no_formula_of_the_site_is_cut(site: Path, browser: Browser, width: int) -> None:
    cut: list[str] = []
    number = 0
    for path in sorted(site.rglob("*.html")):
        if '<div class="math' not in path.read_text("utf-8"):
            continue
        page = opened(browser, path, width)
        formulas: list[dict[str, Any]] = page.evaluate(_FORMULAS)
        number += len(formulas)
        for formula in formulas:
            if formula["needs"] > formula["has"]:
                cut.append(f"{path.relative_to(site)}: {formula}")
        page.close()
    assert number > 30
    assert cut == []


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_no_page_is_wider_than_the_window(site: Path, browser: Browser, width: int) -> None:
    wide = []
    for name in (
        "index",
        "tutorial",
        "explanation/others",
        "explanation/friction",
        "reference/runs",
    ):
        page = opened(browser, site / f"{name}.html", width)
        needs = page.evaluate("document.documentElement.scrollWidth")
        page.close()
        if needs > width:
            wide.append(f"{name}: {needs}")
    assert wide == []


@pytest.mark.slow
def test_the_header_is_one_line(site: Path, browser: Browser) -> None:
    """All of its links and the search have a common middle, in a window of 1280 pixels."""
    page = opened(browser, site / "index.html", 1280)
    middles = page.evaluate(
        """() => Array.from(
            document.querySelectorAll(".bd-header .nav-item, .bd-header .search-button__button"),
            item => item.getBoundingClientRect(),
        ).filter(box => box.width > 0).map(box => Math.round((box.top + box.bottom) / 2))"""
    )
    assert len(middles) >= 7
    assert max(middles) - min(middles) <= 3


@pytest.mark.slow
def test_the_film_of_the_start_page_is_shown_in_full_size(site: Path, browser: Browser) -> None:
    page = opened(browser, site / "index.html", 1280)
    film = page.locator("video").bounding_box()
    assert film is not None
    assert (film["width"], film["height"]) == (960, 400)


@pytest.mark.slow
def test_each_page_of_the_site_is_reached_from_the_start(site: Path, browser: Browser) -> None:
    """By the links of pages that are reached, beginning with the start page."""
    reached: set[str] = set()
    waiting = ["index.html"]
    page = browser.new_page()
    while waiting:
        name = waiting.pop()
        if name in reached or not (site / name).is_file():
            continue
        reached.add(name)
        page.goto((site / name).as_uri())
        for address in page.eval_on_selector_all(
            ".bd-sidebar a, .bd-main a, footer a", "all => all.map(a => a.href)"
        ):
            path = address.partition("#")[0].removeprefix(site.as_uri() + "/")
            if path.endswith(".html"):
                waiting.append(path)
    pages = {path.relative_to(site).as_posix() for path in site.rglob("*.html")}
    pages.discard("_static/webpack-macros.html")
    made_by_sphinx = {"genindex.html", "py-modindex.html", "search.html"}
    assert pages - reached - made_by_sphinx == set()
