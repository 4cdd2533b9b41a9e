"""Every published number beside this project's: ``comparison.md`` and ``comparison.json``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from math import nan
from statistics import fmean

import numpy as np

from walkers.inputs.loads import dimer_of
from walkers.inputs.text import rendered
from walkers.paper import dimers, published
from walkers.paper.alignment import paper_drives
from walkers.paper.published import COMPARED, Point, Published
from walkers.paper.sensitivity import misalignment
from walkers.paper.sources import NothingFinishedError, Sources
from walkers.postprocess.steady_state import steady_walkers
from walkers.sweeps.table import thresholds
from walkers.theory.mathieu import largest_stable_v
from walkers.theory.prediction import motion_of, threshold

AGREES = 0.15
"""A number within this share of the published one agrees with it, where the paper gives no spread."""
_SMALL = 0.05
"""mm/s: where the published value is zero, a number within this agrees with it."""


@dataclass(frozen=True)
class Value:
    """One of our numbers, in the unit of the published one: engine with its range, and theory; NaN where there is none.

    The range is over walkers, or over the frequencies where a number is a mean over these. ``left_out`` of all walkers
    are none until the end (`walkers.postprocess.steady_state`).
    """

    engine: float = nan
    low: float = nan
    high: float = nan
    theory: float = nan
    left_out: int = 0


@dataclass(frozen=True)
class Row:
    """A row of the comparison.

    Attributes
    ----------
    key, what, unit, published, measured
        See `walkers.paper.published.Published`.
    engine, low, high, theory, left_out
        See `Value`; theory is Coulomb friction with the resistance of bridges, nothing fitted.
    ratio
        Engine (or theory, where the number is one of theory alone) to published; None where that is zero or in words,
        or there is nothing to compare.
    bounds
        Between which a value is what the paper says, where it says so.
    within_bounds
        Whether it lies within what the paper says; None where the paper gives no bounds.
    agrees
        Whether it lies within the bounds or, where there are none, within `AGREES` of the published value. What is
        published in words has bounds of its own, and is not counted (`count`).
    why
        What the disagreement depends on; empty where it agrees.
    """

    key: str
    what: str
    unit: str
    published: float | None
    measured: bool
    engine: float | None
    low: float | None
    high: float | None
    theory: float | None
    left_out: int
    ratio: float | None
    bounds: tuple[float, float] | None
    within_bounds: bool | None
    agrees: bool
    why: str


def compare(sources: Sources) -> list[Row]:
    """All published numbers, in the order of the paper."""
    return [_row(number, _found(number, sources)) for number in COMPARED]


def _row(number: Published, value: Value) -> Row:
    ours = value.theory if number.key.startswith("mathieu") else value.engine  # the engine knows nothing of Mathieu's
    within = None if number.bounds is None else number.bounds[0] <= ours <= number.bounds[1]
    agrees = within if within is not None else _near(ours, number.value)
    return Row(
        key=number.key,
        what=number.what,
        unit=number.unit,
        published=number.value,
        measured=number.measured,
        **{name: _finite(getattr(value, name)) for name in ("engine", "low", "high", "theory")},
        left_out=value.left_out,
        ratio=_finite(ours / number.value) if number.value else None,
        bounds=number.bounds,
        within_bounds=None if within is None else bool(within),
        agrees=bool(agrees),
        why="" if agrees else _why(number, value, ours),
    )


def _why(number: Published, value: Value, ours: float) -> str:
    if np.isfinite(ours):
        return number.depends_on
    if value.left_out:
        return "Of a run that it needs no walker is steady, stays on the axis and keeps its beads together."
    return "A run that it needs is missing or failed."


def _near(ours: float, value: float | None) -> bool:
    if value is None:  # words without bounds: nothing to be near to
        return False
    return abs(ours - value) <= (AGREES * abs(value) if value else _SMALL)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _found(number: Published, sources: Sources) -> Value:
    try:
        if not number.of:
            return _OTHERS[number.key](sources)
        if number.quantity == "gamma0":
            case = dimers.of_point(number.of[0])
            ours = dimer_of(case).gamma0(case.drive.peak_acceleration)
            return Value(ours, ours, ours)
        tried = [_speed(point, number.quantity, sources) for point in number.of]
        if number.over:
            below = [_speed(point, number.quantity, sources) for point in number.over]
            pairs = zip(tried, below, strict=True)
            tried = [_quotient(one or Value(), other or Value()) for one, other in pairs if one or other]
    except NothingFinishedError:
        return Value()
    return _together([one for one in tried if one is not None])


def _together(values: Sequence[Value]) -> Value:
    """The mean over some points, with its range over these; of one point itself."""
    if len(values) <= 1:
        return values[0] if values else Value()
    engine = [value.engine for value in values]
    theory, left_out = fmean(value.theory for value in values), sum(value.left_out for value in values)
    whole = not np.isnan(engine).any()
    low, high = (min(engine), max(engine)) if whole else (nan, nan)
    return Value(float(np.mean(engine)), low, high, theory, left_out)


def _speed(point: Point, quantity: str, sources: Sources) -> Value | None:
    """A speed of the walkers of a point, and the theory's; None if the point is not among the finished."""
    rows, theory = sources.rows(point), _theory(point, quantity)
    if rows.empty:
        return None
    if quantity == "velocity_of_all":
        mean, low, high = (float(rows[name].mean()) * 1e3 for name in ("velocity", "smallest", "largest"))
        return Value(mean, low, high, theory)
    walkers = steady_walkers(rows["run"].iloc[0])[quantity].to_numpy() * 1e3
    left_out = int(rows["walkers"].iloc[0]) - len(walkers)
    if not len(walkers):
        return Value(theory=theory, left_out=left_out)
    return Value(float(walkers.mean()), float(walkers.min()), float(walkers.max()), theory, left_out)


def _theory(point: Point, quantity: str) -> float:
    """Of the shipped case at a point; NaN for what contacts do that open."""
    motion = motion_of(dimers.of_point(point))
    family, _, _ = quantity.partition("_")
    if family == "velocity":
        return float(motion.velocity[0]) * 1e3
    return nan if motion.opened[0] else float(getattr(motion, family)[0, 0]) * 1e3


def _quotient(over: Value, under: Value) -> Value:
    ratio = over.engine / under.engine
    return Value(ratio, ratio, ratio, over.theory / under.theory, over.left_out + under.left_out)


def _threshold(sources: Sources) -> tuple[Value, Value]:
    """Γc between the last drive that moved the walkers and the first that did not; ratios with the error of both."""
    sources.finished("fig2-threshold")
    ends = thresholds(sources.out / "fig2-threshold").sort_values("drive.frequency")
    low, high = ends["gamma0_at_rest"].to_numpy(), ends["gamma0_moving"].to_numpy()
    middle, case = (low + high) / 2.0, dimers.shipped()
    slow, fast = (float(ends["drive.frequency"].iloc[end]) for end in (0, -1))
    first, last = (threshold(one) for f in (slow, fast) for one in dimers.driven(case, f, [published.GRAVITY]))
    ratio = Value(float(middle[-1] / middle[0]), float(low[-1] / high[0]), float(high[-1] / low[0]), last / first)
    return Value(float(middle.mean()), float(low.min()), float(high.max()), float(np.mean([first, last]))), ratio


def _alignment(sources: Sources, *, symmetric: bool) -> Value:
    table = sources.finished("alignment")
    runs = table["run"][dimers.symmetric(table) == symmetric]
    if runs.empty:
        return Value()
    found = np.concatenate([misalignment(run) for run in runs])
    return Value(float(found.min() if symmetric else found.max()), float(found.min()), float(found.max()))


_OTHERS: Mapping[str, Callable[[Sources], Value]] = {
    "fig2_threshold": lambda sources: _threshold(sources)[0],
    "fig2_threshold_frequency": lambda sources: _threshold(sources)[1],
    "alignment_asymmetric": partial(_alignment, symmetric=False),
    "alignment_symmetric": partial(_alignment, symmetric=True),
    "mathieu": lambda _: Value(theory=max(one.v for one in paper_drives().values())),
    "mathieu_stable": lambda _: Value(theory=largest_stable_v()),
}


def count(rows: list[Row], *, measured: bool) -> tuple[int, int]:
    """How many rows agree, of how many: those in which the engine has a say, or the others; none that is in words."""
    chosen = [row for row in rows if row.measured == measured and row.published is not None]
    return sum(row.agrees for row in chosen), len(chosen)


def as_dict(rows: list[Row]) -> dict[str, object]:
    """The comparison for JSON."""
    agree, of = count(rows, measured=True)
    return {"agree": agree, "of": of, "tolerance": AGREES, "numbers": [asdict(row) for row in rows]}


def as_markdown(rows: list[Row]) -> str:
    """The comparison as a table, and below it what disagrees and why."""
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if not row.agrees:
            reasons.setdefault(row.why, []).append(row.what)
    engine, others = (count(rows, measured=measured) for measured in (True, False))
    shown = {"engine": engine, "others": others, "tolerance": AGREES, "rows": rows, "reasons": reasons}
    return rendered("walkers.paper", "comparison.md.j2", **shown)
