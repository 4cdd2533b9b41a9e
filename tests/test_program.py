"""The program and its package, as a user meets them: at a shell, from Python, without extras."""

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
from collections.abc import Callable, Iterable
from graphlib import TopologicalSorter
from importlib import metadata
from pathlib import Path
from types import ModuleType
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

FillOnce = Callable[[str, Callable[[Path], object]], Path]
ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OPTIONAL: dict[str, list[str]] = PROJECT["optional-dependencies"]
FOR_DEVELOPERS = {"all", "docs", "dev", "notebooks"}
FOR_USERS = sorted(OPTIONAL.keys() - FOR_DEVELOPERS)
"""Extras that a user installs for what the program does with them."""
VERSION = "0.1.1.dev7+g0123abc"
OURS = canonicalize_name(PROJECT["name"])


def names_of(requirements: Iterable[str]) -> list[str]:
    """Sorted names of the distributions that are required."""
    return sorted(Requirement(requirement).name for requirement in requirements)


def requirements_of(name: str, extra: str) -> list[str]:
    """What a distribution that is installed here requires, with an extra or without ("")."""
    if name == OURS:
        return OPTIONAL.get(extra, [])
    required = []
    for text in metadata.requires(name) or ():
        marker = Requirement(text).marker
        if marker is None or marker.evaluate({"extra": extra}):
            required.append(text)
    return required


def distributions_for(requirements: Iterable[str]) -> set[str]:
    """Names of the distributions that requirements bring, without our own."""
    names = set[str]()
    visited = set[tuple[str, str]]()
    pending = list(requirements)
    while pending:
        requirement = Requirement(pending.pop())
        name = canonicalize_name(requirement.name)
        names.add(name)
        for extra in {"", *requirement.extras}:
            if (name, extra) not in visited:
                visited.add((name, extra))
                pending += requirements_of(name, extra)
    return names - {OURS}


def python(*arguments: str, folder: Path, **environment: str) -> str:
    """What Python prints in a folder."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(once: FillOnce) -> Path:
    """The wheel that is built from the source distribution of the checkout."""

    def build(folder: Path) -> None:
        source = folder / "source"
        ignored = shutil.ignore_patterns("__pycache__")
        for package in ("walkers", "studies"):
            shutil.copytree(ROOT / package, source / package, ignore=ignored)
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, source)
        backend = "import setuptools.build_meta as build"
        printed = python(
            "-c",
            f"{backend}; print(build.build_sdist('..'))",
            folder=source,
            SETUPTOOLS_SCM_PRETEND_VERSION=VERSION,
        )
        sdist = printed.splitlines()[-1]
        shutil.unpack_archive(folder / sdist, folder, filter="data")
        python(
            "-c",
            f"{backend}; print(build.build_wheel('..'))",
            folder=folder / sdist.removesuffix(".tar.gz"),
            SETUPTOOLS_SCM_PRETEND_VERSION="",  # the sdist knows its version
        )

    (built,) = once("wheels", build).glob("*.whl")
    return built


@pytest.fixture(scope="module")
def bare_python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment with the wheel and its mandatory packages alone."""
    place = tmp_path_factory.mktemp("bare")
    venv.create(place, with_pip=False, symlinks=True)
    (site_packages,) = place.glob("lib/python*/site-packages")
    for name in distributions_for(PROJECT["dependencies"]):
        distribution = metadata.distribution(name)
        for file in distribution.files or ():
            entry = file.parts[0]
            link = site_packages / entry
            if entry not in ("..", "__pycache__") and not link.exists():
                link.symlink_to(Path(str(distribution.locate_file(entry))).resolve())
    shutil.unpack_archive(wheel, site_packages, "zip")
    return place / "bin" / "python"


def test_the_wheel_of_the_sdist_holds_all_files_of_the_package_and_no_study(wheel: Path) -> None:
    packed = {}
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if ".dist-info/" not in name:
                packed[name] = archive.read(name)
    files = {}
    for path in (ROOT / "walkers").rglob("*"):
        hidden = path.name.startswith(".") or "__pycache__" in path.parts
        if path.is_file() and not hidden:
            files[path.relative_to(ROOT).as_posix()] = path.read_bytes()
    assert packed == files


CALLS = """
import sys
from walkers.main import main
for command in sys.argv[1:]:
    try:
        main(command.split())
    except SystemExit as end:
        print("status", end)
"""
"""Calls several commands in a process, because each start takes two seconds."""


def printed_path(name: str, printed: str) -> Path:
    """The path of a file among printed ones."""
    (path,) = re.findall(rf"\S*/{name}", printed)
    return Path(path)


@pytest.mark.slow
def test_mandatory_packages_run_tabulate_and_draw(bare_python: Path, in_folder: Path) -> None:
    """A report needs k3d, which is not there: it is refused, and nothing is written."""
    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT)))
    commands = ["--version", "run mine.toml", "plot mine.toml", "render mine.toml"]
    commands.append("report mine.toml")
    script = [bare_python, "-c", CALLS, *commands]
    done = subprocess.run(script, check=True, capture_output=True, text=True)
    parts = re.split(r"status (\d)\n", done.stdout)
    assert parts[1::2] == ["0", "0", "0", "0", "2"], done.stderr
    version, results, plotted, rendered, reported, _ = parts[::2]
    assert "0.1.1.dev7 (commit 0123abc)" in version
    assert "velocity" in results
    assert printed_path("walk.png", plotted).is_file()
    assert printed_path("walker.png", rendered).is_file()
    assert reported == ""
    assert "needs k3d: make extras" in done.stderr
    assert not list(in_folder.rglob("report.html"))


def export_archive(run: walkers.Run, folder: Path) -> None:
    run.export("archive", folder / "run.zip")


def calibrate_ruby(_: walkers.Run, folder: Path) -> None:
    calibrate(load_calibration("ruby"), folder, SweepOptions(1))


def import_second_engine(*_: object) -> ModuleType:
    return importlib.reload(importlib.import_module("walkers.second_engine"))


def read_site(_: walkers.Run, folder: Path) -> None:
    load_site(folder / "site.toml")


def make_film(run: walkers.Run, folder: Path) -> None:
    run.film(folder / "film.mp4")


def write_report(run: walkers.Run, folder: Path) -> None:
    run.report(folder / "run.html")


def show_in_notebook(run: walkers.Run, _: Path) -> None:
    run.view()


def predict_a_walk(*_: object) -> None:
    predict(walkers.load_case("fig1b"))


def draw_the_paper(_: walkers.Run, folder: Path) -> None:
    make_figures(folder / "runs", folder / "figures", SweepOptions(1))


USES: list[tuple[str, Callable[[walkers.Run, Path], object]]] = [
    ("archive", export_archive),
    ("calibrate", calibrate_ruby),
    ("check", import_second_engine),
    ("cluster", read_site),
    ("film", make_film),
    ("report", write_report),
    ("report", show_in_notebook),
    ("theory", predict_a_walk),
    ("theory", draw_the_paper),
]
"""Extras, and what needs their packages."""


@pytest.mark.parametrize(("extra", "use"), USES)
def test_what_needs_an_extra_names_it_before_it_begins(
    extra: str,
    use: Callable[[walkers.Run, Path], object],
    run_directory: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = walkers.load(run_directory(run=SHORT))
    purpose, packages = EXTRAS[extra]
    for package in packages:
        monkeypatch.setitem(sys.modules, module_of(package), None)
    message = rf"^{purpose} needs [\w, -]+: make extras, or pip install '{OURS}\[{extra}\]'$"
    with pytest.raises(ExtraMissing, match=message):
        use(run, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_use_of_every_extra_is_tested() -> None:
    tested, _ = zip(*USES, strict=True)
    assert set(tested) == EXTRAS.keys()


def test_extras_of_the_program_are_those_of_the_project() -> None:
    of_program = {}
    for extra, (_, packages) in EXTRAS.items():
        of_program[extra] = sorted(packages)
    of_project = {}
    for extra in FOR_USERS:
        of_project[extra] = names_of(OPTIONAL[extra])
    assert of_program == of_project


def test_the_extra_all_brings_every_extra_for_users() -> None:
    assert Requirement(OPTIONAL["all"][0]).extras == set(FOR_USERS)


OF_OTHER_PACKAGES = {"IPython", "paraview", "pydantic_core", "vtkmodules", "setuptools"}
"""Modules that come with a notebook, with pydantic, with PyVista …"""


@pytest.fixture(scope="module")
def imported_modules() -> set[str]:
    """Top modules that the package imports, without Python's own."""
    graph = grimp.build_graph("walkers", include_external_packages=True)
    tops = {name.partition(".")[0] for name in graph.modules}
    return tops - sys.stdlib_module_names - OF_OTHER_PACKAGES - {"walkers"}


@pytest.fixture(scope="module")
def declared_modules() -> dict[str, set[str]]:
    """Top modules of each distribution that the project declares for users."""
    requirements = list(PROJECT["dependencies"])
    for extra in FOR_USERS:
        requirements += OPTIONAL[extra]
    modules = {}
    for name in names_of(requirements):
        files = metadata.files(name) or ()
        modules[name] = {file.parts[0].removesuffix(".py") for file in files}
    return modules


def test_every_package_that_is_imported_is_declared(
    imported_modules: set[str], declared_modules: dict[str, set[str]]
) -> None:
    assert imported_modules - set().union(*declared_modules.values()) == set()


def test_every_package_that_is_declared_is_imported(
    imported_modules: set[str], declared_modules: dict[str, set[str]]
) -> None:
    unused = [name for name, tops in declared_modules.items() if not tops & imported_modules]
    assert unused == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Imports inside of functions and those for types alone count. The error names the circle."""
    graph = grimp.build_graph("walkers", exclude_type_checking_imports=False)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    imports["walkers"] = set()  # the public names, which are loaded when they are asked for
    TopologicalSorter(imports).prepare()


SOUND_FAULT = {
    "name": "sound",
    "file": "pyproject.toml",
    "old": "[build-system]",
    "new": "",
    "tests": ["tests/test_program.py -k planted"],
}


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        pytest.param(
            {"old": "a line that nobody wrote"},
            "the old text is 0 times in pyproject.toml, not once",
            id="text that has gone",
        ),
        pytest.param(
            {"old": "pytest"}, "times in pyproject.toml, not once", id="text in several places"
        ),
        pytest.param(
            {"new": "[build-system]"},
            "the new text is the old one",
            id="fault that changes nothing",
        ),
        pytest.param(
            {"file": "tests/test_nothing.py"},
            "the old text is 0 times in tests/test_nothing.py, not once",
            id="file that has gone",
        ),
        pytest.param(
            {"tests": ["tests/test_words.py -k nobody_wrote_it"]},
            "tests/test_words.py has no nobody_wrote_it",
            id="test that has gone",
        ),
        pytest.param(
            {"tests": ["tests/test_nothing.py"]},
            "there is no tests/test_nothing.py",
            id="file of tests that has gone",
        ),
    ],
)
def test_a_fault_that_cannot_be_planted_or_seen_is_named(
    changes: dict[str, Any], problem: str
) -> None:
    (line,) = problems_of([SOUND_FAULT | changes])
    assert line.startswith("sound: ")
    assert line.endswith(problem)


def test_a_sound_fault_has_no_problem() -> None:
    assert problems_of([SOUND_FAULT]) == []


def test_faults_have_different_names() -> None:
    assert problems_of([SOUND_FAULT, SOUND_FAULT]) == ["sound: the name of 2 faults"]


@pytest.mark.smoke
def test_two_beads_walk_toward_the_large_one(run_directory: Callable[..., Path]) -> None:
    """A deck of two beads through the whole pipeline in a second or two.

    If this fails, nothing else is worth looking at. The paper's walkers go at some mm/s. There are
    six cycles of ten samples, and one sample at the start.
    """
    directory = run_directory(run=SHORT)
    assert is_finished(directory)
    assert read_manifest(directory)["engine"]["version"] == "LIGGGHTS-PUBLIC 3.8.0"
    assert 1e-3 < read_results(directory)["velocity"] < 1e-2
    assert len(read_table(directory, "trajectory")) == 61


def test_a_deck_is_printed_or_written_to_a_new_folder(in_folder: Path) -> None:
    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT)))
    printed = call("export", "mine.toml", "--format", "deck", check=True).stdout
    call("export", "mine.toml", "--format", "deck", "-o", "deck", check=True)
    assert (in_folder / "deck" / "walker.lig").read_text() == printed
    again = call("export", "mine.toml", "--format", "deck", "-o", "deck")
    assert again.returncode == 2


FirstRun = tuple[Path, subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def first_run(tmp_path_factory: pytest.TempPathFactory) -> FirstRun:
    """A folder with a run of ``mine.toml``, and what the program said of it.

    The first line of progress is due after a second; here it is due at once.
    """
    folder = tmp_path_factory.mktemp("first")
    (folder / "mine.toml").write_text(to_toml(document(run={**SHORT, "cycles": 30})))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("walkers.progress._FIRST_LINE_SECONDS", 0.0)
        return folder, call("run", "mine.toml", check=True, folder=folder)


def test_a_run_prints_its_result(first_run: FirstRun) -> None:
    _, done = first_run
    assert done.stdout.startswith("mine: velocity ")


def test_progress_is_plain_lines_without_a_terminal(first_run: FirstRun) -> None:
    _, done = first_run
    progress = re.compile(
        r"mine: (starting, .* left|\d+ %, .* left, .*s simulated|measuring|done in \d+ s)"
    )
    lines = []
    for line in done.stderr.splitlines():
        if not line.startswith("walkers: warning:"):
            lines.append(line)
            assert progress.fullmatch(line)
    assert len(lines) > 1
    assert lines[-1].startswith("mine: done in ")


def test_a_finished_run_is_not_run_again(first_run: FirstRun) -> None:
    folder, _ = first_run
    assert "(already run)" in call("run", "mine.toml", check=True, folder=folder).stdout


def test_an_export_for_paraview_prints_where_it_is(first_run: FirstRun) -> None:
    folder, _ = first_run
    printed = call("export", "--format", "vtk", "mine.toml", check=True, folder=folder).stdout
    written = folder / printed.strip()
    assert written.name == "walkers.pvd"
    assert written.exists()


def commented_out_values(text: str) -> dict[str, Any]:
    """Values that a case file has in its comments, such as ``# angle = "0 deg"``, by key."""
    values = {}
    table = ""
    for line in text.splitlines():
        header = re.fullmatch(r"(?:# )?\[+(\w+)\]+.*", line)
        assignment = re.fullmatch(r"# ([\w.]+) *= *(.+)", line)
        if header and header[1] == "clusters":
            table = "clusters[0]"
        elif header:
            table = header[1]
        elif assignment:
            key = f"{table}.{assignment[1]}"
            values[key] = tomllib.loads(f"value = {assignment[2]}")["value"]
    return values


def rounded_determinants(case: walkers.Case) -> str:
    """What determines a run, with 12 digits after the point."""
    return re.sub(r"(\.\d{12})\d+", r"\1", json.dumps(case.determinants()))


NEW_CASES = ["fig1b", "climber", "cluster", "tray", "pile-small"]


@pytest.mark.parametrize("name", NEW_CASES)
def test_lines_of_a_new_case_that_are_commented_out_say_what_holds_without_them(
    name: str,
) -> None:
    case = load_case(name)
    values = commented_out_values(shipped("case")[name].read_text())
    assert len(values) >= 3
    for key, value in values.items():
        with_value = load_case(name, {key: value})
        assert rounded_determinants(with_value) == rounded_determinants(case), key


CYCLES = ["--set", "run.cycles=12", "--set", "run.settling_cycles=4"]
SECONDS = ["--set", "run.duration=0.02 s", "--set", "run.longest_settling=0 s"]


def read_shipped(name: str) -> str:
    """The text of a shipped case."""
    return shipped("case")[name].read_text()


def without_title(text: str) -> str:
    """The text of a case without the line of its title."""
    return re.sub("(?m)^title .*\n", "", text)


@pytest.mark.parametrize(
    ("name", "settings", "printed"),
    [
        ("fig1b", CYCLES, "mm/s"),
        ("climber", CYCLES, "mm/s"),
        ("tray", CYCLES, "mm/s"),
        # Loose beads are no walkers.
        ("cluster", CYCLES, "mine: 0 climbs"),
        ("pile-small", SECONDS, "mine: 0 climbs"),
    ],
    ids=["fig1b", "climber", "tray", "cluster", "pile-small"],
)
def test_a_new_case_is_the_shipped_one_and_runs(
    name: str, settings: list[str], printed: str, in_folder: Path
) -> None:
    assert call("new", "mine", name, check=True).stdout == "mine.toml\n"
    assert without_title(Path("mine.toml").read_text()) == without_title(read_shipped(name))
    assert printed in call("run", "mine", *settings, check=True).stdout


def test_a_new_case_is_that_of_fig1b_unless_another_one_is_named(in_folder: Path) -> None:
    assert call("new", "mine", check=True).stdout == "mine.toml\n"
    assert without_title(Path("mine.toml").read_text()) == without_title(read_shipped("fig1b"))


def test_a_new_case_has_a_title_of_its_own(in_folder: Path) -> None:
    call("new", 'my "best" walker', check=True)
    assert walkers.load_case('my "best" walker').title == 'my "best" walker, from fig1b'


@pytest.mark.parametrize("command", ALL_COMMANDS, ids=lambda command: command.name)
def test_the_table_of_commands_says_what_they_do(command: Command) -> None:
    function = pkgutil.resolve_name(command.place)
    if isinstance(function, App):  # with commands of its own, which have docstrings
        assert list(function), command.name
    else:
        first_paragraph = function.__doc__.partition("\n\n")[0]
        assert " ".join(first_paragraph.split()) == command.summary


def public_functions(module: ModuleType) -> set[str]:
    """Names of the public functions that a module defines."""
    names = set()
    for name, function in inspect.getmembers(module, inspect.isfunction):
        if function.__module__ == module.__name__ and not name.startswith("_"):
            names.add(name)
    return names


def commands_of_apps(module: ModuleType) -> set[str]:
    """Names of the functions behind apps of a module, which have commands of their own."""
    names = set()
    for value in vars(module).values():
        if isinstance(value, App):
            names |= set(value)
            if value.default_command:
                names.add(value.default_command.__name__)
    return names


COMMAND_MODULES = sorted({command.place.partition(":")[0] for command in ALL_COMMANDS})


@pytest.mark.parametrize("name", COMMAND_MODULES)
def test_every_public_function_of_the_modules_of_commands_is_a_command(name: str) -> None:
    module = importlib.import_module(name)
    places = {command.place for command in ALL_COMMANDS}
    for function in public_functions(module) - commands_of_apps(module):
        assert f"{name}:{function}" in places


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
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again).keys() == vars(error).keys()


def command_names(app: App) -> list[str]:
    """Names of the commands of an app, without its options."""
    return [name for name in app if not name.startswith("-")]


@pytest.fixture(scope="module")
def program_help() -> str:
    return call("--help", check=True).stdout


@pytest.mark.parametrize("name", command_names(program()))
def test_help_names_every_command(name: str, program_help: str) -> None:
    assert f"\n  {name} " in program_help
    command_help = call(name, "--help", check=True).stdout
    assert call(name, "-h", check=True).stdout == command_help
    for part in command_names(program()[name]):
        assert f"walkers {name} {part} " in call(name, part, "-h", check=True).stdout


def test_python_runs_the_package_as_the_program(program_help: str) -> None:
    command = [sys.executable, "-m", "walkers", "-h"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == program_help


def test_the_version_names_the_engine() -> None:
    _, engine, *_ = call("--version", check=True).stdout.splitlines()
    assert engine == f"LIGGGHTS-PUBLIC 3.8.0, {find_engine().path}"


def test_make_names_its_targets() -> None:
    targets = subprocess.run(["make"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for target in ("walker", "test", "help", "clean"):
        assert f"make {target}" in targets


SLOW_MODULES = {
    "cyclopts",
    "rich",
    "pydantic",
    "numpy",
    "scipy",
    "pandas",
    "matplotlib",
    "pyarrow",
    "pyvista",
    "pint",
}
"""Modules that take long to import."""


def loaded_by(statements: str, folder: Path) -> set[str]:
    """Modules that are loaded after some statements of Python in a process of its own."""
    printed = python("-c", f"{statements}; import sys; print(*sys.modules)", folder=folder)
    return set(printed.splitlines()[-1].split())


def test_the_help_loads_no_slow_module(in_folder: Path) -> None:
    loaded = loaded_by("import walkers.main as m; m._status(['--help'])", in_folder)
    assert loaded & SLOW_MODULES == set()


@pytest.mark.parametrize("command", ["run", "show", "sweep", "list", "plot", "render", "compare"])
def test_the_help_of_a_command_loads_what_prints_it(command: str, in_folder: Path) -> None:
    statement = f"import walkers.main as m; m._status(['{command}', '--help'])"
    assert loaded_by(statement, in_folder) & SLOW_MODULES == {"cyclopts", "rich"}


def test_a_list_loads_few_slow_modules(in_folder: Path) -> None:
    loaded = loaded_by("import walkers.main as m; m._status(['list'])", in_folder)
    assert loaded & SLOW_MODULES == {"cyclopts", "numpy", "pydantic"}


def test_the_package_loads_no_module_under_a_name_that_users_may_have(in_folder: Path) -> None:
    """Links at the top of the checkout have such names. Nothing public needs a notebook."""
    public = (
        "import walkers.inputs, walkers.api",
        "import walkers.postprocess.show.report.run, walkers.sweeps.report",
    )
    loaded = loaded_by("; ".join(public), in_folder)
    assert loaded & {"inputs", "runner", "sweeps", "IPython"} == set()


def as_json(value: object) -> Any:
    """What JSON keeps of a value."""
    return json.loads(json.dumps(value))


def test_predict_gives_what_its_command_prints(looked_through: Path) -> None:
    done = call("show", "fig1b", "--theory", "--json", "--out", str(looked_through), check=True)
    assert as_json(walkers.predict("fig1b", looked_through)) == json.loads(done.stdout)


def test_compare_gives_what_its_command_prints(looked_through: Path) -> None:
    runs = walkers.load("grid", looked_through).runs
    first = runs[0].directory.name
    second = runs[1].directory.name
    done = call("compare", first, second, "--json", "--out", str(looked_through), check=True)
    comparison = walkers.compare(first, second, looked_through)
    assert as_json(comparison.contents) == json.loads(done.stdout)


def test_runs_and_sweeps_themselves_stand_for_their_names(looked_through: Path) -> None:
    runs = walkers.load("grid", looked_through).runs
    first, second = runs[:2]
    by_name = walkers.compare(first.directory.name, second.directory.name, looked_through)
    assert walkers.compare(first, second).text == by_name.text
    assert walkers.run(first) == first
    with pytest.raises(InputError, match=r"grid: is a sweep"):
        walkers.compare(first, walkers.load("grid", looked_through))


def test_compare_refuses_sweeps_in_the_words_of_its_command(looked_through: Path) -> None:
    done = call("compare", "grid", "rough", "--out", str(looked_through))
    assert done.returncode == 2
    assert "grid: is a sweep's directory: walkers list" in done.stderr
    assert "walkers.load" not in done.stderr


def test_compare_refuses_sweeps_in_the_words_of_python(looked_through: Path) -> None:
    with pytest.raises(InputError, match=r"grid: is a sweep.s directory: walkers\.load"):
        walkers.compare("grid", "rough", looked_through)


def test_an_option_for_folders_is_not_for_a_sweep(looked_through: Path) -> None:
    done = call("list", "grid", "--all", "--out", str(looked_through))
    assert done.stderr == "walkers: --all: is for folders, not for a sweep\n"


def test_the_package_exports_its_public_names_alone() -> None:
    """Classes come first, and functions after them."""
    assert dir(walkers) == walkers.__all__
    assert walkers.__all__ == sorted(walkers.__all__, key=lambda name: (name.islower(), name))


@pytest.mark.parametrize("name", walkers.__all__)
def test_public_names_are_documented(name: str) -> None:
    assert getattr(walkers, name).__doc__
