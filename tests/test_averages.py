"""Means of rotation, sliding and open contacts: from 20 samples a cycle what far more of them give."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from walkers.inputs import resolve_case, shipped_cases
from walkers.inputs.case import Case
from walkers.inputs.reading import read_toml
from walkers.postprocess.gait import Averages, averages, gait, gaps, settled_samples
from walkers.postprocess.motion import Group


@pytest.fixture(scope="module")
def groups(trajectory: Callable[..., Group]) -> dict[int, Group]:
    return {samples: trajectory(_hopping(samples)) for samples in (20, 200)}


def _hopping(samples: int, **run: object) -> Case:
    """Fig. 4b's walker, whose beads part in every cycle."""
    tables = read_toml(shipped_cases()["fig4b"])
    tables["dimers"]["replicates"] = 1
    tables["run"] = {"time_step": "3 us", "cycles": 12, "settling_cycles": 4, "samples_per_cycle": samples, **run}
    return resolve_case(tables, source="test", name=f"hopping-{samples}")


def _sampled(group: Group) -> Averages:
    """The same from the samples alone."""
    seen, samples = gait(group), settled_samples(group)
    means = (seen.rotation[samples], seen.sliding[samples], seen.gap[samples] > 0.0)
    return Averages(*(one.mean(axis=0) for one in means))


def test_means_do_not_depend_on_how_often_is_looked(groups: dict[int, Group]) -> None:
    """Rotation and sliding within 0.5 % of the fastest, open contacts within a sample of 200."""
    few, many = averages(groups[20]), averages(groups[200])
    scale = float(np.abs(many.sliding).max())
    np.testing.assert_allclose(few.rotation, many.rotation, atol=5e-3 * scale)
    np.testing.assert_allclose(few.sliding, many.sliding, atol=5e-3 * scale)
    np.testing.assert_allclose(few.open, many.open, atol=0.01)
    # What many samples say by themselves is near it, what few say is not.
    near, far = _sampled(groups[200]), _sampled(groups[20])
    np.testing.assert_allclose(near.sliding, many.sliding, atol=1e-2 * scale)
    assert np.abs(far.sliding - many.sliding).max() > 5e-3 * scale
    assert np.abs(far.open - many.open).max() > 5e-3


def test_with_few_samples_a_cycle_gaps_are_looked_at_there_alone(groups: dict[int, Group]) -> None:
    """A cubic over a quarter of a cycle or more is no way of a bead that hops."""
    few = groups[20]
    run = replace(few.case.run, samples_per_cycle=4)
    motion = replace(few.motion, case=replace(few.case, run=run))
    names = ("time", "position", "velocity", "spin", "substrate", "substrate_velocity", "mean_spin")
    motion = replace(motion, **{name: getattr(motion, name)[::5] for name in names}, frames=motion.frames[::5])
    thinned = Group(motion, few.make, few.walkers)
    samples = settled_samples(thinned)
    np.testing.assert_array_equal(averages(thinned).open, (gaps(thinned)[samples] > 0.0).mean(axis=0))


def test_a_run_in_parts_has_the_same_means(groups: dict[int, Group], trajectory: Callable[..., Group]) -> None:
    """The first frame of a part, of which nothing is averaged yet, is the last one of the part before."""
    parts = trajectory(_hopping(20, segment="0.05 s"))
    assert len({segment for segment, _ in parts.motion.frames}) == 3
    assert parts.motion.mean_spin is not None
    assert np.abs(parts.motion.mean_spin[1:]).max(axis=(1, 2)).min() > 0.0
    whole, found = averages(groups[20]), averages(parts)
    scale = float(np.abs(whole.sliding).max())
    np.testing.assert_allclose(found.rotation, whole.rotation, atol=1e-2 * scale)
    np.testing.assert_allclose(found.sliding, whole.sliding, atol=1e-2 * scale)
