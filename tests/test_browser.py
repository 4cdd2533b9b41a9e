"""Reports in a browser, without a network: they play, pause and turn, and say nothing to the console.

Debian's Chromium, which ``make test`` installs, driven by Playwright. WebGL is computed by the processor
(SwiftShader), which is slow: windows are small and patience is long.
"""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests.conftest import PATIENCE, wait_for
from tests.test_report import HOSTILE, pile_report, swept, swept_report, walked_report, walked_run

__all__ = ["pile_report", "swept", "swept_report", "walked_report", "walked_run"]  # fixtures

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MILLISECONDS = 1e3 * PATIENCE
_FLAGS = [
    *("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=_FLAGS, timeout=MILLISECONDS)
        expect.set_options(timeout=MILLISECONDS)
        yield started
        started.close()


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file; what it asked a network for, and what it complained of, is looked at in the end."""
    context = browser.new_context(offline=True, viewport={"width": 480, "height": 420})
    context.set_default_timeout(MILLISECONDS)
    asked: list[str] = []
    complaints: list[str] = []

    def opened(path: Path, *, ready: bool = True) -> Page:
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda said: complaints.append(said.text) if said.type in {"error", "warning"} else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(path.as_uri())
        if ready:
            page.wait_for_selector("body[data-ready]")
        return page

    yield opened
    context.close()
    assert {url.partition("//")[0] for url in asked if not url.startswith(("blob:", "data:"))} == {"file:"}, asked
    assert all(url.endswith("report.html") for url in asked if url.startswith("file:"))
    # What the software renderer says of itself is not the page's.
    assert not [one for one in complaints if "GPU stall" not in one and "swiftshader" not in one.lower()], complaints


def picture(page: Page) -> bytes:
    return page.locator(".scene:visible canvas").first.screenshot()


def rested(page: Page, *others: bytes) -> bytes:
    """The picture as soon as it is none of others and frames change it no more."""

    def same() -> bytes | None:
        before = picture(page)
        # Playwright asks once a frame: eight of them, however long they take.
        page.wait_for_function("() => (window.drawn = (window.drawn ?? 0) + 1) % 8 === 0")
        return before if before not in others and picture(page) == before else None

    return wait_for(same)


@pytest.mark.parametrize(("name", "figures"), [("walked_report", ("walk", "gait")), ("pile_report", ("climb",))])
def test_beads_play_pause_and_turn(
    name: str, figures: tuple[str, ...], visit: Callable[..., Page], request: pytest.FixtureRequest
) -> None:
    page = visit(request.getfixturevalue(name))
    page.wait_for_selector(".scene[data-ready]")
    play, time = page.locator(".play"), page.locator(".time")
    begin = rested(page)
    assert (play.text_content(), time.text_content()) == ("Play", "0.0000 s")
    play.click()
    expect(play).to_have_text("Pause")
    wait_for(lambda: picture(page) != begin and time.text_content() != "0.0000 s")
    play.click()
    expect(play).to_have_text("Play")
    paused, stopped = rested(page, begin), time.text_content()
    box = page.locator(".scene").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 30, steps=4)
    page.mouse.up()
    turned = rested(page, begin, paused)
    assert time.text_content() == stopped != "0.0000 s"  # turned, not played
    page.get_by_role("button", name="onto the floor").click()
    rested(page, begin, paused, turned)
    assert page.locator(".slower option:checked").count() == 1
    assert page.locator("figure svg:visible").count() == len(figures)


@pytest.mark.parametrize("name", ["walked_report", "pile_report", "swept_report"])
def test_no_text_of_a_figure_is_cut(name: str, visit: Callable[..., Page], request: pytest.FixtureRequest) -> None:
    """With the fonts of this machine."""
    page = visit(request.getfixturevalue(name), ready=name != "swept_report")
    beyond = """[...document.querySelectorAll("figure svg")].flatMap((svg) => {
      const whole = svg.getBoundingClientRect();
      const out = (box) => box.left < whole.left - 1 || box.right > whole.right + 1 || box.top < whole.top - 1
        || box.bottom > whole.bottom + 1;
      const texts = [...svg.querySelectorAll("text")], cut = texts.filter((one) => out(one.getBoundingClientRect()));
      return [texts.length > 5, ...cut.map((one) => one.textContent)];
    })"""
    found = page.evaluate(beyond)
    assert found and set(found) == {True}


def test_tables_need_no_script(walked_report: Path, browser: Browser) -> None:
    context = browser.new_context(offline=True, java_script_enabled=False)
    page = context.new_page()
    page.goto(walked_report.as_uri(), timeout=MILLISECONDS)
    assert page.locator("table.result tr:visible").count() > 10
    assert page.locator("table.parameters tr:visible").count() > 20
    assert page.title() == HOSTILE
    context.close()


def test_a_sweeps_points_open_the_reports_of_their_runs(swept_report: Path, visit: Callable[..., Page]) -> None:
    page = visit(swept_report, ready=False)
    assert page.evaluate("window.hostile") is None
    assert page.locator("h1").text_content() == HOSTILE
    page.set_viewport_size({"width": 1000, "height": 420})
    assert (
        page.evaluate("(({scrollWidth, clientWidth}) => scrollWidth - clientWidth)(document.querySelector('.wide'))")
        == 0
    )
    page.locator("table.sweep a").click()
    page.wait_for_selector(".scene[data-ready]")
