"""Predictions of the theory for cases: velocity, threshold, detachment, alignment.

`walkers.theory.prediction_text` words them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from math import hypot, nan, pi
from typing import Any

import numpy as np

from walkers.arrays import BoolArray, FloatArray
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.gait import LEAST_GROWTH_RATE
from walkers.postprocess.measure.results import json_numbers
from walkers.theory.mathieu import LARGEST_STABLE_V, alignment, time_to_turn, turning_rate
from walkers.theory.motion import PredictedMotion, Walker, predict_motion
from walkers.theory.paper_range import outside_of_the_paper, why_not_the_paper
from walkers.theory.quasistatic import CONTACTS, FRICTION_OF_THE_PAPER, detachment, mean_velocity

MOVING = 1e-6
"""A walker faster than this, m/s, moves."""
_TRIALS = 33
"""Drives that are tried at a time in the search for the weakest one at which something happens."""
_ROUNDS = 3
"""Times that this search is repeated between two neighbours of the trials before."""
_STRONGEST = 16.0
"""Largest Γ0 at which contacts are tried, over the largest normal force at rest (unit 4πγR̄)."""
FRICTION_MODEL = "theory: friction and drag"
"""The friction of the case with the viscous forces of its bridges (`motion_of`)."""
PAPER_FIT = f"theory: paper's fit, κ = {FRICTION_OF_THE_PAPER * 1e-3:g} s/mm"
"""The model of the paper (`walkers.theory.quasistatic.mean_velocity`), for the cases to which it
was fitted."""
_VELOCITIES = ("velocity", "right_facing", "left_facing")
"""Columns of a sweep's table that are velocities of walkers."""


class NotApplicable(ValueError):
    """The theory does not apply to a case.

    Attributes
    ----------
    key
        The key of the case that the theory does not allow for.
    reason
        What it allows for.
    """

    def __init__(self, key: str, reason: str) -> None:
        self.key = key
        self.reason = reason
        super().__init__(f"{key}: {reason}")


def check_applies(*cases: Case) -> None:
    """Raise `NotApplicable` if the theory does not apply to a case.

    It applies to dimers on a plane, whose drive is a single harmonic along the plane and whose
    weight, if the plane is tilted, acts along the axis of the drive.
    """
    for case in cases:
        if len(case.walkers) != 1 or len(case.walkers[0].radii) != 2 or case.loose:
            raise NotApplicable("bodies", "expected dimers; the theory is for dimers only")
        if not case.boundary.is_open_floor:
            raise NotApplicable("boundary.shape", "the theory is for planes")
        if case.drive.ramp or not case.excitation.is_plain or case.excitation.direction[2] != 0.0:
            text = "the theory is for a single harmonic along the plane, without a phase or a ramp"
            raise NotApplicable("drive", text)
        # But for rounding, all gravity along the plane acts along the axis.
        if hypot(*case.gravity_vector[:2]) > abs(case.axial_gravity) + 1e-9:
            text = "the theory is for planes tilted along the drive"
            raise NotApplicable("boundary.uphill", text)


def motion_of(*cases: Case) -> PredictedMotion:
    """Integrate the motion of the walkers of N cases, aligned with the drive.

    Friction and bridges are those of the engine.

    Raises
    ------
    NotApplicable
        If the theory does not apply to one of the cases (`check_applies`).
    """
    check_applies(*cases)
    return predict_motion(
        Walker.joined([Walker.of_case(case) for case in cases]),
        [case.excitation.frequency for case in cases],
        [case.excitation.peak_acceleration for case in cases],
        steady_acceleration=[case.axial_gravity for case in cases],
    )


def threshold(case: Case) -> float:
    """Compute Γc, the smallest Γ0 at which the walker of a case moves at the frequency of the case.

    The tolerance is 1e-4 of the range in which contacts stay closed in the model of the paper. NaN
    if the walker does not move in this range, and for a symmetric dimer.

    Raises
    ------
    NotApplicable
        If the theory does not apply to the case (`check_applies`).
    """
    check_applies(case)
    sin_delta = dimer_of(case).sin_delta
    if sin_delta == 0.0:
        return nan
    largest_gamma = float(detachment(sin_delta).gamma)
    gamma, _ = _smallest_gamma(case, largest_gamma, _moves)
    return gamma


def _moves(motion: PredictedMotion) -> BoolArray:
    """Whether each walker moves; one without a velocity does not."""
    return np.abs(motion.velocity) > MOVING


def _contacts_open(motion: PredictedMotion) -> BoolArray:
    """Whether a contact of each walker opens, or its forces have no solution."""
    return motion.opened | ~motion.solved


def _smallest_gamma(
    case: Case, largest_gamma: float, happens: Callable[[PredictedMotion], BoolArray]
) -> tuple[float, str | None]:
    """The smallest Γ0 at which something happens to the walker of a case.

    Returns
    -------
    gamma : float
        Γ0; NaN if nothing happens up to ``largest_gamma``.
    reason : str or None
        Why the walker has no velocity at this Γ0; None if it has one, or if nothing happens.
    """
    dimer = dimer_of(case)
    walker = Walker.of_case(case)
    low = 0.0
    high = largest_gamma
    for _ in range(_ROUNDS):
        trials = np.linspace(low, high, _TRIALS)
        motion = predict_motion(
            walker,
            case.excitation.frequency,
            np.array([dimer.peak_acceleration(float(gamma)) for gamma in trials]),
            steady_acceleration=case.axial_gravity,
        )
        happened = happens(motion)
        if not happened.any():
            return nan, None
        first = int(np.argmax(happened))
        low = float(trials[max(first - 1, 0)])
        high = float(trials[first])
    return (low + high) / 2.0, _why_no_velocity(motion, first)


def _opening(case: Case) -> dict[str, Any]:
    """Γ0 up to which contacts stay closed with friction and viscous bridges.

    The motion is periodic and has the frequency of the case.

    The table has ``gamma`` and the ``reason`` why the model ends there: the contact that opens, or
    that the forces have no solution. Without a reason, ``gamma`` is the largest that was tried.

    Sliding limits the friction, so that contacts open at far stronger drives than in the model of
    the paper (`detachment`). In the engine, whose contacts are elastic and damped, they opened at
    0.6 to 1.4 times this Γ0 (four dimers: sin δ = 0.2 and 0.33, friction 0.1 to 0.5, 80 Hz).
    """
    largest_gamma = _STRONGEST * float(Walker.of_case(case).normal_at_rest.max())
    gamma, reason = _smallest_gamma(case, largest_gamma, _contacts_open)
    if reason is None:
        return {"gamma": largest_gamma, "reason": None}
    return {"gamma": gamma, "reason": reason}


def predict(case: Case) -> dict[str, Any]:
    """Predict the motion of the dimer of a case.

    Returns
    -------
    dict
        Numbers in SI units, None where a model does not hold, by name:

        - ``gamma0`` and ``sin_delta`` of the case
        - ``paper``: ``velocity`` of the model of the paper, its ``friction`` κ (s/m), and the
          ``reason`` if it does not hold
        - ``viscous``: with friction and viscous bridges, ``velocity`` of the walker,
          ``rotation`` of both beads and ``sliding`` of the three contacts (m/s), ``threshold`` Γc,
          and the ``reason`` if there is no velocity
        - ``detachment``: the Γ0 up to which contacts stay closed, and what happens there
        - ``alignment``: as `alignment_of`

    Raises
    ------
    NotApplicable
        If the theory does not apply to the case (`check_applies`).
    """
    motion = motion_of(case)
    dimer = dimer_of(case)
    return {
        "gamma0": dimer.gamma0(case.excitation.peak_acceleration),
        "sin_delta": dimer.sin_delta,
        "paper": json_numbers(_by_the_paper(case)),
        "viscous": json_numbers(
            {
                "velocity": float(motion.velocity[0]) if motion.periodic[0] else nan,
                "rotation": motion.rotation[:, 0].tolist(),
                "sliding": motion.sliding[:, 0].tolist(),
                "reason": _why_no_velocity(motion, 0),
                "threshold": threshold(case),
            }
        ),
        "detachment": _opening(case),
        "alignment": alignment_of(case),
    }


def _by_the_paper(case: Case) -> dict[str, Any]:
    """The velocity of a case's dimer in the model of the paper.

    Returns
    -------
    dict
        ``friction``, the paper's κ (s/m); ``velocity`` (m/s), NaN where the model does not apply or
        a contact would open; and the ``reason`` for that, None if there is a velocity.
    """
    dimer = dimer_of(case)
    velocity = nan
    reason = why_not_the_paper(case)
    if reason is None:
        gamma0 = dimer.gamma0(case.excitation.peak_acceleration)
        velocity = float(mean_velocity(gamma0, dimer.sin_delta))
        if not np.isfinite(velocity):
            contact = int(detachment(dimer.sin_delta).contact)
            reason = f"{CONTACTS[contact]} would open"
    return {"friction": FRICTION_OF_THE_PAPER, "velocity": velocity, "reason": reason}


def _why_no_velocity(motion: PredictedMotion, walker: int) -> str | None:
    """Reason why the motion has no velocity of a walker; None if it has one."""
    if not motion.solved[walker]:
        return "the forces have no solution"
    if motion.opened[walker]:
        contact = int(np.argmin(motion.smallest_normal_force[:, walker]))
        return f"{CONTACTS[contact]} would open"
    if not motion.periodic[walker]:
        return "the motion does not become periodic"
    return None


def alignment_of(case: Case) -> dict[str, Any]:
    """Compute whether the dimer of a case stays aligned with the axis of the drive.

    Returns
    -------
    dict
        By name:

        - ``u``, ``v`` and ``damping`` (β, by the bridges) of the Mathieu equation
          (`walkers.theory.mathieu`); whether small angles are ``stable`` in it; the
          ``largest_stable_v`` on a level substrate; ``rolling_rate``, the growth rate in it, 1/s
        - ``rate``: the growth rate with sliding contacts and spinning beads, 1/s (negative: decay;
          at 1° if there is rolling friction); None if the axial motion is not periodic, and without
          a drive
        - ``rolling_friction``: its coefficient in the case
        - ``stands``: on a level substrate, whether the dimer stays on the axis; None without a
          ``rate``
        - ``turns_over_after``: on a slope, the time from 1° to 90°, s; None if the dimer does not
          turn over
    """
    drive = case.excitation
    mathieu = alignment(case)
    rate = None
    stands = None
    turns_over_after = None
    if drive.peak_acceleration > 0.0:
        rate = turning_rate(case)
    if rate is not None:
        stands = rate <= LEAST_GROWTH_RATE
        if not stands and mathieu.u:
            turns_over_after = time_to_turn(rate)
    return {
        **vars(mathieu),
        "stable": mathieu.stable,
        "largest_stable_v": LARGEST_STABLE_V,
        "rolling_rate": mathieu.growth * pi * drive.frequency,
        "rate": rate,
        "rolling_friction": case.contact.rolling_friction,
        "stands": stands,
        "turns_over_after": turns_over_after,
    }


def predicted_column(
    cases: Sequence[Case], column: str
) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """Predict a column of the table of a sweep.

    Parameters
    ----------
    cases
        The N cases of the sweep.
    column
        Name of the column, such as ``velocity`` or ``sliding_1``.

    Returns
    -------
    predictions : dict
        Values of each model (`FRICTION_MODEL`, `PAPER_FIT`), m/s, shape (N,), NaN where it does not
        apply. A model is left out if it does not have the column or applies to no case.
    reasons : dict
        Number of cases by the reason why they lack a value of `FRICTION_MODEL`, or a velocity of
        `PAPER_FIT`, and of those outside the range of the paper's measurements, where no model has
        been tested.
    """
    quantity, contact = _quantity_and_index(column)
    if quantity is None:
        return {}, {f"the theory has no {column}": len(cases)}
    reasons: Counter[str] = Counter()
    applicable = []
    for number, case in enumerate(cases):
        reason = _why_not(case, column)
        if reason is None:
            applicable.append(number)
        else:
            reasons[reason] += 1
    if not applicable:
        return {}, dict(reasons)

    by_friction = _velocities_by_friction(cases, applicable, reasons, quantity, contact)
    by_paper = np.full(len(cases), np.nan)
    if column in _VELOCITIES:
        by_paper = _velocities_by_the_paper(cases, applicable, reasons)
    _count_outside(cases, reasons)
    predictions = {FRICTION_MODEL: by_friction, PAPER_FIT: by_paper}
    applied = {model: values for model, values in predictions.items() if np.isfinite(values).any()}
    return applied, dict(reasons)


def _velocities_by_friction(
    cases: Sequence[Case],
    applicable: Sequence[int],
    reasons: Counter[str],
    quantity: str,
    contact: int | None,
) -> FloatArray:
    """Values of a field of `PredictedMotion` for N cases, m/s, shape (N,).

    ``applicable`` are the numbers of the cases to which the theory applies. The reasons for values
    of theirs that are NaN are counted in place.
    """
    values = np.full(len(cases), np.nan)
    motion = motion_of(*[cases[number] for number in applicable])
    computed = getattr(motion, quantity)
    if contact is not None:
        computed = computed[contact]
    for walker, number in enumerate(applicable):
        reason = _why_no_velocity(motion, walker)
        if reason is None:
            values[number] = computed[walker]
        else:
            reasons[reason] += 1
    return values


def _velocities_by_the_paper(
    cases: Sequence[Case], applicable: Sequence[int], reasons: Counter[str]
) -> FloatArray:
    """Velocities in the model of the paper for N cases, m/s, shape (N,).

    ``applicable`` are the numbers of the cases to which the theory applies. The reasons for values
    of theirs that are NaN are counted in place.
    """
    velocities = np.full(len(cases), np.nan)
    for number in applicable:
        case = cases[number]
        reason = why_not_the_paper(case)
        if reason is None:
            dimer = dimer_of(case)
            gamma0 = dimer.gamma0(case.excitation.peak_acceleration)
            velocities[number] = mean_velocity(gamma0, dimer.sin_delta)
        else:
            reasons[f"{PAPER_FIT}: {reason}"] += 1
    return velocities


def _quantity_and_index(column: str) -> tuple[str | None, int | None]:
    """Field of `PredictedMotion` for a column, and the index there.

    The field is None if the theory does not have the column.

    The third contact of the theory is that between the beads, ``sliding_pair_1`` in tables.
    """
    if column in _VELOCITIES:
        return "velocity", None
    if column == "sliding_pair_1":
        return "sliding", 2
    quantity, _, number = column.rpartition("_")
    if quantity not in ("rotation", "sliding"):
        return None, None
    return quantity, int(number) - 1


def _count_outside(cases: Sequence[Case], reasons: Counter[str]) -> None:
    """Count the cases outside the range of the paper's measurements.

    All count under the sentence about the first of them.
    """
    sentences = []
    for case in cases:
        sentence = outside_of_the_paper(case)
        if sentence is not None:
            sentences.append(sentence)
    if len(sentences) == 1:
        reasons[sentences[0]] = 1
    elif sentences:
        reasons[f"{sentences[0]}, …"] = len(sentences)


def _why_not(case: Case, column: str) -> str | None:
    """Reason why the theory does not predict a column of a case."""
    try:
        check_applies(case)
    except NotApplicable as error:
        return error.reason
    if case.axial_gravity != 0.0 and column != "right_facing":
        return "on a slope the theory is for walkers that face up (column right_facing)"
    return None
