"""The program, the Makefile and the package, as a user meets them: at a shell and from Python."""

import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

import walkers
from tests.conftest import SHORT, call, document, to_toml
from walkers import load_case
from walkers.errors import InputError
from walkers.inputs.reading import shipped
from walkers.main import program
from walkers.postprocess.results import read
from walkers.postprocess.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.directory import is_finished
from walkers.runner.manifest import read_manifest

ROOT = Path(__file__).parent.parent


@pytest.mark.smoke
def test_two_beads_walk_toward_the_large_one(run_directory: Callable[..., Path]) -> None:
    """A 2-bead deck through the whole pipeline in a second or two: if this fails, nothing else is worth looking at."""
    directory = run_directory(run=SHORT)
    assert is_finished(directory)
    assert read_manifest(directory)["engine"]["version"] == "LIGGGHTS-PUBLIC 3.8.0"
    assert 1e-3 < read(directory)["velocity"] < 1e-2
    assert len(read_table(directory, "trajectory")) == 61


# --- what a newcomer does ---------------------------------------------------------------------------------------------


def test_from_a_case_file_to_a_deck_and_pictures(in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Progress is plain lines without a terminal. The first one is due after a second; here at once."""
    monkeypatch.setattr("walkers.progress._FIRST_LINE_SECONDS", 0.0)
    (in_folder / "mine.toml").write_text(to_toml(document(run={**SHORT, "cycles": 30})))
    printed = call("export", "mine.toml", "--to", "deck", check=True).stdout
    call("export", "mine.toml", "--to", "deck", "-o", "deck", check=True)
    assert (in_folder / "deck" / "walker.lig").read_text() == printed
    assert call("export", "mine.toml", "--to", "deck", "-o", "deck").returncode == 2
    done = call("run", "mine.toml", check=True)
    assert "velocity along the heading" in done.stdout
    lines = [line for line in done.stderr.splitlines() if not line.startswith("walkers: warning:")]
    assert lines
    assert all(re.match(r"mine: .* %, .*s simulated.*steps/s.*(left|starting)", line) for line in lines), lines
    assert "(already run)" in call("run", "mine.toml", check=True).stdout
    for command, last in (("plot", "gait.png"), ("export --to vtk", "walkers.pvd"), ("render", "walker.png")):
        path = Path(call(*command.split(), "mine.toml", check=True).stdout.split()[-1])
        assert (path.name, path.exists()) == (last, True)


@pytest.mark.parametrize("name", ["fig1b", "climber", "cluster", "tray", "pile-small"])
def test_a_new_case_runs_and_its_lines_that_are_commented_out_say_what_holds_without_them(
    name: str, in_folder: Path
) -> None:
    assert call("new", "mine", *([] if name == "fig1b" else [name]), check=True).stdout == "mine.toml\n"
    text = Path("mine.toml").read_text()
    assert text == shipped("case")[name].read_text()
    short = {"run.duration": "0.05 s", "run.longest_settling": "0 s"} if "duration" in text else {}
    case = load_case("mine", short)
    assert "mine: 170 Hz" if case.loose else "mm/s" in call("run", "mine", *settings(short), check=True).stdout
    table, tried = "", 0
    for head, key, value in re.findall(r"(?m)^(?:(?:# )?\[+(\w+)\]+.*|# ([\w.]+) *= *(.+?)(?: *#.*)?)$", text):
        table = {"clusters": "clusters[0]"}.get(head, head) or table
        if key:
            with_it = load_case("mine", {f"{table}.{key}": tomllib.loads(f"value = {value}")["value"]})
            said, without = (json.dumps(one.determinants()) for one in (with_it, load_case("mine")))
            assert re.sub(r"(\.\d{12})\d+", r"\1", said) == re.sub(r"(\.\d{12})\d+", r"\1", without), key
            tried += 1
    assert tried >= 3


def settings(changes: dict[str, str]) -> list[str]:
    return [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]


# --- help, version, completion ----------------------------------------------------------------------------------------


def test_help_names_every_command() -> None:
    shown, app = call("--help", check=True).stdout, program()
    for name in (name for name in app if name[0] != "-"):
        assert f"\n  {name} " in shown
        assert call(name, "-h", check=True).stdout == call(name, "--help", check=True).stdout
        assert all(f"walkers {name} {part} " in call(name, part, "-h", check=True).stdout for part in app[name])
    done = subprocess.run([sys.executable, "-m", "walkers", "-h"], capture_output=True, text=True, check=True)
    assert done.stdout == shown
    assert call("--version", check=True).stdout.splitlines()[1] == f"LIGGGHTS-PUBLIC 3.8.0, {find_engine().path}"
    targets = subprocess.run(["make"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert all(f"make {target}" in targets for target in ("walker", "test", "help", "clean"))


def test_a_function_gives_what_its_command_prints(looked_through: Path) -> None:
    out = ["--out", str(looked_through)]
    printed = json.loads(call("show", "fig1b", "--theory", "--json", *out, check=True).stdout)
    assert json.loads(json.dumps(walkers.predict("fig1b", looked_through))) == printed
    printed = json.loads(call("compare", "grid", "rough", "--json", *out, check=True).stdout)
    assert json.loads(json.dumps(walkers.compare("grid", "rough", looked_through).contents)) == printed
    with pytest.raises(InputError, match=r"^changes: is for runs and cases$"):
        walkers.compare("grid", "rough", looked_through, {"run.seed": 2})
    refused = call("compare", "grid", "rough", "--set", "run.seed=2", *out).stderr
    assert refused == "walkers: --set: is for runs and cases\n"


def test_the_library_lists_what_can_be_named_and_says_where_each_number_is_from() -> None:
    listed = [" ".join(line.split()) for line in call("library", check=True).stdout.splitlines()]
    assert "PMMA 1.19 g/cm^3 3.3 GPa 0.37" in listed
    assert "contact.friction.bead_wall 0.25 (0.1 to 0.6)" in listed
    for name in ("fig1b", "fig3", "ruby", "young-laplace"):
        assert any(line.startswith(f"{name} ") and len(line.split()) > 4 for line in listed), "a title"
    assert "walkers run fig1b" in call("library", "fig1b", check=True).stdout
    assert "PLEXIGLAS GS data sheet" in call("library", "pmma", check=True).stdout
    done = call("library", "steel")
    assert (done.returncode, "expected one of stainless steel, chrome steel" in done.stderr) == (2, True)


# --- what a word names ------------------------------------------------------------------------------------------------


# --- the package ------------------------------------------------------------------------------------------------------


def test_the_package_claims_one_name_and_exports_few_that_are_documented() -> None:
    """Others may have a module called inputs or runner, and theirs is theirs. Nothing public needs a notebook."""
    modules = "walkers.inputs, walkers.api, walkers.postprocess.report.run, walkers.sweeps.report"
    wanted = "{'inputs', 'runner', 'sweeps', 'IPython'}"
    script = f"import sys, {modules}; print(sorted({wanted} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], cwd="/", capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    assert dir(walkers) == walkers.__all__ == sorted(walkers.__all__, key=lambda name: (name.islower(), name))
    assert all(getattr(walkers, name).__doc__ for name in walkers.__all__)
