"""Formulas of the site on screens of usual width, in a browser."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from docs.illustrations import pages_of

DOCS = Path(__file__).resolve().parents[1] / "docs"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
TEXT_WIDTH = 624
"""Width of the text of a page in a window of 1280 pixels, as the theme lays it out."""
THEME = (
    "div.math { align-items: center; display: flex; flex-direction: row-reverse; max-width: 100%; }"
)
"""What pydata-sphinx-theme says about formulas, before our own style sheet."""
BLOCK = re.compile(r"^\$\$\n(.+?)\n\$\$$", re.MULTILINE | re.DOTALL)
FORMULAS = {
    f"{page.stem}-{number}": formula
    for page in pages_of(DOCS)
    for number, formula in enumerate(BLOCK.findall(page.read_text("utf-8")))
}

Measure = Callable[[str], dict[str, float]]


@pytest.fixture(scope="module")
def measure(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Measure]:
    """Lay a formula out as MathML; give the widths of it and its box, and where it starts, in pixels."""
    from playwright.sync_api import sync_playwright

    folder = tmp_path_factory.mktemp("formulas")
    styles = (DOCS / "_static" / "walkers.css").read_text("utf-8")
    flags = ["--no-sandbox", "--no-first-run", "--disable-background-networking"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 600})

        def measured(mathml: str) -> dict[str, float]:
            body = f'<div style="width: {TEXT_WIDTH}px"><div class="math">{mathml}</div></div>'
            path = folder / "formula.html"
            path.write_text(
                f'<!doctype html><meta charset="utf-8"><style>{THEME}\n{styles}</style>{body}',
                encoding="utf-8",
            )
            page.goto(path.as_uri())
            numbers: dict[str, float] = page.evaluate(
                """() => {
                    const box = document.querySelector("div.math");
                    const formula = box.firstElementChild;
                    const left = formula.getBoundingClientRect().left - box.getBoundingClientRect().left;
                    return {needs: box.scrollWidth, has: box.clientWidth, left};
                }"""
            )
            return numbers

        yield measured
        browser.close()


def test_a_formula_that_is_too_wide_shows_its_beginning(measure: Measure) -> None:
    wide = "<math display='block'>" + "<mi>a</mi><mo>+</mo>" * 80 + "<mi>b</mi></math>"
    laid_out = measure(wide)
    assert laid_out["needs"] > laid_out["has"]
    assert laid_out["left"] >= 0.0


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS.keys())
def test_formulas_fit_into_a_page_at_1280_pixels(formula: str, measure: Measure) -> None:
    """With the packages of `make docs`, whose converter makes MathML of the formulas."""
    pytest.importorskip(
        "sphinx", reason="the formulas are converted by the packages of `make docs`"
    )
    from docutils import nodes

    from docs._ext import mathml

    laid_out = measure(mathml._mathml(nodes.math_block(formula, formula), block=True))
    assert laid_out["needs"] <= laid_out["has"]
