"""Figures, renderings, films, files for ParaView and other programs, read back."""

import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from importlib.resources import files
from math import sqrt
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import imageio_ffmpeg
import meshio
import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from PIL import Image
from scipy.interpolate import Akima1DInterpolator

import walkers
from tests.conftest import BRIEF, call, make_case
from tests.printed import letters, spoilt
from walkers.errors import InputError
from walkers.inputs.resolving.loads import bridge_at_rest
from walkers.inputs.tables.boundary import Boundary
from walkers.postprocess.measure.motion import Group, Motion, read_bridges, read_motion
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.camera import axes_toward, camera_axes, named_direction
from walkers.postprocess.show.figures import (
    MOST_NAMED,
    _interpolated,
    figures_of,
    line_styles,
    plot_run,
)
from walkers.postprocess.show.film_options import FilmOptions
from walkers.postprocess.show.films import film_times
from walkers.postprocess.show.meshes import mesh_of, walls_of
from walkers.postprocess.show.necks import (
    NO_BRIDGES,
    Ends,
    NeckGrid,
    bridge_ends,
    bridges_at,
    neck_surfaces,
)
from walkers.postprocess.show.paraview import _walls, write_vtk
from walkers.postprocess.show.scene import Scene, gathered
from walkers.postprocess.show.series import _series_figure
from walkers.postprocess.show.window import Window

# --- what is shown ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    """The run of two walkers for eight cycles."""
    return run_directory(
        dimers={"replicates": 2, "angle_spread": "1 deg"},
        run={
            "cycles": 8,
            "settling_cycles": 2,
            "samples_per_cycle": 20,
            "bridge_samples_per_cycle": 2,
        },
    )


@pytest.fixture(scope="module")
def motion(directory: Path) -> Motion:
    """The motion of both walkers."""
    return read_motion(directory).driven


@pytest.fixture(scope="module")
def single(motion: Motion) -> Motion:
    """The motion of the first walker."""
    return motion.of_walkers(motion.walkers[:1])


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    """The motion of both walkers, side by side, as it is exported."""
    return gathered(read_motion(directory)).groups[0]


# --- exports for ParaView ---------------------------------------------------------------------

FRAME = 13
"""A frame in which the substrate is away from the middle."""


@pytest.fixture(scope="module")
def collection(directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export of each frame, not in the run, which all workers share."""
    return write_vtk(directory, tmp_path_factory.mktemp("export") / "all", every=1)


@pytest.mark.parametrize(
    ("kind", "every"), [("beads", 1), ("boundary", 1), ("bridges", 10)], ids=str
)
def test_times_of_an_export_are_those_of_the_beads_and_floor_and_bridges(
    moved: Group, collection: Path, kind: str, every: int
) -> None:
    """In seconds. Beads have 20 samples a cycle, bridges two."""
    sets = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    seconds = [float(entry.attrib["timestep"]) for entry in sets if entry.get("name") == kind]
    np.testing.assert_allclose(seconds, moved.time[::every], atol=1e-15)


def test_beads_and_floor_are_where_the_engine_put_them(moved: Group, collection: Path) -> None:
    """In the laboratory's frame, in which the floor is displaced by the drive."""
    shift = moved.motion.substrate[FRAME]
    assert np.linalg.norm(shift) > 1e-5
    beads = pv.read(collection.parent / f"beads_{FRAME:06d}.vtu")
    expected = (moved.position[FRAME] + shift).reshape(-1, 3)
    np.testing.assert_allclose(beads.points, expected, rtol=1e-12)

    floor_at_start = pv.read(collection.parent / "boundary_000000.vtu")
    floor = pv.read(collection.parent / f"boundary_{FRAME:06d}.vtu")
    displacement = floor.points - floor_at_start.points
    np.testing.assert_allclose(displacement, np.tile(shift, (4, 1)), atol=1e-12)
    assert floor_at_start.bounds[4:] == pytest.approx([0.0, 0.0], abs=1e-15)


def test_beads_of_an_export_have_radii_velocities_and_spins(moved: Group, collection: Path) -> None:
    beads = pv.read(collection.parent / f"beads_{FRAME:06d}.vtu")
    velocity = moved.velocity[FRAME].reshape(-1, 3)
    arrays = {
        "bead": [0, 1, 2, 3],
        "walker": [0, 0, 1, 1],
        "large": [1, 0, 1, 0],
        "radius (m)": [3e-4, 2e-4, 3e-4, 2e-4],
        "velocity (m/s)": velocity,
        "speed (m/s)": np.linalg.norm(velocity, axis=1),
        "omega (rad/s)": moved.spin[FRAME].reshape(-1, 3),
    }
    assert set(beads.point_data) == {*arrays}
    for name, values in arrays.items():
        np.testing.assert_allclose(beads.point_data[name], values)


@dataclass(frozen=True)
class ExportedBridges:
    """The bridges of an export at the tenth frame, in the order of the table of bridges.

    Attributes
    ----------
    rows
        The table of bridges.
    cells
        Columns of the export, by name.
    ends
        Both ends of each line, m, shape (6, 2, 3).
    centres
        Centres of the beads, m.
    """

    rows: pd.DataFrame
    cells: dict[str, np.ndarray]
    ends: np.ndarray
    centres: np.ndarray


CONTACTS = [(0, -1), (1, -1), (0, 1), (2, -1), (3, -1), (2, 3)]
"""Beads of the contacts of two walkers in the order of the table of bridges; -1 is the wall."""


@pytest.fixture(scope="module")
def exported_bridges(directory: Path, moved: Group, collection: Path) -> ExportedBridges:
    table = read_table(directory, "bridges")
    mesh = meshio.read(collection.parent / "bridges_000010.vtu")
    columns = {name.partition(" ")[0]: values for name, (values,) in mesh.cell_data.items()}
    places = {}  # lines are not sorted, and their beads are in any order
    for place, beads in enumerate(zip(columns["bead_1"], columns["bead_2"], strict=True)):
        places[frozenset(beads)] = place
    order = np.array([places[frozenset(contact)] for contact in CONTACTS])
    return ExportedBridges(
        rows=table[np.isclose(table["time"], moved.time[10])],
        cells={name: values[order] for name, values in columns.items()},
        ends=mesh.points[mesh.cells_dict["line"]][order],
        centres=pv.read(collection.parent / "beads_000010.vtu").points,
    )


@pytest.mark.parametrize("name", ["gap", "normal_force", "walker", "wall"])
def test_bridges_are_lines_with_force_and_gap(exported_bridges: ExportedBridges, name: str) -> None:
    np.testing.assert_allclose(exported_bridges.cells[name], exported_bridges.rows[name])


def test_bridges_are_lines_that_tell_whether_surfaces_touch(
    exported_bridges: ExportedBridges,
) -> None:
    touching = exported_bridges.rows["gap"] <= 0.0
    np.testing.assert_array_equal(exported_bridges.cells["touching"], touching)


def test_bridges_are_lines_from_centres_of_beads_to_centres_or_the_wall(
    moved: Group, exported_bridges: ExportedBridges
) -> None:
    """A line is as long as the radii at its ends and the gap."""
    first_end = exported_bridges.ends[:, 0]
    second_end = exported_bridges.ends[:, 1]
    first_centres = exported_bridges.centres[exported_bridges.cells["bead_1"]]
    np.testing.assert_allclose(first_end, first_centres, atol=1e-12)
    heights_at_the_wall = second_end[[0, 1, 3, 4], 2]
    np.testing.assert_allclose(heights_at_the_wall, moved.motion.substrate[10, 2], atol=1e-12)
    length = np.linalg.norm(first_end - second_end, axis=1)
    radii = [3e-4, 2e-4, 5e-4, 3e-4, 2e-4, 5e-4]
    np.testing.assert_allclose(length - radii, exported_bridges.rows["gap"], atol=1e-10)


@pytest.fixture(scope="module")
def usual_collection(directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An export as users ask for it."""
    return walkers.load(directory).export("vtk", tmp_path_factory.mktemp("export") / "vtk")


def test_an_export_has_the_script_that_shows_it(usual_collection: Path) -> None:
    script = files("walkers.postprocess.show").joinpath("show.py.txt").read_bytes()
    assert usual_collection.with_name("show.py").read_bytes() == script


def test_walkers_are_exported_once_a_cycle(usual_collection: Path, moved: Group) -> None:
    """Eight cycles of 1/80 s, and the start; in them each walks as in the run."""
    np.testing.assert_allclose(pv.get_reader(usual_collection).time_values, np.arange(9) / 80.0)
    start = pv.read(usual_collection.parent / "beads_000000.vtu").points
    end = pv.read(usual_collection.parent / "beads_000160.vtu").points
    expected = (moved.position[160] - moved.position[0]).reshape(4, 3)
    np.testing.assert_allclose(end - start, expected, atol=1e-12)


def test_walkers_are_exported_side_by_side(usual_collection: Path, directory: Path) -> None:
    """In a row across the axis, wherever they stood."""
    start = pv.read(usual_collection.parent / "beads_000000.vtu").points
    assert np.ptp(start[:, 0]) < 1e-3
    assert np.ptp(start[:, 1]) < 4e-3
    assert np.ptp(read_motion(directory).position[0, ..., 1]) > 4e-3


def test_an_export_says_how_it_is_to_be_seen(usual_collection: Path) -> None:
    view = json.loads(ElementTree.parse(usual_collection).getroot().attrib["view"])
    assert view["colour"] == "walker"
    assert view["neck"] == pytest.approx(9e-5)


DATA_SET = '<DataSet timestep="0.0" part="0" file="{}" />'
"""An entry of a collection."""


@pytest.mark.parametrize(
    "files_of_others",
    [
        pytest.param({"turbine_0001.vtu": "x", "turbine.pvd": "x"}, id="files of VTK"),
        pytest.param({"beads_000000.vtu": "x", "show.py": "x"}, id="our names, no collection"),
        pytest.param(
            {"walkers.pvd": DATA_SET.format("turbine.vtu"), "turbine.vtu": "x"},
            id="a file in another collection",
        ),
        pytest.param(
            {
                "walkers.pvd": DATA_SET.format("beads_000000.vtu"),
                "beads_000000.vtu": "x",
                "beads_000001.vtu": "x",
            },
            id="a file that is not in the collection",
        ),
    ],
)
def test_an_export_replaces_no_files_of_others(
    directory: Path, tmp_path: Path, files_of_others: dict[str, str]
) -> None:
    for name, text in files_of_others.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match="expected a new or empty folder"):
        write_vtk(directory, tmp_path)
    remaining = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert remaining == files_of_others


def test_an_export_replaces_an_earlier_one(directory: Path, tmp_path: Path) -> None:
    """Of 161 frames, three and then two."""
    write_vtk(directory, tmp_path / "vtk", every=80)
    assert len(list((tmp_path / "vtk").glob("beads_*.vtu"))) == 3
    write_vtk(directory, tmp_path / "vtk", every=160)
    assert len(list((tmp_path / "vtk").glob("beads_*.vtu"))) == 2


def test_an_export_replaces_neither_a_file_nor_a_link(directory: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="it is a file"):
        write_vtk(directory, tmp_path / "file")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "folder")
    with pytest.raises(InputError, match="it is a symbolic link"):
        write_vtk(directory, tmp_path / "link")


@pytest.mark.slow
def test_pvpython_shows_spheres_bridges_and_floor(directory: Path, tmp_path: Path) -> None:
    """With ParaView and Xvfb, 1.4 GB, which ``make test-slow`` installs."""
    collection = walkers.load(directory).export("vtk", tmp_path / "vtk")
    # The script finds the files beside it, also when the folder has been moved.
    script = collection.parent.rename(tmp_path / "moved") / "show.py"
    picture = tmp_path / "walkers.png"
    command = ["xvfb-run", "-a", "pvpython", str(script), str(picture), "0.05"]
    for _ in range(3):  # under load it may not wait long enough for its screen
        if not picture.exists():
            subprocess.run(command, timeout=300, check=False, cwd=tmp_path)
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    red, _, blue = np.moveaxis(pixels, -1, 0)
    first_walker = (red > 1.5 * blue) & (red > 60)
    second_walker = (blue > 1.5 * red) & (blue > 60)
    assert 0.005 < first_walker.mean() < 0.5
    assert 0.005 < second_walker.mean() < 0.5
    floor = np.ptp(pixels - [199, 209, 217], axis=-1) < 12
    assert floor.mean() > 0.1
    time_in_the_corner = pixels[:60, :200].max(axis=-1) < 80
    assert time_in_the_corner.sum() > 50


# --- exports for other programs ---------------------------------------------------------------


@dataclass(frozen=True)
class LammpsFrame:
    """A frame of a dump of LAMMPS."""

    step: int
    count: int
    columns: list[str]
    rows: np.ndarray


def lammps_frames(path: Path) -> list[LammpsFrame]:
    """The frames of a dump of LAMMPS."""
    frames = []
    for text in path.read_text().split("ITEM: TIMESTEP\n")[1:]:
        step, count, _, atoms = text.split("ITEM: ")
        heading, *lines = atoms.splitlines()
        rows = np.array([line.split() for line in lines], dtype=float)
        frames.append(LammpsFrame(int(step), int(count.split()[-1]), heading.split()[1:], rows))
    return frames


def test_a_lammps_dump_holds_the_motion(directory: Path, motion: Motion, tmp_path: Path) -> None:
    """Each fourth frame, in mm, mm/s and rad/s."""
    path = walkers.load(directory).export("lammps", tmp_path / "here" / "walk.lammpstrj", every=4)
    frames = lammps_frames(path)
    expected = motion.select(slice(None, None, 4))
    assert len(frames) == len(expected.time)
    for number, frame in enumerate(frames):
        seconds = frame.step * motion.case.run.time_step
        assert seconds == pytest.approx(expected.time[number], abs=1e-12)
        position = 1e3 * expected.position[number]
        velocity = 1e3 * expected.velocity[number]
        vectors = np.hstack([position, velocity, expected.spin[number]])
        np.testing.assert_allclose(frame.rows[:, 4:], vectors, rtol=1e-9, atol=1e-12)


def test_a_lammps_dump_has_the_beads_and_walkers(directory: Path, tmp_path: Path) -> None:
    """Types are radii (mm), molecules are walkers."""
    path = walkers.load(directory).export("lammps", tmp_path / "walk.lammpstrj", every=160)
    for frame in lammps_frames(path):
        assert frame.count == 4
        columns = "id type mol radius x y z vx vy vz omegax omegay omegaz"
        assert frame.columns == columns.split()
        assert frame.rows[:, :4].tolist() == [
            [1, 1, 1, 0.3],
            [2, 2, 1, 0.2],
            [3, 1, 2, 0.3],
            [4, 2, 2, 0.2],
        ]


def test_equal_beads_are_of_type_1_of_a_lammps_dump(
    run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    """Type 2 is for small beads beside large ones."""
    directory = run_directory(dimers={"radii": ["0.25 mm", "0.25 mm"]}, run=BRIEF)
    path = walkers.load(directory).export("lammps", tmp_path / "walk.lammpstrj")
    for frame in lammps_frames(path):
        assert frame.columns[1] == "type"
        assert frame.rows[:, 1].tolist() == [1, 1]


# --- figures ----------------------------------------------------------------------------------


def test_figures_of_runs_come_in_other_formats(directory: Path, tmp_path: Path) -> None:
    """Each names its run; a PDF embeds TrueType fonts, for journals refuse Type 3."""
    paths = plot_run(directory, tmp_path, "pdf,svg")
    names = ["walk.pdf", "walk.svg", "gait.pdf", "gait.svg"]
    assert [path.name for path in paths] == names
    assert {*tmp_path.iterdir()} == {*paths}
    for path in paths:
        assert directory.name.encode() in path.read_bytes()
    pdf = paths[0].read_bytes()
    assert b"/FontFile2" in pdf
    assert b"/Type3" not in pdf


@pytest.mark.parametrize(("name", "panels"), [("walk", "abc"), ("gait", "")], ids=["walk", "gait"])
def test_figures_of_runs_can_be_printed(directory: Path, name: str, panels: str) -> None:
    """Nothing spoils them, and the panels have letters."""
    figure = figures_of(read_results(directory))[name]
    assert spoilt(figure) == []
    assert letters(figure) == [*panels]


def test_lines_of_a_figure_can_be_told_apart() -> None:
    styles = line_styles([str(number) for number in range(MOST_NAMED)])
    looks = {(style["linestyle"], style["marker"], style["color"]) for style in styles}
    assert len(looks) == MOST_NAMED


def test_the_legend_of_a_figure_counts_further_lines() -> None:
    styles = line_styles([str(number) for number in range(MOST_NAMED + 3)])
    labels = [style.get("label") for style in styles[MOST_NAMED:]]
    assert labels == ["and 3 more", None, None]


@pytest.mark.parametrize(
    ("number", "name"), [(0, "velocity"), (1, "rotation_1"), (2, "rotation_2")]
)
def test_gaits_are_smooth_and_go_through_the_samples(
    directory: Path, number: int, name: str
) -> None:
    """Ten points a sample, in mm/s; the bends between samples are less than half as sharp."""
    (axes,) = figures_of(read_results(directory))["gait"].axes
    line = axes.lines[number]
    cycle = np.asarray(line.get_xdata())
    values = np.asarray(line.get_ydata())
    trajectory = read_table(directory, "trajectory").query("walker == 0")
    first_cycle = trajectory["cycle"].max() - 2.0 + cycle[0]  # the axis begins with these two
    samples = trajectory[trajectory["cycle"] >= first_cycle - 1e-9]
    assert len(cycle) == 10 * (len(samples) - 1) + 1
    np.testing.assert_allclose(values[::10], 1e3 * samples[name], atol=1e-9)
    bends = np.abs(np.diff(values, 2))
    bends_of_samples = np.abs(np.diff(values[::10], 2))
    assert bends.max() < 0.5 * bends_of_samples.max()


@pytest.mark.parametrize("shape", ["random", "with a flat part", "constant", "three samples"])
def test_smooth_curves_are_those_of_scipy(shape: str) -> None:
    """Its modified Akima interpolation takes half a second to import."""
    generator = np.random.default_rng(7)
    places = np.cumsum(generator.uniform(0.1, 2.0, 40))
    if shape == "three samples":
        places = places[:3]
    values = generator.normal(size=len(places))
    if shape == "with a flat part":
        values[15:25] = values[15]
    if shape == "constant":
        values[:] = 0.5
    dense = np.linspace(places[0], places[-1], 501)
    expected = Akima1DInterpolator(places, values, method="makima")(dense)
    np.testing.assert_allclose(_interpolated(places, values, dense), expected, rtol=0.0, atol=1e-13)


def test_plots_of_walkers_load_neither_scipy_nor_pandas(directory: Path, tmp_path: Path) -> None:
    """Each takes a third of a second or more."""
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from walkers.postprocess.show.figures import plot_run\n"
        "plot_run(Path(sys.argv[1]), Path(sys.argv[2]))\n"
        "print({'scipy', 'pandas', 'pyarrow.dataset'} & {*sys.modules})"
    )
    command = [sys.executable, "-c", script, str(directory), str(tmp_path)]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "set()\n"


# --- pictures ---------------------------------------------------------------------------------


def ruby_in(picture: np.ndarray, over_green: float = 1.3, least_red: int = 0) -> np.ndarray:
    """Where a picture is red."""
    red = picture[..., 0].astype(float)
    green = picture[..., 1].astype(float)
    return np.asarray((red > over_green * green) & (red > least_red))


@pytest.fixture(scope="module")
def rendered(directory: Path, tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    """The pixels of a picture of the walkers."""
    destination = tmp_path_factory.mktemp("picture") / "walker.png"
    (path,) = walkers.load(directory).render(destination, images=2)
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def test_rendering_shows_ruby_beads_on_a_grey_floor(rendered: np.ndarray) -> None:
    grey = np.ptp(rendered, axis=-1) < 25
    assert 0.02 < ruby_in(rendered, 1.8, 60).mean() < 0.5
    assert grey.mean() > 0.4


def test_rendering_cuts_nothing_at_the_edges(rendered: np.ndarray) -> None:
    for edge in (rendered[0], rendered[-1], rendered[:, 0], rendered[:, -1]):
        assert (edge == 255).all()


@pytest.mark.parametrize(
    ("tilt", "labels"),
    [(0.0, ["x (mm)", "y (mm)"]), (0.1, ["across the slope (mm)", "uphill (mm)"])],
    ids=["level", "slope"],
)
def test_axes_of_a_picture_say_which_way_is_uphill(
    tilt: float, labels: list[str], motion: Motion
) -> None:
    on_slope = replace(motion, case=motion.case.with_value_at("boundary.tilt", tilt))
    (axes,) = _series_figure(on_slope, [0], follow=False).axes
    assert [axes.get_xlabel(), axes.get_ylabel()] == labels


def test_a_scale_bar_is_as_long_as_beads_say(single: Motion) -> None:
    """The red of one bead, seen without perspective, is as wide and as high as its diameter."""
    bead = single.select(slice(1), beads=np.array([0]))
    bead = replace(bead, walkers=(replace(single.walkers[0], beads=(0,)),))
    scene = Scene.around(bead, camera_axes(bead), 1.2, shaken=False)
    with closing(Window(scene, (400, 300))) as window:
        rows, columns = np.nonzero(ruby_in(window.picture(0)))
        diameter = 2e3 * bead.radius[0] * window.pixels_per_mm
    assert np.ptp(columns) + 1 == pytest.approx(diameter, abs=2.5)
    assert np.ptp(rows) + 1 == pytest.approx(diameter, abs=2.5)


@pytest.mark.parametrize(
    ("meet", "lower_left"),
    [
        pytest.param(True, [-2.0, -2.0], id="walkers that meet: from above"),
        pytest.param(False, [-2.0, 0.0], id="walkers apart: from the side"),
    ],
)
def test_a_closed_tray_is_seen_from_above(
    meet: bool, lower_left: list[float], single: Motion
) -> None:
    """A tray of 4 mm × 4 mm, in mm about its middle."""
    boundary = single.case.boundary.with_values(shape="box", width=4e-3, height=3e-3)
    case = single.case.with_values(boundary=boundary).with_value_at("dimers.meet", meet)
    origin = np.array([*single.walkers[0].origin, 0.0])
    tray = replace(single, position=single.position - origin, case=case)
    axes = camera_axes(tray)
    assert axes[2, 2] == float(meet)
    low = Scene.around(tray, axes, shaken=False).low
    np.testing.assert_allclose(low[:2], lower_left, atol=1e-2)


def walked_by(single: Motion, lengths: float) -> Motion:
    """The motion of a walker that also walks evenly by so many of its lengths."""
    way = lengths * single.case.walkers[0].length * single.time / single.time[-1]
    along = np.array(single.case.drive_axis)
    return replace(single, position=single.position + way[:, None, None] * along)


def scene_that_follows(far: Motion) -> Scene:
    """A scene around a motion, in which the camera may follow the walker."""
    return Scene.around(far, camera_axes(far), 1.2, shaken=False).following(1.5, 1.2)


def test_the_camera_rests_if_a_walker_walks_half_its_length(single: Motion) -> None:
    assert scene_that_follows(walked_by(single, 0.5)).camera_path is None


def test_the_camera_follows_a_walker_that_walks_far(single: Motion) -> None:
    scene = scene_that_follows(walked_by(single, 40.0))
    assert scene.camera_path is not None
    displacement = np.linalg.norm(scene.camera_displacement(len(single.time) - 1))
    way = 40.0 * 1e3 * single.case.walkers[0].length  # mm
    assert displacement == pytest.approx(way, rel=0.05)


BOX = {"shape": "box", "width": "20 mm", "height": "10 mm"}


@pytest.mark.parametrize(
    ("changes", "direction", "name"),
    [
        pytest.param(
            {"drive": {"axis": "x"}}, [1.0, 0.0, 0.0], "along the drive axis", id="driven along x"
        ),
        pytest.param(
            {"drive": {"axis": "y"}}, [0.0, 1.0, 0.0], "along the drive axis", id="driven along y"
        ),
        pytest.param(
            {"drive": {"axis": [3, 4, 0]}},
            [0.6, 0.8, 0.0],
            "along the drive axis",
            id="driven obliquely",
        ),
        pytest.param(
            {"boundary": {"tilt": "5 deg", "uphill": "60 deg"}},
            [0.5, sqrt(0.75), 0.0],
            "uphill",
            id="slope",
        ),
        pytest.param({"boundary": BOX}, [0.0, 0.0, 1.0], "up", id="box"),
        pytest.param(
            {"boundary": BOX | {"tilt": "30 deg", "uphill": "0 deg"}},
            [0.5, 0.0, sqrt(0.75)],
            "up",
            id="tilted box: against gravity",
        ),
    ],
)
def test_the_direction_of_a_displacement_that_pictures_name(
    changes: dict[str, dict[str, Any]], direction: list[float], name: str, single: Motion
) -> None:
    """In the frame of the boundary."""
    vector, words = named_direction(replace(single, case=make_case(**changes)))
    assert vector == pytest.approx(direction)
    assert words == name


@pytest.mark.parametrize("lengths", [0.5, 40.0])
def test_a_walker_is_as_large_in_the_picture_however_far_it_walks(
    single: Motion, lengths: float
) -> None:
    """And within it, at the start and at the end."""
    scene = scene_that_follows(walked_by(single, lengths))
    with closing(Window(scene, (300, 200))) as window:
        for frame in (0, len(single.time) - 1):
            ruby = ruby_in(window.picture(frame))
            assert ruby.mean() > 0.07
            assert not ruby[:, 0].any()
            assert not ruby[:, -1].any()


@pytest.mark.parametrize(
    ("boundary", "faces", "edges"),
    [
        pytest.param(Boundary(material="glass"), 1, 4, id="plane"),
        pytest.param(Boundary(shape="channel", material="glass", width=2e-3), 3, 8, id="channel"),
        pytest.param(
            Boundary(shape="box", material="glass", width=2e-3, height=4e-3), 5, 4, id="box"
        ),
        pytest.param(
            Boundary(shape="cylinder", material="glass", width=2e-3, height=4e-3),
            65,
            64,
            id="cylinder",
        ),
    ],
)
def test_walls_are_whole_wherever_the_beads_are(
    motion: Motion, boundary: Boundary, faces: int, edges: int
) -> None:
    """Beads high above the floor of a container, or far from the middle of what has no end.

    Seams are at the ends alone.
    """
    away = [0.0, 0.0, 2e-3] if boundary.closed else [5e-2, 0.0, 0.0]
    beads = 0.1 * (motion.position - motion.position.mean(axis=(0, 1))) + away
    placed = replace(motion, position=beads, case=motion.case.with_values(boundary=boundary))
    walls = mesh_of(walls_of(placed)).clean(tolerance=1e-9, absolute=True)
    assert walls.n_cells == faces
    assert walls.n_open_edges == edges
    assert walls.bounds[4] == pytest.approx(0.0, abs=1e-12)
    triangles = _walls(placed)
    first, second, third = triangles.points[triangles.cells_dict["triangle"]].swapaxes(0, 1)
    areas = 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=1)
    assert areas.sum() == pytest.approx(walls.area)


# --- necks ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rupture:
    """Two beads of a pile whose bridge ruptures.

    Attributes
    ----------
    motion
        The motion of these beads.
    frame
        The last frame with the bridge.
    """

    motion: Motion
    frame: int

    def bridges(self, frame: float) -> np.ndarray:
        """The contacts with a bridge at a frame; ``[0, 1, -1]`` is that of the two beads."""
        (contacts,) = bridges_at(self.motion, [frame])
        return contacts


@pytest.fixture(scope="module")
def rupture(pile_run: Path) -> Rupture:
    """The first rupture in the shipped pile, in which the beads have other numbers."""
    pile = read_motion(pile_run).driven
    pairs_before: set[tuple[int, ...]] = set()
    for frame, bridges in enumerate(read_bridges(pile)):
        pairs = set(map(tuple, np.sort(bridges.beads).tolist()))
        ruptured = pairs_before - pairs
        if ruptured:
            return Rupture(pile.select(beads=np.array(min(ruptured))), frame - 1)
        pairs_before = pairs
    raise AssertionError("no bridge of the pile ruptures")


def test_a_bridge_of_two_beads_of_a_pile_is_gone_when_it_ruptured(rupture: Rupture) -> None:
    assert [0, 1, -1] in rupture.bridges(rupture.frame).tolist()
    assert [0, 1, -1] not in rupture.bridges(rupture.frame + 1).tolist()


def test_between_two_frames_the_bridges_are_those_of_the_nearest_one_until_they_ruptured(
    rupture: Rupture,
) -> None:
    nearest = rupture.bridges(rupture.frame + 0.4)
    np.testing.assert_array_equal(nearest, rupture.bridges(rupture.frame))


def test_a_neck_is_where_a_bridge_is_and_gone_when_it_ruptured(rupture: Rupture) -> None:
    """Seen from the side: the picture is blue between the beads."""
    frame = rupture.frame
    upward = np.array([0.0, 0.0, 1.0])
    (between_beads,) = np.diff(rupture.motion.position[frame], axis=0)
    axes = axes_toward(np.cross(between_beads, upward), upward)
    seen = 1e3 * rupture.motion.position[frame : frame + 2] @ axes.T
    low = seen.min(axis=(0, 1)) - 0.3
    high = seen.max(axis=(0, 1)) + 0.3
    scene = Scene(rupture.motion, axes, low, high, shaken=False)
    before = rupture.bridges(frame)
    after = rupture.bridges(frame + 1)

    def blue_pixels(frame_of_beads: int, bridges: np.ndarray) -> int:
        picture = window.picture(frame_of_beads, bridges).astype(float)
        return int(np.count_nonzero(picture[..., 2] > 1.5 * picture[..., 0]))

    with closing(Window(scene, (300, 300))) as window:
        ruptured_and_moved = blue_pixels(frame + 1, after)
        ruptured = blue_pixels(frame, after)
        wet = blue_pixels(frame, before)
        dry = blue_pixels(frame, NO_BRIDGES)
    assert wet > 20 + max(ruptured_and_moved, ruptured, dry)


@pytest.mark.parametrize("other", ["plane", "bead"])
@pytest.mark.parametrize(
    ("gap", "meniscus"),
    [
        pytest.param(0.0, None, id="in contact"),
        pytest.param(5e-6, None, id="open"),
        pytest.param(2e-5, None, id="wide open"),
        pytest.param(5e-6, 2e-5, id="of a meniscus"),
    ],
)
def test_a_neck_has_the_volume_of_its_bridge(
    gap: float, meniscus: float | None, other: str, motion: Motion
) -> None:
    """Within what polygons differ from circles.

    The neck is a body of revolution about the line between its ends, without the caps of the beads.
    """
    if meniscus is not None:
        liquid = motion.case.liquid.with_values(volume_fraction=None, meniscus_radius=meniscus)
        motion = replace(motion, case=motion.case.with_values(liquid=liquid))
    radius, second_radius = motion.radius[:2]
    height = radius + gap
    place = np.array([[0.0, 0.0, height], [height + second_radius, 0.0, height]])
    if other == "bead":
        contact = np.array([[0, 1, -1]])
        surface_radius = second_radius  # of what is at the other end
        surfaces = bridge_at_rest(motion.case, radius, second_radius).surfaces
    else:
        contact = np.array([[0, -1, 0]])
        surface_radius = 0.0
        surfaces = bridge_at_rest(motion.case, radius, np.inf).surfaces

    starts, ends = bridge_ends(motion, place, contact)
    length = np.linalg.norm(ends - starts)
    assert length == pytest.approx(radius + gap + surface_radius)

    points, _ = neck_surfaces(motion, contact, Ends(starts, ends), NeckGrid(65, 64))
    direction = (ends - starts)[0] / length
    from_start = 1e-3 * points[0] - starts[0]
    along = from_start @ direction
    radii = np.linalg.norm(from_start - np.outer(along, direction), axis=1)
    along = along.reshape(65, 64)[:, 0]
    radii = radii.reshape(65, 64)[:, 0]
    assert along[0] == pytest.approx(np.sqrt(radius**2 - radii[0] ** 2))  # on the bead's surface

    in_first_bead = np.maximum(radius**2 - along**2, 0.0)
    in_second_bead = np.maximum(surface_radius**2 - (length - along) ** 2, 0.0)
    volume = np.pi * np.trapezoid(radii**2 - in_first_bead - in_second_bead, along)
    assert volume == pytest.approx(surfaces.volume, rel=0.01, abs=0.0)


# --- films ------------------------------------------------------------------------------------


def test_pictures_are_as_far_apart_as_the_slow_motion_says(motion: Motion) -> None:
    """25 pictures a second, twenty times slowed down: 500 a second of the motion."""
    times = film_times(motion, FilmOptions(slowdown=20.0))
    np.testing.assert_allclose(np.diff(times.time), 1.0 / 500.0, atol=1e-12)
    seconds_per_frame = np.median(np.diff(motion.time))
    np.testing.assert_allclose(times.frame * seconds_per_frame, times.time, atol=1e-12)
    assert not times.stroboscopic


def test_a_film_lasts_ten_seconds_unless_it_is_asked_for_another_slow_motion(
    motion: Motion,
) -> None:
    """0.1 s of motion: a hundred times."""
    assert film_times(motion, FilmOptions()).slowdown == 100.0


@pytest.mark.parametrize("slowdown", [1.0, 5.0])
def test_films_with_few_pictures_a_cycle_are_stroboscopic(motion: Motion, slowdown: float) -> None:
    """Of a cycle of 12.5 ms, pictures are 40 and 8 ms apart."""
    times = film_times(motion, FilmOptions(slowdown=slowdown))
    assert times.stroboscopic
    cycles = times.time * motion.case.excitation.frequency
    np.testing.assert_allclose(cycles, np.round(cycles), atol=1e-9)


def test_a_film_may_show_a_part_of_the_motion(motion: Motion) -> None:
    """From 20 to 50 ms in steps of 2 ms."""
    times = film_times(motion, FilmOptions(slowdown=20.0, begin=0.02, end=0.05))
    assert times.time[0] == pytest.approx(0.02)
    assert len(times.time) == 16


def test_an_mp4_shows_a_walker_that_walks(directory: Path, tmp_path: Path) -> None:
    """0.1 s, ten times slowed down, at 10 pictures a second: 11 pictures."""
    path = tmp_path / "here" / "walk.mp4"
    options = ["--size", "360p", "--fps", "10", "--slowdown", "10"]
    done = call("render", "--film", str(directory), "--to", str(path), *options, check=True)
    assert done.stdout.strip() == str(path)
    about, *pictures = imageio_ffmpeg.read_frames(str(path))
    assert (about["size"], about["fps"], len(pictures)) == ((640, 360), 10.0, 11)
    ruby = []
    for picture in pictures:
        pixels = np.frombuffer(picture, np.uint8).reshape(360, 640, 3)
        ruby.append(ruby_in(pixels, 2.0, 60))
        assert 0.02 < ruby[-1].mean() < 0.4
    assert (ruby[0] != ruby[-1]).mean() > 0.01


def test_a_gif_lasts_as_long_as_it_says(directory: Path, tmp_path: Path) -> None:
    """50 ms, ten times slowed down, at 20 pictures a second: 11 pictures of 50 ms, for ever."""
    path = tmp_path / "walk.gif"
    options = ["--size", "160x90", "--fps", "20", "--slowdown", "1e1", "--end", "50 ms"]
    command = ["render", "--film", str(directory), "--to", str(path), *options, "--walker", "1"]
    call(*command, check=True)
    film = Image.open(path)
    assert film.size == (160, 90)
    assert film.n_frames == 11
    assert film.info["duration"] == 50
    assert film.info["loop"] == 0
