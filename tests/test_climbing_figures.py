"""The maps of what stands on a wall and the pictures of clusters, from shipped sweeps with fewer points and cycles."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.conftest import run_shipped, shipped_sweep
from tests.printed import letters, spoilt
from walkers.paper.climbing import KINDS, kinds
from walkers.paper.make import FIGURES
from walkers.paper.sources import Sources
from walkers.postprocess.drawing import save_figure

RADII = [["0.545 mm", "0.3075 mm"], ["0.545 mm", "0.3075 mm", "0.3075 mm"]]
FEWER: dict[str, dict[str, Any]] = {
    "climb-friction": {"liquid.viscosity_ratio": [1, 2]},
    "climb-tilt": {"boundary.tilt": ["20 deg", "90 deg"], "liquid.viscosity_ratio": [1]},
    "zoo": {},
    "zoo-corner": {"clusters[0].radii": RADII},
}
BRIEF = {"clusters[0].replicates": 1, "run.cycles": 2, "run.settling_cycles": 0, "run.samples_per_cycle": 1}


@pytest.fixture(scope="module")
def sources(once: Callable[[str, Callable[[Path], object]], Path]) -> Sources:
    return Sources(once("climbing", _run_briefly))


def _run_briefly(out: Path) -> None:
    for name, axes in FEWER.items():
        given = shipped_sweep(name, BRIEF, axes)
        if name == "climb-friction":
            given["zip"][0] = {f"contact.friction.bead_{other}": [0.3, 0.5] for other in ("wall", "bead")}
        run_shipped(name, given, out)


@pytest.mark.parametrize("name", ["climbing", "zoo"])
def test_they_are_drawn_only_if_asked_for_and_say_what_they_were_made_from(
    sources: Sources, tmp_path: Path, name: str
) -> None:
    drawing = FIGURES[name]
    assert drawing.only_asked
    figure = drawing.draw(sources)
    paths = save_figure(figure, tmp_path / name, sources.runs(*drawing.sweeps), ("png",), drawing.title)
    assert paths[0].stat().st_size > 1e4
    assert spoilt(figure) == []
    assert len(letters(figure)) == {"climbing": 6, "zoo": 15}[name]
    drawn = [axes for axes in figure.axes if axes.collections or axes.patches]
    assert len(drawn) >= {"climbing": 6, "zoo": 15}[name]


def test_what_climbers_do_is_told_by_the_worst_of_them() -> None:
    table = pd.DataFrame(
        {
            "turned_round": [0, 0, 0, 0, 1],
            "upright": [4, 4, 4, 3, 3],
            "walkers": 4,
            "axial_velocity": [1e-3, 1e-5, -1e-3, 1e-3, 0.0],
        }
    )
    assert [KINDS[kind] for kind in kinds(table)] == list(KINDS)
    assert kinds(table).dtype == np.int64
