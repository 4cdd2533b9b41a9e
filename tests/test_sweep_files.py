"""Sweep files: what may be varied and how, and what is said of one that makes no sense."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from tests.conftest import document, to_toml
from walkers.errors import InputError
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.inputs.sweep import Sweep, expand, load_sweep
from walkers.postprocess import meetings

Make = Callable[..., Sweep]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Expand a sweep over the reference case, which says everything that a case may say in other words too."""
    (tmp_path / "base.toml").write_text(to_toml(document()))

    def expanded(**tables: Any) -> Sweep:
        return expand({"case": "base.toml", **tables}, source="test.toml", name="test", folder=tmp_path)

    return expanded


def _cases(sweep: Sweep) -> list[Case]:
    return list(sweep.cases())


def test_axes_multiply_and_the_last_runs_fastest(make: Make) -> None:
    sweep = make(axes={"drive": {"frequency": ["60 Hz", "80 Hz"], "peak_acceleration": ["1 g", "2 g", "4 g"]}})
    found = [(case.excitation.frequency, case.excitation.peak_acceleration) for case in _cases(sweep)]
    assert found == [(f, pytest.approx(9.8 * a)) for f in (60.0, 80.0) for a in (1, 2, 4)]
    assert [*sweep.units.values()] == ["Hz", "g"]
    assert _cases(sweep)[1].title == "test: drive.frequency = 60 Hz, drive.peak_acceleration = 2 g"
    dotted = make(axes={"drive.frequency": ["60 Hz", "80 Hz"], "drive.peak_acceleration": ["1 g", "2 g", "4 g"]})
    assert (dotted.keys, dotted.rows) == (sweep.keys, sweep.rows)


def test_linspace_and_geomspace_are_numpys(make: Make) -> None:
    sweep = make(
        axes={
            "drive.peak_acceleration": {"linspace": ["0.5 g", "10 g", 20]},
            "liquid.volume_fraction": {"geomspace": [1e-3, 1e-1, 5]},
        }
    )
    cases = _cases(sweep)
    assert len(cases) == 100
    assert sweep.rows[1][0] == "0.5 g"
    accelerations = np.array([case.excitation.peak_acceleration for case in cases[::5]]) / 9.8
    np.testing.assert_allclose(accelerations, np.linspace(0.5, 10, 20), rtol=1e-12)
    fractions = [case.liquid.volume_fraction for case in cases[:5]]
    np.testing.assert_allclose(fractions, np.geomspace(1e-3, 1e-1, 5), rtol=1e-11)
    whole = make(axes={"run.seed": {"linspace": [1, 4, 4]}, "run.cycles": {"geomspace": [10, 40, 3]}})
    assert whole.rows == [(seed, cycles) for seed in (1, 2, 3, 4) for cycles in (10, 20, 40)]


def test_one_key_at_a_time(make: Make) -> None:
    sweep = make(one_at_a_time={"run.seed": [3, 4], "drive": {"frequency": ["60 Hz", "90 Hz", "70 Hz"]}})
    assert sweep.keys == ("run.seed", "drive.frequency")
    assert sweep.rows == [(3, "60 Hz"), (4, "60 Hz"), (3, "90 Hz"), (3, "70 Hz")]


def test_zipped_keys_go_together(make: Make) -> None:
    pairs = [["0.3 mm", "0.2 mm"], ["0.4 mm", "0.2 mm"]]
    sweep = make(zip=[{"dimers.radii": pairs, "run": {"seed": [3, 4]}}], axes={"drive.frequency": ["60 Hz", "90 Hz"]})
    found = [(case.excitation.frequency, case.walkers[0].radii, case.run.seed) for case in _cases(sweep)]
    assert found == [(f, r, s) for f in (60.0, 90.0) for r, s in (((3e-4, 2e-4), 3), ((4e-4, 2e-4), 4))]


@pytest.mark.parametrize(
    ("method", "sampler"), [("sobol", qmc.Sobol), ("halton", qmc.Halton), ("latin-hypercube", qmc.LatinHypercube)]
)
def test_samplers_are_scipys_and_seeded(make: Make, method: str, sampler: type[qmc.QMCEngine]) -> None:
    ranges = {
        "contact.friction.bead_wall": {"uniform": [0.05, 0.3]},
        "liquid.volume_fraction": {"loguniform": [1e-3, 1e-1]},
    }
    sweep = make(sample=[{"method": method, "points": 8, "seed": 5, "ranges": ranges}])
    unit = sampler(d=2, rng=np.random.default_rng(5)).random(8)
    expected = np.stack([0.05 + 0.25 * unit[:, 0], 1e-3 * 100 ** unit[:, 1]], axis=1)
    np.testing.assert_allclose(np.array(sweep.rows, dtype=float), expected, rtol=1e-11)
    again = make(sample=[{"method": method, "points": 8, "seed": 6, "ranges": ranges}])
    assert again.rows != sweep.rows
    cases = _cases(make(sample=[{"points": 4, "ranges": {"dimers.radii[0]": {"uniform": ["0.3 mm", "0.4 mm"]}}}]))
    assert all(3e-4 <= case.walkers[0].radii[0] <= 4e-4 and case.walkers[0].radii[1] == 2e-4 for case in cases)


def test_a_key_that_says_the_same_in_other_words_gives_way(make: Make) -> None:
    (case,) = _cases(make(axes={"drive.gamma0": [0.5]}))
    assert dimer_of(case).gamma0(case.excitation.peak_acceleration) == pytest.approx(0.5)
    (case,) = _cases(make(set={"dimers.mean_radius": "0.25 mm"}, axes={"dimers.sin_delta": [0.2]}))
    assert case.walkers[0].radii == (3e-4, 2e-4)


def test_a_descent_is_the_last_axis_downward(make: Make) -> None:
    descend = {
        "key": "drive.peak_acceleration",
        "from": "0.5 g",
        "to": "0.2 g",
        "step": "0.1 g",
        "until_below": "1 um/s",
    }
    sweep = make(axes={"drive.frequency": ["60 Hz", "80 Hz"]}, descend=descend)
    assert [row[1] for row in sweep.rows] == ["0.5 g", "0.4 g", "0.3 g", "0.2 g"] * 2
    assert sweep.until_below == pytest.approx(1e-6)


def test_shipped_sweeps_are_the_papers() -> None:
    fig2 = _cases(load_sweep("fig2"))
    assert len(fig2) == 80
    assert {case.excitation.frequency for case in fig2} == {60.0, 70.0, 80.0, 90.0}
    accelerations = {round(case.excitation.peak_acceleration / 9.8, 9) for case in fig2}
    assert (min(accelerations), max(accelerations)) == (0.5, 10.0)
    fig3 = [(dimer_of(case), case.excitation.peak_acceleration) for case in load_sweep("fig3").cases()]
    assert [round(dimer.sin_delta, 3) for dimer, _ in fig3] == [0.0, 0.111, 0.143, 0.2, 0.273, 0.333]
    assert all(dimer.gamma0(peak) == pytest.approx(0.5) for dimer, peak in fig3)
    turned = _cases(load_sweep("alignment"))
    assert {round(np.degrees(case.walkers[0].angle)) for case in turned} == set(range(0, 91, 15))
    trays = [
        (one.walkers[0].replicates, meetings.derived(one)["coverage"]) for one in _cases(load_sweep("tray-phases"))
    ]
    assert len(trays) == 96
    assert {number for number, _ in trays} == {2, 16, 64}
    assert {coverage for _, coverage in trays} == {0.05, 0.14, 0.25}


BAD: list[tuple[dict[str, Any], str]] = [
    ({"axes": {"drive.frequncy": ["60 Hz"]}}, 'drive.frequncy: unknown key; .*did you mean "frequency"'),
    ({"axes": {"drive": ["60 Hz"]}}, "drive: is a table of a case"),
    ({"axes": {"drive.frequency": []}}, "drive.frequency = \\[\\]: expected at least one value"),
    ({"axes": {"drive.frequency": {"linspace": ["60 Hz", "90 Hz", 2.5]}}}, "first value, last value and number"),
    ({"axes": {"drive.frequency": {"linspace": ["60 Hz", "9 kHz", 3]}}}, "one unit throughout"),
    ({"axes": {"drive.frequency": {"linspace": ["fast", "90 Hz", 3]}}}, "expected a number"),
    ({"axes": {"liquid.volume_fraction": {"geomspace": [0, 1, 3]}}}, "above zero"),
    ({"axes": {"drive.frequency": ["60 Hz", "60 mHz"]}}, "one unit throughout"),
    ({"axes": {"dimers.radii[2]": ["1 mm"]}}, "no dimers.radii of that length"),
    ({"axes": {"run.seed": {"linspace": [1, 1000, 2000]}, "drive.frequency": {"linspace": ["60 Hz", "90 Hz", 999]}}},
     "1998000 points"),
    ({"axes": {"run.seed": [1]}, "zip": [{"run.seed": [1]}]}, "varies on two axes"),
    ({"zip": [{"run.seed": [1, 2], "dimers.angle": ["0 deg"]}]}, "as many values .*seed has 2, dimers.angle has 1"),
    ({"sample": [{"points": 4, "method": "sobbol", "ranges": {}}]}, 'did you mean "sobol"'),
    ({"sample": [{"points": 4, "ranges": {"run.seed": [1, 2]}}]}, "uniform"),
    ({"sample": [{"points": 4, "ranges": {}}]}, "keys and their ranges"),
    ({"sample": [{"points": 0, "ranges": {"contact.restitution": {"uniform": [0.1, 0.2]}}}]}, "at least 1"),
    ({"descend": {"from": "1 g", "to": "2 g", "step": "0.1 g", "until_below": "1 um/s"}}, "must not be below"),
    ({"descend": {"from": "1 g", "to": "0 g", "step": "fast", "until_below": "1 um/s"}}, "descend.step"),
    ({"descend": {"from": "1 g", "to": "0 g", "step": "0.1 g", "until_below": "1 um"}}, "descend.until_below.*speed"),
    ({"descend": {"from": float("inf"), "to": 0, "step": 1, "until_below": "1 um/s"}}, "descend.from = .*a number"),
    ({"descend": {"from": "1 g", "to": "0 g", "step": "1e-320 g", "until_below": "1 um/s"}}, "must not be below"),
    ({"axes": {"drive": {"frequency": ["60 Hz"]}, "drive.frequency": ["70 Hz"]}}, "drive.frequency: is given twice"),
    ({"axes": {"dimers.radii": [["0.3 mm", "0.2 mm"]], "dimers.radii[1]": ["0.1 mm"]}}, "radii.*varies on two axes"),
    ({"axes": {".": [1]}}, "is not a key of a case"),
    ({"case": ""}, 'case = "": no such file'),
    ({"sample": {"points": 4}}, r"sample = .*expected tables \[\[sample\]\]"),
    ({"axis": {}}, 'unknown key; a sweep takes .*did you mean "axes"'),
    ({"case": "fig1c"}, 'case = "fig1c": no such file, run or sweep, nor a shipped case .*did you mean "fig1b"'),
    ({"set": {"drive.frequncy": "60 Hz"}}, "drive.frequncy: unknown key"),
    ({"case": "."}, r'case = "\.": expected a case file, or the name of a shipped case'),
    ({"case": "./"}, r'case = "\./": expected a case file, or the name of a shipped case'),
    ({"set": {"dimers.radii[-1]": {}}}, r"dimers\.radii\[-1\]: unknown key"),
    ({"set": {"dimers": {}}}, "dimers: is a table of a case"),
    ({"axes": {"run.seed": {}}}, r"run\.seed = {}: expected a list of values"),
    *(({"axes": axes}, f"{key}: expected one of {key} and {other}, which replace each other") for axes, key, other in (
        ({"drive.peak_acceleration": ["1 g"], "drive.gamma0": [0.5]}, "drive.peak_acceleration", "drive.gamma0"),
        ({"dimers.sin_delta": [0.1], "dimers.radii": [["3 mm", "2 mm"]]}, "dimers.sin_delta", "dimers.radii"),
    )),
    # What would make the same point twice
    ({"axes": {"drive.frequency": ["80 Hz", "80.0 Hz"]}}, r'"80\.0 Hz": expected different'),
    ({"axes": {"drive.frequency": {"linspace": ["80 Hz", "80 Hz", 3]}}}, "expected different values"),
    ({"sample": [{"points": 4, "ranges": {"contact.restitution": {"uniform": [0.3, 0.2]}}}]}, "smaller value first"),
    ({"axes": {"run.silence": ["1 s", "2 s"]}}, r"run\.silence: expected none: this key has ended"),
    ({"set": {"run.log_limit": "2 MB"}}, r"run\.log_limit.*: expected none: this key has ended"),
    ({"axes": {"title": ["a", "b"]}}, "title: expected another key"),
]  # fmt: skip


@pytest.mark.parametrize(("tables", "message"), BAD)
def test_a_sweep_that_makes_no_sense(make: Make, tables: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"test.toml: .*{message}") as caught:
        make(**tables)
    assert any(word in str(caught.value) for word in ("expected", "unknown key", "nor a shipped case", "must "))


@pytest.mark.parametrize("case", ["other", "other.toml", "./other"])
def test_the_base_case_beside_a_sweep_comes_before_that_of_the_working_directory(case: str, in_folder: Path) -> None:
    (in_folder / "below").mkdir()
    for place, acceleration in (("other.toml", "2 g"), ("below/other.toml", "3 g")):
        (in_folder / place).write_text(to_toml(document(drive={"peak_acceleration": acceleration})))
    (in_folder / "below" / "sweep.toml").write_text(f'case = "{case}"\naxes.run.seed = [1]\n')
    assert [point.drive.peak_acceleration for point in load_sweep("below/sweep.toml").cases()] == [pytest.approx(29.4)]


def test_a_point_that_makes_no_sense_is_named(make: Make) -> None:
    sweep = make(axes={"drive.frequency": ["60 Hz", "-80 Hz"]})
    with pytest.raises(InputError, match=r"test.toml: point 1 \(drive.frequency = -80 Hz\): drive.frequency = "):
        _cases(sweep)
