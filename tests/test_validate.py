"""Verdicts of checks, which must be able to fail; laws of bridges, benchmarks and reports of the engine."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from math import cos, inf, pi
from pathlib import Path

import numpy as np
import pytest

from studies.literature import checks, experiments
from studies.literature.benchmarks import TESTS, largest_difference, published
from studies.literature.bridges import LAWS, pulls
from tests.conftest import call
from walkers.inputs.reading import load_case
from walkers.physics.capillary import derjaguin_radius
from walkers.postprocess.measure.motion import Motion
from walkers.runner.failures import EngineFailure
from walkers.runner.process import ALONE
from walkers.second_engine.crosscheck import divergence_lines
from walkers.second_engine.lines import Line, Verdict, as_dict, failures, lines_text


def test_the_published_points_are_those_of_the_tests() -> None:
    """Points read off lie on curves that are known without an engine: Hertz's peak, spheres that slide."""
    points = {key: panel["series"][0]["points"] for key, panel in published().items()}
    assert points["glass"][:, 1].max() * 1e3 == pytest.approx(
        TESTS["1: glass"].impact.peak_force(20.0), rel=5e-3
    )
    slides = points["spin"][points["spin"][:, 0] < 1.0]
    assert slides[:, 1] == pytest.approx(slides[:, 0] - 1.0, abs=0.02)
    steep = points["oxide-restitution"][points["oxide-restitution"][:, 0] >= 40.0]
    assert steep[:, 1] == pytest.approx(
        1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0])), abs=5e-3
    )


@pytest.mark.parametrize("law", ["Rabinovich 2005", "Lambert 2008"])
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: str, radius_2: float) -> None:
    """All but polynomials in ln V that end at larger volumes."""
    radius = derjaguin_radius(1.0, radius_2)
    pull = LAWS[law].pull(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


def test_published_laws_beside_young_laplace() -> None:
    """The fit of Willett et al. is within its published error; the law of Soulié et al. is too strong at walls."""
    lines = {line.quantity: line for line in pulls()}
    assert Counter(line.verdict for line in lines.values()) == {
        Verdict.PASS: 4,
        Verdict.NOT_JUDGED: 44,
    }
    assert lines["Soulié 2006, fig1b, wall: work over Young–Laplace"].measured == pytest.approx(
        1.39, abs=0.01
    )
    assert lines["Soulié 2006, fig1b, beads: work over Young–Laplace"].measured == pytest.approx(
        0.99, abs=0.01
    )


def test_benchmarks_pass_and_a_check_that_cannot_be_computed_leaves_the_others(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(out: Path) -> None:
        raise EngineFailure("no engine here")

    monkeypatch.setitem(checks.LITERATURE, "crosscheck", fail)
    done = call("benchmarks", "crosscheck", "--json", study="studies.literature")
    contents = json.loads(done.stdout)
    assert (done.returncode, contents["passed"]) == (1, False)
    *passed, failed = contents["lines"]
    assert {line["verdict"] for line in passed} == {"pass"}
    assert len(passed) > 55
    assert (failed["check"], failed["verdict"], "no engine here" in failed["quantity"]) == (
        "crosscheck",
        "ERROR",
        True,
    )


def test_experiments_of_others_pass_where_they_are_judged(in_folder: Path) -> None:
    """A bead that is thrown, one on a wet incline; and the drift of a dry bead at one phase."""
    with experiments.workbench() as bench:
        lines = [*experiments.thrown_bead(bench), *experiments.incline(bench)]
        assert experiments.measured_drift(bench, 60.0) == pytest.approx(
            experiments.coulomb_drift(60.0), abs=5e-3
        )
    assert {line.verdict for line in lines} == {Verdict.PASS}
    assert len(lines) == 7


def test_restitution_on_a_wet_plate_falls_with_the_drag(in_folder: Path) -> None:
    with experiments.workbench() as bench:
        straight, limit, *shown = experiments.impacts(bench)
    assert [straight.verdict, limit.verdict] == [Verdict.PASS, Verdict.PASS]
    assert {line.verdict for line in shown} == {Verdict.NOT_JUDGED}
    assert {line.quantity.count("St = 332") for line in shown[1:]} == {1}, (
        "m over 6πηR² v: 2.75 mm, 2.5 g/cm³, 4.6 mPa s"
    )
    assert shown[-1].measured < 0.5 * shown[-1].expected, "a softened bead loses more"


def test_a_symmetric_dimer_drifts_by_tones_2_to_3_only(in_folder: Path) -> None:
    drifts, *judged = experiments.symmetry(Path("runs"))
    assert abs(drifts.measured) > 0.1
    assert [line.verdict for line in judged] == [Verdict.PASS, Verdict.PASS]


def test_experiments_fail_with_twice_the_friction(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The speed of rolling does not depend on it."""
    monkeypatch.setitem(experiments._DRY, "contact.friction.bead_wall", 2.0 * experiments.FRICTION)
    with experiments.workbench() as bench:
        assert [line.verdict for line in experiments.thrown_bead(bench)] == [
            Verdict.PASS,
            Verdict.FAIL,
        ]
        assert (
            np.abs(experiments.measured_drift(bench, 90.0) - experiments.coulomb_drift(90.0)).max()
            > 0.05
        )


GOOD, BAD = Line("good", 1.0, 1.05, 0.1), Line("bad", 1.0, 1.2, 0.1, check="second")


def test_one_failed_line_fails_all_checks() -> None:
    for line, verdict in (
        (GOOD, Verdict.PASS),
        (BAD, Verdict.FAIL),
        (replace(GOOD, measured=float("nan")), Verdict.FAIL),
        (replace(GOOD, expected=0.0, measured=0.2), Verdict.FAIL),
        (replace(BAD, scale=10.0), Verdict.PASS),
        (replace(BAD, tolerance=inf), Verdict.NOT_JUDGED),
        (replace(GOOD, decided=Verdict.FAIL), Verdict.FAIL),
    ):
        assert line.verdict is verdict
    lines = (GOOD, replace(GOOD, check="second"), BAD)
    assert (as_dict(lines)["passed"], as_dict(lines[:1])["passed"], failures(lines)) == (
        False,
        True,
        [BAD],
    )
    assert lines_text(lines[1:], "engine: ").splitlines()[-1] == "engine: 1 of 2 lines fail"
    assert lines_text(lines[:1]).endswith("\nall 1 lines pass")


def _pile(cycles: list[float]) -> Motion:
    """Three beads of a pile at rest, at some cycles of its drive."""
    case, frames = load_case("pile-ci"), len(cycles)
    still = np.zeros((frames, 3, 3))
    position = still + 1e-3 * np.arange(3.0)[:, None]
    time = np.array(cycles) / case.excitation.frequency
    radius = np.array([0.6e-3, 0.3e-3, 0.6e-3])
    parts = [(Path("s"), 0)] * frames
    return Motion(
        case, time, position, still, still, still[:, 0], radius, (), parts, truncated=False
    )


@pytest.mark.parametrize(("away", "cycle"), [(2, 0.5), (3, 1.5), (4, 1.5)])
def test_a_pile_fails_if_a_bead_leaves_its_motion_in_the_first_cycle(
    away: int, cycle: float
) -> None:
    """By 1.1 % of the smallest radius, one bead of three."""
    first = _pile([0.0, 0.25, 0.5, 1.5])
    moved = first.position.copy()
    moved[away:, 1, 0] += 0.011 * 0.3e-3
    together, farthest = divergence_lines(first, replace(first, position=moved))
    assert (together.expected, together.measured) == pytest.approx((1.5, cycle))
    assert farthest.measured == pytest.approx(0.0 if away == 4 else 3.3)
    assert together.failed == (cycle == 0.5)
    assert not farthest.failed


def test_the_largest_difference_has_either_sign() -> None:
    line = largest_difference("x", np.array([0.01, -0.1, 0.02]), 0.05, np.arange(3.0))
    assert (line.measured, line.verdict, "at 1, " in line.quantity) == (-0.1, Verdict.FAIL, True)
    assert largest_difference("x", np.array([0.01, -0.04]), 0.05).verdict is Verdict.PASS


REPORTS = Path(__file__).resolve().parents[1] / "docs" / "engine-reports"
DEFAULT_PAGE = ("-var", "page", "100000", "-var", "one", "2000")
_RESULT = re.compile(r"^RESULT (.*)", re.MULTILINE)
_NUMBER = re.compile(r": (-?\d\S*?)(?=,|\s|$)")


# Deck, options, and each number that it prints: what the formula says, what the engine gives.
NUMBERS = [
    ("coulomb-limit", (), [(0.5, 0.5), (1.0, 1.140)]),
    ("coulomb-limit", ("-var", "e", "0.3"), [(0.3, 0.3), (1.0, 1.358)]),
    ("wall-takes-a-strangers-velocity", (), [(1.0, -2.0), (1.0, 0.0)]),
    ("contact-angle", (), [(30.0, 7.854)]),
    ("page-second-run", (), [(1.0, 0.0)]),
    ("page-second-run", DEFAULT_PAGE, [(1.0, 1.0)]),
    ("page-write-restart", (), [(1.0, 1.0), (1.0, 0.0)]),
    ("page-write-restart", DEFAULT_PAGE, [(1.0, 1.0), (1.0, 1.0)]),
    ("delete-atoms", (), [(1.0, 0.0)]),
    ("delete-atoms", ("-var", "compress", "no"), [(1.0, 1.0)]),
    ("washino-wall", (), [(1.0, 1.0), (1.0, 0.0)]),
    ("wall-is-a-sphere", (), [(1.0, 0.435), (1.0, 0.25)]),
    ("mesh-formats", ("-var", "mesh", "floor-binary.stl"), [(1.0, 1.0)]),
    ("mesh-triangles", (), [(1.0, 1.0)]),
    (
        "liquid-content",
        (),
        [(88.85e-6, 412.4e-6), (88.85e-6, 88.85e-6), (1.0, 100.0 ** (1.0 / 3.0))],
    ),
]


# Deck, options, exit status, a part of its message, and whether the message reaches a pipe.
ENDS = [
    ("abort-loses-its-message", (), 1, "Cannot open gzipped file", False),
    (
        "mesh-formats",
        (),
        1,
        "Expecting ASCII VTK mesh file, cannot continue (./src/input_mesh_tri.cpp:209)",
        True,
    ),
    ("mesh-formats", ("-var", "mesh", "floor-solid.stl"), 1, "root causes: (a) mesh empty", True),
    (
        "mesh-triangles",
        ("-var", "mesh", "duplicate.stl"),
        1,
        "(lines 9 and 2) are duplicate",
        False,
    ),
    (
        "mesh-triangles",
        ("-var", "mesh", "sliver.stl"),
        1,
        "(line 9) is lower than the specified curvature",
        False,
    ),
    (
        "mesh-triangles",
        (),
        0,
        "WARNING: Mesh floor: proc 0 has 1 element pairs that are coplanar",
        True,
    ),
]


def _run_report(
    folder: Path, name: str, options: Sequence[str], *, buffered: bool
) -> subprocess.CompletedProcess[str]:
    """Run a deck by the engine as it is packaged: without a contact model of ours."""
    for kind in ("lig", "stl", "vtk"):
        for file in REPORTS.glob(f"*.{kind}"):
            shutil.copy(file, folder)
    environment = {
        name: value for name, value in os.environ.items() if name != "LD_PRELOAD"
    } | ALONE
    command = [
        *(() if buffered else ("stdbuf", "-oL")),
        "liggghts",
        "-log",
        "none",
        *options,
        "-in",
        f"{name}.lig",
    ]
    how = {"env": environment, "capture_output": True, "text": True, "errors": "replace"}
    return subprocess.run(command, cwd=folder, check=False, **how)


def test_reports_name_their_decks() -> None:
    assert all(
        f"({deck.stem}.lig)" in (REPORTS / "index.md").read_text("utf-8")
        for deck in REPORTS.glob("*.lig")
    )


@pytest.mark.parametrize(("name", "options", "numbers"), NUMBERS)
def test_deck_gives_the_number_of_its_report(
    tmp_path: Path, name: str, options: tuple[str, ...], numbers: list[tuple[float, float]]
) -> None:
    done = _run_report(tmp_path, name, options, buffered=False)
    assert done.returncode == 0, done.stdout[-500:]
    measured = [
        float(number) for line in _RESULT.findall(done.stdout) for number in _NUMBER.findall(line)
    ]
    for value, (expected, stated) in zip(measured, numbers, strict=True):
        assert value == pytest.approx(stated, rel=3e-3, abs=1e-7)
        assert expected == stated or abs(value - expected) > 0.1 * abs(expected)


@pytest.mark.parametrize(("name", "options", "status", "message", "heard"), ENDS)
def test_deck_ends_as_its_report_says(
    tmp_path: Path, name: str, options: tuple[str, ...], status: int, message: str, heard: bool
) -> None:
    for buffered in (False, True):
        done = _run_report(tmp_path, name, options, buffered=buffered)
        assert (done.returncode, message in done.stdout) == (status, heard or not buffered)
