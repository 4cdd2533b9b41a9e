"""The program and its package, as a user meets them: at a shell, from Python, with and without the extras."""

from __future__ import annotations

import importlib
import inspect
import json
import os
import pickle
import pkgutil
import re
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from collections.abc import Callable, Iterable, Mapping
from graphlib import TopologicalSorter
from importlib import metadata
from pathlib import Path
from typing import Any

import grimp
import pytest
from cyclopts import App
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import walkers
from studies.paper.make import make_figures
from tests.conftest import SHORT, call, document, to_toml
from tests.tools.plant_faults import problems_of
from walkers import load_case
from walkers.calibration.calibrate import calibrate
from walkers.calibration.file import load_calibration
from walkers.commands import ALL_COMMANDS, Command
from walkers.errors import InputError, InputErrors, WalkersError, input_error, key_error
from walkers.extras import EXTRAS, ExtraMissing, module_of
from walkers.inputs.reading import shipped
from walkers.main import program
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.tables import read_table
from walkers.runner.binary import find_engine
from walkers.runner.failures import EngineFailure
from walkers.runner.manifest import read_manifest
from walkers.runner.run_directory import is_finished
from walkers.sweeps.scheduler import SweepOptions
from walkers.sweeps.site import load_site
from walkers.theory.prediction import predict

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OPTIONAL: dict[str, list[str]] = PROJECT["optional-dependencies"]
FOR_USERS = {
    extra: OPTIONAL[extra] for extra in OPTIONAL if extra not in {"all", "docs", "dev", "notebooks"}
}
VERSION = "0.1.1.dev7+g0123abc"
OURS = canonicalize_name(PROJECT["name"])


def names_of(requirements: Iterable[str]) -> list[str]:
    return [Requirement(one).name for one in requirements]


def closure(requirements: Iterable[str]) -> set[str]:
    """Names of the distributions that some requirements bring, as they are installed here."""
    left, seen = [Requirement(one) for one in requirements], set[tuple[str, str]]()
    while left:
        one = left.pop()
        name = canonicalize_name(one.name)
        for extra in {"", *one.extras} - {other for done, other in seen if done == name}:
            seen.add((name, extra))
            ours = OPTIONAL.get(extra, ()) if name == OURS else metadata.requires(name) or ()
            further = [Requirement(text) for text in ours]
            left += [
                it for it in further if it.marker is None or it.marker.evaluate({"extra": extra})
            ]
    return {name for name, _ in seen} - {OURS}


def python(*arguments: str, folder: Path, **environment: str) -> str:
    """What Python prints; the project in the folder is built by it."""
    how: dict[str, Any] = {
        "cwd": folder,
        "env": os.environ | environment,
        "capture_output": True,
        "text": True,
    }
    done = subprocess.run([sys.executable, *arguments], check=False, **how)
    assert done.returncode == 0, done.stderr
    return str(done.stdout)


@pytest.fixture(scope="module")
def wheel(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """Folder with the wheel that is built from the source distribution of the checkout."""

    def build(folder: Path) -> None:
        source = folder / "source"
        for package in ("walkers", "studies"):
            shutil.copytree(
                ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__")
            )
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, source)
        build = "import setuptools.build_meta as build; print(build.build_{}('..'))"
        version = "SETUPTOOLS_SCM_PRETEND_VERSION"
        name = python(
            "-c", build.format("sdist"), folder=source, **{version: VERSION}
        ).splitlines()[-1]
        shutil.unpack_archive(folder / name, folder, filter="data")
        unpacked = folder / name.removesuffix(".tar.gz")
        python("-c", build.format("wheel"), folder=unpacked, **{version: ""})

    return once("wheels", build)


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment that holds the wheel and its mandatory packages, and nothing else."""
    place = tmp_path_factory.mktemp("bare")
    venv.create(place, with_pip=False, symlinks=True)
    (site,) = place.glob("lib/python*/site-packages")
    for name in closure(PROJECT["dependencies"]):
        one = metadata.distribution(name)
        for part in {
            file.parts[0] for file in one.files or () if file.parts[0] not in {"..", "__pycache__"}
        }:
            if not (site / part).exists():
                (site / part).symlink_to(Path(str(one.locate_file(part))).resolve())
    shutil.unpack_archive(next(wheel.glob("*.whl")), site, "zip")
    return place / "bin" / "python"


def test_the_wheel_of_the_sdist_holds_all_files_of_the_package(wheel: Path) -> None:
    """And nothing else: no study."""
    with zipfile.ZipFile(next(wheel.glob("*.whl"))) as packed:
        held = {one: packed.read(one) for one in packed.namelist() if ".dist-info/" not in one}
    files = [
        path
        for path in (ROOT / "walkers").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]
    assert held == {
        path.relative_to(ROOT).as_posix(): path.read_bytes()
        for path in files
        if path.name[0] != "."
    }


@pytest.mark.slow
def test_mandatory_packages_run_tabulate_and_draw(bare: Path, in_folder: Path) -> None:
    """Several commands in one process: each start takes two seconds."""
    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT)))
    calls = "for words in sys.argv[1:]:\n  try: main(words.split())\n  except SystemExit as end: print('status', end)"
    commands = ("--version", *(f"{name} mine.toml" for name in ("run", "plot", "render", "report")))
    script = [bare, "-c", f"import sys; from walkers.main import main\n{calls}", *commands]
    done = subprocess.run(script, check=True, capture_output=True, text=True)
    version, ran, plotted, rendered, reported, _ = re.split(r"status (\d)\n", done.stdout)[::2]
    assert re.findall(r"status (\d)\n", done.stdout) == ["0", "0", "0", "0", "2"], done.stderr
    assert "0.1.1.dev7 (commit 0123abc)" in version
    assert "velocity" in ran
    pictures = [*plotted.split(), *rendered.split()]
    assert {"walk.png", "walker.png"} <= {Path(one).name for one in pictures if Path(one).is_file()}
    assert (reported, "needs k3d: make extras" in done.stderr) == ("", True)
    assert not list(in_folder.rglob("report.html"))


NEEDING: dict[str, list[Callable[[walkers.Run, Path], object]]] = {
    "archive": [lambda run, out: run.export("archive", out / "run.zip")],
    "calibrate": [lambda _, out: calibrate(load_calibration("ruby"), out, SweepOptions(1))],
    "check": [lambda *_: importlib.reload(importlib.import_module("walkers.second_engine"))],
    "cluster": [lambda _, out: load_site(out / "site.toml")],
    "film": [lambda run, out: run.film(out / "film.mp4")],
    "report": [lambda run, out: run.report(out / "run.html"), lambda run, _: run.view()],
    "theory": [
        lambda *_: predict(walkers.load_case("fig1b")),
        lambda _, out: make_figures(out / "runs", out / "figures", SweepOptions(1)),
    ],
}


@pytest.mark.parametrize("extra", EXTRAS)
def test_what_needs_an_extra_names_it_before_it_begins(
    extra: str, run_directory: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = walkers.load(run_directory(run=SHORT))
    for package in EXTRAS[extra][1]:
        monkeypatch.setitem(sys.modules, module_of(package), None)
    message = (
        rf"^{EXTRAS[extra][0]} needs [\w, -]+: make extras, or pip install '{OURS}\[{extra}\]'$"
    )
    for use in NEEDING[extra]:
        with pytest.raises(ExtraMissing, match=message):
            use(run, tmp_path)
    assert not list(tmp_path.iterdir())


def test_every_package_that_is_imported_is_declared() -> None:
    """As mandatory, or in an extra whose table in the program agrees with ``pyproject.toml``."""
    assert {extra: sorted(packages) for extra, (_, packages) in EXTRAS.items()} == {
        extra: sorted(names_of(requirements)) for extra, requirements in FOR_USERS.items()
    }
    assert Requirement(OPTIONAL["all"][0]).extras == FOR_USERS.keys()
    declared = names_of(
        [*PROJECT["dependencies"], *(one for given in FOR_USERS.values() for one in given)]
    )
    modules = {
        name: {file.parts[0].removesuffix(".py") for file in metadata.files(name) or ()}
        for name in declared
    }
    of_others = {
        "IPython",
        "paraview",
        "pydantic_core",
        "vtkmodules",
        "setuptools",
    }  # of a notebook, of pydantic, …
    used = {
        name.partition(".")[0]
        for name in grimp.build_graph("walkers", include_external_packages=True).modules
    }
    used -= {*sys.stdlib_module_names, "walkers", *of_others}
    assert used - set().union(*modules.values()) == set()
    assert [name for name in declared if not modules[name] & used] == [], "declared and not used"


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Imports inside of functions and those for types alone count. The error names the circle."""
    graph = grimp.build_graph("walkers", exclude_type_checking_imports=False)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    imports["walkers"] = set()  # the public names, which are loaded when they are asked for
    TopologicalSorter(imports).prepare()


def test_a_fault_that_cannot_be_planted_or_seen_is_named() -> None:
    """Its text has gone, or is there twice; or the tests that are to see it have gone."""
    sound = {
        "name": "sound",
        "file": "tests/conftest.py",
        "new": "",
        "tests": ["tests/test_program.py -k planted"],
    }
    sound["old"] = "def brief_pile("
    wrong = {
        "gone": {"old": "def a_function_that_nobody_wrote("},
        "twice": {"old": "import"},
        "nothing": {"new": "def brief_pile("},
        "no file": {"file": "tests/test_nothing.py"},
        "no test": {"tests": ["tests/test_words.py -k nobody_wrote_it"]},
        "no tests": {"tests": ["tests/test_nothing.py"]},
    }
    faults = [sound, *({**sound, "name": name, **changes} for name, changes in wrong.items())]
    found = problems_of(faults)
    assert [problem.partition(":")[0] for problem in found] == [*wrong]
    assert problems_of([sound, sound]) == ["sound: the name of 2 faults"]


@pytest.mark.smoke
def test_two_beads_walk_toward_the_large_one(run_directory: Callable[..., Path]) -> None:
    """A 2-bead deck through the whole pipeline in a second or two: if this fails, nothing else is worth looking at."""
    directory = run_directory(run=SHORT)
    assert is_finished(directory)
    assert read_manifest(directory)["engine"]["version"] == "LIGGGHTS-PUBLIC 3.8.0"
    assert 1e-3 < read_results(directory)["velocity"] < 1e-2
    assert len(read_table(directory, "trajectory")) == 61


def test_from_a_case_file_to_a_deck_and_a_run(
    in_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
    progress = re.compile(
        r"mine: (starting|\d+ %(, .* left, .*s simulated, .*steps/s)?|measuring)$"
    )
    assert all(map(progress.match, lines)), lines
    assert "(already run)" in call("run", "mine.toml", check=True).stdout
    written = Path(call("export", "--to", "vtk", "mine.toml", check=True).stdout.strip())
    assert (written.name, written.exists()) == ("walkers.pvd", True)


@pytest.mark.parametrize("name", ["fig1b", "climber", "cluster", "tray", "pile-small"])
def test_a_new_case_runs_and_its_lines_that_are_commented_out_say_what_holds_without_them(
    name: str, in_folder: Path
) -> None:
    assert (
        call("new", "mine", *([] if name == "fig1b" else [name]), check=True).stdout
        == "mine.toml\n"
    )
    text = Path("mine.toml").read_text()
    assert text == shipped("case")[name].read_text()
    loose = {"run.duration": "0.05 s", "run.longest_settling": "0 s"}
    short = loose if "duration" in text else {"run.cycles": 12, "run.settling_cycles": 4}
    case = load_case("mine", short)
    assert (
        "mine: 170 Hz"
        if case.loose
        else "mm/s" in call("run", "mine", *settings(short), check=True).stdout
    )
    table, tried = "", 0
    for head, key, value in re.findall(
        r"(?m)^(?:(?:# )?\[+(\w+)\]+.*|# ([\w.]+) *= *(.+?)(?: *#.*)?)$", text
    ):
        table = {"clusters": "clusters[0]"}.get(head, head) or table
        if key:
            with_it = load_case(
                "mine", {f"{table}.{key}": tomllib.loads(f"value = {value}")["value"]}
            )
            said, without = (json.dumps(one.determinants()) for one in (with_it, load_case("mine")))
            assert re.sub(r"(\.\d{12})\d+", r"\1", said) == re.sub(
                r"(\.\d{12})\d+", r"\1", without
            ), key
            tried += 1
    assert tried >= 3


def settings(changes: Mapping[str, object]) -> list[str]:
    return [word for key, value in changes.items() for word in ("--set", f"{key}={value}")]


@pytest.mark.parametrize("command", ALL_COMMANDS, ids=lambda command: command.name)
def test_the_table_of_commands_says_what_they_do(command: Command) -> None:
    function = pkgutil.resolve_name(command.place)
    if isinstance(function, App):  # with commands of its own, which have docstrings
        assert list(function), command.name
    else:
        first_paragraph = function.__doc__.partition("\n\n")[0]
        assert " ".join(first_paragraph.split()) == command.summary


def test_every_public_function_of_the_modules_of_commands_is_a_command() -> None:
    places = {command.place for command in ALL_COMMANDS}
    for module in {place.partition(":")[0] for place in places}:
        functions = inspect.getmembers(importlib.import_module(module), inspect.isfunction)
        own = {
            f"{module}:{name}"
            for name, function in functions
            if function.__module__ == module and name[0] != "_"
        }
        apps = inspect.getmembers(
            importlib.import_module(module), lambda value: isinstance(value, App)
        )
        of_apps = {
            f"{module}:{name}" for _, app in apps for name in map(str, app) if name[0] != "-"
        }
        of_apps |= {
            f"{module}:{app.default_command.__name__}" for _, app in apps if app.default_command
        }
        assert own - of_apps <= places


@pytest.mark.parametrize(
    "error",
    [
        InputErrors(
            [input_error("one", "expected another"), key_error("drive.frequency", "expected Hz", 3)]
        ),
        ExtraMissing("report", ["k3d"]),
        EngineFailure("stopped", Path("runs/one"), lost=3),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_come_back_from_another_process(error: WalkersError) -> None:
    """As those of the workers of an executor do."""
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again).keys()) == (
        type(error),
        str(error),
        vars(error).keys(),
    )


def test_help_names_every_command() -> None:
    shown, app = call("--help", check=True).stdout, program()
    for name in (name for name in app if name[0] != "-"):
        assert f"\n  {name} " in shown
        assert call(name, "-h", check=True).stdout == call(name, "--help", check=True).stdout
        assert all(
            f"walkers {name} {part} " in call(name, part, "-h", check=True).stdout
            for part in app[name]
            if part[0] != "-"
        )
    done = subprocess.run(
        [sys.executable, "-m", "walkers", "-h"], capture_output=True, text=True, check=True
    )
    assert done.stdout == shown
    assert (
        call("--version", check=True).stdout.splitlines()[1]
        == f"LIGGGHTS-PUBLIC 3.8.0, {find_engine().path}"
    )
    targets = subprocess.run(["make"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert all(f"make {target}" in targets for target in ("walker", "test", "help", "clean"))


SLOW = "cyclopts rich pydantic numpy scipy pandas matplotlib pyarrow pyvista pint"
PUBLIC = (
    "import walkers.inputs, walkers.api, walkers.postprocess.show.report.run, walkers.sweeps.report"
)
LOADED: dict[str, tuple[str, str, set[str]]] = {
    "help": ("import walkers.main as m; m._status(['--help'])", SLOW, set()),
    "list": (
        "import walkers.main as m; m._status(['list'])",
        SLOW,
        {"cyclopts", "numpy", "pydantic"},
    ),
    "package": (PUBLIC, "inputs runner sweeps IPython", set()),
}
"""What is done, modules that take long to import, or are others', and those of them that are loaded then."""


@pytest.mark.parametrize("name", LOADED)
def test_no_more_is_loaded_than_is_needed(name: str, in_folder: Path) -> None:
    """Others may have a module called inputs or runner, and theirs is theirs. Nothing public needs a notebook."""
    script, modules, expected = LOADED[name]
    assert {
        *python("-c", f"{script}; import sys; print(*sys.modules)", folder=in_folder)
        .splitlines()[-1]
        .split()
    } & {*modules.split()} == expected


def test_a_function_gives_what_its_command_prints(looked_through: Path) -> None:
    out = ["--out", str(looked_through)]
    printed = json.loads(call("show", "fig1b", "--theory", "--json", *out, check=True).stdout)
    assert json.loads(json.dumps(walkers.predict("fig1b", looked_through))) == printed
    runs = [Path(run).name for run in walkers.load("grid", looked_through).table()["run"][:2]]
    printed = json.loads(call("compare", *runs, "--json", *out, check=True).stdout)
    assert json.loads(json.dumps(walkers.compare(*runs, looked_through).contents)) == printed
    with pytest.raises(InputError, match=r"grid: is a sweep.s directory: walkers list"):
        walkers.compare("grid", "rough", looked_through)
    input_error = call("list", "grid", "--all", *out).stderr
    assert input_error == "walkers: --all: is for folders, not for a sweep\n"


def test_the_package_exports_few_names_that_are_documented() -> None:
    assert (
        dir(walkers)
        == walkers.__all__
        == sorted(walkers.__all__, key=lambda name: (name.islower(), name))
    )
    assert all(getattr(walkers, name).__doc__ for name in walkers.__all__)
