"""The wheel, the sdist, and the extras: what is installed, and what works with the mandatory packages alone."""

import ast
import importlib
import os
import re
import shlex
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
from typing import Any

import grimp
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import walkers
from tests.conftest import SHORT, document, to_toml
from walkers.calibration.calibrate import calibrate
from walkers.calibration.file import load_calibration
from walkers.extras import EXTRAS, ExtraMissing, module_of
from walkers.paper.make import make_figures
from walkers.sweeps.scheduler import Options
from walkers.sweeps.site import load_site
from walkers.theory.prediction import predict

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OPTIONAL: dict[str, list[str]] = PROJECT["optional-dependencies"]
FOR_USERS = {extra: OPTIONAL[extra] for extra in OPTIONAL if extra not in {"all", "docs", "dev"}}
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
            left += [it for it in further if it.marker is None or it.marker.evaluate({"extra": extra})]
    return {name for name, _ in seen} - {OURS}


def python(*arguments: str, folder: Path, **environment: str) -> str:
    """What Python prints; the project in the folder is built by it."""
    how: dict[str, Any] = {"cwd": folder, "env": os.environ | environment, "capture_output": True, "text": True}
    done = subprocess.run([sys.executable, *arguments], check=False, **how)
    assert done.returncode == 0, done.stderr
    return str(done.stdout)


@pytest.fixture(scope="module")
def wheel(once: Callable[[str, Callable[[Path], object]], Path]) -> Path:
    """Folder with ``tree/*.whl``, built from the checkout, and ``sdist/*.whl``, from the source distribution."""

    def build(folder: Path) -> None:
        source = folder / "source"
        shutil.copytree(ROOT / "walkers", source / "walkers", ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / name, source)
        pip = ("-m", "pip", "wheel", "--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir")
        sdist = "import setuptools.build_meta as build; print(build.build_sdist('..'))"
        version = "SETUPTOOLS_SCM_PRETEND_VERSION"
        name = python("-c", sdist, folder=source, **{version: VERSION}).splitlines()[-1]
        for kind, given in (("tree", source), ("sdist", folder / name)):
            python(*pip, str(folder / kind), str(given), folder=folder, **{version: VERSION * (kind == "tree")})

    return once("wheels", build)


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scripts' folder of an environment that holds the wheel and its mandatory packages, and nothing else."""
    place = tmp_path_factory.mktemp("bare")
    venv.create(place, with_pip=False, symlinks=True)
    (site,) = place.glob("lib/python*/site-packages")
    for name in closure(PROJECT["dependencies"]):
        one = metadata.distribution(name)
        for part in {file.parts[0] for file in one.files or () if file.parts[0] not in {"..", "__pycache__"}}:
            if not (site / part).exists():
                (site / part).symlink_to(Path(str(one.locate_file(part))).resolve())
    pip = ("-m", "pip", "--python", str(place / "bin" / "python"), "install", "--quiet", "--no-deps", "--no-index")
    python(*pip, str(next(wheel.glob("sdist/*.whl"))), folder=place)
    return place / "bin"


def test_wheels_of_checkout_and_sdist_hold_all_files_of_the_package(wheel: Path) -> None:
    held = {}
    for path in wheel.glob("*/*.whl"):
        with zipfile.ZipFile(path) as packed:
            names = (name for name in packed.namelist() if name.startswith("walkers/"))
            held[path.parent.name] = {name: packed.getinfo(name).CRC for name in names}
    assert held["tree"] == held["sdist"]
    files = [path.relative_to(ROOT) for path in (ROOT / "walkers").rglob("*") if path.is_file()]
    ours = {path.as_posix() for path in files if "__pycache__" not in path.parts and path.name[0] != "."}
    assert held["tree"].keys() == ours


def test_mandatory_packages_run_tabulate_and_draw(bare: Path, in_folder: Path) -> None:
    def told(*command: str, status: int = 0) -> str:
        done = subprocess.run([bare / command[0], *command[1:]], check=False, capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        return done.stderr if status else done.stdout

    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT)))
    assert "0.1.1.dev7 (commit 0123abc)" in told("walkers", "--version")
    assert "velocity" in told("walkers", "run", "mine.toml")
    pictures = [*told("walkers", "plot", "mine.toml").split(), *told("walkers", "render", "mine.toml").split()]
    assert {"walk.png", "walker.png"} <= {Path(one).name for one in pictures if Path(one).is_file()}
    assert "needs k3d: make extras" in told("walkers", "report", "mine.toml", status=2)
    assert not list(in_folder.rglob("report.html"))


NEEDING: dict[str, list[Callable[[walkers.Run, Path], object]]] = {
    "archive": [lambda run, out: run.export("archive", out / "run.zip")],
    "calibrate": [lambda _, out: calibrate(load_calibration("ruby"), out, Options(1))],
    "check": [lambda *_: importlib.reload(importlib.import_module("walkers.check"))],
    "cluster": [lambda _, out: load_site(out / "site.toml")],
    "film": [lambda run, out: run.film(out / "film.mp4")],
    "report": [lambda run, out: run.report(out / "run.html"), lambda run, _: run.view()],
    "theory": [
        lambda *_: predict(walkers.load_case("fig1b")),
        lambda _, out: make_figures(out / "runs", out / "figures", Options(1)),
    ],
}


@pytest.mark.parametrize("extra", EXTRAS)
def test_what_needs_an_extra_names_it_before_it_begins(
    extra: str, run_directory: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = walkers.load(run_directory(run=SHORT))
    for package in EXTRAS[extra][1]:
        monkeypatch.setitem(sys.modules, module_of(package), None)
    message = rf"^{EXTRAS[extra][0]} needs [\w, -]+: make extras, or pip install '{OURS}\[{extra}\]'$"
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
    declared = names_of([*PROJECT["dependencies"], *(one for given in FOR_USERS.values() for one in given)])
    owners = metadata.packages_distributions()
    of_others = {"IPython", "paraview", "pydantic_core", "vtkmodules", "setuptools"}  # of a notebook, of pydantic, …
    used = set[str]()
    for path in (ROOT / "walkers").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            named = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            named += [node.module] if isinstance(node, ast.ImportFrom) and node.module and not node.level else []
            used |= {name.partition(".")[0] for name in named}
    used -= {*sys.stdlib_module_names, "walkers", *of_others}
    known = {canonicalize_name(name) for name in declared}
    assert not {name for name in used if not {canonicalize_name(one) for one in owners.get(name, ())} & known}
    assert known == {canonicalize_name(one) for name in used for one in owners[name]} & known, "declared and not used"


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Imports inside of functions count, those for types alone do not. The error names the circle."""
    graph = grimp.build_graph("walkers", exclude_type_checking_imports=True)
    TopologicalSorter({one: graph.find_modules_directly_imported_by(one) for one in graph.modules}).prepare()


def test_faults_to_plant_are_in_the_code_once_and_name_tests_that_are_there() -> None:
    """A fault whose text has gone is planted nowhere; one whose tests have gone is seen by none."""
    faults = tomllib.loads((ROOT / "tests" / "tools" / "faults.toml").read_text("utf-8"))["fault"]
    wrong = []
    for fault in faults:
        path = ROOT / fault["file"]
        times = path.read_text("utf-8").count(fault["old"]) if path.is_file() else 0
        wrong += [] if times == 1 and fault["old"] != fault["new"] else [f"{fault['name']}: {times} times"]
        for entry in fault["tests"]:
            file, *options = shlex.split(entry)
            text = (ROOT / file).read_text("utf-8") if (ROOT / file).is_file() else ""
            words = {*re.findall(r"\w+", " ".join(options).replace("-k", " "))} - {"or", "and", "not"}
            gone = sorted(word for word in words if word not in text)
            wrong += [f"{fault['name']}: {file} {' '.join(gone)}"] if gone or not text else []
    assert not wrong
    assert len(faults) == len({fault["name"] for fault in faults}) >= 127
