"""Other values of a case: keys that replace each other, and files that are no longer needed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import walkers
from tests.conftest import call, document, to_toml
from walkers import load_case
from walkers.inputs.config_table import changed, replaced_keys
from walkers.inputs.keys import settings_of, written
from walkers.inputs.reading import shipped
from walkers.inputs.sweep import expand, load_sweep
from walkers.inputs.tables.case import CaseFile
from walkers.inputs.toml import read_toml

CUP = """\
solid cup
{facets}
endsolid cup
"""
SIDES = [(-3, -3), (3, -3), (3, 3), (-3, 3)]
"""Corners of the floor of a cup, x and y in mm."""
HEIGHT = 40
"""Height of the cup, mm."""


def cup() -> str:
    """An STL of a box that is open at its top, 6 mm wide, in mm."""
    floor = [(x, y, 0) for x, y in SIDES]
    triangles = [floor[:3], [floor[0], floor[2], floor[3]]]
    for number in range(4):
        first = floor[number]
        second = floor[(number + 1) % 4]
        above_first = (*first[:2], HEIGHT)
        above_second = (*second[:2], HEIGHT)
        triangles += [[first, second, above_second], [first, above_second, above_first]]
    facets = []
    for triangle in triangles:
        vertices = "\n".join(f"vertex {x} {y} {z}" for x, y, z in triangle)
        facets.append(f"facet normal 0 0 0\nouter loop\n{vertices}\nendloop\nendfacet")
    return CUP.format(facets="\n".join(facets))


def pile(**boundary: Any) -> dict[str, Any]:
    """The tables of the small shipped pile in another boundary."""
    tables = read_toml(shipped("case")["pile-small"])
    return {**tables, "boundary": {"material": "polystyrene", **boundary}}


@pytest.mark.parametrize(
    ("change", "replaced"),
    [
        ({"drive.gamma0": 0.4}, ["drive.peak_acceleration"]),
        ({"dimers.diameters": ["0.6 mm", "0.4 mm"]}, ["dimers.radii"]),
        ({"liquid.volume_fraction": 0.01}, ["liquid.meniscus_radius"]),
        ({"liquid.dynamic_viscosity": "5 mPa*s"}, ["liquid.kinematic_viscosity"]),
        (
            {"boundary.mesh": "cup.stl"},
            ["boundary.height", "boundary.shape", "boundary.width"],
        ),
        ({"boundary.shape": "plane"}, ["boundary.height", "boundary.width"]),
        ({"boundary.shape": "cylinder"}, []),
        ({"drive.frequency": "70 Hz"}, []),
    ],
)
def test_a_key_replaces_those_that_say_the_same_in_other_words(
    change: dict[str, Any], replaced: list[str]
) -> None:
    tables = {
        "boundary": {"shape": "box", "width": "5 mm", "height": "9 mm"},
        "dimers": {"radii": ["0.3 mm", "0.2 mm"]},
        "liquid": {"meniscus_radius": "70 um", "kinematic_viscosity": "5 mm^2/s"},
        "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
    }
    (key,) = change
    assert replaced_keys(CaseFile, tables, change).get(key, []) == replaced


def test_planes_replace_a_mesh_and_a_mesh_replaces_planes() -> None:
    mesh = {"boundary": {"mesh": "cup.stl", "scale": "1 mm"}}
    planes = {"boundary": {"planes": [], "height": "9 mm"}}
    assert replaced_keys(CaseFile, mesh, {"boundary.planes": []}) == {
        "boundary.planes": ["boundary.mesh", "boundary.scale"]
    }
    assert replaced_keys(CaseFile, planes, {"boundary.mesh": "cup.stl"}) == {
        "boundary.mesh": ["boundary.height", "boundary.planes"]
    }


def test_changes_that_belong_together_do_not_replace_each_other() -> None:
    tables = {"boundary": {"mesh": "cup.stl", "scale": "1 mm"}}
    changes = {"boundary.shape": "box", "boundary.width": "5 mm", "boundary.height": "9 mm"}
    assert replaced_keys(CaseFile, tables, changes) == {
        "boundary.shape": ["boundary.mesh", "boundary.scale"]
    }


TABLE = {
    "contact.friction.bead_wall.at_rest": 0.1,
    "contact.friction.bead_wall.rise": 0.4,
    "contact.friction.bead_wall.half_rise_velocity": "20 mm/s",
}
"""All keys of a table of friction."""
NUMBER = {"contact.friction.bead_wall": 0.25}


def test_a_table_of_friction_and_a_number_replace_each_other() -> None:
    with_number = {"contact": {"friction": {"bead_wall": 0.5}}}
    (number_key,) = NUMBER
    assert replaced_keys(CaseFile, with_number, TABLE) == {key: [number_key] for key in TABLE}
    with_table = changed(CaseFile, with_number, TABLE)
    assert replaced_keys(CaseFile, with_table, NUMBER) == {number_key: sorted(TABLE)}


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({"contact.friction.bead_wall.rise": 0.4}, id="a part alone"),
        pytest.param({**NUMBER, **TABLE}, id="number and table"),
        pytest.param({"contact.friction.bead_wall": 0.3}, id="another number"),
    ],
)
def test_what_replaces_no_number_is_not_told_to_replace_it(changes: dict[str, Any]) -> None:
    """The first two are refused where they are made."""
    assert replaced_keys(CaseFile, {"contact": {"friction": {"bead_wall": 0.5}}}, changes) == {}


def test_the_program_tells_in_a_line_that_a_table_replaces_a_number(in_folder: Path) -> None:
    changes = [f"--set={key}={value}" for key, value in TABLE.items()]
    done = call("show", "climber", *changes, check=True)
    line = f"walkers: {', '.join(TABLE)} replace contact.friction.bead_wall of the case\n"
    assert done.stderr == line


@pytest.mark.parametrize(
    "command", [["show"], ["show", "--theory"], ["export", "--format", "deck"]]
)
def test_the_program_tells_what_a_change_replaces(command: list[str], in_folder: Path) -> None:
    done = call(*command, "fig1b", "--set", "drive.gamma0=0.4", check=True)
    line = "walkers: drive.gamma0 replaces drive.peak_acceleration of the case\n"
    assert done.stderr.count(line) == 1


def test_a_sweep_tells_what_a_change_replaces(in_folder: Path) -> None:
    sweep = 'case = "fig1b"\n[axes]\ndrive.frequency = ["60 Hz", "80 Hz"]\n'
    (in_folder / "two.toml").write_text(sweep)
    done = call("sweep", "two.toml", "--dry-run", "--set", "drive.gamma0=0.4", check=True)
    assert done.stderr == "walkers: drive.gamma0 replaces drive.peak_acceleration of the case\n"


@pytest.mark.parametrize("command", ["run fig1b", "sweep two.toml"])
def test_quiet_does_not_tell_what_a_change_replaces(command: str, in_folder: Path) -> None:
    sweep = 'case = "fig1b"\n[axes]\ndrive.frequency = ["60 Hz", "80 Hz"]\n'
    (in_folder / "two.toml").write_text(sweep)
    change = ["--dry-run", "--set", "drive.gamma0=0.4"]
    assert "replaces" in call(*command.split(), *change, check=True).stderr
    assert "replaces" not in call(*command.split(), *change, "--quiet", check=True).stderr


def test_compare_tells_what_a_change_replaces_once(in_folder: Path) -> None:
    done = call("compare", "fig1b", "--set", "drive.gamma0=0.4", check=True)
    assert done.stderr == "walkers: drive.gamma0 replaces drive.peak_acceleration of the case\n"


def test_a_change_without_a_counterpart_is_made_in_silence(in_folder: Path) -> None:
    done = call("show", "fig1b", "--set", "drive.frequency=70 Hz", check=True)
    assert done.stderr == ""


# --- files ----------------------------------------------------------------------------------------


def test_a_missing_mesh_is_replaced_by_another_one(in_folder: Path) -> None:
    (in_folder / "pile.toml").write_text(to_toml(pile(mesh="missing.stl", scale="1 mm")))
    (in_folder / "cup.stl").write_text(cup())
    case = load_case("pile.toml", {"boundary.mesh": "cup.stl"})
    assert case.boundary.vessel.height == pytest.approx(1e-3 * HEIGHT)
    assert call("show", "pile.toml").returncode == 2


def test_a_missing_mesh_is_replaced_by_a_shape(in_folder: Path) -> None:
    (in_folder / "pile.toml").write_text(to_toml(pile(mesh="missing.stl", scale="1 mm")))
    box = {"boundary.shape": "box", "boundary.width": "6 mm", "boundary.height": "40 mm"}
    case = load_case("pile.toml", box)
    assert case.boundary.shape == "box"
    assert case.boundary.mesh is None


def test_a_shape_is_replaced_by_a_mesh(in_folder: Path) -> None:
    (in_folder / "cup.stl").write_text(cup())
    case = load_case("pile-small", {"boundary.mesh": "cup.stl", "boundary.scale": "1 mm"})
    assert case.boundary.shape == "vessel"
    assert case.boundary.width == pytest.approx(6e-3)  # that of the mesh


def test_an_unreadable_record_is_replaced_by_a_sine(in_folder: Path) -> None:
    tables = document()
    tables["drive"] = {"record": "shaker.csv"}
    (in_folder / "case.toml").write_text(to_toml(tables))
    (in_folder / "shaker.csv").write_text("no header\n")
    case = load_case("case.toml", {"drive.frequency": "80 Hz", "drive.peak_acceleration": "4 g"})
    assert case.drive.record is None
    assert case.excitation.frequency == 80.0


def test_a_record_that_replaces_an_unreadable_one_is_the_one_that_messages_name(
    in_folder: Path,
) -> None:
    tables = document()
    tables["drive"] = {"record": "first.csv"}
    (in_folder / "case.toml").write_text(to_toml(tables))
    for name in ("first.csv", "second.csv"):
        (in_folder / name).write_text("no header\n")
    with pytest.raises(walkers.InputError, match=r'drive\.record = "second\.csv"'):
        load_case("case.toml", {"drive.record": "second.csv"})


def test_a_file_that_stays_is_read_beside_the_case(in_folder: Path) -> None:
    folder = in_folder / "cases"
    folder.mkdir()
    (folder / "pile.toml").write_text(to_toml(pile(mesh="cup.stl", scale="1 mm")))
    (folder / "cup.stl").write_text(cup())
    case = load_case("cases/pile.toml", {"drive.frequency": "100 Hz"})
    assert case.boundary.mesh == "cup.stl"


@pytest.mark.parametrize("place", ["set", "axes"])
def test_a_sweep_does_not_read_a_mesh_that_it_replaces(place: str, in_folder: Path) -> None:
    (in_folder / "pile.toml").write_text(to_toml(pile(mesh="missing.stl", scale="1 mm")))
    (in_folder / "cup.stl").write_text(cup())
    value: Any = "cup.stl" if place == "set" else ["cup.stl"]
    tables = {"case": "pile.toml", place: {"boundary.mesh": value}}
    sweep = load_sweep(tables)
    (case,) = sweep.cases()
    again = expand(tables, source="record", name="record", base=("pile", sweep.base))
    assert next(again.cases()).boundary == case.boundary
    assert case.boundary.vessel.height == pytest.approx(1e-3 * HEIGHT)


# --- texts ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "value",
    [
        "70 Hz",
        0.4,
        True,
        ["0.3 mm", "0.2 mm"],
        [["0 s", 1], ["2 s", 0.2]],
        {"at_rest": 0.1, "rise": 0.2, "half_rise_velocity": "80 mm/s"},
    ],
)
def test_a_value_is_written_as_set_reads_it(value: object) -> None:
    assert settings_of([f"key={written(value)}"]) == {"key": value}


def test_a_comparison_names_a_table_as_the_command_line_has_it() -> None:
    law = {"at_rest": 0.1, "rise": 0.2, "half_rise_velocity": "80 mm/s"}
    comparison = walkers.compare("fig1b", changes={"contact.friction.bead_bead": law})
    text = '{ at_rest = 0.1, rise = 0.2, half_rise_velocity = "80 mm/s" }'
    assert comparison.contents["second"] == f"fig1b contact.friction.bead_bead={text}"
