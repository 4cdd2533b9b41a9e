"""Text of a case for titles and captions: bodies, surfaces, liquid, drive and tilt."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

from walkers.inputs.tables.case import Case
from walkers.rounding import counted


def caption(case: Case) -> str:
    """A case in one line: bodies, surface, liquid, drive and tilt.

    Examples
    --------
    >>> from walkers.inputs.reading import load_case
    >>> caption(load_case("fig4a"))
    '6 walkers of R = 0.6 / 0.3 mm on a plane of glass, Si AK5; 80 Hz, a0 = 19.6 m/s²'
    """
    bodies = [
        f"{counted(kind.replicates, 'walker')} of R = {radii_text(kind.radii)} mm"
        for kind in case.walkers
    ]
    if case.loose:
        bodies.append(
            f"{case.count - sum(len(kind.all_radii) for kind in case.walkers)} loose beads"
        )
    boundary = (
        f"in a {case.boundary.shape}" if case.boundary.closed else f"on a {case.boundary.shape}"
    )
    return f"{', '.join(bodies)} {boundary} of {case.boundary.material}, {liquid_text(case)}; {conditions(case)}"


def conditions(case: Case) -> str:
    """The drive of a case and, unless it is level, its tilt and where up is: ``…, plane tilted by 90°, right is up``.

    Pictures have the drive axis to the right: what faces right goes up where that is the steepest way up.
    """
    parts = [case.excitation.described()]
    if case.boundary.tilted:
        up = (
            "right is up"
            if case.goes_uphill
            else f"up is at {degrees(case.boundary.uphill):.4g}° from x toward y"
        )
        parts += [case.boundary.tilted, up]
    return ", ".join(parts)


def liquid_text(case: Case) -> str:
    """The name of the liquid of a case; its surface tension if it has none."""
    return case.liquid.name or f"liquid of {case.liquid.surface_tension * 1e3:.4g} mN/m"


def radii_text(radii: Sequence[float]) -> str:
    """Radii (m) in mm, without the unit: ``0.6 / 0.3``."""
    return " / ".join(f"{radius * 1e3:g}" for radius in radii)
