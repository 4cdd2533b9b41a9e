"""Figures, renderings and files for ParaView, read back."""

import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import pyvista as pv
from matplotlib import rcParams
from matplotlib.colors import to_rgb
from PIL import Image

from tests.printed import letters, spoilt
from walkers.inputs import InputError
from walkers.postprocess import Group, read_motion, read_table
from walkers.postprocess.analysis import figures_of, plot_run
from walkers.postprocess.drawing import series_look, styled
from walkers.postprocess.paraview import write_paraview, write_vtk
from walkers.postprocess.series import render_series


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    return run_directory(
        dimers={"replicates": 2, "angle_spread": "1 deg"},
        run={"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 10, "bridge_samples_per_cycle": 2},
    )


@pytest.fixture(scope="module")
def collection(directory: Path) -> Path:
    return write_vtk(directory, every=1, vtu=True, as_placed=True)


@pytest.fixture(scope="module")
def moved(directory: Path) -> Group:
    return read_motion(directory).groups[0]


def test_beads_and_floor_are_where_the_engine_put_them(moved: Group, collection: Path) -> None:
    sets = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    seconds = [float(entry.get("timestep", "nan")) for entry in sets if entry.get("part") == "0"]
    np.testing.assert_allclose(seconds, moved.time)
    reader = pv.get_reader(collection)
    reader.set_active_time_value(reader.time_values[-1])
    assert len(reader.read()) == 3
    frame = 13
    beads = pv.read(collection.parent / f"beads_{frame:06d}.vtp")
    shift = moved.motion.substrate[frame]
    np.testing.assert_allclose(beads.points, (moved.position[frame] + shift).reshape(-1, 3), rtol=1e-12)
    for name, values in {"radius": [3e-4, 2e-4] * 2, "walker": [0, 0, 1, 1], "large": [1, 0] * 2}.items():
        np.testing.assert_array_equal(beads[name], values)
    np.testing.assert_allclose(beads["velocity"], moved.velocity[frame].reshape(-1, 3))
    np.testing.assert_allclose(beads["omega"], moved.spin[frame].reshape(-1, 3))
    mesh = meshio.read(collection.parent / f"beads_{frame:06d}.vtu")
    np.testing.assert_allclose(mesh.points, beads.points)
    np.testing.assert_array_equal(mesh.point_data["radius"], beads["radius"])
    floors = [pv.read(collection.parent / f"boundary_{number:06d}.vtp") for number in (0, frame)]
    np.testing.assert_allclose(floors[1].points - floors[0].points, np.tile(shift, (4, 1)), atol=1e-12)
    assert np.linalg.norm(shift) > 1e-5
    low_x, high_x, low_y, high_y, *heights = floors[0].bounds
    assert (low_x, low_y) < tuple(moved.motion.position[..., :2].min(axis=(0, 1)))
    assert (high_x, high_y) > tuple(moved.motion.position[..., :2].max(axis=(0, 1)))
    assert heights == pytest.approx([0.0, 0.0], abs=1e-15)


def test_bridges_are_lines_with_force_and_gap(directory: Path, moved: Group, collection: Path) -> None:
    bridges = pv.read(collection.parent / "bridges_000010.vtp")
    table = read_table(directory, "bridges")
    rows = table[np.isclose(table["time"], moved.time[10])]
    ends = bridges.points[bridges.lines.reshape(-1, 3)[:, 1:]]
    # The table is sorted by walkers and contacts, the lines are not: a line is known by the beads that it joins.
    centres = pv.read(collection.parent / "beads_000010.vtp").points
    apart = np.linalg.norm(ends[:, :, None] - centres, axis=-1)
    joined = np.where(apart.min(axis=-1) < 1e-12, apart.argmin(axis=-1), -1)
    contacts = [(0, -1), (1, -1), (0, 1), (2, -1), (3, -1), (2, 3)]
    assert list(zip(rows["bead_1"], rows["bead_2"], strict=True)) == contacts
    lines = [tuple(sorted(line, key=lambda bead: (bead < 0, bead))) for line in joined.tolist()]
    order = [lines.index(contact) for contact in contacts]
    assert sorted(order) == list(range(6))
    for name in ("gap", "normal_force", "walker"):
        np.testing.assert_allclose(bridges.cell_data[name][order], rows[name])
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    np.testing.assert_allclose(length[order] - [3e-4, 2e-4, 5e-4] * 2, rows["gap"], atol=1e-10)
    # The engine reported bridges twice a cycle, beads ten times.
    assert [len(list(collection.parent.glob(f"{kind}_*.vtp"))) for kind in ("bridges", "beads")] == [17, 81]


def test_walkers_are_drawn_side_by_side_once_a_cycle_and_the_camera_sees_them(
    run_directory: Callable[..., Path], directory: Path, moved: Group, tmp_path: Path
) -> None:
    """Those of a run in segments too."""
    collection = write_vtk(directory, destination=tmp_path / "gathered")
    np.testing.assert_allclose(pv.get_reader(collection).time_values, np.arange(9) / 80.0)
    points = [pv.read(collection.parent / f"beads_{frame:06d}.vtp").points for frame in (0, 80)]
    walked = (points[1] - points[0]).reshape(2, 2, 3)
    np.testing.assert_allclose(walked, moved.position[80] - moved.position[0], atol=1e-12)
    assert np.ptp(points[0][:, 1]) < 4e-3 < np.ptp(moved.position[0, ..., 1])
    run = {"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 10, "segment": "0.05 s"}
    script = write_paraview(run_directory(dimers={"replicates": 2}, run=run), tmp_path / "vtk")
    (line,) = re.findall(r"view.CameraFocalPoint = \[(.*)\]", script.read_text())
    beads = pv.read(script.parent / "beads_000000.vtp").points
    np.testing.assert_allclose([float(one) for one in line.split(",")][:2], beads[:, :2].mean(axis=0), atol=1e-3)
    assert np.ptp(beads[:, 1]) < 4e-3


def test_a_folder_with_other_files_is_not_replaced(directory: Path, tmp_path: Path) -> None:
    mine = tmp_path / "thesis.txt"
    mine.write_text("years of work")
    for place in (tmp_path, mine):
        with pytest.raises(InputError, match="expected a new or empty folder"):
            write_vtk(directory, destination=place)
    assert mine.read_text() == "years of work"
    again = [write_vtk(directory, destination=tmp_path / "mine") for _ in range(2)]
    assert again[0] == again[1]


def test_figures_of_runs_come_in_other_formats_and_can_be_printed(
    directory: Path, run_directory: Callable[..., Path], tmp_path: Path
) -> None:
    paths = plot_run(directory, tmp_path, ["pdf", "svg", "png"])
    names = [f"{name}.{form}" for name in ("walk", "gait", "work") for form in ("pdf", "svg", "png")]
    assert [path.name for path in paths] == names
    assert all(directory.name.encode() in path.read_bytes() for path in paths)
    assert len(Image.open(paths[2]).convert("RGB").getcolors(maxcolors=1 << 24)) > 20
    strobed = run_directory(run={"cycles": 4, "settling_cycles": 1, "samples_per_cycle": 1})
    assert [path.name for path in plot_run(strobed, tmp_path)] == ["walk.png"]  # which shows no gait
    with pytest.raises(InputError, match="jpeg"):
        plot_run(directory, tmp_path / "none", ["jpeg"])
    assert not (tmp_path / "none").exists()
    figures = figures_of(directory)
    assert [spoilt(figures[name]) + letters(figures[name]) for name in ("walk", "gait")] == [
        ["a", "b", "c"],
        ["a", "b"],
    ]


def test_a_dozen_walkers_are_told_apart() -> None:
    """By dashes or marker; and neighbours by colour too, also by those who see no red or no green.

    Simulation of colour vision deficiency: Machado, Oliveira and Fernandes, doi.org/10.1109/TVCG.2009.113, severity 1.
    """
    looks = styled(lambda: [series_look(number) for number in range(12)])()
    assert len({(look["linestyle"], look["marker"]) for look in looks}) == 12
    colours = np.array([to_rgb(colour) for colour in styled(lambda: rcParams["axes.prop_cycle"].by_key()["color"])()])
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    protanopia = [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    deuteranopia = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    for seen in (np.eye(3), np.array(protanopia), np.array(deuteranopia)):
        shown = np.clip(linear @ seen.T, 0.0, 1.0) ** (1.0 / 2.4)
        apart = np.linalg.norm(shown[:, None] - shown, axis=-1)
        assert apart[np.triu_indices(len(shown), 1)].min() > 0.1


@pytest.mark.parametrize("apart", [None, 0.025])
def test_rendering_shows_ruby_beads_on_a_grey_floor_and_cuts_nothing(
    apart: float | None, directory: Path, tmp_path: Path
) -> None:
    (path,) = render_series(directory, tmp_path / "walker.png", images=3, apart=apart, walker=None if apart else 0)
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert 0.02 < np.mean((pixels[..., 0] > 1.8 * pixels[..., 1]) & (pixels[..., 0] > 60)) < 0.5
    assert np.mean(np.ptp(pixels, axis=-1) < 25) > 0.4
    assert all((edge == 255).all() for edge in (pixels[0], pixels[-1], pixels[:, 0], pixels[:, -1]))
