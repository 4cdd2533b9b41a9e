"""Text of a case for titles and captions: bodies, surfaces, liquid, drive and tilt."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

from walkers.inputs.origins import accelerations_in_g
from walkers.inputs.tables.case import Case
from walkers.rounding import counted


def caption(case: Case) -> str:
    """Describe a case in one line: bodies, surface, liquid, drive and tilt.

    Examples
    --------
    >>> from walkers.inputs.reading import load_case
    >>> caption(load_case("fig4a"))
    '6 walkers of R = 0.6 / 0.3 mm on a plane of chromium-coated glass, Si AK5; 80 Hz, a0 = 2 g'
    """
    bodies = []
    for kind in case.walkers:
        walkers = counted(kind.replicates, "walker")
        bodies.append(f"{walkers} of R = {radii_text(kind.radii)} mm")
    if case.loose:
        beads_of_walkers = sum(len(kind.all_radii) for kind in case.walkers)
        bodies.append(f"{case.count - beads_of_walkers} loose beads")
    boundary = case.boundary
    preposition = "in" if boundary.closed else "on"
    place = f"{preposition} a {boundary.shape} of {boundary.material}"
    return f"{', '.join(bodies)} {place}, {liquid_text(case)}; {conditions(case)}"


def conditions(case: Case) -> str:
    """Describe the drive of a case and, unless it is level, its tilt and where up is.

    An example is ``…, plane tilted by 90°, right is up``. Pictures have the drive axis to the
    right: what faces right goes up where that is the steepest way up.
    """
    drive = drive_text(case)
    tilt = case.boundary.tilted
    if not tilt:
        return drive
    if case.goes_uphill:
        up = "right is up"
    else:
        up = f"up is at {degrees(case.boundary.uphill):.4g}° from x toward y"
    return f"{drive}, {tilt}, {up}"


def drive_text(case: Case) -> str:
    """Describe the drive of a case, with accelerations in m/s², or in g if the case has them so."""
    texts = {origin.key: origin.text for origin in case.origins}
    return case.excitation.described(in_g=accelerations_in_g(texts))


def liquid_text(case: Case) -> str:
    """The name of the liquid of a case; its surface tension if it has none."""
    return case.liquid.name or f"liquid of {case.liquid.surface_tension * 1e3:.4g} mN/m"


def radii_text(radii: Sequence[float]) -> str:
    """Radii (m) in mm, without the unit: ``0.6 / 0.3``."""
    return " / ".join(f"{radius * 1e3:g}" for radius in radii)
