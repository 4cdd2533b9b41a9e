"""A user's own points in the figure of a sweep, and its width, texts and title."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure

import walkers
from tests.conftest import TINY, FillOnce, call, document, to_toml
from walkers.arrays import FloatArray
from walkers.errors import InputError
from walkers.inputs.units import unit_factor
from walkers.sweeps.left_out import LeftOutWarning

MEASURED = """\
peak_acceleration (g),velocity (mm/s),velocity error (mm/s)
3.5,0.4,0.05
8,0.9,0.1
"""
MM_PER_INCH = 25.4


@pytest.fixture(scope="module")
def made_sweep(once: FillOnce) -> Path:
    """A folder with a sweep of two accelerations, and one of two liquids."""

    def fill(folder: Path) -> None:
        (folder / "base.toml").write_text(to_toml(document(run=TINY)))
        axes: dict[str, dict[str, Any]] = {
            "fast": {"drive.peak_acceleration": ["3 g", "6 g"]},
            "liquids": {"liquid.name": ["Si AK5", "Si AK10"]},
            "panels": {
                "drive.peak_acceleration": ["3 g", "6 g"],
                "drive.frequency": ["80 Hz", "90 Hz"],
            },
        }
        for name, values in axes.items():
            file = folder / f"{name}.toml"
            file.write_text(to_toml({"case": str(folder / "base.toml"), "axes": values}))
            walkers.sweep(file, folder / "runs")

    return once("sweep-for-own-points", fill)


@pytest.fixture
def fast(made_sweep: Path) -> walkers.Sweep:
    return walkers.Sweep(made_sweep / "runs" / "fast")


def write(folder: Path, text: str, name: str = "measured.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def drawn_points(panel: Axes) -> list[ErrorbarContainer]:
    """The series of a panel that have white symbols: the user's own points."""
    series = []
    for container in panel.containers:
        if isinstance(container, ErrorbarContainer):
            line = container.lines[0]
            if line is not None and line.get_markerfacecolor() == "white":
                series.append(container)
    return series


def places_of(series: ErrorbarContainer) -> tuple[FloatArray, FloatArray]:
    """The x and the y of points."""
    line = series.lines[0]
    assert line is not None
    return np.array(line.get_xdata()), np.array(line.get_ydata())


def half_bars(series: ErrorbarContainer) -> list[tuple[int, FloatArray]]:
    """Half lengths of the error bars along x (0) and y (1)."""
    bars = []
    for collection in series.lines[2]:
        segments = np.array(collection.get_segments())
        lengths = (segments[:, 1] - segments[:, 0]) / 2.0
        axis = int(np.abs(lengths).sum(axis=0).argmax())
        bars.append((axis, lengths[:, axis]))
    return bars


def legend_texts(figure: Figure) -> list[str]:
    texts = []
    for legend in figure.legends:
        texts += [text.get_text() for text in legend.get_texts()]
    return texts


def refused(sweep: walkers.Sweep, path: Path | str) -> str:
    """The message with which a file is refused."""
    with pytest.raises(InputError) as refusal:
        sweep.figure(data_files=path)
    return str(refusal.value)


# --- points -----------------------------------------------------------------------------------


def test_points_have_the_places_and_errors_of_the_file(fast: walkers.Sweep, tmp_path: Path) -> None:
    figure = fast.figure(data_files=write(tmp_path, MEASURED))
    (series,) = drawn_points(figure.axes[0])
    x, y = places_of(series)
    assert x.tolist() == [3.5, 8.0]
    assert y.tolist() == [0.4, 0.9]
    ((axis, lengths),) = half_bars(series)
    assert axis == 1
    assert lengths == pytest.approx([0.05, 0.1])


def test_units_of_the_file_become_those_of_the_axes(fast: walkers.Sweep, tmp_path: Path) -> None:
    """19.6 m/s² are 2 g, 0.98 m/s² are 0.1 g; 500 µm/s are 0.5 mm/s. Errors along both axes."""
    text = (
        "# a logger\n"
        "Velocity [um/s];peak acceleration [m/s2];peak acceleration error;velocity error (m/s)\n"
        "500;19,6;0,98;1e-4\n"
    )
    figure = fast.figure(data_files=write(tmp_path, text))
    (series,) = drawn_points(figure.axes[0])
    x, y = places_of(series)
    assert x == pytest.approx([2.0])
    assert y == pytest.approx([0.5])
    lengths = dict(half_bars(series))
    assert lengths[0] == pytest.approx([0.1])
    assert lengths[1] == pytest.approx([0.1])


def test_axes_may_be_called_x_and_y(fast: walkers.Sweep, tmp_path: Path) -> None:
    figure = fast.figure(data_files=write(tmp_path, "x (g),y (mm/s)\n4,0.5\n"))
    (series,) = drawn_points(figure.axes[0])
    assert places_of(series)[0].tolist() == [4.0]
    assert half_bars(series) == []


def test_a_point_without_an_error_has_no_bar(fast: walkers.Sweep, tmp_path: Path) -> None:
    text = "x (g),y (mm/s),y error (mm/s)\n4,0.5,0.1\n5,0.6,\n"
    figure = fast.figure(data_files=write(tmp_path, text))
    (series,) = drawn_points(figure.axes[0])
    (collection,) = series.lines[2]
    assert [len(segment) for segment in collection.get_segments()] == [2, 0]


def test_the_range_of_the_figure_contains_the_points(fast: walkers.Sweep, tmp_path: Path) -> None:
    text = "x (g),y (mm/s),y error (mm/s)\n20,50,5\n"
    (panel,) = fast.figure(data_files=write(tmp_path, text)).axes
    assert panel.get_ylim()[1] > 55.0
    assert panel.get_xlim()[1] > 20.0
    assert panel.get_xticks().max() >= 20.0, "not the accelerations of the sweep alone"


def test_the_legend_has_the_labels_of_files_beside_the_simulation(
    fast: walkers.Sweep, tmp_path: Path
) -> None:
    path = write(tmp_path, MEASURED, "lab-2026.csv")
    figure = fast.figure(data_files=[path, f"f = 80 Hz={path}"])
    assert legend_texts(figure) == ["engine", "lab-2026", "f = 80 Hz"]


def test_a_file_whose_name_has_an_equals_sign_is_found(fast: walkers.Sweep, tmp_path: Path) -> None:
    figure = fast.figure(data_files=write(tmp_path, MEASURED, "f=80.csv"))
    assert legend_texts(figure) == ["engine", "f=80"]


def test_points_of_categories_stand_at_them(made_sweep: Path, tmp_path: Path) -> None:
    sweep = walkers.Sweep(made_sweep / "runs" / "liquids")
    text = "liquid,velocity (mm/s)\nSi AK10,0.2\n"
    figure = sweep.figure(data_files=write(tmp_path, text))
    (series,) = drawn_points(figure.axes[0])
    assert places_of(series)[0].tolist() == [1.0]
    wrong = write(tmp_path, text.replace("AK10", "AK100"))
    assert 'row 1: column "liquid" is "Si AK100"; expected one of' in refused(sweep, wrong)


def test_points_are_in_each_panel_and_a_warning_says_so(made_sweep: Path, tmp_path: Path) -> None:
    sweep = walkers.Sweep(made_sweep / "runs" / "panels")
    path = write(tmp_path, MEASURED)
    with pytest.warns(LeftOutWarning, match="in each of the 2 panels"):
        figure = sweep.figure(
            x="drive.peak_acceleration", panels="drive.frequency", data_files=path
        )
    assert [len(drawn_points(panel)) for panel in figure.axes] == [1, 1]


def test_columns_that_are_not_drawn_are_named(fast: walkers.Sweep, tmp_path: Path) -> None:
    """Such as a misspelt error."""
    text = MEASURED.replace("velocity error", "velocity eror")
    with pytest.warns(LeftOutWarning, match=r'not drawn: "velocity eror \(mm/s\)"'):
        fast.figure(data_files=write(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(
            "speed (mm/s),x (g)\n1,2\n",
            'expected a header with "peak_acceleration (g)", and "velocity (mm/s)"; '
            'it has "speed (mm/s)", "x (g)"',
            id="name",
        ),
        pytest.param(
            "x (mm),y (mm/s)\n1,2\n", 'column "x (mm)": expected g, or a unit of', id="unit"
        ),
        pytest.param(
            "x,y (mm/s)\n1,2\n", 'column "x": expected its unit in brackets', id="no unit"
        ),
        pytest.param(
            "x (g),y (mm/s)\n1,2\n1,two\n",
            'row 2: column "y (mm/s)" is "two"; expected a number',
            id="word",
        ),
        pytest.param("x (g),y (mm/s)\n1,2,3\n", "decimal commas?", id="too many values"),
        pytest.param(
            "x (g),y (mm/s),y error (mm/s)\n1,2,-3\n", "expected errors of zero or more", id="sign"
        ),
        pytest.param("x (g),y (mm/s)\n", "expected a header, such as", id="no rows"),
    ],
)
def test_a_file_that_cannot_be_drawn_is_refused_with_the_reason(
    fast: walkers.Sweep, tmp_path: Path, text: str, message: str
) -> None:
    path = write(tmp_path, text)
    assert f"{path}: " in refused(fast, path)
    assert message in refused(fast, path)


def test_a_file_that_does_not_exist_is_refused(fast: walkers.Sweep, made_sweep: Path) -> None:
    done = call("plot", "fast", "--data", "none.csv", folder=made_sweep)
    assert done.returncode == 2
    assert done.stderr == "walkers: none.csv: cannot be read: No such file or directory\n"


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("m/s2", "g", 1.0 / 9.8),
        ("°", "deg", 1.0),
        ("%", "", 0.01),
        ("µJ", "nJ", 1e3),
        ("g", "kg", 1e-3),
    ],
)
def test_units_are_converted(unit: str, target: str, factor: float) -> None:
    assert unit_factor(unit, target) == pytest.approx(factor, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "target"),
    [("mm", "Hz"), ("rad/s", "Hz"), ("", "mm"), ("rad", ""), ("degC", "K"), ("foo", "mm")],
)
def test_units_of_another_kind_are_refused(unit: str, target: str) -> None:
    with pytest.raises(ValueError, match=f"expected {target or 'no unit'}"):
        unit_factor(unit, target)


# --- format -----------------------------------------------------------------------------------


@pytest.mark.parametrize("width", ["85mm", "17 cm", "3.4 in"])
def test_a_figure_has_the_width_that_is_asked_for(fast: walkers.Sweep, width: str) -> None:
    figure = fast.figure(width=width)
    expected = {"85mm": 85.0, "17 cm": 170.0, "3.4 in": 86.36}[width]
    assert figure.get_figwidth() * MM_PER_INCH == pytest.approx(expected)


def test_axes_of_a_narrow_figure_keep_their_proportions(
    fast: walkers.Sweep, tmp_path: Path
) -> None:
    """However many lines the legend has below them."""
    path = write(tmp_path, MEASURED)
    figure = fast.figure(width="85mm", data_files=[f"laboratory {n}={path}" for n in range(6)])
    figure.draw_without_rendering()
    box = figure.axes[0].get_window_extent()
    assert box.height / box.width == pytest.approx(0.62, abs=0.03)


def test_nothing_reaches_beyond_the_edges_of_a_narrow_figure(fast: walkers.Sweep) -> None:
    figure = fast.figure(width="85mm", font_size=8.0)
    figure.draw_without_rendering()
    tight = figure.get_tightbbox()
    assert tight.x0 >= -0.01
    assert tight.x1 <= figure.get_figwidth() + 0.01


def test_all_texts_have_the_size_that_is_asked_for(fast: walkers.Sweep, tmp_path: Path) -> None:
    figure = fast.figure(font_size=9.5, data_files=write(tmp_path, MEASURED))
    figure.draw_without_rendering()
    (panel,) = figure.axes
    texts = [panel.xaxis.label, panel.yaxis.label, *panel.get_xticklabels()]
    texts += [*panel.get_yticklabels(), *figure.legends[0].get_texts()]
    assert {text.get_fontsize() for text in texts} == {9.5}


@pytest.mark.parametrize(("title", "shown"), [("none", ""), ("My $x$", r"My \$x\$")])
def test_a_title_is_left_out_or_replaced(fast: walkers.Sweep, title: str, shown: str) -> None:
    assert fast.figure(title=title).get_suptitle() == shown


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--width", "85", '--width: "85": expected a width of 30mm to 500mm, such as 85mm'),
        ("--width", "2m", '--width: "2m": expected a width of 30mm to 500mm, such as 85mm'),
        ("--font-size", "99", "--font-size: 99: expected 4 to 24"),
    ],
)
def test_a_size_beyond_its_limits_is_refused(
    option: str, value: str, message: str, made_sweep: Path
) -> None:
    done = call("plot", "fast", option, value, folder=made_sweep)
    assert done.returncode == 2
    assert done.stderr == f"walkers: {message}\n"


@pytest.mark.parametrize("option", ["--data", "--width", "--font-size", "--title"])
def test_options_of_sweeps_are_refused_for_a_run(
    option: str, fast: walkers.Sweep, made_sweep: Path
) -> None:
    run = str(fast.runs[0].directory)
    done = call("plot", run, option, "9", folder=made_sweep)
    assert done.returncode == 2
    assert done.stderr == f"walkers: {option}: is for sweeps\n"


def test_python_draws_the_figure_of_the_command(
    fast: walkers.Sweep, made_sweep: Path, tmp_path: Path
) -> None:
    """Also outside of the style of the project: with matplotlib's own sizes and fonts."""
    path = write(tmp_path, MEASURED)
    options = ["--width", "85mm", "--font-size", "9", "--title", "none"]
    of_command = tmp_path / "command.png"
    call(
        "plot", "fast", "--data", str(path), *options, "--to", str(of_command),
        folder=made_sweep, check=True,
    )  # fmt: skip
    figure = fast.figure(data_files=path, width="85mm", font_size=9.0, title="none")
    of_python = tmp_path / "python.png"
    figure.savefig(of_python)
    from matplotlib.image import imread

    np.testing.assert_array_equal(imread(of_python), imread(of_command))


def test_a_figure_without_these_options_is_as_before(fast: walkers.Sweep) -> None:
    figure = fast.figure()
    assert figure.get_size_inches().tolist() == [7.0, 4.2]
    assert figure.legends == []
