"""A 2-bead deck through the whole pipeline in a second or two: if this fails, nothing else is worth looking at."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import SHORT
from walkers.postprocess import read_result, read_table
from walkers.runner import finished_run

pytestmark = pytest.mark.smoke


def test_two_beads_walk_toward_the_large_one(run_directory: Callable[..., Path]) -> None:
    directory = run_directory(run=SHORT)
    run = finished_run(directory)
    assert run is not None
    assert run.manifest["engine"]["version"] == "LIGGGHTS-PUBLIC 3.8.0"
    assert 1e-3 < read_result(directory)["velocity"]["mean"] < 1e-2
    assert len(read_table(directory, "trajectory")) == 61
