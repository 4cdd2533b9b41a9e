"""Reports: what is in the file, that it says what the result says, and what a user's words cannot do in it."""

import base64
import hashlib
import html
import json
import re
import shutil
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import walkers
from tests.conftest import call, document, make_case, to_toml
from tests.test_pile import HALF, small
from walkers.calibration.page import report_calibration
from walkers.inputs.sweep import expand
from walkers.postprocess import read_motion
from walkers.postprocess.analysis import current_result, number_of, rounded
from walkers.postprocess.motion import gathered
from walkers.postprocess.report.page import LARGEST, overhead
from walkers.postprocess.report.run import report_run, summary_of
from walkers.postprocess.report.scene import cameras_of, scene_of
from walkers.postprocess.scene import camera_axes
from walkers.runner.provenance import software
from walkers.sweeps.report import report_sweep
from walkers.sweeps.run import run_sweep
from walkers.sweeps.scheduler import Options
from walkers.sweeps.table import load

Once = Callable[[str, Callable[[Path], object]], Path]
HOSTILE = "<script>window.hostile = true</script> \" ' </title> & {{ 7 * 7 }}"


class Page:
    """Numbers of a page with their texts and places in the result, its words, its scripts, and what it refers to."""

    def __init__(self, path: Path) -> None:
        text = path.read_text("utf-8")
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


def at(result: Any, key: str) -> Any:
    for part in key.split("."):
        result = result[int(part)] if isinstance(result, list) else result[part]
    return result


def check_numbers(page: Page, result: dict[str, Any]) -> set[str]:
    """Each number is the result's to its last digit, and what is shown is that number in its unit; their keys."""
    for number, text in page.numbers:
        value = at(result, number["data-key"])
        assert float(number["value"]) == value, number
        shown = value * float(number["data-factor"])
        last = 10.0 ** -len(text.partition("e")[0].partition(".")[2]) * 10.0 ** float(text.partition("e")[2] or 0)
        assert float(text) == pytest.approx(shown, abs=0.5001 * last if "." in text else 0.5001), (number, text)
        assert float(text) == pytest.approx(shown, rel=5e-4, abs=0.0) or float(number["data-factor"]) or value == 0
    return {number["data-key"] for number, _ in page.numbers}


@pytest.fixture(scope="session")
def walked_run(run_directory: Callable[..., Path], once: Once) -> Path:
    """A run of two walkers, whose case calls itself something hostile."""

    def make(folder: Path) -> None:
        settings = {"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20}
        shutil.copytree(run_directory(dimers={"replicates": 2}, run=settings), folder / "run")
        case, manifest = folder / "run" / "case.json", folder / "run" / "manifest.json"
        case.write_text(json.dumps({**json.loads(case.read_text()), "title": HOSTILE}))
        listed = json.loads(manifest.read_text())
        listed["sha256"]["case.json"] = hashlib.sha256(case.read_bytes()).hexdigest()
        manifest.write_text(json.dumps(listed))

    return once("hostile", make) / "run"


@pytest.fixture(scope="session")
def walked_report(walked_run: Path, once: Once) -> Path:
    return once("walked-report", lambda folder: report_run(walked_run, folder / "report.html")) / "report.html"


@pytest.fixture(scope="session")
def pile_run(once: Once) -> Path:
    (directory,) = once("piles", lambda out: walkers.run(small(run=HALF), out)).glob("pile-ci-*")
    return directory


@pytest.fixture(scope="session")
def pile_report(pile_run: Path, once: Once) -> Path:
    """Asked for by the run's name in the folder of the runs."""
    return (
        once("pile-report", lambda to: walkers.report(pile_run.name, to / "report.html", pile_run.parent))
        / "report.html"
    )


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
def swept_report(swept: Path, once: Once) -> Path:
    """Asked for by the sweep's name in the folder of the runs."""
    return once("swept-report", lambda to: walkers.report(swept.name, to / "report.html", swept.parent)) / "report.html"


@pytest.mark.parametrize("name", ["walked", "pile"])
def test_every_number_of_a_report_is_the_results(name: str, request: pytest.FixtureRequest) -> None:
    path, directory = (request.getfixturevalue(f"{name}_{what}") for what in ("report", "run"))
    result = current_result(directory)
    keys = check_numbers(Page(path), result)
    wanted = {"walked": {"velocity.mean", "velocity.standard_error", "rotation.bead_2", "orientation_end.largest"}}
    wanted["pile"] = {"surface.end", "brazil_nut.end", "coordination.rest.contacts", "beads", "driven"}
    assert wanted[name] <= keys
    assert path.stat().st_size < LARGEST


def test_parameters_say_where_they_come_from(walked_report: Path, walked_run: Path) -> None:
    words = Page(walked_report).words
    assert f"Written by granular-walkers {software().version}." in words
    origins = walkers.find_run(walked_run).case.origins
    assert len(origins) > 20
    for one in origins:
        assert one.key in words
        assert one.text in words
    for said in ("given", "library", "default"):
        assert said in words


@pytest.mark.parametrize("name", ["walked_report", "swept_report"])
def test_a_users_words_are_words(name: str, request: pytest.FixtureRequest) -> None:
    path = request.getfixturevalue(name)
    page = Page(path)
    assert page.title == HOSTILE
    assert HOSTILE in page.words
    assert not any("hostile" in script for script in page.scripts)
    assert html.escape(HOSTILE, quote=False).split()[0] in path.read_text("utf-8")


@pytest.mark.parametrize("name", ["walked_report", "pile_report", "swept_report"])
def test_a_report_refers_to_nothing_outside(name: str, request: pytest.FixtureRequest) -> None:
    path = request.getfixturevalue(name)
    page = Page(path)
    assert all(one.startswith(("#", "data:")) for one in page.references), page.references
    text = path.read_text("utf-8")
    packed = dict(re.findall(r'<script type="text/plain" id="([^"]+)">([^<]+)</script>', text))
    assert {"library-k3d", "library-bokeh"} < set(packed)
    library = zlib.decompress(base64.b64decode(packed["library-k3d"])).decode()
    assert "url(fonts/" not in library.split("sourcesContent")[0]
    assert "<noscript>" in text
    for folder in {str(Path.home()), str(Path(__file__).parents[1]), str(path.parent)} - {"/"}:
        assert folder not in page.words


def test_a_sweeps_report_says_which_runs_it_leaves_out(swept: Path, swept_report: Path, tmp_path: Path) -> None:
    page = Page(swept_report)
    assert {"#point-0", "#point-1", "#point-2"} < set(page.references)
    assert "left out" not in page.words
    table = load(swept)
    shown = {float(number["value"]) for number, _ in page.numbers}
    assert set(table["velocity"]) < shown
    carried = dict(re.findall(r'id="((?:scene|plots)-[^"]+)">([^<]+)<', swept_report.read_text("utf-8")))
    one = sum(len(value) for name, value in carried.items() if name.endswith("point-0"))
    rest = swept_report.stat().st_size - overhead() - sum(map(len, carried.values()))
    # Room for two of three.
    limit = overhead() + len(carried["plots-sweep"]) + int(2.5 * one) + rest
    less = report_sweep(swept, tmp_path / "less.html", largest=limit)
    assert less.stat().st_size < limit < swept_report.stat().st_size
    page = Page(less)
    assert "#point-1" not in page.references
    assert {"#point-0", "#point-2"} < set(page.references)
    assert re.search(r"left out, .*:\s+1\.", page.words)
    assert set(table["velocity"]) < {float(number["value"]) for number, _ in page.numbers}


def test_the_scene_is_the_motion(walked_run: Path) -> None:
    """Each bead of the scene is where the motion has it, turned as its spins turned it, to the scene's 0.1 µm."""
    motion = gathered(read_motion(walked_run), lane=1.25).driven
    scene = scene_of(walked_run)
    beads = [one for one in scene.plot.objects if one.name.startswith("bead")]
    assert len(beads) == len(motion.radius) == 4
    assert (scene.begin, scene.end) == (motion.time[0], motion.time[-1])
    across = np.cross([0.0, 0.0, 1.0], motion.case.drive_axis)
    rotation = current_result(walked_run)["rotation"]
    settled = motion.case.run.settling_cycles * motion.case.run.samples_per_cycle
    seconds = motion.time[-1] - motion.time[settled]
    rolled: dict[int, list[float]] = {0: [], 1: []}
    for number, ball in enumerate(beads):
        matrices = np.array(list(ball.model_matrix.values()), dtype=float)
        assert [float(time) for time in ball.model_matrix] == pytest.approx(motion.time, abs=1e-6)
        np.testing.assert_allclose(matrices[:, :3, 3], 1e3 * motion.position[:, number], atol=1e-4)
        turned = Rotation.from_matrix(matrices[[settled, -1], :3, :3] / (1e3 * motion.radius[number]))
        way = motion.walkers[number // 2].facing * float((turned[1] * turned[0].inv()).as_rotvec() @ across)
        rolled[number % 2].append(way * motion.radius[number] / seconds)
    for bead, key in enumerate(("bead_1", "bead_2")):
        assert np.mean(rolled[bead]) == pytest.approx(rotation[key], rel=0.01, abs=2e-6)


def test_words_and_numbers() -> None:
    """Numbers have the digits that their errors leave; a liquid without a name is not named."""
    given = [(1.38173201, 4.9e-5), (1.38173201, 0.31), (1234.5678, 20.0), (0.0012345678,), (6,)]
    assert [rounded(*one) for one in given] == ["1.381732", "1.38", "1235", "0.001235", "6"]
    case = make_case()
    assert "glass, Si AK5; 80 Hz" in summary_of(case)
    assert "glass; 80 Hz" in summary_of(replace(case, liquid=replace(case.liquid, name=None)))


def test_a_scene_without_gravity_is_seen_as_the_floor_lies(walked_run: Path) -> None:
    motion = read_motion(walked_run)
    weightless = replace(motion, case=replace(motion.case, gravity=0.0))
    assert cameras_of(weightless) == cameras_of(motion)
    np.testing.assert_allclose(camera_axes(weightless), camera_axes(motion))


def test_long_runs_are_thinned_out_and_say_so(walked_run: Path, pile_run: Path) -> None:
    scene = scene_of(walked_run, places=200)
    beads = [one for one in scene.plot.objects if one.name.startswith("bead")]
    assert sum(len(one.model_matrix) for one in beads) <= 200
    assert any("are shown" in caption or "is shown" in caption for caption in scene.captions)
    pile = scene_of(pile_run)
    points = next(one for one in pile.plot.objects if one.name == "beads")
    motion = read_motion(pile_run).driven
    np.testing.assert_allclose(points.positions[f"{motion.time[-1]:.6f}"], 1e3 * motion.position[-1], atol=1e-3)
    assert any("do not show how they roll" in caption for caption in pile.captions)


@pytest.mark.parametrize("to", ["report.txt", "folder.html", "nowhere/report.html"])
def test_a_report_that_has_no_place_is_refused(to: str, walked_run: Path, tmp_path: Path) -> None:
    (tmp_path / "folder.html").mkdir()
    told = call("report", str(walked_run), "--to", str(tmp_path / to))
    assert (told.returncode, told.stdout, told.stderr.count("\n")) == (2, "", 1)
    assert told.stderr.startswith("walkers: --to: ")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.html"]


def test_the_command_finds_what_a_name_means(walked_run: Path, swept: Path, tmp_path: Path) -> None:
    for what in (str(walked_run), swept.name):
        to = tmp_path / "report.html"
        told = call("report", what, "--out", str(swept.parent), "--to", str(to), check=True)
        assert told.stdout == f"{to}\n"
        assert HOSTILE in Page(to).words
    nothing = call("report", str(tmp_path), "--to", str(to))
    assert (nothing.returncode, nothing.stderr.count("\n")) == (2, 1)
    assert "not a finished run" in nothing.stderr


def test_a_calibration_and_its_report(tmp_path: Path) -> None:
    """Two parameters, two speeds, four sets of two cycles: nothing to be believed, and the report says so."""
    file = tmp_path / "small.toml"
    given: dict[str, Any] = {
        "title": HOSTILE,
        "case": "fig1b",
        "set": {"dimers": {"replicates": 1}, "run": {"cycles": 3, "settling_cycles": 1, "samples_per_cycle": 8}},
        "parameters": {
            "friction": {"keys": ["contact.friction.bead_wall", "contact.friction.bead_bead"], "range": [0.08, 0.2]},
            "drag": {"keys": ["liquid.viscosity_ratio"], "range": [0.5, 2.0]},
        },
        "experiments": {"slow": {"drive.peak_acceleration": "3 g"}, "fast": {"drive.peak_acceleration": "6 g"}},
        "design": {"waves": [4], "predictive": 2, "points": 100},
    }
    lines = "".join(
        f'[[observations]]\nname = "{name}"\ngroup = "v"\nof = ["{name}"]\n'
        f'value = "{speed} mm/s"\ndeviation = "0.3 mm/s"\n'
        for name, speed in (("slow", 1), ("fast", 3))
    )
    file.write_text(to_toml(given) + lines)
    call("calibrate", str(file), "--out", str(tmp_path / "runs"), check=True)
    to = tmp_path / "report.html"
    told = call("report", "small", "--out", str(tmp_path / "runs"), "--to", str(to), check=True)
    assert told.stdout == f"{to}\n"
    record = json.loads((tmp_path / "runs" / "small" / "calibration.json").read_text())
    page = Page(to)
    keys = check_numbers(page, record)
    assert {"best.friction", "intervals.drag.1", "observations.0.value", "observations.1.emulator"} <= keys
    assert page.title == HOSTILE
    assert HOSTILE in page.words
    assert sum(one.startswith("data:image/png;base64,") for one in page.references) == 3
    assert "contact.friction.bead_wall, contact.friction.bead_bead" in page.words
    assert record["posterior"]["converged"] or "has not converged" in page.words
    assert to.stat().st_size < LARGEST
    # What is no calibration any more is told in a line.
    (tmp_path / "runs" / "small" / "calibration.json").write_text("{}")
    with pytest.raises(walkers.inputs.InputError, match="no calibration that can be shown"):
        report_calibration(tmp_path / "runs" / "small", to)


def test_runs_show_themselves(walked_run: Path, tmp_path: Path) -> None:
    """In a notebook: a table that is the result, the parameters, and the pictures that were drawn."""
    run = walkers.find_run(walked_run)
    shown = tmp_path / "shown.html"
    shown.write_text(run._repr_html_(), "utf-8")
    assert "velocity.mean" in check_numbers(Page(shown), run.result)
    assert "<details>" in shown.read_text("utf-8")
    pictures = run.plot(tmp_path)
    assert pictures == [tmp_path / "walk.png", tmp_path / "gait.png"]
    sources = re.findall(r'src="data:image/png;base64,([^"]+)"', pictures._repr_html_())
    assert [base64.b64decode(source) for source in sources] == [path.read_bytes() for path in pictures]


def test_progress_is_shown_where_it_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case = make_case(run={"cycles": 8, "settling_cycles": 2}, drive={"frequency": "83 Hz"})
    walkers.run(case, tmp_path, progress=False, force=True)
    assert capsys.readouterr().err == ""
    seen: list[float] = []
    walkers.run(case, tmp_path, progress=lambda progress: seen.append(progress.step), force=True)
    assert seen
    assert capsys.readouterr().err == ""


def test_units_of_a_table_are_those_that_one_reads() -> None:
    shown = {unit: number_of({"a": 0.25}, "a", unit) for unit in ("m", "m/s", "rad", "share")}
    assert {unit: (one.text, one.unit) for unit, one in shown.items() if one} == {
        "m": ("250", "mm"),
        "m/s": ("250", "mm/s"),
        "rad": ("14.32", "°"),
        "share": ("25", "%"),
    }
