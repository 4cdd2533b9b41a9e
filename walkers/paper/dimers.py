"""The paper's walkers as cases for the theory, with the shipped parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from walkers.inputs.case import Case
from walkers.inputs.drive import Drive, Harmonic
from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.paper.published import FIG4_PEAKS, GRAVITY, Point

if TYPE_CHECKING:
    import pandas as pd


def shipped() -> Case:
    """The case whose beads, liquid and contacts Figs. 1b and 2 have."""
    return load_case("fig1b")


def symmetric(table: pd.DataFrame) -> pd.Series[bool]:
    """Which points of a sweep have beads of one size."""
    return table["sin_delta"].abs() < 1e-9


def driven(case: Case, frequency: float, accelerations: Iterable[float]) -> list[Case]:
    """A case at another frequency, Hz, and peak accelerations, m/s²; for the theory, without a time step for a deck."""
    drives = [Harmonic(case.drive.direction, float(frequency), float(peak)) for peak in accelerations]
    run = replace(case.run, time_step=0.0)
    return [replace(case, drive=Drive((one,), case.drive.frame), run=run) for one in drives]


def of_asymmetry(case: Case, sin_delta: float, gamma0: float) -> Case:
    """A case with beads of the same mean radius and another asymmetry, driven at a Γ0."""
    mean = dimer_of(case).mean_radius
    return of_radii(case, (mean * (1.0 + sin_delta), mean * (1.0 - sin_delta)), gamma0)


def of_radii(case: Case, radii: tuple[float, float], gamma0: float) -> Case:
    """A case with other beads, radii in m, driven at a Γ0."""
    dimer = replace(case, walkers=(replace(case.walkers[0], radii=radii),))
    return replace(dimer, drive=case.drive.with_peak(dimer_of(dimer).peak_acceleration(gamma0)))


def of_point(point: Point) -> Case:
    """The shipped case at a point."""
    if point.sweep == "fig4":
        return load_case("fig4a" if point.peak == FIG4_PEAKS[0] else "fig4b")
    if point.peak is None:
        large, small = point.radii
        return of_radii(shipped(), (large * 1e-3, small * 1e-3), 0.5)
    return driven(shipped(), point.frequency, [point.peak * GRAVITY])[0]


def described(case: Case) -> str:
    """Radii, drive and liquid of a case in a few words, for titles."""
    radii = "/".join(f"{radius * 1e3:g}" for radius in case.walkers[0].radii)
    drive = f"{case.drive.frequency:g} Hz, {case.drive.peak_acceleration / GRAVITY:.3g} g"
    return f"R = {radii} mm, {drive}, {case.liquid.name}"
