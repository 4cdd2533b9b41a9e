"""Packing: which points travel together, and that all cores finish together."""

import random

import pytest

from tests.conftest import make_case
from walkers.inputs.case import Case
from walkers.inputs.sweep import load_sweep
from walkers.sweeps.packing import LONGEST_SECONDS, MOST_WALKERS, makespan, pack, unfinished_parts
from walkers.templates import render_deck
from walkers.templates.deck import render_shared_deck
from walkers.templates.scene import sharing_key

STEP = {"time_step": "2 us"}


def _numbered(*cases: Case) -> dict[int, Case]:
    return dict(enumerate(cases))


def test_what_may_differ_within_a_deck() -> None:
    same = [
        make_case(run=STEP),
        make_case(run={**STEP, "seed": 2}, dimers={"angle": "30 deg", "replicates": 3}),
        make_case(run=STEP, dimers={"radii": ["0.35 mm", "0.2 mm"]}),
        make_case(run=STEP, contact={"friction": {"bead_bead": 0.2, "bead_wall": 0.05}}),
        make_case(run=STEP, contact={"restitution": 0.6}),
        make_case(run=STEP, drive={"peak_acceleration": "5 g"}),
        make_case(run=STEP, drive={"axis": "y"}),
        make_case(run=STEP, boundary={"tilt": "20 deg"}),
        make_case(run=STEP, environment={"gravity": "0 m/s^2"}),
        make_case(run=STEP, liquid={"viscosity_ratio": 2.0}),
    ]
    assert len({sharing_key(case) for case in same}) == 1
    render_shared_deck(same)
    assert render_shared_deck(same[:1]) == render_deck(same[0])
    others = [
        make_case(run=STEP, drive={"frequency": "60 Hz"}),
        make_case(run=STEP, drive={"phase": "90 deg"}),
        make_case(run=STEP, contact={"rolling_friction": 0.003}),
        make_case(run=STEP, contact={"youngs_modulus": "40 MPa"}),
        make_case(run=STEP, beads={"density": "3.9 g/cm^3"}),
        make_case(run={**STEP, "cycles": 30}),
        make_case(run={"time_step": "1 us"}),
        # Walls that move do so for all.
        make_case(run=STEP, drive={"frame": "lab"}),
        make_case(run=STEP, drive={"frame": "lab", "peak_acceleration": "5 g"}),
        make_case(run=STEP, drive={"frame": "lab"}, environment={"gravity": "0 m/s^2"}),
    ]
    assert len({sharing_key(case) for case in [same[0], *others]}) == 1 + len(others)
    rough = [make_case(run=STEP, contact={"rolling_friction": value}) for value in (0.003, 0.006)]
    assert len({sharing_key(case) for case in rough}) == 1
    with pytest.raises(ValueError, match="cannot share"):
        render_shared_deck([same[0], others[0]])


@pytest.mark.parametrize("workers", [1, 2, 16])
@pytest.mark.parametrize("sweep", ["fig2", "fig3", "alignment", "modes"])
def test_every_point_travels_once_and_cores_finish_together(sweep: str, workers: int) -> None:
    cases = _numbered(*load_sweep(sweep).cases())
    decks = pack(cases, workers)
    assert sorted(point for deck in decks for point in deck.points) == list(cases)
    for deck in decks:
        assert len({sharing_key(cases[point]) for point in deck.points}) == 1
        assert len(deck.points) == 1 or sum(cases[point].walkers[0].replicates for point in deck.points) <= MOST_WALKERS
        assert len(deck.points) == 1 or deck.seconds <= LONGEST_SECONDS
    seconds = [deck.seconds for deck in decks]
    assert seconds == sorted(seconds, reverse=True)
    # Within a fifth of the time in which no core would ever be idle, unless a single deck takes longer than that.
    assert makespan(seconds, workers) <= max(1.2 * sum(seconds) / workers, seconds[0])


def test_sharing_is_cheaper_than_a_deck_each_and_more_cores_share_less() -> None:
    cases = _numbered(*(make_case(run={**STEP, "seed": seed}) for seed in range(48)))
    alone = sum(deck.seconds for number, case in cases.items() for deck in pack({number: case}, 1))
    assert sum(deck.seconds for deck in pack(cases, 2)) < 0.35 * alone
    assert len(pack(cases, 2)) < len(pack(cases, 16))


def test_what_is_left_of_a_deck_is_made_of_its_halves() -> None:
    cases = _numbered(*(make_case(run={**STEP, "seed": seed}) for seed in range(13)))
    points = tuple(cases)
    halves_of_halves = {points}
    for _ in range(4):
        halves_of_halves |= {
            half
            for part in halves_of_halves
            for half in (part[: len(part) // 2], part[len(part) // 2 :])
            if 0 < len(half) < len(part)
        }
    draw = random.Random(1)
    for _ in range(50):
        finished = {point for point in points if draw.random() < 0.3}
        left = unfinished_parts(points, cases, finished.__contains__)
        assert sorted(point for deck in left for point in deck.points) == sorted(set(points) - finished)
        assert {deck.points for deck in left} <= halves_of_halves
