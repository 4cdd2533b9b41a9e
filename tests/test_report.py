"""Reports: the file says what the result says, a user's words are words, and a browser without a network plays it.

Debian's Chromium, which ``make test`` installs, driven by Playwright. WebGL is computed by the processor
(SwiftShader), which is slow: windows are small and patience is long.
"""

from __future__ import annotations

import base64
import html
import re
import shutil
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from math import nan, pi
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

import walkers
from tests.conftest import PATIENCE, document, make_case, to_toml, wait_for
from walkers.inputs.sweep import expand
from walkers.postprocess.measure.caption import caption
from walkers.postprocess.measure.motion import read_bridges, read_motion
from walkers.postprocess.measure.numbers import number_text, rows
from walkers.postprocess.measure.results import not_computed, read_results
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.figures import figures_of
from walkers.postprocess.show.report.page import LARGEST_REPORT, svg_of
from walkers.postprocess.show.report.player import camera_of, player_of
from walkers.postprocess.show.report.run import report_run
from walkers.postprocess.show.scene import gathered
from walkers.rounding import rounded
from walkers.sweeps.scheduler import SweepOptions, run_sweep
from walkers.sweeps.table import load_table

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

Once = Callable[[str, Callable[[Path], object]], Path]
HOSTILE = "<script>window.hostile = true</script> \" ' </title> & {{ 7 * 7 }}"


class Report:
    """A page: its words, the attributes of its tags, its scripts, and the data that it carries."""

    def __init__(self, path: Path) -> None:
        self.text = path.read_text("utf-8")
        self.carried = dict(
            re.findall(r'<script type="text/plain" id="([^"]+)">([^<]+)</script>', self.text)
        )
        self.scripts = re.findall(r"<script\b[^>]*>(.*?)</script>", self.text, re.DOTALL)
        bare = re.sub(r"(<(script|style)\b[^>]*>).*?</\2>", r"\1", self.text, flags=re.DOTALL)
        self.title = html.unescape("".join(re.findall(r"<title>(.*?)</title>", bare, re.DOTALL)))
        self.references = re.findall(
            r"""\s(?:src|href|srcset|action|data)\s*=\s*["']?([^"'\s>]+)""", bare
        )
        self.words = html.unescape(
            re.sub(r"<title\b.*?</title>|<[^>]*>", "", bare, flags=re.DOTALL)
        )


@pytest.fixture(scope="session")
def walked_run(run_directory: Callable[..., Path]) -> Path:
    """A run of two walkers, whose case calls itself something hostile."""
    settings = {"cycles": 9, "settling_cycles": 2, "samples_per_cycle": 20}  # no other test's run
    return run_directory(dimers={"replicates": 2}, run=settings, title=HOSTILE)


@pytest.fixture(scope="session")
def walked_report(walked_run: Path, once: Once) -> Path:
    return (
        once("walked-report", lambda folder: report_run(walked_run, folder / "report.html"))
        / "report.html"
    )


@pytest.fixture(scope="session")
def pile_report(pile_run: Path, once: Once) -> Path:
    """Asked for by the run's name in the folder of the runs."""
    place = once(
        "pile-report",
        lambda to: walkers.load(pile_run.name, pile_run.parent).report(to / "report.html"),
    )
    return place / "report.html"


@pytest.fixture(scope="session")
def swept(once: Once) -> Path:
    """A sweep of two points; the second of its runs has a report."""

    def make(out: Path) -> None:
        (out / "base.toml").write_text(to_toml(document(run={"cycles": 6, "settling_cycles": 2})))
        given = {
            "title": HOSTILE,
            "case": "base.toml",
            "axes": {"drive.frequency": ["60 Hz", "70 Hz"]},
        }
        run_sweep(expand(given, source="two", name="two", folder=out), out, SweepOptions(2))
        sweep = walkers.load("two", out)
        sweep.runs[1].report()
        sweep.report()

    return once("swept", make) / "two"


@pytest.fixture(scope="session")
def swept_report(swept: Path) -> Path:
    return swept / "report.html"


@pytest.mark.parametrize("name", ["walked", "pile"])
def test_numbers_of_a_report_are_the_results_with_what_is_not_computed_and_parameters_say_whence(
    name: str, request: pytest.FixtureRequest
) -> None:
    path, directory = (request.getfixturevalue(f"{name}_{what}") for what in ("report", "run"))
    page, results = Report(path), read_results(directory)
    assert all(f"{row.label}{row.text}{row.unit}{row.error}" in page.words for row in rows(results))
    assert f"Uncertainty not computed: {not_computed(results).text}." in page.words
    assert path.stat().st_size < LARGEST_REPORT
    origins = walkers.load(directory).case.origins
    for said in (
        "given",
        "library",
        *(told for one in origins for told in (one.key, one.text, one.word)),
    ):
        assert said in page.words


@pytest.mark.parametrize("name", ["walked_report", "pile_report", "swept_report"])
def test_a_report_refers_to_nothing_outside_and_a_users_words_are_words(
    name: str, request: pytest.FixtureRequest
) -> None:
    path = request.getfixturevalue(name)
    page = Report(path)
    link = re.compile(r"\.\./[\w-]+/report\.html" if name == "swept_report" else r"#|data:")
    assert all(link.match(one) for one in page.references), page.references
    for folder in {str(Path.home()), str(Path(__file__).parents[1]), str(path.parent)} - {"/"}:
        assert folder not in page.words
    if name != "swept_report":
        library = zlib.decompress(base64.b64decode(page.carried["library-k3d"])).decode()
        assert "url(fonts/" not in library.split("sourcesContent")[0]
    if name != "pile_report":
        assert page.title == HOSTILE
        assert HOSTILE in page.words
        assert not any("hostile" in script for script in page.scripts)


def test_a_sweeps_report_has_its_figure_and_table_and_links_to_the_reports_of_its_runs(
    swept: Path, swept_report: Path
) -> None:
    page, table = Report(swept_report), load_table(swept)
    assert all(
        f'<td class="number">{rounded(1e3 * one, "mm/s")}</td>' in page.text
        for one in table["velocity"]
    )
    assert page.references == [f"../{Path(table['run'][1]).name}/report.html"]
    assert (swept / page.references[0]).is_file()
    assert svg_of(walkers.load(swept).figure()) in page.text
    assert (page.carried, page.scripts) == ({}, [])


def test_the_report_of_a_sweep_of_three_keys_draws_the_values_of_the_last_alike_and_says_so(
    looked_through: Path, tmp_path: Path
) -> None:
    page = Report(walkers.load(looked_through / "three").report(tmp_path / "report.html"))
    assert "not distinguished: frequency" in page.words
    assert page.text.count("<svg") == 1
    assert page.text.count('<tr><th scope="row">') == 12


def test_a_reports_figures_are_those_that_are_plotted_and_fewer_frames_make_it_smaller(
    walked_run: Path, walked_report: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text, drawings = (
        walked_report.read_text("utf-8"),
        [svg_of(one) for one in figures_of(read_results(walked_run)).values()],
    )
    assert len(drawings) == 2
    assert all(one in text and "<metadata" not in one and "purl.org" not in one for one in drawings)
    monkeypatch.setattr(
        "walkers.postprocess.show.report.run.MOST_PLACES", 4 * 181
    )  # all at first, and then half of them
    less = report_run(
        walked_run, tmp_path / "less.html", largest=walked_report.stat().st_size - 1000
    )
    assert less.stat().st_size < walked_report.stat().st_size - 1000
    assert "frames shown" in Report(less).words


def test_the_player_shows_the_motion(walked_run: Path) -> None:
    """Each bead of the first walker is where the motion has it, turned as its spins turned it, to 0.1 µm."""
    motion, (plot, times, _) = (
        gathered(read_motion(walked_run)).driven,
        player_of(read_motion(walked_run)),
    )
    motion = motion.of_walkers(motion.walkers[:1])
    beads = [one for one in plot.objects if one.name.startswith("bead")]
    assert len(beads) == len(motion.radius) == 2
    assert times == [motion.time[0], motion.time[-1]]
    across = np.cross([0.0, 0.0, 1.0], motion.case.drive_axis)
    settled = motion.case.run.settling_cycles * motion.case.run.samples_per_cycle
    rotation = read_table(walked_run, "walkers").iloc[0]
    for number, ball in enumerate(beads):
        matrices = np.array(list(ball.model_matrix.values()), dtype=float)
        assert [float(time) for time in ball.model_matrix] == pytest.approx(motion.time, abs=1e-6)
        np.testing.assert_allclose(matrices[:, :3, 3], 1e3 * motion.position[:, number], atol=1e-4)
        turned = Rotation.from_matrix(
            matrices[[settled, -1], :3, :3] / (1e3 * motion.radius[number])
        )
        way = motion.walkers[0].facing * float((turned[1] * turned[0].inv()).as_rotvec() @ across)
        speed = way * motion.radius[number] / (motion.time[-1] - motion.time[settled])
        assert speed == pytest.approx(rotation[f"rotation_{number + 1}"], rel=0.01, abs=2e-6)
    weightless = replace(
        motion, case=motion.case.with_value_at("environment.gravity", 0.0)
    )  # is seen as the floor lies
    assert camera_of(weightless) == camera_of(motion)


def test_necks_of_the_player_are_as_wide_as_bridges_at_their_times(pile_run: Path) -> None:
    """Those of a pile rupture, and have no width then; nor have those to the wall in front, the first of y."""
    motion, (plot, _, captions) = read_motion(pile_run).driven, player_of(read_motion(pile_run))
    front = [wall.normal[1] > 0.9 for wall in motion.case.boundary.walls].index(True)
    (necks,) = (one for one in plot.objects if one.name == "bridges")
    held = {
        bridges.frame: int((bridges.contacts[:, 2] != front).sum())
        for bridges in read_bridges(motion)
    }
    assert sum(held.values()) < sum(len(bridges.contacts) for bridges in read_bridges(motion))
    points = [necks.vertices[f"{motion.time[frame]:.6f}"].reshape(-1, 80, 3) for frame in held]
    wide = [np.ptp(one[:, :16], axis=1).max(axis=1) > 0.01 for one in points]
    assert [int(each.sum()) for each in wide] == [*held.values()]
    assert any((one & ~other).any() for one, other in pairwise(wide))
    beads = next(one for one in plot.objects if one.name == "beads")
    np.testing.assert_allclose(
        beads.positions[f"{motion.time[-1]:.6f}"], 1e3 * motion.position[-1], atol=1e-3
    )
    assert any("rolling of the beads is not shown" in caption for caption in captions)


def test_words_and_numbers() -> None:
    """Numbers have four digits at most and the decimals of their unit."""
    given = [
        (1.38173201,),
        (1234.5678,),
        (-87654.3,),
        (0.0012345678,),
        (-3.2e-15, "mm/s"),
        (6,),
        (nan,),
    ]
    given += [(-0.002164, "mm/s"), (0.000414, "mm/s"), (9.9996, "mm/s")]
    expected = ["1.382", "1235", "-87650", "0.001235", "0", "6", "-", "-0.002", "0", "10"]
    assert [rounded(*one) for one in given] == expected
    texts = {
        "m": ("250", "mm"),
        "m/s": ("250.0", "mm/s"),
        "rad": ("14.32", "°"),
        "share": ("25", "%"),
    }
    assert {unit: number_text(0.25, unit) for unit in texts} == texts
    aside = (
        make_case()
        .with_value_at("boundary.tilt", pi / 3.0)
        .with_value_at("boundary.uphill", pi / 2.0)
    )
    assert caption(aside).endswith("plane tilted by 60°, up is at 90° from x toward y")


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MILLISECONDS = 1e3 * PATIENCE


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import expect, sync_playwright

    flags = [
        "--no-sandbox",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
    ]
    flags += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=CHROMIUM, args=flags, timeout=MILLISECONDS
        )
        expect.set_options(timeout=MILLISECONDS)
        yield started
        started.close()


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file; what it asked a network for, and what it complained of, is looked at in the end."""
    # A processor draws each pixel: a sixteenth of them.
    context = browser.new_context(
        offline=True, viewport={"width": 480, "height": 420}, device_scale_factor=0.25
    )
    context.set_default_timeout(MILLISECONDS)
    asked: list[str] = []
    complaints: list[str] = []

    def opened(path: Path, *, ready: bool = True) -> Page:
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.on(
            "console",
            lambda said: (
                complaints.append(said.text) if said.type in {"error", "warning"} else None
            ),
        )
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(path.as_uri())
        if ready:
            page.wait_for_selector("body[data-ready]")
        return page

    yield opened
    context.close()
    assert {url.partition("//")[0] for url in asked if not url.startswith(("blob:", "data:"))} == {
        "file:"
    }, asked
    assert all(url.endswith("report.html") for url in asked if url.startswith("file:"))
    # What the software renderer says of itself is not the page's.
    assert not [
        one for one in complaints if "GPU stall" not in one and "swiftshader" not in one.lower()
    ], complaints


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


def test_a_pile_is_drawn_and_a_sweeps_points_open_reports_in_which_beads_play_pause_and_turn(
    pile_report: Path, swept_report: Path, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(pile_report)
    page.wait_for_selector(".scene[data-ready]")
    wait_for(lambda: len(np.unique(Image.open(BytesIO(picture(page))))) > 9)
    page.close()
    page = visit(swept_report, ready=False)
    assert page.evaluate("window.hostile") is None
    assert page.locator("h1").text_content() == HOSTILE
    page.locator("table.sweep a").click()
    page.wait_for_selector(".scene[data-ready]")
    begin, play, time = rested(page), page.locator(".play"), page.locator(".time")
    assert (play.text_content(), time.text_content()) == ("Play", "0.0000 s")
    page.locator(".slower").select_option("1000")  # a busy machine shows a frame in seconds
    play.click()
    expect(play).to_have_text("Pause")
    wait_for(lambda: picture(page) != begin)

    def pause() -> str | None:
        """The time at which it pauses; it goes on if that is the beginning, to which it returns."""
        play.click()
        expect(play).to_have_text("Play")
        if (at := time.text_content()) != "0.0000 s":
            return at
        play.click()
        expect(play).to_have_text("Pause")
        return None

    stopped = wait_for(pause)
    paused = rested(page, begin)

    def turn() -> bytes | None:
        """The scene that the mouse has turned; a busy page may lose what the mouse does before it listens."""
        scene = page.locator(".scene:visible").first
        scene.scroll_into_view_if_needed()
        box = scene.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 90, y + 30, steps=4)
        page.mouse.up()
        return after if (after := rested(page)) not in (begin, paused) else None

    turned = wait_for(turn)
    assert time.text_content() == stopped  # turned, not played
    page.get_by_role("button", name="as at first").click()
    rested(page, turned)
