"""Shared by the tests: cases built from the walker of Fig. 2, run by the real engine, each once a session."""

from __future__ import annotations

import copy
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from inputs import resolve_case
from inputs.case import WalkerCase
from postprocess.gait import Walk, walk
from postprocess.trajectory import Trajectory, read_trajectory
from walkers import run_case

# The walker of the published tables: R 0.3/0.2 mm, Si AK5, 80 Hz, no rolling friction, one walker that starts on the
# axis in equilibrium.
REFERENCE: dict[str, Any] = {
    "beads": {"radii": ["0.3 mm", "0.2 mm"], "material": "ruby"},
    "liquid": {
        "name": "Si AK5",
        "volume_fraction": 0.01,
        "viscosity_ratio": 1.0,
        "film_drag_ratio": 0.0,
        "contact_angle": "0 deg",
    },
    "substrate": {"material": "chromium-coated glass"},
    "contact": {
        "friction": {"bead_bead": 0.1, "bead_wall": 0.1},
        "rolling_friction": 0.0,
        "restitution": 0.3,
        "youngs_modulus": "50 MPa",
        "minimum_separation_ratio": 0.01,
    },
    "drive": {"frequency": "80 Hz", "peak_acceleration": "4 g"},
    "start": {"replicates": 1, "angle_spread": "0 deg", "gap_spread": 0.0},
}
# The user's cache is not ours to read or write: audits of the engine are kept there.
os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp(prefix="walkers-tests-")

PROGRAM = str(Path(sys.executable).with_name("walkers"))
SHORT = {"cycles": 6, "settling_cycles": 2, "samples_per_cycle": 10}


def document(**changes: Any) -> dict[str, Any]:
    """The reference case with changes such as ``drive={"frequency": "60 Hz"}`` merged into its tables."""
    merged = copy.deepcopy(REFERENCE)
    for table, values in changes.items():
        if isinstance(values, dict):
            merged.setdefault(table, {}).update(values)
        else:
            merged[table] = values
    return merged


def make_case(**changes: Any) -> WalkerCase:
    """`document`, resolved."""
    return resolve_case(document(**changes), name="test")


def to_toml(values: dict[str, Any]) -> str:
    """A nested document as TOML text; JSON's strings and numbers are TOML's."""
    plain = {key: value for key, value in values.items() if not isinstance(value, dict)}
    lines = [f"{key} = {_inline(value)}" for key, value in plain.items()]
    for key, value in values.items():
        if isinstance(value, dict):
            lines += [f"[{key}]", *(f"{name} = {_inline(entry)}" for name, entry in value.items())]
    return "\n".join(lines) + "\n"


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_inline(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


@pytest.fixture(scope="session")
def runs_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the session's runs are kept, so that no case is run twice."""
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="session")
def run_directory(runs_folder: Path) -> Callable[..., Path]:
    """Run the changed reference case (or a given one) and return its run directory."""

    def run(case: WalkerCase | None = None, **changes: Any) -> Path:
        return run_case(case or make_case(**changes), runs_folder).run.directory

    return run


@pytest.fixture(scope="session")
def trajectory(run_directory: Callable[..., Path]) -> Callable[..., Trajectory]:
    """Run and read the trajectory."""

    def run(case: WalkerCase | None = None, **changes: Any) -> Trajectory:
        return read_trajectory(run_directory(case, **changes))

    return run


@pytest.fixture(scope="session")
def walked(trajectory: Callable[..., Trajectory]) -> Callable[..., Walk]:
    """Run and fit the velocities."""

    def run(case: WalkerCase | None = None, **changes: Any) -> Walk:
        return walk(trajectory(case, **changes))

    return run


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    yield tmp_path


def engines_in(directory: Path) -> list[int]:
    """Process ids of the engines that work in a directory or below."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # gone by now, or none of ours
            command, folder = (process / "cmdline").read_bytes(), (process / "cwd").resolve()
            # Not ldd, which asks what the engine is linked to.
            if b"liggghts" in command and b"\0-in\0" in command and folder.is_relative_to(directory):
                found.append(int(process.name))
    return found


def wait_for(condition: Callable[[], Any], seconds: float = 60.0) -> Any:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.02)
    raise AssertionError("waited in vain")
