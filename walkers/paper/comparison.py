"""Comparison of all published numbers with this project: ``comparison.md`` and ``comparison.json``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, nan
from statistics import fmean
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from walkers.inputs.loads import dimer_of
from walkers.paper.maps import paper_drives
from walkers.paper.published import (
    GRAVITY,
    OBSERVATIONS,
    NothingFinishedError,
    Observation,
    Point,
    Sources,
    driven,
    shipped,
)
from walkers.postprocess.gait import misalignment, on_axis, steady_walkers
from walkers.postprocess.results import read
from walkers.postprocess.tables import read_table
from walkers.sweeps.table import thresholds
from walkers.text import rendered
from walkers.theory.mathieu import largest_stable_v
from walkers.theory.prediction import motion_of, threshold

if TYPE_CHECKING:
    import pandas as pd

AGREES = 0.15
"""Relative difference up to which a number agrees with the published one, if the paper gives no spread."""
_SMALL = 0.05
"""mm/s; difference up to which a number agrees with a published zero."""


class Value(NamedTuple):
    """A computed number, in the unit of the published one; NaN if there is none.

    ``low`` and ``high`` are the range over walkers, or over frequencies for means over these; ``left_out`` walkers are
    not steady (`walkers.postprocess.gait`). The theory is Coulomb friction and the resistance of bridges, without fits.
    """

    engine: float = nan
    low: float = nan
    high: float = nan
    theory: float = nan
    left_out: int = 0


def evaluate(number: Observation, table: pd.DataFrame) -> Value:
    """The values of engine and theory for a published number of walkers.

    Parameters
    ----------
    number
        Its quantity is ``velocity``, ``rotation_1`` or ``sliding_1``, means over steady walkers; ``velocity_of_all``
        walkers; ``largest_angle`` or ``smallest_angle`` to the drive axis at the end; or ``astray``, the share of
        walkers that have left the axis, %.
    table
        Finished points of a sweep (`walkers.sweeps.table.load`). Walkers without a point are left out.
    """
    found = [_of_walkers(point, number.quantity, table) for point in number.of]
    if number.over:
        under = [_of_walkers(point, number.quantity, table) for point in number.over]
        found = [
            Value(one.engine / other.engine, theory=one.theory / other.theory, left_out=one.left_out + other.left_out)
            for one, other in zip(found, under, strict=True)
            if one and other
        ]
    values = [one for one in found if one]
    if not values or (len(values) == 1 and not number.over):
        return values[0] if values else Value()
    engine = [one.engine for one in values]
    mean, low, high = (float(reduced(engine)) for reduced in (np.mean, np.min, np.max))
    return Value(mean, low, high, fmean(one.theory for one in values), sum(one.left_out for one in values))


def _of_walkers(point: Point, quantity: str, table: pd.DataFrame) -> Value | None:
    """A quantity of the walkers of a point, mm/s, degrees or %; None if the point is not finished."""
    rows = point.rows(table)
    if rows.empty:
        return None
    if quantity == "velocity_of_all":
        mean, low, high = (float(rows[name].mean()) * 1e3 for name in ("velocity", "smallest", "largest"))
        return Value(mean, low, high, _theory(point, quantity))
    if quantity.endswith("angle"):
        angles = np.concatenate([misalignment(read_table(run, "walkers")) for run in rows["run"]])
        low, high = float(angles.min()), float(angles.max())
        return Value(high if quantity == "largest_angle" else low, low, high)
    run = rows["run"].iloc[0]
    if quantity == "astray":
        return Value(100.0 * float((~on_axis(read_table(run, "walkers"))).mean()))
    speeds = steady_walkers(read(run))[quantity].to_numpy() * 1e3
    theory, left_out = _theory(point, quantity), int(rows["walkers"].iloc[0]) - len(speeds)
    if not len(speeds):
        return Value(theory=theory, left_out=left_out)
    return Value(float(speeds.mean()), float(speeds.min()), float(speeds.max()), theory, left_out)


def _theory(point: Point, quantity: str) -> float:
    """Speed of the walkers of a point in the theory, mm/s; NaN if contacts open."""
    motion = motion_of(point.case())
    family = quantity.partition("_")[0]
    if family == "velocity":
        return float(motion.velocity[0]) * 1e3
    return nan if motion.opened[0] else float(getattr(motion, family)[0, 0]) * 1e3


def compare(sources: Sources) -> list[dict[str, Any]]:
    """All compared numbers, in the order of the paper, as in ``comparison.json``.

    Returns
    -------
    list of dict
        The published number (``key``, ``what``, ``unit``, ``published``, ``measured``, ``bounds``); our `Value`, or
        None; ``ratio`` of engine (or theory, if the number is only theoretical) to published, None if that is zero or
        in words; ``within_bounds`` of the paper (None: it gives no bounds); ``agrees``: the same or, without bounds,
        within `AGREES` of the published value; and ``why`` not: what a disagreement depends on.
    """
    return [_row(number, _value(number, sources)) for number in OBSERVATIONS.values() if number.compared]


def _value(number: Observation, sources: Sources) -> Value:
    if number.key == "mathieu":
        return Value(theory=max(one.v for one in paper_drives().values()))
    if number.key == "mathieu_stable":
        return Value(theory=largest_stable_v())
    if number.quantity == "gamma0":
        case = number.of[0].case()
        gamma0 = dimer_of(case).gamma0(case.excitation.peak_acceleration)
        return Value(gamma0, gamma0, gamma0)
    try:
        if number.key.startswith("fig2_threshold"):
            return _threshold(sources, by_frequency=number.key == "fig2_threshold_frequency")
        return evaluate(number, sources.finished(number.of[0].sweep))
    except NothingFinishedError:
        return Value()


def _threshold(sources: Sources, *, by_frequency: bool) -> Value:
    """Γc between the last drive with motion and the first without; or its ratio at two frequencies, with errors."""
    sources.finished("fig2-threshold")
    ends = thresholds(sources.table("fig2-threshold")).sort_values("drive.frequency")
    low, high = ends["gamma0_at_rest"].to_numpy(), ends["gamma0_moving"].to_numpy()
    slow, fast = (float(ends["drive.frequency"].iloc[end]) for end in (0, -1))
    first, last = (threshold(driven(shipped(), frequency, [GRAVITY])[0]) for frequency in (slow, fast))
    middle = (low + high) / 2.0
    if by_frequency:
        return Value(float(middle[-1] / middle[0]), float(low[-1] / high[0]), float(high[-1] / low[0]), last / first)
    return Value(float(middle.mean()), float(low.min()), float(high.max()), float(np.mean([first, last])))


def _row(number: Observation, value: Value) -> dict[str, Any]:
    ours = value.theory if number.key.startswith("mathieu") else value.engine  # V is not a number of the engine
    within = None if number.bounds is None else bool(number.bounds[0] <= ours <= number.bounds[1])
    allowed = AGREES * abs(number.value) if number.value else _SMALL
    agrees = bool(abs(ours - (number.value or 0.0)) <= allowed) if within is None else within
    why = number.depends_on
    if not isfinite(ours):
        lost = "In a run that it needs, no walker is steady, stays on the axis and keeps its beads together."
        why = lost if value.left_out else "A run that it needs is missing or failed."
    return {
        **{"key": number.key, "what": number.what, "unit": number.unit},
        **{"published": number.value, "measured": number.measured},
        **{name: one if isfinite(one) else None for name, one in value._asdict().items()},
        "ratio": ours / number.value if number.value and isfinite(ours) else None,
        **{"bounds": number.bounds, "within_bounds": within, "agrees": agrees, "why": "" if agrees else why},
    }


def count(rows: Sequence[Mapping[str, Any]], *, measured: bool) -> tuple[int, int]:
    """Numbers of agreeing rows and of all rows, without those in words: those that test the engine, or the others."""
    chosen = [row["agrees"] for row in rows if row["measured"] == measured and row["published"] is not None]
    return sum(chosen), len(chosen)


def as_dict(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The comparison for JSON."""
    agree, of = count(rows, measured=True)
    return {"agree": agree, "of": of, "tolerance": AGREES, "numbers": rows}


def as_markdown(rows: Sequence[Mapping[str, Any]]) -> str:
    """The comparison as a table, followed by the disagreements and their reasons."""
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if not row["agrees"]:
            reasons.setdefault(row["why"], []).append(row["what"])
    engine, others = (count(rows, measured=measured) for measured in (True, False))
    shown = {"engine": engine, "others": others, "tolerance": AGREES, "rows": rows, "reasons": reasons}
    return rendered("walkers.paper", "comparison.md.j2", **shown)
