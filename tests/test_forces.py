"""Forces, limits of the time step and the paper's numbers against published formulas."""

import pytest

from tests.conftest import make_case
from walkers.inputs import load_case
from walkers.inputs.loads import contact_loads, dimer_of
from walkers.inputs.run_tables import limits_of
from walkers.physics.contact import hertz_overlap, reduced_modulus
from walkers.physics.time_step import AUTO_FRACTIONS, LONGEST_WALKER_STEP, WALKER_FRACTIONS, fit_into_cycle


def test_hertz_overlap_carries_the_load() -> None:
    modulus = reduced_modulus(5e7, 0.3)
    overlap = hertz_overlap(3e-5, 2e-4, modulus)
    assert 4.0 / 3.0 * modulus * (2e-4) ** 0.5 * overlap**1.5 == pytest.approx(3e-5)


def test_published_gamma0() -> None:
    """Of the walker of Fig. 2 at 2 to 6 g, and of those of Fig. 4."""
    for acceleration, gamma0 in ((2, 0.191), (3, 0.286), (4, 0.381), (5, 0.476), (6, 0.572)):
        case = make_case(drive={"peak_acceleration": f"{acceleration} g"})
        assert dimer_of(case).gamma0(case.drive.peak_acceleration) == pytest.approx(gamma0, abs=6e-4)
    for name, gamma0 in (("fig4a", 0.74), ("fig4b", 3.5)):
        case = load_case(name)
        assert dimer_of(case).gamma0(case.drive.peak_acceleration) == pytest.approx(gamma0, rel=0.01)


def test_time_step_limits_of_the_walker() -> None:
    """By hand for R 0.2 mm, ρ 4000, E 50 MPa, ν 0.3: π R √(ρ/G)/(0.1631 ν + 0.8766) = 9.79 µs."""
    case = make_case()
    limits = limits_of(case)
    assert limits.rayleigh == pytest.approx(9.79e-6, rel=1e-3)
    assert limits.rayleigh < limits.hertz < limits.viscous


def test_viscous_limit_rules_in_glycerol() -> None:
    """The glycerol climber is wrong at 6 µs and converged at 2 µs: the limit lies between, auto below 2.1 µs."""
    case = make_case(
        beads={"material": "glass"},
        dimers={"radii": ["0.545 mm", "0.3075 mm"]},
        liquid={"name": "glycerol 87 %"},
        drive={"frequency": "170 Hz", "peak_acceleration": "16.2 g"},
    )
    limits = limits_of(case)
    assert 2e-6 < limits.viscous < 6e-6
    assert limits.exceeded_by(6e-6) == ["viscous"]
    assert case.run.time_step < 2.1e-6


@pytest.mark.parametrize("name", ["fig1b", "fig4a", "symmetric", "pile-small"])
def test_auto_respects_every_limit_with_margin(name: str) -> None:
    """And is no shorter than that asks for: loose beads by their own shares, walkers at most 4 µs."""
    case = load_case(name)
    limits = limits_of(case).as_dict()
    shares = AUTO_FRACTIONS if case.loose else WALKER_FRACTIONS
    assert shares.keys() == limits.keys()
    assert all(0.0 < share <= 0.5 for share in shares.values())
    allowed = min(share * limits[limit] for limit, share in shares.items())
    longest = allowed if case.loose else min(allowed, LONGEST_WALKER_STEP)
    assert LONGEST_WALKER_STEP == 4e-6
    # A cycle is so many whole samples of whole steps: a little less than what is allowed.
    assert 0.97 * longest < case.run.time_step <= longest


def test_a_step_that_divides_the_cycle_is_taken_as_it_is() -> None:
    assert fit_into_cycle(2e-6, 80.0, 10) == (2e-6, 6250)
    assert fit_into_cycle(2e-6, 80.0, 20)[1] == 6260


def test_overlap_at_rest_is_a_thousandth_of_a_radius() -> None:
    case = make_case()
    assert all(1e-4 < overlap / 2e-4 < 2e-3 for overlap in contact_loads(case).overlaps)
