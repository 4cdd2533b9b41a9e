"""The program on a terminal and in a pipe: width, colours, options that people expect."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import walkers
from tests.conftest import ESCAPE, PROGRAM, SHORT, call, document, on_terminal
from walkers.inputs.case_building import build_case
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION, DYNAMIC_VISCOSITY, LENGTH, parse_quantity
from walkers.inputs.units import with_symbols as written_with_symbols
from walkers.postprocess.measure.in_words import motion_in_words
from walkers.postprocess.measure.uncertainty import SPREAD, SPREAD_NAME
from walkers.runner.run_directory import is_run_name
from walkers.runs.conditions import Condition
from walkers.sweeps.record import read_sweep_record
from walkers.sweeps.spread import POINTS
from walkers.terminal import styled_status
from walkers.text import aligned_blocks, aligned_with_text, fitted_table

RANGES = {"contact.restitution": [0.2, 0.8]}
"""The range of a value, over which a spread can be made."""
TWO_FREQUENCIES = 'case = "mine.toml"\n[axes]\ndrive.frequency = ["80 Hz", "90 Hz"]\n'
"""A sweep of a case."""


@pytest.fixture(scope="module")
def folder(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """A working directory with a case, its run and a spread of two draws."""

    def fill(folder: Path) -> None:
        case = document(run=SHORT, uncertain=RANGES)
        (folder / "mine.toml").write_text(_toml(case))
        call("run", "mine.toml", "--spread", "--points", "2", check=True, folder=folder)

    return once("terminal", fill)


def _toml(contents: dict[str, object]) -> str:
    import tomli_w

    return tomli_w.dumps(contents)


def _case() -> Case:
    return build_case(document(run=SHORT, uncertain=RANGES), name="mine")


# --- width ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command", ["run mine.toml", "run mine.toml -v", "show mine.toml", "library", "list --all"]
)
def test_output_fits_a_terminal_of_80_columns(command: str, folder: Path) -> None:
    printed = ESCAPE.sub("", on_terminal(*command.split(), folder=folder))
    wide = [line for line in printed.splitlines() if len(line) > 80]
    assert printed
    assert wide == []


@pytest.mark.parametrize("command", ["", "run", "export", "check", "check engine"])
def test_help_fits_a_terminal_of_60_columns(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    printed = call(*command.split(), "--help", check=True).stdout
    assert max(len(line) for line in printed.splitlines()) <= 60


def test_help_breaks_no_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """textwrap breaks words after hyphens unless it is told not to."""
    monkeypatch.setenv("COLUMNS", "60")
    printed = call("new", "--help", check=True).stdout
    assert "pile-\n" not in printed


def test_a_wide_terminal_has_sources_in_the_lines_of_the_values(folder: Path) -> None:
    source = "library: the paper, Methods (Sandoz Fils precision spheres)"
    assert source in on_terminal("show", "fig1b", folder=folder, columns=200)


def test_long_sources_are_footnotes_on_a_narrow_terminal(folder: Path) -> None:
    shown = ESCAPE.sub("", on_terminal("show", "fig1b", folder=folder))
    (mark,) = re.findall(r"(?m)^    density +4\.0 g/cm³ +library (\[\d+\])$", shown)
    note = f"  {mark}  the paper, Methods (Sandoz Fils precision spheres)\n"
    assert shown.count(note) == 1


def test_a_source_of_several_values_is_one_footnote(folder: Path) -> None:
    shown = call("show", "fig1b", check=True, folder=folder).stdout
    assert len(re.findall(r"calibrated \[(\d+)\], range", shown)) > 3
    assert shown.count("calibrated with Si AK5 and Si AK10") == 1


def test_a_row_of_a_listing_is_one_line_in_a_pipe(folder: Path) -> None:
    listed = call("list", "--all", check=True, folder=folder).stdout
    (row,) = [line for line in listed.splitlines() if re.match(r"mine-[0-9a-f]{12} ", line)]
    assert "finished" in row
    assert "0.3" in row  # the restitution, by which the draws differ


def test_the_last_line_of_a_listing_counts_a_single_spread(folder: Path) -> None:
    listed = call("list", check=True, folder=folder).stdout
    assert re.match(r"1 run, 1 spread or accuracy, ", listed.splitlines()[-1])


TABLE = [("name", "a", "bb"), ("first", "1", "2"), ("second", "30", "40")]


def test_a_table_that_is_too_wide_names_the_values_below_each_row() -> None:
    assert fitted_table(TABLE, 2, 12) == "\n".join(
        ["name    a", "first   1", "    bb 2", "second  30", "    bb 40"]
    )


def test_a_table_that_fits_stays_whole() -> None:
    whole = "name    a   bb\nfirst   1   2\nsecond  30  40"
    assert fitted_table(TABLE, 1, 14) == whole
    assert fitted_table(TABLE, 1) == whole


def test_the_parts_of_a_split_table_begin_with_the_same_column() -> None:
    assert aligned_blocks(TABLE, 12, right=[1, 2]) == "\n".join(
        [
            "name     a",
            "first    1",
            "second  30",
            "",
            "name    bb",
            "first    2",
            "second  40",
        ]
    )


def test_the_text_of_the_last_column_is_wrapped_in_its_column() -> None:
    rows = [("key", "one two three four five six seven"), ("other key", "")]
    assert aligned_with_text(rows, 36).splitlines() == [
        "key        one two three four five",
        "           six seven",
        "other key",
    ]


# --- colours --------------------------------------------------------------------------------------


def test_a_terminal_shows_the_velocity_in_bold(folder: Path) -> None:
    first_line, *_ = on_terminal("run", "mine.toml", folder=folder).splitlines()
    assert first_line.startswith("\x1b[1mmine: velocity ")


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}], ids=str)
def test_a_terminal_has_no_colours_if_they_are_not_wanted(
    variables: dict[str, str], folder: Path
) -> None:
    assert not ESCAPE.search(on_terminal("list", folder=folder, **variables))


@pytest.mark.parametrize("command", ["list", "run mine.toml", "help run", "nonsense"])
def test_a_pipe_has_no_colours(command: str, folder: Path) -> None:
    done = call(*command.split(), folder=folder)
    assert done.stdout + done.stderr
    assert not ESCAPE.search(done.stdout + done.stderr)


def test_colours_can_be_forced_in_a_pipe(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    listed = call("list", check=True, folder=folder).stdout
    assert "\x1b[32mfinished\x1b[0m" in listed


@pytest.mark.parametrize(
    ("status", "colour"),
    [("3 finished", "32"), ("3 finished, 1 failed", "31"), ("interrupted: 40 % done", "33")],
)
def test_a_status_has_the_colour_of_the_worst(
    status: str, colour: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert styled_status(status) == f"\x1b[{colour}m{status}\x1b[0m"


def test_colours_do_not_shift_columns(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = call("list", check=True, folder=folder).stdout
    monkeypatch.setenv("FORCE_COLOR", "1")
    coloured = call("list", check=True, folder=folder).stdout
    columns = [len(line.split("MB")[0].split("kB")[0]) for line in plain.splitlines()]
    stripped = ESCAPE.sub("", coloured).splitlines()
    assert [len(line.split("MB")[0].split("kB")[0]) for line in stripped] == columns


# --- help and options -----------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["run"], ["check", "engine"]], ids=" ".join)
def test_help_of_a_command_is_that_of_its_option(words: list[str]) -> None:
    asked = call("help", *words, check=True).stdout
    assert asked == call(*words, "--help", check=True).stdout
    assert asked.startswith(f"Usage: walkers {' '.join(words)} ")


def test_help_alone_is_the_help_of_the_program() -> None:
    assert call("help", check=True).stdout == call("--help", check=True).stdout


def test_help_of_a_command_that_does_not_exist_is_refused() -> None:
    done = call("help", "nonsense")
    assert done.returncode == 2
    assert 'Unknown command "nonsense"' in done.stderr


@pytest.mark.parametrize(
    ("command", "usage"),
    [
        ("run", "run [OPTIONS] CASE..."),
        ("new", "new [OPTIONS] NAME [CASE]"),
        ("clean", "clean [OPTIONS] [RUN|SWEEP...]"),
        ("list", "list [OPTIONS] [SWEEP]"),
        ("compare", "compare [OPTIONS] RUN|SWEEP [OTHER]"),
    ],
)
def test_usage_has_the_names_of_the_arguments(command: str, usage: str) -> None:
    first_line, *_ = call("help", command, check=True).stdout.splitlines()
    assert first_line == f"Usage: walkers {usage}"


def test_help_lists_the_choices_of_an_option() -> None:
    assert "--format deck|vtk|lammps|csv|archive\n" in call("help", "export", check=True).stdout
    assert "--log x|y|xy" in call("help", "plot", check=True).stdout


@pytest.mark.parametrize("option", ["--runs", "--out"])
def test_the_folder_of_runs_is_an_option(option: str, folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "runs", tmp_path / "elsewhere")
    listed = call("list", option, "elsewhere", check=True, folder=tmp_path).stdout
    assert "1 run," in listed


def test_help_does_not_mention_the_earlier_name_of_the_folder() -> None:
    helped = call("help", "run", check=True).stdout
    assert "--runs PATH" in helped
    assert "--out" not in helped


def test_the_environment_sets_the_folder_of_runs(folder: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "WALKERS_RUNS": str(folder / "runs")}
    command = [PROGRAM, "list"]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert "1 run," in done.stdout


# --- results --------------------------------------------------------------------------------------


def test_a_result_begins_with_velocity_errors_and_gait(folder: Path) -> None:
    printed = call("run", "mine.toml", check=True, folder=folder).stdout
    velocity = r"mine: velocity [\d.]+ mm/s, band [\d.]+ to [\d.]+ \(2 draws, approximate\)"
    gait = r"the large bead [a-z ]+, the small bead [a-z ]+"
    assert re.match(rf"{velocity} \(already run\) .*{gait}", " ".join(printed.split()))


def test_a_result_says_that_its_uncertainty_is_not_computed(tmp_path: Path) -> None:
    run = walkers.run(_case(), tmp_path)
    first, *others = run.describe().splitlines()
    assert re.fullmatch(r"mine: velocity [\d.]+ mm/s", first)
    expected = "uncertainty not computed: 1 uncertain value (--spread), numerical error"
    assert expected in " ".join(others)


def test_the_full_list_of_numbers_is_printed_on_demand(folder: Path) -> None:
    brief = call("run", "mine.toml", check=True, folder=folder).stdout
    verbose = call("run", "mine.toml", "-v", check=True, folder=folder).stdout
    assert "cost of transport" not in brief
    assert "cost of transport" in verbose
    assert "rotation of bead 1" in brief
    assert len(brief.splitlines()) < len(verbose.splitlines())


@pytest.mark.parametrize("options", [[], ["-v"]], ids=str)
def test_a_spread_is_printed_again_with_its_run(options: list[str], folder: Path) -> None:
    """As when it was made; only the lines of the run depend on the options."""
    first = call(
        "run", "mine.toml", "--spread", "--points", "2", *options, check=True, folder=folder
    )
    again = call("run", "mine.toml", *options, check=True, folder=folder)
    assert "\n  spread     2 draws;" in again.stdout
    assert again.stdout == first.stdout


def test_a_stored_spread_is_the_one_that_was_made(folder: Path) -> None:
    run = walkers.load(folder / "mine.toml", folder / "runs")
    assert isinstance(run, walkers.Run)
    stored = run.stored_spread()
    assert stored is not None
    assert stored.as_dict() == run.spread(2).as_dict()


@pytest.mark.parametrize(
    ("acceleration", "printed"), [("4 g", "a0 = 4 g"), ("20 m/s^2", "a0 = 20 m/s²")]
)
def test_an_acceleration_is_answered_in_its_unit(
    acceleration: str, printed: str, tmp_path: Path
) -> None:
    change = f"drive.peak_acceleration={acceleration}"
    shown = call("show", "fig1b", "--set", change, check=True, folder=tmp_path).stdout
    assert f"drive      {printed}" in shown
    case = build_case(document(run=SHORT, drive={"peak_acceleration": acceleration}), name="own")
    assert f"drive      80 Hz, {printed}" in walkers.run(case, tmp_path).describe()


@pytest.mark.parametrize(
    ("written", "symbols"),
    [
        ("70 um", "70 µm"),
        ("35 um to 137 um", "35 µm to 137 µm"),
        ("3.9 us", "3.9 µs"),
        ("0.92 g/cm^3", "0.92 g/cm³"),
        ("5 mm^2/s", "5 mm²/s"),
        ("4.6 mPa*s", "4.6 mPa s"),
        ("ruby", "ruby"),
        ("my_mesh^2.stl", "my_mesh^2.stl"),
    ],
)
def test_quantities_are_written_with_symbols(written: str, symbols: str) -> None:
    assert written_with_symbols(written) == symbols


def test_quantities_with_symbols_can_be_read_again() -> None:
    assert parse_quantity("70 µm", LENGTH) == 70e-6
    assert parse_quantity("4.6 mPa s", DYNAMIC_VISCOSITY) == 4.6e-3
    assert parse_quantity("20 m/s²", ACCELERATION) == 20.0


DIMER = {"velocity": 1e-3, "sin_delta": 0.2, "radius_1": 3e-4, "radius_2": 2e-4}


@pytest.mark.parametrize(
    ("large", "small", "words"),
    [
        # Rolling and sliding velocity of each bead, mm/s; their sum is the way.
        ((1.0, 0.0), (0.667, 0.333), "the large bead rolls, the small bead slides a third of"),
        ((1.0, 0.0), (1.0, 0.0), "both beads roll"),
        ((0.0, 1.0), (0.0, 1.0), "both beads slide"),
        ((1.0, 0.0), (0.1, 0.9), "the small bead slides 90 % of the way"),
        ((1.0, 0.0), (-0.5, 1.5), "the small bead slides and turns backward"),
        ((1.2, -0.2), (1.0, 0.0), "the large bead turns faster than it moves"),
        ((1.0, 0.0), (0.5, -0.5), "the small bead spins in place"),
    ],
)
def test_what_beads_do_is_said_in_words(
    large: tuple[float, float], small: tuple[float, float], words: str
) -> None:
    numbers = dict(DIMER)
    numbers["rotation_1"], numbers["sliding_1"] = (1e-3 * speed for speed in large)
    numbers["rotation_2"], numbers["sliding_2"] = (1e-3 * speed for speed in small)
    assert words in motion_in_words(numbers)
    mirrored = {**numbers, "radius_1": 2e-4, "radius_2": 3e-4}
    swapped = words.replace("large", "LARGE").replace("small", "large").replace("LARGE", "small")
    assert swapped in motion_in_words(mirrored)


@pytest.mark.parametrize(
    "circumstance",
    [{"came_apart": True}, {"stops_at": 5.0}, {"turned_round": 1}, {"walkers_make_0": 2}],
    ids=str,
)
def test_means_that_say_nothing_about_a_bead_are_not_put_into_words(
    circumstance: dict[str, float],
) -> None:
    numbers = {**DIMER, "rotation_1": 1e-3, "sliding_1": 0.0}
    assert motion_in_words(numbers)
    assert motion_in_words({**numbers, **circumstance}) == ""


def test_quiet_prints_results_alone(in_folder: Path) -> None:
    Path("mine.toml").write_text(_toml(document(run={**SHORT, "time_step": "1 us"})))
    done = call("run", "mine.toml", "-q", check=True)
    assert done.stdout.startswith("mine: velocity ")
    assert done.stderr == ""


def test_verbose_contradicts_quiet(in_folder: Path) -> None:
    for command in (["run", "fig1b"], ["sweep", "fig4"]):
        done = call(*command, "-q", "-v")
        assert done.returncode == 2
        assert "--verbose: prints more and --quiet less: expected one of them" in done.stderr
    done = call("run", "fig1b", "--json", "-v")
    assert done.returncode == 2
    assert "--verbose: prints a text: expected without --json" in done.stderr
    assert not list(in_folder.iterdir())


# --- plans and reports ----------------------------------------------------------------------------


def test_a_dry_run_writes_nothing_and_says_what_is_missing(in_folder: Path) -> None:
    planned = call("run", "fig1b", "--dry-run", "--spread", check=True).stdout
    assert "status     missing\n" in planned
    assert re.search(r"to do      run, predicted \d+ s\n", planned)
    assert re.search(r"directory  runs/fig1b-[0-9a-f]{12}\n", planned)
    assert f"spread     {POINTS} more runs, predicted" in planned
    assert not list(in_folder.iterdir())


def test_a_dry_run_prints_the_notes_of_cases_that_would_be_run(in_folder: Path) -> None:
    unit = "drive.frequency=80 kHz"
    planned = call("run", "fig1b", "--dry-run", "--set", unit, check=True)
    assert re.search(r"^walkers: fig1b: .*80 kHz", planned.stderr, re.MULTILINE), planned.stderr
    assert call("run", "fig1b", "--dry-run", "-q", "--set", unit, check=True).stderr == ""
    assert call("run", "fig1b", "--dry-run", check=True).stderr == ""


def test_fewer_draws_tell_that_they_replace_the_band_of_more(folder: Path, tmp_path: Path) -> None:
    runs = shutil.copytree(folder / "runs", tmp_path / "runs")
    options = ["mine.toml", "--runs", str(runs), "--spread", "--points"]
    more = call("run", *options, "3", check=True, folder=folder)
    assert "replaces" not in more.stderr
    fewer = call("run", *options, "2", check=True, folder=folder)
    replaced = "mine: the band of 2 draws replaces that of 3 draws, which are kept"
    assert replaced in fewer.stderr.replace("\n", " ")


def test_a_dry_run_knows_a_finished_run_and_its_draws(folder: Path) -> None:
    options = ["--dry-run", "--spread", "--points", "2"]
    planned = call("run", "mine.toml", *options, check=True, folder=folder).stdout
    assert re.search(r"status     finished, [\d.]+ mm/s\n  to do      nothing", planned)
    assert "spread     0 more runs" in planned


def test_a_forced_dry_run_says_that_the_finished_run_is_made_again(folder: Path) -> None:
    planned = call("run", "mine.toml", "--dry-run", "--force", check=True, folder=folder).stdout
    assert re.search(r"status     finished, [\d.]+ mm/s\n", planned)
    assert re.search(r"to do      run again and replace the result, predicted \d+ s\n", planned)


def test_a_dry_run_says_how_much_of_a_run_is_left(in_folder: Path) -> None:
    Path("slow.toml").write_text(_toml(document(run={**SHORT, "cycles": 4000})))
    assert call("run", "slow.toml", "--limit", "0.01").returncode == 1
    (failure,) = in_folder.glob("runs/*.incomplete/failure.json")
    failure.unlink()  # as of a run that was killed
    planned = call("run", "slow.toml", "--dry-run", check=True).stdout
    assert "status     interrupted, 0 % done\n  to do      continue the run" in planned


def test_a_report_opens_in_a_browser(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {tmp_path}/opened\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", str(browser))
    command = ["report", "mine.toml", "--to", "mine.html", "--open"]
    done = subprocess.run(
        [PROGRAM, *command], cwd=folder, capture_output=True, text=True, check=True
    )
    assert done.stdout == "mine.html\n"
    assert (tmp_path / "opened").read_text() == f"{(folder / 'mine.html').as_uri()}\n"


# --- the folder of runs ---------------------------------------------------------------------------


@pytest.fixture
def spread_runs(folder: Path, tmp_path: Path) -> Path:
    """A copy of the folder of runs."""
    return shutil.copytree(folder / "runs", tmp_path / "runs")


def _spread_of(runs: Path) -> Path:
    (spread,) = runs.glob(f"*{SPREAD}")
    return spread


def test_the_draws_of_a_spread_are_in_its_folder(spread_runs: Path) -> None:
    spread = _spread_of(spread_runs)
    beside = [path.name for path in spread_runs.iterdir() if is_run_name(path.name)]
    assert beside == [spread.name.removesuffix(SPREAD)]
    draws = [path.name for path in spread.iterdir() if is_run_name(path.name)]
    assert sorted(draws) == sorted(read_sweep_record(spread).runs)
    assert len(draws) == 2


def test_draws_beside_their_run_are_used_again(spread_runs: Path) -> None:
    """As earlier versions made them, whose records do not say where draws are."""
    spread = _spread_of(spread_runs)
    record = json.loads((spread / "sweep.json").read_text())
    del record["own_runs"]
    (spread / "sweep.json").write_text(json.dumps(record))
    times = {}
    for name in record["runs"]:
        shutil.move(spread / name, spread_runs / name)
        times[name] = (spread_runs / name / "manifest.json").stat().st_mtime_ns
    band = json.loads((spread / SPREAD_NAME).read_text())["bands"]
    (spread / SPREAD_NAME).unlink()
    again = walkers.run(_case(), spread_runs).spread(2)
    assert again.bands == band
    for name, time in times.items():
        assert (spread_runs / name / "manifest.json").stat().st_mtime_ns == time
        assert not (spread / name).exists()


def test_a_draw_is_found_by_its_name(spread_runs: Path) -> None:
    spread = _spread_of(spread_runs)
    name = read_sweep_record(spread).runs[0]
    for given in (name, f"{spread.name}/{name}"):
        found = walkers.load(given, spread_runs)
        assert found.directory.samefile(spread / name)


def test_cleaning_a_run_removes_its_draws(spread_runs: Path) -> None:
    name = _spread_of(spread_runs).name.removesuffix(SPREAD)
    call("clean", name, "--yes", check=True, folder=spread_runs.parent)
    assert not list(spread_runs.iterdir())


def test_an_interrupted_draw_is_listed_and_cleaned(spread_runs: Path) -> None:
    spread = _spread_of(spread_runs)
    name = read_sweep_record(spread).runs[0]
    (spread / name).rename(spread / f"{name}.incomplete")
    (spread / f"{name}.incomplete" / "manifest.json").unlink()
    listed = json.loads(
        call("list", "--all", "--json", check=True, folder=spread_runs.parent).stdout
    )
    statuses = {entry["name"]: entry["status"] for entry in listed}
    assert statuses[f"{spread.name}/{name}"] == "interrupted"
    call("clean", "--yes", check=True, folder=spread_runs.parent)
    assert not (spread / f"{name}.incomplete").exists()
    assert (spread / SPREAD_NAME).is_file()


def _listed(folder: Path, *options: str) -> list[str]:
    """Names of what ``walkers list`` shows."""
    listed = call("list", "--json", *options, check=True, folder=folder).stdout
    return [entry["name"] for entry in json.loads(listed)]


def test_list_shows_a_run_that_was_asked_for_beside_the_sweep_that_has_it(in_folder: Path) -> None:
    Path("mine.toml").write_text(_toml(document(run=SHORT)))
    Path("two.toml").write_text(
        'case = "mine.toml"\n[axes]\ndrive.frequency = ["80 Hz", "90 Hz"]\n'
    )
    call("sweep", "two.toml", "-q", check=True)
    assert _listed(in_folder) == ["two"]
    run = Path(call("run", "mine.toml", check=True).stdout.split("run        ")[1].split()[0])
    assert _listed(in_folder) == ["two", run.name]
    assert len(_listed(in_folder, "--all")) == 3


def test_spreads_of_points_are_listed_with_all_alone(in_folder: Path) -> None:
    Path("mine.toml").write_text(_toml(document(run=SHORT, uncertain=RANGES)))
    Path("two.toml").write_text(
        'case = "mine.toml"\n[axes]\ndrive.frequency = ["80 Hz", "90 Hz"]\n'
    )
    call("sweep", "two.toml", "--spread", "--points", "2", "-q", check=True)
    assert _listed(in_folder) == ["two"]
    everything = call("list", "--all", check=True).stdout
    assert re.search(rf"{SPREAD} +2 finished .*drive.frequency = 90 Hz", everything)


@pytest.mark.parametrize(
    ("condition", "number"),
    [
        ("velocity>0.001 mm/s", 1),
        ("velocity > 1 m/s", 0),
        ("velocity<=1 m/s", 1),
        ("walkers>=2", 0),
        ("walkers!=2", 1),
        ("frequency>79Hz", 1),
        ("frequency<79 Hz", 0),
        ("material!=glass", 1),
    ],
)
def test_list_selects_by_results(condition: str, number: int, folder: Path) -> None:
    names = _listed(folder, "--where", condition)
    assert len(names) == number


def test_a_search_counts_the_runs_that_a_list_hides(folder: Path, tmp_path: Path) -> None:
    """A sweep has made one run, and the other was asked for."""
    shutil.copytree(folder / "runs", tmp_path / "runs")
    shutil.copy(folder / "mine.toml", tmp_path)
    (tmp_path / "two.toml").write_text(TWO_FREQUENCIES)
    call("sweep", "two.toml", "-q", check=True, folder=tmp_path)
    listed = call("list", "--where", "velocity<1 m/s", check=True, folder=tmp_path).stdout
    assert re.match(r"2 runs, .+; 1 of them made by sweeps alone$", listed.splitlines()[-1])
    hidden = on_terminal("list", folder=tmp_path, columns=40).splitlines()
    assert max(map(len, hidden[-3:])) <= 40


def test_rows_of_a_removal_fit_a_terminal(folder: Path, tmp_path: Path) -> None:
    """Two sweeps share runs, which a remark says."""
    shutil.copytree(folder / "runs", tmp_path / "runs")
    shutil.copy(folder / "mine.toml", tmp_path)
    for name in ("first", "second", "third", "fourth", "fifth"):
        (tmp_path / f"a-sweep-with-a-long-name-{name}.toml").write_text(TWO_FREQUENCIES)
        call("sweep", f"a-sweep-with-a-long-name-{name}.toml", "-q", check=True, folder=tmp_path)
    (run,) = json.loads(
        call("list", "--json", "--where", "frequency=90 Hz", folder=tmp_path).stdout
    )
    printed = on_terminal("clean", run["name"], "--yes", folder=tmp_path)
    assert "fifth" in printed
    assert max(map(len, printed.splitlines())) <= 80


def test_draws_are_searched_with_all_alone(folder: Path) -> None:
    assert len(_listed(folder, "--all", "--where", "velocity<1 m/s")) == 3


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("velocity>2 deg", "expected a number with its unit, such as"),
        ("velocty>2 mm/s", 'did you mean "velocity"?'),
        ("velocity", "expected KEY=VALUE"),
        ("beads.material>2", "is no number: expected = or !="),
    ],
)
def test_list_refuses_conditions_on_results(condition: str, message: str, folder: Path) -> None:
    done = call("list", "--where", condition, folder=folder)
    assert done.returncode == 2
    assert message in done.stderr


def test_a_number_that_is_not_defined_meets_no_condition() -> None:
    condition = Condition.read("velocity<1 m/s")
    assert condition.holds({}, {"velocity": 0.5}) is True
    assert condition.holds({}, {"velocity": None}) is False
    assert condition.holds({}, None) is None
