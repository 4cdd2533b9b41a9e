"""Trajectories for other programs, read back with ASE; the script for ParaView, run by pvpython where there is one."""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ase.io import read
from PIL import Image

from tests.conftest import call
from walkers.postprocess import Motion, read_motion
from walkers.postprocess.trajectory_files import box_of


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    return run_directory(dimers={"replicates": 2}, run={"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20})


@pytest.fixture(scope="module")
def motion(directory: Path) -> Motion:
    return read_motion(directory).driven


def test_ase_reads_the_extended_xyz(directory: Path, motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "here" / "walk.xyz"
    done = call("export", str(directory), "--to", str(path), "--every", "4", check=True)
    assert done.stdout.strip() == str(path)
    frames = read(path, ":")
    assert len(frames) == 41
    for number, one in enumerate(frames):
        frame = 4 * number
        np.testing.assert_allclose(one.positions, 1e3 * motion.position[frame], rtol=0.0, atol=6e-9)
        np.testing.assert_allclose(one.arrays["velo"], 1e3 * motion.velocity[frame], rtol=0.0, atol=6e-9)
        np.testing.assert_allclose(one.arrays["omega"], motion.spin[frame], rtol=0.0, atol=6e-9)
        assert one.info["Time"] == pytest.approx(motion.time[frame], abs=1e-12)
        assert not one.pbc.any()
    np.testing.assert_array_equal(frames[0].arrays["radius"], [0.3, 0.2, 0.3, 0.2])
    np.testing.assert_array_equal(frames[0].arrays["walker"], [0, 0, 1, 1])
    np.testing.assert_array_equal(frames[0].arrays["large"], [1, 0, 1, 0])
    np.testing.assert_array_equal(frames[0].arrays["id"], [1, 2, 3, 4])
    low, high = box_of(motion.select(slice(None, None, 4)))
    np.testing.assert_allclose(frames[0].cell.lengths(), high - low)
    np.testing.assert_allclose(frames[0].info["Origin"], low)


def test_ase_reads_the_lammps_dump(directory: Path, motion: Motion, tmp_path: Path) -> None:
    path = tmp_path / "walk.lammpstrj"
    call("export", str(directory), "--to", str(path), check=True)
    frames = read(path, ":", format="lammps-dump-text", units="si")  # ASE makes Å of m, and of the numbers as well
    assert len(frames) == len(motion.time)
    for frame in (0, 7, 160):
        np.testing.assert_allclose(1e-10 * frames[frame].positions, 1e3 * motion.position[frame], rtol=1e-9, atol=1e-12)
    header, *rows = path.read_text().split("ITEM: ATOMS ")[8].splitlines()
    columns = header.split()
    table = np.array([row.split() for row in rows[: len(motion.radius)]], dtype=np.float64)
    for first, values in (("radius", 1e3 * motion.radius[:, None]), ("vx", 1e3 * motion.velocity[7])):
        begin = columns.index(first)
        np.testing.assert_allclose(table[:, begin : begin + values.shape[1]], values, rtol=1e-9)
    begin = columns.index("omegax")
    np.testing.assert_allclose(table[:, begin : begin + 3], motion.spin[7], rtol=1e-9)
    np.testing.assert_array_equal(table[:, :3], [[1, 1, 1], [2, 2, 1], [3, 1, 2], [4, 2, 2]])
    steps = [int(text.split()[0]) for text in path.read_text().split("ITEM: TIMESTEP\n")[1:]]
    np.testing.assert_allclose(np.array(steps) * motion.case.run.time_step, motion.time, atol=1e-12)


def test_other_formats_are_refused(directory: Path, tmp_path: Path) -> None:
    done = call("export", str(directory), "--to", str(tmp_path / "walk.dcd"))
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert "expected the name of a .xyz, .extxyz or .lammpstrj file" in done.stderr
    assert not list(tmp_path.iterdir())


def test_the_script_for_paraview_is_beside_its_files(directory: Path, tmp_path: Path) -> None:
    folder = tmp_path / "vtk"
    for _ in range(2):  # a folder that it wrote may be written again
        done = call("paraview", str(directory), "--to", str(folder), check=True)
    script = Path(done.stdout.strip())
    assert (script.parent, (folder / "walkers.pvd").is_file()) == (folder, True)
    compile(script.read_text(), script, "exec")
    refused = call("paraview", str(directory), "--to", str(folder), "--colour", "beauty")
    assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
    assert "expected one of bead, large, omega, radius, speed, velocity, walker" in refused.stderr


def test_pvpython_shows_spheres_bridges_and_floor(directory: Path, tmp_path: Path) -> None:
    program, screen = shutil.which("pvpython"), shutil.which("xvfb-run")
    if program is None or screen is None:
        pytest.skip("pvpython (Debian: paraview, python3-paraview) and xvfb-run (xvfb) are not both installed")
    script = Path(call("paraview", str(directory), "--to", str(tmp_path / "vtk"), check=True).stdout.strip())
    script = script.parent.rename(tmp_path / "moved") / script.name  # the files are found beside it
    picture = tmp_path / "walkers.png"
    command = [screen, "-a", program, str(script), str(picture), "0.05"]
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
