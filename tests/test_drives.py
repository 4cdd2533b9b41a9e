"""Drives of one harmonic and of several, and planes that are tilted, by the real engine."""

from collections.abc import Callable
from dataclasses import replace
from math import cos, pi, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import document, make_case
from walkers.inputs import load_case, resolve_case
from walkers.inputs.boundary import Plane
from walkers.inputs.case import Case
from walkers.inputs.drive import Drive, Harmonic, common_frequency
from walkers.postprocess import read_result

BRIEF = {"cycles": 20, "settling_cycles": 8, "samples_per_cycle": 10}


def shipped(**changes: Any) -> Any:
    """The shipped walker of Fig. 1b, one of it, briefly."""
    case = load_case("fig1b")
    walkers = replace(case.walkers[0], replicates=1, facing="right", angle_spread=0.0, gap_spread=0.0)
    run = replace(case.run, cycles=20, settling_cycles=8, until_steady=False, cycles_per_segment=20)
    return replace(case, walkers=(walkers,), run=run, **changes)


@pytest.mark.parametrize(
    ("frequencies", "common"),
    [([80.0], 80.0), ([80.0, 160.0], 80.0), ([60.0, 90.0], 30.0), ([90.0, 60.0, 40.0], 10.0), ([0.1, 0.3], 0.1)],
)
def test_a_cycle_is_the_common_period(frequencies: list[float], common: float) -> None:
    assert common_frequency(frequencies) == pytest.approx(common, rel=1e-12)


def test_frequencies_without_a_cycle_are_refused() -> None:
    for other in (80.0 * 25, 80.0 * 2**0.5, 81.3):
        with pytest.raises(ValueError, match="no ratio of whole numbers"):
            common_frequency([80.0, other])
    with pytest.raises(ValueError, match="common period"):
        common_frequency([1.0, 23 / 24, 22 / 23, 21 / 22, 19 / 20, 17 / 18])


def test_a_drive_is_its_largest_harmonic_where_one_number_is_asked_for() -> None:
    drive = Drive((Harmonic((1.0, 0.0, 0.0), 160.0, 10.0), Harmonic((0.0, 0.0, 1.0), 80.0, 30.0, 1.0)), "container")
    assert (drive.direction, drive.peak_acceleration, drive.frequency) == ((0.0, 0.0, 1.0), 30.0, 80.0)
    assert [one.peak_acceleration for one in drive.with_peak(60.0).harmonics] == [20.0, 60.0]
    case = replace(make_case(), drive=drive)
    assert Case.from_dict(case.as_dict()) == case


def test_one_harmonic_is_the_drive_that_its_keys_describe() -> None:
    written = document(run=BRIEF)
    written["drive"] = {"harmonics": [{"frequency": "80 Hz", "peak_acceleration": "4 g", "axis": "x"}]}
    assert resolve_case(written, name="test") == make_case(run=BRIEF)


def test_a_phase_and_an_axis_aslant_change_the_start_and_not_the_walk(run_directory: Callable[..., Path]) -> None:
    speeds = [
        read_result(run_directory(make_case(run=BRIEF, drive=drive)))["velocity"]["mean"]
        for drive in ({"frame": "container"}, {"frame": "container", "phase": "90 deg"}, {"axis": [1, 1, 0]})
    ]
    assert speeds[1:] == pytest.approx([speeds[0]] * 2, rel=0.02)


def test_a_triangle_is_the_sum_of_its_harmonics() -> None:
    """Of the acceleration: odd harmonics as 1/k², within 4 % of the peak everywhere and 1 % on the flanks."""
    case = make_case(drive={"waveform": "triangle"})
    assert [one.frequency for one in case.drive.harmonics] == [80.0, 240.0, 400.0, 560.0, 720.0]
    assert case.drive.frame == "container"
    cycle = np.linspace(0.0, 1.0, 401)
    phases = [one.angular_frequency * cycle / 80.0 + one.phase for one in case.drive.harmonics]
    summed = sum(one.peak_acceleration * np.sin(phase) for one, phase in zip(case.drive.harmonics, phases, strict=True))
    triangle = 39.2 * 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * cycle))
    assert np.abs(summed - triangle).max() < 0.045 * 39.2
    flank = np.abs(triangle) < 0.8 * 39.2
    assert np.abs(summed - triangle)[flank].max() < 0.01 * 39.2


def _two_tone(phase: float) -> Drive:
    x = (1.0, 0.0, 0.0)
    return Drive((Harmonic(x, 80.0, 39.2), Harmonic(x, 160.0, 29.4, phase)), "container")


def test_two_tones_move_a_symmetric_dimer_and_their_phase_says_which_way(run_directory: Callable[..., Path]) -> None:
    """f + 2f breaks the symmetry under half a period; shifted by π, 2f is the mirrored drive. Measured: ∓2.28 mm/s."""
    case = shipped()
    case = replace(case, walkers=(replace(case.walkers[0], radii=(0.25e-3, 0.25e-3)),))

    def speed(drive: Drive) -> float:
        return float(read_result(run_directory(replace(case, drive=drive)))["velocity"]["mean"])

    one_way, other_way = speed(_two_tone(pi / 2.0)), speed(_two_tone(1.5 * pi))
    assert one_way == pytest.approx(-2.28e-3, rel=0.03)
    assert other_way == pytest.approx(-one_way, rel=0.01)
    assert abs(speed(case.drive)) < 1e-6
    assert abs(speed(_two_tone(0.0))) < 0.1 * abs(one_way)


@pytest.mark.parametrize(("tilt", "uphill"), [(0.0, 0.0), (30.0, 0.0), (90.0, 0.0), (30.0, 90.0), (90.0, 180.0)])
def test_gravity_on_a_plane(tilt: float, uphill: float) -> None:
    found = Plane(material="glass", tilt=radians(tilt), uphill=radians(uphill)).gravity(9.81)
    way = (cos(radians(uphill)), sin(radians(uphill)))
    down = 9.81 * sin(radians(tilt))
    np.testing.assert_allclose(found, (-down * way[0], -down * way[1], -9.81 * cos(radians(tilt))), atol=1e-14)
    assert (found[2] == 0.0) == (tilt == 90.0)
    assert shipped(boundary=Plane(material="glass", tilt=radians(tilt), uphill=radians(uphill))).goes_uphill == (
        tilt > 0.0 and uphill == 0.0
    )


TILTS = {0.0: 1.080, 5.0: 0.605, 10.0: 0.135, 20.0: -8.0}
"""Speeds up the slope, mm/s, measured: the walker's falls with the tilt and changes sign between 10° and 20°."""


@pytest.mark.parametrize("tilt", TILTS)
def test_a_walker_walks_up_a_slope_until_it_is_too_steep(tilt: float, run_directory: Callable[..., Path]) -> None:
    case = shipped(boundary=Plane(material="chromium-coated glass", tilt=radians(tilt)))
    result = read_result(run_directory(case))
    if TILTS[tilt] > 0.0:
        assert result["velocity"]["mean"] == pytest.approx(TILTS[tilt] * 1e-3, rel=0.03)
    else:
        assert result["axial_velocity"]["right_facing"] < 0.0
