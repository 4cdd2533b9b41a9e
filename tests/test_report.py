"""Reports: their numbers, the words of users in them, and how a browser plays them offline.

Debian's Chromium, which ``make test`` installs, is driven by Playwright. WebGL is computed by the
processor (SwiftShader), which is slow: windows are small and patience is long.
"""

from __future__ import annotations

import base64
import html
import re
import shutil
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import pairwise
from math import nan, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

import walkers
from tests.conftest import PATIENCE, document, make_case, to_toml, wait_for
from walkers.inputs.sweep import expand
from walkers.postprocess.measure.caption import caption
from walkers.postprocess.measure.motion import Motion, read_bridges, read_motion
from walkers.postprocess.measure.numbers import rows, text_and_unit
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
    from playwright.sync_api import Browser, ConsoleMessage, Page

Once = Callable[[str, Callable[[Path], object]], Path]
HOSTILE = "<script>window.hostile = true</script> \" ' </title> & {{ 7 * 7 }}"
"""A title that would be a script, the end of the title, or an expression, if not escaped."""


class Report:
    """A page as text.

    Attributes
    ----------
    text
        The file.
    title
        The title of the page.
    words
        What a reader sees: the text without tags, scripts and styles.
    references
        What its tags refer to.
    scripts
        Its scripts.
    carried
        The data that it carries, by name.
    """

    def __init__(self, path: Path) -> None:
        self.text = path.read_text("utf-8")
        carried = re.findall(r'<script type="text/plain" id="([^"]+)">([^<]+)</script>', self.text)
        self.carried = dict(carried)
        self.scripts = re.findall(r"<script\b[^>]*>(.*?)</script>", self.text, re.DOTALL)
        bare = re.sub(r"(<(script|style)\b[^>]*>).*?</\2>", r"\1", self.text, flags=re.DOTALL)
        titles = re.findall(r"<title>(.*?)</title>", bare, re.DOTALL)
        self.title = html.unescape("".join(titles))
        self.references = re.findall(
            r"""\s(?:src|href|srcset|action|data)\s*=\s*["']?([^"'\s>]+)""", bare
        )
        words = re.sub(r"<title\b.*?</title>|<[^>]*>", "", bare, flags=re.DOTALL)
        self.words = html.unescape(words)


@pytest.fixture(scope="session")
def walked_run(run_directory: Callable[..., Path]) -> Path:
    """A run of two walkers, whose case calls itself something hostile; no other test runs it."""
    settings = {"cycles": 9, "settling_cycles": 2, "samples_per_cycle": 20}
    return run_directory(dimers={"replicates": 2}, run=settings, title=HOSTILE)


@pytest.fixture(scope="session")
def walked_report(walked_run: Path, once: Once) -> Path:
    """The report of `walked_run`."""

    def write(folder: Path) -> None:
        report_run(walked_run, folder / "report.html")

    return once("walked-report", write) / "report.html"


@pytest.fixture(scope="session")
def pile_report(pile_run: Path, once: Once) -> Path:
    """The report of the shipped pile, by the run's name in the folder of the runs."""

    def write(folder: Path) -> None:
        walkers.load(pile_run.name, pile_run.parent).report(folder / "report.html")

    return once("pile-report", write) / "report.html"


@pytest.fixture(scope="session")
def swept(once: Once) -> Path:
    """A sweep of two points; the second of its runs has a report."""

    def write(folder: Path) -> None:
        case = document(run={"cycles": 6, "settling_cycles": 2})
        (folder / "base.toml").write_text(to_toml(case))
        tables = {
            "title": HOSTILE,
            "case": "base.toml",
            "axes": {"drive.frequency": ["60 Hz", "70 Hz"]},
        }
        plan = expand(tables, source="two", name="two", folder=folder)
        run_sweep(plan, folder, SweepOptions(2))
        sweep = walkers.load("two", folder)
        sweep.runs[1].report()
        sweep.report()

    return once("sweep-report", write) / "two"


@pytest.fixture(scope="session")
def swept_report(swept: Path) -> Path:
    """The report of the sweep `swept`."""
    return swept / "report.html"


# --- what a report of a run says --------------------------------------------------------------

of_both_bodies = pytest.mark.parametrize("name", ["walked", "pile"])


@pytest.fixture
def run_of_report(name: str, request: pytest.FixtureRequest) -> Path:
    """The directory of the run with a name of `of_both_bodies`."""
    directory: Path = request.getfixturevalue(f"{name}_run")
    return directory


@pytest.fixture
def report(name: str, request: pytest.FixtureRequest) -> Path:
    """The report of the run with a name of `of_both_bodies`, or of the sweep."""
    path: Path = request.getfixturevalue(f"{name}_report")
    return path


@of_both_bodies
def test_a_report_has_all_numbers_of_the_result(
    name: str, report: Path, run_of_report: Path
) -> None:
    words = Report(report).words
    for row in rows(read_results(run_of_report)):
        assert f"{row.label}{row.text}{row.unit}{row.error}" in words


@of_both_bodies
def test_a_report_says_which_uncertainty_is_not_computed(
    name: str, report: Path, run_of_report: Path
) -> None:
    reason = not_computed(read_results(run_of_report)).text
    assert f"Uncertainty not computed: {reason}." in Report(report).words


@of_both_bodies
def test_a_report_has_all_parameters_with_their_origins(
    name: str, report: Path, run_of_report: Path
) -> None:
    words = Report(report).words
    assert "given" in words
    assert "library" in words
    for origin in walkers.load(run_of_report).case.origins:
        assert origin.key in words
        assert origin.text in words
        assert origin.word in words


@of_both_bodies
def test_a_report_is_not_too_large_to_be_sent(name: str, report: Path) -> None:
    assert report.stat().st_size < LARGEST_REPORT


def test_figures_of_a_report_are_those_that_are_plotted(
    walked_run: Path, walked_report: Path
) -> None:
    """Without what matplotlib writes about them and about itself."""
    text = walked_report.read_text("utf-8")
    figures = figures_of(read_results(walked_run))
    assert len(figures) == 2
    for figure in figures.values():
        drawing = svg_of(figure)
        assert drawing in text
        assert "<metadata" not in drawing
        assert "purl.org" not in drawing


def test_fewer_frames_make_a_report_smaller(
    walked_run: Path, walked_report: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All 181 frames of four beads at first, and then half of them; the report says so."""
    monkeypatch.setattr("walkers.postprocess.show.report.run.MOST_PLACES", 4 * 181)
    largest = walked_report.stat().st_size - 1000
    smaller = report_run(walked_run, tmp_path / "smaller.html", largest=largest)
    assert smaller.stat().st_size < largest
    assert "frames shown" in Report(smaller).words


# --- what a report leaves outside -------------------------------------------------------------


@pytest.mark.parametrize("name", ["walked", "pile"])
def test_a_report_of_a_run_refers_to_nothing_outside(name: str, report: Path) -> None:
    for reference in Report(report).references:
        assert reference.startswith(("#", "data:"))


@pytest.mark.parametrize("name", ["walked", "pile", "swept"])
def test_a_report_names_no_folder_of_its_author(name: str, report: Path) -> None:
    words = Report(report).words
    folders = {str(Path.home()), str(Path(__file__).parents[1]), str(report.parent)}
    for folder in folders - {"/"}:
        assert folder not in words


@pytest.mark.parametrize("name", ["walked", "pile"])
def test_the_library_of_a_report_loads_no_fonts(name: str, report: Path) -> None:
    packed = base64.b64decode(Report(report).carried["library-k3d"])
    code, *_ = zlib.decompress(packed).decode().split("sourcesContent")
    assert "url(fonts/" not in code


@pytest.mark.parametrize("name", ["walked", "swept"])
def test_words_of_a_user_are_words_in_a_report(name: str, report: Path) -> None:
    page = Report(report)
    assert page.title == HOSTILE
    assert HOSTILE in page.words
    for script in page.scripts:
        assert "hostile" not in script


# --- reports of sweeps ------------------------------------------------------------------------


def test_a_sweeps_report_has_its_figure(swept: Path, swept_report: Path) -> None:
    assert svg_of(walkers.load(swept).figure()) in swept_report.read_text("utf-8")


def test_a_sweeps_report_has_its_table(swept: Path, swept_report: Path) -> None:
    text = swept_report.read_text("utf-8")
    for velocity in load_table(swept)["velocity"]:
        assert f'<td class="number">{rounded(1e3 * velocity, "mm/s")}</td>' in text


def test_a_sweeps_report_links_to_the_reports_of_its_runs(swept: Path, swept_report: Path) -> None:
    """The second run alone has one."""
    (reference,) = Report(swept_report).references
    second_run = Path(load_table(swept)["run"][1]).name
    assert reference == f"../{second_run}/report.html"
    assert (swept / reference).is_file()


def test_a_sweeps_report_has_no_scripts(swept_report: Path) -> None:
    page = Report(swept_report)
    assert page.carried == {}
    assert page.scripts == []


def test_the_report_of_a_sweep_of_three_keys_draws_the_values_of_the_last_alike_and_says_so(
    looked_through: Path, tmp_path: Path
) -> None:
    """One figure, and a table of 2 · 2 · 3 points."""
    page = Report(walkers.load(looked_through / "three").report(tmp_path / "report.html"))
    assert "not distinguished: frequency" in page.words
    assert page.text.count("<svg") == 1
    assert page.text.count('<tr><th scope="row">') == 12


# --- the player -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Player:
    """The player of a run, and the motion that it shows.

    Attributes
    ----------
    motion
        The motion, of the first walker or of a pile.
    objects
        What the player draws, by name.
    times
        The first and the last time, s.
    captions
        What is written below.
    """

    motion: Motion
    objects: dict[str, Any]
    times: list[float]
    captions: list[str]


def player_of_run(directory: Path, motion: Motion) -> Player:
    """The player of a run, with a motion to compare it with."""
    plot, times, captions = player_of(read_motion(directory))
    objects = {drawn.name: drawn for drawn in plot.objects}
    return Player(motion, objects, times, captions)


@pytest.fixture(scope="module")
def player_of_walker(walked_run: Path) -> Player:
    motion = gathered(read_motion(walked_run)).driven
    return player_of_run(walked_run, motion.of_walkers(motion.walkers[:1]))


@pytest.fixture(scope="module")
def player_of_pile(pile_run: Path) -> Player:
    return player_of_run(pile_run, read_motion(pile_run).driven)


def matrices_of(player: Player, number: int) -> tuple[list[float], np.ndarray]:
    """Times (s), and matrices of a bead, which scale, turn and move a sphere (mm)."""
    beads = [drawn for name, drawn in player.objects.items() if name.startswith("bead")]
    matrices = beads[number].model_matrix
    times = [float(time) for time in matrices]
    return times, np.array(list(matrices.values()), dtype=float)


def test_the_player_shows_the_first_walker_from_the_start_to_the_end(
    player_of_walker: Player,
) -> None:
    beads = [name for name in player_of_walker.objects if name.startswith("bead")]
    assert len(beads) == 2
    motion = player_of_walker.motion
    assert player_of_walker.times == [motion.time[0], motion.time[-1]]


@pytest.mark.parametrize("number", [0, 1], ids=["large", "small"])
def test_the_player_shows_beads_where_the_motion_has_them(
    player_of_walker: Player, number: int
) -> None:
    """To 0.1 µm."""
    motion = player_of_walker.motion
    times, matrices = matrices_of(player_of_walker, number)
    assert times == pytest.approx(motion.time, abs=1e-6)
    np.testing.assert_allclose(matrices[:, :3, 3], 1e3 * motion.position[:, number], atol=1e-4)


@pytest.mark.parametrize("number", [0, 1], ids=["large", "small"])
def test_the_player_turns_beads_as_their_spins_turned_them(
    player_of_walker: Player, walked_run: Path, number: int
) -> None:
    """From the end of the settling on, as the measured rotation says: ωR, positive as it walks."""
    motion = player_of_walker.motion
    run = motion.case.run
    settled = run.settling_cycles * run.samples_per_cycle
    _, matrices = matrices_of(player_of_walker, number)
    radius = motion.radius[number]
    start, end = Rotation.from_matrix(matrices[[settled, -1], :3, :3] / (1e3 * radius))
    across = np.cross([0.0, 0.0, 1.0], motion.case.drive_axis)
    angle = motion.walkers[0].facing * float((end * start.inv()).as_rotvec() @ across)
    speed = angle * radius / (motion.time[-1] - motion.time[settled])
    rotation = read_table(walked_run, "walkers").iloc[0]
    assert speed == pytest.approx(rotation[f"rotation_{number + 1}"], rel=0.01, abs=2e-6)


def test_a_weightless_walker_is_seen_as_the_floor_lies(player_of_walker: Player) -> None:
    motion = player_of_walker.motion
    case = motion.case.with_value_at("environment.gravity", 0.0)
    assert camera_of(replace(motion, case=case)) == camera_of(motion)


def front_wall_of(motion: Motion) -> int:
    """The wall of a pile between it and the camera: the first across y."""
    across_y = [wall.normal[1] > 0.9 for wall in motion.case.boundary.walls]
    return across_y.index(True)


def necks_with_a_width(player: Player, frame: int) -> np.ndarray:
    """Whether necks are wider than 10 µm in the player: 160 points each, 32 around the start."""
    vertices = player.objects["bridges"].vertices[f"{player.motion.time[frame]:.6f}"]
    points = vertices.reshape(-1, 160, 3)
    return np.asarray(np.ptp(points[:, :32], axis=1).max(axis=1) > 0.01)


def test_necks_of_the_player_are_as_many_as_bridges_at_their_times(player_of_pile: Player) -> None:
    """But for those to the wall in front."""
    motion = player_of_pile.motion
    front = front_wall_of(motion)
    hidden = 0
    for bridges in read_bridges(motion):
        at_front = bridges.contacts[:, 2] == front
        hidden += int(at_front.sum())
        expected = int((~at_front).sum())
        assert int(necks_with_a_width(player_of_pile, bridges.frame).sum()) == expected
    assert hidden > 0


def test_necks_of_the_player_have_no_width_after_they_ruptured(player_of_pile: Player) -> None:
    frames = [bridges.frame for bridges in read_bridges(player_of_pile.motion)]
    ruptured = 0
    for frame, next_frame in pairwise(frames):
        before = necks_with_a_width(player_of_pile, frame)
        after = necks_with_a_width(player_of_pile, next_frame)
        ruptured += int((before & ~after).sum())
    assert ruptured > 0


def test_the_player_shows_beads_of_a_pile_where_the_motion_has_them(player_of_pile: Player) -> None:
    """To 1 µm, in mm. That they roll is not shown, and is said."""
    motion = player_of_pile.motion
    positions = player_of_pile.objects["beads"].positions[f"{motion.time[-1]:.6f}"]
    np.testing.assert_allclose(positions, 1e3 * motion.position[-1], atol=1e-3)
    assert "rolling of the beads is not shown" in " ".join(player_of_pile.captions)


# --- words and numbers ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (1.38173201, "1.382"),
        (1234.5678, "1235"),
        (-87654.3, "-87650"),
        (0.0012345678, "0.001235"),
        (6, "6"),
        (nan, "-"),
    ],
)
def test_words_and_numbers_of_four_digits(number: float, text: str) -> None:
    assert rounded(number) == text


@pytest.mark.parametrize(
    ("number", "text"),
    [(-3.2e-15, "0"), (-0.002164, "-0.002"), (0.000414, "0"), (9.9996, "10")],
)
def test_words_and_numbers_of_velocities_have_three_decimals(number: float, text: str) -> None:
    assert rounded(number, "mm/s") == text


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("m", ("250", "mm")),
        ("m/s", ("250.0", "mm/s")),
        ("rad", ("14.32", "°")),
        ("share", ("25", "%")),
    ],
)
def test_words_and_numbers_have_the_units_that_people_use(unit: str, text: tuple[str, str]) -> None:
    """0.25 of an SI unit; 0.25 rad are 14.32°."""
    assert text_and_unit(0.25, unit) == text


def test_the_caption_of_a_slope_says_where_up_is() -> None:
    case = make_case().with_value_at("boundary.tilt", pi / 3.0)
    case = case.with_value_at("boundary.uphill", pi / 2.0)
    assert caption(case).endswith("plane tilted by 60°, up is at 90° from x toward y")


# --- in a browser -----------------------------------------------------------------------------

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
MILLISECONDS = 1e3 * PATIENCE


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Chromium without a screen, in which the processor computes WebGL."""
    from playwright.sync_api import expect, sync_playwright

    flags = [
        "--no-sandbox",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--ignore-gpu-blocklist",
    ]
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(
            executable_path=CHROMIUM, args=flags, timeout=MILLISECONDS
        )
        expect.set_options(timeout=MILLISECONDS)
        yield started
        started.close()


def is_a_complaint(text: str) -> bool:
    """Whether a message is the page's; the software renderer writes some of its own."""
    return "GPU stall" not in text and "swiftshader" not in text.lower()


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Open a file.

    In the end, it must have asked for files of reports alone, and have complained of nothing.
    """
    # A processor draws each pixel: a sixteenth of them.
    context = browser.new_context(
        offline=True, viewport={"width": 480, "height": 420}, device_scale_factor=0.25
    )
    context.set_default_timeout(MILLISECONDS)
    addresses: list[str] = []
    complaints: list[str] = []

    def listen_to_console(message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"} and is_a_complaint(message.text):
            complaints.append(message.text)

    def open_page(path: Path, *, ready: bool = True) -> Page:
        page = context.new_page()
        page.on("request", lambda request: addresses.append(request.url))
        page.on("console", listen_to_console)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(path.as_uri())
        if ready:
            page.wait_for_selector("body[data-ready]")
        return page

    yield open_page
    context.close()
    outside = [url for url in addresses if not url.startswith(("blob:", "data:"))]
    assert outside
    for url in outside:
        assert url.startswith("file:")
        assert url.endswith("report.html")
    assert complaints == []


def picture(page: Page) -> bytes:
    """The picture of the scene, as a PNG file."""
    return page.locator(".scene:visible canvas").first.screenshot()


def wait_for_frames(page: Page) -> None:
    """Wait for eight frames, however long they take: Playwright asks once a frame."""
    page.wait_for_function("() => (window.drawn = (window.drawn ?? 0) + 1) % 8 === 0")


def rested_picture(page: Page, *others: bytes) -> bytes:
    """The picture as soon as it is none of others and frames change it no more."""

    def unchanged_picture() -> bytes | None:
        before = picture(page)
        wait_for_frames(page)
        if before not in others and picture(page) == before:
            return before
        return None

    return wait_for(unchanged_picture)


def pause(page: Page) -> str | None:
    """Pause a player that plays; the time that it shows then.

    None if that is the start, to which it returns after the end; then it goes on.
    """
    from playwright.sync_api import expect

    play = page.locator(".play")
    play.click()
    expect(play).to_have_text("Play")
    time = page.locator(".time").text_content()
    if time != "0.0000 s":
        return time
    play.click()
    expect(play).to_have_text("Pause")
    return None


def drag_across(page: Page) -> None:
    """Drag the mouse across the scene."""
    scene = page.locator(".scene:visible").first
    scene.scroll_into_view_if_needed()
    box = scene.bounding_box()
    assert box is not None
    x = box["x"] + box["width"] / 2
    y = box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 30, steps=4)
    page.mouse.up()


def test_a_pile_is_drawn(pile_report: Path, visit: Callable[..., Page]) -> None:
    """In more than nine colours."""
    page = visit(pile_report)
    page.wait_for_selector(".scene[data-ready]")
    wait_for(lambda: len(np.unique(Image.open(BytesIO(picture(page))))) > 9)


def test_a_sweeps_point_opens_a_report_whose_beads_play_and_pause(
    swept_report: Path, visit: Callable[..., Page]
) -> None:
    from playwright.sync_api import expect

    page = visit(swept_report, ready=False)
    assert page.evaluate("window.hostile") is None
    assert page.locator("h1").text_content() == HOSTILE
    page.locator("table.sweep a").click()
    page.wait_for_selector(".scene[data-ready]")
    start = rested_picture(page)
    play = page.locator(".play")
    time = page.locator(".time")
    assert play.text_content() == "Play"
    assert time.text_content() == "0.0000 s"

    page.locator(".slower").select_option("1000")  # a busy machine shows a frame in seconds
    play.click()
    expect(play).to_have_text("Pause")
    wait_for(lambda: picture(page) != start)
    time_of_pause = wait_for(lambda: pause(page))
    wait_for_frames(page)
    assert time.text_content() == time_of_pause
    rested_picture(page, start)


def test_beads_of_a_report_turn_with_the_mouse_and_back(
    swept: Path, visit: Callable[..., Page]
) -> None:
    """And do not play."""
    second_run = Path(load_table(swept)["run"][1]).name
    page = visit(swept.parent / second_run / "report.html")
    page.wait_for_selector(".scene[data-ready]")
    reset_view = page.get_by_role("button", name="Reset view")
    reset_view.click()
    start = rested_picture(page)

    def turned_picture() -> bytes | None:
        """A busy page may lose what the mouse does before it listens."""
        drag_across(page)
        after = rested_picture(page)
        return None if after == start else after

    wait_for(turned_picture)
    assert page.locator(".time").text_content() == "0.0000 s"
    reset_view.click()
    wait_for(lambda: picture(page) == start)
