"""Predictions of the theory for cases: model of the paper, motion with Coulomb friction, detachment, alignment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from math import hypot, log, nan, pi
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.inputs.resolving.loads import dimer_of
from walkers.inputs.tables.case import Case
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.postprocess.measure.gait import GROWS
from walkers.postprocess.measure.results import json_numbers
from walkers.rounding import with_decimals
from walkers.text import aligned
from walkers.theory.mathieu import LARGEST_STABLE_V, alignment, time_to_turn, turning_rate
from walkers.theory.motion import PredictedMotion, Walker, predict_motion
from walkers.theory.quasistatic import CONTACTS, FRICTION_OF_THE_PAPER, detachment, mean_velocity

MOVING = 1e-6
"""A walker faster than this, m/s, moves."""
_TRIALS = 33
_ROUNDS = 3
_STRONGEST = 16.0
"""Largest Γ0 at which contacts are tried, over the largest normal force at rest (unit 4πγR̄)."""
COULOMB_MODEL = "theory: Coulomb friction and drag"
PAPER_FIT = f"theory: paper's fit, κ = {FRICTION_OF_THE_PAPER * 1e-3:g} s/mm"
"""Coulomb friction with the resistance of bridges (`motion_of`); the model of the paper, for the cases to which its
friction was fitted (`walkers.theory.quasistatic.mean_velocity`)."""
_BEADS, _BOUNDARIES, _LIQUIDS = "ruby", ("chromium-coated glass", "glass"), ("Si AK5", "Si AK10")
"""Beads, boundaries and liquids of the paper's walkers on a level substrate (Figs. 2 to 4)."""
_FREQUENCIES, _LARGEST_PEAK, _LARGEST_GAMMA0 = (60.0, 90.0), 10.0, 3.5
"""Their drives: Hz, g of 9.8 m/s² (both Fig. 2), and Γ0 (Fig. 4b)."""


def motion_of(*cases: Case) -> PredictedMotion:
    """The motions of the walkers of cases, aligned with the drive, with the same bridges as in the engine.

    Errors as for `check_applies`.
    """
    check_applies(*cases)
    return predict_motion(
        Walker.joined([Walker.of_case(case) for case in cases]),
        [case.excitation.frequency for case in cases],
        [case.excitation.peak_acceleration for case in cases],
        steady_acceleration=[case.axial_gravity for case in cases],
    )


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
    """Raise `NotApplicable` if the theory does not apply to a case."""
    for case in cases:
        if len(case.walkers) != 1 or len(case.walkers[0].radii) != 2 or case.loose:
            raise NotApplicable("bodies", "expected dimers; the theory is for dimers only")
        if not case.boundary.bare:
            raise NotApplicable("boundary.shape", "the theory is for planes")
        if case.drive.ramp or not case.excitation.is_plain or case.excitation.direction[2] != 0.0:
            text = "the theory is for a single harmonic along the plane, without a phase or a ramp"
            raise NotApplicable("drive", text)
        if hypot(*case.gravity_vector[:2]) > abs(case.axial_gravity) + 1e-9:
            raise NotApplicable(
                "boundary.uphill", "the theory is for planes tilted along the drive"
            )


def threshold(case: Case) -> float:
    """Γc: the smallest Γ0 at which the walker of a case (as for `motion_of`) moves at the frequency of the case.

    The tolerance is 1e-4 of the range in which contacts stay closed in the model of the paper. NaN if the walker does
    not move there, and for a symmetric dimer.
    """
    check_applies(case)
    sin_delta = dimer_of(case).sin_delta
    if sin_delta == 0.0:
        return nan
    most = float(detachment(sin_delta).gamma)
    return _smallest_gamma(case, most, lambda motion: np.abs(motion.velocity) > MOVING)[0]


def _smallest_gamma(
    case: Case, most: float, happens: Callable[[PredictedMotion], npt.NDArray[np.bool_]]
) -> tuple[float, str | None]:
    """The smallest Γ0 up to ``most`` at which something happens to the walker of a case, NaN if it does not happen.

    The second value is the reason why the walker has no velocity there, None if it has one.
    """
    dimer, walker, low, high = dimer_of(case), Walker.of_case(case), 0.0, most
    for _ in range(_ROUNDS):
        trials = np.linspace(low, high, _TRIALS)
        accelerations = np.array([dimer.peak_acceleration(float(gamma)) for gamma in trials])
        pull = case.axial_gravity
        motion = predict_motion(
            walker, case.excitation.frequency, accelerations, steady_acceleration=pull
        )
        happened = happens(motion)
        if not happened.any():
            return nan, None
        first = int(np.argmax(happened))
        low, high = float(trials[max(first - 1, 0)]), float(trials[first])
    return (low + high) / 2.0, _why_unknown(motion, first)


def _opening(case: Case) -> dict[str, Any]:
    """Γ0 up to which contacts stay closed in a periodic motion with Coulomb friction and drag, at a case's frequency.

    The table has ``gamma`` and the ``reason`` why the model ends there: the contact that opens, or that the forces have
    no solution. Without a reason, ``gamma`` is the largest that was tried. As sliding limits the friction, contacts
    open at far stronger drives than in the model of the paper (`detachment`). In the engine, whose contacts are elastic
    and damped, they opened at 0.6 to 1.4 times this Γ0 (four dimers: sin δ = 0.2 and 0.33, friction 0.1 to 0.5, 80 Hz).
    """
    most = _STRONGEST * float(Walker.of_case(case).at_rest.max())
    gamma, reason = _smallest_gamma(case, most, lambda motion: motion.opened | ~motion.solved)
    return {"gamma": gamma if reason else most, "reason": reason}


def predict(case: Case) -> dict[str, Any]:
    """The content of ``walkers show --theory``, SI units; None where the model does not hold, with the reason.

    Errors as for `check_applies`.
    """
    dimer, motion = dimer_of(case), motion_of(case)
    gamma0 = dimer.gamma0(case.excitation.peak_acceleration)
    linear, reason = nan, why_not_the_paper(case)
    if reason is None:
        linear = float(mean_velocity(gamma0, dimer.sin_delta))
        reason = (
            None
            if np.isfinite(linear)
            else f"{CONTACTS[int(detachment(dimer.sin_delta).contact)]} would open"
        )
    return {
        "gamma0": gamma0,
        "sin_delta": dimer.sin_delta,
        "paper": json_numbers(
            {"friction": FRICTION_OF_THE_PAPER, "velocity": linear, "reason": reason}
        ),
        "viscous": json_numbers(
            {
                "velocity": float(motion.velocity[0]) if motion.periodic[0] else nan,
                "rotation": motion.rotation[:, 0].tolist(),
                "sliding": motion.sliding[:, 0].tolist(),
                "reason": _why_unknown(motion, 0),
                "threshold": threshold(case),
            }
        ),
        "detachment": _opening(case),
        "alignment": alignment_of(case),
    }


def why_not_the_paper(case: Case) -> str | None:
    """Reason why the fit of the paper does not apply to a case; None if it applies."""
    same = (
        case.beads.material == _BEADS
        and case.boundary.material in _BOUNDARIES
        and case.liquid.name in _LIQUIDS
    )
    if same and case.axial_gravity == 0.0:
        return None
    return f"the fit is to {_BEADS} on level {' or '.join(_BOUNDARIES)} in {' or '.join(_LIQUIDS)}"


def outside_of_the_paper(case: Case) -> str | None:
    """How a case of a dimer lies outside the range of the paper's velocities; None if it is within, or no dimer."""
    if not case.walkers or len(case.walkers[0].radii) != 2:
        return None
    drive, (slow, fast) = case.excitation, _FREQUENCIES
    peak, gamma0 = (
        drive.peak_acceleration / ACCELERATION_OF_ONE_G,
        dimer_of(case).gamma0(drive.peak_acceleration),
    )
    beyond = [
        *(
            [f"Γ0 = {gamma0:.3g} (measured up to {_LARGEST_GAMMA0:g})"]
            if gamma0 > _LARGEST_GAMMA0
            else []
        ),
        *(
            [f"{peak:.3g} g (up to {_LARGEST_PEAK:g} g)"]
            if peak > (1.0 + 1e-9) * _LARGEST_PEAK
            else []
        ),
        *(
            []
            if slow <= drive.frequency <= fast
            else [f"{drive.frequency:g} Hz ({slow:g} to {fast:g} Hz)"]
        ),
    ]
    return (
        f"outside the paper's range: {', '.join(beyond)}; the models are not tested there"
        if beyond
        else None
    )


def _why_unknown(motion: PredictedMotion, of: int) -> str | None:
    """Reason why a motion has no velocity; None if it has."""
    if not motion.solved[of]:
        return "the forces have no solution"
    if motion.opened[of]:
        return f"{CONTACTS[int(np.argmin(motion.smallest_normal_force[:, of]))]} would open"
    if not motion.periodic[of]:
        return "the motion does not become periodic"
    return None


def alignment_of(case: Case) -> dict[str, Any]:
    """Whether the dimer of a case stays aligned with the axis, and otherwise the time until it turns over.

    The table has ``u``, ``v`` and ``damping`` (β, by the bridges) of the Mathieu equation; whether small angles are
    ``stable`` in it; the ``largest_stable_v`` on a level substrate; ``rolling_rate``, the growth rate in it, 1/s;
    ``rate``, the growth rate with sliding contacts and spinning beads, 1/s (negative: decay; at 1° if there is
    ``rolling_friction``, its coefficient), None if the axial motion is not periodic; whether the dimer ``stands`` (on
    a level substrate: stays on the axis); ``turns_over_after``, s from 1° to 90° on a slope.
    """
    drive = case.excitation
    mathieu = alignment(case)
    rate = turning_rate(case) if drive.peak_acceleration > 0.0 else None
    stands = None if rate is None else rate <= GROWS
    return {
        **vars(mathieu),
        "stable": mathieu.stable,
        "largest_stable_v": LARGEST_STABLE_V,
        "rolling_rate": mathieu.growth * pi * drive.frequency,
        "rate": rate,
        "rolling_friction": case.contact.rolling_friction,
        "stands": stands,
        "turns_over_after": None if rate is None or stands or not mathieu.u else time_to_turn(rate),
    }


def prediction_text(prediction: dict[str, Any], result: Mapping[str, Any] | None) -> str:
    """A prediction as a table, with the result of the engine if it exists; on a slope of the walkers that face up."""
    paper, end, state = (prediction[name] for name in ("paper", "detachment", "alignment"))
    models = {
        f"paper's fit, κ = {paper['friction'] * 1e-3:g} s/mm": paper,
        "Coulomb friction and drag": prediction["viscous"],
        "engine": {"velocity": None, "reason": "run it: walkers run CASE"},
    }
    if result:
        speeds = {
            "rotation": [result["rotation_1"], result["rotation_2"]],
            "sliding": [result["sliding_1"]],
        }
        both = result["goes_uphill"] and result["facing_right"] and result["facing_left"]
        del models["engine"]
        models["engine, facing up" if both else "engine"] = {
            "velocity": result["velocity"],
            **speeds,
        }
    rows = [["mm/s", "velocity", "rotation 1", "rotation 2", "sliding 1", "Γc", ""]]
    for name, model in models.items():
        velocity, gamma = model["velocity"], model.get("threshold")
        of_beads = (
            [*model.get("rotation", []), *model.get("sliding", [])[:1]]
            if velocity is not None
            else []
        )
        speeds_shown = ["-" if velocity is None else with_decimals(velocity * 1e3, 3)]
        speeds_shown += [with_decimals(speed * 1e3, 2) for speed in of_beads]
        cells = [
            *speeds_shown,
            *[""] * (4 - len(speeds_shown)),
            "" if gamma is None else f"{gamma:.3f}",
        ]
        rows.append([name, *cells, model.get("reason") or ""])
    beyond = f"; beyond, {end['reason']}" if end["reason"] else ", the strongest drive tried"
    equation = ", ".join(
        f"{name} = {state[key]:.3g}" for name, key in (("U", "u"), ("V", "v"), ("β", "damping"))
    )
    small = f"small angles {'stay small' if state['stable'] else 'grow'}"
    rolling = (
        f"{small if state['u'] or state['v'] else 'no torque toward the axis'} if the beads roll"
    )
    notes = [
        [
            "contacts",
            f"with Coulomb friction and drag stay closed up to about Γ0 = {end['gamma']:.2g}{beyond}",
        ]
    ]
    bound = "" if state["u"] else f" (stable for V < {state['largest_stable_v']:.3g})"
    slip, rate = "unknown: the axial motion is not periodic", state["rate"]
    if rate is not None:
        at = (
            " at 1° (with rolling friction, smaller ones may grow)"
            if state["rolling_friction"]
            else ""
        )
        slip = f"small angles {'grow' if rate > 0.0 else 'decay'} by {abs(rate):.3g}/s{at}"
        if state["turns_over_after"]:
            slip += f"; turns over after about {state['turns_over_after']:.2g} s (from 1° to 90°)"
        elif not state["stands"]:
            slip += f"; turns away from the axis, from 1° to 10° in about {log(10.0) / rate:.2g} s"
    notes += [["alignment", f"Mathieu {equation}{bound}: {rolling}"], ["with slip", slip]]
    head = f"Γ0 = {prediction['gamma0']:.3g}, sin δ = {prediction['sin_delta']:.3g}"
    outside = [prediction["outside"]] if prediction.get("outside") else []
    return "\n".join([head, *outside, aligned(rows, right=range(1, 6)), aligned(notes)])


def predicted_column(
    cases: Sequence[Case], column: str
) -> tuple[dict[str, FloatArray], dict[str, int]]:
    """Predictions of the models for a column of the table of a sweep of N cases, such as ``velocity`` or ``sliding_1``.

    Returns values of each model by its name, m/s, shape (N,), NaN where it does not apply (none if no model has the
    column or applies to any point); and reasons why points lack a value of `COULOMB_MODEL`, or velocities one of `PAPER_FIT`, and
    how points are outside of the paper's measurements, where no model is tested, with the number of points.
    """
    family, _, number = column.replace("_pair_1", "_3").rpartition("_")  # contact 3 of the theory
    is_velocity = column in ("velocity", "right_facing", "left_facing")
    if not is_velocity and family not in ("rotation", "sliding"):
        return {}, {f"the theory has no {column}": len(cases)}
    reasons_by_case = [_why_not(case, column) for case in cases]
    applicable = [place for place, reason in enumerate(reasons_by_case) if reason is None]
    reasons = Counter(reason for reason in reasons_by_case if reason)
    if not applicable:
        return {}, dict(reasons)
    model, paper = np.full(len(cases), np.nan), np.full(len(cases), np.nan)
    motion = motion_of(*(cases[place] for place in applicable))
    values = motion.velocity if is_velocity else getattr(motion, family)[int(number) - 1]
    unknown = [_why_unknown(motion, walker) for walker in range(len(applicable))]
    model[applicable] = np.where([reason is None for reason in unknown], values, np.nan)
    reasons += Counter(reason for reason in unknown if reason)
    for place in applicable if is_velocity else ():
        case, dimer = cases[place], dimer_of(cases[place])
        if reason := why_not_the_paper(case):
            reasons[f"{PAPER_FIT}: {reason}"] += 1
        else:
            paper[place] = mean_velocity(
                dimer.gamma0(case.excitation.peak_acceleration), dimer.sin_delta
            )
    models = {COULOMB_MODEL: model, PAPER_FIT: paper}
    if beyond := [sentence for case in cases if (sentence := outside_of_the_paper(case))]:
        reasons[beyond[0] + (", …" if len(beyond) > 1 else "")] = len(beyond)
    return {name: values for name, values in models.items() if np.isfinite(values).any()}, dict(
        reasons
    )


def _why_not(case: Case, column: str) -> str | None:
    """Reason why the theory does not predict a column of a case."""
    try:
        check_applies(case)
    except NotApplicable as error:
        return error.reason
    if case.axial_gravity != 0.0 and column != "right_facing":
        return "on a slope the theory is for walkers that face up (column right_facing)"
    return None
