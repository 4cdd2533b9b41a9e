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


def formulas_of_pages() -> dict[str, str]:
    """The formulas that stand by themselves on the pages, by page and number."""
    formulas = {}
    for page in pages_of(DOCS):
        for number, formula in enumerate(BLOCK.findall(page.read_text("utf-8"))):
            formulas[f"{page.stem}-{number}"] = formula
    return formulas


FORMULAS = formulas_of_pages()
Measure = Callable[[str], dict[str, float]]


@pytest.fixture(scope="module")
def measure(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Measure]:
    """Lay out a formula, given as MathML, in a browser and measure it.

    The numbers are in pixels: the width that it ``needs``, the width that its box ``has``, and its
    ``left`` edge in the box.
    """
    from playwright.sync_api import sync_playwright

    folder = tmp_path_factory.mktemp("formulas")
    styles = (DOCS / "_static" / "walkers.css").read_text("utf-8")
    flags = ["--no-sandbox", "--no-first-run", "--disable-background-networking"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 600})

        def measure_formula(mathml: str) -> dict[str, float]:
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
                    const edge = box.getBoundingClientRect().left;
                    const left = formula.getBoundingClientRect().left - edge;
                    return {needs: box.scrollWidth, has: box.clientWidth, left};
                }"""
            )
            return numbers

        yield measure_formula
        browser.close()


def test_a_formula_that_is_too_wide_shows_its_beginning(measure: Measure) -> None:
    """A sum of 81 terms; what does not fit must be on its right."""
    terms = "<mi>a</mi><mo>+</mo>" * 80 + "<mi>b</mi>"
    pixels = measure(f"<math display='block'>{terms}</math>")
    assert pixels["needs"] > pixels["has"]
    assert pixels["left"] >= 0.0


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS.keys())
def test_formulas_fit_into_a_page_at_1280_pixels(formula: str, measure: Measure) -> None:
    """The packages of `make docs` convert the formulas to MathML."""
    reason = "the formulas are converted by the packages of `make docs`"
    pytest.importorskip("sphinx", reason=reason)
    from docutils import nodes

    from docs._ext import mathml

    pixels = measure(mathml._mathml(nodes.math_block(formula, formula), block=True))
    assert pixels["needs"] <= pixels["has"]
