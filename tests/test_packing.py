"""Packing: which points travel together, and that all cores finish together."""

import random

import pytest

from tests.conftest import make_case
from walkers.inputs.sweep import load_sweep
from walkers.sweeps.scheduler import LONGEST_SECONDS, MOST_WALKERS, makespan, pack, unfinished_parts
from walkers.templates.deck import render_shared_deck
from walkers.templates.scene import sharing_key

STEP = {"time_step": "2 us"}


def test_what_may_differ_within_a_deck() -> None:
    changes = [
        {"run": {"seed": 2}, "dimers": {"angle": "30 deg", "replicates": 3}},
        {"dimers": {"radii": ["0.35 mm", "0.2 mm"]}},
        {"contact": {"friction": {"bead_bead": 0.2, "bead_wall": 0.05}, "restitution": 0.6}},
        {"drive": {"peak_acceleration": "5 g", "axis": "y"}},
        {"boundary": {"tilt": "20 deg"}},
        {"environment": {"gravity": "0 m/s^2"}},
        {"liquid": {"viscosity_ratio": 2.0}},
    ]
    same = [make_case(**{**one, "run": {**STEP, **one.get("run", {})}}) for one in [{}, *changes]]
    assert len({sharing_key(case) for case in same}) == 1
    render_shared_deck(same)
    apart = [
        {"drive": {"frequency": "60 Hz"}},
        {"drive": {"phase": "90 deg"}},
        {"contact": {"rolling_friction": 0.003}},
        {"contact": {"youngs_modulus": "40 MPa"}},
        {"beads": {"density": "3.9 g/cm^3"}},
        {"run": {"cycles": 30}},
        {"run": {"time_step": "1 us"}},
        # Walls that move do so for all.
        {"drive": {"frame": "lab"}},
        {"drive": {"frame": "lab", "peak_acceleration": "5 g"}},
        {"drive": {"frame": "lab"}, "environment": {"gravity": "0 m/s^2"}},
    ]
    others = [make_case(**{**one, "run": {**STEP, **one.get("run", {})}}) for one in apart]
    assert len({sharing_key(case) for case in [same[0], *others]}) == 1 + len(others)
    rough = [make_case(run=STEP, contact={"rolling_friction": value}) for value in (0.003, 0.006)]
    assert len({sharing_key(case) for case in rough}) == 1
    with pytest.raises(ValueError, match="cannot share"):
        render_shared_deck([same[0], others[0]])


@pytest.mark.parametrize("workers", [1, 16])
@pytest.mark.parametrize("sweep", ["fig2", "fig3", "alignment", "modes"])
def test_every_point_travels_once_and_cores_finish_together(sweep: str, workers: int) -> None:
    cases = dict(enumerate(load_sweep(sweep).cases()))
    decks = pack(cases, workers)
    assert sorted(point for deck in decks for point in deck.points) == list(cases)
    for deck in decks:
        assert len({sharing_key(cases[point]) for point in deck.points}) == 1
        walkers = sum(cases[point].walkers[0].replicates for point in deck.points)
        assert len(deck.points) == 1 or (walkers <= MOST_WALKERS and deck.seconds <= LONGEST_SECONDS)
    seconds = [deck.seconds for deck in decks]
    assert seconds == sorted(seconds, reverse=True)
    # Within a fifth of the time in which no core would ever be idle, unless a single deck takes longer than that.
    assert makespan(seconds, workers) <= max(1.2 * sum(seconds) / workers, seconds[0])


def test_sharing_is_cheaper_than_a_deck_each_and_more_cores_share_less() -> None:
    cases = dict(enumerate(make_case(run={**STEP, "seed": seed}) for seed in range(48)))
    alone = sum(deck.seconds for number, case in cases.items() for deck in pack({number: case}, 1))
    assert sum(deck.seconds for deck in pack(cases, 2)) < 0.35 * alone
    assert len(pack(cases, 2)) < len(pack(cases, 16))


def test_what_is_left_of_a_deck_is_made_of_its_halves() -> None:
    cases = dict.fromkeys(range(13), make_case(run=STEP))
    quarters = {(0, 6), (6, 13), (0, 3), (3, 6), (6, 9), (9, 13)}
    draw = random.Random(1)
    for _ in range(50):
        finished = {point for point in cases if draw.random() < 0.2}
        left = unfinished_parts(tuple(cases), cases, finished.__contains__)
        assert sorted(point for deck in left for point in deck.points) == sorted(set(cases) - finished)
        wide = {(deck.points[0], deck.points[-1] + 1) for deck in left if len(deck.points) > 2}
        assert wide <= {*quarters, (0, 13)}
