"""Which cases may share a deck, and what tells their beads apart there.

An engine deck has one substrate, drive, liquid and time step. What may differ from walker to walker are the beads'
radii, how they start, and their surfaces (frictions and restitution), which become atom types.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace

from walkers.inputs.case import Case
from walkers.inputs.loads import reach
from walkers.physics.matter import Contact


def surfaces_of(cases: Sequence[Case]) -> tuple[Contact, ...]:
    """How the cases' beads touch each other and the walls, each way once, in the order of the cases."""
    return tuple(dict.fromkeys(case.contact for case in cases))


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
    liquid = replace(case.liquid, name=None, density=None)
    boundary = replace(case.boundary, material="")
    return (boundary, liquid, contact, case.drive, case.run, case.gravity, case.density, crowded)


def check_sharing(cases: Sequence[Case]) -> None:
    """Raise ``ValueError`` unless the cases, at least one, may share a deck."""
    if len({sharing_key(case) for case in cases}) != 1:
        raise ValueError("these cases cannot share a deck")
