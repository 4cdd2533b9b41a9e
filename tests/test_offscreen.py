"""Pictures on machines that cannot draw without a screen."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import PROGRAM, SHORT
from walkers.postprocess.show.offscreen import PACKAGES, WINDOW


@pytest.fixture(scope="module")
def finished_run(run_directory: Callable[..., Path]) -> Path:
    """A run of two beads."""
    return run_directory(run=SHORT)


@pytest.fixture
def without_egl(tmp_path: Path) -> dict[str, str]:
    """An environment in which the library EGL cannot be loaded."""
    libraries = tmp_path / "libraries"
    libraries.mkdir()
    for name in ("libEGL.so", "libEGL.so.1"):
        (libraries / name).write_bytes(b"")  # found first, and refused by the loader
    return {**os.environ, "LD_LIBRARY_PATH": str(libraries)}


def rendered(
    run: Path, to: Path, environment: dict[str, str], *options: str
) -> subprocess.CompletedProcess[str]:
    """Render a run in an environment."""
    command = [PROGRAM, "render", str(run), *options, "--to", str(to)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("options", "name"), [([], "a.png"), (["--film"], "a.mp4")])
def test_a_machine_without_egl_is_told_what_to_install(
    options: list[str],
    name: str,
    finished_run: Path,
    without_egl: dict[str, str],
    tmp_path: Path,
) -> None:
    done = rendered(finished_run, tmp_path / name, without_egl, *options)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("walkers: pictures: need OpenGL without a screen")
    assert line.endswith(f"sudo apt-get install {PACKAGES}")
    assert not (tmp_path / name).exists()


def test_a_window_that_the_user_chose_is_tried(finished_run: Path, tmp_path: Path) -> None:
    """OSMesa cannot be loaded; that EGL can does not matter."""
    environment = {**os.environ, WINDOW: "vtkOSOpenGLRenderWindow"}
    environment["LD_LIBRARY_PATH"] = str(tmp_path)
    for version in ("", ".6", ".8"):
        (tmp_path / f"libOSMesa.so{version}").write_bytes(b"")
    done = rendered(finished_run, tmp_path / "a.png", environment)
    assert done.returncode == 2
    assert "by EGL or OSMesa" in done.stderr


def test_packages_are_those_of_the_installation() -> None:
    page = (Path(__file__).parents[1] / "docs" / "how-to" / "install.md").read_text("utf-8")
    makefile = (Path(__file__).parents[1] / "Makefile").read_text("utf-8")
    assert PACKAGES in page
    assert PACKAGES in makefile
