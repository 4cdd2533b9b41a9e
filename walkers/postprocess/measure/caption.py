"""Text of a case for titles and captions: bodies, surfaces, liquid, drive and tilt."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees

from walkers.inputs.origins import accelerations_in_g
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
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


def drive_description(case: Case) -> str:
    """Describe the drive of a case: ``80 Hz, a0 = 4 g``, or in m/s² if the case gives it so."""
    texts = {origin.key: origin.text for origin in case.origins}
    return str(case.excitation.described(in_g=accelerations_in_g(texts)))


def conditions(case: Case, *, in_given_unit: bool = True) -> str:
    """Describe the drive of a case and, unless it is level, its tilt and where up is.

    Accelerations are in g if the case gives them so and ``in_given_unit`` is true, otherwise in
    m/s². An example is ``…, plane tilted by 90°, right is up``. Pictures have the drive axis to the
    right: what faces right goes up where that is the steepest way up.
    """
    drive = drive_description(case) if in_given_unit else str(case.excitation.described())
    tilt = case.boundary.tilted
    if not tilt:
        return drive
    if case.goes_uphill:
        up = "right is up"
    else:
        up = f"up is at {degrees(case.boundary.uphill):.4g}° from x toward y"
    return f"{drive}, {tilt}, {up}"


def common_conditions(cases: Sequence[Case]) -> str:
    """What cases have in common: radii of walkers, liquid, frequency and peak acceleration.

    Parameters
    ----------
    cases
        The cases, of any number.

    Examples
    --------
    >>> from walkers.inputs.reading import load_case
    >>> common_conditions([load_case("fig1b"), load_case("fig1b", {"drive.frequency": "60 Hz"})])
    'R = 0.3 / 0.2 mm, Si AK5, 4 g'
    """
    texts = []
    for describe in (_walkers_text, liquid_text, _frequency_text, _acceleration_text):
        different = {describe(case) for case in cases}
        if len(different) == 1:
            texts.append(different.pop())
    return ", ".join(text for text in texts if text)


def _walkers_text(case: Case) -> str:
    """The radii of the walkers of a case; empty without walkers."""
    radii = [radii_text(kind.radii) for kind in case.walkers]
    return f"R = {' and '.join(radii)} mm" if radii else ""


def _frequency_text(case: Case) -> str:
    return f"{case.excitation.frequency:.4g} Hz"


def _acceleration_text(case: Case) -> str:
    """The peak acceleration of a case; empty for several harmonics, and for records."""
    drive = case.excitation
    if drive.record is not None or len(drive.harmonics) != 1:
        return ""
    return f"{drive.peak_acceleration / ACCELERATION_OF_ONE_G:.4g} g"


def liquid_text(case: Case) -> str:
    """The name of the liquid of a case; its surface tension if it has none."""
    return case.liquid.name or f"liquid of {case.liquid.surface_tension * 1e3:.4g} mN/m"


def radii_text(radii: Sequence[float]) -> str:
    """Radii (m) in mm, without the unit: ``0.6 / 0.3``."""
    return " / ".join(f"{radius * 1e3:g}" for radius in radii)
