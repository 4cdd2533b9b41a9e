"""Sweeps: what may be varied and how; and their numbers by a second formula: bands of spreads, groups, thresholds."""

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
from walkers.errors import InputError
from walkers.files import read_json
from walkers.inputs.case_building import build_case
from walkers.inputs.resolving.library import unmeasured
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.sweep import SweepDefinition, expand, load_sweep
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure import meetings
from walkers.postprocess.measure.dump import DumpError
from walkers.postprocess.measure.numbers import band_text
from walkers.postprocess.measure.uncertainty import SPREAD_NAME, fixed_values_text, spread_of
from walkers.sweeps.record import SweepRecord
from walkers.sweeps.scheduler import SweepOptions
from walkers.sweeps.spread import run_spread, spread_in, spread_sweep, spread_text
from walkers.sweeps.table import key_values, seed_groups, table_of, thresholds

Make = Callable[..., SweepDefinition]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Expand a sweep over the reference case, which says everything that a case may say in other words too."""
    (tmp_path / "base.toml").write_text(to_toml(document()))

    def expanded(**tables: Any) -> SweepDefinition:
        return expand(
            {"case": "base.toml", **tables}, source="test.toml", name="test", folder=tmp_path
        )

    return expanded


def _cases(sweep: SweepDefinition) -> list[Case]:
    return list(sweep.cases())


def test_axes_multiply_and_the_last_runs_fastest(make: Make) -> None:
    """Zips and what varies one at a time are axes too, and so is a descent, the last one."""
    sweep = make(
        axes={
            "drive": {"frequency": ["60 Hz", "80 Hz"], "peak_acceleration": ["1 g", "2 g", "4 g"]}
        }
    )
    found = [
        (case.excitation.frequency, case.excitation.peak_acceleration) for case in _cases(sweep)
    ]
    assert found == [(f, pytest.approx(9.8 * a)) for f in (60.0, 80.0) for a in (1, 2, 4)]
    assert [*sweep.units.values()] == ["Hz", "g"]
    assert _cases(sweep)[1].title == "test: drive.frequency = 60 Hz, drive.peak_acceleration = 2 g"
    alone = make(
        one_at_a_time={"run.seed": [3, 4], "drive": {"frequency": ["60 Hz", "90 Hz", "70 Hz"]}}
    )
    assert alone.rows == [(3, "60 Hz"), (4, "60 Hz"), (3, "90 Hz"), (3, "70 Hz")]
    radii = [["0.3 mm", "0.2 mm"], ["0.4 mm", "0.2 mm"]]
    pairs = make(
        zip=[{"dimers.radii": radii, "run": {"seed": [3, 4]}}],
        axes={"drive.frequency": ["60 Hz", "90 Hz"]},
    )
    cases = [
        (case.excitation.frequency, case.walkers[0].radii, case.run.seed) for case in _cases(pairs)
    ]
    assert cases == [
        (f, r, s) for f in (60.0, 90.0) for r, s in (((3e-4, 2e-4), 3), ((4e-4, 2e-4), 4))
    ]
    down = {"from": "0.5 g", "to": "0.2 g", "step": "0.1 g", "until_below": "1 um/s"}
    falls = make(
        axes={"drive.frequency": ["60 Hz", "80 Hz"]},
        descend={"key": "drive.peak_acceleration", **down},
    )
    assert [row[1] for row in falls.rows] == ["0.5 g", "0.4 g", "0.3 g", "0.2 g"] * 2
    assert falls.until_below == pytest.approx(1e-6)


def test_linspace_geomspace_and_seeded_samplers_are_those_of_numpy_and_scipy(make: Make) -> None:
    linear, geometric = {"linspace": ["0.5 g", "10 g", 20]}, {"geomspace": [1e-3, 1e-1, 5]}
    sweep = make(axes={"drive.peak_acceleration": linear, "liquid.volume_fraction": geometric})
    numbers = np.array([[float(str(peak).split()[0]), fraction] for peak, fraction in sweep.rows]).T
    expected = np.meshgrid(np.linspace(0.5, 10, 20), np.geomspace(1e-3, 1e-1, 5), indexing="ij")
    np.testing.assert_allclose(numbers, np.reshape(expected, (2, 100)), rtol=1e-11)
    whole = make(
        axes={"run.seed": {"linspace": [1, 4, 4]}, "run.cycles": {"geomspace": [10, 40, 3]}}
    )
    assert whole.rows == [(seed, cycles) for seed in (1, 2, 3, 4) for cycles in (10, 20, 40)]
    ranges = {
        "contact.friction.bead_wall": {"uniform": [0.05, 0.3]},
        "liquid.volume_fraction": {"loguniform": [1e-3, 1e-1]},
    }
    for seed in (5, 6):
        sweep = make(sample=[{"points": 8, "seed": seed, "ranges": ranges}])
        unit = qmc.Sobol(d=2, rng=np.random.default_rng(seed)).random(8)
        expected = np.stack([0.05 + 0.25 * unit[:, 0], 1e-3 * 100 ** unit[:, 1]], axis=1)
        np.testing.assert_allclose(np.array(sweep.rows, dtype=float), expected, rtol=1e-11)
    cases = _cases(
        make(
            sample=[{"points": 4, "ranges": {"dimers.radii[0]": {"uniform": ["0.3 mm", "0.4 mm"]}}}]
        )
    )
    assert all(
        3e-4 <= case.walkers[0].radii[0] <= 4e-4 and case.walkers[0].radii[1] == 2e-4
        for case in cases
    )


def test_a_key_that_says_the_same_in_other_words_gives_way(make: Make) -> None:
    (case,) = _cases(make(axes={"drive.gamma0": [0.5]}))
    assert dimer_of(case).gamma0(case.excitation.peak_acceleration) == pytest.approx(0.5)
    (case,) = _cases(make(set={"dimers.mean_radius": "0.25 mm"}, axes={"dimers.sin_delta": [0.2]}))
    assert case.walkers[0].radii == (3e-4, 2e-4)


def test_shipped_sweeps_are_the_papers() -> None:
    fig2 = _cases(load_sweep("fig2"))
    assert len(fig2) == 80
    assert {case.excitation.frequency for case in fig2} == {60.0, 70.0, 80.0, 90.0}
    accelerations = {round(case.excitation.peak_acceleration / 9.8, 9) for case in fig2}
    assert (min(accelerations), max(accelerations)) == (0.5, 10.0)
    fig3 = [
        (dimer_of(case), case.excitation.peak_acceleration) for case in load_sweep("fig3").cases()
    ]
    assert [round(dimer.sin_delta, 3) for dimer, _ in fig3] == [
        0.0,
        0.111,
        0.143,
        0.2,
        0.273,
        0.333,
    ]
    assert all(dimer.gamma0(peak) == pytest.approx(0.5) for dimer, peak in fig3)
    trays = [
        (one.walkers[0].replicates, meetings.derived(one)["coverage"])
        for one in _cases(load_sweep("tray-phases"))
    ]
    numbers, coverages = map(set, zip(*trays, strict=True))
    assert (len(trays), numbers, coverages) == (96, {2, 16, 64}, {0.05, 0.14, 0.25})


BAD: list[tuple[dict[str, Any], str]] = [
    ({"axes": {"drive.frequncy": ["60 Hz"]}}, 'drive.frequncy: unknown key; .*did you mean "frequency"'),
    ({"axes": {"drive.frequency": []}}, "drive.frequency = \\[\\]: expected at least one value"),
    ({"axes": {"drive.frequency": {"linspace": ["60 Hz", "90 Hz", 2.5]}}}, "first value, last value and number"),
    ({"axes": {"liquid.volume_fraction": {"geomspace": [0, 1, 3]}}}, "above zero"),
    ({"axes": {"drive.frequency": ["60 Hz", "60 mHz"]}}, "one unit throughout"),
    ({"axes": {"run.seed": {"linspace": [1, 1000, 2000]}, "drive.frequency": {"linspace": ["60 Hz", "90 Hz", 999]}}},
     "1998000 points"),
    ({"axes": {"run.seed": [1]}, "zip": [{"run.seed": [1]}]}, "varies on two axes"),
    ({"zip": [{"run.seed": [1, 2], "dimers.angle": ["0 deg"]}]}, "as many values .*seed has 2, dimers.angle has 1"),
    ({"sample": [{"points": 4, "method": "sobbol", "ranges": {}}]}, 'did you mean "sobol"'),
    ({"sample": [{"points": 4, "ranges": {"run.seed": [1, 2]}}]}, "uniform"),
    ({"sample": [{"points": 0, "ranges": {"contact.restitution": {"uniform": [0.1, 0.2]}}}]}, "at least 1"),
    ({"descend": {"from": "1 g", "to": "2 g", "step": "0.1 g", "until_below": "1 um/s"}}, "must not be below"),
    ({"descend": {"from": float("inf"), "to": 0, "step": 1, "until_below": "1 um/s"}}, "descend.from = .*a number"),
    ({"axes": {"drive": {"frequency": ["60 Hz"]}, "drive.frequency": ["70 Hz"]}}, "drive.frequency: is given twice"),
    ({"case": ""}, 'case = "": no such file'),
    ({"axis": {}}, 'unknown key; a sweep takes .*did you mean "axes"'),
    ({"set": {"drive.frequncy": "60 Hz"}}, "drive.frequncy: unknown key"),
    ({"case": "."}, r'case = "\.": expected a case file, or the name of a shipped case'),
    *(({"axes": axes}, f"{key}: expected one of {key} and {other}, which replace each other") for axes, key, other in (
        ({"drive.peak_acceleration": ["1 g"], "drive.gamma0": [0.5]}, "drive.peak_acceleration", "drive.gamma0"),
        ({"dimers.sin_delta": [0.1], "dimers.radii": [["3 mm", "2 mm"]]}, "dimers.sin_delta", "dimers.radii"),
    )),
    # What would make the same point twice
    ({"axes": {"drive.frequency": ["80 Hz", "80.0 Hz"]}}, r'"80\.0 Hz": expected different'),
    ({"axes": {"drive.frequency": {"linspace": ["80 Hz", "80 Hz", 3]}}}, "expected different values"),
    ({"sample": [{"points": 4, "ranges": {"contact.restitution": {"uniform": [0.3, 0.2]}}}]}, "smaller value first"),
    ({"axes": {"run.silence": ["1 s", "2 s"]}}, r"run\.silence: unknown key"),
    ({"axes": {"title": ["a", "b"]}}, "title: expected another key"),
]  # fmt: skip


@pytest.mark.parametrize(("tables", "message"), BAD)
def test_a_sweep_that_makes_no_sense(make: Make, tables: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"test.toml: .*{message}") as caught:
        make(**tables)
    assert any(
        word in str(caught.value)
        for word in ("expected", "unknown key", "nor a shipped case", "must ")
    )


@pytest.mark.parametrize("case", ["other", "other.toml", "./other"])
def test_the_base_case_beside_a_sweep_comes_before_that_of_the_working_directory(
    case: str, in_folder: Path
) -> None:
    (in_folder / "below").mkdir()
    for place, acceleration in (("other.toml", "2 g"), ("below/other.toml", "3 g")):
        (in_folder / place).write_text(to_toml(document(drive={"peak_acceleration": acceleration})))
    (in_folder / "below" / "sweep.toml").write_text(f'case = "{case}"\naxes.run.seed = [1]\n')
    assert [point.drive.peak_acceleration for point in load_sweep("below/sweep.toml").cases()] == [
        pytest.approx(29.4)
    ]


FRICTION, RESTITUTION, ROLLING = (
    "contact.friction.bead_wall",
    "contact.restitution",
    "contact.rolling_friction",
)
UNCERTAIN = {FRICTION: [0.05, 0.3], RESTITUTION: [0.2, 0.8], ROLLING: [0.0, 0.01]}


def _with_rank(order: np.ndarray[Any, Any], seed: int, low: float, high: float) -> list[float]:
    """Numbers from 0 to 1 whose rank correlation with an order is between two values, by trial."""
    draw = np.random.default_rng(seed)
    while True:
        values = draw.random(len(order))
        if low < spearmanr(values, order).statistic < high:
            return [*map(float, values)]


def test_a_spread_has_the_quantiles_and_the_signed_ranks_of_its_draws() -> None:
    """32 speeds 0.1 × 1.2ⁿ - 0.5 mm/s that fall with friction; two walkers came apart, a point failed."""
    number = np.arange(32)
    speeds = 1e-4 * 1.2**number - 5e-4
    strong, weak = _with_rank(number, 1, 0.55, 0.6), _with_rank(number, 2, 0.25, 0.3)
    whole = pd.DataFrame(
        {"velocity": speeds, FRICTION: 0.3 - 0.005 * number, RESTITUTION: strong, ROLLING: weak}
    )
    whole["status"], whole["separated_fraction"] = "finished", 0.0
    others = pd.DataFrame({"velocity": [1.0, -1.0, 2.0], "separated_fraction": [0.5, 0.2, 0.0]})
    others = others.assign(
        status=["finished", "finished", "failed"], **dict.fromkeys(UNCERTAIN, 0.2)
    )
    table = pd.concat([whole, others]).sample(frac=1.0, random_state=1).reset_index(drop=True)
    spread = spread_in(table, make_case(uncertain=UNCERTAIN), Path())
    band = spread.bands["velocity"]
    # Of 32 sorted numbers, from 0 to 31, 5 and 95 % are at 1.55 and 29.45, the median between the two in the middle.
    assert band["low"] == pytest.approx(speeds[1] + 0.55 * (speeds[2] - speeds[1]))
    assert band["median"] == pytest.approx((speeds[15] + speeds[16]) / 2.0)
    assert band["high"] == pytest.approx(speeds[29] + 0.45 * (speeds[30] - speeds[29]))
    assert (band["smallest"], band["largest"], band["points"]) == (speeds[0], speeds[31], 32)
    # 0.1 × 1.2ⁿ is below 0.5 up to n = 8.
    assert spread.counts == {"forward": 23, "backward": 9, "at_rest": 0, "separated": 2}
    # Two standard errors are 0.36: rolling friction is left out.
    depends = spread.depends["velocity"]
    assert list(depends.items()) == [
        (FRICTION, pytest.approx(-1.0)),
        (RESTITUTION, pytest.approx(spearmanr(strong, speeds).statistic)),
    ]


def test_bands_along_a_sweep_are_those_of_each_points_spread(tmp_path: Path) -> None:
    case = tmp_path / "base.toml"
    case.write_text(to_toml(document(run=TINY, uncertain={FRICTION: [0.05, 0.3]})))
    tables = {"case": str(case), "axes": {"drive.peak_acceleration": ["3 g", "6 g"]}}
    sweep = walkers.sweep(tables, tmp_path, spread=4)
    table = sweep.table()
    for row in table.itertuples():
        spread = read_json(spread_of(tmp_path / Path(row.run).name) / SPREAD_NAME)["bands"][
            "velocity"
        ]
        assert row.velocity_low == min(spread["low"], row.velocity)
        assert row.velocity_high == max(spread["high"], row.velocity)
        assert row.velocity_low < row.velocity_high
    assert table["velocity_high"].is_monotonic_increasing
    assert "velocity_low (mm/s)  velocity_high (mm/s)" in sweep.describe()
    figure = sweep.figure()
    band = "band: uncertain values only, 5 to 95 % of 4 draws, approximate"
    assert " ".join(figure.get_suptitle().split()).endswith(
        f"{band}; the error of the model is not in it"
    )
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [band]


def test_points_that_differ_in_their_seed_alone_are_a_group() -> None:
    """A law that a case may leave to the program ("auto", none) is a value as others."""
    values = {
        "drive.frequency": [90.0, 60.0] * 3,
        "contact.law": ["auto", 1.0, "auto", None, "auto", None],
    }
    table = pd.DataFrame({**values, "run.seed": [1, 1, 2, 1, 3, 2], "boundary.tilt": 0.0})
    table.attrs["varied"] = list(table)
    found = [(named, list(rows.index)) for named, rows in seed_groups(table)]
    assert [rows for _, rows in found] == [[0, 2, 4], [1], [3, 5]]
    assert found[1][0] == {"drive.frequency": 60.0, "contact.law": 1.0}
    ((named, rows),) = seed_groups(table.loc[[0, 2, 4]])
    assert (named, list(rows.index), rows.attrs["varied"]) == ({}, [0, 2, 4], list(table))


def test_a_key_may_be_a_word_at_some_points_and_a_list_at_others(
    make: Make, tmp_path: Path
) -> None:
    sweep = make(axes={"drive": {"axis": ["x", "y", [1, 0, 1]]}})
    record = SweepRecord(tmp_path / "test", sweep, [f"base-{number:012d}" for number in range(3)])
    table = table_of(record).frame
    assert key_values(table, "drive.axis") == (["x", "y", [1, 0, 1]], "")
    assert [len(rows) for _, rows in seed_groups(table)] == [1, 1, 1]


def test_a_descents_thresholds_have_the_gamma0_of_their_own_drives() -> None:
    """Two descents from 1.2 g in steps of 0.2 g; walkers of the first go toward their small beads."""
    speeds = [[-3e-4, -1e-4, 1e-6], [2e-4, -1e-6, 2e-5]]
    dimer = dimer_of(make_case())
    rows = [
        {
            "point": 5 * descent + step,
            "drive.frequency": 60.0 + 30.0 * descent,
            "velocity": speed,
            "status": "finished",
        }
        for descent, of in enumerate(speeds)
        for step, speed in enumerate(of)
    ]
    rows.append({"point": 3, "drive.frequency": 60.0, "velocity": np.nan, "status": "failed"})
    table = pd.DataFrame(rows).sort_values("point", ignore_index=True)
    table["drive.peak_acceleration"] = 1.2 - 0.2 * (table["point"] % 5)
    table["gamma0"] = [dimer.gamma0(9.80665 * g) for g in table["drive.peak_acceleration"]]
    units = {"drive.frequency": "Hz", "drive.peak_acceleration": "g"}
    table.attrs |= {"units": units, "varied": list(units), "until_below": 1e-5}
    first, second = thresholds(table).to_dict("records")
    for row, moving, at_rest in ((first, 1.0, 0.8), (second, 1.2, 1.0)):
        assert (row["moving"], row["at_rest"]) == pytest.approx((moving, at_rest))
        # Γ0 = M a0/4πγR̄ is proportional to the drive.
        mass, force = (
            4000.0 * 4.0 / 3.0 * np.pi * (0.3e-3**3 + 0.2e-3**3),
            4.0 * np.pi * 19.2e-3 * 0.25e-3,
        )
        expected = [mass * 9.80665 * g / force for g in (moving, at_rest)]
        assert [row["gamma0_moving"], row["gamma0_at_rest"]] == pytest.approx(expected, rel=0.05)
        assert row["gamma0_moving"] / row["gamma0_at_rest"] == pytest.approx(moving / at_rest)


def test_a_spread_over_what_nobody_measured(runs_folder: Path) -> None:
    """Glass on polystyrene at 10 g walks or not as one guesses; the single number, exact to 1e-5, does not say so."""
    case = build_case({**GLASS, "run": {"cycles": 6}}, name="guessed")
    spread = run_spread(case, runs_folder, SweepOptions(2), points=4)
    warned = [
        run.result.warnings for run in walkers.load(spread.directory).runs if run.result.warnings
    ]
    assert warned == list(spread.doubts)
    told = spread_text(replace(spread, doubts=[["one", "two"], ["three"]]))
    assert "warning  2 draws with warnings, first: one\n" in told
    rough = {
        "contact.roughness.bead_bead",
        "contact.roughness.bead_wall",
    }  # of the library, for these materials
    assert {one.key for one in spread.varied} == {
        one.key for one in case.origins if one.guessed
    } | rough
    given = {"contact.friction.bead_bead", "contact.rolling_friction"}
    liquid = {
        f"liquid.{name}" for name in ("name", "surface_tension", "density", "kinematic_viscosity")
    }
    assert {one.key for one in spread.held} == given | liquid
    text = spread_text(spread)
    assert "contact_angle 0 deg (0 deg to 60 deg)" in text
    assert "liquid.kinematic_viscosity 14.5 mm^2/s (ethylene glycol), contact." in " ".join(
        text.split()
    )
    assert text.count("median") == 1  # of the result
    table = walkers.load(spread.directory).table()
    assert table["contact.friction.bead_wall"].between(0.1, 0.6).all()
    assert (
        table["liquid.volume_fraction"] > 0.01
    ).sum() == 2  # half of the draws: the case's own is the median
    assert (
        table["liquid.contact_angle"] == 0.0
    ).sum() == 2  # its own is the end of what is possible
    assert sum(spread.counts.values()) == 4
    # The headline has the band from now on, which holds it.
    done, band = walkers.run(case, runs_folder), spread.bands["velocity"]
    # The report shows the figure; no draw keeps what only pictures read, and a picture says how to get it.
    page = done.report().read_text("utf-8")
    assert 'aria-label="spread"' in page
    for text in (
        "4 draws: too few for rank correlations",
        "4 draws, approximate",
        fixed_values_text(spread.held),
    ):
        assert text in page
    assert "rank correlation " not in page
    assert list(done.directory.rglob("beads.bin"))
    drawn = [Path(place) for place in table["run"]]
    assert not [path for place in drawn for path in place.rglob("beads.bin")]
    assert read_json(drawn[0] / "manifest.json")["left_out"]
    with pytest.raises(DumpError, match=r"beads\.bin was left out.*walkers run .*--force"):
        walkers.load(drawn[0]).render()
    assert band["high"] - band["low"] > 1e-4  # m/s
    own, ends = done.result["velocity"], (done.result["velocity_low"], done.result["velocity_high"])
    assert ends == (min(band["low"], own), max(band["high"], own))
    assert f"band {band_text(*ends, 'm/s')} (4 draws, approximate)" in done.describe()
    told = {one["key"]: one["origin"] for one in done.result.about["rests_on"]}
    assert told["contact.friction.bead_wall"] == "given"
    assert told.keys() == unmeasured().keys() - {
        "liquid.meniscus_radius"
    }  # in place of which there is a fraction
    # It is for its ranges alone, with which a run does not change its name.
    done = walkers.run(
        build_case({**case.document, "uncertain": {"contact.friction.bead_wall": [0.2, 0.6]}}),
        runs_folder,
    )
    assert "velocity_low" not in done.result
    with pytest.raises(
        InputError, match=r"uncertain.contact.restitution.*: expected a range that holds"
    ):
        spread_sweep(
            build_case({**GLASS, "uncertain": {"contact.restitution": [0.4, 0.8]}}, name="beside")
        )
    with pytest.raises(InputError, match="no value is uncertain"):
        run_spread(build_case(REFERENCE), runs_folder, SweepOptions(2))
