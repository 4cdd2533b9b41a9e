"""Figures, renderings, films, files for ParaView and other programs, read back."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from xml.etree import ElementTree

import imageio_ffmpeg
import meshio
import numpy as np
import pytest
import pyvista as pv
from PIL import Image
from scipy.interpolate import Akima1DInterpolator

import walkers
from tests.conftest import call
from tests.printed import letters, spoilt
from walkers.errors import InputError
from walkers.inputs.resolving.loads import bridge_at_rest
from walkers.inputs.tables.boundary import Boundary
from walkers.postprocess.measure.motion import Group, Motion, read_bridges, read_motion
from walkers.postprocess.measure.results import read_results
from walkers.postprocess.measure.tables import read_table
from walkers.postprocess.show.camera import axes_toward, camera_axes
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


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
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
def collection(directory: Path) -> Path:
    return write_vtk(directory, directory / "all", every=1)


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    return gathered(read_motion(directory)).groups[0]


def test_beads_and_floor_are_where_the_engine_put_them(moved: Group, collection: Path) -> None:
    sets = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    for kind, every in {"beads": 1, "boundary": 1, "bridges": 10}.items():
        seconds = [float(entry.attrib["timestep"]) for entry in sets if entry.get("name") == kind]
        np.testing.assert_allclose(seconds, moved.time[::every], atol=1e-15)
    frame = 13
    beads, shift = (
        pv.read(collection.parent / f"beads_{frame:06d}.vtu"),
        moved.motion.substrate[frame],
    )
    np.testing.assert_allclose(
        beads.points, (moved.position[frame] + shift).reshape(-1, 3), rtol=1e-12
    )
    velocity = moved.velocity[frame].reshape(-1, 3)
    arrays = {
        **{
            "bead": range(4),
            "walker": [0, 0, 1, 1],
            "large": [1, 0] * 2,
            "radius (m)": [3e-4, 2e-4] * 2,
        },
        **{"velocity (m/s)": velocity, "speed (m/s)": np.linalg.norm(velocity, axis=1)},
        "omega (rad/s)": moved.spin[frame].reshape(-1, 3),
    }
    assert set(beads.point_data) == {*arrays}
    for name, values in arrays.items():
        np.testing.assert_allclose(beads.point_data[name], values)
    floors = [pv.read(collection.parent / f"boundary_{number:06d}.vtu") for number in (0, frame)]
    np.testing.assert_allclose(
        floors[1].points - floors[0].points, np.tile(shift, (4, 1)), atol=1e-12
    )
    assert np.linalg.norm(shift) > 1e-5
    assert floors[0].bounds[4:] == pytest.approx([0.0, 0.0], abs=1e-15)


def test_bridges_are_lines_with_force_and_gap(
    directory: Path, moved: Group, collection: Path
) -> None:
    bridges, table = (
        meshio.read(collection.parent / "bridges_000010.vtu"),
        read_table(directory, "bridges"),
    )
    rows = table[np.isclose(table["time"], moved.time[10])]
    # Rows are sorted by walkers and contacts, lines are not.
    cells = {name.partition(" ")[0]: values for name, (values,) in bridges.cell_data.items()}
    contacts = [(0, -1), (1, -1), (0, 1), (2, -1), (3, -1), (2, 3)]
    lines = [tuple(pair) for pair in np.column_stack([cells["bead_1"], cells["bead_2"]]).tolist()]
    order = np.array([lines.index(pair if pair in lines else pair[::-1]) for pair in contacts])
    for name in ("gap", "normal_force", "walker", "wall"):
        np.testing.assert_allclose(cells[name][order], rows[name])
    np.testing.assert_array_equal(cells["touching"][order], rows["gap"] <= 0.0)
    ends = bridges.points[bridges.cells_dict["line"]][order]
    centres = pv.read(collection.parent / "beads_000010.vtu").points
    np.testing.assert_allclose(ends[:, 0], centres[cells["bead_1"][order]], atol=1e-12)
    np.testing.assert_allclose(ends[[0, 1, 3, 4], 1, 2], moved.motion.substrate[10, 2], atol=1e-12)
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    np.testing.assert_allclose(length - [3e-4, 2e-4, 5e-4] * 2, rows["gap"], atol=1e-10)


def test_walkers_are_exported_side_by_side_once_a_cycle_with_the_script_that_shows_them(
    directory: Path, moved: Group, tmp_path: Path
) -> None:
    collection = walkers.load(directory).export("vtk", tmp_path / "vtk")
    script = files("walkers.postprocess.show").joinpath("show.py.txt").read_bytes()
    assert collection.with_name("show.py").read_bytes() == script
    np.testing.assert_allclose(pv.get_reader(collection).time_values, np.arange(9) / 80.0)
    points = [pv.read(collection.parent / f"beads_{frame:06d}.vtu").points for frame in (0, 160)]
    walked = (points[1] - points[0]).reshape(2, 2, 3)
    np.testing.assert_allclose(walked, moved.position[160] - moved.position[0], atol=1e-12)
    assert np.ptp(points[0][:, 1]) < 4e-3 < np.ptp(read_motion(directory).position[0, ..., 1])
    assert np.ptp(points[0][:, 0]) < 1e-3  # in a row, wherever they stood
    view = json.loads(ElementTree.parse(collection).getroot().attrib["view"])
    assert (view["colour"], view["neck"]) == ("walker", pytest.approx(9e-5))


_LISTS = '<DataSet timestep="0.0" part="0" file="{}" />'
_FOREIGN: list[dict[str, str]] = [
    {"turbine_0001.vtu": "x", "turbine.pvd": "x"},
    {"beads_000000.vtu": "x", "show.py": "x"},
    {"walkers.pvd": _LISTS.format("turbine.vtu"), "turbine.vtu": "x"},
    {
        "walkers.pvd": _LISTS.format("beads_000000.vtu"),
        "beads_000000.vtu": "x",
        "beads_000001.vtu": "x",
    },
]
"""Files of others: of VTK, named as ours without a collection, in another collection, and not in it."""


def test_an_export_replaces_its_own_files_alone(directory: Path, tmp_path: Path) -> None:
    place = tmp_path / "vtk"
    for foreign in _FOREIGN:
        place.mkdir()
        for file, text in foreign.items():
            (place / file).write_text(text)
        with pytest.raises(InputError, match="expected a new or empty folder"):
            write_vtk(directory, place)
        assert {path.name: path.read_text() for path in place.iterdir()} == foreign
        shutil.rmtree(place)
    for every in (80, 160):  # an earlier export is replaced
        write_vtk(directory, place, every=every)
        assert len(list(place.glob("beads_*.vtu"))) == 160 // every + 1
    (tmp_path / "link").symlink_to(place)
    for wrong, told in (
        (place / "walkers.pvd", "it is a file"),
        (tmp_path / "link", "it is a symbolic link"),
    ):
        with pytest.raises(InputError, match=told):
            write_vtk(directory, wrong)


def test_a_lammps_dump_holds_the_motion(directory: Path, motion: Motion, tmp_path: Path) -> None:
    path = walkers.load(directory).export("lammps", tmp_path / "here" / "walk.lammpstrj", every=4)
    written = motion.select(slice(None, None, 4))
    frames = [text.split("ITEM: ") for text in path.read_text().split("ITEM: TIMESTEP\n")[1:]]
    steps, counts, _, tables = zip(*frames, strict=True)
    np.testing.assert_allclose(
        np.array(steps, int) * motion.case.run.time_step, written.time, atol=1e-12
    )
    assert {text.split()[-1] for text in counts} == {"4"}
    columns = tables[0].split()[1:14]
    assert columns == [
        "id",
        "type",
        "mol",
        "radius",
        "x",
        "y",
        "z",
        "vx",
        "vy",
        "vz",
        "omegax",
        "omegay",
        "omegaz",
    ]
    rows = np.array([text.split("\n", 1)[1].split() for text in tables], dtype=float).reshape(
        len(steps), 4, 13
    )
    np.testing.assert_array_equal(
        rows[0, :, :4], [[1, 1, 1, 0.3], [2, 2, 1, 0.2], [3, 1, 2, 0.3], [4, 2, 2, 0.2]]
    )
    for first, values in (
        (4, 1e3 * written.position),
        (7, 1e3 * written.velocity),
        (10, written.spin),
    ):
        np.testing.assert_allclose(rows[..., first : first + 3], values, rtol=1e-9, atol=1e-12)


def test_figures_of_runs_come_in_other_formats_and_can_be_printed(
    directory: Path, tmp_path: Path
) -> None:
    paths = plot_run(directory, tmp_path, "pdf,svg")
    names = [f"{name}.{form}" for name in ("walk", "gait") for form in ("pdf", "svg")]
    assert [path.name for path in paths] == names
    assert all(directory.name.encode() in path.read_bytes() for path in paths)
    pdf = paths[0].read_bytes()
    assert b"/FontFile2" in pdf  # TrueType, embedded
    assert b"/Type3" not in pdf
    assert not list(tmp_path.glob("*.new"))
    figures = figures_of(read_results(directory))
    assert [spoilt(figure) + letters(figure) for figure in figures.values()] == [
        ["a", "b", "c"],
        [],
    ]
    looks = line_styles([str(number) for number in range(MOST_NAMED + 3)])
    assert (
        len({(look["linestyle"], look["marker"], look["color"]) for look in looks[:MOST_NAMED]})
        == MOST_NAMED
    )
    assert [look.get("label") for look in looks[MOST_NAMED:]] == ["and 3 more", None, None]


def test_gaits_are_smooth_and_go_through_the_samples(directory: Path) -> None:
    (axes,) = figures_of(read_results(directory))["gait"].axes
    trajectory = read_table(directory, "trajectory").query("walker == 0")
    for line, name in zip(axes.lines, ("velocity", "rotation_1", "rotation_2"), strict=False):
        cycle, values = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        samples = trajectory[trajectory["cycle"] >= cycle[0] - 1e-9]
        assert len(cycle) == 10 * (len(samples) - 1) + 1
        np.testing.assert_allclose(values[::10], 1e3 * samples[name], atol=1e-9)
        assert np.abs(np.diff(values, 2)).max() < 0.5 * np.abs(np.diff(values[::10], 2)).max()


@pytest.mark.parametrize("shape", ["random", "with a flat part", "constant", "three samples"])
def test_smooth_curves_are_those_of_scipy(shape: str) -> None:
    """Its modified Akima interpolation takes half a second to import."""
    generator = np.random.default_rng(7)
    places = np.cumsum(generator.uniform(0.1, 2.0, 3 if shape == "three samples" else 40))
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
        "import sys; from pathlib import Path; from walkers.postprocess.show.figures import plot_run\n"
        "plot_run(Path(sys.argv[1]), Path(sys.argv[2]))\n"
        "print({'scipy', 'pandas', 'pyarrow.dataset'} & {*sys.modules})"
    )
    command = [sys.executable, "-c", script, str(directory), str(tmp_path)]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "set()\n"


@pytest.fixture(scope="module")
def motion(directory: Path) -> Motion:
    return read_motion(directory).driven


@pytest.fixture(scope="module")
def single(motion: Motion) -> Motion:
    return motion.of_walkers(motion.walkers[:1])


def _ruby(picture: np.ndarray, share: float = 1.3, least: int = 0) -> np.ndarray:
    """Where a picture is red."""
    return (picture[..., 0] > share * picture[..., 1].astype(float)) & (picture[..., 0] > least)


def test_rendering_shows_ruby_beads_on_a_grey_floor_and_cuts_nothing(
    directory: Path, tmp_path: Path
) -> None:
    (path,) = walkers.load(directory).render(tmp_path / "walker.png", images=2)
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert 0.02 < np.mean(_ruby(pixels, 1.8, 60)) < 0.5
    assert np.mean(np.ptp(pixels, axis=-1) < 25) > 0.4
    assert all((edge == 255).all() for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]))


@pytest.mark.parametrize(
    ("tilt", "labels"),
    [(0.0, ["x (mm)", "y (mm)"]), (0.1, ["across the slope (mm)", "uphill (mm)"])],
)
def test_axes_of_a_picture_say_which_way_is_uphill(
    tilt: float, labels: list[str], motion: Motion
) -> None:
    on_slope = replace(motion, case=motion.case.with_value_at("boundary.tilt", tilt))
    (axes,) = _series_figure(on_slope, [0], follow=False).axes
    assert [axes.get_xlabel(), axes.get_ylabel()] == labels


def test_a_neck_is_where_a_bridge_is_and_gone_when_it_ruptured(pile_run: Path) -> None:
    """Of two beads of a pile, whose numbers there are others; a picture between two frames shows the nearest ones."""
    pile = read_motion(pile_run).driven
    held = [
        {tuple(pair) for pair in np.sort(bridges.beads).tolist()} for bridges in read_bridges(pile)
    ]
    frame, pair = next(
        (frame, min(gone)) for frame in range(len(held)) if (gone := held[frame] - held[frame + 1])
    )
    pile = pile.select(beads=np.array(pair))
    before, nearest, after = bridges_at(pile, [frame, frame + 0.4, frame + 1])
    assert [0, 1, -1] in before.tolist() and [0, 1, -1] not in after.tolist()
    np.testing.assert_array_equal(before, nearest)
    axes = axes_toward(
        np.cross(np.diff(pile.position[frame], axis=0)[0], [0.0, 0.0, 1.0]),
        np.array([0.0, 0.0, 1.0]),
    )
    seen = 1e3 * pile.position[frame : frame + 2] @ axes.T
    scene = Scene(
        pile, axes, seen.min(axis=(0, 1)) - 0.3, seen.max(axis=(0, 1)) + 0.3, shaken=False
    )
    with closing(Window(scene, (300, 300))) as window:
        shown = ((frame + 1, after), (frame, after), (frame, before), (frame, NO_BRIDGES))
        pictures = [window.picture(*one) for one in shown]
    *without, wet, dry = [
        np.count_nonzero(each[..., 2] > 1.5 * each[..., 0].astype(float)) for each in pictures
    ]
    assert wet > 20 + max(*without, dry)


@pytest.mark.parametrize(
    ("gap", "meniscus"), [(0.0, None), (5e-6, None), (2e-5, None), (5e-6, 2e-5)]
)
def test_a_neck_has_the_volume_of_its_bridge(
    gap: float, meniscus: float | None, motion: Motion
) -> None:
    """Within what spheres differ from parabolas; a neck at a plane too, and one whose meniscus gives the volume."""
    if meniscus:
        liquid = motion.case.liquid.with_values(volume_fraction=None, meniscus_radius=meniscus)
        motion = replace(motion, case=motion.case.with_values(liquid=liquid))
    for contact in ([0, 1, -1], [0, -1, 0]):
        radius, other = motion.radius[0], motion.radius[1] if contact[1] > 0 else 0.0
        place = np.array(
            [[0.0, 0.0, radius + gap], [radius + gap + motion.radius[1], 0.0, radius + gap]]
        )
        begins, ends = bridge_ends(motion, place, np.array([contact]))
        points, _ = neck_surfaces(motion, np.array([contact]), Ends(begins, ends), NeckGrid(65, 64))
        length = np.linalg.norm(ends - begins)
        assert length == pytest.approx(radius + gap + other)
        height = (1e-3 * points[0] - begins[0]) @ (ends - begins)[0] / length
        width = np.linalg.norm(
            1e-3 * points[0] - begins - np.outer(height, (ends - begins)[0] / length), axis=1
        )
        step, wide = height.reshape(65, 64)[:, 0], width.reshape(65, 64)[:, 0]
        assert step[0] == pytest.approx(
            np.sqrt(radius**2 - wide[0] ** 2)
        )  # on the surface of the bead
        inside = np.maximum(radius**2 - step**2, 0.0) + np.maximum(
            other**2 - (length - step) ** 2, 0.0
        )
        volume = np.pi * np.trapezoid(wide**2 - inside, step)
        assert volume == pytest.approx(
            bridge_at_rest(motion.case, radius, other or np.inf).surfaces.volume, rel=0.3, abs=0.0
        )


def test_pictures_are_as_far_apart_as_the_slow_motion_says(motion: Motion) -> None:
    times = film_times(motion, FilmOptions(slowdown=20.0))
    np.testing.assert_allclose(np.diff(times.time), 1.0 / 500.0, atol=1e-12)
    np.testing.assert_allclose(
        times.frame * np.median(np.diff(motion.time)), times.time, atol=1e-12
    )
    assert film_times(motion, FilmOptions()).slowdown == 100.0  # 0.1 s in ten seconds
    for slowdown in (1.0, 5.0):  # of a cycle of 12.5 ms, pictures 40 and 8 ms apart
        strobed = film_times(motion, FilmOptions(slowdown=slowdown))
        cycles = strobed.time * motion.case.excitation.frequency
        assert strobed.stroboscopic and not times.stroboscopic
        np.testing.assert_allclose(cycles, np.round(cycles), atol=1e-9)
    part = film_times(motion, FilmOptions(slowdown=20.0, begin=0.02, end=0.05))
    assert (part.time[0], len(part.time)) == (pytest.approx(0.02), 16)


def test_a_scale_bar_is_as_long_as_beads_say(single: Motion) -> None:
    """The red of one bead, seen without perspective, is as wide and as high as its diameter in pixels."""
    bead = single.select(slice(1), beads=np.array([0]))
    bead = replace(bead, walkers=(replace(single.walkers[0], beads=(0,)),))
    with closing(
        Window(Scene.around(bead, camera_axes(bead), 1.2, shaken=False), (400, 300))
    ) as window:
        picture = window.picture(0).astype(int)
    for places in np.nonzero(_ruby(picture)):
        assert np.ptp(places) + 1 == pytest.approx(
            2e3 * bead.radius[0] * window.pixels_per_mm, abs=2.5
        )


@pytest.mark.parametrize(("meet", "seen"), [(True, [-2.0, -2.0]), (False, [-2.0, 0.0])])
def test_a_closed_tray_is_seen_from_above(meet: bool, seen: list[float], single: Motion) -> None:
    boundary = single.case.boundary.with_values(shape="box", width=4e-3, height=3e-3)
    case = single.case.with_values(boundary=boundary).with_value_at("dimers.meet", meet)
    tray = replace(
        single, position=single.position - np.array([*single.walkers[0].origin, 0.0]), case=case
    )
    axes = camera_axes(tray)
    assert axes[2, 2] == float(meet)
    np.testing.assert_allclose(Scene.around(tray, axes, shaken=False).low[:2], seen, atol=1e-2)


@pytest.mark.parametrize(("lengths", "follows"), [(0.5, False), (40.0, True)])
def test_the_camera_follows_a_walker_that_walks_far(
    lengths: float, follows: bool, single: Motion
) -> None:
    """Its beads are as large in the picture as without the way, and in the middle of it."""
    way = lengths * single.case.walkers[0].length * single.time / single.time[-1]
    far = replace(
        single, position=single.position + way[:, None, None] * np.array(single.case.drive_axis)
    )
    scene = Scene.around(far, camera_axes(far), 1.2, shaken=False).following(1.5, 1.2)
    assert (scene.camera_path is not None) == follows
    if follows:
        assert np.linalg.norm(scene.camera_displacement(len(far.time) - 1)) == pytest.approx(
            1e3 * way[-1], rel=0.05
        )
    with closing(Window(scene, (300, 200))) as window:
        pictures = [_ruby(window.picture(frame)) for frame in (0, len(far.time) - 1)]
    assert all(ruby.mean() > 0.07 and not ruby[:, [0, -1]].any() for ruby in pictures)


def test_an_mp4_shows_a_walker_that_walks_and_a_gif_lasts_as_long_as_it_says(
    directory: Path, tmp_path: Path
) -> None:
    path = tmp_path / "here" / "walk.mp4"
    done = call(
        "render",
        "--film",
        str(directory),
        "--to",
        str(path),
        "--size",
        "360p",
        "--fps",
        "10",
        "--slowdown",
        "10",
    )
    assert (done.returncode, done.stdout.strip()) == (0, str(path))
    about, *frames = imageio_ffmpeg.read_frames(str(path))
    assert (about["size"], about["fps"], len(frames)) == ((640, 360), 10.0, 11)
    ruby = [_ruby(np.frombuffer(each, np.uint8).reshape(360, 640, 3), 2.0, 60) for each in frames]
    assert all(0.02 < one.mean() < 0.4 for one in ruby)
    assert (ruby[0] != ruby[-1]).mean() > 0.01
    options = [
        "--size",
        "160x90",
        "--fps",
        "20",
        "--slowdown",
        "1e1",
        "--end",
        "50 ms",
        "--walker",
        "1",
    ]
    call(
        "render", "--film", str(directory), "--to", str(tmp_path / "walk.gif"), *options, check=True
    )
    film = Image.open(tmp_path / "walk.gif")
    assert (film.size, film.n_frames, film.info["duration"], film.info["loop"]) == (
        (160, 90),
        11,
        50,
        0,
    )


@pytest.mark.parametrize(
    ("boundary", "faces", "edges"),
    [
        (Boundary(material="glass"), 1, 4),
        (Boundary(shape="channel", material="glass", width=2e-3), 3, 8),
        (Boundary(shape="box", material="glass", width=2e-3, height=4e-3), 5, 4),
        (Boundary(shape="cylinder", material="glass", width=2e-3, height=4e-3), 65, 64),
    ],
)
def test_walls_are_whole_wherever_the_beads_are(
    motion: Motion, boundary: Boundary, faces: int, edges: int
) -> None:
    """Beads high above the floor of a container, or far from the middle of what has no end; seams are at the ends."""
    away = [0.0, 0.0, 2e-3] if boundary.closed else [5e-2, 0.0, 0.0]
    beads = 0.1 * (motion.position - motion.position.mean(axis=(0, 1))) + away
    placed = replace(motion, position=beads, case=motion.case.with_values(boundary=boundary))
    walls = mesh_of(walls_of(placed)).clean(tolerance=1e-9, absolute=True)
    assert (walls.n_cells, walls.bounds[4]) == (faces, pytest.approx(0.0, abs=1e-12))
    assert walls.n_open_edges == edges
    triangles = _walls(placed)
    first, second, third = triangles.points[triangles.cells_dict["triangle"]].swapaxes(0, 1)
    assert np.linalg.norm(
        np.cross(second - first, third - first), axis=1
    ).sum() / 2.0 == pytest.approx(walls.area)


@pytest.mark.slow
def test_pvpython_shows_spheres_bridges_and_floor(directory: Path, tmp_path: Path) -> None:
    """With ParaView and Xvfb, 1.4 GB, which ``make test-slow`` installs."""
    collection = walkers.load(directory).export("vtk", tmp_path / "vtk")
    script = (
        collection.parent.rename(tmp_path / "moved") / "show.py"
    )  # the files are found beside it
    picture = tmp_path / "walkers.png"
    command = ["xvfb-run", "-a", "pvpython", str(script), str(picture), "0.05"]
    for _ in range(3):  # under load it may not wait long enough for its screen
        picture.exists() or subprocess.run(command, timeout=300, check=False, cwd=tmp_path)
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(int)
    for first, last in ((0, 2), (2, 0)):  # each walker
        assert (
            0.005
            < ((pixels[..., first] > 1.5 * pixels[..., last]) & (pixels[..., first] > 60)).mean()
            < 0.5
        )
    assert (np.ptp(pixels - [199, 209, 217], axis=-1) < 12).mean() > 0.1  # the floor
    assert (pixels[:60, :200].max(axis=-1) < 80).sum() > 50  # the time
