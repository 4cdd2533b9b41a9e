"""Sweep files: what may be varied and how; and the numbers of sweeps by a second formula.

The numbers are the bands of spreads, groups of points that differ in their seed, and thresholds of
descents.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import qmc, spearmanr

import walkers
from tests.conftest import REFERENCE, TINY, document, make_case, to_toml
from tests.test_inputs import GLASS
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.files import read_json
from walkers.inputs.case_building import build_case
from walkers.inputs.resolving.library import unmeasured
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.sweep import SweepDefinition, expand, load_sweep
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.materials import FrictionLaw
from walkers.postprocess.measure import meetings
from walkers.postprocess.measure.dump import DumpError
from walkers.postprocess.measure.numbers import band_text
from walkers.postprocess.measure.uncertainty import SPREAD_NAME, fixed_values_text, spread_of
from walkers.sweeps.record import SweepRecord
from walkers.sweeps.scheduler import SweepOptions
from walkers.sweeps.spread import Spread, run_spread, spread_in, spread_sweep, spread_text
from walkers.sweeps.table import key_values, seed_groups, table_of, thresholds

MakeSweep = Callable[..., SweepDefinition]


@pytest.fixture
def make_sweep(tmp_path: Path) -> MakeSweep:
    """Expand a sweep over the reference case, which has all keys that exclude others."""
    (tmp_path / "base.toml").write_text(to_toml(document()))

    def expanded(**tables: Any) -> SweepDefinition:
        definition = {"case": "base.toml", **tables}
        return expand(definition, source="test.toml", name="test", folder=tmp_path)

    return expanded


def cases_of(sweep: SweepDefinition) -> list[Case]:
    return list(sweep.cases())


def drives_of(sweep: SweepDefinition) -> list[tuple[float, float]]:
    """Frequency, Hz, and peak acceleration, m/s², of each point."""
    drives = []
    for case in sweep.cases():
        drives.append((case.excitation.frequency, case.excitation.peak_acceleration))
    return drives


def test_axes_multiply_and_the_last_runs_fastest(make_sweep: MakeSweep) -> None:
    axes = {"frequency": ["60 Hz", "80 Hz"], "peak_acceleration": ["1 g", "2 g", "4 g"]}
    sweep = make_sweep(axes={"drive": axes})
    assert sweep.rows == [
        ("60 Hz", "1 g"),
        ("60 Hz", "2 g"),
        ("60 Hz", "4 g"),
        ("80 Hz", "1 g"),
        ("80 Hz", "2 g"),
        ("80 Hz", "4 g"),
    ]
    assert list(sweep.units.values()) == ["Hz", "g"]


def test_cases_have_the_values_of_their_points_in_si_units(make_sweep: MakeSweep) -> None:
    """ "1 g" is 9.8 m/s², as in the paper."""
    axes = {"frequency": ["60 Hz", "80 Hz"], "peak_acceleration": ["1 g", "2 g"]}
    sweep = make_sweep(axes={"drive": axes})
    assert drives_of(sweep) == [
        (60.0, pytest.approx(9.8)),
        (60.0, pytest.approx(19.6)),
        (80.0, pytest.approx(9.8)),
        (80.0, pytest.approx(19.6)),
    ]
    assert (
        cases_of(sweep)[1].title == "test: drive.frequency = 60 Hz, drive.peak_acceleration = 2 g"
    )


def test_keys_that_vary_one_at_a_time_keep_the_first_value_of_the_others(
    make_sweep: MakeSweep,
) -> None:
    frequencies = ["60 Hz", "90 Hz", "70 Hz"]
    sweep = make_sweep(one_at_a_time={"run.seed": [3, 4], "drive": {"frequency": frequencies}})
    assert sweep.rows == [(3, "60 Hz"), (4, "60 Hz"), (3, "90 Hz"), (3, "70 Hz")]


def test_keys_of_a_zip_vary_together_on_one_axis(make_sweep: MakeSweep) -> None:
    radii = [["0.3 mm", "0.2 mm"], ["0.4 mm", "0.2 mm"]]
    sweep = make_sweep(
        zip=[{"dimers.radii": radii, "run": {"seed": [3, 4]}}],
        axes={"drive.frequency": ["60 Hz", "90 Hz"]},
    )
    points = []
    for case in cases_of(sweep):
        points.append((case.excitation.frequency, case.walkers[0].radii, case.run.seed))
    assert points == [
        (60.0, (3e-4, 2e-4), 3),
        (60.0, (4e-4, 2e-4), 4),
        (90.0, (3e-4, 2e-4), 3),
        (90.0, (4e-4, 2e-4), 4),
    ]


def test_a_descent_is_the_last_axis_and_includes_its_end(make_sweep: MakeSweep) -> None:
    """(0.5 g - 0.2 g) / 0.1 g is 2.9999999999999996 in floats; the last point is there."""
    descent = {
        "key": "drive.peak_acceleration",
        "from": "0.5 g",
        "to": "0.2 g",
        "step": "0.1 g",
        "until_below": "1 um/s",
    }
    sweep = make_sweep(axes={"drive.frequency": ["60 Hz", "80 Hz"]}, descend=descent)
    frequencies, peaks = zip(*sweep.rows, strict=True)
    assert frequencies == ("60 Hz",) * 4 + ("80 Hz",) * 4
    assert peaks == ("0.5 g", "0.4 g", "0.3 g", "0.2 g") * 2
    assert sweep.until_below == pytest.approx(1e-6)


def test_linspace_and_geomspace_are_those_of_numpy(make_sweep: MakeSweep) -> None:
    sweep = make_sweep(
        axes={
            "drive.peak_acceleration": {"linspace": ["0.5 g", "10 g", 20]},
            "liquid.volume_fraction": {"geomspace": [1e-3, 1e-1, 5]},
        }
    )
    peak_texts, fractions = zip(*sweep.rows, strict=True)
    peaks = [float(text.removesuffix(" g")) for text in peak_texts]
    # The second axis runs fastest: five fractions for each of twenty accelerations.
    np.testing.assert_allclose(peaks, np.repeat(np.linspace(0.5, 10, 20), 5), rtol=1e-11)
    np.testing.assert_allclose(fractions, np.tile(np.geomspace(1e-3, 1e-1, 5), 20), rtol=1e-11)


def test_linspace_and_geomspace_of_whole_numbers_are_whole(make_sweep: MakeSweep) -> None:
    axes = {"run.seed": {"linspace": [1, 4, 4]}, "run.cycles": {"geomspace": [10, 40, 3]}}
    seeds, cycles = zip(*make_sweep(axes=axes).rows, strict=True)
    assert seeds == (1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4)
    assert cycles == (10, 20, 40) * 4


@pytest.mark.parametrize("seed", [5, 6])
def test_seeded_samplers_are_those_of_scipy(make_sweep: MakeSweep, seed: int) -> None:
    ranges = {
        "contact.friction.bead_wall": {"uniform": [0.05, 0.3]},
        "liquid.volume_fraction": {"loguniform": [1e-3, 1e-1]},
    }
    sweep = make_sweep(sample=[{"points": 8, "seed": seed, "ranges": ranges}])
    unit = qmc.Sobol(d=2, rng=np.random.default_rng(seed)).random(8)
    frictions = 0.05 + 0.25 * unit[:, 0]
    fractions = 1e-3 * 100 ** unit[:, 1]
    expected = np.stack([frictions, fractions], axis=1)
    np.testing.assert_allclose(np.array(sweep.rows, dtype=float), expected, rtol=1e-11)


def test_one_radius_of_a_dimer_may_be_sampled(make_sweep: MakeSweep) -> None:
    ranges = {"dimers.radii[0]": {"uniform": ["0.3 mm", "0.4 mm"]}}
    cases = cases_of(make_sweep(sample=[{"points": 4, "ranges": ranges}]))
    assert len(cases) == 4
    for case in cases:
        first, second = case.walkers[0].radii
        assert 3e-4 <= first <= 4e-4
        assert second == 2e-4


def test_gamma0_on_an_axis_replaces_the_peak_acceleration_of_the_case(
    make_sweep: MakeSweep,
) -> None:
    (case,) = cases_of(make_sweep(axes={"drive.gamma0": [0.5]}))
    assert dimer_of(case).gamma0(case.excitation.peak_acceleration) == pytest.approx(0.5)


def test_mean_radius_and_sin_delta_replace_the_radii_of_the_case(make_sweep: MakeSweep) -> None:
    """R1,2 = R̄ (1 ± sin δ) = 0.25 mm × (1 ± 0.2)."""
    sweep = make_sweep(set={"dimers.mean_radius": "0.25 mm"}, axes={"dimers.sin_delta": [0.2]})
    (case,) = cases_of(sweep)
    assert case.walkers[0].radii == (3e-4, 2e-4)


def test_the_shipped_sweep_of_fig2_is_the_papers() -> None:
    """From 0.5 to 10 g at four frequencies."""
    frequencies, accelerations = zip(*drives_of(load_sweep("fig2")), strict=True)
    assert len(frequencies) == 80
    assert set(frequencies) == {60.0, 70.0, 80.0, 90.0}
    assert min(accelerations) == pytest.approx(0.5 * 9.8, rel=1e-9)
    assert max(accelerations) == pytest.approx(10.0 * 9.8, rel=1e-9)


def test_the_shipped_sweep_of_fig3_is_the_papers() -> None:
    asymmetries = []
    for case in load_sweep("fig3").cases():
        dimer = dimer_of(case)
        asymmetries.append(round(dimer.sin_delta, 3))
        assert dimer.gamma0(case.excitation.peak_acceleration) == pytest.approx(0.5)
    assert asymmetries == [0.0, 0.111, 0.143, 0.2, 0.273, 0.333]


def test_the_shipped_sweep_of_trays_varies_number_and_coverage() -> None:
    cases = cases_of(load_sweep("tray-phases"))
    assert len(cases) == 96
    assert {case.walkers[0].replicates for case in cases} == {2, 16, 64}
    assert {meetings.derived(case)["coverage"] for case in cases} == {0.05, 0.14, 0.25}


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        pytest.param({"case": ""}, 'case = "": no such file', id="case without a name"),
        pytest.param(
            {"case": "."},
            r'case = "\.": expected a case file, or the name of a shipped case',
            id="folder in place of a case",
        ),
        pytest.param(
            {"axis": {}}, 'unknown key; a sweep takes .*did you mean "axes"', id="mistyped table"
        ),
        pytest.param(
            {"axes": {"drive.frequncy": ["60 Hz"]}},
            'drive.frequncy: unknown key; .*did you mean "frequency"',
            id="mistyped key of an axis",
        ),
        pytest.param(
            {"set": {"drive.frequncy": "60 Hz"}},
            "drive.frequncy: unknown key",
            id="mistyped key that is set",
        ),
        pytest.param(
            {"axes": {"run.silence": ["1 s", "2 s"]}},
            r"run\.silence: unknown key",
            id="axis of an option of the command",
        ),
        pytest.param(
            {"axes": {"title": ["a", "b"]}}, "title: expected another key", id="axis of titles"
        ),
        pytest.param(
            {"axes": {"run.seed": [1]}, "zip": [{"run.seed": [1]}]},
            "run.seed: varies on two axes; expected one",
            id="key on two axes",
        ),
        pytest.param(
            {"axes": {"drive": {"frequency": ["60 Hz"]}, "drive.frequency": ["70 Hz"]}},
            "drive.frequency: is given twice; expected one value",
            id="key in two notations",
        ),
        pytest.param(
            {"axes": {"drive.peak_acceleration": ["1 g"], "drive.gamma0": [0.5]}},
            "drive.peak_acceleration: expected one of drive.peak_acceleration and drive.gamma0, "
            "which replace each other",
            id="acceleration and gamma0",
        ),
        pytest.param(
            {"axes": {"dimers.sin_delta": [0.1], "dimers.radii": [["3 mm", "2 mm"]]}},
            "dimers.sin_delta: expected one of dimers.sin_delta and dimers.radii, "
            "which replace each other",
            id="sin_delta and radii",
        ),
    ],
)
def test_keys_that_a_sweep_cannot_vary(
    make_sweep: MakeSweep, tables: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=f"test.toml: .*{message}"):
        make_sweep(**tables)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        pytest.param(
            {"axes": {"drive.frequency": []}},
            "drive.frequency = \\[\\]: expected at least one value",
            id="axis without values",
        ),
        pytest.param(
            {"axes": {"drive.frequency": {"linspace": ["60 Hz", "90 Hz", 2.5]}}},
            "expected .*first value, last value and number",
            id="linspace of 2.5 points",
        ),
        pytest.param(
            {"axes": {"liquid.volume_fraction": {"geomspace": [0, 1, 3]}}},
            "expected .*above zero",
            id="geomspace from 0",
        ),
        pytest.param(
            {"axes": {"drive.frequency": ["60 Hz", "60 mHz"]}},
            "expected .*one unit throughout",
            id="values in two units",
        ),
        pytest.param(
            # 2000 × 999
            {
                "axes": {
                    "run.seed": {"linspace": [1, 1000, 2000]},
                    "drive.frequency": {"linspace": ["60 Hz", "90 Hz", 999]},
                }
            },
            "axes: 1998000 points; expected at most 1000000",
            id="two million points",
        ),
        pytest.param(
            {"zip": [{"run.seed": [1, 2], "dimers.angle": ["0 deg"]}]},
            "expected as many values .*seed has 2, dimers.angle has 1",
            id="zip of two values and one",
        ),
        pytest.param(
            {"axes": {"drive.frequency": ["80 Hz", "80.0 Hz"]}},
            r'"80\.0 Hz": expected different',
            id="value in two notations",
        ),
        pytest.param(
            {"axes": {"drive.frequency": {"linspace": ["80 Hz", "80 Hz", 3]}}},
            "expected different values",
            id="linspace of a single value",
        ),
    ],
)
def test_values_that_make_no_axis(
    make_sweep: MakeSweep, tables: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=f"test.toml: .*{message}"):
        make_sweep(**tables)


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        pytest.param(
            {"points": 4, "method": "sobbol", "ranges": {}},
            'expected .*did you mean "sobol"',
            id="mistyped method",
        ),
        pytest.param(
            {"points": 4, "ranges": {"run.seed": [1, 2]}},
            "expected .*uniform",
            id="list in place of a distribution",
        ),
        pytest.param(
            {"points": 0, "ranges": {"contact.restitution": {"uniform": [0.1, 0.2]}}},
            "expected .*at least 1",
            id="no points",
        ),
        pytest.param(
            {"points": 4, "ranges": {"contact.restitution": {"uniform": [0.3, 0.2]}}},
            "expected .*smaller value first",
            id="range that descends",
        ),
    ],
)
def test_a_sample_that_cannot_be_drawn(
    make_sweep: MakeSweep, sample: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=f"test.toml: .*{message}"):
        make_sweep(sample=[sample])


@pytest.mark.parametrize(
    ("descent", "message"),
    [
        pytest.param(
            {"from": "1 g", "to": "2 g", "step": "0.1 g", "until_below": "1 um/s"},
            "`from` must not be below `to`",
            id="upwards",
        ),
        pytest.param(
            {"from": float("inf"), "to": 0, "step": 1, "until_below": "1 um/s"},
            "descend.from = .*expected .*a number",
            id="from infinity",
        ),
    ],
)
def test_a_descent_that_does_not_descend(
    make_sweep: MakeSweep, descent: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=f"test.toml: .*{message}"):
        make_sweep(descend=descent)


@pytest.mark.parametrize("case", ["other", "other.toml", "./other"])
def test_the_base_case_beside_a_sweep_comes_before_that_of_the_working_directory(
    case: str, in_folder: Path
) -> None:
    """3 g, of the file beside the sweep, are 29.4 m/s²."""
    (in_folder / "below").mkdir()
    (in_folder / "other.toml").write_text(to_toml(document(drive={"peak_acceleration": "2 g"})))
    (in_folder / "below" / "other.toml").write_text(
        to_toml(document(drive={"peak_acceleration": "3 g"}))
    )
    (in_folder / "below" / "sweep.toml").write_text(f'case = "{case}"\naxes.run.seed = [1]\n')
    (point,) = load_sweep("below/sweep.toml").cases()
    assert point.drive.peak_acceleration == pytest.approx(29.4)


FRICTION = "contact.friction.bead_wall"
RESTITUTION = "contact.restitution"
ROLLING = "contact.rolling_friction"
UNCERTAIN = {FRICTION: [0.05, 0.3], RESTITUTION: [0.2, 0.8], ROLLING: [0.0, 0.01]}
NUMBER = np.arange(32)
SPEEDS: FloatArray = 1e-4 * 1.2**NUMBER - 5e-4
"""Speeds of 32 draws, which rise from draw to draw, m/s."""


def draw_with_rank_correlation(seed: int, low: float, high: float) -> list[float]:
    """Random numbers from 0 to 1 whose rank correlation with `NUMBER` lies in a range, by trial."""
    generator = np.random.default_rng(seed)
    while True:
        values = generator.random(len(NUMBER))
        if low < spearmanr(values, NUMBER).statistic < high:
            return values.tolist()


STRONG = draw_with_rank_correlation(1, 0.55, 0.6)
WEAK = draw_with_rank_correlation(2, 0.25, 0.3)


@pytest.fixture
def spread_of_32_draws() -> Spread:
    """The spread of the `SPEEDS`, which fall with friction.

    There are three more draws: the walkers of two came apart, and the third failed. The rows of the
    table are in random order.
    """
    frictions = 0.3 - 0.005 * NUMBER
    intact = pd.DataFrame(
        {"velocity": SPEEDS, FRICTION: frictions, RESTITUTION: STRONG, ROLLING: WEAK}
    )
    intact["status"] = "finished"
    intact["separated_fraction"] = 0.0
    excluded = pd.DataFrame({"velocity": [1.0, -1.0, 2.0], "separated_fraction": [0.5, 0.2, 0.0]})
    excluded["status"] = ["finished", "finished", "failed"]
    for key in UNCERTAIN:
        excluded[key] = 0.2
    table = pd.concat([intact, excluded]).sample(frac=1.0, random_state=1).reset_index(drop=True)
    return spread_in(table, make_case(uncertain=UNCERTAIN), Path())


def test_the_band_of_a_spread_has_the_quantiles_of_its_draws(spread_of_32_draws: Spread) -> None:
    """Of 32 sorted numbers, counted from 0 to 31, 5 and 95 % are at 1.55 and 29.45.

    The median is between the two in the middle.
    """
    band = spread_of_32_draws.bands["velocity"]
    assert band["low"] == pytest.approx(SPEEDS[1] + 0.55 * (SPEEDS[2] - SPEEDS[1]))
    assert band["median"] == pytest.approx((SPEEDS[15] + SPEEDS[16]) / 2.0)
    assert band["high"] == pytest.approx(SPEEDS[29] + 0.45 * (SPEEDS[30] - SPEEDS[29]))
    assert band["smallest"] == SPEEDS[0]
    assert band["largest"] == SPEEDS[31]
    assert band["points"] == 32


def test_a_spread_counts_draws_by_their_direction(spread_of_32_draws: Spread) -> None:
    """0.1 × 1.2ⁿ is below 0.5 up to n = 8, so 9 of 32 walk backward."""
    assert spread_of_32_draws.counts == {
        "forward": 23,
        "backward": 9,
        "at_rest": 0,
        "separated": 2,
    }


def test_a_spread_has_signed_rank_correlations_above_two_standard_errors(
    spread_of_32_draws: Spread,
) -> None:
    """Two standard errors, 2/√31, are 0.36: rolling friction, with 0.25 to 0.3, is left out."""
    correlations = spread_of_32_draws.depends["velocity"]
    assert list(correlations) == [FRICTION, RESTITUTION], "the strongest first"
    assert correlations[FRICTION] == pytest.approx(-1.0)
    assert correlations[RESTITUTION] == pytest.approx(spearmanr(STRONG, SPEEDS).statistic)


BAND = "band: uncertain values only, 5 to 95 % of 4 draws, approximate"


@pytest.fixture(scope="module")
def sweep_with_bands(once: Callable[[str, Callable[[Path], object]], Path]) -> walkers.Sweep:
    """A sweep of two accelerations, each with a spread of four draws of the friction."""

    def load(folder: Path) -> walkers.Sweep:
        tables = {
            "case": str(folder / "base.toml"),
            "axes": {"drive.peak_acceleration": ["3 g", "6 g"]},
        }
        return walkers.sweep(tables, folder, spread=4)

    def fill(folder: Path) -> None:
        case = document(run=TINY, uncertain={FRICTION: [0.05, 0.3]})
        (folder / "base.toml").write_text(to_toml(case))
        load(folder)

    return load(once("sweep-with-bands", fill))


def test_bands_along_a_sweep_are_those_of_each_points_spread(
    sweep_with_bands: walkers.Sweep,
) -> None:
    table = sweep_with_bands.table()
    assert len(table) == 2
    for row in table.itertuples():
        spread = read_json(spread_of(Path(row.run)) / SPREAD_NAME)
        band = spread["bands"]["velocity"]
        assert row.velocity_low == min(band["low"], row.velocity)
        assert row.velocity_high == max(band["high"], row.velocity)
        assert row.velocity_low < row.velocity_high
    assert table["velocity_high"].is_monotonic_increasing, "with the acceleration"


def test_a_sweep_prints_its_bands_along_it(sweep_with_bands: walkers.Sweep) -> None:
    assert "velocity_low (mm/s)  velocity_high (mm/s)" in sweep_with_bands.describe()


def test_a_figure_of_a_sweep_with_bands_along_it_says_what_they_are(
    sweep_with_bands: walkers.Sweep,
) -> None:
    figure = sweep_with_bands.figure()
    title = " ".join(figure.get_suptitle().split())
    assert title.endswith(f"{BAND}; the error of the model is not in it")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [BAND]


def test_points_that_differ_in_their_seed_alone_are_a_group() -> None:
    """A law that a case may leave to the program ("auto", none) is a value as others."""
    table = pd.DataFrame(
        {
            "drive.frequency": [90.0, 60.0, 90.0, 60.0, 90.0, 60.0],
            "contact.law": ["auto", 1.0, "auto", None, "auto", None],
            "run.seed": [1, 1, 2, 1, 3, 2],
            "boundary.tilt": 0.0,
        }
    )
    table.attrs["varied"] = list(table)
    groups = list(seed_groups(table))
    assert [list(rows.index) for _, rows in groups] == [[0, 2, 4], [1], [3, 5]]
    second_values, _ = groups[1]
    assert second_values == {"drive.frequency": 60.0, "contact.law": 1.0}


def test_a_group_is_not_named_by_what_is_the_same_in_all_rows() -> None:
    table = pd.DataFrame({"drive.frequency": [90.0] * 3, "run.seed": [1, 2, 3]}, index=[0, 2, 4])
    table.attrs["varied"] = list(table)
    ((values, rows),) = seed_groups(table)
    assert values == {}
    assert list(rows.index) == [0, 2, 4]
    assert rows.attrs["varied"] == ["drive.frequency", "run.seed"]


def test_a_key_may_be_a_word_at_some_points_and_a_list_at_others(
    make_sweep: MakeSweep, tmp_path: Path
) -> None:
    sweep = make_sweep(axes={"drive": {"axis": ["x", "y", [1, 0, 1]]}})
    names = ["base-000000000000", "base-000000000001", "base-000000000002"]
    table = table_of(SweepRecord(tmp_path / "test", sweep, names)).frame
    assert key_values(table, "drive.axis") == (["x", "y", [1, 0, 1]], "")
    assert [len(rows) for _, rows in seed_groups(table)] == [1, 1, 1]


def test_a_key_may_be_a_number_at_some_points_and_a_table_at_others(
    make_sweep: MakeSweep, tmp_path: Path
) -> None:
    """The table of the sweep has the words of the table, by which points are grouped."""
    growing = {"at_rest": 0.28, "rise": 0.3, "half_rise_velocity": "3.6 mm/s"}
    sweep = make_sweep(
        axes={"run": {"seed": [1, 2]}, "contact": {"friction": {"bead_wall": [0.5, growing]}}}
    )
    names = [f"base-00000000000{number}" for number in range(4)]
    table = table_of(SweepRecord(tmp_path / "test", sweep, names)).frame
    words = "at_rest = 0.28, rise = 0.3, half_rise_velocity = 3.6 mm/s"
    assert list(table["contact.friction.bead_wall"]) == [0.5, words, 0.5, words]
    assert [len(rows) for _, rows in seed_groups(table)] == [2, 2]


def test_a_table_in_set_takes_the_place_of_the_number_of_the_case(make_sweep: MakeSweep) -> None:
    growing = {"at_rest": 0.28, "rise": 0.3, "half_rise_velocity": "3.6 mm/s"}
    sweep = make_sweep(
        set={"contact": {"friction": {"bead_wall": growing}}},
        axes={"drive": {"frequency": ["90 Hz", "80 Hz"]}},
    )
    law = FrictionLaw(at_rest=0.28, rise=0.3, half_rise_velocity=0.0036)
    assert [case.contact.friction.bead_wall for case in sweep.cases()] == [law, law]


@pytest.fixture
def thresholds_of_two_descents() -> list[dict[str, Any]]:
    """The thresholds of two descents from 1.2 g in steps of 0.2 g, one of them at 90 Hz.

    The first ends at a speed of 1 µm/s, below 10 µm/s, and its walkers go toward their small beads
    until then. In the second the walkers creep backward at 1 µm/s, at 1 g, and move once more at
    0.8 g. A further point of the first failed.
    """
    table = pd.DataFrame(
        [
            {"point": 0, "drive.frequency": 60.0, "velocity": -3e-4, "status": "finished"},
            {"point": 1, "drive.frequency": 60.0, "velocity": -1e-4, "status": "finished"},
            {"point": 2, "drive.frequency": 60.0, "velocity": 1e-6, "status": "finished"},
            {"point": 3, "drive.frequency": 60.0, "velocity": np.nan, "status": "failed"},
            {"point": 5, "drive.frequency": 90.0, "velocity": 2e-4, "status": "finished"},
            {"point": 6, "drive.frequency": 90.0, "velocity": -1e-6, "status": "finished"},
            {"point": 7, "drive.frequency": 90.0, "velocity": 2e-5, "status": "finished"},
        ]
    )
    table["drive.peak_acceleration"] = 1.2 - 0.2 * (table["point"] % 5)
    dimer = dimer_of(make_case())
    table["gamma0"] = [dimer.gamma0(9.80665 * g) for g in table["drive.peak_acceleration"]]
    units = {"drive.frequency": "Hz", "drive.peak_acceleration": "g"}
    table.attrs |= {"units": units, "varied": list(units), "until_below": 1e-5}
    return thresholds(table).to_dict("records")


@pytest.mark.parametrize(("descent", "moving", "at_rest"), [(0, 1.0, 0.8), (1, 1.2, 1.0)])
def test_a_descent_has_the_threshold_where_its_walkers_first_rest(
    thresholds_of_two_descents: list[dict[str, Any]],
    descent: int,
    moving: float,
    at_rest: float,
) -> None:
    row = thresholds_of_two_descents[descent]
    assert row["moving"] == pytest.approx(moving)
    assert row["at_rest"] == pytest.approx(at_rest)


@pytest.mark.parametrize(("descent", "moving", "at_rest"), [(0, 1.0, 0.8), (1, 1.2, 1.0)])
def test_the_threshold_of_a_descent_has_the_gamma0_of_its_own_drive(
    thresholds_of_two_descents: list[dict[str, Any]],
    descent: int,
    moving: float,
    at_rest: float,
) -> None:
    """Γ0 = M a0 / (4πγR̄) is proportional to the acceleration."""
    row = thresholds_of_two_descents[descent]
    mass = 4000.0 * 4.0 / 3.0 * np.pi * (0.3e-3**3 + 0.2e-3**3)
    force = 4.0 * np.pi * 19.2e-3 * 0.25e-3
    assert row["gamma0_moving"] == pytest.approx(mass * 9.80665 * moving / force, rel=0.05)
    assert row["gamma0_at_rest"] == pytest.approx(mass * 9.80665 * at_rest / force, rel=0.05)
    ratio = row["gamma0_moving"] / row["gamma0_at_rest"]
    assert ratio == pytest.approx(moving / at_rest)


@pytest.fixture(scope="module")
def guessed_case() -> Case:
    """Glass on polystyrene at 10 g, which walks or not as one guesses its unmeasured values."""
    return build_case({**GLASS, "run": {"cycles": 6}}, name="guessed")


@pytest.fixture(scope="module")
def guessed_runs(once: Callable[[str, Callable[[Path], object]], Path], guessed_case: Case) -> Path:
    """A folder with a run of that case and its spread of four draws."""

    def fill(folder: Path) -> None:
        walkers.run(guessed_case, folder)
        run_spread(guessed_case, folder, SweepOptions(2), points=4)

    return once("guessed", fill)


@pytest.fixture
def guessed_run(guessed_runs: Path, guessed_case: Case) -> walkers.Run:
    return walkers.run(guessed_case, guessed_runs)


@pytest.fixture
def guessed_spread(guessed_runs: Path, guessed_case: Case) -> Spread:
    return run_spread(guessed_case, guessed_runs, SweepOptions(2), points=4)


def test_a_spread_varies_what_nobody_measured_and_holds_what_is_given(
    guessed_spread: Spread, guessed_case: Case
) -> None:
    guessed = {origin.key for origin in guessed_case.origins if origin.guessed}
    # The library has ranges of roughness for these materials.
    roughness = {"contact.roughness.bead_bead", "contact.roughness.bead_wall"}
    assert {value.key for value in guessed_spread.varied} == guessed | roughness
    assert {value.key for value in guessed_spread.held} == {
        "contact.friction.bead_bead",
        "contact.rolling_friction",
        "liquid.name",
        "liquid.surface_tension",
        "liquid.density",
        "liquid.kinematic_viscosity",
    }


def test_draws_of_a_spread_are_within_the_ranges(guessed_spread: Spread) -> None:
    table = walkers.load(guessed_spread.directory).table()
    assert len(table) == sum(guessed_spread.counts.values()) == 4
    assert table["contact.friction.bead_wall"].between(0.1, 0.6).all()
    # The value of the case, 0.01, is the median of the draws.
    assert (table["liquid.volume_fraction"] > 0.01).sum() == 2
    # The value of the case, 0°, is the end of what is possible.
    assert (table["liquid.contact_angle"] == 0.0).sum() == 2


def test_a_printed_spread_names_its_values_and_its_median_once(guessed_spread: Spread) -> None:
    text = spread_text(guessed_spread)
    assert "contact_angle 0 deg (0 deg to 60 deg)" in text
    held = "liquid.kinematic_viscosity 14.5 mm²/s (ethylene glycol), contact."
    assert held in " ".join(text.split())
    assert text.count("median") == 1


def test_a_printed_spread_counts_draws_with_warnings(guessed_spread: Spread) -> None:
    doubted = replace(guessed_spread, doubts=[["one", "two"], ["three"]])
    assert "warning  2 draws with warnings, first: one\n" in spread_text(doubted)


def test_a_spread_collects_the_warnings_of_its_draws(guessed_spread: Spread) -> None:
    warnings = []
    for run in walkers.load(guessed_spread.directory).runs:
        if run.result.warnings:
            warnings.append(run.result.warnings)
    assert warnings == list(guessed_spread.doubts)


def test_the_velocity_of_a_run_has_the_band_of_its_spread(
    guessed_run: walkers.Run, guessed_spread: Spread
) -> None:
    """The single velocity, exact to 1e-5, does not say how much depends on guesses."""
    band = guessed_spread.bands["velocity"]
    result = guessed_run.result
    assert band["high"] - band["low"] > 1e-4  # m/s
    # The band of the result includes its own velocity.
    low = result["velocity_low"]
    high = result["velocity_high"]
    assert low == min(band["low"], result["velocity"])
    assert high == max(band["high"], result["velocity"])
    assert f"band {band_text(low, high, 'm/s')} (4 draws, approximate)" in guessed_run.describe()


def test_a_result_says_where_its_unmeasured_values_are_from(guessed_run: walkers.Run) -> None:
    origins = {entry["key"]: entry["origin"] for entry in guessed_run.result.about["rests_on"]}
    assert origins["contact.friction.bead_wall"] == "given"
    # The case has a volume fraction in place of the radius of its menisci.
    assert origins.keys() == unmeasured().keys() - {"liquid.meniscus_radius"}


def test_a_report_shows_the_spread_of_its_run(
    guessed_run: walkers.Run, guessed_spread: Spread, tmp_path: Path
) -> None:
    page = guessed_run.report(tmp_path / "run.html").read_text("utf-8")
    assert 'aria-label="spread"' in page
    assert "4 draws: too few for rank correlations" in page
    assert "4 draws, approximate" in page
    assert fixed_values_text(guessed_spread.held) in page
    assert "rank correlation " not in page


def test_draws_of_a_spread_keep_no_dumps_and_say_how_to_get_them(
    guessed_run: walkers.Run, guessed_spread: Spread
) -> None:
    """Only pictures need the dumps."""
    assert list(guessed_run.directory.rglob("beads.bin"))
    draws = walkers.load(guessed_spread.directory).runs
    assert len(draws) == 4
    for draw in draws:
        assert not list(draw.directory.rglob("beads.bin"))
        assert read_json(draw.directory / "manifest.json")["left_out"]
    with pytest.raises(DumpError, match=r"beads\.bin was left out.*walkers run .*--force"):
        draws[0].render()


def test_a_spread_does_not_hold_for_other_ranges(
    guessed_case: Case, guessed_spread: Spread, guessed_runs: Path
) -> None:
    """The ranges do not change the name of a run, so it is the one that has the spread."""
    tables = {**guessed_case.document, "uncertain": {"contact.friction.bead_wall": [0.2, 0.6]}}
    run = walkers.run(build_case(tables, name="guessed"), guessed_runs)
    assert run.cached
    assert "velocity_low" not in run.result


def test_a_range_of_a_spread_holds_the_value_of_the_case() -> None:
    """GLASS has a restitution of 0.3, the default."""
    case = build_case({**GLASS, "uncertain": {"contact.restitution": [0.4, 0.8]}}, name="beside")
    message = r"uncertain.contact.restitution.*: expected a range that holds"
    with pytest.raises(InputError, match=message):
        spread_sweep(case)


def test_there_is_no_spread_of_a_case_without_uncertain_values(runs_folder: Path) -> None:
    with pytest.raises(InputError, match="no value is uncertain"):
        run_spread(build_case(REFERENCE), runs_folder, SweepOptions(2))
