"""Which cases may share a deck, and what tells their beads apart there.

An engine deck has one time step and shape of boundary, and walls that do not move where walkers of several
cases stand on them. What may differ from walker to walker are the beads' radii, how they start, their surfaces
(frictions and restitution) with their liquid, which become atom types, and what loads them: how the boundary leans,
along what axes and how strongly it is shaken. Only the frequencies and phases of the drive are the same for all.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

from walkers.inputs.case import Case
from walkers.inputs.drive import Vector
from walkers.inputs.loads import reach
from walkers.physics.matter import Contact, Liquid

Surface = tuple[Contact, Liquid]
"""How beads touch each other and the walls: an atom type of a deck."""


def surface_of(case: Case) -> Surface:
    """How the beads of a case touch each other and the walls."""
    return case.contact, replace(case.liquid, name=None, density=None)


def surfaces_of(cases: Sequence[Case]) -> tuple[Surface, ...]:
    """How the cases' beads touch each other and the walls, each way once, in the order of the cases."""
    return tuple(dict.fromkeys(surface_of(case) for case in cases))


@dataclass(frozen=True)
class Loading:
    """What acts on a bead besides its contacts, in the frame of the boundary, m/s².

    Gravity, and the amplitude of the inertial acceleration of each harmonic of the drive.
    """

    gravity: Vector
    harmonics: tuple[Vector, ...]


def loading_of(case: Case) -> Loading:
    """What the beads of a case feel."""
    amplitudes = [(one.peak_acceleration, one.direction) for one in case.drive.harmonics]
    inertia = tuple((a * x, a * y, a * z) for a, (x, y, z) in amplitudes)
    return Loading(case.gravity_vector, inertia)


def loadings_of(cases: Sequence[Case]) -> tuple[Loading, ...]:
    """What the cases' beads feel, each once, in the order of the cases."""
    return tuple(dict.fromkeys(loading_of(case) for case in cases))


def sharing_key(case: Case) -> Hashable:
    """Cases with equal keys may share a deck: everything of the case that a deck has only once.

    The time step is among it. Cases whose ``"auto"`` steps differ (beads of other sizes) stay apart, so that a case is
    integrated with the same step whoever shares the deck.
    """
    if not case.independent:
        return case
    # Walkers that are to stand closer than their own reach would not meet the same neighbours in another company.
    crowded = case if min(one.spacing for one in case.walkers) < 2.0 * reach(case) else None
    contact = replace(
        case.contact,
        friction_bead_bead=0.0,
        friction_bead_wall=0.0,
        restitution=0.0,
        # The model of rolling friction is in the deck or not.
        rolling_friction=float(case.contact.rolling_friction > 0.0),
    )
    boundary = replace(case.boundary, material="", tilt=0.0, uphill=0.0)
    if case.drive.frame == "lab":
        return (boundary, contact, case.drive, loading_of(case), case.run, case.density, crowded)
    times = tuple((one.frequency, one.phase) for one in case.drive.harmonics)
    return (boundary, contact, times, case.run, case.density, crowded)


def check_sharing(cases: Sequence[Case]) -> None:
    """Raise ``ValueError`` unless the cases, at least one, may share a deck."""
    if len({sharing_key(case) for case in cases}) != 1:
        raise ValueError("these cases cannot share a deck")
