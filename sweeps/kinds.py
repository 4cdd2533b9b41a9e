"""What sweeps have to know of the kinds of cases: what a run of each costs, where it belongs, what its table shows."""

from __future__ import annotations

from collections.abc import Hashable
from math import nan
from pathlib import Path
from typing import Any

from walkers.inputs.dimer import dimer_of
from walkers.inputs.pile import PileCase
from walkers.inputs.reading import AnyCase
from walkers.postprocess.tables import WALKERS
from walkers.runner.cost import predicted_seconds
from walkers.runner.pile_summary import predicted_pile_seconds
from walkers.runner.segments import is_pile
from walkers.templates.sharing import sharing_key

_WALKER_DERIVED = {
    "gamma0": ("", "dimensionless peak force Γ0 = a0 M/(4πγR̄)"),
    "sin_delta": ("", "asymmetry parameter (R1 - R2)/(R1 + R2)"),
    "mass_asymmetry": ("", "μ = (m1 - m2)/M"),
    "frequency": ("Hz", "of the drive"),
    "peak_acceleration": ("m/s^2", "of the substrate"),
    "peak_velocity": ("m/s", "of the substrate"),
    "amplitude": ("m", "of the substrate's displacement"),
    "radius_1": ("m", "of bead 1"),
    "radius_2": ("m", "of bead 2"),
}
_PILE_DERIVED = {
    "beads": ("", "number of beads"),
    "large": ("", "number of large beads"),
    "frequency": ("Hz", "of the drive"),
    "peak_acceleration": ("m/s^2", "of the container"),
    "peak_velocity": ("m/s", "of the container"),
    "amplitude": ("m", "of the container's displacement"),
    "duration": ("s", "shaken"),
}
_WALKER_RESULTS = {
    "velocity": ("m/s", "mean over the walkers, along the heading, positive toward the large bead"),
    "smallest": ("m/s", "velocity of the slowest walker"),
    "largest": ("m/s", "velocity of the fastest walker; the paper's error bar is largest minus smallest"),
    "standard_error": ("m/s", "of the velocity"),
    "right_facing": ("m/s", "mean velocity of the walkers that started facing right"),
    "left_facing": ("m/s", "mean velocity of the walkers that started facing left"),
    # Means over the walkers of what the table of a run says of each.
    **{
        name: WALKERS[name]
        for name in WALKERS
        if name.startswith(("rotation_", "sliding_", "open_", "separated_fraction"))
    },
    "orientation_end": ("rad", "mean orientation at the end"),
    "walkers": ("", "replicates"),
    "steady": ("", "how many of them are steady"),
    "turned_round": ("", "how many of them turned by more than 90 degrees"),
    "walkers_met": ("", "whether two of them came near each other"),
}
_PILE_RESULTS = {
    "climbs": ("", "clusters that climbed a wall"),
    "onset": ("s", "when the first of them began"),
    "speed": ("m/s", "mean of their speeds"),
    "highest": ("m", "height that the highest of them reached"),
    "led_by_large": ("", "how many of them were led by a large bead"),
    "clusters": ("", "clusters that were free of the pile and held to a wall for a while"),
    "surface_end": ("m", "height of the pile's surface at the end"),
    "brazil_nut_end": ("", "Brazil-nut index at the end"),
    "settling": ("s", "before the drive"),
}

DERIVED = {"walker": _WALKER_DERIVED, "pile": _PILE_DERIVED}
"""What follows from a point's case, by the kind of the sweep: unit and meaning."""
RESULTS = {"walker": _WALKER_RESULTS, "pile": _PILE_RESULTS}
"""Columns that a finished run gives, by the kind of the sweep: unit and meaning."""


def kind_of(case: AnyCase) -> str:
    """Which table a sweep of such cases has."""
    return "pile" if isinstance(case, PileCase) else "walker"


def sharing_of(case: AnyCase) -> Hashable:
    """Cases with equal keys may share a deck; piles share none."""
    return case if isinstance(case, PileCase) else sharing_key(case)


def replicates_of(case: AnyCase) -> int:
    """How many walkers a case brings into a deck."""
    return 1 if isinstance(case, PileCase) else case.start.replicates


def ranks_of(case: AnyCase) -> int:
    """How many cores a deck of the case takes."""
    return case.run.ranks if isinstance(case, PileCase) else 1


def seconds_of(case: AnyCase, walkers: int | None = None) -> float:
    """Predicted wall time of a deck, s."""
    return predicted_pile_seconds(case) if isinstance(case, PileCase) else predicted_seconds(case, walkers)


def derived_of(case: AnyCase) -> list[float]:
    """The columns of `DERIVED`."""
    drive = case.drive
    if isinstance(case, PileCase):
        beads = [float(sum(case.beads.counts)), float(case.beads.counts[1])]
        seconds = case.run.cycles / drive.frequency
        return [*beads, drive.frequency, drive.peak_acceleration, drive.peak_velocity, drive.amplitude, seconds]
    dimer = dimer_of(case)
    return [
        dimer.gamma0(drive.peak_acceleration),
        dimer.sin_delta,
        dimer.mass_asymmetry,
        drive.frequency,
        drive.peak_acceleration,
        drive.peak_velocity,
        drive.amplitude,
        *case.beads.radii,
    ]


def current_result_of(directory: Path) -> dict[str, Any]:
    """The result of a finished run, tabulated anew if need be."""
    from walkers.postprocess.pile_result import current_pile_result
    from walkers.postprocess.result import current_result

    return (current_pile_result if is_pile(directory) else current_result)(directory)


def velocity_in(result: dict[str, Any]) -> float:
    """Mean velocity of walkers, m/s; NaN for a pile."""
    return float(result["velocity"]["mean"]) if "velocity" in result else nan


def columns_of(result: dict[str, Any]) -> dict[str, Any]:
    """The columns of `RESULTS` of one run."""
    if "climbs" in result:
        return _pile_columns(result)
    velocity = result["velocity"]
    return {
        "velocity": velocity["mean"],
        **{name: velocity[name] for name in ("smallest", "largest", "standard_error")},
        **{name: result[name]["mean"] for name in ("right_facing", "left_facing", "orientation_end")},
        **{f"rotation_{bead}": result["rotation"][f"bead_{bead}"] for bead in (1, 2)},
        **{f"{what}_{at}": result[what][f"contact_{at}"] for what in ("sliding", "open") for at in (1, 2, 3)},
        **{name: result[name] for name in ("separated_fraction", "walkers", "steady", "turned_round", "walkers_met")},
    }


def _pile_columns(result: dict[str, Any]) -> dict[str, Any]:
    climbs = result["climbs"]
    speeds = [climb["speed"] for climb in climbs if climb["speed"] is not None]
    return {
        "climbs": len(climbs),
        "onset": min((climb["begin"] for climb in climbs), default=nan),
        "speed": sum(speeds) / len(speeds) if speeds else nan,
        "highest": max((climb["height"] for climb in climbs), default=nan),
        "led_by_large": sum(climb["leader_large"] for climb in climbs),
        "clusters": result["clusters"],
        "surface_end": result["surface"]["end"],
        "brazil_nut_end": result["brazil_nut"]["end"],
        "settling": result["settling"],
    }
