"""Where the values of a case come from, values put beside a file, and what a result is worth."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import REFERENCE, call, document, make_case, origins, to_toml
from walkers.errors import InputError
from walkers.inputs import library
from walkers.inputs.case import Case
from walkers.inputs.keys import settings_of
from walkers.inputs.origins import Origin
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.sweep import load_sweep
from walkers.inputs.table import changed
from walkers.postprocess.gait import SEPARATED
from walkers.postprocess.numbers import band_text
from walkers.postprocess.uncertainty import lines_of_rest, rests_on
from walkers.runner.files import read_json
from walkers.sweeps.scheduler import Options
from walkers.sweeps.spread import describe, run_spread, spread_sweep

# Glass beads on polystyrene in glycol, materials that the paper names: nobody has measured how they touch.
GLASS = {
    "dimers": {"radii": ["0.3 mm", "0.2 mm"], "replicates": 2},
    "beads": {"material": "glass"},
    "liquid": {"name": "ethylene glycol"},
    "boundary": {"material": "polystyrene"},
    "drive": {"frequency": "80 Hz", "peak_acceleration": "10 g"},
    "contact": {"friction": {"bead_bead": 0.3, "bead_wall": 0.3}, "rolling_friction": 0.0, "youngs_modulus": "10 MPa"},
    "run": {"cycles": 6},
    "uncertain": {"contact": {"friction": {"bead_wall": {"loguniform": [0.1, 0.6]}}}},
}


def test_values_know_where_they_come_from() -> None:
    found = origins(load_case("fig1b"))
    assert (found["drive.frequency"].origin, found["drive.frequency"].text) == ("given", "80 Hz")
    assert found["beads.density"] == Origin(
        "beads.density", "4.0 g/cm^3", "library", library.library_of({}).numbers("materials", "ruby")["density"].source
    )
    friction = found["contact.friction.bead_wall"]
    assert friction.origin == "calibrated"
    assert found["contact.restitution"].source.startswith("assumed in the calibration")
    assert found["contact.restitution"].origin == "assumed"
    assert friction.range is not None
    assert friction.range[0] < float(friction.text) < friction.range[1]
    assert found["dimers.replicates"] == Origin("dimers.replicates", "6", "default")
    assert found["liquid.dynamic_viscosity"].text == "4.6 mPa*s"  # 5 mm²/s times 0.92 g/cm³, not that of the bridges
    assert found["run.time_step"].source.startswith("auto: 0.4 of the rayleigh limit, ")
    assert not any(one.guessed for one in found.values())
    # What was calibrated with other liquids, or another law, is a guess.
    assert origins(load_case("fig1b", {"liquid.name": "Si AK10"}))["liquid.volume_fraction"].origin == "calibrated"
    fraction = origins(load_case("fig1b", {"liquid.name": "glycerol 87 %"}))["liquid.volume_fraction"]
    assert (fraction.origin, fraction.text, fraction.guessed) == ("default", "0.022", True)
    assert "Si AK5 and Si AK10" in fraction.source
    assert fraction.range == library.unmeasured()["liquid.volume_fraction"].range
    assert origins(load_case("fig1b", {"liquid.law": "willett"}))["liquid.viscosity_ratio"].guessed


LENGTHS = {
    "fig1b": ("4 of 12, 8 of 24, 20 of 60", "derived", "checked after 12 and 24 cycles"),
    "tray": ("20", "derived", "from the duration"),
    "pile-ci": ("0", "default", "from the duration, rounded up to a multiple of 3 cycles (one sample)"),
}


@pytest.mark.parametrize("name", LENGTHS)
def test_the_length_of_a_run_says_how_it_follows(name: str) -> None:
    found = origins(load_case(name))
    settling = found["run.settling_cycles"]
    assert (settling.text, settling.origin, found["run.cycles"].source) == LENGTHS[name]
    assert settling.value == load_case(name).run.settling_cycles


@pytest.mark.parametrize("name", sorted(shipped("case")))
def test_the_origins_tell_the_numbers_of_the_case(name: str) -> None:
    """Each text, read as a file's, gives the same case: nothing is told that is not so."""
    case = load_case(name)
    own = [one for one in case.origins if one.origin not in ("given", "derived")]
    matter = [one for one in own if one.key.split(".")[0] in ("beads", "liquid", "contact")]
    assert len(matter) >= 10
    told = settings_of(f"{one.key} = {one.text}" for one in matter)
    again = load_case(name, told)
    assert (again.contact, again.beads) == (case.contact, case.beads)
    assert again.liquid.of_bridges == case.liquid.of_bridges
    assert {one.origin for one in again.origins if one.key in told} == {"given"}


def test_another_material_loses_what_was_calibrated_and_says_so() -> None:
    found = origins(Case.read(GLASS))
    guessed = {key: one.text for key, one in found.items() if one.guessed}
    assert guessed == {
        "liquid.volume_fraction": "0.01",
        "liquid.viscosity_ratio": "1",
        "liquid.contact_angle": "0 deg",
        "contact.restitution": "0.3",
        "contact.minimum_separation_ratio": "0.01",
        "contact.friction.bead_wall": "0.3",  # given, and called uncertain
    }
    assert found["contact.friction.bead_wall"].range == (0.1, 0.6)
    assert not found["contact.friction.bead_bead"].guessed  # given, and not called uncertain


@pytest.mark.parametrize(
    ("ranges", "told"),
    [
        ({"contact.frictio": [0.1, 0.2]}, "uncertain.contact.frictio = [0.1, 0.2]: unknown key"),
        (
            {"contact.restitution": [0.6, 0.2]},
            "uncertain.contact.restitution = [0.6, 0.2]: expected the smaller value first",
        ),
        ({"contact.restitution": 0.2}, "uncertain.contact.restitution = 0.2: expected [low, high]"),
        ({"drive.frequency": ["1 Hz", "2 kHz"]}, 'uncertain.drive.frequency = ["1 Hz", "2 kHz"]: expected one unit'),
        ({"drive.axis": ["x", "y"]}, 'uncertain.drive.axis = ["x", "y"]: expected a number'),
        ({"liquid.contact_angle": ["1 mm", "2 mm"]}, 'uncertain.liquid.contact_angle = "1 mm": expected an angle'),
        ({"contact.restitution": [0.5, 2.0]}, "uncertain.contact.restitution = 2.0: expected at most 1"),
    ],
)
def test_ranges_that_are_none_are_refused(ranges: dict[str, object], told: str) -> None:
    with pytest.raises(InputError) as caught:
        Case.read({**GLASS, "uncertain": ranges})
    assert told in str(caught.value)


def test_a_range_holds_the_value_of_its_case_which_points_of_sweeps_may_leave() -> None:
    tables = {**GLASS, "uncertain": {"contact.friction.bead_wall": [0.4, 0.6]}}
    with pytest.raises(InputError, match=r"^<case>: uncertain\.contact\.friction\.bead_wall: expected .* value, 0\.3$"):
        load_case(tables)
    assert load_case(tables, {"contact.friction.bead_wall": 0.4}).contact.friction.bead_wall == 0.4
    assert Case.read(tables).contact.friction.bead_wall == 0.3


def test_a_changed_value_is_validated_like_a_file() -> None:
    case = load_case("fig1b", {"drive.frequency": "70 Hz"})
    assert case == Case.read(case.document, name="fig1b")
    assert case.run.period == pytest.approx(1.0 / 70.0, rel=1e-12)
    for changes, told in (
        ({"drive.frequenzy": "70 Hz"}, 'did you mean "frequency"?'),
        ({"dimers.radii[2]": "1 mm"}, "the base case has no dimers.radii of that length"),
        ({"drive": "70 Hz"}, "is a table of a case"),
    ):
        with pytest.raises(InputError) as caught:
            load_case("fig1b", changes)
        assert told in str(caught.value)
    with pytest.raises(InputError, match=r"clusters is a list: say which one, such as clusters\[0\]"):
        changed(Case, {"clusters": [{}]}, {"clusters.angle": "45 deg"})
    # What says the same in other words goes, in one of several harmonics as well.
    assert load_case("fig1b", {"drive.gamma0": 0.5}).drive.peak_acceleration > 50.0
    harmonic = {"drive.harmonics[0].peak_acceleration": "4 g"}
    tables = changed(Case, {"drive": {"harmonics": [{"gamma0": 1.0}]}}, harmonic)
    assert tables["drive"]["harmonics"] == [{"peak_acceleration": "4 g"}]


def test_a_case_is_changed_as_its_file_would_be(tmp_path: Path) -> None:
    """All values follow, with their origins; the case itself stays as it was."""
    case = load_case("fig1b", {"run.cycles": 2, "run.settling_cycles": 0, "dimers.replicates": 1})
    faster = case.changed({"drive.frequency": "120 Hz", "contact.friction.bead_wall": 0.5, "liquid.name": "Si AK10"})
    assert (case.drive.frequency, case.changed({})) == (80.0, case)
    assert (faster.drive.frequency, faster.contact.friction.bead_wall, faster.name) == (120.0, 0.5, "fig1b")
    assert faster.run.period == pytest.approx(1.0 / 120.0, rel=1e-12)
    assert faster.liquid.dynamic_viscosity == pytest.approx(9.3e-3)
    assert origins(faster)["contact.friction.bead_wall"].word == "given"
    assert faster.document["drive"]["frequency"] == "120 Hz"
    assert case.for_cycles(2).origins == case.but(name="other").origins == case.origins
    with pytest.raises(InputError, match=r'fig1b: --set drive\.frequency = "80 mm": expected a frequency'):
        case.changed({"drive.frequency": "80 mm"})
    # Values that are put in without validation do not run with the steps of others.
    with pytest.raises(InputError, match=r"drive.frequency = 120 Hz: time step and sampling are of 80 Hz"):
        walkers.run(case.put("drive.frequency", 120.0), tmp_path)
    with pytest.raises(InputError, match=r"run.time_step = .* limit of the case as changed"):
        walkers.run(case.put("contact.youngs_modulus", 1e10), tmp_path)


def test_a_case_may_be_a_dictionary() -> None:
    case = load_case(REFERENCE)
    assert (case, case.name) == (Case.read(REFERENCE), "case")
    assert load_case(REFERENCE, {"drive.frequency": "70 Hz"}).drive.frequency == 70.0
    with pytest.raises(InputError, match=r'^<case>: drive\.frequency = "80": expected a frequency with its unit'):
        load_case(document(drive={"frequency": "80"}))


def test_a_case_shows_what_is_given_and_where_the_rest_is_from() -> None:
    case = load_case("fig1b", {"title": "<1b>"})
    assert repr(case).startswith("<Case fig1b: ")
    assert "drive.frequency = 80 Hz" in repr(case)
    assert "density" not in repr(case)
    shown = case._repr_html_()
    assert "<caption>&lt;1b&gt;</caption>" in shown
    assert "<tr><td>drive.frequency</td><td>80 Hz</td><td>given</td><td></td></tr>" in shown
    assert re.search(r"<td>beads.density</td><td>4.0 g/cm\^3</td><td>library</td><td>\w", shown)


HARMONICS = [{"frequency": "80 Hz", "gamma0": 0.2}, {"frequency": "120 Hz", "peak_acceleration": "1 g", "axis": "y"}]
ODD: dict[str, dict[str, Any]] = {
    "harmonics": {"drive": {"harmonics": HARMONICS}},
    "aslant": {"drive": {**REFERENCE["drive"], "axis": [1, 0, 2], "waveform": "sawtooth", "phase": "10 deg"}},
    "places": {"clusters": [{"diameters": ["0.6 mm", "0.4 mm"], "at": [["0.2 mm", "0 mm"], ["-0.29 mm", "0 mm"]]}]},
    "mean": {"dimers": {"mean_radius": "0.25 mm", "sin_delta": 0.2, "gap": "auto"}, "run": {"cycles": "auto"}},
    "placed": {"placed": [{"diameter": "2 mm", "at": ["19 mm", "0 mm", "1 mm"]}], "run": {"duration": "0.1 s"}},
    "uncertain": {"uncertain": {"dimers.radii[1]": ["0.1 mm", "0.3 mm"], "contact": {"restitution": [0.2, 0.4]}}},
    "slope": {"boundary": {"material": "glass", "tilt": "20 deg", "uphill": "180 deg"}},
}


@pytest.mark.parametrize("name", [*sorted(shipped("case")), *ODD])
def test_a_case_is_kept_as_json(name: str) -> None:
    """With all of its values, where they are from, and its file."""
    case = Case.read({**document(), **ODD[name]}, name=name) if name in ODD else load_case(name)
    again = Case.from_dict(json.loads(json.dumps(case.as_dict())))
    assert (again, again.name, again.document) == (case, case.name, case.document)
    assert again.determinants() == case.determinants()
    assert (again.origins, again.sources) == (case.origins, case.sources)
    assert [one.value for one in again.origins] == [one.value for one in case.origins]


def test_damaged_json_is_no_case() -> None:
    kept = load_case("fig1b").as_dict()
    run = {key: value for key, value in kept["run"].items() if key != "time_step"}
    for damaged in (
        [],
        {**kept, "document": 3},
        {**kept, "sources": {"key": 1}},
        {**kept, "beads": {}},
        {**kept, "run": [run]},
    ):
        with pytest.raises(ValueError, match=":"):
            Case.from_dict(damaged)  # type: ignore[arg-type]


def test_what_is_called_uncertain_keeps_where_it_comes_from(tmp_path: Path) -> None:
    ranges = {"liquid.surface_tension": ["15 mN/m", "25 mN/m"], "contact.friction.bead_wall": [0.2, 0.4]}
    tables = load_case("fig1b").document
    tables = {**tables, "uncertain": {**ranges, "dimers.radii[1]": ["0.19 mm", "0.21 mm"]}}
    case, file = Case.read(tables), tmp_path / "ranges.toml"
    file.write_text(to_toml(tables))
    found = origins(case)
    tension, friction, radius = (found[key] for key in (*ranges, "dimers.radii[1]"))
    assert (tension.origin, tension.text, tension.range) == ("library", "19.2 mN/m", ("15 mN/m", "25 mN/m"))
    assert "the paper" in tension.source
    assert (friction.origin, friction.guessed, friction.range) == ("calibrated", True, (0.2, 0.4))
    assert (radius.text, radius.guessed) == ("0.2 mm", True)
    # In the same words wherever it is shown.
    words = [f"{one}, uncertain" for one in ("library", "calibrated", "given")]
    assert [one.word for one in (tension, friction, radius)] == words
    assert ", uncertain, range 0.2 to 0.4" in call("show", str(file), check=True).stdout
    assert "  uncertain  surface_tension 19.2 mN/m, friction.bead_wall" in "\n".join(
        lines_of_rest(rests_on(case.origins))
    )
    assert {*ranges, "dimers.radii[1]"} < set(spread_sweep(case, 2).keys)


def test_settings_are_read_as_a_file_would() -> None:
    words = {"drive.frequency=70Hz": "70Hz", "liquid.name = Si AK10": "Si AK10", "run.cycles=8": 8}
    words |= {"dimers.meet=false": False, "drive.axis=[1, 0, 0]": [1, 0, 0]}
    assert list(settings_of(words).values()) == list(words.values())
    for wrong, told in ((["drive.frequency"], "key=value"), (["a=1", "a=2"], "given twice")):
        with pytest.raises(InputError, match=told):
            settings_of(wrong)


def test_set_on_the_command_line() -> None:
    shown = json.loads(call("show", "fig1b", "--set", "drive.frequency=70Hz", "--json", check=True).stdout)
    assert shown["case"]["drive"]["frequency"] == 70.0
    (given,) = [one for one in shown["case"]["origins"] if one["key"] == "drive.frequency"]
    assert {"text": "70Hz", "value": 70.0, "origin": "given"}.items() <= given.items()
    text = call("show", "fig1b", check=True).stdout
    assert re.search(r"^ +frequency +80 Hz +given$", text, flags=re.MULTILINE)
    assert re.search(r"^ +volume_fraction .* calibrated with Si AK5 and Si AK10, range ", text, flags=re.MULTILINE)


def test_a_sweep_with_a_setting_has_a_directory_of_its_own(in_folder: Path) -> None:
    planned = call("sweep", "fig4", "--set", "run.cycles=8", "--dry-run", check=True).stdout
    assert "runs/fig4,run.cycles=8" in planned
    keys = ("friction.bead_bead", "friction.bead_wall", "restitution", "rolling_friction")
    many = {f"contact.{key}": 0.1 for key in keys}
    names = {load_sweep("fig4", {**many, "run.cycles": 8, "run.seed": seed}).name for seed in (1, 2)}
    assert len(names) == 2, "names that are cut differ as their settings do"
    assert max(map(len, names)) <= 120


def test_names_and_what_no_law_asks_for_do_not_determine_a_run() -> None:
    case = make_case(liquid={"dynamic_viscosity": "4.6 mPa*s"})
    tables = document(
        title="other",
        beads={"material": "rubies", "density": "4.0 g/cm^3"},
        boundary={"material": "chromium"},
        liquid={"surface_tension": "19.2 mN/m", "dynamic_viscosity": "4.6 mPa*s"},
        run={"settled_below": "1 mm/s"},
    )
    del tables["liquid"]["name"]
    named = Case.read(tables)
    assert named != case
    assert named.determinants() == case.determinants()
    assert make_case(run={"seed": 2}).determinants() != make_case().determinants()


def test_a_result_says_what_it_rests_on(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    """The reference's case gives all of it: nobody measured them, so they are told all the same."""
    case = make_case(run={"cycles": 2, "settling_cycles": 0})
    done = walkers.load(run_directory(case))
    told = {one["key"]: one for one in done.result.about["rests_on"]}
    assert told["contact.friction.bead_wall"]["origin"] == "given"
    assert told.keys() == library.unmeasured().keys()
    assert "  given      " in done.describe()
    assert (done.case, done.case.document) == (case, case.document)
    assert [(one.key, one.origin) for one in done.case.origins] == [(one.key, one.origin) for one in case.origins]


def test_a_spread_over_what_nobody_measured(runs_folder: Path) -> None:
    """Glass on polystyrene at 10 g walks or not as one guesses; the single number, exact to 1e-5, does not say so."""
    case = Case.read(GLASS, name="guessed")
    spread = run_spread(case, runs_folder, Options(2), points=4)
    assert {one.key for one in spread.varied} == {one.key for one in case.origins if one.guessed}
    assert {one.key for one in spread.held} == {"contact.friction.bead_bead", "contact.rolling_friction"}
    assert "fixed    contact.friction.bead_bead 0.3" in describe(spread)
    assert "contact_angle 0 deg (0 deg to 60 deg; half of the draws at 0 deg)" in describe(spread)
    assert "too few draws for rank correlations" in describe(spread)
    assert spread.depends == {"velocity": {}}
    table = walkers.load(spread.directory).table()
    assert table["contact.friction.bead_wall"].between(0.1, 0.6).all()
    assert (table["liquid.viscosity_ratio"] > 1.0).sum() == 2  # half of the draws: the case's own is the median
    assert (table["liquid.contact_angle"] == 0.0).sum() == 2  # its own is the end of what is possible
    band, speeds = spread.bands["velocity"], table["velocity"]
    speeds = speeds[~(table["separated_fraction"] > SEPARATED)]
    assert (band.smallest, band.median, band.largest) == (speeds.min(), speeds.median(), speeds.max())
    assert band.high - band.low > 1e-4  # m/s
    assert sum(spread.counts.values()) == 4 == band.points + spread.counts["separated"]
    assert (speeds > 2e-5).sum() == spread.counts["forward"]
    # The headline has the band from now on, which holds it; before it was said what is not known.
    done = walkers.run(case, runs_folder)
    own, ends = done.result["velocity"], (done.result["velocity_low"], done.result["velocity_high"])
    assert ends == (min(band.low, own), max(band.high, own))
    assert f"band {band_text(*ends, 'm/s')}" in done.describe()
    unspread = walkers.run(Case.read({**GLASS, "run": {"cycles": 5}}, name="guessed"), runs_folder)
    assert "velocity_low" not in unspread.result
    with pytest.raises(InputError, match=r"uncertain.contact.restitution.*: expected a range that holds"):
        spread_sweep(Case.read({**GLASS, "uncertain": {"contact.restitution": [0.4, 0.8]}}, name="beside"))
    # A case of which all is given has none.
    with pytest.raises(InputError, match="no value is uncertain"):
        run_spread(Case.read(REFERENCE), runs_folder, Options(2))


def test_spread_on_the_command_line(in_folder: Path) -> None:
    (in_folder / "glass.toml").write_text(to_toml(GLASS))
    words = ("--spread", "--points", "2", "--set", "run.cycles=24")
    told = call("run", "glass.toml", *words, check=True).stdout
    (record,) = in_folder.glob("runs/*-spread/sweep.json")
    assert read_json(record)["file"]["set"]["run.cycles"] == 24
    assert "  guessed    " in told
    assert "(not of these materials and this liquid)" in " ".join(told.split())
    assert "(5 to 95 %)" in told


def test_a_band_is_shown_for_its_ranges_alone(tmp_path: Path) -> None:
    """A run keeps its name when ranges change, and is not said to have the band of the former ones."""

    def case(*friction: float) -> Case:
        return make_case(run={"cycles": 6, "settling_cycles": 2}, uncertain={"contact.friction.bead_wall": [*friction]})

    run_spread(case(0.05, 0.6), tmp_path, Options(2), points=2)
    for ranges, shown in (((0.05, 0.6), True), ((0.1, 0.3), False)):
        done = walkers.run(case(*ranges), tmp_path)
        assert ("velocity_low" in done.result) == shown
        assert bool(re.search(r"band -?\d", done.describe())) == shown


def test_an_end_of_a_range_may_be_the_value_of_the_case() -> None:
    tables = document(dimers={"gap": "-0.2 um"}, uncertain={"dimers.gap": ["-0.2 um", "-0.1 um"]})
    assert origins(load_case(tables))["dimers.gap"].uncertain
    with pytest.raises(InputError, match=r"holds the case's own value, -0\.3 um"):
        load_case(tables, {"dimers.gap": "-0.3 um"})
