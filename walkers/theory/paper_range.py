"""To which cases the fit of the paper applies, and which are beyond its range."""

from __future__ import annotations

from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G

_BEADS = "ruby"
"""Beads of the paper's walkers on a level substrate (Figs. 2 to 4)."""
_SUBSTRATES = ("chromium-coated glass", "glass")
"""Their substrates."""
_LIQUIDS = ("Si AK5", "Si AK10")
"""Their liquids."""
_LOWEST_FREQUENCY = 60.0
"""Lowest frequency of their drives, Hz (Fig. 2)."""
_HIGHEST_FREQUENCY = 90.0
"""Highest frequency of their drives, Hz (Fig. 2)."""
_LARGEST_PEAK = 10.0
"""Largest peak acceleration of their drives in g of 9.8 m/s² (Fig. 2)."""
_LARGEST_GAMMA0 = 3.5
"""Largest Γ0 of their drives (Fig. 4b)."""


def why_not_the_paper(case: Case) -> str | None:
    """Reason why the fit of the paper does not apply to a case; None if it applies."""
    same_materials = (
        case.beads.material == _BEADS
        and case.boundary.material in _SUBSTRATES
        and case.liquid.name in _LIQUIDS
    )
    if same_materials and case.axial_gravity == 0.0:
        return None
    substrates = " or ".join(_SUBSTRATES)
    liquids = " or ".join(_LIQUIDS)
    return f"the fit is to {_BEADS} on level {substrates} in {liquids}"


def outside_of_the_paper(case: Case) -> str | None:
    """How the drive of a dimer lies outside the range in which the paper measured velocities.

    Returns
    -------
    str or None
        A sentence that names each quantity beyond the range; None for a case within the range, and
        for a case that has no dimer.
    """
    if not case.walkers or len(case.walkers[0].radii) != 2:
        return None
    drive = case.excitation
    peak = drive.peak_acceleration / ACCELERATION_OF_ONE_G
    gamma0 = dimer_of(case).gamma0(drive.peak_acceleration)
    beyond = []
    if gamma0 > _LARGEST_GAMMA0:
        beyond.append(f"Γ0 = {gamma0:.3g} (measured up to {_LARGEST_GAMMA0:g})")
    if peak > (1.0 + 1e-9) * _LARGEST_PEAK:
        beyond.append(f"{peak:.3g} g (up to {_LARGEST_PEAK:g} g)")
    if not _LOWEST_FREQUENCY <= drive.frequency <= _HIGHEST_FREQUENCY:
        measured = f"{_LOWEST_FREQUENCY:g} to {_HIGHEST_FREQUENCY:g} Hz"
        beyond.append(f"{drive.frequency:g} Hz ({measured})")
    if not beyond:
        return None
    return f"outside the paper's range: {', '.join(beyond)}; the models are not tested there"
