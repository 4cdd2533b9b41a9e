"""The program at a shell: help, version, completion, and inputs of another kind than a command takes."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import walkers
from tests.conftest import call
from walkers import find_run, load_case
from walkers import run as run_case
from walkers.inputs.reading import shipped_cases
from walkers.main import COMMANDS
from walkers.runner import find_engine
from walkers.runner.directory import run_place
from walkers.runner.provenance import COMMIT_NAME, software


def _completed(monkeypatch: pytest.MonkeyPatch, line: str) -> list[str]:
    """What bash is offered for the last word of a line."""
    words = line.split(" ")
    variables = {"_WALKERS_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    with monkeypatch.context() as environment:
        environment.setattr(sys, "argv", ["walkers"])
        for name, value in variables.items():
            environment.setenv(name, value)
        return call(check=True).stdout.split()


def test_help_names_every_command() -> None:
    shown = call("--help", check=True).stdout
    assert not set(shown) & set("╭│╰─"), "boxes are for terminals"
    for command in COMMANDS:
        assert f"\n  {command} " in shown
        assert call(command, "-h", check=True).stdout == call(command, "--help", check=True).stdout


def test_version_names_package_commit_and_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    package, engine = call("--version", check=True).stdout.splitlines()
    assert package.startswith("granular-walkers 0.")
    root = Path(walkers.__file__).parent.parent
    if (root / ".git").exists():
        told = subprocess.run(["git", "-C", str(root), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
        assert package.partition("(commit ")[2].removesuffix(")").removesuffix("+changes") == told.stdout.strip()
    assert engine == f"LIGGGHTS-PUBLIC 3.8.0, {find_engine().path}"
    monkeypatch.setenv("WALKERS_ENGINE", "no-such-engine")
    assert "no engine: no-such-engine" in call("--version", check=True).stdout


def test_version_of_a_wheel_names_the_commit_that_it_was_built_from(tmp_path: Path) -> None:
    package = shutil.copytree(Path(walkers.__file__).parent, tmp_path / "walkers")
    (package / COMMIT_NAME).write_text("0123abc\n")
    command = [sys.executable, "-c", "from walkers.version import describe_version as one; print(one())"]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert told.startswith(f"granular-walkers {software().version} (commit 0123abc)\n")


@pytest.mark.parametrize("module", ["walkers", "walkers.main"])
def test_the_package_is_the_program(module: str) -> None:
    done = subprocess.run([sys.executable, "-m", module, "-h"], capture_output=True, text=True, check=True)
    assert done.stdout == call("--help", check=True).stdout
    assert done.stdout.startswith("Usage: walkers ")


def test_shells_complete_commands_names_runs_and_sweeps(
    looked_through: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "runs").symlink_to(looked_through)
    shutil.copy(looked_through.parent / "base.toml", tmp_path / "figure.toml")
    monkeypatch.chdir(tmp_path)
    runs = {Path(run).name for run in walkers.load("runs/three")["run"]}
    assert _completed(monkeypatch, "walkers comp") == ["compare"]
    assert _completed(monkeypatch, "walkers run fig") == [
        *(n for n in shipped_cases() if n[:3] == "fig"),
        "figure.toml",
    ]
    assert "fig2" in _completed(monkeypatch, "walkers sweep fi")
    assert runs <= set(_completed(monkeypatch, "walkers result base-"))
    assert set(_completed(monkeypatch, "walkers plot ")) >= runs | {"grid", "fig1b"}
    assert _completed(monkeypatch, "walkers plot runs/th") == ["runs/three"]
    assert _completed(monkeypatch, "walkers table runs/g") == ["runs/grid"]
    assert _completed(monkeypatch, "walkers list --case ") == ["base"]
    assert _completed(monkeypatch, "walkers list --status fa") == ["failed"]
    assert _completed(monkeypatch, "walkers result --out elsewhere base-") == []
    script = call("--show-completion", check=True).stdout
    assert "_WALKERS_COMPLETE" in script


def test_an_input_of_another_kind_is_told_with_its_command(looked_through: Path, tmp_path: Path) -> None:
    sweep, case = tmp_path / "mine.toml", looked_through.parent / "base.toml"
    sweep.write_text('case = "fig1b"\n[axes]\ndrive.frequency = ["60 Hz"]\n')
    run = str(Path(walkers.load(looked_through / "grid")["run"][0]).resolve())
    for arguments, told in (
        (("run", "fig2"), "fig2: is a sweep: walkers sweep fig2"),
        (("show", str(sweep)), f"is a sweep: walkers sweep {sweep}"),
        (("deck", str(looked_through / "grid")), "is a sweep's directory: walkers table"),
        (("run", run), f"is a run's directory: walkers result {run}"),
        (("sweep", "fig1b"), "fig1b: is a case: walkers run fig1b"),
        (("sweep", str(case)), f"is a case: walkers run {case}"),
        (("sweep", str(looked_through / "grid")), "is a sweep's directory"),
        (("theory", "ruby"), "ruby: is a calibration: walkers calibrate ruby"),
        (("calibrate", "fig2"), "fig2: is a sweep"),
        (("result", str(looked_through / "grid")), "a sweep's directory: walkers plot, table and status take it"),
    ):
        done = call(*arguments)
        assert done.returncode == 2
        assert told in done.stderr
    assert json.loads(call("show", str(case), "--json", check=True).stdout)


def test_sweeps_are_found_in_another_folder_of_runs(looked_through: Path, in_folder: Path) -> None:
    out = ("--out", str(looked_through))
    assert call("status", "grid", *out, check=True).stdout.startswith("grid: 6 points, 6 finished")
    assert call("table", "grid", *out, "--csv", check=True).stdout.count("\n") == 7
    done = call("climb", "grid", *out)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert f"{looked_through / 'grid'}: expected a finished run of a pile" in done.stderr


def test_a_folder_does_not_shadow_the_run_of_the_case_that_it_is_named_like(in_folder: Path) -> None:
    call("deck", "fig1b", "--to", "fig1b", check=True)
    place = run_case(load_case("fig1b", {"run.cycles": 6, "run.settling_cycles": 2}), in_folder / "short").directory
    told = call("result", "fig1b")
    assert "no finished run in runs; first do: walkers run fig1b" in told.stderr
    engine, case = find_engine(), load_case("fig1b")
    shutil.copytree(place, run_place(case, engine, Path("runs")))
    assert find_run("fig1b").directory == run_place(case, engine, Path("runs"))
