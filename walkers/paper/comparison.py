"""Every published number beside this project's: ``comparison.md`` and ``comparison.json``."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.inputs.text import rendered
from walkers.paper import dimers, published
from walkers.paper.alignment import paper_drives
from walkers.paper.published import NUMBERS, Published
from walkers.paper.sensitivity import misalignment
from walkers.paper.sources import NothingFinishedError, Sources
from walkers.postprocess.steady_state import steady_walkers
from walkers.sweeps.table import thresholds
from walkers.theory.mathieu import largest_stable_v
from walkers.theory.prediction import motion_of, threshold

if TYPE_CHECKING:
    import pandas as pd

    from walkers.inputs.case import Case

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

    engine: float
    low: float
    high: float
    theory: float = float("nan")
    left_out: int = 0


_NOTHING = Value(float("nan"), float("nan"), float("nan"))
_OF_THEORY = ("mathieu", "mathieu_stable")
"""Numbers of which the engine knows nothing."""


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
    values: dict[str, Value] = {}
    for group in (_fig2, _threshold, _fig3, _fig4, _alignment, _mathieu):
        try:
            values |= group(sources)
        except NothingFinishedError:
            continue
    return [_row(number, values.get(number.key, _NOTHING)) for number in NUMBERS]


def _row(number: Published, value: Value) -> Row:
    ours = value.theory if number.key in _OF_THEORY else value.engine
    within = None if number.bounds is None else number.bounds[0] <= ours <= number.bounds[1]
    agrees = within if within is not None else _near(ours, number.value)
    return Row(
        key=number.key,
        what=number.what,
        unit=number.unit,
        published=number.value,
        measured=number.measured,
        engine=_finite(value.engine),
        low=_finite(value.low),
        high=_finite(value.high),
        theory=_finite(value.theory),
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


def _speed(rows: pd.DataFrame, column: str = "velocity", theory: float = float("nan")) -> Value:
    """The mean over some points; its range over walkers of one point, or over several points. NaN if one has none."""
    walkers = [steady_walkers(run)[column].to_numpy() * 1e3 for run in rows["run"]]
    left_out = int(rows["walkers"].sum()) - sum(map(len, walkers))
    if not walkers or not all(map(len, walkers)):
        return replace(_NOTHING, theory=theory, left_out=left_out)
    means = np.array([one.mean() for one in walkers])
    ends = walkers[0] if len(rows) == 1 else means
    return Value(float(means.mean()), float(ends.min()), float(ends.max()), theory, left_out)


def _speed_of_all(rows: pd.DataFrame, theory: float) -> Value:
    """As `_speed`, but of all walkers, whichever way they turn."""
    mean, low, high = (float(rows[name].mean()) * 1e3 for name in ("velocity", "smallest", "largest"))
    return Value(mean, low, high, theory)


def _theory(case: Case) -> float:
    return float(motion_of(case).velocity[0]) * 1e3


def _fig2(sources: Sources) -> dict[str, Value]:
    table, case = sources.finished("fig2"), dimers.shipped()
    dimer = dimer_of(case)
    values = {}
    frequencies = sorted(table["frequency"].unique())
    for g in published.FIT:
        rows = table[np.isclose(table["peak_acceleration"], g * published.GRAVITY)]
        cases = [one for f in frequencies for one in dimers.driven(case, f, [g * published.GRAVITY])]
        values[f"fig2_{g:g}g"] = _speed(rows, theory=float(motion_of(*cases).velocity.mean() * 1e3))
        values[f"fig2_gamma_{g:g}g"] = _exact(dimer.gamma0(g * published.GRAVITY))
    slow, fast = frequencies[0], frequencies[-1]
    values["fig2_frequency"] = _quotient(table, case, (fast, published.PLATEAU), (slow, published.PLATEAU))
    plateau = [_quotient(table, case, (f, 10.0), (f, published.PLATEAU)) for f in frequencies]
    values["fig2_plateau"] = _mean(plateau)
    return values


def _threshold(sources: Sources) -> dict[str, Value]:
    """Γc between the last drive that moved the walkers and the first that did not; ratios with the error of both."""
    sources.finished("fig2-threshold")
    ends = thresholds(sources.out / "fig2-threshold").sort_values("drive.frequency")
    low, high = ends["gamma0_at_rest"].to_numpy(), ends["gamma0_moving"].to_numpy()
    middle, case = (low + high) / 2.0, dimers.shipped()
    slow, fast = (float(ends["drive.frequency"].iloc[end]) for end in (0, -1))
    predicted = [threshold(one) for f in (slow, fast) for one in dimers.driven(case, f, [published.GRAVITY])]
    return {
        "fig2_threshold": Value(float(middle.mean()), float(low.min()), float(high.max()), float(np.mean(predicted))),
        "fig2_threshold_frequency": Value(
            float(middle[-1] / middle[0]),
            float(low[-1] / high[0]),
            float(high[-1] / low[0]),
            predicted[1] / predicted[0],
        ),
    }


def _exact(value: float, theory: float = float("nan")) -> Value:
    return Value(float(value), float(value), float(value), float(theory))


def _mean(values: list[Value]) -> Value:
    engine = [value.engine for value in values]
    theory, left_out = float(np.mean([value.theory for value in values])), sum(value.left_out for value in values)
    return Value(float(np.mean(engine)), min(engine), max(engine), theory, left_out)


def _quotient(table: pd.DataFrame, case: Case, upper: tuple[float, float], lower: tuple[float, float]) -> Value:
    """A ratio of two speeds, each at a frequency in Hz and an acceleration in g."""

    def at(drive: tuple[float, float]) -> Value:
        frequency, peak = drive[0], drive[1] * published.GRAVITY
        rows = table[(table["frequency"] == frequency) & np.isclose(table["peak_acceleration"], peak)]
        return _speed(rows, theory=_theory(dimers.driven(case, frequency, [peak])[0]))

    over, under = at(upper), at(lower)
    found = _exact(over.engine / under.engine, over.theory / under.theory)
    return replace(found, left_out=over.left_out + under.left_out)


def _fig3(sources: Sources) -> dict[str, Value]:
    table, case = sources.finished("fig3"), dimers.shipped()
    values = {}
    for r1, r2 in published.FIG3_FIT:
        radii = (r1 * 1e-3, r2 * 1e-3)
        rows = table[np.isclose(table["radius_1"], radii[0]) & np.isclose(table["radius_2"], radii[1])]
        values[f"fig3_{r1:g}_{r2:g}"] = _speed(rows, theory=_theory(dimers.of_radii(case, radii, 0.5)))
    still = table[dimers.symmetric(table)]
    values["fig3_symmetric"] = _speed_of_all(still, _theory(dimers.of_asymmetry(case, 0.0, 0.5)))
    return values


def _fig4(sources: Sources) -> dict[str, Value]:
    values = {}
    table = sources.finished("fig4")
    for letter, peak in zip("ab", published.FIG4_PEAKS, strict=True):
        motion = motion_of(load_case(f"fig4{letter}"))
        rows = table[np.isclose(table["peak_acceleration"], peak * published.GRAVITY)]
        values[f"fig4{letter}_gamma"] = _exact(rows["gamma0"].mean())
        values[f"fig4{letter}_velocity"] = _speed(rows, theory=float(motion.velocity[0]) * 1e3)
        # Where a contact opens the theory says nothing.
        rotation, sliding = np.where(motion.opened[0], np.nan, [motion.rotation[0, 0], motion.sliding[0, 0]]) * 1e3
        values[f"fig4{letter}_rotation"] = _speed(rows, "rotation_1", float(rotation))
        values[f"fig4{letter}_sliding"] = _speed(rows, "sliding_1", float(sliding))
    return values


def _alignment(sources: Sources) -> dict[str, Value]:
    table = sources.finished("alignment")
    values = {}
    for name, chosen, worst in (
        ("alignment_asymmetric", ~dimers.symmetric(table), np.max),
        ("alignment_symmetric", dimers.symmetric(table), np.min),
    ):
        angles = [misalignment(run) for run in table["run"][chosen]]
        if angles:
            found = np.concatenate(angles)
            values[name] = Value(float(worst(found)), float(found.min()), float(found.max()))
    return values


def _mathieu(_: Sources) -> dict[str, Value]:
    nothing = float("nan")
    return {
        "mathieu": Value(nothing, nothing, nothing, max(one.v for one in paper_drives().values())),
        "mathieu_stable": Value(nothing, nothing, nothing, largest_stable_v()),
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
