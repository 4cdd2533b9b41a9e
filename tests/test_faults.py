"""Bad surroundings: files cut or filled with nonsense, disks and pipes that take no more, edits behind the back."""

import json
import os
import re
import shutil
import struct
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

# --- what the engine takes --------------------------------------------------------------------------------------------
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import PROGRAM, SHORT, call, document, fill, make_case, mounted, to_toml
from tests.test_calibration import reduced
from walkers import run as run_case
from walkers.calibration.calibrate import _determinants, _kept, calibrate
from walkers.calibration.file import read_calibration
from walkers.errors import InputError
from walkers.inputs.reading import load_case
from walkers.inputs.toml import read_toml
from walkers.physics.bridge import Surfaces
from walkers.physics.laws import by_name
from walkers.postprocess.dump import BinaryDump, DumpError, local_frames
from walkers.postprocess.motion import read_bridges, read_motion
from walkers.postprocess.results import measure, read
from walkers.runner.binary import find_engine
from walkers.runner.directory import FIRST_SEGMENT, layout_of, write_deck
from walkers.runner.failures import DiskFull, EngineError
from walkers.runner.launch import launch
from walkers.runner.manifest import FileChanged, recomputed
from walkers.sweeps.scheduler import Options
from walkers.sweeps.table import load as load_table
from walkers.templates.deck import render_deck
from walkers.templates.layout import BEAD_COLUMNS, MEAN_SPIN_COLUMNS


def test_limits_of_restitution_and_modulus_are_the_engines(tmp_path: Path) -> None:
    """The last values that the engine takes run. Beyond its largest modulus a deck has to say that beads are hard."""
    quick = {"time_step": "0.4 us", "cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1, "allow_unstable": True}
    last = {"restitution": 0.0501, "youngs_modulus": "1 GPa"}
    case = make_case(contact=last, run=quick, drive={"frequency": "2 kHz"})
    assert not run_case(case, tmp_path).cached
    with pytest.raises(InputError, match=r"contact\.restitution = .*: expected .*more than 0\.05"):
        make_case(contact={"restitution": 0.05})
    with pytest.raises(EngineError, match="coefficientRestitution <= 1 required"):
        run_case(case.put("contact.restitution", 0.05), tmp_path)
    assert "hard_particles" not in render_deck(case).text
    with pytest.raises(InputError, match=r"contact\.youngs_modulus = .*between 0\.005 and 100 GPa"):
        make_case(contact={"youngs_modulus": "100.1 GPa"})
    deck = render_deck(case.put("contact.youngs_modulus", 1.001e9))
    assert "hard_particles  yes" in deck.text
    without = replace(deck, text=deck.text.replace("hard_particles  yes", ""))
    (tmp_path / "soft").mkdir()
    write_deck(without, tmp_path / "soft")
    with pytest.raises(EngineError, match="youngsModulus <= 1e9 required"):
        launch(without, tmp_path / "soft", find_engine())


# --- dumps ------------------------------------------------------------------------------------------------------------


def test_a_dump_that_holds_no_number_is_not_tabulated(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    directory = tmp_path / "copy"
    shutil.copytree(run_directory(dimers={"replicates": 2}, run=SHORT), directory)
    dump = (directory / FIRST_SEGMENT / "beads.bin").read_bytes()
    (directory / FIRST_SEGMENT / "beads.bin").write_bytes(dump[:-8] + struct.pack("=d", np.nan))
    with pytest.raises(FileChanged, match=r"beads\.bin has changed"):
        measure(directory)
    with pytest.raises(DumpError, match=r"beads\.bin: .* is not a number at step .*: the dump was damaged after"):
        read_motion(directory)
    (directory / "manifest.json").unlink()
    with pytest.raises(DumpError, match=r"beads\.bin: .* is not a number at step .*: the simulation blew up"):
        measure(directory)


def test_a_local_dump_is_read_whole_or_not_at_all(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    run = Path(shutil.copytree(run_directory(dimers={"replicates": 2}, run=SHORT), tmp_path / "run"))
    path = run / FIRST_SEGMENT / "bridges.pairs.txt"
    columns = tuple(json.loads((path.parent / "layout.json").read_text())["pair_bridge_columns"])
    assert sum(len(frame) for _, frame in local_frames(path, columns)) == 7 * 2
    whole = path.read_bytes()
    last_frame = whole.rindex(b"ITEM: TIMESTEP")
    for end in (*range(last_frame + 1, len(whole), 7), len(whole) - 1):  # in the header, a row, before the last newline
        path.write_bytes(whole[:end])
        with pytest.raises(DumpError, match=r"bridges\.pairs\.txt"):
            list(local_frames(path, columns))
    lines = whole.split(b"\n")
    words = lines[9].split()
    for nonsense in (b"nan", b"inf", b"x", b"1 2", b""):
        path.write_bytes(b"\n".join([*lines[:9], b" ".join([nonsense, *words[1:]]), *lines[10:]]))
        with pytest.raises(DumpError, match=r"bridges\.pairs\.txt: .*the frame of step 0"):
            list(local_frames(path, columns))
    path.write_bytes(whole[:last_frame])
    assert sum(len(frame) for _, frame in local_frames(path, columns)) == 6 * 2
    (run / "manifest.json").unlink()
    with pytest.raises(DumpError, match="its bridges hold 6 of 7 frames"):
        list(read_bridges(read_motion(run)))


# --- streams ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def short_case(in_folder: Path) -> Path:
    (in_folder / "sweep.toml").write_text('case = "short.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    file = in_folder / "short.toml"
    file.write_text(to_toml({"title": "price: 5$ and 3$", **document(run=SHORT)}))
    return file


@pytest.fixture
def short_run(short_case: Path, once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A copy of its run, to be damaged."""

    def make(folder: Path) -> None:
        shutil.copy(short_case, folder)
        call("run", "short.toml", check=True, folder=folder)

    shutil.copytree(once("short-run", make) / "runs", "runs")
    return next(Path("runs").glob("short-*"))


SCRIPTS = {
    "no terminal to ask": (
        "mkdir -p runs/x-0123456789ab.incomplete; {program} clean </dev/null",
        2,
        "walkers: --yes: expected",
    ),
    # A reader who has had enough: of the program, of who prints the help.
    "run, unread": ('{program} run short.toml | true; exit "${{PIPESTATUS[0]}}"', 0, ""),
    "help, unread": ('{program} --help | true; exit "${{PIPESTATUS[0]}}"', 0, ""),
    # A line of progress is due each time that there is some, when the reader has gone.
    "progress, unread": (
        f'{sys.executable} -c "from walkers import main, progress; progress._FIRST_LINE_SECONDS = 0.0; '
        'main.main()" sweep sweep.toml -j 1 2>&1 | true; exit "${{PIPESTATUS[0]}}"',
        *(0, ""),
    ),
}


@pytest.mark.parametrize("name", SCRIPTS)
def test_streams_that_are_unread_or_no_terminal(name: str, short_case: Path) -> None:
    script, status, told = SCRIPTS[name]
    command = ["bash", "-c", script.format(program=PROGRAM)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, told in done.stdout + done.stderr) == (status, True), done
    assert not any(word in done.stderr for word in ("Traceback", "BrokenPipe"))
    if script.startswith(("{program} run", "{program} sweep")):
        directory = next(Path("runs").glob("short-*"))
        assert read(directory)["velocity"] > 0.0
        assert b"walkers" not in next(directory.rglob("engine.log")).read_bytes()


# --- files ------------------------------------------------------------------------------------------------------------


def test_what_is_no_file_to_read_is_refused_at_once(tmp_path: Path) -> None:
    """A byte order mark is no mistake."""
    os.mkfifo(tmp_path / "fifo.toml")
    (tmp_path / "large.toml").write_text(f'title = "{"x" * (17 << 20)}"\n')
    for path in (Path("/dev/zero"), tmp_path / "fifo.toml", tmp_path / "large.toml"):
        with pytest.raises(InputError, match="expected a file of at most 16 MB"):
            read_toml(path)
    (tmp_path / "windows.toml").write_text(to_toml(document()), encoding="utf-8-sig")
    assert load_case(tmp_path / "windows.toml") == make_case().but(name="windows")


def _edited(name: str, change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    def edit(run: Path) -> None:
        contents = json.loads((run / name).read_text())
        change(contents)
        (run / name).write_text(json.dumps(contents))

    return edit


def _tampered_dump(run: Path) -> None:
    """As a disk could; the result is gone, so that it is made of the dump."""
    with (run / FIRST_SEGMENT / "beads.bin").open("r+b") as file:
        file.seek(-64, 2)
        file.write(b"\xff" * 64)
    (run / "result.json").unlink()


DAMAGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "a case that was cut": (lambda run: os.truncate(run / "case.json", 800), "case.json"),
    "an edited case": (
        _edited("case.json", lambda case: case["drive"].update(frequency=81.0)),
        "case.json has changed",
    ),
    "a manifest that was cut": (lambda run: os.truncate(run / "manifest.json", 100), "manifest.json"),
    "a manifest that is no table": (lambda run: (run / "manifest.json").write_text("[]"), "manifest.json"),
    "a layout that was cut": (lambda run: os.truncate(run / FIRST_SEGMENT / "layout.json", 100), "layout.json"),
    "a damaged dump": (_tampered_dump, "beads.bin has changed|has no result.json"),
}
READERS = (
    *("run short.toml", "run {run}", "plot {run}", "report {run} --to out.html"),
    *(
        f"export {{run}} --to {form} -o {to}"
        for form, to in (("vtk", "vtk"), ("paraview", "vtk"), ("lammps", "out.lammpstrj"))
    ),
    *("export {run} --to archive -o out.zip", "run short.toml --json"),
    *("compare {run} {run}", "compare short.toml fig1b", "show short.toml --theory"),
)
"""Commands that read a run's directory."""


@pytest.mark.parametrize("name", DAMAGES)
def test_a_run_that_was_damaged_is_told_in_a_line_by_all_that_read_it(name: str, short_run: Path) -> None:
    (damage, told), run = DAMAGES[name], short_run
    damage(run)
    files = {path: path.read_bytes() for path in run.rglob("*") if path.is_file() and path.suffix != ".lock"}
    for command in READERS:
        done = call(*command.format(run=run).split())
        assert "Traceback" not in done.stderr, (command, done.stderr)
        assert "99000" not in done.stdout
        if command.startswith(("show", "compare")) and done.returncode == 0:
            continue  # they may not need what is damaged
        lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
        assert done.returncode == 2, (command, done)
        assert str(run) in lines[0], (command, lines)
        assert re.search(told, lines[0]), (command, lines)
        assert len(lines) == 1, (command, lines)
    assert all(path.read_bytes() == contents for path, contents in files.items()), "nothing on disk is lost"


def test_a_result_that_lacks_a_number_is_told_by_what_reads_it(short_run: Path) -> None:
    for name in ("goes_uphill", "facings_differ"):
        _edited("result.json", lambda result, name=name: result["numbers"].pop(name))(short_run)
        for command in (f"plot {short_run}", "list --all"):
            done = call(*command.split())
            assert "its result.json cannot be read" in done.stdout + done.stderr, (command, done)
            assert "Traceback" not in done.stderr, (command, done)
        call("run", str(short_run), check=True)


def test_a_sweep_goes_on_without_a_damaged_run_and_says_which(short_case: Path) -> None:
    call("sweep", "sweep.toml", check=True)
    runs = list(load_table("runs/sweep")["run"])
    shutil.copytree(runs[0], "whole")
    for name, (damage, _) in DAMAGES.items():
        shutil.rmtree(runs[0])
        shutil.copytree("whole", runs[0])
        damage(Path(runs[0]))
        table = load_table("runs/sweep")
        whole = name != "a damaged dump"  # the table is of results alone
        assert list(table["status"]) == ["finished" if whole else "failed", "finished"], name
        assert list(table["run"]) == runs
        told = {}
        for command in ("list runs/sweep", "plot runs/sweep", "list --all", "sweep sweep.toml"):
            done = call(*command.split())
            assert "Traceback" not in done.stderr, (command, done.stderr)
            assert "99000" not in done.stdout
            assert done.returncode == int(command.startswith("sweep") and not whole), (command, name)
            told[command] = done.stdout + done.stderr
        rows = [line.split() for line in told["list runs/sweep"].splitlines() if line[:6].strip() in {"0", "1"}]
        assert ([row[-1] for row in rows] == ["failed", "finished"]) is not whole, name
        status = "finished" if whole else "failed"
        for command in ("list runs/sweep", "sweep sweep.toml"):
            assert f"2 points, {'2 finished' if whole else '1 finished, 1 failed'}\n" in told[command], (command, name)
        assert (walkers.load("runs/sweep").status, told["sweep sweep.toml"].count("point 0")) == (
            status,
            2 * (not whole),
        )
        assert ("1 of 2 points left out: 1 failed" in told["plot runs/sweep"]) is not whole, name


def test_a_result_whose_making_was_killed_is_made_anew(short_run: Path) -> None:
    """Between the table that is new and the manifest that does not yet say so."""
    run, names = short_run, ["result.json", "walkers.parquet", "trajectory.parquet"]
    right = read(run).as_dict()
    with suppress(KeyboardInterrupt), recomputed(run, names):
        _edited("result.json", lambda result: result["numbers"].update(velocity=99.0))(run)
        raise KeyboardInterrupt
    assert walkers.run(run).result.as_dict() == right
    assert json.loads((run / "manifest.json").read_text())["sha256"].keys() >= set(names)


def test_a_full_disk_is_told_in_a_line_and_nothing_half_written_stays(short_case: Path, tmp_path: Path) -> None:
    call("sweep", "sweep.toml", check=True)
    commands = {
        "run short.toml": "--out {}/a",
        "run pile-ci": "--out {}/b",
        "sweep sweep.toml": "--out {}/c",
        "plot runs/sweep": "--to {}/d.png",
        "export --to vtk {run}": "-o {}/e",
        "export --to deck {run}": "-o {}/deck",
        "render {run}": "--to {}/f.png",
        "list runs/sweep": "--to {}/g.csv",
    }
    (run, _) = Path("runs").glob("short-*")
    with mounted(tmp_path / "disk", "256k") as disk:
        ballast = fill(disk)
        for command, place in commands.items():
            done = call(*command.format(run=run).split(), *place.format(disk).split())
            lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
            assert (done.returncode, len(lines)) == (1 if command.startswith("run") else 2, 1), (command, done)
            assert "No space left on device" in lines[0] or "disk full" in lines[0]
            assert str(disk) in lines[0]
        assert not (disk / "deck").exists()
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        done = call("list", "runs/sweep", "--to", f"{disk}/g.csv")
        assert (done.returncode, done.stderr) == (2, f"walkers: {disk}/g.csv: Read-only file system\n")
        assert [path for path in disk.rglob("*") if path.is_file() and path.stat().st_size] == [ballast]
        assert not [path for path in disk.rglob("*") if ".new" in path.name or path.suffix == ".lock"]


def test_a_disk_that_is_full_when_the_tables_are_written_is_a_failure_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine has ended well by then; with room again only the tables are made."""
    case = make_case(run=SHORT)
    with mounted(tmp_path / "disk", "2m") as place:

        def measure_without_room(directory: Path) -> None:
            fill(place)
            measure(directory)

        monkeypatch.setattr("walkers.sweeps.making.measure", measure_without_room)
        with pytest.raises(DiskFull, match="disk full"):
            run_case(case, place / "runs")
        assert not list(place.glob("runs/*/manifest.json"))
        monkeypatch.undo()
        (place / "ballast").unlink()
        (dump,) = place.glob("runs/*.incomplete/segments/0000/beads.bin")
        node = dump.stat().st_ino
        outcome = run_case(case, place / "runs")
        assert (outcome.directory / FIRST_SEGMENT / "beads.bin").stat().st_ino == node


# --- calibrations -----------------------------------------------------------------------------------------------------


@pytest.fixture
def calibration() -> dict[str, Any]:
    return reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3})


def test_an_edit_of_the_design_is_told_and_not_dropped(calibration: dict[str, Any], tmp_path: Path) -> None:
    """Another wave at the end is welcome."""
    design, unit, file = calibration["design"], np.full((4, 2), 0.5), tmp_path / "wave-1.json"

    def kept(changed: dict[str, Any], make: np.ndarray) -> np.ndarray:
        read = read_calibration(changed, source="test", name="test", folder=tmp_path)
        return _kept(file, _determinants(read, 1), lambda: make)

    assert kept(calibration, unit) is unit
    for key, value in (("seed", 3), ("waves", [20, 8])):
        with pytest.raises(InputError, match=rf"wave-1\.json: {key}: was drawn with other {key}"):
            kept({**calibration, "design": {**design, key: value}}, unit)
    with pytest.raises(InputError, match=r"wave-1\.json: guesses: was drawn with other guesses"):
        kept({**calibration, "guesses": [{"friction": 0.1, "drag": 1.0}]}, unit)
    longer = {**calibration, "design": {**design, "waves": [*design["waves"], 8]}}
    np.testing.assert_array_equal(kept(longer, 1.0 - unit), unit)
    file.write_text(json.dumps({**json.loads(file.read_text()), "unit": [[0.5]]}))
    with pytest.raises(InputError, match=r"wave-1\.json: cannot be read"):
        kept(calibration, unit)


def test_calibrations_that_make_no_sense_are_refused_before_anything_is_written(
    calibration: dict[str, Any], tmp_path: Path
) -> None:
    calibration["parameters"]["drag"] = {"keys": ["contact.restitution"], "range": [0.01, 0.9]}
    found = read_calibration(calibration, source="bad.toml", name="bad", folder=tmp_path)
    with pytest.raises(InputError, match=r"bad\.toml: parameters\.drag\.range = \[0\.01, 0\.9\]: contact\.restitution"):
        calibrate(found, tmp_path / "runs", Options(1))
    assert not (tmp_path / "runs").exists()


# --- readers of dumps -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    return run_directory(dimers={"replicates": 2}, run=SHORT)


COLUMNS = (*BEAD_COLUMNS, *MEAN_SPIN_COLUMNS)


@pytest.fixture(scope="module")
def beads(directory: Path) -> Path:
    """The engine's dump of the beads."""
    return directory / FIRST_SEGMENT / "beads.bin"


def test_all_frames_are_read(directory: Path, beads: Path) -> None:
    layout = layout_of(directory / FIRST_SEGMENT)
    dump = BinaryDump(beads, COLUMNS)
    assert len(dump) == layout.frames == 61
    assert not dump.truncated
    np.testing.assert_array_equal(np.diff(dump.steps), layout.sample_every)
    frames = dump.stack()
    assert frames.shape == (61, 4, len(COLUMNS))
    np.testing.assert_array_equal(frames[:, :, dump.column("id")], np.tile(np.arange(1, 5), (61, 1)))
    np.testing.assert_allclose(frames[0, :, dump.column("radius")], [3e-4, 2e-4, 3e-4, 2e-4], rtol=1e-15)
    assert beads.stat().st_size == layout.bead_dump_bytes


@pytest.mark.parametrize("cut", [1, 8, 200, 470, 550])  # of a frame of 704 bytes, 104 of them its head
def test_a_truncated_last_frame_is_left_out_and_told(beads: Path, tmp_path: Path, cut: int) -> None:
    whole = beads.read_bytes()
    short = tmp_path / "short.bin"
    short.write_bytes(whole[:-cut])
    dump = BinaryDump(short, COLUMNS)
    assert dump.truncated
    assert len(dump) == 60
    np.testing.assert_array_equal(dump.stack(), BinaryDump(beads, COLUMNS).stack()[:60])
    short.write_bytes(b"")
    empty = BinaryDump(short, COLUMNS)
    assert (len(empty), empty.truncated) == (0, False)


@pytest.mark.parametrize("contents", [b"no dump at all, but text that is long enough for a header" * 5, b"\xff" * 500])
def test_what_is_no_dump_or_has_other_columns_is_refused(contents: bytes, beads: Path, tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="2 columns"):
        BinaryDump(beads, ("id", "x"))
    (tmp_path / "other.bin").write_bytes(contents)
    with pytest.raises(DumpError, match=r"other\.bin"):
        BinaryDump(tmp_path / "other.bin", BEAD_COLUMNS)
    with pytest.raises(DumpError, match=r"other\.bin"):
        list(local_frames(tmp_path / "other.bin", ("x",)))


def test_an_open_bridge_pulls_with_the_capillary_force(tmp_path: Path) -> None:
    """Shaken vertically beyond what bridges hold, contacts open: the force is the law's at the gap."""
    case = make_case(
        drive={"axis": "z", "peak_acceleration": "20 g"},
        liquid={"dynamic_viscosity": "1e-9 mPa*s"},
        run={"cycles": 10, "settling_cycles": 2, "bridge_samples_per_cycle": 20},
    )
    bridges = walkers.run(case, tmp_path).table("bridges")
    # Until the beads first part, 5 ms on: then their bridge's liquid is shared out anew and the volumes change.
    opened = bridges[~bridges["touching"] & (bridges["time"] < 5e-3)]
    assert set(opened["contact"]) >= {1, 3}  # a bead on the substrate and bead on bead
    large, small = case.walkers[0].radii
    ends = {1: (large, inf), 2: (small, inf), 3: (small, large)}
    for contact, gap, found in opened[["contact", "gap", "normal_force"]].itertuples(index=False):
        surfaces = Surfaces.of(*ends[contact], case.liquid.of_bridges, case.contact.minimum_separation_ratio)
        curve = by_name(case.liquid.law)(surfaces)
        assert gap < curve.rupture
        assert found == pytest.approx(curve.forces(np.array([gap])).pull[0], rel=1e-6)
