"""Calls from Python: errors in sentences, public names, warnings, and what objects print."""

from __future__ import annotations

import inspect
import re
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import walkers
from tests.conftest import SHORT, call, document, to_toml
from walkers import Run, Sweep, load_case
from walkers.cache import make_cache_folder
from walkers.commands import ALL_COMMANDS, Command
from walkers.inputs.sweep import load_sweep
from walkers.postprocess.measure.motion import Group, Motion
from walkers.runner import failures
from walkers.sweeps.spread import Spread
from walkers.sweeps.workers import Failure
from walkers.warning import warn_user

Call = Callable[[Run, Sweep], object]
WRONG: dict[str, tuple[Call, str]] = {
    "a time limit as text": (
        lambda run, _: walkers.run("fig1b", run.directory.parent, time_limit="5"),  # type: ignore[arg-type]
        'time_limit: "5": expected a number',
    ),
    "a negative time limit": (
        lambda run, _: walkers.run("fig1b", run.directory.parent, time_limit=-1),
        "time_limit: -1: expected 0 or more",
    ),
    "a case that is a number": (
        lambda _, __: walkers.run(5),  # type: ignore[arg-type]
        "case: 5: expected a case, its file, name or tables, or a run",
    ),
    "a folder that is a number": (
        lambda _, __: walkers.load("fig1b", 5),  # type: ignore[arg-type]
        "out: 5: expected a path",
    ),
    "changes in a list": (
        lambda _, __: load_case("fig1b", ["drive.frequency=70 Hz"]),  # type: ignore[arg-type]
        "changes: .*expected values by dotted keys",
    ),
    "an engine that is a number": (
        lambda run, _: walkers.run(
            "fig1b",
            run.directory.parent,
            engine=5,  # type: ignore[arg-type]
        ),
        "engine: 5: expected the name or path of a liggghts binary",
    ),
    "half a walker in a film": (
        lambda run, _: run.film(walker=1.5),  # type: ignore[arg-type]
        r"walker: 1\.5: expected a whole number",
    ),
    "a size that is a number": (
        lambda run, _: run.film(size=3),  # type: ignore[arg-type]
        "size: 3: expected width and height",
    ),
    "frames as text": (
        lambda run, _: run.film(fps="25"),  # type: ignore[arg-type]
        'fps: "25": expected a number',
    ),
    "a begin as text": (
        lambda run, _: run.film(begin="0.1 s"),  # type: ignore[arg-type]
        'begin: "0.1 s": expected a number',
    ),
    "half a picture": (
        lambda run, _: run.render(images=2.5),  # type: ignore[arg-type]
        r"images: 2\.5: expected a whole number",
    ),
    "true as a number of pictures": (
        lambda run, _: run.render(images=True),
        "images: true: expected a whole number",
    ),
    "an unknown format": (
        lambda run, _: run.plot(formats="bmp"),
        "formats: 'bmp': expected one of png",
    ),
    "a format that is a number": (
        lambda run, _: run.plot(formats=3),  # type: ignore[arg-type]
        "formats: 3: expected one of png",
    ),
    "a report in a number": (
        lambda run, _: run.report(5),  # type: ignore[arg-type]
        "to: 5: expected a path",
    ),
    "samples as text": (
        lambda run, _: run.export("vtk", every="5"),  # type: ignore[arg-type]
        'every: "5": expected a whole number',
    ),
    "an option of another form": (
        lambda run, _: run.export("vtk", dumps=False),
        "dumps: is for the form archive",
    ),
    "draws below zero": (
        lambda _, __: walkers.sweep("fig4", spread=-1),
        "spread: -1: expected 2 to 4096",
    ),
    "no jobs": (lambda _, __: walkers.sweep("fig4", jobs=0), "jobs: 0: expected 1 or more"),
    "a sweep that is a number": (
        lambda _, __: walkers.sweep(5),  # type: ignore[arg-type]
        "sweep: 5: expected a sweep: its file, name or tables",
    ),
    "an axis that is a number": (
        lambda _, sweep: sweep.figure(x=3),  # type: ignore[arg-type]
        "x: 3: expected the name of a key or a column",
    ),
    "a width that is a number": (
        lambda _, sweep: sweep.figure(width=85),  # type: ignore[arg-type]
        "width: 85: expected a width, such as 85mm",
    ),
    "points of your own in a number": (
        lambda _, sweep: sweep.figure(data_files=5),  # type: ignore[arg-type]
        "data_files: 5: expected a file, or LABEL=FILE",
    ),
    "one name for several": (
        lambda _, __: walkers.climb("pile-starts"),
        r'expected a list of names, such as \["pile-starts"\]',
    ),
    "a time as text": (
        lambda _, __: walkers.climb(["pile-starts"], within="5"),  # type: ignore[arg-type]
        'within: "5": expected a number',
    ),
    "a comparison with nothing": (
        lambda _, __: walkers.compare("fig1b"),
        "expected a second run or case, or changes, such as changes=",
    ),
    "a calibration that is a number": (
        lambda _, __: walkers.calibrate(5),  # type: ignore[arg-type]
        "calibration: 5: expected a calibration",
    ),
    "a new case that is a number": (
        lambda _, __: walkers.new(5),  # type: ignore[arg-type]
        "path: 5: expected a path",
    ),
}
"""Calls that are refused, and the beginnings of the sentences."""


@pytest.fixture
def sweep(looked_through: Path) -> Sweep:
    """A finished sweep."""
    return Sweep(looked_through / "grid")


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_is_refused_in_a_sentence_of_python(
    name: str, sweep: Sweep, in_folder: Path
) -> None:
    wrong_call, sentence = WRONG[name]
    with pytest.raises(walkers.InputError, match=sentence) as caught:
        wrong_call(sweep.runs[0], sweep)
    assert "--" not in str(caught.value)
    assert list(in_folder.iterdir()) == []


def test_numbers_of_numpy_are_numbers(sweep: Sweep, tmp_path: Path) -> None:
    place = tmp_path / "one.png"
    assert sweep.runs[0].render(place, images=np.int64(1), walker=np.int64(0)) == [place]


def test_a_report_makes_its_folder_as_a_film_does(sweep: Sweep, tmp_path: Path) -> None:
    for maker in (sweep.runs[0], sweep):
        place = tmp_path / type(maker).__name__ / "of" / "report.html"
        assert maker.report(place) == place
        assert place.is_file()


def test_a_report_in_the_place_of_a_file_is_refused(sweep: Sweep, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(walkers.InputError, match="cannot create the folder"):
        sweep.runs[0].report(tmp_path / "file" / "report.html")


# --- advice ---------------------------------------------------------------------------------------

HINT = re.compile(r"first do: (.*)$")


@pytest.mark.parametrize("given", ["name", "case", "tables"])
def test_the_call_that_load_advises_names_the_changed_case(given: str, in_folder: Path) -> None:
    """The call of the advice means the case that was looked for."""
    changes = {"drive.frequency": "70 Hz", "dimers.radii": ["0.4 mm", "0.2 mm"]}
    case = load_case("fig1b")
    references: dict[str, Any] = {"name": "fig1b", "case": case, "tables": case.document}
    with pytest.raises(walkers.InputError, match="no finished run in runs; first do") as caught:
        walkers.load(references[given], changes=changes)
    hint = HINT.search(str(caught.value))
    assert hint is not None
    assert hint[1].startswith("walkers.run(")
    variables = {"walkers": walkers, "case": references[given]}
    advised = eval(hint[1].replace("walkers.run(", "("), variables)
    assert advised == load_case(references[given], changes)
    assert advised.dimers.radii == (0.4e-3, 0.2e-3)


def test_the_call_that_load_advises_for_a_changed_run_names_its_case(sweep: Sweep) -> None:
    run = sweep.runs[0]
    changes = {"drive.frequency": "71 Hz"}
    with pytest.raises(walkers.InputError, match="no finished run in ") as caught:
        walkers.load(run.directory, changes=changes)
    hint = HINT.search(str(caught.value))
    assert hint is not None
    case, folder = eval(hint[1].replace("walkers.run(", "("), {"walkers": walkers})
    assert case == load_case(run.case, changes)
    assert Path(folder) == run.directory.parent


def test_a_resolved_case_is_changed_under_its_name() -> None:
    case = load_case("fig1b")
    assert load_case(case, {"drive.frequency": "70 Hz"}).name == "fig1b"
    assert load_case(case) == case


def test_what_is_no_case_is_not_loaded() -> None:
    with pytest.raises(walkers.InputError, match="case: 5: expected a case, its file"):
        load_case(5)  # type: ignore[arg-type]


def test_the_call_that_load_advises_has_the_folder(in_folder: Path) -> None:
    with pytest.raises(walkers.InputError, match=r'walkers\.run\("fig1b", "elsewhere"\)'):
        walkers.load("fig1b", "elsewhere")


def test_the_program_advises_a_command(in_folder: Path) -> None:
    change = "contact.friction.bead_bead={ at_rest = 0.1, rise = 0.0 }"
    done = call("plot", "fig1b", "--set", "drive.frequency=70 Hz")
    assert done.stderr.endswith("walkers run fig1b --set 'drive.frequency=70 Hz'\n")
    done = call("plot", "fig1b", "--set", f'{change[:-2]}, half_rise_velocity = "1 m/s" }}')
    assert f"--set '{change[:-2]}, half_rise_velocity = \"1 m/s\" }}'" in done.stderr


def test_an_unfinished_run_advises_in_the_words_of_its_user(
    looked_through: Path, tmp_path: Path
) -> None:
    finished = Sweep(looked_through / "grid").runs[0].directory
    unfinished = tmp_path / f"{finished.name}.incomplete"
    shutil.copytree(finished, unfinished)
    (unfinished / "manifest.json").unlink()
    place = tmp_path / finished.name
    with pytest.raises(walkers.InputError, match=r'continue it with: walkers\.run\("'):
        walkers.Run(place).result.keys()
    done = call("plot", str(place))
    assert f"continue it with: walkers run {place}\n" in done.stderr


# --- public names ---------------------------------------------------------------------------------


def test_every_failure_of_a_run_has_a_public_name() -> None:
    kinds = [
        name
        for name, kind in vars(failures).items()
        if inspect.isclass(kind) and issubclass(kind, (failures.EngineFailure, Warning))
    ]
    assert len(kinds) > 20
    assert set(kinds) <= set(walkers.__all__)


def test_public_errors_derive_from_one_root() -> None:
    for name in walkers.__all__:
        value = getattr(walkers, name)
        if inspect.isclass(value) and issubclass(value, Exception):
            assert issubclass(value, (walkers.WalkersError, Warning))


def test_every_public_name_is_in_the_reference() -> None:
    page = Path(__file__).parents[1] / "docs" / "reference" / "python.rst"
    documented = set(re.findall(r"^\.\. auto\w+:: walkers\.(\w+)$", page.read_text(), re.MULTILINE))
    assert documented == set(walkers.__all__)


CALLS = {
    "new": "walkers.new(",
    "show": "case.origins",
    "run": "walkers.run(",
    "sweep": "walkers.sweep(",
    "log": "run.log()",
    "plot": "run.plot()",
    "render": "run.render()",
    "report": "run.report()",
    "compare": "walkers.compare(",
    "climb": "walkers.climb(",
    "export": "run.export(",
    "calibrate": "walkers.calibrate(",
}
"""Calls in the table of the reference that do what a command does."""


@pytest.mark.parametrize("command", ALL_COMMANDS, ids=lambda command: command.name)
def test_the_reference_has_a_call_for_each_command(command: Command) -> None:
    """Or says that there is none."""
    page = (Path(__file__).parents[1] / "docs" / "reference" / "python.rst").read_text()
    table, _, rest = page.partition("Only the program ")
    without_call, _, _ = rest.partition("\nFunctions\n")
    if command.name in CALLS:
        assert CALLS[command.name] in table
    else:
        assert f"``walkers {command.name}``" in without_call


def test_a_number_that_a_result_lacks_is_refused_with_a_suggestion(
    run_directory: Callable[..., Path],
) -> None:
    result = walkers.load(run_directory(run=SHORT)).result
    with pytest.raises(KeyError, match='no number velocty; did you mean "velocity"'):
        result["velocty"]
    assert result.get("velocty") is None
    assert "velocty" not in result


def test_every_attribute_of_a_result_is_described(run_directory: Callable[..., Path]) -> None:
    result = walkers.load(run_directory(run=SHORT)).result
    assert result.__doc__
    for name in vars(result):
        assert re.search(rf"^ +{name} :", result.__doc__, re.MULTILINE), name
    for name in result.about:
        assert f"``{name}``" in result.__doc__, name


@pytest.mark.parametrize("kind", [Run, Sweep, Motion, Group, Spread, Failure])
def test_every_attribute_is_described(kind: type) -> None:
    """By a line of the class, or by a docstring of its own."""
    public = [name for name in dir(kind) if not name.startswith("_")]
    public += [name for name in kind.__annotations__ if not name.startswith("_")]
    assert kind.__doc__
    for name in public:
        own = inspect.getdoc(inspect.getattr_static(kind, name, None))
        in_class = re.search(rf"^ +(\w+, )*{name}(, \w+)*( :|$)", kind.__doc__, re.MULTILINE)
        is_plain = name in kind.__annotations__
        assert in_class if is_plain else own, name


@pytest.mark.parametrize("function", [walkers.run, walkers.sweep])
def test_help_explains_each_argument(function: Callable[..., object]) -> None:
    text = inspect.getdoc(function)
    assert text is not None
    for name in inspect.signature(function).parameters:
        assert re.search(rf"^{name} : \w", text, re.MULTILINE), name


# --- warnings and texts ---------------------------------------------------------------------------


def test_a_warning_names_the_line_that_called_the_package() -> None:
    """Through other functions of the package."""

    def deep_within() -> None:
        warn_user("something is odd")

    scope = {"deep_within": deep_within}
    package = Path(walkers.__file__).parent / "inner.py"
    exec(compile("def inner():\n    deep_within()\n", str(package), "exec"), scope)
    with pytest.warns(UserWarning, match="something is odd") as caught:
        scope["inner"]()  # type: ignore[operator]
    assert caught[0].filename == __file__


def test_warnings_of_a_sweep_name_the_line_of_the_user(tmp_path: Path) -> None:
    """A second sweep of the same name replaces the first."""
    tables = document(run=SHORT, dimers={"replicates": 2})
    (tmp_path / "s.toml").write_text('case = "c.toml"\n[set]\ndrive.frequency = "80 Hz"\n')
    (tmp_path / "c.toml").write_text(to_toml(tables))
    walkers.sweep(tmp_path / "s.toml", tmp_path / "runs")
    (tmp_path / "s.toml").write_text('case = "c.toml"\n[set]\ndrive.frequency = "70 Hz"\n')
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", walkers.SweepReplacedWarning)
        walkers.sweep(tmp_path / "s.toml", tmp_path / "runs")
    (warning,) = [item for item in caught if item.category is walkers.SweepReplacedWarning]
    assert warning.filename == __file__


def test_sweeps_of_different_tables_have_different_names() -> None:
    def named(*frequencies: str) -> str:
        return load_sweep({"case": "fig1b", "axes": {"drive.frequency": [*frequencies]}}).name

    assert named("60 Hz", "80 Hz") == named("60 Hz", "80 Hz")
    assert len({named("60 Hz"), named("70 Hz"), named("60 Hz", "70 Hz")}) == 3


def test_a_printed_comparison_is_its_table() -> None:
    comparison = walkers.compare("fig1b", changes={"drive.frequency": "70 Hz"})
    assert str(comparison) == comparison.text
    assert "drive.frequency" in comparison._repr_html_()


def test_a_link_to_nothing_in_the_cache_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    cache = make_cache_folder()
    (cache / "audits").symlink_to(tmp_path / "gone")
    with pytest.raises(OSError, match=r"audits is a link to .*gone, which does not exist"):
        make_cache_folder("audits")
    assert (cache / "audits").is_symlink()  # the disk of the user may come back
