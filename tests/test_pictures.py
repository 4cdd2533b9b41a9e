"""Figures, renderings, films, files for ParaView and other programs, read back."""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import imageio_ffmpeg
import meshio
import numpy as np
import pytest
import pyvista as pv
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from PIL import Image

import walkers
from tests.conftest import call
from tests.printed import letters, spoilt
from walkers.errors import InputError
from walkers.inputs.boundary import Boundary
from walkers.inputs.loads import bridge_at_rest
from walkers.postprocess.drawing import styled
from walkers.postprocess.figures import LEAST, MOST_NAMED, climb_figure, draw, figures_of, looks_of, plot_run
from walkers.postprocess.film_options import FilmOptions, parse_time
from walkers.postprocess.films import film_times, named_direction
from walkers.postprocess.motion import Group, Motion, between, read_bridges, read_motion
from walkers.postprocess.necks import bridges_at, ends_of, necks_of
from walkers.postprocess.paraview import _walls, write_vtk
from walkers.postprocess.scene import Scene, Window, axes_toward, camera_axes, mesh_of, walls_of
from walkers.postprocess.series import _figure, _strips, even_frames, even_labels, render_series
from walkers.postprocess.tables import read_table
from walkers.runner.directory import case_of

KINDS = ("beads", "boundary", "bridges")


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    return run_directory(
        dimers={"replicates": 2, "angle_spread": "1 deg"},
        run={"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 10, "bridge_samples_per_cycle": 2},
    )


@pytest.fixture(scope="module")
def collection(directory: Path) -> Path:
    return write_vtk(directory, every=1, as_placed=True)


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    return read_motion(directory).groups[0]


def test_beads_and_floor_are_where_the_engine_put_them(moved: Group, collection: Path) -> None:
    sets = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    seconds = {kind: [float(entry.attrib["timestep"]) for entry in sets if entry.get("name") == kind] for kind in KINDS}
    for kind, every in {"beads": 1, "boundary": 1, "bridges": 5}.items():
        np.testing.assert_allclose(seconds[kind], moved.time[::every], atol=1e-15)
    listed = {entry.attrib["file"] for entry in sets}
    assert {path.name for path in collection.parent.iterdir()} == {*listed, "walkers.pvd", "show.py"}
    reader = pv.get_reader(collection)
    for number, blocks in ((80, 3), (79, 2)):
        reader.set_active_time_value(reader.time_values[number])
        assert [block.n_cells for block in reader.read()] == [4, 2, 6][:blocks]
    frame = 13
    beads = meshio.read(collection.parent / f"beads_{frame:06d}.vtu")
    shift = moved.motion.substrate[frame]
    np.testing.assert_allclose(beads.points, (moved.position[frame] + shift).reshape(-1, 3), rtol=1e-12)
    np.testing.assert_array_equal(beads.cells_dict["vertex"], np.arange(4)[:, None])
    velocity = moved.velocity[frame].reshape(-1, 3)
    arrays = {
        **{"bead": range(4), "walker": [0, 0, 1, 1], "large": [1, 0] * 2, "radius (m)": [3e-4, 2e-4] * 2},
        **{"velocity (m/s)": velocity, "speed (m/s)": np.linalg.norm(velocity, axis=1)},
        "omega (rad/s)": moved.spin[frame].reshape(-1, 3),
    }
    assert beads.point_data.keys() == arrays.keys()
    read_by_vtk = pv.read(collection.parent / f"beads_{frame:06d}.vtu")
    for name, values in arrays.items():
        np.testing.assert_allclose(beads.point_data[name], values)
        np.testing.assert_array_equal(read_by_vtk.point_data[name], beads.point_data[name])
    np.testing.assert_array_equal(read_by_vtk.points, beads.points)
    # What the script for ParaView scales the spheres by.
    spheres = read_by_vtk.glyph(scale="radius (m)", factor=2.0, orient=False, geom=pv.Sphere(radius=0.5))
    top = (moved.position[frame, ..., 2] + moved.radii).max() + shift[2]
    assert spheres.bounds[5] == pytest.approx(top, abs=1e-9)
    floors = [pv.read(collection.parent / f"boundary_{number:06d}.vtu") for number in (0, frame)]
    np.testing.assert_allclose(floors[1].points - floors[0].points, np.tile(shift, (4, 1)), atol=1e-12)
    assert np.linalg.norm(shift) > 1e-5
    assert floors[0].cells_dict.keys() == {pv.CellType.TRIANGLE}
    low_x, high_x, low_y, high_y, *heights = floors[0].bounds
    assert (low_x, low_y) < tuple(moved.motion.position[..., :2].min(axis=(0, 1)))
    assert (high_x, high_y) > tuple(moved.motion.position[..., :2].max(axis=(0, 1)))
    assert heights == pytest.approx([0.0, 0.0], abs=1e-15)


def test_bridges_are_lines_with_force_and_gap(directory: Path, moved: Group, collection: Path) -> None:
    bridges = meshio.read(collection.parent / "bridges_000010.vtu")
    table = read_table(directory, "bridges")
    rows = table[np.isclose(table["time"], moved.time[10])]
    ends = bridges.points[bridges.cells_dict["line"]]
    # The table is sorted by walkers and contacts, the lines are not: a line is known by the beads that it joins.
    centres = pv.read(collection.parent / "beads_000010.vtu").points
    apart = np.linalg.norm(ends[:, :, None] - centres, axis=-1)
    joined = np.where(apart.min(axis=-1) < 1e-12, apart.argmin(axis=-1), -1)
    contacts = [(0, -1), (1, -1), (0, 1), (2, -1), (3, -1), (2, 3)]
    assert list(zip(rows["bead_1"], rows["bead_2"], strict=True)) == contacts
    lines = [tuple(sorted(line, key=lambda bead: (bead < 0, bead))) for line in joined.tolist()]
    order = [lines.index(contact) for contact in contacts]
    assert sorted(order) == list(range(6))
    feet = ends[joined < 0]
    np.testing.assert_allclose(feet[:, 2], moved.motion.substrate[10, 2], atol=1e-12)
    units = {"gap": " (m)", "normal_force": " (N)"}
    for name in ("gap", "normal_force", "walker", "wall", "bead_1", "bead_2"):
        (values,) = bridges.cell_data[name + units.get(name, "")]
        np.testing.assert_allclose(values[order], rows[name])
    np.testing.assert_array_equal(bridges.cell_data["touching"][0][order], rows["gap"] <= 0.0)
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    np.testing.assert_allclose(length[order] - [3e-4, 2e-4, 5e-4] * 2, rows["gap"], atol=1e-10)
    # The engine reported bridges twice a cycle, beads ten times.
    assert [len(list(collection.parent.glob(f"{kind}_*.vtu"))) for kind in ("bridges", "beads")] == [17, 81]
    necks = pv.read(collection.parent / "bridges_000010.vtu").extract_surface(algorithm=None)
    assert (necks.n_lines, necks.tube(radius=1e-5, n_sides=16).n_cells > 0) == (6, True)


def test_a_frame_without_bridges_has_no_block_of_them(directory: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(directory, tmp_path / "run"))
    for path in run.rglob("bridges.*s.txt"):  # of pairs, of walls
        first, *later = path.read_text().split("ITEM: TIMESTEP")[1:]
        head, entries = first.split("ITEM: ENTRIES")
        head = re.sub(r"(ENTRIES\n)\d+", r"\g<1>0", head)
        path.write_text("ITEM: TIMESTEP".join(["", f"{head}ITEM: ENTRIES{entries.splitlines()[0]}\n", *later]))
    collection = write_vtk(run, tmp_path / "vtk")
    assert [(collection.parent / f"bridges_0000{frame}.vtu").exists() for frame in ("00", "10")] == [False, True]
    assert len(pv.get_reader(collection).read()) == 2


def test_walkers_are_drawn_side_by_side_once_a_cycle_and_the_camera_sees_them(
    run_directory: Callable[..., Path], directory: Path, moved: Group, tmp_path: Path
) -> None:
    """Those of a run in segments too."""
    collection = write_vtk(directory, destination=tmp_path / "gathered")
    np.testing.assert_allclose(pv.get_reader(collection).time_values, np.arange(9) / 80.0)
    points = [pv.read(collection.parent / f"beads_{frame:06d}.vtu").points for frame in (0, 80)]
    walked = (points[1] - points[0]).reshape(2, 2, 3)
    np.testing.assert_allclose(walked, moved.position[80] - moved.position[0], atol=1e-12)
    assert np.ptp(points[0][:, 1]) < 4e-3 < np.ptp(moved.position[0, ..., 1])
    run = {"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 10, "segment": "0.05 s"}
    other = write_vtk(run_directory(dimers={"replicates": 2}, run=run), tmp_path / "vtk", colour="omega")
    beads = pv.read(other.parent / "beads_000000.vtu").points
    view = json.loads(ElementTree.parse(other).getroot().attrib["view"])
    np.testing.assert_allclose(view["middle"][:2], beads[:, :2].mean(axis=0), atol=1e-3)
    assert (view["colour"], view["neck"]) == ("omega (rad/s)", pytest.approx(9e-5))
    assert np.ptp(beads[:, 1]) < 4e-3
    scripts = [place.with_name("show.py").read_bytes() for place in (collection, other)]
    assert scripts == 2 * [files("walkers.postprocess").joinpath("paraview_show.py").read_bytes()]


_FOREIGN: dict[str, Callable[[Path], object]] = {
    "a text": lambda place: (place / "thesis.txt").write_text("years of work"),
    "VTK files": lambda place: [(place / name).write_text("x") for name in ("turbine_0001.vtu", "turbine.pvd")],
    "names as ours, without a collection": lambda place: (place / "beads_000000.vtu").write_text("x"),
    "a script as ours, without a collection": lambda place: (place / "show.py").write_text("x"),
    "a collection that lists other files": lambda place: (place / "walkers.pvd").write_text("<VTKFile/>"),
    "a collection of other files": lambda place: (
        (place / "walkers.pvd").write_text('<DataSet timestep="0.0" file="turbine.vtu" />'),
        (place / "turbine.vtu").write_text("x"),
    ),
    "a frame that was not exported": lambda place: (
        (place / "walkers.pvd").write_text('<DataSet timestep="0.0" part="0" file="beads_000000.vtu" />'),
        *((place / f"beads_00000{number}.vtu").write_text("x") for number in (0, 1)),
    ),
}


@pytest.mark.parametrize("name", _FOREIGN)
def test_an_export_replaces_its_own_files_alone(name: str, directory: Path, tmp_path: Path) -> None:
    place = tmp_path / "vtk"
    place.mkdir()
    _FOREIGN[name](place)
    before = {path: path.read_bytes() for path in place.iterdir()}
    with pytest.raises(InputError, match="expected a new or empty folder"):
        write_vtk(directory, destination=place)
    assert {path: path.read_bytes() for path in place.iterdir()} == before
    for path in place.iterdir():
        path.unlink()
    for every in (4, 40):  # an earlier export is replaced
        write_vtk(directory, destination=place, every=every)
        assert len(list(place.glob("beads_*.vtu"))) == 80 // every + 1
    with pytest.raises(InputError, match="it is a file"):
        write_vtk(directory, destination=place / "walkers.pvd")
    (tmp_path / "link").symlink_to(place)
    before = {path: path.read_bytes() for path in place.iterdir()}
    with pytest.raises(InputError, match="it is a symbolic link"):
        write_vtk(directory, tmp_path / "link")
    assert {path: path.read_bytes() for path in place.iterdir()} == before
    assert {path.name for path in tmp_path.iterdir()} == {"vtk", "link"}


def test_an_export_for_paraview_reads_each_dump_once(directory: Path, tmp_path: Path) -> None:
    script = "import sys; from pathlib import Path; from walkers.postprocess.paraview import write_vtk; opened = []\n"
    script += "sys.addaudithook(lambda event, given: event == 'open' and opened.append(str(given[0])))\n"
    script += "write_vtk(Path(sys.argv[1]), Path(sys.argv[2]))\n"
    script += "print(*(sum(one.endswith(name) for one in opened) for name in ('beads.bin', 'bridges.pairs.txt')))"
    command = [sys.executable, "-c", script, str(directory), str(tmp_path / "vtk")]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.split() == ["1", "1"]


_WRONG: list[tuple[Callable[[walkers.Run, Path], object], str]] = [
    (lambda *_: FilmOptions(slowdown=0.0), "^slowdown: 0: expected more than 0$"),
    (lambda *_: FilmOptions(fps=0), "^fps: 0: expected more than 0$"),
    (lambda *_: FilmOptions(size=(0, 64)), "^size: 0: expected more than 0$"),
    (lambda run, to: run.film(to / "a.gif", walker=-1), "^walker: -1: expected 0 to 1$"),
    (lambda run, to: run.film(to / "a.gif", begin=1.0), "^begin, end: nothing to show"),
    (lambda run, to: run.render(to / "a.png", walker=2), "^walker: 2: expected 0 to 1$"),
    (lambda run, to: run.export("lammps", to / "a.lammpstrj", every=0), "^every: 0: expected a whole number from 1$"),
    (lambda run, to: run.export("xyz", to / "a.xyz"), "^form: 'xyz': expected one of deck, vtk, paraview, "),
    (lambda run, to: run.export("vtk", to / "vtk", every=0), "^every: 0: expected a whole number from 1$"),
    (lambda run, to: run.export("paraview", to / "vtk", colour="beauty"), "^colour: 'beauty': expected one of bead, "),
    (lambda run, to: run.plot(to / "a.png"), r"a\.png: expected a folder"),
    (lambda run, to: run.plot(to, "png,jpeg"), "^format: 'jpeg': expected one of png, svg, pdf$"),
]


@pytest.mark.parametrize(("use", "told"), _WRONG)
def test_wrong_arguments_in_python_are_refused_by_their_names(
    use: Callable[[walkers.Run, Path], object], told: str, directory: Path, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=told):
        use(walkers.load(directory), tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("text", "seconds"), [("0.001", 1e-3), ("1e-3", 1e-3), ("2E+0", 2.0), ("3 ms", 3e-3)])
def test_times_are_numbers_of_seconds_or_have_a_unit(text: str, seconds: float) -> None:
    assert parse_time("--begin", text) == pytest.approx(seconds)


def test_figures_of_runs_come_in_other_formats_and_can_be_printed(
    directory: Path, run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    paths = plot_run(directory, tmp_path, ["pdf", "svg", "png"])
    names = [f"{name}.{form}" for name in ("walk", "gait") for form in ("pdf", "svg", "png")]
    assert [path.name for path in paths] == names
    assert all(directory.name.encode() in path.read_bytes() for path in paths)
    assert plot_run(directory, tmp_path, "pdf,svg,png") == paths
    assert len(Image.open(paths[2]).convert("RGB").getcolors(maxcolors=1 << 24)) > 20
    strobed = run_directory(run={"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 1})
    assert [path.name for path in plot_run(strobed, tmp_path)] == ["walk.png"]  # which shows no gait
    with pytest.raises(InputError, match="jpeg"):
        plot_run(directory, tmp_path / "none", ["jpeg"])
    assert not (tmp_path / "none").exists()
    figures = figures_of(directory)
    assert [spoilt(figure) + letters(figure) for figure in figures.values()] == [["a", "b", "c"], []]


def test_a_dozen_lines_are_told_apart_with_and_without_colours_and_further_ones_are_grey() -> None:
    looks = styled(lambda: looks_of([str(number) for number in range(MOST_NAMED + 3)]))()
    named, others = looks[:MOST_NAMED], looks[MOST_NAMED:]
    assert len({(look["linestyle"], look["marker"]) for look in named}) == MOST_NAMED
    assert len({to_hex(styled(lambda one=look["color"]: to_rgba(one))()) for look in named}) == MOST_NAMED
    assert [look.get("label") for look in others] == ["and 3 more", None, None]
    assert {look["color"] for look in others}.isdisjoint({look["color"] for look in named})


def test_axes_of_figures_are_wide_enough_that_rounding_is_no_motion() -> None:
    axes, time = Figure().subplots(), np.linspace(0.0, 1.0, 5)
    columns = {"walker": np.zeros(5, dtype=int), "time": time, "distance": 1e-14 * time}
    draw(axes, "cycles", columns, "time", "distance", "walker", [{}])
    assert np.ptp(axes.get_ylim()) == pytest.approx(LEAST["m"])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (s)", "distance along the heading (mm)")
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 1e3 * columns["distance"])


def test_gaits_are_smooth_and_go_through_the_samples(directory: Path) -> None:
    (axes,) = figures_of(directory)["gait"].axes
    trajectory = read_table(directory, "trajectory").query("walker == 0")
    for line, name in zip(axes.lines, ("velocity", "rotation_1", "rotation_2"), strict=False):
        cycle, values = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        samples = trajectory[trajectory["cycle"] >= cycle[0] - 1e-9]
        assert len(cycle) == 10 * (len(samples) - 1) + 1
        np.testing.assert_allclose(values[::10], 1e3 * samples[name], atol=1e-9)
        kinks = np.abs(np.diff(values, 2))
        assert kinks.max() < 0.5 * np.abs(np.diff(values[::10], 2)).max()


def _arrays(table: Mapping[str, Any]) -> dict[str, np.ndarray]:
    return {name: np.asarray(values) for name, values in table.items()}


def test_each_climb_has_a_colour_and_the_thin_lines_are_named_once(pile_run: Path) -> None:
    climbed = np.array([False, True, False, True])
    clusters = {"climbed": climbed, "leader": np.arange(4), "leader_large": climbed, "size": np.full(4, 3)}
    members = {"track": np.arange(4), "bead": np.arange(4), "time": np.zeros(4), "height": np.zeros(4)}
    tables: dict[str, Mapping[str, Any]] = {"clusters": clusters | {"speed": np.zeros(4)}, "members": members}
    tables |= {name: dict(read_table(pile_run, name).items()) for name in ("bed", "events")}
    figure = climb_figure(case_of(pile_run), {name: _arrays(table) for name, table in tables.items()}.__getitem__)
    lines = figure.axes[0].lines[:4]
    assert len({lines[number].get_color() for number in (0, 1, 3)}) == 3
    labels = [str(line.get_label()).replace("\n", " ") for line in lines]
    assert [label.partition(" beads")[0] for label in labels if label[0] != "_"] == [
        *("clusters that did not climb", "3", "3"),
    ]
    assert spoilt(figure) == []


@pytest.mark.parametrize("walker", [None, 0])
def test_rendering_shows_ruby_beads_on_a_grey_floor_and_cuts_nothing(
    walker: int | None, directory: Path, tmp_path: Path
) -> None:
    (path,) = render_series(directory, tmp_path / "walker.png", images=3, walker=walker)
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert 0.02 < np.mean((pixels[..., 0] > 1.8 * pixels[..., 1]) & (pixels[..., 0] > 60)) < 0.5
    assert np.mean(np.ptp(pixels, axis=-1) < 25) > 0.4
    assert all((edge == 255).all() for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]))


@pytest.fixture(scope="module")
def ruptured(pile_run: Path) -> tuple[Motion, int]:
    """Two beads of a pile and the last frame before their bridge ruptures."""
    motion = read_motion(pile_run).driven
    held = [{tuple(pair) for pair in np.sort(bridges.beads).tolist()} for bridges in read_bridges(motion)]
    frame, pair = next((frame, min(gone)) for frame in range(len(held)) if (gone := held[frame] - held[frame + 1]))
    return motion.select(beads=np.array(pair)), frame


def test_a_neck_is_where_a_bridge_is_and_gone_when_it_ruptured(ruptured: tuple[Motion, int]) -> None:
    """Of some beads of a run, whose numbers there are others; a picture between two frames shows the nearest ones."""
    motion, frame = ruptured
    before, between, after = bridges_at(motion, [frame, frame + 0.4, frame + 1])
    assert [0, 1, -1] in before.tolist() and [0, 1, -1] not in after.tolist()
    np.testing.assert_array_equal(before, between)
    axes = axes_toward(np.cross(np.diff(motion.position[frame], axis=0)[0], [0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    seen = 1e3 * motion.position[frame : frame + 2] @ axes.T
    scene = Scene(motion, axes, seen.min(axis=(0, 1)) - 0.3, seen.max(axis=(0, 1)) + 0.3, shaken=False)
    shown = ((frame, before), (frame + 1, after), (frame, after))
    with closing(Window(scene, (300, 300))) as window:
        pictures = [window.picture(number, bridges) for number, bridges in shown]
    blue = [np.count_nonzero(each[..., 2] > 1.5 * each[..., 0].astype(float)) for each in pictures]
    assert blue[0] > 20 + max(blue[1:])


@pytest.mark.parametrize("gap", [0.0, 5e-6, 2e-5])
def test_a_neck_has_the_volume_of_its_bridge(gap: float, motion: Motion) -> None:
    """Within what spheres differ from parabolas; a neck at a plane too."""
    for contact in ([0, 1, -1], [0, -1, 0]):
        radius, other = motion.radius[0], motion.radius[1] if contact[1] > 0 else 0.0
        place = np.array([[0.0, 0.0, radius + gap], [radius + gap + motion.radius[1], 0.0, radius + gap]])
        points, _ = necks_of(motion, place, np.array([contact]), 65, 64)
        begins, ends = ends_of(motion, place, np.array([contact]))
        length = np.linalg.norm(ends - begins)
        assert length == pytest.approx(radius + gap + other)
        height = (1e-3 * points[0] - begins[0]) @ (ends - begins)[0] / length
        width = np.linalg.norm(1e-3 * points[0] - begins - np.outer(height, (ends - begins)[0] / length), axis=1)
        step, wide = height.reshape(65, 64)[:, 0], width.reshape(65, 64)[:, 0]
        assert step[0] == pytest.approx(np.sqrt(radius**2 - wide[0] ** 2))  # on the surface of the bead
        inside = np.maximum(radius**2 - step**2, 0.0) + np.maximum(other**2 - (length - step) ** 2, 0.0)
        liquid = np.pi * np.trapezoid(wide**2 - inside, step)
        volume = bridge_at_rest(motion.case, radius, other or np.inf).volume
        assert liquid == pytest.approx(volume, rel=0.3)


# --- films ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def filmed(run_directory: Callable[..., Path]) -> Path:
    return run_directory(dimers={"replicates": 2}, run={"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20})


@pytest.fixture(scope="module")
def motion(filmed: Path) -> Motion:
    return read_motion(filmed).driven


def test_places_between_frames_lie_on_the_motion(motion: Motion) -> None:
    """Each second frame, predicted from its neighbours, to a hundredth of what it moves meanwhile."""
    halfway = between(motion.select(slice(None, None, 2)), 0.5)
    errors = np.abs(halfway - motion.position[1::2]).max(axis=(1, 2))[20:60]
    moved = np.abs(np.diff(motion.position, axis=0)).max()
    assert errors.max() < 0.1 * moved
    assert np.median(errors) < 0.01 * moved


def test_pictures_are_as_far_apart_as_the_slow_motion_says(motion: Motion) -> None:
    times = film_times(motion, FilmOptions(slowdown=20.0))
    np.testing.assert_allclose(np.diff(times.time), 1.0 / 500.0, atol=1e-12)
    assert not times.stroboscopic
    np.testing.assert_allclose(times.frame * np.median(np.diff(motion.time)), times.time, atol=1e-12)
    assert film_times(motion, FilmOptions()).slowdown == 100.0  # 0.1 s in ten seconds
    strobed = film_times(motion, FilmOptions(slowdown=1.0))
    cycles = strobed.time * motion.case.excitation.frequency
    assert strobed.stroboscopic
    np.testing.assert_allclose(cycles, np.round(cycles), atol=1e-9)
    part = film_times(motion, FilmOptions(slowdown=20.0, begin=0.02, end=0.05))
    assert (part.time[0], len(part.time)) == (pytest.approx(0.02), 16)


def test_a_scale_bar_is_as_long_as_beads_say(motion: Motion) -> None:
    """The red of one bead, seen without perspective, is as wide and as high as its diameter in pixels."""
    single = motion.of_walkers(motion.walkers[:1]).select(slice(1))
    single = replace(single.select(beads=np.array([0])), walkers=(replace(single.walkers[0], beads=(0,)),))
    with closing(Window(Scene.around(single, camera_axes(single), 1.2, shaken=False), (400, 300))) as window:
        picture = window.picture(0).astype(int)
    diameter = 2e3 * motion.radius[0] * window.pixels_per_mm
    for places in np.nonzero(picture[..., 0] > 1.3 * picture[..., 1]):
        assert np.ptp(places) + 1 == pytest.approx(diameter, abs=2.5)


def test_up_in_the_picture_is_up_against_gravity(motion: Motion) -> None:
    for degrees in (0.0, 10.0, 90.0):
        tilted = replace(motion, case=motion.case.put("boundary.tilt", np.radians(degrees)))
        right, up, toward = axes = camera_axes(tilted)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        gravity = np.array(tilted.case.gravity_vector)
        assert right @ gravity == pytest.approx(0.0, abs=1e-9)
        assert up @ gravity < 0.0
        assert toward[2] > 0.5  # nobody looks from below


@pytest.mark.parametrize(("meet", "seen"), [(True, [-2.0, -2.0]), (False, [-2.0, 0.0])])
def test_a_closed_tray_is_seen_from_above(meet: bool, seen: list[float], motion: Motion) -> None:
    boundary = motion.case.boundary.but(shape="box", width=4e-3, height=3e-3)
    case = motion.case.but(boundary=boundary).put("dimers.meet", meet)
    one = motion.of_walkers(motion.walkers[:1])
    inside = one.position - np.array([*one.walkers[0].origin, 0.0])
    tray = replace(one, position=inside, case=case)
    axes = camera_axes(tray)
    assert axes[2, 2] == float(meet)
    np.testing.assert_allclose(Scene.around(tray, axes, shaken=False).low[:2], seen, atol=1e-2)


@pytest.mark.parametrize(("lengths", "follows"), [(0.0, False), (0.5, False), (40.0, True)])
def test_the_camera_follows_a_walker_that_walks_far(lengths: float, follows: bool, motion: Motion) -> None:
    """Its beads are as large in the picture as without the way, and in the middle of it."""
    one = motion.of_walkers(motion.walkers[:1])
    way = lengths * one.case.walkers[0].length * one.time / one.time[-1]
    far = replace(one, position=one.position + way[:, None, None] * np.array(one.case.drive_axis))
    scene = Scene.around(far, camera_axes(far), 1.2, shaken=False).following(1.5, 1.2)
    assert (scene.path is not None) == follows
    if follows:
        assert np.linalg.norm(scene.moved(len(far.time) - 1)) == pytest.approx(1e3 * way[-1], rel=0.05)
    with closing(Window(scene, (300, 200))) as window:
        pictures = [window.picture(frame).astype(int) for frame in (0, len(far.time) - 1)]
    for picture in pictures:
        ruby = picture[..., 0] > 1.3 * picture[..., 1]
        assert ruby.mean() > 0.07
        assert not ruby[:, [0, -1]].any()


@pytest.mark.parametrize(("tilt", "name"), [(0.0, "along the drive axis"), (20.0, "uphill")])
def test_displacements_have_a_sign_and_a_direction(tilt: float, name: str, motion: Motion) -> None:
    one = motion.of_walkers(motion.walkers[:1])
    case = one.case.put("boundary.tilt", np.radians(tilt))
    way = -40.0 * case.walkers[0].length * one.time / one.time[-1]
    far = replace(one, case=case, position=one.position + way[:, None, None] * np.array(case.drive_axis))
    toward, direction = named_direction(far)
    assert direction == name
    assert toward @ np.array(case.drive_axis) == pytest.approx(1.0)
    figure = styled(_figure)(_strips(far, [0, len(far.time) - 1]))
    assert f"displacement {name}" in " ".join(figure.get_suptitle().split())
    text = figure.axes[-1].get_title()
    assert float(re.split(r", |\n", text)[1].removesuffix(" mm")) == pytest.approx(1e3 * way[-1], rel=0.05)


def test_times_of_pictures_are_even(motion: Motion) -> None:
    for count, expected in {2: 2, 5: 5, 6: 5, 9: 9}.items():  # of eight cycles
        time = motion.time[even_frames(motion, count)]
        assert len(time) == expected
        np.testing.assert_allclose(np.diff(time), time[-1] / (expected - 1), rtol=1e-9)
    assert even_labels(np.array([0.0, 0.125])) == ["0.000 s", "0.125 s"]
    assert even_labels(np.array([0.0, 0.15])) == ["0.00 s", "0.15 s"]


def test_an_mp4_shows_a_walker_that_walks_and_a_gif_lasts_as_long_as_it_says(filmed: Path, tmp_path: Path) -> None:
    path = tmp_path / "here" / "walk.mp4"
    done = call("render", "--film", str(filmed), "--to", str(path), "--size", "360p", "--fps", "10", "--slowdown", "10")
    assert (done.returncode, done.stdout.strip()) == (0, str(path))
    about, *read = imageio_ffmpeg.read_frames(str(path))
    assert (about["size"], about["fps"], len(read)) == ((640, 360), 10.0, 11)
    pictures = [np.frombuffer(each, np.uint8).reshape(360, 640, 3).astype(int) for each in read]
    ruby = [(one[..., 0] > 2.0 * one[..., 1]) & (one[..., 0] > 60) for one in pictures]
    assert all(0.02 < one.mean() < 0.4 for one in ruby)
    assert (ruby[0] != ruby[-1]).mean() > 0.01
    options = ["--size", "160x90", "--fps", "20", "--slowdown", "10", "--end", "0.05 s", "--walker", "1"]
    call("render", "--film", str(filmed), "--to", str(tmp_path / "walk.gif"), *options, check=True)
    film = Image.open(tmp_path / "walk.gif")
    assert (film.size, film.n_frames, film.info["duration"], film.info["loop"]) == ((160, 90), 11, 50, 0)


@pytest.mark.parametrize(
    ("boundary", "faces", "edges"),
    [
        (Boundary(material="glass"), 1, 4),
        (Boundary(shape="channel", material="glass", width=2e-3), 3, 8),
        (Boundary(shape="box", material="glass", width=2e-3, height=4e-3), 5, 4),
        (Boundary(shape="cylinder", material="glass", width=2e-3, height=4e-3), 65, 64),
    ],
)
def test_walls_are_whole_wherever_the_beads_are(motion: Motion, boundary: Boundary, faces: int, edges: int) -> None:
    """Beads high above the floor of a container, or far from the middle of what has no end; seams are at the ends."""
    away = [0.0, 0.0, 2e-3] if boundary.closed else [5e-2, 0.0, 0.0]
    beads = motion.position - motion.position.mean(axis=(0, 1)) + away
    moved = replace(motion, position=0.1 * (beads - away) + away, case=motion.case.but(boundary=boundary))
    walls = mesh_of(walls_of(moved)).clean(tolerance=1e-9, absolute=True)
    assert (walls.n_cells, walls.bounds[4]) == (faces, pytest.approx(0.0, abs=1e-12))
    assert walls.n_open_edges == edges
    triangles = _walls(moved)
    first, second, third = triangles.points[triangles.cells_dict["triangle"]].swapaxes(0, 1)
    assert np.linalg.norm(np.cross(second - first, third - first), axis=1).sum() / 2.0 == pytest.approx(walls.area)


# --- trajectories for other programs ----------------------------------------------------------------------------------


def test_a_lammps_dump_holds_the_motion(filmed: Path, motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "here" / "walk.lammpstrj"
    done = call("export", str(filmed), "--to", "lammps", "-o", str(path), "--every", "4", check=True)
    assert done.stdout.strip() == str(path)
    written = motion.select(slice(None, None, 4))
    steps, counts, boxes, tables = zip(*(text.split("ITEM: ")[1:] for text in _frames_of(path)), strict=True)
    times = np.array([int(text.split()[-1]) for text in steps]) * motion.case.run.time_step
    np.testing.assert_allclose(times, written.time, atol=1e-12)
    assert {text.split()[-1] for text in counts} == {"4"}
    low, high = np.array(boxes[0].split()[-6:], dtype=float).reshape(3, 2).T
    assert np.all(low <= 1e3 * (written.position - written.radius[:, None]).min(axis=(0, 1)) + 1e-9)
    assert np.all(high >= 1e3 * (written.position + written.radius[:, None]).max(axis=(0, 1)) - 1e-9)
    columns = tables[0].split()[1:14]
    assert columns == ["id", "type", "mol", "radius", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz"]
    rows = np.array([text.split("\n", 1)[1].split() for text in tables], dtype=float).reshape(len(times), 4, 13)
    np.testing.assert_array_equal(rows[0, :, :4], [[1, 1, 1, 0.3], [2, 2, 1, 0.2], [3, 1, 2, 0.3], [4, 2, 2, 0.2]])
    for first, values in ((4, 1e3 * written.position), (7, 1e3 * written.velocity), (10, written.spin)):
        np.testing.assert_allclose(rows[..., first : first + 3], values, rtol=1e-9, atol=1e-12)


def _frames_of(path: Path) -> list[str]:
    return [f"ITEM: TIMESTEP{text}" for text in path.read_text().split("ITEM: TIMESTEP")[1:]]


def test_the_script_for_paraview_is_beside_its_files(filmed: Path, tmp_path: Path) -> None:
    for _ in range(2):  # a folder that it wrote may be written again
        script = call("export", str(filmed), "--to", "paraview", "-o", str(tmp_path / "vtk"), check=True).stdout.strip()
    assert (script, (tmp_path / "vtk" / "walkers.pvd").is_file()) == (str(tmp_path / "vtk" / "show.py"), True)


@pytest.mark.slow
def test_pvpython_shows_spheres_bridges_and_floor(filmed: Path, tmp_path: Path) -> None:
    """With ParaView and Xvfb, 1.4 GB, which ``make test-slow`` installs."""
    script = Path(
        call("export", str(filmed), "--to", "paraview", "-o", str(tmp_path / "vtk"), check=True).stdout.strip()
    )
    script = script.parent.rename(tmp_path / "moved") / script.name  # the files are found beside it
    picture = tmp_path / "walkers.png"
    command = ["xvfb-run", "-a", "pvpython", str(script), str(picture), "0.05"]
    for _ in range(3):  # under load it may not wait long enough for its screen
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path)
        if picture.exists():
            break
    assert picture.exists(), done.stderr[-2000:]
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    assert pixels.shape == (720, 1280, 3)
    red, blue = (
        (pixels[..., first] > 1.5 * pixels[..., last]) & (pixels[..., first] > 60) for first, last in ((0, 2), (2, 0))
    )
    assert 0.005 < red.mean() < 0.5  # one walker
    assert 0.005 < blue.mean() < 0.5  # the other
    assert (np.ptp(pixels - [199, 209, 217], axis=-1) < 12).mean() > 0.1  # the floor
    assert (pixels[:60, :200].max(axis=-1) < 80).sum() > 50  # the time
