"""Replicates: walkers in one deck are independent, perturbed, and bitwise repeatable."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkers.inputs import load_case
from walkers.inputs.case import Case
from walkers.postprocess.gait import walk
from walkers.postprocess.motion import Group
from walkers.runner import find_engine, launch
from walkers.runner.directory import write_deck
from walkers.templates import render_deck


@pytest.fixture(scope="module")
def ensemble() -> Case:
    """The shipped walker of Fig. 1b, six replicates, ten cycles."""
    case = load_case("fig1b")
    return replace(case, run=replace(case.run, cycles=10, settling_cycles=4, until_steady=False))


def test_walkers_of_an_ensemble_move_as_they_do_alone(trajectory: Callable[..., Group], ensemble: Case) -> None:
    together = trajectory(ensemble)
    alone = trajectory(replace(ensemble, walkers=(replace(ensemble.walkers[0], replicates=1),)))
    way_together = together.position[:, 0] - together.position[0, 0].mean(axis=0)
    way_alone = alone.position[:, 0] - alone.position[0, 0].mean(axis=0)
    assert np.abs(way_together - way_alone).max() < 3e-6 * np.abs(way_alone).max()
    assert walk(together).velocity[0] == pytest.approx(walk(alone).velocity[0], rel=1e-6)


def test_replicates_are_perturbed_and_keep_their_distance(trajectory: Callable[..., Group], ensemble: Case) -> None:
    moved = trajectory(ensemble)
    assert [walker.facing for walker in moved.walkers] == [1, -1, 1, -1, 1, -1]
    angles = [walker.start_angle for walker in moved.walkers]
    assert len(set(angles)) == 6
    assert max(map(abs, angles)) <= np.radians(1.0)
    np.testing.assert_allclose(moved.orientation[0], angles, atol=1e-12)
    overlaps = moved.radii[0] - moved.position[0, :, 0, 2]
    assert len(set(overlaps)) == 6
    assert np.all(overlaps > 0.0)
    centre = moved.mass_centre[..., :2]
    first, second = np.triu_indices(6, 1)
    assert np.linalg.norm(centre[:, first] - centre[:, second], axis=-1).min() > 0.5 * ensemble.walkers[0].spacing
    other = {walker.start_angle for walker in render_deck(replace(ensemble, seed=2)).layout.walkers}
    assert not other & set(angles)


def test_reporting_bridges_does_not_disturb_the_walkers(tmp_path: Path, ensemble: Case) -> None:
    """The engine evaluates contacts once more to report them; that must leave no trace in the motion."""
    deck = render_deck(ensemble)
    reports = ("compute pair_bridges", "dump pairs", "dump walls", "dump_modify pairs", "dump_modify walls")
    silent = [line for line in deck.text.splitlines() if not " ".join(line.split()).startswith(reports)]
    assert len(silent) == len(deck.text.splitlines()) - len(reports)
    dumps = []
    for name, text in (("reporting", deck.text), ("silent", "\n".join(silent) + "\n")):
        directory = tmp_path / name
        directory.mkdir()
        frames = deck.layout.bridge_frames if name == "reporting" else 0
        changed = replace(deck, text=text, layout=replace(deck.layout, bridge_frames=frames))
        write_deck(changed, directory)
        launch(changed, directory, find_engine())
        dumps.append((directory / "beads.bin").read_bytes())
    assert (tmp_path / "reporting" / "bridges.pairs.txt").exists()
    assert not (tmp_path / "silent" / "bridges.pairs.txt").exists()
    assert dumps[0] == dumps[1]
