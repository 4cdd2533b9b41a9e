"""Reports: what is in the file, that it says what the result says, and what a user's words cannot do in it."""

import base64
import html
import re
import zlib
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import nan, pi
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import walkers
from tests.conftest import document, make_case, to_toml
from walkers.inputs.reading import load_case
from walkers.inputs.sweep import expand
from walkers.postprocess.caption import caption
from walkers.postprocess.figures import figures_of
from walkers.postprocess.motion import read_bridges, read_motion
from walkers.postprocess.numbers import rows, shown
from walkers.postprocess.report.page import LARGEST, svg_of
from walkers.postprocess.report.player import cameras_of, player_of
from walkers.postprocess.report.run import report_run, shown_of
from walkers.postprocess.results import Results, read
from walkers.postprocess.scene import camera_axes, gathered
from walkers.postprocess.tables import read_table
from walkers.rounding import rounded, with_decimals
from walkers.runner.provenance import software
from walkers.sweeps.scheduler import Options, run_sweep
from walkers.sweeps.table import load

Once = Callable[[str, Callable[[Path], object]], Path]
HOSTILE = "<script>window.hostile = true</script> \" ' </title> & {{ 7 * 7 }}"


class Page:
    """Numbers of a page with their texts and places in the result, its words, its scripts, and what it refers to."""

    def __init__(self, path: Path) -> None:
        text = path.read_text("utf-8")
        self.carried = dict(re.findall(r'<script type="text/plain" id="([^"]+)">([^<]+)</script>', text))
        self.scripts = re.findall(r"<script\b[^>]*>(.*?)</script>", text, re.DOTALL)
        bare = re.sub(r"(<(script|style)\b[^>]*>).*?</\2>", r"\1", text, flags=re.DOTALL)
        self.title = html.unescape("".join(re.findall(r"<title>(.*?)</title>", bare, re.DOTALL)))
        self.numbers = [(_attributes(tag), told) for tag, told in re.findall(r"<data\b([^>]*)>([^<]*)</data>", bare)]
        tags = [_attributes(tag) for tag in re.findall(r"<[a-z][^>]*>", bare)]
        names = ("src", "href", "srcset", "action", "data")
        self.references = [tag[name] for tag in tags for name in names if name in tag]
        self.words = html.unescape(re.sub(r"<(title|data)\b.*?</\1>|<[^>]*>", "", bare, flags=re.DOTALL))


def _attributes(tag: str) -> dict[str, str]:
    found = re.findall(r"""\s([\w-]+)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s>"']+))""", tag)
    return {name: "".join(values) for name, *values in found}


def check_rows(page: Page, results: Results) -> None:
    """The page has each row of the result: label, text, unit and errors."""
    for row in rows(results):
        assert f"{row.label}{row.text}{row.unit}{row.error}" in page.words


@pytest.fixture(scope="session")
def walked_run(run_directory: Callable[..., Path]) -> Path:
    """A run of two walkers, whose case calls itself something hostile."""
    settings = {"cycles": 9, "settling_cycles": 2, "samples_per_cycle": 20}  # no other test's run
    return run_directory(dimers={"replicates": 2}, run=settings, title=HOSTILE)


@pytest.fixture(scope="session")
def walked_report(walked_run: Path, once: Once) -> Path:
    return once("walked-report", lambda folder: report_run(walked_run, folder / "report.html")) / "report.html"


@pytest.fixture(scope="session")
def pile_report(pile_run: Path, once: Once) -> Path:
    """Asked for by the run's name in the folder of the runs."""
    place = once("pile-report", lambda to: walkers.load(pile_run.name, pile_run.parent).report(to / "report.html"))
    return place / "report.html"


@pytest.fixture(scope="session")
def swept(once: Once) -> Path:
    """A sweep of three points."""

    def make(out: Path) -> None:
        (out / "base.toml").write_text(to_toml(document(run={"cycles": 6, "settling_cycles": 2})))
        given = {"title": HOSTILE, "case": "base.toml", "axes": {"drive.frequency": ["60 Hz", "70 Hz", "80 Hz"]}}
        _, failures = run_sweep(expand(given, source="three", name="three", folder=out), out, Options(2))
        assert not failures

    return once("swept", make) / "three"


@pytest.fixture(scope="session")
def swept_report(swept: Path) -> Path:
    """Asked for by the sweep's name in the folder of the runs; the second of its runs has a report."""
    sweep = walkers.load(swept.name, swept.parent)
    sweep.runs[1].report()
    return sweep.report()


@pytest.mark.parametrize("name", ["walked", "pile"])
def test_numbers_of_a_report_are_the_results_and_parameters_say_whence(
    name: str, request: pytest.FixtureRequest
) -> None:
    path, directory = (request.getfixturevalue(f"{name}_{what}") for what in ("report", "run"))
    page = Page(path)
    check_rows(page, read(directory))
    assert path.stat().st_size < LARGEST
    assert f"Written by granular-walkers {software()['granular_walkers']}." in page.words
    origins = walkers.load(directory).case.origins
    assert len(origins) > 20
    for said in ("given", "library", *(told for one in origins for told in (one.key, one.text, one.word))):
        assert said in page.words


@pytest.mark.parametrize("name", ["walked_report", "pile_report", "swept_report"])
def test_a_report_refers_to_nothing_outside_and_a_users_words_are_words(
    name: str, request: pytest.FixtureRequest
) -> None:
    path = request.getfixturevalue(name)
    page, text = Page(path), path.read_text("utf-8")
    link = re.compile(r"\.\./[\w-]+/report\.html" if name == "swept_report" else r"#|data:")
    assert all(link.match(one) for one in page.references), page.references
    if name != "swept_report":
        library = zlib.decompress(base64.b64decode(page.carried["library-k3d"])).decode()
        assert "url(fonts/" not in library.split("sourcesContent")[0]
        assert "<noscript>" in text
    for folder in {str(Path.home()), str(Path(__file__).parents[1]), str(path.parent)} - {"/"}:
        assert folder not in page.words
    if name != "pile_report":
        assert page.title == HOSTILE
        assert HOSTILE in page.words
        assert not any("hostile" in script for script in page.scripts)
        assert html.escape(HOSTILE, quote=False).split()[0] in text


def test_a_sweeps_report_has_its_figure_and_table_and_links_to_the_reports_of_its_runs(
    swept: Path, swept_report: Path
) -> None:
    page, text, table = Page(swept_report), swept_report.read_text("utf-8"), load(swept)
    assert set(table["velocity"]) < {float(number["value"]) for number, _ in page.numbers}
    assert page.references == [f"../{Path(table['run'][1]).name}/report.html"]
    assert (swept / page.references[0]).is_file()
    assert svg_of(walkers.load(swept).figure()) in text
    assert (page.carried, page.scripts) == ({}, [])


def test_a_reports_figures_are_those_that_are_plotted(walked_run: Path, walked_report: Path) -> None:
    """Without elements of the page's names and metadata that would ask a network."""
    text, drawings = walked_report.read_text("utf-8"), [svg_of(one) for one in figures_of(read(walked_run)).values()]
    assert len(drawings) == 2
    assert all(one in text and "<metadata" not in one and "purl.org" not in one for one in drawings)
    ids = re.findall(r'\sid="([^"]+)"', "".join(drawings))
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', "".join(drawings)))
    assert set(ids) <= used


def test_a_report_of_many_beads_has_fewer_frames(walked_run: Path, walked_report: Path, tmp_path: Path) -> None:
    limit = walked_report.stat().st_size - 1000
    less = report_run(walked_run, tmp_path / "less.html", largest=limit)
    assert less.stat().st_size < limit
    assert "frames shown" in Page(less).words


def test_the_player_shows_the_motion(walked_run: Path) -> None:
    """Each bead of the first walker is where the motion has it, turned as its spins turned it, to 0.1 µm."""
    motion, player = gathered(read_motion(walked_run)).driven, player_of(walked_run)
    motion = motion.of_walkers(motion.walkers[:1])
    beads = [one for one in player.plot.objects if one.name.startswith("bead")]
    assert len(beads) == len(motion.radius) == 2
    assert (player.begin, player.end) == (motion.time[0], motion.time[-1])
    across = np.cross([0.0, 0.0, 1.0], motion.case.drive_axis)
    settled = motion.case.run.settling_cycles * motion.case.run.samples_per_cycle
    rolled: dict[int, list[float]] = {0: [], 1: []}
    for number, ball in enumerate(beads):
        matrices = np.array(list(ball.model_matrix.values()), dtype=float)
        assert [float(time) for time in ball.model_matrix] == pytest.approx(motion.time, abs=1e-6)
        np.testing.assert_allclose(matrices[:, :3, 3], 1e3 * motion.position[:, number], atol=1e-4)
        turned = Rotation.from_matrix(matrices[[settled, -1], :3, :3] / (1e3 * motion.radius[number]))
        way = motion.walkers[number // 2].facing * float((turned[1] * turned[0].inv()).as_rotvec() @ across)
        rolled[number % 2].append(way * motion.radius[number] / (motion.time[-1] - motion.time[settled]))
    rotation = read_table(walked_run, "walkers").iloc[0]
    for bead, key in enumerate(("rotation_1", "rotation_2")):
        assert np.mean(rolled[bead]) == pytest.approx(rotation[key], rel=0.01, abs=2e-6)
    weightless = replace(motion, case=motion.case.put("environment.gravity", 0.0))  # is seen as the floor lies
    assert cameras_of(weightless) == cameras_of(motion)
    np.testing.assert_allclose(camera_axes(weightless), camera_axes(motion))


def test_necks_of_the_player_are_as_wide_as_bridges_at_their_times(walked_run: Path, pile_run: Path) -> None:
    """Those of the first walker; of a pile those that rupture, which have no width then."""
    for run, count in ((walked_run, 3), (pile_run, None)):
        motion = read_motion(run).driven
        motion = motion if count is None else motion.of_walkers(motion.walkers[:1])
        player = player_of(run)
        (necks,) = (one for one in player.plot.objects if one.name == "bridges")
        assert any("Blue: liquid bridges" in caption for caption in player.captions)
        held = {bridges.frame: len(bridges.contacts) for bridges in read_bridges(motion)}
        wide = []
        for frame in held:
            points = necks.vertices[f"{motion.time[frame]:.6f}"].reshape(-1, 80, 3)
            wide.append(np.ptp(points[:, :16], axis=1).max(axis=1) > 0.01)
            assert count is None or len(points) == count
        assert [int(each.sum()) for each in wide] == [*held.values()]
        if count is None:
            assert any((one & ~other).any() for one, other in pairwise(wide))


def test_long_runs_are_thinned_out_and_say_so(walked_run: Path, pile_run: Path) -> None:
    player = player_of(walked_run, places=200)
    beads = [one for one in player.plot.objects if one.name.startswith("bead")]
    assert sum(len(one.model_matrix) for one in beads) <= 200
    assert any("frames shown" in caption for caption in player.captions)
    pile, motion = player_of(pile_run), read_motion(pile_run).driven
    points = next(one for one in pile.plot.objects if one.name == "beads")
    np.testing.assert_allclose(points.positions[f"{motion.time[-1]:.6f}"], 1e3 * motion.position[-1], atol=1e-3)
    assert any("rolling of the beads is not shown" in caption for caption in pile.captions)


@pytest.mark.parametrize("value", [0.022, 0.03])
def test_a_report_says_what_is_uncertain_in_the_case_that_was_asked_for(value: float, walked_run: Path) -> None:
    """The run of a case may have been made for one whose values have other sources."""
    case = load_case("fig1b", {"liquid.volume_fraction": value, "contact.rolling_friction": 0.0})
    keys = {one["key"]: one["origin"] for one in read(walked_run, case.origins).about["rests_on"]}
    assert keys["liquid.volume_fraction"] == "given"
    shown = shown_of(case, read(walked_run), case.origins)
    assert {one["key"]: one["origin"] for one in shown["parameters"]}["liquid.volume_fraction"] == "given"


def test_words_and_numbers() -> None:
    """Numbers have four digits at most and the decimals of their unit; a nameless liquid is told by its own."""
    given = [(1.38173201,), (1234.5678,), (-87654.3,), (0.0012345678,), (-3.2e-15, "mm/s"), (6,), (1e-12,), (nan,)]
    given += [(-0.002164, "mm/s"), (-0.00175, "mm/s"), (0.000414, "mm/s"), (0.0005927, "mm/s"), (3.08, "mm/s")]
    expected = ["1.382", "1235", "-87650", "0.001235", "0", "6", "0", "-", "-0.002", "-0.002", "0", "0.001", "3.08"]
    assert [rounded(*one) for one in given] == expected
    given = [(18.18654, 3), (1.08, 3), (-2e-6, 3), (99.99951, 3), (-179.957, 2), (0.0, 1)]
    assert [with_decimals(*one) for one in given] == ["18.19", "1.080", "0", "100.0", "-180.0", "0"]
    texts = {"m": ("250", "mm"), "m/s": ("250.0", "mm/s"), "rad": ("14.32", "°"), "share": ("25", "%")}
    assert {unit: shown(0.25, unit) for unit in texts} == texts
    case = make_case()
    assert "glass, Si AK5; 80 Hz" in caption(case)
    assert caption(case).startswith("1 walker of R = 0.3 / 0.2 mm on a plane")
    assert "liquid of 19.2 mN/m; 80 Hz" in caption(case.put("liquid.name", None))
    tilted = case.put("boundary.tilt", pi / 3.0)
    assert caption(tilted).endswith("plane tilted by 60°, right is up")
    aside = tilted.put("boundary.uphill", pi / 2.0)
    assert caption(aside).endswith("plane tilted by 60°, up is at 90° from x toward y")


def test_runs_show_themselves(walked_run: Path, tmp_path: Path) -> None:
    """In a notebook: a table that is the result, the parameters, and the pictures that were drawn."""
    run, shown = walkers.load(walked_run), tmp_path / "shown.html"
    shown.write_text(run._repr_html_(), "utf-8")
    check_rows(Page(shown), run.result)
    assert "<details>" in shown.read_text("utf-8")
    assert run.plot(tmp_path) == [tmp_path / f"{name}.png" for name in ("walk", "gait")]
