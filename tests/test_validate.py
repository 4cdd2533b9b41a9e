"""Verdicts of checks, which must be able to fail; bridge laws, benchmarks, engine reports."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import chdir
from dataclasses import replace
from math import cos, inf, nan, pi
from pathlib import Path

import numpy as np
import pytest

from studies.literature import checks, experiments
from studies.literature.benchmarks import TESTS, largest_difference, published
from studies.literature.bridges import LAWS, pulls
from tests.conftest import call
from walkers.arrays import FloatArray
from walkers.inputs.reading import load_case
from walkers.physics.capillary import derjaguin_radius
from walkers.postprocess.measure.motion import Motion
from walkers.runner.failures import EngineFailure
from walkers.runner.process import ALONE
from walkers.second_engine.crosscheck import divergence_lines
from walkers.second_engine.lines import Line, Verdict, as_dict, failures, lines_text


def verdicts_of(lines: Iterable[Line]) -> list[Verdict]:
    return [line.verdict for line in lines]


def published_points(panel: str) -> FloatArray:
    """Points that were read off the first curve of a published panel: x and y, shape (n, 2)."""
    points: FloatArray = published()[panel]["series"][0]["points"]
    return points


def test_published_points_of_an_elastic_impact_have_the_peak_of_hertz() -> None:
    """Two glass spheres that approach at 20 m/s; the curve is in kN."""
    peak = published_points("glass")[:, 1].max() * 1e3
    assert peak == pytest.approx(TESTS["1: glass"].impact.peak_force(20.0), rel=5e-3)


def test_published_points_of_spheres_that_slide_are_those_of_coulomb() -> None:
    """Friction changes the sliding velocity by 7/2 μ(1 + e)v at the most, and the sphere slides on.

    x is this over the sliding velocity before, and y the reverse velocity after, over the same.
    """
    points = published_points("spin")
    sliding = points[points[:, 0] < 1.0]
    assert sliding[:, 1] == pytest.approx(sliding[:, 0] - 1.0, abs=0.02)


def test_published_points_of_steep_impacts_are_those_of_coulomb() -> None:
    """Tangential restitution 1 - μ(1 + e)/tan θ of aluminium oxide: μ = 0.092, e = 0.98."""
    points = published_points("oxide-restitution")
    steep = points[points[:, 0] >= 40.0]
    restitution = 1.0 - 0.092 * 1.98 / np.tan(np.radians(steep[:, 0]))
    assert steep[:, 1] == pytest.approx(restitution, abs=5e-3)


@pytest.mark.parametrize("law", ["Rabinovich 2005", "Lambert 2008"])
@pytest.mark.parametrize("radius_2", [1.0, 0.5, inf])
def test_laws_have_derjaguins_limit(law: str, radius_2: float) -> None:
    """A small bridge at contact has the force 2πγR cos θ, where R is Derjaguin's radius.

    The other laws are polynomials in ln V that end at larger volumes.
    """
    radius = derjaguin_radius(1.0, radius_2)
    pull = LAWS[law].pull(1.0, radius_2, 1e-6 * radius**3, 0.3, np.zeros(1))[0]
    assert pull == pytest.approx(2.0 * pi * radius * cos(0.3), rel=0.05)


@pytest.fixture(scope="module")
def bridge_lines() -> dict[str, Line]:
    """Lines of the check of published bridge laws, by quantity."""
    return {line.quantity: line for line in pulls()}


def test_the_fit_of_willett_is_within_its_published_error(bridge_lines: dict[str, Line]) -> None:
    """Four of the lines are judged; the other laws are only shown."""
    verdicts = Counter(verdicts_of(bridge_lines.values()))
    assert verdicts == {Verdict.PASS: 4, Verdict.NOT_JUDGED: 44}


@pytest.mark.parametrize(("pair", "ratio"), [("wall", 1.39), ("beads", 0.99)])
def test_the_law_of_soulie_is_too_strong_at_walls(
    bridge_lines: dict[str, Line], pair: str, ratio: float
) -> None:
    """Of the work that breaks a bridge, over that of a solution of the Young–Laplace equation."""
    line = bridge_lines[f"Soulié 2006, fig1b, {pair}: work over Young–Laplace"]
    assert line.measured == pytest.approx(ratio, abs=0.01)


def test_benchmarks_pass_and_a_check_that_cannot_be_computed_leaves_the_others(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(out: Path) -> None:
        raise EngineFailure("no engine here")

    monkeypatch.setitem(checks.LITERATURE, "crosscheck", fail)
    done = call("benchmarks", "crosscheck", "--json", study="studies.literature")
    assert done.returncode == 1
    contents = json.loads(done.stdout)
    assert contents["passed"] is False
    *benchmarks, crosscheck = contents["lines"]
    assert len(benchmarks) > 55
    assert {line["verdict"] for line in benchmarks} == {"pass"}
    assert crosscheck["check"] == "crosscheck"
    assert crosscheck["verdict"] == "ERROR"
    assert "no engine here" in crosscheck["quantity"]


def test_experiments_of_others_about_a_thrown_bead_pass(bench: experiments.Bench) -> None:
    assert verdicts_of(experiments.thrown_bead(bench)) == [Verdict.PASS, Verdict.PASS]


def test_experiments_of_others_about_a_wet_incline_pass(bench: experiments.Bench) -> None:
    assert verdicts_of(experiments.incline(bench)) == [Verdict.PASS] * 5


def test_experiments_of_others_about_the_drift_of_a_dry_bead_are_as_modelled(
    bench: experiments.Bench,
) -> None:
    """At one phase of the second tone, 60°."""
    drift = experiments.measured_drift(bench, 60.0)
    assert drift == pytest.approx(experiments.coulomb_drift(60.0), abs=5e-3)


@pytest.fixture(scope="module")
def impact_lines(tmp_path_factory: pytest.TempPathFactory) -> list[Line]:
    """Lines of the experiment about impacts on a wet plate."""
    with chdir(tmp_path_factory.mktemp("impacts")), experiments.workbench() as bench:
        return list(experiments.impacts(bench))


def test_restitution_on_a_wet_plate_falls_with_the_drag(impact_lines: list[Line]) -> None:
    """The first two lines are judged: the law against the Stokes number, and its critical one."""
    verdicts = verdicts_of(impact_lines)
    assert verdicts[:2] == [Verdict.PASS, Verdict.PASS]
    assert set(verdicts[2:]) == {Verdict.NOT_JUDGED}


def test_restitution_on_a_wet_plate_is_told_with_the_stokes_number(
    impact_lines: list[Line],
) -> None:
    """St = m/(6πηR²) v = 332 of a bead of 2.75 mm and 2.5 g/cm³ in a liquid of 4.6 mPa s."""
    for line in impact_lines[-3:]:
        assert line.quantity.count("St = 332") == 1


def test_restitution_on_a_wet_plate_of_a_softened_bead_is_too_small(
    impact_lines: list[Line],
) -> None:
    softened = impact_lines[-1]
    assert softened.measured < 0.5 * softened.expected


def test_a_symmetric_dimer_drifts_by_tones_2_to_3_only(in_folder: Path) -> None:
    """It drifts at 0.0634 mm/s, and with half the time step at 0.0635.

    By Coulomb's law without edges, it drifts at 0.36 mm/s.
    """
    drift, *judged = experiments.symmetry(Path("runs"))
    assert drift.measured == pytest.approx(0.0634, rel=0.01)
    assert verdicts_of(judged) == [Verdict.PASS, Verdict.PASS]


@pytest.fixture
def twice_the_friction(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dry beads of the experiments have twice the friction of the models."""
    monkeypatch.setitem(experiments._DRY, "contact.friction.bead_wall", 2.0 * experiments.FRICTION)


def test_a_thrown_bead_with_twice_the_friction_rolls_too_soon(
    twice_the_friction: None, bench: experiments.Bench
) -> None:
    """The speed at which it rolls, 5/7 of that of the throw, does not depend on friction."""
    speed, time = experiments.thrown_bead(bench)
    assert speed.verdict is Verdict.PASS
    assert time.verdict is Verdict.FAIL


def test_a_dry_bead_with_twice_the_friction_does_not_drift_as_modelled(
    twice_the_friction: None, bench: experiments.Bench
) -> None:
    difference = experiments.measured_drift(bench, 90.0) - experiments.coulomb_drift(90.0)
    assert np.abs(difference).max() > 0.05


GOOD = Line("good", 1.0, 1.05, 0.1)
BAD = Line("bad", 1.0, 1.2, 0.1, check="second")


@pytest.mark.parametrize(
    ("line", "verdict"),
    [
        pytest.param(GOOD, Verdict.PASS, id="5 % off, of 10"),
        pytest.param(BAD, Verdict.FAIL, id="20 % off, of 10"),
        pytest.param(replace(GOOD, measured=nan), Verdict.FAIL, id="no number"),
        # Beside 0 the tolerance is absolute.
        pytest.param(replace(GOOD, expected=0.0, measured=0.2), Verdict.FAIL, id="0.2 off 0"),
        # 0.2 of a scale of 10 are 2 %.
        pytest.param(replace(BAD, scale=10.0), Verdict.PASS, id="2 % of the scale"),
        pytest.param(replace(BAD, tolerance=inf), Verdict.NOT_JUDGED, id="no tolerance"),
        pytest.param(replace(GOOD, decided=Verdict.FAIL), Verdict.FAIL, id="decided"),
    ],
)
def test_the_verdict_of_a_line(line: Line, verdict: Verdict) -> None:
    assert line.verdict is verdict


def test_one_failed_line_fails_all_checks() -> None:
    lines = (GOOD, replace(GOOD, check="second"), BAD)
    assert failures(lines) == [BAD]
    assert as_dict(lines)["passed"] is False
    assert lines_text(lines[1:], "engine: ").splitlines()[-1] == "engine: 1 of 2 lines fail"


def test_checks_pass_if_all_their_lines_do() -> None:
    assert as_dict([GOOD])["passed"] is True
    assert lines_text([GOOD]).endswith("\nall 1 lines pass")


RADII = np.array([0.6e-3, 0.3e-3, 0.6e-3])
CYCLES = np.array([0.0, 0.25, 0.5, 1.5])


@pytest.fixture
def resting_pile() -> Motion:
    """Three beads of a pile, 1 mm apart and at rest, at the `CYCLES` of its drive."""
    case = load_case("pile-ci")
    number = len(CYCLES)
    zero = np.zeros((number, 3, 3))
    return Motion(
        case=case,
        time=CYCLES / case.excitation.frequency,
        position=zero + 1e-3 * np.arange(3.0)[:, None],
        velocity=zero,
        spin=zero,
        substrate=zero[:, 0],
        radius=RADII,
        walkers=(),
        frames=[(Path("s"), 0)] * number,
        truncated=False,
    )


def moved_from(motion: Motion, frame: int) -> Motion:
    """That motion with its second bead 1.1 % of the smallest radius aside from a frame on."""
    position = motion.position.copy()
    position[frame:, 1, 0] += 0.011 * RADII.min()
    return replace(motion, position=position)


@pytest.mark.parametrize(
    ("frame", "cycle", "fails"), [(2, 0.5, True), (3, 1.5, False), (4, 1.5, False)]
)
def test_a_pile_fails_if_a_bead_leaves_its_motion_in_the_first_cycle(
    resting_pile: Motion, frame: int, cycle: float, fails: bool
) -> None:
    """Frame 2 is at 0.5 cycles, frame 3 at 1.5 cycles; from frame 4 on, there is none."""
    together, _ = divergence_lines(resting_pile, moved_from(resting_pile, frame))
    assert together.expected == pytest.approx(1.5)
    assert together.measured == pytest.approx(cycle)
    assert together.failed == fails


@pytest.mark.parametrize(("frame", "distance"), [(2, 3.3), (3, 3.3), (4, 0.0)])
def test_the_farthest_bead_of_a_pile_that_leaves_its_motion_is_not_judged(
    resting_pile: Motion, frame: int, distance: float
) -> None:
    """1.1 % of 0.3 mm are 3.3 µm."""
    _, farthest = divergence_lines(resting_pile, moved_from(resting_pile, frame))
    assert farthest.measured == pytest.approx(distance)
    assert not farthest.failed


def test_the_largest_difference_has_either_sign() -> None:
    line = largest_difference("x", np.array([0.01, -0.1, 0.02]), 0.05, np.arange(3.0))
    assert line.measured == -0.1
    assert line.verdict is Verdict.FAIL
    assert "at 1, " in line.quantity


def test_the_largest_difference_of_either_sign_may_be_within_the_tolerance() -> None:
    assert largest_difference("x", np.array([0.01, -0.04]), 0.05).verdict is Verdict.PASS


REPORTS = Path(__file__).resolve().parents[1] / "docs" / "engine-reports"
DEFAULT_PAGE = ("-var", "page", "100000", "-var", "one", "2000")
_RESULT = re.compile(r"^RESULT (.*)", re.MULTILINE)
_NUMBER = re.compile(r": (-?\d\S*?)(?=,|\s|$)")


def run_report(
    folder: Path, name: str, options: Sequence[str], *, buffered: bool
) -> subprocess.CompletedProcess[str]:
    """Run a deck by the engine as it is packaged: without a contact model of ours.

    Parameters
    ----------
    folder
        Where the deck runs.
    name
        Name of the deck.
    options
        Variables of the deck on the engine's command line.
    buffered
        Whether the engine's output is, as usual in a pipe; otherwise it is written line by line.
    """
    for suffix in ("lig", "stl", "vtk"):
        for file in REPORTS.glob(f"*.{suffix}"):
            shutil.copy(file, folder)
    environment = os.environ | ALONE
    environment.pop("LD_PRELOAD", None)
    command = ["liggghts", "-log", "none", *options, "-in", f"{name}.lig"]
    if not buffered:
        command = ["stdbuf", "-oL", *command]
    return subprocess.run(
        command,
        cwd=folder,
        check=False,
        env=environment,
        capture_output=True,
        text=True,
        errors="replace",
    )


@pytest.mark.parametrize("deck", sorted(REPORTS.glob("*.lig")), ids=lambda deck: deck.stem)
def test_reports_name_their_decks(deck: Path) -> None:
    assert f"({deck.stem}.lig)" in (REPORTS / "index.md").read_text("utf-8")


# Deck, options, and each number that it prints: what the formula says, what the engine gives.
@pytest.mark.parametrize(
    ("name", "options", "numbers"),
    [
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
    ],
)
def test_deck_gives_the_number_of_its_report(
    tmp_path: Path, name: str, options: tuple[str, ...], numbers: list[tuple[float, float]]
) -> None:
    """The engine is right within 0.3 %, or wrong by more than 10 %."""
    done = run_report(tmp_path, name, options, buffered=False)
    assert done.returncode == 0, done.stdout[-500:]
    measured = []
    for line in _RESULT.findall(done.stdout):
        measured += [float(number) for number in _NUMBER.findall(line)]
    for value, (by_formula, by_engine) in zip(measured, numbers, strict=True):
        assert value == pytest.approx(by_engine, rel=3e-3, abs=1e-7)
        if by_formula != by_engine:
            assert abs(value - by_formula) > 0.1 * abs(by_formula)


@pytest.mark.parametrize("buffered", [False, True], ids=["lines", "buffered"])
@pytest.mark.parametrize(
    ("name", "options", "status", "message", "reaches_a_pipe"),
    [
        ("abort-loses-its-message", (), 1, "Cannot open gzipped file", False),
        (
            "mesh-formats",
            (),
            1,
            "Expecting ASCII VTK mesh file, cannot continue (./src/input_mesh_tri.cpp:209)",
            True,
        ),
        (
            "mesh-formats",
            ("-var", "mesh", "floor-solid.stl"),
            1,
            "root causes: (a) mesh empty",
            True,
        ),
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
    ],
)
def test_deck_ends_as_its_report_says(
    tmp_path: Path,
    name: str,
    options: tuple[str, ...],
    *,
    status: int,
    message: str,
    reaches_a_pipe: bool,
    buffered: bool,
) -> None:
    """Some messages are lost in the buffer of a pipe when the engine aborts."""
    done = run_report(tmp_path, name, options, buffered=buffered)
    assert done.returncode == status
    assert (message in done.stdout) == (reaches_a_pipe or not buffered)
