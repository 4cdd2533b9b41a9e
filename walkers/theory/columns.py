"""What the theory says of columns of a sweep's table: velocities, rotation and sliding of dimers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.theory.prediction import check_applies, motion_of
from walkers.theory.quasistatic import FRICTION_OF_THE_PAPER, FloatArray, mean_velocity

MODEL, PAPER = "theory", f"paper's fit, κ = {FRICTION_OF_THE_PAPER * 1e-3:g} s/mm"
"""Coulomb friction with the resistance of bridges (`walkers.theory.prediction.motion_of`); the paper's own model, of
what its friction was fitted to (`walkers.theory.quasistatic.mean_velocity`)."""
_BEADS, _BOUNDARIES, _LIQUIDS = "ruby", ("chromium-coated glass", "glass"), ("Si AK5", "Si AK10")
"""Of the paper's walkers on a level substrate (its Figs. 2 to 4)."""


def predicted_column(cases: Sequence[Case], column: str) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """What the models predict for a column of a sweep's table.

    Parameters
    ----------
    cases
        Of N points.
    column
        ``velocity``, ``right_facing``, ``left_facing``, ``rotation_1``, ``sliding_1``, …

    Returns
    -------
    predictions
        From the name of a model to its values, m/s, shape (N,); NaN where it says nothing. Empty where no model has the
        column, or says anything at any point.
    reasons
        Why points have none of `MODEL`, or velocities none of `PAPER`, and of how many that is so.
    """
    family, _, number = column.rpartition("_")
    is_velocity = column in ("velocity", "right_facing", "left_facing")
    if not is_velocity and family not in ("rotation", "sliding"):
        return {}, {f"the theory has no {column}": len(cases)}
    reasons: Counter[str] = Counter()
    able = [place for place, case in enumerate(cases) if not (why := _why_not(case, column)) or reasons.update([why])]
    if not able:
        return {}, dict(reasons)
    model, paper = np.full(len(cases), np.nan), np.full(len(cases), np.nan)
    chosen = [cases[place] for place in able]
    motion = motion_of(*chosen)
    values = motion.velocity if is_velocity else getattr(motion, family)[int(number) - 1]
    known = motion.periodic & np.isfinite(motion.velocity)
    model[able] = np.where(known, values, np.nan)
    reasons.update({"a contact opens, or the motion does not repeat itself": int(np.sum(~known))})
    if is_velocity:
        fitted = [place for place in able if not (why := _why_unfitted(cases[place])) or reasons.update([why])]
        paper[fitted] = _by_the_paper([cases[place] for place in fitted])
    found = {MODEL: model, PAPER: paper}
    return {name: one for name, one in found.items() if np.isfinite(one).any()}, {k: v for k, v in reasons.items() if v}


def _by_the_paper(cases: Sequence[Case]) -> FloatArray:
    """Velocities by the paper's model, m/s."""
    dimers = [dimer_of(case) for case in cases]
    gammas = [dimer.gamma0(case.drive.peak_acceleration) for dimer, case in zip(dimers, cases, strict=True)]
    return mean_velocity(gammas, [dimer.sin_delta for dimer in dimers])


def _why_not(case: Case, column: str) -> str | None:
    """Why the theory says nothing of a case's column."""
    try:
        check_applies(case)
    except ValueError as error:
        return str(error).partition(": ")[2]
    if case.axial_gravity != 0.0 and column != "right_facing":
        return "on a slope the theory is one of walkers that go up it (right_facing)"
    return None


def _why_unfitted(case: Case) -> str | None:
    """Why the paper's friction says nothing of a case's velocity."""
    same = case.material == _BEADS and case.boundary.material in _BOUNDARIES and case.liquid.name in _LIQUIDS
    if same and case.axial_gravity == 0.0:
        return None
    boundaries, liquids = " or ".join(_BOUNDARIES), " or ".join(_LIQUIDS)
    return f"the {PAPER}, is one of {_BEADS} on level {boundaries} in {liquids}"
