"""Films: moments and places, beads that roll, what is written, read back with ffmpeg and Pillow."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from tests.conftest import call
from walkers.inputs.boundary import Boundary
from walkers.postprocess import read_motion
from walkers.postprocess.films import FilmOptions, film_times
from walkers.postprocess.motion import Motion
from walkers.postprocess.scene import Scene, Window, camera_axes, mesh_of, walls_of


@pytest.fixture(scope="module")
def directory(run_directory: Callable[..., Path]) -> Path:
    return run_directory(dimers={"replicates": 2}, run={"cycles": 8, "settling_cycles": 2, "samples_per_cycle": 20})


@pytest.fixture(scope="module")
def motion(directory: Path) -> Motion:
    return read_motion(directory).driven


def test_places_between_frames_lie_on_the_motion(motion: Motion) -> None:
    """Each second frame, predicted from its neighbours, to a hundredth of what it moves meanwhile."""
    between = motion.select(slice(None, None, 2)).between(0.5).position
    errors = np.abs(between - motion.position[1::2]).max(axis=(1, 2))[20:60]
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
    cycles = strobed.time * motion.case.drive.frequency
    assert strobed.stroboscopic
    np.testing.assert_allclose(cycles, np.round(cycles), atol=1e-9)
    part = film_times(motion, FilmOptions(slowdown=20.0, begin=0.02, end=0.05))
    assert (part.time[0], len(part.time)) == (pytest.approx(0.02), 16)


def test_a_scale_bar_is_as_long_as_beads_say(motion: Motion) -> None:
    """The red of one bead, seen without perspective, is as wide and as high as its diameter in pixels."""
    single = motion.of_walkers(motion.walkers[:1]).select(slice(1))
    single = replace(single.select(beads=np.array([0])), walkers=(replace(single.walkers[0], beads=(0,)),))
    window = Window(Scene.around(single, camera_axes(single), 1.2, shaken=False), (400, 300))
    picture = window.picture(0).astype(int)
    window.close()
    diameter = 2e3 * motion.radius[0] * window.pixels_per_mm
    for places in np.nonzero(picture[..., 0] > 1.3 * picture[..., 1]):
        assert np.ptp(places) + 1 == pytest.approx(diameter, abs=2.5)


def test_up_in_the_picture_is_up_against_gravity(motion: Motion) -> None:
    for degrees in (0.0, 10.0, 90.0):
        boundary = replace(motion.case.boundary, tilt=np.radians(degrees))
        tilted = replace(motion, case=replace(motion.case, boundary=boundary))
        right, up, toward = axes = camera_axes(tilted)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        gravity = np.array(tilted.case.gravity_vector)
        assert right @ gravity == pytest.approx(0.0, abs=1e-9)
        assert up @ gravity < 0.0
        assert toward[2] > 0.5  # nobody looks from below


def test_an_mp4_shows_a_walker_that_walks_and_a_gif_lasts_as_long_as_it_says(directory: Path, tmp_path: Path) -> None:
    path = tmp_path / "here" / "walk.mp4"
    done = call("film", str(directory), "--to", str(path), "--size", "360p", "--fps", "10", "--slowdown", "10")
    assert (done.returncode, done.stdout.strip()) == (0, str(path))
    about, *read = imageio_ffmpeg.read_frames(str(path))
    assert (about["size"], about["fps"], len(read)) == ((640, 360), 10.0, 11)
    pictures = [np.frombuffer(each, np.uint8).reshape(360, 640, 3).astype(int) for each in read]
    ruby = [(one[..., 0] > 2.0 * one[..., 1]) & (one[..., 0] > 60) for one in pictures]
    assert all(0.02 < one.mean() < 0.4 for one in ruby)
    assert (ruby[0] != ruby[-1]).mean() > 0.01
    options = ["--size", "160x90", "--fps", "20", "--slowdown", "10", "--until", "0.05 s", "--walker", "1"]
    call("film", str(directory), "--to", str(tmp_path / "walk.gif"), *options, check=True)
    film = Image.open(tmp_path / "walk.gif")
    assert (film.size, film.n_frames, film.info["duration"], film.info["loop"]) == ((160, 90), 11, 50, 0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--to", "walk.avi"], "expected the name of a .mp4 or .gif file"),
        (["--to", "walk.gif", "--fps", "30"], "expected 1, 2, 4, 5, 10, 20, 25 or 50 for a GIF"),
        (["--size", "333x201"], "expected even numbers for an MP4"),
        (["--size", "wide"], "expected 360p, 480p, 720p, 1080p"),
        (["--walker", "2"], "expected less than 2"),
        (["--from", "soon"], 'expected a time such as "0.1 s"'),
        (["--from", "0.2 s"], "expected times within the drive, 0 to 0.1 s"),
        (["--from", "0.05 s", "--until", "0.05 s"], "expected times within the drive, 0 to 0.1 s"),
    ],
)
def test_what_cannot_be_filmed_is_told_in_a_line(directory: Path, options: list[str], message: str) -> None:
    done = call("film", str(directory), *options)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert message in done.stderr
    assert not (directory / "film.mp4").exists()


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
    moved = replace(motion, position=0.1 * (beads - away) + away, case=replace(motion.case, boundary=boundary))
    walls = mesh_of(walls_of(moved)).clean(tolerance=1e-9, absolute=True)
    assert (walls.n_cells, walls.bounds[4]) == (faces, pytest.approx(0.0, abs=1e-12))
    assert walls.n_open_edges == edges
