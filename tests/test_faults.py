"""Bad surroundings: files cut or filled with nonsense, disks and pipes that take no more, edits behind the back."""

import json
import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import PROGRAM, SHORT, call, document, fill, make_case, mounted, to_toml
from tests.test_calibration import reduced
from walkers import run as run_case
from walkers.calibration.calibrate import _determinants, _kept, calibrate
from walkers.inputs import InputError, load_case, resolve_case
from walkers.inputs.calibration import read_calibration
from walkers.inputs.reading import read_toml, shipped_cases
from walkers.inputs.sweep import expand
from walkers.postprocess import read_result, tabulate
from walkers.postprocess.analysis import current_result, describe_result
from walkers.postprocess.drawing import new_figure, save_figure, styled
from walkers.postprocess.dump import DumpError, local_frames
from walkers.postprocess.motion import read_bridges, read_motion
from walkers.runner.binary import find_engine
from walkers.runner.directory import FIRST_SEGMENT, write_deck
from walkers.runner.failures import DiskFull, EngineError, EngineFailure
from walkers.runner.launch import launch
from walkers.runner.manifest import FileChanged, forget_tables
from walkers.sweeps.scheduler import Failure, Options, _severity
from walkers.sweeps.table import load as load_table
from walkers.templates import render_deck

# --- what the engine takes --------------------------------------------------------------------------------------------


QUICK = {"time_step": "0.4 us", "cycles": 2, "settling_cycles": 0, "samples_per_cycle": 1, "allow_unstable": True}


def test_the_least_restitution_of_a_case_is_the_engines(tmp_path: Path) -> None:
    """The last value that the case check takes runs; the first that it refuses stops the engine."""
    case = make_case(contact={"restitution": 0.0501}, run=QUICK, drive={"frequency": "2 kHz"})
    assert not run_case(case, tmp_path).cached
    with pytest.raises(InputError, match=r"contact\.restitution = .*: expected .*more than 0\.05"):
        make_case(contact={"restitution": 0.05})
    further = replace(case, contact=replace(case.contact, restitution=0.05))
    with pytest.raises(EngineError, match="coefficientRestitution <= 1 required"):
        run_case(further, tmp_path)


def test_the_largest_modulus_of_a_case_is_the_engines_own(tmp_path: Path) -> None:
    """Beyond it a deck has to say that beads are hard, as those of the benchmarks do."""
    case = make_case(contact={"youngs_modulus": "1 GPa"}, run=QUICK, drive={"frequency": "2 kHz"})
    assert not run_case(case, tmp_path).cached
    assert "hard_particles" not in render_deck(case).text
    with pytest.raises(InputError, match=r"contact\.youngs_modulus = .*: expected .*at most 1e\+09"):
        make_case(contact={"youngs_modulus": "1.001 GPa"})
    deck = render_deck(replace(case, contact=replace(case.contact, youngs_modulus=1.001e9)))
    assert "hard_particles  yes" in deck.text
    without = replace(deck, text=deck.text.replace("hard_particles  yes", ""))
    (tmp_path / "soft").mkdir()
    write_deck(without, tmp_path / "soft")
    with pytest.raises(EngineError, match="youngsModulus <= 1e9 required"):
        launch(without, tmp_path / "soft", find_engine())


# --- dumps ------------------------------------------------------------------------------------------------------------


def test_a_number_that_is_none_at_the_end_of_a_dump_is_a_failure(front: Callable[[str], str], tmp_path: Path) -> None:
    """A force stops being a number before the end of the last cycle; the engine ends as if nothing had happened."""
    late = '"variable late equal (step>" last ")*(1e308*100-1e308*100)"; print "fix late all addforce v_late 0 0"'
    engine = front(
        "last=$(awk '/^run /{print $2 - 20}' walker.lig)\n"
        f"awk -v last=\"$last\" '/^fix +motion/{{print {late}}} {{print}}' walker.lig > late.lig\n"
        'mv late.lig walker.lig\nexec liggghts "$@"'
    )
    dense = {"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 500, "time_step": "2 us"}
    with pytest.raises((DumpError, EngineFailure), match="no number"):
        run_case(make_case(run=dense), tmp_path / "runs", engine=engine)
    assert not list(tmp_path.glob("runs/*/manifest.json"))
    assert list(tmp_path.glob("runs/*.incomplete/failure.json"))


def test_a_dump_that_holds_no_number_is_not_tabulated(run_directory: Callable[..., Path], tmp_path: Path) -> None:
    directory = tmp_path / "copy"
    shutil.copytree(run_directory(dimers={"replicates": 2}, run=SHORT), directory)
    dump = (directory / FIRST_SEGMENT / "beads.bin").read_bytes()
    (directory / FIRST_SEGMENT / "beads.bin").write_bytes(dump[:-8] + struct.pack("=d", np.nan))
    with pytest.raises(FileChanged, match=r"beads\.bin is not what it was"):
        tabulate(directory)
    with pytest.raises(DumpError, match=r"beads\.bin: .* is no number at step .*: the dump was damaged since"):
        read_motion(directory)
    (directory / "manifest.json").unlink()
    with pytest.raises(DumpError, match=r"beads\.bin: .* is no number at step .*: the beads' motion blew up"):
        tabulate(directory)


@pytest.fixture(scope="module")
def local_dump(run_directory: Callable[..., Path]) -> tuple[Path, tuple[str, ...]]:
    directory = run_directory(dimers={"replicates": 2}, run=SHORT) / FIRST_SEGMENT
    columns = json.loads((directory / "layout.json").read_text())["pair_bridge_columns"]
    return directory / "bridges.pairs.txt", tuple(columns)


def test_a_local_dump_is_read_whole_or_not_at_all(local_dump: tuple[Path, tuple[str, ...]], tmp_path: Path) -> None:
    path, columns = local_dump
    assert sum(len(frame) for _, frame in local_frames(path, columns)) == 7 * 2
    whole = path.read_bytes()
    cut = tmp_path / "cut.txt"
    last_frame = whole.rindex(b"ITEM: TIMESTEP")
    for end in range(last_frame + 1, len(whole), 7):  # within the header, a row, a number, before the last newline
        cut.write_bytes(whole[:end])
        with pytest.raises(DumpError, match=r"cut\.txt"):
            list(local_frames(cut, columns))
    cut.write_bytes(whole[:-1])
    with pytest.raises(DumpError, match=r"cut\.txt: ends within the frame"):
        list(local_frames(cut, columns))
    cut.write_bytes(whole[:last_frame])
    assert sum(len(frame) for _, frame in local_frames(cut, columns)) == 6 * 2
    copy = shutil.copytree(path.parents[2], tmp_path / "run")
    (copy / "manifest.json").unlink()
    cut.replace(copy / FIRST_SEGMENT / path.name)
    with pytest.raises(DumpError, match="its bridges hold 6 of 7 frames"):
        list(read_bridges(read_motion(copy)))


def test_nonsense_in_a_local_dump_is_told(local_dump: tuple[Path, tuple[str, ...]], tmp_path: Path) -> None:
    path, columns = local_dump
    lines = path.read_bytes().split(b"\n")
    words = lines[9].split()
    for nonsense in (b"nan", b"inf", b"x", b"1 2", b""):
        lines[9] = b" ".join([nonsense, *words[1:]])
        (tmp_path / "odd.txt").write_bytes(b"\n".join(lines))
        with pytest.raises(DumpError, match=r"odd\.txt: .*the frame of step 0"):
            list(local_frames(tmp_path / "odd.txt", columns))


# --- streams ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def short_case(in_folder: Path) -> Path:
    file = in_folder / "short.toml"
    file.write_text(to_toml({"title": "price: 5$ and 3$", **document(run=SHORT)}))
    return file


def test_output_in_another_encoding_is_printed(short_case: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "latin-1"}
    done = subprocess.run([PROGRAM, "show", "short.toml"], capture_output=True, env=environment, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False)
    assert rb"\u0393" in done.stdout  # Γ0


@pytest.mark.parametrize(
    ("closed", "command"),
    [("2>&-", "run short.toml"), (">&-", "run short.toml"), ("<&- >&- 2>&-", "sweep sweep.toml")],
)
def test_closed_streams_do_not_matter(short_case: Path, in_folder: Path, closed: str, command: str) -> None:
    (in_folder / "sweep.toml").write_text('case = "short.toml"\n')
    done = subprocess.run(["sh", "-c", f"{PROGRAM} {command} --out runs {closed}"], capture_output=True, check=False)
    assert (done.returncode, b"Traceback" in done.stderr) == (0, False), done.stderr
    (directory,) = in_folder.glob("runs/short-*")
    assert read_result(directory)["velocity"]["mean"] > 0.0
    assert b"walkers" not in (directory / FIRST_SEGMENT / "engine.log").read_bytes()


def test_cleaning_without_input_asks_for_yes(in_folder: Path) -> None:
    begun = in_folder / "runs" / "short-0123456789ab.incomplete"
    begun.mkdir(parents=True)
    done = subprocess.run(["sh", "-c", f"{PROGRAM} clean <&-"], capture_output=True, text=True, check=False)
    assert (done.returncode, begun.is_dir()) == (2, True)
    assert done.stderr == "walkers: --yes: expected, for there is no terminal at which to ask\n"


@pytest.mark.parametrize("command", ["run short.toml", "deck short.toml", "--help"])
def test_a_reader_who_has_had_enough_is_no_failure(short_case: Path, command: str) -> None:
    """By the program, by the print of a long text, by who prints the help."""
    script = f'{PROGRAM} {command} | true; echo "${{PIPESTATUS[0]}}"'
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert (done.stdout.strip(), "Traceback" in done.stderr, "BrokenPipe" in done.stderr) == ("0", False, False)


@pytest.mark.parametrize("command", ["show short.toml", "--help", "list --json"])
def test_a_standard_output_without_room_is_told_by_its_name(short_case: Path, command: str) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([PROGRAM, *command.split()], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "walkers: standard output: No space left on device\n")


def test_progress_that_nobody_reads_stops_nothing(in_folder: Path) -> None:
    """A line of progress is due each time that there is some, when the reader has gone."""
    (in_folder / "base.toml").write_text(to_toml(document(run=SHORT)))
    (in_folder / "sweep.toml").write_text('case = "base.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    program = "from walkers import main, progress; progress._rarely = lambda: lambda elapsed: True; main.main()"
    script = f'{sys.executable} -c "{program}" sweep sweep.toml -j 1 2>&1 | true; echo "${{PIPESTATUS[0]}}"'
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "0"
    assert "2 finished" in call("status", "runs/sweep").stdout


# --- files ------------------------------------------------------------------------------------------------------------


def test_what_is_no_file_to_read_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo.toml")
    (tmp_path / "large.toml").write_text(f'title = "{"x" * (17 << 20)}"\n')
    for path in (Path("/dev/zero"), tmp_path / "fifo.toml", tmp_path / "large.toml"):
        with pytest.raises(InputError, match="expected a file of at most 16 MB"):
            read_toml(path)


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    (tmp_path / "windows.toml").write_text(to_toml(document()), encoding="utf-8-sig")
    assert load_case(tmp_path / "windows.toml") == make_case().renamed("windows")


def _cut(name: str, size: int) -> Callable[[Path], None]:
    return lambda run: os.truncate(run / name, size)


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


DAMAGES: dict[str, tuple[Callable[[Path], None], str]] = {
    "a case that was cut": (_cut("case.json", 800), "case.json"),
    "a case that is no table": (lambda run: (run / "case.json").write_text("[]") and None, "case.json"),
    "an edited case": (
        _edited("case.json", lambda case: case["drive"]["harmonics"][0].update(frequency=81.0)),
        "case.json is not what it was",
    ),
    "a manifest that was cut": (_cut("manifest.json", 100), "manifest.json"),
    "a manifest that is no table": (lambda run: (run / "manifest.json").write_text("[]") and None, "manifest.json"),
    "a layout that was cut": (_cut(f"{FIRST_SEGMENT}/layout.json", 100), "layout.json"),
    "an edited result": (
        _edited("result.json", lambda result: result["velocity"].update(mean=99.0)),
        "result.json is not what it was",
    ),
    "an edited origin": (
        _edited("result.json", lambda result: result["rests_on"][0].update(key="x")),
        "result.json is not what it was",
    ),
    "a damaged dump": (_tampered_dump, "beads.bin is not what it was"),
}
READERS = (
    *("run short.toml", "result {run}", "plot {run}", "vtk {run} --to vtk", "paraview {run} --to vtk"),
    *("export {run} --to out.xyz", "report {run} --to out.html", "archive {run} --to out.zip"),
    *("compare {run} {run}", "compare short.toml fig1b", "theory short.toml", "run short.toml --json"),
)
"""Commands that read a run's directory."""


@pytest.mark.parametrize("name", DAMAGES)
def test_a_run_that_was_damaged_is_told_in_a_line_by_all_that_read_it(name: str, short_case: Path) -> None:
    damage, told = DAMAGES[name]
    call("run", "short.toml", check=True)
    (run,) = Path("runs").glob("short-*")
    damage(run)
    files = {path: path.read_bytes() for path in run.rglob("*") if path.is_file() and path.suffix != ".lock"}
    for command in READERS:
        done = call(*command.format(run=run).split())
        assert "Traceback" not in done.stderr, (command, done.stderr)
        assert "99000" not in done.stdout
        if command.startswith(("theory", "compare")) and done.returncode == 0:
            continue  # they may not need what is damaged
        lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
        assert done.returncode in (1, 2), (command, done)
        assert str(run) in lines[0], (command, lines)
        if not command.startswith("archive"):  # which tells the files, a line each
            assert told in lines[0], (command, lines)
            assert len(lines) == 1, (command, lines)
    assert all(path.read_bytes() == contents for path, contents in files.items()), "nothing on disk is lost"


def test_a_sweep_goes_on_without_a_damaged_run_and_says_which(short_case: Path) -> None:
    Path("sweep.toml").write_text('case = "short.toml"\n[axes]\ndimers.angle = ["0 deg", "10 deg"]\n')
    call("sweep", "sweep.toml", check=True)
    runs = list(load_table("runs/sweep")["run"])
    shutil.copytree(runs[0], "whole")
    for name, (damage, _) in DAMAGES.items():
        shutil.rmtree(runs[0])
        shutil.copytree("whole", runs[0])
        damage(Path(runs[0]))
        table = load_table("runs/sweep")
        whole = name.startswith("a layout")  # not asked for by the table
        assert list(table["status"]) == ["finished" if whole else "failed", "finished"], name
        assert list(table["run"]) == runs
        for command in ("sweep sweep.toml", "table runs/sweep", "status sweep", "plot runs/sweep", "list"):
            done = call(*command.split())
            assert "Traceback" not in done.stderr, (command, done.stderr)
            assert "99000" not in done.stdout
            assert done.returncode in (0, 1, 2)
    assert call("report", "sweep", "--to", "sweep.html").returncode in (0, 1, 2)


def test_a_result_whose_making_was_killed_is_made_anew(short_case: Path) -> None:
    """Between the table that is new and the manifest that does not yet say so."""
    call("run", "short.toml", check=True)
    (run,) = Path("runs").glob("short-*")
    names = ["result.json", "walkers.parquet", "trajectory.parquet"]
    known = read_result(run)
    forget_tables(run, names)
    _edited("result.json", lambda result: result["velocity"].update(mean=99.0))(run)
    assert current_result(run) == known
    assert json.loads((run / "manifest.json").read_text())["sha256"].keys() >= set(names)


BAD_SWEEPS = {
    "twice": ({"axes": {"run.seed": [1, 2, 1]}}, r"run\.seed = 1: expected different values"),
    "twice in other words": ({"axes": {"drive.frequency": ["80 Hz", "80.0 Hz"]}}, r'"80\.0 Hz": expected different'),
    "a range without a width": (
        {"axes": {"drive.frequency": {"linspace": ["80 Hz", "80 Hz", 3]}}},
        r"drive\.frequency = .*: expected different values",
    ),
    "a range upside down": (
        {"sample": [{"points": 4, "ranges": {"contact.restitution": {"uniform": [0.3, 0.2]}}}]},
        r"contact\.restitution = .*uniform.*: expected the smaller value first",
    ),
    "what only ends an engine": ({"axes": {"run.silence": ["1 s", "2 s"]}}, r"run\.silence: does not vary"),
    "titles": ({"axes": {"title": ["a", "b"]}}, "title: does not vary"),
}


@pytest.mark.parametrize("name", BAD_SWEEPS)
def test_axes_that_would_make_the_same_point_twice_are_refused(name: str, tmp_path: Path) -> None:
    document, told = BAD_SWEEPS[name]
    with pytest.raises(InputError, match=told):
        expand({"case": "fig1b", **document}, source="test", name="test", folder=tmp_path)


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system without a byte left."""
    with mounted(tmp_path / "disk", "256k") as place:
        fill(place)
        yield place


def test_a_full_disk_is_told_in_a_line_and_nothing_half_written_stays(full_disk: Path, in_folder: Path) -> None:
    (in_folder / "short.toml").write_text(to_toml(document(run=SHORT)))
    (in_folder / "sweep.toml").write_text('case = "short.toml"\n')
    call("run", "short.toml", check=True)
    commands = {
        "run short.toml": f"--out {full_disk}/a",
        "run pile-ci": f"--out {full_disk}/b",
        "sweep sweep.toml": f"--out {full_disk}/c",
        "plot short.toml": f"--to {full_disk}/d",
        "vtk short.toml": f"--to {full_disk}/e",
        "render short.toml": f"--to {full_disk}/f.png",
        "table runs/sweep": f"--to {full_disk}/g.csv",
    }
    call("sweep", "sweep.toml", check=True)
    for command, place in commands.items():
        done = call(*command.split(), *place.split())
        lines = [line for line in done.stderr.splitlines() if "never audited" not in line]
        assert (done.returncode in (1, 2), len(lines)) == (True, 1), (command, done)
        assert "No space left on device" in lines[0] or "disk full" in lines[0]
        assert str(full_disk) in lines[0]
    left = [path for path in full_disk.rglob("*") if path.is_file() and path.stat().st_size]
    assert left == [full_disk / "ballast"]
    assert not [path for path in full_disk.rglob("*") if ".new" in path.name or path.suffix == ".lock"]


def test_a_disk_that_is_full_when_the_tables_are_written_is_a_failure_of_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine has ended well by then; with room again only the tables are made."""
    from walkers.postprocess import analysis

    case, tabulated = make_case(run=SHORT), analysis.tabulate
    with mounted(tmp_path / "disk", "2m") as place:

        def tabulate_without_room(directory: Path) -> object:
            fill(place)
            return tabulated(directory)

        monkeypatch.setattr(analysis, "tabulate", tabulate_without_room)
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


def test_an_edit_of_the_design_is_told_and_not_dropped(tmp_path: Path) -> None:
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3})
    first = read_calibration(document, source="test", name="test", folder=tmp_path)
    unit = np.full((4, 2), 0.5)
    file = tmp_path / "wave-1.json"
    assert _kept(file, _determinants(first, 1), lambda: unit) is unit
    for key, value in (("seed", 3), ("waves", [20, 8]), ("guesses", [{"friction": 0.1, "drag": 1.0}])):
        table = document if key == "guesses" else document["design"]
        changed = {**document, key: value} if table is document else {**document, "design": {**table, key: value}}
        edited = read_calibration(changed, source="test", name="test", folder=tmp_path)
        with pytest.raises(InputError, match=rf"wave-1\.json: {key}: was drawn with other {key}"):
            _kept(file, _determinants(edited, 1), lambda: unit)
    longer = {
        **document,
        "design": {**document["design"], "waves": [*document["design"]["waves"], 8]},
    }  # another wave at the end is welcome
    more = read_calibration(longer, source="test", name="test", folder=tmp_path)
    np.testing.assert_array_equal(_kept(file, _determinants(more, 1), lambda: 1.0 - unit), unit)


def test_ranges_beyond_a_key_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3})
    document["parameters"]["drag"] = {"keys": ["contact.restitution"], "range": [0.01, 0.9]}
    found = read_calibration(document, source="bad.toml", name="bad", folder=tmp_path)
    with pytest.raises(InputError, match=r"bad\.toml: parameters\.drag\.range = \[0\.01, 0\.9\]: contact\.restitution"):
        calibrate(found, tmp_path / "runs", Options(1))
    assert not (tmp_path / "runs").exists()


def test_an_observation_over_itself_is_refused(tmp_path: Path) -> None:
    document = reduced({"slow": 1e-3, "fast": 1e-3, "strong": 1e-3})
    document["observations"][3]["over"] = document["observations"][3]["of"]
    with pytest.raises(InputError, match=r"observations\[3\]\.over: expected other experiments"):
        read_calibration(document, source="bad.toml", name="bad", folder=tmp_path)


# --- what is told -----------------------------------------------------------------------------------------------------


def test_failures_that_threaten_all_points_come_first() -> None:
    reasons = ["WalkersMet", "BeadsLost", "SomethingNew", "EngineKilled", "RunBusy", "DiskFull", "EngineNeverStarted"]
    failures = [Failure(number, "run", reason, "", None) for number, reason in enumerate(reasons)]
    order = [failure.reason for failure in sorted(failures, key=_severity)]
    expected = ["DiskFull", "EngineNeverStarted", "EngineKilled", "SomethingNew", "BeadsLost", "WalkersMet", "RunBusy"]
    assert order == expected


def test_figures_leave_the_settings_of_whoever_calls(tmp_path: Path) -> None:
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    seen = {}

    @styled
    def draw() -> object:
        seen.update(mpl.rcParams)
        return new_figure(1.0, 1.0)[0]

    save_figure(draw(), tmp_path / "figure.png", [])  # type: ignore[arg-type]
    assert dict(mpl.rcParams) == before
    assert seen["axes.spines.top"] is False


def test_walkers_that_turned_over_are_told_first(run_directory: Callable[..., Path]) -> None:
    """The dimer on a wall: all six hang with the large bead below before the run ends."""
    run = {"time_step": "4 us", "cycles": 120, "settling_cycles": 60}
    tables = {**read_toml(shipped_cases()["climber-dimer"]), "run": run}
    directory = run_directory(resolve_case(tables, name="climber-dimer"))
    result = read_result(directory)
    lines = describe_result(directory, result).splitlines()
    assert result["turned_round"] == 6
    assert result["kept_heading"]["n"] == 0
    assert result["posture"]["turned over"] == 6
    first, last = result["posture"]["turned_at"]
    assert 0.1 < first < last < 0.7
    assert lines[0] == f"climber-dimer: turned over after {first:.2f} to {last:.2f} s"
    assert result["axial_velocity"]["mean"] < -5e-3
    assert "none: no walker kept its heading" in describe_result(directory, result)
    assert f"{result['velocity']['mean'] * 1e3:.3f}" not in describe_result(directory, result)


def test_a_result_says_what_the_walkers_do_that_kept_their_heading(run_directory: Callable[..., Path]) -> None:
    """Two of three start across the axis, off by more than a right angle; the third walks on."""
    directory = run_directory(dimers={"replicates": 3, "facing": "right"}, run=SHORT)
    result = {**current_result(directory)}
    result |= {"turned_round": 2, "kept_heading": {**result["kept_heading"], "n": 1, "mean": 1.5e-3}}
    lines = describe_result(directory, result).splitlines()
    assert lines[0].startswith("test: 2 of 3 turned round, axial velocity ")
    assert "  velocity   1.500 mm/s along the heading, of the 1 that kept it" in lines


def test_the_engines_log_is_not_kept_in_memory(front: Callable[[str], str], tmp_path: Path) -> None:
    """25 MB of lines before the real engine: the launcher does not grow by that."""
    engine = front('yes "a line that says nothing at all" | head -c 25000000\nexec liggghts "$@"')
    deck = render_deck(make_case(run=SHORT))
    (tmp_path / "run").mkdir()
    write_deck(deck, tmp_path / "run")
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")  # the peak so far is forgotten
    before = _kilobytes("VmHWM")
    assert launch(deck, tmp_path / "run", find_engine(engine)).version.startswith("LIGGGHTS")
    assert (tmp_path / "run" / "engine.log").stat().st_size > 25_000_000
    assert _kilobytes("VmHWM") - before < 12_000


def _kilobytes(name: str) -> int:
    """A line of ``/proc/self/status``, such as the most memory that there has been at once."""
    (line,) = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(name)]
    return int(line.split()[1])
